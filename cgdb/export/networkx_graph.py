"""A scene as a networkx graph, as node-link JSON, and as GraphML: for the tools that draw and analyse graphs.

Objects and places are nodes, relations are edges from source to target. A node has ``kind`` ("Object", or the place's
own), and of the other fields those that are set. Feature vectors and point clouds stay in the scene.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

from cgdb.errors import ExportError, MissingExtraError
from cgdb.export.documents import Document, json_text, json_value
from cgdb.scene import ObjectId, Place, Relation, SceneGraph, SceneObject

if TYPE_CHECKING:
    import networkx

_NO_XML = re.compile("[^\t\n\u0020-\ud7ff\ue000-\ufffd\U00010000-\U0010ffff]")
_AXES = ("x", "y", "z")


def to_networkx(scene: SceneGraph) -> networkx.MultiDiGraph[ObjectId]:
    """The scene as a MultiDiGraph; its nodes are the ids, parallel relations have the edge keys 0, 1, ..."""
    graph = _empty()
    graph.graph.update(_graph_attributes(scene))
    for node in _nodes(scene):
        graph.add_node(node.id, **_node_attributes(node))
    for relation in scene.relations:
        graph.add_edge(relation.source, relation.target, **_edge_attributes(relation))
    return graph


def node_link(scene: SceneGraph) -> Document:
    """The scene in networkx's node-link JSON: ``networkx.node_link_graph(document, edges="links")`` reads it."""
    return Document(pieces=_node_link(scene), notes=_left_out(scene))


def graphml(scene: SceneGraph) -> Document:
    """The scene in GraphML, which has scalars only.

    Boxes become ``center_x`` to ``extent_z``, lists become text joined by "; ", a property p becomes ``property_p``,
    ids become text. Characters that XML forbids are dropped.
    """
    graph = _empty()
    graph.graph.update(name=_xml(scene.name), frame=_xml(scene.frame), up=scene.up)
    names: dict[ObjectId, str] = {}
    for node in _nodes(scene):
        names[node.id] = _xml(str(node.id))
        if names[node.id] in graph:
            raise ExportError(
                f"the ids {node.id!r} and another are the same once XML's forbidden characters are dropped"
            )
        graph.add_node(names[node.id], **_flat(_node_attributes(node)))
    for relation in scene.relations:
        graph.add_edge(names[relation.source], names[relation.target], **_flat(_edge_attributes(relation)))
    import networkx

    lines = networkx.generate_graphml(graph, named_key_ids=True)
    head = '<?xml version="1.0" encoding="utf-8"?>\n'
    return Document(pieces=_pieces(head, lines), notes=_left_out(scene))


def _pieces(head: str, lines: Iterator[str]) -> Iterator[str]:
    yield head
    for line in lines:
        yield line + "\n"


def _empty() -> networkx.MultiDiGraph[Any]:
    try:
        import networkx
    except ImportError as error:
        raise MissingExtraError("networkx is needed for this", hint="pip install networkx") from error
    return networkx.MultiDiGraph()


def _nodes(scene: SceneGraph) -> Iterator[SceneObject | Place]:
    yield from scene.objects
    yield from scene.places


def _graph_attributes(scene: SceneGraph) -> dict[str, Any]:
    provenance = json_value(scene.provenance, "the provenance")
    return {"name": scene.name, "frame": scene.frame, "up": scene.up, "provenance": provenance}


def _node_attributes(node: SceneObject | Place) -> dict[str, Any]:
    fields: dict[str, Any]
    if isinstance(node, Place):
        fields = {"kind": node.kind, "name": node.name}
    else:
        fields = {
            "kind": "Object",
            "tag": node.tag,
            "tags": list(node.tags) or None,
            "caption": node.caption,
            "rotation": None if node.rotation is None else node.rotation.tolist(),
            "n_observations": node.n_observations,
            "confidence": node.confidence,
        }
    fields["center"] = None if node.center is None else node.center.tolist()
    fields["extent"] = None if node.extent is None else node.extent.tolist()
    fields["properties"] = json_value(node.properties, f"the properties of #{node.id}") or None
    return {key: value for key, value in fields.items() if value is not None}


def _edge_attributes(relation: Relation) -> dict[str, Any]:
    fields = {
        "label": relation.label,
        "confidence": relation.confidence,
        "origin": relation.origin,
        "explanation": relation.explanation,
    }
    return {key: value for key, value in fields.items() if value is not None}


def _node_link(scene: SceneGraph) -> Iterator[str]:
    yield '{"directed": true, "multigraph": true,\n'
    yield f'"graph": {json_text(_graph_attributes(scene), "the scene")},\n"nodes": ['
    before = "\n"
    for node in _nodes(scene):
        yield before + json_text({"id": node.id, **_node_attributes(node)}, f"node #{node.id}")
        before = ",\n"
    yield '\n],\n"links": ['
    before = "\n"
    parallel: dict[tuple[ObjectId, ObjectId], int] = {}
    for relation in scene.relations:
        ends = relation.source, relation.target
        key = parallel[ends] = parallel.get(ends, -1) + 1
        record = {"source": ends[0], "target": ends[1], "key": key, **_edge_attributes(relation)}
        yield before + json_text(record, f"relation #{ends[0]} {relation.label!r} #{ends[1]}")
        before = ",\n"
    yield "\n]}\n"


def _flat(attributes: dict[str, Any]) -> dict[str, str | int | float | bool]:
    """The attributes as GraphML can hold them."""
    flat: dict[str, str | int | float | bool] = {}
    for key, value in attributes.items():
        if key in ("center", "extent"):
            flat.update({f"{key}_{axis}": number for axis, number in zip(_AXES, value, strict=True)})
        elif key == "properties":
            flat.update({f"property_{name}": _scalar(v) for name, v in value.items() if v is not None})
        else:
            flat[key] = _scalar(value)
    return flat


def _scalar(value: Any) -> str | int | float | bool:
    if isinstance(value, list):
        return _xml("; ".join(str(item) for item in value))
    if isinstance(value, int) and not isinstance(value, bool) and not -(2**63) <= value < 2**63:
        return str(value)  # GraphML's long has 64 bits
    if isinstance(value, (bool, int, float)):
        return value
    return _xml(str(value))


def _xml(text: str) -> str:
    """The text as an XML reader gives it back: no forbidden characters, every line break a line feed."""
    return _NO_XML.sub("", text.replace("\r\n", "\n").replace("\r", "\n"))


def _left_out(scene: SceneGraph) -> tuple[str, ...]:
    if any(obj.features or obj.points is not None for obj in scene.objects):
        return ("feature vectors and point clouds left out; the format 'cgdb' keeps them",)
    return ()
