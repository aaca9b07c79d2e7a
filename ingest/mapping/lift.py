"""From the pixels of a frame's detections to sets of voxels, with what does not belong to them left out.

Masks spill over the outline of things, and a depth camera invents points between a thing and what is behind it. So
pixels at depth edges are not used, pixels near the outline of a mask count as weak evidence only, and of what is left
the largest connected piece stays, as DBSCAN would keep it: voxels are taken together into cells, cells with enough
voxels about them are core, and cores that touch are one cluster.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from cgdb.ingest.detections.detections import Detections
from cgdb.ingest.detections.overlap import common
from cgdb.ingest.frames.recording import Frame
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
    usable = usable_pixels(frame.depth, how)
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
    kept = pieces(owner, voxels.cells.take(row, axis=0), whole, how)
    return _lifted(len(picks), owner, row, strong, within.take(place), kept, voxels, how)


def usable_pixels(depth: Floats, how: Lifting) -> NDArray[np.bool_]:
    """(h, w) bool: where a depth picture is in range, and not behind an edge.

    What lies in front is there, however thin; between it and what lies behind, a camera makes points up.
    """
    near = (depth > how.nearest) & (depth < how.farthest)
    inverse = np.reciprocal(np.maximum(depth, np.float32(how.nearest)))
    inverse *= near
    spread = _spread(inverse)
    spread -= inverse
    usable: NDArray[np.bool_] = spread < how.edge
    usable &= near
    return usable


def sampling_grid(frame: Frame, spacing: float) -> NDArray[np.bool_]:
    """(h, w) bool: every pixel where things are far, every second or fourth where their points lie denser than spacing
    (m): they would fall into the same voxels."""
    height, width = frame.depth.shape
    grid = np.ones((height, width), np.bool_)
    for step, depth in _sparser(frame, spacing):
        coarse = np.zeros((height, width), np.bool_)
        coarse[::step, ::step] = True
        grid &= coarse | (frame.depth > depth)
    return grid


def stands_for(frame: Frame, pixels: NDArray[np.intp], spacing: float) -> Floats:
    """(n,) float32 how many pixels of the picture each of the grid's, at flat positions pixels (n,), stands for."""
    depth = frame.depth.reshape(-1).take(pixels)
    found = np.ones(len(pixels), np.float32)
    for step, nearer in _sparser(frame, spacing):
        found[depth <= nearer] = step * step
    return found


def _sparser(frame: Frame, spacing: float) -> list[tuple[int, float]]:
    """(step, depth in m up to which only every step-th pixel of every step-th row is used), farthest first."""
    focal = float(min(frame.K[0, 0], abs(frame.K[1, 1])))
    return [(step, spacing * focal / step) for step in (2, 4)]


def _spread(values: Floats) -> Floats:
    """The largest of each pixel and its eight neighbours."""
    # Over the picture as one row, which is faster; at its sides, the neighbours of other rows are taken out again.
    flat, across = values.reshape(-1), np.empty_like(values)
    pairs = np.maximum(flat[1:], flat[:-1])
    np.maximum(pairs[1:], pairs[:-1], out=across.reshape(-1)[1:-1])
    np.maximum(values[:, 0], values[:, 1], out=across[:, 0])
    np.maximum(values[:, -1], values[:, -2], out=across[:, -1])
    both = across.copy()
    np.maximum(both[1:], across[:-1], out=both[1:])
    np.maximum(both[:-1], across[1:], out=both[:-1])
    return both


def mask_pixels(
    mask: NDArray[np.bool_], box: NDArray[np.float32], usable: NDArray[np.bool_], rim: int, scratch: NDArray[np.bool_]
) -> tuple[NDArray[np.intp], NDArray[np.bool_]]:
    """The flat positions of a mask's usable pixels, and which of them lie deeper than rim in it.

    scratch (h, w) is written to, so that no picture has to be made for every mask.
    """
    height, width = mask.shape
    x1, y1 = max(0, int(box[0]) - 1), max(0, int(box[1]) - 1)
    x2, y2 = min(width, int(box[2]) + 2), min(height, int(box[3]) + 2)
    if x2 <= x1 or y2 <= y1:
        return np.zeros(0, np.intp), np.zeros(0, np.bool_)
    window = mask[y1:y2, x1:x2]
    scratch[y1:y2, x1:x2] = shrunk(window, rim, (x1 == 0, x2 == width, y1 == 0, y2 == height))
    # Whole rows lie together, and outside of the box there is nothing of the mask.
    pixels = np.flatnonzero(mask[y1:y2] & usable[y1:y2]) + y1 * width
    return pixels, scratch.reshape(-1).take(pixels)


def shrunk(mask: NDArray[np.bool_], rim: int, cut: tuple[bool, bool, bool, bool]) -> NDArray[np.bool_]:
    """The mask without its outermost rim pixels; at sides where it is cut by the picture (left, right, top, bottom) it
    goes on for all we know, and loses nothing."""
    height, width = mask.shape
    padded = np.zeros((height + 2 * rim, width + 2 * rim), np.bool_)
    padded[rim : rim + height, rim : rim + width] = mask
    left, right, top, bottom = cut
    if left:
        padded[:, :rim] = padded[:, rim : rim + 1]
    if right:
        padded[:, rim + width :] = padded[:, rim + width - 1 : rim + width]
    if top:
        padded[:rim] = padded[rim]
    if bottom:
        padded[rim + height :] = padded[rim + height - 1]
    across = padded[:, :width].copy()
    for shift in range(1, 2 * rim + 1):
        across &= padded[:, shift : shift + width]
    inner = across[:height].copy()
    for shift in range(1, 2 * rim + 1):
        inner &= across[shift : shift + height]
    return inner


def unproject(frame: Frame, pixels: NDArray[np.intp]) -> Floats:
    """(n, 3) float32 m in the map's frame: the points at flat positions pixels (n,) of the depth picture."""
    width = frame.depth.shape[1]
    z = frame.depth.reshape(-1).take(pixels)
    v, u = np.divmod(pixels.astype(np.int32), np.int32(width))
    lens = frame.K.astype(np.float32)
    x = (u - lens[0, 2]) * (z * (1 / lens[0, 0]))
    y = (v - lens[1, 2]) * (z * (1 / lens[1, 1]))
    pose = frame.T_world_camera.astype(np.float32)
    points = np.empty((len(pixels), 3), np.float32, order="F")
    for axis in range(3):
        # Not a matrix product: for three columns its threads cost more than they bring.
        points[:, axis] = pose[axis, 0] * x + pose[axis, 1] * y + pose[axis, 2] * z + pose[axis, 3]
    return points


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


def pieces(owner: Ints, cells: Ints, whole: NDArray[np.bool_], how: Lifting, least: float = 1.0) -> NDArray[np.bool_]:
    """(m,) bool: the voxels of each owner's clusters that have at least this share of its largest one's.

    whole (n,): owners whose clusters all stay. owner (m,) ascends; cells (m, 3) int32. Where nothing is dense enough to
    be a cluster, a far or thin thing is kept whole rather than lost.
    """
    if not len(owner):
        return np.zeros(0, np.bool_)
    space = _Space.of(owner, cells, how.cell)
    groups, group, count = space.groups, space.group, space.count
    a, b = space.touching()
    n = len(groups)
    about = count + np.bincount(a, weights=count[b], minlength=n) + np.bincount(b, weights=count[a], minlength=n)
    core = about >= how.core
    joined = core[a] & core[b]
    piece = components(n, a[joined], b[joined])
    reached = core.copy()
    for one, other in ((a, b), (b, a)):
        # A cell at the border goes to a core cell that it touches; which one, where there are several, is no matter.
        border = ~core[one] & core[other]
        piece[one[border]] = piece[other[border]]
        reached[one[border]] = True
    size = np.bincount(piece, weights=np.where(reached, count, 0), minlength=n)
    of = space.owner
    largest = np.zeros(len(whole))
    np.maximum.at(largest, of, size)
    wanted = np.where(whole, 0.0, least * largest)
    good = reached & (size[piece] >= wanted[of])
    if least >= 1.0:
        good &= _first_of_equals(of, piece, size, largest, whole)
    lost = np.bincount(of, weights=good, minlength=len(whole)) == 0
    kept: NDArray[np.bool_] = (good | lost[of]).take(group)
    return kept


def _first_of_equals(
    of: NDArray[np.int64],
    piece: NDArray[np.intp],
    size: NDArray[Any],
    largest: NDArray[Any],
    whole: NDArray[np.bool_],
) -> NDArray[np.bool_]:
    """Of several largest clusters of an owner, the first."""
    first = np.full(len(whole), len(piece), np.intp)
    top = size[piece] == largest[of]
    np.minimum.at(first, of[top], piece[top])
    chosen: NDArray[np.bool_] = (piece == first[of]) | whole[of]
    return chosen


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class _Space:
    """The coarse cells of several owners, each in a box of its own, numbered through.

    groups (g,): the cells that hold something, ascending; group (m,): which of them each voxel is in; count (g,):
    voxels in each; owner (g,): whose. along, across (g,): steps from a cell to the next in x and in y; in z it is 1.
    found: which cells hold something, and the number of each of these among groups; None in a space too large for it.
    """

    groups: NDArray[np.int64]
    group: NDArray[np.intp]
    count: NDArray[np.intp]
    owner: NDArray[np.intp]
    along: NDArray[np.int64]
    across: NDArray[np.int64]
    found: tuple[NDArray[np.bool_], Ints] | None

    @classmethod
    def of(cls, owner: Ints, cells: Ints, side: int) -> _Space:
        """Of voxels in cells (m, 3), m > 0, of owners (m,) that ascend; a coarse cell has so many a side."""
        start = np.flatnonzero(np.r_[True, owner[1:] != owner[:-1]])
        lengths = np.diff(np.r_[start, len(owner)])
        axes = [np.ascontiguousarray(cells[:, axis]) // np.int32(side) for axis in range(3)]
        # A border of one, so that a step beyond the box does not end on its other side.
        low = [np.minimum.reduceat(axis, start).astype(np.int64) - 1 for axis in axes]
        span = [np.maximum.reduceat(axis, start) + 2 - least for axis, least in zip(axes, low, strict=True)]
        size = span[0] * span[1] * span[2]
        base = np.cumsum(size) - size
        offset = base - ((low[0] * span[1] + low[1]) * span[2] + low[2])
        across, along = span[2], span[1] * span[2]
        x, y, z = axes
        key = np.repeat(offset, lengths) + x * np.repeat(along, lengths) + y * np.repeat(across, lengths) + z
        found = None
        total = int(size.sum())
        if total <= _DENSE:
            there, number = np.zeros(total, np.bool_), np.empty(total, np.int32)
            there[key] = True
            groups = np.flatnonzero(there)
            number[groups] = np.arange(len(groups), dtype=np.int32)
            found, group = (there, number), number.take(key).astype(np.intp)
        else:
            groups, group = np.unique(key, return_inverse=True)
        of = np.repeat(np.arange(len(start)), np.diff(np.searchsorted(groups, np.r_[base, total])))
        return cls(
            groups=groups,
            group=group,
            count=np.bincount(group, minlength=len(groups)),
            owner=owner[start].astype(np.intp)[of],
            along=along[of],
            across=across[of],
            found=found,
        )

    def touching(self) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
        """The pairs of cells that share a side, an edge or a corner, each once."""
        found_a, found_b = [], []
        for x, y, z in _HALF:
            target = self.groups + (x * self.along + y * self.across + z)
            if self.found is not None:
                there, number = self.found
                linked = np.flatnonzero(there.take(target))
                place = number.take(target.take(linked)).astype(np.intp)
            else:
                place = np.searchsorted(self.groups, target)
                place[place == len(self.groups)] = 0
                linked = np.flatnonzero(self.groups[place] == target)
                place = place[linked]
            found_a.append(linked)
            found_b.append(place)
        return np.concatenate(found_a), np.concatenate(found_b)


def components(n: int, a: NDArray[np.intp], b: NDArray[np.intp]) -> NDArray[np.intp]:
    """(n,) the smallest node of each node's connected component, of the graph with edges a[i] - b[i]."""
    label = np.arange(n)
    while len(a):
        low = np.minimum(label[a], label[b])
        np.minimum.at(label, label[a], low)
        np.minimum.at(label, label[b], low)
        while True:
            further = label[label]
            if (further == label).all():
                break
            label = further
        apart = label[a] != label[b]
        a, b = a[apart], b[apart]
    return label


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


_HALF = [(x, y, z) for x in (-1, 0, 1) for y in (-1, 0, 1) for z in (-1, 0, 1) if (x, y, z) > (0, 0, 0)]
"""Half of the 26 neighbours: the other half is the same links seen from the other end."""
_DENSE = 1 << 22
"""Coarse cells up to which they are found in a table."""
