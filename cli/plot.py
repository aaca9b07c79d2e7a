"""A picture of a scene with a result highlighted: ``cgdb plot`` and ``:plot``."""

from __future__ import annotations

import sys
from argparse import Namespace
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import cgdb
from cgdb.cli import picture, render, values
from cgdb.cli.asking import warn
from cgdb.cli.marks import Marks, marks_of
from cgdb.errors import UsageError, one_of

if TYPE_CHECKING:
    from cgdb.result import Result


def plot(options: Namespace) -> int:
    """Draw a scene, and what a statement finds in it; the path of the picture on stdout."""
    check_target(options.output)
    picture.require()
    if options.text is not None and options.query is not None:
        raise UsageError("the statement is given twice", hint="--query CGQL, or CGQL as the last word")
    asked = options.text if options.query is None else options.query
    sheet = picture.Sheet(
        view=options.view,
        color=options.color,
        labels=_labels(options.labels),
        size=None if options.size is None else picture.parse_size(options.size),
    )
    with values.opened(options.store, values.encoders(options.encoder)) as db:
        result = None
        if asked is not None:
            text = sys.stdin.read() if asked == "-" else asked
            result = db.query(text, values.parameters(options.parameters))
            warn(result.warnings)
        drawn = draw(
            db, result, options.output, scene=options.scene, sheet=sheet, relations=values.listed(options.relations)
        )
    render.say(drawn)
    render.write(options.output)
    return 0


def _labels(text: str | None) -> int:
    if text is None:
        return picture.LABELS
    if text.casefold() == "none":
        return 0
    if not (text.isascii() and text.isdigit() and len(text) < 6):
        raise UsageError(f"--labels {text[:20]!r} is no number", hint="how many things to name at most, or none")
    return int(text)


def check_target(path: str) -> None:
    """Refuse a file that no picture can be written to, before anything is asked."""
    if Path(path).suffix.casefold() not in picture.ENDINGS:
        raise UsageError(f"{path}: a picture's name ends with one of {', '.join(picture.ENDINGS)}")
    if not Path(path).absolute().parent.is_dir():
        raise UsageError(f"{path}: there is no such folder")


def draw(
    db: cgdb.Database,
    result: Result | None,
    path: str,
    *,
    scene: str | None = None,
    sheet: picture.Sheet | None = None,
    relations: tuple[str, ...] = (),
) -> str:
    """Write the picture; says what is on it. scene: else the one with most of the result, or the only one."""
    from cgdb.cli.picture_scene import gather
    from cgdb.export import write_whole

    check_target(path)
    marks = marks_of(db, result)
    view = db.view(chosen_scene(db, marks, scene))
    found = marks.get(view.info.name, {})
    shown = gather(db, view, found, result, relations=relations)
    sheet = sheet or picture.Sheet()
    # The statement is what the picture answers; without one, what the place holds.
    counts = [_count(view.info.n_objects, "object")]
    if view.info.n_places:
        counts.append(_count(view.info.n_places, "place"))
    if shown.n_points:
        counts.append(_count(shown.n_points, "point"))
    note = " · ".join(counts) if result is None else result.query
    made = picture.paint(shown, Path(path).suffix, _titled(sheet, view.info.name, note))
    write_whole(Path(path), [made.data])
    marked = ""
    if result is not None:
        nearest = " (nothing fits, these are the nearest)" if found and result.nothing_fits else ""
        marked = f"{len(found)} of the result marked{nearest}, "
    says = [f"scene '{view.info.name}', {marked}{_count(made.named, 'thing')} named"]
    if shown.n_points > len(shown.points):
        says.append(f"{len(shown.points):,} of {shown.n_points:,} points drawn, chosen evenly with seed 0")
    if shown.n_arrows > len(shown.arrows):
        says.append(f"{len(shown.arrows)} of {shown.n_arrows} relations drawn")
    return "; ".join(says)


def _titled(sheet: picture.Sheet, title: str, note: str) -> picture.Sheet:
    from dataclasses import replace

    return replace(sheet, title=title, note=note)


def _count(number: int, what: str) -> str:
    return f"{number:,} {what}{'' if number == 1 else 's'}"


def chosen_scene(db: cgdb.Database, marks: Marks, scene: str | None) -> str:
    """The scene to draw."""
    if scene is not None:
        return db.view(scene).info.name
    if marks:
        return max(marks, key=lambda name: len(marks[name]))
    names = [info.name for info in db.scenes()]
    return only_scene(names)


def only_scene(names: Sequence[str]) -> str:
    """The one scene of a store; UsageError where it holds none, or several."""
    if not names:
        raise UsageError("the store holds no scene", hint="`cgdb import` and `cgdb map` bring one")
    if len(names) > 1:
        raise UsageError(f"the store holds {len(names)} scenes: say which", hint=one_of(names))
    return names[0]
