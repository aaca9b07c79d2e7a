"""Words of a question with their places in it, and tables of phrases that are found among them, the longest first."""

from __future__ import annotations

import re
import unicodedata
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Generic, TypeVar

T = TypeVar("T")

LONGEST_PHRASE = 16
"""Words of a phrase that is looked for."""


def listed(text: str) -> frozenset[str]:
    """A set of words from a text."""
    return frozenset(text.split())


_WORD = re.compile(r"\d+(?:[.,]\d+)?|[^\W\d_][^\W_]*(?:['\-&.][^\W_]+)*'?|[^\W_]+|[,;:.!?()/\"]")
_CONTRACTED: Mapping[str, tuple[str, str]] = {
    "n't": ("", "not"), "'re": ("", "are"), "'ve": ("", "have"), "'ll": ("", "will"), "'m": ("", "am"),
    "'d": ("", "would"),
}  # fmt: skip
_IS_AFTER = listed("that this it what where there here who which he she how everything something")
_BARE: Mapping[str, tuple[str, ...]] = {
    "can't": ("can", "not"), "won't": ("will", "not"), "cannot": ("can", "not"), "cant": ("can", "not"),
    "dont": ("do", "not"), "doesnt": ("does", "not"), "isnt": ("is", "not"), "arent": ("are", "not"),
    "wouldnt": ("would", "not"), "shouldnt": ("should", "not"), "didnt": ("did", "not"), "wont": ("will", "not"),
    "whats": ("what", "is"), "wheres": ("where", "is"), "im": ("i", "am"), "thats": ("that", "is"),
    "theres": ("there", "is"), "let's": ("let", "us"),
}  # fmt: skip


@dataclass(frozen=True, slots=True)
class Word:
    """One word or punctuation mark: its form (lower case, contractions opened) and text[start:end] where it stands.

    "isn't" is two words, "is" and "not", that share the letters of one; the second of them is empty in the text.
    """

    form: str
    start: int
    end: int


def cleaned(text: str) -> str:
    """One line in compatibility form (NFKC), with plain apostrophes and without what cannot be printed."""
    folded = unicodedata.normalize("NFKC", text).translate({0x2019: "'", 0x2018: "'", 0x201C: '"', 0x201D: '"'})
    plain = "".join(c if unicodedata.category(c)[0] not in "CZ" or c == " " else " " for c in folded)
    return " ".join(plain.split())


def words(text: str) -> tuple[Word, ...]:
    """The words and punctuation marks of a cleaned text."""
    found: list[Word] = []
    for match in _WORD.finditer(text):
        form, start, end = match[0].casefold().rstrip("'"), match.start(), match.end()
        for part, first in _opened(form):
            # The text of an opened contraction stays with its first part.
            found.append(Word(part, start, end if first else start))
    return tuple(found)


def _opened(form: str) -> Iterable[tuple[str, bool]]:
    if form in _BARE:
        return [(part, i == 0) for i, part in enumerate(_BARE[form])]
    for ending, (_, second) in _CONTRACTED.items():
        if form.endswith(ending) and len(form) > len(ending):
            return [(form.removesuffix(ending), True), (second, False)]
    if form.endswith("'s") and form[:-2] in _IS_AFTER:
        return [(form[:-2], True), ("is", False)]
    return [(form, True)]


def stretch(text: str, found: Sequence[Word]) -> str:
    """The text from the first of some words to the last, as it was written, without marks at its ends."""
    return text[found[0].start : max(word.end for word in found)].strip(' ,;:.!?"()/') if found else ""


def joined(text: str, found: Sequence[Word]) -> str:
    """As stretch, without the words in between that are not among the given ones."""
    runs: list[list[Word]] = []
    for word in found:
        if runs and not any(c.isalnum() for c in text[runs[-1][-1].end : word.start]):
            runs[-1].append(word)
        else:
            runs.append([word])
    return " ".join(part for run in runs if (part := stretch(text, run)))


class _Step(Generic[T]):
    """Where a phrase has got to: the words that may follow, and the value if it may end here."""

    __slots__ = ("after", "ends")

    def __init__(self) -> None:
        self.after: dict[str, _Step[T]] = {}
        self.ends: list[T] = []


class Phrases(Generic[T]):
    """A table of phrases with a value each.

    A line is ``value: phrase, phrase``; in a phrase ``a|b`` stands for either word, ``a?`` for one that may be missing.
    """

    def __init__(self, table: Mapping[T, str]) -> None:
        self._root: _Step[T] = _Step()
        for value, phrases in table.items():
            for phrase in re.sub(r"\|\s+", "|", phrases).split(","):
                self._add(phrase.split(), value)

    def _add(self, parts: Sequence[str], value: T) -> None:
        """All ways to say a phrase, together: where the parts so far may have got to."""
        ends = {self._root: True}
        for part in parts:
            either = part.rstrip("?").split("|")
            following = {step.after.setdefault(form, _Step()): True for step in ends for form in either if form}
            ends = {**ends, **following} if part.endswith("?") or "" in either else following
        for step in ends:
            if not step.ends and step is not self._root:
                step.ends = [value]

    def at(self, found: Sequence[Word], i: int) -> tuple[int, T] | None:
        """(number of words, value) of the longest phrase that begins at word i."""
        step, best = self._root, None
        for length, word in enumerate(found[i : i + LONGEST_PHRASE], start=1):
            following = step.after.get(word.form)
            if following is None:
                break
            step = following
            if step.ends:
                best = (length, step.ends[0])
        return best

    def words(self) -> frozenset[str]:
        """Every word that stands in one of the phrases."""
        found: set[str] = set()
        left = [self._root]
        while left:
            step = left.pop()
            found.update(step.after)
            left.extend(step.after.values())
        return frozenset(found)

    def only(self, text: str) -> T | None:
        """The value of a text that is one of the phrases, and nothing else."""
        found = words(text.casefold())
        hit = self.at(found, 0) if found else None
        return hit[1] if hit is not None and hit[0] == len(found) else None
