"""Which nodes of which scene a result speaks of: what a plan highlights."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

from cgdb.errors import CgdbError
from cgdb.result import Path, StoredNode, StoredRelation

if TYPE_CHECKING:
    import cgdb
    from cgdb.result import Result

Marks = dict[str, dict[int, tuple[int, bool]]]
"""{scene: {position: (number of the first row that speaks of it, whether that row fits)}}"""

NEAREST = 3
"""Rows that are marked where nothing fits: all rows would mark the whole place."""


def marks_of(db: cgdb.Database, result: Result | None) -> Marks:
    """The nodes in the values of the rows that fit, else of the nearest, and those behind columns of ids."""
    found: Marks = {}
    if result is None:
        return found
    ids = [i for i, name in enumerate(result.columns) if name.endswith(".id") or name.startswith("id(")]
    scenes = [info.name for info in db.scenes()] if ids else []
    for number, row in enumerate(result.rows, start=1):
        if not row.fits and (not result.nothing_fits or number > NEAREST):
            continue
        pairs = [pair for value in row.values for pair in _nodes(value)]
        pairs += [(scene, row.values[i]) for i in ids for scene in scenes if isinstance(row.values[i], (int, str))]
        for scene, node_id in pairs:
            try:
                position = db.view(scene).find(node_id)
            except CgdbError:
                # The result is of an earlier revision, and the scene is gone since.
                continue
            if position is not None:
                found.setdefault(scene, {}).setdefault(position, (number, row.fits))
    return found


def _nodes(value: Any) -> Iterator[tuple[str, Any]]:
    if isinstance(value, StoredNode):
        yield value.scene, value.id
    elif isinstance(value, StoredRelation):
        yield value.scene, value.source
        yield value.scene, value.target
    elif isinstance(value, Path):
        for relation in value.relations:
            yield from _nodes(relation)
    elif isinstance(value, (list, tuple)):
        for item in value:
            yield from _nodes(item)
