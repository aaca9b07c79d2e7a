"""One record of a plain map ({id, caption, ...}) to an object, its room and the relation to it.

The names that files in the wild use for the same thing are taken in the order of the tables below.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from cgdb.errors import FormatError, SceneError
from cgdb.ingest import fields
from cgdb.ingest.report import Report
from cgdb.scene import FeatureSpace, ObjectId, Place, Relation, SceneObject, Vector

IDS = ("id", "object_id", "obj_id")
CAPTIONS = ("caption", "object_caption", "description", "text", "summary")
TAGS = ("object_tag", "tag", "name", "label", "class_name", "category", "class")
TAG_LISTS = ("tags", "possible_tags")
CENTERS = ("bbox_center", "center", "centroid", "position")
EXTENTS = ("bbox_extent", "extent", "size", "dimensions", "bbox_size")
COUNTS = ("n_observations", "num_detections")
VECTORS = ("embedding", "feature", "vector")
NESTED = ("properties", "attributes")
ENDS = ("source", "target", "label")
VECTOR_SPACE = "vector"


@dataclass(frozen=True, slots=True, kw_only=True)
class Read:
    """What one record says: an object, and the name of the room that it stands in."""

    object: SceneObject
    room: str | None = None


def is_relation(record: Mapping[str, Any]) -> bool:
    """Does the record tell a relation rather than an object?"""
    return all(key in record for key in ENDS)


def read_object(record: Mapping[str, Any], position: int, report: Report) -> Read | None:
    """The object of a record, or None where the map itself says that it is none. position: the record's, from 0."""
    taken: set[str] = set()
    raw_id = _first(record, IDS, taken)
    if raw_id is None:
        report.warn("there are records without an id: their position in the file is their id")
        raw_id = position
    object_id = fields.node_id(raw_id, f"record {position}")
    where = f"object #{object_id}"
    caption = fields.text(_first(record, CAPTIONS, taken), where, "the caption")
    tag = fields.text(_first(record, TAGS, taken), where, "the tag")
    if "invalid" in ((caption or "").casefold(), (tag or "").casefold()):
        report.drop("objects that the map calls invalid")
        return None
    center = fields.triple(_first(record, CENTERS, taken), where, "the center")
    extent = fields.extent(_first(record, EXTENTS, taken), where, "the extent", report)
    if center is None and extent is not None:
        raise SceneError(f"{where}: has a box extent but no center")
    rotation = _rotation(_first(record, ("rotation",), taken), where)
    room = record.get("room")
    if isinstance(room, str):
        taken.add("room")
    tags = [tag for key in TAG_LISTS for tag in fields.texts(_first(record, (key,), taken), where, f"'{key}'")]
    return Read(
        object=SceneObject(
            id=object_id,
            tag=tag,
            tags=tuple(dict.fromkeys(tags)),
            caption=caption,
            center=center,
            extent=extent,
            rotation=rotation if extent is not None else None,
            features=read_features(record, where, taken),
            n_observations=fields.count(_first(record, COUNTS, taken), where, "the number of observations"),
            confidence=fields.confidence(_first(record, ("confidence",), taken), where),
            properties=_properties(record, taken, where, report),
        ),
        room=fields.text(room, where, "the room") if isinstance(room, str) else None,
    )


def read_features(record: Mapping[str, Any], where: str, taken: set[str]) -> dict[str, Vector]:
    """The vectors of a record by space: of its "features", and a bare embedding under the space "vector"."""
    found: dict[str, Vector] = {}
    named = record.get("features")
    if isinstance(named, dict):
        taken.add("features")
        for space, value in named.items():
            name = fields.property_name(space)
            if name is None:
                raise FormatError(f"{where}: {fields.shown(space)} is no name for a feature space")
            found[name] = fields.vector(value, where, f"feature '{name}'")
    for key in VECTORS:
        if isinstance(record.get(key), list) and VECTOR_SPACE not in found:
            taken.add(key)
            found[VECTOR_SPACE] = fields.vector(record[key], where, f"'{key}'")
    return found


def read_relation(record: Mapping[str, Any], position: int) -> Relation:
    """The relation of a record {source, target, label}, with its confidence, explanation and origin where given."""
    where = f"relation in record {position}"
    label = fields.text(record["label"], where, "the label")
    if label is None:
        raise SceneError(f"{where}: the label is empty")
    confidence = fields.confidence(record.get("confidence"), where)
    return Relation(
        source=fields.node_id(record["source"], where),
        target=fields.node_id(record["target"], where),
        label=label,
        confidence=1.0 if confidence is None else confidence,
        explanation=fields.text(record.get("explanation"), where, "the explanation"),
        origin=fields.text(record.get("origin"), where, "the origin") or "imported",
    )


def room_place(name: str) -> Place:
    """The place that a room's name stands for; its id cannot be that of an object with a number."""
    return Place(id=room_id(name), kind="Room", name=name)


def room_id(name: str) -> ObjectId:
    return fields.node_id(f"room:{name}", f"room {name[:40]!r}")


def declare(spaces: dict[str, FeatureSpace], obj: SceneObject) -> None:
    """Note the spaces of an object's vectors; SceneError where a vector has another dimension than its space."""
    for name, value in obj.features.items():
        known = spaces.setdefault(name, FeatureSpace(name=name, dimension=len(value)))
        if known.dimension != len(value):
            raise SceneError(
                f"object #{obj.id}: feature '{name}' has {len(value)} numbers, the ones before it {known.dimension}"
            )


def _first(record: Mapping[str, Any], names: tuple[str, ...], taken: set[str]) -> Any:
    """The first of the names that the record gives a value for. Later ones stay for the properties."""
    for name in names:
        if record.get(name) is not None:
            taken.add(name)
            return record[name]
    return None


def _rotation(value: object, where: str) -> np.ndarray[Any, np.dtype[np.float64]] | None:
    if value is None:
        return None
    if not isinstance(value, list) or len(value) != 3:
        raise FormatError(f"{where}: the rotation must be three rows of three numbers, not {fields.shown(value)}")
    rows = [fields.triple(row, where, "a row of the rotation") for row in value]
    if any(row is None for row in rows):
        raise FormatError(f"{where}: the rotation must be three rows of three numbers")
    return np.array(rows, dtype=np.float64)


def _properties(record: Mapping[str, Any], taken: set[str], where: str, report: Report) -> dict[str, Any]:
    rest = {key: value for key, value in record.items() if key not in taken}
    nested = [rest.pop(key) for key in NESTED if isinstance(rest.get(key), dict)]
    for values in nested:
        rest.update({key: value for key, value in values.items() if key not in rest})
    return dict(fields.properties(rest, where, report))
