"""For tests, ours and those of programs that use cgdb: stores in a temporary folder, and degrees that are given.

What ``~`` is worth depends on encoders and on calibration; a test of the language gives the degrees itself.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np
from numpy.typing import NDArray

import cgdb
from cgdb.database import Database
from cgdb.index.positions import EdgeColumn, Positions
from cgdb.meaning.degrees import Degrees
from cgdb.meaning.meanings import LikeMeaning, Meaning, TextMeaning
from cgdb.scene import ObjectId, SceneGraph
from cgdb.view import SceneView

Given = Mapping[str, Mapping[ObjectId, float]]
"""{what is asked: {id: degree}}; an id that is not named has degree 0. ``~ #3`` is asked as "#3", ``~ $p`` as "$p"."""


@contextmanager
def store(*scenes: SceneGraph, degrees: Given | None = None) -> Iterator[Database]:
    """An open store in a temporary folder that holds these scenes; without an encoder, with degrees as given."""
    with (
        TemporaryDirectory(prefix="cgdb-test-") as folder,
        cgdb.open(Path(folder) / "test.cgdb", create=True, text_encoder=None) as db,
    ):
        if degrees is not None:
            give_degrees(db, degrees)
        for scene in scenes:
            db.add(scene)
        yield db


def give_degrees(db: Database, degrees: Given) -> None:
    """From now on every ``~`` in this database is worth what is given."""
    db.degrees_of = lambda view: GivenDegrees(view, degrees)


class GivenDegrees(Degrees):
    """Degrees read from a table. For relations, the ids of the table are the labels of the relations."""

    def __init__(self, view: SceneView, degrees: Given) -> None:
        self.warnings = {}
        self._view = view
        self._given = degrees

    def of(self, meaning: Meaning, positions: Positions) -> NDArray[np.float32]:
        """(n,) float32 the given degrees."""
        table = self._table(meaning)
        ids = self._view.column("id")
        return np.asarray([table.get(ids[position], 0.0) for position in positions.tolist()], np.float32)

    def expect(self, meanings: Iterable[Meaning]) -> None:
        """Nothing needs to be encoded."""

    def explain(self, meaning: Meaning, position: int) -> Mapping[str, Any]:
        """The given degree as the only evidence."""
        degree = float(self.of(meaning, np.asarray([position]))[0])
        return {"degree": degree, "evidence": {"given": degree}}

    def relation_degrees(self, meaning: Meaning, column: EdgeColumn) -> NDArray[np.float32]:
        """(n,) float32 the given degrees of the relations' labels."""
        table = self._table(meaning)
        return np.asarray([table.get(label, 0.0) for label in column.label], np.float32)

    def _table(self, meaning: Meaning) -> Mapping[ObjectId, float]:
        if isinstance(meaning, TextMeaning):
            return self._given.get(meaning.text, {})
        return self._given.get(f"#{meaning.id}" if isinstance(meaning, LikeMeaning) else f"${meaning.parameter}", {})
