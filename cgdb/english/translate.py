"""Translator: an English question to CGQL, without a language model.

questions takes the question apart, question_tree writes it as a tree. Texts of the question only ever become texts
of the tree, so nothing in them can be taken for a part of the query.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

from cgdb.english import cues
from cgdb.english.intent import Asked, Setting
from cgdb.english.languages import other_language
from cgdb.english.lookahead import PREVIOUS
from cgdb.english.looser import Plain
from cgdb.english.phrases import cleaned, words
from cgdb.english.question_tree import Condition, write
from cgdb.english.questions import MOST_WORDS, understand
from cgdb.english.spelling import corrected
from cgdb.english.tree_parts import LONGEST_MEANING
from cgdb.errors import UsageError
from cgdb.grammar import ast
from cgdb.grammar.printer import to_text
from cgdb.index.catalog import Catalog

LONGEST_QUESTION = 4_000
"""Characters of a question that are read."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Translation:
    """A question as CGQL. text: canonical CGQL of query. understood: one line per thing that was understood.

    assumed: what was not said and taken to be meant; ignored: what the statement leaves out, and why.
    conditions: what is asked beside that, each with how it is said of a thing that does not meet it. anchors: the
    things that the question measures against or says that something is at. asked: the question taken apart.

    kind: "descriptive", "affordance", "negation", "count", "superlative", "existence", "place", "value" or "other
    language".
    wanted: the text of what is looked for, without what is excluded; empty where anything will do. plain: without what
    the map cannot tell of it. question: the text that was read.
    """

    query: ast.Query
    text: str
    understood: tuple[str, ...]
    kind: str
    wanted: str
    asked: Asked
    assumed: tuple[str, ...] = ()
    ignored: tuple[str, ...] = ()
    conditions: tuple[Condition, ...] = ()
    anchors: tuple[str, ...] = ()
    plain: Plain | None = None
    question: str = ""


def translate(
    question: str,
    catalog: Catalog,
    *,
    places: Sequence[str] = (),
    up: str = "z",
    setting: Setting | None = None,
) -> Translation:
    """The CGQL of an English question. places: names of the store's rooms; up: the scenes' up axis ("z", "-y").

    setting: all that is known of the store, which says both of these too.

    UsageError where the question is empty. Any other text is translated: what is not understood is matched by meaning.
    """
    if not isinstance(question, str):
        raise UsageError(f"a question is a text, not {type(question).__name__}")
    setting = setting or Setting(places=tuple(places), frames=(("", up, None),))
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
        text, slips = corrected(text, setting.words)
        asked = understand(text, setting.places, previous=setting.previous)
        if not setting.previous and _points_back(understand(text, setting.places, previous=True)):
            raise UsageError(
                "the question points back, and nothing was found before",
                hint="name the thing; in cgdb shell, a question may follow up the one before",
            )
        notes = (*slips, *asked.notes)
        asked = replace(asked, notes=())
        if asked == Asked(use=asked.use, polar=asked.polar) and not _asks_for_all(forms):
            asked = replace(asked, wanted=text[:LONGEST_MEANING])
    kind = "other language" if language is not None else _kind(asked)
    return replace(_translation(asked, catalog, setting, notes=(*cut, *notes), kind=kind), question=text)


def read_otherwise(asked: Asked, catalog: Catalog, setting: Setting, *, note: str) -> Translation:
    """The CGQL of a question that is understood in another way than at first; note: in which."""
    return _translation(asked, catalog, setting, notes=(note,), kind=_kind(asked))


def _translation(asked: Asked, catalog: Catalog, setting: Setting, *, notes: tuple[str, ...], kind: str) -> Translation:
    written = write(asked, catalog, setting)
    return Translation(
        query=written.query,
        text=to_text(written.query),
        understood=(*notes, *written.understood),
        kind=kind,
        wanted=written.wanted,
        asked=asked,
        assumed=written.assumed,
        ignored=written.ignored,
        conditions=written.conditions,
        anchors=written.anchors,
        plain=written.plain,
    )


def _points_back(asked: Asked) -> bool:
    """Whether a question asks for nothing without what "it" or "them" stands for: "what is under it?"."""
    anchors = (anchor for located in asked.located for anchor in located.anchors)
    return asked.wanted == PREVIOUS or (not asked.wanted and PREVIOUS in (*anchors, asked.against))


def _asks_for_all(forms: Sequence[str]) -> bool:
    """ "What is there?", "show me everything"."""
    return bool(cues.GENERIC & set(forms)) or "there" in forms


def _kind(asked: Asked) -> str:
    if asked.form in ("count", "per room", "per scene", "compare"):
        return "count"
    if asked.form in ("measure", "distance", "trait"):
        return "value"
    if asked.form in ("room", "scene"):
        return "place"
    if asked.first is not None:
        return "superlative"
    if asked.excluded or asked.not_places or any(located.negated for located in asked.located):
        return "negation"
    if asked.use:
        return "affordance"
    return "existence" if asked.form == "exists" else "descriptive"
