"""Vectors of the phrases that every store compares with, kept once for all stores of a user.

Encoding the table of everyday things takes seconds, and it is the same table for every map. Where the user's cache
cannot be used, the store keeps them; each only ever saves time.
"""

from __future__ import annotations

import threading
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from cgdb.errors import CgdbError
from cgdb.meaning.modelfile import cache_folder
from cgdb.scene import Vector
from cgdb.storage.text_vectors import TextVectors


class SharedVectors:
    """As TextVectors, over the user's cache and a store: what either keeps is known, the first that can takes more."""

    def __init__(self, store: TextVectors) -> None:
        """store: what keeps vectors where the user's cache cannot."""
        self._store = store
        self._cache: TextVectors | None = None
        self._opened = False
        self._lock = threading.Lock()

    def get(self, encoder: str, texts: Sequence[str]) -> dict[str, Vector]:
        """The vectors (d,) float32 that are kept, by text."""
        found: dict[str, Vector] = {}
        if (cache := self._user_cache()) is not None:
            try:
                found = cache.get(encoder, texts)
            except CgdbError:  # locked or unreadable: as if there were none
                self._give_up()
        if missing := [text for text in texts if text not in found]:
            found |= self._store.get(encoder, missing)
        return found

    def missing(self, encoder: str, texts: Sequence[str]) -> list[str]:
        """The texts without a vector, each once, in the order given."""
        known = self.get(encoder, texts)
        return [text for text in dict.fromkeys(texts) if text not in known]

    def put(self, encoder: str, texts: Sequence[str], vectors: NDArray[np.float32]) -> None:
        """Keep vectors (n, d) of n texts."""
        cache = self._user_cache()
        if cache is not None and not cache.read_only:
            try:
                return cache.put(encoder, texts, vectors)
            except CgdbError:  # a full disk, say; the store may lie on another
                self._give_up()
        return self._store.put(encoder, texts, vectors)

    def close(self) -> None:
        """Give the user's cache back; a later call opens it again."""
        if self._cache is not None:
            self._cache.close()

    def _user_cache(self) -> TextVectors | None:
        with self._lock:
            if not self._opened:
                self._opened = True
                folder = cache_folder()
                try:
                    folder.mkdir(parents=True, exist_ok=True)
                    self._cache = TextVectors(folder / "texts.sqlite")
                except OSError:
                    self._cache = None
            return self._cache

    def _give_up(self) -> None:
        self.close()
        self._cache = None
