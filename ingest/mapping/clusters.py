"""The connected pieces of sets of voxels, as DBSCAN would find them.

Voxels are taken together into coarse cells; cells with enough voxels about them are core, and cores that touch are one
cluster.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from cgdb.ingest.mapping.voxels import Ints

_HALF = [(x, y, z) for x in (-1, 0, 1) for y in (-1, 0, 1) for z in (-1, 0, 1) if (x, y, z) > (0, 0, 0)]
"""Half of the 26 neighbours: the other half is the same links seen from the other end."""
_DENSE = 1 << 22
"""Coarse cells up to which they are found in a table."""


def pieces(
    owner: Ints, cells: Ints, whole: NDArray[np.bool_], *, side: int, core: int, least: float = 1.0
) -> NDArray[np.bool_]:
    """(m,) bool: the voxels of each owner's clusters that have at least the share `least` of its largest one's.

    side: voxels along a side of a coarse cell; core: voxels that such a cell and its neighbours must hold to be core.
    whole (n,): owners whose clusters all stay. owner (m,) ascends; cells (m, 3) int32. Where nothing is dense enough to
    be a cluster, a far or thin thing is kept whole rather than lost.
    """
    if not len(owner):
        return np.zeros(0, np.bool_)
    space = _Space.of(owner, cells, side)
    groups, group, count = space.groups, space.group, space.count
    a, b = space.touching()
    n = len(groups)
    about = count + np.bincount(a, weights=count[b], minlength=n) + np.bincount(b, weights=count[a], minlength=n)
    dense = about >= core
    joined = dense[a] & dense[b]
    piece = components(n, a[joined], b[joined])
    reached = dense.copy()
    for one, other in ((a, b), (b, a)):
        # A cell at the border goes to a core cell that it touches; which one, where there are several, is no matter.
        border = ~dense[one] & dense[other]
        piece[one[border]] = piece[other[border]]
        reached[one[border]] = True
    size = np.bincount(piece, weights=np.where(reached, count, 0), minlength=n)
    of = space.owner
    largest = np.zeros(len(whole))
    np.maximum.at(largest, of, size)
    wanted = np.where(whole, 0.0, least * largest)
    good = reached & (size[piece] >= wanted[of])
    if least >= 1.0:
        good &= _first_of_equals(of, piece, size, largest, whole)
    lost = np.bincount(of, weights=good, minlength=len(whole)) == 0
    kept: NDArray[np.bool_] = (good | lost[of]).take(group)
    return kept


def _first_of_equals(
    of: NDArray[np.int64],
    piece: NDArray[np.intp],
    size: NDArray[Any],
    largest: NDArray[Any],
    whole: NDArray[np.bool_],
) -> NDArray[np.bool_]:
    """Of several largest clusters of an owner, the first."""
    first = np.full(len(whole), len(piece), np.intp)
    top = size[piece] == largest[of]
    np.minimum.at(first, of[top], piece[top])
    chosen: NDArray[np.bool_] = (piece == first[of]) | whole[of]
    return chosen


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class _Space:
    """The coarse cells of several owners, each in a box of its own, numbered through.

    groups (g,): the cells that hold something, ascending; group (m,): which of them each voxel is in; count (g,):
    voxels in each; owner (g,): whose. along, across (g,): steps from a cell to the next in x and in y; in z it is 1.
    found: which cells hold something, and the number of each of these among groups; None in a space too large for it.
    """

    groups: NDArray[np.int64]
    group: NDArray[np.intp]
    count: NDArray[np.intp]
    owner: NDArray[np.intp]
    along: NDArray[np.int64]
    across: NDArray[np.int64]
    found: tuple[NDArray[np.bool_], Ints] | None

    @classmethod
    def of(cls, owner: Ints, cells: Ints, side: int) -> _Space:
        """Of voxels in cells (m, 3), m > 0, of owners (m,) that ascend; a coarse cell has so many a side."""
        start = np.flatnonzero(np.r_[True, owner[1:] != owner[:-1]])
        lengths = np.diff(np.r_[start, len(owner)])
        axes = [np.ascontiguousarray(cells[:, axis]) // np.int32(side) for axis in range(3)]
        # A border of one, so that a step beyond the box does not end on its other side.
        low = [np.minimum.reduceat(axis, start).astype(np.int64) - 1 for axis in axes]
        span = [np.maximum.reduceat(axis, start) + 2 - least for axis, least in zip(axes, low, strict=True)]
        size = span[0] * span[1] * span[2]
        base = np.cumsum(size) - size
        offset = base - ((low[0] * span[1] + low[1]) * span[2] + low[2])
        across, along = span[2], span[1] * span[2]
        x, y, z = axes
        key = np.repeat(offset, lengths) + x * np.repeat(along, lengths) + y * np.repeat(across, lengths) + z
        found = None
        total = int(size.sum())
        if total <= _DENSE:
            there, number = np.zeros(total, np.bool_), np.empty(total, np.int32)
            there[key] = True
            groups = np.flatnonzero(there)
            number[groups] = np.arange(len(groups), dtype=np.int32)
            found, group = (there, number), number.take(key).astype(np.intp)
        else:
            groups, group = np.unique(key, return_inverse=True)
        of = np.repeat(np.arange(len(start)), np.diff(np.searchsorted(groups, np.r_[base, total])))
        return cls(
            groups=groups,
            group=group,
            count=np.bincount(group, minlength=len(groups)),
            owner=owner[start].astype(np.intp)[of],
            along=along[of],
            across=across[of],
            found=found,
        )

    def touching(self) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
        """The pairs of cells that share a side, an edge or a corner, each once."""
        found_a, found_b = [], []
        for x, y, z in _HALF:
            target = self.groups + (x * self.along + y * self.across + z)
            if self.found is not None:
                there, number = self.found
                linked = np.flatnonzero(there.take(target))
                place = number.take(target.take(linked)).astype(np.intp)
            else:
                place = np.searchsorted(self.groups, target)
                place[place == len(self.groups)] = 0
                linked = np.flatnonzero(self.groups[place] == target)
                place = place[linked]
            found_a.append(linked)
            found_b.append(place)
        return np.concatenate(found_a), np.concatenate(found_b)


def components(n: int, a: NDArray[np.intp], b: NDArray[np.intp]) -> NDArray[np.intp]:
    """(n,) the smallest node of each node's connected component, of the graph with edges a[i] - b[i]."""
    label = np.arange(n)
    while len(a):
        low = np.minimum(label[a], label[b])
        np.minimum.at(label, label[a], low)
        np.minimum.at(label, label[b], low)
        while True:
            further = label[label]
            if (further == label).all():
                break
            label = further
        apart = label[a] != label[b]
        a, b = a[apart], b[apart]
    return label
