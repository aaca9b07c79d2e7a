"""What a question asks of a thing: a kind, traits, a use. "A soft red chair to read in" asks for all three."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import combinations
from typing import TYPE_CHECKING, Literal

from cgdb.meaning import everyday, situations
from cgdb.meaning.lexicon import (
    BRANDS,
    CLAUSE_STARTS,
    DETERMINERS,
    FUNCTION_WORDS,
    GENERIC_HEADS,
    NOUNS_TOO,
    PLACE_HEADS,
)
from cgdb.meaning.traits import LONGEST_NAME
from cgdb.meaning.uses import Frame, frame, noun_runs, synonyms
from cgdb.meaning.words import parse, singular, stem, stemmed, tokens

if TYPE_CHECKING:
    from cgdb.meaning.knowledge import Knowledge

_EMPTY = frozenset(("thing", "things", "object", "objects", "item", "items", "stuff"))
Form = Literal["kind", "name", "use", "traits"]

_FILLERS = frozenset(
    ("very", "really", "quite", "so", "too", "extremely", "rather", "fairly", "that", "is", "are", "which", "and")
)


@dataclass(frozen=True, slots=True, kw_only=True)
class Facets:
    """What a text asks.

    form: what it is mostly about: a "kind" of thing that the table has, a "name" that it lacks ("IKEA"), a "use", or
    nothing but "traits". kinds: things (indices) of which it must be one kind, traits it must have, what is left over.

    rest: the text that neither names a kind nor a trait and has to be matched by meaning; None where nothing is left.
    doing: the rest read as a use.
    arguments: things that the use is done to ("take a laptop apart"): mentioned, and not what is looked for.
    named: the words (singular) by which the kinds are named; what is left of the text are its particulars.
    told: pieces of the situation that somebody tells of ("for when my throat is dry"), to be matched one by one.
    """

    form: Form
    kinds: tuple[int, ...] = ()
    traits: tuple[int, ...] = ()
    rest: str | None = None
    doing: Frame | None = None
    arguments: tuple[int, ...] = ()
    named: frozenset[str] = frozenset()
    told: tuple[str, ...] = ()


def facets(known: Knowledge, text: str) -> Facets:
    """Split a question into kind, traits and the rest."""
    told = situations.told(text)
    if told:
        return _of_situation(known, text, told)
    parsed = parse(text)
    words = [t for t in tokens(text) if t[0].isalnum()]
    if parsed.generic or not parsed.heads:
        return _of_generic(known, words)
    kinds: list[int] = []
    traits: list[int] = []
    names: set[str] = set()
    of_matter = len(words) > 1 and words[-1] in _EMPTY
    for phrase in parsed.heads:
        stems = stemmed(phrase)
        # "A tall glass thing" is of glass, and no glass.
        matter = of_matter and not known.traits_in([s for s in stems if s not in FUNCTION_WORDS])[1]
        named = () if matter else known.things_named(phrase)
        if named and not BRANDS.intersection(stems):
            kinds.extend(named)
            names.update(stems[known.name_start(stems) :])
            traits.extend(known.traits_in(stems[: known.name_start(stems)])[0])
        else:
            said, left = known.traits_in([s for s in stems if s not in FUNCTION_WORDS])
            if not left:
                traits.extend(said)
    traits.extend(_said_after(known, words))
    if kinds or traits:
        form: Form = "kind" if kinds else "traits"
        return Facets(
            form=form,
            kinds=tuple(dict.fromkeys(kinds)),
            traits=tuple(dict.fromkeys(traits)),
            named=frozenset(names),
        )
    if words and words[0] in ("to", "for") and len(words) > 1:
        return _of_generic(known, words)
    verb = bool(words) and stem(words[0]) in known.doing.verbs
    if verb:
        return _of_generic(known, words)
    return Facets(form="name", rest=text)


def _of_situation(known: Knowledge, text: str, told: tuple[str, ...]) -> Facets:
    """The facets of "something to drink from for when my throat is dry": of what stands before, and what is told."""
    before, whole = situations.split(text)
    asked = facets(known, before)
    if asked.kinds:
        return asked  # "an umbrella for when it rains" is an umbrella
    words = [t.removesuffix("'s") for t in tokens(whole) if t[0].isalnum()]
    return replace(
        asked,
        form="use",
        rest=asked.rest or whole,
        arguments=tuple(dict.fromkeys((*asked.arguments, *_arguments(known, words, None)))),
        told=told,
    )


def _said_after(known: Knowledge, words: Sequence[str]) -> list[int]:
    """The traits said behind the noun: "shoes made of leather", "a lamp in red", "a chair that is soft"."""
    found: list[int] = []
    for at, word in enumerate(words[:-1]):
        opens = (word in ("of", "from") and at > 0 and words[at - 1] in ("made", "out")) or (
            word in ("is", "are") and at > 0 and words[at - 1] in ("that", "which")
        )
        colour = word == "in" and at > 0
        if not (opens or colour):
            continue
        stems = stemmed(" ".join(words[at + 1 : at + 4]))
        said, _ = known.traits_in(stems[:1] if colour or len(stems) == 1 else stems[:2])
        found.extend(t for t in said if opens or known.traits[t] in everyday.COLORS)
    return found


def _of_generic(known: Knowledge, words: Sequence[str]) -> Facets:
    """The facets of "something light to sit on": adjectives after the empty head are traits, what follows a use."""
    at = 0
    place = False
    while at < len(words) and (words[at] in GENERIC_HEADS or words[at] in DETERMINERS):
        place |= words[at] in PLACE_HEADS
        at += 1
    traits: list[int] = []
    while at < len(words):
        if words[at] == "made" and words[at + 1 : at + 2] in (["of"], ["from"]):
            at += 2
            continue
        if words[at] in _FILLERS:
            at += 1
            continue
        for length in range(min(LONGEST_NAME, len(words) - at), 0, -1):
            trait = known.trait_by_name.get(tuple(singular(w) for w in words[at : at + length]))
            if trait is not None:
                break
        else:
            break
        traits.append(trait)
        at += length
    rest = words[at:]
    informative = [w for w in rest if w not in FUNCTION_WORDS]
    text = " ".join(rest)
    doing = frame(text, place=place) if informative else None
    begins = rest[:1] and (rest[0] in CLAUSE_STARTS or rest[1:2] == ["to"])
    if doing is not None and not begins and not any(_is_verb(known, verb) for verb in doing.verbs):
        doing = None
    return Facets(
        form="use" if informative or not traits else "traits",
        traits=tuple(dict.fromkeys(traits)),
        rest=text if informative else None,
        doing=doing,
        arguments=_arguments(known, rest, doing),
    )


def _is_verb(known: Knowledge, word: str) -> bool:
    return word in known.doing.verbs or synonyms(word) != {word}


def _arguments(known: Knowledge, words: Sequence[str], doing: Frame | None) -> tuple[int, ...]:
    """Things that something is done to ("cut paper"), or that are named as countable ("a laptop", "books")."""
    found: list[int] = []
    for run in noun_runs(doing.object_words if doing is not None else ()):
        for start, end in combinations(range(len(run) + 1), 2):
            # "To add light" asks for lights; "gold" and "silver" are no things either.
            if run[end - 1] not in NOUNS_TOO:
                found.extend(known.thing_by_name.get(run[start:end], ()))
    for end in range(1, len(words) + 1):
        stems = tuple(singular(w) for w in words[max(0, end - LONGEST_NAME) : end])
        start = known.name_start(stems)
        if start < 0:
            continue
        at = end - (len(stems) - start)
        before = words[max(0, at - 3) : at]
        plural = words[end - 1].endswith("s") and singular(words[end - 1]) != words[end - 1]
        if not {"as", "like"} & set(before) and (plural or any(w in DETERMINERS for w in before)):
            found.extend(known.thing_by_name[stems[start:]])
    if {"as", "like"} & set(words):
        return ()
    return tuple(dict.fromkeys(found))
