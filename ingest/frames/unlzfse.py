"""Apple's LZFSE, decompressed to a size that is known beforehand.

The decompressor makes as much room as the data asks for, and a thousandfold is easily asked for. The heads of the
blocks say what each unfolds to; they are walked first.
"""

from __future__ import annotations

import struct

from cgdb.errors import FormatError, MissingExtraError

BLOCK = 16_384
"""Bytes. Blocks of real data unfold to more, on average; a block may unfold to some 27 MB whatever its head says."""


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
        made: bytes = lzfse.decompress(data)
    except lzfse.error as error:
        raise FormatError(f"{where}: its compressed data is damaged") from error
    if len(made) != size:
        raise FormatError(f"{where}: unfolds to {len(made):,} bytes where {size:,} were expected")
    return made


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
