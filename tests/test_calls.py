"""Asking a model of many things at a time: its rate, its threads, what is kept and recorded, and who else writes."""

from __future__ import annotations

import json
import threading
import time
from collections.abc import Iterator, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import cgdb
from cgdb.enrich.calls import Pace, Turn, each
from cgdb.enrich.kept import Kept
from cgdb.enrich.relations import _marked
from cgdb.enrich.tags import Tagging
from cgdb.errors import StoreBusyError, UsageError
from cgdb.model.llm import Meter, Model, ModelError, Response, connect
from cgdb.model.llm_settings import Settings
from cgdb.model.recording import Player, Recorder
from cgdb.scene import FeatureSpace, Relation, SceneGraph, SceneObject, View
from cgdb.storage.ledger import Ledger
from cgdb.testing import store

pytestmark = pytest.mark.usefixtures("no_model")

SETTINGS = Settings(base_url="http://nobody.invalid/v1", model="little", backoff=0.0)
JPEG = b"\xff\xd8\xff" + bytes(20)


class Canned:
    """A server without a wire: says the same to everything, and notes when it was asked. first: called once before."""

    def __init__(self, said: str, first: Any = None) -> None:
        self.said, self.first = said, first
        self.asked: list[float] = []
        self._lock = threading.Lock()

    def send(self, path: str, body: Mapping[str, Any] | None, seconds: float) -> Response:
        if body is None:
            return Response(status=200, text='{"data": []}', retry_after=None)
        with self._lock:
            self.asked.append(time.monotonic())
            first, self.first = self.first, None
        if first is not None:
            first()
        reply = {"choices": [{"message": {"content": self.said}}]}
        return Response(status=200, text=json.dumps(reply), retry_after=None)


def model(transport: Any) -> Model:
    return connect(SETTINGS, transport=transport, remember=False)


# -- rate and threads


def test_a_rate_is_of_questions_not_of_objects() -> None:
    views = tuple(View(frame=i, points=9 - i, box=(0.0, 0.0, 8.0, 8.0), image=JPEG + bytes([i])) for i in range(3))
    room = SceneGraph(name="room", objects=tuple(SceneObject(id=i, views=views) for i in (1, 2)))
    server = Canned('{"summary": "a lamp", "possible_tags": ["lamp"], "object_tag": "lamp"}')
    with store(room) as db:
        work = db.caption(model=model(server), pace=Pace(workers=4, per_minute=1200))
        assert work.estimate().calls == 8
        list(work.run())
        assert db.object(2).tag == "lamp"
    assert len(server.asked) == 8
    # 0.05 s apart, all of them; the first may have been late.
    assert server.asked[-1] - server.asked[0] > 0.05 * 6


def waiting() -> list[threading.Thread]:
    return [one for one in threading.enumerate() if one.name.endswith("(run)")]


def test_no_thread_outlives_the_work() -> None:
    def ask(item: int, meter: Meter, turn: Turn) -> int:
        if item == 13:
            raise ValueError("a fault of ours")
        turn()
        return 2 * item

    before = len(waiting())
    done = each(model(Canned("x")), range(5), ask, Pace(workers=3, per_minute=1e5))
    assert sorted(a.answer or 0 for a in done) == [0, 2, 4, 6, 8]
    with pytest.raises(ValueError, match="ours"):
        list(each(model(Canned("x")), [1, 13, 2], ask, Pace(workers=1)))
    halted = each(model(Canned("x")), iter(range(1000)), ask, Pace(workers=4))
    next(halted)
    halted.close()
    for _ in range(100):
        if len(waiting()) == before:
            break
        time.sleep(0.02)
    assert len(waiting()) == before


def test_who_waits_for_a_turn_gives_up_with_the_work() -> None:
    began, given_up = threading.Event(), threading.Event()

    def ask(item: int, meter: Meter, turn: Turn) -> int:
        if not item:
            assert began.wait(5.0)
            return item
        try:
            for _ in range(1000):
                began.set()
                turn()
        except ModelError:
            given_up.set()
            raise
        return item

    halted = each(model(Canned("x")), [0, 1], ask, Pace(workers=2, per_minute=600))
    next(halted)
    halted.close()
    assert given_up.wait(5.0)


# -- what is kept and recorded


def test_what_is_kept_may_hold_any_end_of_a_line(tmp_path: Path) -> None:
    def read(value: Any) -> str:
        return str(value)

    kept = Kept(tmp_path / "a.jsonl", read)
    for number, end in enumerate(("\u2028", "\x85", "\x0c", "\r", "\n")):
        kept.put(str(number), "x", f"one{end}two", {"object": f"a{end}b"})
    again = Kept(tmp_path / "a.jsonl", read)
    assert [again.get(str(n)) for n in range(5)] == ["one\u2028two", "one\x85two", "one\x0ctwo", "one\rtwo", "one\ntwo"]


def test_threads_record_whole_lines_and_share_a_replay(tmp_path: Path) -> None:
    path, n, each_one = tmp_path / "talk.jsonl", 8, 25
    recorder = Recorder(Canned("x" * 20_000), path, SETTINGS)
    body = {"messages": [{"role": "user", "content": "half a pair: \ud800"}]}

    def ask(at: Any) -> None:
        for _ in range(each_one):
            assert len(at.send("chat/completions", body, 1.0).text) > 20_000

    for at in (recorder, None):
        asked = at or Player(path)
        problems: list[BaseException] = []

        def work(asked: Any = asked, problems: list[BaseException] = problems) -> None:
            try:
                ask(asked)
            except BaseException as error:  # noqa: BLE001
                problems.append(error)

        threads = [threading.Thread(target=work) for _ in range(n)]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
        assert not problems
    assert len(path.read_text("utf-8").splitlines()) == 1 + n * each_one


def test_a_recording_that_cannot_be_written_is_told(tmp_path: Path) -> None:
    path = tmp_path / "talk.jsonl"
    recorder = Recorder(Canned("x"), path, SETTINGS)
    path.unlink()
    path.mkdir()
    with pytest.raises(UsageError, match="cannot be written"):
        recorder.send("chat/completions", {"messages": []}, 1.0)


# -- others who write meanwhile


@pytest.fixture
def room() -> Iterator[cgdb.Database]:
    boxes = {"center": np.zeros(3), "extent": np.ones(3)}
    objects = tuple(
        SceneObject(
            id=i,
            tag=None,
            points=np.zeros((2, 3), np.float32),
            features={"clip": np.eye(3, dtype=np.float32)[i - 1] * (i < 3)},
            views=(View(frame=i, points=1, box=(0.0, 0.0, 8.0, 8.0), image=JPEG + bytes([i])),),
            **boxes,
        )
        for i in (1, 2, 3)
    )
    with store(SceneGraph(name="room", objects=objects, spaces=(FeatureSpace(name="clip", dimension=3),))) as db:
        yield db


@pytest.mark.parametrize("kind", ["caption", "enrich", "tag"])
def test_what_a_mapper_adds_meanwhile_is_not_undone(
    kind: str, room: cgdb.Database, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    if kind == "tag":
        np.savez(tmp_path / "names.npz", names=np.array(["sofa", "cup"]), vectors=np.eye(2, 3, dtype=np.float32))
        work: Any = Tagging(room, tmp_path / "names.npz")
    elif kind == "caption":
        server = Canned('{"summary": "a lamp", "possible_tags": [], "object_tag": "lamp"}')
        work = room.caption(model=model(server))
    else:
        with room.write("room", on_existing="merge") as writer:
            writer.objects([replace(obj, tag="box") for obj in room.scene("room").objects])
        work = room.enrich(model=model(Canned('{"objects": [{"number": 1, "rigidity": "rigid"}]}')))
    read, refused = room.scene, []

    def and_mapped_then(*given: Any, **more: Any) -> SceneGraph:
        """The scene; right after it was read a mapper wants to write a larger cloud."""
        found = read(*given, **more)
        grown = replace(found.objects[0], points=np.ones((7, 3), np.float32))
        with Ledger.open(room.path, patience=0.05) as other:
            try:
                with other.write("room", on_existing="merge") as writer:
                    writer.objects([grown])
            except StoreBusyError:
                refused.append(True)
        return found

    monkeypatch.setattr(room, "scene", and_mapped_then)
    list(work.run())
    monkeypatch.undo()
    assert room.revisions()[-1].kind == kind
    assert refused or len(room.points(1)[0]) == 7


def test_relations_of_what_is_gone_are_left_out(room: cgdb.Database) -> None:
    def removed() -> None:
        with room.write("room", on_existing="merge") as writer:
            writer.remove([3])

    pairs = [{"number": n, "relation": "a on b", "other": None, "reason": "", "sure": "likely"} for n in range(1, 4)]
    work = room.relate(model=model(Canned(json.dumps({"pairs": pairs}), first=removed)), every_pair=True)
    list(work.run())
    assert [(r.source, r.target, r.origin) for r in room.scene("room").relations] == [(1, 2, "llm")]


def test_a_reason_that_speaks_of_contradiction_is_kept_whole() -> None:
    other = Relation(source=2, target=1, label="on", confidence=0.9, origin="geometry")
    mine = Relation(source=1, target=2, label="on", explanation="it contradicts what one expects; so be it")
    once = _marked(mine, other)
    assert once.explanation == f"{mine.explanation}; contradicts #2 on #1 (geometry, 0.90)"
    assert _marked(once, other).explanation == once.explanation


def test_features_without_a_length_get_no_name(room: cgdb.Database, tmp_path: Path) -> None:
    names = np.array(["sofa", "cup", "lamp"])
    np.savez(tmp_path / "names.npz", names=names, vectors=np.eye(3, dtype=np.float32))
    work = Tagging(room, tmp_path / "names.npz", top=1)
    list(work.run())
    assert [room.object(i).tag for i in (1, 2, 3)] == ["sofa", "cup", None]
    assert (work.scenes[0].tagged, work.scenes[0].unseen) == (2, 1)
