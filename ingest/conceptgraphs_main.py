"""Maps of ConceptGraphs' main branch: full_pcd_*.pkl.gz (a dictionary) and the pruned map (a bare list).

The id of an object is its position in the map, background after objects, as the scene-graph cache counts; in a
pruned map it is the position before pruning, which each object carries in its caption_dict.
"""

from __future__ import annotations

from typing import Any

from cgdb.errors import FormatError
from cgdb.ingest import fields, responses
from cgdb.ingest.map_objects import MapReader, is_map_object, records_of
from cgdb.ingest.report import Report
from cgdb.ingest.source import Source
from cgdb.scene import ObjectId, SceneGraph, SceneObject

FORMAT = "conceptgraphs-main"


def matches(source: Source) -> bool:
    """A pickle of map objects, in a list or under "objects" beside "bg_objects"."""
    if source.kind != "pickle":
        return False
    value = source.value()
    if isinstance(value, dict):
        return isinstance(value.get("objects"), list) and "bg_objects" in value
    return isinstance(value, list) and bool(value) and is_map_object(value[0])


def read(source: Source, name: str | None) -> SceneGraph:
    """All objects of the map, background included and marked as such."""
    report = Report()
    value = source.value()
    reader = MapReader(report, class_names=value.get("class_names") if isinstance(value, dict) else None)
    objects = [read_one(reader, record, position, report) for position, record in enumerate(_all_records(value))]
    return SceneGraph(
        name=name or source.default_name(),
        objects=tuple(obj for obj in objects if obj is not None),
        spaces=tuple(reader.spaces.values()),
        provenance=report.provenance(source, FORMAT),
    )


def read_one(reader: MapReader, record: dict[str, Any], position: int, report: Report) -> SceneObject | None:
    """One object with what the language model said of it, if anything; None where that was "invalid"."""
    object_id = original_id(record, position)
    where = f"object #{object_id}"
    said = responses.of_caption_dict(record.get("caption_dict"), where)
    if said.tag is not None and said.tag.casefold() in fields.INVALID_TAGS:
        report.drop("objects tagged invalid, none or unknown")
        return None
    caption = said.summary or _old_caption(record, where)
    more = {"captions": said.captions} if said.captions else None
    return reader.read(record, object_id, tag=said.tag, tags=said.tags, caption=caption, more=more)


def original_id(record: dict[str, Any], position: int) -> ObjectId:
    """The object's position in the map before pruning: the id that scene_graph.json uses."""
    told = record.get("caption_dict")
    if isinstance(told, dict) and told.get("id") is not None:
        return fields.node_id(told["id"], f"object at position {position}")
    return position


def _all_records(value: Any) -> list[dict[str, Any]]:
    if isinstance(value, dict):
        background = value.get("bg_objects")
        return records_of(
            [
                *records_of(value.get("objects"), "object"),
                *(records_of(background, "background object") if background is not None else []),
            ],
            "object",
        )
    if not isinstance(value, list):
        raise FormatError(f"this pickle holds {fields.shown(value)}, not a map")
    return records_of(value, "object")


def _old_caption(record: dict[str, Any], where: str) -> str | None:
    """Older maps carry {view: caption}; the first that says something."""
    told = record.get("caption")
    for value in told.values() if isinstance(told, dict) else [told]:
        found = fields.text(value, where, "the caption") if isinstance(value, str) else None
        if found:
            return found
    return None
