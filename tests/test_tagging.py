"""Tags from a vocabulary: real CLIP vectors, what is kept, and what is wrong with stores and vocabularies."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

import cgdb
from cgdb.cli.app import main
from cgdb.enrich.tags import Tagging
from cgdb.errors import EncoderError, FormatError, StoreError, UsageError
from cgdb.meaning.names import read_names
from cgdb.scene import FeatureSpace, SceneGraph, SceneObject

NAMES = ("cup", "chair", "table lamp")
VECTORS = np.eye(3, 4, dtype=np.float32)


class Encoder:
    """Knows three names, as a model would: asked with a prompt, and counting how often."""

    name = "toy"
    dimension = 4

    def __init__(self) -> None:
        self.asked = 0

    def texts(self, texts: Sequence[str]) -> NDArray[np.float32]:
        self.asked += len(texts)
        return np.stack([VECTORS[NAMES.index(text.removeprefix("a photo of a "))] for text in texts])


def scene(name: str = "room", encoder: str | None = None) -> SceneGraph:
    def seen(i: int, strange: float = 0.1) -> dict[str, NDArray[np.float32]]:
        return {"clip": 3 * VECTORS[i] + np.float32(strange)}

    return SceneGraph(
        name=name,
        spaces=(FeatureSpace(name="clip", dimension=4, encoder=encoder),),
        objects=(
            SceneObject(id=1, features=seen(0), properties={"weight": 2.0}),
            SceneObject(id=2, features=seen(1), tag="armchair", tags=("armchair", "seat")),
            SceneObject(id=3, features=seen(2), points=np.zeros((2, 3), np.float32)),
            SceneObject(id=4, caption="something without features"),
        ),
    )


@pytest.fixture
def store(tmp_path: Path) -> Path:
    path = tmp_path / "home.cgdb"
    with cgdb.open(path, create=True, text_encoder=None) as db:
        db.add(scene())
    return path


def tagged(path: Path, **how: Any) -> Tagging:
    write = how.pop("write", True)
    with cgdb.open(path, text_encoder=None) as db:
        work = Tagging(db, how.pop("vocabulary", NAMES), encoders={"clip": Encoder()}, **how)
        steps = list(work.run(write=write))
        assert steps and steps[-1].done == steps[-1].total
        return work


def objects(path: Path) -> dict[Any, SceneObject]:
    with cgdb.open(path, text_encoder=None) as db:
        return {obj.id: obj for obj in db.scene("room").objects}


def test_what_has_no_name_gets_the_nearest(store: Path) -> None:
    (report,) = tagged(store, top=2).scenes
    assert (report.tagged, report.named, report.unseen, report.revision) == (2, 1, 1, 2)
    found = objects(store)
    assert found[1].tag == "cup" and found[1].tags[0] == "cup" and len(found[1].tags) == 2
    assert found[1].properties["weight"] == 2.0 and found[1].properties["tagged_by"] == "toy"
    scores = found[1].properties["tag_scores"]
    assert isinstance(scores, tuple) and scores[0] == pytest.approx(
        3.1 / np.linalg.norm([3.1, 0.1, 0.1, 0.1]), abs=1e-3
    )
    assert found[2].tag == "armchair" and found[2].tags == ("armchair", "seat") and not found[2].properties
    assert found[3].tag == "table lamp" and found[3].points is not None
    assert found[4].tag is None


def test_the_same_again_is_nothing_new(store: Path) -> None:
    tagged(store)
    (report,) = tagged(store).scenes
    assert report.tagged == 0 and report.revision is None
    # Another vocabulary gives other names to what was tagged here.
    (report,) = tagged(store, vocabulary=NAMES[1:]).scenes
    assert report.tagged == 2 and objects(store)[1].tag in NAMES[1:]


def test_a_name_that_a_person_gave_is_kept(store: Path) -> None:
    tagged(store)
    with cgdb.open(store, text_encoder=None) as db:
        first = next(obj for obj in db.scene("room").objects if obj.id == 1)
        with db.write("room", on_existing="merge") as writer:
            writer.objects([replace(first, tag="grandmother's cup")])
    (report,) = tagged(store).scenes
    assert report.named == 2 and objects(store)[1].tag == "grandmother's cup"


def test_replacing_keeps_what_it_was_called(store: Path) -> None:
    tagged(store, replace=True)
    tagged(store, replace=True, vocabulary=("cup",))
    found = objects(store)
    assert found[2].tag == "cup" and found[2].properties["tag_before"] == "armchair"
    assert "tag_before" not in found[1].properties


def test_a_dry_run_writes_nothing(store: Path) -> None:
    (report,) = tagged(store, write=False).scenes
    assert report.tagged == 2 and report.revision is None and objects(store)[1].tag is None


def test_the_vocabulary_is_encoded_once(store: Path) -> None:
    encoder = Encoder()
    for _ in range(2):
        with cgdb.open(store, text_encoder=None) as db:
            list(Tagging(db, NAMES, encoders={"clip": encoder}).run())
    assert encoder.asked == len(NAMES)


def test_what_cannot_be_tagged_is_refused(store: Path, tmp_path: Path) -> None:
    with cgdb.open(store, text_encoder=None) as db:
        with pytest.raises(EncoderError, match="does not say what made its features") as raised:
            list(Tagging(db, NAMES).run())
        assert raised.value.hint is not None and "--encoder clip=" in raised.value.hint
        with pytest.raises(UsageError, match="no scene has a feature space 'klip'"):
            list(Tagging(db, NAMES, space="klip").run())
        with pytest.raises(UsageError, match="at least one tag"):
            Tagging(db, NAMES, top=0)
        with pytest.raises(UsageError, match="at least one name"):
            Tagging(db, [" "])
        with pytest.raises(StoreError, match="nowhere"):
            list(Tagging(db, NAMES, scenes=["nowhere"], encoders={"clip": Encoder()}).run())
        wide = Encoder()
        wide.dimension = 7
        with pytest.raises(EncoderError, match="4 dimensions"):
            list(Tagging(db, NAMES, encoders={"clip": wide}).run())
        db.add(scene("other", "open_clip:../weights:x"))
        with pytest.raises(EncoderError, match="no model's name"):
            list(Tagging(db, NAMES, scenes=["other"]).run())
    with (
        cgdb.open(store, read_only=True, text_encoder=None) as db,
        pytest.raises(StoreError, match="cannot be written"),
    ):
        list(Tagging(db, NAMES, encoders={"clip": Encoder()}).run())
    with cgdb.open(tmp_path / "bare.cgdb", create=True, text_encoder=None) as db:
        db.add(SceneGraph(name="bare", objects=(SceneObject(id=1),)))
        with pytest.raises(UsageError, match="no object has features"):
            list(Tagging(db, NAMES).run())


@pytest.mark.parametrize(
    ("name", "content"),
    [
        ("a.txt", b""),
        ("a.txt", b"# only a comment\n"),
        ("a.txt", b"\xff\xfe"),
        ("a.txt", b"x" * 200),
        ("a.txt", b"cup\x1b[2J"),
        ("a.json", b"{}"),
        ("a.json", b"[1, 2]"),
        ("a.json", b"[" * 100_000),
    ],
)
def test_files_that_are_no_names(name: str, content: bytes, tmp_path: Path) -> None:
    (tmp_path / name).write_bytes(content)
    with pytest.raises(FormatError) as raised:
        read_names(tmp_path / name)
    assert "\n" not in raised.value.message
    with pytest.raises(FormatError, match="cannot be read"):
        read_names(tmp_path / "nowhere.txt")


# -- the command


@pytest.fixture
def vectors(tmp_path: Path) -> Path:
    path = tmp_path / "names.npz"
    np.savez(path, names=np.array(NAMES), vectors=VECTORS)
    return path


def test_the_command_needs_no_model_where_names_have_vectors(
    store: Path, vectors: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["tag", str(store), "--vocabulary", str(vectors), "--dry-run"]) == 0
    said = capsys.readouterr()
    assert said.out == "" and "room: 2 of 4 objects would get tags, 1 keep the name they have, 1 have no" in said.err
    assert main(["tag", str(store), "--vocabulary", str(vectors), "--json", "--quiet"]) == 0
    said = capsys.readouterr()
    assert json.loads(said.out)[0]["tagged"] == 2 and said.err == ""
    assert main(["query", str(store), "MATCH (o {tag: 'cup'}) RETURN o.id", "--format", "csv"]) == 0
    assert capsys.readouterr().out.split() == ["o.id,score,fits", "1,1.0,True"]


def test_names_alone_need_an_encoder(store: Path, vectors: Path, capsys: pytest.CaptureFixture[str]) -> None:
    names = store.parent / "some.txt"
    names.write_text("cup\nchair\n")
    assert main(["tag", str(store), "--vocabulary", str(names)]) == 9
    assert "does not say what made its features" in capsys.readouterr().err
    assert main(["tag", str(store), "--vocabulary", str(names), "--encoder", f"clip=vocabulary:{vectors}"]) == 0
    assert "room: 2 of 4 objects have new tags" in capsys.readouterr().err
    assert main(["tag", str(store), "--vocabulary", str(names), "--encoder", f"klip=vocabulary:{vectors}"]) == 2
    names.write_text("cup\nhorse\n")
    assert main(["tag", str(store), "--vocabulary", str(names), "--encoder", f"clip=vocabulary:{vectors}"]) == 9
    assert "horse" in capsys.readouterr().err


def test_real_things_get_their_names(data: Path, tmp_path: Path) -> None:
    """CLIP's picture vectors of 1,203 kinds of things, named out of all of these kinds: as good as exact search is."""
    names = json.loads((data / "clip/lvis_names.json").read_text())
    pictures = np.load(data / "clip/lvis_image_features.npy").astype(np.float32)
    np.savez(tmp_path / "lvis.npz", names=np.array(names), vectors=np.load(data / "clip/lvis_text_features.npy"))
    space = FeatureSpace(name="clip", dimension=pictures.shape[1])
    things = tuple(SceneObject(id=i, features={"clip": vector}) for i, vector in enumerate(pictures))
    with cgdb.open(tmp_path / "lvis.cgdb", create=True, text_encoder=None) as db:
        db.add(SceneGraph(name="lvis", objects=things, spaces=(space,)))
        work = Tagging(db, tmp_path / "lvis.npz")
        list(work.run())
        assert work.scenes[0].tagged == len(names)
        found = {obj.id: obj for obj in db.scene("lvis", features=False).objects}
    first = np.mean([found[i].tag == name for i, name in enumerate(names)])
    five = np.mean([name in found[i].tags for i, name in enumerate(names)])
    text = np.load(data / "clip/lvis_text_features.npy").astype(np.float64)
    exact = pictures / np.linalg.norm(pictures, axis=1, keepdims=True)
    exact = exact @ (text / np.linalg.norm(text, axis=1, keepdims=True)).T
    assert first == pytest.approx(np.mean(exact.argmax(axis=1) == np.arange(len(names))), abs=0.002)
    assert first > 0.6 and five > 0.85, (first, five)


def test_a_recording_is_mapped_and_named_at_once(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    image = pytest.importorskip("PIL.Image")
    from tests.mapping_rooms import FOCAL, HEIGHT, ROOM, WIDTH, room_frame

    for kind in ("rgb", "depth", "pose", "det"):
        (tmp_path / "seq" / kind).mkdir(parents=True)
    meta = {"width": WIDTH, "height": HEIGHT, "fx": FOCAL, "fy": FOCAL, "cx": 79.5, "cy": 59.5, "depth_scale": 5000}
    (tmp_path / "seq/meta.json").write_text(json.dumps(meta))
    for index in range(5):
        frame, found = room_frame(index)
        image.fromarray(frame.rgb).save(tmp_path / f"seq/rgb/{frame.name}.png")
        image.fromarray((frame.depth * 5000).astype(np.uint16)).save(tmp_path / f"seq/depth/{frame.name}.png")
        np.savetxt(tmp_path / f"seq/pose/{frame.name}.txt", frame.T_world_camera)
        assert found.features is not None
        np.savez(tmp_path / f"seq/det/{frame.name}.npz", mask=found.masks, image_feats=found.features)
    names = np.array([box.name for box in ROOM])
    np.savez(tmp_path / "names.npz", names=names, vectors=np.eye(len(ROOM), dtype=np.float32) + 0.2)
    store = str(tmp_path / "a.cgdb")
    arguments = ["map", str(tmp_path / "seq"), "--into", store, "--name", "room"]
    assert main([*arguments, "--vocabulary", str(tmp_path / "names.npz"), "--quiet"]) == 0
    with cgdb.open(store, text_encoder=None) as db:
        assert {"table", "box", "vase"} <= {obj.tag for obj in db.scene("room").objects}
        assert [revision.kind for revision in db.revisions()][-1] == "tag"
    # What cannot end well does not begin.
    (tmp_path / "names.txt").write_text("cup")
    assert main([*arguments[:-1], "two", "--vocabulary", str(tmp_path / "names.txt")]) == 2
    assert "nothing says what made these" in capsys.readouterr().err
