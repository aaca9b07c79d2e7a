"""ScanNet's own annotation of a scan: which object each vertex of its mesh belongs to, and what people called that.

SCAN.aggregation.json                segGroups: of each object its objectId, label and segments
SCAN_vh_clean_2.0.010000.segs.json   segIndices: the segment of each vertex
SCAN_vh_clean_2.labels.ply           the vertices, with a class of NYU40 each; SCAN_vh_clean_2.ply has none
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from cgdb.errors import FormatError
from cgdb.ingest import fields, strict_json
from cgdb.ingest.evaluation import ply
from cgdb.ingest.source import Source

ENDING = ".aggregation.json"
_SEGMENTS = "_vh_clean_2.0.010000.segs.json"
_MESHES = ("_vh_clean_2.labels.ply", "_vh_clean_2.ply")
_FINE = f"_vh_clean{ENDING}"
"""The same of the mesh in full resolution, whose segments are others."""
_MOST_OBJECTS = 100_000
_LARGEST_NUMBER = 2**53


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Scan:
    """mesh: n vertices. instances (n,) int64: the object of each vertex, -1 for none. called: {object: its label}."""

    mesh: ply.Ply
    instances: NDArray[np.int64]
    called: Mapping[int, str]


def aggregation_in(folder: Path) -> Path | None:
    """The annotation of the one scan of a folder, if it has one."""
    found = [path for path in sorted(folder.glob(f"*{ENDING}")) if not path.name.endswith(_FINE)]
    return found[0] if len(found) == 1 else None


def read(path: Path) -> Scan:
    """The scan of an aggregation file, whose segments and mesh lie beside it. FormatError where they do not fit."""
    scan = path.name.removesuffix(ENDING)
    segments, *meshes = (path.with_name(f"{scan}{end}") for end in (_SEGMENTS, *_MESHES))
    mesh = next((file for file in meshes if file.is_file()), None)
    for file, there in ((segments, segments.is_file()), (meshes[-1], mesh is not None)):
        if not there:
            raise FormatError(f"{path}: {file.name} is not beside it")
    assert mesh is not None
    vertices = ply.read(mesh)
    count = len(vertices.vertex["x"])
    of_vertex = _numbers(_object(segments).get("segIndices"), "segIndices", segments.name)
    if len(of_vertex) != count or not count:
        raise FormatError(f"{segments.name} tells of {len(of_vertex):,} vertices, {mesh.name} has {count:,}")
    known, place = np.unique(of_vertex, return_inverse=True)
    groups = _object(path).get("segGroups")
    if not isinstance(groups, list) or len(groups) > _MOST_OBJECTS:
        raise FormatError(f"{path.name} has no list 'segGroups', or an endless one")
    owner = np.full(len(known), -1, np.int64)
    called: dict[int, str] = {}
    for number, group in enumerate(groups):
        where = f"{path.name}: object {number}"
        if not isinstance(group, dict):
            raise FormatError(f"{where}: must be an object with fields, not {strict_json.kind_of(group)}")
        (name,) = _numbers([group.get("objectId")], "objectId", where).tolist()
        label = fields.text(group.get("label"), where, "the label")
        if label is None or name in called:
            raise FormatError(f"{where}: {'has no label' if label is None else f'#{name} is there already'}")
        called[name] = " ".join(label.split())
        mine = _numbers(group.get("segments"), "segments", where)
        at = np.minimum(np.searchsorted(known, mine), len(known) - 1)
        owner[at[known[at] == mine]] = name
    return Scan(mesh=vertices, instances=owner[place.reshape(-1)], called=called)


def _object(path: Path) -> dict[str, Any]:
    source = Source(path)
    value = source.value() if source.kind == "json" else None
    if not isinstance(value, dict):
        raise FormatError(f"{path.name} is no JSON object")
    return value


def _numbers(value: object, what: str, where: str) -> NDArray[np.int64]:
    """(n,) of a list of numbers from 0."""
    if isinstance(value, list) and all(type(one) is int and 0 <= one < _LARGEST_NUMBER for one in value):
        return np.array(value, np.int64)
    raise FormatError(f"{where}: '{what}' must hold whole numbers from 0")
