"""The vector index: exact cosine, a fixed order, filters that lose nothing, and the reference figures on real data."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from cgdb.errors import CorruptionError, ExecuteError, StoreError
from cgdb.index.vectors import VectorIndex


def built(
    path: Path, matrix: NDArray[np.float32], keys: NDArray[np.int64] | None = None, *, approximate_above: int = 200_000
) -> VectorIndex:
    keys = np.arange(len(matrix), dtype=np.int64) if keys is None else keys
    batches = ((keys[b : b + 700], matrix[b : b + 700]) for b in range(0, len(keys), 700))
    meta = VectorIndex.build(path, matrix.shape[1], batches, approximate_above=approximate_above)
    return VectorIndex.open(path, meta)


def cosines(matrix: NDArray[np.float32], query: NDArray[np.float32]) -> NDArray[np.float64]:
    wide, q = matrix.astype(np.float64), query.astype(np.float64)
    lengths = np.linalg.norm(wide, axis=1) * np.linalg.norm(q)
    return np.divide(wide @ q, lengths, out=np.zeros(len(wide)), where=lengths > 0)


@pytest.fixture
def rng() -> np.random.Generator:
    return np.random.default_rng(7)


@pytest.mark.parametrize("share", [None, 0.003, 0.05, 0.3, 1.0])
def test_search_is_exact_with_any_filter(tmp_path: Path, rng: np.random.Generator, share: float | None) -> None:
    matrix = rng.standard_normal((3000, 24), dtype=np.float32) * rng.uniform(0.01, 100, (3000, 1)).astype(np.float32)
    keys = np.sort(rng.choice(10**12, 3000, replace=False))
    index = built(tmp_path / "v", matrix, keys)
    allowed = None if share is None else rng.choice(keys, int(3000 * share), replace=False)
    for query in rng.standard_normal((10, 24), dtype=np.float32):
        truth = cosines(matrix, query)
        among = np.arange(3000) if allowed is None else np.flatnonzero(np.isin(keys, allowed))
        best = among[np.argsort(-truth[among])][:12]
        found, similarities = index.search(query, 12, allowed)
        assert found.tolist() == keys[best].tolist()
        np.testing.assert_allclose(similarities, truth[best], atol=1e-6)


def test_many_queries_are_each_as_alone(tmp_path: Path, rng: np.random.Generator) -> None:
    matrix, queries = rng.standard_normal((500, 8), dtype=np.float32), rng.standard_normal((7, 8), dtype=np.float32)
    index = built(tmp_path / "v", matrix)
    keys, similarities = index.search(queries, 5)
    assert keys.shape == similarities.shape == (7, 5) and keys.dtype == np.int64 and similarities.dtype == np.float32
    for row, query in enumerate(queries):
        alone = index.search(query, 5)
        assert keys[row].tolist() == alone[0].tolist() and similarities[row].tolist() == alone[1].tolist()


def test_equal_vectors_come_by_key_however_they_are_reached(tmp_path: Path, rng: np.random.Generator) -> None:
    same = rng.standard_normal(64, dtype=np.float32)
    matrix = rng.standard_normal((2000, 64), dtype=np.float32)
    twins = np.sort(rng.choice(2000, 40, replace=False))
    matrix[twins] = same
    index = built(tmp_path / "v", matrix)
    for k in (1, 7, 40):
        keys, similarities = index.search(same, k)
        assert keys.tolist() == twins[:k].tolist() and len(set(similarities.tolist())) == 1
        assert index.search(same, k, np.concatenate([twins, [1, 2, 3]]))[0].tolist() == twins[:k].tolist()
        assert index.search(same, k, np.arange(2000)[::-1])[0].tolist() == twins[:k].tolist()


def test_zero_vectors_are_like_nothing(tmp_path: Path) -> None:
    matrix = np.array([[0, 0], [1, 0], [-1, 0], [0, 2]], dtype=np.float32)
    index = built(tmp_path / "v", matrix)
    keys, similarities = index.search(np.array([1, 0], np.float32), 4)
    assert keys.tolist() == [1, 0, 3, 2] and similarities.tolist() == [1, 0, 0, -1]
    assert index.search(np.zeros(2, np.float32), 4)[0].tolist() == [0, 1, 2, 3]


def test_similarities_of_given_keys(tmp_path: Path, rng: np.random.Generator) -> None:
    matrix = rng.standard_normal((100, 16), dtype=np.float32)
    index = built(tmp_path / "v", matrix, np.arange(0, 200, 2))
    query = matrix[30] * 3
    answer = index.similarities(query, np.array([60, 61, -5, 198, 10**9, 0, 60]))
    assert np.isnan(answer[[1, 2, 4]]).all() and answer.dtype == np.float32
    np.testing.assert_allclose(answer[[0, 3, 5, 6]], cosines(matrix, query)[[30, 99, 0, 30]], atol=1e-6)
    assert index.similarities(query, np.array([], np.int64)).shape == (0,)


def test_large_and_tiny_numbers(tmp_path: Path) -> None:
    matrix = np.array([[1e38, 1e38], [1e-38, 0], [0, 3]], dtype=np.float32)
    index = built(tmp_path / "v", matrix)
    found = dict(zip(*(a.tolist() for a in index.search(np.array([2e38, 0], np.float32), 3)), strict=True))
    assert found[1] == pytest.approx(1) and found[0] == pytest.approx(0.5**0.5) and found[2] == 0


def test_edges_of_k_and_of_the_filter(tmp_path: Path, rng: np.random.Generator) -> None:
    matrix = rng.standard_normal((5, 4), dtype=np.float32)
    index = built(tmp_path / "v", matrix, np.array([2, 3, 5, 7, 11]))
    query = matrix[0]
    assert [len(index.search(query, k)[0]) for k in (-1, 0, 1, 5, 6, 10**9)] == [0, 0, 1, 5, 5, 5]
    assert index.search(query, 3, np.array([], np.int64))[0].tolist() == []
    assert index.search(query, 3, np.array([4, 6, 10**15]))[0].tolist() == []
    assert index.search(query, 3, np.array([11, 11, 4]))[0].tolist() == [11]
    empty = built(tmp_path / "w", np.empty((0, 4), np.float32))
    assert len(empty) == 0 and empty.search(query, 3)[0].tolist() == [] and empty.dimension == 4
    assert np.isnan(empty.similarities(query, np.array([1]))).all()


def test_bad_input_is_one_clear_line(tmp_path: Path, rng: np.random.Generator) -> None:
    index = built(tmp_path / "v", rng.standard_normal((5, 4), dtype=np.float32))
    with pytest.raises(ExecuteError, match="has 3 numbers, the space has 4"):
        index.search(np.ones(3, np.float32), 1)
    with pytest.raises(ExecuteError, match="not finite"):
        index.search(np.array([1, 2, np.nan, 0], np.float32), 1)
    for keys, matrix, message in (
        (np.array([1, 0]), np.ones((2, 4), np.float32), "order of their keys"),
        (np.array([1, 1]), np.ones((2, 4), np.float32), "order of their keys"),
        (np.array([1, 2]), np.ones((2, 3), np.float32), "do not fit"),
        (np.array([1]), np.full((1, 4), np.inf, np.float32), "not finite"),
    ):
        with pytest.raises(StoreError, match=message):
            VectorIndex.build(tmp_path / "w", 4, iter([(keys, matrix)]))


def test_a_file_of_another_size_is_refused(tmp_path: Path, rng: np.random.Generator) -> None:
    matrix = rng.standard_normal((50, 4), dtype=np.float32)
    meta = VectorIndex.build(tmp_path / "v", 4, iter([(np.arange(50), matrix)]))
    (tmp_path / "v").write_bytes((tmp_path / "v").read_bytes()[:-1])
    with pytest.raises(CorruptionError):
        VectorIndex.open(tmp_path / "v", meta)


def test_a_mapped_file_answers_as_one_that_was_read(
    tmp_path: Path, rng: np.random.Generator, monkeypatch: pytest.MonkeyPatch
) -> None:
    matrix = rng.standard_normal((900, 16), dtype=np.float32)
    read = built(tmp_path / "v", matrix)
    monkeypatch.setattr("cgdb.index.vectors.MAPPED_ABOVE", 0)
    mapped = built(tmp_path / "w", matrix)
    assert read.search(matrix[5], 9)[0].tolist() == mapped.search(matrix[5], 9)[0].tolist()


def test_a_small_space_needs_no_faiss(tmp_path: Path) -> None:
    code = """
import sys, numpy as np
from pathlib import Path
from cgdb.index.vectors import VectorIndex
meta = VectorIndex.build(Path(sys.argv[1]), 4, iter([(np.arange(4), np.eye(4, dtype=np.float32))]))
assert VectorIndex.open(Path(sys.argv[1]), meta).search(np.eye(4, dtype=np.float32)[2], 1)[0].tolist() == [2]
assert "faiss" not in sys.modules and "kuzu" not in sys.modules
"""
    subprocess.run([sys.executable, "-c", code, str(tmp_path / "v")], check=True, timeout=60)


@pytest.mark.parametrize(("share", "least"), [(1.0, 0.95), (0.5, 0.95), (0.2, 0.97), (0.05, 1.0), (0.01, 1.0)])
def test_the_recall_of_inverted_lists(tmp_path: Path, rng: np.random.Generator, share: float, least: float) -> None:
    centers = rng.standard_normal((300, 32), dtype=np.float32)
    matrix = centers[rng.integers(0, 300, 20_000)] + rng.standard_normal((20_000, 32), dtype=np.float32) * 0.4
    approximate = built(tmp_path / "a", matrix, approximate_above=5_000)
    exact = built(tmp_path / "e", matrix)
    allowed = None if share == 1.0 else np.sort(rng.choice(20_000, int(20_000 * share), replace=False))
    hits = 0
    for query in centers[:60] + rng.standard_normal((60, 32), dtype=np.float32) * 0.5:
        keys, similarities = approximate.search(query, 10, allowed)
        truth, their = exact.search(query, 10, allowed)
        hits += len(set(keys.tolist()) & set(truth.tolist()))
        assert allowed is None or np.isin(keys, allowed).all()
        both = np.isin(keys, truth)
        assert similarities[both].tolist() == their[np.isin(truth, keys)].tolist()
    assert hits / 600 >= least


def test_more_answers_than_the_lists_are_asked_for(tmp_path: Path, rng: np.random.Generator) -> None:
    matrix = rng.standard_normal((6000, 8), dtype=np.float32)
    approximate = built(tmp_path / "a", matrix, approximate_above=5_000)
    keys, _ = approximate.search(matrix[0], 6000)
    assert sorted(keys.tolist()) == list(range(6000)) and keys[0] == 0


def test_the_reference_figures_on_lvis(tmp_path: Path, data: Path) -> None:
    images = np.load(data / "clip" / "lvis_image_features.npy").astype(np.float32)
    texts = np.load(data / "clip" / "lvis_text_features.npy").astype(np.float32)
    keys, _ = built(tmp_path / "v", images).search(texts, 10)
    right = keys == np.arange(len(texts))[:, None]
    recall = [round(float(right[:, :k].any(axis=1).mean()), 4) for k in (1, 3, 5, 10)]
    assert recall == [0.6143, 0.7980, 0.8670, 0.9102]
