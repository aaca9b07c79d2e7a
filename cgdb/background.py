"""The background: everyday things that a text is compared with before it is said to fit an object."""

from __future__ import annotations

_THINGS = """
chair; armchair; office chair; sofa; bench; stool; ottoman; bed; mattress; crib; dining table; coffee table; desk;
side table; nightstand; cabinet; wardrobe; dresser; bookshelf; drawer; sideboard; kitchen counter; sink; faucet; toilet;
bathtub; shower; mirror; towel; soap dispenser; toothbrush; toilet paper; hair dryer; washing machine; clothes dryer;
iron; ironing board; laundry basket; trash can; recycling bin; broom; mop; vacuum cleaner; bucket; refrigerator; oven;
stove; microwave oven; dishwasher; toaster; coffee machine; kettle; blender; frying pan; pot; knife; fork; spoon; plate;
bowl; cup; mug; wine glass; bottle; water bottle; can of beer; jar; cutting board; bread; apple; banana; orange;
vegetables; pizza; cake; sandwich; cereal; milk; cheese; egg; snack; lamp; floor lamp; ceiling light; candle; lantern;
flashlight; window; curtain; window blinds; door; door handle; wall; floor; ceiling; carpet; rug; staircase; fireplace;
radiator; air conditioner; fan; heater; vent; electrical outlet; light switch; thermostat; smoke detector;
fire extinguisher; television; computer monitor; laptop; keyboard; computer mouse; printer; phone; tablet; headphones;
speaker; camera; remote control; game console; router; charger; cable; battery; robot; clock; watch; calendar; book;
magazine; newspaper; notebook; pen; pencil; scissors; stapler; tape; glue; ruler; paper; envelope; cardboard box;
backpack; handbag; suitcase; wallet; umbrella; keys; glasses; sunglasses; hat; shoes; boots; socks; shirt; trousers;
dress; jacket; coat; gloves; scarf; belt; tie; clothes hanger; pillow; cushion; blanket; bed sheet; potted plant;
flower; vase; tree; painting; photograph; poster; picture frame; sculpture; figurine; toy; teddy bear; doll; toy car;
puzzle; board game; ball; basketball; tennis racket; bicycle; skateboard; helmet; dumbbell; yoga mat; treadmill; guitar;
piano; drum; violin; hammer; screwdriver; wrench; drill; saw; pliers; nails; ladder; toolbox; rope; chain; lock; hose;
shovel; wheelbarrow; lawn mower; fence; car; truck; motorcycle; bus; train; boat; airplane; traffic light; street sign;
road; bridge; building; house; tent; sleeping bag; dog; cat; bird; fish; aquarium; horse; person; baby; wheelchair;
stroller; medicine; bandage; thermometer; syringe; microscope; telescope; whiteboard; blackboard; projector;
filing cabinet; shelf; rack; pallet; crate; barrel; conveyor belt; forklift; pipe; valve; engine; solar panel; brick;
stone; sand; grass; river; mountain; beach; sky
"""


def texts() -> tuple[str, ...]:
    """The phrases whose vectors a Scorer takes as its background, in a fixed order."""
    return tuple(name.strip() for name in _THINGS.replace("\n", " ").split(";"))
