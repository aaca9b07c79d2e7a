"""What changed in a scene between two revisions."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from sqlalchemy import Connection, Table, or_, select

from cgdb import rows, schema
from cgdb.errors import CorruptionError
from cgdb.rows import RelationRow


@dataclass(frozen=True, slots=True, kw_only=True)
class Changes:
    """Keys of the nodes, and the relations, by which a scene at b differs from the same scene at a.

    A node has changed when its row, one of its vectors or its cloud has; a relation whose confidence or explanation
    has changed is removed and added.
    """

    added: tuple[int, ...]
    changed: tuple[int, ...]
    removed: tuple[int, ...]
    relations_added: tuple[RelationRow, ...]
    relations_removed: tuple[RelationRow, ...]


def changes_between(connection: Connection, scene_id: int, scene: str, a: int, b: int) -> Changes:
    """From revision a to revision b, in either direction of time."""
    before, after = (_contents(connection, schema.nodes, ("key",), scene_id, r, (a, b)) for r in (a, b))
    changed = {name[0] for name in before.keys() & after.keys() if before[name] != after[name]}
    for table, names in ((schema.features, ("space", "key")), (schema.clouds, ("key",))):
        old, new = (_contents(connection, table, names, scene_id, r, (a, b)) for r in (a, b))
        changed |= {name[-1] for name in old.keys() | new.keys() if old.get(name) != new.get(name)}
    added = {name[0] for name in after.keys() - before.keys()}
    removed = {name[0] for name in before.keys() - after.keys()}
    old_relations = _relations(connection, scene_id, scene, a, (a, b))
    new_relations = _relations(connection, scene_id, scene, b, (a, b))
    return Changes(
        added=tuple(sorted(added)),
        changed=tuple(sorted(changed - added - removed)),
        removed=tuple(sorted(removed)),
        relations_added=tuple(new_relations[d] for d in new_relations if d not in old_relations),
        relations_removed=tuple(old_relations[d] for d in old_relations if d not in new_relations),
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
) -> dict[tuple[Any, ...], int]:
    columns = [table.c[name] for name in (*names, "rev_from", "rev_to", "seal")]
    found = connection.execute(select(*columns).where(_touched(table, scene_id, revision, ends)))
    return {tuple(row[:-3]): rows.seal(row[-1], row[-3], row[-2]) for row in found}


def _relations(
    connection: Connection, scene_id: int, scene: str, revision: int, ends: tuple[int, int]
) -> dict[int, RelationRow]:
    table = schema.relations.c
    found = connection.execute(
        select(
            table.source,
            table.target,
            table.label,
            table.origin,
            table.confidence,
            table.explanation,
            table.rev_from,
            table.rev_to,
            table.seal,
        )
        .where(_touched(schema.relations, scene_id, revision, ends))
        .order_by(table.source, table.target, table.label, table.origin)
    )
    relations: dict[int, RelationRow] = {}
    for row in found:
        payload = tuple(row[:6])
        digest = rows.seal(row[8], row[6], row[7])
        if digest != rows.relation_digest(scene_id, payload):
            raise CorruptionError(f"scene '{scene}': a relation {row[2]!r} of revision {revision} is damaged")
        relations[digest] = rows.relation_row(payload)
    return relations
