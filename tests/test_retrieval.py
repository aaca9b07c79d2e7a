"""``cgdb eval retrieval``: each way on a map, what is counted, saved and gone on with, and what is refused."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from cgdb.cli.app import main
from cgdb.evaluation.judged import JudgedQuery
from cgdb.evaluation.retrieval import WAYS, Helpers, Outcome, asked
from cgdb.evaluation.scores import scores, share
from cgdb.scene import FeatureSpace, SceneGraph, SceneObject
from cgdb.testing import store
from tests import model_server as server
from tests.model_server import ModelServer

pytestmark = pytest.mark.usefixtures("no_model")

FLAT = Path(__file__).parents[1] / "cli" / "flat.json"
QUERIES = [
    {"id": "a", "kind": "descriptive", "query": "a sofa", "relevant": {"0": 2}},
    {"id": "b", "kind": "descriptive", "query": "a lamp", "relevant": {"2": 2, "1": 1}},
    {"id": "c", "kind": "affordance", "query": "a zebra", "relevant": {}},
]


def written(folder: Path, *maps: str) -> list[str]:
    """A map of a sofa, a cup and a lamp for each name, and the first words of a command that asks them."""
    things = [{"id": i, "object_tag": t, "caption": f"a {t}"} for i, t in enumerate(["sofa", "cup", "lamp"])]
    for name in maps:
        (folder / name).write_text(json.dumps(things))
    (folder / "judged.json").write_text(json.dumps(dict.fromkeys(maps, QUERIES)))
    return ["eval", "retrieval", "--judgements", str(folder / "judged.json"), "--save", str(folder / "all.jsonl")]


@pytest.mark.parametrize(
    ("arguments", "code", "words"),
    [
        (["eval", "retrieval", "--judgements", "{tmp}/none.json"], 2, "cannot be read"),
        (["eval", "retrieval", "--judgements", "{tmp}/bad.json"], 2, "is no JSON"),
        (["eval", "retrieval", "--judgements", "{tmp}/odd.json"], 2, "'query' must be a text"),
        (["eval", "retrieval", "--judgements", "{tmp}/good.json", "--ways", "magic"], 2, "no way 'magic'"),
        (["eval", "retrieval", "--judgements", "{tmp}/good.json", "--ways", "model"], 2, "none is configured"),
        (["eval", "retrieval", "--judgements", "{tmp}/lost.json"], 2, "none of the maps"),
        (["eval", "retrieval", "{flat_json}", "--judgements", "{tmp}/lost.json"], 2, "no queries"),
        (["eval", "retrieval", "--judgements", "{tmp}/good.json", "--save", "{tmp}/no/x"], 2, "no folder"),
        (
            ["eval", "retrieval", "--judgements", "{tmp}/good.json", "--save", "{tmp}/map.json/x"],
            2,
            "cannot be written",
        ),
        (["eval", "retrieval", "--judgements", "{tmp}/good.json", "--ways", "embedding+cross"], 2, "a cross-encoder"),
        (["eval", "retrieval", "--judgements", "{tmp}/good.json", "--save", "{tmp}/odd.json", "--resume"], 2, "line 1"),
    ],
)
def test_bad_input_is_one_clear_error(
    tmp_path: Path, capfd: pytest.CaptureFixture[str], arguments: list[str], code: int, words: str
) -> None:
    query = {"id": "a", "kind": "k", "query": "a sofa", "relevant": {"1": 2}}
    (tmp_path / "map.json").write_text(FLAT.read_text())
    (tmp_path / "bad.json").write_text("{")
    (tmp_path / "odd.json").write_text(json.dumps({"map.json": [{**query, "query": 3}]}) + "\n")
    (tmp_path / "good.json").write_text(json.dumps({"map.json": [query]}))
    (tmp_path / "lost.json").write_text(json.dumps({"nowhere.json": [query], "../map.json": []}))
    assert main([a.format(tmp=tmp_path, flat_json=FLAT) for a in arguments]) == code
    out, err = capfd.readouterr()
    assert out == ""
    assert words in err
    assert "Traceback" not in err


def test_what_failed_is_said_why(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    query = {"id": "a", "kind": "k", "query": "a sofa", "relevant": {"1": 2}}
    (tmp_path / "map.json").write_text(json.dumps([{"id": 1, "caption": "a sofa"}]))
    (tmp_path / "good.json").write_text(json.dumps({"map.json": [query]}))
    words = ["--judgements", str(tmp_path / "good.json"), "--save", str(tmp_path / "a.jsonl")]
    assert main(["eval", "retrieval", *words, "--ways", "words,clip", "--quiet", "--json"]) == 0
    out, err = capfd.readouterr()
    assert {line["way"] for line in json.loads(out)} == {"words", "clip"}
    assert err.count("note: ") == 1
    assert "note: clip: 1 of 1 queries failed; the first: " in err


def test_an_evaluation_of_every_way(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
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
        arguments = [*written(tmp_path, "map.json"), "--ways", ways]
        assert main([*arguments, "--json"]) == 0
        table = {(line["way"], line["kind"]): line for line in json.loads(capfd.readouterr().out)}
        assert main([*arguments, "--quiet", "--resume"]) == 0
        shown = capfd.readouterr().out
        first = next(body for body in at.requests if "the map of a place" in str(body["messages"][0]["content"]))
    for way in ways.split(","):
        assert table[way, "descriptive"]["n"] == 2
        assert table[way, "descriptive"]["R@1"] == 1.0, way
        assert table[way, "affordance"]["R@1"] is None
        assert table[way, "all"]["errors"] == 0, way
        assert way in shown
    assert max(map(len, shown.splitlines())) <= 80
    assert [message["role"] for message in first["messages"]] == ["system", "user", "assistant", "user"]
    shown_map = json.loads(str(first["messages"][1]["content"]).splitlines()[1])
    assert list(shown_map[0]) == ["id", "bbox_extent", "bbox_center", "object_tag", "caption"], "the paper's Listing 4"
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


def test_it_goes_on_where_it_was_stopped(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    arguments = [*written(tmp_path, "one.json", "two.json"), "--ways", "words", "--json", "--quiet"]
    file = tmp_path / "all.jsonl"
    assert main([*arguments, "--resume"]) == 0
    whole = json.loads(capfd.readouterr().out)
    lines = file.read_bytes().splitlines(keepends=True)
    assert len(lines) == 6
    # Killed in the middle of the fifth answer, after one had failed.
    failed = {**json.loads(lines[1]), "error": "the model is tired", "ids": []}
    file.write_bytes(b"".join([lines[0], json.dumps(failed).encode() + b"\n", *lines[2:4], lines[4][:40]]))
    assert main([*arguments, "--resume"]) == 0
    again = json.loads(capfd.readouterr().out)
    same = [{k: v for k, v in line.items() if "seconds" not in k} for line in again]
    assert same == [{k: v for k, v in line.items() if "seconds" not in k} for line in whole]
    after = file.read_bytes().splitlines(keepends=True)
    assert after[:1] == lines[:1]
    assert len(after) == 4 + 3
    assert main([*arguments, "--resume"]) == 0
    assert file.read_bytes().splitlines(keepends=True) == after, "nothing was asked again"
    assert main(arguments) == 0
    assert len(file.read_bytes().splitlines()) == 6, "without --resume it begins anew"


def test_one_table_over_all_maps_and_one_for_each(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    arguments = [*written(tmp_path, "one.json", "two.json"), "--ways", "words", "--quiet"]
    assert main([*arguments, "--per-map"]) == 0
    titles = [line for line in capfd.readouterr().out.splitlines() if line in ("one.json", "two.json", "all maps")]
    assert titles == ["one.json", "two.json", "all maps"]
    assert main([*arguments, "--per-map", "--json"]) == 0
    lines = json.loads(capfd.readouterr().out)
    counts = {(line["map"], line["kind"]): line["queries"] for line in lines}
    assert (counts["one.json", "all"], counts["all maps", "all"]) == (3, 6)
    assert main([*arguments, "--json"]) == 0
    assert {line["map"] for line in json.loads(capfd.readouterr().out)} == {"all maps"}


@pytest.mark.slow
def test_clip_alone_on_real_vectors(data: Path) -> None:
    """CLIP ViT-B/32: texts and the mean crops of 1203 classes; its R@1, R@3 are known from an exact search."""
    from cgdb.meaning.vocabulary import Vocabulary

    names = json.loads((data / "clip" / "lvis_names.json").read_text())
    crops = np.load(data / "clip" / "lvis_image_features.npy").astype(np.float32)
    objects = tuple(
        SceneObject(id=i, tag="thing", center=np.zeros(3), extent=np.ones(3), features={"clip": crops[i]})
        for i in range(len(names))
    )
    spaces = (FeatureSpace(name="clip", encoder=None, dimension=crops.shape[1]),)
    texts = Vocabulary("lvis", names, np.load(data / "clip" / "lvis_text_features.npy"))
    with store() as db:
        db.add(SceneGraph(name="lvis", objects=objects, spaces=spaces))
        db._encoders._spaces["clip"] = texts
        results = [(judged(name, {str(i): 2}), asked("clip", db, name, Helpers())) for i, name in enumerate(names)]
    (line,) = scores("clip", results)
    assert line.errors == 0
    assert {k: round(line.recall[k].mean, 4) for k in (1, 3)} == {1: 0.6143, 3: 0.7980}
    assert line.recall[1].low < 0.6143 < line.recall[1].high


def test_a_map_without_image_features_is_an_outcome_with_an_error() -> None:
    with store(SceneGraph(name="bare", objects=(SceneObject(id=1, tag="cup"),))) as db:
        assert "no image features" in str(asked("clip", db, "a cup", Helpers()).error)


@pytest.mark.parametrize("way", [way for way, kind in WAYS.items() if kind.needs_model or kind.needs_cross])
def test_a_way_says_what_it_lacks(way: str) -> None:
    with store(SceneGraph(name="bare", objects=(SceneObject(id=1, tag="cup"),))) as db:
        assert "this way" in str(asked(way, db, "a cup", Helpers()).error)
