"""Enrich: ask a model once what is known of each thing, and keep it as properties, so that questions need no model.

One description (tag and caption) is asked for once, whatever number of objects bears it. Replies are kept in the
store's folder as they come, so that what was interrupted goes on; the properties are written as one revision per scene,
once all is known. What a map says itself is never overwritten.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

from cgdb.enrich.calls import Pace, Turn, cost
from cgdb.enrich.kept import Kept, key_of
from cgdb.enrich.numbered import answers
from cgdb.enrich.prompts import RIGIDITIES, ROBOT, WEIGHTS, enriching, enriching_schema
from cgdb.enrich.work import Task, Work
from cgdb.errors import UsageError
from cgdb.model.llm import Meter, Model, estimated_tokens
from cgdb.model.llm_json import ask_json
from cgdb.model.prompts import clean
from cgdb.scene import PropertyValue, SceneObject

if TYPE_CHECKING:
    from cgdb.database import Database
    from cgdb.storage.ledger import SceneWriter

FILE = "enriched.jsonl"
VERSION = 1
"""Of the questions that are asked; a change asks all anew."""
BATCH = 8
LONGEST = 300
"""Characters of a description."""
REPLY_TOKENS = 90
"""Of one description, for estimates: measured on the replies that the schema allows."""

Known = Mapping[str, PropertyValue]

_LISTS = (("affordances", 6), ("materials", 3), ("colors", 4), ("typical_places", 3))
NAMES = (*(name for name, _ in _LISTS), "weight_class", "rigidity", "traversable")
ORIGIN = ("enriched", "enriched_by", "traversable_by")
"""Which properties came from a model, from which, and for what robot."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Estimate:
    """What it will take. descriptions: to be asked; known: were asked before. cost: in the currency of the prices."""

    objects: int
    descriptions: int
    known: int
    calls: int
    prompt_tokens: int
    completion_tokens: int
    cost: float | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class _Description(Task):
    """What a model is told of some objects, in whatever scene."""

    text: str


class Enrichment(Work[_Description, Known]):
    """The properties of some scenes of a store; see ``Work``."""

    kind, adds = "enrich", "properties"
    needs = "to enrich a store, a language model is asked"

    def __init__(
        self,
        db: Database,
        model: Model | None,
        *,
        scenes: Sequence[str] = (),
        robot: str | None = None,
        batch: int = BATCH,
    ) -> None:
        """model None: only to estimate. robot: for whom things are traversable or not."""
        if batch < 1:
            raise UsageError(f"a batch has at least one description, not {batch}")
        super().__init__(db, model, Kept(db.path / FILE, _read), scenes=scenes, batch=batch, pace=Pace(workers=1))
        self._robot = " ".join((robot or "").split())[:200] or ROBOT
        objects = [obj for name in self._scenes for obj in db.scene(name, features=False, clouds=False).objects]
        self._objects = len(objects)
        texts = dict.fromkeys(text for obj in objects if (text := description(obj)) is not None)
        self._tasks = [
            _Description(scene=None, key=self._key(text), about={"description": text}, text=text) for text in texts
        ]
        self.changed = 0

    def estimate(self) -> Estimate:
        """Calls, tokens and, where prices are configured, what they cost."""
        batches = self._batches()
        pending = sum(map(len, batches))
        prompt = sum(estimated_tokens(enriching([task.text for task in batch], self._robot)) for batch in batches)
        completion = pending * REPLY_TOKENS
        return Estimate(
            objects=self._objects,
            descriptions=pending,
            known=len(self._tasks) - pending,
            calls=len(batches),
            prompt_tokens=prompt,
            completion_tokens=completion,
            cost=cost(self._model, prompt, completion),
        )

    def _key(self, text: str) -> str:
        return key_of(VERSION, self._model_name, self._robot, text)

    def _ask(self, model: Model, batch: Sequence[_Description], meter: Meter, turn: Turn) -> Mapping[int, Known]:
        def asked(tasks: Sequence[_Description], meter: Meter) -> Mapping[str, Any]:
            return ask_json(
                model,
                enriching([task.text for task in tasks], self._robot),
                meter,
                name="objects",
                schema=enriching_schema(),
                max_tokens=60 + 2 * REPLY_TOKENS * len(tasks),
            )

        return answers(model, batch, asked, "objects", _read, meter, turn)

    def _as_json(self, known: Known) -> Any:
        return dict(known)

    def _add(self, writer: SceneWriter, scene: str, model: Model) -> None:
        changed = []
        for obj in self._db.scene(scene).objects:
            text = description(obj)
            known = None if text is None else self._kept.get(self._key(text))
            if known is not None:
                new = self._enriched(obj, known, model.name)
                if dict(new.properties) != dict(obj.properties):
                    changed.append(new)
        writer.objects(changed)
        self.changed += len(changed)

    def _enriched(self, obj: SceneObject, known: Known, model: str) -> SceneObject:
        before = obj.properties.get("enriched")
        ours = set(before) if isinstance(before, tuple) else set()
        own = {name: value for name, value in obj.properties.items() if name not in ours and name not in ORIGIN}
        added = {name: value for name, value in known.items() if name not in own}
        if not added:
            return obj
        origin: dict[str, PropertyValue] = {"enriched": tuple(sorted(added)), "enriched_by": clean(model, 100)}
        if "traversable" in added:
            origin["traversable_by"] = self._robot
        return replace(obj, properties={**own, **added, **origin})


def description(obj: SceneObject) -> str | None:
    """What a model is told of an object; None where its map says nothing of it."""
    parts = [part for part in (obj.tag, obj.caption) if part and part.strip()]
    if len(parts) == 2 and parts[0].casefold() in parts[1].casefold():
        parts = parts[1:]
    return clean(": ".join(parts), LONGEST) if parts else None


def checked(item: Mapping[str, Any]) -> dict[str, PropertyValue]:
    """What of an answer is as it was asked for; the rest is left out."""
    known: dict[str, PropertyValue] = {}
    for name, most in _LISTS:
        values = item.get(name)
        if isinstance(values, list):
            texts = [clean(value, 40).casefold() for value in values if isinstance(value, str) and value.strip()]
            if texts:
                known[name] = tuple(dict.fromkeys(texts))[:most]
    for name, choices in (("weight_class", WEIGHTS), ("rigidity", RIGIDITIES)):
        value = item.get(name)
        if isinstance(value, str) and value.casefold() in choices:
            known[name] = value.casefold()
    if isinstance(item.get("traversable"), bool):
        known["traversable"] = item["traversable"]
    return known


def _read(value: Any) -> Known | None:
    return checked(value) or None
