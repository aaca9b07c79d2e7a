"""The mapping loop: frames and their detections become objects, as in Section II of the ConceptGraphs paper."""

from __future__ import annotations

from dataclasses import asdict, dataclass, field, replace
from typing import Any, Literal

import numpy as np

from cgdb.ingest.detections.detections import BACKGROUND, Detections, Selection, select
from cgdb.ingest.frames.recording import Frame
from cgdb.ingest.mapping import tidy
from cgdb.ingest.mapping.associate import Association, associate
from cgdb.ingest.mapping.clouds import scene_of
from cgdb.ingest.mapping.fuse import VIEWS, Objects, claims
from cgdb.ingest.mapping.lift import Lifting, lift
from cgdb.ingest.mapping.voxels import Voxels
from cgdb.scene import SceneGraph


@dataclass(frozen=True, slots=True, kw_only=True)
class Mapping:
    """All that a map depends on besides its input; the same input and the same of this give the same map.

    voxel: metres. background: walls, floor and ceiling become one object each ("merge"), are left out ("skip"), or are
    objects as others are ("objects"). renormalise: the reference's variant of the mean feature. views: the best
    sightings that are kept of each object; crops: with a picture of each.
    """

    voxel: float = 0.025
    background: Literal["merge", "skip", "objects"] = "merge"
    renormalise: bool = False
    views: int = VIEWS
    crops: bool = True
    selection: Selection = field(default_factory=Selection)
    lifting: Lifting = field(default_factory=Lifting)
    association: Association = field(default_factory=Association)
    tidying: tidy.Tidying = field(default_factory=tidy.Tidying)

    def as_record(self) -> dict[str, Any]:
        """The same as plain values, for the provenance of a scene."""
        return asdict(self)


class Mapper:
    """A map in the making. Give it frames in any order and number; ask for the scene at any time."""

    def __init__(self, how: Mapping | None = None) -> None:
        self.how = how or Mapping()
        self._selection = replace(self.how.selection, skip_background=self.how.background == "skip")
        self.voxels = Voxels(self.how.voxel)
        self.objects = Objects(renormalise=self.how.renormalise, views=self.how.views, crops=self.how.crops)
        self.frames = 0
        self.detections = 0
        self._cared = self._newest = -1

    def step(self, frame: Frame, found: Detections) -> None:
        """Take one frame in. The time that it takes depends on the frame, not on what is mapped already."""
        how = self.how
        self.objects.check(found, frame.name)
        found = select(found, frame, self._selection)
        room = np.array([how.background == "merge" and label in BACKGROUND for label in found.labels], np.bool_)
        lifted = lift(frame, found, self.voxels, how.lifting, whole=room)
        room = room[lifted.source]
        matches = associate(lifted, found, self.objects, self.voxels, how.association, alone=room)
        went = self.objects.fuse(frame, found, lifted, matches.objects, room)
        for k in np.flatnonzero(matches.out_of >= 0).tolist():
            self.voxels.hand_over(lifted.rows[lifted.owner == k], int(matches.out_of[k]), int(went[k]))
        rows, objects, strength = claims(lifted, went)
        self.voxels.vote(rows, objects, strength)
        self.voxels.last[rows] = self.frames
        self.frames += 1
        self._newest = max(self._newest, frame.index)
        self.detections += len(lifted)
        self._tidy()

    def finish(self) -> None:
        """Last care, when no more frames come: noise, duplicates and passing sights go."""
        tidy.denoise(self.voxels, self.frames + self.how.tidying.old + 1, self.how.tidying)
        tidy.drop(self.objects, self.voxels, self.how.tidying)
        tidy.merge(self.objects, self.voxels, self.how.tidying)

    def scene(self, name: str, **about: Any) -> SceneGraph:
        """The map as it is now, without the objects that were hardly seen yet."""
        return scene_of(self, name, **about)

    def _tidy(self) -> None:
        how, done = self.how.tidying, self.frames
        if how.denoise_every and done % how.denoise_every == 0:
            tidy.denoise(self.voxels, self.frames, how)
        if how.filter_every and done % how.filter_every == 0:
            tidy.drop(self.objects, self.voxels, how)
        if how.merge_every and done % how.merge_every == 0:
            tidy.merge(self.objects, self.voxels, how, since=self._cared)
            self._cared = self._newest
