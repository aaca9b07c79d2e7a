"""What the expressions of a statement are worth, over all rows of a scene at once."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from cgdb import geometry
from cgdb.errors import ExecuteError
from cgdb.grammar import ast
from cgdb.index.positions import EdgeColumn, Positions
from cgdb.meaning.meanings import LikeMeaning
from cgdb.query.bindings import Bindings, Truth

if TYPE_CHECKING:
    from cgdb.meaning.meanings import Meaning
    from cgdb.view import SceneView

Column = NDArray[Any]
"""(n,): float64 with NaN for null where every value is a number, else Python values with None for null."""

PatternTruth = Callable[[ast.Pattern, Bindings], Truth]


class Evaluator:
    """Evaluates expressions over rows of one scene; knows nothing of how the rows came about."""

    def __init__(
        self,
        view: SceneView,
        meanings: Mapping[ast.Meaning, Meaning],
        pattern_truth: PatternTruth,
        asked_of: Mapping[str, Sequence[ast.Expression]],
    ) -> None:
        """pattern_truth: the truth of a pattern used as a condition. asked_of: {variable: conditions on it alone}."""
        self._view = view
        self._meanings = meanings
        self._pattern_truth = pattern_truth
        self._asked_of = asked_of

    # -- conditions ---------------------------------------------------------------------------------------------

    def truth(self, item: ast.Expression, rows: Bindings) -> Truth:
        """The degree of a condition in every row."""
        match item:
            case ast.And(items=items):
                truth = self.truth(items[0], rows)
                for part in items[1:]:
                    truth = truth & self.truth(part, rows)
                return truth
            case ast.Or(items=items):
                truth = self.truth(items[0], rows)
                for part in items[1:]:
                    truth = truth | self.truth(part, rows)
                return truth
            case ast.Not(item=inner):
                return ~self.truth(inner, rows)
            case ast.Similar(variable=variable, meaning=meaning):
                return Truth.of(self.degrees(self._meanings[meaning], rows.nodes[variable]))
            case ast.PatternCondition(pattern=pattern):
                return self._pattern_truth(pattern, rows)
            case ast.Comparison(op=op, left=left, right=right):
                return Truth.certain(_compared(op, self.value(left, rows), self.value(right, rows)))
            case ast.In(item=member, collection=ast.ListOf(items=items)) if all(
                isinstance(x, _CONSTANTS) for x in items
            ):
                wanted = {_key(constant) for constant in map(self._constant, items)} - {None}
                return Truth.certain(_flags(_key(v) in wanted for v in _listed(self.value(member, rows))))
            case ast.In(item=member, collection=collection):
                return Truth.certain(_contained(self.value(collection, rows), self.value(member, rows), _same))
            case ast.Contains(text=text, part=part):
                return Truth.certain(_contained(self.value(text, rows), self.value(part, rows), _same_folded))
            case ast.StartsWith(text=text, prefix=prefix):
                pairs = zip(_listed(self.value(text, rows)), _listed(self.value(prefix, rows)), strict=True)
                return Truth.certain(_flags(_folded(a).startswith(_folded(b)) for a, b in _known(pairs)))
            case ast.IsNull(item=inner, negated=negated):
                null = _nulls(self.value(inner, rows))
                return Truth.certain(~null if negated else null)
            case ast.Call(name="inside" | "above" as name, arguments=(one, other)):
                test = geometry.inside if name == "inside" else geometry.above
                return Truth.certain(test(self._boxes(one, rows), self._boxes(other, rows)))
            case _:
                return Truth.certain(_flags(value is True for value in _listed(self.value(item, rows))))

    def degrees(self, meaning: Meaning, positions: Positions) -> NDArray[np.float32]:
        """(n,) float32 how well these nodes match a meaning; 0 where it is an object that the scene does not have."""
        if isinstance(meaning, LikeMeaning) and self._view.find(meaning.id) is None:
            return np.zeros(len(positions), np.float32)
        return self._view.degrees.of(meaning, positions)

    # -- values -------------------------------------------------------------------------------------------------

    def value(self, item: ast.Expression, rows: Bindings) -> Column:
        """The value of an expression in every row; a node is its position, an edge or path its row number."""
        n = rows.n
        match item:
            case ast.Number(value=value):
                return np.full(n, float(value))
            case ast.Text(value=value) | ast.Boolean(value=value):
                return _filled(n, value)
            case ast.Null():
                return _filled(n, None)
            case ast.ObjectRef(id=node_id):
                # In a scene that has no such node it stands for none: -1, which is no node's position.
                position = self._view.find(node_id)
                return np.full(n, -1 if position is None else position, np.int64)
            case ast.ListOf(items=items):
                members = [_listed(self.value(x, rows)) for x in items]
                return _objects(list(row) for row in zip(*members, strict=True)) if members else _filled(n, [])
            case ast.Variable(name=name):
                return rows.nodes[name] if name in rows.nodes else np.arange(n)
            case ast.Property(variable=variable, name=name):
                if variable in rows.edges:
                    return self._edge_property(rows.edges[variable], name)
                return self._view.column(name)[rows.nodes[variable]]
            case ast.Negative(operand=operand):
                return -self._numbers(operand, rows)
            case ast.Arithmetic(op=op, left=left, right=right):
                return self._arithmetic(op, self.value(left, rows), self.value(right, rows))
            case ast.Call():
                return self._call(item, rows)
            case _:
                return _objects(self.truth(item, rows).fits.tolist())

    def _constant(self, item: ast.Expression) -> Any:
        if isinstance(item, ast.ObjectRef):
            return self._view.find(item.id)
        return item.value if isinstance(item, _VALUES) else None

    def _edge_property(self, edge: EdgeColumn, name: str) -> Column:
        match name:
            case "confidence":
                return edge.confidence
            case "label":
                return edge.label
            case "origin":
                return edge.origin
            case "explanation":
                return edge.explanation
            case _:
                return self._view.column("id")[edge.source if name == "source" else edge.target]

    def _arithmetic(self, op: str, left: Column, right: Column) -> Column:
        if op == "+" and (left.dtype == object or right.dtype == object):
            pairs = zip(_listed(left), _listed(right), strict=True)
            return _objects(None if a is None or b is None else f"{a}{b}" for a, b in pairs)
        a, b = _as_numbers(left), _as_numbers(right)
        # As in SQL, what cannot be computed is null: a division by 0, an overflow.
        with np.errstate(all="ignore"):
            match op:
                case "+":
                    result = a + b
                case "-":
                    result = a - b
                case "*":
                    result = a * b
                case "/":
                    result = a / b
                case _:
                    result = np.fmod(a, b)
        return np.where(np.isfinite(result), result, np.nan)

    def _call(self, item: ast.Call, rows: Bindings) -> Column:
        arguments = item.arguments
        match item.name:
            case "distance":
                one, other = self._boxes(arguments[0], rows), self._boxes(arguments[1], rows)
                if len(arguments) == 2:
                    return geometry.distances(one, other)
                measure = arguments[2]
                if not isinstance(measure, ast.Text) or measure.value not in ("boxes", "centers"):
                    raise ExecuteError(
                        "distance() measures between 'boxes' or 'centers'",
                        span=measure.span,
                        hint="'boxes' is meant when left out",
                    )
                return (geometry.distances if measure.value == "boxes" else geometry.center_distances)(one, other)
            case "volume":
                return geometry.volumes(self._boxes(arguments[0], rows))
            case "height":
                return geometry.heights(self._boxes(arguments[0], rows))
            case "width":
                return geometry.widths(self._boxes(arguments[0], rows))
            case "depth":
                return geometry.depths(self._boxes(arguments[0], rows))
            case "inside" | "above":
                return _objects(self.truth(item, rows).fits.tolist())
            case "score":
                return self._score(item, rows)
            case "id":
                return self._of_nodes("id", self.value(arguments[0], rows))
            case "label":
                first = arguments[0]
                if isinstance(first, ast.Variable) and first.name in rows.edges:
                    return rows.edges[first.name].label
                return self._of_nodes("label", self.value(first, rows))
            case "size":
                return self._size(arguments[0], rows)
            case "lower":
                return _objects(None if v is None else str(v).lower() for v in _listed(self.value(arguments[0], rows)))
            case "upper":
                return _objects(None if v is None else str(v).upper() for v in _listed(self.value(arguments[0], rows)))
            case "abs":
                return np.abs(self._numbers(arguments[0], rows))
            case "sqrt":
                numbers = self._numbers(arguments[0], rows)
                return np.sqrt(np.where(numbers >= 0, numbers, np.nan))
            case "round":
                return self._round(arguments, rows)
            case "coalesce":
                columns = [_listed(self.value(x, rows)) for x in arguments]
                return _packed([next((v for v in row if v is not None), None) for row in zip(*columns, strict=True)])
        raise ExecuteError(f"no function '{item.name}'", span=item.span)

    def _score(self, item: ast.Call, rows: Bindings) -> Column:
        if not item.arguments or not isinstance(item.arguments[0], ast.Variable):
            return rows.truth.degree
        degree = np.ones(rows.n)
        for condition in self._asked_of.get(item.arguments[0].name, ()):
            degree = degree * self.truth(condition, rows).degree
        return degree

    def _round(self, arguments: tuple[ast.Expression, ...], rows: Bindings) -> Column:
        numbers = self._numbers(arguments[0], rows)
        if len(arguments) == 1:
            return np.round(numbers)
        digits = self._numbers(arguments[1], rows)
        return np.asarray([rounded(x, d) for x, d in zip(numbers.tolist(), digits.tolist(), strict=True)], np.float64)

    def _size(self, item: ast.Expression, rows: Bindings) -> Column:
        if isinstance(item, ast.Variable) and item.name in rows.edges:
            hops = rows.edges[item.name].hops
            assert hops is not None, "the binder lets only paths come here"
            return np.asarray([len(way) - 1 for way in hops], np.float64)
        values = _listed(self.value(item, rows))
        return np.asarray(
            [np.nan if v is None else len(v) if isinstance(v, (str, list, tuple)) else np.nan for v in values]
        )

    def _numbers(self, item: ast.Expression, rows: Bindings) -> NDArray[np.float64]:
        return _as_numbers(self.value(item, rows))

    def _boxes(self, item: ast.Expression, rows: Bindings) -> geometry.Boxes:
        positions: Positions = self.value(item, rows)
        if not (positions < 0).any():
            return self._view.columns.boxes.take(positions)
        boxes = self._view.columns.boxes.take(np.maximum(positions, 0))
        return replace(boxes, centers=np.where(positions[:, None] < 0, np.nan, boxes.centers))

    def _of_nodes(self, name: str, positions: Positions) -> Column:
        if not (positions < 0).any():
            return self._view.column(name)[positions]
        column = self._view.column(name)
        return _objects(column[position] if position >= 0 else None for position in positions.tolist())


_VALUES = (ast.Text, ast.Number, ast.Boolean)
_CONSTANTS = (*_VALUES, ast.Null, ast.ObjectRef)


def _key(value: Any) -> Any:
    """What is equal for equal values only: true is not 1. None for what is no member of a list of constants."""
    return None if value is None or isinstance(value, (list, tuple)) else (isinstance(value, bool), value)


def rounded(value: float, digits: float | None) -> float:
    """The number rounded to so many decimals; NaN, which is null, where either is null."""
    if digits is None or digits != digits or value != value:
        return math.nan
    return float(round(value, int(min(max(digits, -15), 15))))


# -- columns ----------------------------------------------------------------------------------------------------


def _filled(n: int, value: object) -> Column:
    column = np.empty(n, object)
    column[:] = [value] * n
    return column


def _objects(values: Any) -> Column:
    items = list(values)
    column = np.empty(len(items), object)
    column[:] = items
    return column


def _packed(values: list[Any]) -> Column:
    if all(value is None or (isinstance(value, (int, float)) and not isinstance(value, bool)) for value in values):
        return np.asarray([np.nan if value is None else float(value) for value in values])
    return _objects(values)


def _listed(column: Column) -> list[Any]:
    """Python values with None for null."""
    values = column.tolist()
    return [None if value != value else value for value in values] if column.dtype == np.float64 else values


def _as_numbers(column: Column) -> NDArray[np.float64]:
    if column.dtype != object:
        return column.astype(np.float64)
    return np.asarray(
        [float(v) if isinstance(v, (int, float)) and not isinstance(v, bool) else np.nan for v in column.tolist()],
        np.float64,
    )


def _nulls(column: Column) -> NDArray[np.bool_]:
    return np.isnan(column) if column.dtype == np.float64 else _flags(value is None for value in column.tolist())


def _flags(values: Any) -> NDArray[np.bool_]:
    return np.fromiter(values, bool)


def _known(pairs: Any) -> Any:
    """The pairs with texts that differ in place of a null, so that a comparison with it is false."""
    return ((a, b) if isinstance(a, str) and isinstance(b, str) else ("", "\x00") for a, b in pairs)


def _folded(text: str) -> str:
    return text.casefold()


def _same(a: object, b: object) -> bool:
    return type(a) is type(b) and a == b if isinstance(a, bool) or isinstance(b, bool) else a == b


def _same_folded(a: object, b: object) -> bool:
    return a.casefold() == b.casefold() if isinstance(a, str) and isinstance(b, str) else _same(a, b)


def _contained(wholes: Column, parts: Column, same: Callable[[object, object], bool]) -> NDArray[np.bool_]:
    def found(whole: object, part: object) -> bool:
        if whole is None or part is None:
            return False
        if isinstance(whole, (list, tuple)):
            return any(same(member, part) for member in whole)
        return str(part).casefold() in str(whole).casefold()

    return _flags(found(a, b) for a, b in zip(_listed(wholes), _listed(parts), strict=True))


def _compared(op: str, left: Column, right: Column) -> NDArray[np.bool_]:
    """Whether ``left op right``; never where either is null, nor between a number and a text."""
    if left.dtype != object and right.dtype != object:
        with np.errstate(invalid="ignore"):
            match op:
                case "=":
                    return np.asarray(left == right)
                case "<>":
                    return np.asarray((left != right) & ~_nulls(left) & ~_nulls(right))
                case "<":
                    return np.asarray(left < right)
                case "<=":
                    return np.asarray(left <= right)
                case ">":
                    return np.asarray(left > right)
                case _:
                    return np.asarray(left >= right)
    pairs = zip(_listed(left), _listed(right), strict=True)
    return _flags(a is not None and b is not None and _one_compared(op, a, b) for a, b in pairs)


def _one_compared(op: str, a: Any, b: Any) -> bool:
    if isinstance(a, tuple):
        a = list(a)
    if isinstance(b, tuple):
        b = list(b)
    if op == "=":
        return _same(a, b)
    if op == "<>":
        return not _same(a, b)
    ordered = (isinstance(a, str) and isinstance(b, str)) or (_is_number(a) and _is_number(b))
    if not ordered:
        return False
    match op:
        case "<":
            return bool(a < b)
        case "<=":
            return bool(a <= b)
        case ">":
            return bool(a > b)
        case _:
            return bool(a >= b)


def _is_number(value: object) -> bool:
    return isinstance(value, (int, float)) and not isinstance(value, bool)
