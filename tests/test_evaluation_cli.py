"""cgdb eval mapping, semseg and graph: from stores and truth files to tables, JSON and exit codes."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import cgdb
from cgdb.cli.app import main
from cgdb.scene import FeatureSpace, Relation, SceneGraph, SceneObject

CLASSES = ("chair", "table", "floor", "other")
VECTORS = np.eye(3, dtype=np.float32)


def block(at: float, step: float = 0.05) -> np.ndarray:
    axis = np.arange(5) * step
    return np.stack(np.meshgrid(at + axis, axis, axis), axis=3).reshape(-1, 3).astype(np.float32)


def thing(known: int, at: float, tag: str, feature: tuple[float, ...], **more: Any) -> SceneObject:
    return SceneObject(
        id=known,
        tag=tag,
        points=block(at),
        center=np.array([at + 0.1, 0.1, 0.1]),
        extent=np.full(3, 0.2),
        features={"clip": np.array(feature, np.float32)},
        **more,
    )


def scene(
    name: str, *objects: SceneObject, relations: tuple[Relation, ...] = (), encoder: str | None = None
) -> SceneGraph:
    spaces = (FeatureSpace(name="clip", dimension=3, encoder=encoder),)
    return SceneGraph(name=name, objects=objects, relations=relations, spaces=spaces)


GOOD = scene(
    "good",
    thing(1, 0, "chair", (2, 0.1, 0)),
    thing(2, 1, "table", (0.1, 1, 0)),
    thing(3, 2, "floor", (0, 0, 1), properties={"background": True}),
    relations=(Relation(source=1, label="on", target=2),),
)
BAD = scene("bad", thing(1, 0, "stool", (0.1, 1, 0)))


@pytest.fixture
def stores(tmp_path: Path) -> tuple[str, str]:
    """A store with a good map and one with a bad one."""
    for map_ in (GOOD, BAD):
        with cgdb.open(tmp_path / f"{map_.name}.cgdb", create=True, text_encoder=None) as db:
            db.add(map_)
    return str(tmp_path / "good.cgdb"), str(tmp_path / "bad.cgdb")


@pytest.fixture
def truths(tmp_path: Path) -> Path:
    """A folder with the truth of both."""
    folder = tmp_path / "truths"
    folder.mkdir()
    for name in ("good", "bad"):
        arrays = {
            "points": np.concatenate([block(at) for at in range(3)]),
            "labels": np.repeat(np.arange(3), 125),
            "instances": np.repeat([4, 5, 6], 125),
            "names": np.array(CLASSES),
        }
        np.savez(folder / f"{name}.npz", **arrays)
    # Of a class that is not scored no vector is needed.
    np.savez(tmp_path / "vectors.npz", names=np.array(CLASSES[:3]), vectors=VECTORS[:3])
    return folder


def said(capsys: pytest.CaptureFixture[str], *arguments: str, code: int = 0) -> tuple[str, str]:
    assert main(["eval", *map(str, arguments)]) == code
    captured = capsys.readouterr()
    return captured.out, captured.err


def test_maps_of_several_stores_and_their_mean(
    stores: tuple[str, str], truths: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out, err = said(capsys, "mapping", *stores, "--truth", str(truths))
    lines = out.splitlines()
    assert all(len(line) <= 80 for line in lines)
    rows = {line.split()[0]: line.split()[1:] for line in lines if line[:4] in ("good", "bad ", "mean")}
    assert rows["good"] == ["2/2", "0", "0", "1.00", "1.000", "1.00", "1.00", "1.00"]
    assert rows["bad"][:3] == ["1/2", "1", "0"] and rows["mean"][:3] == ["3/4", "1", "0"]
    assert "bad: what is not as it should be" in out and "5 table" in out and "missed" in out and "misnamed" in out
    assert "375 true points" in err
    found = json.loads(said(capsys, "mapping", *stores, "--truth", str(truths), "--json", "--quiet")[0])
    assert found["mean"]["found"] == 3 and found["mean"]["labels"] == 0.5
    assert found["scenes"][1]["objects"][1] == {
        "id": 5, "name": "table", "frames": 3, "shown_by": [], "purity": None, "completeness": None, "box_iou": None,
        "tag": None, "named": None,
    }  # fmt: skip


def test_a_truth_in_another_frame_is_brought_into_the_maps(
    stores: tuple[str, str], truths: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    moved = dict(np.load(truths / "good.npz"))
    moved["points"] = moved["points"] - np.array([0, 50, 0])
    np.savez(tmp_path / "moved.npz", **moved)
    _, err = said(capsys, "mapping", stores[0], "--truth", str(tmp_path / "moved.npz"))
    assert "lie apart" in err and "--align" in err
    (tmp_path / "traj.txt").write_text("1 0 0 0 0 1 0 50 0 0 1 0 0 0 0 1\n1 0 0 9 0 1 0 9 0 0 1 9 0 0 0 1\n")
    out, err = said(
        capsys, "mapping", stores[0], "--truth", str(tmp_path / "moved.npz"), "--align", str(tmp_path / "traj.txt")
    )
    assert "2/2" in out and "apart" not in err


def test_classes_by_vectors_and_by_tag(
    stores: tuple[str, str], truths: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    common = ("semseg", *stores, "--truth", str(truths), "--json", "--quiet")
    found = json.loads(said(capsys, *common, "--vocabulary", str(tmp_path / "vectors.npz"))[0])
    # The bad map takes the chair for a table, and its only object is nearest to everything: recall 0 and 1.
    assert [s["mAcc"] for s in found["scenes"]] == [1.0, 0.5]
    # IoU of the table there: 125 of 125 + 250 - 125, weighted by half of the points.
    assert [s["F-mIoU"] for s in found["scenes"]] == [1.0, 0.25]
    assert found["all"]["mAcc"] == pytest.approx(0.75) and found["mean"]["mAcc"] == 0.75
    assert found["all"]["F-mIoU"] == pytest.approx((125 / 250 + 250 / 375) / 2)
    by_tag = json.loads(said(capsys, *common, "--by", "tag", "--exclude", "1")[0])
    # The floor counts now, and is of the class that it is called; a stool is none of the classes.
    assert [len(s["classes"]) for s in by_tag["scenes"]] == [3, 3]
    assert [s["mAcc"] for s in by_tag["scenes"]] == [1.0, 0.0] and by_tag["scenes"][1]["unlabelled"] == 1.0
    near = json.loads(said(capsys, *common, "--by", "tag", "--within", "0.01", "--cloud", "map")[0])
    assert near["scenes"][0]["mAcc"] == 1.0


def test_a_table_of_classes(
    stores: tuple[str, str], truths: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    encoder = f"clip=vocabulary:{tmp_path / 'vectors.npz'}"
    out, err = said(capsys, "semseg", *stores, "--truth", str(truths), "--encoder", encoder)
    assert all(len(line) <= 80 for line in out.splitlines())
    assert "good   100.00  100.00" in out and "all" in out and "mean" in out and "F-mIoU" in out and "chair" in out
    assert "good: 2 objects, 2 classes" in err


def test_nodes_and_edges(stores: tuple[str, str], tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    annotated = {
        "objects": [
            {"id": "a", "names": ["chair"], "center": [0.1, 0.1, 0.1], "extent": [0.2, 0.2, 0.2]},
            {"id": "b", "names": ["desk", "table"], "points": block(1).tolist()},
        ],
        "relations": [{"source": "a", "label": "on", "target": "b"}],
    }
    (tmp_path / "a.json").write_text(json.dumps(annotated))
    truth = ("--truth", f"good={tmp_path / 'a.json'}", f"bad={tmp_path / 'a.json'}")
    out, _ = said(capsys, "graph", *stores, *truth)
    assert all(len(line) <= 80 for line in out.splitlines())
    rows = {line.split()[0]: line.split()[1:] for line in out.splitlines() if line[:4] in ("good", "bad ", "mean")}
    assert rows["good"] == ["2", "1.00", "2", "0", "1", "1.00", "1.00", "2/2"]
    assert rows["bad"] == ["1", "0.00", "1", "0", "0", "-", "0.00", "1/2"]
    assert rows["mean"] == ["1.5", "0.50", "1.5", "0.0", "0.5", "1.00", "0.50"]
    found = json.loads(said(capsys, "graph", stores[0], *truth[:2], "--json", "--quiet")[0])
    assert found["scenes"][0]["labels"]["on"]["edge_precision"] == 1.0


def test_the_objects_of_a_cloud_are_a_truth_for_nodes_only(
    stores: tuple[str, str], truths: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    for labels in ((), ("--labels", "on")):
        out, err = said(capsys, "graph", *stores, "--truth", str(truths), *labels)
        rows = {line.split()[0]: line.split()[1:] for line in out.splitlines() if line[:4] in ("good", "bad ")}
        # The floor is no thing, and who is on what a cloud does not say.
        assert rows["good"] == ["2", "1.00", "2", "0", "0", "-", "-", "2/2"]
        assert rows["bad"] == ["1", "0.00", "1", "0", "0", "-", "-", "1/2"]
        assert "good: 2 annotated objects, 0 relations" in err


def test_people_fill_in_a_sheet(stores: tuple[str, str], tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    sheet = tmp_path / "sheet.json"
    _, err = said(capsys, "graph", *stores, "--sheet", str(sheet))
    assert "3 nodes and 1 edges to judge" in err
    said(capsys, "graph", *stores, "--sheet", str(sheet), code=2)  # somebody's answers are not written over
    form = json.loads(sheet.read_text("utf-8"))
    for part in form["scenes"]:
        for node in part["nodes"]:
            node.update(object=True, label_right=node["tag"] != "stool")
        for edge in part["edges"]:
            edge["right"] = False
    sheet.write_text(json.dumps(form))
    out, err = said(capsys, "graph", *stores, "--verdicts", str(sheet))
    assert all(len(line) <= 80 for line in out.splitlines())
    rows = {line.split()[0]: line.split()[1:] for line in out.splitlines() if line[:4] in ("good", "bad ", "mean")}
    assert rows["good"] == ["2", "1.00", "2", "0", "1", "0.00", "1", "-"] and rows["bad"][:2] == ["1", "0.00"]


@pytest.mark.parametrize(
    ("arguments", "code", "says"),
    [
        (("mapping", "GOOD", "--truth", "nothing.npz"), 2, "no truth at nothing.npz"),
        (("mapping", "GOOD", "BAD", "--truth", "TRUTHS/good.npz"), 2, "no truth is given for 'bad'"),
        (("mapping", "GOOD", "--truth", "god=TRUTHS/good.npz"), 2, "did you mean 'good'"),
        (("mapping", "GOOD", "--scene", "god", "--truth", "x"), 2, "did you mean 'good'"),
        (("mapping", "nowhere.cgdb", "--truth", "x"), 6, "nowhere.cgdb"),
        (("mapping", "GOOD", "--truth", "TRUTHS", "--reach", "0"), 2, "above 0"),
        (("mapping", "GOOD", "--truth", "TRUTHS", "--reach", "nan"), 2, "above 0"),
        (("semseg", "GOOD", "--truth", "TRUTHS", "--within", "nan"), 2, "above 0"),
        (("mapping", "GOOD", "--truth", "TRUTHS", "--align", "TRUTHS/good.npz"), 5, "holds no pose"),
        (("mapping", "GOOD", "--truth", "TRUTHS", "--names", "none.json"), 2, "no file none.json"),
        (("semseg", "GOOD", "--truth", "TRUTHS"), 2, "does not say which encoder"),
        (("semseg", "GOOD", "--truth", "TRUTHS", "--space", "clap"), 2, "did you mean 'clip'"),
        (("semseg", "GOOD", "--truth", "TRUTHS", "--template", "an image"), 2, "{c}"),
        (("semseg", "GOOD", "--truth", "TRUTHS", "--exclude", "chairs"), 2, "did you mean 'chair'"),
        (
            ("semseg", "GOOD", "--truth", "TRUTHS", "--exclude", "chair,table,floor", "--by", "tag"),
            2,
            "leaves no class",
        ),
        (("semseg", "GOOD", "--truth", "TRUTHS", "--by", "tag", "--cloud", "none.ply"), 2, "no file none.ply"),
        (("semseg", "GOOD", "--truth", "TRUTHS", "--encoder", "clip=nonsense"), 9, "no encoder"),
        (("mapping", "--truth", "TRUTHS", "GOOD"), 2, "cgdb eval mapping STORE --truth ...: the store comes first"),
        (("graph", "--verdicts", "a.json", "b.json", "GOOD"), 2, "the store comes first"),
        (("graph", "GOOD"), 2, "--truth, --sheet and --verdicts"),
        (("graph", "GOOD", "--truth", "TRUTHS/../vectors.npz"), 5, "vectors.npz"),
        (("graph", "GOOD", "--truth", "GOOD"), 2, "is a store, and the truth is a file"),
        (("graph", "GOOD", "--verdicts", "none.json"), 2, "no sheet none.json"),
        (("graph", "GOOD", "--truth", "TRUTHS/good.npz", "--same", "on"), 2, "LABEL=OTHER"),
    ],
)
def test_bad_input_is_one_clear_line(
    stores: tuple[str, str],
    truths: Path,
    capsys: pytest.CaptureFixture[str],
    arguments: tuple[str, ...],
    code: int,
    says: str,
) -> None:
    where = {"GOOD": stores[0], "BAD": stores[1]}
    given = [where.get(word, word.replace("TRUTHS", str(truths))) for word in arguments]
    out, err = said(capsys, *given, code=code)
    assert out == "" and says in err and "internal error" not in err and "Traceback" not in err


def test_a_map_without_clouds_says_so(truths: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    with cgdb.open(tmp_path / "plain.cgdb", create=True, text_encoder=None) as db:
        db.add(SceneGraph(name="good", objects=(SceneObject(id=1, tag="chair"),)))
    for what in (("mapping",), ("semseg", "--by", "tag")):
        _, err = said(capsys, what[0], str(tmp_path / "plain.cgdb"), "--truth", str(truths), *what[1:], code=2)
        assert "has points" in err


def test_an_empty_store_is_not_passed_over(
    stores: tuple[str, str], truths: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    cgdb.open(tmp_path / "empty.cgdb", create=True, text_encoder=None).close()
    _, err = said(capsys, "mapping", stores[0], str(tmp_path / "empty.cgdb"), "--truth", str(truths), code=2)
    assert "empty.cgdb: the store holds no scene" in err
