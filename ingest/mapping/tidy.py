"""Periodic care of a map: noise goes, objects that are one are merged, those that were hardly seen are left out."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from cgdb.ingest.mapping.associate import touching
from cgdb.ingest.mapping.consensus import Consensus, Opinions
from cgdb.ingest.mapping.fuse import Objects
from cgdb.ingest.mapping.lift import STRONG
from cgdb.ingest.mapping.voxels import Voxels

_CHUNK = 1 << 16
_SCATTER = 2.0
"""So many times the expected square distance of two means is still one thing."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Tidying:
    """When and how.

    denoise_every, merge_every, filter_every: frames; 0 is never, but all three are done at the end. share, strength: a
    voxel is an object's where at least this share of its sightings say so, and so many. old: frames after which a
    voxel that hardly anything spoke for is forgotten. overlap, semantic, text: objects merge when this share of one's
    voxels are or touch the other's, and their features are so alike (cosine); touching: this share is enough where no
    view showed both and they look the same. least_detections: fewer is no object.
    """

    denoise_every: int = 20
    merge_every: int = 20
    filter_every: int = 0
    share: float = 0.35
    strength: float = STRONG
    old: int = 20
    overlap: float = 0.7
    touching: float = 0.1
    semantic: float = 0.8
    text: float = 0.8
    least_detections: int = 3
    least_voxels: int = 4


def denoise(voxels: Voxels, now: int, how: Tidying) -> None:
    """Forget voxels that were seen once, a while ago, and never again: what a camera made up, or nobody claimed."""
    part = slice(0, voxels.count)
    weak = (voxels.seen[part] < how.strength) & (voxels.last[part] < now - how.old) & (voxels.weight[part] > 0)
    rows = np.flatnonzero(weak)
    if len(rows):
        voxels.forget(rows)


def merge(
    objects: Objects,
    voxels: Voxels,
    opinions: Opinions,
    how: Tidying,
    consensus: Consensus,
    *,
    since: int | None = None,
) -> int:
    """Merge objects that look alike and lie within each other, or that views agree are one; how many went.

    Background is left as it is. since: look only at objects that were seen in that frame or later, so that the time
    does not grow with the map.
    """
    n = len(objects)
    things = np.array([not o.background and (since is None or o.last >= since) for o in objects.all], np.bool_)
    candidates = _candidates(objects, how, things)
    # Of two that views say are one, the one that was detected less goes.
    order = np.lexsort((-np.arange(n), np.array([obj.n for obj in objects.all]))).argsort()
    agreed = opinions.agreed(objects, consensus) & (order[:, None] < order[None, :])
    if not (candidates | agreed).any():
        return 0
    some: NDArray[np.bool_] = np.asarray(candidates.any(axis=1))
    ratio = np.where(candidates, shared(objects, voxels, how, some), 0.0)
    ratio[(ratio > how.touching) & look_the_same(objects) & ~opinions.parted(objects)] = 1.0
    ratio[agreed] = 1.0
    i, j = np.nonzero(ratio > how.overlap)
    order = np.lexsort((j, i, -ratio[i, j]))
    into = np.arange(n)
    for a, b in zip(i[order].tolist(), j[order].tolist(), strict=True):
        if into[a] != a:
            continue  # it went already, and not twice
        while into[b] != b:
            b = int(into[b])
        into[a] = b
    for a in range(n):
        while into[into[a]] != into[a]:
            into[a] = into[into[a]]
    gone = int((into != np.arange(n)).sum())
    if gone:
        opinions.rename(objects.all, into)
        objects.merge(into, voxels)
    return gone


def _candidates(objects: Objects, how: Tidying, things: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """(n, n) bool: which pairs look alike and have boxes that meet: few do, and only those are compared. The first is
    one of things (n,), none is of the room."""
    n = len(objects)
    low, high = (np.array([getattr(obj, end) for obj in objects.all]).reshape(-1, 3) for end in ("low", "high"))
    some = np.flatnonzero(things)
    pairs = np.broadcast_to(~np.array([obj.background for obj in objects.all], np.bool_), (len(some), n)).copy()
    for axis in range(3):
        pairs &= low[some, axis, None] <= high[None, :, axis] + 1
        pairs &= low[None, :, axis] <= high[some, axis, None] + 1
    pairs[np.arange(len(some)), some] = False
    for unit, least in zip(objects.features.looks(), (how.semantic, how.text), strict=True):
        if unit is not None:
            pairs &= unit[some] @ unit.T > least
    found = np.zeros((n, n), np.bool_)
    found[some] = pairs
    return found


def look_the_same(objects: Objects) -> NDArray[np.bool_]:
    """(n, n) bool: the pairs whose mean features differ no more than the means of as many views of one thing do.

    The views of a thing scatter about their mean, and the mean of n of them by 1 / n of that variance. Objects that
    were seen once scatter as the others do.
    """
    n = np.array([obj.n for obj in objects.all], np.float64)
    same = np.zeros((len(n), len(n)), np.bool_)
    image = next((sums for name, sums in objects.features.sums().items() if not name.endswith("_text")), None)
    if image is None or not (n > 1).any():
        return same
    mean = image / n[:, None]
    length = (mean**2).sum(axis=1)
    variance = (1.0 - np.minimum(length, 1.0)) * n / np.maximum(n - 1.0, 1.0)
    variance[n < 2] = np.median(variance[n > 1])
    apart = length[:, None] + length[None, :] - 2.0 * (mean @ mean.T)
    expected = (variance / n)[:, None] + (variance / n)[None, :]
    # Views without features shorten a mean, and it says nothing of its scatter then.
    whole = length > 0.5
    same |= (apart < _SCATTER * expected) & whole[:, None] & whole[None, :]
    return same


def shared(objects: Objects, voxels: Voxels, how: Tidying, things: NDArray[np.bool_]) -> NDArray[np.float32]:
    """(n, n) float32 the share of object i's voxels that are, or touch, object j's; 0 on the diagonal.

    i is one of things (n,), j is none of the room. One walk over the voxels in the boxes of things finds every pair
    that meets, however many pairs there are, and however large the map.
    """
    n = len(objects)
    mine_too = np.append(things, False)  # -1, nobody, is the last
    room = np.array([obj.background for obj in objects.all], np.bool_)
    boxes = [voxels.within(objects.all[at].low, objects.all[at].high) for at in np.flatnonzero(things).tolist()]
    rows, _ = voxels.numbered(np.concatenate([np.zeros(0, np.int32), *boxes]))
    places = objects.places()
    rows = rows[mine_too[places.take(voxels.owners.take(rows, axis=0), mode="wrap")].any(axis=1)]
    met, size = np.zeros(n * n, np.int64), np.zeros(n, np.int64)
    for start in range(0, len(rows), _CHUNK):
        part = rows[start : start + _CHUNK]
        owners = places.take(voxels.owners.take(part, axis=0), mode="wrap")
        place, slot = np.nonzero(voxels.solid(part, how.share, 0.0) & mine_too[owners])
        mine = owners[place, slot]
        size += np.bincount(mine, minlength=n)
        # (voxel, object near it), joined with (voxel, object in it).
        near_voxel, near_object = touching(voxels, part, how.share, places, ~room)
        counts = np.bincount(near_voxel, minlength=len(part))
        starts = np.cumsum(counts) - counts
        pairs = np.repeat(np.arange(len(place)), counts[place])
        offset = np.arange(len(pairs)) - np.repeat(np.cumsum(counts[place]) - counts[place], counts[place])
        other = near_object[starts[place[pairs]] + offset]
        met += np.bincount(mine[pairs].astype(np.int64) * n + other, minlength=n * n)
    ratio = met.reshape(n, n) / np.maximum(size, 1)[:, None]
    np.fill_diagonal(ratio, 0)
    return ratio.astype(np.float32)


def drop(objects: Objects, voxels: Voxels, opinions: Opinions, how: Tidying) -> int:
    """Drop the objects that were detected less often than asked; how many went."""
    into = np.array([i if obj.n >= how.least_detections else -1 for i, obj in enumerate(objects.all)], np.intp)
    if (into < 0).any():
        opinions.rename(objects.all, into)
        objects.merge(into, voxels)
    return int((into < 0).sum())
