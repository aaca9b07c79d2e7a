"""Statements with an edge turned round: models, and people, mix up which end of a relation is its subject."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import fields, is_dataclass, replace
from typing import Any

from cgdb.grammar import ast

MOST = 4

_OTHER_WAY = {ast.Direction.OUT: ast.Direction.IN, ast.Direction.IN: ast.Direction.OUT}


def turned(tree: ast.Query) -> Iterator[tuple[ast.Query, ast.EdgePattern]]:
    """The statement with one directed edge the other way, for each such edge; and the edge as it was.

    What stands under NOT is left alone: turning it round would let in what was to be kept out.
    """
    edges = [edge for edge in _edges((tree.patterns, tree.where)) if edge.direction in _OTHER_WAY]
    for edge in edges[:MOST]:
        other = replace(edge, direction=_OTHER_WAY[edge.direction])
        patterns = tuple(_with(pattern, edge, other) for pattern in tree.patterns)
        yield replace(tree, patterns=patterns, where=_with(tree.where, edge, other)), edge


def _edges(item: Any) -> Iterator[ast.EdgePattern]:
    if isinstance(item, ast.Not):
        return
    if isinstance(item, ast.EdgePattern):
        yield item
    elif isinstance(item, tuple):
        for part in item:
            yield from _edges(part)
    elif is_dataclass(item):
        for field in fields(item):
            yield from _edges(getattr(item, field.name))


def _with(item: Any, old: ast.EdgePattern, new: ast.EdgePattern) -> Any:
    if item is old:
        return new
    if isinstance(item, tuple):
        return tuple(_with(part, old, new) for part in item)
    if isinstance(item, ast.Syntax):
        changed = {field.name: _with(getattr(item, field.name), old, new) for field in fields(item)}
        return replace(item, **changed)
    return item
