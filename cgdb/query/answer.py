"""Answer: the rows of a match become the rows of a result: ordered, cut, grouped, and each able to say why."""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from cgdb.errors import LimitError
from cgdb.grammar import ast
from cgdb.index.positions import EdgeColumn
from cgdb.query.bindings import Bindings
from cgdb.query.bound import BoundEdge, BoundQuery
from cgdb.query.evaluate import rounded
from cgdb.query.executor import Executor
from cgdb.query.expressions import is_total
from cgdb.query.functions import AGGREGATES
from cgdb.query.limits import Budget
from cgdb.query.planner import Plan
from cgdb.query.reasons import reasons
from cgdb.result import Path, Row, StoredNode, StoredRelation, Value
from cgdb.scene import ObjectId
from cgdb.view import SceneView

LARGEST_RESULT = 1_000_000
AT_ONCE = 10_000
"""Rows that are made between two looks at the clock."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class SceneRows:
    """The rows that one scene gave, with what is needed to read them."""

    view: SceneView
    executor: Executor
    plan: Plan
    rows: Bindings


def answer(query: BoundQuery, parts: Sequence[SceneRows], budget: Budget) -> tuple[Row, ...]:
    """The rows of the result, best first or as ORDER BY says, after SKIP and LIMIT."""
    if query.aggregates:
        rows = _grouped(query, parts, budget)
        return tuple(rows[query.skip : None if query.limit is None else query.skip + query.limit])
    places = _ordered(query, parts)
    if query.distinct:
        return tuple(_distinct(query, parts, places, budget))
    chosen = places[query.skip : None if query.limit is None else query.skip + query.limit]
    if len(chosen) > LARGEST_RESULT:
        raise LimitError(
            f"the result would have {len(chosen):,} rows; {LARGEST_RESULT:,} is the most", hint="add LIMIT"
        )
    return tuple(_rows(query, parts, chosen, budget))


Place = tuple[int, int]
"""Number of the part, and row in it."""


def _ordered(query: BoundQuery, parts: Sequence[SceneRows]) -> list[Place]:
    """All rows in their final order.

    Best score first; ORDER BY orders the rows that fit, the others follow after them, best score first. Rows that
    are equal in that keep the order of scenes and of ids in them.
    """
    part = np.concatenate([np.full(p.rows.n, i) for i, p in enumerate(parts)] or [np.empty(0, np.int64)])
    row = np.concatenate([np.arange(p.rows.n) for p in parts] or [np.empty(0, np.int64)])
    score = np.concatenate([p.rows.truth.degree for p in parts] or [np.empty(0)])
    fits = np.concatenate([p.rows.truth.fits for p in parts] or [np.empty(0, bool)])
    # What differs only in the last bits of a float is a tie: results must not hang on the shape of a matrix product.
    by_score = -np.round(score, 6)
    if not query.order:
        if query.limit is not None and len(score) > 4 * (wanted := query.skip + query.limit) and wanted > 0:
            line = np.partition(by_score, wanted - 1)[wanted - 1]
            near = np.flatnonzero(by_score <= line)
            order = near[np.lexsort((row[near], part[near], by_score[near]))]
        else:
            order = np.lexsort((row, part, by_score))
        return list(zip(part[order].tolist(), row[order].tolist(), strict=True))
    keys: list[NDArray[Any]] = [row, part, by_score]
    for item in reversed(query.order):
        columns = [p.executor.evaluator.value(item.expression, p.rows) for p in parts]
        values = [value for p, c in zip(parts, columns, strict=True) for value in _sortable(p, item, c)]
        keys.append(np.where(fits, _ranks(values, descending=item.descending), 0))
    keys.append(~fits)
    order = np.lexsort(keys)
    return list(zip(part[order].tolist(), row[order].tolist(), strict=True))


def _sortable(part: SceneRows, item: ast.OrderItem, column: NDArray[Any]) -> list[Any]:
    if isinstance(item.expression, ast.Variable | ast.ObjectRef):
        name = item.expression.name if isinstance(item.expression, ast.Variable) else None
        if name not in part.rows.edges:
            return [part.view.column("id")[position] for position in column.tolist()]
    return [None if value != value else value for value in column.tolist()]


def _ranks(values: list[Any], *, descending: bool = False) -> NDArray[np.int64]:
    """The rank of each value: numbers, then texts, then lists; nulls last whichever way it is ordered."""

    def key(value: Any) -> tuple[int, Any]:
        if isinstance(value, (bool, int, float)):
            return (0, value)
        if isinstance(value, str):
            return (1, value.casefold())
        if isinstance(value, (list, tuple)):
            return (2, [key(item) for item in value])
        return (3, 0)

    keys = [key(value) for value in values]
    result = np.zeros(len(values), np.int64)
    rank = 0
    order = sorted(range(len(values)), key=keys.__getitem__)
    for before, now in itertools.pairwise(order):
        rank += keys[before] != keys[now]
        result[now] = rank
    null = np.asarray([value is None for value in values], bool)
    return np.where(null, len(values), -result if descending else result)


def _rows(query: BoundQuery, parts: Sequence[SceneRows], places: Sequence[Place], budget: Budget) -> list[Row]:
    made: dict[Place, Row] = {}
    for number, part in enumerate(parts):
        mine = [row for p, row in places if p == number]
        for start in range(0, len(mine), AT_ONCE):
            budget.check()
            some = mine[start : start + AT_ONCE]
            rows = part.rows.take(np.asarray(some, np.int64))
            records = _records(part, query, rows)
            columns = [_values(part, column.expression, rows, records) for column in query.returns]
            degrees, fits = rows.truth.degree.tolist(), rows.truth.fits.tolist()
            for i, values in enumerate(zip(*columns, strict=True)):
                made[(number, some[i])] = Row(values, degrees[i], fits[i], _explainer(query, part, rows, i))
    return [made[place] for place in places]


def _explainer(query: BoundQuery, part: SceneRows, rows: Bindings, i: int) -> Callable[[], Any]:
    def explain() -> Any:
        # Who asks for the reasons may do so long after the query: they have its time once more.
        part.executor.allow_anew()
        return reasons(query, part.plan, part.view, part.executor, rows.take(np.asarray([i])))

    return explain


def _distinct(query: BoundQuery, parts: Sequence[SceneRows], places: Sequence[Place], budget: Budget) -> list[Row]:
    wanted = None if query.limit is None else query.skip + query.limit
    seen: set[Any] = set()
    kept: list[Row] = []
    step = 1000
    for start in range(0, len(places), step):
        for row in _rows(query, parts, places[start : start + step], budget):
            identity = tuple(map(_identity, row.values))
            if identity not in seen:
                seen.add(identity)
                kept.append(row)
        if wanted is not None and len(kept) >= wanted:
            break
    return kept[query.skip : wanted]


def _records(part: SceneRows, query: BoundQuery, rows: Bindings) -> Mapping[int, StoredNode]:
    """The records of all nodes that the columns of the result hold, read together."""
    items = [column.expression for column in query.returns]
    names = {item.name for item in items if isinstance(item, ast.Variable) and item.name in rows.nodes}
    found = [rows.nodes[name] for name in names]
    return part.view.stored(np.unique(np.concatenate(found))) if len(found) > 1 else {}


def _values(
    part: SceneRows, item: ast.Expression, rows: Bindings, records: Mapping[int, StoredNode] | None = None
) -> list[Value]:
    """The values of an expression as results hold them: nodes and relations as records, null as None.

    records: of nodes, where they were read already.
    """
    view = part.view
    if isinstance(item, ast.Variable) and item.name in rows.edges:
        edge = next(edge for edge in part.plan.match.edges if edge.name == item.name)
        return _edge_values(view, rows.edges[item.name], edge)
    column = part.executor.evaluator.value(item, rows)
    if isinstance(item, ast.Variable | ast.ObjectRef):
        if not records or not isinstance(item, ast.Variable):
            records = view.stored(column[column >= 0])
        return [records.get(position) for position in column.tolist()]
    return [_plain_number(value) for value in column.tolist()]


def _plain_number(value: Any) -> Value:
    if isinstance(value, float):
        if value != value:
            return None
        # 3 chairs, not 3.0 chairs; a whole float beyond 2**53 may not be what was stored.
        return int(value) if value.is_integer() and abs(value) < 2**53 else value
    return value  # type: ignore[no-any-return]


def _edge_values(view: SceneView, edge: EdgeColumn, asked: BoundEdge) -> list[Value]:
    ids = view.column("id")
    name = view.info.name
    if edge.hops is not None:
        return _paths(view, edge.hops.tolist(), asked)
    return [
        StoredRelation(
            scene=name,
            source=ids[source],
            target=ids[target],
            label=label,
            confidence=confidence,
            explanation=explanation,
            origin=origin,
        )
        for source, target, label, confidence, explanation, origin in zip(
            edge.source.tolist(),
            edge.target.tolist(),
            edge.label,
            edge.confidence.tolist(),
            edge.explanation,
            edge.origin,
            strict=True,
        )
    ]


def _paths(view: SceneView, ways: Sequence[tuple[int, ...]], asked: BoundEdge) -> list[Value]:
    """The relations along each way: between two nodes the best of those that were asked for."""
    ids = view.column("id")
    best: dict[tuple[ObjectId, ObjectId], StoredRelation] = {}
    for relation in view.relations_of(np.unique([position for way in ways for position in way]).astype(np.int64)):
        if not asked.labels or relation.label in asked.labels:
            ends = ((relation.source, relation.target), (relation.target, relation.source))
            for pair in ends[: 1 if asked.directed else 2]:
                if pair not in best or best[pair].confidence < relation.confidence:
                    best[pair] = relation
    return [Path(relations=tuple(best[ids[one], ids[other]] for one, other in itertools.pairwise(way))) for way in ways]


# -- aggregates -------------------------------------------------------------------------------------------------


def _grouped(query: BoundQuery, parts: Sequence[SceneRows], budget: Budget) -> list[Row]:
    """One row per combination of the columns that are no aggregates, over the rows that fit."""
    by = [i for i, column in enumerate(query.returns) if not is_total(column.expression)]
    groups: dict[tuple[Any, ...], list[tuple[SceneRows, int]]] = {}
    shown: dict[tuple[Any, ...], tuple[Value, ...]] = {}
    for part in parts:
        rows = part.rows.take(np.flatnonzero(part.rows.truth.fits))
        fitting = SceneRows(view=part.view, executor=part.executor, plan=part.plan, rows=rows)
        columns = [_values(part, query.returns[i].expression, rows) for i in by]
        for row in range(rows.n):
            if row % AT_ONCE == 0:
                budget.check()
            values = tuple(column[row] for column in columns)
            identity = tuple(map(_identity, values))
            groups.setdefault(identity, []).append((fitting, row))
            shown.setdefault(identity, values)
    if not by and not groups:
        groups[()] = []
        shown[()] = ()
    result = []
    for identity, members in groups.items():
        budget.check()
        cells = dict(zip(by, shown[identity], strict=True))
        values = tuple(
            cells[i] if i in cells else _aggregate(column.expression, members) for i, column in enumerate(query.returns)
        )
        scores = [float(part.rows.truth.degree[row]) for part, row in members]
        result.append(Row(values, max(scores, default=0.0), bool(members), _group_explainer(query, members)))
    # Best first; equal ones, and with ORDER BY what is equal in that, keep this order.
    result.sort(key=lambda row: -round(row.score, 6))
    if query.order:
        for item in reversed(query.order):
            at = next(i for i, column in enumerate(query.returns) if column.expression == item.expression)
            ranks = _ranks([_order_value(row.values[at]) for row in result], descending=item.descending)
            order = np.argsort(ranks, kind="stable")
            result = [result[i] for i in order.tolist()]
    return result


def _group_explainer(query: BoundQuery, members: Sequence[tuple[SceneRows, int]]) -> Callable[[], Any]:
    def explain() -> Any:
        if not members:
            return ()
        part, row = max(members, key=lambda member: float(member[0].rows.truth.degree[member[1]]))
        return reasons(query, part.plan, part.view, part.executor, part.rows.take(np.asarray([row])))

    return explain


def _aggregate(item: ast.Expression, members: Sequence[tuple[SceneRows, int]]) -> Value:
    if isinstance(item, ast.Call) and item.name in AGGREGATES:
        if item.star:
            return len(members)
        of = item.arguments[0]
        if item.name == "count" and isinstance(of, ast.Variable) and members and of.name in members[0][0].rows.nodes:
            # Nodes are counted without being read.
            nodes = [(id(part), int(part.rows.nodes[of.name][row])) for part, row in members]
            return len(set(nodes)) if item.distinct else len(nodes)
        values: list[Value] = []
        by_part: dict[int, list[int]] = {}
        known = {id(part): part for part, _ in members}
        for part, row in members:
            by_part.setdefault(id(part), []).append(row)
        for key, rows in by_part.items():
            part = known[key]
            values.extend(_values(part, of, part.rows.take(np.asarray(rows, np.int64))))
        present = [value for value in values if value is not None]
        if item.distinct:
            present = list({_identity(value): value for value in present}.values())
        return _reduced(item.name, present)
    if isinstance(item, ast.Arithmetic):
        left, right = _aggregate(item.left, members), _aggregate(item.right, members)
        return _arithmetic(item.op, left, right)
    if isinstance(item, ast.Negative):
        inner = _aggregate(item.operand, members)
        return -inner if isinstance(inner, (int, float)) else None
    if isinstance(item, ast.Call) and is_total(item):
        return _function(item.name, [_aggregate(argument, members) for argument in item.arguments])
    if isinstance(item, ast.Number | ast.Text | ast.Boolean):
        return item.value
    if not members:
        return None
    part, row = members[0]
    return _values(part, item, part.rows.take(np.asarray([row])))[0]


def _function(name: str, values: Sequence[Value]) -> Value:
    """A function of totals; null where its first argument is none that it can be of."""
    value = values[0]
    if name == "coalesce":
        return next((value for value in values if value is not None), None)
    if name == "size":
        return len(value) if isinstance(value, (list, tuple, str)) else None
    if name in ("lower", "upper"):
        return None if value is None else str(value).lower() if name == "lower" else str(value).upper()
    if not isinstance(value, (int, float)) or isinstance(value, bool):
        return None
    if name == "abs":
        return abs(value)
    if name == "sqrt":
        return _plain_number(math.sqrt(value)) if value >= 0 else None
    digits = values[1] if len(values) > 1 else 0
    return _plain_number(rounded(float(value), digits if isinstance(digits, (int, float)) else None))


def _reduced(name: str, values: Sequence[Value]) -> Value:
    numbers = [float(value) for value in values if isinstance(value, (int, float)) and not isinstance(value, bool)]
    match name:
        case "count":
            return len(values)
        case "collect":
            return list(values)
        case "sum":
            return _plain_number(float(np.sum(numbers)))
        case "avg":
            return _plain_number(float(np.mean(numbers))) if numbers else None
    if not values:
        return None
    ranks = _ranks([_order_value(value) for value in values])
    return values[int(ranks.argmin() if name == "min" else ranks.argmax())]


def _arithmetic(op: str, left: Value, right: Value) -> Value:
    if not isinstance(left, (int, float)) or not isinstance(right, (int, float)):
        return None
    if op in "/%" and right == 0:
        return None
    result = {"+": left + right, "-": left - right, "*": left * right}.get(op)
    if result is None:
        result = left / right if op == "/" else float(np.fmod(left, right))
    return _plain_number(float(result))


def _order_value(value: Value) -> Any:
    if isinstance(value, StoredNode):
        return value.id
    if isinstance(value, (StoredRelation, Path)):
        return str(value)
    return value


def _identity(value: Any) -> Any:
    if isinstance(value, StoredNode):
        return (value.scene, value.id)
    if isinstance(value, (list, tuple)):
        return tuple(map(_identity, value))
    if isinstance(value, Path):
        return tuple(map(_identity, value.relations))
    return value
