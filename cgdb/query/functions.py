"""The functions of CGQL: what they take and give. How they are computed is the executor's matter."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass


@dataclass(frozen=True, slots=True, kw_only=True)
class Signature:
    """takes: a kind per argument ("node", "number", "text", "list", "any", "row" for whatever a variable can be).

    optional: how many of the last arguments may be left out. variadic: the last kind repeats. gives: the result's kind.
    """

    takes: tuple[str, ...]
    gives: str
    optional: int = 0
    variadic: bool = False
    says: str = ""


FUNCTIONS: Mapping[str, Signature] = {
    "distance": Signature(
        takes=("node", "node", "text"),
        optional=1,
        gives="number",
        says="metres between two boxes, 0 where they touch; with 'centers', between their centers",
    ),
    "volume": Signature(takes=("node",), gives="number", says="cubic metres of the box"),
    "height": Signature(takes=("node",), gives="number", says="metres that the box spans along the up axis"),
    "width": Signature(takes=("node",), gives="number", says="metres of the longer side of the footprint"),
    "depth": Signature(takes=("node",), gives="number", says="metres of the shorter side of the footprint"),
    "inside": Signature(takes=("node", "node"), gives="boolean", says="whether the first box lies in the second"),
    "above": Signature(takes=("node", "node"), gives="boolean", says="whether the first box is over the second"),
    "score": Signature(
        takes=("node",), optional=1, gives="number", says="the degree of what was asked of a variable, or of the row"
    ),
    "id": Signature(takes=("node",), gives="id", says="the id of an object or place"),
    "label": Signature(takes=("row",), gives="text", says="Object or the kind of place; the label of a relation"),
    "size": Signature(takes=("list",), gives="number", says="members of a list, letters of a text, hops of a path"),
    "lower": Signature(takes=("text",), gives="text", says="in lower case"),
    "upper": Signature(takes=("text",), gives="text", says="in upper case"),
    "abs": Signature(takes=("number",), gives="number", says="without its sign"),
    "sqrt": Signature(takes=("number",), gives="number", says="square root; null below 0"),
    "round": Signature(takes=("number", "number"), optional=1, gives="number", says="rounded to n decimals (0)"),
    "coalesce": Signature(takes=("any",), variadic=True, gives="any", says="the first argument that is not null"),
}

AGGREGATES: Mapping[str, Signature] = {
    "count": Signature(takes=("row",), gives="number", says="how many rows, or distinct values, fit"),
    "min": Signature(takes=("any",), gives="any", says="the smallest value"),
    "max": Signature(takes=("any",), gives="any", says="the largest value"),
    "avg": Signature(takes=("number",), gives="number", says="the mean"),
    "sum": Signature(takes=("number",), gives="number", says="the sum"),
    "collect": Signature(takes=("row",), gives="list", says="all values in a list"),
}
