"""Ids and keys of a scene while it is written: an id keeps the key that it has, a new one gets the next."""

from __future__ import annotations

from collections.abc import Sequence

from sqlalchemy import select

from cgdb.storage import schema
from cgdb.storage.live import BATCH, LiveRows, slices


class Keys:
    """The keys that a block speaks of. written: of nodes that it has written; pending: that still need one."""

    def __init__(self, live: LiveRows, next_key: int) -> None:
        """next_key: the first that no id ever had."""
        self.next = next_key
        self.written: set[int] = set()
        self.pending: set[int] = set()
        self._live = live
        self._keys: dict[str, int] = {}

    def of(self, ids: Sequence[str]) -> list[int]:
        """The key of each id; those that are new get theirs in the order of the ids."""
        missing = [ident for ident in ids if ident not in self._keys]
        table = schema.nodes.c
        for some in slices(missing, BATCH) if not self._live.fresh else ():
            statement = select(table.id, table.key).where(table.scene_id == self._live.scene_id, table.id.in_(some))
            found = self._live.connection.execute(statement.distinct()).all()
            self._keys.update((ident, key) for ident, key in found)
        for ident in missing:
            if ident not in self._keys:
                self._keys[ident] = self.next
                self.next += 1
        return [self._keys[ident] for ident in ids]

    def labels(self, keys: Sequence[int]) -> dict[int, str]:
        """The labels of the live nodes among keys."""
        found: dict[int, str] = {}
        statement = self._live.select("nodes", ("key", "label"))
        for some in slices(keys, BATCH) if not self._live.fresh else ():
            rows = self._live.connection.execute(statement.where(schema.nodes.c.key.in_(some))).all()
            found.update((key, label) for key, label in rows)
        return found

    def need(self, keys: set[int]) -> None:
        """Note that there must be nodes of keys when the block ends."""
        unknown = keys - self.written - self.pending
        if unknown and not self._live.anew:
            unknown -= self.labels(list(unknown)).keys()
        self.pending |= unknown

    def id_of(self, key: int) -> str:
        """The id that has a key."""
        for ident, known in self._keys.items():
            if known == key:
                return ident
        table = schema.nodes.c
        statement = select(table.id).where(table.scene_id == self._live.scene_id, table.key == key).limit(1)
        return str(self._live.connection.execute(statement).scalar_one())
