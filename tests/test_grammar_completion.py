"""Completion and colours: what could stand at a cursor, and what each piece of any text is."""

from __future__ import annotations

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from cgdb.grammar.parser import expected, tokens


@pytest.mark.parametrize(
    ("text", "categories", "partial"),
    [
        ("", {"keyword"}, ""),
        ("MA", {"keyword"}, "MA"),
        ("MATCH (o:", {"label"}, ""),
        ("MATCH (o:Ro", {"label"}, "Ro"),
        ("MATCH (o)-[:o", {"relation"}, "o"),
        ("MATCH (o)-[:on|", {"relation"}, ""),
        ("MATCH (o)-[:`on t", {"relation"}, "on t"),
        ("MATCH (o) RETURN o.ca", {"property"}, "ca"),
        ("MATCH (o {na", {"property", "sign"}, "na"),
        ("USE 'la", {"scene"}, "la"),
        ("USE ", {"scene", "parameter"}, ""),
        ("MATCH (o ~ 'cu", {"meaning"}, "cu"),
        ("MATCH (o ~ ", {"meaning", "parameter", "object"}, ""),
        ("MATCH (o ~ $pi", {"parameter"}, "$pi"),
        ("MATCH (o ~ $", {"parameter"}, "$"),
        ("MATCH (o ~ #", {"object"}, ""),
        ("MATCH (o) RETURN o AS ", {"alias"}, ""),
        ("MATCH (o) RETURN o LIMIT ", {"number", "parameter"}, ""),
        ("MATCH (o) WHERE o.x < 5 ", {"keyword", "sign", "unit"}, ""),
        ("MATCH (o) RETRUN ", set(), ""),
        ("MATCH (o) // a comment", set(), ""),
    ],
)
def test_what_could_stand_at_the_end(text: str, categories: set[str], partial: str) -> None:
    found = expected(text)
    assert found.categories - {"sign"} == categories - {"sign"}
    assert found.partial == partial == text[found.span.start : found.span.end]


def test_values_in_a_condition() -> None:
    found = expected("MATCH (o:Room)-[r]->(p) WHERE ")
    assert found.categories >= {"variable", "function", "text", "parameter", "number", "object", "keyword"}
    assert found.keywords == ("FALSE", "NOT", "NULL", "TRUE")
    assert found.variables == {"o": "Room", "r": None, "p": None}


def test_keywords_come_as_phrases() -> None:
    assert {"ORDER BY", "RERANK BY", "LIMIT", "IS NOT NULL", "STARTS WITH", "AS"} <= set(
        expected("MATCH (o) RETURN o.x ").keywords
    )
    assert expected("").keywords == ("AS OF", "EXPLAIN", "MATCH", "PROFILE", "USE")
    assert expected("MATCH (o) ").keywords == ("RETURN", "WHERE")


def test_a_cursor_in_the_middle() -> None:
    text = "MATCH (o:Room) WHERE o. RETURN o"
    found = expected(text, text.index(". R") + 1)
    assert (found.categories, found.owner, found.variables) == ({"property"}, "o", {"o": "Room"})
    found = expected(text, text.index("om)"))
    assert (found.categories, found.partial) == ({"label"}, "Ro")


def test_each_statement_of_a_script_has_its_own_variables() -> None:
    text = "MATCH (a) RETURN a; MATCH (b:Room {name: 'x'}) RETURN b.name AS n ORDER BY "
    assert expected(text).variables == {"b": "Room", "n": None}
    assert expected(text, 17).variables == {"a": None}
    assert expected("MATCH (b:Room {").owner == "b"


def test_colours() -> None:
    text = (
        "explain USE 'a' MATCH (o:Room {name: 'x'})-[r:in*1..2]->(#12) // hi\n"
        "WHERE distance(o, #'k') < 2 m AND o.in = $x RETURN count(o) AS n LIMIT 3 LIMIT x ' foo"
    )
    kinds = [(text[s.start : s.end], kind) for s, kind in tokens(text)]
    for pair in [
        ("explain", "keyword"), ("'a'", "text"), ("o", "variable"), ("Room", "label"), ("name", "property"),
        ("-[", "edge"), ("r", "variable"), ("in", "relation"), ("->", "edge"), ("#", "object"), ("12", "object"),
        ("// hi", "comment"), ("distance", "function"), ("'k'", "object"), ("<", "operator"), ("2", "number"),
        ("m", "unit"), ("in", "property"), ("$x", "parameter"), ("count", "function"), ("n", "alias"), ("(", "sign"),
        ("LIMIT", "keyword"), ("x", "variable"), ("' foo", "error"),
    ]:  # fmt: skip
        assert pair in kinds, pair


def test_colours_recover_at_a_semicolon() -> None:
    text = "MATCH ! (in); MATCH (`in`)-[:in]->() RETURN `in`"
    kinds = [(text[s.start : s.end], kind) for s, kind in tokens(text)]
    assert ("in", "keyword") in kinds and ("in", "relation") in kinds and ("!", "error") in kinds


pieces = st.sampled_from(
    ["MATCH", "(", ")", "o", "-[", ":", "]->", "RETURN", ".", "'", "`", "//", "\n", "#", "~", ";", "$", "{"]
)


@settings(max_examples=200, deadline=None)
@given(
    st.one_of(st.text(max_size=40), st.lists(pieces | st.text(max_size=3), max_size=15).map("".join)),
    st.integers(0, 60),
)
def test_any_text_has_colours_and_completions(text: str, cursor: int) -> None:
    at = 0
    for span, kind in tokens(text):
        assert at <= span.start < span.end <= len(text) and kind
        assert text[at : span.start].strip(" \t\r\n") == ""
        at = span.end
    assert text[at:].strip(" \t\r\n") == ""
    found = expected(text, cursor)
    assert found.span.end == min(cursor, len(text)) and text[found.span.start : found.span.end] == found.partial
