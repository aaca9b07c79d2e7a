"""Giving pages that hold nothing any more back to the disk: SQLite's alone, and never needed for what can be read.

A file that was made to be shortened gives them back in small steps, between which others write. An older one must be
written anew as a whole first, for which there must be room.
"""

from __future__ import annotations

import contextlib
import shutil
import sqlite3
from pathlib import Path

from sqlalchemy.engine.interfaces import DBAPICursor

from cgdb.storage import sqlite

_STEP = 1024  # pages: 16 MiB at a time, some tens of milliseconds
_WORTH = 10  # an older file is written anew where at least one page in so many is free
_INCREMENTAL = 2  # what `PRAGMA auto_vacuum` says of a file that can be shortened in steps


def size(path: Path) -> int:
    """Bytes of a ledger on disk, with its log."""
    files = (path, path.with_name(path.name + "-wal"))
    return sum(file.stat().st_size for file in files if file.exists())


def shrink(path: Path, *, patience: float = 2.0) -> list[str]:
    """Shorten the file of a ledger by its free pages; one line for each thing that stood in the way.

    patience: seconds to wait for others, who wait for this one as long.
    """
    database = sqlite.engine(path, read_only=False, patience=patience)
    try:
        with contextlib.closing(database.raw_connection()) as connection:
            cursor = connection.cursor()
            return _give_back(cursor, path) + _write_back(cursor)
    except sqlite3.Error as error:
        return [f"the file could not be made shorter now ({error}); its free pages are used first, or prune again"]
    finally:
        database.dispose()


def empty_log(path: Path) -> None:
    """Have the log take no room, where nobody else needs it: what did not fit on the disk is still in it."""
    database = sqlite.engine(path, read_only=False, patience=0.0)
    with contextlib.suppress(sqlite3.Error), contextlib.closing(database.raw_connection()) as connection:
        _write_back(connection.cursor())
    database.dispose()


def _give_back(cursor: DBAPICursor, path: Path) -> list[str]:
    free, pages, page = (_pragma(cursor, name) for name in ("freelist_count", "page_count", "page_size"))
    if free == 0:
        return []
    if _pragma(cursor, "auto_vacuum") == _INCREMENTAL:
        while free > 0:
            cursor.execute(f"PRAGMA incremental_vacuum({_STEP})")
            cursor.fetchall()  # it works while its rows are fetched
            before, free = free, _pragma(cursor, "freelist_count")
            if free >= before:
                break
        return []
    if free * _WORTH < pages:
        return []
    # Once as a temporary file and once in the log, until that is written back.
    need = 2 * (pages - free) * page
    room = shutil.disk_usage(path.parent).free
    if need > room:
        what = f"it needs {need / 1e6:,.0f} MB of free disk, and there are {room / 1e6:,.0f}"
        return [f"the file keeps its size: written anew, {what}; its free pages are used first"]
    cursor.execute(f"PRAGMA auto_vacuum={_INCREMENTAL}")
    cursor.execute("VACUUM")
    return []


def _write_back(cursor: DBAPICursor) -> list[str]:
    """Have the log in the file, which only then ends earlier."""
    if _pragma(cursor, "wal_checkpoint(TRUNCATE)") == 0:
        return []
    return ["others are reading or writing: the file gets shorter when they are done"]


def _pragma(cursor: DBAPICursor, name: str) -> int:
    cursor.execute(f"PRAGMA {name}")
    return int(cursor.fetchall()[0][0])
