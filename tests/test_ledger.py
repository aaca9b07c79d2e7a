"""The ledger: what is written is what is read, at every revision."""

from __future__ import annotations

import dataclasses
import subprocess
import sys
from datetime import UTC, datetime, timedelta
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from cgdb.errors import CgdbError, SceneError, StoreBusyError, StoreError, VersionError
from cgdb.scene import FeatureSpace, Place, Relation, SceneGraph, SceneObject
from cgdb.storage.ledger import Ledger, SceneInfo
from cgdb.storage.writer import OnExisting

CLIP = FeatureSpace(name="clip", dimension=4, encoder="open_clip:tiny")


def thing(number: int | str, tag: str = "thing", **more: object) -> SceneObject:
    return SceneObject(id=number, tag=tag, **more)  # type: ignore[arg-type]


def full_object(number: int | str = 7) -> SceneObject:
    return SceneObject(
        id=number,
        tag="café ☕",
        tags=("cup", "a\x00b", ""),
        caption="a cup\nof coffee",
        center=np.array([1.0, -2.5, 1e-9]),
        extent=np.array([0.1, 0.0, 3.0]),
        rotation=np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]]),
        features={"clip": np.array([1, 2, 3, 4], np.float32)},
        points=np.arange(12, dtype=np.float32).reshape(4, 3),
        colors=np.arange(12, dtype=np.uint8).reshape(4, 3),
        n_observations=12,
        confidence=0.25,
        properties={"states": ("open", "on"), "sizes": (1.0, 2.5), "n": 2**80, "ok": True, "none": None, "empty": ()},
    )


@pytest.fixture
def ledger(tmp_path: Path) -> Ledger:
    with Ledger.open(tmp_path / "lab.cgdb", create=True) as opened:
        yield opened  # type: ignore[misc]


def add(
    ledger: Ledger,
    objects: list[SceneObject],
    relations: list[Relation] | None = None,
    *,
    scene: str = "lab",
    how: str = "error",
    spaces: tuple[FeatureSpace, ...] = (CLIP,),
) -> int | None:
    with ledger.write(scene, on_existing=how, spaces=spaces) as writer:  # type: ignore[arg-type]
        writer.objects(objects)
        writer.relations(relations or [])
    return writer.revision


def ids(ledger: Ledger, info: SceneInfo) -> list[object]:
    return [node.id for batch in ledger.nodes(info) for node in batch]


def same(a: np.ndarray | None, b: np.ndarray | None) -> bool:
    if a is None or b is None:
        return a is b
    return a.dtype == b.dtype and a.shape == b.shape and bool((a == b).all())


def same_object(a: SceneObject, b: SceneObject) -> bool:
    plain = ("id", "tag", "tags", "caption", "n_observations", "confidence")
    return (
        all(getattr(a, name) == getattr(b, name) for name in plain)
        and all(same(getattr(a, n), getattr(b, n)) for n in ("center", "extent", "rotation", "points", "colors"))
        and dict(a.properties) == dict(b.properties)
        and {n: type(v) for n, v in a.properties.items()} == {n: type(v) for n, v in b.properties.items()}
        and a.features.keys() == b.features.keys()
        and all(same(a.features[name], b.features[name]) for name in a.features)
    )


def test_a_scene_comes_back_as_it_went_in(ledger: Ledger) -> None:
    objects = [
        full_object(7),
        thing("chair-1", None),  # type: ignore[arg-type]
        SceneObject(id=2**63 - 1, center=np.array([0.0, 0.0, 0.0])),
        SceneObject(id=3, center=np.zeros(3), rotation=np.eye(3), points=np.zeros((0, 3), np.float32)),
    ]
    places = [
        Place(id="kitchen", kind="Room", name="Küche", center=np.ones(3), extent=np.ones(3), properties={"floor": 1}),
        Place(id=0),
    ]
    relations = [
        Relation(source=7, target="chair-1", label="on", confidence=0.5, explanation="it lies there", origin="llm"),
        Relation(source=7, target="chair-1", label="on", origin="geometry"),
        Relation(source="kitchen", target=7, label="contains"),
        Relation(source=3, target=3, label="is"),
    ]
    with ledger.write(
        "lab", frame="camera", up="-y", spaces=[CLIP], provenance={"files": ["a", 1], "who": {"x": None}}, message="m"
    ) as writer:
        writer.relations(relations)  # before their ends
        writer.places(places)
        writer.objects(iter(objects))
    assert writer.revision == 1
    info = ledger.scene("lab")
    assert (info.n_objects, info.n_places, info.n_relations, info.revision) == (4, 2, 4, 1)
    graph = ledger.scene_graph(info)
    assert (graph.frame, graph.up, graph.spaces) == ("camera", "-y", (CLIP,))
    assert graph.provenance == {"files": ["a", 1], "who": {"x": None}}
    by_id = {obj.id: obj for obj in graph.objects}
    assert len(by_id) == 4
    for obj in objects:
        assert same_object(by_id[obj.id], obj), obj.id
    kitchen = next(place for place in graph.places if place.id == "kitchen")
    assert (kitchen.kind, kitchen.name, kitchen.properties) == ("Room", "Küche", {"floor": 1})
    assert {(r.source, r.target, r.label, r.confidence, r.explanation, r.origin) for r in graph.relations} == {
        (r.source, r.target, r.label, r.confidence, r.explanation, r.origin) for r in relations
    }
    assert ledger.check() == []


def test_the_plain_number_as_text_is_the_number(ledger: Ledger) -> None:
    add(ledger, [thing("5"), thing("05"), thing(-3)])  # type: ignore[list-item]
    info = ledger.scene("lab")
    assert set(ids(ledger, info)) == {5, "05", "-3"}
    found = ledger.node_by_id(info, "5")
    assert found is not None and found.id == 5
    assert ledger.node_by_id(info, 99) is None


def test_reading_some_rows(ledger: Ledger) -> None:
    objects = [full_object(i) for i in range(3)] + [thing(i) for i in range(3, 30)]
    relations = [Relation(source=i, target=(i + 1) % 30, label="near") for i in range(30)]
    add(ledger, objects, relations)
    info = ledger.scene("lab")
    batches = list(ledger.nodes(info, batch=7))
    keys = {node.id: node.key for batch in batches for node in batch}
    assert [len(batch) for batch in batches] == [7, 7, 7, 7, 2]
    assert sorted(keys.values()) == [node.key for batch in batches for node in batch]
    assert set(ledger.nodes_by_key(info, [keys[4], keys[9], 10_000])) == {keys[4], keys[9]}
    touching = ledger.relations_of(info, [keys[0], keys[1]])
    assert {(r.source, r.target) for r in touching} == {
        (keys[29], keys[0]),
        (keys[0], keys[1]),
        (keys[1], keys[2]),
    }
    every = [row for batch in ledger.relations(info, batch=4) for row in batch]
    assert len(every) == 30 and every == [row for batch in ledger.relations(info) for row in batch]
    pages = list(ledger.features(info, "clip", batch=2))
    assert [page[1].shape for page in pages] == [(2, 4), (1, 4)]
    assert pages[0][0].dtype == np.int64 and pages[0][1].dtype == np.float32
    some, vectors = ledger.features_by_key(info, "clip", [keys[2], keys[3]])
    assert some.tolist() == [keys[2]] and vectors.tolist() == [[1, 2, 3, 4]]
    cloud = ledger.cloud(info, keys[0])
    assert cloud is not None and cloud[0].shape == (4, 3) and cloud[1] is not None and cloud[1].dtype == np.uint8
    assert ledger.cloud(info, keys[5]) is None


def test_every_batch_size_gives_the_same(ledger: Ledger) -> None:
    add(ledger, [thing(i) for i in range(8)], [Relation(source=0, target=i, label="near") for i in range(8)])
    info = ledger.scene("lab")
    for batch in (1, 2, 4, 7, 8, 9):
        assert ids(ledger, info) == [node.id for page in ledger.nodes(info, batch=batch) for node in page]
        assert sum(len(page) for page in ledger.relations(info, batch=batch)) == 8


def test_history(ledger: Ledger) -> None:
    add(ledger, [thing(1, "cup"), thing(2, "table")], [Relation(source=1, target=2, label="on")])
    add(ledger, [thing(1, "mug"), thing(3, "lamp")], how="merge")
    with ledger.write("lab", on_existing="merge") as writer:
        writer.remove([2])
    assert writer.revision == 3
    at = [ledger.scene("lab", revision) for revision in (1, 2, 3)]
    tags = [{n.id: n.tag for batch in ledger.nodes(info) for n in batch} for info in at]
    assert tags == [{1: "cup", 2: "table"}, {1: "mug", 2: "table", 3: "lamp"}, {1: "mug", 3: "lamp"}]
    assert [info.n_relations for info in at] == [1, 1, 0]
    key = {n.id: n.key for n in next(ledger.nodes(at[1]))}
    changes = ledger.changes(at[0].id, 1, 2)
    assert (changes.added, changes.changed, changes.removed) == ((key[3],), (key[1],), ())
    changes = ledger.changes(at[0].id, 2, 3)
    assert changes.removed == (key[2],) and [r.label for r in changes.relations_removed] == ["on"]
    assert ledger.changes(at[0].id, 3, 1).added == (key[2],)
    assert ledger.changes(at[0].id, 0, 1).added == (key[1], key[2])
    revisions = ledger.revisions()
    assert [(r.id, r.added, r.changed, r.removed, r.relations_added, r.relations_removed) for r in revisions] == [
        (1, 2, 0, 0, 1, 0),
        (2, 1, 1, 0, 0, 0),
        (3, 0, 0, 1, 0, 1),
    ]
    assert all(r.time.tzinfo is UTC for r in revisions)
    add(ledger, [thing(2, "desk")], how="merge")
    back = ledger.node_by_id(ledger.scene("lab"), 2)
    assert back is not None and back.key == key[2], "an id keeps its key, even after it was gone"
    assert ledger.check() == []


def test_as_of(ledger: Ledger) -> None:
    with pytest.raises(StoreError, match="no revision 1"):
        ledger.resolve(1)
    assert ledger.resolve(None) == 0 and ledger.revision() == 0 and ledger.scenes() == ()
    add(ledger, [thing(1)], scene="lab")
    add(ledger, [thing(1)], scene="kitchen")
    first, second = ledger.revisions()
    assert ledger.resolve("1") == 1
    assert ledger.resolve(first.time) == 1
    assert ledger.resolve(second.time.isoformat()) == 2
    assert ledger.resolve(second.time - timedelta(microseconds=1)) == 1
    assert ledger.resolve(second.time.replace(tzinfo=None)) == 2, "a time without a zone is UTC"
    assert [info.name for info in ledger.scenes(1)] == ["lab"]
    info = ledger.scene("lab", 2)
    assert (info.revision, info.as_of) == (1, 2)
    assert ledger.scene("lab").as_of is None
    for bad, why in (
        (3, "1 to 2"),
        (0, "1 to 2"),
        ("next week", "neither a revision nor a time"),
        ("1999-01-01", "no revision yet"),
        (datetime.now(UTC) + timedelta(days=1), "future"),
    ):
        with pytest.raises(StoreError) as caught:
            ledger.resolve(bad)
        assert why in caught.value.render()
    with pytest.raises(StoreError, match="no scene 'kitchen' at revision 1"):
        ledger.scene("kitchen", 1)
    with pytest.raises(StoreError) as caught:
        ledger.scene("lap")
    assert caught.value.hint == "did you mean 'lab'?"


def test_times_grow_even_when_the_clock_is_set_back(ledger: Ledger, monkeypatch: pytest.MonkeyPatch) -> None:
    add(ledger, [thing(1)])
    monkeypatch.setattr("cgdb.storage.history.time.time_ns", lambda: 10**18)
    add(ledger, [thing(2)], how="merge")
    first, second = ledger.revisions()
    assert second.time > first.time


def test_what_changes_nothing_makes_no_revision(ledger: Ledger) -> None:
    objects = [full_object(1), full_object(2)]
    relations = [Relation(source=1, target=2, label="on")]
    assert add(ledger, objects, relations) == 1
    assert add(ledger, objects, relations, how="replace") is None
    assert add(ledger, objects[:1], how="merge") is None
    assert add(ledger, [], scene="empty") == 2, "a first import counts, even of nothing"
    assert ledger.revision() == 2
    assert add(ledger, [], how="replace") == 3, "an empty map replaces a full one"
    assert ledger.scene("lab").n_objects == 0


@pytest.mark.parametrize("part", ["feature", "cloud", "colors", "property", "no feature", "no cloud"])
def test_a_change_of_any_part_is_a_change(ledger: Ledger, part: str) -> None:
    add(ledger, [full_object(1), full_object(2)])
    before = full_object(1)
    values = {name: getattr(before, name) for name in before.__slots__}
    values.update(
        {
            "feature": {"features": {"clip": np.array([1, 2, 3, 5], np.float32)}},
            "cloud": {"points": np.ones((4, 3), np.float32)},
            "colors": {"colors": np.ones((4, 3), np.uint8)},
            "property": {"properties": {"states": ("open",)}},
            "no feature": {"features": {}},
            "no cloud": {"points": None, "colors": None},
        }[part]
    )
    after = SceneObject(**values)
    assert add(ledger, [after], how="merge") == 2
    info = ledger.scene("lab")
    assert ledger.revisions()[-1].changed == 1
    node = ledger.node_by_id(info, 1)
    assert node is not None and ledger.changes(info.id, 1, 2).changed == (node.key,)
    assert same_object(ledger.scene_graph(info).objects[0], after)
    assert same_object(ledger.scene_graph(ledger.scene("lab", 1)).objects[0], before)
    assert ledger.check() == []


def test_unchanged_rows_are_not_written_again(ledger: Ledger) -> None:
    add(ledger, [full_object(i) for i in range(500)])
    before = sum(file.stat().st_size for file in ledger.path.iterdir())
    objects = [full_object(i) for i in range(499)] + [thing(499)]
    assert add(ledger, objects, how="replace") == 2
    assert ledger.revisions()[-1].changed == 1
    assert sum(file.stat().st_size for file in ledger.path.iterdir()) < before * 2


def test_replace(ledger: Ledger) -> None:
    relations = [Relation(source=1, target=2, label="on"), Relation(source=2, target=1, label="under")]
    add(ledger, [thing(1), full_object(2), thing(3)], relations)
    changed = [Relation(source=1, target=2, label="on", confidence=0.5)]
    assert add(ledger, [thing(1), full_object(2)], changed, how="replace") == 2
    info = ledger.scene("lab")
    assert (info.n_objects, info.n_relations) == (2, 1)
    revision = ledger.revisions()[-1]
    assert (revision.removed, revision.relations_added, revision.relations_removed) == (1, 1, 2)
    assert ledger.check() == []
    with pytest.raises(SceneError, match="no object or place #2"):
        add(ledger, [thing(1)], changed, how="replace")
    with pytest.raises(StoreError, match="there is a scene 'lab' already"):
        add(ledger, [thing(1)])


def test_merge_of_relations(ledger: Ledger) -> None:
    add(ledger, [thing(1), thing(2)], [Relation(source=1, target=2, label="on")])
    for confidence in (0.5, 0.5, 0.7):
        add(ledger, [], [Relation(source=1, target=2, label="on", confidence=confidence)], how="merge")
    assert ledger.revision() == 3
    (row,) = next(ledger.relations(ledger.scene("lab")))
    assert row.confidence == 0.7
    assert next(ledger.relations(ledger.scene("lab", 1)))[0].confidence == 1.0
    add(ledger, [thing(9)], [Relation(source=9, target=1, label="near")], how="merge")
    assert ledger.scene("lab").n_relations == 2
    assert ledger.check() == []


def test_a_relation_said_again_counts_once_and_the_last_one_holds(ledger: Ledger) -> None:
    with ledger.write("lab") as writer:
        writer.objects([thing(1), thing(2)])
        for confidence in (0.1, 0.2, 0.3):
            writer.relations([Relation(source=1, target=2, label="on", confidence=confidence)])
    info = ledger.scene("lab")
    assert [r.confidence for r in next(ledger.relations(info))] == [0.3] and info.n_relations == 1
    with ledger.write("lab", on_existing="replace") as writer:
        writer.objects([thing(1), thing(2)])
        for confidence in (0.3, 0.3, 0.9, 0.3):
            writer.relations([Relation(source=1, target=2, label="on", confidence=confidence)])
    info = ledger.scene("lab")
    assert [r.confidence for r in next(ledger.relations(info))] == [0.3] and info.n_relations == 1
    assert ledger.check() == []


def test_frame_axis_and_spaces_of_a_merge(ledger: Ledger) -> None:
    with ledger.write("lab", frame="a", up="y", spaces=[FeatureSpace(name="clip", dimension=4)]) as writer:
        writer.objects([thing(1)])
    with ledger.write("lab", on_existing="merge", spaces=[CLIP, FeatureSpace(name="dino", dimension=2)]) as writer:
        writer.objects([thing(2)])
    info = ledger.scene("lab")
    assert (info.frame, info.up, [s.name for s in info.spaces]) == ("a", "y", ["clip", "dino"])
    assert info.spaces[0].encoder == CLIP.encoder
    for wrong in ({"frame": "b"}, {"up": "z"}, {"spaces": [FeatureSpace(name="clip", dimension=5)]}):
        with pytest.raises(SceneError), ledger.write("lab", on_existing="merge", **wrong):  # type: ignore[arg-type]
            pass
    with pytest.raises(StoreError, match=r"no feature space 'clap'"):
        ledger.features(info, "clap")


def test_a_scene_is_removed_and_comes_back(ledger: Ledger) -> None:
    add(ledger, [full_object(1), full_object(2)], [Relation(source=1, target=2, label="on")])
    assert ledger.remove_scene("lab") == 2
    assert ledger.scenes() == () and len(ledger.scenes(1)) == 1
    assert len(ledger.scene_graph(ledger.scene("lab", 1)).objects) == 2
    with pytest.raises(StoreError, match="no scene 'lab'"):
        ledger.remove_scene("lab")
    assert add(ledger, [full_object(2)]) == 3
    assert ledger.scene("lab").id == ledger.scene("lab", 1).id
    assert ids(ledger, ledger.scene("lab")) == [2]
    assert ledger.check() == []


@pytest.mark.parametrize(
    ("objects", "relations", "message"),
    [
        ([thing(1), thing("1")], [], "two nodes have the id #1"),
        ([thing(1)], [Relation(source=1, target=2, label="on")], "relation #1 'on' #2: there is no object or place #2"),
        ([thing(1, center=np.array([np.nan, 0, 0]))], [], "object #1: center"),
        ([thing(1, features={"clip": np.zeros(3, np.float32)})], [], "object #1: feature 'clip' has shape"),
        ([thing(1, features={"dino": np.zeros(3, np.float32)})], [], "does not declare"),
        ([thing(1), thing(2, "\ud800")], [], "holds what is not valid text"),
        ([thing(1, n_observations=2**70)], [], "object #1: n_observations is larger"),
        ([thing(1, 5)], [], "object #1: tag must be text"),  # type: ignore[arg-type]
        ([thing(1)], [Relation(source=1, target=1, label="\ud800")], "holds what is not valid text"),
        ([thing(1)], [Relation(source=1, target=1, label="on", confidence=2.0)], "not between 0 and 1"),
        ([thing("")], [], "an id must be"),
    ],
)
def test_a_bad_scene_is_one_clear_error_and_nothing_is_written(
    ledger: Ledger, objects: list[SceneObject], relations: list[Relation], message: str
) -> None:
    add(ledger, [thing(1)], scene="before")
    for how in ("error", "merge", "replace"):
        with pytest.raises(SceneError, match=message):
            add(ledger, objects, relations, how=how)
    assert ledger.revision() == 1 and [info.name for info in ledger.scenes()] == ["before"]
    assert ledger.check() == []


def test_a_block_that_raises_leaves_nothing(ledger: Ledger) -> None:
    for error in (KeyboardInterrupt, ValueError, SystemExit):
        with pytest.raises(error), ledger.write("lab") as writer:
            writer.objects([thing(i) for i in range(3000)])
            raise error
    assert ledger.revision() == 0 and writer.revision is None
    assert add(ledger, [thing(1)]) == 1


def test_removal_in_a_block(ledger: Ledger) -> None:
    add(ledger, [thing(1), thing(2), thing(3)], [Relation(source=1, target=2, label="on")])
    with (
        pytest.raises(SceneError, match="no object or place #9 to remove"),
        ledger.write("lab", on_existing="merge") as writer,
    ):
        writer.remove([9])
    with (
        pytest.raises(SceneError, match="#2 is both written and removed"),
        ledger.write("lab", on_existing="merge") as writer,
    ):
        writer.remove([2])
        writer.objects([thing(2)])
    with pytest.raises(SceneError, match="no object or place #2"), ledger.write("lab", on_existing="merge") as writer:
        writer.remove([2])
        writer.relations([Relation(source=2, target=3, label="near")])
    assert ledger.revision() == 1


@pytest.mark.parametrize("how", ["merge", "replace"])
def test_relations_are_removed_by_name(ledger: Ledger, how: OnExisting) -> None:
    on, near = Relation(source=1, target=2, label="on"), Relation(source=1, target=2, label="near")
    add(ledger, [thing(1), thing(2)], [on, near, dataclasses.replace(on, origin="llm")])
    with ledger.write("lab", on_existing=how) as writer:
        writer.objects([thing(1), thing(2)])
        writer.relations([near])
        writer.unrelate([dataclasses.replace(on, confidence=0.1), dataclasses.replace(on, origin="llm")])
    assert (writer.revision, writer.counts[-1]) == (2, 2)
    scene = ledger.scene_graph(ledger.scene("lab"))
    assert scene.relations == (near,)
    assert len(ledger.scene_graph(ledger.scene("lab", 1)).relations) == 3
    assert ledger.check() == []
    for relation in (on, dataclasses.replace(near, target=9)):
        with (
            pytest.raises(SceneError, match="is not there to be removed"),
            ledger.write("lab", on_existing="merge") as writer,
        ):
            writer.unrelate([relation])
    with (
        pytest.raises(SceneError, match="both written and removed"),
        ledger.write("lab", on_existing="merge") as writer,
    ):
        writer.relations([on])
        writer.unrelate([on])
    assert ledger.revision() == 2


@pytest.mark.parametrize("name", ["", "x" * 257, "a\x00b", "\ud800"])
def test_a_bad_scene_name(ledger: Ledger, name: str) -> None:
    with pytest.raises(SceneError):
        add(ledger, [], scene=name)


def test_opening_what_is_no_store(tmp_path: Path) -> None:
    def refused(path: Path, message: str, *, create: bool = False) -> None:
        with pytest.raises(CgdbError, match=message):
            Ledger.open(path, create=create)

    refused(tmp_path / "none.cgdb", "does not exist")
    (tmp_path / "file.cgdb").write_text("x")
    refused(tmp_path / "file.cgdb", "is a file, not a store", create=True)
    (tmp_path / "full.cgdb").mkdir()
    (tmp_path / "full.cgdb" / "thesis.tex").write_text("x")
    refused(tmp_path / "full.cgdb", "there is no ledger in it")
    refused(tmp_path / "full.cgdb", "not empty and not a store", create=True)
    refused(tmp_path / "file.cgdb" / "below.cgdb", "cannot be made", create=True)
    for content, message in ((b"", "is empty"), (b"x" * 5000, "damaged")):
        folder = tmp_path / f"odd{len(content)}.cgdb"
        folder.mkdir()
        (folder / "ledger.sqlite").write_bytes(content)
        refused(folder, message)
        refused(folder, message, create=True)


def test_a_newer_version_is_refused(tmp_path: Path) -> None:
    import sqlite3

    Ledger.open(tmp_path / "s.cgdb", create=True).close()
    database = sqlite3.connect(tmp_path / "s.cgdb" / "ledger.sqlite")
    assert database.execute("pragma application_id").fetchone()[0] == 0x43474442
    database.execute("update meta set value = '7' where name = 'format'")
    database.execute("pragma user_version = 7")
    database.commit()
    database.close()
    with pytest.raises(VersionError, match="format 7"):
        Ledger.open(tmp_path / "s.cgdb")


def test_a_closed_store_says_so(tmp_path: Path) -> None:
    ledger = Ledger.open(tmp_path / "s.cgdb", create=True)
    ledger.close()
    ledger.close()
    with pytest.raises(StoreError, match="closed"):
        ledger.revision()


def test_two_writers(ledger: Ledger) -> None:
    with Ledger.open(ledger.path, patience=0.2) as other, ledger.write("lab") as writer:
        writer.objects([thing(1)])
        with pytest.raises(StoreBusyError, match="another process is writing"), other.write("kitchen"):
            pass
        assert other.revision() == 0, "a reader sees what was committed last"
    assert ledger.revision() == 1


def test_a_reader_keeps_its_revision_while_a_writer_goes_on(ledger: Ledger) -> None:
    add(ledger, [thing(i, "old") for i in range(100)])
    info = ledger.scene("lab")
    pages = ledger.nodes(info, batch=10)
    seen = next(pages)
    add(ledger, [thing(i, "new") for i in range(50, 150)], how="replace")
    seen = seen + [node for page in pages for node in page]
    assert len(seen) == 100 and {node.tag for node in seen} == {"old"}


def test_importing_the_ledger_loads_nothing_heavy() -> None:
    code = (
        "import sys, cgdb.storage.ledger\n"
        "heavy = {'torch', 'faiss', 'kuzu', 'ladybug', 'networkx', 'pandas', 'pyarrow', 'rich', 'lark'}\n"
        "print(sorted(heavy & set(sys.modules)))"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=60, check=True)
    assert done.stdout.strip() == "[]"


# --- against a model ------------------------------------------------------------------------------------------------

_step = st.tuples(
    st.sampled_from(["merge", "replace", "remove scene"]),
    st.dictionaries(st.integers(0, 5), st.tuples(st.sampled_from("ab"), st.integers(0, 2)), max_size=4),
    st.dictionaries(st.tuples(st.integers(0, 5), st.integers(0, 5)), st.sampled_from([0.25, 0.5]), max_size=4),
    st.sets(st.integers(0, 5), max_size=2),
)


@settings(max_examples=15, deadline=None, suppress_health_check=[HealthCheck.too_slow])
@given(steps=st.lists(_step, min_size=1, max_size=6))
def test_any_history_reads_as_the_model_says(
    steps: list[tuple[str, dict[int, tuple[str, int]], dict[tuple[int, int], float], set[int]]],
    tmp_path_factory: pytest.TempPathFactory,
) -> None:
    """Each step on a dict as on the ledger; then every revision is read, and every pair of them compared."""
    nodes: dict[int, tuple[str, int]] | None = None
    edges: dict[tuple[int, int], float] = {}
    states: dict[int, tuple[dict[int, tuple[str, int]], dict[tuple[int, int], float]] | None] = {}
    path = tmp_path_factory.mktemp("model") / "m.cgdb"
    with Ledger.open(path, create=True) as ledger:
        for how, wanted, relations, removed in steps:
            if how == "remove scene":
                if nodes is not None:
                    states[ledger.remove_scene("m")] = None
                    nodes = None
                continue
            after = {} if nodes is None or how == "replace" else dict(nodes)
            links = {} if nodes is None or how == "replace" else dict(edges)
            gone = (removed & after.keys()) - wanted.keys()
            after = {number: value for number, value in after.items() if number not in gone} | wanted
            links = {ends: value for ends, value in links.items() if not gone & set(ends)}
            links |= {ends: value for ends, value in relations.items() if set(ends) <= after.keys()}
            new_links = {ends: value for ends, value in relations.items() if set(ends) <= after.keys()}
            with ledger.write("m", on_existing="replace" if how == "replace" else "merge", spaces=[CLIP]) as writer:
                writer.relations(
                    Relation(source=a, target=b, label="on", confidence=c) for (a, b), c in new_links.items()
                )
                writer.remove(gone)
                writer.objects(
                    thing(number, tag, features={"clip": np.full(4, weight, np.float32)} if weight else {})
                    for number, (tag, weight) in wanted.items()
                )
            assert (writer.revision is None) == (nodes is not None and (after, links) == (nodes, edges))
            nodes, edges = after, links
            if writer.revision is not None:
                states[writer.revision] = (after, links)
        keys: dict[int, int] = {}
        for revision, state in states.items():
            if state is None:
                assert ledger.scenes(revision) == ()
                continue
            graph = ledger.scene_graph(ledger.scene("m", revision))
            read = {o.id: (o.tag, int(o.features["clip"][0]) if o.features else 0) for o in graph.objects}
            assert read == state[0]
            assert {(r.source, r.target): r.confidence for r in graph.relations} == state[1]
            for batch in ledger.nodes(ledger.scene("m", revision)):
                for node in batch:
                    assert isinstance(node.id, int) and keys.setdefault(node.id, node.key) == node.key
        for a in states:
            for b in states:
                before, now = (states[r][0] if states[r] else {} for r in (a, b))  # type: ignore[index]
                changes = ledger.changes(1, a, b)
                assert changes.added == tuple(sorted(keys[i] for i in now.keys() - before.keys()))
                assert changes.removed == tuple(sorted(keys[i] for i in before.keys() - now.keys()))
                both = before.keys() & now.keys()
                assert changes.changed == tuple(sorted(keys[i] for i in both if before[i] != now[i]))
        assert ledger.check() == []


def test_the_scene_graph_type_is_the_core_one(ledger: Ledger) -> None:
    add(ledger, [full_object(1)])
    graph = ledger.scene_graph(ledger.scene("lab"), features=False, clouds=False)
    assert isinstance(graph, SceneGraph)
    assert graph.objects[0].features == {} and graph.objects[0].points is None
