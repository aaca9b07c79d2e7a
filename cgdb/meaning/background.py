"""The background: phrases about everyday things, with which a question is compared before it is said to fit an object.

A cosine of 0.4 means nothing by itself: some questions are near to everything. It means much when the question is far
from five hundred other things. The phrases are the names and uses in the table of everyday things, so that
their vectors, made once per encoder and cached by the caller, serve the contrast and the knowledge alike.
"""

from __future__ import annotations

from cgdb.meaning.knowledge import knowledge


def texts() -> tuple[str, ...]:
    """The phrases whose vectors a Scorer takes as its background, in a fixed order."""
    return knowledge().texts()


def names() -> tuple[str, ...]:
    """The names that texts() begin with, one per line of the table: what a question is contrasted with."""
    return knowledge().names[: knowledge().n_lines]


def version() -> str:
    """Changes whenever texts() does: part of the key under which the vectors are cached."""
    return knowledge().version
