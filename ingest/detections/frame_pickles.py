"""Pickles of detections, read by the machine that calls nothing: masks are kept, and pictures pass as inert leftovers.

Maps hold masks that nobody wants, so the machine drops them; here they are what is wanted.
"""

from __future__ import annotations

import math
from typing import Any, BinaryIO

import numpy as np

from cgdb.errors import FormatError
from cgdb.ingest import pickled, pickles
from cgdb.ingest.pickled import Global, Inert, Pending

LARGEST_MASKS = 4 << 30
"""Bytes of the masks of one frame."""


def load(file: BinaryIO, *, size: int) -> Any:
    """The value of a pickle, masks included. size: bytes on disk. FormatError where it is damaged or hostile."""
    return _DetectionMachine(file, pickles.MOST_STEPS + pickles.STEPS_PER_BYTE * size).run()


class _DetectionMachine(pickles._Machine):
    def push_global(self, module: Any, name: Any) -> None:
        if isinstance(module, str) and isinstance(name, str):
            if module.startswith("PIL."):
                self.push(Global("PIL picture", lambda arguments: Inert("PIL picture")))
                return
            if name == "_reconstruct" and module in ("numpy.core.multiarray", "numpy._core.multiarray"):
                self.push(Global(f"{module}.{name}", _array))
                return
            if name == "_frombuffer" and module in ("numpy.core.numeric", "numpy._core.numeric"):
                self.push(Global(f"{module}.{name}", _from_buffer))
                return
        super().push_global(module, name)


def _array(arguments: tuple[Any, ...]) -> Any:
    made = pickled.find("numpy._core.multiarray", "_reconstruct").build
    assert made is not None
    other: Pending = made(arguments)

    def finish(state: Any) -> Any:
        if isinstance(state, tuple) and len(state) in (4, 5):
            shape, dtype, fortran, data = state[-4:]
            if _is_mask(dtype, shape):
                return _mask(data, shape, "F" if fortran is True else "C")
        return other.finish(state)

    return Pending(finish)


def _from_buffer(arguments: tuple[Any, ...]) -> Any:
    if len(arguments) == 4 and _is_mask(arguments[1], arguments[2]):
        return _mask(arguments[0], arguments[2], "F" if arguments[3] == "F" else "C")
    made = pickled.find("numpy._core.numeric", "_frombuffer").build
    assert made is not None
    return made(arguments)


def _is_mask(dtype: object, shape: object) -> bool:
    return isinstance(dtype, np.dtype) and dtype == np.bool_ and isinstance(shape, tuple) and len(shape) == 3


def _mask(data: Any, shape: tuple[Any, ...], order: Any) -> Any:
    if any(type(side) is not int or not 0 <= side <= 1 << 20 for side in shape):
        raise FormatError("the pickle holds masks of no possible size")
    content = pickled.raw(data)
    if len(content) != math.prod(shape) or len(content) > LARGEST_MASKS:
        raise FormatError(f"the pickle holds masks of shape {shape} in {len(content):,} bytes")
    # A byte that is neither 0 nor 1 would make a bool array that breaks numpy's rules.
    return np.frombuffer(content, np.uint8).reshape(shape, order=order) != 0
