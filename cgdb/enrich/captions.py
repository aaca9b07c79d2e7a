"""Captions and names of a map's objects from their best views, by a vision model (ConceptGraphs, Section II-C).

As in the paper, each of the best views is captioned and the captions are refined to one; or, with ``together``, all
views go into one call. Replies are kept in the store's folder as they come; what is written is one revision per scene.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import partial
from hashlib import sha256
from typing import TYPE_CHECKING, Any

from cgdb.enrich.calls import Pace, Turn, cost, each
from cgdb.enrich.kept import Kept, key_of
from cgdb.enrich.prompts import (
    INVALID,
    LONGEST_CAPTION,
    MOST_TAGS,
    PICTURE_TOKENS,
    looking,
    name,
    picture_url,
    refining,
    refining_schema,
    seeing,
)
from cgdb.errors import StoreError, UsageError
from cgdb.model.llm import Message, Meter, Model, ModelError, Usage, estimated_tokens
from cgdb.model.llm_json import ask_json
from cgdb.model.prompts import clean
from cgdb.scene import PropertyValue, SceneObject, View

if TYPE_CHECKING:
    from cgdb.database import Database

FILE = "captions.jsonl"
VERSION = 1
"""Of the questions that are asked; a change asks all anew."""
VIEWS = 10
CAPTION_TOKENS, REFINED_TOKENS = 60, 120
"""Of replies, for estimates and as a quarter of the room that they get."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Estimate:
    """What it will take. pending: objects to be asked of; bare: objects without crops, which cannot be captioned."""

    objects: int
    pending: int
    known: int
    bare: int
    calls: int
    prompt_tokens: int
    completion_tokens: int
    cost: float | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class Captioned:
    """What a model made of an object's views. tag "invalid": the views show no single object."""

    captions: tuple[str, ...]
    summary: str
    tags: tuple[str, ...]
    tag: str

    def as_json(self) -> dict[str, Any]:
        """The paper's fields."""
        return {
            "captions": list(self.captions),
            "summary": self.summary,
            "possible_tags": list(self.tags),
            "object_tag": self.tag,
        }


@dataclass(frozen=True, slots=True, kw_only=True)
class _Task:
    """An object to ask of. n: of its crops; images: they, best first, when its turn is near. detected: its names."""

    scene: str
    id: int | str
    n: int
    detected: tuple[str, ...]
    key: str
    images: tuple[bytes, ...] = ()


class Captioning:
    """The work on some scenes of a store: ``estimate``, then ``run``, then what ``revisions`` and ``usage`` say."""

    def __init__(
        self,
        db: Database,
        model: Model | None,
        *,
        scenes: Sequence[str] = (),
        views: int = VIEWS,
        together: bool = False,
        again: bool = False,
        pace: Pace | None = None,
    ) -> None:
        """model None: only to estimate. again: also objects that have a caption, which is then replaced."""
        if not 1 <= views <= 100:
            raise UsageError(f"1 to 100 views of each object, not {views}")
        self._db, self._model = db, model
        self._views, self._at_once, self._again, self._pace = views, together, again, pace or Pace()
        self._kept = Kept(db.path / FILE, checked)
        self._names = list(scenes) or [info.name for info in db.scenes()]
        self._objects = self._bare = 0
        self._tasks = [task for scene in self._names for task in self._tasks_of(scene)]
        self.usage = Usage()
        self.revisions: dict[str, int] = {}
        self.changed = self.invalid = self.unanswered = 0

    def estimate(self) -> Estimate:
        """Calls, tokens and, where prices are configured, what they cost."""
        missing = self._missing()
        images = sum(task.n for task in missing)
        words = estimated_tokens(looking("")) if not self._at_once else 0
        calls = len(missing) if self._at_once else images + len(missing)
        refined = sum(
            estimated_tokens(seeing([], task.detected) if self._at_once else refining([], task.detected))
            for task in missing
        )
        prompt = images * (PICTURE_TOKENS + words) + refined + (0 if self._at_once else images * CAPTION_TOKENS)
        completion = images * CAPTION_TOKENS + len(missing) * REFINED_TOKENS
        return Estimate(
            objects=self._objects,
            pending=len(missing),
            known=len(self._tasks) - len(missing),
            bare=self._bare,
            calls=calls,
            prompt_tokens=prompt,
            completion_tokens=completion,
            cost=cost(self._model, prompt, completion),
        )

    def run(self) -> Iterator[tuple[int, int]]:
        """Ask, yielding (objects done, of all) after each; then write. ModelError where the model fails.

        What was answered until then is kept: the next run goes on from there.
        """
        if self._model is None:
            raise UsageError(
                "to caption a map, a vision model is asked, and none is configured",
                hint="set CGDB_LLM_BASE_URL, CGDB_LLM_MODEL and CGDB_LLM_API_KEY",
            )
        if self._db.read_only:
            raise StoreError(f"{self._db.path} cannot be written, so nothing would be kept")
        model, missing = self._model, self._missing()
        tasks = (replace(task, images=self._images(task.scene, task.id)) for task in missing)
        ask = self._together if self._at_once else self._one_by_one
        for i, answered in enumerate(each(model, tasks, partial(ask, model), self._pace), start=1):
            self.usage = self.usage + answered.usage
            if answered.answer is None:
                self.unanswered += 1
            else:
                task = answered.item
                about = {"object": task.id, "model": model.name}
                self._kept.put(task.key, answered.answer, answered.answer.as_json(), about)
            yield i, len(missing)
        self._write(model)

    # -- asking -------------------------------------------------------------------------------------------------

    def _tasks_of(self, scene: str) -> Iterator[_Task]:
        # In one pass: to look for the views of each object costs a reading of all of them for every one without.
        seen = {
            id: [sha256(image).hexdigest()[:16] for image in self._shown(views)]
            for id, views in self._db.every_views(scene)
        }
        for obj in self._db.scene(scene, features=False, clouds=False).objects:
            self._objects += 1
            if obj.properties.get("background") is True or (obj.caption and not self._again and not _ours(obj)):
                continue
            shown = seen.get(obj.id)
            if not shown:
                self._bare += 1
                continue
            detected = _detected(obj)
            key = key_of(VERSION, self._model_name(), self._at_once, shown, detected)
            yield _Task(scene=scene, id=obj.id, n=len(shown), detected=detected, key=key)

    def _images(self, scene: str, id: int | str) -> tuple[bytes, ...]:
        return self._shown(self._db.views(id, scene=scene))

    def _shown(self, views: Sequence[View]) -> tuple[bytes, ...]:
        return tuple(view.image for view in views if view.image is not None)[: self._views]

    def _model_name(self) -> str:
        return (self._model.settings.model or "") if self._model is not None else ""

    def _missing(self) -> list[_Task]:
        return [task for task in self._tasks if self._kept.get(task.key) is None]

    def _together(self, model: Model, task: _Task, meter: Meter, _: Turn) -> Captioned:
        messages = seeing([picture_url(image) for image in task.images], task.detected)
        room = 4 * (REFINED_TOKENS + CAPTION_TOKENS * task.n)
        return _usable(_refined(model, messages, refining_schema(captions=True), room, meter))

    def _one_by_one(self, model: Model, task: _Task, meter: Meter, turn: Turn) -> Captioned:
        captions = []
        for image in task.images:
            captions.append(_looked(model, image, meter))
            turn()
        captions = [caption for caption in captions if caption]
        found = _refined(model, refining(captions, task.detected), refining_schema(), 4 * REFINED_TOKENS, meter)
        return replace(_usable(found), captions=tuple(captions))

    # -- writing ------------------------------------------------------------------------------------------------

    def _write(self, model: Model) -> None:
        for scene in self._names:
            known = {task.id: self._kept.get(task.key) for task in self._tasks if task.scene == scene}
            if not any(known.values()):
                continue
            message = f"captions from {clean(model.name, 100)}"
            with self._db.write(scene, kind="caption", on_existing="merge", message=message) as writer:
                # Read while nobody else can write: what a mapper that runs beside has added since is not undone.
                changed = [
                    new
                    for obj in self._db.scene(scene).objects
                    if (found := known.get(obj.id)) is not None
                    and (new := _described(obj, found, model.name)) is not obj
                ]
                writer.objects(changed)
            if writer.revision is not None:
                self.revisions[scene] = writer.revision
            self.changed += len(changed)
            self.invalid += sum(obj.properties.get(INVALID) is True for obj in changed)


def checked(answer: Any) -> Captioned | None:
    """What of an answer is as it was asked for; None where there is no name or no summary in it."""
    tag = name(answer.get("object_tag"))
    summary = answer.get("summary")
    if not tag or not isinstance(summary, str) or not summary.strip():
        return None
    listed = answer.get("possible_tags")
    tags = [name(item) for item in listed] if isinstance(listed, list) else []
    said = answer.get("captions")
    captions = (
        [clean(item, LONGEST_CAPTION) for item in said if isinstance(item, str)] if isinstance(said, list) else []
    )
    return Captioned(
        captions=tuple(text for text in captions if text),
        summary=clean(summary, LONGEST_CAPTION),
        tags=tuple(dict.fromkeys(tag for tag in tags if tag and tag != INVALID))[:MOST_TAGS],
        tag=tag,
    )


def _looked(model: Model, image: bytes, meter: Meter) -> str:
    own = model.meter()  # the deadline is that of one question, and an object is as many as it has views
    try:
        return clean(model.chat(looking(picture_url(image)), own, max_tokens=4 * CAPTION_TOKENS).said, LONGEST_CAPTION)
    finally:
        meter.add(own.usage)


def _refined(
    model: Model, messages: list[Message], schema: dict[str, Any], room: int, meter: Meter
) -> Captioned | None:
    own = model.meter()
    try:
        return checked(ask_json(model, messages, own, name="object", schema=schema, max_tokens=room))
    finally:
        meter.add(own.usage)


def _usable(found: Captioned | None) -> Captioned:
    if found is None:
        raise ModelError("the model gives the object no name")
    return found


def _ours(obj: SceneObject) -> bool:
    return "captioned_by" in obj.properties


def _detected(obj: SceneObject) -> tuple[str, ...]:
    """The names that the map gave it before a model looked: the same in every run."""
    before = obj.properties.get("detected_tags")
    if _ours(obj) or isinstance(before, tuple):
        return tuple(str(tag) for tag in before) if isinstance(before, tuple) else ()
    named = Counter([*([obj.tag] if obj.tag else []), *obj.tags])
    return tuple(clean(tag, LONGEST_CAPTION) for tag in named)[:MOST_TAGS]


def _described(obj: SceneObject, found: Captioned, model: str) -> SceneObject:
    """The object with its caption and name; an invalid one keeps the name that it had, and is flagged."""
    own: dict[str, PropertyValue] = {key: value for key, value in obj.properties.items() if key != INVALID}
    detected = _detected(obj)
    if found.tag == INVALID:
        own[INVALID] = True
    if detected:
        own["detected_tags"] = detected
    own["captioned_by"] = clean(model, 100)
    own["view_captions"] = found.captions
    tag = obj.tag if found.tag == INVALID else found.tag
    tags = tuple(dict.fromkeys([*found.tags, *detected]))
    new = replace(obj, tag=tag, tags=tags, caption=found.summary, properties=own)
    same = (new.tag, new.tags, new.caption, new.properties) == (obj.tag, obj.tags, obj.caption, dict(obj.properties))
    return obj if same else new
