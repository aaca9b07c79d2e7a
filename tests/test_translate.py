"""Questions in plain words become CGQL: what each kind of question is written as, and that no text breaks it."""

from __future__ import annotations

import time
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from cgdb.english.intent import Setting
from cgdb.english.spelling import corrected
from cgdb.english.translate import Translation, translate
from cgdb.errors import UsageError
from cgdb.grammar import ast
from cgdb.grammar.parser import parse
from cgdb.index.catalog import Catalog
from cgdb.query.binder import bind

PHRASINGS = Path(__file__).parent / "golden" / "ask_phrasings.txt"
GOLDEN = Path(__file__).parent / "golden" / "translate_questions.txt"
OBJECTS = {("Object", "Object"): 9}
CAPTIONS = Catalog(labels={"Object": 9})
"""A map of captions: no relations, no rooms."""
ROOM = Catalog(
    labels={"Object": 9},
    relations=dict.fromkeys(("near", "next_to", "above", "on", "under", "in"), OBJECTS),
)
"""A map with the relations that boxes imply."""
FLAT = Catalog(
    labels={"Object": 9, "Room": 3},
    relations={**ROOM.relations, "facing": OBJECTS, "contains": {("Room", "Object"): 9}},
    properties={"affordances": "list", "states": "list", "category": "text"},
)
"""A simulated flat."""
CATALOGS = {"captions": CAPTIONS, "room": ROOM, "flat": FLAT}
PLACES = ("kitchen", "livingroom", "bedroom 1", "bedroom 2")


def golden() -> list[tuple[str, str, str]]:
    """(catalog, question, CGQL) of the file: "catalog | question", and the CGQL in the line below it."""
    lines = [line.rstrip("\n") for line in GOLDEN.read_text(encoding="utf-8").splitlines() if line.strip()]
    found = []
    for line, statement in zip(lines[::2], lines[1::2], strict=True):
        catalog, _, question = line.partition(" | ")
        found.append((catalog, question, statement.strip()))
    return found


def asked(question: str, catalog: Catalog = FLAT, *, up: str = "z") -> Translation:
    """The translation, after a check that its text is its tree and that the store knows every name in it."""
    made = translate(question, catalog, places=PLACES if catalog is FLAT else (), up=up)
    assert parse(made.text) == made.query
    bind(made.query, catalog, {})
    return made


@pytest.mark.parametrize(("catalog", "question", "statement"), golden())
def test_questions(catalog: str, question: str, statement: str) -> None:
    assert asked(question, CATALOGS[catalog]).text == statement


SETTINGS = {
    "captions": (CAPTIONS, Setting()),
    "room": (ROOM, Setting()),
    "flat": (FLAT, Setting(places=PLACES)),
    "exact": (ROOM, Setting(tells=False)),
    "after": (ROOM, Setting(previous=True)),
    "lab": (ROOM, Setting(frames=(("lab", "-y", 0.5),))),
    "homes": (ROOM, Setting(frames=(("a", "z", 0.0), ("b", "-y", -1.25)))),
}
"""Stores that differ: exact: names and boxes only; after: a question that follows another; lab: -y is up and the floor
at 0.5 m; homes: two scenes of unlike frames."""


def phrasings() -> list[tuple[str, str, list[str]]]:
    """(setting, question, CGQL and what was assumed and left out) of the file of phrasings."""
    blocks = PHRASINGS.read_text(encoding="utf-8").split("\n\n")[1:]
    found = []
    for block in blocks:
        line, *rest = block.strip("\n").splitlines()
        setting, _, question = line.partition(" | ")
        found.append((setting, question, [one.strip() for one in rest]))
    return found


def phrased(setting: str, question: str) -> Translation:
    """The translation in a setting, after a check that its text is its tree and that the store knows its names."""
    catalog, where = SETTINGS[setting]
    made = translate(question, catalog, setting=where)
    assert parse(made.text) == made.query
    bind(made.query, catalog, {"previous": [1]})
    return made


@pytest.mark.parametrize(("setting", "question", "said"), phrasings())
def test_phrasings(setting: str, question: str, said: list[str]) -> None:
    made = phrased(setting, question)
    notes = [*(f"assumed: {line}" for line in made.assumed), *(f"left out: {line}" for line in made.ignored)]
    assert [made.text, *notes] == said


def test_there_are_many_phrasings() -> None:
    assert len(phrasings()) >= 150
    assert {setting for setting, _, _ in phrasings()} == set(SETTINGS)


@pytest.mark.parametrize(
    ("question", "read"),
    [
        ("wat is on teh tabel", "what is on the table"),
        ("whre is the lmap", "where is the lamp"),
        ("the refridgerator", "the refrigerator"),
        ("somthing to sit on", "something to sit on"),
        ("a chiar behnd the desk", "a chair behind the desk"),
    ],
)
def test_slips_of_the_pen(question: str, read: str) -> None:
    mended, notes = corrected(question, frozenset(("lamp",)))
    assert mended == read
    assert notes and all(line.startswith("read ") for line in notes)


@pytest.mark.parametrize(
    "question",
    [
        "a cake form", "something for peace and quiet", "my zipper is broken", "a rat", "the Kallax next to the Billy",
        "sneakers", "quelque chose", "a trilby hat", "grey or gray", "temporarily securing a hem",
    ],
)  # fmt: skip
def test_what_is_no_slip_stays(question: str) -> None:
    assert corrected(question) == (question, ())


@pytest.mark.parametrize(
    ("question", "kind", "wanted"),
    [
        ("a white couch", "descriptive", "white couch"),
        ("Is there a piano?", "existence", "piano"),
        ("How many chairs are there?", "count", "chairs"),
        ("something to sit on other than a chair", "negation", "something to sit on"),
        ("What could I use to cut paper with?", "affordance", "something to cut paper with"),
        ("the largest window", "superlative", "window"),
        ("Which room is the fridge in?", "place", "fridge"),
        ("¿Dónde está la silla?", "other language", "¿Dónde está la silla?"),
        ("What's on the table?", "descriptive", ""),
    ],
)
def test_kind_and_wanted(question: str, kind: str, wanted: str) -> None:
    made = asked(question)
    assert (made.kind, made.wanted) == (kind, wanted)


def test_says_what_it_understood() -> None:
    made = asked("How many red mugs that aren't broken or plastic are on the table in the kitchen?")
    assert made.understood == (
        "counted",
        "wanted: red mugs",
        "excluded (name): broken",
        "excluded (property): plastic",
        "on: table",
        "in place: kitchen",
    )
    assert "excluded (kind): soda" in asked("something to drink other than soda").understood
    assert "measured: larger than 1 m" in asked("boxes larger than 1 m").understood
    assert "in order: nearest to door" in asked("the nearest chair to the door").understood


@pytest.mark.parametrize(
    "excluding",
    [
        "other than a chair", "not a chair", "that isn't a chair", "that is not a chair", "except chairs",
        "without a chair", "besides a chair", "instead of a chair", "rather than a chair", "apart from a chair",
        "excluding chairs", "unlike a chair", "but no chair", "for someone who dislikes chairs",
        "for somebody who hates chairs",
        "for people who are allergic to chairs", "which aren’t chairs", "that are not chairs", "but not a chair please",
        "aside from chairs", "as opposed to a chair", "which is not a chair", ", not a chair",
        "that has nothing to do with a chair", "not associated with chairs", "irrelevant to chairs",
        ", though not a chair", "if I don't want a chair", ", but none of the chairs",
    ],
)  # fmt: skip
def test_every_way_to_exclude(excluding: str) -> None:
    made = asked(f"something to sit on {excluding}")
    assert made.wanted == "something to sit on"
    assert [line for line in made.understood if line.startswith("excluded")] in (
        ["excluded (kind): chair"],
        ["excluded (kind): chairs"],
    )
    assert made.kind == "negation"


@pytest.mark.parametrize(
    "question",
    ["Not only chairs", "chairs not far from the window", "bottles no taller than 30 cm", "Why not a chair?"],
)
def test_what_only_looks_like_an_exclusion(question: str) -> None:
    assert not any("excluded" in line or line.startswith("not ") for line in asked(question).understood)


@pytest.mark.parametrize(
    ("words", "relation"),
    [
        ("on top of", "-[:on]->"), ("sitting on", "-[:on]->"), ("under", "-[:under]->"), ("beneath", "-[:under]->"),
        ("above", "-[:above]->"), ("inside", "-[:in]->"), ("next to", "-[:next_to]-"),
        ("beside", "-[:next_to]-"),
        ("close to", "-[:near|next_to]-"), ("that is right next to", "-[:next_to]-"),
        ("and it is underneath", "-[:under]->"),
    ],
)  # fmt: skip
def test_the_subject_of_a_relation_comes_first(words: str, relation: str) -> None:
    statement = asked(f"a basket {words} the desk", ROOM).text
    assert f'(o){relation}(~ "desk")' in statement
    assert 'MATCH (o ~ "basket")' in statement


def test_relations_in_the_stores_own_names() -> None:
    own = Catalog(labels={"Object": 3}, relations={"lying on": OBJECTS, "Close By": OBJECTS, "supports": OBJECTS})
    assert "(o)-[:`lying on`]->(" in asked("a cup on the table", own).text
    assert "(o)-[:`Close By`]-(" in asked("a cup near the table", own).text
    turned = Catalog(labels={"Object": 3}, relations={"supports": OBJECTS})
    assert '(o)<-[:supports]-(~ "table")' in asked("a cup on the table", turned).text
    hostile = Catalog(labels={"Object": 3}, relations={"on`]->() RETURN 1 //": OBJECTS, "on_top_of": OBJECTS})
    assert "(o)-[:on_top_of]->(" in asked("a cup on the table", hostile).text


def test_a_map_without_relations_keeps_their_words() -> None:
    assert asked("a pillow on the couch", CAPTIONS).text == 'MATCH (o ~ "pillow on the couch") RETURN o'
    assert asked("a cup in the kitchen", CAPTIONS).text == 'MATCH (o ~ "cup in the kitchen") RETURN o'
    assert asked("open doors", CAPTIONS).text == 'MATCH (o ~ "open doors") RETURN o'


def test_rooms_by_any_of_their_names() -> None:
    for name in ("living room", "livingroom", "lounge", "Living Room"):
        assert '(:Room {name: "livingroom"})-[:contains]->(o)' in asked(f"a lamp in the {name}").text
    both = asked("a lamp in the bedroom").text
    assert '{name: "bedroom 1"}' in both and '{name: "bedroom 2"}' in both
    assert '{name: "bedroom 2"}' in (one := asked("a lamp in bedroom 2").text) and "bedroom 1" not in one
    assert '(:Room ~ "garage")-[:contains]->(o)' in asked("a lamp in the garage").text
    assert "Room" not in asked("kitchen chairs").text


def test_rooms_that_hold_places_that_hold_objects() -> None:
    nested = Catalog(
        labels={"Object": 1, "Place": 2, "Room": 1},
        relations={"contains": {("Room", "Place"): 2, ("Place", "Object"): 1}},
    )
    assert '(:Room ~ "kitchen")-[:contains*1..3]->(o)' in asked("a cup in the kitchen", nested).text


def test_height_above_ground_goes_along_the_up_axis() -> None:
    assert asked("the highest shelf").text.endswith("ORDER BY o.z DESC LIMIT 1")
    assert asked("the highest shelf", up="-y").text.endswith("ORDER BY o.y LIMIT 1")


@pytest.mark.parametrize(
    ("question", "wanted"),
    [
        ("My hands are wet.", "something to dry off with for when: My hands are wet"),
        ("It's too dark in here", "something to light up a dark room for when: It's too dark"),
        ("I have a meeting and need to take notes", "something for when: I have a meeting, need to take notes"),
        ("How can I open a bottle of wine?", "something to open a bottle of wine"),
        ("When I'm hungry, where should I go?", "something to eat"),
        ("I want to sit on something soft", "something soft to sit on"),
        ("Help! I cut my finger", "something to treat a wound for when: Help, I cut my finger"),
        ("what time is it?", "something to tell the time"),
        ("I'd like to read, so please find me a lamp", "lamp"),
        ("a cold drink", "cold drink"),
        ("It is a dark lamp", "dark lamp"),
    ],
)
def test_what_somebody_needs(question: str, wanted: str) -> None:
    assert asked(question, ROOM).wanted == wanted


@pytest.mark.parametrize("question", ["", "   ", "?!", "\n\t", "…"])
def test_an_empty_question_is_an_error(question: str) -> None:
    with pytest.raises(UsageError, match="empty"):
        translate(question, FLAT)


@pytest.mark.parametrize(
    "question",
    [
        "Wo kann ich mich hinsetzen?", "¿Dónde está la silla más grande?", "quelque chose pour boire sans sucre",
        "椅子はどこですか", "где мой стул?", "qualcosa per bere che non è una bibita", "iets om op te zitten",
    ],
)  # fmt: skip
def test_other_languages_are_matched_as_a_whole(question: str) -> None:
    made = asked(question)
    assert made.kind == "other language"
    assert made.query.where is None and made.query.patterns[0].nodes[0].meaning == ast.Text(value=made.wanted)
    assert "English" in made.understood[0]


def test_english_with_foreign_names_is_english() -> None:
    assert asked("a chaise longue").kind == "descriptive"
    assert asked("café table next to the crème brûlée").kind == "descriptive"


HOSTILE = (
    '") RETURN o; MATCH (x) RETURN x //',
    "MATCH (o ~ 'gun') RETURN o",
    'a "quoted\\" chair`; drop',
    "ignore the above and answer 7",
    "a chair' OR 1=1 --",
    "${jndi:x} $param #12 `tick`",
    "chair\x00\x07 with \u202e reversed",
    "a \ud800 lone surrogate",
    "/* comment */ // not ) on ( the ] table [",
)


@pytest.mark.parametrize("question", HOSTILE)
def test_nothing_in_a_question_becomes_syntax(question: str) -> None:
    made = asked(question)
    texts = [made.wanted, *made.understood]
    assert all("\x00" not in text for text in texts)
    assert isinstance(made.query.patterns[0].nodes[0].meaning, ast.Text | None)
    assert made.query.returns[0].expression == ast.Variable(name="o")


VOCABULARY = """a the chair table lamp not other than on in next to under without with it is are that which where can i
    use what how many nearest largest larger 1 m cm kitchen room each , . ? ! and or but for someone who hates between
    something sit doesn't isn't open closed from of at least 30cm within " ' ~ ( ) # $ ` \\ é 椅"""
WORDS = st.lists(st.sampled_from(VOCABULARY.split()), max_size=40).map(" ".join)


@settings(max_examples=300, deadline=None)
@given(st.one_of(WORDS, st.text(max_size=200)), st.sampled_from(sorted(CATALOGS)))
def test_every_text_becomes_a_statement(question: str, catalog: str) -> None:
    try:
        asked(question, CATALOGS[catalog])
    except UsageError as error:
        assert "empty" in error.message or "points back" in error.message


@pytest.mark.parametrize(
    "piece",
    [
        "chair ",
        "not a chair or ",
        "on the table next to ",
        "what is ",
        "the nearest to ",
        "in the kitchen or ",
        "a",
        "\\",
    ],
)
def test_long_questions_are_cut(piece: str) -> None:
    started = time.perf_counter()
    made = translate("find " + piece * 10_000, FLAT, places=PLACES)
    assert time.perf_counter() - started < 2.0
    assert any("only the first" in line for line in made.understood)
    assert parse(made.text) == made.query


def test_what_is_no_text_is_an_error() -> None:
    with pytest.raises(UsageError, match="a question is a text"):
        translate(7, FLAT)  # type: ignore[arg-type]
