"""How much a query may take: time, rows, and the right of whoever asked to take it back."""

from __future__ import annotations

import threading
import time
from dataclasses import dataclass, field

from cgdb.errors import LimitError, QueryCancelled


@dataclass(frozen=True, slots=True, kw_only=True)
class Limits:
    """seconds: of one query, None for no limit. rows: that a match may grow to, and that a result may have."""

    seconds: float | None = None
    rows: int = 5_000_000


@dataclass(frozen=True, slots=True, kw_only=True)
class Budget:
    """What one running query has left. ``cancelled`` may be set from another thread."""

    limits: Limits = field(default_factory=Limits)
    started: float = field(default_factory=time.monotonic)
    cancelled: threading.Event = field(default_factory=threading.Event)

    def check(self) -> None:
        """Raise once the time is over or the query was cancelled; called between the steps of the executor."""
        if self.cancelled.is_set():
            raise QueryCancelled("the query was cancelled")
        if self.remaining == 0.0:
            raise LimitError(
                f"the query took longer than {self.limits.seconds:g} s",
                hint="ask for less (a label, a relation, LIMIT), or allow more time",
            )

    @property
    def remaining(self) -> float | None:
        """Seconds that are left; None where there is no limit."""
        if self.limits.seconds is None:
            return None
        return max(0.0, self.limits.seconds - (time.monotonic() - self.started))

    def check_rows(self, rows: int) -> None:
        """Raise where a step would give more rows than allowed."""
        if rows > self.limits.rows:
            raise LimitError(
                f"the query would look at {rows:,} combinations; {self.limits.rows:,} is the most",
                hint="connect the patterns by a relation, or narrow one of them",
            )
