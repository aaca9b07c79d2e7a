"""What CGQL costs by itself: parsing, planning, and a whole query beside the bare calls that it comes down to.

    python -m benchmarks overhead [--objects 1000]

The bare calls of a statement are noted while it runs: the Cypher that went to the graph engine, and the matrix
products of its ``~``. They are then made again by themselves, in turns with the whole statement.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping
from typing import Any
from unittest import mock

import numpy as np

import cgdb
from benchmarks import report, world
from cgdb.binder import bind
from cgdb.database import Database
from cgdb.grammar.parser import parse
from cgdb.planner import plan

STATEMENTS: Mapping[str, str] = {
    "similar": "MATCH (o ~ $p) RETURN o LIMIT 10",
    "edge": "MATCH (o ~ $p)-[:on]->(t {tag: 'desk'}) RETURN o, t LIMIT 10",
    "not": "MATCH (o ~ $p) WHERE NOT (o)-[:on]->({tag: 'table'}) RETURN o LIMIT 10",
    "distance": "MATCH (o) WHERE distance(o, #12) < 150 cm RETURN o ORDER BY distance(o, #12) LIMIT 10",
    "combined": (
        "MATCH (o ~ $p)-[:on]->(t {tag: 'desk'}) WHERE NOT (o)-[:next_to]-({tag: 'cup'}) AND distance(o, #12) < 20 "
        "RETURN o, t LIMIT 10"
    ),
    "values": "MATCH (o)-[:on]->(t) WHERE o.price > 50 RETURN o.tag, t.tag, o.price ORDER BY o.price DESC LIMIT 10",
    "count": "MATCH (o)-[:on]->(t) RETURN t.tag, count(o) ORDER BY count(o) DESC",
}
TYPICAL = (
    'MATCH (o ~ "potted plant") RETURN o',
    'MATCH (o ~ "something to drink") WHERE NOT o ~ "soda" RETURN o LIMIT 3',
    'MATCH (p ~ "pillow")-[:on]->(c ~ "couch")-[:next_to]-(w ~ "window") RETURN p, c',
    'MATCH (b ~ "book") WHERE NOT (b)-[:in]->(~ "shelf") RETURN b.id, b.caption',
    'MATCH (l ~ "lamp") WHERE distance(l, #12) < 150 cm RETURN l ORDER BY distance(l, #12)',
    'MATCH (t)<-[:on]-(o ~ "chair") RETURN t.tag, count(o) ORDER BY count(o) DESC',
    'MATCH (o) WHERE o ~ "rigid" AND NOT o ~ "cushion" AND volume(o) < 0.1 RETURN o LIMIT 20',
    'EXPLAIN MATCH (o ~ "cup")-[:on]->(t ~ "table") RETURN o',
)


def stages(db: Database) -> list[list[str]]:
    """How long the stages before execution take, over typical statements."""
    catalog = db.view("world").catalog
    numbered = [text.replace('"', f'"{i} ', 1) for i in range(125) for text in TYPICAL]
    trees = [parse(text) for text in TYPICAL]
    bound = [bind(tree, catalog, {}) for tree in trees]
    kinds: dict[str, tuple[Callable[[], Any], int, str]] = {
        "parse, texts that differ": (lambda: [parse(text) for text in numbered], len(numbered), "0.1"),
        "bind": (lambda: [bind(tree, catalog, {}) for tree in trees], len(trees), ""),
        "plan": (lambda: [plan(query, catalog) for query in bound], len(bound), "2"),
    }
    rows = []
    for name, (run, count, aim) in kinds.items():
        times = []
        for _ in range(11):
            started = time.perf_counter()
            run()
            times.append((time.perf_counter() - started) / count)
        median = report.Times(tuple(times)).median
        rows.append([name, f"{1000 * median:.3f}", f"{1 / median:,.0f}", aim])
    return rows


def overhead(db: Database, rounds: int) -> list[list[str]]:
    """A row per statement: the whole of it, its bare calls, and the difference."""
    view = db.view("world")
    matrix = np.array([o.features[world.SPACE] for o in world.objects(len(view.columns.keys))])
    matrix /= np.linalg.norm(matrix, axis=1, keepdims=True)
    store: Any = view.graph._store
    rows = []
    for name, statement in STATEMENTS.items():
        pictures = np.random.default_rng(8).standard_normal((rounds + 10, world.DIMENSION)).astype(np.float32)

        def whole(number: int, text: str = statement, asked: Any = pictures) -> None:
            db.query(text, **({"p": asked[number]} if "$p" in text else {}))

        whole(0)
        calls = []
        for number in range(rounds):
            with mock.patch.object(store, "execute", wraps=store.execute) as noted:
                whole(number)
            calls.append([call.args for call in noted.call_args_list])

        def bare(number: int, text: str = statement, asked: Any = pictures, made: Any = calls) -> None:
            for arguments in made[number]:
                store.execute(*arguments)
            if "$p" in text:
                similar = matrix @ (asked[number] / np.linalg.norm(asked[number]))
                np.argsort(-similar)

        view.degrees.refresh()
        whole(0)
        times = report.alternating({"whole": whole, "bare": bare}, rounds)
        more = np.array(times["whole"].seconds) - np.array(times["bare"].seconds)
        rows.append(
            [
                name,
                f"{np.mean([len(c) for c in calls]):.0f}",
                report.ms(times["whole"].median),
                report.ms(times["bare"].median),
                report.ms(float(np.median(more))),
                report.ms(float(np.percentile(more, 90))),
                "3",
            ]
        )
    return rows


def main() -> None:
    parser = report.arguments(__doc__)
    parser.add_argument("--objects", type=int, default=1_000, help="objects in the store (default: 1,000)")
    parser.add_argument("--rounds", type=int, default=60, help="queries per statement (default: 60)")
    options = parser.parse_args()
    print(report.machine())
    with (
        report.folder_of_stores(options.stores) as folder,
        cgdb.open(world.store(folder, options.objects, None), text_encoder=None) as db,
    ):
        before, queries = stages(db), overhead(db, options.rounds)
    report.table(
        f"Before execution, {len(TYPICAL)} typical statements, median of 11 runs",
        ["stage", "ms per statement", "statements/s", "aim ms"],
        before,
    )
    report.table(
        f"Whole queries beside the Cypher and NumPy calls that they make, {options.objects:,} objects, ms, "
        f"p50 of {options.rounds} each",
        ["statement", "Cypher calls", "whole", "bare calls", "overhead p50", "overhead p90", "aim p50"],
        queries,
    )


if __name__ == "__main__":
    main()
