"""What changed in a scene between two revisions."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, TypeAlias

from sqlalchemy import Connection, Table, or_, select

from cgdb.errors import CorruptionError
from cgdb.storage import history, migrate, rows, schema
from cgdb.storage.rows import MASK, RelationRow
from cgdb.storage.verify import COLUMNS, verified

_Name: TypeAlias = tuple[Any, ...]

_NAMES = {"nodes": ("key",), "features": ("space", "key"), "clouds": ("key",), "views": ("rank", "key")}
"""What names a row of each part that belongs to a node: its key last."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Changes:
    """Keys of the nodes, and the relations, by which a scene at b differs from the same scene at a.

    A node has changed when its row, one of its vectors or views, or its cloud has; a relation whose confidence or
    explanation has changed is removed and added.
    """

    added: tuple[int, ...]
    changed: tuple[int, ...]
    removed: tuple[int, ...]
    relations_added: tuple[RelationRow, ...]
    relations_removed: tuple[RelationRow, ...]


def changes_between(connection: Connection, scene_id: int, scene: str, a: int, b: int) -> Changes:
    """From revision a to revision b, in either direction of time."""
    ends = (a, b)
    spans: dict[str, tuple[dict[_Name, int], dict[_Name, int]]] = {}
    for part, names in _NAMES.items():
        table = schema.metadata.tables[part]
        old, new = (_contents(connection, table, names, scene_id, revision, ends) for revision in ends)
        spans[part] = (old, new)
    old_relations, new_relations = (_relations(connection, scene_id, scene, revision, ends) for revision in ends)

    before, after = spans["nodes"]
    changed: set[int] = set()
    for old, new in spans.values():
        changed |= {name[-1] for name in old.keys() | new.keys() if old.get(name) != new.get(name)}
    added = {name[-1] for name in after.keys() - before.keys()}
    removed = {name[-1] for name in before.keys() - after.keys()}
    found = {part: (list(old.values()), list(new.values())) for part, (old, new) in spans.items()}
    found["relations"] = (list(old_relations), list(new_relations))
    _prove(connection, scene_id, scene, ends, found)
    return Changes(
        added=tuple(sorted(added)),
        changed=tuple(sorted(changed - added - removed)),
        removed=tuple(sorted(removed)),
        relations_added=tuple(new_relations[d] for d in new_relations if d not in old_relations),
        relations_removed=tuple(old_relations[d] for d in old_relations if d not in new_relations),
    )


def _prove(
    connection: Connection,
    scene_id: int,
    scene: str,
    ends: tuple[int, int],
    found: Mapping[str, tuple[list[int], list[int]]],
) -> None:
    """CorruptionError unless the rows that differ make up the difference of the scene's totals."""
    headers = [history.read_header(connection, scene_id, scene, revision) for revision in ends]
    totals: list[dict[str, list[int]]] = []
    for header in headers:
        sums = {part: [0, 0] for part in found}
        for part, (count, digests) in ({} if header is None else header.totals).items():
            total = sums[part.partition(":")[0]]
            total[0] += count
            total[1] += digests
        totals.append(sums)
    for part, (old, new) in found.items():
        count = totals[1][part][0] - totals[0][part][0]
        digests = totals[1][part][1] - totals[0][part][1]
        if len(new) - len(old) != count or (sum(new) - sum(old) - digests) & MASK:
            raise CorruptionError(
                f"scene '{scene}': {part} that changed between revisions {ends[0]} and {ends[1]} are not complete",
                hint="`cgdb check` lists what is damaged; `cgdb export --skip-damaged` saves the rest",
            )


def _touched(table: Table, scene_id: int, revision: int, ends: tuple[int, int]) -> Any:
    """Rows live at a revision that were not live all the way between the two: the only ones that can differ."""
    low, high = min(ends), max(ends)
    columns = table.c
    return (
        (columns.scene_id == scene_id)
        & schema.live(table, revision)
        & or_(columns.rev_from > low, columns.rev_to <= high)
    )


def _contents(
    connection: Connection, table: Table, names: tuple[str, ...], scene_id: int, revision: int, ends: tuple[int, int]
) -> dict[_Name, int]:
    if not migrate.there(connection, table):
        return {}
    columns = [table.c[name] for name in (*names, "rev_from", "rev_to", "seal")]
    found = connection.execute(select(*columns).where(_touched(table, scene_id, revision, ends)))
    return {tuple(row[:-3]): rows.seal(row[-1], row[-3], row[-2]) for row in found.all()}


def _relations(
    connection: Connection, scene_id: int, scene: str, revision: int, ends: tuple[int, int]
) -> dict[int, RelationRow]:
    table = schema.relations.c
    found = connection.execute(
        select(*(table[name] for name in COLUMNS["relations"]))
        .where(_touched(schema.relations, scene_id, revision, ends))
        .order_by(table.source, table.target, table.label, table.origin)
    )
    return dict(verified("relations", scene_id, scene, row) for row in found.all())
