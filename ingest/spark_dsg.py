"""Spark-DSG JSON, as Hydra writes it: objects, and places, rooms and buildings above them.

Older files number their layers (2 objects, 3 places, 4 rooms, 5 buildings) and give boxes by their corners; newer
ones name the layers, split them into partitions and give boxes by their dimensions. The node ids use 63 bits.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from cgdb.errors import FormatError, SceneError
from cgdb.ingest import fields, strict_json
from cgdb.ingest.report import Report
from cgdb.ingest.source import Source
from cgdb.scene import ObjectId, Place, PropertyValue, Relation, SceneGraph, SceneObject

FORMAT = "spark-dsg"
AGENTS = "AgentNodeAttributes"
OBJECT_LAYER = 2
KINDS = {3: "Place", 4: "Room", 5: "Building"}
NAMED_KINDS = {"PLACES": "Place", "MESH_PLACES": "Place", "ROOMS": "Room", "BUILDINGS": "Building", "FLOORS": "Floor"}
KEPT = ("semantic_label", "is_active", "registered", "last_update_time_ns", "distance")

Box = tuple[NDArray[np.float64] | None, NDArray[np.float64] | None, NDArray[np.float64] | None]


def matches(source: Source) -> bool:
    """JSON with nodes, edges and layers."""
    value = source.value() if source.kind == "json" else None
    return isinstance(value, dict) and {"nodes", "edges"} <= value.keys() and "layer_ids" in value


def read(source: Source, name: str | None) -> SceneGraph:
    """Objects, places by kind, containment from parent to child, and which places adjoin which."""
    value = source.value()
    if not isinstance(value, dict):
        raise FormatError(f"this is a JSON {strict_json.kind_of(value)}, not a scene graph")
    report = Report()
    names = _layer_names(value.get("layer_names"))
    labels = _label_names(value.get("metadata"))
    objects: list[SceneObject] = []
    places: list[Place] = []
    layers: dict[ObjectId, int] = {}
    agents: set[ObjectId] = set()
    for position, node in enumerate(_records(value, "nodes")):
        node_id = fields.node_id(node.get("id"), f"node {position}")
        layer, partition = _layer(node, node_id)
        if _attributes(node, node_id).get("type") == AGENTS or names.get((layer, partition)) == "AGENTS":
            agents.add(node_id)
            report.drop("agent poses")
            continue
        layers[node_id] = layer
        kind = _kind(layer, names.get((layer, partition)))
        if kind is None:
            objects.append(_object(node, node_id, labels.get((layer, partition), {}), report))
        else:
            places.append(_place(node, node_id, kind, report))
    return SceneGraph(
        name=name or source.default_name(),
        objects=tuple(objects),
        places=tuple(places),
        relations=tuple(_relations(value, layers, agents, report)),
        provenance=report.provenance(source, FORMAT),
    )


def _relations(
    value: Mapping[str, Any], layers: Mapping[ObjectId, int], agents: set[ObjectId], report: Report
) -> Iterator[Relation]:
    """The higher layer contains the lower; nodes of one layer are connected, told once, from the lower id."""
    for position, edge in enumerate(_records(value, "edges")):
        where = f"edge {position}"
        a, b = (fields.node_id(edge.get(end), where) for end in ("source", "target"))
        if a in agents or b in agents:
            report.drop("edges of agent poses")
            continue
        for end in (a, b):
            if end not in layers:
                raise SceneError(f"{where}: there is no node #{end}")
        if layers[a] == layers[b]:
            low, high = sorted((a, b), key=lambda end: (isinstance(end, str), end))
            yield Relation(source=low, target=high, label="connected_to")
        else:
            parent, child = (a, b) if layers[a] > layers[b] else (b, a)
            yield Relation(source=parent, target=child, label="contains")


def _object(node: Mapping[str, Any], node_id: ObjectId, labels: Mapping[int, str], report: Report) -> SceneObject:
    where = f"object #{node_id}"
    attributes = _attributes(node, node_id)
    center, extent, rotation = _box(attributes, where, report)
    label = attributes.get("semantic_label")
    told = fields.text(attributes.get("name"), where, "the name")
    named = labels.get(label) if type(label) is int else None
    return SceneObject(
        id=node_id,
        tag=named or told,
        center=center,
        extent=extent,
        rotation=rotation,
        properties=_properties(attributes, where, report) | ({"name": told} if named and told else {}),
    )


def _place(node: Mapping[str, Any], node_id: ObjectId, kind: str, report: Report) -> Place:
    where = f"{kind.lower()} #{node_id}"
    attributes = _attributes(node, node_id)
    center, extent, rotation = _box(attributes, where, report)
    if extent is not None and rotation is not None:
        # Places have no rotation: the axis-aligned hull of the box.
        extent = np.abs(rotation) @ extent
    return Place(
        id=node_id,
        kind=kind,
        name=fields.text(attributes.get("name"), where, "the name"),
        center=center,
        extent=extent,
        properties=_properties(attributes, where, report),
    )


def _properties(attributes: Mapping[str, Any], where: str, report: Report) -> dict[str, PropertyValue]:
    return fields.properties({key: attributes[key] for key in KEPT if key in attributes}, where, report)


def _box(attributes: Mapping[str, Any], where: str, report: Report) -> Box:
    """(center, extent, rotation) m: of the bounding box where it is valid, else the node's position alone."""
    position = fields.triple(attributes.get("position"), where, "the position")
    told = attributes.get("bounding_box")
    if not isinstance(told, Mapping) or told.get("type") in ("INVALID", None, 0):
        return position, None, None
    low, high = (fields.triple(told.get(key), where, f"the box's {key}") for key in ("min", "max"))
    extent: NDArray[np.float64] | None
    if told.get("dimensions") is not None:
        extent = fields.extent(told["dimensions"], where, "the box's dimensions", report)
    elif low is not None and high is not None:
        extent = fields.extent((high - low).tolist(), where, "the box from min to max", report)
    else:
        raise FormatError(f"{where}: its bounding box has neither dimensions nor min and max")
    center = fields.triple(told.get("world_P_center"), where, "the box's center")
    if center is None and low is not None and high is not None:
        center = (low + high) / 2.0
    if center is None or extent is None:
        return (center if center is not None else position), None, None
    turned = told.get("type") not in ("AABB", 1)
    return center, extent, _rotation(told.get("world_R_center"), where) if turned else None


def _rotation(value: object, where: str) -> NDArray[np.float64] | None:
    """(3, 3) of a quaternion {"w", "x", "y", "z"}; None where it turns nothing."""
    if value is None:
        return None
    if not isinstance(value, Mapping):
        raise FormatError(f"{where}: the box's orientation must be a quaternion, not {fields.shown(value)}")
    parts = [fields.number(value.get(key), where, f"the quaternion's {key}") for key in "wxyz"]
    quaternion = np.array([0.0 if part is None else part for part in parts])
    length = math.hypot(*quaternion.tolist())
    if not 1e-6 < length < 1e6:
        raise SceneError(f"{where}: the box's orientation is a quaternion of length {length:.3g}")
    w, x, y, z = quaternion / length
    rotation = np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
        ]
    )
    return None if np.allclose(rotation, np.eye(3), atol=1e-9) else rotation


def _kind(layer: int, name: str | None) -> str | None:
    """The place kind of a layer, None for objects. A layer that nobody here knows keeps its own name or number."""
    if name == "OBJECTS" or (name is None and layer == OBJECT_LAYER):
        return None
    if name is None:
        return KINDS.get(layer, f"Layer{layer}")
    return NAMED_KINDS.get(name) or fields.property_name(name.title().replace("_", "")) or f"Layer{layer}"


def _layer(node: Mapping[str, Any], node_id: ObjectId) -> tuple[int, int]:
    layer, partition = node.get("layer"), node.get("partition", 0)
    if type(layer) is not int or not 0 <= layer < 2**31 or type(partition) is not int:
        raise FormatError(f"node #{node_id}: its layer must be a number, not {fields.shown(layer)}")
    return layer, partition


def _attributes(node: Mapping[str, Any], node_id: ObjectId) -> Mapping[str, Any]:
    found = node.get("attributes")
    if not isinstance(found, Mapping):
        raise FormatError(f"node #{node_id}: has no attributes")
    return found


def _layer_names(value: object) -> dict[tuple[int, int], str]:
    """{(layer, partition): name} of {name: layer} or {name: {"layer", "partition"}}."""
    found: dict[tuple[int, int], str] = {}
    for name, key in value.items() if isinstance(value, Mapping) else ():
        layer, partition = (key.get("layer"), key.get("partition", 0)) if isinstance(key, Mapping) else (key, 0)
        if type(layer) is int and type(partition) is int:
            found.setdefault((layer, partition), str(name)[:64])
    return found


def _label_names(value: object) -> dict[tuple[int, int], dict[int, str]]:
    """{(layer, partition): {label: name}} of the metadata's labelspaces, whose keys read "_l2p0"."""
    spaces = value.get("labelspaces") if isinstance(value, Mapping) else None
    found: dict[tuple[int, int], dict[int, str]] = {}
    for key, pairs in spaces.items() if isinstance(spaces, Mapping) else ():
        layer, _, partition = str(key).removeprefix("_l").partition("p")
        if not (layer.isdecimal() and partition.isdecimal() and len(layer) + len(partition) < 20):
            continue
        listed = list(pairs.items()) if isinstance(pairs, Mapping) else pairs
        names: dict[int, str] = {}
        for pair in listed if isinstance(listed, list) else ():
            if isinstance(pair, (list, tuple)) and len(pair) == 2 and isinstance(pair[1], str):
                label = str(pair[0])
                if label.isdecimal() and len(label) < 20:
                    names[int(label)] = fields.text(pair[1], f"labelspace {key}"[:60], "a name") or ""
        found[int(layer), int(partition)] = names
    return found


def _records(value: Mapping[str, Any], key: str) -> list[dict[str, Any]]:
    listed = value.get(key)
    if not isinstance(listed, list):
        raise FormatError(f"'{key}' must be a list, not {fields.shown(listed)}")
    for position, record in enumerate(listed):
        if not isinstance(record, dict):
            raise FormatError(f"{key[:-1]} {position}: must be an object with fields, not {fields.shown(record)}")
    return listed
