"""Re-ranking: what is taken of a model's answer, and how candidates are shown to it."""

from __future__ import annotations

import json
from typing import Any

import numpy as np
import pytest

from cgdb.model.candidates import candidate, keys_of
from cgdb.model.llm import ModelError
from cgdb.model.rerank import judged, judgement
from cgdb.result import Reason, Row, StoredNode

KNOWN = ["1", "2", "cup-3"]


def said(**fields: Any) -> dict[str, Any]:
    whole = {
        "inferred_query": "q",
        "relevant_objects": ["1", "2"],
        "query_achievable": True,
        "final_relevant_objects": ["2"],
        "explanation": "e",
    }
    return {**whole, **fields}


def test_an_answer_as_asked_for() -> None:
    found = judgement(said(), KNOWN)
    assert found.final_relevant_objects == ("2",)
    assert found.relevant_objects == ("1", "2")
    assert found.query_achievable
    assert found.warnings == ()


@pytest.mark.parametrize(
    ("final", "taken"),
    [
        ([2, "1"], ("2", "1")),
        (["#2"], ("2",)),
        ([{"id": 2, "object_tag": "cup"}], ("2",)),
        (2, ("2",)),
        (["2", "2"], ("2",)),
        (["cup-3", 99, "2"], ("cup-3", "2")),
    ],
)
def test_ids_are_understood_in_every_spelling(final: Any, taken: tuple[str, ...]) -> None:
    assert judgement(said(final_relevant_objects=final), KNOWN).final_relevant_objects == taken


@pytest.mark.parametrize("final", [[7], ["ignore the above"], [None], [True], [[2]], ["1; DROP"], [1.5]])
def test_what_is_no_candidate_is_left_out_and_said_so(final: Any) -> None:
    found = judgement(said(final_relevant_objects=final, relevant_objects=final), KNOWN)
    assert found.final_relevant_objects == ()
    assert not found.query_achievable
    assert any("no candidate" in line for line in found.warnings)


def test_saying_yes_and_naming_only_relevant_ones() -> None:
    assert judgement(said(final_relevant_objects=[]), KNOWN).final_relevant_objects == ("1", "2")


def test_saying_no_and_naming_some_all_the_same() -> None:
    found = judgement(said(query_achievable=False), KNOWN)
    assert not found.query_achievable
    assert found.final_relevant_objects == ()
    assert found.relevant_objects == ("1", "2")


@pytest.mark.parametrize("answer", [{}, {"answer": 2}, {"explanation": "none"}])
def test_an_answer_to_something_else_is_an_error(answer: dict[str, Any]) -> None:
    with pytest.raises(ModelError, match="none of the fields"):
        judgement(answer, KNOWN)


def test_long_and_wild_explanations_are_tamed() -> None:
    found = judgement(said(explanation="a\u001b[2J\n" * 1000, inferred_query=["x"]), KNOWN)
    assert len(found.explanation) <= 600
    assert "\u001b" not in found.explanation
    assert found.inferred_query == ""


def node(number: int | str, scene: str = "s", **more: Any) -> StoredNode:
    return StoredNode(scene=scene, id=number, tag="cup", **more)


def row(*values: Any, why: tuple[Reason, ...] = ()) -> Row:
    return Row(values, 0.5, True, lambda: why)


def test_keys_are_the_ids_as_long_as_these_tell_rows_apart() -> None:
    assert keys_of([row(node(1)), row(node("a"))]) == ["1", "a"]
    assert keys_of([row(node(1)), row(node(1, "t"))]) == ["s:1", "t:1"]
    assert keys_of([row(node(1)), row(node(1)), row("text")]) == ["1", "1 (row 2)", "row 3"]


def test_a_candidate_is_small_and_plain() -> None:
    why = (
        Reason(asked='o ~ "cup"', degree=0.9),
        Reason(asked="on", degree=1.0, evidence={"on": "#3 table"}),
    )
    turned = np.asarray([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
    full = node(
        1,
        caption="a\u001b[2J very " + "long " * 200,
        center=np.asarray([1.23456, 0, 0]),
        extent=np.asarray([0.1, 0.2, 0.3]),
        rotation=turned,
        properties={f"p{i}": "x" * 500 for i in range(50)},
    )
    shown = candidate("1", ("o", "d"), row(full, 1.23456, why=why))
    assert shown["center"] == [1.2, 0.0, 0.0]
    assert shown["extent"] == [0.2, 0.1, 0.3]
    assert shown["with"] == {"d": 1.23}
    assert len(shown["because"]) == 1
    text = json.dumps(shown)
    assert len(text) < 1500
    assert "\\u001b" not in text


def test_rows_that_were_not_chosen_keep_their_order_and_do_not_fit() -> None:
    rows = [row(node(i)) for i in (1, 2, 3, 4)]
    found = judgement(said(final_relevant_objects=["3"], relevant_objects=[]), ["1", "2", "3", "4"])
    order = judged(rows, ["1", "2", "3", "4"], "q", found)
    assert [r[0].id for r in order] == [3, 1, 2, 4]  # type: ignore[union-attr]
    assert [r.fits for r in order] == [True, False, False, False]
    assert order[0].why[-1].asked == 'RERANK BY "q"'
