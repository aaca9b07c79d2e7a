"""ICL-NUIM: rgb/*.png, depth/*.png (1/5000 m), *.gt.sim with three rows of four numbers per frame.

Its renderer is left-handed with y up, camera and world, which is why its authors give fy as -480.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from cgdb.errors import FormatError
from cgdb.ingest.frames import poses
from cgdb.ingest.frames.folder import COLOR, DEPTH, Fellows, files, shot
from cgdb.ingest.frames.recording import Recording


def matches(root: Path) -> bool:
    """A *.gt.sim beside rgb and depth."""
    return any(True for _ in root.glob("*.gt.sim")) and (root / "rgb").is_dir()


def read(root: Path) -> Recording:
    """The recording; pictures and poses are paired in order."""
    table = sorted(root.glob("*.gt.sim"))[0]
    values = poses.numbers(poses.text_of(table), str(table))
    if values.size % 12:
        raise FormatError(f"{table}: has {values.size} numbers, which is no multiple of 12")
    # The last row is 0 0 0 1: with another number in its corner every point would be divided by it.
    found = [np.vstack([rows, [0.0, 0.0, 0.0, 1.0]]) for rows in values.reshape(-1, 3, 4)]
    colors, depths = files(root / "rgb", COLOR), Fellows(files(root / "depth", DEPTH))
    if len(found) < len(colors):
        raise FormatError(f"{root}: {len(colors)} colour pictures but {len(found)} poses")
    return Recording(
        layout="icl",
        root=root,
        shots=[
            shot(path, depths.of(path) or root / "depth" / path.name, poses.from_left_handed(pose))
            for path, pose in zip(colors, found, strict=False)
        ],
        K=poses.intrinsics(481.2, 480.0, 319.5, 239.5),
        size=(640, 480),
        depth_scale=5000.0,
    )
