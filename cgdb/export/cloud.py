"""What the formats for 3D viewers share: which points are written, the boxes as corners, names, and colours."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from cgdb.errors import ExportError, UsageError
from cgdb.scene import Place, SceneGraph, SceneObject

MOST_POINTS = 5_000_000
"""Points of a file; viewers grow slow above it."""
_LONGEST = 80
_CORNERS = np.array([[a, b, c] for a in (-1, 1) for b in (-1, 1) for c in (-1, 1)], np.float64) / 2
EDGES = np.array([(i, i | bit) for i in range(8) for bit in (1, 2, 4) if not i & bit])
"""(12, 2) which corners of a box an edge joins."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Thing:
    """An object or a place as viewers show it. index: counts objects, then places.

    center (3,) float64 m. corners (8, 3) float64 of its box, None where it has none. points (n, 3) float32 m, may be
    empty; colors (n, 3) uint8: those of the map, else all its own colour. color: (3,) uint8, one a thing.
    """

    index: int
    node: SceneObject | Place
    center: NDArray[np.float64]
    corners: NDArray[np.float64] | None
    points: NDArray[np.float32]
    colors: NDArray[np.uint8]
    color: NDArray[np.uint8]

    @property
    def label(self) -> str | None:
        """What it is called."""
        return label(self.node)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Things:
    """All things of a scene that have a position, and a line for each thing that is left out."""

    scene: SceneGraph
    shares: NDArray[np.int64]
    """(objects,) how many of an object's points are written."""
    notes: tuple[str, ...] = field(default=())
    seed: int = 0

    def __iter__(self) -> Iterator[Thing]:
        nodes: list[SceneObject | Place] = [*self.scene.objects, *self.scene.places]
        colors = distinct(len(nodes))
        for index, node in enumerate(nodes):
            if placed(node):
                yield self._thing(index, node, colors[index])

    def _thing(self, index: int, node: SceneObject | Place, color: NDArray[np.uint8]) -> Thing:
        points, colors = np.empty((0, 3), np.float32), np.empty((0, 3), np.uint8)
        if isinstance(node, SceneObject) and node.points is not None and len(node.points):
            points = np.asarray(node.points, np.float32)
            colors = np.broadcast_to(color, points.shape) if node.colors is None else node.colors
            count = int(self.shares[index])
            if count < len(points):
                # Its own stream of numbers: a change of one object leaves the points of the others as they are.
                random = np.random.default_rng([self.seed, index])
                chosen = np.sort(random.choice(len(points), count, replace=False, shuffle=False))
                points, colors = points[chosen], colors[chosen]
        center = node.center if node.center is not None else points.mean(axis=0, dtype=np.float64)
        return Thing(
            index=index,
            node=node,
            center=np.asarray(center, np.float64),
            corners=box_corners(node),
            points=points,
            colors=np.asarray(colors, np.uint8),
            color=color,
        )


def things(scene: SceneGraph, max_points: int, seed: int) -> Things:
    """What a viewer can show of a scene; ExportError where that is nothing."""
    if isinstance(max_points, bool) or not isinstance(max_points, int) or max_points < 1:
        raise UsageError(f"max_points must be a whole number above 0, not {max_points!r}")
    nodes: Sequence[SceneObject | Place] = [*scene.objects, *scene.places]
    left = sum(not placed(node) for node in nodes)
    if left == len(nodes):
        raise ExportError(
            f"scene '{scene.name}' has nothing with a position: there is nothing to show in 3D",
            hint="--format node-link or graphml write what it has",
        )
    notes = []
    if left:
        notes.append(f"{left} of {len(nodes)} objects and places have no position: left out")
    counts = np.array([0 if obj.points is None else len(obj.points) for obj in scene.objects], np.int64)
    shares, total = counts, int(counts.sum())
    if total > max_points:
        # Of every cloud the same share, and of the smallest one point.
        shares = np.minimum(counts, np.maximum(1, counts * max_points // total))
        notes.append(
            f"{int(shares.sum()):,} of {total:,} points are written, the same share of each object, chosen with seed "
            f"{seed} (max_points)"
        )
    return Things(scene=scene, shares=shares, notes=tuple(notes), seed=seed)


def placed(node: SceneObject | Place) -> bool:
    """Whether it has a position, by its box or by its points."""
    return node.center is not None or (
        isinstance(node, SceneObject) and node.points is not None and len(node.points) > 0
    )


def box_corners(node: SceneObject | Place) -> NDArray[np.float64] | None:
    """(8, 3) m in the scene's frame, by the signs of the box's own axes, the last varying fastest."""
    if node.center is None or node.extent is None:
        return None
    rotation = node.rotation if isinstance(node, SceneObject) and node.rotation is not None else np.eye(3)
    return np.asarray(node.center + (_CORNERS * node.extent) @ rotation.T, np.float64)


def label(node: SceneObject | Place) -> str | None:
    """A thing's tag, a place's name; else the start of its caption or its kind. One line without control characters."""
    text = node.tag or node.caption if isinstance(node, SceneObject) else node.name or node.kind
    return clean(text) or None if text else None


def clean(text: object, most: int = _LONGEST) -> str:
    """One line of at most so many characters: a stranger's caption must not break the file or the viewer."""
    shown = "".join(c if c.isprintable() else " " for c in str(text)[: 8 * most])
    line = " ".join(shown.split())
    return line if len(line) <= most else line[: most - 1].rstrip() + "…"


def titled(node: SceneObject | Place) -> str:
    """ "12 sofa": how a thing is called in viewers."""
    return f"{clean(node.id)} {label(node) or ''}".strip()


def distinct(n: int) -> NDArray[np.uint8]:
    """(n, 3) uint8 colours, neighbours far apart: hues by the golden angle, three lightnesses in turn."""
    index = np.arange(n)
    hue = 6.0 * ((0.07 + index * 0.618033988749895) % 1.0)
    saturation = np.choose(index % 3, (0.62, 0.48, 0.75))
    value = np.choose(index % 3, (0.82, 0.93, 0.62))
    turned = (np.array([5.0, 3.0, 1.0]) + hue[:, None]) % 6.0
    share = np.clip(np.minimum(turned, 4.0 - turned), 0.0, 1.0)
    return np.asarray(np.round(255 * (value[:, None] * (1.0 - saturation[:, None] * share))), np.uint8)
