"""A picture of a scene: title, views and legend on one sheet, as the bytes of a PNG, SVG, PDF, JPEG or WebP file."""

from __future__ import annotations

import io
import math
import warnings
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from cgdb.cli import picture_style as style
from cgdb.errors import MissingExtraError, UsageError, one_of

if TYPE_CHECKING:
    from cgdb.cli.picture_colors import Coloring
    from cgdb.cli.picture_scene import PictureScene

VIEWS = ("plan", "oblique", "both")
ENDINGS = (".png", ".pdf", ".svg", ".jpg", ".jpeg", ".webp")
LABELS = 40
LARGEST, SMALLEST = 10_000, 200
MOST_PIXELS = 50_000_000
_TITLE, _FOOT = 0.52, 0.34
"""Inches of the sheet above and below the views."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Sheet:
    """view: one of VIEWS. color: rgb, class, score or instance, None for what suits the map. labels: at most so many
    names. size: width and height in pixels, None for what suits the view. title, note: the lines above the picture.
    """

    view: str = "plan"
    color: str | None = None
    labels: int = LABELS
    size: tuple[int, int] | None = None
    title: str = ""
    note: str = ""


@dataclass(frozen=True, slots=True, kw_only=True)
class Picture:
    """data: the file. named: how many things have their name on it, in the view with most."""

    data: bytes
    named: int


def parse_size(text: str) -> tuple[int, int]:
    """Width and height in pixels of "1600x1200"; UsageError where it is none, or larger than memory allows."""
    width, _, height = text.casefold().partition("x")
    if not (width.isascii() and width.isdigit() and height.isascii() and height.isdigit() and len(text) < 16):
        raise UsageError(f"--size {text[:30]!r} is no size in pixels", hint="such as --size 1600x1200")
    size = int(width), int(height)
    if min(size) < SMALLEST or max(size) > LARGEST or size[0] * size[1] > MOST_PIXELS:
        raise UsageError(
            f"--size {text[:30]}: sides must have {SMALLEST} to {LARGEST} pixels, "
            f"and a picture at most {MOST_PIXELS // 1_000_000} million"
        )
    return size


def require() -> None:
    """MissingExtraError where there is no matplotlib: to be known before anything is asked or read."""
    try:
        import matplotlib.figure  # noqa: F401
    except ImportError as error:
        raise MissingExtraError("matplotlib is not installed", hint="pip install 'cgdb[plot]'") from error


def paint(scene: PictureScene, ending: str, sheet: Sheet) -> Picture:
    """Draw the sheet. ending: of the file's name, one of ENDINGS. No display is needed or opened."""
    require()
    import matplotlib
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    from cgdb.cli import picture_oblique, picture_plan
    from cgdb.cli.picture_colors import coloring

    if sheet.view not in VIEWS:
        raise UsageError(f"there is no view '{sheet.view}'", hint=one_of(VIEWS))
    if not scene.placed.any() and not len(scene.points):
        raise UsageError(f"scene '{scene.name}' has no positions to draw")
    colors = coloring(scene, sheet.color)
    views = ("plan", "oblique") if sheet.view == "both" else (sheet.view,)
    (width, height), (columns, rows) = _format(scene, sheet.size, len(views))
    # The same sheet in any size: letters and lines grow with it.
    dpi = max(50.0, (width * height / (columns * rows)) ** 0.5 / 7.0)
    with matplotlib.rc_context(style.settings()), warnings.catch_warnings():
        warnings.filterwarnings("ignore", message=".*(G|g)lyph.*")  # a letter that no font has is drawn as a box
        figure = Figure(figsize=(width / dpi, height / dpi), dpi=dpi, facecolor=style.PAPER)
        FigureCanvasAgg(figure)
        foot, top = _FOOT * dpi / height, 1 - _TITLE * dpi / height
        named = 0
        for number, view in enumerate(views):
            column, row = number % columns, number // columns
            left, right = column / columns, (column + 1) / columns
            upper, lower = top - row * (top - foot) / rows, top - (row + 1) * (top - foot) / rows
            axes = figure.add_axes((left, lower, right - left, upper - lower))
            axes.set_axis_off()
            painter = picture_plan if view == "plan" else picture_oblique
            named = max(named, painter.draw(axes, scene, colors, labels=sheet.labels))
        _title(figure, scene, sheet, dpi)
        _legend(figure, scene, colors, "oblique" in views, dpi)
        return Picture(data=_file(figure, ending, dpi), named=named)


def _format(scene: PictureScene, size: tuple[int, int] | None, n: int) -> tuple[tuple[int, int], tuple[int, int]]:
    """(width, height) in pixels and (columns, rows) of n views that suit the shape of the place: a corridor is long."""
    across, along, _ = (scene.bounds[1] - scene.bounds[0]).tolist()
    shape = min(3.0, max(1 / 3, max(across, 0.1) / max(along, 0.1)))
    grids = [(n, 1)] if n == 1 else [(n, 1), (1, n)]
    if size is None:
        # A view of about two million pixels, a little squarer than the place.
        wide = (1.9e6 * shape**0.75) ** 0.5
        view = round(wide / 20) * 20, round(1.9e6 / wide / 20) * 20 + 60
        columns, rows = grids[-1] if shape > 1.5 else grids[0]
        return (view[0] * columns, view[1] * rows), (columns, rows)

    def off(grid: tuple[int, int]) -> float:
        return abs(math.log(size[0] / grid[0] / (size[1] / grid[1]) / shape))

    return size, min(grids, key=off)


def _title(figure: Any, scene: PictureScene, sheet: Sheet, dpi: float) -> None:
    width, height = figure.get_size_inches()
    left, line = 0.18 / width, 1 / (72 * height)
    letters = int(width * 15)
    title = figure.text(left, 1 - 18 * line, style.label(sheet.title or scene.name, letters), weight="bold")
    title.set(fontsize=11, va="center", parse_math=False)
    note = figure.text(left, 1 - 31 * line, style.label(sheet.note, int(width * 19)), color=style.SOFT)
    note.set(fontsize=7, va="center", parse_math=False)


def _legend(figure: Any, scene: PictureScene, colors: Coloring, oblique: bool, dpi: float) -> None:
    """One line at the foot: what colours and arrows mean, and how large a square of the floor is."""
    from cgdb.cli.picture_oblique import grid_step
    from cgdb.cli.picture_plan import arrow_inks

    width, height = figure.get_size_inches()
    renderer = figure.canvas.get_renderer()
    y, x = 0.17 / height, 0.18

    def entry(mark: str, text: str, ink: str) -> bool:
        nonlocal x
        part = figure.text(x / width, y, mark, color=ink, va="center", fontsize=9, parse_math=False)
        says = figure.text((x + 0.15) / width, y, text, va="center", fontsize=7, parse_math=False, color=style.INK)
        x += 0.15 + says.get_window_extent(renderer).width / dpi + 0.18
        if x > width - (1.3 if oblique else 0.2):
            part.remove()
            says.remove()
            return False
        return True

    if scene.has_result and colors.scale is None:
        if (scene.fits & (scene.number > 0)).any():
            entry("■", "found", style.FITS)
        if (~scene.fits & (scene.number > 0)).any():
            entry("■", "nearest, does not fit", style.NEAR)
    if colors.scale is not None:
        x = _scale(figure, colors.scale, x, y)
    for label, ink in arrow_inks(scene).items():
        if not entry("→", style.label(label), ink):
            break
    for name, color in () if scene.has_result else colors.legend:
        if not entry("■", name, color):
            break
    if oblique:
        step = grid_step(scene)
        text = f"squares of {step:g} m" if step >= 1 else f"squares of {100 * step:g} cm"
        figure.text(1 - 0.18 / width, y, text, ha="right", va="center", fontsize=7, color=style.SOFT)


def _scale(figure: Any, scale: tuple[float, float], x: float, y: float) -> float:
    """The colours of scores from the least to the largest; where the next entry begins, in inches."""
    import numpy as np

    width, height = figure.get_size_inches()
    figure.text(x / width, y, f"score {scale[0]:.2f}", va="center", fontsize=7)
    bar = figure.add_axes(((x + 0.72) / width, y - 0.05 / height, 1.1 / width, 0.1 / height))
    bar.imshow(np.linspace(0, 1, 128)[None], cmap="cividis", aspect="auto")
    bar.set_axis_off()
    figure.text((x + 1.9) / width, y, f"{scale[1]:.2f}", va="center", fontsize=7)
    return x + 2.4


def _file(figure: Any, ending: str, dpi: float) -> bytes:
    """The file's bytes, the same ones for the same picture: nothing in it says when it was made."""
    kind = ending.casefold().removeprefix(".").replace("jpeg", "jpg")
    unstamped: dict[str, Any] = {"svg": {"Date": None}, "pdf": {"CreationDate": None, "ModDate": None}}
    buffer = io.BytesIO()
    # A cloud hardly compresses; trying harder takes longer than drawing it.
    more = {"pil_kwargs": {"compress_level": 3}} if kind == "png" else {}
    figure.savefig(buffer, format=kind, dpi=dpi, facecolor=style.PAPER, metadata=unstamped.get(kind), **more)
    return buffer.getvalue()
