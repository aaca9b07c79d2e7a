"""The graph index on both engines: any text, the same answers after catching up, and nothing but reading."""

from __future__ import annotations

import importlib.util
import os
import random
import subprocess
import sys
import threading
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from cgdb.errors import CgdbError, ExecuteError, LimitError, QueryCancelled, StoreError, UsageError
from cgdb.index.engine import engine
from cgdb.index.graph import GraphIndex, property_column
from cgdb.storage.rows import NodeRow, RelationRow

COLUMNS = {"colour": "STRING", "uses": "STRING[]", "heavy": "BOOL", "Mass (kg)": "DOUBLE"}
ALL_NODES = (
    "MATCH (n:Node) RETURN n.key, n.id, n.label, n.tag, n.caption, n.confidence, n.n_observations, n.cx, n.ez, "
    f"n.p_colour, n.p_uses, n.p_heavy, n.{property_column('Mass (kg)')} ORDER BY n.key"
)
FORWARD = (
    "MATCH (a:Node)-[r:Rel]->(b:Node) RETURN a.key, b.key, r.label, r.confidence, r.origin, r.explanation "
    "ORDER BY a.key, b.key, r.confidence"
)
BACKWARD = "MATCH (b:Node)<-[r:Rel]-(a:Node) RETURN a.key, b.key, r.confidence ORDER BY a.key, b.key, r.confidence"
HOSTILE = [
    "", " ", "\n", "\r", "\r\n", "\0", "a\0b", '"', '""', "'", "\\", "\\N", "\\n", ",", ";", "NULL", "null", "#",
    "[a,b]", "{}", "=", "😀", "é", "\ufeff", "\u2028", "\x1a", "\U0010ffff", "'); DROP TABLE Node; //", "`", "$p",
    "x" * 300_000,
]  # fmt: skip


@pytest.fixture
def engine_name() -> str:
    return engine().name


def test_all_of_this_on_the_other_engine() -> None:
    """In a process of its own: the two engines cannot be loaded into one."""
    if "CGDB_TEST_OTHER_ENGINE" in os.environ:
        pytest.skip("this is the run on the other engine")
    other = {"kuzu": "ladybug", "ladybug": "kuzu"}[engine().name]
    if importlib.util.find_spec(other) is None:
        pytest.skip(f"{other} is not installed")
    files = [str(Path(__file__).with_name(name)) for name in ("test_graph.py", "test_artefacts.py")]
    ran = subprocess.run(
        [sys.executable, "-m", "pytest", "-q", "-x", "-p", "no:cacheprovider", *files],
        env=os.environ | {"CGDB_GRAPH_ENGINE": other, "CGDB_TEST_OTHER_ENGINE": "1"},
        capture_output=True, text=True, timeout=300, check=False,
    )  # fmt: skip
    assert ran.returncode == 0, ran.stdout[-3000:]


def test_two_engines_in_one_process_are_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("CGDB_GRAPH_ENGINE", {"kuzu": "ladybug", "ladybug": "kuzu"}[engine().name])
    with pytest.raises(UsageError, match="cannot load"):
        engine()


def node(key: int, **fields: Any) -> NodeRow:
    given: dict[str, Any] = {
        "id": key, "label": "Object", "tag": None, "tags": (), "caption": None, "center": None, "extent": None,
        "rotation": None, "n_observations": None, "confidence": None, "properties": {},
    }  # fmt: skip
    return NodeRow(key=key, **(given | fields))


def relation(source: int, target: int, label: str = "on", confidence: float = 1.0) -> RelationRow:
    return RelationRow(
        source=source, target=target, label=label, confidence=confidence, explanation=None, origin="geometry"
    )


def built(
    path: Path, nodes: list[NodeRow], relations: list[RelationRow] | None = None, columns: dict[str, str] | None = None
) -> GraphIndex:
    GraphIndex.build(path, iter([nodes]), iter([relations or []]), columns or {})
    return GraphIndex.open(path)


@pytest.fixture
def small(tmp_path: Path) -> Iterator[GraphIndex]:
    nodes = [node(k, tag=f"t{k}", center=np.array([k, 0.5, 1.0])) for k in range(20)]
    graph = built(tmp_path / "g", nodes, [relation(k, (k + 1) % 20) for k in range(20)])
    yield graph
    graph.close()


def test_every_text_comes_back_as_it_was(tmp_path: Path) -> None:
    rng = random.Random(5)
    texts = HOSTILE + ["".join(rng.choice(HOSTILE[:-1]) for _ in range(rng.randrange(5))) for _ in range(2000)]
    nodes = [
        node(
            k,
            id=f"i{k}",
            caption=t,
            tag=None if k % 3 else t,
            properties={"colour": t, "uses": (t, "x", t)},
        )
        for k, t in enumerate(texts)
    ]
    graph = built(tmp_path / "g", nodes, None, {"colour": "STRING", "uses": "STRING[]"})
    table = graph.run("MATCH (n:Node) RETURN n.caption, n.tag, n.p_colour, n.p_uses ORDER BY n.key")
    graph.close()
    for key, (caption, tag, colour, uses) in enumerate(table.rows()):
        text = texts[key]
        assert (caption, tag, colour, uses) == (
            text,
            None if key % 3 else text,
            text,
            [item for item in (text, "x", text) if item],
        )


def test_half_a_character_is_replaced_and_harms_nothing_else(tmp_path: Path) -> None:
    graph = built(tmp_path / "g", [node(0, caption="a\ud800b"), node(1, caption="whole")])
    assert graph.run("MATCH (n:Node) RETURN n.caption ORDER BY n.key").data[0] == ["a\ufffdb", "whole"]
    graph.close()


def test_empty_missing_and_listed_values_are_told_apart(tmp_path: Path) -> None:
    nodes = [
        node(0, caption="", properties={"uses": (), "heavy": False, "Mass (kg)": 0.1}),
        node(1, properties={"uses": ("", "a", "", "b", ""), "heavy": True, "Mass (kg)": 2}),
        node(2, center=np.array([1e-300, -0.0, 3.5]), extent=np.array([1.0, 2, 3]), confidence=0.3, n_observations=7),
    ]
    graph = built(tmp_path / "g", nodes, None, COLUMNS)
    rows = list(graph.run(ALL_NODES).rows())
    assert rows[0][4] == "" and rows[0][10:12] == ([], False) and rows[0][12] == 0.1
    assert rows[1][4] is None and rows[1][10:12] == (["a", "b"], True) and rows[1][12] == 2.0
    assert rows[2][5:9] == (0.3, 7, 1e-300, 3.0) and rows[2][10:12] == (None, None)
    graph.close()


def test_numbers_come_as_arrays(small: GraphIndex) -> None:
    table = small.run("MATCH (n:Node) RETURN n.key AS key, n.cx AS x, n.ex AS e, n.tag AS tag, n.key > 3 AS far")
    kinds = [c.dtype.name if isinstance(c, np.ndarray) else "list" for c in table.data]
    assert kinds == ["int64", "float64", "float64", "list", "bool"]
    assert np.isnan(table["e"]).all() and sorted(table["x"]) == list(range(20)) and len(table) == 20


def test_an_empty_scene_and_an_empty_answer(tmp_path: Path) -> None:
    graph = built(tmp_path / "g", [], [], COLUMNS)
    table = graph.run("MATCH (n:Node) RETURN n.key")
    assert len(table) == 0 and table.data[0].dtype == np.int64  # type: ignore[union-attr]
    graph.close()


def test_one_file_is_left(tmp_path: Path) -> None:
    built(tmp_path / "g", [node(1)], [relation(1, 1)]).close()
    assert [p.name for p in tmp_path.iterdir()] == ["g"]


def test_folders_whose_names_are_patterns(tmp_path: Path) -> None:
    folder = tmp_path / "it's [a] *store? {x}"
    folder.mkdir()
    graph = built(folder / "g", [node(1, tag="cup")])
    assert graph.run("MATCH (n:Node) RETURN n.tag").data[0] == ["cup"]
    graph.close()


def test_property_columns_differ_where_properties_do() -> None:
    names = ["colour", "Colour", "COLOUR", "a b", "a-b", "é", "x" * 80, "x" * 81, "", "`", "_", "__x"]
    columns = [property_column(n).lower() for n in names]
    assert len(set(columns)) == len(names) and columns[0] == "p_colour"


def random_node(rng: random.Random, key: int) -> NodeRow:
    return node(
        key,
        id=rng.choice([key, f"o{key}"]),
        tag=rng.choice([None, "", 'a\n"b']),
        caption=rng.choice(["x", "", None, "é😀\r\n"]),
        center=np.array([rng.random(), 2, 3]) if rng.random() < 0.7 else None,
        confidence=rng.random(),
        n_observations=rng.choice([None, 3]),
        properties={
            "colour": rng.choice(["red", "", None]),
            "uses": rng.choice([(), ("a", ""), None]),
            "heavy": rng.choice([True, False, None]),
            "Mass (kg)": rng.choice([1.5, None]),
        },
    )


def test_catching_up_gives_what_building_gives(tmp_path: Path, engine_name: str) -> None:
    rng = random.Random(engine_name)
    nodes = {k: random_node(rng, k) for k in range(50)}
    relations = [relation(rng.randrange(50), rng.randrange(50), "in", rng.random()) for _ in range(150)]
    now = tmp_path / "0"
    GraphIndex.build(now, iter([list(nodes.values())]), iter([relations]), {"colour": "STRING"})
    for step in range(1, 9):
        removed = set(rng.sample(sorted(nodes), 3))
        nodes = {k: n for k, n in nodes.items() if k not in removed}
        # In the first step every node changes, because three columns are new.
        changed = sorted(nodes) if step == 1 else rng.sample(sorted(nodes), 4)
        for key in [*changed, 100 * step, 100 * step + 1]:
            nodes[key] = random_node(rng, key)
        upserted = [nodes[k] for k in [*changed, 100 * step, 100 * step + 1]]
        sources = set(rng.sample(sorted(nodes), 4))
        relations = [r for r in relations if r.source not in removed and r.target not in removed]
        relations = [r for r in relations if r.source not in sources or rng.random() < 0.5]
        relations += [relation(s, rng.choice(sorted(nodes)), "near", rng.random()) for s in sources]
        following = tmp_path / str(step)
        meta = GraphIndex.catch_up(
            following, now, columns=COLUMNS, removed=removed, nodes=iter([upserted]), sources=sources,
            relations=iter([[r for r in relations if r.source in sources]]),
        )  # fmt: skip
        assert (meta["nodes"], meta["relations"]) == (len(nodes), len(relations))
        caught_up = GraphIndex.open(following)
        fresh = built(tmp_path / f"fresh{step}", [nodes[k] for k in sorted(nodes)], relations, COLUMNS)
        for question in (ALL_NODES, FORWARD, BACKWARD):
            assert repr(list(caught_up.run(question).rows())) == repr(list(fresh.run(question).rows()))
        caught_up.close()
        fresh.close()
        now = following


def test_a_column_of_another_type_is_no_catching_up(tmp_path: Path) -> None:
    built(tmp_path / "g", [node(0)], None, {"mass": "DOUBLE"}).close()
    with pytest.raises(StoreError, match="must be built again"):
        GraphIndex.catch_up(
            tmp_path / "h", tmp_path / "g", columns={"mass": "STRING"}, removed=(), nodes=iter(()), sources=(),
            relations=iter(()),
        )  # fmt: skip


FORBIDDEN = [
    "CREATE (:Node {key: -1})",
    "MATCH (n:Node) SET n.tag = 'x'",
    "MATCH (n:Node) DETACH DELETE n",
    "MATCH (n:Node) MERGE (m:Node {key: 99})",
    "DROP TABLE Rel",
    "ALTER TABLE Node ADD x DOUBLE",
    "CREATE MACRO f(x) AS x + 1",
    "COPY (MATCH (n:Node) RETURN n.key) TO '{file}'",
    "copy (match (n:Node) return n.key) to '{file}'",
    "EXPLAIN COPY (MATCH (n:Node) RETURN n.key) TO '{file}'",
    "PROFILE COPY (MATCH (n:Node) RETURN n.key) TO '{file}'",
    "COPY Node FROM '/etc/passwd'",
    "LOAD FROM '/etc/passwd' (file_format='csv', header=false, delim=':') RETURN *",
    "MATCH (n:Node) LOAD FROM '/etc/passwd' (file_format='csv') RETURN *",
    "LOAD WITH HEADERS (a STRING) FROM '/etc/passwd' (file_format='csv') RETURN a",
    "EXPORT DATABASE '{file}'",
    "IMPORT DATABASE '{file}'",
    "ATTACH '{file}' AS other (dbtype kuzu)",
    "DETACH other",
    "USE other",
    "INSTALL httpfs",
    "FORCE INSTALL httpfs",
    "UNINSTALL json",
    "UPDATE json",
    "LOAD EXTENSION '{file}'",
    "LOAD json",
    "CALL threads=1",
    "CALL timeout=0",
    "CALL current_setting('threads') RETURN *",
    "CALL storage_info('Node') RETURN *",
    "CALL READ_CSV_SERIAL('/etc/passwd') RETURN *",
    "MATCH (n:Node) CALL show_warnings() RETURN *",
    "BEGIN TRANSACTION",
    "CHECKPOINT",
    "COMMENT ON TABLE Node IS 'x'",
    "RETURN 1; COPY (RETURN 1) TO '{file}'",
    "RETURN 1 ;; DROP TABLE Rel",
    "/* */ COPY (RETURN 1) TO '{file}'",
    "RETURN 1 // \n; DROP TABLE Rel",
    "RETURN '\\q' ; DROP TABLE Rel",
    "RETURN 'open",
    "RETURN `open",
    "RETURN \u00b2",
    "\u00a0COPY (RETURN 1) TO '{file}'",
    "UNWIND range(1, 100000000000) AS i RETURN count(*)",
    "RETURN `repeat`('x', 10000000000)",
    "RETURN lpad('x', 2000000000, 'y')",
    "MATCH (n:Node) RETURN any(x IN [1] WHERE x = 1)",
    "",
    "   ",
    ";",
]


@pytest.mark.parametrize("statement", FORBIDDEN)
def test_a_statement_can_only_read(small: GraphIndex, tmp_path: Path, statement: str) -> None:
    file = tmp_path / "written"
    with pytest.raises(ExecuteError) as caught:
        small.run(statement.replace("{file}", str(file)))
    assert "\n" not in caught.value.message
    assert not file.exists()
    assert len(small.run("MATCH (:Node)-[r:Rel]->(:Node) RETURN r.label")) == 20


@pytest.mark.parametrize(
    "statement",
    ["RETURN " + "[" * 1000 + "1" + "]" * 1000, "RETURN 1" + "+1" * 10_000, "RETURN " + "x" * 200_000],
)
def test_a_statement_cannot_end_the_process(small: GraphIndex, statement: str) -> None:
    with pytest.raises(LimitError):
        small.run(statement)


@pytest.mark.parametrize(
    ("statement", "rows"),
    [
        ("MATCH (a:Node)-[:Rel]->(b:Node) WHERE a.tag = 'COPY; LOAD FROM // \\' x' RETURN b.key", []),
        ("OPTIONAL MATCH (n:Node {key: 3}) RETURN n.tag AS `load from`;", [("t3",)]),
        ("MATCH (a:Node)-[:Rel*2..2]->(b:Node) WHERE a.key = 1 RETURN b.key", [(3,)]),
        ("UNWIND $keys AS k MATCH (n:Node) WHERE n.key = k RETURN n.key ORDER BY n.key", [(2,), (5,)]),
        ("MATCH (n:Node) WHERE n.key IN $keys WITH n.cx AS x RETURN sum(x), count(*)", [(7.0, 2)]),
        ("RETURN \"é; DROP\", 'it\\'s', size($keys)", [("é; DROP", "it's", 2)]),
    ],
)
def test_statements_that_read(small: GraphIndex, statement: str, rows: list[tuple[Any, ...]]) -> None:
    parameters = {"keys": [2, 5]} if "$keys" in statement else {}
    assert list(small.run(statement, parameters).rows()) == rows


def test_calls_that_only_look(small: GraphIndex) -> None:
    assert {row[1] for row in small.run("CALL show_tables() RETURN *").rows()} == {"Node", "Rel"}
    assert "caption" in {row[1] for row in small.run("CALL table_info('Node') RETURN *").rows()}


@pytest.mark.parametrize(
    ("statement", "parameters"),
    [
        ("MATCH (n:Node) RETURN n.nothing", {}),
        ("MATCH (n:Nothing) RETURN n", {}),
        ("MATCH (n:Node RETURN n", {}),
        ("MATCH (n:Node) RETURN $missing", {}),
        ("RETURN $p", {"p": object()}),
        ("RETURN $p", {"p": "\ud800"}),
        ("RETURN 1", {"unused": 1}),
        ("RETURN error('boom')", {}),
        ("RETURN 1 / 0", {}),
        ("RETURN cast('x' AS INT64)", {}),
    ],
)
def test_mistakes_are_one_clear_line(small: GraphIndex, statement: str, parameters: dict[str, Any]) -> None:
    with pytest.raises(CgdbError) as caught:
        small.run(statement, parameters)
    assert "\n" not in caught.value.message and "exception:" not in caught.value.message.split(":")[0]
    assert len(small.run("MATCH (n:Node) RETURN n.key")) == 20


@pytest.fixture
def dense(tmp_path: Path) -> Iterator[GraphIndex]:
    rng = random.Random(1)
    relations = [relation(rng.randrange(300), rng.randrange(300)) for _ in range(9000)]
    graph = built(tmp_path / "dense", [node(k) for k in range(300)], relations)
    yield graph
    graph.close()


ENDLESS = "MATCH (a:Node)-[:Rel*1..8]->(b:Node) RETURN count(*)"


def test_a_time_out(dense: GraphIndex) -> None:
    began = time.monotonic()
    with pytest.raises(LimitError, match=r"longer than its 0\.2 s"):
        dense.run(ENDLESS, timeout_s=0.2)
    assert time.monotonic() - began < 5
    assert len(dense.run("MATCH (n:Node) RETURN n.key")) == 300


def test_an_interrupt_from_another_thread(dense: GraphIndex) -> None:
    stop = threading.Timer(0.3, dense.interrupt)
    stop.start()
    with pytest.raises(QueryCancelled):
        dense.run(ENDLESS, timeout_s=60)
    stop.join()
    assert len(dense.run("MATCH (n:Node) RETURN n.key")) == 300


def test_threads_share_an_index(small: GraphIndex) -> None:
    answers: list[int] = []

    def ask() -> None:
        one = "MATCH (n:Node)-[:Rel]->(m:Node) WHERE n.key = $k RETURN m.key"
        answers.extend(len(small.run(one, {"k": key})) for key in range(20))

    threads = [threading.Thread(target=ask) for _ in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert answers == [1] * 80


def test_closing_twice_and_asking_afterwards(tmp_path: Path) -> None:
    graph = built(tmp_path / "g", [node(1)])
    graph.close()
    graph.close()
    with pytest.raises(ExecuteError, match="closed"):
        graph.run("MATCH (n:Node) RETURN n.key")


def test_a_file_that_is_no_index(tmp_path: Path) -> None:
    (tmp_path / "g").write_bytes(b"nothing of the kind" * 1000)
    with pytest.raises(ExecuteError) as caught:
        GraphIndex.open(tmp_path / "g")
    assert "\n" not in caught.value.message


def test_the_engine_is_chosen_by_name(engine_name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    assert engine().name == engine_name and engine_name in GraphIndex.kind()
    monkeypatch.setenv("CGDB_GRAPH_ENGINE", "neo4j")
    with pytest.raises(UsageError, match="no graph engine 'neo4j'"):
        engine()


@pytest.mark.slow
def test_a_hundred_thousand_objects(tmp_path: Path) -> None:
    rng = random.Random(2)
    nodes = ([node(k, caption=f"a thing {k}") for k in range(b, b + 5000)] for b in range(0, 100_000, 5000))
    relations = ([relation(rng.randrange(100_000), rng.randrange(100_000)) for _ in range(5000)] for _ in range(60))
    began = time.monotonic()
    meta = GraphIndex.build(tmp_path / "g", nodes, relations, {})
    assert time.monotonic() - began < 60
    assert meta == {"nodes": 100_000, "relations": 300_000, "columns": {}}
    graph = GraphIndex.open(tmp_path / "g")
    assert len(graph.run("MATCH (a:Node)-[r:Rel]->(b:Node) RETURN a.key, b.key")) == 300_000
    graph.close()
