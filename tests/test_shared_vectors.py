"""Vectors of the phrases that every store compares with: kept once for a user, in the store where that cannot be."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from cgdb.meaning.encoders import Encoders
from cgdb.meaning.shared_vectors import SharedVectors
from cgdb.storage.text_vectors import TextVectors

VECTORS = np.arange(6, dtype=np.float32).reshape(2, 3)


@pytest.fixture
def cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "home"))
    return tmp_path / "home" / "cgdb" / "texts.sqlite"


@pytest.fixture
def store(tmp_path: Path) -> Iterator[TextVectors]:
    (tmp_path / "store").mkdir()
    with TextVectors(tmp_path / "store" / "texts.sqlite") as kept:
        yield kept


def test_what_one_store_encoded_the_next_one_knows(cache: Path, store: TextVectors, tmp_path: Path) -> None:
    first = SharedVectors(store)
    assert first.missing("m", ["a", "b"]) == ["a", "b"]
    first.put("m", ["a", "b"], VECTORS)
    first.close()
    assert cache.exists() and not store.path.exists()
    (tmp_path / "other").mkdir()
    with TextVectors(tmp_path / "other" / "texts.sqlite") as other:
        second = SharedVectors(other)
        assert second.missing("m", ["a", "b", "c", "c"]) == ["c"]
        assert second.get("m", ["b"])["b"].tolist() == [3, 4, 5]
        assert second.missing("another model", ["a"]) == ["a"]
        second.close()


@pytest.mark.parametrize("harm", ["a file in the way", "damaged", "no SQLite file"])
def test_where_the_cache_cannot_be_used_nothing_is_lost(cache: Path, store: TextVectors, harm: str) -> None:
    if harm == "a file in the way":
        cache.parent.parent.write_bytes(b"")
    else:
        SharedVectors(store).put("m", ["a"], VECTORS[:1])
        content = cache.read_bytes()
        cache.write_bytes(b"\xff" * len(content) if harm == "no SQLite file" else content[:5000] + b"\xff" * 3000)
    shared = SharedVectors(store)
    assert shared.missing("m", ["b"]) == ["b"]
    shared.put("m", ["a", "b"], VECTORS)
    assert {text: vector.tolist() for text, vector in shared.get("m", ["a", "b"]).items()} == {
        "a": [0, 1, 2],
        "b": [3, 4, 5],
    }
    assert store.path.exists() == (harm == "a file in the way")
    shared.close()


def test_what_a_store_brought_along_is_used(cache: Path, store: TextVectors) -> None:
    store.put("m", ["a"], VECTORS[:1])
    shared = SharedVectors(store)
    assert shared.missing("m", ["a", "b"]) == ["b"]
    shared.close()


def test_encoders_of_ones_own_are_not_shared(cache: Path, store: TextVectors) -> None:
    class Own:
        name, dimension, calls = "own", 3, 0

        def texts(self, texts: list[str]) -> np.ndarray:
            self.calls += len(texts)
            return np.ones((len(texts), 3), np.float32)

        def pictures(self, pictures: object) -> np.ndarray:
            raise NotImplementedError

    own = Own()
    encoders = Encoders(store, text=own)
    encoders.background(own)
    calls = own.calls
    assert calls > 1000
    assert not cache.exists() and store.path.exists()
    encoders.background(own)
    assert own.calls == calls
    encoders.close()
