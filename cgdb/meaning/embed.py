"""The seam of the encoders: what an encoder is, and which one makes the vectors that a map or a store names.

An encoder is named by an id, "SCHEME" or "SCHEME:REST". The scheme picks a factory of the registry; the rest is its
business. Modules are imported when they are asked for, so that a store without texts loads none of them.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Protocol, TypeAlias, runtime_checkable

import numpy as np
from numpy.typing import NDArray

from cgdb.errors import EncoderError, did_you_mean, one_of

if TYPE_CHECKING:
    from PIL.Image import Image

TEXT_MODEL = "all-MiniLM-L6-v2"
"""The encoder of captions and tags, unless a store was made with another."""


class Encoder(Protocol):
    """Brings texts into one vector space.

    name: the stable id of the space; vectors of two names are never compared. dimension: d.
    """

    @property
    def name(self) -> str: ...

    @property
    def dimension(self) -> int: ...

    def texts(self, texts: Sequence[str]) -> NDArray[np.float32]:
        """(n, d) float32, each row of length 1."""
        ...


@runtime_checkable
class PictureEncoder(Encoder, Protocol):
    """Brings pictures into the same space as texts."""

    def pictures(self, pictures: Sequence[Image | Path]) -> NDArray[np.float32]:
        """(n, d) float32, each row of length 1."""
        ...


Factory: TypeAlias = Callable[[str], Encoder]


def text_encoder(name: str = TEXT_MODEL) -> Encoder:
    """The encoder of captions and tags with this name. EncoderError or MissingExtraError where it cannot be had."""
    return space_encoder(name)


def space_encoder(encoder_id: str) -> Encoder:
    """The encoder that a feature space names: "open_clip:MODEL:WEIGHTS", "vocabulary:PATH" or a text model's name.

    EncoderError for an id that is not known, MissingExtraError where its packages or its model are not installed.
    """
    scheme, _, rest = encoder_id.partition(":")
    factory = ENCODERS.get(scheme)
    if factory is None:
        raise EncoderError(
            f"no encoder is known by the name '{encoder_id[:100]}'",
            hint=did_you_mean(scheme, ENCODERS) or f"known: {one_of(ENCODERS)}",
        )
    return factory(rest)


def _minilm(rest: str) -> Encoder:
    from cgdb.meaning.minilm import MiniLM

    if rest:
        raise EncoderError(f"'{TEXT_MODEL}' takes nothing after its name, but '{rest[:100]}' was given")
    return MiniLM.load()


def _open_clip(rest: str) -> Encoder:
    from cgdb.meaning.clip import OpenClip

    return OpenClip.named(rest)


def _vocabulary(rest: str) -> Encoder:
    from cgdb.meaning.vocabulary import Vocabulary

    return Vocabulary.load(rest)


ENCODERS: dict[str, Factory] = {
    TEXT_MODEL: _minilm,
    f"sentence-transformers/{TEXT_MODEL}": _minilm,
    "open_clip": _open_clip,
    "vocabulary": _vocabulary,
}
"""Scheme -> factory. A program of your own adds its encoders here."""
