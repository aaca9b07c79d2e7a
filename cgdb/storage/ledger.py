"""The ledger: the one truth of a store. Scenes, objects, relations, vectors, clouds, views; the revision of each row.

What was read is what was written: every row carries a digest, every scene the count and sum of its live rows.
What a revision holds never changes, so reading one needs no long transaction: each batch is a snapshot of its own and
all of them belong to the same revision. Only pruning takes from the past; who was reading there is told so.
"""

from __future__ import annotations

import contextlib
import os
import uuid
from collections.abc import Iterable, Iterator, Mapping
from datetime import datetime
from itertools import groupby
from operator import itemgetter
from pathlib import Path
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray
from sqlalchemy import Connection, Engine, insert, select

from cgdb.errors import CorruptionError, SceneError, StoreError, VersionError, did_you_mean, one_of
from cgdb.scene import FeatureSpace, ObjectId, SceneGraph, View
from cgdb.storage import history, horizon, migrate, prune, reader, rows, schema, shrink, sqlite
from cgdb.storage.changes import Changes, changes_between
from cgdb.storage.damage import Damage, inspect
from cgdb.storage.history import Revision, SceneInfo
from cgdb.storage.horizon import Horizon
from cgdb.storage.prune import Before, Pruned
from cgdb.storage.rows import NodeRow, RelationRow
from cgdb.storage.snapshot import read_scene_graph
from cgdb.storage.verify import Cloud
from cgdb.storage.writer import OnExisting, SceneWriter

__all__ = [
    "Changes",
    "Damage",
    "Horizon",
    "Ledger",
    "NodeRow",
    "OnExisting",
    "Pruned",
    "RelationRow",
    "Revision",
    "SceneInfo",
    "SceneWriter",
]

FILE = "ledger.sqlite"


class Ledger:
    """An open store. May be used by several threads; one of them, of all processes, writes at a time."""

    def __init__(self, path: Path, engine: Engine, *, read_only: bool, store_id: str) -> None:
        """Use ``Ledger.open``."""
        self.path = path
        self.read_only = read_only
        self.store_id = store_id
        self._engine = engine
        self._closed = False
        self._sound: reader.Sound = set()

    @classmethod
    def open(cls, path: Path, *, create: bool = False, read_only: bool | None = None, patience: float = 10.0) -> Ledger:
        """Open the store in a folder; with create, make it where there is none.

        read_only None means: as the file system allows. patience: seconds to wait for another writer.
        """
        path = Path(path)
        file = path / FILE
        if path.exists() and not path.is_dir():
            raise StoreError(f"{path} is a file, not a store", hint="a store is a folder; `cgdb import` makes one")
        if not file.exists():
            if not create:
                what = "is not a store: there is no ledger in it" if path.is_dir() else "does not exist"
                raise StoreError(f"{path} {what}", hint=f"`cgdb import MAP --into {path}` makes a store")
            _create(path)
        writable = os.access(file, os.W_OK) and os.access(path, os.W_OK)
        if read_only is False and not writable:
            raise StoreError(f"{path}: the store cannot be written: no permission", hint="open it for reading only")
        if not os.access(file, os.R_OK):
            raise StoreError(f"{path}: the store cannot be read: no permission")
        reading_only = not writable if read_only is None else read_only
        engine = sqlite.engine(file, read_only=reading_only, patience=patience)
        try:
            store_id = _identify(engine, file)
        except BaseException:
            engine.dispose()
            raise
        return cls(path, engine, read_only=reading_only, store_id=store_id)

    def close(self) -> None:
        """Give the files back. Closing twice is allowed."""
        self._closed = True
        self._engine.dispose()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    # --- revisions and scenes ----------------------------------------------------------------------------------------

    def revision(self) -> int:
        """The number of the last revision, 0 in an empty store."""
        with self._reading() as connection:
            return history.latest(connection)

    def resolve(self, as_of: int | str | datetime | None) -> int:
        """The revision that a number, an ISO time or a moment stands for; None is the latest."""
        with self._reading() as connection:
            return history.resolve(connection, as_of)

    def scenes(self, as_of: int | str | datetime | None = None) -> tuple[SceneInfo, ...]:
        """The scenes that exist at a revision, by name."""
        with self._reading() as connection:
            at = history.resolve(connection, as_of)
            known_as = None if as_of is None else at
            return tuple(header.info(known_as) for header in history.live_headers(connection, at))

    def scene(self, name: str, as_of: int | str | datetime | None = None) -> SceneInfo:
        """One scene at a revision."""
        with self._reading() as connection:
            at = history.resolve(connection, as_of)
            scene_id = history.scene_id(connection, name)
            if scene_id is not None:
                header = history.read_header(connection, scene_id, name, at)
                if header is not None and not header.removed:
                    return header.info(None if as_of is None else at)
            there = [header.name for header in history.readable_headers(connection, at)]
            when = "" if as_of is None else f" at revision {at}"
            hint = did_you_mean(name, there) or (f"there are {one_of(there)}" if there else "the store is empty")
            raise StoreError(f"there is no scene '{name}'{when}", hint=hint)

    def scene_id(self, name: str) -> int:
        """The number of a scene that there is or was."""
        with self._reading() as connection:
            found = history.scene_id(connection, name)
            if found is None:
                raise StoreError(f"there never was a scene '{name}'")
            return found

    def revisions(self, scene: str | None = None) -> tuple[Revision, ...]:
        """The history of the store, or of one scene, oldest first."""
        with self._reading() as connection:
            every = tuple(history.read_revisions(connection))
            return every if scene is None else tuple(r for r in every if r.scene == scene)

    def horizons(self) -> dict[str, Horizon]:
        """{scene: from where on its history is kept}, of those whose older history was pruned."""
        with self._reading() as connection:
            horizons = horizon.read(connection)
            names = history.scene_names(connection)
            return {name: horizons[number] for name, number in sorted(names.items()) if number in horizons}

    def is_kept(self, scene_id: int, revision: int) -> bool:
        """Whether a revision that a scene had can still be read."""
        with self._reading() as connection:
            return history.state_kept(connection, scene_id, revision)

    # --- rows --------------------------------------------------------------------------------------------------------

    def nodes(self, info: SceneInfo, *, batch: int = 4096) -> Iterator[list[NodeRow]]:
        """All objects and places, by key."""
        return reader.node_batches(self._reading, info, batch)

    def nodes_by_key(self, info: SceneInfo, keys: Iterable[int]) -> dict[int, NodeRow]:
        """The objects and places among keys."""
        return reader.nodes_by_key(self._reading, info, self._sound, keys)

    def node_by_id(self, info: SceneInfo, id: ObjectId) -> NodeRow | None:
        """The object or place with an id."""
        return reader.node_by_id(self._reading, info, self._sound, rows.id_text(id))

    def relations(self, info: SceneInfo, *, batch: int = 8192) -> Iterator[list[RelationRow]]:
        """All relations, by source, target, label and origin."""
        return reader.relation_batches(self._reading, info, batch)

    def relations_of(self, info: SceneInfo, keys: Iterable[int]) -> list[RelationRow]:
        """The relations that touch any of keys, by source, target, label and origin."""
        return reader.relations_of(self._reading, info, keys)

    def features(
        self, info: SceneInfo, space: str, *, batch: int = 4096
    ) -> Iterator[tuple[NDArray[np.int64], NDArray[np.float32]]]:
        """All vectors of a space, by key: keys (b,) and vectors (b, d)."""
        return reader.feature_batches(self._reading, info, space, _dimension(info, space), batch)

    def features_by_key(
        self, info: SceneInfo, space: str, keys: Iterable[int]
    ) -> tuple[NDArray[np.int64], NDArray[np.float32]]:
        """The vectors of a space that nodes among keys have, by key: keys (b,) and vectors (b, d)."""
        return reader.features_by_key(self._reading, info, self._sound, space, _dimension(info, space), keys)

    def cloud(self, info: SceneInfo, key: int) -> Cloud | None:
        """Points (n, 3) float32 m and colors (n, 3) uint8 of a node."""
        return reader.cloud(self._reading, info, self._sound, key)

    def clouds(self, info: SceneInfo) -> Iterator[tuple[int, Cloud]]:
        """The keys and clouds of all nodes that have one, a few in memory at a time."""
        return reader.clouds(self._reading, info)

    def views(self, info: SceneInfo, key: int) -> tuple[View, ...]:
        """Where a node was seen, best first."""
        return reader.views_of(self._reading, info, self._sound, key)

    def every_views(self, info: SceneInfo) -> Iterator[tuple[int, tuple[View, ...]]]:
        """The keys and views of all nodes that have some, by key, a few in memory at a time."""
        for key, found in groupby(reader.views(self._reading, info), key=itemgetter(0)):
            yield key, tuple(view for _, view in found)

    def changes(self, scene_id: int, a: int, b: int) -> Changes:
        """What turns a scene at revision a into the same scene at revision b."""
        with self._reading() as connection:
            for revision in (a, b):
                if revision != 0:
                    history.resolve(connection, revision)
            names = {number: name for name, number in history.scene_names(connection).items()}
            if scene_id not in names:
                raise StoreError(f"there is no scene with number {scene_id}")
            return changes_between(connection, scene_id, names[scene_id], a, b)

    def scene_graph(
        self,
        info: SceneInfo,
        *,
        features: bool = True,
        clouds: bool = True,
        views: bool = False,
        skip_damaged: bool = False,
    ) -> SceneGraph:
        """The whole scene. skip_damaged leaves out what is damaged and lists it in provenance["damaged"]."""
        return read_scene_graph(
            self._reading, info, features=features, clouds=clouds, views=views, skip_damaged=skip_damaged
        )

    def check(self, *, full: bool = True) -> list[Damage]:
        """Everything that is wrong with the file, its rows and its totals; not full: the latest revision only."""
        return inspect(self._reading, full=full)

    # --- writing -----------------------------------------------------------------------------------------------------

    @contextlib.contextmanager
    def write(
        self,
        scene: str,
        *,
        kind: str = "import",
        message: str = "",
        on_existing: OnExisting = "error",
        frame: str | None = None,
        up: str | None = None,
        spaces: Iterable[FeatureSpace] = (),
        provenance: Mapping[str, Any] | None = None,
    ) -> Iterator[SceneWriter]:
        """A block that writes one scene as one revision, whole or, whatever is raised in it, not at all.

        on_existing, for a scene that is there already: "error"; "replace", what is not written again goes; "merge",
        objects and places are replaced by id, relations by their ends, label and origin, and the rest stays. A merge
        keeps frame and up. A block that changes nothing makes no revision.
        """
        if not isinstance(scene, str) or not 0 < len(scene) <= 256 or "\x00" in scene:
            raise SceneError(f"a scene's name must be text of 1 to 256 characters, not {str(scene)[:40]!r}")
        for text in (scene, kind, message):
            rows.check_text("a name or message", text)
        with self._transaction() as connection:
            number = history.latest(connection) + 1
            scene_id, old = self._find(connection, scene, number)
            if on_existing == "error" and old is not None and not old.removed:
                raise StoreError(
                    f"there is a scene '{scene}' already",
                    hint="replace it (--on-existing replace), merge into it (merge), or give another name (--name)",
                )
            writer = SceneWriter(
                self._engine,
                connection,
                number=number,
                scene_id=scene_id,
                old=old,
                name=scene,
                on_existing=on_existing,
                frame=frame,
                up=up,
                spaces=spaces,
                provenance=provenance,
            )
            yield writer
            revision = writer.finish(kind, message)
            if revision is None:
                connection.rollback()
            else:
                connection.commit()
            writer.revision = revision

    def remove_scene(self, name: str, *, message: str = "") -> int:
        """Remove a scene as a revision; earlier revisions still show it. Returns the revision."""
        self.scene(name)
        rows.check_text("a message", message)
        with self._transaction() as connection:
            number = history.latest(connection) + 1
            scene_id, old = self._find(connection, name, number)
            if old is None or old.removed:
                raise StoreError(f"there is no scene '{name}'")
            writer = SceneWriter(self._engine, connection, number=number, scene_id=scene_id, old=old, name=name)
            revision = writer.finish_removal(message)
            connection.commit()
            return revision

    def prune(
        self, *, keep: int | None = None, before: Before = None, scenes: Iterable[str] = (), dry_run: bool = False
    ) -> Pruned:
        """Drop old history, all that is asked or nothing, then shorten the file; dry_run: only say what would go.

        keep: all but the last so many revisions of each scene; before: what is older than the state of each scene at a
        revision or time; both: what neither keeps. scenes: of these only.
        """
        file = self.path / FILE
        wanted = list(scenes)
        size = shrink.size(file)
        try:
            with self._reading() if dry_run else self._transaction() as connection:
                cuts = prune.plan(connection, keep=keep, before=before, scenes=wanted)
                measured = tuple(prune.measure(connection, cut) for cut in cuts)
                if dry_run:
                    return Pruned(dry_run=True, scenes=measured, size_before=size, size_after=size)
                if cuts:
                    prune.apply(connection, cuts)
                    connection.commit()
                else:
                    connection.rollback()
        except StoreError:
            if not (dry_run or self.read_only or self._closed):
                shrink.empty_log(file)
            raise
        notes = shrink.shrink(file)
        return Pruned(
            dry_run=False, scenes=measured, size_before=size, size_after=shrink.size(file), notes=tuple(notes)
        )

    def _find(self, connection: Connection, scene: str, number: int) -> tuple[int, history.Header | None]:
        scene_id = history.scene_id(connection, scene)
        if scene_id is None:
            return history.add_scene(connection, scene), None
        return scene_id, history.read_header(connection, scene_id, scene, number)

    @contextlib.contextmanager
    def _reading(self) -> Iterator[Connection]:
        if self._closed:
            raise StoreError(f"{self.path}: the store is closed")
        with sqlite.translated(self.path / FILE, "reading"), self._engine.connect() as connection:
            yield connection

    @contextlib.contextmanager
    def _transaction(self) -> Iterator[Connection]:
        if self._closed:
            raise StoreError(f"{self.path}: the store is closed")
        if self.read_only:
            raise StoreError(f"{self.path}: the store is open for reading only")
        with sqlite.translated(self.path / FILE, "writing"), sqlite.writing(self._engine) as connection:
            try:
                migrate.upgrade(connection)
                yield connection
            except BaseException:
                # Not given back to the pool: after an interrupt nobody knows its state.
                connection.invalidate()
                raise


def _create(path: Path) -> None:
    """Make a store, complete or not at all: the ledger gets its name only when its tables are in it."""
    try:
        path.mkdir(parents=True, exist_ok=True)
        strangers = [entry.name for entry in path.iterdir() if not entry.name.startswith(FILE + ".new-")]
        if strangers:
            raise StoreError(
                f"{path} is not empty and not a store ({one_of(sorted(strangers), most=3)})",
                hint="give a folder that does not exist yet, or an empty one",
            )
        fresh = path / f"{FILE}.new-{uuid.uuid4().hex}"
        try:
            with sqlite.translated(fresh, "writing"):
                sqlite.create_file(fresh)
                engine = sqlite.engine(fresh, read_only=False, patience=1.0)
                try:
                    with sqlite.writing(engine) as connection:
                        schema.metadata.create_all(connection)
                        values = {"format": str(schema.FORMAT), "store": uuid.uuid4().hex, "head": "0"}
                        connection.execute(insert(schema.meta), [{"name": n, "value": v} for n, v in values.items()])
                        sqlite.set_user_version(connection, schema.FORMAT)
                        connection.commit()
                finally:
                    engine.dispose()
            with contextlib.suppress(FileExistsError):
                # A link, not a rename: of two processes that make the same store, one must not cover the other's.
                os.link(fresh, path / FILE)
        finally:
            fresh.unlink(missing_ok=True)
    except OSError as error:
        raise StoreError(f"{path}: the store cannot be made: {error.strerror or error}") from None


def _identify(engine: Engine, file: Path) -> str:
    """Check that a file is a ledger of a version that is known here; returns the store's own id."""
    with sqlite.translated(file, "reading"), engine.connect() as connection:
        if file.stat().st_size == 0:
            raise CorruptionError(f"{file}: the ledger is empty: its bytes are gone")
        if not sqlite.has_table(connection, schema.meta.name):
            raise StoreError(f"{file} is a database, but not a ledger of cgdb")
        noted = sqlite.user_version(connection)
        values = {str(name): str(value) for name, value in connection.execute(select(schema.meta))}
    version = values.get("format", "")
    # Written in two places, so that a damaged byte is not taken for a newer version.
    if version != str(noted) or "store" not in values:
        raise CorruptionError(f"{file}: the ledger does not tell its format: it is damaged")
    if int(version) > schema.FORMAT:
        raise VersionError(
            f"{file.parent} has format {version}, this cgdb knows formats up to {schema.FORMAT}",
            hint="pip install --upgrade cgdb",
        )
    return str(values["store"])


def _dimension(info: SceneInfo, space: str) -> int:
    for known in info.spaces:
        if known.name == space:
            return known.dimension
    names = [known.name for known in info.spaces]
    hint = did_you_mean(space, names) or (f"there are {one_of(names)}" if names else "the scene has none")
    raise StoreError(f"scene '{info.name}' has no feature space '{space}'", hint=hint)
