"""Detections from files of every kind, and what is wrong with strangers' files."""

from __future__ import annotations

import gzip
import json
import pickle
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from cgdb.errors import FormatError, UsageError
from cgdb.ingest.detections.coco import mask_of, unpacked
from cgdb.ingest.detections.files import FileDetector, find_detections
from cgdb.ingest.frames.recording import Frame
from tests.mapping_rooms import room_frame

Image = pytest.importorskip("PIL.Image")


@pytest.fixture
def frame() -> Frame:
    return room_frame(0)[0]


def record() -> dict[str, Any]:
    _, found = room_frame(0)
    return {
        "xyxy": found.xyxy,
        "confidence": found.confidence,
        "class_id": np.arange(len(found)),
        "mask": found.masks,
        "classes": list(found.labels),
        "image_crops": [Image.new("RGB", (4, 4)) for _ in found.labels],
        "image_feats": found.features,
        "text_feats": found.features,
    }


def write_main(folder: Path, value: object) -> None:
    folder.mkdir(parents=True, exist_ok=True)
    with gzip.open(folder / "000000.pkl.gz", "wb") as file:
        pickle.dump(value, file)


def same_as_the_room(detector: FileDetector, frame: Frame, *, features: bool = True) -> None:
    _, found = room_frame(0)
    read = detector(frame)
    np.testing.assert_array_equal(read.masks, found.masks)
    assert read.labels == found.labels
    if features:
        assert read.features is not None and found.features is not None
        np.testing.assert_allclose(read.features, found.features)


def test_the_main_dialect(frame: Frame, tmp_path: Path) -> None:
    write_main(tmp_path / "gsa_detections_ram", record())
    detector = find_detections(tmp_path)
    assert detector is not None and detector.kind == "conceptgraphs-main"
    same_as_the_room(detector, frame)


@pytest.mark.parametrize("protocol", [2, 3, 4, 5])
def test_every_protocol_that_people_write(frame: Frame, tmp_path: Path, protocol: int) -> None:
    value = {**record(), "image_crops": [], "mask": np.asfortranarray(record()["mask"])}
    with gzip.open(tmp_path / "000000.pkl.gz", "wb") as file:
        pickle.dump(value, file, protocol=protocol)
    same_as_the_room(FileDetector(tmp_path, "conceptgraphs-main"), frame)


def test_the_ali_dialect(frame: Frame, tmp_path: Path) -> None:
    folder = tmp_path / "exps" / "s_detections" / "detections" / "000000"
    folder.mkdir(parents=True)
    for key, value in record().items():
        if isinstance(value, np.ndarray):
            np.savez(folder / f"{key}.npz", value)
        else:
            with gzip.open(folder / f"{key}.pkl.gz", "wb") as file:
                pickle.dump(value, file)
    detector = find_detections(tmp_path)
    assert detector is not None and detector.kind == "conceptgraphs-ali"
    same_as_the_room(detector, frame)


@pytest.mark.parametrize("packed", [True, False])
def test_plain_arrays(frame: Frame, tmp_path: Path, packed: bool) -> None:
    value = record()
    (tmp_path / "gsa_classes_none.json").write_text(json.dumps(value["classes"]))
    folder = tmp_path / "det"
    folder.mkdir()
    mask = np.packbits(value["mask"].reshape(len(value["mask"]), -1), axis=1) if packed else value["mask"]
    np.savez(
        folder / "000000.npz",
        mask=mask,
        xyxy=value["xyxy"],
        class_id=value["class_id"],
        image_feats=value["image_feats"],
    )
    detector = find_detections(tmp_path)
    assert detector is not None and detector.kind == "arrays"
    same_as_the_room(detector, frame)


def runs_of(mask: NDArray[np.bool_]) -> list[int]:
    flat = mask.T.reshape(-1)
    change = np.flatnonzero(np.diff(flat.astype(np.int8))) + 1
    runs = np.diff(np.r_[0, change, flat.size]).tolist()
    return [0, *runs] if flat[0] else runs


def packed_text(runs: list[int]) -> str:
    text = ""
    for i, run in enumerate(runs):
        number = run - runs[i - 2] if i > 2 else run
        while True:
            code, number = number & 31, number >> 5
            more = number != -1 if code & 16 else number != 0
            text += chr((code | 32 if more else code) + 48)
            if not more:
                break
    return text


def test_run_lengths_there_and_back() -> None:
    rng = np.random.default_rng(0)
    for _ in range(20):
        mask = rng.random((17, 23)) < 0.3
        runs = runs_of(mask)
        assert unpacked(packed_text(runs), "x") == runs
        np.testing.assert_array_equal(mask_of({"size": [17, 23], "counts": packed_text(runs)}, "x"), mask)
        np.testing.assert_array_equal(mask_of({"size": [17, 23], "counts": runs}, "x"), mask)


def test_coco_for_the_whole_recording_and_by_frame(frame: Frame, tmp_path: Path) -> None:
    _, found = room_frame(0)
    height, width = found.masks.shape[1:]
    assert found.features is not None
    annotations = [
        {
            "image_id": 7,
            "category_id": i,
            "score": 0.9,
            "segmentation": {"size": [height, width], "counts": packed_text(runs_of(mask))},
            "feature": found.features[i].tolist(),
        }
        for i, mask in enumerate(found.masks)
    ]
    whole = {
        "images": [{"id": 7, "file_name": "rgb/000000.png"}],
        "annotations": annotations,
        "categories": [{"id": i, "name": name} for i, name in enumerate(found.labels)],
    }
    (tmp_path / "detections.json").write_text(json.dumps(whole))
    detector = find_detections(tmp_path)
    assert detector is not None and detector.kind == "coco"
    same_as_the_room(detector, frame)
    folder = tmp_path / "by_frame"
    folder.mkdir()
    named = [{**item, "category_name": found.labels[i]} for i, item in enumerate(annotations)]
    (folder / "000000.json").write_text(json.dumps(named))
    same_as_the_room(FileDetector(folder, "coco"), frame)


def test_label_pictures(frame: Frame, tmp_path: Path) -> None:
    _, found = room_frame(0)
    picture = np.zeros(frame.depth.shape, np.uint16)
    for i, mask in enumerate(found.masks):
        picture[mask] = 300 + i
    folder = tmp_path / "labels"
    folder.mkdir()
    Image.fromarray(picture).save(folder / "000000.png")
    (folder / "labels.json").write_text(json.dumps({str(300 + i): name for i, name in enumerate(found.labels)}))
    detector = find_detections(tmp_path)
    assert detector is not None and detector.kind == "labels"
    same_as_the_room(detector, frame, features=False)


@pytest.mark.parametrize(
    ("change", "says"),
    [
        ({"image_feats": []}, "no image features"),
        ({"image_feats": np.full((5, 5), np.nan, np.float32)}, "NaN"),
        ({"image_feats": np.ones((2, 5), np.float32)}, "features of shape"),
        ({"class_id": np.zeros(2, np.int64)}, "class ids"),
        ({"mask": "none"}, "masks are no array"),
        ({"xyxy": np.zeros((1, 4), np.float32)}, "boxes"),
    ],
)
def test_a_record_that_does_not_go_together(frame: Frame, tmp_path: Path, change: dict[str, Any], says: str) -> None:
    write_main(tmp_path, {**record(), **change})
    with pytest.raises(FormatError, match=says):
        FileDetector(tmp_path, "conceptgraphs-main")(frame)


def test_a_frame_in_which_nothing_was_detected(frame: Frame, tmp_path: Path) -> None:
    write_main(tmp_path, {**record(), "mask": None, "image_feats": []})
    assert len(FileDetector(tmp_path, "conceptgraphs-main")(frame)) == 0


class Evil:
    def __reduce__(self) -> tuple[Any, ...]:
        return (print, ("this must not run",))


def test_a_hostile_pickle_runs_nothing(frame: Frame, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    write_main(tmp_path, {**record(), "more": Evil()})
    with pytest.raises(FormatError, match="refused"):
        FileDetector(tmp_path, "conceptgraphs-main")(frame)
    assert capsys.readouterr().out == ""


@pytest.mark.parametrize("keep", [0, 10, 1000])
def test_files_that_are_cut_off(frame: Frame, tmp_path: Path, keep: int) -> None:
    write_main(tmp_path, record())
    path = tmp_path / "000000.pkl.gz"
    path.write_bytes(path.read_bytes()[:keep])
    with pytest.raises(FormatError):
        FileDetector(tmp_path, "conceptgraphs-main")(frame)
    arrays = tmp_path / "000000.npz"
    np.savez(arrays, mask=record()["mask"])
    arrays.write_bytes(arrays.read_bytes()[:keep])
    with pytest.raises(FormatError, match="damaged"):
        FileDetector(tmp_path, "arrays")(frame)


@pytest.mark.parametrize("kind", ["arrays", "conceptgraphs-main", "conceptgraphs-ali", "coco", "labels"])
def test_a_frame_without_its_file(frame: Frame, tmp_path: Path, kind: str) -> None:
    with pytest.raises(FormatError, match="no detections for this frame"):
        FileDetector(tmp_path, kind)(frame)


@pytest.mark.parametrize(
    ("value", "says"),
    [
        ([[0, 0, 1, 1]], "polygon"),
        (None, "no segmentation"),
        ({"size": [4], "counts": [16]}, "height, width"),
        ({"size": [4, 4], "counts": [17]}, "17 pixels of 16"),
        ({"size": [4, 4], "counts": [-1, 17]}, "whole numbers"),
        ({"size": [4, 4], "counts": "\x01"}, "damaged"),
        ({"size": [4, 4], "counts": "P"}, "cut off"),
        ({"size": [10**9, 10**9], "counts": [10**18]}, "height, width"),
    ],
)
def test_masks_that_are_none(value: object, says: str) -> None:
    with pytest.raises(FormatError, match=says):
        mask_of(value, "x")


@pytest.mark.slow
def test_a_small_file_that_unfolds_without_end(frame: Frame, tmp_path: Path) -> None:
    import zipfile

    with zipfile.ZipFile(tmp_path / "000000.npz", "w", zipfile.ZIP_DEFLATED) as packed:
        header = (
            b"\x93NUMPY\x01\x00v\x00"
            + b"{'descr': '|u1', 'fortran_order': False, 'shape': (3000000000,), }".ljust(117)
            + b"\n"
        )
        with packed.open("mask.npy", "w", force_zip64=True) as part:
            part.write(header)
            for _ in range(2200):
                part.write(bytes(1 << 20))
    with pytest.raises(FormatError, match="unfolds to more than"):
        FileDetector(tmp_path, "arrays")(frame)


def test_what_cannot_be_found(tmp_path: Path) -> None:
    assert find_detections(tmp_path) is None
    with pytest.raises(UsageError, match="does not exist"):
        find_detections(tmp_path, path=tmp_path / "nowhere")
    with pytest.raises(UsageError, match="no kind"):
        find_detections(tmp_path, kind="coko")
    empty = tmp_path / "empty"
    empty.mkdir()
    with pytest.raises(FormatError, match="no detections of a known kind"):
        find_detections(tmp_path, path=empty)


def test_the_references_own_files(data: Path) -> None:
    folder = data / "maps" / "conceptgraphs" / "detections"
    blank = room_frame(0)[0]
    frames = [
        Frame(
            index=4,
            name=name,
            timestamp=None,
            rgb=np.zeros((480, 640, 3), np.uint8),
            depth=np.zeros((480, 640), np.float32),
            K=blank.K,
            T_world_camera=blank.T_world_camera,
        )
        for name in ("main_000004", "ali-dev_000004")
    ]
    one = FileDetector(folder, "conceptgraphs-main")(frames[0])
    two = FileDetector(folder, "conceptgraphs-ali")(frames[1])
    assert one.labels == two.labels == ("floor", "shelf")
    assert one.features is not None and one.features.shape == (2, 1024)
    np.testing.assert_array_equal(one.masks, two.masks)


def test_an_array_is_believed_as_far_as_its_bytes_go(frame: Frame, tmp_path: Path) -> None:
    """Headers that announce terabytes, objects, or bytes that are no truth values."""
    import zipfile

    def packed(shape: str, kind: str = "|b1", data: bytes = b"") -> None:
        header = f"{{'descr': '{kind}', 'fortran_order': False, 'shape': {shape}, }}".ljust(117) + "\n"
        with zipfile.ZipFile(tmp_path / "000000.npz", "w") as archive:
            archive.writestr("mask.npy", b"\x93NUMPY\x01\x00v\x00" + header.encode() + data)

    detector = FileDetector(tmp_path, "arrays")
    for shape, kind in (("(1000, 1000000, 1000000)", "|b1"), ("(-1, 4, 4)", "|b1"), ("(1, 2, 2)", "|O"), ("x", "|b1")):
        packed(shape, kind, bytes(16))
        with pytest.raises(FormatError, match="damaged"):
            detector(frame)
    height, width = frame.depth.shape
    packed(f"(1, {height}, {width})", data=bytes([7]) * (height * width))
    masks = detector(frame).masks
    assert masks.all() and set(np.unique(masks.view(np.uint8))) == {1}


def test_masks_of_another_shape_are_one_bad_frame(frame: Frame, tmp_path: Path) -> None:
    from cgdb.ingest.detections.detections import Selection, select

    for shape in ((2, 50, 160), (2, 120)):
        np.savez(tmp_path / "000000.npz", mask=np.ones(shape, bool))
        with pytest.raises(FormatError, match=r"do not fit|have shape"):
            select(FileDetector(tmp_path, "arrays")(frame), frame, Selection())
    np.savez(tmp_path / "000000.npz", mask=np.ones((2, 77), np.uint8))
    with pytest.raises(FormatError, match="packed masks of another size"):
        FileDetector(tmp_path, "arrays")(frame)
    whole = {"images": [{"id": 1, "file_name": "000000.png"}], "annotations": []}
    whole["annotations"] = [
        {"image_id": 1, "segmentation": {"size": [4, 4], "counts": [16]}},
        {"image_id": 1, "segmentation": {"size": [4, 8], "counts": [32]}},
    ]
    (tmp_path / "detections.json").write_text(json.dumps(whole))
    with pytest.raises(FormatError, match="several sizes"):
        FileDetector(tmp_path / "detections.json", "coco")(frame)


def test_features_that_some_detections_lack(frame: Frame, tmp_path: Path) -> None:
    mask = {"size": [4, 4], "counts": [0, 16]}
    image = {"images": [{"id": 1, "file_name": "000000.png"}]}
    path = tmp_path / "detections.json"
    for second in ({}, {"feature": [1.0]}, {"feature": ["a", "b"]}, {"feature": [1.0, None]}):
        listed = [{"image_id": 1, "segmentation": mask, "feature": [1.0, 2.0]}]
        listed.append({"image_id": 1, "segmentation": mask, **second})
        path.write_text(json.dumps({**image, "annotations": listed}))
        with pytest.raises(FormatError, match=r"another dimension|other than numbers|NaN"):
            FileDetector(path, "coco")(frame)


def test_all_dialects_give_the_same_map(tmp_path: Path) -> None:
    """The same detections of a walk round a table, as each tool would leave them, make the same objects."""
    from cgdb.ingest.mapping.mapper import Mapper

    images, annotations = [], []
    for index in range(6):
        frame, found = room_frame(index)
        assert found.features is not None
        value = {**record(), "xyxy": found.xyxy, "confidence": found.confidence, "mask": found.masks}
        value |= {"class_id": np.arange(len(found)), "classes": list(found.labels), "image_feats": found.features}
        value |= {"text_feats": [], "image_crops": [Image.new("RGB", (4, 4)) for _ in found.labels]}
        (tmp_path / "main").mkdir(exist_ok=True)
        with gzip.open(tmp_path / "main" / f"{frame.name}.pkl.gz", "wb") as file:
            pickle.dump(value, file)
        ali = tmp_path / "ali" / frame.name
        ali.mkdir(parents=True)
        for key, item in {**value, "edges": [("1", "on", "2")], "labels": ["table 1"]}.items():
            if isinstance(item, np.ndarray):
                np.savez(ali / f"{key}.npz", item)
            else:
                with gzip.open(ali / f"{key}.pkl.gz", "wb") as file:
                    pickle.dump(item, file)
        images.append({"id": index, "file_name": f"color/{frame.name}.jpg"})
        annotations += [
            {
                "image_id": index,
                "category_name": label,
                "score": float(score),
                "feature": feature.tolist(),
                "segmentation": {"size": list(mask.shape), "counts": packed_text(runs_of(mask))},
            }
            for mask, label, score, feature in zip(
                found.masks, found.labels, found.confidence, found.features, strict=True
            )
        ]
    (tmp_path / "coco.json").write_text(json.dumps({"images": images, "annotations": annotations}))
    maps = []
    for kind, name in (("conceptgraphs-main", "main"), ("conceptgraphs-ali", "ali"), ("coco", "coco.json")):
        detector, mapper = FileDetector(tmp_path / name, kind), Mapper()
        for index in range(6):
            frame, _ = room_frame(index)
            mapper.step(frame, detector(frame))
        mapper.finish()
        maps.append(mapper.scene("room").objects)
    assert len(maps[0]) >= 4
    for other in maps[1:]:
        assert [obj.tag for obj in other] == [obj.tag for obj in maps[0]]
        for one, two in zip(maps[0], other, strict=True):
            np.testing.assert_array_equal(one.points, two.points)
            np.testing.assert_allclose(one.features["clip"], two.features["clip"], atol=1e-6)
