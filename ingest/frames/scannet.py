"""ScanNet as its reader exports it: color/*.jpg, depth/*.png (mm), pose/*.txt, intrinsic/intrinsic_color.txt.

Depth is smaller than colour, and seen from a camera a little aside; colour is brought to the size of the depth.
Poses that the tracking lost are written as -inf.
"""

from __future__ import annotations

from pathlib import Path

from cgdb.ingest.frames import pictures, poses
from cgdb.ingest.frames.folder import shots_of_folders
from cgdb.ingest.frames.recording import Recording


def matches(root: Path) -> bool:
    """The folder intrinsic beside color, depth and pose."""
    return (root / "intrinsic" / "intrinsic_color.txt").is_file() and (root / "color").is_dir()


def read(root: Path) -> Recording:
    """The recording, with the intrinsics of the colour camera, which the depth was aligned to."""
    path = root / "intrinsic" / "intrinsic_color.txt"
    shots = shots_of_folders(root / "color", root / "depth", root / "pose")
    return Recording(
        layout="scannet",
        root=root,
        shots=shots,
        K=poses.matrix(poses.numbers(poses.text_of(path), str(path)), str(path))[:3, :3].copy(),
        size=pictures.size_of_any(shot.color for shot in shots[:20]),
        depth_scale=1000.0,
    )
