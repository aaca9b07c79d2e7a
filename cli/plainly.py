"""Questions in plain words at the prompt: typed bare, or with ``:ask``; each may follow up the one before."""

from __future__ import annotations

import re
import time
from dataclasses import replace
from typing import TYPE_CHECKING

from cgdb.cli import ask as answers
from cgdb.cli.session import Answer
from cgdb.cli.showing import show
from cgdb.errors import UsageError, did_you_mean

if TYPE_CHECKING:
    from cgdb.cli.session import Session

_STARTS = ("MATCH", "USE", "AS", "EXPLAIN", "PROFILE")
_OTHER_LANGUAGES = frozenset(
    """SELECT INSERT UPDATE DELETE CREATE DROP ALTER MERGE SET REMOVE WITH CALL UNWIND OPTIONAL RETURN WHERE ORDER
    LIMIT""".split()  # noqa: SIM905 -- words are read more easily than a list of quotes
)
_ENGLISH = re.compile(
    r"\s*(where(['’]s|\s+(is|are|was|were|can|could|do|does|did|should|would|will|have|has|to|in|on))|"
    r"with\s+(what|which))\b",
    re.IGNORECASE,
)
"""Words that begin a clause of those languages, as they begin a sentence."""
_FIRST_WORD = re.compile(r"\s*([^\W\d_]+)(\s*\()?", re.UNICODE)


def is_question(text: str) -> bool:
    """Whether a text is plain words: it begins with a word that begins no statement, of CGQL or its relatives."""
    if _ENGLISH.match(text):
        return True
    first = _FIRST_WORD.match(text)
    if first is None or first[2]:
        return False
    word = first[1].upper()
    return word not in _OTHER_LANGUAGES and word not in _STARTS and did_you_mean(word, _STARTS) is None


def ask(session: Session, rest: str) -> None:
    """Ask the store; what was asked before is what "these" and "them" mean."""
    if not rest.strip():
        raise UsageError("there is no question", hint=":ask something to sit on other than a chair")
    db = session.db
    started = time.perf_counter()
    found = session.waiting(
        lambda: db.ask(rest, previous=session.asked, scenes=session.use.scenes, as_of=session.use.as_of), db.cancel
    )
    session.asked = found if found.ids or session.asked is None else session.asked
    session.statement = found.query
    answer = Answer(text=found.query, result=found.result, seconds=time.perf_counter() - started)
    session.last = answer
    for line in found.warnings:
        session.screen.note(f"note: {line}")
    session.screen.note(("✓ " if found.achievable else "✗ ") + found.explanation)
    if session.interactive:
        session.screen.note(found.query)
        session.screen.note(answers.cost(found))
    for head, lines in (("left out", found.ignored), ("assumed", found.assumed)):
        for line in lines:
            session.screen.note(f"  {head}: {line}")
    some = replace(found.result, rows=answers.shown(found.rows), warnings=())
    show(session, replace(answer, result=some))
