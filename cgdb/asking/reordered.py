"""A draft read once more: what a re-ranker is given, and the rows in the order in which it leaves them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

from cgdb.asking.answer import first_node
from cgdb.asking.draft import Draft
from cgdb.asking.shortlist import identity
from cgdb.asking.statements import returns_total
from cgdb.model.llm import Meter, Model
from cgdb.model.rerank import Judgement, ModelReranker, Reranker, named
from cgdb.result import Reason, Row
from cgdb.scene import ObjectId

TOO_STRICT = "the statement was too strict; some of the answer are the nearest things beside it"


@dataclass(frozen=True, slots=True, kw_only=True)
class Reordered:
    """A draft in its new order. said: the opinion of a language model, None of a re-ranker that has none.

    relevant: ids of what has to do with the question, where there is an opinion.
    """

    draft: Draft
    said: Judgement | None
    relevant: tuple[ObjectId, ...] = ()
    warnings: tuple[str, ...] = ()


def reranker_of(given: bool | str | Reranker, model: Model | None) -> Reranker | None:
    """Who reads the best rows once more. UsageError, EncoderError, MissingExtraError where a name is none."""
    if isinstance(given, bool):
        return ModelReranker(model) if given and model is not None else None
    if isinstance(given, str):
        return ModelReranker(model) if given == "model" and model is not None else named(given)
    return given


def has_an_order(draft: Draft) -> bool:
    """Whether there is nothing to reorder: what was measured (nearest, largest), totals, and values without objects."""
    if draft.tree.order and not draft.result.nothing_fits:
        return True
    rows = draft.result.rows
    return not rows or first_node(rows[0]) is None or returns_total(draft.tree)


def reordered(draft: Draft, question: str, best: Sequence[Row], reranker: Reranker, meter: Meter) -> Reordered:
    """The draft as a re-ranker orders it. best: the rows that it reads; the others follow them.

    ModelError, MissingExtraError where the re-ranker fails.
    """
    rows = draft.result.rows
    found = reranker.rerank(question, draft.result.columns, best, meter)
    warnings = list(found.warnings)
    read = {identity(row) for row in best}
    rest = tuple(row for row in rows if identity(row) not in read)
    own = set() if draft.nearest else {identity(row) for row in rows}
    relevant: tuple[ObjectId, ...] = ()
    if found.said is None:
        # A cross-encoder orders; what fits is as the statement says.
        meter.add(found.usage)
        mine = tuple(row for row in found.rows if row.fits or identity(row) in own)
        ordered = tuple(sorted((*mine, *rest), key=lambda row: not row.fits)) or found.rows
    else:
        ordered = (*found.rows, *(map(_unread, rest) if found.said.query_achievable else ()))
        if any(row.fits and identity(row) not in own for row in found.rows):
            warnings.append(TOO_STRICT)
        relevant = tuple(dict.fromkeys(node.id for row in found.relevant if (node := first_node(row)) is not None))
    draft = replace(draft, result=replace(draft.result, rows=ordered)).cut()
    return Reordered(draft=draft, said=found.said, relevant=relevant, warnings=tuple(warnings))


def failing(row: Row, query: str) -> Row:
    """The row as one that does not fit what a statement asks."""
    return Row(row.values, row.score, False, lambda: (*row.why, Reason(asked=query, degree=0.0)))


def _unread(row: Row) -> Row:
    return Row(row.values, row.score, False, lambda: row.why)
