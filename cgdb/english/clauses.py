"""One clause of a question, read from left to right: each cue takes what belongs to it, the rest is what is wanted."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

from cgdb.english import cues, question_measures
from cgdb.english.intent import Asked, First, Located, Measured
from cgdb.english.needs import is_story, remedy
from cgdb.english.phrases import Phrases, Word, joined, listed, stretch
from cgdb.english.question_frames import MARKS, ending, opening, state_at_end
from cgdb.meaning.knowledge import knowledge
from cgdb.meaning.lexicon import DEPICTIONS

_WEIGHTLESS = listed("too very really quite so such any kind sort type of be being at all like as have to with for")
_DANGLING = listed("and or but is are that which who of a an the there also preferably ideally has have")
_LEFT_OVER = listed("in on at by with from it to")
_NO_ANCHOR = listed("and or for with to but is are that which , can i we you")
_AFTER_PLACE = listed("and or but that which is are to for please with what where")
_AND = listed(", or nor and / &")


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


def read(text: str, found: Sequence[Word], places: Phrases[bool]) -> Clause | None:
    """Take one clause apart; None where nothing is left of it. places: names of rooms."""
    return _Reader(text, [word for word in found if word.form not in ('"', "(", ")")], places).read()


class _Reader:
    """Reads words from ``_at`` on; ``_words`` ends where the clause does."""

    def __init__(self, text: str, found: list[Word], places: Phrases[bool]) -> None:
        self._text = text
        self._all = found
        self._opening = opening(found)
        self._at = self._opening.at
        self._words = found[: ending(found, self._at)]
        self._places = places
        self._prefix = self._opening.prefix
        self._form = self._opening.form
        self._wanted: list[Word] = []
        self._excluded: list[str] = []
        self._located: list[Located] = []
        self._inside: list[str] = []
        self._outside: list[str] = []
        self._measured: list[Measured] = []
        self._first: First | None = None

    def read(self) -> Clause | None:
        forms = [word.form for word in self._all]
        helps = remedy(forms)
        begins = self._opening
        told = helps is not None or (begins.at == 0 and is_story(forms) and not cues.negations().at(self._all, 0))
        story = told and begins.form == "find" and not begins.use
        state = state_at_end(self._words, self._at)
        if state is not None:
            self._words = self._words[: state[0]]
        while self._at < len(self._words):
            self._step()
        asked = self._asked(None if state is None else state[1])
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
            first=None if self._first is None else replace(self._first, single=not _plural(kept)),
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

    def _past_connectors(self, i: int) -> int:
        """Where a cue would begin behind "and it is", "that is standing"; i where there is nothing of the kind."""
        j = i
        while j < len(self._words):
            if self._words[j].form == "," and j == i:
                j += 1
            elif (hit := cues.connectors().at(self._words, j)) is not None:
                j += hit[0]
            elif self._words[j].form in cues.PARTICIPLES:
                j += 1
            else:
                break
        return j if j < len(self._words) else i

    def _form_at(self, i: int) -> str:
        return self._words[i].form if i < len(self._words) else ""

    # -- exclusion ----------------------------------------------------------------------------------------------

    def _negation(self, i: int) -> tuple[int, str] | None:
        hit = cues.negations().at(self._words, i)
        return hit if hit is not None and hit[1] else None

    def _read_negation(self, begin: int) -> bool:
        hit = cues.negations().at(self._words, begin)
        if hit is None:
            return False
        length, how = hit
        near = cues.relations().at(self._words, begin)
        if near is not None and near[0] > length:
            return False  # "not far from"
        if not how:
            self._wanted.extend(self._words[begin : begin + length])
            self._at = begin + length
            return True
        after = begin + length
        if how == "behind":
            self._excluded.append(self._said_behind())
            self._at = after
            return True
        if how == "kind" and self._read_negated_place(after):
            return True
        end = self._excluded_end(after)
        texts = [text for part in self._listed(after, end) if (text := self._bare_text(part))]
        if how in ("kind", "deny") and (subject := self._taken_back(self._form_at(begin))):
            texts = [f"{subject} {text}" for text in texts]
        self._excluded.extend(texts)
        self._at = end
        if how == "instead" and texts and self._prefix and not self._wanted and end >= len(self._words):
            # "What can I use instead of a hammer?": what does the same.
            self._prefix = f"something to use like a {texts[0]}"
        return True

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
        while self._form_at(i) in ("the", "one", "ones", "that", "those", "is", "are"):
            i += 1
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
            self._located[relations:] = [replace(one, negated=True) for one in self._located[relations:]]
            return True
        return False

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
            if self._form_at(j) in ("to", "for") and not self._prefix and _all_generic(self._trimmed(self._wanted)):
                return j  # "anything but a knife to cut bread"
            if self._form_at(j) == "," and self._inserted(i, j):
                return j
        return max(i, len(self._words))

    def _inserted(self, begin: int, end: int) -> bool:
        """Whether what is excluded is a word thrown in: "a red, not blue, chair"."""
        rest = {word.form for word in self._words[end + 1 :]}
        return bool(rest) and not rest & _AND and _only_traits(stretch(self._text, self._words[begin:end]))

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
            if word.form in _AND and not (word.form == "and" and _only_traits(joined(self._text, parts[-1]))):
                parts.append([])
            else:
                parts[-1].append(word)
        return [part for part in parts if part]

    def _bare_text(self, part: Sequence[Word]) -> str:
        """What is excluded, without articles and "too", "very", "kind of"."""
        kept = list(part)
        while kept and (kept[0].form in cues.STARTERS or kept[0].form in _WEIGHTLESS):
            kept.pop(0)
        while kept and kept[-1].form in cues.TRAILING:
            kept.pop()
        return stretch(self._text, kept)

    # -- places -------------------------------------------------------------------------------------------------

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
            return None
        end = i + max(hits)
        return end + 1 if self._form_at(end).isdigit() else end

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

    def _strong(self, i: int) -> bool:
        """Whether a relation begins at word i that hardly ever belongs to a verb."""
        hit = cues.relations().at(self._words, i)
        return hit is not None and i + hit[0] < len(self._words) and not (hit[0] == 1 and self._form_at(i) in cues.WEAK)

    def _cue_at(self, i: int) -> bool:
        at = self._past_connectors(i)
        tables = (cues.negations(), cues.relations(), cues.comparatives(), cues.superlatives(), cues.belongings())
        return any(table.at(self._words, at) is not None for table in tables)

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
        self._at = end
        return True

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
        return bool(self._prefix) or _says_use(self._wanted)

    def _things(self, begin: int) -> tuple[tuple[str, ...], int]:
        """What the words from here name, and where they end: at the next cue. "A table and the wall" is two things."""
        end = begin
        while end < len(self._words) and not (end > begin and self._closes(end)):
            end += 1
        parts: list[list[Word]] = [[]]
        for word in self._words[begin:end]:
            if word.form == "," or (word.form == "and" and not _only_traits(joined(self._text, parts[-1]))):
                parts.append([])
            else:
                parts[-1].append(word)
        names = (self._thing(part) for part in parts if part)
        return tuple(dict.fromkeys(name for name in names if name is not None)), end

    def _thing(self, part: list[Word]) -> str | None:
        if stretch(self._text, part).casefold() in cues.EACH_OTHER:
            return ""
        kept = list(part)
        while kept and kept[0].form in cues.STARTERS:
            kept.pop(0)
        text = stretch(self._text, kept)
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
        hit = cues.relations().at(self._words, j)
        following = "" if hit is None else self._form_at(j + hit[0])
        return bool(following) and following not in _NO_ANCHOR

    def _read_with(self, begin: int) -> bool:
        """ "With a lamp on it", "that has books inside"."""
        hit = cues.belongings().at(self._words, begin)
        if hit is None or not (self._wanted or self._located):
            return False
        after = begin + hit[0]
        for j in range(after + 1, min(after + 9, len(self._words))):
            if self._negation(j) is not None:
                return False
            back = cues.back_references().at(self._words, j)
            if back is not None and self._form_at(j + back[0]) not in cues.STARTERS:
                anchors = self._names_between(after, j)
                if not anchors:
                    return False
                text = stretch(self._text, self._words[begin : j + back[0]])
                self._located.append(Located(name=back[1], anchors=anchors, text=text, inverse=True))
                self._at = j + back[0]
                return True
        return False

    def _names_between(self, begin: int, end: int) -> tuple[str, ...]:
        names = (self._thing(part) for part in self._listed(begin, end))
        return tuple(name for name in names if name)

    # -- sizes and orders ---------------------------------------------------------------------------------------

    def _read_measure(self, begin: int) -> bool:
        found = question_measures.measured(self._text, self._words, begin, self._things)
        if found is None:
            return False
        self._measured.append(found[0])
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

    def _trimmed(self, found: Sequence[Word]) -> list[Word]:
        kept = list(found)
        while kept and (kept[0].form in MARKS or kept[0].form in cues.STARTERS or kept[0].form in ("of", "and", "all")):
            kept.pop(0)
        dangling = _DANGLING if self._prefix or _says_use(kept) else _DANGLING | _LEFT_OVER
        while kept and (kept[-1].form in MARKS or kept[-1].form in dangling):
            kept.pop()
        return kept

    def _wanted_text(self) -> tuple[str, bool]:
        """What is wanted, empty where anything will do, and whether it is named by its use."""
        kept = self._trimmed(self._wanted)
        text = joined(self._text, kept)
        if self._prefix:
            alone = self._opening.bare and not self._prefix.startswith("something to use like")
            return ("", True) if alone else (self._with_prefix(kept), True)
        if kept and kept[0].form in ("to", "for"):
            return f"something {text}", True
        return ("", False) if _all_generic(kept) else (text, _says_use(kept))

    def _with_prefix(self, kept: Sequence[Word]) -> str:
        """ "I want to sit on something soft" asks for something soft to sit on."""
        at = next((i for i, word in enumerate(kept) if word.form in ("something", "anything")), None)
        if at is None or not self._prefix.startswith("something "):
            return f"{self._prefix} {joined(self._text, kept)}".strip()
        how = self._prefix.removeprefix("something ")
        parts = ("something", joined(self._text, kept[at + 1 :]), how, joined(self._text, kept[:at]))
        return " ".join(part for part in parts if part)


def depicts(text: str) -> bool:
    """Whether a text names a picture of something: what is on something may be so in the picture only."""
    return any(a in DEPICTIONS and b in ("of", "showing", "with") for a, b in pairwise(text.casefold().split()))


def _all_generic(found: Sequence[Word]) -> bool:
    return all(word.form in cues.GENERIC for word in found)


def _without(form: str) -> str | None:
    """What a word says is not there: "non-alcoholic", "sugar-free"."""
    if form.startswith("non-") and len(form) > 6:
        return form.removeprefix("non-")
    return form.removesuffix("-free") if form.endswith("-free") and len(form) > 6 and form != "hands-free" else None


def _says_use(found: Sequence[Word]) -> bool:
    """Whether words name a thing by what it is for: "something to sit on", "a tool that can cut"."""
    forms = [word.form for word in found]
    if any(form in cues.GENERIC for form in forms[:4]) and cues.USE_MARKS & set(forms[1:]):
        return True
    return any(a == "to" or (a in ("that", "which") and b in ("can", "could")) for a, b in pairwise(forms[1:]))


def _plural(found: Sequence[Word]) -> bool:
    last = found[-1].form if found else ""
    return len(last) > 3 and last.endswith("s") and not last.endswith(("ss", "us", "is"))


def _only_traits(text: str) -> bool:
    """Whether a text names properties and no thing ("red and white")."""
    return bool(text) and knowledge().facets(text).form == "traits"
