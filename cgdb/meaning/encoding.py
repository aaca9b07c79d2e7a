"""Giving every text its vector ahead of time, in batches, so that no question has to wait for it."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from cgdb.meaning import background
from cgdb.meaning.degrees import Degrees
from cgdb.meaning.embed import Encoder
from cgdb.meaning.encoders import Encoders

BATCH = 1024


def encode(encoder: Encoder, encoders: Encoders, scenes: Sequence[Degrees]) -> Iterator[tuple[int, int]]:
    """Encode the texts of scenes that are not kept yet; yields (done, of all) after each batch, which is then kept."""
    keeper = encoders.keeper(encoder)
    common = keeper.missing(encoder.name, background.texts())
    own = dict.fromkeys(text for degrees in scenes for text in degrees.missing_texts(encoder))
    done, of_all = 0, len(common) + len(own)
    for place, missing in ((keeper, common), (encoders.kept, own)):
        # Of similar length together: a batch is padded to its longest text.
        texts = sorted(missing, key=len)
        for start in range(0, len(texts), BATCH):
            batch = texts[start : start + BATCH]
            place.put(encoder.name, batch, encoder.texts(batch))
            done += len(batch)
            yield done, of_all
