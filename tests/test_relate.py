"""Relations from geometry: what each means, in every frame, and at what cost."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from cgdb.errors import SceneError
from cgdb.ingest.relations.boxes import Boxes, ground_gap, near_pairs, overlap_area, prisms, settle_sides
from cgdb.ingest.relations.relate import LABELS, Limits, contained_in_places, geometric_relations, with_geometry
from cgdb.scene import UP_AXES, Place, Relation, SceneGraph, SceneObject, check_scene

Box = tuple[float, float, float, float, float, float]
"""A box of the tests, z up: where its middle is on the ground, its bottom, and its sides."""

SCENES: dict[str, tuple[dict[str, Box], set[tuple[str, str, str]]]] = {
    "a cup stands on a table": (
        {"cup": (0.2, 0.1, 0.75, 0.08, 0.08, 0.1), "table": (0, 0, 0, 1.2, 0.8, 0.75)},
        {("cup", "on", "table")},
    ),
    "noise of 3 cm either way is no gap": (
        {
            "cup": (0.2, 0.1, 0.78, 0.08, 0.08, 0.1),
            "book": (-0.2, 0, 0.72, 0.2, 0.3, 0.1),
            "table": (0, 0, 0, 1.2, 0.8, 0.75),
        },
        {("cup", "on", "table"), ("book", "on", "table"), ("book", "near", "cup")},
    ),
    "a lamp whose foot was not seen is on the table below it": (
        {"lamp": (0, 0, 0.87, 0.3, 0.3, 0.3), "table": (0, 0, 0, 1.2, 0.8, 0.75)},
        {("lamp", "on", "table")},
    ),
    "a tray that a table holds up by a corner only is not on it": (
        {"tray": (0.75, 0, 0.75, 0.5, 0.4, 0.03), "table": (0, 0, 0, 1.2, 0.8, 0.75)},
        {("table", "near", "tray")},
    ),
    "a lamp hangs above a table": (
        {"lamp": (0.1, 0, 1.5, 0.3, 0.3, 0.3), "table": (0, 0, 0, 1.2, 0.8, 0.75)},
        {("lamp", "above", "table"), ("table", "under", "lamp"), ("lamp", "near", "table")},
    ),
    "a picture hangs above a sofa that stands a little before the wall": (
        {"picture": (0, 0.52, 1.3, 0.8, 0.0, 0.6), "sofa": (0, 0, 0, 2.0, 0.9, 0.8)},
        {("picture", "above", "sofa"), ("sofa", "under", "picture"), ("picture", "next_to", "sofa")},
    ),
    "a lamp near the ceiling is above nothing but what is near": (
        {"lamp": (0, 0, 2.6, 0.3, 0.3, 0.3), "stool": (0, 0, 0, 0.4, 0.4, 0.45)},
        set(),
    ),
    "a cushion on the seat of a sofa whose box goes up to its back": (
        {"cushion": (0.4, 0, 0.42, 0.4, 0.3, 0.3), "sofa": (0, 0, 0, 2.0, 0.9, 0.85)},
        {("cushion", "on", "sofa"), ("cushion", "in", "sofa")},
    ),
    "clothes in a drawer fill its bottom": (
        {"clothes": (0, 0, 0.52, 0.3, 0.3, 0.1), "drawer": (0, 0, 0.5, 0.6, 0.4, 0.25)},
        {
            ("clothes", "in", "drawer"),
        },
    ),
    "a bin in the box of a desk is in it or under it": (
        {"bin": (0.3, 0, 0, 0.3, 0.3, 0.35), "desk": (0, 0, 0, 1.4, 0.7, 0.75)},
        {("bin", "in", "desk"), ("bin", "under", "desk"), ("desk", "above", "bin")},
    ),
    "a table stands on a rug, which is under it": (
        {"rug": (0, 0, 0, 2.0, 1.5, 0.01), "table": (0, 0, 0.01, 1.2, 0.8, 0.75)},
        {("table", "on", "rug"), ("rug", "under", "table"), ("table", "above", "rug")},
    ),
    "a chair beside a table": (
        {"chair": (0.9, 0, 0, 0.45, 0.45, 0.9), "table": (0, 0, 0, 1.2, 0.8, 0.75)},
        {("chair", "next_to", "table")},
    ),
    "a sofa stands by a window, whose sill is higher": (
        {"sofa": (0, 0, 0, 2.0, 0.9, 0.7), "window": (0.5, 0.7, 0.9, 1.2, 0.1, 1.2)},
        {("sofa", "next_to", "window")},
    ),
    "a chair across the room is near, farther it is nothing": (
        {"chair": (1.6, 0, 0, 0.45, 0.45, 0.9), "table": (0, 0, 0, 1.2, 0.8, 0.75), "shelf": (4, 0, 0, 0.4, 1, 2)},
        {("chair", "near", "table")},
    ),
    "cups two of their widths apart are near": (
        {"cup": (0, 0, 0.75, 0.08, 0.08, 0.1), "mug": (0.3, 0, 0.75, 0.08, 0.08, 0.1)},
        {("cup", "near", "mug")},
    ),
    "a glass beside a plate of one level overlaps its box and is not on it": (
        {"glass": (0.17, 0, 0.75, 0.08, 0.08, 0.12), "plate": (0, 0, 0.75, 0.3, 0.3, 0.02)},
        {("glass", "next_to", "plate")},
    ),
    "one thing seen twice is neither in nor beside itself": (
        {"sofa": (0, 0, 0, 2.0, 0.9, 0.8), "couch": (0.05, 0, 0, 1.9, 0.9, 0.8)},
        {("couch", "near", "sofa")},
    ),
    "nothing is in a sheet": (
        {"switch": (0, 0, 1.1, 0.08, 0.05, 0.08), "wall panel": (0, 0, 0, 3.0, 0.1, 1.9)},
        {("switch", "near", "wall panel")},
    ),
}


def boxes_of(scene: dict[str, Box]) -> Boxes:
    rows = np.array(list(scene.values()), dtype=np.float64)
    extents = rows[:, 3:]
    centers = np.concatenate([rows[:, :2], rows[:, 2:3] + extents[:, 2:] / 2], axis=1)
    return Boxes(centers=centers, extents=extents)


def triples(relations: Sequence[Relation]) -> set[tuple[object, str, object]]:
    return {(relation.source, relation.label, relation.target) for relation in relations}


@pytest.mark.parametrize("name", SCENES)
def test_each_relation(name: str) -> None:
    scene, expected = SCENES[name]
    relations = geometric_relations(list(scene), boxes_of(scene))
    assert triples(relations) == expected
    assert all(0.0 < relation.confidence <= 1.0 and relation.origin == "geometry" for relation in relations)


UP = {
    # Columns: where the test's own x, y and z point when the scene's up axis is this one.
    "z": np.eye(3),
    "-z": np.diag([1.0, -1.0, -1.0]),
    "y": np.array([[1, 0, 0], [0, 0, 1], [0, -1, 0]], dtype=float),
    "-y": np.array([[1, 0, 0], [0, 0, -1], [0, 1, 0]], dtype=float),
    "x": np.array([[0, 0, 1], [0, 1, 0], [-1, 0, 0]], dtype=float),
    "-x": np.array([[0, 0, -1], [0, 1, 0], [1, 0, 0]], dtype=float),
}


@pytest.mark.parametrize("up", UP_AXES)
@pytest.mark.parametrize("name", SCENES)
def test_each_relation_along_each_up_axis(name: str, up: str) -> None:
    scene, expected = SCENES[name]
    boxes, turn = boxes_of(scene), UP[up]
    assert np.linalg.det(turn) == pytest.approx(1.0)
    assert turn[:, 2] @ (np.eye(3)["xyz".index(up[-1])] * (-1 if up[0] == "-" else 1)) == 1.0
    turned = Boxes(centers=boxes.centers @ turn.T, extents=boxes.extents @ np.abs(turn).T)
    assert triples(geometric_relations(list(scene), turned, up=up)) == expected
    rotated = Boxes(centers=boxes.centers @ turn.T, extents=boxes.extents, rotations=np.tile(turn, (len(scene), 1, 1)))
    assert triples(geometric_relations(list(scene), rotated, up=up)) == expected


def about_z(angle: float) -> np.ndarray:
    return np.array([[np.cos(angle), -np.sin(angle), 0], [np.sin(angle), np.cos(angle), 0], [0, 0, 1]])


def test_a_turned_box_counts_as_it_lies() -> None:
    # The hulls of these planks overlap; the planks lie side by side across the diagonal.
    turn = about_z(np.pi / 4)
    away = turn @ np.array([0.0, 0.6, 0.0])
    boxes = Boxes(
        centers=np.array([[0.0, 0, 0.05], away + np.array([0, 0, 0.05])]),
        extents=np.array([[3.0, 0.3, 0.1], [3.0, 0.3, 0.1]]),
        rotations=np.array([turn, turn]),
    )
    shapes = prisms(boxes, "z")
    first, second = np.array([0]), np.array([1])
    assert ground_gap(shapes, first, second)[0] == pytest.approx(0.3)
    assert overlap_area(shapes, first, second)[0] == 0.0
    assert triples(geometric_relations([1, 2], boxes)) == {(1, "next_to", 2)}


@settings(max_examples=60, deadline=None)
@given(st.integers(0, 2**32 - 1))
def test_overlap_and_gap_agree_with_counting_points(seed: int) -> None:
    random = np.random.default_rng(seed)
    rotations = np.linalg.qr(random.normal(size=(2, 3, 3)))[0]
    boxes = Boxes(
        centers=random.uniform(-0.4, 0.4, (2, 3)), extents=random.uniform(0.1, 1.0, (2, 3)), rotations=rotations
    )
    shapes = prisms(boxes, "z")
    grid = np.stack(np.meshgrid(*[np.linspace(-1.6, 1.6, 161)] * 2), axis=-1).reshape(-1, 2)

    def within(row: int) -> np.ndarray:
        corners = shapes.corners[row] + shapes.ground[row]
        edges = np.roll(corners, -1, axis=0) - corners
        away = grid[:, None, :] - corners
        return np.asarray((edges[:, 0] * away[..., 1] - edges[:, 1] * away[..., 0] >= 0).all(axis=1))

    first, second = np.array([0]), np.array([1])
    cell = 0.02**2
    assert shapes.area[0] == pytest.approx(within(0).sum() * cell, abs=0.06)
    both = within(0) & within(1)
    assert overlap_area(shapes, first, second)[0] == pytest.approx(both.sum() * cell, abs=0.06)
    gap = ground_gap(shapes, first, second)[0]
    assert gap == pytest.approx(ground_gap(shapes, second, first)[0], abs=1e-9)
    if both.any():
        assert gap == 0.0
    else:
        ours, theirs = grid[within(0)], grid[within(1)]
        nearest = np.sqrt(((ours[:, None] - theirs[None]) ** 2).sum(-1)).min()
        assert gap == pytest.approx(nearest, abs=0.06)


def random_room(seed: int, count: int = 40) -> Boxes:
    random = np.random.default_rng(seed)
    extents = random.uniform(0.05, 1.2, (count, 3))
    centers = np.concatenate([random.uniform(0, 5, (count, 2)), random.uniform(0, 1.5, (count, 1))], axis=1)
    rotations = np.array([about_z(angle) for angle in random.uniform(0, 7, count)])
    # Some stand exactly on others, exactly as large as they are: borders that lie on each other must not matter.
    for row in range(0, count - 1, 5):
        centers[row] = centers[row + 1]
        extents[row] = extents[row + 1]
        rotations[row] = rotations[row + 1]
        centers[row, 2] += extents[row, 2]
    return Boxes(centers=centers, extents=extents, rotations=rotations)


def rounded(relations: Sequence[Relation]) -> dict[tuple[object, str, object], float]:
    return {(r.source, r.label, r.target): round(r.confidence, 2) for r in relations}


@settings(max_examples=40, deadline=None)
@given(st.integers(0, 2**32 - 1), st.floats(-4, 4), st.tuples(*[st.floats(-1000, 1000)] * 3))
def test_moving_turning_and_reordering_a_map_changes_nothing(
    seed: int, angle: float, shift: tuple[float, float, float]
) -> None:
    boxes = random_room(seed)
    assert boxes.rotations is not None
    count = len(boxes.centers)
    ids: list[int | str] = [k if k % 3 else f"thing {k}" for k in range(count)]
    before = geometric_relations(ids, boxes)
    turn = about_z(angle)
    order = np.random.default_rng(seed).permutation(count)
    moved = Boxes(
        centers=(boxes.centers @ turn.T + shift)[order],
        extents=boxes.extents[order],
        rotations=(turn @ boxes.rotations)[order],
    )
    after = geometric_relations([ids[k] for k in order], moved)
    assert triples(before) == triples(after)
    assert [(r.source, r.label, r.target) for r in before] == [(r.source, r.label, r.target) for r in after]
    assert {r.label for r in before} >= {"on", "near", "next_to"}
    for one, other in zip(before, after, strict=True):
        assert one.confidence == pytest.approx(other.confidence, abs=2e-3)


def test_above_is_the_inverse_of_under_and_symmetric_ones_come_once() -> None:
    relations = geometric_relations(range(40), random_room(3))
    under = {(r.source, r.target): r.confidence for r in relations if r.label == "under"}
    above = {(r.target, r.source): r.confidence for r in relations if r.label == "above"}
    assert under == above
    for label in ("near", "next_to"):
        pairs = [(r.source, r.target) for r in relations if r.label == label]
        assert len(pairs) == len(set(pairs)) and all(str(a).zfill(9) < str(b).zfill(9) for a, b in pairs)
    of_pair: dict[tuple[object, object], set[str]] = {}
    for relation in relations:
        ends = sorted([relation.source, relation.target], key=str)
        of_pair.setdefault((ends[0], ends[1]), set()).add(relation.label)
    for labels in of_pair.values():
        assert "near" not in labels or not labels & {"on", "in", "next_to"}
        assert "next_to" not in labels or not labels & {"on", "in"}
    assert {r.label for r in relations} <= set(LABELS)


def test_walls_floors_and_rooms_only_hold_things_up() -> None:
    room: dict[str, Box] = {
        "floor": (2, 2, -0.1, 6, 6, 0.1),
        "room": (2, 2, 0, 6, 6, 2.5),
        "ceiling": (2, 2, 2.5, 6, 6, 0.1),
        "table": (2, 2, 0, 1.2, 0.8, 0.75),
        "chair": (2.9, 2, 0, 0.45, 0.45, 0.9),
        "lamp": (2, 2, 2.3, 0.3, 0.3, 0.2),
    }
    relations = geometric_relations(list(room), boxes_of(room))
    large = {"floor", "room", "ceiling"}
    touching = {t for t in triples(relations) if large & {t[0], t[2]}}
    assert touching == {("table", "on", "floor"), ("chair", "on", "floor")}
    wall: dict[str, Box] = {"wall": (0, 0, 0, 2, 0.2, 2.4), "shelf": (0, 0.25, 1, 1, 0.3, 0.3)}
    assert geometric_relations(list(wall), boxes_of(wall), structure=[True, False]) == []
    assert geometric_relations(list(wall), boxes_of(wall)) != []


def test_a_large_sofa_in_a_small_room_is_no_room() -> None:
    scene: dict[str, Box] = {"sofa": (0, 0, 0, 3.9, 3.3, 0.9), "cushion": (1, 1, 0.45, 0.5, 0.5, 0.3)}
    assert ("cushion", "on", "sofa") in triples(geometric_relations(list(scene), boxes_of(scene)))


def test_a_box_without_thickness_takes_part() -> None:
    scene: dict[str, Box] = {
        "mat": (0, 0, 0.75, 0.4, 0.3, 0.0),
        "table": (0, 0, 0, 1.2, 0.8, 0.75),
        "dot": (0, 0, 0.75, 0, 0, 0),
    }
    found = triples(geometric_relations(list(scene), boxes_of(scene)))
    assert {("mat", "on", "table"), ("dot", "on", "table")} <= found


def test_points_are_only_near() -> None:
    boxes = Boxes(
        centers=np.array([[0.0, 0, 0.8], [0, 0, 0.4], [9, 9, 9]]),
        extents=np.array([[np.nan] * 3, [1.0, 1.0, 0.8], [np.nan] * 3]),
    )
    assert triples(geometric_relations([1, 2, 3], boxes)) == {(1, "near", 2)}


def test_near_keeps_to_the_nearest_few() -> None:
    random = np.random.default_rng(0)
    boxes = Boxes(centers=random.uniform(0, 0.9, (200, 3)), extents=np.full((200, 3), 0.001))
    limits = Limits(near_count=5, side_touch=0.0, side_share=0.0)
    near = [r for r in geometric_relations(range(200), boxes, limits=limits) if r.label == "near"]
    assert 200 * 5 / 2 <= len(near) <= 200 * 5
    distance = np.linalg.norm(boxes.centers[:, None] - boxes.centers[None], axis=-1)
    np.fill_diagonal(distance, np.inf)
    closest = int(distance[0].argmin())
    assert (0, closest) in {(r.source, r.target) for r in near}


def all_pairs(boxes: Boxes, across: float, upright: float) -> set[tuple[int, int]]:
    shapes = prisms(boxes, "z")
    least, most = shapes.ground - shapes.reach, shapes.ground + shapes.reach
    found = set()
    for a in range(len(least)):
        for b in range(a + 1, len(least)):
            apart = np.maximum(least[a] - most[b], least[b] - most[a]).max()
            above = max(shapes.low[a] - shapes.high[b], shapes.low[b] - shapes.high[a])
            if apart <= across and above <= upright:
                found.add((a, b))
    return found


@settings(max_examples=30, deadline=None)
@given(st.integers(0, 2**32 - 1))
def test_the_grids_miss_no_pair(seed: int) -> None:
    random = np.random.default_rng(seed)
    extents = 10.0 ** random.uniform(-3, 2, (60, 1)) * random.uniform(0.1, 1, (60, 3))
    boxes = Boxes(centers=random.uniform(-30, 30, (60, 3)), extents=extents)
    pairs = near_pairs(prisms(boxes, "z"), across=1.0, upright=1.5, crowd=256)
    listed = list(zip(pairs.first.tolist(), pairs.second.tolist(), strict=True))
    assert len(listed) == len(set(listed))
    assert set(listed) == all_pairs(boxes, 1.0, 1.5)


def town(count: int) -> Boxes:
    """Boxes at one density, whatever their number."""
    random = np.random.default_rng(1)
    side = np.sqrt(count / 2.0)
    centers = np.concatenate([random.uniform(0, side, (count, 2)), random.uniform(0, 2, (count, 1))], axis=1)
    return Boxes(centers=centers, extents=random.uniform(0.05, 1.0, (count, 3)))


def compared(boxes: Boxes, crowd: int = 256) -> int:
    return near_pairs(prisms(boxes, "z"), across=1.0, upright=1.5, crowd=crowd).compared


def test_pairs_compared_grow_with_the_map_not_with_its_square() -> None:
    small, large = compared(town(2_000)), compared(town(8_000))
    assert large < 6 * small
    assert large < 0.02 * 8_000 * 7_999 / 2


def test_one_huge_box_costs_one_look_at_each() -> None:
    boxes = town(4_000)
    with_house = Boxes(
        centers=np.concatenate([boxes.centers, [[20.0, 20, 5]]]),
        extents=np.concatenate([boxes.extents, [[500.0, 500, 10]]]),
    )
    assert compared(with_house) <= compared(boxes) + 4 * 4_001


def test_boxes_that_all_lie_in_one_place_stay_bounded() -> None:
    count, crowd = 3_000, 64
    boxes = Boxes(centers=np.zeros((count, 3)), extents=np.full((count, 3), 1.0))
    assert compared(boxes, crowd) <= 4 * count * crowd
    relations = geometric_relations(range(count), boxes, limits=Limits(crowd=crowd))
    assert len(relations) <= count * 8


def test_no_objects_and_one_object() -> None:
    assert geometric_relations([], Boxes(centers=np.empty((0, 3)), extents=np.empty((0, 3)))) == []
    assert geometric_relations([7], Boxes(centers=np.zeros((1, 3)), extents=np.ones((1, 3)))) == []


@pytest.mark.parametrize(
    ("centers", "extents"),
    [
        (np.zeros((2, 3)), np.ones((1, 3))),
        (np.zeros((1, 2)), np.ones((1, 3))),
        (np.array([[0.0, np.nan, 0]]), np.ones((1, 3))),
        (np.zeros((1, 3)), np.array([[1.0, np.inf, 1]])),
        (np.zeros((1, 3)), np.array([[1.0, -1.0, 1]])),
        (np.zeros((1, 3)), np.array([[1.0, np.nan, 1]])),
    ],
)
def test_boxes_that_are_none_are_refused(centers: np.ndarray, extents: np.ndarray) -> None:
    with pytest.raises(SceneError):
        Boxes(centers=centers, extents=extents)


def test_calls_that_do_not_add_up_are_refused() -> None:
    boxes = Boxes(centers=np.zeros((2, 3)), extents=np.ones((2, 3)))
    with pytest.raises(SceneError, match="3 ids but 2 boxes"):
        geometric_relations([1, 2, 3], boxes)
    with pytest.raises(SceneError, match="same id"):
        geometric_relations([1, 1], boxes)
    with pytest.raises(SceneError, match="up axis 'w'"):
        geometric_relations([1, 2], boxes, up="w")


def scene_of(scene: dict[str, Box], **more: object) -> SceneGraph:
    boxes = boxes_of(scene)
    objects = tuple(
        SceneObject(id=name, tag=name, center=boxes.centers[k], extent=boxes.extents[k]) for k, name in enumerate(scene)
    )
    return replace(SceneGraph(name="home", objects=objects), **more)  # type: ignore[arg-type]


def test_with_geometry_adds_to_what_the_map_says() -> None:
    scene, _ = SCENES["a cup stands on a table"]
    said = Relation(source="cup", target="table", label="on", confidence=0.4, origin="llm")
    lost = SceneObject(id="ghost", tag="ghost")
    before = scene_of(scene, relations=(said,))
    after = with_geometry(replace(before, objects=(*before.objects, lost)))
    check_scene(after)
    assert after.relations == (said,)
    bare = with_geometry(scene_of(scene))
    assert triples(bare.relations) == {("cup", "on", "table")}
    assert with_geometry(bare).relations == bare.relations


def test_tags_name_walls_by_their_last_word() -> None:
    scene: dict[str, Box] = {"floor lamp": (0, 0, 0, 0.3, 0.3, 1.5), "wooden floor": (0.4, 0, 0, 0.4, 0.3, 0.02)}
    assert with_geometry(scene_of(scene)).relations == ()
    scene["chair"] = (0.4, 0, 0.02, 0.35, 0.3, 0.9)
    assert triples(with_geometry(scene_of(scene)).relations) == {
        ("chair", "on", "wooden floor"),
        ("chair", "next_to", "floor lamp"),
    }


def test_places_contain_what_lies_in_the_smallest_of_them() -> None:
    scene: dict[str, Box] = {
        "bed": (1, 1, 0, 2, 1.5, 0.5),
        "sink": (6, 1, 0, 0.5, 0.5, 0.9),
        "car": (50, 50, 0, 4, 2, 1.5),
    }
    places = (
        Place(id="B", kind="Building", center=np.array([5.0, 5, 1]), extent=np.array([12.0, 12, 4])),
        Place(id="R1", kind="Room", center=np.array([5.0, 5, 1]), extent=np.array([11.0, 11, 3])),
        Place(id="R2", kind="Room", center=np.array([1.5, 1.5, 1]), extent=np.array([4.0, 4, 3])),
        Place(id="R3", kind="Room", name="without a box", center=np.array([6.0, 1, 1])),
    )
    home = scene_of(scene, places=places)
    expected = {
        ("B", "contains", "bed"),
        ("B", "contains", "sink"),
        ("R2", "contains", "bed"),
        ("R1", "contains", "sink"),
    }
    assert triples(contained_in_places(home)) == expected
    assert {t for t in triples(with_geometry(home).relations) if t[1] == "contains"} == expected
    told = replace(home, relations=(Relation(source="R1", target="bed", label="contains"),))
    assert triples(contained_in_places(told)) == {t for t in expected if t[2] != "bed"}


def test_sides_without_directions_are_dealt_to_likely_axes() -> None:
    random = np.random.default_rng(5)
    # A room of 6 x 4 x 2.5 m: windows and pictures on its walls, things on its floor; sides longest first.
    centers = np.array([[0.0, 2, 1.2], [6, 2, 1.2], [3, 0, 1.2], [3, 4, 1.2], [3, 2, 0], [3, 2, 2.5]])
    extents = np.array([[2.0, 1.5, 0.05]] * 4 + [[6.0, 4.0, 0.05]] * 2)
    loose = np.concatenate([random.uniform(1, 3, (6, 2)), np.full((6, 1), 0.4)], axis=1)
    boxes = Boxes(
        centers=np.concatenate([centers, loose]),
        extents=np.concatenate([extents, -np.sort(-random.uniform(0.3, 0.8, (6, 3)), axis=1)]),
    )
    settled = settle_sides(boxes, "z")
    assert (np.sort(settled.extents, axis=1) == np.sort(boxes.extents, axis=1)).all()
    thin = settled.extents[:6].argmin(axis=1).tolist()
    assert thin == [0, 0, 1, 1, 2, 2]
    assert (settled.extents[6:] == boxes.extents[6:]).all()
    known = Boxes(centers=boxes.centers, extents=boxes.extents, rotations=np.tile(np.eye(3), (12, 1, 1)))
    assert settle_sides(known, "z") is known
    few = Boxes(centers=boxes.centers[:9], extents=boxes.extents[:9])
    assert settle_sides(few, "z") is few


def test_a_real_map_has_its_pillows_on_its_couches(data: Path) -> None:
    listed = json.loads((data / "maps/conceptgraphs/room0_planner.json").read_text())
    objects = tuple(
        SceneObject(
            id=o["id"], tag=o["object_tag"], center=np.array(o["bbox_center"]), extent=np.array(o["bbox_extent"])
        )
        for o in listed
    )
    scene = with_geometry(SceneGraph(name="room0", objects=objects))
    check_scene(scene)
    tags = {o.id: str(o.tag) for o in objects}
    on = {(tags[r.source], tags[r.target]) for r in scene.relations if r.label == "on" and r.confidence >= 0.5}
    assert {("throw pillow", "sofa"), ("vase", "coffee table"), ("glass plate", "wooden cabinet")} <= on
    beside = {(tags[r.source], tags[r.target]) for r in scene.relations if r.label == "next_to"}
    assert ("couch", "window") in beside
    assert len(scene.relations) < 12 * len(objects)


@pytest.mark.parametrize("flat", ["TestScene5", "TestScene7"])
def test_a_simulated_flat_agrees_with_its_own_edges(data: Path, flat: str) -> None:
    graph = json.loads((data / f"maps/virtualhome/{flat}_graph.json").read_text())
    structure = {"Walls", "Ceiling", "Floor", "Floors"}
    nodes = {node["id"]: node for node in graph["nodes"] if node["category"] != "Rooms"}
    large = [node["category"] in structure for node in nodes.values()]
    things = {i for i, is_large in zip(nodes, large, strict=True) if not is_large}
    boxes = Boxes(
        centers=np.array([node["bounding_box"]["center"] for node in nodes.values()]),
        extents=np.array([node["bounding_box"]["size"] for node in nodes.values()]),
    )
    relations = geometric_relations(list(nodes), boxes, up="y", structure=large)

    def edges(kind: str) -> set[tuple[int, int]]:
        listed = [(e["from_id"], e["to_id"]) for e in graph["edges"] if e["relation_type"] == kind]
        return {pair for pair in listed if set(pair) <= things}

    def found(*labels: str) -> set[tuple[object, object]]:
        return {(r.source, r.target) for r in relations if r.label in labels and {r.source, r.target} <= things}

    on, inside, close = edges("ON"), edges("INSIDE"), edges("CLOSE")
    assert len(on & found("on")) >= 0.9 * len(on)
    assert len(inside & found("in")) >= 0.85 * len(inside)
    assert len((on | inside) & found("on", "in")) >= 0.75 * len(found("on", "in"))
    assert len(close & found("near", "next_to")) >= 0.95 * len(found("near", "next_to"))
