"""``cgdb ask``: a question in plain words."""

from __future__ import annotations

import json
import sys
from argparse import Namespace
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from cgdb.asking.answer import first_node
from cgdb.cli import asking, render, values
from cgdb.errors import UsageError

if TYPE_CHECKING:
    from cgdb.asking.answer import Answer
    from cgdb.model.llm import Model
    from cgdb.result import Row


NEAR = 3
"""Things that do not fit and are shown beside those that do."""


def ask(options: Namespace) -> int:
    """Answer one question."""
    question = sys.stdin.read() if options.question == "-" else options.question
    if not question and options.image is None:
        raise UsageError("there is no question", hint='cgdb ask STORE "Something to sit on"')
    model = chosen(options)
    with values.opened(options.store, values.encoders(options.encoder)) as db:
        answer = db.ask(
            question or "", model=model, image=options.image, rerank=_reranker(options), scenes=options.scene or ()
        )
        form = options.format or "table"
        if form == "json":
            render.write(json.dumps(answer.to_dict(why=options.why), ensure_ascii=False, indent=2))
            return 0
        asking.warn(answer.warnings)
        if form == "table":
            show(answer, why=options.why, everything=options.all)
        else:
            asking.show(answer.result, form, why=options.why)
    return 0


def chosen(options: Namespace) -> Model | bool:
    """The model that the options of a command name: none, a replay, a recorded one, or the configured one."""
    if options.record and options.replay:
        raise UsageError("--record and --replay exclude each other")
    if options.no_model:
        if options.record or options.replay:
            raise UsageError("--no-model leaves nothing to record or replay")
        return False
    if options.replay:
        from cgdb.model.recording import replaying

        return replaying(Path(options.replay))
    if options.record:
        from cgdb.model.llm_settings import settings
        from cgdb.model.recording import recording

        found = settings()
        if found is None:
            raise UsageError(
                "there is no language model to record",
                hint="set CGDB_LLM_BASE_URL, CGDB_LLM_MODEL and CGDB_LLM_API_KEY",
            )
        return recording(found, Path(options.record))
    return True


def _reranker(options: Namespace) -> bool | str:
    if options.no_rerank and options.rerank:
        raise UsageError("--rerank and --no-rerank exclude each other")
    return options.rerank or not options.no_rerank


def model_of(options: Namespace) -> Model | None:
    """The model that the options of a command name, or the configured one."""
    from cgdb.model.rerank import configured

    given = chosen(options)
    if isinstance(given, bool):
        return configured() if given else None
    return given


def needed_model(options: Namespace) -> Model:
    """The same. UsageError where there is none."""
    found = model_of(options)
    if found is None:
        raise UsageError(
            "some of these ways ask a language model, and none is configured",
            hint="set CGDB_LLM_BASE_URL, CGDB_LLM_MODEL and CGDB_LLM_API_KEY, or leave them out of --ways",
        )
    return found


def show(answer: Answer, *, why: bool = False, everything: bool = False) -> None:
    """An answer for a person: the answer in words, the rows, how the question was read, the statement, its cost."""
    from rich.text import Text

    out = render.console()
    mark, style = ("✓", "bold green") if answer.achievable else ("✗", "bold yellow")
    out.print(Text(f"{mark} {render.clean(answer.explanation)}", style=style), soft_wrap=True)
    for head, lines in (("left out", answer.ignored), ("assumed", answer.assumed)):
        for line in lines:
            out.print(Text(f"  {head}: {render.clean(line)}", style="yellow"), soft_wrap=True)
    some = shown(answer.rows, everything=everything)
    if why or everything or not _is_said(answer):
        asking.show(replace(answer.result, rows=some), "table", why=why, everything=everything)
        fitting, told = (sum(row.fits for row in rows) for rows in (answer.rows, some))
        if 0 < told < len(some):
            out.print(Text("  without ✓: does not fit, and only comes near", style="dim"), soft_wrap=True)
        if told < fitting:
            out.print(Text(f"  {fitting - told:,} more fit (--all shows them)", style="dim"), soft_wrap=True)
    if answer.understood:
        out.print(Text(f"  understood: {render.clean('; '.join(answer.understood))}", style="dim"), soft_wrap=True)
    out.print(Text(f"  {render.clean(answer.query)}"), soft_wrap=True)
    out.print(Text(f"  {render.clean(cost(answer))}", style="dim"), soft_wrap=True)


def _is_said(answer: Answer) -> bool:
    """Whether the words say all that a table would: totals, which hold no row per thing."""
    return bool(answer.facts) and all(first_node(row) is None for row in answer.rows)


def shown(rows: tuple[Row, ...], *, everything: bool = False) -> tuple[Row, ...]:
    """The rows of a table: those that fit, and the few that come nearest; where nothing fits, only these."""
    if everything:
        return rows
    fitting = tuple(row for row in rows if row.fits)
    others = tuple(row for row in rows if not row.fits)
    return (*fitting[: render.SHOWN - NEAR], *others[:NEAR])


def cost(answer: Answer) -> str:
    """One line: who translated, and what it took."""
    usage = answer.usage
    who = "the built-in translator" if answer.how == "built-in" else f"{answer.model}, held to CGQL by {answer.how}"
    if answer.how == "text":
        who = f"{answer.model}, in free text"
    if answer.reranked:
        who += ", re-ranked" + (f" by {answer.reranker}" if answer.reranker != answer.model else "")
    return f"by {who}: {usage}" if usage.calls or usage.seconds else f"by {who}"
