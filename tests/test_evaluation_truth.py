"""Truth files: what is read from them, and strangers' files that are refused in one line."""

from __future__ import annotations

import io
import json
import struct
import zipfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from cgdb.errors import CgdbError, FormatError, UsageError
from cgdb.ingest.evaluation import ply
from cgdb.ingest.evaluation.annotated import read_annotated
from cgdb.ingest.evaluation.graph import evaluate_graph
from cgdb.ingest.evaluation.labelled import read_labelled
from cgdb.ingest.evaluation.mapping import truth_of
from cgdb.ingest.evaluation.names import class_names
from cgdb.scene import SceneGraph, SceneObject

HEADER = "element vertex 3\nproperty float x\nproperty float y\nproperty float z\n"


def ascii_ply(columns: str, rows: str, more: str = "") -> bytes:
    return f"ply\nformat ascii 1.0\ncomment made here\n{HEADER}{columns}{more}end_header\n{rows}".encode()


def binary_ply(order: str, faces: list[tuple[list[int], int]]) -> bytes:
    name = {"<": "little", ">": "big"}[order]
    head = (
        f"ply\nformat binary_{name}_endian 1.0\n{HEADER}property uchar red\n"
        f"element face {len(faces)}\nproperty list uchar int vertex_indices\nproperty int object_id\nend_header\n"
    )
    body = b"".join(struct.pack(f"{order}fffB", i, 2 * i, 0, 9) for i in range(3))
    for corners, known in faces:
        body += struct.pack(f"{order}B{len(corners)}ii", len(corners), *corners, known)
    return head.encode() + body


def written(path: Path, data: bytes | str) -> Path:
    path.write_bytes(data if isinstance(data, bytes) else data.encode())
    return path


def test_a_plain_npz(tmp_path: Path) -> None:
    path = tmp_path / "truth.npz"
    np.savez(
        path,
        points=np.arange(12.0).reshape(4, 3),
        labels=[1, 1, 0, -1],
        instances=[7, 7, -1, 3],
        names=["wall", "chair"],
        vectors=np.eye(2),
    )
    found = read_labelled(path)
    assert found.names == ("wall", "chair") and found.labels.tolist() == [1, 1, 0, -1]
    assert found.owner is not None and found.kinds is not None and found.vectors is not None
    assert found.ids == (3, 7) and found.owner.tolist() == [1, 1, -1, 0] and found.kinds.tolist() == [-1, 1]
    moved = found.moved(np.array([[0, -1, 0, 10], [1, 0, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1.0]]))
    np.testing.assert_allclose(moved.points[1], [-4 + 10, 3, 5])


def test_a_generated_sequence_knows_its_objects_and_which_are_the_room(tmp_path: Path) -> None:
    np.savez(
        tmp_path / "objects.npz",
        vox_pts=np.zeros((3, 3), np.float32),
        vox_id=[1, 2, 2],
        is_bg=[True, False],
        frames_seen=[9, 2],
        cls=[0, 1],
        feats=np.eye(2, 4, dtype=np.float32),
    )
    written(tmp_path / "gsa_classes_sim.json", '["wall", "cup"]')
    found = read_labelled(tmp_path)
    assert found.names == ("wall", "cup") and found.labels.tolist() == [0, 1, 1]
    truth = truth_of(found)
    assert truth.things.tolist() == [False, True] and truth.frames.tolist() == [9, 2] and truth.ids == (1, 2)
    assert found.vectors is not None and found.vectors.tolist() == np.eye(2, 4).tolist()


def test_a_ply_of_labelled_vertices(tmp_path: Path) -> None:
    rows = "0 0 0 3 1\n1 0 0 3 1\n0 1 0 99 2\n"
    path = written(tmp_path / "a.ply", ascii_ply("property ushort label\nproperty int instance_id\n", rows))
    names = written(tmp_path / "names.json", '{"1": "wall", "3": "cabinet"}')
    found = read_labelled(path, class_names(str(names)))
    assert found.names == ("wall", "cabinet") and found.labels.tolist() == [1, 1, -1]
    assert found.ids == (1, 2) and found.kinds is not None and found.kinds.tolist() == [1, -1]
    assert read_labelled(path).names == ("3", "99")


def test_scannet_labels_are_nyu40(tmp_path: Path) -> None:
    rows = "0 0 0 5\n1 0 0 22\n0 1 0 0\n"
    written(tmp_path / "scene0000_00_vh_clean_2.labels.ply", ascii_ply("property ushort label\n", rows))
    found = read_labelled(tmp_path)
    assert [found.names[label] if label >= 0 else None for label in found.labels] == ["chair", "ceiling", None]
    assert found.owner is None
    with pytest.raises(FormatError, match="but not the object"):
        truth_of(found)


Scan = dict[str, Any]


def scan_parts() -> Scan:
    """Nine vertices of a floor, a chair of two segments and an office chair; segment 70 is nobody's."""
    return {
        "segs": {"sceneId": "scene0000_00", "segIndices": [5, 5, 5, 11, 11, 12, 70, 3, 3]},
        "groups": [
            {"id": 0, "objectId": 0, "segments": [11, 12, 999], "label": "chair"},
            {"id": 1, "objectId": 1, "segments": [5], "label": "floor"},
            {"id": 2, "objectId": 2, "segments": [3], "label": "office  chair"},
        ],
        "rows": "".join(f"{i} {i % 2} {i % 3} {c}\n" for i, c in enumerate((2, 2, 2, 5, 5, 5, 0, 5, 5))),
    }


def scan(folder: Path, parts: Scan, mesh: str = "_vh_clean_2.labels.ply") -> Path:
    name = "scene0000_00"
    written(folder / f"{name}_vh_clean_2.0.010000.segs.json", json.dumps(parts["segs"]))
    written(folder / f"{name}_vh_clean.aggregation.json", "{}")  # of the fine mesh
    vertices = ascii_ply("property ushort label\n", parts["rows"]).replace(b"vertex 3", b"vertex 9")
    if mesh == "_vh_clean_2.ply":
        vertices = vertices.replace(b"ushort label", b"uchar red")
    written(folder / f"{name}{mesh}", vertices)
    return written(folder / f"{name}.aggregation.json", json.dumps({"segGroups": parts["groups"]}))


def test_scannet_tells_objects_by_segments(tmp_path: Path) -> None:
    path = scan(tmp_path, scan_parts())
    for found in (read_labelled(tmp_path), read_labelled(path)):
        assert found.owner is not None and found.owner.tolist() == [1, 1, 1, 0, 0, 0, -1, 2, 2]
        assert found.ids == (0, 1, 2) and found.called == ("chair", "floor", "office chair")
        assert [found.names[label] if label >= 0 else None for label in found.labels[[0, 3, 6]]] == [
            "floor", "chair", None,
        ]  # fmt: skip
        truth = truth_of(found)
        assert truth.things.tolist() == [True, False, True] and truth.names == ("chair", "floor", "chair")


def test_without_classes_a_scan_has_those_that_people_wrote(tmp_path: Path) -> None:
    scan(tmp_path, scan_parts(), "_vh_clean_2.ply")
    found = read_labelled(tmp_path)
    assert found.names == ("chair", "floor", "office chair")
    assert found.labels.tolist() == [1, 1, 1, 0, 0, 0, -1, 2, 2]


def test_a_scan_is_an_annotated_scene_without_relations(tmp_path: Path) -> None:
    scan(tmp_path, scan_parts())
    for path in (tmp_path, tmp_path / "scene0000_00.aggregation.json"):
        found = read_annotated(path)
        assert [(obj.id, obj.tags) for obj in found.objects] == [(0, ("chair",)), (2, ("office chair", "chair"))]
        assert found.objects[1].points is not None and found.objects[1].points.tolist() == [[7, 1, 1], [8, 0, 2]]
        assert not found.relations


def test_an_object_that_a_cloud_does_not_show_is_none_and_ids_of_clouds_are_their_own(tmp_path: Path) -> None:
    corner = np.array([[0, 0, 0], [1, 1, 1]], np.float32)
    np.savez(
        tmp_path / "objects.npz",
        vox_pts=np.concatenate([corner, corner + 5]),
        vox_id=[2, 2, 3, 3],
        is_bg=[False] * 3,
        frames_seen=[0, 9, 9],
        cls=[0, 0, 1],
    )
    written(tmp_path / "gsa_classes_sim.json", '["cup", "box"]')
    truth = read_annotated(tmp_path)
    assert [(obj.id, obj.tag) for obj in truth.objects] == [(2, "cup"), (3, "box")]
    box = {"center": np.full(3, 5.5), "extent": np.ones(3)}
    scene = SceneGraph(name="s", objects=(SceneObject(id=2, tag="box", **box), SceneObject(id=1, tag="cup")))
    assert [(node.id, node.truth, node.right) for node in evaluate_graph(scene, truth).nodes] == [
        (2, 3, True), (1, None, False),
    ]  # fmt: skip


def spoil_groups(parts: Scan) -> None:
    parts["groups"] = {"0": "chair"}


def spoil_group(parts: Scan) -> None:
    parts["groups"][1] = 5


def spoil_segments(parts: Scan) -> None:
    parts["groups"][1]["segments"] = [-1, 2.5]


def spoil_object(parts: Scan) -> None:
    parts["groups"][1]["objectId"] = "1"


def spoil_twice(parts: Scan) -> None:
    parts["groups"][1]["objectId"] = 0


def spoil_label(parts: Scan) -> None:
    del parts["groups"][1]["label"]


def spoil_count(parts: Scan) -> None:
    parts["segs"]["segIndices"].pop()


def spoil_indices(parts: Scan) -> None:
    parts["segs"] = {"segIndices": {}}


@pytest.mark.parametrize(
    ("spoil", "says"),
    [
        (spoil_groups, "no list 'segGroups'"),
        (spoil_group, "object 1: must be"),
        (spoil_segments, "'segments' must hold"),
        (spoil_object, "'objectId' must hold"),
        (spoil_twice, "#0 is there already"),
        (spoil_label, "has no label"),
        (spoil_count, "tells of 8 vertices"),
        (spoil_indices, "'segIndices' must hold"),
    ],
)
def test_a_scan_that_does_not_fit_is_refused_in_one_line(
    tmp_path: Path, spoil: Callable[[Scan], None], says: str
) -> None:
    parts = scan_parts()
    spoil(parts)
    path = scan(tmp_path, parts)
    for reader in (read_labelled, read_annotated):
        with pytest.raises(FormatError, match=says) as caught:
            reader(tmp_path)
        assert caught.value.message.count(str(path)) == 1 and "\n" not in caught.value.message


@pytest.mark.parametrize("missing", ["_vh_clean_2.0.010000.segs.json", "_vh_clean_2.labels.ply"])
def test_an_annotation_without_its_scan(tmp_path: Path, missing: str) -> None:
    path = scan(tmp_path, scan_parts())
    (tmp_path / f"scene0000_00{missing}").unlink()
    with pytest.raises(FormatError, match="is not beside it"):
        read_labelled(path)


@pytest.mark.parametrize("order", ["<", ">"])
def test_replica_keeps_objects_with_the_faces(tmp_path: Path, order: str) -> None:
    folder = tmp_path / "room_0" / "habitat"
    folder.mkdir(parents=True)
    written(folder / "mesh_semantic.ply", binary_ply(order, [([0, 1, 2], 40), ([0, 2, 2], 41)]))
    semantic = {"classes": [{"id": 5, "name": "sofa"}, {"id": 93, "name": "wall"}]}
    semantic["objects"] = [{"id": 40, "class_id": 5}, {"id": 41, "class_id": 93}]
    written(folder / "info_semantic.json", json.dumps(semantic))
    found = read_labelled(tmp_path / "room_0")
    np.testing.assert_allclose(found.points, [[1, 2, 0], [4 / 3, 8 / 3, 0]], rtol=1e-6)
    assert [found.names[label] for label in found.labels] == ["sofa", "wall"] and found.ids == (40, 41)
    assert truth_of(found).things.tolist() == [True, False]


def bomb() -> bytes:
    """An .npz whose array claims sixteen terabytes."""
    header = io.BytesIO()
    np.lib.format.write_array_header_1_0(header, {"descr": "<f8", "fortran_order": False, "shape": (2**41,)})
    packed = io.BytesIO()
    with zipfile.ZipFile(packed, "w") as archive:
        archive.writestr("points.npy", header.getvalue())
    return packed.getvalue()


def saved(**arrays: object) -> bytes:
    packed = io.BytesIO()
    np.savez(packed, **arrays)  # type: ignore[arg-type]
    return packed.getvalue()


POINTS = np.zeros((2, 3))
LABEL = "property ushort label\n"


@pytest.mark.parametrize(
    ("name", "data", "says"),
    [
        ("a.npz", b"", "no arrays"),
        ("a.npz", b"PK\x03\x04 not really", "no arrays"),
        ("a.npz", bomb(), "no arrays"),
        ("a.npz", saved(points=np.array([{}], object)), "no arrays"),
        ("a.npz", saved(labels=[1]), "no array 'points'"),
        ("a.npz", saved(points=POINTS), "neither the class nor the object"),
        ("a.npz", saved(points=np.zeros((2, 2)), labels=[0, 0]), "expected numbers"),
        ("a.npz", saved(points=np.zeros((0, 3)), labels=[]), "no points"),
        ("a.npz", saved(points=[[0, 0, np.nan]], labels=[0]), "no metres"),
        ("a.npz", saved(points=[[0, 0, 1e30]], labels=[0]), "no metres"),
        ("a.npz", saved(points=POINTS, labels=[0]), "labels has shape"),
        ("a.npz", saved(points=POINTS, labels=[0.5, 1]), "whole numbers"),
        ("a.npz", saved(points=POINTS, labels=["a", "b"]), "whole numbers"),
        ("a.npz", saved(points=POINTS, labels=[0, 0], names=[1]), "row of text"),
        ("a.npz", saved(points=POINTS, labels=[0, 0], names=["a"], vectors=np.ones((2, 3))), "vectors are"),
        ("a.npz", saved(vox_pts=POINTS, vox_id=[1, 9], is_bg=[False], frames_seen=[1]), "there is not"),
        ("a.npz", saved(vox_pts=POINTS), "no array 'vox_id'"),
        ("a.ply", b"", "no PLY"),
        ("a.ply", b"ply\nformat ascii 1.0\nend_header", "ends with its header"),
        ("a.ply", b"ply\nelement vertex 1\nend_header\n", "no format"),
        ("a.ply", b"ply\nformat ascii 1.0\nproperty float x\nend_header\n", "header has a line"),
        ("a.ply", b"ply\nformat ascii 1.0\nelement vertex 0\nend_header\n", "no vertices with x, y and z"),
        ("a.ply", ascii_ply(LABEL, "0 0 0 1\n"), "cut off"),
        ("a.ply", ascii_ply(LABEL, "0 0 0 1\n1 1\n2 2 2 2\n"), "not all the same"),
        ("a.ply", ascii_ply(LABEL, "0 0 0 1\n1 x 1 1\n2 2 2 2\n"), "not all the same"),
        ("a.ply", ascii_ply("", "0 0 0\n1 1 1\n2 2 2\n"), "have labels"),
        ("a.ply", ascii_ply(LABEL + LABEL, "0 0 0 1 1\n" * 3), "two properties"),
        ("a.ply", binary_ply("<", [([0, 1, 2], 1)])[:-2], "cut off"),
        ("a.ply", binary_ply("<", [([0, 1, 2], 1), ([0, 1, 2, 2], 2), ([0, 1, 2], 3)]), "differ in their number"),
        ("a.ply", binary_ply("<", [([0, 1, 7], 1)]), "a vertex that there is not"),
        ("a.ply", binary_ply("<", []).replace(b"vertex 3", b"vertex 999999999999"), "cut off"),
        ("a.obj", b"v 0 0 0", "no truth that is known"),
    ],
)
def test_bad_truth_is_refused_in_one_line(tmp_path: Path, name: str, data: bytes, says: str) -> None:
    path = written(tmp_path / name, data)
    with pytest.raises(FormatError, match=says) as caught:
        read_labelled(path)
    assert caught.value.message.startswith(str(path)) and "\n" not in caught.value.message
    assert caught.value.message.count(str(path)) == 1


def test_a_truth_that_is_not_there(tmp_path: Path) -> None:
    with pytest.raises(UsageError, match="no truth"):
        read_labelled(tmp_path / "nothing.npz")
    with pytest.raises(FormatError, match="holds no truth"):
        read_labelled(tmp_path)


def test_lists_that_are_no_corners_do_not_shift_what_follows(tmp_path: Path) -> None:
    path = written(
        tmp_path / "a.ply", ascii_ply("property list uchar int tags\nproperty int label\n", "0 0 0 2 8 9 5\n" * 3)
    )
    assert ply.read(path).vertex["label"].tolist() == [5, 5, 5]


@pytest.mark.parametrize("text", ["", "[", "5", "[]", '["a", 3]', '{"x": "a"}', '{"classes": [{"id": "1"}]}', '[""]'])
def test_class_names_that_are_none(tmp_path: Path, text: str) -> None:
    path = written(tmp_path / "names.json", text)
    with pytest.raises(FormatError) as caught:
        class_names(str(path))
    assert caught.value.message.count(str(path)) == 1


# -- annotated graphs


def test_an_annotated_scene(tmp_path: Path) -> None:
    document = {
        "objects": [
            {"id": 1, "names": ["sofa", "couch"], "center": [0, 0, 0.4], "extent": [2, 1, 0.8]},
            {"id": "b", "names": "cushion", "points": [[0, 0, 0.8], [0.4, 0.4, 1.0]]},
        ],
        "relations": [{"source": "b", "label": "on", "target": 1}],
    }
    found = read_annotated(written(tmp_path / "a.json", json.dumps(document)))
    assert [o.tags for o in found.objects] == [("sofa", "couch"), ("cushion",)]
    assert found.objects[1].points is not None and found.relations[0].source == "b"


def test_a_map_is_an_annotated_scene_too(data: Path) -> None:
    found = read_annotated(data / "maps" / "virtualhome" / "TestScene1_graph.json")
    assert len(found.objects) > 400 and len(found.places) > 3
    assert {"on", "in", "near", "contains"} <= {r.label for r in found.relations}


ONE = '{"id": 1, "names": ["a"]}'


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("", "empty"),
        ('{"objects": [' + ONE, "not whole JSON"),
        (f'{{"objects": [{ONE}, 5]}}', "object 1: must be"),
        (f'{{"objects": [{ONE}, {ONE}]}}', "two objects have the id #1"),
        (f'{{"objects": [{ONE}, {{"names": ["b"]}}]}}', "id"),
        (f'{{"objects": [{ONE}, {{"id": 2}}]}}', "#2: has no names"),
        ('{"objects": [{"id": 1, "names": ["a"], "center": [1, 2]}]}', "three numbers"),
        ('{"objects": [{"id": 1, "names": ["a"], "center": [1, 2, NaN]}]}', "NaN"),
        ('{"objects": [{"id": 1, "names": ["a"], "center": [1, 2, 3], "extent": [1, -2, 3]}]}', "negative"),
        ('{"objects": [{"id": 1, "names": ["a"], "center": [1, 2, 3], "rotation": [[1]]}]}', "rotation"),
        ('{"objects": [{"id": 1, "names": ["a"], "points": [[1, 2]]}]}', "three numbers each"),
        ('{"objects": [{"id": 1, "names": ["a"], "points": "all"}]}', "three numbers each"),
        (f'{{"objects": [{ONE}], "relations": 5}}', "'relations' must be a list"),
        (f'{{"objects": [{ONE}], "relations": [{{"source": 1, "target": 9, "label": "on"}}]}}', "no object #9"),
        (f'{{"objects": [{ONE}], "relations": [{{"source": 1, "target": 1}}]}}', "no label"),
    ],
)
def test_bad_annotations_are_refused_in_one_line(tmp_path: Path, text: str, says: str) -> None:
    path = written(tmp_path / "a.json", text)
    with pytest.raises(CgdbError, match=says) as caught:
        read_annotated(path)
    assert caught.value.exit_code == 5 and caught.value.message.count(str(path)) == 1
