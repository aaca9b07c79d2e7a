"""From the pixels of a frame's detections to sets of voxels, with what does not belong to them left out.

Masks spill over the outline of things, and a depth camera invents points between a thing and what is behind it. So
pixels at depth edges are not used, pixels near the outline of a mask count as weak evidence only, and of what is left
the largest connected piece stays.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from cgdb.ingest.detections.detections import Detections
from cgdb.ingest.detections.overlap import common
from cgdb.ingest.frames.recording import Frame
from cgdb.ingest.mapping.clusters import pieces
from cgdb.ingest.mapping.pixels import mask_pixels, sampling_grid, stands_for, unproject, usable_pixels
from cgdb.ingest.mapping.voxels import Floats, Ints, Voxels

STRONG = 4.0
"""How often a sighting in the middle of a mask counts, in sightings near its outline."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Lifting:
    """How pixels become voxels.

    nearest, farthest: metres of depth that are believed. edge: jump in inverse depth (1/m) between neighbouring
    pixels that is an edge; the noise of depth cameras is even in inverse depth, and so are planes seen askew. rim:
    pixels from the outline of a mask that are weak evidence. cell: voxels along a side of a cell of the clustering;
    core: voxels that a cell and its neighbours must hold. least_voxels: smaller detections are dropped. spacing: points
    nearer to each other than this share of a voxel are not all used. repeated: of two detections with so large an
    intersection over union of their voxels, only the surer counts.
    """

    nearest: float = 0.1
    farthest: float = 8.0
    edge: float = 0.015
    rim: int = 2
    cell: int = 3
    core: int = 6
    least_voxels: int = 4
    spacing: float = 0.6
    repeated: float = 0.9


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Lifted:
    """The detections of a frame in space: k of them, m voxels in all.

    source (k,): their rows among the detections. rows (m,) int32: voxels, ascending within a detection; owner (m,):
    whose; strength (m,) float32: 1 near the outline, STRONG within. low, high (k, 3) int32: boxes in cells.
    solid (k,): voxels of strength STRONG; points (k,): pixels of the depth picture in these. mask_rows, mask_owner (w,)
    int32: voxels and whose of all that the masks cover, before anything was taken for noise. extremes (k, 26, 3) int32:
    the outermost cells, where boxes are to be turned.
    """

    source: NDArray[np.intp]
    rows: Ints
    owner: Ints
    strength: Floats
    low: Ints
    high: Ints
    solid: NDArray[np.intp]
    points: NDArray[np.intp]
    mask_rows: Ints
    mask_owner: Ints
    extremes: Ints | None = None

    def __len__(self) -> int:
        return len(self.source)


def lift(frame: Frame, found: Detections, voxels: Voxels, how: Lifting, whole: NDArray[np.bool_]) -> Lifted:
    """The detections as sets of voxels, made where there were none. whole (n,): those that may be in several pieces."""
    usable = usable_pixels(frame.depth, how.nearest, how.farthest, how.edge)
    spacing = how.spacing * voxels.size
    sampled = usable & sampling_grid(frame, spacing)
    scratch = np.zeros(frame.depth.shape, np.bool_)
    picks = [
        mask_pixels(mask, box, sampled, how.rim, scratch) for mask, box in zip(found.masks, found.xyxy, strict=True)
    ]
    seen = np.zeros(frame.depth.size, np.bool_)
    for pixels, _ in picks:
        seen[pixels] = True
    pixels = np.flatnonzero(seen)
    if not len(pixels):
        return _nothing()
    points = unproject(frame, pixels)
    rows, place = voxels.add_samples(points, frame.rgb.reshape(-1, 3).take(pixels, axis=0))
    within = np.bincount(place, weights=stands_for(frame, pixels, spacing), minlength=len(rows))
    place_of = np.empty(frame.depth.size, np.int32)
    place_of[pixels] = place
    owner, place, strong = _distinct(picks, place_of, len(rows))
    row = rows.take(place)
    repeated = _repeated(owner, place, len(rows), found, how)
    if repeated.any():
        first = ~repeated[owner]
        owner, place, row, strong = owner[first], place[first], row[first], strong[first]
    kept = pieces(owner, voxels.cells.take(row, axis=0), whole, side=how.cell, core=how.core)
    return _lifted(len(picks), owner, row, strong, within.take(place), kept, voxels, how)


def _distinct(
    picks: list[tuple[NDArray[np.intp], NDArray[np.bool_]]], place_of: Ints, n: int
) -> tuple[Ints, Ints, NDArray[np.bool_]]:
    """Each (detection, place of a voxel below n) once, in order, and whether any of its pixels was strong."""
    seen = np.zeros((len(picks), n), np.uint8)
    for row, (pixels, inner) in zip(seen, picks, strict=True):
        place = place_of.take(pixels)
        row[place] = 1
        row[place[inner]] = 2
    flat = np.flatnonzero(seen.reshape(-1) != 0)
    owner = np.repeat(np.arange(len(picks), dtype=np.int32), np.count_nonzero(seen, axis=1))
    place = (flat - owner.astype(np.int64) * n).astype(np.int32)
    return owner, place, seen.reshape(-1).take(flat) == 2


def _repeated(owner: Ints, place: Ints, n: int, found: Detections, how: Lifting) -> NDArray[np.bool_]:
    """(k,) bool: detections that show nearly what a surer one shows. One thing that is detected twice is one sighting.

    owner, place (m,): the voxels of each, numbered below n.
    """
    count = len(found)
    repeated = np.zeros(count, np.bool_)
    shared = common(found.xyxy)
    area = np.diagonal(shared)
    near = np.triu(shared >= how.repeated * 0.8 * (area[:, None] + area[None, :] - shared), 1)
    if not near.any():
        return repeated
    start = np.searchsorted(owner, np.arange(count + 1))
    flags = np.zeros(n, np.bool_)
    for a, b in np.argwhere(near).tolist():
        mine, yours = place[start[a] : start[a + 1]], place[start[b] : start[b + 1]]
        flags[mine] = True
        both = int(np.count_nonzero(flags[yours]))
        flags[mine] = False
        if both and both >= how.repeated * (len(mine) + len(yours) - both):
            repeated[b if found.confidence[a] >= found.confidence[b] else a] = True
    return repeated


def _lifted(
    count: int,
    mask_owner: Ints,
    mask_rows: Ints,
    mask_strong: NDArray[np.bool_],
    within: NDArray[Any],
    kept: NDArray[np.bool_],
    voxels: Voxels,
    how: Lifting,
) -> Lifted:
    """The detections with enough voxels. within (w,): pixels in each voxel of a mask; kept (w,): which are no noise."""
    enough = np.bincount(mask_owner[kept], minlength=count) >= how.least_voxels
    source = np.flatnonzero(enough)
    if not len(source):
        return _nothing()
    number = (np.cumsum(enough) - 1).astype(np.int32)
    stays = enough.take(mask_owner)
    chosen = np.flatnonzero(kept & stays)
    owner, row, strong = number.take(mask_owner.take(chosen)), mask_rows.take(chosen), mask_strong.take(chosen)
    start = np.searchsorted(owner, np.arange(len(source)))
    cells = voxels.cells.take(row, axis=0)
    return Lifted(
        source=source,
        rows=row,
        owner=owner,
        strength=np.where(strong, np.float32(STRONG), np.float32(1.0)),
        low=np.minimum.reduceat(cells, start),
        high=np.maximum.reduceat(cells, start),
        solid=np.bincount(owner, weights=strong, minlength=len(source)).astype(np.intp),
        points=np.bincount(owner, weights=within.take(chosen) * strong, minlength=len(source)).astype(np.intp),
        mask_rows=mask_rows[stays],
        mask_owner=number[mask_owner[stays]],
    )


def _nothing() -> Lifted:
    return Lifted(
        source=np.zeros(0, np.intp),
        rows=np.zeros(0, np.int32),
        owner=np.zeros(0, np.int32),
        strength=np.zeros(0, np.float32),
        low=np.zeros((0, 3), np.int32),
        high=np.zeros((0, 3), np.int32),
        solid=np.zeros(0, np.intp),
        points=np.zeros(0, np.intp),
        mask_rows=np.zeros(0, np.int32),
        mask_owner=np.zeros(0, np.int32),
    )
