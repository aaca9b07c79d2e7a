"""``cgdb eval graph --sheet`` and ``--verdicts``: forms that people fill in, and what they say of scene graphs."""

from __future__ import annotations

from argparse import Namespace
from collections.abc import Iterator, Sequence
from dataclasses import asdict
from pathlib import Path
from shutil import rmtree
from typing import TYPE_CHECKING, Any

from cgdb.cli import render, values
from cgdb.cli.evaluate_scenes import NODES_AND_EDGES, Chosen, mean, share, table, write_json
from cgdb.errors import UsageError

if TYPE_CHECKING:
    from cgdb.ingest.evaluation.sheets import Looks, SceneVerdict
    from cgdb.scene import ObjectId, Relation, SceneGraph

MOST_PICTURES = 4
"""Of an object on a sheet: what is shown is then seen at a glance."""


def write_sheet(scenes: Sequence[Chosen], options: Namespace) -> int:
    """A form, a page to fill it in, and the pictures for both; all of them, or none."""
    from cgdb.export import write_whole
    from cgdb.ingest.evaluation import sheet_page
    from cgdb.ingest.evaluation.graph import same_labels
    from cgdb.ingest.evaluation.sheets import sheet

    names = [one.scene for one in scenes]
    if len(set(names)) < len(names):
        raise UsageError("several stores hold scenes of one name, which a sheet cannot tell apart", hint="--scene")
    wanted = same_labels(values.listed(options.labels) or ("on", "in"), values.renamed(options.same))
    origins = values.listed(options.origin)

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
    render.say(f"{form}: {nodes} nodes and {edges} edges to judge, {len(names)} pictures", options.quiet)
    render.say(
        f"each person opens {page.name} and saves a form, or fills in a copy of {form.name}; then: cgdb eval graph "
        "STORE --verdicts COPY COPY ...",
        options.quiet,
    )
    return 0


def _pictures(one: Chosen, graph: SceneGraph, folder: Path) -> Iterator[tuple[ObjectId, Looks]]:
    """The best views of each node, their pictures written to the folder."""
    import cgdb
    from cgdb.cli.values import file_name
    from cgdb.cli.views import ENDINGS
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


def score_sheets(scenes: Sequence[Chosen], options: Namespace) -> int:
    """Score scenes by the majority of what people said of their nodes and edges."""
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
    table("Scene graph, as people judge it (by majority)", (*NODES_AND_EDGES, "people", "agree"), rows)
    for one in found:
        open_nodes, open_edges = one.nodes - one.node_answers, one.edges - one.edge_answers
        if open_nodes or open_edges:
            render.say(f"note: {one.scene}: nobody judged {open_nodes} nodes and {open_edges} edges", options.quiet)
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
