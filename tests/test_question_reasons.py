"""What people say beside a question: reasons, what is out of use, words thrown in, and what is not to be brought."""

from __future__ import annotations

import pytest

from cgdb.english.intent import Asked
from cgdb.english.questions import understand


def said(asked: Asked) -> str:
    """What of a question is wanted, and what else is asked, on one line."""
    where = (f"{'not ' * one.negated}{one.name} {'/'.join(one.anchors)}" for one in asked.located)
    places = (*(f"in {name}" for name in asked.places), *(f"not in {name}" for name in asked.not_places))
    return "; ".join((asked.wanted, *(f"no {text}" for text in asked.excluded), *where, *places))


@pytest.mark.parametrize(
    ("question", "meant"),
    [
        # reasons
        ("a cold drink, I'm driving", "cold drink"),
        ("a stool because my feet hurt", "stool"),
        ("a pillow, my neck is stiff", "pillow"),
        ("a chair and a table", "chair and a table"),
        ("the jacket that I wear", "jacket that I wear"),
        # what is out of use
        ("heat up some soup, the microwave's bust", "something to heat up some soup; no microwave"),
        ("The kettle is broken. What else can I boil water in?", "something to boil water in; no kettle"),
        ("something to write on, the whiteboard is already full", "something to write on; no whiteboard"),
        ("cover this cut, so plasters and tape are out", "something to cover this cut; no plasters; no tape"),
        ("the lamp that is broken", "lamp that is broken"),
        ("I've had enough tea, something else to drink", "something else to drink; no tea"),
        ("I'm sick of magazines, something else to read", "something else to read; no magazines"),
        ("I already have a pen, is there something else to write with?", "something else to write with; no pen"),
        ("a coffee, hold the sugar", "coffee; no sugar"),
        ("hold this board still", "something to hold this board still"),
        # what is not to be
        ("bring me a mug. don't bring the red one", "mug; no red one"),
        ("a seat for her. don't put her on the floor", "seat for her; not on floor"),
        # words thrown in
        ("what on earth is that thing on the monitor", "; on monitor"),
        ("a helmet, you know, with a visor", "helmet with a visor"),
        ("a fridge, obviously not the broken one", "fridge; no broken"),
        ("is there an animal here apart from the dog?", "animal; no dog"),
        ("grab me a towel would you, not the one dumped on the bed", "towel; not on bed"),
        # who wants it, and what it should be
        ("my aunt needs a seat", "seat"),
        ("switch on a lamp, just not the one on the desk", "lamp; not on desk"),
        ("the tall vase, it should be on the small table", "tall vase; on small table"),
        ("the cup on the table, it should be red", "red cup; on table"),
        # ways to it
        ("a stool over by the window", "stool; next_to window"),
        ("the suitcase up on the wardrobe", "suitcase; on wardrobe"),
        ("a chair, but nothing out in the waiting room", "chair; not in waiting room"),
        ("a plant at the front desk area", "plant; in front desk area"),
        ("the remote that got left on the couch", "remote; on couch"),
        # by the use, where the name says nothing
        ("a bite to eat, but I don't want anything sweet", "something to eat; no sweet"),
        ("a thingamajig to hang coats on", "something to hang coats on"),
        ("a chair to sit on", "chair to sit on"),
        # leads, exclamations, and who is spoken to
        ("Oi, where's my chef's knife?", "chef's knife"),
        ("mate, have you seen the red cup", "red cup"),
        ("I'm after the suitcase", "suitcase"),
        ("I search one seat not broken", "seat; no broken"),
        ("I seem to remember a painting of mountains", "painting of mountains"),
        ("I could have sworn there was a stapler", "stapler"),
        ("bring my wife some water", "water"),
        ("get grandad a drink, nothing alcoholic, he's on blood thinners", "drink; no alcoholic"),
        # what is said aside
        ("that grey box with a dial, I forget what you call it", "grey box with a dial"),
        ("a hot drink with no caffeine, or I'll be up all night", "hot drink; no caffeine"),
        ("a mug or a glass", "mug or a glass"),
        # where somebody thinks that it is, and what it is like
        ("I'm after the suitcase, I think it's stored up high somewhere", "suitcase"),
        ("the remote, I think it is on the sofa", "remote; on sofa"),
        ("The flour, love. It'll be in a big bag I expect.", "flour; in big bag"),
        ("my elephant!! the soft one", "soft elephant"),
        # whose, of what is wanted
        ("I need a bowl. Obviously I don't mean the dog's.", "bowl; no dog's bowl"),
        # corrections
        ("not a mug - a glass", "glass; no mug"),
        ("not the red one, the blue cup", "blue cup; no red"),
        ("screwdriver - NOT the flathead", "screwdriver; no flathead"),
        ("something to sit on, not a chair, a sofa or a stool", "something to sit on; no chair; no sofa; no stool"),
        # whose relation it is
        ("the screen on the desk that has the lamp on it", "screen; on desk; on lamp"),
        ("the rug under the table with a vase on it", "rug; under table; on vase"),
        ("the telly in the attic", "telly; in attic"),
    ],
)
def test_what_is_said_beside_the_question(question: str, meant: str) -> None:
    assert said(understand(question)) == meant


def test_what_an_anchor_has_may_be_the_anchors() -> None:
    located = understand("the screen on the desk that has the lamp on it").located
    assert [(one.inverse, one.chained) for one in located] == [(False, False), (True, True)]


@pytest.mark.parametrize(
    ("question", "text"),
    [
        ("the chair closer to the door", "closer to door"),
        ("the lamp further away from the sofa", "further away from sofa"),
    ],
)
def test_of_two_the_nearer(question: str, text: str) -> None:
    first = understand(question).first
    assert first is not None
    assert (first.by, first.text) == ("distance", text)
