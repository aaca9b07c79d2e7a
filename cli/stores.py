"""``cgdb info``, ``log``, ``diff``, ``check``, ``export`` and ``remove``."""

from __future__ import annotations

import json
import sys
from argparse import Namespace
from pathlib import Path
from typing import Any

import cgdb
from cgdb.cli import render
from cgdb.cli.asking import warn
from cgdb.cli.plot import only_scene
from cgdb.cli.pruning import kept_since
from cgdb.errors import UsageError

TERMINAL = 1_000_000
"""Characters of an export that a terminal may show: nobody reads more, and vectors are no text."""


def info(options: Namespace) -> int:
    """Say what a store holds."""
    with cgdb.open(options.store, text_encoder=None) as db:
        described = [_described(db, scene) for scene in db.scenes()]
        if options.json:
            render.write(json.dumps({"store": str(db.path), "scenes": described}, ensure_ascii=False, indent=2))
            return 0
        out = render.console()
        out.print(f"{db.path}: {len(described)} scene{'s' if len(described) != 1 else ''}", markup=False)
        columns = ("scene", "revision", "objects", "places", "relations", "up", "features")
        render.table(out, columns, [[scene[name] for name in columns] for scene in described])
        for scene in described:
            out.print(f"{scene['scene']}: relations {scene['relation labels']}", markup=False, soft_wrap=True)
            out.print(f"{scene['scene']}: properties {scene['properties']}", markup=False, soft_wrap=True)
    return 0


def _described(db: cgdb.Database, scene: Any) -> dict[str, Any]:
    catalog = db.view(scene.name).catalog
    relations = sorted(catalog.relations, key=lambda label: -catalog.relation_count(label))
    return {
        "scene": scene.name,
        "revision": scene.revision,
        "objects": scene.n_objects,
        "places": scene.n_places,
        "relations": scene.n_relations,
        "frame": scene.frame,
        "up": scene.up,
        "features": ", ".join(f"{space.name} ({space.dimension})" for space in scene.spaces) or "none",
        "relation labels": ", ".join(f"{label} {catalog.relation_count(label)}" for label in relations) or "none",
        "properties": ", ".join(f"{name} ({kind})" for name, kind in sorted(catalog.properties.items())) or "none",
    }


def log(options: Namespace) -> int:
    """List the revisions."""
    with cgdb.open(options.store, text_encoder=None) as db:
        revisions = db.revisions()
        warn(kept_since(db))
        if options.json:
            records = [
                {
                    "revision": r.id,
                    "time": r.time.isoformat(),
                    "kind": r.kind,
                    "scene": r.scene,
                    "message": r.message,
                    "added": r.added,
                    "changed": r.changed,
                    "removed": r.removed,
                }
                for r in revisions
            ]
            render.write(json.dumps(records, ensure_ascii=False, indent=2))
            return 0
        rows = [
            (r.id, r.time.strftime("%Y-%m-%d %H:%M:%S"), r.kind, r.scene, r.added, r.changed, r.removed, r.message)
            for r in revisions
        ]
        columns = ("revision", "time (UTC)", "kind", "scene", "added", "changed", "removed", "message")
        render.table(render.console(), columns, rows)
    return 0


def diff(options: Namespace) -> int:
    """Say what changed between two revisions."""
    with cgdb.open(options.store, text_encoder=None) as db:
        found: dict[str, Any] = {}
        for scene, changes in db.diff(options.a, options.b, options.scene).items():
            found[scene] = {
                "added": _names(db, scene, options.b, changes.added),
                "changed": _names(db, scene, options.b, changes.changed),
                "removed": _names(db, scene, options.a, changes.removed),
                "relations_added": len(changes.relations_added),
                "relations_removed": len(changes.relations_removed),
            }
        if options.json:
            render.write(json.dumps(found, ensure_ascii=False, indent=2))
            return 0
        out = render.console()
        for scene, parts in found.items():
            out.print(scene, style="bold", markup=False)
            for mark, name in (("+", "added"), ("~", "changed"), ("-", "removed")):
                for line in parts[name]:
                    out.print(f"  {mark} {render.clean(line)}", markup=False, soft_wrap=True)
            out.print(f"  relations: +{parts['relations_added']} -{parts['relations_removed']}", markup=False)
        if not found:
            out.print("no difference")
    return 0


def _names(db: cgdb.Database, scene: str, revision: int, keys: tuple[int, ...]) -> list[str]:
    if not keys:
        return []
    return [str(node) for node in db.nodes_by_key(scene, keys, as_of=revision)]


def check(options: Namespace) -> int:
    """Verify a store."""
    with cgdb.open(options.store, text_encoder=None) as db:
        problems = db.check(repair=options.repair, full=not options.quick)
    for problem in problems:
        render.write(render.clean(str(problem)))
    left = [problem for problem in problems if not problem.repaired]
    if not problems:
        sys.stderr.write("the store is sound\n")
    elif left and not options.repair and all(problem.where == "index" for problem in left):
        sys.stderr.write("hint: only indexes are damaged; `cgdb check --repair` builds them anew\n")
    return 1 if left else 0


def export(options: Namespace) -> int:
    """Write a scene to a file or to stdout."""
    from cgdb.export import WITH_VIEWS, document, format_of

    with cgdb.open(options.store, text_encoder=None) as db:
        name = options.scene or only_scene([scene.name for scene in db.scenes(options.as_of)])
        form = options.format or ("cgdb" if options.output == "-" else format_of(Path(options.output)))
        chosen = {
            option: value
            for option in ("decimals", "max_tokens", "max_points", "relations")
            if (value := getattr(options, option)) is not None and value is not False
        }
        if options.output == "-":
            scene = db.scene(name, as_of=options.as_of, views=form in WITH_VIEWS, skip_damaged=options.skip_damaged)
            written = document(scene, form, **chosen)
            if written.data is None:
                text = "".join(written.pieces).rstrip("\n")
                if len(text) > TERMINAL and sys.stdout.isatty():
                    raise UsageError(
                        f"{len(text) / 1e6:,.1f} MB of '{form}' are too much for a terminal",
                        hint="give it a FILE: -o; the format 'planner' leaves vectors, clouds and pictures out",
                    )
                render.write(text)
            elif sys.stdout.isatty():
                raise UsageError(f"the format '{form}' is binary: a terminal cannot show it", hint="give it a FILE: -o")
            else:
                sys.stdout.buffer.writelines(written.data)
            notes = written.notes
        else:
            exported = db.export(
                name,
                options.output,
                form,
                as_of=options.as_of,
                skip_damaged=options.skip_damaged,
                **chosen,
            )
            notes = exported.notes
            sys.stderr.write(f"wrote {options.output}\n")
    warn(notes)
    return 0


def remove(options: Namespace) -> int:
    """Remove a scene."""
    with cgdb.open(options.store, text_encoder=None) as db:
        revision = db.remove(options.scene)
    sys.stderr.write(f"removed '{options.scene}' as revision {revision}\n")
    return 0
