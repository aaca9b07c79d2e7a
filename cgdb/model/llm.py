"""Language models: one seam to any server that speaks OpenAI's chat API, with retries, a deadline and an account.

What a server can do (a grammar, a JSON schema, neither) is found out once and remembered in cgdb.model.abilities.
"""

from __future__ import annotations

import json
import random
import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, ClassVar, Protocol

from cgdb.errors import CgdbError
from cgdb.model.abilities import Abilities, abilities_of
from cgdb.model.llm_settings import Settings

MOST_RETRIES = 3
LARGEST_WAIT = 20.0
"""Seconds that a server may ask us to wait before we try again; one that asks for more is told of at once."""

TRANSIENT = frozenset({408, 409, 425, 429, 500, 502, 503, 504, 520, 522, 524, 529})
REFUSED = frozenset({400, 404, 405, 406, 415, 422, 500, 501})
"""What servers answer to a field that they do not know. Of 500 and 404 only where a plain request is answered."""

Message = Mapping[str, Any]


class ModelError(CgdbError):
    """A language model could not be asked, or answered nothing that can be used.

    status: of HTTP, where there is one. what: the server's own words about the request.
    """

    stage: ClassVar[str] = "model"
    exit_code: ClassVar[int] = 9

    def __init__(self, message: str, *, hint: str | None = None, status: int | None = None, what: str = "") -> None:
        super().__init__(message, hint=hint)
        self.status = status
        self.what = what


class Unreachable(ModelError):
    """No answer came: nothing listens there, the connection broke, or it took too long."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Response:
    """What a server answered. retry_after: seconds that it asks to wait."""

    status: int
    text: str
    retry_after: float | None = None


class Transport(Protocol):
    """Carries one request; ``Unreachable`` where no answer came. path: "models" or "chat/completions"."""

    def send(self, path: str, body: Mapping[str, Any] | None, seconds: float) -> Response: ...


@dataclass(frozen=True, slots=True, kw_only=True)
class Usage:
    """What an answer cost. estimated: the server did not count its tokens, so they were taken as 4 bytes each."""

    calls: int = 0
    prompt_tokens: int = 0
    completion_tokens: int = 0
    seconds: float = 0.0
    estimated: bool = False

    @property
    def tokens(self) -> int:
        """Prompt and completion together."""
        return self.prompt_tokens + self.completion_tokens

    def __add__(self, other: Usage) -> Usage:
        return Usage(
            calls=self.calls + other.calls,
            prompt_tokens=self.prompt_tokens + other.prompt_tokens,
            completion_tokens=self.completion_tokens + other.completion_tokens,
            seconds=self.seconds + other.seconds,
            estimated=self.estimated or other.estimated,
        )

    def __sub__(self, before: Usage) -> Usage:
        return Usage(
            calls=self.calls - before.calls,
            prompt_tokens=self.prompt_tokens - before.prompt_tokens,
            completion_tokens=self.completion_tokens - before.completion_tokens,
            seconds=self.seconds - before.seconds,
            estimated=self.estimated,
        )

    def __str__(self) -> str:
        if not self.calls:
            return f"{self.seconds:.1f} s"
        calls = f"{self.calls} call{'s' if self.calls != 1 else ''}"
        about = "about " if self.estimated else ""
        return f"{calls}, {about}{self.prompt_tokens:,} + {self.completion_tokens:,} tokens, {self.seconds:.1f} s"

    def to_dict(self) -> dict[str, Any]:
        """JSON-ready."""
        return {
            "calls": self.calls,
            "prompt_tokens": self.prompt_tokens,
            "completion_tokens": self.completion_tokens,
            "seconds": round(self.seconds, 3),
            "estimated": self.estimated,
        }


class Meter:
    """The account of one question: every call that was made for it, and the time that is left."""

    def __init__(self, deadline: float) -> None:
        self.deadline = deadline
        self.usage = Usage()
        self._started = time.monotonic()

    @property
    def remaining(self) -> float:
        """Seconds until the deadline, below 0 once it is past."""
        return self.deadline - (time.monotonic() - self._started)

    def add(self, usage: Usage) -> None:
        """One more call."""
        self.usage = self.usage + usage


@dataclass(frozen=True, slots=True, kw_only=True)
class Reply:
    """What the model said. tool: the input of the tool that it called, None where it called none."""

    text: str
    tool: str | None = None
    finish: str = "stop"

    @property
    def said(self) -> str:
        """The tool's input where there is one, else the text."""
        return self.text if self.tool is None else self.tool


@dataclass(slots=True)
class Model:
    """A model on a server. Safe to keep: what was learnt of the server stays with it."""

    settings: Settings
    transport: Transport = field(repr=False)
    abilities: Abilities
    _name: str | None = None

    @property
    def name(self) -> str:
        """The model's name; the server's first where none was configured."""
        return self._name or self.settings.model or "?"

    def meter(self) -> Meter:
        """An account for one question, with the deadline that is configured."""
        return Meter(self.settings.deadline)

    def prepare(self, meter: Meter) -> None:
        """Ask the server, once, what it is and which models it has. That it cannot say is no error."""
        if self.abilities.known and (self._name or self.settings.model):
            return
        listed: list[Any] = []
        try:
            response = self._sent("models", None, meter)
            document = json.loads(response.text) if response.status == 200 else {}
            found = document.get("data") if isinstance(document, dict) else None
            listed = [item for item in found if isinstance(item, dict)] if isinstance(found, list) else []
        except (ValueError, RecursionError):
            listed = []
        names = [str(item["id"]) for item in listed if item.get("id")]
        if self.settings.model is None:
            if not names:
                raise ModelError("the model server does not say which models it has", hint="set CGDB_LLM_MODEL")
            self._name = names[0]
        mine = [item for item in listed if item.get("id") == self.name] or listed
        self.abilities.learn(str(mine[0].get("owned_by", "")) if mine else None)

    def chat(
        self, messages: Sequence[Message], meter: Meter, *, max_tokens: int, more: Mapping[str, Any] | None = None
    ) -> Reply:
        """One answer. more: fields of the request beside the usual ones. ModelError where there is no usable one.

        An answer that is empty or was cut off is asked for once more, with more room where it was cut off.
        """
        self.prepare(meter)
        reply = self._asked(messages, meter, max_tokens, more or {})
        if reply.finish == "length" or not reply.said.strip():
            room = max_tokens * 4 if reply.finish == "length" else max_tokens
            reply = self._asked(messages, meter, room, more or {})
        if not reply.said.strip():
            raise ModelError("the model answered with nothing, twice")
        return reply

    def _asked(self, messages: Sequence[Message], meter: Meter, max_tokens: int, more: Mapping[str, Any]) -> Reply:
        while True:
            body: dict[str, Any] = {"model": self.name, "messages": list(messages)}
            if self.abilities.temperature:
                body["temperature"] = 0
            body[self.abilities.length_field] = max_tokens
            body.update(more)
            body.update(self.settings.extra)
            started = time.monotonic()
            try:
                response = self._sent("chat/completions", body, meter)
            except ModelError:
                meter.add(Usage(calls=1, seconds=time.monotonic() - started))
                raise
            if response.status == 200:
                return self._read(response.text, body, meter, time.monotonic() - started)
            meter.add(Usage(calls=1, seconds=time.monotonic() - started))
            what = _what(response.text)
            # Some models only take the temperature they like, and call the length by another name.
            if response.status in (400, 422) and self.abilities.without(what, body):
                continue
            raise self._refusal(response.status, what)

    def _sent(self, path: str, body: Mapping[str, Any] | None, meter: Meter) -> Response:
        """The server's answer, after waiting and trying again where that may help."""
        attempt = 0
        while True:
            left = meter.remaining
            if left <= 0:
                raise self._late()
            try:
                response = self.transport.send(path, body, min(self.settings.timeout, left))
            except Unreachable as error:
                # Where nothing listens, waiting long is a waste; once more catches a server that restarts.
                if attempt >= 1 or meter.remaining <= 0:
                    raise error from None
                response = None
            if response is not None:
                what = _what(response.text)
                hopeless = "insufficient_quota" in what or "context" in what
                if response.status not in TRANSIENT or attempt >= MOST_RETRIES or hopeless:
                    return response
                if response.status == 500 and body is not None and not body.keys() <= _PLAIN:
                    return response  # a server that trips over a constraint trips over it again
            wait = self.settings.backoff * 2**attempt * random.uniform(0.75, 1.25)
            if response is not None and response.retry_after is not None:
                wait = max(wait, response.retry_after)
            if wait > min(LARGEST_WAIT, meter.remaining):
                if response is None:
                    raise self._late()
                return response
            time.sleep(wait)
            attempt += 1

    def _late(self) -> ModelError:
        return ModelError(
            f"the model server did not answer within {self.settings.deadline:g} s",
            hint="allow more by deadline in the config file, or take a smaller model",
        )

    def _refusal(self, status: int, what: str) -> ModelError:
        shown = f": {self._hidden(what)}" if what else ""
        if status in (401, 403):
            return ModelError(
                f"the model server refuses the key ({status})", hint="CGDB_LLM_API_KEY must be its key", status=status
            )
        if status == 429:
            return ModelError(
                f"the model server is asked too often{shown}", hint="wait a while", status=status, what=what
            )
        return ModelError(f"the model server answered {status}{shown}", status=status, what=what)

    def _hidden(self, text: str) -> str:
        """One line for a person, without the key."""
        key = self.settings.api_key
        shown = text.replace(key, "***") if key else text
        return " ".join("".join(c if c.isprintable() else " " for c in shown).split())[:200]

    def _read(self, text: str, body: Mapping[str, Any], meter: Meter, seconds: float) -> Reply:
        try:
            document = json.loads(text)
        except (ValueError, RecursionError):
            meter.add(Usage(calls=1, seconds=seconds))
            kind = "a web page" if text.lstrip()[:1] == "<" else f"{len(text)} characters that are no JSON"
            raise ModelError(
                f"the model server answered with {kind}",
                hint="CGDB_LLM_BASE_URL must be the API, which mostly ends in /v1",
                status=200,
            ) from None
        usage = _usage(document, body, text, seconds)
        meter.add(usage)
        choices = document.get("choices") if isinstance(document, dict) else None
        first = choices[0] if isinstance(choices, list) and choices and isinstance(choices[0], dict) else None
        message = first.get("message") if first else None
        if first is None or not isinstance(message, dict):
            what = _what(text)
            shown = f": {self._hidden(what)}" if what else ""
            raise ModelError(f"the model server answered with no message{shown}", status=200, what=what)
        if message.get("refusal"):
            raise ModelError(f"the model refuses to answer: {self._hidden(str(message['refusal']))}")
        return Reply(
            text=_content(message.get("content")),
            tool=_tool(message.get("tool_calls")),
            finish=str(first.get("finish_reason") or "stop"),
        )


_PLAIN = frozenset({"model", "messages", "temperature", "max_tokens", "max_completion_tokens"})


def connect(settings: Settings, *, transport: Transport | None = None, remember: bool = True) -> Model:
    """The model that settings name. remember: keep what is learnt of the server for other processes."""
    if transport is None:
        from cgdb.model.llm_http import OpenAITransport

        transport = OpenAITransport(settings)
    return Model(settings=settings, transport=transport, abilities=abilities_of(settings, remember=remember))


def _content(content: Any) -> str:
    if isinstance(content, str):
        return content
    if isinstance(content, list):
        return "".join(str(part.get("text") or "") for part in content if isinstance(part, dict))
    return ""


def _tool(calls: Any) -> str | None:
    for call in calls if isinstance(calls, list) else ():
        if isinstance(call, dict):
            for kind, part in (("custom", "input"), ("function", "arguments")):
                if isinstance(call.get(kind), dict) and isinstance(call[kind].get(part), str):
                    return str(call[kind][part])
    return None


def _usage(document: Any, body: Mapping[str, Any], text: str, seconds: float) -> Usage:
    told = document.get("usage") if isinstance(document, dict) else None
    if isinstance(told, dict):
        prompt, completion = told.get("prompt_tokens"), told.get("completion_tokens")
        if isinstance(prompt, int) and isinstance(completion, int) and min(prompt, completion) >= 0:
            return Usage(calls=1, prompt_tokens=prompt, completion_tokens=completion, seconds=seconds)
    return Usage(
        calls=1,
        prompt_tokens=estimated_tokens(body["messages"]),
        completion_tokens=max(1, len(text) // 4),
        seconds=seconds,
        estimated=True,
    )


def estimated_tokens(messages: Sequence[Message]) -> int:
    """What messages come to, at 4 bytes of UTF-8 per token, which the common tokenizers keep to for English."""
    return sum(len(_content(message["content"]).encode()) // 4 + 4 for message in messages)


def _what(text: str) -> str:
    """The server's own words about an error."""
    try:
        document = json.loads(text)
    except (ValueError, RecursionError):
        return "" if text.lstrip()[:1] == "<" else text[:300]
    error = document.get("error", document.get("detail", document)) if isinstance(document, dict) else document
    if isinstance(error, dict):
        told = [error.get(name) for name in ("message", "code", "param")]
        return " ".join(str(item) for item in told if item)[:600]
    return str(error)[:600]
