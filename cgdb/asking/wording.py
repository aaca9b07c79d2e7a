"""An answer in plain words: yes or no first, counts with what was counted, measures with their units."""

from __future__ import annotations

import operator
from collections.abc import Callable, Iterator, Sequence
from typing import TYPE_CHECKING, Any

from cgdb.asking.answer import Fact, answering, first_node
from cgdb.asking.caption_traits import told
from cgdb.grammar import ast
from cgdb.meaning.words import singular
from cgdb.model.prompts import clean
from cgdb.result import Result, Row, StoredNode

if TYPE_CHECKING:
    from cgdb.english.intent import Asked

UNITS = {"distance": "m", "height": "m", "width": "m", "depth": "m", "level": "m", "volume": "m³", "weight": ""}
"""What is measured, and in which unit."""
NAMED = 3
"""Things that a line names; the rest is counted."""

TOUCHING = 0.005
"""Metres below which there is nothing in between."""
SIMPLE = 3
"""Words of what can be counted by its name."""

_ADJECTIVES = {"height": "{} m tall", "width": "{} m wide", "depth": "{} m deep", "volume": "{} m³ in volume"}
_ABOVE = "{} m above the floor"
_OPERATORS = {">": operator.gt, ">=": operator.ge, "<": operator.lt, "<=": operator.le, "=": operator.eq}
_ANYTHING = frozenset(("", "anything", "something", "everything", "things", "objects"))


def facts(tree: ast.Query, result: Result) -> tuple[Fact, ...]:
    """What a result measures or counts, of its rows that fit."""
    measures = {i: name for i, item in enumerate(tree.returns) if (name := _measure(item)) is not None}
    counts = [i for i, item in enumerate(tree.returns) if _is_count(item.expression)]
    found: list[Fact] = []
    for row in result.rows:
        if not row.fits or len(row) != len(tree.returns):
            continue
        nodes = tuple(value for value in row.values if isinstance(value, StoredNode))
        for i, name in measures.items():
            value = row[i]
            if isinstance(value, (int, float)) and not isinstance(value, bool):
                about = nodes if name == "distance" else nodes[:1]
                found.append(Fact(what=name, value=round(value, 4), unit=UNITS[name], objects=about))
        for i in counts:
            value, scene = row[i], next((v for v, n in zip(row, result.columns, strict=True) if n == "scene"), None)
            if isinstance(value, int):
                members = answering(row)
                found.append(Fact(what="count", value=value, objects=members, scene=scene))  # type: ignore[arg-type]
    return tuple(found)


def _measure(item: ast.ReturnItem) -> str | None:
    """What a column measures: by its name, or by the function that is called in it."""
    if item.name in UNITS:
        return item.name
    inner = item.expression
    if isinstance(inner, ast.Call) and inner.name in ("min", "max", "avg") and inner.arguments:
        inner = inner.arguments[0]
    return inner.name if isinstance(inner, ast.Call) and inner.name in UNITS else None


def _is_count(item: ast.Expression) -> bool:
    return isinstance(item, ast.Call) and item.name == "count"


def fit(rows: Sequence[Row]) -> list[Row]:
    """The rows that fit."""
    return [row for row in rows if row.fits]


# -- sentences --------------------------------------------------------------------------------------------------


def counted(count: int, wanted: str) -> str:
    """ "6 chairs", "1 chair", "3 things"."""
    wanted = clean("things" if wanted.casefold() in _ANYTHING else wanted, 80)
    head, _, last = wanted.rpartition(" ")
    if count == 1:
        last = singular(last)
    elif last.isalpha() and singular(last) == last and not last.endswith("s"):
        if len(wanted.split()) > SIMPLE:
            return f"{count:,} × {wanted}"
        last = _plural(last)
    return f"{count:,} {head + ' ' if head else ''}{last}"


def _plural(noun: str) -> str:
    if noun.endswith(("x", "z", "ch", "sh")):
        return f"{noun}es"
    if noun.endswith("y") and noun[-2:-1] not in "aeiou":
        return f"{noun[:-1]}ies"
    return f"{noun[:-1]}ves" if noun in ("shelf", "bookshelf", "leaf", "loaf", "scarf") else f"{noun}s"


def named(rows: Sequence[Row], value: Callable[[Row], str] = lambda row: "", *, scenes: bool = False) -> str:
    """ "#1 sofa, #3 sofa and 4 more", with what was measured of each."""
    parts = [f"{called(row, scenes=scenes)}{value(row)}" for row in rows[:NAMED]]
    more = len(rows) - len(parts)
    return ", ".join(parts) + (f" and {more:,} more" if more > 0 else "")


def called(row: Row, *, scenes: bool = False) -> str:
    """What a row is about."""
    node = first_node(row)
    if node is None:
        return ", ".join(shown(value) for value in row.values)
    return clean(f"{node} in {node.scene}" if scenes else str(node), 80)


def shown(value: Any) -> str:
    """A value in a sentence."""
    if isinstance(value, (list, tuple)):
        return ", ".join(map(shown, value[:10]))
    if isinstance(value, float):
        return f"{value:.3g}"
    return clean(str(value), 200)


def metres(value: Any) -> str:
    """A length with two decimals, a small one with three."""
    return "0" if value == 0 else f"{value:.2f}" if abs(value) >= 0.1 else f"{value:.3f}"


def measured(row: Row, columns: Sequence[str], *, only: str | None = None) -> str:
    """What was measured of a row: "0.42 m tall", "1.2 × 0.6 × 0.5 m (width × depth × height)"."""
    values = {
        name: value
        for name, value in zip(columns, row.values, strict=False)
        if name in UNITS and isinstance(value, (int, float)) and (only is None or name == only)
    }
    if {"width", "depth", "height", "volume"} <= set(values):
        sides = " × ".join(metres(values[name]) for name in ("width", "depth", "height"))
        return f"{sides} m (width × depth × height), {metres(values['volume'])} m³"
    said = []
    for name, value in values.items():
        if name == "distance":
            said.append(f"{metres(value)} m away")
        elif name == "level":
            said.append(_ABOVE.format(metres(value)))
        elif name == "weight":
            said.append(f"weight {value:g}")
        else:
            said.append(_ADJECTIVES[name].format(metres(value)))
    return ", ".join(said)


def by_scene(rows: Sequence[Row], scenes: Sequence[str]) -> str:
    """ " (4 in flat, 2 in lab)" where several scenes were asked and something was found."""
    if len(scenes) < 2:
        return ""
    found = [node.scene for row in rows for node in answering(row)]
    told_of = [f"{found.count(scene)} in {scene}" for scene in scenes if scene in found]
    return f" ({', '.join(told_of)})" if told_of else ""


# -- answers ----------------------------------------------------------------------------------------------------


def answered(
    asked: Asked, wanted: str, result: Result, scenes: Sequence[str], most: int, *, ordered: bool = False
) -> tuple[bool, str, list[Fact]]:
    """(whether it is answered, in words, facts that no column holds) of a result in which something fits.

    scenes: those that were asked; most: rows after which the statement stops; ordered: by what was asked for.
    """
    rows, several, columns = fit(result.rows), len(scenes) > 1, result.columns
    yes = "yes: " if asked.polar else ""
    match asked.form:
        case "count":
            return _count(asked, wanted, rows, scenes)
        case "per scene" | "scene" if columns[:1] == ("scene",):
            return _scenes(asked, wanted, rows, scenes)
        case "per room" if first_node(rows[0]) is None:
            total = sum(row[1] for row in rows if isinstance(row[1], int))
            listed = ", ".join(f"{shown(row[0])} {shown(row[1])}" for row in rows[:10])
            return True, f"{counted(total, wanted)} in all: {listed}", []
        case "compare":
            return _compared(asked, rows)
        case "all":
            return _all(asked, wanted, rows)
        case "average" if isinstance(rows[0][0], (int, float)):
            mean = measured(rows[0], columns)
            return True, f"{counted(int(str(rows[0][1])), wanted)}: {mean} on average", []
        case "distance" if "distance" in columns:
            pairs = [_apart(row, several) for row in _nearest(rows, columns)]
            return True, "; ".join(pairs[:NAMED]) + _more(len(pairs)), []
        case "measure" if any(name in UNITS for name in columns):
            sizes = [f"{called(row, scenes=several)} is {said}" for row in rows if (said := measured(row, columns))]
            if not sizes:
                return False, f"the map holds no box of {named(rows, scenes=several)}", []
            return True, "; ".join(sizes[:NAMED]) + _more(len(sizes)), []
        case "trait":
            return _trait(asked, rows, several)
        case "room" if len(columns) == 2:
            told_of = [f"{shown(row[1])} is in {shown(row[0])}" for row in rows[:NAMED]]
            return True, "; ".join(told_of) + _more(len(rows)), []
    if asked.first is not None and ordered:
        return _first(asked, rows, columns, several)
    value = lambda row: f" ({said})" if (said := measured(row, columns)) else ""  # noqa: E731
    if asked.form in ("measure", "distance", "room", "per room"):
        return False, f"the map does not tell; what was asked about: {named(rows, scenes=several)}", []
    number = f"{len(rows):,} or more" if len(rows) >= most else f"{len(rows):,}"
    fits = f"{number} fit{'s' if len(rows) == 1 else ''}"
    if asked.form == "exists" and wanted and len(wanted.split()) <= SIMPLE and number.isdigit():
        fits = counted(len(rows), wanted)
    text = f"{yes}{fits}: {named(rows, value, scenes=several)}"
    return True, text + _because(rows[0]), []


def _more(count: int) -> str:
    return f"; and {count - NAMED:,} more" if count > NAMED else ""


def _count(asked: Asked, wanted: str, rows: Sequence[Row], scenes: Sequence[str]) -> tuple[bool, str, list[Fact]]:
    count = sum(row[0] for row in rows if isinstance(row[0], int))
    where = by_scene(rows, scenes)
    names = [str(node) for row in rows for node in answering(row)]
    listed = f": {', '.join(names[:NAMED])}" + (f" and {len(names) - NAMED:,} more" if len(names) > NAMED else "")
    text = f"{counted(count, wanted)}{where}{listed if names else ''}"
    if not asked.polar:
        return count > 0, text, []
    op, _, bound = asked.what.partition(" ")
    holds = _OPERATORS[op](count, float(bound))
    return holds, f"{'yes' if holds else 'no'}: {text}", []


def _scenes(asked: Asked, wanted: str, rows: Sequence[Row], scenes: Sequence[str]) -> tuple[bool, str, list[Fact]]:
    counts: dict[str, int] = {str(row[0]): row[1] for row in rows if isinstance(row[1], int)}
    empty = [scene for scene in scenes if scene not in counts]
    facts = [Fact(what="count", value=0, scene=scene) for scene in empty]
    if asked.form == "scene":
        listed = ", ".join(f"{scene} ({counted(count, wanted)})" for scene, count in counts.items())
        return True, listed, facts
    every = {**dict.fromkeys(empty, 0), **counts} if asked.what == "fewest" else {**counts, **dict.fromkeys(empty, 0)}
    (scene, best), *others = every.items()
    tied = [name for name, count in others if count == best]
    rest = ", ".join(f"{name} {count}" for name, count in others)
    who = f"{', '.join((scene, *tied))} {'have' if tied else 'has'} {counted(best, wanted)}{' each' if tied else ''}"
    return True, f"{who}{f' ({rest})' if rest else ''}", facts


def _compared(asked: Asked, rows: Sequence[Row]) -> tuple[bool, str, list[Fact]]:
    one, other = (sum(row[2] for row in rows if row[i] is True and isinstance(row[2], int)) for i in (0, 1))
    facts = [
        Fact(what=f"count of {text}", value=count) for text, count in ((asked.wanted, one), (asked.against, other))
    ]
    text = f"{counted(one, asked.wanted)}, {counted(other, asked.against)}"
    if not asked.polar:
        more = one > other if asked.what == "which more" else one < other
        winner = "as many of both" if one == other else asked.wanted if more else asked.against
        return True, f"{winner}: {text}", facts
    holds = {"more": one > other, "fewer": one < other, "as many": one == other}[asked.what]
    return holds, f"{'yes' if holds else 'no'}: {text}", facts


def _all(asked: Asked, wanted: str, rows: Sequence[Row]) -> tuple[bool, str, list[Fact]]:
    """Whether something holds of all things of a kind, and of how many it does."""
    groups = [(row[0] is True, row[1] if isinstance(row[1], int) else 0, answering(row)) for row in rows]
    every = sum(count for _, count, _ in groups)
    holding = sum(count for holds, count, _ in groups if holds)
    others = [str(node) for holds, _, nodes in groups for node in nodes if not holds]
    facts = [Fact(what=f"count of {asked.against}", value=holding)]
    if holding == every:
        return (
            True,
            f"yes: {counted(every, wanted)}, {'all of them' if every > 1 else 'which is'} {asked.against}",
            facts,
        )
    if not holding and every > 1:
        return False, f"no: none of {counted(every, wanted)} is {asked.against}", facts
    some = f"{', '.join(others[:NAMED])}" + (f" and {len(others) - NAMED:,} more" if len(others) > NAMED else "")
    many = f"{holding:,} of {counted(every, wanted)}" if every > 1 else counted(1, wanted)
    verb = "is" if every == 1 or holding == 1 else "are"
    return False, f"no: {many} {verb} {'not ' if every == 1 else ''}{asked.against}; not: {clean(some, 160)}", facts


def _nearest(rows: Sequence[Row], columns: Sequence[str]) -> list[Row]:
    """Of each thing the row with the nearest other, in the order in which the things come."""
    at = columns.index("distance")
    best: dict[Any, Row] = {}
    for row in rows:
        node = first_node(row)
        key = None if node is None else (node.scene, node.id)
        known = best.get(key)
        if known is None or (row[at] is not None and (known[at] is None or row[at] < known[at])):  # type: ignore[operator]
            best[key] = row
    return list(best.values())


def _apart(row: Row, scenes: bool) -> str:
    nodes = [value for value in row.values if isinstance(value, StoredNode)]
    distance = next((value for value in row.values if isinstance(value, (int, float))), None)
    if distance is None or len(nodes) < 2:
        return f"{called(row, scenes=scenes)}: not both have a place in the map"
    other = clean(str(nodes[1]), 80)
    if distance < TOUCHING:
        return f"{called(row, scenes=scenes)} touches {other} (0 m)"
    return f"{called(row, scenes=scenes)} is {metres(distance)} m from {other}"


def _first(asked: Asked, rows: Sequence[Row], columns: Sequence[str], scenes: bool) -> tuple[bool, str, list[Fact]]:
    """The first of an order, with what it was ordered by; false where the map gives no box to order by."""
    first, yes = asked.first, "yes: " if asked.polar else ""
    assert first is not None
    by = first.by if first.by in columns else "level" if first.by == "z" else "volume"
    order = {1: "", 2: "second ", 3: "third "}.get(first.rank, f"{first.rank}th ")
    known = [row for row in rows if by not in columns or row[columns.index(by)] is not None]
    if not known:
        return False, f"{order}{first.text}: the map holds no boxes of {named(rows, scenes=scenes)}", []
    if by == "distance" and len(known) == 1 and sum(isinstance(value, StoredNode) for value in known[0]) > 1:
        return True, f"{yes}{_apart(known[0], scenes)}", []

    def size(row: Row) -> str:
        said = f"{metres(row[columns.index(by)])} m" if by == "distance" else measured(row, columns, only=by)
        return f" ({said})" if said else ""

    return True, f"{yes}{order}{first.text}: {named(known, size, scenes=scenes)}", []


def _trait(asked: Asked, rows: Sequence[Row], scenes: bool) -> tuple[bool, str, list[Fact]]:
    lines, facts = [], []
    for row in rows[:NAMED]:
        node = first_node(row)
        assert node is not None
        value = row[1] if len(row) > 1 else told(node, asked.what)
        said = shown(value) if value else ""
        if said:
            facts.append(Fact(what=asked.what, value=said, objects=(node,)))
        caption = f', by its caption: "{clean(node.caption, 120)}"' if len(row) == 1 and node.caption else ""
        lines.append(f"{called(row, scenes=scenes)}: {said or 'not told'}{caption}")
    return bool(facts), "; ".join(lines) + _more(len(rows)), facts


def _because(row: Row) -> str:
    """ "; #5 vase on #40 coffee table": the relation that the first row fits by."""
    node = first_node(row)
    if node is None:
        return ""
    edges = (name for reason in row.why for name in _edges(reason.evidence, node))
    best = next(edges, None)
    return "" if best is None else f"; {clean(best, 160)}"


def _edges(evidence: Any, node: StoredNode) -> Iterator[str]:
    for name, degree in evidence.items():
        if (
            isinstance(degree, (int, float))
            and degree > 0
            and str(node) in name
            and " ~ " not in name
            and "(" not in name
        ):
            yield name.replace("_", " ")


def totals(result: Result) -> str:
    """ "n is 3; found is #1 sofa": the first row of a statement that returns no object."""
    rows = fit(result.rows)
    return "; ".join(f"{name} is {shown(value)}" for name, value in zip(result.columns, rows[0].values, strict=True))
