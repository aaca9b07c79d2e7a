"""The options of the commands by which models add to maps: ``enrich``, ``caption``, ``relate`` and ``tag``."""

from __future__ import annotations

from typing import Any

from cgdb.cli.command_line import Parser, as_json, conversation, encoders, on_store, quiet, scenes


def add(commands: Any) -> None:
    """Add the commands."""
    _enrich(commands)
    _caption(commands)
    _relate(commands)
    _tag(commands)


def _enrich(commands: Any) -> None:
    enrich = on_store(
        commands,
        "enrich",
        "enrich:enrich",
        "ask a language model once what is known of each thing, and keep it as properties",
        "cgdb enrich home.cgdb --dry-run",
    )
    scenes(enrich)
    enrich.add_argument(
        "--robot", default="a wheeled robot of 5 kg", help="for whom things are traversable (a wheeled robot of 5 kg)"
    )
    enrich.add_argument("--batch", type=int, default=8, metavar="N", help="descriptions per call (8)")
    _by_model(enrich)


def _caption(commands: Any) -> None:
    caption = on_store(
        commands,
        "caption",
        "enrich:caption",
        "caption and name the objects of a map by their best views, with a vision model",
        "cgdb caption home.cgdb --dry-run",
    )
    scenes(caption)
    caption.add_argument("--views", type=int, default=10, metavar="N", help="views of each object (10)")
    caption.add_argument(
        "--together", action="store_true", help="all views of an object in one call, for models that take many pictures"
    )
    caption.add_argument("--again", action="store_true", help="also objects that have a caption")
    caption.synonyms = {"--replace": "--again"}
    _paced(caption)


def _relate(commands: Any) -> None:
    relate = on_store(
        commands,
        "relate",
        "enrich:relate",
        "ask a language model how things that touch or overlap stand to each other",
        "cgdb relate home.cgdb --dry-run",
    )
    scenes(relate)
    relate.add_argument(
        "--every-pair", action="store_true", help="all pairs that touch, not only a spanning forest of the strongest"
    )
    relate.add_argument(
        "--reach", type=float, default=0.025, metavar="M", help="metres by which each box is made larger (0.025)"
    )
    relate.add_argument("--batch", type=int, default=6, metavar="N", help="pairs per call (6)")
    _paced(relate)


def _tag(commands: Any) -> None:
    tag = on_store(
        commands,
        "tag",
        "tagging:tag",
        "give objects without a name the names of a vocabulary that they look most like, by CLIP",
        "cgdb tag home.cgdb --vocabulary names.txt --dry-run\n\n"
        "FILE holds a name on each line, or a JSON list; names.npz (names, vectors), or names.json beside names.npy, "
        "holds\nvectors computed elsewhere, and needs no CLIP here",
    )
    tag.add_argument("--vocabulary", required=True, metavar="FILE", help="the names, as below")
    scenes(tag)
    tag.add_argument("--space", help="the feature space to compare in (the first with an encoder)")
    tag.add_argument("--top", type=int, default=5, metavar="N", help="tags of an object, the nearest first (5)")
    tag.add_argument("--replace", action="store_true", help="tag named things too; the name is kept as tag_before")
    tag.synonyms = {"--again": "--replace"}
    tag.add_argument("--dry-run", action="store_true", help="say what would be tagged, and write nothing")
    _done(tag)
    encoders(tag)


def _paced(parser: Parser) -> None:
    """Of what asks a model for every object of a map, or every pair."""
    parser.add_argument("--workers", type=int, default=4, metavar="N", help="calls at a time (4)")
    parser.add_argument("--per-minute", type=float, metavar="N", help="calls that are begun within a minute at most")
    _by_model(parser)


def _by_model(parser: Parser) -> None:
    """Of what asks a language model."""
    parser.add_argument("--dry-run", action="store_true", help="say what it would take, and ask nothing")
    _done(parser)
    conversation(parser)


def _done(parser: Parser) -> None:
    """How it is told what was done."""
    as_json(parser, "what was done, as JSON on stdout")
    quiet(parser)
