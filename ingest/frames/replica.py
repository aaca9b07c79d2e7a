"""Replica as rendered for NICE-SLAM: results/frame*.jpg, results/depth*.png (1/6553.5 m), traj.txt (16 numbers)."""

from __future__ import annotations

from pathlib import Path

from cgdb.errors import FormatError
from cgdb.ingest.frames import poses
from cgdb.ingest.frames.folder import COLOR, DEPTH, Fellows, files, key_of, shot
from cgdb.ingest.frames.recording import Recording


def matches(root: Path) -> bool:
    """traj.txt beside results."""
    return (root / "traj.txt").is_file() and (root / "results").is_dir()


def read(root: Path) -> Recording:
    """The recording; the line of a frame in traj.txt is its place among the pictures."""
    colors = files(root / "results", COLOR, "frame*")
    depths = Fellows(files(root / "results", DEPTH, "depth*"))
    lines = poses.rows(root / "traj.txt", 16)
    if len(lines) != len(colors):
        raise FormatError(f"{root}: {len(colors)} colour pictures but {len(lines)} poses in traj.txt")
    return Recording(
        layout="replica",
        root=root,
        shots=[
            shot(path, depths.of(path) or path.with_name(f"depth{key_of(path)}.png"), line.reshape(4, 4))
            for path, line in zip(colors, lines, strict=True)
        ],
        K=poses.intrinsics(600.0, 600.0, 599.5, 339.5),
        size=(1200, 680),
        depth_scale=6553.5,
    )
