"""Candidates: the rows that a re-ranker reads, as JSON for a language model and as a line for a cross-encoder."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from cgdb.model.prompts import clean
from cgdb.result import Path, Row, StoredNode, StoredRelation

CAPTION = 200
"""Characters of a caption that are shown."""
MOST_PROPERTIES = 8


def keys_of(rows: Sequence[Row]) -> list[str]:
    """A name for each row: the id of its first object, with its scene or number where that is not enough."""
    nodes = [next((value for value in row if isinstance(value, StoredNode)), None) for row in rows]
    scenes = {node.scene for node in nodes if node is not None}
    keys: list[str] = []
    for number, node in enumerate(nodes, start=1):
        key = f"row {number}" if node is None else str(node.id) if len(scenes) < 2 else f"{node.scene}:{node.id}"
        keys.append(key if key not in keys else f"{key} (row {number})")
    return keys


def candidate(key: str, columns: Sequence[str], row: Row) -> dict[str, Any]:
    """A row as the model sees it: its first object's record, what else is in the row, and the relations that held."""
    main = next((value for value in row if isinstance(value, StoredNode)), None)
    shown: dict[str, Any] = {"id": key}
    if main is not None:
        shown.update(_record(main))
    said = () if main is None else (main.tag, main.caption)
    others = {
        clean(name, 40): _brief(value)
        for name, value in zip(columns, row.values, strict=True)
        if value is not main and value is not None and value not in said
    }
    if others:
        shown["with"] = others
    # What ~ found is in the record; edges and distances are not.
    held = [clean(str(reason), 120) for reason in row.why if "~" not in reason.asked and reason.degree > 0]
    if held:
        shown["because"] = held[:3]
    return shown


def _record(node: StoredNode) -> dict[str, Any]:
    record: dict[str, Any] = {}
    if node.label != "Object":
        record["label"] = clean(node.label, 40)
    if node.tag:
        record["tag"] = clean(node.tag, 60)
    others = [clean(tag, 40) for tag in node.tags if tag != node.tag][:4]
    if others:
        record["also"] = others
    if node.caption:
        record["caption"] = clean(node.caption, CAPTION)
    if node.center is not None:
        record["center"] = [round(x, 1) for x in node.center.tolist()]
    if node.extent is not None:
        rotation = node.rotation
        upright = node.extent if rotation is None else np.abs(rotation) @ node.extent
        record["extent"] = [round(x, 1) for x in upright.tolist()]
    if node.properties:
        some = list(node.properties.items())[:MOST_PROPERTIES]
        record["properties"] = {clean(name, 40): _brief(value) for name, value in some}
    return record


def _brief(value: Any) -> Any:
    if isinstance(value, (StoredNode, StoredRelation, Path)):
        return clean(str(value), 80)
    if isinstance(value, float):
        return round(value, 2)
    if isinstance(value, (list, tuple)):
        return [_brief(item) for item in value[:8]]
    return clean(value, 80) if isinstance(value, str) else value


def line(columns: Sequence[str], row: Row) -> str:
    """A row as one line: what its object is called and said to be, what else is in it, and the relations that held."""
    main = next((value for value in row if isinstance(value, StoredNode)), None)
    parts = []
    if main is not None:
        parts = [": ".join(dict.fromkeys(text for text in (main.tag, main.caption) if text)), *main.tags[:4]]
    parts += [str(_brief(value)) for value in row.values if value is not main and value is not None]
    parts += [str(reason.asked) for reason in row.why if "~" not in reason.asked and reason.degree > 0][:3]
    return clean("; ".join(dict.fromkeys(part for part in parts if part)), 4 * CAPTION)
