"""Sheets that people fill in, and what they say together: the paper's human evaluation of nodes and edges (Table I).

A sheet lists every node and edge of its scenes with a question each, to be answered true or false. Several people fill
in a copy each, and the majority of those who answered decides; a tie is a no, as two of three had to agree there.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations
from pathlib import Path
from typing import Any

from cgdb.errors import FormatError, SceneError, UsageError
from cgdb.ingest import fields, strict_json
from cgdb.ingest.evaluation.graph import nodes_of
from cgdb.scene import ObjectId, Relation, SceneGraph, SceneObject

FORMAT = "cgdb graph sheet 1"
LARGEST_FILE = 256 << 20
HOW = (
    "Answer true or false in place of null; leave null what you cannot tell. object: this is one whole thing, not a "
    "part, several things or nothing. label_right: tag and caption say what it is. duplicate: an earlier node of this "
    "list is the same thing. right, of an edge: the sentence holds."
)
QUESTIONS = ("object", "label_right", "duplicate")


@dataclass(frozen=True, slots=True, kw_only=True)
class SceneVerdict:
    """The votes on one scene. Nodes and edges without any answer are unanswered, and not in the shares.

    agreement: share of the pairs of people who said the same, over all that two or more of them answered; else None.
    """

    scene: str
    people: int
    nodes: int
    right: int
    valid: int
    duplicates: int
    node_answers: int
    edges: int
    edges_right: int
    edge_answers: int
    agreement: float | None

    @property
    def node_precision(self) -> float | None:
        """The share of nodes whose label is right; None where nobody answered."""
        return self.right / self.node_answers if self.node_answers else None

    @property
    def edge_precision(self) -> float | None:
        """The share of edges that hold; None where nobody answered."""
        return self.edges_right / self.edge_answers if self.edge_answers else None


@dataclass(frozen=True, slots=True, kw_only=True)
class Looks:
    """What there is to be looked at of an object: frames of the recording, and files with the object cut out of them.

    Both best first; files by their names beside the sheet."""

    frames: tuple[int, ...] = ()
    pictures: tuple[str, ...] = ()


def sheet(
    scenes: Sequence[SceneGraph],
    counts: Callable[[Relation], bool],
    looks: Mapping[tuple[str, ObjectId], Looks] | None = None,
) -> str:
    """The text of a sheet for these scenes. counts: which relations are asked about. looks: by scene and object."""
    parts = ",\n".join(_scene(scene, counts, looks or {}) for scene in scenes)
    return f'{{"format": "{FORMAT}",\n"how": {json.dumps(HOW)},\n"person": "",\n"scenes": [\n{parts}\n]}}\n'


def _scene(scene: SceneGraph, counts: Callable[[Relation], bool], looks: Mapping[tuple[str, ObjectId], Looks]) -> str:
    """A scene, a line for each question: people fill it in with an editor."""
    nodes = nodes_of(scene)
    # Geometry and a model may state the same edge: people are asked once.
    edges = {(r.source, r.label, r.target): r for r in scene.relations if counts(r)}
    named = {obj.id: _named(obj) for obj in nodes}
    listed: dict[str, list[dict[str, Any]]] = {
        "nodes": [
            {
                "id": obj.id,
                "tag": obj.tag,
                "caption": obj.caption,
                "center": None if obj.center is None else [round(float(c), 2) for c in obj.center],
                "extent": None if obj.extent is None else [round(float(c), 2) for c in obj.extent],
                **_looks(looks.get((scene.name, obj.id))),
                **dict.fromkeys(QUESTIONS),
            }
            for obj in nodes
        ],
        "edges": [
            {
                "source": r.source,
                "label": r.label,
                "target": r.target,
                "says": f"{named[r.source]} {r.label.replace('_', ' ')} {named[r.target]}",
                "right": None,
            }
            for r in edges.values()
            if r.source in named and r.target in named
        ],
    }
    lines = {
        part: ",\n".join(f"  {json.dumps(record, ensure_ascii=False)}" for record in records)
        for part, records in listed.items()
    }
    name = json.dumps(scene.name, ensure_ascii=False)
    return f' {{"scene": {name},\n "nodes": [\n{lines["nodes"]}\n ],\n "edges": [\n{lines["edges"]}\n ]}}'


def _looks(looks: Looks | None) -> dict[str, list[Any]]:
    told: dict[str, list[Any]] = {}
    if looks is not None and looks.frames:
        told["frames"] = list(dict.fromkeys(looks.frames))
    if looks is not None and looks.pictures:
        told["pictures"] = list(looks.pictures)
    return told


def _named(obj: SceneObject) -> str:
    return f"{obj.tag or obj.caption or 'something'} (#{obj.id})"[:200]


def read_sheet(path: Path) -> dict[str, Any]:
    """A filled-in sheet. FormatError, with the place, where it is none."""
    try:
        if path.stat().st_size > LARGEST_FILE:
            raise FormatError("is larger than a sheet can be")
        value = strict_json.parse(path.read_bytes())
        if not isinstance(value, dict) or value.get("format") != FORMAT:
            raise FormatError("is no sheet", hint="cgdb eval graph STORE --sheet FILE writes one")
        if not isinstance(value.get("scenes"), list):
            raise FormatError("has no list of scenes")
        for scene in value["scenes"]:
            _check_scene(scene)
        names = [scene["scene"] for scene in value["scenes"]]
        if len(set(names)) < len(names):
            raise FormatError("speaks of a scene twice")
    except FileNotFoundError:
        raise UsageError(f"there is no sheet {path}") from None
    except OSError as error:
        raise FormatError(f"{path}: cannot be read: {error.strerror or error}") from None
    except (FormatError, SceneError) as error:
        error.message = f"{path}: {error.message}"
        raise
    return value


def _check_scene(scene: Any) -> None:
    if not isinstance(scene, dict) or not isinstance(scene.get("scene"), str):
        raise FormatError("has a scene without a name")
    where = f"scene '{scene['scene'][:60]}'"
    for part, questions in (("nodes", QUESTIONS), ("edges", ("right",))):
        if not isinstance(scene.get(part), list):
            raise FormatError(f"{where} has no list of {part}")
        seen: set[tuple[Any, ...]] = set()
        for place, record in enumerate(scene[part]):
            here = f"{where}, {part[:-1]} {place}"
            if not isinstance(record, dict):
                raise FormatError(f"{here} must be an object with fields")
            ends = [
                fields.node_id(record.get(key), here) for key in (("id",) if part == "nodes" else ("source", "target"))
            ]
            if part == "edges" and not isinstance(record.get("label"), str):
                raise FormatError(f"{here} has no label")
            known = (*ends, record.get("label") if part == "edges" else None)
            if known in seen:  # a person has one vote
                raise FormatError(f"{here} is in the list twice")
            seen.add(known)
            for question in questions:
                given = record.get(question)
                if given is not None and not isinstance(given, bool):
                    raise FormatError(f"{here}: '{question}' must be true, false or null, not {fields.shown(given)}")


def verdicts(sheets: Sequence[Mapping[str, Any]], scenes: Mapping[str, SceneGraph]) -> tuple[SceneVerdict, ...]:
    """What the sheets say of each scene that they speak of, in the order of scenes.

    SceneError where a sheet speaks of a node or edge that its scene does not have: it was made of another map.
    """
    votes: dict[str, dict[tuple[Any, ...], list[bool]]] = {}
    people: dict[str, int] = {}
    for one in sheets:
        for part in one["scenes"]:
            name = part["scene"]
            if name not in scenes:
                raise UsageError(f"a sheet speaks of scene '{name[:60]}', which is not among those that are scored")
            people[name] = people.get(name, 0) + 1
            _gather(part, scenes[name], votes.setdefault(name, {}))
    return tuple(_verdict(name, people[name], votes[name]) for name in scenes if name in votes)


def _gather(part: Mapping[str, Any], scene: SceneGraph, votes: dict[tuple[Any, ...], list[bool]]) -> None:
    nodes: set[ObjectId] = {obj.id for obj in scene.objects}
    edges = {(r.source, r.label, r.target) for r in scene.relations}
    for record in part["nodes"]:
        known = fields.node_id(record["id"], "node")
        if known not in nodes:
            raise SceneError(f"a sheet speaks of node #{known}, which scene '{scene.name}' does not have")
        for question in QUESTIONS:
            votes.setdefault(("node", question, known), []).extend(_answer(record, question))
    for record in part["edges"]:
        edge = (fields.node_id(record["source"], "edge"), record["label"], fields.node_id(record["target"], "edge"))
        if edge not in edges:
            raise SceneError(
                f"a sheet speaks of #{edge[0]} {edge[1]} #{edge[2]}, which scene '{scene.name}' does not state"
            )
        votes.setdefault(("edge", *edge), []).extend(_answer(record, "right"))


def _answer(record: Mapping[str, Any], question: str) -> list[bool]:
    return [record[question]] if record.get(question) is not None else []


def _verdict(scene: str, people: int, votes: Mapping[tuple[Any, ...], list[bool]]) -> SceneVerdict:
    def of(*begin: str) -> list[list[bool]]:
        return [given for key, given in votes.items() if key[: len(begin)] == begin]

    def yes(answers: Sequence[list[bool]]) -> int:
        return sum(2 * sum(given) > len(given) for given in answers)

    labels, edges = of("node", "label_right"), of("edge")
    pairs = [a == b for given in votes.values() for a, b in combinations(given, 2)]
    return SceneVerdict(
        scene=scene,
        people=people,
        nodes=len(labels),
        right=yes(labels),
        valid=yes(of("node", "object")),
        duplicates=yes(of("node", "duplicate")),
        node_answers=sum(bool(given) for given in labels),
        edges=len(edges),
        edges_right=yes(edges),
        edge_answers=sum(bool(given) for given in edges),
        agreement=sum(pairs) / len(pairs) if pairs else None,
    )
