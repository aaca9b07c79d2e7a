"""The parser: what each part of the language becomes, where it stands, and what is refused."""

from __future__ import annotations

import subprocess
import sys
from importlib.resources import files

import pytest

from cgdb.errors import CgdbError, LimitError, ParseError, Span, UsageError
from cgdb.grammar import ast, generate, tables
from cgdb.grammar.build import BUILD
from cgdb.grammar.limits import MAX_DEPTH, MAX_LENGTH, MAX_TEXT, children
from cgdb.grammar.machine import UNITS, machine
from cgdb.grammar.parser import grammar, parse, parse_condition, parse_script
from cgdb.grammar.printer import to_text

LANGUAGE = [
    'MATCH (o ~ "potted plant") RETURN o',
    'MATCH (o ~ "something to drink") WHERE NOT o ~ "soda" RETURN o LIMIT 3',
    'MATCH (p ~ "pillow")-[:on]->(c ~ "couch")-[:next_to]-(w ~ "window") RETURN p, c',
    'MATCH (b ~ "book") WHERE NOT (b)-[:in]->(~ "shelf") RETURN b.id, b.caption',
    'MATCH (l ~ "lamp") WHERE distance(l, #12) < 150 cm RETURN l ORDER BY distance(l, #12)',
    'MATCH (o) WHERE o ~ "rigid" AND NOT o ~ "cushion" AND volume(o) < 0.1 RETURN o '
    'RERANK BY "something rigid, unlike a cushion" TOP 20',
    'MATCH (a)-[r ~ "could be stored in"]->(b ~ "closet") RETURN a.tag, r.label, r.explanation, b.tag',
    'MATCH (r:Room)-[:contains]->(o ~ "chair") RETURN r.name, count(o) ORDER BY count(o) DESC',
    'USE "lab", "kitchen" MATCH (o ~ $picture) RETURN o, score(o) LIMIT 5',
    'USE "lab" AS OF 12 MATCH (o ~ "sneakers") RETURN o.id, o.center',
    'EXPLAIN MATCH (o ~ "cup")-[:on]->(t ~ "table") RETURN o',
]


def where(text: str) -> ast.Expression:
    return parse_condition(text)


def node(text: str) -> ast.NodePattern:
    return parse(f"MATCH {text} RETURN o").patterns[0].nodes[0]


def edge(text: str) -> ast.EdgePattern:
    return parse(f"MATCH (a){text}(b) RETURN a").patterns[0].edges[0]


def var(name: str) -> ast.Variable:
    return ast.Variable(name=name)


def num(value: float, unit: str | None = None) -> ast.Number:
    return ast.Number(value=value, unit=unit)


def text(value: str) -> ast.Text:
    return ast.Text(value=value)


# -- the tables ---------------------------------------------------------------------------------------------------


def test_the_tables_are_those_of_the_grammar() -> None:
    kept = files("cgdb.grammar").joinpath("tables.py").read_text(encoding="utf-8")
    assert generate.module(grammar()) == kept, "run: python -m cgdb.grammar.generate"


def test_every_rule_has_its_function_and_no_function_is_idle() -> None:
    named = {line.split()[2] for line in tables.RULES if len(line.split()) == 3}
    assert named == set(BUILD)
    for line in tables.RULES:
        assert len(line.split()) == 3 or line.split()[1] == "1", "only a rule of one symbol can pass its value on"


def test_the_units_are_those_of_the_tree() -> None:
    assert {unit.lower() for unit, t in machine().words.items() if tables.TERMINALS[t] == "UNIT"} == set(UNITS) - {"in"}


def test_parsing_needs_no_lark() -> None:
    code = "import sys, cgdb.grammar.parser as p; p.parse('MATCH (o) RETURN o'); assert 'lark' not in sys.modules"
    subprocess.run([sys.executable, "-c", code], check=True, timeout=60)


# -- the statement ------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("statement", LANGUAGE)
def test_the_examples_of_the_language_are_their_own_canonical_text(statement: str) -> None:
    assert to_text(parse(statement)) == statement


def test_a_whole_statement() -> None:
    query = parse(
        "profile use 'lab', $s as of '2025-01-01' match (a), (b)-->(c) where a.x = 1 return distinct a as first, b.in "
        "order by a.x, b desc, c asc rerank by $q top 7 skip 2 limit $n ;"
    )
    assert query == ast.Query(
        mode=ast.Mode.PROFILE,
        scenes=(text("lab"), ast.Parameter(name="s")),
        as_of=text("2025-01-01"),
        patterns=(
            ast.Pattern(nodes=(ast.NodePattern(variable="a"),)),
            ast.Pattern(
                nodes=(ast.NodePattern(variable="b"), ast.NodePattern(variable="c")), edges=(ast.EdgePattern(),)
            ),
        ),
        where=ast.Comparison(op="=", left=ast.Property(variable="a", name="x"), right=num(1)),
        distinct=True,
        returns=(
            ast.ReturnItem(expression=var("a"), name="first"),
            ast.ReturnItem(expression=ast.Property(variable="b", name="in")),
        ),
        order=(
            ast.OrderItem(expression=ast.Property(variable="a", name="x")),
            ast.OrderItem(expression=var("b"), descending=True),
            ast.OrderItem(expression=var("c")),
        ),
        rerank=ast.Rerank(question=ast.Parameter(name="q"), top=num(7)),
        skip=num(2),
        limit=ast.Parameter(name="n"),
    )


def test_a_script() -> None:
    script = "// two\nMATCH (o) RETURN o;;\nMATCH (p) RETURN p // the last\n"
    first, second = parse_script(script)
    assert (to_text(first), to_text(second)) == ("MATCH (o) RETURN o", "MATCH (p) RETURN p")
    assert script[second.span.start : second.span.end] == "MATCH (p) RETURN p"
    assert parse_script("") == parse_script(" ; // nothing") == ()
    with pytest.raises(ParseError) as caught:
        parse_script("MATCH (o) RETURN o;\nMATCH (o) RETRUN o")
    assert caught.value.position == (2, 11)


# -- patterns -----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("written", "meant"),
    [
        ("()", ast.NodePattern()),
        ("(o)", ast.NodePattern(variable="o")),
        ("(:Room)", ast.NodePattern(label="Room")),
        ("(o:Room)", ast.NodePattern(variable="o", label="Room")),
        ("(#12)", ast.NodePattern(id=ast.ObjectRef(id=12))),
        ("(#'chair-3')", ast.NodePattern(id=ast.ObjectRef(id="chair-3"))),
        ('(~ "shelf")', ast.NodePattern(meaning=text("shelf"))),
        ("(o ~ #3)", ast.NodePattern(variable="o", meaning=ast.ObjectRef(id=3))),
        ("(o #12)", ast.NodePattern(variable="o", id=ast.ObjectRef(id=12))),
        ("(#12 ~ $p)", ast.NodePattern(id=ast.ObjectRef(id=12), meaning=ast.Parameter(name="p"))),
        ("({a: 1})", ast.NodePattern(properties=(("a", num(1)),))),
        ("(o {})", ast.NodePattern(variable="o")),
        ("(#1 {in: -2 m})", ast.NodePattern(id=ast.ObjectRef(id=1), properties=(("in", num(-2, "m")),))),
        ("(`match`:match)", ast.NodePattern(variable="match", label="match")),
        (
            "(o:Room #1 {a: 1, `b c`: [x]} ~ 'y')",
            ast.NodePattern(
                variable="o",
                label="Room",
                id=ast.ObjectRef(id=1),
                properties=(("a", num(1)), ("b c", ast.ListOf(items=(var("x"),)))),
                meaning=text("y"),
            ),
        ),
    ],
)
def test_nodes(written: str, meant: ast.NodePattern) -> None:
    assert node(written) == meant
    # The same as the first node of a condition, where a parenthesis might begin an expression.
    condition = where(f"NOT {written}-->()")
    assert isinstance(condition, ast.Not) and isinstance(condition.item, ast.PatternCondition)
    assert condition.item.pattern.nodes[0] == meant


@pytest.mark.parametrize(
    ("written", "meant"),
    [
        ("-->", ast.EdgePattern()),
        ("<--", ast.EdgePattern(direction=ast.Direction.IN)),
        ("--", ast.EdgePattern(direction=ast.Direction.ANY)),
        ("-[]->", ast.EdgePattern()),
        ("-[:on]->", ast.EdgePattern(labels=("on",))),
        ("<-[:on]-", ast.EdgePattern(labels=("on",), direction=ast.Direction.IN)),
        ("-[:near]-", ast.EdgePattern(labels=("near",), direction=ast.Direction.ANY)),
        (" - [ :in | contains ] -> ", ast.EdgePattern(labels=("in", "contains"))),
        ("-[:`on top of`]->", ast.EdgePattern(labels=("on top of",))),
        ("-[r]->", ast.EdgePattern(variable="r")),
        ("-[r ~ 'x']->", ast.EdgePattern(variable="r", meaning=text("x"))),
        ("-[r:on*2..3 ~ $p]->", ast.EdgePattern(
            variable="r", labels=("on",), min_hops=2, max_hops=3, meaning=ast.Parameter(name="p"))),
        ("-[*]->", ast.EdgePattern(max_hops=None)),
        ("-[*2]->", ast.EdgePattern(min_hops=2, max_hops=2)),
        ("-[*..3]->", ast.EdgePattern(max_hops=3)),
        ("-[*2..]->", ast.EdgePattern(min_hops=2, max_hops=None)),
        ("-[*0..1]->", ast.EdgePattern(min_hops=0, max_hops=1)),
    ],
)  # fmt: skip
def test_edges(written: str, meant: ast.EdgePattern) -> None:
    assert edge(written) == meant


@pytest.mark.parametrize("word", ["in", "on", "near", "contains", "not", "and", "match", "limit", "true", "null", "m"])
def test_keywords_are_names_where_no_keyword_can_stand(word: str) -> None:
    query = parse(f"MATCH (a:{word})-[:{word}]->(b {{{word}: 1}}) RETURN a.{word} AS {word}")
    assert query.patterns[0].nodes[0].label == word
    assert query.patterns[0].edges[0].labels == (word,)
    assert query.patterns[0].nodes[1].properties[0][0] == word
    assert query.returns[0] == ast.ReturnItem(expression=ast.Property(variable="a", name=word), name=word)


# -- conditions ---------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("written", "canonical"),
    [
        ("a OR b AND NOT c = 1", "a OR b AND NOT c = 1"),
        ("(a OR b) AND c", "(a OR b) AND c"),
        ("a AND (b AND c) AND d", "a AND b AND c AND d"),
        ("NOT (a)", "NOT a"),
        ("NOT (a AND b)", "NOT (a AND b)"),
        ("NOT NOT a", "NOT NOT a"),
        ("((a.x))+1 = 2", "a.x + 1 = 2"),
        ("a - (b - c) - d", "a - (b - c) - d"),
        ("(a + b) * -c", "(a + b) * -c"),
        ("-(5)", "-(5)"),
        ("- -x", "- -x"),
        ("a - -1", "a - -1"),
        ("a <-1", "a < -1"),
        ("a<-1", "a < -1"),
        ("a - ([1])", "a - ([1])"),
        ("-([1])", "-([1])"),
        ("(o ~ 'x')", 'o ~ "x"'),
        ("(o ~ 'x') = true", '(o ~ "x") = true'),
        ("(o ~ 'x')-->(b)", '(o ~ "x")-->(b)'),
        ("(#1)-->(b) OR (#1) = b", "(#1)-->(b) OR #1 = b"),
        ("(b)-[:in]->(~ 'shelf') AND (b) = c", '(b)-[:in]->(~ "shelf") AND b = c'),
        ("(b)-->()--()<--(c)", "(b)-->()--()<--(c)"),
        ("(a) - 1 < 2", "a - 1 < 2"),
        ("x is not null and y IS null", "x IS NOT NULL AND y IS NULL"),
        ("x starts WITH 'a' or y Contains \"b\"", 'x STARTS WITH "a" OR y CONTAINS "b"'),
        ("5 in [4, 5]", "5 IN [4, 5]"),
        ("x < 5in", "x < 5in"),
        ("x < 5IN", "x < 5in"),
        ("x < 150cm + 2 M", "x < 150 cm + 2 m"),
        ("COUNT(*) = Count(DISTINCT x)", "count(*) = count(DISTINCT x)"),
        ("f()", "f()"),
        ("`in` = `a b`.`c d`", "`in` = `a b`.`c d`"),
        ("o.in = in", None),
        ("a = 'it\\'s' // comment", 'a = "it\'s"'),
        ("a = 1.50e+3", "a = 1500.0"),
        ("a = #-3", "a = #-3"),
        ("[] = [a, [b]]", "[] = [a, [b]]"),
        ("größe > 1", "größe > 1"),
        ("कुर्सी.नाम = 椅子", "कुर्सी.नाम = 椅子"),
        ("NULL = True", "null = true"),
    ],
)
def test_conditions(written: str, canonical: str | None) -> None:
    if canonical is None:
        with pytest.raises(ParseError):
            where(written)
    else:
        tree = where(written)
        assert to_text(tree) == canonical
        assert where(canonical) == tree


def test_a_minus_before_a_number_is_its_sign() -> None:
    assert where("-5 cm") == num(-5, "cm")
    assert where("-(5)") == ast.Negative(operand=num(5))
    assert where("- -5") == ast.Negative(operand=num(-5))


def test_and_and_or_are_flat() -> None:
    assert where("a AND (b AND c)") == ast.And(items=(var("a"), var("b"), var("c")))
    assert where("(a OR b) OR c") == ast.Or(items=(var("a"), var("b"), var("c")))


@pytest.mark.parametrize(
    ("written", "value"),
    [
        (r"'a\n\t\r\\\'\"\`'", "a\n\t\r\\'\"`"),
        (r'"\u00e9\u4e2d"', "é中"),
        (r'"\ud83d\ude00"', "😀"),
        ('"😀 // no comment; \'"', "😀 // no comment; '"),
        ("''", ""),
        ("'" + "x" * MAX_TEXT + "'", "x" * MAX_TEXT),
    ],
)
def test_texts(written: str, value: str) -> None:
    assert where(written) == text(value)


# -- places -------------------------------------------------------------------------------------------------------


def test_every_node_of_the_tree_knows_its_place() -> None:
    source = (
        "  MATCH (o:Room {a: 1 cm} ~ 'x')-[r:on*2]->(`b c`), (#1)\n WHERE (o) = 1 + o.y AND NOT (o ~ 'z') "
        "AND (o)-->() RETURN count( DISTINCT o ) AS n, [1] ORDER BY -o.x DESC RERANK BY 'q' TOP 3 LIMIT 5 ;"
    )
    query = parse(source)
    places: dict[str, list[str]] = {}
    stack: list[ast.Syntax] = [query]
    while stack:
        item = stack.pop()
        places.setdefault(type(item).__name__, []).append(source[item.span.start : item.span.end])
        for child in children(item):
            assert item.span.start <= child.span.start < child.span.end <= item.span.end or isinstance(
                child, ast.Syntax
            )
            stack.append(child)
    assert places["Query"] == [source.strip()[:-2]]
    assert set(places["NodePattern"]) == {"(o:Room {a: 1 cm} ~ 'x')", "(`b c`)", "(#1)", "(o)", "()"}
    assert sorted(places["EdgePattern"]) == ["-->", "-[r:on*2]->"]
    assert places["Pattern"].count("(o)-->()") == 1 and places["PatternCondition"] == ["(o)-->()"]
    assert places["Similar"] == ["o ~ 'z'"]
    assert places["Not"] == ["NOT (o ~ 'z')"]
    assert places["Comparison"] == ["(o) = 1 + o.y"]
    assert set(places["Variable"]) == {"o"}
    assert places["Property"] == ["o.x", "o.y"] or places["Property"] == ["o.y", "o.x"]
    assert places["ReturnItem"] == ["[1]", "count( DISTINCT o ) AS n"]
    assert places["OrderItem"] == ["-o.x DESC"] and places["Negative"] == ["-o.x"]
    assert places["Rerank"] == ["RERANK BY 'q' TOP 3"]
    assert set(places["Number"]) == {"1 cm", "1", "3", "5"}


# -- what is refused ----------------------------------------------------------------------------------------------


def test_a_text_that_is_too_long() -> None:
    with pytest.raises(LimitError, match="20,000"):
        parse("MATCH (o) RETURN o" + " " * MAX_LENGTH)
    with pytest.raises(LimitError, match="20,000"):
        parse_script("MATCH (o) RETURN o; MATCH (o) RETURN o" + ", o" * MAX_LENGTH)
    assert len(parse_script("MATCH (o) RETURN o;\n" * 2000)) == 2000
    with pytest.raises(LimitError):
        parse_script(" " * 2_000_000)


@pytest.mark.parametrize(
    "condition",
    [
        "(" * 5000 + "a" + ")" * 5000,
        "(" * 5000,
        "[" * 5000,
        "NOT " * 4000 + "a",
        "- " * 8000 + "a",
        "1" + " + 1" * 4000,
        "f(" * 61 + ")" * 61,
        "(a)-->({x: " * 31 + "1" + "})" * 31,
    ],
)
def test_a_text_that_is_nested_too_deeply(condition: str) -> None:
    with pytest.raises(LimitError, match="60 deep"):
        parse_condition(condition)
    with pytest.raises(LimitError, match="60 deep"):
        parse(f"MATCH (o) WHERE {condition} RETURN o")


def test_a_text_that_is_as_deep_as_may_be() -> None:
    for deepest in ("[" * 59 + "1" + "]" * 59, "NOT " * 59 + "a", "(" * 60 + "a" + ")" * 60, "1" + " + 1" * 59):
        tree = parse_condition(deepest)
        assert parse_condition(to_text(tree)) == tree
    assert MAX_DEPTH == 60
    wide = parse_condition(" AND ".join(["a"] * 3000))
    assert isinstance(wide, ast.And) and len(wide.items) == 3000


@pytest.mark.parametrize(
    "bad", ["MATCH (o) RETURN o\0", "MATCH (o ~ '\ud800') RETURN o", "\udfff", "MATCH (o)\0", "\0"]
)
def test_characters_that_cannot_be(bad: str) -> None:
    for function in (parse, parse_script, parse_condition):
        with pytest.raises(ParseError, match="cannot stand"):
            function(bad)


@pytest.mark.parametrize(
    "bad", [r"'\u0000'", r"'\ud800'", r"'\udc00\ud800'", "9223372036854775808", "1e999", r"'\q'", "``"]
)
def test_values_that_cannot_be(bad: str) -> None:
    with pytest.raises(ParseError):
        parse_condition(bad)


def test_what_is_no_text() -> None:
    with pytest.raises(UsageError, match="bytes"):
        parse(b"MATCH (o) RETURN o")  # type: ignore[arg-type]


def test_errors_carry_the_text_and_the_place() -> None:
    with pytest.raises(CgdbError) as caught:
        parse("MATCH (o)\nRETRUN o")
    assert caught.value.position == (2, 1)
    assert caught.value.span == Span(10, 16)
    assert caught.value.to_json()["hint"] == "did you mean 'RETURN'?"
