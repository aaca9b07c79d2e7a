"""What a question is given: its columns, order and number of rows, by what it wants to know."""

from __future__ import annotations

from dataclasses import dataclass

from cgdb.english import tree_parts as parts
from cgdb.english.intent import Asked
from cgdb.english.question_values import Values
from cgdb.english.tree_parts import ROOM, SUBJECT
from cgdb.grammar import ast

TRAITS = {
    "color": ("color", "colour", "colors"),
    "material": ("material", "materials"),
    "shape": ("shape",),
    "price": ("price", "cost"),
}
"""What maps call the properties that questions ask for."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Given:
    """The end of a statement. distinct: where other things are matched too. condition: one that the columns need."""

    returns: tuple[ast.ReturnItem, ...]
    order: tuple[ast.OrderItem, ...] = ()
    skip: ast.Number | None = None
    limit: ast.Number | None = None
    distinct: bool = False
    condition: ast.Expression | None = None
    says: str = ""


def given(asked: Asked, values: Values, columns: tuple[str, ...], *, label: str | None, wanted: str) -> Given:
    """What is returned. columns: of what the conditions measure; label: of rooms; wanted: the text of the subject."""
    subject = parts.item(ast.Variable(name=SUBJECT))
    match asked.form:
        case "count":
            distinct = bool(values.patterns)
            counted = parts.item(parts.count(SUBJECT, distinct=distinct), "count")
            return Given(returns=(counted, parts.item(parts.collect(SUBJECT, distinct=distinct), "found")))
        case "per scene" | "scene":
            return _per_scene(asked, values)
        case "per room" if label is not None:
            name = parts.item(ast.Property(variable=ROOM, name="name"))
            counted = parts.item(parts.count(SUBJECT))
            order = parts.ordered(parts.count(SUBJECT), descending=True)
            return Given(returns=(name, counted), order=(order,))
        case "room" if wanted and label is not None:
            return Given(returns=(parts.item(ast.Variable(name=ROOM)), subject))
        case "compare":
            return _compared(asked)
        case "all":
            holds = parts.item(parts.similar(asked.against), "holds")
            found = parts.item(parts.collect(SUBJECT), "found")
            return Given(returns=(holds, parts.item(parts.count(SUBJECT), "count"), found))
        case "average":
            mean = parts.item(parts.call("avg", values.of(asked.what)), asked.what)
            found = parts.item(parts.collect(SUBJECT), "found")
            return Given(returns=(mean, parts.item(parts.count(SUBJECT), "count"), found))
        case "distance":
            return _distance(asked, values)
        case "measure":
            asked_for = values.columns(asked.what)
            if not asked_for:
                values.ignored.append(
                    f"how {'heavy' if asked.what == 'weight' else 'high'}: {values.lacks(asked.what)}"
                )
            columns = (*asked_for, *columns)
        case "trait":
            names = TRAITS.get(asked.what, (asked.what,))
            held = next((name for name in names if name in values.catalog.properties), None)
            if held is not None:
                return Given(returns=(subject, parts.item(ast.Property(variable=SUBJECT, name=held), asked.what)))
            values.assumed.append(f"{asked.what}: the map holds none, so the captions were read")
    return _ordered(asked, values, columns, subject)


def _ordered(asked: Asked, values: Values, columns: tuple[str, ...], subject: ast.ReturnItem) -> Given:
    """The things themselves, in the order that is asked for, with what was measured."""
    shown = values.items(tuple(column for column in columns if column != "distance"))
    if "distance" in columns and values.distance is not None:
        shown.append(parts.item(parts.call("min", values.distance), "distance"))
    found = None if asked.first is None else values.order(asked.first)
    if asked.first is None or found is None:
        return Given(returns=(subject, *shown), distinct="distance" not in columns)
    order, by = found
    named = {item.name for item in by}
    first = asked.first
    return Given(
        returns=(subject, *by, *(item for item in shown if item.name not in named)),
        order=(order,),
        skip=ast.Number(value=first.rank - 1) if first.rank > 1 else None,
        limit=ast.Number(value=first.count) if first.count else ast.Number(value=1) if first.single else None,
        distinct=first.by != "distance" and "distance" not in columns,
        says=f"in order: {first.text}",
    )


def _per_scene(asked: Asked, values: Values) -> Given:
    distinct = bool(values.patterns)
    counted = parts.count(SUBJECT, distinct=distinct)
    return Given(
        returns=(
            parts.item(ast.Property(variable=SUBJECT, name="scene"), "scene"),
            parts.item(counted, "count"),
            parts.item(parts.collect(SUBJECT, distinct=distinct), "found"),
        ),
        order=(parts.ordered(ast.Variable(name="count"), descending=asked.what != "fewest"),),
    )


def _compared(asked: Asked) -> Given:
    """How many of each of two kinds: what is of the one, of the other, or of both, counted apart."""
    one, other = parts.similar(asked.wanted), parts.similar(asked.against)
    return Given(
        returns=(
            parts.item(one, "first"),
            parts.item(other, "second"),
            parts.item(parts.count(SUBJECT), "count"),
            parts.item(parts.collect(SUBJECT), "found"),
        ),
        condition=parts.any_of([one, other]),
    )


def _distance(asked: Asked, values: Values) -> Given:
    subject = parts.item(ast.Variable(name=SUBJECT))
    if not asked.against:
        values.ignored.append("how far: from what is not said")
        return Given(returns=(subject,))
    other = values.other(asked.against)
    values.conditions.append(parts.differ(other))
    distance = parts.call("distance", ast.Variable(name=SUBJECT), other)
    order = parts.ordered(ast.Variable(name="distance"), descending=False)
    return Given(returns=(subject, parts.item(other), parts.item(distance, "distance")), order=(order,))
