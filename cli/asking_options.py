"""The options of the commands that ask a store: ``query``, ``search``, ``shell``, ``plot`` and ``ask``."""

from __future__ import annotations

import argparse
from typing import Any

from cgdb.cli.command_line import conversation, encoders, formats, on_store, parameters, reranker, scenes, written


def add(commands: Any) -> None:
    """Add the commands."""
    _query(commands)
    _search(commands)
    _shell(commands)
    _plot(commands)
    _ask(commands)


def _query(commands: Any) -> None:
    query = on_store(
        commands,
        "query",
        "asking:query",
        "answer a CGQL statement",
        """cgdb query home.cgdb 'MATCH (l ~ "lamp") WHERE distance(l, #12) < 150 cm RETURN l'""",
    )
    query.add_argument("text", metavar="CGQL", help="the statement; - reads it from stdin")
    parameters(query)
    encoders(query)
    query.add_argument("--timeout", type=float, metavar="SECONDS", help="give up after so long")
    reranker(query)
    formats(query)


def _search(commands: Any) -> None:
    search = on_store(
        commands,
        "search",
        "asking:search",
        "the nearest objects to a text or a vector",
        "cgdb search home.cgdb @query.npy --space clip -k 5",
    )
    search.add_argument("what", metavar="TEXT", help="a text, or @FILE with a vector (.npy or a JSON list)")
    search.add_argument("--space", help="the feature space to compare in")
    search.add_argument("-k", type=int, default=10, help="how many (10)")
    scenes(search, "search this scene only (may be repeated)")
    search.add_argument("--where", metavar="CONDITION", help="a CGQL condition on the object o")
    parameters(search)
    encoders(search)
    formats(search)


class _Piece(argparse.Action):
    """-c and -f, in the order in which they stand."""

    def __call__(self, parser: Any, namespace: Any, values: Any, option_string: str | None = None) -> None:
        kind = "text" if option_string in ("-c", "--command") else "file"
        namespace.pieces = [*namespace.pieces, (kind, values)]


def _shell(commands: Any) -> None:
    shell = on_store(
        commands,
        "shell",
        "shell:shell",
        "ask a store interactively, or run a script; `cgdb STORE` does the same",
        """cgdb shell home.cgdb -c ':mode json' -c 'MATCH (o ~ "cup") RETURN o'""",
    )
    shell.add_argument(
        "-c", "--command", action=_Piece, dest="pieces", default=[], metavar="CGQL", help="run this, and end"
    )
    shell.add_argument(
        "-f", "--file", action=_Piece, dest="pieces", metavar="FILE", help="run a file (- is stdin), and end"
    )
    shell.add_argument("--bail", action="store_true", help="stop at the first error")
    shell.add_argument("-m", "--mode", help="how results are written: table, json, jsonl, csv, markdown or tree")
    shell.add_argument("--no-rc", action="store_true", help="do not read the rc file")
    parameters(shell)


def _plot(commands: Any) -> None:
    plot = on_store(
        commands,
        "plot",
        "plot:plot",
        "draw a scene from above or in perspective, with what a statement finds in it",
        """cgdb plot home.cgdb --into lamps.png --view both 'MATCH (o ~ "lamp") RETURN o'""",
    )
    plot.add_argument("text", metavar="CGQL", nargs="?", help="what to highlight; - reads it from stdin")
    plot.add_argument("--query", metavar="CGQL", help="the same, as an option")
    plot.add_argument(
        "-o",
        "--into",
        "--output",
        dest="output",
        required=True,
        metavar="FILE",
        help="the picture: .png, .jpg, .webp, .pdf or .svg",
    )
    plot.synonyms = written("--into")
    plot.add_argument("--view", choices=("plan", "oblique", "both"), default="plan", help="from above or aslant (plan)")
    plot.add_argument("--color", choices=("rgb", "class", "score", "instance"), help="what colours say (what there is)")
    plot.add_argument("--labels", metavar="N", help="things to name at most, or none (40)")
    plot.add_argument("--relations", metavar="NAMES", help="relations to draw as arrows, such as on,in")
    plot.add_argument("--size", metavar="WxH", help="pixels (what suits the place)")
    plot.add_argument("--scene", help="the scene; else the one with most of the result")
    parameters(plot)
    encoders(plot)
    plot.set_defaults(last="text")


def _ask(commands: Any) -> None:
    ask = on_store(
        commands,
        "ask",
        "ask:ask",
        "answer a question in plain words, with a language model or without",
        'cgdb ask home.cgdb "Something to drink other than soda"\n\n'
        "a model is asked where one is configured: CGDB_LLM_BASE_URL, CGDB_LLM_MODEL and CGDB_LLM_API_KEY, or\n"
        "base_url, model and api_key under [llm] in cgdb/config.toml of the config folder; pip install 'cgdb[llm]'",
    )
    ask.add_argument("question", metavar="QUESTION", nargs="?", help="the question; - reads it from stdin")
    ask.add_argument("--image", metavar="FILE", help="a picture that the question speaks of")
    scenes(ask, "ask of this scene only (may be repeated)")
    ask.add_argument("--no-rerank", action="store_true", help="let the model translate, but not judge the candidates")
    reranker(ask)
    conversation(ask)
    encoders(ask)
    formats(ask)
    ask.set_defaults(last="question")
