"""Segment Anything with a grid of points: every point asks for the things under it, and what is sure and new stays."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from cgdb.ingest.detections.models import Proposals, device_of, loaded, transformers


@dataclass(frozen=True, slots=True, kw_only=True)
class Grid:
    """The paper's settings: points along a side, what quality the model must expect of its mask, how little the mask
    may change with its threshold, how much boxes may overlap, and the least pixels. batch: points at a time."""

    side: int = 12
    quality: float = 0.88
    stability: float = 0.95
    offset: float = 1.0
    overlap: float = 0.7
    least_area: int = 100
    batch: int = 36


def load_sam(name: str, grid: Grid | None = None) -> SamGrid:
    """The model of that name. MissingExtraError, EncoderError."""
    _, library = transformers()
    return SamGrid(loaded(library.SamModel, name), loaded(library.SamProcessor, name), name, grid)


class SamGrid:
    """A segmenter. model: a SamModel; processor: its SamProcessor."""

    def __init__(self, model: Any, processor: Any, name: str, grid: Grid | None = None) -> None:
        self._torch, _ = transformers()
        self._device, self._dtype = device_of(self._torch)
        self._model = model.to(self._device, self._dtype).eval()
        self._processor = processor
        self.grid = grid or Grid()
        self.name = f"segment anything ({name})"

    def __call__(self, rgb: NDArray[np.uint8]) -> Proposals:
        """The masks of a picture."""
        torch, grid = self._torch, self.grid
        height, width = rgb.shape[:2]
        steps = (np.arange(grid.side) + 0.5) / grid.side
        points = np.stack(np.meshgrid(steps * width, steps * height), axis=-1).reshape(-1, 1, 2)
        masks, scores = [], []
        with torch.inference_mode():
            embedding = None
            for start in range(0, len(points), grid.batch):
                some = points[start : start + grid.batch]
                inputs = self._processor(rgb, input_points=[some.tolist()], return_tensors="pt")
                if embedding is None:
                    pixels = inputs["pixel_values"].to(self._device, self._dtype)
                    embedding = self._model.get_image_embeddings(pixels)
                answer = self._model(
                    image_embeddings=embedding,
                    input_points=inputs["input_points"].to(self._device, self._dtype),
                    multimask_output=True,
                )
                kept, sure = self._sure(answer, inputs)
                masks.append(kept)
                scores.append(sure)
        return _new_ones(np.concatenate(masks), np.concatenate(scores), grid)

    def _sure(self, answer: Any, inputs: Any) -> tuple[NDArray[np.bool_], NDArray[np.float32]]:
        """The masks of a batch of points that are good, firm and large enough, and the quality of each."""
        grid = self.grid
        quality = answer.iou_scores.float().reshape(-1)
        (logits,) = self._processor.image_processor.post_process_masks(
            answer.pred_masks.float().cpu(),
            inputs["original_sizes"],
            inputs["reshaped_input_sizes"],
            binarize=False,
        )
        logits = logits.reshape(-1, *logits.shape[-2:])
        inner = (logits > grid.offset).flatten(1).sum(1).float()
        outer = (logits > -grid.offset).flatten(1).sum(1).float()
        good = (quality.cpu() >= grid.quality) & (inner / outer.clamp(min=1) >= grid.stability)
        good &= (logits > 0).flatten(1).sum(1) >= grid.least_area
        return (logits[good] > 0).numpy(), quality.cpu()[good].numpy().astype(np.float32)


def _new_ones(masks: NDArray[np.bool_], scores: NDArray[np.float32], grid: Grid) -> Proposals:
    """Of masks whose boxes are much the same, the one of best quality."""
    from cgdb.ingest.detections.detections import boxes_of

    boxes = boxes_of(masks)
    area = np.prod(boxes[:, 2:] - boxes[:, :2], axis=1)
    kept: list[int] = []
    for row in np.argsort(-scores, kind="stable").tolist():
        low = np.maximum(boxes[kept, :2], boxes[row, :2])
        high = np.minimum(boxes[kept, 2:], boxes[row, 2:])
        common = np.prod(np.maximum(high - low, 0), axis=1)
        if not (common > grid.overlap * (area[kept] + area[row] - common)).any():
            kept.append(row)
    chosen = np.array(kept, np.intp)
    confidence = np.clip(scores[chosen], 0, 1).astype(np.float32)
    return Proposals(masks=masks[chosen], confidence=confidence, labels=("",) * len(kept))
