"""The nearest points, against looking at all of them."""

from __future__ import annotations

import numpy as np
import pytest

from cgdb.errors import SceneError
from cgdb.ingest.evaluation.nearest import nearest


@pytest.mark.parametrize(("n", "m"), [(1, 1), (40, 7), (300, 33), (2000, 3000)])
@pytest.mark.parametrize("apart", [0.0, 6.0])
def test_the_tree_finds_what_looking_at_all_finds(n: int, m: int, apart: float) -> None:
    rng = np.random.default_rng(n + m)
    points = (rng.normal(size=(n, 3)) + apart).astype(np.float32)
    among = (rng.normal(size=(m, 3)) * [3, 1, 0.01]).astype(np.float32)
    distance, index = nearest(points, among)
    every = np.linalg.norm(points[:, None].astype(float) - among[None].astype(float), axis=2)
    np.testing.assert_allclose(distance, every.min(axis=1), rtol=1e-5, atol=1e-6)
    np.testing.assert_allclose(every[np.arange(n), index], every.min(axis=1), rtol=1e-5, atol=1e-6)


def test_the_grid_and_the_tree_agree_within_reach() -> None:
    rng = np.random.default_rng(3)
    among = rng.uniform(0, 1, (4000, 3)).astype(np.float32)
    points = rng.uniform(-0.2, 1.2, (3000, 3)).astype(np.float32)
    far, _ = nearest(points, among)
    distance, index = nearest(points, among, 0.06)
    inside = far <= 0.06
    assert 0.2 < inside.mean() < 0.9
    np.testing.assert_allclose(distance[inside], far[inside], atol=1e-6)
    assert np.isinf(distance[~inside]).all() and (index[~inside] == -1).all()


def test_copies_of_one_point_are_no_trouble() -> None:
    among = np.zeros((500, 3), np.float32)
    distance, index = nearest(np.ones((5, 3), np.float32), among)
    np.testing.assert_allclose(distance, np.sqrt(3), rtol=1e-6)
    assert ((index >= 0) & (index < 500)).all()


def test_nothing_is_far_from_everything() -> None:
    nothing, some = np.zeros((0, 3), np.float32), np.zeros((2, 3), np.float32)
    assert np.isinf(nearest(some, nothing)[0]).all() and len(nearest(nothing, some)[0]) == 0


def test_clouds_that_are_worlds_apart_are_refused_not_miscounted() -> None:
    with pytest.raises(SceneError, match="too far"):
        nearest(np.full((1, 3), 9e6, np.float32), np.zeros((1, 3), np.float32), 1e-3)


@pytest.mark.parametrize("reach", [1e-300, float("nan")])
def test_a_reach_without_cells_is_told(reach: float) -> None:
    with pytest.raises(SceneError, match="too far to be compared"):
        nearest(np.zeros((2, 3), np.float32), np.ones((2, 3), np.float32), reach)
