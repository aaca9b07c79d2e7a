"""cgdb: an embedded store for the 3D scene graphs that robots make.

The rooms, in the order in which data flows: scene, ingest, storage, index, meaning, view; for a statement grammar and
query; for plain words english or model, asking; database ties them together; export writes scenes out.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from cgdb.asking.answer import Answer as Answer
    from cgdb.database import Database as Database
    from cgdb.database import open as open
    from cgdb.errors import CgdbError as CgdbError
    from cgdb.meaning.meanings import Vector as Vector
    from cgdb.meaning.vocabulary import Vocabulary as Vocabulary
    from cgdb.query.limits import Limits as Limits
    from cgdb.result import Path as Path
    from cgdb.result import Reason as Reason
    from cgdb.result import Result as Result
    from cgdb.result import Row as Row
    from cgdb.result import StoredNode as StoredNode
    from cgdb.result import StoredRelation as StoredRelation
    from cgdb.scene import FeatureSpace as FeatureSpace
    from cgdb.scene import Place as Place
    from cgdb.scene import Relation as Relation
    from cgdb.scene import SceneGraph as SceneGraph
    from cgdb.scene import SceneObject as SceneObject
    from cgdb.scene import View as View

__version__ = "0.1.0"

_HOMES = {
    "Answer": "cgdb.asking.answer",
    "Vector": "cgdb.meaning.meanings",
    "Database": "cgdb.database",
    "open": "cgdb.database",
    "CgdbError": "cgdb.errors",
    "Limits": "cgdb.query.limits",
    "Path": "cgdb.result",
    "Reason": "cgdb.result",
    "Result": "cgdb.result",
    "Row": "cgdb.result",
    "StoredNode": "cgdb.result",
    "StoredRelation": "cgdb.result",
    "FeatureSpace": "cgdb.scene",
    "Place": "cgdb.scene",
    "Relation": "cgdb.scene",
    "SceneGraph": "cgdb.scene",
    "SceneObject": "cgdb.scene",
    "View": "cgdb.scene",
    "Vocabulary": "cgdb.meaning.vocabulary",
}
__all__ = [*_HOMES, "__version__"]


def __getattr__(name: str) -> Any:
    # Imported when first used (PEP 562): `import cgdb` alone takes milliseconds.
    if name in _HOMES:
        return getattr(import_module(_HOMES[name]), name)
    raise AttributeError(f"module 'cgdb' has no attribute '{name}'")


def __dir__() -> list[str]:
    return sorted({*globals(), *_HOMES})
