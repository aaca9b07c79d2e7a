"""The text encoder: preparation, first answer in a fresh process, texts per second, difference to the reference.

    python benchmarks/encoder.py [--texts 10000]

Each figure stands beside its aim. Other work on the machine slows all of them: the processor time is printed too.
"""

from __future__ import annotations

import argparse
import json
import os
import random
import statistics
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np

from cgdb.meaning.embed import Encoder, text_encoder

GOLDEN = Path(__file__).parent.parent / "tests" / "golden" / "minilm_vectors.json"
FIRST_ANSWER = """
import time
start = time.perf_counter()
from cgdb.meaning.embed import text_encoder
text_encoder().texts(["something to sit on"])
print(time.perf_counter() - start)
"""
WORDS = (
    "red blue wooden small large round old metal chair table lamp sofa cup book shelf near with under white black "
    "plastic corner kitchen bowl plate plant window pillow bed glass leather striped floor wall open folded ceramic"
)


def first_answer(cache: str) -> tuple[float, float]:
    """Seconds of a fresh process: imports to answer as it sees them, and with the interpreter's own start."""
    start = time.perf_counter()
    run = subprocess.run(
        [sys.executable, "-c", FIRST_ANSWER],
        capture_output=True,
        text=True,
        check=True,
        env=os.environ | {"XDG_CACHE_HOME": cache},
    )
    return float(run.stdout), time.perf_counter() - start


def captions(count: int) -> list[str]:
    """Distinct captions of 7 to 13 words."""
    words = WORDS.split()
    dice = random.Random(1)
    found: dict[str, None] = {}
    while len(found) < count:
        found[" ".join(dice.choices(words, k=dice.randint(7, 13)))] = None
    return list(found)


def difference(encoder: Encoder) -> float:
    """The largest difference of a component to what sentence-transformers gives (kept to 5 decimals)."""
    golden = json.loads(GOLDEN.read_text("utf-8"))
    return float(np.abs(encoder.texts(golden["texts"]) - np.array(golden["vectors"])).max())


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0] if __doc__ else None)
    parser.add_argument("--texts", type=int, default=10_000, help="captions to encode (default: 10,000)")
    count = parser.parse_args().texts
    with tempfile.TemporaryDirectory() as cache:
        # The first start verifies the model's 90 MB; the later ones find that it did.
        preparation, _ = first_answer(cache)
        later = [first_answer(cache) for _ in range(7)]
    inside = statistics.median(seconds for seconds, _ in later)
    whole = statistics.median(seconds for _, seconds in later)
    encoder = text_encoder()
    texts = captions(count)
    encoder.texts(texts[:500])
    wall, busy = time.perf_counter(), time.process_time()
    encoder.texts(texts)
    wall, busy = time.perf_counter() - wall, time.process_time() - busy
    rows = (
        ("first start, model verified", f"{preparation:.2f} s", "once"),
        ("first answer, fresh process", f"{inside:.2f} s ({whole:.2f} s with the interpreter)", "under 1 s"),
        (f"{count:,} captions", f"{count / wall:.0f} texts/s ({count / busy:.0f} per processor second)", "500 texts/s"),
        ("difference to the reference", f"{difference(encoder):.1e}", "under 1e-4"),
    )
    for what, figure, aim in rows:
        print(f"{what:<30}{figure:<44}aim: {aim}")


if __name__ == "__main__":
    main()
