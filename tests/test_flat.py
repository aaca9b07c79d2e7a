"""The map that is shipped for the demo: is it the flat that its generator makes, and could it stand in the world?"""

from __future__ import annotations

import importlib.util
from collections import Counter
from itertools import combinations
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from cgdb.export import dumps
from cgdb.ingest import scene_json
from cgdb.scene import ObjectId, Place, SceneGraph, SceneObject

ROOT = Path(__file__).parent.parent
TOUCH = 1e-3
"""Metres between faces that touch."""


@pytest.fixture(scope="module")
def flat() -> SceneGraph:
    return scene_json.read(ROOT / "cli" / "flat.json")


def test_the_shipped_file_is_what_the_generator_makes(flat: SceneGraph) -> None:
    spec = importlib.util.spec_from_file_location("make_flat", ROOT / "examples" / "make_flat.py")
    assert spec is not None and spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    shipped = (ROOT / "cli" / "flat.json").read_text(encoding="utf-8")
    assert shipped == dumps(module.build(), "cgdb")


def test_its_size(flat: SceneGraph) -> None:
    assert 75 <= len(flat.objects) <= 90
    assert {place.name for place in flat.places} == {"living room", "kitchen", "bedroom", "bathroom", "hall"}
    assert {relation.origin for relation in flat.relations} == {"human", "llm", "geometry"}
    assert not flat.spaces
    for obj in flat.objects:
        assert obj.tag and obj.tags and obj.caption and obj.properties, f"#{obj.id} is not described"
    assert len({obj.caption for obj in flat.objects}) == len(flat.objects)


def test_every_object_is_in_exactly_one_room(flat: SceneGraph) -> None:
    for obj in flat.objects:
        rooms = [room for room in flat.places if _within(obj, room)]
        assert len(rooms) == 1, f"#{obj.id} {obj.tag} is in {[room.name for room in rooms]}"
    contained = Counter(relation.target for relation in flat.relations if relation.label == "contains")
    assert contained == Counter({obj.id: 1 for obj in flat.objects})
    by_id: dict[ObjectId, SceneObject | Place] = {obj.id: obj for obj in flat.objects}
    by_id |= {room.id: room for room in flat.places}
    for relation in flat.relations:
        if relation.label == "contains":
            assert _within(by_id[relation.target], by_id[relation.source])


def test_nothing_hangs_in_the_air(flat: SceneGraph) -> None:
    held = {relation.source for relation in flat.relations if relation.label in ("on", "in")}
    for obj in flat.objects:
        low, high = _box(obj)
        match obj.properties.get("mounting"):
            case "ceiling":
                assert high[2] == pytest.approx(2.6, abs=TOUCH), f"#{obj.id} {obj.tag}"
            case "wall":
                room = next(room for room in flat.places if _within(obj, room))
                walls = np.abs(np.concatenate([low[:2] - _box(room)[0][:2], high[:2] - _box(room)[1][:2]]))
                assert walls.min() < 0.05, f"#{obj.id} {obj.tag} hangs on no wall"
            case _:
                assert obj.id in held or low[2] == pytest.approx(0.0, abs=TOUCH), f"#{obj.id} {obj.tag}"


def test_what_is_on_something_touches_it(flat: SceneGraph) -> None:
    by_id = {obj.id: obj for obj in flat.objects}
    pairs = [relation for relation in flat.relations if relation.label == "on"]
    assert len(pairs) > 20
    for relation in pairs:
        upper, lower = by_id[relation.source], by_id[relation.target]
        (low, high), (base_low, base_high) = _box(upper), _box(lower)
        assert low[2] == pytest.approx(base_high[2], abs=TOUCH), f"{upper.tag} on {lower.tag}"
        assert (low[:2] >= base_low[:2] - TOUCH).all(), f"{upper.tag} on {lower.tag}"
        assert (high[:2] <= base_high[:2] + TOUCH).all(), f"{upper.tag} on {lower.tag}"


def test_what_is_in_something_is_inside_it(flat: SceneGraph) -> None:
    by_id = {obj.id: obj for obj in flat.objects}
    pairs = [relation for relation in flat.relations if relation.label == "in"]
    assert len(pairs) > 15
    for relation in pairs:
        inner, outer = by_id[relation.source], by_id[relation.target]
        assert _within(inner, outer), f"{inner.tag} in {outer.tag}"


def test_what_is_under_something_is_below_it(flat: SceneGraph) -> None:
    by_id = {obj.id: obj for obj in flat.objects}
    for relation in flat.relations:
        if relation.label == "under":
            lower, upper = by_id[relation.source], by_id[relation.target]
            (low, high), (above_low, above_high) = _box(lower), _box(upper)
            assert high[2] <= above_low[2] + TOUCH, f"{lower.tag} under {upper.tag}"
            assert (np.minimum(high, above_high)[:2] > np.maximum(low, above_low)[:2]).all()


def test_what_is_next_to_something_is_near_it(flat: SceneGraph) -> None:
    by_id = {obj.id: obj for obj in flat.objects}
    for relation in flat.relations:
        if relation.label == "next_to":
            (low, high), (other_low, other_high) = _box(by_id[relation.source]), _box(by_id[relation.target])
            gap = np.maximum(0.0, np.maximum(other_low - high, low - other_high))
            assert np.linalg.norm(gap) < 0.6, f"{by_id[relation.source].tag} next to {by_id[relation.target].tag}"


def test_boxes_do_not_overlap_but_of_a_thing_and_what_it_is_in(flat: SceneGraph) -> None:
    parent = {relation.source: relation.target for relation in flat.relations if relation.label == "in"}
    for one, other in combinations(flat.objects, 2):
        if _is_inside(one, other, parent) or _is_inside(other, one, parent):
            continue
        (low, high), (other_low, other_high) = _box(one), _box(other)
        shared = np.minimum(high, other_high) - np.maximum(low, other_low)
        assert not (shared > TOUCH).all(), f"#{one.id} {one.tag} and #{other.id} {other.tag} overlap by {shared}"


def _box(node: SceneObject | Place) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    assert node.center is not None and node.extent is not None
    return node.center - node.extent / 2, node.center + node.extent / 2


def _within(inner: SceneObject | Place, outer: SceneObject | Place) -> bool:
    (low, high), (outer_low, outer_high) = _box(inner), _box(outer)
    return bool((low >= outer_low - TOUCH).all() and (high <= outer_high + TOUCH).all())


def _is_inside(inner: SceneObject, outer: SceneObject, parent: dict[ObjectId, ObjectId]) -> bool:
    at: ObjectId | None = inner.id
    while (at := parent.get(at) if at is not None else None) is not None:
        if at == outer.id:
            return True
    return False
