"""Vectors of texts, kept so that no text is encoded twice: a cache beside the ledger that may be deleted at any time.

A file of its own, so that encoding captions never waits for an import, and an import never for an encoder.
"""

from __future__ import annotations

import contextlib
import os
import threading
from collections.abc import Callable, Sequence
from hashlib import blake2b
from pathlib import Path
from typing import Self, TypeVar

import numpy as np
from numpy.typing import NDArray
from sqlalchemy import Column, Connection, Engine, LargeBinary, MetaData, Table, Text, insert, select

from cgdb.errors import CorruptionError
from cgdb.scene import Vector
from cgdb.storage import sqlite

_metadata = MetaData()
_vectors = Table(
    "text_vectors",
    _metadata,
    Column("encoder", Text, primary_key=True),
    Column("text", LargeBinary, primary_key=True, comment="BLAKE2b-128 of the text in UTF-8"),
    Column("digest", LargeBinary, nullable=False, comment="BLAKE2b-64 of encoder, text and vector"),
    Column("vector", LargeBinary, nullable=False, comment="float32, little-endian"),
)

_ASKED_AT_ONCE = 1000


_Result = TypeVar("_Result")


class TextVectors:
    """The kept vectors of a store. A damaged row counts as missing; a damaged file is set aside and begun anew.

    Where nothing can be written (a read-only store), ``put`` does nothing: the cache only ever saves time.
    """

    def __init__(self, path: Path, *, read_only: bool = False, patience: float = 10.0) -> None:
        """Use the cache in a file, which the first ``put`` makes."""
        self.path = Path(path)
        self.read_only = read_only or not os.access(self.path.parent, os.W_OK)
        self._patience = patience
        self._engine: Engine | None = None
        self._lock = threading.Lock()

    def get(self, encoder: str, texts: Sequence[str]) -> dict[str, Vector]:
        """The vectors (d,) float32 that are kept, by text."""
        wanted = {_name(text): text for text in texts}
        names = list(wanted)

        def read(connection: Connection) -> dict[str, Vector]:
            found: dict[str, Vector] = {}
            for start in range(0, len(names), _ASKED_AT_ONCE):
                some = names[start : start + _ASKED_AT_ONCE]
                statement = select(_vectors.c.text, _vectors.c.digest, _vectors.c.vector).where(
                    _vectors.c.encoder == encoder, _vectors.c.text.in_(some)
                )
                for name, digest, vector in connection.execute(statement).all():
                    if name in wanted and digest == _digest(encoder, name, vector) and len(vector) % 4 == 0:
                        found[wanted[name]] = np.frombuffer(vector, "<f4")
            return found

        return self._run(read, write=False) or {}

    def missing(self, encoder: str, texts: Sequence[str]) -> list[str]:
        """The texts without a vector, each once, in the order given."""
        known = self.get(encoder, texts)
        return [text for text in dict.fromkeys(texts) if text not in known]

    def put(self, encoder: str, texts: Sequence[str], vectors: NDArray[np.float32]) -> None:
        """Keep vectors (n, d) of n texts; what was kept for a text is replaced."""
        if len(texts) != len(vectors):
            raise ValueError(f"{len(texts)} texts but {len(vectors)} vectors")
        values = []
        for text, vector in zip(texts, np.asarray(vectors, "<f4"), strict=True):
            name, data = _name(text), vector.tobytes()
            values.append((encoder, name, _digest(encoder, name, data), data))
        if not values or self.read_only:
            return

        def write(connection: Connection) -> None:
            statement = insert(_vectors).prefix_with("OR REPLACE")
            connection.exec_driver_sql(str(statement.compile(dialect=connection.dialect)), values)
            connection.commit()
            if not all(self._reads_back(connection, value) for value in values):
                # A damaged index page: the row is there and cannot be found. It would be encoded again for ever.
                raise CorruptionError(f"{self.path}: the kept vectors are damaged")

        self._run(write, write=True)

    def _reads_back(self, connection: Connection, value: tuple[str, bytes, bytes, bytes]) -> bool:
        encoder, name, digest, _ = value
        statement = select(_vectors.c.digest).where(_vectors.c.encoder == encoder, _vectors.c.text == name)
        return connection.execute(statement).scalar() == digest

    def close(self) -> None:
        """Give the file back; a later call opens it again."""
        with self._lock:
            if self._engine is not None:
                self._engine.dispose()
                self._engine = None

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def _run(self, action: Callable[[Connection], _Result], *, write: bool) -> _Result | None:
        """Do something with the file; None where there is none to read. A damaged file makes way for a new one."""
        for last in (False, True):
            try:
                with sqlite.translated(self.path, "writing" if write else "reading"):
                    engine = self._open(write)
                    if engine is None:
                        return None
                    with sqlite.writing(engine) if write else engine.connect() as connection:
                        return action(connection)
            except CorruptionError:
                if self.read_only:
                    return None
                if last:
                    raise
                self._set_aside()
        return None

    def _open(self, write: bool) -> Engine | None:
        with self._lock:
            if self._engine is None:
                if not self.path.exists():
                    if not write:
                        return None
                    sqlite.create_file(self.path)
                with contextlib.ExitStack() as undo:
                    engine = sqlite.engine(self.path, read_only=self.read_only, patience=self._patience)
                    undo.callback(engine.dispose)
                    if self._prepared(engine):
                        undo.pop_all()
                        self._engine = engine
            return self._engine

    def _prepared(self, engine: Engine) -> bool:
        """Whether the table is there; made where it can be."""
        with engine.connect() as connection:
            if sqlite.has_table(connection, _vectors.name):
                return True
        if self.read_only:
            return False
        with sqlite.writing(engine) as connection:
            _metadata.create_all(connection)
            connection.commit()
        return True

    def _set_aside(self) -> None:
        """Keep the damaged file for whoever wants to look, out of the way. Its log would only damage the next one."""
        self.close()
        with contextlib.suppress(FileNotFoundError):
            self.path.replace(self.path.with_name(self.path.name + ".damaged"))
        for suffix in ("-wal", "-shm"):
            self.path.with_name(self.path.name + suffix).unlink(missing_ok=True)


def _name(text: str) -> bytes:
    # A map may hold half a surrogate pair; it must not stop the encoding of everything else.
    return blake2b(text.encode("utf-8", "surrogatepass"), digest_size=16).digest()


def _digest(encoder: str, name: bytes, vector: bytes) -> bytes:
    return blake2b(b"\0".join((encoder.encode(), name, vector)), digest_size=8).digest()
