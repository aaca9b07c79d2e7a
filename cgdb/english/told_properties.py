"""Questions that a property of the map answers as it stands: what a robot can drive over, and what belongs where."""

from __future__ import annotations

import re
from dataclasses import dataclass, replace

from cgdb.english import tree_parts as parts
from cgdb.english.intent import Asked, Located
from cgdb.english.tree_parts import SUBJECT
from cgdb.grammar import ast
from cgdb.index.catalog import Catalog

TRAVERSABLE, PLACES = "traversable", "typical_places"

_WHO = r"(?:(?:the|a|an|my|our|this|that) (?:[\w-]+ )?)?(?:robot|rover|vacuum(?: cleaner)?|it)"
_GO = r"(?:drive|driven|drives|roll|rolled|step|stepped|walk|walked|go|get|move|pass|push|pushed|climb|ride|travel|fit)"
_OVER = r"(?:over|across|through|past)"
_MAY = r"(?:(?:to|can|could|may|might|would|will|is able to|be able to) )*"
_HEAD = r"(?:(?:something|anything|somewhere|things?|objects?|items?|what|that|which) )*"

_PASSED = re.compile(
    rf"(?:^|(?<=\s)){_HEAD}(?:{_MAY}{_WHO} {_MAY}{_GO} {_OVER}|to (?:drive|roll|ride) {_OVER}"
    rf"|{_MAY}be (?:driven|rolled|stepped|pushed|ridden) {_OVER}|(?:is |are )?traversable)$",
    re.IGNORECASE,
)
_ADJECTIVE = re.compile(r"^(?:is |are )?traversable (?:things?$|objects?$|items?$)?", re.IGNORECASE)
_PASSES = re.compile(rf"^{_MAY}{_WHO} {_MAY}{_GO}$", re.IGNORECASE)
_DENIED = re.compile(rf"^(?:{_WHO} )?(?:be )?(?:{_GO} {_OVER}|traversable)$", re.IGNORECASE)
_SUBJECTLESS = re.compile(rf"(?:^|\s+){_HEAD}(?:to )?{_WHO}$", re.IGNORECASE)
_BLOCKS = re.compile(
    rf"^(?:{_HEAD}(?:to |would |could |can )?(?:block|obstruct|hinder|stop)(?:s|ing|ping)? "
    rf"(?:{_WHO}|(?:the|its) (?:way|path)(?: of {_WHO})?)|(?:an? )?obstacles?(?: (?:for|to|of) {_WHO})?)$",
    re.IGNORECASE,
)
_WAY = re.compile(rf"^(?:(?:the|its|{_WHO}'s) )*(?:way|path)(?: of {_WHO})?$", re.IGNORECASE)
_BELONGS = re.compile(
    r"^(?:(?:things?|objects?|items?|something|that|which|is|are|usually|normally|typically|mostly|often) )*"
    r"(?:belongs?|goes|go|usually|normally|typically|kept|stored|found)"
    r"(?: (?:usually|normally|typically|kept|stored|found|in|into|to))*$",
    re.IGNORECASE,
)


@dataclass(frozen=True, slots=True, kw_only=True)
class Told:
    """A condition on a property, how it is said to be understood, and how of a thing that does not meet it."""

    expression: ast.Expression
    says: str
    lacks: str


def told(asked: Asked, catalog: Catalog) -> tuple[Asked, tuple[Told, ...]]:
    """What is asked beside that, and the conditions on properties that the map has."""
    found: list[Told] = []
    if catalog.properties.get(TRAVERSABLE) == "boolean":
        asked, passable = _traversed(asked)
        if passable is not None:
            says = "traversable" if passable else "not traversable"
            held = ast.Property(variable=SUBJECT, name=TRAVERSABLE)
            expression = ast.Comparison(op="=", left=held, right=ast.Boolean(value=passable))
            lacks = f"{'not ' if passable else ''}traversable, or the map does not say"
            found.append(Told(expression=expression, says=f"by the map's own property: {says}", lacks=lacks))
    if catalog.properties.get(PLACES) == "list" and _BELONGS.match(asked.wanted) is not None:
        inside = [one for one in asked.located if one.name == "in" and not one.negated]
        names = [*asked.places, *(anchor for one in inside for anchor in one.anchors)]
        if names:
            held = ast.Property(variable=SUBJECT, name=PLACES)
            either = parts.any_of([ast.Contains(text=held, part=ast.Text(value=name.casefold())) for name in names])
            where = " or ".join(names)
            found.append(
                Told(expression=either, says=f"by the map's own typical places: {where}", lacks=f"not for the {where}")
            )
            left = tuple(one for one in asked.located if one not in inside)
            asked = replace(asked, wanted="", places=(), located=left)
    return asked, tuple(found)


def _traversed(asked: Asked) -> tuple[Asked, bool | None]:
    """What is asked beside driving over things; whether that shall be possible; None where it is not asked."""
    denied = [text for text in asked.excluded if _DENIED.match(text)]
    if denied:
        left = tuple(text for text in asked.excluded if text not in denied)
        return replace(asked, wanted=_kind(_SUBJECTLESS.sub("", asked.wanted)), excluded=left, use=False), False
    way = next((one for one in asked.located if _is_way(one)), None)
    if way is not None:
        left_over = tuple(one for one in asked.located if one is not way)
        return replace(asked, located=left_over), way.negated
    over = next((one for one in asked.located if re.match(rf"{_OVER}\b", one.text) and len(one.anchors) == 1), None)
    if over is not None and _PASSES.match(asked.wanted):
        left_over = tuple(one for one in asked.located if one is not over)
        return replace(asked, wanted=over.anchors[0], located=left_over, polar=True, use=False), True
    if _BLOCKS.match(asked.wanted):
        return replace(asked, wanted="", use=False), False
    match = _PASSED.search(asked.wanted) or _ADJECTIVE.match(asked.wanted)
    if match is None:
        return asked, None
    rest = f"{asked.wanted[: match.start()]} {asked.wanted[match.end() :]}"
    return replace(asked, wanted=_kind(rest), use=False), True


def _kind(text: str) -> str:
    """What is left of a question for a use once the use is taken out."""
    return re.sub(r"^something (?:to|for)\b", "", text.strip(), flags=re.IGNORECASE).strip()


def _is_way(located: Located) -> bool:
    return located.name == "in" and len(located.anchors) == 1 and _WAY.match(located.anchors[0]) is not None
