"""What captions, relations and properties have in common: ask a model once of everything, keep its answers, write them.

Answers are kept in the store's folder as they come, so that what was interrupted goes on; what is written is one
revision per scene, once all is known.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from itertools import groupby
from typing import TYPE_CHECKING, Any, ClassVar, Generic, TypeVar

from cgdb.enrich.calls import Pace, Turn, each
from cgdb.enrich.kept import Kept
from cgdb.errors import StoreError, UsageError
from cgdb.model.llm import Meter, Model, Usage
from cgdb.model.prompts import clean

if TYPE_CHECKING:
    from cgdb.database import Database
    from cgdb.storage.ledger import SceneWriter


@dataclass(frozen=True, slots=True, kw_only=True)
class Task:
    """One thing to ask. scene: of which one; None where it is the same in all. key: of the question, see ``key_of``.

    about: what it is about, for people who read what is kept.
    """

    scene: str | None
    key: str
    about: Mapping[str, Any]


Asked = TypeVar("Asked", bound=Task)
Known = TypeVar("Known")


class Work(ABC, Generic[Asked, Known]):
    """The work on some scenes of a store: ``estimate``, then ``run``, then what ``revisions`` and ``usage`` say."""

    kind: ClassVar[str]
    """Of the revisions."""
    adds: ClassVar[str]
    """What a revision adds, for its message."""
    needs: ClassVar[str]
    """What is said where no model is configured."""

    def __init__(
        self,
        db: Database,
        model: Model | None,
        kept: Kept[Known],
        *,
        scenes: Sequence[str],
        batch: int = 1,
        pace: Pace | None = None,
    ) -> None:
        """model None: only to estimate. scenes: all where none are given. batch: tasks that one question is about."""
        self._db, self._model, self._kept, self._batch, self._pace = db, model, kept, batch, pace or Pace()
        self._scenes = list(scenes) or [info.name for info in db.scenes()]
        self._tasks: list[Asked] = []
        self.usage = Usage()
        self.revisions: dict[str, int] = {}
        self.unanswered = 0

    @abstractmethod
    def estimate(self) -> Any:
        """Calls, tokens and, where prices are configured, what they cost."""

    def run(self) -> Iterator[tuple[int, int]]:
        """Ask, yielding (tasks done, of all) after each answer; then write. ModelError where the model fails.

        What was answered until then is kept: the next run goes on from there.
        """
        if self._model is None:
            raise UsageError(
                f"{self.needs}, and none is configured",
                hint="set CGDB_LLM_BASE_URL, CGDB_LLM_MODEL and CGDB_LLM_API_KEY",
            )
        if self._db.read_only:
            raise StoreError(f"{self._db.path} cannot be written, so nothing would be kept")
        model, batches = self._model, self._batches()
        done, total = 0, sum(map(len, batches))
        for answered in each(model, map(self._loaded, batches), partial(self._ask, model), self._pace):
            self.usage = self.usage + answered.usage
            said = answered.answer or {}
            for i, task in enumerate(answered.item):
                if i in said:
                    self._kept.put(task.key, said[i], self._as_json(said[i]), {**task.about, "model": model.name})
                else:
                    self.unanswered += 1
            done += len(answered.item)
            yield done, total
        for scene in self._scenes:
            self._write(scene, model)

    @property
    def _model_name(self) -> str:
        """As it stands in the keys of questions: another model is asked anew."""
        return (self._model.settings.model or "") if self._model is not None else ""

    def _missing(self) -> list[Asked]:
        """What was not answered yet."""
        return [task for task in self._tasks if self._kept.get(task.key) is None]

    def _batches(self) -> list[list[Asked]]:
        """What was not answered yet, some tasks of one scene at a time."""
        batches = []
        for _, tasks in groupby(self._missing(), key=lambda task: task.scene):
            together = list(tasks)
            batches += [together[start : start + self._batch] for start in range(0, len(together), self._batch)]
        return batches

    def _write(self, scene: str, model: Model) -> None:
        if all(self._kept.get(task.key) is None for task in self._tasks if task.scene in (None, scene)):
            return
        message = f"{self.adds} from {clean(model.name, 100)}"
        with self._db.write(scene, kind=self.kind, on_existing="merge", message=message) as writer:
            self._add(writer, scene, model)
        if writer.revision is not None:
            self.revisions[scene] = writer.revision

    def _loaded(self, batch: Sequence[Asked]) -> Sequence[Asked]:
        """A batch whose turn is near, with what is too large to be held for all."""
        return batch

    @abstractmethod
    def _ask(self, model: Model, batch: Sequence[Asked], meter: Meter, turn: Turn) -> Mapping[int, Known]:
        """What the model says of the tasks of a batch, by position; turn comes before each question but the first."""

    @abstractmethod
    def _as_json(self, known: Known) -> Any:
        """An answer as it is kept."""

    @abstractmethod
    def _add(self, writer: SceneWriter, scene: str, model: Model) -> None:
        """Write what is known of a scene. It is read here, while nobody else can write: what others, such as a mapper
        that runs beside, have added since the tasks were made is not undone."""
