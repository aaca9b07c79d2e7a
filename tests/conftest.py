"""What every test may use."""

from __future__ import annotations

import os
import signal
from collections.abc import Iterator
from pathlib import Path

import pytest

# A run that was started in the background ignores Ctrl-C, and so would every process that it tries Ctrl-C on.
signal.signal(signal.SIGINT, signal.default_int_handler)


@pytest.fixture(scope="session")
def data() -> Path:
    """The folder of real maps, vectors and judged queries; the test is skipped where there is none."""
    folder = os.environ.get("CGDB_TEST_DATA")
    if not folder:
        pytest.skip("CGDB_TEST_DATA is not set: this test needs the real maps")
    path = Path(folder).resolve()
    if not path.is_dir():
        pytest.fail(f"CGDB_TEST_DATA names no folder: {path}")
    return path


@pytest.fixture
def no_model(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> Iterator[None]:
    """Neither the settings nor the memory of whoever runs the tests: no language model is configured.

    What a test connects to is closed behind it: a failed call may leave its connection to the garbage collector.
    """
    for name in ("BASE_URL", "MODEL", "API_KEY", "TIMEOUT", "DEADLINE", "WAY"):
        monkeypatch.delenv(f"CGDB_LLM_{name}", raising=False)
    for name in ("HTTP_PROXY", "HTTPS_PROXY", "ALL_PROXY", "http_proxy", "https_proxy", "all_proxy"):
        monkeypatch.delenv(name, raising=False)
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path / "state"))
    monkeypatch.setenv("XDG_CONFIG_HOME", str(tmp_path / "config"))
    from cgdb.model.llm_http import OpenAITransport

    connected: list[OpenAITransport] = []
    connect = OpenAITransport._connect

    def remembered(transport: OpenAITransport) -> None:
        connect(transport)
        connected.append(transport)

    monkeypatch.setattr(OpenAITransport, "_connect", remembered)
    yield
    for transport in connected:
        transport.close()
