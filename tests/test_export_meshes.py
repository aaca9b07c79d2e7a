"""PLY, GLB and Rerun files: read back by other programs' readers, and checked against what the formats ask."""

from __future__ import annotations

import io
import json
import struct
import sys
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import cgdb
from cgdb.cli import app
from cgdb.errors import ExportError, MissingExtraError, UsageError
from cgdb.export import document, export
from cgdb.export.cloud import box_corners, clean, things
from cgdb.export.glb import _frame, _to_y_up
from cgdb.export.rerun import _quaternion
from cgdb.scene import UP_AXES, Place, Relation, SceneGraph, SceneObject, View

HOSTILE = "end_header\nelement face 9\n\x1b]0;owned\x07 日本語 \ud800" + "long " * 500
TURN = np.array([[0.6, -0.8, 0.0], [0.8, 0.6, 0.0], [0.0, 0.0, 1.0]])
JPEG = b"\xff\xd8\xff\xe0" + bytes(100)


def cloud(n: int, at: tuple[float, float, float], seed: int = 0) -> np.ndarray:
    return (np.random.default_rng(seed).random((n, 3)) + at).astype(np.float32)


SCENE = SceneGraph(
    name="lab",
    objects=(
        SceneObject(
            id=7,
            tag="sofa",
            caption="a red sofa",
            center=np.array([1.5, 2.5, 0.5]),
            extent=np.array([1.0, 2.0, 3.0]),
            rotation=TURN,
            points=cloud(500, (1, 2, 0)),
            colors=np.tile(np.array([200, 100, 0], np.uint8), (500, 1)),
            properties={"material": "leather"},
            views=(View(frame=3, points=10, box=(0, 0, 5, 5), T_world_camera=np.eye(4), image=JPEG),),
        ),
        SceneObject(id="x", tag=HOSTILE, points=cloud(20, (5, 5, 5)), caption=HOSTILE),
        SceneObject(id="7 sofa", center=np.array([0.0, 0.0, 1.0]), extent=np.array([1.0, 1.0, 2.0])),
        SceneObject(id=9, tag="sofa", center=np.array([3.0, 3.0, 3.0])),
        SceneObject(id=10, tag="nowhere"),
    ),
    places=(Place(id=100, kind="Room", name="hall", center=np.array([2, 2, 1.5]), extent=np.array([4.0, 4.0, 3.0])),),
    relations=(Relation(source=7, target=9, label="near"), Relation(source=10, target=7, label="on")),
)

# Half a surrogate pair is no text that a store takes.
STORED = replace(SCENE, objects=tuple(obj for obj in SCENE.objects if obj.tag != HOSTILE))


def written(scene: SceneGraph, format: str, **options: Any) -> bytes:
    return b"".join(document(scene, format, **options).data or ())


def parse_ply(data: bytes) -> tuple[dict[str, np.ndarray], list[str]]:
    """A reader of PLY, by its specification: {element: rows}, comments."""
    head, body = data.split(b"end_header\n", 1)
    lines = head.decode("ascii").splitlines()
    assert lines[:2] == ["ply", "format binary_little_endian 1.0"]
    kinds = {"float": "<f4", "double": "<f8", "uchar": "u1", "int": "<i4"}
    elements: list[tuple[str, int, list[tuple[str, str]]]] = []
    comments = []
    for line in lines[2:]:
        word, _, rest = line.partition(" ")
        if word == "comment":
            comments.append(rest)
        elif word == "element":
            name, count = rest.split()
            elements.append((name, int(count), []))
        else:
            assert word == "property"
            kind, name = rest.split()
            elements[-1][2].append((name, kinds[kind]))
    found = {}
    for name, count, fields in elements:
        form = np.dtype(fields)
        found[name] = np.frombuffer(body, form, count)
        body = body[count * form.itemsize :]
    assert body == b""
    return found, comments


def test_ply_holds_points_boxes_labels_and_instances() -> None:
    found, comments = parse_ply(written(SCENE, "ply"))
    vertex = found["vertex"]
    assert len(vertex) == 500 + 20 + 1 + 2 * 8
    sofa = vertex[:500]
    np.testing.assert_array_equal(np.stack([sofa["x"], sofa["y"], sofa["z"]], 1), SCENE.objects[0].points)
    assert set(sofa["instance"].tolist()) == {0}
    assert (sofa["red"][0], sofa["green"][0], sofa["blue"][0]) == (200, 100, 0)
    labels = {int(line.split()[1]): json.loads(line.split(" ", 2)[2]) for line in comments if line.startswith("label")}
    assert labels[int(sofa["label"][0])] == "sofa"
    assert labels[int(vertex["label"][vertex["instance"] == 3][0])] == "sofa"
    assert set(vertex["label"][vertex["instance"] == 2].tolist()) == {-1}
    assert f"instance 0 label {sofa['label'][0]} id 7" in comments
    assert any(line.endswith('id "7 sofa"') for line in comments)
    assert "vertices from 521 on are corners of boxes" in comments


def test_ply_edges_join_the_corners_of_boxes_without_a_cloud() -> None:
    found, _ = parse_ply(written(SCENE, "ply"))
    edge, vertex, box = found["edge"], found["vertex"], found["box"]
    assert len(edge) == 2 * 12
    at = np.stack([vertex[axis] for axis in "xyz"], axis=1)
    lengths = np.linalg.norm(at[edge["vertex1"]] - at[edge["vertex2"]], axis=1)
    assert sorted(lengths[:12].round(4).tolist()) == [1.0] * 8 + [2.0] * 4
    assert set(vertex["instance"][edge["vertex1"]].tolist()) == {2, 5}
    assert box["instance"].tolist() == [0, 2, 5]
    rotation = np.array([[box[f"r{i}{j}"][0] for j in range(3)] for i in range(3)])
    np.testing.assert_allclose(rotation, TURN)
    assert [box["ex"][0], box["ey"][0], box["ez"][0]] == [1.0, 2.0, 3.0]


def test_ply_is_read_by_trimesh() -> None:
    trimesh = pytest.importorskip("trimesh")
    bare = replace(SCENE, objects=SCENE.objects[:2], places=())
    read = trimesh.load(io.BytesIO(written(bare, "ply")), file_type="ply")
    assert read.vertices.shape == (520, 3)
    assert read.colors[0].tolist()[:3] == [200, 100, 0]


def test_ply_far_from_the_origin_keeps_millimetres() -> None:
    far = SceneGraph(
        name="utm", objects=(SceneObject(id=1, center=np.array([5e6, 4e5, 1.0]), extent=np.array([0.01, 0.02, 0.03])),)
    )
    vertex = parse_ply(written(far, "ply"))[0]["vertex"]
    assert vertex.dtype["x"] == np.dtype("<f8")
    assert np.ptp(vertex["x"]) == pytest.approx(0.01, abs=1e-6)


def glb_parts(data: bytes) -> tuple[dict[str, Any], bytes]:
    """The two chunks of a GLB; what the specification of glTF 2.0 asks of header and chunks is asserted."""
    magic, version, length = struct.unpack_from("<4sII", data)
    assert (magic, version, length) == (b"glTF", 2, len(data))
    n_json, kind = struct.unpack_from("<I4s", data, 12)
    assert kind == b"JSON" and n_json % 4 == 0
    tree = json.loads(data[20 : 20 + n_json])
    n_bin, kind = struct.unpack_from("<I4s", data, 20 + n_json)
    assert kind == b"BIN\0" and n_bin % 4 == 0
    assert 28 + n_json + n_bin == len(data)
    return tree, data[28 + n_json :]


def accessor(tree: dict[str, Any], blob: bytes, number: int) -> np.ndarray:
    found = tree["accessors"][number]
    view = tree["bufferViews"][found["bufferView"]]
    kind = {5126: "<f4", 5121: "u1"}[found["componentType"]]
    width = {"VEC3": 3, "VEC4": 4}[found["type"]]
    start = view.get("byteOffset", 0) + found.get("byteOffset", 0)
    assert start % np.dtype(kind).itemsize == 0
    assert found["count"] * width * np.dtype(kind).itemsize <= view["byteLength"]
    return np.frombuffer(blob, kind, found["count"] * width, start).reshape(-1, width)


def test_glb_is_gltf_2_with_a_node_for_each_thing() -> None:
    pytest.importorskip("trimesh")
    tree, blob = glb_parts(written(SCENE, "glb"))
    assert tree["asset"]["version"] == "2.0"
    assert tree["buffers"][0]["byteLength"] <= len(blob)
    nodes = {node["name"]: node for node in tree["nodes"]}
    assert len(nodes) == len(tree["nodes"])
    assert {"lab", "7 sofa", "7 sofa cloud", "7 sofa box", "7 sofa (2)", "9 sofa", "100 hall"} <= set(nodes)
    assert not any("nowhere" in name for name in nodes)
    assert nodes["7 sofa"]["extras"] == {"id": 7, "label": "sofa", "caption": "a red sofa"}
    assert nodes["7 sofa (2)"]["extras"]["id"] == "7 sofa"
    cloud_mesh = tree["meshes"][nodes["7 sofa cloud"]["mesh"]]["primitives"][0]
    assert cloud_mesh["mode"] == 0  # POINTS
    points = accessor(tree, blob, cloud_mesh["attributes"]["POSITION"])
    np.testing.assert_allclose(points + np.array([1.5, 2.5, 0.5]), SCENE.objects[0].points, atol=1e-5)
    # sRGB 200, 100, 0 in linear light, by the formula of the sRGB standard: 0.5776, 0.1274, 0.
    assert accessor(tree, blob, cloud_mesh["attributes"]["COLOR_0"])[0].tolist() == [147, 32, 0, 255]
    box = tree["meshes"][nodes["7 sofa box"]["mesh"]]["primitives"][0]
    assert box.get("mode", 4) == 4  # TRIANGLES
    corners = accessor(tree, blob, box["attributes"]["POSITION"])
    # A bar is a centimetre thick, around the box's edges.
    # Bars around a box of 1 x 2 x 3 m; the longest way is from corner to corner.
    assert len(corners) == 12 * 8
    across = np.linalg.norm(corners[:, None] - corners[None], axis=-1).max()
    assert across == pytest.approx(np.linalg.norm([1.01, 2.01, 3.01]), abs=1e-4)
    paint = tree["materials"][box["material"]]["pbrMetallicRoughness"]["baseColorFactor"]
    assert paint[3] == 1.0 and all(0 <= share <= 1 for share in paint)


def test_frames_of_boxes_are_closed_bars() -> None:
    trimesh = pytest.importorskip("trimesh")
    turn = trimesh.transformations.rotation_matrix(0.7, [1, 2, 3])[:3, :3]
    signs = np.array([[a, b, c] for a in (-1, 1) for b in (-1, 1) for c in (-1, 1)]) / 2
    for extent in ([2.0, 1.0, 0.5], [2.0, 0.0, 0.5], [0.0, 0.0, 0.0]):
        vertices, faces = _frame(signs * extent @ turn.T)
        bars = trimesh.Trimesh(vertices=vertices, faces=faces, process=False)
        assert bars.is_watertight and bars.is_winding_consistent and bars.volume > 0
        thick = min(max(0.05 * max(extent), 0.001), 0.01)
        if any(extent):
            np.testing.assert_allclose(np.ptp(vertices @ turn, axis=0), np.asarray(extent) + thick, atol=1e-9)


@pytest.mark.parametrize("up", UP_AXES)
def test_glb_is_y_up(up: str) -> None:
    trimesh = pytest.importorskip("trimesh")
    turn = _to_y_up(up)
    assert np.linalg.det(turn) == pytest.approx(1)
    axis = np.zeros(4)
    axis["xyz".index(up[-1])] = -1.0 if up.startswith("-") else 1.0
    assert (turn @ axis)[:3].tolist() == [0.0, 1.0, 0.0]
    read = trimesh.load(io.BytesIO(written(replace(SCENE, up=up), "glb")), file_type="glb")
    matrix, geometry = read.graph.get("7 sofa cloud")
    points = np.asarray(read.geometry[geometry].vertices) @ matrix[:3, :3].T + matrix[:3, 3]
    expected = np.asarray(SCENE.objects[0].points, float) @ turn[:3, :3].T
    order = np.lexsort(points.round(4).T), np.lexsort(expected.round(4).T)
    np.testing.assert_allclose(points[order[0]], expected[order[1]], atol=1e-4)


def test_the_same_scene_is_the_same_bytes() -> None:
    pytest.importorskip("trimesh")
    for format in ("ply", "glb"):
        assert written(SCENE, format) == written(SCENE, format)


def test_large_clouds_are_thinned_evenly_and_alike() -> None:
    done = document(SCENE, "ply", max_points=104)
    vertex = parse_ply(b"".join(done.data or ()))[0]["vertex"]
    assert np.bincount(vertex["instance"])[:2].tolist() == [100, 4]
    assert "104 of 520 points are written" in done.notes[1]
    assert written(SCENE, "ply", max_points=104) == written(SCENE, "ply", max_points=104)
    assert written(SCENE, "ply", max_points=104) != written(SCENE, "ply", max_points=104, seed=1)
    # One object less: the other keeps the points that it had.
    fewer = replace(SCENE, objects=(SCENE.objects[0],))
    again = parse_ply(written(fewer, "ply", max_points=100))[0]["vertex"]
    np.testing.assert_array_equal(again["x"][:100], vertex["x"][:100])
    assert np.bincount(parse_ply(written(SCENE, "ply", max_points=1))[0]["vertex"]["instance"])[:2].tolist() == [1, 1]


def test_what_cannot_be_written() -> None:
    with pytest.raises(UsageError, match="max_points"):
        document(SCENE, "ply", max_points=0)
    for format in ("ply", "glb"):
        with pytest.raises(ExportError, match="nothing with a position"):
            document(SceneGraph(name="s", objects=(SceneObject(id=1, tag="idea"),)), format)
    assert document(SCENE, "ply").notes == ("1 of 6 objects and places have no position: left out",)


@pytest.mark.parametrize(("format", "module"), [("glb", "trimesh"), ("rerun", "rerun")])
def test_a_missing_package_is_told(format: str, module: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, module, None)
    with pytest.raises(MissingExtraError) as caught:
        document(SCENE, format)
    assert "pip install 'cgdb[" in str(caught.value.hint)


def test_boxes_and_names() -> None:
    corners = box_corners(SCENE.objects[0])
    assert corners is not None
    np.testing.assert_allclose(corners.mean(axis=0), [1.5, 2.5, 0.5])
    np.testing.assert_allclose(corners[4] - corners[0], TURN[:, 0] * 1.0)
    assert clean(HOSTILE).isprintable()
    assert len(clean(HOSTILE)) <= 80
    assert [thing.index for thing in things(SCENE, 10**6, 0)] == [0, 1, 2, 3, 5]


def test_quaternions_turn_as_the_matrix_does() -> None:
    random = np.random.default_rng(0)
    turns = [np.linalg.qr(random.normal(size=(3, 3)))[0] for _ in range(50)]
    turns += [np.diag([1.0, -1, -1]), np.diag([-1.0, -1, 1]), np.eye(3), TURN]
    for turn in turns:
        x, y, z, w = _quaternion(turn)
        assert np.hypot.reduce([x, y, z, w]) == pytest.approx(1)
        back = np.array(
            [
                [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
                [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
                [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
            ]
        )
        # Of a reflection: the same box, the last axis pointing the other way.
        np.testing.assert_allclose(back, turn * [1, 1, round(np.linalg.det(turn))], atol=1e-9)


def test_a_rerun_recording_is_read_back(tmp_path: Path) -> None:
    pytest.importorskip("rerun", reason="rerun-sdk is not installed")
    chunk = pytest.importorskip("rerun.chunk", reason="this rerun-sdk cannot read recordings")
    path = tmp_path / "lab.rrd"
    assert export(SCENE, path).format == "rerun"
    reader = chunk.RrdReader(path)
    assert len(reader.recordings()) == 1
    assert len(reader.blueprints()) == 1
    chunks = [chunk.to_record_batch() for chunk in reader.stream()]
    found: dict[str, set[str]] = {}
    rows: dict[str, Any] = {}
    for batch in chunks:
        entity = batch.schema.metadata[b"rerun:entity_path"].decode()
        found.setdefault(entity, set()).update(batch.schema.names)
        rows.update({f"{entity} {name}": batch.column(name).to_pylist()[0] for name in batch.schema.names})
    assert {"/map", "/map/objects/7", "/map/objects/7/cloud", "/map/places/100", "/map/relations/near"} <= set(found)
    assert {"/graph", "/graph/near", "/graph/on", "/views/7", "/map/camera"} <= set(found)
    assert not any("nowhere" in entity or entity.startswith("/map/objects/10") for entity in found)
    assert len(rows["/map/objects/7/cloud Points3D:positions"]) == 500
    assert rows["/map/objects/7 Boxes3D:labels"] == ["7 sofa"]
    np.testing.assert_allclose(rows["/map/objects/7 Boxes3D:half_sizes"][0], [0.5, 1.0, 1.5])
    assert len(rows["/graph GraphNodes:node_ids"]) == 6


def test_a_rerun_recording_of_what_has_no_position_is_a_graph(tmp_path: Path) -> None:
    pytest.importorskip("rerun", reason="rerun-sdk is not installed")
    ideas = SceneGraph(
        name="ideas",
        objects=(SceneObject(id=1, tag="a"), SceneObject(id=2, tag="b")),
        relations=(Relation(source=1, target=2, label="like"),),
    )
    assert export(ideas, tmp_path / "ideas.rrd").n_bytes > 100


def test_the_command(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    store = str(tmp_path / "lab.cgdb")
    with cgdb.open(store, create=True, text_encoder=None) as db:
        db.add(STORED)
    target = tmp_path / "lab.ply"
    assert app.main(["export", store, "--into", str(target), "--max-points", "100"]) == 0
    err = capfd.readouterr().err
    assert f"wrote {target}" in err
    assert "points are written" in err
    assert len(parse_ply(target.read_bytes())[0]["vertex"]) < 150
    assert app.main(["export", store, "--format", "planner", "--max-points", "100"]) == 2
    assert "no option 'max_points'" in capfd.readouterr().err


def test_binary_data_to_a_pipe_is_the_file(tmp_path: Path) -> None:
    import subprocess

    store = str(tmp_path / "lab.cgdb")
    with cgdb.open(store, create=True, text_encoder=None) as db:
        db.add(STORED)
    done = subprocess.run(
        [sys.executable, "-m", "cgdb.cli.app", "export", store, "--format", "ply"], capture_output=True, check=True
    )
    assert done.stdout == written(STORED, "ply")


@pytest.mark.parametrize("format", ["ply", "glb"])
def test_a_real_map_with_clouds(data: Path, format: str) -> None:
    from cgdb import ingest

    trimesh = pytest.importorskip("trimesh")
    scene = ingest.load(data / "maps" / "conceptgraphs" / "main" / "full_pcd_sample_post.pkl.gz")
    read = trimesh.load(io.BytesIO(written(scene, format)), file_type=format)
    n_points = sum(len(o.points) for o in scene.objects if o.points is not None)
    if format == "ply":
        assert len(read.vertices) == n_points
    else:
        clouds = [shape for shape in read.geometry.values() if isinstance(shape, trimesh.PointCloud)]
        assert sum(len(shape.vertices) for shape in clouds) == n_points
