"""SQLite as the engine of the ledger: opening, creating, transactions, and its errors in cgdb's words.

Everything that is SQLite's alone lives here; the tables and statements elsewhere are SQLAlchemy Core.
"""

from __future__ import annotations

import contextlib
import os
import sqlite3
from collections.abc import Iterator
from pathlib import Path

from sqlalchemy import Connection, Engine, Insert, create_engine, event
from sqlalchemy.exc import DBAPIError
from sqlalchemy.pool import QueuePool

from cgdb.errors import CgdbError, CorruptionError, SceneError, StoreBusyError, StoreError

APPLICATION_ID = 0x43474442
"""'CGDB' in the header of the file: `file` and SQLite's own tools tell what it is."""

_PAGE = 16384  # bytes: a 512-d vector wastes 11 % of a page here, 25 % at 8192, 49 % at 4096
_CACHE = 32768  # KiB: what a large import may hold before it spills into the log
_LOG_KEPT = 64 << 20  # bytes of write-ahead log left on disk after a large import


def create_file(path: Path) -> None:
    """Make an empty database with the page size, identity and journal mode of a ledger."""
    connection = sqlite3.connect(path, isolation_level=None)
    try:
        connection.execute(f"PRAGMA page_size={_PAGE}")
        # Free pages can be given back a few at a time, see ``cgdb.storage.shrink``.
        connection.execute("PRAGMA auto_vacuum=INCREMENTAL")
        connection.execute(f"PRAGMA application_id={APPLICATION_ID}")
        connection.execute("PRAGMA journal_mode=WAL")
    finally:
        connection.close()


def engine(path: Path, *, read_only: bool, patience: float) -> Engine:
    """An engine over an existing file. Transactions see one snapshot; those begun by ``writing`` exclude each other."""
    uri = path.resolve().as_uri() + ("?mode=ro" if read_only else "?mode=rw")
    if read_only and not _log_in_use(path) and not os.access(path.parent, os.W_OK):
        # A WAL database needs its -shm file even to be read; where none can be made and nobody writes, say so.
        uri += "&immutable=1"

    def connect() -> sqlite3.Connection:
        connection = sqlite3.connect(uri, uri=True, timeout=patience, isolation_level=None, check_same_thread=False)
        try:
            connection.execute(f"PRAGMA cache_size=-{_CACHE}")
            if not read_only:
                connection.execute("PRAGMA synchronous=FULL")
                # Some builds overwrite what is deleted: pruning would write as much into the log as it removes.
                connection.execute("PRAGMA secure_delete=OFF")
                connection.execute(f"PRAGMA journal_size_limit={_LOG_KEPT}")
        except BaseException:
            connection.close()
            raise
        return connection

    built = create_engine("sqlite://", creator=connect, poolclass=QueuePool, pool_size=4, max_overflow=-1)
    event.listen(built, "begin", _begin)
    event.listen(built, "invalidate", _roll_back)
    return built


def _roll_back(connection: sqlite3.Connection, *_: object) -> None:
    # Closing alone does not free the write lock: the traceback of an interrupt keeps the cursor, the cursor its
    # statement, and SQLite the transaction for as long as that statement lives.
    with contextlib.suppress(sqlite3.Error):
        connection.rollback()


def _begin(connection: Connection) -> None:
    # pysqlite's own BEGIN comes late and never IMMEDIATE; with isolation_level=None it is ours to say.
    immediate = connection.get_execution_options().get("cgdb_write", False)
    connection.exec_driver_sql("BEGIN IMMEDIATE" if immediate else "BEGIN")


def writing(database: Engine) -> Connection:
    """A connection whose transactions hold the write lock from their beginning."""
    return database.connect().execution_options(cgdb_write=True)


def set_user_version(connection: Connection, version: int) -> None:
    """Note the format in the header of the file too, where tools that know no table of ours look."""
    connection.exec_driver_sql(f"PRAGMA user_version={int(version)}")


def user_version(connection: Connection) -> int:
    """The format noted in the header of the file."""
    return int(connection.exec_driver_sql("PRAGMA user_version").scalar_one())


def has_table(connection: Connection, name: str) -> bool:
    """Whether a table exists."""
    return connection.exec_driver_sql("SELECT 1 FROM sqlite_master WHERE name = ?", (name,)).first() is not None


def positional(statement: Insert, database: Engine) -> str:
    """An INSERT as text for ``exec_driver_sql`` with tuples: a third faster for many rows than dicts of parameters."""
    return str(statement.compile(dialect=database.dialect))


def integrity(connection: Connection, *, full: bool) -> list[str]:
    """What SQLite itself finds wrong with the file."""
    rows = connection.exec_driver_sql("PRAGMA integrity_check" if full else "PRAGMA quick_check").scalars().all()
    return [str(row) for row in rows if row != "ok"]


@contextlib.contextmanager
def translated(path: Path, doing: str) -> Iterator[None]:
    """Turn the engine's errors into cgdb's. doing: "reading" or "writing", for the message."""
    try:
        yield
    except CgdbError:
        raise
    except DBAPIError as error:
        cause = error.orig
        if isinstance(cause, Exception):
            raise translate(cause, path, doing) from error
        raise
    except sqlite3.Error as error:
        raise translate(error, path, doing) from error
    except UnicodeDecodeError as error:
        # sqlite3 stumbles over its own message where that quotes a damaged schema. A block that writes runs code of
        # the caller, whose error this may be.
        if doing != "reading":
            raise
        raise translate(sqlite3.DatabaseError("malformed database schema"), path, doing) from error


def translate(error: BaseException, path: Path, doing: str) -> CgdbError:
    """The error of cgdb that an error of sqlite3 stands for."""
    store = path.parent
    if isinstance(error, sqlite3.DataError):
        return SceneError(f"a value is too large to be stored: {error}")
    name = str(getattr(error, "sqlite_errorname", "") or "")
    text = str(error)
    # "no such": the statements are ours, so it is the stored schema that is wrong.
    signs = ("malformed", "Could not decode", "no such table", "no such column")
    if name.startswith(("SQLITE_CORRUPT", "SQLITE_NOTADB")) or any(sign in text for sign in signs):
        return CorruptionError(
            f"{path}: the ledger is damaged ({text})",
            hint=f"`cgdb check {store}` tells what can still be read; restore the rest from a copy",
        )
    if name.startswith(("SQLITE_BUSY", "SQLITE_LOCKED")):
        return StoreBusyError(f"{store}: another process is writing", hint="try again, or wait longer (patience)")
    if name == "SQLITE_FULL" or (name.startswith("SQLITE_IOERR") and doing == "writing"):
        what = "the disk is full" if name == "SQLITE_FULL" else f"the disk is full or failing ({text})"
        return StoreError(f"{what}: {store} could not be written, the store is as before", hint="make room, try again")
    if name.startswith("SQLITE_READONLY"):
        return StoreError(f"{store}: the store cannot be written ({text})", hint="it was opened for reading only")
    if name.startswith(("SQLITE_CANTOPEN", "SQLITE_PERM", "SQLITE_AUTH", "SQLITE_IOERR")):
        return StoreError(f"{store}: the ledger cannot be opened or read ({text})", hint="check its permissions")
    return StoreError(f"{store}: {doing} the ledger failed ({text})")


def _log_in_use(path: Path) -> bool:
    log = path.with_name(path.name + "-wal")
    try:
        return log.stat().st_size > 0
    except OSError:
        return False
