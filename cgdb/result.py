"""What a query gives: rows with score, fits and why; how they go to dicts, JSON, pandas and Arrow."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from cgdb.errors import MissingExtraError
from cgdb.scene import ObjectId, PropertyValue

if TYPE_CHECKING:
    from cgdb.model.llm import Usage


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class StoredNode:
    """An object or a place as the store holds it, without its vectors and points.

    label: "Object" or the place's kind. center, extent: (3,) float64 m; rotation: (3, 3); None where unknown.
    """

    scene: str
    id: ObjectId
    label: str = "Object"
    tag: str | None = None
    tags: tuple[str, ...] = ()
    caption: str | None = None
    center: NDArray[np.float64] | None = None
    extent: NDArray[np.float64] | None = None
    rotation: NDArray[np.float64] | None = None
    n_observations: int | None = None
    confidence: float | None = None
    properties: Mapping[str, PropertyValue] = field(default_factory=dict)

    def __str__(self) -> str:
        name = self.tag or self.caption
        return f"#{self.id} {name}" if name else f"#{self.id}"

    def to_dict(self) -> dict[str, Any]:
        """JSON-ready; fields that the map does not give are left out."""
        record: dict[str, Any] = {"id": self.id, "scene": self.scene, "label": self.label}
        for name in ("tag", "caption", "n_observations", "confidence"):
            if (value := getattr(self, name)) is not None:
                record[name] = value
        if self.tags:
            record["tags"] = list(self.tags)
        for name in ("center", "extent", "rotation"):
            if (array := getattr(self, name)) is not None:
                record[name] = array.tolist()
        if self.properties:
            record["properties"] = {k: list(v) if isinstance(v, tuple) else v for k, v in self.properties.items()}
        return record


@dataclass(frozen=True, slots=True, kw_only=True)
class StoredRelation:
    """A relation as the store holds it; source and target are ids."""

    scene: str
    source: ObjectId
    target: ObjectId
    label: str
    confidence: float = 1.0
    explanation: str | None = None
    origin: str = "imported"

    def __str__(self) -> str:
        return f"#{self.source} {self.label} #{self.target}"

    def to_dict(self) -> dict[str, Any]:
        """JSON-ready; an explanation that is not there is left out."""
        record: dict[str, Any] = {
            "scene": self.scene,
            "source": self.source,
            "label": self.label,
            "target": self.target,
            "confidence": self.confidence,
            "origin": self.origin,
        }
        if self.explanation is not None:
            record["explanation"] = self.explanation
        return record


@dataclass(frozen=True, slots=True, kw_only=True)
class Path:
    """The best way between two nodes along relations: its relations in order."""

    relations: tuple[StoredRelation, ...]

    def __str__(self) -> str:
        return ", ".join(map(str, self.relations))

    def __len__(self) -> int:
        return len(self.relations)

    def to_dict(self) -> dict[str, Any]:
        """JSON-ready."""
        return {"relations": [relation.to_dict() for relation in self.relations]}


Value: TypeAlias = (
    "StoredNode | StoredRelation | Path | str | int | float | bool | list[Value] | tuple[Value, ...] | None"
)


@dataclass(frozen=True, slots=True, kw_only=True)
class Reason:
    """One thing that a row was asked and how it did: the condition, its degree in [0, 1], and the evidence."""

    asked: str
    degree: float
    evidence: Mapping[str, Any] = field(default_factory=dict)

    def __str__(self) -> str:
        evidence = ", ".join(f"{name} {_short(value)}" for name, value in self.evidence.items())
        return f"{self.asked}: {self.degree:.2f}" + (f" ({evidence})" if evidence else "")

    def to_dict(self) -> dict[str, Any]:
        """JSON-ready."""
        return {"asked": self.asked, "degree": round(self.degree, 6), "evidence": dict(self.evidence)}


class Row(Sequence[Value]):
    """One answer: its values in the order of the columns, and ``score``, ``fits``, ``why``."""

    __slots__ = ("_explain", "_why", "fits", "score", "values")

    def __init__(
        self, values: tuple[Value, ...], score: float, fits: bool, explain: Callable[[], tuple[Reason, ...]]
    ) -> None:
        self.values = values
        self.score = score
        self.fits = fits
        self._explain = explain
        self._why: tuple[Reason, ...] | None = None

    @property
    def why(self) -> tuple[Reason, ...]:
        """Why the row is here: every condition with its degree. Worked out when first asked for."""
        if self._why is None:
            self._why = self._explain()
        return self._why

    def __getitem__(self, index: int) -> Value:  # type: ignore[override]
        return self.values[index]

    def __len__(self) -> int:
        return len(self.values)

    def __repr__(self) -> str:
        return f"Row({', '.join(map(str, self.values))}; score={self.score:.3f}, fits={self.fits})"


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Result:
    """The answer to a query, best rows first.

    columns: names. plan: what EXPLAIN prints. timings: seconds per stage. warnings: evidence that was left out and
    the like. query: the statement in canonical form. usage: what RERANK BY cost, None without.
    """

    columns: tuple[str, ...]
    rows: tuple[Row, ...]
    plan: str = ""
    timings: Mapping[str, float] = field(default_factory=dict)
    warnings: tuple[str, ...] = ()
    query: str = ""
    usage: Usage | None = None

    def __len__(self) -> int:
        return len(self.rows)

    def __iter__(self) -> Iterator[Row]:
        return iter(self.rows)

    def __getitem__(self, index: int) -> Row:
        return self.rows[index]

    @property
    def nothing_fits(self) -> bool:
        """True when no row fits: what is shown, if anything, is only the nearest."""
        return not any(row.fits for row in self.rows)

    def to_dicts(self, *, why: bool = False) -> list[dict[str, Any]]:
        """One JSON-ready dict per row: its columns, score and fits, and with ``why`` its reasons."""
        records = []
        for row in self.rows:
            record = {name: plain(value) for name, value in zip(self.columns, row.values, strict=True)}
            for name, value in (("score", row.score), ("fits", row.fits)):
                record.setdefault(name, value)
            if why:
                record.setdefault("why", [reason.to_dict() for reason in row.why])
            records.append(record)
        return records

    def to_pandas(self) -> Any:
        """A pandas DataFrame; nodes and relations become their ids, so that columns can be joined and grouped."""
        try:
            import pandas
        except ImportError as error:
            raise MissingExtraError("pandas is not installed", hint="pip install 'cgdb[pandas]'") from error
        return pandas.DataFrame(self._flat(), columns=self._flat_names())

    def to_arrow(self) -> Any:
        """A pyarrow Table; nodes and relations become their ids (text where a column mixes numbers and text)."""
        try:
            import pyarrow
        except ImportError as error:
            raise MissingExtraError("pyarrow is not installed", hint="pip install 'cgdb[arrow]'") from error
        flat = self._flat()
        columns = {}
        for name in self._flat_names():
            values = [record[name] for record in flat]
            kinds = {type(value) for value in values if value is not None}
            mixed = len(kinds) > 1 and not kinds <= {int, float}
            columns[name] = pyarrow.array([None if v is None else str(v) for v in values] if mixed else values)
        return pyarrow.table(columns)

    def _flat_names(self) -> list[str]:
        return list(dict.fromkeys((*self.columns, "score", "fits")))

    def _flat(self) -> list[dict[str, Any]]:
        flat = []
        for row in self.rows:
            record = {name: _cell(value) for name, value in zip(self.columns, row.values, strict=True)}
            record.setdefault("score", row.score)
            record.setdefault("fits", row.fits)
            flat.append(record)
        return flat


def plain(value: Any) -> Any:
    """A value of a row as JSON holds it."""
    if isinstance(value, (StoredNode, StoredRelation, Path)):
        return value.to_dict()
    if isinstance(value, (list, tuple)):
        return [plain(item) for item in value]
    return value


def _cell(value: Any) -> Any:
    if isinstance(value, StoredNode):
        return value.id
    if isinstance(value, (StoredRelation, Path)):
        return str(value)
    if isinstance(value, (list, tuple)):
        return [_cell(item) for item in value]
    return value


def _short(value: Any) -> str:
    if isinstance(value, float):
        return f"{value:.2f}"
    return str(value)
