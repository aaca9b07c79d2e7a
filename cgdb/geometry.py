"""Boxes as arrays: the metric functions of CGQL, vectorised over pairs of boxes.

A box is a center (3,), full side lengths (3,) along its own axes, and a rotation (3, 3) whose columns are these
axes in the scene frame. All lengths are metres. A box that the map does not give is NaN, and so is what follows
from it. A box without an extent is a point.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]

_TOUCH = 0.05
"""Metres by which a box may sink into the one below it and still be above it: the noise of mapped boxes."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Boxes:
    """n boxes: centers (n, 3), extents (n, 3) with NaN where unknown, rotations (n, 3, 3); up: axis 0-2 and sign.

    Hulls are worked out once for all boxes of a scene, and handed on to those that are taken from them.
    """

    centers: Floats
    extents: Floats
    rotations: Floats
    up_axis: int = 2
    up_sign: float = 1.0

    def __len__(self) -> int:
        return len(self.centers)

    def take(self, rows: NDArray[np.int64]) -> Boxes:
        """The boxes at these rows, in their order."""
        taken = Boxes(
            centers=self.centers[rows],
            extents=self.extents[rows],
            rotations=self.rotations[rows],
            up_axis=self.up_axis,
            up_sign=self.up_sign,
        )
        taken.__dict__.update(half_hulls=self.half_hulls[rows], aligned=self.aligned[rows])
        return taken

    @cached_property
    def half_hulls(self) -> Floats:
        """(n, 3) half side lengths of the smallest world-aligned boxes around them; 0 for points."""
        sides = np.nan_to_num(self.extents, nan=0.0)
        return 0.5 * _einsum("nij,nj->ni", np.abs(self.rotations), sides)

    @cached_property
    def aligned(self) -> NDArray[np.bool_]:
        """(n,) whether a box is its own world-aligned hull, up to a permutation of its axes."""
        return np.asarray(np.abs(self.rotations).max(axis=2).min(axis=1) > 1.0 - 1e-9)


def parse_up(up: str) -> tuple[int, float]:
    """Axis number and sign of an up axis: ``"-y"`` gives ``(1, -1.0)``."""
    return "xyz".index(up[-1]), -1.0 if up.startswith("-") else 1.0


def volumes(boxes: Boxes) -> Floats:
    """(n,) cubic metres; NaN without an extent."""
    return np.asarray(boxes.extents.prod(axis=1))


def heights(boxes: Boxes) -> Floats:
    """(n,) metres that the box spans along the up axis; NaN without an extent."""
    known = np.isfinite(boxes.extents).all(axis=1)
    return np.where(known, 2.0 * boxes.half_hulls[:, boxes.up_axis], np.nan)


def widths(boxes: Boxes) -> Floats:
    """(n,) metres of the longer side of its footprint; NaN without an extent."""
    return np.asarray(_footprint_sides(boxes).max(axis=1))


def depths(boxes: Boxes) -> Floats:
    """(n,) metres of the shorter side of its footprint; NaN without an extent."""
    return np.asarray(_footprint_sides(boxes).min(axis=1))


def _footprint_sides(boxes: Boxes) -> Floats:
    # The box's own axis that is most upright is its height; the other two span the footprint.
    upright = np.abs(boxes.rotations[:, boxes.up_axis, :]).argmax(axis=1)
    others = np.array([[1, 2], [0, 2], [0, 1]])[upright]
    return np.take_along_axis(boxes.extents, others, axis=1)


def center_distances(a: Boxes, b: Boxes) -> Floats:
    """(n,) metres between the centers of a[i] and b[i]."""
    return np.asarray(np.linalg.norm(a.centers - b.centers, axis=1))


def distances(a: Boxes, b: Boxes) -> Floats:
    """(n,) metres between the surfaces of boxes a[i] and b[i]; 0 where they touch or overlap."""
    gap = np.abs(a.centers - b.centers) - a.half_hulls - b.half_hulls
    result = np.sqrt((np.maximum(gap, 0.0) ** 2).sum(axis=1))
    turned = ~(a.aligned & b.aligned) & np.isfinite(result)
    if turned.any():
        rows = np.flatnonzero(turned)
        result[rows] = _turned_distances(a.take(rows), b.take(rows))
    return np.asarray(result)


def _turned_distances(a: Boxes, b: Boxes, steps: int = 200) -> Floats:
    """Distances of boxes in any orientation, by projecting to and fro between them (von Neumann 1933).

    Both sets are convex, so the pair of points converges to a nearest pair; steps bounds the work where two edges
    are almost parallel, and the loop ends early once nothing moves by a tenth of a millimetre.
    """
    point = _project(a.centers, b)
    previous = np.full(len(a), np.inf)
    for _ in range(steps):
        other = _project(point, a)
        point = _project(other, b)
        distance = np.linalg.norm(point - other, axis=1)
        if (previous - distance < 1e-5).all():
            break
        previous = distance
    return np.asarray(distance)


def _project(points: Floats, boxes: Boxes) -> Floats:
    """(n, 3) the point of boxes[i] that is nearest to points[i]."""
    half = 0.5 * np.nan_to_num(boxes.extents, nan=0.0)
    local = _einsum("nji,nj->ni", boxes.rotations, points - boxes.centers)
    return boxes.centers + _einsum("nij,nj->ni", boxes.rotations, np.clip(local, -half, half))


def inside(a: Boxes, b: Boxes) -> NDArray[np.bool_]:
    """(n,) whether a[i] is in b[i]: its center lies in b's box, and no more than half of it sticks out of b's hull."""
    half = 0.5 * b.extents
    local = _einsum("nji,nj->ni", b.rotations, a.centers - b.centers)
    with np.errstate(invalid="ignore"):
        center_in = (np.abs(local) <= half + 1e-9).all(axis=1)
        shared = np.minimum(a.centers + a.half_hulls, b.centers + b.half_hulls) - np.maximum(
            a.centers - a.half_hulls, b.centers - b.half_hulls
        )
        sides = 2.0 * a.half_hulls
        share = np.where(sides > 0, np.clip(shared, 0, None) / np.where(sides > 0, sides, 1.0), 1.0).prod(axis=1)
    return np.asarray(center_in & (share >= 0.5))


def above(a: Boxes, b: Boxes) -> NDArray[np.bool_]:
    """(n,) whether a[i] is over b[i]: higher, up to 5 cm of noise, with footprints that overlap."""
    up, sign = a.up_axis, a.up_sign
    bottom = sign * a.centers[:, up] - a.half_hulls[:, up]
    top = sign * b.centers[:, up] + b.half_hulls[:, up]
    reach = a.half_hulls + b.half_hulls
    flat = [axis for axis in range(3) if axis != up]
    with np.errstate(invalid="ignore"):
        over = (np.abs(a.centers - b.centers) <= reach)[:, flat].all(axis=1)
        return np.asarray(over & (bottom >= top - _TOUCH) & (sign * (a.centers - b.centers)[:, up] > 0))


def _einsum(subscripts: str, *arrays: Floats) -> Floats:
    return np.asarray(np.einsum(subscripts, *arrays))
