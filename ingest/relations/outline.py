"""Outline: what relations from geometry need of a scene that is read in batches, and no more: ids and boxes."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
from numpy.typing import NDArray

from cgdb.ingest.relations.boxes import Boxes
from cgdb.ingest.relations.relate import boxes_of, geometric_relations
from cgdb.scene import ObjectId, Relation, SceneObject


class Outline:
    """Collects the boxes of objects batch by batch: 120 bytes of each, whatever features and points it carries."""

    def __init__(self) -> None:
        self._ids: list[ObjectId] = []
        self._centers: list[NDArray[np.float64]] = []
        self._extents: list[NDArray[np.float64]] = []
        self._rotations: list[NDArray[np.float64]] = []

    def add(self, objects: Iterable[SceneObject]) -> None:
        """Take in a batch; objects without a box take no part."""
        boxed = [obj for obj in objects if obj.center is not None]
        if not boxed:
            return
        boxes = boxes_of(boxed)
        self._ids.extend(obj.id for obj in boxed)
        self._centers.append(boxes.centers)
        self._extents.append(boxes.extents)
        n = len(boxed)
        self._rotations.append(np.tile(np.eye(3), (n, 1, 1)) if boxes.rotations is None else boxes.rotations)

    def relations(self, *, up: str) -> list[Relation]:
        """The relations between all objects taken in."""
        if not self._ids:
            return []
        boxes = Boxes(
            centers=np.concatenate(self._centers),
            extents=np.concatenate(self._extents),
            rotations=np.concatenate(self._rotations),
        )
        return geometric_relations(self._ids, boxes, up=up)
