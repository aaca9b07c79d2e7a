"""What boxes say of two things: on, in, under, above, next_to, near, with a confidence for each.

Boxes are taken as upright prisms (see cgdb.ingest.relations.boxes). Boxes of real maps lie about what they hold: a
sofa's box is full of air above its seat, a desk's is full of air below its top. Where geometry alone cannot tell two
readings apart, both are given with confidences of about one half, which a query can weigh; what is given at 0.7 or
more is meant.

    on       a's bottom meets b's top and a good part of a's footprint is over b; or, less surely, a rests inside b's
             box above its bottom (a cushion on a sofa) or reaches out of it (a plant in, or on, a stand); or, where
             nothing else holds a up, b is what it hovers over by a hand's breadth: things do not hover, boxes do
    in       most of a's volume lies in b's box, and a is clearly smaller
    under    a ends below the bottom of b, at the same spot, and b is one of the nearest few above a; or a
             stands inside b's box on b's own level (a bin under a desk, or in a cupboard); or b stands on a and a is
             flat (a rug under a table)
    above    the inverse of under, always
    next_to  side by side: overlapping in height, close together for their size, and none of the above; or, less surely,
             not overlapping in height, but large and close (a sofa by a window, which may be above it too)
    near     within a metre, in three dimensions, among the nearest few of either; not on, in or next_to each other

next_to and near mean the same both ways and are given once per pair, from the smaller id to the larger (numbers before
texts); query them either way. Walls, floors, ceilings and whole rooms only ever serve as what something is on.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from cgdb.ingest.relations.boxes import Bools, Floats, Ints, Prisms, center_gap, ground_gap, near_pairs, overlap_area
from cgdb.ingest.relations.found import Found, together

LABELS = ("on", "in", "under", "above", "next_to", "near")

Scalar = TypeVar("Scalar", bound=np.generic)

_CHUNK = 1 << 15
"""Pairs measured in one go; each takes about 2 kB while it is."""

_THIN_SLACK = 0.02
"""Metres by which the heights of flat things may differ when they mean the same level."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Limits:
    """Thresholds of the relations, with their reasons; metres, or shares between 0 and 1.

    touch: what still counts as touching. Boxes from depth pictures are fused on a grid of 2.5 cm, twice that is noise.
    touch_share: taller things have noisier boxes; this share of the lower height is added, up to touch once more.
    support: share of a's footprint that must be over b. A thing falls off when its middle is not held up; boxes that
        are too large for their things ask for some mercy.
    hover: a thing that nothing holds up is on what is at most so far below it: undersides are seen badly.
    rest: how far up in b's box, as a share of its height, a thing must lie to be on b rather than at its feet.
    inside: share of a's volume that must lie in b.
    smaller: how much of b's footprint (on) or volume (in) a may take at most; beyond it the two are one thing seen
        twice more often than a thing and its container.
    vertical_gap: under and above reach so far; it spans a lamp above a table or a picture above a sofa.
    aside: a thing whose middle is so far outside of the other's footprint is still above it: pictures hang on walls
        and furniture stands a little before them.
    flat: a thing no higher than this is under what stands on it.
    side_gap, side_share: things are side by side up to this gap, or this share of the smaller one's width if less.
    side_touch: but always up to this gap, however small they are.
    side_low: things at least this high may be next to each other though one begins above the other, up to side_gap:
        a sofa is next to a window whose sill is higher than the sofa.
    near_gap, near_count: near reaches so far, and to so many nearest of either; so there are at most near_count per
        object on average, however crowded the place is.
    per_object: on, in, under and next_to are kept for the so many surest of a source.
    sheet: what is thinner than this share of its longest side is a sheet (a wall, a window, a rug): nothing is in it.
    structure_share, structure_area: what covers this share of the scene and as many m2 and is flat is a floor or a
        ceiling; what covers as many m2 and is as high as structure_height is a room, or a lump that no thing is.
    crowd: boxes of one size at one spot that each box is compared with, see near_pairs.
    """

    touch: float = 0.05
    touch_share: float = 0.05
    support: float = 0.35
    hover: float = 0.2
    rest: float = 0.2
    inside: float = 0.7
    smaller: float = 0.6
    vertical_gap: float = 1.5
    aside: float = 0.1
    flat: float = 0.05
    side_gap: float = 0.5
    side_share: float = 0.5
    side_touch: float = 0.1
    side_low: float = 0.3
    near_gap: float = 1.0
    near_count: int = 8
    per_object: int = 3
    sheet: float = 0.05
    structure_share: float = 0.3
    structure_area: float = 6.0
    structure_height: float = 2.0
    crowd: int = 64


USUAL = Limits()
"""The limits for rooms and the things in them."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class _Measures:
    """What is known of the ordered pairs a[k] -> b[k]: gaps in metres, shares of a's and b's footprint, (p,) each.

    ground: gap between footprints. upright: gap in height, negative by how much they overlap.
    share_a, share_b: of the footprint that is over the other's. aside: gap from a's middle to b's footprint.
    """

    a: Ints
    b: Ints
    ground: Floats
    upright: Floats
    share_a: Floats
    share_b: Floats
    aside: Floats


def relate(shapes: Prisms, limits: Limits, structure: Bools) -> dict[str, Found]:
    """The relations between the rows of ``shapes``, by label; structure: (n,) bool, known walls and so on."""
    structure = structure | looks_like_structure(shapes, limits)
    reach = max(limits.near_gap, limits.side_gap, limits.side_touch, limits.aside)
    pairs = near_pairs(shapes, across=reach, upright=max(limits.vertical_gap, limits.near_gap), crowd=limits.crowd)
    useful = ~(structure[pairs.first] & structure[pairs.second])
    first, second = pairs.first[useful], pairs.second[useful]
    parts: dict[str, list[Found]] = {label: [] for label in (*LABELS, "hovers")}
    for at in range(0, max(len(first), 1), _CHUNK):
        measures = _measure(shapes, first[at : at + _CHUNK], second[at : at + _CHUNK])
        for label, part in _judge(shapes, measures, limits, structure).items():
            parts[label].append(part)
    found = {label: together(part) for label, part in parts.items()}
    hovers = found.pop("hovers")
    held = np.concatenate([found["on"].source, found["in"].source])
    hovers = hovers.take(~np.isin(hovers.source, held)).first_per_source(1)
    found["on"] = together([found["on"], hovers])
    found["under"] = found["under"].without(hovers.turned())
    found["near"] = found["near"].without(hovers).without(hovers.turned())
    for label in ("on", "in", "under"):
        found[label] = found[label].first_per_source(limits.per_object)
    found["above"] = found["under"].turned()
    found["next_to"] = found["next_to"].first_per_either(limits.per_object)
    found["near"] = found["near"].first_per_either(limits.near_count)
    return found


def looks_like_structure(shapes: Prisms, limits: Limits) -> Bools:
    """(n,) bool: the boxes that can only be floors, ceilings, or whole rooms, by their size within the scene."""
    solid = ~shapes.points
    if not solid.any():
        return np.zeros(len(solid), dtype=bool)
    # Half of all boxes lie in the middle half of the scene: a stray box far out does not make the scene larger.
    ground = shapes.ground - np.median(shapes.ground[solid], axis=0)
    spread = np.quantile(np.hypot(ground[solid, 0], ground[solid, 1]), 0.9)
    scene = max(np.pi * spread**2, limits.structure_area)
    wide = shapes.area >= limits.structure_area
    flat = (shapes.height <= 0.3) & (shapes.area >= limits.structure_share * scene)
    tall = shapes.height >= limits.structure_height
    return np.asarray(solid & wide & (flat | tall))


def _measure(shapes: Prisms, first: Ints, second: Ints) -> _Measures:
    """Measure the pairs both ways: rows k and k + p are the same pair, one way and the other."""
    ground = ground_gap(shapes, first, second)
    common = np.zeros(len(first))
    meet = np.flatnonzero(ground == 0.0)
    common[meet] = overlap_area(shapes, first[meet], second[meet])
    a, b = np.concatenate([first, second]), np.concatenate([second, first])
    common = np.concatenate([common, common])
    return _Measures(
        a=a,
        b=b,
        ground=np.concatenate([ground, ground]),
        upright=np.maximum(shapes.low[a] - shapes.high[b], shapes.low[b] - shapes.high[a]),
        share_a=common / shapes.area[a],
        share_b=common / shapes.area[b],
        aside=center_gap(shapes, a, b),
    )


def _judge(shapes: Prisms, m: _Measures, limits: Limits, structure: Bools) -> dict[str, Found]:
    """Every label's relations among the measured pairs, before the surest few per object are kept."""
    solid = ~(shapes.points[m.a] | shapes.points[m.b])
    free = solid & ~structure[m.a] & ~structure[m.b]
    touching = _touching(shapes, m, limits) * (solid & ~structure[m.a])
    resting, inside, standing = _within(shapes, m, limits)
    on = np.maximum(touching, np.where(free, resting, 0.0))
    inside = np.where(free, inside, 0.0)
    claimed = (on > 0) | (inside > 0)
    claimed |= _mirror(claimed)

    below = np.where(free & ~claimed, _below(shapes, m, limits), 0.0)
    # What lies flat below a thing that stands on it is under it; what stands within a box may be under a table top.
    below = np.maximum(below, np.where(free & (shapes.height[m.a] <= limits.flat), _mirror(touching), 0.0))
    below = np.where(free, np.maximum(below, standing), 0.0)
    level = (below > 0) | (_mirror(below) > 0)

    beside, by = _beside(shapes, m, limits)
    beside = np.where(free & ~claimed, np.maximum(np.where(level, 0.0, beside), by), 0.0)
    distance = np.hypot(m.ground, np.maximum(m.upright, 0.0))
    known = ~(structure[m.a] | structure[m.b])
    close = np.where(known & ~claimed & (beside == 0) & (distance <= limits.near_gap), 1.0, 0.0)
    close *= 1.0 - 0.5 * distance / limits.near_gap
    gap = np.maximum(m.upright, 0.0)
    above = shapes.low[m.a] - shapes.high[m.b]
    hovers = solid & ~structure[m.a] & ~claimed & (above > 0) & (above <= limits.hover) & (m.share_a >= limits.inside)
    return {
        "hovers": _found(m, np.where(hovers, 0.55 - above, 0.0), gap),
        "on": _found(m, on, -on),
        "in": _found(m, inside, _volume(shapes)[m.b]),
        "under": _found(m, below, gap),
        "above": _found(m, np.zeros(len(m.a)), gap),
        "next_to": _found(m, _once(beside), m.ground),
        "near": _found(m, _once(close), distance),
    }


def _touching(shapes: Prisms, m: _Measures, limits: Limits) -> Floats:
    """Confidence that a stands on b's top: its bottom is there, enough of it is over b, and its middle is higher."""
    low_height = np.minimum(shapes.height[m.a], shapes.height[m.b])
    slack = limits.touch + np.minimum(limits.touch_share * low_height, limits.touch)
    gap = np.abs(shapes.low[m.a] - shapes.high[m.b])
    higher = shapes.low[m.a] + shapes.high[m.a] > shapes.low[m.b] + shapes.high[m.b] + 1e-3
    touches = (gap <= slack) & higher & (m.share_a >= limits.support)
    held = np.minimum(m.share_a / 0.8, 1.0)
    # Flat things that share a level touch each other's top wherever they meet: a glass beside a plate is not on it.
    level = shapes.low[m.a] < (shapes.low[m.b] + shapes.high[m.b]) / 2.0
    touches &= ~level | (m.share_a >= limits.inside)
    # A plate in a microwave oven is where a mat under a table would be.
    enclosed = (m.share_b >= limits.inside) & (shapes.high[m.b] > shapes.low[m.a] + _THIN_SLACK)
    sure: Floats = np.where(touches, 0.95 * held * (1.0 - 0.4 * (gap / slack) ** 2), 0.0)
    return np.where(enclosed, 0.5 * sure, sure)


def _within(shapes: Prisms, m: _Measures, limits: Limits) -> tuple[Floats, Floats, Floats]:
    """Confidences that a, which reaches into b's box, is on something of b, in b, or under b's top."""
    low_a, high_a, low_b, high_b = shapes.low[m.a], shapes.high[m.a], shapes.low[m.b], shapes.high[m.b]
    tall_a, tall_b = shapes.height[m.a], shapes.height[m.b]
    volume = _volume(shapes)
    middle = (low_a + high_a) / 2.0
    shared = np.minimum(middle + tall_a / 2, high_b) - np.maximum(middle - tall_a / 2, low_b)
    sunk = np.clip(shared / tall_a, 0.0, 1.0)
    contained = m.share_a * sunk
    small = shapes.area[m.a] <= limits.smaller * shapes.area[m.b]
    over = (m.aside == 0.0) & (m.share_a >= limits.inside)
    bottom = (low_a - low_b) / tall_b
    # In: most of it. A thing that fills its container less is as sure to be in it; one that sticks out is less so.
    hollow = shapes.slim[m.b] >= limits.sheet
    fits = hollow & (contained >= limits.inside) & (volume[m.a] <= limits.smaller * volume[m.b])
    # On: resting at some height within the box, whether it ends within the box or reaches out of it.
    rests = hollow & over & small & (bottom >= limits.rest) & (shared > 0)
    # What is as high as a seat or a table has its use on it; bowls and drawers, and what people reach up to, in it.
    seat = (tall_b >= 0.3) & (tall_b <= 1.1) & (shapes.area[m.b] >= 0.3)
    likely = np.where(sunk < 0.95, 0.65, np.where(seat, 0.6, 0.4))
    resting = np.where(rests, likely * np.minimum(m.share_a / 0.9, 1.0), 0.0)
    inside = np.where(fits, np.where(seat & rests, 0.2, 0.4) + 0.35 * contained, 0.0)
    # Under: standing on b's own level, with room above it.
    stands = fits & over & (np.abs(low_a - low_b) <= limits.touch) & (high_a < high_b - limits.touch) & (tall_b >= 0.3)
    standing = np.where(stands, 0.35, 0.0)
    return resting, inside, standing


def _below(shapes: Prisms, m: _Measures, limits: Limits) -> Floats:
    """Confidence that a is below b: apart in height, but not far, with one's middle at the other's footprint."""
    gap = shapes.low[m.b] - shapes.high[m.a]
    smaller_aside = np.where(shapes.area[m.a] <= shapes.area[m.b], m.aside, _mirror(m.aside))
    share = np.maximum(m.share_a, m.share_b)
    at = (smaller_aside <= limits.aside) | (share >= limits.support)
    # A fork beside a plate ends below the plate's bottom by noise alone.
    higher = shapes.low[m.b] > (shapes.low[m.a] + shapes.high[m.a]) / 2.0 + _THIN_SLACK
    ordered = (gap >= -limits.touch) & (gap <= limits.vertical_gap) & at & higher
    sure: Floats = np.where(
        ordered, (0.6 + 0.3 * share) * (1.0 - 0.4 * np.maximum(gap, 0.0) / limits.vertical_gap), 0.0
    )
    return sure


def _beside(shapes: Prisms, m: _Measures, limits: Limits) -> tuple[Floats, Floats]:
    """Confidences that a and b stand side by side, on a common height; or by each other, one of them higher up."""
    widths = np.hypot(shapes.sides[..., 0], shapes.sides[..., 1]).sum(axis=1)
    widest = np.clip(limits.side_share * np.minimum(widths[m.a], widths[m.b]), limits.side_touch, limits.side_gap)
    low_height = np.minimum(shapes.height[m.a], shapes.height[m.b])
    both_flat = np.maximum(shapes.height[m.a], shapes.height[m.b]) <= limits.flat
    common = 0.3 * low_height - np.where(both_flat, _THIN_SLACK, 0.0)
    # Boxes that share more than half a footprint are one behind the other, or one thing seen twice.
    share = np.maximum(m.share_a, m.share_b)
    fading = 0.4 * m.ground / np.maximum(widest, 1e-9) + 0.4 * share
    close = (m.ground <= widest) & (share <= 0.5)
    beside = np.where(close & (-m.upright >= common), 0.9 - fading, 0.0)
    # A sofa by a window ends below its sill.
    by = close & (share <= 0.2) & (m.upright >= 0.0) & (m.upright <= limits.side_gap) & (low_height >= limits.side_low)
    return beside, np.where(by, 0.6 - 0.5 * fading, 0.0)


def _volume(shapes: Prisms) -> Floats:
    volume: Floats = shapes.area * shapes.height
    return volume


def _mirror(values: NDArray[Scalar]) -> NDArray[Scalar]:
    """Of each pair what is known of it the other way."""
    once = len(values) // 2
    return np.roll(values, once)


def _once(values: Floats) -> Floats:
    """Keep a symmetric measure for the first way of each pair only; rows go by id, so that is from the smaller id."""
    return np.concatenate([values[: len(values) // 2], np.zeros(len(values) // 2)])


def _found(m: _Measures, confidence: Floats, rank: Floats) -> Found:
    at = np.flatnonzero(confidence > 0)
    # Ranks to a tenth of a millimetre: equal distances stay equal however the map is turned, and ids break the tie.
    return Found(source=m.a[at], target=m.b[at], confidence=confidence[at], rank=np.round(rank[at], 4))
