"""What views say of pairs of objects: shown by one mask, or by a mask each.

A thing that is first seen in parts becomes several objects, which need not lie within each other: the seat and the
legs of a stool, the two ends of a bed. Whenever a mask covers what is visible of both, that view says that they are
one; where each has a mask of its own, the view says that they are two. Most views decide (the view consensus rate of
MaskClustering, Yan et al. 2024), so a mask that covers two things by mistake now and then does not join them.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from cgdb.ingest.mapping.fuse import MapObject, Objects
from cgdb.ingest.mapping.lift import Lifted
from cgdb.ingest.mapping.voxels import Voxels


@dataclass(frozen=True, slots=True, kw_only=True)
class Consensus:
    """When views count, and when they agree.

    share: an object is visible by the voxels of which at least this share of the sightings were its. visible: of a best
    view's voxels, so many must be in view. covered: a mask shows an object when it covers this share of what is
    visible of it. views, rate: so many views must show both as one, and be so large a share of those that show both;
    views 0 never joins. alike: the least cosine of the two.
    """

    share: float = 0.35
    visible: float = 0.1
    covered: float = 0.8
    views: int = 2
    rate: float = 0.8
    alike: float = 0.7


Pair = tuple[int, int]


class Opinions:
    """How many views showed two objects as one, and how many as two, by the objects' ids, the smaller first."""

    def __init__(self) -> None:
        self.counts: dict[Pair, tuple[int, int]] = {}

    def watch(
        self, lifted: Lifted, space: str, objects: Objects, voxels: Voxels, room: NDArray[np.bool_], how: Consensus
    ) -> None:
        """Take in what one frame's masks show, of the map as it was before that frame. room (k,): the room's masks."""
        if not how.views or len(objects) < 2 or not len(lifted):
            return
        shown, covered = _shown(lifted, objects, voxels, room, how)
        if len(shown) < 2:
            return
        one, two = np.triu_indices(len(shown), 1)
        unit = objects.features.unit(space)
        if unit is not None:
            looks = unit.take(shown, axis=0)
            near = np.flatnonzero((looks @ looks.T)[one, two] >= how.alike)
            one, two = one[near], two[near]
        inside = (covered >= how.covered).astype(np.float32)
        together: NDArray[np.bool_] = (inside.T @ inside)[one, two] > 0
        mine, yours = covered.argmax(axis=0)[one], covered.argmax(axis=0)[two]
        most = covered.max(axis=0)
        apart = ~together & (mine != yours) & (most[one] >= 0.5) & (most[two] >= 0.5)
        for pair in np.flatnonzero(together | apart).tolist():
            a, b = (objects.all[shown[end[pair]]].id for end in (one, two))
            key = (min(a, b), max(a, b))
            yes, no = self.counts.get(key, (0, 0))
            self.counts[key] = (yes + bool(together[pair]), no + bool(apart[pair]))

    def agreed(self, objects: Objects, how: Consensus) -> NDArray[np.bool_]:
        """(n, n) bool: the pairs that views say are one."""
        place = {obj.id: at for at, obj in enumerate(objects.all)}
        found = np.zeros((len(place), len(place)), np.bool_)
        for (a, b), (yes, no) in self.counts.items():
            if not how.views or yes < how.rate * (yes + no):
                continue
            one, two = place[a], place[b]
            # Of what was hardly seen there are hardly any views.
            rare = min(objects.all[one].n, objects.all[two].n) <= how.views
            if yes >= (1 if rare else how.views):
                found[one, two] = found[two, one] = True
        return found

    def parted(self, objects: Objects) -> NDArray[np.bool_]:
        """(n, n) bool: the pairs that some view showed as two."""
        place = {obj.id: at for at, obj in enumerate(objects.all)}
        found = np.zeros((len(place), len(place)), np.bool_)
        for (a, b), (_, no) in self.counts.items():
            found[place[a], place[b]] = found[place[b], place[a]] = no > 0
        return found

    def to_record(self) -> list[list[int]]:
        """Plain values."""
        return [[a, b, yes, no] for (a, b), (yes, no) in self.counts.items()]

    def fill(self, record: list[list[int]], objects: Objects) -> None:
        """Become what to_record told of; ValueError where it tells of no objects of these."""
        known = {obj.id for obj in objects.all}
        self.counts = {(int(a), int(b)): (int(yes), int(no)) for a, b, yes, no in record}
        if not all(a in known and b in known for a, b in self.counts):
            raise ValueError("opinions of other objects")

    def rename(self, before: list[MapObject], into: NDArray[np.intp]) -> None:
        """Follow a merge of the objects there were, each i into into[i], or away where that is -1."""
        name = {obj.id: before[at].id for obj, at in zip(before, into.tolist(), strict=True) if at >= 0}
        held, self.counts = self.counts, {}
        for (a, b), (yes, no) in held.items():
            one, two = name.get(a, -1), name.get(b, -1)
            if one < 0 or two < 0 or one == two:
                continue
            key = (min(one, two), max(one, two))
            more_yes, more_no = self.counts.get(key, (0, 0))
            self.counts[key] = (yes + more_yes, no + more_no)


def _shown(
    lifted: Lifted, objects: Objects, voxels: Voxels, room: NDArray[np.bool_], how: Consensus
) -> tuple[NDArray[np.intp], NDArray[np.float64]]:
    """(the v objects that are well in view, (k, v) the share of what is visible of each that each mask covers)."""
    n = len(objects)
    seen, place = voxels.numbered(lifted.mask_rows)
    owners = objects.places().take(voxels.owners.take(seen, axis=0), mode="wrap")
    held = np.where(voxels.solid(seen, how.share, 0.0), owners, -1)
    visible = np.bincount(held.reshape(-1) + 1, minlength=n + 1)[1:]
    shown = np.array(
        [at for at in np.flatnonzero(visible).tolist() if _well(objects.all[at], visible[at], how)], np.intp
    )
    number = np.full(n + 1, -1, np.int32)  # -1, nobody, is the last
    number[shown] = np.arange(len(shown), dtype=np.int32)
    thing = np.flatnonzero(~room.take(lifted.mask_owner))
    of = number.take(held, mode="wrap").take(place.take(thing), axis=0)
    mask, slot = np.nonzero(of >= 0)
    pair = lifted.mask_owner.take(thing.take(mask)).astype(np.intp) * len(shown) + of[mask, slot]
    pairs = np.bincount(pair, minlength=len(lifted) * len(shown))
    covered = pairs.reshape(len(lifted), len(shown)) / visible[shown]
    return shown, covered


def _well(obj: MapObject, visible: int, how: Consensus) -> bool:
    """Whether enough of a thing is in view to say anything of it."""
    return not obj.background and visible >= how.visible * obj.widest
