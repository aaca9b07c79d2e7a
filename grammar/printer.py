"""Tree -> canonical text: ``parse(to_text(tree)) == tree``."""

from __future__ import annotations

import math
import re
from collections.abc import Iterable

from cgdb.errors import UsageError
from cgdb.grammar import ast
from cgdb.grammar.limits import MAX_NAME, MAX_TEXT, check_tree
from cgdb.grammar.machine import RESERVED
from cgdb.grammar.tables import PATTERNS

# How tightly each level of the grammar binds; an expression below the level of its place goes in parentheses.
OR, AND, NOT, COMPARISON, SUM, PRODUCT, SIGNED, OPERAND = range(8)

_WORD = re.compile(PATTERNS["NAME"])
_ESCAPED = re.compile(r"[\x00-\x1f\x7f-\x9f\u2028\u2029\ud800-\udfff]")
_LETTERS = {"\n": "\\n", "\r": "\\r", "\t": "\\t"}
_ARROWS = {
    ast.Direction.OUT: ("-->", "-[", "]->"),
    ast.Direction.IN: ("<--", "<-[", "]-"),
    ast.Direction.ANY: ("--", "-[", "]-"),
}


def to_text(tree: ast.Syntax) -> str:
    """The canonical text of a tree, or of any part of one, on one line.

    What no text can say (NaN, a name without letters, a LIMIT below 0) is a UsageError; a tree that is nested deeper
    than a text may be is a LimitError.
    """
    check_tree(tree)
    return _text(tree)


def _text(tree: ast.Syntax) -> str:
    match tree:
        case ast.Query():
            return _query(tree)
        case ast.ReturnItem():
            return expression(tree.expression, OR) + (f" AS {name(tree.name)}" if tree.name is not None else "")
        case ast.OrderItem():
            return expression(tree.expression, OR) + (" DESC" if tree.descending else "")
        case ast.Rerank():
            top = f" TOP {_amount(tree.top)}" if tree.top is not None else ""
            return f"RERANK BY {_text(tree.question)}{top}"
        case ast.Pattern():
            return _pattern(tree)
        case ast.NodePattern():
            return _node(tree)
        case ast.EdgePattern():
            return _edge(tree)
        case _:
            return expression(tree, OR)  # type: ignore[arg-type]


def _query(tree: ast.Query) -> str:
    clauses = []
    if tree.mode is not ast.Mode.RUN:
        clauses.append(tree.mode.value)
    if tree.scenes:
        clauses.append("USE " + _listed(tree.scenes))
    if tree.as_of is not None:
        clauses.append("AS OF " + (_amount(tree.as_of) if isinstance(tree.as_of, ast.Number) else _text(tree.as_of)))
    clauses.append("MATCH " + _listed(tree.patterns))
    if tree.where is not None:
        clauses.append("WHERE " + expression(tree.where, OR))
    clauses.append("RETURN " + ("DISTINCT " if tree.distinct else "") + _listed(tree.returns))
    if tree.order:
        clauses.append("ORDER BY " + _listed(tree.order))
    if tree.rerank is not None:
        clauses.append(_text(tree.rerank))
    if tree.skip is not None:
        clauses.append("SKIP " + _amount(tree.skip))
    if tree.limit is not None:
        clauses.append("LIMIT " + _amount(tree.limit))
    return " ".join(clauses)


def _listed(items: Iterable[ast.Syntax]) -> str:
    return ", ".join(map(_text, items))


def _amount(value: ast.Number | ast.Parameter) -> str:
    if isinstance(value, ast.Number) and (isinstance(value.value, float) or value.value < 0 or value.unit):
        raise UsageError(f"{value.value!r} cannot be written where a whole number from 0 on belongs")
    return expression(value, OR)


def _pattern(tree: ast.Pattern) -> str:
    if len(tree.nodes) != len(tree.edges) + 1:
        raise UsageError("a pattern has one node more than it has edges")
    parts = [_node(tree.nodes[0])]
    for edge, node in zip(tree.edges, tree.nodes[1:], strict=True):
        parts += _edge(edge), _node(node)
    return "".join(parts)


def _node(node: ast.NodePattern) -> str:
    parts = []
    if node.variable is not None or node.label is not None:
        label = f":{name(node.label)}" if node.label is not None else ""
        parts.append((variable(node.variable) if node.variable is not None else "") + label)
    if node.id is not None:
        parts.append(_reference(node.id))
    if node.properties:
        pairs = (f"{name(key)}: {expression(value, OR)}" for key, value in node.properties)
        parts.append("{" + ", ".join(pairs) + "}")
    if node.meaning is not None:
        parts.append("~ " + expression(node.meaning, OPERAND))
    return "(" + " ".join(parts) + ")"


def _edge(edge: ast.EdgePattern) -> str:
    plain, opening, closing = _ARROWS[edge.direction]
    inner = variable(edge.variable) if edge.variable is not None else ""
    if edge.labels:
        inner += ":" + "|".join(map(name, edge.labels))
    inner += _hops(edge.min_hops, edge.max_hops)
    if edge.meaning is not None:
        inner += (" " if inner else "") + "~ " + expression(edge.meaning, OPERAND)
    return f"{opening}{inner}{closing}" if inner else plain


def _hops(least: int, most: int | None) -> str:
    if least < 0 or (most is not None and most < least):
        raise UsageError(f"a path cannot have {least} to {most} hops")
    if least == most:
        return "" if least == 1 else f"*{least}"
    if most is None:
        return "*" if least == 1 else f"*{least}.."
    return f"*{least}..{most}"


def expression(tree: ast.Expression, place: int) -> str:
    """The text of an expression, in parentheses where its place binds more tightly than it does."""
    text, level = _levelled(tree)
    return text if level >= place else f"({text})"


def _levelled(tree: ast.Expression) -> tuple[str, int]:
    """The text of an expression and how tightly it binds."""
    match tree:
        case ast.Or():
            return _joined(" OR ", tree.items, AND), OR
        case ast.And():
            return _joined(" AND ", tree.items, NOT), AND
        case ast.Not():
            return "NOT " + expression(tree.item, NOT), NOT
        case ast.Comparison():
            return f"{expression(tree.left, SUM)} {tree.op} {expression(tree.right, SUM)}", COMPARISON
        case ast.In():
            return f"{expression(tree.item, SUM)} IN {expression(tree.collection, SUM)}", COMPARISON
        case ast.Contains():
            return f"{expression(tree.text, SUM)} CONTAINS {expression(tree.part, SUM)}", COMPARISON
        case ast.StartsWith():
            return f"{expression(tree.text, SUM)} STARTS WITH {expression(tree.prefix, SUM)}", COMPARISON
        case ast.IsNull():
            return f"{expression(tree.item, SUM)} IS {'NOT ' if tree.negated else ''}NULL", COMPARISON
        case ast.Similar():
            return f"{variable(tree.variable)} ~ {expression(tree.meaning, OPERAND)}", COMPARISON
        case ast.Arithmetic():
            return _arithmetic(tree)
        case ast.Negative():
            return _negative(tree.operand), SIGNED
        case ast.Number():
            text = _number(tree)
            return text, SIGNED if text.startswith("-") else OPERAND
        case ast.Boolean():
            return ("true" if tree.value else "false"), OPERAND
        case ast.Null():
            return "null", OPERAND
        case ast.Text():
            return _quoted(tree.value, '"', MAX_TEXT), OPERAND
        case ast.Parameter():
            if not _WORD.fullmatch(tree.name):
                raise UsageError(f"${tree.name} is no name of a parameter")
            return f"${tree.name}", OPERAND
        case ast.ObjectRef():
            return _reference(tree), OPERAND
        case ast.ListOf():
            return "[" + ", ".join(expression(item, OR) for item in tree.items) + "]", OPERAND
        case ast.Variable():
            return variable(tree.name), OPERAND
        case ast.Property():
            return f"{variable(tree.variable)}.{name(tree.name)}", OPERAND
        case ast.Call():
            return _call(tree), OPERAND
        case ast.PatternCondition():
            return _pattern(tree.pattern), OPERAND
    raise UsageError(f"{type(tree).__name__} is no expression")


def _joined(word: str, items: tuple[ast.Expression, ...], place: int) -> str:
    if len(items) < 2:
        raise UsageError(f"{word.strip()} stands between two conditions or more")
    return word.join(expression(item, place) for item in items)


def _arithmetic(tree: ast.Arithmetic) -> tuple[str, int]:
    level = SUM if tree.op in "+-" else PRODUCT
    right = expression(tree.right, level + 1)
    if tree.op == "-" and right.startswith("["):
        right = f"({right})"  # "- [" opens an edge
    return f"{expression(tree.left, level)} {tree.op} {right}", level


def _negative(operand: ast.Expression) -> str:
    text, level = _levelled(operand)
    if level < SIGNED or text.startswith("[") or (isinstance(operand, ast.Number) and level == OPERAND):
        return f"-({text})"  # "-[" opens an edge, and "-5" is a number
    return f"- {text}" if level == SIGNED else f"-{text}"


def _number(tree: ast.Number) -> str:
    if not math.isfinite(tree.value):
        raise UsageError(f"{tree.value} is no number that can be written")
    if isinstance(tree.value, int):
        if abs(tree.value) >= 2**63:
            raise UsageError(f"{tree.value} is too large to be written")
        digits = str(int(tree.value))
    else:
        digits = repr(float(tree.value))
    if tree.unit is None:
        return digits
    if tree.unit not in ast.UNITS:
        raise UsageError(f"{tree.unit!r} is no unit")
    return digits + ("in" if tree.unit == "in" else f" {tree.unit}")


def _reference(tree: ast.ObjectRef) -> str:
    return "#" + (_quoted(tree.id, '"', MAX_TEXT) if isinstance(tree.id, str) else _number(ast.Number(value=tree.id)))


def _call(tree: ast.Call) -> str:
    if tree.name != tree.name.lower() or (tree.star and (tree.arguments or tree.distinct)):
        raise UsageError(f"the call of {tree.name} cannot be written")
    if tree.distinct and not tree.arguments:
        raise UsageError("DISTINCT stands before an argument")
    inner = "*" if tree.star else ", ".join(expression(item, OR) for item in tree.arguments)
    return f"{variable(tree.name)}({'DISTINCT ' if tree.distinct else ''}{inner})"


def variable(text: str) -> str:
    """The name of a variable or function, in backticks where it is no word or a keyword."""
    if text.upper() in RESERVED:
        return _quoted(text, "`", MAX_NAME)
    return name(text)


def name(text: str) -> str:
    """The name of a label, relation, property or column, in backticks where it is no word. Keywords need none."""
    if _WORD.fullmatch(text):
        return text
    if not text:
        raise UsageError("a name has at least one letter")
    return _quoted(text, "`", MAX_NAME)


def _quoted(text: str, quote: str, most: int) -> str:
    if len(text) > most:
        raise UsageError(f"a text of {len(text):,} characters cannot be written; at most {most:,} can")
    escaped = text.replace("\\", "\\\\").replace(quote, "\\" + quote)
    return quote + _ESCAPED.sub(_escape, escaped) + quote


def _escape(match: re.Match[str]) -> str:
    character = match[0]
    if character == "\0" or "\ud800" <= character <= "\udfff":
        raise UsageError(f"the character U+{ord(character):04X} cannot be written")
    return _LETTERS.get(character, f"\\u{ord(character):04x}")
