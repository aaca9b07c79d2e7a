"""Uses as frames, names in one word, what vessels hold: what the words of a question and of a map are read as."""

from __future__ import annotations

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from cgdb.meaning.knowledge import knowledge
from cgdb.meaning.uses import Gap, frame
from cgdb.meaning.words import parse


@pytest.mark.parametrize(
    ("text", "verbs", "objects", "gap"),
    [
        ("to drink", ("drink",), (), Gap.PATIENT),
        ("to drink from", ("drink",), (), Gap.PLACE),
        ("to drink out of", ("drink",), (), Gap.PLACE),
        ("to read in the evening", ("read",), (), Gap.PATIENT),
        ("to read by in the evening", ("read",), (), Gap.MEANS),
        ("to cut paper with", ("cut",), ("paper",), Gap.MEANS),
        ("that I could use to cut paper", ("cut",), ("paper",), Gap.DOER),
        ("bake or cook food with", ("bak", "cook"), ("food",), Gap.MEANS),
        ("throw away rubbish in", ("throw",), ("rubbish",), Gap.PLACE),
        ("comfortable to sit on", ("sit",), (), Gap.PLACE),
        ("sit upright for a while", ("sit",), (), Gap.PLACE),
        ("to help a student understand physics", ("understand",), ("physic",), Gap.DOER),
        ("listen to music", ("listen",), (), Gap.ANY),
        ("", (), (), Gap.ANY),
        ("with", ("with",), (), Gap.ANY),
    ],
)
def test_frames(text: str, verbs: tuple[str, ...], objects: tuple[str, ...], gap: Gap) -> None:
    found = frame(text)
    assert (found.objects, found.gap) == (objects, gap)
    assert found.verbs == verbs or text == "with"


def test_who_asks_where_asks_for_a_place() -> None:
    assert frame("throw a wrapper", place=True).gap is Gap.PLACE
    assert frame("clean the floor with", place=True).gap is Gap.MEANS


WORDS = ("to", "with", "in", "out", "of", "help", "a", "the", "put", "on", "cup")


@settings(deadline=None, max_examples=300)
@given(st.text(max_size=60) | st.lists(st.sampled_from(WORDS)).map(" ".join))
def test_any_text_is_a_frame(text: str) -> None:
    frame(text)
    knowledge().facets(text)
    knowledge().readable(text)
    parse(text)


@pytest.mark.parametrize(
    ("name", "said"),
    [
        ("tablelamp", "table lamp"),
        ("wallpictureframe", "wall picture frame"),
        ("poundcake", "pound cake"),
        ("CoffeeTable_12", "Coffee Table 12"),
        ("TVStand", "TV Stand"),
        ("chair12", "chair 12"),
        ("iPhone", "iPhone"),
        ("PlayStation", "PlayStation"),
        ("cupboard", "cupboard"),
        ("lightweight", "lightweight"),
        ("waterproof", "waterproof"),
        ("carpet", "carpet"),
        ("notebook", "notebook"),
        ("a red chair", "a red chair"),
        ("zzyzx", "zzyzx"),
    ],
)
def test_names_in_one_word(name: str, said: str) -> None:
    assert knowledge().readable(name) == said


def test_a_heap_of_things_is_called_by_them() -> None:
    known = knowledge()
    assert [known.names[i] for i in known.things_named("bread slice")] == ["bread"]
    assert known.things_named("chair 12") == known.things_named("chair")


def test_packages_are_what_they_hold_and_cases_are_not() -> None:
    known = knowledge()
    assert [known.names[i] for i in known.contents_named("juice carton")] == ["juice"]
    assert known.contents_named("pencil box") == ()
    assert known.contents_named("juice") == ()


def test_vessels_and_what_they_hold() -> None:
    assert parse("a mug of green tea on a table").contents == ("green tea",)
    assert parse("a picture of a cup").contents == ()
    assert parse("a pile of paper").contents == ()


def test_the_tin_and_the_verb() -> None:
    assert parse("a gray trash can with a bag").heads == ("gray trash cans",)
    assert parse("a table that can be folded").heads == ("table",)
