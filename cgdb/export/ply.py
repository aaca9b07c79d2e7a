"""A scene as a binary PLY: its points with colour, instance and label; boxes as an element of their own.

Written by numpy: a header and arrays. The libraries that write PLY know points and faces, but neither a label per
point nor further elements.
"""

from __future__ import annotations

import json
from collections.abc import Iterator

import numpy as np

from cgdb.export.cloud import EDGES, MOST_POINTS, Things, label, things
from cgdb.export.documents import Document
from cgdb.scene import Place, SceneGraph, SceneObject

_FAR = 10_000.0
"""Metres from the origin where float32 begins to lose millimetres; coordinates are doubles from there on."""
_TYPES = {"<f4": "float", "<f8": "double", "|u1": "uchar", "<i4": "int"}


def ply(scene: SceneGraph, *, max_points: int = MOST_POINTS, seed: int = 0) -> Document:
    """The scene's clouds in its own frame. What has no cloud is drawn by its box, as edges, or by its center.

    Elements: ``vertex`` x y z red green blue instance label; ``edge`` vertex1 vertex2; ``box`` instance label cx cy cz
    (center) ex ey ez (side lengths) r00 to r22 (rotation, row by row). Comments give the label behind each number and
    the id behind each instance, as JSON texts: ``comment label 3 "sofa"``, ``comment instance 0 label 3 id 12``.
    max_points: of more, the same share of every cloud is chosen by the seed.
    """
    found = things(scene, max_points, seed)
    return Document(data=_pieces(found), notes=found.notes)


def _pieces(found: Things) -> Iterator[bytes]:
    scene = found.scene
    nodes: list[SceneObject | Place] = [*scene.objects, *scene.places]
    names = sorted({name for node in nodes if (name := label(node))})
    codes = {name: code for code, name in enumerate(names)}
    labels = [codes.get(label(node) or "", -1) for node in nodes]
    shown = list(found)
    bare = [thing for thing in shown if not len(thing.points) and thing.corners is not None]
    single = [thing for thing in shown if not len(thing.points) and thing.corners is None]
    boxed = [thing for thing in shown if thing.corners is not None]
    far = max((float(np.abs(thing.center).max()) for thing in shown), default=0.0) > _FAR
    real = "<f8" if far else "<f4"
    rgb = [(name, "|u1") for name in ("red", "green", "blue")]
    whose = [("instance", "<i4"), ("label", "<i4")]
    vertex = np.dtype([*((axis, real) for axis in "xyz"), *rgb, *whose])
    edge = np.dtype([("vertex1", "<i4"), ("vertex2", "<i4"), *rgb])
    sides = [(f"{part}{axis}", "<f8") for part in "ce" for axis in "xyz"]
    box = np.dtype([*whose, *sides, *((f"r{i}{j}", "<f8") for i in range(3) for j in range(3))])
    n_cloud = sum(len(thing.points) for thing in shown)
    n_vertices = n_cloud + len(single) + 8 * len(bare)
    about = {"scene": scene.name, "frame": scene.frame, "up": scene.up, "unit": "metre"}
    lines = ["ply", "format binary_little_endian 1.0", f"comment cgdb {_text(about)}"]
    lines += [f"comment label {code} {_text(name)}" for code, name in enumerate(names)]
    lines += [f"comment instance {i} label {labels[i]} id {_text(node.id)}" for i, node in enumerate(nodes)]
    if bare:
        lines.append(f"comment vertices from {n_cloud + len(single)} on are corners of boxes")
    for name, count, kind in (("vertex", n_vertices, vertex), ("edge", 12 * len(bare), edge), ("box", len(boxed), box)):
        if count or name == "vertex":
            lines.append(f"element {name} {count}")
            lines += [f"property {_TYPES[kind[column].str]} {column}" for column in kind.names or ()]
    yield ("\n".join([*lines, "end_header"]) + "\n").encode("ascii")

    for thing in (*(thing for thing in shown if len(thing.points)), *single, *bare):
        at = thing.points if len(thing.points) else thing.center[None] if thing.corners is None else thing.corners
        colors = thing.colors if len(thing.points) else thing.color[None]
        rows = np.zeros(len(at), vertex)
        for k, axis in enumerate("xyz"):
            rows[axis] = at[:, k]
        for k, name in enumerate(("red", "green", "blue")):
            rows[name] = colors[:, k]
        rows["instance"], rows["label"] = thing.index, labels[thing.index]
        yield rows.tobytes()
    for number, thing in enumerate(bare):
        edges = np.zeros(12, edge)
        corners = n_cloud + len(single) + 8 * number + EDGES
        edges["vertex1"], edges["vertex2"] = corners[:, 0], corners[:, 1]
        edges["red"], edges["green"], edges["blue"] = thing.color
        yield edges.tobytes()
    for thing in boxed:
        row = np.zeros(1, box)
        row["instance"], row["label"] = thing.index, labels[thing.index]
        rotation = np.eye(3)
        if isinstance(thing.node, SceneObject) and thing.node.rotation is not None:
            rotation = thing.node.rotation
        extent = np.zeros(3) if thing.node.extent is None else thing.node.extent
        for k, axis in enumerate("xyz"):
            row[f"c{axis}"], row[f"e{axis}"] = thing.center[k], extent[k]
            for j in range(3):
                row[f"r{k}{j}"] = rotation[k, j]
        yield row.tobytes()


def _text(value: object) -> str:
    """JSON in ASCII, so that no name can end the header's line or break a reader that expects ASCII."""
    return json.dumps(value, ensure_ascii=True)
