"""The kept vectors of texts: a cache that may be damaged, deleted or read-only, and never gives a wrong vector."""

from __future__ import annotations

import random
import sqlite3
from pathlib import Path

import numpy as np
import pytest

from cgdb.storage.text_vectors import TextVectors


def vectors(n: int, d: int = 8) -> np.ndarray:
    return np.arange(n * d, dtype=np.float32).reshape(n, d)


def test_what_is_put_is_got_by_encoder_and_text(tmp_path: Path) -> None:
    with TextVectors(tmp_path / "texts.sqlite") as kept:
        assert kept.get("a", ["x"]) == {} and kept.missing("a", ["x", "y", "x"]) == ["x", "y"]
        assert not (tmp_path / "texts.sqlite").exists(), "asking makes no file"
        kept.put("a", ["x", "y", "", "\ud800"], vectors(4))
        kept.put("b", ["x"], vectors(1, 3) + 7)
    with TextVectors(tmp_path / "texts.sqlite") as kept:
        found = kept.get("a", ["y", "", "z", "\ud800"])
        assert {text: v[0] for text, v in found.items()} == {"y": 8, "": 16, "\ud800": 24}
        assert found["y"].dtype == np.float32 and found["y"].shape == (8,)
        assert kept.get("b", ["x"])["x"].tolist() == [7, 8, 9]
        kept.put("a", ["x"], vectors(1) + 100)
        assert kept.get("a", ["x"])["x"][0] == 100, "the last one put holds"
        assert kept.missing("a", ["q", "x", "p"]) == ["q", "p"]
        with pytest.raises(ValueError, match="2 texts but 1 vectors"):
            kept.put("a", ["x", "y"], vectors(1))


def test_many_texts(tmp_path: Path) -> None:
    with TextVectors(tmp_path / "texts.sqlite") as kept:
        texts = [f"text {i}" for i in range(2500)]
        kept.put("a", texts, vectors(2500))
        assert len(kept.get("a", texts)) == 2500 and kept.missing("a", texts) == []


def test_a_damaged_row_counts_as_missing(tmp_path: Path) -> None:
    with TextVectors(tmp_path / "texts.sqlite") as kept:
        kept.put("a", ["x", "y"], vectors(2))
        database = sqlite3.connect(tmp_path / "texts.sqlite")
        database.execute("update text_vectors set vector = zeroblob(32) where rowid = 2")
        database.execute("update text_vectors set encoder = 'b' where rowid = 1")
        database.commit()
        database.close()
        assert kept.missing("a", ["x", "y"]) == ["x", "y"] and kept.missing("b", ["x"]) == ["x"]
        kept.put("a", ["x"], vectors(1))
        assert kept.missing("a", ["x", "y"]) == ["y"]


def test_a_flipped_byte_gives_no_wrong_vector(tmp_path: Path) -> None:
    file = tmp_path / "texts.sqlite"
    texts = [f"text {i}" for i in range(100)]
    with TextVectors(file) as kept:
        kept.put("a", texts, vectors(100))
    good = file.read_bytes()
    used = [at for at in range(len(good)) if good[at] != 0]
    dice = random.Random(5)
    for at in dice.sample(used, 60):
        broken = bytearray(good)
        broken[at] ^= 1 << dice.randrange(8)
        file.write_bytes(broken)
        with TextVectors(file) as kept:
            for text, vector in kept.get("a", texts).items():
                assert vector[0] == 8 * texts.index(text), f"byte {at}"
            kept.put("a", texts, vectors(100))
            assert kept.missing("a", texts) == [], f"byte {at}: the cache does not heal"
        for left in tmp_path.iterdir():
            left.unlink()


@pytest.mark.parametrize("content", [b"", b"no database at all" * 500])
def test_a_file_that_is_none_is_set_aside(tmp_path: Path, content: bytes) -> None:
    file = tmp_path / "texts.sqlite"
    file.write_bytes(content)
    with TextVectors(file) as kept:
        assert kept.missing("a", ["x"]) == ["x"]
        kept.put("a", ["x"], vectors(1))
        assert kept.missing("a", ["x"]) == []
    assert not content or (tmp_path / "texts.sqlite.damaged").read_bytes() == content


def test_read_only(tmp_path: Path) -> None:
    file = tmp_path / "texts.sqlite"
    with TextVectors(file, read_only=True) as kept:
        kept.put("a", ["x"], vectors(1))
        assert kept.missing("a", ["x"]) == ["x"] and not file.exists()
    with TextVectors(file) as writer:
        writer.put("a", ["x"], vectors(1))
        with TextVectors(file, read_only=True) as kept:
            assert kept.missing("a", ["x", "y"]) == ["y"]
    file.write_bytes(b"x" * 9000)
    with TextVectors(file, read_only=True) as kept:
        assert kept.missing("a", ["x"]) == ["x"]
    assert file.read_bytes() == b"x" * 9000


def test_encoding_does_not_wait_for_an_import(tmp_path: Path) -> None:
    from cgdb.scene import SceneObject
    from cgdb.storage.ledger import Ledger

    with Ledger.open(tmp_path / "s.cgdb", create=True) as ledger, ledger.write("lab") as writer:
        writer.objects([SceneObject(id=1)])
        with TextVectors(ledger.path / "texts.sqlite", patience=0.1) as kept:
            kept.put("a", ["x"], vectors(1))
            assert kept.missing("a", ["x"]) == []
