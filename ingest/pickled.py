"""What a pickle of a map may ask for, and what it gets: arrays, plain containers, paths as text, and inert leftovers.

Nothing here is looked up by name in an importable module. A pickle names a thing, the table below has a function for
it or has not, and none of these functions runs code, opens a file or takes memory that the pickle did not pay for in
bytes.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from cgdb.errors import FormatError

LARGEST_SIDE = 2**40
MOST_SIDES = 8

LONGEST_PATH = 4096

_NUMERIC = re.compile(r"[<>|=]?(?:b1|[iu][1248]|f[248]|\?)")
_TEXTUAL = re.compile(r"[<>|=]?[SU]\d{1,6}")


@dataclass(frozen=True, slots=True)
class Global:
    """A name that a pickle asked for and may have. build makes a value of its arguments; None: it is never called."""

    name: str
    build: Callable[[tuple[Any, ...]], Any] | None = None


class Inert:
    """What is left of an object of a package that is not imported here: its name, and nothing that acts."""

    __slots__ = ("name",)

    def __init__(self, name: str) -> None:
        self.name = name

    def __repr__(self) -> str:
        return f"<inert {self.name}>"


class Blob:
    """Bytes of a pickle on their way into an array; let go when the array is one that nobody wants."""

    __slots__ = ("data",)

    def __init__(self, data: bytes) -> None:
        self.data: bytes | None = data


class Pending:
    """An object between its creation and its state. The machine puts what finish gives in its place, memo included."""

    __slots__ = ("_finish", "slots")

    def __init__(self, finish: Callable[[Any], Any]) -> None:
        self._finish = finish
        self.slots: list[int] = []

    def finish(self, state: Any) -> Any:
        """The value, now that its state is known."""
        return self._finish(state)


def find(module: str, name: str) -> Global:
    """The global of that name; FormatError, which names it, for everything that is not on the list."""
    asked = f"{module}.{name}"
    if module.partition(".")[0] in INERT_PACKAGES:
        return Global(asked, lambda arguments: Inert(asked))
    known = ALLOWED.get((module, name))
    if known is None and (module, name) not in TOKENS:
        shown = asked if asked.isprintable() and len(asked) <= 100 else repr(asked[:100])
        raise FormatError(
            f"refused: the pickle asks for {shown}",
            hint="a map needs arrays and plain values only; whoever made this file wants code to run",
        )
    return Global(asked, known)


def raw(value: Any) -> bytes:
    """The bytes of a value that must be bytes."""
    if isinstance(value, Blob):
        if value.data is None:
            raise FormatError("the pickle uses the bytes of one array twice")
        return value.data
    if isinstance(value, (bytes, bytearray)):
        return bytes(value)
    raise FormatError("the pickle builds an array of something other than bytes")


def _dtype(arguments: tuple[Any, ...]) -> Pending:
    code = arguments[0] if arguments else None
    if not isinstance(code, str) or not (_NUMERIC.fullmatch(code) or _TEXTUAL.fullmatch(code) or code in ("O", "O8")):
        raise FormatError(
            f"refused: the pickle asks for an array of type {str(code)[:20]!r}"
            if isinstance(code, str)
            else "refused: the pickle asks for an array of a type without a name"
        )
    made = np.dtype(code)

    def finish(state: Any) -> np.dtype[Any]:
        if not isinstance(state, tuple) or len(state) < 5 or any(part is not None for part in state[2:5]):
            raise FormatError("refused: the pickle asks for an array of records")
        match state[1]:
            case "<":
                return made.newbyteorder("<")
            case ">":
                return made.newbyteorder(">")
        return made

    return Pending(finish)


def _new_array(arguments: tuple[Any, ...]) -> Pending:
    """numpy's two steps: an empty array now (which is not made), shape, type and bytes later."""
    if not arguments or not isinstance(arguments[0], Global) or arguments[0].name != "numpy.ndarray":
        raise FormatError("refused: the pickle asks for an array of a class of its own")

    def finish(state: Any) -> Any:
        if not isinstance(state, tuple) or len(state) not in (4, 5):
            raise FormatError("the pickle holds an array without a shape")
        shape, dtype, fortran, data = state[-4:]
        return _array(data, dtype, shape, "F" if fortran is True else "C")

    return Pending(finish)


def _from_buffer(arguments: tuple[Any, ...]) -> Any:
    """numpy's one step of protocol 5: (bytes, type, shape, order)."""
    if len(arguments) != 4:
        raise FormatError("the pickle holds an array without a shape")
    data, dtype, shape, order = arguments
    return _array(data, dtype, shape, "F" if order == "F" else "C")


def _array(data: Any, dtype: Any, shape: Any, order: Any) -> NDArray[Any] | None:
    """The array, a view of its bytes, or None for a mask. The size is checked against the bytes before it is made."""
    if not isinstance(dtype, np.dtype) or not isinstance(shape, tuple) or len(shape) > MOST_SIDES:
        raise FormatError("the pickle holds an array without a type or shape")
    if any(type(side) is not int or not 0 <= side < LARGEST_SIDE for side in shape):
        raise FormatError("the pickle holds an array with a side that is no length")
    size = math.prod(shape)
    if dtype.hasobject:
        if not isinstance(data, list) or len(data) != size:
            raise FormatError("the pickle holds an array of objects without its objects")
        if not all(item is None or isinstance(item, (str, int, float)) for item in data):
            raise FormatError("refused: the pickle holds an array of objects that are no plain values")
        made = np.empty(size, dtype=object)
        made[:] = data
        return made.reshape(shape, order=order)
    content = raw(data)
    if len(content) != size * dtype.itemsize:
        raise FormatError(
            f"the pickle holds an array of shape {shape} that needs {size * dtype.itemsize:,} bytes, "
            f"but it has {len(content):,}"
        )
    if dtype == np.bool_ and len(shape) > 1:
        # A mask: most of a map's bytes, and nothing that a scene graph holds.
        if isinstance(data, Blob):
            data.data = None
        return None
    if size == 0:
        return np.empty(shape, dtype=dtype)
    return np.frombuffer(content, dtype=dtype).reshape(shape, order=order)


def _scalar(arguments: tuple[Any, ...]) -> Any:
    if len(arguments) != 2 or not isinstance(arguments[0], np.dtype) or arguments[0].kind not in "biuf":
        raise FormatError("refused: the pickle holds a number of no known type")
    dtype, data = arguments
    content = data.encode("latin-1") if isinstance(data, str) else raw(data)
    if len(content) != dtype.itemsize or not content:
        raise FormatError("the pickle holds a number with too few or too many bytes")
    return np.frombuffer(content, dtype=dtype)[0].item()


def _mapping(arguments: tuple[Any, ...]) -> dict[Any, Any]:
    """dict(), OrderedDict(), defaultdict(factory): empty; the items follow. The factory is forgotten."""
    pairs = arguments[0] if arguments and isinstance(arguments[0], list) else []
    if not all(isinstance(pair, (tuple, list)) and len(pair) == 2 for pair in pairs):
        raise FormatError("the pickle holds a mapping that is made of no pairs")
    return {key(pair[0]): pair[1] for pair in pairs}


def key(value: Any) -> Any:
    """A value that may be the key of a mapping: hashing nested tuples could take for ever."""
    if value is None or isinstance(value, (str, int, float, bytes)):
        return value
    if isinstance(value, tuple) and all(item is None or isinstance(item, (str, int, float)) for item in value):
        return value
    raise FormatError("the pickle holds a mapping or set whose key is no plain value")


def _collection(kind: Callable[[list[Any]], Any]) -> Callable[[tuple[Any, ...]], Any]:
    def build(arguments: tuple[Any, ...]) -> Any:
        items = arguments[0] if arguments else []
        if not isinstance(items, (list, tuple)):
            raise FormatError("the pickle holds a collection that is made of no list")
        return kind([key(item) for item in items])

    return build


def _path(arguments: tuple[Any, ...]) -> str:
    """A path as text. Paths are short; parts that are not would multiply what the pickle paid for once."""
    if not all(isinstance(part, str) for part in arguments) or sum(map(len, arguments)) > LONGEST_PATH:
        raise FormatError("the pickle holds a path that is none")
    return "/".join(arguments).replace("//", "/", 1)


def _uuid(arguments: tuple[Any, ...]) -> Pending:
    def finish(state: Any) -> str:
        number = state.get("int") if isinstance(state, dict) else None
        if type(number) is not int or not 0 <= number < 2**128:
            raise FormatError("the pickle holds a UUID that is no 128-bit number")
        text = f"{number:032x}"
        return "-".join((text[:8], text[8:12], text[12:16], text[16:20], text[20:]))

    return Pending(finish)


def _no_bytes(arguments: tuple[Any, ...]) -> bytes:
    """bytes() is how protocols below 3 write no bytes; with arguments it would make as many as it likes."""
    if arguments:
        raise FormatError("refused: the pickle calls bytes with arguments")
    return b""


def _encode(arguments: tuple[Any, ...]) -> bytes:
    """How protocols below 3 write bytes: text in which each character is a byte."""
    match arguments:
        case (str() as text, "latin1" | "latin-1"):
            try:
                return text.encode("latin-1")
            except UnicodeEncodeError as error:
                raise FormatError("the pickle holds bytes that are no bytes") from error
    raise FormatError("refused: the pickle asks for _codecs.encode other than for bytes")


INERT_PACKAGES = frozenset({"omegaconf", "torch", "typing"})
"""Packages whose objects lie about in map files. None of them is imported; what they made becomes Inert."""

TOKENS = {
    ("numpy", "ndarray"),
    *((module, name) for module in ("builtins", "__builtin__") for name in ("int", "float", "str", "bool")),
    *((module, name) for module in ("builtins", "__builtin__") for name in ("object", "tuple", "complex")),
}
"""Names that may be mentioned but not called."""

ALLOWED: dict[tuple[str, str], Callable[[tuple[Any, ...]], Any]] = {
    ("numpy", "dtype"): _dtype,
    ("collections", "OrderedDict"): _mapping,
    ("collections", "defaultdict"): lambda arguments: {},
    ("uuid", "UUID"): _uuid,
    ("uuid", "SafeUUID"): lambda arguments: Inert("uuid.SafeUUID"),
    ("_codecs", "encode"): _encode,
    **{
        (f"numpy.{core}.multiarray", name): build
        for core in ("core", "_core")
        for name, build in (("_reconstruct", _new_array), ("scalar", _scalar))
    },
    **{(f"numpy.{core}.numeric", "_frombuffer"): _from_buffer for core in ("core", "_core")},
    **{
        (module, name): build
        for module in ("builtins", "__builtin__")
        for name, build in (
            ("dict", _mapping),
            ("bytes", _no_bytes),
            ("list", _collection(list)),
            ("set", _collection(set)),
            ("frozenset", _collection(frozenset)),
        )
    },
    **{
        (module, f"{pure}{system}Path"): _path
        for module in ("pathlib", "pathlib._local")
        for pure in ("", "Pure")
        for system in ("", "Posix", "Windows")
    },
}
"""Everything that a pickle may call."""
