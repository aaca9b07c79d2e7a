"""What a store holds, for completion: names from the catalogs, values and words from the columns."""

from __future__ import annotations

import json
import re
from collections import Counter
from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import TYPE_CHECKING, Any, TypeVar

if TYPE_CHECKING:
    from cgdb.database import Database
    from cgdb.index.catalog import Catalog
    from cgdb.view import SceneView

T = TypeVar("T")
MOST_SCENES = 16
"""Scenes whose labels, properties and values are read for it; by name all scenes are known."""
MOST_ROWS = 50_000
"""Objects of a scene whose values are read."""
MOST_VALUES = 2_000
_WORD = re.compile(r"[^\W\d_][\w'-]{2,39}")
_COMMON = frozenset(
    ("the", "and", "with", "has", "have", "its", "that", "this", "from", "for", "are", "was", "two", "very", "there")
)


class Vocabulary:
    """The names and values of the scenes in use; each is read when first asked for, and kept."""

    def __init__(self, parameters: Callable[[], Mapping[str, Any]]) -> None:
        self._db: Database | None = None
        self._views: tuple[SceneView, ...] = ()
        self._scenes: dict[str, str] = {}
        self._kept: dict[str, Any] = {}
        self._parameters = parameters

    def read_ahead(self) -> None:
        """Read what is wanted at the first letters, before they are typed."""
        _ = self.phrases(), self.words(), self.ids(), self._catalog()

    @property
    def filled(self) -> bool:
        """Whether it speaks of a store yet."""
        return self._db is not None

    def fill(self, db: Database, scenes: Sequence[str] = (), as_of: int | str | None = None) -> None:
        """Speak of these scenes of the store (none: all) from now on."""
        infos = db.scenes(as_of)
        named = [info.name for info in infos if not scenes or info.name in scenes]
        self._scenes = {info.name: f"{info.n_objects:,} objects" for info in infos}
        self._views = tuple(db.view(name, as_of) for name in named[:MOST_SCENES])
        self._kept = {}
        self._db = db

    def scenes(self) -> Mapping[str, str]:
        return self._scenes

    def labels(self) -> Mapping[str, int]:
        return {"Object": 0, **self._catalog().labels}

    def relations(self) -> Mapping[str, int]:
        from cgdb.index.catalog import STANDARD_RELATIONS

        catalog = self._catalog()
        counts = {label: catalog.relation_count(label) for label in catalog.relations}
        held = dict(sorted(counts.items(), key=lambda item: -item[1]))
        return {**held, **{name: 0 for name in STANDARD_RELATIONS if name not in held}}

    def properties(self) -> Mapping[str, str]:
        return self._catalog().properties

    def values(self, name: str) -> Sequence[str]:
        from cgdb.index.catalog import BUILT_IN

        kind = BUILT_IN.get(name) or self.properties().get(name)
        if kind not in ("text", "list", "mixed"):
            return ()
        return self._keep(f"values {name}", lambda: _frequent(self._column(name)))

    def phrases(self) -> Sequence[str]:
        return self._keep("phrases", lambda: _frequent([*self._column("tag"), *self._column("tags")]))

    def words(self) -> Sequence[str]:
        return self._keep("words", self._read_words)

    def ids(self) -> Sequence[tuple[str, str]]:
        return self._keep("ids", self._read_ids)

    def parameters(self) -> Mapping[str, str]:
        return {name: repr(value)[:40] for name, value in self._parameters().items()}

    def _keep(self, name: str, read: Callable[[], tuple[T, ...]]) -> tuple[T, ...]:
        kept = self._kept
        if name not in kept:
            if not self._views:
                return ()
            kept[name] = read()
        found: tuple[T, ...] = kept[name]
        return found

    def _catalog(self) -> Catalog:
        # Brings numpy, which the prompt must not wait for.
        from cgdb.index.catalog import Catalog, merge

        if not self._views:
            return Catalog()
        return self._keep("catalog", lambda: (merge(view.catalog for view in self._views),))[0]

    def _column(self, name: str) -> list[Any]:
        return [value for view in self._views for value in view.column(name)[:MOST_ROWS].tolist()]

    def _read_words(self) -> tuple[str, ...]:
        counts: Counter[str] = Counter()
        for text in self._column("caption"):
            if isinstance(text, str):
                counts.update({word.casefold() for word in _WORD.findall(text[:1000])})
        return tuple(word for word, _ in counts.most_common(MOST_VALUES) if word not in _COMMON)

    def _read_ids(self) -> tuple[tuple[str, str], ...]:
        found: dict[str, str] = {}
        for view in self._views:
            ids, tags = view.column("id")[:MOST_ROWS].tolist(), view.column("tag")[:MOST_ROWS].tolist()
            for node, tag in zip(ids, tags, strict=True):
                found.setdefault(written_id(node), tag or "")
        return tuple(found.items())


def written_id(node_id: object) -> str:
    """An id as it stands after ``#``."""
    return str(node_id) if isinstance(node_id, int) else json.dumps(node_id, ensure_ascii=False)


def _frequent(values: Iterable[Any]) -> tuple[str, ...]:
    counts: Counter[str] = Counter()
    for value in values:
        for item in value if isinstance(value, (list, tuple)) else (value,):
            if isinstance(item, str) and item:
                counts[item] += 1
    ordered = sorted(counts.items(), key=lambda item: (-item[1], len(item[0]), item[0]))
    return tuple(text for text, _ in ordered[:MOST_VALUES])
