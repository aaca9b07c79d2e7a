"""To what degree things have a trait: by what their texts state, their map tells, a model noted, and what is usual."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from cgdb.meaning import everyday
from cgdb.meaning.contrast import log_odds, probability
from cgdb.meaning.knowledge import Knowledge, knowledge
from cgdb.meaning.told import FLEXIBLE
from cgdb.meaning.traits import NO

Floats = NDArray[np.float32]
Masks = NDArray[np.uint64]
Rows = NDArray[np.int64]

STATED = 0.75
"""Share of what is stated in a degree that what is usual has a say in."""
NOTED = 0.85
"""Share of what a model noted beside what is usual for such things."""

_BENDING: Mapping[str, float] = {"soft": 0.65, "firm": 0.65, "rigid": NO}
"""What bends and springs back is not rigid, and need not be soft: a belt."""
_HELD: Mapping[tuple[str, str], float] = {
    ("light", "fixed"): NO, ("portable", "fixed"): NO, ("fixed", "light"): NO, ("fixed", "middling"): NO,
    ("fixed", "portable"): NO,
}  # fmt: skip
"""What is told of weight is told of moving: who asks for "something light" wants to lift it."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Stated:
    """Traits of n rows as bits, of which there are few different sets: texts[which], told[which], noted[which].

    texts: by names and captions; told: by properties of the map; noted: by properties that a model added. plain:
    whether there are no properties that tell.
    """

    texts: Masks
    told: Masks
    noted: Masks
    which: Rows
    plain: bool

    @classmethod
    def of(cls, texts: Masks, told: Masks, noted: Masks) -> Stated:
        """(n,) each."""
        if not told.any() and not noted.any():
            sets, which = np.unique(texts, return_inverse=True)
            none = np.zeros(len(sets), dtype=np.uint64)
            return cls(texts=sets, told=none, noted=none, which=which, plain=True)
        sets, which = np.unique(np.stack([texts, told, noted], axis=1), axis=0, return_inverse=True)
        return cls(texts=sets[:, 0], told=sets[:, 1], noted=sets[:, 2], which=which.reshape(-1), plain=False)

    def only(self, rows: Rows) -> Stated:
        """Of some rows."""
        return Stated(texts=self.texts, told=self.told, noted=self.noted, which=self.which[rows], plain=self.plain)


def trait_degrees(known: Knowledge, trait: int, stated: Stated, usual: Floats) -> Floats:
    """(n,) degree of rows to have a trait. usual: (n,) what is usual for such things, NaN where nothing is known.

    What is stated of the trait itself decides; what is relative to the thing (a heavy book weighs less than a bed) or
    only follows from what is stated (glass breaks) leans on what is usual. Properties tell of weight and firmness in
    themselves: there they stand above the texts, beside them elsewhere (a thing may be of wood and metal). What a model
    noted of a thing moves what is usual for its kind.
    """
    relative = any(trait in scale for scale in known.scales if known.traits[scale[0]] in everyday.RELATIVE)
    follows = np.ones(len(known.traits), dtype=bool) if relative else known.follows[trait]
    firm, leaning = _said(stated.texts, known.alike[trait], follows)
    if not stated.plain:
        alike = _alike()[trait]
        follows = np.append(known.follows[trait], np.zeros(len(alike) - len(known.traits), dtype=bool))
        told, told_leaning = _said(stated.told, alike, follows)
        above = any(trait in scale for scale in known.scales)
        firm = np.where(np.isfinite(told), told, firm) if above else np.fmax(firm, told)
        leaning = np.fmax(leaning, told_leaning)
        noted, noted_leaning = _said(stated.noted, alike, follows)
        share = np.where(np.isfinite(noted), np.float32(NOTED), np.float32(NOTED * STATED))
        noted = np.where(np.isfinite(noted), noted, noted_leaning)[stated.which]
        unheard_of = np.isfinite(noted) & ~np.isfinite(usual)
        usual = _pooled(share[stated.which], noted, np.where(unheard_of, np.float32(0.5), usual))
    told, follow = firm[stated.which], leaning[stated.which]
    return np.where(np.isfinite(told), told, _pooled(np.float32(STATED), follow, usual))


def telling(known: Knowledge, traits: tuple[int, ...]) -> int:
    """The traits, as bits, that say something of any of these when a property tells them."""
    bits = np.flatnonzero(np.isfinite(_alike()[list(traits)]).any(axis=0)) if traits else ()
    return sum(1 << int(bit) for bit in bits)


def _said(masks: Masks, alike: Floats, follows: NDArray[np.bool_]) -> tuple[Floats, Floats]:
    """(u,), (u,): what sets of traits say of a trait outright, and what only follows; NaN where they say nothing."""
    firm = np.full(len(masks), np.nan, dtype=np.float32)
    leaning = firm.copy()
    for other in np.flatnonzero(np.isfinite(alike)).tolist():
        says = masks & np.uint64(1 << other) != 0
        into = leaning if follows[other] else firm
        into[says] = np.fmax(into[says], alike[other])
    return firm, leaning


def _pooled(share: Floats | np.float32, said: Floats, usual: Floats) -> Floats:
    """What is said and what is usual together; where only one is known, that."""
    pooled = probability(share * log_odds(said) + (1 - share) * log_odds(usual))
    found = np.where(np.isfinite(pooled), pooled, np.where(np.isfinite(said), said, usual))
    return np.asarray(found, dtype=np.float32)


@lru_cache(maxsize=1)
def _alike() -> Floats:
    """(t, 64): ``Knowledge.alike`` for what properties tell, with a column for what bends."""
    known = knowledge()
    alike = np.full((len(known.traits), FLEXIBLE + 1), np.nan, dtype=np.float32)
    alike[:, : len(known.traits)] = known.alike
    for trait, degree in _BENDING.items():
        alike[known.traits.index(trait), FLEXIBLE] = degree
    for (trait, told), degree in _HELD.items():
        alike[known.traits.index(trait), known.traits.index(told)] = degree
    return alike
