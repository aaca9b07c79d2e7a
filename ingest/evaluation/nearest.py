"""The nearest point of a cloud: within a reach, by a grid; however far, by a k-d tree. Exact, in numpy.

Only distances within a few centimetres matter to most scores, and there the grid is the faster; the protocol of the
paper's segmentation has no limit, and there a grid would not end.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from cgdb.errors import SceneError

Points = NDArray[np.float32]
Indices = NDArray[np.intp]

_CHUNK = 1 << 14
"""Points that are looked up together; bounds the memory."""
_LEAF = 16
"""Points of a leaf of the tree, at most twice as many."""


def nearest(points: Points, among: Points, reach: float | None = None) -> tuple[NDArray[np.float32], Indices]:
    """(distance (n,) m, index (n,)) of the nearest of `among` (m, 3) to points (n, 3); inf and -1 beyond reach.

    Of several at the same distance it is always the same one. reach None: however far.
    """
    distance = np.full(len(points), np.inf, np.float32)
    index = np.full(len(points), -1, np.intp)
    if not len(points) or not len(among):
        return distance, index
    if reach is not None:
        _within(points, among, reach, distance, index)
        return distance, index
    tree = _Tree.of(among)
    for start in range(0, len(points), _CHUNK):
        some = slice(start, start + _CHUNK)
        distance[some], index[some] = tree.nearest(points[some].astype(np.float64))
    return distance, index


# -- within a reach: cells of that size, of which 27 are looked at


def _within(points: Points, among: Points, reach: float, distance: NDArray[np.float32], index: Indices) -> None:
    """Fill in distance and index."""
    low = np.minimum(points.min(axis=0), among.min(axis=0)) - 2 * reach
    span = np.maximum(points.max(axis=0), among.max(axis=0)).astype(np.float64) - low
    # In floats: what is too much for the keys of cells is too much for their numbers, too.
    if not float(np.log2(np.floor(span / reach) + 2).sum()) <= 62:
        raise SceneError(f"the clouds reach over {float(span.max()):.3g} m: too far to be compared at {reach} m")
    side = np.floor(span / reach).astype(np.int64) + 2
    cells = np.floor((among - low) / reach).astype(np.int64)
    key = (cells[:, 0] * side[1] + cells[:, 1]) * side[2] + cells[:, 2]
    order = np.argsort(key, kind="stable")
    key = key[order]
    at = np.floor((points - low) / reach).astype(np.int64)
    base = (at[:, 0] * side[1] + at[:, 1]) * side[2] + at[:, 2]
    for x in (-1, 0, 1):
        for y in (-1, 0, 1):
            # Three cells in a row of the last axis lie together in the order of the keys.
            middle = base + x * side[1] * side[2] + y * side[2]
            first, last = np.searchsorted(key, middle - 1), np.searchsorted(key, middle + 1, side="right")
            _take_nearest(points, among, order, first, last, distance, index)
    far = distance > reach
    distance[far], index[far] = np.inf, -1


def _take_nearest(
    points: Points,
    among: Points,
    order: Indices,
    first: Indices,
    last: Indices,
    distance: NDArray[np.float32],
    index: Indices,
) -> None:
    """Look at the candidates order[first:last] of each point; distance and index are changed where one is nearer."""
    some = np.flatnonzero(last > first)
    for start in range(0, len(some), _CHUNK):
        rows = some[start : start + _CHUNK]
        counts = last[rows] - first[rows]
        begin = np.cumsum(counts) - counts
        which = np.repeat(np.arange(len(rows)), counts)
        candidate = order[np.arange(len(which)) - np.repeat(begin, counts) + np.repeat(first[rows], counts)]
        apart = np.linalg.norm(points[rows[which]] - among[candidate], axis=1)
        low = np.minimum.reduceat(apart, begin)
        # The first candidate that is as near as the nearest.
        hit = np.flatnonzero(apart == low[which])
        _, one = np.unique(which[hit], return_index=True)
        nearer = low < distance[rows]
        distance[rows[nearer]] = low[nearer]
        index[rows[nearer]] = candidate[hit[one]][nearer]


# -- however far: a balanced k-d tree, asked for many points at once


@dataclass(frozen=True, slots=True, eq=False)
class _Tree:
    """A k-d tree whose leaves hold the same number of points each (Bentley 1975), split at the median of the longest
    side. points (2 ** depth, leaf, 3) float64, index (2 ** depth, leaf); low, high: per level (2 ** level, 3) boxes."""

    points: NDArray[np.float64]
    index: Indices
    low: tuple[NDArray[np.float64], ...]
    high: tuple[NDArray[np.float64], ...]

    @classmethod
    def of(cls, cloud: Points) -> _Tree:
        n = len(cloud)
        depth = max(0, int(np.ceil(np.log2(n / _LEAF))))
        leaf = -(-n // 2**depth)
        # Some points stand in the tree twice, so that all leaves are full.
        order = np.resize(np.arange(n), 2**depth * leaf)
        for level in range(depth):
            order = order.reshape(2**level, -1)
            spread = np.ptp(cloud[order], axis=1)
            along = cloud[order, spread.argmax(axis=1)[:, None]]
            middle = order.shape[1] // 2
            order = np.take_along_axis(order, np.argpartition(along, middle, axis=1), axis=1)
        order = order.reshape(2**depth, leaf)
        points = cloud[order].astype(np.float64)
        low, high = [points.min(axis=1)], [points.max(axis=1)]
        for _ in range(depth):
            low.append(np.minimum(low[-1][0::2], low[-1][1::2]))
            high.append(np.maximum(high[-1][0::2], high[-1][1::2]))
        return cls(points, order, tuple(low[::-1]), tuple(high[::-1]))

    def nearest(self, asked: NDArray[np.float64]) -> tuple[NDArray[np.float32], Indices]:
        """(distance, index) of the nearest point of the cloud to each of asked (k, 3)."""
        rows = np.arange(len(asked))
        home = np.zeros(len(asked), np.intp)
        for level in range(1, len(self.low)):
            left = 2 * home
            home = left + (self._away(asked, left + 1, level) < self._away(asked, left, level))
        squared, index = self._in_leaf(asked, home)
        # From the root down, the parts of the tree that could hold something nearer.
        node = np.zeros(len(asked), np.intp)
        for level in range(1, len(self.low)):
            rows, node = np.repeat(rows, 2), np.stack([2 * node, 2 * node + 1], axis=1).ravel()
            near = self._away(asked[rows], node, level) < squared[rows]
            rows, node = rows[near], node[near]
        other = node != home[rows]
        rows, node = rows[other], node[other]
        for start in range(0, len(rows), _CHUNK):
            some = rows[start : start + _CHUNK]
            apart, which = self._in_leaf(asked[some], node[start : start + _CHUNK])
            order = np.lexsort((which, apart, some))
            first = order[np.unique(some[order], return_index=True)[1]]
            nearer = first[apart[first] < squared[some[first]]]
            squared[some[nearer]], index[some[nearer]] = apart[nearer], which[nearer]
        return np.sqrt(squared).astype(np.float32), index

    def _away(self, asked: NDArray[np.float64], node: Indices, level: int) -> NDArray[np.float64]:
        """(k,) the squared distance of each point to a node's box."""
        out = np.maximum(self.low[level][node] - asked, asked - self.high[level][node])
        away: NDArray[np.float64] = (np.maximum(out, 0.0) ** 2).sum(axis=1)
        return away

    def _in_leaf(self, asked: NDArray[np.float64], leaf: Indices) -> tuple[NDArray[np.float64], Indices]:
        squared = ((self.points[leaf] - asked[:, None, :]) ** 2).sum(axis=2)
        best = squared.argmin(axis=1)
        return squared[np.arange(len(leaf)), best], self.index[leaf, best]
