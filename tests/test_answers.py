"""What the built-in translator answers: in words, with what was measured and counted, and what near things lack."""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np
import pytest

from cgdb.asking.answer import Answer
from cgdb.database import Database
from cgdb.errors import UsageError
from cgdb.query.limits import Limits
from cgdb.scene import ObjectId, Place, Relation, SceneGraph, SceneObject
from cgdb.testing import store


def box(
    number: ObjectId, tag: str, center: tuple[float, float, float], size: tuple[float, float, float], **more: Any
) -> SceneObject:
    return SceneObject(id=number, tag=tag, center=np.asarray(center), extent=np.asarray(size), **more)


DEN = SceneGraph(
    name="den",
    up="z",
    objects=(
        box(1, "table", (0.0, 0.0, 0.4), (1.6, 0.8, 0.8), properties={"color": "brown"}),
        box(2, "lamp", (0.0, 0.0, 1.0), (0.2, 0.2, 0.4), properties={"color": "white"}),
        box(3, "lamp", (3.0, 0.0, 2.0), (0.4, 0.4, 0.6)),
        box(4, "door", (0.0, 3.0, 1.0), (0.9, 0.1, 2.0)),
        box(5, "chair", (0.0, 1.0, 0.45), (0.5, 0.5, 0.9)),
        box(6, "chair", (0.0, -2.0, 0.45), (0.5, 0.5, 0.9)),
        box(7, "chair", (0.0, -4.0, 0.45), (0.5, 0.5, 0.9)),
    ),
    places=(Place(id="d", kind="Room", name="study"),),
    relations=(
        Relation(source=2, target=1, label="on"),
        Relation(source=5, target=1, label="next_to"),
        *(Relation(source="d", target=n, label="contains") for n in (1, 2, 5, 6)),
    ),
)
LOFT = SceneGraph(
    name="loft",
    up="-y",
    objects=(
        box(21, "chair", (0.0, -0.45, 0.0), (0.5, 0.9, 0.5)),
        box(22, "lamp", (0.0, -2.3, 0.0), (0.4, 0.4, 0.4), caption="a red lamp with a green shade on a white wall"),
        box(23, "lamp", (1.0, -0.2, 0.0), (0.4, 0.4, 0.4), caption="a lamp"),
    ),
)
LAMPS: dict[ObjectId, float] = {2: 0.9, 3: 0.8, 22: 0.9, 23: 0.8}
CHAIRS: dict[ObjectId, float] = {5: 0.9, 6: 0.9, 7: 0.8, 21: 0.9}
TABLES: dict[ObjectId, float] = {1: 0.9, 5: 0.1}
DEGREES: Mapping[str, Mapping[ObjectId, float]] = {
    **dict.fromkeys(("lamp", "lamps"), LAMPS),
    **dict.fromkeys(("chair", "chairs"), CHAIRS),
    **dict.fromkeys(("table", "tables"), TABLES),
    "door": {4: 0.9},
    "piano": {1: 0.1, 5: 0.05},
    "red": {22: 0.9},
}


@pytest.fixture(scope="module")
def den() -> Iterator[Database]:
    with store(DEN, degrees=DEGREES) as opened:
        yield opened


@pytest.fixture(scope="module")
def loft() -> Iterator[Database]:
    with store(LOFT, degrees=DEGREES) as opened:
        yield opened


@pytest.fixture(scope="module")
def both() -> Iterator[Database]:
    with store(DEN, LOFT, degrees=DEGREES) as opened:
        yield opened


def ask(db: Database, question: str, previous: Answer | None = None) -> Answer:
    return db.ask(question, model=False, previous=previous)


@pytest.mark.parametrize(
    ("question", "said", "achievable"),
    [
        ("how far is the lamp on the table from the door?", "#2 lamp is 2.85 m from #4 door", True),
        ("how tall is the door?", "#4 door is 2.00 m tall", True),
        ("how big is the table", "#1 table is 1.60 × 0.80 × 0.80 m (width × depth × height), 1.02 m³", True),
        ("what colour is the table?", "#1 table: brown", True),
        ("the nearest chair to the door", "#5 chair is 1.70 m from #4 door", True),
        ("the two chairs nearest to the door", "nearest to door: #5 chair (1.70 m), #6 chair (4.70 m)", True),
        ("the second nearest chair to the door", "second nearest to door: #6 chair (4.70 m)", True),
        ("the tallest thing", "tallest: #4 door (2.00 m tall)", True),
        ("the highest lamp", "highest: #3 lamp (1.70 m above the floor)", True),
        ("how high is the lamp on the table above the floor?", "#2 lamp is 0.80 m above the floor", True),
        ("how many chairs are there?", "3 chairs: #5 chair, #6 chair, #7 chair", True),
        ("how many chairs are there in the study?", "2 chairs: #5 chair, #6 chair", True),
        ("how many chairs are in each room?", "2 chairs in all: study 2", True),
        ("are there more chairs than tables?", "yes: 3 chairs, 1 table", True),
        ("are there fewer chairs than lamps?", "no: 3 chairs, 2 lamps", False),
        ("are there as many chairs as pianos?", "no: 3 chairs, 0 pianos", False),
        ("what are there more of, chairs or lamps?", "chairs: 3 chairs, 2 lamps", True),
        ("are there at least three chairs?", "yes: 3 chairs: #5 chair, #6 chair, #7 chair", True),
        ("are there more than 3 chairs?", "no: 3 chairs: #5 chair, #6 chair, #7 chair", False),
        ("is there a door?", "yes: 1 door: #4 door", True),
        ("is there a piano?", "no: nothing fits; the nearest is #1 table (not a piano), then #5 chair", False),
        ("where is the table?", "#1 table is in the study", True),
        ("what is on the table?", "1 fits: #2 lamp; #2 lamp on #1 table", True),
        ("what is on the door?", "nothing fits: nothing is on the door", False),
        ("what is on the piano?", "nothing fits; there is no piano here", False),
        ("is the lamp on the door?", "no: #2 lamp (not on the door), then #3 lamp (not on the door)", False),
        ("bigger than the piano", "nothing fits; there is no piano here", False),
        ("lamps at least 1 m tall", "nothing fits; the nearest is #3 lamp (0.60 m tall, not at least 1 m tall)", False),
        ("chairs in the garage", "nothing fits; the nearest is #5 chair (not in the garage), then #6", False),
    ],
)  # fmt: skip
def test_the_answer_in_words(den: Database, question: str, said: str, achievable: bool) -> None:
    answer = ask(den, question)
    assert answer.explanation.startswith(said)
    assert answer.achievable is achievable


def test_what_was_measured_is_in_the_record(den: Database) -> None:
    record = json.loads(json.dumps(ask(den, "how far is the lamp on the table from the door?").to_dict()))
    first = record["facts"][0]
    assert (first["what"], first["unit"]) == ("distance", "m")
    assert first["value"] == pytest.approx(2.85)
    assert [one["id"] for one in first["objects"]] == [2, 4]
    (count,) = ask(den, "how many chairs are there?").facts
    assert (count.what, count.value, [node.id for node in count.objects]) == ("count", 3, [5, 6, 7])
    assert {(fact.what, fact.value) for fact in ask(den, "what colour is the table?").facts} == {("color", "brown")}
    assert ask(den, "how many pianos are there?").facts[0].value == 0


def test_what_a_question_leaves_open_is_said(den: Database) -> None:
    nearest = ask(den, "the nearest chair")
    assert nearest.achievable and len(nearest.objects) == 3
    assert nearest.ignored == ('nearest: to what is not said (as in "nearest to the door")',)
    assert "where one stands" in ask(den, "what is left of the table?").assumed[0]
    assert "no weights" in ask(den, "something heavier than the chair").assumed[-1]
    older = ask(den, "a chair older than the door")
    assert older.ignored == ("older than the door: the map holds nothing to tell that by",)
    assert older.to_dict()["ignored"] == list(older.ignored)


def test_scenes_are_told_apart(both: Database) -> None:
    assert ask(both, "how many chairs are there?").explanation.startswith("4 chairs (3 in den, 1 in loft): ")
    most = ask(both, "which scene has the most chairs?")
    assert most.explanation == "den has 3 chairs (loft 1)"
    assert {(fact.scene, fact.value) for fact in most.facts} == {("den", 3), ("loft", 1)}
    assert ask(both, "which scene has the fewest tables?").explanation == "loft has 0 tables (den 1)"
    assert ask(both, "in which scene is the door?").explanation == "den (1 door)"
    assert ask(both, "lamps").explanation.startswith("4 fit: #2 lamp in den, #22 lamp in loft")
    assert ask(both, "where is the lamp?").explanation.startswith(
        "#2 lamp is in the study, on #1 table; #22 lamp is at x"
    )
    lamp = ask(both, "the highest lamp in loft")
    assert ask(both, "where is it?", lamp).explanation.startswith("#22 lamp is at x 0.00, y -2.30, z 0.00 m")
    assert ask(both, "what is next to it?", lamp).assumed == (
        "next to it: the map holds no relations, taken as within 1 m",
    )
    assert ask(both, "how many chairs are there in loft?").explanation == "1 chair: #21 chair"


def test_up_is_the_scenes_own(loft: Database, both: Database) -> None:
    assert ask(loft, "the highest lamp").explanation == "highest: #22 lamp (2.10 m above the floor)"
    assert ask(loft, "things higher than 2 m above the floor").ids == (22,)
    assert set(ask(both, "lamps higher than 1.5 m above the floor").ids) == {3, 22}
    assert ask(both, "how high is the lamp above the floor?").ignored


def test_what_captions_say_of_the_thing_itself(loft: Database) -> None:
    red, untold = ask(loft, "what colour is the lamp?").explanation.split("; ")
    assert red.startswith("#22 lamp: red, by its caption")
    assert untold.startswith("#23 lamp: not told")


def test_questions_that_follow_up(den: Database) -> None:
    chairs = ask(den, "chairs")
    assert ask(den, "which of these is the nearest to the door?", chairs).ids == (5,)
    assert ask(den, "how far is it from the door?", chairs).explanation == "#5 chair is 1.70 m from #4 door"
    assert ask(den, "how far is the second one from the door?", chairs).explanation == "#6 chair is 4.70 m from #4 door"
    assert ask(den, "how tall are they?", chairs).explanation.count("0.90 m tall") == 3
    assert set(ask(den, "how many of them are in the study?", chairs).ids) == {5, 6}
    lamp = ask(den, "what is on the table?")
    assert ask(den, "what is it on?", lamp).query
    assert ask(den, "what is under it", ask(den, "the highest lamp")).explanation.startswith("nothing fits")
    assert ask(den, "what is on it", ask(den, "tables")).ids == (2,)
    assert any("found before: #1 table" in line for line in ask(den, "what is on it", ask(den, "tables")).understood)


def test_a_question_that_points_to_nothing_is_an_error(den: Database) -> None:
    with pytest.raises(UsageError, match="points back"):
        ask(den, "what is under it?")


@pytest.mark.parametrize(
    ("question", "said"),
    [
        ("chairs taller than the table", "3 fit: #5 chair (0.90 m tall)"),
        (
            "chairs taller than the door",
            "nothing fits; the nearest is #5 chair (0.90 m tall, not taller than the door)",
        ),
    ],
)
def test_comparisons_that_outgrow_a_limit_are_narrowed(den: Database, question: str, said: str) -> None:
    answer = den.ask(question, model=False, limits=Limits(rows=20))
    assert answer.explanation.startswith(said)
    assert any("only those that fit" in line for line in answer.warnings)
    assert " IN [" not in answer.query


HOSTILE = 'la"mp\\") RETURN 1 //\n`'


def test_names_that_look_like_syntax_stay_names() -> None:
    nasty = "a\"b\\c'`#$)"
    scene = SceneGraph(
        name='de"n',
        objects=(
            box(nasty, HOSTILE, (0.0, 0.0, 0.2), (0.2, 0.2, 0.4), caption='a "red"\nlamp\\', properties={"color": '"'}),
            box("t", "table", (0.0, 0.0, 0.0), (1.0, 1.0, 0.1)),
        ),
        places=(Place(id="r", kind="Room", name='kit"chen\n'),),
        relations=(
            Relation(source=nasty, target="t", label="on"),
            Relation(source="r", target=nasty, label="contains"),
        ),
    )
    degrees: dict[str, dict[ObjectId, float]] = {"lamp": {nasty: 0.9}, "table": {"t": 0.9}}
    with store(scene, degrees=degrees) as db:
        for question in (
            "where is the lamp?", "is the lamp next to the table?", "how many lamps?", "what colour is the lamp?",
            "the nearest lamp to the table", "what is on the table?", "is there a piano?", 'lamp in the kit"chen',
        ):  # fmt: skip
            answer = ask(db, question)
            json.dumps(answer.to_dict(why=True))
            assert "\n" not in answer.explanation
        before = ask(db, "lamp")
        assert before.ids == (nasty,)
        assert ask(db, "what is under it?", before).query
        assert ask(db, "where is it?", before).ids == (nasty,)
