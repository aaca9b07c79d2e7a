"""A JSON answer of a model: constrained by a schema where the server can, else asked for in words."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from cgdb.model.llm import REFUSED, Message, Meter, Model, ModelError, Reply
from cgdb.model.replies import json_in


def ask_json(
    model: Model, messages: Sequence[Message], meter: Meter, *, name: str, schema: Mapping[str, Any], max_tokens: int
) -> dict[str, Any]:
    """The JSON object that a model answers. ModelError where, asked twice, it answers none.

    Its fields are not checked: servers promise a schema and do not keep it.
    """
    reply = _asked(model, messages, meter, name, schema, max_tokens)
    found = json_in(reply.said)
    if not isinstance(found, dict):
        again = [
            *messages,
            {"role": "assistant", "content": reply.said[:2000]},
            {"role": "user", "content": "That is no JSON object. Answer with the JSON object and nothing else."},
        ]
        found = json_in(_asked(model, again, meter, name, schema, max_tokens).said)
    if not isinstance(found, dict):
        raise ModelError("the model does not answer with JSON")
    return found


def _asked(
    model: Model, messages: Sequence[Message], meter: Meter, name: str, schema: Mapping[str, Any], max_tokens: int
) -> Reply:
    model.prepare(meter)
    refused: list[str] = []
    for way in list(model.abilities.json):
        try:
            reply = model.chat(messages, meter, max_tokens=max_tokens, more=_fields(way, name, schema))
        except ModelError as error:
            if way != "text" and error.status in REFUSED:
                refused.append(way)
                continue
            raise
        # Only now is it sure that the way was refused, and not the request as such.
        for other in refused:
            model.abilities.cannot("json", other)
        return reply
    raise AssertionError("plain text is always tried")


def _fields(way: str, name: str, schema: Mapping[str, Any]) -> dict[str, Any]:
    if way == "schema":
        return {
            "response_format": {
                "type": "json_schema",
                "json_schema": {"name": name, "strict": True, "schema": dict(schema)},
            }
        }
    return {"response_format": {"type": "json_object"}} if way == "object" else {}
