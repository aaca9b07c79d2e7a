"""Paths of several hops against all paths there are, tried one by one."""

from __future__ import annotations

import itertools
import math
from types import SimpleNamespace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import cgdb
from cgdb.database import Database
from cgdb.errors import LimitError
from cgdb.query.bindings import Bindings
from cgdb.query.bound import BoundEdge
from cgdb.query.limits import Budget, Limits
from cgdb.query.paths import follow
from cgdb.testing import store

Relation = tuple[int, int, float]
SIZE = 6

relations = st.lists(
    st.tuples(st.integers(0, SIZE - 1), st.integers(0, SIZE - 1), st.sampled_from([0.0, 0.25, 0.5, 0.8, 1.0])),
    max_size=14,
    unique_by=lambda r: r[:2],
)


class Scene:
    """As much of a scene as paths are followed in."""

    def __init__(self, edges: list[Relation]) -> None:
        sources, targets, confidences = zip(*edges, strict=True) if edges else ((), (), ())
        self.columns = SimpleNamespace(keys=np.arange(SIZE))
        self.relations = SimpleNamespace(
            source=np.asarray(sources, int), target=np.asarray(targets, int), confidence=np.asarray(confidences, float)
        )


def steps_of(edges: list[Relation], *, directed: bool) -> dict[tuple[int, int], float]:
    """{(from, to): the best confidence} as the edge may be walked."""
    steps: dict[tuple[int, int], float] = {}
    for a, b, c in edges:
        steps[a, b] = max(c, steps.get((a, b), 0.0))
        if not directed:
            steps[b, a] = max(c, steps.get((b, a), 0.0))
    return steps


def best_paths(edges: list[Relation], low: int, high: int, *, directed: bool) -> dict[tuple[int, int], float]:
    """{(start, end): the highest product}, by trying every sequence of different nodes."""
    steps = steps_of(edges, directed=directed)
    found: dict[tuple[int, int], float] = {}
    for hops in range(low, min(high, SIZE - 1) + 1):
        for way in itertools.permutations(range(SIZE), hops + 1):
            product = 1.0
            for step in itertools.pairwise(way):
                product *= steps.get(step, 0.0)
            if product > found.get((way[0], way[-1]), 0.0):
                found[way[0], way[-1]] = product
    return found


@given(edges=relations, low=st.integers(1, 4), more=st.integers(0, 3), directed=st.booleans(), known=st.booleans())
@settings(max_examples=300, deadline=None)
def test_the_best_path_of_each_pair(edges: list[Relation], low: int, more: int, directed: bool, known: bool) -> None:
    everyone = np.arange(SIZE)
    rows = Bindings.of_nodes("a", everyone)
    if known:
        rows = rows.cross(Bindings.of_nodes("b", everyone))
    edge = BoundEdge(name="p", named=True, source="a", target="b", directed=directed, min_hops=low, max_hops=low + more)
    found = follow(Scene(edges), edge, rows, everyone, Budget())  # type: ignore[arg-type]
    path = found.edges["p"]
    pairs = list(zip(found.nodes["a"].tolist(), found.nodes["b"].tolist(), strict=True))
    assert len(set(pairs)) == len(pairs)
    assert dict(zip(pairs, path.confidence.tolist(), strict=True)) == pytest.approx(
        best_paths(edges, low, low + more, directed=directed)
    )
    assert path.hops is not None
    for (start, end), way, confidence in zip(pairs, path.hops, path.confidence, strict=True):
        assert (way[0], way[-1]) == (start, end) and low <= len(way) - 1 <= low + more and len(set(way)) == len(way)
        steps = steps_of(edges, directed=directed)
        assert confidence == pytest.approx(math.prod(steps[step] for step in itertools.pairwise(way)))


def test_a_path_that_is_followed_backwards_is_told_forwards() -> None:
    edge = BoundEdge(name="p", named=True, source="a", target="b", min_hops=2, max_hops=3)
    rows = Bindings.of_nodes("b", np.asarray([3]))
    edges = [(0, 1, 1.0), (1, 2, 1.0), (2, 3, 0.5), (3, 2, 1.0), (1, 3, 0.2)]
    found = follow(Scene(edges), edge, rows, np.arange(SIZE), Budget())  # type: ignore[arg-type]
    path = found.edges["p"]
    assert path.hops is not None
    told = dict(zip(found.nodes["a"].tolist(), path.hops.tolist(), strict=True))
    assert told == {0: (0, 1, 2, 3), 1: (1, 2, 3)}


def test_too_many_paths_are_an_error_not_a_wait() -> None:
    everyone = [(a, b, 1.0) for a in range(1, 31) for b in range(1, 31) if a != b]
    graph = cgdb.SceneGraph(
        name="dense",
        objects=tuple(cgdb.SceneObject(id=number) for number in range(1, 31)),
        relations=(
            *(cgdb.Relation(source=a, target=b, label="near", confidence=c) for a, b, c in everyone),
            cgdb.Relation(source=1, target=2, label="on"),
            cgdb.Relation(source=2, target=3, label="on"),
        ),
    )
    with store(graph) as db:
        assert count(db, "MATCH (#1)-[:near*1..10]->(b) RETURN count(b)") == 29
        assert count(db, "MATCH (#1)-[:near*3]->(b) RETURN count(b)") == 29
        with pytest.raises(LimitError, match="combinations"):
            db.query("MATCH (#1)-[:near|on*9]->(b) RETURN b", limits=Limits(rows=100_000))


def count(db: Database, text: str) -> object:
    return db.query(text)[0][0]
