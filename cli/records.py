"""``:show``, ``:near``, ``:schema``, ``:scenes``, ``:use`` and ``:cypher``: the store itself."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING, Any

from cgdb.cli import render, tables
from cgdb.cli.commands import words
from cgdb.cli.session import Use, quoted
from cgdb.cli.tables import grid
from cgdb.cli.views import box_text, picture_text, record_of
from cgdb.cli.vocabulary import written_id
from cgdb.errors import UsageError, did_you_mean, one_of
from cgdb.index.catalog import merge
from cgdb.scene import canonical_id

if TYPE_CHECKING:
    from collections.abc import Sequence

    from rich.text import Text

    from cgdb.cli.session import Session
    from cgdb.result import StoredNode, StoredRelation
    from cgdb.scene import ObjectId, View
    from cgdb.view import SceneView

MOST_RELATIONS = 40
MOST_VIEWS = 3
_AS_OF = re.compile(r"(?:^|\s)as\s+of\s+(.+)$", re.IGNORECASE)


def show(session: Session, rest: str) -> None:
    """An object's record with its relations and places."""
    for word in words(rest, ":show #12", least=1, most=20):
        view, node = _located(session, word)
        _show_one(session, view, node)


def _located(session: Session, word: str) -> tuple[SceneView, StoredNode]:
    """The object of a word such as #12, 12 or #"chair-3"; of the last result's row where only that has it."""
    node_id: ObjectId = canonical_id(word.removeprefix("#") or word)
    db, use = session.db, session.use
    names = list(use.scenes) or [info.name for info in db.scenes(use.as_of)]
    views = [db.view(name, use.as_of) for name in names]
    found = [(view, position) for view in views if (position := view.find(node_id)) is not None]
    if not found:
        raise UsageError(
            f"there is no object or place #{render.clean(node_id)}", hint=f"looked in {one_of(names, most=4)}"
        )
    if len(found) > 1:
        held = [view.info.name for view, _ in found]
        raise UsageError(
            f"#{render.clean(node_id)} is in several scenes: {one_of(held, most=4)}", hint=f":use {held[0]}"
        )
    view, _ = found[0]
    return view, db.object(node_id, scene=view.info.name, as_of=use.as_of)


def _show_one(session: Session, view: SceneView, node: StoredNode) -> None:
    screen = session.screen
    name = view.info.name
    relations = session.db.relations(node.id, scene=name, as_of=session.use.as_of)
    views = session.db.views(node.id, scene=name, as_of=session.use.as_of)
    if session.settings["mode"] in ("json", "jsonl"):
        record = {
            **node.to_dict(),
            "relations": [relation.to_dict() for relation in relations],
            "views": [record_of(node.id, rank, seen) for rank, seen in enumerate(views, start=1)],
        }
        render.records([record], tuple(record), session.settings["mode"])
        return
    fields = _fields(node) + _views(views)
    inside = _places(view, node)
    if inside:
        fields.append(("in", ", ".join(inside)))
    lines = [
        screen.text(
            ("id", f"#{node.id}"), ("head", f" {node.tag or node.label}"), ("faint", f"  {node.label} of {name}")
        )
    ]
    size = min(20, max(len(field) for field, _ in fields))
    for field, value in fields:
        width = screen.width - size - 4 if screen.terminal else None
        for n, part in enumerate(tables.folded(render.clean(value), width)):
            lines.append(screen.text(("hint", f"  {field if n == 0 else '':<{size}}"), ("", f"  {part}")))
    lines += _relation_lines(session, view, node, relations)
    screen.page(lines)


def _fields(node: StoredNode) -> list[tuple[str, Any]]:
    fields: list[tuple[str, Any]] = []
    if node.caption:
        fields.append(("caption", node.caption))
    if node.tags:
        fields.append(("tags", ", ".join(node.tags)))
    if node.center is not None:
        fields.append(("center", " ".join(f"{x:.2f}" for x in node.center.tolist()) + " m"))
    if node.extent is not None:
        turned = node.rotation is not None and abs(float(node.rotation.trace()) - 3.0) > 1e-6
        size = " × ".join(f"{x:.2f}" for x in node.extent.tolist())
        fields.append(("size", size + " m" + (", turned" if turned else "")))
    if node.n_observations is not None:
        fields.append(("seen", f"in {node.n_observations} view{'' if node.n_observations == 1 else 's'}"))
    if node.confidence is not None:
        fields.append(("confidence", f"{node.confidence:.2f}"))
    fields += [(name, value) for name, value in node.properties.items() if value is not None]
    return fields or [("", "nothing more is known of it")]


def _views(views: Sequence[View]) -> list[tuple[str, Any]]:
    """The frames in which it was seen best, a line for each of the first few."""
    fields: list[tuple[str, Any]] = []
    for rank, view in enumerate(views[:MOST_VIEWS]):
        source = f" ({view.source})" if view.source else ""
        line = f"frame {view.frame}{source}, {view.points} points, {box_text(view)}, picture: {picture_text(view)}"
        fields.append(("best views" if rank == 0 else "", line))
    if len(views) > MOST_VIEWS:
        fields.append(("", f"and {len(views) - MOST_VIEWS} more (cgdb views)"))
    return fields


def _places(view: SceneView, node: StoredNode) -> list[str]:
    """The places whose box holds the center of the object, smallest first."""
    import numpy as np

    if node.center is None or node.label != "Object":
        return []
    columns = view.columns
    places = np.flatnonzero(columns.label_codes != columns.labels.index("Object"))
    boxes = columns.boxes.take(places)
    with np.errstate(invalid="ignore"):
        holds = np.asarray((np.abs(boxes.centers - node.center) <= boxes.half_hulls + 1e-9).all(axis=1))
    volume = np.nan_to_num(boxes.extents.prod(axis=1), nan=np.inf)
    held = [int(places[i]) for i in np.argsort(volume) if holds[i]]
    records = view.stored(np.asarray(held[:4], np.int64))
    return [
        f"{records[p].tag or records[p].properties.get('name') or ''} (#{records[p].id} {records[p].label})".strip()
        for p in held[:4]
    ]


def _relation_lines(
    session: Session, view: SceneView, node: StoredNode, relations: Sequence[StoredRelation]
) -> list[Text]:
    import numpy as np

    screen = session.screen
    shown = relations[:MOST_RELATIONS]
    ends = {end for relation in shown for end in (relation.source, relation.target)}
    positions = {end: view.position(end) for end in ends}
    records = view.stored(np.asarray(sorted(positions.values()), np.int64))
    lines = []
    size = min(24, max((len(render.clean(relation.label)) for relation in shown), default=0)) + 2
    for relation in shown:
        out = relation.source == node.id
        other = records[positions[relation.target if out else relation.source]]
        arrow = f"─{relation.label}→" if out else f"←{relation.label}─"
        line = screen.text(
            ("", "  "),
            ("hint", f"{render.clean(arrow):<{size}}"),
            ("id", f" #{other.id}"),
            ("", f" {other.tag or other.label}"),
        )
        more = relation.origin + (f" {relation.confidence:.2f}" if relation.confidence < 1 else "")
        line.append_text(screen.text(("faint", f"  {more}")))
        lines.append(line)
        if relation.explanation:
            width = screen.width - 6 if screen.terminal else None
            lines += [
                screen.text(("faint", f"      {part}"))
                for part in tables.folded(render.clean(relation.explanation), width)
            ]
    if len(relations) > len(shown):
        lines.append(screen.text(("faint", f"  and {len(relations) - len(shown)} relations more")))
    return lines


def near(session: Session, rest: str) -> None:
    """What is near an object, nearest first."""
    word, *more = words(rest, ":near #12 [metres]", least=1, most=2)
    try:
        metres = float(more[0].removesuffix("m")) if more else 1.0
    except ValueError:
        metres = -1.0
    if not 0 < metres < 1e7:
        raise UsageError(f"'{more[0][:20]}' is no distance in metres")
    view, node = _located(session, word)
    as_of = f"AS OF {view.info.revision} " if session.use.as_of is not None else ""
    reference = f"#{written_id(node.id)}"
    db = session.db
    text = (
        f"USE {quoted(view.info.name)} {as_of}MATCH (o) WHERE distance(o, {reference}) <= {metres:g} m "
        f"RETURN o, distance(o, {reference}) AS metres, o.caption ORDER BY metres, id(o) LIMIT 200"
    )
    answer = session.waiting(lambda: db.query(text), db.cancel)
    screen = session.screen
    rows = [row.values for row in answer.rows if row.values[0].id != node.id]  # type: ignore[union-attr]
    made = grid(("object", "metres", "caption"), rows)
    width = screen.width if screen.terminal else None
    screen.page(tables.table(made, screen, width=width, bars=False, numbered=False) or [] if rows else [])
    session.say(f"{len(rows)} within {metres:g} m of {node}" if rows else f"nothing within {metres:g} m of {node}")


def schema(session: Session, rest: str) -> None:
    """Labels, relations and properties."""
    db, screen = session.db, session.screen
    names = list(session.use.scenes) or [info.name for info in db.scenes(session.use.as_of)]
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
    width = screen.width if screen.terminal else None
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
    width = screen.width if screen.terminal else None
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
