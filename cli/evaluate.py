"""``cgdb eval retrieval``: how well each way of asking does on judged queries."""

from __future__ import annotations

import json
from argparse import Namespace
from collections.abc import Sequence
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, Any

import cgdb
from cgdb.cli import ask, render, values
from cgdb.cli.render import say
from cgdb.errors import UsageError, did_you_mean, one_of
from cgdb.evaluation.judged import JudgedQuery, chosen, judgements

if TYPE_CHECKING:
    from cgdb.evaluation.answers_kept import Kept
    from cgdb.evaluation.retrieval import Helpers, Outcome
    from cgdb.evaluation.scores import Scores, Share
    from cgdb.model.rerank import Reranker

Results = dict[str, list[tuple[JudgedQuery, "Outcome"]]]
"""{way: (query, what it answered)}."""


def retrieval(options: Namespace) -> int:
    """Ask every query in every way, save the answers, and print the scores."""
    from cgdb.evaluation.answers_kept import kept
    from cgdb.evaluation.retrieval import WAYS, Helpers
    from cgdb.evaluation.scores import scores

    ways = values.listed(options.ways)
    for way in ways:
        if way not in WAYS:
            raise UsageError(f"there is no way '{way[:40]}'", hint=did_you_mean(way, WAYS) or f"one of {one_of(WAYS)}")
    if not ways:
        raise UsageError("--ways names none", hint=f"some of {one_of(WAYS)}")
    file = Path(options.judgements)
    maps = chosen(judgements(file), file, [Path(path) for path in options.maps])
    needs_model = any(WAYS[way].needs_model for way in ways)
    helpers = Helpers(
        model=ask.needed_model(options) if needs_model else None,
        cross=_cross(options.rerank) if any(WAYS[way].needs_cross for way in ways) else None,
    )
    found: dict[str, Results] = {}
    with kept(Path(options.save), resume=options.resume) as saved:
        for number, (name, path, queries) in enumerate(maps, start=1):
            say(f"{number}/{len(maps)} {name}: {len(queries)} queries", options.quiet)
            found[name] = _one_map(path, name, queries, ways, helpers, saved, options)
    every: Results = {way: [pair for results in found.values() for pair in results[way]] for way in ways}
    _tell_failures(every)
    parts = {"all maps" if len(maps) > 1 else maps[0][0]: every}
    if options.per_map and len(maps) > 1:
        parts = {**found, **parts}
    if options.json:
        lines = [
            {"map": name, **line.to_dict()}
            for name, results in parts.items()
            for way in ways
            for line in scores(way, results[way])
        ]
        render.write(json.dumps(lines, indent=2))
        return 0
    for name, results in parts.items():
        if len(parts) > 1:
            render.console().print(f"\n{render.clean(name)}", markup=False, style="bold")
        _print([line for way in ways for line in scores(way, results[way])])
    say(f"every answer is in {options.save}", options.quiet)
    return 0


def _tell_failures(results: Results) -> None:
    """Say why, once for each way: a row of noughts in the table does not."""
    for way, pairs in results.items():
        errors = [outcome.error for _, outcome in pairs if outcome.error is not None]
        if errors:
            say(f"note: {way}: {len(errors)} of {len(pairs)} queries failed; the first: {errors[0]}")


def _one_map(
    path: Path,
    name: str,
    queries: Sequence[JudgedQuery],
    ways: Sequence[str],
    helpers: Helpers,
    saved: Kept,
    options: Namespace,
) -> Results:
    """What each way answers to the queries of a map, which is opened only where something was not answered before."""
    from cgdb import ingest
    from cgdb.evaluation.retrieval import WAYS, asked
    from cgdb.meaning.embed import TEXT_MODEL

    before = {(way, query.id): saved.find(name, way, query) for way in ways for query in queries}
    results: Results = {way: [] for way in ways}
    for encoders in (True, False):
        some = [way for way in ways if WAYS[way].encoders == encoders]
        results |= {way: [(q, o) for q in queries if (o := before[way, q.id]) is not None] for way in some}
        if all(len(results[way]) == len(queries) for way in some):
            continue
        with (
            TemporaryDirectory(prefix="cgdb-eval-") as folder,
            cgdb.open(
                Path(folder) / "map.cgdb",
                create=True,
                text_encoder=TEXT_MODEL if encoders else None,
                space_encoders=values.encoders(options.encoder),
            ) as db,
        ):
            db.add(ingest.load(path))
            for way in some:
                for query in (query for query in queries if before[way, query.id] is None):
                    outcome = asked(way, db, query.query, helpers)
                    results[way].append((query, outcome))
                    saved.add(name, way, query, outcome)
    return results


def _cross(name: str | None) -> Reranker:
    from cgdb.model.rerank import CROSS, named

    if name is None or not name.startswith(CROSS):
        raise UsageError(
            "some of these ways need a cross-encoder",
            hint="--rerank cross:FOLDER_OR_NAME, such as cross:cross-encoder/ms-marco-MiniLM-L6-v2",
        )
    return named(name)


def _print(table: Sequence[Scores]) -> None:
    """Two tables, each of less than 80 characters: how good the order is, and what it took."""
    rows: list[tuple[Any, ...]] = []
    before = None
    for line in table:
        interval = f"{line.recall[1].low:.2f}-{line.recall[1].high:.2f}" if line.mrr.n else "-"
        numbers = (_shown(line.recall[1]), interval, *(_shown(line.recall[k]) for k in (2, 3)), _shown(line.mrr))
        rows.append((line.way if line.way != before else "", line.kind, str(line.mrr.n), *numbers))
        before = line.way
    out = render.console()
    render.table(out, ("way", "kind", "n", "R@1", "95 %", "R@2", "R@3", "MRR"), rows)
    costs: list[tuple[Any, ...]] = []
    for line in (line for way in dict.fromkeys(line.way for line in table) for line in _whole(table, way)):
        nothing = ("-" if part is None else f"{part:.2f}" for part in line.nothing)
        took = (f"{line.tokens:,.0f}", f"{line.calls:.1f}", f"{line.seconds:.2f}", str(line.errors or "-"))
        costs.append((line.way, f"{line.n_nothing} of {line.queries}", *nothing, *took))
    out.print()
    render.table(out, ("way", "no answer", "no P", "no R", "tokens", "calls", "s", "errors"), costs)


def _whole(table: Sequence[Scores], way: str) -> Sequence[Scores]:
    """The line of a way over every kind of queries."""
    return [line for line in table if line.way == way][-1:]


def _shown(share: Share) -> str:
    return f"{share.mean:.2f}" if share.n else "-"
