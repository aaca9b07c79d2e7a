"""The mapped folders: nothing forgotten in a wheel, one way in, and nothing heavy behind a bare import."""

from __future__ import annotations

import subprocess
import sys
import tomllib
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
ROOMS = ("cgdb", "grammar", "ingest", "cli")
HEAVY = (
    "torch",
    "open3d",
    "faiss",
    "kuzu",
    "ladybug",
    "rich",
    "prompt_toolkit",
    "networkx",
    "sqlalchemy",
    "numpy",
    "lark",
)


def test_every_folder_with_code_is_a_package() -> None:
    config = tomllib.loads((ROOT / "pyproject.toml").read_text())["tool"]["setuptools"]
    packages = set(config["packages"])
    for room in ROOMS:
        for folder in {path.parent for path in (ROOT / room).rglob("*.py") if "__pycache__" not in path.parts}:
            parts = folder.relative_to(ROOT).parts
            if any((ROOT.joinpath(*parts[: i + 1])).is_symlink() for i in range(len(parts))):
                continue
            name = ".".join(parts if parts[0] == "cgdb" else ("cgdb", *parts))
            assert name in packages, f"{folder} is missing from [tool.setuptools] packages"
            assert (folder / "__init__.py").exists()


def test_links_lead_to_the_mapped_folders() -> None:
    for room in ROOMS[1:]:
        link = ROOT / "cgdb" / room
        assert link.is_symlink()
        assert link.readlink() == Path("..") / room


@pytest.mark.parametrize(
    "statement", ["import cgdb", "import cgdb.ingest", "import cgdb.cli.app; cgdb.cli.app._parser()"]
)
def test_a_bare_import_loads_nothing_heavy(statement: str) -> None:
    code = f"import sys; {statement}; print(*sorted(set(sys.modules) & set({HEAVY!r})))"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.split() == []


def test_help_loads_nothing_heavy() -> None:
    code = (
        "import sys\nfrom cgdb.cli.app import main\n"
        "try:\n    main(['--help'])\nexcept SystemExit:\n    pass\n"
        f"print(*sorted(set(sys.modules) & set({HEAVY!r})), file=sys.stderr)"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert "commands:" in done.stdout
    assert done.stderr.split() == []


@pytest.mark.slow
def test_an_installed_wheel_answers_a_query(tmp_path: Path) -> None:
    subprocess.run(
        [sys.executable, "-m", "pip", "wheel", "--quiet", "--no-deps", "-w", str(tmp_path), str(ROOT)],
        check=True,
        capture_output=True,
    )
    (wheel,) = tmp_path.glob("cgdb-*.whl")
    site = tmp_path / "site"
    subprocess.run(
        [sys.executable, "-m", "pip", "install", "--quiet", "--no-deps", "--target", str(site), str(wheel)],
        check=True,
        capture_output=True,
    )
    code = (
        f"import sys; sys.path.insert(0, {str(site)!r})\n"
        "import cgdb, cgdb.cli.app\n"
        f"assert cgdb.__file__.startswith({str(site)!r}), cgdb.__file__\n"
        "sys.exit(cgdb.cli.app.main(['demo']))"
    )
    done = subprocess.run([sys.executable, "-P", "-c", code], cwd=tmp_path, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    assert "potted plant" in done.stdout
