"""What the layouts share: files of a folder in natural order, and frames whose files share their names."""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from cgdb.errors import FormatError
from cgdb.ingest import arrays
from cgdb.ingest.frames import poses
from cgdb.ingest.frames.recording import Shot

COLOR = (".png", ".jpg", ".jpeg", ".ppm")
DEPTH = (".png", ".npy", ".exr", ".pgm", ".tiff", ".tif")


def files(folder: Path, endings: Sequence[str], pattern: str = "*") -> list[Path]:
    """The files of a folder with one of the endings, in natural order: frame2 before frame10."""
    if not folder.is_dir():
        raise FormatError(f"{folder}: there is no such folder")
    return sorted((path for path in folder.glob(pattern) if path.suffix.lower() in endings), key=natural)


def natural(path: Path) -> tuple[tuple[int, int | str], ...]:
    """A key by which numbers within names count as numbers."""
    return tuple((0, int(part)) if part.isdecimal() else (1, part) for part in re.split(r"(\d+)", path.name) if part)


def key_of(path: Path) -> str:
    """What the files of one frame have in common: the number in the name, else the whole stem."""
    found = re.findall(r"\d+", path.stem)
    return str(int(found[-1])) if found else path.stem


class Fellows:
    """The files of a folder, to be found by another folder's file of the same frame: of its name, else its number.

    A number that two files bear (left_1, right_1) finds neither.
    """

    def __init__(self, paths: Sequence[Path]) -> None:
        self._by_name = {path.stem: path for path in paths}
        self._by_number: dict[str, Path | None] = {}
        for path in paths:
            key = key_of(path)
            self._by_number[key] = None if key in self._by_number else path

    def of(self, path: Path) -> Path | None:
        """The fellow of a file; None where there is none, or it is not clear which."""
        return self._by_name.get(path.stem) or self._by_number.get(key_of(path))


def shot(
    color: Path,
    depth: Path,
    pose: NDArray[np.float64] | None,
    *,
    timestamp: float | None = None,
    missing: str = "no pose",
    lens: NDArray[np.float64] | None = None,
) -> Shot:
    """A shot whose pose (already in our convention) is looked at: one that is wrong is left out, and why is kept."""
    wrong = missing if pose is None else poses.fault(pose)
    return Shot(
        name=color.stem,
        color=color,
        depth=depth,
        pose=poses.settled(pose) if pose is not None and wrong is None else None,
        timestamp=timestamp,
        fault=wrong or "",
        lens=lens,
    )


def shots_of_folders(
    color: Path,
    depth: Path,
    pose: Path,
    *,
    convert: Callable[[NDArray[np.float64]], NDArray[np.float64]] = lambda pose: pose,
    times: Path | None = None,
) -> list[Shot]:
    """Frames from three folders whose files belong together by number; frames without depth or pose are bad ones."""
    depths, found = Fellows(files(depth, DEPTH)), Fellows(files(pose, (".txt", ".npy")))
    seconds = _times(times) if times is not None and times.is_file() else {}
    made = []
    for path in files(color, COLOR):
        lies = found.of(path)
        at, why = (None, "no pose") if lies is None else pose_of_file(lies)
        made.append(
            shot(
                path,
                depths.of(path) or depth / path.with_suffix(".png").name,
                None if at is None else convert(at),
                timestamp=seconds.get(path.stem),
                missing=why,
            )
        )
    return made


def pose_of_file(path: Path) -> tuple[NDArray[np.float64] | None, str]:
    """A pose file's matrix, or None and what is wrong with it: one bad file is one bad frame."""
    try:
        values = arrays.of_file(path) if path.suffix == ".npy" else poses.numbers(poses.text_of(path), path.name)
        return poses.matrix(np.asarray(values, np.float64).reshape(-1), path.name), ""
    except (FormatError, ValueError):
        return None, "the pose is no matrix of numbers"


def _times(path: Path) -> dict[str, float]:
    made = {}
    for line in poses.text_of(path).splitlines():
        name, _, value = line.strip().rpartition(" ")
        if name:
            made[name.strip()] = poses.number(value, str(path))
    return made
