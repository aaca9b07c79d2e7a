"""Detections by models: something that proposes masks, something that says what a picture looks like, put together.

The models are those of the paper's class-agnostic variant, loaded through transformers: Segment Anything with a grid of
points for masks, CLIP (or DINOv2) for crops. Anything with the same two calls will do.
"""

from __future__ import annotations

from dataclasses import dataclass
from importlib import import_module
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from cgdb.errors import EncoderError, MissingExtraError
from cgdb.ingest.detections.detections import Detections, checked
from cgdb.ingest.frames.recording import Frame

PADDING = 20
"""Pixels round a box that are part of its crop, as in the reference."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Proposals:
    """masks (n, h, w) bool, confidence (n,) float32, labels n names ("" where unknown)."""

    masks: NDArray[np.bool_]
    confidence: NDArray[np.float32]
    labels: tuple[str, ...]


class Segmenter(Protocol):
    """Proposes masks for a picture."""

    name: str

    def __call__(self, rgb: NDArray[np.uint8]) -> Proposals:
        """The masks of a picture (h, w, 3)."""
        ...


class Describer(Protocol):
    """Turns pictures into vectors. encoder: what brings texts into the same space, None where nothing does."""

    name: str
    encoder: str | None
    space: str

    def __call__(self, crops: list[NDArray[np.uint8]]) -> NDArray[np.float32]:
        """(n, d) float32 for n pictures (h, w, 3), n at least 1."""
        ...


class ModelDetector:
    """A detector of a segmenter and a describer."""

    def __init__(self, segmenter: Segmenter, describer: Describer) -> None:
        self._segmenter, self._describer = segmenter, describer
        self.name = f"{segmenter.name}, {describer.name}"
        self.encoder = describer.encoder

    def __call__(self, frame: Frame) -> Detections:
        """The detections of a frame, with the features of their padded crops."""
        found = self._segmenter(frame.rgb)
        whole = np.flatnonzero(found.masks.any(axis=(1, 2)))
        masks = found.masks[whole]
        made = checked(
            masks,
            where=frame.name,
            confidence=found.confidence[whole],
            labels=[found.labels[i] for i in whole.tolist()],
        )
        if not len(made):
            return made
        features = self._describer([crop(frame.rgb, box) for box in made.xyxy])
        return checked(
            masks,
            where=frame.name,
            confidence=made.confidence,
            labels=made.labels,
            features=features,
            space=self._describer.space,
        )


def crop(rgb: NDArray[np.uint8], box: NDArray[np.float32]) -> NDArray[np.uint8]:
    """The part of a picture that a box (left, top, right, bottom) and PADDING round it show."""
    height, width = rgb.shape[:2]
    left, top, right, bottom = (int(side) for side in box)
    return rgb[
        max(0, top - PADDING) : min(height, bottom + PADDING), max(0, left - PADDING) : min(width, right + PADDING)
    ]


def load_detector(segmenter: str, describer: str) -> ModelDetector:
    """A detector of two models by their names on the Hugging Face hub, or folders they were saved to.

    MissingExtraError without transformers; EncoderError where a model cannot be had.
    """
    from cgdb.ingest.detections.clip import load_describer
    from cgdb.ingest.detections.sam import load_sam

    return ModelDetector(load_sam(segmenter), load_describer(describer))


def transformers() -> tuple[Any, Any]:
    """(torch, transformers). MissingExtraError where either is not installed."""
    try:
        torch, found = import_module("torch"), import_module("transformers")
    except ImportError as error:
        raise MissingExtraError(
            f"models need {error.name or 'torch and transformers'}, which is not installed",
            hint="pip install 'cgdb[models]'",
        ) from error
    return torch, found


def loaded(kind: Any, name: str) -> Any:
    """A model or processor of a class, by name. EncoderError where it cannot be had."""
    try:
        return kind.from_pretrained(name)
    except (OSError, ValueError, KeyError) as error:
        first = (str(error) or type(error).__name__).splitlines()[0][:200]
        raise EncoderError(
            f"the model '{name}' cannot be loaded: {first}", hint="the name of a model on the hub, or a folder"
        ) from error


def device_of(torch: Any) -> tuple[Any, Any]:
    """(device, dtype): the first GPU and half precision where there is one, else the processor and single."""
    if torch.cuda.is_available():
        return torch.device("cuda"), torch.float16
    return torch.device("cpu"), torch.float32
