"""The score of a map's objects, on rooms of which everything is known."""

from __future__ import annotations

import tracemalloc

import numpy as np
import pytest
from numpy.typing import NDArray

from cgdb.errors import FormatError
from cgdb.ingest.evaluation.box_overlap import overlaps
from cgdb.ingest.evaluation.labelled import LabelledCloud
from cgdb.ingest.evaluation.mapping import Truth, evaluate, truth_of
from cgdb.ingest.relations.boxes import Boxes
from cgdb.scene import SceneGraph, SceneObject


def block(at: float, step: float = 0.05) -> np.ndarray:
    """The points of a grid in a cube of 0.2 m whose low corner is at (at, 0, 0)."""
    axis = np.arange(5) * step
    return np.stack(np.meshgrid(at + axis, axis, axis), axis=3).reshape(-1, 3).astype(np.float32)


def truth() -> Truth:
    """A chair at 0, a table at 1, a lamp at 2 that was hardly seen, a wall at 3."""
    return Truth(
        points=np.concatenate([block(at) for at in range(4)]),
        owner=np.repeat(np.arange(4), 125),
        things=np.array([True, True, True, False]),
        frames=np.array([9, 9, 1, 9]),
        names=("chair", "table", "lamp", "wall"),
        ids=(10, 11, 12, 13),
    )


def scene(*objects: SceneObject) -> SceneGraph:
    return SceneGraph(name="s", objects=objects)


def obj(number: int, points: np.ndarray, tag: str | None = None, **more: object) -> SceneObject:
    return SceneObject(id=number, points=points, tag=tag, **more)  # type: ignore[arg-type]


def test_a_perfect_map() -> None:
    found = evaluate(scene(obj(1, block(0), "a chair"), obj(2, block(1), "Table")), truth())
    assert (found.true, found.found, found.missed, found.duplicates, found.mapped) == (2, 2, 0, 0, 2)
    assert (found.purity, found.completeness, found.association, found.labels) == (1, 1, 1, 1)
    assert found.box_iou == pytest.approx(1) and found.strangers == ()
    assert [(o.id, o.name, o.shown_by) for o in found.objects] == [(10, "chair", (1,)), (11, "table", (2,))]


def test_missed_duplicated_misnamed_and_strange() -> None:
    half = block(0)[block(0)[:, 0] < 0.09]  # 2 of 5 layers
    rest = block(0)[block(0)[:, 0] > 0.09]
    wall, air = block(3), block(0) + np.array([0, 5, 0], np.float32)
    found = evaluate(
        scene(
            obj(1, half, "stool"),
            obj(2, rest, "seat"),
            obj(3, wall),
            obj(4, air),
            obj(5, wall, properties={"background": True}),
        ),
        truth(),
    )
    assert (found.true, found.found, found.missed, found.duplicates, found.mapped) == (2, 1, 1, 1, 4)
    assert found.strangers == (3, 4)
    chair, table = found.objects
    assert chair.shown_by == (2, 1) and chair.tag == "seat" and chair.named is False and chair.completeness == 1
    assert chair.box_iou == pytest.approx(0.5)  # 0.1 of 0.2 m, the other sides the same
    assert table.shown_by == () and table.purity is None
    assert found.association == pytest.approx(75 / 125)  # the match holds 3 of 5 layers
    assert found.purity == pytest.approx((1 + 1 + 1 + 0) / 4) and found.worst_purity == 0


def test_points_of_others_cost_purity_and_association() -> None:
    mixed = np.concatenate([block(0), block(1)[:25]])
    found = evaluate(scene(obj(1, mixed), obj(2, block(1)[25:])), truth())
    assert (found.found, found.duplicates) == (2, 0)
    assert found.objects[0].purity == pytest.approx(125 / 150)
    assert found.association == pytest.approx((125 + 100) / 250)
    assert found.labels is None


def test_completeness_is_of_the_surface_that_was_seen() -> None:
    half = block(0)[block(0)[:, 0] < 0.04]
    found = evaluate(scene(obj(1, half)), truth(), near=0.051)
    assert found.objects[0].completeness == pytest.approx(2 / 5)  # the layer itself and the one 5 cm on


def test_an_empty_map_and_an_empty_truth() -> None:
    found = evaluate(scene(), truth())
    assert (found.found, found.missed, found.mapped, found.purity, found.completeness) == (0, 2, 0, 0, 0)
    nothing = Truth(
        points=np.zeros((0, 3), np.float32),
        owner=np.zeros(0, np.intp),
        things=np.zeros(0, bool),
        frames=np.zeros(0, np.intp),
    )
    found = evaluate(scene(obj(1, block(0))), nothing)
    assert (found.true, found.found, found.duplicates, found.strangers) == (0, 0, 0, (1,))


def test_hardly_seen_objects_can_be_asked_for() -> None:
    assert evaluate(scene(), truth(), least_seen=1).missed == 3


def test_walls_are_told_by_their_names() -> None:
    cloud = LabelledCloud(
        points=np.zeros((2, 3), np.float32),
        labels=np.array([0, 1]),
        names=("Wall", "chair"),
        owner=np.array([0, 1]),
        ids=(5, 6),
        kinds=np.array([0, 1]),
    )
    assert truth_of(cloud).things.tolist() == [False, True]
    with pytest.raises(FormatError, match="but not the object"):
        truth_of(LabelledCloud(points=cloud.points, labels=cloud.labels, names=cloud.names), "x.npz")


def box_iou(boxes: Boxes, others: Boxes, up: str) -> NDArray[np.float64]:
    """Of each with each."""
    found = overlaps(boxes, others, up)
    table = np.zeros((len(boxes.centers), len(others.centers)))
    table[found.first, found.second] = found.iou
    return table


def test_overlap_of_boxes_by_hand() -> None:
    def boxes(*rows: tuple[tuple[float, ...], tuple[float, ...]], turned: float = 0.0) -> Boxes:
        c, s = np.cos(turned), np.sin(turned)
        return Boxes(
            centers=np.array([row[0] for row in rows], float),
            extents=np.array([row[1] for row in rows], float),
            rotations=np.array([[[c, -s, 0], [s, c, 0], [0, 0, 1]]] * len(rows)) if turned else None,
        )

    one = boxes(((0, 0, 0), (2, 2, 2)))
    others = boxes(((1, 0, 0), (2, 2, 2)), ((0, 0, 1.5), (2, 2, 1)), ((5, 0, 0), (2, 2, 2)), ((0, 0, 0), (1, 1, 1)))
    # 1*2*2 of 16-4; touching faces; apart; within: 1 of 8
    np.testing.assert_allclose(box_iou(one, others, "z"), [[4 / 12, 0, 0, 1 / 8]], atol=1e-9)
    # A unit square turned by 45 degrees in one of side 2 lies within it; the octagon of two equal squares so turned
    # has area 8 (sqrt 2 - 1).
    common = 8 * (np.sqrt(2) - 1)
    eighth = boxes(((0, 0, 0), (2, 2, 2)), turned=np.pi / 4)
    np.testing.assert_allclose(box_iou(one, eighth, "z"), [[common * 2 / (16 - common * 2)]], rtol=1e-6)
    point = Boxes(centers=np.zeros((1, 3)), extents=np.full((1, 3), np.nan))
    assert box_iou(one, point, "z").tolist() == [[0.0]]


def test_overlap_of_tilted_boxes_is_that_of_the_same_two_set_upright() -> None:
    rng = np.random.default_rng(3)
    n = 60
    angle = rng.uniform(0, 2 * np.pi, n)
    turns = np.zeros((n, 3, 3))
    turns[:, 0, 0] = turns[:, 1, 1] = np.cos(angle)
    turns[:, 1, 0], turns[:, 0, 1], turns[:, 2, 2] = np.sin(angle), -np.sin(angle), 1.0
    centers, extents = rng.uniform(0, 3, (n, 3)), rng.uniform(0.0, 1.5, (n, 3))
    tilt = np.linalg.qr(rng.normal(size=(3, 3)))[0]
    upright = Boxes(centers=centers, extents=extents, rotations=turns)
    tilted = Boxes(centers=centers @ tilt.T, extents=extents, rotations=tilt @ turns)
    expected = box_iou(upright, upright, "z")
    assert (expected > 0).sum() > 3 * n
    np.testing.assert_allclose(np.diagonal(expected), 1.0)
    np.testing.assert_allclose(box_iou(tilted, tilted, "-y"), expected, atol=1e-6)


def test_many_boxes_are_compared_where_they_meet_only() -> None:
    n = 3000
    place = np.stack([np.arange(n) % 60, np.arange(n) // 60, np.zeros(n)], axis=1).astype(float)
    boxes = Boxes(centers=place, extents=np.ones((n, 3)))
    shifted = Boxes(centers=place + np.array([0.5, 0.0, 0.0]), extents=np.ones((n, 3)))
    tracemalloc.start()
    found = overlaps(boxes, shifted, "z")
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    # Each half covers the one at its place and, but in the last column, the next one: 1 / 3 of what both fill.
    assert len(found.iou) == 2 * n - n // 60
    np.testing.assert_allclose(found.iou, 1 / 3)
    assert peak < n * n * 4
