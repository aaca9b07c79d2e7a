"""Answer: what a question in plain words gives: the statement that was run, its rows, the reason, and what it cost."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Any

from cgdb.model.llm import Usage
from cgdb.result import Result, Row, StoredNode
from cgdb.scene import ObjectId


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Fact:
    """A value that answers a question: what ("count", "distance", "height", "color", "on"), of which objects, in which
    scene where it is one scene's. unit: "m", "m³", or empty.
    """

    what: str
    value: float | int | str | bool
    unit: str = ""
    objects: tuple[StoredNode, ...] = ()
    scene: str | None = None

    def to_dict(self) -> dict[str, Any]:
        """JSON-ready; its objects by scene, id and tag."""
        record: dict[str, Any] = {"what": self.what, "value": self.value, "unit": self.unit}
        if self.scene is not None:
            record["scene"] = self.scene
        record["objects"] = [{"scene": node.scene, "id": node.id, "tag": node.tag} for node in self.objects]
        return record


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Answer:
    """query: the CGQL that was run. understood: how the question was read, one line each.

    assumed: what the question did not say and was taken to mean; ignored: what of it the statement leaves out, and why.
    facts: what was measured or counted.

    result: the rows, those that fit first. achievable: whether anything fits. explanation: why, or why nothing does.
    how: what wrote the statement: "grammar", "schema" or "text" (a model, held to CGQL so), or "built-in".
    inferred_query: what the model that read the candidates took the question for. model: its name, None without.
    reranker: who put the rows in order, where somebody did.
    """

    question: str
    query: str
    understood: tuple[str, ...]
    result: Result
    achievable: bool
    explanation: str
    how: str
    facts: tuple[Fact, ...] = ()
    assumed: tuple[str, ...] = ()
    ignored: tuple[str, ...] = ()
    usage: Usage = field(default_factory=Usage)
    warnings: tuple[str, ...] = ()
    inferred_query: str = ""
    relevant: tuple[ObjectId, ...] = ()
    model: str | None = None
    reranked: bool = False
    reranker: str | None = None

    def __str__(self) -> str:
        return self.explanation

    def __len__(self) -> int:
        return len(self.result.rows)

    def __iter__(self) -> Iterator[Row]:
        return iter(self.result.rows)

    @property
    def rows(self) -> tuple[Row, ...]:
        """All rows, those that fit first."""
        return self.result.rows

    @property
    def objects(self) -> tuple[StoredNode, ...]:
        """The objects that answer the question, best first: of each row that fits the first, of a total all."""
        return tuple(node for row in self.rows if row.fits for node in answering(row))

    @property
    def ids(self) -> tuple[ObjectId, ...]:
        """Their ids, each once."""
        return tuple(dict.fromkeys(node.id for node in self.objects))

    def to_dict(self, *, why: bool = False) -> dict[str, Any]:
        """JSON-ready, with the fields of the ConceptGraphs planner."""
        return {
            "question": self.question,
            "inferred_query": self.inferred_query or "; ".join(self.understood) or self.question,
            "relevant_objects": list(self.relevant),
            "query_achievable": self.achievable,
            "final_relevant_objects": list(self.ids),
            "explanation": self.explanation,
            "query": self.query,
            "understood": list(self.understood),
            "assumed": list(self.assumed),
            "ignored": list(self.ignored),
            "facts": [fact.to_dict() for fact in self.facts],
            "how": self.how,
            "model": self.model,
            "reranked": self.reranked,
            "reranker": self.reranker,
            "rows": self.result.to_dicts(why=why),
            "usage": self.usage.to_dict(),
            "warnings": list(self.warnings),
        }


def answering(row: Row) -> tuple[StoredNode, ...]:
    """The object that a row is about; of a row without one, those that it collected."""
    first = first_node(row)
    if first is not None:
        return (first,)
    lists = (value for value in row if isinstance(value, (list, tuple)))
    return tuple(item for value in lists for item in value if isinstance(item, StoredNode))


def first_node(row: Row) -> StoredNode | None:
    """The object that a row is about."""
    return next((value for value in row if isinstance(value, StoredNode)), None)
