"""The plan view: seen from above with the ceiling taken off, in metres."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from cgdb.cli import picture_labels, picture_points
from cgdb.cli import picture_style as style
from cgdb.cli.picture_colors import hexes
from cgdb.cli.picture_scene import THING

if TYPE_CHECKING:
    from cgdb.cli.picture_colors import Coloring
    from cgdb.cli.picture_scene import PictureScene


def draw(axes: Any, scene: PictureScene, coloring: Coloring, *, labels: int) -> int:
    """Draw the plan into axes; how many things are named."""
    limits = _limits(axes, scene)
    _grid(axes, limits)
    _rooms(axes, scene)
    if len(scene.points):
        _cloud(axes, scene, coloring, limits)
    _boxes(axes, scene, coloring)
    arrows(axes, scene, scene.centers[:, :2])
    named = picture_labels.place(axes, names(scene, scene.centers[:, :2]), most=labels)
    _scale_bar(axes, limits)
    _compass(axes, scene)
    return named


def _limits(axes: Any, scene: PictureScene) -> tuple[float, float, float, float]:
    """West, east, south, north: the scene with a margin, widened to the shape of the axes."""
    (west, south, _), (east, north, _) = scene.bounds
    box = axes.get_window_extent()
    middle, half = ((west + east) / 2, (south + north) / 2), max((east - west) / 2, (north - south) / 2 * 1e-3, 0.5)
    tall = max((north - south) / 2, 0.5)
    metres = 1.06 * max(2 * half / box.width, 2 * tall / box.height)
    across, along = metres * box.width / 2, metres * box.height / 2
    limits = middle[0] - across, middle[0] + across, middle[1] - along, middle[1] + along
    axes.set_xlim(limits[0], limits[1])
    axes.set_ylim(limits[2], limits[3])
    return limits


def round_length(most: float) -> float:
    """The largest of 1, 2, 5 times a power of ten that is at most so long."""
    base = 10.0 ** math.floor(math.log10(most))
    return base * max(factor for factor in (1, 2, 5) if factor * base <= most * (1 + 1e-9))


def _grid(axes: Any, limits: tuple[float, float, float, float]) -> None:
    step = max(1.0, round_length((limits[1] - limits[0]) / 8))
    for low, high, line in ((limits[0], limits[1], axes.axvline), (limits[2], limits[3], axes.axhline)):
        for number in range(math.ceil(low / step), math.floor(high / step) + 1):
            line(number * step, color=style.FAINT, lw=0.4, alpha=0.7, zorder=0)


def _rooms(axes: Any, scene: PictureScene) -> None:
    from matplotlib.collections import PolyCollection

    shapes = [hull(scene.corners[i, :, :2]) for i in np.flatnonzero(scene.is_place & scene.boxed)]
    shapes = [shape for shape in shapes if len(shape) > 2]
    axes.add_collection(
        PolyCollection(shapes, facecolors=style.ROOM, edgecolors="#a8a293", linewidths=1.1, zorder=0.5), autolim=False
    )


def spacing(points: NDArray[np.float32], owner: NDArray[np.int32], items: int) -> NDArray[np.float32]:
    """(items,) metres between neighbouring points of each thing: as many as the cells of a 10 cm grid hold of it.

    Things of one map differ: the room itself is often kept coarser than what stands in it.
    """
    found = np.full(items, 0.03, np.float32)
    if not len(points):
        return found
    cells = np.floor(points / 0.1).astype(np.int64)
    cells -= cells.min(axis=0)
    sides = cells.max(axis=0) + 1
    flat = ((owner.astype(np.int64) * sides[0] + cells[:, 0]) * sides[1] + cells[:, 1]) * sides[2] + cells[:, 2]
    keys, counts = np.unique(flat, return_counts=True)
    of = keys // int(sides.prod())
    # The median of each thing's cells; those at its rim are emptier.
    order = np.lexsort((counts, of))
    which, first, size = np.unique(of[order], return_index=True, return_counts=True)
    middle = counts[order][first + (size * 3) // 5]
    found[which] = np.clip(0.1 / np.sqrt(middle), 0.004, 0.1)
    return found


def _cloud(axes: Any, scene: PictureScene, coloring: Coloring, limits: tuple[float, float, float, float]) -> None:
    box = axes.get_window_extent()
    factor = 2 if box.width * box.height < 3e6 else 1
    width, height = round(box.width * factor), round(box.height * factor)
    shown = np.flatnonzero((scene.points[:, 2] < scene.ceiling) & ~scene.hidden[scene.owner])
    points = scene.points[shown]
    pixels_per_metre = width / (limits[1] - limits[0])
    pixels = np.stack([(points[:, 0] - limits[0]), (limits[3] - points[:, 1])], axis=1) * np.float32(pixels_per_metre)
    between = spacing(scene.points, scene.owner, len(scene.ids))[scene.owner[shown]]
    radius = np.float32(0.75 * pixels_per_metre) * between
    # Depth counts from above the highest point: small is near.
    depth = np.float32(scene.bounds[1, 2] + 1.0) - points[:, 2]
    canvas = picture_points.splat(pixels.astype(np.float32), depth, radius, coloring.points[shown], width, height)
    canvas = picture_points.shaded(picture_points.filled(canvas, 2), relief=0.35, reach=factor)
    image = picture_points.smaller(canvas.rgba(), factor)
    axes.imshow(image, extent=limits, interpolation="nearest", zorder=1, aspect="auto")


def _boxes(axes: Any, scene: PictureScene, coloring: Coloring) -> None:
    """Outlines over a cloud; where there is no cloud, filled, small things on top of large ones."""
    from matplotlib.collections import PolyCollection

    with_cloud = scene.with_cloud
    colors = hexes(coloring.items)
    chosen = np.flatnonzero(
        scene.boxed & ~scene.is_place & ~scene.hidden & ((scene.kind == THING) | (scene.number > 0))
    )
    shapes = {int(i): hull(scene.corners[i, :, :2]) for i in chosen}
    area = {i: float(np.prod(np.ptp(shape, axis=0))) for i, shape in shapes.items()}
    order = sorted(shapes, key=lambda i: (scene.number[i] > 0, -area[i]))
    seen_through = bool(len(scene.points))
    faces, edges, widths, outlines = [], [], [], []
    for i in order:
        if len(shapes[i]) < 3:
            continue
        marked = bool(scene.number[i])
        outlines.append(shapes[i])
        faces.append((colors[i], _opacity(marked, with_cloud=bool(with_cloud[i]), vast=bool(scene.vast[i]))))
        plain = with_cloud[i] and not marked and not coloring.legend
        edges.append(
            (
                style.INK if plain else colors[i] if marked else darker(colors[i]),
                1.0 if marked else 0.35 if seen_through else 0.75,
            )
        )
        widths.append(1.8 if marked else 0.55 if seen_through else 0.7)
    axes.add_collection(
        PolyCollection(outlines, facecolors=faces, edgecolors=edges, linewidths=widths, zorder=3, joinstyle="round"),
        autolim=False,
    )
    points = [
        i
        for i in np.flatnonzero(
            scene.placed & ~scene.hidden & ~with_cloud & ((scene.kind == THING) | (scene.number > 0))
        )
        if (not scene.is_place[i] or not scene.boxed[i]) and len(shapes.get(int(i), ())) < 3
    ]
    axes.scatter(
        scene.centers[points, 0],
        scene.centers[points, 1],
        s=[20 if scene.number[i] else 4 if scene.is_place[i] else 9 for i in points],
        c=[colors[i] if not scene.is_place[i] or scene.number[i] else style.SOFT for i in points],
        linewidths=0,
        zorder=3.5,
    )


def _opacity(marked: bool, *, with_cloud: bool, vast: bool) -> float:
    """Of the fill of a box: what is marked stands out, and what has points is seen through."""
    if marked:
        return 0.16 if with_cloud else 0.5
    return 0.0 if with_cloud else 0.05 if vast else 0.3


def darker(color: str, share: float = 0.3) -> str:
    """The colour, mixed with ink: for lines on its own fill."""
    return hexes(style.blend(style.rgb([color]), style.INK, np.array([share])))[0]


def names(scene: PictureScene, at: NDArray[np.float64]) -> list[picture_labels.Name]:
    """What may be named, the most important first: the result by its rows, rooms, then things by size."""
    shown = np.isfinite(at).all(axis=1) & ~scene.hidden
    size = np.where(scene.boxed, np.ptp(scene.corners, axis=1).prod(axis=1), 0.0)
    found = []
    for i in np.flatnonzero(shown & (scene.number > 0)).tolist():
        ink = style.FITS if scene.fits[i] else style.NEAR
        text = f"{scene.number[i]}  {_called(scene, i)}".strip()
        found.append(
            (0, float(scene.number[i]), i, picture_labels.Name(text=text, x=at[i, 0], y=at[i, 1], strong=True, ink=ink))
        )
    rest = shown & (scene.number == 0)
    for i in np.flatnonzero(rest & scene.is_place & scene.boxed).tolist():
        name = picture_labels.Name(text=style.label(scene.names[i]), x=at[i, 0], y=at[i, 1], quiet=True, ink=style.SOFT)
        found.append((1, -float(size[i]), i, name))
    things = rest & ~scene.is_place & (scene.kind == THING)
    if not scene.has_result:
        found.extend(
            (2, -float(size[i]), i, picture_labels.Name(text=_called(scene, i), x=at[i, 0], y=at[i, 1]))
            for i in np.flatnonzero(things).tolist()
        )
    return [name for _, _, _, name in sorted(found, key=lambda item: item[:3])]


def _called(scene: PictureScene, item: int) -> str:
    return style.label(scene.names[item]) or style.label(f"#{scene.ids[item]}")


def arrows(axes: Any, scene: PictureScene, at: NDArray[np.float64]) -> None:
    """The relations asked for, each from its source to its target, one colour a label."""
    from matplotlib.patches import FancyArrowPatch

    inks = arrow_inks(scene)
    for arrow in scene.arrows:
        ends = at[[arrow.source, arrow.target]]
        if not np.isfinite(ends).all() or scene.hidden[[arrow.source, arrow.target]].any():
            continue
        axes.add_patch(
            FancyArrowPatch(
                tuple(ends[0]),
                tuple(ends[1]),
                arrowstyle="-|>",
                mutation_scale=6,
                connectionstyle="arc3,rad=0.12",
                color=inks[arrow.label],
                lw=0.8,
                alpha=0.8,
                shrinkA=1,
                shrinkB=1,
                zorder=5,
            )
        )


def arrow_inks(scene: PictureScene) -> dict[str, str]:
    """{label of a relation: its colour}"""
    labels = list(dict.fromkeys(arrow.label for arrow in scene.arrows))
    return {label: style.ARROWS[number % len(style.ARROWS)] for number, label in enumerate(sorted(labels))}


def _scale_bar(axes: Any, limits: tuple[float, float, float, float]) -> None:
    """A round length at the lower left, black on white so that it is read over any cloud."""
    from matplotlib.patheffects import withStroke

    across, along = limits[1] - limits[0], limits[3] - limits[2]
    length = round_length(across / 6)
    x, y = limits[0] + 0.025 * across, limits[2] + 0.035 * along
    tick = 0.008 * along
    halo = [withStroke(linewidth=3, foreground=style.PAPER)]
    xs, ys = [x, x, x, x + length, x + length, x + length], [y + tick, y - tick, y, y, y + tick, y - tick]
    axes.plot(xs, ys, color=style.INK, lw=1.2, zorder=10, path_effects=halo, solid_capstyle="butt")
    text = f"{length:g} m" if length >= 1 else f"{100 * length:g} cm"
    axes.text(x + length / 2, y + 1.6 * tick, text, ha="center", va="bottom", fontsize=7, zorder=10, path_effects=halo)


def _compass(axes: Any, scene: PictureScene) -> None:
    """Where the scene's axes point, at the lower right."""
    compass(axes, {scene.axes[0]: (18.0, 0.0), scene.axes[1]: (0.0, 18.0)})


def compass(axes: Any, arms: dict[str, tuple[float, float]]) -> None:
    """Arrows from a point at the lower right. arms: {name: right and up, in points}."""
    from matplotlib.patheffects import withStroke

    box, point = axes.get_window_extent(), axes.figure.dpi / 72
    at = (1 - 42 * point / box.width, 24 * point / box.height)
    look = {"textcoords": "offset points", "xycoords": "axes fraction", "zorder": 10}
    arrow = {"arrowstyle": "<|-", "color": style.INK, "lw": 1.0, "shrinkA": 0, "shrinkB": 0, "mutation_scale": 7}
    for name, (across, up) in arms.items():
        axes.annotate("", at, (across, up), arrowprops=arrow, **look)
        length = max(1e-6, (across**2 + up**2) ** 0.5)
        where = (across * (1 + 7 / length), up * (1 + 7 / length))
        halo = [withStroke(linewidth=3, foreground=style.PAPER)]
        axes.annotate(name, at, where, fontsize=7, ha="center", va="center", path_effects=halo, **look)


def hull(points: NDArray[np.float64]) -> NDArray[np.float64]:
    """The convex hull of a few points (k, 2), counter-clockwise (Andrew's monotone chain)."""
    points = np.unique(points.round(6), axis=0)
    if len(points) < 3:
        return points
    ordered = [(float(x), float(y)) for x, y in points]

    def chain(line: list[tuple[float, float]]) -> list[tuple[float, float]]:
        found: list[tuple[float, float]] = []
        for p in line:
            while len(found) > 1:
                (ax, ay), (bx, by) = found[-2], found[-1]
                if (bx - ax) * (p[1] - ay) - (by - ay) * (p[0] - ax) > 0:
                    break
                found.pop()
            found.append(p)
        return found[:-1]

    return np.asarray(chain(ordered) + chain(ordered[::-1]))
