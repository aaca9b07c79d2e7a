"""A machine that reads pickles and can do nothing else: it imports nothing and calls only what `pickled` lists.

Python's own unpickler resolves names and calls what it found; a filter in front of it has to be right every time.
This one is a stack machine over the documented opcodes in which REDUCE, NEWOBJ, INST and OBJ reach the functions that
`pickled.find`, or its caller's `find`, gives and no others. It is iterative, so depth costs no stack; lengths are read
piece by piece, so a length that the file does not hold costs no memory; steps are counted, so a small file cannot
unfold into endless objects.
"""

from __future__ import annotations

import struct
from collections.abc import Callable
from typing import Any, BinaryIO

import numpy as np

from cgdb.errors import FormatError
from cgdb.ingest import pickled
from cgdb.ingest.pickled import Blob, Global, Inert, Pending

MOST_STEPS = 2_000_000
STEPS_PER_BYTE = 8
"""Steps allowed: MOST_STEPS, and STEPS_PER_BYTE for each byte of the file as it lies on disk."""
LONGEST_INTEGER = 1024
LONGEST_LINE = 4096
CHUNK = 1 << 20
SMALL = 1024


Find = Callable[[str, str], Global]
"""What a pickle gets for a module and a name; FormatError for what it may not have."""


def load(file: BinaryIO, *, size: int = 0, find: Find = pickled.find) -> Any:
    """The value of a pickle. size: bytes of the file on disk. FormatError when it is cut off, damaged or hostile.

    find: what the pickle may ask for, where that is more than a map's.
    """
    return _Machine(file, MOST_STEPS + STEPS_PER_BYTE * size, find).run()


class _Machine:
    def __init__(self, file: BinaryIO, most_steps: int, find: Find) -> None:
        self._file = file
        self._find = find
        self._left = most_steps
        self._stack: list[Any] = []
        self._marks: list[list[Any]] = []
        self._memo: dict[int, Any] = {}

    def run(self) -> Any:
        """Step until STOP; the value on top is the answer."""
        read, steps = self._file.read, _STEPS
        try:
            while self._left > 0:
                self._left -= 1
                code = read(1)
                if code == b".":
                    return self._stack.pop()
                step = steps.get(code)
                if step is None:
                    raise FormatError(
                        "the pickle is cut off: the file is truncated"
                        if not code
                        else f"refused: the pickle uses the opcode 0x{code.hex()}"
                    )
                step(self)
        except (IndexError, KeyError, struct.error, UnicodeDecodeError, ValueError, OverflowError, TypeError) as error:
            # An opcode met a stack that it does not fit; what exactly, only its maker could use.
            raise FormatError(f"the pickle is damaged ({type(error).__name__})") from error
        raise FormatError("the pickle takes more steps than a map of its size needs: this looks like a bomb")

    # Reading

    def read(self, size: int) -> bytes:
        """Exactly so many bytes, taken in pieces: a length is believed only as far as the file goes."""
        if size <= CHUNK:
            data = self._file.read(size)
        else:
            pieces = []
            left = size
            while left and (piece := self._file.read(min(left, CHUNK))):
                pieces.append(piece)
                left -= len(piece)
            data = b"".join(pieces)
        if len(data) != size:
            raise FormatError("the pickle is cut off: the file is truncated")
        return data

    def line(self) -> bytes:
        data = self._file.readline(LONGEST_LINE)
        if not data.endswith(b"\n"):
            raise FormatError("the pickle is cut off: the file is truncated")
        return data[:-1]

    def number(self, layout: str) -> Any:
        return struct.unpack(layout, self.read(struct.calcsize(layout)))[0]

    # The stack

    def push(self, value: Any) -> None:
        self._stack.append(value)

    def pop(self) -> Any:
        return self._stack.pop()

    def discard(self, value: Any) -> None:
        """What POP takes off, and the length that a frame announces: nothing is believed of it."""

    def mark(self) -> None:
        self._marks.append(self._stack)
        self._stack = []

    def pop_mark(self) -> list[Any]:
        items = self._stack
        self._stack = self._marks.pop()
        return items

    def get(self, index: int) -> None:
        self.push(self._memo[index])

    def put(self, index: int) -> None:
        value = self._stack[-1]
        self._memo[index] = value
        if isinstance(value, Pending):
            value.slots.append(index)

    def memoize(self) -> None:
        self.put(len(self._memo))

    # Names and what they build

    def find(self) -> None:
        name, module = self.pop(), self.pop()
        self.push_global(module, name)

    def push_global(self, module: Any, name: Any) -> None:
        if not isinstance(module, str) or not isinstance(name, str):
            raise FormatError("refused: the pickle asks for something that has no name")
        self.push(self._find(module, name))

    def call(self, function: Any, arguments: Any) -> None:
        if not isinstance(function, Global) or not isinstance(arguments, tuple):
            raise FormatError("refused: the pickle calls something that is no known type")
        if function.build is None:
            raise FormatError(f"refused: the pickle calls {function.name}")
        self.push(self.charged(function.build(arguments)))

    def charged(self, made: Any) -> Any:
        """A few opcodes can ask for a copy of a large thing again and again: each copy costs what it holds."""
        if isinstance(made, (list, dict, set, frozenset)) or (isinstance(made, np.ndarray) and made.dtype.hasobject):
            self._left -= np.size(made) if isinstance(made, np.ndarray) else len(made)
        elif isinstance(made, bytes):
            self._left -= len(made) // 8
        return made

    def reduce(self) -> None:
        arguments, function = self.pop(), self.pop()
        self.call(function, arguments)

    def new_object_with_names(self) -> None:
        names, arguments, function = self.pop(), self.pop(), self.pop()
        if not isinstance(names, dict) or names:
            raise FormatError("refused: the pickle calls something with named arguments")
        self.call(function, arguments)

    def instance(self) -> None:
        arguments = tuple(self.pop_mark())
        module, name = self.line().decode(), self.line().decode()
        self.push_global(module, name)
        self.call(self.pop(), arguments)

    def object(self) -> None:
        function, *arguments = self.pop_mark()
        self.call(function, tuple(arguments))

    def build(self) -> None:
        state, value = self.pop(), self._stack[-1]
        if isinstance(value, Pending):
            made = self.charged(value.finish(state))
            self._stack[-1] = made
            for index in value.slots:
                self._memo[index] = made
        elif not isinstance(value, Inert):
            raise FormatError("refused: the pickle changes the state of a plain value")

    # Containers

    def extend(self, items: list[Any]) -> None:
        target = self._stack[-1]
        if isinstance(target, list):
            target.extend(items)
        elif not isinstance(target, Inert):
            raise FormatError("the pickle is damaged: it appends to something that is no list")

    def update(self, items: list[Any]) -> None:
        target = self._stack[-1]
        if isinstance(target, dict):
            for name, value in zip(items[::2], items[1::2], strict=True):
                target[pickled.key(name)] = value
        elif not isinstance(target, Inert):
            raise FormatError("the pickle is damaged: it sets items of something that is no mapping")

    def add(self, items: list[Any]) -> None:
        target = self._stack[-1]
        if not isinstance(target, set):
            raise FormatError("the pickle is damaged: it adds to something that is no set")
        target.update(pickled.key(item) for item in items)

    def mapping(self) -> None:
        items = self.pop_mark()
        self.push({})
        self.update(items)

    def append(self) -> None:
        item = self.pop()
        self.extend([item])

    def set_item(self) -> None:
        value, name = self.pop(), self.pop()
        self.update([name, value])

    def tuple_of(self, count: int) -> None:
        if len(self._stack) < count:
            raise IndexError
        items = tuple(self._stack[-count:])
        del self._stack[-count:]
        self.push(items)

    # Values

    def bytes_of(self, size: int) -> None:
        data = self.read(size)
        self.push(data if size <= SMALL else Blob(data))

    def text_of(self, size: int) -> None:
        # Half characters occur in real strings; they are looked at where text enters a scene.
        self.push(self.read(size).decode("utf-8", "surrogatepass"))

    def integer_of(self, size: int) -> None:
        if not 0 <= size <= LONGEST_INTEGER:
            raise FormatError("the pickle holds an integer of more bytes than a map can need")
        self.push(int.from_bytes(self.read(size), "little", signed=True))

    def old_text_of(self, size: int) -> None:
        """Text of Python 2, which may be bytes: each byte a character, as numpy's old pickles need."""
        self.push(self.read(size).decode("latin-1"))

    def integer_line(self) -> None:
        text = self.line()
        self.push({b"00": False, b"01": True}.get(text) if text in (b"00", b"01") else int(text.rstrip(b"L")))

    def text_line(self) -> None:
        text = self.line()
        if len(text) < 2 or text[:1] not in (b"'", b'"') or text[:1] != text[-1:] or b"\\" in text:
            raise FormatError(
                "the pickle holds text as protocol 0 writes it, which is not read here",
                hint="write the file again with pickle protocol 2 or later",
            )
        self.push(text[1:-1].decode("latin-1"))

    def protocol(self) -> None:
        if self.read(1)[0] > 5:
            raise FormatError("the pickle is of a protocol that does not exist")


_STEPS: dict[bytes, Callable[[_Machine], None]] = {
    b"\x80": _Machine.protocol,
    b"\x95": lambda m: m.discard(m.number("<Q")),
    # Stack and memo
    b"(": _Machine.mark,
    b"0": lambda m: m.discard(m.pop()),
    b"1": lambda m: m.discard(m.pop_mark()),
    b"2": lambda m: m.push(m._stack[-1]),
    b"g": lambda m: m.get(int(m.line())),
    b"h": lambda m: m.get(m.number("<B")),
    b"j": lambda m: m.get(m.number("<I")),
    b"p": lambda m: m.put(int(m.line())),
    b"q": lambda m: m.put(m.number("<B")),
    b"r": lambda m: m.put(m.number("<I")),
    b"\x94": _Machine.memoize,
    # Scalars
    b"N": lambda m: m.push(None),
    b"\x88": lambda m: m.push(True),
    b"\x89": lambda m: m.push(False),
    b"I": _Machine.integer_line,
    b"L": _Machine.integer_line,
    b"J": lambda m: m.push(m.number("<i")),
    b"K": lambda m: m.push(m.number("<B")),
    b"M": lambda m: m.push(m.number("<H")),
    b"\x8a": lambda m: m.integer_of(m.number("<B")),
    b"\x8b": lambda m: m.integer_of(m.number("<i")),
    b"F": lambda m: m.push(float(m.line())),
    b"G": lambda m: m.push(m.number(">d")),
    # Text and bytes
    b"S": _Machine.text_line,
    b"V": lambda m: m.push(m.line().decode("raw-unicode-escape")),
    b"T": lambda m: m.old_text_of(m.number("<I")),
    b"U": lambda m: m.old_text_of(m.number("<B")),
    b"X": lambda m: m.text_of(m.number("<I")),
    b"\x8c": lambda m: m.text_of(m.number("<B")),
    b"\x8d": lambda m: m.text_of(m.number("<Q")),
    b"B": lambda m: m.bytes_of(m.number("<I")),
    b"C": lambda m: m.bytes_of(m.number("<B")),
    b"\x8e": lambda m: m.bytes_of(m.number("<Q")),
    b"\x96": lambda m: m.bytes_of(m.number("<Q")),
    # Containers
    b"]": lambda m: m.push([]),
    b"}": lambda m: m.push({}),
    b")": lambda m: m.push(()),
    b"\x8f": lambda m: m.push(set()),
    b"l": lambda m: m.push(m.pop_mark()),
    b"t": lambda m: m.push(tuple(m.pop_mark())),
    b"d": _Machine.mapping,
    b"\x91": lambda m: m.push(frozenset(pickled.key(item) for item in m.pop_mark())),
    b"\x85": lambda m: m.tuple_of(1),
    b"\x86": lambda m: m.tuple_of(2),
    b"\x87": lambda m: m.tuple_of(3),
    b"a": _Machine.append,
    b"e": lambda m: m.extend(m.pop_mark()),
    b"s": _Machine.set_item,
    b"u": lambda m: m.update(m.pop_mark()),
    b"\x90": lambda m: m.add(m.pop_mark()),
    # Names and what they build
    b"c": lambda m: m.push_global(m.line().decode(), m.line().decode()),
    b"\x93": _Machine.find,
    b"R": _Machine.reduce,
    b"\x81": _Machine.reduce,
    b"\x92": _Machine.new_object_with_names,
    b"i": _Machine.instance,
    b"o": _Machine.object,
    b"b": _Machine.build,
}
"""Opcode -> step. Absent on purpose: persistent ids, extension codes, out-of-band buffers; STOP is in `run`."""
