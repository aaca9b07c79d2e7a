"""CLIP by way of open_clip: texts and pictures into the space that a map's image features live in."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from cgdb.errors import EncoderError, MissingExtraError, did_you_mean, one_of

if TYPE_CHECKING:
    from PIL.Image import Image

PIP_LINE = "pip install 'cgdb[clip]'"
TEXTS_AT_ONCE = 256
PICTURES_AT_ONCE = 32

Item = TypeVar("Item")


class OpenClip:
    """Both towers of one open_clip model: on the first CUDA device in float16, else on the CPU in float32."""

    def __init__(self, model: str, weights: str, *, device: str | None = None) -> None:
        """model: a name that open_clip knows. weights: a tag that it knows for the model, or a checkpoint's path.

        A tag's weights are downloaded by open_clip, once. A checkpoint is read as tensors only: one that would run
        code is refused. device: as torch names it, chosen here when None.
        """
        torch, open_clip = _packages()
        _check_names(open_clip, model, weights)
        self.name = f"open_clip:{model}:{weights}"
        self._torch = torch
        self._device = device or ("cuda" if torch.cuda.is_available() else "cpu")
        half = self._device.startswith("cuda")
        try:
            towers, _, prepare = open_clip.create_model_and_transforms(
                model,
                pretrained=weights,
                precision="fp16" if half else "fp32",
                device=self._device,
                weights_only=True,
            )
            self._tokenize = open_clip.get_tokenizer(model)
        except Exception as reason:  # noqa: BLE001  open_clip, torch and the hub's client raise errors of many kinds
            raise EncoderError(
                f"open_clip cannot load {model} with the weights '{weights}': {_one_line(reason)}",
                hint="the weights must be reachable, undamaged and made for this model",
            ) from None
        self._prepare: Callable[[Image], Any] = prepare
        self._number = torch.float16 if half else torch.float32
        self._towers = towers.eval()
        self.dimension = int(self.texts([""]).shape[1])

    @classmethod
    def named(cls, rest: str) -> OpenClip:
        """The model of an id's "MODEL:WEIGHTS"."""
        model, colon, weights = rest.partition(":")
        if not model or not colon or not weights:
            raise EncoderError(
                f"'open_clip:{rest[:100]}' does not name a model and its weights",
                hint="write open_clip:MODEL:WEIGHTS, such as open_clip:ViT-H-14:laion2b_s32b_b79k",
            )
        return cls(model, weights)

    def texts(self, texts: Sequence[str]) -> NDArray[np.float32]:
        """(n, d) float32, rows of length 1. What is longer than the model's context, 77 tokens mostly, is cut."""

        def encode(batch: Sequence[str]) -> Any:
            return self._towers.encode_text(self._tokenize(list(batch)).to(self._device))

        return self._run(encode, texts, TEXTS_AT_ONCE)

    def pictures(self, pictures: Sequence[Image | Path]) -> NDArray[np.float32]:
        """(n, d) float32, rows of length 1. A picture is a PIL image or the path of a file."""

        def encode(batch: Sequence[Image | Path]) -> Any:
            pixels = self._torch.stack([self._prepare(_rgb(picture)) for picture in batch])
            return self._towers.encode_image(pixels.to(self._device, self._number))

        return self._run(encode, pictures, PICTURES_AT_ONCE)

    def _run(self, encode: Callable[[Sequence[Item]], Any], items: Sequence[Item], most: int) -> NDArray[np.float32]:
        parts = []
        with self._torch.inference_mode():
            for batch in _batches(items, most):
                features = encode(batch).float()
                # In float32: the squares of float16 features overflow.
                features = features / features.norm(dim=-1, keepdim=True)
                parts.append(features.cpu().numpy())
        if not parts:
            return np.empty((0, self.dimension), np.float32)
        vectors: NDArray[np.float32] = np.concatenate(parts).astype(np.float32, copy=False)
        if not np.isfinite(vectors).all():
            raise EncoderError(f"{self.name} gives vectors that are not finite: its weights are damaged")
        return vectors


def _packages() -> tuple[Any, Any]:
    """torch and open_clip, imported."""
    try:
        import open_clip
        import torch
    except ImportError as missing:
        raise MissingExtraError(
            f"CLIP needs the packages open_clip_torch and torch ({_one_line(missing)})", hint=PIP_LINE
        ) from None
    except Exception as reason:  # noqa: BLE001  a torchvision of another torch raises RuntimeError when it is imported
        raise EncoderError(
            f"open_clip cannot be imported: {_one_line(reason)}",
            hint="torch and torchvision must be releases that go together",
        ) from None
    return torch, open_clip


def _check_names(open_clip: Any, model: str, weights: str) -> None:
    """Only names that open_clip lists, and files: an id comes from a map, and must not make it fetch anything else."""
    models = open_clip.list_models()
    if model not in models:
        raise EncoderError(
            f"open_clip knows no model '{model[:100]}'", hint=did_you_mean(model, models) or f"known: {one_of(models)}"
        )
    tags = open_clip.list_pretrained_tags_by_model(model)
    if weights not in tags and not Path(weights).is_file():
        raise EncoderError(
            f"'{weights[:200]}' is neither weights that open_clip knows for {model} nor a file",
            hint=did_you_mean(weights, tags) or (f"known: {one_of(tags)}" if tags else "give the path of a checkpoint"),
        )


def _rgb(picture: Image | Path) -> Image:
    if not isinstance(picture, (str, Path)):
        return picture.convert("RGB")
    import PIL.Image

    try:
        with PIL.Image.open(picture) as opened:
            return opened.convert("RGB")
    except (OSError, ValueError, SyntaxError, PIL.Image.DecompressionBombError) as reason:
        raise EncoderError(f"{picture} is not a picture that can be read: {_one_line(reason)}") from None


def _batches(items: Sequence[Item], most: int) -> Iterator[Sequence[Item]]:
    for start in range(0, len(items), most):
        yield items[start : start + most]


def _one_line(reason: BaseException) -> str:
    return str(reason).strip().partition("\n")[0][:200] or type(reason).__name__
