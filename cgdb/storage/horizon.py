"""From where on the history of each scene can be read: what is left of the revisions that were pruned.

A question that is older must not be answered as if there had been nothing. So of each scene with a pruned past it is
kept when it began, and which of its revisions is the oldest one now.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

from sqlalchemy import Connection, delete, insert, select

from cgdb.errors import CorruptionError, StoreError
from cgdb.storage import migrate, rows, schema

_NOTE = "pruned"
"""The row of ``meta`` with the digest of all horizons: one that is lost must not look like a scene's beginning."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Horizon:
    """A scene whose history was pruned. revisions: how many went; first_time: of its very first, in microseconds."""

    scene_id: int
    first: int
    first_time: int
    kept_from: int
    revisions: int

    def hides(self, revision: int) -> bool:
        """Whether the state of the scene at a revision was pruned; before its first, it was not there."""
        return self.first <= revision < self.kept_from


def read(connection: Connection) -> dict[int, Horizon]:
    """{scene id: its horizon}, of the scenes that have one."""
    table = schema.horizons
    if not migrate.there(connection, table):
        return {}
    found = [tuple(row) for row in connection.execute(select(table).order_by(table.c.scene_id))]
    note = connection.execute(select(schema.meta.c.value).where(schema.meta.c.name == _NOTE)).scalar()
    if note != (_digest(found) if found else None) or any(row[-1] != rows.record_digest(row[:-1]) for row in found):
        raise CorruptionError("what the ledger knows of its pruned history is damaged")
    return {
        row[0]: Horizon(scene_id=row[0], first=row[1], first_time=row[2], kept_from=row[3], revisions=row[4])
        for row in found
    }


def write(connection: Connection, horizons: Iterable[Horizon]) -> None:
    """Note horizons, each instead of an older one of its scene."""
    table, meta = schema.horizons, schema.meta
    every = read(connection) | {horizon.scene_id: horizon for horizon in horizons}
    made = []
    for number in sorted(every):
        one = every[number]
        values = (number, one.first, one.first_time, one.kept_from, one.revisions)
        made.append((*values, rows.record_digest(values)))
    connection.execute(delete(table))
    connection.execute(insert(table), [dict(zip(table.columns.keys(), row, strict=True)) for row in made])
    connection.execute(delete(meta).where(meta.c.name == _NOTE))
    connection.execute(insert(meta).values(name=_NOTE, value=_digest(made)))


def check(connection: Connection, scene_id: int, scene: str, revision: int) -> None:
    """StoreError where the state of a scene at a revision was pruned."""
    horizon = read(connection).get(scene_id)
    if horizon is not None and horizon.hides(revision):
        raise gone({scene: horizon}, revision)


def gone(hidden: Mapping[str, Horizon], revision: int) -> StoreError:
    """The error that scenes, by name, cannot be read at a revision any more."""
    scene = min(hidden)
    kept_from = hidden[scene].kept_from
    others = len(hidden) - 1
    more = f", and so was that of {others} other scene{'s' if others > 1 else ''}" if others else ""
    return StoreError(
        f"history before revision {kept_from} of scene '{scene}' was pruned{more}: revision {revision} cannot be read",
        hint=f"AS OF {max(one.kept_from for one in hidden.values())} and later can be; `cgdb log` lists what is kept",
    )


def _digest(found: Sequence[Sequence[object]]) -> str:
    return str(rows.record_digest([list(row) for row in found]))
