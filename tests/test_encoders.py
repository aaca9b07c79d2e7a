"""Which encoder answers for a feature space: the one given, the one the map names, or none with the reason."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import cgdb
from cgdb.cli.app import main


def scene(encoder: str | None) -> cgdb.SceneGraph:
    return cgdb.SceneGraph(
        name="s",
        objects=(
            cgdb.SceneObject(id=1, features={"clip": np.array([1, 0, 0], np.float32)}),
            cgdb.SceneObject(id=2, features={"clip": np.array([0, 1, 0], np.float32)}),
        ),
        spaces=(cgdb.FeatureSpace(name="clip", dimension=3, encoder=encoder),),
    )


def names(folder: Path) -> Path:
    path = folder / "names.npz"
    np.savez(path, names=np.array(["cup", "table"]), vectors=np.eye(3, dtype=np.float32)[:2])
    return path


@pytest.mark.parametrize(
    "encoder", ["vocabulary:/etc/passwd", "open_clip:ViT-B-32:/tmp/weights.pt", "open_clip:../x:y", "hf-hub:x/y"]
)
def test_a_map_cannot_have_files_opened(tmp_path: Path, encoder: str) -> None:
    with cgdb.open(tmp_path / "a.cgdb", create=True, text_encoder=None) as db:
        db.add(scene(encoder))
        result = db.query("MATCH (o ~ 'cup') RETURN o")
        assert any("no model's name" in line for line in result.warnings)


def test_a_vocabulary_lets_features_be_asked_in_words(tmp_path: Path) -> None:
    vocabulary = cgdb.Vocabulary.load(names(tmp_path))
    with cgdb.open(tmp_path / "a.cgdb", create=True, text_encoder=None, space_encoders={"clip": vocabulary}) as db:
        db.add(scene(None))
        assert db.search("table", space="clip", k=1).ids == [2]
        assert db.query("MATCH (o ~ 'cup') RETURN o.id LIMIT 1")[0][0] == 1
        missing = db.query("MATCH (o ~ 'elephant') RETURN o.id")
        assert any("left out" in line for line in missing.warnings)


def test_the_command_line_takes_an_encoder(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    store = tmp_path / "a.cgdb"
    with cgdb.open(store, create=True, text_encoder=None) as db:
        db.add(scene(None))
    given = f"clip=vocabulary:{names(tmp_path)}"
    assert main(["search", str(store), "table", "--space", "clip", "--encoder", given, "--format", "csv"]) == 0
    assert capfd.readouterr().out.splitlines()[1].startswith("2,")


def test_no_encoder_is_said(tmp_path: Path) -> None:
    with cgdb.open(tmp_path / "a.cgdb", create=True, text_encoder=None) as db:
        db.add(scene(None))
        assert any("does not say what encoder" in line for line in db.query("MATCH (o ~ 'cup') RETURN o").warnings)
        with pytest.raises(cgdb.CgdbError, match="does not say what encoder"):
            db.search("cup", space="clip")
