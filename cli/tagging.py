"""``cgdb tag``: objects without a name get the nearest names of a vocabulary."""

from __future__ import annotations

import json
from argparse import Namespace
from collections.abc import Mapping
from dataclasses import asdict
from typing import TYPE_CHECKING

import cgdb
from cgdb.cli import render, values
from cgdb.cli.progress import progress_bar

if TYPE_CHECKING:
    from cgdb.enrich.tags import SceneTags
    from cgdb.meaning.embed import Encoder


def tag(options: Namespace) -> int:
    """Tag the objects of a store, or say what would be tagged."""
    encoders = values.encoders(options.encoder)
    with values.opened(options.store, encoders) as db:
        done = tag_scenes(
            db,
            options.vocabulary,
            scenes=options.scene or (),
            space=options.space,
            top=options.top,
            replace=options.replace,
            encoders=encoders,
            write=not options.dry_run,
            quiet=options.quiet,
        )
    if options.json:
        render.write(json.dumps([asdict(scene) for scene in done], indent=2))
    elif not options.quiet or options.dry_run:
        for scene in done:
            render.say(told(scene, dry=options.dry_run))
    return 0


def tag_scenes(
    db: cgdb.Database,
    vocabulary: str,
    *,
    scenes: tuple[str, ...] | list[str] = (),
    space: str | None = None,
    top: int = 5,
    replace: bool = False,
    encoders: Mapping[str, Encoder] | None = None,
    write: bool = True,
    quiet: bool = False,
) -> tuple[SceneTags, ...]:
    """What was done with each scene, with progress on stderr."""
    from cgdb.enrich.tags import Tagging

    work = Tagging(db, vocabulary, scenes=scenes, space=space, top=top, replace=replace, encoders=encoders)
    with progress_bar(quiet) as progress:
        task = progress.add_task("opening the vocabulary", total=None)
        for step in work.run(write=write):
            progress.update(task, description=step.what, completed=step.done, total=step.total)
    return work.scenes


def told(scene: SceneTags, *, dry: bool = False) -> str:
    """One line on a scene."""
    line = f"{scene.scene}: {scene.tagged:,} of {scene.objects:,} objects {'would get' if dry else 'have new'} tags"
    if scene.named:
        line += f", {scene.named:,} keep the name they have"
    if scene.unseen:
        line += f", {scene.unseen:,} have no features to compare"
    return line + ("" if dry else f"; revision {scene.revision}" if scene.revision is not None else "; nothing new")
