"""A store that is opened behind the prompt: first its names, then its indexes, then the text encoder."""

from __future__ import annotations

import threading
from collections.abc import Callable
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING

from cgdb.errors import StoreError
from cgdb.grammar.machine import machine

if TYPE_CHECKING:
    from cgdb.database import Database

LEDGER = "ledger.sqlite"
"""What makes a folder a store, as storage.ledger.FILE: that module is slow to load, and the prompt does not wait."""


class Opening:
    """``database`` waits for the store itself; what is still to be loaded then, a query would load as well."""

    def __init__(self, path: str | Path) -> None:
        self.path = Path(path)
        if self.path.exists() and not self.path.is_dir():
            hint = f"a store is a folder; `cgdb import {self.path} --into home.cgdb` makes one of a map"
            raise StoreError(f"{self.path} is a file, not a store", hint=hint)
        if not (self.path / LEDGER).exists():
            what = "is not a store: there is no ledger in it" if self.path.exists() else "does not exist"
            raise StoreError(f"{self.path} {what}", hint=f"`cgdb import MAP --into {self.path}` makes a store")
        self.stage = "opening"
        self.failed: Exception | None = None
        self._db: Database | None = None
        self._ready = threading.Event()
        self._thread: threading.Thread | None = None

    def start(
        self, opened: Callable[[Database], None], indexed: Callable[[], None], changed: Callable[[], None]
    ) -> None:
        """Begin. opened is called with the store, indexed when it can be asked, changed after each stage.

        All are called in the thread that loads.
        """
        work = (opened, indexed, changed)
        self._thread = threading.Thread(target=self._run, args=work, name="cgdb-opening", daemon=True)
        self._thread.start()

    @property
    def ready(self) -> bool:
        """Whether the store can be asked, or could not be opened."""
        return self._ready.is_set()

    def database(self) -> Database:
        """The open store; waits for it. Raises what opening it raised."""
        if self._thread is None and self._db is None:
            self._db = _open(self.path)
            self._ready.set()
        self._ready.wait()
        if self._db is None:
            assert self.failed is not None
            raise self.failed
        return self._db

    def close(self) -> None:
        """Give the files back, once what is being loaded is."""
        if self._thread is not None:
            self._thread.join(timeout=5)
            if self._thread.is_alive():
                # A daemon: it ends with the process, and the store is only read.
                return
        if self._db is not None:
            self._db.close()

    def _run(
        self, opened: Callable[[Database], None], indexed: Callable[[], None], changed: Callable[[], None]
    ) -> None:
        try:
            # The first letter that is typed needs the tables of the grammar, the first answer what draws it.
            machine()
            import_module("rich.console")
            db = _open(self.path)
            self._db = db
            self.stage = "indexes"
            opened(db)
            changed()
            if db.scenes():
                db.prepare()
                self.stage = "encoder"
                self._ready.set()
                changed()
                indexed()
                db.search("thing", k=1)
        except Exception as error:  # noqa: BLE001 -- raised again by whoever asks for the store
            # Of a damaged index or a missing encoder the next query tells in its own words.
            if self._db is None:
                self.failed = error
        finally:
            self.stage = ""
            self._ready.set()
            changed()


def _open(path: Path) -> Database:
    import cgdb

    return cgdb.open(path)
