"""What `~` and CGQL find on judged questions: R@1, R@2, R@3, how well `fits` tells, and "nothing fits".

Needs CGDB_TEST_DATA (retrieval/judgements.json and the maps that it names). A question counts for R@k if it has an
object of grade 2, and is right if one of grade 2 is among the first k. Precision and recall of `fits` are over all
objects with grade 1 or 2. "baseline" ranks by the cosine of the whole question and the caption, and fits from 0.5.

- CGQL as a person writes it (benchmarks/queries/handwritten_cgql.json), run on stores of those maps; and forty
  statements about what none of them holds.
- The questions themselves on other maps (benchmarks/queries/), in a half on which the degrees were worked at, one of
  which nobody has seen more than these totals, and a set written later, a third of it without any answer. One generic
  rule splits a question into what is wanted and what is not; the degree is that of the wanted times one minus that of
  the unwanted.

--parts adds what each evidence finds alone. --fit chooses the calibration anew with each map left out in turn, and
reports on the maps that were left out (many minutes).
"""

from __future__ import annotations

import argparse
import json
import os
import sys
import tempfile
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

import cgdb
from benchmarks.judged import QUERIES, Asker, Bench, Floats, Outcome, Query, fits_cell, nothing_cell, outcome, recall
from benchmarks.report import table
from cgdb.ingest import load
from cgdb.meaning.calibration import Calibration
from cgdb.result import StoredNode

KINDS = ("descriptive", "affordance", "negation")
SETS: Mapping[str, str] = {
    "development": "Other maps, development half",
    "report": "Other maps, report half",
    "held_out": "Other questions about other things, a third of them without an answer",
    "outsider": "Questions of somebody who had not seen how they are understood",
}
"""The files of benchmarks/queries, and what each holds."""
BASELINE = "caption cosine (baseline)"
HEADER = ["kind", "n", "R@1 R@2 R@3", "baseline", "fits P / R", "baseline", "nothing fits P / R (n)", "baseline"]


def absent() -> list[str]:
    """Statements about what none of the judged maps holds."""
    return list(json.loads((QUERIES / "handwritten_cgql.json").read_text("utf-8"))["absent"])


def false_alarms(bench: Bench, ask: Asker, places: Sequence[str]) -> float:
    """The share of (map, absent thing) for which something fits."""
    texts = [statement.split('"')[1] for statement in absent()]
    return float(np.mean([(ask.degrees(place, text) >= 0.5).any() for place in places for text in texts]))


def by_hand(bench: Bench, data: Path) -> tuple[list[Outcome], dict[str, int]]:
    """How the handwritten CGQL does on stores of the maps; {map: absent things of which something fits}."""
    statements = json.loads((QUERIES / "handwritten_cgql.json").read_text("utf-8"))
    found: list[Outcome] = []
    alarms: dict[str, int] = {}
    with tempfile.TemporaryDirectory(prefix="cgdb-bench-") as folder:
        for number, place in enumerate(bench.maps):
            with cgdb.open(Path(folder) / f"{number}.cgdb", create=True) as db:
                db.add(load(data / place))
                here = [query for query in bench.queries if query.map == place]
                found += [_asked(db, query, statements[place][query.id]) for query in here]
                alarms[place] = sum(not db.query(text).nothing_fits for text in statements["absent"])
    return found, alarms


def _asked(db: cgdb.Database, query: Query, statement: str) -> Outcome:
    degree, fits = np.zeros(len(query.ids), dtype=np.float32), np.zeros(len(query.ids), dtype=bool)
    for row in db.query(statement):
        node = row[0]
        assert isinstance(node, StoredNode)
        at = query.ids.index(str(node.id))
        degree[at], fits[at] = row.score, row.fits
    return outcome(query, degree, fits)


def compared(title: str, outcomes: Sequence[Outcome], baseline: Sequence[Outcome]) -> None:
    """Print outcomes per kind beside the baseline's."""
    kinds = list(dict.fromkeys(o.kind for o in outcomes))
    rows = []
    for kind in (*kinds, *(["all"] if len(kinds) > 1 else [])):
        ours, theirs = ([o for o in group if kind in ("all", o.kind)] for group in (outcomes, baseline))
        cells = [_recalls(ours), _recalls(theirs), fits_cell(ours), fits_cell(theirs)]
        rows.append([kind, sum(o.rank is not None for o in ours), *cells, nothing_cell(ours), nothing_cell(theirs)])
    table(title, HEADER, rows)


def _recalls(outcomes: Sequence[Outcome]) -> str:
    return " ".join(f"{share:.2f}" for share in recall(outcomes))


def report(bench: Bench, data: Path) -> None:
    """Print the tables of the judged maps and of the held-out halves."""
    outcomes, alarms = by_hand(bench, data)
    baseline = [outcome(query, bench.baseline(query)) for query in bench.queries]
    for group in ("Replica maps", "lab"):
        of_group = [[o for o in found if ("lab" in o.map) == (group == "lab")] for found in (outcomes, baseline)]
        compared(f"{group}: handwritten CGQL through db.query", *of_group)
    n = len(absent())
    share = 1 - sum(alarms.values()) / (n * len(alarms))
    print(f"\nOf {n} statements about absent things on each of {len(alarms)} maps, {share:.1%} say that nothing fits.")
    ask = bench.asker(Calibration())
    compared("The same questions, split by rule, by `~` alone", [outcome(q, ask(q)) for q in bench.queries], baseline)
    for half, title in SETS.items():
        other = Bench(data, QUERIES / f"{half}.json", encoder=bench.encoder)
        for way, words_only in (("", False), (", without an encoder", True)):
            ask = other.asker(Calibration(), words_only=words_only)
            found = [outcome(query, ask(query)) for query in other.queries]
            theirs = [outcome(query, other.baseline(query)) for query in other.queries]
            compared(f"{title}{way}", found, theirs)


def parts(bench: Bench) -> None:
    """Print what each evidence finds alone."""
    ways: dict[str, Callable[[Query], Floats]] = {BASELINE: bench.baseline}
    for name, evidence in (("name", "name"), ("caption", "caption"), ("common knowledge", "known"), ("words", "words")):
        ways[name + " alone"] = bench.asker(Calibration(), evidence)
    ways["all, without an encoder"] = bench.asker(Calibration(), words_only=True)
    ways["all"] = bench.asker(Calibration())
    rows = []
    for way, ask in ways.items():
        outcomes = [outcome(query, ask(query)) for query in bench.queries]
        of_kinds = [[o for o in outcomes if o.kind == kind] for kind in KINDS]
        rows.append([way, *map(_recalls, of_kinds), *map(fits_cell, of_kinds)])
    header = ["judged by", *(f"{kind} R@" for kind in KINDS), *(f"{kind} fits P / R" for kind in KINDS)]
    table("Each evidence alone, the judged maps", header, rows)


GRID: Mapping[str, Sequence[float]] = {
    "line.name": (2.0, 2.5, 3.0, 3.5),
    "line.caption": (2.0, 2.5, 3.0, 3.5),
    "line.use": (2.5, 3.0, 3.5),
    "line.topic": (3.0, 4.0),
    "cover": (1.5, 3.0, 4.0),
    "part": (3.0, 5.0, 7.0),
    "verb": (1.0, 2.0, 3.0),
    "rival": (0.5, 0.6, 0.7),
    "weight.kind.name": (0.3, 0.6, 1.0),
    "weight.kind.caption": (0.4, 0.8, 1.2),
    "weight.kind.known": (1.0, 2.0, 3.0, 4.0),
    "weight.use.name": (0.3, 0.6),
    "weight.use.known": (1.0, 1.5, 2.5),
    "weight.use.caption": (0.1, 0.2, 0.4),
    "words.kind": (0.5, 1.0, 2.0),
    "argument": (2.0, 4.0, 6.0),
}
"""Values tried for each number of the calibration; the descent starts from the middle of each."""


def _put(calibration: Calibration, path: str, value: float) -> Calibration:
    name, *keys = path.split(".")
    if not keys:
        return replace(calibration, **{name: value})  # type: ignore[arg-type]
    whole: dict[str, Any] = {k: dict(v) if isinstance(v, Mapping) else v for k, v in getattr(calibration, name).items()}
    inner = whole if len(keys) == 1 else whole[keys[0]]
    inner[keys[-1]] = value
    return replace(calibration, **{name: whole})  # type: ignore[arg-type]


def _goodness(outcomes: Sequence[Outcome], alarms: Mapping[str, float], left_out: str | None) -> float:
    """Ranking and fits count alike, each kind of question alike, and "nothing fits" as one more."""
    total = 1.0 - float(np.mean([alarm for place, alarm in alarms.items() if place != left_out]))
    for kind in KINDS:
        of_kind = [o for o in outcomes if o.kind == kind and o.map != left_out]
        judged = [o for o in of_kind if o.rank is not None]
        if judged:
            hits, size = sum(o.hits for o in of_kind), sum(o.fits + o.relevant for o in of_kind)
            single = [2 * o.hits / (o.fits + o.relevant) if o.fits + o.relevant else 1.0 for o in of_kind]
            ranking = np.mean(recall(judged)) + np.mean([o.precision for o in judged])
            total += 0.5 * float(ranking + 2 * hits / max(size, 1) + np.mean(single))
    return total


def fit(bench: Bench) -> Iterator[tuple[str, dict[str, float], list[Outcome]]]:
    """(map left out, the values chosen without it, how it went on it), for each map; coordinate descent."""
    tried: dict[str, tuple[list[Outcome], dict[str, float]]] = {}

    def tryout(calibration: Calibration) -> tuple[list[Outcome], dict[str, float]]:
        key = repr(calibration)
        if key not in tried:
            ask = bench.asker(calibration)
            alarms = {place: false_alarms(bench, ask, [place]) for place in bench.maps}
            tried[key] = ([outcome(query, ask(query)) for query in bench.queries], alarms)
        return tried[key]

    for place in bench.maps:
        chosen = {path: values[len(values) // 2] for path, values in GRID.items()}
        calibration = Calibration()
        for path, value in chosen.items():
            calibration = _put(calibration, path, value)
        best = _goodness(*tryout(calibration), place)
        for _ in range(3):
            before = best
            for path, values in GRID.items():
                for value in values:
                    candidate = _put(calibration, path, value)
                    if value != chosen[path] and (score := _goodness(*tryout(candidate), place)) > best + 1e-3:
                        best, calibration, chosen[path] = score, candidate, value
            if best == before:
                break
        yield place, chosen, [o for o in tryout(calibration)[0] if o.map == place]


def main() -> int:
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("--parts", action="store_true", help="each evidence alone")
    parser.add_argument("--fit", action="store_true", help="choose the calibration with each map left out (minutes)")
    options = parser.parse_args()
    folder = os.environ.get("CGDB_TEST_DATA")
    if not folder:
        print("CGDB_TEST_DATA is not set: the judged maps are needed", file=sys.stderr)
        return 2
    data = Path(folder)
    bench = Bench(data)
    report(bench, data)
    if options.parts:
        parts(bench)
    if options.fit:
        held_out: list[Outcome] = []
        for place, chosen, outcomes in fit(bench):
            print(f"without {place}: {chosen}", flush=True)
            held_out += outcomes
        rows = [
            [kind, _recalls(of_kind), fits_cell(of_kind)]
            for kind in KINDS
            for of_kind in [[o for o in held_out if o.kind == kind]]
        ]
        table("All maps, each by a calibration chosen without it", ["kind", "R@1 R@2 R@3", "fits P / R"], rows)
    return 0


if __name__ == "__main__":
    sys.exit(main())
