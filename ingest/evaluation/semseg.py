"""Open-vocabulary semantic segmentation of a map, scored as in the paper (Section III-C, Table II).

Every object is of one class: the one whose text is nearest to its feature (cosine), among the classes that are in the
truth of its scene and not left out. Every point of a cloud then takes the class of its nearest object point, and is
held against the class of its nearest true point; points whose true class is not scored are not looked at. mAcc is the
mean over classes of recall, F-mIoU the mean IoU weighted by the true points of each class. "all" sums the confusion
over scenes before it is scored. The cloud is the truth's own points, the map's, or one that is given: the released code
takes that of its RGB-D SLAM, which gives the same result as the truth's where both cover the same surfaces evenly.

It differs from the released code where that has a defect: F1 there is wrong wherever precision and recall add up to
less than 1, and what has no class (no feature, no known tag, beyond `within`) cannot be said there; here it is counted
as wrong.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from cgdb.errors import SceneError, UsageError, did_you_mean, one_of
from cgdb.ingest.evaluation.labelled import LabelledCloud
from cgdb.ingest.evaluation.nearest import nearest
from cgdb.meaning.vocabulary import fold
from cgdb.scene import SceneObject

EXCLUDED = {
    "0": (),
    "1": ("other",),
    "4": ("other", "floor", "wall", "ceiling"),
    "6": ("other", "floor", "wall", "ceiling", "door", "window"),
}
"""The paper's n_exclude: how many classes are not scored; its figures are those of 6."""
STEPS = (0.15, 0.25, 0.5, 0.75)
Floats = NDArray[np.float64]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Confusion:
    """counts (k, k + 1): points by true class and the class that the map gives them, last none. names (k,)."""

    names: tuple[str, ...]
    counts: NDArray[np.int64]


@dataclass(frozen=True, slots=True, kw_only=True)
class ClassScore:
    """One class. points: true ones. f1: 0 where nothing is right."""

    name: str
    points: int
    predicted: int
    recall: float
    precision: float
    iou: float
    f1: float


@dataclass(frozen=True, slots=True, kw_only=True)
class SegmentationScore:
    """macc, miou, precision, f1: means over the classes that have true points; fmiou: weighted by their points.
    above: {IoU: how many classes have more}. unlabelled: share of points to which the map gives no class."""

    macc: float
    fmiou: float
    miou: float
    precision: float
    f1: float
    points: int
    unlabelled: float
    above: dict[float, int]
    classes: tuple[ClassScore, ...]


def left_out(given: str, names: Sequence[str]) -> NDArray[np.bool_]:
    """(k,) which classes are not scored: one of EXCLUDED, or names with commas. UsageError for one there is not."""
    if given in EXCLUDED:
        wanted = {fold(name) for name in EXCLUDED[given]}
    else:
        wanted = {fold(name) for name in given.split(",") if name.strip()}
        known = {fold(name): name for name in names}
        for name in sorted(wanted - known.keys()):
            raise UsageError(
                f"--exclude: the truth has no class '{name[:40]}'",
                hint=did_you_mean(name, known.values()) or f"0, 1, 4, 6, or some of {one_of(names, most=6)}",
            )
    return np.array([fold(name) in wanted for name in names], np.bool_)


def classes_by_feature(
    objects: Sequence[SceneObject], space: str, vectors: NDArray[np.float32], allowed: NDArray[np.bool_]
) -> NDArray[np.intp]:
    """(m,) the class of each object, -1 without a feature. vectors (k, d): of the classes' texts, any length."""
    texts = vectors.astype(np.float64)
    texts /= np.maximum(np.linalg.norm(texts, axis=1, keepdims=True), 1e-12)
    found = np.full(len(objects), -1, np.intp)
    for row, obj in enumerate(objects):
        feature = obj.features.get(space)
        if feature is None or not feature.any() or not allowed.any():
            continue
        if feature.shape != texts.shape[1:]:
            raise SceneError(
                f"features of space '{space}' have {feature.shape[0]} dimensions, the classes' vectors "
                f"{texts.shape[1]}",
                hint="the vectors must come from the encoder that made the features",
            )
        # The feature's own length does not change which class is nearest.
        found[row] = int(np.where(allowed, texts @ feature.astype(np.float64), -np.inf).argmax())
    return found


def classes_by_tag(
    objects: Sequence[SceneObject], names: Sequence[str], allowed: NDArray[np.bool_]
) -> NDArray[np.intp]:
    """(m,) the class of each object whose tag, or else one of its other tags, is the class's name; else -1."""
    rows = {fold(name): row for row, name in enumerate(names) if allowed[row]}
    found = np.full(len(objects), -1, np.intp)
    for row, obj in enumerate(objects):
        told = (rows.get(fold(tag)) for tag in (obj.tag, *obj.tags) if tag)
        found[row] = next((place for place in told if place is not None), -1)
    return found


def scored_objects(
    objects: Sequence[SceneObject], names: Sequence[str], allowed: NDArray[np.bool_]
) -> tuple[list[SceneObject], NDArray[np.intp]]:
    """(the objects that take part, (m,) the class of those whose class is settled, else -1).

    Walls, floor and ceiling, which the map knows to be background, are of the class that they are called; where that
    class is not scored they take no part, as in the paper.
    """
    taken = [obj for obj in objects if obj.points is not None and len(obj.points)]
    settled = classes_by_tag(taken, names, allowed)
    background = np.array([bool(obj.properties.get("background")) for obj in taken], np.bool_)
    keep = ~background | (settled >= 0)
    return [obj for obj, kept in zip(taken, keep, strict=True) if kept], np.where(background, settled, -1)[keep]


def confusion(
    objects: Sequence[SceneObject],
    classes: NDArray[np.intp],
    truth: LabelledCloud,
    scored: NDArray[np.bool_],
    *,
    cloud: NDArray[np.float32] | None = None,
    within: float | None = None,
) -> Confusion:
    """The points of a scene, counted. classes (m,): of the objects, -1 none. scored (k,): the classes that count.

    cloud: the points that are labelled, else the truth's own. within: metres beyond which a nearest point is none.
    """
    k = len(truth.names)
    true = truth.labels
    if cloud is not None:
        _, index = nearest(cloud, truth.points, within)
        true = np.where(index >= 0, truth.labels[index], -1)
    counted = np.flatnonzero((true >= 0) & scored[true])
    asked = (truth.points if cloud is None else cloud)[counted]
    clouds = [obj.points for obj in objects if obj.points is not None]
    points = np.concatenate(clouds) if clouds else np.zeros((0, 3), np.float32)
    owner = np.repeat(np.arange(len(clouds)), [len(one) for one in clouds])
    _, index = nearest(asked, points, within)
    given = np.full(len(asked), -1, np.intp)
    given[index >= 0] = classes[owner[index[index >= 0]]]
    counts = np.zeros((k, k + 1), np.int64)
    np.add.at(counts, (true[counted], np.where(given >= 0, given, k)), 1)
    return Confusion(names=truth.names, counts=counts)


def summed(parts: Sequence[Confusion]) -> Confusion:
    """The confusion of all scenes together: classes are the same where their names are."""
    names = tuple(dict.fromkeys(name for part in parts for name in part.names))
    rows = {name: row for row, name in enumerate(names)}
    counts = np.zeros((len(names), len(names) + 1), np.int64)
    for part in parts:
        mine = np.array([rows[name] for name in part.names], np.intp)
        np.add.at(counts, (mine[:, None], np.append(mine, len(names))[None, :]), part.counts)
    return Confusion(names=names, counts=counts)


def score(found: Confusion) -> SegmentationScore:
    """The figures. Classes without a true point are not scored; what is taken for them is wrong all the same."""
    k = len(found.names)
    right = np.diagonal(found.counts[:, :k]).astype(np.float64)
    true, predicted = found.counts.sum(axis=1), found.counts[:, :k].sum(axis=0)
    recall = right / np.maximum(true, 1)
    precision = right / np.maximum(predicted, 1)
    iou = right / np.maximum(true + predicted - right, 1)
    f1 = 2 * right / np.maximum(true + predicted, 1)
    there = np.flatnonzero(true > 0)
    total = int(true.sum())
    return SegmentationScore(
        macc=_mean(recall[there]),
        fmiou=float((iou * true).sum() / total) if total else 0.0,
        miou=_mean(iou[there]),
        precision=_mean(precision[there]),
        f1=_mean(f1[there]),
        points=total,
        unlabelled=float(found.counts[:, k].sum() / total) if total else 0.0,
        above={step: int((iou[there] > step).sum()) for step in STEPS},
        classes=tuple(
            ClassScore(
                name=found.names[row],
                points=int(true[row]),
                predicted=int(predicted[row]),
                recall=float(recall[row]),
                precision=float(precision[row]),
                iou=float(iou[row]),
                f1=float(f1[row]),
            )
            for row in there.tolist()
        ),
    )


def _mean(values: Floats) -> float:
    return float(values.mean()) if len(values) else 0.0


def to_json(one: SegmentationScore) -> dict[str, Any]:
    """Plain values."""
    return {
        "mAcc": one.macc,
        "F-mIoU": one.fmiou,
        "mIoU": one.miou,
        "mPrecision": one.precision,
        "mF1": one.f1,
        "points": one.points,
        "unlabelled": one.unlabelled,
        "IoU above": {str(step): count for step, count in one.above.items()},
        "classes": [
            {
                "class": c.name,
                "points": c.points,
                "predicted": c.predicted,
                "recall": c.recall,
                "precision": c.precision,
                "IoU": c.iou,
                "F1": c.f1,
            }
            for c in one.classes
        ],
    }
