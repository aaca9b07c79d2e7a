"""Colour and depth pictures from files: decoding, checks, and depth in metres."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from cgdb.errors import FormatError, MissingExtraError

LARGEST_FILE = 256 << 20
MOST_PIXELS = 64 << 20


def color(path: Path) -> NDArray[np.uint8]:
    """(h, w, 3) uint8 RGB of a picture file. FormatError where it is damaged or none."""
    with _opened(path) as picture:
        try:
            return np.asarray(picture if picture.mode == "RGB" else picture.convert("RGB"), dtype=np.uint8)
        except (OSError, ValueError, SyntaxError) as error:
            raise FormatError(f"{path.name}: the colour picture is damaged") from error


def raw(path: Path) -> NDArray[Any]:
    """(h, w) numbers of a one-channel picture (8 or 16 bits, or float) or of a .npy file, as they are stored."""
    if path.suffix == ".npy":
        return array(path)
    with _opened(path) as picture:
        try:
            values = np.asarray(picture)
        except (OSError, ValueError, SyntaxError) as error:
            raise FormatError(f"{path.name}: the picture is damaged") from error
    if values.ndim != 2:
        raise FormatError(f"{path.name}: has {values.shape[-1]} channels where one was expected")
    return values


def depth(path: Path, scale: float, invalid_above: float) -> NDArray[np.float32]:
    """(h, w) float32 m; 0 where the camera measured nothing: not finite, not positive, or above invalid_above."""
    try:
        values = raw(path)
    except FormatError as error:
        raise FormatError(f"{path.name}: the depth is damaged or none", hint=error.hint) from error
    if values.ndim == 3 and values.shape[2] == 1:
        values = values[:, :, 0]
    if values.ndim != 2 or values.dtype.kind not in "uif":
        raise FormatError(f"{path.name}: the depth has shape {values.shape}, expected (height, width)")
    metres = values.astype(np.float32)
    metres *= np.float32(1.0 / scale)
    with np.errstate(invalid="ignore"):
        metres[~((metres > 0) & (metres < invalid_above))] = 0.0
    return metres


def array(path: Path) -> NDArray[Any]:
    """The array of a .npy file; never one of objects."""
    try:
        if path.stat().st_size > LARGEST_FILE:
            raise FormatError(f"{path.name}: is larger than {LARGEST_FILE >> 20} MB")
        values: NDArray[Any] = np.load(path, allow_pickle=False)
    except (OSError, ValueError, EOFError) as error:
        raise FormatError(f"{path.name}: is no array that can be read") from error
    return values


def resized(rgb: NDArray[np.uint8], size: tuple[int, int]) -> NDArray[np.uint8]:
    """(height, width, 3) the picture at (width, height); areas are averaged when it gets smaller."""
    image = _pillow()
    smaller = size[0] < rgb.shape[1]
    how = image.Resampling.BOX if smaller else image.Resampling.BILINEAR
    return np.asarray(image.fromarray(rgb).resize(size, how), dtype=np.uint8)


def size_of(path: Path) -> tuple[int, int]:
    """(width, height) of a picture file, without decoding it."""
    with _opened(path) as picture:
        return int(picture.size[0]), int(picture.size[1])


def _opened(path: Path) -> Any:
    image = _pillow()
    try:
        picture = image.open(path)
    except FileNotFoundError as error:
        raise FormatError(f"{path.name}: is not there") from error
    except (OSError, ValueError, SyntaxError, image.DecompressionBombError) as error:
        raise FormatError(f"{path.name}: is no picture that can be read") from error
    if picture.size[0] * picture.size[1] > MOST_PIXELS:
        picture.close()
        raise FormatError(f"{path.name}: has more than {MOST_PIXELS >> 20} million pixels")
    return picture


def _pillow() -> Any:
    try:
        from PIL import Image
    except ImportError as error:
        raise MissingExtraError(
            "reading pictures needs Pillow, which is not installed", hint="pip install 'cgdb[map]'"
        ) from error
    return Image
