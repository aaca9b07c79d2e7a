"""What one does with a thing: "to drink", "to drink from", "to slice bread with", split into verb, object and gap.

"Something to drink" is drunk, "something to drink from" is not: the preposition left standing without its noun, or the
lack of one, says which part the thing plays in the doing. Sentence embeddings hardly see it, so it is read from the
words.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from enum import IntEnum
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from cgdb.meaning.lexicon import (
    CLAUSE_STARTS,
    CREATING,
    DETERMINERS,
    FUNCTION_WORDS,
    IDIOMS,
    LIGHT_VERBS,
    NOT_ADVERBS,
    PARTICLES,
    PATIENT_VERBS,
    POSTURES,
    PREPOSITIONS,
    SUBCLAUSES,
    SYNONYMS,
)
from cgdb.meaning.words import singular, stem, tokens

Floats = NDArray[np.float32]

KINDRED = 0.8
"""How much of a word a word of like meaning covers ("mend" of "repair"), or the name of its kind ("food" of "egg")."""


class Gap(IntEnum):
    """The part that the thing plays in what is done."""

    ANY = 0
    """Not said."""
    PATIENT = 1
    """It is done to the thing: "to drink"."""
    MEANS = 2
    """With or by the thing: "to cut paper with"."""
    PLACE = 3
    """In, on, at or from the thing: "to sit on"."""
    DOER = 4
    """The thing does it, or serves to: "to open a bottle"."""


_AGREE: Mapping[frozenset[Gap], float] = {
    frozenset((Gap.PATIENT, Gap.MEANS)): 0.0,
    frozenset((Gap.PATIENT, Gap.PLACE)): 0.0,
    frozenset((Gap.PATIENT, Gap.DOER)): 0.5,
    frozenset((Gap.MEANS, Gap.PLACE)): 0.4,
    frozenset((Gap.PLACE, Gap.DOER)): 0.8,
}
"""How well two parts go together where it is less than fully."""


@dataclass(frozen=True, slots=True)
class Frame:
    """verbs and objects: stems; around: stems of what else is said ("in the evening"); object_words as written."""

    verbs: tuple[str, ...]
    objects: tuple[str, ...]
    around: tuple[str, ...]
    gap: Gap
    object_words: tuple[str, ...] = ()


def frame(text: str, *, place: bool = False) -> Frame:
    """Read a use. place: the question asks where, so that the thing is a place whatever the preposition."""
    found = _plainly([word for word in tokens(text) if word[0].isalnum()])
    at = 0
    around: list[str] = []
    while at < len(found) - 1 and (found[at] in CLAUSE_STARTS or _is_adverb(found[at])):
        if _is_adverb(found[at]):
            around.append(found[at])
        # "Help a student understand": who is helped is no verb.
        at += 3 if found[at] in ("help", "helps", "let", "lets") and found[at + 1] in DETERMINERS else 1
    # "Fun to play with": what stands before the infinitive says how it is to be.
    before = found[at + 1 : at + 2] == ["to"] and at + 2 < len(found) and found[at + 2] not in DETERMINERS
    if before and _is_manner(found[at]):
        around.append(found[at])
        at += 2
    if at >= len(found):
        return Frame((), (), (), Gap.ANY)
    verbs = [found[at]]
    at += 1
    at += at < len(found) and found[at] in PARTICLES
    while at + 1 < len(found) and found[at] in ("or", "and") and found[at + 1] not in PREPOSITIONS:
        verbs.append(found[at + 1])
        at += 2
    objects: list[str] = []
    posture = stem(verbs[0]) in POSTURES
    gap, into = Gap.ANY, around if posture else objects
    while at < len(found):
        word = found[at]
        following = found[at + 1] if at + 1 < len(found) else ""
        if word == "out" and following == "of":
            at += 1
            word, following = "from", found[at + 1] if at + 1 < len(found) else ""
        if word in SUBCLAUSES:
            into = around
        elif word in PREPOSITIONS:
            if not following or following in PREPOSITIONS or following in SUBCLAUSES or following in ("or", "and"):
                gap = Gap.MEANS if word in ("with", "by", "using") else Gap.PLACE
            into = around
        elif word not in PARTICLES:
            (around if _is_adverb(word) else into).append(word)
        at += 1
    content = [word for word in objects if word not in FUNCTION_WORDS]
    if (place or posture) and gap is not Gap.MEANS:
        gap = Gap.PLACE
    elif gap is Gap.ANY and objects:
        gap = Gap.DOER
    elif gap is Gap.ANY and stem(verbs[0]) in PATIENT_VERBS:
        gap = Gap.PATIENT
    stems = [(stem(verb), verb) for verb in verbs]
    return Frame(
        tuple(dict.fromkeys(s for s, verb in stems if s in LIGHT_VERBS or verb not in FUNCTION_WORDS)),
        tuple(dict.fromkeys(stem(word) for word in content)),
        tuple(dict.fromkeys(stem(word) for word in around if word not in FUNCTION_WORDS)),
        gap,
        tuple(objects),
    )


def _plainly(found: list[str]) -> list[str]:
    """The words with turns of phrase put in words that say what is meant."""
    text = f" {' '.join(found)} "
    for turn, meant in IDIOMS.items():
        if turn in text:
            text = text.replace(f" {turn} ", f" {meant} ")
    return text.split()


def _is_adverb(word: str) -> bool:
    return word.endswith("ly") and len(word) > 4 and word not in NOT_ADVERBS


def _is_manner(word: str) -> bool:
    """Whether a word before an infinitive says how it is to be ("fun to play with"), and is no verb itself."""
    known = synonyms(stem(word))
    return len(known) == 1 or stem("comfortable") in known


def noun_runs(words: Sequence[str]) -> Iterator[tuple[str, ...]]:
    """The runs of words (singular) between determiners and conjunctions: "a cut finger or bread"."""
    run: list[str] = []
    for word in words:
        if word in DETERMINERS or word in FUNCTION_WORDS:
            if run:
                yield tuple(run)
            run = []
        else:
            run.append(singular(word))
    if run:
        yield tuple(run)


@lru_cache(maxsize=1)
def _synonyms() -> Mapping[str, frozenset[str]]:
    groups = [frozenset(stem(word) for word in line.split()) for line in SYNONYMS.strip().splitlines()]
    found: dict[str, frozenset[str]] = {}
    for group in groups:
        for word in group:
            found[word] = found.get(word, frozenset()) | group
    return found


def synonyms(word: str) -> frozenset[str]:
    """The stems that mean nearly the same as a stem, itself included."""
    return _synonyms().get(word, frozenset()) | {word}


@dataclass(frozen=True, slots=True, eq=False)
class Matches:
    """(u,) per use: the share of what is asked that it says, how the thing's parts agree, if its verb is another.

    circumstance: the share of what is asked beside verb and object ("comfortably") that it says. adds: whether it says
    of when or where what nobody asked ("wear at the beach").
    """

    cover: Floats
    agreement: Floats
    other_verb: NDArray[np.bool_]
    circumstance: Floats
    adds: NDArray[np.bool_]


@dataclass(frozen=True, slots=True, eq=False)
class Uses:
    """Many uses (u) as frames, indexed by their words. qualified: whether one says more than verb and object."""

    frames: tuple[Frame, ...]
    gaps: NDArray[np.int64]
    creating: NDArray[np.bool_]
    qualified: NDArray[np.bool_]
    verbs: Mapping[str, NDArray[np.int64]]
    others: Mapping[str, NDArray[np.int64]]

    @classmethod
    def of(cls, phrases: Sequence[str]) -> Uses:
        frames = tuple(frame(phrase) for phrase in phrases)
        verbs: dict[str, list[int]] = {}
        others: dict[str, list[int]] = {}
        for i, one in enumerate(frames):
            for word in one.verbs:
                verbs.setdefault(word, []).append(i)
            for word in dict.fromkeys((*one.objects, *one.around)):
                others.setdefault(word, []).append(i)
        return cls(
            frames,
            np.asarray([one.gap for one in frames], dtype=np.int64),
            np.asarray([bool(CREATING & set(one.verbs)) for one in frames], dtype=np.bool_),
            np.asarray([bool(one.around) for one in frames], dtype=np.bool_),
            {word: np.asarray(ids, dtype=np.int64) for word, ids in verbs.items()},
            {word: np.asarray(ids, dtype=np.int64) for word, ids in others.items()},
        )

    def matches(self, asked: Frame, kin: Mapping[str, frozenset[str]], *, elsewhere: bool = False) -> Matches:
        """Compare with what is asked. kin: {object word: stems of the kinds that it is of}.

        elsewhere: whether there are other uses that have the verb.
        """
        n = len(self.frames)
        total, of_verb = np.zeros(n, dtype=np.float32), np.zeros(n, dtype=np.float32)
        whole = 0.0
        for word in asked.verbs:
            best = self._matches(word, frozenset(), verb=True)
            np.maximum(of_verb, best, out=of_verb)
        if asked.verbs:
            weight = 0.3 if all(verb in LIGHT_VERBS for verb in asked.verbs) else 1.0
            whole += weight
            total += np.float32(weight) * of_verb
        circumstance = np.zeros(n, dtype=np.float32)
        for words, share in ((asked.objects, 1.0), (asked.around, 0.4)):
            for word in words:
                # Many objects are one object: "old clothes and books" asks for no more than "books".
                weight = share / len(words)
                whole += weight
                said = self._matches(word, kin.get(word, frozenset()), verb=False)
                total += np.float32(weight) * said
                if words is asked.around:
                    circumstance += said / np.float32(len(words))
        # Verbs that say little ("put") may be any other; so may those that no use has.
        telling = (elsewhere or bool(of_verb.any())) and not all(verb in LIGHT_VERBS for verb in asked.verbs)
        return Matches(
            total / np.float32(max(whole, 1e-6)),
            self._agreement(asked),
            (of_verb == 0.0) & telling,
            circumstance,
            self.qualified & (circumstance == 0.0),
        )

    def have_verb(self, asked: Frame) -> bool:
        """Whether any of the uses has the verb that is asked for, or one of like meaning."""
        return any(self._matches(word, frozenset(), verb=True).any() for word in asked.verbs)

    def _matches(self, word: str, kin: frozenset[str], *, verb: bool) -> Floats:
        best = np.zeros(len(self.frames), dtype=np.float32)
        for like in synonyms(word) | kin:
            value = 1.0 if like == word else KINDRED
            for index, factor in ((self.verbs, 1.0 if verb else 0.5), (self.others, 0.5 if verb else 1.0)):
                ids = index.get(like)
                if ids is not None:
                    best[ids] = np.maximum(best[ids], np.float32(value * factor))
        return best

    def _agreement(self, asked: Frame) -> Floats:
        """(u,) how well the part that the thing plays in each use goes with the one that is asked for."""
        by_gap = np.asarray([_AGREE.get(frozenset((asked.gap, gap)), 1.0) for gap in Gap], dtype=np.float32)
        agreement = by_gap[self.gaps]
        if CREATING & set(asked.verbs):
            # What one sews with is as well what one sews from.
            into = (Gap.MEANS, Gap.PLACE)
            if asked.gap in into:
                agreement = np.where(self.creating & np.isin(self.gaps, into), np.float32(1.0), agreement)
        return agreement
