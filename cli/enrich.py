"""``cgdb enrich``, ``caption`` and ``relate``: what models add to a map, once. An estimate first, then progress."""

from __future__ import annotations

import json
from argparse import Namespace
from collections.abc import Mapping
from dataclasses import asdict
from typing import TYPE_CHECKING, Any

import cgdb
from cgdb.cli import ask, render
from cgdb.cli.progress import progress_bar
from cgdb.errors import CgdbError

if TYPE_CHECKING:
    from cgdb.enrich.calls import Pace
    from cgdb.enrich.work import Work


def enrich(options: Namespace) -> int:
    """Everyday knowledge as properties."""
    with cgdb.open(options.store) as db:
        work = db.enrich(
            model=ask.model_of(options), scenes=options.scene or (), robot=options.robot, batch=options.batch
        )
        estimate = work.estimate()
        told = f"{estimate.objects:,} objects; {estimate.descriptions:,} descriptions to ask, {estimate.known:,} known"
        return _done(work, estimate, told, "descriptions", options, lambda: {"objects with properties": work.changed})


def caption(options: Namespace) -> int:
    """Captions and names from best views."""
    with cgdb.open(options.store) as db:
        work = db.caption(
            model=ask.model_of(options),
            scenes=options.scene or (),
            views=options.views,
            together=options.together,
            again=options.again,
            pace=_pace(options),
        )
        estimate = work.estimate()
        told = f"{estimate.objects:,} objects; {estimate.pending:,} to caption, {estimate.known:,} known"
        if estimate.objects and not (estimate.pending or estimate.known or estimate.bare or options.again):
            told += ": they have captions, or are background (--again: also what has a caption)"
        if estimate.bare:
            told += f", {estimate.bare:,} without pictures"
        return _done(
            work,
            estimate,
            told,
            "objects",
            options,
            lambda: {"objects with a new caption": work.changed, "of them invalid": work.invalid},
        )


def relate(options: Namespace) -> int:
    """Relations of things that touch or overlap."""
    with cgdb.open(options.store) as db:
        work = db.relate(
            model=ask.model_of(options),
            scenes=options.scene or (),
            every_pair=options.every_pair,
            reach=options.reach,
            batch=options.batch,
            pace=_pace(options),
        )
        estimate = work.estimate()
        told = (
            f"{estimate.objects:,} objects; {estimate.candidates:,} pairs touch or overlap, {estimate.pairs:,} of them "
            f"to know, {estimate.pending:,} to ask"
        )
        return _done(
            work,
            estimate,
            told,
            "pairs",
            options,
            lambda: {"relations by the model": work.related, "contradicting geometry": work.contradictions},
        )


def _pace(options: Namespace) -> Pace:
    from cgdb.enrich.calls import Pace

    return Pace(workers=options.workers, per_minute=options.per_minute)


def _done(work: Work[Any, Any], estimate: Any, told: str, what: str, options: Namespace, outcome: Any) -> int:
    """Say what it will take; unless it is a dry run, ask, write, and say what was done."""
    if not options.quiet or options.dry_run:
        told += f"; {estimate.calls:,} calls, about {estimate.prompt_tokens:,} + {estimate.completion_tokens:,} tokens"
        render.say(told + ("" if estimate.cost is None else f", about {estimate.cost:.2f} at the configured prices"))
    counts: Mapping[str, int] = outcome()
    if not options.dry_run:
        _run(work, what, options)
        counts = outcome()
        if not options.quiet:
            render.say(_summary(work, counts, what))
    if options.json:
        record = {
            **{f"estimated_{key}" if key in _GUESSED else key: value for key, value in asdict(estimate).items()},
            **{name.replace(" ", "_"): count for name, count in counts.items()},
            "unanswered": work.unanswered,
            "revisions": work.revisions,
            "usage": work.usage.to_dict(),
        }
        render.write(json.dumps(record, indent=2))
    return 0


_GUESSED = frozenset({"calls", "prompt_tokens", "completion_tokens", "cost"})


def _run(work: Work[Any, Any], what: str, options: Namespace) -> None:
    done = 0
    try:
        with progress_bar(options.quiet) as progress:
            task = progress.add_task("asking the model", total=None)
            for done, total in work.run():
                progress.update(task, completed=done, total=total)
    except (CgdbError, KeyboardInterrupt):
        if done:
            render.say(f"note: what was said of {done:,} {what} is kept; the same command goes on from there")
        raise


def _summary(work: Work[Any, Any], counts: Mapping[str, int], what: str) -> str:
    usage = work.usage
    revisions = ", ".join(f"{render.clean(name)} revision {number}" for name, number in work.revisions.items())
    said = ", ".join(f"{count:,} {name}" for name, count in counts.items())
    return (
        f"{said} ({revisions or 'nothing new'}); {usage.calls:,} calls, "
        f"{usage.prompt_tokens:,} + {usage.completion_tokens:,} tokens, {usage.seconds:.1f} s"
        + (f"; {work.unanswered:,} {what} were not answered" if work.unanswered else "")
    )
