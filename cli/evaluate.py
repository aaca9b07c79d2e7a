"""``cgdb eval retrieval``: how well each way of asking does on judged queries."""

from __future__ import annotations

import json
import sys
from argparse import Namespace
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, Any, TextIO

import cgdb
from cgdb.cli import ask, render, values
from cgdb.errors import UsageError, did_you_mean, one_of
from cgdb.judged import JudgedQuery, chosen, judgements

if TYPE_CHECKING:
    from cgdb.model.llm import Model
    from cgdb.retrieval import Outcome, Scores, Share


def retrieval(options: Namespace) -> int:
    """Ask every query in every way, save the answers, and print the scores."""
    from cgdb.retrieval import WAYS, scores

    ways = [way.strip() for way in options.ways.split(",") if way.strip()]
    for way in ways:
        if way not in WAYS:
            raise UsageError(f"there is no way '{way[:40]}'", hint=did_you_mean(way, WAYS) or f"one of {one_of(WAYS)}")
    if not ways:
        raise UsageError("--ways names none", hint=f"some of {one_of(WAYS)}")
    file = Path(options.judgements)
    maps = chosen(judgements(file), file, [Path(path) for path in options.maps])
    model = _model(options, any(WAYS[way].needs_model for way in ways))
    results: dict[str, list[tuple[JudgedQuery, Outcome]]] = {way: [] for way in ways}
    with _saving(options.save) as save:
        for number, (name, path, queries) in enumerate(maps, start=1):
            _say(f"{number}/{len(maps)} {name}: {len(queries)} queries", options)
            for encoders in (True, False):
                some = [way for way in ways if WAYS[way].encoders == encoders]
                if some:
                    _one_map(path, name, queries, some, model, encoders, results, save, options)
    table = [line for way in ways for line in scores(way, results[way])]
    if options.format == "json":
        render.write(json.dumps([line.to_dict() for line in table], indent=2))
    else:
        _print(table)
        _say(f"every answer is in {options.save}", options)
    return 0


def _one_map(
    path: Path,
    name: str,
    queries: Sequence[JudgedQuery],
    ways: Sequence[str],
    model: Model | None,
    encoders: bool,
    results: dict[str, list[tuple[JudgedQuery, Outcome]]],
    save: TextIO,
    options: Namespace,
) -> None:
    from cgdb import ingest
    from cgdb.meaning.embed import TEXT_MODEL
    from cgdb.retrieval import asked

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
        for way in ways:
            for query in queries:
                outcome = asked(way, db, query.query, model)
                results[way].append((query, outcome))
                line = {
                    "map": name,
                    "query": query.id,
                    "kind": query.kind,
                    "text": query.query,
                    "way": way,
                    "ids": list(outcome.ids),
                    "grades": [query.relevant.get(i, 0) for i in outcome.ids],
                    "relevant": dict(query.relevant),
                    "achievable": outcome.achievable,
                    "seconds": round(outcome.seconds, 4),
                    "usage": outcome.usage.to_dict(),
                    "error": outcome.error,
                    **({"answer": dict(outcome.record)} if outcome.record else {}),
                }
                save.write(json.dumps(line, ensure_ascii=False) + "\n")
                save.flush()


def _model(options: Namespace, needed: bool) -> Model | None:
    from cgdb.model.rerank import configured

    if not needed:
        return None
    given = ask.chosen(options)
    found = configured() if given is True else None if given is False else given
    if found is None:
        raise UsageError(
            "some of these ways ask a language model, and none is configured",
            hint="set CGDB_LLM_BASE_URL, CGDB_LLM_MODEL and CGDB_LLM_API_KEY, or leave them out of --ways",
        )
    return found


@contextmanager
def _saving(path: str) -> Iterator[TextIO]:
    try:
        with Path(path).open("w", encoding="utf-8") as file:
            yield file
    except IsADirectoryError:
        raise UsageError(f"{path} is a folder", hint="--save takes a file") from None
    except FileNotFoundError:
        raise UsageError(f"there is no folder {Path(path).parent}") from None


def _print(table: Sequence[Scores]) -> None:
    columns = ("way", "kind", "n", "R@1", "95 %", "R@2", "R@3", "MRR", "no P", "no R", "tokens", "calls", "s", "err")
    rows: list[tuple[Any, ...]] = []
    before = None
    for line in table:
        rows.append(
            (
                line.way if line.way != before else "",
                line.kind,
                str(line.mrr.n),
                _shown(line.recall[1]),
                f"{line.recall[1].low:.2f}-{line.recall[1].high:.2f}" if line.mrr.n else "-",
                _shown(line.recall[2]),
                _shown(line.recall[3]),
                _shown(line.mrr),
                *("-" if part is None else f"{part:.2f}" for part in line.nothing),
                f"{line.tokens:,.0f}",
                f"{line.calls:.1f}",
                f"{line.seconds:.2f}",
                str(line.errors) if line.errors else "",
            )
        )
        before = line.way
    render.table(render.console(), columns, rows)


def _shown(share: Share) -> str:
    return f"{share.mean:.2f}" if share.n else "-"


def _say(text: str, options: Namespace) -> None:
    if not options.quiet:
        sys.stderr.write(render.clean(text) + "\n")
