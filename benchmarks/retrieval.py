"""What `~` finds on judged queries: R@1, R@2, R@3 and how well `fits` tells, for each evidence alone and together.

Needs CGDB_TEST_DATA (retrieval/judgements.json and the maps that it names). A query counts for R@k if it has an object
of grade 2, and is right if one of grade 2 is among the first k. `fits` is degree >= 0.5, against grade 1 or 2, over all
queries. Every question is split by one generic rule into what is wanted and what is not; the rank is by
degree(wanted) * (1 - degree(unwanted)). "baseline" ranks by the cosine of the whole question and the caption.

--fit chooses the calibration anew with each map left out in turn, and reports on the maps that were left out.
"""

from __future__ import annotations

import argparse
import json
import os
import re
import sys
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from benchmarks.report import table
from cgdb import background
from cgdb.embed import text_encoder
from cgdb.ingest import load
from cgdb.scoring import Calibration, Meaning, Scorer
from cgdb.texts import TextIndex

Floats = NDArray[np.float32]
KINDS = ("descriptive", "affordance", "negation")
BASELINE = "caption cosine (baseline)"

ABSENT = """
a bicycle; a grand piano; a motorcycle; a surfboard; a fire hydrant; a horse; an aquarium with fish; a chainsaw;
a wedding dress; a telescope; a sewing machine; a violin; a canoe; a swimming pool; a traffic light; a washing machine;
a bathtub; a tractor; a hamburger; a pair of skis; a parachute; a tent; a lawn mower; a hospital bed; a wheelchair;
a rifle; a toothbrush; a birthday cake; a banana; a giraffe; a hair dryer; a trombone; a baby stroller; a wind turbine;
something to mow the lawn with; something to brush my teeth with; somewhere to take a bath; a ladder to reach the roof;
something to play a melody on; something to put out a fire
"""
"""Questions about what none of the maps holds: nothing may fit."""

_NEGATION = re.compile(
    r"""[,;]?\s*\b(?:other\ than|unlike|except(?:\ for)?|besides|apart\ from|instead\ of|excluding|rather\ than|
    unrelated\ to|but\ not|(?:that|which)(?:'s|\ is|\ are)\ not|(?:that|which)\ (?:isn't|aren't)|
    (?:that\ )?(?:you|i|we|one)\ (?:wouldn't|would\ not|can't|cannot|don't|do\ not)|
    (?:for\ someone\ )?who\ (?:dislikes|hates|doesn't\ like)|without|not|no)\b\s*""",
    re.IGNORECASE | re.VERBOSE,
)


def split(question: str) -> tuple[str, list[str]]:
    """What a question wants, and what it excludes: whatever follows a word of exclusion, one for each "or"."""
    wanted, *excluded = _NEGATION.split(question.strip().rstrip(".?!"))
    parts = [part.strip() for text in excluded for part in re.split(r",?\s+or\s+|,\s*", text)]
    return wanted.strip(" ,"), [part for part in parts if part]


@dataclass(frozen=True, slots=True, kw_only=True)
class Node:
    """An object as the text index reads it."""

    key: int
    tag: str | None
    tags: tuple[str, ...]
    caption: str | None
    properties: Mapping[str, object]
    label: str = "Object"


@dataclass(frozen=True, slots=True, kw_only=True)
class Query:
    """A judged question: grades (n,) of the map's objects, 0 to 2."""

    map: str
    kind: str
    text: str
    grades: NDArray[np.int64]


@dataclass(frozen=True, slots=True, kw_only=True)
class Map:
    """A map with the vectors of its texts; captions (n, d) for the baseline."""

    name: str
    index: TextIndex
    embeddings: Floats
    captions: Floats


@dataclass(frozen=True, slots=True, kw_only=True)
class Outcome:
    """How one query went: the rank of the first right object (None: it has none), and the counts of fits."""

    map: str
    kind: str
    rank: int | None
    precision: float
    hits: int
    fits: int
    relevant: int


class Bench:
    """The judged maps and questions, and a memory of text vectors."""

    def __init__(self, data: Path) -> None:
        self._encoder = text_encoder()
        self._vectors: dict[str, Floats] = {}
        self.background = self._encoder.texts(background.texts())
        self.maps: dict[str, Map] = {}
        self.queries: list[Query] = []
        for path, judged in json.loads((data / "retrieval" / "judgements.json").read_text()).items():
            objects = load(data / path, relate=False).objects
            ids = {str(obj.id): key for key, obj in enumerate(objects)}
            index = TextIndex.build(
                Node(key=key, tag=obj.tag, tags=obj.tags, caption=obj.caption, properties=obj.properties)
                for key, obj in enumerate(objects)
            )
            self.maps[path] = Map(
                name=path,
                index=index,
                embeddings=self._encoder.texts(index.texts[: index.n_encoded]),
                captions=self._encoder.texts([obj.caption or obj.tag or "" for obj in objects]),
            )
            for query in judged:
                grades = np.zeros(len(objects), dtype=np.int64)
                for name, grade in query["relevant"].items():
                    grades[ids[name]] = grade
                self.queries.append(Query(map=path, kind=query["kind"], text=query["query"], grades=grades))

    def vectors(self, texts: Sequence[str]) -> Floats:
        """(n, d) vectors; each text is encoded once."""
        new = [text for text in dict.fromkeys(texts) if text not in self._vectors]
        if new:
            self._vectors.update(zip(new, self._encoder.texts(new), strict=True))
        return np.stack([self._vectors[text] for text in texts])

    def baseline(self, query: Query) -> Floats:
        """Cosines as degrees."""
        return np.asarray(self.maps[query.map].captions @ self.vectors([query.text])[0], dtype=np.float32)

    def asker(self, calibration: Calibration, evidence: str | None = None, *, words_only: bool = False) -> Asker:
        """Answers questions by one evidence, or by all."""
        return Asker(self, calibration, evidence, words_only=words_only)


class Asker:
    """Degrees of questions, negation included; remembers what it was asked."""

    def __init__(self, bench: Bench, calibration: Calibration, evidence: str | None, *, words_only: bool) -> None:
        self._bench, self._evidence, self._encode = bench, evidence, None if words_only else bench.vectors
        self._scorers = {
            name: Scorer(
                found.index,
                embeddings=None if words_only else found.embeddings,
                background=None if words_only else bench.background,
                calibration=calibration,
            )
            for name, found in bench.maps.items()
        }
        self._known: dict[tuple[str, str], Floats] = {}

    def degrees(self, place: str, text: str) -> Floats:
        """(n,) degrees of one text without negation."""
        if (place, text) not in self._known:
            found = self._scorers[place].degrees(Meaning.of(text, self._encode))
            degree = found.degree
            if self._evidence is not None:
                part = found.parts.get(self._evidence, np.full(len(found.keys), np.nan, dtype=np.float32))
                degree = np.where(np.isfinite(part), part, np.float32(0.5))
            self._known[place, text] = degree
        return self._known[place, text]

    def __call__(self, query: Query) -> Floats:
        wanted, excluded = split(query.text)
        degree = self.degrees(query.map, wanted)
        for text in excluded:
            degree = degree * (1 - self.degrees(query.map, text))
        return degree


def outcome(query: Query, degree: Floats) -> Outcome:
    """Judge a ranking; objects of grade 1 neither help nor harm the average precision."""
    order = np.argsort(-degree, kind="stable")
    grades = query.grades[order]
    right = grades[grades != 1] == 2
    precision = np.cumsum(right) / np.arange(1, len(right) + 1)
    fits = degree >= 0.5
    return Outcome(
        map=query.map,
        kind=query.kind,
        rank=int(np.argmax(grades == 2)) if (grades == 2).any() else None,
        precision=float(precision[right].mean()) if right.any() else 0.0,
        hits=int((fits & (query.grades > 0)).sum()),
        fits=int(fits.sum()),
        relevant=int((query.grades > 0).sum()),
    )


def recall(outcomes: Sequence[Outcome]) -> list[float]:
    """R@1, R@2, R@3 over the outcomes that have a right answer."""
    ranks = [o.rank for o in outcomes if o.rank is not None]
    return [float(np.mean([rank < k for rank in ranks])) if ranks else float("nan") for k in (1, 2, 3)]


def false_alarms(bench: Bench, ask: Asker, places: Sequence[str]) -> float:
    """The share of (map, absent thing) for which something fits."""
    asked = [(place, " ".join(text.split())) for place in places for text in ABSENT.split(";")]
    return float(np.mean([(ask.degrees(place, text) >= 0.5).any() for place, text in asked]))


def report(bench: Bench, calibration: Calibration) -> None:
    """Print the tables."""
    ways: dict[str, Callable[[Query], Floats]] = {BASELINE: bench.baseline}
    for name, evidence in (("name", "name"), ("caption", "caption"), ("common knowledge", "known"), ("words", "words")):
        ways[name + " alone"] = bench.asker(calibration, evidence)
    ways["all, without an encoder"] = bench.asker(calibration, words_only=True)
    everything = bench.asker(calibration)
    ways["all"] = everything
    found = {way: [outcome(query, ask(query)) for query in bench.queries] for way, ask in ways.items()}
    for group in ("Replica maps", "lab"):
        places = {name for name in bench.maps if ("lab" in name) == (group == "lab")}
        counts = {
            kind: sum(o.rank is not None for o in found["all"] if o.map in places and o.kind == kind) for kind in KINDS
        }
        rows = []
        for way, outcomes in found.items():
            cells = [recall([o for o in outcomes if o.map in places and o.kind == kind]) for kind in KINDS]
            rows.append([way, *(" ".join(f"{share:.2f}" for share in cell) for cell in cells)])
        table(f"{group}: R@1 R@2 R@3", ["ranked by", *(f"{kind} ({counts[kind]})" for kind in KINDS)], rows)
        rows = []
        for way, outcomes in found.items():
            if way != BASELINE:
                chosen = [[o for o in outcomes if o.map in places and o.kind == kind] for kind in KINDS]
                rows.append([way, *(_precision_recall(group_of) for group_of in chosen)])
        table(f"{group}: precision / recall of fits", ["judged by", *KINDS], rows)
    share = false_alarms(bench, everything, list(bench.maps))
    print(f"\nNothing fits: of {len(ABSENT.split(';'))} absent things per map, {share:.1%} have something that fits.")


def _precision_recall(outcomes: Sequence[Outcome]) -> str:
    hits, fits = sum(o.hits for o in outcomes), sum(o.fits for o in outcomes)
    relevant = sum(o.relevant for o in outcomes)
    return f"{hits / max(fits, 1):.2f} / {hits / max(relevant, 1):.2f}"


GRID: Mapping[str, Sequence[float]] = {
    "line.name": (2.0, 2.5, 3.0, 3.5),
    "line.caption": (2.0, 2.5, 3.0, 3.5),
    "line.use": (2.5, 3.0, 3.5),
    "line.topic": (3.0, 4.0),
    "cover": (0.0, 1.5, 3.0, 4.0),
    "weight.kind.name": (0.3, 0.6, 1.0),
    "weight.kind.caption": (0.4, 0.8, 1.2),
    "weight.kind.known": (1.0, 2.0, 3.0, 4.0),
    "weight.use.name": (0.3, 0.6),
    "weight.use.caption": (0.1, 0.2, 0.4),
    "words.kind": (0.5, 1.0, 2.0),
    "words.use": (0.0, 0.5, 1.0),
    "argument": (1.0, 2.0, 3.0),
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
    parser.add_argument("--fit", action="store_true", help="choose the calibration with each map left out (minutes)")
    options = parser.parse_args()
    folder = os.environ.get("CGDB_TEST_DATA")
    if not folder:
        print("CGDB_TEST_DATA is not set: the judged maps are needed", file=sys.stderr)
        return 2
    bench = Bench(Path(folder))
    report(bench, Calibration())
    if options.fit:
        held_out: list[Outcome] = []
        for place, chosen, outcomes in fit(bench):
            print(f"without {place}: {chosen}", flush=True)
            held_out += outcomes
        rows = [
            [kind, " ".join(f"{share:.2f}" for share in recall(of_kind)), _precision_recall(of_kind)]
            for kind in KINDS
            for of_kind in [[o for o in held_out if o.kind == kind]]
        ]
        table("All maps, each by a calibration chosen without it", ["kind", "R@1 R@2 R@3", "fits P / R"], rows)
    return 0


if __name__ == "__main__":
    sys.exit(main())
