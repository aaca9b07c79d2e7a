"""``cgdb demo``: the furnished flat that comes with cgdb, and the questions that show what can be asked."""

from __future__ import annotations

import contextlib
import sys
import tempfile
import time
from argparse import Namespace
from importlib.resources import as_file, files
from pathlib import Path

import cgdb
from cgdb.cli import render
from cgdb.cli.asking import show, warn
from cgdb.errors import EncoderError, MissingExtraError, UsageError

QUESTIONS = (
    ("What does it look like?", 'MATCH (o ~ "a potted plant") RETURN o LIMIT 3'),
    ("What stands on what?", 'MATCH (c ~ "cushion")-[:on]->(s ~ "sofa") RETURN c, s LIMIT 3'),
    ("One thing but not the other", 'MATCH (o ~ "something to drink") WHERE NOT o ~ "soda" RETURN o LIMIT 3'),
    (
        "How far, how large?",
        'MATCH (l ~ "lamp"), (s ~ "sofa") WHERE distance(l, s) < 150 cm AND height(l) > 20 cm '
        "RETURN l, distance(l, s) AS metres ORDER BY metres LIMIT 3",
    ),
    (
        "All at once",
        'MATCH (r:Room)-[:contains]->(o ~ "something to read")-[:on|in]->(t) '
        'WHERE NOT o ~ "magazine" AND distance(o, t) < 10 cm RETURN o, t, r.name LIMIT 3',
    ),
    ("How many, and where?", 'MATCH (r:Room)-[:contains]->(o ~ "lamp") RETURN r.name, count(o) ORDER BY count(o) DESC'),
)


def demo(options: Namespace) -> int:
    """Import the flat and ask it."""
    if options.folder is not None and options.into is not None:
        raise UsageError("the folder is given twice", hint="cgdb demo FOLDER")
    kept = options.folder if options.into is None else options.into
    with contextlib.ExitStack() as stack:
        folder = stack.enter_context(tempfile.TemporaryDirectory(prefix="cgdb-demo-")) if kept is None else kept
        store = Path(folder) / "flat.cgdb"
        if store.exists():
            raise UsageError(f"{store} is there already", hint="remove it, or give another folder")
        _run(store, stack)
        if kept is not None:
            sys.stderr.write(f"the store is kept: cgdb query {store} 'MATCH (o ~ \"...\") RETURN o'\n")
    return 0


def _run(store: Path, stack: contextlib.ExitStack) -> None:
    from cgdb import ingest

    out = render.console()
    started = time.perf_counter()
    path = stack.enter_context(as_file(files("cgdb.cli") / "flat.json"))
    scene = ingest.load(path)
    db = stack.enter_context(cgdb.open(store, create=True))
    db.add(scene, message="the demo flat")
    try:
        for _ in db.encode():
            pass
    except (MissingExtraError, EncoderError) as error:
        sys.stderr.write(f"note: without the text encoder only words are matched: {error.message} ({error.hint})\n")
    out.print(
        f"A flat of {len(scene.places)} rooms, {len(scene.objects)} objects, {len(scene.relations)} relations, "
        f"imported in {time.perf_counter() - started:.1f} s\n",
        markup=False,
    )
    for title, text in QUESTIONS:
        out.print(title, style="bold", markup=False)
        out.print(f"cgdb> {text}", style="cyan", markup=False, soft_wrap=True)
        began = time.perf_counter()
        result = db.query(text)
        seconds = time.perf_counter() - began
        warn(result.warnings)
        show(result, "table")
        if result.rows:
            out.print(f"why {render.clean(str(result.rows[0].values[0]))}:", style="dim", markup=False)
            for reason in result.rows[0].why:
                out.print("  " + render.clean(str(reason)), style="dim", markup=False, soft_wrap=True)
        out.print(f"{1000 * seconds:.0f} ms\n", style="dim", markup=False)
