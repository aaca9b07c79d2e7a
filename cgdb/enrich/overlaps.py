"""Which pairs of objects are asked about: a spanning forest of the strongest overlaps (ConceptGraphs, Section II-D).

The paper weighs every pair by the overlap of its boxes and prunes the graph to a spanning tree; its code keeps the
weakest overlaps of each cycle by mistake, here the strongest stay.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from cgdb.scene import SceneObject

REACH = 0.025
"""Metres by which each box is made larger on every side: a cup on a table touches it, and has no volume in common."""
ROWS = 256
"""Rows of the overlap matrix that are worked out at a time."""


@dataclass(frozen=True, slots=True)
class Pair:
    """Two objects, by position in the list that was given, and the IoU of their boxes."""

    a: int
    b: int
    weight: float


def overlapping(objects: Sequence[SceneObject], *, reach: float = REACH) -> list[Pair]:
    """All pairs a < b whose world-aligned hulls overlap once made larger by reach, with the IoU of these."""
    boxed = [i for i, obj in enumerate(objects) if obj.center is not None and obj.extent is not None]
    if not boxed:
        return []
    low, high = _hulls([objects[i] for i in boxed], reach)
    volume = (high - low).prod(axis=1)
    pairs = []
    for start in range(0, len(boxed), ROWS):
        stop = min(start + ROWS, len(boxed))
        sides = np.minimum(high[start:stop, None], high[None]) - np.maximum(low[start:stop, None], low[None])
        shared = np.clip(sides, 0.0, None).prod(axis=2)
        for row, column in np.argwhere(shared > 0).tolist():
            one = start + row
            if one < column:
                both = float(shared[row, column])
                weight = both / float(volume[one] + volume[column] - both)
                pairs.append(Pair(boxed[one], boxed[column], weight))
    return pairs


def spanning_forest(pairs: Sequence[Pair]) -> list[Pair]:
    """The pairs of a maximum spanning forest: of each cycle the weakest overlap goes. In the order of the positions."""
    import networkx as nx

    graph: nx.Graph[int] = nx.Graph()
    graph.add_weighted_edges_from((pair.a, pair.b, pair.weight) for pair in sorted(pairs, key=lambda p: (p.a, p.b)))
    kept = {(min(a, b), max(a, b)) for a, b in nx.maximum_spanning_edges(graph, data=False)}
    return sorted((pair for pair in pairs if (pair.a, pair.b) in kept), key=lambda p: (p.a, p.b))


def _hulls(objects: Sequence[SceneObject], reach: float) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """(n, 3) lowest and highest corners of world-aligned hulls, reach larger on every side. Metres."""
    centers = np.array([obj.center for obj in objects], np.float64)
    sides = [
        obj.extent if obj.rotation is None or obj.extent is None else np.abs(obj.rotation) @ obj.extent
        for obj in objects
    ]
    halves = 0.5 * np.array(sides, np.float64)
    return centers - halves - reach, centers + halves + reach
