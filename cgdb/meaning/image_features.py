"""The evidence of image features: how much nearer a question is to an object's than everyday things are."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from cgdb.meaning.contrast import contrast_others, normalised

Floats = NDArray[np.float32]
Rows = NDArray[np.int64]

SMALL_GAP = 0.1
"""Below this difference of mean cosines a space keeps texts and images together, and texts measure both."""

AT_ONCE = 8192
"""Features that are compared with the background in one product."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Space:
    """The image features of a scene in one space: keys (n,) int64 ascending, vectors (n, d) float32.

    background: (m, d) vectors of background.names() by the space's text encoder. Without it (the encoder is not at
    hand, the question is a picture) the contrast is with the scene's own features: the best of this scene stand out,
    whether they are good or not.
    """

    keys: NDArray[np.int64]
    vectors: Floats
    background: Floats | None = None


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class TextBackground:
    """How near the everyday things' names are to each image: mean, spread (n,); and what tells a text from a picture.

    centre: (d,) the mean of the names' vectors. Texts lie together in such spaces and images elsewhere, so a question
    whose cosine with the centre reaches texts_from is a text; any other is a picture, and is measured by pictures.
    """

    mean: Floats
    spread: Floats
    centre: Floats
    texts_from: float

    @classmethod
    def of(cls, names: Floats, vectors: Floats, lengths: Floats) -> TextBackground:
        """Text and image features lie apart in such spaces: only images can be the measure of images.

        So each image is asked how near the everyday things are to it. names: (m, d) normalised.
        """
        mean, spread = np.zeros_like(lengths), np.ones_like(lengths)
        for start in range(0, len(lengths), AT_ONCE):
            rows = slice(start, start + AT_ONCE)
            cosines = (vectors[rows] @ names.T) / lengths[rows, None]
            mean[rows], spread[rows] = cosines.mean(axis=1), cosines.std(axis=1)
        centre = names.mean(axis=0)
        gap = float(centre @ centre) - float(mean.mean()) if len(mean) else 0.0
        return cls(
            mean=mean,
            spread=np.maximum(spread, np.float32(1e-3)),
            centre=centre,
            texts_from=float(mean.mean()) + gap / 2 if gap > SMALL_GAP else -1.0,
        )


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Images:
    """A space made ready: vectors (n, d) with their lengths (n,), and rows (k,): the vector of each node, or -1."""

    vectors: Floats
    lengths: Floats
    rows: Rows
    against: TextBackground | None

    @classmethod
    def of(cls, space: Space, keys: Rows) -> Images:
        """keys: (k,) those of all nodes, ascending."""
        lengths = np.sqrt(np.einsum("ij,ij->i", space.vectors, space.vectors))
        lengths = np.where(lengths > 0, lengths, 1.0).astype(np.float32)
        rows = np.full(len(keys), -1, dtype=np.int64)
        place = np.searchsorted(keys, space.keys)
        known = (place < len(keys)) & (keys[np.minimum(place, len(keys) - 1)] == space.keys)
        rows[place[known]] = np.flatnonzero(known)
        names = None if space.background is None else normalised(space.background)
        against = None if names is None else TextBackground.of(names, space.vectors, lengths)
        return cls(vectors=space.vectors, lengths=lengths, rows=rows, against=against)

    def deviations(self, query: Floats, chosen: Rows | None) -> Floats:
        """(k,) standard deviations above the background of a question (d,), of all nodes or of some; NaN: no image."""
        rows = self.rows if chosen is None else self.rows[chosen]
        cosines = (self.vectors @ query) / self.lengths
        if self.against is not None and float(self.against.centre @ query) >= self.against.texts_from:
            z = np.asarray((cosines - self.against.mean) / self.against.spread, dtype=np.float32)
        else:
            z = contrast_others(cosines)
        found = np.full(len(rows), np.nan, dtype=np.float32)
        found[rows >= 0] = z[rows[rows >= 0]]
        return found
