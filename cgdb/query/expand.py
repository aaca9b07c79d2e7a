"""The matches of a component that begin at known nodes: over their relations, in microseconds.

The graph index is asked where a match begins anywhere; where some of its nodes are known already (the best of a ``~``,
what a filter left, an id, the rows of a pattern used as a condition), following their relations here is faster.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator

import numpy as np
from numpy.typing import NDArray

from cgdb.index.neighbours import Relations, Rows
from cgdb.index.positions import Positions
from cgdb.query.bindings import Bindings, always
from cgdb.query.bound import BoundEdge, BoundNode
from cgdb.query.cypher import Component
from cgdb.query.limits import Budget


def expand(
    component: Component,
    start: str,
    allowed: Callable[[BoundNode], Positions | None],
    relations: Relations,
    budget: Budget,
) -> Bindings:
    """The matches of a component's nodes and edges, begun at the node ``start``; its conditions are not looked at.

    allowed: the positions that a node may have, None for any.
    """
    of = {node.name: allowed(node) for node in component.nodes}
    begin = of[start]
    nodes: dict[str, Positions] = {start: np.arange(len(relations.first_out) - 1) if begin is None else begin}
    taken: dict[str, Rows] = {}
    for edge in _in_reach(component, start):
        here, there = (edge.source, edge.target) if edge.source in nodes else (edge.target, edge.source)
        which, rows, ends = _step(edge, nodes[here], here == edge.source, relations)
        fits = np.ones(len(rows), bool)
        if edge.labels:
            fits &= np.isin(relations.label[rows], relations.codes(edge.labels))
        if there in nodes:
            fits &= nodes[there][which] == ends
        elif (only := of[there]) is not None:
            known = np.zeros(len(relations.first_out), bool)
            known[only] = True
            fits &= known[ends]
        for others in taken.values():
            # As in Cypher, two edges of one pattern are two relations.
            fits &= others[which] != rows
        which, rows, ends = which[fits], rows[fits], ends[fits]
        budget.check_rows(len(which))
        nodes = {there: ends} | {name: positions[which] for name, positions in nodes.items()}
        taken = {name: others[which] for name, others in taken.items()} | {edge.name: rows}
    n = len(nodes[start])
    return Bindings(
        n=n,
        nodes={node.name: nodes[node.name] for node in component.nodes},
        edges={edge.name: relations.column(taken[edge.name]) for edge in component.edges},
        truth=always(n),
    )


def _step(
    edge: BoundEdge, nodes: Positions, along: bool, relations: Relations
) -> tuple[NDArray[np.int64], Rows, Positions]:
    """From nodes over an edge, along it or against it: which node, the relation, and its other end."""
    ways = (along,) if edge.directed else (True, False)
    parts = [relations.touching(nodes, outgoing=outgoing) for outgoing in ways]
    ends = [
        (relations.target if outgoing else relations.source)[rows]
        for outgoing, (_, rows) in zip(ways, parts, strict=True)
    ]
    which, found = (np.concatenate(part) for part in zip(*parts, strict=True))
    return which, found, np.concatenate(ends)


def _in_reach(component: Component, start: str) -> Iterator[BoundEdge]:
    """The edges of a component, each touching what the ones before it have reached."""
    reached, left = {start}, list(component.edges)
    while left:
        edge = next(edge for edge in left if edge.source in reached or edge.target in reached)
        left.remove(edge)
        reached |= {edge.source, edge.target}
        yield edge
