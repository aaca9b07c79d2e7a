"""``cgdb ask`` and ``cgdb eval retrieval`` as people and scripts use them."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest

from cgdb.cli.app import main
from cgdb.judged import JudgedQuery
from cgdb.retrieval import Outcome, scores, share
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
        (["eval", "retrieval", "--judgements", "{tmp}/none.json"], 2, "cannot be read"),
        (["eval", "retrieval", "--judgements", "{tmp}/bad.json"], 2, "is no JSON"),
        (["eval", "retrieval", "--judgements", "{tmp}/odd.json"], 2, "'query' must be a text"),
        (["eval", "retrieval", "--judgements", "{tmp}/good.json", "--ways", "magic"], 2, "no way 'magic'"),
        (["eval", "retrieval", "--judgements", "{tmp}/good.json", "--ways", "model"], 2, "none is configured"),
        (["eval", "retrieval", "--judgements", "{tmp}/lost.json"], 2, "none of the maps"),
        (["eval", "retrieval", "{flat_json}", "--judgements", "{tmp}/lost.json"], 2, "no queries"),
        (["eval", "retrieval", "--judgements", "{tmp}/good.json", "--save", "{tmp}/no/x"], 2, "no folder"),
    ],
)
def test_bad_input_is_one_clear_error(
    flat: str, tmp_path: Path, capfd: pytest.CaptureFixture[str], arguments: list[str], code: int, words: str
) -> None:
    query = {"id": "a", "kind": "k", "query": "a sofa", "relevant": {"1": 2}}
    (tmp_path / "map.json").write_text(FLAT.read_text())
    (tmp_path / "bad.json").write_text("{")
    (tmp_path / "odd.json").write_text(json.dumps({"map.json": [{**query, "query": 3}]}))
    (tmp_path / "good.json").write_text(json.dumps({"map.json": [query]}))
    (tmp_path / "lost.json").write_text(json.dumps({"nowhere.json": [query], "../map.json": []}))
    assert main([a.format(flat=flat, tmp=tmp_path, flat_json=FLAT) for a in arguments]) == code
    out, err = capfd.readouterr()
    assert out == ""
    assert words in err
    assert "Traceback" not in err


def test_an_evaluation_of_every_way(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "map.json").write_text(
        json.dumps([{"id": i, "object_tag": t, "caption": f"a {t}"} for i, t in enumerate(["sofa", "cup", "lamp"])])
    )
    queries = [
        {"id": "a", "kind": "descriptive", "query": "a sofa", "relevant": {"0": 2}},
        {"id": "b", "kind": "descriptive", "query": "a lamp", "relevant": {"2": 2, "1": 1}},
        {"id": "c", "kind": "affordance", "query": "a zebra", "relevant": {}},
    ]
    (tmp_path / "judged.json").write_text(json.dumps({"map.json": queries}))

    def thinks(body: dict[str, Any]) -> str:
        text = server.user_text(body)
        word = "zebra" if "zebra" in text else "sofa" if "sofa" in text.rpartition("Question")[2] else "lamp"
        found = server.candidates_in(body)
        if not found and "Question: " in text:
            return f'MATCH (o ~ "{word}") RETURN o'
        if not found:
            word = text.splitlines()[-1].rpartition(" ")[2]
            found = [{"id": str(o["id"]), "tag": o["object_tag"]} for o in json.loads(text.splitlines()[1])]
        chosen = [c["id"] for c in found if c.get("tag") == word]
        return str(server.judging(chosen, achievable=bool(chosen)))

    save = tmp_path / "all.jsonl"
    ways = "words,built-in,model,model+rerank,whole-map"
    with ModelServer(thinks) as at:
        monkeypatch.setenv("CGDB_LLM_BASE_URL", at.url)
        arguments = ["eval", "retrieval", "--judgements", str(tmp_path / "judged.json"), "--ways", ways]
        assert main([*arguments, "--save", str(save), "--format", "json"]) == 0
        table = {(line["way"], line["kind"]): line for line in json.loads(capfd.readouterr().out)}
        assert main([*arguments, "--save", str(save), "--quiet"]) == 0
        shown = capfd.readouterr().out
    for way in ways.split(","):
        assert table[way, "descriptive"]["n"] == 2
        assert table[way, "descriptive"]["R@1"] == 1.0, way
        assert table[way, "affordance"]["R@1"] is None
        assert table[way, "all"]["errors"] == 0, way
        assert way in shown
    assert table["model+rerank", "all"]["nothing fits, precision"] == 1.0
    assert table["model+rerank", "all"]["nothing fits, recall"] == 1.0
    assert table["whole-map", "all"]["calls, mean"] == 1.0
    assert table["model+rerank", "all"]["tokens, median"] > 300
    lines = [json.loads(line) for line in save.read_text().splitlines()]
    assert len(lines) == 15
    assert lines[-1]["map"] == "map.json"
    assert {line["way"] for line in lines} == set(ways.split(","))


def judged(name: str, relevant: dict[str, int], kind: str = "k") -> JudgedQuery:
    return JudgedQuery(id=name, kind=kind, query=name, relevant=relevant)


def test_scores_by_hand() -> None:
    results = [
        (judged("a", {"1": 2}), Outcome(ids=("1", "2"), achievable=True)),
        (judged("b", {"1": 2}), Outcome(ids=("3", "2", "1"), achievable=True)),
        (judged("c", {"1": 2}), Outcome(ids=("3",), achievable=False)),
        (judged("d", {"1": 1}), Outcome(ids=("1",), achievable=False)),
        (judged("e", {}), Outcome(ids=("1",), achievable=False)),
        (judged("f", {}), Outcome(ids=("1",), achievable=True)),
    ]
    (line,) = scores("w", results)
    assert line.mrr.n == 3
    assert [round(line.recall[k].mean, 4) for k in (1, 2, 3)] == [0.3333, 0.3333, 0.6667]
    assert round(line.mrr.mean, 4) == round((1 + 1 / 3 + 0) / 3, 4)
    assert line.nothing == (0.5, 0.5), "said of c and e, true of e and f; d counts for neither"
    assert line.n_nothing == 2


def test_the_interval_is_seeded_and_holds_the_mean() -> None:
    values = [1.0] * 70 + [0.0] * 30
    one, other = share(values), share(values)
    assert one == other
    assert one.low < one.mean == 0.7 < one.high
    # The normal approximation of a share of 0.7 in 100: 0.7 ± 1.96 · 0.0458.
    assert abs(one.low - 0.61) < 0.02
    assert abs(one.high - 0.79) < 0.02
