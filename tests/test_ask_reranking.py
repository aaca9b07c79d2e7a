"""A model reads the best rows once more, for a question and for RERANK BY."""

from __future__ import annotations

import json
from collections.abc import Iterator

import pytest

from cgdb.database import Database
from cgdb.errors import ExecuteError
from cgdb.testing import store
from tests import model_server as server
from tests.asked_kitchen import DEGREES, KITCHEN, QUESTION, RIGHT, brain, model
from tests.model_server import ModelServer

pytestmark = pytest.mark.usefixtures("no_model")


@pytest.fixture
def db() -> Iterator[Database]:
    with store(KITCHEN, degrees=DEGREES) as opened:
        yield opened


# -- re-ranking ---------------------------------------------------------------------------------------------------


def test_the_answer_has_the_fields_of_the_planner(db: Database) -> None:
    with ModelServer(brain(RIGHT, "8", "2", explanation="Water is healthiest.")) as at:
        answer = db.ask(QUESTION, model=model(at))
        record = json.loads(json.dumps(answer.to_dict(why=True)))
        assert record["final_relevant_objects"] == [8, 2]
        assert record["query_achievable"] is True
        assert record["inferred_query"] == "what is wanted"
        assert record["explanation"] == "Water is healthiest."
        assert record["usage"]["calls"] == 2
        assert answer.rows[0].why[-1].evidence == {"by": "little", "said": "Water is healthiest."}
        assert not answer.rows[2].fits


def test_nothing_fits_is_an_answer(db: Database) -> None:
    said = brain('MATCH (o ~ "spaceship") RETURN o', achievable=False, explanation="The cushion cannot fly.")
    with ModelServer(said) as at:
        answer = db.ask("A spaceship", model=model(at))
        assert not answer.achievable
        assert answer.ids == ()
        assert answer.explanation == "The cushion cannot fly."
        assert answer.rows, "the nearest are shown"
        assert not any(row.fits for row in answer.rows)


def test_a_statement_that_is_too_strict_does_not_hide_the_answer(db: Database) -> None:
    strict = 'MATCH (o ~ "drink") WHERE (o)-[:in]->(~ "table") RETURN o'
    with ModelServer(brain(strict, "8")) as at:
        answer = db.ask("Something to drink", model=model(at))
        assert answer.ids == (8,)
        assert any("too strict" in line for line in answer.warnings)


@pytest.mark.parametrize(
    "statement",
    [
        'MATCH (o ~ "cushion") RETURN o',
        'MATCH (o ~ "soda") RETURN o LIMIT 1',
        'MATCH (o ~ "soda") RETURN o.tag, o.caption ORDER BY score(o) DESC LIMIT 1',
        'MATCH (o ~ "soda") RETURN o.tag, score(o) AS s ORDER BY s DESC LIMIT 1',
        'MATCH (o ~ "soda")-[:on]->(t ~ "table") RETURN o, t',
        'MATCH (o ~ "soda") WHERE o.tag = "cola" RETURN o',
    ],
)
def test_a_statement_that_hides_the_answer_does_not_hide_it_from_the_model(db: Database, statement: str) -> None:
    with ModelServer(brain(statement, "8")) as at:
        answer = db.ask(QUESTION, model=model(at))
        assert "8" in [one["id"] for one in server.candidates_in(at.requests[-1])]
        assert (answer.ids, answer.achievable) == ((8,), True)
        assert answer.query.startswith(statement.partition(" RETURN")[0])


def test_the_number_that_was_asked_for_is_kept_after_re_ranking(db: Database) -> None:
    with ModelServer(brain('MATCH (o ~ "drink") RETURN o LIMIT 2', "8", "2", "1")) as at:
        answer = db.ask("Two things to drink", model=model(at))
        assert [one["id"] for one in server.candidates_in(at.requests[-1])][:3] == ["1", "2", "8"]
        assert answer.ids == (8, 2)
        assert answer.query == 'MATCH (o ~ "drink") RETURN o LIMIT 2'
        assert len(db.ask("Two things to drink", model=model(at), rerank=False)) == 2


def test_what_was_measured_is_not_re_ranked(db: Database) -> None:
    nearest = 'MATCH (o ~ "drink"), (c ~ "cushion") RETURN o ORDER BY distance(o, c) LIMIT 1'
    with ModelServer(brain(nearest, "1")) as at:
        answer = db.ask("The drink nearest to the cushion", model=model(at))
        assert (answer.ids, answer.reranked, len(at.requests)) == ((2,), False, 1)


def test_a_total_is_not_re_ranked(db: Database) -> None:
    with ModelServer(brain('MATCH (o ~ "drink") RETURN count(o) AS n')) as at:
        answer = db.ask("How many drinks are there?", model=model(at))
        assert len(at.requests) == 1
        assert answer.rows[0].values == (3,)
        assert answer.explanation == "n is 3"


# -- RERANK BY ----------------------------------------------------------------------------------------------------


def test_rerank_by_asks_the_configured_model(db: Database, monkeypatch: pytest.MonkeyPatch) -> None:
    statement = 'MATCH (o ~ "drink") RETURN o RERANK BY "the healthiest" TOP 3 LIMIT 2'
    with pytest.raises(ExecuteError, match="none is configured"):
        db.query(statement)
    with ModelServer(brain("", "8", explanation="Water.")) as at:
        monkeypatch.setenv("CGDB_LLM_BASE_URL", at.url)
        result = db.query(statement)
        assert [row[0].id for row in result] == [8, 1]  # type: ignore[union-attr]
        assert [row.fits for row in result] == [True, False]
        assert result[0].why[-1].evidence == {"by": "little", "said": "Water."}
        assert "rerank" in result.timings
        shown = server.candidates_in(at.requests[0])
        assert [c["id"] for c in shown] == ["1", "2", "8"]
        assert result.usage is not None
        assert (result.usage.calls, result.usage.prompt_tokens > 100) == (1, True)
        assert 'rerank: the best 3 by "the healthiest"' in db.query("EXPLAIN " + statement).plan
        assert len(at.requests) == 1
        plan = db.query("PROFILE " + statement).plan
        assert "1 call, " in plan
        assert "tokens" in plan
