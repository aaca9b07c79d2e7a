"""A scene as a picture needs it: a sample of its points, its boxes, names and marks, turned so that z is up."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from cgdb.cli.floorplan import axes
from cgdb.errors import BindError, did_you_mean, one_of
from cgdb.geometry import parse_up

if TYPE_CHECKING:
    import cgdb
    from cgdb.result import Result, StoredNode
    from cgdb.view import SceneView

MOST_POINTS = 600_000
"""Points of a picture; more would lie on pixels that are taken."""
MOST_ARROWS = 400
_VAST = 0.2
"""Share of the footprint that a thing hardly has."""
THING, WALL, FLOOR, CEILING = range(4)
_KINDS = {
    **dict.fromkeys(("wall", "walls"), WALL),
    **dict.fromkeys(("floor", "ground", "floors"), FLOOR),
    **dict.fromkeys(("ceiling", "ceilings", "roof"), CEILING),
}
_SIGNS = np.array([[a, b, c] for a in (-1, 1) for b in (-1, 1) for c in (-1, 1)], np.float64) / 2


@dataclass(frozen=True, slots=True, kw_only=True)
class Arrow:
    """A relation between two items, by their index."""

    source: int
    target: int
    label: str


@dataclass(frozen=True, kw_only=True, eq=False)
class PictureScene:
    """m items (objects and places) and n points in the frame of the picture: x right, y away, z up, metres.

    points (n, 3) float32; colors (n, 3) uint8 or None; owner (n,) int32 item of each point. centers (m, 3) and
    corners (m, 8, 3) float64, NaN where unknown; corners by the signs of the box's own axes, the last varying fastest.
    number (m,) int64: the row of the result that speaks of it, 0 for none; score (m,) float64 of that row.
    kind (m,): THING, WALL, FLOOR, CEILING. axes: the scene's axes that point right, away and up.
    """

    name: str
    axes: tuple[str, str, str]
    points: NDArray[np.float32]
    colors: NDArray[np.uint8] | None
    owner: NDArray[np.int32]
    n_points: int
    ids: tuple[object, ...]
    names: tuple[str, ...]
    is_place: NDArray[np.bool_]
    kind: NDArray[np.int64]
    centers: NDArray[np.float64]
    corners: NDArray[np.float64]
    number: NDArray[np.int64]
    fits: NDArray[np.bool_]
    score: NDArray[np.float64]
    arrows: tuple[Arrow, ...]
    n_arrows: int

    @property
    def has_result(self) -> bool:
        """Whether something is highlighted, and the rest therefore dimmed."""
        return bool(self.number.any())

    @cached_property
    def bounds(self) -> NDArray[np.float64]:
        """(2, 3) the corner with the least and that with the most coordinates: of the points, else of boxes.

        Few points lie far out by mistake, and what is outlying must not make the room tiny.
        """
        parts = [self.corners[np.isfinite(self.corners).all(axis=(1, 2))].reshape(-1, 3)]
        parts.append(self.centers[np.isfinite(self.centers).all(axis=1)])
        boxes = np.concatenate(parts)
        if not len(self.points):
            return np.stack([boxes.min(axis=0), boxes.max(axis=0)])
        low, high = np.quantile(self.points, [0.001, 0.999], axis=0)
        found = np.stack([low, high]).astype(np.float64) + np.array([[-0.05], [0.05]])
        marked = self.centers[(self.number > 0) & np.isfinite(self.centers).all(axis=1)]
        without = np.setdiff1d(np.flatnonzero(np.isfinite(self.centers).all(axis=1)), np.unique(self.owner))
        more = np.concatenate([found, marked, self.centers[without]])
        return np.stack([more.min(axis=0), more.max(axis=0)])

    @cached_property
    def ceiling(self) -> float:
        """The height above which nothing is drawn, because it would hide the room; infinite without a ceiling."""
        low, high = self.bounds[:, 2]
        named = self.corners[(self.kind == CEILING) & self.boxed, :, 2]
        if len(named):
            lowest = float(named.min(axis=1).max()) - 0.02
            # What is called a ceiling but hangs as low as a table is a mistake of the map.
            if lowest > low + 0.6 * (high - low) and high - low > 1.0:
                return lowest
        if not len(self.points) or high - low < 1.8:
            return np.inf
        # A ceiling: the top tenth of the room covers a good part of its footprint.
        cut = high - 0.1 * (high - low)
        cells = np.floor(self.points[:, :2] / 0.15).astype(np.int64)
        cells -= cells.min(axis=0)
        flat = cells[:, 0] * (cells[:, 1].max() + 1) + cells[:, 1]
        covered = len(np.unique(flat[self.points[:, 2] > cut])) / max(1, len(np.unique(flat)))
        return float(cut) if covered > 0.35 else np.inf

    @cached_property
    def hidden(self) -> NDArray[np.bool_]:
        """(m,) items that are the ceiling or hang above it."""
        lowest = np.where(np.isfinite(self.corners[:, :, 2]), self.corners[:, :, 2], np.inf).min(axis=1)
        lowest = np.where(np.isfinite(lowest), lowest, self.centers[:, 2])
        return np.asarray(((self.kind == CEILING) | (lowest > self.ceiling)) & (self.number == 0))

    @cached_property
    def vast(self) -> NDArray[np.float64]:
        """(m,) 0 to 1: how much of the place a box covers; at 1 it is the room itself or a mistake, only outlined."""
        spans = np.ptp(self.corners[:, :, :2], axis=1).prod(axis=1)
        place = float(np.ptp(self.bounds[:, :2], axis=0).prod())
        return np.asarray(np.minimum(1.0, np.nan_to_num(spans) / max(_VAST * place, 1e-9)))

    @cached_property
    def with_cloud(self) -> NDArray[np.bool_]:
        """(m,) items that have points in the picture."""
        found = np.zeros(len(self.ids), np.bool_)
        found[np.unique(self.owner)] = True
        return found

    @cached_property
    def placed(self) -> NDArray[np.bool_]:
        return np.asarray(np.isfinite(self.centers).all(axis=1))

    @cached_property
    def boxed(self) -> NDArray[np.bool_]:
        return np.asarray(np.isfinite(self.corners).all(axis=(1, 2)))


def gather(
    db: cgdb.Database,
    view: SceneView,
    marks: dict[int, tuple[int, bool]],
    result: Result | None = None,
    *,
    relations: tuple[str, ...] = (),
    most_points: int = MOST_POINTS,
    seed: int = 0,
) -> PictureScene:
    """Read what a picture needs of a scene, one cloud at a time. relations: labels of those drawn as arrows."""
    boxes = view.columns.boxes
    turn = _turn(view.info.up)
    count = len(boxes)
    stored = view.stored(np.arange(count, dtype=np.int64))
    nodes = [stored[position] for position in range(count)]
    sides = boxes.extents[:, None, :] * _SIGNS[None]
    corners = boxes.centers[:, None, :] + np.matmul(sides, boxes.rotations.transpose(0, 2, 1))
    number, score = np.zeros(count, np.int64), np.full(count, np.nan)
    fits = np.zeros(count, np.bool_)
    for position, (row, row_fits) in marks.items():
        number[position], fits[position] = row, row_fits
        if result is not None:
            score[position] = result.rows[row - 1].score
    points, colors, owner, total = _sample(_clouds(db, view, nodes), most_points, seed)
    arrows = _arrows(view, relations)
    (right, right_sign), (away, away_sign) = axes(view.info.up)
    up, up_sign = parse_up(view.info.up)
    named = tuple(
        ("-" if sign < 0 else "") + "xyz"[axis]
        for axis, sign in ((right, right_sign), (away, away_sign), (up, up_sign))
    )
    return PictureScene(
        name=view.info.name,
        axes=(named[0], named[1], named[2]),
        points=points @ turn.T.astype(np.float32),
        colors=colors,
        owner=owner,
        n_points=total,
        ids=tuple(node.id for node in nodes),
        names=tuple(_name(node) for node in nodes),
        is_place=np.array([node.label != "Object" for node in nodes], np.bool_),
        kind=np.array([_KINDS.get((node.tag or "").strip().casefold(), THING) for node in nodes], np.int64),
        centers=boxes.centers @ turn.T,
        corners=corners @ turn.T,
        number=number,
        fits=fits,
        score=score,
        arrows=tuple(arrows[:MOST_ARROWS]),
        n_arrows=len(arrows),
    )


def _name(node: StoredNode) -> str:
    if node.label == "Object":
        return node.tag or node.caption or ""
    name = node.properties.get("name")
    return str(name if name else node.tag or node.label)


def _turn(up: str) -> NDArray[np.float64]:
    """(3, 3) rows: the picture's right, away and up in the scene's frame."""
    turn = np.zeros((3, 3))
    for row, (axis, sign) in enumerate((*axes(up), parse_up(up))):
        turn[row, axis] = sign
    return turn


Cloud = tuple[int, NDArray[np.float32], NDArray[np.uint8] | None]


def _clouds(db: cgdb.Database, view: SceneView, nodes: list[StoredNode]) -> Iterator[Cloud]:
    positions = {node.id: position for position, node in enumerate(nodes)}
    for id, (points, colors) in db.clouds(view.info.name, as_of=view.info.revision):
        if len(points):
            yield positions[id], points, colors


def _sample(
    clouds: Iterator[Cloud], most: int, seed: int
) -> tuple[NDArray[np.float32], NDArray[np.uint8] | None, NDArray[np.int32], int]:
    """points, colors, owner of at most so many points, each as likely as any other, and how many there were.

    Every point draws a number and those with the smallest stay, so that one cloud and the sample are all there is in
    memory, and the sample is the same each time.
    """
    random = np.random.default_rng(seed)
    kept: list[tuple[NDArray[np.float32], NDArray[np.uint8], NDArray[np.int32], NDArray[np.float32]]] = []
    limit, held, total, colored = np.float32(np.inf), 0, 0, False
    for position, points, colors in clouds:
        lot = random.random(len(points), dtype=np.float32)
        total += len(points)
        stay = lot < limit
        colored |= colors is not None
        if colors is None:
            colors = np.broadcast_to(np.array([180, 177, 168], np.uint8), points.shape)
        kept.append((points[stay], colors[stay], np.full(int(stay.sum()), position, np.int32), lot[stay]))
        held += len(kept[-1][0])
        if held > 2 * most:
            kept, limit = [_smallest(kept, most)], np.float32(0)
            limit, held = kept[0][3].max(initial=np.float32(0)), len(kept[0][0])
    if not kept:
        return np.empty((0, 3), np.float32), None, np.empty(0, np.int32), 0
    points, colors, owner, _ = _smallest(kept, most)
    return points, colors if colored else None, owner, total


def _smallest(
    parts: list[tuple[NDArray[np.float32], NDArray[np.uint8], NDArray[np.int32], NDArray[np.float32]]], most: int
) -> tuple[NDArray[np.float32], NDArray[np.uint8], NDArray[np.int32], NDArray[np.float32]]:
    points = np.concatenate([part[0] for part in parts])
    colors = np.concatenate([part[1] for part in parts])
    owner = np.concatenate([part[2] for part in parts])
    lot = np.concatenate([part[3] for part in parts])
    if len(lot) <= most:
        return points, colors, owner, lot
    stay = np.sort(np.argpartition(lot, most)[:most])
    return points[stay], colors[stay], owner[stay], lot[stay]


def _arrows(view: SceneView, wanted: tuple[str, ...]) -> list[Arrow]:
    """The relations with these labels; BindError, with the nearest label, where the scene has none of one."""
    if not wanted:
        return []
    relations = view.relations
    labels = {str(label).casefold(): code for code, label in enumerate(relations.labels.tolist())}
    for label in wanted:
        if label.casefold() not in labels:
            hint = did_you_mean(label, labels) or (f"it has {one_of(labels)}" if labels else "it has no relations")
            raise BindError(f"scene '{view.info.name}' has no relation '{label}'", hint=hint)
    rows = np.flatnonzero(np.isin(relations.label, [labels[label.casefold()] for label in wanted]))
    return [
        Arrow(source=source, target=target, label=str(relations.labels[code]))
        for source, target, code in zip(
            relations.source[rows].tolist(),
            relations.target[rows].tolist(),
            relations.label[rows].tolist(),
            strict=True,
        )
    ]
