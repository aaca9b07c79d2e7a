"""Variants of the mapping by name: the paper's own code, and any single parameter."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import fields, is_dataclass, replace
from typing import Any, Literal, get_args, get_origin, get_type_hints

from cgdb.errors import UsageError, did_you_mean
from cgdb.ingest.mapping.mapper import Mapping

PRESETS: dict[str, tuple[str, ...]] = {
    "paper": (),
    "reference": (
        "renormalise=yes",
        "association.semantic=cosine",
        "association.threshold=1.2",
        "association.alike=-1",
        "lifting.repeated=2",
        "consensus.views=0",
        "tidying.touching=2",
        "tidying.overlap=0.7",
        "tidying.semantic=0.8",
        "tidying.text=0.8",
        "tidying.merge_every=20",
    ),
}
"""{name: settings}. "reference": the code's cosine and threshold, means at unit length, merging every 20 frames by
overlap alone, and none of what this project adds."""


_ABOVE = {"voxel": 0.005, "views": 1, "lifting.cell": 1, "lifting.spacing": 0.01}


def varied(how: Mapping, settings: Iterable[str]) -> Mapping:
    """The parameters with settings such as "tidying.merge_every=10" or "voxel=0.05"; UsageError where one is none."""
    for setting in settings:
        name, equals, text = setting.partition("=")
        if not equals:
            raise UsageError(f"a setting is NAME=VALUE, not '{setting[:60]}'", hint="such as tidying.merge_every=10")
        how = _with(how, name.strip().split("."), text.strip(), name.strip())
    return how


def _with(record: Any, path: list[str], text: str, whole: str) -> Any:
    known = [field.name for field in fields(record)]
    if path[0] not in known:
        raise UsageError(
            f"mapping has no setting '{whole[:60]}'", hint=did_you_mean(path[0], known) or ", ".join(known)
        )
    inner = getattr(record, path[0])
    if is_dataclass(inner) != (len(path) > 1):
        hint = ", ".join(field.name for field in fields(inner)) if is_dataclass(inner) else None
        raise UsageError(f"mapping has no setting '{whole[:60]}'", hint=hint)
    if len(path) > 1:
        return replace(record, **{path[0]: _with(inner, path[1:], text, whole)})
    return replace(record, **{path[0]: _value(get_type_hints(type(record))[path[0]], text, whole)})


def _value(kind: Any, text: str, name: str) -> Any:
    if get_origin(kind) is Literal:
        if text in get_args(kind):
            return text
        raise UsageError(f"{name} is one of {', '.join(get_args(kind))}, not '{text[:40]}'")
    if kind is bool:
        if text in ("yes", "no"):
            return text == "yes"
        raise UsageError(f"{name} is yes or no, not '{text[:40]}'")
    try:
        value = kind(text)
    except ValueError:
        value = None
    if value is None or not -1e6 <= value <= 1e6:
        what = "a whole number" if kind is int else "a number"
        raise UsageError(f"{name} takes {what}, not '{text[:40]}'")
    if (kind is int and value < 0) or (name in _ABOVE and value < _ABOVE[name]):
        raise UsageError(f"{name} must be at least {_ABOVE.get(name, 0)}, not {value}")
    return value
