"""Camera frames: the type, and recordings on disk as a stream of them, bad ones skipped and counted.

Camera axes are x right, y down, z forward; a pixel (u, v) with depth z is the point ((u - cx) z / fx, (v - cy) z / fy,
z) in metres. Poses bring such points into a right-handed map frame; each layout module turns its convention into this.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from cgdb.errors import FormatError, UsageError, did_you_mean
from cgdb.ingest.frames import pictures, poses

LAYOUTS: dict[str, str] = {
    "replica": "cgdb.ingest.frames.replica",
    "scannet": "cgdb.ingest.frames.scannet",
    "ai2thor": "cgdb.ingest.frames.ai2thor",
    "r3d": "cgdb.ingest.frames.r3d",
    "record3d": "cgdb.ingest.frames.record3d",
    "realsense": "cgdb.ingest.frames.realsense",
    "multiscan": "cgdb.ingest.frames.multiscan",
    "azure": "cgdb.ingest.frames.azure",
    "icl": "cgdb.ingest.frames.icl",
    "tum": "cgdb.ingest.frames.tum",
    "redwood": "cgdb.ingest.frames.redwood",
    "7scenes": "cgdb.ingest.frames.seven_scenes",
    "hm3d": "cgdb.ingest.frames.hm3d",
    "hm3d-openeqa": "cgdb.ingest.frames.hm3d_openeqa",
    "plain": "cgdb.ingest.frames.plain",
}
"""{layout: the module that reads it}. When nobody says which, the first whose files are there; plain asks for least."""

LARGEST_SIDE = 8192
SMALLEST_SIDE = 16
LARGEST_DEPTH = 100.0
"""Metres. Beyond it no RGB-D camera measures; a median above half of it means a wrong scale."""
USUAL_DEPTHS = (0.25, 12.0)
"""Metres between which the middle depth of a frame indoors lies."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Frame:
    """One posed RGB-D picture.

    rgb (h, w, 3) uint8; depth (h, w) float32 m, 0 where unknown; K (3, 3) float64 of this size; T_world_camera (4, 4)
    float64. index is the position in the recording, name the file's stem, by which detections are found.
    """

    index: int
    name: str
    timestamp: float | None
    rgb: NDArray[np.uint8]
    depth: NDArray[np.float32]
    K: NDArray[np.float64]
    T_world_camera: NDArray[np.float64]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Shot:
    """A frame that has not been read yet. pose None: missing or impossible, `fault` says which.

    lens: the camera matrix (3, 3) of this frame, where it is not the recording's.
    """

    name: str
    color: Path
    depth: Path
    pose: NDArray[np.float64] | None
    timestamp: float | None = None
    fault: str = "no pose"
    lens: NDArray[np.float64] | None = None


Pixels = Callable[[Shot, float, float], tuple[NDArray[np.uint8], NDArray[np.float32]]]
"""Reads a shot, given units of depth per metre and the metres from which depth means nothing: rgb (h, w, 3), and depth
(h, w) in metres, whose sizes may differ. FormatError where it is damaged."""


def pixels_of_files(
    shot: Shot, depth_scale: float, invalid_above: float
) -> tuple[NDArray[np.uint8], NDArray[np.float32]]:
    """The pictures of a shot whose paths are files."""
    return pictures.color(shot.color), pictures.depth(shot.depth, depth_scale, invalid_above)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Recording:
    """What a layout module found: the shots in order, and how their files are to be read.

    K belongs to pictures of size (width, height), or of whatever size they have where that is None. depth_scale:
    units of a depth file per metre. invalid_above: metres from which on depth means nothing. skipped: why frames could
    not be used, and how many; doubts: what looks wrong and was used nevertheless.
    """

    layout: str
    root: Path
    shots: Sequence[Shot]
    K: NDArray[np.float64]
    size: tuple[int, int] | None
    depth_scale: float
    invalid_above: float = LARGEST_DEPTH
    up: str = "z"
    notes: tuple[str, ...] = ()
    pixels: Pixels = pixels_of_files
    skipped: Counter[str] = field(default_factory=Counter)
    doubts: Counter[str] = field(default_factory=Counter)

    def frames(
        self, *, start: int = 0, end: int | None = None, stride: int = 1, size: tuple[int, int] | None = None
    ) -> Iterator[Frame]:
        """The frames [start:end:stride], at (width, height) where size is given; bad ones are counted in `skipped`.

        FormatError when half of the first twenty, or all of them, are bad: then it is the recording that is.
        """
        if stride < 1 or start < 0:
            raise UsageError("stride must be at least 1 and start at least 0")
        chosen = range(len(self.shots))[start:end:stride]
        if not len(chosen):
            raise UsageError(f"{self.root}: there are {len(self.shots)} frames, none of them in the range asked for")
        good = 0
        for tried, index in enumerate(chosen, start=1):
            frame = self._read(index, size)
            if frame is not None:
                good += 1
                yield frame
            bad = tried - good
            if (tried == 20 and bad > 10) or (tried == len(chosen) and not good):
                reason, count = self.skipped.most_common(1)[0]
                raise FormatError(
                    f"{self.root}: {bad} of the first {tried} frames cannot be used; {count}: {reason}",
                    hint="are the intrinsics, the depth scale and the poses those of this recording?",
                )

    def _read(self, index: int, size: tuple[int, int] | None) -> Frame | None:
        shot = self.shots[index]
        if shot.pose is None:
            self.skipped[shot.fault] += 1
            return None
        try:
            rgb, depth = self.pixels(shot, self.depth_scale, self.invalid_above)
            lens = self.K if shot.lens is None else shot.lens
            if shot.lens is not None and self.size is not None:
                poses.check_intrinsics(lens, self.size, "frame")
            rgb, depth, lens = fit(rgb, depth, lens, self.size, size)
            doubt = check_depth(depth)
        except FormatError as error:
            self.skipped[error.message.partition(": ")[2] or error.message] += 1
            return None
        if doubt is not None:
            self.doubts[doubt] += 1
        return Frame(
            index=index,
            name=shot.name,
            timestamp=shot.timestamp,
            rgb=rgb,
            depth=depth,
            K=lens,
            T_world_camera=shot.pose,
        )


def open_recording(
    path: str | Path,
    *,
    layout: str | None = None,
    lens: NDArray[np.float64] | None = None,
    depth_scale: float | None = None,
) -> Recording:
    """The recording in a folder; layout: one of LAYOUTS, else found by the files there.

    path may be a file where the layout is one of archives. lens: the camera matrix (3, 3), and depth_scale: instead of
    what the layout says. FormatError where it is of no layout, or makes no sense.
    """
    root = Path(path)
    if not root.exists():
        raise FormatError(f"{root}: there is no such recording", hint="check the path")
    if layout is not None and layout not in LAYOUTS:
        raise UsageError(f"there is no layout '{layout}'", hint=did_you_mean(layout, LAYOUTS) or ", ".join(LAYOUTS))
    for name in [layout] if layout is not None else LAYOUTS:
        module: Any = import_module(LAYOUTS[name])
        if layout is not None or module.matches(root):
            found: Recording = module.read(root)
            if lens is not None:
                shots = [replace(shot, lens=None) for shot in found.shots]
                found = replace(found, K=np.asarray(lens, np.float64), shots=shots)
            return checked(found if depth_scale is None else replace(found, depth_scale=depth_scale))
    raise FormatError(
        f"{root} is no recording of a known layout",
        hint=f"known are {', '.join(LAYOUTS)}; a map that was made elsewhere goes to cgdb import",
    )


def checked(recording: Recording) -> Recording:
    """The recording, its shots in order and its intrinsics plausible; FormatError otherwise."""
    root = recording.root
    if not recording.shots:
        raise FormatError(f"{root}: holds no frames", hint=f"expected the layout '{recording.layout}'")
    lens = recording.K
    if lens.shape != (3, 3) or not np.isfinite(lens).all() or lens[0, 0] <= 0 or lens[1, 1] == 0:
        raise FormatError(f"{root}: the intrinsics are no camera matrix", hint="fx and fy in pixels, above 0")
    if not (np.isfinite(recording.depth_scale) and recording.depth_scale > 0):
        raise FormatError(f"{root}: the depth scale must be above 0, not {recording.depth_scale}")
    size = recording.size
    if size is None:
        size = pictures.size_of_any(shot.color for shot in recording.shots[:20])
    if size is not None:
        poses.check_intrinsics(lens, size, str(root))
        recording.doubts.update(poses.doubts(lens, size))
    return recording


def fit(
    rgb: NDArray[np.uint8],
    depth: NDArray[np.float32],
    lens: NDArray[np.float64],
    k_size: tuple[int, int] | None,
    size: tuple[int, int] | None,
) -> tuple[NDArray[np.uint8], NDArray[np.float32], NDArray[np.float64]]:
    """Bring colour and depth to one size, the depth's own where size (width, height) is None, and the matrix with them.

    Depth is never interpolated: between a cup and the wall behind there is nothing. FormatError where the two pictures
    have not the same proportions, or the matrix was made for other ones.
    """
    height, width = depth.shape
    if min(height, width) < SMALLEST_SIDE or max(height, width) > LARGEST_SIDE:
        raise FormatError(f"frame: its depth is {width} x {height}")
    color_height, color_width = rgb.shape[:2]
    _same_shape((color_width, color_height), (width, height), "colour and depth differ in shape")
    base = k_size or (color_width, color_height)
    _same_shape(base, (width, height), "the intrinsics are of another resolution")
    target = size or (width, height)
    if (width, height) != target:
        depth = nearest(depth, target)
    if (color_width, color_height) != target:
        rgb = pictures.resized(rgb, target)
    if base != target:
        # The centre of a pixel is its middle, also in a picture of another size.
        sx, sy = target[0] / base[0], target[1] / base[1]
        lens = lens.copy()
        lens[0] *= sx
        lens[1] *= sy
        lens[0, 2] += 0.5 * (sx - 1.0)
        lens[1, 2] += 0.5 * (sy - 1.0)
    return rgb, depth, lens


def nearest(picture: NDArray[Any], size: tuple[int, int]) -> NDArray[Any]:
    """A picture (h, w, ...) at (width, height), each pixel copied from the nearest."""
    height, width = picture.shape[:2]
    rows = np.minimum(((np.arange(size[1]) + 0.5) * height / size[1]).astype(np.intp), height - 1)
    columns = np.minimum(((np.arange(size[0]) + 0.5) * width / size[0]).astype(np.intp), width - 1)
    taken: NDArray[Any] = picture[rows[:, None], columns]
    return taken


def check_depth(depth: NDArray[np.float32]) -> str | None:
    """What is odd about a depth picture (h, w) in metres, or None. FormatError where it measures nothing, or nothing
    that a building could hold."""
    some = depth[::4, ::4]
    known = some[some > 0]
    if len(known) < 0.01 * some.size:
        raise FormatError("frame: its depth is all but empty")
    middle = float(np.median(known))
    if not 0.03 < middle < LARGEST_DEPTH / 2:
        raise FormatError(f"frame: its depth has a median of {middle:.3g} m, which looks like a wrong scale")
    if not USUAL_DEPTHS[0] <= middle <= USUAL_DEPTHS[1]:
        return f"the middle depth is not {USUAL_DEPTHS[0]} to {USUAL_DEPTHS[1]:.0f} m; is the depth scale right?"
    return None


def _same_shape(a: tuple[int, int], b: tuple[int, int], what: str) -> None:
    if abs(a[0] * b[1] - a[1] * b[0]) > 0.02 * a[0] * b[1]:
        raise FormatError(f"frame: {what}: {a[0]} x {a[1]} and {b[0]} x {b[1]}")
