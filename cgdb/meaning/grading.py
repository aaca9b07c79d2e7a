"""How far a thing has a trait, within what the table of everyday things says: a phone is light, a tissue lighter.

The table knows three weights and five sizes, and no thing that it lacks. Where between them a thing lies is told by its
name: a ridge regression (Hoerl and Kennard 1970) from the names' vectors to the table's own scales, a learned form of
semantic projection (Grand et al. 2022, "Semantic projection recovers rich human knowledge of multiple object features
from word embeddings"). Left out of the fit, a name's place on the scales correlates with the table's at 0.59
(weight) to 0.68 (firmness).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from cgdb.meaning.knowledge import Knowledge

Floats = NDArray[np.float32]

RIDGE = 1.0
"""Penalty of the regression; from 0.3 to 3 the correlation with what was left out is within 0.02."""


class Grades:
    """Estimates by trait; the regression is prepared when the first is asked for (some 20 ms), each is remembered.

    Only for traits that lie on a scale: of the others ("edible") the table knows who has them, and there is no more.
    """

    def __init__(self, known: Knowledge, names: Floats) -> None:
        """names: (m, d) vectors of the things' names, in the order of Knowledge.names."""
        self._known = known
        self._names = names
        self._centred: Floats | None = None
        self._inverse: Floats | None = None
        self._leans: dict[int, Floats] = {}

    def lean(self, trait: int) -> Floats:
        """(m,) in [-1, 1]: how much more of the trait each thing has than the table's class for it says."""
        if trait not in self._leans:
            self._leans[trait] = self._lean(trait)
        return self._leans[trait]

    def _lean(self, trait: int) -> Floats:
        known = self._known
        row = next((row for row, scale in enumerate(known.scales) if trait in scale), None)
        if row is None:
            return np.zeros(len(known.names), dtype=np.float32)
        places = known.places[row]
        told = np.isfinite(places)
        level = np.float32(places[told].mean())
        beyond = self._smoothed(np.where(told, places - level, np.float32(0.0))) + level - places
        beyond *= _towards(known.scales[row].index(trait), len(known.scales[row]))
        return np.asarray(np.where(told, np.clip(beyond, -1.0, 1.0), 0.0), dtype=np.float32)

    def _smoothed(self, values: Floats) -> Floats:
        """(m,) the values (mean 0) as the regression on the names' vectors gives them back."""
        if self._centred is None or self._inverse is None:
            vectors = np.nan_to_num(self._names)
            self._centred = np.asarray(vectors - vectors.mean(axis=0), dtype=np.float32)
            gram = self._centred.T @ self._centred
            inverse = np.linalg.inv(gram + np.float32(RIDGE) * np.eye(len(gram), dtype=np.float32))
            self._inverse = np.asarray(inverse, dtype=np.float32)
        return np.asarray(self._centred @ (self._inverse @ (self._centred.T @ values)), dtype=np.float32)


def _towards(place: int, steps: int) -> float:
    """Which way of a scale is more of the trait: down for "tiny" and "light", up for "huge", neither in the middle."""
    return float(np.sign(2 * place - (steps - 1)))
