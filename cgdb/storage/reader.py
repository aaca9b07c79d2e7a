"""Reading live rows of a scene at a revision: every row against its seal, every part against its total."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from contextlib import AbstractContextManager
from dataclasses import dataclass
from itertools import islice
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray
from sqlalchemy import Column, Connection, Row, Select, Table, select, true, tuple_
from sqlalchemy.sql.elements import ColumnElement

from cgdb.errors import CorruptionError
from cgdb.scene import View
from cgdb.storage import history, migrate, rows, schema
from cgdb.storage.history import SceneInfo
from cgdb.storage.rows import MASK, NodeRow, RelationRow
from cgdb.storage.verify import COLUMNS, Cloud, verified

Reading: TypeAlias = Callable[[], AbstractContextManager[Connection]]
"""Opens a connection on one snapshot, with errors already translated."""

Sound: TypeAlias = set[tuple[int, int, str]]
"""Scene, revision and part of what was once read through and found whole."""

_ASKED_AT_ONCE = 1000  # keys in one IN (...): far below SQLite's limit of 32,766 parameters


class PartSum:
    """Adds up what was read of one part of a scene, and says at the end whether that is all of it."""

    def __init__(self, reading: Reading, info: SceneInfo, part: str) -> None:
        self._reading = reading
        self._info = info
        self._part = part
        self._count = 0
        self._sum = 0

    def add(self, digest: int) -> None:
        """One verified row."""
        self._count += 1
        self._sum += digest

    def finish(self) -> None:
        """Raise CorruptionError where rows are missing or surplus."""
        with self._reading() as connection:
            header = history.read_header(connection, self._info.id, self._info.name, self._info.revision)
        expected = (0, 0) if header is None else header.totals.get(self._part, (0, 0))
        if (self._count, self._sum & MASK) != expected:
            raise CorruptionError(
                f"scene '{self._info.name}': {self._part} of revision {self._info.revision} are not complete: "
                f"{self._count} rows were read, {expected[0]} were written",
                hint="`cgdb check` lists what is damaged; `cgdb export --skip-damaged` saves the rest",
            )


# --- whole parts, in order -------------------------------------------------------------------------------------------


def node_batches(
    reading: Reading, info: SceneInfo, batch: int, damaged: list[str] | None = None
) -> Iterator[list[NodeRow]]:
    """All nodes by key."""
    for found in _pages(reading, info, "nodes", batch, damaged, schema.live(schema.nodes, info.revision)):
        yield [record for _, _, record in found]


def relation_batches(
    reading: Reading, info: SceneInfo, batch: int, damaged: list[str] | None = None
) -> Iterator[list[RelationRow]]:
    """All relations by source, target, label, origin."""
    for found in _pages(reading, info, "relations", batch, damaged, schema.live(schema.relations, info.revision)):
        yield [record for _, _, record in found]


def feature_batches(
    reading: Reading, info: SceneInfo, space: str, dimension: int, batch: int, damaged: list[str] | None = None
) -> Iterator[tuple[NDArray[np.int64], NDArray[np.float32]]]:
    """All vectors of a space by key: keys (b,) int64 and vectors (b, d) float32."""
    live = schema.live(schema.features, info.revision)
    for found in _pages(reading, info, f"features:{space}", batch, damaged, live):
        yield _matrix(((row[0], vector) for row, _, vector in found), dimension)


def clouds(reading: Reading, info: SceneInfo, damaged: list[str] | None = None) -> Iterator[tuple[int, Cloud]]:
    """All clouds by key, a few at a time."""
    for found in _pages(reading, info, "clouds", 8, damaged, schema.live(schema.clouds, info.revision)):
        yield from ((row[0], cloud) for row, _, cloud in found)


def views(reading: Reading, info: SceneInfo, damaged: list[str] | None = None) -> Iterator[tuple[int, View]]:
    """All views with the keys of their objects, by key and best first, a few at a time."""
    for found in _pages(reading, info, "views", 64, damaged, schema.live(schema.views, info.revision)):
        yield from ((row[0], view) for row, _, view in found)


@dataclass(frozen=True, slots=True, kw_only=True)
class Lifetime:
    """The digest of a verified row and the revisions in which it lived."""

    digest: int
    rev_from: int
    rev_to: int | None


def lifetimes(reading: Reading, info: SceneInfo, part: str, damaged: list[str], *, every: bool) -> Iterator[Lifetime]:
    """The rows of a part, damaged ones listed instead: those of the revision, or every one there ever was."""
    table = _table(part)[0]
    which = true() if every else schema.live(table, info.revision)
    for found in _pages(reading, info, part, 256 if part in _LARGE else 4096, damaged, which, total=False):
        for row, digest, _ in found:
            yield Lifetime(digest=digest, rev_from=row.rev_from, rev_to=row.rev_to)


def sealed(connection: Connection, scene_id: int, part: str) -> Iterator[Lifetime]:
    """Every row of a part there is, as its seal alone tells: a damaged one has a wrong digest, and none is named."""
    table, condition = _table(part)
    columns = (table.c.rev_from, table.c.rev_to, table.c.seal)
    for start, end, mark in connection.execute(select(*columns).where(table.c.scene_id == scene_id, condition)):
        yield Lifetime(digest=rows.seal(mark, start, end), rev_from=start, rev_to=end)


_ORDER = {name: columns[: columns.index("rev_from") + 1] for name, columns in COLUMNS.items()}
"""The columns by which rows are read in order: what names one, then rev_from, for in history a name has several."""

_LARGE = ("clouds", "views")
"""Parts that are not read whole without need."""


def _table(part: str) -> tuple[Table, ColumnElement[bool]]:
    """The table of a part, and which of its rows are meant."""
    name, _, space = part.partition(":")
    table = schema.metadata.tables[name]
    return table, table.c.space == space if space else true()


def _pages(
    reading: Reading,
    info: SceneInfo,
    part: str,
    batch: int,
    damaged: list[str] | None,
    which: ColumnElement[bool],
    *,
    total: bool = True,
) -> Iterator[list[tuple[Row[Any], int, Any]]]:
    """Row, digest and record of each verified row, page by page; each page continues after the one before.

    A damaged row is an error or, where there is a list for them, an entry there. total: compare the sums at the end.
    """
    table = _table(part)[0]
    order = [table.c[name] for name in _ORDER[table.name]]
    width = len(order)
    statement = _select(part).where(table.c.scene_id == info.id, which).order_by(*order)
    sums = PartSum(reading, info, part)
    after: tuple[Any, ...] | None = None
    with reading() as connection:
        if not migrate.there(connection, table):
            return
    while True:
        page = statement if after is None else statement.where(tuple_(*order) > tuple_(*after))
        try:
            with reading() as connection:
                raw = list(connection.execute(page.limit(batch)))
            last = len(raw) < batch
        except CorruptionError as error:
            if damaged is None:
                raise
            damaged.append(error.message)
            raw, last = _salvaged(reading, info, page, order[0], after, damaged), True
        found: list[tuple[Row[Any], int, Any]] = []
        for row in raw:
            try:
                digest, value = verified(part, info.id, info.name, row)
            except CorruptionError as error:
                if damaged is None:
                    raise
                damaged.append(error.message)
                continue
            sums.add(digest)
            found.append((row, digest, value))
        if last and total:
            # Before the last page is handed out: a scene of one page is never given incomplete.
            try:
                sums.finish()
            except CorruptionError as error:
                if damaged is None:
                    raise
                damaged.append(error.message)
        if found:
            yield found
        if last:
            return
        after = tuple(raw[-1][:width])


def _salvaged(
    reading: Reading,
    info: SceneInfo,
    page: Select[Any],
    first: Column[Any],
    after: tuple[Any, ...] | None,
    damaged: list[str],
) -> list[Row[Any]]:
    """What can be read of the rest of a part whose pages SQLite refuses: key by key, which steps over the bad pages."""
    with reading() as connection:
        header = history.read_header(connection, info.id, info.name, info.revision)
    end = 0 if header is None else header.next_key
    saved: list[Row[Any]] = []
    for key in range(0 if after is None else after[0], end):
        try:
            with reading() as connection:
                saved.extend(connection.execute(page.where(first == key)))
        except CorruptionError:
            damaged.append(f"scene '{info.name}': rows of key {key} cannot be read")
    return saved


# --- some rows -------------------------------------------------------------------------------------------------------


def nodes_by_key(reading: Reading, info: SceneInfo, sound: Sound, keys: Iterable[int]) -> dict[int, NodeRow]:
    """The live nodes among keys."""
    found: dict[int, NodeRow] = {}
    asked: set[int] = set()
    for some in _chunks(keys):
        asked.update(some)
        with reading() as connection:
            raw = connection.execute(_live("nodes", info).where(schema.nodes.c.key.in_(some))).all()
        _expect(info, "nodes", all(row[0] in asked for row in raw))
        for row in raw:
            found[row[0]] = verified("nodes", info.id, info.name, row)[1]
    _prove_absent(reading, info, sound, "nodes", schema.nodes.c.key, asked - found.keys())
    return found


def node_by_id(reading: Reading, info: SceneInfo, sound: Sound, ident: str) -> NodeRow | None:
    """The live node with an id, given as stored text."""
    with reading() as connection:
        row = connection.execute(_live("nodes", info).where(schema.nodes.c.id == ident)).first()
    if row is None:
        _prove_absent(reading, info, sound, "nodes", schema.nodes.c.id, [ident])
        return None
    _expect(info, "nodes", row.id == ident)
    node: NodeRow = verified("nodes", info.id, info.name, row)[1]
    return node


def relations_of(reading: Reading, info: SceneInfo, keys: Iterable[int]) -> list[RelationRow]:
    """The live relations that touch any of keys, by source, target, label, origin."""
    table = schema.relations.c
    found: dict[tuple[int, int, str, str], RelationRow] = {}
    for chunk in _chunks(keys):
        some = set(chunk)
        # Two statements: each has its own index, one with OR would scan.
        for end in (table.source, table.target):
            with reading() as connection:
                raw = connection.execute(_live("relations", info).where(end.in_(chunk))).all()
            _expect(info, "relations", all(row[0] in some or row[1] in some for row in raw))
            for row in raw:
                found[tuple(row[:4])] = verified("relations", info.id, info.name, row)[1]
    _expect_kept(reading, info)
    return [found[name] for name in sorted(found)]


def features_by_key(
    reading: Reading, info: SceneInfo, sound: Sound, space: str, dimension: int, keys: Iterable[int]
) -> tuple[NDArray[np.int64], NDArray[np.float32]]:
    """The vectors of a space among keys, by key."""
    table = schema.features.c
    part = f"features:{space}"
    found: list[tuple[int, bytes]] = []
    wanted = set(keys)
    for some in _chunks(sorted(wanted)):
        statement = _live(part, info).where(table.key.in_(some))
        with reading() as connection:
            raw = connection.execute(statement.order_by(table.key)).all()
        _expect(info, part, all(row[0] in wanted for row in raw))
        found.extend((row[0], verified(part, info.id, info.name, row)[1]) for row in raw)
    _prove_absent(reading, info, sound, part, table.key, wanted - {key for key, _ in found})
    return _matrix(found, dimension)


def cloud(reading: Reading, info: SceneInfo, sound: Sound, key: int) -> Cloud | None:
    """The point cloud of one node."""
    with reading() as connection:
        row = connection.execute(_live("clouds", info).where(schema.clouds.c.key == key)).first()
    if row is None:
        _prove_absent(reading, info, sound, "clouds", schema.clouds.c.key, [key])
        return None
    _expect(info, "clouds", row[0] == key)
    found: Cloud = verified("clouds", info.id, info.name, row)[1]
    return found


def views_of(reading: Reading, info: SceneInfo, sound: Sound, key: int) -> tuple[View, ...]:
    """The views of one object, best first."""
    table = schema.views
    with reading() as connection:
        if not migrate.there(connection, table):
            return ()
        raw = connection.execute(_live("views", info).where(table.c.key == key).order_by(table.c.rank)).all()
    if not raw:
        _prove_absent(reading, info, sound, "views", table.c.key, [key])
    found = tuple(verified("views", info.id, info.name, row)[1] for row in raw)
    whole = [(row.key, row.rank, row.n_views) for row in raw] == [(key, rank, len(raw)) for rank in range(len(raw))]
    if not whole:
        _expect_kept(reading, info)
    _expect(info, "views", whole)
    return found


def _expect_kept(reading: Reading, info: SceneInfo) -> None:
    """After reading what has no total: StoreError where the revision was pruned meanwhile, and rows with it."""
    with reading() as connection:
        if not history.state_kept(connection, info.id, info.revision):
            history.read_header(connection, info.id, info.name, info.revision)


def _expect(info: SceneInfo, part: str, holds: bool) -> None:
    if not holds:
        raise CorruptionError(
            f"scene '{info.name}': {part} cannot be looked up: the ledger's index does not fit its rows",
            hint="`cgdb check` lists what is damaged; `cgdb export --skip-damaged` saves the rest",
        )


def _prove_absent(
    reading: Reading, info: SceneInfo, sound: Sound, part: str, column: Column[Any], missing: Iterable[int | str]
) -> None:
    """After a miss: CorruptionError unless all rows of the part are there, and none of them is one that was asked for.

    A damaged index page makes SQLite miss rows without a word, and so does damage to the very number that is looked
    for. So the whole part is read and verified, once per revision; then the table is read past its indexes.
    """
    values = set(missing)
    if not values:
        return
    table, condition = _table(part)
    # `+ 0` keeps the planner from using an index, in any engine.
    where = (table.c.scene_id + 0 == info.id) & condition & schema.live(table, info.revision)
    with reading() as connection:
        header = history.read_header(connection, info.id, info.name, info.revision)
        expected = 0 if header is None else header.totals.get(part, (0, 0))[0]
        if expected == 0:
            return
        there = connection.execute(select(column).where(where)).scalars().all()
    _expect(info, part, len(there) == expected and values.isdisjoint(there))
    # Not clouds and views: they are too large to be read for a miss.
    if part not in _LARGE and (info.id, info.revision, part) not in sound:
        for _ in _pages(reading, info, part, 4096, None, schema.live(table, info.revision)):
            pass
        sound.add((info.id, info.revision, part))


def _select(part: str) -> Select[Any]:
    table, condition = _table(part)
    columns = [table.c[name] for name in COLUMNS[table.name]]
    if table is not schema.views:
        return select(*columns).where(condition)
    held = schema.images.c
    its = (held.scene_id == table.c.scene_id) & (held.digest == table.c.image)
    return select(*columns, held.data).select_from(table.outerjoin(schema.images, its)).where(condition)


def _live(part: str, info: SceneInfo) -> Select[Any]:
    table = _table(part)[0]
    return _select(part).where(table.c.scene_id == info.id, schema.live(table, info.revision))


def _matrix(found: Iterable[tuple[int, bytes]], dimension: int) -> tuple[NDArray[np.int64], NDArray[np.float32]]:
    pairs = list(found)
    keys = np.fromiter((key for key, _ in pairs), np.int64, count=len(pairs))
    vectors = np.frombuffer(b"".join(vector for _, vector in pairs), "<f4").reshape(len(pairs), dimension)
    return keys, vectors


def _chunks(keys: Iterable[int]) -> Iterator[list[int]]:
    stream = iter(keys)
    while some := [int(key) for key in islice(stream, _ASKED_AT_ONCE)]:
        yield some
