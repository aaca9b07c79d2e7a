"""The vector index: the feature vectors of one space, one scene, one revision, searched by cosine similarity.

A file is the matrix, row by row, then the keys, then (in a large space only) FAISS's own index. NumPy compares rows as
fast as FAISS does, and a small space is searched before FAISS would have been imported: it is asked where it is better.
"""

from __future__ import annotations

import math
import mmap
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np
from numpy.typing import NDArray

from cgdb.errors import CorruptionError, ExecuteError, MissingExtraError, StoreError

APPROXIMATE_ABOVE = 200_000
"""Rows. Up to here every row is compared: 9 to 18 ms per search at 100k x 512, what bare faiss takes, at recall 1.
Above, FAISS picks candidates by inverted lists over 8-bit codes, and these are compared exactly. Not HNSW: texts are
foreign to a space of pictures, and on LVIS-like data at 100k its recall@10 for text queries was .60 to .91 (efSearch
32 to 256) after a build of 64 s, where inverted lists gave .98 (a tenth of the lists probed) after one of 3 to 8 s."""
PROBED = 0.12
"""Share of the inverted lists that one search reads."""
MAPPED_ABOVE = 32 << 20
"""Bytes. Below, a file is read whole (a copy of 2 MB is nothing, and no later harm to the file reaches it); above,
it is mapped: processes share the pages, and opening costs nothing."""
FEWEST_LISTED = 1_000
MOST_LISTED = 1_000
"""Answers that are asked of the inverted lists; for more, every row is compared."""
GATHER_BELOW = 0.25
"""Share of allowed rows up to which these are picked out and compared; above, all rows are, and the rest is dropped.
Measured at 10k x 512: picking costs 0.01 / 0.09 / 0.19 / 0.7 ms at 1 / 10 / 20 / 50 %, comparing all rows 0.25 ms."""
BLOCK = 256
"""Rows that are picked out at a time: half a megabyte at 512 dimensions stays in the cache of a core."""
TIE_MARGIN = 1e-5
"""Similarities of one matrix product differ in their last bits with its shape: what is as near as this to the last
place is compared again, exactly, before anything is ordered."""


class VectorIndex:
    """An open vector index. ``keys`` (n,) int64 ascending; row i of the matrix (n, dimension) is the vector of keys[i].

    Rows are float32 of length 1, or 0 where the vector was zero: its cosine with everything is 0.
    """

    def __init__(self, keys: NDArray[np.int64], matrix: NDArray[np.float32], lists: Any = None) -> None:
        self.keys = keys
        self._matrix = matrix
        self._lists = lists

    @property
    def matrix(self) -> NDArray[np.float32]:
        """(n, d) float32 the vectors, each of length 1 (or 0); not to be written to."""
        return self._matrix

    @property
    def dimension(self) -> int:
        """The length of each vector."""
        return int(self._matrix.shape[1])

    def __len__(self) -> int:
        return len(self.keys)

    @classmethod
    def build(
        cls,
        path: Path,
        dimension: int,
        batches: Iterator[tuple[NDArray[np.int64], NDArray[np.float32]]],
        *,
        approximate_above: int = APPROXIMATE_ABOVE,
    ) -> dict[str, Any]:
        """Write a new index from batches of (keys (b,) int64 ascending, matrix (b, dimension) float32).

        Returns its meta, which :meth:`open` needs.
        """
        parts: list[NDArray[np.int64]] = []
        last = -(2**63)
        with path.open("wb") as file:
            for keys, matrix in batches:
                keys = np.ascontiguousarray(keys, dtype=np.int64)
                if matrix.shape != (len(keys), dimension):
                    raise StoreError(f"vectors of shape {matrix.shape} do not fit {len(keys)} keys x {dimension}")
                if not len(keys):
                    continue
                if keys[0] <= last or (np.diff(keys) <= 0).any():
                    raise StoreError("vectors must come in the order of their keys, each key once")
                last = int(keys[-1])
                parts.append(keys)
                file.write(_normalised(matrix).data)
            keys = np.concatenate(parts) if parts else np.empty(0, np.int64)
            file.write(keys.tobytes())
        lists = 0
        if len(keys) > max(approximate_above, FEWEST_LISTED):
            lists = _append_lists(path, len(keys), dimension)
        return {"n": len(keys), "dimension": dimension, "lists": lists}

    @classmethod
    def open(cls, path: Path, meta: Mapping[str, Any]) -> VectorIndex:
        """Open a built index; ``meta`` is what :meth:`build` returned."""
        n, dimension, lists = int(meta["n"]), int(meta["dimension"]), int(meta["lists"])
        split, end = n * dimension * 4, n * (dimension * 4 + 8)
        with path.open("rb") as file:
            data = _contents(file)
        if len(data) != end + lists:
            raise CorruptionError(f"the vector index {path.name} has {len(data)} bytes of {end + lists}")
        matrix = np.frombuffer(data, dtype=np.float32, count=n * dimension).reshape(n, dimension)
        keys = np.frombuffer(data, dtype=np.int64, count=n, offset=split)
        if not lists:
            return cls(keys, matrix)
        return cls(keys, matrix, _faiss().deserialize_index(np.frombuffer(data, dtype=np.uint8, offset=end)))

    def search(
        self, query: NDArray[np.float32], k: int, allowed: NDArray[np.int64] | None = None
    ) -> tuple[NDArray[np.int64], NDArray[np.float32]]:
        """The k nearest by cosine: (keys, similarities), most similar first, equal ones by key.

        For a query (d,) both are (k',) with k' = min(k, rows allowed); for (m, d) both are (m, k'). ``allowed``
        restricts the answer to these keys; keys without a vector are passed over.
        """
        queries = self._queries(query)
        rows = None if allowed is None else self._rows_of(allowed)
        available = len(self) if rows is None else len(rows)
        k = min(max(k, 0), available)
        if query.ndim == 1:
            places, similarities = self._nearest(queries[0], k, rows)
            return self.keys[places], similarities
        found = [self._nearest(q, k, rows) for q in queries]
        keys = np.array([self.keys[r] for r, _ in found], dtype=np.int64).reshape(len(queries), k)
        return keys, np.array([s for _, s in found], dtype=np.float32).reshape(len(queries), k)

    def similarities(self, query: NDArray[np.float32], keys: NDArray[np.int64]) -> NDArray[np.float32]:
        """The exact cosine of ``query`` (d,) with the vector of each key, (len(keys),); nan for a key without one."""
        q = self._queries(query)[0]
        keys = np.asarray(keys, dtype=np.int64)
        answer = np.full(len(keys), np.nan, dtype=np.float32)
        if len(self):
            places = np.minimum(np.searchsorted(self.keys, keys), len(self) - 1)
            known = self.keys[places] == keys
            answer[known] = self._exact(q, places[known])
        return answer

    # ------------------------------------------------------------------------------------------------------------

    def _queries(self, query: NDArray[np.float32]) -> NDArray[np.float32]:
        queries = np.atleast_2d(np.asarray(query, dtype=np.float32))
        if queries.ndim != 2 or queries.shape[1] != self.dimension:
            raise ExecuteError(f"the query vector has {queries.shape[-1]} numbers, the space has {self.dimension}")
        try:
            return _normalised(queries)
        except StoreError:
            raise ExecuteError("the query vector holds a number that is not finite") from None

    def _rows_of(self, keys: NDArray[np.int64]) -> NDArray[np.intp]:
        keys = np.asarray(keys, dtype=np.int64)
        if not len(self) or not len(keys):
            return np.empty(0, np.intp)
        if (np.diff(keys) <= 0).any():
            keys = np.unique(keys)
        places = np.minimum(np.searchsorted(self.keys, keys), len(self) - 1)
        rows: NDArray[np.intp] = places[self.keys[places] == keys]
        return rows

    def _nearest(
        self, q: NDArray[np.float32], k: int, rows: NDArray[np.intp] | None
    ) -> tuple[NDArray[np.intp], NDArray[np.float32]]:
        if k == 0:
            return np.empty(0, np.intp), np.empty(0, np.float32)
        places = self._candidates(q, k, rows)
        exact = self._exact(q, places)
        order = np.lexsort((places, -exact))[:k]
        return places[order], exact[order]

    def _candidates(self, q: NDArray[np.float32], k: int, rows: NDArray[np.intp] | None) -> NDArray[np.intp]:
        """Rows among which the k nearest are; all that tie with the last of them too, unless FAISS picked them."""
        share = 1.0 if rows is None else len(rows) / len(self)
        if rows is not None and share < GATHER_BELOW:
            return _top(_product(self._matrix, q, rows), k, rows)
        if self._lists is not None and k <= MOST_LISTED:
            found = self._listed(q, k, rows, share)
            if len(found) >= k:
                return found
        rough = self._matrix @ q
        return _top(rough, k, None) if rows is None else _top(rough[rows], k, rows)

    def _listed(self, q: NDArray[np.float32], k: int, rows: NDArray[np.intp] | None, share: float) -> NDArray[np.intp]:
        """Candidates from the inverted lists; the fewer rows are allowed, the more lists are read for them."""
        faiss = _faiss()
        options = faiss.SearchParametersIVF(nprobe=min(self._lists.nlist, int(self._lists.nlist * PROBED / share) + 1))
        if rows is not None:
            bits = np.zeros(len(self), dtype=np.bool_)
            bits[rows] = True
            packed = np.packbits(bits, bitorder="little")
            options.sel = selector = faiss.IDSelectorBitmap(packed)
        _, found = self._lists.search(q[None], 4 * k + 32, params=options)
        if rows is not None:
            del selector
        places: NDArray[np.intp] = found[0][found[0] >= 0].astype(np.intp)
        return places

    def _exact(self, q: NDArray[np.float32], places: NDArray[np.intp]) -> NDArray[np.float32]:
        """Cosines that depend on the two vectors alone, not on what else was compared in the same call."""
        answer = np.empty(len(places), dtype=np.float32)
        wide = q.astype(np.float64)
        for start in range(0, len(places), 4096):
            block = self._matrix[places[start : start + 4096]].astype(np.float64)
            answer[start : start + 4096] = np.clip(np.einsum("ij,j->i", block, wide), -1.0, 1.0)
        return answer


def _product(matrix: NDArray[np.float32], q: NDArray[np.float32], rows: NDArray[np.intp]) -> NDArray[np.float32]:
    """The products of ``q`` with these rows, through one small buffer: a copy of them all costs five times as much."""
    answer = np.empty(len(rows), dtype=np.float32)
    buffer = np.empty((min(BLOCK, len(rows)), matrix.shape[1]), dtype=np.float32)
    for start in range(0, len(rows), BLOCK):
        picked = rows[start : start + BLOCK]
        block = buffer[: len(picked)]
        np.take(matrix, picked, axis=0, out=block, mode="clip")
        np.dot(block, q, out=answer[start : start + BLOCK])
    return answer


def _top(rough: NDArray[np.float32], k: int, rows: NDArray[np.intp] | None) -> NDArray[np.intp]:
    if k < len(rough):
        border = np.partition(rough, len(rough) - k)[len(rough) - k]
        near = np.flatnonzero(rough >= border - TIE_MARGIN)
    else:
        near = np.arange(len(rough))
    return near if rows is None else rows[near]


def _append_lists(path: Path, n: int, dimension: int) -> int:
    """Add FAISS's inverted lists to a written file; returns their size in bytes. Reads the matrix in blocks."""
    faiss = _faiss()
    matrix = np.memmap(path, dtype=np.float32, mode="r", shape=(n, dimension))
    nlist = int(2 * math.sqrt(n))
    quantizer = faiss.IndexFlatIP(dimension)
    index = faiss.IndexIVFScalarQuantizer(
        quantizer, dimension, nlist, faiss.ScalarQuantizer.QT_8bit, faiss.METRIC_INNER_PRODUCT
    )
    index.cp.niter = 6
    rng = np.random.default_rng(0)
    index.train(np.ascontiguousarray(matrix[np.sort(rng.choice(n, min(n, 64 * nlist), replace=False))]))
    for start in range(0, n, 20_000):
        index.add(np.ascontiguousarray(matrix[start : start + 20_000]))
    data = faiss.serialize_index(index)
    with path.open("ab") as file:
        file.write(data.data)
    return len(data)


def _faiss() -> Any:
    try:
        import faiss
    except ImportError as error:
        raise MissingExtraError("faiss is not installed", hint="pip install faiss-cpu") from error
    return faiss


def _normalised(matrix: NDArray[np.float32]) -> NDArray[np.float32]:
    """Rows of length 1 (zero rows stay zero), contiguous float32; by way of float64, where no square overflows."""
    wide = np.asarray(matrix, dtype=np.float64)
    length = np.sqrt(np.einsum("ij,ij->i", wide, wide))
    if not np.isfinite(length).all():
        raise StoreError("a feature vector holds a number that is not finite")
    length[length == 0] = 1.0
    return np.ascontiguousarray(wide / length[:, None], dtype=np.float32)


def _contents(file: BinaryIO) -> bytes | mmap.mmap:
    size = file.seek(0, 2)
    file.seek(0)
    if size <= MAPPED_ABOVE:
        return file.read()
    return mmap.mmap(file.fileno(), 0, access=mmap.ACCESS_READ)
