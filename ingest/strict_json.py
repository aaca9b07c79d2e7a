"""JSON from strangers: NaN, deep nesting, endless numbers and text that is not UTF-8 are refused in one line."""

from __future__ import annotations

import json
from typing import Any

from cgdb.errors import FormatError

KINDS = {dict: "object", list: "list", str: "text", int: "number", float: "number", bool: "truth value"}


def parse(data: bytes | str) -> Any:
    """The value of a JSON text in UTF-8 (a byte order mark is allowed). FormatError says where it breaks."""
    try:
        text = data.decode("utf-8-sig") if isinstance(data, bytes) else data
    except UnicodeDecodeError as error:
        if b"\x00" in error.object[:4096] and not error.object.startswith((b"\xff\xfe", b"\xfe\xff")):
            raise FormatError("this is no text: a picture, a point cloud or another binary file") from error
        raise FormatError(
            f"this is not UTF-8 text: byte {error.start} is 0x{error.object[error.start]:02x}",
            hint="save the file as UTF-8",
        ) from error
    try:
        return json.loads(text, parse_constant=_refuse_constant)
    except json.JSONDecodeError as error:
        if not text.strip():
            raise FormatError("the file is empty: it holds nothing but white space") from error
        raise FormatError(
            f"this is not whole JSON: {error.msg} at line {error.lineno}, column {error.colno}"
        ) from error
    except RecursionError as error:
        raise FormatError("the JSON is nested too deeply to be a map") from error
    except ValueError as error:
        # The interpreter's own limit on the digits of a number.
        raise FormatError("the JSON holds a number with more digits than a map can need") from error


def kind_of(value: object) -> str:
    """A JSON value named for a person: "list of numbers", "object with the keys 'a', 'b'", "nothing (null)"."""
    if isinstance(value, dict):
        keys = ", ".join(repr(str(key)[:40]) for key in list(value)[:6])
        return f"object with the keys {keys}" + (" ..." if len(value) > 6 else "") if value else "empty object"
    if isinstance(value, list):
        if not value:
            return "empty list"
        kinds = {KINDS.get(type(item), "null") for item in value[:1000]}
        return f"list of {kinds.pop()}s" if len(kinds) == 1 else "list of mixed things"
    return KINDS.get(type(value), "null")


def _refuse_constant(name: str) -> Any:
    raise FormatError(f"the JSON holds {name}, which is no number that a map can hold")
