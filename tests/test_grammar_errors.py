"""What people read when a text is not CGQL: golden/syntax_errors.txt holds each text with its rendered error.

After a wanted change: CGDB_UPDATE_GOLDEN=1 python -m pytest tests/test_grammar_errors.py, and read the difference.
"""

from __future__ import annotations

import os
import random
import time
from pathlib import Path

import pytest

from cgdb.errors import CgdbError, LimitError, ParseError
from cgdb.grammar.parser import expected, parse, parse_condition, parse_script, tokens
from cgdb.grammar.printer import to_text

GOLDEN = Path(__file__).with_name("golden") / "syntax_errors.txt"
# Each case: the text (as Python escapes where it has strange characters), a line of dashes, the error.
CASES = [block.split("\n----\n") for block in GOLDEN.read_text(encoding="utf-8").rstrip("\n").split("\n====\n")]


def render(written: str) -> str:
    text = written.encode("ascii", "backslashreplace").decode("unicode_escape") if "\\u" in written else written
    with pytest.raises(ParseError) as caught:
        parse(text)
    error = caught.value
    assert error.span is not None and error.source == text
    assert 0 <= error.span.start <= error.span.end <= len(text)
    assert "\n" not in error.message
    return error.render()


def test_the_golden_file_when_it_is_asked_to_follow() -> None:
    if os.environ.get("CGDB_UPDATE_GOLDEN"):
        blocks = [f"{case[0]}\n----\n{render(case[0])}" for case in CASES]
        GOLDEN.write_text("\n====\n".join(blocks) + "\n", encoding="utf-8")
    assert len({case[0] for case in CASES}) == len(CASES) >= 80


@pytest.mark.parametrize("case", CASES, ids=[case[0][:60] for case in CASES])
def test_messages(case: list[str]) -> None:
    assert render(case[0]) == case[1]


# -- no text brings it down ---------------------------------------------------------------------------------------

SEEDS = [
    'MATCH (o ~ "something to drink") WHERE NOT o ~ "soda" RETURN o LIMIT 3',
    "USE 'lab' AS OF 12 MATCH (a:Room {x: [1, -2.5e3 cm]})-[r:in|`on top`*1..3 ~ $p]->(b)<--(#'k')--() RETURN a.b AS c",
    "MATCH (o) WHERE (o)-[:in]->(~ 'shelf') OR (o.x + 1) / 2 >= -5in AND o.y IS NOT NULL RETURN count(DISTINCT o);",
    "EXPLAIN MATCH (o), (p) WHERE distance(o, #1) < 2 m RETURN DISTINCT o ORDER BY o.x DESC RERANK BY 'q' TOP 5 SKIP 1",
]
BITS = [
    *"()[]{}<>-=~|:;,.*#$`'\"\\/ \n\t\0é中😀\ud800\u200b“”!@%^&+?0",
    *(
        " AND ",
        " NOT ",
        "MATCH ",
        "RETURN ",
        " IN ",
        "-[",
        "]->",
        "<-[",
        "..",
        "//",
        "1e9",
        "99999999999",
        "\\u12",
        "cm",
        "--",
    ),
]


def mutated(chance: random.Random) -> str:
    text = chance.choice(SEEDS)
    for _ in range(chance.choice([1, 1, 1, 2, 3, 8])):
        at = chance.randrange(len(text) + 1)
        to = min(len(text), at + chance.choice([0, 1, 1, 3, 10]))
        other = chance.choice(SEEDS)
        cut = chance.randrange(len(other))
        bit = chance.choice(
            [chance.choice(BITS), chance.choice(BITS) * chance.choice([1, 2, 70, 2000]), other[cut : cut + 9], ""]
        )
        text = text[:at] + bit + text[to:]
    return text


def survives(text: str) -> None:
    began = time.perf_counter()
    for function in (parse, parse_condition):
        try:
            tree = function(text)
        except CgdbError as error:
            assert error.render() and error.to_json()
        else:
            again = to_text(tree)
            assert len(again) > 20_000 or function(again) == tree
    try:
        parse_script(text)
    except CgdbError as error:
        assert isinstance(error, ParseError | LimitError)
    assert time.perf_counter() - began < 2


def test_mutated_statements_give_a_tree_or_an_error() -> None:
    chance = random.Random(7)
    for _ in range(1000):
        survives(mutated(chance))


@pytest.mark.slow
def test_many_mutated_statements_give_a_tree_or_an_error() -> None:
    chance = random.Random(11)
    for i in range(20_000):
        text = mutated(chance)
        survives(text)
        if i % 20 == 0:
            tokens(text)
            expected(text, chance.randrange(len(text) + 1))


@pytest.mark.slow
def test_typical_statements_are_parsed_fast() -> None:
    """Measured: 16,000 to 18,000 statements of 77 characters in a second of one core; the line is where it hurts."""
    began = time.process_time()
    for _ in range(1000):
        parse(SEEDS[0])
    assert 1000 / (time.process_time() - began) > 2000
