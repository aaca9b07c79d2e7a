"""Vocabularies of precomputed vectors: names fold, strangers' files are read as data, unknown names are errors."""

from __future__ import annotations

import json
import pickle
import zipfile
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from cgdb.errors import EncoderError, UsageError
from cgdb.meaning.embed import space_encoder
from cgdb.meaning.vocabulary import Vocabulary, fold

NAMES = ["cup", "coffee_maker", "Photo frame", "The Thing"]
VECTORS = np.array([[3, 4, 0], [0, 2, 0], [0, 0, 1], [1, 1, 1]], np.float32)


@pytest.fixture
def npz(tmp_path: Path) -> Path:
    path = tmp_path / "words.npz"
    np.savez(path, names=np.array(NAMES), vectors=VECTORS)
    return path


@pytest.mark.parametrize(
    ("text", "row"),
    [
        ("cup", 0),
        ("Cup", 0),
        ("a cup", 0),
        ("a photo of a cup", 0),
        ("A photo of the cup.", 0),
        ("coffee maker", 1),
        ("an image of the coffee_maker", 1),
        ("  Coffee   Maker ", 1),
        ("photo frame", 2),
        ("thing", 3),
    ],
)
def test_names_are_found_however_they_are_written(text: str, row: int, npz: Path) -> None:
    vector = Vocabulary.load(npz).texts([text])
    assert vector.dtype == np.float32
    np.testing.assert_allclose(vector[0], VECTORS[row] / np.linalg.norm(VECTORS[row]), rtol=1e-6)


def test_an_exact_name_is_itself_when_two_fold_alike() -> None:
    words = Vocabulary("v", ["bow (weapon)", "Cup", "cup"], np.eye(3))
    assert words.texts(["Cup", "cup", "CUP"]).argmax(1).tolist() == [1, 2, 1]


def test_an_unknown_name_is_an_error_with_the_nearest_one(npz: Path) -> None:
    with pytest.raises(EncoderError, match=r"'cupp' is not in the vocabulary .* of 4 names") as caught:
        Vocabulary.load(npz).texts(["cup", "cupp"])
    assert caught.value.hint == "did you mean 'cup'?"
    with pytest.raises(EncoderError):
        Vocabulary.load(npz).texts([""])


def test_the_name_tells_files_apart_by_content(npz: Path, tmp_path: Path) -> None:
    first = Vocabulary.load(npz)
    assert first.name.startswith("vocabulary:words.npz:")
    assert Vocabulary.load(npz).name == first.name
    np.savez(npz, names=np.array(NAMES), vectors=VECTORS[::-1])
    assert Vocabulary.load(npz).name != first.name


def test_a_pair_of_files_is_found_from_either(tmp_path: Path) -> None:
    (tmp_path / "w.json").write_text(json.dumps(NAMES))
    np.save(tmp_path / "w.npy", VECTORS.astype(np.float16))
    np.save(tmp_path / "other.npy", VECTORS)
    for given in ([tmp_path / "w.json"], [tmp_path / "w.npy"], [tmp_path / "w.json", tmp_path / "other.npy"]):
        assert Vocabulary.load(*given).texts(["cup", "coffee maker"]).argmax(1).tolist() == [1, 1]


def test_the_registry_loads_it(npz: Path) -> None:
    encoder = space_encoder(f"vocabulary:{npz}")
    assert encoder.dimension == 3
    assert encoder.texts([]).shape == (0, 3)


class Bomb:
    """A pickle that would touch a file when it is loaded."""

    def __init__(self, touched: Path) -> None:
        self.touched = touched

    def __reduce__(self) -> tuple[Callable[..., object], tuple[Path]]:
        return Path.touch, (self.touched,)


def test_no_pickle_is_loaded(tmp_path: Path) -> None:
    touched = tmp_path / "touched"
    bomb = np.array([Bomb(touched)], object)
    np.savez(tmp_path / "names.npz", names=bomb, vectors=VECTORS[:1])
    np.savez(tmp_path / "vectors.npz", names=np.array(["cup"]), vectors=bomb)
    (tmp_path / "plain.npz").write_bytes(pickle.dumps(Bomb(touched)))
    (tmp_path / "pair.json").write_text('["cup"]')
    np.save(tmp_path / "pair.npy", bomb, allow_pickle=True)
    for file in ("names.npz", "vectors.npz", "plain.npz", "pair.json"):
        with pytest.raises(EncoderError, match="is no vocabulary"):
            Vocabulary.load(tmp_path / file)
    assert not touched.exists()


def _npz(names: object, vectors: object) -> Callable[[Path], object]:
    return lambda path: np.savez(path, names=np.array(names), vectors=np.array(vectors))


def _claims_terabytes(path: Path) -> None:
    header = b"{'descr': '<f4', 'fortran_order': False, 'shape': (1000000000, 512), }"
    header += b" " * (-(len(header) + 11) % 64) + b"\n"
    with zipfile.ZipFile(path, "w") as archive:
        np.save(path.with_suffix(".names"), np.array(["cup"]))
        archive.write(path.with_suffix(".names.npy"), "names.npy")
        archive.writestr("vectors.npy", b"\x93NUMPY\x01\x00" + len(header).to_bytes(2, "little") + header)


SPOIL: dict[str, Callable[[Path], object]] = {
    "missing": lambda path: None,
    "empty": lambda path: path.write_bytes(b""),
    "text": lambda path: path.write_text("cup"),
    "a folder": lambda path: path.mkdir(),
    "no vectors": lambda path: np.savez(path, names=np.array(["cup"])),
    "fewer vectors": _npz(["cup", "pot"], [[1.0, 2.0]]),
    "a row of numbers": _npz(["cup"], [1.0]),
    "no rows": _npz(np.array([], "U1"), np.zeros((0, 3))),
    "NaN": _npz(["cup"], [[1.0, np.nan]]),
    "zero": _npz(["cup"], [[0.0, 0.0]]),
    "whole numbers": _npz(["cup"], [[1, 0]]),
    "names are numbers": _npz([1], [[1.0, 2.0]]),
    "terabytes": _claims_terabytes,
}


@pytest.mark.parametrize("how", SPOIL)
def test_a_file_that_is_no_vocabulary_is_one_clear_line(how: str, tmp_path: Path) -> None:
    path = tmp_path / "words.npz"
    SPOIL[how](path)
    with pytest.raises(EncoderError) as caught:
        Vocabulary.load(path)
    assert "\n" not in caught.value.message
    assert "words.npz" in caught.value.message


def test_a_truncated_npz_is_one_clear_line(npz: Path) -> None:
    whole = npz.read_bytes()
    for length in range(0, len(whole), 37):
        npz.write_bytes(whole[:length])
        with pytest.raises(EncoderError):
            Vocabulary.load(npz)


def test_names_and_vectors_must_go_together() -> None:
    with pytest.raises(UsageError, match="2 names do not go with vectors of shape"):
        Vocabulary("v", ["a", "b"], VECTORS)


def test_fold_leaves_names_that_are_prompts_or_articles() -> None:
    assert fold("a") == "a"
    assert fold("photo of") == "photo of"
    assert fold("Anvil") == "anvil"


def test_real_clip_vectors_of_lvis_names_find_their_pictures(data: Path) -> None:
    words = Vocabulary.load(data / "clip" / "lvis_names.json", data / "clip" / "lvis_text_features.npy")
    pictures = np.load(data / "clip" / "lvis_image_features.npy", allow_pickle=False)
    pictures /= np.linalg.norm(pictures, axis=1, keepdims=True)
    texts = words.texts([f"a photo of a {name}" for name in words.names])
    hits = (texts @ pictures.T).argmax(1) == np.arange(len(words.names))
    assert round(float(hits.mean()), 4) == 0.6143
