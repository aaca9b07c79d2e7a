"""A small room that is rendered in numpy: boxes seen by a pinhole camera, with everything known."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache

import numpy as np
from numpy.typing import NDArray

from cgdb.ingest.detections.detections import Detections, checked
from cgdb.ingest.frames import poses
from cgdb.ingest.frames.recording import Frame

WIDTH, HEIGHT, FOCAL = 160, 120, 120.0
K = poses.intrinsics(FOCAL, FOCAL, 79.5, 59.5)


@dataclass(frozen=True, slots=True)
class Box:
    """A box along the axes: name, low and high corner in metres, colour."""

    name: str
    low: tuple[float, float, float]
    high: tuple[float, float, float]
    color: tuple[int, int, int]


ROOM = (
    Box("floor", (-3, -3, -0.1), (3, 3, 0.0), (120, 110, 100)),
    Box("wall", (-3, 3, 0), (3, 3.1, 2.5), (220, 220, 210)),
    Box("table", (-0.6, 1.2, 0.0), (0.6, 2.0, 0.7), (140, 80, 40)),
    Box("box", (-0.4, 1.4, 0.7), (-0.15, 1.65, 0.95), (200, 40, 40)),
    Box("vase", (0.2, 1.4, 0.7), (0.35, 1.55, 1.05), (40, 60, 200)),
)


def looking(eye: tuple[float, float, float], at: tuple[float, float, float]) -> NDArray[np.float64]:
    """The pose of a camera at eye that looks at a point, held level in a world with z up."""
    forward = np.subtract(at, eye)
    forward = forward / np.linalg.norm(forward)
    right = np.cross(forward, [0, 0, 1.0])
    right /= np.linalg.norm(right)
    pose = np.eye(4)
    pose[:3, 0], pose[:3, 1], pose[:3, 2], pose[:3, 3] = right, np.cross(forward, right), forward, eye
    return pose


def render(pose: NDArray[np.float64], boxes: tuple[Box, ...] = ROOM) -> tuple[NDArray[np.float32], NDArray[np.intp]]:
    """(depth (h, w) m, which box (h, w), -1 for none), by where each ray enters each box."""
    v, u = np.mgrid[0:HEIGHT, 0:WIDTH]
    rays = np.stack([(u - K[0, 2]) / FOCAL, (v - K[1, 2]) / FOCAL, np.ones_like(u)], axis=2) @ pose[:3, :3].T
    depth, which = np.full((HEIGHT, WIDTH), np.inf), np.full((HEIGHT, WIDTH), -1)
    for number, box in enumerate(boxes):
        with np.errstate(divide="ignore", invalid="ignore"):
            one, two = (np.array(box.low) - pose[:3, 3]) / rays, (np.array(box.high) - pose[:3, 3]) / rays
        enter, leave = np.minimum(one, two).max(axis=2), np.maximum(one, two).min(axis=2)
        hit = (enter < leave) & (enter > 0.05) & (enter < depth)
        depth[hit], which[hit] = enter[hit], number
    return np.where(np.isfinite(depth), depth, 0).astype(np.float32), which


@cache
def room_frame(index: int, count: int = 12, boxes: tuple[Box, ...] = ROOM) -> tuple[Frame, Detections]:
    """A frame on an arc round the table, and its true masks with one feature per box."""
    angle = np.radians(-40 + 80 * index / max(count - 1, 1))
    pose = looking((2.2 * np.sin(angle), 1.6 - 2.6 * np.cos(angle), 1.5), (0.0, 1.6, 0.7))
    depth, which = render(pose, boxes)
    rgb = np.array([box.color for box in boxes] + [(0, 0, 0)], np.uint8)[which]
    frame = Frame(index=index, name=f"{index:06}", timestamp=None, rgb=rgb, depth=depth, K=K, T_world_camera=pose)
    seen = [number for number in range(len(boxes)) if (which == number).sum() >= 25]
    masks = np.stack([which == number for number in seen])
    features = np.eye(len(boxes), dtype=np.float32)[seen] + 0.2
    return frame, checked(masks, where=frame.name, labels=[boxes[i].name for i in seen], features=features)
