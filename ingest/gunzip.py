"""Read a file, gzipped or not, without letting it unfold into more memory than it is worth."""

from __future__ import annotations

import gzip
import io
import zlib
from pathlib import Path
from typing import BinaryIO, cast

from cgdb.errors import FormatError

GZIP_MAGIC = b"\x1f\x8b"
LARGEST = 8 << 30
"""Bytes, unfolded. Maps of whole buildings with all their masks stay below it."""
LARGEST_RATIO = 400
"""Unfolded over packed. Maps with masks reach 100; deflate's own ceiling, which bombs sit at, is 1032."""
ALWAYS_ALLOWED = 64 << 20
"""Bytes, unfolded, whatever the ratio: a tiny map of empty masks packs as well as a bomb does, and harms no one."""


def is_gzip(path: Path) -> bool:
    """Does the file start as gzip does?"""
    with path.open("rb") as file:
        return file.read(2) == GZIP_MAGIC


def limit_for(path: Path, max_bytes: int | None) -> int:
    """How many bytes the file may unfold to."""
    if max_bytes is not None:
        return max_bytes
    return max(ALWAYS_ALLOWED, min(LARGEST, LARGEST_RATIO * path.stat().st_size))


def open_bounded(path: Path, *, max_bytes: int | None = None) -> BinaryIO:
    """The file's content, unfolded while it is read; FormatError as soon as it outgrows its limit or is damaged."""
    limit = limit_for(path, max_bytes)
    raw = cast(BinaryIO, gzip.GzipFile(path, "rb")) if is_gzip(path) else path.open("rb")
    return cast(BinaryIO, io.BufferedReader(_Bounded(raw, limit), buffer_size=1 << 18))


class _Bounded(io.RawIOBase):
    """Counts what is read, and says in one line what gzip says in several exceptions."""

    def __init__(self, inner: BinaryIO, limit: int) -> None:
        self._inner = inner
        self._left = limit
        self._limit = limit

    def readable(self) -> bool:
        return True

    def readinto(self, buffer: object) -> int:
        view = memoryview(cast(bytearray, buffer)).cast("B")
        try:
            # One byte beyond the limit is asked for, to tell a file that ends there from one that goes on.
            chunk = self._inner.read(min(len(view), self._left + 1, 1 << 20))
        except EOFError as error:
            raise FormatError("the gzip data is cut off: the file is truncated", hint="copy the file again") from error
        except (gzip.BadGzipFile, zlib.error) as error:
            raise FormatError(f"the gzip data is damaged ({error})", hint="copy the file again") from error
        self._left -= len(chunk)
        if self._left < 0:
            raise FormatError(
                f"the file unfolds to more than {self._limit:,} bytes: this looks like a gzip bomb",
                hint="if you trust the file, pass a larger max_bytes",
            )
        view[: len(chunk)] = chunk
        return len(chunk)

    def close(self) -> None:
        self._inner.close()
        super().close()
