"""The parts of a zip archive or of the folder that it was unpacked to, each read whole and within a bound."""

from __future__ import annotations

import lzma
import struct
import zipfile
import zlib
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from cgdb.errors import FormatError

MOST_PARTS = 1_000_000
_DAMAGED = (
    OSError, ValueError, EOFError, RuntimeError, zipfile.BadZipFile, zlib.error, lzma.LZMAError, struct.error
)  # fmt: skip
"""What zipfile raises for a stranger's archive; RuntimeError where a part is encrypted."""


class Archive:
    """What lies under a path, by the names of an archive: words with slashes between them."""

    def __init__(self, root: Path) -> None:
        self._root = root
        self._zip: zipfile.ZipFile | None = None
        if root.is_dir():
            return
        with _told(root.name):
            self._zip = zipfile.ZipFile(root)
        if len(self._zip.infolist()) > MOST_PARTS:
            raise FormatError(f"{root.name}: has more than {MOST_PARTS:,} parts")

    def names(self, folder: str) -> list[str]:
        """The names of the parts directly in a folder, without it."""
        if self._zip is None:
            at = self._root / folder
            return [path.name for path in at.iterdir()] if at.is_dir() else []
        inside = [name.removeprefix(f"{folder}/") for name in self._zip.namelist() if name.startswith(f"{folder}/")]
        return [name for name in inside if name and "/" not in name]

    def holds(self, name: str) -> bool:
        """Whether there is such a part."""
        if self._zip is None:
            return (self._root / name).is_file()
        return name in self._zip.NameToInfo

    def read(self, name: str, most: int) -> bytes:
        """The bytes of a part; FormatError where there is none, it is damaged, or it has more than that."""
        if not self.holds(name):
            raise FormatError(f"{name}: is not there")
        with _told(name):
            if self._zip is None:
                path = self._root / name
                if path.stat().st_size <= most:
                    return path.read_bytes()
            elif self._zip.getinfo(name).file_size <= most:
                return self._zip.read(name)
        raise FormatError(f"{name}: has more than {most:,} bytes")


@contextmanager
def _told(name: str) -> Iterator[None]:
    try:
        yield
    except _DAMAGED as error:
        raise FormatError(f"{name}: is damaged, or no archive that can be read") from error
