"""A scene graph to files and texts: one function per format in ``EXPORTERS``."""

from __future__ import annotations

import inspect
import os
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from cgdb.errors import ExportError, UsageError, did_you_mean, one_of
from cgdb.export.documents import Document
from cgdb.export.glb import glb
from cgdb.export.networkx_graph import graphml, node_link
from cgdb.export.planner_json import planner
from cgdb.export.ply import ply
from cgdb.export.rerun import rerun
from cgdb.export.scene_json import scene_json
from cgdb.export.whole_file import write_whole
from cgdb.scene import SceneGraph

EXPORTERS: dict[str, Callable[..., Document]] = {
    "cgdb": scene_json,
    "planner": planner,
    "node-link": node_link,
    "graphml": graphml,
    "ply": ply,
    "glb": glb,
    "rerun": rerun,
}
"""Format name -> its function of a scene; the function's keyword parameters are the format's options."""

WITH_VIEWS = frozenset({"cgdb", "rerun"})
"""Formats that hold the views of objects. For the others the pictures, most of a map's bytes, need not be read."""

SUFFIXES: dict[str, str] = {
    ".planner.json": "planner",
    ".node-link.json": "node-link",
    ".graphml": "graphml",
    ".json": "cgdb",
    ".ply": "ply",
    ".glb": "glb",
    ".rrd": "rerun",
}
"""End of a file's name -> format; the first that fits."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Exported:
    """What was written: where, in which format, how many bytes, and what the reader of the file should know."""

    path: Path
    format: str
    n_bytes: int
    notes: tuple[str, ...] = ()


def export(scene: SceneGraph, path: str | os.PathLike[str], format: str | None = None, **options: Any) -> Exported:
    """Write the scene to a file, in the format given or else the one of the file's suffix; all of it or nothing."""
    path = Path(path)
    chosen = format if format is not None else format_of(path)
    written = document(scene, chosen, **options)
    n_bytes = write_whole(path, written.pieces if written.data is None else written.data)
    return Exported(path=path, format=chosen, n_bytes=n_bytes, notes=written.notes)


def dumps(scene: SceneGraph, format: str = "cgdb", **options: Any) -> str:
    """The scene as one text of the format. ``document`` gives the notes with it, and the bytes of binary formats."""
    written = document(scene, format, **options)
    if written.data is not None:
        raise ExportError(f"the format '{format}' is binary: there is no text of it", hint="export it to a file")
    return "".join(written.pieces)


def document(scene: SceneGraph, format: str, **options: Any) -> Document:
    """The scene as a text in pieces, or as bytes, with notes about what the format left out."""
    exporter = EXPORTERS.get(format)
    if exporter is None:
        raise ExportError(
            f"there is no export format {str(format)[:60]!r}",
            hint=did_you_mean(format, EXPORTERS) or f"formats: {one_of(EXPORTERS)}",
        )
    known = [name for name, p in inspect.signature(exporter).parameters.items() if p.kind is p.KEYWORD_ONLY]
    for name in options:
        if name not in known:
            has = f"options of '{format}': {one_of(known)}" if known else f"'{format}' has no options"
            raise UsageError(f"the format '{format}' has no option '{name}'", hint=did_you_mean(name, known) or has)
    return exporter(scene, **options)


def format_of(path: Path) -> str:
    """The format that the end of the file's name stands for; ExportError where it stands for none."""
    for suffix, name in SUFFIXES.items():
        if path.name.casefold().endswith(suffix):
            return name
    endings = ", ".join(f"{suffix} ({name})" for suffix, name in SUFFIXES.items())
    raise ExportError(
        f"{path}: the end of the name does not say which format to write",
        hint=f"give a format ({one_of(EXPORTERS)}) or one of these endings: {endings}",
    )
