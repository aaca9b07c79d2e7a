"""How well a way answers judged queries: recall, rank, "nothing fits", and what it costs."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from statistics import median
from typing import Any

import numpy as np

from cgdb.evaluation.judged import JudgedQuery
from cgdb.evaluation.retrieval import Outcome

RESAMPLES = 2000
SEED = 0
DEPTHS = (1, 2, 3)


@dataclass(frozen=True, slots=True, kw_only=True)
class Share:
    """A mean with its 95 % interval by bootstrap over queries; n of them."""

    mean: float
    low: float
    high: float
    n: int


@dataclass(frozen=True, slots=True, kw_only=True)
class Scores:
    """One way over one kind of queries ("all": every kind).

    recall: {k: R@k}. nothing: (precision, recall) of "nothing fits", None where it was never said, or never true.
    tokens: median per query. calls: per query. seconds: median per query, wall clock. errors: queries without answer.
    """

    way: str
    kind: str
    queries: int
    recall: Mapping[int, Share]
    mrr: Share
    nothing: tuple[float | None, float | None]
    n_nothing: int
    tokens: float
    calls: float
    seconds: float
    errors: int

    def to_dict(self) -> dict[str, Any]:
        """JSON-ready."""
        record: dict[str, Any] = {"way": self.way, "kind": self.kind, "queries": self.queries, "n": self.mrr.n}
        for name, share in (*((f"R@{k}", share) for k, share in self.recall.items()), ("MRR", self.mrr)):
            record[name] = round(share.mean, 4) if share.n else None
            record[f"{name} 95 %"] = [round(share.low, 4), round(share.high, 4)] if share.n else None
        record["nothing fits, precision"], record["nothing fits, recall"] = self.nothing
        record["queries without an answer in the map"] = self.n_nothing
        return record | {
            "tokens, median": self.tokens,
            "calls, mean": round(self.calls, 3),
            "seconds, median": round(self.seconds, 4),
            "errors": self.errors,
        }


def scores(way: str, results: Sequence[tuple[JudgedQuery, Outcome]]) -> list[Scores]:
    """The scores of a way per kind of query, and of all together."""
    kinds = list(dict.fromkeys(query.kind for query, _ in results))
    parts = [(kind, [pair for pair in results if pair[0].kind == kind]) for kind in kinds]
    if len(kinds) > 1:
        parts.append(("all", list(results)))
    return [_scored(way, kind, pairs) for kind, pairs in parts]


def _scored(way: str, kind: str, pairs: Sequence[tuple[JudgedQuery, Outcome]]) -> Scores:
    counted = [(query, outcome) for query, outcome in pairs if query.clear]
    places = [
        next((place for place, name in enumerate(outcome.ids, start=1) if name in query.clear), None)
        for query, outcome in counted
    ]
    recall = {k: share([float(place is not None and place <= k) for place in places]) for k in DEPTHS}
    truly = [not query.relevant for query, _ in pairs if query.clear or not query.relevant]
    said = [outcome.achievable is False for query, outcome in pairs if query.clear or not query.relevant]
    both = sum(t and s for t, s in zip(truly, said, strict=True))
    can_say = any(outcome.achievable is not None for _, outcome in pairs)
    return Scores(
        way=way,
        kind=kind,
        queries=len(pairs),
        recall=recall,
        mrr=share([0.0 if place is None else 1 / place for place in places]),
        nothing=(both / sum(said) if any(said) else None, both / sum(truly) if any(truly) and can_say else None),
        n_nothing=sum(truly),
        tokens=float(median(outcome.usage.tokens for _, outcome in pairs)),
        calls=sum(outcome.usage.calls for _, outcome in pairs) / len(pairs),
        seconds=float(median(outcome.seconds for _, outcome in pairs)),
        errors=sum(outcome.error is not None for _, outcome in pairs),
    )


def share(values: Iterable[float]) -> Share:
    """The mean of values in [0, 1], with the middle 95 % of the means of seeded resamples."""
    given = np.asarray(list(values), np.float64)
    n = len(given)
    if n == 0:
        return Share(mean=float("nan"), low=float("nan"), high=float("nan"), n=0)
    picks = np.random.default_rng(SEED).integers(0, n, (RESAMPLES, n))
    low, high = np.percentile(given[picks].mean(axis=1), [2.5, 97.5])
    return Share(mean=float(given.mean()), low=float(low), high=float(high), n=n)
