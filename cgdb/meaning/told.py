"""What the properties of a thing tell: what it is like, what it is for, where it belongs; by its map or by a model.

A caption says "a dumbbell", and common knowledge that dumbbells are heavy; a map that says ``weight_class: light``
knows better. What a model noted (`cgdb enrich`) is believed a little less than what the map says itself.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Iterator, Mapping
from enum import IntEnum
from functools import lru_cache
from typing import NamedTuple

from cgdb.meaning import everyday
from cgdb.meaning.knowledge import knowledge
from cgdb.meaning.words import stemmed

MOST_PROPERTIES = 32
"""Properties of one object that are read; the rest would be data, not description."""
MOST_ITEMS = 16
"""Values of a list that tells of one quality or of uses."""
LONGEST = 100
"""Characters of a quality, use or place; what is longer is a text like any other."""

FLEXIBLE = 63
"""The bit of what bends and springs back, for which the table has no trait of its own."""

ONE_HAND, ONE_PERSON = 3.0, 25.0
"""Kilograms: from the first on lifting counts as work, the second is the most for one person (ISO 11228-1)."""


class Says(IntEnum):
    """What a property tells of."""

    QUALITY = 0
    CLASS = 1
    """A quality in a word that says little by itself ("medium")."""
    USE = 2
    PLACE = 3
    OTHER = 4


class Statement(NamedTuple):
    """One value of a property. traits: what it says, as bits; noted: by a model, and not by the map."""

    says: Says
    name: str
    text: str
    traits: int = 0
    noted: bool = False


_NAMES: Mapping[str, str] = {
    "material": "material", "materials": "material",
    "color": "color", "colour": "color", "colors": "color", "colours": "color", "dominant_color": "color",
    "weight_class": "weight", "weight": "weight", "weight_kg": "weight", "mass": "weight", "mass_kg": "weight",
    "rigidity": "rigidity", "firmness": "rigidity",
    "affordance": "use", "affordances": "use",
    "typical_place": "place", "typical_places": "place",
}  # fmt: skip
"""What maps call the properties that tell of a quality, a use or a place."""

_RECORDS = frozenset(
    ("enriched", "enriched_by", "traversable", "traversable_by", "captioned_by", "detected_tags", "tagged_by")
)
"""Properties that tell of the map and its making, or are conditions ("WHERE o.traversable"); never descriptions."""

_ALLOWED: Mapping[str, frozenset[str]] = {
    "material": frozenset((*everyday.MATERIALS, "foam", "wax")),
    "color": frozenset((*everyday.COLORS, "transparent")),
    "weight": frozenset(("light", "middling", "heavy", "fixed", "portable")),
    "rigidity": frozenset(("soft", "firm", "rigid", "fragile")),
}

_MORE = """
wood: oak pine beech walnut ash birch maple mahogany teak cherry bamboo plywood mdf chipboard hardwood softwood spruce
    veneer fiberboard particleboard rattan wicker cork
metal: aluminum chrome bronze zinc tin titanium nickel silver gold pewter alloy
plastic: pvc polypropylene polyethylene polycarbonate polystyrene vinyl nylon melamine plexiglass polymer resin
glass: crystal
fabric: wool velvet linen silk polyester plush denim felt canvas microfiber chenille corduroy fleece satin upholstery
    down yarn rope
leather: suede leatherette
paper: newsprint tissue
cardboard: carton paperboard
ceramic: terracotta stoneware china
rubber: latex silicone
stone: quartz slate limestone sandstone brick cement terrazzo plaster
foam: sponge polyurethane styrofoam
wax: paraffin beeswax
gray: charcoal anthracite
brown: chocolate khaki bronze copper walnut
red: brick wine
blue: cyan indigo
green: mint sage emerald
yellow: mustard
orange: terracotta peach
pink: rose magenta salmon coral
purple: lilac mauve
middling: medium moderate
""".strip()
"""trait: words that say it where a property is known to tell of that; in a sentence some of them mean other things."""

_FLAG = re.compile(
    r"\w+[ai]ble|(?:has|can|is)_\w+|surfaces|containers|recipient|cover_object|cream|clothes|person|body_part",
    re.IGNORECASE,
)
"""The names that simulators give to uses (GRABBABLE, has_switch): flags of theirs, no phrases."""
_BENDS = frozenset(("flexible", "bendable", "pliable", "semi-flexible", "elastic", "stretchy"))
_DENIES = frozenset(("no", "not", "non", "without", "un", "never"))
_KILOGRAMS = re.compile(r"\s*(\d{1,6}(?:\.\d{1,6})?)\s*(kg|kilograms?|kilos?|g|grams?)\s*", re.IGNORECASE)


def statements(properties: Mapping[str, object]) -> Iterator[Statement]:
    """What the properties of a thing tell, value by value; what is no text, and no quality, tells nothing."""
    listed = properties.get("enriched")
    noted = frozenset(str(name) for name in listed) if isinstance(listed, tuple) else frozenset()
    for name, value in list(properties.items())[:MOST_PROPERTIES]:
        folded = name.casefold()
        if folded in _RECORDS:
            continue
        sort = _NAMES.get(folded)
        if sort is None and isinstance(value, str):
            yield Statement(Says.OTHER, name, _readable(value))
        elif sort is None:
            yield from _others(name, value)
        elif value is not True:
            for item in (value if isinstance(value, tuple) else (value,))[:MOST_ITEMS]:
                found = _statement(name, sort, item, noted=name in noted)
                if found is not None:
                    yield found


def masks(found: Iterable[Statement]) -> tuple[int, int]:
    """The traits that the map says, and those that a model noted, as bits."""
    told = noted = 0
    for one in found:
        if one.noted:
            noted |= one.traits
        else:
            told |= one.traits
    return told, noted


def reasons(properties: Mapping[str, object], telling: int, use: str | None = None) -> tuple[str, ...]:
    """What the properties say of what was asked, and who says it: "its map says: heavy", "noted by MODEL: cut paper".

    telling: the traits that matter, as bits. use: the phrase that serves best.
    """
    model = properties.get("enriched_by")
    by = f"noted by {_short(model)}" if isinstance(model, str) and model.strip() else "noted by a model"
    said: dict[str, dict[str, None]] = {}
    for one in statements(properties):
        if one.traits & telling or (one.says is Says.USE and one.text == use):
            sort = _NAMES.get(one.name.casefold(), "")
            text = f"made of {_short(one.text)}" if sort == "material" else _short(one.text)
            said.setdefault(by if one.noted else "its map says", {}).setdefault(text)
    return tuple(f"{who}: {', '.join(texts)}" for who, texts in said.items())


def _short(text: str) -> str:
    """A stranger's text as it may be shown: one line, printable, not long."""
    return " ".join("".join(c if c.isprintable() else " " for c in text[:LONGEST]).split())


def _others(name: str, value: object) -> Iterator[Statement]:
    """The texts of a property that tells of anything: a state, a brand."""
    if value is True:
        yield Statement(says=Says.OTHER, name=name, text=name.replace("_", " ").casefold())
        return
    for item in value if isinstance(value, tuple) else (value,):
        if isinstance(item, str):
            yield Statement(says=Says.OTHER, name=name, text=_readable(item))


def _statement(name: str, sort: str, item: object, *, noted: bool) -> Statement | None:
    if sort == "weight" and isinstance(item, (int, float)) and not isinstance(item, bool):
        return _weighed(name, float(item), f"{item:g} kg", noted=noted)
    if not isinstance(item, str) or not item.strip():
        return None
    if sort == "weight" and (found := _KILOGRAMS.fullmatch(item)) is not None:
        kilograms = float(found[1]) / (1000 if found[2].casefold().startswith("g") else 1)
        return _weighed(name, kilograms, item.strip(), noted=noted)
    if len(item) > LONGEST or (sort == "use" and (item.isupper() or _FLAG.fullmatch(item))):
        return Statement(says=Says.OTHER, name=name, text=_readable(item), noted=noted)
    text = " ".join(item.replace("_", " ").split())
    if sort in ("use", "place"):
        return Statement(says=Says.USE if sort == "use" else Says.PLACE, name=name, text=text, noted=noted)
    traits = _traits(sort, text)
    says = Says.CLASS if traits and sort in ("weight", "rigidity") else Says.QUALITY if traits else Says.OTHER
    return Statement(says=says, name=name, text=text, traits=traits, noted=noted)


def _weighed(name: str, kilograms: float, text: str, *, noted: bool) -> Statement | None:
    if not math.isfinite(kilograms) or kilograms <= 0:
        return None
    trait = "light" if kilograms < ONE_HAND else "middling" if kilograms <= ONE_PERSON else "heavy"
    return Statement(says=Says.CLASS, name=name, text=text, traits=_bit(trait), noted=noted)


def _readable(text: str) -> str:
    return text.replace("_", " ").casefold() if text.isupper() and "_" in text else text


def _bit(trait: str) -> int:
    return 1 << knowledge().traits.index(trait)


@lru_cache(maxsize=4096)
def _traits(sort: str, text: str) -> int:
    """The traits of one sort that a text says ("solid oak with brass feet": wood and metal), as bits."""
    allowed, stems = _ALLOWED[sort], stemmed(text)
    if _DENIES.intersection(stems):
        return 0
    if sort == "rigidity" and _BENDS.intersection(stems):
        return 1 << FLEXIBLE
    mask = _said(stems, allowed)
    return mask or _said(stemmed(text.replace("-", " ")), allowed)  # "brick-red"


def _said(stems: tuple[str, ...], allowed: frozenset[str]) -> int:
    known = knowledge()
    names = [known.traits[trait] for trait in known.traits_in(stems)[0]]
    names.extend(name for stem in stems for name in _more().get(stem, ()))
    mask = 0
    for name in names:
        mask |= _bit(name) if name in allowed else 0
    return mask


@lru_cache(maxsize=1)
def _more() -> Mapping[str, tuple[str, ...]]:
    found: dict[str, tuple[str, ...]] = {}
    for line in everyday.lines(_MORE):
        trait, _, words = line.partition(":")
        for word in words.split():
            key = stemmed(word)[-1]
            found[key] = (*found.get(key, ()), trait)
    return found
