"""Draft: a statement that was run for a question, before it is answered in words."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

from cgdb.grammar import ast
from cgdb.result import Result

if TYPE_CHECKING:
    from cgdb.english.translate import Translation


@dataclass(frozen=True, slots=True, kw_only=True)
class Draft:
    """A statement that was run. nearest: it gave no rows, and those that are there are the nearest things.

    limit: the statement's own, where more rows were asked for so that a re-ranker can choose among them. made: the
    translation, where the built-in translator wrote it.
    """

    tree: ast.Query
    result: Result
    how: str
    understood: tuple[str, ...] = ()
    wanted: str = ""
    nearest: bool = False
    limit: int | None = None
    made: Translation | None = None

    def cut(self) -> Draft:
        """The draft with no more rows than its statement asks for."""
        if self.limit is None:
            return self
        return replace(self, result=replace(self.result, rows=self.result.rows[: self.limit]), limit=None)
