"""HM3D as OpenEQA renders it: N-rgb.png, N-depth.png (1/6553.5 m), N.txt (4 x 4), intrinsic_color.txt, one folder.

Habitat's cameras and world are turned as in `hm3d`.
"""

from __future__ import annotations

from pathlib import Path

from cgdb.ingest.frames import pictures, poses
from cgdb.ingest.frames.folder import files, pose_of_file, shot
from cgdb.ingest.frames.record3d import turned
from cgdb.ingest.frames.recording import Recording


def matches(root: Path) -> bool:
    """Files N-rgb.png beside intrinsic_color.txt."""
    return (root / "intrinsic_color.txt").is_file() and any(True for _ in root.glob("*-rgb.png"))


def read(root: Path) -> Recording:
    """The recording of such a folder."""
    lens = root / "intrinsic_color.txt"
    values = poses.numbers(poses.text_of(lens), str(lens))
    shots = []
    for color in files(root, (".png",), "*-rgb.png"):
        stem = color.stem.removesuffix("-rgb")
        lies = root / f"{stem}.txt"
        pose, missing = pose_of_file(lies) if lies.is_file() else (None, "no pose")
        shots.append(shot(color, root / f"{stem}-depth.png", None if pose is None else turned(pose), missing=missing))
    return Recording(
        layout="hm3d-openeqa",
        root=root,
        shots=shots,
        K=(values.reshape(3, 3) if values.size == 9 else poses.matrix(values, str(lens))[:3, :3]).copy(),
        size=pictures.size_of_any(shot.color for shot in shots[:20]),
        depth_scale=6553.5,
        up="-y",
    )
