"""The oblique view: in perspective from above a corner, the ceiling and the near walls taken off."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from cgdb.cli import picture_labels, picture_points
from cgdb.cli import picture_style as style
from cgdb.cli.picture_colors import hexes
from cgdb.cli.picture_plan import arrows, compass, darker, names, round_length, spacing
from cgdb.cli.picture_scene import THING, WALL

if TYPE_CHECKING:
    from cgdb.cli.picture_colors import Coloring
    from cgdb.cli.picture_scene import PictureScene

ELEVATION, TURN = 42.0, 28.0
"""Degrees: of the eye above the floor, and off the normal of the scene's longer side; less for a long scene."""
DISTANCE = 2.6
"""Of the eye from the middle, in radii of the scene: near enough for depth, far enough to keep lines straight."""
_EDGES = np.array([(i, i | bit) for i in range(8) for bit in (1, 2, 4) if not i & bit])
_FACES = np.array([(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)])
"""Corners around each face, seen from outside counter-clockwise: -a, +a, -b, +b, -c, +c."""
_PIECES = 24
"""Of an edge, each seen or hidden by the cloud."""
_THIN = 0.4
"""Metres: a wall of this thickness is one sheet, seen from the room; a thicker box has a wall on each side."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Camera:
    """eye (3,) m; turn (3, 3) rows: right, up and towards the scene; middle, scale: to the units of the axes."""

    eye: NDArray[np.float64]
    turn: NDArray[np.float64]

    def project(self, points: NDArray[Any]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """(..., 2) right and up, as tangents of the angles from the middle of the view; (...) depth in metres."""
        seen = (points - self.eye) @ self.turn.T
        depth = seen[..., 2]
        with np.errstate(divide="ignore", invalid="ignore"):
            flat = seen[..., :2] / np.where(depth > 1e-6, depth, np.nan)[..., None]
        return flat, depth


def camera(scene: PictureScene) -> Camera:
    """An eye that looks at the middle of the scene over its longer side, so that it fills a wide picture."""
    low, high = scene.bounds
    top = min(float(high[2]), scene.ceiling)
    middle = np.array([(low[0] + high[0]) / 2, (low[1] + high[1]) / 2, (low[2] + top) / 2])
    radius = max(0.5, float(np.linalg.norm([*(high - low)[:2], top - low[2]])) / 2)
    base = -90.0 if high[0] - low[0] >= high[1] - low[1] else 0.0
    sides = np.sort((high - low)[:2])
    turn = TURN * min(1.0, 1.7 * float(sides[0]) / max(float(sides[1]), 1e-6))
    azimuth, elevation = math.radians(base + turn), math.radians(ELEVATION)
    flat = math.cos(elevation)
    towards_eye = np.array([flat * math.cos(azimuth), flat * math.sin(azimuth), math.sin(elevation)])
    right = np.cross([0.0, 0.0, 1.0], towards_eye)
    right /= np.linalg.norm(right)
    return Camera(
        eye=middle + DISTANCE * radius * towards_eye,
        turn=np.stack([right, np.cross(towards_eye, right), -towards_eye]),
    )


def draw(axes: Any, scene: PictureScene, coloring: Coloring, *, labels: int) -> int:
    """Draw the view into axes; how many things are named."""
    eye = camera(scene)
    shown = np.flatnonzero((scene.points[:, 2] < scene.ceiling) & ~scene.hidden[scene.owner])
    shown = shown[~_near_walls(scene, eye, shown)]
    flat, depth = eye.project(scene.points[shown])
    limits = _limits(axes, scene, eye, flat)
    _grid(axes, scene, eye)
    _rooms(axes, scene, eye)
    canvas = None
    if len(shown):
        between = spacing(scene.points, scene.owner, len(scene.ids))
        canvas = _cloud(axes, flat, depth, coloring.points[shown], between[scene.owner[shown]], limits)
    _faces(axes, scene, coloring, eye)
    _wires(axes, scene, coloring, eye, canvas, limits)
    tops = scene.centers.copy()
    boxed = scene.boxed
    tops[boxed, 2] = scene.corners[boxed, :, 2].max(axis=1)
    at, _ = eye.project(np.where(scene.is_place[:, None], scene.centers, tops))
    arrows(axes, scene, eye.project(scene.centers)[0])
    named = picture_labels.place(axes, names(scene, at), most=labels)
    _compass(axes, scene, eye)
    return named


def _limits(
    axes: Any, scene: PictureScene, eye: Camera, flat: NDArray[np.float64]
) -> tuple[float, float, float, float]:
    """Left, right, bottom, top of what is seen, with a margin, widened to the shape of the axes."""
    low, high = scene.bounds.copy()
    high[2] = min(high[2], scene.ceiling)
    if len(flat):
        ends = np.quantile(flat, [0.001, 0.999], axis=0)
        floor = np.array([[x, y, low[2]] for x in (low[0], high[0]) for y in (low[1], high[1])])
        ends = np.concatenate([ends, eye.project(floor)[0]])
    else:
        box = np.array([[x, y, z] for x in (low[0], high[0]) for y in (low[1], high[1]) for z in (low[2], high[2])])
        ends = eye.project(box)[0]
    (left, bottom), (right, top) = ends.min(axis=0).tolist(), ends.max(axis=0).tolist()
    box = axes.get_window_extent()
    unit = 1.08 * max((right - left) / box.width, (top - bottom) / box.height, 1e-6)
    across, along = unit * box.width / 2, unit * box.height / 2
    limits = (
        (left + right) / 2 - across,
        (left + right) / 2 + across,
        (bottom + top) / 2 - along,
        (bottom + top) / 2 + along,
    )
    axes.set_xlim(limits[0], limits[1])
    axes.set_ylim(limits[2], limits[3])
    return limits


def _near_walls(scene: PictureScene, eye: Camera, shown: NDArray[np.int64]) -> NDArray[np.bool_]:
    """Which of these points lie on walls between the eye and the room.

    A wall's own box tells where it looks: a thin one stands on one side of the room; one around the whole room has a
    wall on each of its upright sides, and a point belongs to the nearest.
    """
    off = np.zeros(len(shown), np.bool_)
    middle = scene.bounds.mean(axis=0)
    back = -eye.turn[2]
    owner = scene.owner[shown]
    for i in np.flatnonzero((scene.kind == WALL) & scene.boxed & (scene.number == 0)):
        mine = np.flatnonzero(owner == i)
        if not len(mine):
            continue
        corners, center = scene.corners[i], scene.centers[i]
        sides = np.stack([corners[4] - corners[0], corners[2] - corners[0], corners[1] - corners[0]])
        lengths = np.linalg.norm(sides, axis=1)
        normals = sides / np.maximum(lengths, 1e-9)[:, None]
        level = np.flatnonzero((np.abs(normals[:, 2]) < 0.5) & (lengths > 1e-6))
        if not len(level):
            continue
        thin = level[np.argmin(lengths[level])]
        if lengths[thin] < _THIN:
            outward = normals[thin] * (1.0 if (center - middle) @ normals[thin] >= 0 else -1.0)
            off[mine] = outward @ back > 0.05
            continue
        local = (scene.points[shown[mine]] - center) @ normals[level].T
        gap = np.concatenate([lengths[level] / 2 - local, lengths[level] / 2 + local], axis=1)
        looks = np.concatenate([normals[level], -normals[level]]) @ back
        off[mine] = looks[np.argmin(gap, axis=1)] > 0.05
    return off


def _segments(axes: Any, lines: NDArray[np.float64], **look: Any) -> None:
    from matplotlib.collections import LineCollection

    lines = lines[np.isfinite(lines).all(axis=(1, 2))]
    if len(lines):
        axes.add_collection(LineCollection(list(lines), **look), autolim=False)


def _grid(axes: Any, scene: PictureScene, eye: Camera) -> None:
    """The floor as squares: a scale that holds in perspective."""
    low, high = scene.bounds
    step = grid_step(scene)
    xs, ys = (
        np.unique([low[k], *np.arange(math.ceil(low[k] / step), math.floor(high[k] / step) + 1) * step, high[k]])
        for k in (0, 1)
    )
    lines = [[(x, ys[0], low[2]), (x, ys[-1], low[2])] for x in xs]
    lines += [[(xs[0], y, low[2]), (xs[-1], y, low[2])] for y in ys]
    _segments(axes, eye.project(np.array(lines))[0], colors=style.FAINT, linewidths=0.6, zorder=0)


def grid_step(scene: PictureScene) -> float:
    """The side of the squares of the floor, in metres."""
    low, high = scene.bounds
    return max(0.1, round_length(max(float((high - low)[:2].max()), 1.0) / 5))


def _rooms(axes: Any, scene: PictureScene, eye: Camera) -> None:
    """The floors of rooms."""
    from matplotlib.collections import PolyCollection

    rooms = np.flatnonzero(scene.is_place & scene.boxed)
    if not len(rooms):
        return
    corners = scene.corners[rooms]
    floors = np.take_along_axis(corners, np.argsort(corners[:, :, 2], axis=1, kind="stable")[:, :4, None], axis=1)
    middle = floors.mean(axis=1, keepdims=True)
    around = np.argsort(np.arctan2(*np.moveaxis(floors - middle, -1, 0)[1::-1]), axis=1)
    flat, _ = eye.project(np.take_along_axis(floors, around[..., None], axis=1))
    axes.add_collection(
        PolyCollection(
            list(flat[np.isfinite(flat).all(axis=(1, 2))]),
            facecolors=style.ROOM,
            edgecolors="#a8a293",
            linewidths=0.9,
            zorder=0.5,
        ),
        autolim=False,
    )


def _cloud(
    axes: Any,
    flat: NDArray[np.float64],
    depth: NDArray[np.float64],
    colors: NDArray[np.uint8],
    between: NDArray[np.float32],
    limits: tuple[float, float, float, float],
) -> picture_points.Canvas:
    """Draw the points; the canvas tells which edges of boxes they hide."""
    box = axes.get_window_extent()
    factor = 2 if box.width * box.height < 3e6 else 1
    width, height = round(box.width * factor), round(box.height * factor)
    unit = width / (limits[1] - limits[0])
    pixels = np.stack([flat[:, 0] - limits[0], limits[3] - flat[:, 1]], axis=1) * unit
    radius = 0.75 * between * unit / depth
    drawn = picture_points.splat(
        pixels.astype(np.float32), depth.astype(np.float32), radius.astype(np.float32), colors, width, height
    )
    drawn = picture_points.filled(drawn, 2)
    image = picture_points.shaded(drawn, relief=0.3, reach=factor)
    axes.imshow(
        picture_points.smaller(image.rgba(), factor), extent=limits, interpolation="nearest", zorder=1, aspect="auto"
    )
    return drawn


def _faces(axes: Any, scene: PictureScene, coloring: Coloring, eye: Camera) -> None:
    """Boxes of things without a cloud, filled: the sides that look at the eye, far boxes first."""
    from matplotlib.collections import PolyCollection

    with_cloud = scene.with_cloud
    chosen = scene.boxed & ~scene.is_place & ~with_cloud & ~scene.hidden & (scene.vast < 1) & (scene.kind == THING)
    chosen |= scene.boxed & ~with_cloud & (scene.number > 0)
    items = np.flatnonzero(chosen)
    if not len(items):
        return
    # The farthest box first: what is nearer is drawn over it.
    items = items[np.argsort(-np.linalg.norm(scene.centers[items] - eye.eye, axis=1), kind="stable")]
    around = scene.corners[items][:, _FACES]  # (m, 6, 4, 3)
    middle = around.mean(axis=2)
    normal = np.cross(around[:, :, 1] - around[:, :, 0], around[:, :, 3] - around[:, :, 0])
    length = np.linalg.norm(normal, axis=2)
    normal /= np.maximum(length, 1e-12)[..., None]
    # Outwards, also where the map's axes are left-handed.
    normal *= np.where((normal * (middle - scene.centers[items][:, None])).sum(axis=2) < 0, -1.0, 1.0)[..., None]
    box, side = np.nonzero((length > 1e-9) & ((normal * (eye.eye - middle)).sum(axis=2) > 0))
    normal, owner = normal[box, side], items[box]
    light = 0.72 + 0.28 * np.maximum(normal[:, 2], 0.0) - 0.1 * np.abs(normal @ eye.turn[0])
    marked = scene.number[owner] > 0
    rest = np.full(len(owner), 0.25) if scene.has_result else 0.6 - 0.4 * scene.vast[owner]
    paint = coloring.items[owner] / 255
    faces = list(eye.project(around[box, side])[0])
    colors = np.column_stack([paint * light[:, None], np.where(marked, 0.85, rest)])
    edges = np.column_stack([paint * 0.55, np.where(marked | (not scene.has_result), 0.9, 0.4)])
    axes.add_collection(
        PolyCollection(faces, facecolors=colors, edgecolors=edges, linewidths=0.5, zorder=2, joinstyle="round"),
        autolim=False,
    )


def _wires(
    axes: Any,
    scene: PictureScene,
    coloring: Coloring,
    eye: Camera,
    canvas: picture_points.Canvas | None,
    limits: tuple[float, float, float, float],
) -> None:
    """Boxes around clouds as lines, fainter where the cloud is before them; points where there is no box."""
    with_cloud = scene.with_cloud
    shown = scene.boxed & ~scene.is_place & ~scene.hidden
    for marked in (False, True):
        chosen = shown & (with_cloud | (scene.vast >= 1) if not marked else True) & ((scene.number > 0) == marked)
        if not marked:
            chosen &= scene.kind == THING
        items = np.flatnonzero(chosen)
        plain = not marked and not coloring.legend
        inks = [style.INK if plain else color if marked else darker(color) for color in hexes(coloring.items[items])]
        for seen, lines, which in _pieces(scene.corners[items], eye, canvas, limits):
            strength = (1.0 if seen else 0.35) if marked else (0.4 if seen else 0.07)
            _segments(
                axes,
                lines,
                colors=[(inks[k]) for k in which],
                alpha=strength,
                linewidths=1.5 if marked else 0.6,
                capstyle="round",
                zorder=4 if marked else 3,
            )
    bare = scene.placed & ~scene.boxed & ~with_cloud & ~scene.hidden
    flat, _ = eye.project(scene.centers[bare])
    colors = np.where(scene.is_place[bare, None], style.rgb([style.SOFT]), coloring.items[bare]) / 255
    sizes = np.where(scene.number[bare] > 0, 22, np.where(scene.is_place[bare], 4, 10))
    axes.scatter(flat[:, 0], flat[:, 1], s=sizes, c=colors, linewidths=0, zorder=3.5)


def _pieces(
    corners: NDArray[np.float64],
    eye: Camera,
    canvas: picture_points.Canvas | None,
    limits: tuple[float, float, float, float],
) -> list[tuple[bool, NDArray[np.float64], NDArray[np.int64]]]:
    """(seen, lines (k, 2, 2), box of each) of the edges of boxes, cut where they pass behind the cloud."""
    ends = corners[:, _EDGES]  # (m, 12, 2, 3)
    share = np.linspace(0.0, 1.0, _PIECES + 1)[:, None]
    along = ends[:, :, 0, None] * (1 - share) + ends[:, :, 1, None] * share  # (m, 12, pieces + 1, 3)
    flat, depth = eye.project(along)
    middle, far = (flat[:, :, 1:] + flat[:, :, :-1]) / 2, (depth[:, :, 1:] + depth[:, :, :-1]) / 2
    behind = np.zeros(far.shape, np.bool_)
    if canvas is not None:
        height, width = canvas.depth.shape
        with np.errstate(invalid="ignore"):
            column = np.nan_to_num((middle[..., 0] - limits[0]) / (limits[1] - limits[0]) * width, nan=-1).astype(int)
            row = np.nan_to_num((limits[3] - middle[..., 1]) / (limits[3] - limits[2]) * height, nan=-1).astype(int)
        inside = (column >= 0) & (column < width) & (row >= 0) & (row < height)
        front = canvas.depth[np.clip(row, 0, height - 1), np.clip(column, 0, width - 1)]
        behind = inside & (front < far - 0.06)
    found = []
    for seen in (True, False):
        # Runs of pieces alike become one line: few objects for a PDF, and no gaps between them.
        alike = np.pad(behind != seen, ((0, 0), (0, 0), (1, 1)))
        begin = np.argwhere(alike[..., 1:] & ~alike[..., :-1])
        end = np.argwhere(~alike[..., 1:] & alike[..., :-1])
        box, edge = begin[:, 0], begin[:, 1]
        lines = np.stack([flat[box, edge, begin[:, 2]], flat[box, edge, end[:, 2]]], axis=1)
        whole = np.isfinite(lines).all(axis=(1, 2))
        found.append((seen, lines[whole].reshape(-1, 2, 2), box[whole]))
    return found


def _compass(axes: Any, scene: PictureScene, eye: Camera) -> None:
    """Where the scene's axes point, as they do in the middle of the view."""
    compass(axes, {name: tuple(20.0 * eye.turn[:2, axis]) for axis, name in enumerate(scene.axes)})
