"""Paths of several hops: for each pair of ends the best one, its confidence the product of its relations'.

A path goes through nothing twice.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from cgdb.index.positions import EdgeColumn, Flags, Positions
from cgdb.query.bindings import Bindings
from cgdb.query.bound import BoundEdge
from cgdb.query.limits import Budget

if TYPE_CHECKING:
    from cgdb.view import SceneView


def follow(view: SceneView, edge: BoundEdge, rows: Bindings, ends: Positions, budget: Budget) -> Bindings:
    """The rows joined with the best path from one end of the edge to the other.

    An end that the rows do not hold yet is added to them; ``ends`` are the positions that it may have.
    """
    backwards = edge.source not in rows.nodes
    here, there = (edge.target, edge.source) if backwards else (edge.source, edge.target)
    bound = there in rows.nodes
    paths = _best_paths(
        view, edge, np.unique(rows.nodes[here]), rows.nodes[there] if bound else ends, backwards, budget
    )
    if bound:
        wanted = rows.nodes[here] * paths.n + rows.nodes[there]
        place = np.searchsorted(paths.pairs, wanted)
        known = np.zeros(rows.n, bool)
        inside = place < len(paths.pairs)
        known[inside] = paths.pairs[place[inside]] == wanted[inside]
        kept, place = np.flatnonzero(known), place[known]
        joined = rows.take(kept)
    else:
        low = np.searchsorted(paths.pairs, rows.nodes[here] * paths.n)
        high = np.searchsorted(paths.pairs, (rows.nodes[here] + 1) * paths.n)
        counts = high - low
        budget.check_rows(int(counts.sum()))
        place = np.repeat(low, counts) + _ranges(counts)
        joined = rows.take(np.repeat(np.arange(rows.n), counts))
    nodes = {**joined.nodes, there: paths.pairs[place] % paths.n}
    ways = _ways(paths, place, backwards)
    nothing = np.full(joined.n, None, object)
    column = EdgeColumn(
        source=nodes[edge.source],
        target=nodes[edge.target],
        confidence=paths.products[place],
        label=nothing,
        origin=nothing,
        explanation=nothing,
        hops=ways,
    )
    return Bindings(n=joined.n, nodes=nodes, edges={**joined.edges, edge.name: column}, truth=joined.truth)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class _Paths:
    """The best path per pair: pairs (p,) ascending, each start * n + end; its product and hops; layers to walk back.

    told: the positions from start to end of those paths that the layers do not tell.
    """

    n: int
    pairs: Positions
    products: NDArray[np.float64]
    hops: Positions
    layers: list[tuple[Positions, Positions]]
    told: Mapping[int, tuple[int, ...]] = field(default_factory=dict)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class _Steps:
    """Where one relation leads, as the edge may be walked: source (r,) ascending, target, the best confidence."""

    source: Positions
    target: Positions
    confidence: NDArray[np.float64]

    def after(self, at: Positions, budget: Budget) -> tuple[Positions, Positions]:
        """For every step from each of these positions: which of them it is from, and which step."""
        low, high = np.searchsorted(self.source, at, "left"), np.searchsorted(self.source, at, "right")
        counts = high - low
        budget.check_rows(int(counts.sum()))
        return np.repeat(np.arange(len(at)), counts), np.repeat(low, counts) + _ranges(counts)


def _best_paths(
    view: SceneView, edge: BoundEdge, starts: Positions, ends: Positions, backwards: bool, budget: Budget
) -> _Paths:
    """One relaxation per hop (Bellman 1958) over all starts at once.

    Each keeps for a pair the best product over exactly that many hops, so that the work is bounded by pairs, however
    many ways there are between them. With a least number of hops the best way may go in a circle to become longer;
    only for pairs where it does, paths are tried one by one.
    """
    steps = _steps(view, edge, backwards)
    n = len(view.columns.keys)
    wanted = np.zeros(n, bool)
    wanted[ends] = True

    pair, product = starts * n + starts, np.ones(len(starts))
    layers: list[tuple[Positions, Positions]] = []
    found: list[tuple[Positions, NDArray[np.float64], Positions]] = []
    for hop in range(1, edge.max_hops + 1):
        budget.check()
        which, taken = steps.after(pair % n, budget)
        new_pair = (pair // n)[which] * n + steps.target[taken]
        new_product = product[which] * steps.confidence[taken]
        order = np.lexsort((pair[which], -new_product, new_pair))
        # A way back to its own start is no path, nor the beginning of one.
        order = order[(new_pair // n != new_pair % n)[order]]
        chosen = _first_of_each(new_pair, order)
        layers.append((new_pair[chosen], pair[which][chosen]))
        pair, product = new_pair[chosen], new_product[chosen]
        if not len(pair):
            break
        if hop >= edge.min_hops:
            useful = wanted[pair % n]
            found.append((pair[useful], product[useful], np.full(int(useful.sum()), hop)))
    pairs = np.concatenate([item[0] for item in found]) if found else np.empty(0, np.int64)
    products = np.concatenate([item[1] for item in found]) if found else np.empty(0)
    hops = np.concatenate([item[2] for item in found]) if found else np.empty(0, np.int64)
    # The highest product, and of equal ones the shortest.
    chosen = _first_of_each(pairs, np.lexsort((hops, -products, pairs)))
    paths = _Paths(n=n, pairs=pairs[chosen], products=products[chosen], hops=hops[chosen], layers=layers)
    circles = _circles(paths) if edge.min_hops > 1 else np.zeros(len(paths.pairs), bool)
    return _without_circles(paths, circles, steps, edge, budget) if circles.any() else paths


def _steps(view: SceneView, edge: BoundEdge, backwards: bool) -> _Steps:
    relations = view.relations
    source, target, confidence = relations.source, relations.target, relations.confidence
    if edge.labels:
        wanted = np.isin(relations.label, relations.codes(edge.labels))
        source, target, confidence = source[wanted], target[wanted], confidence[wanted]
    if backwards:
        source, target = target, source
    if not edge.directed:
        source, target = np.concatenate([source, target]), np.concatenate([target, source])
        confidence = np.concatenate([confidence, confidence])
    order = np.lexsort((-confidence, target, source))
    order = order[(source != target)[order] & (confidence > 0.0)[order]]
    best = _first_of_each(source * (len(view.columns.keys) + 1) + target, order)
    return _Steps(source=source[best], target=target[best], confidence=confidence[best])


def _circles(paths: _Paths) -> Flags:
    """(p,) whether a way goes through something twice."""
    found = np.zeros(len(paths.pairs), bool)
    for hops in np.unique(paths.hops).tolist():
        rows = np.flatnonzero(paths.hops == hops)
        pair = paths.pairs[rows]
        way = [pair % paths.n]
        for pairs, previous in reversed(paths.layers[:hops]):
            pair = previous[np.searchsorted(pairs, pair)]
            way.append(pair % paths.n)
        ordered = np.sort(np.stack(way), axis=0)
        found[rows] = (ordered[1:] == ordered[:-1]).any(axis=0)
    return found


def _without_circles(paths: _Paths, circles: Flags, steps: _Steps, edge: BoundEdge, budget: Budget) -> _Paths:
    """The paths with those that go in a circle replaced by the best that do not, or gone."""
    n, wanted = paths.n, paths.pairs[circles]
    starts, first = np.unique(wanted // n, return_index=True)
    best = np.zeros(len(wanted))
    told: dict[int, tuple[int, ...]] = {}
    way, product = starts.astype(np.int32)[:, None], np.ones(len(starts))
    for hop in range(1, edge.max_hops + 1):
        budget.check()
        which, taken = steps.after(way[:, -1].astype(np.int64), budget)
        to = steps.target[taken].astype(np.int32)
        further = product[which] * steps.confidence[taken]
        # Once a start has a path to each of its ends, what is no better than the worst of them need not go on.
        line = np.minimum.reduceat(best, first)[np.searchsorted(starts, way[:, 0])]
        fresh = np.flatnonzero((further > line[which]) & (way[which] != to[:, None]).all(axis=1))
        way, product = np.column_stack((way[which[fresh]], to[fresh])), further[fresh]
        if not len(way):
            break
        if hop < edge.min_hops:
            continue
        pair = way[:, 0].astype(np.int64) * n + way[:, -1]
        place = np.minimum(np.searchsorted(wanted, pair), len(wanted) - 1)
        better = np.flatnonzero((wanted[place] == pair) & (product > best[place]))
        chosen = better[_first_of_each(pair[better], np.lexsort((-product[better], pair[better])))]
        best[place[chosen]] = product[chosen]
        told.update((int(pair[row]), tuple(way[row].tolist())) for row in chosen.tolist())
    products, hops = paths.products.copy(), paths.hops.copy()
    products[circles] = best
    hops[circles] = [len(told.get(pair, ())) - 1 for pair in wanted.tolist()]
    kept = products > 0.0
    return replace(paths, pairs=paths.pairs[kept], products=products[kept], hops=hops[kept], told=told)


def _ways(paths: _Paths, place: Positions, backwards: bool) -> NDArray[np.object_]:
    """For each place among the paths, the positions that it goes through, from the edge's source to its target."""
    made: dict[int, tuple[int, ...]] = {}
    ways = np.empty(len(place), object)
    for row, at in enumerate(place.tolist()):
        if at not in made:
            pair = int(paths.pairs[at])
            if pair in paths.told:
                made[at] = paths.told[pair][::-1] if backwards else paths.told[pair]
            else:
                way = [pair % paths.n]
                for pairs, previous in reversed(paths.layers[: int(paths.hops[at])]):
                    pair = int(previous[np.searchsorted(pairs, pair)])
                    way.append(pair % paths.n)
                made[at] = tuple(way) if backwards else tuple(reversed(way))
        ways[row] = made[at]
    return ways


def _ranges(counts: Positions) -> Positions:
    """0..c-1 for each count, one after the other."""
    return np.arange(int(counts.sum())) - np.repeat(np.cumsum(counts) - counts, counts)


def _first_of_each(values: Positions, order: Positions) -> Positions:
    """Of indices that are ordered by value, the first of each value."""
    first = np.ones(len(order), bool)
    first[1:] = values[order][1:] != values[order][:-1]
    return order[first]
