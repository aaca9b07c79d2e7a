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
_ROOM = 1 << 22
"""Rows that there is room for at first: addresses only, memory is taken by those that are used."""
_NEARLY = 0.9
"""A column that is filled to this share is made larger when there is time."""


class Voxels:
    """Voxels on a grid that is fixed in the map's frame, one row each in growing arrays.

    cells (n, 3) int32; points (n, 3) float32 m and colors (n, 3) float32 RGB are sums of weight (n,) samples, points
    relative to the voxel's corner. owners (n, SLOTS) int32 are ids of objects, -1 where free, and votes (n, SLOTS)
    float32 how often each was seen there; seen (n,) float32 is how often anything was.
    """

    def __init__(self, size: float) -> None:
        self.size = size
        self._regions: dict[tuple[int, int, int], int] = {}
        # Number 0 of each level is the empty one: a search that finds nothing ends there, without a test on the way.
        self._blocks: Ints = np.zeros((1, _BLOCKS), np.int32)
        self._leaves: Ints = np.empty((_ROOM // 16, _CELLS), np.int32)
        self._leaves[0] = -1
        self._n_leaves = 1
        self.count = 0
        self.free: Ints = np.zeros(0, np.int32)
        self._make_rows(_ROOM)

    def _make_rows(self, room: int) -> None:
        for name, (shape, dtype) in _COLUMNS.items():
            setattr(self, name, np.empty((room, *shape), dtype))

    def _grow(self, name: str) -> None:
        """Twice the room for one column. What is not used yet takes no memory, only addresses."""
        column: NDArray[Any] = getattr(self, name)
        made = np.empty((2 * len(column), *column.shape[1:]), column.dtype)
        made[: self.count] = column[: self.count]
        setattr(self, name, made)

    def _grow_ahead(self) -> None:
        """Give one column more room when what it has left might not do for a frame: never all at once."""
        name = min(_COLUMNS, key=lambda name: len(getattr(self, name)))
        if self.count > _NEARLY * len(getattr(self, name)):
            self._grow(name)

    cells: Ints
    points: Floats
    colors: Floats
    weight: Floats
    seen: Floats
    owners: Ints
    votes: Floats
    _place: Ints
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
        block, cell = self._address(_columns(cells), create=False)
        return self._leaves.reshape(-1).take(self._blocks.reshape(-1).take(block) * _CELLS + cell)

    def around(self, rows: NDArray[np.integer]) -> Ints:
        """(7, n) int32 the rows of the voxels (n,) and of those that share a face with each; -1 where there is none."""
        axes = _columns(self.cells.take(rows, axis=0))
        leaves = self._leaves.reshape(-1)
        block, cell = self._address(axes, create=False)
        address = self._blocks.reshape(-1).take(block) * _CELLS + cell
        found = np.empty((7, len(rows)), np.int32)
        found[0] = rows
        last = (1 << BLOCK) - 1
        over, where = [], []
        for axis, values in enumerate(axes):
            within, stride = values & last, 1 << (BLOCK * (2 - axis))
            for face, step, end in ((1 + 2 * axis, 1, last), (2 + 2 * axis, -1, 0)):
                # Three in four have this neighbour in their own block, a step along the table.
                found[face] = leaves.take(address + step * stride, mode="clip")
                border = np.flatnonzero(within == end)
                beyond = [other.take(border) for other in axes]
                beyond[axis] += np.int32(step)
                over.append(beyond)
                where.append(border + face * len(rows))
        beyond = [np.concatenate([part[axis] for part in over]) for axis in range(3)]
        block, cell = self._address(beyond, create=False)
        found.reshape(-1)[np.concatenate(where)] = leaves.take(self._blocks.reshape(-1).take(block) * _CELLS + cell)
        return found

    def within(self, low: Ints, high: Ints) -> Ints:
        """Rows among which are all voxels with cells from low to high (3,), both included."""
        ends = [range(int(a) >> BLOCK, (int(b) >> BLOCK) + 1) for a, b in zip(low, high, strict=True)]
        if len(ends[0]) * len(ends[1]) * len(ends[2]) > 4 * self._n_leaves:
            return np.arange(self.count, dtype=np.int32)
        grid = np.meshgrid(*(np.array(end, np.int32) << BLOCK for end in ends), indexing="ij")
        block, _ = self._address([axis.reshape(-1) for axis in grid], create=False)
        leaf = self._blocks.reshape(-1).take(block)
        rows = self._leaves.take(leaf[leaf > 0], axis=0).reshape(-1)
        return rows[rows >= 0]

    def make(self, cells: Ints) -> Ints:
        """(n,) int32 the rows of cells (n, 3), made where there were none; several cells may be the same."""
        block, cell = self._address(_columns(cells), create=True)
        address = self._leaf_of(block) * _CELLS + cell
        leaves = self._leaves.reshape(-1)
        row = leaves.take(address)
        lost = np.flatnonzero(row < 0)
        if len(lost):
            address = address[lost]
            new = _firsts(leaves, address)
            # In the order of the input: rows then do not depend on how blocks came to be numbered.
            rows = self._new_rows(len(new))
            self.cells[rows] = cells.take(lost[new], axis=0)
            leaves[address[new]] = rows
            row[lost] = leaves.take(address)
        return row

    def forget(self, rows: NDArray[np.integer]) -> None:
        """Let these voxels be as if they had never been seen; their rows are given to others later."""
        block, cell = self._address(_columns(self.cells.take(rows, axis=0)), create=False)
        self._leaves.reshape(-1)[self._blocks.reshape(-1).take(block) * _CELLS + cell] = -1
        for name, (_, _, empty) in _LAYOUT.items():
            getattr(self, name)[rows] = empty
        self.free = np.concatenate([self.free, rows.astype(np.int32)])

    def fill(self, columns: Mapping[str, NDArray[Any]], free: NDArray[np.integer]) -> None:
        """Hold exactly these voxels: for each of COLUMNS its values, row by row. free: rows that hold none."""
        n = len(columns["cells"])
        self.__init__(self.size)  # type: ignore[misc]
        self._make_rows(max(_ROOM, n + n // 4))
        self.count = n
        for name in COLUMNS:
            getattr(self, name)[:n] = columns[name]
        live = np.ones(n, np.bool_)
        live[free] = False
        rows = np.flatnonzero(live).astype(np.int32)
        block, cell = self._address(_columns(self.cells.take(rows, axis=0)), create=True)
        leaf = self._leaf_of(block)
        self._leaves[leaf, cell] = rows
        self.free = np.asarray(free, np.int32)

    def _new_rows(self, n: int) -> Ints:
        """Rows for n voxels: free ones first, then new ones."""
        again, self.free = self.free[:n], self.free[n:]
        fresh = n - len(again)
        first, until = self.count, self.count + fresh
        for name in _COLUMNS:
            while until > len(getattr(self, name)):
                self._grow(name)
        self.count = until
        for name, (_, _, empty) in _LAYOUT.items():
            getattr(self, name)[first:until] = empty
        return np.concatenate([again, np.arange(first, until, dtype=np.int32)])

    def _leaf_of(self, block: Ints) -> Ints:
        """The leaf of each block, made where there was none."""
        blocks = self._blocks.reshape(-1)
        leaf: Ints = blocks.take(block)
        lost = np.flatnonzero(leaf == 0)
        if len(lost):
            block = block[lost]
            new = _firsts(blocks, block)
            blocks[block[new]] = self._new_leaves(len(new))
            leaf[lost] = blocks.take(block)
        return leaf

    def _address(self, axes: list[Ints], *, create: bool) -> tuple[Ints, Ints]:
        """The block, as its place in the table of all, and the cell in it, of cells as three columns."""
        x, y, z = axes
        slots = self._region_slots([axis >> REGION for axis in axes], create=create)
        bits, mask = REGION - BLOCK, (1 << (REGION - BLOCK)) - 1
        block = ((slots << bits | (x >> BLOCK) & mask) << bits | (y >> BLOCK) & mask) << bits | (z >> BLOCK) & mask
        mask = (1 << BLOCK) - 1
        cell = ((x & mask) << BLOCK | (y & mask)) << BLOCK | (z & mask)
        return block, cell

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
        slots: Ints = table.take(code)
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
            made = np.empty((2 * self._n_leaves, _CELLS), np.int32)
            made[:first] = self._leaves[:first]
            self._leaves = made
        self._leaves[first : self._n_leaves] = -1
        return np.arange(first, first + n, dtype=np.int32)

    # Evidence

    def add_samples(self, points: Floats, colors: NDArray[np.uint8]) -> tuple[Ints, Ints]:
        """Add points (n, 3) m and colors (n, 3) to the means of their voxels, made where there were none.

        (the distinct rows; the place of each point's row among them).
        """
        self._grow_ahead()
        rows = self.make(self.cells_of(points))
        distinct, place = self.numbered(rows)
        n = len(distinct)
        at = place.astype(np.intp)
        hits = np.bincount(at, minlength=n)
        corner = self.cells.take(distinct, axis=0) * self.size
        total, shade = np.empty((n, 3), np.float32), np.empty((n, 3), np.float32)
        for axis in range(3):
            total[:, axis] = np.bincount(at, weights=points[:, axis], minlength=n) - hits * corner[:, axis]
            shade[:, axis] = np.bincount(at, weights=colors[:, axis], minlength=n)
        # As one row of numbers: numpy is many times faster at that than at rows of three.
        numbers = (distinct.astype(np.intp)[:, None] * 3 + np.arange(3)).reshape(-1)
        self.points.reshape(-1)[numbers] += total.reshape(-1)
        self.colors.reshape(-1)[numbers] += shade.reshape(-1)
        self.weight[distinct] += hits.astype(np.float32)
        return distinct, place

    def numbered(self, rows: Ints) -> tuple[Ints, Ints]:
        """(each of rows (n,) once; the place of each of rows among these)."""
        # In a table by row, one of those that are the same leaves its number: nothing is sorted.
        table, each = self._place, np.arange(len(rows), dtype=np.int32)
        table[rows] = each
        distinct: Ints = rows[table.take(rows) == each]
        table[distinct] = each[: len(distinct)]
        return distinct, table.take(rows)

    def vote(self, rows: Ints, objects: Ints, strength: Floats) -> None:
        """Say that objects (n,) were seen at rows (n,), with strength (n,). A pair may occur once; rows ascend."""
        if not len(rows):
            return
        start = np.flatnonzero(np.r_[True, rows[1:] != rows[:-1]])
        self.seen[rows[start]] += np.maximum.reduceat(strength, start)
        # Most voxels are seen as what they were seen as before.
        at = rows.astype(np.intp) * SLOTS
        again = self.owners.reshape(-1).take(at) == objects
        self.votes.reshape(-1)[at[again]] += strength[again]
        other = np.flatnonzero(~again)
        rank = other - np.repeat(start, np.diff(np.r_[start, len(rows)])).take(other)
        # The claims of one frame on one voxel are settled one after the other.
        for turn in range(int(rank.max(initial=-1)) + 1):
            now = other[rank == turn]
            if len(now):
                self._vote_once(at.take(now), objects.take(now), strength.take(now))

    def _vote_once(self, at: NDArray[np.intp], objects: Ints, strength: Floats) -> None:
        """at (n,): the first slot of each voxel, among all slots."""
        all_owners, all_votes = self.owners.reshape(-1), self.votes.reshape(-1)
        votes = [all_votes.take(at + slot) for slot in range(SLOTS)]
        known = np.zeros(len(at), np.bool_)
        slot, held = np.zeros(len(at), np.intp), votes[0]
        for other in range(1, SLOTS):
            weaker = votes[other] < held
            slot[weaker] = other
            held = np.where(weaker, votes[other], held)
        for own in reversed(range(SLOTS)):
            same = all_owners.take(at + own) == objects
            known |= same
            slot[same] = own
            held = np.where(same, votes[own], held)
        stays = ~known & (held > strength)
        all_votes[at + slot] = np.where(known, held + strength, np.where(stays, held - strength, strength))
        new = ~stays
        all_owners[(at + slot)[new]] = objects[new]

    def hand_over(self, rows: Ints, giver: int, taker: int) -> None:
        """Let the claims of one object on these voxels be another's, which has none yet."""
        owners = self.owners[rows]
        owners[owners == giver] = taker
        self.owners[rows] = owners

    def rename(self, rows: Ints, names: Mapping[int, int]) -> None:
        """In these voxels, let objects be others from now on; claims that meet are added up.

        names: {id: its new one, -1 for nobody}.
        """
        owners, votes = self.owners.take(rows, axis=0), self.votes.take(rows, axis=0)
        old = np.array(sorted(names), np.int32)
        at = np.minimum(np.searchsorted(old, owners), len(old) - 1)
        named = old.take(at) == owners
        some = np.flatnonzero(named.any(axis=1))
        new = np.array([names[name] for name in old.tolist()], np.int32)
        part = np.where(named[some], new.take(at[some]), owners[some])
        weight = votes[some]
        for a in range(SLOTS):
            for b in range(a + 1, SLOTS):
                same = (part[:, a] == part[:, b]) & (part[:, a] >= 0)
                weight[same, a] += weight[same, b]
                part[same, b] = -1
        weight[part < 0] = 0
        touched = rows[some]
        # Two views of one thing in one frame were one sighting: a claim is never more than what was seen.
        weight = np.minimum(weight, self.seen[touched][:, None])
        self.owners[touched], self.votes[touched] = part, weight

    def solid(self, rows: NDArray[np.integer] | slice, share: float, strength: float) -> NDArray[np.bool_]:
        """(n, SLOTS) bool: which claims hold: at least so strong, and such a share of what was seen there."""
        seen, owners, votes = (
            (column[rows] if isinstance(rows, slice) else column.take(rows, axis=0))
            for column in (self.seen, self.owners, self.votes)
        )
        floor = np.maximum(seen * np.float32(share), np.float32(strength))
        held: NDArray[np.bool_] = (owners >= 0) & (votes >= floor[:, None])
        return held

    def mean_points(self, rows: NDArray[np.integer]) -> Floats:
        """(n, 3) float32 m: the mean of what was measured in each voxel."""
        mean = self.points.take(rows, axis=0) / np.maximum(self.weight[rows], 1e-6)[:, None]
        found: Floats = (self.cells.take(rows, axis=0) * np.float32(self.size) + mean).astype(np.float32)
        return found

    def mean_colors(self, rows: NDArray[np.integer]) -> NDArray[np.uint8]:
        """(n, 3) uint8 RGB."""
        mean = self.colors.take(rows, axis=0) / np.maximum(self.weight[rows], 1e-6)[:, None]
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
_COLUMNS = {**{name: (shape, dtype) for name, (shape, dtype, _) in _LAYOUT.items()}, "_place": ((), np.int32)}
"""What grows with the rows; _place is for `numbered`."""


def _columns(cells: Ints) -> list[Ints]:
    """Cells (n, 3) column by column: numpy is many times faster along an axis that lies together in memory."""
    return [np.ascontiguousarray(cells[:, axis]) for axis in range(3)]


def _firsts(table: Ints, keys: Ints) -> NDArray[np.intp]:
    """Where each of keys (n,) occurs first. table is written to at keys, instead of sorting them."""
    each = np.arange(len(keys), dtype=np.int32)
    table[keys[::-1]] = each[::-1]  # where a place is written twice, the last stays
    return np.flatnonzero(table.take(keys) == each)
