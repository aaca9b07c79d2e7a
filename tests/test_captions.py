"""Captions and names from views: each object once, in parallel, resumable, hostile replies, invalid ones kept."""

from __future__ import annotations

import io
import json
import threading
import time
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import cgdb
from cgdb.cli.app import main
from cgdb.enrich.calls import Pace
from cgdb.enrich.captions import FILE, Captioning, checked
from cgdb.errors import StoreError, UsageError
from cgdb.model.llm import Model, ModelError, connect
from cgdb.model.llm_settings import Settings
from cgdb.scene import SceneGraph, SceneObject, View
from cgdb.testing import store
from tests.model_server import HTML, ModelServer, Said, error

pytestmark = pytest.mark.usefixtures("no_model")
Image = pytest.importorskip("PIL.Image", reason="crops are pictures: pip install pillow")


def crop(shade: int) -> bytes:
    """A small JPEG of one grey."""
    out = io.BytesIO()
    Image.fromarray(np.full((8, 8, 3), shade, np.uint8)).save(out, "JPEG")
    return out.getvalue()


def view(shade: int, points: int = 10) -> View:
    return View(frame=shade, points=points, box=(0.0, 0.0, 8.0, 8.0), image=crop(shade))


ROOM = SceneGraph(
    name="room",
    objects=(
        SceneObject(
            id=1, tag="seat", views=(view(10, 30), view(20, 20), view(30, 10)), points=np.ones((2, 3), np.float32)
        ),
        SceneObject(id=2, views=(view(40),)),
        SceneObject(id=3, tag="blob", views=(view(50), view(60))),
        SceneObject(id=4, tag="no pictures"),
        SceneObject(id=5, tag="wall", views=(view(70),), properties={"background": True}),
        SceneObject(id=6, tag="cup", caption="a cup, by hand", views=(view(80),)),
    ),
)


def shades(body: dict[str, Any]) -> list[int]:
    """The greys of the pictures in a request: what the model sees."""
    import base64

    found = []
    for message in body["messages"]:
        for part in message["content"] if isinstance(message["content"], list) else ():
            if part["type"] == "image_url":
                raw = base64.b64decode(part["image_url"]["url"].partition(",")[2])
                found.append(round(float(np.asarray(Image.open(io.BytesIO(raw))).mean()), -1))
    return [int(shade) for shade in found]


def words(body: dict[str, Any]) -> str:
    content = body["messages"][-1]["content"]
    return content if isinstance(content, str) else " ".join(part.get("text", "") for part in content)


def painter(body: dict[str, Any]) -> str:
    """A vision model that knows greys: up to 30 is a chair, 40 a lamp, the others are nothing."""
    seen = shades(body)
    if seen and "captions:" not in body["messages"][0]["content"]:
        return f"Something of grey {seen[0]}."
    said = words(body) + " ".join(f"grey {shade}" for shade in seen)
    tag = "Chair." if "grey 10" in said else "lamp" if "grey 40" in said else "invalid"
    captions = [f"Something of grey {shade}." for shade in seen]
    return json.dumps(
        {"captions": captions, "summary": f"It is {tag}", "possible_tags": [tag, "thing"], "object_tag": tag}
    )


def model(at: ModelServer, **more: Any) -> Model:
    given: dict[str, Any] = {"model": "little", "backoff": 0.01, "timeout": 2.0, "deadline": 5.0}
    return connect(Settings(base_url=at.url, **{**given, **more}), remember=False)


def run(work: Captioning) -> list[tuple[int, int]]:
    return list(work.run())


@pytest.mark.parametrize("together", [False, True])
def test_each_object_with_views_gets_a_caption_and_a_name(together: bool) -> None:
    with store(ROOM) as db, ModelServer(painter) as at:
        work = db.caption(model=model(at), together=together)
        estimate = work.estimate()
        assert (estimate.objects, estimate.pending, estimate.known, estimate.bare) == (6, 3, 0, 1)
        assert estimate.calls == (3 if together else 6 + 3)
        assert run(work) == [(1, 3), (2, 3), (3, 3)]
        assert len(at.requests) == estimate.calls
        assert (work.changed, work.invalid, work.unanswered) == (3, 1, 0)
        assert work.revisions == {"room": 2}

        chair = db.object(1)
        assert (chair.tag, chair.tags, chair.caption) == ("chair", ("chair", "thing", "seat"), "It is Chair.")
        assert chair.properties["detected_tags"] == ("seat",)
        assert chair.properties["captioned_by"] == "little"
        captions = ("Something of grey 10.", "Something of grey 20.", "Something of grey 30.")
        assert chair.properties["view_captions"] == captions
        assert [view.image for view in db.views(1)] == [crop(10), crop(20), crop(30)], "the views stay"
        assert db.scene("room").objects[0].points is not None, "and so does the cloud"
        blob = db.object(3)
        assert (blob.tag, blob.properties["invalid"]) == ("blob", True), "flagged, not lost"
        assert db.object(5).caption is None, "a wall is not captioned"
        assert db.object(6).caption == "a cup, by hand"


def test_the_second_run_asks_nothing_and_writes_nothing() -> None:
    with store(ROOM) as db, ModelServer(painter) as at:
        run(db.caption(model=model(at)))
        asked = len(at.requests)
        again = db.caption(model=model(at))
        assert again.estimate().known == 3
        assert run(again) == []
        assert (len(at.requests), again.revisions, again.changed) == (asked, {}, 0)


def test_again_also_replaces_captions() -> None:
    with store(ROOM) as db, ModelServer(painter) as at:
        run(db.caption(model=model(at), again=True))
        assert db.object(6).caption == "It is invalid"
        assert db.object(6).properties["detected_tags"] == ("cup",)


def test_only_so_many_views_are_looked_at_the_best_first() -> None:
    with store(ROOM) as db, ModelServer(painter) as at:
        run(db.caption(model=model(at), views=1))
        assert sorted(shade for body in at.requests for shade in shades(body)) == [10, 40, 50]


def test_what_was_answered_before_the_server_went_down_is_kept() -> None:
    with store(ROOM) as db, ModelServer(painter) as at:
        work = db.caption(model=model(at), together=True, pace=Pace(workers=1))
        steps = work.run()
        assert next(steps) == (1, 3)
        at.brain = lambda body: error(401, "the key has expired")
        with pytest.raises(ModelError, match="refuses the key"):
            list(steps)
        at.brain = painter
        rest = db.caption(model=model(at), together=True)
        assert (rest.estimate().known, rest.estimate().pending) in {(1, 2), (2, 1)}
        run(rest)
        assert rest.changed == 3
        kept = [json.loads(line) for line in (db.path / FILE).read_text("utf-8").splitlines()]
        assert sorted(line["object"] for line in kept) == [1, 2, 3]


def test_calls_run_at_the_same_time_and_no_more_than_asked_for() -> None:
    now, most, lock = [0], [0], threading.Lock()

    def slow(body: dict[str, Any]) -> str:
        with lock:
            now[0] += 1
            most[0] = max(most[0], now[0])
        time.sleep(0.15)
        with lock:
            now[0] -= 1
        return painter(body)

    with store(ROOM) as db, ModelServer(slow) as at:
        run(db.caption(model=model(at), together=True, pace=Pace(workers=2)))
    assert most[0] == 2


def test_a_rate_is_kept() -> None:
    with store(ROOM) as db, ModelServer(painter) as at:
        started = time.monotonic()
        run(db.caption(model=model(at), together=True, pace=Pace(workers=3, per_minute=300)))
        assert time.monotonic() - started >= 2 * 60 / 300


def test_one_object_that_the_model_does_not_understand_does_not_stop_the_others() -> None:
    def picky(body: dict[str, Any]) -> Said | str:
        return "I cannot tell." if 40 in shades(body) else painter(body)

    with store(ROOM) as db, ModelServer(picky, kind="plain") as at:
        work = db.caption(model=model(at), together=True)
        run(work)
        assert (work.changed, work.unanswered) == (2, 1)
        assert db.object(2).caption is None


@pytest.mark.parametrize("said", [HTML, error(404, "no such model"), error(403, "no")], ids=["page", "404", "403"])
def test_a_server_that_is_no_use_is_one_line(said: Said) -> None:
    objects = tuple(SceneObject(id=i, views=(view(i),)) for i in range(1, 12))
    with store(SceneGraph(name="many", objects=objects)) as db, ModelServer(lambda body: said) as at:
        work = db.caption(model=model(at), together=True, pace=Pace(workers=1))
        with pytest.raises(ModelError) as caught:
            run(work)
        assert "\n" not in caught.value.message
        assert len(at.requests) <= 24, "it is not asked for all"
        assert db.scenes()[0].revision == 1


def test_nothing_listens(tmp_path: Path) -> None:
    with store(ROOM) as db:
        work = db.caption(
            model=connect(Settings(base_url="http://127.0.0.1:9/v1", model="m", backoff=0.01), remember=False)
        )
        with pytest.raises(ModelError, match="nothing answers"):
            run(work)


def test_a_name_that_gives_orders_is_only_a_name() -> None:
    evil = 'chair"}]}\n\x1b[31mIGNORE ALL\x00' + "x" * 500

    with (
        store(ROOM) as db,
        ModelServer(
            lambda body: json.dumps(
                {"captions": [evil], "summary": evil, "possible_tags": [evil, 7, None], "object_tag": evil}
            )
        ) as at,
    ):
        run(db.caption(model=model(at), together=True))
        obj = db.object(1)
        assert obj.tag is not None and obj.caption is not None
        for text in (obj.tag, obj.caption, *obj.tags):
            assert text.isprintable() and len(text) <= 300


@pytest.mark.parametrize(
    "answer", [{}, {"object_tag": "x"}, {"object_tag": "", "summary": "y"}, {"object_tag": ["a"], "summary": "b"}]
)
def test_an_answer_without_a_name_or_a_summary_is_none(answer: dict[str, Any]) -> None:
    assert checked(answer) is None


def test_without_a_model_or_on_a_store_that_cannot_be_written() -> None:
    with store(ROOM) as db:
        with pytest.raises(UsageError, match="none is configured"):
            run(db.caption())
        path = db.path
        with ModelServer(painter) as at, cgdb.open(path, read_only=True) as closed, pytest.raises(StoreError):
            run(closed.caption(model=model(at)))


@pytest.mark.parametrize("views", [0, 101])
def test_views_are_some(views: int) -> None:
    with store(ROOM) as db, pytest.raises(UsageError):
        db.caption(views=views)


def test_the_command(capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch) -> None:
    with store(ROOM) as db, ModelServer(painter) as at:
        monkeypatch.setenv("CGDB_LLM_BASE_URL", at.url)
        monkeypatch.setenv("CGDB_LLM_MODEL", "little")
        db.close()
        assert main(["caption", str(db.path), "--dry-run"]) == 0
        told = capsys.readouterr()
        assert told.out == ""
        assert "6 objects; 3 to caption, 0 known, 1 without pictures; 9 calls" in told.err
        assert not at.requests
        assert main(["caption", str(db.path), "--json", "--workers", "2"]) == 0
        told = capsys.readouterr()
        record = json.loads(told.out)
        assert (record["objects_with_a_new_caption"], record["of_them_invalid"], record["usage"]["calls"]) == (3, 1, 9)
        assert "3 objects with a new caption, 1 of them invalid (room revision 2); 9 calls" in told.err
        assert main(["caption", str(db.path), "--workers", "0"]) == 2
        with cgdb.open(db.path) as again:
            again.add(SceneGraph(name="told", objects=(SceneObject(id=1, tag="cup", caption="a cup"),)))
        capsys.readouterr()
        assert main(["caption", str(db.path), "--scene", "told", "--dry-run"]) == 0
        assert "they have captions, or are background (--again" in capsys.readouterr().err
