"""Segment Anything, 1 or 2, asked with a grid of points (the paper's CG) or with boxes (its CG-D)."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from cgdb.errors import EncoderError
from cgdb.ingest.detections.detections import boxes_of
from cgdb.ingest.detections.models import Proposals, device_of, loaded, transformers
from cgdb.ingest.detections.overlap import distinct

AT_ONCE = 48
"""Masks that are brought to the size of the picture at a time: each takes 4 MB on the way, and 4 bytes a pixel."""
BOXES = 32
POINTS = {"cuda": 144}
FEWER_POINTS = 36


@dataclass(frozen=True, slots=True, kw_only=True)
class Grid:
    """The paper's settings: points along a side, what quality the model must expect of its mask, how little the mask
    may change with its threshold, how much boxes may overlap, and the least pixels. batch: points at a time; None: what
    the device can well do."""

    side: int = 12
    quality: float = 0.88
    stability: float = 0.95
    offset: float = 1.0
    overlap: float = 0.7
    least_area: int = 100
    batch: int | None = None


def load_sam(name: str) -> Sam:
    """The model of that name. MissingExtraError; EncoderError where it cannot be had, or is another kind of model."""
    _, library = transformers()
    kind = loaded(library.AutoConfig, name).model_type
    classes = {"sam": ("SamModel", "SamProcessor")}
    # Checkpoints of SAM 2 are published as trackers, of which the model of single pictures is a part.
    classes |= dict.fromkeys(("sam2", "sam2_video"), ("Sam2Model", "Sam2Processor"))
    if kind not in classes:
        raise EncoderError(f"the model '{name}' is a {kind}; masks are made by a sam or sam2")
    if not hasattr(library, classes[kind][0]):
        raise EncoderError(f"the model '{name}' needs a newer transformers", hint="pip install -U transformers")
    model, processor = (loaded(getattr(library, which), name) for which in classes[kind])
    return Sam(model, processor, name)


class Sam:
    """Masks for prompts. model: a SamModel or Sam2Model; processor: its own."""

    def __init__(self, model: Any, processor: Any, name: str) -> None:
        self._torch, _ = transformers()
        self.device, self._dtype = device_of(self._torch)
        self._model = model.to(self.device, self._dtype).eval()
        self._processor = processor
        self.name = f"segment anything ({name})"

    def ask(self, rgb: NDArray[np.uint8], kind: str, prompts: list[Any]) -> Asked:
        """Look at a picture (h, w, 3) once, for all prompts.

        kind: "input_points", each prompt [[x, y]], or "input_boxes", each [left, top, right, bottom], in pixels.
        """
        inputs = self._processor(images=rgb, return_tensors="pt", **{kind: [prompts]})
        return Asked(
            model=self._model,
            processor=self._processor,
            embedding=self._model.get_image_embeddings(inputs["pixel_values"].to(self.device, self._dtype)),
            kind=kind,
            prompts=inputs[kind].to(self.device, self._dtype),
            original=inputs["original_sizes"],
            reshaped=inputs.get("reshaped_input_sizes"),
        )


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Asked:
    """A picture that was looked at, with prompts in the model's own pixels."""

    model: Any
    processor: Any
    embedding: Any
    kind: str
    prompts: Any
    original: Any
    reshaped: Any

    def answers(self, batch: int) -> Iterator[tuple[Any, Any]]:
        """(masks (k, 3, h', w') as logits, their expected quality (k, 3)) for batches of the prompts, in order."""
        for start in range(0, self.prompts.shape[1], batch):
            some = {self.kind: self.prompts[:, start : start + batch]}
            answer = self.model(image_embeddings=self.embedding, multimask_output=True, **some)
            yield answer.pred_masks[0], answer.iou_scores[0].float()

    def enlarged(self, logits: Any) -> Iterator[Any]:
        """Logits (k, h', w') at the size of the picture, some at a time."""
        for start in range(0, len(logits), AT_ONCE):
            some = [logits[start : start + AT_ONCE, None].float()]
            if self.reshaped is None:
                (made,) = self.processor.post_process_masks(some, self.original, binarize=False)
            else:
                enlarge = self.processor.image_processor.post_process_masks
                (made,) = enlarge(some, self.original, self.reshaped, binarize=False)
            yield made[:, 0]


class SamGrid:
    """A segmenter: every point of a grid asks for the things under it, and what is sure, firm and new stays."""

    def __init__(self, sam: Sam, grid: Grid | None = None) -> None:
        self._sam = sam
        self.grid = grid or Grid()
        self.name = sam.name

    def __call__(self, rgb: NDArray[np.uint8]) -> Proposals:
        """The masks of a picture."""
        grid = self.grid
        height, width = rgb.shape[:2]
        steps = (np.arange(grid.side) + 0.5) / grid.side
        points = np.stack(np.meshgrid(steps * width, steps * height), axis=-1).reshape(-1, 1, 2).tolist()
        masks, scores = [np.zeros((0, height, width), np.bool_)], [np.zeros(0, np.float32)]
        with transformers()[0].inference_mode():
            asked = self._sam.ask(rgb, "input_points", points)
            for logits, quality in asked.answers(grid.batch or POINTS.get(self._sam.device.type, FEWER_POINTS)):
                # What is not sure is most of it, and is not worth enlarging.
                sure = quality >= grid.quality
                rest = quality[sure]
                for full in asked.enlarged(logits[sure]):
                    these, rest = rest[: len(full)], rest[len(full) :]
                    inner = (full > grid.offset).flatten(1).sum(1).float()
                    outer = (full > -grid.offset).flatten(1).sum(1).float()
                    good = inner / outer.clamp(min=1) >= grid.stability
                    good &= (full > 0).flatten(1).sum(1) >= grid.least_area
                    masks.append((full[good] > 0).cpu().numpy())
                    scores.append(these[good].cpu().numpy())
        found, sure_of = np.concatenate(masks), np.concatenate(scores)
        kept = distinct(boxes_of(found), sure_of, grid.overlap)
        confidence = np.clip(sure_of[kept], 0, 1).astype(np.float32)
        return Proposals(masks=found[kept], confidence=confidence, labels=("",) * len(kept))


def masks_of_boxes(sam: Sam, rgb: NDArray[np.uint8], boxes: NDArray[np.float32]) -> NDArray[np.bool_]:
    """(n, h, w) bool: for each box (left, top, right, bottom) the best of the model's three masks."""
    made = [np.zeros((0, *rgb.shape[:2]), np.bool_)]
    if len(boxes):
        torch = transformers()[0]
        with torch.inference_mode():
            asked = sam.ask(rgb, "input_boxes", boxes.tolist())
            for logits, quality in asked.answers(BOXES):
                best = quality.argmax(1)
                chosen = logits[torch.arange(len(best), device=logits.device), best]
                made += [(full > 0).cpu().numpy() for full in asked.enlarged(chosen)]
    return np.concatenate(made)
