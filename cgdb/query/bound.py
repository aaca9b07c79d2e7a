"""What the binder gives: a statement whose every name is known to exist, as records that the planner reads."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

from cgdb.errors import Span
from cgdb.grammar import ast
from cgdb.meaning.meanings import Meaning
from cgdb.scene import ObjectId


@dataclass(frozen=True, slots=True, kw_only=True)
class BoundNode:
    """A variable that stands for objects or places. label None: any (a node given by its id)."""

    name: str
    named: bool
    label: str | None = "Object"
    id: ObjectId | None = None
    span: Span = field(default=ast.NOWHERE, compare=False, repr=False)


@dataclass(frozen=True, slots=True, kw_only=True)
class BoundEdge:
    """One edge of a pattern. directed False: either way. labels empty: any relation."""

    name: str
    named: bool
    source: str
    target: str
    labels: tuple[str, ...] = ()
    meaning: Meaning | None = None
    directed: bool = True
    min_hops: int = 1
    max_hops: int = 1

    @property
    def is_path(self) -> bool:
        """Whether it may take any number of hops other than one."""
        return (self.min_hops, self.max_hops) != (1, 1)


@dataclass(frozen=True, slots=True, kw_only=True)
class BoundMatch:
    """Patterns that are matched together: nodes by name, edges, and the conditions written inside the patterns."""

    nodes: Mapping[str, BoundNode]
    edges: tuple[BoundEdge, ...]
    conditions: tuple[ast.Expression, ...] = ()


@dataclass(frozen=True, slots=True, kw_only=True)
class BoundReturn:
    """A column of the result."""

    name: str
    expression: ast.Expression


@dataclass(frozen=True, slots=True, kw_only=True)
class BoundQuery:
    """A statement whose every name is known to exist.

    meanings: what each Similar and edge ``~`` compares with. subpatterns: the matches of pattern conditions, by the
    condition. conditions: all that a row is asked, in the order written (pattern conditions first, then WHERE).
    given: the parameter that a value at this place of the text was given by.
    """

    mode: ast.Mode
    match: BoundMatch
    conditions: tuple[ast.Expression, ...]
    meanings: Mapping[ast.Meaning, Meaning]
    subpatterns: Mapping[ast.Pattern, BoundMatch]
    returns: tuple[BoundReturn, ...]
    distinct: bool
    aggregates: bool
    order: tuple[ast.OrderItem, ...]
    rerank: tuple[str, int] | None
    skip: int
    limit: int | None
    given: Mapping[Span, str] = field(default_factory=dict)
    warnings: tuple[str, ...] = ()
