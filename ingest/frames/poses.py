"""Camera poses and intrinsics: parsing them from text, checking them, and turning conventions into one."""

from __future__ import annotations

import contextlib
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from cgdb.errors import FormatError

Matrix = NDArray[np.float64]

FLIP_YZ: Matrix = np.diag([1.0, -1.0, -1.0, 1.0])
"""Between cameras that look along +z with y down (ours, OpenCV) and along -z with y up (OpenGL, ARKit, Habitat)."""
_Z_UP: Matrix = np.array([[1, 0, 0, 0], [0, 0, 1, 0], [0, 1, 0, 0], [0, 0, 0, 1]], dtype=np.float64)
_Y_DOWN: Matrix = np.diag([1.0, -1.0, 1.0, 1.0])
LARGEST_TEXT = 64 << 20


def text_of(path: Path) -> str:
    """A small text file. FormatError where it cannot be read."""
    try:
        if path.stat().st_size > LARGEST_TEXT:
            raise FormatError(f"{path}: is larger than {LARGEST_TEXT >> 20} MB")
        return path.read_text(encoding="utf-8", errors="replace")
    except OSError as error:
        raise FormatError(f"{path}: cannot be read: {error.strerror or error}") from error


def numbers(text: str, where: str) -> NDArray[np.float64]:
    """All numbers of a text, whatever separates them; "inf" and "nan" are numbers."""
    try:
        return np.array(text.replace(",", " ").split(), dtype=np.float64)
    except ValueError as error:
        raise FormatError(f"{where}: holds something other than numbers") from error


def number(text: str, where: str) -> float:
    """The one number of a text. FormatError for none, several, or something else."""
    found = numbers(text, where)
    if found.size != 1:
        raise FormatError(f"{where}: has {found.size} numbers, expected one")
    return float(found[0])


def plausible(value: object, what: str) -> float:
    """A number of a camera or recording; FormatError for what is none, or so large that it can only be a mistake."""
    if not isinstance(value, bool) and isinstance(value, (int, float)) and abs(value) <= 1e12:
        return float(value)
    raise FormatError(f"{what} must be a number, not {str(value)[:40]!r}")


def rows(path: Path, width: int) -> list[NDArray[np.float64]]:
    """The lines of a table of numbers, each (width,); blank lines and # comments are passed over."""
    found = []
    for number, line in enumerate(text_of(path).splitlines(), start=1):
        if not line.strip() or line.lstrip().startswith("#"):
            continue
        values = numbers(line, f"{path}:{number}")
        if len(values) != width:
            raise FormatError(f"{path}:{number}: has {len(values)} numbers, expected {width}")
        found.append(values)
    return found


def matrix(values: NDArray[np.float64], where: str) -> Matrix:
    """(4, 4) from 16 numbers, or from 12 (the upper rows)."""
    if values.size == 12:
        return np.vstack([values.reshape(3, 4), [0.0, 0.0, 0.0, 1.0]])
    if values.size != 16:
        raise FormatError(f"{where}: a pose must have 12 or 16 numbers, not {values.size}")
    return values.reshape(4, 4)


def fault(pose: Matrix, *, left_handed: bool = False) -> str | None:
    """What is wrong with a camera-to-map matrix (4, 4), or None."""
    if not np.isfinite(pose).all():
        return "the pose holds infinite values or NaN"
    turn = pose[:3, :3]
    # Numbers whose squares overflow first: no rotation has one above 1.
    if np.abs(turn).max() > 2 or not np.allclose(turn @ turn.T, np.eye(3), atol=2e-2):
        return "the pose is no rotation and translation"
    if not np.allclose(pose[3], [0, 0, 0, 1], atol=1e-6):
        return "the pose is no rotation and translation"
    if (np.linalg.det(turn) < 0) != left_handed:
        return "the pose mirrors the world"
    if np.abs(pose[:3, 3]).max() > 1e5:
        return "the pose lies farther than 100 km from the origin"
    return None


def settled(pose: Matrix) -> Matrix:
    """The pose with the rotation nearest to its own: files round."""
    u, _, vt = np.linalg.svd(pose[:3, :3])
    made = pose.copy()
    made[:3, :3] = u @ vt
    return made


def of_quaternion(translation: NDArray[np.float64], xyzw: NDArray[np.float64]) -> Matrix:
    """(4, 4) from a translation (3,) and a quaternion (x, y, z, w), normalised here; NaN where it has no length."""
    length = float(np.linalg.norm(xyzw)) if np.abs(xyzw).max() < 1e6 else 0.0
    x, y, z, w = xyzw / length if length > 1e-6 else np.full(4, np.nan)
    pose = np.eye(4)
    pose[:3, :3] = [
        [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
        [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
        [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
    ]
    pose[:3, 3] = translation
    return pose


def from_left_handed(pose: Matrix) -> Matrix:
    """Our pose of one in a left-handed world with y up whose camera is x right, y up, z forward (Unity, POV-Ray).

    Exchanging the world's y and z makes it right-handed with z up; turning the camera's y makes it ours. Each mirrors,
    so that together they mirror nothing: what is left in the picture is left in the map.
    """
    return _Z_UP @ pose @ _Y_DOWN


def intrinsics(fx: float, fy: float, cx: float, cy: float) -> Matrix:
    """The camera matrix (3, 3), in pixels."""
    return np.array([[fx, 0.0, cx], [0.0, fy, cy], [0.0, 0.0, 1.0]])


def check_intrinsics(lens: Matrix, size: tuple[int, int], where: str) -> None:
    """FormatError where a camera matrix cannot belong to pictures of (width, height)."""
    width, height = size
    fx, fy, cx, cy = lens[0, 0], abs(lens[1, 1]), lens[0, 2], lens[1, 2]
    wide = 0.2 * width < fx < 8 * width and 0.2 * height < fy < 10 * height
    if not wide or not (0.2 * width < cx < 0.8 * width and 0.2 * height < cy < 0.8 * height):
        raise FormatError(
            f"{where}: fx {fx:.6g}, fy {fy:.6g}, cx {cx:.6g}, cy {cy:.6g} do not fit pictures of {width} x {height}",
            hint="are they those of another resolution?",
        )


def doubts(lens: Matrix, size: tuple[int, int]) -> list[str]:
    """What is odd, if not impossible, about a camera matrix for pictures of (width, height)."""
    fx, fy, cx, cy = lens[0, 0], abs(lens[1, 1]), lens[0, 2] / size[0], lens[1, 2] / size[1]
    found = []
    if max(fx, fy) > 1.2 * min(fx, fy):
        found.append(f"the focal lengths fx {fx:.6g} and fy {fy:.6g} differ: are pixels not square?")
    if max(abs(cx - 0.5), abs(cy - 0.5)) > 0.15:
        found.append(f"the principal point lies at {cx:.0%} and {cy:.0%} of the picture, far from its middle")
    angle = float(np.degrees(2 * np.arctan2(size[0] / 2, fx)))
    if angle > 120 or angle < 20:
        found.append(f"the camera sees an angle of {angle:.0f} degrees")
    return found


def column_major(value: object, side: int, where: str) -> Matrix:
    """(side, side) of a list of numbers that goes column by column, as Apple's matrices do."""
    if isinstance(value, list) and len(value) == side * side and all(type(v) in (int, float) for v in value):
        with contextlib.suppress(OverflowError):
            return np.array(value, np.float64).reshape(side, side).T
    raise FormatError(f"{where}: must be a list of {side * side} numbers")


def open3d_intrinsics(value: object, where: str) -> tuple[Matrix, tuple[int, int]]:
    """(K, (width, height)) of Open3D's camera JSON, whose matrix goes column by column."""
    if isinstance(value, dict):
        listed, width, height = value.get("intrinsic_matrix"), value.get("width"), value.get("height")
        good = isinstance(listed, list) and len(listed) == 9
        if good and isinstance(width, int) and isinstance(height, int) and 0 < width < 1e6 and 0 < height < 1e6:
            return column_major(listed, 3, where), (width, height)
    raise FormatError(f"{where}: must hold width, height and an intrinsic_matrix of 9 numbers")
