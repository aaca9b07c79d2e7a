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
from itertools import combinations
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from cgdb.meaning import everyday
from cgdb.meaning.lexicon import (
    ADJECTIVES,
    BRANDS,
    CLAUSE_STARTS,
    COMMON_WORDS,
    DETERMINERS,
    FUNCTION_WORDS,
    GENERIC_HEADS,
    HEAPS,
    IRREGULAR,
    NOUNS_TOO,
    PACKAGES,
    PARTITIVES,
    PLACE_HEADS,
)
from cgdb.meaning.uses import Frame, Matches, Uses, frame, noun_runs, synonyms
from cgdb.meaning.words import parse, singular, stem, tokens

Floats = NDArray[np.float32]

YES, MOSTLY, MAYBE, UNKNOWN, KIN, NO = 0.95, 0.8, 0.42, 0.35, 0.15, 0.05
"""Degrees of a fact of the table: said outright, nearly so, may well be, not told, a sister kind, said otherwise."""

Form = Literal["kind", "name", "use", "traits"]

LONGEST_NAME = 4
"""Words in the longest name of a thing or trait."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Facets:
    """What a text asks.

    form: what it is mostly about: a "kind" of thing that the table has, a "name" that it lacks ("IKEA"), a "use", or
    nothing but "traits". kinds: things (indices) of which it must be one kind, traits it must have, what is left over.

    rest: the text that neither names a kind nor a trait and has to be matched by meaning; None where nothing is left.
    doing: the rest read as a use.
    arguments: things that the use is done to ("take a laptop apart"): mentioned, and not what is looked for.
    named: the words (singular) by which the kinds are named; what is left of the text are its particulars.
    """

    form: Form
    kinds: tuple[int, ...] = ()
    traits: tuple[int, ...] = ()
    rest: str | None = None
    doing: Frame | None = None
    arguments: tuple[int, ...] = ()
    named: frozenset[str] = frozenset()


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Knowledge:
    """The table of everyday things, compiled.

    names: (m,) first names; the first n_lines are the lines of the table, their kinds follow. is_a: (m, m) bool,
    is_a[i, j] = thing i is a thing j (itself included); parents: (m, m) bool, its direct kinds.
    traits: names of the traits. has: (m, t) float32, the degree to which thing i has trait j.
    uses: distinct phrases; use_of: (u, 2) int32 pairs (use, thing), inherited ones included, sorted by thing.
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
    uses: tuple[str, ...]
    use_of: NDArray[np.int32]
    doing: Uses
    consumables: NDArray[np.bool_]
    vocabulary: frozenset[str]
    nouns: frozenset[str]
    thing_by_name: Mapping[tuple[str, ...], tuple[int, ...]]
    trait_by_name: Mapping[tuple[str, ...], int]
    version: str

    def texts(self) -> tuple[str, ...]:
        """The phrases that want a vector: names of things, then uses."""
        return (*self.names, *self.uses)

    def things_named(self, phrase: str) -> tuple[int, ...]:
        """The things whose name the phrase ends with, by the longest such name ("white coffee table": coffee table)."""
        stems = _stems(phrase)
        # "A pile of clothes" and "clothes pile", "chair" and "chair 12" are called the same.
        while len(stems) > 1 and (stems[-1].isdigit() or (stems[-1] in HEAPS and self._name_start(stems) < 0)):
            stems = stems[:-1]
        start = self._name_start(stems)
        return self.thing_by_name[stems[start:]] if start >= 0 else ()

    def contents_named(self, phrase: str) -> tuple[int, ...]:
        """The things that a package is named by ("juice carton"): who looks for juice looks for that."""
        stems = _stems(phrase)
        if len(stems) < 2 or stems[-1] not in PACKAGES:
            return ()
        return tuple(i for i in self.things_named(" ".join(stems[:-1])) if self.consumables[i])

    def readable(self, name: str) -> str:
        """A name of a map in plain words: "CoffeeTable_12" is "coffee table 12", "bathroomcabinet" two words."""
        return " ".join(self._parted(word) for word in name.replace("_", " ").split())

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
        stems = _stems(phrase)
        # The noun itself is no trait: a "glass" is not "of glass" by its name, an orange is orange by nature; nor is
        # "light" in the name "light switch".
        end = len(stems) - 1 if len(stems) > 1 else 1
        mask = 0
        for trait in self.traits_in(stems[: max(self._name_start(stems), 0)])[0]:
            mask |= 1 << trait
        for trait in self.traits_in(stems[:end])[0]:
            if self.traits[trait] != "light":
                mask |= 1 << trait
        return mask

    def _name_start(self, stems: tuple[str, ...]) -> int:
        """Where the longest name of a thing that ends the stems begins; -1 where none does."""
        for start in range(max(0, len(stems) - LONGEST_NAME), len(stems)):
            if stems[start:] in self.thing_by_name:
                return start
        return -1

    def facets(self, text: str) -> Facets:
        """Split a question into kind, traits and the rest."""
        parsed = parse(text)
        words = [t for t in tokens(text) if t[0].isalnum()]
        if parsed.generic or not parsed.heads:
            return self._of_generic(words)
        kinds: list[int] = []
        traits: list[int] = []
        names: set[str] = set()
        for phrase in parsed.heads:
            stems = _stems(phrase)
            named = self.things_named(phrase)
            if named and not BRANDS.intersection(stems):
                kinds.extend(named)
                names.update(stems[self._name_start(stems) :])
                traits.extend(self.traits_in(stems[: self._name_start(stems)])[0])
            else:
                said, left = self.traits_in([s for s in stems if s not in FUNCTION_WORDS])
                if not left:
                    traits.extend(said)
        traits.extend(self._said_after(words))
        if kinds or traits:
            form: Form = "kind" if kinds else "traits"
            return Facets(
                form=form,
                kinds=tuple(dict.fromkeys(kinds)),
                traits=tuple(dict.fromkeys(traits)),
                named=frozenset(names),
            )
        if words and words[0] in ("to", "for") and len(words) > 1:
            return self._of_generic(words)
        verb = bool(words) and stem(words[0]) in self.doing.verbs
        if verb:
            return self._of_generic(words)
        return Facets(form="name", rest=text)

    def _said_after(self, words: Sequence[str]) -> list[int]:
        """The traits said behind the noun: "shoes made of leather", "a lamp in red", "a chair that is soft"."""
        found: list[int] = []
        for at, word in enumerate(words[:-1]):
            opens = (word in ("of", "from") and at > 0 and words[at - 1] in ("made", "out")) or (
                word in ("is", "are") and at > 0 and words[at - 1] in ("that", "which")
            )
            colour = word == "in" and at > 0
            if not (opens or colour):
                continue
            stems = _stems(" ".join(words[at + 1 : at + 4]))
            said, _ = self.traits_in(stems[:1] if colour or len(stems) == 1 else stems[:2])
            found.extend(t for t in said if opens or self.traits[t] in everyday.COLORS)
        return found

    def describe(self, facets: Facets) -> dict[str, object]:
        """The facets for a person: {"kind": [...], "traits": [...], "use": text}, without the empty ones."""
        found: dict[str, object] = {
            "kind": [self.names[i] for i in facets.kinds],
            "traits": [self.traits[i] for i in facets.traits],
            "use": facets.rest,
        }
        return {name: value for name, value in found.items() if value}

    def _of_generic(self, words: Sequence[str]) -> Facets:
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
                trait = self.trait_by_name.get(tuple(singular(w) for w in words[at : at + length]))
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
        if doing is not None and rest[0] not in CLAUSE_STARTS and not any(map(self._is_verb, doing.verbs)):
            doing = None
        return Facets(
            form="use" if informative or not traits else "traits",
            traits=tuple(dict.fromkeys(traits)),
            rest=text if informative else None,
            doing=doing,
            arguments=self._arguments(rest, doing),
        )

    def _is_verb(self, word: str) -> bool:
        return word in self.doing.verbs or synonyms(word) != {word}

    def _arguments(self, words: Sequence[str], doing: Frame | None) -> tuple[int, ...]:
        """Things that something is done to ("cut paper"), or that are named as countable ("a laptop", "books")."""
        found: list[int] = []
        for run in noun_runs(doing.object_words if doing is not None else ()):
            for start, end in combinations(range(len(run) + 1), 2):
                # "To add light" asks for lights; "gold" and "silver" are no things either.
                if run[end - 1] not in NOUNS_TOO:
                    found.extend(self.thing_by_name.get(run[start:end], ()))
        for end in range(1, len(words) + 1):
            stems = tuple(singular(w) for w in words[max(0, end - LONGEST_NAME) : end])
            start = self._name_start(stems)
            if start < 0:
                continue
            at = end - (len(stems) - start)
            before = words[max(0, at - 3) : at]
            plural = words[end - 1].endswith("s") and singular(words[end - 1]) != words[end - 1]
            if not {"as", "like"} & set(before) and (plural or any(w in DETERMINERS for w in before)):
                found.extend(self.thing_by_name[stems[start:]])
        if {"as", "like"} & set(words):
            return ()
        return tuple(dict.fromkeys(found))

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
        kin: dict[str, frozenset[str]] = {}
        for run in noun_runs(asked.object_words):
            start = self._name_start(run)
            if start >= 0:
                kinds = np.flatnonzero(self.is_a[list(self.thing_by_name[run[start:]])].any(axis=0))
                kin[stem(run[-1])] = frozenset(stem(self.names[i].split()[-1]) for i in kinds.tolist())
        return self.doing.matches(asked, kin)

    def best_use(self, values: Floats) -> Floats:
        """(m,) the largest of the values (u,) of each thing's uses; -inf for a thing without uses."""
        best = np.full(len(self.names), -np.inf, dtype=np.float32)
        np.maximum.at(best, self.use_of[:, 1], values[self.use_of[:, 0]])
        return best

    def trait_degrees(self, trait: int, masks: NDArray[np.uint64], which: NDArray[np.int64], usual: Floats) -> Floats:
        """(n,) degree of rows to have a trait, by what the map states of them and what is usual for their things.

        masks[which]: (n,) the stated traits; there are few different ones. usual: (n,) NaN where nothing is known. What
        is stated on the same scale decides.
        """
        best = np.full(len(masks), np.nan, dtype=np.float32)
        for other in np.flatnonzero(np.isfinite(self.alike[trait])).tolist():
            says = masks & np.uint64(1 << other) != 0
            best = np.where(says, np.fmax(best, self.alike[trait, other]), best)
        stated = best[which]
        return np.where(np.isfinite(stated), stated, usual)


_DAMPED = {
    ("light", "fixed"): 0.4, ("light", "large"): 0.7, ("light", "huge"): 0.5, ("light", "medium"): 0.95,
    ("heavy", "small"): 0.7, ("heavy", "medium"): 0.9, ("heavy", "large"): 0.97,
    ("small", "heavy"): 0.8, ("small", "middling"): 0.95, ("small", "fixed"): 0.95,
    ("large", "light"): 0.85, ("soft", "electric"): 0.5,
}  # fmt: skip
"""Traits weigh on each other: a window blind weighs little, but nobody asks for it as "something light"."""
_IMPLIED = {
    "stone": "rigid -soft heavy -light -transparent",
    "ceramic": "rigid -soft -transparent",
    "metal": "rigid -soft -transparent",
    "wood": "rigid -soft -transparent",
    "glass": "rigid -soft transparent fragile",
    "fabric": "soft -rigid -transparent",
    "small": "-heavy",
    "tiny": "-heavy light",
}
"""What a stated trait says of others ("a ceramic bird" is not soft); a minus says that it is not so."""
_SHADES = frozenset(("light", "dark", "pale", "deep", "bright"))
_HUMP = re.compile(r"[A-Z]+(?![a-z])|[A-Z]?[a-z]+|\d+")
_FILLERS = frozenset(
    ("very", "really", "quite", "so", "too", "extremely", "rather", "fairly", "that", "is", "are", "which", "and")
)


def _stems(phrase: str) -> tuple[str, ...]:
    return tuple(singular(t.removesuffix("'s")) for t in tokens(phrase) if t[0].isalnum() and t not in DETERMINERS)


@lru_cache(maxsize=1)
def knowledge() -> Knowledge:
    """The compiled table; made at the first call (a few milliseconds) and shared."""
    traits, trait_by_name = _traits()
    lines = [[part.strip() for part in line.split("|")] for line in _lines(everyday.TABLE)]
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
    uses_of: list[dict[str, None]] = [{} for _ in range(m)]
    group = {t: scale for scale in everyday.SCALES for t in scale}
    for i in order:
        own = [t for t in lines[i][2].split() if t]
        taken = {group[t] for t in own if t in group}
        for use in lines[i][3].split(","):
            if use.strip():
                uses_of[i].setdefault(use.strip())
        for parent in parents[i]:
            direct[i, parent] = True
            is_a[i] |= is_a[parent]
            uses_of[i].update(uses_of[parent])
            for trait in said[parent]:
                scale = group.get(traits[trait])
                if scale is None or scale not in taken:
                    own.append(traits[trait])
            taken |= {group[traits[t]] for t in said[parent] if traits[t] in group}
        said[i] = [traits.index(t) for t in dict.fromkeys(own)]
    alike = _alike(traits)
    uses = tuple(dict.fromkeys(use for found in uses_of for use in found))
    number = {use: i for i, use in enumerate(uses)}
    thing_by_name: dict[tuple[str, ...], tuple[int, ...]] = {}
    for i, names in enumerate(all_names):
        for name in names:
            key = _stems(name)
            if i not in thing_by_name.get(key, ()):
                thing_by_name[key] = (*thing_by_name.get(key, ()), i)
    words = frozenset(word for key in thing_by_name for word in key if len(word) > 2)
    return Knowledge(
        names=tuple(names[0] for names in all_names),
        n_lines=n_lines,
        is_a=is_a,
        parents=direct,
        traits=traits,
        has=_has(traits, said, alike),
        alike=alike,
        uses=uses,
        doing=Uses.of(uses),
        consumables=np.asarray(is_a[:, [first[name] for name in everyday.CONSUMABLES]].any(axis=1)),
        vocabulary=words | ADJECTIVES | COMMON_WORDS | {word for key in trait_by_name for word in key},
        nouns=frozenset(key[-1] for key in thing_by_name if len(key[-1]) > 2),
        use_of=np.asarray([(number[u], i) for i in range(m) for u in uses_of[i]], dtype=np.int32).reshape(-1, 2),
        thing_by_name=thing_by_name,
        trait_by_name=trait_by_name,
        version=_version(),
    )


def _version() -> str:
    """Of what the table says, however its lines are wrapped."""
    lines = [*_lines(everyday.TABLE), *_lines(everyday.TRAITS)]
    return hashlib.sha256("\n".join(" ".join(line.split()) for line in lines).encode()).hexdigest()[:16]


def _names(text: str) -> list[str]:
    return [name.strip() for name in text.split(",") if name.strip()]


def _lines(table: str) -> list[str]:
    return table.replace("\n    ", " ").splitlines()


def _traits() -> tuple[tuple[str, ...], dict[tuple[str, ...], int]]:
    names: list[str] = []
    by_name: dict[tuple[str, ...], int] = {}
    for line in _lines(everyday.TRAITS):
        name, _, words = line.partition(":")
        for word in words.split(","):
            by_name.setdefault(_stems(word), len(names))
        names.append(name)
    return tuple(names), by_name


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


def _alike(traits: tuple[str, ...]) -> Floats:
    """(t, t): the degree to which a thing has the row's trait when it is said to have the column's; NaN: unrelated."""
    alike = np.full((len(traits), len(traits)), np.nan, dtype=np.float32)
    for scale in everyday.SCALES:
        places = [traits.index(t) for t in scale]
        for a, asked in enumerate(places):
            for b, said in enumerate(places):
                # Beyond is included at the ends: what is huge is large, what is tiny is small.
                beyond = len(scale) > 3 and ((a > 2 and b > a) or (a < 2 and b < a))
                alike[asked, said] = YES if a == b else MOSTLY if beyond else UNKNOWN if abs(a - b) == 1 else NO
    for family in (everyday.COLORS, everyday.MATERIALS):
        for one in family:
            for other in family:
                alike[traits.index(one), traits.index(other)] = YES if one == other else NO
    for material, implied in _IMPLIED.items():
        for trait in implied.split():
            firm, sure = trait.removeprefix("-"), NO if trait.startswith("-") else YES
            alike[traits.index(firm), traits.index(material)] = sure
    for i in range(len(traits)):
        alike[i, i] = YES
    return alike


def _has(traits: tuple[str, ...], said: Sequence[Sequence[int]], alike: Floats) -> Floats:
    """(m, t): the degree to which each thing usually has each trait; NaN where the table cannot know (colours)."""
    own = np.zeros((len(said), len(traits)), dtype=bool)
    for i, found in enumerate(said):
        own[i, found] = True
    has = np.where(own, YES, NO).astype(np.float32)
    for scale in everyday.SCALES:
        places = [traits.index(t) for t in scale]
        if len(places) > 1:
            told = own[:, places].any(axis=1)
            for t in places:
                near = np.where(own[:, places], alike[t, places], -np.inf).max(axis=1)
                has[:, t] = np.where(own[:, t], YES, np.where(told, near, np.nan))
    for t in (traits.index(color) for color in everyday.COLORS):
        has[:, t] = np.where(own[:, t], MOSTLY, np.nan)
    for (asked, said_too), factor in _DAMPED.items():
        has[own[:, traits.index(said_too)], traits.index(asked)] *= factor
    return has
