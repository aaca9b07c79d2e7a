"""What a draft comes to: whether it answers the question, the answer in words, its facts; else what comes nearest."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

from cgdb.asking import wording
from cgdb.asking.answer import Fact, first_node
from cgdb.asking.draft import Draft
from cgdb.asking.near_misses import missing, near_misses
from cgdb.asking.shortlist import identity
from cgdb.asking.whereabouts import CatalogOf, whereabouts
from cgdb.grammar import ast
from cgdb.model.prompts import clean
from cgdb.result import Result, Row, StoredNode

if TYPE_CHECKING:
    from cgdb.english.translate import Translation

Run = Callable[[ast.Query], Result]


@dataclass(frozen=True, slots=True, kw_only=True)
class Explained:
    """achievable: something fits. text: the answer in words. facts: what was measured, counted or looked up."""

    draft: Draft
    achievable: bool
    text: str
    facts: tuple[Fact, ...] = ()


def explained(draft: Draft, catalog_of: CatalogOf, scenes: Sequence[str], run: Run, most: int) -> Explained:
    """The answer in words.

    catalog_of: of a scene; scenes: those that were asked; run: for what is yet to be looked up; most: rows at most.
    """
    result = draft.result
    if result.nothing_fits or _counts_nothing(result):
        return _nothing(draft, scenes, run)
    facts = wording.facts(draft.tree, result)
    if draft.made is None:
        return Explained(draft=draft, achievable=True, text=_plainly(result, scenes, most), facts=facts)
    asked = draft.made.asked
    if not isinstance(draft.tree.limit, ast.Number):
        most = len(result.rows) + 1  # a total has no end
    rows = wording.fit(result.rows)
    if asked.form == "where" and (nodes := [node for row in rows if (node := first_node(row)) is not None]):
        lines, found = whereabouts(nodes[: wording.NAMED], catalog_of, run)
        more = f"; and {len(nodes) - wording.NAMED:,} more" if len(nodes) > wording.NAMED else ""
        return Explained(draft=draft, achievable=True, text=clean("; ".join(lines), 600) + more, facts=(*facts, *found))
    holds, text, found = wording.answered(asked, draft.wanted, result, scenes, most, ordered=bool(draft.tree.order))
    return Explained(draft=draft, achievable=holds, text=text, facts=(*facts, *found))


def _counts_nothing(result: Result) -> bool:
    return result.columns[:1] == ("count",) and not any(row[0] for row in result.rows)


def _plainly(result: Result, scenes: Sequence[str], most: int) -> str:
    """The rows of a statement that a model wrote."""
    from cgdb.english.intent import Asked

    if first_node(result.rows[0]) is None:
        return wording.totals(result)
    return wording.answered(Asked(), "", result, scenes, most)[1]


# -- nothing fits -----------------------------------------------------------------------------------------------


def _nothing(draft: Draft, scenes: Sequence[str], run: Run) -> Explained:
    made = draft.made
    if made is None:
        return Explained(draft=draft, achievable=False, text=_nearest(draft.result))
    asked = made.asked
    counting = asked.form in ("count", "compare", "per scene", "per room", "all", "average")
    begins = "nothing fits"
    facts: tuple[Fact, ...] = ()
    if asked.form == "compare":
        begins = f"{wording.counted(0, asked.wanted)}, {wording.counted(0, asked.against)}"
    elif counting:
        begins = wording.counted(0, draft.wanted)
        facts = (Fact(what="count", value=0),)
    holds = asked.form == "count" and asked.polar and _holds_of_none(asked.what)
    if asked.polar:
        begins = f"{'yes' if holds else 'no'}: {begins}"
    absent = missing(made, run)
    if absent:
        begins += f"; there is no {' and no '.join(clean(text, 60) for text in absent)} here"
    if asked.form == "compare":
        return Explained(draft=draft, achievable=False, text=begins, facts=facts)
    if not draft.wanted and (absent or (asked.located and not asked.measured and not asked.excluded)):
        where = " and ".join(one.text for one in asked.located if not one.negated)
        nothing = f": nothing is {clean(where, 120)}" if where and not absent else ""
        return Explained(draft=draft, achievable=holds, text=begins + nothing, facts=facts)
    near = near_misses(made, run, draft.result.rows)
    rows = near.rows
    if not rows:
        return Explained(draft=draft, achievable=holds, text=f"{begins}, and nothing comes near", facts=facts)
    listed = _listed(rows, _columns(made), near.lacks, len(scenes) > 1)
    best = first_node(rows[0])
    if asked.polar and not counting and asked.form != "exists" and not absent and best is not None:
        # "Is the cup on the table?" speaks of a cup that is there.
        there = (best.scene, best.id) in near.wanted
        text = f"no: {listed}" if there else f"{begins}; the nearest is {listed}"
    else:
        text = f"{begins}; the nearest is {listed}"
    if not counting:
        draft = _with(draft, rows)
    return Explained(draft=draft, achievable=holds, text=text, facts=facts)


def _columns(made: Translation) -> list[str]:
    return [item.name or "" for item in made.query.returns]


def _holds_of_none(what: str) -> bool:
    op, _, bound = what.partition(" ")
    return op in ("<", "<=") and float(bound) > 0


def _listed(rows: Sequence[Row], columns: Sequence[str], lacks: Mapping[tuple[str, object], str], scenes: bool) -> str:
    """ "#4 cushion (not red), then #5 sofa (not red)"."""
    parts = []
    for row in rows[: wording.NAMED]:
        node = first_node(row)
        said = [wording.measured(row, columns), "" if node is None else lacks.get((node.scene, node.id), "")]
        why = clean(", ".join(part for part in said if part), 160)
        parts.append(wording.called(row, scenes=scenes) + (f" ({why})" if why else ""))
    return ", then ".join(parts)


def _with(draft: Draft, rows: Sequence[Row]) -> Draft:
    """The draft with what comes nearest in place of its first rows."""
    result = draft.result
    if not result.rows or first_node(result.rows[0]) is None:
        same = all(len(row) == len(result.columns) for row in rows)
        columns = result.columns if same and result.columns else ("o",)
        kept = tuple(rows) if same else tuple(_narrowed(row) for row in rows)
        return replace(draft, result=replace(result, columns=columns, rows=kept), nearest=True)
    shown = {identity(row) for row in rows}
    rest = tuple(row for row in result.rows if identity(row) not in shown)
    return replace(draft, result=replace(result, rows=(*rows, *rest)))


def _narrowed(row: Row) -> Row:
    return Row((first_node(row),), row.score, row.fits, lambda: row.why)


def _nearest(result: Result) -> str:
    """Of a model's statement: the row that comes nearest, and what it fits least."""
    if not result.rows:
        return "nothing fits, and nothing comes near"
    best = result.rows[0]
    weakest = min(best.why, key=lambda reason: reason.degree, default=None)
    lacks = f", but {clean(str(weakest.asked), 120)} is only {weakest.degree:.2f}" if weakest else ""
    name = first_node(best)
    if name is None:
        if isinstance(best[0], (int, float)):
            return wording.totals(replace(result, rows=(Row(best.values, best.score, True, lambda: best.why),)))
        return f"nothing fits; the nearest is another row{lacks}"
    assert isinstance(name, StoredNode)
    return f"nothing fits; the nearest is {wording.called(best)}{lacks}"
