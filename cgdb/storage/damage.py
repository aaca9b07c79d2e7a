"""What is wrong with a ledger: the check of every row, every total, and of the file itself."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from functools import partial

from cgdb.errors import StoreError
from cgdb.storage import history, reader, sqlite
from cgdb.storage.history import Header
from cgdb.storage.reader import Lifetime, Reading
from cgdb.storage.rows import MASK


@dataclass(frozen=True, slots=True, kw_only=True)
class Damage:
    """One thing that is not as it was written. scene is None where it is the file's or the history's."""

    scene: str | None
    what: str
    message: str


def inspect(reading: Reading, *, full: bool) -> list[Damage]:
    """All damage. full reads every revision of every scene and SQLite's whole integrity check."""
    found: list[Damage] = []

    def attempt(scene: str | None, what: str, action: Callable[[], object]) -> None:
        try:
            action()
        except StoreError as error:
            found.append(Damage(scene=scene, what=what, message=error.message))

    def file() -> None:
        with reading() as connection:
            found.extend(
                Damage(scene=None, what="file", message=text) for text in sqlite.integrity(connection, full=full)
            )

    def revisions() -> None:
        with reading() as connection:
            for _ in history.read_revisions(connection):
                pass

    def scenes() -> None:
        with reading() as connection:
            names = history.scene_names(connection)
            last = history.latest(connection)
        for name, number in names.items():
            attempt(name, "scene", partial(scene, name, number, last))

    def scene(name: str, number: int, last: int) -> None:
        with reading() as connection:
            headers = history.read_versions(connection, number, name, last)
        if not full:
            headers = headers[-1:]
        for part in parts(headers):
            found.extend(_check_part(reading, headers, part, full=full))

    attempt(None, "file", file)
    attempt(None, "revisions", revisions)
    attempt(None, "scenes", scenes)
    return list(dict.fromkeys(found))


def parts(headers: Sequence[Header]) -> list[str]:
    """Every part that the scene ever had; those that are always looked at first."""
    return list(dict.fromkeys(["nodes", "relations", "clouds", "views", *(part for h in headers for part in h.totals)]))


def _check_part(reading: Reading, headers: list[Header], part: str, *, full: bool) -> list[Damage]:
    """Every row against its digest, every state against its total."""
    if not headers:
        return []
    name = headers[-1].name
    damaged: list[str] = []
    wrong = unsummed(headers, part, reader.lifetimes(reading, headers[-1].info(None), part, damaged, every=full))
    found = [Damage(scene=name, what=part, message=message) for message in damaged]
    if not wrong or damaged:
        return found
    with reading() as connection:
        # What was pruned since the states were read is not missed.
        kept = [
            (header, rows) for header, rows in wrong if history.state_kept(connection, header.scene_id, header.revision)
        ]
    for header, rows in kept:
        count = header.totals.get(part, (0, 0))[0]
        message = f"revision {header.revision}: {part} are not complete: {rows} rows of {count} are there"
        found.append(Damage(scene=name, what=part, message=message))
    return found


def unsummed(headers: Sequence[Header], part: str, lifetimes: Iterable[Lifetime]) -> list[tuple[Header, int]]:
    """The states of a scene, oldest first, whose total of a part its rows do not make up, and how many rows there are.

    What came and went is summed up revision by revision: each row counts once, in however many it lived.
    """
    came: dict[int, list[int]] = {}
    for row in lifetimes:
        for revision, sign in ((row.rev_from, 1), (row.rev_to, -1)):
            if revision is not None:
                delta = came.setdefault(revision, [0, 0])
                delta[0] += sign
                delta[1] += sign * row.digest
    wrong: list[tuple[Header, int]] = []
    changes = sorted(came.items(), reverse=True)
    count = total = 0
    for header in headers:
        while changes and changes[-1][0] <= header.revision:
            _, (number, digests) = changes.pop()
            count, total = count + number, total + digests
        if (count, total & MASK) != header.totals.get(part, (0, 0)):
            wrong.append((header, count))
    return wrong
