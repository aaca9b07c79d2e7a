"""HM3D as rendered by Habitat: NAME.png, NAME_depth.npy (m), NAME.json {"pose": 4 x 4}, all in one folder.

Habitat's cameras look along -z with y up, and its world is y up; both are turned, P pose P, as the reference does.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from cgdb.errors import FormatError
from cgdb.ingest import strict_json
from cgdb.ingest.frames import poses
from cgdb.ingest.frames.folder import files, shot
from cgdb.ingest.frames.recording import Recording


def matches(root: Path) -> bool:
    """Files NAME_depth.npy."""
    return any(True for _ in root.glob("*_depth.npy"))


def read(root: Path) -> Recording:
    """The recording of such a folder."""
    shots = []
    for color in files(root, (".png",)):
        if color.stem.endswith("_depth"):
            continue
        pose, missing = _pose(color.with_suffix(".json"))
        turned = None if pose is None else poses.FLIP_YZ @ pose @ poses.FLIP_YZ
        shots.append(shot(color, root / f"{color.stem}_depth.npy", turned, missing=missing))
    return Recording(
        layout="hm3d",
        root=root,
        shots=shots,
        K=poses.intrinsics(256.0, 256.0, 256.0, 256.0),
        size=(512, 512),
        depth_scale=1.0,
        up="-y",
    )


def _pose(path: Path) -> tuple[NDArray[np.float64] | None, str]:
    if not path.is_file():
        return None, "no pose"
    try:
        value = strict_json.parse(poses.text_of(path))
        return np.array(value["pose"], dtype=np.float64).reshape(4, 4), ""
    except (FormatError, KeyError, TypeError, ValueError, OverflowError):
        return None, "the pose is no matrix of numbers"
