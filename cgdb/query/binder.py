"""Binder: a parsed statement against the names of a store and the values of its parameters.

Every name that the statement uses is looked up here, once; what comes out can be carried out as it stands.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any, cast

import numpy as np

from cgdb.errors import BindError, LimitError, Span, did_you_mean, one_of
from cgdb.grammar import ast
from cgdb.grammar.limits import children
from cgdb.grammar.printer import to_text
from cgdb.index.catalog import Catalog
from cgdb.meaning.meanings import LikeMeaning, Meaning, VectorMeaning
from cgdb.query.bound import BoundEdge, BoundMatch, BoundNode, BoundQuery, BoundReturn
from cgdb.query.expressions import is_total, variables
from cgdb.query.functions import AGGREGATES
from cgdb.query.kinds import OF_LITERALS, expect, expect_argument, expect_comparable, expect_value, signature_of
from cgdb.query.parameters import Parameters
from cgdb.query.scope import Scope

MAX_HOPS = 10
"""Longest path that a statement may ask for; ``*`` without an upper bound means this many."""
MAX_NODES = 50
"""Nodes that the patterns of a statement, or of one condition in it, may have together."""
_ASK_LESS = "ask for less at once"


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
        scope = Scope(catalog=self._catalog)
        match = self._match(query.patterns, scope)
        conditions = list(match.conditions)
        if query.where is not None:
            where, kind = self._expression(query.where, scope)
            expect(kind, "boolean", query.where, "WHERE asks for a condition")
            conditions.extend(where.items if isinstance(where, ast.And) else (where,))
        for condition in conditions:
            _check_no_row_score(condition)
        returns = self._returns(query, scope)
        aggregates = any(is_total(item.expression) for item in returns)
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

    def _match(self, patterns: Sequence[ast.Pattern], scope: Scope) -> BoundMatch:
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

    def _node(self, item: ast.NodePattern, scope: Scope, conditions: list[ast.Expression]) -> BoundNode:
        name = item.variable
        if name is None and item.id is not None:
            # The same #12 twice is the same node; any other node without a name is one of its own.
            known_reference = next((n for n in scope.nodes.values() if not n.named and n.id == item.id.id), None)
            if known_reference is not None and item.label is None and not item.properties and item.meaning is None:
                return known_reference
        if name is not None and name in scope.edges:
            raise BindError(f"'{name}' is a relation here and cannot be a node as well", span=item.span)
        if item.label is not None:
            scope.check_label(item.label, item.span)
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
            expect_comparable(kind, other, value)
            conditions.append(ast.Comparison(op="=", left=left, right=right, span=value.span))
        if item.meaning is not None:
            self._meaning(item.meaning)
            conditions.append(ast.Similar(variable=node.name, meaning=item.meaning, span=item.span))
        return node

    def _edge(self, item: ast.EdgePattern, left: str, right: str, scope: Scope) -> BoundEdge:
        if item.variable is not None and (item.variable in scope.nodes or item.variable in scope.edges):
            raise BindError(
                f"'{item.variable}' is used twice; a relation's variable stands for one edge", span=item.span
            )
        for label in item.labels:
            scope.check_relation(label, item.span)
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
        if (warning := scope.ends_that_do_not_meet(edge)) is not None:
            self._warnings.append(warning)
        return edge

    def _fresh(self) -> str:
        # A space cannot occur in a name that a statement gives.
        self._anonymous += 1
        return f"node {self._anonymous}"

    def _meaning(self, item: ast.Meaning) -> Meaning:
        if item not in self._meanings:
            self._meanings[item] = self._parameters.meaning(item)
        return self._meanings[item]

    # -- the rest of the statement ------------------------------------------------------------------------------

    def _returns(self, query: ast.Query, scope: Scope) -> tuple[BoundReturn, ...]:
        columns: list[BoundReturn] = []
        for item in query.returns:
            expression, _ = self._expression(item.expression, scope, aggregates=True)
            name = item.name or to_text(item.expression)
            if any(name == column.name for column in columns):
                if item.name is not None:
                    raise BindError(f"two columns are named '{name}'", span=item.span)
                continue
            columns.append(BoundReturn(name=name, expression=expression))
        keys = [column.expression for column in columns if not is_total(column.expression)]
        if len(keys) < len(columns):
            for column in columns:
                self._check_total(column.expression, keys)
        return tuple(columns)

    def _check_total(self, item: ast.Expression, keys: Sequence[ast.Expression]) -> None:
        """Beside a total, what belongs to a single row is only known where the rows are grouped by it."""
        if item in keys or (isinstance(item, ast.Call) and item.name in AGGREGATES):
            return
        if is_total(item):
            for part in children(item):
                self._check_total(cast(ast.Expression, part), keys)
        elif _is_of_a_row(item):
            raise BindError(
                f"{to_text(item)} is neither a total nor a column that the rows are grouped by",
                hint="give it a column of its own in RETURN",
                span=item.span,
            )

    def _order(
        self, query: ast.Query, returns: tuple[BoundReturn, ...], scope: Scope, aggregates: bool
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
        self, item: ast.Expression, scope: Scope, *, aggregates: bool = False
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
                return value, OF_LITERALS[type(value)]
            case ast.ListOf():
                return replace(item, items=tuple(self._member(x, scope) for x in item.items)), "list"
            case ast.Variable():
                return item, scope.kind(item.name, item.span)
            case ast.Property():
                return item, scope.kind_of_property(item)
            case ast.Call():
                return self._call(item, scope, aggregates)
            case ast.Negative():
                operand, kind = self._expression(item.operand, scope, aggregates=aggregates)
                expect(kind, "number", item, "minus asks for a number")
                return replace(item, operand=operand), "number"
            case ast.Arithmetic():
                return self._arithmetic(item, scope, aggregates)
            case _:
                return self._condition(item, scope), "boolean"

    def _condition(self, item: ast.Expression, scope: Scope) -> ast.Expression:
        match item:
            case ast.And() | ast.Or():
                parts = []
                for part in item.items:
                    bound, kind = self._expression(part, scope)
                    expect(kind, "boolean", part, f"{type(item).__name__.upper()} joins conditions")
                    parts.append(bound)
                return replace(item, items=tuple(parts))
            case ast.Not():
                bound, kind = self._expression(item.item, scope)
                expect(kind, "boolean", item.item, "NOT asks for a condition")
                return replace(item, item=bound)
            case ast.Comparison():
                left, one = self._expression(item.left, scope)
                right, other = self._expression(item.right, scope)
                expect_comparable(one, other, item)
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
                expect(kind, "text", item.text, "STARTS WITH looks at a text")
                prefix, kind = self._expression(item.prefix, scope)
                expect(kind, "text", item.prefix, "STARTS WITH asks for a text")
                return replace(item, text=text, prefix=prefix)
            case ast.IsNull():
                return replace(item, item=self._expression(item.item, scope)[0])
            case ast.Similar():
                kind = scope.kind(item.variable, item.span)
                if kind != "node":
                    raise BindError(f"'~' asks about an object; '{item.variable}' is a {kind}", span=item.span)
                self._meaning(item.meaning)
                return item
            case ast.PatternCondition():
                self._subpattern(item.pattern, scope)
                return item
            case _:
                raise BindError(f"a {type(item).__name__} cannot stand here", span=item.span)

    def _membership(self, item: ast.In, scope: Scope) -> ast.Expression:
        member, kind = self._expression(item.item, scope)
        if kind != "node":
            expect_value(kind, item.item)
            collection, of = self._expression(item.collection, scope)
            expect(of, "list", item.collection, "IN asks for a list")
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
            expect_comparable(kind, of, one)
            nodes.append(bound)
        return replace(item, item=member, collection=replace(item.collection, items=tuple(nodes)))

    def _member(self, item: ast.Expression, scope: Scope) -> ast.Expression:
        """What may stand in a list: nodes and relations are known by their places here, which are no values."""
        bound, kind = self._expression(item, scope)
        expect_value(kind, item)
        return bound

    def _subpattern(self, pattern: ast.Pattern, scope: Scope) -> None:
        inner = scope.copy()
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
            scope.check_inside_pattern(condition)
        # What the conditions compare with is matched along with it, as a node that no edge touches.
        outer = {name: node for name, node in inner.nodes.items() if name not in match.nodes and node.named}
        asked = frozenset().union(*map(variables, match.conditions))
        self._subpatterns[pattern] = replace(
            match, nodes={**match.nodes, **{name: node for name, node in outer.items() if name in asked}}
        )

    def _call(self, item: ast.Call, scope: Scope, aggregates: bool) -> tuple[ast.Expression, str]:
        signature = signature_of(item, aggregates=aggregates)
        arguments = []
        for position, argument in enumerate(item.arguments):
            bound, kind = self._expression(argument, scope, aggregates=aggregates and item.name not in AGGREGATES)
            wanted = signature.takes[min(position, len(signature.takes) - 1)]
            expect_argument(kind, wanted, argument, item.name)
            arguments.append(bound)
        return replace(item, arguments=tuple(arguments)), signature.gives

    def _arithmetic(self, item: ast.Arithmetic, scope: Scope, aggregates: bool) -> tuple[ast.Expression, str]:
        left, one = self._expression(item.left, scope, aggregates=aggregates)
        right, other = self._expression(item.right, scope, aggregates=aggregates)
        if item.op == "+" and "text" in (one, other):
            for kind, part in ((one, item.left), (other, item.right)):
                expect(kind, "text", part, "'+' joins text with text")
            return replace(item, left=left, right=right), "text"
        for kind, part in ((one, item.left), (other, item.right)):
            expect(kind, "number", part, f"'{item.op}' asks for numbers")
        return replace(item, left=left, right=right), "number"


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
