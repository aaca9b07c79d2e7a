"""Files and camera frames to scene graphs.

In the order of the data: loading (picks the reader) -> source (what a path holds) -> one module per file format
(planner_json, plain_json, json_lines, scene_json, spark_dsg, virtualhome, conceptgraphs_main, conceptgraphs_cache,
conceptgraphs_ali) -> relate (relations from boxes).
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from cgdb.ingest.loading import FORMATS, SceneStream, detect, load, stream

__all__ = ["FORMATS", "SceneStream", "detect", "load", "stream"]


def __getattr__(name: str) -> Any:
    if name in __all__:
        # The module has another name than its function, else importing the one would hide the other.
        from cgdb.ingest import loading

        found = {each: getattr(loading, each) for each in __all__}
        globals().update(found)
        return found[name]
    raise AttributeError(f"module 'cgdb.ingest' has no attribute '{name}'")
