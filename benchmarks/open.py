"""How long a fresh process takes from its first import to its first answer, over a store whose indexes are there.

    python -m benchmarks open [--objects 1000] [--runs 9]

With a text and its encoder, and with a vector and no encoder; what it spends where. To compare: the reference
implementation of ConceptGraphs takes 5.6 to 9.8 s to open a map of 25 to 100 objects.
"""

from __future__ import annotations

import json
import os
import statistics
import subprocess
import sys
import time
from collections.abc import Mapping, Sequence
from pathlib import Path

from benchmarks import report, world
from cgdb.meaning.embed import TEXT_MODEL, text_encoder

ANSWER = """
import json, sys, time
path, encoder, first, second = sys.argv[1:]
t0 = time.perf_counter()
import cgdb
db = cgdb.open(path, text_encoder=encoder or None)
t1 = time.perf_counter()
picture = [((i * 37) % 101 - 50) / 50 for i in range(512)]
result = db.query(first, **({"picture": picture} if "$picture" in first else {}))
t2 = time.perf_counter()
assert len(result) == 5, result.rows
assert not any("caption" in line for line in result.warnings), result.warnings
t3 = time.perf_counter()
db.query(second, **({"picture": picture[::-1]} if "$picture" in second else {}))
t4 = time.perf_counter()
stages = {f"  {name}": seconds for name, seconds in result.timings.items()}
print(json.dumps({"import, open": t1 - t0, "first query": t2 - t1, **stages, "all": t2 - t0, "second query": t4 - t3}))
"""
TEXT = ('MATCH (o ~ "a cup to drink from") RETURN o LIMIT 5', 'MATCH (o ~ "something to sit on") RETURN o LIMIT 5')
PICTURE = ("MATCH (o ~ $picture) RETURN o LIMIT 5",) * 2
EDGE = ("MATCH (o ~ $picture)-[:on]->(t {tag: 'table'}) RETURN o LIMIT 5",) * 2


def fresh(code: str, arguments: Sequence[str], bytecode: Path) -> tuple[dict[str, float], float]:
    """What the code printed in a process of its own, and the seconds of the whole process.

    bytecode: where it finds its modules compiled, as pip leaves those that it installs.
    """
    environment = {**os.environ, "PYTHONDONTWRITEBYTECODE": "", "PYTHONPYCACHEPREFIX": str(bytecode)}
    command = [sys.executable, "-c", code, *arguments]
    started = time.perf_counter()
    done = subprocess.run(command, stdout=subprocess.PIPE, text=True, check=True, env=environment)
    whole = time.perf_counter() - started
    printed: dict[str, float] = json.loads(done.stdout) if done.stdout else {}
    return printed, whole


def medians(runs: Sequence[tuple[Mapping[str, float], float]]) -> dict[str, float]:
    """The median of each figure over the runs."""
    figures = {name: statistics.median(run[name] for run, _ in runs) for name in runs[0][0]}
    figures["whole process"] = statistics.median(whole for _, whole in runs)
    return figures


def main() -> None:
    parser = report.arguments(__doc__)
    parser.add_argument("--objects", type=int, default=1_000, help="objects in the store (default: 1,000)")
    parser.add_argument("--runs", type=int, default=9, help="fresh processes of each kind (default: 9)")
    options = parser.parse_args()
    print(report.machine())
    with report.folder_of_stores(options.stores) as folder:
        path = world.store(folder, options.objects, text_encoder())
        kinds: dict[str, tuple[str, list[str], float | None]] = {
            "text, encoder": (ANSWER, [str(path), TEXT_MODEL, *TEXT], 1.5),
            "vector": (ANSWER, [str(path), "", *PICTURE], 0.4),
            "vector, edge": (ANSWER, [str(path), "", *EDGE], 0.4),
            "bare python": ("pass", [], None),
        }
        runs: dict[str, list[tuple[dict[str, float], float]]] = {name: [] for name in kinds}
        for run in range(-1, options.runs):
            for name, (code, given, _) in kinds.items():
                taken = fresh(code, given, folder / "bytecode")
                if run >= 0:
                    runs[name].append(taken)
    figures = {name: medians(found) for name, found in runs.items()}
    steps = list(dict.fromkeys(step for taken in figures.values() for step in taken))
    rows = [[step, *(report.ms(taken[step]) if step in taken else "" for taken in figures.values())] for step in steps]
    rows.append(["aim for all", *("" if aim is None else report.ms(aim) for _, _, aim in kinds.values())])
    table = f"Fresh process, {options.objects:,} objects, ms, median of {options.runs} processes each"
    report.table(table, ["step", *kinds], rows)


if __name__ == "__main__":
    main()
