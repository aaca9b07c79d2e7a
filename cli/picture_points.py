"""Points to pixels, by numpy alone: every point a small disc, the nearest wins, and depth is shaded.

matplotlib's own scatter draws half a million discs in half a minute and knows no depth; this takes part of a second.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float32]
EMPTY = np.float32(np.inf)
LARGEST = 32
"""Pixels from the middle of a disc to its rim, at most."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Canvas:
    """rgb (height, width, 3) uint8 and depth (height, width) float32 of the nearest point, infinite where none is."""

    rgb: NDArray[np.uint8]
    depth: Floats

    def rgba(self) -> NDArray[np.uint8]:
        """(height, width, 4) uint8, clear where there is no point."""
        alpha = np.where(np.isfinite(self.depth), 255, 0).astype(np.uint8)
        return np.concatenate([self.rgb, alpha[..., None]], axis=2)


def splat(pixels: Floats, depth: Floats, radius: Floats, colors: NDArray[np.uint8], width: int, height: int) -> Canvas:
    """Draw points. pixels (n, 2): right and down from the upper left; depth (n,): small is near; radius (n,) pixels."""
    reach = int(np.clip(np.ceil(radius.max(initial=0.0)), 0, LARGEST))
    # A margin as wide as a disc, so that no disc needs to be cut at the rim.
    wide, high = width + 2 * reach, height + 2 * reach
    inside = (pixels >= 0).all(axis=1) & (pixels[:, 0] < width) & (pixels[:, 1] < height)
    # The far ones first: of assignments to the same pixel numpy keeps the last.
    order = np.flatnonzero(inside)
    order = order[np.argsort(-depth[order], kind="stable")].astype(np.int32)
    column, row = pixels[order, 0].astype(np.int32) + reach, pixels[order, 1].astype(np.int32) + reach
    place, depth, radius = row * np.int32(wide) + column, depth[order], radius[order]
    nearest = np.full(wide * high, EMPTY, np.float32)
    owner = np.full(wide * high, -1, np.int32)
    discs = sorted(
        (float(np.hypot(down, across)), down * wide + across)
        for down in range(-reach, reach + 1)
        for across in range(-reach, reach + 1)
    )
    step, culled = -1.0, False
    points, middle, at = order, place, depth
    for far, offset in discs:
        if far > reach + 0.35:
            break
        if far > 1.5 and not culled:
            # What others hide at its middle shows at most a rim: half of the points of a room, drawn no further.
            seen = depth <= nearest[place] * np.float32(1.01)
            order, place, depth, radius, culled = order[seen], place[seen], depth[seen], radius[seen], True
        if far != step:
            large = radius + 0.35 >= far
            # The rim of a disc lies a hair behind its middle, so that neighbours meet in the middle between them.
            points, middle, at, step = order[large], place[large], depth[large] * np.float32(1 + 1e-4 * far), far
        pixel = middle + np.int32(offset)
        closer = np.flatnonzero(at < nearest[pixel])
        pixel = pixel[closer]
        nearest[pixel] = at[closer]
        owner[pixel] = points[closer]
    cut = slice(reach, reach + height), slice(reach, reach + width)
    owner = owner.reshape(high, wide)[cut].reshape(-1)
    rgb = np.zeros((width * height, 3), np.uint8)
    there = np.flatnonzero(owner >= 0)
    rgb[there] = colors[owner[there]]
    return Canvas(rgb=rgb.reshape(height, width, 3), depth=nearest.reshape(high, wide)[cut].copy())


def filled(canvas: Canvas, times: int = 1) -> Canvas:
    """Close pinholes: a pixel without a point takes the mean of its neighbours where at least five have one."""
    height, width = canvas.depth.shape
    rgb, depth = canvas.rgb.reshape(-1, 3).copy(), canvas.depth.reshape(-1).copy()
    for _ in range(times):
        there = np.isfinite(depth).reshape(height, width)
        count = np.zeros((height, width), np.uint8)
        for down, across in _AROUND:
            count += _moved(there, down, across, False)
        hole = np.flatnonzero((~there & (count >= 5)).reshape(-1))
        y, x = np.divmod(hole, width)
        total, near = np.zeros((len(hole), 3), np.float32), np.full(len(hole), EMPTY, np.float32)
        for down, across in _AROUND:
            inside = (y + down >= 0) & (y + down < height) & (x + across >= 0) & (x + across < width)
            at = np.where(inside, hole + down * width + across, hole)
            known = there.reshape(-1)[at]
            total += np.where(known[:, None], rgb[at], 0)
            near = np.minimum(near, depth[at])
        rgb[hole] = (total / count.reshape(-1)[hole][:, None]).astype(np.uint8)
        depth[hole] = near
    return Canvas(rgb=rgb.reshape(height, width, 3), depth=depth.reshape(height, width))


def shaded(canvas: Canvas, relief: float, *, reach: int = 2, most: float = 0.55) -> Canvas:
    """Darken pixels whose neighbours are nearer: eye-dome lighting (Boucheny 2009), which shows shape without normals.

    relief: the difference in depth, in its own unit, that darkens well.
    """
    depth = np.where(np.isfinite(canvas.depth), canvas.depth, np.float32(1e9))
    response = np.zeros(depth.shape, np.float32)
    for down, across in _AROUND:
        difference = depth - _moved(depth, down * reach, across * reach, 1e9)
        difference *= np.float32(1 / relief)
        response += np.clip(difference, 0.0, 1.0, out=difference)
    light = 256 * (1.0 - most * (1.0 - np.exp(response / -2.5)))
    rgb = canvas.rgb * light.astype(np.uint16)[..., None] >> 8
    return Canvas(rgb=rgb.astype(np.uint8), depth=canvas.depth)


def smaller(image: NDArray[np.uint8], factor: int) -> NDArray[np.uint8]:
    """(h / factor, w / factor, 4) an image made larger than needed, averaged down: edges without steps."""
    if factor == 1:
        return image
    height, width = image.shape[0] // factor, image.shape[1] // factor
    color = np.zeros((height, width, 3), np.uint16)
    count = np.zeros((height, width), np.uint16)
    for down in range(factor):
        for across in range(factor):
            part = image[down : height * factor : factor, across : width * factor : factor]
            there = part[..., 3] > 0
            color += part[..., :3] * there[..., None]
            count += there
    color //= np.maximum(count, 1)[..., None]
    alpha = count * 255 // factor**2
    return np.concatenate([color, alpha[..., None]], axis=2).astype(np.uint8)


_AROUND = [(down, across) for down in (-1, 0, 1) for across in (-1, 0, 1) if (down, across) != (0, 0)]


def _moved(array: NDArray[Any], down: int, across: int, blank: object) -> NDArray[Any]:
    """The array with every value that far up and left of where it was, so that a pixel sees its neighbour."""
    found = np.full_like(array, blank)
    height, width = array.shape[:2]
    rows = slice(max(0, -down), height - max(0, down))
    columns = slice(max(0, -across), width - max(0, across))
    from_rows = slice(max(0, down), height - max(0, -down))
    from_columns = slice(max(0, across), width - max(0, -across))
    found[rows, columns] = array[from_rows, from_columns]
    return found
