"""A query sees what was committed before it, by whomever: nothing that is remembered may outlive a commit."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

import cgdb
from cgdb.errors import StoreError

ADD = """
import sys
import cgdb
path, scene, count = sys.argv[1:]
with cgdb.open(path, text_encoder=None) as db:
    objects = tuple(cgdb.SceneObject(id=i, tag=f"thing {i}") for i in range(int(count)))
    db.add(cgdb.SceneGraph(name=scene, objects=objects), on_existing="replace")
"""


def elsewhere(path: Path, scene: str, count: int) -> None:
    """Another process writes a scene."""
    subprocess.run([sys.executable, "-c", ADD, str(path), scene, str(count)], check=True)


def count(db: cgdb.Database, scene: str) -> object:
    return db.query(f"USE '{scene}' MATCH (o) RETURN count(o)")[0][0]


def test_commits_of_another_process_are_seen_by_the_next_query(tmp_path: Path) -> None:
    with cgdb.open(tmp_path / "s.cgdb", create=True, text_encoder=None) as db:
        db.add(cgdb.SceneGraph(name="lab", objects=(cgdb.SceneObject(id=1, tag="cup"),)))
        assert count(db, "lab") == 1
        for expected in (3, 2, 5):
            elsewhere(db.path, "lab", expected)
            assert count(db, "lab") == expected
        elsewhere(db.path, "attic", 4)
        assert count(db, "attic") == 4
        assert db.query("MATCH (o) RETURN count(o)")[0][0] == 9


def test_own_commits_are_seen_by_the_next_query(tmp_path: Path) -> None:
    with cgdb.open(tmp_path / "s.cgdb", create=True, text_encoder=None) as db:
        for number in range(1, 4):
            objects = tuple(cgdb.SceneObject(id=i, tag="cup") for i in range(number))
            db.add(cgdb.SceneGraph(name="lab", objects=objects), on_existing="replace")
            assert count(db, "lab") == number
        db.remove("lab")
        with pytest.raises(StoreError, match="no scene"):
            count(db, "lab")


def test_a_write_that_is_not_committed_is_not_seen(tmp_path: Path) -> None:
    with cgdb.open(tmp_path / "s.cgdb", create=True, text_encoder=None) as db:
        db.add(cgdb.SceneGraph(name="lab", objects=(cgdb.SceneObject(id=1, tag="cup"),)))
        with pytest.raises(RuntimeError), db.write("lab", on_existing="merge") as writer:
            writer.objects([cgdb.SceneObject(id=2, tag="pen")])
            assert count(db, "lab") == 1
            raise RuntimeError
        assert count(db, "lab") == 1
        with db.write("lab", on_existing="merge") as writer:
            writer.objects([cgdb.SceneObject(id=2, tag="pen")])
        assert count(db, "lab") == 2


def test_a_closed_store_says_so(tmp_path: Path) -> None:
    db = cgdb.open(tmp_path / "s.cgdb", create=True, text_encoder=None)
    db.add(cgdb.SceneGraph(name="lab", objects=(cgdb.SceneObject(id=1, tag="cup"),)))
    assert count(db, "lab") == 1
    db.close()
    db.close()
    with pytest.raises(StoreError, match="closed"):
        count(db, "lab")
