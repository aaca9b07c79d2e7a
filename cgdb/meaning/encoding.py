"""Giving every text its vector ahead of time, in batches, so that no question has to wait for it."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from cgdb.meaning import background
from cgdb.meaning.degrees import Degrees
from cgdb.meaning.embed import Encoder
from cgdb.storage.text_vectors import TextVectors

BATCH = 1024


def encode(encoder: Encoder, kept: TextVectors, scenes: Sequence[Degrees]) -> Iterator[tuple[int, int]]:
    """Encode the texts of scenes that are not kept yet; yields (done, of all) after each batch, which is then kept."""
    missing = dict.fromkeys(kept.missing(encoder.name, background.texts()))
    for degrees in scenes:
        missing.update(dict.fromkeys(degrees.missing_texts(encoder)))
    # Of similar length together: a batch is padded to its longest text.
    texts = sorted(missing, key=len)
    for start in range(0, len(texts), BATCH):
        batch = texts[start : start + BATCH]
        kept.put(encoder.name, batch, encoder.texts(batch))
        yield min(start + BATCH, len(texts)), len(texts)
