"""The flow of a query: parse, bind, plan, execute, answer. One short function runs the stages in order."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any

from cgdb.errors import BindError, CgdbError, SceneError, did_you_mean, one_of
from cgdb.grammar import ast
from cgdb.grammar.parser import parse
from cgdb.grammar.printer import to_text
from cgdb.index.catalog import merge
from cgdb.query.answer import SceneRows, answer
from cgdb.query.binder import bind
from cgdb.query.bound import BoundQuery
from cgdb.query.executor import Executor, Profile, meanings_of
from cgdb.query.explain import plan_text
from cgdb.query.expressions import parts
from cgdb.query.limits import Budget
from cgdb.query.parameters import check_value
from cgdb.query.planner import Plan, plan
from cgdb.result import Result, Row
from cgdb.view import SceneView

if TYPE_CHECKING:
    from cgdb.model.llm import Model, Usage
    from cgdb.model.rerank import Reranked, Reranker

ViewsOf = Callable[[Sequence[str] | None, int | str | None], Sequence[SceneView]]
"""The views of the scenes with these names (None: all), as of a revision or time (None: now)."""


def run(
    text: str,
    parameters: Mapping[str, Any],
    views_of: ViewsOf,
    budget: Budget,
    reranker: Reranker | Model | None = None,
) -> Result:
    """The answer to a statement. Every error of a stage carries its place in the text.

    reranker: for RERANK BY; None: the language model that is configured.
    """
    started = time.perf_counter()
    timings: dict[str, float] = {}

    def lap(stage: str) -> None:
        nonlocal started
        now = time.perf_counter()
        timings[stage] = now - started
        started = now

    try:
        tree = parse(text)
        lap("parse")
        views = _views(tree, parameters, views_of)
        lap("open")
        catalog = merge(view.catalog for view in views)
        bound = bind(tree, catalog, parameters)
        check_ids(bound, views)
        lap("bind")
        made = plan(bound, catalog)
        lap("plan")
        profile = Profile()
        more_warnings: tuple[str, ...] = ()
        usage: Usage | None = None
        rows: tuple[Row, ...] = ()
        if tree.mode is not ast.Mode.EXPLAIN:
            parts = _executed(bound, made, views, budget, profile)
            lap("execute")
            rows = answer(_before_ranking(bound), parts, budget)
            lap("answer")
            if bound.rerank is not None:
                ranked = _ranked(bound, rows, reranker)
                rows, more_warnings, usage = ranked.rows, ranked.warnings, ranked.usage
                lap("rerank")
                profile.add("rerank", len(rows), timings["rerank"])
    except CgdbError as error:
        # Names and parameters stand in messages; what is no letter in them must not reach a terminal as it is.
        error.message = printable(error.message)
        error.args = (error.message,)
        error.hint = None if error.hint is None else printable(error.hint)
        raise error.located(text) from error.__cause__
    warnings = (*bound.warnings, *more_warnings, *(line for view in views for line in view.degrees.warnings))
    explained = plan_text(bound, made, catalog, profile if tree.mode is ast.Mode.PROFILE else None, timings, usage)
    if tree.mode is not ast.Mode.RUN:
        lines = tuple(Row((line,), 1.0, True, tuple) for line in explained.splitlines())
        return Result(
            columns=("plan",),
            rows=lines,
            plan=explained,
            timings=timings,
            warnings=warnings,
            query=to_text(tree),
            usage=usage,
        )
    return Result(
        columns=tuple(column.name for column in bound.returns),
        rows=rows,
        plan=explained,
        timings=timings,
        warnings=tuple(dict.fromkeys(warnings)),
        query=to_text(tree),
        usage=usage,
    )


def _before_ranking(bound: BoundQuery) -> BoundQuery:
    """Ranking looks at the best rows; SKIP and LIMIT cut what it leaves."""
    if bound.rerank is None:
        return bound
    limit = None if bound.limit is None else max(bound.rerank[1], bound.skip + bound.limit)
    return replace(bound, skip=0, limit=limit)


def _ranked(bound: BoundQuery, rows: tuple[Row, ...], reranker: Reranker | Model | None) -> Reranked:
    from cgdb.model.rerank import rerank

    assert bound.rerank is not None
    question, top = bound.rerank
    found = rerank(reranker, question, [column.name for column in bound.returns], rows, top)
    end = None if bound.limit is None else bound.skip + bound.limit
    return replace(found, rows=found.rows[bound.skip : end])


def printable(text: str) -> str:
    """The text on one line, with escapes in place of characters that are not shown."""
    if text.isprintable():
        return text
    return "".join(c if c.isprintable() else c.encode("unicode_escape").decode() for c in text)


def _views(tree: ast.Query, parameters: Mapping[str, Any], views_of: ViewsOf) -> Sequence[SceneView]:
    names: list[str] = []
    for item in tree.scenes:
        value = item.value if isinstance(item, ast.Text) else _given(item, parameters)
        for name in value if isinstance(value, (list, tuple)) else (value,):
            if not isinstance(name, str):
                raise BindError(f"USE asks for the names of scenes, not {name!r}", span=item.span)
            if name not in names:
                names.append(name)
    as_of: int | str | None = None
    if tree.as_of is not None:
        given = _given(tree.as_of, parameters) if isinstance(tree.as_of, ast.Parameter) else tree.as_of.value
        if isinstance(given, bool) or not isinstance(given, (int, str)):
            raise BindError("AS OF asks for the number of a revision or a time", span=tree.as_of.span)
        as_of = given
    try:
        return views_of(names or None, as_of)
    except CgdbError as error:
        if error.span is None and (tree.scenes or tree.as_of is not None):
            places = [item for item in tree.scenes if isinstance(item, ast.Text) and f"'{item.value}'" in error.message]
            error.span = (places[0] if places else tree.as_of or tree.scenes[0]).span
        raise


def _given(item: ast.Parameter, parameters: Mapping[str, Any]) -> Any:
    if item.name not in parameters:
        raise BindError(
            f"parameter ${item.name} was not given", hint=did_you_mean(item.name, parameters), span=item.span
        )
    check_value(item.name, parameters[item.name], item.span)
    return parameters[item.name]


def check_ids(bound: BoundQuery, views: Sequence[SceneView]) -> None:
    """An id that no scene has is a slip of the pen, and said so; one that some scenes lack stands for none there."""
    for item in sorted(_references(bound), key=lambda item: item.span.start):
        try:
            missing = all(view.find(item.id) is None for view in views)
        except SceneError as error:
            raise BindError(error.message, span=item.span) from None
        if missing:
            names = one_of((view.info.name for view in views), most=4)
            raise BindError(f"there is no object or place #{item.id} in {names}", span=item.span)


def _references(bound: BoundQuery) -> Iterator[ast.ObjectRef]:
    """Every id that the statement names."""
    matches = (bound.match, *bound.subpatterns.values())
    for node in (node for match in matches for node in match.nodes.values()):
        if node.id is not None:
            yield ast.ObjectRef(id=node.id, span=node.span)
    items: list[Any] = [*bound.meanings, *bound.conditions, *(c for match in matches for c in match.conditions)]
    items.extend(column.expression for column in bound.returns)
    items.extend(order.expression for order in bound.order)
    while items:
        item = items.pop()
        if isinstance(item, ast.ObjectRef):
            yield item
        items.extend(parts(item))


def _executed(
    bound: BoundQuery, made: Plan, views: Sequence[SceneView], budget: Budget, profile: Profile
) -> list[SceneRows]:
    parts = []
    for view in views:
        view.degrees.expect(meanings_of(bound))
        executor = Executor(view, bound, budget, profile)
        parts.append(SceneRows(view=view, executor=executor, plan=made, rows=executor.rows(made)))
    return parts
