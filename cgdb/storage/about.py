"""What a scene says of itself: frame, up axis, feature spaces and provenance, as given or merged with what was said."""

from __future__ import annotations

import json
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any

from cgdb.errors import SceneError
from cgdb.scene import UP_AXES, FeatureSpace
from cgdb.storage.history import Header


@dataclass(frozen=True, slots=True, kw_only=True)
class About:
    """Of a scene, what is not in its rows. provenance: as it is stored, so with lists for tuples."""

    frame: str
    up: str
    spaces: tuple[FeatureSpace, ...]
    provenance: Mapping[str, Any]


def about(header: Header) -> About:
    """What is stored."""
    return About(frame=header.frame, up=header.up, spaces=header.spaces, provenance=dict(header.provenance))


def settled(
    name: str,
    old: Header | None,
    *,
    frame: str | None,
    up: str | None,
    spaces: Iterable[FeatureSpace],
    provenance: Mapping[str, Any] | None,
) -> About:
    """What a scene says after a block. old: what it is merged into, None where it is new or replaced.

    SceneError where what is given is none, or does not go together with what is there.
    """
    if up is not None and up not in UP_AXES:
        raise SceneError(f"scene '{name}': up axis {up!r} is none of {', '.join(UP_AXES)}")
    merged = _spaces(name, (*(() if old is None else old.spaces), *spaces))
    for what, given, kept in () if old is None else (("in frame", frame, old.frame), ("with up axis", up, old.up)):
        if given is not None and given != kept:
            raise SceneError(f"scene '{name}' is {what} '{kept}', what is to be merged is {what} '{given}'")
    base = {} if old is None else dict(old.provenance)
    return About(
        frame=(frame or "map") if old is None else old.frame,
        up=(up or "z") if old is None else old.up,
        spaces=merged,
        provenance=_as_stored(name, {**base, **(provenance or {})}),
    )


def _spaces(name: str, spaces: Iterable[FeatureSpace]) -> tuple[FeatureSpace, ...]:
    """Each space once, with its encoder where any says it."""
    merged: dict[str, FeatureSpace] = {}
    for space in spaces:
        before = merged.get(space.name)
        if before is None:
            if not space.name or len(space.name) > 256 or space.dimension < 1:
                raise SceneError(f"scene '{name}': feature space {space.name[:60]!r} of dimension {space.dimension}")
            merged[space.name] = space
        elif before.dimension != space.dimension:
            raise SceneError(
                f"scene '{name}': feature space '{space.name}' has dimension {before.dimension}, not {space.dimension}"
            )
        elif before.encoder is None:
            merged[space.name] = space
        elif space.encoder not in (None, before.encoder):
            raise SceneError(
                f"scene '{name}': feature space '{space.name}' is of encoder {before.encoder}, not {space.encoder}"
            )
    return tuple(merged.values())


def _as_stored(name: str, provenance: Mapping[str, Any]) -> dict[str, Any]:
    try:
        # Through JSON and back: what is compared with the stored one must have its form (tuples are lists there).
        loaded: dict[str, Any] = json.loads(json.dumps(provenance))
    except (TypeError, ValueError) as error:
        raise SceneError(f"scene '{name}': its provenance cannot be stored as JSON: {error}") from None
    return loaded
