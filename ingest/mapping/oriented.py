"""Oriented boxes of what is mapped bit by bit, and how alike two are.

The outermost points in 26 directions are all that is kept of a cloud, so a box costs the same however much was seen.
"""

from __future__ import annotations

from itertools import product

import numpy as np
from numpy.typing import NDArray

from cgdb.ingest.relations.polyhedra import corners, hull_volume, intersection

Floats = NDArray[np.float64]

THINNEST = 0.02
"""Metres: thinner sides are grown to this, as in the reference; else flat things have nothing in common."""
DIRECTIONS: NDArray[np.int32] = np.array([d for d in product((-1, 0, 1), repeat=3) if any(d)], dtype=np.int32)
"""(26, 3): the faces, edges and corners of a cube."""


def extremes(cells: NDArray[np.int32], start: NDArray[np.intp]) -> NDArray[np.int32]:
    """(k, 26, 3) int32 the outermost of cells (m, 3) in each direction, of k runs that begin at start (k,)."""
    height = cells @ DIRECTIONS.T
    end = np.append(start[1:], len(cells))
    return np.array([cells[a + height[a:b].argmax(axis=0)] for a, b in zip(start.tolist(), end.tolist(), strict=True)])


def outermost(one: NDArray[np.int32] | None, two: NDArray[np.int32] | None) -> NDArray[np.int32] | None:
    """(26, 3) the extremes of two clouds together; None is of no cloud."""
    if one is None or two is None:
        return two if one is None else one
    further = (two * DIRECTIONS).sum(axis=1) > (one * DIRECTIONS).sum(axis=1)
    found: NDArray[np.int32] = np.where(further[:, None], two, one)
    return found


def boxes(points: NDArray[np.int32]) -> tuple[Floats, Floats, Floats]:
    """(center (n, 3), extent (n, 3), rotation (n, 3, 3)) round n sets of extreme cells (n, 26, 3), in cells.

    The smallest of those that are turned about one of the map's axes, whichever is up, in steps of 5 degrees.
    """
    cloud: Floats = points.astype(np.float64) + 0.5
    best = _along(cloud, np.broadcast_to(_TURNS[0], (len(cloud), 3, 3)))
    for turn in _TURNS[1:]:
        turned = _along(cloud, np.broadcast_to(turn, (len(cloud), 3, 3)))
        smaller = turned[1].prod(axis=1) < best[1].prod(axis=1) - 1e-9
        for kept, new in zip(best, turned, strict=True):
            kept[smaller] = new[smaller]
    return best


def _turns() -> Floats:
    """(52, 3, 3): none, and by 5 to 85 degrees about each axis."""
    made = [np.eye(3)]
    for axis, degrees in product(range(3), range(5, 90, 5)):
        one, two = (i for i in range(3) if i != axis)
        turn, angle = np.eye(3), np.radians(degrees)
        turn[[one, two], [one, two]] = np.cos(angle)
        turn[one, two], turn[two, one] = -np.sin(angle), np.sin(angle)
        made.append(turn)
    return np.array(made)


_TURNS = _turns()


def _along(cloud: Floats, axes: Floats) -> tuple[Floats, Floats, Floats]:
    local = np.einsum("npi,nij->npj", cloud, axes)
    # A cell reaches half a cell beyond its middle, along whatever axis about as far.
    low, high = local.min(axis=1) - 0.5, local.max(axis=1) + 0.5
    return np.einsum("nij,nj->ni", axes, (low + high) / 2), high - low, axes.copy()


def similarity(
    center: Floats, extent: Floats, rotation: Floats, other: tuple[Floats, Floats, Floats], *, generalised: bool
) -> Floats:
    """(m,) intersection over union of m pairs of boxes: center (m, 3), extent (m, 3) m, rotation (m, 3, 3) whose
    columns are the box's axes. generalised: less the share of the convex hull that is in neither."""
    one = (center, np.maximum(extent, THINNEST), rotation)
    two = (other[0], np.maximum(other[1], THINNEST), other[2])
    common = intersection(one, two)
    union = one[1].prod(axis=1) + two[1].prod(axis=1) - common
    found: Floats = common / union
    if generalised:
        hull = np.maximum(hull_volume(np.concatenate([corners(*one), corners(*two)], axis=1)), union)
        found = found - (hull - union) / hull
    return found
