"""Plain JSON lists, JSON lines and the planner's JSON: what is read, what is dropped, how it is told."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from cgdb import ingest
from cgdb.errors import SceneError
from cgdb.scene import SceneGraph, check_scene

LAMP = {
    "id": 4,
    "bbox_extent": [0.2, 0.3, 0.5],
    "bbox_center": [1.0, -2.0, 0.75],
    "possible_tags": ["lamp", "light", "lamp"],
    "object_tag": "desk lamp",
    "caption": " a black desk lamp ",
}


def write(path: Path, value: Any) -> Path:
    path.write_text(json.dumps(value), encoding="utf-8")
    return path


def write_lines(path: Path, records: list[Any]) -> Path:
    path.write_text("".join(json.dumps(record) + "\n" for record in records), encoding="utf-8")
    return path


def load(path: Path, **options: Any) -> SceneGraph:
    return ingest.load(path, relate=False, **options)


def test_planner_fields_are_read(tmp_path: Path) -> None:
    scene = load(write(tmp_path / "flat.json", [LAMP]))
    (lamp,) = scene.objects
    assert scene.name == "flat"
    assert (lamp.id, lamp.tag, lamp.tags, lamp.caption) == (4, "desk lamp", ("lamp", "light"), "a black desk lamp")
    assert lamp.center is not None and lamp.center.tolist() == [1.0, -2.0, 0.75]
    assert lamp.extent is not None and lamp.extent.tolist() == [0.2, 0.3, 0.5]
    assert scene.provenance["format"] == "conceptgraphs-planner"
    assert len(scene.provenance["sha256"]) == 64


@pytest.mark.parametrize("tag", ["invalid", "None", "unknown"])
def test_planner_drops_what_is_no_object_and_counts_it(tmp_path: Path, tag: str) -> None:
    scene = load(write(tmp_path / "m.json", [LAMP, {**LAMP, "id": 5, "object_tag": tag}]))
    assert [obj.id for obj in scene.objects] == [4]
    assert scene.provenance["dropped"] == {"objects tagged invalid, none or unknown": 1}


def test_annotations_beside_the_planner_file_become_properties(tmp_path: Path) -> None:
    note = {"id": 4, "object_tags": "lamp", "colors": "black, silver", "materials": "metal"}
    write(tmp_path / "annotated_scenegraph.json", [note])
    (lamp,) = load(write(tmp_path / "scene_graph.json", [LAMP])).objects
    assert lamp.properties["colors"] == "black, silver"
    assert lamp.properties["materials"] == "metal"
    assert lamp.tag == "desk lamp"


def test_a_box_without_size_is_a_point_and_a_flat_box_stays(tmp_path: Path) -> None:
    flat = {**LAMP, "id": 5, "bbox_extent": [1.0, 0.5, 0.0]}
    scene = load(write(tmp_path / "m.json", [{**LAMP, "bbox_extent": [0.0, 0, 0.0]}, flat]))
    assert scene.objects[0].extent is None and scene.objects[0].center is not None
    assert scene.objects[1].extent is not None and scene.objects[1].extent.tolist() == [1.0, 0.5, 0.0]
    assert scene.provenance["warnings"] == ["object #4: its box has no size; it is taken for a point"]


def test_plain_names_of_the_same_thing(tmp_path: Path) -> None:
    record = {
        "id": "mug-1",
        "description": "a mug",
        "name": "mug",
        "category": "kitchenware",
        "position": {"x": 1, "y": 2, "z": 3},
        "size": [1, 1, 2],
        "embedding": [0.5, 0.25],
        "room": "kitchen",
        "price eur": 4.5,
        "clean": True,
        "attributes": {"color": "red", "parts": ["handle", "body"]},
        "history": [{"at": 1}],
    }
    scene = load(write(tmp_path / "m.json", [record]))
    (mug,) = scene.objects
    assert (mug.id, mug.tag, mug.caption) == ("mug-1", "mug", "a mug")
    assert mug.center is not None and mug.center.tolist() == [1, 2, 3]
    assert np.array_equal(mug.features["vector"], np.float32([0.5, 0.25]))
    assert dict(mug.properties) == {
        "category": "kitchenware",
        "price_eur": 4.5,
        "clean": True,
        "color": "red",
        "parts": ("handle", "body"),
    }
    assert scene.provenance["dropped"] == {"property 'history' that is no plain value": 1}
    (kitchen,) = scene.places
    assert (kitchen.kind, kitchen.name) == ("Room", "kitchen")
    assert [(r.source, r.label, r.target) for r in scene.relations] == [(kitchen.id, "contains", "mug-1")]


def test_captions_called_invalid_are_no_objects(tmp_path: Path) -> None:
    path = write(tmp_path / "m.json", [{"id": 0, "caption": "Invalid"}, {"id": 1, "caption": "a cup"}])
    scene = load(path)
    assert [obj.id for obj in scene.objects] == [1]
    assert scene.provenance["dropped"] == {"objects that the map calls invalid": 1}


def test_records_without_ids_are_numbered_with_a_warning(tmp_path: Path) -> None:
    scene = load(write(tmp_path / "m.json", [{"caption": "a"}, {"caption": "b"}]))
    assert [obj.id for obj in scene.objects] == [0, 1]
    assert "without an id" in scene.provenance["warnings"][0]


def test_an_object_with_objects_and_relations_is_read(tmp_path: Path) -> None:
    relation = {"source": 1, "target": 2, "label": "on", "confidence": 0.5, "explanation": "seen", "origin": "human"}
    value = {"objects": [{"id": 1, "tag": "cup"}, {"id": 2, "tag": "table"}], "relations": [relation]}
    (found,) = load(write(tmp_path / "m.json", value)).relations
    assert (found.source, found.label, found.target) == (1, "on", 2)
    assert (found.confidence, found.explanation, found.origin) == (0.5, "seen", "human")


def test_half_characters_become_the_replacement_character(tmp_path: Path) -> None:
    path = tmp_path / "m.json"
    path.write_text('[{"id": 1, "caption": "a \\ud800 cup\\u0000"}]', encoding="utf-8")
    (cup,) = load(path).objects
    assert cup.caption == "a \N{REPLACEMENT CHARACTER} cup\N{REPLACEMENT CHARACTER}"
    cup.caption.encode("utf-8")


def test_the_content_decides_not_the_name(tmp_path: Path) -> None:
    assert ingest.detect(write(tmp_path / "map.pkl.gz", [LAMP])) == "conceptgraphs-planner"
    assert ingest.detect(write_lines(tmp_path / "map.json", [{"id": 1, "tag": "a"}, {"id": 2, "tag": "b"}])) == "jsonl"


RECORDS: list[dict[str, Any]] = [
    {"source": 2, "target": 0, "label": "on"},
    *({"id": i, "tag": f"thing {i}", "room": "hall" if i % 2 else "den", "embedding": [i, 1.0]} for i in range(25)),
]


def test_a_stream_holds_what_load_holds(tmp_path: Path) -> None:
    path = write_lines(tmp_path / "m.jsonl", RECORDS)
    whole, stream = load(path), ingest.stream(path, batch=7)
    pieces = list(stream.batches)
    assert max(len(objects) + len(relations) for objects, relations in pieces) <= 8
    assert [obj.id for objects, _ in pieces for obj in objects] == [obj.id for obj in whole.objects] == list(range(25))
    assert sorted(map(str, (r for _, rs in pieces for r in rs))) == sorted(map(str, whole.relations))
    assert {place.name for place in stream.header.places} == {"hall", "den"}
    assert stream.header.spaces == whole.spaces
    check_scene(whole)


def test_a_stream_of_another_format_is_cut(tmp_path: Path) -> None:
    stream = ingest.stream(write(tmp_path / "m.json", RECORDS[1:]), batch=10)
    assert [len(objects) for objects, _ in stream.batches if objects] == [10, 10, 5]


@pytest.mark.parametrize(
    ("extra", "message"),
    [
        ({"id": 3, "tag": "again"}, "#3"),
        ({"source": 1, "target": 99, "label": "on"}, "#99"),
        ({"id": 40, "embedding": [1.0]}, "'vector'"),
    ],
)
def test_a_stream_refuses_what_load_refuses(tmp_path: Path, extra: dict[str, Any], message: str) -> None:
    path = write_lines(tmp_path / "m.jsonl", [*RECORDS, extra])
    with pytest.raises(SceneError, match=message) as told:
        list(ingest.stream(path, batch=5).batches)
    assert "m.jsonl" in told.value.message
    with pytest.raises(SceneError, match=message):
        load(path)


def test_real_planner_maps(data: Path) -> None:
    room0 = load(data / "maps/conceptgraphs/room0_planner.json")
    assert len(room0.objects) == 70 and room0.up == "z"
    assert all(obj.center is not None and obj.extent is not None and obj.tag for obj in room0.objects)
    assert len(load(data / "maps/conceptgraphs/scannet0003_planner.json").objects) == 37


def test_real_captions(data: Path) -> None:
    counts = {p.stem: len(load(p).objects) for p in (data / "maps/replica_captions").glob("*.json")}
    assert counts == {
        "office0": 34,
        "office1": 23,
        "office2": 47,
        "office3": 60,
        "room0": 62,
        "room1": 43,
        "room2": 47,
    }
    assert sum(counts.values()) == 316
    assert len(load(data / "maps/lab/lab.json").objects) == 54
