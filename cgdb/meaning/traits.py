"""Properties that things have: how one says something of another, and what is usual for the things of the table."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from cgdb.meaning import everyday
from cgdb.meaning.words import stemmed

Floats = NDArray[np.float32]

YES, MOSTLY, MAYBE, UNKNOWN, KIN, NO = 0.95, 0.8, 0.42, 0.35, 0.1, 0.05
"""Degrees of a fact of the table: said outright, nearly so, may well be, not told, a sister kind, said otherwise."""

LONGEST_NAME = 4
"""Words in the longest name of a thing or trait."""

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


def names_of_traits() -> tuple[tuple[str, ...], dict[tuple[str, ...], int]]:
    """Names of the traits, and the words (singular) that say each."""
    names: list[str] = []
    by_name: dict[tuple[str, ...], int] = {}
    for line in everyday.lines(everyday.TRAITS):
        name, _, words = line.partition(":")
        for word in words.split(","):
            by_name.setdefault(stemmed(word), len(names))
        names.append(name)
    return tuple(names), by_name


def likeness(traits: tuple[str, ...]) -> tuple[Floats, NDArray[np.bool_]]:
    """(t, t): the degree to which a thing has the row's trait when it is said to have the column's; NaN: unrelated.

    And (t, t) bool: where the one only follows from the other.
    """
    follows = np.zeros((len(traits), len(traits)), dtype=bool)
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
            follows[traits.index(firm), traits.index(material)] = True
    for i in range(len(traits)):
        alike[i, i] = YES
    return alike, follows


def places(traits: tuple[str, ...], said: Sequence[Sequence[int]]) -> tuple[tuple[tuple[int, ...], ...], Floats]:
    """The scales of more than one step, as traits, and (s, m): the step on each that the table puts each thing on."""
    scales = tuple(tuple(traits.index(t) for t in scale) for scale in everyday.SCALES if len(scale) > 1)
    found = np.full((len(scales), len(said)), np.nan, dtype=np.float32)
    for row, scale in enumerate(scales):
        for i, own in enumerate(said):
            steps = [scale.index(t) for t in own if t in scale]
            if steps:
                found[row, i] = sum(steps) / len(steps)
    return scales, found


def usual(traits: tuple[str, ...], said: Sequence[Sequence[int]], alike: Floats) -> Floats:
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
