"""Values out of strangers' records: text, numbers, ids, triples, vectors, properties; each refused by name when wrong.

``where`` is how an error names the record ("object #12", "record 7").
"""

from __future__ import annotations

import math
import re
import reprlib
from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from cgdb.errors import FormatError, SceneError
from cgdb.ingest.report import Report
from cgdb.scene import ObjectId, PropertyValue, Vector, canonical_id

LONGEST_TEXT = 1_000_000
LARGEST_DIMENSION = 65_536
INVALID_TAGS = frozenset({"invalid", "none", "unknown"})
"""What ConceptGraphs' language model answers for a segment that is no object."""

_UNWRITABLE = re.compile("[\x00\ud800-\udfff]")
_NO_NAME = re.compile(r"\W+")


def node_id(value: object, where: str) -> ObjectId:
    """The id of a node, an integral float taken for the integer that it is."""
    if isinstance(value, float) and value.is_integer() and abs(value) < 2**53:
        value = int(value)
    if isinstance(value, int) and abs(value) >= 2**64:
        raise SceneError(f"{where}: the id is a number of more than 64 bits")
    if not isinstance(value, (int, str, np.integer)):
        raise SceneError(f"{where}: an id must be a number or text, not {shown(value)}")
    try:
        found = canonical_id(value)
    except SceneError as error:
        raise SceneError(f"{where}: {error.message}") from error
    if isinstance(found, str) and _UNWRITABLE.search(found):
        raise SceneError(f"{where}: the id holds a character that is not text")
    return found


def text(value: object, where: str, what: str) -> str | None:
    """Text without the white space round it; None for nothing. Half characters that no file can hold become "�"."""
    if value is None:
        return None
    if isinstance(value, (int, float)) and not isinstance(value, bool):
        value = str(value)
    if not isinstance(value, str):
        raise FormatError(f"{where}: {what} must be text, not {shown(value)}")
    if len(value) > LONGEST_TEXT:
        raise FormatError(f"{where}: {what} has {len(value):,} characters; at most {LONGEST_TEXT:,} are taken")
    return _UNWRITABLE.sub("\N{REPLACEMENT CHARACTER}", value).strip() or None


def texts(value: object, where: str, what: str) -> tuple[str, ...]:
    """A list of texts, each once and in order; a single text counts as a list of one."""
    if value is None:
        return ()
    items = value if isinstance(value, (list, tuple)) else [value]
    found = (text(item, where, what) for item in items)
    return tuple(dict.fromkeys(item for item in found if item is not None))


def number(value: object, where: str, what: str) -> float | None:
    """A finite number, or None for nothing."""
    if value is None:
        return None
    if isinstance(value, (bool, np.bool_)) or not isinstance(value, (int, float, np.integer, np.floating)):
        raise FormatError(f"{where}: {what} must be a number, not {shown(value)}")
    try:
        found = float(value)
    except OverflowError:
        found = math.inf
    if not math.isfinite(found):
        raise SceneError(f"{where}: {what} is {found}, not a finite number")
    return found


def count(value: object, where: str, what: str) -> int | None:
    """A number of things: whole and not negative; None for nothing."""
    found = number(value, where, what)
    if found is None:
        return None
    if found < 0 or not found.is_integer() or found >= 2**63:
        raise SceneError(f"{where}: {what} must be a whole number from 0 on, not {shown(value)}")
    return int(found)


def confidence(value: object, where: str, what: str = "confidence") -> float | None:
    """A number between 0 and 1, or None for nothing."""
    found = number(value, where, what)
    if found is not None and not 0.0 <= found <= 1.0:
        raise SceneError(f"{where}: {what} {found} is not between 0 and 1")
    return found


def triple(value: object, where: str, what: str) -> NDArray[np.float64] | None:
    """Three finite numbers, (3,) float64, from a list, an array or {"x", "y", "z"}; None for nothing."""
    if value is None:
        return None
    if isinstance(value, dict):
        value = [value.get(axis) for axis in ("x", "y", "z")]
    if isinstance(value, np.ndarray):
        value = value.tolist()
    if not isinstance(value, (list, tuple)) or len(value) != 3:
        raise FormatError(f"{where}: {what} must be three numbers, not {shown(value)}")
    found = [number(item, where, what) for item in value]
    if any(item is None for item in found):
        raise FormatError(f"{where}: {what} must be three numbers, not {shown(value)}")
    return np.array(found, dtype=np.float64)


def extent(value: object, where: str, what: str, report: Report) -> NDArray[np.float64] | None:
    """Side lengths of a box, none negative. A box without any length is a point: None, with a warning."""
    sides = triple(value, where, what)
    if sides is None:
        return None
    if (sides < 0.0).any():
        raise SceneError(f"{where}: {what} {sides.tolist()} has a negative side")
    if not sides.any():
        report.warn(f"{where}: its box has no size; it is taken for a point")
        return None
    return sides


def vector(value: object, where: str, what: str) -> Vector:
    """A feature vector, (d,) float32, d from 1 to LARGEST_DIMENSION."""
    if not isinstance(value, (list, tuple, np.ndarray)) or not 0 < len(value) <= LARGEST_DIMENSION:
        raise FormatError(f"{where}: {what} must be a list of 1 to {LARGEST_DIMENSION:,} numbers, not {shown(value)}")
    # numpy would take text and truth values for numbers; the set of types costs microseconds.
    if isinstance(value, (list, tuple)) and not {*map(type, value)} <= {int, float}:
        raise FormatError(f"{where}: {what} must hold numbers only")
    try:
        with np.errstate(over="ignore"):
            found = np.asarray(value, dtype=np.float32)
    except (ValueError, TypeError, OverflowError) as error:
        raise FormatError(f"{where}: {what} must hold numbers only") from error
    if found.ndim != 1:
        raise FormatError(f"{where}: {what} must be one list of numbers, not an array of shape {found.shape}")
    if not np.isfinite(found).all():
        raise SceneError(f"{where}: {what} holds NaN or infinite values")
    return found


def property_name(key: object) -> str | None:
    """The word that a key becomes as a property's name ("bbox-volume" -> bbox_volume), or None when none is left."""
    name = _NO_NAME.sub("_", str(key)[:200]).strip("_")[:64]
    if name[:1].isdigit():
        name = f"_{name}"[:64]
    return name if name.isidentifier() else None


def properties(record: Mapping[Any, Any], where: str, report: Report) -> dict[str, PropertyValue]:
    """The plain values of a record as properties; what is nested, or has no usable name, is dropped and counted."""
    found: dict[str, PropertyValue] = {}
    for key, raw in record.items():
        if raw is None:
            continue
        name = property_name(key)
        value = _property_value(raw, where)
        if name is None or value is None:
            report.drop(f"property '{name or str(key)[:40]}' that is no plain value")
        elif name in found:
            report.drop(f"second property '{name}' of one object")
        else:
            found[name] = value
    return found


def shown(value: object) -> str:
    """A wrong value, short enough for one line of an error."""
    if isinstance(value, (dict, list, tuple, np.ndarray)) and len(value) > 8:
        return f"a {type(value).__name__} of {len(value)}"
    try:
        # Not plain repr: a pickle can nest the same short list forty deep, and its repr would be endless.
        short = reprlib.Repr()
        short.maxlevel, short.maxstring = 2, 60
        found = short.repr(value)
    except ValueError:
        return f"a {type(value).__name__}"
    return found if len(found) <= 60 else found[:57] + "..."


def _property_value(value: object, where: str) -> PropertyValue:
    """The value as a property may hold it, or None when it cannot."""
    if isinstance(value, np.generic):
        value = value.item()
    if isinstance(value, str):
        return text(value, where, "a property") or ""
    if isinstance(value, (bool, float)):
        return value
    if isinstance(value, int):
        # The stores hold 64-bit integers; a larger one is a name, not a quantity.
        return value if -(2**63) <= value < 2**63 else str(value)
    if isinstance(value, (list, tuple)) and 0 < len(value) <= 1024:
        if all(isinstance(item, str) for item in value):
            return texts(value, where, "a property")
        if all(isinstance(item, (int, float)) and not isinstance(item, bool) for item in value):
            return tuple(number(item, where, "a property") or 0.0 for item in value)
    return None
