"""How answers are shown: tables for people, JSON, JSON lines, CSV and markdown for programs."""

from __future__ import annotations

import csv
import io
import json
import sys
from collections.abc import Iterable, Mapping, Sequence
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from rich.console import Console

SHOWN = 20
"""Rows of a table that are shown unless all are asked for."""


def console(*, stderr: bool = False) -> Console:
    """A rich console on stdout or stderr; plain where that is no terminal."""
    from rich.console import Console

    class Piped(Console):
        def on_broken_pipe(self) -> None:
            """`cgdb demo | head` ends as every other command does; rich's own way is exit code 1."""
            raise BrokenPipeError

    stream = sys.stderr if stderr else sys.stdout
    width = None if stream.isatty() else 120
    return Piped(stderr=stderr, width=width, highlight=False, soft_wrap=False)


def write(text: str) -> None:
    """Data to stdout, in UTF-8 whatever the locale says; a terminal gets no control characters."""
    if sys.stdout.isatty():
        text = clean_lines(text)
    sys.stdout.buffer.write(text.encode("utf-8", "replace"))
    sys.stdout.buffer.write(b"\n")
    sys.stdout.flush()


def say(text: str, quiet: bool = False) -> None:
    """A line for people, on stderr, unless nothing is to be said."""
    if not quiet:
        sys.stderr.write(clean(text) + "\n")


def clean(value: object) -> str:
    """A value as one line of text without control characters: a map's captions must not drive the terminal."""
    if value is None:
        return ""
    if isinstance(value, float):
        text = f"{value:.4g}" if abs(value) < 1e6 else f"{value:.6g}"
    elif isinstance(value, bool):
        text = "true" if value else "false"
    elif isinstance(value, (list, tuple)):
        text = ", ".join(clean(item) for item in value)
    else:
        text = str(value)
    return "".join(c if c.isprintable() else " " for c in text)


def clean_lines(text: str) -> str:
    """Several lines of our own with names from a map in them, without control characters."""
    return "".join(c if c in "\n\t" or c.isprintable() else "\ufffd" for c in text)


def records(rows: Sequence[Mapping[str, Any]], columns: Sequence[str], form: str) -> None:
    """Rows for a program: all of them, every field."""
    if form == "json":
        write(json.dumps(rows, ensure_ascii=False, indent=2))
    elif form == "jsonl":
        for row in rows:
            write(json.dumps(row, ensure_ascii=False))
    elif form == "csv":
        buffer = io.StringIO()
        writer = csv.writer(buffer, lineterminator="\n")
        writer.writerow(columns)
        writer.writerows([_cell(row.get(name)) for name in columns] for row in rows)
        write(buffer.getvalue().rstrip("\n"))
    else:
        write("| " + " | ".join(columns) + " |")
        write("|" + " --- |" * len(columns))
        for row in rows:
            cells = (clean(_cell(row.get(name))).replace("|", "\\|") for name in columns)
            write("| " + " | ".join(cells) + " |")


def _cell(value: Any) -> Any:
    """A node or relation in one cell: its id and tag."""
    if isinstance(value, dict) and "id" in value:
        return f"#{value['id']} {value['tag']}" if value.get("tag") else f"#{value['id']}"
    if isinstance(value, dict) and "source" in value:
        return f"#{value['source']} {value['label']} #{value['target']}"
    if isinstance(value, dict) and "asked" in value:
        return f"{value['asked']}: {value['degree']:.2f}"
    if isinstance(value, dict):
        return ", ".join(str(_cell(item)) for item in value.get("relations", ()))
    if isinstance(value, list):
        return ", ".join(str(_cell(item)) for item in value)
    return value


def scene_column(rows: Sequence[Any]) -> list[str] | None:
    """The scene of each row, where rows of several scenes are shown together: ids alone would not tell them apart."""
    from cgdb.result import StoredNode, StoredRelation

    told = [
        next((value.scene for value in row.values if isinstance(value, (StoredNode, StoredRelation))), "")
        for row in rows
    ]
    return told if len(set(told)) > 1 else None


def table(
    out: Console,
    columns: Sequence[str],
    rows: Iterable[Sequence[object]],
    *,
    scores: Sequence[tuple[float, bool | None]] | None = None,
    footer: str | None = None,
) -> None:
    """A table for a person; records where it does not fit the terminal. scores: (score, fits) per row."""
    from rich.text import Text

    from cgdb.cli import tables
    from cgdb.cli.screen import Screen
    from cgdb.cli.settings import Settings

    screen = Screen(Settings())
    marks = None if scores is None else [(score, fits is not False) for score, fits in scores]
    made = tables.grid(columns, list(rows), scores=marks)
    width = screen.limit
    lines = tables.table(made, screen, width=width, bars=False, numbered=False)
    if lines is None:
        records = (tables.record(made, n, screen, width=width, bars=False) for n in range(len(made.cells)))
        lines = [line for record in records for line in record]
    for line in lines if made.cells else ():
        out.print(line, soft_wrap=True)
    if footer:
        out.print(Text(footer, style="dim"), soft_wrap=True)
