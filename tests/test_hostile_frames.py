"""Recordings, detections and truths of strangers: what is wrong with them is one line, whatever it is."""

from __future__ import annotations

import io
import json
import random
import zipfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image

from cgdb.errors import FormatError
from cgdb.ingest import arrays
from cgdb.ingest.detections import detections as rules
from cgdb.ingest.detections.detections import Selection, checked, select
from cgdb.ingest.detections.files import FileDetector
from cgdb.ingest.evaluation import labelled
from cgdb.ingest.frames import pictures
from cgdb.ingest.frames.archive import Archive
from cgdb.ingest.frames.recording import Frame, open_recording

POSE = "1 0 0 0 0 1 0 0 0 0 1 0 0 0 0 1"
HUGE = "1" + "0" * 400
RUNS = {"size": [48, 64], "counts": [48 * 64]}


@pytest.fixture
def frame() -> Frame:
    return Frame(
        index=0,
        name="f",
        timestamp=None,
        rgb=np.zeros((48, 64, 3), np.uint8),
        depth=np.ones((48, 64), np.float32),
        K=np.eye(3),
        T_world_camera=np.eye(4),
    )


@pytest.fixture
def masks() -> np.ndarray[Any, np.dtype[np.bool_]]:
    made = np.zeros((2, 48, 64), np.bool_)
    made[0, :20] = made[1, 5:15, 5:30] = True
    return made


# -- detections


@pytest.mark.parametrize(
    "wrong",
    [
        {"mask": np.array(True)},
        {"mask": np.full((2, 48, 64), "x")},
        {"conf": np.array(["a", "b"])},
        {"xyxy": np.full((2, 4), "a")},
        {"xyxy": np.full((2, 4), np.nan)},
        {"image_feats": np.full((2, 3), 1e300)},
    ],
    ids=lambda wrong: "-".join(f"{k} {v.dtype}" for k, v in wrong.items()),
)
def test_arrays_of_another_kind_make_a_bad_frame(
    wrong: dict[str, Any], masks: Any, frame: Frame, tmp_path: Path
) -> None:
    np.savez(tmp_path / "f.npz", **{"mask": masks, **wrong})
    with pytest.raises(FormatError):
        FileDetector(tmp_path, "arrays")(frame)


def test_boxes_end_where_the_picture_does(masks: Any, frame: Frame) -> None:
    found = checked(masks, where="f", xyxy=np.array([[-1e300, -5, 1e300, 1e300], [5.0, 5, 30, 15]]))
    assert found.xyxy.tolist() == [[0, 0, 64, 48], [5, 5, 30, 15]]
    assert len(select(found, frame, Selection(largest_share=1.0))) == 2


def test_confidences_and_features_beyond_float32_are_not_lost(masks: Any) -> None:
    found = checked(masks, where="f", confidence=np.array([1e300, 0.5]), features=np.full((2, 2), 3e38))
    assert found.confidence.tolist() == [1.0, 0.5]
    assert found.features is not None
    np.testing.assert_allclose(found.features, 2**-0.5, rtol=1e-6)


def coco(folder: Path, changes: dict[str, Any]) -> FileDetector:
    annotation = {"image_id": 1, "segmentation": RUNS, **changes.pop("annotation", {})}
    value = {"images": [{"id": 1, "file_name": "f.png"}], "annotations": [annotation], **changes}
    path = folder / "detections.json"
    path.write_text(json.dumps(value).replace('"HUGE"', HUGE))
    return FileDetector(path, "coco")


@pytest.mark.parametrize(
    "changes",
    [
        {"images": [{"id": [1], "file_name": "f.png"}]},
        {"annotation": {"image_id": [1]}},
        {"annotation": {"feature": ["HUGE"]}},
    ],
)
def test_coco_files_that_are_none_are_refused(changes: dict[str, Any], frame: Frame, tmp_path: Path) -> None:
    with pytest.raises(FormatError):
        coco(tmp_path, changes)(frame)


@pytest.mark.parametrize(
    "changes",
    [{"categories": None}, {"annotation": {"category_id": [1]}}, {"annotation": {"score": "HUGE"}}],
)
def test_coco_files_with_odd_extras_are_read(changes: dict[str, Any], frame: Frame, tmp_path: Path) -> None:
    found = coco(tmp_path, changes)(frame)
    assert found.labels == ("",) and found.confidence.tolist() == [1.0]


def test_run_lengths_that_would_fill_the_memory_are_refused_at_once(frame: Frame, tmp_path: Path) -> None:
    mask = {"image_id": 1, "segmentation": {"size": [8192, 8192], "counts": [8192 * 8192]}}
    with pytest.raises(FormatError, match="more than a frame can have"):
        coco(tmp_path, {"annotations": [mask] * 200})(frame)


def test_packed_and_labelled_masks_are_bounded(monkeypatch: pytest.MonkeyPatch, frame: Frame, tmp_path: Path) -> None:
    monkeypatch.setattr(rules, "MOST_PIXELS", 3 * 48 * 64)
    np.savez_compressed(tmp_path / "f.npz", mask=np.zeros((4, 48 * 64 // 8), np.uint8))
    with pytest.raises(FormatError, match="more than a frame can have"):
        FileDetector(tmp_path, "arrays")(frame)
    Image.fromarray(np.arange(48 * 64, dtype=np.uint8).reshape(48, 64) % 5).save(tmp_path / "f.png")
    with pytest.raises(FormatError, match="more than a frame can have"):
        FileDetector(tmp_path, "labels")(frame)


def test_class_ids_without_a_vector_make_a_bad_frame(masks: Any, frame: Frame, tmp_path: Path) -> None:
    (tmp_path / "gsa_classes_x.json").write_text('["cup", "sofa"]')
    np.savez(tmp_path / "objects.npz", text=np.eye(2, dtype=np.float32))
    (tmp_path / "det").mkdir()
    for ids, good in (([0, 1], True), ([0, 2], False), ([-1, 0], False)):
        np.savez(tmp_path / "det" / "f.npz", mask=masks, class_id=np.array(ids))
        detect = FileDetector(tmp_path / "det", "arrays")
        if good:
            assert detect(frame).labels == ("cup", "sofa")
        else:
            with pytest.raises(FormatError, match="class id"):
                detect(frame)


# -- recordings


def recording(folder: Path, **files: str) -> Callable[[], list[Frame]]:
    """A recording in the plain layout; files: texts by path, with __ for / and _DOT_ for a full stop."""
    meta = {"width": 64, "height": 48, "fx": 60, "fy": 60, "cx": 32, "cy": 24}
    texts = {"meta_DOT_json": json.dumps(meta), "pose__1_DOT_txt": POSE, **files}
    rgb, depth = np.zeros((48, 64, 3), np.uint8), np.full((48, 64), 1000, np.uint16)
    for name in ("rgb", "depth"):
        (folder / name).mkdir(parents=True, exist_ok=True)
        Image.fromarray(rgb if name == "rgb" else depth).save(folder / name / "1.png")
    for name, text in texts.items():
        path = folder / name.replace("__", "/").replace("_DOT_", ".")
        path.parent.mkdir(exist_ok=True)
        path.write_text(text)
    return lambda: list(open_recording(folder).frames())


def test_the_recording_that_the_others_break_is_whole(tmp_path: Path) -> None:
    assert len(recording(tmp_path, times_DOT_txt="1 0.5\n")()) == 1


@pytest.mark.parametrize(
    "files",
    [
        {"times_DOT_txt": "1 ,\n"},
        {
            "meta_DOT_json": '{"width": HUGE, "height": 48, "fx": 60, "fy": 60, "cx": 32, "cy": 24}'.replace(
                "HUGE", HUGE
            )
        },
        {"meta_DOT_json": '{"width": 1e999, "height": 48, "fx": 60, "fy": 60, "cx": 32, "cy": 24}'},
        {"pose__1_DOT_txt": "1e200 0 0 0 0 1e200 0 0 0 0 1 0 0 0 0 1"},
    ],
)
def test_numbers_that_are_none_or_too_large(files: dict[str, str], tmp_path: Path) -> None:
    with pytest.raises(FormatError):
        recording(tmp_path, **files)()


def test_other_layouts_with_numbers_that_are_none(tmp_path: Path) -> None:
    camera = "camera_params:\n image_height: 48\n image_width: 1e400\n fx: 60\n fy: 60\n cx: 32\n cy: 24\n"
    (tmp_path / "a" / "poses").mkdir(parents=True)
    (tmp_path / "a" / "dataconfig.yaml").write_text(camera)
    with pytest.raises(FormatError, match="image_width must be a number"):
        open_recording(tmp_path / "a")
    (tmp_path / "b").mkdir()
    for name, text in (("rgb", ", a.png\n"), ("depth", "1 b.png\n"), ("groundtruth", "1 0 0 0 0 0 0 1\n")):
        (tmp_path / "b" / f"{name}.txt").write_text(text)
    with pytest.raises(FormatError, match="has 0 numbers, expected one"):
        open_recording(tmp_path / "b")
    (tmp_path / "c").mkdir()
    np.save(tmp_path / "c" / "x_depth.npy", np.ones((48, 64), np.float32))
    Image.fromarray(np.zeros((48, 64, 3), np.uint8)).save(tmp_path / "c" / "x.png")
    (tmp_path / "c" / "x.json").write_text(
        '{"pose": [[HUGE,0,0,0],[0,1,0,0],[0,0,1,0],[0,0,0,1]]}'.replace("HUGE", HUGE)
    )
    with pytest.raises(FormatError, match="no matrix of numbers"):
        list(open_recording(tmp_path / "c").frames())


def test_pictures_that_would_be_handed_to_other_programs_are_none(tmp_path: Path) -> None:
    buffer = io.BytesIO()
    Image.new("RGB", (32, 32)).save(buffer, "EPS")  # Pillow runs Ghostscript to read it back
    (tmp_path / "1.png").write_bytes(buffer.getvalue())
    with pytest.raises(FormatError, match="no picture"):
        pictures.size_of(tmp_path / "1.png")


# -- archives


def mutated(data: bytes, rng: random.Random) -> bytes:
    changed = bytearray(data)
    for _ in range(rng.choice([1, 2, 5])):
        place = rng.randrange(len(changed))
        changed[place] = rng.randrange(256)
    return bytes(changed[: rng.randrange(1, len(changed) + 1)] if rng.random() < 0.2 else changed)


@pytest.mark.parametrize("method", [zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED, zipfile.ZIP_BZIP2, zipfile.ZIP_LZMA])
def test_damaged_archives_are_told(method: int, tmp_path: Path) -> None:
    part, buffer = io.BytesIO(), io.BytesIO()
    np.save(part, np.arange(300))
    with zipfile.ZipFile(buffer, "w", method) as made:
        made.writestr("points.npy", part.getvalue())
    rng, path, refused = random.Random(7), tmp_path / "a.npz", 0
    for _ in range(120):
        path.write_bytes(mutated(buffer.getvalue(), rng))
        for read in (
            lambda: arrays.of_archive(path),
            lambda: labelled.arrays_of(path),
            lambda: Archive(path).read("points.npy", 10**6),
        ):
            try:
                read()
            except FormatError:
                refused += 1
    assert refused > 100


def test_headers_that_are_no_python_are_told(tmp_path: Path) -> None:
    buffer, path, rng = io.BytesIO(), tmp_path / "a.npy", random.Random(3)
    np.save(buffer, np.zeros((4, 4)))
    refused = 0
    for _ in range(500):
        head = bytearray(buffer.getvalue())
        head[rng.randrange(10, 60)] = rng.choice(b"([{'\"\\, \n")
        path.write_bytes(bytes(head))
        try:
            arrays.of_file(path)
        except FormatError:
            refused += 1
    assert refused > 100
