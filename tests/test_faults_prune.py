"""Faults while old history goes: killed processes, a full disk, readers and writers beside it."""

from __future__ import annotations

import random
import sqlite3
import subprocess
import threading
import time
from pathlib import Path

import pytest

from cgdb.errors import CgdbError, StoreBusyError, StoreError
from cgdb.scene import SceneObject
from cgdb.storage.ledger import Ledger
from tests.child_scripts import finished, started

SIZE = 150

PROLOGUE = """
import sys, numpy as np
from pathlib import Path
from cgdb.errors import CgdbError
from cgdb.scene import FeatureSpace, Relation, SceneObject, View
from cgdb.storage.ledger import Ledger
PATH, SIZE = Path(sys.argv[1]), int(sys.argv[2])
CLIP = FeatureSpace(name="clip", dimension=16)

def write(ledger, mark, scene="lab"):
    # Every row of a revision says the same number: a mixture would show.
    with ledger.write(scene, on_existing="replace", spaces=[CLIP]) as w:
        w.relations(Relation(source=i, target=(i + 1) % SIZE, label=f"r{mark}") for i in range(SIZE))
        image = bytes([255, 216, 255]) + b"%d" % mark
        w.objects(
            SceneObject(
                id=i,
                tag=f"r{mark}",
                features={"clip": np.full(16, mark, np.float32)},
                points=np.full((100, 3), mark, np.float32),
                views=(View(frame=mark, points=2, box=(0, 0, 1, 1), image=image),),
            )
            for i in range(SIZE)
        )
    return w.revision
"""


def script(body: str, path: Path, size: int = SIZE) -> subprocess.Popen[str]:
    return started(PROLOGUE + body, path, size)


def assert_whole(ledger: Ledger, revision: int, size: int = SIZE) -> None:
    """Every row of the revision is there, and of no other one."""
    info = ledger.scene("lab", revision)
    graph = ledger.scene_graph(info, views=True)
    assert len(graph.objects) == len(graph.relations) == size
    assert {obj.tag for obj in graph.objects} == {r.label for r in graph.relations} == {f"r{revision}"}
    assert all((obj.points == revision).all() and (obj.features["clip"] == revision).all() for obj in graph.objects)
    assert {obj.views[0].image for obj in graph.objects} == {b"\xff\xd8\xff%d" % revision}


PRUNING = """
with Ledger.open(PATH, create=True) as ledger:
    while True:
        for _ in range(4):
            print("wrote", write(ledger, ledger.revision() + 1), flush=True)
        print("prunes", flush=True)
        done = ledger.prune(keep=2)
        print("pruned", done.scenes[0].kept_from, flush=True)
"""


@pytest.mark.parametrize("times", [4, pytest.param(40, marks=pytest.mark.slow)])
def test_kill_9_while_pruning(tmp_path: Path, times: int) -> None:
    """At any moment there is the old history or the new one, and of each every revision is whole."""
    path = tmp_path / "s.cgdb"
    dice = random.Random(times)
    committed = begun = cut_off = 0
    for turn in range(times):
        process = script(PRUNING, path)
        assert process.stdout is not None
        said: list[str] = []
        while not said or said[-1] != "prunes":
            said.append(process.stdout.readline().strip())
        # Half of them in the midst of the first pruning, half of them anywhere.
        time.sleep(dice.random() * (0.03 if turn % 2 == 0 else 0.5))
        process.kill()
        rest, err = process.communicate(timeout=60)
        assert "Traceback" not in err
        said += rest.split("\n")
        written = [int(line.split()[1]) for line in said if line.startswith("wrote ")]
        pruned = [int(line.split()[1]) for line in said if line.startswith("pruned ")]
        with Ledger.open(path) as ledger:
            last = ledger.revision()
            assert last >= max(written)
            kept = [revision.id for revision in ledger.revisions()]
            horizon = ledger.horizons().get("lab")
            start = 1 if horizon is None else horizon.kept_from
            assert kept == list(range(start, last + 1))
            assert start >= max([committed, *pruned]), "what was said to be pruned is back"
            cut_off += "prunes" in said and not pruned
            for revision in kept:
                assert_whole(ledger, revision)
            for revision in range(1, start):
                with pytest.raises(StoreError, match=f"before revision {start} of scene 'lab' was pruned"):
                    ledger.scene("lab", revision)
            assert ledger.check() == []
            committed, begun = start, begun + 1
    assert begun == times and committed > 1 and cut_off > 0


def test_a_full_disk_leaves_the_store_as_it_was(tmp_path: Path) -> None:
    path = tmp_path / "s.cgdb"
    body = """
import resource, signal
signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
with Ledger.open(PATH, create=True) as ledger:
    for mark in range(1, 13):
        write(ledger, mark)
with Ledger.open(PATH) as ledger:
    resource.setrlimit(resource.RLIMIT_FSIZE, (100_000, resource.RLIM_INFINITY))
    try:
        print("pruned", ledger.prune(keep=1))
    except CgdbError as error:
        print(type(error).__name__, error.render())
    resource.setrlimit(resource.RLIMIT_FSIZE, (resource.RLIM_INFINITY, resource.RLIM_INFINITY))
    print([revision.id for revision in ledger.revisions()] == list(range(1, 13)), ledger.horizons(), ledger.check())
    print(ledger.prune(keep=1).revisions, ledger.check())
"""
    out = finished(script(body, path)).splitlines()
    assert out[0].startswith("StoreError store error: the disk is full"), out
    assert "the store is as before" in out[0]
    assert out[-2:] == ["True {} []", "11 []"], out


def test_a_disk_that_is_full_when_the_file_is_shortened(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = tmp_path / "s.cgdb"
    finished(script("ledger = Ledger.open(PATH, create=True)\nfor mark in (1, 2, 3): write(ledger, mark)", path))
    from cgdb.storage import shrink

    def full(*_: object) -> list[str]:
        raise sqlite3.OperationalError("database or disk is full")

    with Ledger.open(path) as ledger:
        with monkeypatch.context() as patch:
            patch.setattr(shrink, "_give_back", full)
            done = ledger.prune(keep=1)
        assert done.revisions == 2 and "could not be made shorter now (database or disk is full)" in done.notes[0]
        assert_whole(ledger, 3)
        assert ledger.prune(keep=1).size_after < done.size_after


# --- others beside it ------------------------------------------------------------------------------------------------


def test_a_reader_goes_on_or_is_told(tmp_path: Path) -> None:
    path = tmp_path / "s.cgdb"
    finished(script("ledger = Ledger.open(PATH, create=True)\nfor mark in (1, 2, 3): write(ledger, mark)", path))
    with Ledger.open(path, read_only=True) as reader, Ledger.open(path) as writer:
        old, now = reader.scene("lab", 1), reader.scene("lab", 3)
        pages, present = reader.nodes(old, batch=20), reader.nodes(now, batch=20)
        first, here = next(pages), next(present)
        keys = [node.key for node in first]
        writer.prune(keep=1)
        assert sum(map(len, present)) + len(here) == SIZE, "the present is read to its end"
        for read in (
            lambda: list(pages),
            lambda: reader.nodes_by_key(old, keys),
            lambda: reader.node_by_id(old, 1),
            lambda: reader.relations_of(old, keys),
            lambda: list(reader.relations(old)),
            lambda: reader.features_by_key(old, "clip", keys),
            lambda: list(reader.features(old, "clip")),
            lambda: reader.cloud(old, keys[0]),
            lambda: reader.views(old, keys[0]),
            lambda: reader.scene_graph(old),
            lambda: reader.scene_graph(old, skip_damaged=True),
            lambda: reader.changes(old.id, 1, 3),
        ):
            with pytest.raises(StoreError, match="before revision 3 of scene 'lab' was pruned") as told:
                read()
            assert type(told.value) is StoreError, "nothing is damaged"
        assert reader.check() == []


def test_an_open_snapshot_is_read_to_its_end(tmp_path: Path) -> None:
    """A transaction that began before sees what was; the file gets shorter when it has ended."""
    path = tmp_path / "s.cgdb"
    finished(script("ledger = Ledger.open(PATH, create=True)\nfor mark in range(1, 9): write(ledger, mark)", path))
    raw = sqlite3.connect(path / "ledger.sqlite", isolation_level=None)
    with Ledger.open(path) as ledger:
        raw.execute("begin")
        assert raw.execute("select count(*) from nodes").fetchone() == (8 * SIZE,)
        done = ledger.prune(keep=1)
        assert done.revisions == 7 and done.notes == (
            "others are reading or writing: the file gets shorter when they are done",
        )
        assert raw.execute("select count(*) from nodes").fetchone() == (8 * SIZE,)
        assert raw.execute("select count(*) from clouds where length(data) = 1200").fetchone() == (8 * SIZE,)
        raw.execute("commit")
        assert raw.execute("select count(*) from nodes").fetchone() == (SIZE,)
        assert ledger.prune(keep=1).size_after < done.size_after / 2
    raw.close()


def test_check_beside_pruning_finds_nothing(tmp_path: Path) -> None:
    path = tmp_path / "s.cgdb"
    process = script(
        """
with Ledger.open(PATH, create=True) as ledger:
    for turn in range(8):
        for _ in range(3):
            write(ledger, ledger.revision() + 1)
        ledger.prune(keep=2)
        print("pruned", flush=True)
""",
        path,
    )
    assert process.stdout is not None and process.stdout.readline() == "pruned\n"
    looked = 0
    with Ledger.open(path, read_only=True) as ledger:
        while process.poll() is None:
            assert ledger.check() == []
            looked += 1
            last = ledger.revision()
            try:
                assert_whole(ledger, last)
            except StoreError as error:
                assert type(error) is StoreError and "was pruned" in error.message
        finished(process)
        assert [revision.id for revision in ledger.revisions()] == [23, 24]
    assert looked > 1


def test_a_writer_beside_it_waits_and_pruning_waits_for_writers(tmp_path: Path) -> None:
    path = tmp_path / "s.cgdb"
    finished(script("ledger = Ledger.open(PATH, create=True)\nfor mark in (1, 2, 3): write(ledger, mark)", path))
    failed: list[CgdbError] = []

    def mapping() -> None:
        with Ledger.open(path) as ledger:
            try:
                for _ in range(10):
                    with ledger.write("other", on_existing="merge") as writer:
                        writer.objects([SceneObject(id=ledger.revision())])
            except CgdbError as error:
                failed.append(error)

    thread = threading.Thread(target=mapping)
    with Ledger.open(path) as ledger:
        thread.start()
        while thread.is_alive():
            ledger.prune(keep=1)
        thread.join()
        ledger.prune(keep=1)
        assert not failed and [revision.id for revision in ledger.revisions()] == [3, 13]
        assert ledger.check() == []
        with Ledger.open(path, patience=0.1) as impatient, ledger.write("lab", on_existing="merge") as writer:
            with pytest.raises(StoreBusyError):
                impatient.prune(keep=1)
            writer.relations([])
