"""The floor plan: where things come to stand in it, whatever axis is up and whatever they are called."""

from __future__ import annotations

import random
from pathlib import Path

import numpy as np
import pytest
from rich.cells import cell_len

import cgdb
from cgdb.cli.floorplan import Area, FloorPlan, Mark, axes, draw, plan
from cgdb.cli.marks import marks_of
from cgdb.scene import Place, SceneGraph, SceneObject
from cgdb.testing import store


def area(name: str, x: float, y: float, size: float = 0.0, depth: float | None = None) -> Area:
    half, deep = size / 2, (size if depth is None else depth) / 2
    return Area(name=name, west=x - half, south=y - deep, east=x + half, north=y + deep)


def flat(*marks: Mark, things: tuple[Area, ...] = (), rooms: tuple[Area, ...] | None = None) -> FloorPlan:
    if rooms is None:
        rooms = (area("kitchen", 2, 2, 4), area("hall", 6, 2, 4))
    return FloorPlan(scene="flat", axes=("x", "y"), rooms=rooms, things=things, marks=marks)


def text(shown: FloorPlan, width: int = 61, height: int = 20) -> list[str]:
    return ["".join(part for _, part in line) for line in draw(shown, width, height)]


def test_the_picture() -> None:
    marks = (
        Mark(number=1, area=area("mug", 1, 3), fits=True),
        Mark(number=2, area=area("lamp", 6, 1), fits=False),
    )
    assert text(flat(*marks, things=(area("", 7, 3), area("sofa", 2, 1, 1.5, 1.0))), 41, 12) == [
        "┌─ kitchen ─────────┬─ hall ────────────┐",
        "│                   │                   │",
        "│    1 mug          │              ·    │",
        "│                   │                   │",
        "│                   │                   │",
        "│                   │                   │",
        "│     ░░░░░░░░░     │                   │",
        "│     ░░░░░░░░░     │                   │",
        "│     ░░░░·░░░░     │         2 lamp    │",
        "│     ░░░░░░░░░     │                   │",
        "└───────────────────┴───────────────────┘",
        "├─────────┤ 2 m   x → right, y ↑ up",
    ]


def test_parts_are_told_apart() -> None:
    marks = (Mark(number=1, area=area("mug", 1, 3), fits=True), Mark(number=2, area=area("lamp", 6, 1), fits=False))
    parts = {part: t for line in draw(flat(*marks), 61, 20) for part, t in line if t.strip()}
    assert parts["mark"] == "1"
    assert parts["near"] == "2"
    assert parts["name"] in ("mug", "lamp")
    assert {"room", "faint"} <= set(parts)


@pytest.mark.parametrize("up", ["x", "y", "z", "-x", "-y", "-z"])
def test_seen_from_above_and_never_mirrored(up: str) -> None:
    (right, right_sign), (north, north_sign) = axes(up)
    east, ahead, above = np.zeros(3), np.zeros(3), np.zeros(3)
    east[right], ahead[north] = right_sign, north_sign
    above["xyz".index(up[-1])] = -1.0 if up.startswith("-") else 1.0
    assert np.array_equal(np.cross(east, ahead), above)


def test_of_a_scene_with_y_up(tmp_path: Path) -> None:
    scene = SceneGraph(
        name="s",
        up="y",
        objects=(
            SceneObject(id=1, tag="near", center=np.array([0.0, 0.0, 5.0])),
            SceneObject(id=2, tag="far", center=np.array([0.0, 0.0, -5.0]), extent=np.array([1.0, 1.0, 2.0])),
            SceneObject(id=3, tag="nowhere"),
        ),
        places=(Place(id=9, kind="Room", name="room", center=np.zeros(3), extent=np.array([4.0, 3.0, 12.0])),),
    )
    with store(scene) as db:
        result = db.query("MATCH (o) RETURN o.id ORDER BY id(o)")
        marks = marks_of(db, result)
        shown = plan(db.view("s"), marks["s"])
    assert shown.axes == ("x", "-z")
    assert [room.name for room in shown.rooms] == ["room"]
    near, far = shown.marks
    assert (near.number, near.area.middle[1]) == (1, -5.0)
    assert (far.number, far.area.middle[1], far.area.north - far.area.south) == (2, 5.0, 2.0)


def test_marks_of_nodes_relations_lists_and_ids() -> None:
    scene = SceneGraph(
        name="s",
        objects=tuple(SceneObject(id=i, tag="t") for i in range(5)),
        relations=(cgdb.Relation(source=0, target=1, label="on"),),
    )
    with store(scene) as db:

        def found(statement: str) -> set[int]:
            return set(marks_of(db, db.query(statement)).get("s", {}))

        assert found("MATCH (a #2) RETURN a") == {2}
        assert found("MATCH (a)-[r:on]->(b) RETURN r") == {0, 1}
        assert found("MATCH (a) RETURN collect(a)") == {0, 1, 2, 3, 4}
        assert found("MATCH (a #3) RETURN a.tag, a.id") == {3}
        assert found("MATCH (a) RETURN a.tag") == set()
        assert marks_of(db, None) == {}


def test_nothing_to_draw() -> None:
    assert draw(flat(rooms=()), 60, 20) == []


@pytest.mark.parametrize("where", [(0.0, 0.0), (1e7, -1e7)])
def test_a_single_point(where: tuple[float, float]) -> None:
    lines = text(flat(Mark(number=1, area=area("it", *where), fits=True), rooms=()))
    assert any("1" in line for line in lines)


def test_an_outlier_does_not_shrink_the_rest() -> None:
    things = tuple(area("", x / 10, y / 10) for x in range(10) for y in range(10))
    lines = text(flat(things=(*things, area("", 1e6, 1e6)), rooms=()))
    assert sum(line.count("·") for line in lines) > 50


def test_never_larger_than_asked() -> None:
    random.seed(4)
    names = ("", "名前の長い部屋", "x" * 80, "a\u0301e\u0301", "\u0301", "ok")
    for _ in range(200):
        spots = [(random.uniform(-9, 9), random.uniform(-9, 9), random.uniform(0, 4)) for _ in range(8)]
        rooms = tuple(area(random.choice(names), x, y, s + 1) for x, y, s in spots[: random.randrange(4)])
        marks = tuple(
            Mark(number=n, area=area(random.choice(names), x, y, s), fits=n % 2 == 0)
            for n, (x, y, s) in enumerate(spots, 1)
        )
        width, height = random.randrange(10, 100), random.randrange(5, 40)
        lines = text(flat(*marks, rooms=rooms), width, height)
        assert len(lines) <= height
        assert all(cell_len(line.rstrip()) <= width for line in lines[:-1])


def test_names_of_strangers_are_made_clean() -> None:
    hostile = "a\x1b[31mb\x9bc\nd\u202ee"
    scene = SceneGraph(
        name="s",
        objects=(SceneObject(id=1, tag=hostile, center=np.zeros(3)),),
        places=(Place(id=2, kind="Room", name=hostile, center=np.zeros(3), extent=np.full(3, 20.0)),),
    )
    with store(scene) as db:
        shown = plan(db.view("s"), {db.view("s").position(1): (1, True)})
    assert all(line.isprintable() for line in text(shown))
    assert "a [31mb" in "".join(text(shown))


def test_floors_and_crowds_are_not_shaded() -> None:
    floor = text(flat(things=(area("floor", 4, 2, 7.5, 3.5),)))
    assert "░" not in "".join(floor)
    crowd = tuple(area("", x + 0.5, y + 0.5, 1.0) for x in range(8) for y in range(4))
    lines = text(flat(things=crowd))
    assert "░" not in "".join(lines)
    assert "".join(lines).count("·") > 20
