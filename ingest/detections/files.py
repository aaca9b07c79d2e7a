"""Detections that were made earlier, from files: the reference's in both dialects, COCO, label pictures, plain arrays.

A folder of detections has one file (or folder) per frame, called as the frame is. Files are strangers': the reference's
are pickles, which are read by the machine that calls nothing, with masks let through.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from cgdb.errors import FormatError, UsageError, did_you_mean
from cgdb.ingest import arrays, gunzip, strict_json
from cgdb.ingest.detections import frame_pickles
from cgdb.ingest.detections.coco import CocoFile
from cgdb.ingest.detections.detections import Detections, check_room, checked
from cgdb.ingest.frames import pictures, poses
from cgdb.ingest.frames.recording import Frame

DEFAULT_ENCODER = "open_clip:ViT-H-14:laion2b_s32b_b79k"


class FileDetector:
    """A detector that looks its answers up. kind: one of KINDS."""

    def __init__(self, path: Path, kind: str, *, encoder: str | None = None) -> None:
        self.name = f"{kind} files in {path.name}"
        self.kind = kind
        self.encoder = encoder
        self._read: Callable[[Frame], Detections] = KINDS[kind](path)

    def __call__(self, frame: Frame) -> Detections:
        """The detections stored for the frame."""
        return self._read(frame)


def find_detections(
    recording: Path, *, path: Path | None = None, kind: str | None = None, encoder: str | None = None
) -> FileDetector | None:
    """The detections at path, or those that lie beside a recording where that is None; None where there are none."""
    if kind is not None and kind not in KINDS:
        raise UsageError(f"there is no kind of detections '{kind}'", hint=did_you_mean(kind, KINDS) or ", ".join(KINDS))
    if path is not None and not path.exists():
        raise UsageError(f"{path} does not exist")
    candidates = [path] if path is not None else _beside(recording)
    for candidate in candidates:
        found = kind or _kind_of(candidate)
        if found is not None:
            return FileDetector(candidate, found, encoder=encoder)
    if path is not None:
        raise FormatError(f"{path}: holds no detections of a known kind", hint=f"known are {', '.join(KINDS)}")
    return None


def _beside(recording: Path) -> list[Path]:
    """Where detections of a recording usually lie, those with the least to unpack first."""
    made = [recording / "det"]
    made += sorted(recording.glob("gsa_detections_*"))
    made += sorted(recording.glob("exp*/*/detections")) + sorted(recording.glob("exp*/detections"))
    made += [recording / "detections.json", recording / "labels"]
    return [path for path in made if path.exists()]


def _kind_of(path: Path) -> str | None:
    if path.is_file():
        return "coco" if path.suffix == ".json" else None
    first = next(iter(sorted(path.iterdir())), None)
    if first is None:
        return None
    if first.is_dir():
        return "conceptgraphs-ali" if (first / "mask.npz").is_file() else None
    endings = {".npz": "arrays", ".gz": "conceptgraphs-main", ".json": "coco", ".png": "labels"}
    names = [child for child in path.iterdir() if child.suffix in endings and child.name != "labels.json"]
    return endings[sorted(names)[0].suffix] if names else None


# Plain arrays: NAME.npz


def _arrays(folder: Path) -> Callable[[Frame], Detections]:
    """mask (n, h, w) bool or (n, h * w bits) packed, xyxy, conf, labels or class_id, image_feats, text_feats."""
    classes = _class_names(folder)
    text = _text_features(folder.parent / "objects.npz", len(classes))

    def read(frame: Frame) -> Detections:
        path = folder / f"{frame.name}.npz"
        held = arrays_of(path)
        if "mask" not in held:
            raise FormatError(f"{path.name}: holds no masks")
        mask = held["mask"]
        height, width = frame.depth.shape
        if mask.ndim == 2 and mask.dtype == np.uint8:
            if mask.shape[1] != (height * width + 7) // 8:
                raise FormatError(f"{path.name}: packed masks of another size than the frame's {width} x {height}")
            check_room(len(mask), height * width, path.name)
            mask = np.unpackbits(mask, axis=1, count=height * width).reshape(-1, height, width).view(np.bool_)
        ids = held.get("class_id")
        labels = _labels(ids, classes, len(mask) if mask.ndim else 0, path) if ids is not None else None
        if text is not None and ids is not None and len(ids) and not 0 <= ids.min() <= ids.max() < len(text):
            raise FormatError(f"{path.name}: a class id is not one of the {len(text)} classes")
        features = held.get("image_feats")
        return checked(
            mask,
            where=path.name,
            xyxy=held.get("xyxy"),
            confidence=held.get("conf", held.get("confidence")),
            labels=labels,
            features=features,
            text_features=text[ids] if text is not None and ids is not None and len(mask) else held.get("text_feats"),
        )

    return read


def arrays_of(path: Path) -> dict[str, NDArray[Any]]:
    """The arrays of a .npz file; never objects."""
    try:
        return arrays.of_archive(path)
    except FileNotFoundError as error:
        raise FormatError(f"{path.name}: there are no detections for this frame") from error


def _class_names(folder: Path) -> list[str]:
    """The names that class ids count in: gsa_classes_*.json beside the folder."""
    for path in sorted(folder.parent.glob("gsa_classes_*.json")):
        if path.name.endswith("_colors.json"):
            continue
        value = strict_json.parse(poses.text_of(path))
        if isinstance(value, list) and all(isinstance(name, str) for name in value):
            return value
    return []


def _text_features(path: Path, n: int) -> NDArray[np.float32] | None:
    if not n or not path.is_file():
        return None
    values = arrays_of(path).get("text")
    return values.astype(np.float32) if values is not None and values.ndim == 2 and len(values) == n else None


def _labels(ids: object, names: object, n: int, path: Path) -> list[str]:
    if not isinstance(ids, np.ndarray) or ids.dtype.kind not in "iu" or ids.shape != (n,):
        raise FormatError(f"{path.name}: {n} masks but other class ids")
    known = [str(name) for name in names] if isinstance(names, (list, tuple)) else []
    # "item" is what the reference calls everything when it has no classes.
    return ["" if not 0 <= i < len(known) or known[i] == "item" else known[i] for i in ids.tolist()]


# The reference's dialects


def _main(folder: Path) -> Callable[[Frame], Detections]:
    """NAME.pkl.gz: a gzipped pickle of a dictionary."""

    def read(frame: Frame) -> Detections:
        path = folder / f"{frame.name}.pkl.gz"
        if not path.is_file():
            raise FormatError(f"{path.name}: there are no detections for this frame")
        with gunzip.open_bounded(path) as file:
            value = frame_pickles.load(file, size=path.stat().st_size)
        if not isinstance(value, dict):
            raise FormatError(f"{path.name}: holds no dictionary of detections")
        return _of_record(value, path)

    return read


def _ali(folder: Path) -> Callable[[Frame], Detections]:
    """NAME/: a folder of KEY.npz and KEY.pkl.gz."""

    def read(frame: Frame) -> Detections:
        path = folder / frame.name
        if not path.is_dir():
            numbered = folder / f"{frame.index:06}"
            if not numbered.is_dir():
                raise FormatError(f"{path.name}: there are no detections for this frame")
            path = numbered
        value: dict[str, Any] = {}
        for key in ("mask", "xyxy", "confidence", "class_id", "image_feats", "text_feats", "classes"):
            if (path / f"{key}.npz").is_file():
                value[key] = next(iter(arrays_of(path / f"{key}.npz").values()), None)
            elif (path / f"{key}.pkl.gz").is_file():
                packed = path / f"{key}.pkl.gz"
                with gunzip.open_bounded(packed) as file:
                    value[key] = frame_pickles.load(file, size=packed.stat().st_size)
        return _of_record(value, path)

    return read


def _of_record(value: Mapping[Any, Any], path: Path) -> Detections:
    """A frame's dictionary in either dialect."""
    mask = value.get("mask")
    if mask is None or (isinstance(mask, np.ndarray) and not len(mask)):
        return checked(np.zeros((0, 1, 1), np.bool_), where=path.name)
    if not isinstance(mask, np.ndarray):
        raise FormatError(f"{path.name}: the masks are no array")
    held = {
        key: found if isinstance(found := value.get(key), np.ndarray) else None
        for key in ("xyxy", "confidence", "image_feats", "text_feats")
    }
    if held["image_feats"] is None or not held["image_feats"].size:
        raise FormatError(f"{path.name}: the detections have no image features")
    return checked(
        mask,
        where=path.name,
        xyxy=held["xyxy"],
        confidence=held["confidence"],
        labels=_labels(value.get("class_id"), value.get("classes"), len(mask), path),
        features=held["image_feats"],
        text_features=held["text_feats"],
    )


# COCO and label pictures


def _coco(path: Path) -> Callable[[Frame], Detections]:
    """One COCO file for the recording, or a folder of NAME.json with a list of annotations each."""
    whole = CocoFile.read(path) if path.is_file() else None

    def read(frame: Frame) -> Detections:
        if whole is not None:
            return whole.of(frame)
        return CocoFile.read_frame(path / f"{frame.name}.json", frame)

    return read


def _label_pictures(folder: Path) -> Callable[[Frame], Detections]:
    """NAME.png: each pixel the number of its segment, 0 for none; labels.json {"number": "name"} where there is one.

    Numbers need not mean the same from frame to frame.
    """
    table = folder / "labels.json"
    value = strict_json.parse(poses.text_of(table)) if table.is_file() else {}
    names = {str(key): str(name) for key, name in value.items()} if isinstance(value, dict) else {}

    def read(frame: Frame) -> Detections:
        path = folder / f"{frame.name}.png"
        if not path.is_file():
            raise FormatError(f"{path.name}: there are no detections for this frame")
        picture = pictures.raw(path)
        if picture.dtype.kind not in "iu":
            raise FormatError(f"{path.name}: a label picture must hold whole numbers")
        numbers = np.unique(picture)
        numbers = numbers[numbers > 0]
        if len(numbers) > 2000:
            raise FormatError(f"{path.name}: {len(numbers)} segments, which is no label picture")
        check_room(len(numbers), picture.size, path.name)
        masks = np.stack([picture == n for n in numbers]) if len(numbers) else np.zeros((0, *picture.shape), np.bool_)
        return checked(masks, where=path.name, labels=[names.get(str(n), "") for n in numbers.tolist()])

    return read


KINDS: dict[str, Callable[[Path], Callable[[Frame], Detections]]] = {
    "arrays": _arrays,
    "conceptgraphs-main": _main,
    "conceptgraphs-ali": _ali,
    "coco": _coco,
    "labels": _label_pictures,
}
"""{kind: what opens a place with such detections}."""
