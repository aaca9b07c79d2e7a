"""Search: the nearest objects to a vector or a text, for other programs; what it gives is small and quick to make."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from cgdb.errors import BindError
from cgdb.index.positions import Positions
from cgdb.meaning.meanings import LikeMeaning, Meaning, TextMeaning, Vector, VectorMeaning
from cgdb.result import StoredNode
from cgdb.scene import ObjectId

if TYPE_CHECKING:
    from cgdb.view import SceneView


@dataclass(frozen=True, slots=True, kw_only=True)
class Hit:
    """One object that was found. score: the cosine similarity to a vector, or the degree of match of a text."""

    scene: str
    id: ObjectId
    score: float


class Hits(Sequence[Hit]):
    """What a search found, best first. ``nodes`` reads the objects' records from the store when first asked for."""

    def __init__(
        self, views: Sequence[SceneView], part: NDArray[np.int64], position: Positions, score: NDArray[np.float32]
    ) -> None:
        self._views = views
        self._part = part
        self._position = position
        self.scores = score

    @cached_property
    def ids(self) -> list[ObjectId]:
        """The ids of the hits, best first."""
        pairs = zip(self._part.tolist(), self._position.tolist(), strict=True)
        return [self._views[part].column("id")[position] for part, position in pairs]

    @cached_property
    def nodes(self) -> tuple[StoredNode, ...]:
        """The records of the hits, best first."""
        found: dict[tuple[int, int], StoredNode] = {}
        for number, view in enumerate(self._views):
            mine = self._position[self._part == number]
            if len(mine):
                found.update({(number, position): node for position, node in view.stored(mine).items()})
        return tuple(found[pair] for pair in zip(self._part.tolist(), self._position.tolist(), strict=True))

    @property
    def warnings(self) -> tuple[str, ...]:
        """What evidence was left out, one line each."""
        return tuple(dict.fromkeys(line for view in self._views for line in view.degrees.warnings))

    def __len__(self) -> int:
        return len(self.scores)

    def __getitem__(self, index: int) -> Hit:  # type: ignore[override]
        return Hit(
            scene=self._views[int(self._part[index])].info.name, id=self.ids[index], score=float(self.scores[index])
        )

    def __iter__(self) -> Iterator[Hit]:
        return (self[i] for i in range(len(self)))

    def __repr__(self) -> str:
        return f"Hits({', '.join(f'#{hit.id} {hit.score:.3f}' for hit in self)})"

    def to_dicts(self) -> list[dict[str, Any]]:
        """One JSON-ready dict per hit: the object's record and the score."""
        return [{**node.to_dict(), "score": float(s)} for node, s in zip(self.nodes, self.scores, strict=True)]


def meaning_of(what: Any, space: str | None) -> Meaning:
    """What is searched for: a text, a vector (d,) of a space, or a meaning as it is. BindError for what is none."""
    if isinstance(what, str):
        if not what.strip():
            raise BindError("a search needs a text that says something; this one is empty")
        return TextMeaning(text=what)
    if isinstance(what, LikeMeaning | TextMeaning | VectorMeaning):
        return what
    if not isinstance(what, Vector):
        values = np.asarray(what, np.float32)
        if values.ndim != 1 or not values.size:
            raise BindError(f"a vector to search for has one dimension, not the shape {values.shape}")
        what = Vector(values=values, space=space)
    if not np.isfinite(what.values).all():
        raise BindError("the vector to search for holds NaN or infinite values")
    return VectorMeaning(parameter="vector", vector=what)


def search(
    views: Sequence[SceneView],
    meaning: Meaning,
    *,
    space: str | None,
    k: int,
    allowed: Sequence[Positions | None],
) -> Hits:
    """The k best of several scenes. A vector, and a text with a space, are compared by cosine; a text alone by degree.

    allowed: per scene the only positions that may be found, None for all.
    """
    parts: list[tuple[Positions, NDArray[np.float32]]] = []
    for view, only in zip(views, allowed, strict=True):
        if isinstance(meaning, VectorMeaning) or (isinstance(meaning, TextMeaning) and space is not None):
            parts.append(_nearest(view, meaning, space, k, only))
        else:
            parts.append(_best(view, meaning, k, only))
    if len(parts) == 1:
        position, score = parts[0]
        return Hits(views, np.zeros(len(position), np.int64), position, score)
    number = np.concatenate([np.full(len(position), i) for i, (position, _) in enumerate(parts)])
    position = np.concatenate([position for position, _ in parts])
    score = np.concatenate([score for _, score in parts])
    order = np.lexsort((position, number, -score))[:k]
    return Hits(views, number[order], position[order], score[order])


def _nearest(
    view: SceneView, meaning: Meaning, space: str | None, k: int, only: Positions | None
) -> tuple[Positions, NDArray[np.float32]]:
    if isinstance(meaning, VectorMeaning):
        name, vector = view.degrees.space_of(meaning.vector), meaning.vector.values
    else:
        assert isinstance(meaning, TextMeaning) and space is not None
        name, vector = space, view.degrees.text_in_space(meaning.text, space)
    index = view.vectors(name)
    keys, similarities = index.search(vector, k, None if only is None else view.columns.keys[only])
    return view.columns.positions(keys), similarities


def _best(view: SceneView, meaning: Meaning, k: int, only: Positions | None) -> tuple[Positions, NDArray[np.float32]]:
    positions = view.columns.of_label("Object") if only is None else only
    degrees = view.degrees.of(meaning, positions)
    order = np.argsort(-degrees, kind="stable")[:k]
    return positions[order], degrees[order]


def check_k(k: int) -> int:
    """k as a search takes it: at least 1."""
    if isinstance(k, bool) or not isinstance(k, (int, np.integer)) or k < 1:
        raise BindError(f"k must be a whole number from 1 up, not {k!r}")
    return int(k)
