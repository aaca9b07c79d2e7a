"""The core types: what an object, a relation, a place and a scene graph are, and the rules they keep.

All are frozen; arrays are float64 or float32 as stated, in metres, in the scene's frame.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from cgdb.errors import SceneError

ObjectId: TypeAlias = int | str
"""An id as its map gives it. Text that is a plain non-negative number below 2**63 is that number."""

PropertyValue: TypeAlias = "str | int | float | bool | tuple[str, ...] | tuple[float, ...] | None"
Vector: TypeAlias = NDArray[np.float32]

ORIGINS = ("geometry", "llm", "human", "imported")
UP_AXES = ("x", "y", "z", "-x", "-y", "-z")
_IDENTITY = np.eye(3)
LARGEST_COORDINATE = 1e7
"""Metres. A map of a place on Earth, even in UTM coordinates, stays below it; above it a file is damaged."""

LARGEST_IMAGE = 512 * 1024
"""Bytes of a view's image: it is a crop to look at, not the recording."""
MOST_VIEWS = 100
LARGEST_PIXEL = 1e6


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class View:
    """A frame in which an object was seen well.

    frame: its number in the recording, source: its file. points: how much of the object, free of noise, was seen in
    it. box: left, top, right, bottom in pixels of the frame as it was mapped. T_world_camera: (4, 4) float64, camera
    axes x right, y down, z forward. image: the object cut out of the frame, a JPEG, PNG or WebP file.
    """

    frame: int
    points: int
    box: tuple[float, float, float, float]
    T_world_camera: NDArray[np.float64] | None = None
    image: bytes | None = None
    source: str | None = None


class Unread(tuple[View, ...]):
    """No views, because they were not read: an object that is written back with it keeps those that are stored."""

    __slots__ = ()


UNREAD = Unread()


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class SceneObject:
    """One mapped object.

    center: (3,) float64 m, or None where the map has no geometry. extent: (3,) float64 m, full side lengths along
    the box's own axes. rotation: (3, 3) float64, columns are the box's axes in the scene frame; None = axis-aligned.
    features: {space name: (d,) float32}. points: (n, 3) float32 m; colors: (n, 3) uint8 RGB.
    confidence in [0, 1] or None. views: where it was seen, best first; UNREAD where they were not asked for.
    """

    id: ObjectId
    tag: str | None = None
    tags: tuple[str, ...] = ()
    caption: str | None = None
    center: NDArray[np.float64] | None = None
    extent: NDArray[np.float64] | None = None
    rotation: NDArray[np.float64] | None = None
    features: Mapping[str, Vector] = field(default_factory=dict)
    points: NDArray[np.float32] | None = None
    colors: NDArray[np.uint8] | None = None
    n_observations: int | None = None
    confidence: float | None = None
    properties: Mapping[str, PropertyValue] = field(default_factory=dict)
    views: tuple[View, ...] = ()


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Place:
    """A part of the place that was mapped: a room, a floor, a traversable spot. Lives in the ids of the objects.

    kind is its label in CGQL ("Room", "Place", "Building"). center, extent: as for objects, axis-aligned.
    """

    id: ObjectId
    kind: str = "Place"
    name: str | None = None
    center: NDArray[np.float64] | None = None
    extent: NDArray[np.float64] | None = None
    properties: Mapping[str, PropertyValue] = field(default_factory=dict)


@dataclass(frozen=True, slots=True, kw_only=True)
class Relation:
    """``source label target``: "cup on table" has the cup as its source. confidence in [0, 1]."""

    source: ObjectId
    target: ObjectId
    label: str
    confidence: float = 1.0
    explanation: str | None = None
    origin: str = "imported"


@dataclass(frozen=True, slots=True, kw_only=True)
class FeatureSpace:
    """A kind of vectors: its name, dimension, and the encoder that made them.

    encoder names the model ("open_clip:ViT-H-14:laion2b_s32b_b79k") so that texts can be brought into the same
    space; None where the map does not say.
    """

    name: str
    dimension: int
    encoder: str | None = None


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class SceneGraph:
    """A whole map. frame names the coordinate frame; up is the axis that points against gravity."""

    name: str
    objects: tuple[SceneObject, ...] = ()
    relations: tuple[Relation, ...] = ()
    places: tuple[Place, ...] = ()
    frame: str = "map"
    up: str = "z"
    spaces: tuple[FeatureSpace, ...] = ()
    provenance: Mapping[str, Any] = field(default_factory=dict)


def canonical_id(value: object) -> ObjectId:
    """The id that a map's value stands for: a number, or non-empty text. SceneError for anything else."""
    if isinstance(value, (bool, np.bool_)):
        raise SceneError(f"an id must be a number or text, not {value!r}")
    if isinstance(value, (int, np.integer)):
        number = int(value)
        if 0 <= number < 2**63:
            return number
        return str(number)
    if isinstance(value, str) and 0 < len(value) <= 256:
        # int() takes "1_0", " 1" and "٣" too; an id that is printed must read back as itself.
        if value.isascii() and value.isdigit() and (value == "0" or value[0] != "0") and int(value) < 2**63:
            return int(value)
        return value
    raise SceneError(f"an id must be a number or text of 1 to 256 characters, not {str(value)[:60]!r}")


def check_object(obj: SceneObject, dimensions: Mapping[str, int]) -> None:
    """Raise SceneError, naming the object, where it breaks a rule of its type. dimensions: {space: d}."""
    where = f"object #{obj.id}"
    _check_box(where, obj.center, obj.extent, obj.rotation)
    _check_properties(where, obj.properties)
    if obj.confidence is not None and not 0.0 <= obj.confidence <= 1.0:
        raise SceneError(f"{where}: confidence {obj.confidence} is not between 0 and 1")
    if obj.n_observations is not None and obj.n_observations < 0:
        raise SceneError(f"{where}: n_observations is negative ({obj.n_observations})")
    for space, vector in obj.features.items():
        if space not in dimensions:
            raise SceneError(f"{where}: has a feature of space '{space}', which the scene does not declare")
        if vector.shape != (dimensions[space],):
            raise SceneError(
                f"{where}: feature '{space}' has shape {vector.shape}, the space has dimension {dimensions[space]}"
            )
        if not np.isfinite(vector).all():
            raise SceneError(f"{where}: feature '{space}' holds NaN or infinite values")
    if obj.points is not None:
        if obj.points.ndim != 2 or obj.points.shape[1] != 3:
            raise SceneError(f"{where}: points have shape {obj.points.shape}, expected (n, 3)")
        if not np.isfinite(obj.points).all():
            raise SceneError(f"{where}: points hold NaN or infinite coordinates")
        if obj.colors is not None and obj.colors.shape != obj.points.shape:
            raise SceneError(f"{where}: {obj.points.shape[0]} points but colors of shape {obj.colors.shape}")
    elif obj.colors is not None:
        raise SceneError(f"{where}: has colors but no points")
    if len(obj.views) > MOST_VIEWS:
        raise SceneError(f"{where}: has {len(obj.views)} views, at most {MOST_VIEWS} are kept")
    for rank, view in enumerate(obj.views, start=1):
        _check_view(f"{where}: view {rank}", view)


def image_type(image: bytes) -> str | None:
    """The media type that the first bytes of an image tell ("image/jpeg", "image/png", "image/webp"), or None."""
    if image.startswith(b"\xff\xd8\xff"):
        return "image/jpeg"
    if image.startswith(b"\x89PNG\r\n\x1a\n"):
        return "image/png"
    if image.startswith(b"RIFF") and image[8:12] == b"WEBP":
        return "image/webp"
    return None


def check_place(place: Place) -> None:
    """Raise SceneError, naming the place, where it breaks a rule of its type."""
    where = f"place #{place.id}"
    if not place.kind.isidentifier() or place.kind == "Object":
        raise SceneError(f"{where}: kind {place.kind!r} must be a word, other than Object")
    _check_box(where, place.center, place.extent, None)
    _check_properties(where, place.properties)


def check_relation(relation: Relation) -> None:
    """Raise SceneError where a relation breaks a rule of its type (whether its ends exist is the scene's matter)."""
    where = f"relation #{relation.source} {relation.label!r} #{relation.target}"
    if not relation.label or len(relation.label) > 256:
        raise SceneError(f"{where}: the label must be text of 1 to 256 characters")
    if not (math.isfinite(relation.confidence) and 0.0 <= relation.confidence <= 1.0):
        raise SceneError(f"{where}: confidence {relation.confidence} is not between 0 and 1")
    if relation.origin not in ORIGINS:
        raise SceneError(f"{where}: origin {relation.origin!r} is none of {', '.join(ORIGINS)}")


def check_scene(scene: SceneGraph) -> None:
    """Raise SceneError where a whole scene breaks a rule: its parts', duplicate ids, a relation to nothing."""
    if not scene.name or len(scene.name) > 256 or "\x00" in scene.name:
        raise SceneError(f"a scene's name must be text of 1 to 256 characters, not {scene.name[:40]!r}")
    if scene.up not in UP_AXES:
        raise SceneError(f"scene '{scene.name}': up axis {scene.up!r} is none of {', '.join(UP_AXES)}")
    dimensions = {space.name: space.dimension for space in scene.spaces}
    seen: set[ObjectId] = set()
    for obj in scene.objects:
        check_object(obj, dimensions)
    for place in scene.places:
        check_place(place)
    for node_id in _node_ids(scene):
        if node_id in seen:
            raise SceneError(f"scene '{scene.name}': two nodes have the id #{node_id}")
        seen.add(node_id)
    for relation in scene.relations:
        check_relation(relation)
        for end in (relation.source, relation.target):
            if end not in seen:
                raise SceneError(
                    f"relation #{relation.source} {relation.label!r} #{relation.target}: "
                    f"there is no object or place #{end}"
                )


def _node_ids(scene: SceneGraph) -> Iterable[ObjectId]:
    yield from (obj.id for obj in scene.objects)
    yield from (place.id for place in scene.places)


def _check_box(
    where: str,
    center: NDArray[np.float64] | None,
    extent: NDArray[np.float64] | None,
    rotation: NDArray[np.float64] | None,
) -> None:
    if center is None:
        if extent is not None or rotation is not None:
            raise SceneError(f"{where}: has a box extent or rotation but no center")
        return
    if center.shape != (3,) or not all(map(math.isfinite, center.tolist())):
        raise SceneError(f"{where}: center {center.tolist()} is not three finite coordinates in metres")
    if max(map(abs, center.tolist())) > LARGEST_COORDINATE:
        raise SceneError(
            f"{where}: center {center.tolist()} lies farther than {LARGEST_COORDINATE:.0e} m from the origin"
        )
    if extent is not None:
        sides = extent.tolist()
        if extent.shape != (3,) or not all(map(math.isfinite, sides)):
            raise SceneError(f"{where}: extent {sides} is not three finite lengths in metres")
        if min(sides) < 0.0:
            raise SceneError(f"{where}: extent {sides} has a negative side")
        if max(sides) > LARGEST_COORDINATE:
            raise SceneError(f"{where}: extent {sides} is larger than {LARGEST_COORDINATE:.0e} m")
    if rotation is not None:
        if rotation.shape != (3, 3) or not np.isfinite(rotation).all():
            raise SceneError(f"{where}: rotation is not a finite 3 x 3 matrix")
        if np.abs(rotation @ rotation.T - _IDENTITY).max() > 1e-3:
            raise SceneError(f"{where}: rotation is not orthonormal")


def _check_view(where: str, view: View) -> None:
    for what, count in (("frame", view.frame), ("points", view.points)):
        if isinstance(count, bool) or not isinstance(count, (int, np.integer)) or not 0 <= count < 2**63:
            raise SceneError(f"{where}: {what} is {str(count)[:40]}, expected a number from 0 on")
    sides = view.box
    if len(sides) != 4 or not all(math.isfinite(side) and abs(side) <= LARGEST_PIXEL for side in sides):
        raise SceneError(f"{where}: box {str(tuple(sides))[:80]} is not left, top, right, bottom in pixels")
    if sides[0] > sides[2] or sides[1] > sides[3]:
        raise SceneError(f"{where}: box {tuple(sides)} ends before it begins")
    if view.T_world_camera is not None:
        _check_pose(where, view.T_world_camera)
    if view.source is not None and not 0 < len(view.source) <= 1024:
        raise SceneError(f"{where}: source must be text of 1 to 1024 characters")
    if view.image is not None:
        if len(view.image) > LARGEST_IMAGE:
            raise SceneError(f"{where}: its image has {len(view.image):,} bytes, at most {LARGEST_IMAGE:,} are kept")
        if image_type(view.image) is None:
            raise SceneError(f"{where}: its image is neither JPEG nor PNG nor WebP")


def _check_pose(where: str, pose: NDArray[np.float64]) -> None:
    if pose.shape != (4, 4) or not np.isfinite(pose).all():
        raise SceneError(f"{where}: T_world_camera is not a finite 4 x 4 matrix")
    if np.abs(pose[3] - (0.0, 0.0, 0.0, 1.0)).max() > 1e-6:
        raise SceneError(f"{where}: the last row of T_world_camera is not 0 0 0 1")
    turned = pose[:3, :3]
    if np.abs(pose).max() > LARGEST_COORDINATE or np.abs(turned @ turned.T - _IDENTITY).max() > 1e-3:
        raise SceneError(f"{where}: T_world_camera is not a turn and a shift in metres")


def _check_properties(where: str, properties: Mapping[str, PropertyValue]) -> None:
    for name, value in properties.items():
        if not name.isidentifier() or len(name) > 64:
            raise SceneError(f"{where}: property name {name[:70]!r} is not a word of letters, digits and _")
        items = value if isinstance(value, tuple) else (value,)
        for item in items:
            if isinstance(item, float) and not math.isfinite(item):
                raise SceneError(f"{where}: property '{name}' is {item}")
            if item is not None and not isinstance(item, (str, int, float, bool)):
                raise SceneError(f"{where}: property '{name}' has a value of type {type(item).__name__}")
