"""Where nothing fits as it was said: the statement with a condition asked less strictly, or left out, and what that is.

What is wanted must be there all the same: a thing of another kind, or for another use, is no answer. Of a thing that is
what is wanted, a condition that the map cannot tell, or tells a little otherwise, is worth an answer that says so.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace
from itertools import chain, combinations, islice, product
from typing import TYPE_CHECKING

from cgdb.asking.statements import also, best_of, like
from cgdb.english import tree_parts as parts
from cgdb.grammar import ast
from cgdb.grammar.printer import to_text
from cgdb.result import Result

if TYPE_CHECKING:
    from cgdb.english.looser import Looser
    from cgdb.english.translate import Translation

Run = Callable[[ast.Query], Result]

MOST_TRIES = 8
"""Statements that are run in search of one that something fits."""


def loosened(made: Translation, run: Run) -> Translation | None:
    """The translation that something fits and that asks least less; None where nothing fits any."""
    if made.asked.form not in ("find", "exists", "where") or not made.wanted:
        return None
    choices = [_possible(one.looser, run) for one in made.conditions]
    for asked in (made, _plainly(made)):
        if asked is None or (asked is made and not any(choices)) or not is_there(asked, run):
            continue
        ways = chain([(None,) * len(choices)] if asked is not made else [], _ways(choices))
        for chosen in islice(ways, MOST_TRIES):
            query = _with(asked, chosen)
            if not run(query).nothing_fits:
                says = tuple(one.says for one in chosen if one is not None)
                return replace(asked, query=query, text=to_text(query), assumed=_once(*asked.assumed, *says))
    return None


def widened(made: Translation, run: Run) -> Translation | None:
    """The translation that leaves out more where "the one on the desk" is none of the things wanted; None: it is one.

    Whoever says "not the one on the desk" has seen one there. That something fits is known.
    """
    subject, found = _subject(made.query), made
    if subject is None or made.asked.form not in ("find", "exists", "where"):
        return None
    for i, condition in enumerate(made.conditions):
        wider, denied = condition.wider, condition.expression
        if wider is None or not isinstance(denied, ast.Not) or not isinstance(wider.expression, ast.Not):
            continue
        wanted = best_of(subject, 1)
        if not run(also(wanted, denied.item)).nothing_fits or run(also(wanted, wider.expression.item)).nothing_fits:
            continue
        query = _with(found, tuple(wider if at == i else None for at in range(len(made.conditions))))
        if not run(query).nothing_fits:
            found = replace(found, query=query, text=to_text(query), assumed=_once(*found.assumed, wider.says))
    return None if found is made else found


def _subject(query: ast.Query) -> ast.NodePattern | None:
    return next((node for node in query.patterns[0].nodes if node.variable == parts.SUBJECT), None)


def is_there(made: Translation, run: Run) -> bool:
    """Whether anything is what is wanted, whatever else is asked of it."""
    subject = _subject(made.query)
    return subject is not None and not run(best_of(subject, 1)).nothing_fits


def _plainly(made: Translation) -> Translation | None:
    """The translation without the traits that the map cannot tell."""
    subject, plain = _subject(made.query), made.plain
    if plain is None or subject is None:
        return None
    first, *others = made.query.patterns
    meant = replace(subject, meaning=_text(plain.wanted))
    nodes = tuple(meant if node is subject else node for node in first.nodes)
    query = replace(made.query, patterns=(replace(first, nodes=nodes), *others))
    return replace(made, query=query, wanted=plain.wanted, assumed=_once(*made.assumed, plain.says))


def _once(*lines: str) -> tuple[str, ...]:
    return tuple(dict.fromkeys(lines))


def _possible(looser: tuple[Looser, ...], run: Run) -> tuple[Looser, ...]:
    """Those that hold: what is left out because the map knows no such thing must not be there."""
    return tuple(one for one in looser if all(run(best_of(like(_text(a)), 1)).nothing_fits for a in one.absent))


def _ways(choices: list[tuple[Looser, ...]]) -> Iterator[tuple[Looser | None, ...]]:
    """What to ask of each condition, None for as it was said: one changed, all of them, then some."""
    free = [i for i, one in enumerate(choices) if one]
    sizes = dict.fromkeys((1, len(free), *range(2, len(free))))
    for changed in (some for size in sizes for some in combinations(free, size)):
        for chosen in product(*(choices[i] for i in changed)):
            at = dict(zip(changed, chosen, strict=True))
            yield tuple(at.get(i) for i in range(len(choices)))


def _with(made: Translation, chosen: tuple[Looser | None, ...]) -> ast.Query:
    where = made.query.where
    left = list(_parts(where)) if where is not None else []
    for condition, instead in zip(made.conditions, chosen, strict=True):
        if instead is None:
            continue
        own = _parts(condition.expression)
        at = next((left.index(part) for part in own if part in left), len(left))
        left = [part for part in left if part not in own]
        if instead.expression is not None:
            left[at:at] = [instead.expression]
    return replace(made.query, where=parts.all_of(left) if left else None)


def _parts(condition: ast.Expression) -> tuple[ast.Expression, ...]:
    return condition.items if isinstance(condition, ast.And) else (condition,)


def _text(text: str) -> ast.Text:
    return ast.Text(value=parts.cut(text))
