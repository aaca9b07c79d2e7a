"""Planner: in which order a bound statement is carried out, and what the graph index does of it.

A plan is made by a tuple of rules, each a function from a draft to a better one.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace

from cgdb.grammar import ast
from cgdb.index.catalog import Catalog
from cgdb.meaning.meanings import Meaning
from cgdb.query.bound import BoundEdge, BoundMatch, BoundNode, BoundQuery
from cgdb.query.cypher import Component, pushable
from cgdb.query.expressions import inside, names_score, variables

# Seconds, measured at 1,000 to 100,000 objects; they decide where a query starts and what is tested first.
GRAPH_STEP, GRAPH_NODE, GRAPH_ROW = 1.5e-3, 0.06e-6, 5e-6
"""Of a statement of the graph index: of any, for each node and condition on nodes, and for each row that it gives."""
SCAN = 0.03e-6
"""Of a node taken as it is."""
NEIGHBOUR = 0.5e-6
"""Of following the relations of a known node."""
TEST = 0.2e-6
"""Of a comparison for one node when all are compared together."""
PATTERN = 1e-6
"""Of a pattern used as a condition, or of a path, for one row."""
SORT, BATCH = 0.1e-6, 0.5e-3
"""Of the vectors: of each node that is put in order of its degree, and of each batch of candidates."""
GRAPH_EDGES = 4
"""Of one statement of the graph index. It takes 0.07 s to plan 4, 0.8 s for 8 and 4 s for 10, which nothing can stop;
a match of more begins at all candidates of its first node."""
FIRST_BATCH = 64
"""Candidates that a search from the vectors brings to the graph first; each later batch is four times as large."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Seed:
    """Where a search from the vectors starts: a node, and the meaning whose best matches are tried first."""

    node: str
    meaning: ast.Meaning


@dataclass(frozen=True, slots=True, kw_only=True)
class Near:
    """Two nodes that must lie within a distance: brought together by a grid, not by trying all pairs."""

    one: str
    other: str
    metres: float


@dataclass(frozen=True, slots=True, kw_only=True)
class Plan:
    """How a match is carried out, in this order.

    filters: (node, condition) pairs, tested on all nodes of its label before anything is matched. components: matched
    in the graph index or scanned. paths: edges of several hops, followed afterwards. hidden: conditions on unnamed
    nodes, whose best match counts. conditions: the rest, cheapest first. near: what a distance joins. fitting: (node,
    condition) pairs: only nodes that fit are matched, if that gives enough rows that fit (enough None: however many).
    seed: start from the vectors, None: from the graph. top: rows that are enough, None: all. estimates: {component:
    rows}.
    """

    match: BoundMatch
    filters: tuple[tuple[str, ast.Expression], ...] = ()
    components: tuple[Component, ...] = ()
    paths: tuple[BoundEdge, ...] = ()
    hidden: tuple[ast.Expression, ...] = ()
    conditions: tuple[ast.Expression, ...] = ()
    near: tuple[Near, ...] = ()
    fitting: tuple[tuple[str, ast.Expression], ...] = ()
    enough: int | None = None
    seed: Seed | None = None
    top: int | None = None
    estimates: tuple[float, ...] = ()


@dataclass(frozen=True, slots=True, kw_only=True)
class _Draft:
    plan: Plan
    query: BoundQuery | None
    pending: tuple[ast.Expression, ...]
    catalog: Catalog
    meanings: Mapping[ast.Meaning, Meaning] = field(default_factory=dict)


def plan(query: BoundQuery, catalog: Catalog) -> Plan:
    """The plan of a statement over a scene (or scenes) with this catalog."""
    draft = _Draft(plan=Plan(match=query.match), query=query, pending=query.conditions, catalog=catalog)
    return _applied(draft)


def plan_condition(match: BoundMatch, catalog: Catalog) -> Plan:
    """The plan of a pattern that is used as a condition."""
    return _applied(_Draft(plan=Plan(match=match), query=None, pending=match.conditions, catalog=catalog))


def _applied(draft: _Draft) -> Plan:
    for rule in RULES:
        draft = rule(draft)
    return draft.plan


# -- rules ------------------------------------------------------------------------------------------------------


def join_components(draft: _Draft) -> _Draft:
    """Nodes that single-hop edges connect become one component, matched by one statement of the graph index."""
    match = draft.plan.match
    group = {name: name for name in match.nodes}

    def root(name: str) -> str:
        while group[name] != name:
            name = group[name]
        return name

    single = [edge for edge in match.edges if not edge.is_path]
    for edge in single:
        group[root(edge.source)] = root(edge.target)
    aliases = {name: f"n{i}" for i, name in enumerate(match.nodes)}
    aliases.update({edge.name: f"r{i}" for i, edge in enumerate(single)})
    components = []
    for top in dict.fromkeys(root(name) for name in match.nodes):
        nodes = tuple(node for name, node in match.nodes.items() if root(name) == top)
        edges = tuple(edge for edge in single if root(edge.source) == top)
        names = {node.name for node in nodes} | {edge.name for edge in edges}
        mine = {name: alias for name, alias in aliases.items() if name in names}
        components.append(Component(nodes=nodes, edges=edges, pushed=(), aliases=mine))
    paths = tuple(edge for edge in match.edges if edge.is_path)
    return replace(draft, plan=replace(draft.plan, components=tuple(components), paths=paths))


def push_conditions(draft: _Draft) -> _Draft:
    """Comparisons that the graph index tests with the same meaning go into its statement."""
    components = list(draft.plan.components)
    pending = []
    for condition in draft.pending:
        names = variables(condition)
        home = next((i for i, part in enumerate(components) if names and names <= set(part.aliases)), None)
        nodes = {node.name for node in components[home].nodes} if home is not None else set()
        if home is not None and names <= nodes and pushable(condition, draft.catalog.properties):
            part = components[home]
            components[home] = replace(part, pushed=(*part.pushed, condition))
        else:
            pending.append(condition)
    return replace(draft, plan=replace(draft.plan, components=tuple(components)), pending=tuple(pending))


def split_hidden(draft: _Draft) -> _Draft:
    """Conditions on unnamed nodes come first: of an unnamed node only the best match counts."""
    nodes = draft.plan.match.nodes
    unnamed = {name for name, node in nodes.items() if not node.named}
    hidden = tuple(condition for condition in draft.pending if variables(condition) & unnamed)
    rest = tuple(condition for condition in draft.pending if condition not in hidden)
    return replace(draft, plan=replace(draft.plan, hidden=hidden), pending=rest)


def order_conditions(draft: _Draft) -> _Draft:
    """The cheapest conditions first, those that can drop rows before those that only weigh them."""
    ordered = tuple(sorted(draft.pending, key=_cost))
    return replace(draft, plan=replace(draft.plan, conditions=ordered), pending=())


def join_near(draft: _Draft) -> _Draft:
    """A distance that two nodes must keep below a constant brings components together, by a grid over their boxes."""
    found = [near for condition in draft.plan.conditions if (near := _near(condition)) is not None]
    known = [near for near in found if {near.one, near.other} <= set(draft.plan.match.nodes)]
    return replace(draft, plan=replace(draft.plan, near=tuple(known)))


def estimate_rows(draft: _Draft) -> _Draft:
    """How many rows each component gives, from the counts of the catalog."""
    estimates = tuple(_rows(part, draft.catalog) for part in draft.plan.components)
    return replace(draft, plan=replace(draft.plan, estimates=estimates))


def filter_first(draft: _Draft) -> _Draft:
    """What one node alone must meet is tested on all nodes at once, where that is cheaper than matching them first.

    Only yes-or-no conditions: they leave candidates, and nothing to be weighed afterwards.
    """
    made = draft.plan
    if draft.query is None:
        return draft
    filters, rest, estimates = [], [], list(made.estimates)
    for condition in made.conditions:
        names = variables(condition)
        node = made.match.nodes.get(next(iter(names))) if len(names) == 1 else None
        if node is not None and node.id is None and _is_test(condition):
            home = next(i for i, part in enumerate(made.components) if node in part.nodes)
            if _size(node, draft.catalog) * TEST <= estimates[home] * GRAPH_ROW:
                filters.append((node.name, condition))
                estimates[home] *= _RANGE
                continue
        rest.append(condition)
    made = replace(made, filters=tuple(filters), conditions=tuple(rest), estimates=tuple(estimates))
    return replace(draft, plan=made)


def keep_fitting(draft: _Draft) -> _Draft:
    """Only what fits is counted, and what fits is ordered before the rest: so only nodes that fit are matched first.

    A row fits only if all that it was asked fits. Should the rows that fit be fewer than the LIMIT, all are matched.
    """
    query, made = draft.query, draft.plan
    if query is None or not (query.aggregates or (query.order and query.limit is not None and not query.distinct)):
        return draft
    fitting = []
    for condition in made.conditions:
        names = variables(condition)
        node = made.match.nodes.get(next(iter(names))) if len(names) == 1 else None
        weighs = any(isinstance(item, ast.Similar) for item in inside(condition))
        costly = names_score(condition) or any(isinstance(item, ast.PatternCondition) for item in inside(condition))
        if node is not None and node.named and node.id is None and weighs and not costly:
            fitting.append((node.name, condition))
    enough = None if query.aggregates or query.limit is None else query.skip + query.limit
    return replace(draft, plan=replace(made, fitting=tuple(fitting), enough=enough))


def choose_start(draft: _Draft) -> _Draft:
    """Start from the vectors where the best few matches of a ``~`` will do and the graph would give many more rows.

    That is sound because a row's score is never above the degree of any one thing that it was asked: once enough
    rows score at least the degree of the next candidate, no later candidate can displace them.
    """
    query, made = draft.query, draft.plan
    if query is None or query.limit is None or query.order or query.aggregates or query.distinct or query.rerank:
        return draft
    top = query.skip + query.limit
    made = replace(made, top=top)
    seeds = [
        Seed(node=condition.variable, meaning=condition.meaning)
        for condition in made.conditions
        if isinstance(condition, ast.Similar) and made.match.nodes[condition.variable].id is None
    ]
    if seeds and top > 0 and _vectors_cost(draft, made, top) < _graph_cost(draft, made):
        made = replace(made, seed=seeds[0])
    return replace(draft, plan=made)


Rule = Callable[[_Draft], _Draft]
RULES: tuple[Rule, ...] = (
    join_components,
    push_conditions,
    split_hidden,
    order_conditions,
    join_near,
    estimate_rows,
    filter_first,
    keep_fitting,
    choose_start,
)


# -- costs ------------------------------------------------------------------------------------------------------


def known_nodes(plan: Plan) -> frozenset[str]:
    """The nodes whose candidates are known before anything is matched: a component that has one starts from it."""
    ids = {node.name for node in plan.match.nodes.values() if node.id is not None}
    wide = {part.nodes[0].name for part in plan.components if len(part.edges) > GRAPH_EDGES}
    return frozenset(ids | wide | {name for name, _ in plan.filters} | ({plan.seed.node} if plan.seed else set()))


def _graph_cost(draft: _Draft, made: Plan) -> float:
    """Seconds to match everything and weigh it."""
    known, nodes = known_nodes(made), draft.catalog.n_nodes
    cost = _all_rows(made) * PATTERN * _patterns(made)
    for part, rows in zip(made.components, made.estimates, strict=True):
        if not part.edges and not part.pushed:
            cost += rows * SCAN
        elif any(node.name in known for node in part.nodes):
            cost += (nodes * _RANGE + rows) * NEIGHBOUR
        else:
            cost += GRAPH_STEP + nodes * GRAPH_NODE * (1 + len(part.pushed)) + rows * GRAPH_ROW
    return cost


def _vectors_cost(draft: _Draft, made: Plan, top: int) -> float:
    """Seconds to match the best candidates until enough rows are found: the rarer the matches, the more are tried."""
    nodes, rows = max(draft.catalog.n_nodes, 1), _all_rows(made)
    tried = min(nodes, max(FIRST_BATCH, 4 * top * nodes / rows))
    share = rows * tried / nodes
    return nodes * SORT + BATCH + (tried + share) * NEIGHBOUR + share * PATTERN * _patterns(made)


def _all_rows(made: Plan) -> float:
    rows = 1.0
    for estimate in made.estimates:
        rows *= max(estimate, 1.0)
    return rows


def _patterns(made: Plan) -> int:
    """How many paths and patterns used as conditions a row is asked."""
    weighed = (*made.hidden, *made.conditions)
    return len(made.paths) + sum(isinstance(x, ast.PatternCondition) for item in weighed for x in inside(item))


# -- estimates --------------------------------------------------------------------------------------------------

_EQUAL, _RANGE = 0.05, 0.3
"""Shares of rows that an equality and a range comparison are taken to keep, where nothing more is known."""


def _rows(part: Component, catalog: Catalog) -> float:
    nodes = {node.name: _size(node, catalog) for node in part.nodes}
    rows = 1.0
    for count in nodes.values():
        rows *= count
    for edge in part.edges:
        labels = edge.labels or tuple(catalog.relations)
        count = float(sum(map(catalog.relation_count, labels))) * (1 if edge.directed else 2)
        rows *= min(1.0, count / max(1.0, float(catalog.n_nodes) ** 2))
    for condition in part.pushed:
        rows *= _kept(condition, catalog)
    return rows


def _kept(condition: ast.Expression, catalog: Catalog) -> float:
    """The share of nodes that a pushed condition keeps; of a range, the part of all values that lies in it."""
    if isinstance(condition, (ast.In, ast.IsNull)):
        return _EQUAL
    match condition:
        case ast.Comparison(op="="):
            return _EQUAL
        case ast.Comparison(op="<" | "<=" | ">" | ">=" as op, left=ast.Property(name=name), right=ast.Number(value=at)):
            low, high = catalog.ranges.get(name, (0.0, 0.0))
            if low < high:
                below = min(max((at - low) / (high - low), 0.0), 1.0)
                return max(below if op in ("<", "<=") else 1.0 - below, 0.001)
    return _RANGE


def _size(node: BoundNode, catalog: Catalog) -> float:
    if node.id is not None:
        return 1.0
    return float(catalog.n_nodes if node.label is None else catalog.labels.get(node.label, 0))


def _is_test(condition: ast.Expression) -> bool:
    """Whether it is a plain yes or no, whatever else the row was asked."""
    weighed = (ast.Similar, ast.PatternCondition)
    return not names_score(condition) and not any(isinstance(item, weighed) for item in inside(condition))


def _near(condition: ast.Expression) -> Near | None:
    if not isinstance(condition, ast.Comparison):
        return None
    small, large = (condition.left, condition.right) if "<" in condition.op else (condition.right, condition.left)
    if condition.op not in ("<", "<=", ">", ">=") or not isinstance(large, ast.Number) or large.value < 0:
        return None
    # Centers are never nearer than the boxes around them, so this holds for both ways to measure.
    match small:
        case ast.Call(name="distance", arguments=(ast.Variable(name=one), ast.Variable(name=other), *_)) if (
            one != other
        ):
            return Near(one=one, other=other, metres=float(large.value))
    return None


def _cost(condition: ast.Expression) -> int:
    if isinstance(condition, ast.PatternCondition):
        return 4
    inner = tuple(inside(condition))
    if any(isinstance(item, ast.PatternCondition) for item in inner):
        return 4
    if any(isinstance(item, ast.Similar) for item in inner):
        return 3 if not isinstance(condition, ast.Similar) else 2
    return 1 if any(isinstance(item, ast.Call) for item in inner) else 0
