"""Writing the objects and places of one scene in one revision, each with its features, cloud and views."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from typing import TypeAlias

from sqlalchemy import delete, select

from cgdb.errors import SceneError
from cgdb.scene import SceneObject, Unread
from cgdb.storage import rows, schema
from cgdb.storage.keys import Keys
from cgdb.storage.live import BATCH, LiveRows, Name, Values, slices
from cgdb.storage.rows import NodePayload

Node: TypeAlias = tuple[NodePayload, SceneObject | None]
"""The row of an object or place; of an object, what it was made of, too."""

_Keyed: TypeAlias = list[tuple[int, SceneObject]]
_Wanted: TypeAlias = dict[Name, tuple[int, Values]]


class NodeWriter:
    """What a block says of nodes. added, changed, removed: how many; n_objects, n_places: that the scene then has."""

    def __init__(
        self, live: LiveRows, keys: Keys, *, stored_spaces: Iterable[str], n_objects: int, n_places: int
    ) -> None:
        """stored_spaces: in which the scene has vectors. n_objects, n_places: to count from."""
        self.added = self.changed = self.removed = 0
        self.n_objects, self.n_places = n_objects, n_places
        self._live, self._keys = live, keys
        self._stored_spaces = tuple(stored_spaces)

    def write(self, batch: Sequence[Node]) -> None:
        """Write checked nodes, each instead of what was live under its id."""
        keys = self._keys.of([payload[0] for payload, _ in batch])
        wanted: _Wanted = {}
        for key, (payload, _) in zip(keys, batch, strict=True):
            if key in self._keys.written:
                raise SceneError(f"scene '{self._live.scene}': two nodes have the id #{payload[0]}")
            self._keys.written.add(key)
            wanted[key,] = (rows.node_digest(self._live.scene_id, key, payload), payload)
        self._keys.pending.difference_update(keys)
        before = self._keys.labels(keys)
        if not self._live.anew:
            self._count(before.values(), -1)
        self._count((payload[1] for payload, _ in batch), 1)
        objects = [(key, obj) for key, (_, obj) in zip(keys, batch, strict=True) if obj is not None]
        changed = self._live.follow("nodes", keys, wanted)
        changed |= self._write_features(keys, objects)
        changed |= self._write_clouds(keys, objects)
        changed |= self._write_views(keys, objects)
        self.added += len(keys) - len(before)
        self.changed += len(changed & before.keys())

    def remove(self, keys: Sequence[int]) -> None:
        """End all rows of nodes, but not their relations."""
        for some in slices(keys, BATCH):
            live = self._keys.labels(some)
            if not self._live.anew:
                self._count(live.values(), -1)
            self.removed += len(live)
            for part in ("nodes", *(f"features:{space}" for space in self._stored_spaces), "clouds", "views"):
                self._live.close_touching(part, "key", some)

    def remove_unwritten(self) -> None:
        """End what was there before this block and was not written again."""
        for keys in self._before():
            self.remove([key for key in keys if key not in self._keys.written])

    def remove_all(self) -> None:
        """End what was there before this block."""
        for keys in self._before():
            self.remove(keys)

    def _before(self) -> Iterator[list[int]]:
        """Keys of the live nodes that were there before this block, page by page."""
        key = schema.nodes.c.key
        page = self._live.select("nodes", ("key",), before=True).order_by(key).limit(BATCH)
        after = page
        while keys := list(self._live.connection.execute(after).scalars()):
            yield keys
            after = page.where(key > keys[-1])

    def _write_features(self, keys: Sequence[int], objects: _Keyed) -> set[int]:
        """Write the vectors of nodes; returns the keys whose vectors are not what they were."""
        wanted: dict[str, _Wanted] = {space: {} for space in self._stored_spaces}
        for key, obj in objects:
            for space, vector in obj.features.items():
                data = rows.vector_bytes(vector)
                digest = rows.feature_digest(self._live.scene_id, space.encode(), key, data)
                wanted.setdefault(space, {})[space, key] = (digest, (data,))
        changed: set[int] = set()
        for space, vectors in wanted.items():
            changed |= self._live.follow(f"features:{space}", keys, vectors)
        return changed

    def _write_clouds(self, keys: Sequence[int], objects: _Keyed) -> set[int]:
        """Write the point clouds of nodes; returns the keys whose clouds are not what they were."""
        wanted: _Wanted = {}
        for key, obj in objects:
            if obj.points is not None:
                payload = rows.cloud_payload(obj.points, obj.colors)
                wanted[key,] = (rows.cloud_digest(self._live.scene_id, key, *payload), payload)
        return self._live.follow("clouds", keys, wanted)

    def _write_views(self, keys: Sequence[int], objects: _Keyed) -> set[int]:
        """Write the views of nodes; returns the keys whose views are not what they were."""
        wanted: _Wanted = {}
        images: dict[bytes, bytes] = {}
        for key, obj in objects:
            for rank, view in enumerate(obj.views):
                payload = rows.view_payload(f"object #{obj.id}", view, len(obj.views))
                wanted[key, rank] = (rows.view_digest(self._live.scene_id, key, rank, payload), payload)
                if view.image is not None and payload[6] is not None:
                    images[payload[6]] = view.image
        kept = self._live.of_keys("views", [key for key, obj in objects if isinstance(obj.views, Unread)])
        # Only a replacement goes on over a damaged one; the others of its object count it, and go with it.
        broken = {name[0] for name, (_, _, sound) in kept.items() if not sound}
        for name, (start, mark, _) in kept.items():
            if name[0] not in broken:
                wanted[name] = (rows.seal(mark, start, None), ())
        self._write_images(images)
        return self._live.follow("views", keys, wanted)

    def _write_images(self, images: dict[bytes, bytes]) -> None:
        """Have the images, by digest, in the store, each once; one that was damaged is whole again."""
        table, scene_id, connection = schema.images, self._live.scene_id, self._live.connection
        for some in slices(list(images), BATCH):
            mine = (table.c.scene_id == scene_id) & table.c.digest.in_(some)
            found = connection.execute(select(table.c.digest, table.c.data).where(mine)).all()
            there = {row.digest: row.data for row in found}
            damaged = [digest for digest, data in there.items() if data != images[digest]]
            if damaged:
                connection.execute(delete(table).where(table.c.scene_id == scene_id, table.c.digest.in_(damaged)))
            new = [digest for digest in some if digest not in there or digest in damaged]
            self._live.insert(table, [(scene_id, digest, images[digest]) for digest in new])

    def _count(self, labels: Iterable[str], by: int) -> None:
        for label in labels:
            if label == "Object":
                self.n_objects += by
            else:
                self.n_places += by
