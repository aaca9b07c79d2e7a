"""Maps with clouds and their truths, labelled clouds: what ``cgdb eval mapping`` and ``semseg`` have in common."""

from __future__ import annotations

from argparse import Namespace
from pathlib import Path
from typing import TYPE_CHECKING

from cgdb.cli import render
from cgdb.cli.evaluate_scenes import Chosen
from cgdb.errors import FormatError, UsageError

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from cgdb.ingest.evaluation.labelled import LabelledCloud
    from cgdb.scene import SceneGraph


def truth_cloud(path: str, options: Namespace) -> LabelledCloud:
    """A truth with the names of its classes (--names), in the map's frame (--align)."""
    from cgdb.ingest.evaluation.labelled import read_labelled
    from cgdb.ingest.evaluation.names import class_names

    cloud = read_labelled(path, class_names(options.names) if options.names else None)
    return cloud.moved(_pose(Path(options.align))) if options.align else cloud


def _pose(path: Path) -> NDArray[np.float64]:
    """A 4 x 4 rigid transformation: four rows of four numbers, or the first line's sixteen."""
    import numpy as np

    try:
        lines = [line.split() for line in path.read_text("utf-8").splitlines() if line.strip()]
        rows = lines[:1] if lines and len(lines[0]) == 16 else lines[:4]
        pose = np.array([[float(number) for number in row] for row in rows]).reshape(4, 4)
    except OSError as error:
        raise UsageError(f"--align: {path} cannot be read: {error.strerror or error}") from None
    except ValueError:
        raise FormatError(f"{path}: holds no pose", hint="sixteen numbers, in one line or in four") from None
    rigid = np.isfinite(pose).all() and np.abs(pose[:3, :3] @ pose[:3, :3].T - np.eye(3)).max() < 1e-3
    if not rigid or np.abs(pose[3] - [0, 0, 0, 1]).max() > 1e-6:
        raise FormatError(f"{path}: the pose is no rotation and shift")
    return pose


def with_clouds(one: Chosen) -> SceneGraph:
    """The scene in memory. UsageError where none of its objects has points."""
    scene = one.read()
    if scene.objects and all(obj.points is None for obj in scene.objects):
        raise UsageError(
            f"{one.name}: no object of the scene has points",
            hint="cgdb map makes maps with clouds; eval graph needs none",
        )
    return scene


def note_apart(one: Chosen, scene: SceneGraph, truth: LabelledCloud, options: Namespace) -> None:
    """Say so where map and truth have no place in common: every figure is then about their frames, not the map."""
    clouds = [obj.points for obj in scene.objects if obj.points is not None and len(obj.points)]
    if not clouds:
        return
    below = any(min(float(cloud[:, k].min()) for cloud in clouds) > truth.points[:, k].max() for k in range(3))
    above = any(max(float(cloud[:, k].max()) for cloud in clouds) < truth.points[:, k].min() for k in range(3))
    if below or above:
        render.say(
            f"note: {one.name} and its truth lie apart: are both in one frame? --align brings one there", options.quiet
        )


def is_length(length: float) -> bool:
    """Whether it is one that points can lie apart; NaN is none."""
    return 1e-6 <= length <= 1e6
