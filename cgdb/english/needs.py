"""What helps in a situation that somebody tells of: "I spilled my coffee" asks for something to wipe it up with."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import Literal

from cgdb.english import cues
from cgdb.english.phrases import Phrases, Word, listed, stretch
from cgdb.english.question_frames import MARKS, opening
from cgdb.english.reasons import out_of_use
from cgdb.meaning.knowledge import knowledge
from cgdb.meaning.lexicon import ADJECTIVES, DETERMINERS, FUNCTION_WORDS, LIGHT_VERBS, PARTICLES
from cgdb.meaning.situations import MARK
from cgdb.meaning.uses import synonyms
from cgdb.meaning.words import singular, stem

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
    return bool(told) and (
        told[0] in _TELLERS - {"there"} or (states(told) and remedy(told) is not None) or _tells(told)
    )


# -- what is told, and matched as a whole ---------------------------------------------------------------------------

Piece = Literal["names", "tells", "orders", "uses", "denies", "goes on"]
"""What a piece of a question does: it names a thing, tells how things are, bids to do something, names a use, or
excludes a thing; or it goes on with the piece before."""

_BREAKS = frozenset(".;?!,:")
_JOINS = listed("and but so because")
_AFTER_SO = listed("i we you he she they it nobody somebody everybody that can could what where how please not no")
_BESIDE = listed("and but so then also now please because since as or well just oh hey hi hello ok okay actually quick")
_SUBJECTS = listed("i we he she they you it someone somebody everybody everyone nobody who there")
_SPEAKERS = listed("i my me we our us")
_BE = listed("is are was were am be been being")
_VERBS_OF_ALL = _BE | listed(
    """has have had got gone went does did do will would can could might must should keeps kept needs need wants want
    won will broke snapped came comes goes gets fell hurts hurt looks feels smells stopped ran died burst cracked leaks
    started starts spilled spilt knocked dropped lost left slipped ripped tore split keep ache aches itch itches burns
    stings bleeds throbs stinks squeaks creaks rattles drips overflows flickers beeps buzzes wobbles jams jammed shakes
    frayed faded melts melted rots rotted smokes sparks froze overheats crashed refuses falls cries barks coughs
    snores"""
)
_BEGIN_DESCRIPTION = _DESCRIBES | listed("wherever whatever whichever whom why how for to from")
_AFTER_OWNER = listed(
    """on out in off up down not too so very all a an the been just still no gone got getting going about almost nearly
    really never always full empty dead over"""
)
_STATES = listed(
    "wet hot cold dark loud flat bust broke ill sick sad sore late lost full dead stuck blunt loose low off gone warm"
)
_WISHES = """need|needs|want|wants|got|have|has|ought|time|dying|about|ready|off|trying|going to, gonna, gotta, wanna,
    can|could not, do|did not know how to?, fancy, fancy a|an|some, feel|feeling like a|an?, in need of a|an|some?, in
    the mood for a|an|some?, could do|use with? a|an|some?, could murder|kill for? a|an|some?, dying|craving|longing for
    a|an|some?"""
_KINDS = ("kind", "traits")
_TO_DO = listed("to gonna gotta wanna not how")
"""Last words of a wish behind which a verb stands."""
_POLITE = """please, kindly, can|could|would|will you please|kindly?, any chance you could, be so
    kind and?, be a dear|love|darling and?, go and?, might i ask you to, i would like you to, i need|want you to, let
    us, help me|us to?, quick, quickly, hurry up?, somebody|someone please"""
_HANDING = listed(
    """find bring get fetch give show grab pass hand lend send take pick choose locate spot identify point recommend
    suggest list name tell search look count describe buy borrow toss throw select detect return see watch meet go come
    where what which how who whose why when is are do does did any"""
)
_GIVING = listed("get take give")
_ENDS_ORDER = PARTICLES | listed("out off clean dry open shut closed tidy ready warm cool going working")
_DOING = listed("make makes use get keep put let")
_SOUGHT = listed("looking searching look search find after")
_ANY = listed("something anything somewhere anywhere")
_NOT_ORDERS = listed("like such not no both all half many there other another same next wherever whatever whichever")
_OBJECTS = DETERMINERS | listed("it me us him her them myself yourself ourselves two three some both all every")


@dataclass(frozen=True, slots=True, kw_only=True)
class Situation:
    """What a question tells that names no thing, and the use that it asks for beside, as "something to ..." or ""."""

    told: str
    use: str = ""
    wishes: bool = False
    """Whether it only bids or wishes to do something."""

    @property
    def wanted(self) -> str:
        """The text that is matched by meaning."""
        return f"{self.use or 'something'}{MARK}: {self.told}"


def situation(text: str, found: Sequence[Word]) -> Situation | None:
    """What a question tells where it names no thing ("loo's blocked again", "it is boiling, cool me down"); else None.

    The words of such a text say neither what is wanted nor where it is: it is kept whole, to be matched by meaning.
    """
    pieces = _pieces(found)
    sorts = [_sort(text, piece) for piece in pieces]
    if "names" in sorts or sorts[:1] == ["goes on"] or not {"tells", "orders"} & set(sorts):
        return None
    left = [(piece[_start(piece) :], sort) for piece, sort in zip(pieces, sorts, strict=True) if sort != "denies"]
    uses = [_use(text, piece) if sort == "uses" else "" for piece, sort in left]
    helps = next((h for piece, sort in left if sort == "tells" and (h := remedy([w.form for w in piece]))), None)
    use = next((use for use in uses if use), f"something to {helps}" if helps else "")
    told = (
        stretch(text, _before_exclusion(piece))
        for (piece, sort), said in zip(left, uses, strict=True)
        if not said and not (sort == "uses" and opening(piece).bare)
    )
    whole = ", ".join(part for part in told if part)
    return Situation(told=whole, use=use, wishes=set(sorts) <= {"orders", "denies"}) if whole else None


def _use(text: str, piece: Sequence[Word]) -> str:
    """The use that a piece asks for: "what can I dish it out with", "something to play with"; "" for a mere wish."""
    piece = _before_exclusion(piece)
    begins = opening(piece)
    rest = stretch(text, piece[begins.at :])
    if begins.use:
        return "" if begins.wish or begins.bare else f"{begins.prefix} {rest}".strip()
    at = next((i for i, word in enumerate(piece) if word.form in _ANY), None)
    return "" if at is None or at + 1 >= len(piece) else stretch(text, piece[at:])


def _before_exclusion(piece: Sequence[Word]) -> Sequence[Word]:
    """The words of a piece before it excludes a thing: "heat my lunch with anything | except the microwave"."""
    at = _excludes(piece)
    return piece if at is None else piece[:at]


def kept(text: str, found: Sequence[Word]) -> str:
    """All that a question tells, without polite words and without what it excludes."""
    pieces = (piece for piece in _pieces(found) if _sort(text, piece) != "denies")
    told = (stretch(text, _before_exclusion(piece[_start(piece) :])) for piece in pieces)
    return ", ".join(part for part in told if part)


def is_told(forms: Sequence[str]) -> bool:
    """Whether what seems to be excluded tells what somebody cannot do: "I can't | reach the shelf"."""
    first = forms[0] if forms else ""
    object_follows = len(forms) > 2 and forms[1] in DETERMINERS and first not in FUNCTION_WORDS
    return object_follows and not first.endswith("ing") and not knowledge().things_named(first)


def _excludes(piece: Sequence[Word]) -> int | None:
    """Where a piece begins to exclude a thing of the table; None where it excludes none."""
    for at in range(len(piece)):
        hit = cues.negations().at(piece, at)
        following = [word.form for word in piece[at + hit[0] :]] if hit is not None and hit[1] else []
        if not following or following[0].endswith("ing") or is_told(following):
            continue
        if knowledge().facets(" ".join(following)).form in _KINDS:
            return at
    return None


def _pieces(found: Sequence[Word]) -> list[list[Word]]:
    """The words between marks and conjunctions."""
    pieces: list[list[Word]] = [[]]
    for i, word in enumerate(found):
        joins = word.form in _JOINS and len(pieces[-1]) > 1
        following = found[i + 1].form if i + 1 < len(found) else ""
        if word.form in _BREAKS or (joins and (word.form != "so" or following in _AFTER_SO)):
            pieces.append([])
        elif word.form not in MARKS:
            pieces[-1].append(word)
    return [piece for piece in pieces if piece]


def _start(piece: Sequence[Word]) -> int:
    """Where a piece begins behind conjunctions and polite words."""
    at = 0
    while at < len(piece) - 1:
        hit = _polite().at(piece, at)
        if hit is not None and at + hit[0] < len(piece) - 1:
            at += hit[0]
        elif piece[at].form in _BESIDE:
            at += 1
        else:
            break
    return at


def _sort(text: str, piece: Sequence[Word]) -> Piece:
    """What a piece does."""
    left = piece[_start(piece) :]
    forms = [word.form for word in left]
    excludes = _excludes(left)
    if (excludes is not None and (excludes == 0 or _tells(forms))) or out_of_use(text, left):
        return "denies"
    if _tells(forms):
        return "tells"
    if _bids(forms):
        return "orders"
    begins = opening(left)
    wish = _wishes().at(left, 0)
    if wish is not None and left[wish[0] - 1].form in _TO_DO and wish[0] < len(left):
        return "tells"
    if begins.use and begins.form == "find" and not (begins.wish and not _ANY & set(forms)):
        return "orders" if begins.at == 0 and not _names(forms) and not forms[0].endswith("ing") else "uses"
    if begins.use and begins.form == "find":
        return "orders"
    rest = left[max(begins.at, 0 if wish is None else wish[0]) :]
    if not rest:
        return "goes on"
    at = next((i for i, word in enumerate(left) if word.form in cues.GENERIC | _ANY), None)
    if at is not None and (at < len(left) - len(rest) + 3 or left[at].form in _ANY):
        return "names" if knowledge().facets(stretch(text, left[at:])).form in _KINDS else "uses"
    if begins.form != "find":
        return "names"
    named = _names([word.form for word in rest])
    if wish is not None and not named:
        return "tells"
    return "names" if named or begins.at > 0 else "goes on"


def _tells(forms: Sequence[str]) -> bool:
    """Whether a piece says how things are: "I am soaked", "the pan is on fire", "throat's dry", "chucking it down"."""
    if len(forms) < 2:
        return False
    first, second = forms[0], forms[1]
    if first in ("it", "that", "this") and second in _BE:
        # "It is boiling in here" tells; "it is a round thing" and "it is red" describe.
        following = [form for form in forms[2:] if form not in ("so", "too", "very", "really", "just", "not", "all")]
        return (
            bool(following)
            and following[0] not in DETERMINERS | {"on", "in", "under", "near", "next"}
            and not (knowledge().facets(" ".join(following)).form in ("kind", "traits") and len(following) == 1)
        )
    if first == "there" and second in _BE:
        return bool(_SPEAKERS & set(forms)) or not _names(forms[2:])
    if first in _SUBJECTS and first not in ("who", "there"):
        return not _asks_for(forms)
    if first in _HANDING or first in cues.GENERIC:
        return False
    if first.endswith("ing") and len(first) > 4:
        return second in DETERMINERS | cues.PRONOUNS | {"to"} and not _names([first])
    owner = next((i for i, form in enumerate(forms[:4]) if form.endswith("'s")), None)
    if owner is not None and owner + 1 < len(forms) and first not in ("a", "an"):
        following_owner = forms[owner + 1]
        state = following_owner in _AFTER_OWNER or (
            following_owner.endswith(("ed", "en", "ing")) and not _names([following_owner])
        )
        if state or (owner + 2 >= len(forms) and _is_state(following_owner)):
            return True
    at = next((i for i, form in enumerate(forms) if form in _VERBS_OF_ALL), len(forms))
    if first in _VERBS_OF_ALL or any(form in _BEGIN_DESCRIPTION | _SUBJECTS for form in forms[1:at]):
        return False
    if first not in DETERMINERS and DETERMINERS & set(forms[1:at]) and _names([first]):
        return False  # "cables the robot cannot drive over"
    # "That saw is so noisy" tells, "that the baby does not wake" is a purpose, "wherever my umbrella is" a question.
    if first in _BEGIN_DESCRIPTION and (first != "that" or second in DETERMINERS):
        return False
    wants = at < len(forms) and forms[at] in ("need", "needs", "want", "wants") and _names(forms[at + 1 :])
    placed = at + 1 < len(forms) and forms[at] in _BE and _is_placed(forms[at + 1 :]) and _names(forms[:at])
    last = len(forms) - (at < len(forms) and forms[at] in _BE | cues.MODALS)
    return 0 < at < min(last, 6) and not wants and not placed


def _is_state(form: str) -> bool:
    """Whether a word says how something is ("dry"), and names nothing."""
    known = form in ADJECTIVES or form in _STATES or knowledge().facets(form).form == "traits"
    return not _names([form]) and (known or form.endswith("y"))


def _is_placed(forms: Sequence[str]) -> bool:
    """Whether words say where something is: "on top of the chair", and not "on fire"."""
    hit = cues.relations().at([Word(form, 0, 0) for form in forms], 0)
    return hit is not None and _names(forms[hit[0] :]) and forms[-1] not in ("fire", "flames")


def _asks_for(forms: Sequence[str]) -> bool:
    """ "I need a chair" asks for a thing, "I need to sit" and "I have a headache" do not."""
    begins = opening([Word(form, 0, 0) for form in forms])
    if begins.form != "find" or begins.use:
        return begins.use
    rest = forms[begins.at :]
    sought = bool(_SOUGHT & set(forms[: begins.at])) or bool(cues.GENERIC & set(rest[:3])) or _names(rest)
    return begins.at > 0 and bool(rest) and sought


def _names(forms: Sequence[str]) -> bool:
    """Whether words name a thing of the table."""
    return bool(knowledge().facets(" ".join(forms)).kinds)


def _bids(forms: Sequence[str]) -> bool:
    """Whether a piece bids to do something: it begins with a verb, and what that is done to follows."""
    if len(forms) < 2 or not forms[0].isalpha():
        return False
    first = forms[0]
    if forms[:2] == ["get", "rid"] or (first in _GIVING and len(forms) > 2 and forms[-1] in _ENDS_ORDER):
        return True  # "get the stain out", "get this clean"
    out = next((i for i, form in enumerate(forms) if form in ("out", "off") and i > 1), 0)
    if first in _GIVING and out and not _names(forms[1:out]):
        return True  # "get the wax out of the carpet"
    if first == "give" and forms[1] in DETERMINERS:
        return True  # "give the hedge a trim"
    if first in _HANDING | _NOT_ORDERS | (FUNCTION_WORDS - _DOING) or first in cues.GENERIC:
        return False
    verb = (
        stem(first) in knowledge().doing.verbs or synonyms(stem(first)) != {stem(first)} or stem(first) in LIGHT_VERBS
    )
    noun = singular(first) in knowledge().nouns or first in ADJECTIVES or first.endswith("ing")
    behind = forms[2:3] if forms[1] in PARTICLES and len(forms) > 2 else forms[1:2]
    relative = noun and behind == ["that"]  # "lights that are not on the ceiling"
    object_follows = bool(behind) and (behind[0] in _OBJECTS or behind[0].isdigit()) and not relative
    return (object_follows and (verb or not noun)) or (verb and not noun and not _names(forms))


@lru_cache(maxsize=1)
def _polite() -> Phrases[bool]:
    return Phrases({True: _POLITE})


@lru_cache(maxsize=1)
def _wishes() -> Phrases[bool]:
    return Phrases({True: _WISHES})
