"""The scenes of a store that are open: by name and revision, as queries see them, each opened when first asked for."""

from __future__ import annotations

import contextlib
import threading
from collections.abc import Callable, Sequence
from datetime import datetime
from typing import TypeAlias

from cgdb.errors import BindError, CgdbError, StoreError, one_of
from cgdb.index.artefacts import Artefacts
from cgdb.meaning.degrees import Degrees
from cgdb.scene import ObjectId, canonical_id
from cgdb.storage.freshness import Fresh
from cgdb.storage.ledger import FILE, Ledger, SceneInfo
from cgdb.view import SceneView

AsOf: TypeAlias = int | str | datetime | None
"""A revision, a time, or the latest."""


class Opened:
    """The open scenes of a ledger, with their index files. Threads may share it."""

    def __init__(self, ledger: Ledger, degrees_of: Callable[[SceneView], Degrees]) -> None:
        """degrees_of: what says how well things fit words, for each scene that is opened."""
        self._ledger, self._degrees_of = ledger, degrees_of
        self._now = Fresh(ledger.path / FILE, ledger.scenes, read_only=ledger.read_only)
        self._artefacts = Artefacts(ledger.path / "index", writable=not ledger.read_only)
        self._views: dict[tuple[int, int], SceneView] = {}
        self._wrote = False
        self._lock = threading.RLock()

    def all(self) -> list[SceneView]:
        """Those that are open now."""
        return list(self._views.values())

    def view(self, info: SceneInfo) -> SceneView:
        """A scene at a revision."""
        with self._lock:
            key = (info.id, info.revision)
            if key not in self._views:
                self._views[key] = SceneView(info, self._ledger, self._artefacts, self._degrees_of)
            return self._views[key]

    def views(self, names: Sequence[str] | None = None, as_of: AsOf = None) -> list[SceneView]:
        """Scenes by name, None for all. StoreError where one is not there, or where there is none at all."""
        infos = self._infos(names, as_of)
        if not infos:
            raise StoreError(
                f"{self._ledger.path} holds no scenes" + ("" if as_of is None else f" at revision {as_of}"),
                hint=f"`cgdb import MAP --into {self._ledger.path}` brings one",
            )
        return [self.view(info) for info in infos]

    def named(self, name: str, as_of: AsOf = None) -> SceneView:
        """One scene."""
        return self.view(self._ledger.scene(name, as_of))

    def only(self, name: str | None) -> SceneView:
        """One scene; the only one of the store where no name is given."""
        if name is not None:
            return self.named(name)
        views = self.views()
        if len(views) > 1:
            raise BindError(
                f"the store holds {len(views)} scenes: say which",
                hint=f"scene={one_of((view.info.name for view in views), most=4)}",
            )
        return views[0]

    def locate(self, object_id: ObjectId, scene: str | None, as_of: AsOf) -> tuple[SceneView, int]:
        """Where an object or place is: its scene, which may be left out where only one has the id, and position."""
        wanted = canonical_id(object_id)
        views = self.views(None if scene is None else [scene], as_of)
        found = [(view, position) for view in views if (position := view.find(wanted)) is not None]
        if not found:
            where = one_of((view.info.name for view in views), most=4)
            raise BindError(f"there is no object or place #{wanted} in {where}")
        if len(found) > 1:
            names = one_of((view.info.name for view, _ in found), most=4)
            raise BindError(f"#{wanted} is in several scenes: {names}", hint="say which: scene=...")
        return found[0]

    def forget_old(self) -> None:
        """After a write: drop the views of revisions that are no longer the latest."""
        with self._lock:
            self._wrote = True
            current = {(info.id, info.revision) for info in self._ledger.scenes()}
            for key in [key for key in self._views if key not in current]:
                del self._views[key]

    def check(self, *, remove: bool = False) -> list[str]:
        """What is wrong with the index files, one line each. remove: what is damaged goes, to be built again."""
        return self._artefacts.check(remove=remove)

    def prepare_anew(self) -> None:
        """Open every scene anew and build the indexes that are not there."""
        for info in self._ledger.scenes():
            self._views.pop((info.id, info.revision), None)
            self.view(info).prepare()

    def close(self) -> None:
        """Give all files back, and remove index files that nobody needs any more. Closing twice is allowed."""
        for view in self._views.values():
            view.close()
        self._views.clear()
        if self._wrote:
            self._wrote = False
            with contextlib.suppress(CgdbError):  # housekeeping: what is wrong is told by whoever needs it
                self._sweep()
        self._artefacts.close()
        self._now.close()

    def _infos(self, names: Sequence[str] | None, as_of: AsOf) -> Sequence[SceneInfo]:
        if as_of is None:
            now = self._now.now()
            if names is None:
                return now
            by_name = {info.name: info for info in now}
            return [by_name.get(name) or self._ledger.scene(name) for name in names]
        return self._ledger.scenes(as_of) if names is None else [self._ledger.scene(name, as_of) for name in names]

    def _sweep(self) -> None:
        """Remove index files of old revisions, but the newest of a scene whose latest has none yet: a start for it."""
        keep = set()
        for info in self._ledger.scenes():
            there = {made for made in self._artefacts.revisions(info.id) if self._ledger.is_kept(info.id, made)}
            keep.add((info.id, info.revision if info.revision in there else max(there, default=0)))
        self._artefacts.sweep(keep)
