"""How the benchmarks measure and print: competitors take turns in one run, so that what disturbs one disturbs all."""

from __future__ import annotations

import argparse
import os
import platform
import statistics
import sys
import tempfile
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

import numpy as np


@dataclass(frozen=True, slots=True)
class Times:
    """Seconds of one thing, measured several times."""

    seconds: tuple[float, ...]

    @property
    def median(self) -> float:
        """The middle one."""
        return statistics.median(self.seconds)

    def percentile(self, share: float) -> float:
        """The time that this share of the runs stayed below."""
        return float(np.percentile(self.seconds, 100 * share))


def alternating(competitors: Mapping[str, Callable[[int], object]], rounds: int, block: int = 10) -> dict[str, Times]:
    """Each competitor ``rounds`` times, in turns of ``block`` calls; each call is given its number.

    In blocks, because the threads of one library keep a processor busy for a while after it has answered; the first
    call of each block is not counted.
    """
    taken: dict[str, list[float]] = {name: [] for name in competitors}
    for start in range(0, rounds, block):
        for name, run in competitors.items():
            run(start)
            for number in range(start, min(start + block, rounds)):
                started = time.perf_counter()
                run(number)
                taken[name].append(time.perf_counter() - started)
    return {name: Times(tuple(seconds)) for name, seconds in taken.items()}


def table(title: str, header: Sequence[str], rows: Sequence[Sequence[object]]) -> None:
    """Print a table: the first column to the left, the others to the right."""
    cells = [list(map(str, header)), *([str(cell) for cell in row] for row in rows)]
    widths = [max(len(row[i]) for row in cells) for i in range(len(header))]
    print(f"\n{title}")
    for first, *others in cells:
        print("  ".join(["", first.ljust(widths[0]), *map(str.rjust, others, widths[1:])]))
    sys.stdout.flush()


def ms(seconds: float) -> str:
    """Seconds as milliseconds with two figures that matter."""
    value = 1000 * seconds
    return f"{value:.0f}" if value >= 100 else f"{value:.1f}" if value >= 10 else f"{value:.2f}"


def machine() -> str:
    """The machine and the versions that the figures belong to."""
    packages = []
    for name in ("numpy", "faiss-cpu", "kuzu", "sqlalchemy"):
        try:
            packages.append(f"{name} {version(name)}")
        except PackageNotFoundError:
            packages.append(f"{name} absent")
    load = f", load {os.getloadavg()[0]:.1f}" if hasattr(os, "getloadavg") else ""
    return f"{os.cpu_count()} processors{load}, Python {platform.python_version()}, {', '.join(packages)}"


def arguments(description: str | None, sizes: Sequence[int] | None = None) -> argparse.ArgumentParser:
    """The options that all benchmarks share: where stores are made and how large they are."""
    parser = argparse.ArgumentParser(description=(description or "").partition("\n")[0])
    parser.add_argument(
        "--stores", type=Path, metavar="FOLDER", help="make the stores there, and use those that are there already"
    )
    if sizes is not None:
        parser.add_argument("--sizes", type=int, nargs="+", default=list(sizes), metavar="N", help="objects per store")
    return parser


@contextmanager
def folder_of_stores(given: Path | None) -> Iterator[Path]:
    """The folder that was given, or one that is removed afterwards."""
    if given is not None:
        given.mkdir(parents=True, exist_ok=True)
        yield given
        return
    with tempfile.TemporaryDirectory(prefix="cgdb-bench-") as made:
        yield Path(made)
