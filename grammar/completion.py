"""What could stand at a place of an unfinished text: for completion in a shell or an editor."""

from __future__ import annotations

from dataclasses import dataclass

from cgdb.errors import Span
from cgdb.grammar.ast import NOWHERE
from cgdb.grammar.limits import MAX_LENGTH
from cgdb.grammar.machine import KEYWORDS, Machine, Token, Walk, machine

PHRASES = {
    "ORDER": ("ORDER BY",),
    "RERANK": ("RERANK BY",),
    "STARTS": ("STARTS WITH",),
    "IS": ("IS NULL", "IS NOT NULL"),
}
"""Keywords that stand together are offered together."""
NAMES = ("variable", "function", "alias", "label", "relation", "property")
TEXTS = ("scene", "meaning", "question", "moment")


@dataclass(frozen=True, slots=True, kw_only=True)
class Expected:
    """What could stand at the cursor.

    ``categories``: of variable, function, alias (a new name), label, relation, property; scene, meaning, question,
    moment, text (texts, by what they are for); parameter, number, unit, object (an id after ``#``), keyword, sign.
    """

    categories: frozenset[str] = frozenset()
    keywords: tuple[str, ...] = ()
    """In upper case, such as ``ORDER BY``."""
    signs: tuple[str, ...] = ()
    partial: str = ""
    """What of the word or text stands before the cursor already."""
    span: Span = NOWHERE
    """The place of partial: what a completion replaces."""
    variables: dict[str, str | None]
    """The variables of the statement and the label of each, None where none was written."""
    owner: str | None = None
    """The variable whose property is wanted."""


def expected(text: str, cursor: int | None = None) -> Expected:
    """What could stand at the cursor (a character offset; the end of the text when None) of any text at all.

    Nothing can where the text before the cursor is not CGQL already, or inside a comment.
    """
    cursor = len(text) if cursor is None else max(0, min(cursor, len(text)))
    m = machine()
    tokens = list(m.scan(text))
    begin = max((t.end for t in tokens if t.text == ";" and t.end <= cursor), default=0)
    scope = _variables(m, tokens, cursor)
    before = [t for t in tokens if begin <= t.start and t.end <= cursor and t.group != "end"]
    inside = [t for t in tokens if t.start < cursor < t.end]
    nothing = Expected(span=Span(cursor, cursor), variables=scope)
    partial, category = None, None
    if inside:
        partial = inside[0]
    elif before and before[-1].end == cursor and _grows(before[-1]):
        partial = before.pop()
    elif _in_comment(text, before[-1].end if before else begin, cursor):
        return nothing
    if cursor - begin > MAX_LENGTH:
        return nothing
    walk = Walk()
    for token in before:
        if walk.step(m.terminal(walk.state, token.group, token.text)) is None:
            return nothing
    fitting = walk.acceptable()
    span, written = Span(cursor, cursor), ""
    if partial is not None:
        opening = 1 if partial.group in ("TEXT", "QUOTED", "open") else 0
        span = Span(min(partial.start + opening, cursor), cursor)
        written = text[span.start : span.end]
        category = {"TEXT": "TEXT", "QUOTED": "NAME", "PARAMETER": "PARAMETER"}.get(partial.group)
        if partial.group == "open":
            category = "NAME" if partial.text[0] == "`" else "TEXT"
        if written == "$":
            category = "PARAMETER"
        if partial.group in ("SIGN", "EDGE", "EDGE_IN"):
            return nothing
    found = {m.terminals[t]: m.roles[state] for t, state in fitting.items()}
    if category is not None:
        found = {t: roles for t, roles in found.items() if t == category}
    categories = _categories(found)
    if before and before[-1].text == "#":
        categories = frozenset({"object"})
    words = [w for w in found if w in KEYWORDS]
    keywords = [p for w in words for p in (("AS OF",) if w == "AS" and "MATCH" in found else PHRASES.get(w, (w,)))]
    return Expected(
        categories=categories,
        keywords=tuple(sorted(keywords)),
        signs=tuple(sorted(_sign(t) for t in found if not t[0].isalpha() or t in ("EDGE", "EDGE_IN"))),
        partial=written,
        span=span,
        variables=scope,
        owner=_owner(before) if "property" in categories else None,
    )


def _grows(token: Token) -> bool:
    """Whether a token that ends at the cursor may be the beginning of a longer one."""
    return token.group in ("NAME", "PARAMETER", "INTEGER", "DECIMAL", "INCHES", "open") or token.text == "$"


def _in_comment(text: str, start: int, cursor: int) -> bool:
    return "//" in text[start:cursor].rsplit("\n", 1)[-1]


def _sign(terminal: str) -> str:
    return {"EDGE": "-[", "EDGE_IN": "<-["}.get(terminal, terminal)


def _categories(found: dict[str, frozenset[str]]) -> frozenset[str]:
    categories: set[str] = set()
    for terminal, roles in found.items():
        if terminal == "NAME":
            categories.update(role for role in NAMES if role in roles)
        elif terminal == "TEXT":
            categories.update([role for role in TEXTS if role in roles] or ["text"])
        elif terminal in ("INTEGER", "DECIMAL", "INCHES"):
            categories.add("number")
        elif terminal in ("PARAMETER", "UNIT"):
            categories.add(terminal.lower())
        elif terminal in KEYWORDS:
            categories.add("keyword")
        elif terminal == "#":
            categories.add("object")
        elif not terminal[0].isalpha() or terminal in ("EDGE", "EDGE_IN"):
            categories.add("sign")
    return frozenset(categories)


def _variables(m: Machine, tokens: list[Token], cursor: int) -> dict[str, str | None]:
    """The names that the patterns of the statement around the cursor give, before and after it, and AS names."""
    begin = max((i + 1 for i, t in enumerate(tokens) if t.text == ";" and t.end <= cursor), default=0)
    end = next((i for i, t in enumerate(tokens) if i >= begin and t.text == ";"), len(tokens))
    found: dict[str, str | None] = {}
    here = tokens[begin:end]
    matching = False
    for i, token in enumerate(here):
        word = token.text.upper() if token.group == "NAME" else ""
        before = here[i - 1] if i else None
        name = _name(token)
        if word in ("MATCH", "RETURN", "WHERE") and (before is None or before.text not in (":", "|", ".")):
            matching = word == "MATCH"
        elif name is None or before is None:
            continue
        elif matching and (before.text == "(" or before.group in ("EDGE", "EDGE_IN")):
            label = here[i + 2] if i + 2 < len(here) and here[i + 1].text == ":" and before.text == "(" else None
            known = _name(label) if label else None
            found[name] = known or found.get(name)
        elif before.text.upper() == "AS":
            found.setdefault(name, None)
    return found


def _name(token: Token) -> str | None:
    if token.group == "NAME":
        return token.text
    return token.text[1:-1] if token.group == "QUOTED" and "\\" not in token.text else None


def _owner(before: list[Token]) -> str | None:
    """The variable of ``o.`` or ``(o:Label {``."""
    if len(before) > 1 and before[-1].text == ".":
        return _name(before[-2])
    for i in range(len(before) - 1, 0, -1):
        if before[i].text == "{":
            back = i - 1
            while back > 0 and before[back].text != "(":
                back -= 1
            return _name(before[back + 1])
    return None
