"""The maps and questions of strangers in benchmarks/queries/strangers are whole: maps load, graded objects exist."""

from __future__ import annotations

from pathlib import Path

import pytest

from cgdb.evaluation.judged import chosen, judgements
from cgdb.ingest import load

STRANGERS = Path(__file__).parent.parent / "benchmarks" / "queries" / "strangers"


@pytest.mark.parametrize(("name", "questions", "maps"), [("first", 360, 17), ("second", 100, 4)])
def test_judged_questions_of_strangers(name: str, questions: int, maps: int) -> None:
    file = STRANGERS / f"{name}.json"
    found = chosen(judgements(file), file, [])
    assert len(found) == maps
    assert sum(len(queries) for _, _, queries in found) == questions
    for where, path, queries in found:
        scene = load(path)
        ids = {str(obj.id) for obj in scene.objects}
        assert len(ids) >= 45, where
        for query in queries:
            assert set(query.relevant) <= ids, (where, query.id)
    absent = sum(not query.clear for _, _, queries in found for query in queries)
    assert absent == round(0.3 * questions)
