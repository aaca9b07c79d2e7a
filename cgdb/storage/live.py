"""The live rows of a scene while one revision of it is written: found, inserted, closed, and summed up as they change.

A part is a table or, of features, one space in it: "nodes", "relations", "clouds", "views", "features:SPACE".
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Any, TypeAlias, TypeVar

from sqlalchemy import Connection, Engine, Row, Select, Table, Update, bindparam, insert, select, update

from cgdb.errors import CorruptionError
from cgdb.storage import rows, schema, sqlite
from cgdb.storage.history import Totals
from cgdb.storage.rows import MASK
from cgdb.storage.verify import COLUMNS, verified

BATCH = 1024
"""Rows that are looked up by one statement."""

Values: TypeAlias = tuple[Any, ...]

Name: TypeAlias = tuple[Any, ...]
"""What names a live row of a part, as ``schema.IDENTITY`` says."""

Stored: TypeAlias = tuple[int, int, bool]
"""Of a live row: rev_from, seal, and whether it is what was written."""

Item = TypeVar("Item")


def _closing(table: Table) -> Update:
    statement = update(table).where(table.c.scene_id == bindparam("at_scene"))
    for name in (*schema.IDENTITY[table.name], "rev_from"):
        statement = statement.where(table.c[name] == bindparam(f"at_{name}"))
    return statement.values(rev_to=bindparam("new_rev_to"), seal=bindparam("new_seal"))


_CLOSE = {name: _closing(table) for name, table in schema.TEMPORAL.items()}


class LiveRows:
    """The rows of one scene that are live, and those that become so with the revision that is written."""

    def __init__(
        self,
        database: Engine,
        connection: Connection,
        *,
        number: int,
        scene_id: int,
        scene: str,
        totals: Totals | None,
        fresh: bool,
    ) -> None:
        """number: the revision. totals: of the scene so far; None to count anew, also what stays, as replacing does.

        Who counts anew goes on over damaged rows and writes them again; otherwise they are refused, for the totals
        would never be right again. fresh: nothing was ever stored under this scene, so no row needs to be looked up.
        """
        self.connection, self.number, self.scene_id, self.fresh = connection, number, scene_id, fresh
        self.scene, self.anew = scene, totals is None
        self._totals = {part: list(total) for part, total in (totals or {}).items()}
        inserted = (*schema.TEMPORAL.values(), schema.images)
        self._insert = {table.name: sqlite.positional(insert(table), database) for table in inserted}

    @property
    def totals(self) -> dict[str, tuple[int, int]]:
        """What the live rows add up to, of the parts that have some."""
        return {part: (count, total) for part, (count, total) in self._totals.items() if (count, total) != (0, 0)}

    def select(self, part: str, columns: Sequence[str], *, before: bool = False) -> Select[Any]:
        """The statement for columns of the live rows of a part; before: of those that this revision did not write."""
        kind, _, space = part.partition(":")
        table = schema.TEMPORAL[kind]
        statement = select(*(table.c[name] for name in columns)).where(
            table.c.scene_id == self.scene_id, table.c.rev_to.is_(None)
        )
        if space:
            statement = statement.where(table.c.space == space)
        return statement.where(table.c.rev_from < self.number) if before else statement

    def of_keys(self, part: str, keys: Sequence[int]) -> dict[Name, Stored]:
        """The live rows of keys in a part that has keys."""
        if self.fresh:
            return {}
        kind, _, space = part.partition(":")
        prefix = (space,) if space else ()
        width = COLUMNS[kind].index("rev_from")
        statement, key = self.select(part, COLUMNS[kind]), schema.TEMPORAL[kind].c.key
        found: dict[Name, Stored] = {}
        for some in slices(keys, BATCH):
            for row in self.connection.execute(statement.where(key.in_(some))).all():
                found[*prefix, *row[:width]] = self.stored(part, row)
        return found

    def stored(self, part: str, row: Row[Any]) -> Stored:
        """What is known of a row with the columns of ``COLUMNS``. CorruptionError where it is damaged and refused."""
        try:
            verified(part, self.scene_id, self.scene, row)
        except CorruptionError as error:
            if self.anew:
                return row.rev_from, row.seal, False
            error.hint = "import the scene whole again, with replace"
            raise
        return row.rev_from, row.seal, True

    def follow(self, part: str, keys: Sequence[int], wanted: Mapping[Name, tuple[int, Values]]) -> set[int]:
        """Make the live rows of keys those that are wanted (name -> digest, payload); returns the keys that differ.

        The same rows stay, others are closed and followed.
        """
        key_at = schema.IDENTITY[part.partition(":")[0]].index("key")
        close: list[Values] = []
        changed: set[int] = set()
        new = dict(wanted)
        for name, (start, mark, sound) in self.of_keys(part, keys).items():
            digest = rows.seal(mark, start, None)
            if sound and name in wanted and wanted[name][0] == digest:
                del new[name]
                if self.anew:
                    self.count(part, digest)
                continue
            close.append((*name, start, mark))
            changed.add(name[key_at])
        self.close(part, close)
        self.add(part, new)
        return changed | {name[key_at] for name in new}

    def add(self, part: str, new: Mapping[Name, tuple[int, Values]]) -> None:
        """Insert rows that are live from this revision on: name -> digest, payload."""
        scene_id, number = self.scene_id, self.number
        self.insert(
            schema.TEMPORAL[part.partition(":")[0]],
            [
                (scene_id, *name, number, None, rows.seal(digest, number, None), *payload)
                for name, (digest, payload) in new.items()
            ],
        )
        for digest, _ in new.values():
            self.count(part, digest)

    def insert(self, table: Table, new: list[Values]) -> None:
        """Insert rows, the columns in their order."""
        if new:
            self.connection.exec_driver_sql(self._insert[table.name], new)

    def close(self, part: str, old: Sequence[Values]) -> None:
        """End live rows with this revision. old: identity, rev_from, seal of each."""
        if not old:
            return
        kind = part.partition(":")[0]
        parameters: list[dict[str, Any]] = []
        for row in old:
            *identity, rev_from, mark = row
            digest = rows.seal(mark, rev_from, None)
            values = {f"at_{name}": value for name, value in zip(schema.IDENTITY[kind], identity, strict=True)}
            values.update(at_scene=self.scene_id, at_rev_from=rev_from, new_rev_to=self.number)
            parameters.append({**values, "new_seal": rows.seal(digest, rev_from, self.number)})
            if not self.anew:
                self.count(part, -digest, -1)
        self.connection.execute(_CLOSE[kind], parameters)

    def close_touching(self, part: str, column: str, keys: Sequence[int]) -> int:
        """End the rows that were there before this revision and have one of keys in a column; how many these are."""
        kind = part.partition(":")[0]
        statement = self.select(part, (*schema.IDENTITY[kind], "rev_from", "seal"), before=True)
        touching = statement.where(schema.TEMPORAL[kind].c[column].in_(keys))
        found = [tuple(row) for row in self.connection.execute(touching).all()]
        self.close(part, found)
        return len(found)

    def count(self, part: str, digest: int, number: int = 1) -> None:
        """Add to the totals of a part: so many live rows more, and the sum of their digests."""
        total = self._totals.setdefault(part, [0, 0])
        total[0] += number
        total[1] = (total[1] + digest) & MASK


def slices(items: Sequence[Item], size: int) -> Iterator[Sequence[Item]]:
    """The items in order, so many at a time."""
    for start in range(0, len(items), size):
        yield items[start : start + size]
