"""What an expression is made of: its parts, the variables that it names, and whether it is a total."""

from __future__ import annotations

from collections.abc import Iterable, Iterator

from cgdb.grammar import ast
from cgdb.query.functions import AGGREGATES


def parts(item: object) -> Iterable[object]:
    """The expressions directly inside an expression; of a list, which may be very long, not its plain values."""
    match item:
        case ast.And() | ast.Or():
            return item.items
        case ast.ListOf():
            return [x for x in item.items if not isinstance(x, ast.Text | ast.Number | ast.Boolean | ast.Null)]
        case ast.Not() | ast.IsNull():
            return (item.item,)
        case ast.Comparison() | ast.Arithmetic():
            return (item.left, item.right)
        case ast.In():
            return (item.item, item.collection)
        case ast.Contains():
            return (item.text, item.part)
        case ast.StartsWith():
            return (item.text, item.prefix)
        case ast.Negative():
            return (item.operand,)
        case ast.Call():
            return item.arguments
    return ()


def inside(item: object) -> Iterator[object]:
    """The expression and all that it is made of, outermost first."""
    yield item
    for part in parts(item):
        yield from inside(part)


def variables(item: object) -> frozenset[str]:
    """The variables that an expression names."""
    if isinstance(item, ast.Variable):
        return frozenset((item.name,))
    if isinstance(item, (ast.Property, ast.Similar)):
        return frozenset((item.variable,))
    if isinstance(item, ast.PatternCondition):
        nodes = {node.variable for node in item.pattern.nodes if node.variable is not None}
        edges = {edge.variable for edge in item.pattern.edges if edge.variable is not None}
        inner = [value for node in item.pattern.nodes for _, value in node.properties]
        return frozenset(nodes | edges).union(*map(variables, inner))
    return frozenset().union(*(variables(part) for part in parts(item)))


def is_total(item: object) -> bool:
    """Whether it is an aggregate, or worked out from one."""
    return any(isinstance(one, ast.Call) and one.name in AGGREGATES for one in inside(item))


def names_score(item: object) -> bool:
    """Whether it asks for a score."""
    return any(isinstance(one, ast.Call) and one.name == "score" for one in inside(item))
