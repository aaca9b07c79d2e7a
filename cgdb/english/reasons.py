"""What people say beside their question: why they ask ("I'm driving"), what is out of use ("the oven is broken"), and
words thrown in ("you know", "obviously").
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache

from cgdb.english.phrases import Phrases, Word, listed, stretch
from cgdb.meaning.lexicon import FUNCTION_WORDS

_MARKS = listed(", . ; : ? !")
_SENTENCE_ENDS = listed(". ; ? !")
_OPENERS = listed("so and but only because since as cause cos coz though although")
_TELLERS = listed("i we")
_WHOSE = listed("my our his her")
_SOMEBODY = listed("he she")
_OWNED = listed("my our his her their the this")
_AND = listed("and or nor")
_BEFORE_STATE = listed("all already still now currently completely totally both just been")
_IS = listed("is are was were has have")
_OUT_OF_USE = """broken, broke, bust, busted, dead, kaput, knackered, damaged, cracked, full, taken, occupied, busy,
    missing, gone, lost, empty, dirty, filthy, unavailable, faulty, useless, closed, locked, blocked, out, out of order,
    out of service, out of use, out of action, out of stock, in use, being used|repaired|cleaned|fixed,
    not working|available|there|here|an option|allowed|possible, in the wash|dishwasher|laundry, in for repair,
    no good|use, off limits, ruined, sold out, used up, finished"""
_OFF = "out, off limits, out of the question, no good, not an option, not allowed, ruled out, forbidden, banned"
"""What says of things that are only named that they cannot be had: "tape is out"."""
_TAGS = "would|could|will|can you|ya, will ya, would ya please, will you please, would you mind, would you be so kind"
_STANCE = listed("obviously just only simply certainly definitely clearly absolutely really please preferably ideally")
_HERE = "here, in here, around here, round here, over here, in this room, in this place, in this house|flat|office"
_QUESTION_WORDS = listed("what where who how which why")
_PREPOSITIONS = listed("in around round from over up down out near by at to is are what s")
_THROWN_IN = """you know, you see, i mean, i think, i guess, i suppose, i believe, i am afraid, i reckon, of course,
    mind you, by the way, if you like|can|please|could|would|will|wish, if possible, if at all possible, if you do
    not mind, if there is one|any, as i said, as always, obviously, clearly, certainly, definitely, naturally,
    honestly, frankly, actually, basically, literally, preferably, ideally, hopefully, presumably, apparently, well,
    though, mate, love, dear, darling, buddy, pal, dude, man, guys, folks, would|could|will|can|do|are you|ya, will
    ya, pls, plz, ta, cheers, like, right, ok, okay, thanks, thank you, thanks a lot, please, in particular, for
    instance, for example, as far as i know|remember|recall, i expect|imagine|assume|bet|hope, i would
    say|think|guess|imagine, i am pretty|fairly|quite|almost? sure|certain, if i remember right|rightly|correctly?,
    as i recall|remember, last i saw|looked|checked, last time i saw|looked|checked it?, at a guess, no doubt,
    perhaps, maybe, probably, to be honest, to be precise, or something, or so, or whatever, and so on, kindly"""
_OTHERS = listed("he she they somebody someone everybody everyone we i")
_WISHES = """needs|need|wants|want|fancies|fancy|prefers|requires, is|are|am after,
    is|are|am looking|searching|asking|desperate|dying for, would like|love|prefer, asked for, could do with, could use,
    wishes for, has asked for"""
_LEADS = """switch|turn on|off|up|down, grab|pass|lend|hand|throw|chuck|toss|slide|send|loan|find me|us, get hold of,
    track|hunt down, dig|fish out, could|can do with, could use, anyone|anybody seen,
    has|have anyone|anybody|somebody|you seen, who has seen|got|taken, any sign of"""
"""Further ways to say "find", where no verb of its own is asked."""
_GUESSES = """i|we think|thought|believe|guess|suppose|reckon|expect|imagine|assume|bet|figure|fancy that?, i|we
    would say|think|guess|imagine that?, i|we am|are pretty|fairly|quite|almost? sure|certain that?, i|we could
    swear that?, i|we seem to? remember|recall that?, i|we remember|recall that?, maybe, perhaps, probably,
    apparently, no doubt, chances are that?, at a guess"""
_IT_IS = """it|they|that|this|he|she|one is|are|was|were|sits|stands|lies|hangs|lives|goes, it|they|that|this|one
    will|would|might|may|could have? be|been"""
"""How a clause goes on that says where somebody thinks that a thing is."""
_LIKELY = """it|they|one will|would|might|may|could be|stand|lie|hang|live somewhere|probably?, it|they is|are
    probably|usually|normally|likely|possibly|perhaps|maybe"""
_FORGOTTEN = """i|we forget|forgot|have forgotten what|how|its|the|their, i|we can|could not remember|recall|think
    what|how|of|its|the, i|we do not know|remember|recall what|how|its|the name|word|term|it|you|that|they?, i|we
    never know|remember what|how|its|the, i|we am|are not sure what it|they|you|that, whatever|however
    it|they|you|that is|are|call|calls, what is|are it|they|that called, what do|did|does you|they|one call
    it|them|that, what is its|the|that name|word, the|its name escapes me, if you know what i mean, you know the
    one|ones|thing|sort|kind|what i? mean?"""
_OR_ELSE = """or|otherwise else? i|we|he|she|they|it|you|somebody|someone will|would|might|could|can|am|are, or
    else"""
_GIVERS = listed("get bring fetch give hand find pass show buy lend grab serve pour")
_SOME = listed("a an some something anything")
_HANDING = listed("bring give show get fetch hand include pick choose take suggest recommend offer use want send pass")
_BE_SO = """it|they|this|that|he|she|one should|must|might|may|could|will|would|ought|has|have to? be|stand|lie|hang
    somewhere|probably?, it|they is|are probably|usually|normally|supposed|meant|likely to? be?"""
_ODDITIES = "on earth, in the world, the hell|heck|devil, in heaven's name, in god's name"


def begins_reason(found: Sequence[Word], i: int) -> bool:
    """Whether words from i on, behind a comma or "because", tell of the speaker: "I'm driving", "my back hurts"."""
    while i < len(found) and found[i].form in _OPENERS:
        i += 1
    forms = [word.form for word in found[i : i + 4]]
    if len(forms) < 2:
        return False
    if forms[0] in _TELLERS or (forms[0] in _SOMEBODY and forms[1] in _IS):
        return True
    return forms[0] in _WHOSE and len(forms) > 2 and any(form in _IS for form in forms[2:])


def out_of_use(text: str, found: Sequence[Word]) -> tuple[str, ...]:
    """What a clause says cannot be had: "the microwave's bust", "plasters and tape are out"; none where it says no such
    thing.
    """
    kept = [word for word in found if word.form not in _MARKS]
    while kept and kept[0].form in _OPENERS:
        kept.pop(0)
    owned = bool(kept) and kept[0].form in _OWNED
    named = kept[1:] if owned else kept
    for at, word in enumerate(named[:5]):
        belongs = word.form.endswith("'s")
        if not belongs and word.form not in _IS:
            if word.form in FUNCTION_WORDS and word.form not in _AND:
                break
            continue
        behind = at + 1
        while behind < len(named) and named[behind].form in _BEFORE_STATE:
            behind += 1
        hit = (_out() if owned else _off()).at(named, behind)
        if hit is None or behind + hit[0] != len(named) or (at == 0 and not belongs):
            break
        groups: list[list[str]] = [[]]
        for one in named[: at + belongs]:
            if one.form in _AND:
                groups.append([])
            elif one.form not in _OWNED:
                groups[-1].append(text[one.start : one.end].removesuffix("'s").removesuffix("'S"))
        return tuple(" ".join(group) for group in groups if group)
    return ()


def wish_of(found: Sequence[Word]) -> int:
    """Where a clause names what somebody wants: behind "my aunt needs", "switch on"; 0 where it says nothing of it."""
    forms = [word.form for word in found]
    leads = _leads().at(found, 0) if found else None
    if leads is not None and forms[leads[0] : leads[0] + 1] not in ([], ["with"]):
        return leads[0]
    if len(forms) < 4 or not (forms[0] in _OTHERS or forms[0] in _OWNED):
        return 0
    begins = 1 if forms[0] in _OTHERS else next((i for i in (2, 3) if _wishes().at(found, i) is not None), 0)
    hit = _wishes().at(found, begins) if begins else None
    end = begins + (0 if hit is None else hit[0])
    return end if hit is not None and end < len(forms) and forms[end] not in ("to", "not") else 0


def forbidden(found: Sequence[Word]) -> tuple[int, bool] | None:
    """Of "don't bring the red one": where what is not to be begins, and whether it is named (not in "don't sit on").

    None where the clause forbids nothing.
    """
    forms = [word.form for word in found]
    at = 1 if forms[:1] == ["please"] else 0
    if forms[at : at + 2] != ["do", "not"] and forms[at : at + 1] != ["never"]:
        return None
    at += 1 if forms[at] == "never" else 2
    if at + 1 >= len(forms) or forms[at] in listed("i we you they have know mind"):
        return None
    named = forms[at] in _HANDING
    at += 1
    while named and at + 1 < len(forms) and forms[at] in listed("me us him her them up out any"):
        at += 1
    return at, named


def guessed(found: Sequence[Word]) -> int:
    """Where a clause begins that says where somebody thinks that the thing is: behind "I think it is", "it will be"."""
    thought = _guesses().at(found, 0) if found else None
    begins = 0 if thought is None else thought[0]
    hit = (_likely() if thought is None else _it_is()).at(found, begins) if begins < len(found) else None
    return 0 if hit is None or begins + hit[0] >= len(found) else begins + hit[0]


def without_asides_behind(text: str, found: Sequence[Word]) -> tuple[tuple[Word, ...], tuple[str, ...]]:
    """The words without what somebody adds that asks for nothing, and a line for each such aside.

    "I forget what you call it", "or I'll be up all night"; also without whom something is for ("get grandad a drink").
    """
    kept: list[Word] = []
    notes: list[str] = []
    at = 0
    while at < len(found):
        opens = bool(kept) and (kept[-1].form in _MARKS or found[at].form in ("or", "otherwise"))
        aside = opens and any(table.at(found, at) is not None for table in (_forgotten(), _or_else()))
        if aside:
            marks = _SENTENCE_ENDS | {","}
            end = next((j for j in range(at, len(found)) if found[j].form in marks), len(found))
            notes.append(f"said aside, and left out: {stretch(text, found[at:end])}")
            at = end
            continue
        kept.append(found[at])
        at += 1
        if kept[-1].form in _GIVERS:
            at += _for_whom(found, at)
    return tuple(kept), tuple(notes)


def _for_whom(found: Sequence[Word], at: int) -> int:
    """How many words from here say for whom something is: "grandad" in "get grandad a drink"."""
    owned = at < len(found) and found[at].form in _OWNED
    end = at + owned + 1
    if end >= len(found) or found[end].form not in _SOME or found[end - 1].form in FUNCTION_WORDS:
        return 0
    return end - at if found[end - 1].form.isalpha() else 0


def without_thrown_in(found: Sequence[Word]) -> tuple[Word, ...]:
    """The words without those that are thrown in between commas or at the end, without "on earth" and "in here"."""
    kept: list[Word] = []
    at = 0
    while at < len(found):
        length = _thrown_in(found, at, kept)
        if length:
            at += length
            continue
        kept.append(found[at])
        at += 1
    return tuple(kept)


def _thrown_in(found: Sequence[Word], at: int, kept: Sequence[Word]) -> int:
    """How many words from here on are thrown in, behind those that are kept."""
    last = kept[-1].form if kept else ""
    if last in _QUESTION_WORDS and (odd := _odd().at(found, at)) is not None:
        return odd[0]
    if not kept:
        return 0
    following = found[at + 1].form if at + 1 < len(found) else ""
    if last in _MARKS and found[at].form in _STANCE and following in ("not", "no"):
        return 1
    if len(kept) > 1 and (here := _around().at(found, at)) is not None and last not in _PREPOSITIONS:
        return here[0]
    if found[at].form == "instead" and (not following or following in _MARKS):
        return 1
    for table, alone in ((_tags(), True), (_thrown(), last in _MARKS)):
        hit = table.at(found, at)
        if hit is not None:
            end = at + hit[0]
            ends = end >= len(found)
            closes = ends or found[end].form in _SENTENCE_ENDS
            if (alone and (ends or found[end].form in _MARKS)) or (closes and hit[0] > 1):
                return hit[0]
    return 0


def placing(found: Sequence[Word]) -> int:
    """Where a clause begins that only says where the thing is: behind "it should be" ("... on the round table")."""
    hit = _so().at(found, 0) if found else None
    return 0 if hit is None or hit[0] >= len(found) else hit[0]


@lru_cache(maxsize=1)
def _out() -> Phrases[bool]:
    return Phrases({True: _OUT_OF_USE})


@lru_cache(maxsize=1)
def _thrown() -> Phrases[bool]:
    return Phrases({True: _THROWN_IN})


@lru_cache(maxsize=1)
def _odd() -> Phrases[bool]:
    return Phrases({True: _ODDITIES})


@lru_cache(maxsize=1)
def _so() -> Phrases[bool]:
    return Phrases({True: _BE_SO})


@lru_cache(maxsize=1)
def _guesses() -> Phrases[bool]:
    return Phrases({True: _GUESSES})


@lru_cache(maxsize=1)
def _it_is() -> Phrases[bool]:
    return Phrases({True: _IT_IS})


@lru_cache(maxsize=1)
def _likely() -> Phrases[bool]:
    return Phrases({True: _LIKELY})


@lru_cache(maxsize=1)
def _forgotten() -> Phrases[bool]:
    return Phrases({True: _FORGOTTEN})


@lru_cache(maxsize=1)
def _or_else() -> Phrases[bool]:
    return Phrases({True: _OR_ELSE})


@lru_cache(maxsize=1)
def _wishes() -> Phrases[bool]:
    return Phrases({True: _WISHES})


@lru_cache(maxsize=1)
def _off() -> Phrases[bool]:
    return Phrases({True: _OFF})


@lru_cache(maxsize=1)
def _tags() -> Phrases[bool]:
    return Phrases({True: _TAGS})


@lru_cache(maxsize=1)
def _around() -> Phrases[bool]:
    return Phrases({True: _HERE})


@lru_cache(maxsize=1)
def _leads() -> Phrases[bool]:
    return Phrases({True: _LEADS})
