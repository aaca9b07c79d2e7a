"""The JSON schema of a statement, for model servers that constrain an answer by one.

It keeps to what strict structured outputs take: every field is required (null where there is none), nothing more is
allowed, and the root is an object. It leaves out what a model has no use for (EXPLAIN, USE, AS OF, RERANK BY);
``query_from_json`` reads that too.
"""

from __future__ import annotations

from typing import Any

from cgdb.grammar import ast

COMPARISONS = ("=", "<>", "<", "<=", ">", ">=")
ARITHMETIC = ("+", "-", "*", "/", "%")
OPERATORS = (
    *("and", "or", "not", *COMPARISONS, "in", "contains", "starts with", "is null", "is not null"),
    *(*ARITHMETIC, "negative", "list"),
)


def schema() -> dict[str, Any]:
    """The JSON schema of a statement."""
    text, number, truth = {"type": "string"}, {"type": "integer"}, {"type": "boolean"}
    maybe = {"type": ["string", "null"]}
    value, like, path = {"$ref": "#/$defs/value"}, {"$ref": "#/$defs/like"}, {"$ref": "#/$defs/path"}
    maybe_like = {"anyOf": [like, {"type": "null"}]}
    return {
        **_object(
            match=_list(path),
            where={"anyOf": [value, {"type": "null"}]},
            distinct=truth,
            **{"return": _list(_object(value=value, **{"as": maybe}))},
            order=_list(_object(by=value, desc=truth)),
            limit={"type": ["integer", "null"]},
        ),
        "$defs": {
            "path": _object(
                start={"$ref": "#/$defs/node"},
                steps=_list(_object(edge={"$ref": "#/$defs/edge"}, node={"$ref": "#/$defs/node"})),
            ),
            "node": _object(
                var=maybe,
                label=maybe,
                id={"type": ["integer", "string", "null"]},
                props=_list(_object(name=text, value=value)),
                like=maybe_like,
            ),
            "edge": _object(
                var=maybe,
                labels=_list(text),
                way={"type": "string", "enum": [direction.value for direction in ast.Direction]},
                min=number,
                max={"type": ["integer", "null"]},
                like=maybe_like,
            ),
            "like": {"anyOf": [_object(text=text), _object(param=text), _object(id={"type": ["integer", "string"]})]},
            "value": {
                "anyOf": [
                    _object(op={"type": "string", "enum": list(OPERATORS)}, of=_list(value)),
                    _object(call=text, of=_list(value), distinct=truth, star=truth),
                    _object(var=text, prop=maybe, like=maybe_like),
                    _object(path=path),
                    like,
                    _object(
                        value={"type": ["number", "boolean", "null"]},
                        unit={"type": ["string", "null"], "enum": [*ast.UNITS, None]},
                    ),
                ]
            },
        },
    }


def _object(**fields: Any) -> dict[str, Any]:
    return {"type": "object", "properties": fields, "required": list(fields), "additionalProperties": False}


def _list(items: Any) -> dict[str, Any]:
    return {"type": "array", "items": items}
