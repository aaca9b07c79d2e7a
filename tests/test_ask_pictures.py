"""Asking with a picture: described by a model that sees, compared where a space has an image tower."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import cgdb
from cgdb.database import Database
from cgdb.errors import UsageError
from cgdb.scene import SceneGraph
from cgdb.testing import store
from tests.asked_kitchen import DEGREES, KITCHEN, QUESTION, RIGHT, brain, model, prompt, thing
from tests.model_server import ModelServer, error

pytestmark = pytest.mark.usefixtures("no_model")


@pytest.fixture
def db() -> Iterator[Database]:
    with store(KITCHEN, degrees=DEGREES) as opened:
        yield opened


@pytest.fixture
def picture(tmp_path: Path) -> Path:
    from PIL import Image

    path = tmp_path / "photo.png"
    Image.new("RGB", (2000, 1500), "orange").save(path)
    return path


def test_a_picture_is_described_and_joins_the_question(db: Database, picture: Path) -> None:
    def think(body: dict[str, Any]) -> str:
        content = body["messages"][-1]["content"]
        if isinstance(content, list):
            url = content[1]["image_url"]["url"]
            assert url.startswith("data:image/jpeg;base64,")
            assert len(url) < 60_000, "it is made small"
            return "A thirsty child with an orange."
        return str(brain(RIGHT)(body))

    with ModelServer(think) as at:
        answer = db.ask("Something this person would like", model=model(at), image=picture)
        assert "A thirsty child with an orange." in prompt(at.requests[1])
        assert answer.usage.calls == 3
        assert any("thirsty child" in line for line in answer.understood)


def test_a_model_that_cannot_see_leaves_the_question(db: Database, picture: Path) -> None:
    def think(body: dict[str, Any]) -> Any:
        blind = isinstance(body["messages"][-1]["content"], list)
        return error(400, "image input is not supported") if blind else brain(RIGHT)(body)

    with ModelServer(think) as at:
        answer = db.ask(QUESTION, model=model(at), image=picture)
        assert answer.ids == (2,)
        assert any("image input is not supported" in line for line in answer.warnings)


def test_a_picture_without_anything_that_sees_it(db: Database, picture: Path) -> None:
    answer = db.ask("cushion", model=False, image=picture)
    assert answer.ids == (4,)
    assert any("picture was left out" in line for line in answer.warnings)
    with pytest.raises(UsageError, match="nothing here can look at a picture"):
        db.ask("", model=False, image=picture)


class Colours:
    """An encoder of pictures by their mean colour; of texts that are colours."""

    name = "colours"
    dimension = 3

    def texts(self, texts: Any) -> Any:
        known = {"red": (1, 0, 0), "green": (0, 1, 0), "blue": (0, 0, 1)}
        return np.asarray([known.get(text, (0.577, 0.577, 0.577)) for text in texts], np.float32)

    def pictures(self, pictures: Any) -> Any:
        from PIL import Image

        rows = []
        for path in pictures:
            with Image.open(path) as opened:
                colour = np.asarray(opened.convert("RGB"), np.float32).mean(axis=(0, 1))
            rows.append(colour / np.linalg.norm(colour))
        return np.asarray(rows, np.float32)


def test_the_picture_itself_is_compared_where_a_space_has_an_image_tower(tmp_path: Path) -> None:
    from PIL import Image

    path = tmp_path / "blue.png"
    Image.new("RGB", (8, 8), (10, 10, 250)).save(path)
    vectors = {1: [1, 0, 0], 2: [0, 1, 0], 3: [0, 0, 1]}
    scene = SceneGraph(
        name="paint",
        objects=tuple(
            thing(i, "pot", "a pot of paint", float(i), features={"look": np.asarray(v, np.float32)})
            for i, v in vectors.items()
        ),
        spaces=(cgdb.FeatureSpace(name="look", dimension=3),),
    )
    encoders = {"look": Colours()}
    with cgdb.open(tmp_path / "p.cgdb", create=True, text_encoder=None, space_encoders=encoders) as db:
        db.add(scene)
        answer = db.ask("", model=False, image=path)
        assert answer.query == "MATCH (o ~ $picture) RETURN o LIMIT 10"
        first = answer.rows[0][0]
        assert isinstance(first, cgdb.StoredNode)
        assert first.id == 3


@pytest.mark.parametrize(
    ("content", "words"),
    [(None, "cannot be read"), (b"", "no picture"), (b"GIF8 and nonsense", "damaged"), (b"<html>", "no picture")],
)
def test_a_file_that_is_no_picture_is_one_clear_error(
    db: Database, tmp_path: Path, content: bytes | None, words: str
) -> None:
    path = tmp_path / "x.png"
    if content is not None:
        path.write_bytes(content)
    with ModelServer(brain(RIGHT)) as at, pytest.raises(UsageError, match=words):
        db.ask("Something like this", model=model(at), image=path)
