"""What a model server can do: which of the ways to well-formed answers it takes. Found out once, and remembered.

Servers that speak OpenAI's API differ in how an answer is constrained. Who a server is, its list of models tells
(``owned_by``); what it does not know it refuses, which costs a round trip and no tokens; what it ignores shows in
answers that are not as they should be.
"""

from __future__ import annotations

import contextlib
import json
import os
import time
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from cgdb.model.llm_settings import Settings, state_folder

CGQL_WAYS = ("tool", "structured_outputs", "guided_grammar", "ebnf", "llguidance", "schema", "text")
JSON_WAYS = ("schema", "object", "text")
GRAMMARS = frozenset({"tool", "structured_outputs", "guided_grammar", "ebnf", "llguidance"})
"""The ways that constrain by the Lark grammar: OpenAI's custom tools; vLLM's field of today and of before; SGLang's
and llama.cpp's where they were built with llguidance."""

_OF_SERVERS: Mapping[str, tuple[str, ...]] = {
    "vllm": ("structured_outputs", "guided_grammar", "schema", "text"),
    "sglang": ("ebnf", "schema", "text"),
    "llamacpp": ("llguidance", "schema", "text"),
    "library": ("schema", "text"),  # Ollama
}
_OF_OTHERS = ("tool", "schema", "text")

KEPT = 7 * 24 * 3600.0
"""Seconds after which a server is asked anew: it may have been given a new version."""


@dataclass(slots=True)
class Abilities:
    """cgql, json: the ways that are left to try, best first; the last, "text", is always there."""

    cgql: list[str] = field(default_factory=lambda: list(_OF_OTHERS))
    json: list[str] = field(default_factory=lambda: list(JSON_WAYS))
    temperature: bool = True
    length_field: str = "max_tokens"
    known: bool = False
    key: str | None = None
    forced: str = "auto"

    def learn(self, owner: str | None) -> None:
        """Take in who the server says that it is; None where it does not say, which is not kept."""
        self.known = True
        ways = list(_OF_SERVERS.get((owner or "").casefold(), _OF_OTHERS))
        if self.forced != "auto":
            ways = [way for way in ways if kind_of(way) == self.forced]
        self.cgql = [*(way for way in ways if way != "text"), "text"]
        if owner is not None:
            self._keep()

    def cannot(self, kind: str, way: str) -> None:
        """The server does not know that way of answering ("cgql" or "json"), or takes no notice of it."""
        ways = self.cgql if kind == "cgql" else self.json
        if way != "text" and way in ways:
            ways.remove(way)
            self._keep()

    def without(self, what: str, body: Mapping[str, Any]) -> bool:
        """Whether the server's complaint is about a usual field that can be left out or renamed; it is from now on."""
        if "temperature" in what and "temperature" in body:
            self.temperature = False
        elif "max_tokens" in what and "max_tokens" in body:
            self.length_field = "max_completion_tokens"
        else:
            return False
        self._keep()
        return True

    def _keep(self) -> None:
        if self.key is None:
            return
        path = _file()
        kept = _kept(path)
        kept[self.key] = {
            "cgql": self.cgql,
            "json": self.json,
            "temperature": self.temperature,
            "length_field": self.length_field,
            "at": time.time(),
        }
        # It only ever saves a round trip: a home that cannot be written is no reason not to answer.
        with contextlib.suppress(OSError):
            path.parent.mkdir(parents=True, exist_ok=True)
            new = path.with_suffix(f".{os.getpid()}")
            new.write_text(json.dumps(kept, indent=1), "utf-8")
            new.replace(path)


def kind_of(way: str) -> str:
    """ "grammar", "schema" or "text"."""
    return "grammar" if way in GRAMMARS else way


def abilities_of(settings: Settings, *, remember: bool) -> Abilities:
    """What is known of the server and model of these settings; with remember, from and for other processes too."""
    fresh = Abilities(forced=settings.way)
    if settings.way != "auto" or not remember:
        return fresh
    key = f"{settings.base_url} {settings.model or ''}"
    fresh.key = key
    kept = _kept(_file()).get(key)
    if not isinstance(kept, dict) or not isinstance(kept.get("at"), (int, float)):
        return fresh
    ways = {kind: kept.get(kind) for kind in ("cgql", "json")}
    sound = all(isinstance(w, list) and w and set(w) <= {*CGQL_WAYS, *JSON_WAYS} for w in ways.values())
    if not sound or not 0 <= time.time() - kept["at"] < KEPT:
        return fresh
    return Abilities(
        cgql=[str(way) for way in ways["cgql"] or ()],
        json=[str(way) for way in ways["json"] or ()],
        temperature=kept.get("temperature") is not False,
        length_field="max_completion_tokens" if kept.get("length_field") == "max_completion_tokens" else "max_tokens",
        known=True,
        key=key,
    )


def _file() -> Path:
    return state_folder() / "models.json"


def _kept(path: Path) -> dict[str, Any]:
    try:
        document = json.loads(path.read_text("utf-8"))
    except (OSError, ValueError, RecursionError):
        return {}
    return document if isinstance(document, dict) else {}
