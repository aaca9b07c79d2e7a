"""A scene seen from above, drawn with characters: rooms, things as dots, the rows of a result numbered."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

from rich.cells import cell_len

from cgdb.cli import render

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from cgdb.view import SceneView

_EAST, _SOUTH, _WEST, _NORTH = 1, 2, 4, 8
_LINES = " ╶╷┌╴─┐┬╵└│├┘┴┤┼"
"""A character for each set of directions in which lines leave a cell."""
MOST_NAMES = 40
"""Marks that are named; of more, only the numbers have room."""
NEARBY = ((0, 0), (0, -1), (0, 1), (-2, 0), (2, 0))
"""(columns, rows) from its thing at which a number may stand."""
LARGE = 0.08
CROWDED = 0.6
"""Shares of the picture: of one thing above which it is not shaded, of all above which none is."""
FLAT = 0.05
"""Metres below which a thing is so low that it is drawn as a point."""
OUTLIERS = 0.01
"""Share of the things at either end that may lie outside the picture, where no room says how large the place is."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Area:
    """A footprint: west, south, east, north in metres of the plan, which has north up. name: as shown."""

    name: str
    west: float
    south: float
    east: float
    north: float

    @property
    def middle(self) -> tuple[float, float]:
        return (self.west + self.east) / 2, (self.south + self.north) / 2


@dataclass(frozen=True, slots=True, kw_only=True)
class Mark:
    """A thing of the result. number: of its row, counted from 1."""

    number: int
    area: Area
    fits: bool


@dataclass(frozen=True, slots=True, kw_only=True)
class FloorPlan:
    """axes: the scene's axes that point right and up in the plan, such as ("x", "y") or ("x", "-z")."""

    scene: str
    axes: tuple[str, str]
    rooms: tuple[Area, ...]
    things: tuple[Area, ...]
    """Those that are not in the result; a flat one, such as a rug or a picture, as a point."""
    marks: tuple[Mark, ...]

    def bounds(self) -> Area | None:
        """What the picture shows: the rooms, else nearly all things; and every mark. None where nothing has a place."""
        areas = [*self.rooms] or _without_outliers(self.things)
        areas += [mark.area for mark in self.marks]
        if not areas:
            return None
        west, east = min(a.west for a in areas), max(a.east for a in areas)
        south, north = min(a.south for a in areas), max(a.north for a in areas)
        # A single point has no size; a metre around it can be drawn.
        pad = 0.5 if max(east - west, north - south) < 1e-6 else 0.0
        return Area(name="", west=west - pad, south=south - pad, east=east + pad, north=north + pad)


def axes(up: str) -> tuple[tuple[int, float], tuple[int, float]]:
    """(axis, sign) of the plan's right and up, seen from above: right x up-in-the-plan = the up axis."""
    sign = -1.0 if up.startswith("-") else 1.0
    return {"z": ((0, 1.0), (1, sign)), "y": ((0, 1.0), (2, -sign)), "x": ((1, 1.0), (2, sign))}[up[-1]]


def plan(view: SceneView, marks: Mapping[int, tuple[int, bool]]) -> FloorPlan:
    """The plan of a scene. marks: {position: (number of the row, whether it fits)}."""
    import numpy as np

    boxes, columns = view.columns.boxes, view.columns
    (right, right_sign), (up, up_sign) = axes(view.info.up)
    centers = np.stack([right_sign * boxes.centers[:, right], up_sign * boxes.centers[:, up]], axis=1)
    half = boxes.half_hulls[:, [right, up]]
    # A rug or a picture would hide the room that it lies in.
    flat = boxes.half_hulls[:, boxes.up_axis] < FLAT / 2
    placed = np.asarray(np.isfinite(centers).all(axis=1))
    is_thing = columns.label_codes == columns.labels.index("Object")
    tags = view.column("tag")
    titles = view.column("name") if "name" in view.catalog.properties or (~is_thing).any() else tags

    def area(position: int) -> Area:
        (x, y), (w, h) = centers[position].tolist(), half[position].tolist()
        is_place = not is_thing[position]
        name = titles[position] if is_place else tags[position]
        label = columns.labels[int(columns.label_codes[position])]
        if flat[position]:
            w = h = 0.0
        return Area(
            name=render.clean(name or (label if is_place else "")), west=x - w, south=y - h, east=x + w, north=y + h
        )

    def areas(where: NDArray[np.bool_]) -> tuple[Area, ...]:
        return tuple(area(position) for position in np.flatnonzero(where).tolist())

    sized = np.asarray(np.isfinite(boxes.extents).all(axis=1))
    marked = np.zeros(len(placed), np.bool_)
    marked[list(marks)] = True
    chosen = sorted((number, position, fits) for position, (number, fits) in marks.items() if placed[position])
    return FloorPlan(
        scene=view.info.name,
        axes=(("-" if right_sign < 0 else "") + "xyz"[right], ("-" if up_sign < 0 else "") + "xyz"[up]),
        rooms=areas(placed & ~is_thing & sized),
        things=areas(placed & is_thing & ~marked),
        marks=tuple(Mark(number=number, area=area(position), fits=fits) for number, position, fits in chosen),
    )


def draw(shown: FloorPlan, width: int, height: int) -> list[list[tuple[str, str]]]:
    """Lines of (part, text), at most width by height characters: part is a theme's ink: room, thing, mark, near, faint.

    Empty where nothing has a place.
    """
    bounds = shown.bounds()
    if bounds is None:
        return []
    canvas = _Canvas(bounds, max(10, width), max(4, height - 1))
    canvas.things(shown.things)
    for room in shown.rooms:
        canvas.outline(room)
    canvas.join()
    crowded = len(shown.marks) > MOST_NAMES
    for step in (canvas.mark_all, canvas.title_all) if crowded else (canvas.title_all, canvas.mark_all):
        step(shown)
    for mark in () if crowded else shown.marks:
        canvas.name(mark)
    return [*canvas.lines(), [("faint", canvas.scale(shown.axes))]]


class _Canvas:
    """Characters and their parts; metres to cells. A character is twice as high as wide."""

    def __init__(self, bounds: Area, width: int, height: int) -> None:
        across, along = bounds.east - bounds.west, bounds.north - bounds.south
        self._metres = max(across / (width - 1), along / (2 * (height - 1)), 1e-9)
        self._columns = min(width, math.ceil(across / self._metres) + 1)
        self._rows = min(height, math.ceil(along / (2 * self._metres)) + 1)
        self._bounds = bounds
        self._text = [[" "] * self._columns for _ in range(self._rows)]
        self._part = [[""] * self._columns for _ in range(self._rows)]
        self._lines = [[0] * self._columns for _ in range(self._rows)]
        self._spots: dict[tuple[int, Area], tuple[int, int, int]] = {}

    def lines(self) -> list[list[tuple[str, str]]]:
        found = []
        for texts, parts in zip(self._text, self._part, strict=True):
            line: list[tuple[str, str]] = []
            for text, part in zip(texts, parts, strict=True):
                if line and line[-1][0] == part:
                    line[-1] = (part, line[-1][1] + text)
                else:
                    line.append((part, text))
            found.append(line)
        return found

    def scale(self, named: tuple[str, str]) -> str:
        """The bar below the plan: a round length, and which axes point where."""
        most = self._metres * max(4, self._columns // 4)
        length = 10.0 ** math.floor(math.log10(most))
        length *= next(factor for factor in (5, 2, 1) if factor * length <= most or factor == 1)
        cells = max(1, round(length / self._metres))
        return f"├{'─' * max(0, cells - 1)}┤ {length:g} m   {named[0]} → right, {named[1]} ↑ up"

    def _cell(self, x: float, y: float) -> tuple[int, int]:
        column = round((x - self._bounds.west) / self._metres)
        row = round((self._bounds.north - y) / (2 * self._metres))
        return max(0, min(self._columns - 1, column)), max(0, min(self._rows - 1, row))

    def _inside(self, area: Area) -> bool:
        x, y = area.middle
        return self._bounds.west <= x <= self._bounds.east and self._bounds.south <= y <= self._bounds.north

    def _put(self, column: int, row: int, text: str, part: str) -> None:
        self._text[row][column] = text
        self._part[row][column] = part

    def things(self, areas: Sequence[Area]) -> None:
        """A dot for each thing, on a shade where its footprint covers several cells.

        No shade for what fills a good part of the picture, which is a floor or a ceiling, nor at all where nearly
        everything would be shaded.
        """
        seen = [area for area in areas if self._inside(area)]
        shaded: set[tuple[int, int]] = set()
        for area in seen:
            left, top = self._cell(area.west, area.north)
            right, bottom = self._cell(area.east, area.south)
            cells = (right - left + 1) * (bottom - top + 1)
            if right - left >= 2 and bottom > top and cells <= LARGE * self._rows * self._columns:
                shaded.update((row, column) for row in range(top, bottom + 1) for column in range(left, right + 1))
        if len(shaded) <= CROWDED * self._rows * self._columns:
            for row, column in shaded:
                self._put(column, row, "░", "thing")
        for area in seen:
            self._put(*self._cell(*area.middle), "·", "thing")

    def outline(self, area: Area) -> None:
        """The walls of a room; where those of two rooms meet they are joined."""
        left, top = self._cell(area.west, area.north)
        right, bottom = self._cell(area.east, area.south)
        for row in (top, bottom):
            for column in range(left, right):
                self._lines[row][column] |= _EAST
                self._lines[row][column + 1] |= _WEST
        for column in (left, right):
            for row in range(top, bottom):
                self._lines[row][column] |= _SOUTH
                self._lines[row + 1][column] |= _NORTH

    def join(self) -> None:
        """Turn the walls into characters."""
        for row, lines in enumerate(self._lines):
            for column, sides in enumerate(lines):
                if sides:
                    self._put(column, row, _LINES[sides], "room")

    def title_all(self, shown: FloorPlan) -> None:
        """The names of all rooms."""
        for room in shown.rooms:
            self.title(room)

    def mark_all(self, shown: FloorPlan) -> None:
        """The numbers of all marks."""
        for mark in shown.marks:
            self.mark(mark)

    def title(self, area: Area) -> None:
        """A room's name on its upper wall."""
        left, top = self._cell(area.west, area.north)
        right, _ = self._cell(area.east, area.south)
        room = right - left - 3
        name = area.name if cell_len(area.name) <= room else ""
        if not name:
            cut = area.name[: max(0, room - 1)]
            name = cut + "…" if room >= 3 and cell_len(cut) < room else ""
        if name:
            self._write(left + 2, top, f" {name} " if room > cell_len(name) + 1 else name, "room")

    def mark(self, mark: Mark) -> None:
        """The number of a row where its thing is, or a cell beside. Where there is no room the earlier row is seen."""
        text = str(mark.number)
        column, row = self._cell(*mark.area.middle)
        for across, down in NEARBY:
            left = max(0, min(column + across, self._columns - len(text)))
            line = max(0, min(row + down, self._rows - 1))
            # Two numbers side by side would read as one.
            around = self._part[line][max(0, left - 1) : left + len(text) + 1]
            if "mark" not in around and "near" not in around:
                self._write(left, line, text, "mark" if mark.fits else "near")
                self._spots[mark.number, mark.area] = (left, line, len(text))
                return

    def name(self, mark: Mark) -> None:
        """What the thing is called, beside its number, above or below; nowhere if there is no room."""
        spot = self._spots.get((mark.number, mark.area))
        text = mark.area.name
        if spot is None or not text:
            return
        column, row, length = spot
        width = cell_len(text)
        if width > 24:
            return
        middle = column - width // 2
        beside = ((column + length + 1, row), (column - width - 1, row))
        over = tuple((left, line) for left in (column, middle) for line in (row - 1, row + 1))
        for left, line in (*beside, *over):
            if not (0 <= line < self._rows and left >= 0 and left + width <= self._columns):
                continue
            taken = self._part[line][max(0, left - 1) : left + width + 1]
            own = set(range(column, column + length)) if line == row else set()
            clash = any(
                part in ("mark", "near", "name", "room") and left - 1 + offset not in own
                for offset, part in enumerate(taken, start=1 if left == 0 else 0)
            )
            if not clash:
                self._write(left, line, text, "name")
                return

    def _write(self, column: int, row: int, text: str, part: str) -> None:
        for character in text:
            wide = cell_len(character)
            if wide == 0:  # an accent belongs to the letter before it
                if column:
                    self._text[row][column - 1] += character
                continue
            if column + wide > self._columns:
                return
            self._put(column, row, character, part)
            if wide == 2:  # takes the next cell too
                self._put(column + 1, row, "", part)
            column += wide


def _without_outliers(areas: Sequence[Area]) -> list[Area]:
    if len(areas) < 20:
        return list(areas)
    few = max(1, int(len(areas) * OUTLIERS))
    xs, ys = sorted(a.middle[0] for a in areas), sorted(a.middle[1] for a in areas)
    west, east, south, north = xs[few], xs[-1 - few], ys[few], ys[-1 - few]
    kept = [a for a in areas if west <= a.middle[0] <= east and south <= a.middle[1] <= north]
    return kept or list(areas)
