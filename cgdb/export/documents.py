"""What an exporter gives: a text in pieces and what there is to say about it; and JSON text that is always UTF-8."""

from __future__ import annotations

import json
import math
import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any

from cgdb.errors import ExportError

DEEPEST = 64
"""Levels of lists and mappings in a value; below what any JSON reader takes."""

_LONE_SURROGATE = re.compile("[\ud800-\udfff]")


@dataclass(frozen=True, slots=True, kw_only=True)
class Document:
    """pieces: the text, in parts, so that a large scene need not be one string. notes: a line per thing left out.

    data: instead of the text, where the format is binary.
    """

    pieces: Iterable[str] = ()
    data: Iterable[bytes] | None = None
    notes: tuple[str, ...] = ()


def json_value(value: Any, where: str, *, depth: int = 0) -> Any:
    """The value as JSON has it, mappings sorted; ExportError where JSON would change it or has no such thing."""
    if depth > DEEPEST:
        raise ExportError(f"{where} are nested more than {DEEPEST} deep")
    if value is None or isinstance(value, (bool, str, int)):
        return value
    if isinstance(value, float):
        if not math.isfinite(value):
            raise ExportError(f"{where} hold {value}, which JSON cannot say")
        return value
    if isinstance(value, (list, tuple)):
        return [json_value(item, where, depth=depth + 1) for item in value]
    if isinstance(value, Mapping):
        for key in value:
            if not isinstance(key, str):
                raise ExportError(f"{where} have the key {key!r}: keys must be text")
        return {key: json_value(value[key], where, depth=depth + 1) for key in sorted(value)}
    raise ExportError(
        f"{where} hold a value of type {type(value).__name__}, which JSON has not",
        hint="keep text, numbers, true/false, lists and mappings only",
    )


def json_text(value: Any, where: str) -> str:
    """The value as JSON in one line, as people read it: no escapes but the necessary ones. where names it in errors."""
    try:
        text = json.dumps(value, ensure_ascii=False, allow_nan=False)
    except (ValueError, TypeError) as error:
        raise ExportError(f"{where} cannot be written as JSON: {error}") from error
    # Half a surrogate pair, as broken captions have it, is no UTF-8; its escape is valid JSON.
    return _LONE_SURROGATE.sub(lambda found: f"\\u{ord(found.group()):04x}", text)
