"""Questions that ask for a value and not for things: how tall, how far, what colour, more of which, where most.

The head says what is asked; the rest is read as any clause, so that "how tall is the lamp on the table" finds the lamp.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache

from cgdb.english.cues import NUMBERS, UNITS
from cgdb.english.intent import Head
from cgdb.english.phrases import Phrases, Word, listed
from cgdb.english.question_choices import all_are, chosen, sorted_by

_LEADS = """please, hi, hello, hey, ok, okay, so, and, but, robot, well, now, tell|show|give me please?, say,
    can|could|would|will you please? tell|say|show me?, do you know, i want|need to know, i would like to know,
    i wonder, do you happen to know, and what about, calculate, measure, determine, find out"""
_SCENES = "scene|scan|map|home|house|flat|apartment|scenes|scans|maps|homes|houses|flats|apartments|dataset|recording"
_HEADS = {
    ("measure", "height"): """how tall|high is|are|was|were?, what is|are the height|heights of, what height is|are|has,
        what height do|does, height of, the height of""",
    ("measure", "width"): """how wide|long|broad is|are|was|were?, what is|are the width|length|widths|lengths of,
        what width|length is|are|has, what width|length do|does, width|length of, the width|length of""",
    (
        "measure",
        "depth",
    ): """how deep|thick is|are|was|were?, what is|are the depth|thickness of, depth|thickness of, the
        depth|thickness of""",
    ("measure", "size"): """how big|large|small|bulky|voluminous is|are|was|were?, what is|are the
        size|sizes|volume|dimensions|measurements|extent of, what size is|are|has, what size do|does, what dimensions
        has|have|do|does, how much space|room do|does, size|volume|dimensions|measurements of, the
        size|volume|dimensions|measurements of""",
    ("measure", "weight"): """how heavy is|are|was|were?, what is|are the weight|mass of, what weight is|has, how much
        do|does""",
    ("trait", "color"): """what|which colour|color|colours|colors is|are|was|were|has|have|do|does, what is|are the
        colour|color|colours|colors of, colour|color of, the colour|color of, how is|are|was colored|coloured""",
    ("trait", "material"): """what|which material|materials is|are|was|were|has|have|do|does, what is|are the
        material|materials of, material of, the material of""",
    ("trait", "shape"): "what|which shape is|are|was|has|have|do|does, what is|are the shape of, the? shape of",
    ("trait", "age"): "how old is|are, what is|are the age of",
    ("trait", "price"): "how expensive|much is|are, what is|are the price|cost|value of",
    ("trait", "brand"): "what|which brand|make is|are, what is|are the brand|make of, who made",
    ("trait", "owner"): "who owns, whose is|are, who is the owner of, who does",
    ("trait", "temperature"): "how hot|warm|cold is|are, what is the temperature of",
    ("average", "height"): "what? is? the? average|mean height of",
    ("average", "width"): "what? is? the? average|mean width|length of",
    ("average", "depth"): "what? is? the? average|mean depth|thickness of",
    ("average", "volume"): "what? is? the? average|mean size|volume of",
    ("distance", ""): """how far away? is|are|was|were?, how far away, how far apart is|are?, how close|near is|are,
        what is the distance between|from|of, the? distance between|from|of, how many metres|meters|feet is|are""",
    ("per scene", "most"): f"in? which|what {_SCENES} has|have|contains|contain|is|are|holds there? the? most|more",
    ("per scene", "fewest"): f"""in? which|what {_SCENES} has|have|contains|contain|is|are|holds there? the?
        fewest|fewer|least""",
    ("scene", ""): f"in? which|what {_SCENES} is|are|has|have|contains|contain|holds|do|does there|i|we|you? find|see?",
    (
        "compare",
        "more",
    ): """is|are there more, do|does|did we|you|it|they have more, have we|you got more, is|are there a
        greater number of, how many more""",
    ("compare", "fewer"): "is|are there fewer|less, do|does we|you|it have fewer|less, how many fewer|less",
    ("compare", "as many"): "is|are there as many, do|does we|you|it have as many, is|are there the same number of",
    ("which more", "more"): "what|which is|are there more|most of, do|does we|you|it have more of",
    ("which more", "fewer"): "what|which is|are there fewer|less|fewest|least of",
}
_EACH_SCENE = f"""in|for|of each|every {_SCENES}, per|by {_SCENES}, in each of the {_SCENES}, {_SCENES} by {_SCENES}"""
_MADE_OF = "made|built|manufactured|constructed of|from|out of?|with?, made"
_THERE = """is|are there, do|does we|you|it|they have, have we|you got"""
_BOUNDS = {
    ">": "more than, over", ">=": "at least, no|not fewer|less than", "<": "fewer|less than, under",
    "<=": "at most, no|not more than, up to", "=": "exactly, just, only",
}  # fmt: skip
_LEFT_OVER = listed(
    "is are was were have has look weigh take up occupy needs need apart there away be tall high cost costs belong to"
)
_POLAR = listed("is are was were does do has have")
_DETERMINERS = listed("the a an any my our your every each all some")
_ASIDE = listed("you we i they one")


def head(found: Sequence[Word]) -> Head | None:
    """The head of a question; None where it asks for things."""
    start = _past_leads(found)
    said = [word for word in found[start:] if word.form not in ("?", "!")]
    while said and said[-1].form in ("please", ".", ","):
        said.pop()
    special = _made_of(said) or _bounded(said) or chosen(said) or sorted_by(said) or all_are(said)
    if special is not None:
        return special
    hit = _heads().at(said, 0)
    if hit is None:
        return None
    length, (form, what) = hit
    rest = said[length:]
    if not rest or (form in ("measure", "trait") and rest[0].form in ("of", "the") and len(rest) == 1):
        return None
    if form == "which more":
        return _of_two(what, rest)
    if form == "compare":
        return _compared(what, rest)
    if form == "distance":
        return _distance(rest)
    if what == "weight" and said[1].form == "much" and rest[-1].form != "weigh":
        if rest[-1].form not in ("cost", "costs"):
            return None  # "how much does ..." may ask anything
        form, what = "trait", "price"
    while rest and form in ("measure", "trait") and rest[-1].form in _LEFT_OVER:
        rest.pop()
    return Head(form=form, what=what, subject=tuple(rest)) if rest else None  # type: ignore[arg-type]


def is_polar(found: Sequence[Word]) -> bool:
    """Whether a question wants a yes or a no: "is the cup on the table?", "are there chairs?"."""
    start = _past_leads(found)
    forms = [word.form for word in found[start : start + 2]]
    return len(forms) == 2 and forms[0] in _POLAR and not (forms[0] in ("do", "have") and forms[1] == "not")


def without_auxiliary(found: Sequence[Word]) -> Sequence[Word]:
    """The words without the "does" of "does the sofa have a pillow on it?", which belongs to its verb."""
    at = _past_leads(found)
    if at + 2 < len(found) and found[at].form in ("does", "do", "did") and found[at + 1].form in _DETERMINERS:
        return (*found[:at], *found[at + 1 :])
    return found


def in_each_scene(found: Sequence[Word]) -> int | None:
    """Where "in each scene" begins that ends the words; None where nothing of the kind does."""
    end = len(found)
    while end and found[end - 1].form in ("?", "!", ".", "please"):
        end -= 1
    for begin in range(max(0, end - 6), end):
        hit = _each_scene().at(found, begin)
        if hit is not None and begin + hit[0] == end:
            return begin
    return None


def _past_leads(found: Sequence[Word]) -> int:
    at = 0
    while at < len(found):
        hit = _leads().at(found, at)
        if found[at].form in (",", '"', ":", "?", "!", "."):
            at += 1
        elif hit is not None:
            at += hit[0]
        else:
            break
    return at


def _bounded(said: Sequence[Word]) -> Head | None:
    """ "Are there more than three chairs?": counted, and compared with that."""
    there = _there().at(said, 0)
    if there is None:
        return None
    bound = _bounds().at(said, there[0])
    length, op = bound if bound is not None else (0, ">=")
    at = there[0] + length
    form = said[at].form if at < len(said) else ""
    number = float(form) if form.isdigit() else NUMBERS.get(form)
    if form in ("a", "an", "half") or number is None or at + 1 >= len(said) or (form == "one" and bound is None):
        return None
    if said[at + 1].form in UNITS or said[at + 1].form == "of":
        return None
    return Head(form="count", what=f"{op} {number:g}", subject=tuple(said[at + 1 :]))


def _made_of(said: Sequence[Word]) -> Head | None:
    """ "What is the sofa made of?"."""
    forms = [word.form for word in said]
    if len(said) < 4 or forms[0] != "what" or forms[1] not in ("is", "are", "was", "were"):
        return None
    for begin in range(max(3, len(said) - 3), len(said)):
        hit = _of_what().at(said, begin)
        if hit is not None and begin + hit[0] == len(said) and begin > 2:
            return Head(form="trait", what="material", subject=tuple(said[2:begin]))
    return None


def _of_two(what: str, rest: Sequence[Word]) -> Head | None:
    """ "What are there more of, chairs or tables?"."""
    kept = [word for word in rest if word.form not in (",", ":", "the", "here", "there") or word is not rest[0]]
    while kept and kept[0].form in (",", ":", "in", "here"):
        kept.pop(0)
    at = next((i for i, word in enumerate(kept) if word.form == "or"), None)
    if not at or at + 1 >= len(kept):
        return None
    return Head(form="compare", what=f"which {what}", subject=tuple(kept[:at]), against=tuple(kept[at + 1 :]))


def _compared(what: str, rest: Sequence[Word]) -> Head | None:
    """ "More chairs than tables", "as many chairs as tables"."""
    at = next((i for i, word in enumerate(rest) if word.form in ("than", "then", "as", "or") and i > 0), None)
    if what == "as many":
        at = at or next((i for i, word in enumerate(rest) if word.form == "and" and i > 0), None)
    if at is None or at + 1 >= len(rest):
        return None
    others = list(rest[at + 1 :])
    while (len(others) > 1 and others[-1].form in ("there", "here")) or (len(others) > 2 and others[-1].form == "are"):
        others.pop()
    while others and others[0].form in ("there", "are"):
        others.pop(0)
    return Head(form="compare", what=what, subject=tuple(rest[:at]), against=tuple(others)) if others else None


def _distance(rest: Sequence[Word]) -> Head | None:
    """ "(How far is) the lamp from the door", "(the distance between) the lamp and the door"."""
    kept = list(rest)
    while kept and (kept[-1].form in _LEFT_OVER or kept[-1].form in _ASIDE):
        kept.pop()
    for split in ("from", "to", "and"):
        at = next((i for i, word in enumerate(kept) if word.form == split and i > 0), None)
        if at is not None and at + 1 < len(kept):
            subject = kept[:at]
            while len(subject) > 1 and subject[-1].form in _LEFT_OVER:
                subject.pop()
            return Head(form="distance", what="distance", subject=tuple(subject), against=tuple(kept[at + 1 :]))
    return Head(form="distance", what="distance", subject=tuple(kept)) if kept else None


@lru_cache(maxsize=1)
def _heads() -> Phrases[tuple[str, str]]:
    return Phrases(_HEADS)


@lru_cache(maxsize=1)
def _leads() -> Phrases[bool]:
    return Phrases({True: _LEADS})


@lru_cache(maxsize=1)
def _each_scene() -> Phrases[bool]:
    return Phrases({True: _EACH_SCENE})


@lru_cache(maxsize=1)
def _of_what() -> Phrases[bool]:
    return Phrases({True: _MADE_OF})


@lru_cache(maxsize=1)
def _there() -> Phrases[bool]:
    return Phrases({True: _THERE})


@lru_cache(maxsize=1)
def _bounds() -> Phrases[str]:
    return Phrases(_BOUNDS)
