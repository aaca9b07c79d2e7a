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
    return pickles.load(file, size=size, find=_find)


def _find(module: str, name: str) -> Global:
    """What a map's pickle may have, with pictures let pass and arrays that may be masks."""
    if module.startswith("PIL."):
        return Global("PIL picture", lambda arguments: Inert("PIL picture"))
    build = _ARRAYS.get((module, name))
    return pickled.find(module, name) if build is None else Global(f"{module}.{name}", build)


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


_ARRAYS = {
    **{(f"numpy.{core}.multiarray", "_reconstruct"): _array for core in ("core", "_core")},
    **{(f"numpy.{core}.numeric", "_frombuffer"): _from_buffer for core in ("core", "_core")},
}
"""How numpy's pickles make arrays, in its old and new modules."""
