"""Lists of names in files, as people keep them: one on a line, or a JSON list."""

from __future__ import annotations

import json
from pathlib import Path

from cgdb.errors import FormatError

LARGEST_FILE = 16 << 20
MOST = 20_000
LONGEST = 100


def read_names(path: Path) -> list[str]:
    """The names in a file, each once: one on a line, # for comments, or a JSON list. FormatError for anything else."""
    try:
        if path.stat().st_size > LARGEST_FILE:
            raise FormatError(f"{path}: is larger than a list of names can be ({LARGEST_FILE >> 20} MB)")
        text = path.read_text("utf-8-sig")
    except (OSError, UnicodeDecodeError) as error:
        why = getattr(error, "strerror", None) or "it is not UTF-8 text"
        raise FormatError(f"{path}: cannot be read: {why}") from None
    listed: object = text.splitlines()
    if path.suffix == ".json":
        try:
            listed = json.loads(text)
        except (ValueError, RecursionError):
            raise FormatError(f"{path}: is not whole JSON") from None
    if not isinstance(listed, list) or not all(isinstance(item, str) for item in listed):
        raise FormatError(f"{path}: must be a list of names")
    names = [" ".join(line.split()) for line in listed if line.strip() and not line.lstrip().startswith("#")]
    if not names:
        raise FormatError(f"{path}: holds no names", hint="one name on a line")
    if len(names) > MOST or max(map(len, names)) > LONGEST or not all(map(str.isprintable, names)):
        raise FormatError(f"{path}: is no list of at most {MOST:,} names of at most {LONGEST} letters")
    return list(dict.fromkeys(names))
