"""What a question asks, as records: what comes between understanding a question and writing it as CGQL."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from cgdb.english.phrases import Word

Form = Literal[
    "find",
    "exists",
    "count",
    "where",
    "room",
    "per room",
    "per scene",
    "scene",
    "compare",
    "measure",
    "distance",
    "trait",
    "average",
    "all",
]
"""What is wanted to know: things, whether there is one, how many, where, in which room, how many in each room or scene,
in which scene, of which of two kinds there are more, how large, how far, what colour and the like.
"""


@dataclass(frozen=True, slots=True, kw_only=True)
class Located:
    """A relation to other things. name: one of the relations of cues; anchors: what they mean, all of them asked.

    inverse: the anchor is the subject ("with a lamp on it"). chained: said of the thing before, or of its anchor ("on
    the table by the window"). text: as it was written. An empty anchor stands for another thing of the wanted kind.
    the_one: a denied one of which there is one ("not the one on the desk"). guessed: somebody only thinks so ("I think
    it is on the desk"), so it may be left out.
    """

    name: str
    anchors: tuple[str, ...]
    text: str
    inverse: bool = False
    negated: bool = False
    chained: bool = False
    the_one: bool = False
    guessed: bool = False


@dataclass(frozen=True, slots=True, kw_only=True)
class Measured:
    """A size or distance: what, how, and a length or a thing.

    what: "size", "height", "width", "depth", "distance", "level" (height above the floor), "weight", or "" for what
    nothing measures ("prettier than"). op: one of CGQL, or "~" for about as much.
    """

    what: str
    op: str
    number: float | None = None
    unit: str | None = None
    than: str | None = None
    text: str = ""


@dataclass(frozen=True, slots=True, kw_only=True)
class First:
    """The first of an order: by a function ("z" for height above ground), of a thing where it is a distance.

    count: how many were asked for ("the three largest"), 0 where no number was said.
    """

    by: str
    descending: bool
    to: str | None = None
    rank: int = 1
    count: int = 0
    single: bool = True
    text: str = ""


@dataclass(frozen=True, slots=True, kw_only=True)
class Head:
    """The head of a question that asks for a value: what is asked (form, what), the words of the thing that it is asked
    of, and of what that is compared with. first: of an order that the head asks for; whole: the subject is one text.
    """

    form: Form
    what: str
    subject: tuple[Word, ...]
    against: tuple[Word, ...] = ()
    first: First | None = None
    whole: bool = False


@dataclass(frozen=True, slots=True, kw_only=True)
class Asked:
    """What a question asks. wanted: empty where anything will do. use: it is asked what something serves for.

    state: "open", "off" and the like; with_state: what is wanted with its state in words, for maps that hold none.
    what: what is asked of it: a measure, a trait, or "more", "fewer", "as many". against: what it is compared with, or
    measured from. polar: the question wants a yes or a no.
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
    what: str = ""
    against: str = ""
    polar: bool = False
    notes: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True, kw_only=True)
class Setting:
    """What of a store decides how a question is written, beside the names in its catalog.

    places: names of its rooms. frames: {scene: (up axis, level of the floor in m, None where not known)}; of several
    scenes that differ, each is asked in its own. tells: captions say where things are, not only boxes and relations.
    previous: $previous holds the ids of what was found before, which "it" and "them" mean. words: what the store calls
    its things, one word each, which slips of the pen are read as. tags: the names of its things, whole.
    """

    places: tuple[str, ...] = ()
    frames: tuple[tuple[str, str, float | None], ...] = (("", "z", None),)
    tells: bool = True
    previous: bool = False
    words: frozenset[str] = frozenset()
    tags: frozenset[str] = frozenset()

    @property
    def up(self) -> str:
        """The up axis of the first scene."""
        return self.frames[0][1] if self.frames else "z"
