"""What ``o ~ "text"`` means as a number: a degree in [0, 1] per object, 0.5 being the line between fits and not."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from cgdb.texts import Source, TextIndex

Floats = NDArray[np.float32]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Meaning:
    """What is looked for: a text, its vector in the caption encoder's space, its vectors in the image spaces.

    text may be None (a picture, another object); vector (384,) and features {space: (d,)} are normalised or not.
    """

    text: str | None = None
    vector: Floats | None = None
    features: Mapping[str, Floats] = field(default_factory=dict)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Space:
    """The image features of a scene in one space: keys (n,) int64, vectors (n, d) float32.

    background: (m, d) vectors of background.texts() by the space's text encoder, or None where there is none.
    """

    keys: NDArray[np.int64]
    vectors: Floats
    background: Floats | None = None


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Evidence:
    """keys (n,) int64; degree (n,) float32, all evidence together; parts: {evidence: (n,) float32, NaN = has none}."""

    keys: NDArray[np.int64]
    degree: Floats
    parts: Mapping[str, Floats]

    def of(self, key: int) -> float:
        """The degree of one object; 0 for a key that the scene does not have."""
        row = int(np.searchsorted(self.keys, key))
        return float(self.degree[row]) if row < len(self.keys) and int(self.keys[row]) == key else 0.0


@dataclass(frozen=True, slots=True, kw_only=True)
class Calibration:
    """The line (z-score at degree 0.5) and the slope of each evidence, and what each counts for when fused."""

    line: Mapping[str, float] = field(default_factory=lambda: {"name": 2.0, "caption": 2.0, "image": 2.0, "words": 0.5})
    slope: Mapping[str, float] = field(
        default_factory=lambda: {"name": 1.5, "caption": 1.5, "image": 1.5, "words": 6.0}
    )
    weight: Mapping[str, float] = field(
        default_factory=lambda: {"name": 0.6, "caption": 0.4, "image": 0.7, "words": 0.5}
    )


class Scorer:
    """Degrees of meanings over one scene; built once per scene, then a matrix-vector product per question."""

    def __init__(
        self,
        index: TextIndex,
        *,
        embeddings: Floats | None = None,
        background: Floats | None = None,
        spaces: Mapping[str, Space] | None = None,
        calibration: Calibration | None = None,
    ) -> None:
        """embeddings: (index.n_encoded, d) rows of index.texts, NaN rows where not yet encoded.

        background: (m, d) vectors of background.texts() by the same encoder; without it, the scene's own texts.
        """
        self.index = index
        self.keys = index.keys
        self._calibration = calibration or Calibration()
        self._embeddings = embeddings
        self._background = background
        entry_rows = index.rows_of_entries()
        self._groups: dict[str, tuple[NDArray[np.int32], NDArray[np.int32], NDArray[np.int64]]] = {}
        for name, wanted in (("name", (Source.NAME, Source.HEAD)), ("caption", (Source.CAPTION, Source.PROPERTY))):
            chosen = np.isin(index.sources, wanted)
            rows = entry_rows[chosen]
            first = (
                np.flatnonzero(np.concatenate(([True], rows[1:] != rows[:-1]))) if len(rows) else np.zeros(0, np.int64)
            )
            self._groups[name] = (rows[first], index.text_ids[chosen], first)
        self._spaces = {}
        for name, space in (spaces or {}).items():
            place = np.searchsorted(self.keys, space.keys)
            known = (place < len(self.keys)) & (self.keys[np.minimum(place, len(self.keys) - 1)] == space.keys)
            vectors = normalised(space.vectors if known.all() else space.vectors[known])
            self._spaces[name] = (
                rows[known],
                vectors,
                None if space.background is None else normalised(space.background),
            )

    def degrees(self, meaning: Meaning) -> Evidence:
        """The degree of every object for one meaning."""
        parts: dict[str, Floats] = {}
        n = len(self.keys)
        if meaning.text is not None:
            words = self.index.words.degrees(meaning.text)
            parts["words"] = self._calibrated("words", words)
        if meaning.vector is not None and self._embeddings is not None:
            query = normalised(meaning.vector[None])[0]
            cosines = self._embeddings @ query
            against = (self._background @ query) if self._background is not None else cosines[np.isfinite(cosines)]
            z = contrast(cosines, against)
            for name, (rows, texts, first) in self._groups.items():
                part = np.full(n, np.nan, dtype=np.float32)
                if len(rows):
                    part[rows] = np.fmax.reduceat(z[texts], first)
                parts[name] = self._calibrated(name, part)
        for name, query in meaning.features.items():
            if name not in self._spaces:
                continue
            space_rows, vectors, background = self._spaces[name]
            query = normalised(query[None])[0]
            cosines = vectors @ query
            part = np.full(n, np.nan, dtype=np.float32)
            part[space_rows] = contrast(cosines, cosines if background is None else background @ query)
            parts[f"image:{name}"] = self._calibrated("image", part)
        return Evidence(keys=self.keys, degree=self._fused(parts), parts=parts)

    def explain(self, evidence: Evidence, key: int) -> dict[str, object]:
        """Which evidence said what about one object, for the rows that are shown."""
        row = int(np.searchsorted(self.keys, key))
        found = {name: round(float(part[row]), 3) for name, part in evidence.parts.items() if np.isfinite(part[row])}
        return {"degree": round(float(evidence.degree[row]), 3), "evidence": found}

    def _calibrated(self, name: str, values: Floats) -> Floats:
        line, slope = self._calibration.line[name], self._calibration.slope[name]
        return np.asarray(1.0 / (1.0 + np.exp(-slope * (values - line))), dtype=np.float32)

    def _fused(self, parts: Mapping[str, Floats]) -> Floats:
        total = np.zeros(len(self.keys), dtype=np.float32)
        mass = np.zeros(len(self.keys), dtype=np.float32)
        for name, part in parts.items():
            weight = self._calibration.weight[name.partition(":")[0]]
            known = np.isfinite(part)
            clipped = np.clip(np.where(known, part, 0.5), 0.001, 0.999)
            total += np.float32(weight) * np.log(clipped / (1.0 - clipped)) * known
            mass += np.float32(weight) * known
        degree = 1.0 / (1.0 + np.exp(-total / np.maximum(mass, 1e-6)))
        return np.where(mass > 0, degree, 0.0).astype(np.float32)


def normalised(vectors: Floats) -> Floats:
    """Rows scaled to length 1 (zero rows stay zero), float32."""
    lengths = np.linalg.norm(vectors, axis=1, keepdims=True)
    return np.asarray(vectors / np.where(lengths > 0, lengths, 1.0), dtype=np.float32)


def contrast(cosines: Floats, background: Floats) -> Floats:
    """How many standard deviations each cosine lies above those of the background with the same question."""
    if len(background) == 0:
        return np.zeros_like(cosines)
    return np.asarray((cosines - background.mean()) / max(float(background.std()), 1e-3), dtype=np.float32)
