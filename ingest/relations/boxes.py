"""Boxes as upright prisms: their footprints, how far apart they are, how much they cover, which can be near at all.

A prism is a box's footprint (its shadow on the ground, exact for any rotation) between its lowest and its highest
point. Upright boxes are their own prism; a tilted one lies inside its prism. Every measure here is therefore the same
however the map is turned about its up axis, which an axis-aligned hull's would not be.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from cgdb.errors import SceneError
from cgdb.scene import UP_AXES

Floats: TypeAlias = NDArray[np.float64]
Ints: TypeAlias = NDArray[np.int64]
Bools: TypeAlias = NDArray[np.bool_]

THINNEST = 0.01
"""Metres. No side counts as thinner: a picture of zero thickness still covers something, and divisions are safe."""

_ON_EDGE = 1e-9
"""Metres by which one of two footprints shrinks, so that sides that lie on each other are counted once."""

_OVER = 0.05
"""Metres by which a box may reach out of the places of all objects before that says anything of its direction."""

_FEWEST = 10
"""Boxes that have their sides longest first by chance: one in six each, so one in 60 million maps of ten boxes."""

_CHUNK = 1 << 20
"""Pairs that are looked at in one go; bounds the memory whatever the map."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Boxes:
    """Oriented boxes, one per row, all in the scene's frame.

    centers: (n, 3) float64 m. extents: (n, 3) float64 m, full side lengths; a row of NaN is an object known only as
    a point. rotations: (n, 3, 3) float64, columns are a box's axes; None when every box lies along the axes.
    """

    centers: Floats
    extents: Floats
    rotations: Floats | None = None

    def __post_init__(self) -> None:
        n = len(self.centers)
        if self.centers.shape != (n, 3) or self.extents.shape != (n, 3):
            raise SceneError(
                f"centers have shape {self.centers.shape} and extents {self.extents.shape}, expected (n, 3) both"
            )
        if self.rotations is not None and self.rotations.shape != (n, 3, 3):
            raise SceneError(f"rotations have shape {self.rotations.shape}, expected ({n}, 3, 3)")
        unknown = np.isnan(self.extents)
        if not np.isfinite(self.centers).all() or np.isinf(self.extents).any():
            raise SceneError("boxes hold NaN or infinite coordinates")
        if (unknown.any(axis=1) != unknown.all(axis=1)).any() or (self.extents < 0).any():
            raise SceneError("an extent must be three lengths of at least 0, or three NaN for a point")
        if self.rotations is not None and not np.isfinite(self.rotations).all():
            raise SceneError("boxes hold NaN or infinite rotations")


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Prisms:
    """Upright prisms in a frame of their own: two ground axes and one up, metres.

    ground: (n, 2) centres of the footprints. low, high: (n,) lowest and highest point. sides: (n, k, 2), the footprint
    as the sum of k segments -s..s, by ascending angle in [0, pi); k is 2 where all boxes stand upright, else 3.
    corners: (n, 2 * k, 2) of the footprint relative to its centre, counter-clockwise, some of them equal. area: (n,)
    m2 of the footprint. reach: (n, 2) half sizes of its hull along the ground axes. slim: (n,) the shortest side by
    the longest. points: (n,) bool, the objects that have a place but no size.
    """

    ground: Floats
    low: Floats
    high: Floats
    corners: Floats
    sides: Floats
    area: Floats
    reach: Floats
    slim: Floats
    points: Bools

    @property
    def height(self) -> Floats:
        """(n,) heights in metres, none below THINNEST."""
        height: Floats = np.maximum(self.high - self.low, THINNEST)
        return height


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Pairs:
    """Pairs (first[k], second[k]) that may be near, each unordered pair once; compared is how many were looked at."""

    first: Ints
    second: Ints
    compared: int


def prisms(boxes: Boxes, up: str) -> Prisms:
    """The boxes as upright prisms of a scene whose up axis is ``up``; SceneError for an axis that there is not."""
    if up not in UP_AXES:
        raise SceneError(f"up axis {up!r} is none of {', '.join(UP_AXES)}")
    axis = "xyz".index(up[-1])
    flat = [k for k in range(3) if k != axis]
    sign = -1.0 if up.startswith("-") else 1.0
    n = len(boxes.centers)
    points = np.isnan(boxes.extents[:, 0])
    half = np.where(points[:, None], 0.0, boxes.extents) / 2.0
    axes = np.broadcast_to(np.eye(3), (n, 3, 3)) if boxes.rotations is None else boxes.rotations
    # axes[:, k, j] is coordinate k of the box's axis j.
    rise = (np.abs(axes[:, axis, :]) * half).sum(axis=1)
    middle = sign * boxes.centers[:, axis]
    padded = np.maximum(half, THINNEST / 2.0)
    sides = np.swapaxes(axes[:, flat, :] * padded[:, None, :], 1, 2)
    # An axis that stands upright but for rounding has no shadow; noise of 1e-17 would have a random direction.
    sides = np.where(np.abs(sides) < 1e-12, 0.0, sides)
    lengths = np.hypot(sides[..., 0], sides[..., 1])
    if (lengths.min(axis=1) == 0.0).all():
        # All boxes stand upright: four corners will do for each, at half the work.
        sides = np.take_along_axis(sides, np.argsort(-lengths, axis=1, kind="stable")[:, :2, None], axis=1)
    sides = _by_angle(sides)
    start = -sides.sum(axis=1, keepdims=True)
    right = start + 2.0 * np.cumsum(np.concatenate([np.zeros((n, 1, 2)), sides[:, :-1]], axis=1), axis=1)
    corners = np.concatenate([right, -right], axis=1)
    following = np.roll(corners, -1, axis=1)
    return Prisms(
        ground=boxes.centers[:, flat],
        low=middle - rise,
        high=middle + rise,
        corners=corners,
        sides=sides,
        area=np.maximum(_cross(corners, following).sum(axis=1) / 2.0, THINNEST**2),
        reach=np.abs(sides).sum(axis=1),
        slim=padded.min(axis=1) / padded.max(axis=1),
        points=points,
    )


def settle_sides(boxes: Boxes, up: str) -> Boxes:
    """Boxes whose sides were written longest first, without their directions, with each side along a likely axis.

    ConceptGraphs' planner file gives the sides of oriented boxes but not their rotations; read as they stand, its
    windows lie flat in the air. A map is as large as the places of its objects, walls and windows among them, so
    sides are dealt to axes such that a box reaches out of that least; the shortest stays upright where it is all the
    same. Boxes with rotations, or with sides in any other order, or fewer than _FEWEST of them, come back untouched.
    """
    sized = ~np.isnan(boxes.extents[:, 0])
    extents, centers = boxes.extents[sized], boxes.centers[sized]
    sorted_by_chance = len(extents) < _FEWEST or (extents.max(axis=1) == extents.min(axis=1)).all()
    if boxes.rotations is not None or sorted_by_chance or (np.diff(extents, axis=1) > 0).any():
        return boxes
    axis = "xyz".index(up[-1])
    flat = [k for k in range(3) if k != axis]
    least, most = boxes.centers.min(axis=0) - _OVER, boxes.centers.max(axis=0) + _OVER
    best, overshoot = np.empty_like(extents), np.full(len(extents), np.inf)
    for first, second, upright in ((0, 1, 2), (1, 0, 2), (0, 2, 1), (2, 0, 1), (1, 2, 0), (2, 1, 0)):
        dealt = np.empty_like(extents)
        dealt[:, [*flat, axis]] = extents[:, [first, second, upright]]
        over = np.maximum(centers + dealt / 2 - most, 0.0) + np.maximum(least - centers + dealt / 2, 0.0)
        better = over.sum(axis=1) < overshoot - _OVER
        best[better], overshoot[better] = dealt[better], over.sum(axis=1)[better]
    settled = boxes.extents.copy()
    settled[sized] = best
    return Boxes(centers=boxes.centers, extents=settled)


def ground_gap(shapes: Prisms, a: Ints, b: Ints) -> Floats:
    """(p,) metres between the footprints of a[k] and b[k], 0 where they touch or overlap."""
    sides = np.concatenate([shapes.sides[a], shapes.sides[b]], axis=1)
    # The two footprints are as far apart as b's centre is from the sum of both shapes laid around a's centre.
    return _distance_to_zonogon(_by_angle(sides), shapes.ground[b] - shapes.ground[a])


def center_gap(shapes: Prisms, a: Ints, b: Ints) -> Floats:
    """(p,) metres from the centre of a[k] to the footprint of b[k], 0 inside."""
    return _distance_to_zonogon(shapes.sides[b], shapes.ground[a] - shapes.ground[b])


def overlap_area(shapes: Prisms, a: Ints, b: Ints) -> Floats:
    """(p,) m2 that the footprints of a[k] and b[k] have in common."""
    ours = shapes.corners[a]
    theirs = shapes.corners[b] + (shapes.ground[b] - shapes.ground[a])[:, None, :]
    # Green's theorem: the border of the common part is our border within theirs and their border within ours.
    area = _border_within(ours, theirs, -_ON_EDGE) + _border_within(theirs, ours, _ON_EDGE)
    common: Floats = np.clip(area, 0.0, np.minimum(shapes.area[a], shapes.area[b]))
    return common


def near_pairs(shapes: Prisms, *, across: float, upright: float, crowd: int) -> Pairs:
    """All pairs whose hulls are at most ``across`` metres apart on the ground axes and ``upright`` in height.

    A hash join on grids, one per octave of size, so that a box as large as the scene fills four cells of a coarse
    grid, not thousands of a fine one. In a cell that holds more than ``crowd`` boxes of the grid's size, each box meets
    only the ``crowd`` ones next to it in height: without that, n boxes in one place are n * n / 2 pairs.
    """
    n = len(shapes.low)
    grown = shapes.reach + across / 2.0
    least, most = shapes.ground - grown, shapes.ground + grown
    width = np.maximum((most - least).max(axis=1, initial=0.0), 1e-3)
    octave = np.ceil(np.log2(width)).astype(np.int64)
    middle = (shapes.low + shapes.high) / 2.0
    firsts, seconds, compared = [np.empty(0, np.int64)], [np.empty(0, np.int64)], 0
    for level in np.unique(octave):
        members = np.flatnonzero(octave <= level)
        lowest = np.floor(least[members] / 2.0**level).astype(np.int64)
        highest = np.floor(most[members] / 2.0**level).astype(np.int64)
        entry, cell = _cells(lowest, highest)
        owner = members[entry]
        order = np.lexsort((owner, middle[owner], cell[:, 1], cell[:, 0]))
        entry, owner, cell = entry[order], owner[order], cell[order]
        for left, right in _windows(cell, octave[owner] == level, crowd):
            compared += len(left)
            # A pair that shares several cells is taken in the one where the later of both begins, and nowhere else.
            home = (np.maximum(lowest[entry[left]], lowest[entry[right]]) == cell[left]).all(axis=1)
            a, b = owner[left], owner[right]
            close = home & (a != b)
            close &= (least[a] <= most[b]).all(axis=1) & (least[b] <= most[a]).all(axis=1)
            close &= np.maximum(shapes.low[a] - shapes.high[b], shapes.low[b] - shapes.high[a]) <= upright
            firsts.append(np.minimum(a, b)[close])
            seconds.append(np.maximum(a, b)[close])
    # Within a crowded cell a pair may be met from both sides.
    keys = np.unique(np.concatenate(firsts) * max(n, 1) + np.concatenate(seconds))
    return Pairs(first=keys // max(n, 1), second=keys % max(n, 1), compared=compared)


def _cells(lowest: Ints, highest: Ints) -> tuple[Ints, Ints]:
    """Every (member, cell) with the cell between the member's lowest and highest: four each at most in near_pairs."""
    entries, cells = [], []
    span = (highest - lowest).max(axis=0, initial=0)
    for i in range(int(span[0]) + 1):
        for j in range(int(span[1]) + 1):
            cell = lowest + np.array([i, j])
            inside = np.flatnonzero((cell <= highest).all(axis=1))
            entries.append(inside)
            cells.append(cell[inside])
    return np.concatenate(entries), np.concatenate(cells)


def _windows(cell: Ints, big: Bools, crowd: int) -> Iterator[tuple[Ints, Ints]]:
    """Chunks of positions (left, right) within the same cell, right always a big one; cell sorted, (m, 2)."""
    m = len(cell)
    if not m:
        return
    starts = np.flatnonzero(np.concatenate([[True], (cell[1:] != cell[:-1]).any(axis=1)]))
    ends = np.append(starts[1:], m)
    big_at = np.flatnonzero(big)
    before = np.concatenate([[0], np.cumsum(big)])
    group = np.repeat(np.arange(len(starts)), ends - starts)
    first_big, end_big, rank = before[starts][group], before[ends][group], before[:-1]
    # A big one meets the big ones before it; a small one the big ones around it.
    begin = np.where(big, np.maximum(rank - crowd, first_big), np.maximum(rank - crowd // 2, first_big))
    begin = np.where(big, begin, np.maximum(np.minimum(begin, end_big - crowd), first_big))
    stop = np.where(big, rank, np.minimum(begin + crowd, end_big))
    count = np.maximum(stop - begin, 0)
    total = np.concatenate([[0], np.cumsum(count)])
    at = 0
    while at < m:
        until = max(at + 1, int(np.searchsorted(total, total[at] + _CHUNK, side="right")) - 1)
        sizes = count[at:until]
        left = np.repeat(np.arange(at, until), sizes)
        offset = np.arange(len(left)) - np.repeat(total[at:until] - total[at], sizes)
        yield left, big_at[np.repeat(begin[at:until], sizes) + offset]
        at = until


def _cross(u: Floats, v: Floats) -> Floats:
    product: Floats = u[..., 0] * v[..., 1] - u[..., 1] * v[..., 0]
    return product


def _products(u: Floats, v: Floats) -> Floats:
    """(p, i, j) scalar products of u (p, i, 2) and v (p, j, 2); much faster than a matmul of such small matrices."""
    products: Floats = u[:, :, None, 0] * v[:, None, :, 0] + u[:, :, None, 1] * v[:, None, :, 1]
    return products


def _by_angle(sides: Floats) -> Floats:
    """Segments -s..s, (n, k, 2), each turned to an angle in [0, pi) and then sorted by it."""
    turned = (sides[..., 1] < 0) | ((sides[..., 1] == 0) & (sides[..., 0] < 0))
    sides = np.where(turned[..., None], -sides, sides)
    order = np.argsort(np.arctan2(sides[..., 1], sides[..., 0]), axis=1, kind="stable")
    ordered: Floats = np.take_along_axis(sides, order[..., None], axis=1)
    return ordered


def _distance_to_zonogon(sides: Floats, offset: Floats) -> Floats:
    """(p,) metres from offset (p, 2) to the polygon that is the sum of the segments ``sides``, (p, k, 2) by angle."""
    edges = 2.0 * sides
    first = -sides.sum(axis=1, keepdims=True)
    begin = first + np.cumsum(edges, axis=1) - edges
    nearest = np.full(len(offset), np.inf)
    inside = np.ones(len(offset), dtype=bool)
    length = np.maximum((edges**2).sum(axis=2), 1e-30)
    # The polygon is its own mirror image: its other half seen from a point is this half seen from the mirrored point.
    for point in (offset, -offset):
        to_point = point[:, None, :] - begin
        along = np.clip((to_point * edges).sum(axis=2) / length, 0.0, 1.0)
        away = to_point - along[..., None] * edges
        nearest = np.minimum(nearest, (away**2).sum(axis=2).min(axis=1))
        inside &= (_cross(edges, to_point) >= 0).all(axis=1)
    distance: Floats = np.where(inside, 0.0, np.sqrt(nearest))
    return distance


def _border_within(ours: Floats, theirs: Floats, slack: float) -> Floats:
    """(p,) the part of Green's integral that runs along the polygon ``ours`` within ``theirs`` grown by slack (m)."""
    edge = np.roll(theirs, -1, axis=1) - theirs
    inward = np.stack([-edge[..., 1], edge[..., 0]], axis=-1)
    room = slack * np.sqrt((edge**2).sum(axis=-1))
    step = np.roll(ours, -1, axis=1) - ours
    # level[p, i, k]: how far corner i of ours lies inside of side k of theirs; slope: how that changes along edge i.
    level = _products(ours, inward) - (theirs * inward).sum(axis=-1)[:, None, :] + room[:, None, :]
    slope = _products(step, inward)
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        crossing = -level / slope
    enter = np.where(slope > 0, crossing, 0.0).max(axis=2)
    leave = np.where(slope < 0, crossing, 1.0).min(axis=2)
    outside = ((slope == 0) & (level < 0)).any(axis=2)
    enter, leave = np.clip(enter, 0.0, 1.0), np.clip(leave, 0.0, 1.0)
    kept = (leave > enter) & ~outside
    share = np.where(kept, leave - enter, 0.0)
    # The cross product of two points of one edge is that of its corner and direction, times the share between them.
    area: Floats = (_cross(ours, step) * share).sum(axis=1) / 2.0
    return area
