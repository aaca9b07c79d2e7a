"""A scene graph to files and texts: one function per format in ``EXPORTERS``, and a file that is whole or not there."""

from __future__ import annotations

import contextlib
import inspect
import os
import secrets
import stat
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from cgdb.errors import ExportError, UsageError, did_you_mean, one_of
from cgdb.export_document import Document
from cgdb.export_glb import glb
from cgdb.export_networkx import graphml, node_link, to_networkx
from cgdb.export_planner import planner
from cgdb.export_ply import ply
from cgdb.export_rerun import rerun
from cgdb.export_scene_json import scene_json
from cgdb.scene import SceneGraph

__all__ = [
    "EXPORTERS",
    "SUFFIXES",
    "WITH_VIEWS",
    "Document",
    "Exported",
    "document",
    "dumps",
    "export",
    "format_of",
    "to_networkx",
    "write_whole",
]

EXPORTERS: dict[str, Callable[..., Document]] = {
    "cgdb": scene_json,
    "planner": planner,
    "node-link": node_link,
    "graphml": graphml,
    "ply": ply,
    "glb": glb,
    "rerun": rerun,
}
"""Format name -> its function of a scene; the function's keyword parameters are the format's options."""

WITH_VIEWS = frozenset({"cgdb", "rerun"})
"""Formats that hold the views of objects. For the others the pictures, most of a map's bytes, need not be read."""

SUFFIXES: dict[str, str] = {
    ".planner.json": "planner",
    ".node-link.json": "node-link",
    ".graphml": "graphml",
    ".json": "cgdb",
    ".ply": "ply",
    ".glb": "glb",
    ".rrd": "rerun",
}
"""End of a file's name -> format; the first that fits."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Exported:
    """What was written: where, in which format, how many bytes, and what the reader of the file should know."""

    path: Path
    format: str
    n_bytes: int
    notes: tuple[str, ...] = ()


def export(scene: SceneGraph, path: str | os.PathLike[str], format: str | None = None, **options: Any) -> Exported:
    """Write the scene to a file, in the format given or else the one of the file's suffix; all of it or nothing."""
    path = Path(path)
    chosen = format if format is not None else format_of(path)
    written = document(scene, chosen, **options)
    n_bytes = write_whole(path, written.pieces if written.data is None else written.data)
    return Exported(path=path, format=chosen, n_bytes=n_bytes, notes=written.notes)


def dumps(scene: SceneGraph, format: str = "cgdb", **options: Any) -> str:
    """The scene as one text of the format. ``document`` gives the notes with it, and the bytes of binary formats."""
    written = document(scene, format, **options)
    if written.data is not None:
        raise ExportError(f"the format '{format}' is binary: there is no text of it", hint="export it to a file")
    return "".join(written.pieces)


def document(scene: SceneGraph, format: str, **options: Any) -> Document:
    """The scene as a text in pieces, or as bytes, with notes about what the format left out."""
    exporter = EXPORTERS.get(format)
    if exporter is None:
        raise ExportError(
            f"there is no export format {str(format)[:60]!r}",
            hint=did_you_mean(format, EXPORTERS) or f"formats: {one_of(EXPORTERS)}",
        )
    known = [name for name, p in inspect.signature(exporter).parameters.items() if p.kind is p.KEYWORD_ONLY]
    for name in options:
        if name not in known:
            has = f"options of '{format}': {one_of(known)}" if known else f"'{format}' has no options"
            raise UsageError(f"the format '{format}' has no option '{name}'", hint=did_you_mean(name, known) or has)
    return exporter(scene, **options)


def format_of(path: Path) -> str:
    """The format that the end of the file's name stands for; ExportError where it stands for none."""
    for suffix, name in SUFFIXES.items():
        if path.name.casefold().endswith(suffix):
            return name
    endings = ", ".join(f"{suffix} ({name})" for suffix, name in SUFFIXES.items())
    raise ExportError(
        f"{path}: the end of the name does not say which format to write",
        hint=f"give a format ({one_of(EXPORTERS)}) or one of these endings: {endings}",
    )


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
