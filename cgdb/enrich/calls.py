"""Many questions to a model: several at a time, no more a minute than it allows, each answer as soon as it is there."""

from __future__ import annotations

import queue
import threading
import time
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from itertools import islice
from typing import Generic, TypeVar

from cgdb.errors import UsageError
from cgdb.model.llm import Meter, Model, ModelError, Unreachable, Usage

Item = TypeVar("Item")
Answer = TypeVar("Answer")
Turn = Callable[[], None]
"""Waits until one more question may be begun."""

HOPELESS = frozenset({401, 403, 404, 429})
"""What a server answers whatever it is asked: a wrong key or model, a limit that retries did not wait out."""
MOST_FAILURES = 5
"""So many questions in a row without an answer: then the server, not the questions, is at fault."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Pace:
    """workers: calls at a time. per_minute: questions that are begun within a minute at most, evenly; None: any."""

    workers: int = 4
    per_minute: float | None = None

    def __post_init__(self) -> None:
        if not 1 <= self.workers <= 64:
            raise UsageError(f"1 to 64 calls at a time, not {self.workers}")
        if self.per_minute is not None and not 0 < self.per_minute <= 1e5:
            raise UsageError(f"calls a minute must be more than 0, not {self.per_minute:g}")


@dataclass(frozen=True, slots=True)
class Answered(Generic[Item, Answer]):
    """An item with its answer; None where the model had none. usage: what the calls for it cost."""

    item: Item
    answer: Answer | None
    usage: Usage


def each(
    model: Model, items: Iterable[Item], ask: Callable[[Item, Meter, Turn], Answer], pace: Pace
) -> Iterator[Answered[Item, Answer]]:
    """Ask for every item, yielding answers in the order in which they come. Items are taken when their turn is near.

    ask begins with its first question at once, and waits for its turn before each further one: a rate is of questions,
    and an item may take several.
    An item that the model refuses, or answers with nothing that can be used, has no answer. ModelError where the server
    cannot be used at all; calls that are under way are then given up, and so they are when the iterator is closed.
    """
    work: queue.SimpleQueue[tuple[Item] | None] = queue.SimpleQueue()
    done: queue.SimpleQueue[tuple[Item, Answer | None, Usage, BaseException | None]] = queue.SimpleQueue()
    stopped, turn = threading.Event(), _Turn(pace.per_minute)

    def next_turn() -> None:
        if not turn.wait(stopped):
            raise ModelError("given up")  # nobody waits for the answer any more

    def run() -> None:
        while (given := work.get()) is not None:
            (item,) = given
            if not turn.wait(stopped):
                return
            meter, answer, problem = model.meter(), None, None
            try:
                answer = ask(item, meter, next_turn)
            except BaseException as error:  # noqa: BLE001  it is raised again in the thread that waits for answers
                problem = error
            done.put((item, answer, meter.usage, problem))
            del answer, problem  # an error holds this frame, which must not hold the error

    source = iter(items)
    out = failures = workers = 0
    first, served = True, False
    try:
        for item in islice(source, pace.workers):
            if not out:
                model.prepare(model.meter())  # what is learnt of the server is then known to all threads
            # A daemon: a call that hangs must not hold up a Ctrl-C.
            threading.Thread(target=run, daemon=True).start()
            workers += 1
            work.put((item,))
            out += 1
        while out:
            item, answer, usage, problem = done.get()
            out -= 1
            failures = 0 if problem is None else failures + 1
            if problem is not None and (hopeless(problem, first=first) or failures >= MOST_FAILURES):
                raise problem
            first, served = False, served or problem is None
            for following in islice(source, 1):
                work.put((following,))
                out += 1
            yield Answered(item, answer, usage)
            if problem is not None and not out and not served:
                raise problem  # not one of all was answered: it is not the questions
    finally:
        problem = None
        stopped.set()
        for _ in range(workers):
            work.put(None)  # a thread that waits for an item for ever would keep the model and the store


def cost(model: Model | None, prompt: int, completion: int) -> float | None:
    """What tokens cost at the configured prices; None where there are none."""
    settings = None if model is None else model.settings
    if settings is None or settings.prompt_price is None or settings.completion_price is None:
        return None
    return (prompt * settings.prompt_price + completion * settings.completion_price) / 1e6


def hopeless(error: BaseException, *, first: bool) -> bool:
    """Whether asking anything else would fail in the same way. A server that never answered is not waited for."""
    return not isinstance(error, ModelError) or error.status in HOPELESS or (first and isinstance(error, Unreachable))


class _Turn:
    """Who may begin when: evenly spread starts."""

    def __init__(self, per_minute: float | None) -> None:
        self._gap = 0.0 if per_minute is None else 60.0 / per_minute
        self._next = time.monotonic()
        self._lock = threading.Lock()

    def wait(self, stopped: threading.Event) -> bool:
        """Wait for one's turn; False where it is over before."""
        with self._lock:
            now = time.monotonic()
            mine = max(now, self._next)
            self._next = mine + self._gap
        return not stopped.wait(max(0.0, mine - now)) if mine > now else not stopped.is_set()
