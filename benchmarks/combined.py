"""A combined query (``~``, an edge, NOT, a distance, LIMIT) at several sizes, and how the planner chooses its start.

    python -m benchmarks combined [--sizes 1000 10000 100000]

Every query asks other texts about another place. The planner's table carries statements out both ways, from the graph
index and from the vectors, and as the planner chose: the faster way is not the same for all.
"""

from __future__ import annotations

import functools
import time
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

import cgdb
from benchmarks import report, world
from cgdb.database import Database
from cgdb.grammar import ast
from cgdb.index.catalog import Catalog
from cgdb.meaning.embed import Encoder, text_encoder
from cgdb.query import run as flow
from cgdb.query.bound import BoundQuery
from cgdb.query.planner import Plan, Seed, plan

COMBINED = (
    "MATCH (o ~ $wanted)-[:on]->(t) WHERE NOT o ~ $other AND NOT (o)-[:next_to]-({{tag: 'bottle'}}) "
    "AND distance(o, #{here}) < 10 RETURN o, t, distance(o, #{here}) LIMIT 10"
)
STARTS: Mapping[str, str] = {
    "few desks": "MATCH (o ~ $wanted)-[:on]->(t {tag: 'desk'}) WHERE t.price < 2 RETURN o, t LIMIT 10",
    "anything on anything": "MATCH (o ~ $wanted)-[:on]->(t) RETURN o, t LIMIT 10",
}


class TimedEncoder:
    """An encoder that notes how long it is busy."""

    def __init__(self, encoder: Encoder) -> None:
        self._encoder = encoder
        self.name = encoder.name
        self.dimension = encoder.dimension
        self.seconds = 0.0

    def texts(self, texts: Sequence[str]) -> NDArray[np.float32]:
        """(n, d) float32, as the encoder gives them."""
        started = time.perf_counter()
        try:
            return self._encoder.texts(texts)
        finally:
            self.seconds += time.perf_counter() - started


def question(number: int) -> dict[str, str]:
    """Two texts, others for each number below 10,000."""
    wanted = world.QUESTIONS[number % len(world.QUESTIONS)]
    return {"wanted": wanted, "other": f"{world.MATERIALS[number % len(world.MATERIALS)]} thing of {number} parts"}


def combined(db: Database, encoder: TimedEncoder, count: int, rounds: int) -> tuple[list[str], float]:
    """A row of figures at one size, and the median."""
    everything, alone = [], []
    for number in range(rounds + 5):
        statement = COMBINED.format(here=number * 37 % count)
        encoder.seconds = 0.0
        started = time.perf_counter()
        db.query(statement, question(number))
        taken = time.perf_counter() - started
        if number >= 5:
            everything.append(taken)
            alone.append(taken - encoder.seconds)
    whole, rest = report.Times(tuple(everything)), report.Times(tuple(alone))
    figures = (whole.median, whole.percentile(0.99), rest.median, rest.percentile(0.99))
    return [f"{count:,}", str(rounds), *map(report.ms, figures)], whole.median


@contextmanager
def starting(way: str) -> Iterator[None]:
    """Every plan made inside starts there: in the "graph", with the "vectors", or where the "planner" says."""

    def forced(query: BoundQuery, catalog: Catalog) -> Plan:
        made = plan(query, catalog)
        if way == "graph":
            return replace(made, seed=None)
        similar = next(c for c in made.conditions if isinstance(c, ast.Similar))
        return replace(made, seed=Seed(node=similar.variable, meaning=similar.meaning))

    if way != "planner":
        setattr(flow, "plan", forced)  # noqa: B010
    try:
        yield
    finally:
        setattr(flow, "plan", plan)  # noqa: B010


def starts(db: Database, rounds: int) -> list[list[str]]:
    """A row per statement: from the graph, from the vectors, and what the planner chose."""
    rows = []
    for name, statement in STARTS.items():

        def ask(number: int, way: str, text: str = statement) -> None:
            with starting(way):
                db.query(text, wanted=question(number)["wanted"])

        ways = {way: functools.partial(ask, way=way) for way in ("graph", "vectors", "planner")}
        # The texts are asked once before: their degrees are known, and what is left is the way they are used.
        for number in range(rounds):
            ask(number, "planner")
        times = report.alternating(ways, rounds, block=5)
        chosen = db.query(f"EXPLAIN {statement}", wanted=question(0)["wanted"]).plan
        better = min(times["graph"].median, times["vectors"].median)
        medians = [report.ms(times[way].median) for way in ways]
        pick = "vectors" if "vectors: best of" in chosen else "graph"
        rows.append([name, *medians, pick, f"{times['planner'].median / better:.2f}"])
    return rows


def main() -> None:
    parser = report.arguments(__doc__, [1_000, 10_000, 100_000])
    parser.add_argument("--rounds", type=int, default=100, help="queries per size (default: 100)")
    options = parser.parse_args()
    print(report.machine())
    encoder = TimedEncoder(text_encoder())
    rows: list[list[str]] = []
    choices: list[list[str]] = []
    before: float | None = None
    with report.folder_of_stores(options.stores) as folder:
        for count in options.sizes:
            with cgdb.open(world.store(folder, count, encoder), text_encoder=encoder) as db:
                row, median = combined(db, encoder, count, options.rounds)
                rows.append(
                    [*row, "" if before is None else f"x {median / before:.1f}", "20" if count == 10_000 else ""]
                )
                before = median
                choices.extend([f"{count:,}", *line] for line in starts(db, 10 if count >= 100_000 else 20))
    report.table(
        "A combined query in a warm process, ms; each asks two texts never asked before",
        ["objects", "queries", "p50", "p99", "p50 without encoding", "p99 without", "growth of p50", "aim p50"],
        rows,
    )
    report.table(
        "Where to start, ms, median of 20 in turns (10 at 100,000); degrees are known",
        ["objects", "statement", "from the graph", "from the vectors", "as planned", "choice", "x the better way"],
        choices,
    )


if __name__ == "__main__":
    main()
