"""Database: a store as programs use it. Each method is a few lines; what it does has a module of its own."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from types import TracebackType
from typing import TYPE_CHECKING, Any, Self

import numpy as np

from cgdb.errors import CgdbError
from cgdb.index.positions import Positions
from cgdb.meaning.degrees import Degrees
from cgdb.meaning.embed import TEXT_MODEL, Encoder
from cgdb.meaning.encoders import Encoders
from cgdb.meaning.encoding import encode
from cgdb.meaning.meanings import Vector
from cgdb.opened import AsOf, Opened
from cgdb.query.limits import Budget, Limits
from cgdb.query.run import run
from cgdb.query.search import Hits, check_k, meaning_of, search
from cgdb.result import Result, StoredNode, StoredRelation
from cgdb.scene import FeatureSpace, ObjectId, SceneGraph, View
from cgdb.storage.ledger import Changes, Horizon, Ledger, OnExisting, Pruned, Revision, SceneInfo, SceneWriter
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
        self.model: Model | None = None
        """The language model that is asked; the configured one where none is set."""
        self.reranker: Reranker | None = None
        """Who carries out RERANK BY; the language model where nobody is set."""
        self._limits = limits
        self._kept = TextVectors(ledger.path / "texts.sqlite", read_only=ledger.read_only)
        self._encoders = Encoders(self._kept, text=text_encoder, spaces=space_encoders)
        self.degrees_of: Callable[[SceneView], Degrees] = lambda view: Degrees(view, self._encoders)
        self._opened = Opened(ledger, lambda view: self.degrees_of(view))
        self._running: set[Budget] = set()

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
        self._opened.close()
        self._encoders.close()
        self._kept.close()
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

    def horizons(self) -> dict[str, Horizon]:
        """{scene: from where on its history is kept}, of the scenes whose older history was pruned."""
        return self._ledger.horizons()

    def diff(self, a: int, b: int, scene: str | None = None) -> dict[str, Changes]:
        """{scene: what turns it as of revision a into it as of revision b}, of the scenes that differ."""
        for revision in (a, b):
            if revision != 0:  # before the first revision there was nothing, which can be compared with
                self._ledger.resolve(revision)
        between = range(min(a, b) + 1, max(a, b) + 1)
        kept = {r.id: r.scene for r in self._ledger.revisions() if r.id in between}
        missing = [revision for revision in between if revision not in kept]
        # What may have changed in a revision that was pruned is asked for too, and says so.
        pruned = {name for name, one in self._ledger.horizons().items() if any(map(one.hides, missing))}
        names = set(kept.values()) | pruned
        found = {}
        for name in sorted(names if scene is None else names & {scene}):
            found[name] = self._ledger.changes(self._ledger.scene_id(name), a, b)
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
        view, position = self._opened.locate(object_id, scene, as_of)
        return view.stored(np.asarray([position], np.int64))[position]

    def relations(
        self, object_id: ObjectId, *, scene: str | None = None, as_of: AsOf = None
    ) -> tuple[StoredRelation, ...]:
        """All relations of an object or place, either way."""
        view, position = self._opened.locate(object_id, scene, as_of)
        return tuple(view.relations_of(np.asarray([position], np.int64)))

    def nodes_by_key(self, scene: str, keys: Iterable[int], *, as_of: AsOf = None) -> tuple[StoredNode, ...]:
        """The records behind the keys that `diff` speaks of, in their order."""
        view = self.view(scene, as_of)
        positions = view.columns.positions(np.asarray(list(keys), np.int64))
        records = view.stored(positions)
        return tuple(records[position] for position in positions.tolist())

    def points(self, object_id: ObjectId, *, scene: str | None = None, as_of: AsOf = None) -> Any:
        """(points (n, 3) float32 m, colors (n, 3) uint8 or None) of an object; None where the map has none."""
        view, position = self._opened.locate(object_id, scene, as_of)
        return self._ledger.cloud(view.info, int(view.columns.keys[position]))

    def clouds(self, scene: str, *, as_of: AsOf = None) -> Iterator[tuple[ObjectId, Any]]:
        """The id and (points, colors) of every object with a cloud, as from ``points``, a few in memory at a time."""
        view = self.view(scene, as_of)
        ids = dict(zip(view.columns.keys.tolist(), view.column("id").tolist(), strict=True))
        for key, cloud in self._ledger.clouds(view.info):
            yield ids[key], cloud

    def views(self, object_id: ObjectId, *, scene: str | None = None, as_of: AsOf = None) -> tuple[View, ...]:
        """Where an object was seen, best first: the frames, their poses, and the object cut out of them."""
        view, position = self._opened.locate(object_id, scene, as_of)
        return self._ledger.views(view.info, int(view.columns.keys[position]))

    def every_views(self, scene: str, *, as_of: AsOf = None) -> Iterator[tuple[ObjectId, tuple[View, ...]]]:
        """The id and views of every object that has some, as from ``views``, a few in memory at a time."""
        view = self.view(scene, as_of)
        ids = dict(zip(view.columns.keys.tolist(), view.column("id").tolist(), strict=True))
        for key, views in self._ledger.every_views(view.info):
            yield ids[key], views

    def view(self, name: str, as_of: AsOf = None) -> SceneView:
        """A scene as queries see it: its catalog, columns and indexes."""
        return self._opened.named(name, as_of)

    # -- asking -------------------------------------------------------------------------------------------------

    def query(
        self, text: str, parameters: Mapping[str, Any] | None = None, /, *, limits: Limits | None = None, **more: Any
    ) -> Result:
        """The answer to a CGQL statement; ``$name`` in it stands for a parameter, never pasted into the text."""
        with self._budget(limits) as budget:
            return run(text, {**(parameters or {}), **more}, self._opened.views, budget, self.reranker or self.model)

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
        for view in self._opened.all():
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
        views = self._opened.views(names)
        meaning = meaning_of(what, space)
        allowed: list[Positions | None] = [None] * len(views)
        if where is not None:
            from cgdb.query.conditions import fitting

            with self._budget(None) as budget:
                allowed = [fitting(view, where, parameters or {}, budget) for view in views]
        return search(views, meaning, space=space, k=check_k(k), allowed=allowed)

    def cypher(
        self, text: str, parameters: Mapping[str, Any] | None = None, /, *, scene: str | None = None, **more: Any
    ) -> Table:
        """The answer of a scene's graph index to read-only Cypher: Node(key, id, label, tag, ...), Rel(label, ...)."""
        view = self._opened.only(scene)
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
        self._opened.forget_old()

    def remove(self, scene: str, *, message: str = "") -> int:
        """Remove a scene as a revision; AS OF an earlier one it can still be asked."""
        revision = self._ledger.remove_scene(scene, message=message)
        self._opened.forget_old()
        return revision

    def prune(
        self, *, keep: int | None = None, before: AsOf = None, scenes: Sequence[str] = (), dry_run: bool = False
    ) -> Pruned:
        """Drop old history for good, all that is asked or nothing; the present and what is kept read as before.

        keep: all but the last so many revisions of each scene. before: what is older than the state of each scene at
        a revision or time. Both: what neither keeps. scenes: of these only. dry_run: only say what would go. Of a
        removed scene whose removal is the oldest that is kept, that one line stays. The file gets shorter where it can.
        """
        pruned = self._ledger.prune(keep=keep, before=before, scenes=scenes, dry_run=dry_run)
        if not dry_run:
            self._opened.forget_old()
        return pruned

    def prepare(self, scene: str | None = None) -> None:
        """Build the indexes that are not there yet; a query would build those that it needs."""
        for view in self._opened.views(None if scene is None else [scene]):
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
        infos = self._ledger.scenes() if scene is None else [self._ledger.scene(scene)]
        yield from encode(encoder, self._encoders, [self._opened.view(info).degrees for info in infos])
        for view in self._opened.all():
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
        damaged = self._opened.check(remove=repair)
        repaired = repair and not problems
        if repaired:
            self._opened.prepare_anew()
        return (*problems, *(Problem(where="index", message=line, repaired=repaired) for line in damaged))

    @contextmanager
    def _budget(self, limits: Limits | None) -> Iterator[Budget]:
        budget = Budget(limits=limits or self._limits)
        self._running.add(budget)
        try:
            yield budget
        finally:
            self._running.discard(budget)
