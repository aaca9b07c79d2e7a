"""Redwood and Open3D: color or image/*.jpg, depth/*.png (mm), and a trajectory .log with five lines per frame.

The first of the five says "frame frame frame+1" (or any three numbers, the last counting frames); the other four are
the camera-to-world matrix. Worlds of this kind have no fixed up; y down is what a camera held level gives.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from cgdb.errors import FormatError
from cgdb.ingest import strict_json
from cgdb.ingest.frames import poses
from cgdb.ingest.frames.folder import COLOR, DEPTH, files, key_of, shot
from cgdb.ingest.frames.recording import Recording

LOGS = ("trajectory.log", "scene/trajectory.log")


def matches(root: Path) -> bool:
    """A trajectory.log beside depth."""
    return any((root / name).is_file() for name in LOGS) and (root / "depth").is_dir()


def read(root: Path) -> Recording:
    """The recording; the camera is a PrimeSense unless a camera*.json or intrinsic.json says otherwise."""
    log = next((root / name for name in LOGS if (root / name).is_file()), root / LOGS[0])
    found = poses_of_log(log)
    folder = next((root / name for name in ("color", "image", "rgb") if (root / name).is_dir()), root / "color")
    colors, depths = files(folder, COLOR), files(root / "depth", DEPTH)
    if len(colors) != len(depths):
        raise FormatError(f"{root}: {len(colors)} colour pictures but {len(depths)} depth pictures")
    lens, size = _camera(root)
    first = int(key_of(colors[0])) if colors and key_of(colors[0]).isdigit() else 0
    return Recording(
        layout="redwood",
        root=root,
        shots=[
            shot(color, depth, found.get(number), missing="no pose in the trajectory")
            for number, (color, depth) in enumerate(zip(colors, depths, strict=True), start=0 if first < 2 else first)
        ],
        K=lens,
        size=size,
        depth_scale=1000.0,
        up=up_of([pose for pose in found.values() if poses.fault(pose) is None]),
    )


def poses_of_log(path: Path) -> dict[int, NDArray[np.float64]]:
    """{frame: camera-to-world (4, 4)} of a trajectory in five-line records."""
    lines = [line for line in poses.text_of(path).splitlines() if line.strip()]
    if len(lines) % 5:
        raise FormatError(f"{path}: has {len(lines)} lines, which is no multiple of five")
    made = {}
    for start in range(0, len(lines), 5):
        head = poses.numbers(lines[start], f"{path}: record {start // 5}")
        values = poses.numbers(" ".join(lines[start + 1 : start + 5]), f"{path}: record {start // 5}")
        if not len(head) or values.size != 16 or not np.isfinite(head).all():
            raise FormatError(f"{path}: record {start // 5} is no frame number and 4 x 4 matrix")
        made[int(head[0])] = values.reshape(4, 4)
    return made


def up_of(found: list[NDArray[np.float64]]) -> str:
    """The axis of the map that is up, from how the cameras were held: against their mean down."""
    if not found:
        return "z"
    down = np.mean([pose[:3, 1] for pose in found], axis=0)
    axis = int(np.abs(down).argmax())
    return ("-" if down[axis] > 0 else "") + "xyz"[axis]


def _camera(root: Path) -> tuple[NDArray[np.float64], tuple[int, int]]:
    for folder in (root, root.parent):
        for path in sorted([*folder.glob("camera*.json"), *folder.glob("intrinsic.json")]):
            return poses.open3d_intrinsics(strict_json.parse(poses.text_of(path)), str(path))
    return poses.intrinsics(525.0, 525.0, 319.5, 239.5), (640, 480)
