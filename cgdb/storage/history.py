"""Revisions and scene versions: which revisions there are, and what a scene was at each."""

from __future__ import annotations

import json
import time
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from datetime import UTC, datetime, timedelta
from typing import Any, TypeAlias

from sqlalchemy import Connection, func, insert, select, update

from cgdb.errors import CorruptionError, StoreError
from cgdb.scene import FeatureSpace
from cgdb.storage import horizon, rows, schema

Totals: TypeAlias = Mapping[str, tuple[int, int]]
"""Part ("nodes", "relations", "clouds", "views", "features:SPACE") -> live rows, sum of their digests mod 2**63."""

Counts: TypeAlias = tuple[int, int, int, int, int]
"""Nodes added, changed, removed; relations added, removed."""

_EPOCH = datetime(1970, 1, 1, tzinfo=UTC)


@dataclass(frozen=True, slots=True, kw_only=True)
class Revision:
    """One committed change of a store. added, changed, removed count objects and places."""

    id: int
    time: datetime
    kind: str
    scene: str
    message: str
    added: int
    changed: int
    removed: int
    relations_added: int = 0
    relations_removed: int = 0


@dataclass(frozen=True, slots=True, kw_only=True)
class SceneInfo:
    """A scene at one revision. revision is the last one up to as_of that changed the scene; as_of None = the latest."""

    id: int
    name: str
    revision: int
    as_of: int | None
    n_objects: int
    n_relations: int
    n_places: int
    frame: str
    up: str
    spaces: tuple[FeatureSpace, ...]
    provenance: Mapping[str, Any]


@dataclass(frozen=True, slots=True, kw_only=True)
class Header:
    """A row of ``scene_versions``: what a scene is at a revision, and the totals that its rows must add up to."""

    scene_id: int
    name: str
    revision: int
    removed: bool
    n_objects: int
    n_places: int
    n_relations: int
    next_key: int
    frame: str
    up: str
    spaces: tuple[FeatureSpace, ...]
    provenance: Mapping[str, Any]
    totals: Totals = field(default_factory=dict)

    def info(self, as_of: int | None) -> SceneInfo:
        """The public face of the header."""
        return SceneInfo(
            id=self.scene_id,
            name=self.name,
            revision=self.revision,
            as_of=as_of,
            n_objects=self.n_objects,
            n_relations=self.n_relations,
            n_places=self.n_places,
            frame=self.frame,
            up=self.up,
            spaces=self.spaces,
            provenance=self.provenance,
        )


def latest(connection: Connection) -> int:
    """The number of the last revision, 0 when there is none."""
    table = schema.revisions
    found = int(connection.execute(select(func.coalesce(func.max(table.c.id), 0))).scalar_one())
    # Noted twice: a last revision that is lost must not make the one before it look like the latest.
    noted = connection.execute(select(schema.meta.c.value).where(schema.meta.c.name == "head")).scalar()
    if noted != str(found):
        raise CorruptionError(f"the last revision of the ledger is damaged: {found} is there, {noted} is noted")
    return found


def read_revisions(connection: Connection) -> Iterator[Revision]:
    """All revisions in order; CorruptionError where the chain of their seals is broken."""
    before = 0
    expected = 1
    pruned = sum(one.revisions for one in horizon.read(connection).values())
    left = pruned
    for row in connection.execute(select(schema.revisions).order_by(schema.revisions.c.id)):
        values = tuple(row)
        # What was pruned leaves gaps, of as many revisions as are noted; the chain of seals spans them.
        if isinstance(values[0], int) and values[0] > expected:
            left -= values[0] - expected
            expected = values[0] if left >= 0 else expected
        if values[0] != expected or values[-1] != revision_seal(values[:-1], before):
            raise _broken(expected, pruned)
        yield Revision(
            id=values[0],
            time=_EPOCH + timedelta(microseconds=values[1]),
            kind=values[2],
            scene=values[4],
            message=values[5],
            added=values[6],
            changed=values[7],
            removed=values[8],
            relations_added=values[9],
            relations_removed=values[10],
        )
        before = values[-1]
        expected += 1
    if expected != latest(connection) + 1 or left:
        raise _broken(expected, pruned)


def _broken(revision: int, pruned: int) -> CorruptionError:
    where = ", or one before it," if pruned else ""
    return CorruptionError(f"revision {revision} of the ledger{where} is damaged or missing")


def resolve(connection: Connection, as_of: int | str | datetime | None) -> int:
    """The revision that a number, an ISO time or a moment stands for; None: the latest. StoreError where none does."""
    last = latest(connection)
    if as_of is None:
        return last
    at = moment(as_of)
    if isinstance(at, int):
        if not 1 <= at <= last:
            there = f"there are 1 to {last}" if last else "the store is empty"
            raise StoreError(f"there is no revision {at}", hint=there)
        return at
    found = revision_at(connection, at)
    if found == 0:
        raise StoreError(f"there was no revision yet at {at.isoformat()}")
    if found == last and at > datetime.now(UTC):
        raise StoreError(f"{at.isoformat()} lies in the future", hint="leave it out for the latest revision")
    return found


def moment(at: int | str | datetime) -> int | datetime:
    """The number of a revision, or a moment with its zone, that is given as such or as text."""
    if isinstance(at, int):
        return at
    if isinstance(at, str):
        if at.isascii() and at.isdigit() and len(at) < 19:
            return int(at)
        try:
            at = datetime.fromisoformat(at)
        except ValueError:
            raise StoreError(
                f"{str(at)[:60]!r} is neither a revision nor a time", hint="a time reads 2025-03-01T12:00 (UTC)"
            ) from None
    return at if at.tzinfo is not None else at.replace(tzinfo=UTC)


def revision_at(connection: Connection, moment: datetime) -> int:
    """The last revision at or before a moment that is known, 0 when the first one is later.

    Where some between two were pruned, every scene is at this one what it was at the moment, or its history is pruned.
    """
    table = schema.revisions
    micros = microseconds(moment)
    kept = int(
        connection.execute(select(func.coalesce(func.max(table.c.id), 0)).where(table.c.time <= micros)).scalar_one()
    )
    begun = (one.first for one in horizon.read(connection).values() if one.first_time <= micros)
    return max(kept, *begun, 0)


def microseconds(moment: datetime) -> int:
    """Microseconds since 1970, exactly; a moment without a zone is UTC."""
    aware = moment if moment.tzinfo is not None else moment.replace(tzinfo=UTC)
    return (aware - _EPOCH) // timedelta(microseconds=1)


def add_revision(connection: Connection, *, kind: str, scene_id: int, scene: str, message: str, counts: Counts) -> int:
    """Append a revision, chained to the one before. counts: nodes added, changed, removed; relations added, removed."""
    table = schema.revisions
    last = connection.execute(
        select(table.c.id, table.c.time, table.c.seal).order_by(table.c.id.desc()).limit(1)
    ).one_or_none()
    number, clock, before = tuple(last) if last is not None else (0, 0, 0)
    # A clock that was set back must not make "the last revision before T" ambiguous.
    now = max(time.time_ns() // 1000, clock + 1)
    values = (number + 1, now, kind, scene_id, scene, message, *counts)
    connection.execute(insert(table).values((*values, revision_seal(values, before))))
    connection.execute(update(schema.meta).where(schema.meta.c.name == "head").values(value=str(number + 1)))
    return int(number) + 1


def scene_id(connection: Connection, name: str) -> int | None:
    """The number of a scene that is there or once was."""
    table = schema.scenes
    row = connection.execute(select(table).where(table.c.name == name)).one_or_none()
    if row is None:
        # Not by the index: by all names, each compared with its seal.
        return scene_names(connection).get(name)
    if row.seal != rows.record_digest((row.id, name)):
        raise CorruptionError(f"scene '{name}': its entry in the ledger is damaged")
    return int(row.id)


def scene_names(connection: Connection) -> dict[str, int]:
    """Every scene that ever was, by name."""
    names: dict[str, int] = {}
    for number, name, mark in connection.execute(select(schema.scenes).order_by(schema.scenes.c.id)):
        if mark != rows.record_digest((number, name)):
            raise CorruptionError(f"scene {number} of the ledger is damaged")
        names[name] = number
    return names


def add_scene(connection: Connection, name: str) -> int:
    """Give a new name its scene id."""
    table = schema.scenes
    number = int(connection.execute(select(func.coalesce(func.max(table.c.id), 0))).scalar_one()) + 1
    connection.execute(insert(table).values((number, name, rows.record_digest((number, name)))))
    return number


def read_header(connection: Connection, scene_id: int, name: str, revision: int) -> Header | None:
    """The scene as of a revision, or None where it did not exist yet; removed ones are returned, and say so.

    StoreError where its history at that revision was pruned.
    """
    table = schema.scene_versions
    row = connection.execute(
        select(table)
        .where(table.c.scene_id == scene_id, table.c.revision <= revision)
        .order_by(table.c.revision.desc())
        .limit(1)
    ).one_or_none()
    # The revisions tell the same from their side: a version row that is lost must not uncover the one before it.
    chain = schema.revisions
    expected = connection.execute(
        select(func.max(chain.c.id)).where(chain.c.scene_id == scene_id, chain.c.id <= revision)
    ).scalar_one()
    if (None if row is None else row.revision) != expected:
        raise CorruptionError(f"scene '{name}': its state at revision {expected} is missing")
    if row is None:
        horizon.check(connection, scene_id, name, revision)
        return None
    return _header(tuple(row), name)


def read_versions(connection: Connection, scene_id: int, name: str, revision: int) -> list[Header]:
    """Every state of a scene up to a revision, oldest first."""
    table = schema.scene_versions
    found = connection.execute(
        select(table).where(table.c.scene_id == scene_id, table.c.revision <= revision).order_by(table.c.revision)
    )
    headers = [_header(tuple(row), name) for row in found]
    chain = schema.revisions
    expected = connection.execute(
        select(chain.c.id).where(chain.c.scene_id == scene_id, chain.c.id <= revision).order_by(chain.c.id)
    )
    if [header.revision for header in headers] != list(expected.scalars()):
        raise CorruptionError(f"scene '{name}': states of it are missing")
    return headers


def _header(values: tuple[Any, ...], name: str) -> Header:
    if values[-1] != rows.record_digest(values[:-1]):
        raise CorruptionError(f"scene '{name}': its state at revision {values[1]} is damaged")
    scene_id, revision, removed, n_objects, n_places, n_relations, next_key, frame, up = values[:9]
    spaces, provenance, totals = (json.loads(text) for text in values[9:12])
    return Header(
        scene_id=scene_id,
        name=name,
        revision=revision,
        removed=removed,
        n_objects=n_objects,
        n_places=n_places,
        n_relations=n_relations,
        next_key=next_key,
        frame=frame,
        up=up,
        spaces=tuple(FeatureSpace(name=n, dimension=d, encoder=e) for n, d, e in spaces),
        provenance=provenance,
        totals={part: (count, total) for part, (count, total) in totals.items()},
    )


def add_header(connection: Connection, header: Header) -> None:
    """Write a scene's state at a revision."""
    values = (
        header.scene_id,
        header.revision,
        header.removed,
        header.n_objects,
        header.n_places,
        header.n_relations,
        header.next_key,
        header.frame,
        header.up,
        json.dumps([[s.name, s.dimension, s.encoder] for s in header.spaces]),
        json.dumps(dict(header.provenance)),
        json.dumps(dict(header.totals)),
    )
    connection.execute(insert(schema.scene_versions).values((*values, rows.record_digest(values))))


def live_headers(connection: Connection, revision: int) -> list[Header]:
    """The scenes that exist as of a revision, by name. StoreError where the history of one was pruned."""
    if hidden := hidden_at(connection, revision):
        raise horizon.gone(hidden, revision)
    return readable_headers(connection, revision)


def readable_headers(connection: Connection, revision: int) -> list[Header]:
    """The scenes that exist as of a revision, by name, but those whose history was pruned."""
    hidden = hidden_at(connection, revision)
    names = [(name, number) for name, number in scene_names(connection).items() if name not in hidden]
    headers = (read_header(connection, number, name, revision) for name, number in names)
    return sorted((h for h in headers if h is not None and not h.removed), key=lambda h: h.name)


def hidden_at(connection: Connection, revision: int) -> dict[str, horizon.Horizon]:
    """{scene: its horizon}, of those whose state at a revision was pruned."""
    hidden = {number: one for number, one in horizon.read(connection).items() if one.hides(revision)}
    return (
        {name: hidden[number] for name, number in scene_names(connection).items() if number in hidden} if hidden else {}
    )


def state_kept(connection: Connection, scene_id: int, revision: int) -> bool:
    """Whether there is a scene's state of exactly this revision."""
    table = schema.scene_versions.c
    mine = (table.scene_id == scene_id) & (table.revision == revision)
    return connection.execute(select(table.revision).where(mine)).first() is not None


def revision_seal(values: tuple[Any, ...], before: int) -> int:
    """The seal of a revision. before: that of the one before it, 0 where there is none."""
    return rows.record_digest((*values, before))
