"""Boxes that are much the same: of those, the surest stays."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray


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
