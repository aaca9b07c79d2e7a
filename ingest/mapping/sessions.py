"""A map that is gone on with another day: from its state, or from the scene that became of it."""

from __future__ import annotations

import heapq
from collections import Counter
from collections.abc import Mapping as MappingOf
from dataclasses import replace

import numpy as np

from cgdb.errors import UsageError
from cgdb.ingest.mapping.fuse import MapObject, Sighting
from cgdb.ingest.mapping.lift import STRONG
from cgdb.ingest.mapping.mapper import Mapper, Mapping, Session
from cgdb.ingest.mapping.oriented import extremes
from cgdb.scene import ObjectId, PropertyValue, SceneGraph, SceneObject

Names = tuple[str | None, tuple[str, ...]]
"""The tag and the tags of an object."""

CERTAIN = 3
"""Sightings that a voxel of a finished map is worth: new ones can outvote it, one cannot."""


def mapper_of(scene: SceneGraph, how: Mapping) -> Mapper:
    """A mapper that goes on with a scene that was mapped: its objects with their ids, clouds, features and views.

    What a scene does not hold is lost: weak claims, the scatter of features, and who was seen beside whom. UsageError
    where the scene is none that `cgdb map` made.
    """
    mapper = Mapper(how)
    objects, ids = mapper.objects, [obj.id for obj in scene.objects]
    if scene.provenance.get("made_by") != "cgdb map" or not all(isinstance(name, int) and name >= 0 for name in ids):
        raise UsageError(f"scene '{scene.name}' was not made by cgdb map, so it cannot be mapped further")
    records, sums = [], {space.name: np.zeros((len(ids), space.dimension), np.float32) for space in scene.spaces}
    for at, obj in enumerate(scene.objects):
        if obj.points is None or obj.colors is None or not len(obj.points):
            raise UsageError(f"scene '{scene.name}': object {obj.id} has no cloud, so the map cannot be gone on with")
        records.append(_object_of(mapper, obj, at))
        for space, feature in obj.features.items():
            sums[space][at] = feature * max(records[-1].n, 1)
    objects.adopt(records, sums)
    about = scene.provenance
    mapper.frames, mapper.detections = int(about.get("frames", 0)), int(about.get("detections", 0))
    mapper.newest = mapper.cared = max((obj.last for obj in records), default=-1)
    mapper.sessions = [Session(str(one["recording"]), int(one["first"])) for one in about.get("sessions", ())]
    if not mapper.sessions:
        mapper.sessions = [Session(str(about.get("recording", scene.name)), 0)]
    return mapper


def _object_of(mapper: Mapper, obj: SceneObject, at: int) -> MapObject:
    """The object, its points back in the voxels."""
    assert obj.points is not None and obj.colors is not None
    voxels, n = mapper.voxels, obj.n_observations or 1
    rows, _ = voxels.add_samples(obj.points.astype(np.float32), obj.colors)
    worth = np.full(len(rows), STRONG * min(n, CERTAIN), np.float32)
    voxels.vote(rows, np.full(len(rows), obj.id, np.int32), worth)
    labels = Counter(dict.fromkeys(obj.tags, 1))
    if obj.tag:
        labels[obj.tag] = n
    first, last = (_whole(obj.properties, name) for name in ("first_frame", "last_frame"))
    seen = [
        Sighting(
            view.points,
            view.frame,
            view.box,
            view.source or "",
            np.eye(4) if view.T_world_camera is None else view.T_world_camera,
            None if view.image is None else mapper.objects.crops.keep(view.image),
        )
        for view in obj.views
    ]
    heapq.heapify(seen)
    assert isinstance(obj.id, int)
    return MapObject(
        id=obj.id,
        low=voxels.cells[rows].min(axis=0),
        high=voxels.cells[rows].max(axis=0),
        background=bool(obj.properties.get("background", False)),
        first=first,
        last=last,
        n=n,
        widest=len(rows) // 2,  # a scene does not say; about half of a thing is seen at once
        confidence=n * (1.0 if obj.confidence is None else obj.confidence),
        labels=labels,
        views=seen,
        extremes=extremes(voxels.cells[rows], np.zeros(1, np.intp))[0],
    )


def _whole(properties: MappingOf[str, PropertyValue], name: str) -> int:
    value = properties.get(name, 0)
    return int(value) if isinstance(value, (int, float)) else 0


def carried(scene: SceneGraph, stored: SceneGraph, own: MappingOf[ObjectId, Names] | None = None) -> SceneGraph:
    """The scene with what others have said of its objects: names, captions, properties, and relations not of geometry.

    stored: the scene as the store holds it now. own: what the map itself called its objects in the revision that it
    wrote last; what is called otherwise now was named by somebody else. Of objects that are not in it only names that
    came from a model are. What others said stays, whatever the map calls the thing by now: they knew its vote.
    """
    own = own or {}
    known = {obj.id: obj for obj in stored.objects}
    objects = [_with_said(obj, known[obj.id], own.get(obj.id)) if obj.id in known else obj for obj in scene.objects]
    ends = {obj.id for obj in objects} | {place.id for place in stored.places}
    relations = [r for r in stored.relations if r.origin != "geometry" and r.source in ends and r.target in ends]
    return replace(
        scene, objects=tuple(objects), relations=(*scene.relations, *relations), places=(*scene.places, *stored.places)
    )


def names_of(obj: SceneObject) -> Names:
    """What an object is called."""
    return obj.tag, obj.tags


def _with_said(obj: SceneObject, known: SceneObject, own: Names | None) -> SceneObject:
    """The object with what the stored one was given by others. A caption, or "can be sat on", is of the thing and not
    of the day."""
    by_model = known.caption is not None or "tagged_by" in known.properties
    others = by_model if own is None else names_of(known) != own
    tag, tags = names_of(known if others and known.tag else obj)
    kept = {name: value for name, value in known.properties.items() if name not in _OWN}
    return replace(obj, tag=tag, tags=tags, caption=known.caption or obj.caption, properties={**kept, **obj.properties})


_OWN = frozenset({"background", "first_frame", "last_frame", "n_views", "last_session"})
"""Properties that mapping always sets. Whether a thing is present is only said anew where somebody looked."""
