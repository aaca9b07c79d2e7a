"""What a scene holds, by name: labels, relations and properties, for the binder, the planner and completion."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from typing import Any

from cgdb.scene import PropertyValue

STANDARD_RELATIONS = ("on", "in", "under", "above", "next_to", "near", "contains")
"""Relations that every map is asked about: naming one that a map does not hold is no error, there are just no rows."""

BUILT_IN: Mapping[str, str] = {
    "id": "id",
    "label": "text",
    "tag": "text",
    "name": "text",
    "tags": "list",
    "caption": "text",
    "scene": "text",
    "confidence": "number",
    "n_observations": "number",
    "center": "list",
    "extent": "list",
    "x": "number",
    "y": "number",
    "z": "number",
}
"""Properties that every node has, whatever its map, with their types."""

EDGE_PROPERTIES: Mapping[str, str] = {
    "label": "text",
    "confidence": "number",
    "explanation": "text",
    "origin": "text",
    "source": "id",
    "target": "id",
}

COLUMN_TYPES: Mapping[str, str] = {"number": "DOUBLE", "boolean": "BOOL", "text": "STRING", "list": "STRING[]"}
"""Property types that a column of the graph index can hold; "mixed" ones cannot."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Catalog:
    """labels: {label: nodes}; relations: {label: {(source label, target label): count}}; properties: {name: type};
    ranges: {name: (least, largest)} of properties that are numbers.
    """

    labels: Mapping[str, int] = field(default_factory=dict)
    relations: Mapping[str, Mapping[tuple[str, str], int]] = field(default_factory=dict)
    properties: Mapping[str, str] = field(default_factory=dict)
    ranges: Mapping[str, tuple[float, float]] = field(default_factory=dict)

    @property
    def n_nodes(self) -> int:
        """Objects and places."""
        return sum(self.labels.values())

    def relation_count(self, label: str) -> int:
        """How many relations carry this label."""
        return sum(self.relations.get(label, {}).values())

    @property
    def room_label(self) -> str | None:
        """The label of rooms, or else of whatever places hold objects; None where none do."""
        if "Room" in self.labels:
            return "Room"
        holders = {a for a, b in self.relations.get("contains", {}) if b == "Object" and a != "Object"}
        return min(holders, default=None)

    def hops_to_objects(self, label: str) -> int:
        """How many ``contains`` lead from a place of this label to its objects, at most: places may nest."""
        return 1 if (label, "Object") in self.relations.get("contains", {}) else 3

    @property
    def columns(self) -> dict[str, str]:
        """{property: column type} of those properties that the graph index holds."""
        return {name: COLUMN_TYPES[kind] for name, kind in self.properties.items() if kind in COLUMN_TYPES}

    def to_json(self) -> dict[str, Any]:
        """For the sidecar of an index file."""
        return {
            "labels": dict(self.labels),
            "relations": [
                [label, source, target, count]
                for label, ends in self.relations.items()
                for (source, target), count in ends.items()
            ],
            "properties": dict(self.properties),
            "ranges": {name: list(ends) for name, ends in self.ranges.items()},
        }

    @staticmethod
    def from_json(document: Mapping[str, Any]) -> Catalog:
        """The reverse of to_json."""
        relations: dict[str, dict[tuple[str, str], int]] = {}
        for label, source, target, count in document["relations"]:
            relations.setdefault(label, {})[(source, target)] = count
        ranges = {name: (float(low), float(high)) for name, (low, high) in document["ranges"].items()}
        return Catalog(labels=document["labels"], relations=relations, properties=document["properties"], ranges=ranges)


def merge(catalogs: Iterable[Catalog]) -> Catalog:
    """What several scenes hold together; a property whose type differs between them is "mixed"."""
    labels: dict[str, int] = {}
    relations: dict[str, dict[tuple[str, str], int]] = {}
    properties: dict[str, str] = {}
    ranges: dict[str, tuple[float, float]] = {}
    for catalog in catalogs:
        for label, count in catalog.labels.items():
            labels[label] = labels.get(label, 0) + count
        for label, ends in catalog.relations.items():
            known = relations.setdefault(label, {})
            for pair, count in ends.items():
                known[pair] = known.get(pair, 0) + count
        for name, kind in catalog.properties.items():
            properties[name] = merged_type(properties.get(name), kind)
        for name, span in catalog.ranges.items():
            ranges[name] = widened(ranges.get(name), *span)
    return Catalog(labels=labels, relations=relations, properties=properties, ranges=ranges)


def widened(known: tuple[float, float] | None, low: float, high: float) -> tuple[float, float]:
    """The range that holds both."""
    return (low, high) if known is None else (min(known[0], low), max(known[1], high))


def property_type(value: PropertyValue) -> str | None:
    """The CGQL type of a property's value; None for null, which fits any type."""
    if value is None:
        return None
    if isinstance(value, bool):
        return "boolean"
    if isinstance(value, (int, float)):
        return "number"
    if isinstance(value, str):
        return "text"
    return "list" if all(isinstance(item, str) for item in value) else "numbers"


def merged_type(known: str | None, new: str | None) -> str:
    """The type of a property that was seen with both types."""
    if known is None or known == new:
        return new or "mixed"
    return known if new is None else "mixed"
