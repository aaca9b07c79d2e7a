"""``cgdb enrich``: knowledge of a language model as properties of objects."""

from __future__ import annotations

import json
import sys
from argparse import Namespace
from typing import TYPE_CHECKING

import cgdb
from cgdb.cli import ask, render
from cgdb.errors import CgdbError

if TYPE_CHECKING:
    from cgdb.model.enrich import Enrichment, Estimate
    from cgdb.model.llm import Model


def enrich(options: Namespace) -> int:
    """Say what it will take; unless it is a dry run, ask and write."""
    with cgdb.open(options.store) as db:
        work = db.enrich(model=_model(options), scenes=options.scene or (), robot=options.robot, batch=options.batch)
        estimate = work.estimate()
        if not options.quiet or options.dry_run:
            _say(_told(estimate))
        if not options.dry_run:
            _run(work, options)
        if options.json:
            render.write(json.dumps(_record(work, estimate), indent=2))
    return 0


def _model(options: Namespace) -> Model | None:
    from cgdb.model.rerank import configured

    found = ask.chosen(options)
    if isinstance(found, bool):
        return configured() if found else None
    return found


def _run(work: Enrichment, options: Namespace) -> None:
    from cgdb.cli.importing import _progress

    done = 0
    try:
        with _progress(options.quiet) as progress:
            task = progress.add_task("asking the model", total=None)
            for done, total in work.run():
                progress.update(task, completed=done, total=total)
    except (CgdbError, KeyboardInterrupt):
        if done:
            _say(f"note: {done:,} descriptions are kept; the same command goes on from there")
        raise
    if not options.quiet:
        usage = work.usage
        revisions = ", ".join(f"{render.clean(name)} revision {number}" for name, number in work.revisions.items())
        _say(
            f"{work.changed:,} objects have new properties ({revisions or 'nothing new'}); {usage.calls:,} calls, "
            f"{usage.prompt_tokens:,} + {usage.completion_tokens:,} tokens, {usage.seconds:.1f} s"
            + (f"; {work.unanswered:,} descriptions were not answered" if work.unanswered else "")
        )


def _told(estimate: Estimate) -> str:
    text = (
        f"{estimate.objects:,} objects; {estimate.descriptions:,} descriptions to ask, {estimate.known:,} known; "
        f"{estimate.calls:,} calls, about {estimate.prompt_tokens:,} + {estimate.completion_tokens:,} tokens"
    )
    if estimate.cost is not None:
        text += f", about {estimate.cost:.2f} at the configured prices"
    return text


def _record(work: Enrichment, estimate: Estimate) -> dict[str, object]:
    return {
        "objects": estimate.objects,
        "descriptions": estimate.descriptions,
        "known": estimate.known,
        "estimated_calls": estimate.calls,
        "estimated_prompt_tokens": estimate.prompt_tokens,
        "estimated_completion_tokens": estimate.completion_tokens,
        "estimated_cost": estimate.cost,
        "changed": work.changed,
        "unanswered": work.unanswered,
        "revisions": work.revisions,
        "usage": work.usage.to_dict(),
    }


def _say(text: str) -> None:
    sys.stderr.write(text + "\n")
