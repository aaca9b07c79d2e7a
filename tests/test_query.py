"""What the statements of CGQL give, on a small scene with given degrees."""

from __future__ import annotations

import time
from collections.abc import Iterator

import numpy as np
import pytest

import cgdb
from cgdb.database import Database
from cgdb.errors import BindError, LimitError, ParseError, StoreError
from cgdb.query.limits import Limits
from cgdb.testing import store


def thing(
    number: int, tag: str, center: tuple[float, float, float], size: float = 0.2, **more: object
) -> cgdb.SceneObject:
    return cgdb.SceneObject(
        id=number,
        tag=tag,
        caption=f"a {tag}",
        center=np.asarray(center, float),
        extent=np.full(3, size),
        properties=more,  # type: ignore[arg-type]
    )


ROOM = cgdb.SceneGraph(
    name="room",
    objects=(
        thing(1, "table", (0, 0, 0.5), 1.0, material="wood"),
        thing(2, "cup", (0, 0, 1.1), colour="red", price=3),
        thing(3, "cup", (0.4, 0, 1.1), colour="blue", price=5),
        thing(4, "shelf", (3, 0, 1.0), 2.0, material="wood"),
        thing(5, "book", (3, 0, 1.0), price=12),
        thing(6, "book", (0, 2, 0.1), price=7, tags=("old", "green")),
    ),
    places=(cgdb.Place(id=100, kind="Room", name="study"),),
    relations=(
        cgdb.Relation(source=2, target=1, label="on", origin="human"),
        cgdb.Relation(source=3, target=1, label="on", origin="geometry", confidence=0.8),
        cgdb.Relation(source=5, target=4, label="in"),
        cgdb.Relation(source=2, target=3, label="next_to"),
        cgdb.Relation(source=3, target=6, label="next_to", confidence=0.5),
        cgdb.Relation(source=6, target=4, label="may be stored in", origin="llm", explanation="books go on shelves"),
        *(cgdb.Relation(source=100, target=i, label="contains") for i in range(1, 7)),
    ),
)
DEGREES = {
    "cup": {2: 0.9, 3: 0.8, 1: 0.1},
    "red": {2: 0.9, 3: 0.2},
    "book": {5: 0.9, 6: 0.7, 4: 0.3},
    "shelf": {4: 0.9, 1: 0.3},
    "table": {1: 0.9, 4: 0.4},
    "nothing here": {1: 0.2, 2: 0.1},
    "belongs into": {"may be stored in": 0.9, "in": 0.4},
}


@pytest.fixture(scope="module")
def db() -> Iterator[Database]:
    with store(ROOM, degrees=DEGREES) as opened:
        yield opened


def found(db: Database, text: str, **parameters: object) -> list[tuple[object, ...]]:
    """The rows with nodes as their ids, and the score."""
    result = db.query(text, **parameters)
    return [
        (*(value.id if isinstance(value, cgdb.StoredNode) else value for value in row.values), round(row.score, 4))
        for row in result
    ]


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ('MATCH (o ~ "cup") RETURN o', [(2, 0.9), (3, 0.8), (1, 0.1)]),
        ('MATCH (o ~ "cup") RETURN o LIMIT 1', [(2, 0.9)]),
        ('MATCH (o ~ "cup") RETURN o SKIP 1 LIMIT 1', [(3, 0.8)]),
        ('MATCH (o ~ "cup") WHERE NOT o ~ "red" RETURN o', [(3, 0.64), (1, 0.1), (2, 0.09)]),
        ('MATCH (o) WHERE o ~ "cup" OR o ~ "red" RETURN o', [(2, 0.99), (3, 0.84), (1, 0.1)]),
        ('MATCH (c ~ "cup")-[:on]->(t ~ "table") RETURN c, t', [(2, 1, 0.81), (3, 1, 0.576)]),
        ('MATCH (t)<-[:on]-(c ~ "cup") RETURN c, t', [(2, 1, 0.9), (3, 1, 0.64)]),
        ("MATCH (a)-[:next_to]-(b) WHERE a = #3 RETURN b", [(2, 1.0), (6, 0.5)]),
        ("MATCH (#3)-[:next_to]-(b) RETURN b", [(2, 1.0), (6, 0.5)]),
        ("MATCH (a)-[:next_to]->(b) RETURN a, b", [(2, 3, 1.0), (3, 6, 0.5)]),
        ("MATCH (#2)-[:next_to*1..2]-(b) RETURN b", [(3, 1.0), (6, 0.5)]),
        ("MATCH (#2)-[p:next_to*2]->(b) RETURN b, size(p)", [(6, 2, 0.5)]),
        ("MATCH (a)-[:next_to*]->(#6) RETURN a", [(2, 0.5), (3, 0.5)]),
        ("MATCH (a)-[:on]->(#1), (b)-[:on]->(#1) RETURN a, b", [(2, 3, 0.8), (3, 2, 0.8)]),
        ('MATCH (b ~ "book") WHERE (b)-[:in]->(~ "shelf") RETURN b', [(5, 0.81)]),
        ('MATCH (b ~ "book") WHERE NOT (b)-[:in]->(~ "shelf") RETURN b', [(6, 0.7), (4, 0.3), (5, 0.09)]),
        ('MATCH (a)-[r ~ "belongs into"]->(b) RETURN a, r.label', [(6, "may be stored in", 0.9), (5, "in", 0.4)]),
        ("MATCH (a)-[:on|in]->(b) RETURN a, b", [(2, 1, 1.0), (5, 4, 1.0), (3, 1, 0.8)]),
        ("MATCH (o {material: 'wood'}) RETURN o", [(1, 1.0), (4, 1.0)]),
        ("MATCH (o) WHERE o.price > 99 AND distance(o, #2) < 9 AND NOT (o)-[:on]->() RETURN o", []),
        ("MATCH (o) WHERE o.price > 4 AND o.price <= 7 RETURN o", [(3, 1.0), (6, 1.0)]),
        ("MATCH (o) WHERE NOT o.price > 4 AND o.price IS NOT NULL RETURN o", [(2, 1.0)]),
        ("MATCH (o) WHERE o.tag IN ['book', 'shelf'] RETURN o", [(4, 1.0), (5, 1.0), (6, 1.0)]),
        ("MATCH (o) WHERE o.caption CONTAINS 'BOO' RETURN o", [(5, 1.0), (6, 1.0)]),
        ("MATCH (o) WHERE o.tag STARTS WITH 'cu' RETURN o", [(2, 1.0), (3, 1.0)]),
        ("MATCH (o) WHERE o.tags CONTAINS 'green' RETURN o", []),
        ("MATCH (o) WHERE o = #4 RETURN o", [(4, 1.0)]),
        ("MATCH (r:Room)-[:contains]->(o ~ 'cup') RETURN r.name, count(o)", [("study", 2, 0.9)]),
        ("MATCH (o) RETURN o.material, count(*) ORDER BY count(*) DESC", [(None, 4, 1.0), ("wood", 2, 1.0)]),
        ("MATCH (o ~ 'book') RETURN max(o.price), min(o.price), avg(o.price), sum(o.price)", [(12, 7, 9.5, 19, 0.9)]),
        ("MATCH (o) WHERE o ~ 'nothing here' RETURN count(o)", [(0, 0.0)]),
        ("MATCH (o) WHERE distance(o, #2) < 50 cm AND o <> #2 RETURN o", [(1, 1.0), (3, 1.0)]),
        ("MATCH (o ~ 'cup') RETURN o, distance(o, #6) AS d ORDER BY d LIMIT 1", [(2, 1.9698, 0.9)]),
        ("MATCH (o) WHERE volume(o) >= 1 RETURN o, height(o)", [(1, 1, 1.0), (4, 2, 1.0)]),
        ("MATCH (o), (s) WHERE inside(o, s) AND s.tag = 'shelf' RETURN o", [(4, 1.0), (5, 1.0)]),
        ("MATCH (o) WHERE above(o, #1) RETURN o", [(2, 1.0), (3, 1.0)]),
        ("MATCH (o) RETURN o.price * 2 + 1 AS p ORDER BY p DESC LIMIT 2", [(25, 1.0), (15, 1.0)]),
        ("MATCH (o ~ 'cup') RETURN o, score(o) LIMIT 1", [(2, 0.8999999761581421, 0.9)]),
        ("MATCH (o) RETURN DISTINCT o.material ORDER BY o.material", [("wood", 1.0), (None, 1.0)]),
        ("USE 'room' MATCH (o ~ 'cup') RETURN o.id LIMIT 1", [(2, 0.9)]),
        ("USE 'room' AS OF 1 MATCH (o ~ 'cup') RETURN o.id LIMIT 1", [(2, 0.9)]),
    ],
)
def test_rows(db: Database, text: str, expected: list[tuple[object, ...]]) -> None:
    got = found(db, text)
    assert [tuple(round(v, 4) if isinstance(v, float) else v for v in row) for row in got] == [
        tuple(round(v, 4) if isinstance(v, float) else v for v in row) for row in expected
    ]


def test_parameters_are_values_never_text(db: Database) -> None:
    assert found(db, "MATCH (o) WHERE o.tag = $t RETURN o", t="cup' OR true") == []
    assert found(db, "MATCH (o ~ $m) RETURN o LIMIT $n", m="cup", n=1) == [(2, 0.9)]
    assert found(db, "MATCH (o) WHERE o.id IN $ids RETURN o", ids=[5, 2]) == [(2, 1.0), (5, 1.0)]


def test_fits_follows_the_logic_not_the_product(db: Database) -> None:
    rows = db.query('MATCH (c ~ "cup")-[:on]->(t ~ "table") WHERE NOT c ~ "red" RETURN c').rows
    assert [(row.values[0].id, row.fits) for row in rows] == [(3, True), (2, False)]  # type: ignore[union-attr]
    assert rows[0].score == pytest.approx(0.8 * 0.8 * 0.9 * 0.8)


def test_nothing_fits_still_shows_the_nearest(db: Database) -> None:
    result = db.query("MATCH (o ~ 'nothing here') RETURN o")
    assert result.nothing_fits
    assert len(result) == 2


def test_why_names_every_condition_and_its_evidence(db: Database) -> None:
    row = db.query('MATCH (b ~ "book") WHERE (b)-[:in]->(~ "shelf") AND distance(b, #1) > 1 RETURN b')[0]
    told = [str(reason) for reason in row.why]
    assert told[0].startswith('b ~ "book": 0.90')
    assert any("in #4 shelf" in line for line in told)
    assert any("distance(b, #1)" in line for line in told)


@pytest.mark.parametrize(
    ("text", "error", "words"),
    [
        ("MATCH (o)-[:ontop]->(p) RETURN o", BindError, "no relation 'ontop'"),
        ("MATCH (o:Rom) RETURN o", BindError, "no label 'Rom'"),
        ("MATCH (o) RETURN o.colr", BindError, "no property 'colr'"),
        ("MATCH (o) RETURN distnce(o, #1)", BindError, "no function 'distnce'"),
        ("MATCH (o) RETURN p", BindError, "no variable 'p'"),
        ("MATCH (o) WHERE o.price > $max RETURN o", BindError, "parameter $max was not given"),
        ("MATCH (o) WHERE o.price > 'a' RETURN o", BindError, "cannot be compared"),
        ("MATCH (#77) RETURN count(*)", BindError, "#77"),
        ("USE 'rom' MATCH (o) RETURN o", StoreError, "no scene 'rom'"),
        ("USE 'room' AS OF 9 MATCH (o) RETURN o", StoreError, "9"),
        ("MATCH (o) RETRN o", ParseError, ""),
    ],
)
def test_errors_have_a_place_and_a_hint(db: Database, text: str, error: type[cgdb.CgdbError], words: str) -> None:
    with pytest.raises(error) as caught:
        db.query(text)
    assert words in caught.value.message
    assert caught.value.span is not None
    assert "^" in caught.value.render()


def test_did_you_mean(db: Database) -> None:
    with pytest.raises(BindError) as caught:
        db.query("MATCH (o)-[:nxt_to]->(p) RETURN o")
    assert caught.value.hint == "did you mean 'next_to'?"


def test_limits(db: Database) -> None:
    with pytest.raises(LimitError, match="combinations"):
        db.query("MATCH (a), (b), (c) RETURN count(*)", limits=Limits(rows=100))
    with pytest.raises(LimitError, match="longer than"):
        db.query("MATCH (a)-[:on]->(b) RETURN a", limits=Limits(seconds=1e-9))


def test_reasons_may_be_asked_for_long_after_the_query(db: Database) -> None:
    result = db.query("MATCH (a) WHERE (a)-[:on]->() OR (a)-[:in]->() RETURN a LIMIT 1", limits=Limits(seconds=1.0))
    time.sleep(1.05)
    assert any("on" in str(reason) for reason in result[0].why)


def test_starting_from_the_vectors_gives_the_same_rows() -> None:
    count = 3000
    rng = np.random.default_rng(0)
    objects = tuple(cgdb.SceneObject(id=i, tag=f"t{i % 7}") for i in range(count))
    relations = tuple(
        cgdb.Relation(source=i, target=int(rng.integers(count)), label="on", confidence=float(rng.uniform(0.2, 1)))
        for i in range(count)
        if i % 2
    )
    degrees = {
        "a": {i: float(d) for i, d in enumerate(rng.uniform(0, 1, count))},
        "b": {i: float(d) for i, d in enumerate(rng.uniform(0, 1, count))},
    }
    with store(cgdb.SceneGraph(name="big", objects=objects, relations=relations), degrees=degrees) as db:
        text = 'MATCH (x ~ "a")-[:on]->(y) WHERE NOT y ~ "b" RETURN x, y'
        everything = found(db, text)
        short = text + " LIMIT 5"
        assert "vectors:" in db.query(short).plan
        assert "vectors:" not in db.query(text).plan
        assert found(db, short) == everything[:5]
