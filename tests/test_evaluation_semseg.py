"""The segmentation protocol, on cases small enough to be done by hand."""

from __future__ import annotations

import numpy as np
import pytest

from cgdb.errors import SceneError, UsageError
from cgdb.ingest.evaluation.labelled import LabelledCloud
from cgdb.ingest.evaluation.semseg import (
    Confusion,
    classes_by_feature,
    classes_by_tag,
    confusion,
    left_out,
    score,
    scored_objects,
    summed,
)
from cgdb.scene import SceneObject

NAMES = ("chair", "table", "lamp", "wall")


def on_a_line(*at: float) -> np.ndarray:
    """Points along x, metres."""
    return np.array([[x, 0, 0] for x in at], np.float32)


def thing(number: int, at: tuple[float, ...], feature: tuple[float, ...] | None = None, **more: object) -> SceneObject:
    features = {} if feature is None else {"clip": np.array(feature, np.float32)}
    return SceneObject(id=number, points=on_a_line(*at), features=features, **more)  # type: ignore[arg-type]


def truth_of(labels: list[int], names: tuple[str, ...] = NAMES) -> LabelledCloud:
    """One true point per metre."""
    return LabelledCloud(points=on_a_line(*range(len(labels))), labels=np.array(labels), names=names)


def test_figures_by_hand() -> None:
    # true\given   a  b  c  none      recall      col      IoU
    #   a (6)      4  1  0   1        4/6         4+2+0=6  4/(6+6-4) = 4/8
    #   b (4)      2  2  0   0        2/4         1+2+1=4  2/(4+4-2) = 2/6
    #   c (2)      0  1  1   0        1/2         1        1/(2+1-1) = 1/2
    counts = np.array([[4, 1, 0, 1], [2, 2, 0, 0], [0, 1, 1, 0]])
    found = score(Confusion(names=("a", "b", "c"), counts=counts))
    assert found.macc == pytest.approx((4 / 6 + 2 / 4 + 1 / 2) / 3)
    assert found.miou == pytest.approx((4 / 8 + 2 / 6 + 1 / 2) / 3)
    assert found.fmiou == pytest.approx((6 * 4 / 8 + 4 * 2 / 6 + 2 * 1 / 2) / 12)
    assert found.precision == pytest.approx((4 / 6 + 2 / 4 + 1 / 1) / 3)
    # F1 = 2 p r / (p + r): a 2*4/(6+6), b 2*2/(4+4), c 2*1/(2+1)
    assert found.f1 == pytest.approx((8 / 12 + 4 / 8 + 2 / 3) / 3)
    assert found.unlabelled == pytest.approx(1 / 12)
    assert found.above == {0.15: 3, 0.25: 3, 0.5: 0, 0.75: 0}
    assert [(c.name, c.points, c.predicted) for c in found.classes] == [("a", 6, 6), ("b", 4, 4), ("c", 2, 1)]


def test_f1_of_a_bad_class_is_not_flattened() -> None:
    # p = r = 1/10: F1 is 1/10. Dividing by max(1, p + r) would make it 2/100.
    counts = np.array([[1, 9, 0], [9, 81, 0]])
    assert score(Confusion(names=("a", "b"), counts=counts)).classes[0].f1 == pytest.approx(0.1)


def test_a_class_without_true_points_is_not_scored_but_what_is_taken_for_it_is_wrong() -> None:
    found = score(Confusion(names=("a", "b"), counts=np.array([[3, 1, 0], [0, 0, 0]])))
    assert [c.name for c in found.classes] == ["a"]
    assert found.macc == pytest.approx(0.75) and found.fmiou == pytest.approx(0.75)


def test_nothing_at_all_is_no_division_by_zero() -> None:
    found = score(Confusion(names=("a",), counts=np.zeros((1, 2), np.int64)))
    assert (found.macc, found.fmiou, found.points, found.classes) == (0.0, 0.0, 0, ())


def test_scenes_are_summed_before_they_are_scored() -> None:
    # Scene 1: a 1 of 1, b 0 of 3 (taken for a). Scene 2, whose classes are numbered otherwise: b 6 of 6.
    one = Confusion(names=("a", "b"), counts=np.array([[1, 0, 0], [3, 0, 0]]))
    two = Confusion(names=("b", "a"), counts=np.array([[6, 0, 0], [0, 0, 0]]))
    both = score(summed([one, two]))
    assert both.macc == pytest.approx((1 / 1 + 6 / 9) / 2)
    # IoU a 1/(1+4-1), b 6/(9+6-6); weighted by 1 and 9 points
    assert both.fmiou == pytest.approx((1 * 1 / 4 + 9 * 6 / 9) / 10)


def test_points_take_the_class_of_their_nearest_object() -> None:
    # True points at 0..5: chair chair chair table table lamp. Objects at 0.1 (chair) and 4.2 (table):
    # 0, 1, 2 are nearer to the first, 3, 4, 5 to the second.
    truth = truth_of([0, 0, 0, 1, 1, 2])
    objects = [thing(1, (0.1,)), thing(2, (4.2,))]
    found = confusion(objects, np.array([0, 1]), truth, np.ones(4, bool))
    assert found.counts.tolist() == [[3, 0, 0, 0, 0], [0, 2, 0, 0, 0], [0, 1, 0, 0, 0], [0, 0, 0, 0, 0]]


def test_classes_left_out_are_not_looked_at_and_the_far_is_none() -> None:
    truth = truth_of([0, 3, 3, 1])
    scored = ~left_out("4", NAMES)
    assert scored.tolist() == [True, True, True, False]
    found = confusion([thing(1, (0.0,))], np.array([0]), truth, scored, within=1.5)
    assert found.counts.tolist() == [[1, 0, 0, 0, 0], [0, 0, 0, 0, 1], [0, 0, 0, 0, 0], [0, 0, 0, 0, 0]]


def test_a_cloud_of_its_own_is_labelled_and_held_against_the_nearest_true_point() -> None:
    # Cloud points at 0.2 (true chair, object chair), 0.9 (true table, object chair), 7 (beyond both).
    truth = truth_of([0, 1])
    objects = [thing(1, (0.0, 0.8)), thing(2, (1.4,))]
    cloud = on_a_line(0.2, 0.9, 7.0)
    found = confusion(objects, np.array([0, 1]), truth, np.ones(4, bool), cloud=cloud)
    assert found.counts[:2, :2].tolist() == [[1, 0], [1, 1]]
    near = confusion(objects, np.array([0, 1]), truth, np.ones(4, bool), cloud=cloud, within=0.5)
    assert near.counts[:2, :2].tolist() == [[1, 0], [1, 0]] and near.counts.sum() == 2


def test_an_object_is_of_the_class_whose_text_is_nearest_among_those_allowed() -> None:
    vectors = np.array([[2, 0, 0], [0, 1, 0], [0, 0, 5], [1, 1, 0]], np.float32)
    objects = [thing(1, (0,), (0.9, 0.1, 0)), thing(2, (0,), (3, 3, 0.1)), thing(3, (0,), (0, 0, 1)), thing(4, (0,))]
    # Cosines of object 2 with the four: .707, .707, .02, .9997; it is a wall unless that is not allowed.
    assert classes_by_feature(objects, "clip", vectors, np.ones(4, bool)).tolist() == [0, 3, 2, -1]
    allowed = np.array([False, True, True, False])
    assert classes_by_feature(objects, "clip", vectors, allowed).tolist() == [1, 1, 2, -1]
    with pytest.raises(SceneError, match="3 dimensions"):
        classes_by_feature(objects, "clip", vectors[:, :2], allowed)


def test_an_object_is_of_the_class_that_it_is_called() -> None:
    objects = [
        thing(1, (0,), tag="Chair"),
        thing(2, (0,), tag="thing", tags=("thing", "a lamp")),
        thing(3, (0,), tag="armchair"),
        thing(4, (0,)),
    ]
    assert classes_by_tag(objects, NAMES, np.ones(4, bool)).tolist() == [0, 2, -1, -1]


def test_the_room_is_its_own_class_where_that_is_scored_and_else_takes_no_part() -> None:
    wall = thing(1, (0,), (1, 0), tag="wall", properties={"background": True})
    chair = thing(2, (0,), tag="chair")
    objects, settled = scored_objects([wall, chair], NAMES, ~left_out("1", NAMES))
    assert [o.id for o in objects] == [1, 2] and settled.tolist() == [3, -1]
    objects, settled = scored_objects([wall, chair], NAMES, ~left_out("4", NAMES))
    assert [o.id for o in objects] == [2] and settled.tolist() == [-1]


def test_a_class_to_leave_out_that_there_is_not_is_an_error() -> None:
    assert left_out("chair, Lamp", NAMES).tolist() == [True, False, True, False]
    with pytest.raises(UsageError, match="no class 'tabel'") as caught:
        left_out("tabel", NAMES)
    assert "table" in (caught.value.hint or "")
