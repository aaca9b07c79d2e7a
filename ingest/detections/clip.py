"""What a crop looks like, as a vector: CLIP, into whose space texts can be brought, or DINOv2."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from cgdb.errors import EncoderError
from cgdb.ingest.detections.models import device_of, loaded, transformers

BATCHES = {"cuda": 128}
BATCH = 32
TEXTS = 256
ENCODERS = {
    "openai/clip-vit-base-patch32": "open_clip:ViT-B-32:openai",
    "openai/clip-vit-base-patch16": "open_clip:ViT-B-16:openai",
    "openai/clip-vit-large-patch14": "open_clip:ViT-L-14:openai",
    "laion/CLIP-ViT-H-14-laion2B-s32B-b79K": "open_clip:ViT-H-14:laion2b_s32b_b79k",
}
"""{name on the hub: the encoder of texts with the same weights}."""


def load_describer(name: str) -> PictureEncoder:
    """The model of that name, CLIP or DINOv2 by what its configuration says. MissingExtraError, EncoderError."""
    _, library = transformers()
    kind = loaded(library.AutoConfig, name).model_type
    if kind not in ("clip", "dinov2"):
        raise EncoderError(f"the model '{name}' is a {kind}; crops are described by a clip or dinov2")
    model = loaded(library.CLIPModel if kind == "clip" else library.Dinov2Model, name)
    words = loaded(library.AutoTokenizer, name) if kind == "clip" else None
    return PictureEncoder(model, loaded(library.AutoImageProcessor, name), name, words)


class PictureEncoder:
    """A describer. model: a CLIPModel or Dinov2Model; processor: its image processor; words: a clip's tokenizer."""

    def __init__(self, model: Any, processor: Any, name: str, words: Any = None) -> None:
        self._torch, _ = transformers()
        self._device, self._dtype = device_of(self._torch)
        self._model = model.to(self._device, self._dtype).eval()
        self._processor, self._words = processor, words
        self._known: dict[str, NDArray[np.float32]] = {}
        self.space = "clip" if model.config.model_type == "clip" else "dinov2"
        self.encoder = ENCODERS.get(name)
        self.name = f"{self.space} ({name})"

    def __call__(self, crops: list[NDArray[np.uint8]]) -> NDArray[np.float32]:
        """(n, d) float32 of unit length."""
        parts = []
        with self._torch.inference_mode():
            size = BATCHES.get(self._device.type, BATCH)
            for start in range(0, len(crops), size):
                inputs = self._processor(images=crops[start : start + size], return_tensors="pt")
                parts.append(self._features(inputs["pixel_values"].to(self._device, self._dtype)).float().cpu().numpy())
        return _unit(np.concatenate(parts))

    def texts(self, texts: Sequence[str]) -> NDArray[np.float32]:
        """(n, d) float32 of unit length in the same space; each text is encoded once. EncoderError without words."""
        if self._words is None:
            raise EncoderError(f"{self.name} does not encode texts")
        new = [text for text in dict.fromkeys(texts) if text not in self._known]
        with self._torch.inference_mode():
            for start in range(0, len(new), TEXTS):
                batch = new[start : start + TEXTS]
                inputs = self._words(batch, padding=True, truncation=True, return_tensors="pt").to(self._device)
                # The two halves of get_text_features, as below.
                pooled = self._model.text_model(**inputs).pooler_output
                vectors = _unit(self._model.text_projection(pooled).float().cpu().numpy())
                self._known.update(zip(batch, vectors, strict=True))
        return np.stack([self._known[text] for text in texts])

    def _features(self, pixels: Any) -> Any:
        if self.space == "dinov2":
            return self._model(pixel_values=pixels).last_hidden_state[:, 0]
        # The two halves of get_image_features, whose result is a tensor or a record depending on the version.
        return self._model.visual_projection(self._model.vision_model(pixel_values=pixels).pooler_output)


def _unit(vectors: NDArray[np.float32]) -> NDArray[np.float32]:
    made: NDArray[np.float32] = vectors / np.maximum(np.linalg.norm(vectors, axis=1, keepdims=True), 1e-12)
    return made
