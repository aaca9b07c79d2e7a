"""What CGQL costs by itself: parsing, planning, and whole queries beside the same done by hand.

    python -m benchmarks overhead [--objects 1000]

By hand: Cypher of the graph engine for nodes and edges, NumPy for vectors, distances, order and the cut; the answer is
keys and scores, without the records, the reasons and the checks of the query. Both take turns.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

import cgdb
from benchmarks import report, world
from cgdb.database import Database
from cgdb.grammar.parser import parse
from cgdb.query.binder import bind
from cgdb.query.planner import plan

ON = "MATCH (o:Node)-[r:Rel]->(t:Node) WHERE r.label = 'on'"
STATEMENTS: Mapping[str, tuple[str, tuple[str, ...]]] = {
    "similar": ("MATCH (o ~ $p) RETURN o LIMIT 10", ()),
    "edge": (
        "MATCH (o ~ $p)-[:on]->(t {tag: 'desk'}) RETURN o, t LIMIT 10",
        (f"{ON} AND t.tag = 'desk' RETURN o.key, t.key",),
    ),
    "not": (
        "MATCH (o ~ $p) WHERE NOT (o)-[:on]->({tag: 'table'}) RETURN o LIMIT 10",
        (f"{ON} AND t.tag = 'table' RETURN o.key",),
    ),
    "distance": ("MATCH (o) WHERE distance(o, #12) < 150 cm RETURN o ORDER BY distance(o, #12) LIMIT 10", ()),
    "combined": (
        "MATCH (o ~ $p)-[:on]->(t {tag: 'desk'}) WHERE NOT (o)-[:next_to]-({tag: 'cup'}) AND distance(o, #12) < 20 "
        "RETURN o, t LIMIT 10",
        (
            f"{ON} AND t.tag = 'desk' RETURN o.key, t.key",
            "MATCH (o:Node)-[r:Rel]-(t:Node) WHERE r.label = 'next_to' AND t.tag = 'cup' RETURN DISTINCT o.key",
        ),
    ),
    "values": (
        "MATCH (o)-[:on]->(t) WHERE o.price > 50 RETURN o.tag, t.tag, o.price ORDER BY o.price DESC LIMIT 10",
        (f"{ON} AND o.p_price > 50 RETURN o.tag, t.tag, o.p_price ORDER BY o.p_price DESC LIMIT 10",),
    ),
    "count": (
        "MATCH (o)-[:on]->(t) RETURN t.tag, count(o) ORDER BY count(o) DESC",
        (f"{ON} RETURN t.tag, count(o.key) AS c ORDER BY c DESC",),
    ),
}
"""{name: (CGQL, the Cypher that its graph part comes down to)}."""
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
    """A row per statement: the whole of it, the same by hand, and the difference."""
    view = db.view("world")
    matrix = np.array([o.features[world.SPACE] for o in world.objects(len(view.columns.keys))])
    matrix /= np.linalg.norm(matrix, axis=1, keepdims=True)
    centers = view.columns.boxes.centers
    store: Any = view.graph._store
    pictures = np.random.default_rng(8).standard_normal((rounds, world.DIMENSION)).astype(np.float32)
    rows = []
    for name, (statement, cypher) in STATEMENTS.items():

        def whole(number: int, text: str = statement) -> None:
            db.query(text, **({"p": pictures[number]} if "$p" in text else {}))

        def by_hand(number: int, text: str = statement, made: tuple[str, ...] = cypher) -> None:
            found = [store.execute(one)[2] for one in made]
            keep = np.ones(len(matrix), bool)
            for table in found if "$p" in text else ():
                keep[[row[0] for row in table]] = False
            if "distance" in text:
                keep &= np.linalg.norm(centers - centers[12], axis=1) < 20
            if "$p" in text:
                similar = matrix @ (pictures[number] / np.linalg.norm(pictures[number]))
                np.argsort(np.where(keep, -similar, 1.0))[:10].tolist()

        times = report.alternating({"whole": whole, "by hand": by_hand}, rounds)
        more = np.array(times["whole"].seconds) - np.array(times["by hand"].seconds)
        figures = (times["whole"].median, times["by hand"].median, np.median(more), np.percentile(more, 90))
        rows.append([name, *(report.ms(float(figure)) for figure in figures), "3"])
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
        f"Whole queries beside the same done by hand, {options.objects:,} objects, ms, median of {options.rounds} each",
        ["statement", "CGQL", "by hand", "overhead p50", "overhead p90", "aim p50"],
        queries,
    )


if __name__ == "__main__":
    main()
