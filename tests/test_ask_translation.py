"""A model writes the statement: in the three ways that servers can be held to CGQL, and whatever it says round it."""

from __future__ import annotations

import json
from collections.abc import Iterator

import pytest

from cgdb.database import Database
from cgdb.model.model_translate import short_grammar
from cgdb.model.query_json import to_json
from cgdb.testing import store
from tests.asked_kitchen import DEGREES, KITCHEN, QUESTION, RIGHT, brain, model
from tests.model_server import ModelServer, error

pytestmark = pytest.mark.usefixtures("no_model")


@pytest.fixture
def db() -> Iterator[Database]:
    with store(KITCHEN, degrees=DEGREES) as opened:
        yield opened


# -- three ways to CGQL, as the server can ------------------------------------------------------------------------


@pytest.mark.parametrize("kind", ["openai", "vllm", "sglang", "llamacpp"])
def test_a_server_with_grammars_is_held_to_the_grammar(db: Database, kind: str) -> None:
    with ModelServer(brain(RIGHT), kind=kind) as at:
        answer = db.ask(QUESTION, model=model(at))
        assert answer.how == "grammar"
        assert answer.query == f"{RIGHT} LIMIT 50"
        assert answer.ids == (2,)
        assert len(at.requests) == 2
        assert answer.usage.calls == 2
        assert answer.usage.prompt_tokens > 100
        assert answer.warnings == ()


def test_a_server_with_schemas_writes_the_tree(db: Database) -> None:
    from cgdb.grammar.parser import parse

    with ModelServer(brain(json.dumps(to_json(parse(RIGHT)))), kind="library") as at:
        answer = db.ask(QUESTION, model=model(at))
        assert (answer.how, answer.ids) == ("schema", (2,))
        assert answer.query == f"{RIGHT} LIMIT 50"
        assert at.requests[0]["response_format"]["json_schema"]["strict"] is True


def test_a_server_with_neither_writes_text(db: Database) -> None:
    with ModelServer(brain(RIGHT), kind="plain") as at:
        made = model(at)
        assert db.ask(QUESTION, model=made).how == "text"
        first = len(at.requests)
        assert db.ask(QUESTION, model=made).how == "text"
        assert len(at.requests) - first == 2, "what it refused is not tried again"


def test_a_server_that_heeds_nothing_is_read_all_the_same(db: Database) -> None:
    said = f"Sure! Here is your query:\n```cypher\n{RIGHT}\n```\nIt finds drinks."
    with ModelServer(brain(said), kind="deaf") as at:
        made = model(at)
        answer = db.ask(QUESTION, model=made)
        assert (answer.how, answer.ids) == ("text", (2,))
        assert "tool" not in made.abilities.cgql


def test_a_way_can_be_demanded(db: Database) -> None:
    with ModelServer(brain(RIGHT), kind="openai") as at:
        assert db.ask(QUESTION, model=model(at, way="text"), rerank=False).how == "text"
        assert set(at.requests[0]) == {"model", "messages", "temperature", "max_tokens"}


def test_the_grammar_that_is_sent_takes_what_the_whole_one_takes() -> None:
    import llguidance
    from lark import Lark

    assert not llguidance.LLMatcher.validate_grammar(llguidance.LLMatcher.grammar_from_lark(short_grammar()))
    parser = Lark(short_grammar(), parser="earley", lexer="dynamic")
    for text in (RIGHT, "MATCH (o) RETURN count(*)", "MATCH (a)-[:on]->(b) RETURN a ORDER BY a.x DESC LIMIT 3"):
        parser.parse(text)
    assert len(short_grammar()) < 6000


# -- what models say ----------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    "said",
    [
        f"```\n{RIGHT}\n```",
        f"```cgql\n{RIGHT}\n```",
        f"<think>They want a drink. MATCH (x) RETURN x? No.</think>\n{RIGHT}",
        f"They want a drink, so MATCH it is.</think>\n\n{RIGHT}",
        f"Here is the query: {RIGHT}",
        f"{RIGHT}\n\nThis finds all drinks but sodas.",
        f"{RIGHT};",
        f"First I thought of\n```\nMATCH (o) RETURN o\n```\nbut better is\n```\n{RIGHT}\n```",
        json.dumps({"query": RIGHT}),
        f"{RIGHT}\n```",
        f"EXPLAIN {RIGHT}",
        f'{RIGHT} RERANK BY "drink" TOP 3',
    ],
)
def test_the_statement_is_found_in_what_stands_round_it(db: Database, said: str) -> None:
    with ModelServer(brain(said), kind="plain") as at:
        answer = db.ask(QUESTION, model=model(at), rerank=False)
        assert (answer.query, answer.how, answer.ids) == (f"{RIGHT} LIMIT 50", "text", (2, 8))


@pytest.mark.parametrize(
    ("wrong", "shown"),
    [
        ("MATCH (o ~ 'drink' RETURN o", "^"),
        ("SELECT * FROM objects", "no statement"),
        ("MATCH (o)-[:ontop]->(t) RETURN o", "no relation 'ontop'"),
        ("MATCH (o) RETURN o.colour_of_it", "colour_of_it"),
        ("MATCH (o #99) RETURN o", "#99"),
        ("USE 'kitchn' MATCH (o) RETURN o", "did you mean 'kitchen'"),
        ("AS OF 99 MATCH (o) RETURN o", "99"),
        ("MATCH (o ~ $wish) RETURN o", "$wish was not given"),
        ("<think>I think and think and never", "no statement"),
    ],
)
def test_a_wrong_statement_is_repaired_with_our_error(db: Database, wrong: str, shown: str) -> None:
    with ModelServer(brain(RIGHT), kind="plain", script=[error(400, "?"), error(400, "?"), wrong]) as at:
        answer = db.ask(QUESTION, model=model(at), rerank=False)
        assert answer.ids == (2, 8)
        repair = at.requests[-1]["messages"]
        assert repair[-2]["role"] == "assistant"
        assert shown in repair[-1]["content"]


def test_after_two_repairs_the_built_in_translator_answers_and_says_so(db: Database) -> None:
    with ModelServer("I am a pirate, arr!", kind="plain") as at:
        answer = db.ask("Something to drink that is no soda", model=model(at), rerank=False)
        assert answer.how == "built-in"
        assert any("answered without the model" in line for line in answer.warnings)
        assert answer.usage.calls == 5
        assert len(at.requests) == 5, "two refused ways, one answer, two repairs"
        assert answer.model == "little"


def test_a_relation_the_wrong_way_round_is_turned_and_said_so(db: Database) -> None:
    turned = 'MATCH (t ~ "table")-[:on]->(o ~ "drink") RETURN o'
    with ModelServer(brain(turned), kind="plain") as at:
        answer = db.ask("What is there to drink on the table?", model=model(at), rerank=False)
        assert set(answer.ids) == {1, 2}
        assert "<-[:on]-" in answer.query
        assert any("other way round" in line for line in answer.warnings)


def test_what_must_not_be_is_never_turned_round(db: Database) -> None:
    statement = 'MATCH (o ~ "spaceship") WHERE NOT (o)<-[:on]-(~ "table") RETURN o'
    with ModelServer(brain(statement), kind="plain") as at:
        answer = db.ask("A spaceship that is not on a table", model=model(at), rerank=False)
        assert not answer.achievable
        assert not any("other way" in line for line in answer.warnings)


def test_text_of_the_model_can_only_read(db: Database) -> None:
    before = db.scenes()
    with ModelServer("MATCH (o) DETACH DELETE o", kind="plain") as at:
        db.ask("Delete everything", model=model(at), rerank=False)
    assert db.scenes() == before
