"""The codec of the ledger: records to rows and back, and the digest that makes a damaged row noticed.

The digest of a row is 63 bits of BLAKE2b over its identity (scene, key, ...) and its payload. What is stored is the
digest mixed with rev_from and rev_to (the *seal*): closing a row needs no new digest, two rows with the same content
are known by it, and a flipped bit anywhere in the row no longer fits.
"""

from __future__ import annotations

import json
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from hashlib import blake2b
from struct import Struct
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from cgdb.errors import CorruptionError, SceneError
from cgdb.scene import ObjectId, Place, PropertyValue, Relation, SceneObject, View, canonical_id

MASK = 2**63 - 1

_JSON = json.JSONEncoder(ensure_ascii=False, separators=(",", ":"), allow_nan=False)

NodePayload: TypeAlias = tuple[
    str, str, str | None, str | None, str | None, bytes | None, int | None, float | None, str | None
]
"""id, label, tag, tags, caption, box, n_observations, confidence, properties: the columns of ``nodes``, in order."""

RelationPayload: TypeAlias = tuple[int, int, str, str, float, str | None]
"""source, target, label, origin, confidence, explanation."""

ViewPayload: TypeAlias = tuple[int, int, int, bytes, bytes | None, str | None, bytes | None]
"""n_views, frame, points, box, pose, source, the digest of the image."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class NodeRow:
    """An object or a place as stored. label is "Object" or the place's kind; tag is a place's name.

    center, extent: (3,) float64 m; rotation: (3, 3) float64. key is the node's number within its scene.
    """

    key: int
    id: ObjectId
    label: str
    tag: str | None
    tags: tuple[str, ...]
    caption: str | None
    center: NDArray[np.float64] | None
    extent: NDArray[np.float64] | None
    rotation: NDArray[np.float64] | None
    n_observations: int | None
    confidence: float | None
    properties: Mapping[str, PropertyValue]


@dataclass(frozen=True, slots=True, kw_only=True)
class RelationRow:
    """A relation as stored; source and target are node keys."""

    source: int
    target: int
    label: str
    confidence: float
    explanation: str | None
    origin: str


# --- digests ---------------------------------------------------------------------------------------------------------

_NODE = Struct("<qqqdiiiiiii")
_RELATION = Struct("<qqqdiii")
_FEATURE = Struct("<qqi")
_CLOUD = Struct("<qqq?")
_VIEW = Struct("<qqqqqqiiii")
_BOX = Struct("<4d")
_WORD = Struct("<q")


def _digest(data: bytes) -> int:
    return int.from_bytes(blake2b(data, digest_size=8).digest(), "little") & MASK


def _length(value: str | bytes | None) -> int:
    return -1 if value is None else len(value)


def node_digest(scene_id: int, key: int, payload: NodePayload) -> int:
    """The digest of a row of ``nodes``."""
    ident, label, tag, tags, caption, box, n_observations, confidence, properties = payload
    head = _NODE.pack(
        scene_id,
        key,
        -1 if n_observations is None else n_observations,
        math.nan if confidence is None else confidence,
        len(ident),
        len(label),
        _length(tag),
        _length(tags),
        _length(caption),
        _length(box),
        _length(properties),
    )
    text = f"{ident}{label}{tag or ''}{tags or ''}{caption or ''}{properties or ''}"
    return _digest(b"".join((head, text.encode(), box or b"")))


def relation_digest(scene_id: int, payload: RelationPayload) -> int:
    """The digest of a row of ``relations``."""
    source, target, label, origin, confidence, explanation = payload
    head = _RELATION.pack(scene_id, source, target, confidence, len(label), len(origin), _length(explanation))
    return _digest(head + f"{label}{origin}{explanation or ''}".encode())


def feature_digest(scene_id: int, space: bytes, key: int, vector: bytes) -> int:
    """The digest of a row of ``features``. space: the name in UTF-8."""
    return _digest(b"".join((_FEATURE.pack(scene_id, key, len(space)), space, vector)))


def cloud_digest(scene_id: int, key: int, n_points: int, colored: bool, data: bytes) -> int:
    """The digest of a row of ``clouds``."""
    return _digest(_CLOUD.pack(scene_id, key, n_points, colored) + data)


def view_digest(scene_id: int, key: int, rank: int, payload: ViewPayload) -> int:
    """The digest of a row of ``views``."""
    n_views, frame, points, box, pose, source, image = payload
    name = None if source is None else source.encode()
    lengths = (len(box), _length(pose), _length(name), _length(image))
    head = _VIEW.pack(scene_id, key, rank, n_views, frame, points, *lengths)
    return _digest(b"".join((head, box, pose or b"", name or b"", image or b"")))


def image_digest(data: bytes) -> bytes:
    """16 bytes by which an image is found, and known to be what was written."""
    return blake2b(data, digest_size=16).digest()


def record_digest(values: Sequence[object]) -> int:
    """The digest of a row of the small tables: revisions, scenes, scene_versions."""
    # default=repr: a damaged row may hold bytes where text was; that must differ, not raise.
    return _digest(json.dumps(list(values), default=repr).encode())


def seal(digest: int, rev_from: int, rev_to: int | None) -> int:
    """The digest mixed with the row's revisions. Its own inverse: ``seal(seal(d, a, b), a, b) == d``."""
    try:
        # Odd factors: no two revisions give the same mark.
        mark = rev_from * 0x1E3779B97F4A7C15
        if rev_to is not None:
            mark ^= (rev_to + 1) * 0x42B2AE3D27D4EB4F
        return digest ^ (mark & MASK)
    except TypeError:
        # SQLite's columns take any type: a damaged row may hold text or bytes where numbers were.
        raise CorruptionError("a row of the ledger is damaged: its revisions or its seal are no numbers") from None


# --- objects and places ----------------------------------------------------------------------------------------------


def id_text(value: object) -> str:
    """The text under which an id is stored; ``canonical_id`` brings it back."""
    return str(canonical_id(value))


def object_payload(obj: SceneObject) -> NodePayload:
    """A checked object as the columns of ``nodes``; SceneError where a value cannot be stored."""
    where = f"object #{obj.id}"
    return (
        id_text(obj.id),
        "Object",
        _text(where, "tag", obj.tag),
        _dump_tags(where, obj.tags) if obj.tags else None,
        _text(where, "caption", obj.caption),
        None if obj.center is None else _pack_box(obj.center, obj.extent, obj.rotation),
        None if obj.n_observations is None else _count(where, obj.n_observations),
        None if obj.confidence is None else float(obj.confidence),
        _dump_properties(obj.properties) if obj.properties else None,
    )


def place_payload(place: Place) -> NodePayload:
    """A checked place as the columns of ``nodes``; its name is the tag."""
    where = f"place #{place.id}"
    return (
        id_text(place.id),
        place.kind,
        _text(where, "name", place.name),
        None,
        None,
        None if place.center is None else _pack_box(place.center, place.extent, None),
        None,
        None,
        _dump_properties(place.properties) if place.properties else None,
    )


def node_row(key: int, payload: NodePayload) -> NodeRow:
    """The record of a verified row."""
    ident, label, tag, tags, caption, box, n_observations, confidence, properties = payload
    center = extent = rotation = None
    if box is not None:
        numbers = np.frombuffer(box, "<f8")
        center = numbers[:3]
        if len(numbers) in (6, 15):
            extent = numbers[3:6]
        if len(numbers) in (12, 15):
            rotation = numbers[-9:].reshape(3, 3)
    return NodeRow(
        key=key,
        id=canonical_id(ident),
        label=label,
        tag=tag,
        tags=() if tags is None else tuple(json.loads(tags)),
        caption=caption,
        center=center,
        extent=extent,
        rotation=rotation,
        n_observations=n_observations,
        confidence=confidence,
        properties={} if properties is None else _load_properties(properties),
    )


def _pack_box(
    center: NDArray[np.float64], extent: NDArray[np.float64] | None, rotation: NDArray[np.float64] | None
) -> bytes:
    # The lengths 3, 6, 12 and 15 say which parts are there.
    box = np.asarray(center, "<f8").tobytes()
    if extent is not None:
        box += np.asarray(extent, "<f8").tobytes()
    if rotation is not None:
        box += np.asarray(rotation, "<f8").tobytes()
    return box


def check_text(what: str, value: str) -> None:
    """SceneError where a text is none that can be stored (half a surrogate pair, from a badly decoded file)."""
    try:
        value.encode()
    except (UnicodeEncodeError, AttributeError):
        raise SceneError(f"{what} cannot be stored: {value!r:.80} is not valid text") from None


def _text(where: str, what: str, value: str | None) -> str | None:
    if value is None or isinstance(value, str):
        return value
    raise SceneError(f"{where}: {what} must be text, not {type(value).__name__}")


def _count(where: str, value: int) -> int:
    if value > MASK:
        raise SceneError(f"{where}: n_observations is larger than 2**63")
    return int(value)


def _dump_tags(where: str, tags: tuple[str, ...]) -> str:
    for tag in tags:
        _text(where, "a tag", tag)
    return _JSON.encode(tags)


def _dump_properties(properties: Mapping[str, PropertyValue]) -> str:
    return _JSON.encode(dict(properties))


def _load_properties(text: str) -> dict[str, PropertyValue]:
    loaded: dict[str, Any] = json.loads(text)
    return {name: tuple(value) if isinstance(value, list) else value for name, value in loaded.items()}


# --- relations, features, clouds, views ------------------------------------------------------------------------------


def relation_payload(source: int, target: int, relation: Relation) -> RelationPayload:
    """A checked relation between two keys, as the columns of ``relations``."""
    where = f"relation #{relation.source} {relation.label!r} #{relation.target}"
    explanation = _text(where, "explanation", relation.explanation)
    return source, target, relation.label, relation.origin, float(relation.confidence), explanation


def relation_row(payload: RelationPayload) -> RelationRow:
    """The record of a verified row."""
    source, target, label, origin, confidence, explanation = payload
    return RelationRow(
        source=source, target=target, label=label, confidence=confidence, explanation=explanation, origin=origin
    )


def vector_bytes(vector: NDArray[np.float32]) -> bytes:
    """A vector as stored: float32, little-endian."""
    return np.asarray(vector, "<f4").tobytes()


def cloud_payload(points: NDArray[np.float32], colors: NDArray[np.uint8] | None) -> tuple[int, bool, bytes]:
    """A point cloud as n_points, colored, data."""
    data = np.asarray(points, "<f4").tobytes()
    if colors is not None:
        data += np.asarray(colors, np.uint8).tobytes()
    return len(points), colors is not None, data


def cloud_arrays(n_points: int, colored: bool, data: bytes) -> tuple[NDArray[np.float32], NDArray[np.uint8] | None]:
    """points (n, 3) float32 m and colors (n, 3) uint8 of a verified row."""
    points = np.frombuffer(data, "<f4", count=3 * n_points).reshape(n_points, 3)
    if not colored:
        return points, None
    return points, np.frombuffer(data, np.uint8, offset=12 * n_points).reshape(n_points, 3)


def view_payload(where: str, view: View, n_views: int) -> ViewPayload:
    """A checked view as the columns of ``views``. where: the object, for errors; n_views: how many it has."""
    return (
        n_views,
        int(view.frame),
        int(view.points),
        _BOX.pack(*view.box),
        None if view.T_world_camera is None else np.asarray(view.T_world_camera, "<f8").tobytes(),
        _text(where, "a view's source", view.source),
        None if view.image is None else image_digest(view.image),
    )


def view_record(payload: ViewPayload, image: bytes | None) -> View:
    """The view of a verified row and its image."""
    _, frame, points, box, pose, source, _ = payload
    left, top, right, bottom = _BOX.unpack(box)
    return View(
        frame=frame,
        points=points,
        box=(left, top, right, bottom),
        T_world_camera=None if pose is None else np.frombuffer(pose, "<f8").reshape(4, 4),
        image=image,
        source=source,
    )
