"""Shortlist: which rows a re-ranker reads. What is not among them, it cannot find.

A language model writes statements that hide the answer: a condition too many, LIMIT 1, the wrong noun. So a part of the
shortlist is what the question finds when it is read in other ways, and a LIMIT cuts only what the re-ranker leaves.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Any

from cgdb.asking.answer import first_node
from cgdb.result import Row

OTHERS = 0.4
"""The share of a shortlist that is kept for what other readings of the question find."""


def shortlist(rows: Sequence[Row], others: Iterable[Row], most: int) -> list[Row]:
    """At most ``most`` rows: the best of a statement, then those of other readings that are not among them.

    others: the best first; each gets the width of the statement's rows.
    """
    mine = list(rows[:most])
    known = {identity(row) for row in mine[: most - round(most * OTHERS)]}
    new: list[Row] = []
    for row in others:
        if len(new) == most:
            break
        if identity(row) not in known:
            known.add(identity(row))
            new.append(row)
    kept = max(most - len(new), most - round(most * OTHERS))
    # A row of the statement that another reading finds too is shown once, in its own place.
    first = mine[:kept]
    there = {identity(row) for row in first}
    width = len(rows[0]) if rows else 1
    return [*first, *(_widened(row, width) for row in new if identity(row) not in there)][:most]


def identity(row: Row) -> Any:
    """What tells the objects of rows apart; None for a row without one."""
    node = first_node(row)
    return None if node is None else (node.scene, node.id)


def _widened(row: Row, width: int) -> Row:
    if len(row) == width:
        return row
    return Row((first_node(row), *[None] * (width - 1)), row.score, row.fits, lambda: row.why)
