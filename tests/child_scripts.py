"""Python scripts in processes of their own, for faults that one process cannot suffer and tell of."""

from __future__ import annotations

import subprocess
import sys


def started(text: str, *arguments: object) -> subprocess.Popen[str]:
    """The process that runs a script; its output can be read."""
    return subprocess.Popen(
        [sys.executable, "-c", text, *map(str, arguments)], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    )


def finished(process: subprocess.Popen[str]) -> str:
    """What a script printed; an assertion that it ended well."""
    out, err = process.communicate(timeout=100)
    assert process.returncode == 0, err
    return out
