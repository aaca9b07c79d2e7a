"""The English words that questions are understood by: how they begin, exclude, relate, compare and end."""

from __future__ import annotations

from collections.abc import Mapping
from functools import lru_cache

from cgdb.english.phrases import Phrases, listed

_WHO = "i|we|you|one|someone|people|they|he|she"
_MAY = "can|could|shall|should|would|may|might|must|will|do"

# How a question begins. lead: says nothing; seek: that somebody looks for it; the others say what is asked, see
# cgdb.english.questions.
_FRAMES: Mapping[str, str] = {
    "lead": """please, hi, hello, hey, hey robot, ok, okay, so, well, now, and, then, but, robot, can|could|would|will
        you please|kindly? recommend|suggest|find|show|get|bring|fetch|give|locate|list|tell|name|point|take|hand|help?
        me|us? to? please?, show|find|get|bring|fetch|give|tell|hand|point me|us? please?, locate, list all?, name,
        look|search|looking|searching for, point me? at|to, take me to, identify, detect, select, pick, choose,
        return, i|we|you am|are looking|searching for, i|we would? like|love|want|need, i|we want|need|would like you
        to find|see|locate|get|have|fetch|buy, i|we am|are trying to find|locate, help me find, let us find,
        would|do you mind finding|showing|bringing|getting|fetching me?, do you
        know, have you seen, i wonder,
        tell me more? about?, what|how about, i|we can|could not find, i|we have? lost, i|we do not know,
        which|what|any|one|all|some|each|every of the|these|those|my, all the|of|my?, every, each, the following,
        which|what objects|object|things|thing|items|item is|are, what else? is|are the?, what|which, who is,
        whatever is|are?, whichever is|are?, this|that|it|he|she is, this|that looks like, these|those|they are, here
        is|are, there is|are, the?
        image|picture|photo|object|item|thing|objects|things is|are|of|shows|show, a|an|the picture|photo showing, i
        see, i am thinking of, describe, is|are""",
    "seek": """i|we search|seek for?, i|we am|are after|seeking, i|we am|are hunting|rummaging around? for, i|we am|are
        on the hunt|lookout for, i|we am|are in need|search of, i|we seem to remember|recall seeing?, i|we can|could?
        remember|recall seeing?, i|we could have sworn there was|were, i|we thought there was|were, there used to be""",
    "exists": """is|are there any|some?, do|does|did not|never i|we|you|they have|own|keep|see any|some?, has|have not
        i|we|you|they got|seen? any|some?, is|are there not any|some?, is|are not there any|some?, do|does|did
        i|we|you|they not have|own any|some?, do|can|did you have|see|find any|some?, is|are there not any|some?, does
        it|this|the have|contain any?, does the map|room|scene|house have|contain any?, any, got any, do|did we|i have
        any|some?, have i|we any|some?, have you got any?, is|are there any|some? of?""",
    "count": """how many of? the|these|those|my?, count all? of? the?, what|tell is? me? the number of, the? number
        of, what number of, what is the count of, how much, give me the number of, show me the number of, tell me how
        many, can you count all? the?""",
    "where": f"""where is|are, where did|have|has|do i|we|you put|left|leave|keep|see, where
        can|could|do|will|would|might {_WHO} find|see|get|locate|spot|look for?, where to find|look for?, where
        exactly is|are, where would be|find, where the|my|our|your, wherever the|my|our|your?, wherever is|are""",
    "room": """in? which|what room|place|rooms is|are|has|have|can|do i|you|we? find|see?, which|what room|rooms
        contains|contain|has|have|holds, in? which|what room|rooms is|are there?""",
    "somewhere": f"""where {_MAY} {_WHO}, where to, where should|could|can it, where is|are a? good? place|spot? to,
        where might be a good place to""",
    "use": f"""how {_MAY} {_WHO}, is there any|a|some way|possibility|chance to, what else? is|are there to|for,
        what|which {_MAY} {_WHO} use|need? to|for?, what else {_MAY} {_WHO} use|need? to|for?, which|what
        object|thing|item|tool|objects|things|items {_MAY} {_WHO} use|need? to|for?, what else? can be used|taken
        to|for, what would? you? use|recommend|suggest? to|for, with what {_MAY} {_WHO}, what is|are
        used|useful|good|needed|suitable|best|great|handy|helpful|required to|for, what else? {_MAY} be
        used|useful|good|helpful|handy|suitable to|for, what {_MAY} help me|us|you|one|someone? to?, which|what
        object|thing|item|tool|one would|could|can|might|will help me|us|you|one|someone? to?, what helps me? to?,
        which|what one|object|thing|item is|are|would best|good|suitable|useful|used be? to|for, what works for,
        on|in|with which {_MAY} {_WHO}""",
    "do": """let us|me, it? is? time to, want|need to, if|when i|we|you want|wanted|need|needed|have|had|wish to,
        i|we|he|she want|need|wants|needs|have|has|must to, i|we must, i|we would like|love|want|need to, i|we am|are
        going to, i|we am|are trying to, i|we am|are about to, i|we plan|wish|hope|intend|try|have to, my
        friend|son|daughter|child|kid|wife|husband|mother|father|guest wants|needs|would like to, help me|us to?, i|we
        have got to, so that i|we can, i|we feel like, i|we can, can|could i|we""",
    "purpose": "so that",
    "can": """what|which|who else? can|could|would|will|might|does, which|what thing|object|item|one|tool
        can|could|would|will|might|does""",
}

# Endings that add nothing.
TAILS = """do|would|should|can|could i|we need|use|take, are|is there, there are|is, do|can|did you
        see|have|find|know, can be found|seen, please, thanks, thank you, to me|us|him|her, for me, for us, in total,
        altogether, at all, right now, now, here, over? there, around here?, are they, is it, in|on|of this|the
        map|scene|image|picture|environment|area, in|of this|the room|house|apartment|flat|home|building|place, exist,
        available, somewhere, currently, if possible, do|does it|we|the|this|room|house have|contain|has, at the
        moment, in here, present, in sight, is|are|be located|kept|stored|hidden, located, has|have|is|are
        got|gone|went to?"""

# What does not exclude although it looks so.
_NOT_NEGATIVE = """not only, not just, not sure, not necessarily, no matter, whether or not, why not, no idea, not to
        mention, not too far from, nothing but, no problem, or not, can not wait"""

_NEGATIONS: Mapping[str, str] = {
    "kind": """if not, but please? no|not, please no|not, but the|my, other than, others than, unlike, dissimilar to,
        different to|from|than, except for?, excepting, besides, apart from, aside from, rather than, as opposed to,
        in contrast to, contrary to, excluding, exclude, ignoring, disregarding, leaving out, but not|no, and not|no,
        yet not|no, not, no, nor, without, without any, lacking, though|although|albeit not, but none|nothing
        about|of|from|with|that?, of|in any|a|some? color|colour|material|shape|size but|except|besides, of|in a|any?
        color|colour|material|shape|size other than, that|which is|are any color|colour|material|shape
        but|except|besides, if|when|because? i|we do not want|like|need, never, free of|from, minus, anything but,
        everything but, all but, any but, something but, but for, save for, unrelated to, not related to, not
        associated|connected with|to, dissociated from, irrelevant to, having|has|have? nothing to do with, with
        nothing to do with, that|which has|have nothing to do with, far from being, that|which? is|are? far from, not
        like, not a kind of, not some kind of, neither, with no, with no kind of, that|which|who
        has|have|had|contains|contain no, has|have no, i|we? would rather|prefer not to?, i|we? prefer not to?,
        nothing, none of, that|which|who is|are|were not, is|are|be not, it|this|they|these is|are not,
        good|better|suitable|nice|best? alternative|alternatives to, a|an substitute for, not any, and|but it|they
        is|are not, other then, not being, only|just|merely not|no|nothing, only|just nothing with,
        and|but|though|although|only? i|we? do|does|did
        not mean|count""",
    "behind": """is|are not an? option|allowed|available|possible|suitable|welcome|wanted|permitted|ok|okay, is|are
        out of the question, is|are forbidden|excluded|prohibited|banned, is|are off limits""",
    "instead": "instead of, in place of, in lieu of",
    "dislike": """for|to someone|somebody|anyone|people|persons|those|guests|kids|children who|that
        dislikes|dislike|hates|hate|detests|detest|avoids|avoid|fears|fear|loathes|loathe, for a|the|my
        person|child|kid|man|woman|friend|guest|boy|girl|son|daughter who|that dislikes|hates|detests|avoids|fears,
        for|to someone|somebody|anyone|people|those|guests|kids|children who|that? is|are? allergic to, for|to
        someone|somebody|anyone|people|those|guests who|that can|does|do|will|would|should not
        like|have|eat|drink|tolerate|stand|want|wear|enjoy|use|afford|care for?, for|to someone|somebody|anyone|people
        who|that is|are? tired|sick|afraid|scared|bored|intolerant of|to, who|that dislikes|dislike|hates|hate|avoids|
        avoid, i|we|she|he|they|and|but? really? dislike|dislikes|hate|hates|detest|detests|avoid|avoids,
        i|we|she|he|they|and|but? really? do|does|can|will|would|did not really? like|want|have|stand|tolerate|need|
        drink|eat|own|use, am|is|are|being? allergic to, allergic to, tired|sick|afraid|scared of, intolerant to|of,
        avoiding, i|we ran|run out of, there is|are no, there is|are not any|a, i|we|she|he|they? am|is|are? really|so?
        sick|tired|bored|weary and tired? of, i|we|she|he|they? am|is|are? really|so? fed up with|of,
        i|we|she|he|they? have|has had enough of?, i|we|she|he|they have|has enough|plenty of?,
        i|we|she|he|they have|has got? enough|plenty of?, i|we|she|he|they react|reacts badly? to, i|we already
        have|own a|an|the|some?, i|we|she|he|they can|could not be doing|dealing|bothered with,
        i|we|she|he|they can|could not abide|bear|stomach""",
    "omit": "hold|skip|omit|ditch|forget the, leave|leaving out the?, sans, minus, hold off on the?, go easy on the",
    "deny": f"""that|which|who? {_WHO}|it? {_MAY}|does|did|has|have|had not ever? be|have|get|come|contain|include?,
        that|which|who never, that|which|who? lacks|lack, fails to, unable to, not able to, not suitable for|to, not
        meant for|to, not made of|from|out?, not good for|to, not used for|to""",
}

_RELATIONS: Mapping[str, str] = {
    "on": """on top of, atop, atop of, upon, onto, on, right|directly on, at the top of, on the top|surface|edge|end|
        corner of, supported by""",
    "attached": """hanging|hung|hangs|suspended|dangling from|on|off, mounted on|to|in|into,
        attached|fixed|stuck|bolted| screwed|glued|pinned|affixed to|on, built into, set into, connected to, plugged
        into""",
    "in": """inside, inside of, in, within, into, contained in|by, in the middle|center|centre of, enclosed in|by,
        surrounded by""",
    "under": "under, underneath, beneath, below, right|directly under|below|beneath, underside of, at the bottom of",
    "above": "above, over, right|directly above|over, up above, higher than",
    "next_to": """next to, right|directly next to|beside, beside, alongside, along side, along, adjacent to, by, right
        by, by the side of, at|on|to the side of, on|to|at the left|right|other side? of, left|right of, at the
        foot|head|end|edge|base of, against, up against, touching, side by side with, leaning against|on, flanking,
        bordering, attached next to, adjoining, on either|both|each side|sides of, joined to""",
    "near": """near, near to, nearby, close to, close by, close, around, in the vicinity of, not far from, at, not too
        far from, in the area of, within reach of, surrounding, a short way from, beside or near""",
    "front": """in front of, at the front of, opposite, opposite to|of, opposite from, across from, facing, facing
        towards|toward, fronting""",
    "behind": "behind, in back of, at|in the back of, to the rear of, hidden behind",
    "between": "between, in between, in-between, sandwiched between, among, amongst",
}
WEAK = listed("""on in by at over into within inside around along close upon onto among against along nearby""")
"""Words of place that belong to the verb in "something to sit on"; the longer ones ("next to") hardly ever do."""

_WITH = "with, that|which has|have|had|holds|holding, having, has|have, holding, carrying, featuring, topped with"
_BACK = {
    "on": "on top of? it|them|top?, on top, on it|them, atop, on its|their top, upon it|them",
    "in": "in|inside|within it|them, inside, in there, inside of it|them",
    "under": "under|underneath|below|beneath it|them, underneath",
    "above": "above|over it|them",
    "next_to": "next to|beside|by it|them, against it|them, on its left|right? side",
    "near": "near|around|close to it|them, nearby",
    "front": "in front of it|them",
    "behind": "behind it|them",
}

_CONNECTORS = """and? it|this|that|they|these|those|which is|are, that|which|who is|are, is|are, and? is|are, which,
        that, is|are currently, being, was|were, stands, sits, lies, hangs, rests, leans, stand, sit, lie, hang, rest,
        lean"""
PARTICIPLES = listed(
    """sitting standing lying laying hanging placed located mounted leaning resting positioned situated found kept
    stored put set seen directly right just immediately currently arranged parked left sits stands lies rests
    hangs being tucked pushed shoved wedged draped stuffed lives lived somewhere also both either all hidden laid hung
        pinned stacked"""
)

# by: (function, from large to small). "z" is the height of the middle over the origin.
_SUPERLATIVES: Mapping[tuple[str, bool], str] = {
    ("distance", False): "nearest, closest, most nearby, nearest by, nearer|closer to, nearer|closer of the? two",
    ("distance", True): """farthest, furthest, most distant, farthest away, furthest away, further|farther away? from,
        further|farther of the? two""",
    ("volume", True): "largest, biggest, greatest, bulkiest, most voluminous, larger|bigger of the? two",
    ("volume", False): "smallest, tiniest, littlest, most compact, smaller of the? two",
    ("height", True): "tallest, taller of the? two",
    ("height", False): "shortest, shorter of the? two",
    ("width", True): "longest, widest, broadest, longer|wider of the? two",
    ("width", False): "narrowest, narrower of the? two",
    ("depth", True): "deepest",
    ("depth", False): "shallowest, thinnest, slimmest",
    ("z", True): "highest, topmost, uppermost, highest up",
    ("z", False): "lowest, lowermost, bottommost",
}

_COMPARATIVES: Mapping[tuple[str, str], str] = {
    ("size", ">"): "larger|bigger|greater than",
    ("size", "<"): "smaller|tinier than",
    ("height", ">"): "taller|higher than",
    ("height", "<"): "shorter|lower than",
    ("width", ">"): "wider|longer|broader than",
    ("width", "<"): "narrower than",
    ("depth", ">"): "deeper|thicker than",
    ("depth", "<"): "thinner|shallower|slimmer than",
    ("size", "<="): "no|not larger|bigger than",
    ("size", ">="): "no|not smaller than",
    ("height", "<="): "no|not taller|higher than",
    ("height", ">="): "no|not shorter|lower than",
    ("width", "<="): "no|not wider|longer|broader than",
    ("width", ">="): "no|not narrower than",
    ("depth", "<="): "no|not deeper|thicker than",
    ("", ">"): "more than, over, above, greater than, in excess of, exceeding",
    ("", "<"): "less than, fewer than, under, below, closer than",
    ("", ">="): "at least, no|not less than, minimum, a minimum of",
    ("", "<="): "at most, no|not more than, up to, within, maximum, a maximum of",
    ("", "="): "exactly, about, around, roughly, approximately",
}
DIMENSIONS: Mapping[str, str] = {
    "tall": "height", "high": "height", "height": "height", "wide": "width", "width": "width", "long": "width",
    "length": "width", "broad": "width", "deep": "depth", "depth": "depth", "thick": "depth", "across": "width",
    "big": "size", "large": "size", "size": "size", "small": "size",
}  # fmt: skip
UNITS: Mapping[str, str] = {
    "mm": "mm", "millimeter": "mm", "millimeters": "mm", "millimetre": "mm", "millimetres": "mm",
    "cm": "cm", "centimeter": "cm", "centimeters": "cm", "centimetre": "cm", "centimetres": "cm", "dm": "dm",
    "m": "m", "meter": "m", "meters": "m", "metre": "m", "metres": "m", "km": "km", "kilometers": "km",
    "ft": "ft", "foot": "ft", "feet": "ft", "in": "in", "inch": "in", "inches": "in",
}  # fmt: skip
NUMBERS: Mapping[str, float] = {
    "a": 1, "an": 1, "one": 1, "two": 2, "three": 3, "four": 4, "five": 5, "six": 6, "seven": 7, "eight": 8, "nine": 9,
    "ten": 10, "half": 0.5, "twenty": 20, "thirty": 30, "fifty": 50, "hundred": 100,
}  # fmt: skip
ORDINALS: Mapping[str, int] = {"second": 2, "third": 3, "fourth": 4, "fifth": 5, "2nd": 2, "3rd": 3, "4th": 4}

STATES: Mapping[str, str] = {
    "open": "open", "opened": "open", "ajar": "open", "closed": "closed", "shut": "closed", "on": "on", "off": "off",
    "running": "on", "lit": "on",
}  # fmt: skip
OPPOSITE: Mapping[str, str] = {"open": "closed", "closed": "open", "on": "off", "off": "on"}
STATE_ADJECTIVES = frozenset(("open", "opened", "closed", "shut"))
STATE_FILLERS = listed("turned switched currently still left now already not")

ROOMS = """kitchen, bedroom, bathroom, living room, livingroom, dining room, diningroom, lounge, sitting room,
        hallway, hall, corridor, office, home office, study, garage, basement, cellar, attic, loft, balcony, laundry
        room, utility room, pantry, closet room, dressing room, lobby, foyer, entrance, entryway, staircase, meeting
        room, conference room, classroom, nursery, playroom, guest room, washroom, restroom, store room, storeroom,
        workshop, den, cafeteria, reception, terrace, patio, garden, bed room, bath room, master bedroom, children's
        room, kids room"""
SAME_ROOM: tuple[frozenset[str], ...] = (
    frozenset(("livingroom", "lounge", "sittingroom", "familyroom")),
    frozenset(("bathroom", "washroom", "restroom")),
    frozenset(("hallway", "hall", "corridor")),
    frozenset(("study", "homeoffice", "office")),
    frozenset(("entrance", "entryway", "foyer", "lobby")),
    frozenset(("laundryroom", "utilityroom")),
    frozenset(("storeroom", "storageroom", "pantry")),
)
"""Rooms that people call by several names, without spaces."""

GENERIC = listed(
    """help something anything somewhere anywhere thing things object objects item items stuff place places spot spots
    what one ones help everything nothing someone anybody"""
)
"""Heads that name no thing."""
STRUCTURE = listed("wall walls floor floors ceiling ceilings ground room rooms corner corners roof")
"""What most maps leave out or hold as one lump: that an edge to it is missing says nothing."""
PLACING = listed("""put place set hang lay stick mount install attach pour insert drop store leave hide add""")
"""Verbs that say where something goes: what follows them is not where the thing looked for is."""
MODALS = listed("must can could shall should would will may might do does did")
BEFORE_VERBS = MODALS | listed("to i we you")
USE_MARKS = listed("to can could for used i that which where with someone")
ASKING = listed("what find show bring can could give get which where how")
"""Words that begin a new question behind a comma."""
TRAILING = listed("please though either and but , . ; : ! ? instead ideally preferably")
SEEKING = listed("find see know locate get have look fetch bring buy count show spot identify")
STARTERS = listed("a an the some any my your our his her their this that these those its another one")
PRONOUNS = listed("it them this that these those me you us him her one ones")
EACH_OTHER = frozenset(("each other", "one another", "another one", "another", "others", "other ones"))


INTERJECTIONS = """oi, oy, yo, hiya, howdy, psst, ahoy, goodness me?, goodness gracious me?, good grief, my
    goodness|god|word, for goodness|heaven's|god's|pete's sake, right then, now then, hello|hey
    there|you|all|everyone, mate, love, dear, darling, sweetheart, pal, buddy, dude, guys, folks, lads, sir,
    madam, oh no, oh dear, oh my?, oh god, ah, aha, aw, ugh, argh, oops, whoops, ouch, ow, phew, wow, yikes, hmm,
    hm, um, uh, erm, er, eek, damn, darn, blimey, excuse me, sorry, pardon, listen, look here, right, alright, all
    right, yes, yeah, yep, hey there, hi there, good morning|evening|afternoon"""


@lru_cache(maxsize=1)
def interjections() -> Phrases[bool]:
    """What people exclaim or say before they ask."""
    return Phrases({True: INTERJECTIONS})


@lru_cache(maxsize=1)
def frames() -> Phrases[str]:
    """How questions begin."""
    return Phrases(_FRAMES)


@lru_cache(maxsize=1)
def tails() -> Phrases[bool]:
    """Endings that add nothing."""
    return Phrases({True: TAILS})


@lru_cache(maxsize=1)
def negations() -> Phrases[str]:
    """Words that exclude what follows; "" for those that only look so."""
    return Phrases({**_NEGATIONS, "": _NOT_NEGATIVE})


@lru_cache(maxsize=1)
def relations() -> Phrases[str]:
    """Words of place and the relation that they say."""
    return Phrases(_RELATIONS)


@lru_cache(maxsize=1)
def belongings() -> Phrases[bool]:
    """ "With" and what says the same."""
    return Phrases({True: _WITH})


@lru_cache(maxsize=1)
def back_references() -> Phrases[str]:
    """What closes "with a lamp on it"."""
    return Phrases(_BACK)


@lru_cache(maxsize=1)
def connectors() -> Phrases[bool]:
    """What may stand between a thing and where it is."""
    return Phrases({True: _CONNECTORS})


@lru_cache(maxsize=1)
def superlatives() -> Phrases[tuple[str, bool]]:
    """Words that ask for the first of an order: what it is by, and whether from large to small."""
    return Phrases(_SUPERLATIVES)


@lru_cache(maxsize=1)
def comparatives() -> Phrases[tuple[str, str]]:
    """Words that compare with a length or with a thing: what is compared ("" not said), and how."""
    return Phrases(_COMPARATIVES)


@lru_cache(maxsize=1)
def each_room() -> Phrases[bool]:
    """What asks for every room on its own."""
    return Phrases(
        {True: "in|for|of each|every room|place, per room|place, in each|every of the rooms, by room, room by room"}
    )


@lru_cache(maxsize=1)
def rooms() -> Phrases[bool]:
    """Rooms as people call them."""
    return Phrases({True: ROOMS})
