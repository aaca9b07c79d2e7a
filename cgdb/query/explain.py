"""What EXPLAIN and PROFILE print: the steps of a plan in the order in which they happen."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

from cgdb.index.catalog import Catalog
from cgdb.query import cypher
from cgdb.query.bound import BoundQuery
from cgdb.query.planner import Plan, known_nodes
from cgdb.query.reasons import asked, meaning_text

if TYPE_CHECKING:
    from cgdb.model.llm import Usage
    from cgdb.query.executor import Profile


def plan_text(
    query: BoundQuery,
    plan: Plan,
    catalog: Catalog,
    profile: Profile | None,
    timings: Mapping[str, float],
    usage: Usage | None = None,
) -> str:
    """The plan as indented lines; with a profile each step also says how many rows it gave and how long it took.

    usage: what re-ranking cost.
    """
    lines: list[str] = []

    def step(text: str, key: str | None = None, estimate: float | None = None) -> None:
        about = f"  ~{estimate:,.0f} rows" if estimate is not None else ""
        if profile is not None and key is not None:
            rows, seconds = profile.steps.get(key, (0, 0.0))
            about += f"  [{rows:,} rows, {1000 * seconds:.2f} ms]"
        lines.append(f"{len(lines) + 1}. {text}{about}")

    for name, test in plan.filters:
        step(f"filter: {name} by {asked(test, query)}", f"filter {id(test)}")
    for name, test in plan.fitting:
        step(f"first: only {name} that fits {asked(test, query)}", f"fitting {id(test)}")
    if plan.seed is not None:
        text = meaning_text(query.meanings[plan.seed.meaning])
        step(
            f"vectors: best of ({plan.seed.node} ~ {text}) first, in batches, until {plan.top} rows are certain",
            f"vectors {plan.seed.node}",
            float(catalog.n_nodes),
        )
    known = known_nodes(plan)
    for number, component in enumerate(plan.components):
        estimate = plan.estimates[number] if number < len(plan.estimates) else None
        begin = [node.name for node in component.nodes if node.name in known]
        if begin and (component.edges or component.pushed):
            step(
                f"neighbours: {_followed(component, query)} from {' or '.join(begin)}", f"component {number}", estimate
            )
        elif component.edges or component.pushed:
            one_line = " ".join(cypher.statement(component).text.split())
            step(f"graph: {one_line}", f"component {number}", estimate)
        else:
            node = component.nodes[0]
            step(f"scan: {node.label or 'nodes'} as {node.name}", f"component {number}", estimate)
    for near in plan.near:
        step(f"near: {near.one} and {near.other} within {near.metres:g} m, where they are not matched together")
    for edge in plan.paths:
        labels = "|".join(edge.labels) or "any relation"
        step(
            f"paths: {labels} *{edge.min_hops}..{edge.max_hops} from {edge.source} to {edge.target}",
            f"path {edge.name}",
        )
    for number, condition in enumerate(plan.hidden):
        step(f"weigh: {asked(condition, query)} (best match counts)", f"condition {number} {id(condition)}")
    for number, condition in enumerate(plan.conditions):
        step(f"weigh: {asked(condition, query)}", f"condition {number} {id(condition)}")
    if query.aggregates:
        step("group: " + ", ".join(column.name for column in query.returns))
    if query.order:
        keys = (asked(item.expression, query) + (" DESC" if item.descending else "") for item in query.order)
        step("order: " + ", ".join(keys))
    elif not query.aggregates:
        step("order: best score first")
    if query.rerank is not None:
        cost = f" ({usage})" if profile is not None and usage is not None and usage.calls else ""
        step(f'rerank: the best {query.rerank[1]} by "{query.rerank[0]}"{cost}', "rerank")
    if query.limit is not None or query.skip:
        step(f"cut: skip {query.skip}, " + ("all that follow" if query.limit is None else f"at most {query.limit}"))
    if not query.aggregates:
        step("return: " + ", ".join(column.name for column in query.returns))
    if profile is not None:
        lines.append("   " + ", ".join(f"{stage} {1000 * seconds:.2f} ms" for stage, seconds in timings.items()))
    return "\n".join(lines)


def _followed(component: cypher.Component, query: BoundQuery) -> str:
    edges = [
        f"({edge.source})-[{':' if edge.labels else ''}{'|'.join(edge.labels)}]-{'>' * edge.directed}({edge.target})"
        for edge in component.edges
    ]
    tests = " AND ".join(asked(condition, query) for condition in component.pushed)
    return (", ".join(edges) or f"({component.nodes[0].name})") + (f" where {tests}" if tests else "")
