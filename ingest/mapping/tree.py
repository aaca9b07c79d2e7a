"""Which row of a table belongs to each cell of a sparse grid, found in constant time however large the grid is.

A tree of three levels over integer cells, as in VDB (Museth 2013): a dictionary of regions of 64 cells a side, a table
of blocks of 4 in each, a table of cells in each block. A frame touches a handful of regions, so everything below the
dictionary is array indexing.
"""

from __future__ import annotations

from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

Ints: TypeAlias = NDArray[np.int32]

REGION = 6
"""A region has 2**6 cells a side: 1.6 m at 2.5 cm."""
BLOCK = 2
"""A block has 2**2 cells a side."""
_BLOCKS = 1 << (3 * (REGION - BLOCK))
_CELLS = 1 << (3 * BLOCK)
_DENSE = 1 << 16
"""Regions in the box round some cells up to which they are found in a table."""


class Tree:
    """Rows by cell, -1 where a cell has none. Cells are given as three columns (n,) int32."""

    def __init__(self, leaves: int) -> None:
        """leaves: how many there is room for at first; only those that are used take memory."""
        self._regions: dict[tuple[int, int, int], int] = {}
        # Number 0 of each level is the empty one: a search that finds nothing ends there, without a test on the way.
        self._blocks: Ints = np.zeros((1, _BLOCKS), np.int32)
        self._leaves: Ints = np.empty((leaves, _CELLS), np.int32)
        self._leaves[0] = -1
        self._n_leaves = 1

    @property
    def table(self) -> Ints:
        """The rows by address; another array once more leaves were made than there was room for."""
        return self._leaves.reshape(-1)

    def addresses(self, axes: list[Ints], *, create: bool) -> Ints:
        """(n,) int32 where in the table the rows of cells are. create: make room for those that have none."""
        block, cell = self._block_of(axes, create=create)
        leaf: Ints = self._leaf_of(block) if create else self._blocks.reshape(-1).take(block)
        return leaf * _CELLS + cell

    def rows(self, axes: list[Ints]) -> Ints:
        """(n,) int32 the rows of cells."""
        return self.table.take(self.addresses(axes, create=False))

    def around(self, rows: NDArray[np.integer], axes: list[Ints]) -> Ints:
        """(7, n) int32 rows (n,), those of the cells, and the rows of the cells that share a face with each."""
        table = self.table
        address = self.addresses(axes, create=False)
        found = np.empty((7, len(rows)), np.int32)
        found[0] = rows
        last = (1 << BLOCK) - 1
        over, where = [], []
        for axis, values in enumerate(axes):
            within, stride = values & last, 1 << (BLOCK * (2 - axis))
            for face, step, end in ((1 + 2 * axis, 1, last), (2 + 2 * axis, -1, 0)):
                # Three in four have this neighbour in their own block, a step along the table.
                found[face] = table.take(address + step * stride, mode="clip")
                border = np.flatnonzero(within == end)
                beyond = [other.take(border) for other in axes]
                beyond[axis] += np.int32(step)
                over.append(beyond)
                where.append(border + face * len(rows))
        beyond = [np.concatenate([part[axis] for part in over]) for axis in range(3)]
        found.reshape(-1)[np.concatenate(where)] = self.rows(beyond)
        return found

    def within(self, low: Ints, high: Ints) -> Ints | None:
        """Rows among which are all of the cells from low to high (3,), both included; None for so large a box that it
        is as well to look at all there are."""
        ends = [range(int(a) >> BLOCK, (int(b) >> BLOCK) + 1) for a, b in zip(low, high, strict=True)]
        if len(ends[0]) * len(ends[1]) * len(ends[2]) > 4 * self._n_leaves:
            return None
        grid = np.meshgrid(*(np.array(end, np.int32) << BLOCK for end in ends), indexing="ij")
        block, _ = self._block_of([axis.reshape(-1) for axis in grid], create=False)
        leaf = self._blocks.reshape(-1).take(block)
        rows = self._leaves.take(leaf[leaf > 0], axis=0).reshape(-1)
        return rows[rows >= 0]

    def _leaf_of(self, block: Ints) -> Ints:
        """The leaf of each block, made where there was none."""
        blocks = self._blocks.reshape(-1)
        leaf: Ints = blocks.take(block)
        lost = np.flatnonzero(leaf == 0)
        if len(lost):
            block = block[lost]
            new = firsts(blocks, block)
            blocks[block[new]] = self._new_leaves(len(new))
            leaf[lost] = blocks.take(block)
        return leaf

    def _block_of(self, axes: list[Ints], *, create: bool) -> tuple[Ints, Ints]:
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


def columns(cells: Ints) -> list[Ints]:
    """Cells (n, 3) column by column: numpy is many times faster along an axis that lies together in memory."""
    return [np.ascontiguousarray(cells[:, axis]) for axis in range(3)]


def firsts(table: Ints, keys: Ints) -> NDArray[np.intp]:
    """Where each of keys (n,) occurs first. table is written to at keys, instead of sorting them."""
    each = np.arange(len(keys), dtype=np.int32)
    table[keys[::-1]] = each[::-1]  # where a place is written twice, the last stays
    return np.flatnonzero(table.take(keys) == each)
