"""Sizes, distances and orders in a question: "larger than 1 m", "within 2 m of the door", "the two nearest chairs"."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import lru_cache

from cgdb.english import cues
from cgdb.english.intent import First, Measured
from cgdb.english.phrases import Phrases, Word, listed, stretch

Things = Callable[[int], tuple[tuple[str, ...], int]]
"""What the words from here on name, and where they end."""

_OR_MORE = {
    "more": ">=", "larger": ">=", "bigger": ">=", "higher": ">=", "taller": ">=", "longer": ">=", "wider": ">=",
    "less": "<=", "smaller": "<=", "shorter": "<=", "lower": "<=", "fewer": "<=", "narrower": "<=",
}  # fmt: skip
_ABOVE_FLOOR = "above|over|off|from the? floor|ground"
_WEIGHTS = {">": "heavier than, weighs|weighing more than", "<": "lighter than, weighs|weighing less than"}
_EQUATIVES: dict[tuple[str, str], str] = {
    ("size", "~"): "as big|large as, the same size as, of the same size as, the size of, equal in size to",
    ("height", "~"): "as tall|high as, the same height as, of the same height as",
    ("width", "~"): "as wide|long|broad as, the same width|length as, of the same width|length as",
    ("depth", "~"): "as deep|thick as, the same depth|thickness as",
    ("size", ">="): "at least as big|large as",
    ("height", ">="): "at least as tall|high as",
    ("width", ">="): "at least as wide|long|broad as",
    ("size", "<"): "not as big|large as",
    ("height", "<"): "not as tall|high as",
    ("width", "<"): "not as wide|long|broad as",
}
_HEAVIEST = {True: "heaviest", False: "lightest"}
_NO_COMPARATIVE = listed("other rather further farther closer later sooner either neither another never under over")
_FORMS = listed("three four five six seven eight nine ten two")


def measured(text: str, found: Sequence[Word], begin: int, things: Things) -> tuple[tuple[Measured, ...], int] | None:
    """The sizes and distances that are said at word ``begin``, and where that ends. "Between 1 and 2 m" is two."""
    alike = _equal(text, found, begin, things)
    if alike is not None:
        return (alike[0],), alike[1]
    range_ = _range(text, found, begin, things)
    if range_ is not None:
        return range_
    hit = cues.comparatives().at(found, begin)
    skip, (what, op) = hit if hit is not None else (0, ("", "~"))
    number = length(found, begin + skip)
    if number is None:
        one = _than(text, found, begin, skip, what, op, things) if hit is not None and what else None
        one = one or _unmeasured(text, found, begin, things)
        return None if one is None else ((one[0],), one[1])
    used, value, unit = number
    j = begin + skip + used
    if _form(found, j) == "or" and _form(found, j + 1) in _OR_MORE:
        op, j = _OR_MORE[_form(found, j + 1)], j + 2
    op = "~" if op == "=" else op
    what, j, told = _dimension(found, j, what)
    if not told:
        away = _distance(text, found, (begin, j), op, (value, unit), things)
        if away is not None:
            return (away[0],), away[1]
        if hit is None:
            return None
        what = "size"  # "boxes over 50 cm"
    made = Measured(what=what, op=op, number=value, unit=unit, text=stretch(text, found[begin:j]))
    return (made,), j


def length(found: Sequence[Word], i: int) -> tuple[int, float, str] | None:
    """(words, number, unit) of a length at word i: "1.5 m", "30cm", "half a metre"."""
    form = _form(found, i)
    digits = form.rstrip("abcdefghijklmnopqrstuvwxyz")
    unit = cues.UNITS.get(form[len(digits) :])
    value = _number(form, digits)
    if value is None:
        return None
    if digits and unit:
        return 1, value, unit
    j = i + 1
    if form == "half" and _form(found, j) in ("a", "an"):
        j += 1
    unit = cues.UNITS.get(_form(found, j)) if digits in ("", form) else None
    # "Two in the kitchen" is no length.
    if unit is None or (_form(found, j) == "in" and _form(found, j + 1) in cues.STARTERS):
        return None
    return j + 1 - i, value, unit


def _number(form: str, digits: str) -> float | None:
    try:
        value = float(digits.replace(",", ".")) if digits else cues.NUMBERS.get(form)
    except ValueError:
        return None
    return value if value is not None and 0 <= value < 1e9 else None


def _dimension(found: Sequence[Word], j: int, what: str) -> tuple[str, int, bool]:
    """(what is measured, where that ends, whether it is said) behind a length: "wide", "in height", "off the floor"."""
    if _form(found, j) in ("in", "of") and _form(found, j + 1) in cues.DIMENSIONS:
        j += 1
    told = bool(what)
    if _form(found, j) in cues.DIMENSIONS:
        what, j, told = cues.DIMENSIONS[_form(found, j)], j + 1, True
    level = _floor().at(found, j)
    if level is not None and what in ("", "height"):
        what, j, told = "level", j + level[0], True
    return what, j, told


def _range(text: str, found: Sequence[Word], begin: int, things: Things) -> tuple[tuple[Measured, ...], int] | None:
    """ "Between 1 and 2 metres wide", "from 30 to 50 cm high"."""
    joins = {"between": ("and",), "from": ("to",)}.get(_form(found, begin))
    if joins is None:
        return None
    first_form = _form(found, begin + 1)
    low = length(found, begin + 1)
    if low is None:
        digits = first_form.rstrip("abcdefghijklmnopqrstuvwxyz")
        value = _number(first_form, digits)
        if value is None or (digits and digits != first_form):
            return None
        low = (1, value, "")
    j = begin + 1 + low[0]
    high = length(found, j + 1) if _form(found, j) in joins else None
    if high is None:
        return None
    j += 1 + high[0]
    what, j, _ = _dimension(found, j, "")
    than = None
    if what == "" and _form(found, j) in ("from", "of", "to", "away"):
        away = _distance(text, found, (begin, j), "<=", (high[1], high[2]), things)
        if away is not None:
            what, than, j = "distance", away[0].than, away[1]
    said = stretch(text, found[begin:j])
    least = Measured(what=what or "size", op=">=", number=low[1], unit=low[2] or high[2], than=than, text=said)
    most = Measured(what=what or "size", op="<=", number=high[1], unit=high[2], than=than, text=said)
    return (least, most), j


def _distance(
    text: str, found: Sequence[Word], span: tuple[int, int], op: str, number: tuple[float, str], things: Things
) -> tuple[Measured, int] | None:
    begin, j = span
    while _form(found, j) in ("away", "distance"):
        j += 1
    if _form(found, j) not in ("from", "of", "to"):
        return None
    names, end = things(j + 1)
    if not names:
        return None
    made = Measured(
        what="distance",
        op="<=" if op == "~" else op,
        number=number[0],
        unit=number[1],
        than=names[0],
        text=stretch(text, found[begin:end]),
    )
    return made, end


def _than(
    text: str, found: Sequence[Word], begin: int, skip: int, what: str, op: str, things: Things
) -> tuple[Measured, int] | None:
    """ "Larger than the table", "closer to the door than the lamp" aside."""
    if found[begin + skip - 1].form != "than":
        return None
    names, end = things(begin + skip)
    if not names:
        return None
    return Measured(what=what, op=op, than=names[0], text=stretch(text, found[begin:end])), end


def _equal(text: str, found: Sequence[Word], begin: int, things: Things) -> tuple[Measured, int] | None:
    """ "As tall as the lamp"."""
    hit = _equatives().at(found, begin)
    if hit is None:
        return None
    names, end = things(begin + hit[0])
    if not names or length(found, begin + hit[0]) is not None:
        return None
    what, op = hit[1]
    return Measured(what=what, op=op, than=names[0], text=stretch(text, found[begin:end])), end


def _unmeasured(text: str, found: Sequence[Word], begin: int, things: Things) -> tuple[Measured, int] | None:
    """ "Heavier than the chair", and what nothing here measures: "older than", "more expensive than"."""
    hit = _weights().at(found, begin)
    form = _form(found, begin)
    if hit is not None:
        skip, what, op = hit[0], "weight", hit[1]
    elif form.endswith("er") and len(form) > 4 and form not in _NO_COMPARATIVE and _form(found, begin + 1) == "than":
        skip, what, op = 2, "", ">"
    elif form in ("more", "less") and _form(found, begin + 2) == "than" and not _form(found, begin + 1).endswith("s"):
        skip, what, op = 3, "", ">" if form == "more" else "<"
    else:
        return None
    names, end = things(begin + skip)
    said = stretch(text, found[begin : max(end, begin + skip)])
    return Measured(what=what, op=op, than=names[0] if names else None, text=said), max(end, begin + skip)


def first(text: str, found: Sequence[Word], begin: int, things: Things) -> tuple[First, int, tuple[int, int]] | None:
    """The order that is asked for at word ``begin``, where it ends, and the words of its anchor farther on.

    "The nearest chair to the door" names its anchor behind the chair; these words are to be left out then.
    """
    rank, count, i = 1, 0, begin
    if _form(found, i) in cues.STARTERS:
        i += 1
    if _form(found, i) == "top" and counted(_form(found, i + 1)):
        i += 1
    if _form(found, i) in cues.ORDINALS:
        rank, i = cues.ORDINALS[_form(found, i)], i + 1
    elif counted(_form(found, i)):
        count, i = counted(_form(found, i)), i + 1
    hit: tuple[int, tuple[str, bool]] | None = cues.superlatives().at(found, i)
    heavy = _heaviest().at(found, i)
    if hit is None and heavy is not None:
        hit = (heavy[0], ("weight", heavy[1]))
    if hit is None:
        return None
    (by, descending), j = hit[1], i + hit[0]
    if not count and counted(_form(found, j)):
        count, j = counted(_form(found, j)), j + 1  # "the nearest two chairs"
    said, to, away = stretch(text, found[i : i + hit[0]]), None, (0, 0)
    if by == "distance":
        if _form(found, j) in ("to", "from") or _form(found, j) in cues.STARTERS:
            names, end = things(j + 1 if _form(found, j) in ("to", "from") else j)
            to, j = next(iter(names), None), end
        else:
            at = next((k for k in range(j, len(found)) if _form(found, k) in ("to", "from")), None)
            if at is not None:
                names, end = things(at + 1)
                to, away = next(iter(names), None), (at, end)
        said = said.removesuffix(" to").removesuffix(" from")
        said = f"{said} to {to}" if to and not descending else f"{said} from {to}" if to else said
    return First(by=by, descending=descending, to=to, rank=rank, count=count, text=said), j, away


def counted(form: str) -> int:
    """How many a word says, 0 where it says none."""
    if form.isdigit() and 0 < len(form) < 4:
        return int(form)
    return int(cues.NUMBERS[form]) if form in _FORMS else 0


def _form(found: Sequence[Word], i: int) -> str:
    return found[i].form if i < len(found) else ""


@lru_cache(maxsize=1)
def _floor() -> Phrases[bool]:
    return Phrases({True: _ABOVE_FLOOR})


@lru_cache(maxsize=1)
def _weights() -> Phrases[str]:
    return Phrases(_WEIGHTS)


@lru_cache(maxsize=1)
def _equatives() -> Phrases[tuple[str, str]]:
    return Phrases(_EQUATIVES)


@lru_cache(maxsize=1)
def _heaviest() -> Phrases[bool]:
    return Phrases(_HEAVIEST)
