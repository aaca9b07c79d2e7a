"""Reading and detecting ahead: while a frame is mapped, the next ones are decoded and their detections found.

One thread each, in order, over queues of a few frames: the map is the same as without, and memory is bounded. Decoding
and most of numpy let other threads run meanwhile.
"""

from __future__ import annotations

import queue
import threading
from collections.abc import Generator, Iterable, Iterator
from contextlib import closing
from dataclasses import dataclass
from typing import TypeVar

from cgdb.errors import FormatError
from cgdb.ingest.detections.detections import Detections, Detector
from cgdb.ingest.frames.recording import Frame

T = TypeVar("T")
_PATIENCE = 0.1
"""Seconds after which a thread looks whether anybody still wants what it makes."""


@dataclass(frozen=True, slots=True)
class _Failed:
    error: BaseException


class _Done:
    pass


def detected(
    frames: Iterable[Frame], detector: Detector, ahead: int
) -> Generator[tuple[Frame, Detections | FormatError], None, None]:
    """Each frame with its detections, or with why it has none. ahead: frames that are worked on before they are asked
    for; 0 does all in the caller's thread."""
    if not ahead:
        yield from _with_detections(frames, detector)
        return
    with (
        closing(in_thread(iter(frames), ahead)) as read,
        closing(in_thread(_with_detections(read, detector), ahead)) as both,
    ):
        yield from both


def _with_detections(frames: Iterable[Frame], detector: Detector) -> Iterator[tuple[Frame, Detections | FormatError]]:
    for frame in frames:
        try:
            found: Detections | FormatError = detector(frame)
        except FormatError as error:
            found = error
        yield frame, found


def in_thread(source: Iterator[T], ahead: int) -> Generator[T, None, None]:
    """What source gives, in order, made in a thread up to `ahead` items before it is asked for; its errors are raised
    here. Closing this ends the thread."""
    made: queue.Queue[T | _Failed | _Done] = queue.Queue(ahead)
    unwanted = threading.Event()

    def put(item: T | _Failed | _Done) -> None:
        while not unwanted.is_set():
            try:
                made.put(item, timeout=_PATIENCE)
            except queue.Full:
                continue
            return

    def work() -> None:
        try:
            for item in source:
                put(item)
                if unwanted.is_set():
                    return
            put(_Done())
        except BaseException as error:  # noqa: BLE001 - raised again where the items are taken
            put(_Failed(error))

    thread = threading.Thread(target=work, name="cgdb reading ahead", daemon=True)
    thread.start()
    try:
        while True:
            item = made.get()
            if isinstance(item, _Done):
                return
            if isinstance(item, _Failed):
                raise item.error
            yield item
    finally:
        unwanted.set()
        thread.join()
