"""What the documents say is run: the Python of the README, and every statement of the language's reference."""

from __future__ import annotations

import re
import shutil
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import cgdb
from cgdb import ingest
from cgdb.database import Database
from cgdb.errors import ExecuteError, StoreError
from cgdb.grammar import ast
from cgdb.grammar.parser import parse_script
from cgdb.grammar.printer import to_text

ROOT = Path(__file__).parents[1]
STATEMENTS = [
    to_text(statement)
    for block in re.findall(r"```cgql\n(.*?)```", (ROOT / "grammar" / "README.md").read_text("utf-8"), re.DOTALL)
    for statement in parse_script(block)
]
PARAMETERS = {"picture": np.ones(4, np.float32), "ids": [1, 2], "from": 2, "max": 2, "question": "a cup", "n": 3}


@pytest.fixture(scope="module")
def db(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Database]:
    """A store that holds whatever the reference speaks of: three scenes, pictures' features, twelve revisions."""
    flat = ingest.load(ROOT / "cli" / "flat.json")
    first = replace(
        flat.objects[0],
        features={"clip": np.arange(4, dtype=np.float32)},
        properties={**flat.objects[0].properties, "limit": 3, "in": "the hall"},
    )
    scene = replace(
        flat,
        objects=(first, *flat.objects[1:]),
        spaces=(cgdb.FeatureSpace(name="clip", dimension=4),),
        relations=(*flat.relations, cgdb.Relation(source=12, target=1, label="on top of", origin="human")),
    )
    with cgdb.open(tmp_path_factory.mktemp("docs") / "docs.cgdb", create=True, text_encoder=None) as opened:
        for name in ("lab", "kitchen", "flat"):
            opened.add(replace(scene, name=name))
        for number in range(9):
            added = cgdb.SceneGraph(name="kitchen", objects=(cgdb.SceneObject(id=5000 + number),))
            opened.add(added, on_existing="merge")
        yield opened


@pytest.mark.parametrize("text", STATEMENTS)
def test_the_statements_of_the_reference_run(db: Database, text: str) -> None:
    (statement,) = parse_script(text)
    if statement.rerank is not None:
        with pytest.raises(ExecuteError, match="language model"):
            db.query(text, PARAMETERS)
    elif isinstance(statement.as_of, ast.Text):
        with pytest.raises(StoreError, match="no revision yet"):
            db.query(text, PARAMETERS)
    else:
        db.query(text, PARAMETERS)


def test_the_python_of_the_readme_runs(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "cli").mkdir()
    shutil.copy(ROOT / "cli" / "flat.json", tmp_path / "cli")
    monkeypatch.chdir(tmp_path)
    blocks = re.findall(r"```python\n(.*?)```", (ROOT / "README.md").read_text("utf-8"), re.DOTALL)
    assert blocks
    for block in blocks:
        exec(compile(block, "README.md", "exec"), {})


def test_the_commands_of_the_readme_are_commands() -> None:
    from cgdb.cli.app import main

    text = (ROOT / "README.md").read_text("utf-8")
    for command in set(re.findall(r"^\$ cgdb (\w+) ", text, re.MULTILINE)):
        with pytest.raises(SystemExit) as stopped:
            main([command, "--help"])
        assert stopped.value.code == 0


def test_architecture_names_the_modules_there_are() -> None:
    text = (ROOT / "ARCHITECTURE.md").read_text("utf-8")
    rooms = [ROOT / room for room in ("grammar", "ingest", "cli")]
    rooms += [ROOT / "cgdb", *(path for path in (ROOT / "cgdb").iterdir() if path.is_dir() and not path.is_symlink())]
    there = {path.stem for room in rooms for path in room.rglob("*.py")}
    named = set(re.findall(r"`([a-z0-9_]+)`", text))
    missing = {name for name in there if not name.startswith("__")} - named
    assert not missing, f"ARCHITECTURE.md does not name {sorted(missing)}"
