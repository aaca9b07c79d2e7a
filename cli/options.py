"""``:set``, ``:unset``, ``:mode``, ``:timing`` and ``:theme``."""

from __future__ import annotations

import difflib
from typing import TYPE_CHECKING, Any

from cgdb.cli import render, values
from cgdb.cli.settings import MODES, OPTIONS
from cgdb.cli.tables import grid, table
from cgdb.cli.themes import THEMES
from cgdb.errors import UsageError, did_you_mean

if TYPE_CHECKING:
    from cgdb.cli.session import Session


def set_(session: Session, rest: str) -> None:
    """Set a parameter or an option; show them all, or one."""
    name, _, text = rest.partition(" ")
    if "=" in name and not text:
        name, _, text = rest.partition("=")
    text = text.strip().removeprefix("= ").strip()
    if not name:
        _list(session)
        return
    parameter = name.startswith("$") or name not in OPTIONS
    name = name.removeprefix("$")
    if not name.isidentifier():
        raise UsageError(f"'{name[:40]}' cannot be the name of a parameter", hint=":set name value")
    if not text:
        _show(session, name, parameter=parameter)
    elif parameter:
        session.parameters[name] = _value(text)
        session.say(f"parameter ${name} = {_shown(session.parameters[name])}")
        near = difflib.get_close_matches(name, list(OPTIONS), n=1)
        if near and not rest.startswith("$"):
            session.say(f"there is an option of nearly that name: `:set {near[0]} ...`", "hint")
    else:
        session.settings.set(name, text)
        _say(session, name)


def _value(text: str) -> Any:
    if len(text) > 1 and text[0] == text[-1] == "'":
        # JSON knows double quotes only; people type either.
        return text[1:-1]
    return values.parameter(text)


def _shown(value: Any) -> str:
    if isinstance(value, str):
        return repr(value if len(value) <= 60 else value[:59] + "…")
    if hasattr(value, "shape"):
        return f"vector of {value.shape[0]}"
    return render.clean(str(value))[:80]


def _show(session: Session, name: str, *, parameter: bool) -> None:
    if not parameter:
        _say(session, name)
    elif name in session.parameters:
        session.screen.print(session.screen.text(("", f"${name} = {_shown(session.parameters[name])}")))
    else:
        hint = did_you_mean(name, (*session.parameters, *OPTIONS))
        raise UsageError(f"there is no parameter or option '{name}'", hint=hint or f":set {name} VALUE makes one")


def _list(session: Session) -> None:
    screen = session.screen
    rows = [(name, session.settings.shown(name), option.says) for name, option in OPTIONS.items()]
    rows += [(f"${name}", _shown(value), "parameter") for name, value in session.parameters.items()]
    width = screen.limit
    screen.print(
        *(table(grid(("name", "value", "what it is"), rows), screen, width=width, bars=False, numbered=False) or ())
    )


def _say(session: Session, name: str) -> None:
    session.say(f"{name} is {session.settings.shown(name)}")


def unset(session: Session, rest: str) -> None:
    """Forget a parameter, or give an option the value that it had at first."""
    name = rest.removeprefix("$")
    if name in session.parameters:
        del session.parameters[name]
        session.say(f"${name} is forgotten")
    elif name in OPTIONS:
        session.settings.reset(name)
        _say(session, name)
    else:
        raise UsageError(
            f"there is no parameter or option '{name[:40]}'", hint=did_you_mean(name, (*session.parameters, *OPTIONS))
        )


def mode(session: Session, rest: str) -> None:
    """How results are written."""
    _choose(session, "mode", rest, MODES)


def theme(session: Session, rest: str) -> None:
    """The colours."""
    _choose(session, "theme", rest, (*THEMES, "auto"))


def _choose(session: Session, name: str, rest: str, known: tuple[str, ...]) -> None:
    if rest:
        session.settings.set(name, rest)
        _say(session, name)
    else:
        session.screen.note(f"{name} is {session.settings.shown(name)}; there are {', '.join(known)}")


def timing(session: Session, rest: str) -> None:
    """Say how long each stage took, or no longer."""
    if rest:
        session.settings.set("timing", rest)
    else:
        session.settings.toggle("timing")
    _say(session, "timing")
