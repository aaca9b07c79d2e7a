"""The figures of cgdb, each next to what it is compared with.

python -m benchmarks              what there is
python -m benchmarks NAME [...]   one of them; --help tells its options
python -m benchmarks all          all that can run here
"""

from __future__ import annotations

import importlib
import os
import sys
import tempfile
from pathlib import Path

DATA = os.environ.get("CGDB_TEST_DATA", "")
ALL: dict[str, list[str]] = {
    "search": ["--stores", "{stores}"],
    "open": ["--stores", "{stores}"],
    "importing": [],
    "combined": ["--stores", "{stores}"],
    "overhead": ["--stores", "{stores}"],
    "encoder": [],
    "shell_start": [],
    "translate": [],
    "relations": [f"{DATA}/maps/virtualhome"],
    "retrieval": [],
    "reranking": [],
}
"""{name: its options when all are run}; in the order in which they are."""
NEEDS_DATA = ("relations", "reranking", "retrieval", "translate")


def main() -> int:
    names = [name for name in ALL if (Path(__file__).parent / f"{name}.py").exists()]
    if len(sys.argv) < 2 or sys.argv[1] in ("-h", "--help"):
        print(__doc__)
        for name in names:
            first = (importlib.import_module(f"benchmarks.{name}").__doc__ or "").partition("\n")[0]
            print(f"  {name:<11}{first}")
        return 0
    wanted = sys.argv[1]
    if wanted == "all":
        with tempfile.TemporaryDirectory(prefix="cgdb-bench-") as stores:
            for name in names:
                if name in NEEDS_DATA and not DATA:
                    print(f"\n== {name}: left out, CGDB_TEST_DATA names no folder of real maps")
                    continue
                print(f"\n== {name}", flush=True)
                run(name, [option.format(stores=stores) for option in ALL[name]])
        return 0
    if wanted not in names:
        print(f"no benchmark '{wanted}'; there are {', '.join(names)}", file=sys.stderr)
        return 2
    run(wanted, sys.argv[2:])
    return 0


def run(name: str, options: list[str]) -> None:
    """Run one benchmark as if it had been called by itself."""
    sys.argv = [f"python -m benchmarks {name}", *options]
    importlib.import_module(f"benchmarks.{name}").main()


if __name__ == "__main__":
    sys.exit(main())
