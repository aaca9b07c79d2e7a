"""A statement as JSON: ``from_json(to_json(tree)) == tree`` for every tree, in the fields of ``query_schema``."""

from __future__ import annotations

from typing import Any

from cgdb.grammar import ast


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
