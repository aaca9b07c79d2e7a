"""The prompt: editing, colours, completion, history. Imported only where there is a terminal to prompt at."""

from __future__ import annotations

import os
import signal
import sys
from collections.abc import Callable, Iterable
from functools import lru_cache
from typing import TYPE_CHECKING, Any

from prompt_toolkit.auto_suggest import AutoSuggestFromHistory, ConditionalAutoSuggest
from prompt_toolkit.buffer import CompletionState
from prompt_toolkit.completion import (
    CompleteEvent,
    Completer,
    Completion,
    ThreadedCompleter,
    get_common_complete_suffix,
)
from prompt_toolkit.document import Document
from prompt_toolkit.enums import EditingMode
from prompt_toolkit.filters import Condition, completion_is_selected
from prompt_toolkit.formatted_text import FormattedText, StyleAndTextTuples
from prompt_toolkit.history import FileHistory, History, InMemoryHistory
from prompt_toolkit.key_binding import KeyBindings, KeyPressEvent
from prompt_toolkit.lexers import Lexer
from prompt_toolkit.output.color_depth import ColorDepth
from prompt_toolkit.shortcuts import CompleteStyle, PromptSession, print_formatted_text
from prompt_toolkit.styles import DynamicStyle, Style

import cgdb
from cgdb.cli import highlight, keeping, offers, render, script
from cgdb.cli.commands import Quit
from cgdb.cli.screen import MENU
from cgdb.cli.settings import folder
from cgdb.cli.shell import report, run
from cgdb.cli.themes import PLAIN, Theme
from cgdb.errors import CgdbError
from cgdb.grammar.parser import parse

if TYPE_CHECKING:
    from cgdb.cli.session import Session
    from cgdb.database import Database

PROMPT = "cgdb> "
KEYS = (
    "F4 editor  Ctrl-R search  Alt-Enter new line  Ctrl-C cancel",
    "F4 editor  Ctrl-R search",
    ":help",
)
"""What the toolbar says of keys, by the room there is."""


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
        style=_style(screen.theme),
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
        lexer=_Colours(),
        style=DynamicStyle(lambda: _style(screen.theme)),
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
        key_bindings=_keys(offering),
        bottom_toolbar=lambda: _toolbar(session, prompt.default_buffer.text),
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


class _Colours(Lexer):
    """The grammar's pieces as styled fragments."""

    def lex_document(self, document: Document) -> Callable[[int], StyleAndTextTuples]:
        lines = highlight.lines(document.text)

        def line(number: int) -> StyleAndTextTuples:
            if number >= len(lines):
                return []
            return [(f"class:cgql.{kind}" if kind else "", text) for kind, text in lines[number]]

        return line


@lru_cache(maxsize=8)
def _style_of(name: str, pairs: tuple[tuple[str, str], ...]) -> Style:
    return Style([*pairs])


def _style(theme: Theme) -> Style:
    rules = [(f"cgql.{kind}", style) for kind, style in theme.syntax.items()]
    ink = theme.ink
    if ink:
        rules += [
            ("prompt", ink["prompt"]),
            ("continuation", ink["faint"]),
            ("auto-suggestion", ink["faint"]),
            ("bottom-toolbar", f"noreverse {ink['faint']}"),
            ("bottom-toolbar.state", ink["hint"]),
            ("completion-menu", "bg:#2b3346 #dfe6f3" if theme.name == "dark" else "bg:#e9edf3 #1f2328"),
            (
                "completion-menu.completion.current",
                "bg:#82aaff #1d2433" if theme.name == "dark" else "bg:#0550ae #ffffff",
            ),
            ("completion-menu.meta.completion", "bg:#232a3b #8796b0" if theme.name == "dark" else "bg:#dfe5ec #59636e"),
            (
                "completion-menu.meta.completion.current",
                "bg:#5f7fbf #ffffff" if theme.name == "dark" else "bg:#3d74bd #ffffff",
            ),
            ("scrollbar.background", "bg:#39435c" if theme.name == "dark" else "bg:#c8d0da"),
            ("scrollbar.button", "bg:#82aaff" if theme.name == "dark" else "bg:#0550ae"),
        ]
    return _style_of(theme.name, tuple(rules))


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


def _keys(completer: Completer) -> KeyBindings:
    keys = KeyBindings()

    @keys.add("enter", filter=~completion_is_selected)
    def _(event: KeyPressEvent) -> None:
        """Run what is complete, else begin a new line."""
        buffer = event.current_buffer
        if script.complete(buffer.text):
            buffer.validate_and_handle()
        else:
            _new_line(event)

    @keys.add("enter", filter=completion_is_selected)
    def _(event: KeyPressEvent) -> None:
        """Take the choice that is marked."""
        event.current_buffer.complete_state = None

    @keys.add("escape", "enter")
    def _(event: KeyPressEvent) -> None:
        """A new line in any case."""
        _new_line(event)

    @keys.add("f4")
    def _(event: KeyPressEvent) -> None:
        """Edit in $EDITOR."""
        event.current_buffer.open_in_editor(validate_and_handle=False)

    @keys.add("tab")
    def _(event: KeyPressEvent) -> None:
        """Offer choices; take a single one, or what all begin with, at once; go to the next."""
        buffer = event.current_buffer
        if buffer.complete_state:
            buffer.complete_next()
            return
        # Worked out here and now: a completion that still runs for the letters before would drop this one.
        found = list(completer.get_completions(buffer.document, CompleteEvent(completion_requested=True)))
        if len(found) == 1:
            buffer.apply_completion(found[0])
            return
        if common := get_common_complete_suffix(buffer.document, found):
            buffer.insert_text(common)
            found = list(completer.get_completions(buffer.document, CompleteEvent(completion_requested=True)))
        if found:
            buffer.complete_state = CompletionState(buffer.document, found)
            buffer.on_completions_changed.fire()

    return keys


def _new_line(event: KeyPressEvent) -> None:
    """A line that begins below the first word of the one before."""
    buffer = event.current_buffer
    before = buffer.document.current_line_before_cursor
    buffer.insert_text("\n" + before[: len(before) - len(before.lstrip())])


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


@lru_cache(maxsize=4)
def _whole(text: str) -> bool:
    """Whether a statement on several lines could be run as it is, which one more Enter would do."""
    if "\n" not in text.rstrip() or text.lstrip().startswith(":"):
        return False
    try:
        parse(text)
    except CgdbError:
        return False
    return True


def _toolbar(session: Session, text: str) -> Any:
    """The store and its state; what matters most where the terminal is narrow."""
    opening, settings = session.opening, session.settings
    state = {"opening": "opening…", "indexes": "opening indexes…", "encoder": "loading the text encoder…"}.get(
        opening.stage, ""
    )
    if _whole(text):
        state = "; and Enter runs this" if text.rpartition("\n")[2].strip() else "Enter runs this"
    parts = [render.clean(opening.path.name)]
    scenes = session.vocabulary.scenes()
    if scenes:
        parts.append(f"{len(scenes)} scene{'' if len(scenes) == 1 else 's'}")
    if settings["mode"] != "table":
        parts.append(settings["mode"])
    if session.parameters:
        parts.append(", ".join(f"${name}" for name in list(session.parameters)[:4]))
    line = " · ".join(parts)
    room = session.screen.width - len(line) - len(state) - 6
    keys = next((keys for keys in KEYS if len(keys) <= room), "")
    gap = " " * (room - len(keys) + 2)
    return [
        ("class:bottom-toolbar", f" {line} "),
        ("class:bottom-toolbar.state", f" {state} " if state else ""),
        ("class:bottom-toolbar", gap + keys),
    ]
