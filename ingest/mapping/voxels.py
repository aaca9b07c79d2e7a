"""One sparse voxel grid for a whole map: what was measured in each voxel, and who saw what in it."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from cgdb.errors import SceneError
from cgdb.ingest.mapping.tree import Tree, columns, firsts

Ints = NDArray[np.int32]
Floats = NDArray[np.float32]

REACH = 1 << 20
"""Cells lie within this many of the origin, each way: 26 km at 2.5 cm."""
SLOTS = 4
"""Objects that one voxel remembers. Where a fifth wants in, the weakest claim gives way."""
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
        self._tree = Tree(_ROOM // 16)
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
        return self._tree.rows(columns(cells))

    def around(self, rows: NDArray[np.integer]) -> Ints:
        """(7, n) int32 the rows of the voxels (n,) and of those that share a face with each; -1 where there is none."""
        return self._tree.around(rows, columns(self.cells.take(rows, axis=0)))

    def within(self, low: Ints, high: Ints) -> Ints:
        """Rows among which are all voxels with cells from low to high (3,), both included."""
        found = self._tree.within(low, high)
        return np.arange(self.count, dtype=np.int32) if found is None else found

    def make(self, cells: Ints) -> Ints:
        """(n,) int32 the rows of cells (n, 3), made where there were none; several cells may be the same."""
        address = self._tree.addresses(columns(cells), create=True)
        table = self._tree.table
        row = table.take(address)
        lost = np.flatnonzero(row < 0)
        if len(lost):
            address = address[lost]
            new = firsts(table, address)
            # In the order of the input: rows then do not depend on how blocks came to be numbered.
            rows = self._new_rows(len(new))
            self.cells[rows] = cells.take(lost[new], axis=0)
            table[address[new]] = rows
            row[lost] = table.take(address)
        return row

    def forget(self, rows: NDArray[np.integer]) -> None:
        """Let these voxels be as if they had never been seen; their rows are given to others later."""
        self._tree.table[self._tree.addresses(columns(self.cells.take(rows, axis=0)), create=False)] = -1
        for name, (_, _, empty) in _LAYOUT.items():
            getattr(self, name)[rows] = empty
        self.free = np.concatenate([self.free, rows.astype(np.int32)])

    def fill(self, held: Mapping[str, NDArray[Any]], free: NDArray[np.integer]) -> None:
        """Hold exactly these voxels: for each of COLUMNS its values, row by row. free: rows that hold none."""
        n = len(held["cells"])
        self._tree = Tree(_ROOM // 16)
        self._make_rows(max(_ROOM, n + n // 4))
        self.count = n
        for name in COLUMNS:
            getattr(self, name)[:n] = held[name]
        live = np.ones(n, np.bool_)
        live[free] = False
        rows = np.flatnonzero(live).astype(np.int32)
        address = self._tree.addresses(columns(self.cells.take(rows, axis=0)), create=True)
        self._tree.table[address] = rows
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
