"""What the commands' lines have in common: the parser with this project's errors, how a command is added, and the
options that several of them take."""

from __future__ import annotations

import argparse
import re
from collections.abc import Container, Mapping, Sequence
from types import MappingProxyType
from typing import Any, NoReturn

from cgdb.errors import UsageError, did_you_mean


class Parser(argparse.ArgumentParser):
    """argparse, with this project's kind of error.

    commands: what there is to call. synonyms: {a word: the option it stands for}: how other commands call the same,
    which their people try here too; the help does not list them.
    """

    commands: Container[str] = ()
    synonyms: Mapping[str, str] = MappingProxyType({})

    def parse_known_args(self, args: Any = None, namespace: Any = None) -> tuple[Any, list[str]]:
        """As argparse does it, each synonym as its option."""
        return super().parse_known_args(None if args is None else self._own_words(args), namespace)

    def _own_words(self, words: Sequence[str]) -> list[str]:
        # After -- no word is an option.
        end = words.index("--") if "--" in words else len(words)
        parts = (word.partition("=") for word in words[:end])
        return [self.synonyms.get(name, name) + equals + value for name, equals, value in parts] + [*words[end:]]

    def error(self, message: str) -> NoReturn:
        """UsageError, with a hint of what was meant."""
        hint = f"{self.prog} --help"
        words = message.split("'")
        if "invalid choice" in message and len(words) > 1:
            near = did_you_mean(words[1], words[3::2])
            # One name that is near says more than all the names.
            message, hint = (message.partition(" (choose from")[0], near) if near else (message, hint)
        greedy = [action.option_strings[0] for action in self._actions if action.option_strings and action.nargs == "+"]
        if greedy and message.endswith("required: STORE"):
            message = f"STORE is missing: all words after {' or '.join(greedy)} belong to that option"
            hint = f"{self.prog} STORE {greedy[0]} ...: the store comes first"
        raise UsageError(message, hint=hint)

    def refuse(self, words: Sequence[str]) -> NoReturn:
        """UsageError for words that no option and no place is there for."""
        hint = f"{self.prog} --help"
        if words[0].startswith("-"):
            known = re.findall(r"(?<![\w-])--[\w-]+", self.format_help())
            hint = did_you_mean(words[0].partition("=")[0], known) or hint
        elif any(action.metavar in ("CGQL", "QUESTION", "TEXT") for action in self._actions):
            hint = "what has spaces stands in quotes"
        raise UsageError(f"unrecognized arguments: {' '.join(words)}", hint=hint)


def command(commands: Any, name: str, home: str, says: str, example: str) -> Parser:
    """Add a command. home: MODULE:FUNCTION of cgdb.cli, imported when it is called; says: its help in a line."""
    module, function = home.split(":")
    parser: Parser = commands.add_parser(
        name,
        help=says,
        description=says[0].upper() + says[1:] + ".",
        epilog=f"example:\n  {example}",
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.set_defaults(module=f"cgdb.cli.{module}", function=function, parser=parser, last=None)
    return parser


def on_store(commands: Any, name: str, home: str, says: str, example: str) -> Parser:
    """Add a command whose first word is the store."""
    parser = command(commands, name, home, says, example)
    parser.add_argument("store", metavar="STORE", help="the folder of the store")
    return parser


def written(option: str) -> dict[str, str]:
    """Synonyms of the option that says where a command writes: all that any command has for it."""
    return dict.fromkeys(("--into", "-o", "--output", "--save"), option)


def scenes(parser: Parser, says: str = "this scene only (may be repeated)") -> None:
    """--scene NAME, any number of times."""
    parser.add_argument("--scene", action="append", help=says)


def quiet(parser: Parser, says: str = "no progress, no summary") -> None:
    """--quiet."""
    parser.add_argument("--quiet", action="store_true", help=says)


def as_json(parser: Parser, says: str = "as JSON") -> None:
    """--json, of a command with one such form."""
    parser.add_argument("--json", action="store_true", help=says)


def formats(parser: Parser) -> None:
    """How rows are written."""
    parser.add_argument(
        "--format", choices=("table", "json", "jsonl", "csv", "markdown"), help="how rows are written (table)"
    )
    parser.add_argument("--json", action="store_const", const="json", dest="format", help="the same as --format json")
    parser.add_argument("--why", action="store_true", help="say of every row why it is there")
    parser.add_argument("--all", action="store_true", help="show every row of a table, not the first 20")


def parameters(parser: Parser) -> None:
    """-p NAME=VALUE, any number of times."""
    parser.add_argument(
        "-p",
        dest="parameters",
        action="append",
        default=[],
        metavar="NAME=VALUE",
        help="a parameter: a number, true, false, null, a JSON list, @FILE with a vector, or else a text",
    )


def encoders(
    parser: Parser,
    says: str = "the encoder of a feature space, such as clip=vocabulary:names.npz or clip=open_clip:ViT-B-32:openai",
) -> None:
    """--encoder SPACE=ENCODER, any number of times."""
    parser.add_argument("--encoder", action="append", default=[], metavar="SPACE=ENCODER", help=says)


def reranker(parser: Parser) -> None:
    """--rerank NAME."""
    parser.add_argument(
        "--rerank",
        metavar="NAME",
        help="who reads the best rows once more: model, or cross: and a cross-encoder's folder or name",
    )


def conversation(parser: Parser) -> None:
    """Which language model is spoken with, if any."""
    parser.add_argument("--no-model", action="store_true", help="ask no language model")
    parser.add_argument("--record", metavar="FILE", help="record what the model is asked and says")
    parser.add_argument("--replay", metavar="FILE", help="answer from such a record, without a model")
