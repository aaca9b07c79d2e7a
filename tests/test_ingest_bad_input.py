"""Bad input gives one clear line that names the file and what is wrong; it never gives a traceback of ours."""

from __future__ import annotations

import gzip
import json
import random
import sys
import time
from pathlib import Path
from typing import Any

import pytest

from cgdb import ingest
from cgdb.errors import CgdbError, FormatError, UsageError

GOOD = {"id": 1, "object_tag": "cup", "caption": "a cup", "bbox_center": [0, 0, 0], "bbox_extent": [1, 1, 1]}


def changed(**more: Any) -> bytes:
    return json.dumps([GOOD, {**GOOD, "id": 2, **more}]).encode()


def truncated_gzip() -> bytes:
    whole = gzip.compress(json.dumps([GOOD] * 500).encode())
    return whole[: len(whole) // 2]


TABLE: list[tuple[str, bytes, str]] = [
    ("empty", b"", "the file is empty"),
    ("white space", b" \n\n ", "the file is empty"),
    ("truncated gzip", truncated_gzip(), "truncated"),
    ("damaged gzip", b"\x1f\x8b\x08\x00" + b"\xff" * 60, "damaged"),
    ("a picture", b"\x89PNG\r\n\x1a\n\x00\x00\x00\rIHDR\xff", "this is no text: a picture"),
    ("not UTF-8", b'[{"id": 1, "caption": "\xff\xfe"}]', "not UTF-8 text: byte 23"),
    ("UTF-16", '[{"id": 1}]'.encode("utf-16"), "not UTF-8"),
    ("a picture", b"\x89PNG\r\n\x1a\n" + bytes(50), "not"),
    ("prose", b"Dear robot, the cup is on the table.", "not whole JSON"),
    ("half a list", b'[{"id": 1, "tag": "a"}, {"id"', "not whole JSON: .* at line 1, column"),
    ("a list of numbers", b"[1, 2, 3]", "JSON list of numbers, which is no map"),
    ("an empty list", b"[]", "JSON empty list, which is no map"),
    ("a number", b"7", "JSON number, which is no map"),
    ("null", b"null", "JSON null, which is no map"),
    ("an object of another kind", b'{"type": "FeatureCollection", "features": []}', "keys 'type', 'features'"),
    ("a list of strangers", b'[{"lat": 1, "lon": 2}]', "which is no map"),
    ("NaN", b'[{"id": 1, "tag": "a", "center": [NaN, 0, 0]}]', "holds NaN"),
    ("Infinity", b'[{"id": 1, "tag": "a", "center": [-Infinity, 0, 0]}]', "holds -Infinity"),
    ("an overflowing number", b'[{"id": 1, "tag": "a", "center": [1e999, 0, 0]}]', "#1.*not a finite number"),
    ("a center far away", changed(bbox_center=[1e9, 0, 0]), "#2.*farther"),
    ("a center of text", changed(bbox_center=["a", 0, 0]), "#2.*must be a number"),
    ("a center of two", changed(bbox_center=[0, 0]), "#2.*three numbers"),
    ("a true center", changed(bbox_center=[True, 0, 0]), "#2.*must be a number"),
    ("a huge center", b'[{"id": 1, "tag": "a", "center": [1' + b"0" * 400 + b", 0, 0]}]", "#1.*finite"),
    ("a negative extent", changed(bbox_extent=[1, -1, 1]), "#2.*negative side"),
    ("an extent without center", b'[{"id": 1, "tag": "a", "extent": [1, 1, 1]}]', "#1.*no center"),
    ("a rotation that is none", changed(rotation=[[1, 0, 0], [0, 1, 0], [0, 0, 2]]), "#2.*orthonormal"),
    ("another dimension", b'[{"id":1,"tag":"a","embedding":[1,2]},{"id":2,"embedding":[1,2,3]}]', "#2.*3 numbers.* 2"),
    ("a vector of text", changed(embedding=["1", "2"]), "#2.*numbers only"),
    ("a vector of vectors", changed(embedding=[[1], [2]]), "#2.*numbers only"),
    ("an empty vector", changed(features={"clip": []}), "#2.*list of 1 to"),
    ("an infinite vector", changed(embedding=[1e39, 1.0]), "#2.*infinite"),
    ("an enormous vector", changed(embedding=[0] * 70_000), "#2.*65,536"),
    ("duplicate ids", changed(id=1), "two nodes have the id #1"),
    ("the same id twice over", changed(id="1"), "two nodes have the id #1"),
    ("an id that is a list", changed(id=[1]), "record 1.*number or text"),
    ("a true id", changed(id=True), "record 1"),
    ("an id of half a character", b'[{"id": "\\ud800", "tag": "a"}]', "record 0.*not text"),
    ("an id of 90 bits", changed(id=2**90), "record 1.*64 bits"),
    ("an id of 300 characters", changed(id="x" * 300), "record 1.*1 to 256"),
    ("a caption that is a list", changed(caption=["a"]), "#2.*caption must be text"),
    ("a caption of a book", changed(caption="x" * 2_000_000), "#2.*2,000,000 characters"),
    ("a confidence of seven", changed(confidence=7), "#2.*between 0 and 1"),
    ("half an observation", changed(n_observations=1.5), "#2.*whole number"),
    ("a relation to nothing", b'[{"id":1,"tag":"a"},{"source":1,"target":9,"label":"on"}]', "no object or place #9"),
    (
        "a relation of no known origin",
        b'[{"id":1,"tag":"a"},{"source":1,"target":1,"label":"on","origin":"me"}]',
        "origin",
    ),
    ("a relation without a name", b'[{"id":1,"tag":"a"},{"source":1,"target":1,"label":" "}]', "label is empty"),
    (
        "something between the records",
        b'[{"id":1,"tag":"a"}, 7]',
        "record 1: must be an object with fields, not number",
    ),
    ("a nesting bomb", b"[" * 200_000 + b"]" * 200_000, "nested too deeply"),
    ("a nesting bomb of objects", b'{"a":' * 200_000 + b"1" + b"}" * 200_000, "nested too deeply"),
    ("a number without end", b'[{"id": ' + b"9" * 10_000 + b"}]", "more digits"),
    ("a bad line", b'{"id": 1, "tag": "a"}\n{"id": 2, "tag": }\n', "line 2: this is not whole JSON"),
    ("a line of another kind", b'{"id": 1, "tag": "a"}\n{"id": 2, "tag": "b"}\n[3]\n', "line 3: must be a JSON object"),
    ("two scenes in one", b'{"cgdb_scene": 99, "name": "x"}', "99"),
]


@pytest.mark.parametrize(("content", "message"), [row[1:] for row in TABLE], ids=[row[0] for row in TABLE])
def test_bad_files_are_told_in_one_line(tmp_path: Path, content: bytes, message: str) -> None:
    path = tmp_path / "strange map.json"
    path.write_bytes(content)
    with pytest.raises(CgdbError, match=message) as told:
        ingest.load(path, relate=False)
    line = told.value.message
    assert line.count("strange map.json") == 1
    assert "\n" not in line and len(line) < 600 and told.value.exit_code == 5
    line.encode("utf-8")


def test_every_error_of_an_unknown_kind_says_what_is_read(tmp_path: Path) -> None:
    path = tmp_path / "m.json"
    path.write_text("[1, 2]")
    with pytest.raises(FormatError) as told:
        ingest.load(path)
    assert told.value.hint is not None and all(name in told.value.hint for name in ingest.FORMATS)


def test_paths_that_are_no_maps(tmp_path: Path) -> None:
    with pytest.raises(FormatError, match=r"nowhere\.json: there is no such file"):
        ingest.load(tmp_path / "nowhere.json")
    (tmp_path / "empty").mkdir()
    with pytest.raises(FormatError, match="empty: this is a folder, which is no map"):
        ingest.load(tmp_path / "empty")
    (tmp_path / "notes").mkdir()
    (tmp_path / "notes" / "readme.txt").write_text("hello")
    with pytest.raises(FormatError, match="notes: this is a folder"):
        ingest.load(tmp_path / "notes")


def test_arguments_that_do_not_go_together(tmp_path: Path) -> None:
    path = tmp_path / "m.json"
    path.write_text(json.dumps([GOOD]))
    with pytest.raises(UsageError, match="no format 'jsn'") as told:
        ingest.load(path, format="jsn")
    assert told.value.hint == "did you mean 'json'?"
    with pytest.raises(UsageError, match="batch"):
        ingest.stream(path, batch=0)


@pytest.mark.parametrize("name", sorted(ingest.FORMATS))
@pytest.mark.parametrize("content", [b"[1, 2]", b"{}", b"[]", b"null", b'[{"id": 1}, 2]', b"\x80\x04]."])
def test_a_forced_format_refuses_what_is_of_another(tmp_path: Path, name: str, content: bytes) -> None:
    path = tmp_path / "m"
    path.write_bytes(content)
    try:
        ingest.load(path, format=name, relate=False)
    except CgdbError as error:
        assert "\n" not in error.message
    else:
        assert name in ("json", "jsonl", "conceptgraphs-planner", "conceptgraphs-main"), "nothing of a map was there"


@pytest.mark.skipif(sys.platform == "win32", reason="permissions differ")
def test_a_file_that_may_not_be_read(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = tmp_path / "m.json"
    path.write_text("[]")

    def refuse(*arguments: Any, **named: Any) -> Any:
        raise PermissionError(13, "Permission denied")

    monkeypatch.setattr(Path, "open", refuse)
    with pytest.raises(FormatError, match=r"m\.json: the file cannot be read: Permission denied"):
        ingest.load(path)


WEIRD: list[Any] = [
    None,
    True,
    -1,
    0,
    1.5,
    1e308,
    2**70,
    "",
    "x",
    "\ud800",
    "invalid",
    [],
    [None],
    [[]],
    {},
    {"a": {}},
    [1, 2, 3],
]


def mutate(rng: random.Random, value: Any) -> Any:
    """The value with one thing in it replaced, removed or renamed."""
    if isinstance(value, dict) and value and rng.random() < 0.9:
        key = rng.choice(list(value))
        rest = {k: v for k, v in value.items() if k != key}
        return rest if rng.random() < 0.15 else {**value, key: mutate(rng, value[key])}
    if isinstance(value, list) and value and rng.random() < 0.9:
        at = rng.randrange(len(value))
        return [*value[:at], mutate(rng, value[at]), *value[at + 1 :]]
    return rng.choice(WEIRD)


def samples() -> dict[str, Any]:
    box = {
        "type": "OBB",
        "dimensions": [1, 1, 1],
        "world_P_center": [0, 0, 0],
        "world_R_center": {"w": 1, "x": 0, "y": 0, "z": 0},
    }
    attributes = {
        "type": "ObjectNodeAttributes",
        "position": [0, 0, 0],
        "name": "O",
        "semantic_label": 1,
        "bounding_box": box,
    }
    return {
        "planner": [GOOD, {**GOOD, "id": 2, "possible_tags": ["a"]}],
        "plain": {
            "objects": [{**GOOD, "room": "r", "features": {"clip": [1, 2]}}],
            "relations": [{"source": 1, "target": 1, "label": "on"}],
        },
        "dsg": {
            "layer_ids": [2],
            "layer_names": {"OBJECTS": {"layer": 2, "partition": 0}},
            "metadata": {"labelspaces": {"_l2p0": [[1, "chair"]]}},
            "nodes": [{"id": 1, "layer": 2, "attributes": attributes}, {"id": 2, "layer": 4, "attributes": attributes}],
            "edges": [{"source": 1, "target": 2, "info": {}}],
        },
        "home": {
            "nodes": [
                {
                    "id": 1,
                    "class_name": "a",
                    "category": "Rooms",
                    "bounding_box": {"center": [0, 0, 0], "size": [1, 1, 1]},
                    "properties": ["A"],
                    "states": [],
                }
            ]
            * 1
            + [
                {
                    "id": 2,
                    "class_name": "b",
                    "category": "Props",
                    "bounding_box": None,
                    "properties": ["A"],
                    "states": ["ON"],
                }
            ],
            "edges": [{"from_id": 2, "to_id": 1, "relation_type": "INSIDE"}],
        },
        "ali": {
            "object_1": {
                "id": 1,
                "object_tag": "a",
                "object_caption": "b",
                "bbox_extent": [1, 1, 1],
                "bbox_center": [0, 0, 0],
            }
        },
    }


@pytest.mark.parametrize("name", sorted(samples()))
def test_one_wrong_thing_anywhere_gives_a_scene_or_one_line(tmp_path: Path, name: str) -> None:
    """No exception but ours for any value at any place; what is read has passed the check of a scene."""
    rng = random.Random(name)
    path = tmp_path / "m.json"
    good = samples()[name]
    path.write_text(json.dumps(good))
    ingest.load(path, relate=False)
    right = ingest.detect(path)
    started = time.perf_counter()
    for _ in range(400):
        bad = mutate(rng, good)
        path.write_text(json.dumps(bad))
        # Forced, because a wrong thing may hide what the file is from the one who looks.
        for forced in (None, right):
            try:
                ingest.load(path, format=forced, relate=False)
            except CgdbError as error:
                assert "\n" not in error.message
                error.message.encode("utf-8")
    assert time.perf_counter() - started < 60
