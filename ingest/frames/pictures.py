"""Colour and depth pictures from files or bytes: decoding, checks, and depth in metres."""

from __future__ import annotations

import contextlib
from collections.abc import Iterable
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np
from numpy.typing import NDArray

from cgdb.errors import FormatError, MissingExtraError
from cgdb.ingest import arrays
from cgdb.ingest.frames import exr

MOST_PIXELS = 64 << 20
FORMATS = ("PNG", "JPEG", "PPM", "TIFF", "WEBP", "BMP")
"""What pictures of cameras come in. Pillow knows more, and hands some of it (EPS) to other programs, by content."""


def color(path: Path, file: BinaryIO | None = None) -> NDArray[np.uint8]:
    """(h, w, 3) uint8 RGB of a picture file. FormatError where it is damaged or none.

    file: what the picture is read from, where path only names it.
    """
    with _opened(path, file) as picture:
        try:
            return np.asarray(picture if picture.mode == "RGB" else picture.convert("RGB"), dtype=np.uint8)
        except (OSError, ValueError, SyntaxError) as error:
            raise FormatError(f"{path.name}: the colour picture is damaged") from error


def raw(path: Path) -> NDArray[Any]:
    """(h, w) numbers of a one-channel picture (8 or 16 bits, or float), .npy or .exr file, as they are stored."""
    if path.suffix == ".npy":
        return arrays.of_file(path)
    if path.suffix == ".exr":
        return exr.read(path, MOST_PIXELS)
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
    if values.ndim != 2 or values.dtype.kind not in "uif" or values.size > MOST_PIXELS:
        raise FormatError(f"{path.name}: the depth has shape {values.shape}, expected (height, width)")
    return metres(values, scale, invalid_above)


def metres(values: NDArray[Any], scale: float, invalid_above: float) -> NDArray[np.float32]:
    """(h, w) float32 m of depth in units of which scale are a metre."""
    made = values.astype(np.float32)
    with np.errstate(invalid="ignore", over="ignore"):
        made *= np.float32(1.0 / scale)
        made[~((made > 0) & (made < invalid_above))] = 0.0
    return made


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


def size_of_any(paths: Iterable[Path]) -> tuple[int, int] | None:
    """(width, height) of the first picture that can be read; None where none can."""
    for path in paths:
        with contextlib.suppress(FormatError):
            return size_of(path)
    return None


def _opened(path: Path, file: BinaryIO | None = None) -> Any:
    image = _pillow()
    try:
        picture = image.open(path if file is None else file, formats=FORMATS)
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
