"""Index files are deleted, cut short and harmed: it is noticed, they are built again, and no answer is wrong."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

import cgdb
from cgdb.cli.app import main

COUNT = 200
QUESTION = "MATCH (a ~ $v)-[:on]->(b) WHERE b.weight > 3 RETURN a.id, b.id LIMIT 5"


def scene(seed: int = 0) -> cgdb.SceneGraph:
    rng = np.random.default_rng(seed)
    vectors = rng.normal(size=(COUNT, 16)).astype(np.float32)
    return cgdb.SceneGraph(
        name="lab",
        objects=tuple(
            cgdb.SceneObject(id=i, tag=f"thing {i}", features={"clip": vectors[i]}, properties={"weight": i % 7})
            for i in range(COUNT)
        ),
        relations=tuple(cgdb.Relation(source=i, target=(i * 7 + 1) % COUNT, label="on") for i in range(COUNT)),
        spaces=(cgdb.FeatureSpace(name="clip", dimension=16),),
    )


VECTOR = np.random.default_rng(0).normal(size=(COUNT, 16)).astype(np.float32)[17]


def answer(path: Path) -> list[list[object]]:
    with cgdb.open(path, text_encoder=None) as db:
        return [[*row.values, round(row.score, 5)] for row in db.query(QUESTION, v=VECTOR)]


@pytest.fixture
def store(tmp_path: Path) -> Path:
    path = tmp_path / "lab.cgdb"
    with cgdb.open(path, create=True, text_encoder=None) as db:
        db.add(scene())
        db.prepare()
    return path


def flip(path: Path, at: float) -> None:
    data = bytearray(path.read_bytes())
    data[int(at * (len(data) - 1))] ^= 0xFF
    path.write_bytes(data)


DAMAGES: dict[str, Callable[[Path], object]] = {
    "deleted": Path.unlink,
    "emptied": lambda path: path.write_bytes(b""),
    "cut": lambda path: path.write_bytes(path.read_bytes()[: path.stat().st_size // 2]),
    "first byte": lambda path: flip(path, 0.0),
    "a byte in the middle": lambda path: flip(path, 0.5),
    "last byte": lambda path: flip(path, 1.0),
}


@pytest.mark.parametrize("damage", DAMAGES)
def test_a_damaged_index_file_is_built_again(store: Path, damage: str) -> None:
    right = answer(store)
    assert right
    names = sorted(path.name for path in (store / "index").iterdir())
    assert len(names) >= 6
    for name in names:
        path = store / "index" / name
        if not path.exists():  # a rebuilt file may have another name
            continue
        DAMAGES[damage](path)
        assert answer(store) == right, name
        with cgdb.open(store, text_encoder=None) as db:
            db.prepare()
            assert db.check() == (), name


def test_check_tells_and_repairs(store: Path, capfd: pytest.CaptureFixture[str]) -> None:
    right = answer(store)
    for path in (store / "index").iterdir():
        if path.suffix != ".json":
            flip(path, 0.4)
    assert main(["check", str(store)]) == 1
    out, err = capfd.readouterr()
    assert "index" in out
    assert "--repair" in err
    assert main(["check", str(store), "--repair"]) == 0
    assert main(["check", str(store)]) == 0
    assert answer(store) == right


def test_a_missing_index_folder_is_made_again(store: Path) -> None:
    import shutil

    right = answer(store)
    shutil.rmtree(store / "index")
    assert answer(store) == right


@pytest.mark.parametrize("catch_up_from", [10, 10**9])
def test_indexes_follow_revisions_and_old_ones_stay_readable(
    store: Path, monkeypatch: pytest.MonkeyPatch, catch_up_from: int
) -> None:
    monkeypatch.setattr("cgdb.view.CATCH_UP_FROM", catch_up_from)
    with cgdb.open(store, text_encoder=None) as db:
        before = [row.values for row in db.query("MATCH (a)-[:on]->(b) RETURN a.id, b.id")]
        for step in range(5):
            moved = cgdb.SceneGraph(
                name="lab",
                objects=(cgdb.SceneObject(id=1000 + step, tag="new"),),
                relations=(cgdb.Relation(source=1000 + step, target=step, label="on", origin="human"),),
            )
            db.add(moved, on_existing="merge")
            now = [row.values for row in db.query("MATCH (a)-[:on]->(b) RETURN a.id, b.id")]
            assert len(now) == COUNT + step + 1
            assert (1000 + step, step) in now
        old = [row.values for row in db.query("USE 'lab' AS OF 1 MATCH (a)-[:on]->(b) RETURN a.id, b.id")]
        assert sorted(old) == sorted(before)
        with pytest.raises(cgdb.CgdbError, match="#1000"):
            db.query("USE 'lab' AS OF 1 MATCH (#1000) RETURN count(*)")


def test_index_files_of_old_revisions_are_removed(store: Path) -> None:
    for number in range(3):
        with cgdb.open(store, text_encoder=None) as db:
            db.add(cgdb.SceneGraph(name="lab", objects=(cgdb.SceneObject(id=900 + number),)), on_existing="merge")
            db.prepare()
            latest = db.revisions()[-1].id
        assert {name.split("-")[1] for name in (path.name for path in (store / "index").iterdir())} == {f"r{latest}"}


def test_a_reader_in_another_process_sees_the_last_commit(store: Path) -> None:
    with cgdb.open(store, text_encoder=None) as reader:
        assert reader.query("MATCH (o) RETURN count(o)")[0][0] == COUNT
        code = (
            "import cgdb, sys\n"
            f"with cgdb.open({str(store)!r}, text_encoder=None) as db:\n"
            "    db.add(cgdb.SceneGraph(name='lab', objects=(cgdb.SceneObject(id=5000),)), on_existing='merge')\n"
        )
        subprocess.run([sys.executable, "-c", code], check=True)
        assert reader.query("MATCH (o) RETURN count(o)")[0][0] == COUNT + 1
        assert reader.query("USE 'lab' AS OF 1 MATCH (o) RETURN count(o)")[0][0] == COUNT


KILLED = """
import sys
import numpy as np
import cgdb
path = sys.argv[1]
with cgdb.open(path, text_encoder=None) as db:
    step = 1000 * int(sys.argv[2])  # no process writes what another has written: that would be no revision
    while True:
        step += 1
        objects = tuple(
            cgdb.SceneObject(id=i, tag=f"step {step}", features={"clip": np.full(16, step, np.float32)})
            for i in range(step % 5, 200, 3)
        )
        db.add(cgdb.SceneGraph(name="lab", objects=objects, spaces=(cgdb.FeatureSpace(name="clip", dimension=16),)),
               on_existing="merge")
        db.prepare()
        print(step, flush=True)
"""


def check_killed(store: Path, times: int, seed: int) -> None:
    rng = np.random.default_rng(seed)
    done = 1
    for number in range(times):
        command = [sys.executable, "-c", KILLED, str(store), str(number)]
        process = subprocess.Popen(command, stdout=subprocess.PIPE, text=True)
        assert process.stdout is not None
        process.stdout.readline()
        time.sleep(float(rng.uniform(0.0, 0.3)))
        os.kill(process.pid, signal.SIGKILL)
        process.communicate()
        with cgdb.open(store, text_encoder=None) as db:
            revision = db.revisions()[-1].id
            assert revision > done
            done = revision
            tags = [row.values for row in db.query("MATCH (o) RETURN o.id, o.tag")]
            graph = db.scene("lab")
            assert tags == [(obj.id, obj.tag) for obj in graph.objects]
            for obj in graph.objects:
                step = (obj.tag or "").removeprefix("step ")
                if step.isdigit():  # the tag and the vector of one revision, never of two
                    assert float(obj.features["clip"][0]) == float(step)
            assert [p for p in db.check() if p.where != "index"] == []


def test_kill_9_while_updating_and_indexing(store: Path) -> None:
    check_killed(store, 2, seed=1)


@pytest.mark.slow
def test_kill_9_while_updating_and_indexing_often(store: Path) -> None:
    check_killed(store, 30, seed=2)


def test_threads_share_a_database(store: Path) -> None:
    from concurrent.futures import ThreadPoolExecutor

    right = answer(store)
    with cgdb.open(store, text_encoder=None) as db, ThreadPoolExecutor(4) as pool:
        found = list(
            pool.map(lambda _: [[*r.values, round(r.score, 5)] for r in db.query(QUESTION, v=VECTOR)], range(40))
        )
    assert all(rows == right for rows in found)
