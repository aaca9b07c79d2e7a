"""The one error base of cgdb: message, hint and place, one subclass per stage, and the exit code of each."""

from __future__ import annotations

import difflib
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any, ClassVar


@dataclass(frozen=True, slots=True)
class Span:
    """A stretch of query text: ``text[start:end]``, in characters."""

    start: int
    end: int


class CgdbError(Exception):
    """What went wrong, in one line; where; and what to do about it.

    ``message`` is one line. ``hint`` says what to do. ``span`` and ``source`` place the error in a query text.
    """

    stage: ClassVar[str] = "cgdb"
    exit_code: ClassVar[int] = 1

    def __init__(
        self, message: str, *, hint: str | None = None, span: Span | None = None, source: str | None = None
    ) -> None:
        super().__init__(message)
        self.message = message
        self.hint = hint
        self.span = span
        self.source = source

    def located(self, source: str) -> CgdbError:
        """Give the error the text that its span points into, unless it has one; returns itself."""
        if self.source is None:
            self.source = source
        return self

    @property
    def position(self) -> tuple[int, int] | None:
        """Line and column of the error, both counted from 1, or None when it has no place in a text."""
        if self.span is None or self.source is None:
            return None
        before = self.source[: self.span.start]
        return before.count("\n") + 1, self.span.start - (before.rfind("\n") + 1) + 1

    def render(self) -> str:
        """The error for a person: the line, the caret under the text when there is a place, and the hint."""
        lines = [f"{self.stage} error: {self.message}"]
        place = self.position
        if place is not None and self.span is not None and self.source is not None:
            row, column = place
            text = self.source.split("\n")[row - 1]
            # A window keeps the caret on screen when the statement is one very long line.
            left = max(0, column - 1 - 60)
            window = text[left : left + 120]
            width = max(1, min(self.span.end - self.span.start, len(window) - (column - 1 - left)))
            gutter = f"  {row}:{column} | "
            lines.append(gutter + window.replace("\t", " "))
            lines.append(" " * (len(gutter) - 2) + "| " + " " * (column - 1 - left) + "^" * width)
        if self.hint:
            lines.append(f"hint: {self.hint}")
        return "\n".join(lines)

    def to_json(self) -> dict[str, Any]:
        """The same error for a program: stage, message, hint, and the place as offsets, line and column."""
        place = self.position
        return {
            "stage": self.stage,
            "message": self.message,
            "hint": self.hint,
            "start": self.span.start if self.span else None,
            "end": self.span.end if self.span else None,
            "line": place[0] if place else None,
            "column": place[1] if place else None,
        }


class UsageError(CgdbError):
    """A command or a call was given arguments that do not go together."""

    stage = "usage"
    exit_code = 2


class ParseError(CgdbError):
    """The text is not CGQL."""

    stage = "syntax"
    exit_code = 3


class BindError(CgdbError):
    """A name or a type in the query does not exist in the store."""

    stage = "name"
    exit_code = 3


class ExecuteError(CgdbError):
    """The query is right but could not be carried out."""

    stage = "query"
    exit_code = 4


class LimitError(ExecuteError):
    """The query outgrew one of its limits: time, rows, hops, length or nesting."""

    stage = "limit"


class QueryCancelled(ExecuteError):
    """The person or program that asked took the question back."""

    stage = "cancelled"
    exit_code = 130


class SceneError(CgdbError):
    """A scene graph breaks a rule of its type: duplicate ids, a NaN coordinate, a dangling relation."""

    stage = "scene"
    exit_code = 5


class FormatError(CgdbError):
    """A file is missing, empty, damaged, hostile, or of no format that is known here."""

    stage = "import"
    exit_code = 5


class ExportError(CgdbError):
    """A scene cannot be written in the format that was asked for."""

    stage = "export"
    exit_code = 5


class StoreError(CgdbError):
    """The store cannot be opened, read or written."""

    stage = "store"
    exit_code = 6


class StoreBusyError(StoreError):
    """Another process is writing, and went on doing so until the patience of this one was over."""

    exit_code = 7


class CorruptionError(StoreError):
    """Stored bytes are not the bytes that were written."""

    stage = "damage"
    exit_code = 8


class VersionError(StoreError):
    """The store was written by a newer cgdb than this one."""


class EncoderError(CgdbError):
    """A text or picture could not be turned into a vector."""

    stage = "encoder"
    exit_code = 9


class MissingExtraError(CgdbError):
    """An optional package is needed for what was asked; the hint is the pip line that brings it."""

    stage = "install"
    exit_code = 9


def did_you_mean(name: str, known: Iterable[str], *, most: int = 1) -> str | None:
    """The nearest known names as a hint ("did you mean 'on'?"), or None when nothing is near."""
    names = {str(k).casefold(): str(k) for k in known}
    near = difflib.get_close_matches(str(name).casefold()[:200], list(names), n=most, cutoff=0.6)
    if not near:
        return None
    return "did you mean " + " or ".join(f"'{names[n]}'" for n in near) + "?"


def one_of(known: Iterable[str], *, most: int = 8) -> str:
    """A short listing of what there is, for hints: ``'a', 'b', 'c' and 4 more``."""
    names = [f"'{k}'" for k in known]
    if len(names) <= most:
        return ", ".join(names)
    return ", ".join(names[:most]) + f" and {len(names) - most} more"
