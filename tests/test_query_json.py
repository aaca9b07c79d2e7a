"""Statements as JSON: every tree comes back, and what the schema allows is what is written."""

from __future__ import annotations

import json
from typing import Any

import pytest
from hypothesis import HealthCheck, given, settings

from cgdb.errors import ParseError
from cgdb.grammar import ast
from cgdb.grammar.parser import parse
from cgdb.grammar.printer import to_text
from cgdb.model.query_from_json import from_json
from cgdb.model.query_json import to_json
from cgdb.model.query_schema import schema
from tests import strategies

pytestmark = pytest.mark.filterwarnings("ignore:Generating overly large repr")


@given(strategies.queries())
@settings(max_examples=100, deadline=None, suppress_health_check=list(HealthCheck))
def test_every_tree_comes_back(query: ast.Query) -> None:
    assert from_json(json.loads(json.dumps(to_json(query)))) == query


STATEMENTS = [
    'MATCH (o ~ "something to drink")-[:on|in]->(t:Object {color: "red"}) WHERE NOT o ~ "soda" RETURN o LIMIT 3',
    "MATCH (a #1), (b #\"x\") WHERE distance(a, b) < 30 cm AND (a.tag = 'cup' OR b.n IS NOT NULL) RETURN a, b AS c",
    "MATCH (o)-[r:near*1..3]-(p) RETURN count(DISTINCT o) AS n, -1 + o.x * 2 ORDER BY n DESC",
    "MATCH (o ~ $picture) WHERE o.id IN [1, 'a', true, null] AND (o)<-[:on]-(~ #3) RETURN DISTINCT o",
    "MATCH (o) RETURN count(*)",
]


@pytest.mark.parametrize("text", STATEMENTS)
def test_what_is_written_keeps_to_the_schema(text: str) -> None:
    document = to_json(parse(text))
    whole = schema()
    _check(document, whole, whole)
    assert to_text(from_json(document)) == to_text(parse(text))


def _check(value: Any, rule: Any, whole: Any) -> None:
    """A JSON schema checker for the few words that the schema uses."""
    if "$ref" in rule:
        _check(value, whole["$defs"][rule["$ref"].rpartition("/")[2]], whole)
        return
    if "anyOf" in rule:
        problems = []
        for choice in rule["anyOf"]:
            try:
                _check(value, choice, whole)
                return
            except AssertionError as error:
                problems.append(str(error))
        raise AssertionError(f"{value} is none of {problems}")
    kinds = rule["type"] if isinstance(rule["type"], list) else [rule["type"]]
    names = {"string": str, "integer": int, "number": (int, float), "boolean": bool, "null": type(None)}
    names |= {"array": list, "object": dict}
    ok = any(
        isinstance(value, names[k]) and not (isinstance(value, bool) and k in ("integer", "number")) for k in kinds
    )
    assert ok, f"{value} is no {kinds}"
    if "enum" in rule:
        assert value in rule["enum"], f"{value} is not in {rule['enum']}"
    if isinstance(value, dict):
        assert set(value) == set(rule["required"]) == set(rule["properties"]), f"{value} lacks or has too much"
        for name, inner in value.items():
            _check(inner, rule["properties"][name], whole)
    if isinstance(value, list):
        for inner in value:
            _check(inner, rule["items"], whole)


def test_the_schema_is_strict_everywhere() -> None:
    def walk(rule: Any) -> None:
        if isinstance(rule, dict):
            if rule.get("type") == "object":
                assert rule["additionalProperties"] is False
                assert list(rule["required"]) == list(rule["properties"])
            for inner in rule.values():
                walk(inner)
        elif isinstance(rule, list):
            for inner in rule:
                walk(inner)

    walk(schema())
    assert schema()["type"] == "object"
    assert len(json.dumps(schema(), separators=(",", ":"))) < 4000, "it is paid for with every question"


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"match": []}, "at least one"),
        ({"match": "MATCH (o)"}, "must be a list"),
        ({"where": "o ~ 1"}, "the query.where must be a JSON object"),
        ({"where": {"op": "xor", "of": []}}, "no op 'xor'"),
        ({"where": {"op": "not", "of": []}}, "takes 1"),
        ({"where": {"nothing": 1}}, "a value has"),
        ({"limit": "3"}, "whole number"),
        ({"limt": 3}, "no field 'limt'"),
        ({"match": [{"start": {"var": 3}}]}, "text or null"),
    ],
)
def test_wrong_json_is_one_clear_error(change: dict[str, Any], words: str) -> None:
    document = {**to_json(parse("MATCH (o) RETURN o")), **change}
    with pytest.raises(ParseError, match=words):
        from_json(document)


def test_what_is_nested_too_deep_is_no_crash() -> None:
    value: dict[str, Any] = {"var": "o", "prop": None, "like": None}
    for _ in range(400):
        value = {"op": "not", "of": [value]}
    with pytest.raises(ParseError, match="nested"):
        from_json({**to_json(parse("MATCH (o) RETURN o")), "where": value})


def test_one_member_and_nested_conjunctions_are_made_flat() -> None:
    one = {"var": "o", "prop": None, "like": {"text": "cup"}}
    nested = {"op": "and", "of": [{"op": "and", "of": [one, one]}, one]}
    document = {**to_json(parse("MATCH (o) RETURN o")), "where": nested}
    where = from_json(document).where
    assert isinstance(where, ast.And)
    assert len(where.items) == 3
    assert from_json({**document, "where": {"op": "or", "of": [one]}}).where == ast.Similar(
        variable="o", meaning=ast.Text(value="cup")
    )
