"""A map in the making, on disk: so that an interrupted one goes on, and a place can be mapped further another day."""

from __future__ import annotations

import json
import os
from dataclasses import asdict, dataclass, fields
from pathlib import Path
from typing import Any

import numpy as np

from cgdb.errors import FormatError, StoreError, UsageError
from cgdb.ingest.mapping.mapper import Mapper, Mapping, Session
from cgdb.ingest.mapping.presence import Presence
from cgdb.ingest.mapping.voxels import COLUMNS, SLOTS

VERSION = 5


@dataclass(frozen=True, slots=True, kw_only=True)
class Progress:
    """How far a recording is mapped: frames start, start + stride, ... before `next`, at (width, height) if any.

    pose: T_map_recording, 16 numbers row by row; None where the recording is in the map's coordinates.
    """

    start: int
    stride: int
    size: tuple[int, int] | None
    next: int
    pose: tuple[float, ...] | None = None


def save(mapper: Mapper, path: Path, done: dict[str, Progress]) -> None:
    """Write a mapper's state, whole or not at all. done: {recording: what of it is in}."""
    state = {
        "version": VERSION,
        "parameters": mapper.how.as_record(),
        "frames": mapper.frames,
        "detections": mapper.detections,
        "newest": mapper.newest,
        "cared": mapper.cared,
        "sessions": [[session.recording, session.first] for session in mapper.sessions],
        "opinions": mapper.opinions.to_record(),
        "done": {recording: asdict(progress) for recording, progress in done.items()},
        "objects": mapper.objects.to_record(),
    }
    path.parent.mkdir(parents=True, exist_ok=True)
    half = path.with_suffix(".half")
    arrays: dict[str, Any] = {name: getattr(mapper.voxels, name)[: mapper.voxels.count] for name in COLUMNS}
    arrays["free"] = mapper.voxels.free
    arrays.update({f"space:{name}": sums for name, sums in mapper.objects.features.sums().items()})
    arrays.update(mapper.objects.sights())
    if mapper.presence is not None:
        arrays.update({f"presence:{part.name}": getattr(mapper.presence, part.name) for part in fields(Presence)})
    try:
        with half.open("wb") as file:
            np.savez(file, state=np.frombuffer(json.dumps(state).encode(), np.uint8), **arrays)
            file.flush()
            os.fsync(file.fileno())
        half.replace(path)
    except OSError as error:
        half.unlink(missing_ok=True)
        raise StoreError(f"{path}: the state of the mapping cannot be written: {error.strerror or error}") from error


def load(path: Path, how: Mapping) -> tuple[Mapper, dict[str, Progress]]:
    """The mapper of a file and what it has seen; UsageError where it was made with other parameters."""
    try:
        with path.open("rb") as file, np.load(file, allow_pickle=False) as held:
            arrays = {name: held[name] for name in held.files}
        state = json.loads(arrays.pop("state").tobytes())
        version = state["version"]
    except Exception as error:
        if isinstance(error, (KeyboardInterrupt, MemoryError)):
            raise
        raise FormatError(
            f"{path}: the state of the mapping cannot be read ({type(error).__name__})",
            hint="map the recording anew, without --resume",
        ) from error
    if version != VERSION or state["parameters"] != json.loads(json.dumps(how.as_record())):
        raise UsageError(
            f"{path}: the map was begun with other parameters", hint="resume with the same, or map it anew"
        )
    mapper = Mapper(how)
    try:
        _fill(mapper, state, arrays)
        return mapper, {str(name): _progress(value) for name, value in state["done"].items()}
    except (KeyError, TypeError, ValueError, IndexError, AttributeError) as error:
        raise FormatError(f"{path}: the state of the mapping is damaged", hint="map the recording anew") from error


def _progress(value: dict[str, Any]) -> Progress:
    size = value["size"]
    return Progress(
        start=int(value["start"]),
        stride=int(value["stride"]),
        size=None if size is None else (int(size[0]), int(size[1])),
        next=int(value["next"]),
        pose=None if value["pose"] is None else tuple(float(number) for number in value["pose"]),
    )


def _fill(mapper: Mapper, state: dict[str, Any], arrays: dict[str, Any]) -> None:
    columns = {name: arrays[name] for name in COLUMNS}
    n = len(columns["cells"])
    if any(len(values) != n for values in columns.values()) or columns["owners"].shape != (n, SLOTS):
        raise ValueError
    known = [-1, *(one["id"] for one in state["objects"]["all"])]
    if not np.isin(columns["owners"], known).all():
        raise ValueError
    mapper.voxels.fill(columns, arrays["free"])
    mapper.objects.fill(
        state["objects"], {name[6:]: values for name, values in arrays.items() if name.startswith("space:")}, arrays
    )
    mapper.frames, mapper.detections = int(state["frames"]), int(state["detections"])
    mapper.newest, mapper.cared = int(state["newest"]), int(state["cared"])
    mapper.opinions.fill(state["opinions"], mapper.objects)
    mapper.sessions = [Session(str(recording), int(first)) for recording, first in state["sessions"]]
    if "presence:points" in arrays:
        mapper.presence = Presence(**{part.name: arrays[f"presence:{part.name}"] for part in fields(Presence)})
