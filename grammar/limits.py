"""What a statement may be at most, so that no text can bring the parser, or what walks its tree, to its knees."""

from __future__ import annotations

from cgdb.errors import LimitError, ParseError, Span, UsageError
from cgdb.grammar import ast
from cgdb.grammar.machine import machine

MAX_LENGTH = 20_000
"""Characters in a statement."""
MAX_SCRIPT = 1_000_000
"""Characters in a script."""
MAX_DEPTH = 60
"""Brackets inside brackets, and nodes inside nodes of the tree. The printer never needs more brackets than nodes."""
MAX_TEXT = 4096
"""Characters in a text; in the grammar too."""
MAX_NAME = 256
"""Characters in a name in backticks; in the grammar too."""


def check_text(text: str, *, script: bool = False) -> None:
    """Refuse what is not text, or too long, or nested too deeply, before any of it is parsed."""
    if not isinstance(text, str):
        raise UsageError(f"a statement is a text, not {type(text).__name__}")
    most = MAX_SCRIPT if script else MAX_LENGTH
    if len(text) > most:
        raise LimitError(
            f"the text has {len(text):,} characters; at most {most:,} are read",
            hint="give long lists and texts as parameters ($name)",
            span=Span(most, len(text)),
            source=text,
        )
    if "\0" in text:
        at = text.index("\0")
        raise ParseError("the character NUL cannot stand in a statement", span=Span(at, at + 1), source=text)
    if not text.isascii():
        try:
            text.encode("utf-8")
        except UnicodeEncodeError as error:
            place = Span(error.start, error.end)
            message = f"half a character (U+{ord(text[error.start]):04X}) cannot stand in a statement"
            raise ParseError(message, hint="read the text as UTF-8", span=place) from None
    if len(text) > MAX_LENGTH or text.count("(") + text.count("[") + text.count("{") > MAX_DEPTH:
        _check_brackets(text)


def _check_brackets(text: str) -> None:
    depth, begin = 0, 0
    for token in machine().scan(text):
        if token.group not in ("SIGN", "EDGE", "EDGE_IN", "end"):
            continue
        if token.text[-1:] in ("(", "[", "{"):
            depth += 1
            if depth > MAX_DEPTH:
                raise _too_deep(Span(token.start, token.end), text)
        elif token.text in (")", "]", "}"):
            depth = max(0, depth - 1)
        elif token.text == ";" or token.group == "end":
            if token.start - begin > MAX_LENGTH:
                raise LimitError(
                    f"a statement has {token.start - begin:,} characters; at most {MAX_LENGTH:,} are read",
                    hint="give long lists and texts as parameters ($name)",
                    span=Span(begin, token.start),
                    source=text,
                )
            depth, begin = 0, token.end


def check_tree(tree: ast.Syntax, source: str | None = None) -> None:
    """Refuse a tree in which nodes stand too deep in one another: ``1 + 1 + 1 ...`` does so without a bracket."""
    level: list[ast.Syntax] = [tree]
    for _ in range(MAX_DEPTH):
        level = [child for node in level for child in children(node)]
        if not level:
            return
    raise _too_deep(level[0].span, source)


def children(node: ast.Syntax) -> list[ast.Syntax]:
    """The nodes directly inside a node."""
    found: list[ast.Syntax] = []
    for name in node.__slots__:
        value = getattr(node, name)
        if isinstance(value, ast.Syntax):
            found.append(value)
        elif isinstance(value, tuple):
            for item in value:
                # The properties of a node pattern are pairs of a name and a value.
                inner = item[1] if isinstance(item, tuple) else item
                if isinstance(inner, ast.Syntax):
                    found.append(inner)
    return found


def _too_deep(span: Span, source: str | None) -> LimitError:
    return LimitError(
        f"the statement is nested more than {MAX_DEPTH} deep",
        hint="give long lists as parameters ($name), and ask less at once",
        span=span if source is not None else None,
        source=source,
    )
