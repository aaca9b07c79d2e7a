"""Eight corners of a box, as Open3D orders them, to its center, extent and rotation."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from cgdb.errors import FormatError, SceneError
from cgdb.ingest import fields
from cgdb.ingest.report import Report

Floats = NDArray[np.float64]
SIGNS = np.array(
    [[-1, -1, -1], [1, -1, -1], [-1, 1, -1], [-1, -1, 1], [1, 1, 1], [-1, 1, 1], [1, -1, 1], [1, 1, -1]],
    dtype=np.float64,
)
"""(8, 3): on which side of the center each corner lies along each of the box's own axes."""
THINNEST = 1e-9
"""Metres. A side below it has no direction of its own."""


def box(value: object, where: str, report: Report) -> tuple[Floats, Floats | None, Floats | None]:
    """(center, extent, rotation) of (8, 3) corners in metres; rotation None for a box along the scene's axes.

    extent None for a box without size. Corners that span no box give the axis-aligned hull, with a warning.
    """
    if not isinstance(value, np.ndarray) or value.shape != (8, 3) or value.dtype.kind not in "fiu":
        raise FormatError(f"{where}: the box must be 8 corners of 3 coordinates, not {fields.shown(value)}")
    corners = value.astype(np.float64)
    if not np.isfinite(corners).all():
        raise SceneError(f"{where}: the corners of the box hold NaN or infinite coordinates")
    center = corners.mean(axis=0)
    axes = (corners[1:4] - corners[0]).T
    spanned = center + SIGNS @ axes.T / 2.0
    lengths = np.linalg.norm(axes, axis=0)
    scale = float(lengths.max())
    if scale < THINNEST and np.ptp(corners, axis=0).max() < THINNEST:
        report.warn(f"{where}: its box has no size; it is taken for a point")
        return center, None, None
    rotation = _rotation(axes, lengths)
    if rotation is None or np.abs(spanned - corners).max() > 1e-3 * scale + 1e-6:
        report.warn(f"{where}: the corners of its box are not in order; their axis-aligned hull is taken")
        low, high = corners.min(axis=0), corners.max(axis=0)
        return (low + high) / 2.0, high - low, None
    order = _axis_order(rotation)
    if order is not None:
        extent = np.zeros(3)
        extent[order] = lengths
        return center, extent, None
    return center, lengths, rotation


def _rotation(axes: Floats, lengths: Floats) -> Floats | None:
    """The right-handed orthonormal matrix nearest to the axes (columns), or None when they are no box's."""
    known = lengths > THINNEST
    units = np.where(known, axes / np.where(known, lengths, 1.0), 0.0)
    cosines = units.T @ units - np.diag(known.astype(np.float64))
    if np.abs(cosines).max() > 0.02:
        return None
    # The polar factor; a side without length gets the direction that is left over.
    u, _, vt = np.linalg.svd(units)
    rotation: Floats = u @ vt
    if np.linalg.det(rotation) < 0:
        # A box is its own mirror image: turning one axis round changes nothing but the handedness.
        flipped = int(np.argmin(lengths))
        rotation[:, flipped] = -rotation[:, flipped]
    return rotation


def _axis_order(rotation: Floats) -> NDArray[np.intp] | None:
    """For a box along the scene's axes: the scene axis of each box axis; else None."""
    nearest: NDArray[np.intp] = np.abs(rotation).argmax(axis=0)
    straight = np.abs(rotation[nearest, range(3)]).min() > 1.0 - 1e-12
    return nearest if straight and len(set(nearest.tolist())) == 3 else None
