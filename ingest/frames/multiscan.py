"""MultiScan: outputs/color and outputs/depth (*.png, mm), SCAN.json on the streams, SCAN.jsonl with a line per frame.

The pictures are every so many of the frames that have lines. A line's transform is ARKit's camera to world, column by
column; its camera looks along -z with y up, and its world, y up, stays as it is.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from cgdb.errors import FormatError
from cgdb.ingest import strict_json
from cgdb.ingest.frames import poses
from cgdb.ingest.frames.folder import COLOR, DEPTH, Fellows, files, shot
from cgdb.ingest.frames.recording import LARGEST_SIDE, Recording


def matches(root: Path) -> bool:
    """The folder outputs beside a .json and a .jsonl of one name."""
    return (root / "outputs" / "color").is_dir() and _scan(root) is not None


def read(root: Path) -> Recording:
    """The recording; each frame with the lens that its line gives, for the camera focuses."""
    scan = _scan(root)
    if scan is None:
        raise FormatError(f"{root}: has no SCAN.json with a SCAN.jsonl", hint="the two have one name")
    lens, size = _stream(scan)
    lines = [line for line in poses.text_of(scan.with_suffix(".jsonl")).splitlines() if line.strip()]
    colors = files(root / "outputs" / "color", COLOR)
    depths = Fellows(files(root / "outputs" / "depth", DEPTH))
    every = max(1, round(len(lines) / len(colors))) if colors else 1
    shots = []
    for number, color in enumerate(colors):
        pose, own, missing = _line(lines[number * every]) if number * every < len(lines) else (None, None, "no pose")
        shots.append(
            shot(color, depths.of(color) or root / "outputs" / "depth" / color.name, pose, missing=missing, lens=own)
        )
    if lens is None:
        lens = next((shot.lens for shot in shots if shot.lens is not None), None)
    if lens is None:
        raise FormatError(f"{scan}: neither it nor the .jsonl gives intrinsics of 9 numbers")
    return Recording(layout="multiscan", root=root, shots=shots, K=lens, size=size, depth_scale=1000.0, up="y")


def _scan(root: Path) -> Path | None:
    return next((path for path in sorted(root.glob("*.json")) if path.with_suffix(".jsonl").is_file()), None)


def _stream(path: Path) -> tuple[NDArray[np.float64] | None, tuple[int, int]]:
    """(K if it is said, (width, height)) of the colour camera."""
    about = strict_json.parse(poses.text_of(path))
    streams = about.get("streams") if isinstance(about, dict) else None
    first = streams[0] if isinstance(streams, list) and streams else None
    match first:
        case {"resolution": [int(height), int(width)], **more} if 0 < min(height, width) <= LARGEST_SIDE:
            said = more.get("intrinsics")
            return None if said is None else poses.column_major(said, 3, f"{path}: intrinsics"), (width, height)
    raise FormatError(f"{path}: its first stream must have a resolution [height, width]")


def _line(text: str) -> tuple[NDArray[np.float64] | None, NDArray[np.float64] | None, str]:
    """(our pose, K, what is missing) of a frame."""
    try:
        value: Any = strict_json.parse(text)
        if not isinstance(value, dict):
            raise FormatError("a line must be an object")
        pose = poses.column_major(value.get("transform"), 4, "transform")
        own = value.get("intrinsics")
        lens = None if own is None else poses.column_major(own, 3, "intrinsics")
    except FormatError:
        return None, None, "the pose is no matrix of numbers"
    with np.errstate(divide="ignore", invalid="ignore"):
        return pose @ poses.FLIP_YZ / pose[3, 3], lens, ""
