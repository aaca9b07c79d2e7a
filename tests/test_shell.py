"""The shell from scripts: -c, -f, stdin, commands, modes, exit codes; and what of it needs no terminal."""

from __future__ import annotations

import csv
import io
import json
import signal
import threading
from collections.abc import Callable
from pathlib import Path

import pytest

import cgdb
from cgdb import ingest
from cgdb.cli import app, commands, script, tables
from cgdb.cli.favourites import Favourite, Favourites
from cgdb.cli.highlight import lines, pieces
from cgdb.cli.opening import LEDGER, Opening
from cgdb.cli.screen import Screen
from cgdb.cli.session import Session, Use, quoted
from cgdb.cli.settings import OPTIONS, Settings, folder
from cgdb.cli.themes import THEMES
from cgdb.errors import BindError, CgdbError, QueryCancelled, UsageError
from cgdb.grammar.parser import parse
from cgdb.scene import SceneGraph, SceneObject

FLAT = Path(__file__).parents[1] / "cli" / "flat.json"
HOSTILE = "\x1b]0;owned\x07\x1b[31mred\x9b2J\r\nsecond\u202eline\x00"
SOFA = "MATCH (o) WHERE o.tag = 'sofa' RETURN o.id AS id"

Run = Callable[..., tuple[int, str, str]]


@pytest.fixture(scope="module")
def store(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("shell") / "flat.cgdb"
    with cgdb.open(path, create=True, text_encoder=None) as db:
        db.add(ingest.load(FLAT))
        db.add(SceneGraph(name="lab 2", objects=(SceneObject(id=1, tag="robot", caption="a robot"),)))
    return path


@pytest.fixture(autouse=True)
def home(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv("XDG_CONFIG_HOME", str(tmp_path / "config"))
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path / "state"))
    return tmp_path


@pytest.fixture
def run(store: Path, capfd: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch) -> Run:
    """Run a script by -c; (exit code, stdout, stderr)."""

    def call(*texts: str, options: tuple[str, ...] = (), stdin: str | None = None) -> tuple[int, str, str]:
        if stdin is not None:
            monkeypatch.setattr("sys.stdin", io.StringIO(stdin))
        given = [word for text in texts for word in ("-c", text)]
        code = app.main([str(store), *options, *given])
        out, err = capfd.readouterr()
        return code, out, err

    return call


# -- calling it --------------------------------------------------------------------------------------------------


def test_a_folder_that_is_called_as_a_command_is_not_meant(
    home: Path, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    (home / "info").mkdir()
    (home / "other").mkdir()
    monkeypatch.chdir(home)
    assert app.main(["info"]) == 2
    assert "required: STORE" in capfd.readouterr().err
    assert app.main(["other", "-c", SOFA]) == 6
    assert app.main(["nowhere"]) == 2
    assert "invalid choice: 'nowhere'" in capfd.readouterr().err


def test_three_ways_to_give_a_script(run: Run, home: Path) -> None:
    file = home / "a.cgql"
    file.write_text(SOFA)
    expected = "id\n──\n 1\n"
    assert run(SOFA) == (0, expected, "")
    assert run(options=("-f", str(file))) == (0, expected, "")
    assert run(stdin=SOFA + ";\n") == (0, expected, "")
    assert run(SOFA, options=("-f", str(file))) == (0, expected * 2, "")


def test_statements_and_commands_of_a_script(run: Run) -> None:
    code, out, err = run(f":mode jsonl\n{SOFA}; // a ; in a comment\nMATCH (o) WHERE o.tag = 'a;b' RETURN o; {SOFA}")
    assert (code, err) == (0, "")
    assert [json.loads(line)["id"] for line in out.splitlines()] == [1, 1]


def test_errors_say_where_and_do_not_stop_a_script_without_bail(run: Run, home: Path) -> None:
    bad = f"{SOFA};\n\nMATCH (o) RETRN o;\n:shwo #1\n{SOFA}"
    code, out, err = run(bad)
    assert code == 3
    assert out.count(" 1\n") == 2
    assert "line 3: syntax error: found 'RETRN'" in err
    assert "line 4: usage error: there is no command ':shwo'" in err
    assert "did you mean ':show'?" in err
    code, out, err = run(bad, options=("--bail",))
    assert (code, out.count(" 1\n")) == (3, 1)
    (home / "bad.cgql").write_text(bad)
    assert f"{home}/bad.cgql:3: syntax error" in run(options=("-f", str(home / "bad.cgql")))[2]


@pytest.mark.parametrize(
    ("arguments", "code", "says"),
    [
        (["shell", "/nowhere.cgdb", "-c", "x"], 6, "does not exist"),
        (["shell", str(FLAT), "-c", "x"], 6, f"`cgdb import {FLAT} --into home.cgdb`"),
        (["shell", str(FLAT.parent), "-c", ""], 6, "there is no ledger in it"),
        (["shell", str(FLAT.parent), "-c", SOFA], 6, "there is no ledger in it"),
        (["shell", "{store}", "-p", "1=2", "-c", SOFA], 2, "-p takes NAME=VALUE"),
    ],
)
def test_what_cannot_be_opened(
    store: Path, arguments: list[str], code: int, says: str, capfd: pytest.CaptureFixture[str]
) -> None:
    from cgdb.storage.ledger import FILE

    assert LEDGER == FILE
    assert app.main([str(store) if word == "{store}" else word for word in arguments]) == code
    out, err = capfd.readouterr()
    assert out == ""
    assert says in err
    assert "Traceback" not in err


def test_a_file_that_is_missing_or_no_text(run: Run, home: Path) -> None:
    assert run(options=("-f", str(home / "none"))) == (
        2,
        "",
        f"usage error: {home}/none cannot be read: No such file or directory\n",
    )
    (home / "binary").write_bytes(b"\xff\xfe\x00")
    assert "is not UTF-8 text" in run(options=("-f", str(home / "binary")))[2]


def test_quit_ends_a_script(run: Run) -> None:
    assert run(":quit\nnonsense", "nonsense") == (0, "", "")


def test_parameters_of_the_call_and_of_the_script(run: Run) -> None:
    count = "MATCH (o) WHERE o.tag = $what RETURN count(*) AS n"
    assert run(":mode csv", count, options=("-p", "what=sofa"))[1].splitlines()[1].startswith("1,")
    assert run(":mode csv\n:set what cushion\n" + count)[1].splitlines()[1].startswith("2,")
    assert run(":mode csv\n:set $rows sofa\nMATCH (o) WHERE o.tag = $rows RETURN count(*) AS n")[0] == 0
    listed = run(":use flat\n:set ids [1, 2]\n:mode csv\nMATCH (o) WHERE o.id IN $ids RETURN o.id ORDER BY o.id")[1]
    assert listed.splitlines()[1:] == ["1,1.0,True", "2,1.0,True"]


# -- modes ---------------------------------------------------------------------------------------------------------


def test_every_mode_holds_the_same(run: Run) -> None:
    statement = "MATCH (o #1)-[r:on|near]->(b) RETURN o, r, b.tag AS tag ORDER BY b.tag LIMIT 2"

    def mode(name: str) -> str:
        code, out, err = run(statement, options=("--mode", name))
        assert (code, err) == (0, "")
        return out

    rows = json.loads(mode("json"))
    assert [json.loads(line) for line in mode("jsonl").splitlines()] == rows
    assert [row["tag"] for row in csv.DictReader(io.StringIO(mode("csv")))] == [row["tag"] for row in rows]
    assert mode("markdown").splitlines()[0] == "| o | r | tag | score | fits |"
    tree = mode("tree")
    assert f"└─ tag: {rows[0]['tag']}" in tree
    assert "├─ r\n│  ├─ scene: flat" in tree
    assert rows[0]["tag"] in mode("table")
    assert run(statement, options=("--mode", "tabel"))[0] == 2


def test_a_table_that_goes_elsewhere_is_whole_and_plain(run: Run) -> None:
    out = run("MATCH (o) RETURN o.id, o.caption ORDER BY id(o)")[1].splitlines()
    assert len(out) == 2 + 91
    assert "\x1b" not in "".join(out)
    assert "…" not in "".join(out)


def test_nothing_fits_is_said_on_stderr(run: Run) -> None:
    code, out, err = run("MATCH (o) WHERE o.tag = 'unicorn' RETURN o")
    assert (code, out, err.strip().partition(" · ")[0]) == (0, "", "no rows")


# -- commands ------------------------------------------------------------------------------------------------------


def test_show_has_the_record_relations_and_places(run: Run) -> None:
    out = run(":use flat\n:show #19")[1]
    assert "#19 mug  Object of flat" in out
    assert "in           living room (#901 Room)" in out
    assert "─on→       #17 side table" in out
    assert "material     ceramic" in out
    record = json.loads(run(":use flat\n:mode json\n:show 19")[1])[0]
    assert record["tag"] == "mug"
    assert {r["label"] for r in record["relations"]} >= {"on", "contains"}


def test_an_id_in_several_scenes(run: Run) -> None:
    code, _, err = run(":show #1")
    assert code == 2
    assert "#1 is in several scenes: 'flat', 'lab 2'" in err
    assert run(':use "lab 2"\n:show #1')[1].startswith("#1 robot  Object of lab 2")
    assert "there is no object or place #777" in run(":show #777")[2]


def test_near_is_nearest_first_and_not_itself(run: Run) -> None:
    out = run(":use flat\n:near #19 .5")[1].splitlines()
    assert [line.split("  ")[0] for line in out[2:]] == ["#17 side table", "#18 table lamp", "#1 sofa", "#3 cushion"]
    assert run(":near #19 far")[0] == 2


def test_schema_and_scenes(run: Run) -> None:
    out = run(":schema")[1]
    assert "Room→Object" in out
    assert "material" in out
    assert "wall, ceiling" in out
    assert "lab 2" in run(":scenes")[1]


def test_use_applies_to_statements_without_their_own(run: Run) -> None:
    count = "MATCH (o) RETURN count(*) AS n"

    def counted(text: str) -> int:
        code, out, err = run(":mode jsonl\n" + text)
        assert (code, err) == (0, "")
        return int(json.loads(out.splitlines()[-1])["n"])

    assert counted(f':use "lab 2"\n{count}') == 1
    assert counted(f':use "lab 2"\nUSE "flat" {count}') == 90
    assert counted(f':use "lab 2"\n:use\n{count}') == 91
    assert counted(f":use flat AS OF 1\n{count}") == 90
    assert counted(f":use AS OF 1\n// first\n{count}") == 90
    assert "did you mean 'flat'?" in run(":use flta")[2]


def test_errors_keep_their_place_when_a_scene_is_in_use(store: Path) -> None:
    session = Session(Opening(store))
    session.use = Use(scenes=("flat",), as_of=1)
    for text in ("  MATCH (o) WHERE o.colr = 3 RETURN o", "USE 'flat' MATCH (o) WHERE o.colr = 3 RETURN o"):
        with pytest.raises(BindError) as caught:
            session.ask(text)
        assert caught.value.span is not None
        assert caught.value.source == text
        assert text[caught.value.span.start : caught.value.span.end] == "o.colr"
        with pytest.raises(BindError) as caught:
            session.ask(text, mode="EXPLAIN")
        assert caught.value.span is not None
        assert text[caught.value.span.start : caught.value.span.end] == "o.colr"
    result = session.ask("MATCH (o) WHERE o.tag = 'sofa' RETURN o").result
    assert result.query == 'MATCH (o) WHERE o.tag = "sofa" RETURN o'
    session.opening.close()


def test_why_explain_and_records(run: Run) -> None:
    out = run(f"{SOFA}\n;:why 1\n:explain\n:profile\n:x 1")[1]
    assert "1.00 ✓  o.tag = " in out
    assert "1. graph: " in out
    assert "rows, " in out
    assert "── 1 of 1 " in out
    assert run(f"{SOFA}\n;:why 2")[2].splitlines() == [
        "line 2: usage error: '2' is no row of the last result",
        "hint: its rows are 1 to 1",
    ]
    assert run(":why")[0] == 2


def test_map_marks_the_result(run: Run) -> None:
    code, out, err = run(":use flat\nMATCH (o) WHERE o.tag = 'mug' RETURN o.id;\n:map")
    assert (code, err) == (0, "")
    plan = out[out.index("┌─") :]
    assert "living room" in plan
    assert plan.count("mug") == 2  # in its place and in the legend
    assert "1 mug" in plan.splitlines()[-1]
    assert "has no positions to draw" in run(':map "lab 2"')[2]
    assert "say which" in run(":map")[2]


def test_plot_draws_a_picture(run: Run, home: Path, store: Path, capfd: pytest.CaptureFixture[str]) -> None:
    pytest.importorskip("matplotlib")
    target = home / "plan.png"
    assert run(f":use flat\nMATCH (o) WHERE o.tag = 'mug' RETURN o;\n:plot {target}")[0] == 0
    assert target.read_bytes().startswith(b"\x89PNG")
    svg = home / "plan.svg"
    assert app.main(["plot", str(store), "-o", str(svg), "--scene", "lab 2", "MATCH (o #19) RETURN o"]) == 2
    assert "has no positions to draw" in capfd.readouterr().err
    assert app.main(["plot", str(store), "-o", str(svg), 'USE "flat" MATCH (o #19) RETURN o']) == 0
    assert "1 of the result marked" in capfd.readouterr().err
    assert svg.stat().st_size > 1000
    assert app.main(["plot", str(store), "-o", str(home / "plan.doc")]) == 2
    assert "a picture's name ends with" in capfd.readouterr().err


def test_plot_without_matplotlib(
    run: Run, home: Path, store: Path, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setitem(__import__("sys").modules, "matplotlib.figure", None)
    assert app.main(["plot", str(store), "-o", str(home / "plan.png")]) == 9
    assert "pip install 'cgdb[plot]'" in capfd.readouterr().err


def test_export_and_cypher(run: Run, home: Path) -> None:
    assert run(f":export {home}/o.json")[0] == 2
    assert run(f":export {home}/o.json flat planner")[0] == 0
    assert json.loads((home / "o.json").read_text())
    code, out, _ = run(
        ":use flat\n:cypher MATCH (a:Node {tag: 'mug'})-[r:Rel]->(b:Node) RETURN a, r.label AS how, b.tag"
    )
    assert code == 0
    assert "#19 mug  on   side table" in out
    code, _, err = run(":use flat\n:cypher MATCH (a:Node) DELETE a")
    assert code == 4
    assert "read" in err


def test_favourites_keep_their_parameters(run: Run, home: Path) -> None:
    find = "MATCH (o) WHERE o.tag = $what RETURN o.id"
    assert run(f":set what mug\n{find};\n:save find")[0] == 0
    assert "  19" in run(":run find")[1]
    assert "   1" in run(":run find what=sofa")[1]
    assert "'find' has no parameter $waht" in run(":run find waht=sofa")[2]
    assert "did you mean 'find'?" in run(":run fnid")[2]
    assert "find  MATCH (o)" in run(":run")[1]
    assert json.loads((home / "config" / "cgdb" / "favourites.json").read_text())["find"]["parameters"] == {
        "what": "mug"
    }
    assert run(":forget find")[0] == 0
    assert run(":run find")[0] == 2


def test_favourites_file_that_is_damaged(home: Path) -> None:
    kept = Favourites(home / "f.json")
    kept.save("a", Favourite(text="x", parameters={"v": [1.0, 2.0]}))
    assert kept.get("a").parameters == {"v": [1.0, 2.0]}
    for text in ("[]", "{", '{"a": 3}', "[" * 100_000):
        kept.path.write_text(text)
        with pytest.raises(UsageError):
            kept.get("b") if text != "[]" else kept.all()


def test_read_runs_a_file_and_not_itself(run: Run, home: Path) -> None:
    (home / "a.cgql").write_text(f":set mode jsonl\n{SOFA};\n")
    assert json.loads(run(f":read {home}/a.cgql")[1])["id"] == 1
    (home / "b.cgql").write_text(f":read {home}/b.cgql\n")
    code, _, err = run(f":read {home}/b.cgql")
    assert code == 2
    assert "reads itself" in err


def test_help(run: Run) -> None:
    out = run(":help")[1]
    assert all(f":{name} " in out for name in commands.COMMANDS)
    assert "any relation" in run(":help match")[1]
    assert "metres between" in run(":help functions")[1]
    assert ":why [row|all]" in run(":help :why")[1]
    assert "did you mean" in run(":help functoins")[2]


def test_set_lists_refuses_and_forgets(run: Run) -> None:
    out = run(":set x 1.5\n:set")[1]
    assert "$x" in out
    assert all(name in out for name in OPTIONS)
    for bad in ("mode tabel", "rows 0", "rows -3", "rows many", "timing maybe", "timeout 0", "width 5", "1x 3"):
        code, _, err = run(f":set {bad}")
        assert (code, "Traceback" in err) == (2, False), bad
    assert run(":set x 1\n:unset x\n:set x")[0] == 2
    assert run(":set timeout 0.5\n:unset timeout\n:set timeout 2\n" + SOFA)[0] == 0


def test_no_command_breaks_on_nonsense(run: Run, home: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(home)
    rests = ("", " nonsense", ' "', " #", " \x1b[31m", " é" * 50)
    text = "\n".join(f":use flat\n:{name}{rest}" for name in commands.COMMANDS if name != "quit" for rest in rests)
    code, out, err = run(text)
    assert code == 2
    assert "internal error" not in err
    assert "\x1b" not in out + err


def test_commands_by_beginning_and_alias() -> None:
    assert commands.find("sch") is commands.COMMANDS["schema"]
    assert commands.find("w") is commands.COMMANDS["why"]
    with pytest.raises(UsageError, match="no command"):
        commands.find("zzz")
    with pytest.raises(UsageError) as caught:
        commands.find("ex")
    assert caught.value.hint == "it may be :explain or :export"


# -- strangers' texts ----------------------------------------------------------------------------------------------


@pytest.mark.parametrize("mode", ["table", "tree", "json", "markdown"])
def test_terminal_codes_in_a_map_reach_no_terminal(
    mode: str, tmp_path: Path, capfd: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / "h.cgdb"
    with cgdb.open(path, create=True, text_encoder=None) as db:
        thing = SceneObject(id="e\x1b[2J", tag=HOSTILE, caption=HOSTILE, properties={"note": HOSTILE})
        db.add(
            SceneGraph(name="s" + HOSTILE.replace("\x00", ""), objects=(thing, SceneObject(id=2, tag="b" + HOSTILE)))
        )
    session = Session(Opening(path), terminal=True)
    session.settings.set("mode", mode)
    monkeypatch.setattr("sys.stdout.isatty", lambda: True, raising=False)
    from cgdb.cli.shell import run_script

    text = (
        "MATCH (o) RETURN o, o.tag, o.note, o.scene; :why 1\n:x 1\n:schema\n:scenes\n"
        ':show "#eESC[2J"\n:show #2\n:near #2\n:map\n'
        'MATCH (o) WHERE o.ESC[2J = 3 RETURN o;\n:ESC[2J\n:use "ESC[2J"\n:set x ESC[2J\n:set\n'
        ":cypher MATCH (a:Node) RETURN a.tag, a\n"
    )
    run_script(session, text.replace("ESC", "\x1b"))
    session.opening.close()
    out, err = capfd.readouterr()
    shown = out + err
    for theme_code in ("\x1b[0m", "\x1b[1m"):
        assert mode in ("json", "markdown") or theme_code[:2] in shown
    for forbidden in ("\x1b]0", "\x1b[31mred", "\x1b[2J", "\x9b", "\x07", "\x00", "\u202e", "\r"):
        assert forbidden not in shown, repr(forbidden)


# -- parts ---------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("", []),
        (" ;; \n ; ", []),
        ("a; b", [("a", 1), ("b", 1)]),
        ("// x;y\na 'b;c' // ;\n;\n:set x ; y\nz", [("a 'b;c' // ;", 2), (":set x ; y", 4), ("z", 5)]),
        (":a\n:b", [(":a", 1), (":b", 2)]),
        ("a\n:on;b", [("a\n:on", 1), ("b", 2)]),
        ("MATCH (o)-[:on]->(p) RETURN o;:why", [("MATCH (o)-[:on]->(p) RETURN o", 1), (":why", 1)]),
    ],
)
def test_a_script_in_pieces(text: str, expected: list[tuple[str, int]]) -> None:
    assert [(piece.text, piece.line) for piece in script.pieces(text)] == expected


@pytest.mark.parametrize(
    ("text", "whole"),
    [
        ("", True),
        (":help", True),
        ("MATCH (o) RETURN o", True),
        ("MATCH (o) RETURN o;", True),
        ("MATCH (o)", False),
        ("MATCH (o", False),
        ('MATCH (o ~ "cup") WHERE', False),
        ("MATCH (o) RETRN o", True),  # no further line makes it right
        ('MATCH (o ~ "cup', True),  # quotes end with their line
        ("MATCH (o)\nRETURN o", False),  # ORDER BY or LIMIT may follow
        ("MATCH (o)\nRETURN o\n", True),
        ("MATCH (o)\nRETURN o\nLIMIT 3", True),
        ("MATCH (o)\nRETURN o; ", True),
        ("// a note", False),
    ],
)
def test_when_enter_runs(text: str, whole: bool) -> None:
    assert script.complete(text) is whole


@pytest.mark.parametrize(
    "text", ["", ":set x 3", "MATCH (o ~ 'x')\nRETURN o // c", ":explain MATCH (o) RETURN o\n:x\nMATCH", "'\x00`"]
)
def test_colours_leave_the_text_as_it_is(text: str) -> None:
    assert "".join(piece for _, piece in pieces(text)) == text
    assert "\n".join("".join(piece for _, piece in line) for line in lines(text)) == text
    kinds = {kind for kind, _ in pieces("MATCH (o:Room ~ 'x')-[:on]->(p) WHERE volume(o) < 3 cm RETURN $p, #1 // c")}
    for theme in THEMES.values():
        assert not theme.syntax or kinds - {"", "sign"} <= set(theme.syntax)


def test_widths_that_fit() -> None:
    assert tables.fit([3, 4], 20) == [3, 4]
    assert tables.fit([3, 40, 40], 33) == [3, 15, 15]
    assert tables.fit([50, 50], 12) is None
    for room in range(40, 120):
        widths = tables.fit([8, 60, 12, 30], room)
        assert widths is None or sum(widths) <= room


@pytest.mark.parametrize("width", [60, 80, 200])
def test_tables_and_records_keep_to_the_width(width: int) -> None:
    from rich.cells import cell_len

    screen = Screen(Settings(), terminal=True)
    rows = [("#1 " + "mug " * 20, "名前" * 30, 3.14159, None), ("#2", "x" * 300, -1.0, "é")]
    made = tables.grid(("o", "caption\x1b", "n", "m"), rows, scores=[(0.91, True), (0.2, False)])
    found = tables.table(made, screen, width=width, bars=True, numbered=True)
    assert found is not None
    assert all(cell_len(line.plain) <= width for line in found)
    assert all(line.plain.isprintable() for line in found)
    for line in tables.record(made, 0, screen, width=width, bars=True):
        assert cell_len(line.plain) <= width


def test_bars() -> None:
    assert tables.bar(1.0, 4) == "████"
    assert tables.bar(0.5, 4) == "██  "
    assert tables.bar(0.03, 4) == "▏   "
    assert tables.bar(0.0, 2) == tables.bar(-3, 2) == "  "
    assert tables.bar(7.0, 2) == "██"


def test_folded_text_keeps_its_words() -> None:
    text = "a wide charcoal grey daybed sofa " + "x" * 50
    parts = tables.folded(text, 20)
    assert all(len(part) <= 20 for part in parts)
    assert "".join(parts).replace(" ", "") == text.replace(" ", "")
    assert tables.folded("", 5) == [""]


@pytest.mark.parametrize("text", ["it's", 'a "b"', "\\", "a\nb\tc\x7f", "é", ""])
def test_quoted_texts_read_back(text: str) -> None:
    (item,) = parse(f"USE {quoted(text)} MATCH (o) RETURN o").scenes
    assert getattr(item, "value") == text  # noqa: B009


def test_folders_follow_the_rules_of_xdg(monkeypatch: pytest.MonkeyPatch, home: Path) -> None:
    assert folder("config") == home / "config" / "cgdb"
    monkeypatch.setenv("XDG_STATE_HOME", "relative")
    monkeypatch.setenv("HOME", str(home))
    assert folder("state") == home / ".local/state/cgdb"


def test_the_prompt_needs_nothing_heavy() -> None:
    import subprocess
    import sys

    heavy = ("numpy", "sqlalchemy", "kuzu", "faiss", "networkx", "rich.console", "tokenizers", "matplotlib")
    code = f"import sys, cgdb.cli.app, cgdb.cli.shell, cgdb.cli.prompt\nprint([m for m in {heavy} if m in sys.modules])"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"


def test_errors_of_a_cancelled_wait_are_cgdb_errors(store: Path) -> None:
    session = Session(Opening(store), interactive=True, terminal=False)

    def fails() -> None:
        raise CgdbError("x")

    with pytest.raises(CgdbError, match="x"):
        session.waiting(fails, lambda: None)
    assert session.waiting(lambda: 3, lambda: None) == 3
    session.opening.close()


def test_an_interrupt_cancels_and_a_second_one_stops_waiting(store: Path) -> None:
    session = Session(Opening(store), interactive=True, terminal=False)
    told = threading.Event()
    stop = threading.Event()

    def interrupt(after: float) -> None:
        threading.Timer(after, signal.raise_signal, (signal.SIGINT,)).start()

    interrupt(0.2)
    with pytest.raises(QueryCancelled, match="cancelled after"):
        session.waiting(lambda: told.wait(20), told.set)
    interrupt(0.2)
    interrupt(0.8)
    with pytest.raises(QueryCancelled, match="left alone"):
        session.waiting(lambda: stop.wait(20), lambda: None)
    stop.set()
    session.opening.close()
