"""``cgdb ask`` as people and scripts use them."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest

from cgdb.cli.app import main
from tests import model_server as server
from tests.model_server import ModelServer

pytestmark = pytest.mark.usefixtures("no_model")

FLAT = Path(__file__).parents[1] / "cli" / "flat.json"


@pytest.fixture(scope="module")
def flat(tmp_path_factory: pytest.TempPathFactory) -> str:
    path = tmp_path_factory.mktemp("ask") / "flat.cgdb"
    assert main(["import", str(FLAT), "--into", str(path), "--no-encode", "--quiet"]) == 0
    return str(path)


def brain(body: dict[str, Any]) -> str:
    if isinstance(body["messages"][-1]["content"], list):
        return "A cat."
    found = server.candidates_in(body)
    if found:
        return str(server.judging([found[0]["id"]], explanation="It is the \u001b[2Jbest."))
    return "MATCH (o {tag: 'sofa'}) RETURN o"


def test_an_answer_for_people(flat: str, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]) -> None:
    with ModelServer(brain) as at:
        monkeypatch.setenv("CGDB_LLM_BASE_URL", at.url)
        assert main(["ask", flat, "Somewhere to sit"]) == 0
    out, err = capfd.readouterr()
    assert out.startswith("✓ It is the")
    assert "#1 sofa" in out
    assert 'MATCH (o {tag: "sofa"}) RETURN o LIMIT 50' in out
    assert "little, held to CGQL by grammar, re-ranked: 2 calls" in out
    assert "\u001b" not in out + err


def test_an_answer_for_programs(flat: str, capfd: pytest.CaptureFixture[str]) -> None:
    assert main(["ask", flat, "a sofa", "--no-model", "--format", "json", "--why"]) == 0
    record = json.loads(capfd.readouterr().out)
    assert record["how"] == "built-in"
    assert record["query_achievable"] is True
    assert 1 in record["final_relevant_objects"]
    assert record["rows"][0]["why"]
    assert main(["ask", flat, "a sofa", "--no-model", "--format", "csv"]) == 0
    assert capfd.readouterr().out.startswith("o,score,fits")


def test_a_talk_is_recorded_and_replayed(
    flat: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    file = str(tmp_path / "talk.jsonl")
    with ModelServer(brain) as at:
        monkeypatch.setenv("CGDB_LLM_BASE_URL", at.url)
        assert main(["ask", flat, "Somewhere to sit", "--record", file, "--format", "json"]) == 0
    first = json.loads(capfd.readouterr().out)
    monkeypatch.delenv("CGDB_LLM_BASE_URL")
    assert main(["ask", flat, "Somewhere to sit", "--replay", file, "--format", "json"]) == 0
    again = json.loads(capfd.readouterr().out)
    assert first["rows"] == again["rows"]
    assert first["explanation"] == again["explanation"]


@pytest.mark.parametrize(
    ("arguments", "code", "words"),
    [
        (["ask", "{flat}"], 2, "there is no question"),
        (["ask", "{flat}", "??"], 2, "says nothing"),
        (["ask", "{flat}", "x", "--scene", "flot"], 6, "did you mean 'flat'"),
        (["ask", "{flat}", "x", "--image", "{tmp}/none.jpg"], 2, "cannot be read"),
        (["ask", "{flat}", "x", "--replay", "{tmp}/none.jsonl"], 2, "cannot be read"),
        (["ask", "{flat}", "x", "--record", "{tmp}/r.jsonl"], 2, "no language model to record"),
        (["ask", "{flat}", "x", "--record", "a", "--replay", "b"], 2, "exclude each other"),
        (["ask", "{tmp}/none.cgdb", "x"], 6, "does not exist"),
    ],
)
def test_bad_input_is_one_clear_error(
    flat: str, tmp_path: Path, capfd: pytest.CaptureFixture[str], arguments: list[str], code: int, words: str
) -> None:
    assert main([a.format(flat=flat, tmp=tmp_path) for a in arguments]) == code
    out, err = capfd.readouterr()
    assert out == ""
    assert words in err
    assert "Traceback" not in err
