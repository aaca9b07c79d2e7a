"""``cgdb eval graph``: nodes and edges of scene graphs against annotated ones, or as people judge them."""

from __future__ import annotations

from argparse import Namespace
from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Any

from cgdb.cli import render, values
from cgdb.cli.evaluate_scenes import NODES_AND_EDGES, Chosen, chosen, mean, paired, share, table, write_json
from cgdb.cli.evaluate_sheets import score_sheets, write_sheet
from cgdb.errors import UsageError

if TYPE_CHECKING:
    from cgdb.ingest.evaluation.graph import EdgeCount, GraphScore


def graph(options: Namespace) -> int:
    """Score against a truth, write a sheet for people, or score what they filled in."""
    if sum(map(bool, (options.truth, options.sheet, options.verdicts))) != 1:
        raise UsageError("one of --truth, --sheet and --verdicts says what to evaluate with")
    if not 0.0 < options.iou <= 1.0 or not 0.0 <= options.min_confidence <= 1.0:
        raise UsageError("--iou and --min-confidence are shares, 0 to 1")
    scenes = chosen(options.stores, options.scene)
    if options.sheet:
        return write_sheet(scenes, options)
    return score_sheets(scenes, options) if options.verdicts else _score(scenes, options)


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
        render.say(
            f"{one.name}: {len(truth.objects)} annotated objects, {len(truth.relations)} relations", options.quiet
        )
        found = evaluate_graph(
            scene,
            truth,
            by=options.match,
            least_iou=options.iou,
            labels=values.listed(options.labels),
            same=values.renamed(options.same),
            origins=values.listed(options.origin),
            least_confidence=options.min_confidence,
            exclude=values.listed(options.exclude),
        )
        scores.append((one.name, found))
    if options.json:
        write_json(_json(scores))
        return 0
    rows = [_row(name, one) for name, one in scores]
    if len(scores) > 1:
        rows.append(_mean_row([one for _, one in scores]))
    table("Scene graph (found: of the annotated objects)", (*NODES_AND_EDGES, "recall", "found"), rows)
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
