"""English word lists that the shallow parse of captions and questions goes by."""

from __future__ import annotations

from collections.abc import Mapping


def _words(text: str) -> frozenset[str]:
    return frozenset(text.split())


FUNCTION_WORDS = _words(
    """a an the this that these those it its it's he she they them their his her my your our me you i we us one ones
    some any each every either both all is are was were be been being am do does did done has have had having can
    could may might must shall should will would and or nor but if than then so as too very quite rather really just
    only also even still there here where when who whom which what whose how why to of in on at by for from with
    without within into onto upon over under above below behind beside besides between among near next through
    across along around about against off out up down not no yes other another else such same like unlike except
    instead something anything somewhere anywhere someone anyone somebody anybody thing things object objects item
    items stuff kind kinds type types sort sorts piece pieces example use used using want wants need needs get gets
    find finds found make makes let lets please show give tell me place places area spot located possibly likely
    probably maybe perhaps appears seems contains containing visible seen image view background front top bottom
    side left right middle center centre corner part lot lots many much more most few several two three four five
    six seven eight nine ten first second third someone's s t d ll re ve m"""
)
COMMON_WORDS = _words(
    """room wall floor ceiling house home indoor inside outside white black grey gray brown red blue green yellow
    orange pink purple beige cream tan silver gold dark light bright color colored colour coloured large big small
    little tiny huge long short tall wide narrow round square rectangular thick thin flat new old good nice
    made set open closed empty full hang hanging mount mounted sit sitting stand standing lie lying put take go come
    hold keep look day time way person people man woman wood wooden metal plastic glass surface pattern patterned
    decorative modern simple plain comfortable different various"""
)
ADJECTIVES = _words(
    """white black grey gray brown red blue green yellow orange pink purple beige cream tan silver gold golden dark
    light bright large big small little tiny huge long short tall wide narrow round square rectangular circular oval
    cylindrical thick thin flat new old wooden metallic soft hard rigid heavy empty full open closed lit striped
    patterned floral decorative modern plain solid transparent rectangle shaped colored coloured upholstered horizontal
    vertical comfortable cozy clean dirty electric electrical stainless"""
)
RELATION_WORDS = _words(
    """on in at by under underneath beneath above below over behind beside between among near next against along
    around across inside outside within onto upon into through from for with without in-between adjacent atop that
    which who where while when because containing holding showing depicting featuring covering attached located
    placed positioned situated mounted hanging sitting standing lying leaning resting surrounded connected filled
    covered decorated sits stands lies hangs rests leans has have having is are was were can could to as facing
    beneath toward towards off up down seen likely possibly probably potentially either used made"""
)
HEDGES = _words("likely possibly probably potentially either seen")
PARTITIVES = _words(
    """corner base part piece pair set bunch stack pile group row one end side edge top bottom front back view kind
    type sort section portion bit couple number lot collection half rest variety series cluster close-up closeup some
    two three four five six seven eight nine ten many several most all both each roll sheet bar slice"""
)
GENERIC_HEADS = _words(
    """something anything somewhere anywhere thing things object objects item items stuff place places area spot
    someone anyone what where which who how i you we find show give get"""
)
NOUNS_TOO = _words("light square orange gold silver cream solid circular electric open")
"""Adjectives that are the noun where they end the phrase: "ceiling light"."""
DEPICTIONS = _words(
    """picture photo photograph photography painting drawing image print poster portrait illustration sketch view
    mural sculpture statue figurine model toy"""
)
"""What shows a thing and is none: "a photo of a boat"."""
DETERMINERS = _words("a an the this that these those its his her their my your our some any another")
PRONOUNS = _words("it this that these those they he she there its it's they're")
IRREGULAR: Mapping[str, str] = {
    "shelves": "shelf", "knives": "knife", "wolves": "wolf", "leaves": "leaf", "loaves": "loaf", "scarves": "scarf",
    "halves": "half", "lives": "life", "wives": "wife", "calves": "calf", "feet": "foot", "teeth": "tooth",
    "geese": "goose", "mice": "mouse", "men": "man", "women": "woman", "children": "child", "people": "person",
    "dice": "die", "oxen": "ox", "sheep": "sheep", "series": "series", "species": "species", "tv": "television",
    "tvs": "television", "fridge": "refrigerator", "fridges": "refrigerator", "sofas": "sofa", "photo": "photograph",
    "photos": "photograph", "grey": "gray", "colour": "color", "colours": "color", "coloured": "color",
    "colored": "color",
    "centre": "center",
    "worn": "wear", "wore": "wear", "sat": "sit", "held": "hold", "kept": "keep", "drunk": "drink", "drank": "drink",
    "ate": "eat", "eaten": "eat", "slept": "sleep", "wrote": "write", "written": "write",
    "bus": "bus", "gas": "gas", "lens": "lens", "always": "always", "this": "this", "scissors": "scissor",
    "shoes": "shoe", "toes": "toe", "hoes": "hoe", "canoes": "canoe", "buses": "bus", "lenses": "lens",
}  # fmt: skip
BRANDS = _words(
    """coca-cola coke pepsi sprite fanta lego kleenex roomba alexa google amazon playstation xbox nintendo macbook ipad
    iphone kindle imac chromebook gopro arduino raspberry sharpie post-it tupperware barbie monopoly velcro"""
)
"""Names of one maker's things: who asks for one wants the word, not the kind."""
PREPOSITIONS = _words(
    """with by in on at from into onto under over through behind beside against to for of off about around inside near
    upon across between without along using"""
)
PARTICLES = _words("up down away out back together apart along off over around aside")
"""Words that belong to the verb before them: "throw away", "lie down"."""
PATIENT_VERBS = _words(
    "drink eat read wear sip nibbl tast chew bit snack throw kick catch studi study cuddl lift solv smok"
)
"""Stems of verbs that are done to the thing where nothing else is named: "something to read"."""
LIGHT_VERBS = _words("mak get keep tak put us hav do help go giv let hold find bring set mov")
"""Stems of verbs that say little: what is made or kept tells more."""
SYNONYMS = """
repair fix mend patch restore
cook fry bake boil roast grill simmer
heat warm reheat
cut slice chop carve trim snip shred dice
throw discard dispose toss bin dump trash
rubbish garbage trash waste litter scrap peel wrapper wastepaper junk crumb
write jot scribble note sign
draw sketch doodle paint color
clean wash scrub rinse wipe tidy
sweep vacuum mop hoover dust
sit seat perch
lie sleep nap rest doze snooze relax lounge recline
carry transport haul bring lug
store keep stash stow put place save hold leave organize
fasten attach secure bind tie join connect hold stick clip
cool chill refrigerate freeze
play perform strum
watch see view look
movie film show video news series program match game
music song tune melody piece
listen hear
photo picture image photograph portrait selfie
measure gauge
weigh weight
open unlock uncork
drink sip gulp
eat snack nibble munch dine
wear dress
light illuminate brighten lighten
rain wet storm rainstorm downpour
cold winter chilly frost snow
hot heat summer
protect shield guard
call phone ring telephone dial
type email write
search browse surf
internet web online
dig plant
drill bore
hammer nail pound
tighten loosen turn
screw unscrew
dismantle disassemble
sew stitch embroider
iron press
wrinkle crease
brush comb
tooth teeth
hang mount suspend
decorate adorn
learn study
travel ride drive commute cycle
ship mail send post
exercise train workout
entertain amuse play
child kid toddler baby
friend guest family
clothes clothing garment laundry shirt outfit
dish plate crockery tableware
leftovers food meal lunch dinner breakfast
beverage drink coffee tea water juice
letter mail envelope
money cash coin
headache pain ache migraine
wound cut injury bleed scratch
fire flame blaze
germ bacteria virus
dust dirt crumb
spill puddle
time hour clock
wake awaken
comfortable comfortably comfort comfy cosy cozy snug
temporarily briefly quickly provisionally
smell scent odor fragrance
bore dig
steal thief burglar
homework essay assignment study
"""
"""Words of like meaning, one group a line: what a verb or an object of a use may be called instead."""
IDIOMS: Mapping[str, str] = {
    "pass the time": "have fun", "pass time": "have fun", "pass my time": "have fun", "kill time": "have fun",
    "kill some time": "have fun", "while away": "have fun", "have a good time": "have fun",
    "take apart": "disassemble", "take to pieces": "disassemble", "get rid of": "discard", "work out": "exercise",
    "get fit": "exercise", "keep fit": "exercise", "stay fit": "exercise", "stay in shape": "exercise",
    "go to sleep": "sleep", "take a nap": "nap", "have a nap": "nap", "take a seat": "sit", "have a seat": "sit",
    "have a drink": "drink", "have a snack": "snack", "take a rest": "rest", "have a rest": "rest",
    "make a phone call": "call", "make a call": "call", "have a look at": "look at", "take a look at": "look at",
    "do the dishes": "wash dishes", "do the washing up": "wash dishes", "do the laundry": "wash clothes",
    "do my laundry": "wash clothes",
}  # fmt: skip
"""Turns of phrase whose words do not say what they mean, and words that do."""
CREATING = _words("mak sew build knit crochet weav craft construct creat")
"""Stems of verbs that bring something about: one does it with what one does it from."""
NOT_ADVERBS = _words(
    "fly apply rely reply supply multiply rally tally family jelly belly bully lily assembly butterfly"
)
"""Words in -ly that are no adverbs."""
PACKAGES = _words("bottle can carton box packet pack package bag jar tin tube container dispenser")
"""What goods are sold in: "milk bottle"."""
VESSELS = PACKAGES | _words("mug cup glass bowl plate pot jug basket bucket tray pitcher crate sack vase dish")
"""What is called by what it holds: "a mug of green tea" is a mug, and tea."""
PLACE_HEADS = _words("somewhere anywhere where place places spot area")
POSTURES = _words("sit ly sleep stand loung relax nap reclin perch doz kneel crouch squat")
"""Stems of verbs that are done in or on a place, said or not: "somewhere comfortable to sit"."""
CLAUSE_STARTS = _words(
    """to i you we one can could should would may might must that which what where do does for used use using help helps
    me us it is want wants need able let lets people someone will and be"""
)
"""What stands before the verb of a use: "something that I could use to ..."."""
SUBCLAUSES = _words("when while because so if after before during until than as")
HEAPS = _words("pile slice set pair stack bunch piece product item")
"""What follows a noun without being another thing: "a clothes pile" is clothes."""
