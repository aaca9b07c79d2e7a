"""OpenEXR pictures of one channel, as depth is often rendered or exported."""

from __future__ import annotations

import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from cgdb.errors import FormatError, MissingExtraError

CHANNELS = ("Z", "Y", "V", "R", "depth")
"""Names that depth goes by, the likeliest first; a picture of one channel may call it anything."""


def read(path: Path, most_pixels: int) -> NDArray[Any]:
    """(h, w) half, float or integer numbers, as stored. FormatError where the file is none, or has no such channel."""
    try:
        import OpenEXR
    except ImportError as error:
        raise MissingExtraError(
            "reading .exr files needs OpenEXR, which is not installed", hint="pip install 'cgdb[exr]'"
        ) from error
    if not path.is_file():
        raise FormatError(f"{path.name}: is not there")
    try:
        # What a header announces is looked at before room is made for it.
        with OpenEXR.File(str(path), header_only=True) as file:
            low, high = file.header()["dataWindow"]
        width, height = (int(side) for side in np.subtract(high, low) + 1)
        if width < 1 or height < 1 or width * height > most_pixels:
            raise FormatError(f"{path.name}: is {width} x {height} pixels")
        # The library prints what is wrong with a file, beside raising it or leaving the pixels out.
        with _quiet(), OpenEXR.File(str(path), separate_channels=True) as file:
            channels = file.channels()
            name = next((name for name in CHANNELS if name in channels), None)
            if name is None and len(channels) == 1:
                name = next(iter(channels))
            if name is None:
                raise FormatError(f"{path.name}: has no channel of depth, but {', '.join(sorted(channels))[:100]}")
            pixels = np.array(channels[name].pixels)
    except (RuntimeError, ValueError, TypeError, KeyError, OSError) as error:
        raise FormatError(f"{path.name}: is no OpenEXR picture that can be read") from error
    if pixels.shape != (height, width):
        raise FormatError(f"{path.name}: its pixels are damaged")
    return pixels


_ONE_AT_A_TIME = threading.Lock()


class _Deaf:
    """A stream that writes what other threads print, and not what this one does."""

    def __init__(self, stream: Any) -> None:
        self._stream, self._thread = stream, threading.get_ident()

    def write(self, text: str) -> int:
        return len(text) if threading.get_ident() == self._thread else int(self._stream.write(text))

    def __getattr__(self, name: str) -> Any:
        return getattr(self._stream, name)


@contextmanager
def _quiet() -> Iterator[None]:
    """Nothing of this thread reaches stdout, which is for data."""
    with _ONE_AT_A_TIME:
        before = sys.stdout
        sys.stdout = _Deaf(before)
        try:
            yield
        finally:
            sys.stdout = before
