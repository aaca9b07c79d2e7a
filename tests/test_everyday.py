"""The table of everyday things: names that other people's maps use, what does not pass for what, and what serves."""

from __future__ import annotations

import numpy as np
import pytest

from cgdb.meaning import everyday
from cgdb.meaning.knowledge import knowledge
from cgdb.meaning.traits import LONGEST_NAME
from cgdb.meaning.uses import frame
from cgdb.meaning.words import stemmed


def called(name: str) -> set[str]:
    """The things that a name of a map stands for."""
    known = knowledge()
    text = known.readable(name)
    return {known.names[i] for i in (*known.things_named(text), *known.contents_named(text))}


@pytest.mark.parametrize(
    ("name", "thing"),
    [
        ("ToiletPaperHanger", "toilet paper holder"),
        ("StoveBurner", "stove"),
        ("StoveKnob", "control knob"),
        ("AppleSliced", "apple"),
        ("SinkBasin", "sink"),
        ("HandTowelHolder", "towel rack"),
        ("longboard", "skateboard"),
        ("clothes_hamper", "laundry basket"),
        ("thermostat", "thermostat"),
        ("doorjamb", "door frame"),
        ("stovefan", "range hood"),
        ("wallpictureframe", "picture frame"),
        ("night_stand", "side table"),
        ("chest_of_drawers", "dresser"),
        ("handicap bar", "railing"),
        ("toilet seat cover dispenser", "toilet paper holder"),
        ("bathroom stall", "cubicle"),
        ("soap dish", "soap dish"),
        ("shower curtain rod", "curtain rod"),
        ("baseball glove", "baseball glove"),
        ("rubiks cube", "rubik's cube"),
        ("skillet lid", "lid"),
        ("bleach cleanser", "cleaning product"),
        ("cellular_telephone", "phone"),
        ("fireplug", "fire hydrant"),
        ("saltshaker", "salt"),
        ("file_(tool)", "file tool"),
        ("bannister", "railing"),
        ("windowpane", "window"),
        ("ashcan", "trash can"),
        ("attache case", "suitcase"),
        ("videocassette recorder", "streaming stick"),
        ("extractor hood", "range hood"),
        ("skirting board", "baseboard"),
        ("tumble dryer", "clothes dryer"),
        ("clothes horse", "clothes line"),
        ("extension lead", "extension cord"),
        ("zimmer frame", "walker"),
        ("tyre", "tire"),
        ("rocking horse", "rocking horse"),
        ("fuse box", "fuse box"),
        ("shop vac", "vacuum cleaner"),
        ("drip stand", "iv stand"),
        ("spin bike", "exercise bike"),
        ("bread bin", "bread box"),
    ],
)
def test_names_of_other_maps(name: str, thing: str) -> None:
    assert thing in called(name)


@pytest.mark.parametrize(
    ("name", "not_one"),
    [
        ("door frame", "picture frame"),
        ("walking frame", "picture frame"),
        ("toilet paper roll", "bun"),
        ("ToiletPaperHanger", "clothes hanger"),
        ("bicycle pump", "dress shoes"),
        ("pizza cutter", "box cutter"),
        ("hedge cutter", "box cutter"),
        ("bean bag", "leftovers"),
        ("motor oil", "oil"),
        ("garden fork", "fork"),
        ("waffle iron", "iron"),
        ("seat belt", "belt"),
        ("wheel chair", "chair"),
        ("windscreen", "screen"),
        ("bread box", "trash can"),
        ("shower screen", "screen"),
        ("basketball hoop", "ball"),
        ("pommel horse", "horse"),
        ("boiler suit", "suit"),
        ("sanitary towel", "towel"),
        ("coat tree", "tree"),
        ("toy bin", "trash can"),
        ("ear plugs", "power adapter"),
        ("sd card", "greeting card"),
        ("golf cart", "shopping cart"),
    ],
)
def test_what_a_name_only_ends_with_is_not_what_it_names(name: str, not_one: str) -> None:
    assert not_one not in called(name)


@pytest.mark.parametrize(
    "word",
    [
        "research", "start", "announcement", "enhancement", "platform", "background", "podcast", "legend", "playlist",
        "bluetooth", "workplace", "equivalent", "control", "stream", "uniform",
    ],
)  # fmt: skip
def test_words_that_happen_to_end_like_a_thing_stay_whole(word: str) -> None:
    assert knowledge().readable(word) == word


def test_every_name_can_be_found() -> None:
    for line in everyday.lines(everyday.TABLE):
        for name in line.partition("|")[0].replace(";", ",").split(","):
            assert 0 < len(stemmed(name)) <= LONGEST_NAME, name


@pytest.mark.parametrize(
    ("need", "thing"),
    [
        ("measure my temperature with", "thermometer"),
        ("measure flour with", "measuring cup"),
        ("weigh a parcel on", "scale"),
        ("unclog a drain with", "plunger"),
        ("drain pasta in", "colander"),
        ("crack nuts with", "nutcracker"),
        ("light a candle with", "lighter"),
        ("plug in a laptop", "power strip"),
        ("carry heavy boxes on", "cart"),
        ("keep a drink hot in", "thermos"),
        ("sharpen a pencil with", "pencil sharpener"),
        ("erase pencil", "eraser"),
        ("wrap a present in", "wrapping paper"),
        ("walk the dog on", "leash"),
        ("feed a cat", "pet food"),
        ("feed birds from", "bird feeder"),
        ("change a baby on", "changing table"),
        ("calm a crying baby with", "pacifier"),
        ("mow the lawn with", "lawn mower"),
        ("rake leaves with", "rake"),
        ("shovel snow with", "shovel"),
        ("sand wood with", "sandpaper"),
        ("solder wires with", "soldering iron"),
        ("inflate a tire with", "bike pump"),
        ("lift a car with", "jack"),
        ("cut my fingernails with", "nail clippers"),
        ("protect my ears", "ear protection"),
        ("protect my skin from the sun", "sunscreen"),
        ("keep mosquitoes away", "mosquito net"),
        ("store tools in", "tool cabinet"),
        ("park a bicycle at", "bike rack"),
        ("try clothes on in", "fitting room"),
        ("close a jar with", "lid"),
        ("knit a sweater with", "yarn"),
        ("find north with", "compass"),
        ("examine a patient on", "examination table"),
        ("get about in when I cannot walk", "wheelchair"),
        ("put out a fire with", "fire extinguisher"),
    ],
)
def test_what_serves_a_need_best_by_its_words(need: str, thing: str) -> None:
    known = knowledge()
    match = known.use_matches(frame(need))
    best = known.best_use(np.asarray(match.cover * match.agreement, dtype=np.float32), 0.1)
    assert best[known.names.index(thing)] == best.max() > 0.6
