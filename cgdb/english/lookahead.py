"""What the words ahead are, before any is taken: cues, names of rooms, and where the things that a cue names end."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise

from cgdb.english import cues
from cgdb.english.phrases import Phrases, Word, joined, listed, stretch
from cgdb.english.question_frames import MARKS
from cgdb.meaning.knowledge import knowledge
from cgdb.meaning.lexicon import FUNCTION_WORDS

PREVIOUS = "what was found before"
"""The anchor that "it" and "them" stand for in a question that follows up another."""

_WEIGHTLESS = listed("got too very really quite so such any kind sort type of be being at all like as have to with for")
_DANGLING = listed("and or but so is are that which who of a an the there also preferably ideally has have")
_LEFT_OVER = listed("in on at by with from it to")
_PUT = listed(
    """dumped thrown tossed dropped flung chucked slung scattered spread piled heaped crammed squeezed jammed wedged
    stashed packed tucked propped perched balanced nailed screwed bolted taped glued fastened tied strapped planted
    dangling drooping slumped curled sprawled nestled plonked plopped abandoned forgotten lodged poking peeking sticking
    hiding resting lurking folded sunk stored stuck discarded ditched lined fixed hung draped stood sat"""
)
_ANYTHING = listed("anything something everything things stuff")
_GOT = listed("got gets been was were")
_WAYS = listed("over up down out back away off along across round around through")
AREAS = listed("room area zone section department ward bay wing annexe suite hall quarters")
_COUNTS = listed("got all both several many few lots loads")
_BEHIND_WAYS = listed("by near next in on at inside under beside behind against close")
_NO_ANCHOR = listed("and or for with to but is are that which , can i we you")
_AFTER_PLACE = listed("and or but that which is are to for please with what where")
_AND = listed(", or nor and / &")

_USERS = listed("i we you one people")
_BEFORE = listed("it them there")
_THAT = listed("that this these those it them")
_ONES = listed("one ones thing things object objects")


class Lookahead:
    """A clause and what has been taken of it: ``_words`` ends with the clause, ``_wanted`` is what is left so far."""

    def __init__(self, text: str, found: list[Word], places: Phrases[bool], *, previous: bool) -> None:
        """places: names of rooms; previous: there is something that "it" may mean."""
        self._text = text
        self._words = found
        self._places = places
        self._previous = previous
        self._prefix = ""
        self._wanted: list[Word] = []

    def _past_connectors(self, i: int) -> int:
        """Where a cue would begin behind "and it is", "that is standing"; i where there is nothing of the kind."""
        j = i
        while j < len(self._words):
            if self._words[j].form == "," and j == i:
                j += 1
            elif (hit := cues.connectors().at(self._words, j)) is not None:
                j += hit[0]
            elif self._words[j].form in cues.PARTICIPLES or self._placed(j) or self._way(j):
                j += 1
            else:
                break
        return j if j < len(self._words) else i

    def _placed(self, j: int) -> bool:
        """Whether a word says how something has been put where a relation says: "dumped on the bed"."""
        if self._form_at(j) in _GOT:
            return self._form_at(j + 1) in _PUT | cues.PARTICIPLES  # "the cup that got left on the table"
        return self._form_at(j) in _PUT and cues.relations().at(self._words, j + 1) is not None

    def _way(self, j: int) -> bool:
        """Whether a word only points the way to a relation or a place: "over by the door", "up on the wardrobe"."""
        if self._form_at(j) not in _WAYS or self._form_at(j + 1) not in _BEHIND_WAYS:
            return False
        hit = cues.relations().at(self._words, j)
        return hit is None or hit[0] == 1

    def _form_at(self, i: int) -> str:
        return self._words[i].form if i < len(self._words) else ""

    def _negation(self, i: int) -> tuple[int, str] | None:
        hit = cues.negations().at(self._words, i)
        return hit if hit is not None and hit[1] else None

    def _excluded_end(self, i: int) -> int:
        """Where what is excluded ends: at the next cue, at a place, or where the sentence takes up again."""
        for j in range(i + 1, len(self._words)):
            at = self._past_connectors(j)
            if any(self._negation(k) is not None or self._strong(k) for k in (j, at)) or self._place(j) is not None:
                return j
            if at > j and cues.relations().at(self._words, at) is not None:
                return j  # "which are on the table" is said of what is wanted
            if self._form_at(j) in (",", "but") and self._takes_up(j):
                return j
            if self._form_at(j) in ("to", "for") and not self._prefix and all_generic(self._trimmed(self._wanted)):
                return j  # "anything but a knife to cut bread"
            if self._form_at(j) == "," and (self._inserted(i, j) or self._corrects(j)):
                return j
        return max(i, len(self._words))

    def _corrects(self, j: int) -> bool:
        """Whether what is wanted is said behind what is not: "not the red one, the blue cup"."""
        rest = {word.form for word in self._words[j + 1 :]}
        return not self._wanted and self._form_at(j + 1) in ("a", "an", "the", "some") and not rest & _AND

    def _inserted(self, begin: int, end: int) -> bool:
        """Whether what is excluded is a word thrown in: "a red, not blue, chair"."""
        rest = {word.form for word in self._words[end + 1 :]}
        return bool(rest) and not rest & _AND and only_traits(stretch(self._text, self._words[begin:end]))

    def _takes_up(self, i: int) -> bool:
        if self._form_at(i) == "but":
            return True
        if self._wanted:
            return False
        hit = cues.frames().at(self._words, i + 1)
        return (hit is not None and (hit[1] != "lead" or hit[0] > 1)) or self._form_at(i + 1) in cues.GENERIC

    def _listed(self, begin: int, end: int) -> list[list[Word]]:
        """The members of "a puzzle, a ball or colorful"; "red and white" is one."""
        parts: list[list[Word]] = [[]]
        for word in self._words[begin:end]:
            if word.form in _AND and not (word.form == "and" and only_traits(joined(self._text, parts[-1]))):
                parts.append([])
            else:
                parts[-1].append(word)
        return [part for part in parts if part]

    def _bare_text(self, part: Sequence[Word]) -> str:
        """What is excluded, without articles and "too", "very", "kind of"."""
        kept = list(part)
        while kept and (kept[0].form in cues.STARTERS or kept[0].form in _WEIGHTLESS):
            kept.pop(0)
        if len(kept) == 2 and kept[0].form in _ANYTHING:
            kept.pop(0)  # "anything sweet"
        while kept and kept[-1].form in cues.TRAILING:
            kept.pop()
        return stretch(self._text, kept)

    def _place(self, i: int) -> tuple[int, str] | None:
        """(words, name) of "in the kitchen" at word i."""
        if self._form_at(i) not in ("in", "inside", "from", "within", "at", "of"):
            return None
        if i > 0 and self._form_at(i - 1) in ("used", "useful", "needed", "worn"):
            return None
        j = i + 1
        while self._form_at(j) in cues.STARTERS:
            j += 1
        end = self._room_end(j)
        if end is None:
            return None
        # "In the office chair" speaks of a chair.
        closed = end >= len(self._words) or self._form_at(end) in MARKS | _AFTER_PLACE or self._cue_at(end)
        return (end - i, stretch(self._text, self._words[j:end])) if closed else None

    def _room_end(self, i: int) -> int | None:
        """Where the name of a room ends that begins at word i."""
        hits = [hit[0] for table in (self._places, cues.rooms()) if (hit := table.at(self._words, i))]
        if not hits:
            return self._area_end(i)
        end = i + max(hits)
        return end + 1 if self._form_at(end).isdigit() else end

    def _area_end(self, i: int) -> int | None:
        """Where "waiting area", "front desk area" or "boiler room" ends: a part of the place that has no other name."""
        for end in range(i + 2, min(i + 4, len(self._words)) + 1):
            form = self._form_at(end - 1)
            if form in AREAS or cues.rooms().only(form):
                return end  # "the kids' bedroom"
            if form in FUNCTION_WORDS or self._form_at(end - 2) in _NO_ANCHOR:
                return None
        return None

    def _strong(self, i: int) -> bool:
        """Whether a relation begins at word i that hardly ever belongs to a verb."""
        hit = cues.relations().at(self._words, i)
        return hit is not None and i + hit[0] < len(self._words) and not (hit[0] == 1 and self._form_at(i) in cues.WEAK)

    def _cue_at(self, i: int) -> bool:
        at = self._past_connectors(i)
        tables = (cues.negations(), cues.relations(), cues.comparatives(), cues.superlatives(), cues.belongings())
        return any(table.at(self._words, at) is not None for table in tables)

    def _locates(self, begin: int, length: int) -> bool:
        """Whether a relation says where the wanted thing is, and not how it is used or what is done to it."""
        following = self._form_at(begin + length)
        if not following or following in MARKS or following in _NO_ANCHOR or following.isdigit():
            return False
        if not self._uses():
            return True
        weak = length == 1 and self._form_at(begin) in cues.WEAK
        placing = any(word.form in cues.PLACING for word in self._wanted)
        return not weak and not placing and bool(self._wanted)

    def _uses(self) -> bool:
        return bool(self._prefix) or says_use(self._wanted)

    def _things(self, begin: int) -> tuple[tuple[str, ...], int]:
        """What the words from here name, and where they end: at the next cue. "A table and the wall" is two things."""
        end = begin
        while end < len(self._words) and not (end > begin and self._closes(end)):
            end += 1
        parts: list[list[Word]] = [[]]
        for word in self._words[begin:end]:
            if word.form == "," or (word.form == "and" and not only_traits(joined(self._text, parts[-1]))):
                parts.append([])
            else:
                parts[-1].append(word)
        names = (self._thing(part) for part in parts if part)
        return tuple(dict.fromkeys(name for name in names if name is not None)), end

    def _thing(self, part: list[Word]) -> str | None:
        if stretch(self._text, part).casefold() in cues.EACH_OTHER:
            return ""
        kept = list(part)
        if self._previous and kept and kept[0].form in _THAT and all(word.form in _ONES for word in kept[1:]):
            return PREVIOUS
        while kept and (kept[0].form in cues.STARTERS or (kept[0].form in _COUNTS and len(kept) > 1)):
            kept.pop(0)
        while len(kept) > 1 and kept[-1].form in _PUT | cues.PARTICIPLES:
            kept.pop()
        text = stretch(self._text, kept)
        if text.casefold() in _BEFORE:
            return PREVIOUS if self._previous else None
        return text if text and text.casefold() not in cues.PRONOUNS else None

    def _closes(self, j: int) -> bool:
        """Whether what a relation names ends before word j."""
        if self._form_at(j) == ",":
            return self._cue_at(j + 1)
        at = self._past_connectors(j)
        if (at > j and self._cue_at(at)) or self._place(j) is not None or self._negation(j) is not None:
            return True
        if cues.comparatives().at(self._words, j) is not None:
            return True
        has = cues.belongings().at(self._words, at)
        if has is not None and self._back_reference(at + has[0]) is not None:
            return True  # "the sofa | with a lamp on it"
        hit = cues.relations().at(self._words, j)
        following = "" if hit is None else self._form_at(j + hit[0])
        return bool(following) and following not in _NO_ANCHOR

    def _back_reference(self, after: int) -> tuple[int, int, str] | None:
        """(begin, end, relation) of "on it" in "with a lamp on it"; after: the first word behind "with"."""
        for j in range(after + 1, min(after + 9, len(self._words))):
            if self._negation(j) is not None:
                return None
            back = cues.back_references().at(self._words, j)
            if back is not None and self._form_at(j + back[0]) not in cues.STARTERS:
                return j, j + back[0], back[1]
        return None

    def _names_between(self, begin: int, end: int) -> tuple[str, ...]:
        names = (self._thing(part) for part in self._listed(begin, end))
        return tuple(name for name in names if name)

    def _trimmed(self, found: Sequence[Word]) -> list[Word]:
        kept = list(found)
        while kept and (kept[0].form in MARKS or kept[0].form in cues.STARTERS or kept[0].form in ("of", "and", "all")):
            kept.pop(0)
        dangling = _DANGLING if self._prefix or says_use(kept) else _DANGLING | _LEFT_OVER
        while kept and (kept[-1].form in MARKS or kept[-1].form in dangling):
            kept.pop()
        return kept


def all_generic(found: Sequence[Word]) -> bool:
    return all(word.form in cues.GENERIC for word in found)


def says_use(found: Sequence[Word]) -> bool:
    """Whether words name a thing by what it is for: "something to sit on", "a tool that can cut"."""
    forms = [word.form for word in found]
    if any(form in cues.GENERIC for form in forms[:4]) and cues.USE_MARKS & set(forms[1:]):
        return True
    said = [form for form in forms[1:] if form not in _USERS]
    return any(a == "to" or (a in ("that", "which") and b in ("can", "could")) for a, b in pairwise(said))


def only_traits(text: str) -> bool:
    """Whether a text names properties and no thing ("red and white")."""
    return bool(text) and knowledge().facets(text).form == "traits"
