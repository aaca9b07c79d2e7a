"""The names in sight while a statement is bound: its variables, and the labels, relations and properties of a store."""

from __future__ import annotations

from dataclasses import dataclass, field

from cgdb.errors import BindError, Span, did_you_mean, one_of
from cgdb.grammar import ast
from cgdb.grammar.limits import children
from cgdb.index.catalog import BUILT_IN, EDGE_PROPERTIES, STANDARD_RELATIONS, Catalog
from cgdb.query.bound import BoundEdge, BoundNode


@dataclass(frozen=True, slots=True, kw_only=True)
class Scope:
    """nodes, edges: the variables that are bound so far, by name. A name that is not there is a BindError."""

    catalog: Catalog
    nodes: dict[str, BoundNode] = field(default_factory=dict)
    edges: dict[str, BoundEdge] = field(default_factory=dict)

    def copy(self) -> Scope:
        """The same names, to which more may be added."""
        return Scope(catalog=self.catalog, nodes=dict(self.nodes), edges=dict(self.edges))

    def names(self) -> list[str]:
        """The variables that the statement gives a name."""
        return [node.name for node in self.nodes.values() if node.named] + [
            edge.name for edge in self.edges.values() if edge.named
        ]

    def kind(self, name: str, span: Span) -> str:
        """What a variable stands for: "node", "edge" or "path"."""
        if name in self.nodes:
            return "node"
        if name in self.edges:
            return "path" if self.edges[name].is_path else "edge"
        known = self.names()
        raise BindError(
            f"there is no variable '{name}'",
            hint=did_you_mean(name, known)
            or f"MATCH names {one_of(known) or 'none'}; a text is written in quotes: '{name}'",
            span=span,
        )

    def kind_of_property(self, item: ast.Property) -> str:
        """The kind of value that a property has."""
        kind = self.kind(item.variable, item.span)
        if kind == "path":
            raise BindError(f"'{item.variable}' is a path, which has no properties", span=item.span)
        if kind == "edge":
            known = list(EDGE_PROPERTIES)
            if item.name in EDGE_PROPERTIES:
                return EDGE_PROPERTIES[item.name]
        else:
            known = [*BUILT_IN, *self.catalog.properties]
            if item.name in BUILT_IN:
                return BUILT_IN[item.name]
            if item.name in self.catalog.properties:
                found = self.catalog.properties[item.name]
                return "list" if found == "numbers" else found
        raise BindError(
            f"no property '{item.name}' in the store",
            hint=did_you_mean(item.name, known) or f"there is {one_of(known, most=14)}",
            span=item.span,
        )

    def check_label(self, label: str, span: Span) -> None:
        """Whether the store has the label."""
        if label in self.catalog.labels or label == "Object":
            return
        known = ["Object", *(label for label in self.catalog.labels if label != "Object")]
        raise BindError(
            f"no label '{label}' in the store",
            hint=did_you_mean(label, known) or f"there is {one_of(known)}",
            span=span,
        )

    def check_relation(self, label: str, span: Span) -> None:
        """Whether the store has the relation, or any store may."""
        if label in self.catalog.relations or label in STANDARD_RELATIONS:
            return
        known = [*self.catalog.relations, *STANDARD_RELATIONS]
        raise BindError(
            f"no relation '{label}' in the store",
            hint=did_you_mean(label, known) or f"there is {one_of(dict.fromkeys(known))}",
            span=span,
        )

    def ends_that_do_not_meet(self, edge: BoundEdge) -> str | None:
        """A warning where the labels at the ends of an edge rule out every relation of its kind in the store."""
        source, target = self.nodes[edge.source].label, self.nodes[edge.target].label
        ends = {pair for label in edge.labels for pair in self.catalog.relations.get(label, {})}
        if not ends or edge.is_path:
            return None
        fits = {(a, b) for a, b in ends if source in (None, a) and target in (None, b)}
        if not edge.directed:
            fits |= {(a, b) for a, b in ends if source in (None, b) and target in (None, a)}
        if fits:
            return None
        a, b = min(ends)
        return (
            f"no '{'|'.join(edge.labels)}' goes from {source or 'a node'} to {target or 'a node'}; "
            f"the store has (:{a})-[:{edge.labels[0]}]->(:{b})"
        )

    def check_inside_pattern(self, item: ast.Syntax) -> None:
        """Inside a pattern of a condition neither scores nor relations are known: they depend on what comes of it."""
        if isinstance(item, ast.Call) and item.name == "score":
            raise BindError("score() is not known inside a pattern of a condition", span=item.span)
        if isinstance(item, ast.Property | ast.Variable):
            name = item.variable if isinstance(item, ast.Property) else item.name
            if name in self.edges:
                raise BindError(
                    f"'{name}' is a relation, which is not known inside a pattern of a condition",
                    hint="compare it in WHERE, beside the pattern",
                    span=item.span,
                )
        for part in children(item):
            self.check_inside_pattern(part)
