"""The statement that JSON says: what a model answers to the schema, and what a model answers that heeds none."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from cgdb.errors import ParseError
from cgdb.grammar import ast
from cgdb.model.query_schema import ARITHMETIC, COMPARISONS, OPERATORS

MAX_DEPTH = 60


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
