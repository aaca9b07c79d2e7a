"""``:help``: the commands, the keys, and the topics of the language's reference."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from functools import cache
from importlib.resources import files
from typing import TYPE_CHECKING

from cgdb.cli import tables
from cgdb.cli.commands import COMMANDS, find
from cgdb.errors import CgdbError, UsageError, did_you_mean, one_of

if TYPE_CHECKING:
    from rich.text import Text

    from cgdb.cli.session import Session

KEYS = (
    ("Enter", "run what is complete, else begin a new line"),
    ("Alt-Enter", "a new line in any case"),
    ("Tab", "what could stand here; once more chooses"),
    ("→ or Ctrl-E", "take the grey suggestion"),
    ("Ctrl-R", "search earlier statements"),
    ("F4 or Ctrl-X Ctrl-E", "edit in $EDITOR"),
    ("Ctrl-C", "cancel the query, or clear the line"),
    ("Ctrl-D", "leave"),
)


def help_(session: Session, rest: str) -> None:
    """The commands, or a topic."""
    session.screen.page(_overview(session) if not rest else _topic(session, rest))


def _overview(session: Session) -> list[Text]:
    screen = session.screen
    lines = [screen.text(("head", "commands"))]
    size = max(len(f":{name} {command.takes}") for name, command in COMMANDS.items())
    for name, command in COMMANDS.items():
        call = f":{name}"
        pad = " " * (size - len(call) - len(command.takes))
        lines.append(screen.text(("hint", f"  {call}"), ("faint", f" {command.takes}{pad}"), ("", f" {command.says}")))
    lines += [screen.text(), screen.text(("head", "keys"))]
    lines += [screen.text(("hint", f"  {key:<21}"), ("", says)) for key, says in KEYS]
    lines += [screen.text(), screen.text(("head", "the language"), ("faint", "  (:help TOPIC)"))]
    for part in tables.folded(", ".join(topics()), screen.width - 4 if screen.terminal else None):
        lines.append(screen.text(("", f"  {part}")))
    lines.append(screen.text())
    lines.append(screen.code('MATCH (o ~ "something to drink") WHERE NOT o ~ "soda" RETURN o LIMIT 3'))
    return lines


@cache
def topics() -> Mapping[str, str]:
    """{heading of the reference: its text}, in order."""
    text = files("cgdb.grammar").joinpath("README.md").read_text("utf-8")
    found: dict[str, str] = {}
    for part in re.split(r"^(?=#{1,4} )", text, flags=re.MULTILINE):
        if part.startswith("#"):
            heading, _, body = part.partition("\n")
            found[heading.lstrip("# ").strip()] = body.strip("\n")
    return found


def _topic(session: Session, wanted: str) -> list[Text]:
    screen = session.screen
    word = wanted.removeprefix(":").casefold()
    if wanted.startswith(":") or (word in COMMANDS and not _headings(word)):
        try:
            command = find(word)
        except CgdbError as error:
            raise UsageError(f"there is no help on '{wanted[:40]}'", hint=error.hint) from None
        name = next(name for name, known in COMMANDS.items() if known is command)
        return [
            screen.text(("hint", f":{name}"), ("faint", f" {command.takes}")),
            screen.text(("", f"  {command.says}")),
        ]
    headings = _headings(word)
    if not headings:
        names = list(topics())
        known = [*names, *(part for name in names for part in name.split(", ")), *COMMANDS]
        raise UsageError(
            f"there is no help on '{wanted[:40]}'",
            hint=did_you_mean(wanted, known) or f"topics: {one_of(names, most=30)}",
        )
    lines: list[Text] = []
    for heading in headings:
        lines.append(screen.text(("head", heading)))
        lines += _markdown(session, topics()[heading])
    return lines


def _headings(word: str) -> list[str]:
    """The headings that a word means: by name, by one of their words, or by how they begin."""
    names = list(topics())
    exact = [name for name in names if name.casefold() == word or word in name.casefold().split(", ")]
    if exact:
        return exact[:1]
    partly = [name for name in names if word in name.casefold().replace(",", "").split()]
    return partly or [name for name in names if name.casefold().startswith(word)][:1]


def _markdown(session: Session, text: str) -> Iterator[Text]:
    """The little markdown that the reference is written in, for a terminal."""
    screen = session.screen
    width = screen.width - 2 if screen.terminal else None
    code: list[str] | None = None
    paragraph: list[str] = []
    rows: list[tuple[str, str]] = []

    def flush() -> Iterator[Text]:
        if paragraph:
            for line in tables.folded(_unmarked(" ".join(paragraph)), width):
                yield screen.text(("", line))
            paragraph.clear()

    def table() -> Iterator[Text]:
        most = 40 if width is None else max(16, int(0.45 * width))
        size = max((len(name) for name, _ in rows if len(name) <= most), default=0)
        for number, (name, says) in enumerate(rows):
            part = "faint" if number == 0 else "hint"
            if len(name) > size:
                yield screen.text((part, f"  {name}"))
                name = ""
            for n, line in enumerate(tables.folded(says, None if width is None else max(16, width - size - 4))):
                yield screen.text((part, f"  {name if n == 0 else '':<{size}}"), ("", f"  {line}"))
        rows.clear()

    for line in [*text.split("\n"), ""]:
        if rows and not line.startswith("|"):
            yield from table()
        if code is not None:
            if line.startswith("```"):
                for part in code:
                    made = screen.text(("", "  "))
                    made.append_text(screen.code(part))
                    yield made
                code = None
            else:
                code.append(line)
        elif line.startswith("```"):
            yield from flush()
            code = []
        elif line.startswith("|"):
            yield from flush()
            if not set(line) <= set("|-: "):
                cells = [_unmarked(cell.replace("\\|", "|")).strip() for cell in re.split(r"(?<!\\)\|", line)[1:-1]]
                rows.append((cells[0], " · ".join(cells[1:])))
            continue
        elif line.startswith(("- ", "* ")) or not line.strip():
            yield from flush()
            if line.strip():
                paragraph.append(line)
        else:
            paragraph.append(line.strip())
    yield from flush()


def _unmarked(text: str) -> str:
    text = re.sub(r"\[([^\]]*)\]\([^)]*\)", r"\1", text)
    return re.sub(r"\*\*([^*]+)\*\*", r"\1", re.sub(r"``? ?(.*?) ?``?", r"\1", text))
