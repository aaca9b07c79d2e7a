"""What captions themselves say of where things are ("a backpack on a tiled floor"), asked by their words.

A map of captions may hold no box and no relation of the other thing, or not even that other thing: the tiles of a
floor, the tree that is printed on a pillow. Then only the words of the caption tell.
"""

from __future__ import annotations

from collections.abc import Mapping

from cgdb.english import tree_parts as parts
from cgdb.english.tree_parts import SUBJECT
from cgdb.grammar import ast
from cgdb.meaning.knowledge import knowledge
from cgdb.meaning.words import parse, singular

MOST_NAMES = 2
"""Names of one thing that are looked for ("sofa", "couch")."""

_RELATION_WORDS: Mapping[str, tuple[str, ...]] = {
    "on": (" on ",),
    "attached": (" on ", " from ", " attached "),
    "in": (" in ", " inside "),
    "under": (" under", " below ", " beneath "),
    "above": (" above ", " over ", " on "),
    "between": (" between ",),
}
"""What a caption says of each relation; of being near something, or on a side of it, that it is mentioned at all."""


def mentions(anchor: str) -> ast.Expression | None:
    """That the caption names a thing, by one of its names; None where its name says too little."""
    heads = parse(anchor).heads
    if not heads:
        return None
    name = heads[0].split()[-1]
    found = dict.fromkeys((singular(name), name, *_other_names(heads[0])))
    short = [word for word in found if len(word) > 2]
    # "Tile" stands in "tiles" too; a word begins behind a blank.
    kept = [word for word in short if not any(word != one and word.startswith(one) for one in short)]
    return parts.any_of([_says(f" {word}") for word in kept[:MOST_NAMES]]) if kept else None


def places(name: str, anchor: str) -> ast.Expression | None:
    """That the caption says that something is so placed to a thing. name: one of the relations of cues, or ""."""
    named = mentions(anchor)
    if named is None:
        return None
    said = _RELATION_WORDS.get(name, ())
    return parts.all_of([parts.any_of([_says(word) for word in said]), named]) if said else named


def _other_names(phrase: str) -> list[str]:
    """The names, of one word each, under which common knowledge has the same thing."""
    known = knowledge()
    things = known.things_named(phrase)
    same = (words for words, found in known.thing_by_name.items() if found == things and len(words) == 1)
    return [words[0] for words in same] if len(things) == 1 else []


def _says(text: str) -> ast.Expression:
    return ast.Contains(text=ast.Property(variable=SUBJECT, name="caption"), part=ast.Text(value=text))
