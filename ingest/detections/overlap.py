"""How much the boxes of a picture cover of each other: which are much the same, and which lie in another."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

WITHIN = 0.95
"""A box lies in another that covers more than this share of it."""


def common(boxes: NDArray[np.float32]) -> NDArray[np.float32]:
    """(n, n) float32 the pixels that each two of boxes (n, 4) have in common; on the diagonal, the area of each."""
    low = np.maximum(boxes[:, None, :2], boxes[None, :, :2])
    high = np.minimum(boxes[:, None, 2:], boxes[None, :, 2:])
    shared: NDArray[np.float32] = np.prod(np.maximum(high - low, 0), axis=2)
    return shared


def within(boxes: NDArray[np.float32]) -> NDArray[np.bool_]:
    """(n,) bool: which of boxes (n, 4) lie in another."""
    shared = common(boxes)
    covered = shared > WITHIN * np.diagonal(shared)[:, None]
    np.fill_diagonal(covered, False)
    return np.asarray(covered.any(axis=1))


def distinct(boxes: NDArray[np.float32], scores: NDArray[np.float32], most: float) -> NDArray[np.intp]:
    """The rows of boxes (n, 4) to keep, the surest first: none has an intersection over union above `most` with
    a surer one (non-maximum suppression)."""
    area = np.prod(np.maximum(boxes[:, 2:] - boxes[:, :2], 0), axis=1)
    kept: list[int] = []
    for row in np.argsort(-scores, kind="stable").tolist():
        low = np.maximum(boxes[kept, :2], boxes[row, :2])
        high = np.minimum(boxes[kept, 2:], boxes[row, 2:])
        common = np.prod(np.maximum(high - low, 0), axis=1)
        if not (common > most * (area[kept] + area[row] - common)).any():
            kept.append(row)
    return np.array(kept, np.intp)
