"""Cypher for one connected part of a match: its single-hop edges, and the conditions that the graph index can test."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

from cgdb.grammar import ast
from cgdb.index.graph import property_column
from cgdb.query.bound import BoundEdge, BoundNode
from cgdb.query.expressions import variables

COLUMNS: Mapping[str, str] = {
    "id": "id",
    "label": "label",
    "tag": "tag",
    "name": "tag",
    "caption": "caption",
    "confidence": "confidence",
    "n_observations": "n_observations",
    "x": "cx",
    "y": "cy",
    "z": "cz",
}
"""CGQL's built-in properties that the graph index holds, with their columns there."""

LONGEST_LIST = 16
"""Members of a list that the graph index tests; longer ones are looked up here."""
_FLIPPED = {"<": ">", "<=": ">=", ">": "<", ">=": "<=", "=": "=", "<>": "<>"}


@dataclass(slots=True)
class Cypher:
    """A statement in the making: its parameters are numbered, so that no value is ever part of the text."""

    parameters: dict[str, Any] = field(default_factory=dict)

    def parameter(self, value: Any) -> str:
        """The name that stands for a value."""
        name = f"p{len(self.parameters)}"
        self.parameters[name] = value
        return f"${name}"


@dataclass(frozen=True, slots=True, kw_only=True)
class Component:
    """Nodes that single-hop edges hold together (or one node alone), and the conditions pushed into the index.

    aliases: the node's or edge's name in the Cypher text.
    """

    nodes: tuple[BoundNode, ...]
    edges: tuple[BoundEdge, ...]
    pushed: tuple[ast.Expression, ...]
    aliases: Mapping[str, str]


@dataclass(frozen=True, slots=True, kw_only=True)
class Statement:
    """Cypher text, its parameters, and what its columns are: node names, then per edge name its columns."""

    text: str
    parameters: Mapping[str, Any]
    nodes: tuple[str, ...]
    edges: tuple[str, ...]


EDGE_COLUMNS = ("label", "confidence", "origin", "source", "explanation")
"""What a statement returns of every edge; source is the key of the node that the relation starts from."""


def statement(component: Component) -> Statement:
    """The Cypher of a component."""
    cypher = Cypher()
    alias = component.aliases
    lines: list[str] = []
    chain = [
        f"({alias[edge.source]}:Node)-[{alias[edge.name]}:Rel]-{'>' * edge.directed}({alias[edge.target]}:Node)"
        for edge in component.edges
    ]
    lone = [f"({alias[node.name]}:Node)" for node in component.nodes if not component.edges]
    lines.append("MATCH " + ", ".join(chain or lone))
    tests = [f"{alias[node.name]}.label = {cypher.parameter(node.label)}" for node in component.nodes if node.label]
    labelled = [edge for edge in component.edges if edge.labels]
    tests.extend(_one_of(f"{alias[edge.name]}.label", edge.labels, cypher) for edge in labelled)
    # As in Cypher, two edges of one statement are two relations: "two cups on one table" are two cups.
    tests.extend(
        f"{alias[one.name]}.number <> {alias[two.name]}.number"
        for i, one in enumerate(component.edges)
        for two in component.edges[i + 1 :]
        if not one.labels or not two.labels or set(one.labels) & set(two.labels)
    )
    for condition in component.pushed:
        text = condition_text(condition, alias, cypher)
        assert text is not None, "the planner pushes only what can be written"
        tests.append(text)
    if tests:
        lines.append("WHERE " + " AND ".join(tests))
    columns = [f"{alias[node.name]}.key" for node in component.nodes]
    for edge in component.edges:
        columns.extend(f"{alias[edge.name]}.{column}" for column in EDGE_COLUMNS)
    lines.append("RETURN " + ", ".join(f"{column} AS c{i}" for i, column in enumerate(columns)))
    return Statement(
        text="\n".join(lines),
        parameters=cypher.parameters,
        nodes=tuple(node.name for node in component.nodes),
        edges=tuple(edge.name for edge in component.edges),
    )


def pushable(condition: ast.Expression, properties: Mapping[str, str]) -> bool:
    """Whether the graph index tests this condition exactly as the executor would. properties: {name: CGQL type}."""
    names = variables(condition)
    if len(names) != 1:
        return False
    return condition_text(condition, {next(iter(names)): "n"}, Cypher(), properties) is not None


def condition_text(
    condition: ast.Expression,
    alias: Mapping[str, str],
    cypher: Cypher,
    properties: Mapping[str, str] | None = None,
) -> str | None:
    """The condition in Cypher, or None where it cannot be said there with the same meaning.

    Nulls: a comparison with null has degree 0 in CGQL and is dropped by Cypher, which is the same only outside NOT;
    so NOT is not pushed.
    """
    match condition:
        case ast.Comparison(op=op, left=left, right=right):
            if not isinstance(left, ast.Property):
                left, right, op = right, left, _FLIPPED[op]
            column = _column(left, alias, properties)
            value = _constant(right)
            if column is None or value is None or not _fits(left, value, properties):
                return None
            if isinstance(value, str) and op not in ("=", "<>"):
                return None
            return f"{column} {op} {cypher.parameter(value)}"
        case ast.In(item=ast.Property() as item, collection=ast.ListOf(items=items)):
            column = _column(item, alias, properties)
            values = [_constant(x) for x in items]
            if column is None or not values or any(v is None or not _fits(item, v, properties) for v in values):
                return None
            if len(values) > LONGEST_LIST:
                return None
            return _one_of(column, [value for value in values if value is not None], cypher)
        case ast.IsNull(item=ast.Property() as item, negated=negated):
            column = _column(item, alias, properties)
            return None if column is None else f"{column} IS {'NOT ' if negated else ''}NULL"
        case ast.And(items=items):
            texts = [condition_text(x, alias, cypher, properties) for x in items]
            return None if None in texts else "(" + " AND ".join(t for t in texts if t) + ")"
        case ast.Or(items=items):
            texts = [condition_text(x, alias, cypher, properties) for x in items]
            return None if None in texts else "(" + " OR ".join(t for t in texts if t) + ")"
    return None


def _one_of(column: str, values: Sequence[str | float | bool], cypher: Cypher) -> str:
    # Not IN: kuzu 0.11.3 now and then gives rows that the list does not hold, where a batch has one row.
    tests = " OR ".join(f"{column} = {cypher.parameter(value)}" for value in values)
    return f"({tests})" if len(values) > 1 else tests


def _column(item: ast.Expression, alias: Mapping[str, str], properties: Mapping[str, str] | None) -> str | None:
    if not isinstance(item, ast.Property) or item.variable not in alias:
        return None
    if item.name in COLUMNS:
        return f"{alias[item.variable]}.{COLUMNS[item.name]}"
    if properties is not None and properties.get(item.name) not in ("number", "text", "boolean"):
        return None
    return f"{alias[item.variable]}.{property_column(item.name)}"


def _constant(item: ast.Expression) -> str | float | bool | None:
    if isinstance(item, (ast.Text, ast.Number, ast.Boolean)):
        return float(item.value) if isinstance(item, ast.Number) else item.value
    return None


def _fits(item: ast.Expression, value: object, properties: Mapping[str, str] | None) -> bool:
    """Whether a value is of the column's own type: the engine would refuse or cast it otherwise."""
    if not isinstance(item, ast.Property):
        return False
    if item.name == "id":
        return False
    kind = {"confidence": "number", "n_observations": "number", "x": "number", "y": "number", "z": "number"}.get(
        item.name, "text" if item.name in COLUMNS else (properties or {}).get(item.name)
    )
    if properties is None:
        return True
    return kind == {str: "text", float: "number", bool: "boolean"}[type(value)]
