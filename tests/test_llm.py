"""The client of language models against a real HTTP server: each misbehaviour by its name."""

from __future__ import annotations

import json
import socket
import sys
import time
from email.utils import formatdate
from pathlib import Path
from typing import Any

import pytest

from cgdb.errors import MissingExtraError, UsageError
from cgdb.model.llm import Model, ModelError, Unreachable, connect
from cgdb.model.llm_json import ask_json
from cgdb.model.llm_settings import Settings, settings
from cgdb.model.recording import recording, replaying
from tests.model_server import HTML, ModelServer, Said, error

pytestmark = pytest.mark.usefixtures("no_model")


HELLO = [{"role": "user", "content": "Say hello."}]
KEY = "sk-secret-1234567890"


def model(at: Any, **more: Any) -> Model:
    given: dict[str, Any] = {"model": "little", "api_key": KEY, "backoff": 0.01, "timeout": 5.0, "deadline": 10.0}
    return connect(Settings(base_url=at.url, **{**given, **more}), remember=False)


def say(made: Model, **more: Any) -> str:
    return made.chat(HELLO, made.meter(), max_tokens=50, **more).said


def test_an_answer_and_its_account() -> None:
    with ModelServer("hello") as at:
        made = model(at)
        meter = made.meter()
        assert made.chat(HELLO, meter, max_tokens=50).text == "hello"
        assert at.requests[0]["model"] == "little"
        assert at.requests[0]["temperature"] == 0
        assert at.keys == [f"Bearer {KEY}"]
        assert meter.usage.calls == 1
        assert (meter.usage.prompt_tokens, meter.usage.completion_tokens) == (3, 1)
        assert 0 < meter.usage.seconds < 5
        assert not meter.usage.estimated


def test_a_server_that_does_not_count_is_counted_for() -> None:
    with ModelServer(lambda body: Said(text="hello", counted=False)) as at:
        made = model(at)
        meter = made.meter()
        made.chat(HELLO, meter, max_tokens=50)
        assert meter.usage.estimated
        assert 3 <= meter.usage.prompt_tokens <= 10


def test_the_first_model_of_a_server_is_taken_where_none_is_named() -> None:
    with ModelServer("hello") as at:
        made = model(at, model=None)
        assert say(made) == "hello"
        assert made.name == "little"
        assert at.requests[0]["model"] == "little"


def test_a_rate_limit_is_waited_for() -> None:
    with ModelServer("hello", script=[error(429, "slow down", retry_after="0.2"), error(503, "busy")]) as at:
        started = time.monotonic()
        assert say(model(at)) == "hello"
        assert time.monotonic() - started >= 0.2
        assert len(at.requests) == 3


@pytest.mark.parametrize(
    ("header", "value"),
    [
        ("retry_after_ms", "300"),
        ("retry_after", "0.3"),
        ("retry_after", "Mon, 23 Nov 2015 20:21:32 GMT"),
        ("retry_after", "soon"),
        ("retry_after", "nan"),
        ("retry_after", "-5"),
        ("retry_after", ""),
    ],
)
def test_however_a_server_says_how_long_to_wait(header: str, value: str) -> None:
    with ModelServer("hello", script=[error(429, "slow down", **{header: value})]) as at:
        started = time.monotonic()
        assert say(model(at)) == "hello"
        assert (time.monotonic() - started >= 0.3) == (value in ("300", "0.3"))


def test_a_date_far_ahead_is_not_waited_for() -> None:
    late = formatdate(time.time() + 3600, usegmt=True)
    with ModelServer(lambda body: error(429, "slow down", retry_after=late)) as at:
        with pytest.raises(ModelError, match="asked too often"):
            say(model(at))
        assert len(at.requests) == 1


def test_a_rate_limit_that_does_not_end_is_told() -> None:
    with ModelServer(lambda body: error(429, "slow down")) as at:
        with pytest.raises(ModelError, match="asked too often"):
            say(model(at))
        assert len(at.requests) == 4


def test_a_server_that_asks_to_wait_for_an_hour_is_not_waited_for() -> None:
    with ModelServer(lambda body: error(429, "slow down", retry_after="3600")) as at:
        started = time.monotonic()
        with pytest.raises(ModelError, match="asked too often"):
            say(model(at))
        assert time.monotonic() - started < 2


def test_a_used_up_quota_is_not_tried_again() -> None:
    with ModelServer(lambda body: error(429, "insufficient_quota: add credit")) as at:
        with pytest.raises(ModelError, match="add credit"):
            say(model(at))
        assert len(at.requests) == 1


def test_a_server_that_fails_now_and_then_is_asked_again() -> None:
    with ModelServer("hello", script=[error(500, "oops"), error(502, "gateway")]) as at:
        assert say(model(at)) == "hello"


def test_a_slow_server_is_given_up_at_the_deadline() -> None:
    with ModelServer(lambda body: Said(text="late", delay=3.0)) as at:
        started = time.monotonic()
        with pytest.raises(ModelError, match="did not answer within"):
            say(model(at, timeout=0.3, deadline=0.8))
        assert time.monotonic() - started < 2.5


def test_an_answer_that_drips_does_not_outlast_the_deadline() -> None:
    with ModelServer(lambda body: Said(text="hello " * 100, drip=0.02)) as at:
        started = time.monotonic()
        with pytest.raises(ModelError, match="did not answer within"):
            say(model(at, timeout=0.4, deadline=0.9))
        assert time.monotonic() - started < 3


def test_a_connection_that_breaks_is_tried_once_more() -> None:
    with ModelServer("hello", script=[Said(text="half of this is lost", drop=True)]) as at:
        assert say(model(at)) == "hello"
        assert len(at.requests) == 2


def test_a_server_that_is_down_is_one_clear_line() -> None:
    with socket.socket() as unused:
        unused.bind(("127.0.0.1", 0))
        url = f"http://127.0.0.1:{unused.getsockname()[1]}/v1"
    made = connect(Settings(base_url=url, model="little", backoff=0.01), remember=False)
    with pytest.raises(Unreachable) as caught:
        say(made)
    assert "nothing answers at" in caught.value.message
    assert "CGDB_LLM_BASE_URL" in str(caught.value.hint)
    assert "\n" not in caught.value.message


def test_a_web_page_instead_of_json_is_said_so() -> None:
    with ModelServer(lambda body: HTML) as at, pytest.raises(ModelError, match="a web page") as caught:
        say(model(at))
    assert "/v1" in str(caught.value.hint)


@pytest.mark.parametrize(
    "raw",
    [
        "[]",
        "null",
        "{}",
        '{"choices": []}',
        '{"choices": [null]}',
        '{"choices": [{"message": "hello"}]}',
        '{"choices": {"0": 1}}',
        '{"error": {"message": "the model is loading"}}',
        "not json",
        "[" * 100_000,
    ],
)
def test_what_is_no_completion_is_told(raw: str) -> None:
    with ModelServer(lambda body: Said(raw=raw)) as at, pytest.raises(ModelError, match="the model server answered"):
        say(model(at))


def test_an_endless_answer_is_cut_off() -> None:
    with ModelServer(lambda body: Said(raw="x" * (9 << 20))) as at, pytest.raises(ModelError, match="more than 8 MB"):
        say(model(at))


def test_an_empty_answer_is_asked_for_again() -> None:
    with ModelServer("hello", script=[Said(text="")]) as at:
        assert say(model(at)) == "hello"
    with ModelServer("") as at:
        with pytest.raises(ModelError, match="nothing, twice"):
            say(model(at))
        assert len(at.requests) == 2


def test_an_answer_that_was_cut_off_gets_more_room() -> None:
    with ModelServer("hello there", script=[Said(text="hel", finish="length")]) as at:
        assert say(model(at)) == "hello there"
        assert [body["max_tokens"] for body in at.requests] == [50, 200]


def test_a_model_with_a_temperature_and_names_of_its_own_is_obliged_once() -> None:
    def picky(body: dict[str, Any]) -> Any:
        if "temperature" in body:
            return error(400, "Unsupported value: 'temperature' does not support 0 with this model.")
        if "max_tokens" in body:
            return error(400, "Unsupported parameter: 'max_tokens'. Use 'max_completion_tokens' instead.")
        return "hello"

    with ModelServer(picky) as at:
        made = model(at)
        assert say(made) == "hello"
        assert say(made) == "hello"
        assert len(at.requests) == 4, "what was learnt is kept"


def test_a_refused_key_is_told_and_never_shown() -> None:
    with ModelServer(lambda body: error(401, f"Incorrect API key provided: {KEY}")) as at:
        made = model(at)
        with pytest.raises(ModelError) as caught:
            say(made)
        assert "refuses the key" in caught.value.message
        assert KEY not in caught.value.render() + repr(made) + repr(made.settings)
    with ModelServer(lambda body: error(400, f"something with {KEY} in it")) as at, pytest.raises(ModelError) as caught:
        say(model(at))
    assert KEY not in caught.value.render()


def test_a_refusal_is_an_error() -> None:
    message = {"role": "assistant", "content": None, "refusal": "I would rather not."}
    raw = json.dumps({"choices": [{"message": message, "finish_reason": "stop"}]})
    with ModelServer(lambda body: Said(raw=raw)) as at, pytest.raises(ModelError, match="I would rather not"):
        say(model(at))


SCHEMA = {"type": "object", "properties": {"a": {"type": "integer"}}, "required": ["a"], "additionalProperties": False}


@pytest.mark.parametrize("kind", ["openai", "plain", "library", "deaf"])
@pytest.mark.parametrize(
    "said", ['{"a": 1}', '```json\n{"a": 1}\n```', '<think>{"a": 2}? No.</think>\nHere it is: {"a": 1}. Anything else?']
)
def test_json_is_had_from_every_server(kind: str, said: str) -> None:
    with ModelServer(said, kind=kind) as at:
        made = model(at)
        meter = made.meter()
        for _ in range(2):
            assert ask_json(made, HELLO, meter, name="x", schema=SCHEMA, max_tokens=50) == {"a": 1}
        assert len(at.requests) == (4 if kind == "plain" else 2), "a way that was refused is not tried again"


def test_json_is_asked_for_twice_and_then_given_up() -> None:
    with ModelServer("I'd say it is one.", script=["no JSON at all", '{"a": 3}']) as at:
        made = model(at)
        assert ask_json(made, HELLO, made.meter(), name="x", schema=SCHEMA, max_tokens=50) == {"a": 3}
        with pytest.raises(ModelError, match="does not answer with JSON"):
            ask_json(made, HELLO, made.meter(), name="x", schema=SCHEMA, max_tokens=50)


def test_a_wrong_request_does_not_unlearn_what_the_server_can() -> None:
    with ModelServer(lambda body: error(400, "the prompt is longer than the context")) as at:
        made = model(at)
        with pytest.raises(ModelError, match="longer than the context"):
            ask_json(made, HELLO, made.meter(), name="x", schema=SCHEMA, max_tokens=50)
        assert made.abilities.json == ["schema", "object", "text"]


def test_what_was_learnt_is_remembered_by_the_next_process(tmp_path: Path) -> None:
    with ModelServer('{"a": 1}', kind="plain") as at:
        given = Settings(base_url=at.url, model="little", backoff=0.01)
        for count in (3, 4):
            made = connect(given)
            ask_json(made, HELLO, made.meter(), name="x", schema=SCHEMA, max_tokens=50)
            assert len(at.requests) == count
        assert at.lists == 1
        kept = tmp_path / "state" / "cgdb" / "models.json"
        kept.write_text("{damaged")
        made = connect(given)
        ask_json(made, HELLO, made.meter(), name="x", schema=SCHEMA, max_tokens=50)
        assert len(at.requests) == 7


# -- recordings -------------------------------------------------------------------------------------------------


def test_a_conversation_is_recorded_and_replayed_without_a_server(tmp_path: Path) -> None:
    file = tmp_path / "talk.jsonl"
    with ModelServer("hello", script=[error(429, "slow down"), "first"]) as at:
        made = recording(Settings(base_url=at.url, model="little", api_key=KEY, backoff=0.01), file)
        said = [say(made), say(made)]
    again = replaying(file)
    assert [say(again), say(again)] == said == ["first", "hello"]
    assert again.name == "little"
    text = file.read_text()
    assert KEY not in text
    assert at.url not in text
    with pytest.raises(ModelError, match=r"talk\.jsonl has no reply"):
        again.chat([{"role": "user", "content": "another"}], again.meter(), max_tokens=50)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("", "no recording"),
        ("{}", "no recording"),
        ("nonsense", "not JSON lines"),
        ("[1]", "no recording"),
        (None, "cannot be read"),
    ],
)
def test_what_is_no_recording_is_said_so(tmp_path: Path, text: str | None, words: str) -> None:
    file = tmp_path / "talk.jsonl"
    if text is not None:
        file.write_text(text)
    with pytest.raises(UsageError, match=words):
        replaying(file)


# -- settings ---------------------------------------------------------------------------------------------------


def test_nothing_is_configured_at_first() -> None:
    assert settings() is None


def test_the_environment_beats_the_file(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    config = tmp_path / "config" / "cgdb"
    config.mkdir(parents=True)
    (config / "config.toml").write_text(
        '[llm]\nbase_url = "http://a/v1"\nmodel = "m"\ntimeout = 7\n[llm.extra]\nseed = 1\n'
    )
    found = settings()
    assert found is not None
    assert (found.base_url, found.model, found.timeout, found.extra) == ("http://a/v1", "m", 7.0, {"seed": 1})
    monkeypatch.setenv("CGDB_LLM_MODEL", "other")
    assert (found := settings()) is not None
    assert found.model == "other"


def test_a_key_alone_means_openai(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("CGDB_LLM_API_KEY", KEY)
    found = settings()
    assert found is not None
    assert found.base_url == "https://api.openai.com/v1"
    assert KEY not in repr(found)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("[llm", "cannot be read"),
        ('[llm]\nbase_urls = "x"', "has no 'base_urls'"),
        ("llm = 3", "must be a table"),
        ("[llm]\nmodel = 3", "must be a text"),
        ('[llm]\ntimeout = "soon"', "must be a number"),
        ('[llm]\nextra = "seed"', "must be a table"),
        ('[llm]\nbase_url = "localhost:8000"', "must begin with http"),
        ('[llm]\nbase_url = "http://a"\nway = "magic"', "no way 'magic'"),
    ],
)
def test_a_wrong_config_file_is_one_clear_error(tmp_path: Path, text: str, words: str) -> None:
    config = tmp_path / "config" / "cgdb"
    config.mkdir(parents=True)
    (config / "config.toml").write_text(text)
    with pytest.raises(UsageError, match=words):
        settings()


def test_without_the_package_the_pip_line_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "openai", None)
    made = connect(Settings(base_url="http://127.0.0.1:1/v1"), remember=False)
    with pytest.raises(MissingExtraError) as caught:
        say(made)
    assert caught.value.hint == "pip install 'cgdb[llm]'"
