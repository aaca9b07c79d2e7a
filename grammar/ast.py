"""The tree of a CGQL statement: frozen records, each with the span of the text that it came from.

Spans do not take part in comparison, so that ``parse(print(tree)) == tree`` can be said of meanings.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from enum import StrEnum
from typing import TypeAlias

from cgdb.errors import Span

NOWHERE = Span(0, 0)


class Mode(StrEnum):
    """What is wanted of a statement: its rows, its plan, or its plan with what really happened."""

    RUN = "RUN"
    EXPLAIN = "EXPLAIN"
    PROFILE = "PROFILE"


class Direction(StrEnum):
    """Which way an edge pattern is read: ``-[]->``, ``<-[]-`` or ``-[]-``."""

    OUT = "->"
    IN = "<-"
    ANY = "-"


@dataclass(frozen=True, slots=True, kw_only=True)
class Syntax:
    """A node of the tree, with its place in the text."""

    span: Span = field(default=NOWHERE, compare=False, repr=False)


# -- values -----------------------------------------------------------------------------------------------------


@dataclass(frozen=True, slots=True, kw_only=True)
class Text(Syntax):
    """``'text'`` or ``"text"``."""

    value: str


@dataclass(frozen=True, slots=True, kw_only=True)
class Number(Syntax):
    """``12``, ``0.5`` or ``150 cm``. value is as written; unit is None or a name of units.UNITS."""

    value: int | float
    unit: str | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class Boolean(Syntax):
    """``true`` or ``false``."""

    value: bool


@dataclass(frozen=True, slots=True, kw_only=True)
class Null(Syntax):
    """``null``."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Parameter(Syntax):
    """``$name``."""

    name: str


@dataclass(frozen=True, slots=True, kw_only=True)
class ObjectRef(Syntax):
    """``#12`` or ``#"chair-3"``: the object or place with that id."""

    id: int | str


@dataclass(frozen=True, slots=True, kw_only=True)
class ListOf(Syntax):
    """``[a, b]``."""

    items: tuple[Expression, ...]


@dataclass(frozen=True, slots=True, kw_only=True)
class Variable(Syntax):
    """A name that a pattern, or AS in RETURN, gave."""

    name: str


@dataclass(frozen=True, slots=True, kw_only=True)
class Property(Syntax):
    """``variable.name``."""

    variable: str
    name: str


@dataclass(frozen=True, slots=True, kw_only=True)
class Call(Syntax):
    """``name(argument, ...)``; name in lower case. ``count(*)`` has star set and no arguments."""

    name: str
    arguments: tuple[Expression, ...] = ()
    distinct: bool = False
    star: bool = False


@dataclass(frozen=True, slots=True, kw_only=True)
class Arithmetic(Syntax):
    """``left op right`` with op one of ``+ - * / %``."""

    op: str
    left: Expression
    right: Expression


@dataclass(frozen=True, slots=True, kw_only=True)
class Negative(Syntax):
    """``-operand``. The parser folds a minus before a number into the number."""

    operand: Expression


# -- conditions -------------------------------------------------------------------------------------------------


@dataclass(frozen=True, slots=True, kw_only=True)
class And(Syntax):
    """All of two or more; never directly inside another And."""

    items: tuple[Expression, ...]


@dataclass(frozen=True, slots=True, kw_only=True)
class Or(Syntax):
    """At least one of two or more; never directly inside another Or."""

    items: tuple[Expression, ...]


@dataclass(frozen=True, slots=True, kw_only=True)
class Not(Syntax):
    """``NOT item``."""

    item: Expression


@dataclass(frozen=True, slots=True, kw_only=True)
class Comparison(Syntax):
    """``left op right`` with op one of ``= <> < <= > >=``."""

    op: str
    left: Expression
    right: Expression


@dataclass(frozen=True, slots=True, kw_only=True)
class In(Syntax):
    """``item IN collection``."""

    item: Expression
    collection: Expression


@dataclass(frozen=True, slots=True, kw_only=True)
class Contains(Syntax):
    """``text CONTAINS part``; of a list: has that member. Case-insensitive."""

    text: Expression
    part: Expression


@dataclass(frozen=True, slots=True, kw_only=True)
class StartsWith(Syntax):
    """``text STARTS WITH prefix``. Case-insensitive."""

    text: Expression
    prefix: Expression


@dataclass(frozen=True, slots=True, kw_only=True)
class IsNull(Syntax):
    """``item IS NULL``, or with negated set ``item IS NOT NULL``."""

    item: Expression
    negated: bool = False


Meaning: TypeAlias = Text | Parameter | ObjectRef
"""What stands to the right of ``~``: a text, a parameter (text or vector), or an object to be like."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Similar(Syntax):
    """``variable ~ meaning``."""

    variable: str
    meaning: Meaning


@dataclass(frozen=True, slots=True, kw_only=True)
class PatternCondition(Syntax):
    """A pattern used as a condition: there is such a neighbour. Has at least one edge."""

    pattern: Pattern


# -- patterns ---------------------------------------------------------------------------------------------------


@dataclass(frozen=True, slots=True, kw_only=True)
class NodePattern(Syntax):
    """``(variable:Label {property: value} ~ meaning)`` or ``(#12)``; every part may be missing."""

    variable: str | None = None
    label: str | None = None
    id: ObjectRef | None = None
    properties: tuple[tuple[str, Expression], ...] = ()
    meaning: Meaning | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class EdgePattern(Syntax):
    """``-[variable:label|label*min..max ~ meaning]->``. max_hops None: no upper bound was written."""

    variable: str | None = None
    labels: tuple[str, ...] = ()
    meaning: Meaning | None = None
    min_hops: int = 1
    max_hops: int | None = 1
    direction: Direction = Direction.OUT


@dataclass(frozen=True, slots=True, kw_only=True)
class Pattern(Syntax):
    """A chain: ``nodes[0] edges[0] nodes[1] edges[1] ...``; one node more than edges."""

    nodes: tuple[NodePattern, ...]
    edges: tuple[EdgePattern, ...] = ()


# -- the statement ----------------------------------------------------------------------------------------------


@dataclass(frozen=True, slots=True, kw_only=True)
class ReturnItem(Syntax):
    """``expression [AS name]``."""

    expression: Expression
    name: str | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class OrderItem(Syntax):
    """``expression [ASC|DESC]``."""

    expression: Expression
    descending: bool = False


@dataclass(frozen=True, slots=True, kw_only=True)
class Rerank(Syntax):
    """``RERANK BY question [TOP n]``."""

    question: Text | Parameter
    top: Number | Parameter | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class Query(Syntax):
    """A whole statement. scenes empty: every scene of the store. distinct: RETURN DISTINCT."""

    mode: Mode = Mode.RUN
    scenes: tuple[Text | Parameter, ...] = ()
    as_of: Number | Text | Parameter | None = None
    patterns: tuple[Pattern, ...]
    where: Expression | None = None
    distinct: bool = False
    returns: tuple[ReturnItem, ...]
    order: tuple[OrderItem, ...] = ()
    rerank: Rerank | None = None
    skip: Number | Parameter | None = None
    limit: Number | Parameter | None = None


Value: TypeAlias = Text | Number | Boolean | Null | Parameter | ObjectRef | ListOf
Condition: TypeAlias = And | Or | Not | Comparison | In | Contains | StartsWith | IsNull | Similar | PatternCondition
Expression: TypeAlias = Value | Variable | Property | Call | Arithmetic | Negative | Condition

UNITS: dict[str, float] = {"mm": 0.001, "cm": 0.01, "dm": 0.1, "m": 1.0, "km": 1000.0, "in": 0.0254, "ft": 0.3048}
"""Metres in one of each unit that a number may carry. A number without a unit is in metres where that matters."""
