"""What may be typed next, in context: from the grammar's expectations and from what the store holds."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Protocol

from cgdb.grammar.machine import KEYWORDS
from cgdb.grammar.parser import Expected, expected, tokens
from cgdb.query.functions import AGGREGATES, FUNCTIONS

MOST = 60
"""Choices that are shown; a person types one more letter rather than scroll through more."""
LONGEST = 60
"""Characters of a value that is offered; nobody picks a paragraph."""
FEW = 4
"""Keywords that are offered before a letter is typed; a longer list would only cover what was typed."""
SIGNS_SAY: Mapping[str, str] = {
    "-->": "any relation",
    "-[": "a relation from here",
    "<-[": "a relation to here",
    "~": "by meaning",
}


@dataclass(frozen=True, slots=True, kw_only=True)
class Choice:
    """text replaces what was typed from ``start`` on. kind and says are shown beside it."""

    text: str
    start: int
    kind: str
    says: str = ""


class Known(Protocol):
    """What a store holds, by name; everything may still be empty while it is being opened."""

    def scenes(self) -> Mapping[str, str]:
        """{scene: what is said of it}"""

    def labels(self) -> Mapping[str, int]:
        """{label: nodes}"""

    def relations(self) -> Mapping[str, int]:
        """{label: how many}"""

    def properties(self) -> Mapping[str, str]:
        """{property of the maps: its type}"""

    def values(self, name: str) -> Sequence[str]:
        """Texts that a property has, most frequent first."""

    def phrases(self) -> Sequence[str]:
        """What things are called: tags and names, most frequent first."""

    def words(self) -> Sequence[str]:
        """Words of captions, most frequent first."""

    def ids(self) -> Sequence[tuple[str, str]]:
        """(id as it is written after ``#``, tag)"""

    def parameters(self) -> Mapping[str, str]:
        """{parameter: its value, shortened}"""


def complete(text: str, cursor: int, known: Known, *, asked: bool = False) -> list[Choice]:
    """The choices at the cursor, likeliest first. asked: the person pressed Tab, so that more is worth showing."""
    want = expected(text, cursor)
    start, partial = want.span.start, want.partial
    kinds = want.categories
    if kinds & {"meaning", "question"}:
        return _texts(partial, start, cursor, text, known)
    if "scene" in kinds:
        return _quotable(_ranked(partial, known.scenes().items(), start, "scene"), text, cursor)
    if kinds == {"text"}:
        name = _compared(text, start - 1)
        values = known.values(name) if name else known.phrases()
        return _quotable(_ranked(partial, ((v, "") for v in values), start, name or "value"), text, cursor)
    if "object" in kinds and text[:start].rstrip().endswith("#"):
        return _first(
            Choice(text=written, start=start, kind="object", says=tag)
            for written, tag in known.ids()
            if written.startswith(partial)
        )
    if "label" in kinds:
        return _ranked(partial, ((k, f"{n:,}") for k, n in known.labels().items()), start, "label")
    if "relation" in kinds:
        choices = _ranked(partial, ((k, f"{n:,}") for k, n in known.relations().items()), start, "relation")
        return [_in_backticks(choice, text) for choice in choices]
    if "property" in kinds:
        return [_in_backticks(choice, text) for choice in _properties(want, known)]
    if "alias" in kinds:
        return []
    return _words(want, known, text, asked=asked)


def _words(want: Expected, known: Known, text: str, *, asked: bool) -> list[Choice]:
    """Names, functions and keywords: where an expression may stand nearly everything may."""
    start, partial, kinds = want.span.start, want.partial, want.categories
    found: list[Choice] = []
    if "parameter" in kinds:
        held = known.parameters()
        if partial.startswith("$"):
            return _ranked(partial, ((f"${name}", says) for name, says in held.items()), start, "parameter")
    broad = "function" in kinds
    if broad and (name := _compared(text[:start], start)) and not partial:
        written = (_quoted(value) for value in known.values(name)[:MOST])
        found += [Choice(text=value, start=start, kind=name) for value in written if value]
    if "variable" in kinds and (broad or partial or asked):
        # The name that is being typed stands among the variables too.
        others = ((name, label or "") for name, label in want.variables.items() if name != partial)
        found += _ranked(partial, others, start, "variable", inside=False)
    if broad and (partial or asked):
        says = {f"{name}(": signature.says for name, signature in {**FUNCTIONS, **AGGREGATES}.items()}
        found += _ranked(partial, says.items(), start, "function", inside=False)
    if "unit" in kinds and (partial or asked):
        found += _ranked(partial, ((unit, "") for unit in ("cm", "m", "mm", "ft", "in")), start, "unit", inside=False)
    if partial or asked or (not broad and len(want.keywords) <= FEW):
        lower = _writes_lower(text, partial)
        words = [word.lower() if lower else word for word in _likely(want.keywords)]
        found += _ranked(partial, ((word, "") for word in words), start, "keyword", inside=False)
    if asked and not partial:
        found += [Choice(text=s, start=start, kind="sign", says=SIGNS_SAY.get(s, "")) for s in want.signs if s != "--"]
        if broad and "parameter" in kinds:
            held = known.parameters()
            found += [Choice(text=f"${n}", start=start, kind="parameter", says=says) for n, says in held.items()]
    # What is typed in full already needs no menu, and Enter should not have to leave one first.
    if len(found) == 1 and found[0].text.casefold() == partial.casefold():
        return []
    return found[:MOST]


def _likely(keywords: Iterable[str]) -> list[str]:
    order = ("MATCH", "WHERE", "RETURN", "AND", "OR", "NOT", "ORDER BY", "LIMIT")
    return sorted(keywords, key=lambda word: (order.index(word) if word in order else len(order), word))


def _texts(partial: str, start: int, cursor: int, text: str, known: Known) -> list[Choice]:
    """After ``~ "``: what things are called, and the words of captions to go on with."""
    begin = max((partial.rfind(c) for c in " ,-"), default=-1) + 1
    word = partial[begin:]
    things = _ranked(partial, ((phrase, "") for phrase in known.phrases()), start, "tag")
    begun = [choice for choice in things if choice.text.casefold().startswith(partial.casefold())]
    words: list[Choice] = []
    if word:
        words = _ranked(word, ((w, "") for w in known.words()), start + begin, "word", inside=False)
    found: list[Choice] = []
    seen = {partial.casefold()}
    for choice in (*begun[: MOST // 2], *words, *things):
        made = (partial[: choice.start - start] + choice.text).casefold()
        if made not in seen:
            seen.add(made)
            found.append(choice)
    return _quotable(found[:MOST], text, cursor, close=False)


def _properties(want: Expected, known: Known) -> list[Choice]:
    # Brings numpy, which the prompt must not wait for.
    from cgdb.index.catalog import BUILT_IN, EDGE_PROPERTIES

    label = want.variables.get(want.owner) if want.owner else None
    own = {name: kind for name, kind in known.properties().items() if name not in BUILT_IN}
    offered = {**own, **BUILT_IN}
    if label is None and want.owner and want.owner not in want.variables:
        offered |= EDGE_PROPERTIES
    return _ranked(want.partial, offered.items(), want.span.start, "property")


def _ranked(
    partial: str, items: Iterable[tuple[str, str]], start: int, kind: str, *, inside: bool = True
) -> list[Choice]:
    """The names that begin with what was typed, then (inside) those with a word that does, or that hold it."""
    wanted = partial.casefold()
    ranks: tuple[list[Choice], ...] = ([], [], [])
    for name, says in items:
        folded = name.casefold()
        if folded.startswith(wanted):
            rank = 0
        elif not inside or len(wanted) < 2:
            continue
        elif any(word.startswith(wanted) for word in folded.replace("_", " ").split()):
            rank = 1
        elif wanted in folded:
            rank = 2
        else:
            continue
        if len(name) <= LONGEST and name.isprintable():
            ranks[rank].append(Choice(text=name, start=start, kind=kind, says=says))
        if len(ranks[0]) >= MOST:
            break
    return [choice for rank in ranks for choice in rank][:MOST]


def _first(choices: Iterable[Choice]) -> list[Choice]:
    found: list[Choice] = []
    for choice in choices:
        found.append(choice)
        if len(found) >= MOST:
            break
    return found


def _quotable(choices: Iterable[Choice], text: str, cursor: int, *, close: bool = True) -> list[Choice]:
    """Choices inside of quotes: escaped as they must be, and with the closing quote where there is none yet."""
    found = []
    for choice in choices:
        quote = text[choice.start - 1 : choice.start]
        if quote not in ("'", '"', "`"):
            opening = max(text.rfind(q, 0, choice.start) for q in "'\"`")
            quote = text[opening] if opening >= 0 else '"'
        written = choice.text.replace("\\", "\\\\").replace(quote, "\\" + quote)
        if close and text[cursor : cursor + 1] != quote:
            written += quote
        found.append(Choice(text=written, start=choice.start, kind=choice.kind, says=choice.says))
    return found


def _quoted(value: str) -> str | None:
    if len(value) > LONGEST or not value.isprintable():
        return None
    return "'" + value.replace("\\", "\\\\").replace("'", "\\'") + "'"


def _in_backticks(choice: Choice, text: str) -> Choice:
    """A name that is no word, in backticks; one after a backtick that was typed gets the closing one."""
    name = choice.text
    if text[choice.start - 1 : choice.start] == "`":
        return Choice(text=name + "`", start=choice.start, kind=choice.kind, says=choice.says)
    if name.isidentifier():
        return choice
    written = "`" + name.replace("\\", "\\\\").replace("`", "\\`") + "`"
    return Choice(text=written, start=choice.start, kind=choice.kind, says=choice.says)


def _compared(text: str, end: int) -> str | None:
    """The property that a value before ``end`` is compared with: of ``o.tag = ``, ``o.tag IN [`` and ``{tag: ``."""
    before = [(text[span.start : span.end], kind) for span, kind in tokens(text[:end]) if kind != "comment"]
    while before and (before[-1][0] in ("[", ",", "=", "<>", ":", "(") or before[-1][1] == "text"):
        last = before.pop()[0]
        if last in ("=", "<>", ":"):
            break
    while before and before[-1][0].upper() in ("IN", "CONTAINS", "STARTS", "WITH"):
        before.pop()
    if before and before[-1][1] == "property":
        return before[-1][0].strip("`")
    return None


def _writes_lower(text: str, partial: str) -> bool:
    """Whether this person writes keywords in lower case: by what is being typed, or else by the last one."""
    letters = [c for c in partial if c.isalpha()]
    if letters:
        return letters[0].islower()
    words = [text[span.start : span.end] for span, kind in tokens(text) if kind == "keyword"]
    return bool(words) and words[-1].islower() and words[-1].upper() in KEYWORDS
