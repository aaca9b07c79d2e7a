"""What is taken out of a reply: the statement or the JSON, whatever stands round it; only ParseError is raised."""

from __future__ import annotations

import contextlib
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from cgdb.errors import ParseError
from cgdb.grammar.parser import parse
from cgdb.grammar.printer import to_text
from cgdb.model.replies import json_in, statement, without_thoughts

RIGHT = 'MATCH (o ~ "drink") WHERE NOT o ~ "soda" RETURN o LIMIT 3'


@pytest.mark.parametrize(
    "said",
    [
        RIGHT,
        f"{RIGHT};",
        f"```cypher\n{RIGHT}\n```",
        f"```\n{RIGHT}",
        f"Sure! Here it is:\n\n```sql\n{RIGHT}\n```\n\nIt finds drinks. MATCH is the keyword.",
        f"<think>MATCH (a) RETURN a? No: soda is out.</think>\n{RIGHT}",
        f"The user wants a drink.</think>{RIGHT}",
        f"<THINKING>\nMATCH (a) RETURN a\n</THINKING>\n\n{RIGHT}",
        f"CGQL: {RIGHT}<|im_end|>",
        f"{RIGHT}</s>",
        f"{RIGHT}\n\nThis returns all drinks.",
        f"{RIGHT}\nNote: soda is left out.",
        f"**Answer:** `{RIGHT}`",
        f"First I thought of\n```\nMATCH (o) RETURN o\n```\nbut better is\n```\n{RIGHT}\n```",
        '{"query": "MATCH (o ~ \\"drink\\") WHERE NOT o ~ \\"soda\\" RETURN o LIMIT 3"}',
        f"\ufeff{RIGHT}",
        f"1. {RIGHT}",
        RIGHT.lower(),
    ],
)
def test_the_statement_is_found(said: str) -> None:
    assert to_text(statement(said)[0]) == to_text(parse(RIGHT))


@pytest.mark.parametrize(
    "said",
    [
        "",
        "I cannot help with that.",
        "<think>MATCH (o) RETURN o",
        "SELECT * FROM objects",
        "MATCH (o",
        "```\n```",
        "{}",
        "null",
        "MATCH " * 1000,
        "<html><body>It works!</body></html>",
    ],
)
def test_where_there_is_none_it_is_an_error_with_its_place(said: str) -> None:
    with pytest.raises(ParseError) as caught:
        statement(said)
    assert caught.value.render()


@pytest.mark.parametrize(
    ("said", "found"),
    [
        ('{"a": 1}', {"a": 1}),
        ('```json\n{"a": 1}\n```', {"a": 1}),
        ('<think>{"a": 2}?</think>{"a": 1}', {"a": 1}),
        ('Here: {"a": 1}. Done {ok}.', {"a": 1}),
        ('{"a": 1,}', {"a": 1}),
        ('{"a": [1, 2,\n],\n}', {"a": [1, 2]}),
        ('{"a": "x,]"}', {"a": "x,]"}),
        ("[1, 2]", [1, 2]),
        ("no JSON", None),
        ('{"a": ', None),
        ("[" * 100_000, None),
    ],
)
def test_the_json_is_found(said: str, found: Any) -> None:
    assert json_in(said) == found


PARTS = st.sampled_from(["<think>", "</think>", "```", RIGHT, "MATCH", "{", "}", '"', "\n", "[", ",", "x"])


@given(st.lists(PARTS | st.text()))
@settings(max_examples=150, deadline=None)
def test_whatever_a_model_says_is_no_crash(parts: list[str]) -> None:
    said = " ".join(parts)
    with contextlib.suppress(ParseError):
        statement(said)
    json_in(said)
    assert "<think>" not in without_thoughts(said)
