"""A node as its position: its place in the arrays of its scene; relations as columns of these.

While a query runs, it holds nothing else: conditions are numpy over all rows at once.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Positions = NDArray[np.int64]
Degrees = NDArray[np.float64]
Flags = NDArray[np.bool_]
Objects = NDArray[np.object_]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class EdgeColumn:
    """The relation, or path of relations, of each row: positions of its ends, label, confidence, origin, explanation.

    Of a path label and the like are None, and hops holds the positions that it goes through.
    """

    source: Positions
    target: Positions
    confidence: Degrees
    label: Objects
    origin: Objects
    explanation: Objects
    hops: Objects | None = None

    def take(self, rows: NDArray[np.int64]) -> EdgeColumn:
        """The edges of these rows, in their order."""
        return EdgeColumn(
            source=self.source[rows],
            target=self.target[rows],
            confidence=self.confidence[rows],
            label=self.label[rows],
            origin=self.origin[rows],
            explanation=self.explanation[rows],
            hops=None if self.hops is None else self.hops[rows],
        )
