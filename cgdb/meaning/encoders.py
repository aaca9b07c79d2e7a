"""The encoders that a process has at hand: loaded when first needed; why one cannot be had is remembered."""

from __future__ import annotations

import re
import threading
from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from cgdb.errors import CgdbError, EncoderError
from cgdb.meaning import background
from cgdb.meaning.embed import TEXT_MODEL, Encoder, space_encoder
from cgdb.meaning.shared_vectors import SharedVectors
from cgdb.scene import FeatureSpace
from cgdb.storage.text_vectors import TextVectors

Floats = NDArray[np.float32]

_BY_NAME = re.compile(r"(open_clip:[\w-]+:[\w-]+|(sentence-transformers/)?[\w-]+)(\.\w+)*", re.ASCII)
"""What a map may name: a model and its weights by name, never a file of this machine."""


class Encoders:
    """Vectors of texts, by caption encoder and by feature space; each text is encoded once and kept in the store."""

    def __init__(
        self,
        kept: TextVectors,
        *,
        text: Encoder | str | None = TEXT_MODEL,
        spaces: Mapping[str, Encoder] | None = None,
    ) -> None:
        """text: the encoder of captions, or its name, or None to do without. spaces: {feature space: its encoder}."""
        self.kept = kept
        self._shared = SharedVectors(kept)
        self._text = text
        self._spaces: dict[str, Encoder | CgdbError] = dict(spaces or {})
        self._loaded: dict[str, Encoder | CgdbError] = {}
        self._asked: dict[tuple[str, str], Floats] = {}
        self._lock = threading.RLock()

    def text(self) -> Encoder | CgdbError | None:
        """The caption encoder, or why there is none; None where the store does without."""
        if self._text is None or not isinstance(self._text, str):
            return self._text
        return self._load(self._text)

    def space(self, space: FeatureSpace) -> Encoder | CgdbError | None:
        """The encoder of a feature space, or why there is none; None where the map does not say what made it."""
        if space.name in self._spaces:
            return self._spaces[space.name]
        if space.encoder is None:
            return None
        if not _BY_NAME.fullmatch(space.encoder):
            return EncoderError(
                f"the map names '{space.encoder[:100]}' as its encoder, which is no model's name",
                hint="a map may not have files opened; name the encoder yourself: space_encoders={...}, --encoder",
            )
        return self._load(space.encoder)

    def questions(self, encoder: Encoder, texts: Sequence[str]) -> Floats:
        """(n, d) the vectors of texts that were asked: remembered by this process, not kept in the store."""
        with self._lock:
            new = [text for text in dict.fromkeys(texts) if (encoder.name, text) not in self._asked]
            if new:
                if len(self._asked) > 1_000:
                    self._asked.clear()
                    new = list(dict.fromkeys(texts))
                made = encoder.texts(new)
                self._asked.update({(encoder.name, text): vector for text, vector in zip(new, made, strict=True)})
            return np.stack([self._asked[(encoder.name, text)] for text in texts])

    def question(self, encoder: Encoder, text: str) -> Floats:
        """(d,) the vector of one text that was asked."""
        return np.asarray(self.questions(encoder, [text])[0])

    def known(self, name: str, texts: Sequence[str]) -> Floats | None:
        """(n, d) float32 what the store keeps of these texts by the encoder of that name, NaN rows for the others."""
        return _known(self.kept, name, texts)

    def encode(self, encoder: Encoder, texts: Sequence[str]) -> Floats:
        """(n, d) float32 the vectors of texts of a store; what had to be encoded is kept in it."""
        return _encoded(self.kept, encoder, texts)

    def background(self, encoder: Encoder) -> Floats:
        """(u, d) float32 the vectors of the phrases that every question is compared with."""
        return _encoded(self.keeper(encoder), encoder, background.texts())

    def keeper(self, encoder: Encoder) -> TextVectors | SharedVectors:
        """What keeps the vectors of the background: all stores of the user share those of the model that we know.

        Any other encoder may change under its name.
        """
        known = self._text == TEXT_MODEL and self._loaded.get(TEXT_MODEL) is encoder
        return self._shared if known else self.kept

    def close(self) -> None:
        """Give files back; a later call opens them again."""
        self._shared.close()

    def _load(self, name: str) -> Encoder | CgdbError:
        with self._lock:
            if name not in self._loaded:
                try:
                    self._loaded[name] = space_encoder(name)
                except CgdbError as error:
                    self._loaded[name] = error
            return self._loaded[name]


def _known(kept: TextVectors | SharedVectors, name: str, texts: Sequence[str]) -> Floats | None:
    found = kept.get(name, list(texts))
    if not found:
        return None
    matrix = np.full((len(texts), len(next(iter(found.values())))), np.nan, np.float32)
    for row, text in enumerate(texts):
        if text in found:
            matrix[row] = found[text]
    return matrix


def _encoded(kept: TextVectors | SharedVectors, encoder: Encoder, texts: Sequence[str]) -> Floats:
    """(n, d) float32 the vectors of texts; what had to be encoded is kept."""
    matrix = _known(kept, encoder.name, texts)
    if matrix is not None and not np.isnan(matrix).any():
        return matrix
    unknown = np.ones(len(texts), bool) if matrix is None else np.isnan(matrix).any(axis=1)
    missing = list(dict.fromkeys(texts[row] for row in np.flatnonzero(unknown).tolist()))
    kept.put(encoder.name, missing, encoder.texts(missing))
    matrix = _known(kept, encoder.name, texts)
    if matrix is None or np.isnan(matrix).any():  # what cannot be written keeps nothing
        return encoder.texts(list(texts))
    return matrix
