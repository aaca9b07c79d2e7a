"""``cgdb eval semseg``: the classes of a map's points against labelled clouds, as the paper's Table II."""

from __future__ import annotations

from argparse import Namespace
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from cgdb.cli import render
from cgdb.cli.evaluate_clouds import is_length, note_apart, truth_cloud
from cgdb.cli.evaluate_scenes import Chosen, chosen, line, mean, paired, percent, table, write_json
from cgdb.errors import CgdbError, FormatError, UsageError, did_you_mean, one_of

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from cgdb.ingest.evaluation.labelled import LabelledCloud
    from cgdb.ingest.evaluation.semseg import Confusion, SegmentationScore
    from cgdb.meaning.embed import Encoder
    from cgdb.scene import SceneGraph


def semseg(options: Namespace) -> int:
    """Score the classes of points, as the paper's Table II."""
    from cgdb.ingest.evaluation.semseg import score, summed

    if options.within is not None and not is_length(options.within):
        raise UsageError("--within is metres above 0")
    if "{c}" not in options.template:
        raise UsageError("--template must hold {c}, where the class goes", hint="'an image of {c}'")
    parts: list[tuple[str, Confusion]] = []
    for one, path in paired(chosen(options.stores, options.scene), options.truth):
        parts.append((one.name, _segmented(one, truth_cloud(path, options), path, options)))
    scores = [(name, score(part)) for name, part in parts]
    if len(parts) > 1:
        scores.append(("all", score(summed([part for _, part in parts]))))
    if options.json:
        _semseg_json(scores)
        return 0
    columns = ("scene", "mAcc", "F-mIoU", "mIoU", "mPrec", "mF1", "classes", "points", "none")
    rows = [_semseg_row(name, one) for name, one in scores]
    if len(parts) > 1:
        rows.append(_semseg_means([one for _, one in scores[:-1]]))
    table("Semantic segmentation, % (all: points of all scenes; none: given no class)", columns, rows)
    _per_class(scores[-1][1])
    return 0


def _segmented(one: Chosen, truth: LabelledCloud, path: str, options: Namespace) -> Confusion:
    import numpy as np

    from cgdb.ingest.evaluation import semseg as protocol

    if not len(truth.names) or not (truth.labels >= 0).any():
        raise FormatError(
            f"{path}: says the class of no point", hint="labels and names in the .npz; --names for a .ply"
        )
    scene = one.read(features=options.by == "feature")
    note_apart(one, scene, truth, options)
    scored = ~protocol.left_out(options.exclude, truth.names)
    present = np.bincount(truth.labels[truth.labels >= 0], minlength=len(truth.names)) > 0
    allowed = scored & present if options.classes == "scene" else scored
    if not (scored & present).any():
        raise UsageError(f"{path}: --exclude leaves no class to score")
    objects, settled = protocol.scored_objects(scene.objects, truth.names, allowed)
    if not objects:
        raise UsageError(f"{one.name}: no object of the scene has points", hint="cgdb map makes maps with clouds")
    if options.by == "tag":
        classes = protocol.classes_by_tag(objects, truth.names, allowed)
    else:
        space, vectors = _class_vectors(one, scene, truth, allowed, options)
        classes = protocol.classes_by_feature(objects, space, vectors, allowed)
    classes = np.where(settled >= 0, settled, classes)
    without = int((classes < 0).sum())
    render.say(
        f"{one.name}: {len(objects)} objects, {int(allowed.sum())} classes"
        + (
            f"; {without} objects have no {'feature' if options.by == 'feature' else 'tag of a class'}"
            if without
            else ""
        ),
        options.quiet,
    )
    return protocol.confusion(
        objects, classes, truth, scored, cloud=_cloud(options.cloud, scene, truth), within=options.within
    )


def _cloud(given: str, scene: SceneGraph, truth: LabelledCloud) -> NDArray[np.float32] | None:
    """The points that are labelled: None for the truth's own."""
    import numpy as np

    from cgdb.ingest.evaluation import labelled, ply

    if given == "truth":
        return None
    if given == "map":
        return np.concatenate([obj.points for obj in scene.objects if obj.points is not None and len(obj.points)])
    path = Path(given)
    if not path.is_file():
        raise UsageError(f"--cloud: there is no file {given}", hint="truth, map, or a .npz or .ply of points")
    if path.suffix == ".ply":
        vertex = ply.read(path).vertex
        points = np.stack([vertex[axis].astype(np.float64) for axis in "xyz"], axis=1)
    else:
        points = labelled.arrays_of(path).get("points", np.zeros(0))
    return labelled.points_of(points)


def _class_vectors(
    one: Chosen, scene: SceneGraph, truth: LabelledCloud, allowed: NDArray[np.bool_], options: Namespace
) -> tuple[str, NDArray[np.float32]]:
    """(the feature space, (k, d) vectors of the class texts in it; zero for classes that are not allowed)."""
    import numpy as np

    import cgdb
    from cgdb.cli import values
    from cgdb.meaning.encoders import Encoders
    from cgdb.meaning.vocabulary import Vocabulary
    from cgdb.storage.text_vectors import TextVectors

    spaces = {space.name: space for space in scene.spaces}
    name = options.space or ("clip" if "clip" in spaces else next(iter(spaces), None))
    if name not in spaces:
        raise UsageError(
            f"{one.name}: the scene has no feature space" + (f" '{options.space}'" if options.space else ""),
            hint=(did_you_mean(options.space or "", spaces) or f"it has {one_of(spaces)}") if spaces else "--by tag",
        )
    given = values.encoders(options.encoder)
    if not options.vocabulary and name not in given and truth.vectors is not None:
        return name, truth.vectors
    encoder: Encoder | CgdbError | None
    if options.vocabulary:
        encoder = Vocabulary.load(options.vocabulary)
    else:
        with cgdb.open(one.store, text_encoder=None) as db:
            encoder = Encoders(TextVectors(db.path / "texts.sqlite", read_only=True), spaces=given).space(spaces[name])
    if isinstance(encoder, CgdbError):
        raise encoder
    if encoder is None:
        raise UsageError(
            f"{one.name}: the map does not say which encoder made its features '{name}'",
            hint=f"--encoder {name}=open_clip:MODEL:WEIGHTS, --vocabulary FILE with the classes' vectors, or --by tag",
        )
    rows = np.flatnonzero(allowed)
    made = encoder.texts([options.template.replace("{c}", truth.names[row].replace("_", " ")) for row in rows.tolist()])
    vectors = np.zeros((len(allowed), made.shape[1]), np.float32)
    vectors[rows] = made
    return name, vectors


def _semseg_row(name: str, one: SegmentationScore) -> list[str]:
    figures = (one.macc, one.fmiou, one.miou, one.precision, one.f1)
    return [name[:20], *map(percent, figures), str(len(one.classes)), str(one.points), percent(one.unlabelled)]


def _semseg_means(scores: Sequence[SegmentationScore]) -> list[str]:
    columns = zip(*((s.macc, s.fmiou, s.miou, s.precision, s.f1) for s in scores), strict=True)
    return ["mean", *(percent(sum(column) / len(scores)) for column in columns), "", "", ""]


def _per_class(one: SegmentationScore) -> None:
    rows = [
        [c.name[:28], str(c.points), percent(c.recall), percent(c.precision), percent(c.iou), percent(c.f1)]
        for c in sorted(one.classes, key=lambda c: (-c.points, c.name))
    ]
    table("\nClasses, %", ("class", "points", "recall", "precision", "IoU", "F1"), rows)
    steps = ", ".join(f"{count} above {step:g}" for step, count in one.above.items())
    line(f"IoU of {len(one.classes)} classes: {steps}")


def _semseg_json(scores: Sequence[tuple[str, SegmentationScore]]) -> None:
    from cgdb.ingest.evaluation.semseg import to_json

    records = [{"scene": name, **to_json(one)} for name, one in scores]
    single = [one for name, one in scores if name != "all" or len(scores) == 1]
    write_json(
        {
            "scenes": records[: len(single)],
            "all": records[-1],
            "mean": {"mAcc": mean([s.macc for s in single]), "F-mIoU": mean([s.fmiou for s in single])},
        }
    )
