"""Relations asked of a model: which pairs, what is kept, beside geometry, and marked where the two contradict."""

from __future__ import annotations

import json
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from cgdb.cli.app import main
from cgdb.enrich.overlaps import Pair, overlapping, spanning_forest
from cgdb.enrich.relations import Relating, checked, contradict
from cgdb.errors import UsageError
from cgdb.model.llm import Model, connect
from cgdb.model.llm_settings import Settings
from cgdb.scene import Relation, SceneGraph, SceneObject
from cgdb.testing import store
from tests import model_server
from tests.model_server import ModelServer

pytestmark = pytest.mark.usefixtures("no_model")


def box(id: int, tag: str, center: tuple[float, ...], extent: tuple[float, ...], **more: Any) -> SceneObject:
    return SceneObject(id=id, tag=tag, center=np.array(center, float), extent=np.array(extent, float), **more)


TABLE = box(1, "table", (0, 0, 0.5), (2, 1, 1))
CUP = box(2, "cup", (0.2, 0, 1.05), (0.1, 0.1, 0.1))
PLATE = box(3, "plate", (-0.4, 0, 1.01), (0.3, 0.3, 0.02))
LAMP = box(4, "lamp", (5, 5, 0.5), (0.3, 0.3, 1))
WALL = box(5, "wall", (0, 0.6, 1), (8, 0.3, 2), properties={"background": True})
ROOM = SceneGraph(
    name="room",
    objects=(TABLE, CUP, PLATE, LAMP, WALL),
    relations=(
        Relation(source=1, target=2, label="on", confidence=0.6, origin="geometry", explanation="it rests there"),
        Relation(source=3, target=1, label="on", confidence=0.9, origin="geometry"),
    ),
)


def pairs_of(body: dict[str, Any]) -> list[dict[str, Any]]:
    found: list[dict[str, Any]] = json.loads(model_server.user_text(body).splitlines()[1])
    return found


def sensible(body: dict[str, Any]) -> str:
    """A model that knows that small things stand on tables."""
    answers = []
    for pair in pairs_of(body):
        names = (pair["a"]["name"], pair["b"]["name"])
        relation = "b on a" if names[0] == "table" else "a on b" if names[1] == "table" else "none"
        answers.append(
            {"number": pair["number"], "relation": relation, "other": None, "reason": "it does", "sure": "likely"}
        )
    return json.dumps({"pairs": answers})


def model(at: ModelServer) -> Model:
    return connect(Settings(base_url=at.url, model="little", backoff=0.01, timeout=2.0, deadline=5.0), remember=False)


def run(work: Relating) -> list[tuple[int, int]]:
    return list(work.run())


def test_touching_things_are_asked_about_and_answers_kept_beside_geometry() -> None:
    with store(ROOM) as db, ModelServer(sensible) as at:
        work = db.relate(model=model(at))
        estimate = work.estimate()
        assert (estimate.objects, estimate.candidates, estimate.pairs, estimate.pending) == (4, 2, 2, 2)
        assert run(work) == [(2, 2)]
        assert len(at.requests) == estimate.calls == 1
        assert (work.related, work.contradictions, work.revisions) == (2, 1, {"room": 2})
        relations = {(r.source, r.label, r.target, r.origin): r for r in db.scene("room").relations}
        assert len(relations) == 4
        cup, geometry = relations[2, "on", 1, "llm"], relations[1, "on", 2, "geometry"]
        assert cup.confidence == 0.75
        assert cup.explanation == "it does; contradicts #1 on #2 (geometry, 0.60)"
        assert geometry.explanation == "it rests there; contradicts #2 on #1 (llm, 0.75)"
        assert relations[3, "on", 1, "llm"].explanation == "it does", "the two agree"
        assert relations[3, "on", 1, "geometry"].explanation is None

        again = db.relate(model=model(at))
        assert (again.estimate().pending, run(again), again.revisions) == (0, [], {})
        assert len(at.requests) == 1
        rows = db.query('MATCH (a {tag: "cup"})-[r:on]->(b) RETURN r.origin').rows
        assert [row.values[0] for row in rows] == ["llm"]


def test_the_prompt_holds_captions_and_places() -> None:
    with store(ROOM) as db, ModelServer(sensible) as at:
        run(db.relate(model=model(at)))
        shown = pairs_of(at.requests[0])[0]
        assert shown["a"] == {"name": "table", "caption": None, "center": [0.0, 0.0, 0.5], "size": [2.0, 1.0, 1.0]}
        assert "up is z" in at.requests[0]["messages"][0]["content"]


def test_open_relations_and_none() -> None:
    said = iter(
        [
            {"relation": "other", "other": "May be stored in.", "reason": "cups live there", "sure": "unsure"},
            {"relation": "none", "other": None, "reason": "by chance", "sure": "certain"},
        ]
    )

    def brain(body: dict[str, Any]) -> str:
        return json.dumps({"pairs": [{"number": pair["number"], **next(said)} for pair in pairs_of(body)]})

    with store(ROOM) as db, ModelServer(brain) as at:
        run(db.relate(model=model(at)))
        mine = [relation for relation in db.scene("room").relations if relation.origin == "llm"]
        assert [(r.source, r.label, r.target, r.confidence) for r in mine] == [(1, "may be stored in", 2, 0.5)]
        assert db.relate(model=model(at)).estimate().pending == 0, "that there is none is known as well"


def test_what_a_model_takes_back_ends_with_the_run_that_says_so() -> None:
    relation = "a on b"

    def brain(body: dict[str, Any]) -> str:
        said = {"relation": relation, "other": None, "reason": "so it is", "sure": "certain"}
        return json.dumps({"pairs": [{"number": pair["number"], **said} for pair in pairs_of(body)]})

    def by_model() -> set[tuple[Any, ...]]:
        return {(r.source, r.label, r.target) for r in db.scene("room").relations if r.origin == "llm"}

    asserted = Relation(source=2, target=1, label="belongs to", origin="human")
    elsewhere = Relation(source=4, target=5, label="lights", origin="llm")
    scene = replace(ROOM, relations=(*ROOM.relations, asserted, elsewhere))
    with store(scene) as db, ModelServer(brain) as at:
        run(db.relate(model=model(at)))
        assert by_model() == {(1, "on", 2), (1, "on", 3), (4, "lights", 5)}
        marked = next(r for r in db.scene("room").relations if (r.origin, r.source) == ("geometry", 3))
        assert marked.explanation == "contradicts #1 on #3 (llm, 0.95)"

        # With another caption it is another question: first of the cup, then of the plate.
        relation = "b on a"
        captioned = replace(CUP, caption="a full cup")
        db.add(replace(scene, objects=(captioned,), relations=()), on_existing="merge")
        work = db.relate(model=model(at))
        assert (work.estimate().pending, run(work), work.related) == (1, [(1, 1)], 2)
        assert by_model() == {(2, "on", 1), (1, "on", 3), (4, "lights", 5)}

        relation = "none"
        db.add(replace(scene, objects=(replace(PLATE, caption="a plate"),), relations=()), on_existing="merge")
        again = db.relate(model=model(at))
        run(again)
        assert by_model() == {(2, "on", 1), (4, "lights", 5)}, "of pairs that were not asked about all stays"
        left = {(r.source, r.label, r.target): r for r in db.scene("room").relations}
        assert left[3, "on", 1].explanation is None, "it contradicts nothing any more"
        assert left[2, "belongs to", 1].origin == "human"
        assert (1, "on", 3) not in left
        earlier = db.scene("room", as_of=again.revisions["room"] - 1)
        assert (1, "on", 3) in {(r.source, r.label, r.target) for r in earlier.relations}


def test_pairs_that_a_batch_leaves_out_are_asked_for_alone() -> None:
    def forgetful(body: dict[str, Any]) -> str:
        answer = json.loads(sensible(body))
        return json.dumps({"pairs": answer["pairs"][:1]})

    with store(ROOM) as db, ModelServer(forgetful) as at:
        work = db.relate(model=model(at))
        run(work)
        assert (work.related, work.unanswered, len(at.requests)) == (2, 0, 2)


def test_every_pair_and_reach() -> None:
    stack = SceneGraph(
        name="stack", objects=tuple(box(i, f"book {i}", (0, 0, 0.03 * i), (0.3, 0.2, 0.02)) for i in range(1, 4))
    )
    with store(stack) as db:
        assert db.relate(every_pair=True).estimate().pairs == 3
        assert db.relate().estimate().pairs == 2
        assert db.relate(reach=0).estimate().pairs == 0, "a book thinner than its gap"
        with pytest.raises(UsageError):
            db.relate(reach=-1)
        with pytest.raises(UsageError):
            db.relate(batch=0)


@pytest.mark.parametrize(
    "item",
    [
        {},
        {"relation": "a near b"},
        {"relation": "other", "other": None},
        {"relation": "other", "other": "  "},
        {"relation": ["a on b"]},
    ],
)
def test_what_was_not_asked_for_is_no_answer(item: dict[str, Any]) -> None:
    assert checked(item) is None


def test_directions() -> None:
    on = checked({"relation": "a on b"})
    held = checked({"relation": "b in a"})
    assert on is not None and (on.label, on.turned) == ("on", False)
    assert held is not None and (held.label, held.turned) == ("in", True)


@pytest.mark.parametrize(
    ("one", "other", "expected"),
    [
        ((1, "on", 2), (2, "on", 1), True),
        ((1, "on", 2), (1, "on", 2), False),
        ((1, "in", 2), (2, "under", 1), False),
        ((1, "in", 2), (1, "under", 2), True),
        ((1, "on", 2), (2, "above", 1), True),
        ((1, "on", 2), (1, "next_to", 2), False),
        ((1, "may be stored in", 2), (2, "on", 1), False),
    ],
)
def test_contradictions(one: tuple[int, str, int], other: tuple[int, str, int], expected: bool) -> None:
    first, second = (Relation(source=a, label=label, target=b) for a, label, b in (one, other))
    assert contradict(first, second) is contradict(second, first) is expected


def test_the_strongest_overlaps_of_a_cycle_stay() -> None:
    pairs = [Pair(0, 1, 0.9), Pair(1, 2, 0.5), Pair(0, 2, 0.1), Pair(3, 4, 0.2)]
    assert spanning_forest(pairs) == [Pair(0, 1, 0.9), Pair(1, 2, 0.5), Pair(3, 4, 0.2)]


@given(
    st.lists(
        st.tuples(st.integers(0, 12), st.integers(0, 12), st.floats(0.01, 1)).filter(lambda e: e[0] < e[1]),
        max_size=40,
        unique_by=lambda e: e[:2],
    )
)
def test_a_forest_connects_what_was_connected_and_weighs_most(edges: list[tuple[int, int, float]]) -> None:
    kept = spanning_forest([Pair(*edge) for edge in edges])
    group = list(range(13))

    def root(i: int) -> int:
        return i if group[i] == i else root(group[i])

    weight = 0.0
    for a, b, w in sorted(edges, key=lambda e: -e[2]):  # Kruskal, the other way to a maximum spanning forest
        if root(a) != root(b):
            group[root(a)] = root(b)
            weight += w
    assert sum(pair.weight for pair in kept) == pytest.approx(weight)
    assert len(kept) == 13 - len({root(i) for i in range(13)})


def test_overlap_is_the_iou_of_boxes_made_larger() -> None:
    # Two unit cubes, 0.5 apart along x, no reach: 0.5 shared of 1.5.
    cubes = [box(1, "a", (0, 0, 0), (1, 1, 1)), box(2, "b", (0.5, 0, 0), (1, 1, 1)), SceneObject(id=3)]
    (pair,) = overlapping(cubes, reach=0.0)
    assert pair == Pair(0, 1, pytest.approx(1 / 3))


def test_a_turned_box_is_taken_by_its_hull() -> None:
    c = np.sqrt(0.5)
    turned = np.array([[c, -c, 0], [c, c, 0], [0, 0, 1]])
    bar = box(1, "bar", (0, 0, 0), (2, 0.1, 0.1), rotation=turned)
    ball = box(2, "ball", (0.6, 0.6, 0), (0.1, 0.1, 0.1))
    assert len(overlapping([bar, ball], reach=0.0)) == 1


def test_the_command(capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch) -> None:
    with store(ROOM) as db, ModelServer(sensible) as at:
        monkeypatch.setenv("CGDB_LLM_BASE_URL", at.url)
        monkeypatch.setenv("CGDB_LLM_MODEL", "little")
        db.close()
        assert main(["relate", str(db.path), "--dry-run"]) == 0
        told = capsys.readouterr()
        assert "4 objects; 2 pairs touch or overlap, 2 of them to know, 2 to ask; 1 calls" in told.err
        assert main(["relate", str(db.path), "--json"]) == 0
        told = capsys.readouterr()
        record = json.loads(told.out)
        assert (record["relations_by_the_model"], record["contradicting_geometry"]) == (2, 1)
        assert "2 relations by the model, 1 contradicting geometry (room revision 2)" in told.err
