"""Writing the relations of one scene in one revision: what is said anew, said otherwise, and said no more."""

from __future__ import annotations

from array import array
from collections.abc import Sequence

import numpy as np
from sqlalchemy import or_, tuple_, update
from sqlalchemy.exc import IntegrityError

from cgdb.errors import SceneError
from cgdb.scene import Relation
from cgdb.storage import rows, schema
from cgdb.storage.keys import Keys
from cgdb.storage.live import BATCH, LiveRows, Name, Stored, slices
from cgdb.storage.rows import RelationPayload
from cgdb.storage.verify import COLUMNS

AT_ONCE = 4096
"""Relations that are held at a time."""


class RelationWriter:
    """What a block says of relations. added, removed: how many rows are new, and how many ended."""

    def __init__(self, live: LiveRows, keys: Keys) -> None:
        self.added = self.removed = 0
        self._live, self._keys = live, keys
        # Digests, not rows: 8 bytes for each relation that was found unchanged.
        self._kept = array("q")
        self._look_up = not live.fresh

    def write(self, batch: Sequence[Relation]) -> None:
        """Write checked relations; the last of several alike counts."""
        ready = {payload[:4]: payload for payload in self._payloads(batch)}
        self._keys.need({key for payload in ready.values() for key in payload[:2]})
        if not self._look_up:
            # A first import seldom says a thing twice. Where it does, the primary key objects, and we look.
            try:
                with self._live.connection.begin_nested():
                    self._insert(ready)
                return
            except IntegrityError:
                self._look_up = True
        self._follow(ready)

    def remove(self, batch: Sequence[Relation]) -> None:
        """End stored relations, by their ends, label and origin. SceneError for one that is not there."""
        names = [payload[:4] for payload in self._payloads(batch)]
        live = self._between({name[:2] for name in names})
        for relation, name in zip(batch, names, strict=True):
            start = live[name][0] if name in live else None
            if start is None or start == self._live.number:
                problem = "is not there to be removed" if start is None else "is both written and removed"
                said = f"#{relation.source} {relation.label!r} #{relation.target} ({relation.origin})"
                raise SceneError(f"scene '{self._live.scene}': the relation {said} {problem}")
        self._end([(*name, *live[name][:2]) for name in dict.fromkeys(names)])

    def remove_of_nodes(self, keys: Sequence[int]) -> None:
        """End what was there before of nodes that go. What the block itself says of them is an error at its end."""
        for end in ("source", "target"):
            self.removed += self._live.close_touching("relations", end, keys)
        self._keys.pending.update(keys)

    def remove_unsaid(self) -> None:
        """End all that was there before and that the block did not say again."""
        self._remove_all_but(np.sort(np.frombuffer(self._kept, np.int64)))

    def remove_all(self) -> None:
        """End all that was there before."""
        self._remove_all_but(np.zeros(0, np.int64))

    def check_ends(self) -> None:
        """SceneError where a relation has an end that no node has."""
        table = schema.relations.c
        for some in slices(sorted(self._keys.pending), BATCH):
            statement = self._live.select("relations", ("source", "label", "target"))
            row = self._live.connection.execute(
                statement.where(or_(table.source.in_(some), table.target.in_(some))).limit(1)
            ).first()
            if row is not None:
                source, label, target = row
                missing = self._keys.id_of(source if source in self._keys.pending else target)
                raise SceneError(
                    f"relation #{self._keys.id_of(source)} {label!r} #{self._keys.id_of(target)}: "
                    f"there is no object or place #{missing}"
                )

    def _payloads(self, batch: Sequence[Relation]) -> list[RelationPayload]:
        # In the order of the batch: a map gets the same keys wherever and whenever it is imported.
        keys = iter(self._keys.of([rows.id_text(end) for r in batch for end in (r.source, r.target)]))
        return [rows.relation_payload(next(keys), next(keys), relation) for relation in batch]

    def _follow(self, ready: dict[Name, RelationPayload]) -> None:
        old = self._between({name[:2] for name in ready})
        new: dict[Name, RelationPayload] = {}
        end: list[Name] = []
        for name, payload in ready.items():
            if name in old:
                digest = rows.relation_digest(self._live.scene_id, payload)
                start, mark, sound = old[name]
                if start == self._live.number:
                    self._amend(payload, digest, mark)
                    continue
                if sound and rows.seal(mark, start, None) == digest:
                    self._kept.append(digest)
                    continue
                end.append((*name, start, mark))
            new[name] = payload
        self._end(end)
        self._insert(new)

    def _insert(self, new: dict[Name, RelationPayload]) -> None:
        scene_id = self._live.scene_id
        self._live.add(
            "relations", {name: (rows.relation_digest(scene_id, payload), payload[4:]) for name, payload in new.items()}
        )
        self.added += len(new)

    def _amend(self, payload: RelationPayload, digest: int, mark: int) -> None:
        """A relation said twice in one block: its row is of this revision and may be written over."""
        live, table = self._live, schema.relations
        source, target, label, origin, confidence, explanation = payload
        live.connection.execute(
            update(table)
            .where(table.c.scene_id == live.scene_id, table.c.source == source, table.c.target == target)
            .where(table.c.label == label, table.c.origin == origin, table.c.rev_from == live.number)
            .values(confidence=confidence, explanation=explanation, seal=rows.seal(digest, live.number, None))
        )
        live.count("relations", -rows.seal(mark, live.number, None), 0)
        live.count("relations", digest, 0)

    def _between(self, pairs: set[tuple[int, int]]) -> dict[Name, Stored]:
        """The live relations between pairs of keys."""
        table = schema.relations.c
        found: dict[Name, Stored] = {}
        for some in slices(sorted(pairs), BATCH):
            statement = self._live.select("relations", COLUMNS["relations"])
            between = statement.where(tuple_(table.source, table.target).in_(some))
            for row in self._live.connection.execute(between).all():
                found[tuple(row[:4])] = self._live.stored("relations", row)
        return found

    def _end(self, old: Sequence[Name]) -> None:
        self._live.close("relations", old)
        self.removed += len(old)

    def _remove_all_but(self, kept: np.ndarray[tuple[int], np.dtype[np.int64]]) -> None:
        """kept: digests, ascending."""
        table, names = schema.relations.c, schema.IDENTITY["relations"]
        identity = tuple_(*(table[name] for name in names))
        page = self._live.select("relations", (*names, "rev_from", "seal"), before=True)
        page = page.order_by(*(table[name] for name in names)).limit(AT_ONCE)
        after = page
        while found := [tuple(row) for row in self._live.connection.execute(after).all()]:
            digests = np.array([rows.seal(row[5], row[4], None) for row in found], np.int64)
            stays = np.isin(digests, kept)
            for digest in digests[stays].tolist():
                self._live.count("relations", digest)
            self._end([row for row, stay in zip(found, stays.tolist(), strict=True) if not stay])
            after = page.where(identity > tuple_(*found[-1][:4]))
