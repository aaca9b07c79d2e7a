"""Import: objects per second and memory at several sizes, beside bare SQLite; index builds and encoding apart.

    python -m benchmarks importing [--sizes 1000 10000 100000]

Each object has a 512-d vector and three relations. The objects come in batches that are made outside the measured
time; a process of its own for each size tells its peak memory.
"""

from __future__ import annotations

import functools
import itertools
import json
import resource
import sqlite3
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import TypeVar

import numpy as np

import cgdb
from benchmarks import report, world
from cgdb.meaning.embed import text_encoder

T = TypeVar("T")


def peak() -> float:
    """The largest memory that this process had so far, MB."""
    used = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    return used / (1 << 20 if sys.platform == "darwin" else 1 << 10)


class Watch:
    """Adds up the time, and the processor's time, of what is run with it."""

    def __init__(self) -> None:
        self.seconds = 0.0
        self.busy = 0.0

    def run(self, action: Callable[[], object]) -> None:
        """Run and count."""
        started, busy = time.perf_counter(), time.process_time()
        action()
        self.seconds += time.perf_counter() - started
        self.busy += time.process_time() - busy


def batches(stream: Iterator[T]) -> Iterator[list[T]]:
    """The stream in lists of a thousand."""
    while batch := list(itertools.islice(stream, world.BATCH)):
        yield batch


def with_cgdb(folder: Path, count: int) -> dict[str, float]:
    """Write a world in batches, then build its indexes."""
    watch, indexing = Watch(), Watch()
    spaces = [cgdb.FeatureSpace(name=world.SPACE, dimension=world.DIMENSION)]
    with cgdb.open(folder / "bench.cgdb", create=True, text_encoder=None) as db:
        before = peak()
        block = db.write("world", spaces=spaces)
        writer = block.__enter__()
        for objects in batches(world.objects(count)):
            watch.run(functools.partial(writer.objects, objects))
        for relations in batches(world.relations(count)):
            watch.run(functools.partial(writer.relations, relations))
        watch.run(lambda: block.__exit__(None, None, None))
        written = peak()
        indexing.run(db.prepare)
    size = sum(file.stat().st_size for file in (folder / "bench.cgdb").rglob("*") if file.is_file()) / 2**20
    return {
        "seconds": watch.seconds,
        "busy": watch.busy,
        "before": before,
        "peak": written,
        "indexing": indexing.seconds,
        "indexed": peak(),
        "size": size,
    }


def with_sqlite(folder: Path, count: int) -> dict[str, float]:
    """The same rows by the same batches into two plain tables, with the same promises about a power cut."""
    watch = Watch()
    before = peak()
    file = sqlite3.connect(folder / "bench.sqlite", isolation_level=None)
    file.execute("PRAGMA page_size=16384")
    file.execute("PRAGMA journal_mode=WAL")
    file.execute("PRAGMA synchronous=FULL")
    file.execute("CREATE TABLE object (id INTEGER PRIMARY KEY, tag, caption, box, confidence, properties, vector)")
    file.execute("CREATE TABLE relation (source, target, label, confidence, PRIMARY KEY (source, target, label))")
    file.execute("BEGIN IMMEDIATE")
    for objects in batches(world.objects(count)):
        watch.run(functools.partial(_insert_objects, file, objects))
    for relations in batches(world.relations(count)):
        watch.run(functools.partial(_insert_relations, file, relations))
    watch.run(lambda: file.execute("COMMIT"))
    file.close()
    return {"seconds": watch.seconds, "busy": watch.busy, "before": before, "peak": peak()}


def _insert_objects(file: sqlite3.Connection, objects: list[cgdb.SceneObject]) -> None:
    values = [
        (
            o.id,
            o.tag,
            o.caption,
            np.concatenate([o.center, o.extent]).tobytes() if o.center is not None and o.extent is not None else None,
            o.confidence,
            json.dumps(dict(o.properties)),
            o.features[world.SPACE].tobytes(),
        )
        for o in objects
    ]
    file.executemany("INSERT INTO object VALUES (?, ?, ?, ?, ?, ?, ?)", values)


def _insert_relations(file: sqlite3.Connection, relations: list[cgdb.Relation]) -> None:
    values = [(r.source, r.target, r.label, r.confidence) for r in relations]
    file.executemany("INSERT INTO relation VALUES (?, ?, ?, ?)", values)


WRITERS = {"cgdb": with_cgdb, "sqlite": with_sqlite}


def apart(writer: str, count: int) -> dict[str, float]:
    """The figures of a writer in a process of its own."""
    command = [sys.executable, "-m", "benchmarks", "importing", "--writer", writer, "--sizes", str(count)]
    done = subprocess.run(command, stdout=subprocess.PIPE, text=True, check=True)
    figures: dict[str, float] = json.loads(done.stdout)
    return figures


def encoding(count: int) -> list[str]:
    """A row: distinct captions per second, through db.encode, kept in the store."""
    with tempfile.TemporaryDirectory(prefix="cgdb-bench-") as made, cgdb.open(Path(made) / "it", create=True) as db:
        world.write(db, count)
        db.prepare()
        text_encoder().texts(["a text to warm up with"])
        started = time.perf_counter()
        total = list(db.encode())[-1][1]
        seconds = time.perf_counter() - started
    return [f"{total:,}", f"{seconds:.1f}", f"{total / seconds:,.0f}"]


def main() -> None:
    parser = report.arguments(__doc__, [1_000, 10_000, 100_000])
    parser.add_argument("--texts", type=int, default=2_000, help="objects whose texts are encoded (default: 2,000)")
    parser.add_argument("--writer", choices=sorted(WRITERS), help="write one world and print its figures as JSON")
    options = parser.parse_args()
    if options.writer:
        with tempfile.TemporaryDirectory(prefix="cgdb-bench-") as folder:
            print(json.dumps(WRITERS[options.writer](Path(folder), options.sizes[0])))
        return
    print(report.machine())
    rows = []
    for count in options.sizes:
        bare, ours = apart("sqlite", count), apart("cgdb", count)
        rows.append(
            [
                f"{count:,}",
                f"{ours['seconds']:.2f}",
                f"{count / ours['seconds']:,.0f}",
                f"{count / ours['busy']:,.0f}",
                f"{count / bare['seconds']:,.0f}",
                f"{count / bare['busy']:,.0f}",
                f"{ours['peak']:.0f}",
                f"{ours['peak'] - ours['before']:.0f}",
                f"{bare['peak'] - bare['before']:.0f}",
                f"{ours['indexing']:.2f}",
                f"{ours['indexed']:.0f}",
                f"{ours['size']:.0f}",
                "10,000 /s" if count == 100_000 else "",
            ]
        )
    report.table(
        f"Import in batches of {world.BATCH:,}, {world.DIMENSION}-d vectors, 3 relations per object, one revision",
        [
            "objects",
            "s",
            "objects/s",
            "per processor s",
            "bare SQLite /s",
            "per processor s",
            "peak MB",
            "of it import",
            "bare SQLite",
            "index build s",
            "peak MB then",
            "store MB",
            "aim",
        ],
        rows,
    )
    report.table("Texts encoded and kept (db.encode)", ["distinct texts", "s", "texts/s"], [encoding(options.texts)])


if __name__ == "__main__":
    main()
