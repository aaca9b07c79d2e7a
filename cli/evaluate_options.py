"""The options of the commands that evaluate: ``cgdb eval mapping``, ``semseg``, ``graph`` and ``retrieval``."""

from __future__ import annotations

from typing import Any

from cgdb.cli.command_line import Parser, as_json, command, conversation, encoders, quiet, reranker, scenes, written

CLOUDS = """\
the truth, a labelled cloud:
  NAME.npz   points (n, 3) metres, in the map's frame; labels (n,) the class of
             each, -1 none; names (k,) of the classes; instances (n,) the object
             of each, -1 none; vectors (k, d) of the classes' texts
  NAME.ply   vertices with x, y, z and label and/or instance (or instance_id,
             object_id); or faces with object_id, as Replica's mesh_semantic.ply
  SCAN.aggregation.json   ScanNet's, with its .segs.json and .ply beside it
  FOLDER     a scene of Replica or ScanNet; a generated sequence (objects.npz,
             whose classes' vectors are the means of their true features)
--names: nyu40 (known for *_vh_clean_2.labels.ply), or a JSON list of names,
{"number": "name"}, or info_semantic.json (found beside mesh_semantic.ply)"""

GRAPHS = """\
the truth: any map that cgdb import reads, taken for the truth; the objects of
a labelled cloud, as in cgdb eval mapping; or a JSON file:
  {"objects": [{"id": 1, "names": ["sofa", "couch"],    what it may be called
                "center": [1.2, 0.4, 0.4], "extent": [2.0, 0.9, 0.8],
                "rotation": [[..], [..], [..]]}],       or "points", or no box
   "relations": [{"source": 3, "label": "on", "target": 1}]}
Boxes are in the map's frame, metres. Without boxes, ids are compared.
A node is valid where it is an annotated object, right where it is called so
too. Without a truth: --sheet form.json writes a form, form_pictures/ with the
best views, and form.html, a page to judge in; each person saves a form of their
own, and --verdicts counts them; the majority decides."""

JUDGEMENTS = """\
the judgements, a JSON file:
  {"maps/house.json": [                      a map, as a path relative to any folder above the file
      {"id": "q1",                           its name in the results
       "kind": "affordance",                 queries are counted by kind
       "query": "Something to sit on",
       "relevant": {"12": 2, "7": 1}},       ids of objects: 2 clearly answers it, 1 arguably
      {"id": "q2", "kind": "affordance", "query": "A harp", "relevant": {}}]}    nothing answers it

R@k: of the n queries that have an object of grade 2, the share with one of these among the first k; 95 %: of R@1, by
bootstrap over queries. MRR: of the same queries, the mean of 1 over the place of the first. A query with no relevant
object at all should be answered with "nothing fits": no P and no R, precision and recall of saying so, are over these
and the ones with a grade 2; a query whose objects are all of grade 1 counts for neither. tokens and s (seconds): the
median per query."""


def add(commands: Any) -> None:
    """Add ``eval``, and under it the commands."""
    says = "measure how good maps are, and how well questions are answered"
    evaluate = commands.add_parser("eval", help=says, description=says[0].upper() + says[1:] + ".")
    evaluations = evaluate.add_subparsers(title="evaluations", metavar="WHAT", required=True)
    _mapping(evaluations)
    _semseg(evaluations)
    _graph(evaluations)
    _retrieval(evaluations)


def _mapping(evaluations: Any) -> None:
    mapping = command(
        evaluations,
        "mapping",
        "evaluate_mapping:mapping",
        "score the objects of maps against the true ones: found, missed, duplicated, pure, complete",
        "cgdb eval mapping house.cgdb --truth recordings/office\n\n" + CLOUDS,
    )
    _common(mapping)
    _clouds(mapping)
    mapping.add_argument("--objects", action="store_true", help="list every object, not only what is wrong")
    mapping.add_argument(
        "--reach", type=float, default=0.05, metavar="M", help="a point lies on a surface within (0.05)"
    )
    mapping.add_argument("--near", type=float, default=0.05, metavar="M", help="a surface is covered within (0.05)")
    mapping.add_argument(
        "--seen", type=int, default=3, metavar="N", help="true objects seen in fewer frames are left out (3)"
    )


def _semseg(evaluations: Any) -> None:
    semseg = command(
        evaluations,
        "semseg",
        "evaluate_semseg:semseg",
        "score the classes of points, mAcc and F-mIoU, as the paper's Table II",
        "cgdb eval semseg replica.cgdb --truth room0=room0.npz office0=office0.npz\n\n" + CLOUDS,
    )
    _common(semseg)
    _clouds(semseg)
    semseg.add_argument(
        "--exclude",
        default="6",
        help="classes that are not scored: 0, 1, 4 or 6 as the paper's, or names with commas (6)",
    )
    semseg.add_argument(
        "--by", choices=("feature", "tag"), default="feature", help="what tells an object's class (feature)"
    )
    semseg.add_argument(
        "--vocabulary", metavar="FILE", help="the classes' vectors: .npz of names and vectors, or .json and .npy"
    )
    semseg.add_argument(
        "--template", default="an image of {c}", metavar="TEXT", help="a class as text (an image of {c})"
    )
    semseg.add_argument("--space", help="the feature space to compare in (clip)")
    encoders(semseg, "the encoder of a feature space")
    semseg.add_argument(
        "--classes",
        choices=("scene", "all"),
        default="scene",
        help="candidates: those in the scene's truth, or all (scene)",
    )
    semseg.add_argument(
        "--cloud", default="truth", help="the points that are labelled: truth, map, or a FILE of points (truth)"
    )
    semseg.add_argument("--within", type=float, metavar="M", help="nearest points farther away are none (no limit)")


def _graph(evaluations: Any) -> None:
    graph = command(
        evaluations,
        "graph",
        "evaluate_graph:graph",
        "score nodes and edges of scene graphs, against a truth or by people, as the paper's Table I",
        "cgdb eval graph house.cgdb --truth annotated.json --labels on,in\n"
        "  cgdb eval graph house.cgdb --sheet form.json\n"
        "  cgdb eval graph house.cgdb --verdicts ann.json bob.json cem.json\n\n" + GRAPHS,
    )
    _common(graph, needed=False)
    graph.add_argument(
        "--sheet", metavar="FILE", help="write a form for people to fill in, and a page to do it in, with pictures"
    )
    graph.add_argument("--verdicts", nargs="+", metavar="FILE", help="score filled-in forms")
    graph.add_argument(
        "--labels", metavar="LABELS", help="relations that count, with commas (the truth's; on,in for --sheet)"
    )
    graph.add_argument(
        "--same", action="append", default=[], metavar="LABEL=OTHER", help="take a label for another (may be repeated)"
    )
    graph.add_argument(
        "--origin", metavar="ORIGINS", help="only edges of these origins: geometry, llm, human, imported"
    )
    graph.add_argument("--exclude", metavar="NAMES", help="objects so called do not count, such as wall,floor,ceiling")
    graph.add_argument("--min-confidence", type=float, default=0.0, metavar="P", help="only edges of at least this (0)")
    graph.add_argument("--match", choices=("auto", "box", "id"), default="auto", help="how nodes are matched (auto)")
    graph.add_argument(
        "--iou", type=float, default=0.25, metavar="P", help="boxes of the same object overlap by (0.25)"
    )
    graph.add_argument("--nodes", action="store_true", help="list the verdict on every node")


def _retrieval(evaluations: Any) -> None:
    retrieval = command(
        evaluations,
        "retrieval",
        "evaluate:retrieval",
        "answer judged queries in several ways, and print a table of scores",
        "cgdb eval retrieval lab.json --judgements judgements.json --ways encoder,built-in,model+rerank\n\n"
        + JUDGEMENTS,
    )
    retrieval.add_argument("maps", nargs="*", metavar="MAP", help="the maps to ask (all that the judgements name)")
    retrieval.add_argument("--judgements", required=True, metavar="FILE", help="the judged queries, laid out as below")
    retrieval.add_argument(
        "--ways",
        default="encoder,built-in",
        help="some of words, encoder, clip, meaning, built-in, embedding+cross, built-in+cross, model, model+rerank, "
        "whole-map (encoder,built-in)",
    )
    reranker(retrieval)
    retrieval.add_argument("--per-map", action="store_true", help="a table for each map, too")
    retrieval.add_argument("--save", default="retrieval.jsonl", metavar="FILE", help="every answer (retrieval.jsonl)")
    retrieval.synonyms = written("--save")
    retrieval.add_argument("--resume", action="store_true", help="ask only what FILE does not hold yet")
    as_json(retrieval, "the scores as JSON on stdout")
    quiet(retrieval, "no progress")
    conversation(retrieval)
    encoders(retrieval)


def _common(parser: Parser, *, needed: bool = True) -> None:
    parser.add_argument("stores", nargs="+", metavar="STORE", help="the folders of the stores")
    parser.add_argument(
        "--truth",
        nargs="+",
        required=needed,
        metavar="[SCENE=]PATH",
        help="the truth of each scene; without SCENE= it is found by its name",
    )
    scenes(parser)
    as_json(parser, "all figures as JSON")
    quiet(parser, "no notes")


def _clouds(parser: Parser) -> None:
    parser.add_argument("--names", metavar="FILE", help="what the truth's class numbers are called")
    parser.add_argument("--align", metavar="FILE", help="a pose (4 x 4) that brings the truth into the map's frame")
