"""The examples run as they stand, in a fresh process and an empty folder."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

EXAMPLES = Path(__file__).parent.parent / "examples"
SAYS = {
    "01_ask_a_map.py": ["potted plant", "water bottle", "bedside lamp"],
    "02_search_by_vector.py": ["running shoes", "scissors"],
    "03_export_for_a_planner.py": ["flat.graphml", '"object_tag": "sofa"', "objects left out"],
    "04_script_graph_queries.py": ["living room", "toolbox", "may be stored in", "connected part"],
    "05_ask_while_mapping.py": ["frame 16: revision 2; on the table: ['lamp', 'mug']", "0.6"],
}


def run(script: Path, folder: Path, *arguments: str) -> str:
    done = subprocess.run(
        [sys.executable, "-W", "error::DeprecationWarning:__main__", str(script), *arguments],
        cwd=folder,
        capture_output=True,
        text=True,
        timeout=120,
        check=False,
    )
    assert done.returncode == 0, done.stderr[-3000:]
    return done.stdout


def test_every_example_is_listed() -> None:
    assert sorted(path.name for path in EXAMPLES.glob("[0-9]*.py")) == sorted(SAYS)


@pytest.mark.slow
@pytest.mark.parametrize("name", SAYS)
def test_an_example_runs(tmp_path: Path, name: str) -> None:
    printed = run(EXAMPLES / name, tmp_path)
    for expected in SAYS[name]:
        assert expected in printed, printed[-3000:]
    assert list(tmp_path.iterdir()) == [], "an example cleans up behind itself"


def test_the_generator_of_the_flat_writes_where_it_is_told(tmp_path: Path) -> None:
    run(EXAMPLES / "make_flat.py", tmp_path, str(tmp_path / "flat.json"))
    assert (tmp_path / "flat.json").read_bytes() == (EXAMPLES.parent / "cli" / "flat.json").read_bytes()
