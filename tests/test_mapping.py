"""The mapping loop on a room of which everything is known."""

from __future__ import annotations

import dataclasses
from pathlib import Path

import numpy as np
import pytest

from cgdb.errors import FormatError, SceneError, StoreError, UsageError
from cgdb.ingest.detections.detections import Selection, checked, select
from cgdb.ingest.detections.segment import GeometricDetector
from cgdb.ingest.evaluation.mapping import Truth, evaluate
from cgdb.ingest.evaluation.nearest import nearest
from cgdb.ingest.frames.recording import open_recording
from cgdb.ingest.mapping import checkpoint, tidy
from cgdb.ingest.mapping.associate import Association
from cgdb.ingest.mapping.clusters import components, pieces
from cgdb.ingest.mapping.fuse import Objects
from cgdb.ingest.mapping.lift import Lifting, lift
from cgdb.ingest.mapping.mapper import Mapper, Mapping
from cgdb.ingest.mapping.pixels import shrunk, unproject, usable_pixels
from cgdb.ingest.mapping.similarity import iou
from cgdb.ingest.mapping.upright import upright_box
from cgdb.ingest.mapping.voxels import Voxels
from cgdb.ingest.relations.relate import with_geometry
from cgdb.scene import SceneGraph, check_scene
from tests.mapping_rooms import ROOM, Box, looking, render, room_frame


def mapped(count: int = 12, how: Mapping | None = None) -> Mapper:
    mapper = Mapper(how)
    for index in range(count):
        mapper.step(*room_frame(index, count))
    return mapper


def by_tag(scene: SceneGraph) -> dict[str | None, list[object]]:
    found: dict[str | None, list[object]] = {}
    for obj in scene.objects:
        found.setdefault(obj.tag, []).append(obj)
    return found


def truth_of(boxes: tuple[Box, ...] = ROOM) -> Truth:
    rng = np.random.default_rng(0)
    points, owner = [], []
    for number, box in enumerate(boxes):
        low, high = np.array(box.low), np.array(box.high)
        n = 6000
        cloud = rng.uniform(low, high, (n, 3))
        side = rng.integers(0, 3, n)
        cloud[np.arange(n), side] = np.where(rng.random(n) < 0.5, low[side], high[side])
        points.append(cloud)
        owner.append(np.full(n, number))
    return Truth(
        points=np.concatenate(points).astype(np.float32),
        owner=np.concatenate(owner),
        things=np.array([box.name not in ("floor", "wall") for box in boxes]),
        frames=np.full(len(boxes), 10),
    )


# -- the whole loop


def test_a_room_is_mapped_once_each_and_clean() -> None:
    mapper = mapped()
    mapper.finish()
    scene = mapper.scene("room")
    check_scene(scene)
    assert {tag: len(objects) for tag, objects in by_tag(scene).items()} == {box.name: 1 for box in ROOM}
    score = evaluate(scene, truth_of())
    assert (score.found, score.missed, score.duplicates) == (3, 0, 0)
    assert score.purity > 0.95


def test_boxes_and_colours_are_those_of_the_things() -> None:
    mapper = mapped()
    mapper.finish()
    found = {obj.tag: obj for obj in mapper.scene("room").objects}
    for box in ROOM[3:]:
        obj = found[box.name]
        assert obj.center is not None and obj.extent is not None and obj.colors is not None
        np.testing.assert_allclose(obj.center[2], (box.low[2] + box.high[2]) / 2, atol=0.05)
        np.testing.assert_allclose(obj.extent[2], box.high[2] - box.low[2], atol=0.06)
        np.testing.assert_allclose(obj.colors.mean(axis=0), box.color, atol=8)


def test_relations_follow() -> None:
    mapper = mapped()
    mapper.finish()
    scene = with_geometry(mapper.scene("room"))
    name = {obj.id: obj.tag for obj in scene.objects}
    said = {(name[r.source], r.label, name[r.target]) for r in scene.relations}
    assert ("box", "on", "table") in said and ("vase", "on", "table") in said


def test_the_same_input_gives_the_same_map() -> None:
    one, two = mapped().scene("a"), mapped().scene("a")
    assert [o.id for o in one.objects] == [o.id for o in two.objects]
    for a, b in zip(one.objects, two.objects, strict=True):
        assert a.points is not None and b.points is not None
        np.testing.assert_array_equal(a.points, b.points)
        np.testing.assert_array_equal(a.features["clip"], b.features["clip"])


def test_a_map_can_be_asked_for_while_it_is_made_and_keeps_its_ids() -> None:
    mapper = Mapper()
    early: dict[object, str | None] = {}
    for index in range(12):
        mapper.step(*room_frame(index))
        if index == 5:
            early = {obj.id: obj.tag for obj in mapper.scene("room").objects}
    assert len(early) == len(ROOM)
    assert {obj.id: obj.tag for obj in mapper.scene("room").objects} == early


def test_what_was_hardly_seen_is_no_object() -> None:
    mapper = mapped(2)
    assert mapper.scene("room").objects == ()


@pytest.mark.parametrize("spatial", ["overlap", "iou", "giou", "iou_accurate", "giou_accurate"])
@pytest.mark.parametrize("semantic", ["paper", "cosine"])
def test_all_similarities_map_the_room(spatial: str, semantic: str) -> None:
    threshold = 1.1 if semantic == "paper" else 1.0
    association = Association(spatial=spatial, semantic=semantic, threshold=threshold)  # type: ignore[arg-type]
    mapper = mapped(12, Mapping(association=association))
    mapper.finish()
    assert {"table", "box", "vase"} <= set(by_tag(mapper.scene("room")))


def test_background_is_one_object_each_or_none_or_as_others() -> None:
    merged = mapped(6).scene("room")
    assert {obj.tag for obj in merged.objects if obj.properties["background"]} == {"floor", "wall"}
    skipped = mapped(6, Mapping(background="skip")).scene("room")
    assert {"floor", "wall"}.isdisjoint(by_tag(skipped))
    plain = mapped(6, Mapping(background="objects")).scene("room")
    assert not any(obj.properties["background"] for obj in plain.objects)


def test_best_views_are_those_with_most_points() -> None:
    mapper = mapped()
    for obj in mapper.scene("room").objects:
        points = [view.points for view in obj.views]
        assert len(points) == 10 == obj.properties["n_views"] and points == sorted(points, reverse=True)


def test_a_near_view_shows_more_points_than_a_far_one() -> None:
    """The same face fills the same voxels from near and far, but not as many pixels."""
    cube = (Box("cube", (-0.15, 0.0, 0.35), (0.15, 0.3, 0.65), (200, 40, 40)),)
    mapper = Mapper(Mapping(selection=Selection(largest_share=1.0)))
    masks = []
    for number, away in enumerate((1.6, 0.4, 0.8)):
        pose = looking((0.0, -away, 0.5), (0.0, 0.0, 0.5))
        depth, which = render(pose, cube)
        frame = dataclasses.replace(room_frame(0)[0], index=number, depth=depth, T_world_camera=pose)
        masks.append(which == 0)
        mapper.step(
            frame, checked(masks[-1][None], where="f", labels=["cube"], features=np.eye(1, 8, dtype=np.float32))
        )
    (cube_seen,) = mapper.objects.all
    views = sorted(cube_seen.views, reverse=True)
    assert [view.frame for view in views] == [1, 2, 0]
    for view in views:  # all but the rim, to within what a grid of every fourth pixel can say
        rim = masks[view.frame].sum() - shrunk(masks[view.frame], 2, (False,) * 4).sum()
        assert view.points == pytest.approx(int(masks[view.frame].sum()), abs=int(rim))
    assert cube_seen.widest == 12 * 12


def test_memory_does_not_grow_with_the_number_of_frames() -> None:
    mapper = Mapper()
    sizes = []
    for turn in range(3):
        for index in range(12):
            mapper.step(*room_frame(index))
        sizes.append((mapper.voxels.count, len(mapper.objects)))
        assert all(len(obj.views) <= 10 for obj in mapper.objects.all), turn
    assert sizes[0] == sizes[1] == sizes[2]


def test_a_checkpoint_goes_on_as_if_nothing_had_been(tmp_path: Path) -> None:
    path = tmp_path / "state.npz"
    half = mapped(6)
    whole = Mapper()
    checkpoint.save(half, path, {"here": checkpoint.Progress(start=0, stride=1, size=None, next=6)})
    resumed, done = checkpoint.load(path, Mapping())
    assert done == {"here": checkpoint.Progress(start=0, stride=1, size=None, next=6)}
    for index in range(6):
        whole.step(*room_frame(index, 6))
    for index in range(6, 12):
        resumed.step(*room_frame(index))
        whole.step(*room_frame(index))
    one, two = whole.scene("a"), resumed.scene("a")
    assert [o.id for o in one.objects] == [o.id for o in two.objects]
    for a, b in zip(one.objects, two.objects, strict=True):
        assert a.points is not None and b.points is not None
        np.testing.assert_array_equal(a.points, b.points)
    with pytest.raises(UsageError, match="other parameters"):
        checkpoint.load(path, Mapping(voxel=0.05))
    path.write_bytes(path.read_bytes()[:1000])
    with pytest.raises(FormatError, match="cannot be read"):
        checkpoint.load(path, Mapping())


def test_a_full_disk_leaves_the_state_that_was(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = tmp_path / "state.npz"
    mapper = mapped(3)
    checkpoint.save(mapper, path, {"here": checkpoint.Progress(start=0, stride=1, size=None, next=3)})
    before = path.read_bytes()

    def full(_: int) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr("os.fsync", full)
    with pytest.raises(StoreError, match="No space left"):
        checkpoint.save(mapper, path, {"here": checkpoint.Progress(start=0, stride=1, size=None, next=4)})
    assert path.read_bytes() == before and len(list(tmp_path.iterdir())) == 1


def test_geometry_alone_finds_the_things() -> None:
    detector, mapper = GeometricDetector(up="z"), Mapper()
    for index in range(12):
        frame, _ = room_frame(index)
        mapper.step(frame, detector(frame))
    mapper.finish()
    score = evaluate(mapper.scene("room"), truth_of())
    assert (score.found, score.missed) == (3, 0) and score.purity > 0.7


# -- lifting


def test_unprojected_points_lie_on_the_surfaces() -> None:
    frame, found = room_frame(3)
    for mask, name in zip(found.masks, found.labels, strict=True):
        box = next(box for box in ROOM if box.name == name)
        points = unproject(frame, np.flatnonzero(mask))
        assert (points >= np.array(box.low) - 1e-3).all() and (points <= np.array(box.high) + 1e-3).all()


def test_what_lies_behind_an_edge_is_not_used_and_thin_things_are() -> None:
    depth = np.full((20, 20), 2.0, np.float32)
    depth[:, 10] = 1.0
    depth[5, 5] = 0.0
    usable = usable_pixels(depth, nearest=0.1, farthest=8.0, edge=0.015)
    assert usable[10, 10] and not usable[10, 9] and not usable[10, 11]
    assert usable[10, 7] and not usable[5, 5] and usable[5, 6]


def test_a_mask_is_not_shrunk_where_the_picture_cuts_it() -> None:
    mask = np.ones((6, 8), np.bool_)
    assert shrunk(mask, 2, (True, True, True, True)).all()
    inner = shrunk(mask, 2, (True, False, False, True))
    assert inner[5, 0] and not inner[1, 0] and not inner[5, 6] and inner.sum() == 4 * 6


def test_components_of_a_graph() -> None:
    label = components(7, np.array([0, 1, 4, 6]), np.array([1, 2, 5, 5]))
    assert label.tolist() == [0, 0, 0, 3, 4, 4, 4]


def test_the_largest_piece_stays_and_lone_voxels_go() -> None:
    near = np.stack(np.meshgrid(range(6), range(6), [0], indexing="ij"), axis=-1).reshape(-1, 3)
    far = near[:12] + np.array([100, 0, 0])
    lone = np.array([[50, 50, 50]])
    cells = np.concatenate([near, far, lone]).astype(np.int32)
    owner = np.zeros(len(cells), np.int32)
    kept = pieces(owner, cells, np.zeros(1, np.bool_), side=3, core=6)
    assert kept.tolist() == [True] * 36 + [False] * 13
    assert pieces(owner, cells, np.ones(1, np.bool_), side=3, core=6).tolist() == [True] * 48 + [False]
    assert pieces(owner, cells, np.zeros(1, np.bool_), side=3, core=6, least=0.3).sum() == 48
    assert pieces(owner[-1:], lone.astype(np.int32), np.zeros(1, np.bool_), side=3, core=6).all()


def test_spill_over_an_outline_is_outvoted() -> None:
    # The mask of the vase always takes a strip of what lies behind it along.
    mapper = Mapper()
    for index in range(12):
        frame, found = room_frame(index)
        wide = found.masks.copy()
        at = found.labels.index("vase")
        for shift in (1, 2, 3):
            wide[at, :, shift:] |= found.masks[at, :, :-shift]
        mapper.step(frame, dataclasses.replace(found, masks=wide))
    mapper.finish()
    vase = next(obj for obj in mapper.scene("room").objects if obj.tag == "vase")
    assert vase.points is not None
    box = ROOM[4]
    inside = ((vase.points > np.array(box.low) - 0.03) & (vase.points < np.array(box.high) + 0.03)).all(axis=1)
    assert inside.mean() > 0.9


# -- detections


def test_a_mask_loses_what_lies_in_it() -> None:
    frame, _ = room_frame(0)
    masks = np.zeros((2, *frame.depth.shape), np.bool_)
    masks[0, 20:80, 20:80] = True
    masks[1, 40:60, 40:60] = True
    kept = select(checked(masks, where="x"), frame, Selection())
    assert kept.masks[0].sum() == 3600 - 400 and kept.masks[1].sum() == 400
    assert select(checked(masks, where="x"), frame, Selection(subtract=False)).masks[0].sum() == 3600


def test_small_unsure_and_huge_detections_are_left_out() -> None:
    frame, _ = room_frame(0)
    masks = np.zeros((3, *frame.depth.shape), np.bool_)
    masks[0, :4, :4] = True
    masks[1, :110, :150] = True
    masks[2, 20:40, 20:40] = True
    found = checked(masks, where="x", confidence=np.array([1.0, 1.0, 0.4]))
    assert len(select(found, frame, Selection())) == 1
    assert len(select(found, frame, Selection(least_confidence=0.5))) == 0


def test_masks_of_another_size_are_brought_to_the_frame() -> None:
    frame, found = room_frame(0)
    double = np.repeat(np.repeat(found.masks, 2, axis=1), 2, axis=2)
    fitted = select(checked(double, where="x"), frame, Selection(subtract=False))
    np.testing.assert_array_equal(
        fitted.masks, select(checked(found.masks, where="x"), frame, Selection(subtract=False)).masks
    )
    with pytest.raises(FormatError, match="do not fit"):
        select(checked(double[:, :, :100], where="x"), frame, Selection())


@pytest.mark.parametrize(
    ("change", "says"),
    [
        ({"features": np.full((2, 4), np.nan)}, "NaN"),
        ({"features": np.zeros((2, 4))}, "without length"),
        ({"features": np.ones((3, 4))}, "2 masks but features"),
        ({"confidence": np.ones(3)}, "3 confidences"),
        ({"labels": ["a"]}, "1 labels"),
        ({"xyxy": np.ones((2, 3))}, "boxes"),
        ({"xyxy": np.full((2, 4), np.inf)}, "finite"),
    ],
)
def test_detections_that_do_not_go_together(change: dict[str, object], says: str) -> None:
    with pytest.raises(FormatError, match=says):
        checked(np.ones((2, 8, 8), np.bool_), where="x", **change)  # type: ignore[arg-type]


def test_features_of_another_dimension_are_one_bad_frame() -> None:
    mapper = mapped(3)
    frame, found = room_frame(4)
    assert found.features is not None
    with pytest.raises(FormatError, match="those before it had 5"):
        mapper.step(frame, dataclasses.replace(found, features=found.features[:, :3]))
    mapper.step(*room_frame(5))
    assert mapper.frames == 4


def test_a_frame_without_detections_is_a_frame() -> None:
    mapper = mapped(3)
    frame, found = room_frame(4)
    mapper.step(frame, found.take([]))
    mapper.step(frame, checked(np.zeros((0, 1, 1), np.bool_), where="x"))
    assert mapper.frames == 5 and len(mapper.objects) == 5


def test_detections_without_features_are_matched_by_place() -> None:
    mapper = Mapper()
    for index in range(8):
        frame, found = room_frame(index)
        mapper.step(frame, dataclasses.replace(found, features=None))
    assert len(mapper.scene("room").objects) == 5


def test_features_may_come_late_and_stay_away() -> None:
    mapper = Mapper()
    for index in range(9):
        frame, found = room_frame(index)
        mapper.step(frame, found if index % 3 == 1 else dataclasses.replace(found, features=None))
    for number in range(70):  # more objects than there is room for at first, none of them with features
        frame, _ = room_frame(0)
        masks = np.zeros((1, *frame.depth.shape), np.bool_)
        masks[0, 100:110, 2 * number : 2 * number + 10] = True
        mapper.step(frame, checked(masks, where="x", labels=[f"tile {number}"]))
    mapper.finish()
    check_scene(mapper.scene("room"))
    assert {"table", "box", "vase"} <= set(by_tag(mapper.scene("room")))


# -- fusing and care


def test_the_mean_feature_is_the_mean() -> None:
    mapper = mapped(5)
    unit = mapper.objects.features.unit("clip")
    assert unit is not None
    for at, obj in enumerate(mapper.objects.all):
        number = [box.name for box in ROOM].index(obj.label)
        expected = np.eye(5)[number] + 0.2
        np.testing.assert_allclose(unit[at], expected / np.linalg.norm(expected), atol=1e-5)


def test_halves_of_a_thing_are_merged_and_different_things_are_not() -> None:
    how = Mapping(tidying=tidy.Tidying(merge_every=0))
    mapper = mapped(6, how)
    before = len(mapper.objects)
    assert tidy.merge(mapper.objects, mapper.voxels, mapper.opinions, how.tidying, how.consensus) == 0
    # A second object of the same look, with half of the table's voxels.
    table = next(i for i, obj in enumerate(mapper.objects.all) if obj.label == "table")
    thing, other = mapper.objects.all[table], mapper.objects._born
    rows = np.flatnonzero((mapper.voxels.owners[: mapper.voxels.count] == thing.id).any(axis=1)).astype(np.int32)
    mapper.objects._add_new(dataclasses.replace(thing, id=other, n=3, views=[], labels=thing.labels.copy()))
    for sums in mapper.objects.features.sums().values():
        sums[before] = sums[table]
    mapper.objects.features._units.clear()
    half = rows[::2]
    mapper.voxels.vote(half, np.full(len(half), other, np.int32), np.full(len(half), 50, np.float32))
    assert tidy.merge(mapper.objects, mapper.voxels, mapper.opinions, how.tidying, how.consensus) == 1
    assert len(mapper.objects) == before
    assert set(np.unique(mapper.voxels.owners[: mapper.voxels.count])) <= {-1, *(obj.id for obj in mapper.objects.all)}


def test_voxels_are_found_wherever_they_are() -> None:
    voxels = Voxels(0.025)
    rng = np.random.default_rng(1)
    cells = np.unique(rng.integers(-40_000, 40_000, (500, 3)).astype(np.int32), axis=0)
    rows = voxels.make(cells)
    assert sorted(rows.tolist()) == list(range(len(cells)))
    np.testing.assert_array_equal(voxels.cells[rows], cells)
    np.testing.assert_array_equal(voxels.find(cells), rows)
    np.testing.assert_array_equal(voxels.make(cells), rows)
    assert (voxels.find(cells + np.int32(100_000)) == -1).all()
    gone = np.arange(0, len(cells), 3)
    held = voxels.cells[gone].copy()
    voxels.forget(gone)
    assert (voxels.find(held) == -1).all() and (voxels.find(cells) >= 0).sum() == len(cells) - len(gone)
    assert sorted(voxels.make(held).tolist()) == gone.tolist()
    np.testing.assert_array_equal(voxels.cells[voxels.find(held)], held)
    with pytest.raises(SceneError, match="km from"):
        voxels.cells_of(np.array([[1e6, 0, 0]], np.float32))


def test_a_voxel_remembers_the_strongest_claims() -> None:
    voxels = Voxels(0.1)
    row = voxels.make(np.zeros((1, 3), np.int32))
    for number, times in enumerate([5, 4, 3, 2]):
        for _ in range(times):
            voxels.vote(row, np.array([number], np.int32), np.array([4.0], np.float32))
    voxels.vote(row, np.array([7], np.int32), np.array([4.0], np.float32))
    assert set(voxels.owners[0].tolist()) == {0, 1, 2, 3}
    for _ in range(3):
        voxels.vote(row, np.array([7], np.int32), np.array([4.0], np.float32))
    assert 7 in voxels.owners[0].tolist() and 0 in voxels.owners[0].tolist()


def test_lifting_says_where_things_are() -> None:
    frame, found = room_frame(2)
    voxels = Voxels(0.025)
    lifted = lift(frame, found, voxels, Lifting(), np.zeros(len(found), np.bool_))
    at = found.labels.index("vase")
    k = lifted.source.tolist().index(at)
    assert np.abs(lifted.low[k] * 0.025 - np.array(ROOM[4].low)).max() < 0.12
    assert len(Objects()) == 0


# -- measuring


def test_nearest_is_the_nearest() -> None:
    rng = np.random.default_rng(2)
    points, among = rng.random((200, 3)).astype(np.float32), rng.random((300, 3)).astype(np.float32)
    distance, index = nearest(points, among, 0.2)
    every = np.linalg.norm(points[:, None] - among[None], axis=2)
    expected = every.min(axis=1)
    near = expected <= 0.2
    np.testing.assert_allclose(distance[near], expected[near], rtol=1e-5)
    np.testing.assert_array_equal(index[near], every.argmin(axis=1)[near])
    assert (index[~near] == -1).all()


def test_iou_of_boxes() -> None:
    low, high = np.array([[0, 0, 0]], np.int32), np.array([[1, 1, 1]], np.int32)
    other_low, other_high = np.array([[1, 0, 0], [4, 0, 0]], np.int32), np.array([[2, 1, 1], [5, 1, 1]], np.int32)
    np.testing.assert_allclose(iou(low, high, other_low, other_high), [[4 / 12, 0.0]])
    np.testing.assert_allclose(iou(low, high, other_low, other_high, generalised=True), [[4 / 12, -8 / 24]])


def test_an_upright_box_turns_with_its_thing() -> None:
    rng = np.random.default_rng(3)
    turn = np.array([[np.cos(0.5), -np.sin(0.5), 0], [np.sin(0.5), np.cos(0.5), 0], [0, 0, 1]])
    cloud = (rng.uniform(-0.5, 0.5, (4000, 3)) * [2.0, 0.5, 1.0]) @ turn.T + [1, 2, 3]
    center, extent, rotation = upright_box(cloud.astype(np.float32), "z")
    assert rotation is not None
    np.testing.assert_allclose(center, [1, 2, 3], atol=0.02)
    np.testing.assert_allclose(sorted(extent), [0.5, 1.0, 2.0], atol=0.03)
    np.testing.assert_allclose(np.linalg.det(rotation), 1.0)
    straight = upright_box((rng.uniform(-0.5, 0.5, (500, 3)) * [2.0, 0.5, 1.0]).astype(np.float32), "-y")
    assert straight[2] is None
    single = upright_box(np.zeros((1, 3), np.float32), "z")
    assert single[2] is None and (single[1] > 0).all()


def test_the_renderer_renders() -> None:
    frame, _ = room_frame(0)
    depth, which = render(frame.T_world_camera)
    assert set(np.unique(which)) >= {0, 1, 2, 3, 4} and depth.max() < 6


def test_the_real_frames_map_without_a_model(data: Path) -> None:
    pytest.importorskip("PIL.Image")
    recording = open_recording(data / "rgbd" / "RGBD")
    detector, mapper = GeometricDetector(up=recording.up), Mapper()
    for frame in recording.frames():
        mapper.step(frame, detector(frame))
    mapper.finish()
    scene = mapper.scene("room", up=recording.up)
    check_scene(scene)
    assert 5 <= len(scene.objects) <= 60
    assert {"wall", "floor"} & {obj.tag for obj in scene.objects}
    # An arm chair stands in the middle of the room: something of its size is found where it is seen in all frames.
    assert any(o.extent is not None and 0.3 < max(o.extent) < 1.2 and o.n_observations == 5 for o in scene.objects)


def test_columns_grow_and_large_spaces_give_the_same_map(monkeypatch: pytest.MonkeyPatch) -> None:
    usual = mapped(6)
    monkeypatch.setattr("cgdb.ingest.mapping.voxels._ROOM", 64)
    monkeypatch.setattr("cgdb.ingest.mapping.clusters._DENSE", 0)
    grown = mapped(6)
    assert len(grown.voxels.seen) < 1 << 20 < len(usual.voxels.seen)
    for one, other in zip(grown.scene("a").objects, usual.scene("a").objects, strict=True):
        assert one.points is not None and other.points is not None
        np.testing.assert_array_equal(one.points, other.points)


def test_voxels_know_what_is_beside_them_and_in_a_box() -> None:
    voxels = Voxels(0.025)
    rng = np.random.default_rng(2)
    cells = np.unique(rng.integers(-70, 70, (60_000, 3)).astype(np.int32), axis=0)
    rows = voxels.make(cells)
    around = voxels.around(rows)
    np.testing.assert_array_equal(around[0], rows)
    steps = [[1, 0, 0], [-1, 0, 0], [0, 1, 0], [0, -1, 0], [0, 0, 1], [0, 0, -1]]
    for face, step in enumerate(steps, start=1):
        np.testing.assert_array_equal(around[face], voxels.find(cells + np.array(step, np.int32)))
    low, high = np.array([-65, -10, 3], np.int32), np.array([-20, 10, 30], np.int32)
    inside = rows[((cells >= low) & (cells <= high)).all(axis=1)]
    found = voxels.within(low, high)
    assert len(inside) and np.isin(inside, found).all() and len(np.unique(found)) == len(found) < len(rows) / 4
    everywhere = voxels.within(np.full(3, -100_000, np.int32), np.full(3, 100_000, np.int32))
    assert np.isin(rows, everywhere).all()
    distinct, place = voxels.numbered(rows[[5, 3, 5, 9, 3]])
    assert len(distinct) == 3 and distinct[place].tolist() == rows[[5, 3, 5, 9, 3]].tolist()


def test_claims_that_meet_are_added_up_and_those_of_nobody_go() -> None:
    voxels = Voxels(0.1)
    row = voxels.make(np.zeros((1, 3), np.int32))
    for number, times in ((3, 5), (8, 2), (20, 1)):
        for _ in range(times):
            voxels.vote(row, np.array([number], np.int32), np.array([4.0], np.float32))
    voxels.rename(row, {8: 3, 20: -1, 50: 3})
    held = dict(zip(voxels.owners[0].tolist(), voxels.votes[0].tolist(), strict=True))
    assert held[3] == 28.0 and set(held) == {3, -1} and held[-1] == 0.0
