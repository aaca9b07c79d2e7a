"""The pixels of a frame: which of them are used, which are a mask's, and where in space they lie."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from cgdb.ingest.frames.recording import Frame
from cgdb.ingest.mapping.voxels import Floats


def usable_pixels(depth: Floats, nearest: float, farthest: float, edge: float) -> NDArray[np.bool_]:
    """(h, w) bool: where a depth picture is between nearest and farthest m, and not behind an edge: a jump of 1/m.

    What lies in front is there, however thin; between it and what lies behind, a camera makes points up.
    """
    near = (depth > nearest) & (depth < farthest)
    inverse = np.reciprocal(np.maximum(depth, np.float32(nearest)))
    inverse *= near
    spread = _spread(inverse)
    spread -= inverse
    usable: NDArray[np.bool_] = spread < edge
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
