"""The objects of a map that is being made: what each has been seen to be, and how a detection is folded into one."""

from __future__ import annotations

import heapq
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from cgdb.ingest.detections.detections import Detections
from cgdb.ingest.detections.overlap import within
from cgdb.ingest.frames.recording import Frame
from cgdb.ingest.mapping.crops import LONGEST, LONGEST_OF_ROOM, Cropper, Crops, packed
from cgdb.ingest.mapping.features import Features
from cgdb.ingest.mapping.lift import STRONG, Lifted
from cgdb.ingest.mapping.oriented import outermost
from cgdb.ingest.mapping.voxels import Ints, Voxels

VIEWS = 10


@dataclass(frozen=True, slots=True, order=True)
class Sighting:
    """A detection of an object, ordered by how many pixels of the depth picture show it free of noise.

    box: left, top, right, bottom in pixels of the frame as it was mapped. pose: (4, 4) float64 T_world_camera.
    crop: its number among the crops, None without.
    """

    points: int
    frame: int
    box: tuple[float, float, float, float]
    name: str = field(compare=False)
    pose: NDArray[np.float64] = field(compare=False)
    crop: int | None = field(compare=False, default=None)


@dataclass(slots=True, kw_only=True)
class MapObject:
    """An object so far. low, high (3,): its box in cells; n: detections; views: the best, a heap.

    within: whether its first detection's box lay in another's. widest: voxels of it that were seen at once.
    extremes (26, 3) int32: its outermost cells, where boxes are turned with their things.
    """

    id: int
    low: Ints
    high: Ints
    background: bool
    within: bool = False
    first: int
    last: int
    n: int = 0
    widest: int = 0
    confidence: float = 0.0
    labels: Counter[str] = field(default_factory=Counter)
    views: list[Sighting] = field(default_factory=list)
    extremes: Ints | None = None

    @property
    def label(self) -> str:
        """The name that most detections gave it; the first of them where the vote is even."""
        return max(self.labels, key=lambda name: self.labels[name], default="")


class Objects:
    """The objects, by position, with their features and crops."""

    def __init__(self, *, renormalise: bool = False, views: int = VIEWS, crops: bool = True) -> None:
        """views: the best sightings that are kept of each. crops: whether they are kept as pictures too."""
        self.all: list[MapObject] = []
        self.features = Features(renormalise=renormalise)
        self.crops = Crops()
        self._views, self._with_crops = views, crops
        self._born = 0
        self._background: dict[str, int] = {}

    def __len__(self) -> int:
        return len(self.all)

    def places(self) -> Ints:
        """The position of each object by its id, -1 where there is none, and at the end, where -1 looks."""
        found = np.full(self._born + 1, -1, np.int32)
        found[self.ids(np.arange(len(self.all)))] = np.arange(len(self.all), dtype=np.int32)
        return found

    def ids(self, at: NDArray[np.integer]) -> Ints:
        """The ids of the objects at positions (k,)."""
        return np.array([self.all[i].id for i in at.tolist()], np.int32)

    def fuse(
        self, frame: Frame, found: Detections, lifted: Lifted, matches: NDArray[np.intp], background: NDArray[np.bool_]
    ) -> Ints:
        """Fold each detection into the object at matches (k,), or into a new one where that is -1.

        The positions (k,) int32 where they went. background (k,): which are of a class with one object for all.
        """
        went = np.empty(len(lifted), np.int32)
        cropper = Cropper(frame) if self._with_crops else None
        inside = within(found.xyxy)
        for k, source in enumerate(lifted.source.tolist()):
            label = found.labels[source]
            at = int(matches[k])
            if background[k]:
                at = self._background.get(label, -1)
            if at < 0:
                at = len(self.all)
                self._add_new(
                    MapObject(
                        id=self._born,
                        low=lifted.low[k].copy(),
                        high=lifted.high[k].copy(),
                        background=bool(background[k]),
                        within=bool(inside[source]),
                        first=frame.index,
                        last=frame.index,
                    )
                )
                if background[k]:
                    self._background[label] = at
            self._add(at, frame, found, source, lifted, k, cropper)
            went[k] = at
        return went

    def _add_new(self, obj: MapObject) -> None:
        self.all.append(obj)
        self._born += 1
        self.features.append()

    def _add(
        self, at: int, frame: Frame, found: Detections, source: int, lifted: Lifted, k: int, cropper: Cropper | None
    ) -> None:
        obj = self.all[at]
        self.features.add(at, found, source, obj.n)
        obj.n += 1
        obj.widest = max(obj.widest, int(lifted.solid[k]))
        obj.confidence += float(found.confidence[source])
        if found.labels[source]:
            obj.labels[found.labels[source]] += 1
        obj.last = frame.index
        np.minimum(obj.low, lifted.low[k], out=obj.low)
        np.maximum(obj.high, lifted.high[k], out=obj.high)
        if lifted.extremes is not None:
            obj.extremes = outermost(obj.extremes, lifted.extremes[k])
        self._see(obj, int(lifted.points[k]), frame, _in_picture(found.xyxy[source], frame), cropper)

    def _see(
        self,
        obj: MapObject,
        points: int,
        frame: Frame,
        box: tuple[float, float, float, float],
        cropper: Cropper | None,
    ) -> None:
        """Keep a sighting if it is among the best; only then is it worth a picture."""
        sighting = Sighting(points, frame.index, box, frame.name, frame.T_world_camera)
        full = len(obj.views) >= self._views
        if full and (not obj.views or sighting <= obj.views[0]):
            return
        if cropper is not None:
            picture = cropper(box, LONGEST_OF_ROOM if obj.background else LONGEST)
            sighting = replace(sighting, crop=self.crops.keep(picture))
        if full:
            self.crops.drop(heapq.heapreplace(obj.views, sighting).crop)
        else:
            heapq.heappush(obj.views, sighting)

    def to_record(self) -> dict[str, Any]:
        """Everything but the features, as plain values."""
        return {"born": self._born, "background": self._background, "all": [_record_of(obj) for obj in self.all]}

    def sights(self) -> dict[str, NDArray[Any]]:
        """The poses (m, 4, 4) and crops of all sightings, in the order of to_record; a crop that is none is empty."""
        seen = [sighting for obj in self.all for sighting in obj.views]
        data, ends = packed([b"" if one.crop is None else self.crops.get(one.crop) for one in seen])
        return {"poses": np.array([one.pose for one in seen]).reshape(-1, 4, 4), "crops": data, "crop_ends": ends}

    def fill(
        self, record: dict[str, Any], sums: dict[str, NDArray[np.float32]], sights: dict[str, NDArray[Any]]
    ) -> None:
        """Become what to_record, the sums of the features and sights told of."""
        poses, data, ends = sights["poses"], sights["crops"], sights["crop_ends"].tolist()
        if poses.shape != (len(ends), 4, 4) or [0, *ends] != sorted([0, *ends]) or (ends and ends[-1] != len(data)):
            raise ValueError("sightings that do not fit each other")
        if len(ends) != sum(len(value["views"]) for value in record["all"]):
            raise ValueError("sightings of another number of objects")
        self.crops = Crops()
        pictures = (data[start:end].tobytes() for start, end in zip([0, *ends[:-1]], ends, strict=True))
        numbers = (self.crops.keep(picture) if picture else None for picture in pictures)
        sights_of = zip(poses, numbers, strict=True)
        self.all = [_object_of(value, sights_of) for value in record["all"]]
        self._born = int(record["born"])
        if len({obj.id for obj in self.all}) < len(self.all) or not all(0 <= obj.id < self._born for obj in self.all):
            raise ValueError("objects of one number, or of one that was never given")
        self._background = {str(label): int(at) for label, at in record["background"].items()}
        self.features.become(sums, len(self.all))

    def adopt(self, objects: list[MapObject], sums: dict[str, NDArray[np.float32]]) -> None:
        """Become these objects, whose crops are kept here already; sums: of their features."""
        self.all = objects
        self.features.become(sums, len(objects))
        self._born = max((obj.id for obj in objects), default=-1) + 1
        self._background = {obj.label: at for at, obj in enumerate(objects) if obj.background}

    def merge(self, into: NDArray[np.intp], voxels: Voxels) -> None:
        """Fold each object i into object into[i] (itself: it stays; -1: it goes), here and in the voxels."""
        stays = np.flatnonzero(into == np.arange(len(self.all)))
        for i in np.flatnonzero(into < 0).tolist():
            for sighting in self.all[i].views:
                self.crops.drop(sighting.crop)
        for i in np.flatnonzero((into != np.arange(len(self.all))) & (into >= 0)).tolist():
            self._absorb(self.all[into[i]], self.all[i])
        number = np.full(len(self.all) + 1, -1, np.int32)
        number[stays] = np.arange(len(stays), dtype=np.int32)
        names = np.where(into >= 0, number[into], -1).astype(np.int32)
        gone = np.flatnonzero(into != np.arange(len(self.all))).tolist()
        boxes = [voxels.within(self.all[i].low, self.all[i].high) for i in gone]
        rows, _ = voxels.numbered(np.concatenate([np.zeros(0, np.int32), *boxes]))
        taker = {self.all[i].id: -1 if into[i] < 0 else self.all[into[i]].id for i in gone}
        if taker:
            voxels.rename(rows, taker)
        self.all = [self.all[i] for i in stays.tolist()]
        self.features.merge(into)
        self._background = {label: int(names[at]) for label, at in self._background.items() if names[at] >= 0}

    def _absorb(self, kept: MapObject, gone: MapObject) -> None:
        kept.low = np.minimum(kept.low, gone.low)
        kept.high = np.maximum(kept.high, gone.high)
        kept.extremes = outermost(kept.extremes, gone.extremes)
        kept.first, kept.last = min(kept.first, gone.first), max(kept.last, gone.last)
        kept.n += gone.n
        kept.widest = max(kept.widest, gone.widest)
        kept.confidence += gone.confidence
        kept.labels.update(gone.labels)
        both = sorted([*kept.views, *gone.views], reverse=True)
        for sighting in both[self._views :]:
            self.crops.drop(sighting.crop)
        kept.views = both[: self._views]
        heapq.heapify(kept.views)


def _in_picture(box: NDArray[np.float32], frame: Frame) -> tuple[float, float, float, float]:
    """A detector's box (4,) as left, top, right, bottom inside the frame, whatever the file made of it."""
    height, width = frame.depth.shape
    left, right = sorted(np.clip(box[0::2], 0, width).tolist())
    top, bottom = sorted(np.clip(box[1::2], 0, height).tolist())
    return left, top, right, bottom


def claims(lifted: Lifted, went: Ints) -> tuple[Ints, Ints, NDArray[np.float32]]:
    """The votes of a frame: rows ascending, the object, the strength; each pair once, at its strongest."""
    # All that a vote is, as one number; of those of one object in one voxel the strongest comes first.
    key = lifted.rows.astype(np.int64) << 32
    key |= (went.astype(np.int64) << 1).take(lifted.owner)
    key |= lifted.strength <= 1.0
    key.sort(kind="stable")
    first = np.ones(len(key), np.bool_)
    pair = key >> 1
    np.not_equal(pair[1:], pair[:-1], out=first[1:])
    key = key[first]
    strength = np.where(key & 1, np.float32(1.0), np.float32(STRONG))
    return (key >> 32).astype(np.int32), ((key >> 1) & 0x7FFFFFFF).astype(np.int32), strength


_PLAIN = ("id", "background", "within", "first", "last", "n", "widest", "confidence")


def _record_of(obj: MapObject) -> dict[str, Any]:
    """An object as plain values."""
    return {
        **{key: getattr(obj, key) for key in _PLAIN},
        "low": obj.low.tolist(),
        "high": obj.high.tolist(),
        "extremes": None if obj.extremes is None else obj.extremes.tolist(),
        "labels": dict(obj.labels),
        "views": [[one.points, one.frame, one.box, one.name] for one in obj.views],
    }


def _object_of(value: dict[str, Any], sights: Iterator[tuple[NDArray[np.float64], int | None]]) -> MapObject:
    """The object of plain values. sights: pose and crop of each of its sightings, and then of others'."""
    seen = [
        Sighting(int(points), int(frame), tuple(box), str(name), *next(sights))
        for points, frame, box, name in value["views"]
    ]
    heapq.heapify(seen)
    return MapObject(
        id=int(value["id"]),
        low=np.array(value["low"], np.int32),
        high=np.array(value["high"], np.int32),
        extremes=None if value["extremes"] is None else np.array(value["extremes"], np.int32).reshape(26, 3),
        background=bool(value["background"]),
        within=bool(value["within"]),
        first=int(value["first"]),
        last=int(value["last"]),
        n=int(value["n"]),
        widest=int(value["widest"]),
        confidence=float(value["confidence"]),
        labels=Counter({str(name): int(count) for name, count in value["labels"].items()}),
        views=seen,
    )
