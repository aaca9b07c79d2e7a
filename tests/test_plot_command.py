"""Pictures of maps: what is seen, from where, in which colours; and files that are whole and of the size asked."""

from __future__ import annotations

import struct
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pytest

import cgdb
from cgdb.cli import app, picture, picture_labels, picture_oblique, picture_plan, picture_points, picture_style
from cgdb.cli.picture_colors import coloring
from cgdb.cli.picture_scene import PictureScene, gather
from cgdb.errors import BindError, MissingExtraError, UsageError
from cgdb.scene import Place, Relation, SceneGraph, SceneObject
from cgdb.testing import store as opened_store

pytest.importorskip("matplotlib")

HOSTILE = "\x1b]0;owned\x07$\\frac{1}{0}$ \u202e line\nbreak 日本語 \U0001f6cb " + "long " * 200
UP = np.array([0.0, 0.0, 1.0])
RED, BLUE, WHITE, GREY = (200, 20, 20), (20, 20, 200), (240, 240, 240), (120, 120, 120)


def thing(
    number: int, tag: str, center: tuple[float, ...], extent: tuple[float, ...], color: tuple[int, ...] | None
) -> SceneObject:
    """A block; its cloud, where it has a colour, is its surface and inside at 4 cm."""
    points = colors = None
    if color is not None:
        axes = [np.arange(-side / 2, side / 2 + 1e-9, 0.04) for side in extent]
        points = (np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3) + center).astype(np.float32)
        colors = np.tile(np.array(color, np.uint8), (len(points), 1))
    return SceneObject(
        id=number, tag=tag, center=np.array(center), extent=np.array(extent), points=points, colors=colors
    )


ROOM = SceneGraph(
    name="room",
    objects=(
        thing(1, "floor", (2, 1.5, 0), (4, 3, 0.04), GREY),
        thing(2, "ceiling", (2, 1.5, 2.5), (4, 3, 0.04), WHITE),
        thing(3, "wall", (2, 3, 1.25), (4, 0.04, 2.4), WHITE),
        thing(4, "wall", (2, 0, 1.25), (4, 0.04, 2.4), WHITE),
        thing(5, "table", (1, 1.5, 0.4), (0.8, 1.2, 0.8), RED),
        thing(6, HOSTILE, (1, 1.5, 0.9), (0.2, 0.2, 0.2), BLUE),
        thing(7, "lamp", (3, 1, 2.49), (0.2, 0.2, 0.02), None),
        thing(8, "chair", (3, 2, 0.5), (0.5, 0.5, 1.0), None),
        SceneObject(id=9, tag="nowhere"),
    ),
    relations=(Relation(source=6, target=5, label="on"), Relation(source=9, target=5, label="near")),
)


def block(seed: int = 0) -> SceneGraph:
    """The room's boxes without clouds, in a room of its own."""
    bare = tuple(replace(o, points=None, colors=None) for o in ROOM.objects)
    place = Place(id=100, kind="Room", name="study", center=np.array([2, 1.5, 1.25]), extent=np.array([4.2, 3.2, 2.6]))
    return replace(ROOM, name="boxes", objects=bare, places=(place,))


@pytest.fixture(scope="module")
def store(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("plot") / "room.cgdb"
    with cgdb.open(path, create=True, text_encoder=None) as db:
        db.add(ROOM)
        db.add(block())
        db.add(SceneGraph(name="empty", objects=(SceneObject(id=1, tag="thought"),)))
    return path


@pytest.fixture(scope="module")
def db(store: Path) -> Iterator[cgdb.Database]:
    with cgdb.open(store, text_encoder=None) as opened:
        yield opened


def shown(db: cgdb.Database, name: str = "room", marks: dict[int, tuple[int, bool]] | None = None) -> PictureScene:
    return gather(db, db.view(name), marks or {})


def pixels(scene: PictureScene, **sheet: object) -> np.ndarray:
    from io import BytesIO

    from PIL import Image

    made = picture.paint(scene, ".png", picture.Sheet(labels=0, size=(640, 480), **sheet))  # type: ignore[arg-type]
    return np.asarray(Image.open(BytesIO(made.data)).convert("RGB")).astype(int)


def share(image: np.ndarray, color: tuple[int, ...]) -> float:
    """Of the pixels that are of this hue, however light."""
    red, green, blue = image[..., 0], image[..., 1], image[..., 2]
    if color == RED:
        return float(((red > green + 60) & (red > blue + 60)).mean())
    return float(((blue > green + 60) & (blue > red + 60)).mean())


def test_the_plan_shows_what_is_below_the_ceiling(db: cgdb.Database) -> None:
    scene = shown(db)
    assert 2.3 < scene.ceiling < 2.5
    assert [bool(hidden) for hidden in scene.hidden] == [False, True, *[False] * 4, True, False, False]
    image = pixels(scene)
    height, width, _ = image.shape
    # The table covers 0.8 m x 1.2 m of a picture whose metres the room's width tells; the cup lies on it.
    assert 0.02 < share(image, RED) < 0.12
    assert 0.0005 < share(image, BLUE) < 0.01
    rows, columns = np.nonzero((image[..., 2] > image[..., 0] + 60) & (image[..., 2] > image[..., 1] + 60))
    assert 0.2 < columns.mean() / width < 0.45
    assert 0.4 < rows.mean() / height < 0.6


def test_an_unnamed_ceiling_is_found_by_its_points(db: cgdb.Database) -> None:
    unnamed = replace(ROOM, objects=tuple(replace(o, tag="thing") if o.id == 2 else o for o in ROOM.objects))
    with opened_store(unnamed) as other:
        assert 2.0 < shown(other).ceiling < 2.5
    without = replace(ROOM, objects=tuple(o for o in ROOM.objects if o.id != 2))
    with opened_store(without) as other:
        assert shown(other).ceiling == np.inf


def test_the_oblique_view_leaves_out_the_near_wall(db: cgdb.Database) -> None:
    scene = shown(db)
    eye = picture_oblique.camera(scene)
    off = picture_oblique._near_walls(scene, eye, np.arange(len(scene.points)))
    near, far = scene.owner == 3, scene.owner == 2
    assert eye.eye[1] < 0  # it looks from the south, over the longer side
    assert off[near].all()
    assert not off[far].any()
    assert not off[scene.owner == 4].any()
    assert share(pixels(scene, view="oblique"), RED) > 0.01


def test_projection() -> None:
    """Higher is higher, farther is smaller, and the middle is in the middle."""
    with opened_store(ROOM) as db:
        eye = picture_oblique.camera(shown(db))
    middle = eye.eye + eye.turn[2] * 5
    (low, high, center), depth = eye.project(np.array([middle - UP, middle + UP, middle]))
    assert low[1] < center[1] < high[1]
    assert np.abs(center).max() < 1e-9
    assert depth[2] == pytest.approx(5)
    near, _ = eye.project(np.array([middle, middle + eye.turn[0]]))
    far, _ = eye.project(np.array([middle + 5 * eye.turn[2], middle + 5 * eye.turn[2] + eye.turn[0]]))
    assert near[1, 0] - near[0, 0] == pytest.approx(2 * (far[1, 0] - far[0, 0]))


@pytest.mark.parametrize("up", ["x", "-x", "y", "-y", "-z"])
def test_a_map_with_another_up_axis_looks_the_same(up: str) -> None:
    """The room is turned so that its up axis is another one; its picture is turned back."""
    from cgdb.cli.picture_scene import _turn

    turn = _turn(up)  # rows: the picture's axes in the scene

    def turned(obj: SceneObject) -> SceneObject:
        if obj.center is None or obj.extent is None:
            return obj
        points = None if obj.points is None else (obj.points @ turn).astype(np.float32)
        return replace(obj, center=obj.center @ turn, extent=obj.extent, rotation=turn.T, points=points)

    assert np.linalg.det(turn) == pytest.approx(1)
    other = replace(ROOM, up=up, objects=tuple(turned(o) for o in ROOM.objects))
    with opened_store(ROOM) as db, opened_store(other) as db_other:
        expected, found = shown(db), shown(db_other)
    np.testing.assert_allclose(found.points, expected.points, atol=1e-5)
    np.testing.assert_allclose(found.corners, expected.corners, atol=1e-9)
    assert found.axes[2] == up


def test_a_large_cloud_is_sampled_evenly_and_alike(db: cgdb.Database) -> None:
    everything, view = shown(db), db.view("room")
    few = gather(db, view, {}, most_points=2000)
    assert (len(few.points), few.n_points) == (2000, everything.n_points)
    again = gather(db, view, {}, most_points=2000)
    np.testing.assert_array_equal(few.points, again.points)
    assert not np.array_equal(few.points, gather(db, view, {}, most_points=2000, seed=1).points)
    expected = np.bincount(everything.owner, minlength=9) / len(everything.owner)
    assert np.abs(np.bincount(few.owner, minlength=9) / 2000 - expected).max() < 0.04


def test_the_nearest_point_wins_and_holes_close() -> None:
    at = np.array([[5.0, 5.0], [5.0, 5.0], [20.0, 5.0]], np.float32)
    colors = np.array([RED, BLUE, RED], np.uint8)
    for order in ([0, 1, 2], [1, 0, 2]):
        canvas = picture_points.splat(
            at[order], np.array([2, 1, 1], np.float32)[order], np.full(3, 2.0, np.float32), colors[order], 30, 12
        )
        assert canvas.rgb[5, 5].tolist() == list(BLUE)
        assert canvas.rgb[5, 20].tolist() == list(RED)
        assert np.isinf(canvas.depth[0, 0])
        assert canvas.depth[5, 5] == 1.0
    grid = np.stack(np.meshgrid(np.arange(10), np.arange(10)), axis=-1).reshape(-1, 2).astype(np.float32)
    grid = grid[~(grid == 4).all(axis=1)]
    depth, radius = np.ones(99, np.float32), np.zeros(99, np.float32)
    holed = picture_points.splat(grid, depth, radius, np.tile(np.uint8(RED), (99, 1)), 10, 10)
    assert np.isinf(holed.depth[4, 4])
    assert picture_points.filled(holed).rgb[4, 4].tolist() == list(RED)
    assert not np.isinf(picture_points.filled(holed).depth).any()


def test_points_outside_the_picture_are_not_drawn() -> None:
    at = np.array([[-1.0, 5.0], [10.0, 5.0], [5.0, 1e6]], np.float32)
    ones = np.ones(3, np.float32)
    canvas = picture_points.splat(at, ones, ones, np.tile(np.uint8(RED), (3, 1)), 10, 10)
    assert np.isinf(canvas.depth).all()


def test_depth_is_shaded_where_something_is_before_it() -> None:
    rgb = np.full((20, 20, 3), 200, np.uint8)
    depth = np.full((20, 20), 2.0, np.float32)
    depth[:, 10:] = 1.0
    lit = picture_points.shaded(picture_points.Canvas(rgb=rgb, depth=depth), relief=0.3)
    assert lit.rgb[10, 9, 0] < 170 < lit.rgb[10, 2, 0]
    assert lit.rgb[10, 10, 0] > 195
    small = picture_points.smaller(np.dstack([rgb, np.full((20, 20), 255, np.uint8)]), 2)
    assert small.shape == (10, 10, 4)
    assert (small == [200, 200, 200, 255]).all()


def test_a_result_stands_out_and_the_rest_is_dimmed(db: cgdb.Database) -> None:
    plain, marked = shown(db), shown(db, marks={4: (1, True)})
    assert share(pixels(marked), BLUE) == 0.0 < share(pixels(plain), BLUE)
    assert share(pixels(marked), RED) > 0.02
    text = {name.text for name in picture_plan.names(marked, marked.centers[:, :2])}
    assert text == {"1  table"}
    near = coloring(shown(db, marks={4: (1, False)}), None)
    assert picture_plan.hexes(near.items)[4].casefold() == picture_style.NEAR


def test_colors_by_class_instance_and_score(db: cgdb.Database) -> None:
    scene = shown(db)
    by_class = coloring(scene, "class")
    assert by_class.items[2].tolist() == by_class.items[3].tolist()
    assert by_class.legend[0][0] in ("table", "chair")
    by_instance = coloring(scene, "instance")
    assert len(np.unique(by_instance.items, axis=0)) == len(scene.ids)
    result = db.query("USE 'room' MATCH (o) WHERE o.tag = 'chair' OR o.tag = 'table' RETURN o")
    from cgdb.cli.marks import marks_of

    scored = coloring(gather(db, db.view("room"), marks_of(db, result)["room"], result), "score")
    assert scored.scale is not None
    assert scored.scale[0] <= scored.scale[1]
    with pytest.raises(UsageError, match="scores of a result"):
        coloring(scene, "score")
    with pytest.raises(UsageError, match="no coloured points"):
        coloring(shown(db, "boxes"), "rgb")


def test_names_do_not_cover_each_other() -> None:
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(figsize=(6, 4), dpi=100)
    FigureCanvasAgg(figure)
    axes = figure.add_axes((0, 0, 1, 1))
    axes.set_xlim(0, 1)
    axes.set_ylim(0, 1)
    random = np.random.default_rng(0)
    names = [
        picture_labels.Name(text=f"thing number {i}", x=float(x), y=float(y), strong=i < 5)
        for i, (x, y) in enumerate(random.random((200, 2)))
    ]
    drawn = picture_labels.place(axes, names, most=150)
    assert 20 < drawn <= 150
    assert drawn == len(axes.texts)
    assert picture_labels.place(axes, names, most=0) == 0
    boxes = [text.get_window_extent(figure.canvas.get_renderer()) for text in axes.texts]
    covered = 0.0
    for i, a in enumerate(boxes):
        assert a.x0 >= -1 and a.x1 <= 601 and a.y0 >= -1 and a.y1 <= 401
        for b in boxes[i + 1 :]:
            covered += max(0.0, min(a.x1, b.x1) - max(a.x0, b.x0)) * max(0.0, min(a.y1, b.y1) - max(a.y0, b.y0))
    assert covered < 0.01 * sum(a.width * a.height for a in boxes)


def test_labels_are_clean_and_short() -> None:
    label = picture_style.label(HOSTILE)
    assert len(label) <= picture_style.MOST_LETTERS
    assert label.isprintable()
    assert "\u202e" not in label


@pytest.mark.parametrize("view", ["plan", "oblique", "both"])
@pytest.mark.parametrize("scene", ["room", "boxes"])
def test_the_command_writes_a_picture(
    store: Path, tmp_path: Path, capfd: pytest.CaptureFixture[str], scene: str, view: str
) -> None:
    """Hostile captions, letters that no font has, and relations are in it; warnings would be errors here."""
    target = tmp_path / "map.png"
    words = ["--scene", scene, "--view", view, "--size", "640x480", "--relations", "on, near"]
    assert app.main(["plot", str(store), "--into", str(target), *words]) == 0
    out, err = capfd.readouterr()
    assert out == f"{target}\n"
    assert f"scene '{scene}', " in err
    assert "marked" not in err
    assert struct.unpack(">II", target.read_bytes()[16:24]) == (640, 480)
    assert list(tmp_path.iterdir()) == [target]


def test_where_nothing_fits_the_nearest_few_are_marked(
    store: Path, tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    target = tmp_path / "map.svg"
    text = "USE 'room' MATCH (o ~ 'xylophone') RETURN o"
    assert app.main(["plot", str(store), "--into", str(target), text]) == 0
    assert "3 of the result marked (nothing fits, these are the nearest), " in capfd.readouterr().err
    assert app.main(["plot", str(store), "--into", str(target), text, "--encoder", "clip=vocabulary:none.npz"]) == 9
    assert "none.npz" in capfd.readouterr().err


def test_the_same_picture_twice_is_the_same_file(store: Path, tmp_path: Path) -> None:
    for ending, begins in ((".svg", b"<?xml"), (".pdf", b"%PDF"), (".png", b"\x89PNG")):
        files = [tmp_path / f"{number}{ending}" for number in range(2)]
        for file in files:
            assert app.main(["plot", str(store), "-o", str(file), "--scene", "room", "--size", "300x300"]) == 0
        assert files[0].read_bytes() == files[1].read_bytes()
        assert files[0].read_bytes().startswith(begins)
    ElementTree.parse(tmp_path / "0.svg")


def test_the_statement_as_an_option(store: Path, tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    target = tmp_path / "map.svg"
    query = "USE 'room' MATCH (o) WHERE o.tag = 'table' RETURN o"
    assert app.main(["plot", str(store), "--into", str(target), "--query", query, "--color", "score"]) == 0
    assert "1 of the result marked, 1 thing named" in capfd.readouterr().err
    assert app.main(["plot", str(store), "--into", str(target), "--query", query, query]) == 2
    assert "given twice" in capfd.readouterr().err


@pytest.mark.parametrize(
    ("words", "says"),
    [
        (["--size", "12x"], "is no size in pixels"),
        (["--size", "99999x99999"], "sides must have"),
        (["--size", "9000x9000"], "at most 50 million"),
        (["--labels", "many"], "is no number"),
        (["--color", "score"], "shows the scores of a result"),
        (["--scene", "boxes", "--color", "rgb"], "no coloured points"),
        (["--scene", "empty"], "has no positions to draw"),
    ],
)
def test_what_cannot_be_drawn(
    store: Path, tmp_path: Path, capfd: pytest.CaptureFixture[str], words: list[str], says: str
) -> None:
    words = words if "--scene" in words else ["--scene", "room", *words]
    assert app.main(["plot", str(store), "--into", str(tmp_path / "map.png"), *words]) == 2
    out, err = capfd.readouterr()
    assert out == ""
    assert says in err
    assert list(tmp_path.iterdir()) == []


def test_a_relation_that_is_not_there(db: cgdb.Database) -> None:
    with pytest.raises(BindError) as caught:
        gather(db, db.view("room"), {}, relations=("onn",))
    assert caught.value.hint == "did you mean 'on'?"
    arrows = gather(db, db.view("room"), {}, relations=("ON",)).arrows
    assert [(arrow.source, arrow.target, arrow.label) for arrow in arrows] == [(5, 4, "on")]


def test_matplotlib_is_missed_before_anything_is_asked(
    store: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(__import__("sys").modules, "matplotlib.figure", None)
    with pytest.raises(MissingExtraError):
        picture.require()
    assert app.main(["plot", str(store), "--into", str(tmp_path / "p.png"), "--query", "no CGQL"]) == 9


def test_the_outline_of_a_turned_box() -> None:
    root = np.sqrt(2)
    turned = np.array([[1 - root, 2.0], [1 + root, 2.0], [1.0, 2 - root], [1.0, 2 + root]])
    doubled = np.concatenate([turned, turned, [[1.0, 2.0]]])
    outline = picture_plan.hull(doubled)
    assert {tuple(point) for point in outline.round(5).tolist()} == {tuple(point) for point in turned.round(5).tolist()}
    area = 0.5 * np.sum(outline[:, 0] * np.roll(outline[:, 1], -1) - outline[:, 1] * np.roll(outline[:, 0], -1))
    assert area == pytest.approx(4.0, abs=1e-4)  # counter-clockwise
    assert picture_plan.hull(np.array([[3.0, 3.0], [3.0, 3.0]])).tolist() == [[3.0, 3.0]]


def test_a_point_without_an_extent_and_a_single_thing(tmp_path: Path) -> None:
    alone = SceneGraph(name="s", objects=(SceneObject(id=1, tag="cup", center=np.array([1e6, 2e6, 3.0])),))
    with opened_store(alone) as db:
        for view in picture.VIEWS:
            assert picture.paint(shown(db, "s"), ".png", picture.Sheet(view=view, size=(300, 300))).named == 1


@pytest.mark.parametrize("name", ["room0_planner.json", "scannet0003_planner.json"])
def test_real_maps(data: Path, name: str, tmp_path: Path) -> None:
    from cgdb import ingest

    with opened_store(ingest.load(data / "maps" / "conceptgraphs" / name)) as db:
        (info,) = db.scenes()
        made = picture.paint(shown(db, info.name), ".png", picture.Sheet(view="both"))
    assert made.named > 20
