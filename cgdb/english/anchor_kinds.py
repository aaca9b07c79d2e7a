"""What the thing is that something is placed to: a part of the building, or a thing of the wanted kind itself."""

from __future__ import annotations

from cgdb.english import cues
from cgdb.english.phrases import listed, words
from cgdb.meaning.knowledge import knowledge
from cgdb.meaning.words import singular

_PARTS = listed(
    """windowsill sill ledge doorway doorframe threshold stair stairs staircase step landing hallway hall corridor aisle
    entrance exit middle center centre side end edge front back top bottom area zone spot place space surface background
    foreground distance alcove nook niche upstairs downstairs outdoors indoors outside inside entry kitchen bedroom
    bathroom lounge office lobby reception garage basement attic bedtime night morning evening noon day daytime
    lunchtime dinnertime nighttime moment time"""
)


def is_structure(anchor: str) -> bool:
    """Whether it is a wall, a floor and the like, of which most maps say little."""
    found = words(anchor)
    return bool(found) and found[-1].form in cues.STRUCTURE


def is_side(anchor: str) -> bool:
    """Whether it is a side of a room, which is no piece of furniture: what is on it stands on no other thing."""
    found = words(anchor)
    return bool(found) and singular(found[-1].form) in ("wall", "floor", "ceiling", "ground", "roof")


def seldom_mapped(anchor: str) -> bool:
    """Whether maps seldom hold such a thing, so that none of it says nothing: walls, sills, corners, what is there by
    day.
    """
    found = words(anchor)
    return bool(found) and (is_structure(anchor) or singular(found[-1].form) in _PARTS)


def compound(wanted: str, anchor: str) -> str | None:
    """ "Ceiling lamps" for lamps on the ceiling, where that is a kind of its own."""
    if not is_structure(anchor):
        return None
    kind = f"{singular(words(anchor)[-1].form)} {wanted}"
    named = knowledge().things_named(kind)
    return kind if named and named != knowledge().things_named(wanted) else None


def same_kind(wanted: str, anchor: str) -> bool:
    """Whether both are of one kind ("a chair next to a chair"): being one says nothing of being near one."""
    one, other = knowledge().facets(wanted).kinds, knowledge().facets(anchor).kinds
    return wanted == anchor or bool(set(one) & set(other))
