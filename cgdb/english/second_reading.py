"""A question read a second time, where what was read at first is nowhere: by a name in it that the map knows, or as the
description of a thing that it does not name ("the round thing with all the countries on it").
"""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import replace

from cgdb.english import cues
from cgdb.english.intent import Asked
from cgdb.english.phrases import Word, cleaned, listed, stretch, words
from cgdb.english.question_frames import MARKS
from cgdb.meaning.knowledge import knowledge
from cgdb.meaning.lexicon import FUNCTION_WORDS, VESSELS
from cgdb.meaning.words import singular

LONGEST_NAME = 4
"""Words of a name that is looked for."""
LIKE = "something like"
"""How a description begins in a statement: what follows is matched whole, by meaning."""

_OPENS = frozenset(("lead", "seek", "exists", "where", "count"))
_RELATIVE = listed("that which where who whose")


def by_name(question: str, asked: Asked, names: Collection[tuple[str, ...]]) -> Asked | None:
    """What a question asks if it asks for the name of the map that it says; None where it says none but what was read.

    names: of the things of the map, in singular words. What only places the thing, is excluded or belongs to what is
    told is not meant.
    """
    if asked.use or asked.form not in ("find", "exists", "where"):
        return None
    found = words(cleaned(question))
    forms = tuple(singular(word.form) for word in found)
    outside = " ".join((*asked.excluded, *(a for one in asked.located for a in one.anchors), asked.against)).casefold()
    for length in range(LONGEST_NAME, 0, -1):
        for at in range(len(forms) - length + 1):
            text = stretch(question, found[at : at + length])
            if forms[at : at + length] not in names or text.casefold() in outside:
                continue
            if _is_asked_for(found, at, at + length):
                known = tuple(singular(word.form) for word in words(asked.wanted))
                return None if known[-length:] == forms[at : at + length] else replace(asked, wanted=text)
    return None


def _is_asked_for(found: Sequence[Word], begin: int, end: int) -> bool:
    """Whether a name stands where a question says what it wants: at its beginning, or behind "I am after the"."""
    at = begin
    while at > 0 and (found[at - 1].form in cues.STARTERS or knowledge().facets(found[at - 1].form).form == "traits"):
        at -= 1
    following = found[end].form if end < len(found) else ""
    if following and following not in MARKS | FUNCTION_WORDS:
        return False
    if at == 0 or found[at - 1].form in MARKS:
        return True
    hits = ((i, cues.frames().at(found, i)) for i in range(max(0, at - 8), at))
    return any(hit is not None and hit[1] in _OPENS and i + hit[0] in (at, begin) for i, hit in hits)


def by_container(asked: Asked) -> Asked | None:
    """What a question asks if it asks for what holds the thing: a bag of flour for "the flour, it is in a bag"."""
    if asked.use or asked.form not in ("find", "exists", "where") or not asked.wanted or len(asked.located) != 1:
        return None
    (held,) = asked.located
    if held.name != "in" or held.negated or held.inverse or len(held.anchors) != 1:
        return None
    container = held.anchors[0].split()[-1:]
    if not container or singular(container[0].casefold()) not in VESSELS:
        return None
    return replace(asked, wanted=f"{container[0]} of {asked.wanted}", located=())


def by_description(asked: Asked) -> str:
    """The text of a thing that is described and not named, whole, where it is with it; "" of a mere name."""
    if asked.use or asked.form not in ("find", "exists", "where") or asked.measured or asked.first or asked.excluded:
        return ""
    found = words(asked.wanted)
    tells = any(word.form in _RELATIVE | cues.GENERIC for word in found[1:])
    if not tells or _names_a_kind(found):
        return ""
    return " ".join((LIKE, asked.wanted, *(one.text for one in asked.located if not one.negated)))


def _names_a_kind(found: Sequence[Word]) -> bool:
    """Whether a description begins with a kind of thing ("round clock on the wall"), unlike "ball thing with ..."."""
    forms = [word.form for word in found]
    head = next((i for i, form in enumerate(forms) if form in FUNCTION_WORDS | cues.GENERIC), len(forms))
    if set(forms[head : head + 1]) & cues.GENERIC:
        return False
    return any(knowledge().things_named(" ".join(forms[:end])) for end in range(1, head + 1))
