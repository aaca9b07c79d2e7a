"""The mapping loop: frames and their detections become objects, as in Section II of the ConceptGraphs paper."""

from __future__ import annotations

from dataclasses import asdict, dataclass, field, replace
from typing import Any, Literal

import numpy as np

from cgdb.ingest.detections.detections import BACKGROUND, Detections, Selection, select
from cgdb.ingest.frames.recording import Frame
from cgdb.ingest.mapping import tidy
from cgdb.ingest.mapping.associate import Association, associate
from cgdb.ingest.mapping.clouds import object_rows, scene_of
from cgdb.ingest.mapping.consensus import Consensus, Opinions
from cgdb.ingest.mapping.fuse import VIEWS, Objects, claims
from cgdb.ingest.mapping.lift import Lifting, lift
from cgdb.ingest.mapping.oriented import extremes
from cgdb.ingest.mapping.presence import Presence
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
    consensus: Consensus = field(default_factory=Consensus)
    tidying: tidy.Tidying = field(default_factory=tidy.Tidying)

    def as_record(self) -> dict[str, Any]:
        """The same as plain values, for the provenance of a scene."""
        return asdict(self)


@dataclass(frozen=True, slots=True)
class Session:
    """One recording of the place. first: the number, in the map, of its frame 0."""

    recording: str
    first: int


class Mapper:
    """A map in the making. Give it frames in any order and number; ask for the scene at any time.

    sessions: the recordings so far; frames are numbered on from one to the next.
    """

    def __init__(self, how: Mapping | None = None) -> None:
        self.how = how or Mapping()
        self._selection = replace(self.how.selection, skip_background=self.how.background == "skip")
        self.voxels = Voxels(self.how.voxel)
        self.objects = Objects(renormalise=self.how.renormalise, views=self.how.views, crops=self.how.crops)
        self.opinions = Opinions()
        self.frames = 0
        self.detections = 0
        self.newest = self.cared = -1
        self.sessions: list[Session] = []
        self.presence: Presence | None = None

    def begin(self, recording: str) -> None:
        """From now on frames are of another recording of the same place, in the same coordinates."""
        self.sessions.append(Session(recording, self.newest + 1))
        if len(self.sessions) > 1:
            clouds = zip(self.objects.all, object_rows(self), strict=True)
            things = {obj.id: self.voxels.mean_points(rows) for obj, rows in clouds if not obj.background and len(rows)}
            self.presence = Presence.of_clouds(things)

    def step(self, frame: Frame, found: Detections) -> None:
        """Take one frame in. The time that it takes depends on the frame, not on what is mapped already."""
        how = self.how
        if self.sessions and self.sessions[-1].first:
            frame = replace(frame, index=frame.index + self.sessions[-1].first)
        self.objects.features.check(found, frame.name)
        found = select(found, frame, self._selection)
        room = np.array([how.background == "merge" and label in BACKGROUND for label in found.labels], np.bool_)
        lifted = lift(frame, found, self.voxels, how.lifting, whole=room)
        room = room[lifted.source]
        if how.association.spatial.endswith("accurate") and len(lifted):
            start = np.searchsorted(lifted.owner, np.arange(len(lifted)))
            lifted = replace(lifted, extremes=extremes(self.voxels.cells[lifted.rows], start))
        matches = associate(lifted, found, self.objects, self.voxels, how.association, alone=room)
        self.opinions.watch(lifted, found.space, self.objects, self.voxels, room, how.consensus)
        went = self.objects.fuse(frame, found, lifted, matches.objects, room)
        for k in np.flatnonzero(matches.out_of >= 0).tolist():
            giver, taker = (self.objects.all[at].id for at in (int(matches.out_of[k]), int(went[k])))
            self.voxels.hand_over(lifted.rows[lifted.owner == k], giver, taker)
        rows, objects, strength = claims(lifted, self.objects.ids(went))
        self.voxels.vote(rows, objects, strength)
        self.voxels.last[rows] = self.frames
        if self.presence is not None:
            self.presence.watch(frame)
        self.frames += 1
        self.newest = max(self.newest, frame.index)
        self.detections += len(lifted)
        self._tidy()

    def finish(self) -> None:
        """Last care, when no more frames come: noise, duplicates and passing sights go."""
        tidy.denoise(self.voxels, self.frames + self.how.tidying.old + 1, self.how.tidying)
        self._merge()
        # Only now: two halves that were seen twice each are one thing that was seen four times.
        tidy.drop(self.objects, self.voxels, self.opinions, self.how.tidying)

    def scene(self, name: str, **about: Any) -> SceneGraph:
        """The map as it is now, without the objects that were hardly seen yet.

        Of a place that was recorded several times, an object says in which recording it was seen last, and whether it
        is present: seen in the latest, or its place was seen empty. Neither, and nobody knows.
        """
        scene = scene_of(self, name, **about)
        sessions = [{"recording": session.recording, "first": session.first} for session in self.sessions]
        if sessions:
            scene = replace(scene, provenance={**scene.provenance, "sessions": sessions})
        if self.presence is None:
            return scene
        gone, latest = self.presence.gone(), self.sessions[-1]
        last = {obj.id: obj.last for obj in self.objects.all}
        made = []
        for obj in scene.objects:
            properties = dict(obj.properties)
            at = last[int(obj.id)]
            properties["last_session"] = next(s.recording for s in reversed(self.sessions) if s.first <= at)
            if at >= latest.first:
                properties["present"] = True
            elif obj.id in gone:
                properties["present"] = False
            made.append(replace(obj, properties=properties))
        return replace(scene, objects=tuple(made))

    def _tidy(self) -> None:
        how, done = self.how.tidying, self.frames
        if how.denoise_every and done % how.denoise_every == 0:
            tidy.denoise(self.voxels, self.frames, how)
        if how.filter_every and done % how.filter_every == 0:
            tidy.drop(self.objects, self.voxels, self.opinions, how)
        if how.merge_every and done % how.merge_every == 0:
            self._merge(since=self.cared)
            self.cared = self.newest

    def _merge(self, since: int | None = None) -> None:
        how = self.how
        tidy.merge(self.objects, self.voxels, self.opinions, how.tidying, how.consensus, since=since)
