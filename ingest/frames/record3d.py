"""Record3D, extracted: rgb/*.png or .jpg, depth/*.png (mm) or high_conf_depth/, poses/*.npy, dataconfig.yaml.

Its cameras look along -z with y up, as ARKit's do; so the camera's y and z are turned, and the world's too, as the
reference does: P pose P. ARKit's world is y up, which becomes y down.
"""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from cgdb.errors import FormatError
from cgdb.ingest.frames import poses
from cgdb.ingest.frames.folder import shots_of_folders
from cgdb.ingest.frames.recording import Recording


def matches(root: Path) -> bool:
    """dataconfig.yaml beside rgb and poses."""
    return (root / "dataconfig.yaml").is_file() and (root / "poses").is_dir()


def turned(pose: NDArray[np.float64]) -> NDArray[np.float64]:
    """Our pose of one in OpenGL's axes, the world turned with the camera."""
    return poses.FLIP_YZ @ pose @ poses.FLIP_YZ


def read(root: Path) -> Recording:
    """The recording, with the depth of high confidence where that was extracted."""
    value = _camera(root / "dataconfig.yaml")
    depth = "high_conf_depth" if (root / "high_conf_depth").is_dir() else "depth"
    return Recording(
        layout="record3d",
        root=root,
        shots=shots_of_folders(root / "rgb", root / depth, root / "poses", convert=turned),
        K=poses.intrinsics(value["fx"], value["fy"], value["cx"], value["cy"]),
        size=(int(value["image_width"]), int(value["image_height"])),
        depth_scale=value.get("png_depth_scale", 1000.0),
        up="-y",
    )


def _camera(path: Path) -> dict[str, float]:
    """The numbers under camera_params: `key: number` lines are all that these files hold, so no YAML is parsed."""
    found = {
        key: poses.plausible(float(number), f"{path}: {key}")
        for key, number in re.findall(
            r"^\s*(\w+)\s*:\s*([-+]?\d+(?:\.\d*)?(?:[eE][-+]?\d+)?)\s*$", poses.text_of(path), flags=re.MULTILINE
        )
    }
    missing = [key for key in ("fx", "fy", "cx", "cy", "image_width", "image_height") if key not in found]
    if missing:
        raise FormatError(f"{path}: camera_params has no {missing[0]}")
    return found
