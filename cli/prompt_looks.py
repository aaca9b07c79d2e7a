"""How the prompt looks: the colours of what is typed, and the line below it."""

from __future__ import annotations

from collections.abc import Callable
from functools import lru_cache
from typing import TYPE_CHECKING, Any

from prompt_toolkit.document import Document
from prompt_toolkit.formatted_text import StyleAndTextTuples
from prompt_toolkit.lexers import Lexer
from prompt_toolkit.styles import Style

from cgdb.cli import highlight, render
from cgdb.cli.themes import Theme
from cgdb.errors import CgdbError
from cgdb.grammar.parser import parse

if TYPE_CHECKING:
    from cgdb.cli.session import Session

KEYS = (
    "F4 editor  Ctrl-R search  Alt-Enter new line  Ctrl-C cancel",
    "F4 editor  Ctrl-R search",
    ":help",
)
"""What the toolbar says of keys, by the room there is."""


class Colours(Lexer):
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


def style(theme: Theme) -> Style:
    """The colours of a theme, as prompt-toolkit takes them."""
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


def toolbar(session: Session, text: str) -> Any:
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
