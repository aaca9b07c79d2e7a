"""Completion: what is offered where, and in which order."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import pytest

from cgdb.cli.complete import LONGEST, Choice, complete
from cgdb.grammar.parser import parse


class Known:
    """A small store."""

    def scenes(self) -> Mapping[str, str]:
        return {"flat": "90 objects", "lab 2": "4 objects"}

    def labels(self) -> Mapping[str, int]:
        return {"Object": 90, "Room": 5}

    def relations(self) -> Mapping[str, int]:
        return {"near": 220, "next_to": 29, "on": 48, "may be stored in": 6}

    def properties(self) -> Mapping[str, str]:
        return {"color": "text", "material": "text"}

    def values(self, name: str) -> Sequence[str]:
        return {"color": ("white", "black"), "tag": ("mug", "rug", 'the "big" one')}.get(name, ())

    def phrases(self) -> Sequence[str]:
        return ("mug", "table lamp", "desk lamp", "rug", "bad\x1b[31mone", "x" * (LONGEST + 1))

    def words(self) -> Sequence[str]:
        return ("white", "wooden", "lamplight")

    def ids(self) -> Sequence[tuple[str, str]]:
        return (("12", "mug"), ("120", "rug"), ('"chair-3"', "chair"))

    def parameters(self) -> Mapping[str, str]:
        return {"what": "'lamp'", "picture": "vector"}


def offered(text: str, *, asked: bool = False) -> list[Choice]:
    """The choices where | stands."""
    before, _, after = text.partition("|")
    return complete(before + after, len(before), Known(), asked=asked)


def texts(text: str, *, asked: bool = False) -> list[str]:
    return [choice.text for choice in offered(text, asked=asked)]


@pytest.mark.parametrize(
    ("text", "first"),
    [
        ("M|", ["MATCH"]),
        ("m|", ["match"]),
        ("match (o) r|", ["return"]),
        ("MATCH (o:|", ["Object", "Room"]),
        ("MATCH (o:R|", ["Room"]),
        ("MATCH (o)-[:n|", ["near", "next_to"]),
        ("MATCH (o)-[:ma|", ["`may be stored in`"]),
        ("MATCH (o)-[:`ma|", ["may be stored in`"]),
        ("MATCH (o) WHERE o.c|", ["color", "caption", "confidence", "center"]),
        ("MATCH (o {col|", ["color"]),
        ("MATCH (o) WHERE o.color = '|", ["white'", "black'"]),
        ("MATCH (o) WHERE o.color = |", ["'white'", "'black'"]),
        ("MATCH (o) WHERE o.color IN ['white', '|", ["white'", "black'"]),
        ("MATCH (o) WHERE o.tag CONTAINS '|", ["mug'", "rug'"]),
        ("MATCH (o {color: '|'", ["white", "black"]),
        ('MATCH (o) WHERE o.tag = "the|', ['the \\"big\\" one"']),
        ('MATCH (o ~ "lam|', ["lamplight", "table lamp", "desk lamp"]),
        ('MATCH (o ~ "a white wo|', ["wooden"]),
        ('MATCH (o ~ "de|', ["desk lamp"]),
        ("USE '|", ["flat'", "lab 2'"]),
        ("USE 'lab|'", ["lab 2"]),
        ("MATCH (o) WHERE o ~ $|", ["$what", "$picture"]),
        ("MATCH (o) WHERE o ~ $p|", ["$picture"]),
        ("MATCH (o) WHERE o ~ #12|", ["12", "120"]),
        ("MATCH (cup)-[:on]->(table) WHERE c|", ["cup"]),
        ("MATCH (o) RETURN dis|", ["distance(", "distinct"]),
        ("MATCH (o) RETURN o ORD|", ["ORDER BY"]),
        ("MATCH (o) WHERE height(o) < 5 c|", ["cm"]),
        ("MATCH (a); MATCH (b) WHERE b.col|", ["color"]),
    ],
)
def test_the_likeliest_come_first(text: str, first: list[str]) -> None:
    assert texts(text)[: len(first)] == first


@pytest.mark.parametrize(
    "text", ["MATCH (o) nonsense |", "// a comment M|", "MATCH (o) RETURN o AS na|", "MATCH (o) RETURN o.tag = 3 x|"]
)
def test_nothing_where_nothing_can_stand(text: str) -> None:
    assert texts(text, asked=True) == []


def test_what_is_typed_in_full_opens_no_menu() -> None:
    assert texts("MATCH|") == []
    assert texts("MATCH (o|") == []


def test_an_empty_line_waits_to_be_asked() -> None:
    assert texts("|") == []
    assert texts("|", asked=True)[0] == "MATCH"


def test_functions_come_when_asked_for_or_begun() -> None:
    assert "distance(" not in texts("MATCH (o) RETURN |")
    assert "distance(" in texts("MATCH (o) RETURN |", asked=True)
    (choice,) = [choice for choice in offered("MATCH (o) RETURN vol|") if choice.kind == "function"]
    assert "cubic metres" in choice.says


def test_strangers_texts_are_offered_only_if_they_can_be_shown_and_typed() -> None:
    found = texts('MATCH (o ~ "|')
    assert "mug" in found
    assert not [text for text in found if not text.isprintable() or len(text) > LONGEST]


def test_taking_a_choice_gives_what_parses() -> None:
    before = 'MATCH (o) WHERE o.tag = "the'
    (choice,) = complete(before, len(before), Known())
    parse(f"{before[: choice.start]}{choice.text} RETURN o")
    before = "MATCH (o)-[:ma"
    (choice,) = complete(before, len(before), Known())
    parse(f"{before[: choice.start]}{choice.text}]->(b) RETURN b")


@pytest.mark.parametrize("text", ["\x00", "'", '"\\', "`", "$", "#", ":", "MATCH (" * 100, "é ~ '\x1b[", "{[(;;"])
def test_no_text_at_all_breaks_it(text: str) -> None:
    for cursor in range(len(text) + 1):
        complete(text, cursor, Known(), asked=True)
