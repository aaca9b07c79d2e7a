"""What the objects of a map look like: the sums of the features of their detections, a row for each object."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

import numpy as np
from numpy.typing import NDArray

from cgdb.errors import FormatError
from cgdb.ingest.detections.detections import Detections

Matrix = NDArray[np.float32]
_ROOM = 64
"""Rows that there is room for at least."""


class Features:
    """For each feature space a matrix of n rows, in the order of the objects; a row of zeros where there was none."""

    def __init__(self, *, renormalise: bool = False) -> None:
        """renormalise: the reference's variant of a mean, at unit length after every fold."""
        self.n = 0
        self._renormalise = renormalise
        self._sums: dict[str, Matrix] = {}
        self._units: dict[str, Matrix] = {}
        self._changed: dict[str, set[int]] = {}
        self._room = _ROOM

    def unit(self, space: str) -> Matrix | None:
        """(n, d) float32 the mean features, at unit length, until the next change; None where no detection had any."""
        sums = self._sums.get(space)
        if sums is None:
            return None
        unit, changed = self._units.get(space), sorted(self._changed.get(space, ()))
        if unit is None or len(unit) != len(sums):
            unit, changed = np.zeros_like(sums), list(range(self.n))
            self._units[space] = unit
        if changed:
            rows = sums[changed]
            unit[changed] = rows / np.maximum(np.linalg.norm(rows, axis=1, keepdims=True), 1e-12)
            self._changed[space] = set()
        return unit[: self.n]

    def looks(self) -> tuple[Matrix | None, Matrix | None]:
        """The mean features of what the objects look like, and of what they are called."""
        image = next((name for name in self._sums if not name.endswith("_text")), None)
        text = next((name for name in self._sums if name.endswith("_text")), None)
        return (None if image is None else self.unit(image)), (None if text is None else self.unit(text))

    def spaces(self) -> dict[str, int]:
        """{feature space: dimension}."""
        return {name: sums.shape[1] for name, sums in self._sums.items()}

    def sums(self) -> dict[str, Matrix]:
        """{space: (n, d) the sums of the features}."""
        return {name: sums[: self.n] for name, sums in self._sums.items()}

    def check(self, found: Detections, where: str) -> None:
        """FormatError where a frame's features are not of the dimensions of those before."""
        for space, values in _spaces_of(found):
            known = self._sums.get(space)
            if known is not None and values.shape[1] != known.shape[1]:
                raise FormatError(
                    f"{where}: features of {values.shape[1]} numbers, those before it had {known.shape[1]}"
                )

    def append(self) -> None:
        """One more object, of which no feature is known yet."""
        self.n += 1
        if self.n > self._room:
            self._make_room(2 * self._room)

    def add(self, at: int, found: Detections, source: int, before: int) -> None:
        """Fold the features of a detection into the object at `at`, into which so many were folded before."""
        for space, values in _spaces_of(found):
            if space not in self._sums:
                self._sums[space] = np.zeros((self._room, values.shape[1]), np.float32)
            sums = self._sums[space]
            sums[at] += values[source]
            self._changed.setdefault(space, set()).add(at)
            if self._renormalise:
                # Worth all the detections again.
                sums[at] *= (before + 1) / max(float(np.linalg.norm(sums[at])), 1e-12)

    def merge(self, into: NDArray[np.intp]) -> None:
        """Fold row i into row into[i] (itself: it stays; -1: it goes); those that stay keep their order."""
        each = np.arange(self.n)
        for i in np.flatnonzero((into != each) & (into >= 0)).tolist():
            for sums in self._sums.values():
                sums[into[i]] += sums[i]
        stays = np.flatnonzero(into == each)
        self.become({space: sums[stays] for space, sums in self._sums.items()}, len(stays))

    def become(self, sums: Mapping[str, Matrix], n: int) -> None:
        """Be these sums (n, d) by space. ValueError where they have another number of rows."""
        if any(len(values) != n for values in sums.values()):
            raise ValueError("features of another number of objects")
        self.n = n
        self._sums = {name: np.ascontiguousarray(values, np.float32) for name, values in sums.items()}
        self._make_room(max(_ROOM, 2 * n))

    def _make_room(self, room: int) -> None:
        """Rows for so many objects in every matrix, also of objects that have no feature of a space."""
        self._room = room
        self._units.clear()
        for space, sums in self._sums.items():
            made = np.zeros((room, sums.shape[1]), np.float32)
            made[: min(room, len(sums))] = sums[:room]
            self._sums[space] = made


def _spaces_of(found: Detections) -> Iterator[tuple[str, Matrix]]:
    """(space, (n, d) values) of what the detections have."""
    for space, values in ((found.space, found.features), (f"{found.space}_text", found.text_features)):
        if values is not None:
            yield space, values
