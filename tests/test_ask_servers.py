"""Servers that misbehave leave the built-in answer; what they said once can be replayed without them."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from cgdb.asking.answer import Answer
from cgdb.database import Database
from cgdb.model.llm_settings import Settings
from cgdb.model.recording import recording, replaying
from cgdb.testing import store
from tests import model_server as server
from tests.asked_kitchen import DEGREES, KITCHEN, QUESTION, RIGHT, brain, model
from tests.model_server import HTML, ModelServer, Said, error

pytestmark = pytest.mark.usefixtures("no_model")


@pytest.fixture
def db() -> Iterator[Database]:
    with store(KITCHEN, degrees=DEGREES) as opened:
        yield opened


# -- servers that misbehave ---------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("misbehaviour", "words"),
    [
        (HTML, "a web page"),
        (error(401, "no such key"), "refuses the key"),
        (error(404, "The model `little` does not exist"), "does not exist"),
        (error(429, "slow down"), "asked too often"),
        (error(503, "overloaded"), "overloaded"),
        (Said(text=""), "nothing, twice"),
        (Said(raw="{}"), "no message"),
        (Said(raw="Internal error"), "no JSON"),
        (Said(text="MATCH (o", finish="length"), "wrote no statement"),
        (Said(text=RIGHT, delay=3.0), "did not answer"),
        (Said(text=RIGHT, drop=True), "broke off"),
    ],
)
def test_a_server_that_fails_leaves_the_built_in_answer(db: Database, misbehaviour: Any, words: str) -> None:
    with ModelServer(lambda body: misbehaviour, kind="plain") as at:
        answer = db.ask(QUESTION, model=model(at, timeout=0.5, deadline=1.5))
        assert answer.how == "built-in"
        assert answer.rows
        assert any(words in line for line in answer.warnings), answer.warnings
        assert all("\n" not in line for line in answer.warnings)


def test_a_server_that_fails_at_re_ranking_leaves_the_order_of_the_map(db: Database) -> None:
    def think(body: dict[str, Any]) -> Any:
        return error(503, "overloaded") if server.candidates_in(body) else RIGHT

    with ModelServer(think, kind="plain") as at:
        answer = db.ask(QUESTION, model=model(at))
        assert (answer.how, answer.ids, answer.reranked) == ("text", (2, 8), False)
        assert any("could not re-rank" in line for line in answer.warnings)


# -- recordings ---------------------------------------------------------------------------------------------------


def test_a_recorded_question_is_replayed_without_a_server(db: Database, tmp_path: Path) -> None:
    file = tmp_path / "talk.jsonl"
    with ModelServer(brain(RIGHT, "8")) as at:
        first = db.ask(QUESTION, model=recording(Settings(base_url=at.url, backoff=0.01), file))
    again = db.ask(QUESTION, model=replaying(file))

    def told(answer: Answer) -> dict[str, Any]:
        record = answer.to_dict(why=True)
        del record["usage"]["seconds"]
        return record

    assert told(first) == told(again)
    other = db.ask("cushion", model=replaying(file))
    assert other.how == "built-in"
    assert any("no reply to this request" in line for line in other.warnings)
