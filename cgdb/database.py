"""Database: a store as programs use it. Each method is a few lines; what it does has a module of its own."""

from __future__ import annotations

import contextlib
import threading
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from datetime import datetime
from pathlib import Path
from types import TracebackType
from typing import TYPE_CHECKING, Any, Self

import numpy as np

from cgdb.errors import BindError, CgdbError, StoreError, one_of
from cgdb.index.artefacts import Artefacts
from cgdb.index.positions import Positions
from cgdb.meaning import background
from cgdb.meaning.degrees import Degrees
from cgdb.meaning.embed import TEXT_MODEL, Encoder
from cgdb.meaning.encoders import Encoders
from cgdb.meaning.meanings import LikeMeaning, Meaning, TextMeaning, Vector, VectorMeaning
from cgdb.query.limits import Budget, Limits
from cgdb.query.run import run
from cgdb.query.search import Hits, check_k, search
from cgdb.result import Result, StoredNode, StoredRelation
from cgdb.scene import FeatureSpace, ObjectId, SceneGraph, View, canonical_id
from cgdb.storage.freshness import Fresh
from cgdb.storage.ledger import FILE as LEDGER
from cgdb.storage.ledger import Changes, Ledger, OnExisting, Revision, SceneInfo, SceneWriter
from cgdb.storage.text_vectors import TextVectors
from cgdb.view import SceneView

if TYPE_CHECKING:
    import networkx

    from cgdb.asking.answer import Answer
    from cgdb.enrich.calls import Pace
    from cgdb.enrich.captions import Captioning
    from cgdb.enrich.properties import Enrichment
    from cgdb.enrich.relations import Relating
    from cgdb.export import Exported
    from cgdb.index.graph import Table
    from cgdb.model.llm import Model
    from cgdb.model.rerank import Reranker

AsOf = int | str | datetime | None
ENCODE_BATCH = 1024


@dataclass(frozen=True, slots=True, kw_only=True)
class Problem:
    """Something that `check` found. where: the part of the store. repaired: whether it is right again."""

    where: str
    message: str
    repaired: bool = False

    def __str__(self) -> str:
        return f"{self.where}: {self.message}" + (" (repaired)" if self.repaired else "")


def open(
    path: str | Path,
    *,
    create: bool = False,
    read_only: bool | None = None,
    text_encoder: Encoder | str | None = TEXT_MODEL,
    space_encoders: Mapping[str, Encoder] | None = None,
    limits: Limits | None = None,
    patience: float = 10.0,
) -> Database:
    """Open a store, a folder NAME.cgdb; with create, make it where there is none.

    read_only None: as the file system allows. text_encoder: of captions, None to do without. space_encoders:
    {feature space: encoder} beside those that the maps name. limits: of every query. patience: seconds to wait while
    another process writes. StoreError, VersionError or CorruptionError where the store cannot be opened.
    """
    ledger = Ledger.open(Path(path), create=create, read_only=read_only, patience=patience)
    return Database(ledger, text_encoder=text_encoder, space_encoders=space_encoders, limits=limits or Limits())


class Database:
    """An open store. Use ``cgdb.open``. Threads may share it; close it, or use it in a with-statement."""

    def __init__(
        self,
        ledger: Ledger,
        *,
        text_encoder: Encoder | str | None,
        space_encoders: Mapping[str, Encoder] | None,
        limits: Limits,
    ) -> None:
        self._ledger = ledger
        self._scenes_now = Fresh(ledger.path / LEDGER, ledger.scenes, read_only=ledger.read_only)
        self.model: Model | None = None
        """The language model that is asked; the configured one where none is set."""
        self.reranker: Reranker | None = None
        """Who carries out RERANK BY; the language model where nobody is set."""
        self._limits = limits
        self._artefacts = Artefacts(ledger.path / "index", writable=not ledger.read_only)
        self._kept = TextVectors(ledger.path / "texts.sqlite", read_only=ledger.read_only)
        self._encoders = Encoders(self._kept, text=text_encoder, spaces=space_encoders)
        self.degrees_of: Callable[[SceneView], Degrees] = lambda view: Degrees(view, self._encoders)
        self._views: dict[tuple[int, int], SceneView] = {}
        self._running: set[Budget] = set()
        self._wrote = False
        self._lock = threading.RLock()

    @property
    def path(self) -> Path:
        """The folder of the store."""
        return self._ledger.path

    @property
    def read_only(self) -> bool:
        """Whether nothing can be written."""
        return self._ledger.read_only

    def close(self) -> None:
        """Give all files back. Closing twice is allowed."""
        for view in self._views.values():
            view.close()
        self._views.clear()
        if self._wrote:
            self._wrote = False
            with contextlib.suppress(CgdbError):  # housekeeping: what is wrong is told by whoever needs it
                self._sweep()
        self._artefacts.close()
        self._kept.close()
        self._scenes_now.close()
        self._ledger.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    # -- what is there ------------------------------------------------------------------------------------------

    def scenes(self, as_of: AsOf = None) -> tuple[SceneInfo, ...]:
        """The scenes of the store, by name."""
        return self._ledger.scenes(as_of)

    def revisions(self, scene: str | None = None) -> tuple[Revision, ...]:
        """The history, oldest first."""
        return self._ledger.revisions(scene)

    def diff(self, a: int, b: int, scene: str | None = None) -> dict[str, Changes]:
        """{scene: what turns it as of revision a into it as of revision b}, of the scenes that differ."""
        for revision in (a, b):
            if revision != 0:  # before the first revision there was nothing, which can be compared with
                self._ledger.resolve(revision)
        names = {r.scene for r in self._ledger.revisions() if min(a, b) < r.id <= max(a, b)}
        found = {}
        for name in sorted(names if scene is None else names & {scene}):
            info = self._any_info(name, (b, a))
            found[name] = self._ledger.changes(info.id, a, b)
        return found

    def scene(
        self,
        name: str,
        *,
        as_of: AsOf = None,
        features: bool = True,
        clouds: bool = True,
        views: bool = False,
        skip_damaged: bool = False,
    ) -> SceneGraph:
        """A whole scene in memory. skip_damaged leaves damaged rows out and lists them in provenance["damaged"].

        Views with their images are read where they are asked for. Objects without them are UNREAD: written back to
        their scene, they leave the stored views as they are.
        """
        info = self._ledger.scene(name, as_of)
        return self._ledger.scene_graph(info, features=features, clouds=clouds, views=views, skip_damaged=skip_damaged)

    def object(self, object_id: ObjectId, *, scene: str | None = None, as_of: AsOf = None) -> StoredNode:
        """The record of an object or place. scene may be left out where only one scene has the id."""
        view, position = self._locate(object_id, scene, as_of)
        return view.stored(np.asarray([position], np.int64))[position]

    def relations(
        self, object_id: ObjectId, *, scene: str | None = None, as_of: AsOf = None
    ) -> tuple[StoredRelation, ...]:
        """All relations of an object or place, either way."""
        view, position = self._locate(object_id, scene, as_of)
        return tuple(view.relations_of(np.asarray([position], np.int64)))

    def nodes_by_key(self, scene: str, keys: Iterable[int], *, as_of: AsOf = None) -> tuple[StoredNode, ...]:
        """The records behind the keys that `diff` speaks of, in their order."""
        view = self.view(scene, as_of)
        positions = view.columns.positions(np.asarray(list(keys), np.int64))
        records = view.stored(positions)
        return tuple(records[position] for position in positions.tolist())

    def points(self, object_id: ObjectId, *, scene: str | None = None, as_of: AsOf = None) -> Any:
        """(points (n, 3) float32 m, colors (n, 3) uint8 or None) of an object; None where the map has none."""
        view, position = self._locate(object_id, scene, as_of)
        return self._ledger.cloud(view.info, int(view.columns.keys[position]))

    def clouds(self, scene: str, *, as_of: AsOf = None) -> Iterator[tuple[ObjectId, Any]]:
        """The id and (points, colors) of every object with a cloud, as from ``points``, a few in memory at a time."""
        view = self.view(scene, as_of)
        ids = dict(zip(view.columns.keys.tolist(), view.column("id").tolist(), strict=True))
        for key, cloud in self._ledger.clouds(view.info):
            yield ids[key], cloud

    def views(self, object_id: ObjectId, *, scene: str | None = None, as_of: AsOf = None) -> tuple[View, ...]:
        """Where an object was seen, best first: the frames, their poses, and the object cut out of them."""
        view, position = self._locate(object_id, scene, as_of)
        return self._ledger.views(view.info, int(view.columns.keys[position]))

    def every_views(self, scene: str, *, as_of: AsOf = None) -> Iterator[tuple[ObjectId, tuple[View, ...]]]:
        """The id and views of every object that has some, as from ``views``, a few in memory at a time."""
        view = self.view(scene, as_of)
        ids = dict(zip(view.columns.keys.tolist(), view.column("id").tolist(), strict=True))
        for key, views in self._ledger.every_views(view.info):
            yield ids[key], views

    def view(self, name: str, as_of: AsOf = None) -> SceneView:
        """A scene as queries see it: its catalog, columns and indexes."""
        return self._view(self._ledger.scene(name, as_of))

    # -- asking -------------------------------------------------------------------------------------------------

    def query(
        self, text: str, parameters: Mapping[str, Any] | None = None, /, *, limits: Limits | None = None, **more: Any
    ) -> Result:
        """The answer to a CGQL statement; ``$name`` in it stands for a parameter, never pasted into the text."""
        with self._budget(limits) as budget:
            return run(text, {**(parameters or {}), **more}, self._views_of, budget, self.reranker or self.model)

    def ask(
        self,
        question: str,
        *,
        previous: Answer | None = None,
        image: str | Path | None = None,
        model: Model | bool = True,
        rerank: bool | str | Reranker = True,
        scenes: Sequence[str] = (),
        as_of: int | str | None = None,
        limits: Limits | None = None,
    ) -> Answer:
        """The answer to a question in plain words. previous: the answer that it follows up; image: a picture file.

        model: True for the configured one, if any; False for the built-in translator; or what ``llm.connect`` gives.
        rerank: True for that model; "cross:" and a cross-encoder's folder or name; a re-ranker; or False.
        """
        from cgdb.asking.ask import ask

        return ask(
            self,
            question,
            model=self._asked_model(model),
            previous=previous,
            image=image,
            scenes=scenes,
            as_of=as_of,
            rerank=rerank,
            limits=limits,
            encoder_of=self._encoders.space,
        )

    def enrich(
        self,
        *,
        model: Model | None = None,
        scenes: Sequence[str] = (),
        robot: str | None = None,
        batch: int | None = None,
    ) -> Enrichment:
        """What asks a model once of each thing what is known of it: ``estimate()``, then go through ``run()``."""
        from cgdb.enrich.properties import BATCH, Enrichment

        chosen = model or self._asked_model(True)
        return Enrichment(self, chosen, scenes=scenes, robot=robot, batch=BATCH if batch is None else batch)

    def caption(
        self,
        *,
        model: Model | None = None,
        scenes: Sequence[str] = (),
        views: int = 10,
        together: bool = False,
        again: bool = False,
        pace: Pace | None = None,
    ) -> Captioning:
        """What asks a vision model for captions and names by best views: ``estimate()``, then go through ``run()``.

        together: all views of an object in one call. again: also objects that have a caption.
        """
        from cgdb.enrich.captions import Captioning

        chosen = model or self._asked_model(True)
        return Captioning(self, chosen, scenes=scenes, views=views, together=together, again=again, pace=pace)

    def relate(
        self,
        *,
        model: Model | None = None,
        scenes: Sequence[str] = (),
        every_pair: bool = False,
        reach: float = 0.025,
        batch: int = 6,
        pace: Pace | None = None,
    ) -> Relating:
        """What asks a model how touching things stand to each other: ``estimate()``, then go through ``run()``.

        every_pair: not only a spanning forest of the strongest overlaps. reach: metres between boxes that touch.
        """
        from cgdb.enrich.relations import Relating

        chosen = model or self._asked_model(True)
        return Relating(self, chosen, scenes=scenes, every_pair=every_pair, reach=reach, batch=batch, pace=pace)

    def _asked_model(self, model: Model | bool) -> Model | None:
        from cgdb.model.rerank import configured

        if not isinstance(model, bool):
            return model
        if model and self.model is None:
            self.model = configured()
        return self.model if model else None

    def cancel(self) -> None:
        """Stop the queries that run now in other threads: they raise QueryCancelled."""
        for budget in list(self._running):
            budget.cancelled.set()
        for view in list(self._views.values()):
            view.interrupt()

    def search(
        self,
        what: str | Vector | Sequence[float] | np.ndarray[Any, Any],
        *,
        space: str | None = None,
        k: int = 10,
        scenes: Sequence[str] | str | None = None,
        where: str | None = None,
        parameters: Mapping[str, Any] | None = None,
    ) -> Hits:
        """The k nearest objects to a vector (cosine) or a text (its degree; with space, cosine in that space).

        where: a CGQL condition on the object ``o``, such as ``volume(o) < 0.1 AND NOT o ~ "cushion"``; those that
        fit it are searched.
        """
        names = [scenes] if isinstance(scenes, str) else scenes
        views = self._views_of(names, None)
        meaning = _meaning(what, space)
        allowed: list[Positions | None] = [None] * len(views)
        if where is not None:
            with self._budget(None) as budget:
                allowed = [_fitting(view, where, parameters or {}, budget) for view in views]
        return search(views, meaning, space=space, k=check_k(k), allowed=allowed)

    def cypher(
        self, text: str, parameters: Mapping[str, Any] | None = None, /, *, scene: str | None = None, **more: Any
    ) -> Table:
        """The answer of a scene's graph index to read-only Cypher: Node(key, id, label, tag, ...), Rel(label, ...)."""
        view = self._single(scene)
        with self._budget(None) as budget:
            return view.graph.run(text, {**(parameters or {}), **more}, timeout_s=budget.remaining)

    # -- writing ------------------------------------------------------------------------------------------------

    def add(self, scene: SceneGraph, *, on_existing: OnExisting = "error", message: str = "") -> int | None:
        """Write a scene as one revision, whole or not at all; its number, or None where nothing changed.

        on_existing, where the scene is there: "error"; "replace" it; "merge" objects and relations into it by id.
        """
        with self.write(
            scene.name,
            message=message,
            on_existing=on_existing,
            frame=scene.frame,
            up=scene.up,
            spaces=scene.spaces,
            provenance=scene.provenance,
        ) as writer:
            writer.places(scene.places)
            writer.objects(scene.objects)
            writer.relations(scene.relations)
        return writer.revision

    @contextmanager
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
        """A block that writes a scene in batches as one revision; nothing is kept if it is left by an exception."""
        with self._ledger.write(
            scene,
            kind=kind,
            message=message,
            on_existing=on_existing,
            frame=frame,
            up=up,
            spaces=spaces,
            provenance=provenance,
        ) as writer:
            yield writer
        self._forget_old()

    def remove(self, scene: str, *, message: str = "") -> int:
        """Remove a scene as a revision; AS OF an earlier one it can still be asked."""
        revision = self._ledger.remove_scene(scene, message=message)
        self._forget_old()
        return revision

    def prepare(self, scene: str | None = None) -> None:
        """Build the indexes that are not there yet; a query would build those that it needs."""
        for view in self._views_of(None if scene is None else [scene], None):
            view.prepare()

    def encode(self, scene: str | None = None) -> Iterator[tuple[int, int]]:
        """Give every text of the store its vector, in batches; yields (done, of all) after each.

        What is done is kept: stopped in between, the next call goes on. EncoderError or MissingExtraError where there
        is no encoder.
        """
        encoder = self._encoders.text()
        if isinstance(encoder, CgdbError):
            raise encoder
        if encoder is None:
            return
        missing = dict.fromkeys(self._kept.missing(encoder.name, background.texts()))
        for view in self._views_of(None if scene is None else [scene], None, empty=True):
            missing.update(dict.fromkeys(view.degrees.missing_texts(encoder)))
        # Of similar length together: a batch is padded to its longest text.
        texts = sorted(missing, key=len)
        for start in range(0, len(texts), ENCODE_BATCH):
            batch = texts[start : start + ENCODE_BATCH]
            self._kept.put(encoder.name, batch, encoder.texts(batch))
            yield min(start + ENCODE_BATCH, len(texts)), len(texts)
        for view in self._views.values():
            view.degrees.refresh()

    # -- out ----------------------------------------------------------------------------------------------------

    def to_networkx(self, scene: str, *, as_of: AsOf = None) -> networkx.MultiDiGraph[ObjectId]:
        """A scene as a graph of networkx: objects and places are nodes, relations edges, all fields attributes."""
        from cgdb.export import to_networkx

        return to_networkx(self.scene(scene, as_of=as_of, features=False, clouds=False))

    def export(
        self,
        scene: str,
        path: str | Path,
        format: str | None = None,
        *,
        as_of: AsOf = None,
        skip_damaged: bool = False,
        **options: Any,
    ) -> Exported:
        """Write a scene to a file, in one of the formats of ``cgdb.export``; by its ending when not said."""
        from cgdb.export import WITH_VIEWS, export, format_of

        chosen = format if format is not None else format_of(Path(path))
        whole = self.scene(scene, as_of=as_of, views=chosen in WITH_VIEWS, skip_damaged=skip_damaged)
        return export(whole, Path(path), chosen, **options)

    # -- care ---------------------------------------------------------------------------------------------------

    def check(self, *, repair: bool = False, full: bool = True) -> tuple[Problem, ...]:
        """Everything that is wrong with the store. repair builds damaged indexes anew; the ledger is only told of."""
        problems = [
            Problem(where=f"ledger{f', scene {d.scene!r}' if d.scene else ''}", message=f"{d.what}: {d.message}")
            for d in self._ledger.check(full=full)
        ]
        damaged = self._artefacts.check()
        if not repair:
            return (*problems, *(Problem(where="index", message=line) for line in damaged))
        self._artefacts.repair()
        for info in self._ledger.scenes() if not problems else ():
            self._views.pop((info.id, info.revision), None)
            self._view(info).prepare()
        return (*problems, *(Problem(where="index", message=line, repaired=not problems) for line in damaged))

    # -- views --------------------------------------------------------------------------------------------------

    @contextmanager
    def _budget(self, limits: Limits | None) -> Iterator[Budget]:
        budget = Budget(limits=limits or self._limits)
        self._running.add(budget)
        try:
            yield budget
        finally:
            self._running.discard(budget)

    def _views_of(self, names: Sequence[str] | None, as_of: AsOf, *, empty: bool = False) -> Sequence[SceneView]:
        infos = self._infos(names, as_of)
        if not infos and not empty:
            raise StoreError(
                f"{self.path} holds no scenes" + ("" if as_of is None else f" at revision {as_of}"),
                hint=f"`cgdb import MAP --into {self.path}` brings one",
            )
        return [self._view(info) for info in infos]

    def _infos(self, names: Sequence[str] | None, as_of: AsOf) -> Sequence[SceneInfo]:
        if as_of is None:
            now = self._scenes_now.now()
            if names is None:
                return now
            by_name = {info.name: info for info in now}
            return [by_name.get(name) or self._ledger.scene(name) for name in names]
        return self._ledger.scenes(as_of) if names is None else [self._ledger.scene(name, as_of) for name in names]

    def _view(self, info: SceneInfo) -> SceneView:
        with self._lock:
            key = (info.id, info.revision)
            if key not in self._views:
                self._views[key] = SceneView(info, self._ledger, self._artefacts, self.degrees_of)
            return self._views[key]

    def _single(self, scene: str | None) -> SceneView:
        if scene is not None:
            return self.view(scene)
        views = self._views_of(None, None)
        if len(views) > 1:
            raise BindError(
                f"the store holds {len(views)} scenes: say which",
                hint=f"scene={one_of((view.info.name for view in views), most=4)}",
            )
        return views[0]

    def _locate(self, object_id: ObjectId, scene: str | None, as_of: AsOf) -> tuple[SceneView, int]:
        wanted = canonical_id(object_id)
        views = self._views_of(None if scene is None else [scene], as_of)
        found = [(view, position) for view in views if (position := view.find(wanted)) is not None]
        if not found:
            where = one_of((view.info.name for view in views), most=4)
            raise BindError(f"there is no object or place #{wanted} in {where}")
        if len(found) > 1:
            names = one_of((view.info.name for view, _ in found), most=4)
            raise BindError(f"#{wanted} is in several scenes: {names}", hint="say which: scene=...")
        return found[0]

    def _any_info(self, name: str, revisions: Iterable[int]) -> SceneInfo:
        error: StoreError | None = None
        for revision in revisions:
            try:
                return self._ledger.scene(name, revision)
            except StoreError as missing:
                error = missing
        assert error is not None
        raise error

    def _forget_old(self) -> None:
        """Drop the views of revisions that are no longer the latest."""
        with self._lock:
            self._wrote = True
            current = {(info.id, info.revision) for info in self._ledger.scenes()}
            for key in [key for key in self._views if key not in current]:
                del self._views[key]

    def _sweep(self) -> None:
        """Remove index files of old revisions, but the newest of a scene whose latest has none yet: a start for it."""
        keep = set()
        for info in self._ledger.scenes():
            there = self._artefacts.revisions(info.id)
            keep.add((info.id, info.revision if info.revision in there else max(there, default=0)))
        self._artefacts.sweep(keep)


def _meaning(what: Any, space: str | None) -> Meaning:
    if isinstance(what, str):
        if not what.strip():
            raise BindError("a search needs a text that says something; this one is empty")
        return TextMeaning(text=what)
    if isinstance(what, LikeMeaning | TextMeaning | VectorMeaning):
        return what
    if not isinstance(what, Vector):
        values = np.asarray(what, np.float32)
        if values.ndim != 1 or not values.size:
            raise BindError(f"a vector to search for has one dimension, not the shape {values.shape}")
        what = Vector(values=values, space=space)
    if not np.isfinite(what.values).all():
        raise BindError("the vector to search for holds NaN or infinite values")
    return VectorMeaning(parameter="vector", vector=what)


def _fitting(view: SceneView, where: str, parameters: Mapping[str, Any], budget: Budget) -> Positions:
    from cgdb.query.conditions import fitting

    return fitting(view, where, parameters, budget)
