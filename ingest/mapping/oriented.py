"""Oriented boxes: of what is mapped bit by bit, and the exact volumes that two have in common and that hold both.

The outermost points in 26 directions are all that is kept of a cloud, so a box costs the same however much was seen.
The common part of two boxes and the hull round both are convex polyhedra of which a superset of the vertices and of the
face planes is known; the volume of such a one is a sum of pyramids over its faces.
"""

from __future__ import annotations

from itertools import combinations, product

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]

THINNEST = 0.02
"""Metres: thinner sides are grown to this, as in the reference; else flat things have nothing in common."""
_EPS = 1e-7
DIRECTIONS: NDArray[np.int32] = np.array([d for d in product((-1, 0, 1), repeat=3) if any(d)], dtype=np.int32)
"""(26, 3): the faces, edges and corners of a cube."""
_CORNERS = np.array(list(product((-0.5, 0.5), repeat=3)))
_EDGES = np.array([(a, b) for a, b in combinations(range(8), 2) if (_CORNERS[a] != _CORNERS[b]).sum() == 1])
_TRIPLES = np.array(list(combinations(range(16), 3)))


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


def corners(center: Floats, extent: Floats, rotation: Floats) -> Floats:
    """(m, 8, 3) of boxes."""
    local = _CORNERS[None] * extent[:, None, :]
    found: Floats = np.einsum("mij,mkj->mki", rotation, local) + center[:, None, :]
    return found


def intersection(one: tuple[Floats, Floats, Floats], two: tuple[Floats, Floats, Floats]) -> Floats:
    """(m,) the volume that pairs of boxes have in common."""
    # About the first box's centre, in units of its size: one tolerance then fits all.
    scale = one[1].max(axis=1)
    two = ((two[0] - one[0]) / scale[:, None], two[1] / scale[:, None], two[2])
    one = (np.zeros_like(one[0]), one[1] / scale[:, None], one[2])
    planes = np.concatenate([_planes(*one), _planes(*two)], axis=1)
    points = np.concatenate([corners(*one), corners(*two), _crossings(one, two), _crossings(two, one)], axis=1)
    outside = np.einsum("mqi,mpi->mqp", planes[:, :, :3], points) > planes[:, :, 3:] + _EPS
    # A face that both share is one face.
    same = (np.abs(planes[:, :6, None] - planes[:, None, 6:]) < _EPS).all(axis=3).any(axis=1)
    wanted = np.concatenate([np.ones((len(planes), 6), np.bool_), ~same], axis=1)
    found: Floats = _volume(points, ~outside.any(axis=1), planes, wanted) * scale**3
    return found


def hull_volume(points: Floats) -> Floats:
    """(m,) the volume of the convex hull of 16 points each, (m, 16, 3)."""
    middle = points.mean(axis=1, keepdims=True)
    scale = np.abs(points - middle).max(axis=(1, 2))
    local = (points - middle) / scale[:, None, None]
    a, b, c = (local[:, _TRIPLES[:, end]] for end in range(3))
    normal = np.cross(b - a, c - a)
    length = np.linalg.norm(normal, axis=2)
    normal = normal / np.maximum(length, 1e-12)[:, :, None]
    offset = (normal * a).sum(axis=2)
    turned = np.where(offset < 0, -1.0, 1.0)  # the middle is inside
    planes = np.concatenate([normal * turned[:, :, None], (offset * turned)[:, :, None]], axis=2)
    above = np.einsum("mqi,mpi->mqp", planes[:, :, :3], local) - planes[:, :, 3:]
    faces = (length > 1e-6) & (above < 1e-6).all(axis=2)
    volumes = np.zeros(len(points))
    for row in range(len(points)):
        # Triples of one face give its plane again and again.
        own = planes[row, faces[row]]
        _, first = np.unique(np.round(own, 5), axis=0, return_index=True)
        own = own[first]
        kept = [i for i in range(len(own)) if not (np.abs(own[:i] - own[i]) < 1e-4).all(axis=1).any()]
        some = np.ones((1, len(kept)), np.bool_)
        volumes[row] = _volume(local[row : row + 1], np.ones((1, 16), np.bool_), own[None, kept], some)[0]
    found: Floats = volumes * scale**3
    return found


def _planes(center: Floats, extent: Floats, rotation: Floats) -> Floats:
    """(m, 6, 4): outward normals and offsets of the faces."""
    normals = np.concatenate([rotation.transpose(0, 2, 1), -rotation.transpose(0, 2, 1)], axis=1)
    half = np.concatenate([extent, extent], axis=1) / 2
    offsets = np.einsum("mqi,mi->mq", normals, center) + half
    return np.concatenate([normals, offsets[:, :, None]], axis=2)


def _crossings(box: tuple[Floats, Floats, Floats], other: tuple[Floats, Floats, Floats]) -> Floats:
    """(m, 72, 3): where the edges of one box meet the planes of another's faces; far away where they do not."""
    ends, planes = corners(*box), _planes(*other)
    start, end = ends[:, _EDGES[:, 0]], ends[:, _EDGES[:, 1]]
    before = np.einsum("mqi,mei->meq", planes[:, :, :3], start) - planes[:, None, :, 3]
    after = np.einsum("mqi,mei->meq", planes[:, :, :3], end) - planes[:, None, :, 3]
    meets = before * after < 0
    share = np.where(meets, before / np.where(meets, before - after, 1.0), 0.0)
    points = start[:, :, None] + share[..., None] * (end - start)[:, :, None]
    points[~meets] = 1e6
    return points.reshape(len(points), -1, 3)


def _volume(points: Floats, kept: NDArray[np.bool_], planes: Floats, wanted: NDArray[np.bool_]) -> Floats:
    """(m,) the volume round the kept ones of points (m, p, 3), whose faces are on the wanted planes (m, q, 4)."""
    count = kept.sum(axis=1)
    local = np.where(kept[:, :, None], points, 0.0)
    middle = local.sum(axis=1) / np.maximum(count, 1)[:, None]
    distance = np.einsum("mqi,mpi->mqp", planes[:, :, :3], local) - planes[:, :, 3:]
    on = (np.abs(distance) < 1e-6) & kept[:, None, :] & wanted[:, :, None]
    height = planes[:, :, 3] - np.einsum("mqi,mi->mq", planes[:, :, :3], middle)
    found: Floats = (np.maximum(height, 0.0) * _areas(local, on, planes[:, :, :3])).sum(axis=1) / 3
    return found


def _areas(points: Floats, on: NDArray[np.bool_], normals: Floats) -> Floats:
    """(m, q) the areas of the convex polygons of the points that are on each plane."""
    helper = np.where(np.abs(normals[..., :1]) < 0.9, np.array([1.0, 0.0, 0.0]), np.array([0.0, 1.0, 0.0]))
    across = np.cross(normals, helper)
    across /= np.linalg.norm(across, axis=2, keepdims=True)
    up = np.cross(normals, across)
    x, y = (np.einsum("mqi,mpi->mqp", axis, points) for axis in (across, up))
    n = on.sum(axis=2, keepdims=True)
    for values in (x, y):
        values -= np.where(on, values, 0.0).sum(axis=2, keepdims=True) / np.maximum(n, 1)
    order = np.where(on, np.arctan2(y, x), np.inf).argsort(axis=2, kind="stable")
    x, y, on = (np.take_along_axis(values, order, axis=2) for values in (x, y, on))
    # Those that are not on the plane come last; there, the polygon's first corner again closes it.
    x, y = np.where(on, x, x[..., :1]), np.where(on, y, y[..., :1])
    after_x, after_y = np.roll(x, -1, axis=2), np.roll(y, -1, axis=2)
    area: Floats = np.where(n[..., 0] >= 3, np.abs((x * after_y - after_x * y).sum(axis=2)) / 2, 0.0)
    return area
