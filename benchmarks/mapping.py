"""The mapping loop: CPU seconds per frame, growth, memory and quality, next to the paper's own code.

python -m benchmarks.mapping SEQUENCE...   generated sequences with their truth (objects.npz) beside them

--wall measures wall time instead, with one thread and with all cores.

The reference's figures were measured with its own code (branch main, CPU, detector preset: overlap, sim_sum 1.2, voxel
2.5 cm, DBSCAN 0.1, merge every 20 frames) on the sequences of the same generator and seed, 200 frames of 640 x 480, one
thread. They are quoted, not run. Each sequence is mapped here in a process of its own, with one thread, from the same
detections. The quality of the reference was counted by a like measure, of points by the nearest true surface: true
masks have a purity of .68 by that measure and .65 by this one, the same masks less two pixels .985 and .95.
"""

from __future__ import annotations

import argparse
import json
import os
import resource
import subprocess
import sys
import tempfile
import time
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from benchmarks.report import machine, table


@dataclass(frozen=True, slots=True, kw_only=True)
class Reference:
    """The reference on one sequence."""

    cpu: float
    peak_gb: float
    file_mb: float
    open_s: str
    found: str
    missed: int
    duplicates: int
    purity: float


REFERENCE = {
    "o25_f200_s0_d512": Reference(
        cpu=1.22, peak_gb=2.2, file_mb=18.8, open_s="3.0-5.6", found="23/23", missed=0, duplicates=0, purity=0.60
    ),
    "o50_f200_s0_d512": Reference(
        cpu=1.45, peak_gb=3.3, file_mb=20.2, open_s="7.9-11", found="48/49", missed=1, duplicates=1, purity=0.58
    ),
    "o50_f200_s0_d512_n0": Reference(
        cpu=0.77, peak_gb=3.2, file_mb=11.9, open_s="8.8", found="48/49", missed=1, duplicates=6, purity=0.75
    ),
    "o100_f200_s0_d512": Reference(
        cpu=2.69, peak_gb=3.0, file_mb=36.9, open_s="9.8", found="95/95", missed=0, duplicates=2, purity=0.67
    ),
    "o200_f200_s0_d512": Reference(
        cpu=2.61, peak_gb=3.6, file_mb=50.4, open_s="8.2", found="181/185", missed=4, duplicates=2, purity=0.72
    ),
    "o400_f200_s0_d512": Reference(
        cpu=2.97, peak_gb=4.1, file_mb=57.6, open_s="16.3", found="325/346", missed=21, duplicates=2, purity=0.75
    ),
}
"""{the generator's name of a sequence: the reference on it}."""

ONE_THREAD = dict.fromkeys(("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"), "1")


def main() -> None:
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("sequences", nargs="+", type=Path, metavar="SEQUENCE")
    parser.add_argument("--detections", help="a folder within each sequence (the arrays in det)")
    parser.add_argument("--wall", action="store_true", help="wall time only: one thread, and all cores")
    parser.add_argument("--one", action="store_true", help=argparse.SUPPRESS)
    parser.add_argument("--ahead", type=int, default=0, help=argparse.SUPPRESS)
    options = parser.parse_args()
    if options.one:
        sequence = options.sequences[0]
        one = wall(sequence, options.ahead) if options.wall else measure(sequence, options.detections)
        print(json.dumps(one))
        return
    if options.wall:
        print(machine())
        report_wall(options.sequences)
        return
    found = []
    for sequence in options.sequences:
        command = [sys.executable, "-m", "benchmarks.mapping", "--one", str(sequence)]
        if options.detections:
            command += ["--detections", options.detections]
        done = subprocess.run(command, env={**os.environ, **ONE_THREAD}, check=True, stdout=subprocess.PIPE)
        found.append(json.loads(done.stdout))
        print(f"mapped {sequence.name}", file=sys.stderr)
    print(machine())
    report(found)


def measure(sequence: Path, detections: str | None) -> dict[str, Any]:
    """Map one sequence; everything that is reported about it."""
    import cgdb
    from cgdb.ingest.detections.files import find_detections
    from cgdb.ingest.evaluation.mapping import evaluate, read_truth
    from cgdb.ingest.frames.recording import open_recording
    from cgdb.ingest.mapping.mapper import Mapper

    recording = open_recording(sequence)
    detector = find_detections(sequence, path=sequence / detections if detections else None)
    assert detector is not None
    mapper = Mapper()
    reading, looking, mapping = [], [], []
    frames = recording.frames()
    while True:
        at = time.process_time()
        frame = next(frames, None)
        if frame is None:
            break
        reading.append(time.process_time() - at)
        at = time.process_time()
        seen = detector(frame)
        looking.append(time.process_time() - at)
        at = time.process_time()
        mapper.step(frame, seen)
        mapping.append(time.process_time() - at)
    at = time.process_time()
    mapper.finish()
    finish = time.process_time() - at
    at = time.process_time()
    scene = mapper.scene("bench")
    building = time.process_time() - at
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
    with tempfile.TemporaryDirectory(prefix="cgdb-bench-") as folder:
        path = Path(folder) / "map.cgdb"
        with cgdb.open(path, create=True, text_encoder=None) as db:
            db.add(scene)
            db.prepare("bench")
        size = sum(file.stat().st_size for file in path.rglob("*") if file.is_file())
        opened = time.perf_counter()
        with cgdb.open(path, text_encoder=None) as db:
            db.query("MATCH (o) RETURN o LIMIT 3")
        opened = time.perf_counter() - opened
    score = evaluate(scene, read_truth(sequence))
    return {
        "name": sequence.name,
        "frames": len(mapping),
        "read": sum(reading) / len(mapping),
        "detections": sum(looking) / len(mapping),
        "map": sum(mapping) / len(mapping),
        "total": (sum(reading) + sum(looking) + sum(mapping) + finish + building) / len(mapping),
        "finish": finish,
        "growth": growth(sequence, detections, mapper, mapping[: len(mapping) // 4]),
        "p95": sorted(mapping)[int(0.95 * len(mapping))],
        "slowest": max(mapping),
        "peak_mb": peak,
        "size_mb": size / 2**20,
        "open_s": opened,
        "score": score.to_json(),
    }


def wall(sequence: Path, ahead: int) -> dict[str, float]:
    """Wall and CPU seconds per frame of the whole loop."""
    from cgdb.ingest.detections.files import find_detections
    from cgdb.ingest.frames.recording import open_recording
    from cgdb.ingest.mapping.ahead import detected
    from cgdb.ingest.mapping.mapper import Mapper

    detector = find_detections(sequence, path=None)
    assert detector is not None
    mapper = Mapper()
    began, cpu = time.perf_counter(), time.process_time()
    for frame, found in detected(open_recording(sequence).frames(), detector, ahead):
        assert not isinstance(found, Exception)
        mapper.step(frame, found)
    mapper.finish()
    mapper.scene("bench")
    return {
        "wall": (time.perf_counter() - began) / mapper.frames,
        "cpu": (time.process_time() - cpu) / mapper.frames,
    }


def report_wall(sequences: list[Path]) -> None:
    """Wall time with one thread, and with reading ahead and every core; turn by turn, so that both meet one machine."""
    rows = []
    for sequence in sequences:
        cells: list[object] = [sequence.name]
        for ahead, limits in (("0", ONE_THREAD), ("2", {})):
            command = [sys.executable, "-m", "benchmarks.mapping", "--one", "--wall", "--ahead", ahead, str(sequence)]
            free = {name: value for name, value in os.environ.items() if name not in ONE_THREAD}
            done = subprocess.run(command, env={**free, **limits}, check=True, stdout=subprocess.PIPE)
            one = json.loads(done.stdout)
            cells += [f"{1000 * one['wall']:.0f}", f"{1000 * one['cpu']:.0f}"]
        rows.append(cells)
    table("Per frame, ms", ["", "one thread: wall", "CPU", "all cores: wall", "CPU"], rows)


def growth(sequence: Path, detections: str | None, mapper: Any, before: list[float]) -> float:
    """The CPU time of the first quarter's frames on the whole map, over what they took when it was nearly empty."""
    from cgdb.ingest.detections.files import find_detections
    from cgdb.ingest.frames.recording import open_recording

    detector = find_detections(sequence, path=sequence / detections if detections else None)
    assert detector is not None
    taken = 0.0
    for frame in open_recording(sequence).frames(end=len(before)):
        seen = detector(frame)
        at = time.process_time()
        mapper.step(frame, seen)
        taken += time.process_time() - at
    return taken / sum(before)


def report(found: list[dict[str, Any]]) -> None:
    """The tables."""
    rows = []
    for one in found:
        known = REFERENCE.get(one["name"])
        rows.append(
            [
                one["name"],
                f"{1000 * one['read']:.0f}",
                f"{1000 * one['detections']:.0f}",
                f"{1000 * one['map']:.0f}",
                f"{1000 * one['total']:.0f}",
                f"{1000 * known.cpu:.0f}" if known else "",
                f"{known.cpu / one['total']:.0f} x" if known else "",
                f"{one['growth']:.2f}",
                f"{1000 * one['p95']:.0f}",
                f"{1000 * one['slowest']:.0f}",
                f"{one['finish']:.2f}",
            ]
        )
    header = [
        "CPU per frame, ms",
        "read",
        "detections",
        "map",
        "all",
        "reference",
        "faster",
        "growth",
        "95 %",
        "slowest",
    ]
    table(
        "Time (growth: the first quarter's frames again on the whole map, over the first time; end: final merge, s)",
        [*header, "end"],
        rows,
    )
    rows = []
    for one in found:
        known, score = REFERENCE.get(one["name"]), one["score"]
        for who in ("cgdb", "reference") if known else ("cgdb",):
            if who == "cgdb":
                cells = [
                    f"{score['found']}/{score['true']}",
                    score["missed"],
                    score["duplicates"],
                    f"{score['purity']:.2f}",
                    f"{score['completeness']:.3f} / {score['completeness_fine']:.3f}",
                    f"{one['peak_mb']:.0f}",
                    f"{one['size_mb']:.1f}",
                    f"{one['open_s']:.2f}",
                ]
            else:
                assert known is not None
                cells = [known.found, known.missed, known.duplicates, f"{known.purity:.2f}", ""]
                cells += [f"{1000 * known.peak_gb:.0f}", f"{known.file_mb:.1f}", known.open_s]
            rows.append([f"{one['name']}  {who}", *cells])
    table(
        "Maps (completeness: of the true surface, within 5 and 2.5 cm)",
        ["", "found", "missed", "duplicates", "purity", "complete", "peak MB", "on disk MB", "open s"],
        rows,
    )


if __name__ == "__main__":
    main()
