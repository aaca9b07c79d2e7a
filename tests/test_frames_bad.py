"""Recordings with something wrong: one bad frame is skipped, a bad recording is refused."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from cgdb.errors import FormatError, UsageError
from cgdb.ingest.frames import poses
from cgdb.ingest.frames.recording import open_recording
from tests.recordings import (
    TARGET,
    Image,
    ai2thor,
    hm3d,
    middle,
    plain,
    pose_of,
    redwood,
    replica,
    tum,
    write_pictures,
)

# -- one bad frame


def spoil_truncated(root: Path) -> None:
    path = root / "depth/1.png"
    path.write_bytes(path.read_bytes()[:60])


def spoil_color(root: Path) -> None:
    (root / "rgb/1.png").write_bytes(b"no picture")


def spoil_missing_depth(root: Path) -> None:
    (root / "depth/1.png").unlink()


def spoil_missing_pose(root: Path) -> None:
    (root / "pose/1.txt").unlink()


def spoil_infinite_pose(root: Path) -> None:
    (root / "pose/1.txt").write_text("-inf " * 16)


def spoil_skewed_pose(root: Path) -> None:
    pose = pose_of(1)
    pose[0, 0] += 0.4
    np.savetxt(root / "pose/1.txt", pose)


def spoil_mirrored_pose(root: Path) -> None:
    np.savetxt(root / "pose/1.txt", pose_of(1) @ np.diag([1.0, -1.0, 1.0, 1.0]))


def spoil_words_for_a_pose(root: Path) -> None:
    (root / "pose/1.txt").write_text("lost")


def spoil_empty_depth(root: Path) -> None:
    write_pictures(root / "rgb/1.png", root / "depth/1.png", 1, scale=1000, value=0.0)


def spoil_shape(root: Path) -> None:
    write_pictures(root / "rgb/1.png", root / "depth/1.png", 1, scale=1000, size=(640, 300))


def spoil_color_of_another_shape(root: Path) -> None:
    Image.fromarray(np.zeros((480, 480, 3), np.uint8)).save(root / "rgb/1.png")


def spoil_scale(root: Path) -> None:
    write_pictures(root / "rgb/1.png", root / "depth/1.png", 1, scale=1000, value=60.0)


def spoil_array_that_lies(root: Path) -> None:
    """A header that announces eighty gigabytes."""
    (root / "depth/1.png").unlink()
    header = "{'descr': '<f8', 'fortran_order': False, 'shape': (100000, 100000), }".ljust(117) + "\n"
    (root / "depth/1.npy").write_bytes(b"\x93NUMPY\x01\x00v\x00" + header.encode())


def spoil_array_of_objects(root: Path) -> None:
    (root / "depth/1.png").unlink()
    np.save(root / "depth/1.npy", np.array([{}] * 4, object))


def spoil_pose_of_another_number(root: Path) -> None:
    (root / "pose/1.txt").rename(root / "pose/one.txt")


def spoil_depth_channels(root: Path) -> None:
    Image.fromarray(np.zeros((480, 640, 3), np.uint8)).save(root / "depth/1.png")


@pytest.mark.parametrize(
    ("spoil", "says"),
    [
        (spoil_truncated, "damaged"),
        (spoil_color, "no picture"),
        (spoil_missing_depth, "depth is damaged or none"),
        (spoil_missing_pose, "no pose"),
        (spoil_infinite_pose, "infinite"),
        (spoil_skewed_pose, "no rotation"),
        (spoil_mirrored_pose, "mirrors"),
        (spoil_words_for_a_pose, "no matrix"),
        (spoil_empty_depth, "all but empty"),
        (spoil_shape, "another resolution"),
        (spoil_depth_channels, "depth is damaged or none"),
        (spoil_color_of_another_shape, "differ in shape"),
        (spoil_scale, "wrong scale"),
        (spoil_array_that_lies, "depth is damaged or none"),
        (spoil_array_of_objects, "depth is damaged or none"),
        (spoil_pose_of_another_number, "no pose"),
    ],
)
def test_a_bad_frame_is_skipped_and_counted(spoil: Callable[[Path], None], says: str, tmp_path: Path) -> None:
    plain(tmp_path)
    spoil(tmp_path)
    recording = open_recording(tmp_path)
    assert [frame.index for frame in recording.frames()] == [0, 2]
    ((reason, count),) = recording.skipped.items()
    assert says in reason and count == 1


def test_depth_that_is_not_finite_is_unknown(tmp_path: Path) -> None:
    hm3d(tmp_path)
    depth = np.full((512, 512), 2.0, np.float32)
    depth[0], depth[1], depth[2] = np.nan, np.inf, -1.0
    np.save(tmp_path / "000_depth.npy", depth)
    frame = next(open_recording(tmp_path).frames())
    assert (frame.depth[:3] == 0).all() and (frame.depth[3:] == 2).all()


def test_files_of_one_frame_find_each_other(tmp_path: Path) -> None:
    """By name where names are the same, though another file has the same number; and names may hold any character."""
    plain(tmp_path)
    for kind, ending in (("rgb", "png"), ("depth", "png"), ("pose", "txt")):
        (tmp_path / f"{kind}/1.{ending}").rename(tmp_path / f"{kind}/left_0.{ending}")
        (tmp_path / f"{kind}/2.{ending}").rename(tmp_path / f"{kind}/m².{ending}")
    frames = {frame.name: frame for frame in open_recording(tmp_path).frames()}
    assert set(frames) == {"0", "left_0", "m²"}
    for frame in frames.values():
        np.testing.assert_allclose(middle(frame), TARGET, atol=0.02)
    # Which of the two poses of number 0 belongs to this one cannot be known.
    (tmp_path / "rgb/0.png").rename(tmp_path / "rgb/right_0.png")
    recording = open_recording(tmp_path)
    assert len(list(recording.frames())) == 2 and recording.skipped["no pose"] == 1


def test_what_looks_odd_is_said(tmp_path: Path) -> None:
    plain(tmp_path)
    recording = open_recording(tmp_path, lens=poses.intrinsics(500.0, 900.0, 210.0, 239.5), depth_scale=170.0)
    assert len(list(recording.frames())) == 3
    told = dict(recording.doubts)
    assert len(told) == 3 and sorted(told.values()) == [1, 1, 3]
    assert any("depth scale" in text for text in told) and any("33% and 50%" in text for text in told)


def test_a_layout_without_a_size_has_its_intrinsics_checked_too(tmp_path: Path) -> None:
    ai2thor(tmp_path)
    np.savetxt(tmp_path / "intrinsics.txt", poses.intrinsics(2400.0, 2400.0, 1599.5, 1199.5))
    (tmp_path / "color/0.png").write_bytes(b"")  # the next picture tells
    with pytest.raises(FormatError, match="do not fit pictures of 640 x 480"):
        open_recording(tmp_path)


# -- a bad recording


def test_a_bad_recording_is_refused(tmp_path: Path) -> None:
    with pytest.raises(FormatError, match="no such recording"):
        open_recording(tmp_path / "nowhere")
    with pytest.raises(FormatError, match="no recording of a known layout"):
        open_recording(tmp_path)
    with pytest.raises(UsageError, match="no layout 'replika'") as raised:
        open_recording(tmp_path, layout="replika")
    assert raised.value.hint is not None and "replica" in raised.value.hint


def test_intrinsics_of_another_resolution_are_refused(tmp_path: Path) -> None:
    plain(tmp_path)
    meta = json.loads((tmp_path / "meta.json").read_text())
    (tmp_path / "meta.json").write_text(json.dumps({**meta, "fx": 1200, "cx": 960.0}))
    with pytest.raises(FormatError, match="do not fit pictures of 640 x 480"):
        open_recording(tmp_path)
    (tmp_path / "meta.json").write_text(json.dumps({**meta, "fx": "wide"}))
    with pytest.raises(FormatError, match="'fx' must be a number"):
        open_recording(tmp_path)
    (tmp_path / "meta.json").write_text("{")
    with pytest.raises(FormatError):
        open_recording(tmp_path)


def test_a_wrong_scale_is_refused(tmp_path: Path) -> None:
    plain(tmp_path)
    with pytest.raises(FormatError, match="wrong scale"):
        list(open_recording(tmp_path, depth_scale=1e6).frames())
    with pytest.raises(FormatError, match="above 0"):
        open_recording(tmp_path, depth_scale=-1.0)


def test_counts_that_differ_are_refused(tmp_path: Path) -> None:
    replica(tmp_path)
    (tmp_path / "results/frame000002.jpg").unlink()
    with pytest.raises(FormatError, match="2 colour pictures but 3 poses"):
        open_recording(tmp_path)


def test_a_recording_without_good_frames_is_refused(tmp_path: Path) -> None:
    plain(tmp_path)
    for n in range(3):
        (tmp_path / f"pose/{n}.txt").unlink()
    with pytest.raises(FormatError, match="3 of the first 3 frames cannot be used"):
        list(open_recording(tmp_path).frames())


def test_a_trajectory_that_is_cut_off(tmp_path: Path) -> None:
    redwood(tmp_path)
    log = tmp_path / "trajectory.log"
    log.write_text("\n".join(log.read_text().splitlines()[:-2]))
    with pytest.raises(FormatError, match="no multiple of five"):
        open_recording(tmp_path)


def test_a_list_may_not_leave_the_recording(tmp_path: Path) -> None:
    tum(tmp_path)
    (tmp_path / "rgb.txt").write_text("0.0 ../../secret.png\n")
    with pytest.raises(FormatError, match="within the recording"):
        open_recording(tmp_path)
