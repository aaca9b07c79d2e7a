"""What a question measures, in CGQL: sizes, distances, heights above the floor, orders, and their columns."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

from cgdb.english import tree_parts as parts
from cgdb.english.intent import First, Measured, Setting
from cgdb.english.lookahead import PREVIOUS
from cgdb.english.tree_parts import SUBJECT
from cgdb.grammar import ast
from cgdb.index.catalog import Catalog

ABOUT = 0.1
"""The share by which what is about, or exactly, so large may differ: boxes of maps are no better than that."""

_FUNCTIONS: Mapping[str, str] = {"height": "height", "width": "width", "depth": "depth", "size": "volume"}
_UNITS: Mapping[str, str] = {
    "height": "m", "width": "m", "depth": "m", "volume": "m³", "distance": "m", "level": "m", "weight": "",
}  # fmt: skip
_WEIGHTS = ("weight", "mass", "weight_kg", "mass_kg")


@dataclass(frozen=True, slots=True, kw_only=True)
class Value:
    """A column that holds what was measured: what of, and in which unit."""

    column: str
    unit: str


@dataclass(slots=True)
class Values:
    """Writes what is measured; keeps the patterns of what it is measured against, and what it had to assume.

    distance: the last that a condition asked about.
    """

    catalog: Catalog
    setting: Setting
    patterns: list[ast.Pattern] = field(default_factory=list)
    conditions: list[ast.Expression] = field(default_factory=list)
    anchors: list[str] = field(default_factory=list)
    assumed: list[str] = field(default_factory=list)
    ignored: list[str] = field(default_factory=list)
    distance: ast.Expression | None = None
    _others: dict[str, ast.Variable] = field(default_factory=dict)

    def other(self, meaning: str) -> ast.Variable:
        """A thing beside the one that is wanted, to measure from; the same thing is named once."""
        if meaning in self._others:
            return self._others[meaning]
        name = f"a{len(self.patterns) + 1}" if self.patterns else "a"
        if meaning == PREVIOUS:
            self.patterns.append(parts.nodes(ast.NodePattern(variable=name)))
            self.conditions.append(parts.among_previous(name))
        else:
            self.patterns.append(parts.nodes(ast.NodePattern(variable=name, meaning=parts.meaning(meaning))))
            self.anchors.append(meaning)
        self._others[meaning] = ast.Variable(name=name)
        return self._others[meaning]

    def weight(self) -> str | None:
        """The property of weights, where the store holds them as numbers."""
        return next((name for name in _WEIGHTS if self.catalog.properties.get(name) == "number"), None)

    def of(self, column: str, variable: str = SUBJECT) -> ast.Expression:
        """The expression of a column: a size of the box, the height of its bottom above the floor, or a weight."""
        if column == "weight":
            return ast.Property(variable=variable, name=self.weight() or "weight")
        if column == "level":
            return self._level(*self.setting.frames[0][1:])
        return parts.call(column, ast.Variable(name=variable))

    def columns(self, what: str) -> tuple[str, ...]:
        """The columns that answer how large something is; none where the store cannot tell."""
        if (what == "weight" and self.weight() is None) or (what == "level" and not self._one_frame()):
            return ()
        return ("width", "depth", "height", "volume") if what == "size" else (what,)

    def lacks(self, what: str) -> str:
        """Why the store cannot tell that."""
        return "the map holds no weights" if what == "weight" else "the scenes' floors differ; ask of one scene"

    def items(self, columns: tuple[str, ...]) -> list[ast.ReturnItem]:
        """These columns of the subject."""
        return [parts.item(self.of(column), column) for column in dict.fromkeys(columns)]

    # -- conditions ---------------------------------------------------------------------------------------------

    def condition(self, measured: Measured) -> tuple[ast.Expression, tuple[str, ...]] | None:
        """What a size or distance asks, and the columns that show it; None where nothing here measures it."""
        if measured.what == "distance":
            self.distance = parts.call("distance", ast.Variable(name=SUBJECT), self.other(measured.than or ""))
            return _bounded(self.distance, measured), ("distance",)
        if measured.what == "level":
            return self._levels(measured), ("level",) if self._one_frame() else ()
        column = _FUNCTIONS.get(measured.what)
        if measured.what == "weight":
            column = "weight" if self.weight() is not None else "volume" if measured.than else None
            if column == "volume":
                self.assumed.append(f"{measured.text}: the map holds no weights, so the sizes were compared")
        if column is None:
            self.ignored.append(f"{measured.text}: the map holds nothing to tell that by")
            return None
        if measured.than is not None:
            other = self.other(measured.than)
            left, right = self.of(column), self.of(column, other.name)
            return parts.all_of([_against(measured.op, left, right), parts.differ(other)]), (column,)
        if column != "volume":
            return _bounded(self.of(column), measured), (column,)
        sides = [_bounded(self.of(side), measured) for side in ("width", "height")]
        return (parts.any_of(sides) if measured.op in (">", ">=", "~") else parts.all_of(sides)), ("width", "height")

    def _one_frame(self) -> bool:
        return len({frame[1:] for frame in self.setting.frames}) <= 1

    def _levels(self, measured: Measured) -> ast.Expression:
        """That the bottom is so high above the floor, in each scene by its own axis and floor."""
        if any(level is None for _, _, level in self.setting.frames):
            self.assumed.append(f"{measured.text}: where the floor is was not measured, so it was taken to be at 0")
        if self._one_frame():
            return _bounded(self.of("level"), measured)
        each = []
        for frame in dict.fromkeys(frame[1:] for frame in self.setting.frames):
            scenes = tuple(ast.Text(value=one[0]) for one in self.setting.frames if one[1:] == frame)
            inside = ast.In(item=ast.Property(variable=SUBJECT, name="scene"), collection=ast.ListOf(items=scenes))
            each.append(parts.all_of([inside, _bounded(self._level(*frame), measured)]))
        return parts.any_of(each)

    def _level(self, up: str, floor: float | None) -> ast.Expression:
        """The height of the bottom of the box above the floor."""
        half = ast.Arithmetic(op="/", left=parts.call("height", ast.Variable(name=SUBJECT)), right=ast.Number(value=2))
        bottom: ast.Expression = ast.Arithmetic(op="-", left=_along(up), right=half)
        if not floor:
            return bottom
        return ast.Arithmetic(op="-" if floor > 0 else "+", left=bottom, right=parts.number(round(abs(floor), 2)))

    # -- orders -------------------------------------------------------------------------------------------------

    def order(self, first: First) -> tuple[ast.OrderItem, list[ast.ReturnItem]] | None:
        """How rows are ordered, and the columns that show by what; None where it is not said or cannot be told."""
        if first.by == "distance" and first.to is None:
            self.ignored.append(f'{first.text}: to what is not said (as in "{first.text} to the door")')
            return None
        if first.by == "distance":
            return self._by_distance(first)
        if first.by == "z":
            if len({up for _, up, _ in self.setting.frames}) > 1:
                self.assumed.append(f"{first.text}: up differs between the scenes; taken to be {self.setting.up}")
            elif not self._one_frame():
                self.assumed.append(f"{first.text}: each scene's heights were compared as its map gives them")
            down = self.setting.up.startswith("-")
            height = ast.Property(variable=SUBJECT, name=self.setting.up[-1:] or "z")
            shown = self.items(("level",)) if self._one_frame() else []
            return parts.ordered(height, descending=first.descending != down), shown
        column = first.by
        if column == "weight" and self.weight() is None:
            column = "volume"
            self.assumed.append(f"{first.text}: the map holds no weights, so the sizes were compared")
        by = parts.ordered(ast.Variable(name=column), descending=first.descending)
        return by, self.items((column,))

    def _by_distance(self, first: First) -> tuple[ast.OrderItem, list[ast.ReturnItem]]:
        other = self.other(first.to or "")
        self.conditions.append(parts.differ(other))
        distance = parts.call("distance", ast.Variable(name=SUBJECT), other)
        by = parts.ordered(ast.Variable(name="distance"), descending=first.descending)
        if first.single and not first.descending and first.rank == 1:
            return by, [parts.item(other), parts.item(distance, "distance")]
        return by, [parts.item(parts.call("min", distance), "distance")]


def unit(column: str) -> str | None:
    """The unit of a column that holds a measure; None of another."""
    return _UNITS.get(column)


def _along(up: str) -> ast.Expression:
    """How high the middle of the box is."""
    height = ast.Property(variable=SUBJECT, name=up[-1:] or "z")
    return ast.Negative(operand=height) if up.startswith("-") else height


def _bounded(value: ast.Expression, measured: Measured) -> ast.Expression:
    """``value op number``; about as much is two bounds."""
    length = measured.number or 0.0
    if measured.op != "~":
        return parts.compared(measured.op, value, parts.number(length, measured.unit))
    low, high = (parts.number(round(length * share, 6), measured.unit) for share in (1 - ABOUT, 1 + ABOUT))
    return parts.all_of([parts.compared(">=", value, low), parts.compared("<=", value, high)])


def _against(op: str, left: ast.Expression, right: ast.Expression) -> ast.Expression:
    """``left op right``; about as much is two bounds."""
    if op != "~":
        return parts.compared(op, left, right)
    low, high = (
        ast.Arithmetic(op="*", left=right, right=ast.Number(value=round(share, 2))) for share in (1 - ABOUT, 1 + ABOUT)
    )
    return parts.all_of([parts.compared(">=", left, low), parts.compared("<=", left, high)])
