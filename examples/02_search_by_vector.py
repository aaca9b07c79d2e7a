"""Bring your own vectors: give every object one, and find the nearest to a vector of yours or to a text.

The vectors here are three numbers, the colour of the object, so that they can be understood by looking at them. A CLIP
feature of 512 or 1024 numbers is used in the same way.

    python examples/02_search_by_vector.py
"""

import tempfile
from dataclasses import replace
from pathlib import Path

import numpy as np

import cgdb
import cgdb.ingest
from cgdb.scene import FeatureSpace

MAP = Path(__file__).parent.parent / "cli" / "flat.json"

COLORS = {
    "red": (1, -1, -1),
    "orange": (1, 0, -1),
    "yellow": (1, 1, -1),
    "green": (-1, 1, -1),
    "teal": (-1, 1, 1),
    "blue": (-1, -1, 1),
    "navy": (-1, -1, 0.5),
    "white": (1, 1, 1),
    "black": (-1, -1, -1),
}

flat = cgdb.ingest.load(MAP)
flat = replace(
    flat,
    spaces=(FeatureSpace(name="color", dimension=3),),
    objects=tuple(
        replace(obj, features={"color": np.array(COLORS[color], dtype=np.float32)})
        if (color := obj.properties.get("color")) in COLORS
        else obj
        for obj in flat.objects
    ),
)

with tempfile.TemporaryDirectory() as folder, cgdb.open(Path(folder) / "flat.cgdb", create=True) as db:
    db.add(flat)

    print("Nearest to orange, by vector:")
    hits = db.search(np.array([1.0, -0.2, -1.0], dtype=np.float32), space="color", k=5)
    for hit, node in zip(hits, hits.nodes, strict=True):
        print(f"  {hit.score:.2f}  {node}: {node.caption}")

    print("Nearest to a text, among what is smaller than 0.1 cubic metres:")
    hits = db.search("red shoes", k=5, where="volume(o) < 0.1")
    for hit, node in zip(hits, hits.nodes, strict=True):
        print(f"  {hit.score:.2f}  {node}: {node.caption}")
