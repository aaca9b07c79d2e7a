"""A file that is whole or not there."""

from __future__ import annotations

import contextlib
import os
import secrets
import stat
from collections.abc import Iterable
from pathlib import Path

from cgdb.errors import ExportError


def write_whole(path: Path, pieces: Iterable[str] | Iterable[bytes]) -> int:
    """Write bytes, or text as UTF-8, beside the file and move it there once it is on the disk; the number of bytes.

    Whoever reads the path meanwhile, and whoever comes after a crash, sees the old file or the new one.
    """
    try:
        target = path.resolve()  # through links: what they point at is replaced, not the link
        mode = _mode_of(path, target)
        temporary = target.parent / f".cgdb-export-{secrets.token_hex(8)}.tmp"
        try:
            with temporary.open("xb") as file:
                file.writelines(piece.encode("utf-8") if isinstance(piece, str) else piece for piece in pieces)
                file.flush()
                os.fsync(file.fileno())
                n_bytes = os.fstat(file.fileno()).st_size
            if mode is not None:
                temporary.chmod(mode)
            temporary.replace(target)
        except BaseException:  # Ctrl-C too must not leave a half-written file behind
            with contextlib.suppress(OSError):
                temporary.unlink()
            raise
        _settle(target.parent)
    except OSError as error:
        raise ExportError(
            f"{path}: cannot be written: {error.strerror or error}",
            hint="nothing was changed; check the folder, its permissions and the free space",
        ) from error
    except ValueError as error:  # a NUL in the name
        raise ExportError(f"{str(path)!r}: is no file name: {error}") from error
    return n_bytes


def _mode_of(path: Path, target: Path) -> int | None:
    """The permissions of the file that is replaced; None where there is none yet."""
    try:
        found = target.stat()
    except FileNotFoundError:
        if not target.parent.is_dir():
            raise ExportError(f"{path}: there is no folder {target.parent}", hint="make it first") from None
        return None
    if stat.S_ISREG(found.st_mode):
        return stat.S_IMODE(found.st_mode)
    what = "a folder" if stat.S_ISDIR(found.st_mode) else "no regular file"
    raise ExportError(f"{path}: is {what}", hint="name a file to write to")


def _settle(folder: Path) -> None:
    """Have the folder's new entry on the disk, where the system can."""
    if os.name != "posix":
        return
    descriptor = os.open(folder, os.O_RDONLY)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)
