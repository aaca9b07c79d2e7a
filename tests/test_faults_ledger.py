"""Faults that really happen to the ledger: killed processes, damaged bytes, full disks, other processes, Ctrl-C."""

from __future__ import annotations

import os
import random
import shutil
import signal
import sqlite3
import subprocess
import tempfile
import time
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from cgdb.errors import CgdbError, CorruptionError, StoreBusyError, StoreError
from cgdb.scene import FeatureSpace, Place, Relation, SceneObject, View
from cgdb.storage.ledger import Ledger
from tests.child_scripts import finished, started

CLIP = FeatureSpace(name="clip", dimension=16)
SIZE = 400  # objects: a revision takes some milliseconds, so that a random instant falls anywhere in one

PROLOGUE = """
import os, signal, sys, numpy as np
from pathlib import Path
from cgdb.errors import CgdbError
from cgdb.storage.ledger import Ledger
from cgdb.scene import FeatureSpace, Relation, SceneObject, View
PATH, SIZE = Path(sys.argv[1]), int(sys.argv[2])
CLIP = FeatureSpace(name="clip", dimension=16)
JPEG = bytes([255, 216, 255])

def write(ledger, mark, size=SIZE, **more):
    # Every row of a revision says the same number: a mixture would show.
    with ledger.write("lab", on_existing="replace", spaces=[CLIP], **more) as w:
        w.relations(Relation(source=i, target=(i + 1) % size, label=f"r{mark}") for i in range(size))
        w.objects(
            SceneObject(
                id=i,
                tag=f"r{mark}",
                features={"clip": np.full(16, mark, np.float32)},
                views=(View(frame=mark, points=2, box=(0, 0, 1, 1), image=JPEG + b"%d" % mark),) * 2,
            )
            for i in range(size)
        )
    return w.revision
"""


def script(body: str, path: Path, *, size: int = SIZE) -> subprocess.Popen[str]:
    return started(PROLOGUE + body, path, size)


def assert_whole(ledger: Ledger, revision: int, size: int = SIZE) -> None:
    """Every row of the revision is there, and of no other one."""
    info = ledger.scene("lab", revision)
    mark = revision
    nodes = [node for batch in ledger.nodes(info) for node in batch]
    assert len(nodes) == size and {node.tag for node in nodes} == {f"r{mark}"}
    relations = [row for batch in ledger.relations(info) for row in batch]
    assert len(relations) == size and {row.label for row in relations} == {f"r{mark}"}
    for keys, vectors in ledger.features(info, "clip"):
        assert len(keys) == size and (vectors == mark).all()
    views = [obj.views for obj in ledger.scene_graph(info, features=False, clouds=False, views=True).objects]
    assert {(view.frame, view.image) for two in views for view in two} == {(mark, b"\xff\xd8\xff%d" % mark)}
    assert all(len(two) == 2 for two in views)


ENDLESS = """
with Ledger.open(PATH, create=True) as ledger:
    while True:
        print(write(ledger, ledger.revision() + 1), flush=True)
"""


@pytest.mark.parametrize("times", [3, pytest.param(30, marks=pytest.mark.slow)])
def test_kill_9_at_any_instant(tmp_path: Path, times: int) -> None:
    path = tmp_path / "s.cgdb"
    dice = random.Random(times)
    committed = 0
    for _ in range(times):
        process = script(ENDLESS, path)
        assert process.stdout is not None
        lines = [process.stdout.readline()] if dice.random() < 0.8 else []
        time.sleep(dice.random() * 0.25)
        process.kill()
        rest, err = process.communicate(timeout=60)
        assert "Traceback" not in err
        said = [int(line) for line in [*lines, *rest.splitlines()] if line.strip().isdigit()]
        if not (path / "ledger.sqlite").exists():
            assert not said, "killed before the store was made, and yet it had committed"
            continue
        with Ledger.open(path) as ledger:
            last = ledger.revision()
            assert last >= max([committed, *said]), "a committed revision is lost"
            for revision in range(max(1, committed), last + 1):
                assert_whole(ledger, revision)
            assert [r.id for r in ledger.revisions()] == list(range(1, last + 1))
            committed = last
    assert committed >= times // 2
    with Ledger.open(path) as ledger:
        assert ledger.check() == []


@pytest.mark.parametrize("times", [3, pytest.param(15, marks=pytest.mark.slow)])
def test_ctrl_c_at_any_instant(tmp_path: Path, times: int) -> None:
    path = tmp_path / "s.cgdb"
    dice = random.Random(times)
    body = """
signal.signal(signal.SIGINT, signal.default_int_handler)
with Ledger.open(PATH, create=True) as ledger:
    try:
        print("ready", flush=True)
        while True:
            print(write(ledger, ledger.revision() + 1), flush=True)
    except KeyboardInterrupt:
        # The same process goes on with the same open store.
        last = ledger.revision()
        assert write(ledger, last + 1) == last + 1
        print("after", last + 1, flush=True)
"""
    for _ in range(times):
        process = script(body, path)
        assert process.stdout is not None and process.stdout.readline() == "ready\n"
        time.sleep(dice.random() * 0.2)
        process.send_signal(signal.SIGINT)
        after = finished(process).splitlines()[-1]
        with Ledger.open(path) as ledger:
            assert after == f"after {ledger.revision()}"
            for revision in range(1, ledger.revision() + 1):
                assert_whole(ledger, revision)
            assert ledger.check() == []


# --- damaged bytes ---------------------------------------------------------------------------------------------------


def seen(i: int, turn: int) -> tuple[View, ...]:
    """Nothing, or up to three views; a revision adds one in front."""
    image = b"\xff\xd8\xff" + bytes([i]) * 200
    view = View(frame=i, points=9, box=(1.0, 2.0, 3.0, 4.0), T_world_camera=np.eye(4), source=f"{i}.jpg", image=image)
    return (replace(view, frame=500 + i),) * turn + (view, replace(view, image=None)) if i % 3 == 0 else ()


def build(path: Path) -> None:
    with Ledger.open(path, create=True) as ledger:
        for turn in range(2):
            with ledger.write("lab", on_existing="merge", spaces=[CLIP]) as writer:
                writer.places([Place(id="kitchen", kind="Room", name=f"Kitchen {turn}")])
                writer.objects(
                    SceneObject(
                        id=i,
                        tag=f"thing {i} {turn if i % 3 else 0}",
                        caption="a thing " * 12,
                        center=np.full(3, i + 0.5),
                        confidence=0.5,
                        features={"clip": np.full(16, i, np.float32)},
                        points=np.full((40, 3), i, np.float32) if i % 4 == 0 else None,
                        properties={"state": "open"},
                        views=seen(i, turn),
                    )
                    for i in range(120)
                )
                writer.relations(
                    Relation(source=i, target=(i * 7) % 120, label=f"near{turn if i % 5 else 0}") for i in range(120)
                )
        with ledger.write("other") as writer:
            writer.objects([SceneObject(id=1, tag="untouched")])


Reading = Callable[[Ledger], object]


def _graph(revision: int) -> Reading:
    def read(ledger: Ledger) -> object:
        graph = ledger.scene_graph(ledger.scene("lab", revision), views=True)
        return (
            [
                (
                    o.id,
                    o.tag,
                    o.caption,
                    None if o.center is None else o.center.tolist(),
                    o.confidence,
                    dict(o.properties),
                    {space: vector.tolist() for space, vector in o.features.items()},
                    None if o.points is None else o.points.tolist(),
                    _plain(o.views),
                )
                for o in graph.objects
            ],
            [(p.id, p.kind, p.name) for p in graph.places],
            graph.relations,
        )

    return read


def _plain(views: tuple[View, ...]) -> object:
    return [
        (v.frame, v.points, v.box, None if v.T_world_camera is None else v.T_world_camera.tolist(), v.image, v.source)
        for v in views
    ]


def _some_views(ledger: Ledger) -> object:
    return [_plain(ledger.views(ledger.scene("lab"), key)) for key in (2, 3, 65, 121)]


def _some_nodes(ledger: Ledger) -> object:
    found = ledger.nodes_by_key(ledger.scene("lab"), [1, 5, 60, 121])
    return [(key, node.id, node.tag) for key, node in sorted(found.items())]


def _ids(ledger: Ledger) -> object:
    info = ledger.scene("lab")
    return [None if node is None else (node.key, node.tag) for node in (ledger.node_by_id(info, i) for i in (0, 77))]


def _some_vectors(ledger: Ledger) -> object:
    keys, vectors = ledger.features_by_key(ledger.scene("lab"), "clip", [2, 3, 64, 121])
    return keys.tolist(), vectors.tolist()


READINGS: list[Reading] = [
    _graph(1),
    _graph(2),
    _some_nodes,
    _ids,
    _some_vectors,
    _some_views,
    lambda ledger: ledger.revisions(),
    lambda ledger: ledger.scenes(),
    lambda ledger: ledger.changes(1, 1, 2).relations_added,
]


def outcomes(path: Path) -> list[object]:
    """What each reading gives: its value, or the error."""
    try:
        ledger = Ledger.open(path, read_only=True)
    except CgdbError as error:
        return [error] * len(READINGS)
    results: list[object] = []
    with ledger:
        for reading in READINGS:
            try:
                results.append(reading(ledger))
            except CgdbError as error:
                results.append(error)
    return results


@pytest.mark.parametrize("times", [150, pytest.param(3000, marks=pytest.mark.slow)])
def test_a_flipped_byte_gives_the_right_rows_or_an_error(tmp_path: Path, times: int) -> None:
    path = tmp_path / "s.cgdb"
    build(path)
    file = path / "ledger.sqlite"
    good = file.read_bytes()
    expected = outcomes(path)
    assert not [result for result in expected if isinstance(result, CgdbError)]
    # Bytes that are used: most of a small database is empty space, where a flip proves nothing.
    used = [at for at in range(len(good)) if good[at] != 0]
    dice = random.Random(times)
    noticed = 0
    for at in dice.sample(used, times):
        broken = bytearray(good)
        broken[at] ^= dice.choice([1, 2, 4, 8, 16, 32, 64, 128, 255])
        file.write_bytes(broken)
        for reading, result, right in zip(range(len(READINGS)), outcomes(path), expected, strict=True):
            if isinstance(result, CgdbError):
                assert isinstance(result, CorruptionError), (at, reading, result)
                noticed += 1
            else:
                assert result == right, f"byte {at}: reading {reading} is silently wrong"
    assert noticed > times / 2
    file.write_bytes(good)


def test_one_damaged_row_is_named_and_the_rest_stays_readable(tmp_path: Path) -> None:
    path = tmp_path / "s.cgdb"
    build(path)
    file = path / "ledger.sqlite"
    database = sqlite3.connect(file)
    database.execute("update nodes set tag = 'teapot' where id = '17' and rev_to is null")
    database.execute("update features set vector = zeroblob(64) where key = 3")
    database.commit()
    database.close()
    with Ledger.open(path) as ledger:
        info = ledger.scene("lab")
        with pytest.raises(CorruptionError, match=r"scene 'lab': object #17"):
            list(ledger.nodes(info))
        with pytest.raises(CorruptionError, match=r"feature 'clip' of the object with key 3"):
            list(ledger.features(info, "clip"))
        ok = ledger.node_by_id(info, 18)
        assert ok is not None and ok.id == 18
        assert len(ledger.scene_graph(ledger.scene("other")).objects) == 1
        with pytest.raises(CorruptionError):
            ledger.scene_graph(info)
        graph = ledger.scene_graph(info, skip_damaged=True)
        assert {o.id for o in graph.objects} == set(range(120)) - {17}
        assert len([o for o in graph.objects if not o.features]) == 1
        assert any("#17" in line for line in graph.provenance["damaged"])
        assert [d.what for d in ledger.check() if "#17" in d.message] == ["nodes"]
        assert {d.scene for d in ledger.check(full=False)} == {"lab"}
        with pytest.raises(CorruptionError, match="#17"), ledger.write("lab", on_existing="merge") as writer:
            writer.objects([SceneObject(id=17, tag="new")])
        with ledger.write("lab", on_existing="replace", spaces=[CLIP]) as writer:
            writer.objects(o for o in graph.objects if o.id != 17)
            writer.objects([SceneObject(id=17, tag="healed")])
        assert len(ledger.scene_graph(ledger.scene("lab")).objects) == 120
        assert ledger.check(full=False) == []


@pytest.mark.parametrize(
    ("statement", "reading"),
    [
        ("delete from nodes where id = '17'", lambda ledger, info: list(ledger.nodes(info))),
        ("delete from nodes where id = '17'", lambda ledger, info: ledger.node_by_id(info, 17)),
        ("delete from nodes where key = 17", lambda ledger, info: ledger.nodes_by_key(info, [17])),
        ("delete from relations where source = 17", lambda ledger, info: list(ledger.relations(info))),
        ("delete from features where key = 17", lambda ledger, info: list(ledger.features(info, "clip"))),
        ("delete from clouds", lambda ledger, info: ledger.scene_graph(info)),
        ("update nodes set rev_to = 2 where key = 17", lambda ledger, info: list(ledger.nodes(info))),
        ("update nodes set rev_to = null", lambda ledger, info: list(ledger.nodes(info))),
        ("update features set key = 9000 where key = 9", lambda ledger, info: list(ledger.features(info, "clip"))),
        ("delete from revisions where id = 3", lambda ledger, info: ledger.revision()),
        ("delete from revisions where id = 1", lambda ledger, info: ledger.revisions()),
        ("delete from scene_versions where revision = 2", lambda ledger, info: ledger.scene("lab")),
        ("update scene_versions set n_objects = 5", lambda ledger, info: ledger.scene("lab")),
        ("update scenes set name = 'lap' where name = 'lab'", lambda ledger, info: ledger.scene("lap")),
        ("update scenes set name = 'lap' where name = 'lab'", lambda ledger, info: ledger.scene("lab")),
    ],
)
def test_rows_that_vanish_or_change_are_noticed(
    tmp_path: Path, statement: str, reading: Callable[[Ledger, object], object]
) -> None:
    path = tmp_path / "s.cgdb"
    build(path)
    with Ledger.open(path) as ledger:
        info = ledger.scene("lab")
        reading(ledger, info) if "lap" not in statement else None
        database = sqlite3.connect(path / "ledger.sqlite")
        assert database.execute(statement).rowcount > 0
        database.commit()
        database.close()
        with pytest.raises(CorruptionError):
            reading(ledger, info)
        assert ledger.check() != []


def test_pages_that_sqlite_refuses_do_not_take_the_rest_along(tmp_path: Path) -> None:
    path = tmp_path / "s.cgdb"
    with Ledger.open(path, create=True) as ledger, ledger.write("lab") as writer:
        writer.objects(SceneObject(id=i, caption="a long caption " * 40) for i in range(400))
    file = path / "ledger.sqlite"
    content = bytearray(file.read_bytes())
    page = content.rfind(b"a long caption") // 16384
    content[page * 16384 : page * 16384 + 8] = b"\xff" * 8
    file.write_bytes(content)
    with Ledger.open(path) as ledger:
        info = ledger.scene("lab")
        with pytest.raises(CorruptionError, match="damaged"):
            list(ledger.nodes(info))
        graph = ledger.scene_graph(info, skip_damaged=True)
        assert 200 < len(graph.objects) < 400 and graph.provenance["damaged"]
        assert ledger.check() != []


# --- full disks, other processes, permissions ------------------------------------------------------------------------


def test_disk_full_leaves_the_store_as_it_was(tmp_path: Path) -> None:
    path = tmp_path / "s.cgdb"
    body = """
import resource
signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
with Ledger.open(PATH, create=True) as ledger:
    write(ledger, 1)
    size = max(file.stat().st_size for file in PATH.iterdir())
    resource.setrlimit(resource.RLIMIT_FSIZE, (size + 1_000_000, resource.RLIM_INFINITY))
    try:
        write(ledger, 2, size=200 * SIZE)
    except CgdbError as error:
        print(type(error).__name__, error.render())
    print(ledger.revision(), len(ledger.check()))
"""
    out = finished(script(body, path))
    assert out.startswith("StoreError store error: the disk is full"), out
    assert "the store is as before" in out and out.endswith("1 0\n")
    with Ledger.open(path) as ledger:
        assert ledger.revision() == 1
        assert_whole(ledger, 1)


@pytest.fixture
def small_disk() -> Iterator[Path]:
    folder = Path(tempfile.mkdtemp())
    mounted = subprocess.run(["mount", "-t", "tmpfs", "-o", "size=3m", "tmpfs", str(folder)], capture_output=True)
    if mounted.returncode != 0:
        folder.rmdir()
        pytest.skip("a small disk cannot be mounted here")
    yield folder
    subprocess.run(["umount", "-l", str(folder)], check=True)
    folder.rmdir()


def test_a_really_full_disk(small_disk: Path) -> None:
    path = small_disk / "s.cgdb"
    with Ledger.open(path, create=True) as ledger:
        with ledger.write("small") as writer:
            writer.objects([SceneObject(id=1)])
        with pytest.raises(StoreError, match="the disk is full"), ledger.write("large", spaces=[CLIP]) as writer:
            writer.objects(SceneObject(id=i, caption="x" * 500) for i in range(50_000))
        assert [info.name for info in ledger.scenes()] == ["small"] and ledger.check() == []
    with Ledger.open(path) as ledger:
        assert ledger.revision() == 1
        (small_disk / "filler").write_bytes(b"")
        with ledger.write("second") as writer:
            writer.objects([SceneObject(id=2)])
        assert ledger.revision() == 2


def test_the_second_of_two_writing_processes_waits_then_says_so(tmp_path: Path) -> None:
    path = tmp_path / "s.cgdb"
    Ledger.open(path, create=True).close()
    body = """
with Ledger.open(PATH) as ledger, ledger.write("slow") as w:
    w.objects([SceneObject(id=1)])
    print("holding", flush=True)
    sys.stdin.readline() if False else __import__("time").sleep(1.5)
"""
    process = script(body, path)
    assert process.stdout is not None and process.stdout.readline() == "holding\n"
    with Ledger.open(path, patience=0.2) as impatient:
        began = time.monotonic()
        with pytest.raises(StoreBusyError, match="another process is writing"), impatient.write("fast"):
            pass
        assert 0.1 < time.monotonic() - began < 1.2
    with Ledger.open(path, patience=30) as patient, patient.write("fast") as writer:
        writer.objects([SceneObject(id=1)])
    finished(process)
    with Ledger.open(path) as ledger:
        assert [info.name for info in ledger.scenes()] == ["fast", "slow"] and ledger.revision() == 2


def test_a_reader_sees_whole_revisions_while_another_process_writes(tmp_path: Path) -> None:
    path = tmp_path / "s.cgdb"
    body = """
with Ledger.open(PATH, create=True) as ledger:
    for turn in range(1, 13):
        write(ledger, turn)
        print("done", turn, flush=True)
"""
    process = script(body, path)
    assert process.stdout is not None and process.stdout.readline() == "done 1\n"
    seen = []
    with Ledger.open(path, read_only=True) as ledger:
        while process.poll() is None:
            seen.append(ledger.revision())
            assert_whole(ledger, seen[-1])
        finished(process)
        assert ledger.revision() == 12
    assert seen == sorted(seen) and len(set(seen)) > 1


@pytest.fixture
def shared_folder() -> Iterator[Path]:
    """A folder that every user may enter: pytest's own are private to their owner."""
    folder = Path(tempfile.mkdtemp())
    folder.chmod(0o755)
    yield folder
    subprocess.run(["chmod", "-R", "u+w", str(folder)], check=True)
    shutil.rmtree(folder)


READ_ONLY = """
# Import and open as oneself first: the code itself may lie where only its owner can read.
Ledger.open(PATH.parent / "warm.cgdb", create=True).close()
if os.geteuid() == 0:
    os.setgroups([]); os.setgid(65534); os.setuid(65534)
def attempt(action):
    try:
        print(action())
    except CgdbError as error:
        print(type(error).__name__, error.message)
def use(**more):
    with Ledger.open(PATH, **more) as ledger:
        info = ledger.scene("lab")
        print(ledger.read_only, sum(len(batch) for batch in ledger.nodes(info)))
        write(ledger, 2)
attempt(use)
attempt(lambda: use(read_only=False))
attempt(lambda: Ledger.open(PATH.parent / "new.cgdb", create=True))
"""


def make_read_only(path: Path) -> None:
    for file in path.iterdir():
        file.chmod(0o444)
    path.chmod(0o555)


def test_a_read_only_folder_can_be_read(shared_folder: Path) -> None:
    path = shared_folder / "s.cgdb"
    finished(script("write(Ledger.open(PATH, create=True), 1)", path))
    make_read_only(path)
    (shared_folder / "warm.cgdb").mkdir(mode=0o777)
    lines = finished(script(READ_ONLY, path)).splitlines()
    assert lines[0] == f"True {SIZE}"
    assert "open for reading only" in lines[1]
    assert "StoreError" in lines[2] and "cannot be written: no permission" in lines[2]
    if os.geteuid() == 0:
        assert "StoreError" in lines[3] and "cannot be made" in lines[3]


def test_a_read_only_folder_with_a_log_in_it(shared_folder: Path) -> None:
    """A crashed writer's log holds revisions: they are read, or refused aloud, but never left out."""
    path = shared_folder / "s.cgdb"
    body = """
ledger = Ledger.open(PATH, create=True)
write(ledger, 1)
os.kill(os.getpid(), signal.SIGKILL)
"""
    script(body, path).communicate(timeout=60)
    assert (path / "ledger.sqlite-wal").stat().st_size > 0
    make_read_only(path)
    lines = finished(script(READ_ONLY, path)).splitlines()
    assert lines[0] == f"True {SIZE}" or lines[0].startswith("StoreError"), lines
    path.chmod(0o755)
    (path / "ledger.sqlite-shm").unlink()
    make_read_only(path)
    lines = finished(script(READ_ONLY, path)).splitlines()
    assert lines[0] == f"True {SIZE}" or lines[0].startswith("StoreError"), lines
