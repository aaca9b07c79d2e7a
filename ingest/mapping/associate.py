"""Which object of the map each detection shows: a semantic and a geometric similarity, summed, and a greedy choice."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from cgdb.ingest.detections.detections import Detections
from cgdb.ingest.detections.overlap import within
from cgdb.ingest.mapping.fuse import Objects
from cgdb.ingest.mapping.lift import Lifted
from cgdb.ingest.mapping.similarity import box_similarity
from cgdb.ingest.mapping.voxels import SLOTS, Ints, Voxels

Spatial = Literal["overlap", "iou", "giou", "iou_accurate", "giou_accurate"]
Semantic = Literal["paper", "cosine"]
UNKNOWN = 0.8
"""The semantic similarity where there are no features: geometry decides, at threshold - UNKNOWN."""
HELD = 0.25
"""A voxel is an object's, for association, where at least this share of its sightings were."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Association:
    """How detections find their objects.

    spatial: "overlap" is the paper's nnratio, the share of a detection's voxels that are the object's or share a face
    with one that is; the others compare boxes, the accurate ones turned boxes. semantic: "paper" is cos / 2 + 1 / 2,
    "cosine" the reference's cos. threshold: the least sum; the paper's 1.1 goes with "paper", the reference's 1.2 with
    "cosine". bias: weighs
    (1 + bias) spatial + (1 - bias) semantic. alike: what lies in an object and does not look like it (cosine) is a
    thing of its own that earlier masks had swallowed, once the object has been seen `settled` times, or another
    detection of the same frame is more similar to it; -1 lets them all in, as the paper does. contained: taken off the
    sum where the detection's box lies in another's of its frame and that of the object's first detection did not, or
    the other way round; the reference's variant of contain_number takes 0.5.
    """

    spatial: Spatial = "overlap"
    semantic: Semantic = "paper"
    threshold: float = 1.1
    bias: float = 0.0
    alike: float = 0.7
    settled: int = 3
    contained: float = 0.0


@dataclass(frozen=True, slots=True, eq=False)
class Matches:
    """objects (k,): the object of each detection, -1 for a new one. out_of (k,): of a new one, the object that has
    been taking it in so far, else -1."""

    objects: NDArray[np.intp]
    out_of: NDArray[np.intp]


def associate(
    lifted: Lifted, found: Detections, objects: Objects, voxels: Voxels, how: Association, alone: NDArray[np.bool_]
) -> Matches:
    """Each detection's object. alone (k,): detections that are not to be asked for."""
    matches = Matches(np.full(len(lifted), -1, np.intp), np.full(len(lifted), -1, np.intp))
    if not len(objects) or alone.all():
        return matches
    room = np.array([obj.background for obj in objects.all], np.bool_)
    spatial = (
        overlap(lifted, voxels, ~alone, objects.places(), ~room)
        if how.spatial == "overlap"
        else box_similarity(lifted, objects, voxels.size, how.spatial)
    )
    total = (1 + how.bias) * spatial + (1 - how.bias) * semantic(lifted, found, objects, how.semantic)
    if how.contained:
        known = np.array([obj.within for obj in objects.all], np.bool_)
        total -= how.contained * (within(found.xyxy)[lifted.source][:, None] != known)
    # What is nowhere near is no candidate, however alike it looks.
    total[spatial <= (-1.0 if how.spatial.startswith("giou") else 0.0)] = -np.inf
    total[:, room] = -np.inf
    each = np.arange(len(total))
    around = total.argmax(axis=1)
    inside = (total[each, around] >= how.threshold) & ~alone
    total[_strange(lifted, found, objects, how)] = -np.inf
    best = total.argmax(axis=1)
    score = total[each, best]
    good = (score >= how.threshold) & ~alone
    matches.objects[good] = best[good]
    matches.out_of[inside & ~good] = around[inside & ~good]
    apart = _swallowed(lifted, found, objects, how, best, np.where(good, score, -np.inf))
    matches.objects[apart], matches.out_of[apart] = -1, best[apart]
    return matches


def _strange(lifted: Lifted, found: Detections, objects: Objects, how: Association) -> NDArray[np.bool_]:
    """(k, n) bool: which objects, of which it is known how they look, do not look like which detections."""
    known = objects.features.unit(found.space)
    if found.features is None or known is None:
        return np.zeros((len(lifted), len(objects)), np.bool_)
    settled = np.array([obj.n >= how.settled for obj in objects.all], np.bool_)
    unlike: NDArray[np.bool_] = found.features[lifted.source] @ known.T < how.alike
    return unlike & settled


def _swallowed(
    lifted: Lifted,
    found: Detections,
    objects: Objects,
    how: Association,
    best: NDArray[np.intp],
    score: NDArray[np.floating],
) -> NDArray[np.intp]:
    """The detections that are in an object only because some mask once covered both."""
    known = objects.features.unit(found.space)
    if found.features is None or known is None:
        return np.zeros(0, np.intp)
    cosine = (found.features[lifted.source] * known[best]).sum(axis=1)
    order = np.lexsort((-score, best))
    order = order[np.isfinite(score[order])]
    later = np.zeros(len(order), np.bool_)
    later[1:] = best[order[1:]] == best[order[:-1]]
    strange: NDArray[np.intp] = order[later & (cosine[order] < how.alike)]
    return strange


def semantic(lifted: Lifted, found: Detections, objects: Objects, kind: Semantic) -> NDArray[np.float32]:
    """(k, n) float32 how alike detections and objects look."""
    known = objects.features.unit(found.space)
    if found.features is None or known is None:
        return np.full((len(lifted), len(objects)), UNKNOWN, np.float32)
    cosine: NDArray[np.float32] = found.features[lifted.source] @ known.T
    return cosine if kind == "cosine" else (cosine / 2 + 0.5).astype(np.float32)


def overlap(
    lifted: Lifted, voxels: Voxels, wanted: NDArray[np.bool_], places: Ints, among: NDArray[np.bool_]
) -> NDArray[np.float32]:
    """(k, n) float32 the share of each wanted detection's voxels that are, or touch, the object's.

    places: as Objects.places; among (n,): the objects that count.

    Every voxel knows whose it is, so this looks at the detections' voxels only: its cost does not depend on n.
    """
    n = len(among)
    chosen = np.flatnonzero(wanted.take(lifted.owner))
    item, near = touching(voxels, lifted.rows.take(chosen), HELD, places, among)
    shared = np.bincount(lifted.owner.take(chosen.take(item)) * n + near, minlength=len(lifted) * n)
    size = np.bincount(lifted.owner, minlength=len(lifted))
    return (shared.reshape(len(lifted), n) / size[:, None]).astype(np.float32)


def touching(
    voxels: Voxels, rows: Ints, share: float, places: Ints, among: NDArray[np.bool_]
) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """Pairs (which of rows, an object that is there or in a voxel that shares a face), each once, ascending.

    An object is where this share of the sightings was its. places: as Objects.places; among (n,): the objects that
    count.
    """
    around = voxels.around(rows).reshape(-1)
    there = np.flatnonzero(around >= 0)
    near, place = voxels.numbered(around.take(there))
    held = voxels.solid(near, share, 0.0)
    owners = places.take(voxels.owners.take(near, axis=0), mode="wrap")
    held &= among.take(owners, mode="clip")
    objects = np.flatnonzero(np.bincount(owners[held], minlength=1))
    number = np.zeros(len(among), np.intp)
    number[objects] = np.arange(len(objects))
    item = there % max(len(rows), 1)
    # What is where, as a table of all rows by the few objects about.
    table = np.zeros((len(rows), len(objects)), np.bool_)
    flat = table.reshape(-1)
    for slot in range(SLOTS):
        some = np.flatnonzero(held[:, slot].take(place))
        flat[item.take(some) * len(objects) + number.take(owners[:, slot].take(place.take(some)))] = True
    pairs = np.flatnonzero(flat)
    which, what = np.divmod(pairs, max(len(objects), 1))
    return which, objects.take(what)
