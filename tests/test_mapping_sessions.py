"""Mapping a place further another day: from the state, from the store, and what is no longer there."""

from __future__ import annotations

import dataclasses
import threading
import time
from collections.abc import Iterator
from itertools import islice
from pathlib import Path

import numpy as np
import pytest

import cgdb
from cgdb.errors import FormatError, UsageError
from cgdb.ingest.mapping import checkpoint
from cgdb.ingest.mapping.ahead import detected, in_thread
from cgdb.ingest.mapping.mapper import Mapper, Mapping
from cgdb.ingest.mapping.sessions import carried, mapper_of
from cgdb.scene import Relation, SceneGraph, SceneObject, check_scene
from tests.mapping_rooms import ROOM, Box, room_frame

EVENING = tuple(box for box in ROOM if box.name != "vase")
"""The room without its vase; its boxes, and so the features, keep their numbers."""


def mapped(mapper: Mapper, count: int = 10, boxes: tuple[Box, ...] = ROOM) -> Mapper:
    for index in range(count):
        frame, found = room_frame(index, count, boxes)
        if len(boxes) < len(ROOM):
            features = np.eye(len(ROOM), dtype=np.float32)[[_number(name) for name in found.labels]] + 0.2
            found = dataclasses.replace(found, features=features)
        mapper.step(frame, found)
    return mapper


def _number(name: str) -> int:
    return [box.name for box in ROOM].index(name)


def morning() -> SceneGraph:
    mapper = Mapper()
    mapper.begin("morning")
    mapped(mapper).finish()
    return mapper.scene("room")


def test_a_scene_is_gone_on_with_and_keeps_its_ids() -> None:
    first = morning()
    mapper = mapper_of(first, Mapping())
    same = mapper.scene("room")
    assert {o.id: o.tag for o in same.objects} == {o.id: o.tag for o in first.objects}
    mapper.begin("evening")
    mapped(mapper).finish()
    after = mapper.scene("room")
    check_scene(after)
    assert {o.id: o.tag for o in after.objects} == {o.id: o.tag for o in first.objects}
    for one, two in zip(first.objects, after.objects, strict=True):
        assert two.n_observations == 2 * (one.n_observations or 0)
        np.testing.assert_allclose(one.features["clip"], two.features["clip"], atol=1e-5)
        if not one.properties["background"]:
            assert one.center is not None and two.center is not None
            np.testing.assert_allclose(one.center, two.center, atol=0.03)
    assert all(o.properties["last_session"] == "evening" and o.properties["present"] is True for o in after.objects)
    assert after.provenance["sessions"] == [
        {"recording": "morning", "first": 0},
        {"recording": "evening", "first": 10},
    ]
    assert after.provenance["frames"] == 20 and min(v.frame for o in after.objects for v in o.views) < 10


def test_what_is_no_longer_there_is_kept_and_marked() -> None:
    first = morning()
    mapper = mapper_of(first, Mapping())
    mapper.begin("evening")
    mapped(mapper, boxes=EVENING).finish()
    found = {o.tag: o for o in mapper.scene("room").objects}
    assert found["vase"].properties["present"] is False and found["vase"].properties["last_session"] == "morning"
    assert found["vase"].properties["last_frame"] == 9
    assert found["box"].properties["present"] is True
    # A third day goes on with what the second knew.
    third = mapper_of(mapper.scene("room"), Mapping())
    assert [session.recording for session in third.sessions] == ["morning", "evening"]


def test_what_nobody_looked_at_is_neither_there_nor_gone() -> None:
    mapper = mapper_of(morning(), Mapping())
    mapper.begin("evening")
    frame, found = room_frame(0)
    hidden = dataclasses.replace(frame, depth=np.minimum(frame.depth, np.float32(0.5)))
    for _ in range(5):
        mapper.step(hidden, found.take([]))
    for obj in mapper.scene("room").objects:
        assert "present" not in obj.properties and obj.properties["last_session"] == "morning"


def test_what_others_said_of_objects_is_carried_on() -> None:
    first = morning()
    ids = {obj.tag: obj.id for obj in first.objects}
    vase = next(obj for obj in first.objects if obj.tag == "vase")
    said = dataclasses.replace(
        vase, tag="urn", caption="a blue urn", properties={**vase.properties, "material": "clay", "present": False}
    )
    stated = Relation(source=ids["vase"], target=ids["box"], label="matches", origin="model")
    derived = dataclasses.replace(stated, label="near", origin="geometry")
    lost = dataclasses.replace(stated, target=999)
    others = [obj for obj in first.objects if obj is not vase]
    before = dataclasses.replace(first, objects=(*others, said), relations=(stated, derived, lost))
    after = carried(morning(), before)
    urn = next(obj for obj in after.objects if obj.id == vase.id)
    assert (urn.tag, urn.caption, urn.properties["material"]) == ("urn", "a blue urn", "clay")
    # Nobody has looked for it since.
    assert urn.properties["present"] is False and after.relations == (stated,)


def test_a_name_is_kept_from_whoever_gave_it_but_the_map_itself() -> None:
    now = SceneGraph(
        name="room", objects=tuple(SceneObject(id=i, tag="seat", tags=("seat", "chair")) for i in range(4))
    )
    stored = SceneGraph(
        name="room",
        objects=(
            SceneObject(id=0, tag="chair", tags=("chair", "seat")),
            SceneObject(id=1, tag="throne", tags=("chair", "seat")),
            SceneObject(id=2, tag="stool", tags=("stool",), properties={"tagged_by": "clip"}),
            SceneObject(id=3, tag=None),
        ),
    )
    own = dict.fromkeys(range(4), ("chair", ("chair", "seat")))
    named = [(obj.tag, obj.tags) for obj in carried(now, stored, own).objects]
    seat = ("seat", ("seat", "chair"))
    assert named == [seat, ("throne", ("chair", "seat")), ("stool", ("stool",)), seat]
    # Nothing is known of what the map itself said: a name that no model gave is taken for its own.
    named = [(obj.tag, obj.tags) for obj in carried(now, stored).objects]
    assert named == [seat, seat, ("stool", ("stool",)), seat]


def test_a_scene_that_was_not_mapped_is_refused() -> None:
    first = morning()
    with pytest.raises(UsageError, match="not made by cgdb map"):
        mapper_of(dataclasses.replace(first, provenance={}), Mapping())
    bare = tuple(dataclasses.replace(obj, points=None, colors=None) for obj in first.objects)
    with pytest.raises(UsageError, match="no cloud"):
        mapper_of(dataclasses.replace(first, objects=bare), Mapping())


def test_a_state_holds_sessions_opinions_and_presence(tmp_path: Path) -> None:
    mapper = mapper_of(morning(), Mapping())
    mapper.begin("evening")
    mapped(mapper, 5, EVENING)
    mapper.opinions.counts[(0, 1)] = (3, 2)
    path = tmp_path / "state.npz"
    checkpoint.save(mapper, path, {})
    again, _ = checkpoint.load(path, Mapping())
    assert again.sessions == mapper.sessions and again.opinions.counts == mapper.opinions.counts
    assert (again.newest, again.cared) == (mapper.newest, mapper.cared)
    assert again.presence is not None and mapper.presence is not None
    for name in ("points", "of", "ids", "through", "there"):
        np.testing.assert_array_equal(getattr(again.presence, name), getattr(mapper.presence, name))
    mapper.opinions.counts[(0, 999)] = (1, 0)
    checkpoint.save(mapper, path, {})
    with pytest.raises(FormatError, match="damaged"):
        checkpoint.load(path, Mapping())


def test_a_map_through_the_store_goes_on(tmp_path: Path) -> None:
    with cgdb.open(tmp_path / "s.cgdb", create=True, text_encoder=None) as db:
        db.add(morning())
        stored = db.scene("room", views=True)
        mapper = mapper_of(stored, Mapping())
        mapper.begin("evening")
        mapped(mapper, boxes=EVENING).finish()
        db.add(mapper.scene("room"), on_existing="replace")
        gone = db.query("MATCH (o) WHERE o.present = FALSE RETURN o.tag")
        assert [row[0] for row in gone] == ["vase"]
        assert all(v.image for o in db.scene("room", views=True).objects for v in o.views)


# -- reading ahead


def test_reading_ahead_changes_neither_order_nor_what_fails() -> None:
    frames = [room_frame(index)[0] for index in range(6)]

    class Odd:
        name, encoder = "odd", None

        def __call__(self, frame: object) -> object:
            index = frame.index  # type: ignore[attr-defined]
            if index == 3:
                raise FormatError("frame 3: is bad")
            return room_frame(index)[1]

    for ahead in (0, 1, 4):
        pairs = list(detected(frames, Odd(), ahead))  # type: ignore[arg-type]
        assert [frame.index for frame, _ in pairs] == list(range(6))
        assert [isinstance(found, FormatError) for _, found in pairs] == [i == 3 for i in range(6)]


def test_errors_of_a_thread_come_out_where_the_items_are_taken() -> None:
    def some() -> Iterator[int]:
        yield 1
        raise KeyError("lost")

    taken = in_thread(some(), 2)
    assert next(taken) == 1
    with pytest.raises(KeyError, match="lost"):
        next(taken)


def test_no_more_is_read_than_asked_for_and_closing_ends_the_thread() -> None:
    made = []

    def endless() -> Iterator[int]:
        number = 0
        while True:
            made.append(number)
            yield number
            number += 1

    before = threading.active_count()
    taken = in_thread(endless(), 3)
    assert list(islice(taken, 2)) == [0, 1]
    time.sleep(0.3)
    assert len(made) <= 2 + 3 + 1
    taken.close()
    assert threading.active_count() == before
