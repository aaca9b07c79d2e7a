"""A question read a second time: by a name in it that the map knows, by what holds the thing, or as a description."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import pytest

from cgdb.database import Database
from cgdb.english.questions import understand
from cgdb.english.second_reading import by_container, by_description, by_name
from cgdb.scene import SceneGraph, SceneObject
from cgdb.testing import store

pytestmark = pytest.mark.usefixtures("no_model")

NAMES = frozenset((("suitcase",), ("flour", "sack"), ("paper",), ("carpet",), ("sofa",)))


@pytest.mark.parametrize(
    ("question", "name"),
    [
        ("blorp the suitcase", None),  # nobody knows what is done to it
        ("suitcase, zorbly old one by the zinc", "suitcase"),
        ("I am after the flour sack", None),  # that was read at first
        ("flibber thing, not the suitcase", None),  # it is excluded
        ("the flibber under the carpet", None),  # it is where the thing is
        ("there is wine on the carpet, what helps", None),  # it belongs to what is told
        ("paper towel dispenser", None),  # the name goes on
    ],
)
def test_the_name_in_a_question_that_the_map_knows(question: str, name: str | None) -> None:
    found = by_name(question, understand(question), NAMES)
    assert (None if found is None else found.wanted) == name


@pytest.mark.parametrize(
    ("question", "wanted"),
    [
        ("the flour, it is in a big bag", "bag of flour"),
        ("the cups in the cupboard", None),
        ("the flour that is not in the bag", None),
        ("something to bake with in a bag", None),
    ],
)
def test_what_holds_the_thing(question: str, wanted: str | None) -> None:
    found = by_container(understand(question))
    assert (None if found is None else found.wanted) == wanted


@pytest.mark.parametrize(
    ("question", "text"),
    [
        ("the flibber which makes the bread brown", "something like flibber which makes the bread brown"),
        ("the round clock on the wall", ""),
        ("a suitcase that is red", ""),
        ("something to sit on", ""),
    ],
)
def test_a_description_is_one_text(question: str, text: str) -> None:
    assert by_description(understand(question)) == text


def thing(number: int, tag: str) -> SceneObject:
    return SceneObject(
        id=number, tag=tag, center=np.asarray([float(number), 0.0, 0.5]), extent=np.asarray([0.2, 0.2, 0.2])
    )


@pytest.fixture(scope="module")
def db() -> Iterator[Database]:
    tags = ("flour sack", "suitcase", "globe", "teddy bear", "remote", "sofa", "mug")
    with store(SceneGraph(name="room", objects=tuple(thing(i, tag) for i, tag in enumerate(tags)))) as opened:
        yield opened


def test_what_holds_the_thing_is_asked_and_said(db: Database) -> None:
    answer = db.ask("The flour, love. It'll be in a big bag I expect.")
    assert answer.achievable and [node.id for node in answer.objects][:1] == [0]
    assert "bag of flour" in answer.query and "nothing is called so: asked for what holds it" in answer.understood


def test_a_guess_is_left_out_where_it_is_wrong_and_told(db: Database) -> None:
    answer = db.ask("the remote, I think it is under the sofa")
    assert answer.achievable and [node.id for node in answer.objects][:1] == [4]
    assert "only thought to be so: under the sofa" in answer.understood
