"""Views of objects in the store: what is written is read, at every revision; older stores; damage; the JSON."""

from __future__ import annotations

import json
import sqlite3
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import cgdb
from cgdb.cli.app import main
from cgdb.cli.values import file_name
from cgdb.errors import CorruptionError, SceneError, VersionError
from cgdb.scene import LARGEST_IMAGE, UNREAD, SceneGraph, SceneObject, View, check_object, image_type
from cgdb.storage import schema
from cgdb.storage.ledger import Ledger

JPEG = b"\xff\xd8\xff\xe0" + bytes(range(256)) * 8
PNG = b"\x89PNG\r\n\x1a\n" + bytes(64)


def pose(turn: float = 0.3) -> np.ndarray:
    made = np.eye(4)
    made[:2, :2] = [[np.cos(turn), -np.sin(turn)], [np.sin(turn), np.cos(turn)]]
    made[:3, 3] = 1.5, -2.0, 1e-3
    return made


def view(frame: int = 3, **more: object) -> View:
    given = {"points": 100 - frame, "box": (10.0, 20.5, 110.0, 80.0), "image": JPEG + bytes([frame % 256]), **more}
    return View(frame=frame, **given)  # type: ignore[arg-type]


def seen(number: int, *views: View, tag: str = "mug") -> SceneObject:
    return SceneObject(id=number, tag=tag, center=np.zeros(3), extent=np.ones(3), views=views)


def same(a: tuple[View, ...], b: tuple[View, ...]) -> bool:
    def plain(one: View) -> tuple[object, ...]:
        turned = None if one.T_world_camera is None else one.T_world_camera.tobytes()
        return one.frame, one.points, one.box, turned, one.image, one.source

    return [plain(one) for one in a] == [plain(one) for one in b]


VIEWS = (
    view(3, T_world_camera=pose(), source="frame000003.jpg"),
    view(7, image=PNG),
    view(8, image=None, points=0),
)


@pytest.fixture
def db(tmp_path: Path) -> Iterator[cgdb.Database]:
    with cgdb.open(tmp_path / "lab.cgdb", create=True, text_encoder=None) as opened:
        yield opened


def add(db: cgdb.Database, *objects: SceneObject, how: str = "error") -> int | None:
    return db.add(SceneGraph(name="lab", objects=objects), on_existing=how)  # type: ignore[arg-type]


def execute(db: cgdb.Database, statement: str) -> list[tuple[object, ...]]:
    database = sqlite3.connect(db.path / "ledger.sqlite")
    found = database.execute(statement).fetchall()
    database.commit()
    database.close()
    return found


# --- in and out ------------------------------------------------------------------------------------------------------


def test_views_come_back_as_they_went_in(db: cgdb.Database) -> None:
    add(db, seen(1, *VIEWS), seen(2))
    assert same(db.views(1), VIEWS)
    assert db.views(2) == ()
    assert db.check() == ()
    whole = db.scene("lab", views=True)
    assert same(whole.objects[0].views, VIEWS)
    assert whole.objects[1].views == () and whole.objects[1].views is not UNREAD
    assert [obj.views for obj in db.scene("lab").objects] == [UNREAD, UNREAD]


def test_each_revision_has_its_own(db: cgdb.Database) -> None:
    add(db, seen(1, *VIEWS), seen(2, view(4)))
    assert add(db, seen(1, *VIEWS), how="merge") is None  # the same again: nothing is written
    assert add(db, seen(1, VIEWS[1]), how="merge") == 2
    db.remove("lab")
    assert same(db.views(1, as_of=1), VIEWS)
    assert same(db.views(1, as_of=2), VIEWS[1:2])
    assert same(db.views(2, as_of=2), (view(4),))
    assert add(db, seen(1, *VIEWS)) == 4
    assert same(db.views(1), VIEWS)
    assert db.check() == ()


def test_what_did_not_change_is_not_written_again(db: cgdb.Database) -> None:
    add(db, seen(1, *VIEWS))
    better = view(9)
    add(db, seen(1, *VIEWS[:2], better), how="merge")
    assert execute(db, "select rank, count(*) from views group by rank") == [(0, 1), (1, 1), (2, 2)]
    assert execute(db, "select count(*) from images") == [(3,)]
    add(db, seen(1, better, *VIEWS[:2]), how="merge")  # the same in another order: no picture moves
    assert same(db.views(1), (better, *VIEWS[:2]))
    add(db, seen(1, *VIEWS), seen(2, VIEWS[0]), how="merge")
    assert execute(db, "select count(*) from images") == [(3,)]
    assert same(db.views(2), VIEWS[:1]) and same(db.views(1), VIEWS)
    assert db.check() == ()
    (changes,) = db.diff(1, 2).values()
    assert (len(changes.changed), changes.added, changes.removed) == (1, (), ())


@pytest.mark.parametrize("how", ["merge", "replace"])
def test_an_object_read_without_its_views_keeps_them(db: cgdb.Database, how: str) -> None:
    add(db, seen(1, *VIEWS), seen(2, view(4)))
    read = db.scene("lab")
    named = tuple(replace(obj, caption="a thing") for obj in read.objects)
    assert db.add(replace(read, objects=named), on_existing=how) == 2  # type: ignore[arg-type]
    assert same(db.views(1), VIEWS) and same(db.views(2), (view(4),))
    assert db.check() == ()
    assert add(db, seen(1), how="merge") == 3  # (): it has none
    assert db.views(1) == ()
    assert db.check() == ()


def test_removed_objects_take_their_views_along(db: cgdb.Database) -> None:
    add(db, seen(1, *VIEWS), seen(2, view(4)))
    with db.write("lab", on_existing="merge") as writer:
        writer.remove([1])
    add(db, seen(3, view(5)), how="replace")
    assert db.check() == ()
    assert execute(db, "select frame from views where rev_to is null") == [(5,)]


def test_nothing_is_kept_of_a_block_that_fails(db: cgdb.Database) -> None:
    add(db, seen(1, view(1)))
    with pytest.raises(RuntimeError), db.write("lab", on_existing="merge") as writer:
        writer.objects([seen(1, *VIEWS)])
        raise RuntimeError
    assert same(db.views(1), (view(1),))


# --- rules -----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("bad", "message"),
    [
        (view(-1), "frame is -1"),
        (view(2, points=-5), "points is -5"),
        (view(2, box=(1.0, 2.0, 3.0)), "left, top, right, bottom"),
        (view(2, box=(1.0, 2.0, float("nan"), 4.0)), "left, top, right, bottom"),
        (view(2, box=(5.0, 2.0, 3.0, 4.0)), "ends before it begins"),
        (view(2, T_world_camera=np.full((4, 4), np.nan)), "not a finite 4 x 4"),
        (view(2, T_world_camera=np.zeros((4, 4))), "last row"),
        (view(2, T_world_camera=np.diag([2.0, 1.0, 1.0, 1.0])), "not a turn"),
        (view(2, image=b"GIF89a" + bytes(10)), "neither JPEG nor PNG nor WebP"),
        (view(2, image=b""), "neither JPEG nor PNG nor WebP"),
        (view(2, image=JPEG + bytes(LARGEST_IMAGE)), "at most 524,288"),
        (view(2, source=""), "source"),
    ],
)
def test_what_is_no_view_is_refused(bad: View, message: str) -> None:
    with pytest.raises(SceneError, match=message) as caught:
        check_object(seen(7, view(1), bad), {})
    assert "object #7: view 2" in str(caught.value) and "\n" not in caught.value.message


def test_too_many_views_are_refused() -> None:
    with pytest.raises(SceneError, match="101 views"):
        check_object(seen(7, *(view(i) for i in range(101))), {})


def test_images_are_told_by_their_first_bytes() -> None:
    assert [image_type(data) for data in (JPEG, PNG, b"RIFF\x00\x00\x00\x00WEBPVP8 ", b"RIFF", b"\xff\xd8", b"")] == [
        "image/jpeg",
        "image/png",
        "image/webp",
        None,
        None,
        None,
    ]


# --- older and newer stores ------------------------------------------------------------------------------------------


def age(path: Path) -> None:
    """Make a store what the first version would have left: none of the tables that came later, format 1."""
    database = sqlite3.connect(path / "ledger.sqlite")
    database.execute("drop table horizons")
    database.execute("drop table views")
    database.execute("drop table images")
    database.execute("update meta set value = '1' where name = 'format'")
    database.execute("pragma user_version = 1")
    database.commit()
    database.close()


def noted(path: Path) -> tuple[str, int]:
    database = sqlite3.connect(path / "ledger.sqlite")
    (value,) = database.execute("select value from meta where name = 'format'").fetchone()
    (version,) = database.execute("pragma user_version").fetchone()
    database.close()
    return value, version


@pytest.mark.parametrize("read_only", [True, False])
def test_a_store_of_the_format_before_is_read_as_it_is(tmp_path: Path, read_only: bool) -> None:
    path = tmp_path / "old.cgdb"
    with cgdb.open(path, create=True, text_encoder=None) as db:
        add(db, seen(1), seen(2))
        add(db, seen(1, tag="cup"), how="merge")
    age(path)
    with cgdb.open(path, read_only=read_only, text_encoder=None) as db:
        assert [obj.views for obj in db.scene("lab", views=True).objects] == [(), ()]
        assert db.views(1) == ()
        assert list(db.diff(1, 2)) == ["lab"]
        assert db.check() == ()
    assert noted(path) == ("1", 1)


def test_a_store_of_the_format_before_is_brought_up_to_date_by_the_first_write(tmp_path: Path) -> None:
    path = tmp_path / "old.cgdb"
    with cgdb.open(path, create=True, text_encoder=None) as db:
        add(db, seen(1), seen(2))
    age(path)
    with cgdb.open(path, text_encoder=None) as db, cgdb.open(path, text_encoder=None) as other:
        with pytest.raises(RuntimeError), db.write("lab", on_existing="merge") as writer:
            writer.objects([seen(1, *VIEWS)])
            raise RuntimeError
        assert noted(path) == ("1", 1)  # with the block, what it had brought up to date
        assert add(db, seen(1), how="merge") is None
        assert add(db, seen(1, *VIEWS), how="merge") == 2
        assert noted(path) == (str(schema.FORMAT), schema.FORMAT)
        assert same(other.views(1), VIEWS)  # open all the while
        assert other.views(1, as_of=1) == ()
        assert add(other, seen(2, view(4)), how="merge") == 3
        assert db.check() == ()
    with Ledger.open(path, read_only=True) as ledger:
        assert same(ledger.scene_graph(ledger.scene("lab"), views=True).objects[0].views, VIEWS)


def test_a_cgdb_that_knows_no_views_refuses_the_store(db: cgdb.Database, monkeypatch: pytest.MonkeyPatch) -> None:
    add(db, seen(1, *VIEWS))
    monkeypatch.setattr(schema, "FORMAT", 1)
    with pytest.raises(VersionError, match="knows formats up to 1"):
        cgdb.open(db.path)


def test_a_newer_cgdb_that_came_meanwhile_is_not_written_over(db: cgdb.Database) -> None:
    add(db, seen(1, *VIEWS))
    newer = schema.FORMAT + 1
    database = sqlite3.connect(db.path / "ledger.sqlite")
    database.execute(f"update meta set value = '{newer}' where name = 'format'")
    database.execute(f"pragma user_version = {newer}")
    database.commit()
    with pytest.raises(VersionError, match=f"to format {newer}"):
        add(db, seen(1), how="merge")
    assert db.views(1)[0].frame == VIEWS[0].frame
    database.close()


@pytest.mark.parametrize("form", ["cgdb", "node-link", "ply"])
def test_pictures_are_read_for_the_formats_that_hold_them(
    form: str, db: cgdb.Database, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    from cgdb.storage import reader

    read: list[bool] = []
    views = reader.views
    monkeypatch.setattr(reader, "views", lambda *given: read.append(True) or views(*given))
    add(db, SceneObject(id=1, center=np.zeros(3), views=VIEWS))
    db.export("lab", tmp_path / "a", form)
    assert bool(read) == (form == "cgdb")


def test_all_views_in_one_pass(db: cgdb.Database) -> None:
    add(db, *(seen(i, *(view(j) for j in range(i % 12))) for i in range(1, 40)))
    found = dict(db.every_views("lab"))
    assert list(found) == [i for i in range(1, 40) if i % 12]
    assert all(same(views, db.views(i)) for i, views in found.items())


def test_a_wrong_number_of_points_is_not_passed_over(
    db: cgdb.Database, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    add(db, SceneObject(id=1, center=np.zeros(3)))
    assert main(["export", str(db.path), "-o", str(tmp_path / "a.ply"), "--max-points", "0"]) == 2
    assert "max_points" in capsys.readouterr().err


def test_long_ids_that_begin_alike_are_two_files(
    db: cgdb.Database, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    ids = [f"{'x' * 180}{end}" for end in "ab"]
    add(db, *(SceneObject(id=one, views=VIEWS[:1]) for one in ids))
    assert main(["views", str(db.path), *ids, "--into", str(tmp_path / "pictures")]) == 0
    assert len(list((tmp_path / "pictures").iterdir())) == 2
    assert main(["views", str(db.path), ids[0], "--as-of", "²"]) == 6
    assert "neither a revision nor a time" in capsys.readouterr().err


# --- damage ----------------------------------------------------------------------------------------------------------


def test_a_flipped_byte_in_an_image_is_found(db: cgdb.Database) -> None:
    add(db, seen(1, *VIEWS), seen(2, view(4)))
    db.prepare()
    file = db.path / "ledger.sqlite"
    database = sqlite3.connect(file)
    database.execute("pragma wal_checkpoint(truncate)")
    database.close()
    data = bytearray(file.read_bytes())
    assert data.count(JPEG + bytes([3])) == 1
    at = data.index(JPEG + bytes([3]))
    data[at + 1000] ^= 1
    file.write_bytes(data)
    with cgdb.open(db.path, text_encoder=None) as read:
        (problem,) = read.check()
        assert "view 0 of the object with key" in problem.message
        with pytest.raises(CorruptionError, match="view 0"):
            read.views(1)
        assert same(read.views(2), (view(4),))
        with pytest.raises(CorruptionError, match="view 0"):
            read.scene("lab", views=True)
        saved = read.scene("lab", views=True, skip_damaged=True)
        assert same(saved.objects[0].views, VIEWS[1:])
        assert "view 0" in saved.provenance["damaged"][0]
        read.add(replace(saved, provenance={}), on_existing="replace")
        assert same(read.views(1), VIEWS[1:])
        assert read.check(full=False) == ()
        add(read, seen(1, *VIEWS), how="merge")  # the same image again heals it, also in the past
        assert same(read.views(1), VIEWS) and same(read.views(1, as_of=1), VIEWS)
        assert read.check() == ()


def test_a_replacement_leaves_damaged_views_behind(db: cgdb.Database) -> None:
    add(db, seen(1, *VIEWS), seen(2, view(4)))
    execute(db, "update views set points = 5 where rank = 1")
    with pytest.raises(CorruptionError, match="view 1"):
        add(db, seen(1, view(5)), how="merge")
    db.add(db.scene("lab"), on_existing="replace")
    assert db.views(1) == () and same(db.views(2), (view(4),))
    assert db.check(full=False) == ()


@pytest.mark.parametrize(
    "statement",
    [
        "delete from views where rank = 0",
        "delete from views where rank = 1",
        "delete from views where rank = 2",
        "update views set n_views = 2",
        "delete from views where frame = 4",
        "update views set rank = 5 where rank = 1",
        "update views set rev_to = 1 where frame = 4",
        "update views set pose = null where rank = 0",
        "update views set box = 'x' where rank = 0",
        "update views set source = 'other.jpg' where rank = 0",
        "update views set image = null where rank = 0",
        "update views set image = (select image from views where rank = 1) where frame = 3",
        "delete from images where rowid = 1",
        "update images set digest = x'00' where rowid = 1",
        "update images set scene_id = 2 where rowid = 1",
        "update images set data = 5 where rowid = 1",
        "drop table views",
        "drop table images",
    ],
)
def test_views_that_vanish_or_change_are_noticed(db: cgdb.Database, statement: str) -> None:
    add(db, seen(1, *VIEWS), seen(2, view(4)))
    execute(db, statement)
    assert db.check() != ()
    with pytest.raises(CorruptionError):
        db.views(1), db.views(2)
    with pytest.raises(CorruptionError):
        db.scene("lab", views=True)


# --- the command line ------------------------------------------------------------------------------------------------

EVIL = "\x1b[2Jcup/../x"


@pytest.fixture
def store(tmp_path: Path) -> Path:
    path = tmp_path / "cli.cgdb"
    with cgdb.open(path, create=True, text_encoder=None) as db:
        named = SceneObject(id=EVIL, views=(view(5, source="\x1b]0;x\x07.jpg"),))
        add(db, seen(12, *VIEWS), seen(2), named)
    return path


def test_views_are_listed(store: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["views", str(store), "12", "#2"]) == 0
    said = capsys.readouterr()
    assert "frame000003.jpg" in said.out and "100 × 60 at 10, 20" in said.out and "jpeg, 2.0 KB" in said.out
    assert said.err == "note: #2 has no views; `cgdb map` keeps them\n"
    assert main(["views", str(store), "12", "-k", "1", "--json"]) == 0
    (record,) = json.loads(capsys.readouterr().out)
    assert (record["object"], record["best"], record["frame"]) == (12, 1, 3)
    assert record["T_world_camera"] == pose().tolist()
    assert record["picture"] == {"type": "image/jpeg", "bytes": len(JPEG) + 1}


def test_pictures_are_written(store: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    folder = tmp_path / "a" / "pictures"
    assert main(["views", str(store), "12", EVIL, "--into", str(folder)]) == 0
    assert capsys.readouterr().err == f"wrote 3 pictures to {folder}; views without one: 1\n"
    names = sorted(path.name for path in folder.iterdir())
    assert names == ["12-01-frame000003.jpg", "12-02-frame000007.png", "_1b_5b2Jcup_2f.._2fx-01-frame000005.jpg"]
    assert (folder / names[0]).read_bytes() == VIEWS[0].image
    assert (folder / names[1]).read_bytes() == PNG


def test_no_control_characters_reach_the_terminal(store: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["views", str(store), EVIL]) == 0
    assert main(["shell", str(store), "--no-rc", "-c", ":show #12", "-c", f':show "{EVIL}"']) in (0, 2)
    said = capsys.readouterr()
    assert "\x1b" not in said.out + said.err and "\x07" not in said.out + said.err


def test_show_tells_of_the_best_views(store: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["shell", str(store), "--no-rc", "-c", ":show #12"]) == 0
    said = capsys.readouterr().out
    assert "frame 3 (frame000003.jpg), 97 points, 100 × 60 at 10, 20, picture: jpeg, 2.0 KB" in said
    assert "frame 8, 0 points" in said and "picture: none" in said


@pytest.mark.parametrize(
    ("arguments", "code", "message"),
    [
        (["99"], 3, "there is no object or place #99"),
        (["12", "-k", "0"], 2, "-k must be at least 1"),
        (["12", "--scene", "lap"], 6, "there is no scene 'lap'"),
        (["12", "--as-of", "9"], 6, "there is no revision 9"),
    ],
)
def test_what_cannot_be_shown_is_said(
    store: Path, arguments: list[str], code: int, message: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["views", str(store), *arguments]) == code
    assert message in capsys.readouterr().err


def test_a_folder_that_is_a_file(store: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "file").touch()
    assert main(["views", str(store), "12", "--into", str(tmp_path / "file")]) == 2
    assert "cannot be made a folder" in capsys.readouterr().err


def test_views_go_out_and_in_again(store: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    file, again = tmp_path / "lab.json", tmp_path / "again.cgdb"
    assert main(["export", str(store), "-o", "-", "--format", "cgdb"]) == 0
    file.write_text(capsys.readouterr().out)
    assert main(["import", str(file), "--into", str(again), "--no-encode", "--no-relate", "--quiet"]) == 0
    with cgdb.open(again, text_encoder=None) as db, cgdb.open(store, text_encoder=None) as first:
        assert same(db.views(12), VIEWS)
        assert same(db.views(EVIL), first.views(EVIL))
        assert db.export("lab", tmp_path / "second.json").path.read_bytes() == file.read_bytes()


def test_long_names_that_begin_alike_are_two_files() -> None:
    names = {file_name(name) for name in ("x" * 300, "x" * 299 + "y", "room/1", "room_1", "room 1")}
    assert len(names) == 5
    assert all(len(name) <= 150 and "/" not in name for name in names)
