"""Why a row is there: what it was asked, condition by condition, each with its degree and its evidence."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from cgdb.errors import Span
from cgdb.grammar import ast
from cgdb.grammar.printer import to_text
from cgdb.meaning.meanings import LikeMeaning, Meaning, TextMeaning
from cgdb.query.bindings import Bindings
from cgdb.query.bound import BoundEdge, BoundQuery
from cgdb.query.expressions import parts
from cgdb.query.planner import Plan
from cgdb.result import Reason

if TYPE_CHECKING:
    from cgdb.query.executor import Executor
    from cgdb.view import SceneView


def reasons(query: BoundQuery, plan: Plan, view: SceneView, executor: Executor, row: Bindings) -> tuple[Reason, ...]:
    """The reasons of a single row, in the order in which the statement asks."""
    names = _Names(view, row)
    found = [_edge_reason(edge, view, row, names) for edge in plan.match.edges]
    found.extend(_condition_reason(condition, query, view, executor, row, names) for condition in query.conditions)
    return tuple(found)


class _Names:
    """What the nodes of a row are called in its reasons: #id and tag."""

    def __init__(self, view: SceneView, row: Bindings) -> None:
        self._view = view
        positions = np.unique(np.concatenate([*row.nodes.values(), np.empty(0, np.int64)])).astype(np.int64)
        self._records = view.stored(positions)

    def of(self, position: int) -> str:
        if position not in self._records:
            self._records.update(self._view.stored(np.asarray([position], np.int64)))
        return str(self._records[position])


def _edge_reason(edge: BoundEdge, view: SceneView, row: Bindings, names: _Names) -> Reason:
    column = row.edges[edge.name]
    source, target = names.of(int(column.source[0])), names.of(int(column.target[0]))
    if column.hops is not None:
        way = " - ".join(names.of(position) for position in column.hops[0])
        asked = f"path {'|'.join(edge.labels) or 'of any relations'}"
        return Reason(asked=asked, degree=float(column.confidence[0]), evidence={"way": way})
    evidence: dict[str, Any] = {"origin": column.origin[0]}
    if column.explanation[0]:
        evidence["explanation"] = column.explanation[0]
    degree = float(column.confidence[0])
    asked = f"{source} {column.label[0]} {target}"
    if edge.meaning is not None:
        match = float(view.degrees.relation_degrees(edge.meaning, column)[0])
        evidence[f"~ {meaning_text(edge.meaning)}"] = round(match, 3)
        degree *= match
    return Reason(asked=asked, degree=degree, evidence=evidence)


def _condition_reason(
    condition: ast.Expression,
    query: BoundQuery,
    view: SceneView,
    executor: Executor,
    row: Bindings,
    names: _Names,
) -> Reason:
    degree = float(executor.evaluator.truth(condition, row).degree[0])
    evidence: dict[str, Any] = {}
    for item in _leaves(condition):
        if isinstance(item, ast.Similar):
            meaning = query.meanings[item.meaning]
            position = int(row.nodes[item.variable][0])
            absent = isinstance(meaning, LikeMeaning) and view.find(meaning.id) is None
            evidence[f"{names.of(position)} ~ {meaning_text(meaning)}"] = (
                "0.00: it is not in this scene" if absent else _evidence_text(view.degrees.explain(meaning, position))
            )
        elif isinstance(item, ast.PatternCondition):
            best = executor.best_match(item.pattern, row)
            if best.n:
                for edge in query.subpatterns[item.pattern].edges:
                    reason = _edge_reason(edge, view, best, names)
                    evidence[reason.asked] = round(reason.degree, 3)
            else:
                evidence[_text(item, query)] = "no such neighbour"
        elif isinstance(item, ast.Call) or (isinstance(item, ast.Property) and item.variable in row.nodes):
            value = executor.evaluator.value(item, row).tolist()[0]
            value = None if value != value else value  # NaN is how a column says null
            evidence[_text(item, query)] = round(value, 3) if isinstance(value, float) else value
    return Reason(asked=_text(condition, query), degree=degree, evidence=evidence)


def _leaves(item: object) -> list[object]:
    """The parts of a condition that can be told about one by one, outermost first."""
    if isinstance(item, (ast.Similar, ast.PatternCondition, ast.Call, ast.Property)):
        return [item]
    found: list[object] = []
    for part in parts(item):
        found.extend(_leaves(part))
    return found


def _evidence_text(explained: Mapping[str, Any]) -> str:
    parts = explained.get("evidence", {})
    inside = ", ".join(f"{name} {value}" for name, value in parts.items())
    told = "".join(f"; {said}" for said in explained.get("told", ()))
    return f"{explained['degree']:.2f}" + (f" from {inside}" if inside else "") + told


def meaning_text(meaning: Meaning) -> str:
    """A meaning as it was asked."""
    if isinstance(meaning, TextMeaning):
        return f'"{meaning.text}"'
    return f"#{meaning.id}" if isinstance(meaning, LikeMeaning) else f"${meaning.parameter}"


def asked(item: ast.Expression, query: BoundQuery) -> str:
    """A condition or value in the words of the statement: parameters by their names, not their values."""
    return to_text(_with_names(item, query.given) if query.given else item)


_GIVEN = (ast.Text, ast.Number, ast.Boolean, ast.Null, ast.ListOf)


def _with_names(item: Any, given: Mapping[Span, str]) -> Any:
    if isinstance(item, _GIVEN) and item.span in given:
        return ast.Parameter(name=given[item.span], span=item.span)
    changed: dict[str, Any] = {}
    for name in item.__slots__:
        value = getattr(item, name)
        if isinstance(value, ast.Syntax):
            changed[name] = _with_names(value, given)
        elif isinstance(value, tuple) and value and isinstance(value[0], ast.Syntax):
            changed[name] = tuple(_with_names(one, given) for one in value)
    return replace(item, **changed) if changed else item


def _text(item: ast.Expression, query: BoundQuery) -> str:
    text = asked(item, query)
    # A node without a name has one of the binder's, which nobody wrote.
    return text if len(text) <= 120 else text[:117] + "..."
