"""``cgdb map``: a recording of posed RGB-D frames becomes a scene of a store, revision by revision."""

from __future__ import annotations

import signal
import time
from argparse import Namespace
from collections import Counter
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

import cgdb
from cgdb.cli import render
from cgdb.cli.importing import _progress
from cgdb.errors import FormatError, UsageError

if TYPE_CHECKING:
    from cgdb.database import OnExisting
    from cgdb.ingest.detections.detections import Detector
    from cgdb.ingest.frames.recording import Recording
    from cgdb.ingest.mapping.mapper import Mapper, Mapping
    from cgdb.scene import SceneGraph


def map_recording(options: Namespace) -> int:
    """Map a recording into a store."""
    from cgdb.ingest.frames.recording import open_recording
    from cgdb.ingest.mapping.mapper import Mapper

    how = _parameters(options)
    recording = open_recording(
        options.sequence, layout=options.layout, lens=_intrinsics(options.intrinsics), depth_scale=options.depth_scale
    )
    detector = _detector(options, recording)
    name = options.name or Path(options.sequence).resolve().name[:256]
    size = _size(options.size)
    with cgdb.open(options.into, create=True) as db:
        state = db.path / "mapping" / f"{_file_name(name)}.npz"
        if not options.resume:
            _check_free(db, name, options)
        mapper, done = _begin(state, how, options) if options.resume else (Mapper(how), {})
        key = str(Path(options.sequence).resolve())
        job = _Job(db, name, recording, detector, mapper, state, done, key, options)
        return job.run(options.start + options.stride * done.get(key, 0), size)


class _Job:
    """One run of the command: frames in, revisions out."""

    def __init__(
        self,
        db: cgdb.Database,
        name: str,
        recording: Recording,
        detector: Detector,
        mapper: Mapper,
        state: Path,
        done: dict[str, int],
        key: str,
        options: Namespace,
    ) -> None:
        self.db, self.name, self.recording, self.detector = db, name, recording, detector
        self.mapper, self.state, self.done, self.key, self.options = mapper, state, done, key, options
        self.written = options.resume
        self.bad: Counter[str] = Counter()

    def run(self, start: int, size: tuple[int, int] | None) -> int:
        """Map the frames from start on; the exit code."""
        options, recording = self.options, self.recording
        chosen = range(len(recording.shots))[start : options.end : options.stride]
        began, mapped = time.perf_counter(), 0
        with _progress(options.quiet) as progress, _asked_to_stop() as stop:
            say = progress.console.print
            if not options.quiet:
                say(
                    f"{options.sequence} ({recording.layout}): {len(chosen)} frames; {self.detector.name}",
                    markup=False,
                    soft_wrap=True,
                )
            task = progress.add_task(f"mapping {self.name}", total=len(chosen))
            resumed_at_end = options.resume and not chosen
            frames = (
                ()
                if resumed_at_end
                else recording.frames(start=start, end=options.end, stride=options.stride, size=size)
            )
            for frame in frames:
                try:
                    self.mapper.step(frame, self.detector(frame))
                    mapped += 1
                except FormatError as error:
                    self.bad[error.message.partition(": ")[2] or error.message] += 1
                self.done[self.key] = (frame.index - options.start) // options.stride + 1
                progress.update(
                    task,
                    completed=(frame.index - start) // options.stride + 1,
                    description=f"mapping {self.name}: {len(self.mapper.objects)} objects",
                )
                if stop:
                    break
                if options.every and mapped and mapped % options.every == 0 and frame.index < chosen[-1]:
                    self.write()
            if not mapped and not resumed_at_end and not stop:
                reason, count = (self.bad + recording.skipped).most_common(1)[0]
                raise FormatError(f"{options.sequence}: no frame could be mapped; {count}: {reason}")
            progress.update(task, description=f"writing {self.name}")
            scene, revision = self.write(last=not stop)
            self.db.prepare(self.name)
        self._report(scene, revision, mapped, time.perf_counter() - began)
        if stop:
            self._say(f"interrupted after {mapped} frames; what was mapped is in the store, --resume goes on")
            return 130
        return 0

    def write(self, *, last: bool = False) -> tuple[SceneGraph, int | None]:
        """The map so far as a revision, and the state from which to go on beside it."""
        from cgdb.ingest.mapping import checkpoint
        from cgdb.ingest.relations.relate import with_geometry

        if not last or self.options.keep_state:
            # The state of before the last care: more frames can be mapped from it as if nothing had been.
            checkpoint.save(self.mapper, self.state, self.done)
        if last:
            self.mapper.finish()
        scene = self.mapper.scene(
            self.name,
            up=self.options.up or self.recording.up,
            encoder=self.options.encoder or self.detector.encoder,
            provenance=self._provenance(),
        )
        if not self.options.no_relate:
            scene = with_geometry(scene)
        # The first revision obeys the rule for scenes that are there; the later ones are of this map's own scene.
        existing: OnExisting = "replace" if self.written else self.options.on_existing
        with self.db.write(
            self.name,
            kind="map",
            message=f"map {Path(self.options.sequence).name}, {self.mapper.frames} frames",
            on_existing=existing,
            frame=scene.frame,
            up=scene.up,
            spaces=scene.spaces,
            provenance=scene.provenance,
        ) as writer:
            writer.objects(scene.objects)
            writer.relations(scene.relations)
        self.written = True
        if last and not self.options.keep_state:
            self.state.unlink(missing_ok=True)
        return scene, writer.revision

    def _provenance(self) -> dict[str, Any]:
        recording = self.recording
        return {
            "recording": Path(self.options.sequence).name,
            "layout": recording.layout,
            "notes": list(recording.notes),
            "intrinsics": recording.K.tolist(),
            "depth_scale": recording.depth_scale,
            "range": [self.options.start, self.options.end, self.options.stride],
            "detector": self.detector.name,
            "skipped": dict(self.bad + recording.skipped),
        }

    def _report(self, scene: SceneGraph, revision: int | None, mapped: int, seconds: float) -> None:
        if self.options.quiet:
            return
        for reason, count in (self.bad + self.recording.skipped).most_common(5):
            self._say(f"note: {count} frames left out: {reason}")
        for doubt, count in self.recording.doubts.most_common(3):
            self._say(f"note: {doubt}" + (f" ({count} frames)" if count > 1 else ""))
        what = "nothing new" if revision is None else f"revision {revision}"
        self._say(
            f"{self.options.sequence}: scene '{self.name}', {mapped} frames, {len(scene.objects)} objects, "
            f"{len(scene.relations)} relations, {what}, {seconds:.1f} s"
        )

    @staticmethod
    def _say(line: str) -> None:
        render.console(stderr=True).print(render.clean(line), markup=False, soft_wrap=True)


@contextmanager
def _asked_to_stop() -> Iterator[list[int]]:
    """A list that is no longer empty once Ctrl-C was pressed; pressed again, it interrupts at once."""
    asked: list[int] = []

    def ask(number: int, _frame: object) -> None:
        asked.append(number)
        signal.signal(signal.SIGINT, before)

    try:
        before = signal.signal(signal.SIGINT, ask)
    except ValueError:  # not the main thread: there is nobody to press Ctrl-C
        yield asked
        return
    try:
        yield asked
    finally:
        signal.signal(signal.SIGINT, before)


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
    from cgdb.ingest.mapping.associate import Association
    from cgdb.ingest.mapping.fuse import VIEWS
    from cgdb.ingest.mapping.mapper import Mapping
    from cgdb.ingest.mapping.tidy import Tidying

    if not 0.005 <= options.voxel <= 0.5:
        raise UsageError(f"--voxel is in metres, 0.005 to 0.5, not {options.voxel}")
    if options.stride < 1 or options.start < 0 or options.every < 0:
        raise UsageError("--stride must be at least 1, --start and --every at least 0")
    if options.min_detections < 1:
        raise UsageError("--min-detections must be at least 1")
    pictures = options.crops != "none"
    if pictures and not (options.crops.isascii() and options.crops.isdigit() and 1 <= int(options.crops[:9]) <= 50):
        raise UsageError(f"--crops takes a number from 1 to 50, or none, not '{options.crops[:40]}'")
    return Mapping(
        voxel=options.voxel,
        views=int(options.crops) if pictures else VIEWS,
        crops=pictures,
        background=options.background,
        association=Association(
            spatial=options.spatial, semantic=options.semantic, threshold=options.threshold, bias=options.bias
        ),
        tidying=Tidying(least_detections=options.min_detections),
    )


def _begin(state: Path, how: Mapping, options: Namespace) -> tuple[Mapper, dict[str, int]]:
    from cgdb.ingest.mapping import checkpoint

    if not state.is_file():
        raise UsageError(
            f"{options.into}: there is no map of that name to go on with",
            hint="a finished one can be gone on with where it was made with --keep-state",
        )
    return checkpoint.load(state, how)


def _check_free(db: cgdb.Database, name: str, options: Namespace) -> None:
    """Before hours of mapping: whether its end could be written."""
    if options.on_existing == "error" and any(info.name == name for info in db.scenes()):
        raise UsageError(
            f"the store holds a scene '{name}' already",
            hint="--resume goes on with it where its state was kept, --on-existing replace makes it anew",
        )


def _file_name(name: str) -> str:
    """A scene's name as a file's: letters and digits stay, everything else is its number."""
    return "".join(c if c.isalnum() and c.isascii() else f"_{ord(c):x}" for c in name)[:150]


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
