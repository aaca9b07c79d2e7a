"""The printer: canonical text, and the way back."""

from __future__ import annotations

import importlib.util
import sys
from pathlib import Path

import pytest
from hypothesis import HealthCheck, given, settings

from cgdb.errors import LimitError, UsageError
from cgdb.grammar import ast
from cgdb.grammar.parser import parse, parse_condition
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
