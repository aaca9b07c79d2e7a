"""``cgdb eval graph``: nodes and edges of scene graphs against annotated ones, or as people judge them."""

from __future__ import annotations

from argparse import Namespace
from collections.abc import Iterator, Sequence
from dataclasses import asdict
from pathlib import Path
from shutil import rmtree
from typing import TYPE_CHECKING, Any

from cgdb.cli.evaluate_scenes import Chosen, chosen, mean, paired, say, share, table, write_json
from cgdb.errors import UsageError

if TYPE_CHECKING:
    from cgdb.ingest.evaluation.graph import EdgeCount, GraphScore
    from cgdb.ingest.evaluation.sheets import Looks, SceneVerdict
    from cgdb.scene import ObjectId, Relation, SceneGraph

COLUMNS = ("scene", "nodes", "node p.", "valid", "dupl.", "edges", "edge p.")
MOST_PICTURES = 4
"""Of an object on a sheet: what is shown is then seen at a glance."""


def graph(options: Namespace) -> int:
    """Score against a truth, write a sheet for people, or score what they filled in."""
    if sum(map(bool, (options.truth, options.sheet, options.verdicts))) != 1:
        raise UsageError("one of --truth, --sheet and --verdicts says what to evaluate with")
    if not 0.0 < options.iou <= 1.0 or not 0.0 <= options.min_confidence <= 1.0:
        raise UsageError("--iou and --min-confidence are shares, 0 to 1")
    scenes = chosen(options.stores, options.scene)
    if options.sheet:
        return _write_sheet(scenes, options)
    return _score_sheets(scenes, options) if options.verdicts else _score(scenes, options)


def _score(scenes: Sequence[Chosen], options: Namespace) -> int:
    from cgdb.ingest.evaluation.annotated import read_annotated
    from cgdb.ingest.evaluation.graph import evaluate_graph
    from cgdb.storage.ledger import FILE

    scores: list[tuple[str, GraphScore]] = []
    for one, path in paired(scenes, options.truth):
        if (Path(path) / FILE).exists():
            hint = f"cgdb export {path} -o truth.json, then --truth truth.json"
            raise UsageError(f"{path} is a store, and the truth is a file", hint=hint)
        truth = read_annotated(path)
        scene = one.read()
        say(f"{one.name}: {len(truth.objects)} annotated objects, {len(truth.relations)} relations", options.quiet)
        found = evaluate_graph(
            scene,
            truth,
            by=options.match,
            least_iou=options.iou,
            labels=_words(options.labels),
            same=_same(options.same),
            origins=_words(options.origin),
            least_confidence=options.min_confidence,
            exclude=_words(options.exclude),
        )
        scores.append((one.name, found))
    if options.json:
        write_json(_json(scores))
        return 0
    rows = [_row(name, one) for name, one in scores]
    if len(scores) > 1:
        rows.append(_mean_row([one for _, one in scores]))
    table("Scene graph (found: of the annotated objects)", (*COLUMNS, "recall", "found"), rows)
    for name, scored in scores:
        if options.nodes:
            _per_node(name, scored)
        labels = [
            [c.label[:24], str(c.edges), share(c.precision), str(c.truth), share(c.recall)] for c in scored.labels
        ]
        table(f"\n{name}: edges by label", ("label", "edges", "precision", "true", "recall"), labels)
    return 0


def _row(name: str, one: GraphScore) -> list[str]:
    return [
        name[:20],
        str(len(one.nodes)),
        share(one.precision),
        str(one.valid),
        str(one.duplicates),
        str(one.edges.edges),
        share(one.edges.precision),
        share(one.edges.recall),
        f"{one.found}/{one.objects}",
    ]


def _mean_row(scores: Sequence[GraphScore]) -> list[str]:
    """Shares are means over scenes, as in the paper; counts are means too."""

    def of(values: Sequence[float]) -> str:
        return f"{sum(values) / len(values):.1f}"

    return [
        "mean",
        of([len(one.nodes) for one in scores]),
        share(mean([one.precision for one in scores])),
        of([one.valid for one in scores]),
        of([one.duplicates for one in scores]),
        of([one.edges.edges for one in scores]),
        share(mean([one.edges.precision for one in scores])),
        share(mean([one.edges.recall for one in scores])),
        "",
    ]


def _per_node(name: str, one: GraphScore) -> None:
    rows = [
        [
            f"#{node.id} {node.tag or ''}".strip()[:28],
            "-" if node.truth is None else f"#{node.truth}",
            ("right" if node.right else "no object" if node.truth is None else "misnamed")
            + (", duplicate" if node.duplicate else ""),
        ]
        for node in one.nodes
    ]
    table(f"\n{name}: its nodes", ("node", "annotated", "verdict"), rows)


def _json(scores: Sequence[tuple[str, GraphScore]]) -> dict[str, Any]:
    return {
        "scenes": [
            {
                "scene": name,
                "nodes": len(one.nodes),
                "node_precision": one.precision,
                "valid": one.valid,
                "duplicates": one.duplicates,
                "objects": one.objects,
                "found": one.found,
                **_edges(one.edges),
                "labels": {count.label: _edges(count) for count in one.labels},
                "verdicts": [asdict(node) for node in one.nodes],
            }
            for name, one in scores
        ],
        "mean": {
            "node_precision": mean([one.precision for _, one in scores]),
            "edge_precision": mean([one.edges.precision for _, one in scores]),
            "edge_recall": mean([one.edges.recall for _, one in scores]),
        },
    }


def _edges(count: EdgeCount) -> dict[str, Any]:
    return {
        "edges": count.edges,
        "edges_right": count.right,
        "edge_precision": count.precision,
        "true_edges": count.truth,
        "edge_recall": count.recall,
    }


def _write_sheet(scenes: Sequence[Chosen], options: Namespace) -> int:
    from cgdb.export import write_whole
    from cgdb.ingest.evaluation import sheet_page
    from cgdb.ingest.evaluation.graph import same_labels
    from cgdb.ingest.evaluation.sheets import sheet

    names = [one.scene for one in scenes]
    if len(set(names)) < len(names):
        raise UsageError("several stores hold scenes of one name, which a sheet cannot tell apart", hint="--scene")
    wanted, origins = same_labels(_words(options.labels) or ("on", "in"), _same(options.same)), _words(options.origin)

    def counts(relation: Relation) -> bool:
        return (
            wanted(relation.label)
            and (not origins or relation.origin in origins)
            and relation.confidence >= options.min_confidence
        )

    form = Path(options.sheet)
    page, folder = form.with_name(f"{form.stem}.html"), form.with_name(f"{form.stem}_pictures")
    if page == form:
        raise UsageError(
            "--sheet names the form, which is JSON; a page to judge in is written beside", hint="FILE.json"
        )
    for path in (form, page, folder):
        if path.exists():
            raise UsageError(f"{path} is there already", hint="it may hold somebody's answers: name another")
    graphs = [one.read(clouds=False) for one in scenes]
    try:
        looks = {
            (graph.name, id): seen
            for one, graph in zip(scenes, graphs, strict=True)
            for id, seen in _pictures(one, graph, folder)
        }
        text = sheet(graphs, counts, looks)
        names = [name for seen in looks.values() for name in seen.pictures]
        write_whole(page, sheet_page.page(text, ((name, (form.parent / name).read_bytes()) for name in names)))
        # Last: where it is, all of it is.
        write_whole(form, [text])
    except BaseException as error:
        rmtree(folder, ignore_errors=True)
        page.unlink(missing_ok=True)
        if isinstance(error, OSError):
            raise UsageError(f"{folder} cannot be written: {error.strerror or error}") from None
        raise
    nodes, edges = text.count('"label_right": null'), text.count('"right": null')
    say(f"{form}: {nodes} nodes and {edges} edges to judge, {len(names)} pictures", options.quiet)
    say(
        f"each person opens {page.name} and saves a form, or fills in a copy of {form.name}; then: cgdb eval graph "
        "STORE --verdicts COPY COPY ...",
        options.quiet,
    )
    return 0


def _pictures(one: Chosen, graph: SceneGraph, folder: Path) -> Iterator[tuple[ObjectId, Looks]]:
    """The best views of each node, their pictures written to the folder."""
    import cgdb
    from cgdb.cli.views import ENDINGS, file_name
    from cgdb.export import write_whole
    from cgdb.ingest.evaluation.graph import nodes_of
    from cgdb.ingest.evaluation.sheets import Looks
    from cgdb.scene import image_type

    with cgdb.open(one.store, text_encoder=None) as db:
        nodes = {obj.id for obj in nodes_of(graph)}
        for id, every in db.every_views(one.scene):
            if id not in nodes:
                continue
            views, names = every[:MOST_PICTURES], []
            for rank, view in enumerate(views, start=1):
                if view.image is not None:
                    folder.mkdir(exist_ok=True)
                    ending = ENDINGS[image_type(view.image) or "image/jpeg"]
                    name = f"{folder.name}/{file_name(one.scene)}-{file_name(id)}-{rank}{ending}"
                    write_whole(folder.parent / name, [view.image])
                    names.append(name)
            yield id, Looks(frames=tuple(view.frame for view in views), pictures=tuple(names))


def _score_sheets(scenes: Sequence[Chosen], options: Namespace) -> int:
    from cgdb.ingest.evaluation.sheets import read_sheet, verdicts

    sheets = [read_sheet(Path(path)) for path in options.verdicts]
    spoken_of = {part["scene"] for one in sheets for part in one["scenes"]}
    found = verdicts(sheets, {one.scene: one.read(clouds=False) for one in scenes if one.scene in spoken_of})
    if not found:
        raise UsageError("the sheets speak of no scene that is evaluated")
    if options.json:
        write_json({"scenes": [_verdict_json(one) for one in found]})
        return 0
    rows = [_verdict_row(one) for one in found]
    if len(found) > 1:
        shares = (mean([v.node_precision for v in found]), mean([v.edge_precision for v in found]))
        rows.append(["mean", "", share(shares[0]), "", "", "", share(shares[1]), "", ""])
    table("Scene graph, as people judge it (by majority)", (*COLUMNS, "people", "agree"), rows)
    for one in found:
        open_nodes, open_edges = one.nodes - one.node_answers, one.edges - one.edge_answers
        if open_nodes or open_edges:
            say(f"note: {one.scene}: nobody judged {open_nodes} nodes and {open_edges} edges", options.quiet)
    return 0


def _verdict_row(one: SceneVerdict) -> list[str]:
    return [
        one.scene[:20],
        str(one.nodes),
        share(one.node_precision),
        str(one.valid),
        str(one.duplicates),
        str(one.edges),
        share(one.edge_precision),
        str(one.people),
        share(one.agreement),
    ]


def _verdict_json(one: SceneVerdict) -> dict[str, Any]:
    return {**asdict(one), "node_precision": one.node_precision, "edge_precision": one.edge_precision}


def _words(text: str | None) -> tuple[str, ...]:
    return tuple(word.strip() for word in (text or "").split(",") if word.strip())


def _same(given: Sequence[str]) -> dict[str, str]:
    found = {}
    for word in given:
        label, equals, other = word.partition("=")
        if not equals or not label.strip() or not other.strip():
            raise UsageError(f"--same takes LABEL=OTHER, not '{word[:40]}'")
        found[label] = other
    return found
