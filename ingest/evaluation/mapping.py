"""How good a map is, against the whole truth: objects found, missed and doubled, purity and completeness of clouds.

A point of the map belongs to the true object whose surface is nearest to it, if that is within `reach`. A mapped object
shows the true object that most of its points belong to; purity is that share. A true object is found where a mapped
one shows it, missed where none does, and every further one is a duplicate. Completeness is the share of a found
object's true surface, as far as any frame saw it, that has a point of the objects that show it within `near`.
"""

from __future__ import annotations

from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from cgdb.errors import FormatError
from cgdb.scene import SceneGraph

REACH = 0.05
NEAR = 0.05
LEAST_SEEN = 3
"""Frames in which a true object must have been seen to be one that a map can be asked for."""
_CHUNK = 1 << 17


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Truth:
    """points (n, 3) float32 m of all true surfaces that were seen, owner (n,) the true object of each, from 0;
    things (k,) bool: which are things, not the room; frames (k,): in how many frames each was seen; names."""

    points: NDArray[np.float32]
    owner: NDArray[np.intp]
    things: NDArray[np.bool_]
    frames: NDArray[np.intp]
    names: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True, kw_only=True)
class Score:
    """The figures of one map. purity, completeness: means over mapped, and over found, objects."""

    true: int
    found: int
    missed: int
    duplicates: int
    mapped: int
    purity: float
    worst_purity: float
    completeness: float
    completeness_fine: float
    points: int

    def to_json(self) -> dict[str, Any]:
        """Plain values."""
        return asdict(self)


def read_truth(root: Path) -> Truth:
    """The truth beside a generated sequence (objects.npz). FormatError where there is none."""
    path = root / "objects.npz"
    try:
        with path.open("rb") as file, np.load(file, allow_pickle=False) as held:
            return Truth(
                points=held["vox_pts"].astype(np.float32),
                owner=held["vox_id"].astype(np.intp) - 1,
                things=~held["is_bg"].astype(bool),
                frames=held["frames_seen"].astype(np.intp),
            )
    except (OSError, ValueError, KeyError, EOFError) as error:
        raise FormatError(f"{path}: holds no truth that can be read ({type(error).__name__})") from error


def evaluate(scene: SceneGraph, truth: Truth, *, least_seen: int = LEAST_SEEN) -> Score:
    """The score of a map's things; its background is not looked at."""
    objects = [o for o in scene.objects if o.points is not None and not o.properties.get("background")]
    clouds = [o.points for o in objects if o.points is not None]
    points = np.concatenate(clouds) if clouds else np.zeros((0, 3), np.float32)
    of = np.repeat(np.arange(len(clouds)), [len(cloud) for cloud in clouds])
    _, nearest_true = nearest(points, truth.points, REACH)
    label = np.where(nearest_true >= 0, truth.owner[nearest_true], -1)
    n = len(truth.things)
    votes = np.zeros((len(clouds), n + 1), np.int64)
    np.add.at(votes, (of, label), 1)
    shows = votes[:, :n].argmax(axis=1) if len(clouds) else np.zeros(0, np.intp)
    purity = votes[np.arange(len(clouds)), shows] / np.maximum([len(cloud) for cloud in clouds], 1)
    asked = np.flatnonzero(truth.things & (truth.frames >= least_seen))
    found = np.intersect1d(asked, shows)
    real = truth.things[shows] if len(shows) else np.zeros(0, bool)
    complete = [_completeness(truth, int(t), points[np.isin(of, np.flatnonzero(shows == t))]) for t in found]
    return Score(
        true=len(asked),
        found=len(found),
        missed=len(asked) - len(found),
        duplicates=int(real.sum() - len(np.unique(shows[real]))) if len(shows) else 0,
        mapped=len(clouds),
        purity=float(purity.mean()) if len(purity) else 0.0,
        worst_purity=float(purity.min()) if len(purity) else 0.0,
        completeness=float(np.mean([c for c, _ in complete])) if complete else 0.0,
        completeness_fine=float(np.mean([c for _, c in complete])) if complete else 0.0,
        points=len(points),
    )


def _completeness(truth: Truth, which: int, points: NDArray[np.float32]) -> tuple[float, float]:
    surface = truth.points[truth.owner == which]
    distance, _ = nearest(surface, points, NEAR)
    return float((distance < NEAR).mean()), float((distance < NEAR / 2).mean())


def nearest(
    points: NDArray[np.float32], among: NDArray[np.float32], reach: float
) -> tuple[NDArray[np.float32], NDArray[np.intp]]:
    """(distance (n,) m, index (n,)) of the nearest of `among` (m, 3) to points (n, 3); inf and -1 beyond reach."""
    distance = np.full(len(points), np.inf, np.float32)
    index = np.full(len(points), -1, np.intp)
    if not len(points) or not len(among):
        return distance, index
    low = np.minimum(points.min(axis=0), among.min(axis=0)) - 2 * reach
    side = np.floor((np.maximum(points.max(axis=0), among.max(axis=0)) - low) / reach).astype(np.int64) + 2
    cells = np.floor((among - low) / reach).astype(np.int64)
    key = (cells[:, 0] * side[1] + cells[:, 1]) * side[2] + cells[:, 2]
    order = np.argsort(key, kind="stable")
    key = key[order]
    at = np.floor((points - low) / reach).astype(np.int64)
    base = (at[:, 0] * side[1] + at[:, 1]) * side[2] + at[:, 2]
    for x in (-1, 0, 1):
        for y in (-1, 0, 1):
            # Three cells in a row of the last axis lie together in the order of the keys.
            middle = base + x * side[1] * side[2] + y * side[2]
            first, last = np.searchsorted(key, middle - 1), np.searchsorted(key, middle + 1, side="right")
            _take_nearest(points, among, order, first, last, distance, index)
    far = distance > reach
    distance[far], index[far] = np.inf, -1
    return distance, index


def _take_nearest(
    points: NDArray[np.float32],
    among: NDArray[np.float32],
    order: NDArray[np.intp],
    first: NDArray[np.intp],
    last: NDArray[np.intp],
    distance: NDArray[np.float32],
    index: NDArray[np.intp],
) -> None:
    """Look at the candidates order[first:last] of each point; distance and index are changed where one is nearer."""
    some = np.flatnonzero(last > first)
    for start in range(0, len(some), _CHUNK // 8):
        rows = some[start : start + _CHUNK // 8]
        counts = last[rows] - first[rows]
        begin = np.cumsum(counts) - counts
        which = np.repeat(np.arange(len(rows)), counts)
        candidate = order[np.arange(len(which)) - np.repeat(begin, counts) + np.repeat(first[rows], counts)]
        apart = np.linalg.norm(points[rows[which]] - among[candidate], axis=1)
        low = np.minimum.reduceat(apart, begin)
        # The first candidate that is as near as the nearest.
        hit = np.flatnonzero(apart == low[which])
        _, one = np.unique(which[hit], return_index=True)
        nearer = low < distance[rows]
        distance[rows[nearer]] = low[nearer]
        index[rows[nearer]] = candidate[hit[one]][nearer]
