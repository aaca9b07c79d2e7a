"""The gate that every row passes on its way out: decoded, and compared with its seal."""

from __future__ import annotations

import struct
from collections.abc import Sequence
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from cgdb.errors import CorruptionError
from cgdb.storage import rows, schema

Cloud: TypeAlias = "tuple[NDArray[np.float32], NDArray[np.uint8] | None]"
"""points (n, 3) float32 m, colors (n, 3) uint8 RGB."""

COLUMNS = {
    name: tuple(column.name for column in table.columns if column.name not in ("scene_id", "space"))
    for name, table in schema.TEMPORAL.items()
}
"""What is read of each table, in the order that ``verified`` takes."""

_UNDECODABLE = (struct.error, ValueError, TypeError, AttributeError, OverflowError, KeyError, CorruptionError)
"""What decoding a damaged row may raise before its seal is compared."""


def verified(part: str, scene_id: int, scene: str, row: Sequence[Any]) -> tuple[int, Any]:
    """Digest and value of a row of a part ("nodes", "relations", "clouds", "views", "features:SPACE").

    The value is a NodeRow, a RelationRow, a Cloud, a View, or the bytes of a vector. The row of a view may end with the
    data of its image. CorruptionError names scene and object.
    """
    digest = None
    value: Any = None
    try:
        if part == "nodes":
            key, start, end, mark, *rest = row
            payload: Any = tuple(rest)
            digest = rows.node_digest(scene_id, key, payload)
            sound = rows.seal(mark, start, end) == digest
            value = rows.node_row(key, payload) if sound else None
        elif part == "relations":
            source, target, label, origin, start, end, mark, confidence, explanation = row
            relation = (source, target, label, origin, confidence, explanation)
            digest = rows.relation_digest(scene_id, relation)
            sound = rows.seal(mark, start, end) == digest
            value = rows.relation_row(relation) if sound else None
        elif part == "clouds":
            key, start, end, mark, n_points, colored, data = row
            digest = rows.cloud_digest(scene_id, key, n_points, colored, data)
            sound = rows.seal(mark, start, end) == digest
            value = rows.cloud_arrays(n_points, colored, data) if sound else None
        elif part == "views":
            key, rank, start, end, mark, *rest = row
            payload, image = tuple(rest[:7]), rest[7:]
            digest = rows.view_digest(scene_id, key, rank, payload)
            sound = rows.seal(mark, start, end) == digest
            if sound and image:
                sound = payload[6] == (None if image[0] is None else rows.image_digest(image[0]))
                value = rows.view_record(payload, image[0]) if sound else None
        else:
            key, start, end, mark, value = row
            digest = rows.feature_digest(scene_id, part.removeprefix("features:").encode(), key, value)
            sound = rows.seal(mark, start, end) == digest
    except _UNDECODABLE as error:
        raise _damaged(part, scene, row) from error
    if not sound:
        raise _damaged(part, scene, row)
    return digest, value


def _damaged(part: str, scene: str, row: Sequence[Any]) -> CorruptionError:
    if part == "nodes":
        what = f"object #{row[4]} (key {row[0]})"
    elif part == "relations":
        what = f"relation {row[2]!r} between keys {row[0]} and {row[1]}"
    elif part == "clouds":
        what = f"point cloud of the object with key {row[0]}"
    elif part == "views":
        what = f"view {row[1]} of the object with key {row[0]}"
    else:
        what = f"feature '{part.removeprefix('features:')}' of the object with key {row[0]}"
    return CorruptionError(
        f"scene '{scene}': {what} is damaged: its bytes are not those that were written",
        hint="the rest can still be read; import the scene again with replace, or restore the store from a copy",
    )
