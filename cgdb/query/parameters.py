"""Values that come from outside the text of a statement: its parameters, and what they may be."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import numpy as np

from cgdb.errors import BindError, Span, did_you_mean, one_of
from cgdb.grammar import ast
from cgdb.meaning.meanings import LikeMeaning, Meaning, TextMeaning, Vector, VectorMeaning


class Parameters:
    """The values given with a statement. They become values of its tree, never a part of its text."""

    def __init__(self, values: Mapping[str, Any]) -> None:
        self._values = values

    def value(self, item: ast.Parameter) -> Any:
        """The value that was given; BindError where none was."""
        if item.name not in self._values:
            raise BindError(
                f"parameter ${item.name} was not given",
                hint=did_you_mean(item.name, self._values)
                or (f"given: {one_of(self._values)}" if self._values else "no parameters were given"),
                span=item.span,
            )
        value = self._values[item.name]
        check_value(item.name, value, item.span)
        return value

    def literal(self, value: Any, item: ast.Parameter) -> ast.Expression:
        """The value as it would have been written in the statement."""
        if value is None:
            return ast.Null(span=item.span)
        if isinstance(value, (bool, np.bool_)):
            return ast.Boolean(value=bool(value), span=item.span)
        if isinstance(value, (int, np.integer)):
            return ast.Number(value=int(value), span=item.span)
        if isinstance(value, (float, np.floating)):
            if not math.isfinite(value):
                raise BindError(f"parameter ${item.name} is {value}", span=item.span)
            return ast.Number(value=float(value), span=item.span)
        if isinstance(value, str):
            return ast.Text(value=value, span=item.span)
        if isinstance(value, (list, tuple, set, frozenset, np.ndarray)):
            items = value.tolist() if isinstance(value, np.ndarray) else list(value)
            if not any(isinstance(x, (list, tuple, set, dict)) for x in items):
                for x in items:
                    check_value(item.name, x, item.span)
                return ast.ListOf(items=tuple(self.literal(x, item) for x in items), span=item.span)
        raise BindError(
            f"parameter ${item.name} is {type(value).__name__}; it can be text, a number, true or false, null, "
            "a list of these, or (after '~') a vector",
            span=item.span,
        )

    def meaning(self, item: ast.Meaning) -> Meaning:
        """What stands to the right of ``~``: a text, a vector, or an object to be like."""
        if isinstance(item, ast.ObjectRef):
            return LikeMeaning(id=item.id)
        if isinstance(item, ast.Text):
            return _text_meaning(item.value, item.span)
        value = self.value(item)
        if isinstance(value, str):
            return _text_meaning(value, item.span)
        if isinstance(value, Vector):
            return VectorMeaning(parameter=item.name, vector=value)
        try:
            with np.errstate(over="ignore"):
                values = np.asarray(value, dtype=np.float32)
        except (TypeError, ValueError, OverflowError):
            values = np.empty(0, np.float32)
        if values.ndim != 1 or not values.size or isinstance(value, (bool, int, float)):
            raise BindError(
                f"parameter ${item.name} is {type(value).__name__}; '~' compares with a text or a vector",
                span=item.span,
            )
        if not np.isfinite(values).all():
            raise BindError(f"parameter ${item.name} is a vector with NaN or infinite values", span=item.span)
        return VectorMeaning(parameter=item.name, vector=Vector(values=values))


def _text_meaning(text: str, span: Span) -> TextMeaning:
    if not text.strip():
        raise BindError("'~' needs a text that says something; this one is empty", span=span)
    if not any(letter.isalnum() for letter in text):
        raise BindError(f"'~' needs a text with words in it; {text[:20]!r} has none", span=span)
    return TextMeaning(text=text)


def check_value(name: str, value: Any, span: Span) -> None:
    """Refuse what no store can hold: half a character, a whole number beyond 63 bits."""
    if isinstance(value, str):
        try:
            value.encode("utf-8")
        except UnicodeEncodeError as error:
            raise BindError(
                f"parameter ${name} holds half a character (U+{ord(value[error.start]):04X})",
                hint="read the text as UTF-8",
                span=span,
            ) from None
    elif isinstance(value, int) and not -(2**63) < value < 2**63:
        raise BindError(f"parameter ${name} is a whole number of more than 63 bits", span=span)
