"""Binder: a parsed statement against the names of a store and the values of its parameters.

Every name that the statement uses is looked up here, once; what comes out can be carried out as it stands.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any, cast

import numpy as np

from cgdb.errors import BindError, LimitError, Span, did_you_mean, one_of
from cgdb.grammar import ast
from cgdb.grammar.limits import children
from cgdb.grammar.printer import to_text
from cgdb.index.catalog import BUILT_IN, EDGE_PROPERTIES, STANDARD_RELATIONS, Catalog
from cgdb.meaning.meanings import LikeMeaning, Meaning, VectorMeaning
from cgdb.query.bound import BoundEdge, BoundMatch, BoundNode, BoundQuery, BoundReturn
from cgdb.query.functions import AGGREGATES, FUNCTIONS, Signature
from cgdb.query.parameters import Parameters

MAX_HOPS = 10
"""Longest path that a statement may ask for; ``*`` without an upper bound means this many."""
MAX_NODES = 50
"""Nodes that the patterns of a statement, or of one condition in it, may have together."""


@dataclass(slots=True)
class _Scope:
    """Names in sight while binding: variables by name with their kind, labels and ids."""

    nodes: dict[str, BoundNode] = field(default_factory=dict)
    edges: dict[str, BoundEdge] = field(default_factory=dict)

    def names(self) -> list[str]:
        return [node.name for node in self.nodes.values() if node.named] + [
            edge.name for edge in self.edges.values() if edge.named
        ]


def bind(query: ast.Query, catalog: Catalog, parameters: Mapping[str, Any]) -> BoundQuery:
    """Look up every name of a statement; BindError with its place and the nearest name where one does not exist."""
    return _Binder(catalog, parameters).query(query)


class _Binder:
    def __init__(self, catalog: Catalog, parameters: Mapping[str, Any]) -> None:
        self._catalog = catalog
        self._parameters = Parameters(parameters)
        self._meanings: dict[ast.Meaning, Meaning] = {}
        self._subpatterns: dict[ast.Pattern, BoundMatch] = {}
        self._given: dict[Span, str] = {}
        self._warnings: list[str] = []
        self._anonymous = 0

    def query(self, query: ast.Query) -> BoundQuery:
        scope = _Scope()
        match = self._match(query.patterns, scope)
        conditions = list(match.conditions)
        if query.where is not None:
            where, kind = self._expression(query.where, scope)
            self._expect(kind, "boolean", query.where, "WHERE asks for a condition")
            conditions.extend(where.items if isinstance(where, ast.And) else (where,))
        for condition in conditions:
            _check_no_row_score(condition)
        returns = self._returns(query, scope)
        aggregates = any(_has_aggregate(item.expression) for item in returns)
        return BoundQuery(
            mode=query.mode,
            match=match,
            conditions=tuple(conditions),
            meanings=self._meanings,
            subpatterns=self._subpatterns,
            returns=returns,
            distinct=query.distinct,
            aggregates=aggregates,
            order=self._order(query, returns, scope, aggregates),
            rerank=self._rerank(query.rerank),
            skip=self._count(query.skip, "SKIP") or 0,
            limit=self._count(query.limit, "LIMIT"),
            given=self._given,
            warnings=tuple(dict.fromkeys(self._warnings)),
        )

    # -- patterns -----------------------------------------------------------------------------------------------

    def _match(self, patterns: Sequence[ast.Pattern], scope: _Scope) -> BoundMatch:
        conditions: list[ast.Expression] = []
        nodes: dict[str, BoundNode] = {}
        edges: list[BoundEdge] = []
        for pattern in patterns:
            names = []
            for item in pattern.nodes:
                node = self._node(item, scope, conditions)
                nodes[node.name] = node
                names.append(node.name)
            for position, edge in enumerate(pattern.edges):
                edges.append(self._edge(edge, names[position], names[position + 1], scope))
                if len(edges) >= MAX_NODES:
                    raise LimitError(
                        f"the patterns have more than {MAX_NODES - 1} edges", hint=_ASK_LESS, span=edge.span
                    )
            if len(nodes) > MAX_NODES:
                raise LimitError(f"the patterns have more than {MAX_NODES} nodes", hint=_ASK_LESS, span=pattern.span)
        return BoundMatch(nodes=nodes, edges=tuple(edges), conditions=tuple(conditions))

    def _node(self, item: ast.NodePattern, scope: _Scope, conditions: list[ast.Expression]) -> BoundNode:
        name = item.variable
        if name is None and item.id is not None:
            # The same #12 twice is the same node; any other node without a name is one of its own.
            known_reference = next((n for n in scope.nodes.values() if not n.named and n.id == item.id.id), None)
            if known_reference is not None and item.label is None and not item.properties and item.meaning is None:
                return known_reference
        if name is not None and name in scope.edges:
            raise BindError(f"'{name}' is a relation here and cannot be a node as well", span=item.span)
        if item.label is not None and item.label not in self._catalog.labels and item.label != "Object":
            known = ["Object", *(label for label in self._catalog.labels if label != "Object")]
            raise BindError(
                f"no label '{item.label}' in the store",
                hint=did_you_mean(item.label, known) or f"there is {one_of(known)}",
                span=item.span,
            )
        node_id = item.id.id if item.id is not None else None
        known_node = scope.nodes.get(name) if name is not None else None
        if known_node is not None:
            if item.label is not None and known_node.label not in (None, item.label):
                raise BindError(
                    f"'{name}' is a {known_node.label} where it was first named, and a {item.label} here",
                    hint="write the label where the variable is first used",
                    span=item.span,
                )
            if node_id is not None and known_node.id not in (None, node_id):
                raise BindError(
                    f"'{name}' is #{known_node.id} where it was first named, and #{node_id} here", span=item.span
                )
            node = known_node if item.id is None else replace(known_node, id=node_id, span=item.id.span)
        else:
            label = item.label or (None if node_id is not None else "Object")
            span = item.span if item.id is None else item.id.span
            node = BoundNode(name=name or self._fresh(), named=name is not None, label=label, id=node_id, span=span)
        scope.nodes[node.name] = node
        for property_name, value in item.properties:
            left, kind = self._expression(ast.Property(variable=node.name, name=property_name, span=value.span), scope)
            right, other = self._expression(value, scope)
            self._comparable(kind, other, value)
            conditions.append(ast.Comparison(op="=", left=left, right=right, span=value.span))
        if item.meaning is not None:
            self._meaning(item.meaning)
            conditions.append(ast.Similar(variable=node.name, meaning=item.meaning, span=item.span))
        return node

    def _edge(self, item: ast.EdgePattern, left: str, right: str, scope: _Scope) -> BoundEdge:
        if item.variable is not None and (item.variable in scope.nodes or item.variable in scope.edges):
            raise BindError(
                f"'{item.variable}' is used twice; a relation's variable stands for one edge", span=item.span
            )
        for label in item.labels:
            self._relation(label, item.span)
        high = item.max_hops if item.max_hops is not None else MAX_HOPS
        if high > MAX_HOPS:
            raise BindError(f"a path of {high} hops is too long; {MAX_HOPS} is the most", span=item.span)
        if item.min_hops > high:
            raise BindError(f"a path of at least {item.min_hops} and at most {high} hops cannot be", span=item.span)
        if item.min_hops < 1:
            raise BindError("a path has at least 1 hop", span=item.span)
        source, target = (right, left) if item.direction is ast.Direction.IN else (left, right)
        edge = BoundEdge(
            name=item.variable or self._fresh(),
            named=item.variable is not None,
            source=source,
            target=target,
            labels=item.labels,
            meaning=self._meaning(item.meaning) if item.meaning is not None else None,
            directed=item.direction is not ast.Direction.ANY,
            min_hops=item.min_hops,
            max_hops=high,
        )
        if isinstance(edge.meaning, LikeMeaning | VectorMeaning):
            raise BindError("a relation is compared with a text", span=item.span)
        if edge.meaning is not None and edge.is_path:
            raise BindError(
                "'~' asks what one relation means, and this is a path of several",
                hint="write an edge for each relation",
                span=item.span,
            )
        scope.edges[edge.name] = edge
        self._warn_of_ends(edge, scope)
        return edge

    def _relation(self, label: str, span: Span) -> None:
        if label in self._catalog.relations or label in STANDARD_RELATIONS:
            return
        known = [*self._catalog.relations, *STANDARD_RELATIONS]
        raise BindError(
            f"no relation '{label}' in the store",
            hint=did_you_mean(label, known) or f"there is {one_of(dict.fromkeys(known))}",
            span=span,
        )

    def _warn_of_ends(self, edge: BoundEdge, scope: _Scope) -> None:
        """Say so when the labels at the ends of an edge rule out every relation of its kind in the store."""
        source, target = scope.nodes[edge.source].label, scope.nodes[edge.target].label
        ends = {pair for label in edge.labels for pair in self._catalog.relations.get(label, {})}
        if not ends or edge.is_path:
            return
        fits = {(a, b) for a, b in ends if source in (None, a) and target in (None, b)}
        if not edge.directed:
            fits |= {(a, b) for a, b in ends if source in (None, b) and target in (None, a)}
        if not fits:
            a, b = min(ends)
            self._warnings.append(
                f"no '{'|'.join(edge.labels)}' goes from {source or 'a node'} to {target or 'a node'}; "
                f"the store has (:{a})-[:{edge.labels[0]}]->(:{b})"
            )

    def _fresh(self) -> str:
        # A space cannot occur in a name that a statement gives.
        self._anonymous += 1
        return f"node {self._anonymous}"

    def _meaning(self, item: ast.Meaning) -> Meaning:
        if item not in self._meanings:
            self._meanings[item] = self._parameters.meaning(item)
        return self._meanings[item]

    # -- the rest of the statement ------------------------------------------------------------------------------

    def _returns(self, query: ast.Query, scope: _Scope) -> tuple[BoundReturn, ...]:
        columns: list[BoundReturn] = []
        for item in query.returns:
            expression, _ = self._expression(item.expression, scope, aggregates=True)
            name = item.name or to_text(item.expression)
            if any(name == column.name for column in columns):
                if item.name is not None:
                    raise BindError(f"two columns are named '{name}'", span=item.span)
                continue
            columns.append(BoundReturn(name=name, expression=expression))
        keys = [column.expression for column in columns if not _has_aggregate(column.expression)]
        if len(keys) < len(columns):
            for column in columns:
                self._check_total(column.expression, keys)
        return tuple(columns)

    def _check_total(self, item: ast.Expression, keys: Sequence[ast.Expression]) -> None:
        """Beside a total, what belongs to a single row is only known where the rows are grouped by it."""
        if item in keys or (isinstance(item, ast.Call) and item.name in AGGREGATES):
            return
        if _has_aggregate(item):
            for part in children(item):
                self._check_total(cast(ast.Expression, part), keys)
        elif _is_of_a_row(item):
            raise BindError(
                f"{to_text(item)} is neither a total nor a column that the rows are grouped by",
                hint="give it a column of its own in RETURN",
                span=item.span,
            )

    def _order(
        self, query: ast.Query, returns: tuple[BoundReturn, ...], scope: _Scope, aggregates: bool
    ) -> tuple[ast.OrderItem, ...]:
        named = {column.name: column.expression for column in returns}
        bound = []
        for item in query.order:
            expression = item.expression
            if isinstance(expression, ast.Variable) and expression.name in named:
                expression = named[expression.name]
            else:
                expression, _ = self._expression(expression, scope, aggregates=aggregates)
            if aggregates and expression not in named.values():
                raise BindError(
                    "with aggregates, ORDER BY can only name what RETURN gives",
                    hint=f"it gives {one_of(named)}",
                    span=item.span,
                )
            bound.append(replace(item, expression=expression))
        return tuple(bound)

    def _rerank(self, item: ast.Rerank | None) -> tuple[str, int] | None:
        if item is None:
            return None
        question = item.question.value if isinstance(item.question, ast.Text) else self._parameters.value(item.question)
        if not isinstance(question, str) or not question.strip():
            raise BindError("RERANK BY asks for a text", span=item.question.span)
        return question, self._count(item.top, "TOP") or 20

    def _count(self, item: ast.Number | ast.Parameter | None, clause: str) -> int | None:
        if item is None:
            return None
        value = item.value if isinstance(item, ast.Number) else self._parameters.value(item)
        if isinstance(value, bool) or not isinstance(value, (int, np.integer)) or value < 0:
            raise BindError(f"{clause} asks for a whole number from 0 up, not {value!r}", span=item.span)
        return int(value)

    # -- expressions --------------------------------------------------------------------------------------------

    def _expression(
        self, item: ast.Expression, scope: _Scope, *, aggregates: bool = False
    ) -> tuple[ast.Expression, str]:
        """The expression with its parameters filled in, and its kind."""
        match item:
            case ast.Text():
                return item, "text"
            case ast.Number():
                return ast.Number(
                    value=item.value * ast.UNITS[item.unit], span=item.span
                ) if item.unit else item, "number"
            case ast.Boolean():
                return item, "boolean"
            case ast.Null():
                return item, "any"
            case ast.ObjectRef():
                return item, "node"
            case ast.Parameter():
                value = self._parameters.literal(self._parameters.value(item), item)
                if item.span != ast.NOWHERE:
                    self._given[item.span] = item.name
                return value, _KINDS[type(value)]
            case ast.ListOf():
                return replace(item, items=tuple(self._member(x, scope) for x in item.items)), "list"
            case ast.Variable():
                return item, self._variable(item.name, item.span, scope)
            case ast.Property():
                return item, self._property(item, scope)
            case ast.Call():
                return self._call(item, scope, aggregates)
            case ast.Negative():
                operand, kind = self._expression(item.operand, scope, aggregates=aggregates)
                self._expect(kind, "number", item, "minus asks for a number")
                return replace(item, operand=operand), "number"
            case ast.Arithmetic():
                return self._arithmetic(item, scope, aggregates)
            case _:
                return self._condition(item, scope), "boolean"

    def _condition(self, item: ast.Expression, scope: _Scope) -> ast.Expression:
        match item:
            case ast.And() | ast.Or():
                parts = []
                for part in item.items:
                    bound, kind = self._expression(part, scope)
                    self._expect(kind, "boolean", part, f"{type(item).__name__.upper()} joins conditions")
                    parts.append(bound)
                return replace(item, items=tuple(parts))
            case ast.Not():
                bound, kind = self._expression(item.item, scope)
                self._expect(kind, "boolean", item.item, "NOT asks for a condition")
                return replace(item, item=bound)
            case ast.Comparison():
                left, one = self._expression(item.left, scope)
                right, other = self._expression(item.right, scope)
                self._comparable(one, other, item)
                if item.op not in ("=", "<>") and {one, other} & {"node", "edge", "path", "list", "boolean"}:
                    raise BindError(f"'{item.op}' compares numbers or texts", span=item.span)
                return replace(item, left=left, right=right)
            case ast.In():
                return self._membership(item, scope)
            case ast.Contains():
                text, kind = self._expression(item.text, scope)
                if kind not in ("text", "list", "any", "id", "mixed"):
                    raise BindError(f"CONTAINS looks into a text or a list, not a {kind}", span=item.text.span)
                return replace(item, text=text, part=self._member(item.part, scope))
            case ast.StartsWith():
                text, kind = self._expression(item.text, scope)
                self._expect(kind, "text", item.text, "STARTS WITH looks at a text")
                prefix, kind = self._expression(item.prefix, scope)
                self._expect(kind, "text", item.prefix, "STARTS WITH asks for a text")
                return replace(item, text=text, prefix=prefix)
            case ast.IsNull():
                return replace(item, item=self._expression(item.item, scope)[0])
            case ast.Similar():
                kind = self._variable(item.variable, item.span, scope)
                if kind != "node":
                    raise BindError(f"'~' asks about an object; '{item.variable}' is a {kind}", span=item.span)
                self._meaning(item.meaning)
                return item
            case ast.PatternCondition():
                self._subpattern(item.pattern, scope)
                return item
            case _:
                raise BindError(f"a {type(item).__name__} cannot stand here", span=item.span)

    def _membership(self, item: ast.In, scope: _Scope) -> ast.Expression:
        member, kind = self._expression(item.item, scope)
        if kind != "node":
            self._is_value(kind, item.item)
            collection, of = self._expression(item.collection, scope)
            self._expect(of, "list", item.collection, "IN asks for a list")
            return replace(item, item=member, collection=collection)
        if not isinstance(item.collection, ast.ListOf):
            raise BindError(
                "a node is looked for among nodes: [#1, #2]",
                hint=f"the ids are values: {to_text(item.item)}.id IN ..."
                if isinstance(member, ast.Variable)
                else None,
                span=item.collection.span,
            )
        nodes = []
        for one in item.collection.items:
            bound, of = self._expression(one, scope)
            self._comparable(kind, of, one)
            nodes.append(bound)
        return replace(item, item=member, collection=replace(item.collection, items=tuple(nodes)))

    def _member(self, item: ast.Expression, scope: _Scope) -> ast.Expression:
        """What may stand in a list: nodes and relations are known by their places here, which are no values."""
        bound, kind = self._expression(item, scope)
        self._is_value(kind, item)
        return bound

    def _is_value(self, kind: str, item: ast.Expression) -> None:
        if kind in ("node", "edge", "path"):
            raise BindError(
                f"a list holds values, and this is a {kind}",
                hint="its id is a value; collect() in RETURN makes lists of nodes and relations",
                span=item.span,
            )

    def _subpattern(self, pattern: ast.Pattern, scope: _Scope) -> None:
        inner = _Scope(nodes=dict(scope.nodes), edges=dict(scope.edges))
        for item in pattern.nodes:
            if item.variable is not None and item.variable not in scope.nodes and item.variable not in scope.edges:
                raise BindError(
                    f"'{item.variable}' is not a variable of MATCH",
                    hint=did_you_mean(item.variable, scope.names())
                    or 'inside a condition leave new nodes without a name, as in (o)-[:on]->(~ "table")',
                    span=item.span,
                )
        match = self._match((pattern,), inner)
        for condition in match.conditions:
            self._check_inside(condition, scope)
        # What the conditions compare with is matched along with it, as a node that no edge touches.
        outer = {name: node for name, node in inner.nodes.items() if name not in match.nodes and node.named}
        asked = set().union(*map(_nodes_named, match.conditions))
        self._subpatterns[pattern] = replace(
            match, nodes={**match.nodes, **{name: node for name, node in outer.items() if name in asked}}
        )

    def _check_inside(self, item: ast.Syntax, scope: _Scope) -> None:
        """Inside a pattern of a condition neither scores nor relations are known: they depend on what comes of it."""
        if isinstance(item, ast.Call) and item.name == "score":
            raise BindError("score() is not known inside a pattern of a condition", span=item.span)
        if isinstance(item, ast.Property | ast.Variable):
            name = item.variable if isinstance(item, ast.Property) else item.name
            if name in scope.edges:
                raise BindError(
                    f"'{name}' is a relation, which is not known inside a pattern of a condition",
                    hint="compare it in WHERE, beside the pattern",
                    span=item.span,
                )
        for part in children(item):
            self._check_inside(part, scope)

    def _variable(self, name: str, span: Span, scope: _Scope) -> str:
        if name in scope.nodes:
            return "node"
        if name in scope.edges:
            return "path" if scope.edges[name].is_path else "edge"
        known = scope.names()
        raise BindError(
            f"there is no variable '{name}'",
            hint=did_you_mean(name, known)
            or f"MATCH names {one_of(known) or 'none'}; a text is written in quotes: '{name}'",
            span=span,
        )

    def _property(self, item: ast.Property, scope: _Scope) -> str:
        kind = self._variable(item.variable, item.span, scope)
        if kind == "path":
            raise BindError(f"'{item.variable}' is a path, which has no properties", span=item.span)
        if kind == "edge":
            known = list(EDGE_PROPERTIES)
            if item.name in EDGE_PROPERTIES:
                return EDGE_PROPERTIES[item.name]
        else:
            known = [*BUILT_IN, *self._catalog.properties]
            if item.name in BUILT_IN:
                return BUILT_IN[item.name]
            if item.name in self._catalog.properties:
                found = self._catalog.properties[item.name]
                return "list" if found == "numbers" else found
        raise BindError(
            f"no property '{item.name}' in the store",
            hint=did_you_mean(item.name, known) or f"there is {one_of(known, most=14)}",
            span=item.span,
        )

    def _call(self, item: ast.Call, scope: _Scope, aggregates: bool) -> tuple[ast.Expression, str]:
        if item.name in AGGREGATES:
            if not aggregates:
                raise BindError(f"{item.name}() belongs into RETURN", span=item.span)
            signature = AGGREGATES[item.name]
            if item.star:
                if item.name != "count":
                    raise BindError(f"only count takes *, {item.name} does not", span=item.span)
                return item, "number"
        elif item.name in FUNCTIONS:
            signature = FUNCTIONS[item.name]
            if item.star or item.distinct:
                raise BindError(f"{item.name}() takes neither * nor DISTINCT", span=item.span)
        else:
            known = [*FUNCTIONS, *AGGREGATES]
            raise BindError(
                f"no function '{item.name}'",
                hint=did_you_mean(item.name, known) or f"there is {one_of(known, most=30)}",
                span=item.span,
            )
        self._arity(item, signature)
        arguments = []
        for position, argument in enumerate(item.arguments):
            bound, kind = self._expression(argument, scope, aggregates=aggregates and item.name not in AGGREGATES)
            wanted = signature.takes[min(position, len(signature.takes) - 1)]
            self._expect(kind, wanted, argument, f"{item.name}() asks for a {wanted}")
            of = {"node": ("node",), "row": ("node", "edge", "path")}.get(wanted, ())
            if item.name in FUNCTIONS and of and kind not in of:
                raise BindError(f"{item.name}() asks for a {of[0]}, and this is a value", span=argument.span)
            if wanted == "any" and kind in ("node", "edge", "path"):
                raise BindError(f"{item.name}() asks for a value, and this is a {kind}", span=argument.span)
            arguments.append(bound)
        return replace(item, arguments=tuple(arguments)), signature.gives

    def _arity(self, item: ast.Call, signature: Signature) -> None:
        most = len(signature.takes)
        least = most - signature.optional
        given = len(item.arguments)
        if given < least or (given > most and not signature.variadic):
            wanted = str(least) if least == most else f"{least} or {most}"
            raise BindError(f"{item.name}() takes {wanted} arguments, not {given}", span=item.span)

    def _arithmetic(self, item: ast.Arithmetic, scope: _Scope, aggregates: bool) -> tuple[ast.Expression, str]:
        left, one = self._expression(item.left, scope, aggregates=aggregates)
        right, other = self._expression(item.right, scope, aggregates=aggregates)
        if item.op == "+" and "text" in (one, other):
            for kind, part in ((one, item.left), (other, item.right)):
                self._expect(kind, "text", part, "'+' joins text with text")
            return replace(item, left=left, right=right), "text"
        for kind, part in ((one, item.left), (other, item.right)):
            self._expect(kind, "number", part, f"'{item.op}' asks for numbers")
        return replace(item, left=left, right=right), "number"

    def _expect(self, kind: str, wanted: str, item: ast.Expression, rule: str) -> None:
        accepted = {
            "any": True,
            "row": kind in ("node", "edge", "path") or wanted == "row",
            "list": kind in ("list", "text", "path") if rule.startswith("size") else kind == "list",
            "text": kind in ("text", "id"),
            "number": kind in ("number", "id"),
        }.get(wanted, kind == wanted)
        if not accepted and kind not in ("any", "mixed"):
            raise BindError(f"{rule}, and this is a {kind}", span=item.span)

    def _comparable(self, one: str, other: str, item: ast.Expression) -> None:
        if {one, other} & {"edge", "path"}:
            raise BindError(
                "relations are not compared as a whole: two edges never stand for the same one",
                hint="compare what they say: r.label, r.source, r.target",
                span=item.span,
            )
        loose = {"any", "mixed"}
        same = (
            one == other or loose & {one, other} or {one, other} <= {"id", "number"} or {one, other} <= {"id", "text"}
        )
        if not same:
            raise BindError(f"a {one} cannot be compared with a {other}", span=item.span)


_KINDS: Mapping[type[ast.Syntax], str] = {
    ast.Null: "any",
    ast.Boolean: "boolean",
    ast.Number: "number",
    ast.Text: "text",
    ast.ListOf: "list",
}
"""The kind of a value that a parameter gives."""


_ASK_LESS = "ask for less at once"


def _nodes_named(item: ast.Syntax) -> set[str]:
    """The variables that an expression names."""
    names = set().union(*map(_nodes_named, children(item)))
    if isinstance(item, ast.Property | ast.Similar | ast.NodePattern) and item.variable is not None:
        names.add(item.variable)
    return names | {item.name} if isinstance(item, ast.Variable) else names


def _check_no_row_score(item: ast.Syntax) -> None:
    if isinstance(item, ast.Call) and item.name == "score" and not item.arguments:
        raise BindError(
            "the score of a row is only known after all conditions",
            hint="score(o) is that of one object; score() can stand in RETURN and ORDER BY",
            span=item.span,
        )
    for part in children(item):
        _check_no_row_score(part)


def _is_of_a_row(item: ast.Syntax) -> bool:
    """Whether its value may differ from row to row."""
    if isinstance(item, ast.Variable | ast.Property | ast.Similar):
        return True
    if isinstance(item, ast.Call) and item.name == "score" and not item.arguments:
        return True
    if isinstance(item, ast.NodePattern) and item.variable is not None:
        return True
    return any(map(_is_of_a_row, children(item)))


def _has_aggregate(item: ast.Expression) -> bool:
    if isinstance(item, ast.Call):
        return item.name in AGGREGATES or any(map(_has_aggregate, item.arguments))
    if isinstance(item, ast.Arithmetic):
        return _has_aggregate(item.left) or _has_aggregate(item.right)
    if isinstance(item, ast.Negative):
        return _has_aggregate(item.operand)
    return False
