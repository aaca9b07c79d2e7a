"""The commands of the shell: what each is called, takes and says; and how one is run."""

from __future__ import annotations

import shlex
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from importlib import import_module
from typing import TYPE_CHECKING

from cgdb.errors import UsageError, did_you_mean

if TYPE_CHECKING:
    from cgdb.cli.session import Session


@dataclass(frozen=True, slots=True, kw_only=True)
class Command:
    """home: "module:function" of cgdb.cli, called with the session and the rest of the line.

    takes: as help shows it; kind: what completion offers for it. early: may stand in the rc file.
    """

    home: str
    says: str
    takes: str = ""
    kind: str = ""
    early: bool = False

    def run(self, session: Session, rest: str) -> None:
        """Do it."""
        module, _, name = self.home.partition(":")
        function: Callable[[Session, str], None] = getattr(import_module(f"cgdb.cli.{module}"), name)
        function(session, rest)


COMMANDS: Mapping[str, Command] = {
    "help": Command(home="helping:help_", takes="[topic]", kind="topic", says="this list, or a topic of the language"),
    "quit": Command(home="commands:quit_", says="leave (Ctrl-D)"),
    "ask": Command(home="plainly:ask", takes="question", says="a question in plain words; bare words are one too"),
    "all": Command(home="looking:all_", says="every row of the last result, in the pager"),
    "x": Command(home="looking:records", takes="[row|on|off]", says="one record per page; or one row; or always"),
    "why": Command(home="looking:why", takes="[row|all]", says="why a row of the last result is there"),
    "map": Command(home="looking:map_", takes="[scene]", kind="scene", says="the last result on a plan of the place"),
    "plot": Command(home="looking:plot", takes="FILE.png [scene]", kind="file", says="the plan as a picture"),
    "show": Command(home="records:show", takes="#id", kind="object", says="an object's record, relations and places"),
    "near": Command(home="records:near", takes="#id [metres]", kind="object", says="what is near an object (1 m)"),
    "schema": Command(home="scenes:schema", says="labels, relations and properties of the scenes in use"),
    "scenes": Command(home="scenes:scenes", says="the scenes of the store"),
    "use": Command(home="scenes:use", takes="[scene ...] [AS OF revision]", kind="scene", says="what statements ask"),
    "explain": Command(home="looking:explain", takes="[statement]", kind="statement", says="how it would be answered"),
    "profile": Command(home="looking:profile", takes="[statement]", kind="statement", says="what each step really did"),
    "mode": Command(home="options:mode", takes="[mode]", kind="mode", early=True, says="how results are written"),
    "set": Command(home="options:set_", takes="[name value]", kind="set", early=True, says="parameters and options"),
    "unset": Command(home="options:unset", takes="name", kind="parameter", says="forget a parameter"),
    "timing": Command(home="options:timing", takes="[on|off]", early=True, says="say how long each stage took"),
    "theme": Command(home="options:theme", takes="[name]", kind="theme", early=True, says="dark, light, plain or auto"),
    "save": Command(home="keeping:save", takes="NAME", kind="favourite", says="keep the last statement by name"),
    "run": Command(home="keeping:run", takes="NAME [name=value ...]", kind="favourite", says="run what was saved"),
    "forget": Command(home="keeping:forget", takes="NAME", kind="favourite", says="remove what was saved"),
    "read": Command(home="keeping:read", takes="FILE", kind="file", says="run statements and commands of a file"),
    "export": Command(
        home="keeping:export", takes="FILE [scene] [format]", kind="file", says="write a scene to a file"
    ),
    "cypher": Command(home="scenes:cypher", takes="statement", says="read-only Cypher on the graph index"),
}
ALIASES: Mapping[str, str] = {
    "q": "quit",
    "exit": "quit",
    "h": "help",
    "?": "help",
    "w": "why",
    "s": "show",
    "n": "near",
    "m": "map",
    "r": "run",
    "favourites": "run",
    "favorites": "run",
    "expand": "x",
    "options": "set",
}


class Quit(Exception):
    """Asked for by ``:quit``."""


def run(session: Session, text: str, *, early: bool = False) -> None:
    """Run one command line. UsageError, with the nearest name, where there is no such command."""
    name, _, rest = text.lstrip().removeprefix(":").partition(" ")
    command = find(name)
    if early and not command.early:
        raise UsageError(f"':{name}' cannot stand in the rc file", hint="it is for :set, :mode, :theme and :timing")
    command.run(session, rest.strip())


def find(name: str) -> Command:
    """The command of that name or alias; a beginning that only one has will do."""
    word = name.casefold()
    word = ALIASES.get(word, word)
    if word in COMMANDS:
        return COMMANDS[word]
    begun = [known for known in COMMANDS if word and known.startswith(word)]
    if len(begun) == 1:
        return COMMANDS[begun[0]]
    hint = did_you_mean(word, (*COMMANDS, *ALIASES))
    if begun:
        hint = "it may be " + " or ".join(f":{known}" for known in begun)
    elif hint:
        hint = hint.replace("'", "':", 1)
    raise UsageError(f"there is no command ':{name[:40]}'", hint=hint or "`:help` lists them")


def words(text: str, usage: str, *, least: int = 0, most: int = 99) -> list[str]:
    """The words of an argument, quotes as in a POSIX shell. UsageError with the usage where their number is wrong."""
    try:
        # "#" begins an id here, never a comment.
        found = shlex.split(text, comments=False)
    except ValueError:
        raise UsageError("a quote is not closed", hint=usage) from None
    if not least <= len(found) <= most:
        raise UsageError(f"the command is: {usage}")
    return found


def quit_(session: Session, rest: str) -> None:
    """Leave the shell."""
    raise Quit
