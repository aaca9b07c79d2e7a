"""Hypothesis strategies: every tree of CGQL that can be written, and texts that are nearly CGQL."""

from __future__ import annotations

from hypothesis import strategies as st

from cgdb.grammar import ast
from cgdb.grammar.machine import KEYWORDS

# Every script, quotes, control characters, beyond U+FFFF: all but NUL and half characters.
characters = st.characters(exclude_characters="\0", exclude_categories=["Cs"])
texts_ = st.text(characters, max_size=12)
words = st.one_of(
    st.sampled_from(["o", "a", "b", "on", "in", "next_to", "größe", "m", "cm", "count", "_x1"]),
    st.sampled_from(sorted(KEYWORDS)).flatmap(lambda word: st.sampled_from([word, word.lower(), word.title()])),
)
names = st.one_of(words, st.text(characters, min_size=1, max_size=8), st.just("on top of"))

texts = st.builds(ast.Text, value=texts_)
parameters = st.builds(ast.Parameter, name=words)
whole = st.builds(ast.Number, value=st.integers(min_value=0, max_value=2**63 - 1))
units = st.one_of(st.none(), st.sampled_from(sorted(ast.UNITS)))
numbers = st.builds(
    ast.Number,
    value=st.one_of(
        st.integers(min_value=1 - 2**63, max_value=2**63 - 1),
        st.integers(min_value=-3, max_value=3),
        st.floats(allow_nan=False, allow_infinity=False),
    ),
    unit=units,
)
references = st.builds(ast.ObjectRef, id=st.one_of(st.integers(1 - 2**63, 2**63 - 1), texts_))
meanings = st.one_of(texts, parameters, references)
leaves = st.one_of(
    texts,
    numbers,
    parameters,
    references,
    st.builds(ast.Boolean, value=st.booleans()),
    st.builds(ast.Null),
    st.builds(ast.Variable, name=names),
    st.builds(ast.Property, variable=names, name=names),
    st.builds(ast.Similar, variable=names, meaning=meanings),
)


def _tuples(items: st.SearchStrategy[ast.Expression], least: int, most: int = 3) -> st.SearchStrategy[tuple]:
    return st.lists(items, min_size=least, max_size=most).map(tuple)


def nodes(values: st.SearchStrategy[ast.Expression]) -> st.SearchStrategy[ast.NodePattern]:
    """Node patterns whose properties have these values."""
    return st.builds(
        ast.NodePattern,
        variable=st.none() | names,
        label=st.none() | names,
        id=st.none() | references,
        properties=st.lists(st.tuples(names, values), max_size=2).map(tuple),
        meaning=st.none() | meanings,
    )


@st.composite
def edges(draw: st.DrawFn) -> ast.EdgePattern:
    """Edge patterns of every shape."""
    least = draw(st.integers(0, 4))
    most = draw(st.none() | st.integers(least, 6))
    if draw(st.booleans()):
        least, most = 1, 1
    return ast.EdgePattern(
        variable=draw(st.none() | names),
        labels=draw(st.lists(names, max_size=2).map(tuple)),
        meaning=draw(st.none() | meanings),
        min_hops=least,
        max_hops=most,
        direction=draw(st.sampled_from(list(ast.Direction))),
    )


def patterns(values: st.SearchStrategy[ast.Expression], least: int = 0) -> st.SearchStrategy[ast.Pattern]:
    """Chains of nodes and at least that many edges."""

    def of_length(length: int) -> st.SearchStrategy[ast.Pattern]:
        points = st.tuples(*[nodes(values)] * (length + 1))
        return st.builds(ast.Pattern, nodes=points, edges=st.tuples(*[edges()] * length))

    return st.one_of(of_length(least), of_length(least + 1))


def _larger(inner: st.SearchStrategy[ast.Expression]) -> st.SearchStrategy[ast.Expression]:
    flat_and = inner.filter(lambda e: not isinstance(e, ast.And))
    flat_or = inner.filter(lambda e: not isinstance(e, ast.Or))
    functions = names.map(str.lower).filter(lambda n: n == n.lower())
    return st.one_of(
        st.builds(ast.ListOf, items=_tuples(inner, 0)),
        st.builds(ast.Call, name=functions, arguments=_tuples(inner, 0)),
        st.builds(ast.Call, name=functions, arguments=_tuples(inner, 1), distinct=st.just(True)),
        st.builds(ast.Call, name=functions, star=st.just(True)),
        st.builds(ast.Arithmetic, op=st.sampled_from("+-*/%"), left=inner, right=inner),
        st.builds(ast.Negative, operand=inner),
        st.builds(ast.And, items=_tuples(flat_and, 2)),
        st.builds(ast.Or, items=_tuples(flat_or, 2)),
        st.builds(ast.Not, item=inner),
        st.builds(ast.Comparison, op=st.sampled_from(["=", "<>", "<", "<=", ">", ">="]), left=inner, right=inner),
        st.builds(ast.In, item=inner, collection=inner),
        st.builds(ast.Contains, text=inner, part=inner),
        st.builds(ast.StartsWith, text=inner, prefix=inner),
        st.builds(ast.IsNull, item=inner, negated=st.booleans()),
        st.builds(ast.PatternCondition, pattern=patterns(inner, least=1)),
    )


_expressions = st.recursive(leaves, _larger, max_leaves=10)


@st.composite
def expressions(draw: st.DrawFn) -> ast.Expression:
    """Conditions and values: parse_condition(to_text(tree)) == tree for each."""
    return draw(_expressions)


_queries = st.builds(
    ast.Query,
    mode=st.sampled_from(list(ast.Mode)),
    scenes=st.lists(texts | parameters, max_size=2).map(tuple),
    as_of=st.none() | whole | texts | parameters,
    patterns=st.lists(patterns(expressions()), min_size=1, max_size=2).map(tuple),
    where=st.none() | expressions(),
    distinct=st.booleans(),
    returns=st.lists(
        st.builds(ast.ReturnItem, expression=expressions(), name=st.none() | names), min_size=1, max_size=2
    ).map(tuple),
    order=st.lists(st.builds(ast.OrderItem, expression=expressions(), descending=st.booleans()), max_size=2).map(tuple),
    rerank=st.none() | st.builds(ast.Rerank, question=texts | parameters, top=st.none() | whole | parameters),
    skip=st.none() | whole | parameters,
    limit=st.none() | whole | parameters,
)


@st.composite
def queries(draw: st.DrawFn) -> ast.Query:
    """Statements: parse(to_text(query)) == query for each."""
    return draw(_queries)
