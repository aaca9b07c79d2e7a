"""Which object of the map each detection shows: a semantic and a geometric similarity, summed, and a greedy choice."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from cgdb.ingest.detections import Detections
from cgdb.ingest.fuse import Objects
from cgdb.ingest.lift import Lifted
from cgdb.ingest.similarity import box_similarity
from cgdb.ingest.voxels import FACES, Ints, Voxels

Spatial = Literal["overlap", "iou", "giou", "iou_accurate", "giou_accurate"]
Semantic = Literal["paper", "cosine"]
UNKNOWN = 0.8
"""The semantic similarity where there are no features: geometry decides, at threshold - UNKNOWN."""
HELD = 0.25
"""A voxel is an object's, for association, where at least this share of its sightings were."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Association:
    """How detections find their objects.

    spatial: "overlap" is the paper's nnratio, the share of a detection's voxels that are the object's or share a face
    with one that is; the others compare boxes. semantic: "paper" is cos / 2 + 1 / 2, "cosine" the reference's cos.
    threshold: the least sum; the paper's 1.1 goes with "paper", the reference's 1.2 with "cosine". bias: weighs
    (1 + bias) spatial + (1 - bias) semantic.
    """

    spatial: Spatial = "overlap"
    semantic: Semantic = "paper"
    threshold: float = 1.1
    bias: float = 0.0


def associate(
    lifted: Lifted, found: Detections, objects: Objects, voxels: Voxels, how: Association, alone: NDArray[np.bool_]
) -> NDArray[np.intp]:
    """(k,) the object of each detection, -1 where none is similar enough. alone (k,): not to be asked for."""
    matches = np.full(len(lifted), -1, np.intp)
    if not len(objects) or alone.all():
        return matches
    spatial = (
        overlap(lifted, len(objects), voxels, ~alone)
        if how.spatial == "overlap"
        else box_similarity(lifted.low, lifted.high, objects, how.spatial)
    )
    total = (1 + how.bias) * spatial + (1 - how.bias) * semantic(lifted, found, objects, how.semantic)
    # What is nowhere near is no candidate, however alike it looks.
    total[spatial <= 0.0 if how.spatial != "giou" else spatial <= -1.0] = -np.inf
    total[:, [obj.background for obj in objects.all]] = -np.inf
    best = total.argmax(axis=1)
    good = (total[np.arange(len(best)), best] >= how.threshold) & ~alone
    matches[good] = best[good]
    return matches


def semantic(lifted: Lifted, found: Detections, objects: Objects, kind: Semantic) -> NDArray[np.float32]:
    """(k, n) float32 how alike detections and objects look."""
    known = objects.unit(found.space)
    if found.features is None or known is None:
        return np.full((len(lifted), len(objects)), UNKNOWN, np.float32)
    cosine: NDArray[np.float32] = found.features[lifted.source] @ known.T
    return cosine if kind == "cosine" else (cosine / 2 + 0.5).astype(np.float32)


def overlap(lifted: Lifted, n: int, voxels: Voxels, wanted: NDArray[np.bool_]) -> NDArray[np.float32]:
    """(k, n) float32 the share of each wanted detection's voxels that are, or touch, the object's.

    Every voxel knows whose it is, so this looks at the detections' voxels only: its cost does not depend on n.
    """
    chosen = np.flatnonzero(wanted[lifted.owner])
    rows, owner = lifted.rows[chosen], lifted.owner[chosen]
    item, at = neighbours(voxels, rows)
    owners, votes = voxels.owners[at], voxels.votes[at]
    held = (owners >= 0) & (votes >= (HELD * voxels.seen[at])[:, None])
    place, slot = np.nonzero(held)
    pair = np.unique(item[place].astype(np.int64) * n + owners[place, slot])
    whose = owner[pair // n].astype(np.int64) * n + pair % n
    shared = np.bincount(whose, minlength=len(lifted) * n).reshape(len(lifted), n)
    size = np.bincount(lifted.owner, minlength=len(lifted))
    return (shared / size[:, None]).astype(np.float32)


def neighbours(voxels: Voxels, rows: Ints) -> tuple[NDArray[np.intp], Ints]:
    """Pairs (which of rows, a row that is it or shares a face with it)."""
    cells = voxels.cells[rows]
    around = voxels.find((cells[None, :, :] + FACES[:, None, :]).reshape(-1, 3))
    there = np.flatnonzero(around >= 0)
    return there % max(len(rows), 1), around[there]
