"""What may be in a picture, as names: a list, the nearest of a list by CLIP, or the words of a caption.

RAM and Tag2Text, which the paper's CG-D asks, are no part of transformers; these stand in for them.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from pathlib import Path
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from cgdb.errors import EncoderError
from cgdb.ingest.detections.clip import PictureEncoder
from cgdb.ingest.detections.models import device_of, loaded, transformers
from cgdb.meaning.names import read_names

NEAREST, CAPTION = "clip:", "caption:"
PROMPT = "a photo of a {}"
TILES = (1, 2, 3)
"""Parts along a side in which a picture is looked at: small things are lost in the whole."""

_WORDS = """a about above across against all along an and another are around as at back background be beside between big
    black blue brown bunch by close closeup couple dark different down each few filled for from front full gray green
    grey group has have having her him his home house image in indoors inside interior into is it its kitchen large left
    light little living lot lots lying made many middle modern more near next of off office old on one open orange other
    out over pair part photo picture piece pink placed purple red right room row scene set several side sitting small
    some stand standing such that the their them there these they this three to together top two under up very view wall
    white with yellow"""
NO_THINGS = frozenset(_WORDS.split())
"""Words of captions that name no thing that could be pointed at."""


class Tagger(Protocol):
    """Names what may be in a picture."""

    name: str

    def __call__(self, rgb: NDArray[np.uint8]) -> Sequence[str]:
        """The names for a picture (h, w, 3)."""
        ...


class ListedTags:
    """Always the same names."""

    def __init__(self, names: Sequence[str]) -> None:
        self._names = tuple(names)
        self.name = f"{len(names)} names"

    def __call__(self, rgb: NDArray[np.uint8]) -> Sequence[str]:
        """The names."""
        return self._names


class ClipTags:
    """Of a list, the names nearest to the picture or to one of its parts."""

    def __init__(self, names: Sequence[str], clip: PictureEncoder, *, most: int = 40) -> None:
        self._names, self._clip, self._most = tuple(names), clip, most
        self._vectors = clip.texts([PROMPT.format(name) for name in names])
        self.name = f"the nearest {most} of {len(names)} names"

    def __call__(self, rgb: NDArray[np.uint8]) -> Sequence[str]:
        """The names of this picture, the nearest first."""
        near = (self._clip(tiles(rgb)) @ self._vectors.T).max(axis=0)
        return [self._names[i] for i in np.argsort(-near, kind="stable")[: self._most].tolist()]


class CaptionTags:
    """The words of a caption. model: an image-to-text model such as BLIP; processor: its own."""

    def __init__(self, model: Any, processor: Any, name: str) -> None:
        self._torch, _ = transformers()
        self._device, self._dtype = device_of(self._torch)
        self._model = model.to(self._device, self._dtype).eval()
        self._processor = processor
        self.name = f"words of captions ({name})"

    def __call__(self, rgb: NDArray[np.uint8]) -> Sequence[str]:
        """The words of the captions of the picture and its parts that may be things."""
        with self._torch.inference_mode():
            pixels = self._processor.image_processor(images=tiles(rgb, (1, 2)), return_tensors="pt")["pixel_values"]
            ids = self._model.generate(
                pixel_values=pixels.to(self._device, self._dtype), max_new_tokens=30, do_sample=False
            )
        return words_of(self._processor.batch_decode(ids, skip_special_tokens=True))


def load_tagger(what: str, clip: PictureEncoder) -> Tagger:
    """A tagger of FILE, clip:FILE or caption:MODEL; FormatError, EncoderError, MissingExtraError."""
    names = listed(what)
    if names is None:
        _, library = transformers()
        model = what.removeprefix(CAPTION)
        auto = getattr(library, "AutoModelForImageTextToText", None) or library.AutoModelForVision2Seq
        return CaptionTags(loaded(auto, model), loaded(library.AutoProcessor, model), model)
    return ClipTags(names, check_texts(clip)) if what.startswith(NEAREST) else ListedTags(names)


def listed(what: str) -> list[str] | None:
    """The names that FILE or clip:FILE lists; None for caption:MODEL. FormatError."""
    return None if what.startswith(CAPTION) else read_names(Path(what.removeprefix(NEAREST)))


def tiles(rgb: NDArray[np.uint8], sides: Sequence[int] = TILES) -> list[NDArray[np.uint8]]:
    """The picture in n x n parts for each of sides, each a little larger, so that what lies on a border is whole."""
    height, width = rgb.shape[:2]
    made = []
    for n in sides:
        more = 0.0 if n == 1 else 0.25 / n
        edges = [(max(0.0, i / n - more), min(1.0, (i + 1) / n + more)) for i in range(n)]
        made += [
            rgb[int(t * height) : max(int(b * height), 1), int(left * width) : max(int(r * width), 1)]
            for t, b in edges
            for left, r in edges
        ]
    return made


def words_of(captions: Sequence[str]) -> list[str]:
    """The words of captions that may name things, each once."""
    found = [word for text in captions for word in re.findall(r"[a-z]{3,}", text.casefold())]
    return [word for word in dict.fromkeys(found) if word not in NO_THINGS]


def check_texts(clip: PictureEncoder) -> PictureEncoder:
    """The describer, where it can encode texts; EncoderError where it cannot."""
    if clip.space == "clip":
        return clip
    raise EncoderError("tags by CLIP need a clip to describe crops, not a dinov2", hint="clip=MODEL of kind clip")
