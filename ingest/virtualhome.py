"""VirtualHome graphs: rooms, objects with affordances and states, and the relations that the simulator knows."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

from cgdb.errors import FormatError, SceneError, UsageError, one_of
from cgdb.ingest import fields, strict_json
from cgdb.ingest.report import Report
from cgdb.ingest.source import Source
from cgdb.scene import ObjectId, Place, PropertyValue, Relation, SceneGraph, SceneObject

FORMAT = "virtualhome"
PARTS = ("init_graph", "final_graph")
LABELS = {"ON": "on", "INSIDE": "in", "CLOSE": "near", "FACING": "facing", "BETWEEN": "between"}


def matches(source: Source) -> bool:
    """A graph of nodes with class names, or a file of such graphs."""
    value = source.value() if source.kind == "json" else None
    if isinstance(value, dict) and PARTS[0] in value:
        value = value[PARTS[0]]
    nodes = value.get("nodes") if isinstance(value, dict) else None
    return isinstance(nodes, list) and bool(nodes) and isinstance(nodes[0], dict) and "class_name" in nodes[0]


def read(source: Source, name: str | None, *, part: str | None = None) -> SceneGraph:
    """The graph of the file, or the one of its parts that was asked for (the first, else)."""
    graph = _graph(source.value(), part)
    report = Report()
    objects: list[SceneObject] = []
    places: list[Place] = []
    for position, node in enumerate(_records(graph, "nodes")):
        node_id = fields.node_id(node.get("id"), f"node {position}")
        if node.get("category") == "Rooms":
            places.append(_room(node, node_id, report))
        else:
            objects.append(_object(node, node_id, report))
    rooms = {place.id for place in places}
    known = rooms | {obj.id for obj in objects}
    chosen = {} if graph is source.value() else {"part": part or PARTS[0]}
    return SceneGraph(
        name=name or source.default_name(),
        objects=tuple(objects),
        places=tuple(places),
        relations=tuple(_relations(graph, rooms, known)),
        up="y",
        provenance=report.provenance(source, FORMAT, **chosen),
    )


def _graph(value: Any, part: str | None) -> Mapping[str, Any]:
    if not isinstance(value, dict):
        raise FormatError(f"this is a JSON {strict_json.kind_of(value)}, not a graph")
    if PARTS[0] not in value:
        if part is not None:
            raise UsageError(f"the file holds one graph, no part '{part}'")
        return value
    wanted = part or PARTS[0]
    if wanted not in PARTS or not isinstance(value.get(wanted), dict):
        raise UsageError(f"the file has no part '{wanted}'", hint=f"it has: {one_of(p for p in PARTS if p in value)}")
    found: Mapping[str, Any] = value[wanted]
    return found


def _room(node: Mapping[str, Any], node_id: ObjectId, report: Report) -> Place:
    where = f"room #{node_id}"
    center, extent = _box(node, where, report)
    return Place(id=node_id, kind="Room", name=_words(node.get("class_name"), where), center=center, extent=extent)


def _object(node: Mapping[str, Any], node_id: ObjectId, report: Report) -> SceneObject:
    where = f"object #{node_id}"
    center, extent = _box(node, where, report)
    found: dict[str, PropertyValue] = {}
    for key, name in (("properties", "affordances"), ("states", "states")):
        values = tuple(value.casefold() for value in fields.texts(node.get(key), where, f"'{key}'"))
        if values:
            found[name] = values
    category = fields.text(node.get("category"), where, "the category")
    if category is not None:
        found["category"] = category
    prefab = fields.text(node.get("prefab_name"), where, "the prefab's name")
    if prefab is not None:
        found["prefab_name"] = prefab
    return SceneObject(
        id=node_id, tag=_words(node.get("class_name"), where), center=center, extent=extent, properties=found
    )


def _words(value: object, where: str) -> str | None:
    """A class name as words: "dining_room" is a dining room. Names written as one word stay as they are."""
    found = fields.text(value, where, "class_name")
    return found.replace("_", " ") if found else None


def _box(node: Mapping[str, Any], where: str, report: Report) -> tuple[Any, Any]:
    told = node.get("bounding_box")
    if told is None:
        return None, None
    if not isinstance(told, Mapping):
        raise FormatError(f"{where}: the bounding box must be an object with fields, not {fields.shown(told)}")
    center = fields.triple(told.get("center"), where, "the box's center")
    extent = fields.extent(told.get("size"), where, "the box's size", report)
    if center is None and extent is not None:
        raise SceneError(f"{where}: its bounding box has a size but no center")
    return center, extent


def _relations(graph: Mapping[str, Any], rooms: set[ObjectId], known: set[ObjectId]) -> Iterator[Relation]:
    """A room contains what is INSIDE it; everything else keeps its direction."""
    for position, edge in enumerate(_records(graph, "edges")):
        where = f"edge {position}"
        a, b = (fields.node_id(edge.get(end), where) for end in ("from_id", "to_id"))
        for end in (a, b):
            if end not in known:
                raise SceneError(f"{where}: there is no node #{end}")
        told = fields.text(edge.get("relation_type"), where, "the relation")
        if told is None:
            raise FormatError(f"{where}: has no relation_type")
        if told.upper() == "INSIDE" and b in rooms:
            yield Relation(source=b, target=a, label="contains")
        else:
            yield Relation(source=a, target=b, label=LABELS.get(told.upper(), told.casefold()))


def _records(value: Mapping[str, Any], key: str) -> list[dict[str, Any]]:
    listed = value.get(key)
    if not isinstance(listed, list):
        raise FormatError(f"'{key}' must be a list, not {fields.shown(listed)}")
    for position, record in enumerate(listed):
        if not isinstance(record, dict):
            raise FormatError(f"{key[:-1]} {position}: must be an object with fields, not {fields.shown(record)}")
    return listed
