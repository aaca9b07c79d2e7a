"""Words: tokens, head nouns, and the index of which object has which word."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from cgdb.meaning.words import (
    LONGEST_TEXT,
    Role,
    WordIndex,
    head_phrase,
    pack_strings,
    parse,
    query_words,
    singular,
    stem,
    tokens,
    unpack_strings,
)


def index_of(texts: Sequence[str]) -> WordIndex:
    """One row per text, all believed in full."""
    rows = np.arange(len(texts), dtype=np.int32)
    return WordIndex.build(texts, n=len(texts), text_of=rows, row_of=rows, weight_of=np.ones(len(texts), np.float32))


@pytest.mark.parametrize(
    ("text", "heads"),
    [
        ("a lamp above the end table", ("lamp",)),
        ("This is a lamp and it is above the end table.", ("lamp",)),
        ("a round, light brown, wooden table", ("round light brown wooden table",)),
        ("a black and white photo of a boat on a lake", ("black and white photo",)),
        ("This is the corner of a chair at a conference table.", ("chair",)),
        ("This is bunch of branches in a vase.", ("branches",)),
        ("One of eight gray office chairs in a conference room", ("eight gray office chairs",)),
        ("a large cell phone or a tablet on a white table", ("large cell phone", "tablet")),
        ("a footstool, ottoman, or coffee table with a tufted top", ("footstool", "ottoman", "coffee table")),
        ("This is a light in the ceiling.", ("light",)),
        ("The rug is under the bed.", ("rug",)),
        ("candle on book", ("candle",)),
        ("room 12", ("room 12",)),
        ("It's a sofa up against a red wall", ("sofa",)),
        ("", ()),
        ("...", ()),
    ],
)
def test_head_phrases(text: str, heads: tuple[str, ...]) -> None:
    assert parse(text).heads == heads


@pytest.mark.parametrize(
    "text", ["something to sit on", "Somewhere to put cups", "an object that bounces", "where can I sit"]
)
def test_generic_heads_name_nothing(text: str) -> None:
    parsed = parse(text)
    assert parsed.generic
    assert parsed.heads == ()
    assert head_phrase(text) is None


def test_roles() -> None:
    roles = {word.text: word.role for word in parse("a white lamp above the end table").words}
    assert roles["lamp"] is Role.HEAD
    assert roles["white"] is Role.MODIFIER
    assert roles["table"] is Role.CONTEXT
    held = {word.text: word.role for word in parse("a box of tea on a shelf").words}
    assert held["tea"] is Role.MODIFIER
    assert held["shelf"] is Role.CONTEXT


def test_head_phrase_is_given_only_where_it_differs() -> None:
    assert head_phrase("a lamp above the end table") == "lamp"
    assert head_phrase("lamp") is None


@pytest.mark.parametrize(
    ("forms", "expected"),
    [
        (("shelf", "shelves"), "shelf"),
        (("knife", "knives"), "knife"),
        (("box", "boxes"), "box"),
        (("glass", "glasses"), "glass"),
        (("shoe", "shoes"), "shoe"),
        (("battery", "batteries"), "battery"),
        (("cooky", "cookie", "cookies"), "cooky"),
        (("person", "people"), "person"),
        (("bus", "buses"), "bus"),
        (("painting", "paintings"), "painting"),
        (("tv", "television"), "television"),
    ],
)
def test_singular(forms: tuple[str, ...], expected: str) -> None:
    assert {singular(form) for form in forms} == {expected}


def test_stem_joins_inflections() -> None:
    assert stem("storing") == stem("stored") == stem("store") == stem("stores")
    assert stem("cutting") == stem("cut")
    assert stem("organ") != stem("organizer")
    assert stem("ring") == "ring"


def test_function_words_carry_nothing() -> None:
    assert query_words("something to do with the") == []
    asked = {word.text for word, _ in query_words("something to put on the sofa with a")}
    assert asked == {"put", "sofa"}


def test_names_brands_and_numbers_match() -> None:
    words = index_of(["a can of Coca-Cola", "an IKEA shelf", "room 12", "room 13", "a t-shirt", "a tshirt"])
    assert words.degrees("Coca-Cola").argmax() == 0
    assert words.degrees("coca cola")[0] > 0.5
    assert words.degrees("ikea").argmax() == 1
    assert words.degrees("room 12")[2] > words.degrees("room 12")[3]
    for text in ("t-shirt", "tshirt"):
        assert words.degrees(text)[4] > 0.5
        assert words.degrees(text)[5] > 0.5


def test_a_mention_is_not_the_thing() -> None:
    words = index_of(["a lamp above the end table", "an end table under a lamp"])
    lamp, table = words.degrees("table")
    assert table > 0.5 > lamp
    lamp, table = words.degrees("a lamp above the end table")
    assert lamp > 0.5 > table


def test_words_left_out_are_judged_elsewhere() -> None:
    words = index_of(["a striped pillow", "a pillow"])
    assert words.degrees("a striped pillow", without=frozenset({"pillow"})).tolist() == pytest.approx([0.8, 0.0])


def test_more_of_the_question_means_a_higher_degree() -> None:
    words = index_of(["chair", "red chair", "red leather chair"])
    degrees = words.degrees("red leather chair").tolist()
    assert degrees == sorted(degrees)
    assert len(set(degrees)) == 3


def test_other_scripts() -> None:
    words = index_of(["木の椅子", "стул у окна", "ein Stuhl", "une chaise près de la fenêtre"])
    assert words.degrees("椅子").argmax() == 0
    assert words.degrees("стул").argmax() == 1
    assert words.degrees("STUHL").argmax() == 2
    assert words.degrees("chaise").argmax() == 3


def test_empty_index() -> None:
    words = index_of([])
    assert words.degrees("chair").shape == (0,)
    again = WordIndex.from_arrays(words.arrays())
    assert again.n == 0


def test_arrays_round_trip() -> None:
    words = index_of(["a lamp above the end table", "Coca-Cola", "木の椅子", ""])
    again = WordIndex.from_arrays(words.arrays())
    for text in ("lamp", "table", "coca-cola", "椅子"):
        assert np.array_equal(again.degrees(text), words.degrees(text))


def test_arrays_that_do_not_fit_are_refused() -> None:
    arrays = dict(index_of(["a lamp", "a table"]).arrays())
    for name, value in (
        ("word_rows", np.asarray([7] * len(arrays["word_rows"]), dtype=np.int32)),
        ("word_indptr", arrays["word_indptr"][:-1]),
        ("word_indptr", arrays["word_indptr"][::-1].copy()),
    ):
        with pytest.raises(ValueError, match="word index"):
            WordIndex.from_arrays({**arrays, name: value})


def test_long_text_is_cut() -> None:
    assert len(tokens("chair " * 100_000)) <= LONGEST_TEXT
    assert parse("x" * 1_000_000).words


@settings(deadline=None, max_examples=300)
@given(st.lists(st.text(max_size=60), max_size=6), st.text(max_size=60))
def test_any_text_gives_degrees(texts: list[str], question: str) -> None:
    degrees = index_of(texts).degrees(question)
    assert degrees.dtype == np.float32
    assert ((degrees >= 0) & (degrees <= 1)).all()


@settings(deadline=None)
@given(st.lists(st.text(alphabet=st.characters(blacklist_characters="\x00", blacklist_categories=["Cs"])), max_size=8))
def test_packed_strings_come_back(strings: list[str]) -> None:
    assert unpack_strings(pack_strings(strings)) == strings
