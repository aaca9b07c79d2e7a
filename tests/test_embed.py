"""The seam of the encoders: ids, the registry, and what a missing encoder says."""

from __future__ import annotations

import subprocess
import sys

import numpy as np
import pytest

from cgdb.errors import EncoderError, MissingExtraError
from cgdb.meaning.embed import ENCODERS, space_encoder


def test_an_unknown_scheme_is_one_clear_line_with_the_nearest_name() -> None:
    with pytest.raises(EncoderError) as caught:
        space_encoder("open_klip:ViT-H-14:laion2b_s32b_b79k")
    assert caught.value.hint == "did you mean 'open_clip'?"
    with pytest.raises(EncoderError) as caught:
        space_encoder("")
    assert "'vocabulary'" in str(caught.value.hint)


@pytest.mark.parametrize("encoder_id", ["open_clip", "open_clip:", "open_clip:ViT-B-32", "open_clip::tag"])
def test_an_open_clip_id_names_a_model_and_its_weights(encoder_id: str) -> None:
    with pytest.raises(EncoderError, match="does not name a model and its weights"):
        space_encoder(encoder_id)


def test_the_text_model_takes_nothing_after_its_name() -> None:
    with pytest.raises(EncoderError, match="takes nothing after its name"):
        space_encoder("all-MiniLM-L6-v2:large")


def test_an_encoder_of_ones_own_is_found_by_its_scheme(monkeypatch: pytest.MonkeyPatch) -> None:
    class Length:
        name = "length"
        dimension = 1

        def texts(self, texts: object) -> np.ndarray:
            return np.ones((1, 1), np.float32)

    given: list[str] = []
    monkeypatch.setitem(ENCODERS, "length", lambda rest: (given.append(rest), Length())[1])
    assert space_encoder("length:a:b").name == "length"
    assert given == ["a:b"]


def test_a_missing_package_is_named_with_the_pip_line(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "open_clip", None)
    with pytest.raises(MissingExtraError) as caught:
        space_encoder("open_clip:ViT-B-32:laion2b_s34b_b79k")
    assert "cgdb[clip]" in str(caught.value.hint)


def test_the_seam_imports_no_encoder() -> None:
    heavy = "torch open_clip tokenizers huggingface_hub PIL " + " ".join(
        f"cgdb.meaning.{name}" for name in ("minilm", "clip", "vocabulary")
    )
    code = f"import sys, cgdb.meaning.embed; print([m for m in '{heavy}'.split() if m in sys.modules])"
    run = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True, timeout=60)
    assert run.stdout.strip() == "[]"
