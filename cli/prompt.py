"""The prompt: editing, colours, completion, history. Imported only where there is a terminal to prompt at."""

from __future__ import annotations

import os
import signal
import sys
from collections.abc import Iterable
from typing import TYPE_CHECKING

from prompt_toolkit.auto_suggest import AutoSuggestFromHistory, ConditionalAutoSuggest
from prompt_toolkit.completion import (
    CompleteEvent,
    Completer,
    Completion,
    ThreadedCompleter,
)
from prompt_toolkit.document import Document
from prompt_toolkit.enums import EditingMode
from prompt_toolkit.filters import Condition
from prompt_toolkit.formatted_text import FormattedText
from prompt_toolkit.history import FileHistory, History, InMemoryHistory
from prompt_toolkit.output.color_depth import ColorDepth
from prompt_toolkit.shortcuts import CompleteStyle, PromptSession, print_formatted_text
from prompt_toolkit.styles import DynamicStyle

import cgdb
from cgdb.cli import keeping, offers, render, script
from cgdb.cli.commands import Quit
from cgdb.cli.prompt_keys import keys
from cgdb.cli.prompt_looks import Colours, style, toolbar
from cgdb.cli.screen import MENU
from cgdb.cli.settings import folder
from cgdb.cli.shell import report, run
from cgdb.cli.themes import PLAIN
from cgdb.errors import CgdbError

if TYPE_CHECKING:
    from cgdb.cli.session import Session
    from cgdb.database import Database

PROMPT = "cgdb> "


def converse(session: Session) -> int:
    """Read, run, show, until the person leaves; the exit code."""
    if hasattr(signal, "SIGPIPE"):
        # The pager may be left before it has read everything; that is an error to catch, no reason to die.
        signal.signal(signal.SIGPIPE, signal.SIG_IGN)
    prompt = make_prompt(session)
    screen = session.screen
    # Printed without rich, which need not be there yet.
    print_formatted_text(
        FormattedText(
            [
                ("class:prompt", f"cgdb {cgdb.__version__}"),
                ("class:continuation", "  :help for help, Tab completes, Ctrl-D leaves"),
            ]
        ),
        style=style(screen.theme),
    )

    def opened(db: Database) -> None:
        session.vocabulary.fill(db, session.use.scenes, session.use.as_of)

    def changed() -> None:
        prompt.app.invalidate()
        if session.opening.failed is not None and prompt.app.is_running and prompt.app.loop is not None:
            prompt.app.loop.call_soon_threadsafe(_fail, prompt, session.opening.failed)

    started = False

    def start() -> None:
        nonlocal started
        if not started:
            started = True
            loop = prompt.app.loop
            assert loop is not None, "the prompt runs"
            # After the prompt is on the screen: what is imported now no longer delays it.
            loop.call_later(0.02, session.opening.start, opened, session.vocabulary.read_ahead, changed)

    while True:
        prompt.editing_mode = EditingMode.VI if session.settings["vi"] else EditingMode.EMACS
        try:
            text = prompt.prompt(pre_run=start)
        except KeyboardInterrupt:
            continue
        except EOFError:
            return 0
        if text.strip().casefold() in ("exit", "quit", "help", "?"):
            text = f":{text.strip()}"
        try:
            _run_typed(session, text)
        except Quit:
            return 0


def _fail(prompt: PromptSession[str], error: Exception) -> None:
    if prompt.app.is_running and not prompt.app.is_done:
        prompt.app.exit(exception=error)


def _run_typed(session: Session, text: str) -> None:
    lead = len(PROMPT) + len(_scope(session))
    pieces = list(script.pieces(text))
    for piece in pieces:
        try:
            run(session, piece)
        except KeyboardInterrupt:
            session.screen.note("interrupted")
            return
        except keeping.Reported:
            return
        except CgdbError as error:
            # The caret can stand right under what was typed only while nothing came between.
            report(session, error, typed=text if len(pieces) == 1 else None, lead=lead)
            return
        except Quit:
            raise
        except Exception as error:
            # A bug ends the statement, not the session.
            if os.environ.get("CGDB_DEBUG"):
                raise
            session.screen.note(f"internal error: {type(error).__name__}: {error}; CGDB_DEBUG=1 shows where", "error")
            return


def make_prompt(session: Session) -> PromptSession[str]:
    """The prompt with everything on it."""
    screen = session.screen
    suggests = Condition(lambda: bool(session.settings["suggest"]))
    offering = _Offers(session)
    prompt: PromptSession[str] = PromptSession(
        message=lambda: [("class:prompt", f"{_scope(session)}{PROMPT}")],
        multiline=True,
        prompt_continuation=lambda width, number, wrapped: [
            ("class:continuation", " " * width if wrapped else "· ".rjust(width))
        ],
        lexer=Colours(),
        style=DynamicStyle(lambda: style(screen.theme)),
        include_default_pygments_style=False,
        color_depth=ColorDepth.DEPTH_1_BIT if screen.theme is PLAIN else None,
        completer=ThreadedCompleter(offering),
        complete_while_typing=suggests,
        complete_style=CompleteStyle.COLUMN,
        reserve_space_for_menu=MENU,
        history=_history(),
        auto_suggest=ConditionalAutoSuggest(AutoSuggestFromHistory(), suggests),
        enable_open_in_editor=True,
        tempfile_suffix=".cgql",
        key_bindings=keys(offering),
        bottom_toolbar=lambda: toolbar(session, prompt.default_buffer.text),
        mouse_support=False,
    )
    return prompt


def _scope(session: Session) -> str:
    """The scene in use, before the prompt."""
    names = [render.clean(name) for name in session.use.scenes]
    if not names and session.use.as_of is None:
        return ""
    shown = names[0][:20] if len(names) == 1 else f"{len(names)} scenes" if names else ""
    when = "" if session.use.as_of is None else f"@{session.use.as_of}"
    return f"{shown}{when} "


class _Offers(Completer):
    """What may be typed next, as prompt-toolkit takes it."""

    def __init__(self, session: Session) -> None:
        self._session = session

    def get_completions(self, document: Document, complete_event: CompleteEvent) -> Iterable[Completion]:
        cursor = document.cursor_position
        try:
            choices = offers.offered(self._session, document.text, cursor, asked=complete_event.completion_requested)
        except CgdbError:
            # A damaged index is told of by the next query; a menu is no place for it.
            return
        for choice in choices:
            yield Completion(
                choice.text,
                start_position=choice.start - cursor,
                display=render.clean(choice.text)[:60],
                display_meta=render.clean(choice.says or choice.kind)[:60],
            )


def _history() -> History:
    """Kept in the state folder, readable by this person alone; in memory where it cannot be written."""
    path = folder("state") / "history"
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        os.close(os.open(path, os.O_WRONLY | os.O_CREAT | os.O_APPEND, 0o600))
    except OSError as error:
        sys.stderr.write(f"note: {path} cannot be written, so nothing is remembered: {error.strerror}\n")
        return InMemoryHistory()
    return FileHistory(str(path))
