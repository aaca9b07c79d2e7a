"""Search through a store: how right on real CLIP features, and how fast beside bare FAISS and NumPy.

    python -m benchmarks search [--sizes 1000 10000 100000]

Right: every LVIS class is looked for by the text feature of its name among the image features of all 1203 classes,
which $CGDB_TEST_DATA/clip holds. Fast: the ten nearest of made-up 512-d vectors, to all of them and to a share of the
ids. FAISS is given its filter ready-made (an IDSelector), db.search positions of objects, as a condition gives them.
"""

from __future__ import annotations

import importlib
import json
import os
import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

import cgdb
from benchmarks import report, world
from cgdb.database import Database
from cgdb.meaning.meanings import VectorMeaning
from cgdb.query.search import search

K = 10
EXACT = {1: 0.6143, 3: 0.7980, 5: 0.8670, 10: 0.9102}
"""Recall at k of an exact search by cosine over these features."""


def recall(folder: Path) -> None:
    """All names against all pictures, through db.search."""
    pictures = np.load(folder / "lvis_image_features.npy").astype(np.float32)
    texts = np.load(folder / "lvis_text_features.npy").astype(np.float32)
    names = json.loads((folder / "lvis_names.json").read_text("utf-8"))
    objects = tuple(
        cgdb.SceneObject(id=i, tag=name, features={"clip": vector})
        for i, (name, vector) in enumerate(zip(names, pictures, strict=True))
    )
    space = cgdb.FeatureSpace(name="clip", dimension=pictures.shape[1])
    with tempfile.TemporaryDirectory() as made, cgdb.open(Path(made) / "lvis", create=True, text_encoder=None) as db:
        db.add(cgdb.SceneGraph(name="lvis", objects=objects, spaces=(space,)))
        places = [db.search(text, k=K).ids for text in texts]
    ranks = np.array([found.index(i) if i in found else K for i, found in enumerate(places)])
    rows = []
    for k, exact in EXACT.items():
        share = float((ranks < k).mean())
        rows.append([f"R@{k}", f"{share:.4f}", f"{exact:.4f}", "yes" if f"{share:.4f}" == f"{exact:.4f}" else "NO"])
    n = len(names)
    report.table(f"CLIP ViT-B/32: {n} LVIS names against {n} image features", ["", "db.search", "exact", "same"], rows)


def speed(db: Database, count: int, rounds: int) -> list[list[str]]:
    """One row per share of allowed ids: db.search, FAISS and NumPy, medians of searches that take turns."""
    faiss: Any = importlib.import_module("faiss")

    view = db.view("world")
    matrix = np.array([o.features[world.SPACE] for o in world.objects(count)])
    matrix /= np.linalg.norm(matrix, axis=1, keepdims=True)
    flat = faiss.IndexFlatIP(world.DIMENSION)
    flat.add(matrix)
    dice = np.random.default_rng(5)
    near = matrix[dice.integers(count, size=rounds + 20)]
    queries = (near + 0.05 * dice.standard_normal(near.shape)).astype(np.float32)
    rows = []
    for share in (1.0, 0.5, 0.01):
        allowed = None if share == 1.0 else np.sort(dice.choice(count, int(count * share), replace=False))
        filtered = None if allowed is None else faiss.SearchParameters(sel=faiss.IDSelectorBatch(allowed))

        def cgdb_ids(i: int, only: NDArray[np.int64] | None = allowed) -> list[Any]:
            if only is None:
                return db.search(queries[i], k=K).ids
            meaning = VectorMeaning(parameter="vector", vector=cgdb.Vector(values=queries[i]))
            return search([view], meaning, space=None, k=K, allowed=[only]).ids

        def faiss_ids(i: int, options: Any = filtered) -> list[int]:
            nearest: list[int] = flat.search(queries[i : i + 1], K, params=options)[1][0].tolist()
            return nearest

        def numpy_ids(i: int, only: NDArray[np.int64] | None = allowed) -> list[int]:
            similar = matrix @ queries[i] if only is None else matrix[only] @ queries[i]
            best = np.argpartition(-similar, K - 1)[:K]
            best = best[np.argsort(-similar[best])]
            found: list[int] = (best if only is None else only[best]).tolist()
            return found

        runs: dict[str, Callable[[int], list[Any]]] = {"cgdb": cgdb_ids, "faiss": faiss_ids, "numpy": numpy_ids}
        same = np.mean([len(set(cgdb_ids(i)) & set(numpy_ids(i))) / K for i in range(20)])
        times = {name: taken.median for name, taken in report.alternating(runs, rounds).items()}
        rows.append(
            [
                f"{count:,} x {world.DIMENSION}",
                f"{100 * share:g} %",
                *(report.ms(times[name]) for name in runs),
                f"{times['cgdb'] / times['faiss']:.2f}",
                f"{times['cgdb'] / times['numpy']:.2f}",
                f"{same:.3f}",
            ]
        )
    return rows


def main() -> None:
    parser = report.arguments(__doc__, [1_000, 10_000, 100_000])
    parser.add_argument("--rounds", type=int, default=300, help="searches by each, a tenth at 100,000 and more")
    options = parser.parse_args()
    print(report.machine())
    data = os.environ.get("CGDB_TEST_DATA")
    if data:
        recall(Path(data) / "clip")
    else:
        print("The recall on CLIP features is left out: CGDB_TEST_DATA names no folder of real data.")
    rows = []
    with report.folder_of_stores(options.stores) as folder:
        for count in options.sizes:
            rounds = max(20, options.rounds // (10 if count >= 100_000 else 1))
            with cgdb.open(world.store(folder, count, None), text_encoder=None) as db:
                rows.extend(speed(db, count, rounds))
    report.table(
        f"The {K} nearest, ms per search, median of {options.rounds} (a tenth at 100,000); aim: at most 2x FAISS",
        ["vectors", "allowed", "db.search", "FAISS flat", "NumPy", "x FAISS", "x NumPy", "same ids as NumPy"],
        rows,
    )


if __name__ == "__main__":
    main()
