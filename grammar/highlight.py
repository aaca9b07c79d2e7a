"""Any text -> its pieces and what each is: for colours in a shell or an editor."""

from __future__ import annotations

from typing import Final

from cgdb.errors import Span
from cgdb.grammar.limits import MAX_LENGTH
from cgdb.grammar.machine import KEYWORDS, Token, Walk

_KINDS: Final = {
    "TEXT": "text",
    "QUOTED": "variable",
    "INTEGER": "number",
    "DECIMAL": "number",
    "INCHES": "number",
    "PARAMETER": "parameter",
    "EDGE": "edge",
    "EDGE_IN": "edge",
    "open": "error",
    "unknown": "error",
}
_EDGES: Final = frozenset({"-->", "<--", "--", "->"})
_OPERATORS: Final = frozenset({"=", "<>", "<", "<=", ">", ">=", "+", "-", "*", "/", "%", "~"})


def tokens(text: str) -> list[tuple[Span, str]]:
    """The pieces of any text, in order, with the kind of each; never fails. Space lies between pieces.

    Kinds: keyword, variable, function, alias, label, relation, property, text, number, unit, parameter, object, edge,
    operator, sign, comment, error. Words are told apart by the grammar as far as the text is CGQL, and by their looks
    from there to the next semicolon.
    """
    walk = Walk("script") if len(text) <= MAX_LENGTH else None
    found: list[tuple[Span, str]] = []
    pieces = list(Walk().machine.scan(text))
    at = 0
    for i, token in enumerate(pieces):
        found += _comments(text, at, token.start)
        at = token.end
        if token.group == "end":
            break
        following = pieces[i + 1].text
        roles: frozenset[str] | None = None
        terminal = ""
        if walk is not None:
            number = walk.machine.terminal(walk.state, token.group, token.text)
            shifting = walk.step(number) if number >= 0 else None
            if shifting is None:
                walk = None
            else:
                roles, terminal = walk.machine.roles[shifting], walk.machine.terminals[number]
        found.append((Span(token.start, token.end), _kind(token, terminal, roles, following, found, text)))
        if token.text == ";" and walk is None and len(text) <= MAX_LENGTH:
            walk = Walk("script")
    return found


def _kind(
    token: Token,
    terminal: str,
    roles: frozenset[str] | None,
    following: str,
    found: list[tuple[Span, str]],
    text: str,
) -> str:
    if token.group in ("NAME", "QUOTED"):
        if token.group == "NAME" and (terminal in KEYWORDS or (roles is None and token.text.upper() in KEYWORDS)):
            return "keyword"
        if terminal == "UNIT":
            return "unit"
        named = [r for r in ("alias", "label", "relation", "property", "variable") if roles and r in roles]
        if (not named or named == ["variable"]) and following == "(" and (roles is None or "function" in roles):
            return "function"
        return named[0] if named else "variable"
    if token.group == "SIGN":
        if token.text == "#":
            return "object"
        if token.text in _EDGES:
            return "edge"
        return "operator" if token.text in _OPERATORS else "sign"
    if found and text[found[-1][0].start : found[-1][0].end] == "#" and token.group in ("INTEGER", "TEXT"):
        return "object"
    return _KINDS[token.group]


def _comments(text: str, start: int, end: int) -> list[tuple[Span, str]]:
    """The comments in a gap between two tokens."""
    found = []
    while (begin := text.find("//", start, end)) >= 0:
        line = text.find("\n", begin, end)
        start = line if line >= 0 else end
        found.append((Span(begin, start), "comment"))
    return found
