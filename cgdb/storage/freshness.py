"""Whether the ledger has changed since it was last read: told in microseconds, so that every query may ask."""

from __future__ import annotations

import sqlite3
import threading
from collections.abc import Callable
from pathlib import Path
from typing import Generic, TypeVar

from sqlalchemy import PoolProxiedConnection
from sqlalchemy.engine.interfaces import DBAPICursor

from cgdb.storage import sqlite

Kept = TypeVar("Kept")


class Fresh(Generic[Kept]):
    """What was read from a SQLite file, for as long as nobody, in whatever process, commits to that file.

    It has a connection of its own that never writes: to it, SQLite's data_version changes with every commit there is.
    """

    def __init__(self, path: Path, read: Callable[[], Kept], *, read_only: bool) -> None:
        """read: how to read it anew."""
        self._read = read
        self._database = sqlite.engine(path, read_only=read_only, patience=0.0)
        self._connection: PoolProxiedConnection | None = None
        self._cursor: DBAPICursor | None = None
        self._closed = False
        self._kept: tuple[int, Kept] | None = None
        self._lock = threading.Lock()

    def now(self) -> Kept:
        """What a read would give now."""
        # The version first: what is committed between the two is kept under the older version, and so read again.
        version, kept = self._version(), self._kept
        if kept is not None and kept[0] == version:
            return kept[1]
        value = self._read()
        self._kept = None if version is None else (version, value)
        return value

    def close(self) -> None:
        """Give the connection back; from now on everything is read anew. Closing twice is allowed."""
        with self._lock:
            self._closed = True
            self._cursor = self._kept = None
            if self._connection is not None:
                self._connection.close()
            self._database.dispose()

    def _version(self) -> int | None:
        """None where it cannot be told: then the read itself says what is wrong, if anything is."""
        with self._lock:
            if self._closed:
                return None
            try:
                if self._cursor is None:
                    self._connection = self._database.raw_connection()
                    self._cursor = self._connection.cursor()
                self._cursor.execute("PRAGMA data_version")
                return int(self._cursor.fetchall()[0][0])
            except sqlite3.Error:
                return None
