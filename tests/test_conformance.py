"""Every case of tests/conformance on both graph engines."""

from __future__ import annotations

import importlib.util
import json
import os
import subprocess
import sys
import tomllib
from collections import Counter
from collections.abc import Iterator
from functools import cache
from pathlib import Path
from typing import Any

import pytest

FOLDER = Path(__file__).with_name("conformance")
FILES = {path.stem: tomllib.loads(path.read_text(encoding="utf-8")) for path in sorted(FOLDER.glob("*.toml"))}
CASES = [(name, number) for name, document in FILES.items() for number in range(len(document["case"]))]
ENGINES = [chosen] if (chosen := os.environ.get("CGDB_GRAPH_ENGINE")) else ["kuzu", "ladybug"]
EXPECTATIONS = {"rows", "plan", "error"}
KEYS = {
    "says",
    "query",
    "parameters",
    "limits",
    "fill",
    "any_order",
    "columns",
    "fits",
    "why",
    "warnings",
} | EXPECTATIONS
TOLERANCE = 1e-4


class Engine:
    """A process that answers the cases on one graph engine."""

    def __init__(self, name: str) -> None:
        self._process = subprocess.Popen(
            [sys.executable, str(FOLDER / "answer.py")],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
            # Without a language model, whatever is configured here: what one says is no matter of the language.
            env={k: v for k, v in os.environ.items() if not k.startswith("CGDB_LLM")} | {"CGDB_GRAPH_ENGINE": name},
        )
        self.answers = cache(self._answers)

    def _answers(self, file: str) -> list[dict[str, Any]]:
        assert self._process.stdin is not None and self._process.stdout is not None
        self._process.stdin.write(f"{FOLDER / file}.toml\n")
        self._process.stdin.flush()
        line = self._process.stdout.readline()
        assert line, f"the program that answers the cases ended at {file}.toml with {self._process.wait()}"
        return json.loads(line)  # type: ignore[no-any-return]

    def close(self) -> None:
        """Let the process end."""
        self._process.communicate(timeout=60)


@pytest.fixture(scope="session", params=ENGINES)
def engine(request: pytest.FixtureRequest) -> Iterator[Engine]:
    # Found, not imported: the one that this process has loaded may be the other.
    if importlib.util.find_spec(request.param) is None:
        pytest.skip(f"{request.param} is not installed")
    started = Engine(request.param)
    yield started
    started.close()


@pytest.mark.parametrize(("file", "number"), CASES, ids=[f"{name}-{number + 1}" for name, number in CASES])
def test_case(engine: Engine, file: str, number: int) -> None:
    case = FILES[file]["case"][number]
    got = engine.answers(file)[number]
    problems = differences(case, got)
    if problems:
        pytest.fail(report(file, case, got, problems), pytrace=False)


@pytest.mark.parametrize("file", FILES)
def test_a_file_says_its_clause_and_what_it_expects(file: str) -> None:
    document = FILES[file]
    assert document["clause"] and set(document) <= {"clause", "about", "scene", "degrees", "case"}
    for case in document["case"]:
        assert set(case) <= KEYS and len(EXPECTATIONS & set(case)) == 1 and case["says"].endswith("."), case
    asked = Counter(
        str([case.get(name) for name in ("query", "fill", "parameters", "limits")]) for case in document["case"]
    )
    assert max(asked.values()) == 1, f"asked twice: {asked.most_common(1)[0][0]}"


def test_there_are_enough_cases() -> None:
    assert len(CASES) >= 300


# -- comparing ----------------------------------------------------------------------------------------------------


def differences(case: dict[str, Any], got: dict[str, Any]) -> list[str]:
    """What is not as the case says, in words; nothing where all is."""
    if "crash" in got:
        return [f"it crashed:\n{got['crash']}"]
    if ("error" in got) != ("error" in case):
        return ["an error was raised" if "error" in got else "no error was raised"]
    if "error" in case:
        return error_differences(case["error"], got["error"])
    if "plan" in case:
        lines = [row[0] for row in got["rows"]]
        if len(lines) != len(case["plan"]):
            return [f"the plan has {len(lines)} lines, not {len(case['plan'])}"]
        return [
            f"line {number} of the plan lacks {part!r}"
            for number, (parts, line) in enumerate(zip(case["plan"], lines, strict=True), 1)
            for part in ([parts] if isinstance(parts, str) else parts)
            if part not in line
        ]
    found = []
    rows, expected = got["rows"], case["rows"]
    if case.get("any_order"):
        rows, expected = sorted(rows, key=str), sorted(expected, key=str)
    if len(rows) != len(expected):
        found.append(f"there are {len(rows)} rows, not {len(expected)}")
    else:
        found.extend(
            f"row {i} differs" for i, (a, b) in enumerate(zip(rows, expected, strict=True), 1) if not same(a, b)
        )
    found.extend(f"{name} is {got[name]}" for name in ("columns", "fits") if name in case and case[name] != got[name])
    if "warnings" in case and len(case["warnings"]) != len(got["warnings"]):
        found.append(f"the warnings are {got['warnings']}")
    for name in ("why", "warnings"):
        found.extend(
            f"no line of {name} holds {part!r}" for part in case.get(name, ()) if not any(part in x for x in got[name])
        )
    return found


def error_differences(expected: dict[str, Any], got: dict[str, Any]) -> list[str]:
    """What differs: the stage, words of the message, the text under the caret, the hint where one is expected."""
    found = []
    if got["stage"] != expected["stage"]:
        found.append(f"the stage is {got['stage']!r}")
    for part, whole in (("words", "message"), ("hint", "hint")):
        if part in expected and expected[part] not in (got[whole] or ""):
            found.append(f"the {whole} is {got[whole]!r}")
    if not _at(expected.get("at"), got.get("at")):
        found.append(f"the caret is under {got['at']!r}" if "at" in got else "the error has no place in the text")
    if "place" in expected and expected["place"] != f"{got['line']}:{got['column']}":
        found.append(f"the place is {got['line']}:{got['column']}")
    return found


def _at(expected: str | None, got: str | None) -> bool:
    """Whether the text under the caret is the expected one; one that ends with … may go on."""
    if expected is not None and got is not None and expected.endswith("…"):
        return got.startswith(expected[:-1])
    return expected == got


def same(a: Any, b: Any) -> bool:
    """Whether two values are the same, numbers up to a tolerance."""
    if isinstance(a, list) and isinstance(b, list):
        return len(a) == len(b) and all(map(same, a, b))
    if type(a) in (int, float) and type(b) in (int, float):
        return bool(abs(a - b) <= TOLERANCE * max(1.0, abs(b)))
    return type(a) is type(b) and bool(a == b)


def report(file: str, case: dict[str, Any], got: dict[str, Any], problems: list[str]) -> str:
    """A failed case for a person: what was asked, what the rule is, what should have come and what came."""
    lines = [f"{file}.toml: {case['says']}", f"  query     {case['query']}"]
    if "parameters" in case:
        lines.append(f"  with      {case['parameters']}")
    for name in ("rows", "plan", "error"):
        if name in case:
            lines.append(f"  expected  {name}")
            lines.extend(f"    {item}" for item in (case[name] if isinstance(case[name], list) else [case[name]]))
    lines.append("  got")
    lines.extend(f"    {line}" for line in got["rendered"].splitlines()) if "rendered" in got else lines.extend(
        f"    {row}" for row in got.get("rows", ())
    )
    for name in ("why", "warnings"):
        if name in case and name in got:
            lines.extend((f"  {name}      expected {case[name]}", *(f"    {line}" for line in got[name])))
    lines = [line if len(line) <= 400 else f"{line[:200]} ... {line[-100:]}" for line in lines]
    return "\n".join([*lines, *(f"  -> {problem}" for problem in problems)])
