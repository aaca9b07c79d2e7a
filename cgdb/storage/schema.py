"""The tables of the ledger. All are keyed by scene, so that a distributed PostgreSQL could spread them.

Rows of nodes, relations, features, clouds and views are temporal: a row is live at revision r when
``rev_from <= r and (rev_to is null or rev_to > r)``. A change closes a row and inserts its successor.
``seal`` is the row's digest mixed with its two revisions, see ``cgdb.storage.rows``.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from sqlalchemy import BigInteger, Boolean, Column, Float, Index, Integer, LargeBinary, MetaData, Table, Text
from sqlalchemy.sql.elements import ColumnElement

FORMAT = 3
"""The version of these tables. A store with a larger one was written by a newer cgdb."""

metadata = MetaData()

# BigInteger alone would not become SQLite's rowid, which is what makes appending cheap.
_RowId = BigInteger().with_variant(Integer(), "sqlite")


def _number(name: str, comment: str | None = None) -> Column[Any]:
    """A number that is part of the primary key, and never given by the database."""
    return Column(name, BigInteger, primary_key=True, autoincrement=False, comment=comment)


meta = Table("meta", metadata, Column("name", Text, primary_key=True), Column("value", Text, nullable=False))

revisions = Table(
    "revisions",
    metadata,
    Column("id", _RowId, primary_key=True, autoincrement=False),
    Column("time", BigInteger, nullable=False, comment="microseconds since 1970, UTC, strictly growing"),
    Column("kind", Text, nullable=False),
    Column("scene_id", BigInteger, nullable=False),
    Column("scene", Text, nullable=False),
    Column("message", Text, nullable=False),
    Column("added", BigInteger, nullable=False),
    Column("changed", BigInteger, nullable=False),
    Column("removed", BigInteger, nullable=False),
    Column("relations_added", BigInteger, nullable=False),
    Column("relations_removed", BigInteger, nullable=False),
    Column("seal", BigInteger, nullable=False, comment="covers the row and the seal of the revision before"),
)
Index("revisions_time", revisions.c.time)
Index("revisions_scene", revisions.c.scene_id, revisions.c.id)

scenes = Table(
    "scenes",
    metadata,
    Column("id", _RowId, primary_key=True, autoincrement=False),
    Column("name", Text, nullable=False, unique=True),
    Column("seal", BigInteger, nullable=False),
)

scene_versions = Table(
    "scene_versions",
    metadata,
    _number("scene_id"),
    _number("revision"),
    Column("removed", Boolean, nullable=False),
    Column("n_objects", BigInteger, nullable=False),
    Column("n_places", BigInteger, nullable=False),
    Column("n_relations", BigInteger, nullable=False),
    Column("next_key", BigInteger, nullable=False),
    Column("frame", Text, nullable=False),
    Column("up", Text, nullable=False),
    Column("spaces", Text, nullable=False, comment="JSON: [[name, dimension, encoder], ...]"),
    Column("provenance", Text, nullable=False, comment="JSON object"),
    Column("totals", Text, nullable=False, comment="JSON: {part: [live rows, sum of their digests mod 2**63]}"),
    Column("seal", BigInteger, nullable=False),
)


def _temporal(name: str, identity: Sequence[Column[Any]], *own: Column[Any], **options: Any) -> Table:
    """A table of rows that are live for some revisions. identity: what names a live row of a scene."""
    return Table(
        name,
        metadata,
        _number("scene_id"),
        *identity,
        _number("rev_from"),
        Column("rev_to", BigInteger),
        Column("seal", BigInteger, nullable=False),
        *own,
        **options,
    )


nodes = _temporal(
    "nodes",
    [_number("key")],
    Column("id", Text, nullable=False),
    Column("label", Text, nullable=False),
    Column("tag", Text),
    Column("tags", Text, comment="JSON array, null when empty"),
    Column("caption", Text),
    Column("box", LargeBinary, comment="float64: center 3, extent 3, rotation 9; see cgdb.storage.rows"),
    Column("n_observations", BigInteger),
    Column("confidence", Float),
    Column("properties", Text, comment="JSON object, null when empty"),
    # Kept in the order of the key: one tree less to write, and reading a scene is one pass.
    sqlite_with_rowid=False,
)
Index("nodes_id", nodes.c.scene_id, nodes.c.id)

relations = _temporal(
    "relations",
    [
        _number("source"),
        _number("target"),
        Column("label", Text, primary_key=True),
        Column("origin", Text, primary_key=True),
    ],
    Column("confidence", Float, nullable=False),
    Column("explanation", Text),
    sqlite_with_rowid=False,
)
Index("relations_target", relations.c.scene_id, relations.c.target)

features = _temporal(
    "features",
    [Column("space", Text, primary_key=True), _number("key")],
    Column("vector", LargeBinary, nullable=False, comment="float32, little-endian"),
)

clouds = _temporal(
    "clouds",
    [_number("key")],
    Column("n_points", BigInteger, nullable=False),
    Column("colored", Boolean, nullable=False),
    Column("data", LargeBinary, nullable=False, comment="points float32 (n, 3), then colors uint8 (n, 3)"),
)

views = _temporal(
    "views",
    [_number("key"), _number("rank", "0 is the best")],
    Column("n_views", BigInteger, nullable=False, comment="of the object: a row that is missing is told by any other"),
    Column("frame", BigInteger, nullable=False),
    Column("points", BigInteger, nullable=False),
    Column("box", LargeBinary, nullable=False, comment="float64: left, top, right, bottom in pixels"),
    Column("pose", LargeBinary, comment="float64 (4, 4): T_world_camera"),
    Column("source", Text, comment="the file of the frame"),
    Column("image", LargeBinary, comment="the digest of an image"),
)

# Not temporal, and apart from the views: a view that only becomes the second best does not move its picture, and one
# that is looked at without it does not read it.
images = Table(
    "images",
    metadata,
    _number("scene_id"),
    Column("digest", LargeBinary, primary_key=True, comment="16 bytes of BLAKE2b over the data"),
    Column("data", LargeBinary, nullable=False, comment="JPEG, PNG or WebP"),
)

# What is left of history that was pruned. Apart from the scenes: of most there is nothing to say.
horizons = Table(
    "horizons",
    metadata,
    _number("scene_id"),
    Column("first", BigInteger, nullable=False, comment="the first revision that the scene ever had"),
    Column("first_time", BigInteger, nullable=False, comment="its time, as in revisions"),
    Column("kept_from", BigInteger, nullable=False, comment="the first revision of the scene that is kept"),
    Column("revisions", BigInteger, nullable=False, comment="how many of the scene were pruned, ever"),
    Column("seal", BigInteger, nullable=False),
)

TEMPORAL = {table.name: table for table in (nodes, relations, features, clouds, views)}

IDENTITY = {
    name: tuple(column.name for column in table.primary_key if column.name not in ("scene_id", "rev_from"))
    for name, table in TEMPORAL.items()
}
"""What names a live row of a scene, per temporal table."""

ADDED = {2: (views, images), 3: (horizons,)}
"""{format: the tables that came with it}. A store of an older format is without them until it is written to."""


def live(table: Table, revision: int) -> ColumnElement[bool]:
    """The condition under which a temporal row belongs to a revision."""
    return (table.c.rev_from <= revision) & (table.c.rev_to.is_(None) | (table.c.rev_to > revision))
