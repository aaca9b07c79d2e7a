"""Makes cli/flat.json, the map that cgdb ships for its demo: an invented flat, as a careful robot would map it.

    python examples/make_flat.py [FILE]

Metres, z up, floor at z = 0. What stands on something gets its height from what it stands on, so that nothing hangs in
the air; tests/test_flat.py checks that, and that no two boxes overlap but of a thing and what it is in.
"""

from __future__ import annotations

import sys
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from cgdb.export import export
from cgdb.scene import Place, PropertyValue, Relation, SceneGraph, SceneObject, check_scene

CEILING = 2.6
ROOMS = {
    "living room": (0.0, 0.0, 5.2, 4.2),
    "kitchen": (5.2, 0.0, 9.0, 4.2),
    "bedroom": (0.0, 4.2, 4.4, 8.0),
    "bathroom": (4.4, 4.2, 6.6, 8.0),
    "hall": (6.6, 4.2, 9.0, 8.0),
}
"""Name -> where it begins and ends on the floor: x, y, x, y."""
FIRST_ROOM_ID = 901

# Two lines per thing:
#   key | tag | place | size: width along x, depth along y, height | x y (z where it hangs) | properties
#     caption (other tags that the detector gave)
# A place is "floor", "on KEY", "in KEY BOTTOM" (BOTTOM: the height of the thing's lower side), "wall" or "ceiling".
# The property "for" lists affordances: what a person can do with the thing.
FURNITURE = """
sofa | sofa | floor | 0.9 2.1 0.42 | 0.6 2.0 | for=sit,lie color=grey material=fabric
    a wide charcoal grey daybed sofa without a backrest, right by the window (couch, daybed, bench)
window | window | wall | 0.1 1.6 1.6 | 0.06 2.0 1.35 | material=glass state=closed
    a large living room window with a white wooden frame (glass door, picture)
red cushion | cushion | on sofa | 0.4 0.4 0.15 | 0.5 1.3 | for=lean_on color=red material=velvet
    a soft brick-red velvet cushion (pillow, throw pillow)
teal cushion | cushion | on sofa | 0.4 0.4 0.15 | 0.5 1.85 | for=lean_on color=teal material=cotton
    a square teal cushion with a fringe (pillow, fabric)
blanket | blanket | on sofa | 0.5 0.6 0.12 | 0.6 2.6 | for=keep_warm color=cream material=wool
    a folded cream-coloured wool blanket (throw, quilt, towel)
rug | rug | floor | 2.0 1.6 0.015 | 2.2 2.0 | color=blue material=wool
    a flat woven blue rug with a white diamond pattern (carpet, mat)
coffee table | coffee table | on rug | 0.6 1.1 0.4 | 2.0 2.0 | for=put_on material=oak
    a low coffee table with an oiled oak top (table, bench)
remote | remote control | on coffee table | 0.05 0.17 0.02 | 1.85 1.7 | for=switch_tv color=black material=plastic
    a slim black remote control for the television (remote, phone)
cola | soda can | on coffee table | 0.066 0.066 0.12 | 2.1 1.75 | for=drink color=red material=aluminium state=closed
    a red aluminium can of cola, unopened (cola, soda, beverage)
paperback | book | on coffee table | 0.13 0.2 0.025 | 2.0 2.3 | for=read color=green material=paper state=open
    a paperback about growing vegetables, lying open (paperback, magazine)
bookshelf | bookshelf | floor | 1.0 0.32 1.9 | 2.6 4.0 | for=store color=white material=wood
    a tall white bookshelf with five boards (shelf, bookcase)
novel | book | in bookshelf 1.2 | 0.035 0.13 0.2 | 2.25 3.98 | for=read color=yellow material=paper
    a worn detective novel with a yellow spine (novel, paperback)
atlas | atlas | in bookshelf 0.4 | 0.04 0.26 0.34 | 2.4 4.0 | for=read color=blue material=paper
    a heavy hardcover atlas of the world with a dark blue cover (book, encyclopedia)
board game | board game | in bookshelf 0.8 | 0.28 0.26 0.07 | 2.85 4.0 | for=play material=cardboard
    a boxed board game about trading ships (game, box, toy)
ivy | ivy | on bookshelf | 0.26 0.26 0.3 | 2.9 4.0 | for=water color=green
    a trailing ivy in a small terracotta pot (potted plant, houseplant, vine)
armchair | armchair | floor | 0.8 0.85 0.95 | 0.6 3.6 | for=sit color=yellow material=fabric
    a cosy mustard yellow armchair with wooden legs (chair, seat)
side table | side table | floor | 0.45 0.45 0.5 | 0.45 0.5 | for=put_on color=black material=metal
    a small square side table of black metal (table, stool)
table lamp | table lamp | on side table | 0.25 0.25 0.45 | 0.4 0.46 | for=light material=brass state=on
    a table lamp with a brass foot and a linen shade, lit (lamp, light)
tea | mug | on side table | 0.09 0.09 0.1 | 0.6 0.62 | for=drink,hold_liquid color=white material=ceramic
    a white mug of green tea with a chipped rim (cup, tea)
floor lamp | floor lamp | floor | 0.35 0.35 1.6 | 1.4 3.9 | for=light color=black material=metal state=off
    a tall black floor lamp that bends over the armchair (lamp, light)
beanbag | beanbag | floor | 0.85 0.85 0.7 | 3.9 3.4 | for=sit color=green material=fabric
    a large shapeless beanbag in olive green (bean bag, pouf, cushion)
monstera | potted plant | floor | 0.6 0.6 1.2 | 4.75 0.5 | for=water color=green
    a lush monstera with large split leaves in a grey pot (plant, monstera, houseplant)
tv stand | tv stand | floor | 0.4 1.6 0.5 | 4.95 2.0 | for=put_on,store material=walnut
    a long low walnut media console (sideboard, cabinet)
television | television | on tv stand | 0.08 1.2 0.7 | 4.95 2.0 | for=watch color=black state=off
    a large flat black television, switched off (tv, monitor, screen)
block | wooden block | on rug | 0.06 0.06 0.06 | 2.8 1.5 | for=play,prop_open material=wood
    a single solid wooden toy block, unpainted, with sharp edges (toy block, cube, dice)
teddy | teddy bear | on rug | 0.25 0.2 0.35 | 2.9 2.5 | for=play,cuddle color=brown material=plush
    a fluffy brown teddy bear with one missing eye (stuffed animal, toy)
toy basket | toy basket | floor | 0.45 0.45 0.35 | 4.15 0.45 | for=store material=wicker state=open
    a round wicker basket for toys (basket, laundry basket)
toy car | toy car | in toy basket 0.03 | 0.12 0.06 0.05 | 4.1 0.4 | for=play color=red material=metal
    a small die-cast toy fire engine (toy, fire truck)

fridge | refrigerator | floor | 0.7 0.7 1.85 | 8.6 0.45 | for=open,keep_cold color=white material=steel state=closed
    a tall white refrigerator with two doors (fridge, freezer, cabinet)
orange juice | juice carton | in fridge 0.9 | 0.08 0.08 0.25 | 8.5 0.4 | for=drink,pour color=orange material=cardboard
    a carton of orange juice without pulp (orange juice, carton, box)
milk | milk bottle | in fridge 0.9 | 0.09 0.09 0.24 | 8.7 0.4 | for=drink,pour material=glass state=full
    a full glass bottle of whole milk (milk, bottle)
cereal | cereal box | on fridge | 0.2 0.07 0.3 | 8.5 0.5 | for=eat,pour material=cardboard state=open
    a colourful box of breakfast cereal (box, food, book)
counter | kitchen counter | floor | 2.6 0.62 0.9 | 6.8 0.35 | for=put_on,store color=grey material=stone
    a long kitchen counter with a grey stone worktop and white drawers (countertop, cabinet, table)
coffee maker | coffee maker | on counter | 0.22 0.3 0.36 | 5.8 0.35 | for=make_coffee color=black state=off
    a black drip coffee maker with a glass jug (coffee machine, appliance)
kettle | kettle | on counter | 0.2 0.2 0.25 | 6.25 0.3 | for=boil_water,pour color=silver material=steel state=off
    a shiny stainless steel electric kettle (teapot, jug)
toaster | toaster | on counter | 0.3 0.2 0.2 | 6.7 0.25 | for=toast color=red state=off
    a glossy red two-slice toaster (appliance, oven)
knives | knife block | on counter | 0.12 0.18 0.25 | 7.05 0.25 | for=cut material=beech
    a beech knife block with five black-handled knives (knife, knife holder)
board | cutting board | on counter | 0.4 0.28 0.02 | 7.45 0.4 | for=cut_on material=bamboo
    a bamboo cutting board with crumbs on it (tray, plank)
bread | bread | on board | 0.28 0.12 0.12 | 7.45 0.4 | for=eat
    a crusty loaf of sourdough bread, half cut (loaf, food)
basil | basil plant | on counter | 0.15 0.15 0.25 | 7.95 0.45 | for=eat,water color=green
    a pot of fresh basil for cooking (herb, potted plant, plant)
cupboard | wall cupboard | wall | 1.2 0.35 0.7 | 6.3 0.2 1.75 | for=open,store color=white material=wood state=closed
    a white wall cupboard with two doors above the counter (cabinet, cupboard)
glasses | drinking glasses | in cupboard 1.45 | 0.3 0.2 0.13 | 6.0 0.2 | for=drink,hold_liquid material=glass
    six clear drinking glasses, upside down (glass, cup)
drawer | kitchen drawer | in counter 0.55 | 0.5 0.5 0.15 | 6.9 0.35 | for=open,store state=closed
    the kitchen drawer for odds and ends (drawer, box)
scissors | scissors | in drawer 0.56 | 0.08 0.2 0.015 | 6.75 0.35 | for=cut color=orange material=steel
    household scissors with orange handles (shears, tool)
corkscrew | corkscrew | in drawer 0.56 | 0.1 0.15 0.03 | 7.0 0.35 | for=open_bottles material=steel
    a waiter's corkscrew with a folding blade (bottle opener, tool)
dining table | dining table | floor | 0.9 1.4 0.75 | 7.1 2.8 | for=put_on,eat_at material=pine
    a rectangular pine dining table with a scratched top (table, desk)
fruit bowl | fruit bowl | on dining table | 0.3 0.3 0.12 | 7.1 2.8 | for=hold color=blue material=ceramic
    a wide blue ceramic bowl for fruit (bowl, plate)
bananas | bananas | in fruit bowl 0.77 | 0.2 0.12 0.08 | 7.1 2.8 | for=eat color=yellow
    a bunch of three ripe bananas (banana, fruit)
water | water bottle | on dining table | 0.07 0.07 0.26 | 7.35 2.3 | for=drink,pour material=glass state=full
    a bottle of sparkling mineral water (bottle, beverage)
east chair | chair | floor | 0.45 0.45 0.88 | 7.85 2.8 | for=sit material=beech
    a plain beech dining chair (wooden chair, seat)
west chair | chair | floor | 0.45 0.45 0.88 | 6.35 2.8 | for=sit color=green material=beech
    a wooden dining chair painted pale green (wooden chair, seat)
stool | bar stool | floor | 0.35 0.35 0.65 | 8.5 1.5 | for=sit,step_on material=steel
    a round steel bar stool without a back (stool, chair)
bin | trash can | floor | 0.3 0.3 0.6 | 8.75 3.9 | for=throw_away color=grey material=plastic state=closed
    a grey pedal bin for recycling (trash bin, waste container)
pendant | pendant lamp | ceiling | 0.4 0.4 0.5 | 7.1 2.8 2.35 | for=light color=orange material=metal state=on
    an orange metal pendant lamp above the dining table, lit (lamp, light)

bed | bed | floor | 1.6 2.05 0.5 | 1.2 6.9 | for=lie,sit,sleep color=white
    a double bed with a plain white sheet (mattress, couch)
pillow | pillow | on bed | 0.6 0.4 0.14 | 0.8 7.65 | for=sleep color=white material=cotton
    a plump white feather pillow (cushion, bedding)
sweater | sweater | on bed | 0.4 0.35 0.08 | 1.3 6.3 | for=wear,keep_warm color=green material=wool
    a folded dark green knitted sweater (clothes, jumper, blanket)
nightstand | nightstand | floor | 0.4 0.4 0.5 | 2.3 7.7 | for=put_on,store material=oak
    a small oak nightstand with one drawer (bedside table, cabinet)
bedside lamp | bedside lamp | on nightstand | 0.18 0.18 0.38 | 2.3 7.78 | for=light color=white state=off
    a small white reading lamp by the bed (lamp, light)
alarm clock | alarm clock | on nightstand | 0.1 0.06 0.1 | 2.2 7.58 | for=tell_time,wake color=black
    a black digital alarm clock with red digits (clock, radio)
wardrobe | wardrobe | floor | 1.2 0.6 2.1 | 3.7 7.6 | for=open,store color=white state=closed
    a white wardrobe with sliding doors (closet, cupboard)
coat | winter coat | in wardrobe 0.6 | 0.5 0.25 1.1 | 3.5 7.6 | for=wear,keep_warm color=navy material=wool
    a long navy blue winter coat on a hanger (coat, jacket, clothes)
dresser | chest of drawers | floor | 0.45 0.9 0.85 | 4.12 5.6 | for=open,store,put_on material=pine
    a pine chest of drawers with round knobs (dresser, drawers, cabinet)
sewing tin | sewing tin | in dresser 0.6 | 0.2 0.15 0.08 | 4.1 5.4 | for=mend,store color=gold material=tin
    a round-cornered biscuit tin that holds sewing things (tin, box, sewing kit)
safety pins | safety pins | in sewing tin 0.61 | 0.05 0.04 0.02 | 4.05 5.37 | for=fasten material=steel
    a handful of safety pins on a card (pin, needle)
string | ball of string | in sewing tin 0.61 | 0.06 0.06 0.06 | 4.13 5.42 | for=tie color=beige material=cotton
    a ball of strong cotton string (yarn, twine, rope)
desk | desk | floor | 1.2 0.6 0.74 | 0.75 4.6 | for=work_at,put_on color=white
    a white writing desk with thin steel legs (table, computer desk)
laptop | laptop | on desk | 0.33 0.23 0.02 | 0.75 4.65 | for=compute color=silver state=closed
    a silver laptop computer, closed (computer, notebook)
desk lamp | desk lamp | on desk | 0.2 0.2 0.45 | 0.3 4.5 | for=light color=black material=metal state=off
    a black desk lamp with a jointed arm (lamp, light)
office chair | office chair | floor | 0.6 0.6 1.0 | 0.75 5.3 | for=sit,roll color=black
    a black swivel office chair on five castors (chair, seat)
laundry basket | laundry basket | floor | 0.4 0.4 0.55 | 2.9 4.6 | for=store color=white material=plastic state=open
    a tall white plastic laundry basket with holes (basket, trash can)
t-shirt | t-shirt | in laundry basket 0.05 | 0.3 0.25 0.1 | 2.9 4.6 | for=wear color=striped material=cotton state=dirty
    a dirty navy and white striped t-shirt (shirt, clothes)

bathtub | bathtub | floor | 0.75 1.7 0.58 | 4.85 7.1 | for=bathe color=white state=empty
    a white enamelled bathtub (tub, sink)
basin | washbasin | wall | 0.45 0.6 0.2 | 6.365 5.8 0.75 | for=wash_hands color=white material=ceramic
    a white wall-hung washbasin with a chrome tap (sink, basin)
soap | soap | on basin | 0.1 0.07 0.03 | 6.45 5.6 | for=wash color=green
    a bar of green olive oil soap (bar of soap, cheese)
mirror | mirror | wall | 0.03 0.6 0.8 | 6.57 5.8 1.5 | for=look_at material=glass
    a frameless mirror above the washbasin (window, picture)
scale | bathroom scale | floor | 0.3 0.3 0.04 | 6.35 5.8 | for=weigh color=black material=glass
    a flat black glass bathroom scale (scale, tile)
towel | bath towel | wall | 0.1 0.6 0.9 | 4.47 5.6 1.2 | for=dry color=white material=cotton state=dry
    a large white terry bath towel on a wall hook (towel, curtain)
washing machine | washing machine | floor | 0.6 0.6 0.85 | 4.8 4.6 | for=wash_clothes color=white state=off
    a white front-loading washing machine (washer, dryer, appliance)
first aid | first-aid kit | on washing machine | 0.25 0.18 0.1 | 4.8 4.6 | for=treat_wounds color=red state=closed
    a red zipped first-aid kit with a white cross (medical kit, bag)

shoe rack | shoe rack | floor | 0.9 0.35 0.5 | 8.4 7.75 | for=store material=bamboo
    an open bamboo shoe rack with two boards (shelf, bench)
red shoes | running shoes | in shoe rack 0.25 | 0.28 0.24 0.12 | 8.2 7.75 | for=wear,run color=red
    a pair of worn red running shoes with white soles (shoes, sneakers)
boots | boots | in shoe rack 0.03 | 0.28 0.27 0.18 | 8.6 7.75 | for=wear,hike color=brown material=leather
    a pair of brown leather ankle boots with muddy soles (shoes, footwear)
raincoat | raincoat | wall | 0.5 0.15 1.0 | 7.2 7.9 1.2 | for=wear,stay_dry color=yellow
    a bright yellow raincoat on a wall hook (coat, jacket, clothes)
cabinet | hall cabinet | floor | 1.0 0.35 0.8 | 8.0 4.4 | for=open,store,put_on material=walnut
    a narrow walnut hall cabinet with two doors (sideboard, console table)
keys | keys | on cabinet | 0.1 0.06 0.02 | 7.8 4.4 | for=unlock material=brass
    a ring of three brass keys with a blue tag (key, keychain)
toolbox | toolbox | floor | 0.22 0.45 0.22 | 8.75 5.2 | for=carry,store color=blue material=steel state=closed
    a dented blue steel toolbox (box, tool case)
screwdriver | screwdriver | in toolbox 0.02 | 0.03 0.25 0.03 | 8.7 5.2 | for=screw,pry color=yellow material=steel
    a flat-head screwdriver with a yellow handle (tool, chisel)
hammer | hammer | in toolbox 0.02 | 0.04 0.3 0.1 | 8.83 5.2 | for=hit,pull_nails material=steel
    a claw hammer with a wooden handle (tool, mallet)
tape | duct tape | in toolbox 0.1 | 0.11 0.11 0.05 | 8.72 5.2 | for=stick,mend color=silver
    a thick roll of silver duct tape (tape, roll)
"""

# source | label | target, as a person would add to the map.
REMARKS = """
sofa | next_to | window
side table | next_to | sofa
rug | under | coffee table
nightstand | next_to | bed
dining table | under | pendant
counter | under | cupboard
scale | under | basin
basin | under | mirror
east chair | next_to | dining table
west chair | next_to | dining table
office chair | next_to | desk
raincoat | next_to | shoe rack
"""

# source | label | target | confidence | why, as a language model would.
SUGGESTIONS = """
block | may be stored in | toy basket | 0.93 | Loose toys on the rug belong in the toy basket.
teddy | may be stored in | toy basket | 0.78 | A teddy bear is a toy and would fit into the basket.
paperback | may be stored in | bookshelf | 0.9 | Books that nobody is reading are kept in the bookshelf.
sweater | may be stored in | wardrobe | 0.88 | Clean folded clothes are put away in the wardrobe.
water | may be stored in | fridge | 0.74 | Mineral water is often served cold.
cola | may be recycled in | bin | 0.66 | Aluminium cans go into the recycling once they are empty.
t-shirt | may be washed in | washing machine | 0.95 | It is a dirty cotton shirt that already waits in the laundry.
remote | controls | television | 0.97 | The remote control lies opposite the television and is made for it.
keys | may be stored in | cabinet | 0.6 | Keys are often kept out of sight near the door.
raincoat | may be worn with | boots | 0.55 | Both protect from rain and mud and are kept in the hall.
"""


def build() -> SceneGraph:
    """The flat as a checked scene graph; the same one every time."""
    objects: dict[str, SceneObject] = {}
    relations: list[Relation] = []
    lines = iter([line for line in FURNITURE.splitlines() if line.strip()])
    for head, description in zip(lines, lines, strict=True):
        key, tag, where, size, at, properties = _cells(head)
        obj = _furnish(len(objects) + 1, tag, where, size, at, properties, description, objects)
        objects[key] = obj
        how, _, rest = where.partition(" ")
        if how == "on":
            relations.append(_relation(obj, "on", objects[rest]))
        elif how == "in":
            relations.append(_relation(obj, "in", objects[rest.rpartition(" ")[0]]))
    for source, label, target in map(_cells, REMARKS.strip().splitlines()):
        relations.append(_relation(objects[source], label, objects[target]))
    for source, label, target, confidence, why in map(_cells, SUGGESTIONS.strip().splitlines()):
        relations.append(_relation(objects[source], label, objects[target], float(confidence), why, "llm"))
    scene = SceneGraph(
        name="flat",
        objects=tuple(objects.values()),
        relations=(*relations, *_contains(objects)),
        places=tuple(_rooms()),
        provenance={"made_by": "examples/make_flat.py", "license": "Apache-2.0", "note": "an invented flat"},
    )
    check_scene(scene)
    return scene


def _cells(line: str) -> list[str]:
    return [cell.strip() for cell in line.split("|")]


def _furnish(
    number: int,
    tag: str,
    where: str,
    size: str,
    at: str,
    properties: str,
    description: str,
    objects: dict[str, SceneObject],
) -> SceneObject:
    extent = np.array([float(side) for side in size.split()])
    position = [float(coordinate) for coordinate in at.split()]
    caption, _, others = description.strip().rstrip(")").partition(" (")
    how, _, rest = where.partition(" ")
    named = _properties(properties)
    if how in ("wall", "ceiling"):
        named = {"mounting": how, **named}
    else:
        bottom = {"floor": lambda: 0.0, "on": lambda: _top(objects[rest]), "in": lambda: float(rest.split()[-1])}[how]()
        position.append(bottom + extent[2] / 2)
    longest = float(extent.max())
    # Large things are seen in more frames and named with more confidence; the remainders are only variety.
    return SceneObject(
        id=number,
        tag=tag,
        tags=tuple(other.strip() for other in others.split(",")),
        caption=caption,
        center=np.round(np.array(position), 4),
        extent=extent,
        n_observations=3 + round(24 * min(2.0, longest)) + number * 29 % 13,
        confidence=round(0.6 + 0.2 * min(1.0, longest) + number * 37 % 17 / 100, 2),
        properties=named,
    )


def _properties(text: str) -> dict[str, PropertyValue]:
    found: dict[str, PropertyValue] = {}
    for name, _, value in (pair.partition("=") for pair in text.split()):
        if name == "for":
            found["affordances"] = tuple(value.split(","))
        else:
            found[name] = value
    return found


def _top(obj: SceneObject) -> float:
    assert obj.center is not None and obj.extent is not None
    return float(obj.center[2] + obj.extent[2] / 2)


def _relation(
    source: SceneObject,
    label: str,
    target: SceneObject,
    confidence: float = 1.0,
    explanation: str | None = None,
    origin: str = "human",
) -> Relation:
    return Relation(
        source=source.id,
        target=target.id,
        label=label,
        confidence=confidence,
        explanation=explanation,
        origin=origin,
    )


def _rooms() -> Iterator[Place]:
    for number, (name, (x0, y0, x1, y1)) in enumerate(ROOMS.items(), start=FIRST_ROOM_ID):
        center = np.round(np.array([(x0 + x1) / 2, (y0 + y1) / 2, CEILING / 2]), 4)
        yield Place(
            id=number, kind="Room", name=name, center=center, extent=np.round(np.array([x1 - x0, y1 - y0, CEILING]), 4)
        )


def _contains(objects: dict[str, SceneObject]) -> Iterator[Relation]:
    for number, (x0, y0, x1, y1) in enumerate(ROOMS.values(), start=FIRST_ROOM_ID):
        for obj in objects.values():
            assert obj.center is not None
            if x0 <= obj.center[0] < x1 and y0 <= obj.center[1] < y1:
                yield Relation(source=number, target=obj.id, label="contains", origin="geometry")


if __name__ == "__main__":
    shipped = Path(__file__).parent.parent / "cli" / "flat.json"
    export(build(), Path(sys.argv[1]) if len(sys.argv) > 1 else shipped, "cgdb")
