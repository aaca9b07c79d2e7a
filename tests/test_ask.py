"""Asking in plain words: what a question may be, what it follows up, and answers without a model."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

import cgdb
from cgdb.database import Database
from cgdb.errors import UsageError
from cgdb.testing import store
from tests.asked_kitchen import DEGREES, KITCHEN, QUESTION, RIGHT, brain, model, prompt
from tests.model_server import ModelServer

pytestmark = pytest.mark.usefixtures("no_model")


@pytest.fixture
def db() -> Iterator[Database]:
    with store(KITCHEN, degrees=DEGREES) as opened:
        yield opened


# -- questions ----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("question", ["", "   ", "???", "\n\t", "\u202e"])
def test_a_question_that_says_nothing_is_one_clear_error(db: Database, question: str) -> None:
    with pytest.raises(UsageError, match="says nothing"):
        db.ask(question, model=False)


def test_ten_thousand_words_are_cut_and_said_so(db: Database) -> None:
    answer = db.ask("drink " * 10_000, model=False)
    assert any("only the first 2,000" in line for line in answer.warnings)


def test_without_a_model_the_answer_is_built_in_and_costs_nothing(db: Database) -> None:
    answer = db.ask("cushion", model=False)
    assert (answer.how, answer.ids, answer.model) == ("built-in", (4,), None)
    assert answer.usage.calls == 0
    assert answer.warnings == ()
    assert answer.explanation.startswith("1 fits: #4 cushion")


def test_without_a_model_nothing_fits_says_what_is_lacking(db: Database) -> None:
    answer = db.ask("spaceship", model=False)
    assert not answer.achievable
    assert "nothing fits; the nearest is #4 cushion" in answer.explanation


def test_without_configuration_no_model_is_asked(db: Database) -> None:
    assert db.ask("cushion").how == "built-in"


def test_a_configured_model_is_asked(db: Database, monkeypatch: pytest.MonkeyPatch) -> None:
    with ModelServer(brain(RIGHT)) as at:
        monkeypatch.setenv("CGDB_LLM_BASE_URL", at.url)
        assert db.ask(QUESTION).how == "grammar"
        assert db.ask(QUESTION, model=False).how == "built-in"


def test_a_missing_package_leaves_the_built_in_answer(db: Database, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("CGDB_LLM_BASE_URL", "http://127.0.0.1:1/v1")
    monkeypatch.setitem(sys.modules, "openai", None)
    answer = db.ask("cushion")
    assert answer.ids == (4,)
    assert any("pip install 'cgdb[llm]'" in line for line in answer.warnings)


def test_a_question_about_the_past(db: Database) -> None:
    db.remove("kitchen")
    with ModelServer(brain('MATCH (o ~ "cushion") RETURN o')) as at:
        answer = db.ask("Where was the cushion?", model=model(at), as_of=1)
        assert answer.query.startswith("AS OF 1 MATCH")
        assert answer.ids == (4,)


# -- follow-ups ---------------------------------------------------------------------------------------------------


def test_a_follow_up_uses_the_last_answer(db: Database) -> None:
    before = db.ask("something to drink", model=False)
    assert set(before.ids) == {1, 2, 8}
    answer = db.ask("and which of these is nearest to the cushion?", model=False, previous=before)
    assert "IN $previous" in answer.query
    assert answer.ids[0] in {2, 8}
    fresh = db.ask("cushion", model=False, previous=before)
    assert "$previous" not in fresh.query


def test_a_model_is_told_of_the_last_answer(db: Database) -> None:
    follow = 'MATCH (o), (c ~ "cushion") WHERE o.id IN $previous RETURN o ORDER BY distance(o, c) LIMIT 1'
    before = db.ask("something to drink", model=False)
    with ModelServer(brain(follow)) as at:
        answer = db.ask("and the one nearest to the cushion?", model=model(at), previous=before, rerank=False)
        assert "$previous" in prompt(at.requests[0])
        assert '"something to drink"' in prompt(at.requests[0])
    assert answer.ids == (2,)
    assert answer.query.startswith('USE "kitchen"')


def test_a_scene_that_the_question_names_is_the_one_that_is_asked(tmp_path: Path) -> None:
    with cgdb.open(tmp_path / "two.cgdb", create=True, text_encoder=None) as db:
        for name, count in (("office2", 3), ("kitchen1", 1)):
            objects = tuple(cgdb.SceneObject(id=i, tag="chair", caption="a chair") for i in range(count))
            db.add(cgdb.SceneGraph(name=name, objects=objects))
        assert db.ask("how many chairs are in office2?", model=False).rows[0].values[0] == 3
        answer = db.ask("how many chairs are there in the kitchen1?", model=False)
        assert answer.rows[0].values[0] == 1
        assert answer.question == "how many chairs are there in the kitchen1?"
        assert any("kitchen1" in line for line in answer.warnings)
        assert db.ask("how many elephants are in office2?", model=False).explanation.startswith("0 elephants")
