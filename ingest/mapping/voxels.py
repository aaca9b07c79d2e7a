"""One sparse voxel grid for a whole map: where voxels are found in constant time, and who saw what in each.

A tree of three levels over integer cells, as in VDB (Museth 2013): a dictionary of regions of 64 cells a side, a table
of blocks of 4 in each, a table of cells in each block. A frame touches a handful of regions, so everything below the
dictionary is array indexing: finding a point's voxel costs the same however large the map is.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from cgdb.errors import SceneError

Ints = NDArray[np.int32]
Floats = NDArray[np.float32]

REGION = 6
"""A region has 2**6 cells a side: 1.6 m at 2.5 cm."""
BLOCK = 2
"""A block has 2**2 cells a side."""
REACH = 1 << 20
"""Cells lie within this many of the origin, each way: 26 km at 2.5 cm."""
SLOTS = 4
"""Objects that one voxel remembers. Where a fifth wants in, the weakest claim gives way."""
_BLOCKS = 1 << (3 * (REGION - BLOCK))
_CELLS = 1 << (3 * BLOCK)
_DENSE = 1 << 16

FACES: Ints = np.array([[0, 0, 0], [1, 0, 0], [-1, 0, 0], [0, 1, 0], [0, -1, 0], [0, 0, 1], [0, 0, -1]], dtype=np.int32)
"""(7, 3): a cell and those that share a face with it."""


class Voxels:
    """Voxels on a grid that is fixed in the map's frame, one row each in growing arrays.

    cells (n, 3) int32; points (n, 3) float32 m and colors (n, 3) float32 RGB are sums of weight (n,) samples, points
    relative to the voxel's corner. owners (n, SLOTS) int32 are object numbers, -1 where free, and votes (n, SLOTS)
    float32 how often each was seen there; seen (n,) float32 is how often anything was.
    """

    def __init__(self, size: float) -> None:
        self.size = size
        self._regions: dict[tuple[int, int, int], int] = {}
        # Number 0 of each level is the empty one: a search that finds nothing ends there, without a test on the way.
        self._blocks: Ints = np.zeros((1, _BLOCKS), np.int32)
        self._leaves: Ints = np.full((1, _CELLS), -1, np.int32)
        self._n_leaves = 1
        self.count = 0
        self.free: Ints = np.zeros(0, np.int32)
        self._make_rows(1 << 12)

    def _make_rows(self, room: int) -> None:
        for name, (shape, dtype, empty) in _LAYOUT.items():
            made: NDArray[Any] = np.full((room, *shape), empty, dtype)
            if self.count:
                made[: self.count] = getattr(self, name)[: self.count]
            setattr(self, name, made)

    cells: Ints
    points: Floats
    colors: Floats
    weight: Floats
    seen: Floats
    owners: Ints
    votes: Floats
    last: Ints
    """(n,): the frame that saw the voxel last."""

    def cells_of(self, points: Floats) -> Ints:
        """(n, 3) int32 the cells that points (n, 3) in metres lie in."""
        cells = np.empty(points.shape, np.int32, order="F")
        for axis in range(3):
            scaled = np.floor(points[:, axis] * np.float32(1.0 / self.size))
            if len(scaled) and not (scaled.min() > -REACH and scaled.max() < REACH):
                raise SceneError(f"a point lies farther than {REACH * self.size / 1000:.0f} km from the map's origin")
            cells[:, axis] = scaled
        return cells

    def find(self, cells: Ints) -> Ints:
        """(n,) int32 the rows of cells (n, 3); -1 where there is no voxel."""
        region, block, cell = self._address(cells, create=False)
        return self._leaves[self._blocks[region, block], cell]

    def make(self, cells: Ints) -> Ints:
        """(n,) int32 the rows of cells (n, 3), made where there were none; several cells may be the same."""
        region, block, cell = self._address(cells, create=True)
        leaf = self._leaf_of(region, block)
        row = self._leaves[leaf, cell]
        lost = np.flatnonzero(row < 0)
        if len(lost):
            flat = leaf[lost].astype(np.int64) * _CELLS + cell[lost]
            new, example = np.unique(flat, return_index=True)
            # In the order of the input: rows then do not depend on how blocks came to be numbered.
            rows = np.empty(len(new), np.int32)
            rows[np.argsort(example)] = self._new_rows(len(new))
            self.cells[rows] = cells[lost[example]]
            self._leaves.reshape(-1)[new] = rows
            row[lost] = self._leaves.reshape(-1)[flat]
        return row

    def forget(self, rows: NDArray[np.integer]) -> None:
        """Let these voxels be as if they had never been seen; their rows are given to others later."""
        region, block, cell = self._address(self.cells[rows], create=False)
        self._leaves[self._blocks[region, block], cell] = -1
        for name, (_, _, empty) in _LAYOUT.items():
            getattr(self, name)[rows] = empty
        self.free = np.concatenate([self.free, rows.astype(np.int32)])

    def fill(self, columns: Mapping[str, NDArray[Any]], free: NDArray[np.integer]) -> None:
        """Hold exactly these voxels: for each of COLUMNS its values, row by row. free: rows that hold none."""
        n = len(columns["cells"])
        self.__init__(self.size)  # type: ignore[misc]
        self._make_rows(max(1 << 12, n + n // 4))
        self.count = n
        for name in COLUMNS:
            getattr(self, name)[:n] = columns[name]
        live = np.ones(n, np.bool_)
        live[free] = False
        rows = np.flatnonzero(live).astype(np.int32)
        region, block, cell = self._address(self.cells[rows], create=True)
        leaf = self._leaf_of(region, block)
        self._leaves[leaf, cell] = rows
        self.free = np.asarray(free, np.int32)

    def _new_rows(self, n: int) -> Ints:
        """Rows for n voxels: free ones first, then new ones."""
        again, self.free = self.free[:n], self.free[n:]
        fresh = n - len(again)
        if self.count + fresh > len(self.seen):
            self._make_rows(max(len(self.seen) + len(self.seen) // 3, self.count + fresh))
        self.count += fresh
        return np.concatenate([again, np.arange(self.count - fresh, self.count, dtype=np.int32)])

    def _leaf_of(self, region: Ints, block: Ints) -> Ints:
        """The leaf of each block of a region, made where there was none."""
        leaf: Ints = self._blocks[region, block]
        lost = np.flatnonzero(leaf == 0)
        if len(lost):
            flat = region[lost].astype(np.int64) * _BLOCKS + block[lost]
            new = np.unique(flat)
            self._blocks.reshape(-1)[new] = self._new_leaves(len(new))
            leaf[lost] = self._blocks.reshape(-1)[flat]
        return leaf

    def _address(self, cells: Ints, *, create: bool) -> tuple[Ints, Ints, Ints]:
        """The region, the block in it, and the cell in that."""
        # Column by column: numpy is many times faster along an axis that lies together in memory.
        axes = [np.ascontiguousarray(cells[:, axis]) for axis in range(3)]
        slots = self._region_slots([axis >> REGION for axis in axes], create=create)
        x, y, z = axes
        bits, mask = REGION - BLOCK, (1 << (REGION - BLOCK)) - 1
        block = (((((x >> BLOCK) & mask) << bits) | ((y >> BLOCK) & mask)) << bits) | ((z >> BLOCK) & mask)
        mask = (1 << BLOCK) - 1
        cell = ((((x & mask) << BLOCK) | (y & mask)) << BLOCK) | (z & mask)
        return slots, block, cell

    def _region_slots(self, axes: list[Ints], *, create: bool) -> Ints:
        if not len(axes[0]):
            return np.zeros(0, np.int32)
        low = [int(axis.min()) for axis in axes]
        span = [int(axis.max()) - least + 1 for axis, least in zip(axes, low, strict=True)]
        x, y, z = (axis - np.int32(least) for axis, least in zip(axes, low, strict=True))
        n = span[0] * span[1] * span[2]
        if n <= _DENSE:
            code = (x * np.int32(span[1]) + y) * np.int32(span[2]) + z
            flags = np.zeros(n, np.bool_)
            flags[code] = True
            present = np.flatnonzero(flags)
            table = np.zeros(n, np.int32)
        else:
            wide = (x.astype(np.int64) * span[1] + y) * span[2] + z
            present, code = np.unique(wide, return_inverse=True)
            table = np.zeros(len(present), np.int32)
        corners = np.unravel_index(present, span)
        places = zip(*(((axis + least).tolist()) for axis, least in zip(corners, low, strict=True)), strict=True)
        found = [self._slot(place, create) for place in places]
        table[present if n <= _DENSE else slice(None)] = found
        slots: Ints = table[code]
        return slots

    def _slot(self, corner: tuple[int, int, int], create: bool) -> int:
        slot = self._regions.get(corner, 0)
        if slot == 0 and create:
            slot = self._regions[corner] = len(self._regions) + 1
            if slot >= len(self._blocks):
                self._blocks = np.concatenate([self._blocks, np.zeros((max(16, slot // 2), _BLOCKS), np.int32)])
        return slot

    def _new_leaves(self, n: int) -> Ints:
        first, self._n_leaves = self._n_leaves, self._n_leaves + n
        if self._n_leaves > len(self._leaves):
            room = max(1024, len(self._leaves) // 3, self._n_leaves - len(self._leaves))
            self._leaves = np.concatenate([self._leaves, np.full((room, _CELLS), -1, np.int32)])
        return np.arange(first, first + n, dtype=np.int32)

    # Evidence

    def add_samples(self, points: Floats, colors: NDArray[np.uint8]) -> tuple[Ints, Ints]:
        """Add points (n, 3) m and colors (n, 3) to the means of their voxels, made where there were none.

        (the distinct rows, ascending; the place of each point's row among them).
        """
        rows = self.make(self.cells_of(points))
        flags = np.zeros(self.count, np.bool_)
        flags[rows] = True
        distinct: Ints = np.flatnonzero(flags).astype(np.int32)
        place_of = np.empty(self.count, np.int32)
        place_of[distinct] = np.arange(len(distinct), dtype=np.int32)
        place, n = place_of[rows], len(distinct)
        hits = np.bincount(place, minlength=n)
        corner = self.cells[distinct] * self.size
        for axis in range(3):
            total = np.bincount(place, weights=points[:, axis], minlength=n) - hits * corner[:, axis]
            self.points[distinct, axis] += total.astype(np.float32)
            self.colors[distinct, axis] += np.bincount(place, weights=colors[:, axis], minlength=n).astype(np.float32)
        self.weight[distinct] += hits.astype(np.float32)
        return distinct, place

    def vote(self, rows: Ints, objects: Ints, strength: Floats) -> None:
        """Say that objects (n,) were seen at rows (n,), with strength (n,). A pair may occur once; rows ascend."""
        if not len(rows):
            return
        start = np.flatnonzero(np.r_[True, rows[1:] != rows[:-1]])
        self.seen[rows[start]] += np.maximum.reduceat(strength, start)
        # Most voxels are seen as what they were seen as before.
        again = self.owners[rows, 0] == objects
        self.votes[rows[again], 0] += strength[again]
        other = ~again
        rank = np.arange(len(rows)) - np.repeat(start, np.diff(np.r_[start, len(rows)]))
        rows, objects, strength, rank = rows[other], objects[other], strength[other], rank[other]
        # The claims of one frame on one voxel are settled one after the other.
        for turn in np.unique(rank).tolist():
            now = rank == turn
            self._vote_once(rows[now], objects[now], strength[now])

    def _vote_once(self, rows: Ints, objects: Ints, strength: Floats) -> None:
        owners, votes = self.owners[rows], self.votes[rows]
        own = owners == objects[:, None]
        known = own.any(axis=1)
        slot = np.where(known, own.argmax(axis=1), votes.argmin(axis=1))
        each = np.arange(len(rows))
        held = votes[each, slot]
        stays = ~known & (held > strength)
        self.votes[rows, slot] = np.where(known, held + strength, np.where(stays, held - strength, strength))
        self.owners[rows, slot] = np.where(stays, owners[each, slot], objects)

    def hand_over(self, rows: Ints, giver: int, taker: int) -> None:
        """Let the claims of one object on these voxels be another's, which has none yet."""
        owners = self.owners[rows]
        owners[owners == giver] = taker
        self.owners[rows] = owners

    def rename(self, names: Ints) -> None:
        """Let object i be names[i] from now on, or nobody where that is -1; claims that meet are added up."""
        owners, votes = self.owners[: self.count], self.votes[: self.count]
        touched = np.flatnonzero(((owners >= 0) & (names[owners] != owners)).any(axis=1))
        part, weight = owners[touched], votes[touched]
        part = np.where(part >= 0, names[part], -1)
        for a in range(SLOTS):
            for b in range(a + 1, SLOTS):
                same = (part[:, a] == part[:, b]) & (part[:, a] >= 0)
                weight[same, a] += weight[same, b]
                part[same, b] = -1
        weight[part < 0] = 0
        # Two views of one thing in one frame were one sighting: a claim is never more than what was seen.
        weight = np.minimum(weight, self.seen[touched][:, None])
        self.owners[touched], self.votes[touched] = part, weight

    def solid(self, rows: NDArray[np.integer] | slice, share: float, strength: float) -> NDArray[np.bool_]:
        """(n, SLOTS) bool: which claims hold: at least so strong, and such a share of what was seen there."""
        floor = np.maximum(self.seen[rows] * np.float32(share), np.float32(strength))
        held: NDArray[np.bool_] = (self.owners[rows] >= 0) & (self.votes[rows] >= floor[:, None])
        return held

    def mean_points(self, rows: NDArray[np.integer]) -> Floats:
        """(n, 3) float32 m: the mean of what was measured in each voxel."""
        mean = self.points[rows] / np.maximum(self.weight[rows], 1e-6)[:, None]
        found: Floats = (self.cells[rows] * np.float32(self.size) + mean).astype(np.float32)
        return found

    def mean_colors(self, rows: NDArray[np.integer]) -> NDArray[np.uint8]:
        """(n, 3) uint8 RGB."""
        mean = self.colors[rows] / np.maximum(self.weight[rows], 1e-6)[:, None]
        found: NDArray[np.uint8] = np.clip(np.rint(mean), 0, 255).astype(np.uint8)
        return found


_LAYOUT: dict[str, tuple[tuple[int, ...], type, float]] = {
    "cells": ((3,), np.int32, 0),
    "points": ((3,), np.float32, 0),
    "colors": ((3,), np.float32, 0),
    "weight": ((), np.float32, 0),
    "seen": ((), np.float32, 0),
    "owners": ((SLOTS,), np.int32, -1),
    "votes": ((SLOTS,), np.float32, 0),
    "last": ((), np.int32, 0),
}
COLUMNS = tuple(_LAYOUT)
