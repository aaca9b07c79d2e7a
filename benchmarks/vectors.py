"""Vector search next to bare FAISS and NumPy, in one run: python benchmarks/vectors.py [--large]

Real CLIP features (CGDB_TEST_DATA/clip) give the recall of the reference; sizes beyond them are drawn around them.
Each figure is the median of one search for ten neighbours, in milliseconds.
"""

from __future__ import annotations

import os
import statistics
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import faiss
import numpy as np
from numpy.typing import NDArray

from cgdb.index.vectors import VectorIndex

K = 10


def milliseconds(search: Callable[[NDArray[np.float32]], Any], queries: NDArray[np.float32]) -> float:
    for query in queries[:3]:
        search(query)
    times = []
    for query in queries:
        began = time.perf_counter()
        search(query)
        times.append(time.perf_counter() - began)
    return 1000 * statistics.median(times)


def by_numpy(matrix: NDArray[np.float32], query: NDArray[np.float32], rows: NDArray[np.int64] | None) -> Any:
    similarities = matrix @ query if rows is None else matrix[rows] @ query
    best = np.argpartition(similarities, len(similarities) - K)[-K:]
    return best[np.argsort(-similarities[best])]


def reference(folder: Path, scratch: Path) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
    """Print the recall on LVIS; returns the image and the text features."""
    images = np.load(folder / "lvis_image_features.npy").astype(np.float32)
    texts = np.load(folder / "lvis_text_features.npy").astype(np.float32)
    meta = VectorIndex.build(scratch / "lvis", 512, iter([(np.arange(len(images)), images)]))
    index = VectorIndex.open(scratch / "lvis", meta)
    began = time.perf_counter()
    keys, _ = index.search(texts, K)
    spent = 1000 * (time.perf_counter() - began) / len(texts)
    right = keys == np.arange(len(texts))[:, None]
    recall = "  ".join(f"R@{k} {right[:, :k].any(axis=1).mean():.4f}" for k in (1, 3, 5, 10))
    print(f"LVIS, {len(texts)} names against {len(images)} images: {recall}  ({spent:.3f} ms per search)")
    return images, texts


def around(images: NDArray[np.float32], n: int) -> Iterator[tuple[NDArray[np.int64], NDArray[np.float32]]]:
    rng = np.random.default_rng(n)
    unit = images / np.linalg.norm(images, axis=1, keepdims=True)
    for start in range(0, n, 10_000):
        size = min(10_000, n - start)
        noise = rng.standard_normal((size, 512), dtype=np.float32) * np.float32(0.6 / 512**0.5)
        yield np.arange(start, start + size), unit[rng.integers(0, len(unit), size)] + noise


def compare(images: NDArray[np.float32], texts: NDArray[np.float32], n: int, scratch: Path) -> None:
    path = scratch / f"v{n}"
    began = time.perf_counter()
    meta = VectorIndex.build(path, 512, around(images, n))
    build = time.perf_counter() - began
    began = time.perf_counter()
    index = VectorIndex.open(path, meta)
    opening = 1000 * (time.perf_counter() - began)
    matrix = np.concatenate([m for _, m in around(images, n)])
    faiss.normalize_L2(matrix)
    flat = faiss.IndexFlatIP(512)
    flat.add(matrix)
    queries = texts[:60] / np.linalg.norm(texts[:60], axis=1, keepdims=True)
    print(f"{n:>9,} x 512: built in {build:.2f} s, opened in {opening:.1f} ms, {path.stat().st_size / 1e6:.0f} MB")
    for share in (1.0, 0.5, 0.1, 0.01):
        rows = None if share == 1 else np.sort(np.random.default_rng(1).choice(n, int(n * share), replace=False))
        options = None if rows is None else faiss.SearchParameters(sel=faiss.IDSelectorBatch(rows))
        own = milliseconds(lambda q, rows=rows: index.search(q, K, rows), queries)
        bare = milliseconds(lambda q, options=options: flat.search(q[None], K, params=options), queries)
        plain = milliseconds(lambda q, rows=rows: by_numpy(matrix, q, rows), queries)
        hits = [
            len(set(index.search(q, K, rows)[0].tolist()) & set(flat.search(q[None], K, params=options)[1][0].tolist()))
            for q in queries
        ]
        print(
            f"  {share:>5.0%} allowed: cgdb {own:8.3f}   bare faiss {bare:8.3f}   numpy {plain:8.3f}   "
            f"cgdb/faiss {own / bare:5.2f}   recall@{K} {np.mean(hits) / K:.3f}"
        )


def main() -> int:
    folder = os.environ.get("CGDB_TEST_DATA")
    if not folder:
        print("CGDB_TEST_DATA is not set: this benchmark needs the real CLIP features", file=sys.stderr)
        return 2
    with tempfile.TemporaryDirectory() as scratch:
        images, texts = reference(Path(folder) / "clip", Path(scratch))
        for n in (1_000, 10_000, 100_000, *([300_000] if "--large" in sys.argv else [])):
            compare(images, texts, n, Path(scratch))
    return 0


if __name__ == "__main__":
    sys.exit(main())
