"""A question in plain words -> CGQL by a language model: constrained as the server can, checked and repaired by us."""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import replace
from functools import cache
from typing import Any, TypeVar

from cgdb.errors import BindError, CgdbError, ExecuteError, ParseError
from cgdb.grammar import ast
from cgdb.grammar.parser import grammar
from cgdb.model.abilities import GRAMMARS, kind_of
from cgdb.model.llm import REFUSED, Meter, Model, ModelError, Reply
from cgdb.model.query_from_json import from_json
from cgdb.model.query_schema import schema
from cgdb.model.replies import json_in, statement
from cgdb.model.translation_prompt import Surroundings, repair, translation

MOST_REPAIRS = 2
LONGEST = 700
"""Tokens of an answer; a statement has 30 to 100, as JSON three times that, and some models think aloud first."""

Done = TypeVar("Done")


def translated(
    model: Model, question: str, around: Surroundings, meter: Meter, carry_out: Callable[[ast.Query], Done]
) -> tuple[Done, str]:
    """What carrying out the model's statement gives, and how the model was held to CGQL: grammar, schema or text.

    An error of the statement goes back to the model at most twice; then, or where the model fails, it is raised.
    """
    dialogue: list[Any] = []
    for attempt in range(MOST_REPAIRS + 1):
        way, reply = _asked(model, question, around, meter, dialogue)
        try:
            tree, how = _read(model, way, reply)
            # A model has no business with plans, and ranking is done where it is asked for.
            return carry_out(replace(tree, mode=ast.Mode.RUN, rerank=None)), how
        except (ParseError, BindError, ExecuteError) as error:
            if attempt == MOST_REPAIRS or type(error) not in (ParseError, BindError, ExecuteError):
                raise
            dialogue = repair(reply.said, error.render())
    raise AssertionError("the last attempt returns or raises")


def _asked(model: Model, question: str, around: Surroundings, meter: Meter, dialogue: list[Any]) -> tuple[str, Reply]:
    model.prepare(meter)
    refused: list[str] = []
    for way in list(model.abilities.cgql):
        messages = [*translation(question, around, as_json=way == "schema"), *dialogue]
        try:
            reply = model.chat(messages, meter, max_tokens=LONGEST, more=_fields(way))
        except ModelError as error:
            if way != "text" and error.status in REFUSED:
                refused.append(way)
                continue
            raise
        # Only now is it sure that the way was refused, and not the request as such.
        for other in refused:
            model.abilities.cannot("cgql", other)
        return way, reply
    raise AssertionError("plain text is always tried")


def _read(model: Model, way: str, reply: Reply) -> tuple[ast.Query, str]:
    """The statement and how the model was held to it. A way that was taken no notice of is not tried again."""
    cut_off = reply.finish == "length"
    if way == "schema":
        document = json_in(reply.said)
        if isinstance(document, dict) and "match" in document:
            return from_json(document), "schema"
        if not cut_off:
            model.abilities.cannot("cgql", way)
        return statement(reply.said)[0], "text"
    try:
        tree, alone = statement(reply.said)
    except CgdbError:
        if way in GRAMMARS and not cut_off:
            model.abilities.cannot("cgql", way)
        raise
    held = alone if way != "tool" else reply.tool is not None and alone
    if way in GRAMMARS and not held:
        model.abilities.cannot("cgql", way)
    return tree, kind_of(way) if held else "text"


def _fields(way: str) -> dict[str, Any]:
    match way:
        case "tool":
            form = {"type": "grammar", "grammar": {"syntax": "lark", "definition": short_grammar()}}
            tool = {"name": "answer_in_cgql", "description": "Answers with one CGQL statement.", "format": form}
            choice = {"type": "custom", "custom": {"name": tool["name"]}}
            return {"tools": [{"type": "custom", "custom": tool}], "tool_choice": choice}
        case "structured_outputs":
            return {"structured_outputs": {"grammar": short_grammar()}}
        case "guided_grammar":
            return {"guided_grammar": short_grammar()}
        case "ebnf":
            return {"ebnf": short_grammar()}
        case "llguidance":
            return {"grammar": "%llguidance {}\n" + short_grammar()}
        case "schema":
            strict = {"name": "cgql", "strict": True, "schema": schema()}
            return {"response_format": {"type": "json_schema", "json_schema": strict}}
    return {}


_UNUSED = ("script", "statements", "condition")


@cache
def short_grammar() -> str:
    """The grammar without what only the parser and people need: comments, names of nodes, other starts."""
    rules: list[str] = []
    keep = True
    for line in grammar().splitlines():
        if not line.strip() or line.startswith("//"):
            continue
        if not line[0].isspace():
            keep = line.partition(":")[0] not in _UNUSED
        if keep:
            rules.append(re.sub(r"\s+-> \w+$", "", line).replace("     |", " |"))
    return "\n".join(rules) + "\n"
