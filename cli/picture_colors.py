"""Which colour every thing and every point of a picture has: as seen, by class, by instance or by score."""

from __future__ import annotations

from collections import defaultdict
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from cgdb.cli import picture_style as style
from cgdb.cli.picture_scene import CEILING, FLOOR, THING, WALL
from cgdb.errors import UsageError
from cgdb.export.cloud import distinct

if TYPE_CHECKING:
    from cgdb.cli.picture_scene import PictureScene

_DIMMED = 0.45
"""How far what is not in the result is moved towards the paper."""
_LIGHT = {THING: 0.0, WALL: 0.5, FLOOR: 0.35, CEILING: 0.5}
"""How far the room itself is moved towards the paper, so that things stand out of it."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Coloring:
    """items (m, 3) and points (n, 3) uint8. legend: (name, colour) of classes; scale: least and largest score."""

    items: NDArray[np.uint8]
    points: NDArray[np.uint8]
    legend: tuple[tuple[str, str], ...] = ()
    scale: tuple[float, float] | None = None


def coloring(scene: PictureScene, by: str | None) -> Coloring:
    """The colours of a scene; by None: as seen where the map has colours, else by class. UsageError where it cannot."""
    if by == "rgb" and scene.colors is None:
        raise UsageError(
            f"scene '{scene.name}' has no coloured points: it cannot be drawn by rgb",
            hint="--color class, or leave it out",
        )
    if by == "score" and not scene.has_result:
        raise UsageError(
            "--color score shows the scores of a result", hint="add --query 'MATCH (o ~ \"...\") RETURN o'"
        )
    legend: tuple[tuple[str, str], ...] = ()
    scale = None
    if by == "instance":
        items = distinct(len(scene.ids))
    elif by == "score":
        items, scale = _by_score(scene)
    else:
        items, legend = _by_class(scene)
    as_seen = scene.colors is not None and by in (None, "rgb")
    points = scene.colors if as_seen and scene.colors is not None else items[scene.owner]
    marked = scene.number > 0
    light = np.array([_LIGHT[kind] for kind in range(4)], np.float32)[scene.kind]
    light[marked] = 0.0
    points = style.blend(points, style.PAPER, light[scene.owner])
    if scene.has_result:
        rest = ~marked[scene.owner]
        points[rest] = style.greyed(points[rest], _DIMMED)
        if by != "instance":
            items = items.copy()
            items[~marked] = style.rgb([style.OTHER])
        if by in (None, "rgb"):
            items[marked & scene.fits] = style.rgb([style.FITS])
            items[marked & ~scene.fits] = style.rgb([style.NEAR])
            legend = ()
    return Coloring(items=items, points=points, legend=() if as_seen else legend, scale=scale)


def _by_class(scene: PictureScene) -> tuple[NDArray[np.uint8], tuple[tuple[str, str], ...]]:
    """The names that cover most of the floor have a colour of their own; the room itself is paler than any of them."""
    things = (scene.kind == THING) & ~scene.is_place & ~scene.hidden
    names = [name.strip().casefold() for name in scene.names]
    # The root, so that many small things count against a few large ones.
    sides = np.nan_to_num(np.ptp(scene.corners[:, :, :2], axis=1).prod(axis=1)) ** 0.5 + 0.05
    covered: dict[str, float] = defaultdict(float)
    called: dict[str, str] = {}
    for i in np.flatnonzero(things).tolist():
        if names[i]:
            covered[names[i]] += float(sides[i])
            called.setdefault(names[i], scene.names[i])
    ranked = sorted(covered, key=lambda name: (-covered[name], name))
    colors = dict(zip(ranked, style.CLASSES, strict=False))
    items = style.rgb([colors.get(name, style.OTHER) for name in names])
    items[~things] = style.rgb([style.FAINT])
    return items, tuple((style.label(called[name]), color) for name, color in colors.items())


def _by_score(scene: PictureScene) -> tuple[NDArray[np.uint8], tuple[float, float]]:
    """Cividis, which is even in lightness and the same to colour-blind people; from the least score to the largest."""
    from matplotlib import colormaps

    marked = np.isfinite(scene.score)
    low, high = float(scene.score[marked].min()), float(scene.score[marked].max())
    if high - low < 1e-9:
        low = min(0.0, low)
    share = np.nan_to_num((scene.score - low) / max(high - low, 1e-9))
    items = (np.asarray(colormaps["cividis"](np.clip(share, 0, 1)))[:, :3] * 255).astype(np.uint8)
    items[~marked] = style.rgb([style.OTHER])
    return items, (low, high)


def hexes(colors: NDArray[np.uint8]) -> list[str]:
    """#rrggbb of (n, 3) uint8."""
    return [f"#{red:02x}{green:02x}{blue:02x}" for red, green, blue in colors.tolist()]
