"""The plan view of a scene as a picture, with the result highlighted: ``cgdb plot`` and ``:plot``."""

from __future__ import annotations

from argparse import Namespace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import cgdb
from cgdb.cli import render, values
from cgdb.cli.asking import warn
from cgdb.cli.marks import marks_of
from cgdb.errors import MissingExtraError, UsageError, one_of
from cgdb.geometry import Boxes

if TYPE_CHECKING:
    from cgdb.cli.floorplan import FloorPlan
    from cgdb.result import Result
    from cgdb.view import SceneView

MOST_NAMES = 30
ENDINGS = (".png", ".pdf", ".svg", ".jpg", ".jpeg", ".webp")


def plot(options: Namespace) -> int:
    """Draw a scene, and what a statement finds in it."""
    import sys

    check_target(options.output)
    with cgdb.open(options.store) as db:
        result = None
        if options.text is not None:
            text = sys.stdin.read() if options.text == "-" else options.text
            result = db.query(text, values.parameters(options.parameters))
            warn(result.warnings)
        drawn = draw(db, result, options.output, scene=options.scene)
    sys.stderr.write(f"wrote {options.output}: {render.clean(drawn)}\n")
    return 0


def check_target(path: str) -> None:
    """Refuse a file that no picture can be written to, before anything is asked."""
    if Path(path).suffix.casefold() not in ENDINGS:
        raise UsageError(f"{path}: a picture's name ends with one of {', '.join(ENDINGS)}")
    if not Path(path).absolute().parent.is_dir():
        raise UsageError(f"{path}: there is no such folder")


def draw(db: cgdb.Database, result: Result | None, path: str, *, scene: str | None = None) -> str:
    """Write the picture; says what is on it. scene: else the one with most of the result, or the only one."""
    try:
        from matplotlib.backends.backend_agg import FigureCanvasAgg
        from matplotlib.figure import Figure
    except ImportError as error:
        raise MissingExtraError("matplotlib is not installed", hint="pip install 'cgdb[plot]'") from error
    check_target(path)
    marks = marks_of(db, result)
    view = db.view(chosen_scene(db, marks, scene))
    found = marks.get(view.info.name, {})
    if not _placed(view).any():
        raise UsageError(f"scene '{view.info.name}' has no positions to draw")
    figure = Figure(figsize=(10, 8), layout="constrained")
    FigureCanvasAgg(figure)
    _paint(figure.add_subplot(), view, found, result)
    try:
        figure.savefig(path, dpi=150)
    except OSError as error:
        raise UsageError(f"{path} cannot be written: {error.strerror or error}") from error
    return f"scene '{view.info.name}', {len(found)} of the result marked"


def chosen_scene(db: cgdb.Database, marks: dict[str, dict[int, tuple[int, bool]]], scene: str | None) -> str:
    """The scene to draw."""
    if scene is not None:
        return db.view(scene).info.name
    if marks:
        return max(marks, key=lambda name: len(marks[name]))
    names = [info.name for info in db.scenes()]
    if len(names) != 1:
        raise UsageError(f"the store holds {len(names)} scenes: say which", hint=one_of(names))
    return names[0]


def _placed(view: SceneView) -> Any:
    import numpy as np

    return np.isfinite(view.columns.boxes.centers).all(axis=1)


def _paint(drawing: Any, view: SceneView, marks: dict[int, tuple[int, bool]], result: Result | None) -> None:
    import numpy as np

    from cgdb.cli.floorplan import axes, plan

    (right, right_sign), (up, up_sign) = axes(view.info.up)
    shown = plan(view, marks)
    for room in shown.rooms:
        x, y, width, height = room.west, room.south, room.east - room.west, room.north - room.south
        drawing.fill([x, x + width, x + width, x], [y, y, y + height, y + height], fc="#f4f6fa", ec="#8fa0bd", lw=1.4)
        drawing.text(x + 0.06, y + height - 0.06, _label(room.name), va="top", fontsize=8, color="#6f83a8")
    boxes = view.columns.boxes
    is_thing = view.columns.label_codes == view.columns.labels.index("Object")
    others = [p for p in np.flatnonzero(_placed(view) & is_thing).tolist() if p not in marks]
    # Small things on top of large ones: floors, walls and ceilings are things in many maps.
    size = np.nan_to_num(boxes.half_hulls[:, [right, up]].prod(axis=1))
    others.sort(key=lambda position: -float(size[position]))
    for position in [*others, *(p for p in marks if _placed(view)[p])]:
        number, fits = marks.get(position, (0, False))
        face, edge = (
            ("#d9dee7", "#b3bccb") if not number else ("#8fd08f", "#2e7d32") if fits else ("#ffd180", "#b35900")
        )
        outline = footprint(boxes, position, (right, right_sign), (up, up_sign))
        if len(outline) > 2:
            drawing.fill(
                outline[:, 0],
                outline[:, 1],
                fc=face,
                ec=edge,
                lw=0.8,
                alpha=0.85 if number else 0.35,
                zorder=3 if number else 2,
            )
        else:
            drawing.plot(outline[:, 0], outline[:, 1], "o", ms=5, color=edge, zorder=3 if number else 2)
    _names(drawing, shown)
    drawing.set_aspect("equal")
    drawing.set_xlabel(f"{shown.axes[0]} (m)")
    drawing.set_ylabel(f"{shown.axes[1]} (m)")
    title = view.info.name if result is None else f"{view.info.name}: {result.query}"
    drawing.set_title(_label(title, 110), fontsize=9, loc="left", wrap=True)


def _names(drawing: Any, shown: FloorPlan) -> None:
    """The numbers and names of what is marked; one that would lie on another is moved down by a line."""
    bounds = shown.bounds()
    if bounds is None:
        return
    across, along = (bounds.east - bounds.west) or 1.0, (bounds.north - bounds.south) or 1.0
    taken: list[tuple[float, float]] = []
    for mark in shown.marks[:MOST_NAMES]:
        x, y = mark.area.middle
        lines = 0
        while any(abs(x - u) < 0.2 * across and abs(y - lines * 0.025 * along - v) < 0.022 * along for u, v in taken):
            lines += 1
        taken.append((x, y - lines * 0.025 * along))
        text = f"{mark.number} {_label(mark.area.name)}".strip()
        style = {"fontsize": 8, "weight": "bold", "zorder": 4}
        drawing.annotate(text, (x, y), (4, 4 - 11 * lines), textcoords="offset points", **style)


def footprint(boxes: Boxes, position: int, right: tuple[int, float], up: tuple[int, float]) -> Any:
    """(n, 2) the outline of a box seen from above, turned boxes as they are; one point where it has no extent."""
    import numpy as np

    center, extent, rotation = boxes.centers[position], boxes.extents[position], boxes.rotations[position]
    if not np.isfinite(extent).all():
        corners = center[None]
    else:
        signs = np.array([[a, b, c] for a in (-1, 1) for b in (-1, 1) for c in (-1, 1)], float)
        corners = center + (signs * extent / 2) @ rotation.T
    flat = np.stack([right[1] * corners[:, right[0]], up[1] * corners[:, up[0]]], axis=1)
    return _hull(np.unique(flat.round(6), axis=0))


def _hull(points: Any) -> Any:
    """The convex hull of a few points, counter-clockwise (Andrew's monotone chain)."""
    import numpy as np

    if len(points) < 3:
        return points
    ordered = sorted(map(tuple, points.tolist()))

    def chain(line: list[tuple[float, ...]]) -> list[tuple[float, ...]]:
        found: list[tuple[float, ...]] = []
        for p in line:
            while len(found) > 1:
                (ax, ay), (bx, by) = found[-2], found[-1]
                if (bx - ax) * (p[1] - ay) - (by - ay) * (p[0] - ax) > 0:
                    break
                found.pop()
            found.append(p)
        return found[:-1]

    return np.asarray(chain(ordered) + chain(ordered[::-1]))


def _label(text: str, most: int = 40) -> str:
    """A name for matplotlib, which would read text between dollar signs as mathematics."""
    clean = render.clean(text)
    return (clean if len(clean) <= most else clean[: most - 1] + "…").replace("$", r"\$")
