"""What was detected in one frame: the type, its rules, and the filter that every detector's output goes through."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from cgdb.errors import FormatError
from cgdb.ingest.detections.overlap import common
from cgdb.ingest.frames.recording import Frame, nearest

BACKGROUND = frozenset({"wall", "floor", "ceiling"})
"""Classes that are the room, not things in it."""
MOST = 10_000
"""Detections in one frame; above it the file is damaged."""
MOST_PIXELS = 2 << 30
"""Of all masks of a frame, a byte each: a few bytes of run lengths, packed bits or labels can stand for terabytes."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Detections:
    """Aligned arrays of one frame.

    masks (n, h, w) bool; xyxy (n, 4) float32 pixels, the lower right corner excluded; confidence (n,) float32;
    labels n names, "" where unknown; features (n, d) float32 of what the masks show, text_features (n, e) float32 of
    the labels, rows of unit length; None where the detector gives none.
    """

    masks: NDArray[np.bool_]
    xyxy: NDArray[np.float32]
    confidence: NDArray[np.float32]
    labels: tuple[str, ...]
    features: NDArray[np.float32] | None = None
    text_features: NDArray[np.float32] | None = None
    space: str = "clip"
    """The name of the feature space; that of the labels' features is the same with _text."""

    def __len__(self) -> int:
        return len(self.masks)

    def take(self, rows: Sequence[int] | NDArray[np.intp]) -> Detections:
        """These detections, in this order."""
        index = np.asarray(rows, np.intp)
        return Detections(
            masks=self.masks[index],
            xyxy=self.xyxy[index],
            confidence=self.confidence[index],
            labels=tuple(self.labels[i] for i in index.tolist()),
            features=None if self.features is None else self.features[index],
            text_features=None if self.text_features is None else self.text_features[index],
            space=self.space,
        )


class Detector(Protocol):
    """Whatever gives the detections of a frame: files made earlier, geometry, or models."""

    name: str
    encoder: str | None
    """The encoder of the features, by which texts find them; None where unknown or without features."""

    def __call__(self, frame: Frame) -> Detections:
        """The detections of a frame; FormatError where the frame's cannot be had, which is then a bad frame."""
        ...


def checked(
    masks: NDArray[np.generic],
    *,
    where: str,
    xyxy: NDArray[np.generic] | None = None,
    confidence: NDArray[np.generic] | None = None,
    labels: Sequence[str] | None = None,
    features: NDArray[np.generic] | None = None,
    text_features: NDArray[np.generic] | None = None,
    space: str = "clip",
) -> Detections:
    """Detections of arrays that come from a file: aligned, finite, features brought to unit length; FormatError."""
    n = len(masks) if masks.ndim else MOST + 1
    if n > MOST or (n and masks.ndim != 3) or masks.dtype.kind not in "biuf":
        raise FormatError(f"{where}: masks have shape {masks.shape} of {masks.dtype}, expected (n, height, width)")
    made = np.ascontiguousarray(masks if masks.dtype == np.bool_ else masks != 0) if n else np.zeros((0, 1, 1), bool)
    if xyxy is None or not n:
        boxes = boxes_of(made)
    elif xyxy.shape != (n, 4) or xyxy.dtype.kind not in "fiu" or not np.isfinite(xyxy).all():
        raise FormatError(f"{where}: {n} masks but boxes of shape {xyxy.shape}, or boxes that are not finite")
    else:
        boxes = np.clip(xyxy, 0, [made.shape[2], made.shape[1]] * 2).astype(np.float32)
    if confidence is not None and confidence.dtype.kind not in "biuf":
        raise FormatError(f"{where}: the confidences are no numbers but {confidence.dtype}")
    sure = np.ones(n) if confidence is None else confidence.astype(np.float64).reshape(-1)
    names = tuple(labels) if labels is not None else ("",) * n
    if len(sure) != n or len(names) != n:
        raise FormatError(f"{where}: {n} masks but {len(sure)} confidences and {len(names)} labels")
    return Detections(
        masks=made,
        xyxy=boxes,
        confidence=np.clip(np.nan_to_num(sure), 0.0, 1.0).astype(np.float32),
        labels=names,
        features=_unit(features, n, where, "features"),
        text_features=_unit(text_features, n, where, "text features"),
        space=space,
    )


def check_room(n: int, pixels: int, where: str) -> None:
    """FormatError where n masks of so many pixels are more than a frame can have, before they are unfolded."""
    if n > MOST or n * pixels > MOST_PIXELS:
        raise FormatError(f"{where}: {n} masks of {pixels:,} pixels are more than a frame can have")


def boxes_of(masks: NDArray[np.bool_]) -> NDArray[np.float32]:
    """(n, 4) float32 pixels: the smallest boxes round masks (n, h, w); all 0 where a mask is empty."""
    boxes = np.zeros((len(masks), 4), np.float32)
    for row, mask in enumerate(masks):
        across, down = np.flatnonzero(mask.any(axis=0)), np.flatnonzero(mask.any(axis=1))
        if len(across):
            boxes[row] = across[0], down[0], across[-1] + 1, down[-1] + 1
    return boxes


@dataclass(frozen=True, slots=True, kw_only=True)
class Selection:
    """Which detections are worth lifting: pixels of the mask, share of the picture, confidence, and containment.

    A mask loses what lies in another's box when that box is mostly inside its own and is not mostly the same:
    inside of at least `contained` of the smaller and less than `covers` of the larger.
    """

    least_area: int = 25
    largest_share: float = 0.5
    least_confidence: float = 0.0
    contained: float = 0.8
    covers: float = 0.7
    subtract: bool = True
    skip_background: bool = False


def select(found: Detections, frame: Frame, rules: Selection) -> Detections:
    """The detections that pass the rules, masks at the frame's size and without what they contain."""
    height, width = frame.depth.shape
    if len(found) and found.masks.shape[1:] != (height, width):
        found = _resized(found, frame)
    kept = []
    for row, (x1, y1, x2, y2) in enumerate(found.xyxy.tolist()):
        background = found.labels[row] in BACKGROUND
        too_large = (x2 - x1) * (y2 - y1) > rules.largest_share * width * height
        if (
            (background and rules.skip_background)
            or (too_large and not background)
            or found.confidence[row] < rules.least_confidence
            or np.count_nonzero(found.masks[row]) < rules.least_area
        ):
            continue
        kept.append(row)
    chosen = found.take(kept)
    if rules.subtract and len(chosen) > 1:
        _subtract_contained(chosen, rules)
    return chosen


def _subtract_contained(found: Detections, rules: Selection) -> None:
    # The masks are a copy by now. Boxes decide, and the masks as they were are what is taken away.
    box = found.xyxy
    shared = common(box)
    area = np.maximum(np.diagonal(shared), 1e-6)
    inner = (shared / area[:, None] < rules.covers) & (shared / area[None, :] > rules.contained)
    pairs = np.argwhere(inner)
    windows, before = {}, {}
    for b in set(pairs[:, 1].tolist()):
        x1, y1, x2, y2 = (max(0, int(v)) for v in box[b])
        windows[b] = np.s_[y1 : y2 + 1, x1 : x2 + 1]
        before[b] = ~found.masks[b][windows[b]]
    for a, b in pairs.tolist():
        found.masks[a][windows[b]] &= before[b]


def _resized(found: Detections, frame: Frame) -> Detections:
    height, width = frame.depth.shape
    old_height, old_width = found.masks.shape[1:]
    if abs(old_width * height - old_height * width) > 0.02 * old_width * height:
        raise FormatError(
            f"{frame.name}: masks of {old_width} x {old_height} do not fit a picture of {width} x {height}"
        )
    scale = np.array([width / old_width, height / old_height] * 2, np.float32)
    masks = np.stack([nearest(mask, (width, height)) for mask in found.masks])
    return replace(found, masks=masks, xyxy=found.xyxy * scale)


def _unit(values: NDArray[np.generic] | None, n: int, where: str, what: str) -> NDArray[np.float32] | None:
    if values is None or values.size == 0:
        return None
    if values.ndim != 2 or len(values) != n or values.dtype.kind not in "fiu":
        raise FormatError(f"{where}: {n} masks but {what} of shape {values.shape}")
    # In float64, where the length of no finite float32 overflows.
    made = values.astype(np.float64)
    if not (np.abs(made) <= np.finfo(np.float32).max).all():
        raise FormatError(f"{where}: {what} hold NaN or infinite values")
    length = np.linalg.norm(made, axis=1, keepdims=True)
    if (length < 1e-12).any():
        raise FormatError(f"{where}: {what} hold a vector without length")
    unit: NDArray[np.float32] = (made / length).astype(np.float32)
    return unit
