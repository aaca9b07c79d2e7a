"""What a ``~`` compares with: a text, an object, or a vector."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from cgdb.scene import ObjectId


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Vector:
    """A query by example: values (d,) float32; space None where the dimension alone tells which is meant."""

    values: NDArray[np.float32]
    space: str | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class TextMeaning:
    """``~ "text"``."""

    text: str


@dataclass(frozen=True, slots=True, kw_only=True)
class LikeMeaning:
    """``~ #12``: like that object."""

    id: ObjectId


@dataclass(frozen=True, slots=True, kw_only=True)
class VectorMeaning:
    """``~ $picture``. Told apart by name: parameters do not change within a statement."""

    parameter: str
    vector: Vector = field(compare=False)


Meaning: TypeAlias = TextMeaning | LikeMeaning | VectorMeaning
