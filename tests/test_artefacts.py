"""Derived files: found, verified, rebuilt when harmed, whoever else builds, dies or forbids writing."""

from __future__ import annotations

import os
import random
import signal
import subprocess
import sys
import textwrap
import time
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from cgdb.errors import StoreError
from cgdb.index.artefacts import Artefacts
from cgdb.index.graph import GraphIndex
from cgdb.index.vectors import VectorIndex
from cgdb.storage.rows import NodeRow

PRELUDE = """
import os, sys, time
from pathlib import Path
from cgdb.index.artefacts import Artefacts
def build(path):
    path.write_bytes(b"x" * 3_000_000)
    return {"by": os.getpid()}
"""


class Builder:
    """Counts how often it is asked."""

    def __init__(self, content: bytes = b"content" * 1000) -> None:
        self.content = content
        self.calls = 0

    def __call__(self, path: Path) -> Mapping[str, Any]:
        self.calls += 1
        path.write_bytes(self.content)
        return {"n": len(self.content)}


def python(code: str, *arguments: str, **options: Any) -> subprocess.Popen[str]:
    return subprocess.Popen(
        [sys.executable, "-c", PRELUDE + textwrap.dedent(code), *arguments],
        stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, **options,
    )  # fmt: skip


def finished(process: subprocess.Popen[str]) -> str:
    out, err = process.communicate(timeout=60)
    assert process.returncode == 0, err
    return out.strip()


def pair(folder: Path) -> tuple[Path, Path]:
    (sidecar,) = folder.glob("*.json")
    (data,) = (p for p in folder.iterdir() if p.suffix != ".json")
    return data, sidecar


def test_built_once_and_found_again(tmp_path: Path) -> None:
    build = Builder()
    first = Artefacts(tmp_path / "index", writable=True)
    made = first.get("graph", 1, 5, build)
    assert made.path.read_bytes() == build.content and made.meta == {"n": 7000}
    assert first.get("graph", 1, 5, build) == made
    again = Artefacts(tmp_path / "index", writable=True)
    assert again.get("graph", 1, 5, build) == made
    assert build.calls == 1 and first.rebuilt == again.rebuilt == [] and again.check() == []
    assert len(list((tmp_path / "index").iterdir())) == 2


def test_kinds_of_any_name_stay_apart(tmp_path: Path) -> None:
    store = Artefacts(tmp_path, writable=True)
    kinds = ["clip", "Clip", "CLIP", "a/b", "../a", "a b", "é", "", "~", "x" * 300, "x" * 299, ".json", "a.json"]
    made = {k: store.get(k, 1, 1, Builder(k.encode())).path for k in kinds}
    assert len({p.name.lower() for p in made.values()}) == len(kinds)
    assert all(p.parent == tmp_path and p.read_bytes() == k.encode() for k, p in made.items())
    again = Artefacts(tmp_path, writable=True)
    assert all(again.get(k, 1, 1, Builder()).path == p for k, p in made.items())


def harm_nothing_left(path: Path) -> None:
    path.unlink()


def harm_half(path: Path) -> None:
    path.write_bytes(path.read_bytes()[: path.stat().st_size // 2])


def harm_empty(path: Path) -> None:
    path.write_bytes(b"")


def harm_longer(path: Path) -> None:
    path.write_bytes(path.read_bytes() + b"\0")


def harm_one_bit(path: Path) -> None:
    data = bytearray(path.read_bytes())
    data[random.Random(len(data)).randrange(len(data))] ^= 16
    path.write_bytes(bytes(data))


HARMS = [harm_nothing_left, harm_half, harm_empty, harm_longer, harm_one_bit]


@pytest.mark.parametrize("harm", HARMS)
def test_harm_to_the_data_is_noticed_and_repaired(tmp_path: Path, harm: Any) -> None:
    build = Builder()
    Artefacts(tmp_path, writable=True).get("graph", 1, 5, build)
    harm(pair(tmp_path)[0])
    store = Artefacts(tmp_path, writable=True)
    assert len(store.check()) == 1
    assert store.get("graph", 1, 5, build).path.read_bytes() == build.content
    assert build.calls == 2 and len(store.rebuilt) == 1 and "\n" not in store.rebuilt[0]
    store.sweep({(1, 5)})
    assert store.check() == []


@pytest.mark.parametrize("harm", HARMS)
def test_harm_to_the_description_is_noticed_and_repaired(tmp_path: Path, harm: Any) -> None:
    build = Builder()
    Artefacts(tmp_path, writable=True).get("graph", 1, 5, build)
    harm(pair(tmp_path)[1])
    store = Artefacts(tmp_path, writable=True)
    assert store.get("graph", 1, 5, build).path.read_bytes() == build.content
    assert build.calls == 2


def test_every_flipped_bit_of_a_description_is_noticed(tmp_path: Path) -> None:
    Artefacts(tmp_path, writable=True).get("graph", 1, 5, Builder())
    sidecar = pair(tmp_path)[1]
    good = sidecar.read_bytes()
    for place in range(len(good)):
        sidecar.write_bytes(good[:place] + bytes([good[place] ^ 1]) + good[place + 1 :])
        store = Artefacts(tmp_path, writable=False)
        made = store.get("graph", 1, 5, Builder(b"new"))
        assert made.path.read_bytes() in (b"new", b"content" * 1000)


def test_a_description_cannot_point_elsewhere(tmp_path: Path) -> None:
    store = Artefacts(tmp_path, writable=True)
    store.get("graph", 1, 5, Builder(b"five"))
    store.get("graph", 1, 6, Builder(b"six"))
    one, other = sorted(tmp_path.glob("*.json"))
    one.write_bytes(other.read_bytes())
    fresh = Artefacts(tmp_path, writable=True)
    assert fresh.get("graph", 1, 5, Builder(b"five")).path.read_bytes() == b"five"
    assert len(fresh.rebuilt) == 1


def node(key: int) -> NodeRow:
    return NodeRow(
        key=key, id=key, label="Object", tag=f"t{key}", tags=(), caption=None, center=None, extent=None,
        rotation=None, n_observations=None, confidence=None, properties={},
    )  # fmt: skip


@pytest.mark.parametrize("harm", HARMS)
def test_a_harmed_index_gives_the_right_answer(tmp_path: Path, harm: Any) -> None:
    matrix = np.eye(8, dtype=np.float32)

    def graph(path: Path) -> Mapping[str, Any]:
        return GraphIndex.build(path, iter([[node(k) for k in range(50)]]), iter(()), {})

    def vectors(path: Path) -> Mapping[str, Any]:
        return VectorIndex.build(path, 8, iter([(np.arange(8), matrix)]))

    def answers(store: Artefacts) -> tuple[Any, Any]:
        index = GraphIndex.open(store.get(GraphIndex.kind(), 1, 1, graph).path)
        tags = index.run("MATCH (n:Node) WHERE n.key = 7 RETURN n.tag").data[0]
        index.close()
        made = store.get("vectors", 1, 1, vectors)
        return tags, VectorIndex.open(made.path, made.meta).search(matrix[3], 1)[0].tolist()

    assert answers(Artefacts(tmp_path, writable=True)) == (["t7"], [3])
    for path in list(tmp_path.iterdir()):
        if path.suffix != ".json":
            harm(path)
    store = Artefacts(tmp_path, writable=True)
    assert answers(store) == (["t7"], [3]) and len(store.rebuilt) == 2


def test_a_failed_build_leaves_nothing(tmp_path: Path) -> None:
    def fail(path: Path) -> Mapping[str, Any]:
        path.write_bytes(b"half")
        path.with_name(path.name + ".wal").write_bytes(b"log")
        path.with_name(path.name + ".load").mkdir()
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        Artefacts(tmp_path, writable=True).get("graph", 1, 5, fail)
    assert list(tmp_path.iterdir()) == []
    with pytest.raises(StoreError, match="wrote no file"):
        Artefacts(tmp_path, writable=True).get("graph", 1, 5, lambda path: {})


def test_the_newest_older_file(tmp_path: Path) -> None:
    store = Artefacts(tmp_path, writable=True)
    for scene, revision in ((1, 2), (1, 10), (1, 9), (2, 8)):
        store.get("graph", scene, revision, Builder(f"{scene} {revision}".encode()))
    store.get("graph-b", 1, 8, Builder(b"another kind"))

    def before(revision: int) -> bytes | None:
        found = store.previous("graph", 1, revision)
        return found.path.read_bytes() if found else None

    assert [before(r) for r in (2, 3, 10, 11, 99)] == [None, b"1 2", b"1 9", b"1 10", b"1 10"]
    next(tmp_path.glob("s1-r10-graph~*")).write_bytes(b"harm")
    assert Artefacts(tmp_path, writable=True).previous("graph", 1, 99) == store.previous("graph", 1, 10)


def test_sweeping(tmp_path: Path) -> None:
    store = Artefacts(tmp_path, writable=True)
    kept = store.get("graph", 1, 6, Builder())
    store.get("graph", 1, 5, Builder())
    host = kept.path.name.split("~")[1].split("-")[0]
    stranger = tmp_path / "notes.txt"
    stranger.write_text("not ours")
    mine = tmp_path / f"s1-r7-graph~{host}-{os.getpid()}-aaaa"
    dead = tmp_path / f"s1-r7-graph~{host}-{2**22 + 5}-bbbb.wal"
    elsewhere = tmp_path / f"s1-r7-graph~00000000-{2**22 + 5}-cccc"
    old = tmp_path / f"s1-r7-graph~00000000-{2**22 + 5}-dddd"
    for path in (mine, dead, elsewhere, old):
        path.write_bytes(b"unfinished")
    os.utime(old, (time.time() - 7200,) * 2)
    store.sweep({(1, 6)})
    left = {p.name for p in tmp_path.iterdir()}
    assert left == {kept.path.name, "s1-r6-graph.json", "notes.txt", mine.name, elsewhere.name}
    assert store.get("graph", 1, 6, Builder()) == kept


def test_many_processes_build_the_same(tmp_path: Path) -> None:
    code = """
    store = Artefacts(Path(sys.argv[1]), writable=True)
    made = store.get("graph", 1, 5, build)
    assert made.path.read_bytes() == b"x" * 3_000_000 and not store.rebuilt
    """
    for process in [python(code, str(tmp_path)) for _ in range(4)]:
        finished(process)
    store = Artefacts(tmp_path, writable=True)
    build = Builder()
    store.get("graph", 1, 5, build)
    assert build.calls == 0 and store.check() == []


def test_a_builder_killed_at_any_instant(tmp_path: Path) -> None:
    code = """
    def slow(path):
        with path.open("wb") as file:
            for _ in range(30):
                file.write(b"x" * 100_000); file.flush(); time.sleep(0.002)
        return {}
    store = Artefacts(Path(sys.argv[1]), writable=True)
    print("ready", flush=True)
    for revision in range(1000):
        store.get("graph", 1, revision, slow)
    """
    rng = random.Random(3)
    for _ in range(6):
        process = python(code, str(tmp_path))
        assert process.stdout is not None
        process.stdout.readline()
        time.sleep(rng.random() * 0.3)
        process.send_signal(signal.SIGKILL)
        process.communicate()
    store = Artefacts(tmp_path, writable=True)
    assert store.check() == []
    store.sweep({(1, r) for r in range(1000)})
    assert all(p.suffix == ".json" or p.stat().st_size == 3_000_000 for p in tmp_path.iterdir())


@pytest.mark.skipif(os.name == "nt" or os.getuid() != 0, reason="needs to become another user")
def test_a_folder_that_is_not_ours(tmp_path: Path) -> None:
    for folder in (tmp_path, *tmp_path.parents):
        if str(folder.name).startswith(("pytest", "popen", "test_")):  # pytest's own, closed to others
            folder.chmod(0o755)
    code = """
    store = Artefacts(Path(sys.argv[1]), writable=True)
    os.setgid(65534); os.setuid(65534)
    made = store.get("graph", 1, 5, build)
    assert made.path.stat().st_size == 3_000_000 and store.get("graph", 1, 5, build) == made
    print(made.path)
    """
    private = Path(finished(python(code, str(tmp_path))))
    assert not private.is_relative_to(tmp_path) and not private.parent.exists()
    assert list(tmp_path.iterdir()) == []


def test_a_store_opened_for_reading_is_not_written(tmp_path: Path) -> None:
    store = Artefacts(tmp_path / "index", writable=False)
    made = store.get("graph", 1, 5, Builder())
    assert made.path.is_file() and not (tmp_path / "index").exists() and store.sweep(set()) == []
    store.close()
    assert not made.path.exists()


@pytest.mark.skipif(os.name == "nt", reason="resource limits are POSIX")
def test_a_full_disk(tmp_path: Path) -> None:
    code = """
    import resource, signal
    signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
    from cgdb.errors import StoreError
    resource.setrlimit(resource.RLIMIT_FSIZE, (1_000_000, 1_000_000))
    try:
        Artefacts(Path(sys.argv[1]), writable=True).get("graph", 1, 5, build)
    except StoreError as error:
        print(error.message)
    """
    assert "an index can be written neither into" in finished(python(code, str(tmp_path)))
    assert list(tmp_path.iterdir()) == []
