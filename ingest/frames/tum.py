"""TUM RGB-D: rgb.txt, depth.txt (seconds and file), groundtruth.txt (seconds tx ty tz qx qy qz qw); depth 1/5000 m.

The three clocks run apart: a colour picture gets the depth and the pose nearest in time, within 20 ms, as the
benchmark's own tools do, the pose between its two neighbours.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from cgdb.errors import FormatError
from cgdb.ingest.frames import poses
from cgdb.ingest.frames.folder import shot
from cgdb.ingest.frames.recording import Recording

APART = 0.02
POSE_APART = 0.1
CAMERAS = {"freiburg1": (517.3, 516.5, 318.6, 255.3), "freiburg2": (520.9, 521.0, 325.1, 249.7)}
OTHER = (535.4, 539.2, 320.1, 247.6)
"""(fx, fy, cx, cy) as the benchmark publishes them; freiburg3's for any other name."""


def matches(root: Path) -> bool:
    """The three lists."""
    return all((root / name).is_file() for name in ("rgb.txt", "depth.txt", "groundtruth.txt"))


def read(root: Path) -> Recording:
    """The recording; the camera by the name of the folder."""
    colors, depths = _listed(root / "rgb.txt"), _listed(root / "depth.txt")
    truth = np.array(poses.rows(root / "groundtruth.txt", 8)).reshape(-1, 8)
    truth = truth[np.argsort(truth[:, 0], kind="stable")]
    times = np.array([time for time, _ in depths])
    shots = []
    for time, color in colors:
        near = int(np.abs(times - time).argmin()) if len(times) else -1
        if near < 0 or abs(times[near] - time) > APART:
            continue  # a colour picture for which the depth camera has none: usual, and no fault
        shots.append(
            shot(root / color, root / depths[near][1], _pose_at(truth, time), timestamp=time, missing="no pose in time")
        )
    camera = next((values for name, values in CAMERAS.items() if name in root.resolve().name), OTHER)
    return Recording(
        layout="tum", root=root, shots=shots, K=poses.intrinsics(*camera), size=(640, 480), depth_scale=5000.0
    )


def _listed(path: Path) -> list[tuple[float, str]]:
    made = []
    for number, line in enumerate(poses.text_of(path).splitlines(), start=1):
        if not line.strip() or line.startswith("#"):
            continue
        time, _, name = line.strip().partition(" ")
        if not name or ".." in name or name.startswith("/"):
            raise FormatError(f"{path}:{number}: must be a time and a file within the recording")
        made.append((poses.number(time, f"{path}:{number}"), name.strip()))
    return made


def _pose_at(truth: NDArray[np.float64], time: float) -> NDArray[np.float64] | None:
    """The pose at a time, between the two that enclose it; None where there is none near enough."""
    after = int(np.searchsorted(truth[:, 0], time))
    if after < len(truth) and truth[after, 0] == time:
        return poses.of_quaternion(truth[after, 1:4], truth[after, 4:])
    if not 0 < after < len(truth) or max(time - truth[after - 1, 0], truth[after, 0] - time) > POSE_APART:
        return None
    one, two = truth[after - 1], truth[after]
    share = (time - one[0]) / (two[0] - one[0])
    # The two are a hundredth of a second apart: a straight line between quaternions is as good as an arc.
    turn = two[4:] if one[4:] @ two[4:] >= 0 else -two[4:]
    return poses.of_quaternion((1 - share) * one[1:4] + share * two[1:4], (1 - share) * one[4:] + share * turn)
