"""Names on a picture: the most important first, each beside its thing where it covers no other name, or not at all."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from cgdb.cli import picture_style as style


@dataclass(frozen=True, slots=True, kw_only=True)
class Name:
    """text: as drawn. x, y: where its thing is, in the data of the axes. strong: of a result. ink: its colour."""

    text: str
    x: float
    y: float
    strong: bool = False
    quiet: bool = False
    ink: str = style.INK


_DIRECTIONS = ((0, 1), (1, 1), (-1, 1), (1, 0), (-1, 0), (0, -1), (1, -1), (-1, -1))
_STEPS = (0.0, 9.0, 18.0, 30.0, 46.0)
"""Points by which a name may stand off its thing; a line leads there where it is far."""


def place(axes: Any, names: Sequence[Name], *, size: float = 7.0, most: int) -> int:
    """Draw the names, at most so many of them; how many found room. The limits of the axes must be final."""
    from matplotlib.patheffects import withStroke

    figure = axes.figure
    renderer = figure.canvas.get_renderer()
    pixels = figure.dpi / 72.0
    inside = axes.get_window_extent(renderer)
    taken: list[tuple[float, float, float, float]] = []
    drawn = 0
    halo = [withStroke(linewidth=2.2, foreground=style.PAPER, alpha=0.9)]
    for name in names:
        if drawn >= most:
            break
        if not name.text:
            continue
        points = size + (1.0 if name.strong else -0.5 if name.quiet else 0.0)
        weight = "bold" if name.strong else "normal"
        width, height = _extent(renderer, name.text, points, weight, pixels)
        x, y = axes.transData.transform((name.x, name.y))
        spot = _free(x, y, width, height, inside, taken, pixels, name.strong)
        if spot is None:
            continue
        left, bottom, step = spot
        taken.append((left, bottom, left + width, bottom + height))
        drawn += 1
        centre = (left + width / 2, bottom + height / 2)
        if step >= 9.0:
            end = (min(max(x, left), left + width), min(max(y, bottom), bottom + height))
            line = axes.transData.inverted().transform([(x, y), end])
            axes.plot(*line.T, color=name.ink, lw=0.6, alpha=0.8, zorder=8, solid_capstyle="round")
            axes.plot(name.x, name.y, "o", ms=1.8, color=name.ink, zorder=8)
        at = axes.transData.inverted().transform(centre)
        axes.text(
            *at,
            name.text,
            fontsize=points,
            weight=weight,
            style="italic" if name.quiet else "normal",
            color=name.ink,
            ha="center",
            va="center",
            parse_math=False,
            path_effects=halo,
            zorder=9,
        )
    return drawn


def _extent(renderer: Any, text: str, points: float, weight: str, pixels: float) -> tuple[float, float]:
    """Width and height in pixels, with a little air."""
    from matplotlib.font_manager import FontProperties

    properties = FontProperties(size=points, weight=weight)
    width, _, _ = renderer.get_text_width_height_descent(text, properties, False)
    return float(width) + 3 * pixels, 1.3 * points * pixels


def _free(
    x: float,
    y: float,
    width: float,
    height: float,
    inside: Any,
    taken: Sequence[tuple[float, float, float, float]],
    pixels: float,
    beside: bool,
) -> tuple[float, float, float] | None:
    """Left, bottom and distance of the nearest place where the name covers no other and stays in the picture.

    beside: not on the thing itself, which is what is to be seen.
    """
    for step in _STEPS[1:] if beside else _STEPS:
        for across, up in ((0, 0),) if step == 0.0 else _DIRECTIONS:
            off = step * pixels
            left = x - width / 2 + across * (off + width / 2)
            bottom = y - height / 2 + up * (off + height / 2 if step else 0)
            if left < inside.x0 or left + width > inside.x1 or bottom < inside.y0 or bottom + height > inside.y1:
                continue
            if not any(left < c and a < left + width and bottom < d and b < bottom + height for a, b, c, d in taken):
                return left, bottom, step
    return None
