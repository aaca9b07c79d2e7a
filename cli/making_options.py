"""The options of the commands that make maps: ``demo``, ``import``, ``encode`` and ``map``."""

from __future__ import annotations

from argparse import SUPPRESS
from typing import Any

from cgdb.cli.command_line import Parser, command, on_store, quiet, written

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


def add(commands: Any) -> None:
    """Add the commands."""
    _demo(commands)
    _import(commands)
    _encode(commands)
    _map(commands)


def _demo(commands: Any) -> None:
    demo = command(commands, "demo", "demo:demo", "build a store from the furnished flat and ask it", "cgdb demo")
    demo.add_argument(
        "folder", nargs="?", help="keep the store, as flat.cgdb in this folder (a temporary one, removed afterwards)"
    )
    demo.add_argument("--into", help=SUPPRESS)
    demo.synonyms = written("--into")


def _import(commands: Any) -> None:
    bring = command(
        commands,
        "import",
        "importing:import_maps",
        "bring map files or folders into a store; one map is one revision, whole or not at all",
        "cgdb import room0.json room1.json --into house.cgdb",
    )
    bring.add_argument("maps", nargs="+", metavar="MAP", help="a map file or folder; its format is found by content")
    _into(bring)
    bring.add_argument("--name", help="the scene's name (one MAP only); else the file's")
    bring.add_argument("--format", help=f"the map's format, where its content does not tell: {FORMATS}")
    bring.add_argument("--part", help="which graph of a file with several: init_graph, final_graph")
    _existing(bring, "error", "replace", "merge")
    bring.add_argument("--no-encode", action="store_true", help="leave the vectors of captions for later")
    quiet(bring)


def _encode(commands: Any) -> None:
    encode = on_store(
        commands,
        "encode",
        "importing:encode",
        "give captions and tags their vectors, where missing",
        "cgdb encode home.cgdb",
    )
    encode.add_argument("--scene", help="of one scene only")
    quiet(encode, "no progress")


def _map(commands: Any) -> None:
    mapping = command(
        commands,
        "map",
        "mapping:map_recording",
        "map a recording of posed RGB-D frames into a store",
        "cgdb map recordings/office --into house.cgdb --name office",
    )
    mapping.add_argument("sequence", metavar="SEQUENCE", help="the folder of the recording")
    _into(mapping)
    mapping.add_argument("--name", help="the scene's name; else the folder's")
    _frames(mapping)
    _detections(mapping)
    _method(mapping)
    _course(mapping)
    _existing(mapping, "error", "replace")
    quiet(mapping)


def _frames(mapping: Parser) -> None:
    """What is read of the recording."""
    mapping.add_argument("--layout", help=f"how the recording is laid out, where its files do not tell: {LAYOUTS}")
    mapping.add_argument("--intrinsics", metavar="FX,FY,CX,CY", help="instead of the recording's, in pixels")
    mapping.add_argument("--depth-scale", type=float, metavar="UNITS", help="units of depth per metre")
    mapping.add_argument("--start", type=int, default=0, metavar="N", help="the first frame (0)")
    mapping.add_argument("--end", type=int, metavar="N", help="the frame to stop before")
    mapping.add_argument("--stride", type=int, default=1, metavar="N", help="every Nth frame (1)")
    mapping.add_argument("--size", metavar="WxH", help="bring frames to this size (that of the depth)")
    mapping.add_argument("--up", choices=("x", "y", "z", "-x", "-y", "-z"), help="the map's axis against gravity")


def _detections(mapping: Parser) -> None:
    """What is seen in its frames, and what it is called."""
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


def _method(mapping: Parser) -> None:
    """How what is seen becomes objects."""
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


def _course(mapping: Parser) -> None:
    """When the map is written, and with what it goes on."""
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


def _into(parser: Parser) -> None:
    parser.add_argument("--into", required=True, metavar="STORE", help="the store, made where there is none")
    parser.synonyms = {**written("--into"), "--replace": "--on-existing=replace"}


def _existing(parser: Parser, *choices: str) -> None:
    """What is done about a scene of the same name, and about relations."""
    parser.add_argument(
        "--on-existing",
        choices=choices,
        default="error",
        help="what to do when the scene is there already (error)",
    )
    parser.add_argument("--no-relate", action="store_true", help="add no relations from the boxes")
