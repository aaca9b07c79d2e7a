"""``:show`` and ``:near``: an object of the store, and what is about it."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from cgdb.cli import render, tables
from cgdb.cli.commands import words
from cgdb.cli.session import quoted
from cgdb.cli.tables import grid
from cgdb.cli.views import box_text, picture_text, record_of
from cgdb.cli.vocabulary import written_id
from cgdb.errors import UsageError, one_of
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


def show(session: Session, rest: str) -> None:
    """An object's record with its relations and places."""
    for word in words(rest, ":show #12", least=1, most=20):
        view, node = _located(session, word)
        _show_one(session, view, node)


def _located(session: Session, word: str) -> tuple[SceneView, StoredNode]:
    """The object of a word such as #12, 12 or #"chair-3"; of the last result's row where only that has it."""
    node_id: ObjectId = canonical_id(word.removeprefix("#") or word)
    db, use = session.db, session.use
    names = session.scenes()
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
    width = screen.limit
    screen.page(tables.table(made, screen, width=width, bars=False, numbered=False) or [] if rows else [])
    session.say(f"{len(rows)} within {metres:g} m of {node}" if rows else f"nothing within {metres:g} m of {node}")
