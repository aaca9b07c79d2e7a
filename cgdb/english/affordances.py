"""What a map says that its things can be used for, under the names that simulators give to such uses (SITTABLE)."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass

from cgdb.meaning.situations import split

PROPERTY = "affordances"
"""The property that holds them, a list of texts."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Affordance:
    """names: what maps may call it. decides: common sense knows less of it than the map ("what has a switch")."""

    names: tuple[str, ...]
    decides: bool = False


_CONFIRMED: Mapping[str, str] = {
    "sittable, sit, sit on, seat": r"sit|seat|take a seat",
    "lieable, lie, lie on": r"lie|lay down|sleep|nap|rest",
    "readable, read": r"read",
    "eatable, edible, eat": r"eat|snack",
    "drinkable, drink": r"drink",
    "cuttable, cut": r"be cut|slice up",
    "clothes, wearable, wear": r"wear|put on",
    "lookable, look at, watch": r"look at",
}
_DECIDED: Mapping[str, str] = {
    "can_open, openable, open": r"(?:be )?open(?:ed)?|(?:be )?clos(?:e|ed)",
    "has_switch, switchable, toggleable, toggle, turn on, switch on": (
        r"(?:be )?(?:turn(?:ed)?|switch(?:ed)?)(?: it)?(?: on| off)?(?: (?:or|and) off)?|has a switch"
    ),
    "has_plug, pluggable, plug in": r"(?:be )?plug(?:ged)?(?: in)?|has a plug",
    "grabbable, graspable, pickupable, grab, pick up": (
        r"(?:be )?(?:grab(?:bed)?|grasp(?:ed)?|pick(?:ed)? up|carr(?:y|ied))"
    ),
    "movable, moveable, move": r"(?:be )?moved?|(?:be )?push(?:ed)?",
    "hangable, hang": r"be hung|hang up",
    "pourable, pour": r"(?:be )?pour(?:ed)?",
}
_USE = re.compile(
    r"^(?:something|anything|somewhere|(?:a |the )?(?:things?|objects?|items?|places?)|what|stuff)\b"
    r"(?: that| which| where)?(?: (?:i|we|you|one|people))?(?: (?:to|can|could|may))?(?: use to)? (?P<verb>.+)$",
    re.IGNORECASE,
)
_TAIL = re.compile(r"\s+(?:on|in|at|down|upon|with|from|inside)$", re.IGNORECASE)


def affordance_of(wanted: str) -> tuple[Affordance, bool] | None:
    """The affordance that a use asks for, and whether that is all it asks ("something to sit on")."""
    match = _USE.match(split(wanted)[0])
    if match is None:
        return None
    verb = match["verb"].casefold().strip()
    plain = _TAIL.sub("", verb)
    for decides, table in ((True, _DECIDED), (False, _CONFIRMED)):
        for names, pattern in table.items():
            whole = re.fullmatch(pattern, plain) or re.fullmatch(pattern, verb)
            if whole or (not decides and re.match(rf"(?:{pattern})\b", verb)):
                listed = tuple(name.strip() for name in names.split(","))
                return Affordance(names=listed, decides=decides), whole is not None
    return None
