"""open_clip's towers, loaded for real: a tiny model of random weights, saved to a file and named by its path."""

from __future__ import annotations

import json
import os
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from cgdb.errors import EncoderError
from cgdb.meaning.embed import PictureEncoder, space_encoder

# What torch, timm and their like warn of when they are imported is theirs.
pytestmark = pytest.mark.filterwarnings("ignore")

MODEL = "cgdb-tiny-test"
CONFIG = {
    "embed_dim": 16,
    "vision_cfg": {"image_size": 32, "layers": 1, "width": 32, "head_width": 16, "patch_size": 16},
    "text_cfg": {"context_length": 77, "vocab_size": 49408, "width": 32, "heads": 2, "layers": 1},
}


@pytest.fixture(scope="module")
def packages() -> tuple[Any, Any]:
    try:
        import open_clip
        import torch
    except (ImportError, RuntimeError) as reason:
        pytest.skip(f"open_clip cannot be imported here: {reason}")
    return torch, open_clip


@pytest.fixture(scope="module")
def weights(packages: tuple[Any, Any], tmp_path_factory: pytest.TempPathFactory) -> Path:
    torch, open_clip = packages
    folder = tmp_path_factory.mktemp("clip")
    (folder / f"{MODEL}.json").write_text(json.dumps(CONFIG))
    open_clip.add_model_config(folder)
    torch.manual_seed(3)
    torch.save(open_clip.create_model(MODEL).state_dict(), folder / "tiny.pt")
    return folder / "tiny.pt"


@pytest.fixture(scope="module")
def tiny(weights: Path) -> PictureEncoder:
    encoder = space_encoder(f"open_clip:{MODEL}:{weights}")
    assert isinstance(encoder, PictureEncoder)
    return encoder


def test_texts_are_those_of_the_text_tower(tiny: PictureEncoder, packages: tuple[Any, Any], weights: Path) -> None:
    torch, open_clip = packages
    texts = ["a photo of a cup", "", "tasse à café ☕", "cup " * 300]
    model = open_clip.create_model(MODEL, pretrained=str(weights)).eval()
    with torch.no_grad():
        expected = model.encode_text(open_clip.get_tokenizer(MODEL)(texts), normalize=True).numpy()
    vectors = tiny.texts(texts)
    assert vectors.dtype == np.float32
    assert vectors.shape == (4, tiny.dimension) == (4, 16)
    np.testing.assert_allclose(vectors, expected, atol=1e-5 if not torch.cuda.is_available() else 1e-2)
    assert tiny.name == f"open_clip:{MODEL}:{weights}"


def test_pictures_are_those_of_the_image_tower(
    tiny: PictureEncoder, packages: tuple[Any, Any], weights: Path, tmp_path: Path
) -> None:
    import PIL.Image

    torch, open_clip = packages
    random = np.random.default_rng(0)
    pictures = [PIL.Image.fromarray(random.integers(0, 256, (40 + n, 60, 3), np.uint8)) for n in range(35)]
    pictures.append(PIL.Image.fromarray(random.integers(0, 256, (50, 50), np.uint8)))
    model, _, prepare = open_clip.create_model_and_transforms(MODEL, pretrained=str(weights))
    with torch.no_grad():
        pixels = torch.stack([prepare(picture) for picture in pictures])
        expected = model.eval().encode_image(pixels, normalize=True).numpy()
    vectors = tiny.pictures(pictures)
    assert vectors.shape == (36, 16)
    np.testing.assert_allclose(vectors, expected, atol=1e-5 if not torch.cuda.is_available() else 1e-2)
    pictures[0].save(tmp_path / "one.png")
    np.testing.assert_allclose(tiny.pictures([tmp_path / "one.png"])[0], vectors[0], atol=1e-5)


def test_nothing_in_nothing_out(tiny: PictureEncoder) -> None:
    assert tiny.texts([]).shape == tiny.pictures([]).shape == (0, 16)


def test_more_texts_than_one_batch_keep_their_order(tiny: PictureEncoder) -> None:
    texts = [f"cup {n}" for n in range(300)]
    np.testing.assert_allclose(tiny.texts(texts)[[0, 299]], tiny.texts([texts[0], texts[299]]), atol=1e-5)


def test_a_picture_that_is_none_is_one_clear_line(tiny: PictureEncoder, tmp_path: Path) -> None:
    (tmp_path / "x.png").write_bytes(b"\x89PNG\r\n\x1a\n" + bytes(40))
    for path in (tmp_path / "x.png", tmp_path / "missing.png", tmp_path):
        with pytest.raises(EncoderError, match="is not a picture that can be read"):
            tiny.pictures([path])


def test_unknown_models_and_weights_name_the_nearest(weights: Path) -> None:
    with pytest.raises(EncoderError, match="knows no model") as caught:
        space_encoder("open_clip:ViT-H14:laion2b_s32b_b79k")
    assert caught.value.hint == "did you mean 'ViT-H-14'?"
    with pytest.raises(EncoderError, match="neither weights") as caught:
        space_encoder("open_clip:ViT-H-14:laion2b_s32b_b79")
    assert caught.value.hint == "did you mean 'laion2b_s32b_b79k'?"
    with pytest.raises(EncoderError, match="neither weights that open_clip knows"):
        space_encoder(f"open_clip:{MODEL}:{weights}.gone")


@pytest.mark.parametrize("model", ["hf-hub", "local-dir"])
def test_an_id_cannot_send_open_clip_elsewhere(model: str, weights: Path) -> None:
    with pytest.raises(EncoderError, match="knows no model"):
        space_encoder(f"open_clip:{model}:{weights.parent}")


class Bomb:
    """A pickle that would touch a file when it is loaded."""

    def __init__(self, touched: Path) -> None:
        self.touched = touched

    def __reduce__(self) -> tuple[Callable[..., object], tuple[str, int]]:
        return os.mkdir, (str(self.touched), 0o700)


def test_hostile_and_damaged_weights_are_one_clear_line(
    packages: tuple[Any, Any], weights: Path, tmp_path: Path
) -> None:
    torch, open_clip = packages
    touched = tmp_path / "touched"
    torch.save({"state_dict": Bomb(touched)}, tmp_path / "bomb.pt")
    (tmp_path / "cut.pt").write_bytes(weights.read_bytes()[:5000])
    (tmp_path / "empty.pt").write_bytes(b"")
    torch.save({"x": torch.zeros(2)}, tmp_path / "other.pt")
    state = open_clip.create_model(MODEL).state_dict()
    torch.save({name: value * float("nan") for name, value in state.items()}, tmp_path / "nan.pt")
    for name in ("bomb", "cut", "empty", "other", "nan"):
        with pytest.raises(EncoderError) as caught:
            space_encoder(f"open_clip:{MODEL}:{tmp_path / name}.pt")
        assert "\n" not in caught.value.message
    assert not touched.exists()
