"""Dropping the old history of scenes: within one transaction, proved on what is left before it is committed.

A row that was closed with the oldest kept revision of its scene, or before, belongs to no kept one and goes; all others
stay as they are, to the bit. A scene keeps its last revision always, and with it its name, its number and the key that
its next object gets: nothing is ever named or numbered twice.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from datetime import UTC, datetime
from typing import TypeAlias

from sqlalchemy import Connection, LargeBinary, Table, Text, bindparam, delete, func, not_, select, update
from sqlalchemy.sql.elements import ColumnElement

from cgdb.errors import CorruptionError, StoreError, UsageError, did_you_mean, one_of
from cgdb.storage import damage, history, horizon, migrate, reader, schema
from cgdb.storage.horizon import Horizon

Before: TypeAlias = int | str | datetime | None
"""A revision, an ISO time or a moment."""


@dataclass(frozen=True, slots=True, kw_only=True)
class PrunedScene:
    """What goes of one scene: its revisions before kept_from, and the rows, with their bytes, that only these had."""

    scene: str
    kept_from: int
    revisions: int
    rows: int
    bytes: int


@dataclass(frozen=True, slots=True, kw_only=True)
class Pruned:
    """What went, or would go, by scene. size_before, size_after: bytes of the ledger on disk, with its log.

    notes: why the file is not shorter, where it could not be made so.
    """

    dry_run: bool
    scenes: tuple[PrunedScene, ...]
    size_before: int
    size_after: int
    notes: tuple[str, ...] = ()

    @property
    def revisions(self) -> int:
        """Of all scenes."""
        return sum(scene.revisions for scene in self.scenes)

    @property
    def rows(self) -> int:
        """Of all scenes."""
        return sum(scene.rows for scene in self.scenes)

    @property
    def bytes(self) -> int:
        """What the rows hold; the file also has what it takes to find them."""
        return sum(scene.bytes for scene in self.scenes)


@dataclass(frozen=True, slots=True, kw_only=True)
class Cut:
    """A scene that is to lose its revisions before one of them."""

    scene_id: int
    scene: str
    kept_from: int
    revisions: int
    first: int


def plan(connection: Connection, *, keep: int | None, before: Before, scenes: Sequence[str]) -> list[Cut]:
    """Where each scene is cut, of those that lose something. scenes: only these; none means all.

    keep: the last so many revisions of a scene stay. before: what a scene was then, and all since, stays. Of both, what
    either keeps stays.
    """
    if keep is None and before is None:
        raise UsageError("nothing says which history may go", hint="keep so many revisions, or those since a time")
    if keep is not None and keep < 1:
        raise UsageError(f"{keep} revisions cannot be kept: the last one of a scene always is", hint="1 or more")
    moment = None if before is None else _bound(connection, before)
    cuts: list[Cut] = []
    for name, number in _named(connection, scenes).items():
        table = schema.revisions.c
        mine = select(table.id).where(table.scene_id == number).order_by(table.id)
        own = list(connection.execute(mine).scalars())
        places = [] if keep is None else [max(0, len(own) - keep)]
        if moment is not None:
            places.append(max(0, sum(revision <= moment for revision in own) - 1))
        at = min(places)
        if at > 0:
            cuts.append(Cut(scene_id=number, scene=name, kept_from=own[at], revisions=at, first=own[0]))
    return cuts


def _named(connection: Connection, scenes: Sequence[str]) -> dict[str, int]:
    known = history.scene_names(connection)
    for name in scenes:
        if name not in known:
            hint = did_you_mean(name, known) or (f"there are {one_of(known)}" if known else "the store is empty")
            raise StoreError(f"there never was a scene '{name}'", hint=hint)
    return {name: known[name] for name in (sorted(set(scenes)) if scenes else known)}


def _bound(connection: Connection, before: int | str | datetime) -> int:
    """The revision that ``before`` stands for; 0 for a time when there was none yet, for then nothing is older."""
    moment = history.moment(before)
    if isinstance(moment, int):
        return history.resolve(connection, moment)
    if moment > datetime.now(UTC):
        raise StoreError(f"{moment.isoformat()} lies in the future", hint="to keep the present alone, keep 1 revision")
    return history.revision_at(connection, moment)


# --- what goes -------------------------------------------------------------------------------------------------------


def measure(connection: Connection, cut: Cut) -> PrunedScene:
    """How many rows go with a cut, and the bytes of what they hold."""
    rows = size = 0
    for table, condition in _doomed(connection, cut):
        texts = [column for column in table.columns if isinstance(column.type, (Text, LargeBinary))]
        lengths = [func.coalesce(func.sum(func.length(column)), 0) for column in texts]
        statement = select(func.count(), *lengths).select_from(table).where(condition)
        count, *held = connection.execute(statement).one()
        rows += int(count)
        size += sum(held) + 8 * count * (len(table.columns) - len(texts))
    return PrunedScene(scene=cut.scene, kept_from=cut.kept_from, revisions=cut.revisions, rows=rows, bytes=size)


def apply(connection: Connection, cuts: Sequence[Cut]) -> None:
    """Make the cuts, within a transaction that writes. CorruptionError where what is left is not what it must be."""
    for _ in history.read_revisions(connection):
        pass  # a chain that is broken must not be made whole over the break
    before = horizon.read(connection)
    new = []
    for cut in cuts:
        for table, condition in _doomed(connection, cut):
            connection.execute(delete(table).where(condition))
        versions, chain = schema.scene_versions, schema.revisions
        first_time = connection.execute(select(chain.c.time).where(chain.c.id == cut.first)).scalar_one()
        for table, revision in ((versions, versions.c.revision), (chain, chain.c.id)):
            connection.execute(delete(table).where(table.c.scene_id == cut.scene_id, revision < cut.kept_from))
        old = before.get(cut.scene_id)
        new.append(
            Horizon(
                scene_id=cut.scene_id,
                first=cut.first if old is None else old.first,
                first_time=first_time if old is None else old.first_time,
                kept_from=cut.kept_from,
                revisions=cut.revisions + (0 if old is None else old.revisions),
            )
        )
    horizon.write(connection, new)
    _chain_anew(connection)
    for _ in history.read_revisions(connection):
        pass
    for cut in cuts:
        _prove(connection, cut)


def _doomed(connection: Connection, cut: Cut) -> list[tuple[Table, ColumnElement[bool]]]:
    """The tables of rows, and which of theirs go; views after images, for these are told by them."""
    views, images = schema.views.c, schema.images.c
    used = select(views.image).where(
        views.scene_id == cut.scene_id,
        views.image.is_not(None),
        views.rev_to.is_(None) | (views.rev_to > cut.kept_from),
    )
    unused = (images.scene_id == cut.scene_id) & not_(images.digest.in_(used))
    every = [(schema.images, unused)]
    every += [
        (table, (table.c.scene_id == cut.scene_id) & (table.c.rev_to <= cut.kept_from))
        for table in schema.TEMPORAL.values()
    ]
    return [(table, condition) for table, condition in every if migrate.there(connection, table)]


def _chain_anew(connection: Connection) -> None:
    """Seal the revisions that are left, each over the one before it."""
    table = schema.revisions
    before = 0
    changed: list[dict[str, int]] = []
    for row in connection.execute(select(table).order_by(table.c.id)):
        values = tuple(row)
        before = history.revision_seal(values[:-1], before)
        if before != values[-1]:
            changed.append({"at": values[0], "new": before})
    if changed:
        statement = update(table).where(table.c.id == bindparam("at")).values(seal=bindparam("new"))
        connection.execute(statement, changed)


def _prove(connection: Connection, cut: Cut) -> None:
    """CorruptionError unless the rows that are left make up each state of the scene that is."""
    headers = history.read_versions(connection, cut.scene_id, cut.scene, history.latest(connection))
    for part in damage.parts(headers):
        wrong = damage.unsummed(headers, part, reader.sealed(connection, cut.scene_id, part))
        if wrong:
            raise CorruptionError(
                f"scene '{cut.scene}': {part} of revision {wrong[0][0].revision} would not be complete: "
                "the ledger is damaged, and nothing was pruned",
                hint="`cgdb check` lists what is damaged",
            )
