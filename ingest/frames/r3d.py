"""Record3D's own recordings: the .r3d archive, the folder it was unpacked to, and the app's export as EXR and JPG.

    metadata           JSON: w, h, K (9 numbers, column by column), poses (N x [qx, qy, qz, qw, tx, ty, tz]), dw, dh,
                       fps, frameTimestamps, perFrameIntrinsicCoeffs (N x [fx, fy, cx, cy])
    rgbd/N.jpg         colour, w x h
    rgbd/N.depth       LZFSE: dw x dh float32, metres
    rgbd/N.conf        LZFSE: dw x dh uint8, 2 where ARKit is sure; depth of which it is not is left out

The export has metadata.json, rgb/N.jpg and depth/N.exr (metres). Cameras and world are ARKit's, as in `record3d`.
"""

from __future__ import annotations

import math
from io import BytesIO
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from cgdb.errors import FormatError
from cgdb.ingest import strict_json
from cgdb.ingest.frames import pictures, poses, unlzfse
from cgdb.ingest.frames.archive import Archive
from cgdb.ingest.frames.folder import COLOR, files, shot
from cgdb.ingest.frames.record3d import turned
from cgdb.ingest.frames.recording import LARGEST_SIDE, Recording, Shot, pixels_of_files

LARGEST_METADATA = 64 << 20
LARGEST_PART = 64 << 20
MOST_DEPTHS = 4 << 20
"""Pixels of a depth picture; those of the sensors have 49,152 or 307,200."""
SURE = 2


def matches(root: Path) -> bool:
    """A .r3d file, or a folder with metadata beside rgbd or depth."""
    if root.is_file():
        return root.suffix.lower() == ".r3d"
    exported = (root / "metadata.json").is_file() and (root / "rgb").is_dir() and (root / "depth").is_dir()
    return exported or ((root / "metadata").is_file() and (root / "rgbd").is_dir())


def read(root: Path) -> Recording:
    """The recording, frames by their numbers."""
    archive = Archive(root)
    exported = root.is_dir() and (root / "metadata.json").is_file()
    name = "metadata.json" if exported else "metadata"
    about = strict_json.parse(archive.read(name, LARGEST_METADATA))
    where = f"{root.name}: {name}"
    if not isinstance(about, dict):
        raise FormatError(f"{where}: must hold an object")
    size = _side(about, "w", where), _side(about, "h", where)
    found = _table(about.get("poses"), 7, f"{where}: poses")
    if not len(found):
        raise FormatError(f"{where}: holds no poses")
    lenses = _table(about.get("perFrameIntrinsicCoeffs"), 4, f"{where}: perFrameIntrinsicCoeffs")
    times = _times(about.get("frameTimestamps"))
    at = [turned(poses.of_quaternion(row[4:], row[:4])) for row in found]
    shots = []
    for number, color, depth in _exported(root) if exported else _parts(root, archive):
        lens = poses.intrinsics(*lenses[number].tolist()) if number < len(lenses) else None
        shots.append(
            shot(
                color,
                depth,
                at[number] if number < len(at) else None,
                timestamp=times[number] if number < len(times) else None,
                lens=lens,
            )
        )
    return Recording(
        layout="r3d",
        root=root,
        shots=shots,
        K=poses.column_major(about.get("K"), 3, f"{where}: K"),
        size=size,
        depth_scale=1.0,
        up="-y",
        notes=() if exported else ("depth of which ARKit is not sure is left out",),
        pixels=pixels_of_files if exported else _Pixels(archive, about, size, where),
    )


class _Pixels:
    """Reads the pictures of an archive."""

    def __init__(self, archive: Archive, about: dict[str, Any], size: tuple[int, int], where: str) -> None:
        self._archive, self._color = archive, size
        self._depth: tuple[int, int] | None = None
        if "dw" in about or "dh" in about:
            self._depth = _side(about, "dw", where), _side(about, "dh", where)

    def __call__(
        self, shot: Shot, depth_scale: float, invalid_above: float
    ) -> tuple[NDArray[np.uint8], NDArray[np.float32]]:
        """Colour and depth of a frame."""
        part = f"rgbd/{shot.color.name}"
        rgb = pictures.color(shot.color, BytesIO(self._archive.read(part, LARGEST_PART)))
        part = f"rgbd/{shot.depth.name}"
        packed = self._archive.read(part, LARGEST_PART)
        width, height = self._depth or self._guessed(packed, part)
        if width * height > MOST_DEPTHS:
            raise FormatError(f"{part}: is {width} x {height} pixels")
        values = np.frombuffer(unlzfse.decompress(packed, 4 * width * height, part), "<f4").reshape(height, width)
        depth = pictures.metres(values, depth_scale, invalid_above)
        part = f"rgbd/{shot.depth.stem}.conf"
        if self._archive.holds(part):
            sure = unlzfse.decompress(self._archive.read(part, LARGEST_PART), width * height, part)
            depth[np.frombuffer(sure, np.uint8).reshape(height, width) < SURE] = 0.0
        return rgb, depth

    def _guessed(self, packed: bytes, where: str) -> tuple[int, int]:
        """(width, height) of depth whose size the metadata does not say: the colour's proportions tell."""
        pixels = unlzfse.announced(packed, where)[0] // 4
        width = round(math.sqrt(pixels * self._color[0] / self._color[1]))
        if width < 1 or pixels % width:
            raise FormatError(f"{where}: {pixels} depths do not have the proportions of the colour picture")
        return width, pixels // width


def _parts(root: Path, archive: Archive) -> list[tuple[int, Path, Path]]:
    numbers = sorted(
        int(name[:-4])
        for name in archive.names("rgbd")
        if name.endswith(".jpg") and name[:-4].isascii() and name[:-4].isdigit() and len(name) < 20
    )
    return [(n, root / "rgbd" / f"{n}.jpg", root / "rgbd" / f"{n}.depth") for n in numbers]


def _exported(root: Path) -> list[tuple[int, Path, Path]]:
    return [
        (int(path.stem), path, root / "depth" / f"{path.stem}.exr")
        for path in files(root / "rgb", COLOR)
        if path.stem.isascii() and path.stem.isdigit() and len(path.stem) < 20
    ]


def _table(value: object, width: int, where: str) -> NDArray[np.float64]:
    """(n, width) of rows of numbers; nothing where there are none."""
    if value is None or value == []:
        return np.empty((0, width))
    if not isinstance(value, list) or not all(
        isinstance(row, list) and len(row) == width and all(type(v) in (int, float) for v in row) for row in value
    ):
        raise FormatError(f"{where}: must be rows of {width} numbers")
    try:
        return np.array(value, np.float64)
    except OverflowError as error:
        raise FormatError(f"{where}: holds a number that is too large") from error


def _times(value: object) -> list[float]:
    """Seconds by frame; none where they are not said."""
    good = isinstance(value, list) and all(type(v) in (int, float) and abs(v) < 1e12 for v in value)
    return [float(v) for v in value] if isinstance(value, list) and good else []


def _side(about: dict[str, Any], key: str, where: str) -> int:
    value = about.get(key)
    if not isinstance(value, (int, float)) or not 1 <= value <= LARGEST_SIDE or value != int(value):
        raise FormatError(f"{where}: '{key}' must be a number of pixels, not {str(value)[:40]!r}")
    return int(value)
