"""The nodes of a scene as arrays: keys, ids, labels, boxes; its relations; the catalog of its names; one file."""

from __future__ import annotations

import json
import math
import zipfile
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, cast

import numpy as np
from numpy.typing import NDArray

from cgdb.errors import CorruptionError
from cgdb.geometry import Boxes, parse_up
from cgdb.index.catalog import Catalog, merged_type, property_type, widened
from cgdb.index.neighbours import Collector
from cgdb.scene import ObjectId

if TYPE_CHECKING:
    from cgdb.storage.ledger import NodeRow, RelationRow

Keys = NDArray[np.int64]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Columns:
    """keys: (n,) int64 ascending. labels: names; label_codes: (n,) int16 into them. boxes: n of them, NaN if unknown.

    A node's place in these arrays is its position; everything that a query holds is positions.
    """

    keys: Keys
    labels: tuple[str, ...]
    label_codes: NDArray[np.int16]
    boxes: Boxes

    def positions(self, keys: Keys) -> Keys:
        """The positions of keys that all exist."""
        return np.searchsorted(self.keys, keys).astype(np.int64)

    def of_label(self, label: str | None) -> Keys:
        """Positions of all nodes of a label, ascending; None: of all nodes."""
        if label is None:
            return np.arange(len(self.keys), dtype=np.int64)
        if label not in self.labels:
            return np.empty(0, np.int64)
        return np.flatnonzero(self.label_codes == self.labels.index(label)).astype(np.int64)


def build(path: Path, nodes: Iterable[list[NodeRow]], relations: Iterable[list[RelationRow]]) -> dict[str, Any]:
    """Write the columns of a scene to path; returns the meta of the file, which holds the catalog."""
    keys: list[int] = []
    ids: list[ObjectId] = []
    codes: list[int] = []
    label_codes: dict[str, int] = {"Object": 0}
    counts: dict[str, int] = {}
    kinds: dict[str, str | None] = {}
    ranges: dict[str, tuple[float, float]] = {}
    boxes: list[NDArray[np.float64]] = []
    for batch in nodes:
        block = np.full((len(batch), 15), np.nan)
        block[:, 6:] = np.eye(3).ravel()
        for row, node in enumerate(batch):
            keys.append(node.key)
            ids.append(node.id)
            codes.append(label_codes.setdefault(node.label, len(label_codes)))
            counts[node.label] = counts.get(node.label, 0) + 1
            if node.center is not None:
                block[row, :3] = node.center
            if node.extent is not None:
                block[row, 3:6] = node.extent
            if node.rotation is not None:
                block[row, 6:] = node.rotation.ravel()
            for name, value in node.properties.items():
                kind = property_type(value)
                if kind == "number" and math.isfinite(number := float(cast(float, value))):
                    ranges[name] = widened(ranges.get(name), number, number)
                kinds[name] = merged_type(kinds[name], kind) if kinds.get(name) and kind else kind or kinds.get(name)
        boxes.append(block)
    code_of = dict(zip(keys, codes, strict=True))
    names = list(label_codes)
    ends: dict[str, dict[tuple[int, int], int]] = {}
    neighbours = Collector()
    for relation_batch in relations:
        neighbours.add(relation_batch)
        for relation in relation_batch:
            pair = (code_of[relation.source], code_of[relation.target])
            known = ends.setdefault(relation.label, {})
            known[pair] = known.get(pair, 0) + 1
    key_column = np.asarray(keys, np.int64)
    with path.open("wb") as file:
        np.savez(
            file,
            keys=key_column,
            label_codes=np.asarray(codes, np.int16),
            boxes=np.concatenate(boxes) if boxes else np.empty((0, 15)),
            ids=np.frombuffer(json.dumps(ids).encode(), np.uint8),
            allow_pickle=False,
            **neighbours.arrays(key_column),
        )
    catalog = Catalog(
        labels=counts,
        relations={
            label: {(names[a], names[b]): count for (a, b), count in pairs.items()} for label, pairs in ends.items()
        },
        properties={name: kind or "text" for name, kind in kinds.items()},
        ranges=ranges,
    )
    return {"catalog": catalog.to_json(), "labels": names}


def read_ids(path: Path) -> list[ObjectId]:
    """The ids of all nodes, from the file that build() wrote. CorruptionError where it is not what it should be."""
    try:
        with np.load(path, allow_pickle=False) as arrays:
            ids: list[ObjectId] = json.loads(arrays["ids"].tobytes())
    except (OSError, ValueError, KeyError, zipfile.BadZipFile) as error:
        raise CorruptionError(f"the index file {path.name} cannot be read: {error}") from error
    return ids


def read(path: Path, meta: Any, up: str) -> Columns:
    """The columns that build() wrote. CorruptionError where the file is not what it should be."""
    try:
        with np.load(path, allow_pickle=False) as arrays:
            keys, codes, block = arrays["keys"], arrays["label_codes"], arrays["boxes"]
    except (OSError, ValueError, KeyError, zipfile.BadZipFile) as error:
        raise CorruptionError(f"the index file {path.name} cannot be read: {error}") from error
    axis, sign = parse_up(up)
    return Columns(
        keys=keys,
        labels=tuple(meta["labels"]),
        label_codes=codes,
        boxes=Boxes(
            centers=block[:, :3],
            extents=block[:, 3:6],
            rotations=block[:, 6:].reshape(-1, 3, 3),
            up_axis=axis,
            up_sign=sign,
        ),
    )
