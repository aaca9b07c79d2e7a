"""The rules of the planner, one by one: what each does to a statement, as EXPLAIN tells it."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import pytest

import cgdb
from cgdb.database import Database
from cgdb.query import planner
from cgdb.testing import store

GOLDEN = {
    "join_components": (
        "MATCH (a)-[:on]->(b), (b)-[:on]->(c), (d) RETURN count(*)",
        ["(n0:Node)-[r0:Rel]->(n1:Node), (n1:Node)-[r1:Rel]->(n2:Node)", "scan: Object as d"],
    ),
    "push_conditions": ("MATCH (a)-[:on]->(b) WHERE a.price > 3 RETURN a", ["n0.p_price > $p"]),
    "split_hidden": ('MATCH (a)-[:on]->(~ "shelf") RETURN a', ["(best match counts)"]),
    "order_conditions": (
        'MATCH (a)-[:on]->(b) WHERE (a)-[:in]->(b) AND a ~ "cup" AND volume(a) > volume(b) RETURN a',
        ["weigh: volume(a) > volume(b)", 'weigh: a ~ "cup"', "weigh: (a)-[:in]->(b)"],
    ),
    "join_near": ("MATCH (a), (b) WHERE 2 m > distance(a, b) RETURN a", ["near: a and b within 2 m"]),
    "estimate_rows": ("MATCH (a)-[:on]->(b) RETURN a", ["~1,000 rows"]),
    "filter_first": ("MATCH (a)-[:on]->(b) WHERE height(a) > 1 RETURN a", ["filter: a by height(a) > 1"]),
    "keep_fitting": ('MATCH (a ~ "cup") RETURN count(*)', ['first: only a that fits a ~ "cup"']),
    "choose_start": ('MATCH (a ~ "cup")-[:on]->(b) RETURN a LIMIT 3', ['vectors: best of (a ~ "cup") first']),
}


@pytest.fixture(scope="module")
def db() -> Iterator[Database]:
    count = 2000
    objects = tuple(
        cgdb.SceneObject(id=i, tag="thing", properties={"price": i % 9}, center=np.zeros(3), extent=np.ones(3))
        for i in range(count)
    )
    relations = [cgdb.Relation(source=i, target=i + 1, label="on") for i in range(1000)]
    relations.append(cgdb.Relation(source=1, target=3, label="in"))
    with store(cgdb.SceneGraph(name="s", objects=objects, relations=tuple(relations)), degrees={}) as opened:
        yield opened


def test_every_rule_has_its_golden_plan() -> None:
    assert [rule.__name__ for rule in planner.RULES] == [
        "join_components",
        "push_conditions",
        "split_hidden",
        "order_conditions",
        "join_near",
        "estimate_rows",
        "filter_first",
        "keep_fitting",
        "choose_start",
    ]
    assert set(GOLDEN) == {rule.__name__ for rule in planner.RULES}


@pytest.mark.parametrize("rule", GOLDEN)
def test_what_a_rule_does(db: Database, rule: str) -> None:
    statement, expected = GOLDEN[rule]
    plan = db.query("EXPLAIN " + statement).plan
    places = [plan.find(text) for text in expected]
    assert -1 not in places, plan
    assert places == sorted(places), plan


@pytest.mark.parametrize("rule", ["push_conditions", "join_near", "filter_first", "keep_fitting", "choose_start"])
def test_a_rule_changes_the_plan_and_not_the_answer(db: Database, rule: str, monkeypatch: pytest.MonkeyPatch) -> None:
    statement = GOLDEN[rule][0].replace("(a), (b) WHERE", "(a), (b) WHERE a = #5 AND")
    before, plan = [list(map(str, row.values)) for row in db.query(statement)], db.query("EXPLAIN " + statement).plan
    monkeypatch.setattr(planner, "RULES", tuple(r for r in planner.RULES if r.__name__ != rule))
    assert [list(map(str, row.values)) for row in db.query(statement)] == before
    assert db.query("EXPLAIN " + statement).plan != plan
