"""A scene at one revision as queries see it: columns, indexes and degrees, each opened when first needed."""

from __future__ import annotations

import threading
from collections.abc import Callable, Mapping
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from cgdb.errors import BindError, CorruptionError, did_you_mean
from cgdb.index import columns, neighbours
from cgdb.index.artefacts import Artefact, Artefacts, Build
from cgdb.index.catalog import BUILT_IN, Catalog
from cgdb.index.columns import Columns
from cgdb.index.graph import GraphIndex, property_column
from cgdb.index.neighbours import Relations
from cgdb.index.positions import Positions
from cgdb.index.vectors import VectorIndex
from cgdb.meaning import background
from cgdb.meaning.degrees import Degrees
from cgdb.meaning.texts import FORMAT, TextIndex
from cgdb.result import StoredNode, StoredRelation
from cgdb.scene import FeatureSpace, ObjectId, canonical_id
from cgdb.storage.ledger import Ledger, NodeRow, SceneInfo

CATCH_UP_FROM, CATCH_UP_SHARE, CATCH_UPS = 20_000, 0.1, 3
"""The graph index of a scene of so many nodes follows a change of up to that share of them, so many times in a row:
elsewhere building it anew is as quick, and it leaves no dead space in the file."""

COLUMNS = "columns-4"
"""What the files of ``columns`` are called; another number for another content."""
_GRAPH_COLUMNS = {
    "label": "label",
    "tag": "tag",
    "name": "tag",
    "caption": "caption",
    "confidence": "confidence",
    "n_observations": "n_observations",
}


class SceneView:
    """One scene, read-only. Positions are places in ``columns``; everything here speaks of nodes by position."""

    def __init__(
        self,
        info: SceneInfo,
        ledger: Ledger,
        artefacts: Artefacts,
        degrees_of: Callable[[SceneView], Degrees],
    ) -> None:
        self.info = info
        self._ledger = ledger
        self._artefacts = artefacts
        self.degrees = degrees_of(self)
        self._columns: dict[str, NDArray[Any]] = {}
        self._vectors: dict[str, VectorIndex] = {}
        self._lock = threading.RLock()

    def close(self) -> None:
        """Close the graph index if it was opened."""
        if "graph" in self.__dict__:
            self.graph.close()

    def interrupt(self) -> None:
        """Stop what the graph index is doing now."""
        if "graph" in self.__dict__:
            self.graph.interrupt()

    # -- indexes ------------------------------------------------------------------------------------------------

    @cached_property
    def _columns_file(self) -> Artefact:
        return self._index(
            COLUMNS,
            lambda path: columns.build(path, self._ledger.nodes(self.info), self._ledger.relations(self.info)),
        )

    @cached_property
    def columns(self) -> Columns:
        """Keys, labels and boxes of all nodes."""
        return columns.read(self._columns_file.path, self._columns_file.meta, self.info.up)

    @cached_property
    def relations(self) -> Relations:
        """All relations as arrays."""
        return neighbours.read(self._columns_file.path)

    @cached_property
    def catalog(self) -> Catalog:
        """What the scene holds, by name."""
        return Catalog.from_json(self._columns_file.meta["catalog"])

    @cached_property
    def graph(self) -> GraphIndex:
        """The graph index, opened for reading."""
        return GraphIndex.open(self._index(GraphIndex.kind(), self._build_graph).path)

    @cached_property
    def texts(self) -> TextIndex:
        """The texts of all nodes and the words in them."""
        # Named after the table of everyday things that it was made with: another table wants another index.
        return TextIndex.open(self._index(f"texts-{FORMAT}-{background.version()}", self._build_texts).path)

    def matrix(self, kind: str, make: Callable[[], NDArray[np.float32]]) -> NDArray[np.float32]:
        """(t, d) a row for each text of ``texts``, kept as a file once ``make`` has made it."""

        def build(path: Path) -> Mapping[str, Any]:
            with path.open("wb") as file:
                np.save(file, make(), allow_pickle=False)
            return {}

        made = self._index(f"{kind}-{FORMAT}-{background.version()}", build)
        try:
            return np.asarray(np.load(made.path, mmap_mode="r", allow_pickle=False))
        except (OSError, ValueError) as error:
            raise CorruptionError(f"the index file {made.path.name} cannot be read: {error}") from error

    def space(self, name: str) -> FeatureSpace:
        """A feature space of the scene by name; BindError with the nearest name where there is none."""
        for space in self.info.spaces:
            if space.name == name:
                return space
        known = [space.name for space in self.info.spaces]
        raise BindError(
            f"scene '{self.info.name}' has no feature space '{name}'",
            hint=did_you_mean(name, known) or (f"it has {', '.join(known)}" if known else "it has no features"),
        )

    def vectors(self, space: str) -> VectorIndex:
        """The vectors of one feature space."""
        if space not in self._vectors:
            dimension = self.space(space).dimension
            made = self._index(
                f"vectors-{space}",
                lambda path: VectorIndex.build(path, dimension, self._ledger.features(self.info, space)),
            )
            self._vectors[space] = VectorIndex.open(made.path, made.meta)
        return self._vectors[space]

    def prepare(self) -> None:
        """Build every index that is not there yet."""
        _ = self.columns, self.graph, self.texts
        for space in self.info.spaces:
            self.vectors(space.name)

    def _index(self, kind: str, build: Build) -> Artefact:
        with self._lock:
            return self._artefacts.get(kind, self.info.id, self.info.revision, build)

    def _build_graph(self, path: Path) -> Mapping[str, Any]:
        """Catch up from the index of an earlier revision where little has changed since, else build anew."""
        columns = self.catalog.columns
        made = self._caught_up(path, columns)
        if made is None:
            nodes, relations = self._ledger.nodes(self.info), self._ledger.relations(self.info)
            made = {**GraphIndex.build(path, nodes, relations, columns), "catch_ups": 0}
        return {**made, "revision": self.info.revision}

    def _caught_up(self, path: Path, columns: Mapping[str, str]) -> Mapping[str, Any] | None:
        if len(self.columns.keys) < CATCH_UP_FROM:
            return None
        old = self._artefacts.previous(GraphIndex.kind(), self.info.id, self.info.revision)
        if old is None or old.meta["catch_ups"] >= CATCH_UPS:
            return None
        if not self._ledger.is_kept(self.info.id, old.meta["revision"]):
            return None  # pruned: nobody can say what has changed since
        if any(columns.get(name, kind) != kind for name, kind in old.meta["columns"].items()):
            return None
        changes = self._ledger.changes(self.info.id, old.meta["revision"], self.info.revision)
        sources = {r.source for r in (*changes.relations_added, *changes.relations_removed)} | set(changes.added)
        upserted = [*changes.added, *changes.changed]
        if len(sources) + len(upserted) + len(changes.removed) > CATCH_UP_SHARE * len(self.columns.keys):
            return None
        rows = self._ledger.nodes_by_key(self.info, upserted)
        relations = [r for r in self._ledger.relations_of(self.info, sources) if r.source in sources]
        made = GraphIndex.catch_up(
            path,
            old.path,
            columns=columns,
            removed=changes.removed,
            nodes=iter([list(rows.values())]),
            sources=sources,
            relations=iter([relations]),
        )
        return {**made, "catch_ups": old.meta["catch_ups"] + 1}

    def _build_texts(self, path: Path) -> Mapping[str, Any]:
        TextIndex.build(node for batch in self._ledger.nodes(self.info) for node in batch).save(path)
        return {}

    # -- nodes and relations ------------------------------------------------------------------------------------

    def find(self, node_id: ObjectId) -> int | None:
        """The position of the object or place with this id, or None."""
        return self._places.get(canonical_id(node_id))

    @cached_property
    def _places(self) -> dict[ObjectId, int]:
        return {node_id: position for position, node_id in enumerate(self.column("id").tolist())}

    def position(self, node_id: ObjectId) -> int:
        """The position of the object or place with this id; BindError where there is none."""
        position = self.find(node_id)
        if position is None:
            raise BindError(f"there is no #{node_id} in scene '{self.info.name}'")
        return position

    def column(self, name: str) -> NDArray[Any]:
        """(n,) a property of every node: float64 with NaN for null where it is a number, else objects with None."""
        if name not in self._columns:
            self._columns[name] = self._column(name)
        return self._columns[name]

    def _column(self, name: str) -> NDArray[Any]:
        boxes = self.columns.boxes
        if name == "id":
            return _objects(columns.read_ids(self._columns_file.path))
        if name in ("x", "y", "z"):
            return boxes.centers[:, "xyz".index(name)]
        if name == "scene":
            return _objects([self.info.name] * len(self.columns.keys))
        kind = BUILT_IN.get(name) or self.catalog.properties.get(name)
        if name in ("center", "extent"):
            array = boxes.centers if name == "center" else boxes.extents
            known = np.asarray(np.isfinite(array).all(axis=1))
            return _objects([row if ok else None for row, ok in zip(array.tolist(), known.tolist(), strict=True)])
        if kind is None:
            return _objects([None] * len(self.columns.keys))
        in_graph = _GRAPH_COLUMNS.get(name) or (
            property_column(name) if name not in BUILT_IN and kind in ("number", "text", "boolean", "list") else None
        )
        if in_graph is not None:
            table = self.graph.run(f"MATCH (n:Node) RETURN n.key AS k, n.{in_graph} AS v")
            order = np.argsort(np.asarray(table.data[0], np.int64))
            values = table.data[1]
            if isinstance(values, np.ndarray):
                return values.astype(np.float64)[order] if kind == "number" else _objects(values[order].tolist())
            ordered = [values[i] for i in order.tolist()]
            if kind == "number":
                return np.asarray([np.nan if v is None else float(v) for v in ordered])
            return _objects(ordered)
        rows = (row for batch in self._ledger.nodes(self.info) for row in batch)
        if name == "tags":
            return _objects([list(row.tags) for row in rows])
        return _objects([_listed(row.properties.get(name)) for row in rows])

    def rows(self, positions: Positions) -> dict[int, NodeRow]:
        """{position: the ledger's row} of these nodes."""
        keys = self.columns.keys[positions].tolist()
        found = self._ledger.nodes_by_key(self.info, list(dict.fromkeys(keys)))
        return {int(position): found[key] for position, key in zip(positions.tolist(), keys, strict=True)}

    def stored(self, positions: Positions) -> dict[int, StoredNode]:
        """{position: the record} of these nodes, as results hold them."""
        return {position: self._stored(row) for position, row in self.rows(positions).items()}

    def _stored(self, row: NodeRow) -> StoredNode:
        return StoredNode(
            scene=self.info.name,
            id=row.id,
            label=row.label,
            tag=row.tag,
            tags=row.tags,
            caption=row.caption,
            center=row.center,
            extent=row.extent,
            rotation=row.rotation,
            n_observations=row.n_observations,
            confidence=row.confidence,
            properties=row.properties,
        )

    def relations_of(self, positions: Positions) -> list[StoredRelation]:
        """All relations that touch one of these nodes."""
        found = self._ledger.relations_of(self.info, self.columns.keys[positions].tolist())
        ends = self.columns.positions(np.asarray([[r.source, r.target] for r in found], np.int64).reshape(-1, 2))
        ids = {position: row.id for position, row in self.rows(np.unique(ends)).items()}
        return [
            StoredRelation(
                scene=self.info.name,
                source=ids[int(source)],
                target=ids[int(target)],
                label=relation.label,
                confidence=relation.confidence,
                explanation=relation.explanation,
                origin=relation.origin,
            )
            for relation, (source, target) in zip(found, ends.tolist(), strict=True)
        ]


def _objects(values: list[Any]) -> NDArray[np.object_]:
    column = np.empty(len(values), object)
    column[:] = values
    return column


def _listed(value: Any) -> Any:
    return list(value) if isinstance(value, tuple) else value
