"""How alike boxes are: the spatial similarities of the reference other than overlap."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from cgdb.ingest.mapping.fuse import Objects
from cgdb.ingest.mapping.voxels import Ints

THINNEST = 1
"""Cells that are added to every side: a box of one cell has the size of a cell."""


def box_similarity(low: Ints, high: Ints, objects: Objects, kind: str) -> NDArray[np.float32]:
    """(k, n) float32 the similarity of detections with boxes low, high (k, 3) in cells and the objects' boxes.

    Boxes lie along the map's axes, whole cells, so that none is flat. "giou" and "giou_accurate" take off the share of
    the enclosing box that is neither's. The accurate ones differ for the reference in using oriented boxes; boxes here
    are those of whole cells in either case.
    """
    other_low = np.array([obj.low for obj in objects.all]).reshape(-1, 3)
    other_high = np.array([obj.high for obj in objects.all]).reshape(-1, 3)
    return iou(low, high, other_low, other_high, generalised=kind.startswith("giou"))


def iou(low: Ints, high: Ints, other_low: Ints, other_high: Ints, *, generalised: bool = False) -> NDArray[np.float32]:
    """(k, n) float32 intersection over union of boxes of cells, both corners included; generalised: GIoU."""
    end, other_end = high.astype(np.float64) + THINNEST, other_high.astype(np.float64) + THINNEST
    common = np.minimum(end[:, None], other_end[None]) - np.maximum(low[:, None], other_low[None])
    inter = np.prod(np.maximum(common, 0.0), axis=2)
    union = np.prod(end - low, axis=1)[:, None] + np.prod(other_end - other_low, axis=1)[None] - inter
    found = inter / union
    if generalised:
        around = np.maximum(end[:, None], other_end[None]) - np.minimum(low[:, None], other_low[None])
        enclosing = np.prod(around, axis=2)
        found -= (enclosing - union) / enclosing
    similar: NDArray[np.float32] = found.astype(np.float32)
    return similar
