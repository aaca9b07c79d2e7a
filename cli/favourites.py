"""Statements that a person keeps by name, with the parameters that they had: ``:save`` and ``:run``."""

from __future__ import annotations

import json
import os
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from cgdb.errors import UsageError, did_you_mean


@dataclass(frozen=True, slots=True, kw_only=True)
class Favourite:
    """text: the statement. parameters: values it is run with unless others are given."""

    text: str
    parameters: Mapping[str, Any] = field(default_factory=dict)


class Favourites:
    """Those in one JSON file. It is read whenever it is asked, since other shells write it too."""

    def __init__(self, path: Path) -> None:
        self.path = path

    def all(self) -> dict[str, Favourite]:
        """By name. UsageError where the file is not what ``save`` writes."""
        try:
            read = json.loads(self.path.read_text("utf-8"))
            return {
                str(name): Favourite(text=str(item["text"]), parameters=dict(item.get("parameters", {})))
                for name, item in read.items()
            }
        except FileNotFoundError:
            return {}
        except OSError as error:
            raise UsageError(f"{self.path} cannot be read: {error.strerror}") from error
        except (ValueError, TypeError, KeyError, AttributeError, RecursionError) as error:
            raise UsageError(f"{self.path} holds no favourites", hint="mend or remove the file") from error

    def get(self, name: str) -> Favourite:
        """The one of that name; UsageError with the nearest name where there is none."""
        known = self.all()
        if name not in known:
            raise UsageError(
                f"no favourite is called '{name[:60]}'",
                hint=did_you_mean(name, known)
                or ("`:run` lists them" if known else "`:save NAME` keeps the last statement"),
            )
        return known[name]

    def save(self, name: str, favourite: Favourite) -> None:
        """Keep one, in place of an earlier one of that name."""
        self._write({**self.all(), name: favourite})

    def forget(self, name: str) -> None:
        """Remove one."""
        self.get(name)
        self._write({known: item for known, item in self.all().items() if known != name})

    def _write(self, items: Mapping[str, Favourite]) -> None:
        document = {
            name: {"text": item.text, **({"parameters": dict(item.parameters)} if item.parameters else {})}
            for name, item in sorted(items.items())
        }
        # Written beside and moved into place: a crash leaves the old file.
        beside = self.path.with_name(f"{self.path.name}.{os.getpid()}")
        try:
            self.path.parent.mkdir(parents=True, exist_ok=True)
            beside.write_text(json.dumps(document, ensure_ascii=False, indent=2) + "\n", "utf-8")
            beside.replace(self.path)
        except OSError as error:
            raise UsageError(f"{self.path} cannot be written: {error.strerror}") from error
