"""The graph engine: the one module that knows Kuzu from Ladybug, its maintained fork with the same API.

Everything above it sees an :class:`Engine` that opens files, runs statements and raises this project's errors.
"""

from __future__ import annotations

import contextlib
import importlib
import os
import re
import sys
import threading
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from cgdb.errors import ExecuteError, LimitError, MissingExtraError, QueryCancelled, UsageError, one_of

ENGINES = ("kuzu", "ladybug")
CHOICE = "CGDB_GRAPH_ENGINE"
BUFFER_POOL = 128 << 20
"""Bytes of page cache for one open index. 64 MiB load 100,000 objects too; a wide sort or aggregate wants the rest."""
THREADS = 2
LARGEST_INDEX = 1 << 36
"""Address space that is reserved for one file. The default, 8 TiB, fails where address space is limited."""


@dataclass(frozen=True, slots=True)
class Engine:
    """One graph engine. ``storage`` is the version of its file format: files of another version are not opened."""

    name: str
    storage: int
    module: Any

    def open(self, path: Path, *, read_only: bool, buffer_pool: int = BUFFER_POOL) -> Store:
        """Open the database file at ``path``; one that is to be written is created."""
        with reported(self.name):
            # Values must not be shared between the engines' Database signatures by place: both take these by name.
            database = self.module.Database(
                str(path),
                buffer_pool_size=buffer_pool,
                max_num_threads=THREADS,
                read_only=read_only,
                max_db_size=LARGEST_INDEX,
            )
        return Store(self, database)


class Store:
    """An open database file: lends one connection to each statement that runs, so that threads can share it."""

    def __init__(self, engine: Engine, database: Any) -> None:
        self.engine = engine
        self._database = database
        self._lock = threading.Lock()
        self._idle: list[Any] = []
        self._active: list[Any] = []
        self._stopped: set[int] = set()
        self._closing = False

    @contextlib.contextmanager
    def connection(self) -> Iterator[Any]:
        """A connection of the caller's own; :meth:`interrupt` reaches it while it is lent."""
        connection = self._lend()
        try:
            yield connection
        finally:
            with self._lock:
                self._active.remove(connection)
                self._stopped.discard(id(connection))
                self._idle.append(connection)
                if self._closing:
                    self._close_now()

    def _lend(self) -> Any:
        with self._lock:
            if self._closing:
                raise ExecuteError("the graph index is closed")
            if self._idle:
                connection = self._idle.pop()
            else:
                with reported(self.engine.name):
                    connection = self.engine.module.Connection(self._database, num_threads=THREADS)
                    if self.engine.name == "ladybug":
                        # It keeps every statement that it has ever planned, until its memory is full.
                        connection.execute("CALL enable_cached_prepared_statement='NONE'")
            self._active.append(connection)
            return connection

    def execute(
        self, statement: str, parameters: Mapping[str, Any] | None = None, *, timeout_s: float | None = None
    ) -> tuple[list[str], list[str], list[list[Any]]]:
        """Run one statement: the names of its columns, their types in the engine's words, and its rows."""
        with self.connection() as connection, reported(self.engine.name):
            connection.set_query_timeout(0 if timeout_s is None else max(1, int(timeout_s * 1000)))
            try:
                answer = connection.execute(statement, dict(parameters or {}))
            except RuntimeError as error:
                # The engine has one word for both ends of a statement, and we know who asked for which.
                if "Interrupted" in str(error) and timeout_s is not None and id(connection) not in self._stopped:
                    raise LimitError(
                        f"the query took longer than its {timeout_s:g} s", hint="narrow the pattern, or allow more time"
                    ) from error
                raise
            if isinstance(answer, list):
                for one in answer:
                    one.close()
                raise ExecuteError("one statement at a time: the text holds several")
            try:
                names, types = list(answer.get_column_names()), list(answer.get_column_data_types())
                # The raw iterator does without two Python calls for each row: 65 instead of 110 ms per 100,000 rows.
                raw = answer._query_result
                take = raw.getNext
                return names, types, [take() for _ in range(raw.getNumTuples())]
            finally:
                answer.close()

    def interrupt(self) -> None:
        """Stop every statement that runs now; each of them raises QueryCancelled. Safe from any thread."""
        with self._lock:
            for connection in self._active:
                self._stopped.add(id(connection))
                connection.interrupt()

    def close(self) -> None:
        """Close the file, once what runs has ended; a second call does nothing. What was written is folded into it."""
        with self._lock:
            if not self._closing:
                self._closing = True
                self._close_now()

    def _close_now(self) -> None:
        """Close everything unless a statement still runs: freeing what it reads would end the process."""
        if self._active:
            return
        for connection in self._idle:
            connection.close()
        self._idle.clear()
        with reported(self.engine.name):
            self._database.close()


def engine(name: str | None = None) -> Engine:
    """The engine that ``name`` or the environment variable CGDB_GRAPH_ENGINE asks for; else the first installed.

    A process has one engine: the two cannot be loaded together.
    """
    asked = name or os.environ.get(CHOICE) or ""
    if asked and asked not in ENGINES:
        raise UsageError(f"there is no graph engine '{asked}'", hint=f"{CHOICE} is one of {one_of(ENGINES)}")
    loaded = next((e for e in ENGINES if e in sys.modules), None)
    if asked and loaded and asked != loaded:
        # Both register native types of the same names: the second import fails or ends the process.
        raise UsageError(f"this process has loaded the graph engine '{loaded}' and cannot load '{asked}' too")
    only = asked or loaded
    for candidate in (only,) if only else ENGINES:
        try:
            module = importlib.import_module(candidate)
        except ImportError:
            continue
        _check_version(candidate, str(module.__version__))
        return Engine(candidate, int(module.Database.get_storage_version()), module)
    wanted = asked or "kuzu"
    raise MissingExtraError(f"the graph engine '{wanted}' is not installed", hint=f"pip install {wanted}")


def _check_version(name: str, version: str) -> None:
    """Ladybug 0.21 and 0.22 drop rows of a join whose nodes are filtered: no answer is better than a wrong one."""
    numbers = tuple(int(part) for part in re.findall(r"\d+", version)[:2])
    if name == "ladybug" and (0, 21) <= numbers <= (0, 22):
        raise MissingExtraError(
            f"the graph engine ladybug {version} leaves out rows that it should find",
            hint="pip install 'ladybug<0.21'",
        )


@contextlib.contextmanager
def reported(name: str) -> Iterator[None]:
    """Turn what the engine raises (RuntimeError for nearly everything) into one clear line of this project's."""
    try:
        yield
    except (RuntimeError, ValueError, TypeError, IndexError, MemoryError, UnicodeError) as error:
        raise _translated(name, error) from error


def _translated(name: str, error: Exception) -> ExecuteError:
    text = str(error) or type(error).__name__
    if "Interrupted" in text:
        return QueryCancelled("the query was stopped")
    if "Buffer manager" in text or isinstance(error, MemoryError):
        return LimitError(
            f"the query needs more than the {BUFFER_POOL >> 20} MiB of memory that the graph index may use",
            hint="narrow the pattern, or LIMIT earlier",
        )
    line = " ".join(text.split())
    line = re.sub(r"^(?:[A-Z]\w+ exception: )+", "", line)
    return ExecuteError(f"{name}: {line[:300]}{'...' if len(line) > 300 else ''}")
