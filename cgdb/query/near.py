"""Near pairs: which boxes can be within a distance of each other, found on a grid instead of by trying all pairs."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from cgdb.geometry import Boxes
from cgdb.index.positions import Positions
from cgdb.query.bindings import Bindings
from cgdb.query.limits import Budget

MOST_CELLS = 64
"""A box over more cells than that is compared with all others: there are few such, walls and floors."""

Ints = NDArray[np.int64]


def near_pairs(boxes: Boxes, one: Positions, other: Positions, metres: float, budget: Budget) -> tuple[Ints, Ints]:
    """Pairs (a of ``one``, b of ``other``) whose hulls are at most so many metres apart, each pair once.

    Hulls are never farther apart than the boxes in them, so that no pair of near boxes is missed. Boxes without a
    center are near to nothing. one and other must each be distinct positions.
    """
    half = boxes.half_hulls
    one = one[np.isfinite(boxes.centers[one]).all(axis=1)]
    other = other[np.isfinite(boxes.centers[other]).all(axis=1)]
    if not len(one) or not len(other):
        return np.empty(0, np.int64), np.empty(0, np.int64)
    low_a, high_a = boxes.centers[one] - half[one] - metres, boxes.centers[one] + half[one] + metres
    low_b, high_b = boxes.centers[other] - half[other], boxes.centers[other] + half[other]
    cell = max(2 * metres, float(np.median(2 * half[other].max(axis=1))), 0.25)
    spans = [np.floor(edge / cell).astype(np.int64) for edge in (low_a, high_a, low_b, high_b)]
    wide_a = (spans[1] - spans[0] + 1).prod(axis=1) > MOST_CELLS
    wide_b = (spans[3] - spans[2] + 1).prod(axis=1) > MOST_CELLS
    pairs = [_sharing_a_cell(spans, np.flatnonzero(~wide_a), np.flatnonzero(~wide_b), budget)]
    pairs.append(_all_pairs(np.flatnonzero(wide_a), np.arange(len(other)), budget))
    pairs.append(_all_pairs(np.flatnonzero(~wide_a), np.flatnonzero(wide_b), budget))
    a, b = (np.concatenate(side) for side in zip(*pairs, strict=True))
    gap = np.maximum(np.maximum(low_a[a] + metres - high_b[b], low_b[b] - high_a[a] + metres), 0.0)
    # A hair more than asked: the exact distance decides afterwards.
    close = np.sqrt((gap**2).sum(axis=1)) <= metres * (1 + 1e-9) + 1e-9
    return one[a[close]], other[b[close]]


def _sharing_a_cell(spans: list[Ints], a: Ints, b: Ints, budget: Budget) -> tuple[Ints, Ints]:
    row_a, cells_a = _cells(spans[0][a], spans[1][a])
    row_b, cells_b = _cells(spans[2][b], spans[3][b])
    _, code = np.unique(np.concatenate([cells_a, cells_b]), axis=0, return_inverse=True)
    code = code.ravel()
    code_a, code_b = code[: len(cells_a)], code[len(cells_a) :]
    order = np.argsort(code_b, kind="stable")
    low, high = np.searchsorted(code_b[order], code_a, "left"), np.searchsorted(code_b[order], code_a, "right")
    counts = high - low
    budget.check_rows(int(counts.sum()))
    place = np.repeat(low - (np.cumsum(counts) - counts), counts) + np.arange(int(counts.sum()))
    found = np.unique(np.stack([np.repeat(a[row_a], counts), b[row_b[order][place]]], axis=1), axis=0)
    return found[:, 0], found[:, 1]


def _cells(low: Ints, high: Ints) -> tuple[Ints, Ints]:
    """For boxes over the cells low..high (n, 3): the row of each box and cell, and the cell (m, 3)."""
    sides = high - low + 1
    counts = sides.prod(axis=1)
    row = np.repeat(np.arange(len(low)), counts)
    inside = np.arange(len(row)) - np.repeat(np.cumsum(counts) - counts, counts)
    shape = sides[row]
    offset = np.stack(
        [inside // (shape[:, 1] * shape[:, 2]), inside // shape[:, 2] % shape[:, 1], inside % shape[:, 2]], axis=1
    )
    return row, low[row] + offset


def _all_pairs(a: Ints, b: Ints, budget: Budget) -> tuple[Ints, Ints]:
    budget.check_rows(len(a) * len(b))
    return np.repeat(a, len(b)), np.tile(b, len(a))


def joined(
    left: Bindings, right: Bindings, here: str, there: str, pairs: tuple[Ints, Ints], budget: Budget
) -> Bindings:
    """Every row of the left with every row of the right whose nodes ``here`` and ``there`` are one of the pairs."""
    by_here, by_there = np.argsort(left.nodes[here], kind="stable"), np.argsort(right.nodes[there], kind="stable")
    sorted_here, sorted_there = left.nodes[here][by_here], right.nodes[there][by_there]
    low_l, high_l = np.searchsorted(sorted_here, pairs[0], "left"), np.searchsorted(sorted_here, pairs[0], "right")
    low_r, high_r = np.searchsorted(sorted_there, pairs[1], "left"), np.searchsorted(sorted_there, pairs[1], "right")
    n_left, n_right = high_l - low_l, high_r - low_r
    counts = n_left * n_right
    total = int(counts.sum())
    budget.check_rows(total)
    which = np.repeat(np.arange(len(counts)), counts)
    inside = np.arange(total) - np.repeat(np.cumsum(counts) - counts, counts)
    rows_l = by_here[low_l[which] + inside // np.maximum(n_right[which], 1)]
    rows_r = by_there[low_r[which] + inside % np.maximum(n_right[which], 1)]
    order = np.lexsort((rows_r, rows_l))
    one, other = left.take(rows_l[order]), right.take(rows_r[order])
    return Bindings(
        n=total,
        nodes={**one.nodes, **other.nodes},
        edges={**one.edges, **other.edges},
        truth=one.truth & other.truth,
    )
