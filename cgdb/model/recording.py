"""Conversations with a model, recorded to a file and replayed from it: JSON lines of request hash and reply.

The first line has the model and what was set for it; each other is {"request": hash, "status", "text", "retry_after"},
and in "body", for people, what was asked. No key and no address is in it. Equal requests are answered in the order of
their recording.
"""

from __future__ import annotations

import json
import threading
from collections import deque
from collections.abc import Mapping
from hashlib import sha256
from pathlib import Path
from typing import Any

from cgdb.errors import UsageError
from cgdb.model.llm import Model, Response, Transport, Unreachable, connect
from cgdb.model.llm_settings import WAYS, Settings


def request_hash(path: str, body: Mapping[str, Any] | None) -> str:
    """The same for the same request, whatever the order of its fields."""
    text = json.dumps([path, body], sort_keys=True, ensure_ascii=False)
    return sha256(text.encode("utf-8", "surrogatepass")).hexdigest()[:24]


class Recorder:
    """Passes requests on and writes down what came back, each at once."""

    def __init__(self, transport: Transport, path: Path, settings: Settings) -> None:
        self._transport = transport
        self._path = path
        self._lock = threading.Lock()  # several threads may ask at a time
        try:
            new = not path.exists() or path.stat().st_size == 0
            with path.open("a", encoding="utf-8") as file:
                if new:
                    head = {"model": settings.model, "way": settings.way, "extra": dict(settings.extra)}
                    file.write(json.dumps({"cgdb": "conversation", "version": 1, **head}) + "\n")
        except OSError as error:
            raise UsageError(f"{path} cannot be written: {error.strerror or error}") from None

    def send(self, path: str, body: Mapping[str, Any] | None, seconds: float) -> Response:
        """One request; what got no answer is recorded as such."""
        try:
            response = self._transport.send(path, body, seconds)
        except Unreachable as error:
            self._write(path, body, {"unreachable": error.message})
            raise
        self._write(path, body, {"status": response.status, "text": response.text, "retry_after": response.retry_after})
        return response

    def _write(self, path: str, body: Mapping[str, Any] | None, reply: Mapping[str, Any]) -> None:
        line = {"request": request_hash(path, body), "path": path, "body": body, **reply}
        text = json.dumps(line, ensure_ascii=False) + "\n"
        try:
            # Half a surrogate pair, which UTF-8 does not have, becomes \\udXXX: what JSON writes for it, too.
            with self._lock, self._path.open("a", encoding="utf-8", errors="backslashreplace") as file:
                file.write(text)
        except OSError as error:
            raise UsageError(f"{self._path} cannot be written: {error.strerror or error}") from None


class Player:
    """Answers from a recording; a request that is not in it is Unreachable."""

    def __init__(self, path: Path) -> None:
        """UsageError where the file is no recording."""
        self._path = path
        self._lock = threading.Lock()
        self._replies: dict[str, deque[Mapping[str, Any]]] = {}
        try:
            with path.open(encoding="utf-8") as file:
                lines = [json.loads(line) for line in file if line.strip()]
        except OSError as error:
            raise UsageError(f"{path} cannot be read: {error.strerror or error}") from None
        except (ValueError, RecursionError):
            raise UsageError(f"{path} is no recording: it is not JSON lines") from None
        if not lines or not isinstance(lines[0], dict) or lines[0].get("cgdb") != "conversation":
            raise UsageError(f"{path} is no recording", hint="`cgdb ask --record FILE` makes one")
        model, way, extra = (lines[0].get(name) for name in ("model", "way", "extra"))
        self.settings = Settings(
            base_url="http://replay.invalid/v1",
            model=model if isinstance(model, str) else None,
            way=way if way in WAYS else "auto",
            extra=extra if isinstance(extra, dict) else {},
            backoff=0.0,
        )
        for line in lines[1:]:
            if not isinstance(line, dict) or not isinstance(line.get("request"), str):
                raise UsageError(f"{path} is no recording: a line has no request")
            self._replies.setdefault(line["request"], deque()).append(line)

    def send(self, path: str, body: Mapping[str, Any] | None, seconds: float) -> Response:
        """What was answered then."""
        replies = self._replies.get(request_hash(path, body))
        if not replies:
            raise Unreachable(
                f"{self._path.name} has no reply to this request",
                hint="another question, map or version of cgdb asks otherwise: record it anew",
            )
        with self._lock:
            reply = replies.popleft() if len(replies) > 1 else replies[0]
        if "unreachable" in reply or not isinstance(reply.get("text"), str):
            raise Unreachable(str(reply.get("unreachable", "the recorded reply is damaged")))
        retry = reply.get("retry_after")
        return Response(
            status=int(reply.get("status", 200)),
            text=reply["text"],
            retry_after=float(retry) if isinstance(retry, (int, float)) else None,
        )


def recording(settings: Settings, path: Path) -> Model:
    """The model of settings, recorded. What was learnt of the server before is not used: a replay knows none of it."""
    from cgdb.model.llm_http import OpenAITransport

    return connect(settings, transport=Recorder(OpenAITransport(settings), path, settings), remember=False)


def replaying(path: Path) -> Model:
    """A model that says what was recorded; needs no server, no key and no package."""
    player = Player(path)
    return connect(player.settings, transport=player, remember=False)
