"""How alike boxes are: the spatial similarities of the reference other than overlap."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from cgdb.ingest.mapping import oriented
from cgdb.ingest.mapping.fuse import Objects
from cgdb.ingest.mapping.lift import Lifted
from cgdb.ingest.mapping.voxels import Ints

THINNEST = 1
"""Cells that are added to every side: a box of one cell has the size of a cell."""


def box_similarity(lifted: Lifted, objects: Objects, size: float, kind: str) -> NDArray[np.float32]:
    """(k, n) float32 the similarity of detections' and objects' boxes, by "iou", "giou" or these with "_accurate".

    Plain boxes lie along the map's axes, in whole cells of size m, so that none is flat. "giou" takes off the share of
    what encloses both that is neither's. The accurate ones turn with their things, and a convex hull encloses; they are
    exact where plain boxes meet, which turned ones do not elsewhere, and for the rest have the plain value.
    """
    other_low = np.array([obj.low for obj in objects.all]).reshape(-1, 3)
    other_high = np.array([obj.high for obj in objects.all]).reshape(-1, 3)
    plain = iou(lifted.low, lifted.high, other_low, other_high, generalised=kind.startswith("giou"))
    if not kind.endswith("accurate") or lifted.extremes is None:
        return plain
    meet = (lifted.low[:, None] <= other_high + 1).all(axis=2) & (other_low <= lifted.high[:, None] + 1).all(axis=2)
    known = np.array([obj.extremes is not None for obj in objects.all], np.bool_)
    k, at = np.nonzero(meet & known)
    if len(k):
        there = np.unique(at)
        extreme = np.array([objects.all[i].extremes for i in there.tolist()])
        mine, yours = oriented.boxes(lifted.extremes), oriented.boxes(extreme)
        place = np.searchsorted(there, at)
        one = (mine[0][k] * size, mine[1][k] * size, mine[2][k])
        two = (yours[0][place] * size, yours[1][place] * size, yours[2][place])
        plain[k, at] = oriented.similarity(*one, two, generalised=kind.startswith("giou"))
    return plain


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
