"""What language models are told: every example and every piece of the language in it is right, and it is short."""

from __future__ import annotations

import json
import re
from pathlib import Path

import pytest

from cgdb.grammar.parser import parse
from cgdb.grammar.printer import to_text
from cgdb.index.catalog import STANDARD_RELATIONS
from cgdb.model.llm import estimated_tokens
from cgdb.model.prompts import planner_schema, reranking, reranking_schema
from cgdb.model.query_from_json import from_json
from cgdb.model.translation_prompt import EXAMPLES, LANGUAGE, LISTS, MOST_EXAMPLES, Surroundings, examples, translation
from cgdb.scene import Place, SceneGraph, SceneObject
from cgdb.testing import store

PIECES = re.findall(r"`([^`]+)`", LANGUAGE + LISTS)
HOUSE = SceneGraph(
    name="house",
    objects=(SceneObject(id=1, tag="cup", properties={"affordances": ("grabbable",)}), SceneObject(id=12, tag="bench")),
    places=(Place(id="r", kind="Room", name="study"),),
)


@pytest.mark.parametrize(("question", "statement"), EXAMPLES)
def test_every_example_is_answered(question: str, statement: str) -> None:
    assert to_text(parse(statement)) == statement, "it is written as we write it"
    with store(HOUSE, degrees={}) as db:
        db.query(statement)


def test_there_are_pieces_of_the_language() -> None:
    assert len(PIECES) > 10


@pytest.mark.parametrize("piece", PIECES)
def test_every_piece_of_the_language_is_answered(piece: str) -> None:
    names = sorted(set(re.findall(r"(?<![\w\"])([a-z])(?= ~| #|\)|,)", piece)))
    with store(HOUSE, degrees={}) as db:
        if re.match(r"\([a-z]?[ )#~]", piece) and " OR " not in piece:
            db.query(f"MATCH {piece} RETURN {names[0]}")
        else:
            nodes = ", ".join(f"({name})" for name in names or ["o"])
            db.query(f"MATCH {nodes} WHERE {piece} RETURN {(names or ['o'])[0]}")


def test_the_relations_of_the_examples_are_those_that_every_map_has() -> None:
    used = {
        label
        for _, text in EXAMPLES
        for pattern in parse(text).patterns
        for edge in pattern.edges
        for label in edge.labels
    }
    assert used <= set(STANDARD_RELATIONS) | {"contains"}


def test_no_example_is_a_judged_question(data: Path) -> None:
    judged = json.loads((data / "retrieval" / "judgements.json").read_text())
    words = {frozenset(re.findall(r"\w+", q["query"].lower())) for queries in judged.values() for q in queries}
    for question, _ in EXAMPLES:
        mine = frozenset(re.findall(r"\w+", question.lower()))
        assert all(len(mine & other) < 0.8 * len(mine | other) for other in words), question


@pytest.mark.parametrize(
    ("question", "part"),
    [
        ("Something to drink other than soda", "AND NOT o ~"),
        ("Shoes that you wouldn't wear to a wedding", "NOT o ~"),
        ("A toy for someone who dislikes balls", "NOT o ~"),
        ("How many chairs are in the kitchen?", "count(o)"),
        ("The tallest lamp", "ORDER BY"),
        ("This is a lamp next to the sofa.", "near|next_to"),
        ("What is between the sofa and the wall?", "distance(o, b) + distance(o, w)"),
        ("Something to use for fixing a bike", 'OR o ~ "'),
        ("Where can I sit?", 'OR o ~ "'),
    ],
)
def test_examples_are_like_the_question(question: str, part: str) -> None:
    chosen = examples(question)
    assert len(chosen) == MOST_EXAMPLES
    assert any(part in text for _, text in chosen), chosen


def test_rooms_are_only_spoken_of_where_the_map_has_them() -> None:
    asked = "How many lamps are in the study?"
    assert not any(":Room" in text for _, text in examples(asked))
    assert any(":Room" in text for _, text in examples(asked, ["Object", "Room"]))


def test_the_form_in_json_is_shown_by_an_example() -> None:
    with store(HOUSE) as db:
        around = Surroundings(catalog=db.view("house").catalog)
    text = str(translation("Which cups are there?", around, as_json=True)[1]["content"])
    line = text.splitlines()[text.splitlines().index("The first of them as JSON:") + 1]
    assert to_text(from_json(json.loads(line))) == examples("Which cups are there?")[0][1]


def test_what_stands_in_lists_is_told_where_there_are_some() -> None:
    with store(HOUSE) as db:
        catalog = db.view("house").catalog
    bare = str(translation("Something to open", Surroundings(catalog=catalog))[1]["content"])
    assert "CONTAINS" not in bare
    values = {"affordances": ["can_open\u001b", "x" * 500, *map(str, range(100))]}
    told = str(translation("Something to open", Surroundings(catalog=catalog, values=values))[1]["content"])
    assert '"can_open"' in told
    assert "x" * 50 not in told
    assert '"90"' not in told
    assert LISTS in told


def test_it_is_short() -> None:
    with store(HOUSE) as db:
        around = Surroundings(catalog=db.view("house").catalog, tags=["a thing"] * 30)
    assert estimated_tokens(translation("Something to drink other than soda", around)) < 1000
    assert estimated_tokens(reranking("Something to drink other than soda", [])) < 400


def test_a_reason_comes_before_what_it_is_for_and_the_paper_keeps_its_order() -> None:
    mine, theirs = (list(schema(["1"])["properties"]) for schema in (reranking_schema, planner_schema))
    assert sorted(mine) == sorted(theirs)
    assert mine.index("explanation") < mine.index("final_relevant_objects")
    assert theirs == [
        "inferred_query",
        "relevant_objects",
        "query_achievable",
        "final_relevant_objects",
        "explanation",
    ]
