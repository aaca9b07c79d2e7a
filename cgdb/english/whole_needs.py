"""A question that names nothing known, or tells of a need: kept whole, to be matched with situations."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from cgdb.english import cues
from cgdb.english.intent import Asked
from cgdb.english.lookahead import PREVIOUS
from cgdb.english.needs import is_told, kept, situation
from cgdb.english.phrases import Word, listed, words
from cgdb.meaning.knowledge import knowledge
from cgdb.meaning.lexicon import FUNCTION_WORDS
from cgdb.meaning.situations import MARK
from cgdb.meaning.words import stem, tokens

_NOT_KNOWN = ("name", "use")
"""What a text asks that names no thing of the table and no trait."""

_ASKS = listed(
    """find bring get fetch give show grab pass hand take please pls plz kindly can could would will need want thing i
    you me we us"""
)


def in_need(asked: Asked, text: str, found: Sequence[Word], *, back: bool) -> Asked:
    """A question that tells of a need with all that it tells; any other as it was read.

    back: "I bought a plant, where could I put it?" asks for all that it tells of.
    """
    if PREVIOUS in (asked.wanted, *(a for one in asked.located for a in one.anchors)):
        return asked
    told = situation(text, found)
    if told is not None:
        told_whole = told.told.casefold()
        excluded = tuple(one for one in asked.excluded if one.casefold() not in told_whole)
        clear = not asked.located and excluded == asked.excluded
        asks = told.wishes or (back and told.use)
        if not (asks and clear and asked.use and asked.wanted.startswith(("something ", "somewhere "))):
            return Asked(wanted=told.wanted, use=True, excluded=excluded, notes=asked.notes)
    # "Trim the hedge" asks for something to trim the hedge, and tells no more.
    return _whole(asked, text, found)


def _whole(asked: Asked, text: str, found: Sequence[Word]) -> Asked:
    """A question in which nothing known was read, or what somebody cannot do was taken for an exclusion, as a need."""
    placed = asked.located or asked.places or asked.not_places or asked.measured or asked.first
    if asked.form != "find" or placed or asked.use or not asked.wanted:
        return asked
    excluded = tuple(one for one in asked.excluded if not is_told([word.form for word in words(one)]))
    lost = excluded != asked.excluded
    if excluded or not (lost or knowledge().facets(asked.wanted).form in _NOT_KNOWN):
        return asked
    whole = kept(text, found)
    if not _adds(whole, asked.wanted):
        return asked
    return replace(asked, wanted=f"something{MARK}: {whole}", use=True, excluded=())


def _adds(whole: str, wanted: str) -> bool:
    """Whether a text says more than another, but for how it asks."""
    said = {stem(word) for word in tokens(wanted)}
    return any(
        word[0].isalnum() and stem(word) not in said and word not in FUNCTION_WORDS | _ASKS | cues.GENERIC
        for word in tokens(whole)
    )
