"""Pairs of near boxes: the grid finds all that trying every pair finds, and statements use it."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import cgdb
from cgdb.errors import LimitError
from cgdb.geometry import Boxes
from cgdb.query.limits import Budget, Limits
from cgdb.query.near import near_pairs
from cgdb.testing import store


def boxes(seed: int, n: int, spread: float, largest: float) -> Boxes:
    rng = np.random.default_rng(seed)
    extents = rng.uniform(0, largest, (n, 3))
    extents[rng.random(n) < 0.2] = np.nan
    centers = rng.normal(size=(n, 3)) * spread
    centers[rng.random(n) < 0.1] = np.nan
    turned = np.linalg.qr(rng.normal(size=(n, 3, 3)))[0]
    return Boxes(centers=centers, extents=extents, rotations=turned)


@settings(max_examples=60, deadline=None)
@given(
    st.integers(0, 10**6),
    st.integers(1, 60),
    st.sampled_from([0.5, 5, 50]),
    st.sampled_from([0.1, 2, 40]),
    st.floats(0, 5),
)
def test_no_near_pair_is_missed(seed: int, n: int, spread: float, largest: float, metres: float) -> None:
    made = boxes(seed, n, spread, largest)
    one, other = np.arange(0, n, 2), np.arange(n)
    a, b = near_pairs(made, one, other, metres, Budget())
    with np.errstate(invalid="ignore"):
        half = made.half_hulls
        gap = np.abs(made.centers[one][:, None] - made.centers[other]) - half[one][:, None] - half[other]
        near = np.sqrt((np.maximum(gap, 0) ** 2).sum(axis=2)) <= metres
    expected = {(int(one[i]), int(other[j])) for i, j in np.argwhere(near)}
    got = list(zip(a.tolist(), b.tolist(), strict=True))
    assert len(got) == len(set(got))
    assert expected <= set(got)
    assert len(set(got) - expected) <= 2  # on the very border, by rounding


def grid(side: int) -> cgdb.SceneGraph:
    """side x side things, a metre apart."""
    return cgdb.SceneGraph(
        name="grid",
        objects=tuple(
            cgdb.SceneObject(id=i, center=np.array([i % side, i // side, 0.0]), extent=np.full(3, 0.2))
            for i in range(side * side)
        ),
    )


def test_a_distance_between_two_variables_is_a_join_of_near_pairs() -> None:
    with store(grid(70)) as db:  # 4,900 things: all pairs would be 24 million
        text = "MATCH (a), (b) WHERE distance(a, b) < 90 cm AND a <> b RETURN count(*)"
        assert db.query(text)[0][0] == 2 * 2 * 70 * 69
        assert "near:" in db.query("EXPLAIN " + text).plan
        centers = "MATCH (a), (b) WHERE distance(a, b, 'centers') <= 1 m AND a.id < b.id RETURN count(*)"
        assert db.query(centers)[0][0] == 2 * 70 * 69


def test_the_same_rows_as_by_all_pairs() -> None:
    with store(grid(9)) as db:
        near = db.query(
            "MATCH (a), (b), (c) WHERE distance(a, b) < 0.9 AND 0.9 > distance(c, a) RETURN a.id, b.id, c.id"
        )
        # A sum hides the distance from the planner: all triples are tried.
        tried = db.query(
            "MATCH (a), (b), (c) WHERE distance(a, b) + 0 < 0.9 AND 0.9 > distance(c, a) + 0 RETURN a.id, b.id, c.id"
        )
        assert [row.values for row in near] == [row.values for row in tried]
        assert len(near) > 0


def test_the_limit_still_holds() -> None:
    with store(grid(20)) as db, pytest.raises(LimitError):
        db.query("MATCH (a), (b) WHERE distance(a, b) < 1 km RETURN count(*)", limits=Limits(rows=10_000))


def test_the_nearest_pair_of_many_needs_only_what_fits() -> None:
    degrees = {"lamp": dict.fromkeys(range(0, 4900, 100), 0.9), "door": {4899: 0.8}, "ghost": {5: 0.4, 6: 0.3}}
    with store(grid(70), degrees=degrees) as db:
        text = 'MATCH (o ~ "lamp"), (a ~ "door") RETURN o.id, distance(o, a) AS d ORDER BY d LIMIT 2'
        by_distance = sorted(range(0, 4900, 100), key=lambda i: (i % 70 - 69) ** 2 + (i // 70 - 69) ** 2)
        assert [row.values[0] for row in db.query(text)] == by_distance[:2]
        assert "first: only o" in db.query("EXPLAIN " + text).plan
        assert db.query('MATCH (o ~ "lamp"), (a ~ "door") RETURN count(*)')[0][0] == 49
        # Where nothing fits, the nearest are shown all the same.
        assert [row.values[0] for row in db.query('MATCH (o ~ "ghost") RETURN o.id ORDER BY o.id DESC LIMIT 2')] == [
            5,
            6,
        ]
