"""The printer: canonical text, and the way back."""

from __future__ import annotations

import importlib.util
import sys
from pathlib import Path

import pytest
from hypothesis import HealthCheck, given, settings

from cgdb.errors import LimitError, UsageError
from cgdb.grammar import ast
from cgdb.grammar.parser import grammar, parse, parse_condition
from cgdb.grammar.printer import to_text


def _strategies():  # type: ignore[no-untyped-def]
    spec = importlib.util.spec_from_file_location("strategies", Path(__file__).with_name("strategies.py"))
    assert spec and spec.loader
    module = importlib.util.module_from_spec(spec)
    sys.modules.setdefault("strategies", module)
    spec.loader.exec_module(module)
    return module


strategies = _strategies()
pytestmark = pytest.mark.filterwarnings("ignore:Generating overly large repr")
thorough = settings(max_examples=150, deadline=None, suppress_health_check=list(HealthCheck))


@thorough
@given(strategies.queries())
def test_a_statement_comes_back(tree: ast.Query) -> None:
    text = to_text(tree)
    assert "\n" not in text
    back = parse(text)
    assert back == tree
    assert to_text(back) == text


@settings(thorough, max_examples=400)
@given(strategies.expressions())
def test_a_condition_comes_back(tree: ast.Expression) -> None:
    assert parse_condition(to_text(tree)) == tree


@settings(thorough, max_examples=60)
@given(strategies.queries())
def test_llguidance_takes_what_the_printer_writes(tree: ast.Query) -> None:
    llguidance = pytest.importorskip("llguidance")
    matcher = llguidance.LLMatcher(llguidance.LLTokenizer("byte"), llguidance.grammar_from("lark", grammar()))
    written = list(to_text(tree).encode())
    assert matcher.try_consume_tokens(written) == len(written) and matcher.is_accepting()


@pytest.mark.parametrize(
    "tree",
    [
        ast.Number(value=float("nan")),
        ast.Number(value=float("inf")),
        ast.Number(value=2**63),
        ast.Number(value=1, unit="yd"),
        ast.Text(value="\0"),
        ast.Text(value="\ud800"),
        ast.Text(value="x" * 4097),
        ast.Variable(name=""),
        ast.Variable(name="x y" * 100),
        ast.Parameter(name="a b"),
        ast.Call(name="Count"),
        ast.Call(name="count", distinct=True),
        ast.Call(name="count", star=True, distinct=True),
        ast.And(items=(ast.Null(),)),
        ast.Or(items=()),
        ast.EdgePattern(min_hops=3, max_hops=1),
        ast.Pattern(nodes=()),
        ast.Query(
            patterns=(ast.Pattern(nodes=(ast.NodePattern(),)),),
            returns=(ast.ReturnItem(expression=ast.Null()),),
            limit=ast.Number(value=-1),
        ),
    ],
)
def test_what_no_text_can_say(tree: ast.Syntax) -> None:
    with pytest.raises(UsageError):
        to_text(tree)


def test_a_tree_that_is_too_deep() -> None:
    tree: ast.Expression = ast.Null()
    for _ in range(5000):
        tree = ast.Not(item=tree)
    with pytest.raises(LimitError, match="60 deep"):
        to_text(tree)


def test_parts_of_a_statement_have_texts_too() -> None:
    query = parse("MATCH (a)-[:on]->(b) RETURN a AS x ORDER BY a DESC RERANK BY 'q'")
    assert to_text(query.patterns[0]) == "(a)-[:on]->(b)"
    assert to_text(query.patterns[0].nodes[0]) == "(a)"
    assert to_text(query.patterns[0].edges[0]) == "-[:on]->"
    assert to_text(query.returns[0]) == "a AS x"
    assert to_text(query.order[0]) == "a DESC"
    assert query.rerank is not None and to_text(query.rerank) == 'RERANK BY "q"'
