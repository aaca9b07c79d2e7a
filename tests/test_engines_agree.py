"""The graph index and the arrays of relations give the same rows, whatever is asked of whatever graph."""

from __future__ import annotations

import numpy as np
import pytest

import cgdb
from cgdb.testing import store

LABELS = ("on", "in", "near")


def scene(seed: int) -> cgdb.SceneGraph:
    rng = np.random.default_rng(seed)
    n = int(rng.integers(3, 9))
    objects = tuple(
        cgdb.SceneObject(id=i, tag=str(rng.choice(["cup", "table"])), properties={"price": int(rng.integers(5))})
        for i in range(n)
    )
    rooms = (cgdb.Place(id=100, kind="Room"), cgdb.Place(id=101, kind="Room"))
    ids = [*range(n), 100, 101]
    said = {
        (int(rng.choice(ids)), int(rng.choice(ids)), str(rng.choice(LABELS))) for _ in range(int(rng.integers(4, 20)))
    }
    relations = tuple(
        cgdb.Relation(source=a, target=b, label=label, confidence=float(rng.uniform(0.1, 1)))
        for a, b, label in sorted(said)
    )
    return cgdb.SceneGraph(name="s", objects=objects, places=rooms, relations=relations)


def statement(rng: np.random.Generator) -> str:
    names = [chr(ord("a") + i) for i in range(int(rng.integers(2, 5)))]
    patterns = []
    for number, name in enumerate(names[1:]):
        other = names[int(rng.integers(number + 1))]
        labels = "|".join(rng.choice(LABELS, int(rng.integers(0, 3)), replace=False))
        edge = f"[:{labels}]" if labels else ""
        left, right = [("-", "->"), ("<-", "-"), ("-", "-")][int(rng.integers(3))]
        patterns.append(f"({other}){left}{edge}{right}({name})")
    label = {name: ":Room" if rng.random() < 0.2 else "" for name in names}
    first = [f"({name}{label[name]})" for name in names]
    tests = [f"{name}.price {rng.choice(['<', '>=', '='])} {rng.integers(5)}" for name in names if rng.random() < 0.3]
    tests += [f"{name}.tag = 'cup'" for name in names if rng.random() < 0.2]
    where = f" WHERE {' AND '.join(tests)}" if tests else ""
    return f"MATCH {', '.join(first + patterns)}{where} RETURN {', '.join(f'{name}.id' for name in names)}"


@pytest.mark.parametrize("seed", range(12))
def test_the_same_rows_either_way(seed: int, monkeypatch: pytest.MonkeyPatch) -> None:
    rng = np.random.default_rng(seed + 1000)
    with store(scene(seed)) as db:
        for _ in range(25):
            text = statement(rng)
            by_index = [(row.values, round(row.score, 6)) for row in db.query(text)]
            with monkeypatch.context() as patch:
                patch.setattr("cgdb.query.executor.GRAPH_EDGES", -1)
                by_arrays = [(row.values, round(row.score, 6)) for row in db.query(text)]
            assert by_index == by_arrays, text
