"""Captions and names of a map's objects from their best views, by a vision model (ConceptGraphs, Section II-C).

As in the paper, each of the best views is captioned and the captions are refined to one; or, with ``together``, all
views go into one call. Replies are kept in the store's folder as they come; what is written is one revision per scene.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from hashlib import sha256
from typing import TYPE_CHECKING, Any

from cgdb.enrich.calls import Pace, Turn, cost
from cgdb.enrich.kept import Kept, key_of
from cgdb.enrich.numbered import own_meter
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
from cgdb.enrich.work import Task, Work
from cgdb.errors import UsageError
from cgdb.model.llm import Message, Meter, Model, ModelError, estimated_tokens
from cgdb.model.llm_json import ask_json
from cgdb.model.prompts import clean
from cgdb.scene import ObjectId, PropertyValue, SceneObject, View

if TYPE_CHECKING:
    from cgdb.database import Database
    from cgdb.storage.ledger import SceneWriter

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
class _Caption(Task):
    """An object to ask of. n: of its crops; images: they, best first, when its turn is near. detected: its names."""

    id: ObjectId
    n: int
    detected: tuple[str, ...]
    images: tuple[bytes, ...] = ()


class Captioning(Work[_Caption, Captioned]):
    """The captions of some scenes of a store; see ``Work``."""

    kind, adds = "caption", "captions"
    needs = "to caption a map, a vision model is asked"

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
        super().__init__(db, model, Kept(db.path / FILE, checked), scenes=scenes, pace=pace)
        self._views, self._at_once, self._again = views, together, again
        self._objects = self._bare = 0
        self._tasks = [task for scene in self._scenes for task in self._tasks_of(scene)]
        self.changed = self.invalid = 0

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

    # -- asking -------------------------------------------------------------------------------------------------

    def _tasks_of(self, scene: str) -> Iterator[_Caption]:
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
            key = key_of(VERSION, self._model_name, self._at_once, shown, detected)
            yield _Caption(scene=scene, key=key, about={"object": obj.id}, id=obj.id, n=len(shown), detected=detected)

    def _shown(self, views: Sequence[View]) -> tuple[bytes, ...]:
        return tuple(view.image for view in views if view.image is not None)[: self._views]

    def _loaded(self, batch: Sequence[_Caption]) -> Sequence[_Caption]:
        return [replace(task, images=self._shown(self._db.views(task.id, scene=task.scene))) for task in batch]

    def _ask(self, model: Model, batch: Sequence[_Caption], meter: Meter, turn: Turn) -> Mapping[int, Captioned]:
        (task,) = batch
        return {0: _together(model, task, meter) if self._at_once else _one_by_one(model, task, meter, turn)}

    # -- writing ------------------------------------------------------------------------------------------------

    def _as_json(self, known: Captioned) -> Any:
        return known.as_json()

    def _add(self, writer: SceneWriter, scene: str, model: Model) -> None:
        known = {task.id: self._kept.get(task.key) for task in self._tasks if task.scene == scene}
        changed = [
            new
            for obj in self._db.scene(scene).objects
            if (found := known.get(obj.id)) is not None and (new := _described(obj, found, model.name)) is not obj
        ]
        writer.objects(changed)
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


def _together(model: Model, task: _Caption, meter: Meter) -> Captioned:
    messages = seeing([picture_url(image) for image in task.images], task.detected)
    room = 4 * (REFINED_TOKENS + CAPTION_TOKENS * task.n)
    return _refined(model, messages, refining_schema(captions=True), room, meter)


def _one_by_one(model: Model, task: _Caption, meter: Meter, turn: Turn) -> Captioned:
    captions = []
    for image in task.images:
        captions.append(_looked(model, image, meter))
        turn()
    captions = [caption for caption in captions if caption]
    found = _refined(model, refining(captions, task.detected), refining_schema(), 4 * REFINED_TOKENS, meter)
    return replace(found, captions=tuple(captions))


def _looked(model: Model, image: bytes, meter: Meter) -> str:
    with own_meter(model, meter) as own:
        return clean(model.chat(looking(picture_url(image)), own, max_tokens=4 * CAPTION_TOKENS).said, LONGEST_CAPTION)


def _refined(model: Model, messages: list[Message], schema: dict[str, Any], room: int, meter: Meter) -> Captioned:
    with own_meter(model, meter) as own:
        found = checked(ask_json(model, messages, own, name="object", schema=schema, max_tokens=room))
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
