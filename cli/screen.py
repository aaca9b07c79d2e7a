"""What the shell writes to: a terminal with its width and colours, or a plain stream."""

from __future__ import annotations

import contextlib
import os
import shlex
import shutil
import signal
import subprocess
import sys
from collections.abc import Iterable, Iterator
from typing import TYPE_CHECKING, TextIO

from cgdb.cli import highlight, render
from cgdb.cli.settings import Settings
from cgdb.cli.themes import PLAIN, THEMES, Theme, suited

if TYPE_CHECKING:
    from rich.text import Text

PLAIN_WIDTH = 120
MENU = 6
"""Lines that the prompt keeps free below itself for the menu of completions."""


class Screen:
    """Lines to stdout, and talk to stderr when stdout is no terminal. All text that comes here is made clean."""

    def __init__(self, settings: Settings, *, terminal: bool | None = None) -> None:
        self._settings = settings
        self.terminal = sys.stdout.isatty() if terminal is None else terminal

    @property
    def theme(self) -> Theme:
        """The colours in use."""
        if not self.terminal:
            return PLAIN
        name = self._settings["theme"]
        return suited() if name == "auto" else THEMES[name]

    @property
    def width(self) -> int:
        """Columns that there are."""
        if self._settings["width"]:
            return int(self._settings["width"])
        return shutil.get_terminal_size().columns if self.terminal else PLAIN_WIDTH

    @property
    def limit(self) -> int | None:
        """Columns that a line may have; None, any number, where it goes to no terminal."""
        return self.width if self.terminal else None

    @property
    def height(self) -> int:
        """Lines that there are."""
        return shutil.get_terminal_size().lines if self.terminal else 40

    @property
    def room(self) -> int:
        """Lines of output after which all of it is still seen above the next prompt."""
        return max(4, self.height - MENU - 3)

    def ink(self, part: str) -> str:
        """The style of a part of the output."""
        return self.theme.ink.get(part, "")

    def text(self, *parts: tuple[str, str]) -> Text:
        """A line of (part, text)."""
        from rich.text import Text

        made = Text(no_wrap=True, overflow="ignore")
        for part, text in parts:
            made.append(clean_line(text), self.ink(part))
        return made

    def code(self, text: str) -> Text:
        """A statement in colours."""
        from rich.text import Text

        made = Text()
        for kind, piece in highlight.pieces(text):
            made.append(clean_lines(piece), self.theme.syntax.get(kind, ""))
        return made

    def print(self, *lines: Text | str) -> None:
        """Lines as they are; those that are too long are broken by the terminal alone, so that they copy whole."""
        self._write(self.ansi(lines), sys.stdout)

    def page(self, lines: Iterable[Text | str]) -> None:
        """Lines, in the pager where there are more than the terminal has."""
        shown = list(lines)
        if self.terminal and self._settings["pager"] and len(shown) >= self.height:
            self._in_pager(self.ansi(shown))
        else:
            self.print(*shown)

    def note(self, text: str, part: str = "faint") -> None:
        """Something said beside the data: below it on a terminal, else on stderr."""
        if self.terminal:
            self.print(self.text((part, text)))
        else:
            self._write(clean_line(text) + "\n", sys.stderr)

    def error(self, *lines: Text | str) -> None:
        """What went wrong."""
        sys.stdout.flush()
        self._write(self.ansi(lines), sys.stdout if self.terminal else sys.stderr)

    def raw(self, text: str) -> None:
        """The shell's own control characters, to the terminal at once."""
        sys.stdout.write(text)
        sys.stdout.flush()

    def ansi(self, lines: Iterable[Text | str]) -> str:
        """The lines with the terminal's codes for their colours, where it is one."""
        from rich.console import Console

        if not self.terminal or self.theme is PLAIN:
            return "".join((line if isinstance(line, str) else line.plain) + "\n" for line in lines)
        console = Console(force_terminal=True, width=100_000, highlight=False, markup=False, soft_wrap=True)
        with console.capture() as captured:
            for line in lines:
                console.print(line, end="\n")
        return captured.get()

    def _write(self, text: str, stream: TextIO) -> None:
        encoding = stream.encoding or "utf-8"
        stream.write(text.encode(encoding, "replace").decode(encoding))
        stream.flush()

    def _in_pager(self, text: str) -> None:
        command = shlex.split(os.environ.get("PAGER") or "less")
        if not command or shutil.which(command[0]) is None:
            self._write(text, sys.stdout)
            return
        environment = {**os.environ, "LESS": os.environ.get("LESS") or "-RSX", "LESSSECURE": "1"}
        with contextlib.suppress(BrokenPipeError), _ignoring_interrupts():
            subprocess.run(command, input=text.encode("utf-8", "replace"), env=environment, check=False)


@contextlib.contextmanager
def _ignoring_interrupts() -> Iterator[None]:
    # Ctrl-C inside the pager is the pager's.
    before = signal.signal(signal.SIGINT, signal.SIG_IGN)
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, before)


def clean_line(text: object) -> str:
    """One line without control characters."""
    return render.clean(text)


def clean_lines(text: str) -> str:
    """Several lines without other control characters."""
    return "\n".join(render.clean(line.expandtabs(2)) for line in text.split("\n"))
