"""Spark-DSG and VirtualHome: layers and rooms, boxes and quaternions, edges by their meaning."""

from __future__ import annotations

import json
from collections import Counter
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from cgdb import ingest
from cgdb.errors import CgdbError, SceneError, UsageError
from cgdb.scene import SceneGraph

BIG = 5692549928996306944


def load(path: Path, **options: Any) -> SceneGraph:
    return ingest.load(path, relate=False, **options)


def written(path: Path, value: Any) -> Path:
    path.write_text(json.dumps(value), encoding="utf-8")
    return path


def node(i: int, layer: int, kind: str, *, partition: int | None = None, **attributes: Any) -> dict[str, Any]:
    found: dict[str, Any] = {"id": i, "layer": layer, "attributes": {"type": kind, "position": [1, 2, 3], **attributes}}
    return found if partition is None else {**found, "partition": partition}


def box(kind: Any, **more: Any) -> dict[str, Any]:
    return {"type": kind, "world_P_center": [1, 1, 1], "world_R_center": {"w": 1, "x": 0, "y": 0, "z": 0}, **more}


OLD = {
    "directed": False,
    "layer_ids": [2, 3, 4, 5],
    "nodes": [
        node(
            BIG,
            2,
            "ObjectNodeAttributes",
            name="O(0)",
            semantic_label=5,
            bounding_box=box("AABB", min=[0, 0, 0], max=[2, 2, 2]),
        ),
        node(2, 2, "AgentNodeAttributes"),
        node(30, 3, "PlaceNodeAttributes", bounding_box=box("INVALID", min=[0, 0, 0], max=[0, 0, 0]), distance=0.5),
        node(31, 3, "PlaceNodeAttributes"),
        node(40, 4, "RoomNodeAttributes", name="R(0)"),
        node(50, 5, "SemanticNodeAttributes", name="B(0)"),
    ],
    "edges": [
        {"source": 31, "target": 30, "info": {}},
        {"source": 30, "target": BIG, "info": {}},
        {"source": 30, "target": 40, "info": {}},
        {"source": 50, "target": 40, "info": {}},
        {"source": 30, "target": 2, "info": {}},
    ],
}


def test_layers_become_objects_and_places(tmp_path: Path) -> None:
    path = written(tmp_path / "dsg.json", OLD)
    scene = load(path)
    assert ingest.detect(path) == "spark-dsg"
    (chair,) = scene.objects
    assert (chair.id, chair.tag, chair.properties["semantic_label"]) == (BIG, "O(0)", 5)
    assert chair.extent is not None and chair.extent.tolist() == [2, 2, 2] and chair.rotation is None
    assert [(p.id, p.kind, p.name) for p in scene.places] == [
        (30, "Place", None),
        (31, "Place", None),
        (40, "Room", "R(0)"),
        (50, "Building", "B(0)"),
    ]
    assert scene.places[0].center is not None and scene.places[0].extent is None
    assert {(r.source, r.label, r.target) for r in scene.relations} == {
        (30, "connected_to", 31),
        (30, "contains", BIG),
        (40, "contains", 30),
        (50, "contains", 40),
    }
    assert scene.provenance["dropped"] == {"agent poses": 1, "edges of agent poses": 1}


def test_newer_files_name_layers_labels_and_partitions(tmp_path: Path) -> None:
    turned = {"w": np.cos(0.25), "x": 0, "y": 0, "z": np.sin(0.25)}
    value = {
        "layer_ids": [2, 3, 4],
        "layer_names": {
            "OBJECTS": {"layer": 2, "partition": 0},
            "AGENTS": {"layer": 2, "partition": 97},
            "MESH_PLACES": {"layer": 3, "partition": 1},
            "ROOMS": 4,
        },
        "metadata": {"labelspaces": {"_l2p0": [[5, "chair"], [6, "desk"]]}},
        "nodes": [
            node(
                1,
                2,
                "ObjectNodeAttributes",
                partition=0,
                name="O(1)",
                semantic_label=5,
                bounding_box=box("OBB", dimensions=[2, 1, 1], world_R_center=turned),
            ),
            node(9, 2, "OtherAttributes", partition=97),
            node(
                3,
                3,
                "Place2dNodeAttributes",
                partition=1,
                bounding_box=box(3, dimensions=[2, 0.0, 1], world_R_center=turned),
            ),
            node(4, 4, "RoomNodeAttributes", partition=0, name="kitchen"),
        ],
        "edges": [],
    }
    scene = load(written(tmp_path / "dsg.json", value))
    (chair,) = scene.objects
    assert (chair.tag, chair.properties["name"]) == ("chair", "O(1)")
    assert chair.rotation is not None
    assert np.allclose(chair.rotation[:, 0], [np.cos(0.5), np.sin(0.5), 0])
    assert [(p.kind, p.name) for p in scene.places] == [("Place", None), ("Room", "kitchen")]
    assert scene.places[0].extent is not None
    assert np.allclose(scene.places[0].extent, [2 * np.cos(0.5), 2 * np.sin(0.5), 1])


def test_the_real_dsg(data: Path) -> None:
    scene = load(data / "maps/hydra/apartment_dsg.json")
    assert len(scene.objects) == 7 and Counter(p.kind for p in scene.places) == {"Place": 185, "Room": 1, "Building": 1}
    assert Counter(r.label for r in scene.relations) == {"connected_to": 396, "contains": 143}
    assert scene.provenance["dropped"] == {"agent poses": 102, "edges of agent poses": 203}
    assert len(scene.objects) + len(scene.places) + 102 == 296 and len(scene.relations) + 203 == 742
    assert all(2**53 < obj.id < 2**63 for obj in scene.objects if isinstance(obj.id, int))
    assert all(isinstance(obj.id, int) and obj.extent is not None for obj in scene.objects)


FLAT = {
    "nodes": [
        {
            "id": 1,
            "category": "Rooms",
            "class_name": "dining_room",
            "bounding_box": {"center": [0, 1, 0], "size": [5, 2, 5]},
            "properties": [],
            "states": [],
        },
        {
            "id": 2,
            "category": "Furniture",
            "class_name": "kitchen_table",
            "bounding_box": {"center": [0, 0.5, 0], "size": [1, 1, 1]},
            "properties": ["SURFACES"],
            "states": ["CLEAN"],
            "prefab_name": "T",
        },
        {
            "id": 3,
            "category": "Props",
            "class_name": "mug",
            "bounding_box": None,
            "properties": ["GRABBABLE", "CAN_OPEN"],
            "states": [],
        },
    ],
    "edges": [
        {"from_id": 2, "relation_type": "INSIDE", "to_id": 1},
        {"from_id": 3, "relation_type": "ON", "to_id": 2},
        {"from_id": 3, "relation_type": "INSIDE", "to_id": 2},
        {"from_id": 3, "relation_type": "CLOSE", "to_id": 2},
        {"from_id": 3, "relation_type": "FACING", "to_id": 2},
        {"from_id": 2, "relation_type": "BETWEEN", "to_id": 1},
        {"from_id": 3, "relation_type": "HOLDS_RH", "to_id": 2},
    ],
}


def test_a_flat_keeps_what_the_simulator_knows(tmp_path: Path) -> None:
    path = written(tmp_path / "flat.json", FLAT)
    scene = load(path)
    assert ingest.detect(path) == "virtualhome" and scene.up == "y"
    assert [(p.id, p.kind, p.name) for p in scene.places] == [(1, "Room", "dining room")]
    table, mug = scene.objects
    assert (table.tag, mug.tag, mug.caption, mug.center) == ("kitchen table", "mug", None, None)
    assert mug.properties == {"affordances": ("grabbable", "can_open"), "category": "Props"}
    assert table.properties["states"] == ("clean",)
    assert [(r.source, r.label, r.target) for r in scene.relations] == [
        (1, "contains", 2),
        (3, "on", 2),
        (3, "in", 2),
        (3, "near", 2),
        (3, "facing", 2),
        (2, "between", 1),
        (3, "holds_rh", 2),
    ]


def test_a_file_of_two_graphs_and_its_parts(tmp_path: Path) -> None:
    after = {"nodes": FLAT["nodes"], "edges": []}
    path = written(tmp_path / "both.json", {"init_graph": FLAT, "final_graph": after})
    assert len(load(path).relations) == 7
    assert load(path, part="final_graph").relations == ()
    assert load(path, part="final_graph").provenance["part"] == "final_graph"
    with pytest.raises(UsageError, match="no part 'middle'"):
        load(path, part="middle")
    with pytest.raises(UsageError, match="one graph"):
        load(written(tmp_path / "flat.json", FLAT), part="final_graph")
    with pytest.raises(UsageError, match="no parts"):
        load(written(tmp_path / "list.json", [{"id": 1, "tag": "a"}]), part="final_graph")


@pytest.mark.parametrize(("which", "value"), [("from_id", OLD), ("source", OLD)])
def test_an_edge_to_nothing_is_refused(tmp_path: Path, which: str, value: Any) -> None:
    if which == "source":
        bad = {**OLD, "edges": [{"source": 30, "target": 12345}]}
    else:
        bad = {**FLAT, "edges": [{"from_id": 2, "to_id": 12345, "relation_type": "ON"}]}
    with pytest.raises(SceneError, match="edge 0: there is no node #12345"):
        load(written(tmp_path / "m.json", bad))


@pytest.mark.parametrize(
    "quaternion", [{"w": 0, "x": 0, "y": 0, "z": 0}, {"w": 1e300, "x": 1e300}, {"w": "a"}, [1, 0, 0, 0]]
)
def test_a_quaternion_that_turns_nowhere_is_refused(tmp_path: Path, quaternion: Any) -> None:
    turned = node(
        1, 2, "ObjectNodeAttributes", bounding_box=box("OBB", dimensions=[1, 1, 1], world_R_center=quaternion)
    )
    with pytest.raises(CgdbError, match="#1"):
        load(written(tmp_path / "m.json", {"layer_ids": [2], "nodes": [turned], "edges": []}))


FLATS = {"TestScene1": (437, 14157), "TestScene3": (392, 8830), "TestScene5": (354, 11980), "TestScene7": (362, 8935)}


def test_real_flats(data: Path) -> None:
    for name, (nodes, edges) in FLATS.items():
        scene = load(data / f"maps/virtualhome/{name}_graph.json")
        assert len(scene.objects) + len(scene.places) == nodes and len(scene.relations) == edges
        assert {place.kind for place in scene.places} == {"Room"}
        assert all(obj.center is not None for obj in scene.objects)


def test_real_changes(data: Path) -> None:
    for name in ("file363_2", "file70_1"):
        before = load(data / f"changes/{name}.json")
        after = load(data / f"changes/{name}.json", part="final_graph")
        assert len(before.objects) == len(after.objects) == 296 and len(before.places) == 4
        assert {o.id for o in before.objects} == {o.id for o in after.objects}
        assert "holds_rh" in {r.label for r in after.relations} - {r.label for r in before.relations} or len(
            after.relations
        ) > len(before.relations)
