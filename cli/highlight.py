"""A statement or command in colours: its pieces with their kinds, from the grammar's own tokens."""

from __future__ import annotations

from cgdb.grammar.parser import tokens

STATEMENT_COMMANDS = ("explain", "profile")
"""Commands whose argument is a statement."""


def pieces(text: str) -> list[tuple[str, str]]:
    """(kind, text) that make up the whole text in order; the kind of what lies between pieces is ""."""
    if not text:
        return []
    found: list[tuple[str, str]] = []
    start = 0
    if text.lstrip().startswith(":"):
        # A command ends with its line; what follows is a script like any other.
        line, newline, rest = text.partition("\n")
        if not line.strip():
            return [("", line + newline), *pieces(rest)]
        name = line.split()[0]
        start = line.index(name) + len(name)
        found += [("", line[: start - len(name)]), ("command", name)]
        if name.lstrip(":").casefold() not in STATEMENT_COMMANDS:
            found.append(("", line[start:] + newline))
            return found + (pieces(rest) if rest else [])
    body = text[start:]
    at = 0
    for span, kind in tokens(body):
        if span.start > at:
            found.append(("", body[at : span.start]))
        found.append((kind, body[span.start : span.end]))
        at = span.end
    if at < len(body):
        found.append(("", body[at:]))
    return [(kind, piece) for kind, piece in found if piece]


def lines(text: str) -> list[list[tuple[str, str]]]:
    """The pieces by line."""
    found: list[list[tuple[str, str]]] = [[]]
    for kind, piece in pieces(text):
        first, *more = piece.split("\n")
        found[-1].append((kind, first))
        found.extend([(kind, part)] for part in more)
    return found
