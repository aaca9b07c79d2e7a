"""A vocabulary of vectors that were computed elsewhere: names in, their vectors out, and no model at all.

With one, "cup" can be asked of a map with CLIP features on a machine that has no CLIP.
"""

from __future__ import annotations

import hashlib
import json
import re
import zipfile
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from cgdb.errors import EncoderError, UsageError, did_you_mean

LARGEST_FILE = 2 << 30
"""Bytes. A vocabulary of a million names in 512 dimensions is below it."""

_PROMPT = re.compile(r"^(?:a |an |the )?(?:photo|picture|image) of ")
_ARTICLE = re.compile(r"^(?:a|an|the) ")


class Vocabulary:
    """Names with their vectors, as an encoder. A text that is none of the names is an error, never a guess."""

    def __init__(self, name: str, names: Sequence[str], vectors: NDArray[np.floating[Any]]) -> None:
        """vectors: (n, d), one row for every name, of any length but zero. UsageError where they do not go together."""
        if vectors.ndim != 2 or vectors.shape[0] != len(names) or vectors.shape[1] == 0 or not len(names):
            raise UsageError(f"{len(names)} names do not go with vectors of shape {vectors.shape}: expected (n, d)")
        rows = np.asarray(vectors, np.float32)
        if not np.isfinite(rows).all():
            raise UsageError("the vectors hold NaN or infinite values")
        lengths = np.linalg.norm(rows, axis=1)
        if (lengths == 0).any():
            raise UsageError(f"the vector of '{names[int(np.argmin(lengths))]}' is zero")
        self.name = name
        self.names = tuple(names)
        self.dimension = int(rows.shape[1])
        self._vectors = rows / lengths[:, None]
        self._row: dict[str, int] = {}
        for row, known in enumerate(self.names):
            # Of two names that read the same the first counts; an exact name is always itself.
            self._row.setdefault(fold(known), row)
        self._exact = {known: row for row, known in enumerate(self.names)}

    @classmethod
    def load(cls, path: str | Path, vectors: str | Path | None = None) -> Vocabulary:
        """A vocabulary from .npz with the arrays names (text) and vectors (n, d), or from .json names and .npy vectors.

        Of a pair either file may be named: its fellow has the same name and the other ending, or is given. EncoderError
        for a file that is something else; nothing in the file is executed.
        """
        first = Path(path).expanduser()
        files = [first]
        if vectors is not None:
            files.append(Path(vectors).expanduser())
        elif first.suffix in (".json", ".npy"):
            files = [first.with_suffix(".json"), first.with_suffix(".npy")]
        try:
            for file in files:
                if file.stat().st_size > LARGEST_FILE:
                    raise EncoderError(f"{file} is larger than a vocabulary can be ({LARGEST_FILE >> 30} GiB)")
            names, rows = _read_npz(first) if len(files) == 1 else _read_pair(*files)
            digest = hashlib.sha256("\0".join(names).encode("utf-8", "surrogatepass") + rows.tobytes()).hexdigest()
            return cls(f"vocabulary:{first.name}:{digest[:8]}", names, rows)
        except OSError as reason:
            raise EncoderError(f"cannot read the vocabulary {first}: {reason.strerror or reason}") from None
        except (ValueError, KeyError, TypeError, zipfile.BadZipFile, EOFError, RecursionError, MemoryError) as reason:
            raise EncoderError(f"{first} is no vocabulary: {_one_line(reason)}", hint=_SHAPE) from None
        except UsageError as reason:
            raise EncoderError(f"{first} is no vocabulary: {reason.message}", hint=_SHAPE) from None

    def texts(self, texts: Sequence[str]) -> NDArray[np.float32]:
        """(n, d) float32, rows of length 1: the vectors of these names. EncoderError for a text that is none."""
        rows = np.array([self._find(text) for text in texts], np.intp)
        return np.take(self._vectors, rows, axis=0)

    def _find(self, text: str) -> int:
        row = self._exact.get(text)
        if row is None:
            row = self._row.get(fold(text))
        if row is None:
            raise EncoderError(
                f"'{text[:100]}' is not in the vocabulary '{self.name}' of {len(self.names)} names",
                hint=did_you_mean(fold(text), self._row) or "ask for a name of the vocabulary, or give a vector",
            )
        return row


_SHAPE = "a .npz with the arrays 'names' (text) and 'vectors' (n, d), or a .json list of names beside a .npy of vectors"


def fold(name: str) -> str:
    """How a name is compared: without case, underscores, prompt ("a photo of ..."), leading article and full stop."""
    plain = " ".join(name.casefold().replace("_", " ").split()).rstrip(".")
    return _ARTICLE.sub("", _PROMPT.sub("", plain))


def _read_npz(path: Path) -> tuple[list[str], NDArray[Any]]:
    with zipfile.ZipFile(path) as archive:
        # A few kilobytes of zeros can claim to be terabytes.
        if sum(entry.file_size for entry in archive.infolist()) > LARGEST_FILE:
            raise ValueError("it unpacks to more than a vocabulary can be")
    with np.load(path, allow_pickle=False) as arrays:
        for wanted in ("names", "vectors"):
            if wanted not in arrays.files:
                raise ValueError(f"it has no array '{wanted}'")
        names, vectors = arrays["names"], arrays["vectors"]
    if names.dtype.kind != "U" or names.ndim != 1:
        raise ValueError(f"its names are {names.dtype} of shape {names.shape}, expected a row of text")
    return [str(name) for name in names], _numbers(vectors)


def _read_pair(names_file: Path, vectors_file: Path) -> tuple[list[str], NDArray[Any]]:
    names = json.loads(names_file.read_text("utf-8"))
    if not isinstance(names, list) or not all(isinstance(name, str) for name in names):
        raise ValueError(f"{names_file.name} is not a list of names")
    with vectors_file.open("rb") as file:
        vectors = np.lib.format.read_array(file, allow_pickle=False)
    return names, _numbers(vectors)


def _numbers(vectors: NDArray[Any]) -> NDArray[Any]:
    if vectors.dtype.kind != "f":
        raise ValueError(f"its vectors are {vectors.dtype}, expected floating-point numbers")
    return vectors


def _one_line(reason: Exception) -> str:
    if isinstance(reason, MemoryError):
        return "it does not fit in memory"
    return str(reason).strip().partition("\n")[0][:200] or type(reason).__name__
