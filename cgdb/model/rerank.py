"""Re-ranking: a language model reads the best rows and says which of them answer the question, and why.

It sees these rows only, as JSON. It may name only their ids: all others in its answer are left out, and said so. A
caption that gives orders can at worst put a candidate first that was among the best anyway.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from cgdb.errors import ExecuteError
from cgdb.model.llm import Meter, Model, ModelError, Usage, connect
from cgdb.model.llm_json import ask_json
from cgdb.model.llm_settings import settings
from cgdb.model.prompts import clean, reranking, reranking_schema
from cgdb.result import Path, Reason, Row, StoredNode, StoredRelation

LONGEST = 700
"""Tokens of an answer."""
CAPTION = 200
"""Characters of a caption that are shown."""
MOST_PROPERTIES = 8


@dataclass(frozen=True, slots=True, kw_only=True)
class Judgement:
    """What the model said, in the fields of the ConceptGraphs planner; ids are keys of the candidates."""

    inferred_query: str = ""
    relevant_objects: tuple[str, ...] = ()
    query_achievable: bool = False
    final_relevant_objects: tuple[str, ...] = ()
    explanation: str = ""
    warnings: tuple[str, ...] = ()


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


# -- rows -------------------------------------------------------------------------------------------------------


def keys_of(rows: Sequence[Row]) -> list[str]:
    """A name for each row: the id of its first object, with its scene or number where that is not enough."""
    nodes = [next((value for value in row if isinstance(value, StoredNode)), None) for row in rows]
    scenes = {node.scene for node in nodes if node is not None}
    keys: list[str] = []
    for number, node in enumerate(nodes, start=1):
        key = f"row {number}" if node is None else str(node.id) if len(scenes) < 2 else f"{node.scene}:{node.id}"
        keys.append(key if key not in keys else f"{key} (row {number})")
    return keys


def candidate(key: str, columns: Sequence[str], row: Row) -> dict[str, Any]:
    """A row as the model sees it: its first object's record, what else is in the row, and the relations that held."""
    main = next((value for value in row if isinstance(value, StoredNode)), None)
    shown: dict[str, Any] = {"id": key}
    if main is not None:
        shown.update(_record(main))
    others = {
        clean(name, 40): _brief(value)
        for name, value in zip(columns, row.values, strict=True)
        if value is not main and value is not None
    }
    if others:
        shown["with"] = others
    # What ~ found is in the record; edges and distances are not.
    held = [clean(str(reason), 120) for reason in row.why if "~" not in reason.asked]
    if held:
        shown["because"] = held[:3]
    return shown


def _record(node: StoredNode) -> dict[str, Any]:
    record: dict[str, Any] = {}
    if node.label != "Object":
        record["label"] = clean(node.label, 40)
    if node.tag:
        record["tag"] = clean(node.tag, 60)
    others = [clean(tag, 40) for tag in node.tags if tag != node.tag][:4]
    if others:
        record["also"] = others
    if node.caption:
        record["caption"] = clean(node.caption, CAPTION)
    if node.center is not None:
        record["center"] = [round(x, 1) for x in node.center.tolist()]
    if node.extent is not None:
        rotation = node.rotation
        upright = node.extent if rotation is None else np.abs(rotation) @ node.extent
        record["extent"] = [round(x, 1) for x in upright.tolist()]
    if node.properties:
        some = list(node.properties.items())[:MOST_PROPERTIES]
        record["properties"] = {clean(name, 40): _brief(value) for name, value in some}
    return record


def _brief(value: Any) -> Any:
    if isinstance(value, (StoredNode, StoredRelation, Path)):
        return clean(str(value), 80)
    if isinstance(value, float):
        return round(value, 2)
    if isinstance(value, (list, tuple)):
        return [_brief(item) for item in value[:8]]
    return clean(value, 80) if isinstance(value, str) else value


def judged(rows: Sequence[Row], keys: Sequence[str], question: str, said: Judgement) -> tuple[Row, ...]:
    """The rows in the model's order: those that it chose fit, best first; the others keep theirs and do not."""
    by_key = dict(zip(keys, rows, strict=True))
    chosen = [key for key in said.final_relevant_objects if key in by_key]
    order = [*chosen, *(key for key in keys if key not in chosen)]
    return tuple(_told(by_key[key], key in chosen, question, said.explanation) for key in order)


def _told(row: Row, chosen: bool, question: str, explanation: str) -> Row:
    def explain() -> tuple[Reason, ...]:
        said = {"said": explanation} if chosen and explanation else {}
        return (*row.why, Reason(asked=f'RERANK BY "{clean(question, 80)}"', degree=float(chosen), evidence=said))

    return Row(row.values, row.score, chosen, explain)


# -- RERANK BY --------------------------------------------------------------------------------------------------


def rerank(
    model: Model | None, question: str, columns: Sequence[str], rows: Sequence[Row], top: int
) -> tuple[tuple[Row, ...], tuple[str, ...], Usage]:
    """RERANK BY: the best ``top`` rows as a model orders them, then the rest; warnings; what it cost.

    ExecuteError where no model is configured; ModelError where it fails: who asks for a model's order gets no other.
    """
    model = model or configured()
    if model is None:
        raise ExecuteError(
            "RERANK BY asks a language model, and none is configured",
            hint="set CGDB_LLM_BASE_URL, CGDB_LLM_MODEL and CGDB_LLM_API_KEY, or leave RERANK BY out",
        )
    if not rows or top < 1:
        return tuple(rows), (), Usage()
    best = rows[:top]
    keys = keys_of(best)
    meter = model.meter()
    shown = [candidate(key, columns, row) for key, row in zip(keys, best, strict=True)]
    said = judge(model, question, shown, meter)
    return (*judged(best, keys, question, said), *rows[top:]), said.warnings, meter.usage


def configured() -> Model | None:
    """The model of the environment or config file; None where there is none."""
    found = settings()
    return None if found is None else connect(found)
