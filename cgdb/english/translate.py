"""Translator: an English question to CGQL, without a language model.

questions takes the question apart, question_tree writes it as a tree. Texts of the question only ever become texts
of the tree, so nothing in them can be taken for a part of the query.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

from cgdb.english import cues
from cgdb.english.intent import Asked
from cgdb.english.languages import other_language
from cgdb.english.phrases import cleaned, words
from cgdb.english.question_tree import LONGEST_MEANING, write
from cgdb.english.questions import MOST_WORDS, understand
from cgdb.errors import UsageError
from cgdb.grammar import ast
from cgdb.grammar.printer import to_text
from cgdb.index.catalog import Catalog

LONGEST_QUESTION = 4_000
"""Characters of a question that are read."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Translation:
    """A question as CGQL. text: canonical CGQL of query. understood: one line per thing that was understood.

    kind: "descriptive", "affordance", "negation", "count", "superlative", "existence", "place" or "other language".
    wanted: the text of what is looked for, without what is excluded; empty where anything will do.
    """

    query: ast.Query
    text: str
    understood: tuple[str, ...]
    kind: str
    wanted: str


def translate(question: str, catalog: Catalog, *, places: Sequence[str] = (), up: str = "z") -> Translation:
    """The CGQL of an English question. places: names of the store's rooms; up: the scenes' up axis ("z", "-y").

    UsageError where the question is empty. Any other text is translated: what is not understood is matched by meaning.
    """
    if not isinstance(question, str):
        raise UsageError(f"a question is a text, not {type(question).__name__}")
    text = cleaned(question[:LONGEST_QUESTION])
    cut = (f"only the first {LONGEST_QUESTION:,} characters were read",) if len(question) > LONGEST_QUESTION else ()
    if not any(character.isalnum() for character in text):
        raise UsageError("the question is empty", hint="ask in plain words, such as: something to sit on")
    forms = [word.form for word in words(text)[:MOST_WORDS]]
    language = other_language(text, forms)
    if language is not None:
        asked = Asked(wanted=text[:LONGEST_MEANING])
        notes: tuple[str, ...] = (f"not understood as English ({language}): matched as a whole, by meaning",)
    else:
        asked = understand(text, places)
        notes = asked.notes
        if asked == Asked(notes=notes, use=asked.use) and not _asks_for_all(forms):
            asked = replace(asked, wanted=text[:LONGEST_MEANING])
    written = write(asked, catalog, places, up)
    return Translation(
        query=written.query,
        text=to_text(written.query),
        understood=(*cut, *notes, *written.understood),
        kind="other language" if language is not None else _kind(asked),
        wanted=written.wanted,
    )


def _asks_for_all(forms: Sequence[str]) -> bool:
    """ "What is there?", "show me everything"."""
    return bool(cues.GENERIC & set(forms)) or "there" in forms


def _kind(asked: Asked) -> str:
    if asked.form in ("count", "per room"):
        return "count"
    if asked.form == "room":
        return "place"
    if asked.first is not None:
        return "superlative"
    if asked.excluded or asked.not_places or any(located.negated for located in asked.located):
        return "negation"
    if asked.use:
        return "affordance"
    return "existence" if asked.form == "exists" else "descriptive"
