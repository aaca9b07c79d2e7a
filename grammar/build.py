"""What each rule of cgql.lark makes: the names after ``->`` there are functions here.

Each is given the values of the rule's symbols and the place of the rule in the text. A token's value is its text.
"""

from __future__ import annotations

import re
from collections.abc import Callable
from typing import Any, TypeAlias

from cgdb.errors import ParseError, Span
from cgdb.grammar import ast

Values: TypeAlias = list[Any]
MOST = 2**63 - 1
"""The largest whole number: what a column of the store holds."""

BUILD: dict[str, Callable[[Values, int, int], Any]] = {}


def rule(function: Callable[[Values, int, int], Any]) -> Callable[[Values, int, int], Any]:
    """Register a function under its name, less a trailing underscore."""
    BUILD[function.__name__.rstrip("_")] = function
    return function


# -- shapes that many rules share -------------------------------------------------------------------------------


@rule
def absent(v: Values, start: int, end: int) -> None:
    return None


@rule
def nothing(v: Values, start: int, end: int) -> list[Any]:
    return []


@rule
def first(v: Values, start: int, end: int) -> Any:
    return v[0]


@rule
def second(v: Values, start: int, end: int) -> Any:
    return v[1]


@rule
def third(v: Values, start: int, end: int) -> Any:
    return v[2]


@rule
def one(v: Values, start: int, end: int) -> list[Any]:
    return [v[0]]


@rule
def another(v: Values, start: int, end: int) -> list[Any]:
    v[0].append(v[2])
    return v[0]  # type: ignore[no-any-return]


@rule
def pair(v: Values, start: int, end: int) -> tuple[Any, Any]:
    return v[0], v[2]


# -- the statement ----------------------------------------------------------------------------------------------


@rule
def more(v: Values, start: int, end: int) -> list[Any]:
    v[0].append(v[1])
    return v[0]  # type: ignore[no-any-return]


@rule
def finished(v: Values, start: int, end: int) -> tuple[ast.Query, ...]:
    return tuple(v[0])


@rule
def last(v: Values, start: int, end: int) -> tuple[ast.Query, ...]:
    return (*v[0], v[1])


@rule
def query(v: Values, start: int, end: int) -> ast.Query:
    mode, scenes, as_of, _, patterns, where, (distinct, returns), order, rerank, skip, limit = v
    return ast.Query(
        mode=ast.Mode(mode.upper()) if mode else ast.Mode.RUN,
        scenes=tuple(scenes),
        as_of=as_of,
        patterns=tuple(patterns),
        where=where,
        distinct=distinct,
        returns=tuple(returns),
        order=tuple(order),
        rerank=rerank,
        skip=skip,
        limit=limit,
        span=Span(start, end),
    )


@rule
def wanted(v: Values, start: int, end: int) -> tuple[bool, list[ast.ReturnItem]]:
    return len(v) > 2, v[-1]


@rule
def return_item(v: Values, start: int, end: int) -> ast.ReturnItem:
    return ast.ReturnItem(expression=v[0], span=Span(start, end))


@rule
def named_item(v: Values, start: int, end: int) -> ast.ReturnItem:
    return ast.ReturnItem(expression=v[0], name=v[2], span=Span(start, end))


@rule
def ascending(v: Values, start: int, end: int) -> ast.OrderItem:
    return ast.OrderItem(expression=v[0], span=Span(start, end))


@rule
def descending(v: Values, start: int, end: int) -> ast.OrderItem:
    return ast.OrderItem(expression=v[0], descending=True, span=Span(start, end))


@rule
def rerank(v: Values, start: int, end: int) -> ast.Rerank:
    return ast.Rerank(question=v[2], top=v[4] if len(v) > 3 else None, span=Span(start, end))


# -- patterns ---------------------------------------------------------------------------------------------------


@rule
def single(v: Values, start: int, end: int) -> ast.Pattern:
    return ast.Pattern(nodes=(v[0],), span=Span(start, end))


@rule
def chain(v: Values, start: int, end: int) -> list[Any]:
    return v


@rule
def longer(v: Values, start: int, end: int) -> list[Any]:
    v[0] += v[1:]
    return v[0]  # type: ignore[no-any-return]


@rule
def pattern(v: Values, start: int, end: int) -> ast.Pattern:
    return ast.Pattern(nodes=tuple(v[0][::2]), edges=tuple(v[0][1::2]), span=Span(start, end))


@rule
def pattern_condition(v: Values, start: int, end: int) -> ast.PatternCondition:
    return ast.PatternCondition(pattern=pattern(v, start, end), span=Span(start, end))


@rule
def named_node(v: Values, start: int, end: int) -> ast.NodePattern:
    return ast.NodePattern(variable=v[0].name, span=Span(start, end))


@rule
def alike_node(v: Values, start: int, end: int) -> ast.NodePattern:
    return ast.NodePattern(variable=v[0].variable, meaning=v[0].meaning, span=Span(start, end))


@rule
def referred_node(v: Values, start: int, end: int) -> ast.NodePattern:
    return ast.NodePattern(id=v[0], span=Span(start, end))


@rule
def empty_node(v: Values, start: int, end: int) -> ast.NodePattern:
    return ast.NodePattern(span=Span(start, end))


@rule
def meant_node(v: Values, start: int, end: int) -> ast.NodePattern:
    return ast.NodePattern(meaning=v[2], span=Span(start, end))


@rule
def described_node(v: Values, start: int, end: int) -> ast.NodePattern:
    return ast.NodePattern(properties=tuple(v[1]), meaning=v[2], span=Span(start, end))


@rule
def reference_node(v: Values, start: int, end: int) -> ast.NodePattern:
    return ast.NodePattern(id=v[1], properties=tuple(v[2]), meaning=v[3], span=Span(start, end))


@rule
def reference_meant_node(v: Values, start: int, end: int) -> ast.NodePattern:
    return ast.NodePattern(id=v[1], meaning=v[3], span=Span(start, end))


@rule
def labelled_node(v: Values, start: int, end: int) -> ast.NodePattern:
    return ast.NodePattern(label=v[2], id=v[3], properties=tuple(v[4]), meaning=v[5], span=Span(start, end))


@rule
def full_node(v: Values, start: int, end: int) -> ast.NodePattern:
    _, name, _, label, ref, properties, meaning, _ = v
    return ast.NodePattern(
        variable=name, label=label, id=ref, properties=tuple(properties), meaning=meaning, span=Span(start, end)
    )


@rule
def variable_reference_node(v: Values, start: int, end: int) -> ast.NodePattern:
    return ast.NodePattern(variable=v[1], id=v[2], properties=tuple(v[3]), meaning=v[4], span=Span(start, end))


@rule
def variable_described_node(v: Values, start: int, end: int) -> ast.NodePattern:
    return ast.NodePattern(variable=v[1], properties=tuple(v[2]), meaning=v[3], span=Span(start, end))


_PLAIN = {"-->": ast.Direction.OUT, "<--": ast.Direction.IN, "--": ast.Direction.ANY}


@rule
def plain_edge(v: Values, start: int, end: int) -> ast.EdgePattern:
    return ast.EdgePattern(direction=_PLAIN[v[0]], span=Span(start, end))


def _edge(v: Values, start: int, end: int, direction: ast.Direction) -> ast.EdgePattern:
    _, name, labels, (least, most), meaning, *_ = v
    return ast.EdgePattern(
        variable=name,
        labels=tuple(labels),
        meaning=meaning,
        min_hops=least,
        max_hops=most,
        direction=direction,
        span=Span(start, end),
    )


@rule
def edge_out(v: Values, start: int, end: int) -> ast.EdgePattern:
    return _edge(v, start, end, ast.Direction.OUT)


@rule
def edge_in(v: Values, start: int, end: int) -> ast.EdgePattern:
    return _edge(v, start, end, ast.Direction.IN)


@rule
def edge_any(v: Values, start: int, end: int) -> ast.EdgePattern:
    return _edge(v, start, end, ast.Direction.ANY)


@rule
def hops_one(v: Values, start: int, end: int) -> tuple[int, int | None]:
    return 1, 1


@rule
def hops_any(v: Values, start: int, end: int) -> tuple[int, int | None]:
    return 1, None


@rule
def hops_exact(v: Values, start: int, end: int) -> tuple[int, int | None]:
    hops = _whole(v[1], start, end)
    return hops, hops


@rule
def hops_from(v: Values, start: int, end: int) -> tuple[int, int | None]:
    return _whole(v[1], start, end), None


@rule
def hops_to(v: Values, start: int, end: int) -> tuple[int, int | None]:
    return _hops(1, _whole(v[2], start, end), start, end)


@rule
def hops_between(v: Values, start: int, end: int) -> tuple[int, int | None]:
    return _hops(_whole(v[1], start, end), _whole(v[3], start, end), start, end)


def _hops(least: int, most: int, start: int, end: int) -> tuple[int, int]:
    if most < least:
        raise ParseError(
            f"a path of at least {least} and at most {most} hops cannot be",
            hint="write the smaller number first: *1..3",
            span=Span(start, end),
        )
    return least, most


# -- conditions and values --------------------------------------------------------------------------------------


@rule
def either(v: Values, start: int, end: int) -> ast.Or:
    return ast.Or(items=(*_inside(v[0], ast.Or), *_inside(v[2], ast.Or)), span=Span(start, end))


@rule
def both(v: Values, start: int, end: int) -> ast.And:
    return ast.And(items=(*_inside(v[0], ast.And), *_inside(v[2], ast.And)), span=Span(start, end))


def _inside(item: ast.Expression, kind: type[ast.And] | type[ast.Or]) -> tuple[ast.Expression, ...]:
    """And inside And, and Or inside Or, say nothing more than one of all the items."""
    return item.items if isinstance(item, kind) else (item,)


@rule
def negation(v: Values, start: int, end: int) -> ast.Not:
    return ast.Not(item=v[1], span=Span(start, end))


@rule
def comparison(v: Values, start: int, end: int) -> ast.Comparison:
    return ast.Comparison(op=v[1], left=v[0], right=v[2], span=Span(start, end))


@rule
def membership(v: Values, start: int, end: int) -> ast.In:
    return ast.In(item=v[0], collection=v[2], span=Span(start, end))


@rule
def contains(v: Values, start: int, end: int) -> ast.Contains:
    return ast.Contains(text=v[0], part=v[2], span=Span(start, end))


@rule
def starts_with(v: Values, start: int, end: int) -> ast.StartsWith:
    return ast.StartsWith(text=v[0], prefix=v[3], span=Span(start, end))


@rule
def is_null(v: Values, start: int, end: int) -> ast.IsNull:
    return ast.IsNull(item=v[0], span=Span(start, end))


@rule
def is_not_null(v: Values, start: int, end: int) -> ast.IsNull:
    return ast.IsNull(item=v[0], negated=True, span=Span(start, end))


@rule
def similar(v: Values, start: int, end: int) -> ast.Similar:
    return ast.Similar(variable=v[0], meaning=v[2], span=Span(start, end))


@rule
def arithmetic(v: Values, start: int, end: int) -> ast.Arithmetic:
    return ast.Arithmetic(op=v[1], left=v[0], right=v[2], span=Span(start, end))


@rule
def minus(v: Values, start: int, end: int) -> ast.Negative:
    return ast.Negative(operand=v[1], span=Span(start, end))


@rule
def minus_number(v: Values, start: int, end: int) -> ast.Number:
    return ast.Number(value=-v[1].value, unit=v[1].unit, span=Span(start, end))


@rule
def true(v: Values, start: int, end: int) -> ast.Boolean:
    return ast.Boolean(value=True, span=Span(start, end))


@rule
def false(v: Values, start: int, end: int) -> ast.Boolean:
    return ast.Boolean(value=False, span=Span(start, end))


@rule
def null(v: Values, start: int, end: int) -> ast.Null:
    return ast.Null(span=Span(start, end))


@rule
def variable(v: Values, start: int, end: int) -> ast.Variable:
    return ast.Variable(name=v[0], span=Span(start, end))


@rule
def property_(v: Values, start: int, end: int) -> ast.Property:
    return ast.Property(variable=v[0], name=v[2], span=Span(start, end))


@rule
def call(v: Values, start: int, end: int) -> ast.Call:
    return ast.Call(name=v[0].lower(), arguments=tuple(v[2]) if len(v) > 3 else (), span=Span(start, end))


@rule
def call_distinct(v: Values, start: int, end: int) -> ast.Call:
    return ast.Call(name=v[0].lower(), arguments=tuple(v[3]), distinct=True, span=Span(start, end))


@rule
def call_star(v: Values, start: int, end: int) -> ast.Call:
    return ast.Call(name=v[0].lower(), star=True, span=Span(start, end))


@rule
def empty_list(v: Values, start: int, end: int) -> ast.ListOf:
    return ast.ListOf(items=(), span=Span(start, end))


@rule
def list_of(v: Values, start: int, end: int) -> ast.ListOf:
    return ast.ListOf(items=tuple(v[1]), span=Span(start, end))


# -- words ------------------------------------------------------------------------------------------------------


@rule
def quoted(v: Values, start: int, end: int) -> str:
    return _unescaped(v[0], start)


@rule
def text(v: Values, start: int, end: int) -> ast.Text:
    return ast.Text(value=_unescaped(v[0], start), span=Span(start, end))


@rule
def parameter(v: Values, start: int, end: int) -> ast.Parameter:
    return ast.Parameter(name=v[0][1:], span=Span(start, end))


@rule
def reference(v: Values, start: int, end: int) -> ast.ObjectRef:
    return ast.ObjectRef(id=_whole(v[1], start, end), span=Span(start, end))


@rule
def reference_below(v: Values, start: int, end: int) -> ast.ObjectRef:
    return ast.ObjectRef(id=-_whole(v[2], start, end), span=Span(start, end))


@rule
def reference_text(v: Values, start: int, end: int) -> ast.ObjectRef:
    return ast.ObjectRef(id=_unescaped(v[1], end - len(v[1])), span=Span(start, end))


@rule
def integer(v: Values, start: int, end: int) -> ast.Number:
    unit = v[1].lower() if len(v) > 1 else None
    return ast.Number(value=_whole(v[0], start, end), unit=unit, span=Span(start, end))


@rule
def decimal(v: Values, start: int, end: int) -> ast.Number:
    unit = v[1].lower() if len(v) > 1 else None
    return ast.Number(value=_real(v[0], start, end), unit=unit, span=Span(start, end))


@rule
def inches(v: Values, start: int, end: int) -> ast.Number:
    digits = v[0][:-2]
    value = _whole(digits, start, end) if digits.isdecimal() else _real(digits, start, end)
    return ast.Number(value=value, unit="in", span=Span(start, end))


def _whole(digits: str, start: int, end: int) -> int:
    value = int(digits)
    if value > MOST:
        raise ParseError(f"a whole number is at most {MOST}", span=Span(start, end))
    return value


def _real(digits: str, start: int, end: int) -> float:
    value = float(digits)
    if value == float("inf"):
        raise ParseError("this number is too large", span=Span(start, end))
    return value


_ESCAPE = re.compile(r"((?:\\u[0-9a-fA-F]{4})+)|\\(.)")
_LETTERS = {"n": "\n", "r": "\r", "t": "\t"}


def _unescaped(literal: str, start: int) -> str:
    """The text between the quotes of a literal that begins at start, its escapes carried out."""
    inner = literal[1:-1]
    if "\\" not in inner:
        return inner

    def carried_out(match: re.Match[str]) -> str:
        if match[2] is not None:
            return _LETTERS.get(match[2], match[2])
        # A character beyond U+FFFF may be written as the two halves that JSON writes; a half alone is no character.
        codes = bytes.fromhex("".join(match[1].split("\\u")))
        place = Span(start + 1 + match.start(), start + 1 + match.end())
        try:
            characters = codes.decode("utf-16-be")
        except UnicodeDecodeError:
            raise ParseError("this escape is half a character", hint="write the character itself", span=place) from None
        if "\0" in characters:
            raise ParseError("a text cannot hold the character NUL", span=place)
        return characters

    return _ESCAPE.sub(carried_out, inner)
