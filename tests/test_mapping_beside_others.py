"""What others say of a scene's objects, in other processes, while a map goes on being written into the same store."""

from __future__ import annotations

import json
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import cgdb
from cgdb.cli.app import main
from cgdb.cli.mapping_run import Run
from cgdb.scene import SceneGraph, SceneObject
from tests.mapping_rooms import ROOM
from tests.model_server import ModelServer
from tests.test_mapping_cli import write_recording

pytestmark = pytest.mark.usefixtures("no_model")

COMMANDS = """
import sys
from cgdb.cli.app import main
for line in sys.argv[1:]:
    assert main(line.split()) == 0, line
"""


def knowing(body: dict[str, Any]) -> str:
    """A model of pictures, of relations and of everyday things, all in one."""
    asked = body["messages"][0]["content"]
    if "affordances" in asked:
        return json.dumps({"objects": [{"number": n, "materials": ["wood"]} for n in range(1, 9)]})
    if "arranged" in asked:
        said = {"relation": "other", "other": "goes with", "reason": "it does", "sure": "likely"}
        return json.dumps({"pairs": [{"number": n, **said} for n in range(1, 7)]})
    return json.dumps({"captions": [], "summary": "A thing.", "possible_tags": [], "object_tag": "invalid"})


def nameless(root: Path) -> Path:
    """A recording whose detections have features and no names."""
    write_recording(root)
    for path in (root / "det").glob("*.npz"):
        held = np.load(path)
        np.savez(path, mask=held["mask"], image_feats=held["image_feats"])
    (root / "gsa_classes_x.json").unlink()
    return root


def after_the_first_revision(monkeypatch: pytest.MonkeyPatch, others: Callable[[], object]) -> list[SceneGraph]:
    """Have others at work once, between the first revision of a map and its second; what the map itself wrote."""
    written: list[SceneGraph] = []
    write = Run.write

    def watched(run: Run, *, last: bool = False) -> tuple[SceneGraph, int | None]:
        scene, revision = write(run, last=last)
        written.append(scene)
        if len(written) == 1:
            others()
        return scene, revision

    monkeypatch.setattr(Run, "write", watched)
    return written


def stored(store: Path) -> SceneGraph:
    with cgdb.open(store, text_encoder=None) as db:
        return db.scene("room", views=True)


def by_id(scene: SceneGraph) -> dict[int | str, SceneObject]:
    return {obj.id: obj for obj in scene.objects}


@pytest.mark.slow
def test_what_models_add_in_another_process_stays(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    root, store = nameless(tmp_path / "room"), tmp_path / "s.cgdb"
    np.savez(
        tmp_path / "names.npz", names=[box.name for box in ROOM], vectors=np.eye(len(ROOM), dtype=np.float32) + 0.2
    )
    said: list[SceneGraph] = []

    def others() -> None:
        commands = [
            f"tag {store} --vocabulary {tmp_path / 'names.npz'} --quiet",
            *(f"{what} {store} --quiet" for what in ("relate", "caption", "enrich")),
        ]
        subprocess.run([sys.executable, "-c", COMMANDS, *commands], check=True, timeout=60)
        said.append(stored(store))

    with ModelServer(knowing) as at:
        monkeypatch.setenv("CGDB_LLM_BASE_URL", at.url)
        monkeypatch.setenv("CGDB_LLM_MODEL", "little")
        after_the_first_revision(monkeypatch, others)
        assert main(["map", str(root), "--into", str(store), "--every", "3", "--quiet"]) == 0
    with cgdb.open(store, text_encoder=None) as db:
        kinds = [revision.kind for revision in db.revisions("room")]
    assert kinds == ["map", "tag", "relate", "caption", "enrich", "map", "map"]
    (given,), now = said, stored(store)
    there = by_id(now).keys() & by_id(given).keys()
    assert len(there) >= 3
    for id in there:
        before, after = by_id(given)[id], by_id(now)[id]
        assert before.tag is not None and before.caption == "A thing." and before.properties["materials"] == ("wood",)
        assert (after.tag, after.tags, after.caption) == (before.tag, before.tags, before.caption)
        own = {"background", "first_frame", "last_frame", "n_views"}
        assert {name: value for name, value in after.properties.items() if name not in own} == {
            name: value for name, value in before.properties.items() if name not in own
        }
        assert (after.n_observations or 0) > (before.n_observations or 0), "the map went on with it"
    goes_with = [relation for relation in given.relations if relation.origin == "llm"]
    assert goes_with
    assert [relation for relation in now.relations if relation.origin == "llm"] == [
        relation for relation in goes_with if {relation.source, relation.target} <= there
    ]


RENAMED = """
import dataclasses, sys
import cgdb
with cgdb.open(sys.argv[1], text_encoder=None) as db:
    vase, box = (next(o for o in db.scene("room").objects if o.tag == tag) for tag in ("vase", "box"))
    with db.write("room", on_existing="merge") as writer:
        writer.objects([dataclasses.replace(vase, tag="urn"), dataclasses.replace(box, properties={"owner": "Ada"})])
        writer.relations([cgdb.Relation(source=vase.id, target=box.id, label="matches", origin="human")])
"""


def test_what_a_person_says_stays_and_what_the_map_says_goes_on(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    root, store = write_recording(tmp_path / "room"), tmp_path / "s.cgdb"
    written = after_the_first_revision(
        monkeypatch, lambda: subprocess.run([sys.executable, "-c", RENAMED, str(store)], check=True, timeout=60)
    )
    assert main(["map", str(root), "--into", str(store), "--every", "3", "--quiet"]) == 0
    assert len(written) == 3
    scene = stored(store)
    tags = {obj.tag: obj for obj in scene.objects}
    assert tags.keys() == {"floor", "wall", "table", "box", "urn"}
    assert tags["box"].properties["owner"] == "Ada"
    assert (tags["box"].properties["last_frame"], tags["urn"].n_observations) == (7, 8)
    assert [(r.source, r.label, r.target) for r in scene.relations if r.origin == "human"] == [
        (tags["urn"].id, "matches", tags["box"].id)
    ]


def test_what_was_said_of_a_thing_that_is_gone_goes_with_it(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    root, store = write_recording(tmp_path / "room"), tmp_path / "s.cgdb"

    def others() -> None:
        subprocess.run([sys.executable, "-c", RENAMED, str(store)], check=True, timeout=60)
        run = watched[0]
        vase = [number for number, obj in enumerate(run.mapper.objects.all) if obj.label == "vase"]
        into = np.arange(len(run.mapper.objects.all))
        into[vase] = next(number for number, obj in enumerate(run.mapper.objects.all) if obj.label == "table")
        run.mapper.objects.merge(into, run.mapper.voxels)

    watched: list[Run] = []
    step = Run.run

    def running(run: Run) -> int:
        watched.append(run)
        return step(run)

    monkeypatch.setattr(Run, "run", running)
    after_the_first_revision(monkeypatch, others)
    assert main(["map", str(root), "--into", str(store), "--every", "4", "--end", "5", "--quiet"]) == 0
    scene = stored(store)
    assert "urn" not in {obj.tag for obj in scene.objects}
    assert [relation for relation in scene.relations if relation.origin == "human"] == []


def test_a_scene_that_somebody_removes_is_written_again(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    root, store = write_recording(tmp_path / "room"), tmp_path / "s.cgdb"
    code = "import cgdb, sys\nwith cgdb.open(sys.argv[1]) as db: db.remove('room')"
    after_the_first_revision(
        monkeypatch, lambda: subprocess.run([sys.executable, "-c", code, str(store)], check=True, timeout=60)
    )
    assert main(["map", str(root), "--into", str(store), "--every", "3", "--quiet"]) == 0
    assert len(stored(store).objects) == 5
