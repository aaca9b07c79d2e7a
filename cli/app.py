"""``cgdb``: the commands, their help, and the exit codes.

Exit codes: 0 done; 1 something was found wrong (check); 2 the command line; 3 the query's text or names; 4 the query
could not be carried out, or outgrew a limit; 5 a map or scene is wrong, or cannot be exported; 6 the store; 7 another
process is writing; 8 damaged data; 9 a missing package or model; 70 a bug in cgdb; 130 interrupted; 141 nobody reads
what is printed.
"""

from __future__ import annotations

import argparse
import os
import re
import signal
import sys
from collections.abc import Container, Sequence
from importlib import import_module
from typing import Any, NoReturn

import cgdb
from cgdb.errors import CgdbError, UsageError, did_you_mean

EXAMPLES = """\
examples:
  cgdb demo
  cgdb import scene_graph.json --into home.cgdb
  cgdb query home.cgdb 'MATCH (o ~ "something to drink") WHERE NOT o ~ "soda" RETURN o LIMIT 3'
  cgdb search home.cgdb "red shoes" --where 'volume(o) < 0.1'
  cgdb export home.cgdb kitchen --format planner

exit codes: 0 done, 1 check found something, 2 command line, 3 query text or names, 4 query failed or outgrew a limit,
5 map or scene, 6 store, 7 store busy, 8 damaged data, 9 missing package or model, 70 a bug, 130 interrupted
"""


# Written out, for the modules that hold them are slow to load.
FORMATS = (
    "cgdb, conceptgraphs-planner, conceptgraphs-main, conceptgraphs-cache, conceptgraphs-ali, conceptgraphs-ali-json, "
    "spark-dsg, virtualhome, jsonl, json"
)
LAYOUTS = (
    "replica, scannet, ai2thor, r3d, record3d, realsense, multiscan, azure, icl, tum, redwood, 7scenes, hm3d, "
    "hm3d-openeqa, plain"
)
KINDS = "arrays, conceptgraphs-main, conceptgraphs-ali, coco, labels"


def main(arguments: Sequence[str] | None = None) -> int:
    """Run one command; the exit code. stdout is data, stderr is talk."""
    if hasattr(signal, "SIGPIPE"):
        # A model server that hangs up must not end the process, as the signal would.
        signal.signal(signal.SIGPIPE, signal.SIG_IGN)
    try:
        options = _options(sys.argv[1:] if arguments is None else arguments)
        command = getattr(import_module(options.module), options.function)
        code = int(command(options) or 0)
        sys.stdout.flush()
        return code
    except CgdbError as error:
        sys.stdout.flush()
        _say(error.render())
        return error.exit_code
    except KeyboardInterrupt:
        _say("interrupted; what was finished is kept, and nothing is half written")
        return 130
    except BrokenPipeError:
        # `cgdb query ... | head` ends quietly, as other tools do; what Python has yet to write goes nowhere.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return 128 + 13
    except Exception as error:
        if os.environ.get("CGDB_DEBUG"):
            raise
        _say(f"internal error: {type(error).__name__}: {error}\nhint: this is a bug in cgdb; CGDB_DEBUG=1 shows where")
        return 70


def _options(arguments: Sequence[str]) -> argparse.Namespace:
    parser = _parser()
    if not arguments:
        parser.print_help(sys.stderr)
        raise SystemExit(UsageError.exit_code)
    options, left = parser.parse_known_args(_with_shell(arguments, parser.commands))
    # Before Python 3.13 argparse does not see an optional word that follows a flag: plot STORE -o FILE CGQL.
    last = options.last
    if left and last is not None and getattr(options, last) is None and not left[0].startswith("-"):
        setattr(options, last, left.pop(0))
    if left:
        options.parser.refuse(left)
    return options


def _with_shell(arguments: Sequence[str], commands: Container[str]) -> list[str]:
    """`cgdb STORE` is `cgdb shell STORE`, where STORE is a folder that is called as no command is."""
    given = list(arguments)
    if not given or given[0].startswith("-") or given[0] in commands:
        return given
    # What looks like a path is one, also where there is nothing yet: the shell then says that there is no store.
    if os.path.isdir(given[0]) or given[0].endswith(".cgdb") or os.sep in given[0]:  # noqa: PTH112
        return ["shell", *given]
    return given


def _say(text: str) -> None:
    # A terminal obeys control characters; names in an error may come from a stranger's map.
    shown = "".join(c if c in "\n\t" or c.isprintable() else "\ufffd" for c in text)
    sys.stderr.write(
        shown.encode(sys.stderr.encoding or "utf-8", "replace").decode(sys.stderr.encoding or "utf-8") + "\n"
    )


class _Parser(argparse.ArgumentParser):
    """argparse, with this project's kind of error. commands: what there is to call."""

    commands: Container[str] = ()

    def error(self, message: str) -> NoReturn:
        hint = f"{self.prog} --help"
        words = message.split("'")
        if "invalid choice" in message and len(words) > 1:
            near = did_you_mean(words[1], words[3::2])
            # One name that is near says more than all the names.
            message, hint = (message.partition(" (choose from")[0], near) if near else (message, hint)
        raise UsageError(message, hint=hint)

    def refuse(self, words: Sequence[str]) -> NoReturn:
        """Words that no option and no place is there for."""
        hint = f"{self.prog} --help"
        if words[0].startswith("-"):
            known = re.findall(r"(?<![\w-])--[\w-]+", self.format_help())
            hint = did_you_mean(words[0].partition("=")[0], known) or hint
        elif any(action.metavar in ("CGQL", "QUESTION", "TEXT") for action in self._actions):
            hint = "what has spaces stands in quotes"
        raise UsageError(f"unrecognized arguments: {' '.join(words)}", hint=hint)


def _parser() -> _Parser:
    parser = _Parser(
        prog="cgdb",
        description="An embedded store for the 3D scene graphs that robots make: import a map, ask it, get it out.",
        epilog=EXAMPLES,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("--version", action="version", version=f"cgdb {cgdb.__version__}")
    commands = parser.add_subparsers(title="commands", metavar="COMMAND", required=True)
    _importing(commands)
    _mapping(commands)
    _asking(commands)
    _shell(commands)
    _models(commands)
    _store(commands)
    parser.commands = commands.choices
    return parser


def _command(commands: Any, name: str, home: str, says: str, example: str) -> argparse.ArgumentParser:
    module, function = home.split(":")
    parser: argparse.ArgumentParser = commands.add_parser(
        name,
        help=says,
        description=says[0].upper() + says[1:] + ".",
        epilog=f"example:\n  {example}",
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.set_defaults(module=f"cgdb.cli.{module}", function=function, parser=parser, last=None)
    return parser


def _importing(commands: Any) -> None:
    demo = _command(commands, "demo", "demo:demo", "build a store from the furnished flat and ask it", "cgdb demo")
    demo.add_argument(
        "folder", nargs="?", help="keep the store, as flat.cgdb in this folder (a temporary one, removed afterwards)"
    )

    bring = _command(
        commands,
        "import",
        "importing:import_maps",
        "bring map files or folders into a store; one map is one revision, whole or not at all",
        "cgdb import room0.json room1.json --into house.cgdb",
    )
    bring.add_argument("maps", nargs="+", metavar="MAP", help="a map file or folder; its format is found by content")
    bring.add_argument("--into", required=True, metavar="STORE", help="the store, made where there is none")
    bring.add_argument("--name", help="the scene's name (one MAP only); else the file's")
    bring.add_argument("--format", help=f"the map's format, where its content does not tell: {FORMATS}")
    bring.add_argument("--part", help="which graph of a file with several: init_graph, final_graph")
    bring.add_argument(
        "--on-existing",
        choices=("error", "replace", "merge"),
        default="error",
        help="what to do when the scene is there already (error)",
    )
    bring.add_argument("--no-relate", action="store_true", help="add no relations from the boxes")
    bring.add_argument("--no-encode", action="store_true", help="leave the vectors of captions for later")
    bring.add_argument("--quiet", action="store_true", help="no progress, no summary")

    encode = _command(
        commands,
        "encode",
        "importing:encode",
        "give captions and tags their vectors, where missing",
        "cgdb encode home.cgdb",
    )
    encode.add_argument("store", metavar="STORE", help="the folder of the store")
    encode.add_argument("--scene", help="of one scene only")
    encode.add_argument("--quiet", action="store_true", help="no progress")


def _mapping(commands: Any) -> None:
    mapping = _command(
        commands,
        "map",
        "mapping:map_recording",
        "map a recording of posed RGB-D frames into a store",
        "cgdb map recordings/office --into house.cgdb --name office",
    )
    mapping.add_argument("sequence", metavar="SEQUENCE", help="the folder of the recording")
    mapping.add_argument("--into", required=True, metavar="STORE", help="the store, made where there is none")
    mapping.add_argument("--name", help="the scene's name; else the folder's")
    mapping.add_argument("--layout", help=f"how the recording is laid out, where its files do not tell: {LAYOUTS}")
    mapping.add_argument("--intrinsics", metavar="FX,FY,CX,CY", help="instead of the recording's, in pixels")
    mapping.add_argument("--depth-scale", type=float, metavar="UNITS", help="units of depth per metre")
    mapping.add_argument("--start", type=int, default=0, metavar="N", help="the first frame (0)")
    mapping.add_argument("--end", type=int, metavar="N", help="the frame to stop before")
    mapping.add_argument("--stride", type=int, default=1, metavar="N", help="every Nth frame (1)")
    mapping.add_argument("--size", metavar="WxH", help="bring frames to this size (that of the depth)")
    mapping.add_argument("--up", choices=("x", "y", "z", "-x", "-y", "-z"), help="the map's axis against gravity")
    mapping.add_argument(
        "--detections",
        metavar="PATH",
        help="files made earlier; geometry, without a model; models:sam=MODEL,clip=MODEL, which segment all there is; "
        "models:tags=FILE,dino=MODEL,sam=MODEL,clip=MODEL, which find what FILE names (or clip:FILE, caption:MODEL)",
    )
    mapping.add_argument(
        "--detection-kind", metavar="KIND", help=f"what these are, where their files do not tell: {KINDS}"
    )
    mapping.add_argument("--encoder", help="the encoder of the features, such as open_clip:ViT-H-14:laion2b_s32b_b79k")
    mapping.add_argument(
        "--vocabulary", metavar="FILE", help="names for things without one, by what they look like (see cgdb tag)"
    )
    mapping.add_argument("--voxel", type=float, default=0.025, metavar="M", help="the side of a voxel (0.025)")
    mapping.add_argument(
        "--preset", choices=("paper", "reference"), default="paper", help="as in the paper, or as its code does (paper)"
    )
    mapping.add_argument("--set", action="append", metavar="NAME=VALUE", help="any parameter: tidying.merge_every=10")
    mapping.add_argument("--threshold", type=float, help="least similarity to be the same object (1.1)")
    mapping.add_argument(
        "--spatial",
        choices=("overlap", "iou", "giou", "iou_accurate", "giou_accurate"),
        help="the geometric similarity (overlap)",
    )
    mapping.add_argument("--semantic", choices=("paper", "cosine"), help="cos/2 + 1/2, or cos (paper)")
    mapping.add_argument("--bias", type=float, help="weigh geometry up and looks down by this (0)")
    mapping.add_argument(
        "--background",
        choices=("merge", "skip", "objects"),
        default="merge",
        help="walls, floor, ceiling: one object each, none, or as other things (merge)",
    )
    mapping.add_argument("--min-detections", type=int, default=3, metavar="N", help="fewer is no object (3)")
    mapping.add_argument(
        "--crops",
        default="10",
        metavar="N",
        help="views of each object that are kept, with pictures; none: without (10)",
    )
    mapping.add_argument("--every", type=int, default=100, metavar="N", help="write a revision every N frames (100)")
    mapping.add_argument("--keep-state", action="store_true", help="keep what is needed to map further another day")
    mapping.add_argument("--resume", action="store_true", help="go on with this recording where its mapping was left")
    mapping.add_argument(
        "--extend", action="store_true", help="map this recording of the same place into the scene that is there"
    )
    mapping.add_argument("--pose", metavar="FILE", help="4 x 4 numbers that bring this recording into the map")
    mapping.add_argument(
        "--ahead", type=int, default=2, metavar="N", help="frames to read and detect ahead, in threads; 0: none (2)"
    )
    mapping.add_argument(
        "--on-existing",
        choices=("error", "replace"),
        default="error",
        help="what to do when the scene is there already (error)",
    )
    mapping.add_argument("--no-relate", action="store_true", help="add no relations from the boxes")
    mapping.add_argument("--quiet", action="store_true", help="no progress, no summary")


def _asking(commands: Any) -> None:
    query = _command(
        commands,
        "query",
        "asking:query",
        "answer a CGQL statement",
        """cgdb query home.cgdb 'MATCH (l ~ "lamp") WHERE distance(l, #12) < 150 cm RETURN l'""",
    )
    query.add_argument("store", metavar="STORE", help="the folder of the store")
    query.add_argument("text", metavar="CGQL", help="the statement; - reads it from stdin")
    _parameters(query)
    _encoders(query)
    query.add_argument("--timeout", type=float, metavar="SECONDS", help="give up after so long")
    _reranker(query)
    _formats(query)

    search = _command(
        commands,
        "search",
        "asking:search",
        "the nearest objects to a text or a vector",
        "cgdb search home.cgdb @query.npy --space clip -k 5",
    )
    search.add_argument("store", metavar="STORE", help="the folder of the store")
    search.add_argument("what", metavar="TEXT", help="a text, or @FILE with a vector (.npy or a JSON list)")
    search.add_argument("--space", help="the feature space to compare in")
    search.add_argument("-k", type=int, default=10, help="how many (10)")
    search.add_argument("--scene", action="append", help="search this scene only (may be repeated)")
    search.add_argument("--where", metavar="CONDITION", help="a CGQL condition on the object o")
    _parameters(search)
    _encoders(search)
    _formats(search)


class _Piece(argparse.Action):
    """-c and -f, in the order in which they stand."""

    def __call__(self, parser: Any, namespace: Any, values: Any, option_string: str | None = None) -> None:
        kind = "text" if option_string in ("-c", "--command") else "file"
        namespace.pieces = [*namespace.pieces, (kind, values)]


def _shell(commands: Any) -> None:
    shell = _command(
        commands,
        "shell",
        "shell:shell",
        "ask a store interactively, or run a script; `cgdb STORE` does the same",
        """cgdb shell home.cgdb -c ':mode json' -c 'MATCH (o ~ "cup") RETURN o'""",
    )
    shell.add_argument("store", metavar="STORE", help="the folder of the store")
    shell.add_argument(
        "-c", "--command", action=_Piece, dest="pieces", default=[], metavar="CGQL", help="run this, and end"
    )
    shell.add_argument(
        "-f", "--file", action=_Piece, dest="pieces", metavar="FILE", help="run a file (- is stdin), and end"
    )
    shell.add_argument("--bail", action="store_true", help="stop at the first error")
    shell.add_argument("-m", "--mode", help="how results are written: table, json, jsonl, csv, markdown or tree")
    shell.add_argument("--no-rc", action="store_true", help="do not read the rc file")
    _parameters(shell)

    plot = _command(
        commands,
        "plot",
        "plot:plot",
        "draw a scene from above or in perspective, with what a statement finds in it",
        """cgdb plot home.cgdb --into lamps.png --view both 'MATCH (o ~ "lamp") RETURN o'""",
    )
    plot.add_argument("store", metavar="STORE", help="the folder of the store")
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
    plot.add_argument("--view", choices=("plan", "oblique", "both"), default="plan", help="from above or aslant (plan)")
    plot.add_argument("--color", choices=("rgb", "class", "score", "instance"), help="what colours say (what there is)")
    plot.add_argument("--labels", metavar="N", help="things to name at most, or none (40)")
    plot.add_argument("--relations", metavar="NAMES", help="relations to draw as arrows, such as on,in")
    plot.add_argument("--size", metavar="WxH", help="pixels (what suits the place)")
    plot.add_argument("--scene", help="the scene; else the one with most of the result")
    _parameters(plot)
    _encoders(plot)
    plot.set_defaults(last="text")


def _models(commands: Any) -> None:
    ask = _command(
        commands,
        "ask",
        "ask:ask",
        "answer a question in plain words, with a language model or without",
        'cgdb ask home.cgdb "Something to drink other than soda"\n\n'
        "a model is asked where one is configured: CGDB_LLM_BASE_URL, CGDB_LLM_MODEL and CGDB_LLM_API_KEY, or\n"
        "base_url, model and api_key under [llm] in cgdb/config.toml of the config folder; pip install 'cgdb[llm]'",
    )
    ask.add_argument("store", metavar="STORE", help="the folder of the store")
    ask.add_argument("question", metavar="QUESTION", nargs="?", help="the question; - reads it from stdin")
    ask.add_argument("--image", metavar="FILE", help="a picture that the question speaks of")
    ask.add_argument("--scene", action="append", help="ask of this scene only (may be repeated)")
    ask.add_argument("--no-rerank", action="store_true", help="let the model translate, but not judge the candidates")
    _reranker(ask)
    _conversation(ask)
    _encoders(ask)
    _formats(ask)
    ask.set_defaults(last="question")

    enrich = _command(
        commands,
        "enrich",
        "enrich:enrich",
        "ask a language model once what is known of each thing, and keep it as properties",
        "cgdb enrich home.cgdb --dry-run",
    )
    enrich.add_argument("store", metavar="STORE", help="the folder of the store")
    enrich.add_argument("--scene", action="append", help="this scene only (may be repeated)")
    enrich.add_argument(
        "--robot", default="a wheeled robot of 5 kg", help="for whom things are traversable (a wheeled robot of 5 kg)"
    )
    enrich.add_argument("--batch", type=int, default=8, metavar="N", help="descriptions per call (8)")
    enrich.add_argument("--dry-run", action="store_true", help="say what it would take, and ask nothing")
    enrich.add_argument("--json", action="store_true", help="what was done, as JSON on stdout")
    enrich.add_argument("--quiet", action="store_true", help="no progress, no summary")
    _conversation(enrich)

    caption = _command(
        commands,
        "caption",
        "enrich:caption",
        "caption and name the objects of a map by their best views, with a vision model",
        "cgdb caption home.cgdb --dry-run",
    )
    caption.add_argument("store", metavar="STORE", help="the folder of the store")
    caption.add_argument("--scene", action="append", help="this scene only (may be repeated)")
    caption.add_argument("--views", type=int, default=10, metavar="N", help="views of each object (10)")
    caption.add_argument(
        "--together", action="store_true", help="all views of an object in one call, for models that take many pictures"
    )
    caption.add_argument("--again", action="store_true", help="also objects that have a caption")
    _added(caption)

    relate = _command(
        commands,
        "relate",
        "enrich:relate",
        "ask a language model how things that touch or overlap stand to each other",
        "cgdb relate home.cgdb --dry-run",
    )
    relate.add_argument("store", metavar="STORE", help="the folder of the store")
    relate.add_argument("--scene", action="append", help="this scene only (may be repeated)")
    relate.add_argument(
        "--every-pair", action="store_true", help="all pairs that touch, not only a spanning forest of the strongest"
    )
    relate.add_argument(
        "--reach", type=float, default=0.025, metavar="M", help="metres by which each box is made larger (0.025)"
    )
    relate.add_argument("--batch", type=int, default=6, metavar="N", help="pairs per call (6)")
    _added(relate)

    tag = _command(
        commands,
        "tag",
        "tagging:tag",
        "give objects without a name the names of a vocabulary that they look most like, by CLIP",
        "cgdb tag home.cgdb --vocabulary names.txt --dry-run\n\n"
        "FILE holds a name on each line, or a JSON list; names.npz (names, vectors), or names.json beside names.npy, "
        "holds\nvectors computed elsewhere, and needs no CLIP here",
    )
    tag.add_argument("store", metavar="STORE", help="the folder of the store")
    tag.add_argument("--vocabulary", required=True, metavar="FILE", help="the names, as below")
    tag.add_argument("--scene", action="append", help="this scene only (may be repeated)")
    tag.add_argument("--space", help="the feature space to compare in (the first with an encoder)")
    tag.add_argument("--top", type=int, default=5, metavar="N", help="tags of an object, the nearest first (5)")
    tag.add_argument("--replace", action="store_true", help="tag named things too; the name is kept as tag_before")
    tag.add_argument("--dry-run", action="store_true", help="say what would be tagged, and write nothing")
    tag.add_argument("--json", action="store_true", help="what was done, as JSON on stdout")
    tag.add_argument("--quiet", action="store_true", help="no progress, no summary")
    _encoders(tag)

    says = "measure how good maps are, and how well questions are answered"
    evaluate = commands.add_parser("eval", help=says, description=says[0].upper() + says[1:] + ".")
    evaluations = evaluate.add_subparsers(title="evaluations", metavar="WHAT", required=True)
    from cgdb.cli import evaluate_options
    from cgdb.judged import LAYOUT

    evaluate_options.add(evaluations, _command)

    retrieval = _command(
        evaluations,
        "retrieval",
        "evaluate:retrieval",
        "answer judged queries in several ways, and print a table of scores",
        "cgdb eval retrieval lab.json --judgements judgements.json --ways encoder,built-in,model+rerank\n\n" + LAYOUT,
    )
    retrieval.add_argument("maps", nargs="*", metavar="MAP", help="the maps to ask (all that the judgements name)")
    retrieval.add_argument("--judgements", required=True, metavar="FILE", help="the judged queries, laid out as below")
    retrieval.add_argument(
        "--ways",
        default="encoder,built-in",
        help="some of words, encoder, clip, meaning, built-in, embedding+cross, built-in+cross, model, model+rerank, "
        "whole-map (encoder,built-in)",
    )
    _reranker(retrieval)
    retrieval.add_argument("--per-map", action="store_true", help="a table for each map, too")
    retrieval.add_argument("--save", default="retrieval.jsonl", metavar="FILE", help="every answer (retrieval.jsonl)")
    retrieval.add_argument("--resume", action="store_true", help="ask only what FILE does not hold yet")
    retrieval.add_argument("--json", action="store_true", help="the scores as JSON on stdout")
    retrieval.add_argument("--quiet", action="store_true", help="no progress")
    _conversation(retrieval)
    _encoders(retrieval)


def _added(parser: argparse.ArgumentParser) -> None:
    """Options of what asks a model for every object of a map."""
    parser.add_argument("--workers", type=int, default=4, metavar="N", help="calls at a time (4)")
    parser.add_argument("--per-minute", type=float, metavar="N", help="calls that are begun within a minute at most")
    parser.add_argument("--dry-run", action="store_true", help="say what it would take, and ask nothing")
    parser.add_argument("--json", action="store_true", help="what was done, as JSON on stdout")
    parser.add_argument("--quiet", action="store_true", help="no progress, no summary")
    _conversation(parser)


def _reranker(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "--rerank",
        metavar="NAME",
        help="who reads the best rows once more: model, or cross: and a cross-encoder's folder or name",
    )


def _conversation(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--no-model", action="store_true", help="ask no language model")
    parser.add_argument("--record", metavar="FILE", help="record what the model is asked and says")
    parser.add_argument("--replay", metavar="FILE", help="answer from such a record, without a model")


def _parameters(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "-p",
        dest="parameters",
        action="append",
        default=[],
        metavar="NAME=VALUE",
        help="a parameter: a number, true, false, null, a JSON list, @FILE with a vector, or else a text",
    )


def _encoders(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "--encoder",
        action="append",
        default=[],
        metavar="SPACE=ENCODER",
        help="the encoder of a feature space, such as clip=vocabulary:names.npz or clip=open_clip:ViT-B-32:openai",
    )


def _formats(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "--format", choices=("table", "json", "jsonl", "csv", "markdown"), help="how rows are written (table)"
    )
    parser.add_argument("--json", action="store_const", const="json", dest="format", help="the same as --format json")
    parser.add_argument("--why", action="store_true", help="say of every row why it is there")
    parser.add_argument("--all", action="store_true", help="show every row of a table, not the first 20")


def _store(commands: Any) -> None:
    info = _command(commands, "info", "stores:info", "say what a store holds", "cgdb info home.cgdb")
    info.add_argument("store", metavar="STORE", help="the folder of the store")
    info.add_argument("--json", action="store_true", help="as JSON")

    log = _command(commands, "log", "stores:log", "list the revisions of a store", "cgdb log home.cgdb")
    log.add_argument("store", metavar="STORE", help="the folder of the store")
    log.add_argument("--json", action="store_true", help="as JSON")

    diff = _command(
        commands, "diff", "stores:diff", "say what changed between two revisions", "cgdb diff home.cgdb 1 2"
    )
    diff.add_argument("store", metavar="STORE", help="the folder of the store")
    diff.add_argument("a", metavar="A", type=int, help="the earlier revision")
    diff.add_argument("b", metavar="B", type=int, help="the later revision")
    diff.add_argument("--json", action="store_true", help="as JSON")

    views = _command(
        commands,
        "views",
        "views:views",
        "list the frames in which objects were seen best, or write the objects cut out of them as pictures",
        "cgdb views home.cgdb 12 --into pictures",
    )
    views.add_argument("store", metavar="STORE", help="the folder of the store")
    views.add_argument("ids", metavar="ID", nargs="+", help="the object's id, with or without its #")
    views.add_argument("--scene", help="the scene, where several have the id")
    views.add_argument("--as-of", metavar="REVISION", help="as of a revision or an ISO time")
    views.add_argument("-k", type=int, metavar="N", help="the N best only")
    views.add_argument("--into", metavar="FOLDER", help="where the pictures are written; made where there is none")
    views.add_argument("--json", action="store_true", help="as JSON")

    check = _command(
        commands,
        "check",
        "stores:check",
        "verify a store; exit code 1 when something is wrong",
        "cgdb check home.cgdb --repair",
    )
    check.add_argument("store", metavar="STORE", help="the folder of the store")
    check.add_argument("--repair", action="store_true", help="build damaged indexes anew")
    check.add_argument("--quick", action="store_true", help="the latest revision only")

    export = _command(
        commands,
        "export",
        "stores:export",
        "write a scene as JSON for planners, cgdb JSON, a graph, or a 3D file",
        "cgdb export home.cgdb kitchen -o kitchen.json --format planner --decimals 2",
    )
    export.add_argument("store", metavar="STORE", help="the folder of the store")
    export.add_argument("scene", metavar="SCENE", nargs="?", help="may be left out where there is only one")
    export.add_argument(
        "-o", "--output", "--into", default="-", metavar="FILE", help="the file to write; - is stdout (-)"
    )
    export.add_argument(
        "--format", help="cgdb, planner, node-link, graphml, ply, glb or rerun; else by the file's ending"
    )
    export.add_argument("--as-of", metavar="REVISION", help="the scene as of a revision or an ISO time")
    export.add_argument("--decimals", type=int, help="planner: decimals of coordinates (1)")
    export.add_argument("--max-tokens", type=int, help="planner: the budget in tokens")
    export.add_argument("--max-points", type=int, metavar="N", help="ply, glb, rerun: points at most (5,000,000)")
    export.add_argument("--relations", action="store_true", help="planner: add the relations")
    export.add_argument("--skip-damaged", action="store_true", help="leave out damaged rows instead of refusing")
    export.set_defaults(last="scene")

    remove = _command(
        commands,
        "remove",
        "stores:remove",
        "remove a scene; earlier revisions still show it",
        "cgdb remove home.cgdb kitchen",
    )
    remove.add_argument("store", metavar="STORE", help="the folder of the store")
    remove.add_argument("scene", metavar="SCENE", help="the scene's name")


if __name__ == "__main__":
    sys.exit(main())
