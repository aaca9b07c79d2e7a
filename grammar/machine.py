"""The tables of the grammar made ready to run: a scanner and a pushdown automaton over the same numbered terminals.

Two users: the parser, which has its own tight loop over the tables, and everything that must know what could stand at a
place (error messages, completion, highlighting), which steps a Walk.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cache
from typing import NamedTuple

from cgdb.grammar import tables
from cgdb.grammar.ast import UNITS

KEYWORDS = frozenset(t for t in tables.TERMINALS if t.isupper() and t not in tables.PATTERNS)
"""The keywords, in upper case."""

RESERVED = KEYWORDS - {"EXPLAIN", "PROFILE", "USE", "OF", "BY", "ASC", "DESC", "TOP", "WITH"}
"""The keywords that need backticks as the name of a variable or function.

The tables alone would read ``RETURN order BY x`` as the return of a variable, and blame the BY.
"""

# The groups of the scanner. A quote that is never closed is open; a character that starts nothing is unknown.
GROUPS = (
    *("NAME", "EDGE", "EDGE_IN", "SIGN", "TEXT", "INCHES", "DECIMAL", "INTEGER", "PARAMETER", "QUOTED"),
    *("end", "open", "unknown"),
)


class Token(NamedTuple):
    """A piece of the text; group is one of GROUPS."""

    group: str
    text: str
    start: int
    end: int


@dataclass(frozen=True, slots=True)
class Machine:
    """The tables with numbers for names. A row maps a terminal to an action: n >= 0 shifts to n, n < 0 reduces ~n."""

    terminals: tuple[str, ...]
    rows: tuple[dict[int, int], ...]
    gotos: tuple[dict[int, int], ...]
    roles: tuple[frozenset[str], ...]
    """For each state, what a name or text that comes next would stand for."""
    rules: tuple[tuple[int, int, str], ...]
    """Left side, number of symbols, and the name of the function that makes the value; "" passes the value on."""
    scanner: re.Pattern[str]
    signs: dict[str, int]
    words: dict[str, int]
    """Keywords and units, in upper case."""
    groups: tuple[int, ...]
    """The terminal of each group of the scanner, counted from 1 as re does; -1 where the group does not tell."""
    name: int
    end: int
    reserved: frozenset[int]
    starts: dict[str, tuple[int, int]]

    def terminal(self, state: int, group: str, text: str) -> int:
        """The terminal that a token is in a state: a keyword only where one has a place. -1: none that there is."""
        if group == "NAME":
            word = self.words.get(text.upper(), self.name)
            row = self.rows[state]
            if word in row or self.name not in row or (word in self.reserved and "variable" in self.roles[state]):
                return word
            return self.name
        if group == "SIGN":
            return self.signs[text]
        return self.groups[GROUPS.index(group) + 1]

    def scan(self, text: str, start: int = 0) -> Iterator[Token]:
        """The tokens of any text at all; the last one is the end."""
        for match in self.scanner.finditer(text, start):
            group = match.lastgroup or "end"
            yield Token(group, match[group], match.start(group), match.end(group))
            if group == "end":
                return


@cache
def machine() -> Machine:
    """The one machine, made on first use."""
    number = {text: i for i, text in enumerate(tables.TERMINALS)}
    rules = []
    for line in tables.RULES:
        left, length, *action = line.split()
        rules.append((int(left), int(length), action[0] if action else ""))
    return Machine(
        terminals=tables.TERMINALS,
        rows=_rows(tables.ACTIONS),
        gotos=_rows(tables.GOTOS),
        roles=tuple(frozenset(line.split()) for line in tables.ROLES),
        rules=tuple(rules),
        scanner=_scanner(),
        signs={t: i for t, i in number.items() if not t[0].isalpha()},
        words={word: number[word] for word in KEYWORDS} | {u.upper(): number["UNIT"] for u in UNITS if u != "in"},
        groups=(-1, *(number.get(group, -1) for group in GROUPS)),
        name=number["NAME"],
        end=number["end"],
        reserved=frozenset(number[word] for word in RESERVED),
        starts=tables.STARTS,
    )


def _rows(lines: tuple[str, ...]) -> tuple[dict[int, int], ...]:
    seen: dict[str, dict[int, int]] = {}
    for line in lines:
        if line not in seen:
            pairs = (pair.split(":") for pair in line.split())
            seen[line] = {int(key): int(value) for key, value in pairs}
    return tuple(seen[line] for line in lines)


def _scanner() -> re.Pattern[str]:
    """One expression for a token with the space before it; it matches at every place of any text."""
    pattern = {name: re.sub(r"(?<!\\)\((?!\?)", "(?:", text) for name, text in tables.PATTERNS.items()}
    signs = sorted((t for t in tables.TERMINALS if not t[0].isalpha()), key=len, reverse=True)
    pattern["SIGN"] = "|".join(map(re.escape, signs))
    # Whole words only: 5inside is a number and a word, where the grammar alone, without look-around, would see 5in.
    pattern["INCHES"] += r"(?!\w)"
    # People write (a) - [:on] -> (b) too.
    pattern["EDGE"] = r"-[ \t\r\n]*\["
    pattern["EDGE_IN"] = r"<-[ \t\r\n]*\["
    pattern["end"] = r"\Z"
    pattern["open"] = r"[\"'`][^\n]*"
    pattern["unknown"] = r"(?s:.)"
    space = f"(?:{pattern['SPACE']})?(?:{pattern['COMMENT']}(?:{pattern['SPACE']})?)*"
    return re.compile(f"{space}(?:" + "|".join(f"(?P<{group}>{pattern[group]})" for group in GROUPS) + ")")


class Walk:
    """The automaton without values: which states a text leads through, and what each could go on with."""

    __slots__ = ("machine", "states")

    def __init__(self, root: str = "start") -> None:
        self.machine = machine()
        self.states = [self.machine.starts[root][0]]

    @property
    def state(self) -> int:
        return self.states[-1]

    def step(self, terminal: int) -> int | None:
        """Take a terminal; the state that shifted it (its roles say what a name stood for), or None: it does not fit.

        A refusal leaves the walk as it was, not some reductions further.
        """
        found = self._reach(terminal)
        if found is None:
            return None
        self.states = found
        shifting = self.states[-1]
        action = self.machine.rows[shifting][terminal]
        self.states.append(action)
        return shifting

    def ends(self) -> bool:
        """Whether the text may end here."""
        return self._reach(self.machine.end) is not None

    def acceptable(self) -> dict[int, int]:
        """Every terminal that fits next, with the state that would shift it."""
        found = {}
        for terminal in self.machine.rows[self.state]:
            states = self._reach(terminal)
            if states is not None:
                found[terminal] = states[-1]
        return found

    def _reach(self, terminal: int) -> list[int] | None:
        """The states after the reductions that a terminal asks for, up to its shift, or None."""
        m = self.machine
        states = self.states.copy()
        accepting = {end for _, end in m.starts.values()}
        while True:
            if terminal == m.end and states[-1] in accepting:
                return states
            action = m.rows[states[-1]].get(terminal)
            if action is None:
                return None
            if action >= 0:
                return states
            left, length, _ = m.rules[~action]
            if length:
                del states[-length:]
            states.append(m.gotos[states[-1]][left])
