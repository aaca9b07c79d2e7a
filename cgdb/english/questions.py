"""An English question taken apart: what is wanted, what is not, where it is, how large, how many, which of them.

The grammar is shallow on purpose: words that begin, exclude, relate or compare (cues) cut a question into pieces,
and the pieces stay as they were written, for ``~`` to match by meaning. What is not recognised is left in the text.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from cgdb.english.clauses import Clause, read
from cgdb.english.intent import Asked
from cgdb.english.phrases import Phrases, Word, cleaned, words
from cgdb.english.question_frames import MARKS, begins_question

MOST_WORDS = 200
"""Words of a question that are read: more than anybody asks, and few enough for any text to be cheap."""

MOST_PARTS = 12
"""Exclusions, and as many relations, places and sizes, that a question may have; of a text that goes on, the first."""

_ENDS = frozenset(".;?!")


def understand(question: str, places: Sequence[str] = ()) -> Asked:
    """Take a question apart. places: names of the rooms that the map knows, beside those that everybody knows."""
    text = cleaned(question)
    found = words(text)
    notes: tuple[str, ...] = ()
    if len(found) > MOST_WORDS:
        found, notes = found[:MOST_WORDS], (f"only the first {MOST_WORDS} words were read",)
    names = Phrases({True: ",".join(" ".join(word.form for word in words(cleaned(place))) for place in places)})
    parts = [read(text, clause, names) for clause in _clauses(found)]
    return replace(_together([part for part in parts if part is not None]), notes=notes)


def _clauses(found: Sequence[Word]) -> list[tuple[Word, ...]]:
    """Cut at the ends of sentences, and where a question begins after a comma ("I spilled it, what can I use?")."""
    parts: list[tuple[Word, ...]] = []
    begin = 0
    for i, word in enumerate(found):
        if word.form in _ENDS or (word.form in (",", ":", "so", "and", "but") and begins_question(found, i + 1)):
            parts.append(tuple(found[begin:i]))
            begin = i + 1
    parts.append(tuple(found[begin:]))
    return [part for part in parts if any(word.form not in MARKS for word in part)]


def _together(parts: Sequence[Clause]) -> Asked:
    """The clauses of a question as one: what is wanted from the one that asks, exclusions and places from all."""
    asks = [part for part in parts if not part.story]
    stories = [part for part in parts if part.story]
    helps = next((part.remedy for part in stories if part.remedy), None)
    named = min((part for part in asks if part.asked.wanted and not part.bare), key=lambda p: p.wish, default=None)
    main = named or next(iter(asks), None) or next(iter(stories), None)
    if main is None:
        return Asked()
    asked = main.asked
    if helps is not None and (named is None or named.wish):
        # "It is raining and I have to go out" asks for what helps in the rain.
        asked = replace(asked, wanted=f"something to {helps}", use=True)
    elif named is None and not asked.wanted:
        told = next((part.asked.wanted for part in stories if part.asked.wanted), "")
        asked = replace(asked, wanted=f"something to use: {told}" if told else "", use=bool(told) or asked.use)
    others = [part.asked for part in parts if part is not main]
    asking = [part.asked for part in asks if part is not main]
    return replace(
        asked,
        excluded=_once(*asked.excluded, *(text for other in others for text in other.excluded)),
        located=(*asked.located, *(one for other in asking for one in other.located))[:MOST_PARTS],
        places=_once(*asked.places, *(text for other in others for text in other.places)),
        not_places=_once(*asked.not_places, *(text for other in others for text in other.not_places)),
        measured=(*asked.measured, *(one for other in asking for one in other.measured))[:MOST_PARTS],
        first=asked.first or next((other.first for other in asking if other.first), None),
    )


def _once(*texts: str) -> tuple[str, ...]:
    return tuple(dict.fromkeys(texts))[:MOST_PARTS]
