"""Crops: the part of a frame that shows an object, small enough to keep ten of each for as long as a map is made."""

from __future__ import annotations

import io
import tempfile
import weakref
from typing import Any

import numpy as np
from numpy.typing import NDArray

from cgdb.errors import MissingExtraError, StoreError
from cgdb.ingest.frames.recording import Frame

PAD = 20
"""Pixels of the surroundings on every side: what a thing stands on says much about it."""
LONGEST = 256
LONGEST_OF_ROOM = 128
"""Pixels of the longer side. Larger ones are scaled down; a wall is told by its colour."""
QUALITY = 75
"""Of the JPEG. Two hundred objects with ten crops each take some 7 MB."""

IN_MEMORY = 64 << 20
"""Bytes of crops above which new ones go to a temporary file."""


class Cropper:
    """Cuts pictures out of one frame."""

    def __init__(self, frame: Frame) -> None:
        self._frame = frame
        self._whole: Any = None

    def __call__(self, box: tuple[float, float, float, float], longest: int = LONGEST) -> bytes:
        """A JPEG of what is in a box (left, top, right, bottom in pixels) and PAD around it."""
        try:
            from PIL import Image
        except ImportError:
            hint = "pip install 'cgdb[map]'"
            raise MissingExtraError("crops need Pillow, which is not installed", hint=hint) from None
        if self._whole is None:
            self._whole = Image.fromarray(self._frame.rgb)
        width, height = self._whole.size
        left, top = (max(0, int(side) - PAD) for side in box[:2])
        right, bottom = min(width, int(np.ceil(box[2])) + PAD), min(height, int(np.ceil(box[3])) + PAD)
        # A box beyond the frame still has its edge there.
        left, top = min(left, width - 1), min(top, height - 1)
        right, bottom = max(right, left + 1), max(bottom, top + 1)
        size, part = (right - left, bottom - top), (left, top, right, bottom)
        scale = longest / max(size)
        if scale < 1.0:
            size = max(1, round(size[0] * scale)), max(1, round(size[1] * scale))
            # Whole pixels are taken together first, which is many times faster.
            picture = self._whole.resize(size, Image.Resampling.BOX, box=part, reducing_gap=1.0)
        else:
            picture = self._whole.crop(part)
        made = io.BytesIO()
        picture.save(made, "JPEG", quality=QUALITY)
        return made.getvalue()


class Crops:
    """The crops that are kept now, by number; above IN_MEMORY bytes they lie in a file that nobody else sees."""

    def __init__(self, in_memory: int = IN_MEMORY) -> None:
        self._most = in_memory
        self._held: dict[int, bytes] = {}
        self._size = 0
        self._file: Any = None
        self._where: dict[int, tuple[int, int]] = {}
        self._end = self._live = 0
        self._next = 0

    def __len__(self) -> int:
        return len(self._held) + len(self._where)

    def keep(self, data: bytes) -> int:
        """Keep a crop; its number."""
        number = self._next
        self._next += 1
        if self._size + len(data) <= self._most:
            self._held[number] = data
            self._size += len(data)
        else:
            self._write(number, data)
        return number

    def get(self, number: int) -> bytes:
        """The crop of a number."""
        if number in self._held:
            return self._held[number]
        start, size = self._where[number]
        self._file.seek(start)
        data: bytes = self._file.read(size)
        return data

    def drop(self, number: int | None) -> None:
        """Forget a crop; None is none."""
        if number is None:
            return
        if number in self._held:
            self._size -= len(self._held.pop(number))
            return
        _, size = self._where.pop(number)
        self._live -= size
        if self._end > self._most and self._live < self._end // 2:
            self._compact()

    def _write(self, number: int, data: bytes) -> None:
        try:
            if self._file is None:
                self._file = tempfile.TemporaryFile(prefix="cgdb-crops-")  # noqa: SIM115
                weakref.finalize(self, self._file.close)
            self._file.seek(self._end)
            self._file.write(data)
            self._file.flush()
        except OSError as error:
            folder = tempfile.gettempdir()
            raise StoreError(
                f"{folder}: crops of the map cannot be kept there: {error.strerror or error}",
                hint="make room, set TMPDIR to another folder, or map with --crops none",
            ) from error
        self._where[number] = (self._end, len(data))
        self._end += len(data)
        self._live += len(data)

    def _compact(self) -> None:
        """A new file of what is still kept: less than half of the old one."""
        before = old, where, _, _ = self._file, self._where, self._end, self._live
        self._file, self._where, self._end, self._live = None, {}, 0, 0
        try:
            for number, (start, size) in where.items():
                old.seek(start)
                self._write(number, old.read(size))
        except StoreError:
            self._file, self._where, self._end, self._live = before  # no room for both: the old one goes on
        else:
            old.close()


def packed(crops: list[bytes]) -> tuple[NDArray[np.uint8], NDArray[np.int64]]:
    """Crops as one row of bytes, and where each ends."""
    ends = np.cumsum([len(data) for data in crops], dtype=np.int64)
    return np.frombuffer(b"".join(crops), np.uint8), ends
