"""A statement as JSON, and the schema of that JSON: for model servers that constrain an answer by a JSON schema.

``from_json(to_json(tree)) == tree`` for every tree. The schema keeps to what strict structured outputs take: every
field is required (null where there is none), nothing more is allowed, and the root is an object. It leaves out what a
model has no use for (EXPLAIN, USE, AS OF, RERANK BY); ``from_json`` reads that too.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from cgdb.errors import ParseError
from cgdb.grammar import ast

COMPARISONS = ("=", "<>", "<", "<=", ">", ">=")
ARITHMETIC = ("+", "-", "*", "/", "%")
OPERATORS = (
    *("and", "or", "not", *COMPARISONS, "in", "contains", "starts with", "is null", "is not null"),
    *(*ARITHMETIC, "negative", "list"),
)
MAX_DEPTH = 60


# -- the schema -------------------------------------------------------------------------------------------------


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


# -- writing ----------------------------------------------------------------------------------------------------


def to_json(query: ast.Query) -> dict[str, Any]:
    """A statement as JSON-ready values. What the schema does not have is there only where it says something."""
    document: dict[str, Any] = {
        "match": [_path(pattern) for pattern in query.patterns],
        "where": None if query.where is None else _value(query.where),
        "distinct": query.distinct,
        "return": [{"value": _value(item.expression), "as": item.name} for item in query.returns],
        "order": [{"by": _value(item.expression), "desc": item.descending} for item in query.order],
        "limit": _amount(query.limit),
    }
    if query.skip is not None:
        document["skip"] = _amount(query.skip)
    if query.mode is not ast.Mode.RUN:
        document["mode"] = query.mode.value
    if query.scenes:
        document["use"] = [_value(scene) for scene in query.scenes]
    if query.as_of is not None:
        document["as_of"] = _value(query.as_of)
    if query.rerank is not None:
        document["rerank"] = {"question": _value(query.rerank.question), "top": _amount(query.rerank.top)}
    return document


def _amount(item: ast.Number | ast.Parameter | None) -> Any:
    if item is None:
        return None
    return item.value if isinstance(item, ast.Number) else {"param": item.name}


def _path(pattern: ast.Pattern) -> dict[str, Any]:
    steps = [
        {"edge": _edge(edge), "node": _node(node)} for edge, node in zip(pattern.edges, pattern.nodes[1:], strict=True)
    ]
    return {"start": _node(pattern.nodes[0]), "steps": steps}


def _node(node: ast.NodePattern) -> dict[str, Any]:
    return {
        "var": node.variable,
        "label": node.label,
        "id": None if node.id is None else node.id.id,
        "props": [{"name": name, "value": _value(value)} for name, value in node.properties],
        "like": None if node.meaning is None else _value(node.meaning),
    }


def _edge(edge: ast.EdgePattern) -> dict[str, Any]:
    return {
        "var": edge.variable,
        "labels": list(edge.labels),
        "way": edge.direction.value,
        "min": edge.min_hops,
        "max": edge.max_hops,
        "like": None if edge.meaning is None else _value(edge.meaning),
    }


def _value(item: ast.Expression) -> dict[str, Any]:
    match item:
        case ast.Text():
            return {"text": item.value}
        case ast.Parameter():
            return {"param": item.name}
        case ast.ObjectRef():
            return {"id": item.id}
        case ast.Number():
            return {"value": item.value, "unit": item.unit}
        case ast.Boolean():
            return {"value": item.value, "unit": None}
        case ast.Null():
            return {"value": None, "unit": None}
        case ast.Variable():
            return {"var": item.name, "prop": None, "like": None}
        case ast.Property():
            return {"var": item.variable, "prop": item.name, "like": None}
        case ast.Similar():
            return {"var": item.variable, "prop": None, "like": _value(item.meaning)}
        case ast.PatternCondition():
            return {"path": _path(item.pattern)}
        case ast.Call():
            return {
                "call": item.name,
                "of": [_value(argument) for argument in item.arguments],
                "distinct": item.distinct,
                "star": item.star,
            }
        case ast.And():
            return _operation("and", *item.items)
        case ast.Or():
            return _operation("or", *item.items)
        case ast.Not():
            return _operation("not", item.item)
        case ast.Comparison() | ast.Arithmetic():
            return _operation(item.op, item.left, item.right)
        case ast.In():
            return _operation("in", item.item, item.collection)
        case ast.Contains():
            return _operation("contains", item.text, item.part)
        case ast.StartsWith():
            return _operation("starts with", item.text, item.prefix)
        case ast.IsNull():
            return _operation("is not null" if item.negated else "is null", item.item)
        case ast.Negative():
            return _operation("negative", item.operand)
        case ast.ListOf():
            return _operation("list", *item.items)


def _operation(name: str, *items: ast.Expression) -> dict[str, Any]:
    return {"op": name, "of": [_value(item) for item in items]}


# -- reading ----------------------------------------------------------------------------------------------------


def from_json(document: Any) -> ast.Query:
    """The statement that JSON says. ParseError, naming the place in the JSON, where it says none."""
    top = _Reader(document, "the query", 0)
    top.only("match", "where", "distinct", "return", "order", "skip", "limit", "mode", "use", "as_of", "rerank")
    mode = top.text("mode", "RUN")
    if mode not in list(ast.Mode):
        raise top.wrong(f"mode is {' or '.join(ast.Mode)}, not {mode[:20]!r}")
    patterns, returns = top.items("match"), top.items("return")
    if not patterns or not returns:
        raise top.wrong("match and return must each have at least one member")
    rerank = top.inner("rerank")
    return ast.Query(
        mode=ast.Mode(mode),
        scenes=tuple(_text_or_parameter(item) for item in top.items("use")),
        as_of=_moment(top.inner("as_of")),
        patterns=tuple(map(_read_path, patterns)),
        where=_optional(top.inner("where")),
        distinct=top.truth("distinct"),
        returns=tuple(ast.ReturnItem(expression=_read(i.needed("value")), name=i.maybe("as")) for i in returns),
        order=tuple(
            ast.OrderItem(expression=_read(i.needed("by")), descending=i.truth("desc")) for i in top.items("order")
        ),
        rerank=None
        if rerank is None
        else ast.Rerank(question=_text_or_parameter(rerank.needed("question")), top=rerank.amount("top")),
        skip=top.amount("skip"),
        limit=top.amount("limit"),
    )


class _Reader:
    """One JSON object, with the way to it for error messages."""

    def __init__(self, document: Any, where: str, depth: int) -> None:
        if not isinstance(document, Mapping):
            raise ParseError(f"{where} must be a JSON object, not {str(document)[:40]!r}")
        if depth > 4 * MAX_DEPTH:
            raise ParseError(f"{where[:80]}... is nested too deep")
        self.document, self.where, self._depth = document, where, depth

    def wrong(self, message: str) -> ParseError:
        return ParseError(f"{self.where}: {message}")

    def only(self, *names: str) -> None:
        for name in self.document:
            if name not in names:
                raise self.wrong(f"there is no field {str(name)[:40]!r}; there are {', '.join(names)}")

    def inner(self, name: str) -> _Reader | None:
        value = self.document.get(name)
        return None if value is None else _Reader(value, f"{self.where}.{name}", self._depth + 1)

    def needed(self, name: str) -> _Reader:
        found = self.inner(name)
        if found is None:
            raise self.wrong(f"{name} is missing")
        return found

    def items(self, name: str) -> list[_Reader]:
        value = self.document.get(name)
        if value is None:
            return []
        if not isinstance(value, Sequence) or isinstance(value, str):
            raise self.wrong(f"{name} must be a list")
        return [_Reader(item, f"{self.where}.{name}[{i}]", self._depth + 1) for i, item in enumerate(value)]

    def maybe(self, name: str) -> str | None:
        value = self.document.get(name)
        if value is None or isinstance(value, str):
            return value
        raise self.wrong(f"{name} must be a text or null")

    def text(self, name: str, default: str | None = None) -> str:
        value = self.maybe(name)
        if value is None:
            value = default
        if value is None:
            raise self.wrong(f"{name} is missing")
        return value

    def truth(self, name: str) -> bool:
        value = self.document.get(name)
        if value is not None and not isinstance(value, bool):
            raise self.wrong(f"{name} must be true or false")
        return bool(value)

    def whole(self, name: str, default: int | None) -> int | None:
        value = self.document.get(name, default)
        if value is None or (isinstance(value, int) and not isinstance(value, bool)):
            return value
        raise self.wrong(f"{name} must be a whole number")

    def amount(self, name: str) -> ast.Number | ast.Parameter | None:
        if isinstance(self.document.get(name), Mapping):
            return ast.Parameter(name=self.needed(name).text("param"))
        value = self.whole(name, None)
        return None if value is None else ast.Number(value=value)

    def identity(self, name: str) -> ast.ObjectRef | None:
        value = self.document.get(name)
        if value is None:
            return None
        if isinstance(value, str) or (isinstance(value, int) and not isinstance(value, bool)):
            return ast.ObjectRef(id=value)
        raise self.wrong(f"{name} must be the id of an object")


def _read_path(reader: _Reader) -> ast.Pattern:
    reader.only("start", "steps")
    steps = reader.items("steps")
    return ast.Pattern(
        nodes=(_read_node(reader.needed("start")), *(_read_node(step.needed("node")) for step in steps)),
        edges=tuple(_read_edge(step.needed("edge")) for step in steps),
    )


def _read_node(reader: _Reader) -> ast.NodePattern:
    reader.only("var", "label", "id", "props", "like")
    return ast.NodePattern(
        variable=reader.maybe("var"),
        label=reader.maybe("label"),
        id=reader.identity("id"),
        properties=tuple((item.text("name"), _read(item.needed("value"))) for item in reader.items("props")),
        meaning=_meaning(reader.inner("like")),
    )


def _read_edge(reader: _Reader) -> ast.EdgePattern:
    reader.only("var", "labels", "way", "min", "max", "like")
    labels = reader.document.get("labels") or []
    if not isinstance(labels, Sequence) or isinstance(labels, str) or not all(isinstance(x, str) for x in labels):
        raise reader.wrong("labels must be a list of texts")
    way = reader.text("way", "->")
    if way not in list(ast.Direction):
        raise reader.wrong(f"way is one of {', '.join(ast.Direction)}, not {way[:20]!r}")
    least = reader.whole("min", 1)
    return ast.EdgePattern(
        variable=reader.maybe("var"),
        labels=tuple(labels),
        direction=ast.Direction(way),
        min_hops=1 if least is None else least,
        max_hops=reader.whole("max", 1),
        meaning=_meaning(reader.inner("like")),
    )


def _optional(reader: _Reader | None) -> ast.Expression | None:
    return None if reader is None else _read(reader)


def _meaning(reader: _Reader | None) -> ast.Meaning | None:
    if reader is None:
        return None
    found = _read(reader)
    if not isinstance(found, ast.Text | ast.Parameter | ast.ObjectRef):
        raise reader.wrong("like is a text, a param or an id")
    return found


def _text_or_parameter(reader: _Reader) -> ast.Text | ast.Parameter:
    found = _read(reader)
    if not isinstance(found, ast.Text | ast.Parameter):
        raise reader.wrong("a text or a param belongs here")
    return found


def _moment(reader: _Reader | None) -> ast.Number | ast.Text | ast.Parameter | None:
    if reader is None:
        return None
    found = _read(reader)
    if not isinstance(found, ast.Number | ast.Text | ast.Parameter):
        raise reader.wrong("a number, a text or a param belongs here")
    return found


def _read(reader: _Reader) -> ast.Expression:
    fields = reader.document
    if "op" in fields:
        return _read_operation(reader)
    if "call" in fields:
        arguments = tuple(map(_read, reader.items("of")))
        star = reader.truth("star") and not arguments
        return ast.Call(
            name=reader.text("call").lower(),
            arguments=arguments,
            distinct=reader.truth("distinct") and bool(arguments),
            star=star,
        )
    if "path" in fields:
        return ast.PatternCondition(pattern=_read_path(reader.needed("path")))
    if "var" in fields:
        variable, name, like = reader.text("var"), reader.maybe("prop"), _meaning(reader.inner("like"))
        if like is not None:
            return ast.Similar(variable=variable, meaning=like)
        return ast.Variable(name=variable) if name is None else ast.Property(variable=variable, name=name)
    if "text" in fields:
        return ast.Text(value=reader.text("text"))
    if "param" in fields:
        return ast.Parameter(name=reader.text("param").removeprefix("$"))
    if "id" in fields:
        found = reader.identity("id")
        assert found is not None or fields["id"] is None
        return found or ast.Null()
    if "value" in fields:
        return _read_literal(reader)
    raise reader.wrong("a value has op, call, path, var, text, param, id or value")


def _read_literal(reader: _Reader) -> ast.Expression:
    value = reader.document["value"]
    if value is None:
        return ast.Null()
    if isinstance(value, bool):
        return ast.Boolean(value=value)
    if isinstance(value, str):
        return ast.Text(value=value)
    if isinstance(value, (int, float)):
        return ast.Number(value=value, unit=reader.maybe("unit"))
    raise reader.wrong("value is a number, true, false or null")


def _read_operation(reader: _Reader) -> ast.Expression:
    name = reader.text("op").lower()
    items = tuple(map(_read, reader.items("of")))

    def take(count: int) -> tuple[ast.Expression, ...]:
        if len(items) != count:
            raise reader.wrong(f"'{name}' takes {count} of them, not {len(items)}")
        return items

    match name:
        case "and" | "or":
            kind = ast.And if name == "and" else ast.Or
            # One thing, or an "and" in an "and", says the same without.
            flat = tuple(part for item in items for part in (item.items if isinstance(item, kind) else (item,)))
            if not flat:
                raise reader.wrong(f"'{name}' takes at least two of them")
            return flat[0] if len(flat) == 1 else kind(items=flat)
        case "not":
            return ast.Not(item=take(1)[0])
        case "in":
            return ast.In(item=take(2)[0], collection=items[1])
        case "contains":
            return ast.Contains(text=take(2)[0], part=items[1])
        case "starts with":
            return ast.StartsWith(text=take(2)[0], prefix=items[1])
        case "is null" | "is not null":
            return ast.IsNull(item=take(1)[0], negated=name == "is not null")
        case "negative":
            return ast.Negative(operand=take(1)[0])
        case "list":
            return ast.ListOf(items=items)
    if name in COMPARISONS:
        return ast.Comparison(op=name, left=take(2)[0], right=items[1])
    if name in ARITHMETIC:
        return ast.Arithmetic(op=name, left=take(2)[0], right=items[1])
    raise reader.wrong(f"there is no op {name[:30]!r}; there are {', '.join(OPERATORS)}")
