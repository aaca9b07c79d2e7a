"""A robot that maps while it drives: it writes what it has every few frames, and asks in between.

python examples/05_ask_while_mapping.py

Replace `camera` by your own: an RGB-D frame with its pose, and the masks that a detector found in it.
"""

import tempfile
import time
from collections.abc import Iterator
from pathlib import Path

import numpy as np

import cgdb
from cgdb.ingest.detections.detections import Detections, checked
from cgdb.ingest.frames.recording import Frame
from cgdb.ingest.mapping.mapper import Mapper, Mapping
from cgdb.ingest.relations.relate import with_geometry

LENS = np.array([[120.0, 0, 79.5], [0, 120.0, 59.5], [0, 0, 1]])
THINGS = {  # low and high corner, metres
    "floor": ((-3, -3, -0.1), (3, 3, 0)),
    "table": ((-0.6, 1.2, 0), (0.6, 2.0, 0.7)),
    "mug": ((-0.4, 1.4, 0.7), (-0.28, 1.52, 0.82)),
    "lamp": ((0.2, 1.4, 0.7), (0.35, 1.55, 1.15)),
    "box": ((1.2, 0.6, 0), (1.6, 1.0, 0.4)),
}


def camera(count: int) -> Iterator[tuple[Frame, Detections]]:
    """A simulated drive round the table; every pixel is a ray that meets the nearest box."""
    v, u = np.mgrid[0:120, 0:160]
    rays = np.stack([(u - LENS[0, 2]) / LENS[0, 0], (v - LENS[1, 2]) / LENS[1, 1], np.ones_like(u)], axis=2)
    for index in range(count):
        angle = np.radians(-40 + 80 * index / count)
        eye = np.array([2.2 * np.sin(angle), 1.6 - 2.6 * np.cos(angle), 1.5])
        forward = np.array([0.3, 1.4, 0.5]) - eye
        forward /= np.linalg.norm(forward)
        right = np.cross(forward, [0, 0, 1])
        right /= np.linalg.norm(right)
        pose = np.eye(4)
        pose[:3] = np.stack([right, np.cross(forward, right), forward, eye], axis=1)
        enter = []
        for low, high in THINGS.values():
            one, two = (np.array(low) - eye) / (rays @ pose[:3, :3].T), (np.array(high) - eye) / (rays @ pose[:3, :3].T)
            near, far = np.minimum(one, two).max(axis=2), np.maximum(one, two).min(axis=2)
            enter.append(np.where((near < far) & (near > 0), near, np.inf))
        depth, which = np.min(enter, axis=0), np.argmin(enter, axis=0)
        depth = np.where(np.isfinite(depth), depth, 0).astype(np.float32)
        frame = Frame(
            index=index,
            name=f"{index:06}",
            timestamp=float(index),
            rgb=np.full((120, 160, 3), 128, np.uint8),
            depth=depth,
            K=LENS,
            T_world_camera=pose,
        )
        masks = np.stack([(which == number) & (depth > 0) for number in range(len(THINGS))])
        seen = np.flatnonzero(masks.sum(axis=(1, 2)) > 25)
        yield frame, checked(masks[seen], where=frame.name, labels=[list(THINGS)[i] for i in seen])


EVERY = 8
mapper, slowest = Mapper(Mapping(crops=False)), 0.0
with tempfile.TemporaryDirectory() as folder, cgdb.open(Path(folder) / "home.cgdb", create=True) as db:
    for frame, detections in camera(24):
        began = time.perf_counter()
        mapper.step(frame, detections)
        slowest = max(slowest, time.perf_counter() - began)
        if (frame.index + 1) % EVERY == 0:
            # Everybody who has the store open, in this process or another, sees whole revisions only.
            revision = db.add(with_geometry(mapper.scene("home")), on_existing="replace")
            things = db.query("MATCH (o)-[:on]->(t) WHERE t.tag = 'table' RETURN o.tag ORDER BY o.tag")
            print(f"frame {frame.index + 1}: revision {revision}; on the table: {[row[0] for row in things]}")

    mapper.finish()
    db.add(with_geometry(mapper.scene("home")), on_existing="replace")
    box = db.query("MATCH (b), (t) WHERE b.tag = 'box' AND t.tag = 'table' RETURN distance(b, t)")
    print(f"the box stands {box[0][0]:.2f} m from the table; {len(db.revisions('home'))} revisions")
    print(f"the slowest frame took {1000 * slowest:.0f} ms")
