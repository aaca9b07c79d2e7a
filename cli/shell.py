"""``cgdb shell STORE``, or ``cgdb STORE``: statements and commands, from a person at a terminal or from a script."""

from __future__ import annotations

import sys
from argparse import Namespace
from pathlib import Path

from cgdb.cli import commands, keeping, script, values
from cgdb.cli.opening import Opening
from cgdb.cli.screen import clean_line
from cgdb.cli.session import Session
from cgdb.cli.settings import folder
from cgdb.cli.showing import show
from cgdb.errors import CgdbError, QueryCancelled, UsageError

RC = "shellrc"


def shell(options: Namespace) -> int:
    """Run what -c and -f give, or else what a terminal's person types, or else stdin."""
    scripted = bool(options.pieces) or not sys.stdin.isatty()
    session = Session(Opening(options.store), interactive=not scripted)
    session.parameters.update(values.parameters(options.parameters))
    try:
        if scripted:
            return _scripts(session, options)
        return _prompt(session, options)
    finally:
        session.opening.close()


def _scripts(session: Session, options: Namespace) -> int:
    """The exit code is that of the first error."""
    if options.mode is not None:
        session.settings.set("mode", options.mode)
    first = 0
    for kind, given in options.pieces or [("file", "-")]:
        if kind == "text":
            text, name = given, None
        elif given == "-":
            text, name = sys.stdin.read(), None
        else:
            text, name = keeping.file_text(Path(given)), given
        try:
            failed = run_script(session, text, name=name, bail=options.bail)
        except commands.Quit:
            break
        first = first or failed
        if failed and options.bail:
            break
    return first


def _prompt(session: Session, options: Namespace) -> int:
    from cgdb.cli.prompt import converse

    rc = folder("config") / RC
    if not options.no_rc and rc.exists():
        for number, error in keeping.run_rc(session, rc):
            session.screen.note(f"{rc}:{number}: {error.message}" + (f" ({error.hint})" if error.hint else ""), "error")
    if options.mode is not None:
        session.settings.set("mode", options.mode)
    return converse(session)


def run_script(session: Session, text: str, *, name: str | None = None, bail: bool = False) -> int:
    """Run the pieces of a text; the exit code of the first that failed, 0 where none did. bail: stop there."""
    first = 0
    for piece in script.pieces(text):
        try:
            run(session, piece)
        except keeping.Reported as error:
            first = first or error.exit_code
        except QueryCancelled as error:
            report(session, error)
            return first or error.exit_code
        except CgdbError as error:
            where = f"{name}:{piece.line}: " if name is not None else f"line {piece.line}: " if piece.line > 1 else ""
            report(session, error, where=where)
            first = first or error.exit_code
        if first and bail:
            break
    return first


def run(session: Session, piece: script.Piece) -> None:
    """Run one statement or command."""
    if piece.command:
        commands.run(session, piece.text)
    else:
        if len(piece.text) > 1 and piece.text[0] in ".\\" and piece.text[1].isalpha():
            # Whoever comes from sqlite3 or psql.
            name = piece.text[1:].split()[0]
            raise UsageError(f"commands begin with a colon: ':{name}'", hint="`:help` lists them")
        from cgdb.cli import plainly

        if plainly.is_question(piece.text):
            plainly.ask(session, piece.text)
        else:
            show(session, session.ask(piece.text))


def report(session: Session, error: CgdbError, *, where: str = "", typed: str | None = None, lead: int = 0) -> None:
    """An error for a person. typed: what stands on the line above, after so many columns, for the caret below it."""
    screen = session.screen
    if isinstance(error, QueryCancelled):
        screen.note(error.message)
        return
    stage = f"{where}{error.stage} error"
    column = _column(error, typed, lead, screen.width)
    lines = []
    if column is not None and error.span is not None and error.source is not None:
        width = max(1, min(error.span.end, len(error.source)) - error.span.start)
        lines.append(screen.text(("error", " " * column + "^" * width)))
        lines.append(screen.text(("error", stage), ("", f": {error.message}")))
        if error.hint:
            lines.append(screen.text(("hint", f"hint: {error.hint}")))
    else:
        first, *more = error.render().split("\n")
        lines.append(screen.text(("error", stage), ("", first.removeprefix(f"{error.stage} error"))))
        for line in more:
            part = "hint" if line.startswith("hint: ") else "error" if line.strip(" |^") == "" else ""
            lines.append(screen.text((part, clean_line(line))))
    screen.error(*lines)


def _column(error: CgdbError, typed: str | None, lead: int, width: int) -> int | None:
    """The column of the caret right under what was typed; None where that is not one line of plain characters."""
    if typed is None or error.span is None or error.source is None:
        return None
    begin = typed.find(error.source.rstrip())
    # A letter that is two columns wide would put the caret off its place.
    plain = typed.isascii() and "\n" not in typed and lead + len(typed) < width
    return lead + begin + error.span.start if plain and begin >= 0 else None
