"""What a model really meant to answer: CGQL or JSON, out of thoughts, code fences and prose around it."""

from __future__ import annotations

import json
import re
from typing import Any

from cgdb.errors import ParseError
from cgdb.grammar import ast
from cgdb.grammar.parser import parse

_THOUGHT = re.compile(r"<(think|thinking|reasoning|reflection)>.*?</\1>", re.DOTALL | re.IGNORECASE)
_OPEN_THOUGHT = re.compile(r"<(think|thinking|reasoning|reflection)>", re.IGNORECASE)
_END_OF_THOUGHT = re.compile(r"</(think|thinking|reasoning|reflection)>", re.IGNORECASE)
_FENCE = re.compile(r"```[\w+-]*[ \t]*\n?(.*?)(?:```|\Z)", re.DOTALL)
_BEGINNING = re.compile(r"\b(?:MATCH|USE|AS\s+OF|EXPLAIN|PROFILE)\b", re.IGNORECASE)
_LAST_COMMA = re.compile(r",(\s*[}\]])")
MOST_BEGINNINGS = 40


def without_thoughts(text: str) -> str:
    """The answer alone. Some servers leave out the opening tag; of a thought that never ended nothing is an answer."""
    text = _THOUGHT.sub("", text)
    *_, text = _END_OF_THOUGHT.split(text)
    return _OPEN_THOUGHT.split(text)[0].strip()


def statement(reply: str) -> tuple[ast.Query, bool]:
    """The statement in a reply, and whether it stood there alone. ParseError, in its place, where there is none."""
    try:
        return parse(reply.strip()), True
    except ParseError:
        pass
    answer = without_thoughts(reply)
    first: ParseError | None = None
    for text in _candidates(answer):
        try:
            return _parsed(text), False
        except ParseError as error:
            first = first or error
    if first is not None:
        raise first
    raise ParseError("the answer holds no statement", hint="a statement begins with MATCH", source=answer[:200])


def _candidates(answer: str) -> list[str]:
    """What may be the statement, the likeliest first: of several, the last is what the model settled on."""
    found = [block.strip() for block in _FENCE.findall(answer) if _BEGINNING.search(block)]
    found.reverse()
    document = json_in(answer)
    if isinstance(document, dict):
        found += [value for value in document.values() if isinstance(value, str) and _BEGINNING.search(value)]
    starts = [match.start() for match in _BEGINNING.finditer(answer)][-MOST_BEGINNINGS:]
    return [*found, *(answer[start:] for start in reversed(starts))]


def _parsed(text: str) -> ast.Query:
    """The statement that a text begins with; whatever follows it is prose."""
    try:
        return parse(text)
    except ParseError as error:
        error.located(text)
        cuts = {text.find("\n\n"), text.find("\n"), error.span.start if error.span else -1}
        for cut in sorted((cut for cut in cuts if cut > 0), reverse=True):
            try:
                return parse(text[:cut].rstrip().rstrip("`*"))
            except ParseError:
                continue
        raise error from None


def json_in(reply: str) -> Any:
    """The JSON value in a reply: all of it, a fenced block, or what stands between braces. None where there is none."""
    answer = without_thoughts(reply)
    for text in (answer, *reversed(_FENCE.findall(answer))):
        found = _loaded(text.strip())
        if found is not None:
            return found
    decoder = json.JSONDecoder()
    best: Any = None
    longest = 0
    for match in list(re.finditer(r"[{\[]", answer))[:MOST_BEGINNINGS]:
        if match.start() < longest:
            continue  # inside what was read already
        try:
            value, end = decoder.raw_decode(answer, match.start())
        except (ValueError, RecursionError):
            continue
        if best is None or isinstance(value, dict) > isinstance(best, dict):
            best = value
        longest = max(longest, end)
    return best


def _loaded(text: str) -> Any:
    if text[:1] not in ("{", "["):
        return None
    # Small models end lists with a comma.
    for attempt in (text, _LAST_COMMA.sub(r"\1", text)):
        try:
            return json.loads(attempt)
        except (ValueError, RecursionError):
            continue
    return None
