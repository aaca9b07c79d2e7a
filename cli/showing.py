"""A result in the mode that is set: tables, records and trees for people, the rest for programs."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

from cgdb.cli import render, tables
from cgdb.cli.tables import Grid, grid

if TYPE_CHECKING:
    from rich.text import Text

    from cgdb.cli.session import Answer, Session
    from cgdb.result import Reason, Result, Row

HEAD_AND_FOOT = 4
"""Lines of a table that are not rows, and the statement above it."""


def show(session: Session, answer: Answer, *, everything: bool = False) -> None:
    """A result on the screen."""
    result, screen, settings = answer.result, session.screen, session.settings
    for line in result.warnings:
        screen.note(f"note: {line}")
    if result.columns == ("plan",):
        screen.print(*plan_lines(result, session))
        return
    mode = settings["mode"]
    if mode == "tree":
        screen.page(_trees(result, why=settings["why"]))
    elif mode != "table":
        columns = tuple(dict.fromkeys((*result.columns, "score", "fits", *(("why",) if settings["why"] else ()))))
        render.records(result.to_dicts(why=settings["why"]), columns, mode)
    else:
        shown = _count(session, len(result.rows), everything=everything)
        lines = rows_of(session, result, shown)
        if everything:
            screen.page(lines)
        else:
            screen.print(*lines)
        if screen.terminal or result.nothing_fits:
            screen.note(footer(result, shown, answer.seconds))
    if settings["timing"]:
        stages = ", ".join(f"{stage} {1000 * seconds:.1f}" for stage, seconds in result.timings.items())
        screen.note(f"{1000 * answer.seconds:.1f} ms ({stages})")


def rows_of(session: Session, result: Result, shown: int) -> list[Text]:
    """The first rows of a result as a table, or as records where a table would not fit or is not wanted."""
    screen, settings = session.screen, session.settings
    rows = result.rows[:shown]
    if not rows:
        return []
    made = cells(result, rows)
    width = screen.width if screen.terminal or settings["width"] else None
    bars = settings["bars"] and screen.terminal
    lines = None
    if settings["expand"] != "on" and not settings["why"]:
        lines = tables.table(made, screen, width=width, bars=bars, numbered=screen.terminal)
        if lines is None and settings["expand"] == "off":
            lines = tables.table(made, screen, width=None, bars=bars, numbered=screen.terminal)
    if lines is None:
        lines = []
        for n, row in enumerate(rows):
            lines += tables.record(made, n, screen, width=width, bars=bars, of=len(result.rows))
            if settings["why"]:
                lines += why_lines(session, row)
    return lines


def cells(result: Result, rows: Sequence[Row], first: int = 1) -> Grid:
    """The values, with the caption beside an object that stands alone, and scores where they differ."""
    from cgdb.result import StoredNode

    single = len(result.columns) == 1 and any(isinstance(row.values[0], StoredNode) for row in rows)
    columns = (*result.columns, "caption") if single else result.columns
    values: list[Sequence[Any]] = [
        (*row.values, row.values[0].caption if isinstance(row.values[0], StoredNode) else None)
        if single
        else row.values
        for row in rows
    ]
    if (scenes := render.scene_column(rows)) is not None:
        columns, values = (*columns, "scene"), [(*row, scene) for row, scene in zip(values, scenes, strict=True)]
    told = any(not row.fits or row.score < 1.0 for row in result.rows)
    return grid(columns, values, scores=[(row.score, row.fits) for row in rows] if told else None, first=first)


def footer(result: Result, shown: int, seconds: float | None = None) -> str:
    """How many rows there are, how many fit, and how long it took."""
    n = len(result.rows)
    parts = [f"{n:,} row{'' if n == 1 else 's'}" if n else "no rows"]
    if shown < n:
        parts[0] = f"{shown:,} of {parts[0]} (:all shows the rest)"
    fitting = sum(row.fits for row in result.rows)
    if n and not fitting:
        parts.append("nothing fits: these are the nearest")
    elif fitting < n:
        parts.append(f"{fitting:,} fit{'s' if fitting == 1 else ''}")
    if seconds is not None:
        parts.append(f"{1000 * seconds:.0f} ms" if seconds < 1 else f"{seconds:.1f} s")
    return " · ".join(parts)


def _count(session: Session, n: int, *, everything: bool) -> int:
    rows = session.settings["rows"]
    if everything or (rows is None and not session.interactive):
        return n
    if rows is None:
        rows = max(5, session.screen.room - HEAD_AND_FOOT)
        # Leaving out one or two rows saves nothing.
        rows = n if n <= rows + 2 else rows
    return min(int(rows), n)


def why_lines(session: Session, row: Row) -> list[Text]:
    """Why a row is there: each thing that was asked with its degree, and the evidence below."""
    screen = session.screen
    lines = []
    for reason in row.why:
        lines += _reason_lines(session, reason)
    if not row.why:
        lines.append(screen.text(("faint", "  nothing was asked of it")))
    return lines


def _reason_lines(session: Session, reason: Reason) -> list[Text]:
    screen = session.screen
    bars = session.settings["bars"] and screen.terminal
    width = screen.limit
    head = screen.text(("", "  "))
    head.append_text(tables.scored(reason.degree, reason.degree >= 0.5, screen, bars=bars, width=width))
    head.append("  ")
    head.append(render.clean(reason.asked), screen.ink("head"))
    lines = [head]
    for name, value in reason.evidence.items():
        text = f"{render.clean(name)}: {render.clean(value)}"
        for n, part in enumerate(tables.folded(text, None if width is None else max(20, width - 8))):
            lines.append(screen.text(("faint", ("      " if n == 0 else "        ") + part)))
    return lines


def plan_lines(result: Result, session: Session) -> list[Text]:
    """The steps of a plan, the name of each step in colour."""
    lines = []
    for row in result.rows:
        step, colon, rest = render.clean(row.values[0]).partition(": ")
        lines.append(session.screen.text(("head", step + colon), ("", rest)))
    return lines


def _trees(result: Result, *, why: bool) -> list[str]:
    lines: list[str] = []
    for number, record in enumerate(result.to_dicts(why=why), start=1):
        score, fits = record.pop("score"), record.pop("fits")
        title = f"{number}  {score:.2f}{' ✓' if fits else ''}" if isinstance(score, float) else str(number)
        lines += tables.tree(record, title)
    return lines
