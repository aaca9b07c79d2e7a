"""Judged questions: maps, questions and grades from files, a judge of rankings, and ways to answer by degrees alone.

The layout of the files is told in benchmarks/queries/README.md.
"""

from __future__ import annotations

import json
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from cgdb.ingest import load
from cgdb.meaning import background
from cgdb.meaning.calibration import Calibration
from cgdb.meaning.embed import Encoder, text_encoder
from cgdb.meaning.scoring import Meaning, Scorer
from cgdb.meaning.texts import TextIndex

Floats = NDArray[np.float32]
ROOT = Path(__file__).parent.parent
QUERIES = Path(__file__).parent / "queries"

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
    """A judged question: grades (n,) of the map's objects, 0 to 2, and their ids in the same order."""

    map: str
    id: str
    kind: str
    text: str
    ids: tuple[str, ...]
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
    """How one query went: the rank of the first right object (None: it has none), and the counts of fits.

    answerable: whether the map holds what is asked; None where that may be argued.
    """

    map: str
    kind: str
    rank: int | None
    precision: float
    hits: int
    fits: int
    relevant: int
    answerable: bool | None


class Bench:
    """The judged maps and questions of one file, and a memory of text vectors.

    Paths of maps begin with cli/ (in this repository) or maps/ (in data). Of the simulated flats only the class names
    are read: that is all that many maps have.
    """

    def __init__(self, data: Path, judgements: Path | None = None, encoder: Encoder | None = None) -> None:
        self.encoder = encoder or text_encoder()
        self._vectors: dict[str, Floats] = {}
        self.background = self.encoder.texts(background.texts())
        self.maps: dict[str, Map] = {}
        self.queries: list[Query] = []
        file = judgements or data / "retrieval" / "judgements.json"
        for path, judged in json.loads(file.read_text("utf-8")).items():
            objects = load((ROOT if path.startswith("cli/") else data) / path, relate=False).objects
            ids = tuple(str(obj.id) for obj in objects)
            bare = "virtualhome" in path
            index = TextIndex.build(
                Node(
                    key=key, tag=obj.tag, tags=obj.tags, caption=obj.caption, properties={} if bare else obj.properties
                )
                for key, obj in enumerate(objects)
            )
            self.maps[path] = Map(
                name=path,
                index=index,
                embeddings=self.encoder.texts(index.texts[: index.n_encoded]),
                captions=self.vectors([obj.caption or obj.tag or "" for obj in objects]),
            )
            for query in judged:
                grades = np.asarray([query["relevant"].get(name, 0) for name in ids], dtype=np.int64)
                self.queries.append(
                    Query(map=path, id=query["id"], kind=query["kind"], text=query["query"], ids=ids, grades=grades)
                )

    def vectors(self, texts: Sequence[str]) -> Floats:
        """(n, d) vectors; each text is encoded once."""
        new = [text for text in dict.fromkeys(texts) if text not in self._vectors]
        if new:
            self._vectors.update(zip(new, self.encoder.texts(new), strict=True))
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


def outcome(query: Query, degree: Floats, fits: NDArray[np.bool_] | None = None) -> Outcome:
    """Judge a ranking; objects of grade 1 neither help nor harm the average precision. fits None: degree >= 0.5."""
    order = np.argsort(-degree, kind="stable")
    grades = query.grades[order]
    right = grades[grades != 1] == 2
    precision = np.cumsum(right) / np.arange(1, len(right) + 1)
    fits = degree >= 0.5 if fits is None else fits
    return Outcome(
        map=query.map,
        kind=query.kind,
        rank=int(np.argmax(grades == 2)) if (grades == 2).any() else None,
        precision=float(precision[right].mean()) if right.any() else 0.0,
        hits=int((fits & (query.grades > 0)).sum()),
        fits=int(fits.sum()),
        relevant=int((query.grades > 0).sum()),
        answerable=True if (grades == 2).any() else None if grades.any() else False,
    )


def recall(outcomes: Sequence[Outcome]) -> list[float]:
    """R@1, R@2, R@3 over the outcomes that have a right answer."""
    ranks = [o.rank for o in outcomes if o.rank is not None]
    return [float(np.mean([rank < k for rank in ranks])) if ranks else float("nan") for k in (1, 2, 3)]


def fits_cell(outcomes: Sequence[Outcome]) -> str:
    """Precision / recall of fits, over all objects of all questions."""
    hits, fits = sum(o.hits for o in outcomes), sum(o.fits for o in outcomes)
    relevant = sum(o.relevant for o in outcomes)
    return f"{hits / max(fits, 1):.2f} / {hits / max(relevant, 1):.2f}"


def nothing_cell(outcomes: Sequence[Outcome]) -> str:
    """Precision / recall of saying that nothing fits, and of how many questions."""
    said = [o for o in outcomes if o.answerable is not None and o.fits == 0]
    right, all_of_them = sum(o.answerable is False for o in said), sum(o.answerable is False for o in outcomes)
    return f"{right / max(len(said), 1):.2f} / {right / max(all_of_them, 1):.2f} ({all_of_them})"
