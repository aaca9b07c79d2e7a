"""Values from the command line: ``-p name=value`` and ``@file`` vectors."""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from hashlib import sha256
from pathlib import Path
from typing import TYPE_CHECKING, Any

import cgdb
from cgdb.errors import UsageError, did_you_mean, one_of

if TYPE_CHECKING:
    from cgdb.database import Database
    from cgdb.scene import ObjectId


def parameters(given: Sequence[str]) -> dict[str, Any]:
    """{name: value} of ``name=value`` words; what is no number, true, false, null or JSON list is a text."""
    found: dict[str, Any] = {}
    for word in given:
        name, equals, value = word.partition("=")
        if not equals or not name.isidentifier():
            raise UsageError(f"-p takes NAME=VALUE, not {word[:60]!r}")
        found[name] = parameter(value)
    return found


def encoders(given: Sequence[str]) -> dict[str, Any]:
    """{feature space: its encoder} of ``SPACE=ENCODER`` words."""
    from cgdb.meaning.embed import space_encoder

    found: dict[str, Any] = {}
    for word in given:
        space, equals, name = word.partition("=")
        if not equals or not space or not name:
            raise UsageError(f"--encoder takes SPACE=ENCODER, not {word[:60]!r}")
        found[space] = space_encoder(name)
    return found


@contextmanager
def opened(store: str, given: Mapping[str, Any]) -> Iterator[Database]:
    """A store, with the encoders that are given. UsageError for one of a feature space that no scene has: it would
    never be used."""
    with cgdb.open(store, space_encoders=given) as db:
        known = {space.name for info in db.scenes() for space in info.spaces}
        for space in given:
            if space not in known:
                hint = did_you_mean(space, known) or (f"there are {one_of(sorted(known))}" if known else None)
                raise UsageError(f"--encoder {space}=...: no scene has a feature space '{space}'", hint=hint)
        yield db


def listed(text: str | None) -> tuple[str, ...]:
    """The words of a list with commas."""
    return tuple(word.strip() for word in (text or "").split(",") if word.strip())


def renamed(given: Sequence[str]) -> dict[str, str]:
    """{label: the one that it is taken for} of ``LABEL=OTHER`` words."""
    found = {}
    for word in given:
        label, equals, other = word.partition("=")
        if not equals or not label.strip() or not other.strip():
            raise UsageError(f"--same takes LABEL=OTHER, not '{word[:40]}'")
        found[label] = other
    return found


def parameter(text: str) -> Any:
    """One value as a person types it."""
    if text.startswith("@"):
        return vector(Path(text[1:]))
    try:
        value = json.loads(text)
    except (json.JSONDecodeError, RecursionError):
        return text
    return text if isinstance(value, dict) or (isinstance(value, float) and value != value) else value


def vector(path: Path) -> Any:
    """(d,) float32 from a .npy file or a JSON list of numbers."""
    import numpy as np

    try:
        if path.suffix == ".npy":
            values = np.load(path, allow_pickle=False)
        else:
            values = np.asarray(json.loads(path.read_text("utf-8")), dtype=np.float32)
    except OSError as error:
        raise UsageError(f"{path} cannot be read: {error.strerror or error}") from error
    except (ValueError, TypeError, RecursionError, EOFError) as error:
        raise UsageError(f"{path} holds no vector", hint="a .npy file of one dimension, or a JSON list") from error
    if values.ndim != 1 or not np.issubdtype(values.dtype, np.number):
        raise UsageError(f"{path} holds an array of shape {values.shape}, not one vector")
    return values.astype(np.float32)


def file_name(what: ObjectId) -> str:
    """An id, or a scene's name, as part of a file's name: letters and digits stay, everything else is its number.

    Long ones end in a digest of the whole, for two that begin alike are two.
    """
    name = "".join(c if c.isascii() and (c.isalnum() or c in "-.") else f"_{ord(c):x}" for c in str(what))
    return name if len(name) <= 150 else f"{name[:130]}_{sha256(name.encode()).hexdigest()[:16]}"
