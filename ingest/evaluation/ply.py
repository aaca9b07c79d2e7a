"""PLY files with labels: the columns of their vertices, and of their faces where the labels are there.

Mesh libraries hand out geometry and drop the columns that data sets keep their labels in.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from cgdb.errors import FormatError

LARGEST_FILE = 8 << 30
_LONGEST_HEADER = 1 << 16
_TYPES = {
    "char": "i1", "int8": "i1", "uchar": "u1", "uint8": "u1", "short": "i2", "int16": "i2", "ushort": "u2",
    "uint16": "u2", "int": "i4", "int32": "i4", "uint": "u4", "uint32": "u4", "float": "f4", "float32": "f4",
    "double": "f8", "float64": "f8",
}  # fmt: skip
_ORDER = {"ascii": "", "binary_little_endian": "<", "binary_big_endian": ">"}


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Ply:
    """vertex, face: {property: (n,) numbers}. corners: (m, k) the vertices of the faces, where all have k of them."""

    vertex: Mapping[str, NDArray[np.generic]]
    face: Mapping[str, NDArray[np.generic]] = field(default_factory=dict)
    corners: NDArray[np.int64] | None = None


@dataclass(slots=True)
class _Element:
    name: str
    count: int
    scalars: list[tuple[str, str]]
    """(name, type) in order; a list is (name, "count type, item type")."""


def read(path: Path) -> Ply:
    """The vertices and faces of a PLY file, ASCII or binary. FormatError where it is none, or cut off.

    Lists, other than the corners of faces, are refused where they stand before what is needed.
    """
    try:
        if path.stat().st_size > LARGEST_FILE:
            raise FormatError(f"{path}: is larger than a cloud can be ({LARGEST_FILE >> 30} GiB)")
        with path.open("rb") as file:
            elements, order, start = _header(file.read(_LONGEST_HEADER), path)
            file.seek(start)
            body = file.read()
    except OSError as error:
        raise FormatError(f"{path}: cannot be read: {error.strerror or error}") from None
    read_element = _Ascii(body, path) if order == "" else _Binary(body, order, path)
    found: dict[str, dict[str, NDArray[np.generic]]] = {}
    corners = None
    for element in elements:
        columns, lists = read_element.take(element)
        found[element.name] = columns
        if element.name == "face" and lists is not None:
            corners = lists.astype(np.int64)
        if element.name == "face":
            break
    if "vertex" not in found or not {"x", "y", "z"} <= found["vertex"].keys():
        raise FormatError(f"{path}: this PLY has no vertices with x, y and z")
    if corners is not None and corners.size and not 0 <= corners.min() <= corners.max() < len(found["vertex"]["x"]):
        raise FormatError(f"{path}: a face names a vertex that there is not")
    return Ply(vertex=found["vertex"], face=found.get("face", {}), corners=corners)


def _header(head: bytes, path: Path) -> tuple[list[_Element], str, int]:
    """The elements, the byte order ("" for text) and where the body starts."""
    end = head.find(b"end_header")
    if not head.startswith(b"ply") or end < 0:
        raise FormatError(f"{path}: this is no PLY file", hint="a PLY starts with the line 'ply'")
    after = head.find(b"\n", end)
    if after < 0:
        raise FormatError(f"{path}: the PLY ends with its header")
    order: str | None = None
    elements: list[_Element] = []
    for line in head[:end].decode("ascii", "replace").splitlines()[1:]:
        match line.split():
            case [] | ["comment" | "obj_info", *_]:
                pass
            case ["format", form, _] if form in _ORDER:
                order = _ORDER[form]
            case ["element", name, count] if count.isascii() and count.isdigit() and len(count) < 13:
                elements.append(_Element(name, int(count), []))
            case ["property", "list", length, item, name] if elements and {length, item} <= _TYPES.keys():
                elements[-1].scalars.append((name, f"{_TYPES[length]},{_TYPES[item]}"))
            case ["property", kind, name] if elements and kind in _TYPES:
                elements[-1].scalars.append((name, _TYPES[kind]))
            case _:
                raise FormatError(f"{path}: the PLY's header has a line that is none: {line[:60]!r}")
    if order is None:
        raise FormatError(f"{path}: the PLY's header names no format that is known")
    for element in elements:
        names = [name for name, _ in element.scalars]
        if len(set(names)) < len(names):
            raise FormatError(f"{path}: the PLY's element '{element.name}' has two properties of one name")
    return elements, order, after + 1


class _Binary:
    """The body of a binary PLY, element by element."""

    def __init__(self, body: bytes, order: str, path: Path) -> None:
        self._body, self._order, self._path, self._at = body, order, path, 0

    def take(self, element: _Element) -> tuple[dict[str, NDArray[np.generic]], NDArray[np.generic] | None]:
        """({property: column}, the (m, k) items of its list)."""
        fields: list[tuple[str, str] | tuple[str, str, tuple[int]]] = []
        before = np.dtype([])
        listed = None
        for name, kind in element.scalars:
            length, comma, item = kind.partition(",")
            if comma:
                if listed is not None:
                    raise FormatError(f"{self._path}: element '{element.name}' has two lists, which is not read")
                listed = name
                before = np.dtype(fields)
                k = self._first_length(before.itemsize, length, element)
                fields += [(f"{name} length", self._order + length), (name, self._order + item, (k,))]
            else:
                fields.append((name, self._order + kind))
        row = np.dtype(fields)
        size = row.itemsize * element.count
        if self._at + size > len(self._body):
            raise FormatError(
                f"{self._path}: the PLY is cut off, or its faces differ in their number of corners: "
                f"{element.count:,} of '{element.name}' do not fit"
            )
        table = np.frombuffer(self._body, row, element.count, self._at)
        self._at += size
        if listed is not None and element.count and (table[f"{listed} length"] != row[listed].shape[0]).any():
            raise FormatError(
                f"{self._path}: the faces differ in their number of corners, which is not read",
                hint="triangulate the mesh, or keep the labels with the vertices",
            )
        columns = {name: table[name] for name, kind in element.scalars if "," not in kind}
        return columns, None if listed is None else table[listed]

    def _first_length(self, offset: int, kind: str, element: _Element) -> int:
        length = np.dtype(self._order + kind)
        place = self._at + offset
        if not element.count or place + length.itemsize > len(self._body):
            return 0
        return max(0, min(int(np.frombuffer(self._body, length, 1, place)[0]), 1 << 16))


class _Ascii:
    """The body of a PLY in text, a line per row."""

    def __init__(self, body: bytes, path: Path) -> None:
        self._lines, self._path, self._at = body.split(b"\n"), path, 0

    def take(self, element: _Element) -> tuple[dict[str, NDArray[np.generic]], NDArray[np.generic] | None]:
        """({property: column}, the (m, k) items of its list)."""
        lines = self._lines[self._at : self._at + element.count]
        self._at += element.count
        if len(lines) < element.count:
            raise FormatError(f"{self._path}: the PLY is cut off: {element.count:,} of '{element.name}' are promised")
        if not lines:
            return {name: np.zeros(0) for name, kind in element.scalars if "," not in kind}, None
        try:
            rows = np.array([line.split() for line in lines]).astype(np.float64)
        except ValueError:
            raise FormatError(
                f"{self._path}: the rows of '{element.name}' are not all the same number of numbers"
            ) from None
        columns: dict[str, NDArray[np.generic]] = {}
        items, at = None, 0
        for name, kind in element.scalars:
            if "," in kind:
                k = int(rows[0, at]) if at < rows.shape[1] else 0
                items, at = rows[:, at + 1 : at + 1 + k], at + 1 + k
            elif at < rows.shape[1]:
                columns[name], at = rows[:, at], at + 1
            else:
                raise FormatError(f"{self._path}: the rows of '{element.name}' are shorter than its properties")
        return columns, items
