"""The planner's JSON: the paper's fields and nothing else, and a budget that drops what matters least."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import cgdb.ingest
from cgdb.errors import UsageError
from cgdb.export import document, dumps, export
from cgdb.export.planner_json import BYTES_PER_TOKEN, SHORT_CAPTION
from cgdb.ingest import scene_json
from cgdb.scene import Place, Relation, SceneGraph, SceneObject

FIELDS = ["id", "bbox_extent", "bbox_center", "object_tag", "caption"]


@pytest.fixture(scope="module")
def flat() -> SceneGraph:
    return scene_json.read(Path(__file__).parent.parent / "cli" / "flat.json")


def test_the_fields_are_the_papers_in_its_order() -> None:
    cup = SceneObject(
        id=3, tag="cup", tags=("mug",), caption="a blue cup", center=np.array([1.26, -0.04, 0.0]),
        extent=np.array([0.1, 0.12, 0.149]), confidence=0.5, n_observations=2, properties={"color": "blue"},
    )  # fmt: skip
    assert dumps(SceneGraph(name="s", objects=(cup,)), "planner") == (
        '[\n{"id": 3, "bbox_extent": [0.1, 0.1, 0.1], "bbox_center": [1.3, 0.0, 0.0],'
        ' "object_tag": "cup", "caption": "a blue cup"}\n]\n'
    )


def test_decimals(flat: SceneGraph) -> None:
    for decimals in (0, 2, 15):
        for record, obj in zip(planned(flat, decimals=decimals), flat.objects, strict=True):
            assert list(record) == FIELDS
            assert obj.center is not None and obj.extent is not None
            assert record["bbox_center"] == [round(x, decimals) for x in obj.center.tolist()]
            assert record["bbox_extent"] == [round(x, decimals) for x in obj.extent.tolist()]


def test_there_is_no_minus_zero() -> None:
    scene = SceneGraph(name="s", objects=(SceneObject(id=0, center=np.array([-0.01, -0.0, 0.0])),))
    assert "-0.0" not in dumps(scene, "planner")


def test_what_is_not_known_is_null() -> None:
    (record,) = planned(SceneGraph(name="s", objects=(SceneObject(id="x"),)))
    assert record == {"id": "x", "bbox_extent": None, "bbox_center": None, "object_tag": None, "caption": None}


def test_a_turned_box_is_written_as_the_upright_box_around_it() -> None:
    quarter = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
    s = np.sqrt(0.5)
    eighth = np.array([[s, -s, 0.0], [s, s, 0.0], [0.0, 0.0, 1.0]])
    box = SceneObject(id=0, center=np.zeros(3), extent=np.array([3.0, 1.0, 2.0]))
    scene = SceneGraph(name="s", objects=(replace(box, rotation=quarter), replace(box, id=1, rotation=eighth)))
    turned, halfway = planned(scene, decimals=6)
    assert turned["bbox_extent"] == [1.0, 3.0, 2.0]
    assert halfway["bbox_extent"] == pytest.approx([4 * s, 4 * s, 2.0], abs=1e-6)


def test_it_is_read_back_as_a_planner_map(tmp_path: Path, flat: SceneGraph) -> None:
    export(flat, tmp_path / "flat.planner.json", decimals=4)
    again = cgdb.ingest.load(tmp_path / "flat.planner.json", relate=False)
    assert [obj.id for obj in again.objects] == [obj.id for obj in flat.objects]
    for new, old in zip(again.objects, flat.objects, strict=True):
        assert (new.tag, new.caption) == (old.tag, old.caption)
        assert new.center is not None and old.center is not None
        assert new.extent is not None and old.extent is not None
        assert new.center.tolist() == old.center.tolist()
        assert new.extent.tolist() == old.extent.tolist()


def test_relations_are_between_objects_only() -> None:
    scene = SceneGraph(
        name="s",
        objects=(SceneObject(id=1), SceneObject(id=2)),
        places=(Place(id=9, kind="Room"),),
        relations=(
            Relation(source=1, target=2, label="on", explanation="it lies there"),
            Relation(source=9, target=1, label="contains"),
        ),
    )
    found = json.loads(dumps(scene, "planner", relations=True))
    assert list(found) == ["objects", "relations"]
    assert [record["id"] for record in found["objects"]] == [1, 2]
    assert found["relations"] == [{"source": 1, "label": "on", "target": 2}]


def test_relations_are_read_back_too(tmp_path: Path, flat: SceneGraph) -> None:
    export(flat, tmp_path / "flat.planner.json", relations=True)
    again = cgdb.ingest.load(tmp_path / "flat.planner.json", relate=False)
    ids = {obj.id for obj in flat.objects}
    assert [(r.source, r.label, r.target) for r in again.relations] == [
        (r.source, r.label, r.target) for r in flat.relations if r.source in ids
    ]


def test_without_a_need_nothing_is_dropped(flat: SceneGraph) -> None:
    assert dumps(flat, "planner", max_tokens=100_000) == dumps(flat, "planner")
    assert document(flat, "planner", max_tokens=100_000).notes == ()


@pytest.mark.parametrize("relations", [False, True])
@pytest.mark.parametrize("max_tokens", [100, 500, 1500, 2500, 3000, 3500, 4000, 5000])
def test_the_budget_is_kept_and_nearly_used(flat: SceneGraph, max_tokens: int, relations: bool) -> None:
    done = document(flat, "planner", max_tokens=max_tokens, relations=relations)
    text = "".join(done.pieces)
    assert len(text.encode()) <= max_tokens * BYTES_PER_TOKEN
    found = json.loads(text)
    listed = found["objects"] if relations else found
    ids = [record["id"] for record in listed]
    assert ids == sorted(ids), "the order is that of the map"
    if relations:
        assert all(r["source"] in ids and r["target"] in ids for r in found["relations"])
    if len(ids) < len(flat.objects):
        assert len(text.encode()) > max_tokens * BYTES_PER_TOKEN - 250
        assert f"{len(flat.objects) - len(ids)} of {len(flat.objects)} objects left out" in done.notes[0]


def test_long_captions_are_cut_before_anything_is_dropped() -> None:
    long = (
        "a very tall and very old grandfather clock, made of dark walnut wood with a brass pendulum and a painted face"
    )
    scene = SceneGraph(name="s", objects=(SceneObject(id=1, caption=long), SceneObject(id=2, caption="a cup")))
    size = len(dumps(scene, "planner").encode())
    done = document(scene, "planner", max_tokens=size // BYTES_PER_TOKEN - 2)
    first, second = json.loads("".join(done.pieces))
    assert first["caption"] == "a very tall and very old grandfather clock, made of dark..."
    assert len(first["caption"]) <= SHORT_CAPTION
    assert second["caption"] == "a cup"
    assert done.notes == (
        f"to keep to {size // BYTES_PER_TOKEN - 2} tokens: 0 of 2 objects left out, 1 captions shortened",
    )


def test_relations_that_follow_from_the_boxes_go_first() -> None:
    objects = tuple(SceneObject(id=i, caption="a cup") for i in range(4))
    relations = (
        Relation(source=0, target=1, label="on", confidence=0.4, origin="human"),
        Relation(source=1, target=2, label="near", confidence=0.9, origin="geometry"),
        Relation(source=2, target=3, label="near", confidence=0.5, origin="geometry"),
    )
    scene = SceneGraph(name="s", objects=objects, relations=relations)
    size = len(dumps(scene, "planner", relations=True).encode())
    line = len('{"source": 1, "label": "near", "target": 2},\n')
    labels = []
    for dropped in range(3):
        budget = -(-(size - line * dropped) // BYTES_PER_TOKEN)
        found = json.loads(dumps(scene, "planner", relations=True, max_tokens=budget))
        assert len(found["objects"]) == 4
        labels.append([(r["source"], r["label"]) for r in found["relations"]])
    assert labels == [[(0, "on"), (1, "near"), (2, "near")], [(0, "on"), (1, "near")], [(0, "on")]]


def test_objects_seen_least_go_first() -> None:
    objects = (
        SceneObject(id=0, caption="a cup", n_observations=9, confidence=0.9),
        SceneObject(id=1, caption="a cup", n_observations=2, confidence=0.9),
        SceneObject(id=2, caption="a cup", n_observations=2, confidence=0.3),
        SceneObject(id=3, caption="a cup"),
    )
    scene = SceneGraph(name="s", objects=objects)
    size = len(dumps(scene, "planner").encode())
    line = size / 4
    kept = [
        [record["id"] for record in planned(scene, max_tokens=int((size - line * n + 8) / BYTES_PER_TOKEN))]
        for n in range(4)
    ]
    assert kept == [[0, 1, 2, 3], [0, 1, 3], [0, 3], [3]]


@pytest.mark.parametrize("option", [{"decimals": -1}, {"decimals": 99}, {"max_tokens": 0}, {"max_tokens": -5}])
def test_options_that_make_no_sense(flat: SceneGraph, option: dict[str, int]) -> None:
    with pytest.raises(UsageError):
        dumps(flat, "planner", **option)


def test_a_budget_for_no_object_at_all_is_an_error(flat: SceneGraph) -> None:
    with pytest.raises(UsageError, match="not even one object"):
        dumps(flat, "planner", max_tokens=5)
    assert dumps(SceneGraph(name="s"), "planner", max_tokens=5) == "[]\n"


def planned(scene: SceneGraph, **options: Any) -> list[dict[str, Any]]:
    found: list[dict[str, Any]] = json.loads(dumps(scene, "planner", **options))
    return found
