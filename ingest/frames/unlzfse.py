"""Apple's LZFSE, decompressed to a size that is known beforehand.

The package makes as much room as the data asks for, and a thousandfold is easily asked for. The heads of the blocks say
what each unfolds to; they are walked first. But heads can lie, so its C function is called with the room there is.
"""

from __future__ import annotations

import ctypes
import struct
from types import ModuleType

from cgdb.errors import FormatError, MissingExtraError

BLOCK = 16_384
"""Bytes. Blocks of real data unfold to more, on average."""


def decompress(data: bytes, size: int, where: str) -> bytes:
    """The bytes of an LZFSE stream, of which there must be size. FormatError where it is damaged or of another size."""
    try:
        import lzfse
    except ImportError as error:
        raise MissingExtraError(
            "Record3D archives need the package lzfse, which is not installed", hint="pip install 'cgdb[record3d]'"
        ) from error
    told, blocks = announced(data, where)
    if told != size or blocks > 2 + size // BLOCK:
        raise FormatError(f"{where}: unfolds to {told:,} bytes in {blocks} blocks where {size:,} were expected")
    try:
        made = _unfolded(lzfse, data, size + 1)
    except lzfse.error as error:
        raise FormatError(f"{where}: its compressed data is damaged") from error
    if len(made) != size:
        found = "more" if len(made) > size else f"{len(made):,} bytes"
        raise FormatError(f"{where}: unfolds to {found} where {size:,} were expected")
    return made


def _unfolded(lzfse: ModuleType, data: bytes, most: int) -> bytes:
    """The first bytes, `most` of them at most; the package's error where the data is damaged."""
    try:
        decode = ctypes.CDLL(lzfse.__file__).lzfse_decode_buffer
    except AttributeError:
        # A build that keeps its C functions to itself; a block, whatever its head says, unfolds to 27 MB at most.
        return bytes(lzfse.decompress(data))
    room = ctypes.create_string_buffer(most)
    decode.restype = ctypes.c_size_t
    decode.argtypes = (ctypes.c_void_p, ctypes.c_size_t, ctypes.c_char_p, ctypes.c_size_t, ctypes.c_void_p)
    written = decode(room, most, data, len(data), None)
    if not written:
        raise lzfse.error("damaged")
    return ctypes.string_at(room, written)


def announced(data: bytes, where: str) -> tuple[int, int]:
    """(bytes, blocks) that a stream says it holds, by its block heads (lzfse_internal.h of the reference)."""
    at, total, blocks = 0, 0, 0
    try:
        while (magic := data[at : at + 4]) != b"bvx$":
            (raw,) = struct.unpack_from("<I", data, at + 4)
            if magic == b"bvx-":  # as it is
                length = 8 + raw
            elif magic == b"bvxn":  # LZVN
                length = 12 + struct.unpack_from("<I", data, at + 8)[0]
            elif magic == b"bvx2":  # LZFSE, its tables packed
                literals, matches, head = struct.unpack_from("<QQQ", data, at + 8)
                length = (head & 0xFFFFFFFF) + (literals >> 20 & 0xFFFFF) + (matches >> 40 & 0xFFFFF)
            elif magic == b"bvx1":  # LZFSE, its tables as they are
                literals, matches = struct.unpack_from("<II", data, at + 20)
                length = 772 + literals + matches
            else:
                raise FormatError(f"{where}: is not compressed by LZFSE")
            if length < 8:
                raise FormatError(f"{where}: its compressed data is damaged")
            at, total, blocks = at + length, total + raw, blocks + 1
    except struct.error as error:
        raise FormatError(f"{where}: its compressed data is cut off") from error
    return total, blocks
