"""Truth as an annotated scene graph: which objects there are, what each may be called, and how they relate.

The objects of a labelled cloud are such a truth too, one without relations.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from cgdb.errors import CgdbError, FormatError, SceneError, UsageError
from cgdb.ingest import fields, strict_json
from cgdb.ingest.evaluation import labelled
from cgdb.ingest.evaluation.mapping import truth_of
from cgdb.ingest.report import Report
from cgdb.ingest.source import Source
from cgdb.scene import LARGEST_COORDINATE, Relation, SceneGraph, SceneObject, canonical_id


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class AnnotatedScene:
    """objects: with boxes or points where they are known; their tags are all they may be called. relations:
    all that hold. places: ids of rooms and the like, which relations may name. of_cloud: whether it is a labelled
    cloud, which says nothing of relations, and whose ids are its own."""

    objects: tuple[SceneObject, ...]
    relations: tuple[Relation, ...]
    places: frozenset[int | str] = frozenset()
    of_cloud: bool = False


def read_annotated(path: str | Path) -> AnnotatedScene:
    """The truth of a file. FormatError or SceneError says in one line what is wrong with it."""
    path = Path(path)
    if not path.exists():
        raise UsageError(f"there is no truth at {path}")
    cloud = labelled.truth_in(path) if path.is_dir() else path if labelled.is_cloud(path) else None
    if cloud is not None:
        return _of_cloud(labelled.read_labelled(cloud), str(cloud))
    try:
        source = Source(path)
        value = source.value() if source.kind == "json" else None
        if isinstance(value, dict) and _is_annotated(value):
            return _annotated(value)
        return _of_map(path)
    except CgdbError as error:
        if not error.message.startswith(str(path)):
            error.message = f"{path}: {error.message}"
        raise


def _is_annotated(value: Mapping[str, Any]) -> bool:
    objects = value.get("objects")
    return isinstance(objects, list) and any(isinstance(one, dict) and "names" in one for one in objects[:1000])


def _of_map(path: Path) -> AnnotatedScene:
    from cgdb.ingest.loading import load

    scene: SceneGraph = load(path, relate=False)
    return AnnotatedScene(
        objects=scene.objects, relations=scene.relations, places=frozenset(place.id for place in scene.places)
    )


def _of_cloud(cloud: labelled.LabelledCloud, where: str) -> AnnotatedScene:
    """The things of a labelled cloud that it shows, by what people called them and by their class."""
    truth = truth_of(cloud, where)
    order = np.argsort(truth.owner, kind="stable")
    bounds = np.searchsorted(truth.owner[order], np.arange(len(truth.things) + 1))
    objects = []
    for row in np.flatnonzero(truth.things).tolist():
        names = tuple(dict.fromkeys(filter(None, (cloud.called[row] if cloud.called else "", truth.names[row]))))
        points = truth.points[order[bounds[row] : bounds[row + 1]]]
        if not len(points):
            continue
        objects.append(SceneObject(id=truth.ids[row], tag=names[0] if names else None, tags=names, points=points))
    return AnnotatedScene(objects=tuple(objects), relations=(), of_cloud=True)


def _annotated(value: Mapping[str, Any]) -> AnnotatedScene:
    report = Report()
    objects = []
    for position, record in enumerate(value["objects"]):
        if not isinstance(record, dict):
            raise FormatError(f"object {position}: must be an object with fields, not {strict_json.kind_of(record)}")
        objects.append(_object(record, fields.node_id(record.get("id"), f"object {position}"), report))
    known = {obj.id for obj in objects}
    if len(known) < len(objects):
        twice = next(obj.id for place, obj in enumerate(objects) if obj.id in {o.id for o in objects[:place]})
        raise SceneError(f"two objects have the id #{twice}")
    listed = value.get("relations", [])
    if not isinstance(listed, list):
        raise FormatError(f"'relations' must be a list, not {strict_json.kind_of(listed)}")
    relations = []
    for position, record in enumerate(listed):
        where = f"relation {position}"
        if not isinstance(record, dict):
            raise FormatError(f"{where}: must be an object with fields, not {strict_json.kind_of(record)}")
        ends = [fields.node_id(record.get(end), f"{where}, its {end}") for end in ("source", "target")]
        for end in ends:
            if end not in known:
                raise SceneError(f"{where}: there is no object #{end}")
        label = fields.text(record.get("label"), where, "the label")
        if label is None:
            raise FormatError(f"{where}: has no label")
        relations.append(Relation(source=canonical_id(ends[0]), target=canonical_id(ends[1]), label=label))
    return AnnotatedScene(objects=tuple(objects), relations=tuple(relations))


def _object(record: Mapping[str, Any], known: int | str, report: Report) -> SceneObject:
    where = f"object #{known}"
    names = fields.texts(record.get("names"), where, "'names'")
    if not names:
        raise FormatError(f"{where}: has no names")
    center = fields.triple(record.get("center"), where, "the center")
    extent = fields.extent(record.get("extent"), where, "the extent", report)
    rotation = None
    if record.get("rotation") is not None:
        rows = record["rotation"]
        if not isinstance(rows, list) or len(rows) != 3:
            raise FormatError(f"{where}: the rotation must be three rows of three numbers")
        rotation = np.array([fields.triple(row, where, "a row of the rotation") for row in rows], np.float64)
        if rotation.shape != (3, 3) or np.abs(rotation @ rotation.T - np.eye(3)).max() > 1e-3:
            raise SceneError(f"{where}: the rotation is not orthonormal")
    if center is None:
        extent = rotation = None
    points = None if record.get("points") is None else _points(record["points"], where)
    return SceneObject(
        id=known, tag=names[0], tags=names, center=center, extent=extent, rotation=rotation, points=points
    )


def _points(value: Any, where: str) -> NDArray[np.float32]:
    try:
        points = np.asarray(value, np.float32)
    except (ValueError, TypeError, OverflowError):
        points = np.zeros(0, np.float32)
    if points.ndim != 2 or points.shape[1] != 3 or not len(points):
        raise FormatError(f"{where}: 'points' must be a list of three numbers each")
    if not np.isfinite(points).all() or np.abs(points).max() > LARGEST_COORDINATE:
        raise SceneError(f"{where}: a point is not three finite coordinates in metres")
    return points
