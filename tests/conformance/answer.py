"""What this implementation answers to the cases: files by name on standard input, lines of JSON on standard output.

A program of its own, because a process can load one graph engine only (CGDB_GRAPH_ENGINE); and so that another
implementation of CGQL is put to the same test by a program that takes the place of this one.
"""

from __future__ import annotations

import json
import sys
import tomllib
import traceback
from collections.abc import Mapping
from datetime import UTC, datetime, timedelta
from pathlib import Path
from typing import Any

import numpy as np

import cgdb
from cgdb.database import Database
from cgdb.query.limits import Limits
from cgdb.result import Path as Way
from cgdb.result import Result, StoredNode, StoredRelation
from cgdb.testing import give_degrees, store


def answers(file: Path) -> list[dict[str, Any]]:
    """What the cases of a file give, in their order: columns and rows, or the error, or a crash's traceback."""
    document = tomllib.loads(file.read_text(encoding="utf-8"))
    with store() as db:
        give_degrees(db, {text: _by_id(table) for text, table in document.get("degrees", {}).items()})
        for scene in document.get("scene", ()):
            db.add(scene_graph(scene), on_existing="replace")
        return [answer(db, case) for case in document["case"]]


def answer(db: Database, case: Mapping[str, Any]) -> dict[str, Any]:
    """What one case gives."""
    parameters = {name: _parameter(value) for name, value in case.get("parameters", {}).items()}
    text = case["query"]
    if "fill" in case:
        part, times = case["fill"]
        text = text.replace("…", part * times)
    try:
        result = db.query(text, parameters, limits=Limits(**case.get("limits", {})))
        return _told(result, why="why" in case)
    except cgdb.CgdbError as error:
        told = error.to_json()
        if error.span is not None and error.source is not None:
            told["at"] = error.source[error.span.start : error.span.end]
        return {"error": told, "rendered": error.render()}
    except Exception:  # noqa: BLE001 (whatever else is raised is what the tests look for)
        return {"crash": traceback.format_exc()}


def scene_graph(scene: Mapping[str, Any]) -> cgdb.SceneGraph:
    """The scene that a table of the file writes down."""
    return cgdb.SceneGraph(
        name=scene["name"],
        up=scene.get("up", "z"),
        objects=tuple(_object(item) for item in scene.get("objects", ())),
        places=tuple(_place(item) for item in scene.get("places", ())),
        relations=tuple(_relation(line) for line in scene.get("relations", ())),
        spaces=tuple(cgdb.FeatureSpace(**space) for space in scene.get("spaces", ())),
    )


def _object(item: Mapping[str, Any]) -> cgdb.SceneObject:
    fields = dict(item)
    for name in ("center", "extent", "rotation"):
        if name in fields:
            fields[name] = np.asarray(fields[name], float)
    if "turned" in fields:
        fields["rotation"] = _turn(*fields.pop("turned"))
    fields["tags"] = tuple(fields.get("tags", ()))
    fields["features"] = {name: np.asarray(v, np.float32) for name, v in fields.get("features", {}).items()}
    fields["properties"] = _properties(fields.get("properties", {}))
    return cgdb.SceneObject(**fields)


def _place(item: Mapping[str, Any]) -> cgdb.Place:
    fields = dict(item)
    for name in ("center", "extent"):
        if name in fields:
            fields[name] = np.asarray(fields[name], float)
    fields["properties"] = _properties(fields.get("properties", {}))
    return cgdb.Place(**fields)


def _properties(given: Mapping[str, Any]) -> dict[str, Any]:
    return {name: tuple(value) if isinstance(value, list) else value for name, value in given.items()}


def _turn(axis: str, degrees: float) -> np.ndarray[Any, Any]:
    """The rotation by so many degrees about an axis, counterclockwise seen from its tip."""
    one, other = {"x": (1, 2), "y": (2, 0), "z": (0, 1)}[axis]
    c, s = np.cos(np.radians(degrees)), np.sin(np.radians(degrees))
    rotation = np.eye(3)
    rotation[one, one], rotation[one, other], rotation[other, one], rotation[other, other] = c, -s, s, c
    return rotation


def _relation(line: str) -> cgdb.Relation:
    """``#2 on #1 | 0.8 | geometry | why``: all but the first part may be missing."""
    edge, *more = (part.strip() for part in line.split("|"))
    source, *words, target = edge.split(" ")
    fields: dict[str, Any] = dict(zip(("confidence", "origin", "explanation"), more, strict=False))
    if "confidence" in fields:
        fields["confidence"] = float(fields["confidence"])
    return cgdb.Relation(source=_id(source), target=_id(target), label=" ".join(words), **fields)


def _id(written: str) -> int | str:
    name = written.removeprefix("#")
    return int(name) if name.isdigit() else name


def _by_id(table: Mapping[str, float]) -> dict[int | str, float]:
    return {_id(name): degree for name, degree in table.items()}


def _parameter(value: Any) -> Any:
    if isinstance(value, dict) and "vector" in value:
        return cgdb.Vector(values=np.asarray(value["vector"], np.float32), space=value.get("space"))
    if isinstance(value, dict) and "seconds_ago" in value:
        return (datetime.now(UTC) - timedelta(seconds=value["seconds_ago"])).isoformat()
    return None if value == "null" else value


def _told(result: Result, *, why: bool) -> dict[str, Any]:
    told: dict[str, Any] = {
        "columns": list(result.columns),
        "rows": [[*map(_value, row.values), row.score] for row in result],
        "fits": [row.fits for row in result],
        "warnings": list(result.warnings),
    }
    if why:
        told["why"] = [str(reason) for reason in result[0].why]
    return told


def _value(value: Any) -> Any:
    if value is None:
        return "null"
    if isinstance(value, StoredNode):
        return f"#{value.id}"
    if isinstance(value, (StoredRelation, Way)):
        return str(value)
    if isinstance(value, (list, tuple)):
        return [_value(item) for item in value]
    return value


if __name__ == "__main__":
    for name in sys.stdin:
        print(json.dumps(answers(Path(name.strip()))), flush=True)
