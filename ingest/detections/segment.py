"""Detections without any weights: the depth is cut where surfaces end, fold inwards, or change colour.

Things are mostly convex, and stand on or before others with a fold between them (Stein et al. 2014; Tateno et al. 2015
do this frame by frame). Planes are straight in inverse depth, and the noise of depth cameras is even in it, so all of
it is measured there. Large planes with nothing behind them are the room. What comes out is pieces of things and things,
without names: a map that says where something is and how large, not what.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from cgdb.ingest.detections.detections import Detections, boxes_of
from cgdb.ingest.frames.recording import Frame, nearest
from cgdb.ingest.mapping.clusters import components

Floats = NDArray[np.float32]
Bools = NDArray[np.bool_]
BINS = 6
REACH = 3
"""Pixels (of about 320 x 240) to either side of a fold."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Segmenting:
    """Where surfaces are cut.

    edge: jump in inverse depth (1/m). fold: degrees of an inward fold. color: difference of colour (0..255) across a
    few pixels. smooth: rounds of averaging within surfaces. least: share of the picture that a segment must cover.
    room_size: metres that a plane must measure, both ways, to be wall, floor or ceiling. behind: share of the picture's
    points that may lie behind it.
    """

    edge: float = 0.02
    fold: float = 30.0
    color: float = 34.0
    smooth: int = 12
    least: float = 0.0008
    room_size: float = 1.2
    behind: float = 0.02


class GeometricDetector:
    """A detector that needs no model. up: the axis of the map that points against gravity."""

    name = "geometric segmentation (no model: pieces of things, without names)"
    encoder: str | None = None

    def __init__(self, how: Segmenting | None = None, *, up: str = "z") -> None:
        self.how = how or Segmenting()
        self.up = up

    def __call__(self, frame: Frame) -> Detections:
        """The segments of a frame, at its size, with histograms of their colours as features."""
        half = max(1, round(frame.depth.shape[0] / 240))
        depth = frame.depth[::half, ::half]
        rgb = _averaged(frame.rgb, half)
        lens = frame.K / half
        known = depth > 0
        inverse = np.zeros_like(depth)
        np.divide(1.0, depth, out=inverse, where=known)
        inverse = smoothed(inverse, known, self.how.edge, self.how.smooth)
        normals = normals_of(inverse, known, lens)
        points = _points(inverse, known, lens)
        label = self._cut(inverse, known, normals, points, rgb)
        masks, names = self._named(label, points, normals, known, frame)
        full = np.stack([nearest(mask, frame.depth.shape[::-1]) for mask in masks]) if masks else _none(frame)
        return Detections(
            masks=full,
            xyxy=boxes_of(full),
            confidence=np.full(len(full), 0.5, np.float32),
            labels=tuple(names),
            features=color_histograms(rgb, masks),
            space="color",
        )

    def _cut(self, inverse: Floats, known: Bools, normals: Floats, points: Floats, rgb: Floats) -> NDArray[np.intp]:
        """(h, w) the segment of each pixel, the number of its first pixel."""
        height, width = inverse.shape
        number = np.arange(height * width).reshape(height, width)
        links = []
        for axis, one, other in ((1, np.s_[:, :-1], np.s_[:, 1:]), (0, np.s_[:-1, :], np.s_[1:, :])):
            whole = known[one] & known[other] & (np.abs(inverse[one] - inverse[other]) < self.how.edge / 2)
            whole &= ~self._folded(normals, points, axis)
            whole &= np.abs(rgb[one] - rgb[other]).max(axis=2) < self.how.color / 2
            links.append((number[one][whole], number[other][whole]))
        a, b = (np.concatenate(ends) for ends in zip(*links, strict=True))
        return components(height * width, a, b).reshape(height, width)

    def _folded(self, normals: Floats, points: Floats, axis: int) -> Bools:
        """Where the surface folds inwards between a pixel and the next along an axis, as where a cup meets a table.

        Averaging rounds folds off, so the surfaces a few pixels to either side are compared.
        """
        n = normals.shape[axis]
        before = np.take(normals, np.maximum(np.arange(n - 1) - REACH, 0), axis)
        after = np.take(normals, np.minimum(np.arange(1, n) + REACH, n - 1), axis)
        step = np.take(points, np.minimum(np.arange(1, n) + REACH, n - 1), axis) - np.take(
            points, np.maximum(np.arange(n - 1) - REACH, 0), axis
        )
        inward = ((before - after) * step).sum(axis=2) > 0
        folded: Bools = ((before * after).sum(axis=2) < np.cos(np.radians(self.how.fold))) & inward
        return folded

    def _named(
        self, label: NDArray[np.intp], points: Floats, normals: Floats, known: Bools, frame: Frame
    ) -> tuple[list[Bools], list[str]]:
        numbers, counts = np.unique(label[known], return_counts=True)
        large = numbers[counts >= max(12, self.how.least * label.size)]
        masks = [(label == number) & known for number in large]
        return masks, [self._room_part(mask, points, normals, known, frame) for mask in masks]

    def _room_part(self, mask: Bools, points: Floats, normals: Floats, known: Bools, frame: Frame) -> str:
        """ "wall", "floor" or "ceiling" for a large plane with nothing behind it; else ""."""
        if mask.sum() < 0.01 * mask.size:
            return ""
        cloud = points[mask]
        middle = cloud.mean(axis=0)
        spread, axes = np.linalg.eigh(np.cov((cloud - middle).T))
        normal = axes[:, 0] if axes[:, 0] @ middle < 0 else -axes[:, 0]  # towards the camera
        sides = np.ptp((cloud - middle) @ axes, axis=0)
        if min(sides[1:]) < self.how.room_size or spread[0] > 0.05**2:
            return ""
        behind = ((points[known] - middle) @ normal < -0.15).mean()
        if behind > self.how.behind:
            return ""
        axis = "xyz".index(self.up[-1])
        upward = float((frame.T_world_camera[:3, :3] @ normal)[axis]) * (-1 if self.up[0] == "-" else 1)
        return "floor" if upward > 0.85 else "ceiling" if upward < -0.85 else "wall" if abs(upward) < 0.3 else ""


def smoothed(inverse: Floats, known: Bools, edge: float, rounds: int) -> Floats:
    """Inverse depth averaged within surfaces: a neighbour across an edge does not count."""
    made = inverse.copy()
    for _ in range(rounds):
        total, weight = made.copy(), known.astype(np.float32)
        for one, other in ((np.s_[:, :-1], np.s_[:, 1:]), (np.s_[:-1, :], np.s_[1:, :])):
            near = known[one] & known[other] & (np.abs(made[one] - made[other]) < edge)
            total[one] += np.where(near, made[other], 0)
            total[other] += np.where(near, made[one], 0)
            weight[one] += near
            weight[other] += near
        made = (total / np.maximum(weight, 1)).astype(np.float32)
    return made


def normals_of(inverse: Floats, known: Bools, lens: NDArray[np.float64]) -> Floats:
    """(h, w, 3) unit normals in camera axes, towards the camera: 1/z = a u + b v + c on a plane gives them."""
    height, width = inverse.shape
    across, down = np.zeros_like(inverse), np.zeros_like(inverse)
    across[:, 2:-2] = (inverse[:, 4:] - inverse[:, :-4]) / 4
    down[2:-2] = (inverse[4:] - inverse[:-4]) / 4
    u = np.arange(width, dtype=np.float32)[None, :] - np.float32(lens[0, 2])
    v = np.arange(height, dtype=np.float32)[:, None] - np.float32(lens[1, 2])
    normals = np.stack(
        [-across * np.float32(lens[0, 0]), -down * np.float32(lens[1, 1]), across * u + down * v - inverse], axis=2
    )
    length = np.linalg.norm(normals, axis=2, keepdims=True)
    return np.where(known[:, :, None], normals / np.maximum(length, 1e-9), 0).astype(np.float32)


def color_histograms(rgb: Floats, masks: list[Bools]) -> Floats | None:
    """(n, BINS ** 3) float32 of unit length: the roots of the shares of colours under each mask."""
    if not masks:
        return None
    level = np.clip(rgb * (BINS / 256), 0, BINS - 1).astype(np.intp)
    code = (level[:, :, 0] * BINS + level[:, :, 1]) * BINS + level[:, :, 2]
    made = np.array([np.bincount(code[mask], minlength=BINS**3) for mask in masks], np.float32)
    roots: Floats = np.sqrt(made / made.sum(axis=1, keepdims=True)).astype(np.float32)
    return roots


def _points(inverse: Floats, known: Bools, lens: NDArray[np.float64]) -> Floats:
    height, width = inverse.shape
    z = np.where(known, 1 / np.maximum(inverse, 1e-6), 0)
    x = (np.arange(width, dtype=np.float32)[None, :] - np.float32(lens[0, 2])) / np.float32(lens[0, 0]) * z
    y = (np.arange(height, dtype=np.float32)[:, None] - np.float32(lens[1, 2])) / np.float32(lens[1, 1]) * z
    return np.stack([x, y, z], axis=2).astype(np.float32)


def _averaged(rgb: NDArray[np.uint8], by: int) -> Floats:
    """(h / by, w / by, 3) float32: the mean of 3 x 3 pixels about each that is kept."""
    small = rgb[::by, ::by].astype(np.float32)
    made = small.copy()
    made[1:-1] = (small[:-2] + small[1:-1] + small[2:]) / 3
    across = made.copy()
    across[:, 1:-1] = (made[:, :-2] + made[:, 1:-1] + made[:, 2:]) / 3
    return across


def _none(frame: Frame) -> Bools:
    return np.zeros((0, *frame.depth.shape), np.bool_)
