"""cgdb's own scene JSON, read back: the scene graph that ``cgdb.export`` wrote, bit by bit.

A stranger's file is read as strictly as one's own: an unknown field, a wrong type or a wrong shape is refused by name,
because a misspelled field that is dropped in silence is lost data.
"""

from __future__ import annotations

import base64
import binascii
import math
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from cgdb.errors import FormatError, SceneError, did_you_mean, one_of
from cgdb.ingest.source import Source
from cgdb.scene import (
    LARGEST_IMAGE,
    MOST_VIEWS,
    FeatureSpace,
    ObjectId,
    Place,
    PropertyValue,
    Relation,
    SceneGraph,
    SceneObject,
    View,
    canonical_id,
    check_scene,
)

VERSION = 2

_SCENE = ("cgdb_scene", "name", "frame", "up", "spaces", "provenance", "objects", "places", "relations")
_SPACE = ("name", "dimension", "encoder")
_OBJECT = (
    *("id", "tag", "tags", "caption", "center", "extent", "rotation", "n_observations", "confidence", "properties"),
    *("features", "points", "colors", "views"),
)
_VIEW = ("frame", "points", "box", "T_world_camera", "source", "image")
_PLACE = ("id", "kind", "name", "center", "extent", "properties")
_RELATION = ("source", "label", "target", "confidence", "origin", "explanation")


def matches(sniffed: object) -> bool:
    """Whether the parsed JSON is a cgdb scene: its top level says so."""
    return isinstance(sniffed, dict) and "cgdb_scene" in sniffed


def read(path: Path, name: str | None = None) -> SceneGraph:
    """The checked scene of the file, under the name given or else its own; FormatError or SceneError names the file."""
    try:
        document = Source(path).value()
    except FormatError as error:
        raise FormatError(f"{path}: {error.message}", hint=error.hint) from error
    return from_document(document, name, source=str(path))


def from_document(document: object, name: str | None = None, *, source: str = "scene JSON") -> SceneGraph:
    """The checked scene of a parsed document. source names it in errors."""
    try:
        scene = _scene(document, name)
        check_scene(scene)
    except (FormatError, SceneError) as error:
        raise type(error)(f"{source}: {error.message}", hint=error.hint) from error
    except RecursionError as error:
        raise FormatError(f"{source}: is nested too deep to be a scene") from error
    return scene


def _scene(document: object, name: str | None) -> SceneGraph:
    where = "the document"
    if not isinstance(document, dict) or "cgdb_scene" not in document:
        raise FormatError("is not a cgdb scene: there is no 'cgdb_scene' at its top level")
    version = document["cgdb_scene"]
    if isinstance(version, bool) or not isinstance(version, int) or version < 1:
        raise FormatError(f"'cgdb_scene' must be a format version, {VERSION}, not {_shown(version)}")
    if version > VERSION:
        raise FormatError(
            f"was written in version {_shown(version)} of the scene format; this cgdb reads up to {VERSION}",
            hint="pip install --upgrade cgdb",
        )
    _known_fields(document, _SCENE, where)
    spaces = tuple(_space(record, i) for i, record in enumerate(_records(document, "spaces")))
    names = [space.name for space in spaces]
    if len(set(names)) < len(names):
        twice = next(n for n in names if names.count(n) > 1)
        raise FormatError(f"the feature space {twice!r} is declared twice")
    dimensions = {space.name: space.dimension for space in spaces}
    provenance = document.get("provenance") or {}
    if not isinstance(provenance, dict):
        raise FormatError(f"'provenance' must be an object, not {_shown(provenance)}")
    _check_finite(provenance, "'provenance'")
    frame, up = _optional_text(document, "frame", where), _optional_text(document, "up", where)
    return SceneGraph(
        name=name if name is not None else _text(document, "name", where),
        objects=tuple(_object(record, i, dimensions) for i, record in enumerate(_records(document, "objects"))),
        relations=tuple(_relation(record, i) for i, record in enumerate(_records(document, "relations"))),
        places=tuple(_place(record, i) for i, record in enumerate(_records(document, "places"))),
        frame="map" if frame is None else frame,
        up="z" if up is None else up,
        spaces=spaces,
        provenance=provenance,
    )


def _space(record: dict[str, Any], index: int) -> FeatureSpace:
    where = f"space {index}"
    _known_fields(record, _SPACE, where)
    dimension = record.get("dimension")
    if isinstance(dimension, bool) or not isinstance(dimension, int) or not 0 < dimension <= 2**20:
        raise FormatError(f"{where}: 'dimension' must be a number from 1 to {2**20}, not {_shown(dimension)}")
    encoder = _optional_text(record, "encoder", where)
    return FeatureSpace(name=_text(record, "name", where), dimension=dimension, encoder=encoder)


def _object(record: dict[str, Any], index: int, dimensions: Mapping[str, int]) -> SceneObject:
    object_id = _id(record, "id", f"object {index}")
    where = f"object #{object_id}"
    _known_fields(record, _OBJECT, where)
    return SceneObject(
        id=object_id,
        tag=_optional_text(record, "tag", where),
        tags=_texts(record, "tags", where),
        caption=_optional_text(record, "caption", where),
        center=_array(record, "center", where, "<f8", (3,)),
        extent=_array(record, "extent", where, "<f8", (3,)),
        rotation=_array(record, "rotation", where, "<f8", (3, 3)),
        features=_features(record, where, dimensions),
        points=_array(record, "points", where, "<f4", (None, 3)),
        colors=_array(record, "colors", where, "|u1", (None, 3)),
        n_observations=_count(record, "n_observations", where),
        confidence=_number(record, "confidence", where),
        properties=_properties(record, where),
        views=_views(record, where),
    )


def _views(record: dict[str, Any], where: str) -> tuple[View, ...]:
    value = record.get("views")
    if value is None:
        return ()
    if not isinstance(value, list) or len(value) > MOST_VIEWS or not all(isinstance(item, dict) for item in value):
        raise FormatError(f"{where}: 'views' must be a list of at most {MOST_VIEWS} views, not {_shown(value)}")
    return tuple(_view(item, f"{where}: view {rank}") for rank, item in enumerate(value, start=1))


def _view(record: dict[str, Any], where: str) -> View:
    _known_fields(record, _VIEW, where)
    for key in ("frame", "points", "box"):
        if record.get(key) is None:
            raise FormatError(f"{where}: has no '{key}'")
    left, top, right, bottom = _array(record, "box", where, "<f8", (4,)).tolist()
    return View(
        frame=_whole(record["frame"], f"{where}: 'frame'"),
        points=_whole(record["points"], f"{where}: 'points'"),
        box=(left, top, right, bottom),
        T_world_camera=_array(record, "T_world_camera", where, "<f8", (4, 4)),
        image=_image(record, where),
        source=_optional_text(record, "source", where),
    )


def _image(record: dict[str, Any], where: str) -> bytes | None:
    text = _optional_text(record, "image", where)
    if text is None:
        return None
    if len(text) > 4 * -(-LARGEST_IMAGE // 3):
        raise FormatError(f"{where}: 'image' is larger than {LARGEST_IMAGE:,} bytes")
    try:
        return base64.b64decode(text, validate=True)
    except (binascii.Error, ValueError) as error:
        raise FormatError(f"{where}: 'image' is not base64 text") from error


def _place(record: dict[str, Any], index: int) -> Place:
    place_id = _id(record, "id", f"place {index}")
    where = f"place #{place_id}"
    _known_fields(record, _PLACE, where)
    kind = _optional_text(record, "kind", where)
    return Place(
        id=place_id,
        kind="Place" if kind is None else kind,
        name=_optional_text(record, "name", where),
        center=_array(record, "center", where, "<f8", (3,)),
        extent=_array(record, "extent", where, "<f8", (3,)),
        properties=_properties(record, where),
    )


def _relation(record: dict[str, Any], index: int) -> Relation:
    where = f"relation {index}"
    _known_fields(record, _RELATION, where)
    confidence, origin = _number(record, "confidence", where), _optional_text(record, "origin", where)
    return Relation(
        source=_id(record, "source", where),
        target=_id(record, "target", where),
        label=_text(record, "label", where),
        confidence=1.0 if confidence is None else confidence,
        explanation=_optional_text(record, "explanation", where),
        origin="imported" if origin is None else origin,
    )


def _records(document: dict[str, Any], key: str) -> list[dict[str, Any]]:
    records = document.get(key)
    if records is None:
        return []
    if not isinstance(records, list):
        raise FormatError(f"'{key}' must be a list, not {_shown(records)}")
    for index, record in enumerate(records):
        if not isinstance(record, dict):
            raise FormatError(f"{key[:-1]} {index}: must be an object with fields, not {_shown(record)}")
    return records


def _known_fields(record: dict[str, Any], known: tuple[str, ...], where: str) -> None:
    for key in record:
        if key not in known:
            hint = did_you_mean(key, known) or f"known here: {one_of(known, most=20)}"
            raise FormatError(f"{where}: unknown field {_shown(key)}", hint=hint)


def _id(record: dict[str, Any], key: str, where: str) -> ObjectId:
    if key not in record:
        raise FormatError(f"{where}: has no '{key}'")
    try:
        return canonical_id(record[key])
    except SceneError as error:
        raise FormatError(f"{where}: '{key}': {error.message}") from error


def _text(record: dict[str, Any], key: str, where: str) -> str:
    text = _optional_text(record, key, where)
    if text is None:
        raise FormatError(f"{where}: has no '{key}'")
    return text


def _optional_text(record: dict[str, Any], key: str, where: str) -> str | None:
    value = record.get(key)
    if value is not None and not isinstance(value, str):
        raise FormatError(f"{where}: '{key}' must be text, not {_shown(value)}")
    return value


def _texts(record: dict[str, Any], key: str, where: str) -> tuple[str, ...]:
    value = record.get(key)
    if value is None:
        return ()
    if not isinstance(value, list) or not all(isinstance(item, str) for item in value):
        raise FormatError(f"{where}: '{key}' must be a list of texts, not {_shown(value)}")
    return tuple(value)


def _number(record: dict[str, Any], key: str, where: str) -> float | None:
    value = record.get(key)
    return None if value is None else _finite(value, f"{where}: '{key}'")


def _count(record: dict[str, Any], key: str, where: str) -> int | None:
    value = record.get(key)
    return None if value is None else _whole(value, f"{where}: '{key}'")


def _whole(value: object, where: str) -> int:
    if isinstance(value, bool) or not isinstance(value, int) or not 0 <= value < 2**63:
        raise FormatError(f"{where} must be a count, not {_shown(value)}")
    return value


def _finite(value: object, where: str) -> float:
    if isinstance(value, bool) or not isinstance(value, (int, float)):
        raise FormatError(f"{where} must be a number, not {_shown(value)}")
    try:
        number = float(value)
    except OverflowError:
        number = math.inf
    if not math.isfinite(number):
        raise FormatError(f"{where} must be a finite number, not {_shown(value)}")
    return number


def _properties(record: dict[str, Any], where: str) -> dict[str, PropertyValue]:
    value = record.get("properties")
    if value is None:
        return {}
    if not isinstance(value, dict):
        raise FormatError(f"{where}: 'properties' must be an object with fields, not {_shown(value)}")
    return {key: tuple(item) if isinstance(item, list) else item for key, item in value.items()}


def _features(record: dict[str, Any], where: str, dimensions: Mapping[str, int]) -> dict[str, NDArray[np.float32]]:
    value = record.get("features")
    if value is None:
        return {}
    if not isinstance(value, dict):
        raise FormatError(f"{where}: 'features' must be an object with a vector per space, not {_shown(value)}")
    features = {}
    for space in value:
        if space not in dimensions:
            hint = did_you_mean(space, dimensions) or "declare it in 'spaces' with its dimension"
            raise FormatError(f"{where}: has a feature of the undeclared space {_shown(space)}", hint=hint)
        vector = _array(value, space, f"{where}: feature", "<f4", (dimensions[space],))
        if vector is None:
            raise FormatError(f"{where}: feature '{space}' is null; leave it out")
        features[space] = vector
    return features


def _array(record: dict[str, Any], key: str, where: str, dtype: str, shape: tuple[int | None, ...]) -> Any:
    """The array of a field: nested lists, or a record of its bytes; None in shape is any length."""
    value = record.get(key)
    if value is None:
        return None
    where = f"{where} '{key}'" if where.endswith("feature") else f"{where}: '{key}'"
    if isinstance(value, list):
        numbers = _listed(value, where, shape, _byte if dtype == "|u1" else _finite)
        sides: list[Any] = [len(value), *shape[1:]]  # an empty list has its sides too
        with np.errstate(over="ignore"):  # a number too large for float32 turns infinite; check_scene refuses it
            return np.array(numbers, dtype=np.float64).reshape(sides).astype(np.dtype(dtype).newbyteorder("="))
    if isinstance(value, dict):
        return _decoded(value, where, dtype, shape).astype(np.dtype(dtype).newbyteorder("="))
    raise FormatError(f"{where} must be a list of numbers or a record of bytes, not {_shown(value)}")


def _listed(value: object, where: str, shape: tuple[int | None, ...], read_one: Callable[[object, str], float]) -> Any:
    if not shape:
        return read_one(value, where)
    if not isinstance(value, list) or (shape[0] is not None and len(value) != shape[0]):
        size = "a list" if shape[0] is None else f"a list of {shape[0]}"
        got = f"one of {len(value)}" if isinstance(value, list) else _shown(value)
        raise FormatError(f"{where} must hold {size}, not {got}")
    return [_listed(item, where, shape[1:], read_one) for item in value]


def _byte(value: object, where: str) -> float:
    if isinstance(value, bool) or not isinstance(value, int) or not 0 <= value <= 255:
        raise FormatError(f"{where} must hold whole numbers from 0 to 255, not {_shown(value)}")
    return value


def _decoded(record: dict[str, Any], where: str, dtype: str, shape: tuple[int | None, ...]) -> NDArray[Any]:
    """The array of a {"dtype", "shape", "data"} record; its size must be that of its data before they are decoded."""
    if record.get("dtype") != dtype:
        raise FormatError(f"{where}: 'dtype' must be '{dtype}', not {_shown(record.get('dtype'))}")
    sides, data = record.get("shape"), record.get("data")
    if not isinstance(sides, list) or any(type(n) is not int or n < 0 for n in sides):
        raise FormatError(f"{where}: 'shape' must be a list of lengths, not {_shown(sides)}")
    if len(sides) != len(shape) or any(want is not None and n != want for n, want in zip(sides, shape, strict=True)):
        expected = "(" + ", ".join("n" if n is None else str(n) for n in shape) + ")"
        raise FormatError(f"{where}: has shape {_shown(sides)}, expected {expected}")
    if not isinstance(data, str):
        raise FormatError(f"{where}: 'data' must be base64 text, not {_shown(data)}")
    n_bytes = math.prod(sides) * np.dtype(dtype).itemsize
    if len(data) != 4 * -(-n_bytes // 3):
        raise FormatError(f"{where}: shape {_shown(sides)} needs {n_bytes} bytes, but 'data' holds another number")
    try:
        raw = base64.b64decode(data, validate=True)
    except (binascii.Error, ValueError) as error:
        raise FormatError(f"{where}: 'data' is not base64 text") from error
    if len(raw) != n_bytes:
        raise FormatError(f"{where}: shape {_shown(sides)} needs {n_bytes} bytes, but 'data' holds {len(raw)}")
    return np.frombuffer(raw, dtype=dtype).reshape(sides)


def _check_finite(value: object, where: str) -> None:
    if isinstance(value, float) and not math.isfinite(value):
        raise FormatError(f"{where} holds {value}")
    if isinstance(value, (dict, list)):
        for item in value.values() if isinstance(value, dict) else value:
            _check_finite(item, where)


def _shown(value: object) -> str:
    """The value short enough for one line of an error."""
    if isinstance(value, (dict, list)) and len(value) > 8:
        return f"a {type(value).__name__} of {len(value)}"
    try:
        text = repr(value)
    except (ValueError, RecursionError):  # an integer of more digits than Python prints
        return f"a {type(value).__name__}"
    return text if len(text) <= 60 else text[:57] + "..."
