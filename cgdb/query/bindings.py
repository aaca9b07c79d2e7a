"""The rows of a query while it runs: which node stands for which variable, and how well each row does so far."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from cgdb.index.positions import Degrees, EdgeColumn, Flags, Positions


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Truth:
    """A condition over the rows: degree (n,) float64 in [0, 1], and fits (n,), its answer as yes or no.

    fits reads every single degree as yes from 0.5 on and then follows the logic, so that three conditions that all
    just fit make a row that fits although the product of their degrees is small.
    """

    degree: Degrees
    fits: Flags

    @staticmethod
    def certain(flags: Flags) -> Truth:
        """Of a condition that is either met or not."""
        return Truth(degree=flags.astype(np.float64), fits=flags)

    @staticmethod
    def of(degree: NDArray[np.floating]) -> Truth:
        """Of a single degree of match."""
        wide = degree.astype(np.float64)
        return Truth(degree=wide, fits=wide >= 0.5)

    def __and__(self, other: Truth) -> Truth:
        return Truth(degree=self.degree * other.degree, fits=self.fits & other.fits)

    def __or__(self, other: Truth) -> Truth:
        return Truth(degree=1.0 - (1.0 - self.degree) * (1.0 - other.degree), fits=self.fits | other.fits)

    def __invert__(self) -> Truth:
        return Truth(degree=1.0 - self.degree, fits=~self.fits)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Bindings:
    """n rows of one scene: {variable: positions (n,)}, {edge: its column}, and what the rows were found to be worth."""

    n: int
    nodes: Mapping[str, Positions] = field(default_factory=dict)
    edges: Mapping[str, EdgeColumn] = field(default_factory=dict)
    truth: Truth

    @staticmethod
    def of_nodes(name: str, positions: Positions) -> Bindings:
        """A row for each position."""
        return Bindings(n=len(positions), nodes={name: positions}, truth=always(len(positions)))

    def take(self, rows: NDArray[np.int64]) -> Bindings:
        """These rows, in their order."""
        return Bindings(
            n=len(rows),
            nodes={name: positions[rows] for name, positions in self.nodes.items()},
            edges={name: edge.take(rows) for name, edge in self.edges.items()},
            truth=Truth(degree=self.truth.degree[rows], fits=self.truth.fits[rows]),
        )

    def weigh(self, truth: Truth) -> Bindings:
        """The rows after one more condition; those whose degree became 0 are gone."""
        both = replace(self, truth=self.truth & truth)
        alive = both.truth.degree > 0.0
        return both if alive.all() else both.take(np.flatnonzero(alive))

    def cross(self, other: Bindings) -> Bindings:
        """Every row with every row of the other."""
        mine = np.repeat(np.arange(self.n), other.n)
        theirs = np.tile(np.arange(other.n), self.n)
        left, right = self.take(mine), other.take(theirs)
        return Bindings(
            n=len(mine),
            nodes={**left.nodes, **right.nodes},
            edges={**left.edges, **right.edges},
            truth=left.truth & right.truth,
        )

    def best_per(self, columns: Sequence[Positions]) -> Bindings:
        """One row for each combination of these columns: the best one, the first among equals."""
        if self.n < 2:
            return self
        if not columns:
            return self.take(np.lexsort((-self.truth.degree, ~self.truth.fits))[:1])
        # lexsort's last key is the first to sort by; stable, so that equal rows keep the order of the match.
        order = np.lexsort((-self.truth.degree, ~self.truth.fits, *reversed(columns)))
        new = np.zeros(self.n, bool)
        new[0] = True
        for column in columns:
            ordered = column[order]
            new[1:] |= ordered[1:] != ordered[:-1]
        return self if new.all() else self.take(np.sort(order[new]))


def always(n: int) -> Truth:
    """Of a row that nothing was asked yet."""
    return Truth(degree=np.ones(n), fits=np.ones(n, bool))


def concatenate(parts: Sequence[Bindings]) -> Bindings:
    """The rows of several parts with the same variables, in order."""
    if len(parts) == 1:
        return parts[0]
    first = parts[0]
    return Bindings(
        n=sum(part.n for part in parts),
        nodes={name: np.concatenate([part.nodes[name] for part in parts]) for name in first.nodes},
        edges={name: _joined([part.edges[name] for part in parts]) for name in first.edges},
        truth=Truth(
            degree=np.concatenate([part.truth.degree for part in parts]),
            fits=np.concatenate([part.truth.fits for part in parts]),
        ),
    )


def _joined(columns: Sequence[EdgeColumn]) -> EdgeColumn:
    hops = [column.hops for column in columns if column.hops is not None]
    return EdgeColumn(
        source=np.concatenate([column.source for column in columns]),
        target=np.concatenate([column.target for column in columns]),
        confidence=np.concatenate([column.confidence for column in columns]),
        label=np.concatenate([column.label for column in columns]),
        origin=np.concatenate([column.origin for column in columns]),
        explanation=np.concatenate([column.explanation for column in columns]),
        hops=np.concatenate(hops) if hops else None,
    )
