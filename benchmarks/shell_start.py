"""How long the shell takes from its call to the first prompt, and from there to the first answer; in a real terminal.

The prompt is there before the store is opened; what is measured second is what a person waits who types at once.
"""

from __future__ import annotations

import contextlib
import os
import pty
import select
import signal
import struct
import sys
import tempfile
import termios
import time
from fcntl import ioctl
from importlib.resources import as_file, files
from pathlib import Path

from benchmarks.report import Times, arguments, machine, ms, table

STATEMENT = b'MATCH (o ~ "something to drink") RETURN o LIMIT 3\r'
BUDGET = 0.5
"""Seconds to the first prompt that the shell promises."""


def main() -> None:
    parser = arguments(__doc__)
    parser.add_argument("--rounds", type=int, default=7, help="times that the shell is started (7)")
    options = parser.parse_args()
    with tempfile.TemporaryDirectory(prefix="cgdb-shell-") as folder:
        store = _store(Path(folder))
        _started(store, folder)  # the first start writes byte code and indexes
        runs = [_started(store, folder) for _ in range(options.rounds)]
    prompt, processor, answer = (Times(tuple(run[i] for run in runs)) for i in range(3))
    print(machine())
    table(
        "cgdb STORE, the demo flat, from exec",
        ("", "median ms", "fastest", "slowest"),
        [
            (name, ms(times.median), ms(min(times.seconds)), ms(max(times.seconds)))
            for name, times in (
                ("to the first prompt", prompt),
                ("  of it, time of a processor", processor),
                ("to the first answer, typed at once", answer),
            )
        ],
    )
    print(f"\nthe promise is a prompt within {1000 * BUDGET:.0f} ms: {'kept' if prompt.median < BUDGET else 'BROKEN'}")


def _store(folder: Path) -> Path:
    import cgdb
    from cgdb import ingest
    from cgdb.errors import EncoderError, MissingExtraError

    path = folder / "flat.cgdb"
    with as_file(files("cgdb.cli") / "flat.json") as flat, cgdb.open(path, create=True) as db:
        db.add(ingest.load(flat))
        db.prepare()
        try:
            for _ in db.encode():
                pass
        except (EncoderError, MissingExtraError) as error:
            print(f"without the text encoder: {error.message}", file=sys.stderr)
    return path


def _started(store: Path, folder: str) -> tuple[float, float, float]:
    """Seconds from exec to the prompt, those of a processor in them, and seconds to the answer."""
    command = str(Path(sys.executable).with_name("cgdb"))
    environment = {**os.environ, "TERM": "xterm-256color", "XDG_STATE_HOME": folder, "XDG_CONFIG_HOME": folder}
    begun = time.perf_counter()
    child, terminal = pty.fork()
    if child == 0:
        os.execve(command, [command, str(store)], environment)
    ioctl(terminal, termios.TIOCSWINSZ, struct.pack("HHHH", 40, 120, 0, 0))
    try:
        _read_until(terminal, b"cgdb> ")
        prompt = time.perf_counter() - begun
        processor = _processor_seconds(child)
        os.write(terminal, STATEMENT)
        _read_until(terminal, b"3 rows")
        answer = time.perf_counter() - begun
        time.sleep(0.5)  # between prompts the terminal itself would take the Ctrl-D
        os.write(terminal, b"\x04")
        _read_until(terminal, None)
    finally:
        os.close(terminal)
        with contextlib.suppress(ProcessLookupError):
            os.kill(child, signal.SIGHUP)
        os.waitpid(child, 0)
    return prompt, processor, answer


def _processor_seconds(child: int) -> float:
    """What a process has used of a processor so far, where the system says so: it does not depend on the load."""
    try:
        fields = Path(f"/proc/{child}/stat").read_text().rpartition(")")[2].split()
    except OSError:
        return float("nan")
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


def _read_until(terminal: int, wanted: bytes | None, seconds: float = 30.0) -> None:
    """Read until these bytes have come, or the end; answer what a terminal is asked about its cursor."""
    seen = b""
    end = time.monotonic() + seconds
    while wanted is None or wanted not in seen:
        ready, _, _ = select.select([terminal], [], [], max(0.0, end - time.monotonic()))
        if not ready:
            raise TimeoutError(f"no {wanted!r} within {seconds:g} s; the end of what came: {seen[-400:]!r}")
        try:
            new = os.read(terminal, 65536)
        except OSError:
            new = b""
        if not new:
            if wanted is None:
                return
            raise EOFError(f"the shell ended before {wanted!r}: {seen[-400:]!r}")
        if b"\x1b[6n" in new:
            os.write(terminal, b"\x1b[1;1R")
        seen += new


if __name__ == "__main__":
    main()
