"""Which scenes of which stores are evaluated against which truths; and what their commands have in common."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import cgdb
from cgdb.cli import render
from cgdb.errors import UsageError, did_you_mean, one_of
from cgdb.scene import SceneGraph

NODES_AND_EDGES = ("scene", "nodes", "node p.", "valid", "dupl.", "edges", "edge p.")
"""Columns of every table of scene graphs; p.: precision."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Chosen:
    """A scene of a store. name: as it is shown, with its store where several are evaluated."""

    store: str
    scene: str
    name: str

    def read(self, *, features: bool = False, clouds: bool = True) -> SceneGraph:
        """The scene in memory."""
        with cgdb.open(self.store, text_encoder=None) as db:
            return db.scene(self.scene, features=features, clouds=clouds)


def chosen(stores: Sequence[str], wanted: Sequence[str] | None) -> list[Chosen]:
    """The scenes that are asked for, all where none is; UsageError for one that no store has."""
    there: list[tuple[str, str]] = []
    for store in stores:
        with cgdb.open(store, text_encoder=None) as db:
            scenes = [(store, info.name) for info in db.scenes()]
        if not scenes:
            raise UsageError(f"{store}: the store holds no scene to evaluate")
        there += scenes
    for name in wanted or ():
        if name not in {scene for _, scene in there}:
            known = [scene for _, scene in there]
            raise UsageError(
                f"there is no scene '{name[:80]}'",
                hint=did_you_mean(name, known) or f"there are {one_of(known)}",
            )
    taken = [(store, scene) for store, scene in there if not wanted or scene in wanted]
    names = [scene for _, scene in taken]
    return [
        Chosen(store=store, scene=scene, name=scene if names.count(scene) == 1 else f"{Path(store).name}: {scene}")
        for store, scene in taken
    ]


def paired(scenes: Sequence[Chosen], truths: Sequence[str]) -> list[tuple[Chosen, str]]:
    """Each scene with its truth: SCENE=PATH; or a path that is named like the scene; or the only one of each."""
    told: dict[str, str] = {}
    unnamed: list[str] = []
    known = {one.scene for one in scenes}
    for truth in truths:
        name, equals, path = truth.partition("=")
        if equals and name in known:
            told[name] = path
        elif equals and not Path(truth).exists():
            raise UsageError(
                f"--truth: there is no scene '{name[:80]}'", hint=did_you_mean(name, known) or one_of(known)
            )
        else:
            unnamed.append(truth)
    for one in scenes:
        fitting = [path for path in unnamed if one.scene in _called(path)]
        # A folder of truths: one for each scene.
        fitting = fitting or [str(inner) for path in unnamed for inner in _inside(path, one.scene)]
        if one.scene not in told and len(fitting) == 1:
            told[one.scene] = fitting[0]
    if not told and len(unnamed) == 1 and len(known) == 1:
        told = dict.fromkeys(known, unnamed[0])
    without = [one.name for one in scenes if one.scene not in told]
    if without:
        raise UsageError(
            f"no truth is given for {one_of(without)}",
            hint="--truth SCENE=PATH for each, or --scene for those to evaluate",
        )
    return [(one, told[one.scene]) for one in scenes]


def _called(path: str) -> set[str]:
    """The names that a truth goes by: its own, without its ending, or its folder's where all such files have one."""
    whole = Path(path).resolve()
    names = {whole.name, whole.stem}
    if whole.name in ("objects.npz", "truth.npz", "truth.ply", "truth.json", "mesh_semantic.ply"):
        names |= {whole.parent.name, whole.parent.parent.name if whole.parent.name == "habitat" else whole.parent.name}
    for ending in ("_graph", "_vh_clean_2.labels", ".aggregation"):
        names |= {name.removesuffix(ending) for name in names}
    return names


def _inside(path: str, scene: str) -> list[Path]:
    folder = Path(path)
    if not folder.is_dir() or "/" in scene or scene in (".", ".."):
        return []
    return [
        place
        for place in (folder / scene, *(folder / f"{scene}{end}" for end in (".npz", ".ply", ".json")))
        if place.exists()
    ][:1]


def share(value: float | None) -> str:
    """A share for a table."""
    return "-" if value is None else f"{value:.2f}"


def percent(value: float) -> str:
    """A share in per cent with two decimals, as the paper prints them."""
    return f"{100 * value:.2f}"


def mean(values: Sequence[float | None]) -> float | None:
    """Of those that are there; None where none is."""
    there = [value for value in values if value is not None]
    return sum(there) / len(there) if there else None


def table(title: str, columns: Sequence[str], rows: Sequence[Sequence[str]]) -> None:
    """A table under its title, unless it has no row. Figures line up at their right ends, names at their left."""
    if not rows:
        return
    line(title)
    cells = [[render.clean(cell) for cell in row] for row in (columns, *rows)]
    for i in range(len(columns)):
        if all(_figure(row[i]) for row in cells[1:]):
            width = max(len(row[i]) for row in cells)
            for row in cells:
                row[i] = row[i].rjust(width)
    render.table(render.console(), cells[0], cells[1:])


def line(text: str) -> None:
    """A line of the report; names in it may come from a stranger's map."""
    lead = "\n" if text.startswith("\n") else ""
    render.console().print(lead + render.clean(text.lstrip("\n")), markup=False, soft_wrap=True)


def _figure(text: str) -> bool:
    return not text or text == "-" or text[0].isdigit()


def write_json(value: Any) -> None:
    """The figures for a machine."""
    render.write(json.dumps(value, ensure_ascii=False, indent=2))
