"""Questions in plain words, without a language model: R@1, R@2, R@3 of the built-in translator on judged queries.

Needs CGDB_TEST_DATA (retrieval/judgements.json and the maps that it names). Each map goes into a store of its own, with
the relations that its boxes imply; each question goes through cgdb.english.translate and Database.query. A query counts
if it has an object of grade 2, and is right for k if one of grade 2 is among the first k rows. "embedding" ranks by the
cosine of the whole question and the caption; "~ alone" asks MATCH (o ~ question). Then come the questions of
benchmarks/queries, totals only, and home_questions.toml in four flats of which only class names are known; a part of
their questions has no answer.

--show prints each query that is not right at once; --only KIND and --map PART restrict what is asked.
"""

from __future__ import annotations

import argparse
import json
import os
import sys
import time
import tomllib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

import cgdb
from benchmarks.judged import QUERIES, ROOT, Outcome, Query, fits_cell, nothing_cell, outcome, recall
from benchmarks.report import folder_of_stores, table
from benchmarks.retrieval import SETS
from cgdb.database import Database
from cgdb.english.translate import translate
from cgdb.ingest import load
from cgdb.meaning.embed import text_encoder
from cgdb.scene import ObjectId, SceneGraph

KINDS = ("descriptive", "affordance", "negation")
HOMES = ("TestScene1", "TestScene3", "TestScene5", "TestScene7")
TARGETS = {"Replica maps": (0.80, 0.80, 0.85), "lab": (1.00, 0.75, 0.90)}


@dataclass(frozen=True, slots=True, kw_only=True)
class Asked:
    """One question and how each way of asking did: ranks {way: place of the first right object, from 0}."""

    map: str
    kind: str
    question: str
    text: str
    ranks: dict[str, int]
    best: list[tuple[str, int, float, bool]]
    hits: int
    fits: int
    relevant: int
    seconds: float


def store(folder: Path, path: Path) -> tuple[Database, str]:
    """The store of a map, made if it is not there yet, and the scene's name."""
    where = folder / ("_".join(path.with_suffix("").parts[-2:]) + ".cgdb")
    if where.exists():
        db = cgdb.open(where)
        return db, db.scenes()[0].name
    db = cgdb.open(where, create=True)
    scene = load(path)
    db.add(scene)
    for _ in db.encode():
        pass
    return db, scene.name


def rooms(db: Database, scene: str) -> list[str]:
    """Names of the places of a scene."""
    return [place.name for place in db.scene(scene, features=False, clouds=False).places if place.name]


def rank(order: Sequence[str], grades: dict[str, int]) -> int:
    """The place of the first object of grade 2; past the end where there is none."""
    return next((i for i, name in enumerate(order) if grades.get(name) == 2), len(order) + 1000)


def ask_judged(data: Path, folder: Path, file: Path, part: str) -> tuple[list[Outcome], list[Outcome]]:
    """How the questions of one file of benchmarks/queries go: translated, and by the sentence embedding alone."""
    found, alone, encoder = [], [], text_encoder()
    for name, judged in json.loads(file.read_text()).items():
        if part not in name:
            continue
        db, scene = store(folder, (ROOT if name.startswith("cli/") else data) / name)
        objects = db.scene(scene, features=False, clouds=False).objects
        ids = tuple(str(obj.id) for obj in objects)
        captions = encoder.texts([obj.caption or obj.tag or "" for obj in objects])
        catalog, places = db.view(scene).catalog, rooms(db, scene)
        for query in judged:
            rows = db.query(translate(query["query"], catalog, places=places).text).rows
            degree, fits = np.zeros(len(ids), dtype=np.float32), np.zeros(len(ids), dtype=bool)
            for row in rows:
                if str(row[0].id) in ids:  # type: ignore[union-attr]
                    at = ids.index(str(row[0].id))  # type: ignore[union-attr]
                    degree[at], fits[at] = max(degree[at], row.score), fits[at] or row.fits
            grades = np.asarray([query["relevant"].get(name, 0) for name in ids], dtype=np.int64)
            asked = Query(map=name, id=query["id"], kind=query["kind"], text=query["query"], ids=ids, grades=grades)
            found.append(outcome(asked, degree, fits))
            cosines = captions @ encoder.texts([query["query"]])[0]
            alone.append(outcome(asked, np.asarray(cosines, dtype=np.float32)))
        db.close()
    return found, alone


def report_judged(title: str, outcomes: Sequence[Outcome], alone: Sequence[Outcome]) -> None:
    """Print the totals of one file of questions; alone: by the sentence embedding, which fits from 0.5."""
    rows = []
    for kind in (*dict.fromkeys(o.kind for o in outcomes), "all"):
        of_kind = [o for o in outcomes if kind in ("all", o.kind)]
        ranks = " ".join(f"{share:.2f}" for share in recall(of_kind))
        judged = str(sum(o.rank is not None for o in of_kind))
        plain = [o for o in alone if kind in ("all", o.kind)]
        plainly = " ".join(f"{share:.2f}" for share in recall(plain))
        cells = [plainly, fits_cell(of_kind), fits_cell(plain), nothing_cell(of_kind), nothing_cell(plain)]
        rows.append([kind, judged, ranks, *cells])
    header = ["fits P / R", "embedding", "nothing fits P / R (n)", "embedding"]
    table(title, ["kind", "n", "R@1 R@2 R@3", "embedding", *header], rows)


def ask_all(data: Path, folder: Path, only: str | None, part: str) -> list[Asked]:
    """Ask every judged question that has a clear answer, and count the fits of all."""
    encoder = text_encoder()
    outcomes = []
    for name, judged in json.loads((data / "retrieval" / "judgements.json").read_text()).items():
        if part not in name:
            continue
        db, scene = store(folder, data / name)
        objects = db.scene(scene, features=False, clouds=False).objects
        catalog, places = db.view(scene).catalog, rooms(db, scene)
        captions = encoder.texts([obj.caption or obj.tag or "" for obj in objects])
        for query in judged:
            if only not in (None, query["kind"]):
                continue
            grades = query["relevant"]
            made = translate(query["query"], catalog, places=places)
            started = time.perf_counter()
            rows = db.query(made.text).rows
            seconds = time.perf_counter() - started
            found = [(str(row[0].id), grades.get(str(row[0].id), 0), row.score, row.fits) for row in rows]  # type: ignore[union-attr]
            cosines = captions @ encoder.texts([query["query"]])[0]
            alone = db.query("MATCH (o ~ $q) RETURN o", q=query["query"]).rows
            outcomes.append(
                Asked(
                    map=name,
                    kind=query["kind"],
                    question=query["query"],
                    text=made.text,
                    ranks={
                        "embedding": rank([str(objects[i].id) for i in np.argsort(-cosines, kind="stable")], grades),
                        "~ alone": rank([str(row[0].id) for row in alone], grades),  # type: ignore[union-attr]
                        "translator": rank([one[0] for one in found], grades),
                    }
                    if 2 in grades.values()
                    else {},
                    best=found[:3],
                    hits=sum(fits and grade > 0 for _, grade, _, fits in found),
                    fits=sum(fits for _, _, _, fits in found),
                    relevant=len(grades),
                    seconds=seconds,
                )
            )
        db.close()
    return outcomes


@dataclass(frozen=True, slots=True, kw_only=True)
class AtHome:
    """A question about a flat: right or not at once; where nothing answers it, right means that nothing fits."""

    flat: str
    kind: str
    question: str
    text: str
    right: bool
    absent: bool
    fits: bool
    best: list[str]


def ask_homes(data: Path, folder: Path, part: str) -> list[AtHome]:
    """Ask the questions of home_questions.toml in every flat."""
    questions = tomllib.loads((Path(__file__).parent / "home_questions.toml").read_text())["question"]
    outcomes = []
    for flat in HOMES:
        if part not in flat:
            continue
        db, scene = store(folder, data / "maps" / "virtualhome" / f"{flat}_graph.json")
        graph = db.scene(scene, features=False, clouds=False)
        catalog, places = db.view(scene).catalog, rooms(db, scene)
        for question in questions:
            answers = right_answers(graph, question)
            made = translate(question["text"], catalog, places=places, up=graph.up or "z")
            rows = db.query(made.text).rows
            found = [row[-1] for row in rows]
            fits = any(row.fits for row in rows)
            outcomes.append(
                AtHome(
                    flat=flat,
                    kind=question["kind"],
                    question=question["text"],
                    text=made.text,
                    right=bool(found) and found[0].id in answers if answers else not fits,  # type: ignore[union-attr]
                    absent=not answers,
                    fits=fits,
                    best=[
                        f"{node} {row.score:.2f}{'' if row.fits else ' (no)'}"
                        for node, row in zip(found[:4], rows, strict=False)
                    ],
                )
            )
        db.close()
    return outcomes


def right_answers(graph: SceneGraph, question: Mapping[str, Any]) -> set[ObjectId]:
    """The objects of a flat that answer a question, by their class names and by what the simulator knows."""
    tags = {obj.id: obj.tag for obj in graph.objects}
    names = {place.id: place.name for place in graph.places}

    def related(label: str, kinds: Sequence[str], *, back: bool = False) -> set[ObjectId]:
        pairs = ((r.target, r.source) if back else (r.source, r.target) for r in graph.relations if r.label == label)
        return {one for one, other in pairs if tags.get(other) in kinds}

    def inside(room: str) -> set[ObjectId]:
        return {r.target for r in graph.relations if r.label == "contains" and names.get(r.source) == room}

    found = {name for name, tag in tags.items() if tag in question["tags"] or "*" in question["tags"]}
    if "where" in question:
        found &= related(*question["where"])
    if "inverse" in question:
        found &= related(*question["inverse"], back=True)
    if "not_where" in question:
        found -= related(*question["not_where"])
    if "room" in question:
        found &= inside(question["room"])
    if "not_room" in question:
        found -= inside(question["not_room"])
    if "state" in question:
        found &= {obj.id for obj in graph.objects if question["state"] in (obj.properties.get("states") or ())}
    return found


def report_homes(outcomes: Sequence[AtHome], *, show: bool) -> None:
    """Print how many were right at once, per flat and kind, and whether fits tells what there is."""
    rows = []
    for flat in dict.fromkeys(o.flat for o in outcomes):
        cells = []
        for kind in KINDS:
            right = [o.right for o in outcomes if o.flat == flat and o.kind == kind and not o.absent]
            cells.append(f"{np.mean(right):.2f} ({len(right)})" if right else "")
        present = [o.fits for o in outcomes if o.flat == flat and not o.absent]
        absent = [not o.fits for o in outcomes if o.flat == flat and o.absent]
        rows.append(
            [flat, *cells, f"{np.mean(present):.2f} ({len(present)})", f"{np.mean(absent):.2f} ({len(absent)})"]
        )
    table("Flats with class names only: R@1", ["", *KINDS, "something fits", "nothing fits"], rows)
    for o in outcomes if show else ():
        if not o.right or (not o.absent and not o.fits):
            what = "nothing should fit" if o.absent else "right, but nothing fits" if o.right else "wrong"
            print(f"\n{o.flat} [{o.kind}] {o.question}: {what}\n  {o.text}\n  {', '.join(o.best)}")


def report(outcomes: Sequence[Asked]) -> None:
    """Print the table of each group of maps."""
    for group, targets in TARGETS.items():
        inside = [o for o in outcomes if ("lab" in o.map) == (group == "lab")]
        if not inside:
            continue
        counts = [sum(bool(o.ranks) for o in inside if o.kind == kind) for kind in KINDS]
        rows: list[list[str]] = []
        for way in ("embedding", "~ alone", "translator"):
            cells = []
            for kind in KINDS:
                ranks = [o.ranks[way] for o in inside if o.ranks and o.kind == kind]
                cells.append(" ".join(f"{np.mean([r < k for r in ranks]):.2f}" for k in (1, 2, 3)) if ranks else "")
            rows.append([way, *cells])
        rows.append(["target without a model", *(f"{target:.2f}          " for target in targets)])
        table(f"{group}: R@1 R@2 R@3", ["", *(f"{k} ({n})" for k, n in zip(KINDS, counts, strict=True))], rows)
        cells = []
        for kind in KINDS:
            chosen = [o for o in inside if o.kind == kind]
            hits, fits, relevant = (sum(getattr(o, name) for o in chosen) for name in ("hits", "fits", "relevant"))
            cells.append(f"{hits / max(fits, 1):.2f} / {hits / max(relevant, 1):.2f}")
        table(f"{group}: precision / recall of fits", ["", *KINDS], [["translator", *cells]])
    print(f"\nmedian {1000 * np.median([o.seconds for o in outcomes]):.1f} ms per query, translated apart")


def main() -> int:
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument(
        "--stores", type=Path, metavar="FOLDER", help="make the stores there, and use those there already"
    )
    parser.add_argument("--show", action="store_true", help="print what was not right at once")
    parser.add_argument("--only", choices=KINDS, help="only queries of this kind")
    parser.add_argument("--map", default="", metavar="PART", help="only maps whose path has this in it")
    options = parser.parse_args()
    data = os.environ.get("CGDB_TEST_DATA")
    if not data:
        print("CGDB_TEST_DATA is not set: the judged maps are needed", file=sys.stderr)
        return 2
    with folder_of_stores(options.stores) as folder:
        outcomes = ask_all(Path(data), folder, options.only, options.map)
        homes: list[AtHome] = []
        judged: dict[str, tuple[list[Outcome], list[Outcome]]] = {}
        if options.only is None:
            files = {name: QUERIES / f"{name}.json" for name in SETS}
            judged = {name: ask_judged(Path(data), folder, file, options.map) for name, file in files.items()}
            homes = ask_homes(Path(data), folder, options.map)
    if outcomes:
        report(outcomes)
    for name, found in judged.items():
        if found[0]:
            report_judged(SETS[name], *found)
    if homes:
        report_homes(homes, show=options.show)
    for o in outcomes if options.show else ():
        if o.ranks and o.ranks["translator"] > 0:
            best = ", ".join(
                f"#{name} grade {grade} {score:.2f}{'' if fits else ' (no)'}" for name, grade, score, fits in o.best
            )
            print(
                f"\n{Path(o.map).stem} [{o.kind}] {o.question}\n  {o.text}\n  rank {o.ranks['translator'] + 1}: {best}"
            )
    return 0


if __name__ == "__main__":
    sys.exit(main())
