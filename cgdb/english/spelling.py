"""Slips of the pen in a question: a word that nobody knows, one letter away from one that the question may well mean.

Only words that are neither English as far as the tables here know nor in the store are touched, and the answer says so.
"""

from __future__ import annotations

from functools import lru_cache

from cgdb.english import cues
from cgdb.english.phrases import listed, words
from cgdb.meaning.knowledge import knowledge
from cgdb.meaning.lexicon import ADJECTIVES, COMMON_WORDS, FUNCTION_WORDS, RELATION_WORDS
from cgdb.meaning.words import singular, stem, tokens

_ASKING = listed("what where which how")
_SMALL = listed("the what where which how many with there that this show find near next under and from are has have")
_RIGHT = listed("form thee thy tha hat bat rat cat mat")
SHORTEST = 5
"""Letters of a word that may be read as the name of a thing."""
SURE = 7
"""Letters from which on one may also be wrong, missing or too many: "peace" is no peach, "blank" no bank."""


def corrected(text: str, store: frozenset[str] = frozenset()) -> tuple[str, tuple[str, ...]]:
    """The text with its slips mended, and a line for each of them. store: the words by which it calls its things."""
    notes: list[str] = []
    parts: list[str] = []
    end = 0
    for i, word in enumerate(words(text)):
        name = i > 0 and text[word.start : word.start + 1].isupper()
        meant = None if name else _meant(word.form, store, first=i < 2)
        if meant is not None and word.end > word.start:
            parts.extend((text[end : word.start], meant))
            notes.append(f'read "{text[word.start : word.end]}" as "{meant}"')
            end = word.end
    return "".join((*parts, text[end:])), tuple(dict.fromkeys(notes))


def _meant(form: str, store: frozenset[str], *, first: bool) -> str | None:
    if len(form) < 3 or not form.isascii() or not form.isalpha() or _known(form) or form in store:
        return None
    if singular(form) in store or form in _RIGHT:
        return None
    if first and len(form) < SHORTEST:
        asking = [word for word in sorted(_ASKING) if word[0] == form[0] and _slip(form, word) in ("lost", "swapped")]
        if len(asking) == 1:
            return asking[0]
    small = [word for word in sorted(_SMALL) if _slip(form, word) == "swapped"]
    if small:
        return small[0]
    if len(form) < SHORTEST:
        swapped = [word for word in sorted(store) if _slip(form, word) == "swapped"]
        return swapped[0] if len(swapped) == 1 and len(form) == SHORTEST - 1 else None
    found = sorted(word for word in _targets() | store if word[0] == form[0] and _fits(form, word))
    kept = [word for word in found if word in store] or found
    return kept[0] if len({singular(word) for word in kept}) == 1 else None


def _fits(form: str, word: str) -> bool:
    slip = _slip(form, word)
    if slip == "swapped":
        return True
    enough = SHORTEST if word in RELATION_WORDS else SURE
    return slip is not None and len(form) >= enough and form[-1] == word[-1]


def _slip(form: str, word: str) -> str | None:
    """What one slip makes the word into the form: a letter "lost", "added", "changed", or two "swapped"."""
    if form == word or abs(len(form) - len(word)) > 1:
        return None
    at = next((i for i, (a, b) in enumerate(zip(form, word, strict=False)) if a != b), min(len(form), len(word)))
    if len(form) < len(word):
        return "lost" if form[at:] == word[at + 1 :] else None
    if len(form) > len(word):
        return "added" if form[at + 1 :] == word[at:] else None
    if form[at + 1 :] == word[at + 1 :]:
        return "changed"
    swapped = form[at : at + 2] == word[at : at + 2][::-1]
    return "swapped" if swapped and form[at + 2 :] == word[at + 2 :] else None


def _known(form: str) -> bool:
    return form in _vocabulary() or singular(form) in _vocabulary() or stem(form) in _vocabulary()


@lru_cache(maxsize=1)
def _vocabulary() -> frozenset[str]:
    """Every word of the tables by which questions are understood."""
    table = knowledge()
    used = (word for phrase in (*table.uses, *table.situations) for word in tokens(phrase))
    known = (*table.vocabulary, *used, *FUNCTION_WORDS, *COMMON_WORDS, *ADJECTIVES, *RELATION_WORDS)
    said = (cues.GENERIC, cues.STRUCTURE, cues.PLACING, cues.PARTICIPLES, cues.SEEKING, cues.DIMENSIONS, cues.UNITS)
    cued = (word for group in said for word in group)
    return frozenset((*known, *cued, *_cue_words(), *(stem(word) for word in known)))


@lru_cache(maxsize=1)
def _targets() -> frozenset[str]:
    """What a slip may be read as: names of things, and the longer words that questions are made of."""
    tables = (cues.negations(), cues.relations(), cues.superlatives(), cues.comparatives(), cues.rooms())
    said = (word for table in tables for word in table.words())
    longer = (word for word in (*cues.GENERIC, *RELATION_WORDS, *said) if len(word) >= SHORTEST)
    return frozenset(word for word in (*knowledge().nouns, *longer) if word.isascii() and word.isalpha())


@lru_cache(maxsize=1)
def _cue_words() -> frozenset[str]:
    tables = (cues.frames(), cues.negations(), cues.relations(), cues.superlatives(), cues.comparatives(), cues.rooms())
    return frozenset(word for table in tables for word in table.words())
