"""What a language model said of an object: a summary, tags, a tag; or text that is no JSON; or nothing."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from cgdb.errors import FormatError
from cgdb.ingest import fields, strict_json

MOST_CAPTIONS = 16


@dataclass(frozen=True, slots=True, kw_only=True)
class Said:
    """One object's answer. understood is False where there was an answer that could not be read."""

    summary: str | None = None
    tag: str | None = None
    tags: tuple[str, ...] = ()
    captions: tuple[str, ...] = ()
    understood: bool = True


def of_caption_dict(value: object, where: str) -> Said:
    """The answer of a {"id", "captions", "response"}, whose response may be parsed, raw text or "FAIL"."""
    if not isinstance(value, Mapping):
        return Said()
    captions = _texts(value.get("captions"), where)[:MOST_CAPTIONS]
    response = value.get("response")
    if isinstance(response, str):
        try:
            response = strict_json.parse(_unfenced(response))
        except FormatError:
            return Said(captions=captions, understood=False)
    if not isinstance(response, Mapping):
        return Said(captions=captions, understood=response is None)
    return Said(
        summary=_text(response.get("summary"), where),
        tag=_text(response.get("object_tag"), where),
        tags=_texts(response.get("possible_tags"), where),
        captions=captions,
    )


def _unfenced(text: str) -> str:
    """JSON out of the fence of backquotes that models like to put round it."""
    text = text.strip()
    if text.startswith("```") and text.endswith("```"):
        text = text.strip("`").removeprefix("json")
    return text


def _text(value: object, where: str) -> str | None:
    """Text if it is text: a model's answer owes nobody a type."""
    return fields.text(value, where, "the answer") if isinstance(value, str) else None


def _texts(value: object, where: str) -> tuple[str, ...]:
    items = value if isinstance(value, (list, tuple)) else [value]
    return tuple(dict.fromkeys(found for item in items if (found := _text(item, where))))


def parsed(item: object) -> object:
    """An answer of the one-file form, which is JSON text; None where it is not."""
    if not isinstance(item, str):
        return item
    try:
        return strict_json.parse(item)
    except FormatError:
        return None


def joined(first: Said, second: Said) -> Said:
    """What either says, the first where both do."""
    return Said(
        summary=first.summary or second.summary,
        tag=first.tag or second.tag,
        tags=first.tags or second.tags,
        captions=first.captions or second.captions,
        understood=first.understood and second.understood,
    )
