"""Masks in COCO's JSON: run lengths down the columns, as a list or packed into text, and polygons refused by name."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from cgdb.errors import FormatError
from cgdb.ingest import strict_json
from cgdb.ingest.detections.detections import Detections, check_room, checked
from cgdb.ingest.frames import poses
from cgdb.ingest.frames.recording import LARGEST_SIDE, Frame


class CocoFile:
    """A COCO file of a whole recording: annotations by picture."""

    def __init__(self, by_name: dict[str, list[dict[str, Any]]], categories: dict[int, str]) -> None:
        self._by_name = by_name
        self._categories = categories

    @classmethod
    def read(cls, path: Path) -> CocoFile:
        """The file with "images" and "annotations"; FormatError where it is none."""
        value = strict_json.parse(poses.text_of(path))
        if not isinstance(value, dict) or not all(isinstance(value.get(k), list) for k in ("images", "annotations")):
            raise FormatError(f"{path}: must hold 'images' and 'annotations'")
        stems: dict[Any, str] = {}
        for image in value["images"]:
            if isinstance(image, dict) and isinstance(image.get("file_name"), str) and _is_id(image.get("id")):
                stems[image["id"]] = Path(image["file_name"]).stem
        by_name: dict[str, list[dict[str, Any]]] = {stem: [] for stem in stems.values()}
        for annotation in value["annotations"]:
            known = isinstance(annotation, dict) and _is_id(annotation.get("image_id"))
            stem = stems.get(annotation["image_id"]) if known else None
            if stem is None:
                raise FormatError(f"{path}: an annotation belongs to no image")
            by_name[stem].append(annotation)
        listed = value.get("categories")
        categories = {
            c["id"]: c["name"]
            for c in (listed if isinstance(listed, list) else ())
            if isinstance(c, dict) and isinstance(c.get("id"), int) and isinstance(c.get("name"), str)
        }
        return cls(by_name, categories)

    @classmethod
    def read_frame(cls, path: Path, frame: Frame) -> Detections:
        """The detections of a file that lists one frame's annotations."""
        if not path.is_file():
            raise FormatError(f"{path.name}: there are no detections for this frame")
        value = strict_json.parse(poses.text_of(path))
        listed = value.get("annotations") if isinstance(value, dict) else value
        if not isinstance(listed, list) or not all(isinstance(item, dict) for item in listed):
            raise FormatError(f"{path.name}: must hold a list of annotations")
        return cls({frame.name: listed}, {}).of(frame)

    def of(self, frame: Frame) -> Detections:
        """The detections of a frame; FormatError where the file says nothing of it."""
        if frame.name not in self._by_name:
            raise FormatError(f"{frame.name}: there are no detections for this frame")
        listed = self._by_name[frame.name]
        masks: list[NDArray[np.bool_]] = []
        for i, item in enumerate(listed):
            masks.append(mask_of(item.get("segmentation"), f"{frame.name}: annotation {i}"))
            check_room(len(listed), masks[-1].size, frame.name)
            if masks[-1].shape != masks[0].shape:
                raise FormatError(f"{frame.name}: masks of several sizes")
        with_features = [item for item in listed if isinstance(item.get("feature"), list)]
        return checked(
            np.stack(masks) if masks else np.zeros((0, *frame.depth.shape), np.bool_),
            where=frame.name,
            confidence=np.array([_score(item) for item in listed], np.float32),
            labels=[self._name(item) for item in listed],
            features=_features(with_features, len(listed), frame.name),
        )

    def _name(self, item: dict[str, Any]) -> str:
        name = item.get("category_name", item.get("category", item.get("label")))
        number = item.get("category_id")
        return name if isinstance(name, str) else self._categories.get(number, "") if isinstance(number, int) else ""


def mask_of(value: object, where: str) -> NDArray[np.bool_]:
    """(h, w) bool of {"size": [h, w], "counts": run lengths}."""
    if isinstance(value, list):
        raise FormatError(f"{where}: is a polygon; masks as run lengths (RLE) are read")
    if not isinstance(value, dict):
        raise FormatError(f"{where}: has no segmentation")
    size, counts = value.get("size"), value.get("counts")
    if not (isinstance(size, list) and len(size) == 2 and all(type(s) is int and 0 < s <= LARGEST_SIDE for s in size)):
        raise FormatError(f"{where}: the size of its mask must be [height, width]")
    height, width = size
    runs = unpacked(counts, where) if isinstance(counts, str) else counts
    if not isinstance(runs, list) or not all(type(run) is int and run >= 0 for run in runs):
        raise FormatError(f"{where}: the run lengths of its mask are no whole numbers")
    if sum(runs) != height * width:
        raise FormatError(f"{where}: its run lengths cover {sum(runs)} pixels of {height * width}")
    flat = np.repeat(np.arange(len(runs)) % 2 == 1, runs)
    return flat.reshape(width, height).T


def unpacked(text: str, where: str) -> list[int]:
    """The run lengths in COCO's text: six bits a character, five of them payload, each but three as a difference."""
    runs: list[int] = []
    number, shift = 0, 0
    for character in text:
        code = ord(character) - 48
        if not 0 <= code < 64 or shift > 30:
            raise FormatError(f"{where}: the packed run lengths of its mask are damaged")
        number |= (code & 31) << shift
        shift += 5
        if code & 32:
            continue
        if code & 16:
            number -= 1 << shift
        runs.append(number + (runs[-2] if len(runs) > 2 else 0))
        number, shift = 0, 0
    if shift:
        raise FormatError(f"{where}: the packed run lengths of its mask are cut off")
    return runs


def _score(item: dict[str, Any]) -> float:
    for key in ("score", "predicted_iou", "confidence"):
        if isinstance(item.get(key), (int, float)):
            return float(min(max(item[key], 0), 1))
    return 1.0


def _is_id(value: object) -> bool:
    return isinstance(value, (int, str))


def _features(items: list[dict[str, Any]], n: int, where: str) -> NDArray[np.float64] | None:
    if not items:
        return None
    if len(items) != n or len({len(item["feature"]) for item in items}) > 1:
        raise FormatError(f"{where}: some detections have features and some have not, or of another dimension")
    try:
        return np.array([item["feature"] for item in items], dtype=np.float64)
    except (TypeError, ValueError, OverflowError) as error:
        raise FormatError(f"{where}: a feature holds something other than numbers") from error
