"""How much two boxes have in common: 3D intersection over union of upright boxes, turned as they are."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from cgdb.ingest.relations.boxes import THINNEST, Boxes, overlap_area, prisms

_CHUNK = 1 << 15


def box_iou(boxes: Boxes, others: Boxes, up: str) -> NDArray[np.float64]:
    """(n, m) intersection over union of each of n boxes with each of m; 0 where either is only a point.

    Exact for boxes that stand upright; one that is tilted counts as the upright prism around it.
    """
    n, m = len(boxes.centers), len(others.centers)
    both = prisms(_together(boxes, others), up)
    middle, half = (both.low + both.high) / 2, np.maximum(both.high - both.low, THINNEST) / 2
    volume = both.area * 2 * half
    found = np.zeros((n, m))
    # Most pairs are apart even by the hulls along the axes.
    apart = (np.abs(both.ground[:n, None] - both.ground[None, n:]) > both.reach[:n, None] + both.reach[None, n:]).any(2)
    apart |= np.abs(middle[:n, None] - middle[None, n:]) > half[:n, None] + half[None, n:]
    apart |= both.points[:n, None] | both.points[None, n:]
    rows, columns = np.nonzero(~apart)
    for start in range(0, len(rows), _CHUNK):
        a, b = rows[start : start + _CHUNK], columns[start : start + _CHUNK] + n
        high = np.minimum(middle[a] + half[a], middle[b] + half[b])
        common = overlap_area(both, a, b) * np.maximum(high - np.maximum(middle[a] - half[a], middle[b] - half[b]), 0)
        found[a, b - n] = common / (volume[a] + volume[b] - common)
    return found


def _together(boxes: Boxes, others: Boxes) -> Boxes:
    def rotations(some: Boxes) -> NDArray[np.float64]:
        return np.tile(np.eye(3), (len(some.centers), 1, 1)) if some.rotations is None else some.rotations

    turned = boxes.rotations is not None or others.rotations is not None
    return Boxes(
        centers=np.concatenate([boxes.centers, others.centers]),
        extents=np.concatenate([boxes.extents, others.extents]),
        rotations=np.concatenate([rotations(boxes), rotations(others)]) if turned else None,
    )
