"""Common knowledge about everyday things, as a table: names | kinds | traits | uses.

A caption says "a wicker basket"; nobody writes down that one can carry things in it, that it weighs little, and that
it is no bag. Questions ask for exactly that ("something light to carry my washing in, not a bag").

names: the first is the thing's own, those after a comma mean the same; after a semicolon stands a kind of it, which
shares all that the line says. kinds: what it is one of (names of other lines); traits
and uses are inherited from them unless a line says otherwise. traits: size (tiny small medium large huge), weight
(light middling heavy), firmness (soft firm rigid), materials, and plain properties; of size, weight and firmness a
line has one each. An indented line goes on with the one before. uses: what one does with it, as one would end the
sentence "something to ...".
"""

from __future__ import annotations

TABLE = """
furniture, piece of furniture | | large heavy rigid |
seat, seating, place to sit | furniture | medium middling | sit on, rest your legs
chair, wooden chair, folding chair, side chair | seat | medium middling rigid | sit upright at a table or desk
office chair, desk chair, swivel chair, rolling chair, task chair, ergonomic chair, gaming chair, computer chair,
    conference chair, meeting chair | chair | medium middling firm | sit at a desk while working on a computer, sit
    upright during a meeting
armchair, easy chair, accent chair, lounge chair, club chair, recliner, wing chair, upholstered chair, cushioned chair,
    rocking chair, sofa chair, throne, nursing chair | chair | large heavy soft fabric | relax in, read a book in
    comfortably
sofa, couch, loveseat, love seat, settee, sectional, futon, daybed, chaise longue, chaise, divan, sofa bed, sleeper sofa
    | seat | large heavy soft fabric | lie down on, relax on in comfort, sit on with several people, take a nap on,
    stretch out on
bench, pew, park bench | seat | large heavy rigid wood | sit on side by side
stool, bar stool, step stool, footstool | seat | medium light rigid wood | sit on for a short time, rest your feet on,
    step on or stand on to reach a high shelf
ottoman, footstool, pouf, pouffe, hassock, footrest | seat | medium middling soft fabric | put your feet up on
bean bag, beanbag, bean bag chair | seat | medium light soft fabric | lounge on
bed, double bed, single bed, bunk bed, king bed, hospital bed, cot, sofa bed, camp bed | furniture | huge heavy soft |
    sleep in at night, lie down on, rest when you are tired or ill
treatment table; massage table, massage bed; examination table, exam table, examination couch; operating table |
    furniture | large heavy firm | lie down on to be examined or treated, examine a patient on
crib, cradle, baby bed, bassinet, infant bed, moses basket, travel cot, baby cot | furniture | large middling | put a
    baby to sleep in
headboard, bed frame, footboard, bedpost | furniture part | large heavy rigid wood | lean against in bed
furniture part | | rigid |
table, round table | furniture | large heavy rigid wood | eat dinner at, put food and dishes on, put things on, work
    or meet around
desk, writing desk, office desk, computer desk, work desk, workstation, standing desk | table | large heavy rigid wood
    | work at, write or study at, put a computer on, do your homework at, write letters at
coffee table, cocktail table, tea table | table | medium heavy rigid wood | put drinks and magazines on
side table, end table, nightstand, night stand, bedside table, small table, accent table, lamp table, bed table,
    telephone table | table | medium middling rigid wood | put a lamp or a drink on, keep things within reach of the bed
    or sofa
console table, hall table, sofa table, entry table | table | large heavy rigid wood | display decorations on
workbench, work table, lab bench | table | large heavy rigid wood metal | build or repair things on
counter, countertop, kitchen counter, kitchen island, worktop, bar counter, island, breakfast bar | table | large heavy
    rigid stone fixed | prepare food on
storage furniture | furniture | large heavy rigid wood | store things in, keep things tidy
cabinet, cupboard, cabinetry, storage cabinet; kitchen cabinet, kitchen cupboard, pantry, larder, kitchen cabinet lower;
    china cabinet, display cabinet, hutch, display case, showcase, vitrine, glass cabinet; wall cabinet, wall cupboard;
    credenza | storage furniture | large heavy rigid wood | store dishes cups and glasses in, keep things behind doors,
    put food supplies in
sideboard, buffet | cabinet | large heavy rigid wood | store dishes in, serve food from
filing cabinet, file cabinet | cabinet | large heavy rigid metal | file documents in, lock papers away
wardrobe, closet, armoire | storage furniture | huge heavy rigid wood | hang clothes in, put away clean clothes in
dresser, chest of drawers, bureau, dresser drawer, chest drawer, commode | storage furniture | large heavy rigid wood
    | keep folded clothes in, put away socks and underwear in
drawer, drawers, desk drawer, kitchen drawer | storage furniture part | medium middling rigid wood | keep small things
    in
storage furniture part | furniture part | rigid |
shelf, shelves, wall shelf, shelving, wooden shelf, floating shelf, shelving unit, cubby, wall cubby, pigeonhole, open
    shelf; mantelpiece, mantel, mantle, fireplace mantel | storage furniture | large heavy rigid wood | put things on
    display, put books on, display souvenirs on
bookshelf, bookcase, book shelf, bookrack, book rack | shelf | large heavy rigid wood | keep books on
chest, trunk, storage chest, treasure chest | storage furniture | large heavy rigid wood | keep blankets or valuables in
toy box, toy chest, toy bin | storage furniture, container | medium middling rigid | keep toys in
safe, strongbox, lockbox, lock box, cash box, key safe | storage furniture | medium heavy rigid metal | lock valuables
    away, open with a code or key
locker | storage furniture | large heavy rigid metal | lock belongings in, open with a key
rack, stand, storage rack, pedestal, plinth | storage furniture | large middling rigid metal | hold things upright
coat rack, coat stand, hat stand, coat hook, hook, wall hook, coat tree, hat rack, hall tree, hanging hook, clothes
    rail, garment rack, clothing rack, closet rod, clothes hanger rod | rack | medium middling rigid | hang coats and
    hats on
shoe rack, shoe cabinet | rack | medium middling rigid | keep shoes on
tv stand, media console, entertainment center, tv cabinet, tv console, tv unit, entertainment unit, media unit,
    entertainment set | storage furniture | large heavy rigid wood | put a television on
room divider, folding screen, partition, divider, dressing screen, privacy screen | furniture | large middling rigid |
    separate parts of a room
mannequin, shop dummy, mannequin head | | large middling rigid plastic | show clothes on
structure, part of a building | | huge heavy rigid fixed |
wall, white wall, brick wall; drywall, plasterboard | structure | huge heavy rigid fixed | separate rooms, hang pictures
    on
floor, wood floor, tiled floor, flooring, hardwood floor | structure | huge heavy rigid fixed | walk on
ceiling, drop ceiling, ceiling tile, roof, ceiling panel | structure | huge heavy rigid fixed | keep the rain out
column, pillar, beam, post, pole, rafter, joist, flagpole; archway | structure | large heavy rigid fixed | hold up a
    ceiling
staircase, stairs, stairway, steps, stair tread | structure | huge heavy rigid fixed | climb to another floor
railing, handrail, banister, bannister, balustrade, baluster, parapet, newel post, grab bar, grab rail, handicap bar;
    rail, guard rail, side rail, stair rail | structure | large heavy rigid fixed metal | hold on to while climbing
    stairs
door, doorway, wooden door, glass door; sliding door; double door; gate; hatch, trapdoor, loft hatch | structure | large
    heavy rigid wood fixed | enter or leave a room, unlock with a key, open and close
door frame, doorframe, door jamb, doorjamb, door post, lintel, threshold | structure | large heavy rigid wood fixed |
    hang a door in
door handle, doorknob, door knob, handle, knob, door lock, drawer knob, cabinet knob, drawer handle | small fixture |
    small light rigid metal | open a door with
control knob, stove knob, oven knob, dial | small fixture | small light rigid plastic fixed | turn an appliance up or
    down
lock, padlock, deadbolt, combination lock, door bolt, door chain, cable lock, latch, window latch, hasp; bike lock |
    small fixture | small light rigid metal | lock something, keep thieves out, unlock with a key
key, keys, house key, car key, room key, key card, keycard | small object | tiny light rigid metal | unlock a door with
small fixture | | small light rigid fixed |
small object, gadget, trinket | | small light |
bell, hand bell, desk bell, concierge bell | small object | small light rigid metal noisy | ring for attention
window, window pane, glass window, skylight, window frame, bay window | structure | large heavy rigid glass
    transparent fixed | see outside through, let in daylight and fresh air, look at the weather through
window sill, windowsill, ledge | structure | large heavy rigid fixed | put plants on by the window
glass, pane, glass panel, sheet of glass, shower screen, shower glass | | rigid glass transparent fragile | see through
blinds, blind, window blinds, venetian blinds, venetian blind, roller blind, window shade, windowshade, shade, shades,
    shutter, mini-blind, horizontal blinds | window covering | large light firm plastic | keep the sun out, darken the
    room
curtain, curtains, drapes, drapery, valance, window valance, pelmet, window scarf | window covering | large light soft
    fabric | darken the room, keep neighbours from looking in
window covering, window cover | | large light | block light from a window
fireplace, hearth, fire pit, chimney, fire surround | structure | huge heavy rigid stone fixed | burn wood in, warm the
    room, keep warm by on a cold evening
fireplace tool, fireplace utensils; poker, fire poker; fire tongs; andirons; fire screen, fireguard; bellows; coal
    scuttle | tool | medium heavy rigid metal | tend the fire with
vent, air vent, ventilation grille, ceiling vent, duct, air duct, grille | small fixture | medium middling rigid metal
    fixed | let air flow into the room
outlet, electrical outlet, power outlet, wall socket, socket, plug socket, wall plug, floor outlet, receptacle, power
    point, power socket, electric socket | small fixture | small light rigid plastic fixed electric | plug in and power
    devices, charge a phone, plug a laptop or a lamp into
light switch, switch, wall switch, dimmer, power switch, switchboard, control panel, switch plate, light switch plate,
    wall plate, button panel, wall control | small fixture | small light rigid plastic fixed electric | turn the lights
    on or off, switch a lamp on and off
fuse box, fusebox, fuse panel, circuit breaker, breaker box, breaker panel, electrical panel, junction box, electric
    box, electrical box | small fixture | medium middling rigid metal fixed electric | switch the electricity off at,
    get the power back on at
meter, electricity meter, electric meter, gas meter, water meter, smart meter | measuring instrument, small fixture |
    small middling rigid fixed | read how much electricity or water was used
thermostat, temperature control, heating control, radiator valve | small fixture | small light rigid plastic fixed
    electric | set the room temperature, make a room warmer or cooler
alarm; smoke detector, smoke alarm, fire alarm, fire bell; sprinkler; carbon monoxide detector | small fixture | small
    light rigid plastic electric | warn of a fire, notice smoke or gas in the air
fire extinguisher; fire blanket | safety equipment | medium middling rigid metal | put out a fire, fight flames with
safety equipment | | rigid | stay safe in an emergency
lift; elevator, elevator car; escalator; ramp, wheelchair ramp | structure | huge heavy rigid metal | go up to another
    floor
light source, light, lighting | | electric | light up the room, see in the dark
lamp | light source | medium light rigid electric | read by in the evening, light a dark corner
floor lamp, standing lamp | lamp | large middling rigid electric | light up a corner of the room, read by in an
    armchair
light, light fixture; chandelier; fluorescent light; track light, spotlight; led light; downlight | light source |
    medium middling rigid glass fixed electric | brighten the whole room
lampshade, lamp shade | lamp | small light firm fabric | soften the light of a lamp
lamp part | light source | small light |
light bulb, bulb, lightbulb, fluorescent tube, light tube | light source | small light rigid glass fragile electric |
    replace a burnt-out light
candle, tealight, tea light, candlestick, hurricane candle, scented candle | light source | small light rigid wax |
    create a cosy atmosphere, burn for light in a power cut, make the room smell nice
lantern, candle lantern, oil lamp | light source | small light rigid glass metal | carry a light outside
flashlight, torch, headlamp | light source, tool | small light rigid | find your way in the dark, look under the bed
    with, see in a power cut with
flame, fire, campfire | light source | | keep warm by
textile, cloth, fabric, piece of cloth, rag | | light soft fabric | sew clothes or curtains from, wrap around
rug, carpet, mat, area rug, floor mat, doormat, bath mat, bathmat, carpeting, runner, sheepskin, play mat | textile |
    large middling soft fabric | walk on barefoot, cover the floor, wipe your feet on, warm a cold floor, sit on with a
    baby
pillow; bed pillow; throw pillow; bolster, headrest | bedding, cushion | medium light soft fabric | rest your head on,
    sleep on
cushion, throw pillow, seat cushion, back cushion, couch cushion, sofa cushion, floor cushion | textile | medium light
    soft fabric | put behind your back, pad a hard chair with
bedding, bed linen | textile | light soft fabric | sleep under or on
cover; blanket, throw, throw blanket, afghan; quilt; duvet, comforter, bedspread, coverlet, bed cover, eiderdown |
    bedding | medium light soft fabric | keep warm under, wrap yourself in, cover up with, stay cosy on a cold night
bed sheet, sheet, fitted sheet, linen, bed skirt, mattress protector, bed canopy; pillowcase | bedding | medium light
    soft fabric | cover a mattress with
mattress, air mattress, mattress topper, airbed, air bed, sleeping pad, sleeping mat | bedding | large heavy soft foam |
    sleep on, lie on
towel, bath towel, hand towel, beach towel, washcloth, dish towel, tea towel, dishcloth, dishrag, kitchen towel, face
    cloth | textile | small light soft fabric | dry yourself after a shower, dry your hands, wipe up a spill, dry your
    face with, wrap around yourself after a swim
tablecloth, table cloth, table runner, placemat, place mat, table mat | textile | medium light soft fabric | protect the
    table
coaster, drink coaster, beer mat; trivet, pot stand, hot pad | kitchenware | small light firm | put a hot or wet cup or
    pot down on, keep rings off the table, protect the table from a hot pot
wall textile; tapestry, wall hanging; flag, pennant; banner; bunting | textile, decoration | large light soft fabric |
    decorate a wall with
shelter; awning, canopy, sunshade; tarp, tarpaulin, dust sheet, drop cloth | textile | large light soft fabric
    waterproof | keep rain sun or dust off
bathroom fixture, plumbing fixture | | large heavy rigid ceramic fixed |
toilet, toilet bowl, toilet seat, urinal, lavatory, potty, toilet tank, toilet cistern | bathroom fixture | large heavy
    rigid ceramic | go to the bathroom
bidet | bathroom fixture | medium heavy rigid ceramic | wash yourself after the toilet
sink, washbasin, kitchen sink, bathroom sink, basin, wash basin, sink basin | bathroom fixture | medium heavy rigid
    ceramic | wash your hands in, wash the dishes in, get water from, rinse vegetables in, wash your face in, fill a
    glass with water from
faucet, tap, water tap, shower head, water faucet, faucet handle, shower tap, shower handle, shower dial, spigot, mixer
    tap | small fixture | small middling rigid metal | get running water from
bathtub, bath, tub, hot tub, jacuzzi, whirlpool, bathtub basin | bathroom fixture | huge heavy rigid ceramic | take a
    bath in, soak in
shower, shower cabin, shower stall, shower tray | bathroom fixture | large heavy rigid glass | take a shower, wash
    yourself, wash your hair in, take a shower in
shower curtain | window covering | large light soft plastic waterproof | stop water splashing on the bathroom floor
mirror, wall mirror, vanity mirror, bathroom mirror, hand mirror, hand glass, compact mirror, standing mirror |
    decoration | medium middling rigid glass fragile | look at yourself in, check your appearance, do your make-up in,
    shave or put on lipstick in front of
toiletry, toiletries, hygiene product, personal care product | | small light | look after your body
soap, bar of soap, hand soap, body wash, shower gel, soap bar, hand wash, face wash | toiletry, cleaning product | small
    light firm | wash your hands with, get clean, wash your face with
soap dispenser, hand sanitizer, sanitizer, hand sanitizer dispenser, hand sanitiser | toiletry | small light rigid
    plastic | clean your hands and kill germs with
bathroom accessory; soap dish, soap holder, soap tray; toothbrush holder, toothbrush cup, toothbrush mug; shower caddy,
    shower shelf, shower soap shelf | small fixture | small light rigid | keep soap and toothbrushes at hand
shampoo, conditioner, shampoo bottle | toiletry | small light liquid | wash your hair with
toothbrush, electric toothbrush | toiletry | small light rigid plastic | brush your teeth with, clean your teeth with
mouth care; toothpaste; mouthwash, gargle; dental floss, water flosser, interdental brush, tongue scraper; dentures,
    false teeth | toiletry | small light | clean your teeth with
skin product; lotion, cream, moisturizer, hand cream, face cream; lip balm, chapstick; bath salts, bubble bath, bath oil
    | cosmetics | small light | look after your skin, put on your face, look and smell good
makeup, make-up, lipstick, mascara, face powder, eyeliner, makeup brush; nail polish, nail varnish, nail polish remover
    | cosmetics | tiny light | put on your face, look and smell good
shaving cream, shaving foam | cosmetics | small light | shave with
hair gel, hair spray, hair product, hair dye, hair mask, hair oil | cosmetics | small light | style your hair with, look
    and smell good
fragrance; perfume, cologne, atomizer; deodorant, antiperspirant; aftershave | cosmetics | small light | look and smell
    good
sunscreen, sun cream, sun lotion | cosmetics | small light | protect your skin from the sun, avoid a sunburn
razor, shaver, electric shaver, razor blade, razorblade, hair clippers, beard trimmer | toiletry | small light sharp |
    shave with, shave your beard with
hairbrush, comb, hair brush | toiletry | small light rigid plastic | brush your hair with
hair dryer, hairdryer, blow dryer, hair drier | toiletry, appliance | small light rigid plastic electric noisy | dry
    your hair with
hair accessory; hair tie; hairpin, bobby pin; hair clip, barrette; hair curlers, hair rollers; wig; shower cap, hairnet,
    hair net | toiletry | tiny light | tie back your hair
toilet paper, toilet roll, toilet paper roll, toilet tissue, loo roll | paper product | small light soft paper | use in
    the bathroom
toilet paper holder, toilet roll holder, toilet paper hanger, toilet paper dispenser, toilet paper stand, seat cover
    dispenser | small fixture | small light rigid metal | hang the toilet paper on
tissue, tissue box, tissues, kleenex, box of tissues, box of kleenex, napkin, napkins, tissue roll, tissue paper, facial
    tissue, tissue holder, facial tissue holder, serviette | paper product | small light soft paper | blow your nose
    with, wipe your mouth with, clean up a small spill with
paper towel, paper towels, kitchen roll, paper towel roll | paper product | small light soft paper | wipe up a spill,
    dry your hands
paper towel dispenser, towel dispenser, hand dryer, paper towel holder, kitchen roll holder | small fixture | medium
    middling rigid plastic | dry your hands after washing
paper product | | light paper |
scale, bathroom scale, kitchen scale, weighing scale | measuring instrument | medium middling rigid | weigh yourself or
    things on, check your weight on, weigh flour or a parcel on
cleaning product, cleaning supply, cleaning supplies, detergent, cleaner, bleach, disinfectant, laundry detergent,
    cleaning spray, cleanser, bleach cleanser, cleansing agent, washing powder, limescale remover, furniture polish,
    floor polish | | small light liquid | clean things with, remove stains, clean the bathroom with
sweeping tool; broom, whisk broom; brush, scrub brush; dustpan, dust pan | cleaning tool | medium light rigid | sweep
    the floor with, sweep up crumbs and dust
mop | cleaning tool | medium light | mop the floor with
sponge, scrubber, scouring pad | cleaning tool | small light soft foam | wash the dishes with, scrub with, wipe the
    table with, clean a spill with, clean the bathroom with
vacuum cleaner, vacuum, hoover, robot vacuum, roomba, shop vac, wet dry vac, carpet cleaner, steam cleaner, floor
    polisher, floor scrubber | cleaning tool, appliance | medium middling rigid plastic electric noisy | clean the
    carpet with, suck up dust, get crumbs off the floor
cleaning tool | tool | | clean up a mess with
pest control; insect repellent, bug spray, mosquito spray, pest spray; fly swatter; mouse trap; ant trap, fly paper;
    mosquito net | | small light | get rid of flies and mice with, keep mosquitoes away
bucket, pail, mop bucket, cleaning bucket, diaper pail | container | medium light rigid plastic | carry water in, mop
    with, collect a leak in
container, receptacle, vessel | | | keep things in, put things in
trash can, trashcan, garbage can, waste bin, wastebasket, waste basket, waste paper basket, wastepaper basket, rubbish
    bin, dustbin, trash bin, bin, garbage bin, litter bin, dumpster, wastepaper bin, ashcan, pedal bin, wheelie bin,
    waste container, nappy bin | container | medium light rigid plastic | throw away rubbish and waste paper, put
    garbage in, throw away a wrapper or food scraps in, get rid of a used tissue in
recycling bin, recycle bin, recycling container | trash can | medium light rigid plastic | recycle bottles and paper
    in, get rid of empty bottles in
trash bag, garbage bag, plastic bag, paper bag, shopping bag, grocery bag, bin bag, bin liner, carrier bag, poop bag |
    bag | small light soft plastic | carry shopping in, put rubbish in
box, storage box, crate, shoebox, hatbox; cardboard box, carton; package, parcel; plastic box, storage bin, tote,
    storage organizer, drawer organizer, storage container; gift box | container | medium light rigid cardboard | pack
    and store things in, move house with, ship things in
wooden box, jewelry box, chest box, jewellery box, watch box | box | small light rigid wood | keep jewelry and small
    treasures in
basket, wicker basket, picnic basket, shopping basket, log basket, firewood holder | container | medium light firm |
    carry things in, store odds and ends in
laundry basket, laundry hamper, hamper, laundry bag, clothes hamper, clothing hamper, linen basket, wash basket, laundry
    hamper lid | container | medium light firm | collect dirty clothes in, carry the washing in, store clothes in
barrel, keg, drum barrel, cask, oil drum | container | large heavy rigid wood | store liquid in
tank, gas cylinder, water tank, propane tank, gas bottle, oxygen tank | container | large heavy rigid metal | store
    water or gas in
bag, sack; pouch, drawstring bag; duffel bag, gym bag, sports bag; tote bag; messenger bag, satchel, saddlebag; leather
    bag | container | medium light soft fabric | carry your belongings in, carry books or shopping in
backpack, rucksack, knapsack, school bag | bag | medium light soft fabric | carry on your back, carry books and a
    laptop to school, take on a hike
handbag, purse, shoulder bag, clutch, clutch bag, evening bag, wristlet | bag | small light soft leather | carry your
    wallet and phone in
suitcase, luggage, trolley case, briefcase, travel bag, attache case, carry-on, luggage and bags | container | medium
    middling rigid | pack clothes in for a trip, travel with, pack for a holiday
wallet, billfold, coin purse, card holder, card case, business card holder | small object | tiny light leather | keep
    money and cards in
pencil case, pencil pouch, pen case, pencil box | container | small light soft fabric | keep pens in
pen holder, pencil holder, pencil cup, pen cup, pen stand, desk tidy, desk caddy | container | small light rigid | keep
    pens in
umbrella, parasol | accessory | medium light waterproof | stay dry in the rain, keep off the sun, protect yourself from
    rain or sun
kitchenware | | small rigid |
dish, dishes, dishware, crockery, tableware, chinaware | kitchenware | small light rigid ceramic fragile | eat from,
    serve food on
plate, dinner plate, glass plate, saucer; platter, cake stand, lazy susan; tray, serving tray | dish | small light rigid
    ceramic fragile | serve food on, eat from at dinner
bowl, salad bowl, mixing bowl, soup bowl, fruit bowl | dish, container | small light rigid ceramic fragile | eat soup
    or cereal from, mix ingredients in, serve a salad in
cup, teacup, coffee cup, tea cup, paper cup, plastic cup | dish, drinking vessel | small light rigid ceramic | drink
    tea or coffee from
mug, coffee mug; travel mug; tumbler | cup | small light rigid ceramic | drink something hot from
drinking vessel | container | small light rigid | drink from
drinking glass, wine glass, glass cup, beer glass, champagne glass, goblet, water glass, glass, shot glass, champagne
    flute, flute glass, stemware, chalice, cocktail glass | drinking vessel | small light rigid glass transparent
    fragile | drink water or wine from, serve drinks to guests in
water bottle, sports bottle, protein shaker, shaker bottle; canteen | drinking vessel | small light rigid plastic | take
    water along, stay hydrated, drink from on the way
thermos, flask, thermos bottle, vacuum flask | drinking vessel | small light rigid metal | keep a drink hot in, take a
    hot drink along in, stay hydrated
bottle, glass bottle, squeeze bottle; plastic bottle; wine bottle; spray bottle | container | small light rigid | keep
    liquid in
jar, glass jar, mason jar, canister, tin | container | small light rigid glass | store food in, keep cookies in
jug, pitcher, carafe, decanter, urn, cream pitcher, gravy boat | container | small light rigid ceramic | pour water from
teapot, tea pot; kettle, tea kettle, electric kettle, water boiler | kitchenware, appliance | small light rigid metal |
    boil water with, heat water for tea, make tea with
can, tin can, aluminum can, aerosol can, spray can | container | small light rigid metal | keep drinks or food in
cutlery, silverware, utensil, utensils, kitchen utensil | kitchenware | small light rigid metal | eat with
eating utensil; fork, spork; spoon, teaspoon, wooden spoon, soupspoon, tablespoon; chopsticks; ladle; spatula, fish
    slice; whisk, eggbeater, egg beater; tongs; skewer; toothpick, cocktail stick | cutlery | small light rigid metal |
    eat or stir food with, stir a pot with, eat soup with
knife; kitchen knife, chef knife, cleaver, carving knife; bread knife; steak knife; table knife, butter knife | cutlery,
    tool | small light rigid metal sharp | cut food with, slice bread with, chop vegetables with, peel potatoes with
cutting board, chopping board | kitchenware | small light rigid wood | cut vegetables on, chop onions on
cookware | kitchenware | small middling rigid metal | cook with
lid, pot lid, pan lid, skillet lid; bottle cap, bottle top; cork, stopper | kitchenware | small light rigid | close a
    pot a jar or a bottle with
pan, frying pan, skillet, griddle; wok; saucepan; pot, cooking pot, stockpot; baking tray; casserole, dutch oven |
    cookware | small middling rigid metal | fry eggs in, cook soup in, fry bacon in, boil an egg in
opener; bottle opener; can opener; corkscrew | kitchenware, tool | small light rigid metal | open a bottle or can
    with, open a bottle of beer or wine with
food storage container, lunch box, lunchbox, tupperware, food container | container | small light rigid plastic | keep
    leftovers in, take lunch along, keep food fresh in
appliance, kitchen appliance, household appliance | device | rigid electric |
device, electronic device, machine, electronics | | rigid electric |
refrigerator, freezer, mini fridge, icebox, cooler, ice box, minibar, mini bar, cool box, cooler box, cold storage, ice
    maker | appliance | large heavy rigid metal cold | keep food and drinks cold, keep milk and leftovers fresh, chill a
    bottle, store groceries that spoil
cooking appliance; oven; stove, cooker, range, stovetop, cooktop, hob, burner, stove burner, gas stove, hot plate,
    hotplate; grill, barbecue, bbq, smoker, bbq grill | appliance | large heavy rigid metal hot | bake or cook food
    with, fry an egg on, boil pasta on, bake bread or a cake in, roast meat in
microwave, microwave oven | appliance | medium middling rigid metal | heat up food quickly, reheat leftovers, warm up
    lunch in, make popcorn in
dishwasher | appliance | large heavy rigid metal | wash dishes in
laundry machine; washing machine, washer; clothes dryer, dryer, tumble dryer, washer dryer | appliance | large heavy
    rigid metal noisy | wash or dry clothes in, get stains out of clothes in
toaster, toaster oven, sandwich maker, panini press | appliance | small light rigid metal | toast bread in
coffee machine, coffee maker, espresso machine, coffeemaker; coffee grinder | appliance | medium middling rigid | make
    coffee with, brew coffee with
kitchen machine; blender; mixer; food processor; juicer; milk frother; meat grinder, mincer; soda maker; ice cream
    maker; pasta maker | appliance | small middling rigid noisy | make a smoothie with, mix ingredients with, chop nuts,
    mix dough with
countertop cooker; rice cooker; slow cooker, crock pot, sous vide; air fryer; pressure cooker; waffle maker, waffle
    iron; bread maker, bread machine; deep fryer; popcorn machine, popcorn maker | appliance | medium middling rigid |
    cook rice or a meal in
range hood, extractor hood, kitchen hood, exhaust fan, hood, cooker hood, exhaust hood, vent hood, stove hood, stove
    fan, oven vent, kitchen extractor | appliance | large heavy rigid metal | remove cooking smells
water cooler, water dispenser, water fountain, drinking fountain | appliance | large heavy rigid plastic | get
    drinking water from, fill a bottle or a glass with water at
vending machine | appliance | huge heavy rigid metal | buy snacks and drinks from
iron, steam iron | appliance | small middling rigid metal hot | take the wrinkles out of clothes, press a shirt with
ironing board, iron board | furniture | large middling firm | iron clothes on
sewing machine | appliance, tool | medium heavy rigid metal | sew clothes with, make or mend clothes with
fan, electric fan, ceiling fan, desk fan, standing fan, tower fan, pedestal fan, mechanical fan | appliance | medium
    light rigid plastic | cool down on a hot day, move the air, cool a room on a hot day, dry paint
computer cooler, cooling fan; computer fan; heat sink, heatsink; cpu cooler | computer part | small light rigid
    plastic metal | keep a processor cool, cool electronics
air conditioner, air conditioning unit, ac unit, air con | appliance | large heavy rigid | cool the room, make a hot
    room cooler
heater, radiator, space heater, electric heater, furnace, gas furnace, wood burner, wood stove, sauna heater, sauna
    stove | appliance | medium heavy rigid metal hot | warm the room, keep warm in winter by
air treatment appliance; humidifier; dehumidifier; air purifier; diffuser | appliance | medium light rigid plastic |
    clean or moisten the air
television, tv, tv set, television set, tv screen, flat screen, smart tv, flat screen tv, television receiver | screen |
    large heavy rigid electric | watch news and movies on, watch shows and sports on, pass the time with
screen, display, monitor, computer monitor, display screen, computer screen, lcd screen, led screen, touch screen |
    device | large middling rigid glass electric | watch videos and news on, show a presentation on, work on two
    documents side by side
projector, overhead projector, projector screen, projection screen | device | medium light rigid electric | show
    slides or movies on a wall, show a film to many people
computer, desktop computer, pc, computer tower, desktop, server, workstation computer, imac, computer case, pc tower |
    device | medium heavy rigid electric | browse the web, write programs with, play games on, write a report on
laptop, notebook computer, macbook, laptop computer, chromebook | computer | small light rigid electric portable |
    work on while travelling, write emails on
tablet, ipad, tablet computer, e-reader, kindle | device | small light rigid electric portable | read and watch videos
    on, browse the web
phone, smartphone, mobile phone, cell phone, cellphone, telephone, iphone, landline phone, desk phone, handset,
    landline, corded phone, cordless phone, cellular telephone, wall phone, payphone, answering machine | device | small
    light rigid electric | call someone with, send messages, take pictures, check the time on, talk to your family far
    away, look something up, film a video with
keyboard, computer keyboard | computer part | small light rigid plastic electric | type text with
computer mouse, mouse, trackpad | computer part | small light rigid plastic | move the cursor with
computer part, computer component, computer hardware, electronic component, electronic part, computer equipment | |
    small light rigid electric | build or upgrade a computer with, learn about the parts of a computer
circuit board, motherboard, mainboard, printed circuit board; arduino, microcontroller, raspberry pi; breadboard;
    chip, processor, cpu; gpu, graphics card, video card; memory module, ram | computer part | small light rigid
    fragile electric | learn electronics with, build a computer, explain how a computer works
data storage; hard drive, hard disk, ssd, disk drive; usb stick, usb drive, flash drive, memory stick, thumb drive;
    memory card, sd card; cd, cd case; dvd, dvd case; floppy disk, computer disk | computer part | small light rigid |
    save files on
printer, laser printer; scanner; copier, photocopier; fax machine, fax | device | medium heavy rigid plastic | print
    documents with, make copies, scan a document with
typewriter | device | medium heavy rigid metal | type letters on
router, modem, wifi router, access point, network switch, wi-fi router | device | small light rigid plastic | connect
    to the internet, get wifi from
voice assistant, smart speaker, alexa, google home, amazon echo | speaker | small light rigid | ask questions and
    control the house by voice, play music
speaker, loudspeaker, speakers, sound bar, soundbar, subwoofer, bluetooth speaker | device | medium middling rigid
    noisy | listen to music, play sound, play music for a party
headphones, earphones, earbuds, headset, ear muffs, earplugs, earphone, headphone, ear plugs, ear buds | accessory,
    device | small light | listen to music without disturbing others, block out noise so that you can concentrate,
    listen to a podcast with on a train
microphone, mic; megaphone, bullhorn; voice recorder, tape recorder | device | small light rigid | record your voice,
    speak to an audience, sing into, record a podcast with
radio, radio receiver, cassette player, cassette deck; stereo, stereo system, sound system; record player, turntable,
    phonograph; boombox; cd player | device | medium middling rigid noisy | listen to music and the news, pass the time
    with
camera, webcam, security camera, video camera, gopro, depth camera, digital camera, camcorder, camera lens, telephoto
    lens | device | small light rigid | take photos or videos with, take a picture of friends with, film a party with
tripod | tool | medium light rigid metal | hold a camera steady
remote control, remote, tv remote, controller | device | small light rigid plastic | change the channel with, turn the
    television on with
game console, playstation, xbox, nintendo, video game, console system; game controller, gamepad, joystick; arcade game,
    arcade machine; pinball machine; slot machine | device, toy | small light rigid plastic | play video games with,
    pass the time with
vr headset, virtual reality headset | device | small light rigid plastic | play in virtual reality
power supply; charger, phone charger, charging station, charging dock, wireless charger, ipod dock; power bank; power
    adapter, adapter, plug | device | small light rigid plastic electric | charge a phone with
cable, cord, wire, wires, cables, power cord, power cable, usb cable | | small light electric | connect or power devices
    with
power distribution; extension cord, extension lead, extension cable; power strip, surge protector | cable | small light
    electric | plug in several devices at once, plug in a lamp or a laptop far from an outlet
battery, batteries, battery pack | | small light rigid electric | power a gadget with
calculator | office supply | small light rigid plastic | do sums with
robot, mobile robot; robot arm, robotic arm; drone, quadcopter | device | medium heavy rigid | automate work, fly or
    drive around by remote control, help with chores
clock, wall clock; desk clock; grandfather clock; digital clock | device | small light rigid | see what time it is,
    know the hour
watch, wristwatch, smartwatch, wrist watch, pocket watch | accessory | tiny light rigid | see what time it is, wear on
    your wrist
timer, kitchen timer, oven timer, egg timer; hourglass; stopwatch | device | small light rigid | measure how long
    something takes
calendar; planner; diary | stationery | small light paper | know the date, plan appointments
document | | small light paper | read
receipt, invoice, bill; menu; business card; wall chart, chart, diagram | document | tiny light soft paper | look up
    prices or names on
book, books, hardcover book, stack of books, hardback book, paperback book, phone book, colouring book, coloring book;
    novel; paperback; textbook; dictionary; encyclopedia; manual; cookbook; comic book; photo album, album; bible |
    document | small light firm paper | read, learn from, study, pass the time with
math book, science book | book | small light firm paper | study mathematics or science
periodical; magazine; newspaper; brochure, leaflet, pamphlet, booklet; catalog; comic; journal | document | small light
    soft paper | read the news, read for fun, leaf through, pass the time with
notebook, notepad, notepads, journal book, writing pad, memo pad; sketchbook, sketch pad; sticky notes, sticky note,
    post-it; index card, flash card | stationery | small light soft paper | write notes in, draw or explain something
    on, make a shopping list in, keep a diary in
paper, sheet of paper, printer paper, papers, piece of paper, document page, note, letter, paper sheet, construction
    paper | stationery | small light soft paper | write or print on, draw or explain something on, make a shopping
    list on, fold a plane from
mail; envelope; postcard; stamp; greeting card, card | stationery | small light paper | send a letter
folder, file folder; binder, ring binder; clipboard | stationery | small light firm | keep papers together
stationery, office supply, office supplies | | small light |
pen, ballpoint pen, fountain pen; marker, felt tip pen, sharpie, whiteboard marker, dry erase marker; highlighter;
    stylus | stationery | tiny light rigid plastic | write with, draw with, explain something on a board, sign a
    contract with, take notes with
pencil, pencils, colored pencil; crayon, crayons; chalk | stationery | tiny light rigid wood | draw with, write with,
    sketch a picture with, colour in a drawing
eraser, whiteboard eraser, rubber eraser | stationery | tiny light soft rubber | rub out mistakes, erase pencil marks
sharpener; pencil sharpener; knife sharpener, sharpening steel, whetstone | tool | tiny light rigid | sharpen a blunt
    pencil or knife with, make a blade sharp again
correction fluid, correction tape, white-out | stationery | tiny light | cover up writing mistakes
length measure; ruler, measuring stick, yardstick; tape measure, measuring tape; protractor; caliper; set square |
    measuring instrument, stationery | small light rigid | measure a length with, draw straight lines, find out how long
    something is
measuring instrument | tool | |
cutting tool; scissors, shears, kitchen shears; paper cutter; box cutter, utility knife, craft knife, cutter; letter
    opener, paper knife | stationery, tool | small light rigid metal sharp | cut paper or cloth with, open a package
    with, cut hair with, cut out shapes, trim string
paper fastener; stapler, staple gun; hole punch; staples; staple remover | stationery, fastener | small light rigid
    metal | fasten papers together, staple papers with
clip, bulldog clip; paper clip, paperclip, binder clip; clothespin, clothes peg, clothes pegs; thumbtack, push pin;
    magnet, fridge magnet | stationery, fastener | tiny light rigid metal | hold papers or cloth together for a while,
    close a bag of chips with
fastener | | tiny light | fasten or hold things together
sewing supply; safety pin, pin; brooch; needle and thread, sewing kit, sewing needle, needle, sewing box; thread;
    button; velcro; zipper; pin cushion, pincushion; thimble; bobbin, spool; embroidery hoop | fastener | tiny light
    metal | mend clothes, hold torn clothing together for a while, sew on a button, repair a hole in a sleeve or a sock
knitting needle, knitting needles, crochet hook | tool | small light rigid | knit or crochet with
tape, adhesive tape, sticky tape, tape dispenser, hazard tape; duct tape; masking tape; scotch tape; packing tape;
    electrical tape | fastener, stationery | small light | stick things together, seal a box, repair something quickly,
    mend a tear for now, hang a poster on the wall with, wrap a present with
glue, glue stick, super glue, adhesive; hot glue gun, glue gun | fastener, stationery | small light liquid | stick
    things together, repair something broken, mend a broken cup with
string, twine; rope; cable tie, zip tie, zip ties; rubber band, elastic band, elastic; bungee cord; shoelace; ribbon;
    strap | fastener | small light | tie things together, hold a bundle together, hang something up with, tie up a
    parcel with
yarn, wool, ball of yarn | fastener, textile | small light soft | knit a sweater with, tie things together
chain, metal chain | fastener | medium heavy metal | lock up a bicycle with
hardware; screw, screws; nail, nails; bolt, bolts; nut, nuts and bolts, metal washer | fastener | tiny light rigid metal
    | join wood or metal, put up a shelf, hang a picture on the wall with
writing board; whiteboard, dry erase board, smart board, interactive whiteboard, white board; chalkboard, blackboard;
    flip chart; bulletin board, cork board, notice board, pinboard | board | large heavy rigid | write or draw on in
    class, explain ideas to a group
board, plank, wooden board, panel | | large middling rigid wood |
sign, street sign, exit sign, signage, placard, name plate, nameplate, plaque, warning sign, scoreboard, billboard;
    label, sticker, price tag, tag; name tag, name badge, id badge, visitor badge, badge, lanyard | decoration | small
    light rigid | read directions from
map, world map; globe; atlas | document | small light | learn geography with, find places on, plan a trip with
teaching aid; skeleton model, anatomical model, skeleton; molecule model; abacus; periodic table | | medium light rigid
    | teach a lesson with, explain science with
tool, hand tool, tools | | small light rigid metal | repair things
hammer, mallet, sledgehammer | tool | small middling rigid metal | drive in nails, hammer a nail in with, hang a picture
    with nails, break something open
screwdriver, allen key, hex key, screwdriver set, screw driver, torx screwdriver | tool | small light rigid metal |
    turn screws, take devices apart, open up electronics, tighten a screw with, put furniture together with
gripping tool; wrench, spanner, socket wrench, lug wrench, tire iron; pliers, pincers; wire cutter; vise; clamp | tool |
    small middling rigid metal | tighten nuts and bolts, grip things, loosen a bolt with, pull out a nail with, bend
    wire with
drill, power drill, electric drill, cordless drill | tool | small middling rigid electric noisy | drill holes, make a
    hole in a wall with, drill a hole in wood or a wall
saw, hacksaw, circular saw, handsaw; chainsaw; axe, hatchet, ax | tool | medium middling rigid metal sharp | cut wood,
    cut down a tree with, saw a plank with, cut branches with
electronics tool; multimeter, voltmeter; oscilloscope | tool, measuring instrument | small light rigid electric | repair
    or test electronics
wire stripper, crimping tool | electronics tool | small light rigid metal | strip and join wires with
soldering iron, soldering station | electronics tool | small light rigid electric hot | solder wires with
woodworking tool; plane; chisel; file tool; planer; scraper, putty knife | tool | small light rigid | work with wood
sandpaper, sanding block | woodworking tool | small light | sand wood smooth with
level, spirit level | woodworking tool, measuring instrument | small light rigid | check if a shelf is level or straight
    with
painting supplies; paint, spray paint, paint can, paint bucket; paintbrush; paint roller | tool | small light | paint
    a wall or picture with
toolbox, tool box, tool kit, toolkit, tool chest, tool bag, tool set | container, tool | medium heavy rigid | keep tools
    in, repair things around the house
ladder, stepladder, step ladder | tool | large middling rigid metal | reach high places, climb up to change a light
    bulb, stand on to reach a high shelf
flashlight holder | small object | small light rigid |
machine tool; 3d printer; laser cutter; lathe; milling machine; drill press; table saw, band saw; bench grinder; welder,
    welding machine | device, tool | large heavy rigid | make parts and prototypes with
optical instrument; microscope; telescope; binoculars; magnifying glass | measuring instrument | small middling rigid
    fragile | look at tiny or distant things through
laboratory glassware; beaker, erlenmeyer flask, graduated cylinder; test tube; petri dish; pipette; microscope slide |
    container | small light rigid glass transparent fragile | do chemistry experiments with
garden tool; hoe; pitchfork, garden fork | tool | medium middling rigid metal | dig in the garden with, dig a hole with,
    plant flowers with
shovel, spade, trowel, snow shovel | garden tool | medium middling rigid metal | dig in the garden with, dig a hole
    with, shovel snow with
rake, leaf rake | garden tool | medium middling rigid metal | rake leaves with
hose, garden hose, watering can, sprinkler hose, hose reel | garden equipment | medium light | water the plants with,
    wash the car with
garden equipment | | medium |
garden machine; leaf blower; log splitter; snow blower | garden equipment | large heavy rigid metal | work in the garden
wheelbarrow, barrow | garden machine, cart | large heavy rigid metal | carry soil and stones in
hedge trimmer, brush cutter, hedge cutter | garden machine | medium heavy rigid metal sharp | trim a hedge with, cut
    branches with
lawn mower, lawnmower, strimmer, weed whacker | garden machine | large heavy rigid metal noisy | mow the lawn with, cut
    the grass with
cart, trolley, shopping cart, hand truck, dolly, pushcart, utility cart, sack truck, roll cage, shopping trolley |
    vehicle | large heavy rigid metal | move heavy things around with, carry heavy boxes on
barrier; fence; hedge; traffic cone, cone; turnstile; stanchion, bollard | structure | large middling rigid | keep
    people out
plumbing; pipe, tube, conduit; hose pipe; valve, stopcock; pump; boiler, water heater; drain, floor drain, gutter; water
    softener | machinery | medium heavy rigid metal fixed | carry water or gas
machinery, industrial machine; engine; motor; generator; conveyor belt, conveyor; compressor | device | huge heavy rigid
    metal | power a factory
warehouse equipment; pallet; forklift; pallet jack | vehicle | large heavy rigid wood | move goods in a warehouse
plant; potted plant, houseplant, house plant, indoor plant; succulent; cactus; fern; bonsai; palm; ivy; monstera |
    decoration, living thing | medium middling green | bring some nature indoors, water and care for
flower, flowers, bouquet, flower arrangement, bunch of branches, branches, flower bed; rose; tulip; orchid; sunflower |
    plant, decoration | small light fragile | give as a romantic present, decorate a table with
tree; christmas tree; bush, shrub, shrubbery | plant | huge heavy rigid green | give shade, decorate at Christmas
living thing | | |
flower pot, flowerpot, plant pot, planter, ceramic pot, planter box, window box, flower box | container | small middling
    rigid ceramic | grow plants in
vase, flower vase, ceramic vase | decoration, container | small light rigid ceramic fragile | put flowers in
decoration, ornament, decor, decorative object, knick-knack | | small | decorate a room with
art, artwork | decoration | medium light | look at for its beauty
picture, framed picture, wall art, framed print; painting, canvas; drawing; print, photo print; poster; illustration;
    mural | art | medium light firm | decorate a wall with, hang on a wall
photograph, photography, framed photo, portrait, polaroid | art | medium light firm paper | remember people and places
    by
picture frame, frame, photo frame | decoration | small light rigid wood | display a photo in
sculpture, statue, bust; figurine, statuette | art | small heavy rigid stone | decorate a shelf with
award; trophy; medal; certificate | decoration | small light rigid | celebrate a win
small decoration; globe ornament, snow globe; crystal, gemstone; seashell, conch shell; wreath; dreamcatcher;
    centerpiece, centrepiece; pinecone; wind chime; crucifix; pottery | decoration | small light | decorate a room with
party decoration; balloon, balloons; party hat; confetti; streamer | decoration | small light soft | celebrate a
    birthday
toy, toys, plaything; rocking horse, hobby horse; marbles; rattle; slinky | | small light | play with, have fun with,
    keep a child busy, amuse a toddler, pass the time with
stuffed animal, teddy bear, plush toy, soft toy, plushie, stuffed toy, stuffed bear | toy | small light soft fabric |
    cuddle, comfort a child, hug
doll, action figure, puppet, barbie | toy | small light | play pretend with
toy vehicle; toy car, model car, remote control car; toy train, train set; toy truck; toy airplane | toy | small light
    rigid plastic | push around and race
building blocks, lego, lego set, blocks, wooden blocks, lego duplo, wood block | toy, puzzle game | small light rigid
    plastic | build little houses
puzzle, brain teaser; rubik's cube, puzzle cube; jigsaw puzzle, jigsaw; puzzle box | toy, puzzle game | small light
    rigid colorful | solve in your spare time, keep your mind busy with
puzzle game | game | |
game, board game, game board, gameboard; chess, chess set, chess board, chessboard; card game, playing cards, deck of
    cards, poker chip; dice; checkers, checkerboard; monopoly | toy | small light | play with friends, spend an evening
    with, play at a party, compete with family
outdoor toy; yo-yo; spinning top; kite; frisbee; slingshot; fidget spinner; bubble wand; juggling balls; water gun, toy
    gun; pinwheel | toy | small light | have fun with outside
toy house, dollhouse, model house, playhouse | toy | small light rigid | play house with
sports equipment, sporting goods, sport equipment | | | play sports, exercise
ball, beach ball; soccer ball; football, rugby ball; tennis ball; volleyball; baseball; golf ball; exercise ball, gym
    ball, balance ball | sports equipment, toy | small light firm rubber round | throw, kick or catch, play a team sport
    with, exercise or play with in the park
basketball, basketball ball | ball | small light firm rubber round orange | shoot hoops, dribble and score baskets with
bat or racket; racket, tennis racket, badminton racket; baseball bat, cricket bat; hockey stick; golf club; ping pong
    paddle, table tennis paddle; pool cue, pool stick, cue stick; lacrosse stick | sports equipment | medium light rigid
    | hit a ball with
game table; table tennis table, ping pong table, tennis table, table tennis; pool table, billiard table; foosball table,
    foosball; air hockey table | game, table | huge heavy rigid | play table tennis or pool on
weights, weight, free weights; dumbbell, dumbbells; barbell, weight plate; kettlebell | exercise equipment | small
    heavy rigid metal | lift to build muscles, train your arms with
exercise equipment, gym equipment, fitness equipment | sports equipment | | work out, get fit, stay in shape
cardio equipment; jump rope, skipping rope; resistance band, exercise band; ab roller; pull-up bar, pull up bar, chin-up
    bar; hula hoop | exercise equipment | small light rubber | do cardio or stretch your muscles
floor exercise equipment; yoga mat, exercise mat, gym mat; yoga block; foam roller | exercise equipment, rug | medium
    light soft foam | do yoga and stretch on
exercise machine; treadmill; exercise bike, stationary bike, stationary bicycle, workout bike, spin bike; elliptical;
    rowing machine, indoor rower; weight bench, training bench, bench press; squat rack, power rack; cable machine,
    smith machine; stair climber | exercise equipment, machinery | huge heavy rigid | run or cycle indoors
bicycle, bike, mountain bike, e-bike; tricycle | vehicle, sports equipment | large middling rigid metal | ride to
    work, ride around town, get some exercise
board or skates; skateboard, longboard; scooter; roller skates, skates, rollerblades; ice skates; ski, skis, ski pole;
    snowboard; surfboard, surf board, paddle board, wakeboard, body board; sled; unicycle; segway | sports equipment |
    medium light rigid | glide or roll along on, ride down the street on
helmet, hard hat, bike helmet, safety helmet | headwear, safety equipment | small light rigid plastic | protect your
    head
training equipment; boxing gloves; punching bag, boxing bag, speed bag; goal; net, tennis net; hoop, basketball hoop,
    basketball backboard; baseball glove, baseball mitt; balance board; gymnastics equipment, parallel bars, horizontal
    bar, balance beam, pommel horse, vaulting horse; boxing ring; archery target; exercise step, aerobic step | sports
    equipment | medium | train with
camping gear; tent; sleeping bag; hammock | camping equipment | medium light soft fabric | camp or sleep outdoors with,
    spend a night in the woods in
camping equipment, outdoor gear, hiking equipment | sports equipment | |
musical instrument, instrument | | | make music, play a song on, pass the time with
string instrument; guitar, acoustic guitar, electric guitar, bass guitar; ukulele; banjo; violin; cello; harp | musical
    instrument | medium light rigid wood fragile | strum and play songs on, play a song on, accompany singing with
keyboard instrument; piano, grand piano, keyboard piano, musical keyboard, digital piano; organ; synthesizer; accordion,
    harmonium; harpsichord | musical instrument | huge heavy rigid wood | play a melody on, play a tune on
percussion instrument; drum, drum kit, drums; tambourine; xylophone; cymbal; maracas; cowbell | musical instrument |
    medium middling rigid noisy | beat a rhythm on, make a lot of noise with
wind instrument; flute; trumpet; saxophone; harmonica; recorder; clarinet; whistle; trombone; bagpipe; oboe; french
    horn; tuba; cornet | musical instrument | small light rigid metal noisy | blow a tune on, play a tune on
clothing, clothes, garment, apparel, clothing item, outfit | textile | small light soft fabric | wear, get dressed in
top | clothing | small light soft fabric |
shirt, blouse, polo shirt, dress shirt, button-up shirt, button-down shirt | top | small light soft fabric | wear to
    work
t-shirt, tee shirt, tank top, tee, jersey, tshirt | top | small light soft fabric casual | wear in summer, wear
    casually
sweater, pullover, jumper; hoodie, sweatshirt; cardigan; fleece | top | small light soft fabric warm | stay warm in,
    wear on a chilly day
outerwear | clothing | medium light soft fabric warm | go outside in when it is cold
jacket, coat, overcoat; winter coat, winter jacket, parka, down jacket, puffer jacket; leather jacket; windbreaker |
    outerwear | medium light soft fabric warm waterproof | keep warm in winter, protect yourself from wind rain and
    snow
rain gear; raincoat, rain jacket, rain poncho, poncho; rain boots, wellies | outerwear | medium light soft waterproof |
    stay dry in the rain, protect yourself from the rain
legwear; pants, trousers; jeans; shorts; leggings; sweatpants; skirt, kilt, miniskirt | clothing | small light soft
    fabric | wear on your legs
full-length clothing; dress, gown; costume; robe, bathrobe; kimono; pajamas, nightgown, nightshirt; apron; lab coat;
    cape, cloak | clothing | small light soft fabric | dress up in
suit, tuxedo, blazer, suit jacket, tux, dress suit | clothing | medium light soft fabric formal | wear to a wedding or a
    job interview
underwear, bra, brassiere, underdrawers, underpants, panties, corset; socks, sock; tights, stockings, pantyhose |
    clothing | small light soft fabric | wear under your clothes
swimwear; swimsuit, bikini, swimming trunks; swim goggles, goggles | clothing | small light soft | go swimming in
footwear | clothing | small light firm | wear on your feet, walk in
shoes, shoe, pair of shoes | footwear | small light firm | walk in
sneakers, sneaker, running shoes, trainers, tennis shoes, athletic shoes, sports shoes, basketball shoes | shoes |
    small light firm casual | run in, do sports in
dress shoes, high heels, oxfords, loafers, heels, leather shoes, formal shoes, court shoes | shoes | small light firm
    leather formal | wear with a suit, wear to a wedding or a formal dinner
boots, boot, hiking boots, rubber boots, snow boots, winter boots, work boots, cowboy boots | shoes | small middling
    firm leather waterproof warm | hike in mud and snow in
light shoes; sandals, sandal, flip-flops, flip flops; slippers, slipper; slides; clogs, crocs | shoes | small light
    soft casual | wear at the beach, wear around the house
headwear | accessory | small light | wear on your head
hat, sun hat, skullcap; cap, baseball cap, visor; beanie, woolly hat; cowboy hat; beret; fedora, bowler hat; sombrero;
    bonnet | headwear | small light soft fabric | keep the sun off your face, keep your head warm
accessory, clothing accessory | | small light |
gloves, glove, work gloves, rubber gloves; mittens; oven mitt, oven mitts, potholder, oven gloves, pot holder |
    accessory, clothing | small light soft | keep your hands warm, protect your hands
scarf, shawl, bandana, pashmina, headscarf, bandanna, neckerchief, veil, turban | accessory, clothing | small light soft
    fabric warm | wrap around your neck, keep your neck warm
tie, necktie, bow tie | accessory, clothing | small light soft fabric formal | wear with a suit
belt, suspenders | accessory, clothing | small light leather | keep your trousers up
glasses, eyeglasses, spectacles, reading glasses, eye glasses | accessory | small light rigid transparent fragile | see
    better with, read small print with
sunglasses, shades glasses | accessory | small light rigid | protect your eyes from the sun, wear on a sunny day
jewelry, jewellery; necklace; ring; bracelet; earrings; anklet, choker; crown, tiara; bead, jewel | accessory | tiny
    light rigid metal | wear to look elegant, give as a present
mask, face mask, respirator, face shield, gas mask, gasmask, oxygen mask | accessory, safety equipment | small light
    soft | protect yourself from germs or dust
clothes hanger, hanger, coat hanger, clothing hanger, cloth hanger | rack | small light rigid | hang a shirt on
clothes line, drying rack, clothesline, clothes rack, clothes airer, clothes horse, washing line, drying line | rack |
    large light rigid metal | dry laundry on
food, edible, meal, dish of food, groceries | | small light edible | eat when you are hungry
fruit, fruits; apple, apple sliced; banana; pear; grapes; berries, berry; strawberry; lemon; mango; peach; pineapple;
    kiwi; watermelon, melon, cantaloup, cantaloupe; lime; plum; cherry; apricot; papaya; coconut; raspberry; blueberry;
    prune; persimmon; raisin | food | small light edible | eat as a healthy snack, have between meals
citrus fruit; orange; tangerine, mandarin, clementine; grapefruit | fruit | small light edible |
vegetable, vegetables; carrot; tomato, tomato sliced; potato, potato sliced, sweet potato; onion; lettuce, lettuce
    sliced; cucumber; pepper, bell pepper; broccoli; salad; corn; pumpkin; cabbage; spinach; garlic; mushroom; radish;
    turnip; artichoke; brussels sprouts; green beans, green bean; pickle, pickles; squash, gourd | food | small light
    edible | cook or eat in a salad
bread, loaf, bread sliced, cornbread, pita, tortilla; toast; bagel; bun, bread roll, dinner roll, crescent roll;
    baguette; croissant | food | small light edible | make a sandwich with, eat for breakfast
meal; sandwich; burger, hamburger; hot dog; pizza; pasta; noodles, instant noodles, ramen; soup; rice; sushi; taco;
    burrito; steak; chicken; meat; sausage; bacon; fried rice; lasagna; quiche; omelet, omelette; stew; french fries,
    fries; quesadilla; spring roll, egg roll; fast food | food | small light edible | have for lunch or dinner
breakfast food; cereal, breakfast cereal; oatmeal; granola; egg, eggs, egg cracked, egg yolk; yogurt; pancake; jam;
    butter, margarine; cheese, dairy product; peanut butter; honey, honeycomb; waffle; grits, cornmeal | food | small
    light edible | eat for breakfast, start the day with
snack, snacks; chips, crisps, potato chips; cookie, cookies, biscuit; crackers, cracker; popcorn; nuts, trail mix;
    pretzels; granola bar, protein bar, energy bar; almond | food | small light edible | nibble between meals, eat in
    front of a film
sweets, candy; chocolate, chocolate bar; cake, cupcake; ice cream, popsicle, sundae, sherbet; dessert, pudding; pie;
    donut, doughnut; chewing gum; lollipop; candy bar; muffin; brownie; pastry, eclair; waffle cone; jelly bean; mint
    candy, candy cane; marshmallow, fudge; gelatin, jello | snack | small light edible sweet | treat yourself to
    something sweet
condiment, sauce; salt, salt shaker; sugar; spice, spices; ketchup; mustard; oil, olive oil; vinegar; flour; pepper
    shaker, pepper mill, condiment shaker, salt mill; mayonnaise; hot sauce; salsa; applesauce; sweetener, sugar cube;
    sour cream | food | small light edible | season a dish with
drink, beverage, drinks, soft drink, beverages | | small light liquid | drink when you are thirsty, have with a meal
water, bottled water, bottle of water, mineral water, sparkling water, water jug | drink | small light liquid
    transparent | quench your thirst
soda, soft drink, soda can, can of soda, fizzy drink, pop; cola, coke, coca-cola, pepsi; sprite; lemonade; ginger ale;
    root beer; fanta; energy drink | drink | small light liquid sweet | have a fizzy sweet drink
juice, fruit juice, juice box; orange juice; apple juice; smoothie, milkshake | drink | small light liquid sweet | drink
    for breakfast
hot drink; coffee, espresso, coffee beans, cappuccino, latte, coffee capsule; tea, tea bag, tea bags; green tea; cocoa,
    hot chocolate | drink | small light liquid hot | wake up or warm up with, drink in the morning
milk, milk carton; soy milk, oat milk | drink, food | small light liquid white | pour on cereal
alcohol, liquor; beer, beer can, beer bottle; wine, champagne; whiskey; vodka; rum; gin; cocktail, martini; cider;
    tequila | drink | small light liquid | drink at a party, celebrate with, pour for guests
medicine, medication, drug; pill, pills, pill bottle, tablets; aspirin, painkiller; vitamins; cough syrup; eye drops,
    nasal spray; cough drops; pill organizer | first aid | small light | take when you are ill, cure a headache, get rid
    of a headache or a fever
medical supply | | small light | care for a patient
first aid; first aid kit, first-aid kit, medical kit; bandage, band-aid, band aid, plaster, gauze; cotton wool, wound
    dressing; splint; ointment, antiseptic cream | medical supply | small light | treat a wound, stop a cut from
    bleeding, care for an injury
medical instrument, medical equipment, medical device; syringe; otoscope; infusion pump; nebulizer; x-ray machine, x-ray
    viewer; tongue depressor | medical supply, measuring instrument | small light rigid | examine a patient with
iv stand, iv pole, drip stand, iv bag | medical supply | large light rigid metal | hang an infusion on
vital signs monitor; blood pressure monitor, blood pressure cuff; stethoscope; pulse oximeter; heart monitor, bedside
    monitor | medical instrument | small light rigid | check blood pressure pulse or heartbeat with
thermometer, meat thermometer | medical instrument | small light rigid glass | measure a temperature with, see if
    somebody has a fever with
mobility aid; walker, rollator, walking frame, zimmer frame; crutches; cane, walking stick | medical supply | medium
    middling rigid metal | move about with a bad leg, lean on while you walk
wheelchair, wheel chair; stretcher | mobility aid, seat | large heavy rigid metal | get about in when you cannot walk,
    move a patient in
stroller, pram, baby carriage, pushchair, baby buggy, buggy; car seat, child seat | vehicle | medium middling firm |
    take a baby for a walk
baby carrier, baby sling | baby supplies | medium light soft fabric | carry a baby in
baby supplies; baby wipes | toiletry | small light | look after a baby
diaper, diapers, nappy, diaper bag | baby supplies | small light soft | change a baby with
pacifier, dummy teat | baby supplies | tiny light | calm a crying baby with
baby bottle, bottle warmer, steriliser | drinking vessel, baby supplies | small light rigid plastic | feed a baby milk
    from
pet supplies; litter box, cat litter, puppy pad, pooper scooper; cat tree, scratching post, cat tower, cat house; bird
    cage, cage, dog cage, rabbit hutch, hamster cage; pet carrier, dog crate; kennel, dog house; pet toy, dog toy, cat
    toy, squeaky toy, chew toy, hamster wheel | | small light | look after a pet
pet bed, dog bed, cat bed | pet supplies | medium light soft fabric | give a dog or a cat a place to sleep
pet food, dog food, cat food; dog bowl, pet bowl | pet supplies | small light | feed a dog or a cat
leash, dog lead, dog collar | pet supplies | small light | walk the dog on
fish tank, aquarium, terrarium, fishbowl | container | medium heavy rigid glass transparent fragile | keep fish in
animal, pet | living thing | |
small animal; dog, puppy; cat, kitten; rabbit; hamster; squirrel; rat, rodent; frog; turtle; snake; lizard; spider;
    butterfly; insect, beetle, dragonfly | animal | small middling soft | have as a companion
bird; parrot, parakeet; owl; eagle, falcon; duck; goose; swan; hen, rooster; penguin; pigeon, dove; seagull, gull; crow;
    flamingo; ostrich; heron, pelican | animal | small light | watch and hear sing
fish, goldfish; shark; dolphin; octopus; seahorse; starfish | animal | small light | keep in an aquarium
large animal; horse; cow; sheep; pig; goat; elephant; bear; lion; zebra; giraffe; deer; tiger; wolf; monkey; camel;
    rhinoceros; panda; kangaroo; crocodile, alligator; donkey; hippopotamus; gorilla; pony, foal; bull; calf; koala |
    animal | huge heavy | keep on a farm
person, people, human, character; man; woman; child; boy; girl; baby | living thing | large heavy | talk to
vehicle, means of transport | | huge heavy rigid metal | get from one place to another
motor vehicle; car, taxi, suv, limousine, golf cart, minivan, jeep, automobile; truck, pickup; van; bus; tractor;
    bulldozer; excavator; ambulance; police car; fire engine, fire truck | vehicle | huge heavy rigid metal | drive to
    another city
motorcycle, motorbike, dirt bike; moped, motor scooter; snowmobile | vehicle | large heavy rigid metal | ride on the
    road
boat, yacht, ferry, dinghy, raft, barge; ship; canoe; kayak; sailboat | vehicle | huge heavy rigid | travel on the water
aircraft; airplane, plane aircraft, seaplane, fighter jet; helicopter; hot air balloon, hot-air balloon, blimp | vehicle
    | huge heavy rigid metal | fly to another country
train, bullet train, freight car; tram; subway | vehicle | huge heavy rigid metal | travel by rail
tire, wheel, tyre, inner tube | vehicle part | medium heavy firm rubber | roll on
vehicle part | | medium heavy rigid |
building; house, cottage; shed; garage; tower, water tower, clock tower, windmill, silo | structure | huge heavy rigid |
    live in
terrace; porch, veranda, deck, patio; balcony; gazebo, pergola | structure | huge heavy rigid fixed | sit outside in the
    sun on
room, room corner, meeting room; living room; bedroom; kitchen; bathroom; office; hallway, corridor; conference room;
    cubicle, bathroom stall, toilet stall, toilet cubicle | structure | huge heavy fixed | be in
waiting room, lobby, reception, waiting area | room | huge heavy fixed | wait in
fitting room, changing room, dressing room, locker room | room | large heavy fixed | try clothes on in
stone, rock, pebble, boulder; brick; concrete block; paperweight, paper weight | | small heavy rigid stone | build a
    wall with
log, firewood, wood; stick, branch; charcoal, coal; firelighter | | medium middling rigid wood | make a fire with
sand, soil, dirt, gravel | | heavy | fill a sandpit
grass, lawn, turf | plant | green | play on outside
money, cash; coins, coin; banknote; credit card, id card; card reader | small object | tiny light | pay for things
    with, buy things with
smoking supplies; cigarette, cigarettes; ashtray; tobacco pipe, smoking pipe; hookah; cigarette case | small object |
    tiny light | smoke
lighter, igniter; matches, match, matchbox | small object | tiny light | light a fire or a candle with
weapon; gun, rifle, pistol, handgun; sword; bow; arrow; spear; shield; armor, chain mail; dagger | | medium middling
    rigid metal | fight with
letterbox, letter box, mail box, postbox; suggestion box; mailbox; ballot box | container | medium middling rigid metal
    | post a letter in
gas stove canister, gas can, fuel can, jerry can, lighter fluid | container | medium heavy rigid metal | carry fuel in
lectern, podium, pulpit; stage | furniture | large heavy rigid wood | give a speech from
cash machine; cash register; atm; kiosk | device | large heavy rigid | pay or withdraw money
outdoor equipment; solar panel; antenna; satellite dish | device | large heavy rigid | collect energy or signals
party equipment; fog machine; disco ball; string lights, fairy lights; neon sign | light source, decoration | small
    light | set the mood for a party
gift, present, wrapped gift, gift bag | decoration | small light | give someone on their birthday, surprise a friend
    with
dining chair, kitchen chair | chair | medium middling rigid | sit on at dinner
high chair, booster seat | chair | medium middling rigid | feed a small child in
dining table, dinner table, kitchen table, breakfast table | table | large heavy rigid wood | sit around for a meal
conference table, meeting table | table | large heavy rigid wood | hold a meeting around
folding table; picnic table | table | large middling rigid | eat outside at
bathroom cabinet, medicine cabinet, vanity | cabinet | medium heavy rigid wood | keep toiletries and medicine in
front door, main door, entrance door | door | large heavy rigid wood fixed | leave the house through, unlock with a
    key
table lamp; bedside lamp; desk lamp, task lamp, reading lamp | lamp | small light rigid electric | read by in the
    evening, light up your work
ceiling light, ceiling lamp, overhead light; pendant light, pendant lamp, hanging lamp | light, lamp | medium middling
    rigid glass fixed electric | brighten the whole room
wall lamp, wall light, sconce | light, lamp | small light rigid fixed electric | light up a wall or a bed
alarm clock, clock radio | clock | small light rigid electric | wake you up in the morning, get up on time
mouse pad, mousepad, mouse mat, desk mat | computer part | small light soft rubber | move a mouse on
cosmetics, cosmetic, beauty product | toiletry | small light | make yourself look good
knife block, knife set, knife holder, knife rack | kitchenware | small middling rigid wood sharp | keep knives in, cut
    food, slice bread and vegetables with
baking sheet, oven tray, muffin tin, cake tin, baking dish | cookware | small middling rigid metal | bake cookies on,
    roast vegetables on
coffee pot, coffeepot, cafetiere, french press | jug | small light rigid glass | make and pour coffee
camp stove, camping stove | cooking appliance | medium heavy rigid metal hot | fry an egg on, boil pasta on
dish rack, dish drainer, draining rack | rack | medium light rigid metal | let the dishes dry on
towel rack, towel rail, towel bar, towel holder, towel rod, towel ring, towel warmer, heated towel rail, hand towel
    holder | rack | medium light rigid metal | hang wet towels on to dry
rolling pin; mortar and pestle; garlic press; potato masher, masher; pizza cutter; cookie cutter; salad spinner; zester;
    apple corer; meat tenderizer; pastry brush, basting brush; cocktail shaker; ice cube tray; melon baller; mandoline |
    kitchenware, tool | small light rigid | prepare food
grater, cheese grater | kitchenware, tool | small light rigid sharp | grate cheese with, prepare food
peeler, vegetable peeler | kitchenware, tool | small light rigid sharp | peel potatoes with, prepare food
nutcracker | kitchenware, tool | small light rigid metal | crack nuts with, prepare food
funnel | kitchenware, tool | small light rigid | pour a liquid into a bottle through, prepare food
colander, strainer, sieve, sifter, tea strainer, tea infuser | kitchenware | small light rigid | drain pasta in, strain
    or sift ingredients with, prepare food
measuring cup, measuring spoon, measuring jug | kitchenware, measuring instrument | small light rigid | measure flour or
    milk with, prepare food
kitchen organizer; utensil holder, utensil container, silverware holder, cutlery tray; napkin holder, napkin ring; bread
    box, bread bin, breadbin; butter dish; egg carton | kitchenware, container | small light rigid | keep bread cutlery
    and napkins in order
foil, aluminum foil; plastic wrap, cling film; baking paper, parchment paper; freezer bag, zip bag; coffee filter |
    kitchenware | small light | wrap leftovers in, cover food with
packing material; wrapping paper, gift wrap; bubble wrap, packing peanuts | paper product | medium light soft | wrap a
    present in, protect something fragile in a parcel
straw, drinking straw | kitchenware | tiny light | sip a drink through
seafood; salmon; tuna; shrimp, prawns; cod, fish fillet, fish stick; crab | food | small light edible | cook for
    dinner
ham; minced meat, ground meat, ground beef; cutlet, schnitzel; pork; beef; lamb; turkey; meatball; salami; crabmeat |
    meat | small light edible | fry or roast for dinner
leftovers, ready meal, canned food, can of beans, lentils, baked beans, canned beans, chickpea, spam | food | small
    light edible | heat up for a quick meal
syrup, chocolate syrup, maple syrup; whipped cream | condiment | small light sweet edible | pour on pancakes or ice
    cream
tofu; avocado; celery; zucchini; eggplant; beet; peas; cauliflower; asparagus; ginger; herb, herbs, basil, parsley,
    mint | vegetable | small light edible | cook or eat in a salad
spread, hummus; nutella; cream cheese; guacamole | food | small light edible | spread on bread
baby food; formula | food | small light edible | feed a baby with
dog treat, pet treat | pet supplies | small light | reward a dog with
laundry supplies; fabric softener; lint roller; stain remover; dryer sheet | cleaning product | small light | do the
    laundry with
dishwashing liquid, dish soap, washing-up liquid, dishwasher tablets, dishwashing powder | cleaning product | small
    light liquid | wash the dishes with
toilet brush, toilet brush holder | cleaning tool | small light | scrub the toilet bowl with, clean the bathroom with
squeegee; cleaning cloth, microfiber cloth, chamois; wipe, wipes | cleaning tool | small light | clean windows and
    mirrors with, wipe the table with, clean the bathroom with
feather duster, duster | cleaning tool | small light soft | dust shelves and furniture with
plunger, drain snake | cleaning tool | medium light rubber | unclog a toilet or a drain with
air freshener, room spray, incense, freshener, essential oil, room fragrance | toiletry | small light | make a room
    smell nice
grooming tool; cotton pads, cotton balls; cotton swab, cotton bud, q-tips; tweezers; loofah, bath sponge, pumice stone |
    toiletry | tiny light | groom your face and ears with
nail care; nail clippers, nail scissors; nail file | toiletry, tool | tiny light | cut or file your fingernails with
sanitary product; sanitary pad, sanitary towel, sanitary napkin; tampon | toiletry | tiny light soft | look after your
    body during a period
curling iron, hair straightener | appliance, toiletry | small light rigid hot | style your hair with
bath toy, rubber duck | toy | small light rubber | play with in the bath
doorbell; intercom; peephole; mail slot | small fixture | small light rigid fixed | know who is at the door
key rack, key holder, key hook; keychain, key ring, key fob | small object | small light rigid | keep keys on
door mat | rug | medium light firm | wipe your shoes on
umbrella stand, umbrella holder | rack | medium middling rigid | put wet umbrellas in
wine rack, spice rack, magazine rack, bottle rack, wine storage | rack | medium light rigid | keep bottles spices or
    magazines in order
clothes steamer, garment steamer; garment bag; shoe polish, shoe brush; shoehorn, shoe horn; trouser press; shoe tree |
    small object | small light | care for clothes and shoes
baby gear; playpen; baby walker; baby swing; bouncer | furniture | medium middling | care for a baby
baby monitor | device | small light rigid electric | hear a baby cry from another room
baby gate, stair gate | baby gear, barrier | medium middling rigid | keep a toddler away from the stairs
changing table, baby changing station, changing mat | furniture, baby gear | large middling rigid | change a baby on
bookend, book stand, reading stand | small object | small middling rigid | hold books upright
laptop stand, monitor stand, monitor arm, monitor riser; docking station, usb hub | computer part | small light rigid |
    raise a screen to eye level, connect more devices
wrist rest | small object | small light soft | rest your wrists on while typing
paper tray, letter tray, desk organizer, file holder, magazine file, in tray, filing tray, magazine holder, paper
    holder, paper storage, desk pad | office supply, container | small light rigid | sort papers and mail in
paper shredder, shredder | appliance, office supply | medium middling rigid noisy | shred papers, destroy confidential
    documents
laminator; label maker; hole puncher; date stamp, stamp pad, ink cartridge, toner, rubber stamp, ink pad, inkpad |
    office supply | small light rigid | do office work with
laser pointer, pointer, presentation clicker | device | tiny light rigid | point at slides during a talk
whiteboard cleaner | cleaning product | small light | clean a whiteboard with
easel; art supplies, paint set, watercolors, palette; craft supplies, pipe cleaners, pom poms, glitter, finger paint;
    modelling clay, play dough, plasticine | stationery | medium light | paint a picture with
lab equipment; centrifuge; bunsen burner; hot plate; fume hood; lab scale; pipette rack, test tube rack; autoclave;
    incubator | device | medium heavy rigid | do experiments with
lab supplies; lab gloves, latex gloves; dust mask; safety vest, high-visibility vest; knee pads | safety equipment,
    accessory | small light | protect yourself while working
ear protection, ear defenders, earmuffs | safety equipment, accessory | small light | protect your ears from noise
lab goggles, safety goggles, eye protection, safety glasses | safety equipment, accessory | small light rigid
    transparent | protect your eyes while working
eye wash station, eye wash; emergency shower, safety shower; defibrillator, aed; fire hydrant, fireplug; emergency exit;
    first aid cabinet | safety equipment | medium rigid | get help from in an emergency
electronics supplies; resistor, capacitor; led; sensor; battery charger; solder; jumper wires; power supply unit,
    bench power supply | computer part | tiny light | build circuits with
crowbar, pry bar; bolt cutter; awl; rasp; ratchet, socket set; hex wrench | tool | small middling rigid
    metal | pry open or loosen things with
power tool; sander; angle grinder, grinder; heat gun; nail gun; pressure washer | tool |
    medium middling rigid electric noisy | build and renovate with
sawhorse; workbench vise; work stand | tool | large middling rigid | saw a board on
tool storage; tool cabinet, tool cart; pegboard, tool rack; tool belt | storage furniture | large middling rigid | keep
    tools in, keep a workshop in order
putty, filler, caulk, sealant, epoxy, silicone; mortar, grout | fastener | small light | fill holes and seal gaps with
lubricant, oil can, grease, wd-40, motor oil, engine oil | tool | small light liquid | stop a hinge from squeaking
spring; hinge; bracket; pulley; bearing; gear; caster | hardware | tiny light rigid metal | build a
    machine with
garden furniture; deck chair, lawn chair, sun lounger, camping chair; garden bench; garden swing, porch swing | seat |
    large middling | sit outside on
swing; slide; trampoline; sandbox; seesaw; climbing frame, playground | outdoor toy | large heavy | play outside on
pool; swimming pool; paddling pool; pond; fountain | structure | huge heavy fixed | swim or splash in
garden supplies; fertilizer, plant food; potting soil; seeds; plant stand, trellis; birdhouse; compost bin; rain barrel,
    water butt; gardening gloves; bird bath, birdbath; weather vane, weathervane, windsock; weed killer; seedling, seed
    tray; garden gnome, gnome, scarecrow | garden equipment | small light | look after a garden
pruning shears, secateurs, garden shears, loppers | garden tool, cutting tool | small light rigid metal sharp | cut
    branches with, prune roses with
bird feeder | garden equipment | small light | feed birds in the garden from
street lamp, street light, lamp post, lamppost; traffic light; bus stop; parking meter; manhole; phone booth, telephone
    booth | structure | huge heavy rigid fixed | find on a street
sports wear; shin guards; sports bra; cycling shorts; life jacket, life vest; wetsuit, wet suit; fins, snorkel |
    clothing, sports equipment | small light | do sports in
fishing rod; tackle box, bait box | sports equipment | medium light rigid | catch fish with
water sports gear; oar, kayak paddle, paddle; life buoy, lifebuoy; diving board | sports equipment | medium light |
    float on or paddle in the water with
dart board, dartboard, darts; bowling ball; bowling pin; shuttlecock; hockey puck | sports equipment,
    game | small light | aim or play a match with
climbing rope, harness, carabiner; pocket knife, multitool, swiss army knife; water filter; walkie talkie | camping
    equipment | small light | go hiking or climbing with
compass | measuring instrument, camping equipment | tiny light rigid | find north with, find your way with
bike accessory; bike light; bike basket | vehicle part | small light rigid | ride a bicycle safely with
bike rack, bike stand | rack | large heavy rigid metal | park a bicycle at
bike pump, air pump, tire pump, bicycle pump, tyre pump | bike accessory, tool | small light rigid | inflate a tire or a
    ball with, fix a flat tire
car part; spare tire; jumper cables, jump starter; windshield, windscreen; steering wheel; license plate, number plate,
    vehicle registration plate; seat belt; headlight, taillight, brake light; windshield wiper; rearview mirror; ice
    scraper; roof rack, roof box; trailer; oil filter; antifreeze | vehicle part | medium heavy rigid | keep a car going
jack, car jack, jack stand | tool, vehicle part | small heavy rigid metal | lift a car with, change a wheel with
travel accessory; neck pillow, travel pillow; passport; ticket; travel adapter; luggage tag; eye mask, sleep mask |
    small object | small light | travel more comfortably with
music accessory; amplifier, amp; music stand, sheet music; drumsticks; guitar case; metronome; pedal, guitar pedal; midi
    keyboard; mixing console, mixer audio, mixing board | device | medium middling rigid | make music with other
    instruments
vinyl record, record, cassette, blu-ray, video tape | data storage | small light rigid plastic | play an
    album or a movie from
streaming stick, set-top box, media player, tv box, dvd player, cable box, vcr, videocassette recorder, video recorder |
    device | small light rigid plastic | watch films on a television with
smart home device; smart plug; smart bulb; motion sensor; doorbell camera; security system, alarm panel, alarm control,
    burglar alarm, metal detector | device | small light rigid electric | automate and guard the home
baby clothes; onesie; bib; christening gown | clothing | small light soft fabric | dress a baby in
vest; waistcoat; uniform; overalls, coveralls, coverall, boiler suit; jumpsuit; tracksuit; scrubs | clothing | small
    light soft fabric | wear for work or sport
pile of clothes, clothes pile, laundry, dirty clothes, folded clothes | clothing | medium light soft fabric | wear
handkerchief; headband, sweatband, wristband, armband; hair scarf; cufflinks; pocket square | accessory | tiny light
    soft fabric | complete an outfit
curtain rod, curtain rail, shower rail, shower bar, shower curtain bar, curtain hook; picture hook; wall anchor; suction
    hook | small fixture | small light rigid | hang curtains or pictures from
door stop, doorstop, wedge; furniture pad | small object | small light | hold a door open
piggy bank, money box; jewelry stand; music box; ring holder | small object | small light rigid | save coins or keep
    small treasures in
holiday decoration; christmas ornament, bauble, christmas stocking, tinsel; easter egg; halloween pumpkin,
    jack-o-lantern; advent calendar; menorah; nativity | decoration | small light | decorate for a holiday
aroma candle holder, candle holder, candelabra, candelabrum | decoration | small light rigid | put candles in
stained glass; wallpaper; wall sticker, wall decal; tile, tiles, backsplash; wainscot, wainscoting, paneling, panelling;
    baseboard, moulding, trim, skirting, skirting board, molding, ceiling molding, cornice, coving, architrave, picture
    rail, dado rail | structure | medium rigid fixed | finish a wall with
counter stool | bar stool | medium light rigid | sit at a bar or counter on
massage chair; massage gun; heating pad, hot water bottle, heat pack; electric blanket; ice pack, cold pack | appliance
    | medium soft | ease aching muscles
humidor; cigar box; vape; tobacco | smoking supplies | small light | smoke
eyeglass case, glasses case, contact lenses, contact lens case, contact lens solution | small object | small light |
    keep glasses or lenses in
hearing aid; cast; sling; knee brace; inhaler; blood glucose meter; bedpan, bed pan; hospital gown; surgical mask;
    scalpel; forceps | medical supply | small light | treat a patient
""".strip()
"""One thing per line; see the module's docstring."""

TRAITS = """
soft: soft, plush, cushy, squishy, fluffy, cuddly, padded, cushioned, spongy, bendable, flexible, pliable, floppy,
    squeezable, upholstered, tufted
firm: firm, semi-rigid, springy
rigid: rigid, hard, stiff, solid, inflexible, unyielding, sturdy
light: light, lightweight, weightless, light-weight, easy to carry, easy to lift, easily moved, not heavy
middling: moderately heavy
heavy: heavy, weighty, massive, hefty, heavyweight, hard to lift, difficult to move, hard to move
tiny: tiny, miniature, minuscule, pocket-sized, pocket-size
small: small, little, compact, petite, mini, palm-sized, handheld, hand-held, smallish
medium: medium, medium-sized, mid-sized
large: large, big, sizable, bulky, sizeable, tall, wide, spacious
huge: huge, enormous, gigantic, giant, immense, very large
transparent: transparent, see-through, clear, translucent, see through
fragile: fragile, breakable, delicate, brittle
sharp: sharp, pointed, pointy, cutting
fixed: fixed, immovable, built-in, installed, stationary, unmovable
portable: portable, movable, moveable, mobile
electric: electric, electronic, electrical, battery-powered, powered, plugged in
waterproof: waterproof, water-resistant, rainproof, water resistant, watertight
warm: warm, insulated, insulating, woolly
cold: cold, chilled, cool, refrigerated
hot: hot, heated
noisy: noisy, loud
edible: edible, eatable, nutritious
sweet: sweet, sugary
liquid: liquid, fluid
formal: formal, dressy, elegant, smart
casual: casual, informal, everyday, sporty
wood: wooden, wood, timber
metal: metal, metallic, steel, iron, aluminum, aluminium, stainless steel, brass, copper
plastic: plastic, acrylic
glass: glass, glassy
fabric: fabric, cloth, textile, woven, knitted, cotton
leather: leather
paper: paper, papery
cardboard: cardboard
ceramic: ceramic, porcelain, clay, earthenware
rubber: rubber, rubbery
stone: stone, marble, granite, concrete
foam: foam
wax: wax
round: round, spherical, circular, ball-shaped
colorful: colorful, colourful, multicolored, multicoloured, multi-colored, rainbow, brightly colored
white: white, cream, ivory, off-white, light colored, light-colored, pale
black: black
gray: gray, grey, silver, silvery
brown: brown, tan, beige
red: red, crimson, maroon, burgundy, scarlet
blue: blue, navy, turquoise, teal
green: green, olive, lime
yellow: yellow, golden, gold
orange: orange
pink: pink
purple: purple, violet, lavender
""".strip()
"""trait: the words that say it. The first lines are scales, the colours and materials follow."""

SCALES = (
    ("soft", "firm", "rigid"),
    ("light", "middling", "heavy"),
    ("tiny", "small", "medium", "large", "huge"),
    ("edible",),
)
"""Traits of which a thing has one, in order: the next one on the scale is half right."""

RELATIVE = ("light", "tiny")
"""The scales, by their first traits, that a caption uses in proportion: a small table is small for a table."""

COLORS = ("white", "black", "gray", "brown", "red", "blue", "green", "yellow", "orange", "pink", "purple", "colorful")
"""Traits that only the map can tell: a shirt is of some colour, and its caption says which."""

MATERIALS = (
    "wood", "metal", "plastic", "glass", "fabric", "leather", "paper", "cardboard", "ceramic", "rubber", "stone",
)  # fmt: skip
"""Traits that a thing usually has; what the map says comes first."""

CONSUMABLES = ("food", "drink", "toiletry", "cleaning product", "medicine", "paper product")
"""Things that are bought in packages, which are called by them: a juice carton, a tissue box."""


def lines(table: str) -> list[str]:
    """The lines of a table, those that go on joined to the one before."""
    return table.replace("\n    ", " ").splitlines()
