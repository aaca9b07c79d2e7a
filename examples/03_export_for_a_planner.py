"""Get a map out of the store: as what a language model plans with, and as files for other tools.

python examples/03_export_for_a_planner.py
"""

import tempfile
from pathlib import Path

import cgdb
import cgdb.ingest
from cgdb.export import document

MAP = Path(__file__).parent.parent / "cli" / "flat.json"

with tempfile.TemporaryDirectory() as folder, cgdb.open(Path(folder) / "flat.cgdb", create=True) as db:
    db.add(cgdb.ingest.load(MAP))

    for name in ("flat.planner.json", "flat.json", "flat.node-link.json", "flat.graphml"):
        path = Path(folder) / name
        db.export("flat", path)
        print(f"{name}: {path.stat().st_size} bytes")

    # What the store gave can be read again, without loss in its own format.
    assert len(cgdb.ingest.load(Path(folder) / "flat.json", relate=False).objects) == len(db.scene("flat").objects)

    # For a prompt with little room: at most about 4200 tokens, with the relations that still fit.
    planner = document(db.scene("flat"), "planner", max_tokens=4200, relations=True)
    lines = "".join(planner.pieces).splitlines()
    print(*lines[:4], "...", *lines[-6:], sep="\n")
    print(*planner.notes, sep="\n")
