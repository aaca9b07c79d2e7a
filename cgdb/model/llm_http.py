"""Requests to a model server by the openai package: its connections, proxies, time-outs and errors."""

from __future__ import annotations

import math
import threading
import time
from collections.abc import Mapping
from datetime import UTC, datetime
from email.utils import parsedate_to_datetime
from typing import Any

from cgdb.errors import MissingExtraError
from cgdb.model.llm import Response, Unreachable
from cgdb.model.llm_settings import Settings

LARGEST_REPLY = 8 << 20
"""Bytes. An answer of a few thousand tokens has some ten thousand; what is larger is no answer."""


class OpenAITransport:
    """One server. The package's own retries are off: they know of no deadline over all of a question."""

    def __init__(self, settings: Settings) -> None:
        self._settings = settings
        self._where = settings.base_url
        self._package: Any = None
        self._client: Any = None
        self._lock = threading.Lock()

    def _connect(self) -> None:
        """MissingExtraError where the package is not installed: only now, so that without it all else works."""
        try:
            import openai
        except ImportError:
            raise MissingExtraError(
                "language models are asked by the package openai, which is not installed",
                hint="pip install 'cgdb[llm]'",
            ) from None
        self._package = openai
        # Local servers want no key, but the package wants one.
        self._client = openai.OpenAI(
            base_url=self._where,
            api_key=self._settings.api_key or "none",
            max_retries=0,
            timeout=self._settings.timeout,
        )

    def close(self) -> None:
        """Give the connections back; the next request makes new ones."""
        client, self._client = self._client, None
        if client is not None:
            client.close()

    def send(self, path: str, body: Mapping[str, Any] | None, seconds: float) -> Response:
        """One request; seconds is for all of it, however slowly it comes."""
        with self._lock:  # several questions may be the first
            if self._client is None:
                self._connect()
        started = time.monotonic()
        try:
            if path == "models":
                raw = self._client.models.with_raw_response.list(timeout=seconds)
                return Response(status=200, text=raw.text if isinstance(raw.text, str) else raw.text())
            assert body is not None
            more = {name: value for name, value in body.items() if name not in ("model", "messages")}
            stream = self._client.chat.completions.with_streaming_response.create(
                model=body["model"], messages=body["messages"], extra_body=more, timeout=seconds
            )
            with stream as response:
                return Response(status=200, text=self._text(response.iter_bytes(), started, seconds))
        except self._package.APIStatusError as error:
            return Response(
                status=error.status_code, text=_body(error.response), retry_after=_seconds(error.response.headers)
            )
        except self._package.APITimeoutError:
            raise self._slow(seconds) from None
        except self._package.APIConnectionError as error:
            raise Unreachable(
                f"nothing answers at {self._where} ({type(error.__cause__ or error).__name__})",
                hint="is the model server running? CGDB_LLM_BASE_URL says where",
            ) from None
        except Unreachable:
            raise
        except Exception as error:  # noqa: BLE001  what httpx raises while a body is read, whichever httpx openai uses
            if "Timeout" in type(error).__name__:
                raise self._slow(seconds) from None
            raise Unreachable(f"the answer of {self._where} broke off ({type(error).__name__})") from None

    def _slow(self, seconds: float) -> Unreachable:
        return Unreachable(
            f"{self._where} did not answer within {seconds:.3g} s",
            hint="allow more by timeout in the config file, or take a smaller model",
        )

    def _text(self, pieces: Any, started: float, seconds: float) -> str:
        body = bytearray()
        for piece in pieces:
            body += piece
            if len(body) > LARGEST_REPLY:
                raise Unreachable(f"{self._where} answered with more than {LARGEST_REPLY >> 20} MB")
            # A read time-out never ends an answer that comes byte by byte.
            if time.monotonic() - started > seconds:
                raise self._slow(seconds)
        return body.decode("utf-8", "replace")


def _body(response: Any) -> str:
    try:
        return str(response.text)[:10_000]
    except Exception:  # noqa: BLE001  an error whose words cannot be read is an error all the same
        return ""


def _seconds(headers: Mapping[str, str]) -> float | None:
    """How long a server asks to wait: in milliseconds as OpenAI says it, in seconds, or until a date."""
    for name, unit in (("retry-after-ms", 1000.0), ("retry-after", 1.0)):
        try:
            wait = float(headers.get(name, "")) / unit
        except ValueError:
            continue
        return max(0.0, wait) if math.isfinite(wait) else None
    try:
        until = parsedate_to_datetime(headers.get("retry-after", ""))
    except ValueError:
        return None
    if until.tzinfo is None:
        until = until.replace(tzinfo=UTC)
    return max(0.0, (until - datetime.now(UTC)).total_seconds())
