"""Needs told as situations: which questions tell of one, what is kept of them, and what then fits."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from cgdb.asking.near_misses import _is_not
from cgdb.english.questions import understand
from cgdb.english.spelling import corrected
from cgdb.meaning import background, situations
from cgdb.meaning.calibration import Calibration
from cgdb.meaning.embed import text_encoder
from cgdb.meaning.knowledge import knowledge
from cgdb.meaning.scoring import Meaning, Scorer
from cgdb.meaning.texts import TextIndex

TELLS = """
the drain is clogged again | the drain is clogged again
my glasses keep fogging up | my glasses keep fogging up
it's snowing and we're off for a walk | it's snowing, we're off for a walk
mow the meadow and tidy it up | mow the meadow and tidy it up
my sleeve tore, can you help me out? | my sleeve tore, help me out
get the wax out of this rug | get the wax out of this rug
the milk is boiling over, quick | the milk is boiling over, quick
freezing my toes off | freezing my toes off
got to iron twenty shirts by tonight | got to iron twenty shirts by tonight
could you please dry up this puddle and warm me up | dry up this puddle and warm me up
"""
WHOLE = """
foggy morning. what will stop us bumping into the boats? | foggy morning, what will stop us bumping into the boats
the clock up on that wall wants winding and I can't reach the key | the clock up on that wall wants winding
One of the twins has grazed his elbow, bring whatever there is for cleaning it | One of the twins has grazed his elbow
"""
NAMES = """
cables the robot cannot drive over
something to hang coats on
a frobnicator
the pillow is on top of the chair
I need a lamp that is not broken
a Rubik's cube
the dog's bowl
lights that aren't on the ceiling
it is a small round table
bring me the chair that has a cushion on it
would you mind finding my glasses?
shoes I can go out in
it's raining, where is my umbrella?
how many chairs are there? I have four guests
cutting tools hanging on the wall
reading light next to the bed
"""
HELPS = """
the drain of the sink is clogged again | plunger
it's snowing and I am off for a walk | winter coat
the hem of my coat has come undone | sewing kit
that saw is so noisy that my ears hurt | ear defenders
the twins are restless | toy
cool my drink down, it is lukewarm | refrigerator
the grass has grown wild again | lawn mower
nobody may ever read these contracts, get rid of them | paper shredder
"""


def lines(text: str) -> list[str]:
    return text.strip().splitlines()


@pytest.mark.parametrize("line", lines(TELLS))
def test_a_question_that_names_no_thing_is_kept_whole(line: str) -> None:
    question, told = (part.strip() for part in line.split(" | "))
    asked = understand(question)
    assert asked.use and not asked.located and not asked.excluded
    if " for when: " in asked.wanted:
        assert asked.wanted.split(" for when: ")[1] == told
    else:  # one order alone is a use
        assert asked.wanted == f"something to {told}"


@pytest.mark.parametrize("line", lines(WHOLE))
def test_a_question_in_which_nothing_known_was_read_is_kept_whole(line: str) -> None:
    question, told = (part.strip() for part in line.split(" | "))
    asked = understand(question)
    assert asked.use and not asked.excluded
    assert asked.wanted.split(" for when: ")[1].startswith(told)


def test_what_use_and_situation_both_speak_for_is_surer() -> None:
    encoder, names = text_encoder(), ("novel", "jigsaw puzzle", "bucket")
    index = TextIndex.build(
        SimpleNamespace(key=key, tag=name, tags=(), caption=None, properties={}, label="Object")
        for key, name in enumerate(names)
    )
    vectors, behind = encoder.texts(index.texts[: index.n_encoded]), encoder.texts(background.texts())
    meaning = Meaning.of("something to read for when: I am bored and have to wait", encoder.texts)

    def ahead(other: float) -> float:
        scorer = Scorer(index, embeddings=vectors, background=behind, calibration=Calibration(other=other))
        degree = scorer.degrees(meaning).degree
        return float(degree[0] - degree[1])

    assert ahead(0.5) > ahead(0.0)


@pytest.mark.parametrize("question", lines(NAMES))
def test_a_question_that_names_a_thing_tells_no_situation(question: str) -> None:
    assert "for when" not in understand(question).wanted


@pytest.mark.parametrize(
    ("question", "excluded"),
    [
        ("hold two boards together until the glue sets. no nails, no screws.", ("nails", "screws")),
        ("my phone is dead, and I don't want a power bank", ("power bank",)),
        ("I want to sing without waking the baby", ()),
    ],
)
def test_what_is_excluded_beside_a_situation(question: str, excluded: tuple[str, ...]) -> None:
    asked = understand(question)
    assert asked.excluded == excluded
    assert not any(text in asked.wanted for text in excluded)


def test_pieces_of_what_is_told() -> None:
    assert situations.told("something to sit on") == ()
    assert situations.told("something for when it rains") == ("it rains",)
    assert situations.told("something to dig with for when: we are off, the sand is wet") == (
        "we are off, the sand is wet",
        "something to dig with",
        "we are off",
        "the sand is wet",
    )
    assert situations.told("something for when: my eyes are so dry") == ("my eyes are so dry",)
    assert situations.told("anything for when: it rained so we stayed in")[1:] == ("it rained", "we stayed in")
    assert len(situations.told("something for when: " + "it is so, " * 40)) <= situations.MOST_PARTS


def test_every_situation_helps_with_things_of_the_table() -> None:
    known = knowledge()
    assert len(set(known.situations)) == len(known.situations) == len(set(known.helps[:, 0].tolist()))
    assert (known.further >= 0).all()
    umbrella = known.things_named("umbrella")[0]
    rain = known.situations.index("it is raining outside and I have to go out")
    assert [rain, umbrella] in known.helps.tolist()


@pytest.fixture(scope="module")
def house() -> tuple[list[str], Scorer]:
    names = [line.split(" | ")[1] for line in lines(HELPS)] + [
        "sofa",
        "potted plant",
        "painting",
        "mug",
        "dining table",
    ]
    encoder = text_encoder()
    index = TextIndex.build(
        SimpleNamespace(key=key, tag=name, tags=(), caption=None, properties={}, label="Object")
        for key, name in enumerate(names)
    )
    vectors = encoder.texts(index.texts[: index.n_encoded])
    return names, Scorer(index, embeddings=vectors, background=encoder.texts(background.texts()))


@pytest.mark.parametrize("line", lines(HELPS))
def test_what_helps_comes_first(line: str, house: tuple[list[str], Scorer]) -> None:
    question, helps = line.split(" | ")
    names, scorer = house
    degree = scorer.degrees(Meaning.of(understand(question).wanted, text_encoder().texts)).degree
    assert names[int(np.argmax(degree))] == helps
    assert degree.max() >= 0.5


def test_a_kind_for_a_situation_is_of_that_kind() -> None:
    facets = knowledge().facets("an umbrella for when it rains")
    assert facets.form == "kind" and not facets.told


def test_without_vectors_the_words_of_the_use_decide(house: tuple[list[str], Scorer]) -> None:
    index = TextIndex.build(
        SimpleNamespace(key=key, tag=name, tags=(), caption=None, properties={}, label="Object")
        for key, name in enumerate(("towel", "sofa"))
    )
    degree = Scorer(index).degrees(Meaning.of("something to wipe up a spill for when: I spilled my tea", None)).degree
    assert degree[0] >= 0.5 > degree[1]


def test_words_of_situations_are_no_slips() -> None:
    for told in knowledge().situations:
        assert corrected(told) == (told, ()), told


@pytest.mark.parametrize(
    ("wanted", "said"),
    [
        ("something for when: my phone is dying", 'no help for "my phone is dying"'),
        ("unicorn", "not a unicorn"),
        ("umbrella", "not an umbrella"),
        ("USB stick", "not a USB stick"),
        ("hourglass", "not an hourglass"),
        ("scissors", "not scissors"),
        ("something to drink", "not something to drink"),
    ],
)
def test_what_a_near_miss_is_not(wanted: str, said: str) -> None:
    assert _is_not(wanted) == said
