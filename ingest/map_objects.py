"""The object dictionaries of ConceptGraphs' map pickles, of both branches, to scene objects."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from cgdb.errors import FormatError, SceneError
from cgdb.ingest import corners, fields
from cgdb.ingest.report import Report
from cgdb.scene import FeatureSpace, ObjectId, PropertyValue, SceneObject, Vector

DEFAULT_ENCODER = "open_clip:ViT-H-14:laion2b_s32b_b79k"
DEFAULT_DIMENSION = 1024
SPACES = {"clip_ft": "clip", "text_ft": "clip_text"}
NO_CLASS = "item"
"""The one class of a map that was made without a vocabulary."""


class MapReader:
    """Reads the objects of one map: what they share (class names, encoder, spaces) and what each may be read once."""

    def __init__(self, report: Report, *, class_names: object = None, config: object = None) -> None:
        self.report = report
        self.spaces: dict[str, FeatureSpace] = {}
        self._class_names = class_names if isinstance(class_names, (list, tuple)) else ()
        self._config: Mapping[Any, Any] = config if isinstance(config, dict) else {}
        self._points_seen: dict[int, ObjectId] = {}
        self._vectors: dict[int, tuple[object, Vector]] = {}

    def read(
        self,
        record: Mapping[str, Any],
        object_id: ObjectId,
        *,
        tag: str | None = None,
        tags: Sequence[str] = (),
        caption: str | None = None,
        more: Mapping[str, PropertyValue] | None = None,
    ) -> SceneObject:
        """The object of a record. tag, tags, caption: what a language model said of it, before the detector's votes."""
        where = f"object #{object_id}"
        center, extent, rotation = self._box(record, where)
        points, colors = self._cloud(record, where, object_id)
        return SceneObject(
            id=object_id,
            tag=tag or self._voted(record, where),
            tags=tuple(tags),
            caption=caption,
            center=center,
            extent=extent,
            rotation=rotation,
            features=self._features(record, where),
            points=points,
            colors=colors,
            n_observations=fields.count(record.get("num_detections"), where, "num_detections"),
            confidence=_mean_confidence(record.get("conf")),
            properties={**self._properties(record), **(more or {})},
        )

    def _box(self, record: Mapping[str, Any], where: str) -> tuple[Any, Any, Any]:
        value = record.get("bbox_np")
        if value is None:
            self.report.warn(f"{where}: has no box")
            return None, None, None
        return corners.box(value, where, self.report)

    def _cloud(self, record: Mapping[str, Any], where: str, object_id: ObjectId) -> tuple[Any, Any]:
        """Points (n, 3) float32 m and colors (n, 3) uint8 RGB, from float64 m and 0..1."""
        points = record.get("pcd_np")
        if points is None or (isinstance(points, np.ndarray) and points.size == 0):
            return None, None
        other = self._points_seen.setdefault(id(points), object_id)
        if other != object_id:
            # A few bytes of a pickle can name one cloud in a million objects.
            raise FormatError(f"{where}: shares its point cloud with object #{other}")
        points = _numbers(points, where, "the point cloud")
        if points.ndim != 2 or points.shape[1] != 3:
            raise SceneError(f"{where}: points have shape {points.shape}, expected (n, 3)")
        with np.errstate(over="ignore"):
            points = points.astype(np.float32)
        colors = record.get("pcd_color_np")
        if colors is None or (isinstance(colors, np.ndarray) and colors.size == 0):
            return points, None
        colors = _numbers(colors, where, "the colors")
        if colors.shape != points.shape:
            raise SceneError(f"{where}: {len(points)} points but colors of shape {colors.shape}")
        if not np.isfinite(colors).all():
            raise SceneError(f"{where}: the colors hold NaN or infinite values")
        return points, np.rint(np.clip(colors, 0.0, 1.0) * 255.0).astype(np.uint8)

    def _features(self, record: Mapping[str, Any], where: str) -> dict[str, Vector]:
        found: dict[str, Vector] = {}
        for key, space in SPACES.items():
            value = record.get(key)
            if value is None or (isinstance(value, (list, np.ndarray)) and len(np.atleast_1d(value)) == 0):
                continue
            vector = self._vector(value, where, key)
            known = self.spaces.setdefault(
                space,
                FeatureSpace(name=space, dimension=len(vector), encoder=encoder_of(self._config, len(vector))),
            )
            if known.dimension != len(vector):
                raise SceneError(
                    f"{where}: feature '{space}' has {len(vector)} numbers, the ones before it {known.dimension}"
                )
            found[space] = vector
        return found

    def _vector(self, value: Any, where: str, key: str) -> Vector:
        # The value is kept beside its vector, or its id could be given to another one.
        known = self._vectors.get(id(value))
        if known is None:
            flat = value.reshape(-1) if isinstance(value, np.ndarray) and value.ndim == 2 and len(value) == 1 else value
            if isinstance(flat, np.ndarray) and flat.dtype.kind not in "fiu":
                raise FormatError(f"{where}: {key} must hold numbers, not {flat.dtype}")
            known = self._vectors[id(value)] = (value, fields.vector(flat, where, key))
        return known[1]

    def _voted(self, record: Mapping[str, Any], where: str) -> str | None:
        """The class that most detections saw; the first of them where the vote is even."""
        names = record.get("class_name")
        if isinstance(names, str):
            return fields.text(names, where, "class_name")
        if not isinstance(names, (list, tuple)) or not names:
            known = range(len(self._class_names))
            names = [self._class_names[i] for i in _listed(record.get("class_id")) if type(i) is int and i in known]
        votes = Counter(name for name in names if isinstance(name, str))
        if not votes:
            return None
        name = fields.text(votes.most_common(1)[0][0], where, "class_name")
        return None if name == NO_CLASS else name

    def _properties(self, record: Mapping[str, Any]) -> dict[str, PropertyValue]:
        found: dict[str, PropertyValue] = {}
        if isinstance(record.get("is_background"), (bool, int)):
            # Merging adds truth values up: 2 is as true as 1.
            found["background"] = bool(record["is_background"])
        views = {view for view in _listed(record.get("image_idx")) if type(view) is int}
        if views:
            found["n_views"] = len(views)
        return found


def encoder_of(config: Mapping[Any, Any], dimension: int) -> str | None:
    """The CLIP that made a map's features: what its configuration names, else the default where the dimension fits."""
    model, weights = config.get("clip_model"), config.get("clip_pretrained")
    if isinstance(model, str):
        return f"open_clip:{model}:{weights}"[:200] if isinstance(weights, str) else None
    return DEFAULT_ENCODER if dimension == DEFAULT_DIMENSION else None


def is_map_object(value: object) -> bool:
    """Has a pickle's value the keys that every map object of either branch has?"""
    return isinstance(value, dict) and "bbox_np" in value and "pcd_np" in value


def records_of(value: object, what: str) -> list[dict[str, Any]]:
    """A list of object dictionaries, each its own; FormatError for anything else."""
    if not isinstance(value, list):
        raise FormatError(f"{what} must be a list, not {fields.shown(value)}")
    seen: set[int] = set()
    for position, record in enumerate(value):
        if not isinstance(record, dict):
            raise FormatError(f"{what} {position}: must be a dictionary, not {fields.shown(record)}")
        if id(record) in seen:
            raise FormatError(f"{what} {position}: is the same dictionary as one before it")
        seen.add(id(record))
    return value


def _numbers(value: object, where: str, what: str) -> NDArray[Any]:
    if not isinstance(value, np.ndarray) or value.dtype.kind not in "fiu":
        raise FormatError(f"{where}: {what} must be an array of numbers, not {fields.shown(value)}")
    return value


def _listed(value: object) -> Sequence[Any]:
    return value if isinstance(value, (list, tuple)) else ()


def _mean_confidence(value: object) -> float | None:
    """The mean of the detections' confidences; SAM's quality estimates can exceed 1 by a little."""
    if not isinstance(value, (list, tuple)):
        return None
    known = [float(item) for item in value if isinstance(item, (int, float)) and not isinstance(item, bool)]
    known = [item for item in known if np.isfinite(item)]
    return min(1.0, max(0.0, sum(known) / len(known))) if known else None
