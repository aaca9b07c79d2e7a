"""Recordings on disk: every layout, its pose convention, and what is wrong with strangers' recordings."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from cgdb.errors import FormatError, UsageError
from cgdb.ingest.frames import poses
from cgdb.ingest.frames.recording import LAYOUTS, Frame, open_recording
from cgdb.ingest.mapping.lift import unproject
from tests.mapping_rooms import looking

Image = pytest.importorskip("PIL.Image")

EYES = [(0.4 * i, -1.0 - 0.1 * i, 1.4) for i in range(3)]
TARGET = (0.3, 2.0, 0.5)
"""What the middle of every picture shows, in a right-handed world with z up."""
Pose = NDArray[np.float64]
OPENGL = np.diag([1.0, -1.0, -1.0, 1.0])


def pose_of(number: int) -> Pose:
    return looking(EYES[number], TARGET)


def distance(number: int) -> float:
    return float(np.linalg.norm(np.subtract(TARGET, EYES[number])))


def write_pictures(
    color: Path,
    depth: Path,
    number: int,
    *,
    scale: float,
    size: tuple[int, int] = (640, 480),
    value: float | None = None,
) -> None:
    """A grey picture, and a depth picture that says everywhere how far the target is."""
    color.parent.mkdir(parents=True, exist_ok=True)
    depth.parent.mkdir(parents=True, exist_ok=True)
    Image.fromarray(np.full((size[1], size[0], 3), 40 * number, np.uint8)).save(color)
    metres = distance(number) if value is None else value
    if depth.suffix == ".npy":
        np.save(depth, np.full((size[1], size[0], 1), metres, np.float32))
    else:
        Image.fromarray(np.full((size[1], size[0]), round(metres * scale), np.uint16)).save(depth)


def plain(root: Path) -> None:
    meta = {"width": 640, "height": 480, "fx": 500.0, "fy": 500.0, "cx": 319.5, "cy": 239.5, "depth_scale": 1000.0}
    root.mkdir(parents=True, exist_ok=True)
    (root / "meta.json").write_text(json.dumps(meta))
    (root / "pose").mkdir()
    for n in range(3):
        write_pictures(root / f"rgb/{n}.png", root / f"depth/{n}.png", n, scale=1000)
        np.savetxt(root / f"pose/{n}.txt", pose_of(n))


def replica(root: Path) -> None:
    for n in range(3):
        write_pictures(
            root / f"results/frame{n:06}.jpg", root / f"results/depth{n:06}.png", n, scale=6553.5, size=(1200, 680)
        )
    np.savetxt(root / "traj.txt", [pose_of(n).reshape(-1) for n in range(3)])


def scannet(root: Path) -> None:
    (root / "intrinsic").mkdir(parents=True)
    (root / "pose").mkdir()
    lens = np.eye(4)
    lens[:3, :3] = poses.intrinsics(1170.0, 1170.0, 647.5, 483.5)
    np.savetxt(root / "intrinsic/intrinsic_color.txt", lens)
    for n in range(3):
        write_pictures(root / f"color/{n}.jpg", root / f"depth/{n}.png", n, scale=1000)
        Image.fromarray(np.full((968, 1296, 3), 40 * n, np.uint8)).save(root / f"color/{n}.jpg")
        np.savetxt(root / f"pose/{n}.txt", pose_of(n))


def ai2thor(root: Path) -> None:
    # What Unity would say of the same camera: its world is ours with y and z exchanged, its camera's y goes up.
    swap = np.eye(4)[[0, 2, 1, 3]]
    np.savetxt(root / "intrinsics.txt", poses.intrinsics(240.0, 240.0, 319.5, 239.5))
    (root / "pose").mkdir()
    for n in range(3):
        write_pictures(root / f"color/{n}.png", root / f"depth/{n}.png", n, scale=1000)
        np.savetxt(root / f"pose/{n}.txt", swap @ pose_of(n) @ np.diag([1.0, -1.0, 1.0, 1.0]))


def icl(root: Path) -> None:
    swap = np.eye(4)[[0, 2, 1, 3]]
    rows = []
    for n in range(3):
        write_pictures(root / f"rgb/{n}.png", root / f"depth/{n}.png", n, scale=5000)
        rows.append((swap @ pose_of(n) @ np.diag([1.0, -1.0, 1.0, 1.0]))[:3])
    np.savetxt(root / "livingRoom2.gt.sim", np.concatenate(rows))


def azure(root: Path) -> None:
    for n in range(3):
        write_pictures(root / f"color/{n}.jpg", root / f"depth/{n}.png", n, scale=1000, size=(1280, 720))
    np.savetxt(root / "poses_global_dvo.txt", [pose_of(n).reshape(-1) for n in range(3)])


def redwood(root: Path) -> None:
    lines = []
    for n in range(3):
        write_pictures(root / f"color/{n:05}.jpg", root / f"depth/{n:05}.png", n, scale=1000)
        lines += [f"{n} {n} {n + 1}", *(" ".join(map(repr, row)) for row in pose_of(n).tolist())]
    (root / "trajectory.log").write_text("\n".join(lines) + "\n")


def tum(root: Path) -> None:
    rgb, depth, truth = ["# color"], ["# depth"], ["# time tx ty tz qx qy qz qw"]
    for n in range(3):
        write_pictures(root / f"rgb/{n}.png", root / f"depth/{n}.png", n, scale=5000)
        rgb.append(f"{n + 0.005} rgb/{n}.png")
        depth.append(f"{n} depth/{n}.png")
        at = pose_of(n)
        truth.append(" ".join(map(str, [n + 0.005, *at[:3, 3], *quaternion(at[:3, :3])])))
    for name, lines in (("rgb", rgb), ("depth", depth), ("groundtruth", truth)):
        (root / f"{name}.txt").write_text("\n".join(lines))


def seven_scenes(root: Path) -> None:
    for n in range(3):
        stem = root / f"frame-{n:06}"
        write_pictures(Path(f"{stem}.color.png"), Path(f"{stem}.depth.png"), n, scale=1000)
        np.savetxt(f"{stem}.pose.txt", pose_of(n))


def record3d(root: Path) -> None:
    (root / "poses").mkdir(parents=True)
    (root / "dataconfig.yaml").write_text(
        "dataset_name: record3d\ncamera_params:\n  image_height: 960\n  image_width: 720\n  fx: 800.5\n  fy: 800.5\n"
        "  cx: 359.5\n  cy: 479.5\n  png_depth_scale: 1000.0\n"
    )
    for n in range(3):
        write_pictures(root / f"rgb/{n}.png", root / f"depth/{n}.png", n, scale=1000, size=(720, 960))
        np.save(root / f"poses/{n}.npy", OPENGL @ pose_of(n) @ OPENGL)


def hm3d(root: Path) -> None:
    for n in range(3):
        write_pictures(root / f"{n:03}.png", root / f"{n:03}_depth.npy", n, scale=1.0, size=(512, 512))
        (root / f"{n:03}.json").write_text(json.dumps({"pose": (OPENGL @ pose_of(n) @ OPENGL).tolist()}))


MAKERS: dict[str, Callable[[Path], None]] = {
    "plain": plain,
    "replica": replica,
    "scannet": scannet,
    "ai2thor": ai2thor,
    "icl": icl,
    "azure": azure,
    "redwood": redwood,
    "tum": tum,
    "7scenes": seven_scenes,
    "record3d": record3d,
    "hm3d": hm3d,
}


def quaternion(turn: NDArray[np.float64]) -> list[float]:
    """(x, y, z, w) of a rotation, by the eigenvector of its quaternion matrix."""
    (a, b, c), (d, e, f), (g, h, i) = turn.tolist()
    matrix = np.array(
        [
            [a - e - i, b + d, c + g, h - f],
            [b + d, e - a - i, f + h, c - g],
            [c + g, f + h, i - a - e, d - b],
            [h - f, c - g, d - b, a + e + i],
        ]
    )
    found = np.linalg.eigh(matrix / 3)[1][:, -1]
    return [float(v) for v in (found if found[3] >= 0 else -found)]


def middle(frame: Frame) -> NDArray[np.float32]:
    width = frame.depth.shape[1]
    cx, cy = frame.K[0, 2], frame.K[1, 2]
    return unproject(frame, np.array([round(cy) * width + round(cx)]))[0]


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
        np.testing.assert_allclose(frame.depth, distance(number), atol=0.002)


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
    assert frame.K[0, 0] == 400 and frame.depth[0, 0] == pytest.approx(2 * distance(0), abs=0.01)


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


# -- a bad recording


def test_a_bad_recording_is_refused(tmp_path: Path) -> None:
    with pytest.raises(FormatError, match="no such recording"):
        open_recording(tmp_path / "nowhere")
    with pytest.raises(FormatError, match="no known layout"):
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


def test_the_real_frames(data: Path) -> None:
    recording = open_recording(data / "rgbd" / "RGBD")
    frames = list(recording.frames())
    assert recording.layout == "redwood" and len(frames) == 5 and recording.up == "y"
    assert recording.K[0, 0] == 525.0
    # The same corner of the room in the first and last frame: the clouds must lie on each other.
    from cgdb.ingest.evaluation.mapping import nearest

    one, two = (unproject(f, np.flatnonzero(f.depth.reshape(-1) > 0)[::37]) for f in (frames[0], frames[-1]))
    distance_m, _ = nearest(one, two, 0.2)
    assert np.median(distance_m) < 0.05
