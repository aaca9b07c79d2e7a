"""Recordings on disk: every layout, its pose convention, and what is wrong with strangers' recordings."""

from __future__ import annotations

import json
import re
import sys
import zipfile
from collections.abc import Callable
from io import BytesIO
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from cgdb.errors import FormatError, MissingExtraError, UsageError
from cgdb.ingest.frames import poses
from cgdb.ingest.frames.recording import LAYOUTS, Frame, open_recording
from cgdb.ingest.mapping.lift import unproject
from tests.mapping_rooms import looking

Image = pytest.importorskip("PIL.Image")

EYES = [(0.4 * i, -1.0 - 0.1 * i, 1.4) for i in range(3)]
TARGET = (0.3, 2.0, 0.5)
"""What the middle of every picture shows, in a right-handed world with z up: a place on a wall."""
WALL = TARGET[1]
Pose = NDArray[np.float64]
PAD = (480, 360)
PHONE = poses.intrinsics(800.5, 800.5, 359.5, 479.5)
PRIMESENSE = poses.intrinsics(525.0, 525.0, 319.5, 239.5)
VGA = poses.intrinsics(500.0, 500.0, 319.5, 239.5)
OPENGL = np.diag([1.0, -1.0, -1.0, 1.0])


def pose_of(number: int) -> Pose:
    return looking(EYES[number], TARGET)


def distance(number: int) -> float:
    return float(np.linalg.norm(np.subtract(TARGET, EYES[number])))


def wall(number: int, lens: Pose, size: tuple[int, int]) -> NDArray[np.float64]:
    """(h, w) metres: how far along the axis of the camera each pixel sees the wall y = WALL."""
    u, v = np.meshgrid(np.arange(size[0]), np.arange(size[1]))
    rays = np.stack([(u - lens[0, 2]) / lens[0, 0], (v - lens[1, 2]) / lens[1, 1], np.ones_like(u)], axis=2)
    along: NDArray[np.float64] = (WALL - EYES[number][1]) / (rays @ pose_of(number)[1, :3])
    return along


def write_pictures(
    color: Path,
    depth: Path,
    number: int,
    *,
    scale: float,
    lens: Pose = VGA,
    size: tuple[int, int] = (640, 480),
    value: float | None = None,
) -> None:
    """A grey picture, and a depth picture of a wall that fills all of it."""
    color.parent.mkdir(parents=True, exist_ok=True)
    depth.parent.mkdir(parents=True, exist_ok=True)
    Image.fromarray(np.full((size[1], size[0], 3), 40 * number, np.uint8)).save(color)
    metres = wall(number, lens, size) if value is None else np.full(size[::-1], value)
    if depth.suffix == ".npy":
        np.save(depth, metres[:, :, None].astype(np.float32))
    elif depth.suffix == ".exr":
        write_exr(depth, metres)
    else:
        Image.fromarray(np.round(metres * scale).astype(np.uint16)).save(depth, compress_level=1)


def write_exr(path: Path, metres: NDArray[np.float64], channel: str = "Z") -> None:
    openexr = pytest.importorskip("OpenEXR")
    header = {"compression": openexr.ZIP_COMPRESSION, "type": openexr.scanlineimage}
    with openexr.File(header, {channel: metres.astype(np.float32)}) as file:
        file.write(str(path))


def plain(root: Path) -> None:
    meta = {"width": 640, "height": 480, "fx": 500.0, "fy": 500.0, "cx": 319.5, "cy": 239.5, "depth_scale": 1000.0}
    root.mkdir(parents=True, exist_ok=True)
    (root / "meta.json").write_text(json.dumps(meta))
    (root / "pose").mkdir()
    for n in range(3):
        write_pictures(root / f"rgb/{n}.png", root / f"depth/{n}.png", n, scale=1000)
        np.savetxt(root / f"pose/{n}.txt", pose_of(n))


def replica(root: Path) -> None:
    lens = poses.intrinsics(600.0, 600.0, 599.5, 339.5)
    for n in range(3):
        write_pictures(
            root / f"results/frame{n:06}.jpg",
            root / f"results/depth{n:06}.png",
            n,
            scale=6553.5,
            lens=lens,
            size=(1200, 680),
        )
    np.savetxt(root / "traj.txt", [pose_of(n).reshape(-1) for n in range(3)])


def scannet(root: Path) -> None:
    (root / "intrinsic").mkdir(parents=True)
    (root / "pose").mkdir()
    lens = np.eye(4)
    lens[:3, :3] = poses.intrinsics(1170.0, 1170.0, 647.5, 483.5)
    np.savetxt(root / "intrinsic/intrinsic_color.txt", lens)
    small = poses.intrinsics(1170.0 * 640 / 1296, 1170.0 * 480 / 968, 319.5, 239.5)
    for n in range(3):
        write_pictures(root / f"color/{n}.jpg", root / f"depth/{n}.png", n, scale=1000, lens=small)
        Image.fromarray(np.full((968, 1296, 3), 40 * n, np.uint8)).save(root / f"color/{n}.jpg")
        np.savetxt(root / f"pose/{n}.txt", pose_of(n))


def ai2thor(root: Path) -> None:
    # What Unity would say of the same camera: its world is ours with y and z exchanged, its camera's y goes up.
    swap = np.eye(4)[[0, 2, 1, 3]]
    lens = poses.intrinsics(240.0, 240.0, 319.5, 239.5)
    np.savetxt(root / "intrinsics.txt", lens)
    (root / "pose").mkdir()
    for n in range(3):
        write_pictures(root / f"color/{n}.png", root / f"depth/{n}.png", n, scale=1000, lens=lens)
        np.savetxt(root / f"pose/{n}.txt", swap @ pose_of(n) @ np.diag([1.0, -1.0, 1.0, 1.0]))


def icl(root: Path) -> None:
    swap = np.eye(4)[[0, 2, 1, 3]]
    rows = []
    for n in range(3):
        lens = poses.intrinsics(481.2, 480.0, 319.5, 239.5)
        write_pictures(root / f"rgb/{n}.png", root / f"depth/{n}.png", n, scale=5000, lens=lens)
        rows.append((swap @ pose_of(n) @ np.diag([1.0, -1.0, 1.0, 1.0]))[:3])
    np.savetxt(root / "livingRoom2.gt.sim", np.concatenate(rows))


def azure(root: Path) -> None:
    lens = poses.intrinsics(607.4, 607.4, 639.6, 366.3)
    for n in range(3):
        write_pictures(root / f"color/{n}.jpg", root / f"depth/{n}.png", n, scale=1000, lens=lens, size=(1280, 720))
    np.savetxt(root / "poses_global_dvo.txt", [pose_of(n).reshape(-1) for n in range(3)])


def redwood(root: Path) -> None:
    lines = []
    for n in range(3):
        write_pictures(root / f"color/{n:05}.jpg", root / f"depth/{n:05}.png", n, scale=1000, lens=PRIMESENSE)
        lines += [f"{n} {n} {n + 1}", *(" ".join(map(repr, row)) for row in pose_of(n).tolist())]
    (root / "trajectory.log").write_text("\n".join(lines) + "\n")


def tum(root: Path) -> None:
    rgb, depth, truth = ["# color"], ["# depth"], ["# time tx ty tz qx qy qz qw"]
    for n in range(3):
        lens = poses.intrinsics(535.4, 539.2, 320.1, 247.6)
        write_pictures(root / f"rgb/{n}.png", root / f"depth/{n}.png", n, scale=5000, lens=lens)
        rgb.append(f"{n + 0.005} rgb/{n}.png")
        depth.append(f"{n} depth/{n}.png")
        at = pose_of(n)
        truth.append(" ".join(map(str, [n + 0.005, *at[:3, 3], *quaternion(at[:3, :3])])))
    for name, lines in (("rgb", rgb), ("depth", depth), ("groundtruth", truth)):
        (root / f"{name}.txt").write_text("\n".join(lines))


def seven_scenes(root: Path) -> None:
    for n in range(3):
        stem = root / f"frame-{n:06}"
        lens = poses.intrinsics(585.0, 585.0, 320.0, 240.0)
        write_pictures(Path(f"{stem}.color.png"), Path(f"{stem}.depth.png"), n, scale=1000, lens=lens)
        np.savetxt(f"{stem}.pose.txt", pose_of(n))


def record3d(root: Path) -> None:
    (root / "poses").mkdir(parents=True)
    (root / "dataconfig.yaml").write_text(
        "dataset_name: record3d\ncamera_params:\n  image_height: 960\n  image_width: 720\n  fx: 800.5\n  fy: 800.5\n"
        "  cx: 359.5\n  cy: 479.5\n  png_depth_scale: 1000.0\n"
    )
    for n in range(3):
        write_pictures(root / f"rgb/{n}.png", root / f"depth/{n}.png", n, scale=1000, lens=PHONE, size=(720, 960))
        np.save(root / f"poses/{n}.npy", OPENGL @ pose_of(n) @ OPENGL)


def hm3d(root: Path) -> None:
    lens = poses.intrinsics(256.0, 256.0, 256.0, 256.0)
    for n in range(3):
        write_pictures(root / f"{n:03}.png", root / f"{n:03}_depth.npy", n, scale=1.0, lens=lens, size=(512, 512))
        (root / f"{n:03}.json").write_text(json.dumps({"pose": (OPENGL @ pose_of(n) @ OPENGL).tolist()}))


def hm3d_openeqa(root: Path) -> None:
    root.mkdir(parents=True, exist_ok=True)
    lens = np.eye(4)
    lens[:3, :3] = poses.intrinsics(960.0, 960.0, 959.5, 539.5)
    np.savetxt(root / "intrinsic_color.txt", lens)
    for n in range(3):
        write_pictures(
            root / f"{n:05}-rgb.png", root / f"{n:05}-depth.png", n, scale=6553.5, lens=lens, size=(1920, 1080)
        )
        np.savetxt(root / f"{n:05}.txt", OPENGL @ pose_of(n) @ OPENGL)


def realsense(root: Path) -> None:
    lens = poses.intrinsics(1366.197, 1365.919, 979.791, 553.78)
    (root / "poses").mkdir(parents=True)
    for n in range(3):
        write_pictures(root / f"rgb/{n}.jpg", root / f"depth/{n}.png", n, scale=1000, lens=lens, size=(1920, 1080))
        np.save(root / f"poses/{n}.npy", OPENGL @ pose_of(n) @ OPENGL)


def multiscan(root: Path) -> None:
    """Six lines for three pictures. ARKit's transform: the camera turned to OpenGL's axes, the world as it is."""
    lens = poses.intrinsics(400.0, 400.0, 239.5, 179.5)
    lines = []
    for n in range(3):
        name = f"{2 * n:04}.png"
        write_pictures(root / "outputs/color" / name, root / "outputs/depth" / name, n, scale=1000, lens=lens, size=PAD)
        transform = 2.0 * (pose_of(n) @ OPENGL)  # to be divided by its corner
        line = {"timestamp": n, "transform": transform.T.reshape(-1).tolist()}
        lines += [json.dumps(line), json.dumps({**line, "transform": np.eye(4).reshape(-1).tolist()})]
    (root / "scene_00000_00.jsonl").write_text("\n".join(lines))
    stream = {"type": "color_camera", "resolution": [PAD[1], PAD[0]], "intrinsics": lens.T.reshape(-1).tolist()}
    (root / "scene_00000_00.json").write_text(json.dumps({"streams": [stream]}))
    (root / "scene_00000_00.align.json").write_text("{}")


def metadata() -> dict[str, Any]:
    """What Record3D writes of the three frames: colour 720 x 960, depth 192 x 256."""
    rows = []
    for n in range(3):
        at = OPENGL @ pose_of(n) @ OPENGL
        rows.append([*quaternion(at[:3, :3]), *at[:3, 3].tolist()])
    lens = PHONE.T.reshape(-1).tolist()
    return {"w": 720, "h": 960, "dw": 192, "dh": 256, "K": lens, "poses": rows, "frameTimestamps": [0, 1, 2], "fps": 60}


def depth_bytes(n: int) -> bytes:
    """The wall as the phone's depth sensor sees it, compressed as it does."""
    lzfse = pytest.importorskip("lzfse")
    share = 192 / 720
    lens = poses.intrinsics(800.5 * share, 800.5 * share, (359.5 + 0.5) * share - 0.5, (479.5 + 0.5) * share - 0.5)
    packed: bytes = lzfse.compress(wall(n, lens, (192, 256)).astype("<f4").tobytes())
    return packed


def r3d_parts() -> dict[str, bytes]:
    parts = {"metadata": json.dumps(metadata()).encode()}
    for n in range(3):
        picture = BytesIO()
        Image.fromarray(np.full((960, 720, 3), 40 * n, np.uint8)).save(picture, "jpeg")
        parts |= {f"rgbd/{n}.jpg": picture.getvalue(), f"rgbd/{n}.depth": depth_bytes(n)}
    return parts


def r3d(root: Path) -> None:
    """The archive, unpacked."""
    for name, content in r3d_parts().items():
        (root / name).parent.mkdir(parents=True, exist_ok=True)
        (root / name).write_bytes(content)


def r3d_file(path: Path, parts: dict[str, bytes]) -> Path:
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, content in parts.items():
            archive.writestr(name, content)
    return path


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
    "r3d": r3d,
    "realsense": realsense,
    "multiscan": multiscan,
    "hm3d-openeqa": hm3d_openeqa,
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


# -- archives and other depth


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
