"""What maps call the relations that questions ask for, and which of a store's relations answer them."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping

from cgdb.grammar import ast
from cgdb.index.catalog import Catalog


def _names(text: str) -> frozenset[str]:
    return frozenset(name.strip() for name in text.replace("\n", " ").split(","))


_NAMES: Mapping[str, frozenset[str]] = {
    "on": _names(
        "on, on top of, ontop, atop, upon, standing on, lying on, sitting on, resting on, placed on, supported by"
    ),
    "attached": _names("attached to, hanging on, hanging from, mounted on, connected to, fixed to"),
    "in": _names("in, inside, within, inside of, contained in, contained by"),
    "under": _names("under, below, beneath, underneath"),
    "above": _names("above, over, higher than"),
    "next_to": _names(
        """next to, beside, adjacent to, adjacent, by, leaning against, touching, left, right, left of, right of,
        to the left of, to the right of"""
    ),
    "near": _names("near, close to, close by, close, nearby"),
    "front": _names("in front of, front, front of, facing, opposite"),
    "behind": _names("behind, in back of"),
    "between": _names("between, in between"),
    "left": _names("left, left of, to the left of, on the left of"),
    "right": _names("right, right of, to the right of, on the right of"),
}
"""What maps call each relation; underscores are read as spaces."""
_INVERSE: Mapping[str, frozenset[str]] = {
    "on": _names("supports, supporting, carries"),
    "in": _names("contains, holds, encloses, containing"),
    "under": _NAMES["above"],
    "above": _NAMES["under"],
}
"""What maps may say the other way round instead."""
_TOGETHER: Mapping[str, tuple[str, ...]] = {
    "near": ("near", "next_to"),
    "attached": ("attached", "on", "next_to"),
    "front": ("front", "next_to", "near"),
    "behind": ("behind", "next_to", "near"),
    "between": ("next_to", "near"),
}
"""Relations that few maps tell apart, or whose side depends on where one stands: any of these, either way."""
_EITHER_WAY: Mapping[str, tuple[str, ...]] = {"next_to": ("next_to", "near")}
"""Relations that are the same both ways, and what stands in for them where the map has none."""
_TOUCHING = ("on", "in", "next_to")
"""Relations that speak for any other one that a map may have missed."""


def related(catalog: Catalog) -> bool:
    """Whether the store holds relations between objects."""
    return any(("Object", "Object") in ends for ends in catalog.relations.values())


def says(catalog: Catalog, name: str) -> bool:
    """Whether the store itself holds this relation, and not only one that stands in for it."""
    return bool(_labels(catalog, _NAMES[name]))


def edge(catalog: Catalog, name: str, *, inverse: bool = False) -> ast.EdgePattern:
    """The relation from the subject as the store calls it, or the other way round, or what stands in for it.

    inverse: the subject is the one that something is on, in or under.
    """
    out, back = ast.Direction.OUT, ast.Direction.IN
    either_way = _labels(catalog, *(_NAMES[other] for other in _TOGETHER.get(name, ())))
    for other in _EITHER_WAY.get(name, ()):
        either_way = either_way or _labels(catalog, _NAMES[other])
    if either_way:
        return ast.EdgePattern(labels=either_way, direction=ast.Direction.ANY)
    direct = _labels(catalog, _NAMES[name])
    if direct:
        return ast.EdgePattern(labels=direct, direction=back if inverse else out)
    turned = _labels(catalog, _INVERSE.get(name, frozenset()))
    if turned:
        return ast.EdgePattern(labels=turned, direction=out if inverse else back)
    return ast.EdgePattern(direction=ast.Direction.ANY)


def any_of(catalog: Catalog, names: Iterable[str]) -> ast.EdgePattern | None:
    """Any of these relations, either way, as the store calls them; None where it has none of them."""
    labels = _labels(catalog, *(_NAMES[name] for name in names))
    return ast.EdgePattern(labels=labels, direction=ast.Direction.ANY) if labels else None


def touching(catalog: Catalog, name: str) -> ast.EdgePattern:
    """The relation itself or any that speaks for it where the map may have missed it; either way."""
    alike = _TOGETHER.get(name) or _EITHER_WAY.get(name) or (name,)
    groups = (_NAMES[other] for other in (*alike, *_TOUCHING))
    return ast.EdgePattern(labels=_labels(catalog, *groups), direction=ast.Direction.ANY)


def _labels(catalog: Catalog, *groups: frozenset[str]) -> tuple[str, ...]:
    """The store's relations between objects that are called so, in its own spelling, group by group."""
    known = [label for label, ends in catalog.relations.items() if ("Object", "Object") in ends]
    return tuple(dict.fromkeys(label for names in groups for label in known if _plain(label) in names))


def _plain(label: str) -> str:
    return re.sub(r"^(?:is|are|be) ", "", " ".join(re.split(r"[\s_-]+", label.casefold().strip())))
