"""When one needs a thing, told as people tell it: situations | what helps in them.

Who is thirsty asks for no "something to drink from"; they say that their throat is dry. No word of that stands in the
uses of a glass, and hardly its meaning: a use says what is done, a situation why. Both are matched by sentence
embeddings, which know a situation best by another one: every line tells of one need in a few ways, the things that
meet it follow in the names of the table of everyday things, and their kinds with them.
"""

from __future__ import annotations

import re
from itertools import pairwise

MARK = " for when"
"""What stands between what is asked and the situation that it is asked for: "something for when: it rains"."""

MOST_PARTS = 8
"""Pieces of what is told that are matched one by one."""

_MARK = re.compile(rf"{MARK}(?::|\b)", re.IGNORECASE)
_ENDS = re.compile(
    r"[.;:?!,]+(?=\s|$)|\b(?:and|but|because|so(?=\s+(?:i|we|you|he|she|it|they|that|can|please)\b))\b", re.IGNORECASE
)


def split(text: str) -> tuple[str, str]:
    """What stands before the situation that a text tells of, and that; the whole text and "" where it tells of none."""
    found = _MARK.search(text)
    return (text, "") if found is None else (text[: found.start()].strip(), text[found.end() :].strip())


def told(text: str) -> tuple[str, ...]:
    """The pieces of what a question tells, each of which may be what matters: clauses, neighbours, and the whole.

    "Something to read for when I am bored, it is raining" tells that somebody reads, is bored, that it rains, and both
    together. Nothing of a text that tells of no situation.
    """
    asked, whole = split(text)
    if not whole:
        return ()
    parts = [part.strip() for part in _ENDS.split(whole)]
    parts = [part for part in parts if len(part.split()) > 1]
    pairs = [f"{a}, {b}" for a, b in pairwise(parts)] if len(parts) > 2 else []  # two are the whole
    first = [asked] if len(asked.split()) > 1 else []
    return tuple(dict.fromkeys(piece for piece in (whole, *first, *parts, *pairs) if piece))[:MOST_PARTS]


TABLE = """
it is raining outside and I have to go out; it is pouring with rain; there is a downpour, I will get soaked on the way |
    umbrella, rain gear
it is drizzling and I have to walk to the bus; the forecast says heavy showers | umbrella, rain gear, jacket
it is windy and cold outside; it is snowing and I am going out | jacket, scarf, gloves, hat
my hands are cold outside; my fingers are freezing | gloves
my ears are cold in the wind; my head gets cold in winter | hat, scarf
my neck is cold | scarf
my feet are cold; the floor is cold under my bare feet | underwear, light shoes, rug
I am cold; I am freezing, shivering and need to warm up; it is chilly in here tonight | cover, sweater, heater
the room is freezing; the heating is off and it is cold in here; warm this room up | heater, fireplace, thermostat
cuddle up on a cold evening on the sofa; she is shivering, put something over her | cover
it is boiling in here; it is a hot day and I am sweating; there is a heatwave, cool me down | fan, air conditioner
I could do with a breeze; it is stuffy and there is no air; let some fresh air in | window, fan
it is too hot or too cold in this room; set the heating lower | thermostat
the sun is blinding me; the sun shines in my eyes through the window; there is glare on the screen | window covering,
    curtain
it is too bright to sleep; keep the light out of the bedroom; nobody should look in from outside | window covering,
    curtain
the sun is bright outside and I am squinting | sunglasses, hat
I am going to sunbathe and do not want to get sunburnt | sunscreen, umbrella
it is sunny on the terrace and I want some shade | umbrella, shelter
the air in here is dry; my skin and throat are dry from the heating | humidifier
the air in here is damp and the walls are mouldy | dehumidifier
my allergy is bad because of pollen and dust in the air | air purifier
it is dark in here, I cannot see a thing; the room is gloomy, switch something on | lamp, light, light switch
there is a power cut and it is pitch black; the lights went out; the electricity has failed | flashlight, candle,
    lantern, fuse box
I have to find my way in the dark; I dropped something under the sofa and cannot see it; walk home at night in the dark
    | flashlight
he is afraid of the dark at night; she wants a little light on while she sleeps | lamp
the bulb has blown; the lamp does not come on any more | light bulb
set a romantic mood for dinner; make the evening cosy | candle, string lights
the fuse has blown; switch off the electricity before repairs | fuse box
I am thirsty; my throat is dry; I am parched after running; I need some water | water, drink, water cooler, faucet, sink
my water bottle is empty, fill it up | water cooler, faucet, sink
I need caffeine; I can hardly keep my eyes open this morning; I could murder a cuppa | hot drink, coffee machine,
    teapot
make a brew for everybody; put the kettle on | teapot
pour everybody a drink; the guests have nothing to drink from | drinking glass, cup, jug
I want a hot drink in my hands; let us have coffee, what do we drink it from | mug, cup
we have something to celebrate, a toast | alcohol, drinking glass
I am hungry; I am starving, I could eat a horse; I skipped breakfast | food, fruit, snack, meal, bread
I am peckish between meals; a little something to nibble | snack, fruit
I fancy something sweet after dinner; my blood sugar is low | sweets, fruit
I want to eat more healthily; I need vitamins | fruit, vegetable
what is there for lunch; what shall we have for dinner; feed four hungry people | meal, food
the food tastes of nothing; this soup is bland; make this dish spicier | condiment
the leftovers are cold; my lunch is cold, heat it up; warm up some soup quickly | microwave, stove, pot
I want to bake a cake; dinner must go into the oven | oven, baking sheet
fry some eggs; boil some pasta; let us cook something | stove, pan, cookware
I want toast for breakfast; crisp up the bread | toaster
the beer is warm, chill it; the milk will go off; keep the shopping fresh; we have ice cream that must not melt |
    refrigerator
there is too much food left over; pack my lunch for work; put the rest of dinner away | food storage container, foil
the soup is ready, serve it; ladle it into the bowls; dish the stew out | ladle
turn the pancake over in the pan; flip the burgers | spatula
lift the hot meat out of the pan; turn the sausages on the grill | tongs
stir the sauce; taste the soup | spoon
beat the eggs; whip the cream | whisk, mixer
mash the potatoes | potato masher
make a smoothie from fruit; puree the soup | blender
squeeze some oranges | juicer
knead the dough in a machine; mix a batter | mixer
roll out the dough | rolling pin
shred the cheese; grate a carrot | grater
peel the potatoes; take the skin off the apples | peeler, knife
drain the pasta; rinse the rice | colander
pour it through a narrow neck without spilling | funnel
crush the garlic; grind the spices | garlic press, mortar and pestle
how much flour is that; measure out the ingredients; weigh 200 grams of sugar | measuring cup, scale
chop these onions; slice the tomatoes; carve the roast; cut the birthday cake | kitchen knife, knife, cutting board
do not scratch the worktop when you cut; I need a surface for chopping | cutting board
cut the bread | bread knife, knife
open this tin of tomatoes; the can has no ring pull | can opener
get the cork out of this bottle; the wine has a cork | corkscrew
take the cap off this beer | bottle opener
the pan is boiling over, cover it | lid
the pot is hot, I will burn my fingers; take the hot tray out of the oven; the handle is too hot to touch | oven mitt,
    towel
where can I put this hot pan down; the cup leaves a ring on the table | coaster
carry all the plates and cups to the table at once; bring her breakfast in bed | tray
lay the table; there is nothing to eat with | cutlery, plate
what shall I eat my cereal from; serve a salad | bowl
the cooking smells everywhere; the kitchen is full of steam | range hood, window
how long have the eggs been boiling; remind me when the cake is done; wait for exactly ten minutes | timer
the dishes are piling up; wash up after dinner; the plates are greasy | dishwasher, sink, sponge, dishwashing liquid
the dishes are wet and must dry | dish rack, dish towel
I spilled my drink; there is a puddle on the floor; the milk was knocked over, mop it up; juice is all over the table |
    paper towel, towel, sponge, mop, cleaning cloth
my hands are dirty; I have mud on my hands; wash up before dinner; my hands are sticky | sink, soap
my hands are wet | towel, paper towel dispenser, paper towel
no water for washing and my hands have touched something; get rid of the germs on my hands | soap dispenser
crumbs are all over the floor; there is broken glass to be swept up; the floor is dusty | sweeping tool, vacuum cleaner
the carpet is full of dog hair; the floor is filthy | vacuum cleaner, sweeping tool
the kitchen floor is sticky; mud has been walked in on the tiles | mop, bucket
the shelves are dusty; there are cobwebs in the corner | duster, cleaning cloth, vacuum cleaner
the windows are dirty; the mirror is smeared | squeegee, cleaning cloth, cleaning product
the table is sticky, wipe it | sponge, cleaning cloth, paper towel
this stain will not come out; limescale in the bath; disinfect the worktop | cleaning product
the toilet is blocked; the sink does not drain, it is clogged; the loo will not flush | plunger
the toilet bowl is dirty | toilet brush
a pipe is leaking; water is dripping from the ceiling, catch it | bucket, towel
the tap is dripping; the nut under the sink is loose | wrench, gripping tool
the water must be turned off, a pipe has burst | valve, faucet
I need the loo; I need to pee; where can I go to the toilet | toilet
there is no loo roll left | toilet paper, tissue
my clothes are dirty; I have no clean socks left; there is a stain on my shirt; do a load of washing | washing machine,
    laundry supplies, stain remover
where do I put my dirty socks; clothes lie on the floor and need washing | laundry basket
the washing is wet and must dry; hang the laundry up; it is raining, dry the clothes inside | clothes line,
    clothes dryer
my shirt is creased; these trousers are crumpled before the interview | iron, ironing board, clothes steamer
there is fluff and cat hair on my coat | lint roller
my shoes are scuffed and dull | shoe polish
my shoes are muddy, I do not want to bring dirt in | rug, door mat
hang up my coat; where does my jacket go; I come in with a wet coat | coat rack, wardrobe, clothes hanger
where do I leave my wet umbrella | umbrella stand
where do I take off my shoes; shoes are lying all over the hall | shoe rack
I do not want creases in my suit while it is in the cupboard | clothes hanger, wardrobe
put away clean clothes; where do my folded shirts go | dresser, wardrobe
I am wet from the shower; I just came out of the pool; dry the dog | towel
where do I hang my wet towel | towel rack
my hair is wet after washing | hair dryer, towel
my hair is tangled; my hair is a mess | hairbrush
my hair falls in my face | hair accessory
I want curls; straighten my hair for tonight | curling iron
my hair is greasy | shampoo, shower
my beard is getting long; I have stubble | razor
I have bad breath; I ate garlic; something is stuck between my teeth; it is bedtime, brush his teeth | toothbrush,
    mouth care
I smell of sweat; freshen up after sport | shower, deodorant, soap
I want to smell nice for a date | perfume
I feel grubby, have a good wash; soak my aching muscles in hot water; relax in warm water | bathtub, shower
my skin is dry and cracked; my hands are chapped | lotion
my lips are chapped | lip balm
my nails are too long; I broke a fingernail | nail clippers, nail file
pluck my eyebrows; there is a splinter in my finger; a thorn is stuck in my hand; remove a tick | tweezers
my ears are full of wax; dab the eyeliner off | cotton swab, cotton pads
I want to look my best tonight; cover a spot on my face | makeup
do I have something on my face; is my tie straight; how do I look in this dress | mirror
have I gained weight; how heavy am I; my doctor told me to watch my weight | scale
my nose is running; I have to sneeze; she is crying, dry her tears; I have a cold | tissue
there is sauce on my chin, wipe my mouth | tissue
I cut my finger and it is bleeding; I grazed my knee; he fell and hurt himself; cover this wound | bandage, medical
    supply, first aid kit
my ankle is swollen, strap it up; keep a broken bone still | bandage, splint
stop the blood from a wound; dress a burn | bandage, wound dressing, first aid kit
clean the cut before it gets infected | antiseptic cream, cotton wool
I have a headache; my head is killing me; I have toothache; I feel sick and my back aches | medicine
I have got a fever, am I ill; is her temperature too high; the child feels hot | thermometer
listen to his heart and lungs | stethoscope
is my blood pressure too high | blood pressure monitor
give an injection; draw blood from the patient | syringe
his heart has stopped; somebody has collapsed and has no pulse | defibrillator, phone
something splashed into my eye; chemicals got in my eyes | eye wash station
people are coughing, I do not want to catch it; there is dust and sanding smoke I should not breathe in | mask
I broke my leg and cannot walk; granny is unsteady on her feet; my hip hurts when I walk | mobility aid
he cannot walk at all; move a patient along the corridor | wheelchair
I cannot climb stairs; go up to the fifth floor with a pram or a wheelchair | elevator
I am afraid to slip on the stairs; hold on tight on the way down | railing
I slip in the shower; I need a hand to get up from the toilet | grab bar, handrail
wait for the doctor and sit; my feet hurt, I have been standing all day; my legs are tired; sit down for a minute | seat
there are not enough seats for the guests; my aunt needs somewhere to sit | chair, sofa, stool
my back hurts at the desk; I work sitting all day | office chair, cushion
this chair is hard; my bottom is sore from sitting | cushion
put my feet up after work | ottoman, sofa
I am tired; I am sleepy and need a nap; I am exhausted, lie down for a bit | bed, sofa
a friend stays overnight; where can a guest sleep | bed, sofa, mattress
my neck hurts in bed; my head needs something soft | pillow
sleep on a plane; I cannot sleep when it is light | eye mask, travel pillow
I must get up early tomorrow; I overslept again; do not let me miss my flight in the morning | alarm clock, phone
what time is it; am I late; when does the meeting start | clock, watch
what is the date today; when is her birthday; plan the month | calendar
it is too loud, I cannot concentrate; my neighbours are noisy; the baby cries and I want to sleep | headphones
the drill is deafening; the machine is so loud that my ears ring; the noise of the saw hurts my ears | ear protection,
    headphones
I want music without waking anybody; listen on the bus without disturbing others | headphones
it is too quiet in here, put some music on; liven up this party with tunes | speaker, radio
I have some old records to play | record player
what is in the news today; the match is on tonight, let us watch; nothing on, flick through the programmes | television,
    radio, newspaper
the show is boring, change the channel; the TV is too loud, turn it down | remote control
show the photos to everybody on the big wall; we want a cinema evening; show my slides to the audience | projector,
    television, screen
the people at the back cannot hear me; record a podcast; sing karaoke | microphone
I am bored; there is nothing to do and the weather is bad; entertain us this evening; kill some time | game, book,
    television, toy, puzzle game, game console
I have to wait for an hour with nothing to do; have something to read while I wait | periodical, book, phone
I have a long train ride ahead; something for the journey | book, tablet, headphones
the children are bored; keep the kids busy; a toddler is restless; the little ones are getting impatient | toy, game,
    building blocks, puzzle
the kids want to draw; a rainy afternoon with children and nothing to do | crayon, craft supplies, coloring book
the child is sad and cannot fall asleep; he needs a cuddle | stuffed animal
read the children a story before bed; tell a bedtime story | book
the bath is boring for the baby | bath toy
toys are lying all over the floor; tidy up the playthings | toy box, storage furniture, basket
we are going to play in the garden; it is nice outside, the children want to play | outdoor toy, ball, swing
let us play a tune; I want to practise for my music lesson | musical instrument
the baby is tired; put the baby down for a sleep | crib
the baby has a full nappy; the baby has a dirty bottom; it smells, he needs changing | diaper, baby wipes,
    changing table
the baby is hungry at night; the baby needs milk | baby bottle, formula
the baby will not stop crying | pacifier, stuffed animal
feed a toddler at the table | high chair
go for a walk with the baby | stroller
keep the baby from falling down the stairs; keep a crawling child out of the kitchen | baby gate, playpen
the dog wants to go out; walk the dog | leash
the dog is hungry; feed the cat | pet food, dog bowl
the cat needs to do its business | litter box
the dog needs a place to sleep | pet bed
take the cat to the vet | pet carrier
the parrot must not fly around | bird cage
feed the birds in winter | bird feeder
where do the goldfish live | fish tank
flies are everywhere; mosquitoes bite me at night; we have mice | pest control
it smells in here; get rid of a bad smell | air freshener, window
this is rubbish, get rid of it; where does this wrapper go; I have finished with this, chuck it away; the waste has to
    go | trash can
empty bottles and old newspapers; where do I put plastic and glass | recycling bin
the bin is full and needs emptying | trash bag
nobody may read these letters; confidential bank statements have to go; get rid of secret documents for good | paper
    shredder
write this down before I forget; take down a phone number; I have an idea; remember what to buy | pen, pencil, notebook,
    paper
sign this form; fill in a form; mark the exam | pen
I made a mistake in ink | correction fluid
I drew a line wrong in pencil, get rid of it | eraser
my pencil is blunt; the lead of my pencil has broken | pencil sharpener
my kitchen knife is blunt | knife sharpener
mark the important lines in the text | highlighter
explain my plan to the whole team; sketch an idea so that everyone in the meeting can see it | writing board
the board is full, wipe it off | whiteboard eraser
stick a note to remind him; leave her a message | sticky notes, notebook, writing board
put up a notice for everyone to see | bulletin board
draw a straight line; how long is this, will it fit; measure the width of the window | length measure
keep these sheets together; these pages fall apart | stapler, paper clip, folder
the papers must go in a ring binder, put holes in them | hole punch
the documents are in a mess; papers lie all over my desk | folder, paper tray, filing cabinet, desk organizer
I need this on paper; I need a hard copy of my boarding pass; three copies of this contract | printer
get this letter into the computer; email a signed form | scanner, printer
cut this out; cut a piece of wrapping paper; trim the thread; the label is scratchy, take it off | scissors
open the parcel that just arrived; cut this box open | box cutter, scissors, knife
open the letters | letter opener
I need to send a letter; post a card to my mother | envelope, stamp, letterbox
the birthday present is not wrapped yet | wrapping paper, tape, ribbon
it is her birthday, what could I give her | gift, flower
surprise my wife; today is our anniversary; say sorry to her | flower, sweets
decorate the place for the party tonight; a children's birthday party | party decoration
the flowers need water; I got a bunch of flowers, where do they go | vase
the plants are dry and wilting; the leaves are drooping | watering can, hose
the room looks bare, make it nicer; the wall is empty | picture, plant, decoration
put a photo of my family on the desk | picture frame
do a sum; what is 17 percent of 340; split the bill; check my accounts | calculator, phone, computer
I have to write an essay; do my homework; write a report on my work | computer, laptop, desk
look something up online; check my email; buy a ticket online; book a flight | computer, laptop, phone, tablet
join a video call; my colleagues should see me | webcam, laptop, computer
I need two documents side by side; the laptop screen is too small | screen
type a long text; typing on a touch screen is a pain | keyboard
the pointer on my screen does not move | computer mouse
there is no internet; the wifi is down; I want to get online | router
the slides need to be clicked on while I talk; point at the slide | laser pointer
give a speech; put my notes down while I talk | lectern
we need to meet with ten people and talk | conference table
my files are too big to email; back up my data; take this file home | data storage
my phone is dead; the battery is almost empty; my laptop is about to die | charger, outlet, power bank, cable
where can I plug this in; I need electricity for my laptop | outlet, extension cord, power strip
the plug does not reach the socket; all the sockets are taken | extension cord, power strip
the remote control does not work any more; the toy has stopped, its batteries are flat | battery
I need to call a doctor; phone home; order a pizza; ask when he comes; there has been an accident, get help | phone
take a picture of us; capture this moment; film the baby's first steps | camera, phone
my pictures are blurred, keep the camera still | tripod
who is at the door; see who rang | peephole, doorbell, intercom
the door is locked; let me in, I locked myself out | key
close it so that no one gets in; there have been burglaries; somebody could steal my bike; keep thieves away | lock,
    security system
my passport and money should be safe; leave my valuables somewhere safe; leave my bag while I am out | safe, locker
where did I leave my keys; hang the keys by the door | key rack
keep an eye on the house while we are away | security camera, smart home device
carry all this home from the shop; I bought groceries | bag, trash bag, basket, cart
carry my laptop and books; I go hiking and need my hands free | backpack
pack for the weekend; I fly to Spain for a week; going on a trip | suitcase, bag
we are moving house; send these things to a friend; pack all this away | box, packing material
these things are too heavy to carry; move a washing machine | cart
do not break the glasses in the parcel | bubble wrap
there is clutter everywhere; find a place for all these odds and ends | storage furniture, box, basket
where do the books go | bookshelf
where do I put the plates and cups away | cabinet
where do my groceries and tins go | cabinet, shelf
the books keep falling over | bookend
put my drink down next to the sofa; my cup needs a place | coffee table, side table
where shall we eat; six people come to dinner | dining table, table
I need some room to work; spread my papers out | desk, table
pay the bill; I need to pay the cashier; buy a coffee | money, wallet
I have no cash on me | atm, cash machine
get a snack at the station | vending machine
I am lost, how do I get there; which country is that | map, phone, sign
my son has a geography test | map, teaching aid
he has to learn maths; study for my exam | book, notebook
I do not know what this word means | dictionary
I do not know how to cook it; find a recipe | cookbook
how does this machine work | manual
what does the restaurant serve | menu
I cannot read the small print; the letters are too tiny for my eyes | glasses, magnifying glass
look at something very small; see the cells of a leaf; see distant stars | optical instrument
something is on fire; the pan is burning; flames come out of the oven; there is a blaze, quick | fire extinguisher,
    fire blanket
I smell smoke; warn us if it burns | smoke detector
how do we get out in a fire; leave the building now | emergency exit, door
light the candles; light a cigarette; get the barbecue going | lighter, matches, firelighter
the fire is going out; the embers need stirring | fireplace tool, firewood
I need to smoke, where does the ash go | ashtray
the chair leg is loose; this is broken, fix it; the handle has come off | tool, glue, screwdriver, toolbox
the cup broke in two, mend it; the plastic piece snapped; stick the pieces back together | glue, tape
the screw is loose; put a flat-pack shelf together; open up the computer; change the battery cover | screwdriver
knock a nail into the wall; put up a picture | hammer, nail
the nut will not come off; the bolt is rusty and will not turn | wrench, gripping tool, lubricant
pull this nail out; bend the wire; the plug is stuck and slippery, grip it | pliers, hammer
a hole is needed in the wall; put up shelves in concrete | drill
cut this plank in half; saw off a branch; shorten a board | saw
cut through a metal bar; cut this bolt | hacksaw, bolt cutter, angle grinder
the edge is rough, make it smooth; get the old paint off; there are splinters on the board | sandpaper, sander, file
    tool, plane
is this shelf straight; the picture hangs crooked; check that it is horizontal | spirit level
hold it tight while the glue dries; keep a workpiece still while I saw or file it; press two boards together | clamp,
    vise
pry the lid open; the crate is nailed shut | crowbar
the hinge squeaks; the lock is stiff; the chain needs oil | lubricant
there is a gap in the wall; seal the bath; a crack must be filled; there is a draught by the window | putty, tape
the cable has come loose from the board; join two wires | soldering iron, electrical tape
is there current in this wire; check the voltage | multimeter
the wall is ugly, give it a new colour; the fence needs a fresh coat | painting supplies
protect the floor from paint drops | shelter, newspaper
tie this up; the parcel falls apart; fasten it to the roof; hang something from a hook | string, tape
the bag of crisps is open; hang the wet socks on the line | clip
it is ripped; my jeans have a hole; a button has come off; the hem has come down; hold the torn seam until tonight |
    sewing supply, needle and thread, safety pin
I need to shorten a pair of curtains; make a dress | sewing machine
my trousers keep slipping down | belt
my shoe will not stay closed | shoelace
the note must stay on the fridge; hold this poster up | magnet, tape, thumbtack
I cannot reach the top shelf; it is up too high for me; change the bulb on the ceiling | ladder, stool
I am handling chemicals; the glass is sharp; protect my fingers at work | gloves
sparks fly; something could get into my eyes while I drill | lab goggles, glasses
something heavy could fall on my head; cycle safely in traffic | helmet
cars must see me in the dark; work at the roadside | safety vest
keep people away from the hole; block the way | barrier
the grass is too long; the lawn needs cutting | lawn mower
the bushes are overgrown; give the hedge a cut; prune the roses | hedge trimmer, pruning shears
leaves cover the lawn | rake, leaf blower
dig over the flower bed; plant a tree; clear the snow from the drive | shovel
move soil to the other end of the garden | wheelbarrow
the plants need feeding; nothing grows here | fertilizer
the kitchen scraps could become soil | compost bin
the car is dirty | hose, bucket, sponge
the windscreen is frozen | ice scraper
my tyre is flat; the ball has no air | bike pump, spare tire, jack
the car does not start | jumper cables
get to work without a car; a ride around the lake | bicycle
I need to get to another town | motor vehicle, train
get fit; a quick workout; build muscle; I have put on weight and want to train | exercise equipment, weights
run inside because it is raining; do cardio at home | exercise machine
my back is stiff, stretch; do some yoga; do sit-ups on a soft floor | yoga mat, floor exercise equipment
kick about with friends; play catch | ball
go for a run; go to the gym | sneakers
go for a swim | swimwear, swimming pool
the boat may sink; he fell in the water and cannot swim | life jacket, life buoy
sleep outside in the woods; go camping | camping gear
get fish for dinner from the lake | fishing rod
go hiking in the mountains | boots, backpack, compass
I have a job interview; I am going to a wedding | suit, dress shoes, tie, dress
I have nothing to wear; I have to get dressed; he is naked after the shower | clothing
I do not want to get my clothes dirty while I cook or paint | apron
it is bedtime, change into something comfortable | pajamas
teach the class about the body | teaching aid
do an experiment in the lab; heat a liquid in the lab; pour an exact amount of liquid | laboratory glassware, lab
    equipment
make a prototype of a part | 3d printer
have the floor done without me; let a machine do the work | robot
turn the oven down; make the hob hotter | control knob
turn the lights off; the light is still on, save electricity | light switch
where can I get out; leave this room | door, elevator, staircase
go upstairs | staircase, elevator
change clothes without being seen; separate two beds | room divider, window covering
park here | parking meter
he has burnt himself on the oven; she scalded her hand with boiling water; a burn wants cooling and covering | first
    aid kit, ointment, bandage, medical supply
a blister has come up on my heel; my new shoes rub | bandage, first aid kit
a bee has stung her; insect bites that itch; a rash on my skin, it itches like mad | ointment, lotion, ice pack
I bumped my head, there is a lump; she twisted her knee and it swells up; put something cold on the bruise | ice pack,
    towel
someone got hurt, come quick; a workmate has been injured; treat the patient until the doctor comes | first aid kit,
    bandage, medical supply
he has fainted and must be carried out; move a patient who cannot walk | stretcher, wheelchair
granny is unsteady on her legs; I cannot walk far any more; walk without putting weight on the bad foot | cane,
    walker, crutches, mobility aid
I cannot hear well what people say, speak up | hearing aid
my belly hurts; I have a tummy ache; my period pains are bad; my muscles ache all over | medicine, heating pad
I caught a cold and cough all night; my throat is sore; I feel feverish | medicine, cough syrup, tea, tissue
I have trouble breathing, my asthma is back | inhaler, nebulizer
it is time for her pills; do not forget which tablets to take on which day | pill organizer, medicine
my sugar must be checked, I am diabetic | blood glucose meter
my eyes are dry and itch | eye drops
something splashed into my eyes; rinse a chemical out of the eye | eye wash station, faucet
do not breathe in the dust; keep my germs to myself; the fumes are bad for the lungs | mask, fume hood
before I touch the patient; I might touch blood; my hands should not get dirty or wet | gloves
the patient has to lie down for the examination | treatment table, bed
the patient cannot get up to use the toilet | bedpan
lock away the cash and the passports | safe, locker, lock, cabinet
I must leave something valuable here and nobody should take it; a place for my things that locks | locker, safe
I have been standing all day and my legs are tired; where can I rest for a minute; grandma wants to sit down | seat,
    chair, armchair, sofa, bench
I want to lie down; time for a nap; I am so sleepy; where can a guest spend the night | bed, sofa, mattress
my neck is stiff when I wake up; support my head while I sleep; my back wants something soft behind it | pillow,
    cushion
I want to sleep but the neighbour's light shines in | eye mask, curtain, blinds
wake me tomorrow at six; I must not oversleep; get up in time for the early shift | alarm clock, clock, phone
how much time is left; are we on time | clock, watch, phone
I need a wash; I stink after training; get clean all over | shower, bathtub
I want to wash my hands | sink, soap
wash my face; freshen up quickly; splash some water on my face | sink, towel
brush my teeth before bed; my mouth tastes bad in the morning | toothbrush, toothpaste, mouth care
food got stuck between two teeth | dental floss, toothpick
shave before the meeting; get rid of my whiskers; my legs are hairy | razor, shaving cream
wash my hair; my head itches, my hair is oily | shampoo
my hair is soaking; dry off after a swim | towel, hair dryer
comb the knots out; my fringe sticks up; do my hair for school | hairbrush, hair accessory
I got my period; that time of the month and I have nothing with me | sanitary product
I need to go; I am bursting; my little girl has to wee | toilet
no paper left in the toilet; wipe my bottom | toilet paper
blow my nose; my nose drips; wipe her snotty nose; I am crying | tissue, handkerchief
chocolate all around his mouth; clean sticky fingers at the table | wipe, paper towel, tissue, cloth
feed the baby without a mess; the baby dribbles on his clothes | bib, high chair
the baby needs changing; he did a poo in his nappy; change the little one | diaper, changing table, baby wipes
listen whether the baby wakes up in the other room | baby monitor
take the baby for a walk in the park; she is too small to walk that far | stroller, baby carrier
drive with a small child safely | car seat
my daughter wants to build something; give the child something to do | building blocks, toy, puzzle, game
keep my nephew amused while the adults talk; the kids drive me mad, give them something | toy, game, television, book
family games night; something for all of us to play | game, puzzle, card game, toy
the children want to paint and glue; make a card for mummy | craft supplies, crayon, paint, paper, glue
let the little ones run about and get rid of their energy | ball, outdoor toy, trampoline
nothing good on, I want to watch a film; relax with a series tonight | television, projector, laptop
turn the volume down; switch over to the other programme; skip this advert | remote control
I want to hear some music while I cook; dance | speaker, radio, stereo
people keep talking and I need quiet | headphones, ear protection
protect my hearing near loud machines | ear protection
I would like a quiet evening with a good story; escape into another world | book, novel
my grandson gave me vinyl and I want to hear it | record player
let us sing and play together round the fire | guitar, musical instrument
the sun is out, let us go swimming; cool off in the water | swimming pool, swimwear, pool
my team needs two goals for a match | goal
I want to lose my belly; keep in shape at home; warm up my muscles; lift something heavy to get strong | exercise
    equipment, weights, yoga mat
rub my sore muscles after training | massage gun, foam roller
it pours, how do I get home dry; the clouds are black, take something with you; wet weather today; do not let me get
    wet | umbrella, rain gear
there are puddles everywhere and my shoes leak; wade through mud | rain boots, boots
it is minus ten out there; dress warmly; I feel the cold; winter is coming | jacket, winter coat, scarf, gloves, hat
I feel cold at my desk; my legs are cold while I watch TV; wrap up the old lady | blanket, cover, sweater
it is icy cold in the house; make it warm in here; no heat comes from the radiator | heater, fireplace
my bed is cold at night | blanket, duvet, electric blanket, heating pad
I am melting; phew, it is hot; the air stands still in this room; I am too warm | fan, air conditioner, window
the room smells of smoke; it stinks in the kitchen; air the room | window, fan, range hood, air freshener
the sun heats the room up; I cannot see my screen because of the sun; people can look in from the street; I want some
    privacy | curtain, blinds, window covering
nobody should see me while I change; hide the mess behind something | room divider, curtain
it gets dark early; I cannot read in this light; my eyes get tired, more light on the page; I can see nothing in the
    cellar | lamp, light, flashlight
see in the dark garden; look under the car; look behind the cupboard; the torch is for when the power fails |
    flashlight, lantern
all the lights are out, the power is off; blackout; no electricity tonight | candle, flashlight, lantern, matches
get at things on top of the wardrobe; I am too short for the upper cupboard; clean the top of a high window; paint the
    ceiling | ladder, stool
I dropped my ring behind the radiator; pick up something in a narrow gap | tongs, magnet, tweezers, gripping tool
I would like something wet, my mouth is dry; I want a sip; something cold and fizzy; get me a drink | drink, water,
    soda, juice, bottle
I have a drink but no vessel; what do I drink out of; put some water in for her | drinking glass, cup, mug
take water along on a hike; have a drink with me on the way; carry tea to work | water bottle, thermos, travel mug
tea for two; a nice hot cup, please; boil water | kettle, teapot, stove, pot
I am still half asleep, strong coffee please; brew some coffee | coffee machine, coffee pot, coffee
grind coffee beans | coffee grinder
drink it through something thin; he cannot lift his cup | straw
my stomach is rumbling; I have not eaten since this morning; give me some grub; the kids are hungry after school |
    food, snack, meal, sandwich, fruit
get a quick bite before the train; a small thing to eat on the way | snack, sandwich, fruit
give the dog something to eat; the kitten mews for food | pet food
something healthy for the kids' lunch box | fruit, vegetable, sandwich
I have a sweet tooth; treat myself; sugar craving | sweets, chocolate, cake, cookie
something savoury and crunchy with a beer | chips, nuts, snack
the chips need something on top; season the meat; too little salt in it | condiment, salt, spice
sweeten my tea | sugar, honey, sweetener
make dinner for the family; cook a pot of soup; boil the potatoes; the water must boil | pot, stove, cookware
fry an egg; brown the meat; cook with oil in it | pan, stove
my food has gone cold; warm a ready meal; heat milk for the baby; defrost the meat | microwave, stove
roast a chicken; bake bread; put the pizza in | oven, baking tray
cook outside; meat over fire; we have sausages and nice weather | grill, charcoal
keep drinks cold; it goes bad in the heat; where does the milk go; put the butter away so that it stays fresh; chill
    the wine | refrigerator, ice cube tray
keep food fresh for tomorrow; what is left of the meal; cover the salad so that it does not dry out | food storage
    container, foil, plastic wrap, refrigerator
cut meat; slice the bread; cut up fruit; dice vegetables; halve this | knife, kitchen knife, cutting board
cut it into slices by machine; chop a lot of vegetables fast | food processor, blender, knife
mix the dough; stir this; beat cream until stiff; fold in the flour | whisk, mixer, spoon, spatula
get the pasta water out; wash the berries | colander
take a hot dish off the stove; the baking tray burns; protect my hands from heat | oven mitt, towel, gloves
do not burn the table with the hot pot; protect the wood from a hot plate; wet glasses make rings | coaster, trivet,
    tablecloth
pick up hot food; turn the meat; serve the spaghetti | tongs, fork, spatula
scoop soup; serve gravy; give everybody some stew | ladle, spoon
eat soup; eat yoghurt; stir my tea | spoon
I cannot eat this with my fingers; four people eat, lay the places | cutlery, fork, plate
put the salad in; mix a dressing in it; hold the fruit on the table; have muesli in the morning | bowl
serve the cake; put the biscuits on it; we need something to eat off | plate, platter
bring six glasses out in one go; breakfast in bed on it; serve the guests their drinks | tray
open the beer; get the top off | bottle opener
the jar will not open; the lid is stuck tight; twist a tight cap off | opener, gripping tool, gloves
open canned food; there are beans in a tin and it is closed | can opener
wine for the guests and the bottle is closed with a cork | corkscrew
weigh myself; weigh a parcel; how many grams | scale
boil an egg for exactly five minutes; tell me when time is up | timer, clock, phone
cover the pot; keep the flies off the food | lid, foil
do the dishes; the pans are dirty; there is no clean cup left | sink, dishwasher, sponge, dishwashing liquid
let the clean plates drip; where do wet glasses go | dish rack
dry the plates | towel, dish towel
coffee all over my desk; the cup tipped over; water everywhere; someone dropped a drink; mop up a wet patch; it is wet
    here | paper towel, towel, cleaning cloth, mop, sponge
the dog peed on the floor; he threw up; clean up the sick | paper towel, mop, bucket, cleaning product
a glass fell down and broke; there is sand on the floor; sawdust everywhere; hair on the floor after the haircut;
    leaves blew in | broom, dustpan, sweeping tool, vacuum cleaner
crumbs on the sofa; hoover the rug; fluff under the bed; clean the inside of the car | vacuum cleaner
wash the floor; the tiles are dirty; footprints in the hall | mop, bucket, cleaning product
dust on the television; wipe the shelf; polish the wood; clean my screen; fingerprints on the glass | cleaning cloth,
    duster
grease on the stove; scrub the pan; burnt food sticks to the pot | sponge, cleaning product, dishwashing liquid
clean the bath; mould in the shower; kill the germs on the table; make everything hygienic | cleaning product, sponge
the shower glass is full of drops; see out of the dirty window | squeegee, cleaning product
the water does not go down in the shower; the basin is full and does not empty; hair in the drain; the toilet
    overflows | plunger, drain
water drips through the roof; catch the drops; carry water | bucket
red wine on the carpet; get a spot out of my blouse; grass stains | stain remover, cleaning product, sponge
wash these clothes; I have nothing clean to wear; the sheets are dirty; my jumper smells | washing machine, laundry
    supplies
collect the dirty washing; carry the laundry downstairs | laundry basket
dry my wet clothes; my socks are damp; the washed things must hang somewhere | clothes line, clothes dryer, rack
get the creases out; smooth out my dress; look neat at work | iron, ironing board, clothes steamer
keep my suit smooth; my jacket should not lie on the chair; hang this shirt up | clothes hanger, wardrobe, coat rack
where do guests leave their coats; take your jacket off; somewhere for my hat and coat | coat rack, coat hanger,
    wardrobe
dog hair on my black trousers | lint roller
my shoes look dirty for the party | shoe polish, cleaning cloth
wipe your feet; do not carry dirt into the house | door mat, rug
I cannot get my foot in the shoe | shoehorn
my feet hurt in these heels; walk about at home without shoes; cold tiles under my feet | slippers, light shoes, socks
throw this away; where does my banana skin go; rubbish; put the empty wrapper somewhere; get rid of it | trash can
sort the rubbish; glass, cans and cardboard do not go with the rest | recycling bin
take the rubbish out; collect leaves and garbage in it | trash bag
vegetable peelings for the garden | compost bin
it is broken; repair it; can you mend this; take it apart; it does not work any more, open it up | toolbox, tool,
    screwdriver
turn a screw; tighten the hinge; the handle wobbles; assemble furniture; take the back cover off | screwdriver, hex
    wrench, drill
a nail sticks out; hit something in; pull nails out of the wood | hammer, pliers, crowbar
hang a picture; fix a shelf on the wall; put hooks up | hammer, nail, drill, hardware
a bolt is too tight; undo a nut; the pipe joint must be tightened | wrench, pliers, gripping tool
make a hole in wood; drill through metal | drill, drill press
saw a plank; this board is too long; cut wood to size; fell a tree | saw, chainsaw, axe
cut wire; strip the end of a cable | wire cutter, wire stripper, pliers
hold the wood so that it does not move; keep two parts pressed together; both my hands are busy, hold this for me |
    clamp, vise
smooth the wood; take off rust; sharpen an edge | sandpaper, sander, file tool
it fell down and broke in pieces; the heel came off my shoe; the cup's handle came off; stick two things together |
    glue, tape
wrap tape around it; a torn page; seal a box; close the parcel; hold it together for now | tape, glue
keep pages in order; join two sheets | stapler, paper clip, glue, tape
bundle the cables; tie the branches; tie a knot; fasten it to the car; pull a load | rope, string, cable tie, strap
a hole in my sock; my trousers split; a seam is open | needle and thread, sewing supply, sewing machine, safety pin
keep the torn strap together for today | safety pin, tape
it squeaks when I open it; the bike chain is dry; rusty lock | lubricant, oil
fill the hole in the wall; the window lets cold air in | putty, tape
paint the room; new colour for the door | paintbrush, paint roller, paint
pull the paint off; get the old wallpaper off | scraper, sandpaper
cut the cardboard; open a box with tape on it; slit the plastic open | box cutter, knife, scissors
cut paper; cut my thread; cut the tag off; cut a picture out of a magazine; trim it | scissors, knife
measure the room; how wide is the door; does the cupboard fit in there; check the length | tape measure, length
    measure
is it level; put the shelf up straight | level
test if there is power; is the battery still good | multimeter
solder a wire; a contact has broken off the board | soldering iron
print it in plastic; make a spare part | 3d printer
look at tiny things; read a very small label; I cannot make out the letters | magnifying glass, glasses, microscope
watch the birds far away; see the ships out there | binoculars, telescope
write a list; note it down; I must not forget this; put my name on it; sign here; I need to jot something down | pen,
    pencil, paper, notebook, sticky notes
rub it out; I wrote it wrong | eraser, correction fluid
my pencil does not write any more, it is not sharp | pencil sharpener
show the class how it works; write where all can see it; draw a diagram for the group | whiteboard, writing board,
    marker
clean the board; remove what is written up there | whiteboard eraser, cleaning cloth
where is France; teach the children about countries | globe, map, atlas
put a paper up on the wall; pin the poster | thumbtack, tape, magnet, bulletin board
keep my papers tidy; file the bills; loose sheets go in it; store documents | folder, binder, filing cabinet, paper
    tray
make a copy; print my ticket; scan the contract | printer, copier, scanner
add up numbers; how much is it altogether; do my maths | calculator, phone
work on the computer; write emails; a place to do my homework; study in peace | desk, laptop, computer
talk to my family far away; ring the office; call an ambulance; call a taxi | phone
talk with a colleague by video | webcam, laptop, computer
my phone is almost empty; the tablet needs juice; the battery of my laptop is low; charge my mobile | charger, outlet,
    power bank, power strip
the cord is too short; too few sockets; plug in several things | extension cord, power strip, outlet
the clock has stopped; the remote is dead; the torch does not light any more | battery
save my files; hand over the photos; take data with me | usb stick, hard drive, data storage
connect to the network | router, cable
type something | keyboard, laptop
click on it; move the arrow on the screen | computer mouse
take a photo; record the party; make a video | camera, phone
show a film to the whole class; show a presentation to many people | projector, screen, television
speak to a crowd so that all can hear; sing in front of people | microphone, speaker, megaphone
it is my friend's birthday; make the room look festive; we throw a party | party decoration, balloon, cake
wrap a present; make the parcel pretty | wrapping paper, ribbon, tape
give my girlfriend something nice | flower, sweets, jewelry, gift
put the roses in water; cut flowers will die without water | vase
my plants are thirsty; water the garden; it has not rained for weeks | watering can, hose
plant seeds; repot the plant; where does the plant go | flower pot, potting soil, shovel
dig a hole in the earth; shovel snow | shovel
cut the lawn; the grass is up to my knees | lawn mower
cut the hedge; cut branches; the rose bush is too big | hedge trimmer, pruning shears
gather the leaves | rake, leaf blower
weeds grow between the plants | hoe, weed killer, garden tool
move heavy stones; bring sand to the back of the garden; a heavy load must go over there | wheelbarrow, cart
carry my shopping; bring these things to school; I have too many things for my hands | bag, backpack, basket, box
pack my clothes for the holidays; go away for a week; we fly tomorrow | suitcase, bag, backpack
put this away; where do I keep my things; store toys; this place is untidy | storage furniture, box, basket, shelf
put my books away | bookshelf, shelf
put my clothes away; where do clean socks go | dresser, wardrobe, drawer
put my glass down; a place beside the bed for my book | side table, coffee table, table
eat together; where do we have dinner; play cards at it | table, dining table
keep my money; pay with it; where is my cash | wallet, money
lock the bike; nobody should get in; secure the gate | lock, bike lock, chain
get in, it is locked; open the lock | key
someone is at the gate; visitors should be heard | doorbell, intercom
burglars; watch what happens when nobody is in | security camera, security system
it burns; fire in the waste bin; the toaster is in flames; the curtain caught fire; sparks everywhere and smoke | fire
    extinguisher, fire blanket
wake us if there is smoke; gas smells | smoke detector, alarm, carbon monoxide detector
get out fast; the building must be cleared | emergency exit, door
light the stove; make a fire; light the cigarettes | lighter, matches
it must be switched off in an emergency; turn it on or off | switch, button, control knob
keep my eyes safe; something may fly up when I grind | lab goggles
protect my head at work; ride a bike safely | helmet
drivers should see me at night | safety vest, bike light
keep my clothes clean when I bake; paint without ruining my shirt | apron, overalls, lab coat
close off the road; nobody may go in there; guard a wet floor | barrier, traffic cone
he cannot swim and is in the water | life buoy, life jacket
the tyre has no air; pump up a ball | bike pump, pump
a tyre burst on the road | spare tire, jack
scrape ice off the car | ice scraper
the battery of the car is empty | jumper cables
ride to school; go into town without a car | bicycle, scooter
go upstairs in a wheelchair; too many steps for her | elevator, ramp
take the dog out | leash
the dog wants to play; amuse the kitten | pet toy
the dog is thirsty | dog bowl
the cat scratches the sofa | cat tree
the cat has to poo indoors | litter box
the puppy is tired | pet bed, kennel
transport the rabbit | pet carrier
keep insects away; mosquitos; a wasp in the room; kill flies; cockroaches in the kitchen; a mouse in the cellar |
    insect repellent, fly swatter, mosquito net, pest control
I am ill and must stay in bed; measure my temperature; do I have a fever | thermometer
look at myself; put on my make-up; see how my new clothes look | mirror
get dressed for a funeral; dress smart; meet the boss | suit, dress, tie, dress shoes
my trousers are too wide and fall down | belt
the sun burns on my skin; a day at the beach; my nose gets red in the sun | sunscreen, hat, umbrella
the sun hurts my eyes while I drive | sunglasses
sit outside in the shade | umbrella, awning, gazebo, terrace
sleep in the wild; a night under the stars | tent, sleeping bag, hammock, camping gear
catch fish | fishing rod
find the way in the forest; which way is north | compass, map
cut rope or peel an apple on a hike | pocket knife
what is on my schedule; when is the meeting; which day is it | calendar, planner, phone
learn new things for school; look up a fact | book, textbook, encyclopedia, computer
look up a foreign word | dictionary
teach the kids to count | abacus, teaching aid
the washing-up water makes my hands rough; rubber ones for cleaning | gloves
keep a door from slamming; the door keeps closing | door stop
the table wobbles, put something under one leg | paper, furniture pad, coaster
keep papers from blowing away | paperweight
rest my wrists while I type | wrist rest, mouse pad
the chair hurts my bottom | cushion
my laptop gets hot and stands too low | laptop stand
make this dull wall nicer; the flat needs some colour | picture, painting, plant, poster
listen to the news; what is the weather going to be | radio, phone, television
I am lonely; cheer me up; cuddle something | stuffed animal, pet
""".strip()
"""Lines of situations, ";" between them, and behind "|" what helps; an indented line goes on with the one before."""
