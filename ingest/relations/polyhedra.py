"""The volume that two boxes have in common, and that of the hull round both: exact, however each is turned.

Both are convex polyhedra of which a superset of the vertices and of the face planes is known; the volume of such a one
is a sum of pyramids over its faces. A box is (center (m, 3), extent (m, 3) m, rotation (m, 3, 3) with its axes as
columns), for m pairs at once.
"""

from __future__ import annotations

from itertools import combinations, product
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

Floats: TypeAlias = NDArray[np.float64]

_EPS = 1e-7
"""Of the larger side of the first box: what is so near to a face lies on it."""
_CORNERS = np.array(list(product((-0.5, 0.5), repeat=3)))
_EDGES = np.array([(a, b) for a, b in combinations(range(8), 2) if (_CORNERS[a] != _CORNERS[b]).sum() == 1])
_TRIPLES = np.array(list(combinations(range(16), 3)))


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
