"""One question about several things, which are numbered in it; what its answer leaves out is asked for alone, once."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from typing import Any, TypeVar

from cgdb.enrich.calls import Turn
from cgdb.model.llm import Meter, Model

Item = TypeVar("Item")
Known = TypeVar("Known")


def answers(
    model: Model,
    items: Sequence[Item],
    ask: Callable[[Sequence[Item], Meter], Mapping[str, Any]],
    listed: str,
    checked: Callable[[Mapping[str, Any]], Known | None],
    meter: Meter,
    turn: Turn,
) -> dict[int, Known]:
    """What the model says of items, by position. listed: the field of the reply that holds an object for each item,
    with its number from 1 on. checked: what of such an object is as it was asked for."""
    said = _read(ask(items, meter), len(items), listed, checked)
    for i, item in enumerate(items if len(items) > 1 else ()):
        if i not in said:
            turn()
            with own_meter(model, meter) as own:
                alone = _read(ask([item], own), 1, listed, checked)
            if alone:
                said[i] = alone[0]
    return said


@contextmanager
def own_meter(model: Model, meter: Meter) -> Iterator[Meter]:
    """A meter for one of several questions: the deadline is that of one, without the wait for its turn."""
    own = model.meter()
    try:
        yield own
    finally:
        meter.add(own.usage)


def _read(
    reply: Mapping[str, Any], n: int, listed: str, checked: Callable[[Mapping[str, Any]], Known | None]
) -> dict[int, Known]:
    found = reply.get(listed, [reply] if n == 1 else [])
    said: dict[int, Known] = {}
    for item in found if isinstance(found, list) else ():
        number = item.get("number", 1 if n == 1 else None) if isinstance(item, dict) else None
        if isinstance(number, int) and not isinstance(number, bool) and 1 <= number <= n:
            known = checked(item)
            if known is not None:
                said[number - 1] = known
    return said
