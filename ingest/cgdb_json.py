"""cgdb's own scene JSON, as one format among the others: the reading itself is in scene_json."""

from __future__ import annotations

from cgdb.ingest import scene_json
from cgdb.ingest.source import Source
from cgdb.scene import SceneGraph


def matches(source: Source) -> bool:
    """JSON whose top level says that it is a cgdb scene."""
    return source.kind == "json" and scene_json.matches(source.value())


def read(source: Source, name: str | None) -> SceneGraph:
    """The scene as it was written, under its own name unless another is given."""
    # The one who calls puts the file's name in front of errors; said here, it would stand there twice.
    return scene_json.from_document(source.value(), name, source="cgdb scene")
