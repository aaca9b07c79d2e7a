"""Replies of models, kept in the store's folder as they come: what was interrupted or repeated costs nothing."""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping
from hashlib import sha256
from pathlib import Path
from typing import Any, Generic, TypeVar

from cgdb.errors import StoreError

Known = TypeVar("Known")


class Kept(Generic[Known]):
    """JSON lines of {"key", "known", ...}. read: what is kept to what it means; None where it means nothing.

    A damaged line is as good as none: what it held is asked for again.
    """

    def __init__(self, path: Path, read: Callable[[Any], Known | None]) -> None:
        """StoreError where the file is there and cannot be read."""
        self._path = path
        self._known: dict[str, Known] = {}
        try:
            # Not splitlines: a text may hold other ends of lines, such as U+2028, as they are.
            lines = path.read_text("utf-8", errors="replace").split("\n")
        except FileNotFoundError:
            lines = []
        except OSError as error:
            raise StoreError(f"{path} cannot be read: {error.strerror or error}") from None
        for line in lines:
            try:
                record = json.loads(line)
                key, known = record["key"], read(record["known"])
            except (ValueError, KeyError, TypeError, AttributeError, RecursionError):
                continue
            if isinstance(key, str) and known is not None:
                self._known[key] = known

    def get(self, key: str) -> Known | None:
        """What was answered before, if it was."""
        return self._known.get(key)

    def put(self, key: str, known: Known, value: Any, about: Mapping[str, Any]) -> None:
        """Keep an answer. value: known as JSON. about: for people who read the file. StoreError where it cannot."""
        self._known[key] = known
        line = json.dumps({"key": key, **about, "known": value}, ensure_ascii=False)
        try:
            torn = self._path.exists() and self._path.stat().st_size > 0 and not _ends_a_line(self._path)
            with self._path.open("a", encoding="utf-8") as file:
                file.write(("\n" if torn else "") + line + "\n")
        except OSError as error:
            raise StoreError(f"{self._path} cannot be written: {error.strerror or error}") from None


def key_of(*parts: Any) -> str:
    """One name for a question: the same for the same parts."""
    return sha256(json.dumps(parts, ensure_ascii=False).encode("utf-8", "surrogatepass")).hexdigest()[:32]


def _ends_a_line(path: Path) -> bool:
    with path.open("rb") as file:
        file.seek(-1, 2)
        return file.read(1) == b"\n"
