"""Sizes, distances and orders in a question: "larger than 1 m", "within 2 m of the door", "the nearest chair"."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from cgdb.english import cues
from cgdb.english.intent import First, Measured
from cgdb.english.phrases import Word, stretch

Things = Callable[[int], tuple[tuple[str, ...], int]]
"""What the words from here on name, and where they end."""

_OR_MORE = {
    "more": ">=", "larger": ">=", "bigger": ">=", "higher": ">=", "taller": ">=", "longer": ">=",
    "less": "<=", "smaller": "<=", "shorter": "<=", "lower": "<=", "fewer": "<=",
}  # fmt: skip


def measured(text: str, found: Sequence[Word], begin: int, things: Things) -> tuple[Measured, int] | None:
    """The size or distance that is said at word ``begin``, and where it ends."""
    hit = cues.comparatives().at(found, begin)
    skip, (what, op) = hit if hit is not None else (0, ("", "="))
    number = length(found, begin + skip)
    if number is None:
        return _than(text, found, begin, skip, what, op, things) if hit is not None and what else None
    used, value, unit = number
    j = begin + skip + used
    if _form(found, j) == "or" and _form(found, j + 1) in _OR_MORE:
        op, j = _OR_MORE[_form(found, j + 1)], j + 2
    if _form(found, j) in ("in", "of") and _form(found, j + 1) in cues.DIMENSIONS:
        j += 1
    if _form(found, j) in cues.DIMENSIONS:
        what, j = cues.DIMENSIONS[_form(found, j)], j + 1
    elif not what:
        return _distance(text, found, (begin, j), op, (value, unit), things)
    made = Measured(what=what, op=op, number=value, unit=unit, text=stretch(text, found[begin:j]))
    return made, j


def length(found: Sequence[Word], i: int) -> tuple[int, float, str] | None:
    """(words, number, unit) of a length at word i: "1.5 m", "30cm", "half a metre"."""
    form = _form(found, i)
    digits = form.rstrip("abcdefghijklmnopqrstuvwxyz")
    unit = cues.UNITS.get(form[len(digits) :])
    try:
        value = float(digits.replace(",", ".")) if digits else cues.NUMBERS.get(form)
    except ValueError:
        return None
    if value is None or not 0 <= value < 1e9:
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
        op="<=" if op == "=" else op,
        number=number[0],
        unit=number[1],
        than=names[0],
        text=stretch(text, found[begin:end]),
    )
    return made, end


def _than(
    text: str, found: Sequence[Word], begin: int, skip: int, what: str, op: str, things: Things
) -> tuple[Measured, int] | None:
    """ "Larger than the table"."""
    if found[begin + skip - 1].form != "than":
        return None
    names, end = things(begin + skip)
    if not names:
        return None
    return Measured(what=what, op=op, than=names[0], text=stretch(text, found[begin:end])), end


def first(text: str, found: Sequence[Word], begin: int, things: Things) -> tuple[First, int, tuple[int, int]] | None:
    """The order that is asked for at word ``begin``, where it ends, and the words of its anchor farther on.

    "The nearest chair to the door" names its anchor behind the chair; these words are to be left out then.
    """
    rank, i = 1, begin
    if _form(found, i) in cues.STARTERS:
        i += 1
    if _form(found, i) in cues.ORDINALS:
        rank, i = cues.ORDINALS[_form(found, i)], i + 1
    hit = cues.superlatives().at(found, i)
    if hit is None:
        return None
    (by, descending), j = hit[1], i + hit[0]
    said, to, away = stretch(text, found[i:j]), None, (0, 0)
    if by == "distance":
        if _form(found, j) in ("to", "from") or _form(found, j) in cues.STARTERS:
            names, end = things(j + 1 if _form(found, j) in ("to", "from") else j)
            to, j = next(iter(names), None), end
        else:
            at = next((k for k in range(j, len(found)) if _form(found, k) in ("to", "from")), None)
            if at is not None:
                names, end = things(at + 1)
                to, away = next(iter(names), None), (at, end)
        said = f"{said} to {to}" if to and not descending else f"{said} from {to}" if to else said
    return First(by=by, descending=descending, to=to, rank=rank, text=said), j, away


def _form(found: Sequence[Word], i: int) -> str:
    return found[i].form if i < len(found) else ""
