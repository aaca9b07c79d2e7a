"""The shell as a person at a terminal sees it: typed at through a pty, read off a screen that is emulated."""

from __future__ import annotations

import os
import shutil
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

import cgdb
from cgdb import ingest
from cgdb.scene import SceneGraph, SceneObject

pexpect = pytest.importorskip("pexpect")
pyte = pytest.importorskip("pyte")

FLAT = Path(__file__).parents[1] / "cli" / "flat.json"
PATIENCE = 30.0
UP, DOWN, RIGHT, TAB, ENTER, F4 = "\x1b[A", "\x1b[B", "\x1b[C", "\t", "\r", "\x1bOS"
SLOW = "MATCH (a), (b), (c) WHERE distance(a, b) < distance(b, c) RETURN count(*)"


class Terminal:
    """A shell in a terminal of a given size."""

    def __init__(self, store: Path, home: Path, *, columns: int = 100, rows: int = 36, **environment: str) -> None:
        variables = {
            **os.environ,
            "TERM": "xterm-256color",
            "XDG_CONFIG_HOME": str(home / "config"),
            "XDG_STATE_HOME": str(home / "state"),
            "LC_ALL": "C.UTF-8",
            **environment,
        }
        command = str(Path(sys.executable).with_name("cgdb"))
        self._child = pexpect.spawn(command, [str(store)], env=variables, dimensions=(rows, columns), timeout=PATIENCE)
        self._screen = pyte.Screen(columns, rows)
        # A terminal answers where its cursor is.
        self._screen.write_process_input = self._child.send
        self._stream = pyte.ByteStream(self._screen)
        self.raw = b""

    def type(self, text: str) -> None:
        """Send keys."""
        self._child.send(text)

    def line(self, text: str) -> None:
        """Type a line and press Enter, once the prompt is there to take it."""
        self.type(text)
        # The menu of completions and the text are drawn in their own time; Enter runs what was typed in any case.
        self.until(lambda: text[-12:] in self.text().replace("\n", ""))
        self.type(ENTER)

    def read(self, seconds: float = 0.05) -> None:
        """Take what has come."""
        try:
            new = self._child.read_nonblocking(65536, timeout=seconds)
        except (pexpect.TIMEOUT, pexpect.EOF):
            return
        self.raw += new
        self._stream.feed(new)

    def text(self) -> str:
        """What is on the screen."""
        return "\n".join(line.rstrip() for line in self._screen.display).rstrip()

    def until(self, met: Callable[[], bool], what: str = "") -> None:
        """Read until a condition is met."""
        end = time.monotonic() + PATIENCE
        while not met():
            assert time.monotonic() < end, f"waited for {what or met}; on the screen:\n{self.text()}"
            self.read()

    def sees(self, text: str) -> None:
        """Wait for a text on the screen, which may have broken a long line of it."""
        self.until(lambda: text in self.text() or text in "".join(self._screen.display), repr(text))

    def prompted(self) -> None:
        """Wait for an empty prompt as the last line but the toolbar."""
        self.until(lambda: self._prompt_line() == "cgdb>", "an empty prompt")

    def _prompt_line(self) -> str:
        return self._screen.display[self._screen.cursor.y].rstrip()

    def ended(self) -> int:
        """Wait for the end; the exit code."""
        end = time.monotonic() + PATIENCE
        while self._child.isalive():
            assert time.monotonic() < end, self.text()
            self.read()
        return int(self._child.exitstatus)

    def close(self) -> None:
        self._child.close(force=True)


@pytest.fixture(scope="module")
def store(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("terminal") / "flat.cgdb"
    with cgdb.open(path, create=True, text_encoder=None) as db:
        db.add(ingest.load(FLAT))
        db.prepare()
    return path


Open = Callable[..., Terminal]


@pytest.fixture
def terminal(store: Path, tmp_path: Path) -> Iterator[Open]:
    opened: list[Terminal] = []

    def start(at: Path = store, **options: object) -> Terminal:
        made = Terminal(at, tmp_path, **options)  # type: ignore[arg-type]
        opened.append(made)
        made.prompted()
        return made

    yield start
    for made in opened:
        made.close()


def test_type_look_and_leave(terminal: Open) -> None:
    t = terminal()
    t.line("MATCH (o) WHERE o.tag = 'mug' RETURN o")
    t.sees("1  #19 mug")
    t.sees("1 row · ")
    t.line(":why")
    t.sees('✓ ████████  o.tag = "mug"')
    t.line(":map")
    t.sees("┌─ bedroom ─")
    t.sees("19")
    t.prompted()
    t.type("\x04")
    assert t.ended() == 0


def test_complete(terminal: Open) -> None:
    t = terminal()
    t.sees("1 scene")
    t.type("ma" + TAB)
    t.sees("cgdb> match")
    t.type(" (o:Roo" + TAB)
    t.sees("(o:Room")
    t.type(")-[:conta" + TAB + "]->(p) whe" + TAB + " p.affo" + TAB)
    t.sees("[:contains]->(p) where p.affordances")
    t.type("\x03")
    t.prompted()
    t.type('MATCH (o ~ "drinking g')
    t.sees("drinking glasses  tag")
    t.type(TAB)
    t.sees('MATCH (o ~ "drinking glasses')
    t.type("\x03")
    t.prompted()
    t.type(":them")
    t.sees("dark, light, plain or auto")
    t.type(TAB + " li" + TAB)
    t.sees("cgdb> :theme light")


def test_mistype(terminal: Open) -> None:
    t = terminal()
    t.line("MATCH (o) RETRN o")
    t.sees("cgdb> MATCH (o) RETRN o\n                ^^^^^\nsyntax error: found 'RETRN'")
    t.sees("hint: did you mean 'RETURN'?")
    t.line("MATCH (o) WHERE o.colr = 3 RETURN o")
    t.sees("cgdb> MATCH (o) WHERE o.colr = 3 RETURN o\n                      ^^^^^^\nname error")
    t.line(":shwo #12")
    t.sees("hint: did you mean ':show'?")
    t.line(":explain MATCH (o) RETURN p")
    t.sees("cgdb> :explain MATCH (o) RETURN p\n" + " " * len("cgdb> :explain MATCH (o) RETURN ") + "^")
    t.line(".tables")
    t.sees("commands begin with a colon")


@pytest.mark.slow
def test_several_lines(terminal: Open) -> None:
    t = terminal()
    t.line("MATCH (o)")
    t.sees("    ·")
    t.line("WHERE o.tag = 'sofa'")
    t.line("RETURN o.id")
    t.sees("Enter runs this")
    t.type(ENTER)
    t.sees("1 row")
    t.prompted()
    t.type(UP)
    t.sees("    · RETURN o.id\n")
    t.type("\x03")
    t.prompted()
    t.type("MATCH (o) RETURN o.id\x1b\rLIMIT 2;" + ENTER)
    t.sees("2 rows")


@pytest.mark.slow
def test_cancel(terminal: Open) -> None:
    t = terminal()
    t.line(SLOW)
    t.sees("Ctrl-C cancels")
    began = time.monotonic()
    t.type("\x03")
    t.sees("cancelled")
    assert time.monotonic() - began < 10
    t.prompted()
    t.line("MATCH (o) WHERE o.tag = 'mug' RETURN o.id")
    t.sees("19")
    t.prompted()
    t.type("half a line\x03")
    t.prompted()
    assert t.text().count("half a line") <= 1


@pytest.mark.slow
def test_page(terminal: Open) -> None:
    if shutil.which("less") is None:
        pytest.skip("less is not installed")
    t = terminal(rows=24, PAGER="less", LESS="")
    t.line("MATCH (o) RETURN o.id ORDER BY id(o)")
    t.sees("of 90 rows (:all shows the rest)")
    t.line(":all")
    t.until(lambda: t.text().endswith(":"), "the pager")
    t.type("G")
    t.sees("90    90")
    t.type("q")
    t.prompted()
    t.line(":x")
    t.sees("record 1 of 90")
    t.type(RIGHT)
    t.sees("record 2 of 90")
    t.type("G")
    t.sees("record 90 of 90")
    t.sees("o.id  90")
    t.type("q")
    t.prompted()


@pytest.mark.slow
def test_history_and_suggestions_last_longer_than_a_session(terminal: Open, tmp_path: Path) -> None:
    t = terminal()
    t.line("MATCH (o) WHERE o.tag = 'mug' RETURN o.id")
    t.sees("19")
    t.prompted()
    t.type("\x04")
    t.ended()
    kept = tmp_path / "state" / "cgdb" / "history"
    assert kept.stat().st_mode & 0o077 == 0
    t = terminal()
    t.type("MATCH (o) WH")
    t.sees("MATCH (o) WHERE o.tag = 'mug' RETURN o.id")
    t.type("\x03")
    t.prompted()
    t.type("\x12mug")
    t.sees("I-search backward: mug")
    t.type(ENTER)
    t.sees("cgdb> MATCH (o) WHERE o.tag = 'mug' RETURN o.id")


@pytest.mark.slow
def test_editor(terminal: Open, tmp_path: Path) -> None:
    script = tmp_path / "editor"
    script.write_text('#!/bin/sh\necho "MATCH (o) WHERE o.tag = \'sofa\' RETURN o.id" > "$1"\n')
    script.chmod(0o755)
    t = terminal(EDITOR=str(script), VISUAL=str(script))
    t.type("MATCH" + F4)
    t.sees("cgdb> MATCH (o) WHERE o.tag = 'sofa' RETURN o.id")
    t.type(ENTER)
    t.sees("1 row")


@pytest.mark.slow
def test_rc_file(terminal: Open, tmp_path: Path) -> None:
    folder = tmp_path / "config" / "cgdb"
    folder.mkdir(parents=True)
    (folder / "shellrc").write_text("# mine\n:mode jsonl\n:set what mug\n:show #1\n:set rows never\n")
    t = terminal()
    t.sees("shellrc:4: ':show' cannot stand in the rc file")
    t.sees("shellrc:5: rows is auto or a number")
    t.line("MATCH (o) WHERE o.tag = $what RETURN o.id AS id")
    t.sees('{"id": 19, "score": 1.0, "fits": true}')


@pytest.mark.slow
@pytest.mark.parametrize("columns", [60, 200])
def test_narrow_and_wide(terminal: Open, columns: int) -> None:
    t = terminal(columns=columns)
    t.line("MATCH (o) RETURN o, o.color, o.material LIMIT 5")
    t.sees("5 rows")
    head = next(line for line in t.text().splitlines() if "o.color" in line and "cgdb" not in line)
    assert len(head) <= columns
    t.line(":help")
    t.until(lambda: ":quit" in t.text() or ":" in t.text().splitlines()[-1], "help")


@pytest.mark.slow
def test_a_folder_that_is_no_store_ends_with_its_error(tmp_path: Path) -> None:
    t = Terminal(tmp_path, tmp_path)
    assert t.ended() == 6
    t.read()
    t.sees("there is no ledger in it")
    assert "Traceback" not in t.text()
    t.close()


@pytest.mark.slow
def test_an_empty_store(terminal: Open, tmp_path: Path) -> None:
    path = tmp_path / "empty.cgdb"
    cgdb.open(path, create=True, text_encoder=None).close()
    t = terminal(path)
    t.line("MATCH (o) RETURN o")
    t.sees("holds no scenes")
    for command in (":schema", ":scenes", ":map", ":show #1"):
        t.line(command)
        t.prompted()
    assert "internal error" not in t.text()


@pytest.mark.slow
def test_strangers_captions_do_not_drive_the_terminal(terminal: Open, tmp_path: Path) -> None:
    hostile = "\x1b]0;owned\x07mug\x1b[2J\x9b31m\r\n\u202e"
    path = tmp_path / "hostile.cgdb"
    with cgdb.open(path, create=True, text_encoder=None) as db:
        things = tuple(SceneObject(id=i, tag=hostile, caption=hostile, properties={"note": hostile}) for i in range(3))
        db.add(SceneGraph(name="s", objects=things))
    t = terminal(path)
    t.line("MATCH (o) RETURN o, o.note")
    t.sees("3 rows")
    for command in (":x 1", ":show #1", ":schema", ":mode json", ":mode csv"):
        t.line(command)
        t.prompted()
    t.line("MATCH (o) RETURN o.note LIMIT 1")
    t.prompted()
    t.type("MATCH (o) WHERE o.note = '")
    t.read(0.5)
    t.type("\x03")
    t.prompted()
    # What cgdb itself sends never sets a title, nor does it clear the screen in the middle of an answer.
    for forbidden in (b"\x1b]0", "\x9b".encode(), b"\x07", "\u202e".encode(), b"\x1b[2J\xc2"):
        assert forbidden not in t.raw
    assert b"mug\x1b[2J" not in t.raw
