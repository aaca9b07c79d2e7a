"""A scene as a recording for the Rerun viewer: clouds, boxes with labels, relations, and the frames it was seen in."""

from __future__ import annotations

import tempfile
import warnings
from collections import defaultdict
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from cgdb.errors import ExportError, MissingExtraError
from cgdb.export.cloud import MOST_POINTS, Things, clean, distinct, label, placed, things, titled
from cgdb.export.documents import Document
from cgdb.scene import Place, SceneGraph, SceneObject

_PIECE = 1 << 20
_MEDIA = {b"\xff\xd8\xff": "image/jpeg", b"\x89PNG": "image/png", b"RIFF": "image/webp"}
_CAPTION = 2000


def rerun(scene: SceneGraph, *, max_points: int = MOST_POINTS, seed: int = 0) -> Document:
    """The scene as an .rrd file.

    Below ``map``: ``objects/ID`` (box, label, caption and other fields) with ``cloud``, ``places/ID``, and
    ``relations/LABEL`` as lines from source to target. ``graph`` has all nodes and relations as a graph. On the
    timeline ``frame``, where the map keeps the views of its objects: ``views/ID`` (the object cut out of the frame) and
    ``map/camera``. What has no position is in the graph only.
    max_points: of more, the same share of every cloud is chosen by the seed.
    """
    try:
        import rerun as sdk
    except ImportError as error:
        raise MissingExtraError("rerun-sdk is not installed", hint="pip install 'cgdb[rerun]'") from error
    found = None
    notes: tuple[str, ...] = ()
    nodes: list[SceneObject | Place] = [*scene.objects, *scene.places]
    if any(placed(node) for node in nodes):
        found = things(scene, max_points, seed)
        notes = found.notes
    return Document(data=_recorded(sdk, scene, found), notes=notes)


def _recorded(sdk: Any, scene: SceneGraph, found: Things | None) -> Iterator[bytes]:
    """The bytes of the recording; the SDK writes it to a file of its own as it grows."""
    with tempfile.TemporaryDirectory(prefix="cgdb-rerun-") as folder:
        path = Path(folder) / "map.rrd"
        stream = sdk.RecordingStream("cgdb", recording_id=clean(scene.name))
        if not stream.is_enabled():
            raise ExportError("rerun is switched off by the environment", hint="unset RERUN")
        stream.set_log_time_enabled(False)
        stream.set_log_tick_enabled(False)
        # The SDK warns of what it cannot write, and leaves it out.
        refused = sdk.error_utils.RerunWarning
        try:
            with warnings.catch_warnings():
                warnings.simplefilter("error", refused)
                stream.save(path, default_blueprint=_blueprint(sdk, scene, found))
                stream.send_recording_name(clean(scene.name))
                if found is not None:
                    _map(sdk, stream, scene, found)
                _graph(sdk, stream, scene)
                _views(sdk, stream, scene)
                stream.flush()
        except refused as error:
            raise ExportError(f"scene '{scene.name}' cannot be written as a Rerun recording: {error}") from error
        finally:
            stream.disconnect()
        with path.open("rb") as file:
            while piece := file.read(_PIECE):
                yield piece


def _blueprint(sdk: Any, scene: SceneGraph, found: Things | None) -> Any:
    """What the viewer shows first: the map, beside it the graph and the crops, where there are any."""
    import rerun.blueprint as layout

    beside: list[Any] = [layout.GraphView(origin="graph", name="relations")] if scene.relations else []
    if any(obj.views for obj in scene.objects):
        beside.append(layout.Spatial2DView(origin="views", name="views"))
    shown: list[Any] = [] if found is None else [layout.Spatial3DView(origin="map", name=clean(scene.name))]
    if beside:
        shown.append(layout.Tabs(*beside))
    return layout.Blueprint(layout.Horizontal(*shown), collapse_panels=True) if shown else None


def _map(sdk: Any, stream: Any, scene: SceneGraph, found: Things) -> None:
    sign, axis = ("DOWN" if scene.up.startswith("-") else "UP"), scene.up[-1].upper()
    stream.log("map", getattr(sdk.ViewCoordinates, f"RIGHT_HAND_{axis}_{sign}"), static=True)
    centers: dict[Any, NDArray[np.float64]] = {}
    for thing in found:
        node, centers[thing.node.id] = thing.node, thing.center
        path = ["map", "objects" if isinstance(node, SceneObject) else "places", str(node.id)]
        if thing.corners is not None and node.extent is not None:
            rotation = node.rotation if isinstance(node, SceneObject) and node.rotation is not None else np.eye(3)
            box = sdk.Boxes3D(
                centers=[thing.center],
                half_sizes=[node.extent / 2],
                quaternions=[_quaternion(rotation)],
                colors=[thing.color],
                labels=[titled(node)],
                # Hundreds of names would hide the map: they are shown for what is chosen.
                show_labels=not isinstance(node, SceneObject),
            )
            stream.log(path, box, static=True)
        else:
            point = sdk.Points3D([thing.center], colors=[thing.color], labels=[titled(node)], show_labels=False)
            stream.log(path, point, static=True)
        if fields := _fields(node):
            stream.log(path, sdk.AnyValues(**fields), static=True)
        if len(thing.points):
            stream.log([*path, "cloud"], sdk.Points3D(thing.points, colors=thing.colors), static=True)
    lines: dict[str, list[Any]] = defaultdict(list)
    for relation in scene.relations:
        if relation.source in centers and relation.target in centers:
            lines[relation.label].append([centers[relation.source], centers[relation.target]])
    for (name, strips), color in zip(sorted(lines.items()), distinct(len(lines)), strict=True):
        drawn = sdk.LineStrips3D(
            np.asarray(strips, np.float32), colors=[color], labels=[clean(name)], show_labels=False
        )
        stream.log(["map", "relations", name], drawn, static=True)


def _fields(node: SceneObject | Place) -> dict[str, Any]:
    """What the viewer lists of a thing that is chosen."""
    fields: dict[str, Any] = {"label": label(node)}
    if isinstance(node, SceneObject):
        fields["caption"] = None if node.caption is None else clean(node.caption, _CAPTION)
        fields["observations"], fields["confidence"] = node.n_observations, node.confidence
    fields |= {f"property_{name}": clean(value, _CAPTION) for name, value in node.properties.items()}
    return {name: value for name, value in fields.items() if value is not None}


def _graph(sdk: Any, stream: Any, scene: SceneGraph) -> None:
    """All nodes, and the relations between them: drawn by the viewer as a graph, one layer a label."""
    nodes: list[SceneObject | Place] = [*scene.objects, *scene.places]
    if not scene.relations:
        return
    shown = sdk.GraphNodes(
        [str(node.id) for node in nodes], labels=[titled(node) for node in nodes], colors=distinct(len(nodes))
    )
    stream.log("graph", shown, static=True)
    edges: dict[str, list[tuple[str, str]]] = defaultdict(list)
    for relation in scene.relations:
        edges[relation.label].append((str(relation.source), str(relation.target)))
    for name, pairs in sorted(edges.items()):
        stream.log(["graph", name], sdk.GraphEdges(pairs, graph_type="directed"), static=True)


def _views(sdk: Any, stream: Any, scene: SceneGraph) -> None:
    """The crops of each object at their frames, and where the camera was."""
    poses: dict[int, NDArray[np.float64]] = {}
    for obj in scene.objects:
        for view in sorted(obj.views, key=lambda view: view.frame):
            if view.T_world_camera is not None:
                poses.setdefault(view.frame, view.T_world_camera)
            media = next((kind for magic, kind in _MEDIA.items() if (view.image or b"").startswith(magic)), None)
            if view.image is not None and media is not None:
                stream.set_time("frame", sequence=view.frame)
                stream.log(["views", str(obj.id)], sdk.EncodedImage(contents=view.image, media_type=media))
    for frame, pose in sorted(poses.items()):
        stream.set_time("frame", sequence=frame)
        # An arrow along the line of sight: views do not say how wide the camera sees.
        origin, ahead = pose[:3, 3], 0.3 * pose[:3, 2]
        stream.log("map/camera", sdk.Arrows3D(vectors=[ahead], origins=[origin], labels=[f"frame {frame}"]))


def _quaternion(rotation: NDArray[np.float64]) -> NDArray[np.float64]:
    """(4,) x, y, z, w of a rotation; of a reflection, which some maps hold, of the rotation of the same box.

    The eigenvector of Bar-Itzhack (2000), which is exact for every angle and the nearest where noise is.
    """
    turn = rotation * np.array([1.0, 1.0, np.sign(np.linalg.det(rotation)) or 1.0])
    (xx, xy, xz), (yx, yy, yz), (zx, zy, zz) = turn.tolist()
    matrix = np.array(
        [
            [xx - yy - zz, yx + xy, zx + xz, zy - yz],
            [yx + xy, yy - xx - zz, zy + yz, xz - zx],
            [zx + xz, zy + yz, zz - xx - yy, yx - xy],
            [zy - yz, xz - zx, yx - xy, xx + yy + zz],
        ]
    )
    _, vectors = np.linalg.eigh(matrix / 3.0)
    return np.asarray(vectors[:, -1], np.float64)
