"""A statement that compares things with each other, narrowed to those that fit, where all pairs were too many."""

from __future__ import annotations

from collections.abc import Callable

from cgdb.asking.statements import also, among_these, best_of
from cgdb.grammar import ast
from cgdb.result import Result, StoredNode

Run = Callable[[ast.Query], Result]

MOST = 1000
"""Things of one kind that are compared."""
COMBINATIONS = 4_000_000
"""Of all kinds together: fewer than a query may look at."""


def narrowed(tree: ast.Query, run: Run) -> tuple[ast.Query, tuple[str, ...]] | None:
    """The statement with each thing that is told by its meaning among those that fit; lines of what was left out.

    None where there is nothing to narrow. Only rows that do not fit are lost.
    """
    told = sum(isinstance(node.meaning, ast.Text) for pattern in tree.patterns for node in pattern.nodes)
    most = min(MOST, int(COMBINATIONS ** (1 / max(told, 1))))
    among, notes = [], []
    for pattern in tree.patterns:
        for node in pattern.nodes:
            if node.variable is None or not isinstance(node.meaning, ast.Text):
                continue
            rows = run(best_of(node, most + 1)).rows
            fitting = [value for row in rows if row.fits and isinstance(value := row[0], StoredNode)]
            if len(fitting) > most:
                notes.append(f"more than {most:,} things fit '{node.meaning.value}'; the best {most:,} were compared")
            among.append(among_these(node.variable, fitting[:most]))
    if not among:
        return None
    return also(tree, *among), tuple(notes)
