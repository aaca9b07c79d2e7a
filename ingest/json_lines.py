"""JSON lines: one record a line, an object or a relation {source, target, label}; read with the memory of a batch."""

from __future__ import annotations

import re
from collections.abc import Iterator
from typing import Any

from cgdb.errors import FormatError, SceneError
from cgdb.ingest import plain_json, records, strict_json
from cgdb.ingest.report import Report
from cgdb.ingest.source import LONGEST_LINE, Source
from cgdb.scene import FeatureSpace, ObjectId, Place, Relation, SceneGraph, SceneObject

Batch = tuple[tuple[SceneObject, ...], tuple[Relation, ...]]

_ROOM = re.compile(rb'"room"\s*:\s*("(?:[^"\\]|\\.)*")')
_VECTORS = [f'"{key}"'.encode() for key in ("features", *records.VECTORS)]


def matches(source: Source) -> bool:
    """Lines of JSON objects."""
    return source.kind == "jsonl"


def read(source: Source, name: str | None) -> SceneGraph:
    """All lines at once."""
    return plain_json.from_records(lines(source), name, source, Report(), "jsonl")


def lines(source: Source) -> Iterator[tuple[int, Any]]:
    """(number of the record from 0, its value) of every line with text; FormatError names the line."""
    for position, row, text in _rows(source):
        yield position, _parsed(text, row)


def header(source: Source, name: str, report: Report) -> SceneGraph:
    """What must be known before the first batch: rooms and feature spaces, found by a pass that parses few lines."""
    rooms: dict[str, Place] = {}
    seen: set[bytes] = set()
    spaces: dict[str, FeatureSpace] = {}
    unseen = set(_VECTORS)
    for position, row, text in _rows(source):
        spelled = {found for found in _ROOM.findall(text) if found not in seen}
        vectors = {key for key in unseen if key in text}
        if not spelled and not vectors:
            continue
        record = _parsed(text, row)
        unseen -= {key for key in vectors if key.decode().strip('"') in record}
        # The pattern may match inside a nested value: only what the record's reader says counts.
        found = None if records.is_relation(record) else records.read_object(record, position, Report())
        if found is not None:
            records.declare(spaces, found.object)
            if found.room is not None:
                rooms.setdefault(found.room, records.room_place(found.room))
                seen |= spelled
    return SceneGraph(
        name=name,
        places=tuple(rooms.values()),
        spaces=tuple(spaces.values()),
        provenance=report.provenance(source, "jsonl"),
    )


def batches(source: Source, head: SceneGraph, report: Report, size: int) -> Iterator[Batch]:
    """The objects and relations in batches of about size; only the ids seen are kept between them."""
    spaces = {space.name: space for space in head.spaces}
    seen: set[ObjectId] = {place.id for place in head.places}
    waiting: dict[ObjectId, str] = {}
    objects: list[SceneObject] = []
    relations: list[Relation] = []
    for position, record in lines(source):
        if records.is_relation(record):
            relations.append(records.read_relation(record, position))
        elif found := records.read_object(record, position, report):
            obj = found.object
            if obj.id in seen:
                raise SceneError(f"object #{obj.id}: two nodes have this id")
            seen.add(obj.id)
            waiting.pop(obj.id, None)
            if late := obj.features.keys() - spaces.keys():
                raise SceneError(
                    f"object #{obj.id}: its feature space '{min(late)}' is not among those of the first vectors",
                    hint="begin the file with an object that has a vector of every space",
                )
            records.declare(spaces, obj)
            objects.append(obj)
            if found.room is not None:
                relations.append(Relation(source=records.room_id(found.room), target=obj.id, label="contains"))
        if len(objects) + len(relations) >= size:
            _await_ends(relations, seen, waiting)
            yield tuple(objects), tuple(relations)
            objects, relations = [], []
    _await_ends(relations, seen, waiting)
    if waiting:
        missing, relation = next(iter(waiting.items()))
        raise SceneError(f"{relation}: there is no object or place #{missing}")
    if objects or relations:
        yield tuple(objects), tuple(relations)


def _await_ends(relations: list[Relation], seen: set[ObjectId], waiting: dict[ObjectId, str]) -> None:
    """Note the ends that no object had yet: a relation may come before its objects."""
    for relation in relations:
        for end in (relation.source, relation.target):
            if end not in seen:
                waiting.setdefault(end, f"relation #{relation.source} {relation.label!r} #{relation.target}")


def _rows(source: Source) -> Iterator[tuple[int, int, bytes]]:
    """(number of the record from 0, line from 1, bytes) of every line with text."""
    position = row = 0
    with source.open() as file:
        while text := file.readline(LONGEST_LINE):
            row += 1
            if len(text) >= LONGEST_LINE:
                raise FormatError(f"line {row}: is longer than {LONGEST_LINE:,} bytes")
            if text := text.strip().removeprefix(b"\xef\xbb\xbf"):
                yield position, row, text
                position += 1


def _parsed(text: bytes, row: int) -> dict[str, Any]:
    try:
        record = strict_json.parse(text)
    except FormatError as error:
        raise FormatError(f"line {row}: {error.message}", hint=error.hint) from error
    if not isinstance(record, dict):
        raise FormatError(f"line {row}: must be a JSON object, not a {strict_json.kind_of(record)}")
    return record
