"""The kinds of what a statement names and computes ("node", "number", "any" ...), and what may stand where."""

from __future__ import annotations

from collections.abc import Mapping

from cgdb.errors import BindError, did_you_mean, one_of
from cgdb.grammar import ast
from cgdb.query.functions import AGGREGATES, FUNCTIONS, Signature

OF_LITERALS: Mapping[type[ast.Syntax], str] = {
    ast.Null: "any",
    ast.Boolean: "boolean",
    ast.Number: "number",
    ast.Text: "text",
    ast.ListOf: "list",
}
"""The kind of a value that a parameter gives."""


def expect(kind: str, wanted: str, item: ast.Expression, rule: str) -> None:
    """BindError where an expression is of another kind than the rule asks for."""
    accepted = {
        "any": True,
        "row": True,
        "text": kind in ("text", "id"),
        "number": kind in ("number", "id"),
    }.get(wanted, kind == wanted)
    if not accepted and kind not in ("any", "mixed"):
        raise BindError(f"{rule}, and this is a {kind}", span=item.span)


def expect_comparable(one: str, other: str, item: ast.Expression) -> None:
    """BindError where two kinds cannot be compared, as item does."""
    if {one, other} & {"edge", "path"}:
        raise BindError(
            "relations are not compared as a whole: two edges never stand for the same one",
            hint="compare what they say: r.label, r.source, r.target",
            span=item.span,
        )
    loose = {"any", "mixed"}
    same = one == other or loose & {one, other} or {one, other} <= {"id", "number"} or {one, other} <= {"id", "text"}
    if not same:
        raise BindError(f"a {one} cannot be compared with a {other}", span=item.span)


def expect_value(kind: str, item: ast.Expression) -> None:
    """BindError where a list would hold what is no value."""
    if kind in ("node", "edge", "path"):
        raise BindError(
            f"a list holds values, and this is a {kind}",
            hint="its id is a value; collect() in RETURN makes lists of nodes and relations",
            span=item.span,
        )


def signature_of(item: ast.Call, *, aggregates: bool) -> Signature:
    """What a call takes and gives; BindError where there is no such function, or not here, or not with so many."""
    if item.name in AGGREGATES:
        if not aggregates:
            raise BindError(f"{item.name}() belongs into RETURN", span=item.span)
        signature = AGGREGATES[item.name]
        if item.star:
            if item.name != "count":
                raise BindError(f"only count takes *, {item.name} does not", span=item.span)
            return signature
    elif item.name in FUNCTIONS:
        signature = FUNCTIONS[item.name]
        if item.star or item.distinct:
            raise BindError(f"{item.name}() takes neither * nor DISTINCT", span=item.span)
    else:
        known = [*FUNCTIONS, *AGGREGATES]
        raise BindError(
            f"no function '{item.name}'",
            hint=did_you_mean(item.name, known) or f"there is {one_of(known, most=30)}",
            span=item.span,
        )
    _expect_arity(item, signature)
    return signature


def expect_argument(kind: str, wanted: str, argument: ast.Expression, function: str) -> None:
    """BindError where an argument is of another kind than the function takes there."""
    if function == "size" and kind in ("text", "path"):
        return  # they have a length too
    expect(kind, wanted, argument, f"{function}() asks for a {wanted}")
    of = {"node": ("node",), "row": ("node", "edge", "path")}.get(wanted, ())
    if function in FUNCTIONS and of and kind not in of:
        raise BindError(f"{function}() asks for a {of[0]}, and this is a value", span=argument.span)
    if wanted == "any" and kind in ("node", "edge", "path"):
        raise BindError(f"{function}() asks for a value, and this is a {kind}", span=argument.span)


def _expect_arity(item: ast.Call, signature: Signature) -> None:
    most = len(signature.takes)
    least = most - signature.optional
    given = len(item.arguments)
    if given < least or (given > most and not signature.variadic):
        wanted = str(least) if least == most else f"{least} or {most}"
        raise BindError(f"{item.name}() takes {wanted} arguments, not {given}", span=item.span)
