"""Segment Anything, Grounding DINO, CLIP, DINOv2 and captions as detectors: real classes, tiny, of random weights."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from cgdb.errors import EncoderError, FormatError, UsageError
from cgdb.ingest.detections.models import Choice, chosen
from cgdb.ingest.detections.overlap import distinct


def test_models_are_chosen_by_name() -> None:
    assert chosen("") == Choice()
    assert chosen("a/sam,b/clip") == Choice(sam="a/sam", clip="b/clip") == chosen("sam=a/sam, clip=b/clip")
    assert chosen(",b/clip") == Choice(clip="b/clip")
    named = chosen("dino=d,tags=clip:names.txt,box=0.3,clip=c")
    assert named == Choice(dino="d", tags="clip:names.txt", box=0.3, clip="c")


@pytest.mark.parametrize(
    ("text", "says", "hint"),
    [
        ("sma=x", "none of its parts", "did you mean 'sam'?"),
        ("sam=x,sam=y", "given twice", "sam"),
        ("sam=", "none of its parts", "sam"),
        ("foo", "none of its parts", "sam="),
        ("sem", "none of its parts", "did you mean 'sam'?"),
        ("a,b,c", "none of its parts", "NAME=VALUE"),
        ("dino=x", "told what to look for", "tags=FILE"),
        ("box=0.3", "told what to look for", "tags=FILE"),
        ("tags=x,box=high", "number from 0 to 1", None),
        ("tags=x,text=2", "number from 0 to 1", None),
    ],
)
def test_a_choice_that_is_none(text: str, says: str, hint: str | None) -> None:
    with pytest.raises(UsageError, match=says) as raised:
        chosen(text)
    assert hint is None or (raised.value.hint is not None and hint in raised.value.hint)


def test_of_boxes_that_are_much_the_same_the_surest_stays() -> None:
    boxes = np.array([[0, 0, 10, 10], [1, 1, 10, 10], [20, 20, 30, 30], [0, 0, 10, 4]], np.float32)
    scores = np.array([0.5, 0.9, 0.1, 0.4], np.float32)
    assert distinct(boxes, scores, 0.7).tolist() == [1, 3, 2]
    assert distinct(boxes, scores, 1.0).tolist() == [1, 0, 3, 2]
    assert distinct(boxes[:0], scores[:0], 0.5).tolist() == []


torch = pytest.importorskip("torch")
library = pytest.importorskip("transformers")
pytest.importorskip("PIL.Image")

from cgdb.ingest.detections import clip, grounding, models, sam, tags  # noqa: E402
from cgdb.ingest.detections.detections import Selection  # noqa: E402
from cgdb.ingest.detections.models import ModelDetector, crop, load_detector  # noqa: E402
from cgdb.ingest.detections.sam import Grid, SamGrid, load_sam, masks_of_boxes  # noqa: E402
from cgdb.ingest.mapping.mapper import Mapper, Mapping  # noqa: E402
from tests.mapping_rooms import room_frame  # noqa: E402

ANYTHING = Grid(side=3, quality=-1e9, stability=0.0, overlap=0.95, least_area=25, batch=4)
pytestmark = pytest.mark.filterwarnings("ignore")
slow = pytest.mark.slow
SAID = "table chair wall floor ceiling box vase a photo of coffee on the red and lamp with near"
WORDS = SAID.split()


def bert_words(root: Path) -> Any:
    """A tokenizer of BERT's kind whose marks have the numbers that Grounding DINO looks for."""
    entries = {101: "[CLS]", 102: "[SEP]", 1012: ".", 1029: "?", 0: "[PAD]", 100: "[UNK]"}
    entries |= dict(enumerate(WORDS, start=2000))
    lines = [entries.get(i, f"[unused{i}]") for i in range(2100)]
    (root / "vocab.txt").write_text("\n".join(lines))
    return library.BertTokenizer(vocab=str(root / "vocab.txt"), vocab_file=str(root / "vocab.txt"))


def save_sam(root: Path) -> None:
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
    library.SamModel(config).save_pretrained(root)
    processor = library.SamImageProcessor(
        size={"longest_edge": 64}, pad_size={"height": 64, "width": 64}, mask_size={"longest_edge": 32}
    )
    library.SamProcessor(processor).save_pretrained(root)


def save_sam2(root: Path) -> None:
    backbone = {
        "hidden_size": 8,
        "num_attention_heads": 1,
        "image_size": [64, 64],
        "blocks_per_stage": [1, 1, 2, 1],
        "embed_dim_per_stage": [8, 16, 32, 64],
        "num_attention_heads_per_stage": [1, 1, 1, 1],
        "window_size_per_stage": [4, 4, 4, 4],
        "global_attention_blocks": [3],
        "window_positional_embedding_background_size": [4, 4],
    }
    vision = {
        "backbone_config": library.Sam2HieraDetConfig(**backbone),
        "backbone_channel_list": [64, 32, 16, 8],
        "backbone_feature_sizes": [[16, 16], [8, 8], [4, 4]],
        "fpn_hidden_size": 32,
    }
    config = library.Sam2Config(
        vision_config=library.Sam2VisionConfig(**vision),
        prompt_encoder_config={"hidden_size": 32, "image_size": 64, "patch_size": 16},
        mask_decoder_config={
            "hidden_size": 32,
            "mlp_dim": 32,
            "num_hidden_layers": 1,
            "num_attention_heads": 2,
            "iou_head_hidden_dim": 16,
        },
    )
    library.Sam2Model(config).save_pretrained(root)
    processor = library.Sam2ImageProcessor(size={"height": 64, "width": 64}, mask_size={"height": 16, "width": 16})
    library.Sam2Processor(processor, target_size=64).save_pretrained(root)


def save_clip(root: Path) -> None:
    tower = {"hidden_size": 16, "intermediate_size": 16, "num_hidden_layers": 1, "num_attention_heads": 2}
    config = library.CLIPConfig(
        text_config={**tower, "vocab_size": 2100, "eos_token_id": 102, "bos_token_id": 101, "pad_token_id": 0},
        vision_config={**tower, "image_size": 32, "patch_size": 8},
        projection_dim=12,
    )
    library.CLIPModel(config).save_pretrained(root)
    small = {"height": 32, "width": 32}
    library.CLIPImageProcessor(size=small, crop_size=small).save_pretrained(root)
    bert_words(root).save_pretrained(root)


def save_dino(root: Path) -> None:
    """Grounding DINO of 16 dimensions over a Swin of three stages."""
    config = library.GroundingDinoConfig(
        backbone_config=library.SwinConfig(
            image_size=64,
            embed_dim=8,
            depths=[1, 1, 1, 1],
            num_heads=[1, 1, 2, 2],
            window_size=4,
            out_features=["stage2", "stage3", "stage4"],
        ),
        text_config=library.BertConfig(
            vocab_size=2100,
            hidden_size=16,
            num_hidden_layers=1,
            num_attention_heads=2,
            intermediate_size=16,
        ),
        d_model=32,
        encoder_layers=1,
        decoder_layers=2,
        encoder_attention_heads=2,
        decoder_attention_heads=2,
        encoder_ffn_dim=16,
        decoder_ffn_dim=16,
        num_queries=12,
        text_enhancer_dropout=0.0,
        max_text_len=32,
    )
    library.GroundingDinoForObjectDetection(config).save_pretrained(root)
    processor = library.GroundingDinoImageProcessor(size={"shortest_edge": 64, "longest_edge": 96})
    library.GroundingDinoProcessor(processor, bert_words(root)).save_pretrained(root)


def save_captioner(root: Path) -> None:
    tower = {"hidden_size": 16, "intermediate_size": 16, "num_hidden_layers": 1, "num_attention_heads": 2}
    ends = {"bos_token_id": 101, "eos_token_id": 102, "sep_token_id": 102, "pad_token_id": 0}
    config = library.BlipConfig(
        text_config={**tower, "encoder_hidden_size": 16, "vocab_size": 2100, "max_position_embeddings": 64, **ends},
        vision_config={**tower, "image_size": 32, "patch_size": 8},
        projection_dim=12,
        image_text_hidden_size=16,
    )
    library.BlipForConditionalGeneration(config).save_pretrained(root)
    small = {"height": 32, "width": 32}
    library.BlipProcessor(library.BlipImageProcessor(size=small), bert_words(root)).save_pretrained(root)


SAVERS = {"sam": save_sam, "sam2": save_sam2, "clip": save_clip, "dino": save_dino, "captioner": save_captioner}


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Tiny models of the real classes, saved as their makers save them."""
    root = tmp_path_factory.mktemp("models")
    for name, save in SAVERS.items():
        torch.manual_seed(0)
        (root / name).mkdir()
        save(root / name)
    small = {"height": 32, "width": 32}
    config = library.Dinov2Config(
        hidden_size=16, num_hidden_layers=1, num_attention_heads=2, image_size=32, patch_size=8
    )
    library.Dinov2Model(config).save_pretrained(root / "dinov2")
    library.BitImageProcessor(size=small, crop_size=small).save_pretrained(root / "dinov2")
    (root / "names.txt").write_text("# what there is\ntable\nchair\n\nbox\ncoffee table\nvase\ntable\n")
    return root


# -- masks


@slow
@pytest.mark.parametrize("name", ["sam", "sam2"])
def test_a_grid_of_points_gives_masks_at_the_size_of_the_picture(folder: Path, name: str) -> None:
    segmenter = SamGrid(load_sam(str(folder / name)), ANYTHING)
    frame, _ = room_frame(0)
    found = segmenter(frame.rgb)
    assert len(found.masks) >= 1 and found.masks.shape[1:] == frame.depth.shape
    assert len(found.confidence) == len(found.labels) == len(found.masks)
    assert (found.masks.sum(axis=(1, 2)) >= ANYTHING.least_area).all()
    assert (np.diff(found.confidence) <= 0).all()
    again = segmenter(frame.rgb)
    np.testing.assert_array_equal(found.masks, again.masks)


@slow
@pytest.mark.parametrize("name", ["sam", "sam2"])
def test_each_box_gets_its_mask_whatever_the_batch(folder: Path, name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    model = load_sam(str(folder / name))
    frame, _ = room_frame(0)
    boxes = np.array([[10, 10, 60, 50], [80, 20, 150, 110], [0, 0, 160, 120]], np.float32)
    masks = masks_of_boxes(model, frame.rgb, boxes)
    assert masks.shape == (3, *frame.depth.shape) and masks.dtype == np.bool_
    monkeypatch.setattr(sam, "BOXES", 1)
    monkeypatch.setattr(sam, "AT_ONCE", 1)
    np.testing.assert_array_equal(masks_of_boxes(model, frame.rgb, boxes), masks)
    assert masks_of_boxes(model, frame.rgb, boxes[:0]).shape == (0, *frame.depth.shape)


@slow
@pytest.mark.parametrize("name", ["sam", "sam2"])
def test_masks_are_what_the_model_itself_says(folder: Path, name: str) -> None:
    """Against the library's own way from a picture and boxes to masks, in one go."""
    model = load_sam(str(folder / name))
    frame, _ = room_frame(0)
    boxes = [[10.0, 10.0, 60.0, 50.0], [80.0, 20.0, 150.0, 110.0]]
    inputs = model._processor(images=frame.rgb, input_boxes=[boxes], return_tensors="pt")
    with torch.no_grad():
        answer = model._model(**{key: value for key, value in inputs.items() if "sizes" not in key})
    sizes = [inputs[key] for key in ("original_sizes", "reshaped_input_sizes") if key in inputs]
    (full,) = model._processor.image_processor.post_process_masks(answer.pred_masks, *sizes)
    best = answer.iou_scores[0].argmax(1)
    expected = np.stack([full[i, best[i]].numpy() for i in range(2)])
    np.testing.assert_array_equal(masks_of_boxes(model, frame.rgb, np.array(boxes, np.float32)), expected)


@slow
def test_nothing_sure_is_nothing(folder: Path) -> None:
    segmenter = SamGrid(load_sam(str(folder / "sam")), Grid(side=2, quality=1e9))
    frame, _ = room_frame(0)
    assert len(segmenter(frame.rgb).masks) == 0
    detector = ModelDetector(segmenter, clip.load_describer(str(folder / "clip")))
    assert len(detector(frame)) == 0


# -- vectors


@slow
@pytest.mark.parametrize(("name", "dimension"), [("clip", 12), ("dinov2", 16)])
def test_crops_become_vectors(folder: Path, name: str, dimension: int) -> None:
    describer = clip.load_describer(str(folder / name))
    rng = np.random.default_rng(0)
    crops = [rng.integers(0, 255, (20 + i, 30, 3), dtype=np.uint8) for i in range(35)]
    vectors = describer(crops)
    assert vectors.shape == (35, dimension) and vectors.dtype == np.float32
    np.testing.assert_allclose(np.linalg.norm(vectors, axis=1), 1.0, rtol=1e-5)
    # One at a time gives the same as in batches.
    np.testing.assert_allclose(describer(crops[34:]), vectors[34:], atol=1e-4)
    assert describer.space == name and describer.encoder is None


@slow
def test_texts_become_vectors_of_the_same_space(folder: Path) -> None:
    describer = clip.load_describer(str(folder / "clip"))
    vectors = describer.texts(["table", "a red chair", "table"])
    assert vectors.shape == (3, 12)
    np.testing.assert_array_equal(vectors[0], vectors[2])
    np.testing.assert_allclose(describer.texts(["a red chair"])[0], vectors[1], atol=1e-5)
    ids = describer._words(["table"], return_tensors="pt")
    features = describer._model.get_text_features(**ids)
    whole = (features if torch.is_tensor(features) else features.pooler_output).detach().numpy()[0]
    np.testing.assert_allclose(vectors[0], whole / np.linalg.norm(whole), atol=1e-5)
    with pytest.raises(EncoderError, match="does not encode texts"):
        clip.load_describer(str(folder / "dinov2")).texts(["table"])


# -- names


@slow
def test_grounding_dino_finds_names(folder: Path) -> None:
    every = grounding.Finding(box=0.0, text=0.0, overlap=1.0)
    finder = grounding.load_finder(str(folder / "dino"), every)
    frame, _ = room_frame(0)
    names = ["table", "coffee table", "chair"]
    found = finder(frame.rgb, names)
    assert len(found.labels) == len(found.xyxy) == 12 and set(found.labels) <= set(names)
    assert (found.xyxy >= 0).all() and (found.xyxy[:, [0, 2]] <= 160).all() and (found.xyxy[:, [1, 3]] <= 120).all()
    assert (np.diff(found.confidence) <= 0).all()
    none = grounding.load_finder(str(folder / "dino"), grounding.Finding(box=1.0))(frame.rgb, names)
    assert len(none.labels) == 0 and none.xyxy.shape == (0, 4)
    assert len(finder(frame.rgb, []).labels) == 0


@slow
def test_names_are_asked_as_the_model_was_taught(folder: Path) -> None:
    """The tokens are those of the library's own processor for "table. coffee table.", and so are the answers."""
    finder = grounding.load_finder(str(folder / "dino"), grounding.Finding(box=0.0, text=0.0, overlap=1.0))
    ((asked, ids, spans),) = finder._prompts(["Table", "coffee  table."])
    processor = library.AutoProcessor.from_pretrained(folder / "dino")
    frame, _ = room_frame(0)
    inputs = processor(images=frame.rgb, text="table. coffee table.", return_tensors="pt")
    assert ids == inputs["input_ids"][0].tolist() and asked == ["Table", "coffee  table."] and spans == [(1, 2), (3, 5)]
    with torch.no_grad():
        answer = finder._model(**inputs)
    listed = processor.post_process_grounded_object_detection(
        answer, inputs["input_ids"], threshold=0.0, text_threshold=0.0, target_sizes=[(120, 160)]
    )[0]
    found = finder(frame.rgb, ["Table", "coffee  table."])
    # The library counts the marks between names as words, too.
    sure = answer.logits[0].sigmoid()[:, [1, 3, 4]].max(1).values.numpy()
    order = np.argsort(-sure, kind="stable")
    np.testing.assert_allclose(found.confidence, sure[order], atol=1e-5)
    np.testing.assert_allclose(found.xyxy, listed["boxes"].detach().numpy()[order].clip(0, [160, 120] * 2), atol=1e-2)


@slow
def test_more_names_than_one_prompt_holds(folder: Path) -> None:
    finder = grounding.load_finder(str(folder / "dino"))
    names = [f"{one} {two}" for one in WORDS[:6] for two in WORDS[:6]]
    prompts = list(finder._prompts([*names, "...", "table " * 100]))
    assert [name for asked, _, _ in prompts for name in asked] == [*names, "table " * 100]
    for asked, ids, spans in prompts:
        assert len(ids) <= 32 and len(asked) == len(spans) and ids[0] == 101 and ids[-1] == 102
    frame, _ = room_frame(0)
    assert set(finder(frame.rgb, names).labels) <= set(names)


def test_the_likeliest_name_is_that_of_all_its_words() -> None:
    finder = grounding.GroundingDino.__new__(grounding.GroundingDino)
    finder.rules = grounding.Finding(box=0.3, text=0.3)
    # Tokens: mark, table, mark, coffee, table, mark.
    sure = np.array([[0, 0.8, 0, 0.1, 0.8, 0], [0, 0.5, 0, 0.7, 0.6, 0], [0.9, 0.2, 0.9, 0.1, 0.2, 0.9]], np.float32)
    boxes = np.eye(3, 4, dtype=np.float32)
    kept, confidence, labels = finder._named(sure, boxes, ["table", "coffee table"], [(1, 2), (3, 5)])
    assert labels == ["table", "coffee table"]
    np.testing.assert_array_equal(kept, boxes[:2])
    np.testing.assert_allclose(confidence, [0.8, 0.7])


# -- tags


def test_names_from_files(tmp_path: Path) -> None:
    (tmp_path / "names.txt").write_text("# things\n table  lamp \n\nchair\nchair\n")
    (tmp_path / "names.json").write_text(json.dumps(["table lamp", "chair"]))
    assert (
        tags.read_names(tmp_path / "names.txt") == tags.read_names(tmp_path / "names.json") == ["table lamp", "chair"]
    )
    for content in ('{"a": 1}', "[1]", "[]", "[", '["' + "a" * 200 + '"]'):
        (tmp_path / "names.json").write_text(content)
        with pytest.raises(FormatError):
            tags.read_names(tmp_path / "names.json")
    with pytest.raises(FormatError, match="cannot be read"):
        tags.read_names(tmp_path / "nowhere.txt")


def test_words_of_captions() -> None:
    captions = ["A red chair next to the coffee table.", "there is a lamp on the table"]
    assert tags.words_of(captions) == ["chair", "coffee", "table", "lamp"]


def test_tiles_cover_the_picture() -> None:
    rgb = np.arange(60 * 90 * 3, dtype=np.uint32).reshape(60, 90, 3)
    parts = tags.tiles(rgb.astype(np.uint8))
    assert len(parts) == 14 and parts[0].shape == (60, 90, 3) and min(min(part.shape[:2]) for part in parts) >= 24
    numbered = tags.tiles(rgb, (3,))  # type: ignore[arg-type]
    assert set(np.unique(np.concatenate([part.reshape(-1) for part in numbered]))) == set(range(60 * 90 * 3))
    assert all(part.size for part in tags.tiles(rgb[:1, :1].astype(np.uint8)))


@slow
def test_tags_by_clip_are_the_nearest_names(folder: Path) -> None:
    describer = clip.load_describer(str(folder / "clip"))
    names = tags.read_names(folder / "names.txt")
    frame, _ = room_frame(0)
    found = tags.ClipTags(names, describer, most=2)(frame.rgb)
    near = (describer(tags.tiles(frame.rgb)) @ describer.texts([f"a photo of a {name}" for name in names]).T).max(0)
    assert list(found) == [names[i] for i in np.argsort(-near)[:2]]


@slow
def test_tags_by_captions(folder: Path) -> None:
    tagger = tags.load_tagger(f"caption:{folder / 'captioner'}", clip.load_describer(str(folder / "clip")))
    frame, _ = room_frame(0)
    found = tagger(frame.rgb)
    assert list(found) == list(tagger(frame.rgb)) and len(set(found)) == len(found)


# -- whole detectors


@slow
def test_models_map_a_room(folder: Path) -> None:
    segmenter = SamGrid(load_sam(str(folder / "sam")), ANYTHING)
    detector = ModelDetector(segmenter, clip.load_describer(str(folder / "clip")))
    # What random weights find is large.
    mapper = Mapper(Mapping(selection=Selection(largest_share=1.0)))
    for index in range(3):
        frame, _ = room_frame(index)
        found = detector(frame)
        assert found.features is not None and found.features.shape == (len(found), 12) and found.text_features is None
        mapper.step(frame, found)
    assert mapper.detections > 0


@slow
@pytest.mark.parametrize("where", ["names.txt", "clip:names.txt", "caption:captioner"])
def test_named_things_map_a_room(folder: Path, where: str) -> None:
    kind, _, name = where.rpartition(":")
    source = f"{kind}:{folder / name}" if kind else str(folder / name)
    text = f"sam={folder / 'sam2'},clip={folder / 'clip'},dino={folder / 'dino'},tags={source},box=0,text=0,overlap=0.9"
    detector = load_detector(chosen(text))
    mapper = Mapper(Mapping(selection=Selection(largest_share=1.0)))
    for index in range(3):
        frame, _ = room_frame(index)
        found = detector(frame)
        assert len(found) and all(found.labels)
        assert found.text_features is not None and found.text_features.shape == (len(found), 12)
        mapper.step(frame, found)
    assert mapper.detections > 0


@slow
@pytest.mark.parametrize("half", [False, True])
def test_numbers_of_half_precision_go_through_every_model(
    folder: Path, half: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    """As on a GPU, which this machine need not have: no layer meets another number than its own."""
    device = torch.device("cuda" if torch.cuda.is_available() else "cpu")
    for module in (models, sam, clip, tags, grounding):
        if hasattr(module, "device_of"):
            monkeypatch.setattr(module, "device_of", lambda _: (device, torch.float16 if half else torch.float32))
    names = folder / "names.txt"
    text = f"sam={folder / 'sam'},clip={folder / 'clip'},dino={folder / 'dino'},tags=clip:{names},box=0,text=0"
    found = load_detector(chosen(text))(room_frame(0)[0])
    assert len(found) and found.features is not None and np.isfinite(found.features).all()
    captions = tags.load_tagger(f"caption:{folder / 'captioner'}", clip.load_describer(str(folder / "clip")))
    captions(room_frame(0)[0].rgb)
    grid = SamGrid(load_sam(str(folder / "sam2")), ANYTHING)
    assert len(grid(room_frame(0)[0].rgb).masks)


def test_a_crop_is_padded_within_the_picture() -> None:
    rgb = np.zeros((100, 100, 3), np.uint8)
    assert crop(rgb, np.array([50, 50, 60, 60], np.float32)).shape == (50, 50, 3)
    assert crop(rgb, np.array([0, 0, 10, 10], np.float32)).shape == (30, 30, 3)


@slow
def test_what_is_no_model(folder: Path, tmp_path: Path) -> None:
    with pytest.raises(EncoderError, match="cannot be loaded"):
        load_detector(Choice(sam=str(tmp_path), clip=str(folder / "clip")))
    with pytest.raises(EncoderError, match="is a sam"):
        clip.load_describer(str(folder / "sam"))
    with pytest.raises(EncoderError, match="is a clip; masks are made by"):
        load_sam(str(folder / "clip"))
    with pytest.raises(EncoderError, match="is a sam; names are found by"):
        grounding.load_finder(str(folder / "sam"))
    dinov2 = clip.load_describer(str(folder / "dinov2"))
    with pytest.raises(EncoderError, match="tags by CLIP need a clip"):
        tags.load_tagger(f"clip:{folder / 'names.txt'}", dinov2)
    weights = folder / "sam" / "model.safetensors"
    broken = tmp_path / "broken"
    broken.mkdir()
    for path in (folder / "sam").iterdir():
        (broken / path.name).write_bytes(path.read_bytes())
    (broken / weights.name).write_bytes(weights.read_bytes()[:500])
    with pytest.raises(EncoderError, match="cannot be loaded") as raised:
        load_sam(str(broken))
    assert "\n" not in raised.value.message


@slow
def test_without_a_network_it_is_said_in_one_line(tmp_path: Path) -> None:
    code = "from cgdb.ingest.detections.sam import load_sam; load_sam('nobody/no-such-model')"
    environment = {**os.environ, "HF_HOME": str(tmp_path), "HF_HUB_OFFLINE": "1"}
    ran = subprocess.run([sys.executable, "-c", code], env=environment, capture_output=True, text=True, check=False)
    assert "EncoderError" in ran.stderr and "the model 'nobody/no-such-model' cannot be loaded" in ran.stderr
    assert "Retrying" not in ran.stderr and ran.stdout == ""
