"""What a path holds, found by looking at the content: a folder, JSON, JSON lines or a pickle, each perhaps gzipped."""

from __future__ import annotations

import hashlib
from pathlib import Path
from typing import Any, BinaryIO, Literal

from cgdb.errors import FormatError
from cgdb.ingest import gunzip, strict_json

Kind = Literal["folder", "json", "jsonl", "pickle"]
LONGEST_LINE = 64 << 20
"""Bytes of one JSON line: a record with its vectors and points."""


class Source:
    """A path, the kind of its content, and its parsed value, read once however many readers look at it."""

    def __init__(self, path: str | Path, *, max_bytes: int | None = None) -> None:
        self.path = Path(path)
        self.max_bytes = max_bytes
        self._value: Any = None
        self._is_read = False
        try:
            self.kind: Kind = self._look()
        except OSError as error:
            raise FormatError(f"the file cannot be read: {error.strerror or error}") from error

    def open(self) -> BinaryIO:
        """The content as bytes, unpacked and bounded."""
        return gunzip.open_bounded(self.path, max_bytes=self.max_bytes)

    def value(self) -> Any:
        """The parsed content of JSON and pickle files; None for folders and JSON lines, read piece by piece."""
        if not self._is_read:
            if self.kind == "json":
                with self.open() as file:
                    self._value = strict_json.parse(file.read())
            elif self.kind == "pickle":
                from cgdb.ingest import pickles

                with self.open() as file:
                    self._value = pickles.load(file, size=self.path.stat().st_size)
            self._is_read = True
        return self._value

    def records(self) -> list[dict[str, Any]]:
        """The objects of a JSON list, or nothing when the value is no list of objects."""
        value = self.value() if self.kind == "json" else None
        if isinstance(value, list) and value and all(isinstance(item, dict) for item in value):
            return value
        return []

    def sha256(self) -> str | None:
        """Digest of the file as it lies on disk; None for a folder."""
        if self.kind == "folder":
            return None
        with self.path.open("rb") as file:
            return hashlib.file_digest(file, "sha256").hexdigest()

    def default_name(self) -> str:
        """The scene's name when nobody gave one: the file's, without its endings."""
        name = self.path.resolve().name
        for ending in (".gz", ".pkl", ".json", ".jsonl", ".ndjson"):
            name = name.removesuffix(ending)
        return name[:256] or "scene"

    def _look(self) -> Kind:
        if not self.path.exists():
            raise FormatError("there is no such file or folder", hint="check the path")
        if self.path.is_dir():
            return "folder"
        if not self.path.is_file():
            raise FormatError("this is neither a file nor a folder")
        if self.path.stat().st_size == 0:
            raise FormatError("the file is empty")
        with self.open() as file:
            head = file.read(2)
            if head[:1] == b"\x80" or (head[:1] in b"(c]}lN" and head != b"nu"):
                return "pickle"
        return "jsonl" if self._has_lines() else "json"

    def _has_lines(self) -> bool:
        """Is each of the first two lines with text a JSON object by itself?"""
        found = 0
        with self.open() as file:
            while line := file.readline(LONGEST_LINE):
                text = line.strip().removeprefix(b"\xef\xbb\xbf")
                if not text:
                    continue
                # A line of an indented file is no whole object, and nothing that long needs parsing to be told apart.
                if not (text.startswith(b"{") and text.endswith(b"}")):
                    return False
                try:
                    strict_json.parse(text)
                except FormatError:
                    # A bad first line is bad JSON in either reading; a bad later one is a bad line.
                    return found > 0
                found += 1
                if found == 2:
                    return True
        return False
