"""Paths of several hops: for each pair of ends the best one, its confidence the product of its relations'."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from cgdb.binder import BoundEdge
from cgdb.bindings import Bindings, EdgeColumn, Positions
from cgdb.limits import Budget

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
    """The best path per pair: pairs (p,) ascending, each start * n + end; its product and hops; layers to walk back."""

    n: int
    pairs: Positions
    products: NDArray[np.float64]
    hops: Positions
    layers: list[tuple[Positions, Positions]]


def _best_paths(
    view: SceneView, edge: BoundEdge, starts: Positions, ends: Positions, backwards: bool, budget: Budget
) -> _Paths:
    """One relaxation per hop (Bellman 1958) over all starts at once.

    Each keeps for a pair the best product over exactly that many hops, so that the work is bounded by pairs, however
    many ways there are between them.
    """
    source, target, confidence = view.edges(edge.labels)
    if backwards:
        source, target = target, source
    if not edge.directed:
        source, target = np.concatenate([source, target]), np.concatenate([target, source])
        confidence = np.concatenate([confidence, confidence])
    by_source = np.argsort(source, kind="stable")
    source, target, confidence = source[by_source], target[by_source], confidence[by_source]
    n = len(view.columns.keys)
    wanted = np.zeros(n, bool)
    wanted[ends] = True

    pair, product = starts * n + starts, np.ones(len(starts))
    layers: list[tuple[Positions, Positions]] = []
    found: list[tuple[Positions, NDArray[np.float64], Positions]] = []
    for hop in range(1, edge.max_hops + 1):
        budget.check()
        at = pair % n
        low, high = np.searchsorted(source, at, "left"), np.searchsorted(source, at, "right")
        counts = high - low
        budget.check_rows(int(counts.sum()))
        which = np.repeat(np.arange(len(pair)), counts)
        taken = np.repeat(low, counts) + _ranges(counts)
        new_pair = (pair // n)[which] * n + target[taken]
        new_product = product[which] * confidence[taken]
        chosen = _first_of_each(new_pair, np.lexsort((pair[which], -new_product, new_pair)))
        layers.append((new_pair[chosen], pair[which][chosen]))
        pair, product = new_pair[chosen], new_product[chosen]
        if not len(pair):
            break
        if hop >= edge.min_hops:
            # A way back to its own start is no path to a neighbour.
            useful = wanted[pair % n] & (pair // n != pair % n)
            found.append((pair[useful], product[useful], np.full(int(useful.sum()), hop)))
    pairs = np.concatenate([item[0] for item in found]) if found else np.empty(0, np.int64)
    products = np.concatenate([item[1] for item in found]) if found else np.empty(0)
    hops = np.concatenate([item[2] for item in found]) if found else np.empty(0, np.int64)
    # The highest product, and of equal ones the shortest.
    chosen = _first_of_each(pairs, np.lexsort((hops, -products, pairs)))
    return _Paths(n=n, pairs=pairs[chosen], products=products[chosen], hops=hops[chosen], layers=layers)


def _ways(paths: _Paths, place: Positions, backwards: bool) -> NDArray[np.object_]:
    """For each place among the paths, the positions that it goes through, from the edge's source to its target."""
    made: dict[int, tuple[int, ...]] = {}
    ways = np.empty(len(place), object)
    for row, at in enumerate(place.tolist()):
        if at not in made:
            pair = int(paths.pairs[at])
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
