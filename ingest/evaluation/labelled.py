"""Truth as a labelled cloud: which class, and which object, each point of the true surfaces belongs to.

Read from a plain .npz, a PLY with labels, the folder of a generated sequence, ScanNet's annotation, or a scene folder
of Replica or ScanNet.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from cgdb.errors import CgdbError, FormatError, UsageError
from cgdb.ingest.arrays import of_archive
from cgdb.ingest.evaluation import ply, scannet
from cgdb.ingest.evaluation.names import NYU40_LABELS, NYU40_NAMES, ClassNames, read
from cgdb.scene import LARGEST_COORDINATE

Ints = NDArray[np.intp]

LARGEST_ARRAYS = 8 << 30
_LABELS = ("label", "labels", "class_id", "class", "semantic", "semantic_label")
_INSTANCES = ("instance", "instance_id", "object_id", "objectid", "instances")


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class LabelledCloud:
    """points (n, 3) float32 m. labels (n,) index into names, -1 for none. owner (n,) index of the true object, -1 for
    none, or None where the truth knows no objects; then of each of m: ids, kinds (class, -1 unknown), called (what
    people called it, empty where that is not told), frames (in how many it was seen, None where unknown), room (whether
    it is wall, floor or ceiling, None where names must tell). vectors (k, d): of the names' texts, in the space of the
    features."""

    points: NDArray[np.float32]
    labels: Ints
    names: tuple[str, ...]
    owner: Ints | None = None
    ids: tuple[int, ...] = ()
    kinds: Ints | None = None
    called: tuple[str, ...] = ()
    frames: Ints | None = None
    room: NDArray[np.bool_] | None = None
    vectors: NDArray[np.float32] | None = None

    def moved(self, pose: NDArray[np.float64]) -> LabelledCloud:
        """The cloud in another frame, by a 4 x 4 transformation of its points."""
        return replace(self, points=(self.points @ pose[:3, :3].T + pose[:3, 3]).astype(np.float32))


def read_labelled(path: str | Path, names: ClassNames | None = None) -> LabelledCloud:
    """The truth at a path. FormatError says in one line what is wrong with it."""
    path = Path(path)
    if not path.exists():
        raise UsageError(f"there is no truth at {path}")
    try:
        if path.is_dir():
            return _folder(path, names)
        if path.suffix == ".npz":
            arrays = arrays_of(path)
            return _generated(path, arrays) if "vox_pts" in arrays else _plain(path, arrays, names)
        if path.suffix == ".ply":
            return _ply(path, names)
        if path.name.endswith(scannet.ENDING):
            return _scannet(path, names)
    except CgdbError as error:
        if not error.message.startswith(str(path)):
            error.message = f"{path}: {error.message}"
        raise
    raise FormatError(f"{path}: is no truth that is known", hint="a .npz, a .ply, or the folder of a sequence")


def is_cloud(path: Path) -> bool:
    """Whether a file is a labelled cloud, going by its name."""
    return path.suffix in (".npz", ".ply") or path.name.endswith(scannet.ENDING)


def _folder(path: Path, names: ClassNames | None) -> LabelledCloud:
    found = truth_in(path)
    if found is None:
        raise FormatError(
            f"{path}: this folder holds no truth",
            hint="objects.npz, mesh_semantic.ply, *.aggregation.json, *_vh_clean_2.labels.ply or truth.*",
        )
    return read_labelled(found, names)


def truth_in(folder: Path) -> Path | None:
    """The labelled cloud that lies in a folder, if there is one and only one."""
    for name in ("objects.npz", "habitat/mesh_semantic.ply", "mesh_semantic.ply"):
        if (folder / name).is_file():
            return folder / name
    annotated = scannet.aggregation_in(folder)
    if annotated is not None:
        return annotated
    found = sorted(folder.glob(f"*{NYU40_LABELS}")) or sorted(folder.glob("truth.*"))
    return found[0] if len(found) == 1 else None


def arrays_of(path: Path) -> dict[str, NDArray[Any]]:
    """{name: array} of a .npz; never objects, and never more than LARGEST_ARRAYS."""
    try:
        return of_archive(path, most=LARGEST_ARRAYS)
    except FileNotFoundError as error:
        raise FormatError(f"{path}: is not there") from error
    except FormatError as error:
        raise FormatError(f"{path}: holds no arrays that can be read: {error.message.partition(': ')[2]}") from error


def _generated(path: Path, arrays: Mapping[str, NDArray[Any]]) -> LabelledCloud:
    """objects.npz of a generated sequence: objects count from 1, and their class names lie beside."""
    wanted = ("vox_pts", "vox_id", "is_bg", "frames_seen")
    missing = [name for name in wanted if name not in arrays]
    if missing:
        raise FormatError(f"has no array '{missing[0]}'")
    points = points_of(arrays["vox_pts"])
    owner = _whole(arrays["vox_id"], "vox_id", len(points)) - 1
    count = len(arrays["is_bg"])
    if len(owner) and not -1 <= owner.min() <= owner.max() < count:
        raise FormatError("a point is of an object that there is not")
    kinds = _whole(arrays["cls"], "cls", count) if "cls" in arrays else np.full(count, -1, np.intp)
    names: tuple[str, ...] = ()
    for file in sorted(path.parent.glob("gsa_classes_*.json")):
        if not file.stem.endswith("_colors"):
            told = read(file).classes
            names = tuple(told.get(number, str(number)) for number in range(max(told) + 1))
            break
    if not names:
        names = tuple(str(number) for number in range(int(kinds.max(initial=-1)) + 1))
    if kinds.max(initial=-1) >= len(names):
        raise FormatError("an object is of a class that there is not")
    return LabelledCloud(
        points=points,
        labels=np.where(owner >= 0, kinds[owner], -1),
        names=names,
        owner=owner,
        ids=tuple(range(1, count + 1)),
        kinds=kinds,
        frames=_whole(arrays["frames_seen"], "frames_seen", count),
        room=arrays["is_bg"].astype(bool),
        vectors=_prototypes(arrays["feats"], kinds, len(names)) if "feats" in arrays else None,
    )


def _prototypes(features: NDArray[Any], kinds: Ints, count: int) -> NDArray[np.float32]:
    """(count, d) the mean true feature of each class: its texts, made at random, are not in the space of features."""
    rows = _vectors(features, len(kinds))
    found = np.zeros((count, rows.shape[1]), np.float32)
    np.add.at(found, kinds[kinds >= 0], rows[kinds >= 0])
    return found


def _plain(path: Path, arrays: Mapping[str, NDArray[Any]], given: ClassNames | None) -> LabelledCloud:
    if "points" not in arrays:
        raise FormatError("has no array 'points'")
    points = points_of(arrays["points"])
    names = given
    if "names" in arrays:
        told = arrays["names"]
        if told.dtype.kind != "U" or told.ndim != 1:
            raise FormatError(f"its names are {told.dtype} of shape {told.shape}, expected a row of text")
        names = ClassNames(classes=dict(enumerate(told.tolist())))
    found = _labelled(
        points,
        _whole(arrays["labels"], "labels", len(points)) if "labels" in arrays else None,
        _whole(arrays["instances"], "instances", len(points)) if "instances" in arrays else None,
        names,
    )
    if "vectors" not in arrays:
        return found
    if "names" not in arrays:
        raise FormatError("has vectors but no names")
    return replace(found, vectors=_vectors(arrays["vectors"], len(arrays["names"])))


def _ply(path: Path, names: ClassNames | None) -> LabelledCloud:
    mesh = ply.read(path)
    vertices = _vertices(mesh)
    columns, points = mesh.vertex, vertices
    label, instance = _column(columns, _LABELS), _column(columns, _INSTANCES)
    if label is None and instance is None and mesh.corners is not None:
        # Replica keeps the object with the faces: the middle of each is a point of its surface.
        columns = mesh.face
        label, instance = _column(columns, _LABELS), _column(columns, _INSTANCES)
        points = vertices[mesh.corners].mean(axis=1) if mesh.corners.shape[1] else vertices[:0]
    if label is None and instance is None:
        raise FormatError(
            f"neither its vertices nor its faces have labels, but {', '.join(sorted(columns)) or 'nothing'}",
            hint=f"a property {_LABELS[0]} or {_INSTANCES[0]}",
        )
    beside = path.with_name("info_semantic.json")
    if names is None and beside.is_file():
        names = read(beside)
    if names is None and path.name.endswith(NYU40_LABELS):
        names = NYU40_NAMES
    return _labelled(
        points_of(points),
        None if label is None else _whole(label, "the label", len(points)),
        None if instance is None else _whole(instance, "the instance", len(points)),
        names,
    )


def _scannet(path: Path, names: ClassNames | None) -> LabelledCloud:
    """An annotated scan. Classes are those of its labels, NYU40 unless named otherwise, or else what people wrote."""
    scan = scannet.read(path)
    points, label = points_of(_vertices(scan.mesh)), _column(scan.mesh.vertex, _LABELS)
    labels = None if label is None else _whole(label, "the label", len(points))
    if labels is None:
        words = sorted(set(scan.called.values()))
        kinds = {known: words.index(word) for known, word in scan.called.items()}
        names = ClassNames(classes=dict(enumerate(words)), objects=kinds)
    found = _labelled(points, labels, scan.instances, names or NYU40_NAMES)
    return replace(found, called=tuple(scan.called[known] for known in found.ids))


def _vertices(mesh: ply.Ply) -> NDArray[np.float64]:
    """(n, 3) m."""
    return np.stack([mesh.vertex[axis].astype(np.float64) for axis in "xyz"], axis=1)


def _column(columns: Mapping[str, NDArray[Any]], known: Sequence[str]) -> NDArray[Any] | None:
    return next((columns[name] for name in known if name in columns), None)


def _labelled(
    points: NDArray[np.float32], labels: Ints | None, instances: Ints | None, names: ClassNames | None
) -> LabelledCloud:
    """Class and object numbers of any kind to indices. A class without a name is unlabelled where there are names."""
    if labels is None and instances is None:
        raise FormatError("says neither the class nor the object of its points", hint="labels, instances, or both")
    if labels is None and names is not None and names.objects:
        assert instances is not None
        labels = _looked_up(instances, names.objects)
    if labels is None:
        labels = np.full(len(points), -1, np.intp)
    if names is None:
        names = ClassNames(classes={int(number): str(number) for number in np.unique(labels[labels >= 0])})
    rows = {number: row for row, number in enumerate(sorted(names.classes))}
    labels = _looked_up(labels, rows)
    told = tuple(names.classes[number] for number in sorted(names.classes))
    if instances is None:
        return LabelledCloud(points=points, labels=labels, names=told)
    ids, owner = np.unique(instances, return_inverse=True)
    none = int(np.searchsorted(ids, 0))  # negative numbers are no objects
    ids, owner = ids[none:], owner.reshape(-1) - none
    return LabelledCloud(
        points=points,
        labels=labels,
        names=told,
        owner=np.maximum(owner, -1),
        ids=tuple(ids.tolist()),
        kinds=_most_common(owner, labels, len(ids)),
    )


def _most_common(owner: Ints, labels: Ints, count: int) -> Ints:
    """(count,) the class that most labelled points of each object have, -1 without any."""
    some = (owner >= 0) & (labels >= 0)
    pairs, votes = np.unique(np.stack([owner[some], labels[some]], axis=1), axis=0, return_counts=True)
    found = np.full(count, -1, np.intp)
    order = np.lexsort((-pairs[:, 1], votes))  # the most, and of equals the first class, comes last
    found[pairs[order, 0]] = pairs[order, 1]
    return found


def _looked_up(values: Ints, table: Mapping[int, int]) -> Ints:
    """table[value] of each, -1 where it has none."""
    numbers, place = np.unique(values, return_inverse=True)
    return np.array([table.get(number, -1) for number in numbers.tolist()], np.intp)[place.reshape(-1)]


def points_of(values: NDArray[Any]) -> NDArray[np.float32]:
    """(n, 3) float32 m, checked. FormatError for anything that is no cloud."""
    if values.ndim != 2 or values.shape[1] != 3 or values.dtype.kind not in "fiu":
        raise FormatError(f"its points are {values.dtype} of shape {values.shape}, expected numbers (n, 3)")
    if not len(values):
        raise FormatError("holds no points")
    if not np.isfinite(values).all() or np.abs(values).max() > LARGEST_COORDINATE:
        raise FormatError("its points hold coordinates that are no metres: NaN, infinite or too large")
    return values.astype(np.float32)


def _whole(values: NDArray[Any], what: str, count: int) -> Ints:
    if values.shape != (count,):
        raise FormatError(f"{what} has shape {values.shape}, expected ({count},)")
    if values.dtype.kind == "f" and np.isfinite(values).all() and (values == np.floor(values)).all():
        values = values.astype(np.int64)
    if values.dtype.kind not in "iu" or (len(values) and int(values.max()) >= 2**62):
        raise FormatError(f"{what} must hold whole numbers, not {values.dtype}")
    return values.astype(np.intp)


def _vectors(values: NDArray[Any], count: int) -> NDArray[np.float32]:
    if values.ndim != 2 or len(values) != count or values.dtype.kind != "f" or not np.isfinite(values).all():
        raise FormatError(f"its vectors are {values.dtype} of shape {values.shape}, expected finite ({count}, d)")
    return values.astype(np.float32)
