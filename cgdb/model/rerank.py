"""Re-ranking: the best rows are read once more, and put in the order in which they answer the question.

A language model sees these rows only, as JSON. It may name only their ids: all others in its answer are left out, and
said so. A caption that gives orders can at worst put a candidate first that was among the best anyway. A cross-encoder
gives each row a score and no opinion on whether anything fits.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import lru_cache
from typing import Any, ClassVar, Protocol

from cgdb.errors import ExecuteError, UsageError
from cgdb.model.candidates import candidate, keys_of
from cgdb.model.llm import Meter, Model, ModelError, Usage, connect
from cgdb.model.llm_json import ask_json
from cgdb.model.llm_settings import settings
from cgdb.model.prompts import clean, reranking, reranking_schema
from cgdb.result import Reason, Row

LONGEST = 700
"""Tokens of an answer."""
CROSS = "cross:"


@dataclass(frozen=True, slots=True, kw_only=True)
class Judgement:
    """What the model said, in the fields of the ConceptGraphs planner; ids are keys of the candidates."""

    inferred_query: str = ""
    relevant_objects: tuple[str, ...] = ()
    query_achievable: bool = False
    final_relevant_objects: tuple[str, ...] = ()
    explanation: str = ""
    warnings: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True, kw_only=True)
class Reranked:
    """Rows in their new order. said: what a language model said of them; None of a cross-encoder, which says nothing.

    relevant: the rows that have to do with the question.
    """

    rows: tuple[Row, ...]
    said: Judgement | None = None
    relevant: tuple[Row, ...] = ()
    warnings: tuple[str, ...] = ()
    usage: Usage = field(default_factory=Usage)


class Reranker(Protocol):
    """Puts rows in the order in which they answer a question. most: rows that it should be given, at most."""

    most: ClassVar[int]

    @property
    def name(self) -> str:
        """Who orders, for people."""
        ...

    def rerank(
        self, question: str, columns: Sequence[str], rows: Sequence[Row], meter: Meter | None = None
    ) -> Reranked:
        """These rows, all of them. meter: the account of the question, where it has one."""
        ...


@dataclass(frozen=True, slots=True)
class ModelReranker:
    """A language model as a re-ranker. It reads few rows, some 40 to 80 tokens each."""

    most: ClassVar[int] = 15
    model: Model

    @property
    def name(self) -> str:
        """The model's name."""
        return self.model.name

    def rerank(
        self, question: str, columns: Sequence[str], rows: Sequence[Row], meter: Meter | None = None
    ) -> Reranked:
        """The rows that the model chose, best first, then the others. ModelError where it says nothing of use."""
        meter = meter or self.model.meter()
        before = meter.usage
        keys = keys_of(rows)
        shown = [candidate(key, columns, row) for key, row in zip(keys, rows, strict=True)]
        said = judge(self.model, question, shown, meter)
        by_key = dict(zip(keys, rows, strict=True))
        return Reranked(
            rows=judged(rows, keys, question, said, by=self.name),
            said=said,
            relevant=tuple(by_key[key] for key in said.relevant_objects),
            warnings=said.warnings,
            usage=meter.usage - before,
        )


def judge(model: Model, question: str, candidates: Sequence[Mapping[str, Any]], meter: Meter) -> Judgement:
    """What a model says of candidates, each with an "id". ModelError where it says nothing that can be used."""
    ids = [str(candidate["id"]) for candidate in candidates]
    answer = ask_json(
        model,
        reranking(question, candidates),
        meter,
        name="answer",
        schema=reranking_schema(ids),
        max_tokens=LONGEST,
    )
    return judgement(answer, ids)


def judgement(answer: Mapping[str, Any], known: Sequence[str]) -> Judgement:
    """An answer, checked: what is no id of a candidate is left out. ModelError where it has none of the fields."""
    if not answer.keys() & {"final_relevant_objects", "relevant_objects", "query_achievable"}:
        raise ModelError("the model's answer has none of the fields that it was asked for")
    unknown: dict[str, None] = {}
    final = _ids(answer.get("final_relevant_objects"), known, unknown)
    relevant = _ids(answer.get("relevant_objects"), known, unknown)
    warnings = []
    if unknown:
        shown = ", ".join(clean(item, 20) for item in list(unknown)[:4])
        warnings.append(f"the model named what is no candidate, and was not believed: {shown}")
    achievable = answer.get("query_achievable")
    if not isinstance(achievable, bool):
        achievable = bool(final)
    if achievable and not final:
        if relevant and not unknown:
            final = relevant
        else:
            # It says yes and names nothing that exists: that is no answer.
            achievable = False
            warnings.append("the model says that something fits, but names no candidate")
    return Judgement(
        inferred_query=clean(_text(answer.get("inferred_query")), 200),
        relevant_objects=tuple(dict.fromkeys((*relevant, *final))),
        query_achievable=achievable,
        final_relevant_objects=final if achievable else (),
        explanation=clean(_text(answer.get("explanation")), 600),
        warnings=tuple(warnings),
    )


def _ids(given: Any, known: Sequence[str], unknown: dict[str, None]) -> tuple[str, ...]:
    found: dict[str, None] = {}
    for item in given if isinstance(given, list) else () if given is None else (given,):
        if isinstance(item, dict):
            item = item.get("id")
        name = str(item).removeprefix("#").strip() if not isinstance(item, bool) else ""
        if name in known:
            found[name] = None
        else:
            unknown[str(item)] = None
    return tuple(found)


def _text(value: Any) -> str:
    return value if isinstance(value, str) else ""


def judged(
    rows: Sequence[Row], keys: Sequence[str], question: str, said: Judgement, *, by: str = ""
) -> tuple[Row, ...]:
    """The rows in the model's order: those that it chose fit, best first; the others keep theirs and do not."""
    by_key = dict(zip(keys, rows, strict=True))
    chosen = [key for key in said.final_relevant_objects if key in by_key]
    order = [*chosen, *(key for key in keys if key not in chosen)]
    return tuple(_told(by_key[key], key in chosen, question, said.explanation, by) for key in order)


def _told(row: Row, chosen: bool, question: str, explanation: str, by: str) -> Row:
    def explain() -> tuple[Reason, ...]:
        said = {"by": by} if by else {}
        if chosen and explanation:
            said["said"] = explanation
        return (*row.why, Reason(asked=f'RERANK BY "{clean(question, 80)}"', degree=float(chosen), evidence=said))

    return Row(row.values, row.score, chosen, explain)


# -- RERANK BY --------------------------------------------------------------------------------------------------


def rerank(
    reranker: Reranker | Model | None, question: str, columns: Sequence[str], rows: Sequence[Row], top: int
) -> Reranked:
    """RERANK BY: the best ``top`` rows in a new order, then the rest. None: the model that is configured.

    ExecuteError where none is; ModelError where it fails: who asks for another order gets no other.
    """
    chosen = ModelReranker(reranker) if isinstance(reranker, Model) else reranker
    if chosen is None:
        model = configured()
        if model is None:
            raise ExecuteError(
                "RERANK BY asks a language model, and none is configured",
                hint="set CGDB_LLM_BASE_URL, CGDB_LLM_MODEL and CGDB_LLM_API_KEY, name a cross-encoder, "
                "or leave RERANK BY out",
            )
        chosen = ModelReranker(model)
    if not rows or top < 1:
        return Reranked(rows=tuple(rows))
    found = chosen.rerank(question, columns, rows[:top])
    return replace(found, rows=(*found.rows, *rows[top:]))


def named(name: str) -> Reranker:
    """The re-ranker of a name: "cross:" and a cross-encoder's folder or name; "model", the one that is configured."""
    if name.startswith(CROSS):
        return _cross_encoder(name.removeprefix(CROSS))
    if name == "model":
        model = configured()
        if model is None:
            raise UsageError(
                "no language model is configured",
                hint="set CGDB_LLM_BASE_URL, CGDB_LLM_MODEL and CGDB_LLM_API_KEY",
            )
        return ModelReranker(model)
    raise UsageError(
        f"there is no re-ranker '{name[:60]}'", hint="model, or cross: and the folder or name of a cross-encoder"
    )


@lru_cache(maxsize=2)
def _cross_encoder(name: str) -> Reranker:
    """Loaded once: each question would wait for it."""
    from cgdb.model.cross_encoder import CrossEncoder

    return CrossEncoder.load(name)


def configured() -> Model | None:
    """The model of the environment or config file; None where there is none."""
    found = settings()
    return None if found is None else connect(found)
