"""What of a store's scenes decides how a question is written, beside their names: floors, captions, words."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Iterable, Sequence
from itertools import chain
from typing import TYPE_CHECKING

import numpy as np

from cgdb.result import StoredNode

if TYPE_CHECKING:
    from cgdb.english.intent import Setting
    from cgdb.index.catalog import Catalog
    from cgdb.view import SceneView

LOOKED_AT = 2000
"""Things of a scene whose names and captions are read: enough for what they are like, and quick in any map."""
LOWEST = 2.0
"""The percentile of the undersides of boxes that is taken for the floor: a few noisy boxes always reach below it."""
MOST_SCENES = 20
"""Scenes whose places and values are read."""
_WORD = re.compile(r"[^\W\d_]{3,}")


def surveyed(views: Sequence[SceneView], *, previous: bool) -> Setting:
    """The setting of a question that is asked of these scenes."""
    from cgdb.english.intent import Setting

    nodes = [node for view in views for node in _some(view)]
    texts = (text for node in nodes for text in (node.tag, node.caption) if text)
    frames = tuple((view.info.name, view.info.up or "z", _floor(view)) for view in views)
    return Setting(
        places=tuple(places(views)),
        # Where a scene holds no boxes, nothing is high or low.
        frames=tuple(frame for frame in frames if frame[2] is not None) or frames or (("", "z", None),),
        tells=any(node.caption and len(node.caption.split()) > 2 for node in nodes),
        previous=previous,
        words=frozenset(word.casefold() for text in texts for word in _WORD.findall(text)),
        tags=frozenset(tag for node in nodes for tag in (node.tag, *node.tags) if tag),
    )


def places(views: Sequence[SceneView]) -> list[str]:
    """The names of rooms and other places, each once."""
    found: dict[str, None] = {}
    for view in views[:MOST_SCENES]:
        for label in view.catalog.labels:
            if label != "Object":
                positions = view.columns.of_label(label)[:100]
                found.update({node.tag: None for node in view.stored(positions).values() if node.tag})
    return list(found)


def list_values(views: Sequence[SceneView], catalog: Catalog) -> dict[str, list[str]]:
    """What stands in the properties that are lists, the most frequent first. catalog: of all the views."""
    found = {}
    for name in (name for name, kind in catalog.properties.items() if kind == "list"):
        columns = (view.column(name) for view in views[:MOST_SCENES])
        lists = (value for column in columns for value in column if isinstance(value, (list, tuple)))
        found[name] = [str(value) for value, _ in Counter(chain.from_iterable(lists)).most_common(20)]
    return found


def names(setting: Setting) -> frozenset[tuple[str, ...]]:
    """The names of things, each in singular words."""
    from cgdb.meaning.knowledge import knowledge
    from cgdb.meaning.words import stemmed

    return frozenset(stemmed(knowledge().readable(tag)) for tag in setting.tags)


def _some(view: SceneView) -> Iterable[StoredNode]:
    positions = view.columns.of_label("Object")
    return view.stored(positions[:: max(1, len(positions) // LOOKED_AT)]).values()


def _floor(view: SceneView) -> float | None:
    """The level of the floor along the up axis, in metres; None where no box is known."""
    boxes = view.columns.boxes
    bottoms = boxes.up_sign * boxes.centers[:, boxes.up_axis] - boxes.half_hulls[:, boxes.up_axis]
    known = bottoms[np.isfinite(bottoms)]
    return round(float(np.percentile(known, LOWEST)), 2) if len(known) else None
