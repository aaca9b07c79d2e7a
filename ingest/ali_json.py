"""The obj_json_*.json and edge_json_*.json of ConceptGraphs' ali-dev branch: either finds the other beside it."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from cgdb.errors import FormatError
from cgdb.ingest import conceptgraphs_ali, fields, plain_json, strict_json
from cgdb.ingest.report import Report, naming
from cgdb.ingest.source import Source
from cgdb.scene import Relation, SceneGraph

FORMAT = "conceptgraphs-ali-json"
OBJECTS, EDGES = "obj_json", "edge_json"


def matches(source: Source) -> bool:
    """An object of "object_<k>" or of "edge_<k>"."""
    return source.kind == "json" and (_is_objects(source.value()) or _is_edges(source.value()))


def read(source: Source, name: str | None) -> SceneGraph:
    """The objects of the one file and the edges of the other; edges to objects that there are not are dropped."""
    report = Report()
    value = source.value()
    if not isinstance(value, dict):
        raise FormatError(f"this is a JSON {strict_json.kind_of(value)}, not objects by their names")
    if _is_edges(value):
        partner = _partner(source, EDGES, OBJECTS)
        if partner is None:
            raise FormatError(
                "these are the edges of a map; its objects are not beside it", hint="put the obj_json_... file there"
            )
        objects, edges = partner.value(), value
    else:
        partner = _partner(source, OBJECTS, EDGES)
        objects, edges = value, partner.value() if partner is not None else {}
        if partner is None:
            report.warn("there is no edge_json file beside it: no edges")
    if not _is_objects(objects):
        raise FormatError(f"{partner.path.name if partner else 'the file'} holds no objects of this format")
    scene = plain_json.from_records(enumerate(objects.values()), name, source, report, FORMAT)
    relations = _relations(edges, {obj.id for obj in scene.objects}, report)
    files = {file.path.name: file.sha256() for file in (source, partner) if file is not None}
    return SceneGraph(
        name=scene.name,
        objects=scene.objects,
        relations=tuple(relations),
        provenance=report.provenance(source, FORMAT, files=files),
    )


def _relations(edges: Any, ids: set[Any], report: Report) -> list[Relation]:
    if not isinstance(edges, dict):
        raise FormatError(f"the edges must be an object, not a JSON {strict_json.kind_of(edges)}")
    found = []
    if edges:
        report.warn("edges of this JSON can name the wrong objects if the map was filtered; the pickle has them right")
    for key, edge in edges.items():
        if not isinstance(edge, Mapping):
            raise FormatError(f"{key[:40]}: must be an object with fields, not {fields.shown(edge)}")
        if edge.get("object_1_id") is None or edge.get("object_2_id") is None:
            report.drop("edges to objects that the map does not hold")
            continue
        ends = [fields.node_id(edge[end], key[:40]) for end in ("object_1_id", "object_2_id")]
        made = conceptgraphs_ali.relation(
            ends[0], ends[1], edge.get("relationship"), edge.get("num_detections"), key[:40]
        )
        if made is None:
            report.drop("edges without a relation")
        elif not ids.issuperset(ends):
            report.drop("edges to objects that the map does not hold")
        else:
            found.append(made)
    return found


def _partner(source: Source, mine: str, other: str) -> Source | None:
    path = source.path.with_name(source.path.name.replace(mine, other, 1))
    if path == source.path or not path.is_file():
        return None
    with naming(path.name):
        found = Source(path, max_bytes=source.max_bytes)
        found.value()
    return found


def _is_objects(value: object) -> bool:
    return _all_named(value, "object_") and all("object_tag" in item for item in _values(value))


def _is_edges(value: object) -> bool:
    return _all_named(value, "edge_") and all("relationship" in item for item in _values(value))


def _all_named(value: object, prefix: str) -> bool:
    return isinstance(value, dict) and bool(value) and all(str(key).startswith(prefix) for key in value)


def _values(value: object) -> list[Mapping[str, Any]]:
    return [item for item in value.values() if isinstance(item, Mapping)] if isinstance(value, dict) else []
