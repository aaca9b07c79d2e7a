"""Grounding DINO: boxes of the things that are named to it, and a segmenter of it and Segment Anything (CG-D)."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from cgdb.errors import EncoderError
from cgdb.ingest.detections.detections import BACKGROUND
from cgdb.ingest.detections.models import Proposals, device_of, loaded, transformers
from cgdb.ingest.detections.overlap import distinct
from cgdb.ingest.detections.sam import Sam, masks_of_boxes
from cgdb.ingest.detections.tags import Tagger

KINDS = ("grounding-dino", "mm-grounding-dino")


@dataclass(frozen=True, slots=True, kw_only=True)
class Finding:
    """The paper's thresholds: how sure a box must be, how sure its name, and how much boxes may overlap."""

    box: float = 0.25
    text: float = 0.25
    overlap: float = 0.5


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Found:
    """xyxy (n, 4) float32 pixels, confidence (n,) float32, labels: n of the names that were asked for."""

    xyxy: NDArray[np.float32]
    confidence: NDArray[np.float32]
    labels: tuple[str, ...]


def load_finder(name: str, rules: Finding | None = None) -> GroundingDino:
    """The model of that name. MissingExtraError; EncoderError where it cannot be had, or is another kind of model."""
    _, library = transformers()
    kind = loaded(library.AutoConfig, name).model_type
    if kind not in KINDS:
        raise EncoderError(f"the model '{name}' is a {kind}; names are found by a {' or '.join(KINDS)}")
    model = loaded(library.AutoModelForZeroShotObjectDetection, name)
    return GroundingDino(model, loaded(library.AutoProcessor, name), name, rules)


class GroundingDino:
    """Finds names in pictures. model: a GroundingDinoForObjectDetection or its MM kin; processor: its own."""

    def __init__(self, model: Any, processor: Any, name: str, rules: Finding | None = None) -> None:
        self._torch, _ = transformers()
        # Its attention samples at places that half precision rounds by pixels: single, on any device.
        self._device, _ = device_of(self._torch)
        self._model = model.to(self._device).eval()
        self._pictures, self._words = processor.image_processor, processor.tokenizer
        self._longest = int(getattr(model.config, "max_text_len", 256))
        self.rules = rules or Finding()
        self.name = f"grounding dino ({name})"

    def __call__(self, rgb: NDArray[np.uint8], names: Sequence[str]) -> Found:
        """The boxes of the names in a picture (h, w, 3). More names than one prompt holds are asked in several."""
        height, width = rgb.shape[:2]
        parts: list[tuple[NDArray[np.float32], NDArray[np.float32], list[str]]] = []
        with self._torch.inference_mode():
            picture = self._pictures(images=rgb, return_tensors="pt").to(self._device)
            for asked, ids, spans in self._prompts(names):
                tokens = self._torch.tensor([ids], device=self._device)
                answer = self._model(
                    **picture,
                    input_ids=tokens,
                    token_type_ids=self._torch.zeros_like(tokens),
                    attention_mask=self._torch.ones_like(tokens),
                )
                sure = answer.logits[0].float().sigmoid().cpu().numpy()
                parts.append(self._named(sure, answer.pred_boxes[0].float().cpu().numpy(), asked, spans))
        boxes = np.concatenate([part[0] for part in parts]) if parts else np.zeros((0, 4), np.float32)
        scores = np.concatenate([part[1] for part in parts]) if parts else np.zeros(0, np.float32)
        labels = [label for part in parts for label in part[2]]
        half = boxes[:, 2:] / 2
        corners = np.concatenate([boxes[:, :2] - half, boxes[:, :2] + half], axis=1).clip(0, 1)
        corners *= np.array([width, height, width, height], np.float32)
        kept = distinct(corners, scores, self.rules.overlap)
        return Found(
            xyxy=corners[kept].astype(np.float32), confidence=scores[kept], labels=tuple(labels[i] for i in kept)
        )

    def _named(
        self, sure: NDArray[np.float32], boxes: NDArray[np.float32], names: list[str], spans: list[tuple[int, int]]
    ) -> tuple[NDArray[np.float32], NDArray[np.float32], list[str]]:
        """The boxes (centre and sides, as shares of the picture) that are sure, and of each the likeliest name.

        sure (queries, tokens). A box is as sure as its surest word; a name as likely as its words are on average, so
        that "table" alone does not make a table a coffee table.
        """
        mean = np.stack([sure[:, a:b].mean(axis=1) for a, b in spans], axis=1)
        most = np.stack([sure[:, a:b].max(axis=1) for a, b in spans], axis=1)
        which, confidence = mean.argmax(axis=1), most.max(axis=1)
        good = (confidence > self.rules.box) & (most[np.arange(len(most)), which] > self.rules.text)
        rows = np.flatnonzero(good)
        return boxes[rows], confidence[rows].astype(np.float32), [names[which[row]] for row in rows]

    def _prompts(self, names: Sequence[str]) -> Iterator[tuple[list[str], list[int], list[tuple[int, int]]]]:
        """(names, token ids, where each name lies in them) of prompts "name. name. ", as many as it takes."""
        words = self._words
        (dot,) = words.convert_tokens_to_ids(["."])
        asked: list[str] = []
        spans: list[tuple[int, int]] = []
        ids = [words.cls_token_id]
        for name in names:
            # A full stop would part the name in two.
            plain = " ".join(name.casefold().replace(".", " ").replace("?", " ").split())
            tokens = words(plain, add_special_tokens=False)["input_ids"][: self._longest - 3]
            if not tokens:
                continue
            if asked and len(ids) + len(tokens) + 2 > self._longest:
                yield asked, [*ids, words.sep_token_id], spans
                asked, spans, ids = [], [], [words.cls_token_id]
            asked.append(name)
            spans.append((len(ids), len(ids) + len(tokens)))
            ids += [*tokens, dot]
        if asked:
            yield asked, [*ids, words.sep_token_id], spans


class NamedThings:
    """A segmenter: what a tagger names, where a finder finds it, in the shape that Segment Anything gives it.

    Walls, floor and ceiling are always asked for, so that the map knows them as the room.
    """

    def __init__(self, tagger: Tagger, finder: GroundingDino, sam: Sam) -> None:
        self._tagger, self._finder, self._sam = tagger, finder, sam
        self.name = f"{tagger.name}, {finder.name}, {sam.name}"

    def __call__(self, rgb: NDArray[np.uint8]) -> Proposals:
        """The masks of a picture, with names."""
        names = list(dict.fromkeys([*self._tagger(rgb), *sorted(BACKGROUND)]))
        found = self._finder(rgb, names)
        masks = masks_of_boxes(self._sam, rgb, found.xyxy)
        return Proposals(masks=masks, confidence=found.confidence.clip(0, 1), labels=found.labels)
