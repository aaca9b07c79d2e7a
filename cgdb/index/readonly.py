"""What a Cypher statement may say: read the graph index, and nothing else of this machine.

A file opened read-only is not enough. Measured on kuzu 0.11.3 and ladybug 0.22.0: a read-only connection still carries
out COPY ... TO and EXPORT (they write files), LOAD FROM (reads files), INSTALL and LOAD (network, native code) and
CALL name=value (settings). And some harmless-looking texts end or stall the process: 1,000 nested brackets or a sum of
10,000 terms overflow the native stack; range() and lpad() build their whole answer before any time-out is looked at;
any(x IN list WHERE ...) over some thousand rows overruns memory. So a statement is read by the engines' own lexical
rules and must consist of what is known to be safe.
"""

from __future__ import annotations

import re

from cgdb.errors import ExecuteError, LimitError, Span, one_of

BEGINNINGS = ("MATCH", "OPTIONAL", "UNWIND", "WITH", "RETURN", "CALL", "EXPLAIN", "PROFILE")
CALLABLE = ("SHOW_TABLES", "TABLE_INFO", "SHOW_CONNECTION", "SHOW_FUNCTIONS", "DB_VERSION")
WRITES = frozenset(
    (
        "CREATE",
        "MERGE",
        "SET",
        "DELETE",
        "DETACH",
        "DROP",
        "ALTER",
        "COMMENT",
        "MACRO",
        "BEGIN",
        "COMMIT",
        "ROLLBACK",
        "CHECKPOINT",
        "TRANSACTION",
    )
)
OUTSIDE = frozenset(
    (
        "COPY",
        "LOAD",
        "HEADERS",
        "GLOB",
        "EXPORT",
        "IMPORT",
        "ATTACH",
        "DATABASE",
        "USE",
        "INSTALL",
        "UNINSTALL",
        "UPDATE",
        "FORCE",
        "EXTENSION",
    )
)
UNBOUNDED = frozenset(("RANGE", "REPEAT", "LPAD", "RPAD", "NEXTVAL", "SETSEED"))
OVERRUNS = frozenset(("ANY", "NONE", "SINGLE", "LIST_TRANSFORM", "LIST_FILTER", "LIST_REDUCE"))
LONGEST = 100_000
MOST_TOKENS = 2_000
DEEPEST = 32

_TOKEN = re.compile(
    r"""
    (?P<space> [ \t\n\r\f\v]+ )
  | (?P<text> "(?:[^"\\]|\\(?:[\\'"bBfFnNrRtT]|[xX][0-9a-fA-F]{2}|[uU][0-9a-fA-F]{4}))*"
            | '(?:[^'\\]|\\(?:[\\'"bBfFnNrRtT]|[xX][0-9a-fA-F]{2}|[uU][0-9a-fA-F]{4}))*' )
  | (?P<quoted> (?:`[^`]*`)+ )
  | (?P<comment> //|/\* )
  | (?P<parameter> \$[A-Za-z_0-9]+ )
  | (?P<word> [A-Za-z_][A-Za-z_0-9]* )
  | (?P<number> [0-9]+ )
  | (?P<open> [(\[{] )
  | (?P<close> [)\]}] )
  | (?P<sign> [-+*/%^=<>!|&.,:;~@#?] )
    """,
    re.VERBOSE,
)


def check_read_only(statement: str) -> frozenset[str]:
    """Raise ExecuteError, with the place, unless the statement only reads the graph index; LimitError if outsized.

    Returns the names of its parameters.
    """
    if len(statement) > LONGEST:
        raise LimitError(f"the statement is longer than {LONGEST:,} characters")
    tokens = _tokens(statement)
    if not tokens:
        raise ExecuteError("the statement is empty", hint="begin with " + one_of(BEGINNINGS))
    if len(tokens) > MOST_TOKENS:
        raise LimitError(
            f"the statement has {len(tokens):,} words and signs, {MOST_TOKENS:,} are allowed",
            hint="give long lists as parameters",
        )
    first = tokens[0]
    if first[0] != "word" or first[1].upper() not in BEGINNINGS:
        _check_word(statement, first)
        raise _refused(
            statement, first, f"a statement cannot begin with '{first[1][:40]}'", "begin with " + one_of(BEGINNINGS)
        )
    depth = 0
    for place, token in enumerate(tokens):
        kind, text, _ = token
        following = tokens[place + 1][1] if place + 1 < len(tokens) else ""
        if kind == "open":
            depth += 1
            if depth > DEEPEST:
                raise LimitError(f"the statement is nested more than {DEEPEST} brackets deep")
        elif kind == "close":
            depth -= 1
        elif kind == "quoted" and following == "(":
            raise _refused(statement, token, "a function is named without backticks", None)
        elif kind == "sign" and text == ";" and following:
            raise _refused(statement, token, "one statement at a time", None)
        elif kind == "word":
            _check_word(statement, token)
            if text.upper() == "ALL" and following == "(":
                raise _refused(statement, token, "all() is not available: it crashes the engine", "UNWIND the list")
            if text.upper() == "CALL":
                called = tokens[place + 1] if place + 1 < len(tokens) else token
                after = tokens[place + 2][1] if place + 2 < len(tokens) else ""
                if called[1].upper() not in CALLABLE or after != "(":
                    raise _refused(statement, called, "only a few things can be called", "they are " + one_of(CALLABLE))
    return frozenset(text[1:] for kind, text, _ in tokens if kind == "parameter")


def _tokens(statement: str) -> list[tuple[str, str, int]]:
    found: list[tuple[str, str, int]] = []
    place = 0
    while place < len(statement):
        match = _TOKEN.match(statement, place)
        if match is None:
            raise _unreadable(statement, place)
        kind = match.lastgroup or ""
        if kind == "comment":
            raise _refused(statement, (kind, match[0], place), "comments are not read here", None)
        if kind != "space":
            found.append((kind, match[0], place))
        place = match.end()
    return found


def _check_word(statement: str, token: tuple[str, str, int]) -> None:
    word = token[1].upper()
    if word in WRITES:
        raise _refused(statement, token, f"{word} would change the graph index: it is only read", "change the ledger")
    if word in OUTSIDE:
        raise _refused(statement, token, f"{word} would reach outside of the graph index", None)
    if word in OVERRUNS:
        raise _refused(statement, token, f"{word.lower()}() is not available: it crashes the engine", "UNWIND the list")
    if word in UNBOUNDED:
        raise _refused(
            statement, token, f"{word.lower()}() is not available: nothing bounds what it takes", "use a parameter"
        )


def _unreadable(statement: str, place: int) -> ExecuteError:
    character = statement[place]
    token = ("", character, place)
    if character in "'\"":
        return _refused(
            statement, token, "this text has no end, or an escape that is not known", "give it as a parameter"
        )
    if character == "`":
        return _refused(statement, token, "this name has no end", None)
    return _refused(
        statement, token, f"{character!r} does not belong here", "a name with such characters stands in backticks"
    )


def _refused(statement: str, token: tuple[str, str, int], message: str, hint: str | None) -> ExecuteError:
    return ExecuteError(message, hint=hint, span=Span(token[2], token[2] + len(token[1])), source=statement)
