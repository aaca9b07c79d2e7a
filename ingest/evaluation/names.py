"""What the numbers of a labelled cloud are called: class names from the files that data sets bring along."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from cgdb.errors import FormatError, UsageError
from cgdb.ingest import strict_json

LARGEST_FILE = 64 << 20
MOST_CLASSES = 100_000

NYU40 = (
    "wall", "floor", "cabinet", "bed", "chair", "sofa", "table", "door", "window", "bookshelf", "picture", "counter",
    "blinds", "desk", "shelves", "curtain", "dresser", "pillow", "mirror", "floor mat", "clothes", "ceiling", "books",
    "refrigerator", "television", "paper", "towel", "shower curtain", "box", "whiteboard", "person", "night stand",
    "toilet", "sink", "lamp", "bathtub", "bag", "other structure", "other furniture", "other prop",
)  # fmt: skip
"""The 40 classes of NYU Depth v2, from 1: the labels of ScanNet's *_vh_clean_2.labels.ply."""


@dataclass(frozen=True, slots=True, kw_only=True)
class ClassNames:
    """classes: {class number: its name}. objects: {object number: its class number}, where the file tells."""

    classes: Mapping[int, str]
    objects: Mapping[int, int] = field(default_factory=dict)


NYU40_NAMES = ClassNames(classes=dict(enumerate(NYU40, start=1)))
NYU40_LABELS = "_vh_clean_2.labels.ply"
"""How ScanNet's files with such labels end."""


def class_names(given: str) -> ClassNames:
    """The names of "nyu40", or of a file: see `read`."""
    if given.casefold() == "nyu40":
        return NYU40_NAMES
    return read(Path(given))


def read(path: Path) -> ClassNames:
    """The names of a JSON file: a list (from 0), {"number": "name"}, or Replica's info_semantic.json.

    FormatError for anything else.
    """
    try:
        if path.stat().st_size > LARGEST_FILE:
            raise FormatError(f"{path}: is larger than a file of class names can be")
        value = strict_json.parse(path.read_bytes())
    except FileNotFoundError:
        raise UsageError(f"there is no file {path}", hint="class names: nyu40, or a JSON file") from None
    except OSError as error:
        raise FormatError(f"{path}: cannot be read: {error.strerror or error}") from None
    except FormatError as error:
        raise FormatError(
            f"{path}: {error.message}" if not error.message.startswith(str(path)) else error.message
        ) from None
    found = _names(value)
    if found is None or not 0 < len(found.classes) <= MOST_CLASSES:
        raise FormatError(
            f"{path}: holds no class names",
            hint='a list of names (class 0 first), {"number": "name"}, or Replica\'s info_semantic.json',
        )
    return found


def _names(value: Any) -> ClassNames | None:
    if isinstance(value, list):
        return _texts(dict(enumerate(value)))
    if not isinstance(value, dict):
        return None
    if isinstance(value.get("classes"), list):
        return _semantic(value)
    try:
        return _texts({int(number): name for number, name in value.items()})
    except ValueError:
        return None


def _texts(names: Mapping[int, Any]) -> ClassNames | None:
    if not all(isinstance(name, str) and name.strip() for name in names.values()):
        return None
    return ClassNames(classes={number: name.strip() for number, name in names.items()})


def _semantic(value: Mapping[str, Any]) -> ClassNames | None:
    """info_semantic.json: classes of id and name, objects of id and class_id."""
    classes: dict[int, str] = {}
    objects: dict[int, int] = {}
    for record in value["classes"]:
        if not isinstance(record, dict) or not _whole(record.get("id")) or not isinstance(record.get("name"), str):
            return None
        classes[record["id"]] = record["name"]
    listed = value.get("objects", [])
    for record in listed if isinstance(listed, list) else []:
        if not isinstance(record, dict) or not _whole(record.get("id")) or not _whole(record.get("class_id")):
            return None
        objects[record["id"]] = record["class_id"]
    return ClassNames(classes=classes, objects=objects)


def _whole(value: Any) -> bool:
    return isinstance(value, int) and not isinstance(value, bool)
