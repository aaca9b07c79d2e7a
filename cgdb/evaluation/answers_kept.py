"""Answers of an evaluation in a file: a JSON line per query and way, written at once, and read when it goes on."""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any, TextIO

from cgdb.errors import UsageError
from cgdb.evaluation.judged import JudgedQuery
from cgdb.evaluation.retrieval import Outcome
from cgdb.model.llm import Usage

Key = tuple[str, str, str, str]
"""Map, way, id and text of a query: a query that was reworded is asked anew."""


class Kept:
    """The answers of one file. Grades are written for people, and never read: judgements may have changed."""

    def __init__(self, file: TextIO, known: Mapping[Key, Outcome]) -> None:
        self._file = file
        self._known = known

    def find(self, place: str, way: str, query: JudgedQuery) -> Outcome | None:
        """What was answered before; None for what was not asked, or failed."""
        return self._known.get((place, way, query.id, query.query))

    def add(self, place: str, way: str, query: JudgedQuery, outcome: Outcome) -> None:
        """Write one answer."""
        line = {
            "map": place,
            "query": query.id,
            "kind": query.kind,
            "text": query.query,
            "way": way,
            "ids": list(outcome.ids),
            "grades": [query.relevant.get(i, 0) for i in outcome.ids],
            "relevant": dict(query.relevant),
            "achievable": outcome.achievable,
            "seconds": round(outcome.seconds, 4),
            "usage": outcome.usage.to_dict(),
            "error": outcome.error,
            **({"answer": dict(outcome.record)} if outcome.record else {}),
        }
        self._file.write(json.dumps(line, ensure_ascii=False) + "\n")
        self._file.flush()


@contextmanager
def kept(path: Path, *, resume: bool) -> Iterator[Kept]:
    """The answers in a file, begun anew or gone on with. UsageError where it cannot be written or is something else."""
    known = _read(path) if resume else {}
    try:
        file = path.open("a" if resume else "w", encoding="utf-8")
    except IsADirectoryError:
        raise UsageError(f"{path} is a folder", hint="--save takes a file") from None
    except FileNotFoundError:
        raise UsageError(f"there is no folder {path.parent}") from None
    except OSError as error:
        raise UsageError(f"{path} cannot be written: {error.strerror or error}", hint="--save FILE") from None
    with file:
        yield Kept(file, known)


def _read(path: Path) -> dict[Key, Outcome]:
    try:
        raw = path.read_bytes()
    except FileNotFoundError:
        return {}
    except OSError as error:
        raise UsageError(f"{path} cannot be read: {error.strerror or error}") from None
    known: dict[Key, Outcome] = {}
    whole = raw.rpartition(b"\n")[0]
    for number, line in enumerate(whole.splitlines(), start=1):
        try:
            record = json.loads(line)
            key = (record["map"], record["way"], record["query"], record["text"])
            if record["error"] is None and all(isinstance(part, str) for part in key):
                known[key] = _outcome(record)
        except (ValueError, KeyError, TypeError, AttributeError, RecursionError):
            raise UsageError(
                f"{path}, line {number}: no answer of an evaluation", hint="--resume goes on with what --save wrote"
            ) from None
    if len(whole) + 1 < len(raw):
        # What was being written when the evaluation was stopped.
        path.write_bytes(whole + b"\n" if whole else b"")
    return known


def _outcome(record: Mapping[str, Any]) -> Outcome:
    return Outcome(
        ids=tuple(map(str, record["ids"])),
        achievable=None if record["achievable"] is None else bool(record["achievable"]),
        usage=Usage(**{name: record["usage"][name] for name in Usage().to_dict()}),
        seconds=float(record["seconds"]),
        record=dict(record.get("answer", {})),
    )
