"""A scene as binary glTF 2.0, by trimesh: a node per object with its cloud and box, for Blender and the web."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from cgdb.errors import MissingExtraError
from cgdb.export.cloud import EDGES, MOST_POINTS, Thing, clean, label, things, titled
from cgdb.export.documents import Document
from cgdb.geometry import parse_up
from cgdb.scene import SceneGraph, SceneObject

_CAPTION = 500


def glb(scene: SceneGraph, *, max_points: int = MOST_POINTS, seed: int = 0) -> Document:
    """The scene under a root that turns its up axis to glTF's, which is y.

    Nodes are called "12 sofa", hold id, label and caption as extras, and have the children "12 sofa cloud" (points)
    and "12 sofa box" (a frame of bars). They stand where the object's center is, with what is in them relative to it:
    float32 is then exact enough far from the origin too. Colours are made linear, as glTF has them.
    max_points: of more, the same share of every cloud is chosen by the seed.
    """
    try:
        import trimesh
    except ImportError as error:
        raise MissingExtraError("trimesh is not installed", hint="pip install 'cgdb[mesh]'") from error
    found = things(scene, max_points, seed)
    made = trimesh.Scene(base_frame="world")
    taken = {"world"}
    root = _unique(clean(scene.name), taken)
    about = {"scene": scene.name, "frame": scene.frame, "up": scene.up}
    made.graph.update(frame_from="world", frame_to=root, matrix=_to_y_up(scene.up), metadata=about)
    for thing in found:
        _add(made, thing, _unique(titled(thing.node), taken), root)
    data = made.export(file_type="glb")
    return Document(data=[bytes(data)], notes=found.notes)


def _unique(name: str, taken: set[str]) -> str:
    """The name, or another that is not taken: an id may be the text "12 sofa"."""
    found, number = name, 1
    # The names of the node's own children count too.
    while {found, f"{found} cloud", f"{found} box"} & taken:
        number += 1
        found = f"{name} ({number})"
    taken |= {found, f"{found} cloud", f"{found} box"}
    return found


def _add(made: Any, thing: Thing, name: str, root: str) -> None:
    import trimesh

    node = thing.node
    about: dict[str, Any] = {"id": node.id, "label": label(node)}
    if isinstance(node, SceneObject) and node.caption:
        about["caption"] = clean(node.caption, _CAPTION)
    if not isinstance(node, SceneObject):
        about["kind"] = node.kind
    stand = np.eye(4)
    stand[:3, 3] = thing.center
    made.graph.update(frame_from=root, frame_to=name, matrix=stand, metadata=about)
    points, colors = thing.points, thing.colors
    if not len(points) and thing.corners is None:
        points, colors = thing.center[None].astype(np.float32), thing.color[None]
    if len(points):
        rgba = np.concatenate([_linear(colors), np.full((len(colors), 1), 255, np.uint8)], axis=1)
        cloud = trimesh.PointCloud(points.astype(np.float64) - thing.center, colors=rgba)
        part = f"{name} cloud"
        made.add_geometry(cloud, node_name=part, geom_name=part, parent_node_name=name)
    if thing.corners is not None:
        vertices, faces = _frame(thing.corners - thing.center)
        # A material, since Blender draws no vertex colours unless it is told to. trimesh takes linear shares of 1.
        color = [*(_linear(thing.color) / 255.0).tolist(), 1.0]
        paint = trimesh.visual.material.PBRMaterial(baseColorFactor=color, metallicFactor=0.0, roughnessFactor=1.0)
        visual = trimesh.visual.TextureVisuals(material=paint)
        bars = trimesh.Trimesh(vertices=vertices, faces=faces, visual=visual, process=False)
        part = f"{name} box"
        made.add_geometry(bars, node_name=part, geom_name=part, parent_node_name=name)


_SIGNS = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)], np.float64)
_FACES = np.array([(0, 1, 3), (0, 3, 2), (4, 6, 7), (4, 7, 5), (0, 4, 5), (0, 5, 1),
                   (2, 3, 7), (2, 7, 6), (0, 2, 6), (0, 6, 4), (1, 5, 7), (1, 7, 3)])  # fmt: skip
"""(12, 3) triangles of a block whose corners are _SIGNS, seen from outside."""
_BAR = 0.01
"""Thickness in m of the bars of a frame; less for boxes under 20 cm."""


def _frame(corners: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
    """A box of eight corners (8, 3) as twelve bars along its edges: vertices (96, 3), faces (144, 3).

    Bars, not lines: viewers draw lines a pixel thin, and renderers not at all.
    """
    sides = corners[[1, 2, 4]] - corners[0]
    lengths = np.linalg.norm(sides, axis=1)
    half = np.clip(0.05 * lengths.max(), 0.001, _BAR) / 2
    # Orthonormal also where the box is flat; the sides that it has decide.
    axes = np.linalg.qr(sides[np.argsort(-lengths)].T)[0]
    axes[:, 0] *= np.linalg.det(axes)
    first, last = corners[EDGES[:, 0]], corners[EDGES[:, 1]]
    ahead = (last - first) @ axes @ _SIGNS.T > 0
    ends = np.where(ahead[..., None], last[:, None], first[:, None])
    vertices = ends + half * (_SIGNS @ axes.T)
    faces = _FACES + len(_SIGNS) * np.arange(len(EDGES))[:, None, None]
    return vertices.reshape(-1, 3), faces.reshape(-1, 3)


def _linear(colors: NDArray[np.uint8]) -> NDArray[np.uint8]:
    """sRGB, as cameras have it, to the linear light of glTF's vertex colours."""
    share = colors / 255.0
    light = np.where(share <= 0.04045, share / 12.92, ((share + 0.055) / 1.055) ** 2.4)
    return np.asarray(np.round(255 * light), np.uint8)


_RIGHT_UP_NEAR = {
    "x": ("z", "x", "y"),
    "-x": ("-z", "-x", "y"),
    "y": ("x", "y", "z"),
    "-y": ("-x", "-y", "z"),
    "z": ("x", "z", "-y"),
    "-z": ("x", "-z", "y"),
}
"""The scene's up axis -> which of its axes become glTF's x, y and z."""


def _to_y_up(up: str) -> NDArray[np.float64]:
    """(4, 4) the rotation that brings the scene's up axis to y."""
    made = np.zeros((4, 4))
    for row, name in enumerate(_RIGHT_UP_NEAR[up]):
        axis, sign = parse_up(name)
        made[row, axis] = sign
    made[3, 3] = 1.0
    return made
