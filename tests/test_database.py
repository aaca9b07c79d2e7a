"""The store as programs use it: what each method of Database gives."""

from __future__ import annotations

import os
import sqlite3
import subprocess
import sys
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import cgdb
from cgdb import ingest
from cgdb.database import Database
from cgdb.errors import BindError, CgdbError, ExecuteError, SceneError, StoreBusyError, StoreError, VersionError
from cgdb.scene import SceneGraph, SceneObject
from cgdb.testing import store

FLAT = Path(__file__).parents[1] / "cli" / "flat.json"


@pytest.fixture(scope="module")
def flat() -> cgdb.SceneGraph:
    scene = ingest.load(FLAT)
    rng = np.random.default_rng(3)
    objects = tuple(
        replace(
            obj,
            features={"clip": rng.normal(size=8).astype(np.float32)},
            points=rng.normal(size=(5, 3)).astype(np.float32),
        )
        for obj in scene.objects
    )
    return replace(scene, objects=objects, spaces=(cgdb.FeatureSpace(name="clip", dimension=8),))


@pytest.fixture
def db(flat: cgdb.SceneGraph, tmp_path: Path) -> Iterator[Database]:
    with cgdb.open(tmp_path / "flat.cgdb", create=True, text_encoder=None) as opened:
        opened.add(flat)
        yield opened


def test_a_scene_comes_back_as_it_went_in(db: Database, flat: cgdb.SceneGraph) -> None:
    back = db.scene("flat")
    assert [obj.id for obj in back.objects] == [obj.id for obj in flat.objects]
    for one, other in zip(flat.objects, back.objects, strict=True):
        assert one.caption == other.caption
        assert dict(one.properties) == dict(other.properties)
        np.testing.assert_array_equal(one.features["clip"], other.features["clip"])
        np.testing.assert_array_equal(one.points, other.points)  # type: ignore[arg-type]
    assert set(back.relations) == set(flat.relations)


def test_revisions_diff_and_the_past(db: Database, flat: cgdb.SceneGraph) -> None:
    sofa = replace(flat.objects[0], caption="a green sofa")
    db.add(replace(flat, objects=(sofa, *flat.objects[1:])), on_existing="replace", message="the sofa was dyed")
    assert [(r.id, r.message) for r in db.revisions()] == [(1, ""), (2, "the sofa was dyed")]
    changes = db.diff(1, 2)["flat"]
    assert db.nodes_by_key("flat", changes.changed, as_of=2)[0].caption == "a green sofa"
    assert not (changes.added or changes.removed or changes.relations_added or changes.relations_removed)
    assert db.object(flat.objects[0].id).caption == "a green sofa"
    assert db.object(flat.objects[0].id, as_of=1).caption == flat.objects[0].caption
    assert db.scenes(as_of=1)[0].revision == 1


def test_as_of_takes_a_time(db: Database) -> None:
    written = db.revisions()[0].time
    assert db.scene("flat", as_of=written.isoformat()).name == "flat"
    with pytest.raises(StoreError):
        db.scene("flat", as_of="2001-01-01T00:00:00+00:00")


def test_a_removed_scene_is_only_in_the_past(db: Database) -> None:
    db.remove("flat")
    assert db.scenes() == ()
    with pytest.raises(StoreError, match="holds no scenes"):
        db.query("MATCH (o) RETURN o")
    assert db.query("USE 'flat' AS OF 1 MATCH (o) RETURN count(o)")[0][0] == 90


def test_object_and_its_relations(db: Database) -> None:
    sofa = db.object(1)
    assert str(sofa) == "#1 sofa"
    assert any(str(relation) == "#3 on #1" for relation in db.relations(1))
    assert db.object("901").label == "Room"
    with pytest.raises(BindError, match="#4242"):
        db.object(4242)


def test_points(db: Database, flat: cgdb.SceneGraph) -> None:
    points, colors = db.points(1)
    np.testing.assert_array_equal(points, flat.objects[0].points)  # type: ignore[arg-type]
    assert colors is None


def test_search_by_vector_is_exact_and_filtered(db: Database, flat: cgdb.SceneGraph) -> None:
    matrix = np.stack([obj.features["clip"] for obj in flat.objects])
    query = matrix[7]
    cosine = matrix @ query / np.linalg.norm(matrix, axis=1) / np.linalg.norm(query)
    expected = [flat.objects[i].id for i in np.argsort(-cosine)[:5]]
    hits = db.search(query, k=5)
    assert hits.ids == expected
    assert hits.scores[0] == pytest.approx(1.0, abs=1e-5)
    assert hits.nodes[0].id == expected[0]
    filtered = db.search(query, k=90, where="o.tag = 'cushion'")
    assert {node.tag for node in filtered.nodes} == {"cushion"}
    with pytest.raises(BindError, match="dimension 3"):
        db.search(np.ones(3))
    with pytest.raises(BindError, match="k must be"):
        db.search(query, k=0)


def test_search_over_several_scenes_merges_by_score(db: Database, flat: cgdb.SceneGraph) -> None:
    db.add(replace(flat, name="twin"))
    query = flat.objects[7].features["clip"]
    hits = db.search(query, k=4)
    assert [(hit.scene, hit.id) for hit in hits][:2] == [("flat", hits.ids[0]), ("twin", hits.ids[0])]
    assert {hit.scene for hit in db.search(query, k=4, scenes="twin")} == {"twin"}
    with pytest.raises(BindError, match="several scenes"):
        db.object(1)


def test_cypher_reads_and_cannot_write(db: Database) -> None:
    rows = list(db.cypher("MATCH (a:Node)-[r:Rel]->(b:Node) WHERE b.tag = $t RETURN a.tag, r.label", t="sofa").rows())
    assert ("cushion", "on") in rows
    for text in (
        "MATCH (n:Node) DELETE n",
        "CREATE (:Node {key: 1})",
        "COPY Node TO '/tmp/stolen.csv'",
        "MATCH (n) SET n.tag = 'x'",
    ):
        with pytest.raises(ExecuteError):
            db.cypher(text)


def test_results_go_to_dicts_pandas_and_arrow(db: Database) -> None:
    result = db.query("MATCH (o)-[:on]->(s {tag: 'sofa'}) RETURN o, o.tag AS tag, volume(o) AS litres ORDER BY tag")
    record = result.to_dicts(why=True)[0]
    assert record["o"]["id"] == record["o"]["id"]
    assert record["why"][0]["degree"] == pytest.approx(record["score"])
    frame = result.to_pandas()
    assert list(frame.columns) == ["o", "tag", "litres", "score", "fits"]
    table = result.to_arrow()
    assert table.num_rows == len(result) == len(frame)


def test_networkx_and_export(db: Database, tmp_path: Path) -> None:
    graph = db.to_networkx("flat")
    assert graph.number_of_nodes() == 95
    for name in ("a.json", "a.planner.json", "a.node-link.json", "a.graphml"):
        db.export("flat", tmp_path / name)
        assert (tmp_path / name).stat().st_size > 1000
    again = ingest.load(tmp_path / "a.json", relate=False)
    assert len(again.objects) == 90


def test_writing_in_batches_is_one_revision(db: Database) -> None:
    with db.write("long", spaces=(cgdb.FeatureSpace(name="v", dimension=4),)) as writer:
        for start in range(0, 100, 10):
            writer.objects(
                cgdb.SceneObject(id=i, features={"v": np.ones(4, np.float32)}) for i in range(start, start + 10)
            )
            writer.relations([cgdb.Relation(source=start, target=99, label="near")])
    assert writer.revision == 2
    assert db.query("USE 'long' MATCH (o) RETURN count(o)")[0][0] == 100


def test_a_failed_write_leaves_nothing(db: Database) -> None:
    with pytest.raises(SceneError, match="#77"), db.write("bad") as writer:
        writer.objects([cgdb.SceneObject(id=1)])
        writer.relations([cgdb.Relation(source=1, target=77, label="on")])
    with pytest.raises(SceneError), db.write("bad") as writer:
        writer.objects([cgdb.SceneObject(id=1, center=np.array([np.nan, 0, 0]))])
    assert [scene.name for scene in db.scenes()] == ["flat"]
    assert len(db.revisions()) == 1


def test_two_writers(db: Database) -> None:
    with (
        cgdb.open(db.path, text_encoder=None, patience=0.2) as other,
        db.write("one") as writer,
    ):
        writer.objects([cgdb.SceneObject(id=1)])
        with pytest.raises(StoreBusyError):
            other.add(cgdb.SceneGraph(name="two"))


def test_a_newer_format_is_refused(db: Database) -> None:
    path = db.path
    db.close()
    with sqlite3.connect(path / "ledger.sqlite") as raw:
        raw.execute("PRAGMA user_version = 99")
        raw.execute("UPDATE meta SET value = '99' WHERE name LIKE '%format%'")
    raw.close()
    with pytest.raises(VersionError, match="newer"):
        cgdb.open(path)


def test_a_closed_database_says_so(db: Database) -> None:
    db.close()
    db.close()
    with pytest.raises(StoreError, match="closed"):
        db.query("MATCH (o) RETURN o")


@pytest.mark.skipif(os.geteuid() != 0, reason="needs root to become another user")
def test_a_read_only_store_answers(db: Database, tmp_path: Path) -> None:
    db.prepare()
    path = db.path
    db.close()
    for place in (path, *path.rglob("*")):
        place.chmod(0o555 if place.is_dir() else 0o444)
    for parent in path.parents:
        if parent.stat().st_uid == os.geteuid() and parent != Path("/"):
            parent.chmod(parent.stat().st_mode | 0o055)
    code = (
        "import os, sys\nimport encodings.cp437, cgdb, cgdb.cli.app, cgdb.database, cgdb.query.run, kuzu, faiss\n"
        "os.setgid(65534); os.setuid(65534)\n"
        f"with cgdb.open({str(path)!r}, text_encoder=None) as db:\n"
        "    print(db.read_only, db.query('MATCH (a)-[:on]->(b) RETURN count(a)')[0][0] > 10)\n"
        "    try:\n        db.add(cgdb.SceneGraph(name='x'))\n"
        "    except cgdb.CgdbError as error:\n        print(error.message)\n"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert done.stdout.startswith("True True\n"), done.stderr
    assert "reading only" in done.stdout


def test_provenance_is_kept(db: Database, flat: cgdb.SceneGraph) -> None:
    assert dict(db.scenes()[0].provenance) == dict(flat.provenance) != {}


def test_every_error_is_one_of_ours(db: Database) -> None:
    for call in (
        lambda: db.query("MATCH (o ~ $v) RETURN o", v=[1.0, float("nan")]),
        lambda: db.query("MATCH (o ~ $v) RETURN o", v=object()),
        lambda: db.query("MATCH (o) RETURN o LIMIT $n", n=-1),
        lambda: db.query(""),
        lambda: db.search(""),
        lambda: db.search("cup", scenes=["nowhere"]),
        lambda: db.search("cup", where="o ~"),
        lambda: db.diff(1, 99),
        lambda: db.scene("flat", as_of=99),
    ):
        with pytest.raises(CgdbError) as caught:
            call()
        assert "\n" not in caught.value.message


def test_clouds_of_a_scene_come_with_their_ids() -> None:
    objects = (
        SceneObject(id="a", points=np.ones((2, 3), np.float32), colors=np.zeros((2, 3), np.uint8)),
        SceneObject(id=7),
        SceneObject(id=3, points=np.zeros((1, 3), np.float32)),
    )
    with store(SceneGraph(name="one", objects=objects)) as db:
        found = dict(db.clouds("one"))
        assert set(found) == {"a", 3}
        assert found["a"][0].tolist() == [[1.0] * 3] * 2 and found["a"][1].dtype == np.uint8
        assert found[3][1] is None
