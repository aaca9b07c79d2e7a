"""ConceptGraphs' scene_graph.json: the list of {id, bbox_extent, bbox_center, possible_tags, object_tag, caption}
that the paper gives to its planner.

Objects whose tag is invalid, none or unknown are dropped, as the reference planner does; the count is kept.
"""

from __future__ import annotations

from typing import Any

from cgdb.errors import FormatError
from cgdb.ingest import fields, plain_json, strict_json
from cgdb.ingest.report import Report
from cgdb.ingest.source import Source
from cgdb.scene import SceneGraph

ANNOTATIONS = "annotated_scenegraph.json"
KEYS = {"id", "bbox_center", "object_tag"}


def matches(source: Source) -> bool:
    """A list whose first object has the planner's fields."""
    listed = source.records()
    return bool(listed) and listed[0].keys() >= KEYS


def read(source: Source, name: str | None) -> SceneGraph:
    """The objects that the planner would see, with the colors and materials typed by a person where they lie beside."""
    value = source.value()
    if not isinstance(value, list):
        raise FormatError(f"this is a JSON {strict_json.kind_of(value)}, not a list of objects")
    report = Report()
    notes = _annotations(source, report)
    kept: list[tuple[int, Any]] = []
    for position, record in enumerate(value):
        if not isinstance(record, dict):
            raise FormatError(f"record {position}: must be an object with fields, not {strict_json.kind_of(record)}")
        tag = fields.text(record.get("object_tag"), f"record {position}", "the tag")
        if tag is not None and tag.casefold() in fields.INVALID_TAGS:
            report.drop("objects tagged invalid, none or unknown")
            continue
        kept.append((position, {**notes.get(str(record.get("id")), {}), **record}))
    return plain_json.from_records(kept, name, source, report, "conceptgraphs-planner")


def _annotations(source: Source, report: Report) -> dict[str, dict[str, Any]]:
    """{id: {colors, materials, ...}} of the annotations beside the file; empty where there are none."""
    path = source.path.parent / ANNOTATIONS
    if not path.is_file() or path.samefile(source.path):
        return {}
    try:
        listed = Source(path).records()
    except FormatError as error:
        raise FormatError(f"{ANNOTATIONS} beside it: {error.message}", hint=error.hint) from error
    report.warn(f"colors and materials come from {ANNOTATIONS}")
    return {
        str(record["id"]): {key: value for key, value in record.items() if isinstance(value, str) and value.strip()}
        for record in listed
        if "id" in record
    }
