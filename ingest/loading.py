"""A path to a checked scene graph: look at the content, pick the reader, read, check, relate."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from importlib import import_module
from pathlib import Path
from typing import Any

from cgdb.errors import FormatError, UsageError, did_you_mean, one_of
from cgdb.ingest import strict_json
from cgdb.ingest.report import Report, naming
from cgdb.ingest.source import Source
from cgdb.scene import Relation, SceneGraph, SceneObject, check_scene

FORMATS: Mapping[str, str] = {
    "cgdb": "cgdb.ingest.cgdb_json",
    "conceptgraphs-planner": "cgdb.ingest.planner_json",
    "conceptgraphs-main": "cgdb.ingest.conceptgraphs_main",
    "conceptgraphs-cache": "cgdb.ingest.conceptgraphs_cache",
    "conceptgraphs-ali": "cgdb.ingest.conceptgraphs_ali",
    "conceptgraphs-ali-json": "cgdb.ingest.ali_json",
    "spark-dsg": "cgdb.ingest.spark_dsg",
    "virtualhome": "cgdb.ingest.virtualhome",
    "jsonl": "cgdb.ingest.json_lines",
    "json": "cgdb.ingest.plain_json",
}
"""Format -> the module that reads it, imported when needed, in the order in which they are asked for a match."""


@dataclass(frozen=True, slots=True, kw_only=True)
class SceneStream:
    """A scene in pieces: a header (everything but objects and relations) and batches of (objects, relations).

    A relation never comes after the last batch, but may come before its objects do.
    """

    header: SceneGraph
    batches: Iterator[tuple[tuple[SceneObject, ...], tuple[Relation, ...]]]


def load(
    path: str | Path,
    *,
    name: str | None = None,
    format: str | None = None,
    relate: bool = True,
    part: str | None = None,
    max_bytes: int | None = None,
) -> SceneGraph:
    """The checked scene of a map file or folder; FormatError or SceneError says in one line what is wrong with it.

    name: the scene's, else the file's. format: one of FORMATS, else found by content. relate: add relations from
    boxes. part: which graph of a file that holds several ("init_graph", "final_graph"). max_bytes: what a packed
    file may unfold to.
    """
    path = Path(path)
    with naming(str(path)):
        source = Source(path, max_bytes=max_bytes)
        scene = _read(source, name, format, part)
        check_scene(scene)
    if relate and any(obj.center is not None for obj in scene.objects):
        from cgdb.ingest.relations.relate import with_geometry

        scene = with_geometry(scene)
    return scene


def stream(
    path: str | Path,
    *,
    name: str | None = None,
    format: str | None = None,
    batch: int = 1000,
    relate: bool = False,
    max_bytes: int | None = None,
) -> SceneStream:
    """The scene of a map in batches. JSON lines are read line by line; other formats are loaded, then cut.

    Relations from geometry need the whole map, so they are only offered for the formats that are loaded whole.
    """
    if batch < 1:
        raise UsageError(f"batch must be 1 or more, not {batch}")
    path = Path(path)
    with naming(str(path)):
        source = Source(path, max_bytes=max_bytes)
        found = format or _detect(source)
        if found == "jsonl" and not relate:
            from cgdb.ingest import json_lines

            report = Report()
            header = json_lines.header(source, name or source.default_name(), report)
            check_scene(header)
            return SceneStream(
                header=header, batches=_naming_each(path, json_lines.batches(source, header, report, batch))
            )
    return _cut(load(path, name=name, format=format, relate=relate, max_bytes=max_bytes), batch)


def detect(path: str | Path) -> str:
    """The format of a map file or folder, by its content; FormatError when it is none of FORMATS."""
    path = Path(path)
    with naming(str(path)):
        return _detect(Source(path))


def _detect(source: Source) -> str:
    for name, module in FORMATS.items():
        if import_module(module).matches(source):
            return name
    hint = "give the map files in it, such as *.json or pcd_*.pkl.gz" if source.kind == "folder" else None
    raise FormatError(
        f"this is {_described(source)}, which is no map", hint=hint or f"cgdb reads: {one_of(FORMATS, most=20)}"
    )


def _read(source: Source, name: str | None, format: str | None, part: str | None) -> SceneGraph:
    found = format or _detect(source)
    if found not in FORMATS:
        raise UsageError(
            f"there is no format '{found}'", hint=did_you_mean(found, FORMATS) or f"there are: {one_of(FORMATS)}"
        )
    reader = import_module(FORMATS[found])
    options: dict[str, Any] = {}
    if part is not None:
        if not getattr(reader, "PARTS", None):
            raise UsageError(f"a map of format '{found}' has no parts to choose from")
        options["part"] = part
    scene: SceneGraph = reader.read(source, name, **options)
    return scene


def _described(source: Source) -> str:
    if source.kind == "folder":
        return "a folder"
    if source.kind == "json":
        return f"a JSON {strict_json.kind_of(source.value())}"
    return f"a {source.kind} file"


def _naming_each(
    path: Path, batches: Iterator[tuple[tuple[SceneObject, ...], tuple[Relation, ...]]]
) -> Iterator[tuple[tuple[SceneObject, ...], tuple[Relation, ...]]]:
    with naming(str(path)):
        yield from batches


def _cut(scene: SceneGraph, size: int) -> SceneStream:
    from dataclasses import replace

    def pieces() -> Iterator[tuple[tuple[SceneObject, ...], tuple[Relation, ...]]]:
        for start in range(0, len(scene.objects), size):
            yield scene.objects[start : start + size], ()
        for start in range(0, len(scene.relations), size):
            yield (), scene.relations[start : start + size]

    return SceneStream(header=replace(scene, objects=(), relations=()), batches=pieces())
