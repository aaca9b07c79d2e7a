"""A question as it is handed in: checked, cut, with the scenes that it names and what "it" and "those" point to."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass

from cgdb.errors import UsageError
from cgdb.model.prompts import clean
from cgdb.scene import ObjectId

LONGEST_QUESTION = 2000
"""Characters that are read: some 350 words."""

_OF_THESE = re.compile(r"\s*\b(?:out )?of (?:all )?(?:these|those|them)\b(?! (?:to|from)\b)", re.I)
_WHICH_ONES = re.compile(r"\b(which|what) ones?\b", re.I)
_WHICH_IS = re.compile(r"^\W*(?:(?:and|so|but) )*(?:which|what) (?:is|are)\b", re.I)
_THESE_THINGS = re.compile(r"\b(?:these|those)\b(?=\s+(?!is\b|are\b|from\b|to\b|and\b|the\b)\w)", re.I)
_ARE_THEY = re.compile(r"^(\W*(?:and |so |but )*(?:is|are|was|were|do|does|has|have)) (?:it|they|these|those)\b", re.I)
_NTH = re.compile(r"\bthe (first|second|third|fourth|fifth|last) (?:one|of (?:them|these|those))\b", re.I)
_OTHERS = re.compile(r"\bthe other(?:s| ones?)\b", re.I)
_IT = re.compile(r"\b(?:it|this|that|this one|that one)\b", re.I)
_THEM = re.compile(r"\b(?:them|they|these|those)\b", re.I)
_PLACES = {"first": 0, "second": 1, "third": 2, "fourth": 3, "fifth": 4, "last": -1}


def checked(question: str, *, has_picture: bool) -> tuple[str, str]:
    """The question cleaned and cut, and what is to be said of that; UsageError where it says nothing."""
    if not isinstance(question, str):
        raise UsageError(f"a question is a text, not {type(question).__name__}")
    text = clean(question, 10 * LONGEST_QUESTION)
    if not any(c.isalnum() for c in text):
        if has_picture:
            return "", ""
        raise UsageError("the question says nothing", hint='such as "Something to sit on, other than a chair"')
    if len(text) <= LONGEST_QUESTION:
        return text, ""
    kept = text[:LONGEST_QUESTION].rpartition(" ")[0] or text[:LONGEST_QUESTION]
    return kept, f"the question has {len(question):,} characters; only the first {LONGEST_QUESTION:,} were read"


def scenes_named(scenes: Sequence[str], question: str) -> tuple[tuple[str, ...], str]:
    """The scenes that a question names ("... in office2?"), and the question without that."""
    named = []
    for name in sorted(scenes, key=len, reverse=True):
        place = re.compile(
            rf"\s*\b(?:in|of|from|within|inside|at)\s+(?:the\s+)?(?:scene\s+|map\s+)?['\"]?{re.escape(name)}\b['\"]?",
            re.I,
        )
        rest = place.sub("", question)
        if rest != question and any(c.isalnum() for c in rest):
            named.append(name)
            question = rest
    return tuple(named), question


@dataclass(frozen=True, slots=True, kw_only=True)
class FollowUp:
    """A question that may point back to what was found before. among: it asks only about that; ids: which of it."""

    question: str
    among: bool
    ids: tuple[ObjectId, ...]


def follow_up(question: str, ids: Sequence[ObjectId]) -> FollowUp:
    """Read what points back. "It" is the first that was found, "the second one" that; "them" are all."""
    kept = tuple(ids)
    if (nth := _NTH.search(question)) and -len(kept) <= (at := _PLACES[nth[1].casefold()]) < len(kept):
        return FollowUp(question=_NTH.sub("it", question), among=False, ids=(kept[at],))
    if _OTHERS.search(question) and len(kept) > 1:
        return FollowUp(question=_OTHERS.sub("them", question), among=False, ids=kept[1:])
    if _IT.search(question) and not _THEM.search(question):
        kept = kept[:1]
    for pattern, instead in ((_OF_THESE, ""), (_WHICH_ONES, r"\1"), (_ARE_THEY, r"\1"), (_THESE_THINGS, "")):
        rest = pattern.sub(instead, question)
        if rest != question and any(c.isalnum() for c in rest):
            return FollowUp(question=_WHICH_IS.sub("", " ".join(rest.split())), among=True, ids=kept)
    return FollowUp(question=question, among=False, ids=kept)
