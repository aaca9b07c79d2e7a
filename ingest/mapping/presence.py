"""Whether things that were mapped another day are still there: a camera that sees through a thing says that it is not.

Points of each old object are looked for in the frames of a later recording. Where the depth goes on behind them, the
thing is gone; where something ends the ray about there, it may still be there; what is hidden says nothing.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from cgdb.ingest.frames.recording import Frame

POINTS = 64
"""Of an object, evenly over its cloud: a frame asks for all objects at once."""
MARGIN = 0.1
"""Metres: two recordings agree to about this in where things are."""
SEEN = 0.3
"""A frame has a say on an object of which it sees this share of the points, either way."""
FRAMES = 3
"""So many frames must see through a thing, and most of those that have a say."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Presence:
    """points (m, 3) float32 m, of (m,) the row of each point's object; ids (n,); through, there (n,) frames so far."""

    points: NDArray[np.float32]
    of: NDArray[np.intp]
    ids: NDArray[np.int64]
    through: NDArray[np.int64]
    there: NDArray[np.int64]

    @classmethod
    def of_clouds(cls, clouds: dict[int, NDArray[np.float32]]) -> Presence:
        """Of objects {id: (n, 3) float32 m} before anything was seen of them."""
        chosen = [
            cloud[np.linspace(0, len(cloud) - 1, min(POINTS, len(cloud))).astype(np.intp)] for cloud in clouds.values()
        ]
        n = len(clouds)
        return cls(
            points=np.concatenate([np.zeros((0, 3), np.float32), *chosen]),
            of=np.repeat(np.arange(n), [len(points) for points in chosen]),
            ids=np.array(list(clouds), np.int64),
            through=np.zeros(n, np.int64),
            there=np.zeros(n, np.int64),
        )

    def watch(self, frame: Frame) -> None:
        """Take in what one frame says."""
        n = len(self.ids)
        to_camera = np.linalg.inv(frame.T_world_camera)
        local = self.points @ to_camera[:3, :3].T + to_camera[:3, 3]
        ahead = np.flatnonzero(local[:, 2] > MARGIN)
        z = local[ahead, 2]
        u = np.rint(frame.K[0, 0] * local[ahead, 0] / z + frame.K[0, 2])
        v = np.rint(frame.K[1, 1] * local[ahead, 1] / z + frame.K[1, 2])
        height, width = frame.depth.shape
        inside = (u >= 0) & (u < width) & (v >= 0) & (v < height)
        ahead, z = ahead[inside], z[inside]
        depth = frame.depth[v[inside].astype(np.intp), u[inside].astype(np.intp)]
        of, behind = self.of[ahead], depth - z
        through = np.bincount(of[(depth > 0) & (behind > MARGIN)], minlength=n)
        there = np.bincount(of[(depth > 0) & (np.abs(behind) <= MARGIN)], minlength=n)
        enough = through + there >= SEEN * np.bincount(self.of, minlength=n)
        self.through[enough & (through > 2 * there)] += 1
        self.there[enough & (through <= 2 * there)] += 1

    def gone(self) -> set[int]:
        """The ids of the objects that are no longer where they were."""
        away = (self.through >= FRAMES) & (self.through > 2 * self.there)
        return {int(name) for name in self.ids[away]}
