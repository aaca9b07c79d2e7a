"""Arrays from .npy and .npz files of strangers: a header is believed only as far as the bytes go, objects never.

numpy makes room for what a header announces before it reads; a file of a hundred bytes can announce terabytes.
"""

from __future__ import annotations

import lzma
import math
import struct
import tokenize
import zipfile
import zlib
from pathlib import Path
from typing import Any, BinaryIO, cast

import numpy as np
from numpy.typing import NDArray

from cgdb.errors import FormatError

LARGEST_FILE = 256 << 20
"""Bytes of a .npy file."""
LARGEST_UNPACKED = 2 << 30
"""Bytes of all arrays of a .npz file."""
_DAMAGED = (
    OSError, ValueError, EOFError, KeyError, TypeError, RuntimeError, MemoryError, SyntaxError,
    zipfile.BadZipFile, zlib.error, lzma.LZMAError, struct.error, tokenize.TokenError,
)  # fmt: skip
"""What zipfile, its decompressors, and numpy's parser of headers, which reads them as Python, raise."""


def of_file(path: Path) -> NDArray[Any]:
    """The array of a .npy file. FormatError where there is none, or none of numbers."""
    try:
        size = path.stat().st_size
        if size > LARGEST_FILE:
            raise FormatError(f"{path.name}: is larger than {LARGEST_FILE >> 20} MB")
        with path.open("rb") as file:
            return read(file, size)
    except _DAMAGED as error:
        raise FormatError(f"{path.name}: is no array that can be read") from error


def of_archive(path: Path, *, most: int = LARGEST_UNPACKED) -> dict[str, NDArray[Any]]:
    """{name: array} of a .npz file, of most bytes. FileNotFoundError as it is; FormatError where it is damaged."""
    try:
        with zipfile.ZipFile(path) as packed:
            parts = packed.infolist()
            if sum(part.file_size for part in parts) > most:
                raise FormatError(f"{path.name}: unfolds to more than {most >> 30} GB")
            made = {}
            for part in parts:
                with packed.open(part) as file:
                    made[part.filename.removesuffix(".npy")] = read(cast("BinaryIO", file), part.file_size)
            return made
    except FileNotFoundError:
        raise
    except _DAMAGED as error:
        raise FormatError(f"{path.name}: its arrays are damaged") from error


def read(file: BinaryIO, size: int) -> NDArray[Any]:
    """The array of an open .npy file of that many bytes, not to be written to. ValueError where it is none."""
    version = np.lib.format.read_magic(file)
    if version not in ((1, 0), (2, 0)):
        raise ValueError(f"arrays of version {version} hold records")
    header = np.lib.format.read_array_header_1_0 if version == (1, 0) else np.lib.format.read_array_header_2_0
    shape, columns_first, dtype = header(file)
    count = math.prod(shape)
    if dtype.kind not in "biufSU" or any(side < 0 for side in shape) or count * dtype.itemsize > size:
        raise ValueError(f"an array of {dtype} and shape {shape} does not fit into {size} bytes")
    data = file.read(count * dtype.itemsize)
    if len(data) != count * dtype.itemsize:
        raise EOFError("the file is cut off")
    # A byte that is neither 0 nor 1 would make a bool array that breaks numpy's rules.
    flat = np.frombuffer(data, np.uint8) != 0 if dtype == np.bool_ else np.frombuffer(data, dtype)
    return flat.reshape(shape, order="F" if columns_first else "C")
