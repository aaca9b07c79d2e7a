"""The smallest upright box round a cloud: its sides stand on the ground, its corners turn about the vertical."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
WORTH = 0.93
"""A turned box must be smaller than the one along the map's axes by this factor, or noise would turn every box."""
_DIRECTIONS = np.array([(np.cos(turn), np.sin(turn)) for turn in np.linspace(0, 2 * np.pi, 16, endpoint=False)])
_ON_LINE = 1e-9
"""Square metres: the area that a point and two corners span, where it is on their line."""
THINNEST = 0.005
"""Metres: the least side of a box, about what a depth camera resolves."""


def upright_box(points: NDArray[np.float32], up: str) -> tuple[Floats, Floats, Floats | None]:
    """(center (3,), extent (3,), rotation (3, 3) or None when along the map's axes) of points (n, 3), n >= 1."""
    cloud = points.astype(np.float64)
    low, high = cloud.min(axis=0), cloud.max(axis=0)
    straight = (low + high) / 2, np.maximum(high - low, THINNEST)
    axis = "xyz".index(up[-1])
    ground = [i for i in range(3) if i != axis]
    corners = hull(cloud[:, ground])
    if len(corners) < 3:
        return (*straight, None)
    edges = np.diff(np.vstack([corners, corners[:1]]), axis=0)
    lengths = np.linalg.norm(edges, axis=1)
    along = edges[lengths > 1e-9] / lengths[lengths > 1e-9, None]
    across = np.stack([-along[:, 1], along[:, 0]], axis=1)
    u, v = corners @ along.T, corners @ across.T
    area = np.ptp(u, axis=0) * np.ptp(v, axis=0)
    best = int(area.argmin())
    if area[best] > WORTH * np.ptp(cloud[:, ground[0]]) * np.ptp(cloud[:, ground[1]]):
        return (*straight, None)
    rotation = np.zeros((3, 3))
    rotation[ground, 0], rotation[ground, 1], rotation[axis, 2] = along[best], across[best], 1.0
    if np.linalg.det(rotation) < 0:
        rotation[:, 1] = -rotation[:, 1]
    local = cloud @ rotation
    low, high = local.min(axis=0), local.max(axis=0)
    return rotation @ ((low + high) / 2), np.maximum(high - low, THINNEST), rotation


def hull(points: Floats) -> Floats:
    """The convex hull of points (n, 2), counter-clockwise (Andrew's monotone chain)."""
    points = _outer(points)
    # Of the points with one first coordinate only the outermost two matter; on a grid that is most of them.
    order = np.lexsort((points[:, 1], np.round(points[:, 0], 3)))
    ordered = points[order]
    strip = np.round(ordered[:, 0], 3)
    first = np.flatnonzero(np.r_[True, strip[1:] != strip[:-1]])
    last = np.r_[first[1:] - 1, len(ordered) - 1]
    extreme = np.unique(np.vstack([ordered[first], ordered[last]]), axis=0)
    if len(extreme) < 3:
        return extreme
    lower = _chain(extreme.tolist())
    upper = _chain(extreme[::-1].tolist())
    return np.array(lower[:-1] + upper[:-1])


def _outer(points: Floats) -> Floats:
    """Points (n, 2) without those that lie within the outermost ones in some directions (Akl and Toussaint 1978)."""
    far = np.array([(points @ direction).argmax() for direction in _DIRECTIONS])
    corners = points[far[np.r_[True, far[1:] != far[:-1]]]]
    inside = np.ones(len(points), np.bool_)
    for (ax, ay), (bx, by) in zip(corners.tolist(), np.roll(corners, -1, axis=0).tolist(), strict=True):
        if (ax, ay) != (bx, by):
            inside &= (bx - ax) * (points[:, 1] - ay) - (by - ay) * (points[:, 0] - ax) > _ON_LINE
    return points[~inside] if len(corners) > 2 else points


def _chain(points: list[list[float]]) -> list[list[float]]:
    chain: list[list[float]] = []
    for x, y in points:
        while len(chain) > 1:
            (ax, ay), (bx, by) = chain[-2], chain[-1]
            if (bx - ax) * (y - ay) - (by - ay) * (x - ax) > 0:
                break
            chain.pop()
        chain.append([x, y])
    return chain
