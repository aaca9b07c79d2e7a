"""The made-up worlds that the benchmarks measure: furnished rooms of any size, the same at each run.

Twenty things to a room of 4 m x 4 m: six pieces of furniture, the rest small things on them. Each thing has a tag, a
caption that hardly any other has, a 512-d vector near that of its tag, and three relations.
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

import cgdb
from cgdb.database import Database
from cgdb.meaning.embed import Encoder

DIMENSION = 512
SPACE = "pictures"
ROOM = 20
FURNITURE = [
    "table",
    "chair",
    "sofa",
    "shelf",
    "bed",
    "desk",
    "cabinet",
    "stool",
    "bench",
    "dresser",
    "counter",
    "nightstand",
]
SMALL = [
    "cup",
    "plate",
    "bowl",
    "book",
    "lamp",
    "pillow",
    "vase",
    "clock",
    "phone",
    "laptop",
    "keyboard",
    "bottle",
    "glass",
    "knife",
    "fork",
    "spoon",
    "pan",
    "kettle",
    "plant",
    "basket",
    "box",
    "towel",
    "candle",
    "mirror",
    "toy",
    "camera",
    "pen",
    "scissors",
    "hat",
    "shoe",
]
COLOURS = ["red", "blue", "green", "white", "black", "brown", "grey", "yellow", "orange", "purple"]
MATERIALS = ["wooden", "plastic", "metal", "glass", "ceramic", "leather", "cotton", "bamboo"]
LOOKS = ["small", "large", "old", "new", "round", "square", "striped", "plain", "dusty", "shiny", "tall", "low"]
PLACES = ["window", "door", "wall", "corner", "radiator", "heater", "fireplace", "balcony", "staircase", "curtain"]
QUESTIONS = tuple(
    f"{look} {colour} {tag}" for tag in ("cup", "book", "lamp", "bottle") for colour in COLOURS for look in LOOKS
)
"""Texts to ask for: each query of a benchmark asks another one, as people do."""
BATCH = 1_000


def objects(count: int) -> Iterator[cgdb.SceneObject]:
    """The things of a world, by id from 0."""
    tags = FURNITURE + SMALL
    means = np.random.default_rng(1).standard_normal((len(tags), DIMENSION)).astype(np.float32)
    side = int(np.ceil(np.sqrt(count / ROOM)))
    for start in range(0, count, BATCH):
        dice = np.random.default_rng((2, start))
        noise = dice.standard_normal((BATCH, DIMENSION)).astype(np.float32)
        for i in range(start, min(start + BATCH, count)):
            room, place = divmod(i, ROOM)
            furniture = place < 6
            tag = int(dice.integers(len(FURNITURE)) if furniture else dice.integers(len(FURNITURE), len(tags)))
            at = np.array([room % side, room // side]) * 4.5
            under = at + 0.7 + 1.1 * np.array([place % 6 % 3, place % 6 // 3])
            size = np.array([0.8, 0.6, 0.7]) if furniture else dice.uniform(0.05, 0.2, 3)
            offset = np.zeros(2) if furniture else dice.uniform(-0.3, 0.3, 2)
            bottom = 0.0 if furniture else 0.7
            look, colour = LOOKS[dice.integers(len(LOOKS))], COLOURS[dice.integers(len(COLOURS))]
            material, near = MATERIALS[dice.integers(len(MATERIALS))], PLACES[dice.integers(len(PLACES))]
            other = tags[dice.integers(len(tags))]
            yield cgdb.SceneObject(
                id=i,
                tag=tags[tag],
                caption=f"a {look} {colour} {material} {tags[tag]} near the {near}, beside a {other}",
                center=np.array([*(under + offset), bottom + size[2] / 2]),
                extent=size,
                features={SPACE: means[tag] + noise[i - start]},
                confidence=round(float(dice.uniform(0.5, 1.0)), 3),
                properties={"price": round(float(dice.uniform(1, 100)), 2)},
            )


def relations(count: int) -> Iterator[cgdb.Relation]:
    """Per thing three relations: on its furniture, next to and near two others of its room."""
    dice = np.random.default_rng(3)
    for i in range(count):
        room, place = divmod(i, ROOM)
        there = min(ROOM, count - room * ROOM)
        if place >= 6:
            yield cgdb.Relation(source=i, target=room * ROOM + place % 6, label="on", origin="geometry")
        others = [room * ROOM + other for other in range(there) if other != place]
        chosen = dice.choice(len(others), min(len(others), 2 if place >= 6 else 3), replace=False) if others else ()
        for number, other in enumerate(chosen):
            label = "next_to" if number % 2 else "near"
            yield cgdb.Relation(
                source=i, target=others[int(other)], label=label, origin="geometry", confidence=0.6 + 0.05 * (i % 8)
            )


def write(db: Database, count: int) -> None:
    """Write a world into a store, as one revision."""
    with db.write("world", spaces=[cgdb.FeatureSpace(name=SPACE, dimension=DIMENSION)]) as writer:
        writer.objects(objects(count))
        writer.relations(relations(count))


def give_caption_vectors(db: Database, encoder: Encoder) -> int:
    """Give every text of a store a vector without running the model on it; returns how many texts.

    A text gets the mean of its words' vectors: as many numbers, and as near to what is asked, as the model's own
    would be, in a hundredth of the time. How long the model takes is measured apart.
    """
    texts = list(db.view("world").degrees.missing_texts(encoder))
    split = [text.replace(",", "").split() for text in texts]
    words = sorted({word for text in split for word in text})
    vectors = dict(zip(words, encoder.texts(words), strict=True))
    for start in range(0, len(texts), BATCH):
        block: NDArray[np.float32] = np.stack(
            [np.mean([vectors[word] for word in text], axis=0) for text in split[start : start + BATCH]]
        )
        block /= np.linalg.norm(block, axis=1, keepdims=True)
        db._kept.put(encoder.name, texts[start : start + BATCH], block)
    db.view("world").degrees.refresh()
    return len(texts)


def store(folder: Path, count: int, encoder: Encoder | None) -> Path:
    """A store with a world, all its indexes and, by an encoder, all text vectors; made unless it is there."""
    path = folder / f"world-{count}.cgdb"
    done = folder / f"world-{count}.{'texts' if encoder else 'plain'}"
    if not done.exists():
        with cgdb.open(path, create=True) as db:
            if not db.scenes():
                write(db, count)
            db.prepare()
            if encoder is not None:
                give_caption_vectors(db, encoder)
                _ = db.query(f'MATCH (o ~ "{QUESTIONS[0]}") RETURN o LIMIT 1')
        done.touch()
    return path
