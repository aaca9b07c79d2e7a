"""cgdb's own scene JSON: a whole scene graph as text, without loss; the same scene gives the same bytes.

The layout is for people and for diffs: one object, place or relation per line, fields that are None left out, mappings
in the order of their keys. Floats are written so that they read back bit by bit. A feature vector or point cloud is a
plain list while it is short, and above that ``{"dtype": "<f4", "shape": [512], "data": base64}`` of its little-endian
bytes. Views are written with their images, as base64 text.
``cgdb.ingest.scene_json`` reads it.
"""

from __future__ import annotations

import base64
from collections.abc import Iterable, Iterator, Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from cgdb.export.documents import Document, json_text, json_value
from cgdb.scene import Place, Relation, SceneGraph, SceneObject, View

VERSION = 2
"""Version 1 knew no views; a scene without any is still written as 1, which an older cgdb reads."""
LONGEST_LIST = 16
"""Arrays of up to this many numbers are written as a list, which a person can read and edit; longer ones as bytes."""


def scene_json(scene: SceneGraph) -> Document:
    """The scene as cgdb scene JSON. Nothing is left out."""
    return Document(pieces=_lines(scene))


def _lines(scene: SceneGraph) -> Iterator[str]:
    yield "{\n"
    yield f'"cgdb_scene": {VERSION if any(obj.views for obj in scene.objects) else 1},\n'
    for key in ("name", "frame", "up"):
        yield f'"{key}": {json_text(getattr(scene, key), f"the {key}")},\n'
    spaces = (_present(name=s.name, dimension=s.dimension, encoder=s.encoder) for s in scene.spaces)
    yield from _array("spaces", spaces, ",")
    yield f'"provenance": {json_text(json_value(scene.provenance, "the provenance"), "the provenance")},\n'
    yield from _array("objects", map(_object, scene.objects), ",")
    yield from _array("places", map(_place, scene.places), ",")
    yield from _array("relations", map(_relation, scene.relations), "")
    yield "}\n"


def _array(key: str, records: Iterable[dict[str, Any]], end: str) -> Iterator[str]:
    before = f'"{key}": ['
    separator = "\n"
    for record in records:
        yield before + separator + "  " + json_text(record, f"{key[:-1]} #{record.get('id', record.get('name', ''))}")
        before, separator = "", ",\n"
    yield (f"{before}]" if before else "\n]") + end + "\n"


def _object(obj: SceneObject) -> dict[str, Any]:
    where = f"object #{obj.id}"
    return _present(
        id=obj.id,
        tag=obj.tag,
        tags=list(obj.tags) or None,
        caption=obj.caption,
        center=_floats(obj.center),
        extent=_floats(obj.extent),
        rotation=_floats(obj.rotation),
        n_observations=None if obj.n_observations is None else int(obj.n_observations),
        confidence=None if obj.confidence is None else float(obj.confidence),
        properties=_properties(obj.properties, where),
        features={space: _encoded(obj.features[space], "<f4") for space in sorted(obj.features)} or None,
        points=None if obj.points is None else _encoded(obj.points, "<f4"),
        colors=None if obj.colors is None else _encoded(obj.colors, "|u1"),
        views=[_view(view) for view in obj.views] or None,
    )


def _view(view: View) -> dict[str, Any]:
    return _present(
        frame=int(view.frame),
        points=int(view.points),
        box=[float(side) for side in view.box],
        T_world_camera=_floats(view.T_world_camera),
        source=view.source,
        image=None if view.image is None else base64.b64encode(view.image).decode("ascii"),
    )


def _place(place: Place) -> dict[str, Any]:
    return _present(
        id=place.id,
        kind=place.kind,
        name=place.name,
        center=_floats(place.center),
        extent=_floats(place.extent),
        properties=_properties(place.properties, f"place #{place.id}"),
    )


def _relation(relation: Relation) -> dict[str, Any]:
    return _present(
        source=relation.source,
        label=relation.label,
        target=relation.target,
        confidence=float(relation.confidence),
        origin=relation.origin,
        explanation=relation.explanation,
    )


def _present(**fields: Any) -> dict[str, Any]:
    return {key: value for key, value in fields.items() if value is not None}


def _floats(array: NDArray[np.float64] | None) -> Any:
    return None if array is None else array.astype(np.float64).tolist()


def _properties(properties: Mapping[str, Any], where: str) -> Any:
    return json_value(properties, f"the properties of {where}") or None


def _encoded(array: NDArray[Any], dtype: str) -> Any:
    """The array as a list, or as its bytes where it is long or empty (an empty list would lose its shape)."""
    array = np.ascontiguousarray(array, dtype=dtype)
    if 0 < array.size <= LONGEST_LIST:
        return _short(array)
    return {"dtype": dtype, "shape": list(array.shape), "data": base64.b64encode(array.tobytes()).decode("ascii")}


def _short(array: NDArray[Any]) -> Any:
    if array.ndim > 1:
        return [_short(row) for row in array]
    if array.dtype.kind != "f":
        return array.tolist()
    return [_shortest(number) for number in array]


def _shortest(number: np.float32) -> float:
    """A double that prints short and is this float32 again when rounded: 0.1, not 0.10000000149011612."""
    short = float(str(number))
    # The detour over a double may round twice; where that shows, the exact value is written.
    return short if np.float32(short) == number else float(number)
