"""What of a store's scenes decides how a question is written, beside their names: floors, captions, words."""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING

import numpy as np

from cgdb.result import StoredNode

if TYPE_CHECKING:
    from cgdb.english.intent import Setting
    from cgdb.view import SceneView

LOOKED_AT = 2000
"""Things of a scene whose names and captions are read: enough for what they are like, and quick in any map."""
LOWEST = 2.0
"""The percentile of the undersides of boxes that is taken for the floor: a few noisy boxes always reach below it."""
_WORD = re.compile(r"[^\W\d_]{3,}")


def surveyed(views: Sequence[SceneView], places: Sequence[str], *, previous: bool) -> Setting:
    """The setting of a question that is asked of these scenes."""
    from cgdb.english.intent import Setting

    nodes = [node for view in views for node in _some(view)]
    names = (text for node in nodes for text in (node.tag, node.caption) if text)
    frames = tuple((view.info.name, view.info.up or "z", _floor(view)) for view in views)
    return Setting(
        places=tuple(places),
        # Where a scene holds no boxes, nothing is high or low.
        frames=tuple(frame for frame in frames if frame[2] is not None) or frames or (("", "z", None),),
        tells=any(node.caption and len(node.caption.split()) > 2 for node in nodes),
        previous=previous,
        words=frozenset(word.casefold() for text in names for word in _WORD.findall(text)),
    )


def _some(view: SceneView) -> Iterable[StoredNode]:
    positions = view.columns.of_label("Object")
    return view.stored(positions[:: max(1, len(positions) // LOOKED_AT)]).values()


def _floor(view: SceneView) -> float | None:
    """The level of the floor along the up axis, in metres; None where no box is known."""
    boxes = view.columns.boxes
    bottoms = boxes.up_sign * boxes.centers[:, boxes.up_axis] - boxes.half_hulls[:, boxes.up_axis]
    known = bottoms[np.isfinite(bottoms)]
    return round(float(np.percentile(known, LOWEST)), 2) if len(known) else None
