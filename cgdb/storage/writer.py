"""Writing one scene as one revision: rows that changed are closed and followed, all others stay as they are.

A block streams: it holds one batch of rows and, per node of the scene, its id and key. A relation may come before its
objects: an id that is not known yet is given its key at once, and at the end no such key may be left without a node.
"""

from __future__ import annotations

import contextlib
from collections.abc import Iterable, Iterator, Mapping
from itertools import islice
from typing import Any, Literal, TypeAlias

from sqlalchemy import Connection, Engine

from cgdb.errors import SceneError
from cgdb.scene import (
    FeatureSpace,
    ObjectId,
    Place,
    Relation,
    SceneObject,
    check_object,
    check_place,
    check_relation,
)
from cgdb.storage import history, rows
from cgdb.storage.about import about, settled
from cgdb.storage.history import Counts, Header
from cgdb.storage.keys import Keys
from cgdb.storage.live import BATCH, LiveRows
from cgdb.storage.node_writer import Node, NodeWriter
from cgdb.storage.relation_writer import AT_ONCE, RelationWriter

OnExisting: TypeAlias = Literal["error", "replace", "merge"]

_BATCH_BYTES = 16 << 20


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
        on_existing: OnExisting = "merge",
        frame: str | None = None,
        up: str | None = None,
        spaces: Iterable[FeatureSpace] = (),
        provenance: Mapping[str, Any] | None = None,
    ) -> None:
        self.revision: int | None = None
        self.scene = name
        self._old = None if old is None or old.removed else old
        self._replace = on_existing == "replace" or self._old is None
        # A replacement counts everything anew, which also heals a scene whose rows or totals are damaged.
        start = None if self._replace else self._old
        self._about = settled(name, start, frame=frame, up=up, spaces=spaces, provenance=provenance)
        self._dimensions = {space.name: space.dimension for space in self._about.spaces}
        self._removed: dict[int, str] = {}
        self._live = LiveRows(
            database,
            connection,
            number=number,
            scene_id=scene_id,
            scene=name,
            totals=None if start is None else start.totals,
            fresh=old is None,
        )
        self._keys = Keys(self._live, 1 if old is None else old.next_key)
        stored = () if self._old is None else self._old.totals
        self._nodes = NodeWriter(
            self._live,
            self._keys,
            stored_spaces=[part.removeprefix("features:") for part in stored if part.startswith("features:")],
            n_objects=0 if start is None else start.n_objects,
            n_places=0 if start is None else start.n_places,
        )
        self._relations = RelationWriter(self._live, self._keys)

    @property
    def counts(self) -> Counts:
        """Nodes added, changed, removed; relations added, removed, so far."""
        nodes, relations = self._nodes, self._relations
        return nodes.added, nodes.changed, nodes.removed, relations.added, relations.removed

    # --- what a block may call ---------------------------------------------------------------------------------------

    def objects(self, objects: Iterable[SceneObject]) -> None:
        """Write objects, checked, in batches of their own."""
        for batch in _batches(objects):
            ready: list[Node] = []
            for obj in batch:
                check_object(obj, self._dimensions)
                ready.append((rows.object_payload(obj), obj))
            with _valid_texts(self.scene):
                self._nodes.write(ready)

    def places(self, places: Iterable[Place]) -> None:
        """Write places, checked. They share the ids of the objects."""
        stream = iter(places)
        while batch := list(islice(stream, BATCH)):
            ready: list[Node] = []
            for place in batch:
                check_place(place)
                ready.append((rows.place_payload(place), None))
            with _valid_texts(self.scene):
                self._nodes.write(ready)

    def relations(self, relations: Iterable[Relation]) -> None:
        """Write relations, checked; their ends may be written later in the block. The last of several alike counts."""
        stream = iter(relations)
        while batch := list(islice(stream, AT_ONCE)):
            for relation in batch:
                check_relation(relation)
            with _valid_texts(self.scene):
                self._relations.write(batch)

    def unrelate(self, relations: Iterable[Relation]) -> None:
        """Remove relations, by their ends, label and origin. SceneError for one that is not there."""
        stream = iter(relations)
        while batch := list(islice(stream, AT_ONCE)):
            with _valid_texts(self.scene):
                self._relations.remove(batch)

    def remove(self, ids: Iterable[ObjectId]) -> None:
        """Remove objects or places with all that is theirs, relations too. SceneError for an id that is not there."""
        stream = iter(ids)
        while batch := list(islice(stream, BATCH)):
            texts = [rows.id_text(value) for value in batch]
            keys = self._keys.of(texts)
            live = self._keys.labels(keys)
            for key, text in zip(keys, texts, strict=True):
                if key not in live:
                    raise SceneError(f"scene '{self.scene}': there is no object or place #{text} to remove")
                self._removed[key] = text

    # --- the end of a block ------------------------------------------------------------------------------------------

    def finish(self, kind: str, message: str) -> int | None:
        """Remove what is to go, check the ends of relations, append the revision; None when nothing changed."""
        both = self._removed.keys() & self._keys.written
        if both:
            raise SceneError(f"scene '{self.scene}': #{self._removed[min(both)]} is both written and removed")
        if self._replace and self._old is not None:
            self._nodes.remove_unwritten()
            self._relations.remove_unsaid()
        elif self._removed:
            self._nodes.remove(list(self._removed))
            self._relations.remove_of_nodes(list(self._removed))
        self._relations.check_ends()
        if not any(self.counts) and self._old is not None and about(self._old) == self._about:
            return None
        return self._append(kind, message, removed=False)

    def finish_removal(self, message: str) -> int:
        """Close every row of the scene and append the revision that says so."""
        self._nodes.remove_all()
        self._relations.remove_all()
        return self._append("remove", message, removed=True)

    def _append(self, kind: str, message: str, *, removed: bool) -> int:
        connection, scene_id = self._live.connection, self._live.scene_id
        number = history.add_revision(
            connection, kind=kind, scene_id=scene_id, scene=self.scene, message=message, counts=self.counts
        )
        totals = {} if removed else self._live.totals
        header = Header(
            scene_id=scene_id,
            name=self.scene,
            revision=number,
            removed=removed,
            n_objects=self._nodes.n_objects,
            n_places=self._nodes.n_places,
            n_relations=totals.get("relations", (0, 0))[0],
            next_key=self._keys.next,
            frame=self._about.frame,
            up=self._about.up,
            spaces=self._about.spaces,
            provenance=self._about.provenance,
            totals=totals,
        )
        history.add_header(connection, header)
        return number


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
        if len(batch) >= BATCH or size >= _BATCH_BYTES:
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
