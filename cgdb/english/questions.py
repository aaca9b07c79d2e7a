"""An English question taken apart: what is wanted, what is not, where it is, how large, how many, which of them.

The grammar is shallow on purpose: words that begin, exclude, relate or compare (cues) cut a question into pieces,
and the pieces stay as they were written, for ``~`` to match by meaning. What is not recognised is left in the text.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

from cgdb.english.antecedents import resolved
from cgdb.english.clauses import Clause, read
from cgdb.english.cues import PRONOUNS, STARTERS
from cgdb.english.intent import Asked, Located
from cgdb.english.lookahead import PREVIOUS
from cgdb.english.phrases import Phrases, Word, cleaned, joined, stretch, words
from cgdb.english.question_frames import MARKS, begins_question, without_asides
from cgdb.english.question_heads import head, in_each_scene, is_polar, without_auxiliary

MOST_WORDS = 200
"""Words of a question that are read: more than anybody asks, and few enough for any text to be cheap."""

MOST_PARTS = 12
"""Exclusions, and as many relations, places and sizes, that a question may have; of a text that goes on, the first."""

_BACK = frozenset(("it", "them", "they", "these", "those", "that", "this", "that one", "this one"))
_ENDS = frozenset(".;?!")


def understand(question: str, places: Sequence[str] = (), *, previous: bool = False) -> Asked:
    """Take a question apart. places: names of the rooms that the map knows, beside those that everybody knows.

    previous: something was found before, which "it" and "them" may mean.
    """
    text = cleaned(question)
    out = _written_out(text)
    back, text = out != text, out
    found = without_asides(words(text))
    notes: tuple[str, ...] = ()
    if len(found) > MOST_WORDS:
        found, notes = found[:MOST_WORDS], (f"only the first {MOST_WORDS} words were read",)
    names = Phrases({True: ",".join(" ".join(word.form for word in words(cleaned(place))) for place in places)})

    def read_all(some: Sequence[Word]) -> Asked:
        parts = [read(text, clause, names, previous=previous) for clause in _clauses(some)]
        return _together([part for part in parts if part is not None], back=back)

    asked = _headed(text, found, read_all, previous=previous)
    if asked is None:
        each = in_each_scene(found)
        asked = read_all(without_auxiliary(found if each is None else found[:each]))
        if each is not None and asked.form in ("count", "find", "exists"):
            asked = replace(asked, form="per scene", what="most")
        asked = replace(asked, polar=asked.form == "exists" or is_polar(found))
        said = [word.form for word in found if word.form not in MARKS]
        bare = not (asked.wanted or asked.located or asked.measured or asked.first) and said[-1:] and said[-1] in _BACK
        if previous and (bare or asked.wanted.casefold() in _BACK):
            asked = replace(asked, wanted=PREVIOUS)
    return replace(asked, notes=notes)


def _written_out(text: str) -> str:
    """The text with what "it" stands for in its own first clause."""
    found = words(text)
    return resolved(text, _clauses(without_asides(found))) or text if len(found) <= MOST_WORDS else text


def _headed(
    text: str, found: Sequence[Word], read_all: Callable[[Sequence[Word]], Asked], *, previous: bool
) -> Asked | None:
    """A question for a value ("how tall is the lamp"), its subject read as any clause; None where there is none."""
    begins = head(found)
    if begins is None:
        return None
    if begins.whole:
        asked = Asked(wanted=joined(text, [word for word in begins.subject if word.form not in STARTERS]))
    else:
        asked = read_all(begins.subject)
    if asked.form != "find" or (begins.form == "all" and not asked.wanted):
        return None
    if begins.first is not None:
        asked = replace(asked, first=begins.first)
    against = stretch(text, begins.against) if begins.form == "all" else ""
    if begins.form == "compare":
        other = read_all(begins.against)
        if not asked.wanted or not other.wanted:
            return None
        against = other.wanted
        asked = replace(
            asked,
            located=(*asked.located, *other.located),
            places=_once(*asked.places, *other.places),
            not_places=_once(*asked.not_places, *other.not_places),
            excluded=_once(*asked.excluded, *other.excluded),
        )
    elif begins.form == "distance":
        kept = list(begins.against)
        while kept and kept[0].form in STARTERS:
            kept.pop(0)
        against = stretch(text, kept)
        if not kept or kept[0].form in PRONOUNS:
            against = PREVIOUS if begins.against and previous else ""
    if previous and (asked.wanted.casefold() in _BACK or (not asked.wanted and begins.subject[0].form in PRONOUNS)):
        asked = Asked(wanted=PREVIOUS)
    what, level = begins.what, tuple(one for one in asked.located if _over_floor(one))
    if what == "height" and level:
        what, asked = "level", replace(asked, located=tuple(one for one in asked.located if one not in level))
    polar = begins.what in ("more", "fewer", "as many") or begins.form in ("count", "all")
    return replace(asked, form=begins.form, what=what, against=against, polar=polar)


def _over_floor(located: Located) -> bool:
    return located.name == "above" and located.anchors in (("floor",), ("ground",))


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


def _together(parts: Sequence[Clause], *, back: bool) -> Asked:
    """The clauses of a question as one: what is wanted from the one that asks, exclusions and places from all.

    back: the one that asks speaks of what another tells, and so is no mere reason.
    """
    asks = [part for part in parts if not part.story]
    stories = [part for part in parts if part.story]
    helps = next((part.remedy for part in stories if part.remedy), None)
    named = min((part for part in asks if part.asked.wanted and not part.bare), key=lambda p: p.wish, default=None)
    main = named or next(iter(asks), None) or next(iter(stories), None)
    if main is None:
        return Asked()
    asked = main.asked
    if helps is not None and (named is None or (named.wish and not back)):
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
