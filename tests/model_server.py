"""A model server on loopback for the tests: real HTTP, OpenAI's chat API, several servers' manners, and misbehaviour.

What the model says is given by the test; how it is carried is what real servers do:

- kind "openai" refuses fields that it does not know, takes custom tools with a Lark grammar and JSON schemas;
- "vllm" takes ``structured_outputs`` and ignores what it does not know; "sglang" takes ``ebnf``; "llamacpp" takes
  ``grammar`` that begins with %llguidance; "library" (Ollama) takes JSON schemas only; "plain" refuses them all;
- "deaf" takes everything and heeds nothing.

A grammar is compiled by llguidance, as these servers do: one that it does not take is refused.
"""

from __future__ import annotations

import json
import threading
import time
from collections import deque
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from typing import Any, Self

USUAL = frozenset({"model", "messages", "temperature", "max_tokens", "max_completion_tokens"})
TAKEN: Mapping[str, frozenset[str]] = {
    "openai": frozenset({"tools", "tool_choice", "response_format"}),
    "vllm": frozenset({"structured_outputs", "response_format"}),
    "sglang": frozenset({"ebnf", "response_format"}),
    "llamacpp": frozenset({"grammar", "response_format"}),
    "library": frozenset({"response_format"}),
    "plain": frozenset(),
    "deaf": frozenset(),
}
REFUSING = ("openai", "plain", "llamacpp")
"""Kinds that refuse what they do not know; the others take no notice of it."""


@dataclass(frozen=True, kw_only=True)
class Said:
    """One answer. Of a model: text, finish, and whether it goes through the tool. Of a misbehaving server: the rest.

    raw: the body instead of a completion. delay: seconds before it. drip: seconds between its bytes. drop: the
    connection is closed in the middle.
    """

    text: str | None = None
    finish: str = "stop"
    status: int = 200
    headers: Mapping[str, str] = field(default_factory=dict)
    raw: str | None = None
    delay: float = 0.0
    drip: float = 0.0
    drop: bool = False
    counted: bool = True


Brain = Callable[[dict[str, Any]], "Said | str"]


def error(status: int, message: str, **headers: str) -> Said:
    """An error as these servers word it."""
    body = json.dumps({"error": {"message": message, "type": "invalid_request_error", "code": None}})
    return Said(status=status, raw=body, headers={name.replace("_", "-"): value for name, value in headers.items()})


HTML = Said(raw="<!DOCTYPE html><html><body><h1>It works!</h1></body></html>", headers={"content-type": "text/html"})


class ModelServer:
    """``with ModelServer(brain) as server``: listens on ``server.url`` until the block ends.

    brain: what the model says to a request. script: answers that come first, one per request. requests: the bodies of
    all chat requests; keys: what stood in their Authorization.
    """

    def __init__(
        self, brain: Brain | str = "", *, kind: str = "openai", script: list[Said | str] | None = None
    ) -> None:
        self.brain: Brain = brain if callable(brain) else lambda body: brain
        self.kind = kind
        self.script = deque(script or [])
        self.requests: list[dict[str, Any]] = []
        self.keys: list[str] = []
        self.lists = 0
        self._http = ThreadingHTTPServer(("127.0.0.1", 0), self._handler())
        self._http.daemon_threads = True
        self._thread = threading.Thread(target=self._http.serve_forever, kwargs={"poll_interval": 0.02}, daemon=True)

    @property
    def url(self) -> str:
        return f"http://127.0.0.1:{self._http.server_address[1]}/v1"

    def __enter__(self) -> Self:
        self._thread.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._http.shutdown()
        self._http.server_close()
        self._thread.join(timeout=5)

    def _answer(self, body: dict[str, Any]) -> Said:
        self.requests.append(body)
        if self.script:
            said = self.script.popleft()
            return said if isinstance(said, Said) else Said(text=said)
        problem = _problem(self.kind, body)
        if problem:
            return error(400, problem)
        said = self.brain(body)
        return said if isinstance(said, Said) else Said(text=said)

    def _completion(self, said: Said, body: dict[str, Any]) -> str:
        message: dict[str, Any] = {"role": "assistant", "content": said.text}
        tools = body.get("tools") if self.kind == "openai" else None
        if tools and said.text:
            call = {
                "id": "call_1",
                "type": "custom",
                "custom": {"name": tools[0]["custom"]["name"], "input": said.text},
            }
            message = {"role": "assistant", "content": None, "tool_calls": [call]}
        document: dict[str, Any] = {
            "id": "chatcmpl-1",
            "object": "chat.completion",
            "created": 1,
            "model": body.get("model"),
            "choices": [{"index": 0, "message": message, "finish_reason": said.finish}],
        }
        if said.counted:
            prompt = sum(len(json.dumps(m["content"])) for m in body["messages"]) // 4
            completion = len(said.text or "") // 4
            document["usage"] = {
                "prompt_tokens": prompt,
                "completion_tokens": completion,
                "total_tokens": prompt + completion,
            }
        return json.dumps(document)

    def _handler(self) -> type[BaseHTTPRequestHandler]:
        server = self

        class Handler(BaseHTTPRequestHandler):
            protocol_version = "HTTP/1.1"

            def log_message(self, format: str, *args: object) -> None:
                """Quiet."""

            def do_GET(self) -> None:
                server.lists += 1
                if self.path != "/v1/models" or server.kind == "plain":
                    self._send(error(404, "no such page"), "{}")
                    return
                models = [{"id": "little", "object": "model", "created": 1, "owned_by": server.kind}]
                self._send(Said(), json.dumps({"object": "list", "data": models}))

            def do_POST(self) -> None:
                body = json.loads(self.rfile.read(int(self.headers["content-length"])))
                server.keys.append(self.headers.get("authorization", ""))
                said = server._answer(body)
                time.sleep(said.delay)
                self._send(said, server._completion(said, body))

            def _send(self, said: Said, usual: str) -> None:
                payload = (usual if said.raw is None else said.raw).encode()
                try:
                    self.send_response(said.status)
                    for name, value in {"content-type": "application/json", **said.headers}.items():
                        self.send_header(name, value)
                    self.send_header("content-length", str(len(payload)))
                    self.end_headers()
                    if said.drop:
                        self.wfile.write(payload[: len(payload) // 2])
                        self.close_connection = True
                    elif said.drip:
                        for start in range(len(payload)):
                            self.wfile.write(payload[start : start + 1])
                            self.wfile.flush()
                            time.sleep(said.drip)
                    else:
                        self.wfile.write(payload)
                except OSError:
                    self.close_connection = True  # the other side has left

        return Handler


def _problem(kind: str, body: Mapping[str, Any]) -> str | None:
    """Why this kind of server would refuse the request; None where it would not."""
    import llguidance

    unknown = body.keys() - USUAL - TAKEN[kind]
    if unknown and kind in REFUSING:
        return f"Unrecognized request argument supplied: {', '.join(sorted(unknown))}"
    grammars = [tool["custom"]["format"]["grammar"]["definition"] for tool in body.get("tools", ()) if kind == "openai"]
    grammars += [body[name]["grammar"] for name in ("structured_outputs",) if name in body and kind == "vllm"]
    grammars += [body["ebnf"]] if "ebnf" in body and kind == "sglang" else []
    if kind == "llamacpp" and "grammar" in body:
        head, _, rest = body["grammar"].partition("\n")
        if not head.startswith("%llguidance"):
            return "failed to parse grammar"
        grammars.append(rest)
    for grammar in grammars:
        wrong = llguidance.LLMatcher.validate_grammar(llguidance.LLMatcher.grammar_from_lark(grammar))
        if wrong:
            return f"Invalid grammar: {wrong}"
    return None


def user_text(body: Mapping[str, Any]) -> str:
    """All that the user said in a request."""
    texts = []
    for message in body["messages"]:
        if message["role"] == "user":
            content = message["content"]
            texts.append(content if isinstance(content, str) else " ".join(p.get("text", "") for p in content))
    return "\n".join(texts)


def question_in(body: Mapping[str, Any]) -> str:
    """The question that a prompt ends with."""
    line = next(line for line in reversed(user_text(body).splitlines()) if line.startswith("Question: "))
    return str(json.loads(line.removeprefix("Question: ")))


def candidates_in(body: Mapping[str, Any]) -> list[dict[str, Any]]:
    """The candidates in a prompt for re-ranking; [] in any other."""
    lines = user_text(body).splitlines()
    if "Candidates:" not in lines:
        return []
    found: list[dict[str, Any]] = json.loads(lines[lines.index("Candidates:") + 2])
    return found


def judging(final: list[str], *, achievable: bool = True, explanation: str = "because", **more: Any) -> str:
    """An answer in the planner's fields."""
    return json.dumps(
        {
            "inferred_query": "what is wanted",
            "relevant_objects": final,
            "query_achievable": achievable,
            "final_relevant_objects": final,
            "explanation": explanation,
            **more,
        }
    )
