"""Relations as arrays: from a few known nodes to their neighbours, in microseconds."""

from __future__ import annotations

import json
import zipfile
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from cgdb.errors import CorruptionError
from cgdb.index.positions import EdgeColumn, Objects, Positions

if TYPE_CHECKING:
    from cgdb.storage.ledger import RelationRow

Rows = NDArray[np.int64]
"""(n,) numbers of relations."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Relations:
    """All m relations of a scene of n nodes, by source. source, target: (m,) positions. label, origin, explanation:
    (m,) places in labels, origins and explanations; the last of explanations is None. confidence: (m,) float64.

    first_out, first_in: (n + 1,) where the relations of each node begin; by_target: (m,) relations by target.
    """

    source: Positions
    target: Positions
    label: NDArray[np.int32]
    origin: NDArray[np.int32]
    explanation: NDArray[np.int32]
    confidence: NDArray[np.float64]
    labels: Objects
    origins: Objects
    explanations: Objects
    first_out: Rows
    first_in: Rows
    by_target: Rows

    def touching(self, nodes: Positions, *, outgoing: bool) -> tuple[NDArray[np.int64], Rows]:
        """For every relation that leaves (or reaches) one of the nodes: which of them, and the relation."""
        first = self.first_out if outgoing else self.first_in
        begin = first[nodes]
        counts = first[nodes + 1] - begin
        which = np.repeat(np.arange(len(nodes)), counts)
        places = np.arange(len(which)) + np.repeat(begin - (np.cumsum(counts) - counts), counts)
        return which, places if outgoing else self.by_target[places]

    def codes(self, labels: tuple[str, ...]) -> list[int]:
        """The places of those labels that there are."""
        return [place for place, label in enumerate(self.labels.tolist()) if label in labels]

    def column(self, rows: Rows) -> EdgeColumn:
        """These relations as a column of a match."""
        return EdgeColumn(
            source=self.source[rows],
            target=self.target[rows],
            confidence=self.confidence[rows],
            label=self.labels[self.label[rows]],
            origin=self.origins[self.origin[rows]],
            explanation=self.explanations[self.explanation[rows]],
        )


class Collector:
    """Takes in the relations of a scene, batch by batch, for ``save``."""

    def __init__(self) -> None:
        self._labels: dict[str, int] = {}
        self._origins: dict[str, int] = {}
        self._explanations: dict[str, int] = {}
        self._parts: list[tuple[NDArray[np.int64], NDArray[np.int32], NDArray[np.float64]]] = []

    def add(self, batch: list[RelationRow]) -> None:
        """Relations, in the order of their sources' keys."""
        labels, origins, explanations = self._labels, self._origins, self._explanations
        ends = [(row.source, row.target) for row in batch]
        codes = [
            (
                labels.setdefault(row.label, len(labels)),
                origins.setdefault(row.origin, len(origins)),
                -1 if row.explanation is None else explanations.setdefault(row.explanation, len(explanations)),
            )
            for row in batch
        ]
        self._parts.append(
            (
                np.asarray(ends, np.int64).reshape(-1, 2),
                np.asarray(codes, np.int32).reshape(-1, 3),
                np.asarray([row.confidence for row in batch], np.float64),
            )
        )

    def arrays(self, keys: NDArray[np.int64]) -> dict[str, NDArray[Any]]:
        """What a file has to hold. keys: (n,) of all nodes, ascending."""
        none = (np.empty((0, 2), np.int64), np.empty((0, 3), np.int32), np.empty(0))
        ends, codes, confidence = (np.concatenate(part) for part in zip(none, *self._parts, strict=True))
        names = json.dumps([list(self._labels), list(self._origins), list(self._explanations)])
        return {
            "ends": np.searchsorted(keys, ends).astype(np.int32),
            "codes": codes,
            "confidence": confidence,
            "names": np.frombuffer(names.encode(), np.uint8),
        }


def read(path: Path) -> Relations:
    """The relations of a file that holds what ``Collector.arrays`` gave. CorruptionError where it does not."""
    try:
        with np.load(path, allow_pickle=False) as arrays:
            ends, codes, confidence = arrays["ends"].astype(np.int64), arrays["codes"], arrays["confidence"]
            labels, origins, explanations = json.loads(arrays["names"].tobytes())
            n = len(arrays["keys"])
    except (OSError, ValueError, KeyError, zipfile.BadZipFile) as error:
        raise CorruptionError(f"the index file {path.name} cannot be read: {error}") from error
    source, target = np.ascontiguousarray(ends[:, 0]), np.ascontiguousarray(ends[:, 1])
    by_target = np.argsort(target, kind="stable")
    nodes = np.arange(n + 1)
    return Relations(
        source=source,
        target=target,
        label=codes[:, 0],
        origin=codes[:, 1],
        explanation=codes[:, 2],
        confidence=confidence,
        labels=np.asarray(labels, object),
        origins=np.asarray(origins, object),
        explanations=np.asarray([*explanations, None], object),
        first_out=np.searchsorted(source, nodes),
        first_in=np.searchsorted(target[by_target], nodes),
        by_target=by_target,
    )
