"""Relations of near things by a language model (ConceptGraphs, Section II-D): "a on b", "a in b", or its own phrase.

They stand beside the relations from geometry, with their origin. Where the two contradict each other both stay, and
both say so in their explanation.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from cgdb.enrich.calls import Pace, Turn, cost
from cgdb.enrich.kept import Kept, key_of
from cgdb.enrich.numbered import answers
from cgdb.enrich.overlaps import REACH, overlapping, spanning_forest
from cgdb.enrich.prompts import (
    IN_A,
    IN_B,
    INVALID,
    NONE,
    ON_A,
    ON_B,
    OTHER,
    RELATIONS,
    SURENESS,
    relating,
    relating_schema,
)
from cgdb.enrich.work import Task, Work
from cgdb.errors import UsageError
from cgdb.model.llm import Meter, Model, ModelError, estimated_tokens
from cgdb.model.llm_json import ask_json
from cgdb.model.prompts import clean
from cgdb.scene import ObjectId, Relation, SceneGraph, SceneObject

if TYPE_CHECKING:
    from cgdb.database import Database
    from cgdb.storage.ledger import SceneWriter

FILE = "relations.jsonl"
VERSION = 1
BATCH = 6
REPLY_TOKENS = 60
"""Of one pair."""
LONGEST_LABEL = 40
LONGEST_REASON = 200
ORIGIN = "llm"
MARK = "contradicts"

_HELD: Mapping[str, tuple[str, bool]] = {
    ON_B: ("on", False),
    ON_A: ("on", True),
    IN_B: ("in", False),
    IN_A: ("in", True),
}
"""What is said of a pair -> the label, and whether b is its source."""
_HIGHER = {"on": 1, "in": 1, "above": 1, "under": -1}
"""1 where the source is held by, or higher than, the target; -1 where it is the other way round."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Estimate:
    """What it will take. candidates: pairs that touch or overlap; pairs: of these, the spanning forest."""

    objects: int
    candidates: int
    pairs: int
    pending: int
    calls: int
    prompt_tokens: int
    completion_tokens: int
    cost: float | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class Said:
    """What a model said of a pair (a, b). label None: nothing. turned: b is the source."""

    label: str | None
    turned: bool
    reason: str
    confidence: float

    def as_json(self) -> dict[str, Any]:
        """As it is kept."""
        return {"label": self.label, "turned": self.turned, "reason": self.reason, "confidence": self.confidence}

    def relation(self, a: ObjectId, b: ObjectId) -> Relation | None:
        """What it says of a and b; None where that is nothing."""
        if self.label is None:
            return None
        source, target = (b, a) if self.turned else (a, b)
        return Relation(
            source=source,
            target=target,
            label=self.label,
            confidence=self.confidence,
            explanation=self.reason or None,
            origin=ORIGIN,
        )


@dataclass(frozen=True, slots=True, kw_only=True)
class _Pair(Task):
    """Two objects to ask of. up: the scene's axis. shown: the objects as a model gets them, {"a": ..., "b": ...}."""

    up: str
    a: ObjectId
    b: ObjectId
    shown: Mapping[str, Any]


class Relating(Work[_Pair, Said]):
    """The relations of some scenes of a store; see ``Work``."""

    kind, adds = "relate", "relations"
    needs = "relations are asked of a language model"

    def __init__(
        self,
        db: Database,
        model: Model | None,
        *,
        scenes: Sequence[str] = (),
        every_pair: bool = False,
        reach: float = REACH,
        batch: int = BATCH,
        pace: Pace | None = None,
    ) -> None:
        """model None: only to estimate. every_pair: not only the spanning forest. reach: metres, see ``overlaps``."""
        if batch < 1:
            raise UsageError(f"a call asks of at least one pair, not {batch}")
        if not 0 <= reach <= 10:
            raise UsageError(f"boxes that are 0 to 10 m apart can be asked about, not {reach:g}")
        super().__init__(db, model, Kept(db.path / FILE, _read), scenes=scenes, batch=batch, pace=pace)
        self._objects = self._candidates = 0
        for name in self._scenes:
            self._tasks += self._tasks_of(db.scene(name, features=False, clouds=False), every_pair, reach)
        self.related = self.contradictions = 0

    def estimate(self) -> Estimate:
        """Calls, tokens and, where prices are configured, what they cost."""
        batches = self._batches()
        pending = sum(map(len, batches))
        prompt = sum(estimated_tokens(relating([task.shown for task in batch], batch[0].up)) for batch in batches)
        completion = pending * REPLY_TOKENS
        return Estimate(
            objects=self._objects,
            candidates=self._candidates,
            pairs=len(self._tasks),
            pending=pending,
            calls=len(batches),
            prompt_tokens=prompt,
            completion_tokens=completion,
            cost=cost(self._model, prompt, completion),
        )

    def _tasks_of(self, scene: SceneGraph, every_pair: bool, reach: float) -> Iterator[_Pair]:
        """The pairs of a scene that are asked about: not of walls and floors, nor of what is no object."""
        objects = [
            obj
            for obj in scene.objects
            if obj.properties.get("background") is not True and obj.properties.get(INVALID) is not True
        ]
        self._objects += len(objects)
        pairs = overlapping(objects, reach=reach)
        self._candidates += len(pairs)
        for pair in pairs if every_pair else spanning_forest(pairs):
            a, b = objects[pair.a], objects[pair.b]
            shown = {"a": _shown(a), "b": _shown(b)}
            key = key_of(VERSION, self._model_name, scene.up, shown)
            about = {"pair": [a.id, b.id]}
            yield _Pair(scene=scene.name, key=key, about=about, up=scene.up, a=a.id, b=b.id, shown=shown)

    def _ask(self, model: Model, batch: Sequence[_Pair], meter: Meter, turn: Turn) -> Mapping[int, Said]:
        def asked(pairs: Sequence[_Pair], meter: Meter) -> Mapping[str, Any]:
            return ask_json(
                model,
                relating([pair.shown for pair in pairs], pairs[0].up),
                meter,
                name="pairs",
                schema=relating_schema(),
                max_tokens=100 + 3 * REPLY_TOKENS * len(pairs),
            )

        said = answers(model, batch, asked, "pairs", checked, meter, turn)
        if not said:
            raise ModelError("the model says nothing of the pairs that it was asked about")
        return said

    def _as_json(self, known: Said) -> Any:
        return known.as_json()

    def _add(self, writer: SceneWriter, scene: str, model: Model) -> None:
        said, taken_back = self._said(self._db.scene(scene, features=False, clouds=False))
        writer.unrelate(taken_back)
        writer.relations(said)

    def _said(self, scene: SceneGraph) -> tuple[list[Relation], list[Relation]]:
        """What a model says of the scene's pairs now, and what one has said of them before and is said no more.

        With the first come the relations from geometry of these pairs, those that are contradicted marked.
        """
        there = {obj.id for obj in scene.objects}
        stored: dict[frozenset[ObjectId], list[Relation]] = {}
        for relation in scene.relations:
            stored.setdefault(frozenset((relation.source, relation.target)), []).append(relation)
        said: list[Relation] = []
        taken_back: list[Relation] = []
        for task in self._tasks:
            answer = self._kept.get(task.key) if task.scene == scene.name and {task.a, task.b} <= there else None
            if answer is None:
                continue
            new = answer.relation(task.a, task.b)
            before = stored.get(frozenset((task.a, task.b)), [])
            geometry = [relation for relation in before if relation.origin == "geometry"]
            against = [relation for relation in geometry if new is not None and contradict(new, relation)]
            said += [_marked(relation, new if relation in against else None) for relation in geometry]
            if new is not None:
                said.append(_marked(new, max(against, key=lambda relation: relation.confidence, default=None)))
            self.related += new is not None
            self.contradictions += bool(against)
            taken_back += [
                relation
                for relation in before
                if relation.origin == ORIGIN and (new is None or _key(relation) != _key(new))
            ]
        return said, taken_back


def contradict(one: Relation, other: Relation) -> bool:
    """Whether two relations of the same pair say opposite things of which of the two is higher, or holds the other."""
    if one.label not in _HIGHER or other.label not in _HIGHER:
        return False
    same_way = 1 if one.source == other.source else -1
    return _HIGHER[one.label] != same_way * _HIGHER[other.label]


def checked(item: Mapping[str, Any]) -> Said | None:
    """What a model said of a pair; None where it is none of what it was asked for."""
    relation, other = item.get("relation"), item.get("other")
    if relation not in RELATIONS:
        return None
    reason = item.get("reason")
    said = Said(
        label=None,
        turned=False,
        reason=clean(reason, LONGEST_REASON) if isinstance(reason, str) else "",
        confidence=SURENESS.get(str(item.get("sure")), SURENESS["unsure"]),
    )
    if relation == NONE:
        return said
    if relation == OTHER:
        label = clean(other, LONGEST_LABEL).casefold().strip(" .,;:\"'") if isinstance(other, str) else ""
        return replace(said, label=label) if label else None
    label, turned = _HELD[relation]
    return replace(said, label=label, turned=turned)


def _read(value: Any) -> Said | None:
    label, turned = value["label"], value["turned"]
    confidence = float(value["confidence"])
    named = label is None or (isinstance(label, str) and 0 < len(label) <= LONGEST_LABEL)
    if not named or not isinstance(turned, bool) or not 0.0 <= confidence <= 1.0:
        return None
    return Said(label=label, turned=turned, reason=clean(str(value["reason"]), LONGEST_REASON), confidence=confidence)


def _shown(obj: SceneObject) -> dict[str, Any]:
    """An object as the model gets it: what it is called, what it looks like, where it is and how large."""
    shown: dict[str, Any] = {"name": clean(obj.tag, 60) if obj.tag else None, "caption": None}
    shown["caption"] = clean(obj.caption, 160) if obj.caption else None
    assert obj.center is not None and obj.extent is not None  # it is in a pair of boxes
    sides = obj.extent if obj.rotation is None else np.abs(obj.rotation) @ obj.extent
    shown["center"], shown["size"] = _metres(obj.center), _metres(sides)
    return shown


def _metres(values: Any) -> list[float]:
    return [round(float(value), 2) for value in values]


def _marked(relation: Relation, against: Relation | None) -> Relation:
    """The relation with the one that it contradicts, if any, in its explanation; said once, however often it is run."""
    own, mark, _ = (relation.explanation or "").partition(f"{MARK} #")
    if against is None and not mark:
        return relation
    parts = [own.rstrip(" ;")]
    if against is not None:
        named = f"#{against.source} {against.label} #{against.target}"
        parts.append(f"{MARK} {named} ({against.origin}, {against.confidence:.2f})")
    return replace(relation, explanation="; ".join(filter(None, parts)) or None)


def _key(relation: Relation) -> tuple[ObjectId, ObjectId, str, str]:
    return relation.source, relation.target, relation.label, relation.origin
