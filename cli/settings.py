"""The options of the shell: their kinds and values, and where its files are kept."""

from __future__ import annotations

import os
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from cgdb.cli.themes import THEMES
from cgdb.errors import UsageError, did_you_mean, one_of

MODES = ("table", "json", "jsonl", "csv", "markdown", "tree")


@dataclass(frozen=True, slots=True, kw_only=True)
class Option:
    """choices: what it may be; a number (at least 0) where there are none. says: one line of help."""

    start: Any
    says: str
    choices: tuple[str, ...] = ()


OPTIONS: Mapping[str, Option] = {
    "mode": Option(start="table", choices=MODES, says="how results are written"),
    "rows": Option(start=None, choices=("auto",), says="rows of a table that are shown; auto: what fits the screen"),
    "width": Option(start=None, choices=("auto",), says="columns that a table may take; auto: the terminal's"),
    "expand": Option(start="auto", choices=("auto", "on", "off"), says="records one under another; auto: if too wide"),
    "why": Option(start=False, choices=("on", "off"), says="say of every row why it is there"),
    "bars": Option(start=True, choices=("on", "off"), says="draw scores as bars"),
    "timing": Option(start=False, choices=("on", "off"), says="say how long each stage took"),
    "timeout": Option(start=None, choices=("off",), says="seconds after which a query gives up"),
    "theme": Option(start="auto", choices=("auto", *THEMES), says="colours for a dark or a light terminal"),
    "pager": Option(start=True, choices=("on", "off"), says="show what is longer than the screen in $PAGER"),
    "vi": Option(start=False, choices=("on", "off"), says="edit with the keys of vi"),
    "suggest": Option(start=True, choices=("on", "off"), says="offer completions and earlier statements while typing"),
}
_NONE = {"rows": "auto", "width": "auto", "timeout": "off"}
_WORDS = {"on": True, "true": True, "yes": True, "1": True, "off": False, "false": False, "no": False, "0": False}


class Settings:
    """The options as they are set now."""

    def __init__(self) -> None:
        self._values: dict[str, Any] = {name: option.start for name, option in OPTIONS.items()}

    def __getitem__(self, name: str) -> Any:
        return self._values[name]

    def shown(self, name: str) -> str:
        """The value as ``:set`` takes it."""
        value = self._values[name]
        if value is None:
            return _NONE[name]
        if isinstance(value, bool):
            return "on" if value else "off"
        return f"{value:g}" if isinstance(value, float) else str(value)

    def set(self, name: str, text: str) -> None:
        """Set an option from what a person typed. UsageError names what it may be."""
        option = OPTIONS.get(name)
        if option is None:
            raise UsageError(
                f"there is no option '{name}'", hint=did_you_mean(name, OPTIONS) or one_of(OPTIONS, most=20)
            )
        word = text.strip().casefold()
        if isinstance(option.start, bool):
            if word not in _WORDS:
                raise UsageError(f"{name} is on or off, not '{text[:40]}'")
            self._values[name] = _WORDS[word]
        elif isinstance(option.start, str):
            if word not in option.choices:
                raise UsageError(
                    f"{name} cannot be '{text[:40]}'",
                    hint=did_you_mean(word, option.choices) or f"it may be {one_of(option.choices)}",
                )
            self._values[name] = word
        elif word == _NONE[name]:
            self._values[name] = None
        else:
            self._values[name] = _number(name, text)

    def reset(self, name: str) -> None:
        """Give an option the value that it had at first."""
        self._values[name] = OPTIONS[name].start

    def toggle(self, name: str) -> bool:
        """Turn an option on or off; what it is now."""
        self._values[name] = not self._values[name]
        return bool(self._values[name])


def _number(name: str, text: str) -> float:
    try:
        number = float(text) if name == "timeout" else int(text)
    except ValueError:
        number = -1
    least = {"width": 20, "rows": 1}.get(name, 0)
    if not least <= number < 1e6 or (name == "timeout" and number == 0):
        raise UsageError(
            f"{name} is {_NONE[name]} or a number{f' from {least}' if least else ' above 0'}, not '{text[:40]}'"
        )
    return number


def folder(kind: str) -> Path:
    """The folder of "config" or "state" files of cgdb, by the XDG rules; it need not exist yet."""
    variable, default = {"config": ("XDG_CONFIG_HOME", ".config"), "state": ("XDG_STATE_HOME", ".local/state")}[kind]
    given = os.environ.get(variable, "")
    # The rules say that a relative path in these variables is to be ignored.
    return (Path(given) if Path(given).is_absolute() else Path.home() / default) / "cgdb"
