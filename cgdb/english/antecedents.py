"""What "it" and "they" stand for in a question that follows what somebody tells: "my mug broke, what could I glue it
with?" asks for something to glue my mug with.
"""

from __future__ import annotations

from collections.abc import Sequence

from cgdb.english.needs import remedy, states
from cgdb.english.phrases import Word, listed
from cgdb.meaning.knowledge import knowledge
from cgdb.meaning.lexicon import FUNCTION_WORDS

_OBJECTS = listed("it them these those")
_SUBJECTS = listed("it they these those")
_MODALS = listed("can could shall should would will may might must does do")
_ASKS = {"what": "something", "where": "somewhere", "which": "something"}
_OPENS = listed("a an some any my our your his her their this that these the")
_OTHERS = listed("i we you he she")
_WITH = listed("with in on into onto from under over")


def resolved(text: str, parts: Sequence[Sequence[Word]]) -> str | None:
    """The text with what "it" stands for written out, of the clauses of a text; None where nothing points back."""
    if len(parts) < 2:
        return None
    told, asks = parts[0], parts[-1]
    thing = _told_of(text, told)
    if not thing or any(word.form in _OPENS for word in asks):
        return None
    forms = [word.form for word in asks]
    if len(forms) > 3 and forms[0] in _ASKS and forms[1] in _MODALS and forms[2] in _SUBJECTS:
        if forms[2] == "it" and forms[0] == "what":
            return None  # "what could it be?"
        rest = text[asks[3].start :]
        return f"{text[: asks[0].start].rstrip(' ,;')}. {_ASKS[forms[0]]} for {thing} to {rest}"
    at = next((i for i, form in enumerate(forms) if form in _OBJECTS and i > 1), None)
    if at is None or forms[at - 1] in FUNCTION_WORDS - _WITH:
        return None
    return f"{text[: asks[at].start]}{thing}{text[asks[at].end :]}"


def _told_of(text: str, told: Sequence[Word]) -> str:
    """What a clause tells of: its object ("I was given some flowers"), or what it begins with ("my feet hurt")."""
    forms = [word.form for word in told]
    if not states(forms) and forms[0] not in _OTHERS | _OPENS:
        return ""
    begins = [i for i, form in enumerate(forms) if form in _OPENS and i + 1 < len(forms)]
    if not begins:
        return ""
    at = begins[0] if begins[0] == 0 else begins[-1]
    end = at + 1
    while end < len(forms) and forms[end].isalpha():
        of_it = forms[end] == "of" or (forms[end - 1] == "of" and forms[end] in _OPENS)
        ends = forms[end] in FUNCTION_WORDS or forms[end] in knowledge().doing.verbs or remedy(["i", forms[end]])
        if end > at + 1 and ends and not of_it:
            break
        end += 1
    kept = told[at + 1 if forms[at] in ("some", "any", "a", "an") else at : end]
    return text[kept[0].start : kept[-1].end].replace("The ", "the ") if kept else ""
