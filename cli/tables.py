"""Rows as a table that fits its width, or as records with a line per field; and as a tree."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from rich.cells import cell_len, set_cell_size

from cgdb.cli import render

if TYPE_CHECKING:
    from rich.text import Text

    from cgdb.cli.screen import Screen

GAP = "  "
LEAST = 8
"""Characters of a column below which a table says nothing: then each record has lines of its own."""
BAR = 8
NARROW = 80
_EIGHTHS = " ▏▎▍▌▋▊▉█"


@dataclass(frozen=True, slots=True, kw_only=True)
class Grid:
    """Cells as clean text. scores: (score, fits) per row, None where every row is simply right. first: its number."""

    columns: tuple[str, ...]
    cells: tuple[tuple[str, ...], ...]
    numeric: tuple[bool, ...]
    scores: tuple[tuple[float, bool], ...] | None = None
    first: int = 1


def grid(
    columns: Sequence[str],
    rows: Sequence[Sequence[Any]],
    *,
    scores: Sequence[tuple[float, bool]] | None = None,
    first: int = 1,
) -> Grid:
    """Values to cells."""
    numeric = tuple(
        any(_is_number(row[i]) for row in rows) and all(row[i] is None or _is_number(row[i]) for row in rows)
        for i in range(len(columns))
    )
    return Grid(
        columns=tuple(render.clean(name) for name in columns),
        cells=tuple(tuple(_cell(value) for value in row) for row in rows),
        numeric=numeric,
        scores=None if scores is None else tuple(scores),
        first=first,
    )


def _cell(value: Any) -> str:
    # Sums of binary fractions that should be 0 are not quite.
    return "0" if isinstance(value, float) and abs(value) < 1e-9 else render.clean(value)


def _is_number(value: Any) -> bool:
    return isinstance(value, (int, float)) and not isinstance(value, bool)


def table(shown: Grid, screen: Screen, *, width: int | None, bars: bool, numbered: bool) -> list[Text] | None:
    """The lines of a table; None where it cannot be made to fit. width None: as wide as it needs."""
    from rich.text import Text

    last = len(str(shown.first + len(shown.cells) - 1))
    natural = [
        max([cell_len(name), *(cell_len(row[i]) for row in shown.cells)], default=1)
        for i, name in enumerate(shown.columns)
    ]
    gaps = len(GAP) * (len(natural) - 1)
    lead = _lead(shown, last, numbered=numbered, bars=bars, width=width)
    if bars and width is not None and width < NARROW and lead + sum(natural) + gaps > width:
        # Of what does not fit, the bars say least: their numbers stand beside them.
        bars = False
        lead = _lead(shown, last, numbered=numbered, bars=bars, width=width)
    widths = natural if width is None else fit(natural, width - lead - gaps)
    if widths is None:
        return None
    head = Text(no_wrap=True)
    if numbered:
        head.append(" " * last + GAP)
    if shown.scores:
        head.append("score".ljust(_score_width(bars, width)) + GAP, screen.ink("head"))
    head.append(
        GAP.join(_fitted(*item) for item in zip(shown.columns, widths, shown.numeric, strict=True)), screen.ink("head")
    )
    head.rstrip()
    lines = [head, Text("─" * (lead + sum(widths) + gaps), screen.ink("rule"), no_wrap=True)]
    for n, row in enumerate(shown.cells):
        line = Text(no_wrap=True)
        if numbered:
            line.append(str(shown.first + n).rjust(last) + GAP, screen.ink("faint"))
        fits = True
        if shown.scores:
            score, fits = shown.scores[n]
            line.append_text(scored(score, fits, screen, bars=bars, width=width))
            line.append(GAP)
        for i, (cell, size, numeric) in enumerate(zip(row, widths, shown.numeric, strict=True)):
            text = _fitted(cell, size, numeric)
            style = screen.ink("number") if numeric and fits else "" if fits else screen.ink("misses")
            if fits and cell.startswith("#"):
                mark = len(text) - len(text.lstrip("#")) and text.find(" ")
                line.append(text[:mark] if mark > 0 else text, screen.ink("id"))
                line.append(text[mark:] if mark > 0 else "")
            else:
                line.append(text, style)
            if i < len(row) - 1:
                line.append(GAP)
        line.rstrip()
        lines.append(line)
    return lines


def _lead(shown: Grid, last: int, *, numbered: bool, bars: bool, width: int | None) -> int:
    """Characters before the first column."""
    return (last + len(GAP) if numbered else 0) + (_score_width(bars, width) + len(GAP) if shown.scores else 0)


def fit(natural: Sequence[int], room: int) -> list[int] | None:
    """Widths that together take at most ``room``: narrow columns keep theirs, wide ones share what is left.

    None where a column would get less than LEAST of what it needs.
    """
    widths = [max(1, width) for width in natural]
    if sum(widths) <= room:
        return widths
    open_columns = list(range(len(widths)))
    left = room
    while open_columns:
        share = left // len(open_columns)
        small = [i for i in open_columns if widths[i] <= share]
        if not small:
            break
        left -= sum(widths[i] for i in small)
        open_columns = [i for i in open_columns if i not in small]
    for place, i in enumerate(open_columns):
        widths[i] = left // len(open_columns) + (place < left % len(open_columns))
        if widths[i] < min(LEAST, natural[i]):
            return None
    return widths


def _fitted(text: str, width: int, right: bool) -> str:
    size = cell_len(text)
    if size > width:
        return set_cell_size(text, width - 1) + "…"
    return " " * (width - size) + text if right else text + " " * (width - size)


def _score_width(bars: bool, width: int | None) -> int:
    return 4 + 2 + (1 + _bar_size(width) if bars else 0)


def _bar_size(width: int | None) -> int:
    return 4 if width is not None and width < NARROW else BAR


def scored(score: float, fits: bool, screen: Screen, *, bars: bool, width: int | None = None) -> Text:
    """A score as number, mark and bar."""
    from rich.text import Text

    made = Text(no_wrap=True)
    made.append(f"{score:4.2f}", screen.ink("fits" if fits else "misses"))
    made.append(" ✓" if fits else "  ", screen.ink("fits"))
    if bars:
        made.append(" " + bar(score, _bar_size(width)), screen.ink("bar" if fits else "misses"))
    return made


def bar(share: float, cells: int) -> str:
    """A bar of so many cells for a share in [0, 1], with eighths."""
    eighths = round(8 * cells * max(0.0, min(1.0, share)))
    full, rest = divmod(eighths, 8)
    return ("█" * full + (_EIGHTHS[rest] if rest else "")).ljust(cells)


def record(
    shown: Grid, row: int, screen: Screen, *, width: int | None, bars: bool, of: int | None = None
) -> list[Text]:
    """The lines of one record: a heading, then a line per field, broken where it is longer than the width."""
    from rich.text import Text

    number = shown.first + row
    title = f"── {number}" + (f" of {of} " if of else " ")
    heading = Text(title, screen.ink("head"), no_wrap=True)
    if shown.scores:
        heading.append_text(scored(*shown.scores[row], screen, bars=bars))
        heading.append(" ")
    heading.append("─" * max(0, min(width or 60, 60) - cell_len(heading.plain)), screen.ink("rule"))
    size = max((cell_len(name) for name in shown.columns), default=0)
    size = min(size, 24)
    lines = [heading]
    for name, cell in zip(shown.columns, shown.cells[row], strict=True):
        label = _fitted(name, size, False)
        for n, part in enumerate(folded(cell, None if width is None else max(10, width - size - 2))):
            line = Text(no_wrap=True)
            line.append(label if n == 0 else " " * size, screen.ink("hint"))
            line.append(GAP + part)
            lines.append(line)
    return lines


def folded(text: str, width: int | None) -> list[str]:
    """Text in lines of at most width characters, broken at spaces where there are some."""
    if width is None or cell_len(text) <= width:
        return [text]
    lines: list[str] = []
    line = ""
    for word in text.split(" "):
        while cell_len(word) > width:
            if line:
                lines.append(line)
                line = ""
            cut = max(1, len(set_cell_size(word, width).rstrip()))
            lines.append(word[:cut])
            word = word[cut:]
        if line and cell_len(line) + 1 + cell_len(word) > width:
            lines.append(line)
            line = word
        else:
            line = f"{line} {word}" if line else word
    return [*lines, line] if line else lines


def tree(value: Any, title: str) -> Iterator[str]:
    """A record as a tree: a line per field, lists and records as branches."""
    yield render.clean(title)
    yield from _branches(value, "")


def _branches(value: Any, indent: str) -> Iterator[str]:
    items = list(value.items()) if isinstance(value, dict) else [(None, item) for item in value]
    for n, (name, item) in enumerate(items):
        last = n == len(items) - 1
        lead = indent + ("└─ " if last else "├─ ")
        label = "" if name is None else render.clean(name)
        branching = isinstance(item, dict) or (
            isinstance(item, list) and any(isinstance(i, (dict, list)) for i in item)
        )
        if branching and item:
            yield lead + (label or _called(item))
            yield from _branches(item, indent + ("   " if last else "│  "))
        else:
            text = render.clean(item) if item not in ({}, []) else ""
            yield lead + (f"{label}: {text}" if label else text)


def _called(item: Any) -> str:
    """A record in a list, by its id and tag."""
    if isinstance(item, dict) and "id" in item:
        return render.clean(f"#{item['id']} {item.get('tag', '')}".strip())
    if isinstance(item, dict) and "asked" in item:
        return render.clean(item["asked"])
    return "·"
