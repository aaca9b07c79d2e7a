"""What a map, or a model, says of its things in properties decides questions that no model is asked."""

from __future__ import annotations

import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import cgdb
from cgdb.asking.answer import Answer
from cgdb.cli.app import main
from cgdb.database import Database
from cgdb.english.translate import translate
from cgdb.index.catalog import Catalog
from cgdb.ingest import load
from cgdb.meaning.knowledge import knowledge
from cgdb.meaning.told import FLEXIBLE, Says, Statement, masks, reasons, statements
from cgdb.model.llm import Model, connect
from cgdb.model.llm_settings import Settings
from cgdb.scene import PropertyValue, SceneGraph, SceneObject
from cgdb.testing import store
from tests import model_server as server
from tests.model_server import ModelServer

pytestmark = pytest.mark.usefixtures("no_model")

FLAT = Path(__file__).parents[1] / "cli" / "flat.json"


def noted(**properties: PropertyValue) -> dict[str, PropertyValue]:
    """Properties as ``cgdb enrich`` writes them."""
    return {**properties, "enriched": tuple(sorted(properties)), "enriched_by": "little"}


THINGS: dict[str, tuple[str, dict[str, PropertyValue]]] = {
    "plain dumbbell": ("dumbbell", {}),
    "featherlight dumbbell": ("dumbbell", noted(weight_class="light", rigidity="soft", materials=("foam",))),
    "book": ("book", {}),
    "book of lead": ("book", {"mass": 40, "colour": "red"}),
    "cushion": ("cushion", {}),
    "marble cushion": ("cushion", noted(rigidity="rigid", materials=("marble",), colors=("white",))),
    "brick cushion": ("cushion", {"material": "velvet", "color": "brick-red"}),
    "wooden chair": ("chair", {"material": "oak"}),
    "steel chair": ("chair", noted(materials=("stainless steel",))),
    "scissors": ("scissors", {}),
    "odd thing": ("plastic thing with a notch", noted(affordances=("cut paper", "open letters"))),
    "odd seat": ("grey thing on a stand", {"affordances": ("sit on", "rest your feet on")}),
    "glass": ("drinking glass", {"affordances": ("drink",)}),
    "lever": ("light switch", noted(weight_class="fixed")),
    "rug": ("rug", noted(traversable=True, typical_places=("living room",))),
    "sofa": ("sofa", noted(traversable=False, typical_places=("living room",))),
}
NAMES = tuple(THINGS)


def scene(*, told: bool = True) -> SceneGraph:
    """The things, with what is told of them or without."""
    return SceneGraph(
        name="things",
        objects=tuple(
            SceneObject(id=i, tag=tag, caption=f"a {tag}", properties=properties if told else {})
            for i, (tag, properties) in enumerate(THINGS.values())
        ),
    )


@pytest.fixture(scope="module", params=["vectors", "words"])
def stores(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Iterator[tuple[Database, ...]]:
    """With what is told, and without; with the encoder, and by words alone."""
    folder = tmp_path_factory.mktemp("stores")
    more: dict[str, Any] = {"text_encoder": None} if request.param == "words" else {}
    with (
        cgdb.open(folder / "told.cgdb", create=True, **more) as told,
        cgdb.open(folder / "bare.cgdb", create=True, **more) as bare,
    ):
        told.add(scene())
        bare.add(scene(told=False))
        yield told, bare


def degrees(db: Database, text: str) -> dict[str, float]:
    """{name of the thing: degree}."""
    found = {row[0].id: row.score for row in db.query("MATCH (o ~ $text) RETURN o", {"text": text})}  # type: ignore[union-attr]
    return {name: found.get(i, 0.0) for i, name in enumerate(NAMES)}


@pytest.mark.parametrize(
    ("text", "now", "no_more"),
    [
        ("something light", ["featherlight dumbbell"], ["book of lead", "lever"]),
        ("something heavy", ["book of lead"], ["featherlight dumbbell"]),
        ("a heavy book", ["book of lead"], []),
        ("something soft", ["featherlight dumbbell"], ["marble cushion"]),
        ("something rigid", ["marble cushion"], ["featherlight dumbbell"]),
        ("a metal chair", ["steel chair"], []),
        ("something red", ["book of lead", "brick cushion"], []),
        ("something to cut paper with", ["odd thing"], []),
        ("something to open a letter with", ["odd thing"], []),
        ("something to sit on", ["odd seat"], []),
        ("something made of oak", ["wooden chair"], []),
    ],
)
def test_what_is_told_comes_before_what_is_usual(
    stores: tuple[Database, ...], text: str, now: list[str], no_more: list[str]
) -> None:
    told, bare = degrees(stores[0], text), degrees(stores[1], text)
    for name in now:
        assert told[name] >= 0.5 > bare[name], (name, told[name], bare[name])
    for name in no_more:
        assert told[name] < 0.5 <= bare[name] + 0.15, (name, told[name], bare[name])


def test_what_has_no_such_properties_stays_where_it_is(stores: tuple[Database, ...]) -> None:
    for text in ("something light", "something to cut paper with", "something to sit on", "a red chair"):
        told, bare = degrees(stores[0], text), degrees(stores[1], text)
        for name in ("plain dumbbell", "book", "cushion", "scissors"):
            assert told[name] == pytest.approx(bare[name], abs=1e-6)


def test_not_is_told_too(stores: tuple[Database, ...]) -> None:
    found = stores[0].query('MATCH (o ~ "something soft") WHERE NOT o ~ "something red" RETURN o.id')
    fitting = {NAMES[row[0]] for row in found if row.fits}  # type: ignore[index]
    assert "brick cushion" not in fitting
    assert "marble cushion" not in fitting
    found = stores[0].query('MATCH (o ~ "chair") WHERE NOT o ~ "made of metal" RETURN o.id')
    assert [NAMES[row[0]] for row in found if row.fits] == ["wooden chair"]  # type: ignore[index]


def test_a_model_is_believed_less_than_the_map() -> None:
    properties: dict[str, PropertyValue] = {"rigidity": "soft", "affordances": ("cut paper",)}
    both = SceneGraph(
        name="both",
        objects=(
            SceneObject(id=0, tag="brick", properties=properties),
            SceneObject(id=1, tag="brick", properties=noted(**properties)),
            SceneObject(id=2, tag="brick"),
        ),
    )
    with store(both) as db:
        for text in ("something soft", "something to cut paper with"):
            found = {row[0].id: row.score for row in db.query("MATCH (o ~ $t) RETURN o", {"t": text})}  # type: ignore[union-attr]
            assert found[0] > found[1] > 0.5 > found[2]


def test_a_verb_alone_does_not_say_the_part_that_a_thing_plays(stores: tuple[Database, ...]) -> None:
    """A glass of which a map says "drink" is to be drunk from."""
    assert degrees(stores[0], "something to drink from")["glass"] >= 0.5
    assert degrees(stores[0], "something to drink")["glass"] < degrees(stores[0], "something to drink from")["glass"]


def test_reasons_say_who_said_it(stores: tuple[Database, ...]) -> None:
    def why(name: str, text: str) -> str:
        result = stores[0].query(f"MATCH (o #{NAMES.index(name)}) WHERE o ~ $text RETURN o", {"text": text})
        return " ".join(str(value) for reason in result.rows[0].why for value in reason.evidence.values())

    assert "noted by little: light" in why("featherlight dumbbell", "something light")
    assert "its map says: 40 kg" in why("book of lead", "something heavy")
    assert "noted by little: cut paper" in why("odd thing", "something to cut paper with")
    assert "noted by little: made of stainless steel" in why("steel chair", "a metal chair")
    assert "its map says: made of oak" in why("wooden chair", "something wooden")
    assert "says" not in why("book of lead", "something to read")
    assert "noted" not in why("plain dumbbell", "something light")


def test_the_command_says_why(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    with cgdb.open(tmp_path / "s.cgdb", create=True, text_encoder=None) as db:
        db.add(scene())
    assert main(["query", str(tmp_path / "s.cgdb"), 'MATCH (o ~ "something light") RETURN o', "--why"]) == 0
    assert "noted by little: light" in capsys.readouterr().out


def test_a_changed_property_is_asked_at_once(tmp_path: Path) -> None:
    with cgdb.open(tmp_path / "s.cgdb", create=True, text_encoder=None) as db:
        db.add(scene(told=False))
        assert degrees(db, "something light")["featherlight dumbbell"] < 0.5
        with db.write("things", on_existing="merge") as writer:
            writer.objects([scene().objects[1]])
        assert degrees(db, "something light")["featherlight dumbbell"] >= 0.5
        before = db.query('AS OF 1 MATCH (o #1) WHERE o ~ "something light" RETURN o')
        assert not before.rows[0].fits


# -- reading properties -----------------------------------------------------------------------------------------


def traits(**properties: object) -> set[str]:
    mask = masks(statements(properties))[0]
    names = {name for i, name in enumerate(knowledge().traits) if mask >> i & 1}
    return names | ({"flexible"} if mask >> FLEXIBLE & 1 else set())


@pytest.mark.parametrize(
    ("name", "value", "said"),
    [
        ("material", "solid oak with brass feet", {"wood", "metal"}),
        ("materials", ("Memory foam", "cotton"), {"foam", "fabric"}),
        ("material", "silver", {"metal"}),
        ("color", "silver", {"gray"}),
        ("colours", ("light blue",), {"blue"}),
        ("material", "not wood", set()),
        ("weight_class", "medium", {"middling"}),
        ("weight_class", "fixed", {"fixed"}),
        ("weight", "very heavy", {"heavy"}),
        ("weight", "800 g", {"light"}),
        ("weight_kg", 12, {"middling"}),
        ("mass", 3.0, {"middling"}),
        ("mass", float("nan"), set()),
        ("mass", float("inf"), set()),
        ("mass", -1, set()),
        ("mass", True, set()),
        ("rigidity", "flexible", {"flexible"}),
        ("rigidity", "hard", {"rigid"}),
        ("rigidity", "red", set()),
        ("color", (1, 2, 3), set()),
        ("material", "", set()),
    ],
)
def test_traits_of_properties(name: str, value: object, said: set[str]) -> None:
    assert traits(**{name: value}) == said


def test_what_records_the_making_of_a_map_describes_nothing() -> None:
    making = {"traversable": True, "traversable_by": "a robot", "captioned_by": "gpt", "detected_tags": ("cat",)}
    assert list(statements({**making, "enriched": ("traversable",), "enriched_by": "little"})) == []


def test_names_of_simulators_are_no_phrases() -> None:
    found = list(statements({"affordances": ("GRABBABLE", "can_open", "sittable", "surfaces", "lean_on")}))
    assert [one.text for one in found if one.says is Says.USE] == ["lean on"]
    assert [one.text for one in found if one.says is Says.OTHER] == ["GRABBABLE", "can_open", "sittable", "surfaces"]


HOSTILE = st.one_of(
    st.text(max_size=300),
    st.sampled_from(
        [
            "x" * 100_000,
            "\x00\x1b[31m\u202e",
            "heavy " * 5_000,
            "'; DROP",
            "{}",
            "\ud7ff",
            "not not",
            "1e999 kg",
            "9" * 400,
        ]
    ),
    st.booleans(),
    st.none(),
    st.floats(),
    st.integers(),
    st.lists(st.text(max_size=20), max_size=60).map(tuple),
    st.lists(st.floats(), max_size=5).map(tuple),
)
PROPERTIES = st.dictionaries(
    st.sampled_from(
        (
            *("material", "colors", "weight_class", "mass", "rigidity", "affordances", "typical_places"),
            *("enriched", "enriched_by", "traversable", "Weight", "COLOR", "other"),
        )
    ),
    HOSTILE,
)


@settings(max_examples=150, deadline=None)
@given(PROPERTIES)
def test_any_value_is_read_without_harm(properties: dict[str, object]) -> None:
    found = list(statements(properties))
    assert all(isinstance(one, Statement) and 0 <= one.traits < 1 << 64 for one in found)
    for line in reasons(properties, (1 << 64) - 1, next((one.text for one in found if one.says is Says.USE), None)):
        assert line.isprintable()
        assert len(line) < 5_000


@settings(max_examples=15, deadline=None)
@given(st.lists(PROPERTIES, min_size=1, max_size=3))
def test_any_value_can_be_stored_and_asked(made: list[dict[str, PropertyValue]]) -> None:
    objects = tuple(SceneObject(id=i, tag="box", properties=_storable(p)) for i, p in enumerate(made))
    with store(SceneGraph(name="h", objects=objects)) as db:
        for text in ("something heavy", "something to cut paper with", "a red box", "made of oak", "box"):
            result = db.query("MATCH (o ~ $t) RETURN o", {"t": text})
            assert all(np.isfinite(row.score) and 0 <= row.score <= 1 and row.why for row in result)
        db.ask("what can the robot drive over?", model=False)
        db.ask("what belongs in the kitchen?", model=False)


def _storable(properties: dict[str, PropertyValue]) -> dict[str, PropertyValue]:
    """Without what no store takes: numbers that are none, or too large."""
    return {
        name: value
        for name, value in properties.items()
        if not any(
            isinstance(one, (int, float)) and not (-(2**62) < one < 2**62)
            for one in (value if isinstance(value, tuple) else (value,))
        )
    }


# -- conditions on properties -----------------------------------------------------------------------------------

CATALOG = Catalog(
    labels={"Object": 9},
    properties={"traversable": "boolean", "typical_places": "list"},
    relations={"on": {("Object", "Object"): 1}},
)


@pytest.mark.parametrize(
    ("question", "statement"),
    [
        ("What can the robot drive over?", "MATCH (o) WHERE o.traversable = true RETURN o"),
        ("something that my robot can roll across", "MATCH (o) WHERE o.traversable = true RETURN o"),
        ("Can the robot drive over the rug?", 'MATCH (o ~ "rug") WHERE o.traversable = true RETURN o'),
        ("rugs that the robot can drive over", 'MATCH (o ~ "rugs") WHERE o.traversable = true RETURN o'),
        ("traversable things", "MATCH (o) WHERE o.traversable = true RETURN o"),
        ("What can't the robot drive over?", "MATCH (o) WHERE o.traversable = false RETURN o"),
        ("cables the robot cannot drive over", 'MATCH (o ~ "cables") WHERE o.traversable = false RETURN o'),
        ("What is in its way?", "MATCH (o) WHERE o.traversable = false RETURN o"),
        ("Which chairs are in the robot's way?", 'MATCH (o ~ "chairs") WHERE o.traversable = false RETURN o'),
        ("obstacles for the robot", "MATCH (o) WHERE o.traversable = false RETURN o"),
        ("What blocks the robot?", "MATCH (o) WHERE o.traversable = false RETURN o"),
        ("what belongs into the kitchen?", 'MATCH (o) WHERE o.typical_places CONTAINS "kitchen" RETURN o'),
        ("What is usually kept in the bathroom?", 'MATCH (o) WHERE o.typical_places CONTAINS "bathroom" RETURN o'),
        ("something to drive nails with", 'MATCH (o ~ "something to drive nails with") RETURN o'),
    ],
)
def test_questions_that_a_property_answers(question: str, statement: str) -> None:
    assert translate(question, CATALOG).text == statement


@pytest.mark.parametrize("question", ["What can the robot drive over?", "what belongs into the kitchen?", "obstacles"])
def test_without_the_property_the_words_decide(question: str) -> None:
    for properties in ({}, {"traversable": "text", "typical_places": "mixed"}):
        made = translate(question, Catalog(labels={"Object": 9}, properties=properties))
        assert "traversable" not in made.text
        assert "typical" not in made.text


# -- from a model to answers without one ------------------------------------------------------------------------

KNOWN: dict[str, dict[str, Any]] = {
    "rug": {"affordances": ["do yoga on"], "rigidity": "flexible", "traversable": True},
    "bathroom scale": {"typical_places": ["bathroom"]},
    "ring of three brass keys": {"weight_class": "heavy"},
    "bread": {"weight_class": "light", "materials": ["sourdough"], "rigidity": "soft"},
    "fridge": {"weight_class": "fixed"},
}


def knowing(body: dict[str, Any]) -> str:
    """A model that knows some things of the flat, and the same of all others."""
    things = []
    for item in json.loads(server.user_text(body).splitlines()[1]):
        usual = {
            "affordances": ["look at"],
            "materials": ["plastic"],
            "colors": [],
            "weight_class": "medium",
            "rigidity": "rigid",
            "typical_places": ["living room"],
            "traversable": False,
        }
        more = next((more for word, more in KNOWN.items() if word in item["description"]), {})
        things.append({"number": item["number"], **usual, **more})
    return json.dumps({"objects": things})


def model(at: Any) -> Model:
    return connect(Settings(base_url=at.url, model="little", timeout=60.0, deadline=120.0), remember=False)


def fitting(answer: Answer) -> set[str]:
    return {str(row[0].tag) for row in answer.rows if row.fits}  # type: ignore[union-attr]


def test_an_enriched_flat_answers_better_without_a_model(tmp_path: Path) -> None:
    questions = {
        "What can the robot drive over?": {"rug"},
        "What belongs into the bathroom?": {"bathroom scale"},
        "something to do yoga on": {"rug"},
    }
    with cgdb.open(tmp_path / "flat.cgdb", create=True) as db:
        db.add(load(FLAT))
        before = {question: fitting(db.ask(question, model=False)) for question in questions}
        heavy = fitting(db.ask("something heavy", model=False))
        with ModelServer(knowing) as at:
            list(db.enrich(model=model(at)).run())
            asked = len(at.requests)
            for question, right in questions.items():
                assert before[question] != right
                answer = db.ask(question, model=False)
                assert fitting(answer) == right, question
                assert answer.achievable
            assert "keys" in fitting(db.ask("something heavy", model=False)) - heavy
            assert len(at.requests) == asked, "the model was asked once, when the store was enriched"
