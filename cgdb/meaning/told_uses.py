"""What maps and models say that their own things are for: "cut paper" of a box opener that no table knows."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from cgdb.meaning.contrast import log_odds, probability
from cgdb.meaning.facets import Facets
from cgdb.meaning.knowledge import Knowledge
from cgdb.meaning.lexicon import FUNCTION_WORDS
from cgdb.meaning.row_lists import Lists
from cgdb.meaning.stated import NOTED
from cgdb.meaning.texts import Source, TextIndex
from cgdb.meaning.traits import YES
from cgdb.meaning.uses import Gap, Matches, Uses
from cgdb.meaning.words import stem, tokens

Floats = NDArray[np.float32]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class ToldUses:
    """The uses that a scene tells of its things, and the qualities, which may be asked for as uses are.

    ids: (v,) the texts that they are; words: (v,) their stems; doing: they as frames. are_uses, are_bare: (v,) bool,
    whether they are uses, and whether these are a verb alone, which does not say the part that the thing plays
    ("drink"). lists: by row, numbers of uses; those that a model noted are numbered v higher.
    """

    ids: NDArray[np.int32]
    words: tuple[frozenset[str], ...]
    doing: Uses
    are_uses: NDArray[np.bool_]
    are_bare: NDArray[np.bool_]
    lists: Lists

    @classmethod
    def of(cls, index: TextIndex) -> ToldUses | None:
        """None where the scene tells no uses."""
        uses = np.isin(index.sources, (Source.USE, Source.NOTED_USE))
        noted = np.isin(index.sources, (Source.NOTED, Source.NOTED_USE))
        chosen = uses | noted | (index.sources == Source.QUALITY)
        if not chosen.any():
            return None
        ids, numbers = np.unique(index.text_ids[chosen], return_inverse=True)
        numbers = numbers.reshape(-1)
        phrases = [index.texts[i] for i in ids.tolist()]
        are_uses = np.zeros(len(ids), dtype=np.bool_)
        are_uses[numbers[uses[chosen]]] = True
        doing = Uses.of(phrases)
        return cls(
            ids=ids,
            words=tuple(frozenset(stem(word) for word in tokens(phrase)) for phrase in phrases),
            doing=doing,
            are_uses=are_uses,
            are_bare=are_uses & (np.asarray([len(p.split()) for p in phrases]) == 1) & (doing.gaps != Gap.PLACE),
            lists=Lists.of(
                len(index.keys),
                index.rows_of_entries()[chosen],
                (numbers + len(ids) * noted[chosen]).astype(np.int32),
            ),
        )

    def matches(self, known: Knowledge, asks: Facets) -> Matches | None:
        """How each use (v) goes with what is asked, by the words; None where no doing is asked for."""
        if asks.doing is None:
            return None
        return self.doing.matches(asks.doing, known.kin(asks.doing), elsewhere=known.doing.have_verb(asks.doing))

    def naming(self, text: str) -> Floats:
        """(v,) 1 where a use or quality has every word of a text that tells something ("made of oak")."""
        asked = {stem(word) for word in tokens(text) if word not in FUNCTION_WORDS and word[0].isalnum()}
        return np.asarray([bool(asked) and asked <= words for words in self.words], dtype=np.float32)


def believed(degree: Floats) -> Floats:
    """(2v,) the degrees to which uses serve, as the map says them and, a little less sure, as a model notes them."""
    said = np.minimum(degree, np.float32(YES))
    return np.concatenate([said, probability(np.float32(NOTED) * log_odds(said))])
