"""Uses as frames, names in one word, what vessels hold: what the words of a question and of a map are read as."""

from __future__ import annotations

import numpy as np
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
        ("to use for temporarily securing a zipper", ("secur",), ("zipper",), Gap.DOER),
        ("fun to pass the time with", ("hav",), ("fun",), Gap.MEANS),
        ("take a nap on", ("nap",), (), Gap.PLACE),
        ("to get rid of a wrapper in", ("discard",), ("wrapper",), Gap.PLACE),
        ("supply water", ("supply",), ("water",), Gap.DOER),
        ("listen to music", ("listen",), (), Gap.ANY),
        ("", (), (), Gap.ANY),
        ("with", ("with",), (), Gap.ANY),
    ],
)
def test_frames(text: str, verbs: tuple[str, ...], objects: tuple[str, ...], gap: Gap) -> None:
    found = frame(text)
    assert (found.objects, found.gap) == (objects, gap)
    assert found.verbs == verbs or text == "with"


@pytest.mark.parametrize(
    ("text", "around"),
    [
        ("comfortable to sit on", ("comfortabl",)),
        ("to use for temporarily securing a zipper", ("temporarily",)),
        ("to carry a laptop safely", ("safely",)),
        ("to sit on", ()),
    ],
)
def test_how_it_is_done_is_no_part_of_what_is_done(text: str, around: tuple[str, ...]) -> None:
    assert frame(text).around == around


def agreement(asked: str, use: str) -> float:
    known = knowledge()
    return float(known.use_matches(frame(asked)).agreement[known.uses.index(use)])


def test_one_makes_things_with_what_one_makes_them_from() -> None:
    assert agreement("to make a cape with", "sew clothes or curtains from") == 1.0
    assert agreement("to eat soup with", "eat soup or cereal from") < 0.5


def test_a_use_comes_down_the_lines_and_weighs_less_on_each() -> None:
    known = knowledge()
    sewn = np.asarray([1.0 if use == "sew clothes or curtains from" else -1.0 for use in known.uses], dtype=np.float32)
    best = dict(zip(known.names, known.best_use(sewn, 0.1).tolist(), strict=True))
    assert best["textile"] == 1.0
    assert best["textile"] > best["clothing"] > best["shirt"] > best["table"]
    assert known.best_use(sewn)[known.names.index("shirt")] == 1.0


def test_the_kinds_of_a_line_share_its_uses_in_full() -> None:
    known = knowledge()
    mended = np.asarray([1.0 if use == "mend clothes" else -1.0 for use in known.uses], dtype=np.float32)
    best = dict(zip(known.names, known.best_use(mended, 0.1).tolist(), strict=True))
    assert best["safety pin"] == best["sewing supply"] == 1.0


def test_what_a_use_says_beside_is_told_apart() -> None:
    known = knowledge()
    match = known.use_matches(frame("to wear"))
    assert match.adds[known.uses.index("wear on your feet")]
    assert not match.adds[known.uses.index("wear")]
    match = known.use_matches(frame("comfortable to sit on"))
    assert match.circumstance[known.uses.index("relax on in comfort")] > 0
    assert match.circumstance[known.uses.index("sit on")] == 0


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
        ("tv-stand", "tv stand"),
        ("base-cabinet", "base cabinet"),
        ("alarm-clock-3", "alarm clock 3"),
        ("t-shirt", "t-shirt"),
        ("half-full", "half-full"),
        ("crab_(animal)", "animal crab"),
        ("iron (for clothing)", "iron"),
        ("chair (2)", "chair (2)"),
        ("(broken) lamp", "(broken) lamp"),
        ("()", "()"),
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
