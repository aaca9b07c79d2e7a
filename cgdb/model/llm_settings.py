"""Which language model to ask: from the environment, else from a config file. Nothing is asked of a server here."""

from __future__ import annotations

import os
import tomllib
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from cgdb.errors import UsageError, did_you_mean, one_of

OPENAI = "https://api.openai.com/v1"
WAYS = ("auto", "grammar", "schema", "text")


@dataclass(frozen=True, slots=True, kw_only=True)
class Settings:
    """base_url: of the API, mostly ending in /v1. model None: the server's first. The key is never shown.

    timeout: seconds that one request may take; deadline: all requests of one question. backoff: seconds before the
    first retry, doubled for each. way: "auto", or the only way to ask for CGQL. extra: more fields for each request.
    prompt_price, completion_price: per million tokens, for estimates.
    """

    base_url: str = OPENAI
    model: str | None = None
    api_key: str | None = field(default=None, repr=False)
    timeout: float = 60.0
    deadline: float = 120.0
    backoff: float = 0.5
    way: str = "auto"
    extra: Mapping[str, Any] = field(default_factory=dict)
    prompt_price: float | None = None
    completion_price: float | None = None


_NUMBERS = ("timeout", "deadline", "backoff", "prompt_price", "completion_price")
_TEXTS = ("base_url", "model", "api_key", "way")


def config_file() -> Path:
    """``cgdb/config.toml`` in the folder of config files, by the XDG rules; it need not exist."""
    return _folder("XDG_CONFIG_HOME", ".config") / "config.toml"


def state_folder() -> Path:
    """Where what was learnt of servers is kept, by the XDG rules; it need not exist."""
    return _folder("XDG_STATE_HOME", ".local/state")


def _folder(variable: str, default: str) -> Path:
    given = os.environ.get(variable, "")
    return (Path(given) if Path(given).is_absolute() else Path.home() / default) / "cgdb"


def settings() -> Settings | None:
    """The configured model; None where neither a server nor a key is. CGDB_LLM_* beat the file's ``[llm]``.

    UsageError where the file or a value of it cannot be understood.
    """
    given = _from_file(config_file())
    for name in ("base_url", "model", "api_key", "timeout", "deadline", "way"):
        value = os.environ.get(f"CGDB_LLM_{name.upper()}", "").strip()
        if value:
            given[name] = _number(f"CGDB_LLM_{name.upper()}", value) if name in _NUMBERS else value
    if "base_url" not in given and "api_key" not in given:
        return None
    where = str(given.get("base_url", OPENAI))
    if not where.startswith(("http://", "https://")):
        raise UsageError(f"the model server's address must begin with http:// or https://, not {where[:60]!r}")
    if given.get("way", "auto") not in WAYS:
        raise UsageError(f"there is no way '{given['way']}' to ask a model", hint=f"one of {one_of(WAYS)}")
    return Settings(**given)


def _from_file(path: Path) -> dict[str, Any]:
    try:
        document = tomllib.loads(path.read_text("utf-8"))
    except FileNotFoundError:
        return {}
    except (OSError, ValueError) as error:
        raise UsageError(f"{path} cannot be read: {error}") from None
    table = document.get("llm", {})
    if not isinstance(table, dict):
        raise UsageError(f"{path}: [llm] must be a table")
    known = (*_TEXTS, *_NUMBERS, "extra")
    given: dict[str, Any] = {}
    for name, value in table.items():
        if name not in known:
            raise UsageError(f"{path}: [llm] has no '{name}'", hint=did_you_mean(name, known) or one_of(known, most=12))
        if name == "extra" and not isinstance(value, dict):
            raise UsageError(f"{path}: extra must be a table of more fields for each request")
        if name in _TEXTS and not isinstance(value, str):
            raise UsageError(f"{path}: {name} must be a text in quotes")
        given[name] = _number(f"{path}: {name}", value) if name in _NUMBERS else value
    return given


def _number(where: str, value: Any) -> float:
    try:
        number = float(value)
    except (TypeError, ValueError):
        number = -1.0
    if not 0 <= number < 1e6:
        raise UsageError(f"{where} must be a number from 0 up, not {str(value)[:40]!r}")
    return number
