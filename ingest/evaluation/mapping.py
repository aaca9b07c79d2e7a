"""How good a map is, against the whole truth: objects found, missed and doubled, purity and completeness of clouds.

A point of the map belongs to the true object whose surface is nearest to it, if that is within `reach`. A mapped object
shows the true object that most of its points belong to; purity is that share. A true object is found where a mapped
one shows it, missed where none does, and every further one is a duplicate; its match is the one with most of its
points. Completeness is the share of a found object's true surface, as far as any frame saw it, that has a point of the
objects that show it within `near`. The box of a match is compared with the upright box round that true surface. Of the
mapped points on true things, the share that the match of their thing holds is the accuracy of association: a point in
the wrong object and a point in a duplicate both cost. This is the object-level view of Section II-A of the paper, which
itself scores maps only through classes (Table II) and people (Table I).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from cgdb.errors import FormatError
from cgdb.ingest.evaluation.box_overlap import overlaps
from cgdb.ingest.evaluation.labelled import LabelledCloud, read_labelled
from cgdb.ingest.evaluation.nearest import nearest
from cgdb.ingest.mapping.upright import upright_box
from cgdb.ingest.relations.relate import boxes_of
from cgdb.meaning.vocabulary import fold
from cgdb.scene import ObjectId, SceneGraph, SceneObject

REACH = 0.05
NEAR = 0.05
LEAST_SEEN = 3
"""Frames in which a true object must have been seen to be one that a map can be asked for."""
MOST_OBJECTS = 50_000
ROOM = frozenset({"wall", "walls", "floor", "ceiling", "room", "other", "undefined", "unknown", "unlabeled"})
"""Names of true objects that are no things."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Truth:
    """points (n, 3) float32 m of all true surfaces that were seen, owner (n,) the true object of each, from 0, or -1;
    things (k,) bool: which are things, not the room; frames (k,): in how many frames each was seen; names: its class;
    ids: as the truth counts them."""

    points: NDArray[np.float32]
    owner: NDArray[np.intp]
    things: NDArray[np.bool_]
    frames: NDArray[np.intp]
    names: tuple[str, ...] = ()
    ids: tuple[int, ...] = ()


@dataclass(frozen=True, slots=True, kw_only=True)
class ObjectScore:
    """One true object. shown_by: the mapped objects that show it, its match first; purity, box_iou and tag: of the
    match. named: whether the match bears the true name; None where the truth has no name or the match no tag."""

    id: int
    name: str
    frames: int
    shown_by: tuple[ObjectId, ...] = ()
    purity: float | None = None
    completeness: float | None = None
    box_iou: float | None = None
    tag: str | None = None
    named: bool | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class Score:
    """The figures of one map. purity: mean over mapped, completeness and box_iou: over found, objects. strangers:
    mapped objects that show no thing. association: of mapped points on things. labels: share of matches that bear
    the true name, of those of which it can be told."""

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
    box_iou: float = 0.0
    association: float = 0.0
    labels: float | None = None
    strangers: tuple[ObjectId, ...] = ()
    objects: tuple[ObjectScore, ...] = ()

    def to_json(self) -> dict[str, Any]:
        """Plain values."""
        return asdict(self)


def read_truth(root: Path) -> Truth:
    """The truth of a generated sequence (objects.npz in its folder), or any other labelled cloud that has objects.

    FormatError where there is none.
    """
    path = root / "objects.npz" if root.is_dir() and (root / "objects.npz").exists() else root
    return truth_of(read_labelled(path), str(path))


def truth_of(cloud: LabelledCloud, where: str = "the truth") -> Truth:
    """The objects of a labelled cloud. Where it does not say which are the room, their names do."""
    if cloud.owner is None or cloud.kinds is None:
        raise FormatError(
            f"{where}: says the class of its points, but not the object, which this needs",
            hint="instances in the .npz, or instance with the vertices of the .ply; eval semseg needs classes only",
        )
    if len(cloud.kinds) > MOST_OBJECTS:
        raise FormatError(
            f"{where}: names {len(cloud.kinds):,} objects, more than {MOST_OBJECTS:,}; are these instances?"
        )
    names = tuple(cloud.names[kind] if kind >= 0 else "" for kind in cloud.kinds.tolist())
    room = np.array([fold(name) in ROOM for name in names], np.bool_) if cloud.room is None else cloud.room
    return Truth(
        points=cloud.points,
        owner=cloud.owner,
        things=~room,
        frames=np.full(len(names), LEAST_SEEN, np.intp) if cloud.frames is None else cloud.frames,
        names=names,
        ids=cloud.ids,
    )


def evaluate(
    scene: SceneGraph, truth: Truth, *, least_seen: int = LEAST_SEEN, reach: float = REACH, near: float = NEAR
) -> Score:
    """The score of a map's things; its background is not looked at. reach, near: metres."""
    objects = [o for o in scene.objects if o.points is not None and not o.properties.get("background")]
    clouds = [o.points for o in objects if o.points is not None]
    sizes = np.array([len(cloud) for cloud in clouds], np.intp)
    points = np.concatenate(clouds) if clouds else np.zeros((0, 3), np.float32)
    begin = np.concatenate([[0], np.cumsum(sizes)])
    votes = _votes(points, np.repeat(np.arange(len(clouds)), sizes), len(clouds), truth, reach)
    n = len(truth.things)
    most = votes[:, :n].max(axis=1, initial=0)
    shows = np.where(most > 0, votes[:, :n].argmax(axis=1) if n else -1, -1)
    purity = most / np.maximum(sizes, 1)
    owned = np.argsort(truth.owner, kind="stable")
    bounds = np.searchsorted(truth.owner[owned], np.arange(n + 1))
    scored: list[ObjectScore] = []
    fine: list[float] = []
    matched = 0
    for which in np.flatnonzero(truth.things & (truth.frames >= least_seen)).tolist():
        mine = np.flatnonzero(shows == which)
        mine = mine[np.argsort(-votes[mine, which], kind="stable")]
        surface = truth.points[owned[bounds[which] : bounds[which + 1]]]
        name = truth.names[which] if truth.names else ""
        known = truth.ids[which] if truth.ids else which
        if not len(mine) or not len(surface):
            scored.append(ObjectScore(id=known, name=name, frames=int(truth.frames[which])))
            continue
        distance, _ = nearest(surface, np.concatenate([points[begin[m] : begin[m + 1]] for m in mine]), near)
        best = objects[mine[0]]
        matched += int(votes[mine[0], which])
        fine.append(float((distance < near / 2).mean()))
        scored.append(
            ObjectScore(
                id=known,
                name=name,
                frames=int(truth.frames[which]),
                shown_by=tuple(objects[m].id for m in mine.tolist()),
                purity=float(purity[mine[0]]),
                completeness=float((distance < near).mean()),
                box_iou=_box_iou(best, surface, scene.up),
                tag=best.tag,
                named=fold(best.tag) == fold(name) if best.tag and name else None,
            )
        )
    real = truth.things[shows] & (shows >= 0) if n else np.zeros(len(shows), bool)
    on_things = votes[:, :n][:, truth.things & (truth.frames >= least_seen)].sum()
    found = [one for one in scored if one.shown_by]
    return Score(
        true=len(scored),
        found=len(found),
        missed=len(scored) - len(found),
        duplicates=int(real.sum() - len(np.unique(shows[real]))),
        mapped=len(clouds),
        purity=_mean(purity.tolist()),
        worst_purity=float(purity.min(initial=1.0)) if len(purity) else 0.0,
        completeness=_mean([one.completeness for one in found]),
        completeness_fine=_mean(fine),
        points=len(points),
        box_iou=_mean([one.box_iou for one in found]),
        association=matched / int(on_things) if on_things else 0.0,
        labels=_mean([one.named for one in found], None),
        strangers=tuple(o.id for o, thing in zip(objects, real.tolist(), strict=True) if not thing),
        objects=tuple(scored),
    )


def _votes(
    points: NDArray[np.float32], of: NDArray[np.intp], count: int, truth: Truth, reach: float
) -> NDArray[np.int64]:
    """(count, k + 1): how many points of each mapped object lie on each true one, and last on none."""
    _, nearest_true = nearest(points, truth.points, reach)
    label = np.full(len(points), -1, np.intp)
    label[nearest_true >= 0] = truth.owner[nearest_true[nearest_true >= 0]]
    votes = np.zeros((count, len(truth.things) + 1), np.int64)
    np.add.at(votes, (of, label), 1)
    return votes


def _box_iou(obj: SceneObject, surface: NDArray[np.float32], up: str) -> float | None:
    """Of the box that the map states, or the one round its points, with the one round the true surface."""

    def boxed(points: NDArray[np.float32]) -> SceneObject:
        center, extent, rotation = upright_box(points, up)
        return SceneObject(id=0, center=center, extent=extent, rotation=rotation)

    if obj.extent is None:
        if obj.points is None or not len(obj.points):
            return None
        obj = boxed(obj.points)
    return float(overlaps(boxes_of([obj]), boxes_of([boxed(surface)]), up).iou.sum())


def _mean(values: Sequence[float | None], empty: Any = 0.0) -> Any:
    told = [float(value) for value in values if value is not None]
    return float(np.mean(told)) if told else empty
