"""Detections by models: something that proposes masks, something that says what a picture looks like, put together.

The models are the paper's, loaded through transformers. For masks: Segment Anything with a grid of points (CG, `sam`),
or names that are found by Grounding DINO and cut out by Segment Anything (CG-D, `grounding` over `tags`). For crops:
CLIP or DINOv2 (`clip`). Anything with the same two calls will do.
"""

from __future__ import annotations

import logging
from collections.abc import Sequence
from dataclasses import dataclass
from importlib import import_module
from pathlib import Path
from typing import Any, Protocol, runtime_checkable

import numpy as np
from numpy.typing import NDArray

from cgdb.errors import EncoderError, MissingExtraError, UsageError, did_you_mean
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


@runtime_checkable
class TextDescriber(Describer, Protocol):
    """Turns texts into vectors of the same space, too."""

    def texts(self, texts: Sequence[str]) -> NDArray[np.float32]:
        """(n, d) float32 for n texts, of unit length."""
        ...


class ModelDetector:
    """A detector of a segmenter and a describer."""

    def __init__(self, segmenter: Segmenter, describer: Describer) -> None:
        self._segmenter, self._describer = segmenter, describer
        self.name = f"{segmenter.name}, {describer.name}"
        self.encoder = describer.encoder

    def __call__(self, frame: Frame) -> Detections:
        """The detections of a frame, with the features of their padded crops."""
        # torch shares memory with what it is given, and will not share what it may not write to.
        rgb = frame.rgb if frame.rgb.flags.writeable else frame.rgb.copy()
        found = self._segmenter(rgb)
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
        features = self._describer([crop(rgb, box) for box in made.xyxy])
        # Names have vectors too, by which the map tells things of different names apart.
        names = None
        if isinstance(self._describer, TextDescriber) and self._describer.space == "clip" and all(made.labels):
            names = self._describer.texts(made.labels)
        return checked(
            masks,
            where=frame.name,
            confidence=made.confidence,
            labels=made.labels,
            features=features,
            text_features=names,
            space=self._describer.space,
        )


def crop(rgb: NDArray[np.uint8], box: NDArray[np.float32]) -> NDArray[np.uint8]:
    """The part of a picture that a box (left, top, right, bottom) and PADDING round it show."""
    height, width = rgb.shape[:2]
    left, top, right, bottom = (int(side) for side in box)
    return rgb[
        max(0, top - PADDING) : min(height, bottom + PADDING), max(0, left - PADDING) : min(width, right + PADDING)
    ]


@dataclass(frozen=True, slots=True, kw_only=True)
class Choice:
    """Models by their names on the Hugging Face hub, or the folders that they were saved to.

    sam: what makes masks, a sam or sam2. clip: what describes crops, a clip or dinov2. tags: where the names of things
    come from: a FILE, clip:FILE (the nearest of it, frame by frame) or caption:MODEL; without them a grid of points
    asks sam for all that there is. dino: what finds named things. box, text, overlap: its thresholds.
    """

    sam: str = "facebook/sam-vit-huge"
    clip: str = "laion/CLIP-ViT-H-14-laion2B-s32B-b79K"
    dino: str | None = None
    tags: str | None = None
    box: float = 0.25
    text: float = 0.25
    overlap: float = 0.5


FINDER = "IDEA-Research/grounding-dino-tiny"
THRESHOLDS = ("box", "text", "overlap")


def chosen(text: str) -> Choice:
    """The models that "sam=MODEL,clip=MODEL,dino=MODEL,tags=FILE,box=0.25" names, all of it optional, or "SAM,CLIP".

    UsageError where it says something else.
    """
    parts = [part.strip() for part in text.split(",")] if text.strip() else []
    if parts and len(parts) <= 2 and all(not part or _names_a_model(part) for part in parts):
        parts = [f"{key}={part}" for key, part in zip(("sam", "clip"), parts, strict=False) if part]
    given: dict[str, Any] = {}
    for part in parts:
        key, equals, value = part.partition("=")
        if not equals or not value or key not in Choice.__dataclass_fields__ or key in given:
            known = ", ".join(f"{name}=" for name in Choice.__dataclass_fields__)
            wrong = "is given twice" if key in given else "is none of its parts"
            raise UsageError(
                f"models:{text[:100]}: '{part[:100]}' {wrong}",
                hint=did_you_mean(key, Choice.__dataclass_fields__) or f"NAME=VALUE, with commas between: {known}",
            )
        given[key] = _share(key, value) if key in THRESHOLDS else value
    if "tags" not in given and ("dino" in given or any(key in given for key in THRESHOLDS)):
        raise UsageError(
            f"models:{text[:100]}: Grounding DINO must be told what to look for",
            hint="tags=FILE with a name on each line, tags=clip:FILE or tags=caption:MODEL",
        )
    return Choice(**given)


def _names_a_model(part: str) -> bool:
    """Whether it is a name as the hub's, OWNER/NAME, or that of a folder."""
    return "=" not in part and ("/" in part or Path(part).is_dir())


def _share(key: str, value: str) -> float:
    try:
        share = float(value)
    except ValueError:
        share = -1.0
    if not 0 <= share <= 1:
        raise UsageError(f"{key}={value[:40]}: must be a number from 0 to 1")
    return share


def load_detector(choice: Choice) -> ModelDetector:
    """The detector of these models. MissingExtraError without transformers; EncoderError where one cannot be had."""
    from cgdb.ingest.detections.clip import load_describer
    from cgdb.ingest.detections.grounding import Finding, NamedThings, load_finder
    from cgdb.ingest.detections.sam import SamGrid, load_sam
    from cgdb.ingest.detections.tags import listed, load_tagger

    if choice.tags is None:
        return ModelDetector(SamGrid(load_sam(choice.sam)), load_describer(choice.clip))
    listed(choice.tags)  # a file that is wrong is told of before large models are loaded
    describer = load_describer(choice.clip)
    tagger = load_tagger(choice.tags, describer)
    finder = load_finder(choice.dino or FINDER, Finding(box=choice.box, text=choice.text, overlap=choice.overlap))
    return ModelDetector(NamedThings(tagger, finder, load_sam(choice.sam)), describer)


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
    hub = logging.getLogger("huggingface_hub")
    before = hub.level
    hub.setLevel(logging.ERROR)  # it tells of every try to reach a network that is not there
    try:
        return kind.from_pretrained(name)
    except ImportError as error:  # some processors are written with torchvision
        first = " ".join(str(error).split())[:120]
        raise MissingExtraError(
            f"the model '{name}' cannot be loaded: {first}", hint="pip install 'cgdb[models]'"
        ) from error
    except Exception as error:  # noqa: BLE001  transformers, torch and the hub's client raise errors of many kinds
        first = (str(error).strip() or type(error).__name__).splitlines()[0][:200]
        raise EncoderError(
            f"the model '{name}' cannot be loaded: {first}",
            hint="the name of a model on the hub, once downloaded with a network, or a folder it was saved to",
        ) from None
    finally:
        hub.setLevel(before)


def device_of(torch: Any) -> tuple[Any, Any]:
    """(device, dtype): the first GPU and half precision where there is one, else the processor and single."""
    if torch.cuda.is_available():
        return torch.device("cuda"), torch.float16
    return torch.device("cpu"), torch.float32
