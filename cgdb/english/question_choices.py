"""Questions that choose ("which is closer to the door, the bed or the sofa?"), that put in order ("sort the chairs by
height"), and that ask whether something holds of all ("are all the chairs red?").
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache

from cgdb.english.cues import STARTERS
from cgdb.english.intent import First, Head
from cgdb.english.lookahead import only_traits
from cgdb.english.phrases import Phrases, Word, listed

_COMPARED: dict[tuple[str, bool], str] = {
    ("distance", False): "closer|nearer to, closer|nearer",
    ("distance", True): "farther|further away? from, farther|further from",
    ("volume", True): "bigger, larger, greater",
    ("volume", False): "smaller",
    ("height", True): "taller",
    ("height", False): "shorter",
    ("width", True): "wider, longer",
    ("width", False): "narrower",
    ("depth", True): "deeper, thicker",
    ("depth", False): "thinner",
    ("z", True): "higher, higher up",
    ("z", False): "lower, lower down",
    ("weight", True): "heavier",
    ("weight", False): "lighter",
}
_ORDERS: dict[str, str] = {
    "height": "height", "width": "width|length", "depth": "depth|thickness", "volume": "size|volume",
    "distance": "distance to|from", "weight": "weight",
}  # fmt: skip
_SORT = listed("sort order rank arrange")
_SORTED = listed("sorted ordered ranked arranged")
_BE = listed("is are was were")
_ALL = listed("all every each both the these those my our your any")


def chosen(said: Sequence[Word]) -> Head | None:
    """ "Which is closer to the door, the bed or the sofa?", "which is bigger: the bed or the sofa"."""
    if len(said) < 5 or said[0].form not in ("which", "what") or not any(word.form == "or" for word in said):
        return None
    at = 1
    while at < len(said) and said[at].form in ("of", "the", "two", "one", "thing", "object", "is", "are"):
        at += 1
    hit = _compared().at(said, at)
    comma = next((i for i in range(at, len(said)) if said[i].form in (",", ":")), None)
    if hit is None or comma is None or said[at - 1].form not in ("is", "are"):
        return None
    between, to = tuple(said[comma + 1 :]), None
    by, descending = hit[1]
    if by == "distance":
        anchor = [word for word in said[at + hit[0] : comma] if word.form not in STARTERS]
        to = " ".join(word.form for word in anchor) or None
    elif comma != at + hit[0]:
        return None
    said_by = " ".join(word.form for word in said[at : at + hit[0]])
    first = First(by=by, descending=descending, to=to, text=f"{said_by} {to}" if to else said_by)
    return Head(form="find", what="", subject=between, first=first, whole=True)


def sorted_by(said: Sequence[Word]) -> Head | None:
    """ "Sort the chairs by height"."""
    at = next((i for i, word in enumerate(said) if word.form == "by"), None)
    if at is None or at < 2 or (said[0].form not in _SORT and said[at - 1].form not in _SORTED):
        return None
    hit = _orders().at(said, at + 1)
    if hit is None:
        return None
    to = [word.form for word in said[at + 1 + hit[0] :] if word.form not in STARTERS]
    first = First(
        by=hit[1], descending=hit[1] != "distance", to=" ".join(to) or None, single=False, text=f"by {hit[1]}"
    )
    return Head(
        form="find", what="", subject=tuple(word for word in said[:at] if word.form not in _SORT | _SORTED), first=first
    )


def all_are(said: Sequence[Word]) -> Head | None:
    """ "Are all the chairs red?", "is the sofa white?"."""
    if len(said) < 4 or said[0].form not in _BE or said[1].form not in _ALL:
        return None
    begin = 1
    while begin < len(said) and said[begin].form in _ALL | {"of"}:
        begin += 1
    for at in range(begin + 1, len(said)):
        kept = [word.form for word in said[at:] if word.form not in ("and", "very", "really")]
        if kept and only_traits(" ".join(kept)) and not only_traits(" ".join(word.form for word in said[begin:at])):
            return Head(form="all", what="", subject=tuple(said[begin:at]), against=tuple(said[at:]))
    return None


@lru_cache(maxsize=1)
def _compared() -> Phrases[tuple[str, bool]]:
    return Phrases(_COMPARED)


@lru_cache(maxsize=1)
def _orders() -> Phrases[str]:
    return Phrases(_ORDERS)
