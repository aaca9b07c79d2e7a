"""Recordings on disk: every layout, and its pose convention."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from cgdb.errors import UsageError
from cgdb.ingest.frames import poses
from cgdb.ingest.frames.recording import LAYOUTS, open_recording
from cgdb.ingest.mapping.pixels import unproject
from tests.recordings import (
    MAKERS,
    TARGET,
    VGA,
    WALL,
    distance,
    middle,
    plain,
    wall,
)


@pytest.fixture(params=list(MAKERS))
def layout(request: pytest.FixtureRequest) -> str:
    return str(request.param)


def test_every_layout_has_a_test() -> None:
    assert set(MAKERS) == set(LAYOUTS)


def test_a_layout_is_found_by_its_files(layout: str, tmp_path: Path) -> None:
    MAKERS[layout](tmp_path)
    recording = open_recording(tmp_path)
    assert recording.layout == layout and len(recording.shots) == 3


def test_all_cameras_see_the_target_where_it_is(layout: str, tmp_path: Path) -> None:
    MAKERS[layout](tmp_path)
    recording = open_recording(tmp_path)
    frames = list(recording.frames())
    assert len(frames) == 3 and not recording.skipped
    for frame in frames:
        np.testing.assert_allclose(middle(frame), TARGET, atol=0.02)


def test_the_wall_is_where_it_is(layout: str, tmp_path: Path) -> None:
    """All that all cameras see lies on one plane of the world."""
    MAKERS[layout](tmp_path)
    recording = open_recording(tmp_path)
    for frame in recording.frames():
        seen = unproject(frame, np.flatnonzero(frame.depth.reshape(-1))[::97])
        assert len(seen) > 100
        np.testing.assert_allclose(seen[:, 1], WALL, atol=0.012)
        assert np.ptp(seen[:, 0]) > 1.0 and np.ptp(seen[:, 2]) > 1.0
    assert not recording.doubts


def test_right_is_right_in_every_layout(layout: str, tmp_path: Path) -> None:
    """No convention may mirror: what is to the right in the picture is to the right of the camera in the map."""
    MAKERS[layout](tmp_path)
    for frame in open_recording(tmp_path).frames():
        assert np.linalg.det(frame.T_world_camera[:3, :3]) == pytest.approx(1.0)
        height, width = frame.depth.shape
        left, right = unproject(frame, np.array([height // 2 * width + 10, height // 2 * width + width - 10]))
        assert (right - left) @ frame.T_world_camera[:3, 0] > 0


def test_frames_are_aligned_whatever_the_layout(layout: str, tmp_path: Path) -> None:
    MAKERS[layout](tmp_path)
    for number, frame in enumerate(open_recording(tmp_path).frames()):
        assert frame.rgb.shape == (*frame.depth.shape, 3) and frame.rgb.dtype == np.uint8
        assert frame.depth.dtype == np.float32 and frame.index == number
        assert frame.depth[frame.depth.shape[0] // 2].mean() == pytest.approx(distance(number), rel=0.1)


def test_a_range_a_stride_and_a_size(tmp_path: Path) -> None:
    plain(tmp_path)
    recording = open_recording(tmp_path)
    assert [frame.index for frame in recording.frames(start=1)] == [1, 2]
    assert [frame.index for frame in recording.frames(stride=2)] == [0, 2]
    small = next(recording.frames(size=(320, 240)))
    assert small.depth.shape == (240, 320) and small.K[0, 0] == 250.0
    np.testing.assert_allclose(middle(small), TARGET, atol=0.02)
    with pytest.raises(UsageError, match="none of them"):
        list(recording.frames(start=9))
    with pytest.raises(UsageError, match="stride"):
        list(recording.frames(stride=0))


def test_one_frame_is_a_recording(tmp_path: Path) -> None:
    plain(tmp_path)
    assert len(list(open_recording(tmp_path).frames(end=1))) == 1


def test_given_intrinsics_and_scale_come_first(tmp_path: Path) -> None:
    plain(tmp_path)
    recording = open_recording(tmp_path, lens=poses.intrinsics(400, 400, 320, 240), depth_scale=500.0)
    frame = next(recording.frames())
    assert frame.K[0, 0] == 400 and frame.depth[0, 0] == pytest.approx(2 * wall(0, VGA, (640, 480))[0, 0], abs=0.01)


def test_the_real_frames(data: Path) -> None:
    recording = open_recording(data / "rgbd" / "RGBD")
    frames = list(recording.frames())
    assert recording.layout == "redwood" and len(frames) == 5 and recording.up == "y"
    assert recording.K[0, 0] == 525.0
    # The same corner of the room in the first and last frame: the clouds must lie on each other.
    from cgdb.ingest.evaluation.nearest import nearest

    one, two = (unproject(f, np.flatnonzero(f.depth.reshape(-1) > 0)[::37]) for f in (frames[0], frames[-1]))
    distance_m, _ = nearest(one, two, 0.2)
    assert np.median(distance_m) < 0.05
