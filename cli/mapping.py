"""``cgdb map``: a recording of posed RGB-D frames becomes a scene of a store, or goes on with one."""

from __future__ import annotations

from argparse import Namespace
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import cgdb
from cgdb.cli.importing import remove_if_empty
from cgdb.cli.mapping_run import Begun, Run
from cgdb.cli.values import file_name
from cgdb.errors import FormatError, UsageError, did_you_mean

if TYPE_CHECKING:
    from cgdb.ingest.detections.detections import Detector
    from cgdb.ingest.frames.recording import Recording
    from cgdb.ingest.mapping.checkpoint import Progress
    from cgdb.ingest.mapping.mapper import Mapping
    from cgdb.scene import SceneGraph


def map_recording(options: Namespace) -> int:
    """Map a recording into a store."""
    from cgdb.ingest.frames.recording import open_recording
    from cgdb.ingest.mapping.checkpoint import Progress
    from cgdb.ingest.mapping.mapper import Mapper

    if options.resume and options.extend:
        raise UsageError("--resume goes on with a recording, --extend maps another one: give one of them")
    how = _parameters(options)
    _check_encoder(options.encoder)
    recording = open_recording(
        options.sequence, layout=options.layout, lens=_intrinsics(options.intrinsics), depth_scale=options.depth_scale
    )
    detector = _detector(options, recording)
    _check_vocabulary(options, detector)
    name = options.name or Path(options.sequence).resolve().name[:256]
    now = Progress(
        start=options.start,
        stride=options.stride,
        size=_size(options.size),
        next=options.start,
        pose=_pose(options.pose),
    )
    key = str(Path(options.sequence).resolve())
    with _store(options) as db:
        state = db.path / "mapping" / f"{file_name(name)}.npz"
        if options.resume:
            begun = _resumed(db, name, state, how, key, now)
        elif options.extend:
            begun = _extended(db, name, state, how, key, now)
        else:
            _check_free(db, name, options)
            begun = Begun(Mapper(how), {key: now}, None, ())
        if not options.resume:
            begun.mapper.begin(Path(key).name)
        return Run(db, name, recording, detector, begun, state, key, options).run()


@contextmanager
def _store(options: Namespace) -> Iterator[cgdb.Database]:
    """The store to map into, made where there is none; one in which no map began is not left behind."""
    path = Path(options.into)
    fresh = not path.exists()
    try:
        with cgdb.open(path, create=True) as db:
            yield db
    except BaseException:
        # What was mapped before the first revision could be written is there to be gone on with.
        if fresh and not any(path.glob("mapping/*")):
            remove_if_empty(path)
        raise


def _detector(options: Namespace, recording: Recording) -> Detector:
    from cgdb.ingest.detections.files import find_detections
    from cgdb.ingest.detections.segment import GeometricDetector

    if options.detections == "geometry":
        return GeometricDetector(up=options.up or recording.up)
    if options.detections and options.detections.startswith("models:"):
        from cgdb.ingest.detections.models import chosen, load_detector

        return load_detector(chosen(options.detections.removeprefix("models:")))
    found = find_detections(
        Path(options.sequence),
        path=Path(options.detections) if options.detections else None,
        kind=options.detection_kind,
        encoder=options.encoder,
    )
    return found or GeometricDetector(up=options.up or recording.up)


def _parameters(options: Namespace) -> Mapping:
    from cgdb.ingest.mapping.fuse import VIEWS
    from cgdb.ingest.mapping.mapper import Mapping
    from cgdb.ingest.mapping.variants import PRESETS, varied

    if not 0.005 <= options.voxel <= 0.5:
        raise UsageError(f"--voxel is in metres, 0.005 to 0.5, not {options.voxel}")
    if options.stride < 1 or options.start < 0 or options.every < 0:
        raise UsageError("--stride must be at least 1, --start and --every at least 0")
    if not 0 <= options.ahead <= 64:
        raise UsageError("--ahead takes 0 to 64 frames")
    if options.min_detections < 1:
        raise UsageError("--min-detections must be at least 1")
    pictures = options.crops != "none"
    if pictures and not (options.crops.isascii() and options.crops.isdigit() and 1 <= int(options.crops[:9]) <= 50):
        raise UsageError(f"--crops takes a number from 1 to 50, or none, not '{options.crops[:40]}'")
    how = varied(Mapping(), PRESETS[options.preset])
    chosen = {name: getattr(options, name) for name in ("spatial", "semantic", "threshold", "bias")}
    given = {name: value for name, value in chosen.items() if value is not None}
    how = replace(
        how,
        voxel=options.voxel,
        views=int(options.crops) if pictures else VIEWS,
        crops=pictures,
        background=options.background,
        association=replace(how.association, **given),
        tidying=replace(how.tidying, least_detections=options.min_detections),
    )
    return varied(how, options.set or ())


def _resumed(db: cgdb.Database, name: str, state: Path, how: Mapping, key: str, now: Progress) -> Begun:
    """Where an interrupted run, or one that kept its state, left off."""
    from cgdb.ingest.mapping import checkpoint

    if not state.is_file():
        if _scene_so_far(db, name) is None:
            raise UsageError(f"{db.path}: there is no map '{name}' to go on with", hint="map it without --resume")
        raise UsageError(
            f"{db.path}: the map '{name}' is finished",
            hint="--extend maps another recording into it; --keep-state keeps what it takes to go on with this one",
        )
    mapper, done = checkpoint.load(state, how)
    before = done.get(key)
    if before is None:
        known = ", ".join(Path(one).name for one in done)
        raise UsageError(
            f"{key}: is not the recording that the map was begun with ({known})",
            hint="--extend maps another recording of the same place into the scene",
        )
    for what in ("start", "stride", "size", "pose"):
        if getattr(now, what) != getattr(before, what):
            raise UsageError(
                f"the map was begun with another --{what}: {_said(getattr(before, what))}, not "
                f"{_said(getattr(now, what))}",
                hint="resume with the same, or map the recording anew",
            )
    return Begun(mapper, done, _scene_so_far(db, name), ())


def _extended(db: cgdb.Database, name: str, state: Path, how: Mapping, key: str, now: Progress) -> Begun:
    """The map of a scene, from its state where that is kept, else from what the store holds of it."""
    from cgdb.ingest.mapping import checkpoint
    from cgdb.ingest.mapping.sessions import mapper_of

    before = _scene_so_far(db, name)
    if before is None:
        raise UsageError(f"{db.path}: there is no scene '{name}' to extend", hint="map it without --extend")
    note = ""
    if state.is_file():
        try:
            mapper, done = checkpoint.load(state, how)
        except (UsageError, FormatError) as error:
            note = f"note: {error.message}; going on from the scene in the store"
        else:
            if key in done and done[key].next > done[key].start:
                raise UsageError(f"{key}: is in the map already", hint="--resume goes on with the same recording")
            if mapper.frames == before.provenance.get("frames"):
                return Begun(mapper, {**done, key: now}, before, ())
            note = f"note: {state.name} is of another map; going on from the scene in the store"
    mapper = mapper_of(db.scene(name, views=True), how)
    return Begun(mapper, {key: now}, before, (note,) if note else ())


def _scene_so_far(db: cgdb.Database, name: str) -> SceneGraph | None:
    if all(info.name != name for info in db.scenes()):
        return None
    return db.scene(name, features=False, clouds=False)


def _said(value: Any) -> str:
    if value is None:
        return "none"
    if isinstance(value, tuple):
        return "x".join(str(side) for side in value) if len(value) == 2 else "another matrix"
    return str(value)


def _check_free(db: cgdb.Database, name: str, options: Namespace) -> None:
    """Before hours of mapping: whether its end could be written."""
    if options.on_existing == "error" and any(info.name == name for info in db.scenes()):
        raise UsageError(
            f"the store holds a scene '{name}' already",
            hint="--extend maps another recording into it, --resume goes on, --on-existing replace makes it anew",
        )


def _check_encoder(name: str | None) -> None:
    """Before hours of mapping: whether what the map will name is an encoder. It need not be installed here."""
    from cgdb.meaning.embed import ENCODERS

    if name is not None and (scheme := name.partition(":")[0]) not in ENCODERS:
        raise UsageError(
            f"--encoder: no encoder is known by the name '{name[:100]}'",
            hint=did_you_mean(scheme, ENCODERS) or "open_clip:MODEL:WEIGHTS, such as open_clip:ViT-B-32:openai",
        )


def _check_vocabulary(options: Namespace, detector: Detector) -> None:
    """Before hours of mapping: whether what is mapped could be named."""
    from cgdb.enrich.tags import open_vocabulary

    if options.vocabulary is None:
        return
    with_vectors, _ = open_vocabulary(options.vocabulary)
    if with_vectors is None and not (options.encoder or detector.encoder):
        raise UsageError(
            "--vocabulary compares names with features, and nothing says what made these",
            hint="--encoder open_clip:MODEL:WEIGHTS, or a vocabulary that holds vectors (.npz)",
        )


def _intrinsics(text: str | None) -> Any:
    from cgdb.ingest.frames import poses

    if text is None:
        return None
    values = poses.numbers(text, "--intrinsics")
    if len(values) != 4:
        raise UsageError("--intrinsics takes fx,fy,cx,cy in pixels")
    return poses.intrinsics(*values.tolist())


def _size(text: str | None) -> tuple[int, int] | None:
    if text is None:
        return None
    width, _, height = text.partition("x")
    sides = [int(side) for side in (width, height) if side.isdigit()]
    if len(sides) != 2 or not all(16 <= side <= 8192 for side in sides):
        raise UsageError(f"--size takes WIDTHxHEIGHT in pixels, such as 640x480, not '{text[:40]}'")
    return sides[0], sides[1]


def _pose(path: str | None) -> tuple[float, ...] | None:
    """The sixteen numbers of T_map_recording, row by row."""
    from cgdb.ingest.frames import poses

    if path is None:
        return None
    pose = poses.matrix(poses.numbers(poses.text_of(Path(path)), path), path)
    wrong = poses.fault(pose)
    if wrong is not None:
        raise FormatError(f"{path}: {wrong}", hint="--pose takes 4 x 4 numbers that turn and move, and nothing else")
    return tuple(poses.settled(pose).reshape(-1).tolist())
