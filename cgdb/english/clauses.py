"""One clause of a question, read from left to right: each cue takes what belongs to it, the rest is what is wanted."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

from cgdb.english import cues, question_measures
from cgdb.english.intent import Asked, First, Located, Measured
from cgdb.english.lookahead import Lookahead, all_generic, only_traits, says_use
from cgdb.english.needs import is_story, remedy
from cgdb.english.phrases import Phrases, Word, joined, stretch
from cgdb.english.question_frames import MARKS, PURPOSE, ending, opening, state_at_end
from cgdb.meaning.knowledge import knowledge
from cgdb.meaning.lexicon import DEPICTIONS, FUNCTION_WORDS
from cgdb.meaning.words import stem


@dataclass(frozen=True, slots=True, kw_only=True)
class Clause:
    """A clause as it was read. story: it tells of somebody; remedy: what would help there; bare: it says no use.

    wish: somebody wants to do something, which may be the question or only its reason.
    """

    asked: Asked
    story: bool = False
    remedy: str | None = None
    bare: bool = False
    wish: bool = False


_THE_ONE = frozenset(("the", "one", "ones", "that", "those", "these", "any", "is", "are", "up", "down"))
_SOME = frozenset(("one", "ones", "any"))
_WHOSE = frozenset(("my", "our", "his", "her", "their"))
_JOINED = frozenset((",", "and", "but", ";", ":"))


def read(text: str, found: Sequence[Word], places: Phrases[bool], *, previous: bool = False) -> Clause | None:
    """Take one clause apart; None where nothing is left of it. places: names of rooms; previous: "it" is known."""
    kept = [word for word in found if word.form not in ('"', "(", ")")]
    return _Reader(text, kept, places, previous=previous).read()


class _Reader(Lookahead):
    """Reads words from ``_at`` on."""

    def __init__(self, text: str, found: list[Word], places: Phrases[bool], *, previous: bool) -> None:
        super().__init__(text, found, places, previous=previous)
        self._all = found
        self._opening = opening(found)
        self._at = self._opening.at
        self._words = found[: ending(found, self._at)]
        self._prefix = self._opening.prefix
        self._form = self._opening.form
        self._excluded: list[str] = []
        self._located: list[Located] = []
        self._inside: list[str] = []
        self._outside: list[str] = []
        self._measured: list[Measured] = []
        self._first: First | None = None
        self._state: str | None = None
        self._after_anchor = -1

    def read(self) -> Clause | None:
        forms = [word.form for word in self._all]
        tired = any((hit := cues.negations().at(self._all, i)) and hit[1] == "dislike" for i in range(len(forms)))
        begins = self._opening
        named = begins.seeks or (forms[0] in _WHOSE and bool(knowledge().things_named(" ".join(forms[1:]))))
        # "I'm sick of magazines" tells of no illness, "I seem to remember a red cup" of nothing to be noted down.
        helps = None if tired or begins.seeks else remedy(forms)
        told = helps is not None or (
            begins.at == 0 and not named and is_story(forms) and not cues.negations().at(self._all, 0)
        )
        story = told and begins.form == "find" and not begins.use
        state = state_at_end(self._words, self._at)
        self._state = None if state is None else state[1]
        if state is not None:
            self._words = self._words[: state[0]]
        if self._prefix == PURPOSE:
            # "So that nobody hears us" is one thing, whatever it denies.
            self._wanted, self._at = list(self._words[self._at :]), len(self._words)
        while self._at < len(self._words):
            self._step()
        asked = self._asked(self._state)
        if not begins.bare and not story and asked == Asked(use=asked.use):
            return None
        if story:
            # "I can't stand the noise" tells of the noise, and excludes nothing.
            kept = tuple(text for text in asked.excluded if remedy(["i", *text.casefold().split()]) is None)
            asked = replace(asked, excluded=kept)
        return Clause(asked=asked, story=story, remedy=helps, bare=begins.bare or not asked.wanted, wish=begins.wish)

    def _asked(self, state: str | None) -> Asked:
        wanted, use = self._wanted_text()
        with_state = f"{wanted} that is {state}" if state is not None else ""
        kept = self._trimmed(self._wanted)
        if state is None and len(kept) > 1 and kept[0].form in cues.STATE_ADJECTIVES and not self._prefix:
            # "Closed cupboards", by the state where the map holds it, else by these words.
            state, with_state, wanted = cues.STATES[kept[0].form], wanted, joined(self._text, kept[1:])
        first = self._first
        number = question_measures.counted(kept[0].form) if len(kept) > 1 else 0
        if first is not None and not first.count and number:
            first, kept = replace(first, count=number), kept[1:]  # "the two chairs closest to the door"
            wanted = joined(self._text, kept)
        form = self._form
        if form == "room" and kept and kept[0].form == "most":
            form, wanted = "per room", joined(self._text, kept[1:])
        return Asked(
            form=form,
            wanted=wanted,
            use=use,
            excluded=tuple(dict.fromkeys(self._excluded)),
            located=tuple(self._located),
            places=tuple(self._inside),
            not_places=tuple(self._outside),
            measured=tuple(self._measured),
            first=None if first is None else replace(first, single=not _plural(kept)),
            state=state,
            with_state=with_state,
        )

    # -- one step -----------------------------------------------------------------------------------------------

    def _step(self) -> None:
        """Read one piece: a cue with what belongs to it, or a word of what is wanted."""
        verb_follows = bool(self._wanted) and self._wanted[-1].form in cues.BEFORE_VERBS
        behind = self._negation(self._at)
        if behind is not None and behind[1] == "behind" and self._read_negation(self._at):
            return
        start = self._at if verb_follows else self._past_connectors(self._at)
        for begin in dict.fromkeys((start, self._at)):
            if (
                self._read_each_room(begin)
                or self._read_measure(begin)
                or self._read_first(begin)
                or self._read_negation(begin)
                or self._read_with(begin)
                or self._read_place(begin)
                or self._read_relation(begin, connected=begin > self._at)
            ):
                return
        if not self._wanted and self._resumes():
            return
        word = self._words[self._at]
        without = _without(word.form)
        if without is not None:
            self._excluded.append(without)
        elif self._wanted or word.form not in MARKS:
            self._wanted.append(word)
        self._at += 1

    def _resumes(self) -> bool:
        """ "Other than a chair, what can I sit on?": the question begins only now."""
        if self._prefix or not (self._excluded or self._inside or self._measured):
            return False
        before = self._at
        while self._at < len(self._words) and self._words[self._at].form in (",", "but", "and"):
            self._at += 1
        begins = opening(self._words, self._at)
        self._at, self._prefix = begins.at, begins.prefix
        if begins.form != "find":
            self._form = begins.form
        return self._at > before

    # -- exclusion ----------------------------------------------------------------------------------------------

    def _read_negation(self, begin: int) -> bool:
        hit = cues.negations().at(self._words, begin)
        if hit is None:
            return False
        length, how = hit
        near = cues.relations().at(self._words, begin)
        if near is not None and near[0] > length:
            return False  # "not far from"
        if how == "omit" and not (self._wanted and self._form_at(begin - 1) in _JOINED):
            return False  # "hold the bar still" excludes nothing, unlike "a hot drink, hold the milk"
        if not how:
            self._wanted.extend(self._words[begin : begin + length])
            self._at = begin + length
            return True
        after = begin + length
        if how == "behind":
            self._excluded.append(self._said_behind())
            self._at = after
            return True
        # "That does not stand at a table" speaks of where it is, unlike "who cannot stand noise".
        stands = how == "deny" and self._past_connectors(after) > after
        stands |= self._form_at(after - 1) == "stand" and cues.relations().at(self._words, after) is not None
        if (how == "kind" or stands) and self._read_negated_place(after):
            return True
        end = self._excluded_end(after)
        if self._form_at(begin) == "nor" and not self._wanted and end >= len(self._words):
            end = self._nor_ends(after, end)
        texts = [text for part in self._listed(after, end) if (text := self._of_these(part))]
        texts = [text for text in texts if not FUNCTION_WORDS.issuperset(text.casefold().split())]  # "not in there"
        if self._state is None and how in ("kind", "deny") and len(texts) == 1 and (state := _said_state(texts[0])):
            self._state, texts = cues.OPPOSITE[state], []  # "that is not switched on"
        if how in ("kind", "deny") and (subject := self._taken_back(self._form_at(begin))):
            texts = [f"{subject} {text}" for text in texts]
        self._excluded.extend(texts)
        self._at = end
        if how == "instead" and texts and self._prefix and not self._wanted and end >= len(self._words):
            # "What can I use instead of a hammer?": what does the same.
            self._prefix = f"something to use like a {texts[0]}"
        return True

    def _of_these(self, part: Sequence[Word]) -> str:
        """What is excluded, "the red one" being what is red: "red chair" would exclude the other chairs a little."""
        text = self._bare_text(part)
        bare, _, last = text.rpartition(" ")
        return bare if bare and last.casefold() in ("one", "ones") else text

    def _nor_ends(self, begin: int, end: int) -> int:
        """Where what is excluded ends in "neither red nor blue cups": before the cups, which are wanted."""
        if not self._excluded or not all(map(only_traits, self._excluded)):
            return end
        traits = (j for j in range(end - 1, begin, -1) if only_traits(stretch(self._text, self._words[begin:j])))
        return next(traits, end)

    def _taken_back(self, cue: str) -> str:
        """The subject of "clothes that my son must not wear", taken out of what is wanted."""
        at = max((i for i, word in enumerate(self._wanted) if word.form in ("that", "which")), default=-1)
        modal = bool(self._wanted) and self._wanted[-1].form in cues.MODALS
        if at <= 0 or at + 1 == len(self._wanted) or not (modal or cue in cues.MODALS):
            return ""
        subject = self._bare_text(self._wanted[at + 1 : len(self._wanted) - modal])
        del self._wanted[at:]
        return subject

    def _said_behind(self) -> str:
        """What "a vase is not an option" is about, taken out of what is wanted."""
        at = max((i for i, word in enumerate(self._wanted) if word.form in (",", "but", "and")), default=-1)
        subject = self._bare_text(self._wanted[at + 1 :])
        del self._wanted[max(at, 0) :]
        return subject

    def _read_negated_place(self, i: int) -> bool:
        """ "Not on the table", "not in the kitchen", "other than the one by the door"."""
        begin = i
        head = self._wanted[-1].form if self._wanted else ""
        while self._form_at(i) in _THE_ONE or (self._form_at(i) == "of" and self._form_at(i - 1) in _SOME):
            i += 1
        if i > begin and head and self._form_at(i) == head:
            i += 1  # "a chair, not the chair by the window"
        the_one = any(word.form in ("the", "one", "ones", "those", head) for word in self._words[begin:i])
        i = self._past_connectors(i)
        rooms, relations = len(self._inside), len(self._located)
        if self._read_place(i):
            self._outside.extend(self._inside[rooms:])
            del self._inside[rooms:]
            return True
        if self._uses() and not self._strong(i):
            # "To sit on, but not on a chair" excludes chairs, not what stands on them.
            hit = cues.relations().at(self._words, i)
            if hit is None or i + hit[0] >= len(self._words):
                return False
            end = self._excluded_end(i + hit[0])
            self._excluded.extend(text for part in self._listed(i + hit[0], end) if (text := self._bare_text(part)))
            self._at = end
            return True
        if self._read_relation(i, connected=True):
            denied = [replace(one, negated=True, the_one=the_one) for one in self._located[relations:]]
            self._located[relations:] = denied
            return True
        return False

    # -- places -------------------------------------------------------------------------------------------------

    def _read_place(self, begin: int) -> bool:
        hit = self._place(begin)
        if hit is None:
            return False
        self._inside.append(hit[1])
        self._at = begin + hit[0]
        while self._form_at(self._at) in ("or", "and"):
            j = self._at + 1
            while self._form_at(j) in ("in", "inside") or self._form_at(j) in cues.STARTERS:
                j += 1
            end = self._room_end(j)
            if end is None:
                break
            self._inside.append(stretch(self._text, self._words[j:end]))
            self._at = end
        return True

    def _read_each_room(self, begin: int) -> bool:
        """ "How many chairs are in each room"."""
        hit = cues.each_room().at(self._words, begin)
        if hit is None or self._form != "count":
            return False
        self._form, self._at = "per room", begin + hit[0]
        return True

    # -- relations ----------------------------------------------------------------------------------------------

    def _read_relation(self, begin: int, *, connected: bool) -> bool:
        hit = cues.relations().at(self._words, begin)
        if hit is None or not self._locates(begin, hit[0]):
            return False
        anchors, end = self._things(begin + hit[0])
        if not anchors:
            return False
        chained = bool(self._located) and not connected and not self._located[-1].inverse
        text = stretch(self._text, self._words[begin:end])
        self._located.append(Located(name=hit[1], anchors=anchors, text=text, chained=chained))
        self._at = self._after_anchor = end
        return True

    def _read_with(self, begin: int) -> bool:
        """ "With a lamp on it", "that has books inside"."""
        hit = cues.belongings().at(self._words, begin)
        if hit is None or not (self._wanted or self._located):
            return False
        back = self._back_reference(begin + hit[0])
        anchors = self._names_between(begin + hit[0], back[0]) if back is not None else ()
        if back is None or not anchors:
            return False
        text = stretch(self._text, self._words[begin : back[1]])
        # "On the desk that has a lamp on it": it may be the desk that has one.
        chained = bool(self._located) and not self._located[-1].inverse and self._at == self._after_anchor
        self._located.append(Located(name=back[2], anchors=anchors, text=text, inverse=True, chained=chained))
        self._at = back[1]
        return True

    # -- sizes and orders ---------------------------------------------------------------------------------------

    def _read_measure(self, begin: int) -> bool:
        found = question_measures.measured(self._text, self._words, begin, self._things)
        if found is None:
            return False
        self._measured.extend(found[0])
        self._at = found[1]
        return True

    def _read_first(self, begin: int) -> bool:
        if self._first is not None:
            return False
        found = question_measures.first(self._text, self._words, begin, self._things)
        if found is None:
            return False
        self._first, self._at, (start, end) = found
        del self._words[start:end]
        return True

    # -- what is wanted -----------------------------------------------------------------------------------------

    def _wanted_text(self) -> tuple[str, bool]:
        """What is wanted, empty where anything will do, and whether it is named by its use."""
        kept = self._trimmed(self._wanted)
        text = joined(self._text, kept)
        if self._prefix:
            alone = self._opening.bare and not self._prefix.startswith("something to use like")
            return ("", True) if alone else (self._with_prefix(kept), True)
        if kept and kept[0].form in ("to", "for"):
            return f"something {text}", True
        return ("", False) if all_generic(kept) else (_by_use(text), says_use(kept))

    def _with_prefix(self, kept: Sequence[Word]) -> str:
        """ "I want to sit on something soft" asks for something soft to sit on."""
        at = next((i for i, word in enumerate(kept) if word.form in ("something", "anything")), None)
        if at is None or not self._prefix.startswith("something "):
            return f"{self._prefix} {joined(self._text, kept)}".strip()
        how = self._prefix.removeprefix("something ")
        parts = ("something", joined(self._text, kept[at + 1 :]), how, joined(self._text, kept[:at]))
        return " ".join(part for part in parts if part)


def _by_use(text: str) -> str:
    """ "A bite to eat", "a thingy to hang coats on": by the use, where nobody knows such a thing by its name."""
    named, to, use = text.partition(" to ")
    verb = use.split(" ", 1)[0].casefold()
    unknown = to and named.isascii() and knowledge().facets(named).form == "name" and len(named.split()) < 4
    return f"something to {use}" if unknown and stem(verb) in knowledge().doing.verbs else text


def depicts(text: str) -> bool:
    """Whether a text names a picture of something: what is on something may be so in the picture only."""
    return any(a in DEPICTIONS and b in ("of", "showing", "with") for a, b in pairwise(text.casefold().split()))


def _said_state(text: str) -> str | None:
    """The state of "switched on", "open"; None of any other text."""
    *before, last = text.casefold().split()
    if last == "running" or not all(word in cues.STATE_FILLERS for word in before):
        return None  # shoes "that are not for running"
    return cues.STATES.get(last)


def _without(form: str) -> str | None:
    """What a word says is not there: "non-alcoholic", "sugar-free"."""
    if form.startswith("non-") and len(form) > 6:
        return form.removeprefix("non-")
    return form.removesuffix("-free") if form.endswith("-free") and len(form) > 6 and form != "hands-free" else None


def _plural(found: Sequence[Word]) -> bool:
    last = found[-1].form if found else ""
    return len(last) > 3 and last.endswith("s") and not last.endswith(("ss", "us", "is"))
