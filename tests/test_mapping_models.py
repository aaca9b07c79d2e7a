"""Segment Anything, CLIP and DINOv2 as detectors: the real classes, tiny and with random weights."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

torch = pytest.importorskip("torch")
library = pytest.importorskip("transformers")
pytest.importorskip("PIL.Image")

from cgdb.errors import EncoderError  # noqa: E402
from cgdb.ingest.detections.clip import PictureEncoder, load_describer  # noqa: E402
from cgdb.ingest.detections.detections import Selection  # noqa: E402
from cgdb.ingest.detections.models import ModelDetector, crop, load_detector  # noqa: E402
from cgdb.ingest.detections.sam import Grid, SamGrid, load_sam  # noqa: E402
from cgdb.ingest.mapping.mapper import Mapper, Mapping  # noqa: E402
from tests.mapping_rooms import room_frame  # noqa: E402

ANYTHING = Grid(side=3, quality=-1e9, stability=0.0, overlap=0.95, least_area=25, batch=4)
pytestmark = [pytest.mark.filterwarnings("ignore"), pytest.mark.slow]


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Tiny models of the real classes, saved as their makers save them."""
    torch.manual_seed(0)
    root = tmp_path_factory.mktemp("models")
    vision = {
        "hidden_size": 16,
        "output_channels": 16,
        "num_hidden_layers": 1,
        "num_attention_heads": 2,
        "image_size": 64,
        "patch_size": 8,
        "mlp_dim": 16,
        "global_attn_indexes": [0],
        "window_size": 0,
        "num_pos_feats": 8,
    }
    prompt = {"hidden_size": 16, "image_embedding_size": 8, "image_size": 64, "mask_input_channels": 4}
    decoder = {
        "hidden_size": 16,
        "mlp_dim": 16,
        "num_hidden_layers": 1,
        "num_attention_heads": 2,
        "iou_head_hidden_dim": 16,
    }
    config = library.SamConfig(vision_config=vision, prompt_encoder_config=prompt, mask_decoder_config=decoder)
    library.SamModel(config).save_pretrained(root / "sam")
    processor = library.SamImageProcessor(
        size={"longest_edge": 64}, pad_size={"height": 64, "width": 64}, mask_size={"longest_edge": 32}
    )
    library.SamProcessor(processor).save_pretrained(root / "sam")
    tower = {"hidden_size": 16, "intermediate_size": 16, "num_hidden_layers": 1, "num_attention_heads": 2}
    clip = library.CLIPConfig(
        text_config={**tower, "vocab_size": 32},
        vision_config={**tower, "image_size": 32, "patch_size": 8},
        projection_dim=12,
    )
    library.CLIPModel(clip).save_pretrained(root / "clip")
    small = {"height": 32, "width": 32}
    library.CLIPImageProcessor(size=small, crop_size=small).save_pretrained(root / "clip")
    dino = library.Dinov2Config(hidden_size=16, num_hidden_layers=1, num_attention_heads=2, image_size=32, patch_size=8)
    library.Dinov2Model(dino).save_pretrained(root / "dino")
    library.BitImageProcessor(size=small, crop_size=small).save_pretrained(root / "dino")
    return root


def test_a_grid_of_points_gives_masks_at_the_size_of_the_picture(folder: Path) -> None:
    segmenter = load_sam(str(folder / "sam"), ANYTHING)
    frame, _ = room_frame(0)
    found = segmenter(frame.rgb)
    assert len(found.masks) >= 1 and found.masks.shape[1:] == frame.depth.shape
    assert len(found.confidence) == len(found.labels) == len(found.masks)
    again = segmenter(frame.rgb)
    np.testing.assert_array_equal(found.masks, again.masks)


def test_nothing_sure_is_nothing(folder: Path) -> None:
    segmenter = load_sam(str(folder / "sam"), Grid(side=2, quality=1e9))
    frame, _ = room_frame(0)
    assert len(segmenter(frame.rgb).masks) == 0
    detector = ModelDetector(segmenter, load_describer(str(folder / "clip")))
    assert len(detector(frame)) == 0


@pytest.mark.parametrize(("name", "dimension"), [("clip", 12), ("dino", 16)])
def test_crops_become_vectors(folder: Path, name: str, dimension: int) -> None:
    describer = load_describer(str(folder / name))
    rng = np.random.default_rng(0)
    crops = [rng.integers(0, 255, (20 + i, 30, 3), dtype=np.uint8) for i in range(35)]
    vectors = describer(crops)
    assert vectors.shape == (35, dimension) and vectors.dtype == np.float32
    np.testing.assert_allclose(np.linalg.norm(vectors, axis=1), 1.0, rtol=1e-5)
    # One at a time gives the same as in batches.
    np.testing.assert_allclose(describer(crops[34:]), vectors[34:], atol=1e-4)
    assert describer.space == ("clip" if name == "clip" else "dinov2") and describer.encoder is None


def test_models_map_a_room(folder: Path) -> None:
    segmenter = load_sam(str(folder / "sam"), ANYTHING)
    detector = ModelDetector(segmenter, load_describer(str(folder / "clip")))
    # What random weights find is large.
    mapper = Mapper(Mapping(selection=Selection(largest_share=1.0)))
    for index in range(3):
        frame, _ = room_frame(index)
        found = detector(frame)
        assert found.features is not None and found.features.shape == (len(found), 12)
        mapper.step(frame, found)
    assert mapper.detections > 0


def test_a_crop_is_padded_within_the_picture() -> None:
    rgb = np.zeros((100, 100, 3), np.uint8)
    assert crop(rgb, np.array([50, 50, 60, 60], np.float32)).shape == (50, 50, 3)
    assert crop(rgb, np.array([0, 0, 10, 10], np.float32)).shape == (30, 30, 3)


def test_what_is_no_model(folder: Path, tmp_path: Path) -> None:
    with pytest.raises(EncoderError, match="cannot be loaded"):
        load_detector(str(tmp_path), str(folder / "clip"))
    with pytest.raises(EncoderError, match="is a sam"):
        load_describer(str(folder / "sam"))
    assert isinstance(load_describer(str(folder / "clip")), PictureEncoder)
    assert isinstance(load_sam(str(folder / "sam")), SamGrid)
