"""Where nothing fits: the things that come nearest, and what each of them lacks."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

from cgdb.asking.answer import first_node
from cgdb.asking.shortlist import identity
from cgdb.asking.statements import among_these, best_of, like
from cgdb.english import tree_parts as parts
from cgdb.english.second_reading import by_description
from cgdb.grammar import ast
from cgdb.meaning.situations import MARK, split
from cgdb.result import Reason, Result, Row, StoredNode

if TYPE_CHECKING:
    from cgdb.english.translate import Translation

Run = Callable[[ast.Query], Result]

NEAREST = 5
"""Things that are shown where nothing fits."""
_AS_YOU = ("eu", "one", "uk", "unic", "unif", "unio", "uniq", "unis", "unit", "univ", "usb", "use", "usu")
"""How words begin that are written with a vowel first and said with none: a unicorn, a USB stick, a one-way sign."""


@dataclass(frozen=True, slots=True, kw_only=True)
class NearMisses:
    """The nearest rows, none of which fits; lacks: by (scene, id) what the thing lacks, in words; wanted: those things
    that are what was wanted, but for what else was asked of it."""

    rows: tuple[Row, ...]
    lacks: Mapping[Any, str]
    wanted: frozenset[Any]


def near_misses(made: Translation, run: Run, there: Sequence[Row] = ()) -> NearMisses:
    """What comes nearest where nothing fits.

    there: rows of the statement that do not fit, which are the nearest where there are any, but where a thing is asked
    by its use or described: then those that all that was said comes nearest to.
    """
    rows = [row for row in there if first_node(row) is not None][:NEAREST]
    if not rows or not _wanted_among(made, rows, run):
        other = [row for row in run(_relaxed(made)).rows if first_node(row) is not None][:NEAREST]
        # A TV that is off comes nearer to "is the TV on" than another thing that is on.
        rows = other if other and (not rows or other[0].fits) else rows
    if (whole := _all_that_is_said(made)) and not _wanted_among(made, rows, run):
        rows = list(run(best_of(like(ast.Text(value=parts.cut(whole))), NEAREST)).rows)
    if not rows:
        rows = list(run(_alone(made, limit=NEAREST)).rows)
    nodes = [node for row in rows if (node := first_node(row)) is not None]
    lacks: dict[Any, list[str]] = {(node.scene, node.id): [] for node in nodes}
    fitting = _wanted_among(made, rows, run) if made.wanted else set(lacks)
    for key, said in lacks.items():
        if key not in fitting:
            said.append("not that" if made.kind == "other language" else _is_not(made.wanted))
    unwanted: set[Any] = set()
    for condition in made.conditions:
        met = {identity(row) for row in run(_asking(made, condition.expression, nodes)).rows if row.fits}
        for key, said in lacks.items():
            if key not in met:
                said.append(condition.lacks)
                if made.asked.use and isinstance(condition.expression, ast.Not):
                    unwanted.add(key)
    if unwanted and fitting <= unwanted:
        # Who asks what to heat soup in but the microwave has no use for the microwave.
        rows = sorted(rows, key=lambda row: identity(row) in unwanted)
    elif fitting and made.wanted:
        # Where there are lamps, that something else is no lamp says nothing of where the lamp is.
        rows = [row for row in rows if identity(row) in fitting]
    told = {key: ", ".join(said) for key, said in lacks.items()}
    failing = tuple(_failing(row, told[identity(row)]) for row in rows if identity(row) in told)
    return NearMisses(rows=failing, lacks=told, wanted=frozenset(fitting))


def _all_that_is_said(made: Translation) -> str:
    """The text that what comes nearest is ordered by, where more is said than what was read and nothing is that."""
    if "$previous" in made.text:
        return ""
    if made.kind == "affordance" and made.question:
        return f"something{MARK}: {made.question}"
    return by_description(made.asked)


def _wanted_among(made: Translation, rows: Sequence[Row], run: Run) -> set[Any]:
    """Those of some rows that are what is wanted, whatever else is asked of it."""
    nodes = [node for row in rows if (node := first_node(row)) is not None]
    return {identity(row) for row in run(_alone(made, among=nodes)).rows if row.fits}


def missing(made: Translation, run: Run) -> tuple[str, ...]:
    """The things that the question speaks of and that are not there: "the piano" in "chairs next to the piano"."""
    return tuple(
        anchor for anchor in made.anchors if run(best_of(like(ast.Text(value=parts.cut(anchor))), 1)).nothing_fits
    )


def _failing(row: Row, lacks: str) -> Row:
    return Row(row.values, row.score, False, lambda: (*row.why, Reason(asked=lacks, degree=0.0)) if lacks else row.why)


# -- statements -------------------------------------------------------------------------------------------------


def _relaxed(made: Translation) -> ast.Query:
    """The statement without its conditions, what comes nearest to a measure first."""
    tree = made.query
    asked = {part for one in made.conditions for part in _parts(one.expression)}
    rest = tuple(part for part in _parts(tree.where) if part not in asked)
    measured = made.asked.measured
    order = tree.order
    columns = [item.name for item in tree.returns if item.name and item.name != "a"]
    if measured and not order and columns:
        order = (ast.OrderItem(expression=ast.Variable(name=columns[0]), descending=measured[0].op in (">", ">=")),)
    return replace(
        tree, where=parts.all_of(rest) if rest else None, order=order, skip=None, limit=ast.Number(value=NEAREST)
    )


def _alone(made: Translation, *, among: Sequence[StoredNode] | None = None, limit: int | None = None) -> ast.Query:
    """What is wanted, whatever else is asked."""
    tree = made.query
    subject = next((node for node in tree.patterns[0].nodes if node.variable == "o"), tree.patterns[0].nodes[0])
    return ast.Query(
        patterns=(ast.Pattern(nodes=(subject,)),),
        where=None if among is None else among_these("o", among),
        returns=(ast.ReturnItem(expression=ast.Variable(name=subject.variable or "o")),),
        limit=ast.Number(value=limit) if limit else None,
    )


def _asking(made: Translation, condition: ast.Expression, nodes: Sequence[StoredNode]) -> ast.Query:
    """Which of some things meet one condition."""
    bound = [part for part in _parts(made.query.where) if isinstance(part, ast.In)]
    return ast.Query(
        patterns=(ast.Pattern(nodes=(ast.NodePattern(variable="o"),)), *made.query.patterns[1:]),
        where=parts.all_of((among_these("o", nodes), condition, *bound)),
        distinct=True,
        returns=(ast.ReturnItem(expression=ast.Variable(name="o")),),
    )


def _parts(condition: ast.Expression | None) -> tuple[ast.Expression, ...]:
    return () if condition is None else condition.items if isinstance(condition, ast.And) else (condition,)


def _is_not(wanted: str) -> str:
    """What is wrong with a thing that is not what was wanted."""
    need = split(wanted)[1]
    return f'no help for "{need}"' if need else f"not {_with_article(wanted)}"


def _with_article(wanted: str) -> str:
    from cgdb.english.lookahead import only_traits

    if only_traits(wanted):
        return wanted
    first = wanted.split(" ", 1)[0].casefold()
    plural = wanted.endswith("s") and not wanted.endswith("ss")
    if plural or first in ("something", "somewhere", "anything", "a", "an", "the", "two", "three", "some"):
        return wanted
    vowel = first.startswith(("hour", "honest", "heir")) or (first[:1] in "aeiou" and not first.startswith(_AS_YOU))
    return f"{'an' if vowel else 'a'} {wanted}"
