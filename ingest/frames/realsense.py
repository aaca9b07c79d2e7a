"""RealSense as the reference's manipulator recorded it: rgb/*.jpg, depth/*.png (mm), poses/*.npy; camera like OpenGL's.

The camera is the reference's own at 1920 x 1080; another is given with --intrinsics.
"""

from __future__ import annotations

from pathlib import Path

from cgdb.ingest.frames import poses
from cgdb.ingest.frames.folder import shots_of_folders
from cgdb.ingest.frames.record3d import turned
from cgdb.ingest.frames.recording import Recording
from cgdb.ingest.frames.redwood import up_of


def matches(root: Path) -> bool:
    """The three folders, with poses as arrays."""
    return all((root / name).is_dir() for name in ("rgb", "depth")) and any(True for _ in root.glob("poses/*.npy"))


def read(root: Path) -> Recording:
    """The recording; which way is up is told by how the camera was held."""
    shots = shots_of_folders(root / "rgb", root / "depth", root / "poses", convert=turned)
    return Recording(
        layout="realsense",
        root=root,
        shots=shots,
        K=poses.intrinsics(1366.197, 1365.919, 979.791, 553.78),
        size=(1920, 1080),
        depth_scale=1000.0,
        up=up_of([shot.pose for shot in shots if shot.pose is not None]),
        notes=("intrinsics: the camera of the reference's recording",),
    )
