"""``cgdb query`` and ``cgdb search``."""

from __future__ import annotations

import re
import sys
from argparse import Namespace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import cgdb
from cgdb.cli import render, values
from cgdb.errors import ParseError, UsageError
from cgdb.result import StoredNode

if TYPE_CHECKING:
    from cgdb.result import Result, Row


_PLAIN = re.compile(r"\s*(what|where|which|who|how|is|are|can|find|show|something|somewhere|a|an|the)\b", re.I)


def query(options: Namespace) -> int:
    """Answer one statement."""
    text = sys.stdin.read() if options.text == "-" else options.text
    if options.timeout is not None and not options.timeout > 0:
        raise UsageError(f"--timeout takes seconds above 0, not {options.timeout:g}")
    limits = cgdb.Limits(seconds=options.timeout)
    with values.opened(options.store, values.encoders(options.encoder)) as db:
        try:
            if options.rerank:
                from cgdb.model.rerank import named

                db.reranker = named(options.rerank)
            result = db.query(text, values.parameters(options.parameters), limits=limits)
        except ParseError as error:
            if _PLAIN.match(text):
                error.hint = f'a question in plain words goes to: cgdb ask {options.store} "..."'
            raise
        warn(result.warnings)
        show(result, options.format or "table", why=options.why, everything=options.all)
        if result.usage is not None:
            sys.stderr.write(f"re-ranked in {result.usage}\n")
    return 0


def search(options: Namespace) -> int:
    """The nearest objects to a text or vector."""
    what: Any = options.what
    if what.startswith("@"):
        what = cgdb.Vector(values=values.vector(Path(what[1:])), space=options.space)
    with values.opened(options.store, values.encoders(options.encoder)) as db:
        hits = db.search(
            what,
            space=options.space,
            k=options.k,
            scenes=options.scene,
            where=options.where,
            parameters=values.parameters(options.parameters),
        )
        warn(hits.warnings)
        form = options.format or "table"
        if form == "table":
            rows = [(str(node), node.scene, node.caption or "") for node in hits.nodes]
            scores = [(hit.score, None) for hit in hits]
            render.table(render.console(), ("object", "scene", "caption"), rows, scores=scores)
        else:
            render.records(hits.to_dicts(), ("id", "scene", "tag", "caption", "score"), form)
    return 0


def warn(lines: tuple[str, ...]) -> None:
    """Say on stderr what evidence was left out."""
    for line in lines:
        render.say(f"note: {line}")


def show(result: Result, form: str, *, why: bool = False, everything: bool = False) -> None:
    """A result on stdout."""
    if form != "table":
        columns = tuple(dict.fromkeys((*result.columns, "score", "fits", *(("why",) if why else ()))))
        render.records(result.to_dicts(why=why), columns, form)
        return
    out = render.console()
    if result.columns == ("plan",):
        for row in result.rows:
            out.print(str(row.values[0]), markup=False, soft_wrap=True)
        return
    shown = result.rows if everything else result.rows[: render.SHOWN]
    single = len(result.columns) == 1 and all(isinstance(row.values[0], StoredNode) for row in shown)
    columns = (*result.columns, "caption") if single else result.columns
    rows = [(*row.values, row.values[0].caption) if single else row.values for row in shown]  # type: ignore[union-attr]
    if (scenes := render.scene_column(shown)) is not None:
        columns, rows = (*columns, "scene"), [(*row, scene) for row, scene in zip(rows, scenes, strict=True)]
    render.table(out, columns, rows, scores=[(row.score, row.fits) for row in shown], footer=_footer(result, shown))
    if why:
        for row in shown:
            _why(row)


def _footer(result: Result, shown: tuple[Row, ...]) -> str:
    n = len(result.rows)
    if not n:
        return "no rows"
    text = f"{n:,} row{'s' if n != 1 else ''}"
    if len(shown) < n:
        text += f", the first {len(shown)} shown (--all shows the rest; LIMIT asks for fewer)"
    fitting = sum(row.fits for row in result.rows)
    return text + (
        ", nothing fits: these are the nearest" if not fitting else f", {fitting:,} fit{'s' if fitting == 1 else ''}"
    )


def _why(row: Row) -> None:
    out = render.console()
    out.print(render.clean(", ".join(map(str, row.values))), style="bold", markup=False)
    for reason in row.why:
        out.print("  " + render.clean(str(reason)), markup=False, soft_wrap=True)
