"""The best views of a map in the making: which are kept, their crops, and what memory they take."""

from __future__ import annotations

import io
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import cgdb
from cgdb.cli.app import main
from cgdb.errors import FormatError, StoreError
from cgdb.ingest.mapping import checkpoint, crops
from cgdb.ingest.mapping.crops import Cropper, Crops
from cgdb.ingest.mapping.fuse import Objects
from cgdb.ingest.mapping.mapper import Mapper, Mapping
from cgdb.scene import SceneGraph, View, image_type
from tests.mapping_rooms import HEIGHT, ROOM, WIDTH, room_frame
from tests.test_mapping_cli import write_recording

Image = pytest.importorskip("PIL.Image")


def mapped(count: int = 12, how: Mapping | None = None, *, times: int = 1) -> Mapper:
    mapper = Mapper(how)
    for index in range(count * times):
        mapper.step(*room_frame(index % count, count))
    return mapper


def pixels(data: bytes | None) -> np.ndarray:
    assert data is not None
    return np.asarray(Image.open(io.BytesIO(data)))


def plain(scene: SceneGraph) -> list[list[tuple[object, ...]]]:
    return [[(v.frame, v.points, v.box, v.image, v.source) for v in obj.views] for obj in scene.objects]


# --- which views -----------------------------------------------------------------------------------------------------


def test_a_view_is_the_frame_the_pose_and_the_object_cut_out_of_it() -> None:
    scene = mapped().scene("room")
    for obj in scene.objects:
        for view in obj.views:
            frame, found = room_frame(view.frame, 12)
            assert view.source == frame.name
            assert view.T_world_camera is not None
            np.testing.assert_array_equal(view.T_world_camera, frame.T_world_camera)
            boxes = [box for box, label in zip(found.xyxy.tolist(), found.labels, strict=True) if label == obj.tag]
            assert list(view.box) in boxes
            left, top, right, bottom = view.box
            expected = (min(WIDTH, right + 20) - max(0, left - 20), min(HEIGHT, bottom + 20) - max(0, top - 20))
            shown = pixels(view.image)
            largest = 128 if obj.properties["background"] else 256
            scale = min(1.0, largest / max(expected))
            assert shown.shape == (round(expected[1] * scale), round(expected[0] * scale), 3)
            assert image_type(view.image or b"") == "image/jpeg"
    # The middle of what is cut out is the vase, in its colour.
    (vase,) = (obj for obj in scene.objects if obj.tag == "vase")
    shown = pixels(vase.views[0].image)
    middle = shown[shown.shape[0] // 2, shown.shape[1] // 2].astype(int)
    assert np.abs(middle - next(box.color for box in ROOM if box.name == "vase")).max() < 60


def test_the_best_of_all_that_were_seen_are_kept() -> None:
    every = mapped(how=Mapping(views=50, crops=False)).scene("room")
    few = mapped(how=Mapping(views=3)).scene("room")
    for all_of_it, best in zip(every.objects, few.objects, strict=True):
        assert len(all_of_it.views) == 12 and len(best.views) == 3 == best.properties["n_views"]
        ranked = sorted(((view.points, view.frame) for view in all_of_it.views), reverse=True)
        assert [(view.points, view.frame) for view in best.views] == ranked[:3]
        assert all(view.image is None for view in all_of_it.views)
        assert all(view.image is not None for view in best.views)


def test_the_same_frames_give_the_same_views() -> None:
    assert plain(mapped(6).scene("room")) == plain(mapped(6).scene("room"))


def test_objects_that_merge_keep_the_best_of_both() -> None:
    mapper = mapped(how=Mapping(views=4))
    objects = mapper.objects
    both = sorted([*objects.all[2].views, *objects.all[3].views], reverse=True)
    before = len(objects.crops)
    into = np.arange(len(objects))
    into[3] = 2
    objects.merge(into, mapper.voxels)
    assert sorted(objects.all[2].views, reverse=True) == both[:4]
    assert len(objects.crops) == before - 4
    for sighting in objects.all[2].views:
        assert sighting.crop is not None and image_type(objects.crops.get(sighting.crop)) == "image/jpeg"


def test_objects_that_go_take_their_crops_along() -> None:
    mapper = mapped(4)
    into = np.arange(len(mapper.objects))
    into[1:] = -1
    mapper.objects.merge(into, mapper.voxels)
    assert len(mapper.objects.crops) == len(mapper.objects.all[0].views) == 4


def test_a_detectors_box_outside_of_the_frame_is_brought_inside() -> None:
    mapper = Mapper()
    for index in range(4):
        frame, found = room_frame(index)
        wild = found.xyxy.copy()
        wild[:] = (WIDTH + 500, -40, -3, HEIGHT + 9000)
        mapper.step(frame, replace(found, xyxy=wild))
    for obj in mapper.scene("room").objects:
        assert {view.box for view in obj.views} == {(0.0, 0.0, float(WIDTH), float(HEIGHT))}


# --- crops -----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("box", [(0.0, 0.0, 0.0, 0.0), (159.5, 119.5, 160.0, 120.0), (160.0, 120.0, 160.0, 120.0)])
def test_a_box_without_room_still_gives_a_picture(box: tuple[float, float, float, float]) -> None:
    frame, _ = room_frame(0)
    assert pixels(Cropper(frame)(box)).size > 0


def test_large_crops_are_scaled_down() -> None:
    frame, _ = room_frame(0)
    large = replace(frame, rgb=np.repeat(np.repeat(frame.rgb, 8, 0), 8, 1))
    assert pixels(Cropper(large)((0.0, 0.0, 1280.0, 960.0))).shape == (192, 256, 3)
    assert pixels(Cropper(large)((0.0, 400.0, 1280.0, 401.0))).shape == (8, 256, 3)


def test_what_does_not_fit_in_memory_is_kept_in_a_file(monkeypatch: pytest.MonkeyPatch) -> None:
    within = plain(mapped(times=2).scene("room"))
    monkeypatch.setattr(crops.Crops.__init__, "__defaults__", (4000,))
    mapper = mapped(times=2)
    assert mapper.objects.crops._size <= 4000 and mapper.objects.crops._where
    assert plain(mapper.scene("room")) == within


def test_the_file_does_not_grow_with_what_was_dropped() -> None:
    rng = np.random.default_rng(0)
    held = Crops(in_memory=10_000)
    kept: dict[int, bytes] = {}
    for _ in range(2000):
        data = rng.bytes(int(rng.integers(1, 2000)))
        kept[held.keep(data)] = data
        while len(kept) > 40:
            gone = list(kept)[int(rng.integers(len(kept)))]
            del kept[gone]
            held.drop(gone)
        assert held._end <= 2 * held._live + 10_000
    assert len(held) == len(kept)
    assert {number: held.get(number) for number in kept} == kept


def test_a_full_disk_is_one_clear_line(monkeypatch: pytest.MonkeyPatch) -> None:
    def full(**_: object) -> object:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr("tempfile.TemporaryFile", full)
    held = Crops(in_memory=10)
    with pytest.raises(StoreError, match="No space left on device") as caught:
        held.keep(bytes(100))
    assert caught.value.hint and "--crops none" in caught.value.hint


# --- the state -------------------------------------------------------------------------------------------------------


def test_a_checkpoint_keeps_views_and_crops(tmp_path: Path) -> None:
    mapper, whole = mapped(6), mapped(6)
    checkpoint.save(mapper, tmp_path / "state.npz", {})
    again, _ = checkpoint.load(tmp_path / "state.npz", Mapping())
    assert plain(again.scene("room")) == plain(mapper.scene("room"))
    for index in range(6, 12):
        again.step(*room_frame(index))
        whole.step(*room_frame(index))
    assert plain(again.scene("room")) == plain(whole.scene("room"))


@pytest.mark.parametrize("damage", ["crops", "crop_ends", "poses", "order"])
def test_a_damaged_state_is_refused(tmp_path: Path, damage: str) -> None:
    path = tmp_path / "state.npz"
    checkpoint.save(mapped(4), path, {})
    with np.load(path) as held:
        arrays = {name: held[name] for name in held.files}
    if damage == "order":
        arrays["crop_ends"] = arrays["crop_ends"][::-1]
    else:
        arrays[damage] = arrays[damage][:-1]
    np.savez(path, **arrays)
    with pytest.raises(FormatError, match="damaged"):
        checkpoint.load(path, Mapping())


def test_no_sightings_at_all_can_be_kept(tmp_path: Path) -> None:
    checkpoint.save(Mapper(), tmp_path / "state.npz", {})
    again, _ = checkpoint.load(tmp_path / "state.npz", Mapping())
    assert isinstance(again.objects, Objects) and len(again.objects) == 0


# --- the command -----------------------------------------------------------------------------------------------------


@pytest.fixture
def recording(tmp_path: Path) -> Iterator[Path]:
    yield write_recording(tmp_path / "office")


def test_the_views_are_in_the_store(recording: Path, tmp_path: Path) -> None:
    store = tmp_path / "house.cgdb"
    assert main(["map", str(recording), "--into", str(store), "--quiet", "--every", "3"]) == 0
    with cgdb.open(store, text_encoder=None) as db:
        found = db.query("MATCH (o) WHERE o.n_views >= 8 RETURN o.id")
        assert len(found) == 5
        for (object_id,) in (row.values for row in found):
            assert isinstance(object_id, int)
            views: tuple[View, ...] = db.views(object_id)
            assert len(views) == 8 and views[0].points == max(view.points for view in views)
            assert all(view.image and view.T_world_camera is not None for view in views)
            assert views[0].source == f"{views[0].frame:06}"
        assert db.check() == ()


@pytest.mark.parametrize(("given", "count", "pictures"), [("none", 8, False), ("2", 2, True)])
def test_how_many_views_and_whether_with_pictures(
    recording: Path, tmp_path: Path, given: str, count: int, pictures: bool
) -> None:
    store = tmp_path / "house.cgdb"
    assert main(["map", str(recording), "--into", str(store), "--quiet", "--crops", given]) == 0
    with cgdb.open(store, text_encoder=None) as db:
        for obj in db.scene("office", views=True).objects:
            assert len(obj.views) == count
            assert all((view.image is not None) == pictures for view in obj.views)


@pytest.mark.parametrize("given", ["0", "51", "-1", "many", "1e1", ""])
def test_numbers_of_views_that_make_no_sense(
    recording: Path, tmp_path: Path, given: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["map", str(recording), "--into", str(tmp_path / "s.cgdb"), f"--crops={given}"]) == 2
    assert "--crops takes a number from 1 to 50, or none" in capsys.readouterr().err
