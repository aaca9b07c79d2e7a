"""``:all``, ``:x``, ``:why``, ``:map``, ``:plot``, ``:explain`` and ``:profile``: the last result once more."""

from __future__ import annotations

from typing import TYPE_CHECKING

from cgdb.cli import floorplan, render, tables
from cgdb.cli.commands import words
from cgdb.cli.marks import marks_of
from cgdb.cli.showing import cells, footer, show, why_lines
from cgdb.errors import UsageError

if TYPE_CHECKING:
    from rich.text import Text

    from cgdb.cli.session import Answer, Session
    from cgdb.result import Row


def all_(session: Session, rest: str) -> None:
    """Every row of the last result."""
    show(session, _last(session), everything=True)


def records(session: Session, rest: str) -> None:
    """One record per page; or one row of it; or switch it on or off for all results."""
    if rest.casefold() in ("on", "off", "auto"):
        session.settings.set("expand", rest)
        session.say(f"expand is {session.settings.shown('expand')}")
        return
    answer = _last(session)
    if not answer.result.rows:
        session.screen.note(footer(answer.result, 0))
        return
    if rest or not session.interactive or not session.screen.terminal:
        numbers = [_number(rest, answer)] if rest else range(1, len(answer.result.rows) + 1)
        for number in numbers:
            session.screen.print(*_record(session, answer, number, why=bool(rest)))
        return
    from cgdb.cli.pages import leaf

    leaf(session.screen, len(answer.result.rows), lambda n: _record(session, answer, n + 1, why=True))


def _record(session: Session, answer: Answer, number: int, *, why: bool) -> list[Text]:
    screen, result = session.screen, answer.result
    row = result.rows[number - 1]
    width = screen.limit
    made = cells(result, (row,), first=number)
    lines = tables.record(
        made, 0, screen, width=width, bars=session.settings["bars"] and screen.terminal, of=len(result.rows)
    )
    return lines + (why_lines(session, row) if why else [])


def why(session: Session, rest: str) -> None:
    """Why a row is there."""
    answer = _last(session)
    if not answer.result.rows:
        raise UsageError("the last result has no rows", hint="`:explain` shows how the statement was answered")
    if rest.casefold() == "all":
        numbers = list(range(1, len(answer.result.rows) + 1))
    else:
        numbers = [_number(rest, answer)] if rest else [1]
    lines: list[Text] = []
    for number in numbers:
        lines += _why_one(session, answer, number)
    session.screen.page(lines)


def _why_one(session: Session, answer: Answer, number: int) -> list[Text]:
    screen = session.screen
    row: Row = answer.result.rows[number - 1]
    head = screen.text(("faint", f"{number}  "))
    head.append_text(tables.scored(row.score, row.fits, screen, bars=False))
    head.append("  " + render.clean(", ".join(render.clean(value) for value in row.values)), screen.ink("id"))
    return [head, *session.waiting(lambda: why_lines(session, row), lambda: None)]


def map_(session: Session, rest: str) -> None:
    """The last result on a plan of the place, drawn with characters."""
    from cgdb.cli.plot import chosen_scene

    named = words(rest, ":map [scene]", most=1)
    result = session.last.result if session.last else None
    db, screen = session.db, session.screen
    marks = marks_of(db, result)
    scene = chosen_scene(db, marks, named[0] if named else _only(session))
    view = db.view(scene)
    found = marks.get(scene, {})
    shown = floorplan.plan(view, found)
    width = min(screen.width, 120)
    legend = _legend(session, shown, width)
    height = max(8, min(screen.room - len(legend) - 1, 40)) if screen.terminal else 30
    lines = floorplan.draw(shown, width, height)
    if not lines:
        raise UsageError(f"scene '{scene}' has no positions to draw")
    screen.print(*(screen.text(*line) for line in lines), *legend)
    others = sorted(name for name in marks if name != scene)
    if others:
        screen.note(f"{render.clean(scene)}; also found in {', '.join(others)} (:map SCENE)")
    elif result is not None and not found:
        screen.note("the last result holds no objects; return the object itself (RETURN o) to see where it is")


def _legend(session: Session, shown: floorplan.FloorPlan, width: int) -> list[Text]:
    """The numbers and names of what is marked, in columns, at most a few lines."""
    screen = session.screen
    entries = [(mark, f"{mark.number} {mark.area.name}".strip()) for mark in shown.marks]
    if not entries:
        return []
    size = min(30, max(len(text) for _, text in entries)) + 2
    across = max(1, width // size)
    lines = []
    most = across * (5 if len(entries) <= floorplan.MOST_NAMES and screen.height > 30 else 2)
    for start in range(0, min(len(entries), most), across):
        line = screen.text()
        for mark, text in entries[start : start + across]:
            cut = text if len(text) <= size - 2 else text[: size - 3] + "…"
            line.append(render.clean(cut).ljust(size), screen.ink("fits" if mark.fits else "misses"))
        line.rstrip()
        lines.append(line)
    if len(entries) > most:
        lines.append(screen.text(("faint", f"and {len(entries) - most} more")))
    return lines


def plot(session: Session, rest: str) -> None:
    """The plan as a picture."""
    from cgdb.cli.plot import draw

    path, *more = words(rest, ":plot FILE.png [scene]", least=1, most=2)
    result = session.last.result if session.last else None
    db = session.db
    scene = more[0] if more else _only(session)
    drawn = session.waiting(lambda: draw(db, result, path, scene=scene), lambda: None)
    session.say(f"wrote {path}: {drawn}")


def _only(session: Session) -> str | None:
    """The scene in use where there is just one."""
    return session.use.scenes[0] if len(session.use.scenes) == 1 else None


def explain(session: Session, rest: str) -> None:
    """How a statement, else the last one, would be answered."""
    _planned(session, rest, "EXPLAIN")


def profile(session: Session, rest: str) -> None:
    """Answer a statement, else the last one, and say what each step did."""
    _planned(session, rest, "PROFILE")


def _planned(session: Session, rest: str, word: str) -> None:
    text = rest or session.statement
    if text is None:
        raise UsageError("there is no statement to explain yet", hint=f":{word.casefold()} MATCH (o) RETURN o")
    text = text.strip().removesuffix(";")
    first, _, body = text.partition(" ")
    if first.upper() in ("EXPLAIN", "PROFILE"):
        text = body.lstrip()
    before = session.statement
    try:
        show(session, session.ask(text, mode=word))
    finally:
        session.statement = text if rest else before


def _last(session: Session) -> Answer:
    if session.last is None:
        raise UsageError("there is no result yet", hint='MATCH (o ~ "something to sit on") RETURN o')
    return session.last


def _number(text: str, answer: Answer) -> int:
    n = len(answer.result.rows)
    number = int(text) if text.isascii() and text.isdigit() and len(text) < 10 else 0
    if not 1 <= number <= n:
        raise UsageError(f"'{text[:20]}' is no row of the last result", hint=f"its rows are 1 to {n}")
    return number
