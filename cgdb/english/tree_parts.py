"""The pieces of CGQL trees that questions are written with, ``o`` being what is asked for."""

from __future__ import annotations

from collections.abc import Sequence

from cgdb.grammar import ast

LONGEST_MEANING = 300
"""Characters of one ``~``; what is said in more is no longer one thing."""

SUBJECT, ROOM = "o", "r"


def cut(text: str) -> str:
    """A text as short as one ``~`` may be."""
    return text[:LONGEST_MEANING].strip()


def meaning(text: str) -> ast.Text | None:
    """What a node is to mean; None for anything."""
    return ast.Text(value=cut(text)) if text.strip() else None


def similar(text: str) -> ast.Expression:
    """``o ~ "text"``."""
    return ast.Similar(variable=SUBJECT, meaning=ast.Text(value=cut(text)))


def subject_node() -> ast.NodePattern:
    """``(o)``."""
    return ast.NodePattern(variable=SUBJECT)


def nodes(node: ast.NodePattern) -> ast.Pattern:
    """A pattern of one node."""
    return ast.Pattern(nodes=(node,))


def pattern(one: ast.NodePattern, edge: ast.EdgePattern, other: ast.NodePattern) -> ast.Expression:
    """That there is such an edge."""
    return ast.PatternCondition(pattern=ast.Pattern(nodes=(one, other), edges=(edge,)))


def all_of(items: Sequence[ast.Expression]) -> ast.Expression:
    """AND, flat."""
    flat = [part for item in items for part in (item.items if isinstance(item, ast.And) else (item,))]
    return flat[0] if len(flat) == 1 else ast.And(items=tuple(flat))


def any_of(items: Sequence[ast.Expression]) -> ast.Expression:
    """OR, flat."""
    flat = [part for item in items for part in (item.items if isinstance(item, ast.Or) else (item,))]
    return flat[0] if len(flat) == 1 else ast.Or(items=tuple(flat))


def call(name: str, *arguments: ast.Expression) -> ast.Call:
    """``name(arguments)``."""
    return ast.Call(name=name, arguments=arguments)


def compared(op: str, left: ast.Expression, right: ast.Expression) -> ast.Expression:
    """``left op right``."""
    return ast.Comparison(op=op, left=left, right=right)


def count(name: str, *, distinct: bool = False) -> ast.Call:
    """``count(name)``."""
    return ast.Call(name="count", arguments=(ast.Variable(name=name),), distinct=distinct)


def collect(name: str, *, distinct: bool = False) -> ast.Call:
    """``collect(name)``."""
    return ast.Call(name="collect", arguments=(ast.Variable(name=name),), distinct=distinct)


def item(expression: ast.Expression, name: str | None = None) -> ast.ReturnItem:
    """A column."""
    return ast.ReturnItem(expression=expression, name=name)


def ordered(expression: ast.Expression, *, descending: bool) -> ast.OrderItem:
    """A member of ORDER BY."""
    return ast.OrderItem(expression=expression, descending=descending)


def number(value: float, unit: str | None = None) -> ast.Number:
    """A number, whole where it is."""
    return ast.Number(value=int(value) if float(value).is_integer() else value, unit=unit)


def differ(other: ast.Variable) -> ast.Expression:
    """That ``o`` is another thing."""
    return compared("<>", call("id", ast.Variable(name=SUBJECT)), call("id", other))


def among_previous(variable: str) -> ast.Expression:
    """That a thing is one of those that were found before."""
    return ast.In(item=ast.Property(variable=variable, name="id"), collection=ast.Parameter(name="previous"))
