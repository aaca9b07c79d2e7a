"""How right and how fast relations from geometry are.

    python benchmarks/relations.py FOLDER      FOLDER holds VirtualHome graphs (*_graph.json)

Right: against the ON, INSIDE and CLOSE edges of simulated flats. Their ON is far from complete (a perfume that stands
on a counter is on nothing), and their INSIDE is by boxes too (fruit lies in an L-shaped sofa's box), so precision reads
lower, and recall of INSIDE higher, than a person would say. near keeps to the nearest few, CLOSE does not.
Fast: rooms of made-up furniture, 1,000 and 10,000 objects, with how many pairs were looked at.
"""

from __future__ import annotations

import argparse
import json
import sys
import time
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from cgdb.ingest.relations.boxes import Boxes, near_pairs, prisms
from cgdb.ingest.relations.relate import Limits, contained_in_places, geometric_relations
from cgdb.scene import ObjectId, Place, SceneGraph, SceneObject

STRUCTURE = {"Walls", "Ceiling", "Floor", "Floors", "Rooms"}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=Path, help="VirtualHome graphs: *_graph.json")
    parser.add_argument("--show", metavar="NAME", help="also print the misses and false alarms of this flat")
    arguments = parser.parse_args()
    files = sorted(arguments.folder.glob("*_graph.json"))
    if not files:
        sys.exit(f"no *_graph.json in {arguments.folder}")
    print("Against the edges of simulated flats (conf: only relations of at least this confidence)")
    print(f"{'flat':<20} {'relation':<18} {'conf':>4} {'truth':>6} {'found':>6} {'precision':>9} {'recall':>7}")
    for file in files:
        for name, least, truth, found in compare(file, show=arguments.show is not None and arguments.show in file.name):
            right = len(truth & found)
            precision = f"{right / len(found):9.3f}" if found else f"{'-':>9}"
            recall = f"{right / len(truth):7.3f}" if truth else f"{'-':>7}"
            print(
                f"{file.stem.removesuffix('_graph'):<20} {name:<18} {least:>4} {len(truth):>6} {len(found):>6} "
                f"{precision} {recall}"
            )
    print()
    print("Made-up flats (a room of 20 objects per 16 m2)")
    print(f"{'objects':>8} {'seconds':>8} {'relations':>9} {'pairs compared':>14} {'all pairs':>12}")
    limits = Limits()
    for count in (1_000, 10_000):
        boxes = furnished_rooms(count)
        started = time.perf_counter()
        relations = geometric_relations(range(count), boxes)
        seconds = time.perf_counter() - started
        pairs = near_pairs(prisms(boxes, "z"), across=limits.near_gap, upright=limits.vertical_gap, crowd=limits.crowd)
        print(f"{count:>8} {seconds:>8.3f} {len(relations):>9} {pairs.compared:>14} {count * (count - 1) // 2:>12}")


Pair = tuple[ObjectId, ObjectId]


def compare(file: Path, *, show: bool = False) -> list[tuple[str, float, set[Pair], set[Pair]]]:
    """(relation, least confidence, true pairs, found pairs) of one flat."""
    graph = json.loads(file.read_text())
    nodes = {node["id"]: node for node in graph["nodes"] if node["category"] != "Rooms" and node["bounding_box"]}
    structure = {i for i, node in nodes.items() if node["category"] in STRUCTURE}
    floors = {i for i, node in nodes.items() if node["category"] in {"Floor", "Floors"}}
    edges: dict[str, set[Pair]] = {"ON": set(), "INSIDE": set(), "CLOSE": set()}
    for edge in graph["edges"]:
        pair = (edge["from_id"], edge["to_id"])
        if edge["relation_type"] in edges and pair[0] in nodes and pair[1] in nodes and pair[0] not in structure:
            edges[edge["relation_type"]].add(pair)
    ids = list(nodes)
    boxes = Boxes(
        centers=np.array([nodes[i]["bounding_box"]["center"] for i in ids], dtype=np.float64),
        extents=np.array([nodes[i]["bounding_box"]["size"] for i in ids], dtype=np.float64),
    )
    relations = geometric_relations(ids, boxes, up="y", structure=[i in structure for i in ids])

    def found(labels: set[str], least: float = 0.0) -> set[Pair]:
        return {(r.source, r.target) for r in relations if r.label in labels and r.confidence >= least}

    def things(pairs: set[Pair]) -> set[Pair]:
        return {pair for pair in pairs if pair[1] not in structure}

    def unordered(pairs: set[Pair]) -> set[Pair]:
        return {(min(pair), max(pair)) for pair in things(pairs)}

    rows = [
        (f"on{'' if least else ' (any)'}", least, things(edges["ON"]), things(found({"on"}, least)))
        for least in (0.0, 0.6)
    ]
    on_floors = [{pair for pair in pairs if pair[1] in floors} for pairs in (edges["ON"], found({"on"}))]
    rows.append(("on a floor", 0.0, on_floors[0], on_floors[1]))
    rows.extend(("in", least, things(edges["INSIDE"]), things(found({"in"}, least))) for least in (0.0, 0.7))
    rows.append(("on or in", 0.0, things(edges["ON"] | edges["INSIDE"]), things(found({"on", "in"}))))
    rows.append(("close", 0.0, unordered(edges["CLOSE"]), unordered(found({"near", "next_to"}))))
    rows.append(("close, any label", 0.0, unordered(edges["CLOSE"]), unordered(found({"near", "next_to", "on", "in"}))))
    rows.append(("in a room", 0.0, *rooms(graph, nodes, structure)))
    if show:
        for name, _, truth, seen in (rows[0], rows[3]):
            for verdict, pairs in (("missed", truth - seen), ("false", seen - truth)):
                for a, b in sorted(pairs):
                    print(f"  {verdict:<7} {name:<9} {_describe(nodes[a])} | {_describe(nodes[b])}")
    return rows


def rooms(graph: dict[str, Any], nodes: dict[int, dict[str, Any]], structure: set[int]) -> tuple[set[Pair], set[Pair]]:
    """(object, room) pairs as the flat says, and as the boxes of its rooms say."""
    places = {node["id"]: node for node in graph["nodes"] if node["category"] == "Rooms"}
    scene = SceneGraph(
        name="flat",
        objects=tuple(SceneObject(id=i, center=_triple(nodes[i], "center")) for i in nodes if i not in structure),
        places=tuple(
            Place(id=i, kind="Room", center=_triple(place, "center"), extent=_triple(place, "size"))
            for i, place in places.items()
        ),
        up="y",
    )
    truth = {
        (edge["from_id"], edge["to_id"])
        for edge in graph["edges"]
        if edge["relation_type"] == "INSIDE"
        and edge["to_id"] in places
        and edge["from_id"] not in {*structure, *places}
    }
    return truth, {(relation.target, relation.source) for relation in contained_in_places(scene)}


def _triple(node: dict[str, Any], name: str) -> NDArray[np.float64]:
    return np.array(node["bounding_box"][name], dtype=np.float64)


def _describe(node: dict[str, Any]) -> str:
    box = node["bounding_box"]
    low = box["center"][1] - box["size"][1] / 2
    return (
        f"{node['id']} {node['class_name']} at {[round(c, 2) for c in box['center']]} "
        f"size {[round(s, 2) for s in box['size']]} low {low:.2f} high {low + box['size'][1]:.2f}"
    )


def furnished_rooms(count: int) -> Boxes:
    """``count`` boxes in rooms of 4 m x 4 m: a floor, furniture on it at any angle, small things on that, a lamp."""
    random = np.random.default_rng(7)
    rooms = -(-count // 20)
    columns = int(np.ceil(np.sqrt(rooms)))
    centers, extents, angles = [], [], []
    for room in range(rooms):
        corner = np.array([room % columns, room // columns]) * 4.5
        centers.append([*(corner + 2.0), -0.05])
        extents.append([4.0, 4.0, 0.1])
        angles.append(0.0)
        for _ in range(6):
            at, size, angle = corner + random.uniform(0.5, 3.5, 2), random.uniform(0.3, 1.5, 3), random.uniform(0, 3.2)
            centers.append([*at, size[2] / 2])
            extents.append(list(size))
            angles.append(angle)
            for _ in range(2):
                small = random.uniform(0.03, 0.3, 3)
                offset = random.uniform(-0.3, 0.3, 2) * size[:2]
                turned = [
                    np.cos(angle) * offset[0] - np.sin(angle) * offset[1],
                    np.sin(angle) * offset[0] + np.cos(angle) * offset[1],
                ]
                centers.append([*(at + turned), size[2] + small[2] / 2 + random.normal(0, 0.01)])
                extents.append(list(small))
                angles.append(random.uniform(0, 3.2))
        centers.append([*(corner + 2.0), 2.3])
        extents.append([0.4, 0.4, 0.2])
        angles.append(0.0)
    turn = np.array(angles[:count])
    rotations = np.zeros((count, 3, 3))
    rotations[:, 0, 0] = rotations[:, 1, 1] = np.cos(turn)
    rotations[:, 1, 0] = np.sin(turn)
    rotations[:, 0, 1] = -np.sin(turn)
    rotations[:, 2, 2] = 1.0
    return Boxes(centers=np.array(centers[:count]), extents=np.array(extents[:count]), rotations=rotations)


if __name__ == "__main__":
    main()
