"""Recordings whose depth is packed: Record3D archives and EXR pictures."""

from __future__ import annotations

import json
import re
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from cgdb.errors import FormatError, MissingExtraError
from cgdb.ingest.frames.recording import open_recording
from tests.recordings import (
    PHONE,
    TARGET,
    VGA,
    metadata,
    middle,
    plain,
    r3d_file,
    r3d_parts,
    wall,
    write_exr,
    write_pictures,
)


def test_a_record3d_archive_as_it_is(tmp_path: Path) -> None:
    path = r3d_file(tmp_path / "scan.r3d", r3d_parts())
    recording = open_recording(path)
    assert recording.layout == "r3d" and recording.up == "-y"
    frames = list(recording.frames())
    assert [frame.timestamp for frame in frames] == [0.0, 1.0, 2.0] and frames[0].depth.shape == (256, 192)
    for frame in frames:
        np.testing.assert_allclose(middle(frame), TARGET, atol=0.02)
    large = next(recording.frames(size=(720, 960)))
    assert large.depth.shape == (960, 720) and large.K[0, 0] == 800.5


def test_depth_of_which_the_phone_is_not_sure_is_left_out(tmp_path: Path) -> None:
    lzfse = pytest.importorskip("lzfse")
    sure = np.full((256, 192), 2, np.uint8)
    sure[:100], sure[100:120] = 0, 1
    path = r3d_file(tmp_path / "scan.r3d", {**r3d_parts(), "rgbd/1.conf": lzfse.compress(sure.tobytes())})
    first, second, _ = open_recording(path).frames()
    assert (first.depth > 0).all()
    np.testing.assert_array_equal(second.depth > 0, sure == 2)


def test_what_an_archive_says_of_each_frame_comes_first(tmp_path: Path) -> None:
    about = metadata()
    about["perFrameIntrinsicCoeffs"] = [[800.5, 800.5, 359.5, 479.5], [900.0, 900.0, 359.5, 479.5], [1.0, 1.0, 0, 0]]
    del about["dw"], about["dh"]  # old versions do not say; the proportions do
    path = r3d_file(tmp_path / "scan.r3d", {**r3d_parts(), "metadata": json.dumps(about).encode()})
    recording = open_recording(path)
    frames = list(recording.frames(size=(720, 960)))
    assert [frame.K[0, 0] for frame in frames] == [800.5, 900.0]
    assert list(recording.skipped.values()) == [1] and "do not fit" in next(iter(recording.skipped))
    given = open_recording(path, lens=PHONE)
    assert len(list(given.frames())) == 3


def test_depth_as_exr(tmp_path: Path) -> None:
    """Record3D's export, and the plain layout, with whatever the channel is called."""
    (tmp_path / "scan").mkdir()
    (tmp_path / "scan/metadata.json").write_text(json.dumps(metadata()))
    for n in range(3):
        files = tmp_path / f"scan/rgb/{n}.jpg", tmp_path / f"scan/depth/{n}.exr"
        write_pictures(*files, n, scale=1, lens=PHONE, size=(720, 960))
    recording = open_recording(tmp_path / "scan")
    assert recording.layout == "r3d"
    for frame in recording.frames():
        np.testing.assert_allclose(middle(frame), TARGET, atol=0.005)
    plain(tmp_path / "own")
    for n, channel in enumerate(("R", "distance", "Y")):
        (tmp_path / f"own/depth/{n}.png").unlink()
        write_exr(tmp_path / f"own/depth/{n}.exr", wall(n, VGA, (640, 480)) * 1000, channel)
    for frame in open_recording(tmp_path / "own").frames():
        np.testing.assert_allclose(middle(frame), TARGET, atol=0.005)


def test_a_wrong_exr_is_one_bad_frame(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    openexr = pytest.importorskip("OpenEXR")
    plain(tmp_path)
    for n in range(3):
        (tmp_path / f"depth/{n}.png").unlink()
        write_exr(tmp_path / f"depth/{n}.exr", wall(n, VGA, (640, 480)) * 1000)
    cut = tmp_path / "depth/0.exr"
    cut.write_bytes(cut.read_bytes()[:-500])
    two = {name: np.ones((480, 640), np.float32) for name in ("normal.x", "normal.y")}
    with openexr.File({"compression": openexr.ZIP_COMPRESSION, "type": openexr.scanlineimage}, two) as file:
        file.write(str(tmp_path / "depth/2.exr"))
    recording = open_recording(tmp_path)
    assert [frame.index for frame in recording.frames()] == [1]
    assert sum(recording.skipped.values()) == 2
    assert capsys.readouterr().out == ""


Parts = dict[str, bytes]


def spoil_bomb(parts: Parts) -> None:
    parts["rgbd/1.depth"] = pytest.importorskip("lzfse").compress(bytes(2_000_000))


def spoil_lying_bomb(parts: Parts) -> None:
    """Blocks whose heads say that together they unfold to what is expected."""
    block = bytearray(pytest.importorskip("lzfse").compress(bytes(2_000_000))[:-4])
    assert block.count(b"bvx2") == 1
    block[4:8] = bytes(4)
    first = block[:4] + (4 * 192 * 256).to_bytes(4, "little") + block[8:]
    parts["rgbd/1.depth"] = bytes(first) + 500 * bytes(block) + b"bvx$"


def spoil_few_lying_blocks(parts: Parts) -> None:
    """As many blocks as honest data may have, each of which unfolds to ten times all that is expected."""
    block = bytearray(pytest.importorskip("lzfse").compress(bytes(2_000_000))[:-4])
    block[4:8] = (4 * 192 * 256 // 12).to_bytes(4, "little")
    parts["rgbd/1.depth"] = 12 * bytes(block) + b"bvx$"


def spoil_cut_depth(parts: Parts) -> None:
    parts["rgbd/1.depth"] = parts["rgbd/1.depth"][:1000]


def spoil_not_lzfse(parts: Parts) -> None:
    parts["rgbd/1.depth"] = b"depth" * 100


def spoil_flipped_depth(parts: Parts) -> None:
    broken = bytearray(parts["rgbd/1.depth"])
    broken[40:60] = bytes(20)
    parts["rgbd/1.depth"] = bytes(broken)


def spoil_archived_color(parts: Parts) -> None:
    parts["rgbd/1.jpg"] = parts["rgbd/1.jpg"][:300]


def spoil_no_depth(parts: Parts) -> None:
    del parts["rgbd/1.depth"]


def spoil_large_part(parts: Parts) -> None:
    parts["rgbd/1.jpg"] = bytes(65 << 20)


@pytest.mark.parametrize(
    ("spoil", "says"),
    [
        (spoil_bomb, "2,000,000 bytes in"),
        (spoil_lying_bomb, "blocks where 196,608"),
        (spoil_few_lying_blocks, "unfolds to more where 196,608"),
        (spoil_cut_depth, "cut off"),
        (spoil_not_lzfse, "not compressed by LZFSE"),
        (spoil_flipped_depth, "unfolds|damaged|cut off"),
        (spoil_archived_color, "no picture|damaged"),
        (spoil_no_depth, "not there"),
        (spoil_large_part, "more than"),
    ],
)
def test_a_bad_frame_of_an_archive(spoil: Callable[[Parts], None], says: str, tmp_path: Path) -> None:
    parts = r3d_parts()
    spoil(parts)
    recording = open_recording(r3d_file(tmp_path / "scan.r3d", parts))
    assert [frame.index for frame in recording.frames()] == [0, 2]
    ((reason, count),) = recording.skipped.items()
    assert count == 1 and re.search(says, reason), reason


@pytest.mark.parametrize(
    ("change", "says"),
    [
        ({"poses": []}, "no poses"),
        ({"poses": [[0, 0, 0, 1]]}, "rows of 7 numbers"),
        ({"poses": [["0"] * 7]}, "rows of 7 numbers"),
        ({"K": [1, 2, 3]}, "list of 9 numbers"),
        ({"K": [10**400] + [0] * 8}, "list of 9 numbers"),
        ({"w": "wide"}, "number of pixels"),
        ({"dw": 10**9}, "number of pixels"),
        ({"K": [80.0, 0, 0, 0, 80.0, 0, 36, 48, 1]}, "do not fit"),
    ],
)
def test_an_archive_whose_metadata_is_wrong(change: dict[str, Any], says: str, tmp_path: Path) -> None:
    about = json.dumps({**metadata(), **change}).encode()
    with pytest.raises(FormatError, match=says):
        open_recording(r3d_file(tmp_path / "scan.r3d", {**r3d_parts(), "metadata": about}))


def test_what_is_no_archive(tmp_path: Path) -> None:
    path = tmp_path / "scan.r3d"
    path.write_bytes(b"PK\x03\x04 nothing")
    with pytest.raises(FormatError, match=r"scan\.r3d"):
        open_recording(path)
    with pytest.raises(FormatError, match="is not there"):
        open_recording(r3d_file(path, {"other": b""}))
    whole = r3d_file(path, r3d_parts()).read_bytes()
    path.write_bytes(whole[: len(whole) // 2])
    with pytest.raises(FormatError, match="damaged, or no archive"):
        open_recording(path)
    (tmp_path / "notes.txt").write_text("hello")
    with pytest.raises(FormatError, match="no recording of a known layout"):
        open_recording(tmp_path / "notes.txt")


def test_without_the_package_the_pip_line_is_said(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = r3d_file(tmp_path / "scan.r3d", r3d_parts())
    monkeypatch.setitem(sys.modules, "lzfse", None)
    with pytest.raises(MissingExtraError) as raised:
        list(open_recording(path).frames())
    assert raised.value.hint == "pip install 'cgdb[record3d]'"
    plain(tmp_path / "own")
    write_exr(tmp_path / "own/depth/0.exr", wall(0, VGA, (640, 480)))
    (tmp_path / "own/depth/0.png").unlink()
    monkeypatch.setitem(sys.modules, "OpenEXR", None)
    with pytest.raises(MissingExtraError):
        list(open_recording(tmp_path / "own").frames())
