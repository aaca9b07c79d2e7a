"""A scene-graph cache folder of ConceptGraphs' main branch: objects, what was said of them, and relations.

Two kinds of ids meet here. Relations count positions in the pruned map; scene_graph.json, captions and answers
count positions in the map before pruning. They are joined through the id that each pruned object carries.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from cgdb.errors import FormatError
from cgdb.ingest import conceptgraphs_main, fields, planner_json, responses
from cgdb.ingest.map_objects import MapReader, is_map_object, records_of
from cgdb.ingest.report import Report, naming
from cgdb.ingest.responses import Said
from cgdb.ingest.source import Source
from cgdb.scene import FeatureSpace, ObjectId, Relation, SceneGraph, SceneObject

FORMAT = "conceptgraphs-cache"
PRUNED = ("map/scene_map_cfslam_pruned.pkl.gz", "scene_map_cfslam_pruned.pkl.gz")
PLANNER = "scene_graph.json"
CAPTIONS = "cfslam_llava_captions.json"
ANSWERS_FOLDER = "cfslam_gpt-4_responses"
ANSWERS = "cfslam_gpt-4_responses.pkl"
RELATIONS = ("cfslam_object_relations.json", "cfslam_object_relation_queries.json")
EDGES = "cfslam_scenegraph_edges.pkl"
ROUNDED = 0.11
"""Metres. Centers in the files of relations are rounded to one decimal."""
LABELS = {"inside": "in", "on top of": "on"}

_ANSWER = re.compile(r"\s*([ab])\s+(.{1,200}?)\s+([ab])\s*", re.IGNORECASE)


def matches(source: Source) -> bool:
    """A folder with the pruned map or the planner's JSON, and nothing else required."""
    return source.kind == "folder" and any((source.path / name).is_file() for name in (*PRUNED, PLANNER))


def read(source: Source, name: str | None) -> SceneGraph:
    """The objects of the pruned map, else of scene_graph.json, with every answer and relation that can be joined."""
    report, files = Report(), _Files(source.path, source.max_bytes)
    said = _said(files, report)
    pruned = files.first(PRUNED)
    planner = files.planner_objects(report)
    if pruned is not None:
        listed, positions, spaces = _pruned_objects(pruned, planner, said, report)
    elif planner:
        listed, positions, spaces = [_enriched(obj, said) for obj in planner.values()], files.planner_ids(), ()
        report.warn("there is no pruned map: boxes are rounded, and there are no features or points")
    else:
        raise FormatError(
            f"the folder holds no objects: neither {PRUNED[1]} nor {PLANNER} can be read", hint="give the scene folder"
        )
    known = planner | {obj.id: obj for obj in listed}
    relations = list(_relations(files, positions, {obj.id for obj in listed}, known, report))
    return SceneGraph(
        name=name or source.default_name(),
        objects=tuple(listed),
        relations=tuple(relations),
        spaces=spaces,
        provenance=report.provenance(source, FORMAT, files=files.digests),
    )


class _Files:
    """The files of the folder that were used, by name, with their digests."""

    def __init__(self, folder: Path, max_bytes: int | None) -> None:
        self._folder = folder
        self._max_bytes = max_bytes
        self.digests: dict[str, str | None] = {}

    def source(self, name: str) -> Source | None:
        """The file of that name, or None where there is none; any error names it."""
        path = self._folder / name
        if not path.is_file():
            return None
        with naming(name):
            found = Source(path, max_bytes=self._max_bytes)
        self.digests[name] = found.sha256()
        return found

    def value(self, name: str) -> Any:
        source = self.source(name)
        if source is None:
            return None
        with naming(name):
            return source.value()

    def first(self, names: tuple[str, ...]) -> Any:
        return next((value for name in names if (value := self.value(name)) is not None), None)

    def planner_objects(self, report: Report) -> dict[ObjectId, SceneObject]:
        source = self.source(PLANNER)
        if source is None:
            return {}
        with naming(PLANNER):
            scene = planner_json.read(source, None)
        for warning in scene.provenance["warnings"]:
            report.warn(f"{PLANNER}: {warning}")
        return {obj.id: obj for obj in scene.objects}

    def planner_ids(self) -> list[ObjectId]:
        """The id at each position of scene_graph.json, dropped objects included."""
        source = self.source(PLANNER)
        listed = source.records() if source is not None else []
        return [fields.node_id(record.get("id"), f"{PLANNER}, record {i}") for i, record in enumerate(listed)]

    def answers(self) -> Iterator[tuple[str, Any]]:
        """(file name, parsed answer) of the folder of answers, else of the one file of them."""
        folder = self._folder / ANSWERS_FOLDER
        if folder.is_dir():
            for path in sorted(folder.glob("*.json")):
                name = f"{ANSWERS_FOLDER}/{path.name}"
                yield name, self.value(name)
            return
        listed = self.value(ANSWERS)
        for item in listed if isinstance(listed, list) else ():
            with naming(ANSWERS):
                yield ANSWERS, responses.parsed(item)


def _said(files: _Files, report: Report) -> dict[ObjectId, Said]:
    """What was said of each object, by its id before pruning. An answer without a usable id is counted."""
    found: dict[ObjectId, Said] = {}
    listed = files.value(CAPTIONS)
    told = [(CAPTIONS, item) for item in listed] if isinstance(listed, list) else []
    for name, answer in [*told, *files.answers()]:
        if not isinstance(answer, Mapping) or not isinstance(answer.get("id"), (int, str)):
            report.drop(f"entries of {name} without an id")
            continue
        object_id = fields.node_id(answer["id"], name)
        said = responses.of_caption_dict(answer, f"object #{object_id}")
        if not said.understood:
            report.drop("answers that are no JSON")
        before = found.get(object_id)
        found[object_id] = said if before is None else responses.joined(said, before)
    return found


def _pruned_objects(
    value: Any, planner: Mapping[ObjectId, SceneObject], said: Mapping[ObjectId, Said], report: Report
) -> tuple[list[SceneObject], list[ObjectId], tuple[FeatureSpace, ...]]:
    """Objects, the id at every position of the pruned map (dropped ones too), and feature spaces."""
    listed = records_of(value, "object of the pruned map")
    if listed and not is_map_object(listed[0]):
        raise FormatError("the pruned map holds no map objects")
    reader = MapReader(report)
    objects, positions = [], []
    for position, record in enumerate(listed):
        positions.append(conceptgraphs_main.original_id(record, position))
        obj = conceptgraphs_main.read_one(reader, record, position, report)
        if obj is not None:
            objects.append(_enriched(_with_planner(obj, planner.get(obj.id)), said))
    return objects, positions, tuple(reader.spaces.values())


def _with_planner(obj: SceneObject, told: SceneObject | None) -> SceneObject:
    """Fill what the pruned map left open from scene_graph.json; the map's own box is the exact one."""
    if told is None:
        return obj
    return replace(
        obj,
        tag=told.tag or obj.tag,
        tags=obj.tags or told.tags,
        caption=obj.caption or told.caption,
        properties={**told.properties, **obj.properties},
    )


def _enriched(obj: SceneObject, said: Mapping[ObjectId, Said]) -> SceneObject:
    told = said.get(obj.id)
    if told is None:
        return obj
    more = {"captions": told.captions} if told.captions and "captions" not in obj.properties else {}
    return replace(
        obj,
        tag=obj.tag or told.tag,
        tags=obj.tags or told.tags,
        caption=obj.caption or told.summary,
        properties={**obj.properties, **more},
    )


def _relations(
    files: _Files,
    positions: list[ObjectId],
    kept: set[ObjectId],
    known: Mapping[ObjectId, SceneObject],
    report: Report,
) -> Iterator[Relation]:
    """Directed relations between objects that the scene keeps; everything else is counted."""
    for first, second, answer, reason in _answers(files, report):
        a, b = _end(first, positions, known), _end(second, positions, known)
        if a is None or b is None:
            report.drop("relations whose objects are not those of the map")
            continue
        read = _ANSWER.fullmatch(answer)
        if read is None or read[1].casefold() == read[3].casefold():
            report.drop("pairs without a relation" if answer.strip().casefold() != "fail" else "answers that failed")
            continue
        if not kept.issuperset((a, b)):
            report.drop("relations to dropped objects")
            continue
        source, target = (a, b) if read[1].casefold() == "a" else (b, a)
        label = read[2].casefold()
        yield Relation(source=source, target=target, label=LABELS.get(label, label), explanation=reason, origin="llm")


def _answers(files: _Files, report: Report) -> Iterator[tuple[Any, Any, str, str | None]]:
    """(first end, second end, answer, reason), of the file that has both ends beside the answer, if there is one."""
    for name in RELATIONS:
        listed = files.value(name)
        items = listed if isinstance(listed, list) else []
        answered = [i for i in items if isinstance(i, Mapping) and isinstance(i.get("object_relation"), str)]
        if not answered:
            continue
        if len(answered) < len(items):
            report.drop("pairs without an answer", len(items) - len(answered))
        for position, item in enumerate(answered):
            reason = item.get("reason")
            text = fields.text(reason, f"{name}, entry {position}", "the reason") if isinstance(reason, str) else None
            yield item.get("object1"), item.get("object2"), item["object_relation"], text
        return
    listed = files.value(EDGES)
    if not isinstance(listed, list) or not listed:
        return
    report.warn(f"relations come from {EDGES} alone, in which a pair that timed out shifts all later answers by one")
    for item in listed:
        if isinstance(item, (tuple, list)) and len(item) == 3 and isinstance(item[2], str):
            yield {"id": item[0]}, {"id": item[1]}, item[2], None
        else:
            report.drop(f"entries of {EDGES} that are no edges")


def _end(end: object, positions: list[ObjectId], known: Mapping[ObjectId, SceneObject]) -> ObjectId | None:
    """The id at a position of the pruned map; None when there is none, or when it is another object (a stale file)."""
    if not isinstance(end, Mapping) or type(end.get("id")) is not int or end["id"] not in range(len(positions)):
        return None
    found = positions[end["id"]]
    obj = known.get(found)
    if obj is None:
        return found
    tag, center = end.get("object_tag"), end.get("bbox_center")
    if isinstance(tag, str) and obj.tag is not None and tag.strip() != obj.tag:
        return None
    if isinstance(center, list) and obj.center is not None:
        told = fields.triple(center, f"relation to position {end['id']}", "the center")
        if told is not None and np.abs(told - obj.center).max() > ROUNDED:
            return None
    return found
