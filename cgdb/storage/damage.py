"""What is wrong with a ledger: the check of every row, every total, and of the file itself."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial

from cgdb.errors import StoreError
from cgdb.storage import history, reader, sqlite
from cgdb.storage.history import Header
from cgdb.storage.reader import Reading
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
        for part in _parts(headers):
            found.extend(_check_part(reading, headers, part, full=full))

    attempt(None, "file", file)
    attempt(None, "revisions", revisions)
    attempt(None, "scenes", scenes)
    return list(dict.fromkeys(found))


def _parts(headers: list[Header]) -> list[str]:
    """Every part that the scene ever had; those that are always looked at first."""
    return list(dict.fromkeys(["nodes", "relations", "clouds", "views", *(part for h in headers for part in h.totals)]))


def _check_part(reading: Reading, headers: list[Header], part: str, *, full: bool) -> list[Damage]:
    """Each row once, in however many revisions it lived; what came and went is then summed up revision by revision."""
    if not headers:
        return []
    name = headers[-1].name
    damaged: list[str] = []
    came: dict[int, list[int]] = {}
    for row in reader.lifetimes(reading, headers[-1].info(None), part, damaged, every=full):
        for revision, sign in ((row.rev_from, 1), (row.rev_to, -1)):
            if revision is not None:
                delta = came.setdefault(revision, [0, 0])
                delta[0] += sign
                delta[1] += sign * row.digest
    found = [Damage(scene=name, what=part, message=message) for message in damaged]
    for header in headers:
        count, total = header.totals.get(part, (0, 0))
        reached = [delta for revision, delta in came.items() if revision <= header.revision]
        counted = sum(delta[0] for delta in reached)
        if (counted, sum(delta[1] for delta in reached) & MASK) != (count, total) and not damaged:
            message = f"revision {header.revision}: {part} are not complete: {counted} rows of {count} are there"
            found.append(Damage(scene=name, what=part, message=message))
    return found
