"""Retrieval: the ways to answer a question over a map, side by side."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from functools import lru_cache
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from cgdb.errors import CgdbError, ExecuteError
from cgdb.export.planner_json import planner
from cgdb.meaning.embed import text_encoder
from cgdb.model.llm import Model, ModelError, Usage
from cgdb.model.llm_json import ask_json
from cgdb.model.prompts import planner_schema, whole_map
from cgdb.model.rerank import Reranker, judgement
from cgdb.result import Row, StoredNode

if TYPE_CHECKING:
    from cgdb.asking.answer import Answer
    from cgdb.database import Database

MOST = 10
"""Objects of an answer that are kept."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Outcome:
    """ids: best first. achievable None: the way always names something, and cannot say that nothing fits."""

    ids: tuple[str, ...]
    achievable: bool | None
    usage: Usage = field(default_factory=Usage)
    seconds: float = 0.0
    record: Mapping[str, Any] = field(default_factory=dict)
    error: str | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class Helpers:
    """What ways may need beside the map: a language model, a cross-encoder."""

    model: Model | None = None
    cross: Reranker | None = None

    def the_model(self) -> Model:
        """The language model. ExecuteError where there is none."""
        if self.model is None:
            raise ExecuteError(
                "this way asks a language model, and none is configured",
                hint="set CGDB_LLM_BASE_URL, CGDB_LLM_MODEL and CGDB_LLM_API_KEY",
            )
        return self.model

    def the_cross(self) -> Reranker:
        """The cross-encoder. ExecuteError where there is none."""
        if self.cross is None:
            raise ExecuteError(
                "this way needs a cross-encoder, and none is named", hint="--rerank cross:FOLDER_OR_NAME"
            )
        return self.cross


Way = Callable[["Database", str, Helpers], Outcome]


def asked(way: str, db: Database, query: str, helpers: Helpers) -> Outcome:
    """What a way answers to one query; an error is an outcome that names nothing."""
    started = time.perf_counter()
    try:
        outcome = WAYS[way].run(db, query, helpers)
    except CgdbError as error:
        outcome = Outcome(ids=(), achievable=None, error=error.message)
    return replace(outcome, ids=outcome.ids[:MOST], seconds=time.perf_counter() - started)


def _encoder(db: Database, query: str, helpers: Helpers) -> Outcome:
    """The nearest captions by the text encoder's cosine alone."""
    return Outcome(ids=tuple(str(node.id) for node in _nearest_captions(db, query, MOST)), achievable=None)


def _encoder_cross(db: Database, query: str, helpers: Helpers) -> Outcome:
    """The nearest captions by the text encoder, in the order of a cross-encoder."""
    cross = helpers.the_cross()
    rows = [Row((node,), 1.0, True, tuple) for node in _nearest_captions(db, query, cross.most)]
    ranked = cross.rerank(query, ("o",), rows)
    return Outcome(
        ids=tuple(str(node.id) for row in ranked.rows for node in row if isinstance(node, StoredNode)),
        achievable=None,
        usage=ranked.usage,
    )


def _nearest_captions(db: Database, query: str, most: int) -> list[StoredNode]:
    objects = [
        StoredNode(scene=info.name, id=obj.id, tag=obj.tag, tags=obj.tags, caption=obj.caption)
        for info in db.scenes()
        for obj in db.scene(info.name, features=False, clouds=False).objects
    ]
    vectors = _vectors(tuple(obj.caption or obj.tag or "" for obj in objects))
    order = np.argsort(-(vectors @ text_encoder().texts([query])[0]), kind="stable")
    return [objects[i] for i in order[:most].tolist()]


@lru_cache(maxsize=2)
def _vectors(captions: tuple[str, ...]) -> NDArray[np.float32]:
    return text_encoder().texts(captions)


def _clip(db: Database, query: str, helpers: Helpers) -> Outcome:
    """The nearest image features by the cosine of their encoder's text tower."""
    spaces = [space.name for info in db.scenes() for space in info.spaces]
    if not spaces:
        raise ExecuteError("the map has no image features")
    hits = db.search(query, space=spaces[0], k=MOST)
    return Outcome(ids=tuple(str(hit.id) for hit in hits), achievable=None)


def _meaning(db: Database, query: str, helpers: Helpers) -> Outcome:
    """``o ~ query``, with all the evidence that the store has open: encoders, or words and common knowledge alone."""
    result = db.query("MATCH (o ~ $q) RETURN o.id LIMIT $n", q=query, n=MOST)
    return Outcome(ids=tuple(str(row[0]) for row in result), achievable=not result.nothing_fits)


def _built_in(db: Database, query: str, helpers: Helpers) -> Outcome:
    return _of_answer(db.ask(query, model=False))


def _built_in_cross(db: Database, query: str, helpers: Helpers) -> Outcome:
    return _of_answer(db.ask(query, model=False, rerank=helpers.the_cross()))


def _translated(db: Database, query: str, helpers: Helpers) -> Outcome:
    return _of_answer(db.ask(query, model=helpers.the_model(), rerank=False))


def _reranked(db: Database, query: str, helpers: Helpers) -> Outcome:
    return _of_answer(db.ask(query, model=helpers.the_model()))


def _of_answer(answer: Answer) -> Outcome:
    from cgdb.asking.answer import answering

    ids = dict.fromkeys(str(node.id) for row in answer.rows for node in answering(row))
    record = answer.to_dict()
    del record["rows"]
    return Outcome(ids=tuple(ids), achievable=answer.achievable, usage=answer.usage, record=record)


def _whole_map(db: Database, query: str, helpers: Helpers) -> Outcome:
    """The paper's way: all objects of the map in the prompt, each with the five fields of its Listing 4."""
    import json

    model = helpers.the_model()
    objects: list[Any] = []
    for info in db.scenes():
        objects += json.loads("".join(planner(db.scene(info.name, features=False, clouds=False)).pieces))
    ids = [str(obj["id"]) for obj in objects]
    meter = model.meter()
    try:
        answer = ask_json(
            model, whole_map(query, objects), meter, name="plan", schema=planner_schema(ids), max_tokens=700
        )
        said = judgement(answer, ids)
    except ModelError as error:
        return Outcome(ids=(), achievable=None, usage=meter.usage, error=error.message)
    named = tuple(dict.fromkeys((*said.final_relevant_objects, *said.relevant_objects)))
    record = {"explanation": said.explanation, "inferred_query": said.inferred_query, "warnings": list(said.warnings)}
    return Outcome(ids=named, achievable=said.query_achievable, usage=meter.usage, record=record)


@dataclass(frozen=True, slots=True, kw_only=True)
class Kind:
    """needs_model: a language model; needs_cross: a cross-encoder. encoders: whether the store may encode texts."""

    run: Way
    says: str
    needs_model: bool = False
    needs_cross: bool = False
    encoders: bool = True


WAYS: Mapping[str, Kind] = {
    "words": Kind(run=_meaning, says="`o ~ query` by words and common knowledge, no encoder", encoders=False),
    "encoder": Kind(run=_encoder, says="cosine of the text encoder between query and caption, alone"),
    "embedding+cross": Kind(
        run=_encoder_cross, says="the nearest by the text encoder, in the order of a cross-encoder", needs_cross=True
    ),
    "clip": Kind(run=_clip, says="cosine in the map's image features, alone"),
    "meaning": Kind(run=_meaning, says="`o ~ query`, the whole question as one meaning"),
    "built-in": Kind(run=_built_in, says="the built-in translator"),
    "built-in+cross": Kind(
        run=_built_in_cross, says="the built-in translator, in the order of a cross-encoder", needs_cross=True
    ),
    "model": Kind(run=_translated, says="a model translates", needs_model=True),
    "model+rerank": Kind(run=_reranked, says="a model translates and re-ranks", needs_model=True),
    "whole-map": Kind(run=_whole_map, says="a model reads the whole map, as in the paper", needs_model=True),
}
