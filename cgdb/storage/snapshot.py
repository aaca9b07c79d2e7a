"""A stored scene as one SceneGraph, whole, or with what is damaged left out."""

from __future__ import annotations

from typing import Any

from cgdb.scene import UNREAD, Place, Relation, SceneGraph, SceneObject, Vector, View
from cgdb.storage import reader
from cgdb.storage.history import SceneInfo
from cgdb.storage.reader import Reading
from cgdb.storage.rows import NodeRow
from cgdb.storage.verify import Cloud


def read_scene_graph(
    reading: Reading, info: SceneInfo, *, features: bool, clouds: bool, views: bool, skip_damaged: bool
) -> SceneGraph:
    """Everything of a scene. skip_damaged leaves damaged rows out and lists them in provenance["damaged"]."""
    damaged: list[str] | None = [] if skip_damaged else None
    nodes = [row for batch in reader.node_batches(reading, info, 4096, damaged) for row in batch]
    vectors: dict[int, dict[str, Vector]] = {}
    for space in info.spaces if features else ():
        for keys, matrix in reader.feature_batches(reading, info, space.name, space.dimension, 4096, damaged):
            for key, vector in zip(keys.tolist(), matrix, strict=True):
                vectors.setdefault(key, {})[space.name] = vector
    points: dict[int, Cloud] = dict(reader.clouds(reading, info, damaged)) if clouds else {}
    seen: dict[int, list[View]] = {}
    for key, view in reader.views(reading, info, damaged) if views else ():
        seen.setdefault(key, []).append(view)
    ids = {node.key: node.id for node in nodes}
    relations = [
        Relation(
            source=ids[row.source],
            target=ids[row.target],
            label=row.label,
            confidence=row.confidence,
            explanation=row.explanation,
            origin=row.origin,
        )
        for batch in reader.relation_batches(reading, info, 8192, damaged)
        for row in batch
        # Only where a damaged node was left out: the ledger has no relation to nothing.
        if row.source in ids and row.target in ids
    ]
    provenance: dict[str, Any] = dict(info.provenance)
    if damaged:
        provenance["damaged"] = damaged
    return SceneGraph(
        name=info.name,
        objects=tuple(
            _object(n, vectors.get(n.key, {}), points.get(n.key), tuple(seen.get(n.key, ())) if views else UNREAD)
            for n in nodes
            if n.label == "Object"
        ),
        places=tuple(_place(n) for n in nodes if n.label != "Object"),
        relations=tuple(relations),
        frame=info.frame,
        up=info.up,
        spaces=info.spaces,
        provenance=provenance,
    )


def _object(node: NodeRow, features: dict[str, Vector], cloud: Cloud | None, views: tuple[View, ...]) -> SceneObject:
    points, colors = (None, None) if cloud is None else cloud
    return SceneObject(
        id=node.id,
        tag=node.tag,
        tags=node.tags,
        caption=node.caption,
        center=node.center,
        extent=node.extent,
        rotation=node.rotation,
        features=features,
        points=points,
        colors=colors,
        n_observations=node.n_observations,
        confidence=node.confidence,
        properties=node.properties,
        views=views,
    )


def _place(node: NodeRow) -> Place:
    return Place(
        id=node.id, kind=node.label, name=node.tag, center=node.center, extent=node.extent, properties=node.properties
    )
