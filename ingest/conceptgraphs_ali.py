"""Maps of ConceptGraphs' ali-dev branch: pcd_*.pkl.gz, with the edges that a vision-language model saw.

The id of an object is its running number (curr_obj_num), the one that the branch's JSON files use. The edges of the
pickle count positions in its object list, and are right where those of the JSON may not be.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping
from typing import Any

from cgdb.errors import FormatError
from cgdb.ingest import fields
from cgdb.ingest.map_objects import MapReader, is_map_object, records_of
from cgdb.ingest.report import Report
from cgdb.ingest.source import Source
from cgdb.scene import ObjectId, PropertyValue, Relation, SceneGraph

FORMAT = "conceptgraphs-ali"
LABELS = {"on top of": "on", "inside": "in", "inside of": "in", "next to": "next_to", "underneath": "under"}
MOST_CAPTIONS = 16


def matches(source: Source) -> bool:
    """A pickle with objects and no separate background."""
    if source.kind != "pickle":
        return False
    value = source.value()
    if not isinstance(value, dict) or "bg_objects" in value:
        return False
    listed = value.get("objects")
    return isinstance(listed, list) and ("edges" in value or (bool(listed) and is_map_object(listed[0])))


def read(source: Source, name: str | None) -> SceneGraph:
    """The objects of the map and the edges between them."""
    report = Report()
    value = source.value()
    if not isinstance(value, dict):
        raise FormatError(f"this pickle holds {fields.shown(value)}, not a map")
    listed = records_of(value.get("objects"), "object")
    ids = _ids(listed, report)
    reader = MapReader(report, class_names=value.get("class_names"), config=value.get("cfg"))
    objects = tuple(_object(reader, record, ids[position]) for position, record in enumerate(listed))
    return SceneGraph(
        name=name or source.default_name(),
        objects=objects,
        relations=tuple(_relations(value.get("edges"), ids, report)),
        spaces=tuple(reader.spaces.values()),
        provenance=report.provenance(source, FORMAT),
    )


def relation(source: ObjectId, target: ObjectId, told: object, detections: object, where: str) -> Relation | None:
    """An edge as a relation seen by a model; None where it has no label."""
    label = fields.text(told, where, "the relation")
    if label is None:
        return None
    label = label.casefold()
    seen = fields.count(detections, where, "num_detections")
    return Relation(
        source=source,
        target=target,
        label=LABELS.get(label, label),
        explanation=f"seen in {seen} frame{'s' if seen != 1 else ''}" if seen else None,
        origin="llm",
    )


def _ids(listed: list[dict[str, Any]], report: Report) -> list[ObjectId]:
    """Running numbers, where every object has one of its own; else positions."""
    numbers = [record.get("curr_obj_num") for record in listed]
    if all(type(number) is int for number in numbers) and len(set(numbers)) == len(numbers):
        return [fields.node_id(number, f"object {position}") for position, number in enumerate(numbers)]
    report.warn("objects have no running numbers of their own: their position in the file is their id")
    return list(range(len(listed)))


def _object(reader: MapReader, record: Mapping[str, Any], object_id: ObjectId) -> Any:
    where = f"object #{object_id}"
    captions = _captions(record.get("captions"), where)
    told = record.get("consolidated_caption")
    caption = fields.text(told, where, "the caption") if isinstance(told, str) else None
    more: dict[str, PropertyValue] = {"uuid": record["id"]} if isinstance(record.get("id"), str) else {}
    if captions:
        more["captions"] = tuple(captions)[:MOST_CAPTIONS]
    # The consolidation by a language model fails with "": what most detections were called is then the best there is.
    return reader.read(record, object_id, caption=caption or next(iter(captions), None), more=more)


def _captions(value: object, where: str) -> list[str]:
    """The captions of the detections, the most frequent first."""
    items = value if isinstance(value, list) else []
    told = (item.get("caption") for item in items if isinstance(item, Mapping))
    counted = Counter(
        found for item in told if isinstance(item, str) and (found := fields.text(item, where, "caption"))
    )
    return [caption for caption, _ in counted.most_common()]


def _relations(value: object, ids: list[ObjectId], report: Report) -> list[Relation]:
    if value is None:
        return []
    listed = value.get("edges") if isinstance(value, Mapping) else value
    if not isinstance(listed, list):
        raise FormatError(f"the edges must be a list, not {fields.shown(listed)}")
    found = []
    for position, edge in enumerate(listed):
        where = f"edge {position}"
        if not isinstance(edge, Mapping):
            raise FormatError(f"{where}: must be a dictionary, not {fields.shown(edge)}")
        ends = [end for key in ("obj1_index", "obj2_index") if type(end := edge.get(key)) is int]
        if len(ends) != 2 or not all(end in range(len(ids)) for end in ends):
            report.drop("edges to objects that the map does not hold")
            continue
        made = relation(ids[ends[0]], ids[ends[1]], edge.get("rel_type"), edge.get("num_detections"), where)
        if made is None:
            report.drop("edges without a relation")
        else:
            found.append(made)
    return found
