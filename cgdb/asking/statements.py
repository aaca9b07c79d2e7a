"""Statements, changed before they are run: asked of less, of more, or of the same with its objects in sight."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from cgdb.english import tree_parts as parts
from cgdb.grammar import ast
from cgdb.query.expressions import is_total
from cgdb.result import StoredNode


def best_of(node: ast.NodePattern, most: int) -> ast.Query:
    """The best things for one node of a pattern, which has a variable."""
    assert node.variable is not None
    return ast.Query(
        patterns=(parts.nodes(node),),
        returns=(parts.item(ast.Variable(name=node.variable)),),
        limit=ast.Number(value=most),
    )


def like(meaning: ast.Meaning) -> ast.NodePattern:
    """``(o ~ meaning)``."""
    return ast.NodePattern(variable=parts.SUBJECT, meaning=meaning)


def among_previous(tree: ast.Query) -> ast.Query:
    """The statement, asked only of what the answer before found."""
    first = tree.returns[0].expression
    name = first.name if isinstance(first, ast.Variable) else tree.patterns[0].nodes[0].variable
    return tree if name is None else also(tree, parts.among_previous(name))


def among_these(variable: str, nodes: Sequence[StoredNode]) -> ast.Expression:
    """That a variable is one of these things, by their ids."""
    ids: tuple[ast.Expression, ...] = tuple(
        ast.Text(value=node.id) if isinstance(node.id, str) else ast.Number(value=node.id) for node in nodes
    )
    return ast.In(item=ast.Property(variable=variable, name="id"), collection=ast.ListOf(items=ids))


def also(tree: ast.Query, *conditions: ast.Expression) -> ast.Query:
    """The statement, with conditions that come before its own."""
    return replace(tree, where=parts.all_of([*conditions, *(() if tree.where is None else (tree.where,))]))


def returns_total(tree: ast.Query) -> bool:
    """Whether a column of it is a total over rows."""
    return any(is_total(item.expression) for item in tree.returns)


def of_objects(tree: ast.Query) -> ast.Query:
    """The statement, returning its object too where it only returns texts and numbers of it."""
    returned = [item.expression for item in tree.returns]
    if tree.distinct or any(isinstance(item, ast.Variable) or is_total(item) for item in returned):
        return tree
    named = {node.variable for pattern in tree.patterns for node in pattern.nodes if node.variable}
    variable = next(
        (item.variable for item in returned if isinstance(item, ast.Property) and item.variable in named), None
    )
    if variable is None:
        return tree
    return replace(tree, returns=(ast.ReturnItem(expression=ast.Variable(name=variable)), *tree.returns))


def by_score(tree: ast.Query) -> ast.Query:
    """The statement without an ORDER BY score ... DESC: the best come first anyway, and nothing was measured."""
    names = {item.name for item in tree.returns if item.name and _is_score(item.expression)}
    for item in tree.order:
        is_name = isinstance(item.expression, ast.Variable) and item.expression.name in names
        if not item.descending or not (_is_score(item.expression) or is_name):
            return tree
    return replace(tree, order=())


def _is_score(item: ast.Expression) -> bool:
    return isinstance(item, ast.Call) and item.name == "score"


def uncut(tree: ast.Query, most: int) -> tuple[ast.Query, int | None]:
    """The statement with at least ``most`` rows, and its own LIMIT where that was less; an order is left alone."""
    if tree.order or tree.skip is not None or not isinstance(tree.limit, ast.Number) or tree.limit.value >= most:
        return tree, None
    if returns_total(tree):
        return tree, None
    return replace(tree, limit=ast.Number(value=most)), int(tree.limit.value)
