"""A plain JSON list of {id, caption, ...}, or {"objects": [...], "relations": [...]}."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any

from cgdb.errors import FormatError
from cgdb.ingest import records, strict_json
from cgdb.ingest.report import Report
from cgdb.ingest.source import Source
from cgdb.scene import FeatureSpace, Place, Relation, SceneGraph, SceneObject

TELLING = {*records.IDS, *records.CAPTIONS, *records.TAGS, *records.TAG_LISTS}


def matches(source: Source) -> bool:
    """A list of objects of which the first says what it is."""
    if source.kind != "json":
        return False
    found = _listed(source.value())
    return isinstance(found, list) and bool(found) and isinstance(found[0], dict) and not TELLING.isdisjoint(found[0])


def read(source: Source, name: str | None) -> SceneGraph:
    """The objects of the list, and the rooms that they name."""
    value = source.value()
    if not isinstance(_listed(value), list):
        raise FormatError(f"this is a JSON {strict_json.kind_of(value)}, not a list of objects")
    report = Report()
    listed = list(enumerate(_listed(value)))
    if isinstance(value, dict):
        relations = value.get("relations") or []
        if not isinstance(relations, list):
            raise FormatError(f"'relations' must be a list, not {strict_json.kind_of(relations)}")
        listed += enumerate(relations, start=len(listed))
    return from_records(listed, name, source, report, "json")


def from_records(
    listed: Iterable[tuple[int, Any]], name: str | None, source: Source, report: Report, format_name: str
) -> SceneGraph:
    """A scene from (position, record) pairs, objects and relations in any order."""
    objects: list[SceneObject] = []
    relations: list[Relation] = []
    rooms: dict[str, Place] = {}
    spaces: dict[str, FeatureSpace] = {}
    for position, record in listed:
        if not isinstance(record, Mapping):
            raise FormatError(f"record {position}: must be an object with fields, not {strict_json.kind_of(record)}")
        if records.is_relation(record):
            relations.append(records.read_relation(record, position))
            continue
        found = records.read_object(record, position, report)
        if found is None:
            continue
        objects.append(found.object)
        records.declare(spaces, found.object)
        if found.room is not None:
            place = rooms.setdefault(found.room, records.room_place(found.room))
            relations.append(Relation(source=place.id, target=found.object.id, label="contains"))
    return SceneGraph(
        name=name or source.default_name(),
        objects=tuple(objects),
        relations=tuple(relations),
        places=tuple(rooms.values()),
        spaces=tuple(spaces.values()),
        provenance=report.provenance(source, format_name),
    )


def _listed(value: Any) -> Any:
    return value.get("objects") if isinstance(value, dict) else value
