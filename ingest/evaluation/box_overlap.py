"""How much boxes have in common: 3D intersection over union, exact however they are turned."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from cgdb.ingest.relations import polyhedra
from cgdb.ingest.relations.boxes import THINNEST, Boxes, Floats, Ints, near_pairs, overlap_area, prisms

_CHUNK = 1 << 15
_CHUNK_TILTED = 1 << 10
"""Pairs that are worked out at a time; of boxes that do not stand upright each takes a hundred times as much."""
_UPRIGHT = 1.0 - 1e-9
"""Cosine, to the up axis, of one of the axes of a box that stands upright."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Overlaps:
    """first, second (p,): the rows of boxes that have something in common, by rows. iou (p,): above 0."""

    first: Ints
    second: Ints
    iou: Floats


def overlaps(boxes: Boxes, others: Boxes, up: str) -> Overlaps:
    """The pairs of one of n boxes and one of m others that meet; points meet nothing. THINNEST is the least side."""
    n = len(boxes.centers)
    both = _together(boxes, others)
    shapes = prisms(both, up)
    met = near_pairs(shapes, across=THINNEST, upright=THINNEST, crowd=len(both.centers))
    mixed = (met.first < n) & (met.second >= n) & ~shapes.points[met.first] & ~shapes.points[met.second]
    first, second = met.first[mixed], met.second[mixed]
    common = np.zeros(len(first))
    tilted = np.zeros(len(both.centers), np.bool_)
    if both.rotations is not None:
        tilted = np.abs(both.rotations[:, "xyz".index(up[-1])]).max(axis=1) < _UPRIGHT
    slanting = tilted[first] | tilted[second]
    extents = np.maximum(both.extents, THINNEST)
    bottom = (shapes.low + shapes.high - shapes.height) / 2
    top = bottom + shapes.height
    for some in _chunks(np.flatnonzero(~slanting), _CHUNK):
        a, b = first[some], second[some]
        height = np.minimum(top[a], top[b]) - np.maximum(bottom[a], bottom[b])
        common[some] = overlap_area(shapes, a, b) * np.maximum(height, 0.0)
    for some in _chunks(np.flatnonzero(slanting), _CHUNK_TILTED):
        assert both.rotations is not None
        one, two = ((both.centers[i], extents[i], both.rotations[i]) for i in (first[some], second[some]))
        common[some] = polyhedra.intersection(one, two)
    volume = extents.prod(axis=1)
    iou = common / (volume[first] + volume[second] - common)
    meet = iou > 0
    return Overlaps(first=first[meet], second=second[meet] - n, iou=iou[meet])


def _chunks(rows: Ints, size: int) -> list[Ints]:
    return [rows[start : start + size] for start in range(0, len(rows), size)]


def _together(boxes: Boxes, others: Boxes) -> Boxes:
    def rotations(some: Boxes) -> Floats:
        return np.tile(np.eye(3), (len(some.centers), 1, 1)) if some.rotations is None else some.rotations

    turned = boxes.rotations is not None or others.rotations is not None
    return Boxes(
        centers=np.concatenate([boxes.centers, others.centers]),
        extents=np.concatenate([boxes.extents, others.extents]),
        rotations=np.concatenate([rotations(boxes), rotations(others)]) if turned else None,
    )
