"""A text of several statements and commands -> its pieces, each with the line on which it begins."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

from cgdb.errors import CgdbError
from cgdb.grammar.machine import machine
from cgdb.grammar.parser import expected, parse


@dataclass(frozen=True, slots=True, kw_only=True)
class Piece:
    """A statement, or a command when it begins with a colon. line: counted from 1."""

    text: str
    line: int

    @property
    def command(self) -> bool:
        """Whether it is a command of the shell."""
        return self.text.startswith(":")


def pieces(text: str) -> Iterator[Piece]:
    """The pieces in order. Statements end with a semicolon, commands (``:name ...``) with their line."""
    at, end = 0, len(text)
    while at < end:
        first = next(token for token in machine().scan(text, at) if token.text != ";")
        if first.group == "end":
            return
        line = text.count("\n", 0, first.start) + 1
        if first.text == ":":
            stop = text.find("\n", first.start)
            stop = end if stop < 0 else stop
            yield Piece(text=text[first.start : stop].strip(), line=line)
            at = stop
            continue
        stop = end
        for token in machine().scan(text, first.start):
            if token.text == ";" and token.group == "SIGN":
                stop = token.start
                break
        yield Piece(text=text[first.start : stop].rstrip(), line=line)
        at = stop + 1


def complete(text: str) -> bool:
    """Whether Enter should run what was typed, rather than begin a new line.

    Yes for commands, after a semicolon, for a whole statement on one line, and for what no further line could make
    right: waiting for more there would only keep the error from the person.
    """
    stripped = text.strip()
    if not stripped or stripped.startswith(":"):
        return True
    tokens = [token for token in machine().scan(text) if token.group != "end"]
    if tokens and tokens[-1].text == ";":
        return True
    blank = text.rpartition("\n")[2].strip() == ""
    if not tokens:
        return blank
    if "\n" not in text.rstrip() or blank:
        try:
            parse(text)
        except CgdbError:
            pass
        else:
            return True
    want = expected(text + "\n")
    # Quotes do not reach over lines. A semicolon alone is no reason to wait for more.
    return tokens[-1].group == "open" or not (want.categories - {"sign"} or set(want.signs) - {";"})
