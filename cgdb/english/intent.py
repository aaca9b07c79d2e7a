"""What a question asks, as records: what comes between understanding a question and writing it as CGQL."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

Form = Literal["find", "exists", "count", "where", "room", "per room"]
"""What is wanted to know: things, whether there is one, how many, where, in which room, how many in each room."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Located:
    """A relation to other things. name: one of the relations of cues; anchors: what they mean, all of them asked.

    inverse: the anchor is the subject ("with a lamp on it"). chained: said of the thing before, or of its anchor ("on
    the table by the window"). text: as it was written. An empty anchor stands for another thing of the wanted kind.
    """

    name: str
    anchors: tuple[str, ...]
    text: str
    inverse: bool = False
    negated: bool = False
    chained: bool = False


@dataclass(frozen=True, slots=True, kw_only=True)
class Measured:
    """A size or distance: what ("size", "height", "width", "depth", "distance"), how, and a length or a thing."""

    what: str
    op: str
    number: float | None = None
    unit: str | None = None
    than: str | None = None
    text: str = ""


@dataclass(frozen=True, slots=True, kw_only=True)
class First:
    """The first of an order: by a function ("z" for height above ground), of a thing where it is a distance."""

    by: str
    descending: bool
    to: str | None = None
    rank: int = 1
    single: bool = True
    text: str = ""


@dataclass(frozen=True, slots=True, kw_only=True)
class Asked:
    """What a question asks. wanted: empty where anything will do. use: it is asked what something serves for.

    state: "open", "off" and the like; with_state: what is wanted with its state in words, for maps that hold none.
    """

    form: Form = "find"
    wanted: str = ""
    use: bool = False
    excluded: tuple[str, ...] = ()
    located: tuple[Located, ...] = ()
    places: tuple[str, ...] = ()
    not_places: tuple[str, ...] = ()
    measured: tuple[Measured, ...] = ()
    first: First | None = None
    state: str | None = None
    with_state: str = ""
    notes: tuple[str, ...] = ()
