"""Which texts and which things belong to each row of a scene, and the best of what is said of them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float32]
Rows = NDArray[np.int64]

MOST_SLOTS = 64
"""Texts or things of one object that are compared; a node with more is data, not a description."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Lists:
    """Lists of ids per row, as CSR, and cut across: slots[j] holds the rows that have a j-th id, and that id.

    A row has one to three ids, as a rule: a maximum over slots is a few whole-array steps, ten times faster than
    reduceat over tens of thousands of short lists.
    """

    indptr: Rows
    ids: NDArray[np.int32]
    slots: tuple[tuple[Rows, NDArray[np.int32]], ...]

    @classmethod
    def of(cls, n: int, rows: NDArray[np.int32], ids: NDArray[np.int32]) -> Lists:
        """Any order; an id that a row has twice is kept once."""
        pairs = np.unique(rows.astype(np.int64) << 32 | ids)
        rows, ids = (pairs >> 32).astype(np.int32), (pairs & 0xFFFFFFFF).astype(np.int32)
        return cls._of_pointers(np.searchsorted(rows, np.arange(n + 1)).astype(np.int64), ids)

    @classmethod
    def _of_pointers(cls, indptr: Rows, ids: NDArray[np.int32]) -> Lists:
        counts = np.diff(indptr)
        slots = []
        for j in range(min(int(counts.max(initial=0)), MOST_SLOTS)):
            rows = np.flatnonzero(counts > j)
            slots.append((rows, ids[indptr[rows] + j]))
        return cls(indptr=indptr, ids=ids, slots=tuple(slots))

    def only(self, rows: Rows) -> Lists:
        """The lists of some rows, renumbered."""
        counts = self.indptr[rows + 1] - self.indptr[rows]
        indptr = np.concatenate([np.zeros(1, np.int64), np.cumsum(counts)])
        flat = np.arange(int(indptr[-1])) + np.repeat(self.indptr[rows] - indptr[:-1], counts)
        return self._of_pointers(indptr, self.ids[flat])

    def of_row(self, row: int) -> NDArray[np.int32]:
        """The ids of one row."""
        return self.ids[self.indptr[row] : self.indptr[row + 1]]

    def best(self, values: Floats) -> Floats:
        """(n,) per row the largest of its ids' values, NaN where there is none."""
        best = np.full(len(self.indptr) - 1, np.nan, dtype=np.float32)
        for j, (rows, ids) in enumerate(self.slots):
            if len(rows) == len(best):
                np.fmax(best, values[ids], out=best)
            elif j == 0:
                best[rows] = values[ids]
            else:
                best[rows] = np.fmax(best[rows], values[ids])
        return best
