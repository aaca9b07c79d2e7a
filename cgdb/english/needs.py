"""What helps in a situation that somebody tells of: "I spilled my coffee" asks for something to wipe it up with."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from cgdb.english.phrases import listed
from cgdb.meaning.words import singular

_HELP: Mapping[str, str] = {
    "wipe up a spill": "spill spills spilled spilt spilling",
    "drink": "thirsty thirst parched dehydrated",
    "eat": "hungry starving starved famished peckish",
    "rest or sleep on": "tired sleepy exhausted nap drowsy weary",
    "sit down on": "standing legs feet",
    "keep warm": "cold freezing chilly shivering frozen",
    "cool down": "hot sweating overheated sweltering stuffy",
    "light up a dark room": "dark dim gloomy blackout",
    "have fun with": "bored boring boredom",
    "clean or wash with": "dirty muddy sticky greasy filthy stained stain",
    "dry off with": "wet soaked soaking drenched",
    "keep dry in the rain": "rain raining rains rainy pouring drizzling drizzle",
    "block out noise": "noisy loud noise noises",
    "treat a wound": "bleeding bleed wound injured hurt burned",
    "relieve pain": "headache toothache migraine sick pain fever ill killing throbbing ache aches aching sore",
    "mend a tear": "torn ripped rip tear",
    "repair things with": "broken broke loose",
    "sweep the floor": "dust dusty crumbs mess messy",
    "block the sunlight": "sunny glare sunlight bright blinding blinds dazzling dazzles",
    "put out a fire": "fire burning flames",
    "write down notes": "forget remember",
    "charge a phone": "battery charge",
}
_REMEDY = {word: remedy for remedy, signs in _HELP.items() for word in signs.split()}

_TELLERS = listed("i we my our he she they his her their someone somebody there")


_ARTICLES = listed("the this that these those")
_FINITE = listed("is are was were has have had got went keeps does do will")
_DESCRIBES = listed("that which who whose where with what")
_CONJUNCTIONS = listed("when if because since as while whenever now that")
_ASKED_TIME = (["what", "time"], ["how", "late"])
_I_CUT = (["i", "cut"], ["i", "burned"], ["i", "burnt"])


def remedy(forms: Sequence[str]) -> str | None:
    """What one would like to do in the situation that a clause tells of; None where it tells of none that is known.

    Only what is told counts ("I am cold", "it is too dark"): a cold drink is no situation.
    """
    told = _told(forms)
    if told[:2] in _ASKED_TIME:
        return "tell the time"
    if told[:2] in _I_CUT and "my" in told:
        return "treat a wound"
    if not told or not (
        told[0] in _TELLERS
        or (told[0] == "it" and _is_weather(told))
        or (told[0] == "the" and "too" in told)
        or states(told)
    ):
        return None
    if states(told):
        told = told[_verb(told) :]  # "the wet towel is on the floor" tells of no rain
    return next((_REMEDY[word] for form in told for word in (form, singular(form)) if word in _REMEDY), None)


def _told(forms: Sequence[str]) -> list[str]:
    """The words behind "when" or "because"."""
    start = next((i for i, form in enumerate(forms) if form not in _CONJUNCTIONS), len(forms))
    return list(forms[start:])


def _is_weather(forms: Sequence[str]) -> bool:
    """ "It is too dark" tells of the world, "it is a dark lamp" of a thing."""
    return forms[1:2] in (["is"], ["was"], ["gets"]) and forms[2:3] not in (["a"], ["an"], ["the"])


def states(forms: Sequence[str]) -> bool:
    """Whether a clause tells how something is ("the knee of my jeans has ripped") and does not describe it."""
    return bool(forms) and forms[0] in _ARTICLES and 1 < _verb(forms) < len(forms) - 1


def _verb(forms: Sequence[str]) -> int:
    """Where the verb of a clause stands; its end where none does, or where a clause of its own describes the thing."""
    at = next((i for i, form in enumerate(forms) if form in _FINITE), len(forms))
    return len(forms) if any(form in _DESCRIBES for form in forms[:at]) else at


def is_story(forms: Sequence[str]) -> bool:
    """Whether a clause tells of somebody ("my laptop does not start") instead of asking."""
    told = _told(forms)
    return bool(told) and (told[0] in _TELLERS - {"there"} or (states(told) and remedy(told) is not None))
