"""What a question asks of a thing, and what is known of everyday things: kinds, traits and uses.

A question is split into facets ("a soft red chair to read in": kind chair, traits soft and red, use "read in"); a
thing of the table answers each. What the map itself says of an object ("a red chair") comes before what is usual.
"""

from __future__ import annotations

import hashlib
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from cgdb.meaning import everyday, situations
from cgdb.meaning.facets import Facets, facets
from cgdb.meaning.lexicon import (
    ADJECTIVES,
    COMMON_WORDS,
    HEAPS,
    IRREGULAR,
    PACKAGES,
    PARTITIVES,
    PREPOSITIONS,
)
from cgdb.meaning.traits import KIN, LONGEST_NAME, MAYBE, NO, UNKNOWN, YES, likeness, names_of_traits, places, usual
from cgdb.meaning.uses import Frame, Matches, Uses, noun_runs
from cgdb.meaning.words import singular, stem, stemmed

Floats = NDArray[np.float32]

LATER = 0.2
"""Deviations that what is named later in a line of situations is further off, for each place."""

KIND_OF = 0.3
"""Deviations that a kind of what helps is further off, where it has a line of its own in the table."""

_SHADES = frozenset(("light", "dark", "pale", "deep", "bright"))


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Knowledge:
    """The table of everyday things, compiled.

    names: (m,) first names; the first n_lines are the lines of the table, their kinds follow. is_a: (m, m) bool,
    is_a[i, j] = thing i is a thing j (itself included); parents: (m, m) bool, its direct kinds.
    traits: names of the traits. has: (m, t) float32, the degree to which thing i has trait j. alike: (t, t), the degree
    to which what is said to have trait j has trait i; follows: (t, t) bool, where one only follows from another.
    scales: the traits that lie on a scale, in order; places: (s, m) float32 where on each a thing is, NaN untold.
    uses: distinct phrases; use_of: (u, 3) int32 (use, thing, lines that it was inherited over), sorted by thing.
    situations: what people tell of when they need something; helps: (w, 2) int32 (situation, thing that helps in it);
    further: (w,) float32 how much further off it is than what helps best.
    doing: the uses read as frames. consumables: (m,) what is bought in packages. vocabulary, nouns: the words that
    names are made of, and those that they end with.
    """

    names: tuple[str, ...]
    n_lines: int
    is_a: NDArray[np.bool_]
    parents: NDArray[np.bool_]
    traits: tuple[str, ...]
    has: Floats
    alike: Floats
    follows: NDArray[np.bool_]
    scales: tuple[tuple[int, ...], ...]
    places: Floats
    uses: tuple[str, ...]
    use_of: NDArray[np.int32]
    situations: tuple[str, ...]
    helps: NDArray[np.int32]
    further: Floats
    doing: Uses
    consumables: NDArray[np.bool_]
    vocabulary: frozenset[str]
    nouns: frozenset[str]
    thing_by_name: Mapping[tuple[str, ...], tuple[int, ...]]
    trait_by_name: Mapping[tuple[str, ...], int]
    version: str

    def texts(self) -> tuple[str, ...]:
        """The phrases that want a vector: names of things, then uses, then situations."""
        return (*self.names, *self.uses, *self.situations)

    def things_named(self, phrase: str) -> tuple[int, ...]:
        """The things whose name the phrase ends with, by the longest such name ("white coffee table": coffee table)."""
        stems = stemmed(phrase)
        # "A pile of clothes" and "clothes pile", "chair" and "chair 12" are called the same.
        while len(stems) > 1 and (stems[-1].isdigit() or (stems[-1] in HEAPS and self.name_start(stems) < 0)):
            stems = stems[:-1]
        start = self.name_start(stems)
        return self.thing_by_name[stems[start:]] if start >= 0 else ()

    def contents_named(self, phrase: str) -> tuple[int, ...]:
        """The things that a package is named by ("juice carton"): who looks for juice looks for that."""
        stems = stemmed(phrase)
        if len(stems) < 2 or stems[-1] not in PACKAGES:
            return ()
        return tuple(i for i in self.things_named(" ".join(stems[:-1])) if self.consumables[i])

    def readable(self, name: str) -> str:
        """A name of a map in plain words: "CoffeeTable_12" is "coffee table 12", "bathroomcabinet" two words.

        "Wall-plug" is two words, too, and a gloss ends no name: "crab (animal)" is an animal crab, "iron (for
        clothing)" an iron.
        """
        plain = name.replace("_", " ")
        if gloss := _GLOSS.fullmatch(plain):
            plain = gloss["name"]
            if gloss["gloss"].split()[0].casefold() not in PREPOSITIONS:
                behind = f"{gloss['name']} {gloss['gloss']}"
                plain = behind if stemmed(behind) in self.thing_by_name else f"{gloss['gloss']} {gloss['name']}"
        return " ".join(self._unhyphened(self._parted(word)) for word in plain.split())

    def _unhyphened(self, word: str) -> str:
        """The words of "tv-stand"; a word that is one thing ("t-shirt"), or partly none, stays as it is."""
        parts = word.split("-")
        if len(parts) == 1 or stemmed(word) in self.thing_by_name:
            return word
        known = all(part.isdigit() or part in PREPOSITIONS or self._is_word(part.casefold()) for part in parts)
        ends = singular(parts[-1].casefold()) in self.nouns and all(len(part) > 2 and part.isalpha() for part in parts)
        return " ".join(parts) if known or ends else word

    def _parted(self, word: str) -> str:
        """A word that is none as the words that it is made of, the fewest, the last of them a noun of the table."""
        folded = word.casefold()
        if len(word) < 5 or not word.isascii() or not word.isalnum() or self._is_word(folded):
            return word
        humps = _HUMP.findall(word)
        if len(humps) > 1 and all(hump.isdigit() or self._is_word(hump.casefold()) for hump in humps):
            return " ".join(humps)
        if len(word) < 6 or not word.isalpha():
            return word
        best: tuple[int, str] | None = None
        for end in range(2, len(folded) - 2):
            first, last = folded[:end], folded[end:]
            if end < 3 and first not in IRREGULAR:
                continue
            if not (singular(last) in self.nouns or last in PARTITIVES or singular(last) in HEAPS):
                continue
            middle = next(
                (at for at in range(3, end - 2) if self._is_word(first[:at]) and self._is_word(first[at:])), 0
            )
            if self._is_word(first):
                cost = 1
            elif middle:
                first, cost = f"{first[:middle]} {first[middle:]}", 2
            elif len(first) >= 4 and len(last) >= 4:
                cost = 3
            else:
                continue
            if best is None or cost < best[0]:
                best = (cost, f"{first} {last}")
        return word if best is None else best[1]

    def _is_word(self, word: str) -> bool:
        return word in self.vocabulary or singular(word) in self.vocabulary or stem(word) in self.doing.verbs

    def traits_in(self, stems: Sequence[str]) -> tuple[list[int], list[str]]:
        """The traits that a run of stems says, longest names first, and the stems that say none."""
        traits: list[int] = []
        left: list[str] = []
        at = 0
        while at < len(stems):
            for length in range(min(LONGEST_NAME, len(stems) - at), 0, -1):
                trait = self.trait_by_name.get(tuple(stems[at : at + length]))
                if trait is not None and not (length == 1 and self._is_shade(stems, at)):
                    traits.append(trait)
                    at += length
                    break
            else:
                if not self._is_shade(stems, at):
                    left.append(stems[at])
                at += 1
        return traits, left

    def _is_shade(self, stems: Sequence[str], at: int) -> bool:
        """Whether the word only shades the colour after it: "light brown" weighs nothing."""
        if stems[at] not in _SHADES or at + 1 >= len(stems):
            return False
        trait = self.trait_by_name.get((stems[at + 1],))
        return stems[at + 1] == "color" or (trait is not None and self.traits[trait] in everyday.COLORS)

    def stated(self, phrase: str) -> int:
        """The traits that a head phrase says of its object ("red wooden chair"), as a bit mask."""
        stems = stemmed(phrase)
        # The noun itself is no trait: a "glass" is not "of glass" by its name, an orange is orange by nature; nor is
        # "light" in the name "light switch".
        end = len(stems) - 1 if len(stems) > 1 else 1
        mask = 0
        for trait in self.traits_in(stems[: max(self.name_start(stems), 0)])[0]:
            mask |= 1 << trait
        for trait in self.traits_in(stems[:end])[0]:
            if self.traits[trait] != "light":
                mask |= 1 << trait
        return mask

    def name_start(self, stems: tuple[str, ...]) -> int:
        """Where the longest name of a thing that ends the stems begins; -1 where none does."""
        for start in range(max(0, len(stems) - LONGEST_NAME), len(stems)):
            if stems[start:] in self.thing_by_name:
                return start
        return -1

    def facets(self, text: str) -> Facets:
        """Split a question into kind, traits and the rest."""
        return facets(self, text)

    def describe(self, facets: Facets) -> dict[str, object]:
        """The facets for a person: {"kind": [...], "traits": [...], "use": text}, without the empty ones."""
        found: dict[str, object] = {
            "kind": [self.names[i] for i in facets.kinds],
            "traits": [self.traits[i] for i in facets.traits],
            "use": facets.rest,
        }
        return {name: value for name, value in found.items() if value}

    def kind_degrees(self, kinds: Sequence[int]) -> Floats:
        """(m,) degree of each thing to be of one of the kinds: sharp, because that is what "other than" is about."""
        columns = list(kinds)
        below = self.is_a[:, columns].any(axis=1)
        # What is only called "furniture" may be a chair.
        above = self.is_a[columns, :].any(axis=0)
        parents = self.parents[columns].any(axis=0)
        kin = self.parents[:, parents].any(axis=1)
        degree = np.where(above, np.where(parents, MAYBE, UNKNOWN), np.where(kin, KIN, NO))
        return np.where(below, YES, degree).astype(np.float32)

    def use_matches(self, asked: Frame) -> Matches:
        """How each use (u) goes with what is asked, by their words."""
        return self.doing.matches(asked, self.kin(asked))

    def kin(self, asked: Frame) -> dict[str, frozenset[str]]:
        """The words for the kinds that the objects of a use are of ("food" for "egg"), as stems."""
        kin: dict[str, frozenset[str]] = {}
        for run in noun_runs(asked.object_words):
            start = self.name_start(run)
            if start >= 0:
                kinds = np.flatnonzero(self.is_a[list(self.thing_by_name[run[start:]])].any(axis=0))
                kin[stem(run[-1])] = frozenset(stem(self.names[i].split()[-1]) for i in kinds.tolist())
        return kin

    def best_use(self, values: Floats, inherited: float = 0.0) -> Floats:
        """(m,) the largest of the values (u,) of each thing's uses; -inf for a thing without uses.

        inherited: what a value loses with each line that the use comes down: clothes are sewn from cloth, a shirt is
        cloth, and yet nothing is sewn from it.
        """
        best = np.full(len(self.names), -np.inf, dtype=np.float32)
        use, thing, distance = self.use_of.T
        np.maximum.at(best, thing, values[use] - np.float32(inherited) * distance.astype(np.float32))
        return best

    def best_situation(self, values: Floats) -> Floats:
        """(m,) the largest of the values (s,) of the situations that each thing helps in; -inf where there is none."""
        best = np.full(len(self.names), -np.inf, dtype=np.float32)
        situation, thing = self.helps.T
        np.maximum.at(best, thing, values[situation] - self.further)
        return best


_HUMP = re.compile(r"[A-Z]+(?![a-z])|[A-Z]?[a-z]+|\d+")
_GLOSS = re.compile(r"(?P<name>[^()]*\w[^()]*?)\s*\((?P<gloss>[^()]*[A-Za-z][^()]*)\)\s*")


@lru_cache(maxsize=1)
def knowledge() -> Knowledge:
    """The compiled table; made at the first call (a few milliseconds) and shared."""
    traits, trait_by_name = names_of_traits()
    lines = [[part.strip() for part in line.split("|")] for line in everyday.lines(everyday.TABLE)]
    groups = [[_names(group) for group in line[0].split(";")] for line in lines]
    # The things of the lines come first, then their kinds: the lines are the background.
    all_names = [own[0] for own in groups] + [names for own in groups for names in own[1:]]
    first = {name: i for i, names in reversed(list(enumerate(all_names))) for name in reversed(names)}
    parents = [[first[kind] for kind in _names(line[1])] for line in lines]
    parents += [[i] for i, own in enumerate(groups) for _ in own[1:]]
    lines += [["", "", "", ""] for own in groups for _ in own[1:]]
    n_lines, m = len(groups), len(all_names)
    order = _parents_first(parents)
    is_a = np.eye(m, dtype=bool)
    direct = np.zeros((m, m), dtype=bool)
    said: list[list[int]] = [[] for _ in range(m)]
    uses_of: list[dict[str, int]] = [{} for _ in range(m)]
    group = {t: scale for scale in everyday.SCALES for t in scale}
    for i in order:
        own = [t for t in lines[i][2].split() if t]
        taken = {group[t] for t in own if t in group}
        for use in lines[i][3].split(","):
            if use.strip():
                uses_of[i][use.strip()] = 0
        for parent in parents[i]:
            direct[i, parent] = True
            is_a[i] |= is_a[parent]
            # A line's own kinds stand for it; what comes down from another line comes from further off.
            further = int(i < n_lines)
            for use, distance in uses_of[parent].items():
                uses_of[i][use] = min(uses_of[i].get(use, distance + further), distance + further)
            for trait in said[parent]:
                scale = group.get(traits[trait])
                if scale is None or scale not in taken:
                    own.append(traits[trait])
            taken |= {group[traits[t]] for t in said[parent] if traits[t] in group}
        said[i] = [traits.index(t) for t in dict.fromkeys(own)]
    alike, follows = likeness(traits)
    scales, where = places(traits, said)
    uses = tuple(dict.fromkeys(use for found in uses_of for use in found))
    number = {use: i for i, use in enumerate(uses)}
    own_uses = [(number[use], i, distance) for i in range(m) for use, distance in uses_of[i].items()]
    thing_by_name: dict[tuple[str, ...], tuple[int, ...]] = {}
    for i, names in enumerate(all_names):
        for name in names:
            key = stemmed(name)
            if i not in thing_by_name.get(key, ()):
                thing_by_name[key] = (*thing_by_name.get(key, ()), i)
    words = frozenset(word for key in thing_by_name for word in key if len(word) > 2)
    told, helps = _situations(thing_by_name, is_a, n_lines)
    return Knowledge(
        names=tuple(names[0] for names in all_names),
        n_lines=n_lines,
        is_a=is_a,
        parents=direct,
        traits=traits,
        has=usual(traits, said, alike),
        alike=alike,
        follows=follows,
        scales=scales,
        places=where,
        uses=uses,
        doing=Uses.of(uses),
        consumables=np.asarray(is_a[:, [first[name] for name in everyday.CONSUMABLES]].any(axis=1)),
        vocabulary=words | ADJECTIVES | COMMON_WORDS | {word for key in trait_by_name for word in key},
        nouns=frozenset(key[-1] for key in thing_by_name if len(key[-1]) > 2),
        use_of=np.asarray(own_uses, dtype=np.int32).reshape(-1, 3),
        situations=told,
        helps=np.asarray(list(helps), dtype=np.int32).reshape(-1, 2),
        further=np.asarray(list(helps.values()), dtype=np.float32),
        thing_by_name=thing_by_name,
        trait_by_name=trait_by_name,
        version=_version(),
    )


def _situations(
    things: Mapping[tuple[str, ...], tuple[int, ...]], is_a: NDArray[np.bool_], n_lines: int
) -> tuple[tuple[str, ...], dict[tuple[int, int], float]]:
    """The situations, and {(situation, thing that helps): how much further off it is than what helps best}.

    What is named first in a line helps best; what is only a kind of it, and has a line of its own, helps less.
    """
    told: dict[str, int] = {}
    helps: dict[tuple[int, int], float] = {}
    for line in everyday.lines(situations.TABLE):
        said, names = line.split("|")
        numbers = [told.setdefault(one.strip(), len(told)) for one in said.split(";")]
        for place, name in enumerate(names.split(",")):
            for thing in things[stemmed(name)]:
                for kind in np.flatnonzero(is_a[:, thing]).tolist():
                    off = LATER * place + KIND_OF * (kind != thing and kind < n_lines)
                    for number in numbers:
                        helps[number, kind] = min(off, helps.get((number, kind), off))
    return tuple(told), helps


def _version() -> str:
    """Of what the tables say, however their lines are wrapped."""
    tables = (everyday.TABLE, everyday.TRAITS, situations.TABLE)
    lines = [line for table in tables for line in everyday.lines(table)]
    return hashlib.sha256("\n".join(" ".join(line.split()) for line in lines).encode()).hexdigest()[:16]


def _names(text: str) -> list[str]:
    return [name.strip() for name in text.split(",") if name.strip()]


def _parents_first(parents: Sequence[Sequence[int]]) -> list[int]:
    done: dict[int, None] = {}

    def visit(i: int) -> None:
        for parent in parents[i]:
            if parent not in done:
                visit(parent)
        done.setdefault(i)

    for i in range(len(parents)):
        visit(i)
    return list(done)
