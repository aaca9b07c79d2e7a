"""Old history goes, and nothing else: what is kept reads as before, and what went is never said not to have been."""

from __future__ import annotations

import json
import random
import re
import sqlite3
from collections.abc import Callable, Iterator
from datetime import UTC, datetime, timedelta
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import cgdb
from cgdb.cli.app import main
from cgdb.errors import CgdbError, CorruptionError, StoreError, UsageError
from cgdb.export import document
from cgdb.scene import FeatureSpace, Place, Relation, SceneGraph, SceneObject, View

CLIP = FeatureSpace(name="clip", dimension=4)
SCENES = ("lab", "attic", "hall")


@pytest.fixture
def db(tmp_path: Path) -> Iterator[cgdb.Database]:
    with cgdb.open(tmp_path / "s.cgdb", create=True, text_encoder=None) as opened:
        yield opened


def thing(number: int, mark: int, *, heavy: bool = True) -> SceneObject:
    """An object of which every part says the mark."""
    image = b"\xff\xd8\xff" + b"%d" % mark
    view = View(frame=mark, points=3, box=(0, 0, 1, 1), T_world_camera=np.eye(4), image=image)
    return SceneObject(
        id=number,
        tag=f"thing {mark}",
        center=np.full(3, float(mark)),
        features={"clip": np.full(4, mark, np.float32)} if heavy else {},
        points=np.full((5, 3), mark, np.float32) if heavy else None,
        views=(view,) if heavy else (),
        properties={"mark": mark},
    )


def put(db: cgdb.Database, scene: str, *objects: SceneObject, how: Any = "replace") -> int:
    revision = db.add(SceneGraph(name=scene, objects=objects, spaces=(CLIP,)), on_existing=how)
    assert revision is not None
    return revision


# --- every read of random histories, before and after ----------------------------------------------------------------


def change(db: cgdb.Database, dice: random.Random, mark: int) -> None:
    """One random write."""
    scene = dice.choice(SCENES)
    there = scene in {info.name for info in db.scenes()}
    kind = dice.random()
    some = dice.sample(range(8), dice.randint(1, 5))
    if there and kind < 0.12:
        db.remove(scene)
    elif there and kind < 0.3:
        known = [obj.id for obj in db.scene(scene).objects]
        with db.write(scene, on_existing="merge") as writer:
            writer.remove(dice.sample(known, min(len(known), 2)))
    else:
        relations = tuple(Relation(source=i, target=dice.choice(some), label=f"r{mark % 3}") for i in some)
        graph = SceneGraph(
            name=scene,
            objects=tuple(thing(i, dice.choice([mark, i]), heavy=dice.random() < 0.7) for i in some),
            places=(Place(id="room", kind="Room", name=f"room {mark % 4}"),),
            relations=tuple({(r.source, r.target): r for r in relations}.values()),
            spaces=(CLIP,),
            provenance={"mark": mark},
        )
        db.add(graph, on_existing="merge" if kind < 0.65 else "replace")


def outcome(read: Callable[[], object]) -> object:
    """What a read gives: its value, or its error in words."""
    try:
        return read()
    except CgdbError as error:
        return type(error).__name__, error.message


def exported(db: cgdb.Database, scene: str, as_of: Any) -> object:
    made = document(db.scene(scene, as_of=as_of, views=True), "cgdb")
    return "".join(made.pieces) if made.data is None else b"".join(made.data)


def of_moment(db: cgdb.Database, scene: str, as_of: Any) -> Callable[[], object]:
    """Everything of a scene at a moment, by every way there is to read it but queries."""

    def read() -> object:
        graph = db.scene(scene, as_of=as_of, views=True)
        with sqlite3.connect(db.path / "ledger.sqlite") as raw:
            keys = [key for (key,) in raw.execute("select distinct key from nodes order by key").fetchall()]
        raw.close()
        info = db._ledger.scene(scene, as_of)
        some = db._ledger.nodes_by_key(info, keys)
        return (
            exported(db, scene, as_of),
            [obj.id for obj in graph.objects],
            {key: (node.id, node.tag) for key, node in some.items()},
            db._ledger.relations_of(info, list(some)),
            [repr((db._ledger.views(info, key), db._ledger.cloud(info, key))) for key in list(some)[:2]],
            info.revision,
        )

    return read


def briefly(db: cgdb.Database, scene: str, moment: datetime) -> Callable[[], object]:
    """Which state of a scene was that of a moment, and what was in it."""

    def read() -> object:
        graph = db.scene(scene, as_of=moment, features=False, clouds=False)
        return [(obj.id, obj.tag) for obj in graph.objects], graph.provenance

    return read


def differences(db: cgdb.Database, scene: str, a: int, b: int) -> Callable[[], object]:
    return lambda: {name: repr(changes) for name, changes in db.diff(a, b, scene).items()}


Read = tuple[str, tuple[Any, ...]]


def reads(db: cgdb.Database, times: dict[int, datetime], born: dict[str, int], last: int) -> dict[Read, object]:
    """{what was read: what it gave}, of every scene that is or was."""
    found: dict[Read, object] = {}
    for scene in born:
        for revision in range(1, last + 1):
            found[scene, (revision,)] = outcome(of_moment(db, scene, revision))
            if revision < last:
                moment = times[revision] + timedelta(microseconds=revision % 2)
                found[scene, (revision, moment)] = outcome(briefly(db, scene, moment))
        found[scene, ("now",)] = outcome(of_moment(db, scene, None))
        ends = random.Random(last)
        for a, b in ((ends.randint(0, last), ends.randint(0, last)) for _ in range(8)):
            found[scene, ("diff", a, b)] = outcome(differences(db, scene, a, b))
    return found


@pytest.mark.parametrize("seed", [*range(2), *(pytest.param(seed, marks=pytest.mark.slow) for seed in range(2, 40))])
def test_what_is_kept_reads_as_before(db: cgdb.Database, seed: int) -> None:
    dice = random.Random(seed)
    times: dict[int, datetime] = {}
    of: dict[int, str] = {}
    born: dict[str, int] = {}
    kept_from: dict[str, int] = {}
    for turn in range(2):
        for mark in range(turn * 10, turn * 10 + 7):
            change(db, dice, mark)
        log = {revision.id: revision for revision in db.revisions()}
        for number, revision in log.items():
            times[number], of[number] = revision.time, revision.scene
            born.setdefault(revision.scene, number)
        last = max(log)
        assert last == max(of), "the numbers of revisions go on"
        before = reads(db, times, born, last)

        keep = dice.choice([None, 1, 2, 3])
        bound = dice.choice([None, dice.randint(1, last)]) if keep is not None else dice.randint(1, last)
        chosen = dice.sample(sorted(born), 1) if dice.random() < 0.3 else []
        for scene in chosen or born:
            own = [number for number in sorted(of) if of[number] == scene and number >= kept_from.get(scene, 0)]
            by_keep = own[-keep] if keep is not None and keep <= len(own) else own[0]
            by_time = max((n for n in own if n <= bound), default=own[0]) if bound is not None else last
            kept_from[scene] = min(by_keep if keep is not None else last, by_time)
        as_given = times[bound] if bound is not None and dice.random() < 0.5 else bound
        files = [file.read_bytes() for file in sorted(db.path.glob("ledger.sqlite*"))]
        told = db.prune(keep=keep, before=as_given, scenes=chosen, dry_run=True)
        untouched = [file.read_bytes() for file in sorted(db.path.glob("ledger.sqlite*"))]
        assert [*map(len, files)] == [*map(len, untouched)] and files[0] == untouched[0] and files[2] == untouched[2]
        done = db.prune(keep=keep, before=as_given, scenes=chosen)
        assert done.scenes == told.scenes

        assert db.check() == ()
        kept = {number: one for number, one in log.items() if number >= kept_from.get(one.scene, 0)}
        assert {revision.id: revision for revision in db.revisions()} == kept
        assert done.revisions == len(log) - len(kept)
        after = reads(db, times, born, last)
        for (scene, at), old in before.items():
            hidden = range(born[scene], kept_from.get(scene, 0))
            asked = at[1:] if at[0] == "diff" else at[:1]
            new = after[scene, at]
            if any(revision in hidden for revision in asked) and not (at[0] == "diff" and new == old):
                assert new[0] == "StoreError" and "was pruned" in new[1], (scene, at, new)  # type: ignore[index]
                assert f"revision {kept_from[scene]} of scene '{scene}'" in new[1]  # type: ignore[index]
            elif isinstance(old, tuple) and old[0] == "StoreError" and isinstance(at[-1], datetime):
                assert isinstance(new, tuple) and new[0] == "StoreError" and "no scene" in new[1]
            else:
                assert new == old, (scene, at)
        nothing_is_left_over(db, kept_from)
    with cgdb.open(db.path, text_encoder=None) as again:
        assert reads(again, times, born, last) == after


def nothing_is_left_over(db: cgdb.Database, kept_from: dict[str, int]) -> None:
    """No row, image or state that no kept revision has."""
    raw = sqlite3.connect(db.path / "ledger.sqlite")
    for name, revision in kept_from.items():
        (number,) = raw.execute("select id from scenes where name = ?", (name,)).fetchone()
        for table in ("nodes", "relations", "features", "clouds", "views"):
            statement = f"select count(*) from {table} where scene_id = ? and rev_to <= ?"
            assert raw.execute(statement, (number, revision)).fetchone() == (0,), table
        for table, column in (("scene_versions", "revision"), ("revisions", "id")):
            statement = f"select count(*) from {table} where scene_id = ? and {column} < ?"
            assert raw.execute(statement, (number, revision)).fetchone() == (0,), table
        unused = "select count(*) from images i where scene_id = ? and not exists"
        unused += " (select 1 from views v where v.scene_id = i.scene_id and v.image = i.digest)"
        assert raw.execute(unused, (number,)).fetchone() == (0,)
    raw.close()


# --- what is asked of history that went ------------------------------------------------------------------------------


def test_a_question_about_what_went_says_so(db: cgdb.Database) -> None:
    for mark in range(1, 6):
        put(db, "lab", thing(1, mark))
    put(db, "attic", thing(7, 7))
    put(db, "lab", thing(1, 8))
    db.prune(keep=2)
    assert [revision.id for revision in db.revisions()] == [5, 6, 7]
    with pytest.raises(StoreError, match=r"history before revision 5 of scene 'lab' was pruned") as told:
        db.query("USE 'lab' AS OF 3 MATCH (o) RETURN o")
    assert told.value.hint is not None and "AS OF 5 and later" in told.value.hint
    for read in (
        lambda: db.scenes(3),
        lambda: db.query("AS OF 3 MATCH (o) RETURN o"),
        lambda: db.scene("lab", as_of=4),
        lambda: db.view("lab", 1),
        lambda: db.object(1, as_of=2),
        lambda: db.diff(2, 5),
        lambda: db.diff(1, 3),
        lambda: db.diff(0, 4),
        lambda: db.diff(7, 4, "lab"),
    ):
        with pytest.raises(StoreError, match="was pruned"):
            read()
    assert db.query("USE 'lab' AS OF 5 MATCH (o) RETURN o.mark")[0][0] == 5
    assert db.query("MATCH (o) RETURN count(o)")[0][0] == 2
    assert sorted(db.diff(0, 7)) == ["attic", "lab"] and sorted(db.diff(5, 6)) == ["attic"]
    # What was not there yet is still told from what went, and of other scenes everything is answered.
    with pytest.raises(StoreError, match="there is no scene 'attic' at revision 3"):
        db.scene("attic", as_of=3)
    with pytest.raises(StoreError, match="there is no scene 'cellar' at revision 3"):
        db.scene("cellar", as_of=3)
    assert sorted(db.diff(3, 6, "attic")) == ["attic"]
    assert list(db.horizons()) == ["lab"] and db.horizons()["lab"].revisions == 4


def test_times_within_what_went(db: cgdb.Database) -> None:
    put(db, "attic", thing(1, 1))
    for mark in range(2, 9):
        put(db, "lab", thing(1, mark))
    at = {revision.id: revision.time for revision in db.revisions()}
    db.prune(keep=1)
    assert [revision.id for revision in db.revisions()] == [1, 8]
    for revision in range(2, 8):
        with pytest.raises(StoreError, match="before revision 8 of scene 'lab' was pruned"):
            db.scene("lab", as_of=at[revision])
        assert db.object(1, scene="attic", as_of=at[revision]).properties["mark"] == 1
    with pytest.raises(StoreError, match="there is no scene 'lab'"):
        db.scene("lab", as_of=at[1])
    assert db.object(1, scene="lab", as_of=at[8]).properties["mark"] == 8
    with pytest.raises(StoreError, match="no revision yet"):
        db.scene("lab", as_of=at[1] - timedelta(seconds=1))


def test_a_removed_scene_leaves_one_line(db: cgdb.Database) -> None:
    put(db, "lab", thing(1, 1), thing(2, 2))
    key = next(iter(db._ledger.nodes(db._ledger.scene("lab"))))[1].key
    db.remove("lab")
    put(db, "attic", thing(1, 3))
    done = db.prune(before=3)
    assert [(one.scene, one.kept_from, one.revisions) for one in done.scenes] == [("lab", 2, 1)]
    assert [(revision.id, revision.kind) for revision in db.revisions()] == [(2, "remove"), (3, "import")]
    raw = sqlite3.connect(db.path / "ledger.sqlite")
    for table in ("nodes", "features", "clouds", "views", "images"):
        assert raw.execute(f"select count(*) from {table} where scene_id = 1").fetchone() == (0,)
    raw.close()
    with pytest.raises(StoreError, match="was pruned"):
        db.scene("lab", as_of=1)
    with pytest.raises(StoreError, match="there is no scene 'lab' at revision 2"):
        db.scene("lab", as_of=2)
    assert put(db, "lab", thing(2, 4)) == 4
    again = next(iter(db._ledger.nodes(db._ledger.scene("lab"))))[0].key
    assert again > key, "no key means two things in one store"
    assert db.check() == ()


def test_both_bounds_keep_what_either_keeps(db: cgdb.Database) -> None:
    for mark in range(1, 11):
        put(db, "lab", thing(1, mark))
    assert db.prune(keep=2, before=5, dry_run=True).scenes[0].kept_from == 5
    assert db.prune(keep=8, before=5, dry_run=True).scenes[0].kept_from == 3
    assert db.prune(before=datetime(2000, 1, 1), dry_run=True).scenes == ()
    assert db.prune(keep=10).scenes == ()


@pytest.mark.parametrize(
    ("asked", "error", "match"),
    [
        ({}, UsageError, "nothing says"),
        ({"keep": 0}, UsageError, "cannot be kept"),
        ({"keep": -1, "before": 2}, UsageError, "cannot be kept"),
        ({"before": 0}, StoreError, "there is no revision 0"),
        ({"before": 9}, StoreError, "there is no revision 9"),
        ({"before": "yesterday"}, StoreError, "neither a revision nor a time"),
        ({"before": datetime.now(UTC) + timedelta(days=9)}, StoreError, "future"),
        ({"keep": 1, "scenes": ["lap"]}, StoreError, "there never was a scene 'lap'"),
    ],
)
def test_what_cannot_be_asked(db: cgdb.Database, asked: dict[str, Any], error: type[CgdbError], match: str) -> None:
    for mark in range(1, 4):
        put(db, "lab", thing(1, mark))
    for dry_run in (True, False):
        with pytest.raises(error, match=match):
            db.prune(**asked, dry_run=dry_run)
    assert len(db.revisions()) == 3


def test_indexes_of_what_went_are_swept(tmp_path: Path) -> None:
    path = tmp_path / "s.cgdb"
    with cgdb.open(path, create=True, text_encoder=None) as db:
        put(db, "lab", thing(1, 1))
        db.prepare()
        put(db, "lab", thing(1, 2))
    assert {name.name.partition("-")[2][:2] for name in (path / "index").iterdir()} == {"r1"}
    with cgdb.open(path, text_encoder=None) as db:
        db.prune(keep=1)
    assert list((path / "index").iterdir()) == []
    with cgdb.open(path, text_encoder=None) as db:
        assert db.query("MATCH (o) RETURN o.mark")[0][0] == 2


# --- the file --------------------------------------------------------------------------------------------------------


def grow(db: cgdb.Database, times: int = 6) -> None:
    for mark in range(times):
        cloud = np.full((20_000, 3), mark, np.float32)
        put(db, "lab", *(SceneObject(id=i, tag=f"{mark}", points=cloud + i) for i in range(8)))


@pytest.mark.parametrize("made", ["incremental", "none"])
def test_the_file_shrinks(tmp_path: Path, made: str) -> None:
    path = tmp_path / "s.cgdb"
    file = path / "ledger.sqlite"
    with cgdb.open(path, create=True, text_encoder=None):
        pass
    if made == "none":  # as stores were made before
        raw = sqlite3.connect(file)
        raw.execute("pragma auto_vacuum = none")
        raw.execute("vacuum")
        raw.close()
    with cgdb.open(path, text_encoder=None) as db:
        grow(db)
        done = db.prune(keep=1)
        assert done.notes == () and done.size_before > 9e6 and done.size_after < 0.3 * done.size_before
        assert file.stat().st_size == done.size_after < 0.2 * done.bytes + 1e6
        assert db.check() == () and len(db.scene("lab").objects) == 8
        again = db.prune(keep=1)
        assert again.scenes == () and again.size_after == again.size_before


def test_an_older_file_keeps_its_size_where_there_is_no_room(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = tmp_path / "s.cgdb"
    cgdb.open(path, create=True, text_encoder=None).close()
    raw = sqlite3.connect(path / "ledger.sqlite")
    raw.execute("pragma auto_vacuum = none")
    raw.execute("vacuum")
    raw.close()
    from cgdb.storage import shrink

    class Full:
        free = 1000

    with cgdb.open(path, text_encoder=None) as db:
        grow(db, 3)
        with monkeypatch.context() as patch:
            patch.setattr(shrink.shutil, "disk_usage", lambda _: Full)
            done = db.prune(keep=1)
        assert done.revisions == 2 and "the file keeps its size" in done.notes[0]
        assert db.check() == ()
        later = db.prune(keep=1)
        assert later.scenes == () and later.size_after < later.size_before


def test_an_older_store_is_pruned_too(tmp_path: Path) -> None:
    path = tmp_path / "s.cgdb"
    with cgdb.open(path, create=True, text_encoder=None) as db:
        for mark in range(3):
            put(db, "lab", thing(1, mark))
    raw = sqlite3.connect(path / "ledger.sqlite")
    raw.execute("drop table horizons")
    raw.execute("update meta set value = '2' where name = 'format'")
    raw.execute("pragma user_version = 2")
    raw.commit()
    raw.close()
    with cgdb.open(path, read_only=True, text_encoder=None) as db:
        assert db.prune(keep=1, dry_run=True).revisions == 2 and db.horizons() == {}
        with pytest.raises(StoreError, match="reading only"):
            db.prune(keep=1)
    with cgdb.open(path, text_encoder=None) as db:
        assert db.prune(keep=1).revisions == 2 and db.check() == ()


# --- damage ----------------------------------------------------------------------------------------------------------


def execute(db: cgdb.Database, statement: str) -> None:
    raw = sqlite3.connect(db.path / "ledger.sqlite")
    assert raw.execute(statement).rowcount > 0
    raw.commit()
    raw.close()


@pytest.mark.parametrize(
    "statement",
    [
        "update nodes set rev_to = 2 where rev_to is null",
        "update nodes set rev_to = null where rev_to = 3",
        "update clouds set rev_from = 0 where rev_to is null",
        "update views set rev_to = 3 where rev_to is null",
        "delete from features where rev_to is null",
        "delete from revisions where id = 2",
        "update revisions set message = 'x' where id = 4",
        "delete from scene_versions where revision = 4",
    ],
)
def test_a_damaged_ledger_is_not_pruned(db: cgdb.Database, statement: str) -> None:
    for mark in range(1, 5):
        put(db, "lab", thing(1, mark))
    execute(db, statement)
    raw = sqlite3.connect(db.path / "ledger.sqlite")
    before = list(raw.iterdump())
    with pytest.raises(CorruptionError):
        db.prune(keep=2)
    assert list(raw.iterdump()) == before
    raw.close()
    assert db.check() != ()


@pytest.mark.parametrize(
    "statement",
    [
        "delete from horizons",
        "delete from horizons where scene_id = 1",
        "update horizons set kept_from = 1 where scene_id = 1",
        "update horizons set first = 2 where scene_id = 1",
        "update horizons set scene_id = 9 where scene_id = 1",
        "delete from meta where name = 'pruned'",
        "update meta set value = '5' where name = 'pruned'",
    ],
)
def test_a_horizon_that_is_lost_is_noticed(db: cgdb.Database, statement: str) -> None:
    for mark in range(1, 5):
        put(db, "lab", thing(1, mark))
        put(db, "attic", thing(1, mark))
    db.prune(keep=1)
    execute(db, statement)
    with pytest.raises(CorruptionError):
        db.scene("lab", as_of=2)
    with pytest.raises(CorruptionError):
        db.scenes(as_of=2)
    with pytest.raises(CorruptionError):
        db.revisions()
    assert db.check() != ()


@pytest.mark.parametrize("revision", [5, 7, 8])
def test_a_revision_that_is_lost_after_pruning_is_noticed(db: cgdb.Database, revision: int) -> None:
    for mark in range(1, 9):
        put(db, "lab", thing(1, mark))
    db.prune(keep=4)
    execute(db, f"delete from revisions where id = {revision}")
    with pytest.raises(CorruptionError):
        db.revisions()
    assert db.check() != ()


# --- the command line ------------------------------------------------------------------------------------------------


@pytest.fixture
def store(tmp_path: Path) -> Path:
    path = tmp_path / "cli.cgdb"
    with cgdb.open(path, create=True, text_encoder=None) as db:
        for mark in range(1, 5):
            put(db, "lab", thing(1, mark))
        put(db, "attic", thing(1, 9))
        put(db, "attic", thing(1, 10))
    return path


def ran(capfd: pytest.CaptureFixture[str], *words: object) -> tuple[int, str, str]:
    code = main([str(word) for word in words])
    out, err = capfd.readouterr()
    return code, out, err


def test_the_command(store: Path, capfd: pytest.CaptureFixture[str]) -> None:
    size = (store / "ledger.sqlite").stat().st_size
    code, out, err = ran(capfd, "prune", store, "--keep", 1, "--dry-run")
    assert (code, out) == (0, "")
    assert "'lab': 3 revisions, 15 rows" in err and "would prune 4 revisions of 2 scenes: 20 rows" in err
    assert "nothing was changed" in err and (store / "ledger.sqlite").stat().st_size == size
    kept = ran(capfd, "export", store, "lab", "--as-of", 4)[1]
    code, out, err = ran(capfd, "prune", store, "--keep", 1, "--scene", "lab", "--json")
    told = json.loads(out)
    assert (code, err) == (0, "") and told["revisions"] == 3 and told["scenes"][0]["kept_from"] == 4
    code, out, err = ran(capfd, "log", store)
    assert err == "note: history before revision 4 of scene 'lab' was pruned (3 revisions)\n"
    assert [line.split()[0] for line in out.splitlines()[2:]] == ["4", "5", "6"]
    code, out, _ = ran(capfd, "log", store, "--json")
    assert [record["revision"] for record in json.loads(out)] == [4, 5, 6]
    assert ran(capfd, "export", store, "lab", "--as-of", 4)[:2] == (0, kept)
    code, out, err = ran(capfd, "export", store, "lab", "--as-of", 2)
    assert code == 6 and re.match(r"store error: history before revision 4 of scene 'lab' was pruned", err)
    assert ran(capfd, "export", store, "attic", "--as-of", 5)[0] == 0
    assert ran(capfd, "diff", store, 2, 5)[0] == 6
    assert ran(capfd, "diff", store, 2, 5, "--scene", "attic")[0] == 0
    code, _, err = ran(capfd, "prune", store, "--keep", 1)
    assert code == 0 and err.startswith("pruned 1 revision of 'attic': 5 rows with ")
    code, _, err = ran(capfd, "prune", store, "--before", "2001-01-01")
    assert code == 0 and err.startswith("nothing is old enough to go; the ledger has ")
    assert ran(capfd, "check", store)[0] == 0


def test_the_command_must_be_told_what_stays(store: Path, capfd: pytest.CaptureFixture[str]) -> None:
    assert ran(capfd, "prune", store)[0] == 2
    assert ran(capfd, "prune", store, "--keep", 0)[0] == 2
    assert ran(capfd, "prune", store, "--keep", 1, "--scene", "attik")[0] == 6
    assert ran(capfd, "prune", store / "no", "--keep", 1)[0] == 6
