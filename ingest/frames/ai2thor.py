"""AI2-THOR: color/*.png, depth/*.png (mm, nothing beyond 15 m), pose/*.txt, intrinsics.txt.

Unity's world is left-handed with y up, and so is its camera: x right, y up, z forward.
"""

from __future__ import annotations

from pathlib import Path

from cgdb.ingest.frames import poses
from cgdb.ingest.frames.folder import shots_of_folders
from cgdb.ingest.frames.recording import Recording


def matches(root: Path) -> bool:
    """intrinsics.txt beside the three folders."""
    return (root / "intrinsics.txt").is_file() and all((root / name).is_dir() for name in ("color", "depth", "pose"))


def read(root: Path) -> Recording:
    """The recording, with the world turned to z up."""
    path = root / "intrinsics.txt"
    values = poses.numbers(poses.text_of(path), str(path))
    lens = values.reshape(3, 3) if values.size == 9 else poses.matrix(values, str(path))[:3, :3].copy()
    return Recording(
        layout="ai2thor",
        root=root,
        shots=shots_of_folders(root / "color", root / "depth", root / "pose", convert=poses.from_left_handed),
        K=lens,
        size=None,
        depth_scale=1000.0,
        invalid_above=15.0,
        notes=("the world is Unity's with y and z exchanged",),
    )
