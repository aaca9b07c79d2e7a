"""Relations of one label as arrays, and which of them are kept where there are too many."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from cgdb.ingest.relations.boxes import Bools, Floats, Ints


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Found:
    """Relations of one label: source, target (p,) rows; confidence (p,); rank (p,), least is kept first."""

    source: Ints
    target: Ints
    confidence: Floats
    rank: Floats

    def take(self, rows: Ints | Bools) -> Found:
        """Some of them."""
        return Found(
            source=self.source[rows], target=self.target[rows], confidence=self.confidence[rows], rank=self.rank[rows]
        )

    def turned(self) -> Found:
        """The same from target to source."""
        return replace(self, source=self.target, target=self.source)

    def without(self, others: Found) -> Found:
        """Those whose source and target are not those of one of the others."""
        if not len(others.source):
            return self
        ends = (self.source, self.target, others.source, others.target)
        rows = 1 + int(max(end.max(initial=0) for end in ends))
        return self.take(~np.isin(self.source * rows + self.target, others.source * rows + others.target))

    def first_per_source(self, count: int) -> Found:
        """The first so many of each source."""
        return self.take(_place_in_group(self.source, self.rank, self.target) < count)

    def first_per_either(self, count: int) -> Found:
        """Those of a symmetric relation that are among the first so many of one of their two ends."""
        group = np.concatenate([self.source, self.target])
        other = np.concatenate([self.target, self.source])
        first = _place_in_group(group, np.concatenate([self.rank, self.rank]), other) < count
        half = len(self.source)
        return self.take(first[:half] | first[half:])


def together(parts: Sequence[Found]) -> Found:
    """All of them, in order; parts must not be empty."""
    return Found(
        source=np.concatenate([part.source for part in parts]),
        target=np.concatenate([part.target for part in parts]),
        confidence=np.concatenate([part.confidence for part in parts]),
        rank=np.concatenate([part.rank for part in parts]),
    )


def _place_in_group(group: Ints, rank: Floats, tie: Ints) -> Ints:
    """(p,) how many of the same group come before each row, by rank and then tie."""
    order = np.lexsort((tie, rank, group))
    sorted_group = group[order]
    starts = np.flatnonzero(np.concatenate([[True], sorted_group[1:] != sorted_group[:-1]])) if len(group) else order
    sizes = np.diff(np.append(starts, len(group)))
    place = np.empty(len(group), dtype=np.int64)
    place[order] = np.arange(len(group)) - np.repeat(starts, sizes)
    return place
