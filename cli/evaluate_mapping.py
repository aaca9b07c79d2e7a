"""``cgdb eval mapping``: the objects of maps against the true ones."""

from __future__ import annotations

from argparse import Namespace
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

from cgdb.cli import render
from cgdb.cli.evaluate_clouds import is_length, note_apart, truth_cloud, with_clouds
from cgdb.cli.evaluate_scenes import chosen, line, mean, paired, share, table, write_json
from cgdb.errors import UsageError

if TYPE_CHECKING:
    from cgdb.ingest.evaluation.mapping import Score

_MEANS = ("purity", "worst_purity", "completeness", "completeness_fine", "box_iou", "association", "labels")


def mapping(options: Namespace) -> int:
    """Score the objects of each scene against the true ones."""
    from cgdb.ingest.evaluation.mapping import evaluate, truth_of

    if options.seen < 0 or not (is_length(options.reach) and is_length(options.near)):
        raise UsageError("--reach and --near are metres above 0, --seen at least 0")
    scores: list[tuple[str, Score]] = []
    for one, path in paired(chosen(options.stores, options.scene), options.truth):
        cloud = truth_cloud(path, options)
        truth = truth_of(cloud, path)
        scene = with_clouds(one)
        note_apart(one, scene, cloud, options)
        scores.append(
            (one.name, evaluate(scene, truth, least_seen=options.seen, reach=options.reach, near=options.near))
        )
        render.say(f"{one.name}: {len(truth.points):,} true points, {scores[-1][1].points:,} mapped", options.quiet)
    if options.json:
        write_json(
            {"scenes": [{"scene": name, **one.to_json()} for name, one in scores], "mean": _mapping_mean(scores)}
        )
        return 0
    rows = [_mapping_row(name, _figures(one)) for name, one in scores]
    if len(scores) > 1:
        rows.append(_mapping_row("mean", _mapping_mean(scores)))
    columns = ("scene", "found", "missed", "dupl.", "purity", "compl.", "assoc.", "IoU", "labels")
    table("Objects (compl.: of the true surface, within reach of a mapped point)", columns, rows)
    for name, scored in scores:
        _per_object(name, scored, options.objects)
    return 0


def _figures(one: Score) -> dict[str, Any]:
    """The figures of a score, without its objects."""
    record = one.to_json()
    return {key: value for key, value in record.items() if key not in ("objects", "strangers")}


def _mapping_mean(scores: Sequence[tuple[str, Score]]) -> dict[str, Any]:
    """Counts are summed, shares are means over scenes."""
    records = [_figures(one) for _, one in scores]
    return {
        key: mean([record[key] for record in records]) if key in _MEANS else sum(record[key] for record in records)
        for key in records[0]
    }


def _mapping_row(name: str, record: dict[str, Any]) -> list[str]:
    return [
        name[:17],
        f"{record['found']}/{record['true']}",
        str(record["missed"]),
        str(record["duplicates"]),
        share(record["purity"]),
        "-" if record["completeness"] is None else f"{record['completeness']:.3f}",
        share(record["association"]),
        share(record["box_iou"]),
        share(record["labels"]),
    ]


def _per_object(name: str, one: Score, every: bool) -> None:
    """The objects that something is wrong with, or all."""
    rows = []
    for obj in one.objects:
        wrong = "missed" if not obj.shown_by else "duplicated" if len(obj.shown_by) > 1 else ""
        if obj.named is False:
            wrong = ", ".join(filter(None, (wrong, "misnamed")))
        if wrong or every:
            rows.append(
                [
                    f"{obj.id} {obj.name}".strip()[:22],
                    str(obj.frames),
                    wrong or "found",
                    " ".join(f"#{known}" for known in obj.shown_by)[:22],
                    (obj.tag or "")[:16],
                    share(obj.purity),
                    share(obj.completeness),
                    share(obj.box_iou),
                ]
            )
    if rows:
        columns = ("true object", "seen", "", "mapped as", "tag", "pure", "compl.", "IoU")
        table(f"\n{name}: {'its objects' if every else 'what is not as it should be'}", columns, rows)
    if one.strangers:
        shown = " ".join(f"#{known}" for known in one.strangers[:12])
        more = f" and {len(one.strangers) - 12} more" if len(one.strangers) > 12 else ""
        line(f"{name}: {len(one.strangers)} mapped objects show no thing: {shown}{more}")
