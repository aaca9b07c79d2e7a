"""``:schema``, ``:scenes``, ``:use`` and ``:cypher``: what there is to ask, and which part of it is asked."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING, Any

from cgdb.cli import render, tables
from cgdb.cli.commands import words
from cgdb.cli.session import Use
from cgdb.cli.tables import grid
from cgdb.errors import UsageError, did_you_mean, one_of
from cgdb.index.catalog import merge

if TYPE_CHECKING:
    from collections.abc import Sequence

    from rich.text import Text

    from cgdb.cli.session import Session

_AS_OF = re.compile(r"(?:^|\s)as\s+of\s+(.+)$", re.IGNORECASE)


def schema(session: Session, rest: str) -> None:
    """Labels, relations and properties."""
    db, screen = session.db, session.screen
    names = session.scenes()
    views = [db.view(name, session.use.as_of) for name in names]
    catalog = merge(view.catalog for view in views)
    lines = [screen.text(("head", "labels"))]
    lines += _columns(
        session, [(name, f"{count:,}") for name, count in sorted(catalog.labels.items(), key=lambda i: -i[1])]
    )
    lines.append(screen.text(("head", "relations")))
    relations = sorted(catalog.relations, key=lambda label: -catalog.relation_count(label))
    rows = []
    for label in relations:
        ends = sorted(catalog.relations[label].items(), key=lambda item: -item[1])
        told = ", ".join(f"{a}→{b}" for (a, b), _ in ends[:3])
        rows.append((label, f"{catalog.relation_count(label):,}", told))
    lines += _columns(session, rows)
    lines.append(screen.text(("head", "properties")))
    rows = []
    for name, kind in sorted(catalog.properties.items()):
        values = session.vocabulary.values(name)[:6]
        rows.append((name, kind, ", ".join(values)))
    lines += _columns(session, rows)
    screen.page(lines)


def _columns(session: Session, rows: Sequence[Sequence[str]]) -> list[Text]:
    screen = session.screen
    if not rows:
        return [screen.text(("faint", "  none"))]
    sizes = [min(32, max(len(render.clean(row[i])) for row in rows)) for i in range(len(rows[0]))]
    lines = []
    for name, *more in rows:
        line = screen.text(("", f"  {render.clean(name):<{sizes[0]}}"))
        for size, cell in zip(sizes[1:], more, strict=True):
            text = render.clean(cell)
            room = max(8, screen.width - len(line.plain) - 2) if screen.terminal else len(text)
            line.append_text(
                screen.text(("faint", f"  {(text if len(text) <= room else text[: room - 1] + '…'):<{size}}"))
            )
        line.rstrip()
        lines.append(line)
    return lines


def scenes(session: Session, rest: str) -> None:
    """The scenes of the store."""
    screen = session.screen
    rows = [
        (
            "●" if info.name in session.use.scenes else "",
            info.name,
            info.n_objects,
            info.n_places,
            info.n_relations,
            info.revision,
            ", ".join(space.name for space in info.spaces),
        )
        for info in session.db.scenes(session.use.as_of)
    ]
    made = grid(("", "scene", "objects", "places", "relations", "revision", "features"), rows)
    width = screen.limit
    lines = tables.table(made, screen, width=width, bars=False, numbered=False)
    screen.page(lines or [render.clean(row[1]) for row in rows])


def use(session: Session, rest: str) -> None:
    """Choose the scenes that statements without USE ask; none: all of them, as they are now."""
    as_of: int | str | None = None
    if moment := _AS_OF.search(rest):
        text = moment[1].strip().strip("'\"")
        as_of = int(text) if text.isdecimal() and len(text) < 19 else text
        rest = rest[: moment.start()]
    wanted = words(rest.replace(",", " "), ":use [scene ...] [AS OF revision]")
    db = session.db
    known = [info.name for info in db.scenes(as_of)]
    for name in wanted:
        if name not in known:
            raise UsageError(
                f"there is no scene '{name[:60]}'", hint=did_you_mean(name, known) or f"there are {one_of(known)}"
            )
    session.use = Use(scenes=tuple(dict.fromkeys(wanted)), as_of=as_of)
    session.vocabulary.fill(db, session.use.scenes, as_of)
    when = "" if as_of is None else f" as of {as_of}"
    session.say(f"statements ask {', '.join(session.use.scenes) or 'all scenes'}{when}")


def cypher(session: Session, rest: str) -> None:
    """Read-only Cypher on the graph index of the scene in use."""
    if not rest:
        raise UsageError(
            "the command is: :cypher MATCH (a:Node)-[r:Rel]->(b:Node) RETURN a.tag, r.label, b.tag LIMIT 5"
        )
    db = session.db
    scene = session.use.scenes[0] if len(session.use.scenes) == 1 else None
    answer = session.waiting(lambda: db.cypher(rest, scene=scene), db.cancel)
    screen, form = session.screen, session.settings["mode"]
    rows = list(answer.rows())
    if form not in ("table", "tree"):
        render.records([_plain(dict(zip(answer.columns, row, strict=True))) for row in rows], answer.columns, form)
        return
    width = screen.limit
    made = grid(answer.columns, [[_told(value) for value in row] for row in rows])
    lines = tables.table(made, screen, width=width, bars=False, numbered=False)
    if lines is None:
        lines = [line for n in range(len(rows)) for line in tables.record(made, n, screen, width=width, bars=False)]
    screen.page(lines)
    session.say(f"{len(rows):,} row{'' if len(rows) == 1 else 's'}")


def _told(value: Any) -> Any:
    """A node or relation of the graph engine in one cell."""
    if isinstance(value, dict) and "_label" in value:
        if "_src" in value:
            return value.get("label")
        return f"#{value.get('id')} {value.get('tag') or ''}".strip()
    return [_told(item) for item in value] if isinstance(value, list) else value


def _plain(value: Any) -> Any:
    """A value of the graph engine as JSON holds it."""
    if isinstance(value, dict):
        return {str(name): _plain(item) for name, item in value.items()}
    if isinstance(value, (list, tuple)):
        return [_plain(item) for item in value]
    return value if value is None or isinstance(value, (str, int, float, bool)) else str(value)
