"""What a reader noticed on its way: warnings, and what it left out and why. Ends as the provenance of the scene."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

from cgdb.errors import FormatError, SceneError
from cgdb.ingest.source import Source

MOST_WARNINGS = 50


class Report:
    """Collects warnings and counts; a map with one fault a thousand times gets a bounded list."""

    def __init__(self) -> None:
        self.dropped: Counter[str] = Counter()
        self._warnings: dict[str, None] = {}
        self._unlisted = 0

    def warn(self, text: str) -> None:
        """Note something that a person who relies on this map should know."""
        if text in self._warnings:
            return
        if len(self._warnings) < MOST_WARNINGS:
            self._warnings[text] = None
        else:
            self._unlisted += 1

    def drop(self, reason: str, count: int = 1) -> None:
        """Count something of the file that the scene does not hold."""
        self.dropped[reason] += count

    @property
    def warnings(self) -> list[str]:
        """The warnings in the order they came, the list cut at MOST_WARNINGS."""
        more = [f"and {self._unlisted} more warnings"] if self._unlisted else []
        return [*self._warnings, *more]

    def provenance(self, source: Source, format_name: str, **more: Any) -> dict[str, Any]:
        """Where the scene came from: the file, its digest, what was dropped and what to beware of."""
        return {
            "format": format_name,
            "file": source.path.name,
            "sha256": source.sha256(),
            "dropped": dict(self.dropped),
            "warnings": self.warnings,
            **more,
        }


@contextmanager
def naming(name: str) -> Iterator[None]:
    """Put a file's name in front of any error about its content."""
    try:
        yield
    except (FormatError, SceneError) as error:
        raise type(error)(f"{name}: {error.message}", hint=error.hint) from error
