"""Numbers behind degrees: contrast with a background, log-odds, vectors of length 1."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float32]


def contrast(cosines: Floats, background: Floats) -> Floats:
    """How many standard deviations each cosine lies above those of the background with the same question."""
    if len(background) == 0:
        return np.zeros_like(cosines)
    spread = max(float(background.std()), 1e-3)
    return np.asarray((cosines - np.float32(background.mean())) / np.float32(spread), dtype=np.float32)


def contrast_others(cosines: Floats) -> Floats:
    """How many standard deviations each cosine lies above those of all the others: the scene is its own background.

    Leaving each out of its own background matters in small scenes, where one right answer would move the mean.
    """
    n = len(cosines)
    if n < 3:
        return np.zeros_like(cosines)
    x = cosines.astype(np.float64)
    mean = (x.sum() - x) / (n - 1)
    variance = np.maximum((np.square(x).sum() - np.square(x)) / (n - 1) - np.square(mean), 0.0)
    return np.asarray((x - mean) / np.maximum(np.sqrt(variance), 0.02), dtype=np.float32)


def normalised(vectors: Floats) -> Floats:
    """Rows scaled to length 1, float32; zero rows stay zero."""
    lengths = np.linalg.norm(vectors, axis=1, keepdims=True)
    return np.asarray(vectors / np.where(lengths > 0, lengths, 1.0), dtype=np.float32)


def unit(vector: Floats) -> Floats:
    """A vector scaled to length 1."""
    scaled: Floats = normalised(np.asarray(vector, dtype=np.float32)[None])[0]
    return scaled


def probability(odds: Floats) -> Floats:
    """The degrees of log-odds."""
    return np.asarray(1.0 / (1.0 + np.exp(-odds)), dtype=np.float32)


def log_odds(degree: Floats) -> Floats:
    """The log-odds of degrees, which are kept off 0 and 1."""
    clipped = np.clip(degree, 1e-3, 1.0 - 1e-3)
    return np.asarray(np.log(clipped / (1.0 - clipped)), dtype=np.float32)
