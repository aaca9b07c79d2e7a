"""``:save``, ``:run``, ``:forget``, ``:read`` and ``:export``."""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING, Any

from cgdb.cli import values
from cgdb.cli.commands import words
from cgdb.cli.favourites import Favourite
from cgdb.cli.showing import show
from cgdb.errors import CgdbError, UsageError, did_you_mean, one_of
from cgdb.grammar.parser import parse, tokens

if TYPE_CHECKING:
    from cgdb.cli.session import Session

DEEPEST = 20
LARGEST = 1_000_000


def save(session: Session, rest: str) -> None:
    """Keep the last statement, with the parameters it speaks of."""
    if not rest:
        _list(session)
        return
    (name,) = words(rest, ":save NAME", least=1, most=1)
    if session.statement is None:
        raise UsageError("there is no statement to save yet")
    parse(session.statement)
    spoken = {
        session.statement[span.start + 1 : span.end] for span, kind in tokens(session.statement) if kind == "parameter"
    }
    kept: dict[str, Any] = {}
    for parameter in sorted(spoken & set(session.parameters)):
        value = session.parameters[parameter]
        value = value.tolist() if hasattr(value, "tolist") else value
        json.dumps(value)
        kept[parameter] = value
    session.favourites.save(name, Favourite(text=session.statement, parameters=kept))
    session.say(
        f"saved as {name}; `:run {name}` asks it" + (f" with {', '.join('$' + k for k in kept)}" if kept else "")
    )


def run(session: Session, rest: str) -> None:
    """Ask what was saved; other values of its parameters may follow its name."""
    if not rest:
        _list(session)
        return
    name, *given = words(rest, ":run NAME [name=value ...]", least=1)
    favourite = session.favourites.get(name)
    parameters = {**favourite.parameters, **session.parameters, **values.parameters(given)}
    known = {favourite.text[span.start + 1 : span.end] for span, kind in tokens(favourite.text) if kind == "parameter"}
    for word in given:
        named = word.partition("=")[0]
        if named not in known:
            hint = did_you_mean(named, known) or (f"it has {one_of(sorted(known))}" if known else "it has none")
            raise UsageError(f"'{name}' has no parameter ${named}", hint=hint)
    session.screen.print(session.screen.code(favourite.text))
    show(session, session.ask(favourite.text, parameters))


def forget(session: Session, rest: str) -> None:
    """Remove what was saved."""
    (name,) = words(rest, ":forget NAME", least=1, most=1)
    session.favourites.forget(name)
    session.say(f"{name} is forgotten")


def _list(session: Session) -> None:
    screen = session.screen
    kept = session.favourites.all()
    if not kept:
        screen.note("nothing is saved yet; `:save NAME` keeps the last statement")
    for name, favourite in kept.items():
        line = screen.text(("head", f"{name}  "))
        line.append_text(screen.code(" ".join(favourite.text.split())))
        if favourite.parameters:
            shown = ", ".join(f"${k} = {str(v)[:30]}" for k, v in favourite.parameters.items())
            line.append_text(screen.text(("faint", f"  ({shown})")))
        screen.print(line)


def read(session: Session, rest: str) -> None:
    """Run the statements and commands of a file."""
    from cgdb.cli.shell import run_script

    (name,) = words(rest, ":read FILE", least=1, most=1)
    path = str(Path(name).expanduser().resolve())
    if path in session.reading or len(session.reading) >= DEEPEST:
        raise UsageError(f"{name} reads itself" if path in session.reading else f"{name}: files read files too deeply")
    text = file_text(Path(path))
    session.reading += (path,)
    try:
        failed = run_script(session, text, name=name, bail=True)
    finally:
        session.reading = session.reading[:-1]
    if failed:
        raise Reported(f"{name} was not read to its end")


class Reported(UsageError):
    """An error inside a file, which has been shown already."""


def file_text(path: Path) -> str:
    """The text of a script."""
    try:
        if path.stat().st_size > LARGEST:
            raise UsageError(f"{path} is larger than {LARGEST:,} bytes: a script is not")
        return path.read_text("utf-8-sig")
    except OSError as error:
        raise UsageError(f"{path} cannot be read: {error.strerror or error}") from error
    except UnicodeDecodeError as error:
        raise UsageError(f"{path} is not UTF-8 text") from error


def export(session: Session, rest: str) -> None:
    """Write a scene to a file."""
    from cgdb.export import format_of

    usage = ":export FILE [scene] [format]"
    path, *more = words(rest, usage, least=1, most=3)
    db = session.db
    names = session.scenes()
    scene = more[0] if more else names[0] if len(names) == 1 else None
    if scene is None:
        raise UsageError(f"{len(names)} scenes are in use: say which", hint=f"{usage}; there are {one_of(names)}")
    form = more[1] if len(more) > 1 else format_of(Path(path))
    target = Path(path).expanduser()
    session.waiting(lambda: db.export(scene, target, form, as_of=session.use.as_of), lambda: None)
    session.say(f"wrote {path} ({form})")


def run_rc(session: Session, path: Path) -> list[tuple[int, CgdbError]]:
    """Run the options of an rc file; the lines that are wrong, with what is wrong."""
    from cgdb.cli import commands

    failed = []
    session.quiet = True
    for number, line in enumerate(file_text(path).splitlines(), start=1):
        text = line.strip()
        if not text or text.startswith(("//", "#")):
            continue
        try:
            commands.run(session, text, early=True)
        except CgdbError as error:
            failed.append((number, error))
    session.quiet = False
    return failed
