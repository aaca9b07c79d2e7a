"""Executor: carries out the plan of a match over one scene and gives its rows with their degrees."""

from __future__ import annotations

import time
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np

from cgdb.grammar import ast
from cgdb.index.positions import EdgeColumn, Flags, Positions
from cgdb.meaning.meanings import Meaning
from cgdb.query import cypher
from cgdb.query.bindings import Bindings, Truth, always, concatenate
from cgdb.query.bound import BoundEdge, BoundNode, BoundQuery
from cgdb.query.evaluate import Evaluator
from cgdb.query.expand import expand
from cgdb.query.expressions import names_score, variables
from cgdb.query.limits import Budget
from cgdb.query.near import joined, near_pairs
from cgdb.query.paths import follow
from cgdb.query.planner import FIRST_BATCH, GRAPH_EDGES, Plan, Seed, plan_condition

if TYPE_CHECKING:
    from cgdb.view import SceneView


FEW_PAIRS = 10_000
"""Up to so many pairs are all tried: a grid costs more than they do."""


@dataclass(slots=True)
class Profile:
    """What really happened, per step: rows and seconds, added up over batches and scenes."""

    steps: dict[str, tuple[int, float]] = field(default_factory=dict)

    def add(self, step: str, rows: int, seconds: float) -> None:
        """Count one execution of a step."""
        known_rows, known_seconds = self.steps.get(step, (0, 0.0))
        self.steps[step] = (known_rows + rows, known_seconds + seconds)


class Executor:
    """Runs one bound statement over one scene."""

    def __init__(self, view: SceneView, query: BoundQuery, budget: Budget, profile: Profile) -> None:
        self._view = view
        self._query = query
        self._budget = budget
        self._profile = profile
        self._subplans: dict[ast.Pattern, Plan] = {}
        self._truths: tuple[Bindings | None, dict[ast.Pattern, Truth]] = (None, {})
        self.evaluator = Evaluator(view, query.meanings, self.pattern_truth, asked_of(query))

    def rows(self, plan: Plan) -> Bindings:
        """All rows of the match, each with the degree of everything it was asked; in no order of merit.

        With plan.top, at least so many of the best are among them, and maybe not the others.
        """
        missing = [
            node.id for node in plan.match.nodes.values() if node.id is not None and self._view.find(node.id) is None
        ]
        if missing:
            return _no_rows(plan.match.nodes, [edge.name for edge in plan.match.edges])
        known = self._filtered(plan)
        if plan.seed is not None:
            return self._from_vectors(plan, plan.seed, known)
        if plan.fitting:
            rows = self._match(plan, self._fitting(plan, known))
            if plan.enough is None or np.count_nonzero(rows.truth.fits) >= plan.enough:
                return rows
        return self._match(plan, known)

    def pattern_truth(self, pattern: ast.Pattern, rows: Bindings) -> Truth:
        """The degree of a pattern used as a condition: of its best match, for the nodes that each row gives it.

        Remembered for the rows that were asked last: a condition may say the same pattern twice.
        """
        if self._truths[0] is not rows:
            self._truths = (rows, {})
        known = self._truths[1]
        if pattern not in known:
            known[pattern] = self._pattern_truth(pattern, rows)
        return known[pattern]

    def _pattern_truth(self, pattern: ast.Pattern, rows: Bindings) -> Truth:
        found, shared = self._pattern_matches(pattern, rows)
        best = found.best_per([found.nodes[name] for name in shared])
        if not shared:
            degree = np.full(rows.n, best.truth.degree[0] if best.n else 0.0)
            return Truth(degree=degree, fits=np.full(rows.n, bool(best.n and best.truth.fits[0])))
        place = _lookup([best.nodes[name] for name in shared], [rows.nodes[name] for name in shared])
        known = place >= 0
        degree, fits = np.zeros(rows.n), np.zeros(rows.n, bool)
        degree[known], fits[known] = best.truth.degree[place[known]], best.truth.fits[place[known]]
        return Truth(degree=degree, fits=fits)

    def allow_anew(self) -> None:
        """From now on there is as much time again as there was for the query."""
        self._budget = Budget(limits=self._budget.limits)

    def best_match(self, pattern: ast.Pattern, row: Bindings) -> Bindings:
        """The match that a single row owes its degree to; no rows where there is none."""
        found, _ = self._pattern_matches(pattern, row)
        return found.best_per([])

    # -- matching -----------------------------------------------------------------------------------------------

    def _pattern_matches(self, pattern: ast.Pattern, rows: Bindings) -> tuple[Bindings, list[str]]:
        match = self._query.subpatterns[pattern]
        if pattern not in self._subplans:
            self._subplans[pattern] = plan_condition(match, self._view.catalog)
        shared = [name for name in match.nodes if name in rows.nodes]
        known = {name: np.unique(rows.nodes[name]) for name in shared}
        return self._match(self._subplans[pattern], known, collapse=False), shared

    def _filtered(self, plan: Plan) -> dict[str, Positions]:
        """{node: the only positions that it may have}, by the plan's filters."""
        known: dict[str, Positions] = {}
        for name, condition in plan.filters:
            started = time.perf_counter()
            rows = Bindings.of_nodes(name, self._scanned(plan.match.nodes[name], known.get(name)))
            known[name] = rows.weigh(self.evaluator.truth(condition, rows)).nodes[name]
            self._profile.add(f"filter {id(condition)}", len(known[name]), time.perf_counter() - started)
        return known

    def _fitting(self, plan: Plan, known: Mapping[str, Positions]) -> dict[str, Positions]:
        """The positions that are left of each node by what it must fit."""
        left = dict(known)
        for name, condition in plan.fitting:
            started = time.perf_counter()
            rows = Bindings.of_nodes(name, self._scanned(plan.match.nodes[name], left.get(name)))
            left[name] = rows.nodes[name][self.evaluator.truth(condition, rows).fits]
            self._profile.add(f"fitting {id(condition)}", len(left[name]), time.perf_counter() - started)
        return left

    def _from_vectors(self, plan: Plan, seed: Seed, known: Mapping[str, Positions]) -> Bindings:
        """Rows for the best candidates of one ``~`` first, until no later candidate can be among the best rows."""
        assert plan.top is not None
        candidates = self._scanned(plan.match.nodes[seed.node], known.get(seed.node))
        started = time.perf_counter()
        degrees = self.evaluator.degrees(self._query.meanings[seed.meaning], candidates).astype(np.float64)
        order = np.argsort(-degrees, kind="stable")
        self._profile.add(f"vectors {seed.node}", len(candidates), time.perf_counter() - started)
        parts: list[Bindings] = []
        best = np.empty(0)
        done, size = 0, max(FIRST_BATCH, 2 * plan.top)
        if len(candidates) <= 4 * size:
            size = len(candidates)
        while done < len(order):
            batch = np.sort(candidates[order[done : done + size]])
            done, size = done + len(batch), size * 4
            parts.append(self._match(plan, {**known, seed.node: batch}))
            best = np.sort(np.concatenate([best, parts[-1].truth.degree]))[::-1][: plan.top]
            if done < len(order) and len(best) == plan.top and best[-1] >= degrees[order[done]]:
                break
        return concatenate(parts) if parts else _no_rows(plan.match.nodes, [edge.name for edge in plan.match.edges])

    def _match(self, plan: Plan, known: Mapping[str, Positions], *, collapse: bool = True) -> Bindings:
        """The rows of a match. known: {node: the only positions that it may have}."""
        known = dict(known)
        for node in plan.match.nodes.values():
            if node.id is not None:
                position = self._view.find(node.id)
                here = np.asarray([] if position is None else [position], np.int64)
                known[node.name] = np.intersect1d(known[node.name], here) if node.name in known else here
        rows: Bindings | None = None
        for number, component in enumerate(plan.components):
            if rows is not None and self._reached_by_path(plan, component):
                continue
            self._budget.check()
            started = time.perf_counter()
            found = self._component(component, known)
            self._profile.add(f"component {number}", found.n, time.perf_counter() - started)
            rows = found if rows is None else self._paired(plan, rows, found)
        assert rows is not None, "a match has at least one node"
        for edge in plan.paths:
            self._budget.check()
            started = time.perf_counter()
            rows = self._follow(plan, edge, rows, known)
            self._profile.add(f"path {edge.name}", rows.n, time.perf_counter() - started)
        rows = self._weigh(rows, [self._edge_truth(edge, rows) for edge in plan.match.edges])
        rows = self._conditions(rows, plan.hidden)
        unnamed = [node for node in plan.match.nodes.values() if not node.named]
        if collapse and (unnamed or any(not edge.named for edge in plan.match.edges)):
            rows = rows.best_per(self._row_identity(plan, rows))
        return self._conditions(rows, plan.conditions)

    def _paired(self, plan: Plan, rows: Bindings, found: Bindings) -> Bindings:
        """Rows of two components together: those that a distance brings near, else every one with every other."""
        for near in plan.near:
            for here, there in ((near.one, near.other), (near.other, near.one)):
                if here in rows.nodes and there in found.nodes and rows.n * found.n > FEW_PAIRS:
                    boxes = self._view.columns.boxes
                    one, other = np.unique(rows.nodes[here]), np.unique(found.nodes[there])
                    pairs = near_pairs(boxes, one, other, near.metres, self._budget)
                    both = joined(rows, found, here, there, pairs, self._budget)
                    return _without_shared_edges(both, rows.edges, found.edges)
        self._budget.check_rows(rows.n * found.n)
        return _without_shared_edges(rows.cross(found), rows.edges, found.edges)

    def _reached_by_path(self, plan: Plan, component: cypher.Component) -> bool:
        """Whether a node without conditions of its own is the end of a path, which will bring it."""
        node = component.nodes[0]
        return (
            not component.edges
            and not component.pushed
            and any(node.name in (edge.source, edge.target) for edge in plan.paths)
        )

    def _follow(self, plan: Plan, edge: BoundEdge, rows: Bindings, known: Mapping[str, Positions]) -> Bindings:
        if edge.source not in rows.nodes and edge.target not in rows.nodes:
            node = plan.match.nodes[edge.source]
            begin = self._scanned(node, known.get(node.name))
            self._budget.check_rows(rows.n * len(begin))
            rows = rows.cross(Bindings.of_nodes(node.name, begin))
        free = edge.source if edge.source not in rows.nodes else edge.target
        node = plan.match.nodes[free]
        return follow(self._view, edge, rows, self._scanned(node, known.get(free)), self._budget)

    def _row_identity(self, plan: Plan, rows: Bindings) -> list[Positions]:
        """The columns that make rows different: named nodes and edges. What has no name is only asked to exist."""
        columns = [rows.nodes[node.name] for node in plan.match.nodes.values() if node.named]
        for edge in plan.match.edges:
            if edge.named and not edge.is_path:
                column = rows.edges[edge.name]
                texts = [f"{a}\x00{b}" for a, b in zip(column.label, column.origin, strict=True)]
                columns.extend(
                    (column.source, column.target, np.unique(texts, return_inverse=True)[1].astype(np.int64))
                )
        return columns

    def _conditions(self, rows: Bindings, conditions: Sequence[ast.Expression]) -> Bindings:
        for number, condition in enumerate(conditions):
            self._budget.check()
            started = time.perf_counter()
            rows = rows.weigh(self.evaluator.truth(condition, rows))
            self._profile.add(f"condition {number} {id(condition)}", rows.n, time.perf_counter() - started)
        return rows

    def _weigh(self, rows: Bindings, truths: Sequence[Truth]) -> Bindings:
        total = always(rows.n)
        for truth in truths:
            total = total & truth
        return rows.weigh(total)

    def _edge_truth(self, edge: BoundEdge, rows: Bindings) -> Truth:
        column = rows.edges[edge.name]
        truth = Truth.of(column.confidence)
        if edge.meaning is not None:
            truth = truth & Truth.of(self._view.degrees.relation_degrees(edge.meaning, column))
        return truth

    def _component(self, component: cypher.Component, known: Mapping[str, Positions]) -> Bindings:
        if not component.edges and not component.pushed:
            node = component.nodes[0]
            return Bindings.of_nodes(node.name, self._scanned(node, known.get(node.name)))
        columns = self._view.columns
        mine = {node.name: known[node.name] for node in component.nodes if node.name in known}
        if any(not len(positions) for positions in mine.values()):
            return _no_rows([node.name for node in component.nodes], [edge.name for edge in component.edges])
        if not mine and len(component.edges) > GRAPH_EDGES:
            first = component.nodes[0]
            mine = {first.name: self._scanned(first, None)}
        if mine:
            return self._expanded(component, mine)
        statement = cypher.statement(component)
        table = self._view.graph.run(statement.text, statement.parameters, timeout_s=self._budget.remaining)
        self._budget.check_rows(len(table))
        nodes = {name: columns.positions(np.asarray(table.data[i], np.int64)) for i, name in enumerate(statement.nodes)}
        edges = {}
        at = len(statement.nodes)
        for edge in component.edges:
            label, confidence, origin, source, explanation = table.data[at : at + len(cypher.EDGE_COLUMNS)]
            at += len(cypher.EDGE_COLUMNS)
            begin = columns.positions(np.asarray(source, np.int64))
            one, other = nodes[edge.source], nodes[edge.target]
            edges[edge.name] = EdgeColumn(
                source=begin,
                target=np.where(begin == one, other, one),
                confidence=np.asarray(confidence, np.float64),
                label=_texts(label),
                origin=_texts(origin),
                explanation=_texts(explanation),
            )
        return _in_order(Bindings(n=len(table), nodes=nodes, edges=edges, truth=always(len(table))))

    def _expanded(self, component: cypher.Component, known: Mapping[str, Positions]) -> Bindings:
        """The rows of a component of which some nodes are known: from the fewest of them over their relations."""

        def allowed(node: BoundNode) -> Positions | None:
            positions = self._scanned(node, known.get(node.name))
            return None if len(positions) == len(self._view.columns.keys) else positions

        start = min(known, key=lambda name: len(known[name]))
        rows = expand(component, start, allowed, self._view.relations, self._budget)
        for condition in component.pushed:
            rows = rows.weigh(self.evaluator.truth(condition, rows))
        return _in_order(rows)

    def _scanned(self, node: BoundNode, known: Positions | None) -> Positions:
        if known is None:
            return self._view.columns.of_label(node.label)
        if node.label is None:
            return known
        return known[np.isin(known, self._view.columns.of_label(node.label))]


def _no_rows(nodes: Iterable[str], edges: Iterable[str]) -> Bindings:
    none = np.empty(0, np.int64)
    texts = np.empty(0, object)
    no_edge = EdgeColumn(
        source=none, target=none, confidence=np.empty(0), label=texts, origin=texts, explanation=texts, hops=texts
    )
    return Bindings(n=0, nodes=dict.fromkeys(nodes, none), edges=dict.fromkeys(edges, no_edge), truth=always(0))


def _in_order(rows: Bindings) -> Bindings:
    """The rows by their nodes, then by what their relations say.

    The engine gives rows in no order that can be relied on; the same question must give the same answer.
    """
    if rows.n < 2:
        return rows
    rows = rows.take(np.lexsort(list(rows.nodes.values())[::-1]))
    tied: Flags = np.ones(rows.n - 1, bool)
    for positions in rows.nodes.values():
        tied &= positions[1:] == positions[:-1]
    if not tied.any():
        return rows
    group = np.concatenate([[0], np.cumsum(~tied)]).tolist()
    edges = list(rows.edges.values())

    def said(row: int) -> tuple[object, ...]:
        texts = (str(text) for edge in edges for text in (edge.label[row], edge.origin[row], edge.explanation[row]))
        return (group[row], *texts, *(int(edge.source[row]) for edge in edges))

    # A relation of a node to itself, read either way, is met from both of its ends: the same row twice.
    distinct = {said(row): row for row in reversed(range(rows.n))}
    return rows.take(np.asarray([distinct[key] for key in sorted(distinct)], np.int64))


def _without_shared_edges(rows: Bindings, one: Mapping[str, object], other: Mapping[str, object]) -> Bindings:
    """The rows in which no relation stands for two edges; within a component its Cypher sees to that."""
    shared = np.zeros(rows.n, bool)
    for a in one:
        for b in other:
            left, right = rows.edges[a], rows.edges[b]
            same = (left.source == right.source) & (left.target == right.target)
            shared |= same & (left.label == right.label) & (left.origin == right.origin)
    return rows.take(np.flatnonzero(~shared)) if shared.any() else rows


def asked_of(query: BoundQuery) -> dict[str, list[ast.Expression]]:
    """{variable: the conditions that are about it alone}, which is what score(variable) is the degree of."""
    found: dict[str, list[ast.Expression]] = {}
    for condition in query.conditions:
        names = variables(condition)
        if len(names) == 1 and not names_score(condition):
            found.setdefault(next(iter(names)), []).append(condition)
    return found


def _texts(values: object) -> np.ndarray[tuple[int], np.dtype[np.object_]]:
    items = list(values)  # type: ignore[call-overload]
    column = np.empty(len(items), object)
    column[:] = items
    return column


def _lookup(table: Sequence[Positions], wanted: Sequence[Positions]) -> Positions:
    """For each wanted combination its row in a table of distinct combinations, or -1."""
    n = len(wanted[0])
    if not len(table[0]):
        return np.full(n, -1, np.int64)
    both = [np.concatenate([a, b]) for a, b in zip(table, wanted, strict=True)]
    codes = np.zeros(len(both[0]), np.int64)
    for column in both:
        _, inverse = np.unique(column, return_inverse=True)
        _, codes = np.unique(codes * (int(inverse.max()) + 1) + inverse, return_inverse=True)
    first, rest = codes[: len(table[0])], codes[len(table[0]) :]
    place = np.full(int(codes.max()) + 1, -1, np.int64)
    place[first] = np.arange(len(first))
    return place[rest]


def meanings_of(query: BoundQuery) -> tuple[Meaning, ...]:
    """All meanings that a statement compares with, edges' included."""
    edges = [edge for match in (query.match, *query.subpatterns.values()) for edge in match.edges]
    return (*query.meanings.values(), *(edge.meaning for edge in edges if edge.meaning is not None))
