"""The planner's JSON of the ConceptGraphs paper: what a language model is given to plan with.

A list of objects with exactly the paper's fields, in its order: id, bbox_extent, bbox_center, object_tag, caption. With
relations the document is ``{"objects": [that list], "relations": [{"source": id, "label": text, "target": id}]}``.
Places are not part of it, nor are relations that one end of is a place. Boxes are axis-aligned in the scene's frame, in
metres, because that is how a planner reads them: a rotated box is written as the upright box around it.

A token budget is met by dropping what costs most and matters least, each step only as far as needed:

1. captions are cut to their first ``SHORT_CAPTION`` characters, the longest first;
2. relations go: those that follow from the boxes (origin geometry) before the others, the least confident first, of
   equals the later first;
3. objects go, with their relations: the least often observed first, among those the least confident, then the
   costliest.

Tokens are estimated as one per ``BYTES_PER_TOKEN`` bytes of UTF-8 (four letters of English), which is what the common
tokenizers come to for such text; leave a margin where the budget is hard.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
from numpy.typing import NDArray

from cgdb.errors import UsageError
from cgdb.export.documents import Document, json_text
from cgdb.scene import ObjectId, Relation, SceneGraph, SceneObject

BYTES_PER_TOKEN = 4
SHORT_CAPTION = 60
"""Characters. One clause: "a tall floor lamp with a white linen shade"."""


def planner(
    scene: SceneGraph, *, decimals: int = 1, max_tokens: int | None = None, relations: bool = False
) -> Document:
    """The scene for a planner. decimals: of coordinates in metres. A note says what a budget left out."""
    if not 0 <= decimals <= 15:
        raise UsageError(f"decimals must be from 0 to 15, not {decimals}")
    if max_tokens is not None and max_tokens < 1:
        raise UsageError(f"max_tokens must be 1 or more, not {max_tokens}")
    draft = _Draft(scene, decimals, relations)
    notes = () if max_tokens is None else draft.fit(max_tokens)
    return Document(pieces=draft.pieces(), notes=notes)


class _Draft:
    """The lines of the document, and their cost while the budget takes some away."""

    def __init__(self, scene: SceneGraph, decimals: int, with_relations: bool) -> None:
        self.records = {obj.id: _record(obj, decimals) for obj in scene.objects}
        self.objects = {obj.id: obj for obj in scene.objects}
        self.lines: dict[ObjectId, str] = {key: _line(record, key) for key, record in self.records.items()}
        self.with_relations = with_relations
        self.relations: dict[int, Relation] = {}
        self.relation_lines: dict[int, str] = {}
        if with_relations:
            kept = (r for r in scene.relations if r.source in self.objects and r.target in self.objects)
            self.relations = dict(enumerate(kept))
            self.relation_lines = {i: _relation_line(relation) for i, relation in self.relations.items()}

    def pieces(self) -> Iterator[str]:
        if not self.with_relations:
            yield from _list(self.lines.values())
            yield "\n"
            return
        yield '{"objects": '
        yield from _list(self.lines.values())
        yield ', "relations": '
        yield from _list(self.relation_lines.values())
        yield "}\n"

    def fit(self, max_tokens: int) -> tuple[str, ...]:
        """Drop until the text is within the budget; returns a note about what went."""
        budget = max_tokens * BYTES_PER_TOKEN
        size = sum(map(_bytes, self.pieces()))
        n_objects, n_relations = len(self.lines), len(self.relation_lines)

        cut: set[ObjectId] = set()
        for key in sorted(self.lines, key=lambda k: -len(self.records[k]["caption"] or "")):
            caption = self.records[key]["caption"] or ""
            if size <= budget or len(caption) <= SHORT_CAPTION:
                break
            line = _line(self.records[key] | {"caption": _cut(caption)}, key)
            size -= _bytes(self.lines[key]) - _bytes(line)
            self.lines[key] = line
            cut.add(key)

        for index in sorted(self.relations, key=lambda i: (*_relation_worth(self.relations[i]), -i)):
            if size <= budget:
                break
            size -= _bytes(self.relation_lines.pop(index)) + _SEPARATOR

        ends: dict[ObjectId, set[int]] = {}
        for index in self.relation_lines:
            for end in (self.relations[index].source, self.relations[index].target):
                ends.setdefault(end, set()).add(index)
        for key in sorted(self.lines, key=lambda k: _worth(self.objects[k], self.lines[k])):
            if size <= budget:
                break
            size -= _bytes(self.lines.pop(key)) + _SEPARATOR
            for index in ends.get(key, ()):
                if index in self.relation_lines:
                    size -= _bytes(self.relation_lines.pop(index)) + _SEPARATOR

        if n_objects and not self.lines:
            raise UsageError(f"{max_tokens} tokens hold not even one object", hint="give a larger max_tokens")
        n_left_out = n_objects - len(self.lines)
        n_relations_left_out = n_relations - len(self.relation_lines)
        n_cut = len(cut & self.lines.keys())
        if not (n_cut or n_left_out or n_relations_left_out):
            return ()
        parts = [f"{n_left_out} of {n_objects} objects left out", f"{n_cut} captions shortened"]
        if n_relations:
            parts.insert(1, f"{n_relations_left_out} of {n_relations} relations left out")
        return (f"to keep to {max_tokens} tokens: " + ", ".join(parts),)


_SEPARATOR = len(",\n")


def _list(lines: Any) -> Iterator[str]:
    before = "[\n"
    for line in lines:
        yield before + line
        before = ",\n"
    yield "[]" if before == "[\n" else "\n]"


def _record(obj: SceneObject, decimals: int) -> dict[str, Any]:
    return {
        "id": obj.id,
        "bbox_extent": _rounded(_upright_extent(obj), decimals),
        "bbox_center": _rounded(obj.center, decimals),
        "object_tag": obj.tag,
        "caption": obj.caption,
    }


def _line(record: dict[str, Any], key: ObjectId) -> str:
    return json_text(record, f"object #{key}")


def _relation_line(relation: Relation) -> str:
    where = f"relation #{relation.source} {relation.label!r} #{relation.target}"
    return json_text({"source": relation.source, "label": relation.label, "target": relation.target}, where)


def _upright_extent(obj: SceneObject) -> NDArray[np.float64] | None:
    if obj.extent is None or obj.rotation is None:
        return obj.extent
    return np.asarray(np.abs(obj.rotation) @ obj.extent, dtype=np.float64)


def _rounded(array: NDArray[np.float64] | None, decimals: int) -> list[float] | None:
    if array is None:
        return None
    return [round(number, decimals) + 0.0 for number in array.tolist()]  # + 0.0: no minus zero


def _cut(caption: str) -> str:
    """The caption's beginning, up to a space where there is one."""
    head = caption[: SHORT_CAPTION - 3]
    if " " in head and not caption[len(head)].isspace():
        head = head[: head.rindex(" ")]
    return head.rstrip(" ,;:.") + "..."


def _relation_worth(relation: Relation) -> tuple[bool, float]:
    return relation.origin != "geometry", relation.confidence


def _worth(obj: SceneObject, line: str) -> tuple[float, float, int]:
    """Unknown counts and confidences count as 1: what an importer does not know is no reason to drop an object."""
    observed = float("inf") if obj.n_observations is None else obj.n_observations
    return observed, 1.0 if obj.confidence is None else obj.confidence, -_bytes(line)


def _bytes(text: str) -> int:
    return len(text.encode("utf-8"))
