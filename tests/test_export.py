"""Exporting: the format is the one asked for, and the file is whole or not there."""

from __future__ import annotations

import errno
import json
import os
import stat
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import cgdb.export as exporting
from cgdb.errors import ExportError, UsageError
from cgdb.export import EXPORTERS, Document, document, dumps, export, format_of
from cgdb.ingest import scene_json
from cgdb.scene import SceneGraph, SceneObject

SCENE = SceneGraph(name="s", objects=(SceneObject(id=1, tag="cup", caption="a blue cup", center=np.zeros(3)),))


@pytest.mark.parametrize(
    ("name", "format"),
    [
        ("lab.json", "cgdb"),
        ("lab.planner.json", "planner"),
        ("LAB.PLANNER.JSON", "planner"),
        ("lab.node-link.json", "node-link"),
        ("lab.graphml", "graphml"),
    ],
)
def test_the_suffix_says_the_format(tmp_path: Path, name: str, format: str) -> None:
    assert format_of(Path(name)) == format
    done = export(SCENE, tmp_path / name)
    assert done.format == format
    assert (tmp_path / name).read_text(encoding="utf-8") == dumps(SCENE, format)
    assert done.n_bytes == (tmp_path / name).stat().st_size


def test_the_format_given_wins_over_the_suffix(tmp_path: Path) -> None:
    export(SCENE, str(tmp_path / "lab.txt"), "cgdb")
    assert scene_json.read(tmp_path / "lab.txt", None).objects[0].tag == "cup"


def test_an_unknown_suffix_lists_the_formats() -> None:
    with pytest.raises(ExportError) as caught:
        format_of(Path("lab.xlsx"))
    assert all(name in str(caught.value.hint) for name in (*EXPORTERS, ".graphml", ".planner.json"))


def test_an_unknown_format_has_a_hint() -> None:
    with pytest.raises(ExportError) as caught:
        dumps(SCENE, "graphlm")
    assert caught.value.hint == "did you mean 'graphml'?"
    with pytest.raises(ExportError) as caught:
        dumps(SCENE, "xyz")
    assert "'cgdb', 'planner', 'node-link', 'graphml', 'ply', 'glb', 'rerun'" in str(caught.value.hint)


def test_an_unknown_option_has_a_hint() -> None:
    with pytest.raises(UsageError) as caught:
        dumps(SCENE, "planner", decimal=2)
    assert caught.value.hint == "did you mean 'decimals'?"
    with pytest.raises(UsageError, match="has no option 'decimals'"):
        dumps(SCENE, "cgdb", decimals=2)


def test_writing_again_gives_the_same_bytes_and_leaves_nothing_else(tmp_path: Path) -> None:
    path = tmp_path / "lab.json"
    export(SCENE, path)
    first = path.read_bytes()
    export(SCENE, path)
    assert path.read_bytes() == first
    assert list(tmp_path.iterdir()) == [path]


def test_permissions_of_a_replaced_file_stay(tmp_path: Path) -> None:
    path = tmp_path / "lab.json"
    path.write_text("old")
    path.chmod(0o640)
    export(SCENE, path)
    assert stat.S_IMODE(path.stat().st_mode) == 0o640


def test_a_link_stays_a_link(tmp_path: Path) -> None:
    (tmp_path / "real").mkdir()
    link = tmp_path / "lab.json"
    link.symlink_to(tmp_path / "real" / "lab.json")
    export(SCENE, link)
    assert link.is_symlink()
    assert scene_json.read(tmp_path / "real" / "lab.json", None).name == "s"


def failing(error: BaseException) -> Any:
    def exporter(scene: SceneGraph) -> Document:
        def pieces() -> Iterator[str]:
            yield "half of "
            raise error

        return Document(pieces=pieces())

    return exporter


@pytest.mark.parametrize(
    ("error", "seen"),
    [
        (OSError(errno.ENOSPC, os.strerror(errno.ENOSPC)), ExportError),
        (ExportError("no"), ExportError),
        (KeyboardInterrupt(), KeyboardInterrupt),
        (MemoryError(), MemoryError),
    ],
    ids=["disk full", "bad scene", "ctrl-c", "memory"],
)
def test_a_failure_halfway_leaves_the_old_file(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, error: BaseException, seen: type[BaseException]
) -> None:
    path = tmp_path / "lab.json"
    path.write_text("old")
    monkeypatch.setitem(exporting.EXPORTERS, "cgdb", failing(error))
    with pytest.raises(seen):
        export(SCENE, path)
    assert path.read_text() == "old"
    assert list(tmp_path.iterdir()) == [path]


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="this system has no /dev/full")
def test_a_full_disk_is_one_clear_error(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The operating system's own refusal: the temporary file is the device that is always full."""

    def full_open(self: Path, mode: str = "r", *args: Any, **kwargs: Any) -> Any:
        if mode == "xb":
            return original(Path("/dev/full"), "wb")
        return original(self, mode, *args, **kwargs)

    original = Path.open
    monkeypatch.setattr(Path, "open", full_open)
    with pytest.raises(ExportError, match="No space left on device"):
        export(SCENE, tmp_path / "lab.json")
    assert list(tmp_path.iterdir()) == []


def test_folders_that_are_not_there(tmp_path: Path) -> None:
    with pytest.raises(ExportError, match="there is no folder") as caught:
        export(SCENE, tmp_path / "none" / "lab.json")
    assert caught.value.hint == "make it first"


def test_a_folder_is_not_overwritten(tmp_path: Path) -> None:
    (tmp_path / "lab.json").mkdir()
    with pytest.raises(ExportError, match="is a folder"):
        export(SCENE, tmp_path / "lab.json")


def test_a_device_is_not_replaced(tmp_path: Path) -> None:
    (tmp_path / "lab.json").symlink_to("/dev/null")
    with pytest.raises(ExportError, match="no regular file"):
        export(SCENE, tmp_path / "lab.json")
    assert Path("/dev/null").is_char_device()


@pytest.mark.skipif(os.name != "posix" or os.geteuid() == 0, reason="root may write everywhere")
def test_a_folder_that_may_not_be_written(tmp_path: Path) -> None:
    tmp_path.chmod(0o500)
    with pytest.raises(ExportError, match="Permission denied"):
        export(SCENE, tmp_path / "lab.json")


@pytest.mark.parametrize("name", ["nul\0.json", "x" * 300 + ".json"], ids=["NUL", "too long"])
def test_names_that_no_file_can_have(tmp_path: Path, name: str) -> None:
    with pytest.raises(ExportError):
        export(SCENE, tmp_path / name)
    assert list(tmp_path.iterdir()) == []


TEXTS = ("cgdb", "planner", "node-link", "graphml")


@pytest.mark.parametrize("format", TEXTS)
def test_every_format_writes_an_empty_scene_and_the_same_text_twice(format: str) -> None:
    empty = SceneGraph(name="empty")
    assert dumps(empty, format) == dumps(empty, format) != ""
    assert document(empty, format).notes == ()
    if format != "graphml":
        json.loads(dumps(empty, format))


def test_a_binary_format_has_no_text() -> None:
    assert set(EXPORTERS) - set(TEXTS) == {"ply", "glb", "rerun"}
    with pytest.raises(ExportError, match="'ply' is binary"):
        dumps(SCENE, "ply")
    assert b"".join(document(SCENE, "ply").data or ()).startswith(b"ply\n")
