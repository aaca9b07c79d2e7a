"""Cross-encoders: small models on this machine that read a question and a description together and give a score.

Any model with a head for one score per pair of texts, as saved by transformers or sentence-transformers, such as
cross-encoder/ms-marco-MiniLM-L6-v2. It orders; whether a row fits stays with the statement: what such a model gives is
not calibrated, and it takes no notice of "other than".
"""

from __future__ import annotations

import threading
import time
from collections.abc import Sequence
from importlib import import_module
from pathlib import Path
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from cgdb.errors import EncoderError, MissingExtraError
from cgdb.model.candidates import line
from cgdb.model.llm import Meter, Usage
from cgdb.model.prompts import clean
from cgdb.model.rerank import Reranked
from cgdb.result import Reason, Row

PIP_LINE = "pip install 'cgdb[rerank]'"
BATCH = 32
LONGEST = 256
"""Tokens of a question and a description together; what is longer is cut, the longer of the two first."""
DECIMALS = 4
"""Of a score. The same pair in another batch differs beyond them, and must not change its place for that."""


class CrossEncoder:
    """A re-ranker. On the first CUDA device where there is one, in float32."""

    most: ClassVar[int] = 40

    def __init__(self, model: Any, tokenizer: Any, name: str) -> None:
        """model, tokenizer: of transformers, for sequence classification with one output, or two (no, yes)."""
        self._torch = _packages()[0]
        outputs = int(model.config.num_labels)
        if outputs not in (1, 2):
            raise EncoderError(f"'{name}' gives {outputs} values for a pair of texts; a re-ranker gives one")
        self._device = self._torch.device("cuda" if self._torch.cuda.is_available() else "cpu")
        self._model = model.to(self._device).float().eval()
        self._tokenizer = tokenizer
        # A model of fewer positions than we cut to would fail on the first long caption.
        positions = getattr(model.config, "max_position_embeddings", None) or LONGEST
        self._longest = max(8, min(LONGEST, int(positions), int(getattr(tokenizer, "model_max_length", LONGEST))))
        self._lock = threading.Lock()
        self.name = f"cross-encoder {name}"

    @classmethod
    def load(cls, name: str, *, download: bool = False) -> CrossEncoder:
        """A model by its folder, or by its name on the Hugging Face hub where it was downloaded before.

        Nothing is fetched unless download says so: a question must not wait for, or depend on, the network.
        MissingExtraError without the packages; EncoderError where the model cannot be had or is of another kind.
        """
        library = _packages()[1]
        given = Path(name).expanduser()
        where = str(given) if given.is_dir() else name
        if not name or (not given.is_dir() and (name.startswith((".", "/", "~")) or name.count("/") > 1)):
            raise EncoderError(f"there is no folder '{name[:100]}'", hint="the folder or name of a cross-encoder")
        try:
            with _quiet(library):
                tokenizer = library.AutoTokenizer.from_pretrained(where, local_files_only=not download)
                model, told = library.AutoModelForSequenceClassification.from_pretrained(
                    where, local_files_only=not download, output_loading_info=True
                )
        except Exception as reason:  # noqa: BLE001  the hub's client and the readers of weights raise errors of many kinds
            raise _cannot(name, given.is_dir(), download, reason) from None
        if told.get("missing_keys"):
            raise EncoderError(
                f"'{name}' is no cross-encoder: its weights lack {sorted(told['missing_keys'])[0]}",
                hint="a model for pairs of texts is needed, such as cross-encoder/ms-marco-MiniLM-L6-v2",
            )
        return cls(model, tokenizer, given.name if given.is_dir() else name)

    def scores(self, question: str, texts: Sequence[str]) -> NDArray[np.float64]:
        """(n,) how well each text answers the question, in log-odds; the same whatever else is asked with it."""
        found = np.zeros(len(texts))
        # Texts of one length together: padding costs as much as text.
        order = sorted(range(len(texts)), key=lambda i: (len(texts[i]), i))
        with self._lock, self._torch.inference_mode():
            for start in range(0, len(order), BATCH):
                batch = order[start : start + BATCH]
                inputs = self._tokenizer(
                    [question] * len(batch),
                    [texts[i] for i in batch],
                    padding=True,
                    truncation=True,
                    max_length=self._longest,
                    return_tensors="pt",
                ).to(self._device)
                logits = self._model(**inputs).logits.double().cpu().numpy()
                found[batch] = logits[:, 0] if logits.shape[1] == 1 else logits[:, 1] - logits[:, 0]
        if not np.isfinite(found).all():
            raise EncoderError(f"{self.name} gives scores that are not finite: its weights are damaged")
        return np.round(found, DECIMALS)

    def rerank(
        self, question: str, columns: Sequence[str], rows: Sequence[Row], meter: Meter | None = None
    ) -> Reranked:
        """The rows that fit in the order of their scores, then those that do not, likewise."""
        started = time.perf_counter()
        scores = self.scores(question, [line(columns, row) for row in rows])
        order = sorted(range(len(rows)), key=lambda i: (not rows[i].fits, -scores[i], i))
        told = tuple(_told(rows[i], question, float(scores[i]), self.name) for i in order)
        return Reranked(rows=told, usage=Usage(seconds=time.perf_counter() - started))


def _told(row: Row, question: str, score: float, by: str) -> Row:
    degree = float(1 / (1 + np.exp(-np.clip(score, -50, 50))))
    reason = Reason(asked=f'RERANK BY "{clean(question, 80)}"', degree=degree, evidence={"by": by, "score": score})
    return Row(row.values, row.score, row.fits, lambda: (*row.why, reason))


def _packages() -> tuple[Any, Any]:
    """torch and transformers, imported."""
    try:
        return import_module("torch"), import_module("transformers")
    except ImportError as missing:
        raise MissingExtraError(
            f"cross-encoders need {missing.name or 'torch and transformers'}, which is not installed", hint=PIP_LINE
        ) from None


class _quiet:  # noqa: N801  a context, read as a verb
    """Loading draws bars and tables on stderr; what is wrong with a model is said by us."""

    def __init__(self, library: Any) -> None:
        self._log = library.logging

    def __enter__(self) -> None:
        self._level, self._bars = self._log.get_verbosity(), self._log.is_progress_bar_enabled()
        self._log.set_verbosity(self._log.FATAL)
        self._log.disable_progress_bar()

    def __exit__(self, *_: object) -> None:
        self._log.set_verbosity(self._level)
        if self._bars:
            self._log.enable_progress_bar()


def _cannot(name: str, is_folder: bool, download: bool, reason: Exception) -> EncoderError:
    said = clean((str(reason) or type(reason).__name__).splitlines()[0], 200)
    if is_folder or download:
        return EncoderError(f"the cross-encoder '{name}' cannot be loaded: {said}")
    return EncoderError(
        f"the cross-encoder '{name[:100]}' is not on this machine, or not whole",
        hint=f"fetch it once: hf download {clean(name, 100)}; or name the folder that it was saved to",
    )
