"""``cgdb views``: the frames in which an object was seen best, and the object cut out of them as picture files."""

from __future__ import annotations

import json
from argparse import Namespace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import cgdb
from cgdb.cli import render
from cgdb.cli.values import file_name
from cgdb.errors import UsageError
from cgdb.scene import canonical_id, image_type

if TYPE_CHECKING:
    from cgdb.scene import ObjectId, View

ENDINGS = {"image/jpeg": ".jpg", "image/png": ".png", "image/webp": ".webp"}


def views(options: Namespace) -> int:
    """List the views of objects, or write their pictures."""
    if options.k is not None and options.k < 1:
        raise UsageError("-k must be at least 1")
    found: list[tuple[ObjectId, int, View]] = []
    with cgdb.open(options.store, text_encoder=None) as db:
        for text in options.ids:
            object_id = canonical_id(text.removeprefix("#") or text)
            seen = db.views(object_id, scene=options.scene, as_of=options.as_of)
            if not seen:
                render.say(f"note: #{object_id} has no views; `cgdb map` keeps them")
            found += [(object_id, rank, view) for rank, view in enumerate(seen[: options.k], start=1)]
    if options.into is not None:
        return _write(found, Path(options.into))
    if options.json:
        records = [record_of(object_id, rank, view) for object_id, rank, view in found]
        render.write(json.dumps(records, ensure_ascii=False, indent=2))
    elif found:
        columns = ("object", "best", "frame", "source", "points", "box", "picture")
        rows = [
            (f"#{object_id}", rank, view.frame, view.source, view.points, box_text(view), picture_text(view))
            for object_id, rank, view in found
        ]
        render.table(render.console(), columns, rows)
    return 0


def _write(found: list[tuple[ObjectId, int, View]], folder: Path) -> int:
    """Each picture as a file that is named after the object, the rank and the frame."""
    from cgdb.export import write_whole

    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise UsageError(f"{folder}: cannot be made a folder: {error.strerror or error}") from None
    written = 0
    for object_id, rank, view in found:
        if view.image is not None:
            ending = ENDINGS[image_type(view.image) or "image/jpeg"]
            write_whole(folder / f"{file_name(object_id)}-{rank:02}-frame{view.frame:06}{ending}", [view.image])
            written += 1
    without = len(found) - written
    note = f"; views without one: {without}" if without else ""
    render.say(f"wrote {written} pictures to {folder}{note}")
    return 0


def record_of(object_id: ObjectId, rank: int, view: View) -> dict[str, Any]:
    """A view for programs, without the bytes of its picture."""
    return {
        "object": object_id,
        "best": rank,
        "frame": view.frame,
        "source": view.source,
        "points": view.points,
        "box": list(view.box),
        "T_world_camera": None if view.T_world_camera is None else view.T_world_camera.tolist(),
        "picture": None if view.image is None else {"type": image_type(view.image), "bytes": len(view.image)},
    }


def box_text(view: View) -> str:
    """Where in the frame, and how large."""
    left, top, right, bottom = view.box
    return f"{right - left:.0f} × {bottom - top:.0f} at {left:.0f}, {top:.0f}"


def picture_text(view: View) -> str:
    """What is kept of it."""
    if view.image is None:
        return "none"
    return f"{(image_type(view.image) or '').removeprefix('image/')}, {len(view.image) / 1024:.1f} KB"
