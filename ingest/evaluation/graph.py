"""How good a scene graph is: its nodes and edges against an annotated one, the figures of the paper's Table I.

There, people judged every node and edge. Here a node is a valid object where it is one of the annotated objects, by its
box or its id; it is right where it is also called what that object may be called; every further node of one object is a
duplicate. Node precision is the share of right nodes. An edge is right where both its ends are annotated objects and
these are so related; edge precision is the share of right edges, recall the share of annotated relations that some edge
states. Only relations of labels that are asked for count, in the paper "on" and "in".
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

from cgdb.errors import UsageError
from cgdb.ingest.evaluation.annotated import AnnotatedScene
from cgdb.ingest.evaluation.box_overlap import overlaps
from cgdb.ingest.mapping.upright import upright_box
from cgdb.ingest.relations.relate import boxes_of
from cgdb.meaning.vocabulary import fold
from cgdb.scene import ObjectId, Relation, SceneGraph, SceneObject

LEAST_IOU = 0.25
"""Of two boxes that are taken for the same object."""
SAME_LABEL = {
    "on top of": "on", "atop": "on", "lies on": "on", "stands on": "on", "inside": "in", "inside of": "in",
    "within": "in", "close": "near", "close to": "near", "next to": "near",
}  # fmt: skip
"""Labels that say the same, or, of near, more."""
SYMMETRIC = frozenset({"near", "facing each other", "touching"})
Edge = tuple[ObjectId, str, ObjectId]


@dataclass(frozen=True, slots=True, kw_only=True)
class NodeVerdict:
    """What is held of one node. truth: the annotated object that it is, None where it is none."""

    id: ObjectId
    tag: str | None
    truth: ObjectId | None
    right: bool
    duplicate: bool


@dataclass(frozen=True, slots=True, kw_only=True)
class EdgeCount:
    """Of one label, or all: edges of the map, how many are right; relations of the truth, how many are stated."""

    label: str
    edges: int
    right: int
    truth: int
    stated: int

    @property
    def precision(self) -> float | None:
        """None without edges."""
        return self.right / self.edges if self.edges else None

    @property
    def recall(self) -> float | None:
        """None where the truth has none."""
        return self.stated / self.truth if self.truth else None


@dataclass(frozen=True, slots=True, kw_only=True)
class GraphScore:
    """One scene. objects: annotated; found: of these. edges: of all labels together, then by label in labels."""

    nodes: tuple[NodeVerdict, ...]
    objects: int
    found: int
    edges: EdgeCount
    labels: tuple[EdgeCount, ...]

    @property
    def valid(self) -> int:
        """Nodes that are annotated objects."""
        return sum(node.truth is not None for node in self.nodes)

    @property
    def duplicates(self) -> int:
        """Further nodes of objects that have one."""
        return sum(node.duplicate for node in self.nodes)

    @property
    def precision(self) -> float | None:
        """Of the nodes; None without any."""
        return sum(node.right for node in self.nodes) / len(self.nodes) if self.nodes else None


def nodes_of(scene: SceneGraph) -> tuple[SceneObject, ...]:
    """The objects of a scene that count as nodes: not the room itself, nor what was found to be no object."""
    return tuple(
        obj for obj in scene.objects if not obj.properties.get("background") and not obj.properties.get("invalid")
    )


def evaluate_graph(
    scene: SceneGraph,
    truth: AnnotatedScene,
    *,
    by: str = "auto",
    least_iou: float = LEAST_IOU,
    labels: Sequence[str] = (),
    same: Mapping[str, str] | None = None,
    origins: Sequence[str] = (),
    least_confidence: float = 0.0,
    exclude: Sequence[str] = (),
) -> GraphScore:
    """The scene's figures.

    by: "box", "id", or "auto", boxes where all of both have one. labels: that count, else those of the truth. same:
    {label: the one that it is taken for}. origins, least_confidence: of the scene's edges that are looked at. exclude:
    what is called so counts neither as node nor as object, nor do its edges; a person need not annotate floors.
    """
    room = {fold(name) for name in exclude}
    objects = [obj for obj in truth.objects if room.isdisjoint(_names(obj))]
    nodes = [obj for obj in nodes_of(scene) if obj.tag is None or not is_called(obj, tuple(room))]
    shown = match(nodes, objects, "box" if truth.of_cloud and by == "auto" else by, least_iou, scene.up)
    acceptable = {obj.id: _names(obj) for obj in objects}
    verdicts = tuple(
        NodeVerdict(
            id=node.id,
            tag=node.tag,
            truth=shown[node.id][0] if node.id in shown else None,
            right=node.id in shown and is_called(node, acceptable[shown[node.id][0]]),
            duplicate=node.id in shown and not shown[node.id][1],
        )
        for node in nodes
    )
    means = _meanings(same)
    places = frozenset(place.id for place in scene.places)
    stands_for: dict[ObjectId, ObjectId] = {place: place for place in places & truth.places}
    stands_for |= {node: found[0] for node, found in shown.items()}
    wanted = {_label(label, means) for label in labels}
    asked = {obj.id for obj in objects} | truth.places
    stated = (_edge(r, means, truth.places) for r in truth.relations if {r.source, r.target} <= asked)
    true = {edge for edge in stated if not wanted or edge[1] in wanted}
    counted = (wanted or {label for _, label, _ in true}) if not truth.of_cloud else set()
    edges: dict[Edge, Edge | None] = {}
    looked_at = {node.id for node in nodes} | places
    for relation in scene.relations:
        if origins and relation.origin not in origins:
            continue
        if relation.confidence < least_confidence or not {relation.source, relation.target} <= looked_at:
            continue
        edge = _edge(relation, means, places)
        if edge[1] in counted:
            ends = stands_for.get(edge[0]), stands_for.get(edge[2])
            edges[edge] = None if None in ends else _ordered(ends[0], edge[1], ends[1])  # type: ignore[arg-type]
    found = {shown[node][0] for node in shown}
    return GraphScore(
        nodes=verdicts,
        objects=len(objects),
        found=len(found),
        edges=_count("all", edges, true),
        labels=tuple(
            _count(label, {e: t for e, t in edges.items() if e[1] == label}, {e for e in true if e[1] == label})
            for label in sorted(counted)
        ),
    )


def same_labels(labels: Sequence[str], same: Mapping[str, str] | None = None) -> Callable[[str], bool]:
    """Whether a label says one of these."""
    means = _meanings(same)
    wanted = {_label(label, means) for label in labels}
    return lambda label: _label(label, means) in wanted


def match(
    nodes: Sequence[SceneObject], objects: Sequence[SceneObject], by: str, least_iou: float, up: str
) -> dict[ObjectId, tuple[ObjectId, bool]]:
    """{node: (the annotated object that it is, whether it is the best of those that are)}.

    Pairs are taken greedily, by how much their boxes overlap, those that are called the same before all others.
    """
    nodes, objects = [_boxed(node, up) for node in nodes], [_boxed(obj, up) for obj in objects]
    boxed = bool(nodes) and bool(objects) and all(obj.extent is not None for obj in (*nodes, *objects))
    if by == "id" or (by == "auto" and not boxed):
        known = {obj.id for obj in objects}
        found: dict[ObjectId, tuple[ObjectId, bool]] = {node.id: (node.id, True) for node in nodes if node.id in known}
        if not found and nodes and objects:
            raise UsageError(
                "the scene and the truth have no id in common, and not all of their objects have boxes to compare",
                hint="give the annotated objects boxes or points, or the ids of the map",
            )
        return found
    some = [node for node in nodes if node.center is not None]
    others = [obj for obj in objects if obj.center is not None]
    if not some or not others:
        return {}
    met = overlaps(boxes_of(some), boxes_of(others), up)
    ranked = [
        (iou + is_called(some[row], _names(others[column])), row, column)
        for row, column, iou in zip(met.first.tolist(), met.second.tolist(), met.iou.tolist(), strict=True)
        if iou >= least_iou
    ]
    ranked.sort(key=lambda one: -one[0])
    first: dict[int, int] = {}
    taken: set[int] = set()
    for _, row, column in ranked:
        if row not in first and column not in taken:
            first[row] = column
            taken.add(column)
    # What is left over is the same thing once more.
    best: dict[int, int] = {}
    for _, row, column in ranked:
        best.setdefault(row, column)
    return {some[row].id: (others[first.get(row, column)].id, row in first) for row, column in sorted(best.items())}


def _boxed(obj: SceneObject, up: str) -> SceneObject:
    """With the box round its points, where it states none."""
    if obj.extent is not None or obj.points is None or not len(obj.points):
        return obj
    center, extent, rotation = upright_box(obj.points, up)
    return replace(obj, center=center, extent=extent, rotation=rotation)


def is_called(node: SceneObject, names: Sequence[str]) -> bool:
    """Whether a node bears one of the names, as its tag or the end of it: a wooden chair is a chair. Without a tag its
    caption must hold the name."""
    if node.tag:
        tag = f" {fold(node.tag)}"
        return any(tag.endswith(f" {name}") for name in names)
    words = f" {''.join(c if c.isalnum() else ' ' for c in fold(node.caption or ''))} "
    return any(f" {name} " in words for name in names)


def _names(obj: SceneObject) -> tuple[str, ...]:
    return tuple(fold(name) for name in dict.fromkeys((obj.tag, *obj.tags)) if name)


def _meanings(same: Mapping[str, str] | None) -> dict[str, str]:
    return {**SAME_LABEL, **{_plain(a): _plain(b) for a, b in (same or {}).items()}}


def _plain(label: str) -> str:
    return " ".join(label.casefold().replace("_", " ").split())


def _label(label: str, means: Mapping[str, str]) -> str:
    plain = _plain(label)
    for _ in range(len(means)):
        if plain not in means or means[plain] == plain:
            break
        plain = means[plain]
    return plain


def _edge(relation: Relation, means: Mapping[str, str], places: frozenset[ObjectId] | set[ObjectId]) -> Edge:
    """In one form: what contains has it in it, and of what holds either way the smaller id comes first."""
    source, target, label = relation.source, relation.target, _label(relation.label, means)
    if label == "contains" and source not in places:
        source, target, label = target, source, _label("in", means)
    return _ordered(source, label, target)


def _ordered(source: ObjectId, label: str, target: ObjectId) -> Edge:
    if label in SYMMETRIC and (isinstance(source, str), str(source)) > (isinstance(target, str), str(target)):
        source, target = target, source
    return source, label, target


def _count(label: str, edges: Mapping[Edge, Edge | None], true: set[Edge]) -> EdgeCount:
    right = [means for means in edges.values() if means in true]
    return EdgeCount(label=label, edges=len(edges), right=len(right), truth=len(true), stated=len({*right}))
