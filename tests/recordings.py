"""A wall seen by a camera that moves, recorded in every layout."""

from __future__ import annotations

import json
import zipfile
from collections.abc import Callable
from io import BytesIO
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from cgdb.ingest.frames import poses
from cgdb.ingest.frames.recording import Frame
from cgdb.ingest.mapping.pixels import unproject
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
    """(3,) m: the point that the middle of a picture shows."""
    width = frame.depth.shape[1]
    cx, cy = frame.K[0, 2], frame.K[1, 2]
    return unproject(frame, np.array([round(cy) * width + round(cx)]))[0]
