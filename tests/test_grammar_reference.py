"""The reference of CGQL (grammar/README.md) is true to the parser, and the grammar to what model servers accept."""

from __future__ import annotations

import re
from importlib.resources import files

import pytest

from cgdb.grammar.parser import grammar, parse
from cgdb.grammar.printer import to_text

REFERENCE = files("cgdb.grammar").joinpath("README.md").read_text(encoding="utf-8")
EXAMPLES = re.findall(r"^```cgql\n(.*?)^```$", REFERENCE, flags=re.DOTALL | re.MULTILINE)


def test_the_reference_has_examples() -> None:
    assert len(EXAMPLES) >= 20


@pytest.mark.parametrize("example", EXAMPLES)
def test_every_example_is_cgql(example: str) -> None:
    assert parse(to_text(parse(example))) == parse(example)


CELLS = re.findall(r"^\| (`.*?`) \|", REFERENCE, flags=re.MULTILINE)
CODES = [c.strip("` ").replace("\\|", "|") for cell in CELLS for c in re.findall(r"``.+?``|`[^`]+`", cell)]
PATTERNS = [code for code in CODES if code[0] in "(-<" and code[-1] in ")>-"]


def test_the_tables_show_patterns() -> None:
    assert len(PATTERNS) >= 15


@pytest.mark.parametrize("code", PATTERNS)
def test_every_pattern_in_a_table_is_cgql(code: str) -> None:
    parse(f"MATCH {code} RETURN 1" if code[0] == "(" else f"MATCH (){code}() RETURN 1")


# -- llguidance: what constrains the output of model servers -----------------------------------------------------


def test_the_grammar_keeps_to_what_llguidance_reads() -> None:
    llguidance = pytest.importorskip("llguidance")
    assert llguidance.LLMatcher.validate_grammar(llguidance.grammar_from("lark", grammar())) == ""


@pytest.mark.parametrize("forbidden", ["%declare", "%import", "(?=", "(?!", "(?<", "_PRIORITY", "{0,}", ".*", ".+"])
def test_the_grammar_has_none_of(forbidden: str) -> None:
    code = "\n".join(line for line in grammar().split("\n") if not line.startswith("//"))
    assert forbidden not in code
    assert not re.search(r"^[A-Za-z_]+\.\d", code, flags=re.MULTILINE), "a priority"


ACCEPTED = [
    *EXAMPLES,
    "match (a {x: 'it\\'s', y: -2.5e-3 cm})-[:`on top`|in*2..3 ~ $p]->()--(b) return distinct a.in, count(*) as n;",
    "MATCH (m) WHERE (m) - 1 < -5in OR (m ~ 'x')-->(#'k') AND m.x IN [] RETURN m",
]
REFUSED = [
    "SELECT * FROM o",
    "MATCH (o) RETURN *",
    "MATCH (o) WHERE o.x == 1 RETURN o",
    "MATCH (o) DELETE o",
    "MATCH (a)->(b) RETURN a",
    "MATCH (o) RETURN o LIMIT 3 ORDER BY o.x",
    "MATCH (o ~ 'x) RETURN o",
]


@pytest.mark.parametrize(("statement", "good"), [(s, True) for s in ACCEPTED] + [(s, False) for s in REFUSED])
def test_llguidance_and_the_parser_agree(statement: str, good: bool) -> None:
    llguidance = pytest.importorskip("llguidance")
    matcher = llguidance.LLMatcher(llguidance.LLTokenizer("byte"), llguidance.grammar_from("lark", grammar()))
    written = list(statement.strip().encode())
    taken = matcher.try_consume_tokens(written)
    assert (taken == len(written) and matcher.is_accepting()) is good
    if good:
        parse(statement)
