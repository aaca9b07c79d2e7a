"""Azure Kinect as the reference's tools leave it: color/*.jpg, depth/*.png (mm), poses_global_dvo.txt or a .log."""

from __future__ import annotations

from pathlib import Path

from cgdb.errors import FormatError
from cgdb.ingest import strict_json
from cgdb.ingest.frames import poses
from cgdb.ingest.frames.folder import COLOR, DEPTH, Fellows, files, shot
from cgdb.ingest.frames.recording import Recording
from cgdb.ingest.frames.redwood import poses_of_log


def matches(root: Path) -> bool:
    """poses_global_dvo.txt or poses_global_dvo.log beside color and depth."""
    return any((root / f"poses_global_dvo.{ending}").is_file() for ending in ("txt", "log"))


def read(root: Path) -> Recording:
    """The recording. intrinsic.json, as the recorder writes it, is used where it is there; else a usual camera's."""
    table = root / "poses_global_dvo.txt"
    if table.is_file():
        found = [line.reshape(4, 4) for line in poses.rows(table, 16)]
    else:
        found = list(poses_of_log(root / "poses_global_dvo.log").values())
    colors = files(root / "color", COLOR)
    depths = Fellows(files(root / "depth", DEPTH))
    if len(found) != len(colors):
        raise FormatError(f"{root}: {len(colors)} colour pictures but {len(found)} poses")
    lens, size, note = poses.intrinsics(607.4, 607.4, 639.6, 366.3), (1280, 720), "intrinsics: a usual camera's"
    recorded = root / "intrinsic.json"
    if recorded.is_file():
        lens, size = poses.open3d_intrinsics(strict_json.parse(poses.text_of(recorded)), str(recorded))
        note = "intrinsics: intrinsic.json"
    return Recording(
        layout="azure",
        root=root,
        shots=[
            shot(path, depths.of(path) or root / "depth" / path.with_suffix(".png").name, pose)
            for path, pose in zip(colors, found, strict=True)
        ],
        K=lens,
        size=size,
        depth_scale=1000.0,
        notes=(note,),
    )
