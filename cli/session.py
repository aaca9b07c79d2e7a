"""A session of the shell: the store, options, parameters, scenes in use, last result; and how a statement is asked."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any, TypeVar

from cgdb.cli.favourites import Favourites
from cgdb.cli.opening import Opening
from cgdb.cli.screen import Screen
from cgdb.cli.settings import Settings, folder
from cgdb.cli.vocabulary import Vocabulary
from cgdb.errors import CgdbError, QueryCancelled, Span
from cgdb.grammar.parser import parse, tokens
from cgdb.grammar.printer import to_text
from cgdb.query.limits import Limits

if TYPE_CHECKING:
    from cgdb.asking.answer import Answer as InWords
    from cgdb.database import Database
    from cgdb.result import Result

T = TypeVar("T")
SPIN = "⠋⠙⠹⠸⠼⠴⠦⠧⠇⠏"
PATIENCE = 0.3
"""Seconds after which the shell says that it is busy."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Use:
    """What a statement without USE and AS OF asks: scenes (none: all), and the revision or time (None: now)."""

    scenes: tuple[str, ...] = ()
    as_of: int | str | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class Answer:
    """text: the statement as typed. seconds: from asking to having it."""

    text: str
    result: Result
    seconds: float


class Session:
    """Everything that commands and statements work on. ``interactive``: a person sits in front of it."""

    def __init__(self, opening: Opening, *, interactive: bool = False, terminal: bool | None = None) -> None:
        self.opening = opening
        self.interactive = interactive
        self.quiet = False
        self.settings = Settings()
        self.screen = Screen(self.settings, terminal=terminal)
        self.parameters: dict[str, Any] = {}
        self.use = Use()
        self.last: Answer | None = None
        self.asked: InWords | None = None
        """The last answer to a question in plain words, which the next may follow up."""
        self.statement: str | None = None
        """The last statement, right or wrong: what ``:save`` and ``:explain`` speak of."""
        self.vocabulary = Vocabulary(lambda: self.parameters)
        self.favourites = Favourites(folder("config") / "favourites.json")
        self.reading: tuple[str, ...] = ()
        """Files that ``:read`` is in, so that one that reads itself is told."""

    @property
    def db(self) -> Database:
        """The open store; waits for it."""
        if not self.opening.ready:
            self.waiting(self.opening.database, lambda: None)
        db = self.opening.database()
        if not self.vocabulary.filled:
            self.vocabulary.fill(db, self.use.scenes, self.use.as_of)
        return db

    def scenes(self) -> list[str]:
        """The names of the scenes that are asked: those in use, else all."""
        return list(self.use.scenes) or [info.name for info in self.db.scenes(self.use.as_of)]

    def say(self, text: str, part: str = "faint") -> None:
        """What a command did, to a person; a script knows what it asked for."""
        if self.interactive and not self.quiet:
            self.screen.note(text, part)

    def ask(self, text: str, parameters: Mapping[str, Any] | None = None, *, mode: str = "") -> Answer:
        """The answer to a statement in the scenes in use. mode: EXPLAIN or PROFILE, where the text does not say so.

        Errors have their place in the text as it was typed.
        """
        self.statement = text
        db = self.db
        given = self.parameters if parameters is None else parameters
        added = self._added(text, mode)
        asked = _inserted(text, added)
        limits = None if self.settings["timeout"] is None else Limits(seconds=self.settings["timeout"])
        started = time.perf_counter()
        try:
            result = self.waiting(lambda: db.query(asked, given, limits=limits), db.cancel)
        except CgdbError as error:
            if error.span is not None and error.source == asked:
                error.source, error.span = text, _typed(error.span, added)
            raise
        if added and not mode:
            result = replace(result, query=to_text(parse(text)))
        answer = Answer(text=text, result=result, seconds=time.perf_counter() - started)
        if result.columns != ("plan",):
            self.last = answer
        return answer

    def _added(self, text: str, mode: str) -> list[tuple[int, str]]:
        """(place, words) that a statement lacks: its mode, and the scenes and the revision in use."""
        if self.use == Use() and not mode:
            return []
        spans = [(span, text[span.start : span.end].upper()) for span, kind in tokens(text) if kind != "comment"]
        begin = spans[0][0].start if spans else 0
        added = [(begin, f"{mode} ")] if mode else []
        if self.use == Use():
            return added
        tree = parse(text)
        place = spans[1][0].start if spans[0][1] in ("EXPLAIN", "PROFILE") else begin
        if self.use.scenes and not tree.scenes:
            added.append((place, "USE " + ", ".join(quoted(name) for name in self.use.scenes) + " "))
        if self.use.as_of is not None and tree.as_of is None:
            if tree.scenes:
                place = next(
                    span.start for span, word in spans if word == "MATCH" and span.start >= tree.scenes[-1].span.end
                )
            added.append(
                (place, f"AS OF {self.use.as_of if isinstance(self.use.as_of, int) else quoted(self.use.as_of)} ")
            )
        return added

    def waiting(self, work: Callable[[], T], cancel: Callable[[], None]) -> T:
        """What work returns. It runs in a thread: Ctrl-C cancels it, a second one stops waiting for it."""
        if not self.interactive:
            return work()
        outcome: list[T] = []
        failure: list[BaseException] = []
        done = threading.Event()

        def run() -> None:
            try:
                outcome.append(work())
            except BaseException as error:  # noqa: BLE001 -- raised again where it is waited for
                failure.append(error)
            finally:
                done.set()

        started = time.monotonic()
        threading.Thread(target=run, name="cgdb-query", daemon=True).start()
        busy = _Busy(self.screen)
        cancelled = False
        try:
            while not done.wait(0.05):
                seconds = time.monotonic() - started
                if seconds > PATIENCE:
                    busy.say("cancelling; Ctrl-C once more to leave it alone" if cancelled else self._doing(), seconds)
        except KeyboardInterrupt:
            cancelled = True
            try:
                # The query may not have begun to listen yet, so it is told again until it ends.
                while not done.wait(0.1):
                    cancel()
                    busy.say("cancelling; Ctrl-C once more stops waiting for it", time.monotonic() - started)
            except KeyboardInterrupt:
                raise QueryCancelled("left alone: it goes on behind the prompt until it is done") from None
        finally:
            busy.end()
        if failure:
            raise failure[0]
        if cancelled:
            raise QueryCancelled(f"cancelled after {time.monotonic() - started:.1f} s")
        return outcome[0]

    def _doing(self) -> str:
        stages = {
            "opening": "opening the store",
            "indexes": "opening the indexes",
            "encoder": "loading the text encoder",
        }
        return stages.get(self.opening.stage, "working") + "; Ctrl-C cancels"


def _inserted(text: str, added: list[tuple[int, str]]) -> str:
    for place, words in reversed(added):
        text = text[:place] + words + text[place:]
    return text


def _typed(span: Span, added: list[tuple[int, str]]) -> Span | None:
    """A place of the text with the added words as one of the text as typed; None inside of what was added."""
    start = span.start
    for place, words in added:
        if place <= start < place + len(words):
            return None
        if start >= place:
            start -= len(words)
    return Span(start, start + span.end - span.start)


class _Busy:
    """One line that says that something takes its time, and goes away."""

    def __init__(self, screen: Screen) -> None:
        self._screen = screen
        self._shown = False

    def say(self, text: str, seconds: float) -> None:
        if not self._screen.terminal:
            return
        line = f"{SPIN[int(seconds * 10) % len(SPIN)]} {text} ({seconds:.1f} s)"
        self._screen.raw("\r\x1b[K" + line[: self._screen.width - 1])
        self._shown = True

    def end(self) -> None:
        if self._shown:
            self._screen.raw("\r\x1b[K")


def quoted(text: str) -> str:
    """A text as it stands in a statement."""
    out = []
    for c in text:
        if c in "\\'":
            out.append("\\" + c)
        elif c < " ":
            out.append(f"\\u{ord(c):04x}")
        else:
            out.append(c)
    return "'" + "".join(out) + "'"
