"""7-Scenes: frame-NNNNNN.color.png, .depth.png (mm, 65535 where unknown), .pose.txt (camera to world)."""

from __future__ import annotations

from pathlib import Path

from cgdb.errors import FormatError
from cgdb.ingest.frames import poses
from cgdb.ingest.frames.folder import COLOR, files, shot
from cgdb.ingest.frames.recording import Recording


def matches(root: Path) -> bool:
    """Files of these names, here or in the first of seq-01, seq-02, ..."""
    return any(True for _ in root.glob("frame-*.pose.txt"))


def read(root: Path) -> Recording:
    """The recording of one sequence. The camera is the Kinect's with the focal length that its authors give."""
    shots = []
    for color in files(root, COLOR, "frame-*.color.*"):
        stem = color.name.partition(".")[0]
        path = root / f"{stem}.pose.txt"
        pose, missing = None, "no pose"
        if path.is_file():
            try:
                pose = poses.matrix(poses.numbers(poses.text_of(path), path.name), path.name)
            except FormatError:
                missing = "the pose is no matrix of numbers"
        shots.append(shot(color, root / f"{stem}.depth.png", pose, missing=missing))
    return Recording(
        layout="7scenes",
        root=root,
        shots=shots,
        K=poses.intrinsics(585.0, 585.0, 320.0, 240.0),
        size=(640, 480),
        depth_scale=1000.0,
        invalid_above=65.0,
        up="-y",
    )
