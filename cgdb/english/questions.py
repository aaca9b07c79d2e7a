"""An English question taken apart: what is wanted, what is not, where it is, how large, how many, which of them.

The grammar is shallow on purpose: words that begin, exclude, relate or compare (cues) cut a question into pieces,
and the pieces stay as they were written, for ``~`` to match by meaning. What is not recognised is left in the text.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from dataclasses import replace

from cgdb.english.antecedents import resolved
from cgdb.english.clauses import Clause, read
from cgdb.english.cues import PRONOUNS, STARTERS
from cgdb.english.intent import Asked, Located
from cgdb.english.lookahead import PREVIOUS, only_traits
from cgdb.english.needs import remedy
from cgdb.english.phrases import Phrases, Word, cleaned, joined, stretch, words
from cgdb.english.question_frames import MARKS, begins_question, without_asides
from cgdb.english.question_heads import head, in_each_scene, is_polar, without_auxiliary
from cgdb.english.reasons import (
    begins_reason,
    forbidden,
    guessed,
    out_of_use,
    placing,
    wish_of,
    without_asides_behind,
    without_thrown_in,
)
from cgdb.english.whole_needs import in_need

MOST_WORDS = 200
"""Words of a question that are read: more than anybody asks, and few enough for any text to be cheap."""

MOST_PARTS = 12
"""Exclusions, and as many relations, places and sizes, that a question may have; of a text that goes on, the first."""

_BACK = frozenset(("it", "them", "they", "these", "those", "that", "this", "that one", "this one"))
_ENDS = frozenset(".;?!")
_DASH = re.compile(r"\s+(?:-+|–|—)\s+|\s*—\s*")
_JOINS = frozenset((",", ":", "so", "and", "but"))
_BECAUSE = frozenset(("because", "since", "cause", "cos"))
_TELLERS = frozenset(("i", "we"))
_DEFINITE = frozenset(("the", "my", "our", "his", "her", "their"))
_ANYTHING = frozenset(("something", "anything", "somewhere", "anywhere"))
_BEFORE_REASONS = frozenset((",", ":", "so", "and", "but", "because", "since", "as", "cause", "cos", "only", "though"))


def understand(question: str, places: Sequence[str] = (), *, previous: bool = False) -> Asked:
    """Take a question apart. places: names of the rooms that the map knows, beside those that everybody knows.

    previous: something was found before, which "it" and "them" may mean.
    """
    text = _DASH.sub(", ", cleaned(question))
    out = _written_out(text)
    back, text = out != text, out
    found, notes = without_asides_behind(text, without_thrown_in(without_asides(words(text))))
    if len(found) > MOST_WORDS:
        found, notes = (
            found[:MOST_WORDS],
            (
                *notes,
                f"only the first {MOST_WORDS} words were read",
            ),
        )
    names = Phrases({True: ",".join(" ".join(word.form for word in words(cleaned(place))) for place in places)})

    def read_all(some: Sequence[Word]) -> Asked:
        return _read_all(text, some, lambda clause: read(text, clause, names, previous=previous), back=back)

    asked = _headed(text, found, read_all, previous=previous)
    if asked is None:
        each = in_each_scene(found)
        asked = read_all(without_auxiliary(found if each is None else found[:each]))
        if each is not None and asked.form in ("count", "find", "exists"):
            asked = replace(asked, form="per scene", what="most")
        asked = replace(asked, polar=asked.form == "exists" or is_polar(found))
        if each is None:
            asked = in_need(asked, text, found, back=back)
        said = [word.form for word in found if word.form not in MARKS]
        bare = not (asked.wanted or asked.located or asked.measured or asked.first) and said[-1:] and said[-1] in _BACK
        if previous and (bare or asked.wanted.casefold() in _BACK):
            asked = replace(asked, wanted=PREVIOUS)
    return replace(asked, notes=(*notes, *asked.notes))


def _written_out(text: str) -> str:
    """The text with what "it" stands for in its own first clause."""
    found = words(text)
    if len(found) > MOST_WORDS:
        return text
    plain, _ = without_asides_behind(text, without_thrown_in(without_asides(found)))
    return resolved(text, [clause for clause in _clauses(text, plain) if not guessed(clause)]) or text


def _read_all(
    text: str, some: Sequence[Word], read_one: Callable[[Sequence[Word]], Clause | None], *, back: bool
) -> Asked:
    """The clauses of a question, read one by one, as one."""
    parts: list[Clause] = []
    gone: list[str] = []
    lacking: list[Clause] = []
    traits: list[str] = []
    thoughts: list[str] = []
    for clause in _clauses(text, some):
        denied = forbidden(clause)
        thought = guessed(clause) if parts else 0
        it_is = thought or (placing(clause) if parts else 0)
        begin = denied[0] if denied is not None else it_is or wish_of(clause)
        part = read_one(clause[begin:]) if begin or not parts else _of_somebody(clause) or read_one(clause)
        if part is None:
            continue
        described = part.asked.wanted if it_is else _of_the_one(part.asked.wanted) if parts and not denied else ""
        if described and only_traits(described):
            traits.append(described)
            part = replace(part, asked=replace(part.asked, wanted=""), bare=True)
        if thought:
            thoughts.append(f"only thought to be so: {stretch(text, clause[thought:])}")
            part = _only_thought(part)
        if denied is not None:
            part = _denied(part, named=denied[1])
        if names := out_of_use(text, clause):
            gone.extend(names)
            lacking.append(part)
        parts.append(part)
    rest = [part for part in parts if part not in lacking]
    if gone and any(part.asked.wanted and not part.bare and not part.story for part in rest):
        # "Warm up some soup, the microwave is broken": with something else.
        asked = _together(rest, back=back)
        asked = replace(asked, excluded=_once(*asked.excluded, *gone))
    else:
        asked = _together(parts, back=back)
    return replace(asked, wanted=" ".join((*traits, asked.wanted)).strip(), notes=tuple(thoughts))


def _of_somebody(clause: Sequence[Word]) -> Clause | None:
    """What "he is on a diet" tells behind what was asked; None of another clause."""
    forms = [word.form for word in clause]
    if len(forms) < 3 or forms[0] not in ("he", "she") or forms[1] not in ("is", "was", "has"):
        return None
    return Clause(asked=Asked(), story=True, remedy=remedy(forms))


def _owned(excluded: str, asked: Asked) -> str:
    """ "The dog's" is the dog's bowl, where a bowl is wanted."""
    return f"{excluded} {asked.wanted}" if excluded.endswith("'s") and asked.wanted and not asked.use else excluded


def _of_the_one(wanted: str) -> str:
    """What "the soft one" says of a thing that was named before; "" of other words."""
    said, _, last = wanted.rpartition(" ")
    return said if last.casefold() in ("one", "ones") else ""


def _only_thought(part: Clause) -> Clause:
    """What "I think it is up high on the shelf" says: where the thing may be, and nothing that is wanted."""
    located = tuple(replace(one, guessed=True) for one in part.asked.located)
    return replace(part, asked=Asked(located=located), bare=True, story=False)


def _denied(part: Clause, *, named: bool) -> Clause:
    """What "don't bring the red one" or "don't put it on the floor" says, of which nothing is wanted."""
    asked = part.asked
    excluded = (asked.wanted, *asked.excluded) if named and asked.wanted and not asked.located else ()
    located = tuple(replace(one, negated=not one.negated) for one in asked.located if not one.chained)
    return replace(
        part, asked=Asked(excluded=excluded, located=located, not_places=asked.places), bare=True, story=False
    )


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


def _clauses(text: str, found: Sequence[Word]) -> list[tuple[Word, ...]]:
    """Cut at the ends of sentences, and where a question or a reason begins behind a comma ("I spilled it, what can I
    use?", "a cold drink, I'm driving").
    """
    parts: list[tuple[Word, ...]] = []
    begin = 0
    for i, word in enumerate(found):
        if word.form in _ENDS or _cuts(text, found, begin, i):
            parts.append(tuple(found[begin:i]))
            begin = i + 1
    parts.append(tuple(found[begin:]))
    return [part for part in parts if any(word.form not in MARKS for word in part)]


def _cuts(text: str, found: Sequence[Word], begin: int, i: int) -> bool:
    """Whether the clause that began at word ``begin`` ends before word i, which is a comma or a conjunction."""
    form = found[i].form
    if form in _JOINS and begins_question(found, i + 1):
        return True
    if i == begin or form not in _BEFORE_REASONS:
        return False
    following = found[i + 1].form if i + 1 < len(found) else ""
    if (form in _BECAUSE and following != "of") or out_of_use(text, found[begin:i]):
        return True
    if following in _ANYTHING and found[begin].form in _TELLERS:
        return True  # "I'm sick of magazines, something else to read"
    end = next((j for j in range(i + 1, len(found)) if found[j].form in _ENDS or found[j].form in (",", "so")), None)
    told = out_of_use(text, found[i + 1 : end]) if form != "and" or following in _DEFINITE else ()
    return bool(told) or begins_reason(found, i + 1) or placing(found[i + 1 :]) > 0 or guessed(found[i + 1 :]) > 0


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
    excluded = (*asked.excluded, *(text for other in others for text in other.excluded))
    return replace(
        asked,
        excluded=_once(*(_owned(text, asked) for text in excluded)),
        located=(*asked.located, *(one for other in asking for one in other.located))[:MOST_PARTS],
        places=_once(*asked.places, *(text for other in others for text in other.places)),
        not_places=_once(*asked.not_places, *(text for other in others for text in other.not_places)),
        measured=(*asked.measured, *(one for other in asking for one in other.measured))[:MOST_PARTS],
        first=asked.first or next((other.first for other in asking if other.first), None),
    )


def _once(*texts: str) -> tuple[str, ...]:
    return tuple(dict.fromkeys(texts))[:MOST_PARTS]
