"""Query text -> tree: ``parse``, ``parse_script`` and ``parse_condition``; and what completion and colours need.

The grammar is cgql.lark. Its LALR(1) tables are run here by one loop, which makes the tree as it goes: no parse tree
between, no recursion, and an effort that grows with the length of the text alone.
"""

from __future__ import annotations

from functools import cache
from typing import TYPE_CHECKING, Any, cast

from cgdb.errors import ParseError
from cgdb.grammar import ast
from cgdb.grammar.build import BUILD
from cgdb.grammar.limits import MAX_DEPTH, check_text, check_tree
from cgdb.grammar.machine import GROUPS, machine

if TYPE_CHECKING:
    from cgdb.grammar.completion import Expected, expected
    from cgdb.grammar.highlight import tokens

__all__ = ["Expected", "expected", "grammar", "parse", "parse_condition", "parse_script", "tokens"]


def grammar() -> str:
    """The text of cgql.lark, for model servers that constrain their output by a Lark grammar."""
    from importlib.resources import files

    return files("cgdb.grammar").joinpath("cgql.lark").read_text(encoding="utf-8")


def __getattr__(name: str) -> Any:
    # Only shells and editors need these; every process pays for what is imported.
    if name in ("Expected", "expected"):
        from cgdb.grammar import completion

        return getattr(completion, name)
    if name == "tokens":
        from cgdb.grammar.highlight import tokens

        return tokens
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")


def parse(text: str) -> ast.Query:
    """The tree of one statement; a semicolon may end it."""
    return cast(ast.Query, _run(text, "start"))


def parse_script(text: str) -> tuple[ast.Query, ...]:
    """The trees of statements that are separated by semicolons; places count from the start of the whole text."""
    return cast("tuple[ast.Query, ...]", _run(text, "script"))


def parse_condition(text: str) -> ast.Expression:
    """The tree of a condition alone: what may follow WHERE."""
    return cast(ast.Expression, _run(text, "condition"))


@cache
def _settled() -> list[dict[int, int]]:
    """For each state: where a symbol and the terminal after it lead once every rule that only passes it on is done.

    Without it, a lone ``o`` climbs one by one from operand to expression. Filled as it is met; it follows from the
    tables alone, so that threads may fill it at once.
    """
    return [{} for _ in machine().rows]


def _run(text: str, root: str) -> Any:
    check_text(text, script=root == "script")
    m = machine()
    rows, gotos, rules, signs, words, groups = m.rows, m.gotos, m.rules, m.signs, m.words, m.groups
    name, reserved, roles = m.name, m.reserved, m.roles
    build, settled = BUILD, _settled()
    state, final = m.starts[root]
    word_group, sign_group = GROUPS.index("NAME") + 1, GROUPS.index("SIGN") + 1
    states, values, starts = [state], [], []  # type: list[int], list[Any], list[int]
    last = 0
    try:
        for count, match in enumerate(m.scanner.finditer(text)):
            group = match.lastindex
            assert group is not None
            lexeme = match[group]
            start = match.start(group)
            row = rows[state]
            if group == word_group:
                terminal = words.get(lexeme.upper(), name)
                if terminal not in row and name in row and not (terminal in reserved and "variable" in roles[state]):
                    terminal = name
            elif group == sign_group:
                terminal = signs[lexeme]
            else:
                terminal = groups[group]
            while True:
                action = row.get(terminal)
                if action is None:
                    if terminal == m.end and state == final:
                        if count > MAX_DEPTH:  # each node has a token of its own
                            for tree in values[0] if root == "script" else values:
                                check_tree(tree, text)
                        return values[0]
                    from cgdb.grammar.mistakes import mistake

                    raise mistake(text, root)
                if action >= 0:
                    state = action
                    states.append(state)
                    values.append(lexeme)
                    starts.append(start)
                    last = match.end()
                    break
                left, length, maker = rules[~action]
                if length == 0:
                    values.append(build[maker]([], start, start))
                    starts.append(start)
                else:
                    if maker:
                        values[-length:] = [build[maker](values[-length:], starts[-length], last)]
                    if length > 1:
                        del starts[1 - length :]
                    del states[-length:]
                below = states[-1]
                key = left << 8 | terminal
                found = settled[below].get(key)
                if found is None:
                    found = gotos[below][left]
                    while (reduction := rows[found].get(terminal, 0)) < 0 and rules[~reduction][1:] == (1, ""):
                        found = gotos[below][rules[~reduction][0]]
                    settled[below][key] = found
                state = found
                states.append(state)
                row = rows[state]
    except ParseError as error:
        raise error.located(text) from None
    raise AssertionError("the scanner matches at every place")
