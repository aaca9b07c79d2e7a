"""The command line as a person or a script uses it: what goes to stdout, what to stderr, and the exit codes."""

from __future__ import annotations

import csv
import io
import json
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

import cgdb
from cgdb.cli.app import _parser, main
from cgdb.scene import FeatureSpace, SceneGraph, SceneObject

ROOT = Path(__file__).parents[1]
FLAT = ROOT / "cli" / "flat.json"


@pytest.fixture(scope="module")
def store(tmp_path_factory: pytest.TempPathFactory) -> str:
    path = tmp_path_factory.mktemp("cli") / "flat.cgdb"
    assert main(["import", str(FLAT), "--into", str(path), "--no-encode", "--quiet"]) == 0
    return str(path)


def test_import_says_what_it_did_on_stderr(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    assert main(["import", str(FLAT), "--into", str(tmp_path / "a.cgdb"), "--no-encode"]) == 0
    out, err = capfd.readouterr()
    assert out == ""
    assert "90 objects, revision 1" in err


def test_importing_twice_asks_what_to_do(store: str, capfd: pytest.CaptureFixture[str]) -> None:
    assert main(["import", str(FLAT), "--into", store]) == 6
    assert "there is a scene 'flat' already" in capfd.readouterr().err
    assert main(["import", str(FLAT), "--into", store, "--on-existing", "replace", "--no-encode"]) == 0
    assert "nothing new" in capfd.readouterr().err


QUERY = "MATCH (o) WHERE o.tag = 'sofa' RETURN o.id AS id, o.caption AS caption"


def test_every_format_holds_the_same_rows(store: str, capfd: pytest.CaptureFixture[str]) -> None:
    def run(form: str) -> str:
        assert main(["query", store, QUERY, "--format", form]) == 0
        return capfd.readouterr().out

    (record,) = json.loads(run("json"))
    assert record["id"] == 1
    assert record["fits"] is True
    assert json.loads(run("jsonl")) == record
    (row,) = csv.DictReader(io.StringIO(run("csv")))
    assert row["caption"] == record["caption"]
    assert run("markdown").splitlines()[0] == "| id | caption | score | fits |"
    assert record["caption"][:30] in run("table")


def test_parameters_are_typed(store: str, capfd: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    assert (
        main(["query", store, "MATCH (o) WHERE o.id IN $ids RETURN o.id", "-p", "ids=[1,2]", "--format", "json"]) == 0
    )
    assert [row["o.id"] for row in json.loads(capfd.readouterr().out)] == [1, 2]
    assert main(["query", store, "MATCH (o {tag: $t}) RETURN o.id", "-p", "t=sofa", "--format", "json"]) == 0
    assert [row["o.id"] for row in json.loads(capfd.readouterr().out)] == [1]


def test_why_is_told_on_request(store: str, capfd: pytest.CaptureFixture[str]) -> None:
    assert main(["query", store, "MATCH (c)-[:on]->(s {tag: 'sofa'}) RETURN c LIMIT 1", "--why"]) == 0
    assert "on #1 sofa: 1.00 (origin human)" in capfd.readouterr().out


def test_export_to_stdout_is_the_planner_json(store: str, capfd: pytest.CaptureFixture[str]) -> None:
    assert main(["export", store, "--format", "planner"]) == 0
    records = json.loads(capfd.readouterr().out)
    assert list(records[0]) == ["id", "bbox_extent", "bbox_center", "object_tag", "caption"]


def test_info_log_diff_check(store: str, capfd: pytest.CaptureFixture[str]) -> None:
    assert main(["info", store, "--json"]) == 0
    assert json.loads(capfd.readouterr().out)["scenes"][0]["objects"] == 90
    assert main(["log", store, "--json"]) == 0
    assert json.loads(capfd.readouterr().out)[0]["kind"] == "import"
    assert main(["diff", store, "0", "1", "--json"]) == 0
    assert len(json.loads(capfd.readouterr().out)["flat"]["added"]) == 95
    assert main(["check", store]) == 0
    assert "sound" in capfd.readouterr().err


@pytest.mark.parametrize(
    ("arguments", "code", "words"),
    [
        (["query", "{store}", "MATCH (o) RETRN o"], 3, "RETURN"),
        (["query", "{store}", "MATCH (o)-[:ontop]->(p) RETURN o"], 3, "no relation 'ontop'"),
        (["query", "{store}", "MATCH (o) RETURN o.colour"], 3, "did you mean 'color'?"),
        (["query", "{store}", "MATCH (o ~ $x) RETURN o"], 3, "parameter $x was not given"),
        (["query", "{store}", "USE 'flot' MATCH (o) RETURN o"], 6, "did you mean 'flat'?"),
        (["query", "{store}", "MATCH (o) RETURN o", "-p", "x"], 2, "NAME=VALUE"),
        (["query", "{tmp}/none.cgdb", "MATCH (o) RETURN o"], 6, "does not exist"),
        (["query", "{flat}", "MATCH (o) RETURN o"], 6, "is a file, not a store"),
        (["import", "{tmp}/none.json", "--into", "{tmp}/new.cgdb"], 2, "does not exist"),
        (["import", "{tmp}/empty.json", "--into", "{tmp}/new.cgdb"], 5, "empty"),
        (["search", "{store}", "@{tmp}/none.npy"], 2, "cannot be read"),
        (["search", "{store}", "cup", "--space", "clip"], 3, "no feature space 'clip'"),
        (["export", "{store}", "flot"], 6, "did you mean 'flat'?"),
        (["export", "{store}", "--format", "grphml"], 5, "did you mean 'graphml'?"),
        (["quary", "{store}"], 2, "did you mean 'query'?"),
        (["query", "{store}", "MATCH (a), (b), (c), (d) RETURN a"], 4, "combinations"),
        (["ask", "{store}", "where", "is", "it"], 2, "quotes"),
        (["ask", "{store}", "the mug", "--sceen", "flat"], 2, "did you mean '--scene'?"),
        (["info", "{store}", "--format", "json"], 2, "cgdb info --help"),
        (["info", "{store}", "more"], 2, "cgdb info --help"),
        (["plot", "{store}", "MATCH (o) RETURN o"], 2, "cgdb plot --help"),
    ],
)
def test_bad_input_is_one_clear_error(
    store: str, tmp_path: Path, capfd: pytest.CaptureFixture[str], arguments: list[str], code: int, words: str
) -> None:
    (tmp_path / "empty.json").touch()
    filled = [a.format(store=store, tmp=tmp_path, flat=FLAT) for a in arguments]
    assert main(filled) == code
    out, err = capfd.readouterr()
    assert out == ""
    assert words in err
    assert "Traceback" not in err
    assert not (tmp_path / "new.cgdb").exists()


def test_the_last_word_may_follow_options(store: str, capfd: pytest.CaptureFixture[str]) -> None:
    assert main(["ask", store, "--no-model", "--scene", "flat", "--json", "where is the sofa?"]) == 0
    assert json.loads(capfd.readouterr().out)["question"] == "where is the sofa?"
    assert main(["export", store, "--format", "planner", "flat"]) == 0
    assert json.loads(capfd.readouterr().out)[0]["id"] == 1
    assert main(["export", store, "--format", "planner", "flot"]) == 6
    assert "did you mean 'flat'?" in capfd.readouterr().err


def test_json_is_a_format(store: str, capfd: pytest.CaptureFixture[str]) -> None:
    assert main(["query", store, "MATCH (o #1) RETURN o.id", "--json"]) == 0
    assert [row["o.id"] for row in json.loads(capfd.readouterr().out)] == [1]


WRITERS = {
    "export": ["export", "s.cgdb"],
    "plot": ["plot", "s.cgdb"],
    "views": ["views", "s.cgdb", "1"],
    "import": ["import", "a.json"],
    "map": ["map", "office"],
    "retrieval": ["eval", "retrieval", "--judgements", "j.json"],
    "demo": ["demo"],
}


@pytest.mark.parametrize("word", ["--into", "-o", "--output", "--save"])
@pytest.mark.parametrize("command", WRITERS)
def test_every_word_for_where_to_write_is_understood(command: str, word: str) -> None:
    for words in ([word, "there"], [f"{word}=there"]):
        options = _parser().parse_args([*WRITERS[command], *words])
        assert "there" in (getattr(options, name, None) for name in ("into", "output", "save"))


def test_the_store_of_the_demo_is_named_in_one_way(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    assert main(["demo", str(tmp_path), "--into", str(tmp_path)]) == 2
    assert "given twice" in capfd.readouterr().err
    assert main(["demo", "--into", str(tmp_path)]) == 0
    assert (tmp_path / "flat.cgdb").is_dir()


def test_doing_it_again_goes_by_the_words_of_other_commands() -> None:
    parser = _parser()
    for making in (["import", "a.json"], ["map", "office"]):
        assert parser.parse_args([*making, "--into", "s", "--replace"]).on_existing == "replace"
        assert parser.parse_args([*making, "--into", "s"]).on_existing == "error"
    for word in ("--again", "--replace"):
        assert parser.parse_args(["caption", "s", word]).again is True
        assert parser.parse_args(["tag", "s", "--vocabulary", "v.txt", word]).replace is True


def test_synonyms_shadow_no_abbreviation_and_no_plain_word() -> None:
    parser = _parser()
    assert parser.parse_args(["import", "a.json", "--into", "s", "--o", "merge"]).on_existing == "merge"
    assert parser.parse_args(["export", "s", "--", "--save"]).scene == "--save"


def test_a_near_name_is_told_without_all_the_others(capfd: pytest.CaptureFixture[str]) -> None:
    assert main(["qury"]) == 2
    assert capfd.readouterr().err.splitlines() == [
        "usage error: argument COMMAND: invalid choice: 'qury'",
        "hint: did you mean 'query'?",
    ]
    assert main(["zzz"]) == 2
    assert "(choose from 'demo'" in capfd.readouterr().err


def test_without_a_word_the_help_is_shown(capfd: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit) as end:
        main([])
    out, err = capfd.readouterr()
    assert (end.value.code, out) == (2, "")
    assert "cgdb demo" in err


def test_help_names_what_there_is() -> None:
    from cgdb.cli import making_options
    from cgdb.ingest.detections.files import KINDS
    from cgdb.ingest.frames.recording import LAYOUTS
    from cgdb.ingest.loading import FORMATS

    assert ", ".join(LAYOUTS) == making_options.LAYOUTS
    assert ", ".join(KINDS) == making_options.KINDS
    assert ", ".join(FORMATS) == making_options.FORMATS


def test_much_json_is_not_poured_into_a_terminal(
    store: str, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    from cgdb.cli import stores

    monkeypatch.setattr("sys.stdout.isatty", lambda: True)
    assert main(["export", store]) == 0
    written = len(capsys.readouterr().out)
    monkeypatch.setattr(stores, "TERMINAL", written // 2)
    assert main(["export", store]) == 2
    out, err = capsys.readouterr()
    assert out == ""
    assert "too much for a terminal" in err


def test_an_empty_store_says_so(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    import cgdb

    cgdb.open(tmp_path / "e.cgdb", create=True).close()
    assert main(["query", str(tmp_path / "e.cgdb"), "MATCH (o) RETURN o"]) == 6
    assert "holds no scenes" in capfd.readouterr().err
    assert main(["export", str(tmp_path / "e.cgdb")]) == 2
    assert "the store holds no scene" in capfd.readouterr().err


def test_a_missing_package_names_the_pip_line(store: str) -> None:
    code = (
        "import sys; sys.modules['tokenizers'] = None\n"
        f"from cgdb.cli.app import main; sys.exit(main(['query', {store!r}, 'MATCH (o ~ \"sofa\") RETURN o LIMIT 1']))"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert done.returncode == 0
    assert "pip install" in done.stderr
    assert "#1 sofa" in done.stdout


def test_a_closed_pipe_is_no_error(store: str) -> None:
    command = f"{sys.executable} -m cgdb.cli.app query {store} 'MATCH (o) RETURN o' --format jsonl | head -n 1"
    done = subprocess.run(command, shell=True, capture_output=True, text=True, check=True)
    assert done.stderr == ""
    assert len(done.stdout.splitlines()) == 1


def test_control_characters_of_a_map_do_not_reach_the_terminal(
    tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    evil = tmp_path / "evil.json"
    evil.write_text(json.dumps([{"id": 1, "tag": "cup\u001b[2J", "caption": "\u001b]0;owned\u0007 red\u202ecup"}]))
    store = str(tmp_path / "evil.cgdb")
    assert main(["import", str(evil), "--into", store, "--no-encode"]) == 0
    assert main(["query", store, "MATCH (o) RETURN o"]) == 0
    assert main(["info", store]) == 0
    text = "".join(capfd.readouterr())
    assert not {"\u001b", "\u0007", "\u202e"} & set(text)


def test_a_bug_is_one_line_too(store: str, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]) -> None:
    import cgdb.cli.asking

    def broken(options: object) -> int:
        raise ZeroDivisionError("a bug")

    monkeypatch.setattr(cgdb.cli.asking, "query", broken)
    monkeypatch.delenv("CGDB_DEBUG", raising=False)
    assert main(["query", store, "MATCH (o) RETURN o"]) == 70
    assert "internal error: ZeroDivisionError" in capfd.readouterr().err


def test_ctrl_c_while_importing_leaves_nothing(tmp_path: Path) -> None:
    import signal
    import time

    big = tmp_path / "big.jsonl"
    with big.open("w") as file:
        for i in range(60_000):
            file.write(
                json.dumps(
                    {
                        "id": i,
                        "tag": f"thing {i}",
                        "bbox_center": [i % 100, i // 100, 0],
                        "bbox_extent": [0.5, 0.5, 0.5],
                    }
                )
            )
            file.write("\n")
    store = tmp_path / "big.cgdb"
    process = subprocess.Popen(
        [sys.executable, "-m", "cgdb.cli.app", "import", str(big), "--into", str(store)],
        stderr=subprocess.PIPE,
        text=True,
        env={**os.environ, "PYTHONUNBUFFERED": "1"},
    )
    deadline = time.monotonic() + 20
    while not (store / "ledger.sqlite").exists() and time.monotonic() < deadline:
        time.sleep(0.02)
    time.sleep(0.3)
    process.send_signal(signal.SIGINT)
    _, err = process.communicate(timeout=30)
    assert process.returncode == 130, err
    assert "Traceback" not in err
    assert not store.exists()


def test_one_bad_map_of_several_does_not_keep_the_others_out(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    bad = tmp_path / "bad.json"
    bad.write_text("{", "utf-8")
    good = tmp_path / "good.json"
    good.write_text('[{"id": 1, "caption": "a cup"}]', "utf-8")
    store = tmp_path / "s.cgdb"
    assert main(["import", str(bad), str(good), "--into", str(store), "--no-encode"]) == 5
    told = capfd.readouterr().err
    assert "import error" in told and "bad.json" in told and "scene 'good', 1 objects" in told
    with cgdb.open(store, text_encoder=None) as db:
        assert [scene.name for scene in db.scenes()] == ["good"]
    assert main(["import", str(bad), str(bad), "--into", str(tmp_path / "none.cgdb")]) == 5
    assert not (tmp_path / "none.cgdb").exists()


def test_an_encoder_for_a_space_that_is_not_there_is_a_slip(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    store = tmp_path / "s.cgdb"
    with cgdb.open(store, create=True, text_encoder=None) as db:
        obj = SceneObject(id=1, tag="cup", features={"clip": np.ones(3, np.float32)})
        db.add(SceneGraph(name="a", objects=(obj,), spaces=(FeatureSpace(name="clip", dimension=3),)))
    vocabulary = tmp_path / "names.npz"
    np.savez(vocabulary, names=np.array(["cup"]), vectors=np.ones((1, 3), np.float32))
    for command in (["query", str(store), "MATCH (o) RETURN o"], ["search", str(store), "cup"]):
        assert main([*command, "--encoder", f"clap=vocabulary:{vocabulary}"]) == 2
        assert "did you mean 'clip'?" in capfd.readouterr().err


def test_a_pipe_that_nobody_reads_ends_quietly(tmp_path: Path) -> None:
    run = [sys.executable, "-c", "import sys; from cgdb.cli.app import main; sys.exit(main(['demo']))"]
    process = subprocess.Popen(run, stdout=subprocess.PIPE, stderr=subprocess.PIPE)
    assert process.stdout is not None and process.stderr is not None
    process.stdout.close()
    told = process.stderr.read().decode()
    assert process.wait(60) == 141
    assert "Traceback" not in told
    process.stderr.close()
