"""One run of ``cgdb map``: frames in, revisions out, and the state from which to go on."""

from __future__ import annotations

import signal
import time
from argparse import Namespace
from collections import Counter
from collections.abc import Iterator
from contextlib import closing, contextmanager
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

import cgdb
from cgdb.cli import render
from cgdb.cli.progress import progress_bar
from cgdb.errors import FormatError
from cgdb.scene import SceneGraph

if TYPE_CHECKING:
    from cgdb.ingest.detections.detections import Detections, Detector
    from cgdb.ingest.frames.recording import Frame, Recording
    from cgdb.ingest.mapping.checkpoint import Progress
    from cgdb.ingest.mapping.mapper import Mapper
    from cgdb.ingest.mapping.sessions import Names
    from cgdb.scene import ObjectId
    from cgdb.storage.ledger import OnExisting


@dataclass(frozen=True, slots=True)
class Begun:
    """What a run starts with. done: {recording: its progress}, this one's included; before: the scene in the store
    that is gone on with."""

    mapper: Mapper
    done: dict[str, Progress]
    before: SceneGraph | None
    notes: tuple[str, ...]


class Run:
    """A recording on its way into a scene."""

    def __init__(
        self,
        db: cgdb.Database,
        name: str,
        recording: Recording,
        detector: Detector,
        begun: Begun,
        state: Path,
        key: str,
        options: Namespace,
    ) -> None:
        self.db, self.name, self.recording, self.detector = db, name, recording, detector
        self.mapper, self.done, self.before = begun.mapper, begun.done, begun.before
        self.state, self.key, self.options, self.notes = state, key, options, begun.notes
        self.written = begun.before is not None
        self.named: dict[ObjectId, Names] = {}
        """What the map called its objects, others aside, in the revision that this run wrote last."""
        self.bad: Counter[str] = Counter()

    def run(self) -> int:
        """Map the frames that are not in yet; the exit code."""
        from cgdb.ingest.mapping.ahead import detected

        options, recording = self.options, self.recording
        start = self.done[self.key].next
        chosen = range(len(recording.shots))[start : options.end : options.stride]
        began, mapped = time.perf_counter(), 0
        with progress_bar(options.quiet) as progress, asked_to_stop() as stop:
            if not options.quiet:
                head = f"{options.sequence} ({recording.layout}): {len(chosen)} frames; {self.detector.name}"
                for line in (head, *self.notes):
                    progress.console.print(line, markup=False, soft_wrap=True)
            task = progress.add_task(f"mapping {self.name}", total=len(chosen))
            resumed_at_end = options.resume and not chosen
            frames = () if resumed_at_end else self._frames(start)
            with closing(detected(frames, self.detector, options.ahead)) as pairs:
                for frame, found in pairs:
                    mapped += self._step(frame, found)
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
        if options.vocabulary is not None and not stop:
            self._tag(options.vocabulary)
        if stop:
            self._say(f"interrupted after {mapped} frames; what was mapped is in the store, --resume goes on")
            return 130
        return 0

    def _tag(self, vocabulary: str) -> None:
        """Give what was mapped names, as a revision of its own."""
        from cgdb.cli.tagging import tag_scenes, told

        for tags in tag_scenes(self.db, vocabulary, scenes=[self.name], quiet=self.options.quiet):
            if not self.options.quiet:
                self._say(told(tags))
        self.db.prepare(self.name)

    def _frames(self, start: int) -> Iterator[Frame]:
        """The frames from start on, in the map's coordinates."""
        progress, options = self.done[self.key], self.options
        frames = self.recording.frames(start=start, end=options.end, stride=options.stride, size=progress.size)
        if progress.pose is None:
            yield from frames
            return
        moved = np.array(progress.pose).reshape(4, 4)
        for frame in frames:
            yield replace(frame, T_world_camera=moved @ frame.T_world_camera)

    def _step(self, frame: Frame, found: Detections | FormatError) -> bool:
        """Whether the frame could be mapped."""
        self.done[self.key] = replace(self.done[self.key], next=frame.index + self.options.stride)
        try:
            if isinstance(found, FormatError):
                raise found
            self.mapper.step(frame, found)
        except FormatError as error:
            self.bad[error.message.partition(": ")[2] or error.message] += 1
            return False
        return True

    def write(self, *, last: bool = False) -> tuple[SceneGraph, int | None]:
        """The map so far as a revision, and the state from which to go on beside it."""
        from cgdb.ingest.mapping import checkpoint
        from cgdb.ingest.mapping.sessions import carried, names_of
        from cgdb.ingest.relations.relate import with_geometry

        if not last or self.options.keep_state:
            # The state of before the last care: more frames can be mapped from it as if nothing had been.
            checkpoint.save(self.mapper, self.state, self.done)
        if last:
            self.mapper.finish()
        before = self.before
        encoders = [] if before is None else [space.encoder for space in before.spaces if space.encoder]
        scene = self.mapper.scene(
            self.name,
            up=self.options.up or (self.recording.up if before is None else before.up),
            encoder=self.options.encoder or self.detector.encoder or next(iter(encoders), None),
            provenance=self._provenance(),
        )
        named = {obj.id: names_of(obj) for obj in scene.objects}
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
            if self.written:
                # Read while nobody else can write: what was said of the map's objects until now stays.
                scene = carried(scene, self._stored(), self.named)
            if not self.options.no_relate:
                scene = with_geometry(scene)
            writer.places(scene.places)
            writer.objects(scene.objects)
            writer.relations(scene.relations)
        self.written, self.named = True, named
        if last and not self.options.keep_state:
            self.state.unlink(missing_ok=True)
        return scene, writer.revision

    def _stored(self) -> SceneGraph:
        """The scene in the store, without clouds; an empty one where somebody has removed it."""
        if all(info.name != self.name for info in self.db.scenes()):
            return SceneGraph(name=self.name)
        return self.db.scene(self.name, features=False, clouds=False)

    def _provenance(self) -> dict[str, Any]:
        recording = self.recording
        return {
            "recording": Path(self.options.sequence).name,
            "layout": recording.layout,
            "notes": list(recording.notes),
            "intrinsics": recording.K.tolist(),
            "depth_scale": recording.depth_scale,
            "range": [self.options.start, self.options.end, self.options.stride],
            "T_map_recording": self.done[self.key].pose,
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
        if not scene.objects:
            self._say(
                f"note: no object was seen in {self.options.min_detections} frames; "
                "--min-detections 1 takes all there is"
            )
        what = "nothing new" if revision is None else f"revision {revision}"
        self._say(
            f"{self.options.sequence}: scene '{self.name}', {mapped} frames, {len(scene.objects)} objects, "
            f"{len(scene.relations)} relations, {what}, {seconds:.1f} s"
        )

    @staticmethod
    def _say(line: str) -> None:
        render.console(stderr=True).print(render.clean(line), markup=False, soft_wrap=True)


@contextmanager
def asked_to_stop() -> Iterator[list[int]]:
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
