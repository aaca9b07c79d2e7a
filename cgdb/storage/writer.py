"""Writing one scene as one revision: rows that changed are closed and followed, all others stay as they are.

A block streams: it holds one batch of rows and, per node of the scene, its id and key. A relation may come before its
objects: an id that is not known yet is given its key at once, and at the end no such key may be left without a node.
"""

from __future__ import annotations

import contextlib
import json
from array import array
from collections.abc import Iterable, Iterator, Mapping, Sequence
from itertools import islice
from typing import Any, Literal, TypeAlias, TypeVar

import numpy as np
from sqlalchemy import Connection, Engine, Table, Update, bindparam, delete, insert, or_, select, tuple_, update
from sqlalchemy.exc import IntegrityError

from cgdb.errors import CorruptionError, SceneError
from cgdb.scene import (
    UP_AXES,
    FeatureSpace,
    ObjectId,
    Place,
    Relation,
    SceneObject,
    Unread,
    check_object,
    check_place,
    check_relation,
)
from cgdb.storage import history, rows, schema, sqlite
from cgdb.storage.history import Header
from cgdb.storage.rows import MASK, NodePayload, RelationPayload
from cgdb.storage.verify import COLUMNS, verified

OnExisting: TypeAlias = Literal["error", "replace", "merge"]

_BATCH_ROWS = 1024
_BATCH_BYTES = 16 << 20
_RELATIONS = 4096

_Values: TypeAlias = tuple[Any, ...]

_TABLES = {t.name: t for t in (schema.nodes, schema.relations, schema.features, schema.clouds, schema.views)}

_IDENTITY = {
    schema.nodes: ("key",),
    schema.relations: ("source", "target", "label", "origin"),
    schema.features: ("space", "key"),
    schema.clouds: ("key",),
    schema.views: ("key", "rank"),
}
"""What names a live row of a scene, per temporal table."""


def _closing(table: Table) -> Update:
    statement = update(table).where(table.c.scene_id == bindparam("at_scene"))
    for name in (*_IDENTITY[table], "rev_from"):
        statement = statement.where(table.c[name] == bindparam(f"at_{name}"))
    return statement.values(rev_to=bindparam("new_rev_to"), seal=bindparam("new_seal"))


_CLOSE = {table: _closing(table) for table in _IDENTITY}


class SceneWriter:
    """What a ``with ledger.write(...)`` block writes with. revision is set when the block has ended."""

    def __init__(
        self,
        database: Engine,
        connection: Connection,
        *,
        number: int,
        scene_id: int,
        old: Header | None,
        name: str,
        on_existing: OnExisting,
        frame: str | None,
        up: str | None,
        spaces: tuple[FeatureSpace, ...],
        provenance: Mapping[str, Any] | None,
    ) -> None:
        self.revision: int | None = None
        self.scene = name
        self._connection = connection
        self._number = number
        self._scene_id = scene_id
        self._old = None if old is None or old.removed else old
        self._replace = on_existing == "replace" or self._old is None
        # Nothing was ever stored under this scene: no row needs to be looked up.
        self._fresh = old is None
        self._next_key = 1 if old is None else old.next_key
        self._frame, self._up, self._spaces = _merged_header(self._old, self._replace, name, frame, up, spaces)
        self._provenance = _merged_provenance(self._old, self._replace, name, provenance)
        self._dimensions = {space.name: space.dimension for space in self._spaces}
        self._space_bytes = {space.name: space.name.encode() for space in self._spaces}

        self._keys: dict[str, int] = {}
        self._written: set[int] = set()
        self._pending: set[int] = set()
        self._removed: dict[int, str] = {}
        # Digests, not rows: 8 bytes for each relation that was found unchanged.
        self._kept_relations = array("q")
        self._relations_look_up = not self._fresh

        # A replacement counts everything anew, which also heals a scene whose rows or totals are damaged.
        start = None if self._replace else self._old
        self._totals = {} if start is None else {part: list(total) for part, total in start.totals.items()}
        self._n_objects = 0 if start is None else start.n_objects
        self._n_places = 0 if start is None else start.n_places
        stored = () if self._old is None else self._old.totals
        self._stored_spaces = [part.removeprefix("features:") for part in stored if part.startswith("features:")]
        self.added = self.changed = self.removed = 0
        self.relations_added = self.relations_removed = 0

        self._insert = {
            table.name: sqlite.positional(insert(table), database) for table in (*_TABLES.values(), schema.images)
        }

    # --- what a block may call ---------------------------------------------------------------------------------------

    def objects(self, objects: Iterable[SceneObject]) -> None:
        """Write objects, checked, in batches of their own."""
        for batch in _batches(objects):
            ready: list[tuple[NodePayload, SceneObject | None]] = []
            for obj in batch:
                check_object(obj, self._dimensions)
                ready.append((rows.object_payload(obj), obj))
            self._write_nodes(ready)

    def places(self, places: Iterable[Place]) -> None:
        """Write places, checked. They share the ids of the objects."""
        stream = iter(places)
        while batch := list(islice(stream, _BATCH_ROWS)):
            ready: list[tuple[NodePayload, SceneObject | None]] = []
            for place in batch:
                check_place(place)
                ready.append((rows.place_payload(place), None))
            self._write_nodes(ready)

    def relations(self, relations: Iterable[Relation]) -> None:
        """Write relations, checked; their ends may be written later in the block. The last of several alike counts."""
        stream = iter(relations)
        while batch := list(islice(stream, _RELATIONS)):
            for relation in batch:
                check_relation(relation)
            with _valid_texts(self.scene):
                self._write_valid_relations(batch)

    def remove(self, ids: Iterable[ObjectId]) -> None:
        """Remove objects or places with all that is theirs, relations too. SceneError for an id that is not there."""
        stream = iter(ids)
        while batch := list(islice(stream, _BATCH_ROWS)):
            texts = [rows.id_text(value) for value in batch]
            self._find_keys(set(texts))
            live = self._labels([self._keys[text] for text in texts])
            for text in texts:
                if self._keys[text] not in live:
                    raise SceneError(f"scene '{self.scene}': there is no object or place #{text} to remove")
                self._removed[self._keys[text]] = text

    def unrelate(self, relations: Iterable[Relation]) -> None:
        """Remove relations, by their ends, label and origin. SceneError for one that is not there."""
        stream = iter(relations)
        while batch := list(islice(stream, _RELATIONS)):
            with _valid_texts(self.scene):
                names = [payload[:4] for payload in self._relation_payloads(batch)]
            live = self._live_relations({name[:2] for name in names})
            for relation, name in zip(batch, names, strict=True):
                start = live[name][0] if name in live else None
                if start is None or start == self._number:
                    problem = "is not there to be removed" if start is None else "is both written and removed"
                    said = f"#{relation.source} {relation.label!r} #{relation.target} ({relation.origin})"
                    raise SceneError(f"scene '{self.scene}': the relation {said} {problem}")
            self._close_rows(schema.relations, "relations", [(*name, *live[name][:2]) for name in dict.fromkeys(names)])
            self.relations_removed += len(set(names))

    # --- nodes -------------------------------------------------------------------------------------------------------

    def _write_nodes(self, batch: list[tuple[NodePayload, SceneObject | None]]) -> None:
        with _valid_texts(self.scene):
            self._write_valid_nodes(batch)

    def _write_valid_nodes(self, batch: list[tuple[NodePayload, SceneObject | None]]) -> None:
        self._find_keys([payload[0] for payload, _ in batch])
        keys = [self._keys[payload[0]] for payload, _ in batch]
        for key, (payload, _) in zip(keys, batch, strict=True):
            if key in self._written:
                raise SceneError(f"scene '{self.scene}': two nodes have the id #{payload[0]}")
            self._written.add(key)
        self._pending.difference_update(keys)

        scene_id = self._scene_id
        wanted: dict[_Values, tuple[int, _Values]] = {}
        for key, (payload, _) in zip(keys, batch, strict=True):
            wanted[key,] = (rows.node_digest(scene_id, key, payload), payload)
        before = self._labels(keys)
        for label in before.values():
            self._count(label, -1)
        for payload, _ in batch:
            self._count(payload[1], 1)
        changed = self._follow("nodes", keys, wanted)
        changed |= self._write_features(keys, batch)
        changed |= self._write_clouds(keys, batch)
        changed |= self._write_views(keys, batch)
        self.added += len(keys) - len(before)
        self.changed += len(changed & before.keys())

    def _write_features(self, keys: list[int], batch: list[tuple[NodePayload, SceneObject | None]]) -> set[int]:
        """Write the vectors of nodes; returns the keys whose vectors are not what they were."""
        wanted: dict[str, dict[_Values, tuple[int, _Values]]] = {space: {} for space in self._stored_spaces}
        for key, (_, obj) in zip(keys, batch, strict=True):
            if obj is not None:
                for space, vector in obj.features.items():
                    data = rows.vector_bytes(vector)
                    digest = rows.feature_digest(self._scene_id, self._space_bytes[space], key, data)
                    wanted.setdefault(space, {})[space, key] = (digest, (data,))
        changed: set[int] = set()
        for space, vectors in wanted.items():
            changed |= self._follow(f"features:{space}", keys, vectors)
        return changed

    def _write_clouds(self, keys: list[int], batch: list[tuple[NodePayload, SceneObject | None]]) -> set[int]:
        """Write the point clouds of nodes; returns the keys whose clouds are not what they were."""
        wanted: dict[_Values, tuple[int, _Values]] = {}
        for key, (_, obj) in zip(keys, batch, strict=True):
            if obj is not None and obj.points is not None:
                payload = rows.cloud_payload(obj.points, obj.colors)
                wanted[key,] = (rows.cloud_digest(self._scene_id, key, *payload), payload)
        return self._follow("clouds", keys, wanted)

    def _write_views(self, keys: list[int], batch: list[tuple[NodePayload, SceneObject | None]]) -> set[int]:
        """Write the views of nodes; returns the keys whose views are not what they were."""
        wanted: dict[_Values, tuple[int, _Values]] = {}
        images: dict[bytes, bytes] = {}
        unread: list[int] = []
        for key, (_, obj) in zip(keys, batch, strict=True):
            if obj is None:
                continue
            if isinstance(obj.views, Unread):
                unread.append(key)
            for rank, view in enumerate(obj.views):
                payload = rows.view_payload(f"object #{obj.id}", view, len(obj.views))
                wanted[key, rank] = (rows.view_digest(self._scene_id, key, rank, payload), payload)
                if view.image is not None and payload[6] is not None:
                    images[payload[6]] = view.image
        kept = self._live_rows("views", unread)
        # Only a replacement goes on over a damaged one; the others of its object count it, and go with it.
        broken = {name[0] for name, (_, _, sound) in kept.items() if not sound}
        for name, (start, mark, _) in kept.items():
            if name[0] not in broken:
                wanted[name] = (rows.seal(mark, start, None), ())
        self._write_images(images)
        return self._follow("views", keys, wanted)

    def _write_images(self, images: dict[bytes, bytes]) -> None:
        """Have the images, by digest, in the store, each once; one that was damaged is whole again."""
        table = schema.images
        for some in _slices(list(images), _BATCH_ROWS):
            mine = (table.c.scene_id == self._scene_id) & table.c.digest.in_(some)
            found = self._connection.execute(select(table.c.digest, table.c.data).where(mine)).all()
            there = {row.digest: row.data for row in found}
            damaged = [digest for digest, data in there.items() if data != images[digest]]
            if damaged:
                self._connection.execute(
                    delete(table).where(table.c.scene_id == self._scene_id, table.c.digest.in_(damaged))
                )
            new = [digest for digest in some if digest not in there or digest in damaged]
            self._insert_rows(table, [(self._scene_id, digest, images[digest]) for digest in new])

    def _follow(self, part: str, keys: list[int], wanted: dict[_Values, tuple[int, _Values]]) -> set[int]:
        """Make the live rows of keys those that are wanted (name -> digest, payload); returns the keys that differ.

        The same rows stay, others are closed and followed.
        """
        table = _TABLES[part.partition(":")[0]]
        key_at = _IDENTITY[table].index("key")
        close: list[_Values] = []
        changed: set[int] = set()
        new = dict(wanted)
        for name, (start, mark, sound) in self._live_rows(part, keys).items():
            digest = rows.seal(mark, start, None)
            if sound and name in wanted and wanted[name][0] == digest:
                del new[name]
                if self._replace:
                    self._add(part, digest)
                continue
            close.append((*name, start, mark))
            changed.add(name[key_at])
        self._close_rows(table, part, close)
        number = self._number
        inserted: list[_Values] = []
        for name, (digest, payload) in new.items():
            inserted.append((self._scene_id, *name, number, None, rows.seal(digest, number, None), *payload))
            self._add(part, digest)
            changed.add(name[key_at])
        self._insert_rows(table, inserted)
        return changed

    def _live_rows(self, part: str, keys: list[int]) -> dict[_Values, tuple[int, int, bool]]:
        """The live rows of keys in a part: name -> rev_from, seal, and whether the row is what was written.

        A merge refuses a damaged row, for its totals would never be right again; a replacement writes it anew.
        """
        if self._fresh:
            return {}
        kind = part.partition(":")[0]
        table = _TABLES[kind]
        names = COLUMNS[kind]
        width = names.index("rev_from")
        found: dict[_Values, tuple[int, int, bool]] = {}
        for some in _slices(keys, _BATCH_ROWS):
            statement = select(*(table.c[name] for name in names)).where(
                table.c.scene_id == self._scene_id, table.c.rev_to.is_(None), table.c.key.in_(some)
            )
            prefix: _Values = ()
            if kind == "features":
                prefix = (part.removeprefix("features:"),)
                statement = statement.where(table.c.space == prefix[0])
            for row in self._connection.execute(statement).all():
                found[*prefix, *row[:width]] = (row.rev_from, row.seal, self._sound(part, row))
        return found

    def _sound(self, part: str, row: Sequence[Any]) -> bool:
        try:
            verified(part, self._scene_id, self.scene, row)
        except CorruptionError as error:
            if self._replace:
                return False
            error.hint = "import the scene whole again, with replace"
            raise
        return True

    def _labels(self, keys: list[int]) -> dict[int, str]:
        """The labels of the live nodes among keys."""
        if self._fresh:
            return {}
        table = schema.nodes.c
        found: dict[int, str] = {}
        for some in _slices(keys, _BATCH_ROWS):
            statement = select(table.key, table.label).where(
                table.scene_id == self._scene_id, table.rev_to.is_(None), table.key.in_(some)
            )
            found.update((key, label) for key, label in self._connection.execute(statement).all())
        return found

    def _find_keys(self, ids: Iterable[str]) -> None:
        """Have a key for every id: the one it always had, or the next free one."""
        missing = [ident for ident in ids if ident not in self._keys]
        if not missing:
            return
        if not self._fresh:
            table = schema.nodes.c
            for some in _slices(missing, _BATCH_ROWS):
                statement = select(table.id, table.key).where(table.scene_id == self._scene_id, table.id.in_(some))
                self._keys.update((ident, key) for ident, key in self._connection.execute(statement.distinct()).all())
        for ident in missing:
            if ident not in self._keys:
                self._keys[ident] = self._next_key
                self._next_key += 1

    # --- relations ---------------------------------------------------------------------------------------------------

    def _write_valid_relations(self, batch: list[Relation]) -> None:
        ready = {payload[:4]: payload for payload in self._relation_payloads(batch)}
        self._note_ends({key for payload in ready.values() for key in payload[:2]})
        self._write_relations(list(ready.values()))

    def _relation_payloads(self, batch: list[Relation]) -> list[RelationPayload]:
        ends = [(rows.id_text(r.source), rows.id_text(r.target)) for r in batch]
        # In the order of the batch: a map gets the same keys wherever and whenever it is imported.
        self._find_keys([end for pair in ends for end in pair])
        keys = self._keys
        return [
            rows.relation_payload(keys[source], keys[target], relation)
            for relation, (source, target) in zip(batch, ends, strict=True)
        ]

    def _note_ends(self, keys: set[int]) -> None:
        unknown = keys - self._written - self._pending
        if unknown and not self._replace:
            unknown -= self._labels(list(unknown)).keys()
        self._pending |= unknown

    def _write_relations(self, batch: list[RelationPayload]) -> None:
        if not self._relations_look_up:
            # A first import seldom says a thing twice. Where it does, the primary key objects, and we look.
            try:
                with self._connection.begin_nested():
                    self._insert_relations(batch)
                return
            except IntegrityError:
                self._relations_look_up = True
        old = self._live_relations({payload[:2] for payload in batch})
        new: list[RelationPayload] = []
        close: list[_Values] = []
        for payload in batch:
            before = old.get(payload[:4])
            if before is not None:
                digest = rows.relation_digest(self._scene_id, payload)
                start, mark, sound = before
                if start == self._number:
                    self._amend_relation(payload, digest, mark)
                    continue
                if sound and rows.seal(mark, start, None) == digest:
                    self._kept_relations.append(digest)
                    continue
                close.append((*payload[:4], start, mark))
            new.append(payload)
        self._close_rows(schema.relations, "relations", close)
        self.relations_removed += len(close)
        self._insert_relations(new)

    def _insert_relations(self, batch: list[RelationPayload]) -> None:
        scene_id, number = self._scene_id, self._number
        digests = [rows.relation_digest(scene_id, payload) for payload in batch]
        self._insert_rows(
            schema.relations,
            [
                (scene_id, *p[:4], number, None, rows.seal(digest, number, None), *p[4:])
                for digest, p in zip(digests, batch, strict=True)
            ],
        )
        for digest in digests:
            self._add("relations", digest)
        self.relations_added += len(batch)

    def _amend_relation(self, payload: RelationPayload, digest: int, mark: int) -> None:
        """A relation said twice in one block: its row is of this revision and may be written over."""
        table = schema.relations
        source, target, label, origin, confidence, explanation = payload
        self._connection.execute(
            update(table)
            .where(table.c.scene_id == self._scene_id, table.c.source == source, table.c.target == target)
            .where(table.c.label == label, table.c.origin == origin, table.c.rev_from == self._number)
            .values(confidence=confidence, explanation=explanation, seal=rows.seal(digest, self._number, None))
        )
        self._add("relations", -rows.seal(mark, self._number, None), 0)
        self._add("relations", digest, 0)

    def _live_relations(self, pairs: set[tuple[int, int]]) -> dict[_Values, tuple[int, int, bool]]:
        """The live relations between pairs of keys: name -> rev_from, seal, and whether the row is sound."""
        table = schema.relations.c
        found: dict[_Values, tuple[int, int, bool]] = {}
        for some in _slices(sorted(pairs), _BATCH_ROWS):
            statement = select(*(table[name] for name in COLUMNS["relations"])).where(
                table.scene_id == self._scene_id,
                table.rev_to.is_(None),
                tuple_(table.source, table.target).in_(some),
            )
            for row in self._connection.execute(statement).all():
                found[tuple(row[:4])] = (row.rev_from, row.seal, self._sound("relations", row))
        return found

    # --- the end of a block ------------------------------------------------------------------------------------------

    def finish(self, kind: str, message: str) -> int | None:
        """Remove what is to go, check the ends of relations, append the revision; None when nothing changed."""
        both = self._removed.keys() & self._written
        if both:
            raise SceneError(f"scene '{self.scene}': #{self._removed[min(both)]} is both written and removed")
        if self._replace and self._old is not None:
            self._remove_unwritten()
        elif self._removed:
            self._remove_nodes(list(self._removed))
        self._check_ends()
        counts = (self.added, self.changed, self.removed, self.relations_added, self.relations_removed)
        if not any(counts) and self._old is not None and self._header_is_old():
            return None
        number = history.add_revision(
            self._connection, kind=kind, scene_id=self._scene_id, scene=self.scene, message=message, counts=counts
        )
        history.add_header(self._connection, self._header(number, removed=False))
        return number

    def finish_removal(self, message: str) -> int:
        """Close every row of the scene and append the revision that says so."""
        for keys in self._live_keys():
            self._remove_nodes(keys, relations=False)
        self._remove_relations(keep=False)
        counts = (self.added, self.changed, self.removed, self.relations_added, self.relations_removed)
        number = history.add_revision(
            self._connection, kind="remove", scene_id=self._scene_id, scene=self.scene, message=message, counts=counts
        )
        history.add_header(self._connection, self._header(number, removed=True))
        return number

    def _remove_unwritten(self) -> None:
        for keys in self._live_keys():
            gone = [key for key in keys if key not in self._written]
            if gone:
                self._remove_nodes(gone, relations=False)
        self._remove_relations(keep=True)

    def _live_keys(self) -> Iterator[list[int]]:
        """Keys of the live nodes that were there before this block, page by page."""
        table = schema.nodes.c
        after = -1
        while True:
            statement = (
                select(table.key)
                .where(table.scene_id == self._scene_id, table.key > after, table.rev_to.is_(None))
                .where(table.rev_from < self._number)
                .order_by(table.key)
                .limit(_BATCH_ROWS)
            )
            keys = list(self._connection.execute(statement).scalars())
            if not keys:
                return
            yield keys
            after = keys[-1]

    def _remove_nodes(self, keys: list[int], *, relations: bool = True) -> None:
        for some in _slices(keys, _BATCH_ROWS):
            live = self._labels(some)
            for label in live.values():
                self._count(label, -1)
            self.removed += len(live)
            self._close_touching(schema.nodes, "nodes", "key", some)
            for space in self._stored_spaces:
                self._close_touching(schema.features, f"features:{space}", "key", some, space)
            self._close_touching(schema.clouds, "clouds", "key", some)
            self._close_touching(schema.views, "views", "key", some)
            if relations:
                for end in ("source", "target"):
                    self.relations_removed += self._close_touching(schema.relations, "relations", end, some)
                # Rows of this block are not closed: what they point to was removed by the same block.
                self._pending.update(some)

    def _close_touching(self, table: Table, part: str, column: str, keys: list[int], space: str | None = None) -> int:
        statement = select(*(table.c[name] for name in (*_IDENTITY[table], "rev_from", "seal"))).where(
            table.c.scene_id == self._scene_id,
            table.c.rev_to.is_(None),
            table.c.rev_from < self._number,
            table.c[column].in_(keys),
        )
        if space is not None:
            statement = statement.where(table.c.space == space)
        found = [tuple(row) for row in self._connection.execute(statement).all()]
        self._close_rows(table, part, found)
        return len(found)

    def _remove_relations(self, *, keep: bool) -> None:
        """Close the relations that were there before this block, but for those that it said again."""
        kept = np.sort(np.frombuffer(self._kept_relations, np.int64)) if keep else np.zeros(0, np.int64)
        table = schema.relations.c
        names = (table.source, table.target, table.label, table.origin)
        after: _Values | None = None
        while True:
            statement = select(*names, table.rev_from, table.seal).where(
                table.scene_id == self._scene_id, table.rev_to.is_(None), table.rev_from < self._number
            )
            if after is not None:
                statement = statement.where(tuple_(*names) > tuple_(*after))
            found = [tuple(r) for r in self._connection.execute(statement.order_by(*names).limit(_RELATIONS)).all()]
            if not found:
                return
            after = found[-1][:4]
            digests = np.array([rows.seal(row[5], row[4], None) for row in found], np.int64)
            stays = np.isin(digests, kept)
            gone = [row for row, stay in zip(found, stays, strict=True) if not stay]
            for digest in digests[stays].tolist():
                self._add("relations", digest)
            self._close_rows(schema.relations, "relations", gone)
            self.relations_removed += len(gone)

    def _check_ends(self) -> None:
        table = schema.relations.c
        for some in _slices(sorted(self._pending), _BATCH_ROWS):
            row = self._connection.execute(
                select(table.source, table.label, table.target)
                .where(table.scene_id == self._scene_id, table.rev_to.is_(None))
                .where(or_(table.source.in_(some), table.target.in_(some)))
                .limit(1)
            ).first()
            if row is not None:
                source, label, target = row
                ids = {key: ident for ident, key in self._keys.items() if key in (source, target)}
                names = {key: ids[key] if key in ids else self._id_of(key) for key in (source, target)}
                missing = names[source if source in self._pending else target]
                raise SceneError(
                    f"relation #{names[source]} {label!r} #{names[target]}: there is no object or place #{missing}"
                )

    def _id_of(self, key: int) -> str:
        table = schema.nodes.c
        statement = select(table.id).where(table.scene_id == self._scene_id, table.key == key).limit(1)
        return str(self._connection.execute(statement).scalar_one())

    def _header_is_old(self) -> bool:
        old = self._old
        return old is not None and (old.frame, old.up, old.spaces, dict(old.provenance)) == (
            self._frame,
            self._up,
            self._spaces,
            self._provenance,
        )

    def _header(self, number: int, *, removed: bool) -> Header:
        totals = {part: (count, total) for part, (count, total) in self._totals.items() if (count, total) != (0, 0)}
        if removed:
            totals = {}
        return Header(
            scene_id=self._scene_id,
            name=self.scene,
            revision=number,
            removed=removed,
            n_objects=self._n_objects,
            n_places=self._n_places,
            n_relations=totals.get("relations", (0, 0))[0],
            next_key=self._next_key,
            frame=self._frame,
            up=self._up,
            spaces=self._spaces,
            provenance=self._provenance,
            totals=totals,
        )

    # --- rows --------------------------------------------------------------------------------------------------------

    def _insert_rows(self, table: Table, new: list[_Values]) -> None:
        if new:
            self._connection.exec_driver_sql(self._insert[table.name], new)

    def _close_rows(self, table: Table, part: str, old: list[_Values]) -> None:
        """End live rows at this revision. old: identity, rev_from, seal of each."""
        if not old:
            return
        names = _IDENTITY[table]
        parameters: list[dict[str, Any]] = []
        for row in old:
            *identity, rev_from, mark = row
            digest = rows.seal(mark, rev_from, None)
            values = {f"at_{name}": value for name, value in zip(names, identity, strict=True)}
            values.update(at_scene=self._scene_id, at_rev_from=rev_from, new_rev_to=self._number)
            parameters.append({**values, "new_seal": rows.seal(digest, rev_from, self._number)})
            if not self._replace:
                self._add(part, -digest, -1)
        self._connection.execute(_CLOSE[table], parameters)

    def _add(self, part: str, digest: int, count: int = 1) -> None:
        total = self._totals.setdefault(part, [0, 0])
        total[0] += count
        total[1] = (total[1] + digest) & MASK

    def _count(self, label: str, by: int) -> None:
        if by < 0 and self._replace:
            return
        if label == "Object":
            self._n_objects += by
        else:
            self._n_places += by


def _merged_header(
    old: Header | None,
    replace: bool,
    name: str,
    frame: str | None,
    up: str | None,
    spaces: tuple[FeatureSpace, ...],
) -> tuple[str, str, tuple[FeatureSpace, ...]]:
    """Frame, up axis and feature spaces of the scene after the block."""
    if up is not None and up not in UP_AXES:
        raise SceneError(f"scene '{name}': up axis {up!r} is none of {', '.join(UP_AXES)}")
    merged: dict[str, FeatureSpace] = {}
    base = () if old is None or replace else old.spaces
    for space in (*base, *spaces):
        before = merged.get(space.name)
        if before is None:
            if not space.name or len(space.name) > 256 or space.dimension < 1:
                raise SceneError(f"scene '{name}': feature space {space.name[:60]!r} of dimension {space.dimension}")
            merged[space.name] = space
        elif before.dimension != space.dimension:
            raise SceneError(
                f"scene '{name}': feature space '{space.name}' has dimension {before.dimension}, not {space.dimension}"
            )
        elif before.encoder is None:
            merged[space.name] = space
        elif space.encoder not in (None, before.encoder):
            raise SceneError(
                f"scene '{name}': feature space '{space.name}' is of encoder {before.encoder}, not {space.encoder}"
            )
    if old is None or replace:
        return frame or "map", up or "z", tuple(merged.values())
    for what, given, kept in (("in frame", frame, old.frame), ("with up axis", up, old.up)):
        if given is not None and given != kept:
            raise SceneError(f"scene '{name}' is {what} '{kept}', what is to be merged is {what} '{given}'")
    return old.frame, old.up, tuple(merged.values())


def _merged_provenance(
    old: Header | None, replace: bool, name: str, provenance: Mapping[str, Any] | None
) -> dict[str, Any]:
    base = {} if old is None or replace else dict(old.provenance)
    base.update(provenance or {})
    try:
        # Through JSON and back: what is compared with the stored one must have its form (tuples are lists there).
        loaded: dict[str, Any] = json.loads(json.dumps(base))
    except (TypeError, ValueError) as error:
        raise SceneError(f"scene '{name}': its provenance cannot be stored as JSON: {error}") from None
    return loaded


def _batches(objects: Iterable[SceneObject]) -> Iterator[list[SceneObject]]:
    """Objects by the batch, cut by number and by bytes: a point cloud weighs as much as a thousand captions."""
    batch: list[SceneObject] = []
    size = 0
    for obj in objects:
        batch.append(obj)
        size += sum(vector.nbytes for vector in obj.features.values())
        if obj.points is not None:
            size += obj.points.nbytes
        size += sum(len(view.image) for view in obj.views if view.image is not None)
        if len(batch) >= _BATCH_ROWS or size >= _BATCH_BYTES:
            yield batch
            batch = []
            size = 0
    if batch:
        yield batch


@contextlib.contextmanager
def _valid_texts(scene: str) -> Iterator[None]:
    """Say which text of a map is none: half a surrogate pair, which JSON may hold and no database stores."""
    try:
        yield
    except UnicodeEncodeError as error:
        near = error.object[max(0, error.start - 20) : error.end + 20]
        raise SceneError(f"scene '{scene}': a text holds what is not valid text: {near!r}") from None


_Item = TypeVar("_Item")


def _slices(items: list[_Item], size: int) -> Iterator[list[_Item]]:
    for start in range(0, len(items), size):
        yield items[start : start + size]
