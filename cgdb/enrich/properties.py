"""Enrich: ask a model once what is known of each thing, and keep it as properties, so that questions need no model.

One description (tag and caption) is asked for once, whatever number of objects bears it. Replies are kept in the
store's folder as they come, so that what was interrupted goes on; the properties are written as one revision per scene,
once all is known. What a map says itself is never overwritten.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

from cgdb.enrich.calls import cost
from cgdb.enrich.kept import Kept, key_of
from cgdb.errors import StoreError, UsageError
from cgdb.model.llm import Meter, Model, Usage, estimated_tokens
from cgdb.model.llm_json import ask_json
from cgdb.model.prompts import RIGIDITIES, ROBOT, WEIGHTS, clean, enriching, enriching_schema
from cgdb.scene import PropertyValue, SceneObject

if TYPE_CHECKING:
    from cgdb.database import Database

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


class Enrichment:
    """The work on some scenes of a store: ``estimate``, then ``run``, then what ``revisions`` and ``usage`` say."""

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
        self._db, self._model, self._batch = db, model, batch
        self._robot = " ".join((robot or "").split())[:200] or ROBOT
        names = scenes or [info.name for info in db.scenes()]
        self._objects: dict[str, list[SceneObject]] = {
            name: list(db.scene(name, features=False, clouds=False).objects) for name in names
        }
        self._kept = Kept(db.path / FILE, _read)
        self.usage = Usage()
        self.revisions: dict[str, int] = {}
        self.changed = 0
        self.unanswered = 0

    def estimate(self) -> Estimate:
        """Calls, tokens and, where prices are configured, what they cost."""
        missing, known = self._missing()
        batches = [missing[start : start + self._batch] for start in range(0, len(missing), self._batch)]
        prompt = sum(estimated_tokens(enriching(batch, self._robot)) for batch in batches)
        completion = len(missing) * REPLY_TOKENS
        return Estimate(
            objects=sum(map(len, self._objects.values())),
            descriptions=len(missing),
            known=known,
            calls=len(batches),
            prompt_tokens=prompt,
            completion_tokens=completion,
            cost=cost(self._model, prompt, completion),
        )

    def run(self) -> Iterator[tuple[int, int]]:
        """Ask, yielding (descriptions done, of all) after each call; then write. ModelError where the model fails.

        What was answered until then is kept: the next run goes on from there.
        """
        if self._model is None:
            raise UsageError(
                "to enrich a store, a language model is asked, and none is configured",
                hint="set CGDB_LLM_BASE_URL, CGDB_LLM_MODEL and CGDB_LLM_API_KEY",
            )
        if self._db.read_only:
            raise StoreError(f"{self._db.path} cannot be written, so nothing would be kept")
        missing, _ = self._missing()
        for start in range(0, len(missing), self._batch):
            self._ask(self._model, missing[start : start + self._batch])
            yield min(start + self._batch, len(missing)), len(missing)
        self._write(self._model)

    # -- asking -------------------------------------------------------------------------------------------------

    def _missing(self) -> tuple[list[str], int]:
        """The descriptions that were not asked for yet, and how many were."""
        texts = dict.fromkeys(
            text for objects in self._objects.values() for obj in objects if (text := description(obj)) is not None
        )
        missing = [text for text in texts if self._kept.get(self._key(text)) is None]
        return missing, len(texts) - len(missing)

    def _key(self, text: str) -> str:
        name = (self._model.settings.model or "") if self._model is not None else ""
        return key_of(VERSION, name, self._robot, text)

    def _ask(self, model: Model, texts: Sequence[str]) -> None:
        answered = self._answers(model, texts)
        for text in texts:
            if text not in answered and len(texts) > 1:
                # What a batch left out is asked for alone, once.
                answered.update(self._answers(model, [text]))
            if text in answered:
                known = answered[text]
                self._kept.put(self._key(text), known, dict(known), {"description": text, "model": model.name})
            else:
                self.unanswered += 1

    def _answers(self, model: Model, texts: Sequence[str]) -> dict[str, Known]:
        meter: Meter = model.meter()
        try:
            answer = ask_json(
                model,
                enriching(texts, self._robot),
                meter,
                name="objects",
                schema=enriching_schema(),
                max_tokens=60 + 2 * REPLY_TOKENS * len(texts),
            )
        finally:
            self.usage = self.usage + meter.usage
        listed = answer.get("objects", [answer] if len(texts) == 1 else [])
        found: dict[str, Known] = {}
        for item in listed if isinstance(listed, list) else ():
            number = item.get("number", 1 if len(texts) == 1 else None) if isinstance(item, dict) else None
            if isinstance(number, int) and not isinstance(number, bool) and 1 <= number <= len(texts):
                known = checked(item)
                if known:
                    found[texts[number - 1]] = known
        return found

    # -- writing ------------------------------------------------------------------------------------------------

    def _write(self, model: Model) -> None:
        for name in self._objects:
            message = f"properties from {clean(model.name, 100)}"
            changed = []
            with self._db.write(name, kind="enrich", on_existing="merge", message=message) as writer:
                # Read while nobody else can write: what a mapper that runs beside has added since is not undone.
                for obj in self._db.scene(name).objects:
                    text = description(obj)
                    known = None if text is None else self._kept.get(self._key(text))
                    if known is not None:
                        new = self._enriched(obj, known, model.name)
                        if dict(new.properties) != dict(obj.properties):
                            changed.append(new)
                writer.objects(changed)
            if writer.revision is not None:
                self.revisions[name] = writer.revision
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
