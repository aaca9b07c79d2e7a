"""What the prompt offers: of a command its name and argument, of a statement what the language expects."""

from __future__ import annotations

import os
from collections.abc import Iterable
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from cgdb.cli.commands import ALIASES, COMMANDS
from cgdb.cli.complete import MOST, Choice, complete
from cgdb.cli.settings import MODES, OPTIONS
from cgdb.cli.themes import THEMES
from cgdb.errors import CgdbError

if TYPE_CHECKING:
    from cgdb.cli.session import Session


def offered(session: Session, text: str, cursor: int, *, asked: bool) -> list[Choice]:
    """The choices at the cursor, likeliest first."""
    begin = text.rfind("\n", 0, cursor) + 1
    line = text[begin:cursor]
    if not line.lstrip().startswith(":") or text[:begin].strip().strip(";"):
        return complete(text, cursor, session.vocabulary, asked=asked)
    start = begin + len(line) - len(line.lstrip())
    name, space, rest = text[start + 1 : cursor].partition(" ")
    if not space:
        return [
            Choice(text=f":{known}", start=start, kind="command", says=command.says)
            for known, command in COMMANDS.items()
            if known.startswith(name.casefold())
        ]
    command = COMMANDS.get(ALIASES.get(name, name))
    if command is None:
        return []
    at = cursor - len(rest)
    if command.kind == "statement":
        found = complete(text[at:], cursor - at, session.vocabulary, asked=asked)
        return [replace(choice, start=choice.start + at) for choice in found]
    return _arguments(session, command.kind, rest, cursor)


def _arguments(session: Session, kind: str, rest: str, cursor: int) -> list[Choice]:
    word = rest.rpartition(" ")[2]
    earlier = rest[: len(rest) - len(word)].split()
    start = cursor - len(word)
    known = session.vocabulary

    def some(names: Iterable[tuple[str, str]], of: str, *, ending: str = "") -> list[Choice]:
        begun = [
            Choice(text=name + ending, start=start, kind=of, says=says)
            for name, says in names
            if name.casefold().startswith(word.casefold())
        ]
        return begun[:MOST]

    if kind == "file" and earlier:
        kind = "scene"
    if kind == "file":
        return _files(word, start)
    if kind == "scene":
        return some(((_as_word(name), says) for name, says in known.scenes().items()), "scene")
    if kind == "object" and not earlier:
        return [
            Choice(text=f"#{written}", start=start, kind="object", says=tag)
            for written, tag in known.ids()
            if written.startswith(word.removeprefix("#")) or (word and tag.casefold().startswith(word.casefold()))
        ][:MOST]
    if kind == "mode":
        return some(((name, "") for name in MODES), kind)
    if kind == "theme":
        return some(((name, "") for name in (*THEMES, "auto")), kind)
    if kind == "parameter":
        return some(known.parameters().items(), kind)
    if kind == "set":
        if not earlier:
            held = {f"${name}": value for name, value in known.parameters().items()}
            return some(
                [*((name, option.says) for name, option in OPTIONS.items()), *held.items()], "option", ending=" "
            )
        option = OPTIONS.get(earlier[0])
        return some(((choice, "") for choice in option.choices), "value") if option and len(earlier) == 1 else []
    if kind == "topic":
        from cgdb.cli.helping import topics

        return some([*((name, "") for name in topics()), *((f":{n}", c.says) for n, c in COMMANDS.items())], kind)
    if kind == "favourite" and not earlier:
        try:
            kept = session.favourites.all()
        except CgdbError:
            return []
        return some(((name, " ".join(item.text.split())) for name, item in kept.items()), kind)
    return []


def _files(word: str, start: int) -> list[Choice]:
    folder, name = os.path.split(word)
    try:
        entries = sorted(
            os.scandir(Path(folder or ".").expanduser()), key=lambda entry: (not entry.is_dir(), entry.name)
        )
    except OSError:
        return []
    return [
        Choice(
            text=os.path.join(folder, entry.name) + ("/" if entry.is_dir() else ""),  # noqa: PTH118 -- keeps "./" and "~"
            start=start,
            kind="folder" if entry.is_dir() else "file",
        )
        for entry in entries
        if entry.name.startswith(name)
        and (name.startswith(".") or not entry.name.startswith("."))
        and entry.name.isprintable()
    ][:MOST]


def _as_word(name: str) -> str:
    return (
        name
        if name.isidentifier() or not set(name) & set(" '\"\\,")
        else '"' + name.replace("\\", "\\\\").replace('"', '\\"') + '"'
    )
