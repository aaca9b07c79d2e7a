"""The sheet that people judge a map with: its pictures, and the page that shows them."""

from __future__ import annotations

import io
import json
from html.parser import HTMLParser
from pathlib import Path

import numpy as np
import pytest

import cgdb
from cgdb.cli.app import main
from cgdb.errors import FormatError
from cgdb.ingest.evaluation.annotated import AnnotatedScene
from cgdb.ingest.evaluation.graph import evaluate_graph
from cgdb.ingest.evaluation.sheet_page import page
from cgdb.ingest.evaluation.sheets import read_sheet, sheet
from cgdb.scene import Place, Relation, SceneGraph, SceneObject, View

Image = pytest.importorskip("PIL.Image", reason="crops are pictures: pip install pillow")

EVIL = "</script><img src=x onerror=alert(1)><!--<script>&amp;\u2028"


def crop(shade: int, form: str = "JPEG") -> bytes:
    out = io.BytesIO()
    Image.fromarray(np.full((8, 8, 3), shade, np.uint8)).save(out, form)
    return out.getvalue()


def view(frame: int, form: str = "JPEG") -> View:
    return View(frame=frame, points=100 - frame, box=(0.0, 0.0, 8.0, 8.0), image=crop(frame, form))


ROOM = SceneGraph(
    name="../r <b>",
    objects=(
        SceneObject(id=1, tag=EVIL, caption=EVIL, views=tuple(view(i) for i in range(6))),
        SceneObject(id="../../x", tag="cup", views=(view(20, "PNG"), View(frame=21, points=1, box=(0, 0, 1, 1)))),
        SceneObject(id=3, tag="bare"),
        SceneObject(id=4, tag="wall", views=(view(30),), properties={"background": True}),
    ),
    relations=(
        Relation(source="../../x", label="on", target=1, origin="geometry"),
        Relation(source="../../x", label="on", target=1, origin="llm"),
    ),
)


@pytest.fixture
def written(tmp_path: Path) -> Path:
    with cgdb.open(tmp_path / "a.cgdb", create=True, text_encoder=None) as db:
        db.add(ROOM)
    form = tmp_path / "forms" / "form.json"
    form.parent.mkdir()
    assert main(["eval", "graph", str(tmp_path / "a.cgdb"), "--sheet", str(form)]) == 0
    return form


class Tags(HTMLParser):
    """The elements of a page, and the text of its scripts that hold data."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.found: list[str] = []
        self.data: dict[str, str] = {}
        self._in: str | None = None
        self.feed(text)

    def handle_starttag(self, tag: str, attributes: list[tuple[str, str | None]]) -> None:
        self.found.append(tag)
        self._in = dict(attributes).get("id") if tag == "script" else None

    def handle_endtag(self, tag: str) -> None:
        self._in = None

    def handle_data(self, data: str) -> None:
        if self._in is not None:
            self.data[self._in] = self.data.get(self._in, "") + data


def test_a_sheet_has_the_best_pictures_beside_it(written: Path) -> None:
    (scene,) = json.loads(written.read_text("utf-8"))["scenes"]
    nodes = {node["id"]: node for node in scene["nodes"]}
    assert list(nodes) == [1, "../../x", 3]
    assert nodes[1]["frames"] == [0, 1, 2, 3] and nodes["../../x"]["frames"] == [20, 21]
    assert "pictures" not in nodes[3] and "frames" not in nodes[3]
    folder = written.with_name("form_pictures")
    for known, views in ((1, [view(i) for i in range(4)]), ("../../x", [view(20, "PNG")])):
        names = nodes[known]["pictures"]
        assert [(written.parent / name).read_bytes() for name in names] == [one.image for one in views]
        assert all((written.parent / name).parent == folder for name in names)
    assert len(list(folder.iterdir())) == 5
    assert sorted(path.name for path in written.parent.iterdir()) == ["form.html", "form.json", "form_pictures"]


def test_an_edge_of_two_origins_is_one_question(written: Path) -> None:
    (scene,) = json.loads(written.read_text("utf-8"))["scenes"]
    assert [(edge["source"], edge["label"], edge["target"]) for edge in scene["edges"]] == [("../../x", "on", 1)]


def test_the_page_holds_the_sheet_and_its_pictures_and_no_markup_of_a_map(written: Path) -> None:
    text = written.with_suffix(".html").read_text("utf-8")
    tags = Tags(text)
    assert tags.found.count("script") == 3 and "img" not in tags.found
    assert json.loads(tags.data["sheet"]) == json.loads(written.read_text("utf-8"))
    assert json.loads(tags.data["sheet"])["scenes"][0]["nodes"][0]["tag"] == EVIL
    pictures = json.loads(tags.data["pictures"])
    kinds = {name: data.partition(";")[0] for name, data in pictures.items()}
    assert sorted(kinds.values()) == ["data:image/jpeg"] * 4 + ["data:image/png"]
    assert "default-src 'none'" in text and "http:" not in text and "https:" not in text
    without = Tags("".join(page(sheet([ROOM], lambda r: True), [])))
    assert json.loads(without.data["pictures"]) == {}


@pytest.mark.parametrize("there", ["form.json", "form.html", "form_pictures"])
def test_what_is_there_is_not_written_over(
    there: str, written: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    kept = written.with_name(there)
    kept.rename(written.parent / "aside")
    for other in ("form.json", "form.html"):
        written.with_name(other).unlink(missing_ok=True)
    if (written.with_name("form_pictures")).exists():
        for picture in written.with_name("form_pictures").iterdir():
            picture.unlink()
        written.with_name("form_pictures").rmdir()
    (written.parent / "aside").rename(kept)
    assert main(["eval", "graph", str(tmp_path / "a.cgdb"), "--sheet", str(written)]) == 2
    assert "is there already" in capsys.readouterr().err
    assert [path.name for path in written.parent.iterdir()] == [there]


def test_what_cannot_be_written_leaves_nothing(
    written: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    from cgdb.ingest.evaluation import sheet_page

    def full(*_: object) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(sheet_page, "page", full)
    other = written.with_name("other.json")
    assert main(["eval", "graph", str(tmp_path / "a.cgdb"), "--sheet", str(other)]) == 2
    assert "No space left" in capsys.readouterr().err
    assert not [path for path in written.parent.iterdir() if path.name.startswith("other")]
    assert main(["eval", "graph", str(tmp_path / "a.cgdb"), "--sheet", str(written.with_name("x.html"))]) == 2


@pytest.mark.parametrize(
    ("scenes", "says"),
    [
        ([{"scene": "s", "nodes": [{"id": 1}, {"id": "1"}], "edges": []}], "node 1 is in the list twice"),
        (
            [{"scene": "s", "nodes": [], "edges": [{"source": 1, "label": "on", "target": 2}] * 2}],
            "edge 1 is in the list twice",
        ),
        ([{"scene": "s", "nodes": [], "edges": []}] * 2, "speaks of a scene twice"),
    ],
)
def test_a_person_has_one_vote(scenes: list[object], says: str, tmp_path: Path) -> None:
    (tmp_path / "a.json").write_text(json.dumps({"format": "cgdb graph sheet 1", "scenes": scenes}))
    with pytest.raises(FormatError, match=says):
        read_sheet(tmp_path / "a.json")


def test_a_place_of_the_truth_is_no_object_of_the_map_that_has_its_number() -> None:
    box = {"extent": np.ones(3)}
    truth = AnnotatedScene(
        objects=(
            SceneObject(id=7, tag="cupboard", tags=("cupboard",), center=np.zeros(3), **box),
            SceneObject(id=8, tag="cup", tags=("cup",), center=np.array([4.0, 0, 0]), **box),
        ),
        relations=(Relation(source=8, label="in", target=7), Relation(source=1, label="contains", target=7)),
        places=frozenset({1}),
    )
    mapped = SceneGraph(
        name="s",
        objects=(
            SceneObject(id=1, tag="cupboard", center=np.zeros(3), **box),
            SceneObject(id=2, tag="cup", center=np.array([4.0, 0, 0]), **box),
        ),
        places=(Place(id=9, kind="Room"),),
        relations=(Relation(source=1, label="contains", target=2), Relation(source=9, label="contains", target=1)),
    )
    found = evaluate_graph(mapped, truth)
    # The cup is in the cupboard; the map's room 9 is none of the truth's.
    assert (found.edges.edges, found.edges.right, found.edges.truth) == (2, 1, 2)
