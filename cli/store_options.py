"""The options of the commands on a store as a whole: ``info``, ``log``, ``diff``, ``views``, ``check``, ``export``,
``remove`` and ``prune``."""

from __future__ import annotations

from typing import Any

from cgdb.cli.command_line import as_json, on_store, scenes, written


def add(commands: Any) -> None:
    """Add the commands."""
    _history(commands)
    _views(commands)
    _check(commands)
    _export(commands)
    _remove(commands)
    _prune(commands)


def _history(commands: Any) -> None:
    info = on_store(commands, "info", "stores:info", "say what a store holds", "cgdb info home.cgdb")
    as_json(info)

    log = on_store(commands, "log", "stores:log", "list the revisions of a store", "cgdb log home.cgdb")
    as_json(log)

    diff = on_store(
        commands, "diff", "stores:diff", "say what changed between two revisions", "cgdb diff home.cgdb 1 2"
    )
    diff.add_argument("a", metavar="A", type=int, help="the earlier revision")
    diff.add_argument("b", metavar="B", type=int, help="the later revision")
    diff.add_argument("--scene", help="this scene only")
    as_json(diff)


def _views(commands: Any) -> None:
    views = on_store(
        commands,
        "views",
        "views:views",
        "list the frames in which objects were seen best, or write the objects cut out of them as pictures",
        "cgdb views home.cgdb 12 --into pictures",
    )
    views.add_argument("ids", metavar="ID", nargs="+", help="the object's id, with or without its #")
    views.add_argument("--scene", help="the scene, where several have the id")
    views.add_argument("--as-of", metavar="REVISION", help="as of a revision or an ISO time")
    views.add_argument("-k", type=int, metavar="N", help="the N best only")
    views.add_argument("--into", metavar="FOLDER", help="where the pictures are written; made where there is none")
    views.synonyms = written("--into")
    as_json(views)


def _check(commands: Any) -> None:
    check = on_store(
        commands,
        "check",
        "stores:check",
        "verify a store; exit code 1 when something is wrong",
        "cgdb check home.cgdb --repair",
    )
    check.add_argument("--repair", action="store_true", help="build damaged indexes anew")
    check.add_argument("--quick", action="store_true", help="the latest revision only")


def _export(commands: Any) -> None:
    export = on_store(
        commands,
        "export",
        "stores:export",
        "write a scene as JSON for planners, cgdb JSON, a graph, or a 3D file",
        "cgdb export home.cgdb kitchen -o kitchen.json --format planner --decimals 2",
    )
    export.add_argument("scene", metavar="SCENE", nargs="?", help="may be left out where there is only one")
    export.add_argument(
        "-o", "--output", "--into", default="-", metavar="FILE", help="the file to write; - is stdout (-)"
    )
    export.synonyms = written("--into")
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


def _remove(commands: Any) -> None:
    remove = on_store(
        commands,
        "remove",
        "stores:remove",
        "remove a scene; earlier revisions still show it",
        "cgdb remove home.cgdb kitchen",
    )
    remove.add_argument("scene", metavar="SCENE", help="the scene's name")


def _prune(commands: Any) -> None:
    prune = on_store(
        commands,
        "prune",
        "pruning:prune",
        "drop old revisions for good, and shorten the file",
        "cgdb prune home.cgdb --keep 20 --before 2025-03-01",
    )
    prune.description = (
        "Drop old revisions for good, and shorten the file. What a scene is now never goes, and every revision\n"
        "that is kept reads as before; AS OF an older one says that it was pruned. With --keep and --before goes\n"
        "what neither keeps. A removed scene counts as any other: once its removal is its oldest revision that is\n"
        "kept, that line of the log is all that is left of it."
    )
    prune.add_argument("--keep", type=int, metavar="N", help="keep the last N revisions of each scene")
    prune.add_argument(
        "--before",
        metavar="REVISION",
        help="a revision or an ISO time (UTC): keep what each scene was then, and all since",
    )
    scenes(prune)
    prune.add_argument("--dry-run", action="store_true", help="say what would go, and change nothing")
    as_json(prune)
