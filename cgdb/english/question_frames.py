"""How a clause of a question begins and ends: "how many ... are there", "where can I ...", "please find me ..."."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from cgdb.english import cues
from cgdb.english.intent import Form
from cgdb.english.phrases import Word, listed
from cgdb.meaning.knowledge import knowledge
from cgdb.meaning.lexicon import FUNCTION_WORDS
from cgdb.meaning.words import stem

MARKS = frozenset('.,;:?!()/"')
PURPOSE = "something so that"

_BARE_USES = listed("use take do need try get grab have go now then instead wear")
_PARTICLES = listed("up on off out away down back in")
_OF_NOUNS = listed("this my our your his her their a an the some")
_NO_ORDERS = frozenset(
    ("not", "no", "all", "both", "what", "which", "whose", "like", "than", "such", "half", "many", "there")
)
_WHATEVER = ("wh", "how")
_ASK_BEFORE = listed("how whether if what")
_SPEAKERS = listed("i we my our he she they it there what where who how can could")
_WHOM = listed("me us you him her them someone somebody people one")
_MEALS = listed("breakfast lunch dinner supper dessert brunch snack")


@dataclass(frozen=True, slots=True, kw_only=True)
class Opening:
    """How a clause begins. at: its first word behind that. prefix: what stands for it in the text ("something to").

    use: it is asked what something serves for; bare: without saying for what ("what can I use?"); wish: somebody wants
    to do something, which may be the question or only its reason. seeks: somebody looks for what is named behind it.
    """

    at: int = 0
    form: Form = "find"
    prefix: str = ""
    bare: bool = False
    wish: bool = False
    seeks: bool = False

    @property
    def use(self) -> bool:
        """Whether what is looked for is named by its use."""
        return bool(self.prefix)


def opening(found: Sequence[Word], start: int = 0) -> Opening:
    """Read the beginning of a clause, from word ``start``."""
    at, form, prefix, wish, seeks = start, "find", "", False, False
    while at < len(found):
        if found[at].form in MARKS:
            at += 1
            continue
        hit = cues.frames().at(found, at)
        if hit is None or _cue_is_longer(found, at, hit[0]):
            break
        length, frame = hit
        following = found[at + length].form if at + length < len(found) else None
        if frame in ("lead", "seek"):
            seeks |= frame == "seek"
            # "Is" opens a question only where it is its first word.
            if (found[at].form in ("is", "are") and at > start) or (following is None and length == 1):
                break
        elif frame == "do":
            if prefix or following is None or following in ("not", "a", "an", "the"):
                break
            object_of = found[at + length + 1].form if at + length + 1 < len(found) else ""
            if following in cues.SEEKING and object_of not in {"better", "clearly", "in"} | _ASK_BEFORE:
                length += 1  # "I want to find my keys": the wish says nothing
            else:
                prefix, wish = "something to", True
        elif frame in ("somewhere", "use", "can", "purpose"):
            if prefix or (frame == "can" and following in (None, "be", "not", "i", "we", "you")):
                break
            last = found[at + length - 1].form
            prefix = "somewhere to" if frame == "somewhere" else "something for" if last == "for" else "something to"
            prefix = PURPOSE if frame == "purpose" else prefix
        elif prefix:
            break
        else:
            form = frame
        at += length
    if not prefix and form == "find" and orders(found, at):
        prefix = "something to"  # "trim the hedge" asks for what one trims it with
    left = [word.form for word in found[at:] if word.form not in MARKS]
    if prefix and left[:1] == ["have"] and _MEALS & set(left):
        prefix, at = "something to eat", at + 1  # "what can I have for dinner"
    bare = bool(prefix) and all(word in _BARE_USES for word in left)
    return Opening(at=at, form=form, prefix=prefix, bare=bare, wish=wish, seeks=seeks)  # type: ignore[arg-type]


def without_asides(found: Sequence[Word]) -> tuple[Word, ...]:
    """The words without what is exclaimed before the question ("oh no, ..."), or "for me" in "for me to eat"."""
    at = 0
    while at < len(found):
        if found[at].form in MARKS:
            at += 1
            continue
        hit = cues.interjections().at(found, at)
        following = found[at + hit[0]].form if hit is not None and at + hit[0] < len(found) else ""
        if hit is None or not (following in MARKS or following in _SPEAKERS):
            break
        at += hit[0]
    kept = found[at:]
    skipped = {
        j for i, word in enumerate(kept[:-2]) for j in (i, i + 1) if _for_whom([w.form for w in kept[i : i + 3]])
    }
    return tuple(word for i, word in enumerate(kept) if i not in skipped)


def _for_whom(forms: Sequence[str]) -> bool:
    return forms[0] == "for" and forms[1] in _WHOM and forms[2] == "to"


def orders(found: Sequence[Word], at: int) -> bool:
    """Whether a clause bids to do something ("chuck this away", "heat up my soup"): a verb stands before "this"."""
    forms = [word.form for word in found[at : at + 4]]
    if len(forms) < 3 or not forms[0].isalpha() or forms[0] in FUNCTION_WORDS | cues.SEEKING | _NO_ORDERS:
        return False
    if forms[0].startswith(_WHATEVER):
        return False
    if any(table.at(found, at) for table in (cues.negations(), cues.relations(), cues.frames(), cues.superlatives())):
        return False
    behind = 2 if forms[1] in _PARTICLES else 1
    unknown = forms[1] in ("in", "on") and stem(forms[0]) not in knowledge().doing.verbs
    if behind == 2 and (unknown or knowledge().things_named(forms[0])):
        return False  # "a book on the table", "the telly in my room"
    return forms[behind] in _OF_NOUNS and behind + 1 < len(forms)


def begins_question(found: Sequence[Word], i: int) -> bool:
    """Whether a new question begins at word i, behind a comma: "I spilled it, what can I use?"."""
    while i < len(found) and found[i].form in ("so", "and", "but", ",", "then", "please"):
        i += 1
    hit = cues.frames().at(found, i)
    if hit is None:
        return False
    return hit[1] not in ("lead", "exists") or found[i].form in cues.ASKING


def _cue_is_longer(found: Sequence[Word], at: int, length: int) -> bool:
    """Whether what follows decides, and not the beginning: "it is not", "which is larger than"."""
    denied, compared = cues.negations().at(found, at), cues.comparatives().at(found, at)
    return (denied is not None and bool(denied[1]) and denied[0] > length) or (
        compared is not None and compared[0] > length
    )


def ending(found: Sequence[Word], at: int) -> int:
    """Where a clause ends without what says nothing: "are there", "please", "in this room"."""
    end, again = len(found), True
    while again:
        again = False
        while end > at and found[end - 1].form in MARKS:
            end -= 1
        for begin in range(max(at, end - 5), end):
            hit = cues.tails().at(found, begin)
            if hit is not None and begin + hit[0] == end and begin > at:
                end, again = begin, True
                break
    return end


def state_at_end(found: Sequence[Word], at: int) -> tuple[int, str] | None:
    """(where the clause ends without it, state) of "which doors are open", "the lights that are switched on"."""
    end = len(found)
    if end - at < 2 or found[end - 1].form not in cues.STATES:
        return None
    begin = end - 1
    while begin > at and found[begin - 1].form in cues.STATE_FILLERS:
        begin -= 1
    told = [word.form for word in found[begin:end]]
    said = begin - 1 > at and found[begin - 1].form in ("is", "are")
    asked = at > 0 and found[at - 1].form in ("is", "are") and begin == end - 1
    if not said and not asked and not {"turned", "switched"} & set(told):
        return None
    state = cues.STATES[told[-1]]
    if "not" in told:
        state = cues.OPPOSITE[state]
    if said:
        begin -= 1
        if begin - 1 > at and found[begin - 1].form in ("that", "which"):
            begin -= 1
    return begin, state
