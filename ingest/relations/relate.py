"""A scene's relations that follow from where its things are, added to what the map itself says.

What each relation means is in cgdb.ingest.relations.spatial; this module brings objects in and relations out.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence

import numpy as np

from cgdb.errors import SceneError
from cgdb.ingest.relations.boxes import Boxes, prisms, settle_sides
from cgdb.ingest.relations.spatial import LABELS, USUAL, Limits, relate
from cgdb.scene import ObjectId, Place, Relation, SceneGraph, SceneObject

__all__ = ["LABELS", "USUAL", "Limits", "boxes_of", "contained_in_places", "geometric_relations", "with_geometry"]

_STRUCTURE_WORDS = frozenset(
    {"wall", "walls", "floor", "floors", "flooring", "ceiling", "ceilings", "room", "rooms", "bedroom", "bathroom"}
    | {"kitchen", "livingroom", "hallway", "corridor"}
)


def geometric_relations(
    ids: Sequence[ObjectId],
    boxes: Boxes,
    *,
    up: str = "z",
    limits: Limits = USUAL,
    structure: Sequence[bool] | None = None,
) -> list[Relation]:
    """The relations between objects that follow from their boxes, each with a confidence and origin "geometry".

    ids: one per row of boxes. structure: which of them are known to be walls, floors, ceilings or rooms; those that
    look it are found anyway. The order of the result, and the result, do not depend on the order of the ids.
    """
    n = len(ids)
    if len(boxes.centers) != n or (structure is not None and len(structure) != n):
        raise SceneError(f"{n} ids but {len(boxes.centers)} boxes")
    if len(set(ids)) != n:
        raise SceneError("two boxes have the same id")
    # Everything below breaks ties by row, so rows go by id first.
    order = sorted(range(n), key=lambda row: (isinstance(ids[row], str), ids[row]))
    names = [ids[row] for row in order]
    rows = np.array(order, dtype=np.int64)
    ordered = Boxes(
        centers=boxes.centers[rows],
        extents=boxes.extents[rows],
        rotations=None if boxes.rotations is None else boxes.rotations[rows],
    )
    known = np.zeros(n, dtype=bool) if structure is None else np.asarray(structure, dtype=bool)[rows]
    found = relate(prisms(ordered, up), limits, known)
    relations: list[Relation] = []
    for label in LABELS:
        part = found[label]
        relations.extend(
            Relation(
                source=names[part.source[k]],
                target=names[part.target[k]],
                label=label,
                confidence=round(float(part.confidence[k]), 3),
                origin="geometry",
            )
            for k in np.lexsort((part.target, part.source))
        )
    return relations


def with_geometry(scene: SceneGraph, *, limits: Limits = USUAL) -> SceneGraph:
    """The scene with the relations that its boxes imply added, and which room each object is in.

    What the map itself says stays: a relation that it states already, with the same ends and label, is not added again.
    """
    objects = [obj for obj in scene.objects if obj.center is not None]
    stated = {(relation.source, relation.target, relation.label) for relation in scene.relations}
    added = [
        relation
        for relation in [
            *geometric_relations(
                [obj.id for obj in objects],
                settle_sides(boxes_of(objects), scene.up),
                up=scene.up,
                limits=limits,
                structure=[_named_structure(obj) for obj in objects],
            ),
            *contained_in_places(scene),
        ]
        if (relation.source, relation.target, relation.label) not in stated
    ]
    return dataclasses.replace(scene, relations=(*scene.relations, *added))


def boxes_of(objects: Sequence[SceneObject]) -> Boxes:
    """The boxes of objects that all have a center; those without an extent become points."""
    n = len(objects)
    rotations = None
    if any(obj.rotation is not None for obj in objects):
        rotations = np.array([np.eye(3) if obj.rotation is None else obj.rotation for obj in objects])
    return Boxes(
        centers=np.array([obj.center for obj in objects], dtype=np.float64).reshape(n, 3),
        extents=np.array([np.full(3, np.nan) if o.extent is None else o.extent for o in objects]).reshape(n, 3),
        rotations=rotations,
    )


def contained_in_places(scene: SceneGraph) -> list[Relation]:
    """``place contains object`` for the smallest place of each kind that an object's centre lies in.

    Objects that the map says are contained in something are left alone: the map knows better than a box.
    """
    contained = {relation.target for relation in scene.relations if relation.label == "contains"}
    objects = [obj for obj in scene.objects if obj.center is not None and obj.id not in contained]
    relations: list[Relation] = []
    if not objects:
        return relations
    centers = np.array([obj.center for obj in objects], dtype=np.float64)
    for kind in sorted({place.kind for place in scene.places}):
        holder: list[Place | None] = [None] * len(objects)
        sized = [place for place in scene.places if place.kind == kind and place.extent is not None]
        # The smallest comes last and so has the last word.
        for place in sorted(sized, key=_place_volume, reverse=True):
            assert place.center is not None and place.extent is not None
            within = (np.abs(centers - place.center) <= place.extent / 2.0).all(axis=1)
            for row in np.flatnonzero(within):
                holder[row] = place
        relations.extend(
            Relation(source=place.id, target=obj.id, label="contains", confidence=0.9, origin="geometry")
            for place, obj in zip(holder, objects, strict=True)
            if place is not None
        )
    return relations


def _place_volume(place: Place) -> float:
    return float("inf") if place.extent is None else float(np.prod(place.extent))


def _named_structure(obj: SceneObject) -> bool:
    """Whether an object's tag says wall, floor, ceiling or room: by its last word, so that a floor lamp is a lamp."""
    words = (obj.tag or "").casefold().split()
    return bool(words) and words[-1] in _STRUCTURE_WORDS
