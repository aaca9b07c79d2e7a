"""Cross-encoders: real classes of transformers, tiny and of random weights; what they order and what they refuse."""

from __future__ import annotations

import socket
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from cgdb.cli.app import main
from cgdb.errors import EncoderError, MissingExtraError, UsageError
from cgdb.model.cross_encoder import BATCH, PIP_LINE, CrossEncoder
from cgdb.model.rerank import named
from cgdb.result import Row, StoredNode
from cgdb.scene import SceneGraph, SceneObject
from cgdb.testing import store

pytestmark = [pytest.mark.usefixtures("no_model"), pytest.mark.filterwarnings("ignore")]

WORDS = ("[PAD]", "[UNK]", "[CLS]", "[SEP]", "something", "to", "drink", "sit", "on", "a", "red", "cup", "sofa", "lamp")
TEXTS = [f"a {' '.join(WORDS[4 + (i * j) % 10] for j in range(i % 30))} cup" for i in range(3 * BATCH + 5)]
QUESTION = "something to drink"


@pytest.fixture(scope="session")
def library() -> Any:
    pytest.importorskip("torch", reason="torch is not installed")
    return pytest.importorskip("transformers", reason="transformers is not installed")


def saved(library: Any, folder: Path, kind: str = "BertForSequenceClassification", **more: Any) -> Path:
    import torch
    from tokenizers import Tokenizer
    from tokenizers.models import WordLevel
    from tokenizers.pre_tokenizers import Whitespace
    from tokenizers.processors import TemplateProcessing

    words = Tokenizer(WordLevel({word: i for i, word in enumerate(WORDS)}, unk_token="[UNK]"))
    words.pre_tokenizer = Whitespace()
    words.post_processor = TemplateProcessing(
        single="[CLS] $A [SEP]", pair="[CLS] $A [SEP] $B:1 [SEP]:1", special_tokens=[("[CLS]", 2), ("[SEP]", 3)]
    )
    marks = {"unk_token": "[UNK]", "pad_token": "[PAD]", "cls_token": "[CLS]", "sep_token": "[SEP]"}
    library.PreTrainedTokenizerFast(tokenizer_object=words, **marks).save_pretrained(folder)
    torch.manual_seed(5)
    size = {"hidden_size": 16, "num_hidden_layers": 1, "num_attention_heads": 2, "intermediate_size": 16}
    given = {"vocab_size": len(WORDS), "max_position_embeddings": 48, "num_labels": 1, **size, **more}
    made = getattr(library, kind)(library.BertConfig(**given))
    for values in made.parameters():
        torch.nn.init.normal_(values, std=0.5)
    made.save_pretrained(folder)
    return folder


@pytest.fixture(scope="session")
def folder(library: Any, tmp_path_factory: pytest.TempPathFactory) -> Path:
    return saved(library, tmp_path_factory.mktemp("cross") / "tiny")


@pytest.fixture(scope="session")
def cross(folder: Path) -> CrossEncoder:
    return CrossEncoder.load(str(folder))


def test_scores_are_those_of_the_model(cross: CrossEncoder, library: Any, folder: Path) -> None:
    import torch

    tokenizer = library.AutoTokenizer.from_pretrained(folder)
    model = library.AutoModelForSequenceClassification.from_pretrained(folder).eval()
    with torch.no_grad():
        expected = [
            model(**tokenizer(QUESTION, text, return_tensors="pt", truncation=True, max_length=48)).logits.item()
            for text in TEXTS[:40]
        ]
    found = cross.scores(QUESTION, TEXTS[:40])
    assert np.allclose(found, expected, atol=2e-4)
    assert np.ptp(found) > 0.1


def test_a_score_does_not_depend_on_the_others(cross: CrossEncoder) -> None:
    together = cross.scores(QUESTION, TEXTS)
    assert np.array_equal(together, cross.scores(QUESTION, TEXTS))
    backwards = cross.scores(QUESTION, TEXTS[::-1])[::-1]
    alone = [cross.scores(QUESTION, [text])[0] for text in TEXTS[::10]]
    assert np.allclose(together, backwards, atol=1.5e-4)
    assert np.allclose(together[::10], alone, atol=1.5e-4)
    assert cross.scores(QUESTION, []).shape == (0,)
    assert np.isfinite(cross.scores("drink " * 1000, ["cup " * 1000, ""])).all()


def test_rows_that_fit_come_first_each_in_the_order_of_the_scores(cross: CrossEncoder) -> None:
    rows = [Row((StoredNode(scene="s", id=i, tag=text),), 0.5, i % 3 > 0, tuple) for i, text in enumerate(TEXTS[1:31])]
    found = cross.rerank(QUESTION, ("o",), rows)
    scores = [row.why[-1].evidence["score"] for row in found.rows]
    fits = [row.fits for row in found.rows]
    assert fits == sorted(fits, reverse=True)
    assert scores[:20] == sorted(scores[:20], reverse=True)
    assert scores[20:] == sorted(scores[20:], reverse=True)
    assert found.said is None
    assert (found.usage.calls, found.usage.tokens) == (0, 0)
    assert found.usage.seconds > 0
    assert 0 <= found.rows[0].why[-1].degree <= 1


def test_a_model_of_two_outputs_gives_the_odds_of_yes(library: Any, tmp_path: Path) -> None:
    made = CrossEncoder.load(str(saved(library, tmp_path, num_labels=2)))
    assert made.scores(QUESTION, TEXTS[:3]).shape == (3,)


ROOM = SceneGraph(
    name="room",
    objects=tuple(SceneObject(id=i, tag=f"{tag} {i}", caption=f"a {tag}") for i, tag in enumerate(WORDS[10:] * 4)),
)
DEGREES = {"cup": {i: 0.9 - i / 100 for i in range(16)}}


def test_a_question_and_a_statement_are_re_ranked(cross: CrossEncoder, folder: Path) -> None:
    with store(ROOM, degrees=DEGREES) as db:
        statement = 'MATCH (o ~ "cup") RETURN o RERANK BY "something to drink" TOP 12 LIMIT 4'
        plain = [row[0].id for row in db.query('MATCH (o ~ "cup") RETURN o')]  # type: ignore[union-attr]
        db.reranker = named(f"cross:{folder}")
        result = db.query(statement)
        expected = cross.rerank("something to drink", ("o",), db.query('MATCH (o ~ "cup") RETURN o LIMIT 12').rows)
        ids = [row[0].id for row in result]  # type: ignore[union-attr]
        assert ids == [row[0].id for row in expected.rows[:4]]  # type: ignore[union-attr]
        assert ids != plain[:4]
        assert result.usage is not None
        assert result.usage.calls == 0
        reason = result[0].why[-1]
        assert reason.asked == 'RERANK BY "something to drink"'
        assert reason.evidence["by"] == "cross-encoder tiny"
        answer = db.ask("cup", model=False, rerank=f"cross:{folder}")
        assert (answer.reranked, answer.reranker, answer.achievable) == (True, "cross-encoder tiny", True)
        assert set(answer.ids) == set(db.ask("cup", model=False).ids), "it orders, and leaves what fits as it is"
        assert answer.ids != db.ask("cup", model=False).ids
        assert answer.usage.calls == 0


def test_on_the_command_line(folder: Path, tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    file = Path(__file__).parents[1] / "cli" / "flat.json"
    at = str(tmp_path / "flat.cgdb")
    assert main(["import", str(file), "--into", at, "--no-encode", "--quiet"]) == 0
    capfd.readouterr()
    assert main(["ask", at, "a red cup", "--no-model", "--rerank", f"cross:{folder}"]) == 0
    out, err = capfd.readouterr()
    assert "re-ranked by cross-encoder tiny" in out
    assert err == ""
    statement = 'MATCH (o ~ "cup") RETURN o RERANK BY "a red cup" LIMIT 2'
    assert main(["query", at, statement, "--rerank", f"cross:{folder}", "--why"]) == 0
    out, err = capfd.readouterr()
    assert 'RERANK BY "a red cup"' in out
    assert "re-ranked in" in err


# -- what is refused --------------------------------------------------------------------------------------------


def test_nothing_is_downloaded_for_a_question(library: Any, monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    def reach(*_: Any) -> None:
        raise AssertionError("the network was asked")

    monkeypatch.setattr(socket.socket, "connect", reach)
    monkeypatch.setattr(socket, "getaddrinfo", reach)
    monkeypatch.setenv("HF_HOME", str(tmp_path))
    with pytest.raises(EncoderError, match="is not on this machine") as caught:
        named("cross:cross-encoder/no-such-model")
    assert "hf download cross-encoder/no-such-model" in str(caught.value.hint)


@pytest.mark.parametrize("name", ["", "/no/such/folder", "./no", "a/b/c"])
def test_a_folder_that_is_not_there(library: Any, name: str) -> None:
    with pytest.raises(EncoderError, match="there is no folder"):
        CrossEncoder.load(name)


def test_models_of_another_kind_are_refused(library: Any, tmp_path: Path) -> None:
    with pytest.raises(EncoderError, match="is no cross-encoder: its weights lack"):
        CrossEncoder.load(str(saved(library, tmp_path / "base", kind="BertModel")))
    with pytest.raises(EncoderError, match="gives 3 values"):
        CrossEncoder.load(str(saved(library, tmp_path / "three", num_labels=3)))


def test_a_damaged_folder_is_one_clear_line(library: Any, folder: Path, tmp_path: Path) -> None:
    import shutil

    broken = tmp_path / "broken"
    shutil.copytree(folder, broken)
    weights = next(broken.glob("*.safetensors"))
    weights.write_bytes(weights.read_bytes()[:100])
    with pytest.raises(EncoderError, match="cannot be loaded") as caught:
        CrossEncoder.load(str(broken))
    assert "\n" not in caught.value.message
    (tmp_path / "empty").mkdir()
    with pytest.raises(EncoderError, match="cannot be loaded"):
        CrossEncoder.load(str(tmp_path / "empty"))


def test_without_the_packages_the_pip_line_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "torch", None)
    with pytest.raises(MissingExtraError) as caught:
        named("cross:cross-encoder/ms-marco-MiniLM-L6-v2")
    assert caught.value.hint == PIP_LINE


@pytest.mark.parametrize(
    ("name", "words"), [("crosss:x", "no re-ranker"), ("model", "no language model is configured")]
)
def test_a_name_that_is_none(name: str, words: str) -> None:
    with pytest.raises(UsageError, match=words):
        named(name)
