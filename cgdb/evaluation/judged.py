"""Judged queries: questions to maps, with the objects that answer them, and the grade of each.

`cgdb eval retrieval --help` shows how the file is laid out.
"""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from cgdb.errors import UsageError, one_of


@dataclass(frozen=True, slots=True, kw_only=True)
class JudgedQuery:
    """relevant: {id as text: grade 1 or 2}."""

    id: str
    kind: str
    query: str
    relevant: Mapping[str, int]

    @property
    def clear(self) -> frozenset[str]:
        """The ids that clearly answer it."""
        return frozenset(name for name, grade in self.relevant.items() if grade >= 2)


def judgements(path: Path) -> dict[str, tuple[JudgedQuery, ...]]:
    """{map: its queries} of a file. UsageError, with the place, where it is not laid out so."""
    try:
        document = json.loads(path.read_text("utf-8"))
    except OSError as error:
        raise UsageError(f"{path} cannot be read: {error.strerror or error}") from None
    except (ValueError, RecursionError) as error:
        raise UsageError(f"{path} is no JSON: {str(error)[:100]}") from None
    if not isinstance(document, dict) or not document:
        raise UsageError(f"{path} must be an object of maps and their queries", hint="--help shows the layout")
    found = {}
    for name, queries in document.items():
        if not isinstance(queries, list):
            raise UsageError(f"{path}: '{name[:60]}' must be a list of queries")
        found[name] = tuple(_query(f"{path}: {name[:60]}, query {i}", item) for i, item in enumerate(queries))
    return found


def _query(where: str, item: Any) -> JudgedQuery:
    if not isinstance(item, dict):
        raise UsageError(f"{where} must be an object")
    texts = {name: item.get(name) for name in ("id", "kind", "query")}
    for name, value in texts.items():
        if not isinstance(value, str) or not value.strip():
            raise UsageError(f"{where}: '{name}' must be a text")
    relevant = item.get("relevant")
    if not isinstance(relevant, dict) or not all(
        isinstance(grade, int) and not isinstance(grade, bool) and 0 <= grade <= 2 for grade in relevant.values()
    ):
        raise UsageError(f"{where}: 'relevant' must be an object of ids and grades 0 to 2")
    graded = {str(name): grade for name, grade in relevant.items() if grade}
    return JudgedQuery(id=item["id"], kind=item["kind"], query=item["query"], relevant=graded)


def chosen(
    judged: Mapping[str, Sequence[JudgedQuery]], file: Path, maps: Sequence[Path]
) -> list[tuple[str, Path, Sequence[JudgedQuery]]]:
    """(name, path, queries) of the maps that are asked for; of all that can be found, where none is named."""
    if not maps:
        found = [(name, path, queries) for name, queries in judged.items() if (path := _found(name, file)) is not None]
        if not found:
            raise UsageError(f"none of the maps of {file} is there: {one_of(judged, most=3)}", hint="name them")
        return found
    result = []
    for path in maps:
        if not path.exists():
            raise UsageError(f"{path} does not exist")
        whole = path.resolve().as_posix()
        names = [name for name in judged if whole.endswith(f"/{name}")] or [
            name for name in judged if Path(name).name == path.name
        ]
        if len(names) != 1:
            what = "no queries" if not names else "several maps of that name"
            raise UsageError(f"{file} has {what} for {path}", hint=f"it has {one_of(judged)}")
        result.append((names[0], path, judged[names[0]]))
    return result


def _found(name: str, file: Path) -> Path | None:
    for folder in file.resolve().parents:
        path = folder / name
        # A judgements file must not name what lies elsewhere.
        if ".." not in Path(name).parts and not Path(name).is_absolute() and path.exists():
            return path
    return None
