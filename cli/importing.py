"""``cgdb import`` and ``cgdb encode``."""

from __future__ import annotations

import contextlib
import shutil
import time
from argparse import Namespace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import cgdb
from cgdb.cli import render
from cgdb.cli.progress import progress_bar
from cgdb.errors import CgdbError, EncoderError, FormatError, MissingExtraError, SceneError, UsageError

if TYPE_CHECKING:
    from rich.progress import Progress

    from cgdb.scene import Relation, SceneObject


def import_maps(options: Namespace) -> int:
    """Bring maps into a store, each as one revision."""
    if options.name is not None and len(options.maps) > 1:
        raise UsageError("--name names one scene, but several maps were given")
    missing = [path for path in options.maps if not Path(path).exists()]
    if missing:
        # Before the store is made: a slip of the pen should leave nothing behind.
        raise UsageError(f"{missing[0]} does not exist")
    fresh = not Path(options.into).exists()
    failed: CgdbError | None = None
    try:
        with cgdb.open(options.into, create=True) as db, progress_bar(options.quiet) as progress:
            for path in options.maps:
                try:
                    _import_one(db, path, options, progress)
                except (FormatError, SceneError) as error:
                    # One bad map of many does not keep the others out; what is wrong with the store does.
                    if len(options.maps) == 1:
                        raise
                    progress.console.print(render.clean_lines(error.render()), markup=False, soft_wrap=True)
                    failed = error
                else:
                    fresh = False
            if not options.no_encode and not fresh:
                _encode_if_possible(db, progress)
    except BaseException:
        if fresh:
            remove_if_empty(Path(options.into))
        raise
    if fresh:
        remove_if_empty(Path(options.into))
    return 0 if failed is None else failed.exit_code


def remove_if_empty(store: Path) -> None:
    """A first import that failed leaves no empty store behind; one that another process wrote to is let be."""
    with contextlib.suppress(CgdbError):
        with cgdb.open(store, text_encoder=None) as db:
            empty = not db.revisions()
        if empty:
            shutil.rmtree(store, ignore_errors=True)


def _encode_if_possible(db: cgdb.Database, progress: Progress) -> None:
    try:
        _encode(db, None, progress)
    except (MissingExtraError, EncoderError) as error:
        hint = f" ({error.hint})" if error.hint else ""
        text = f"note: captions have no vectors yet, words alone are matched: {error.message}{hint}"
        progress.console.print(text, markup=False, soft_wrap=True)


def _import_one(db: cgdb.Database, path: str, options: Namespace, progress: Progress) -> None:
    from cgdb import ingest

    started = time.perf_counter()
    task = progress.add_task(f"reading {Path(path).name}", total=None)
    found = options.format or ingest.detect(path)
    if found == "jsonl":
        count, revision, name, warnings = _stream(db, path, options, progress, task)
    else:
        scene = ingest.load(
            path, name=options.name, format=options.format, relate=not options.no_relate, part=options.part
        )
        progress.update(task, description=f"writing {scene.name}", total=len(scene.objects), completed=0)
        revision = db.add(scene, on_existing=options.on_existing, message=f"import {Path(path).name}")
        count, name = len(scene.objects), scene.name
        warnings = list(scene.provenance.get("warnings", ()))
    progress.update(task, description=f"indexing {name}", total=None)
    db.prepare(name)
    progress.remove_task(task)
    if options.quiet:
        return
    for line in warnings[:5]:
        progress.console.print(f"note: {render.clean(line)}", markup=False, soft_wrap=True)
    if len(warnings) > 5:
        progress.console.print(f"note: and {len(warnings) - 5} more like it", markup=False)
    seconds = time.perf_counter() - started
    what = "nothing new" if revision is None else f"revision {revision}"
    progress.console.print(
        f"{path} ({found}): scene '{render.clean(name)}', {count:,} objects, {what}, {seconds:.1f} s",
        markup=False,
        soft_wrap=True,
    )


def _stream(
    db: cgdb.Database, path: str, options: Namespace, progress: Progress, task: Any
) -> tuple[int, int | None, str, list[str]]:
    """Import line by line; of the objects only ids and boxes stay in memory, for the relations between them."""
    from cgdb import ingest
    from cgdb.ingest.relations.outline import Outline

    stream = ingest.stream(path, name=options.name, format=options.format)
    header = stream.header
    outline = Outline()
    count = 0
    with db.write(
        header.name,
        message=f"import {Path(path).name}",
        on_existing=options.on_existing,
        frame=header.frame,
        up=header.up,
        spaces=header.spaces,
        provenance=header.provenance,
    ) as writer:
        writer.places(header.places)
        for objects, relations in stream.batches:
            _write_batch(writer, objects, relations)
            outline.add(objects)
            count += len(objects)
            progress.update(task, description=f"writing {header.name}: {count:,} objects")
        if not options.no_relate:
            progress.update(task, description=f"relating {count:,} objects")
            writer.relations(outline.relations(up=header.up))
    return count, writer.revision, header.name, []


def _write_batch(writer: Any, objects: tuple[SceneObject, ...], relations: tuple[Relation, ...]) -> None:
    writer.objects(objects)
    writer.relations(relations)


def encode(options: Namespace) -> int:
    """Give texts their vectors."""
    with cgdb.open(options.store) as db, progress_bar(options.quiet) as progress:
        _encode(db, options.scene, progress)
    return 0


def _encode(db: cgdb.Database, scene: str | None, progress: Progress) -> None:
    task = None
    for done, total in db.encode(scene):
        if task is None:
            task = progress.add_task("encoding captions", total=total)
        progress.update(task, completed=done)
    if task is not None:
        progress.remove_task(task)
