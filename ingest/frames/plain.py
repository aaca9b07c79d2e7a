"""The plain layout, for one's own camera.

    meta.json          {"width", "height", "fx", "fy", "cx", "cy": pixels, "depth_scale": units per metre (1000)}
    rgb/NAME.png       colour, or .jpg
    depth/NAME.png     16 bits, 0 where unknown; or .npy in the same unit
    pose/NAME.txt      4 x 4 camera to map, row by row; camera x right, y down, z forward; metres; map z up
    times.txt          optional: NAME SECONDS per line

Files of one frame share their NAME; frames go in natural order of the names.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

from cgdb.errors import FormatError
from cgdb.ingest import strict_json
from cgdb.ingest.frames import poses
from cgdb.ingest.frames.folder import shots_of_folders
from cgdb.ingest.frames.recording import Recording


def matches(root: Path) -> bool:
    """meta.json beside the three folders."""
    return (root / "meta.json").is_file() and all((root / name).is_dir() for name in ("rgb", "depth", "pose"))


def read(root: Path) -> Recording:
    """The recording of such a folder."""
    path = root / "meta.json"
    meta = strict_json.parse(poses.text_of(path).encode())
    if not isinstance(meta, dict):
        raise FormatError(f"{path}: must hold an object with width, height, fx, fy, cx, cy")
    number = {key: _number(meta, key, path) for key in ("width", "height", "fx", "fy", "cx", "cy")}
    return Recording(
        layout="plain",
        root=root,
        shots=shots_of_folders(root / "rgb", root / "depth", root / "pose", times=root / "times.txt"),
        K=poses.intrinsics(number["fx"], number["fy"], number["cx"], number["cy"]),
        size=(int(number["width"]), int(number["height"])),
        depth_scale=_number(meta, "depth_scale", path, 1000.0),
    )


def _number(meta: dict[str, Any], key: str, path: Path, default: float | None = None) -> float:
    return poses.plausible(meta.get(key, default), f"{path}: '{key}'")
