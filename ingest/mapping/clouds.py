"""From the map in the making to a scene graph: each object's cloud, box, features, best views and provenance."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from cgdb.ingest.mapping.clusters import pieces
from cgdb.ingest.mapping.upright import upright_box
from cgdb.scene import FeatureSpace, PropertyValue, SceneGraph, SceneObject, View

if TYPE_CHECKING:
    from cgdb.ingest.mapping.crops import Crops
    from cgdb.ingest.mapping.fuse import MapObject
    from cgdb.ingest.mapping.mapper import Mapper
    from cgdb.ingest.mapping.voxels import Ints, Voxels

SMALLEST_PIECE = 0.05
"""A piece of an object's cloud stays where it has at least this share of its voxels: a table seen in two parts."""

COARSE = 2
"""Voxels along a side of which the room keeps one: 5 cm."""
_CHUNK = 1 << 17
"""Voxels that are looked at together."""


def scene_of(
    mapper: Mapper, name: str, *, up: str = "z", encoder: str | None = None, provenance: dict[str, Any] | None = None
) -> SceneGraph:
    """The objects that were seen often enough, with their clouds. encoder: of the features; texts find them by it."""
    how = mapper.how.tidying
    clouds = object_rows(mapper)
    units = {space: mapper.objects.features.unit(space) for space in mapper.objects.features.spaces()}
    made = []
    for at, obj in enumerate(mapper.objects.all):
        rows = clouds[at]
        if obj.n < how.least_detections or len(rows) < how.least_voxels:
            continue
        features = {
            space: values[at].copy() for space, values in units.items() if values is not None and values[at].any()
        }
        made.append(scene_object(obj, rows, mapper.voxels, features, up, mapper.objects.crops))
    spaces = tuple(
        FeatureSpace(name=space, dimension=d, encoder=encoder) for space, d in mapper.objects.features.spaces().items()
    )
    return SceneGraph(
        name=name,
        objects=tuple(made),
        up=up,
        spaces=spaces,
        provenance={
            "made_by": "cgdb map",
            "frames": mapper.frames,
            "detections": mapper.detections,
            "parameters": mapper.how.as_record(),
            **(provenance or {}),
        },
    )


def object_rows(mapper: Mapper) -> list[Ints]:
    """The voxels of each object, ascending: those that most of what was seen there says are its, in pieces of size."""
    voxels, how, n = mapper.voxels, mapper.how.tidying, len(mapper.objects)
    places = mapper.objects.places()
    found = []
    for start in range(0, voxels.count, _CHUNK):
        part = slice(start, min(start + _CHUNK, voxels.count))
        row, slot = np.nonzero(voxels.solid(part, how.share, how.strength))
        found.append(((row + start).astype(np.int32), places.take(voxels.owners[part][row, slot])))
    place = np.concatenate([np.zeros(0, np.int32), *(row for row, _ in found)])
    owner = np.concatenate([np.zeros(0, np.int32), *(at for _, at in found)])
    del found
    # Sixteen bits are sorted without comparing.
    order = np.argsort(owner.astype(np.uint16) if n < 1 << 16 else owner, kind="stable")
    place = place[order]
    ends = np.cumsum(np.bincount(owner, minlength=n)).tolist()
    rows = np.split(place, ends[:-1]) if n else []
    room = [at for at, obj in enumerate(mapper.objects.all) if obj.background]
    for at in room:
        rows[at] = rows[at][_thinned(rows[at], voxels)]
    batch, size = [], 0
    for at in sorted(set(range(n)) - set(room)):
        batch.append(at)
        size += len(rows[at])
        if size > _CHUNK:
            _keep_pieces(batch, rows, mapper)
            batch, size = [], 0
    _keep_pieces(batch, rows, mapper)
    return rows


def _keep_pieces(batch: list[int], rows: list[Ints], mapper: Mapper) -> None:
    """Let the things of a batch keep the voxels that are in pieces of size: together, but not all at once."""
    owner = np.repeat(np.arange(len(batch), dtype=np.int32), [len(rows[at]) for at in batch])
    cells = mapper.voxels.cells.take(np.concatenate([np.zeros(0, np.int32), *(rows[at] for at in batch)]), axis=0)
    how = mapper.how.lifting
    kept = pieces(owner, cells, np.zeros(len(batch), np.bool_), side=how.cell, core=how.core, least=SMALLEST_PIECE)
    start = 0
    for at in batch:
        rows[at], start = rows[at][kept[start : start + len(rows[at])]], start + len(rows[at])


def _thinned(rows: Ints, voxels: Voxels) -> NDArray[np.bool_]:
    """(m,) bool: of voxels, ascending, the most seen one in every COARSE ** 3.

    Walls and floors are nine tenths of a map's voxels, and nobody asks for their grain.
    """
    kept = np.zeros(len(rows), np.bool_)
    if not len(rows):
        return kept
    code = np.zeros(len(rows), np.int64)
    for axis in range(3):
        side = voxels.cells[:, axis].take(rows) // np.int32(COARSE)
        code = code * (int(side.max()) - int(side.min()) + 1) + (side - side.min())
    order = np.lexsort((-voxels.seen.take(rows), code))
    code = code[order]
    kept[order[np.r_[True, code[1:] != code[:-1]]]] = True
    return kept


def scene_object(
    obj: MapObject,
    rows: Ints,
    voxels: Voxels,
    features: dict[str, NDArray[np.float32]],
    up: str,
    crops: Crops,
) -> SceneObject:
    """One object of the map as the store takes it."""
    points = voxels.mean_points(rows)
    center, extent, rotation = upright_box(points, up)
    properties: dict[str, PropertyValue] = {
        "background": obj.background,
        "first_frame": obj.first,
        "last_frame": obj.last,
        "n_views": len(obj.views),
    }
    return SceneObject(
        id=obj.id,
        tag=obj.label or None,
        tags=tuple(name for name, _ in obj.labels.most_common(5)),
        center=center,
        extent=extent,
        rotation=rotation,
        features=features,
        points=points,
        colors=voxels.mean_colors(rows),
        n_observations=obj.n,
        confidence=min(1.0, max(0.0, obj.confidence / obj.n)),
        properties=properties,
        views=tuple(
            View(
                frame=one.frame,
                points=one.points,
                box=one.box,
                T_world_camera=one.pose,
                image=None if one.crop is None else crops.get(one.crop),
                source=one.name or None,
            )
            for one in sorted(obj.views, reverse=True)
        ),
    )
