"""The texts of a scene: collected, kept in one file, refused when damaged."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
import pytest

from cgdb.errors import CorruptionError
from cgdb.meaning.knowledge import knowledge
from cgdb.meaning.texts import Source, TextIndex, texts_of


@dataclass(frozen=True, kw_only=True)
class Node:
    key: int
    label: str = "Object"
    tag: str | None = None
    tags: tuple[str, ...] = ()
    caption: str | None = None
    properties: Mapping[str, object] = field(default_factory=dict)


NODES = [
    Node(key=5, tag="lamp", caption="This is a red lamp above the end table.", tags=("lamp", "lampshade")),
    Node(key=2, tag="chair", properties={"material": "oak", "affordances": ("SIT_ON", "GRABBABLE"), "mass": 3.5}),
    Node(key=9, label="Room", tag="kitchen"),
    Node(key=11),
]


def names_of(index: TextIndex, row: int) -> set[str]:
    facts = index.facts
    return {knowledge().names[i] for i in facts.thing_ids[facts.thing_rows == row].tolist()}


def test_sources() -> None:
    assert texts_of(NODES[0]) == [
        (Source.NAME, "lamp"),
        (Source.HEAD, "red lamp"),
        (Source.CAPTION, "This is a red lamp above the end table."),
        (Source.TAGS, "lampshade"),
    ]
    assert (Source.PROPERTY, "sit on") in texts_of(NODES[1])
    assert (Source.QUALITY, "oak") in texts_of(NODES[1])
    assert texts_of(NODES[2]) == [(Source.NAME, "kitchen"), (Source.NAME, "Room")]
    assert texts_of(NODES[3]) == []


def test_keys_ascend_and_texts_are_kept_once() -> None:
    index = TextIndex.build([*NODES, Node(key=7, tag="chair")])
    assert index.keys.tolist() == [2, 5, 7, 9, 11]
    assert len(index.texts) == len(set(index.texts))
    assert index.texts_of_row(2) == [(Source.NAME, "chair")]
    assert index.texts_of_row(4) == []


def test_names_come_first_and_possible_tags_want_no_vector() -> None:
    index = TextIndex.build(NODES)
    assert set(index.texts[: index.n_names]) == {"chair", "lamp", "red lamp", "kitchen", "Room"}
    assert "lampshade" in index.texts[index.n_encoded :]


def test_facts() -> None:
    index = TextIndex.build(NODES)
    assert names_of(index, 0) == {"chair"}
    assert names_of(index, 1) == {"lamp"}
    red = 1 << knowledge().traits.index("red")
    assert [bool(int(mask) & red) for mask in index.facts.stated] == [False, True, False, False]


def test_file_round_trip(tmp_path: Path) -> None:
    index = TextIndex.build(NODES)
    index.save(tmp_path / "t.npz")
    again = TextIndex.open(tmp_path / "t.npz")
    assert again.texts == index.texts
    assert (again.n_names, again.n_encoded) == (index.n_names, index.n_encoded)
    for name in ("keys", "indptr", "text_ids", "sources"):
        assert np.array_equal(getattr(again, name), getattr(index, name))
    assert np.array_equal(again.facts.stated, index.facts.stated)
    assert np.array_equal(again.words.degrees("a red lamp"), index.words.degrees("a red lamp"))


def test_building_is_deterministic(tmp_path: Path) -> None:
    for name, nodes in (("a", NODES), ("b", NODES[::-1])):
        TextIndex.build(nodes).save(tmp_path / name)
    with np.load(tmp_path / "a") as a, np.load(tmp_path / "b") as b:
        assert set(a) == set(b)
        assert all(np.array_equal(a[name], b[name]) for name in a)


def test_empty_scene(tmp_path: Path) -> None:
    index = TextIndex.build([])
    index.save(tmp_path / "t.npz")
    assert TextIndex.open(tmp_path / "t.npz").keys.shape == (0,)


def test_damaged_files_are_refused(tmp_path: Path) -> None:
    path = tmp_path / "t.npz"
    TextIndex.build(NODES).save(path)
    whole = path.read_bytes()
    for damaged in (b"", b"PK", whole[: len(whole) // 2], b"\x80\x04K\x01."):
        path.write_bytes(damaged)
        with pytest.raises(CorruptionError, match="text index"):
            TextIndex.open(path)
    with pytest.raises(FileNotFoundError):
        TextIndex.open(tmp_path / "none.npz")


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("format", np.asarray([999])),
        ("knowledge", np.frombuffer(b"old\x00", dtype=np.uint8)),
        ("keys", np.asarray([9, 5, 2, 1])),
        ("text_ids", np.asarray([10_000] * 30, dtype=np.int32)),
        ("thing_ids", np.asarray([10_000, 0, 0], dtype=np.int32)),
        ("stated", np.zeros(1, dtype=np.uint64)),
        ("n_encoded", np.asarray([1, 10_000])),
        ("texts", np.asarray([{"a": 1}], dtype=object)),
    ],
)
def test_arrays_that_do_not_fit_are_refused(tmp_path: Path, name: str, value: np.ndarray) -> None:
    path = tmp_path / "t.npz"
    TextIndex.build(NODES).save(path)
    with np.load(path) as arrays:
        changed = {key: arrays[key] for key in arrays}
    changed[name] = value
    np.savez(path, **changed)
    with pytest.raises(CorruptionError, match="cannot be read"):
        TextIndex.open(path)
