"""Derived files: immutable, one per scene, revision and kind; built beside, renamed into place, thrown away later.

A file is found through its sidecar ``s{scene}-r{revision}-{kind}.json``, which names the data file and holds its size
and checksum. The data file's own name is new at each build, so that the rename of the sidecar alone decides: at any
instant, and however many processes build the same, a sidecar is right about the file that it names, or the
file is rebuilt. Nothing here is worth keeping: everything can be made again from the ledger.
"""

from __future__ import annotations

import contextlib
import errno
import hashlib
import json
import os
import re
import secrets
import shutil
import socket
import tempfile
import threading
import time
import weakref
import zlib
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from cgdb.errors import CgdbError, StoreError

FORMAT = 1
ABANDONED_S = 3600.0
"""Age at which an unfinished or unreferenced file is taken for a leftover, whoever made it."""
_CANNOT_WRITE = {errno.ENOSPC, errno.EROFS, errno.EACCES, errno.EPERM, errno.EDQUOT, errno.EFBIG}
_OWNED = re.compile(r"s(?P<scene>\d+)-r(?P<revision>\d+)-(?P<kind>[^~]+?)(?:\.json|~(?P<maker>[0-9a-f]{8}-\d+)-.*)")

Build = Callable[[Path], Mapping[str, Any]]


@dataclass(frozen=True, slots=True)
class Artefact:
    """A derived file whose bytes are those that its builder wrote, and what the builder said of it."""

    path: Path
    meta: Mapping[str, Any]


@dataclass(frozen=True, slots=True)
class _Entry:
    """The name of a file here, taken apart. maker: of a data file; None for a sidecar."""

    path: Path
    scene: int
    revision: int
    maker: str | None


@dataclass(frozen=True, slots=True)
class _Sidecar:
    scene: int
    revision: int
    kind: str
    file: str
    size: int
    checksum: int
    meta: Mapping[str, Any]


class Artefacts:
    """The derived files of one store. ``rebuilt`` says, one line each, what was found damaged and made again."""

    def __init__(self, folder: Path, *, writable: bool) -> None:
        self.folder = folder
        self.rebuilt: list[str] = []
        self._writable = writable
        self._lock = threading.RLock()
        self._private: dict[tuple[str, int, int], Artefact] = {}
        self._verified: dict[str, tuple[int, int, int]] = {}
        self._private_folder: Path | None = None
        self._remover: weakref.finalize[..., Any] | None = None

    def get(self, kind: str, scene: int, revision: int, build: Build) -> Artefact:
        """The valid file of this kind for the scene at the revision, built now unless there is one.

        ``build(path)`` writes one file at ``path`` and returns its meta (what JSON can hold).
        """
        with self._lock:
            if (made := self._private.get((kind, scene, revision))) is not None:
                return made
            sidecar = self.folder / f"s{scene}-r{revision}-{_safe(kind)}.json"
            if sidecar.exists():
                found = self._open(sidecar, kind)
                if isinstance(found, Artefact):
                    return found
                self.rebuilt.append(found)
            if self._writable:
                with contextlib.suppress(_FolderError):
                    return self._build_in_place(sidecar, kind, scene, revision, build)
            return self._build_privately(kind, scene, revision, build)

    def previous(self, kind: str, scene: int, before_revision: int) -> Artefact | None:
        """The newest valid file of this kind for an older revision of the scene: a start for catching up."""
        ending = f"-{_safe(kind)}.json"
        with self._lock:
            known = [one for one in self._sidecars() if one.scene == scene and one.revision < before_revision]
            for entry in sorted(known, key=lambda one: -one.revision):
                if entry.path.name.endswith(ending):
                    found = self._open(entry.path, kind)
                    if isinstance(found, Artefact):
                        return found
        return None

    def revisions(self, scene: int) -> set[int]:
        """The revisions of a scene that have files here, valid or not."""
        with self._lock:
            return {entry.revision for entry in self._sidecars() if entry.scene == scene}

    def sweep(self, keep: set[tuple[int, int]]) -> list[str]:
        """Remove the files of every (scene, revision) that is not kept, and what dead builders left; the names removed.

        A file that another process has open stays readable there; where the system forbids removing it, it is left.
        """
        removed: list[str] = []
        if not self._writable:
            return removed
        with self._lock:
            entries = self._entries()
            referenced = {described.file for one in entries if one.maker is None and (described := _read(one.path))}
            for entry in entries:
                path = entry.path
                if entry.maker is None or path.name in referenced:
                    doomed = (entry.scene, entry.revision) not in keep
                else:
                    doomed = _abandoned(path, entry.maker)
                if doomed and _remove(path):
                    removed.append(path.name)
                    self._verified.pop(path.name, None)
        return removed

    def check(self, *, remove: bool = False) -> list[str]:
        """Read every file again and compare it with its checksum: one line for each problem.

        remove: the sidecar of each damaged file, so that its next use builds it again.
        """
        problems: list[str] = []
        with self._lock:
            self._verified.clear()
            for entry in self._sidecars():
                found = self._open(entry.path, None)
                if isinstance(found, str):
                    problems.append(found)
                    if remove:
                        _remove(entry.path)
        return problems

    def close(self) -> None:
        """Forget what was verified and remove the files that could not be written into the store."""
        with self._lock:
            self._private.clear()
            self._verified.clear()
            if self._remover is not None:
                self._remover()
                self._remover = self._private_folder = None

    # ------------------------------------------------------------------------------------------------------------

    def _entries(self) -> list[_Entry]:
        try:
            names = sorted(entry.name for entry in os.scandir(self.folder))
        except OSError:
            return []
        return [
            _Entry(self.folder / name, int(match["scene"]), int(match["revision"]), match["maker"])
            for name in names
            if (match := _OWNED.fullmatch(name))
        ]

    def _sidecars(self) -> list[_Entry]:
        return [entry for entry in self._entries() if entry.maker is None]

    def _open(self, path: Path, kind: str | None) -> Artefact | str:
        """The file that a sidecar names, or in one line why it cannot be used."""
        sidecar = _read(path)
        if sidecar is None or (kind is not None and sidecar.kind != kind):
            return f"{path.name}: the description is damaged"
        if path.name != f"s{sidecar.scene}-r{sidecar.revision}-{_safe(sidecar.kind)}.json":
            return f"{path.name}: describes another file"
        data = self.folder / sidecar.file
        try:
            with data.open("rb") as file:
                state = os.fstat(file.fileno())
                stamp = (state.st_ino, state.st_mtime_ns, state.st_size)
                if state.st_size != sidecar.size:
                    return f"{path.stem}: has {state.st_size} bytes of {sidecar.size}"
                # Reading it all costs about 0.6 ms per MB: once per process, as long as the file is the same one.
                if self._verified.get(path.name) != stamp:
                    if _checksum(file) != sidecar.checksum:
                        return f"{path.stem}: damaged, its bytes are not those that were written"
                    self._verified[path.name] = stamp
        except FileNotFoundError:
            return f"{path.stem}: the file is missing"
        except OSError as error:
            return f"{path.stem}: cannot be read ({error.strerror})"
        return Artefact(data, sidecar.meta)

    def _build_in_place(self, sidecar: Path, kind: str, scene: int, revision: int, build: Build) -> Artefact:
        stem = sidecar.name.removesuffix(".json")
        work = self.folder / f"{stem}~{_maker()}-{secrets.token_hex(6)}"
        try:
            self.folder.mkdir(parents=True, exist_ok=True)
            meta = _built(work, build)
            with work.open("rb") as file:
                checksum, size = _checksum(file), os.fstat(file.fileno()).st_size
                os.fsync(file.fileno())
            record = {"format": FORMAT, "scene": scene, "revision": revision, "kind": kind, "file": work.name}
            record |= {"size": size, "checksum": checksum, "meta": dict(meta)}
            text = json.dumps(record)
            draft = work.with_name(work.name + ".json")
            with draft.open("w", encoding="utf-8") as file_out:
                file_out.write(json.dumps({"record": text, "checksum": zlib.crc32(text.encode())}))
                file_out.flush()
                os.fsync(file_out.fileno())
            draft.replace(sidecar)
            _sync_folder(self.folder)
        except BaseException as error:
            _remove_work(work)
            if isinstance(error, OSError) and error.errno in _CANNOT_WRITE:
                raise _FolderError from error
            # The graph engine reports a full disk in words of its own: ask the folder itself.
            if isinstance(error, (CgdbError, OSError)) and not _takes_bytes(self.folder):
                raise _FolderError from error
            raise
        state = work.stat()
        self._verified[sidecar.name] = (state.st_ino, state.st_mtime_ns, state.st_size)
        return Artefact(work, dict(meta))

    def _build_privately(self, kind: str, scene: int, revision: int, build: Build) -> Artefact:
        if self._private_folder is None:
            self._private_folder = Path(tempfile.mkdtemp(prefix="cgdb-index-"))
            self._remover = weakref.finalize(self, shutil.rmtree, self._private_folder, ignore_errors=True)
        work = self._private_folder / f"s{scene}-r{revision}-{_safe(kind)}~{_maker()}-{secrets.token_hex(6)}"
        try:
            artefact = Artefact(work, dict(_built(work, build)))
        except OSError as error:
            _remove_work(work)
            raise StoreError(
                f"an index can be written neither into {self.folder} nor into {self._private_folder}: {error.strerror}",
                hint="free some space, or point TMPDIR at a folder that has some",
            ) from error
        self._private[(kind, scene, revision)] = artefact
        return artefact


class _FolderError(Exception):
    """The folder of the store takes no file now: read-only, or full."""


def _safe(kind: str) -> str:
    """A file name part for any kind: kinds that differ keep differing, where names ignore case too."""
    plain = re.sub(r"[^a-z0-9_-]", "_", kind)[:60]
    if plain and plain == kind:
        return plain
    return f"{plain}-{hashlib.blake2b(kind.encode('utf-8', 'replace'), digest_size=6).hexdigest()}"


def _maker() -> str:
    """This process among all processes of all machines that may share the folder."""
    return f"{zlib.crc32(socket.gethostname().encode()):08x}-{os.getpid()}"


def _abandoned(path: Path, maker: str) -> bool:
    host, pid = maker.split("-")
    if host == _maker().split("-")[0] and not _alive(int(pid)):
        return True
    try:
        return time.time() - path.stat().st_mtime > ABANDONED_S
    except OSError:
        return False


def _alive(pid: int) -> bool:
    if os.name == "nt":
        return True
    try:
        os.kill(pid, 0)
    except ProcessLookupError:
        return False
    except OSError:
        return True
    return True


def _built(work: Path, build: Build) -> Mapping[str, Any]:
    meta = build(work)
    if not work.is_file():
        raise StoreError(f"the builder wrote no file at {work.name}")
    return meta


def _read(path: Path) -> _Sidecar | None:
    """The record of a sidecar, or None when it is not exactly what was written."""
    try:
        outer = json.loads(path.read_bytes())
        text = outer["record"]
        if zlib.crc32(text.encode()) != outer["checksum"]:
            return None
        record = json.loads(text)
        if record.pop("format") != FORMAT:
            return None
        sidecar = _Sidecar(**record)
    except (OSError, ValueError, TypeError, KeyError, AttributeError, RecursionError):
        return None
    match = _OWNED.fullmatch(str(sidecar.file))
    return sidecar if match is not None and match["maker"] is not None else None


def _checksum(file: Any) -> int:
    buffer = bytearray(1 << 20)
    view = memoryview(buffer)
    value = 0
    file.seek(0)
    while count := file.readinto(view):
        value = zlib.crc32(view[:count], value)
    return value


def _remove(path: Path) -> bool:
    try:
        path.unlink()
    except OSError:
        return False
    return True


def _remove_work(work: Path) -> None:
    """Everything that a failed build left: the file, and what its builder put beside it under the same beginning."""
    for path in work.parent.glob(f"{work.name}*"):
        if path.is_dir():
            shutil.rmtree(path, ignore_errors=True)
        else:
            _remove(path)


def _takes_bytes(folder: Path) -> bool:
    probe = folder / f"s0-r0-probe~{_maker()}-{secrets.token_hex(6)}"
    try:
        with probe.open("wb") as file:
            file.write(bytes(1 << 20))
            file.flush()
            os.fsync(file.fileno())
    except OSError:
        return False
    finally:
        _remove(probe)
    return True


def _sync_folder(folder: Path) -> None:
    if os.name == "nt":
        return
    handle = os.open(folder, os.O_RDONLY)
    try:
        os.fsync(handle)
    finally:
        os.close(handle)
