"""Plain words at the prompt: told from statements, answered, and followed up."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

from cgdb.cli.app import main
from cgdb.cli.plainly import is_question

FLAT = Path(__file__).parents[1] / "cli" / "flat.json"


@pytest.mark.parametrize(
    "text",
    [
        "what's on the table?",
        "something to sit on",
        "und wo ist die Lampe?",
        "cup",
        "Лампа",
        "where is the mug?",
        "Where can I sit",
        "where's the cat",
        "with which tool do I cut bread?",
    ],
)
def test_words_are_a_question(text: str) -> None:
    assert is_question(text)


@pytest.mark.parametrize(
    "text",
    [
        "MATCH (o) RETURN o",
        "mtch (o) RETURN o",
        "SELECT * FROM x",
        "use 'a' MATCH",
        "(o)",
        "#12",
        "",
        "count(o)",
        'WHERE o ~ "mug"',
        "WITH o RETURN o",
        "SET o.x = 1",
    ],
)
def test_statements_and_their_slips_are_not(text: str) -> None:
    assert not is_question(text)


def test_the_shell_answers_and_follows_up(tmp_path: Path) -> None:
    store = tmp_path / "flat.cgdb"
    assert main(["import", str(FLAT), "--into", str(store), "--no-encode", "--quiet"]) == 0
    script = "lamps;\nwhich of these is the highest?;\n:ask how many lamps are there?\nMTCH (o) RETURN o;\n"
    done = subprocess.run(
        [sys.executable, "-m", "cgdb.cli.app", "shell", str(store), "--no-rc"],
        input=script,
        capture_output=True,
        text=True,
        check=False,
    )
    assert "pendant lamp" in done.stdout
    assert "✓ 5 lamps: " in done.stderr
    assert "did you mean 'MATCH'?" in done.stderr
    assert done.returncode == 3
