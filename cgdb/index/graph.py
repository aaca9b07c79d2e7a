"""The graph index: one scene at one revision as an immutable file of the graph engine, for traversal by Cypher.

Node(key, id, label, tag, caption, confidence, n_observations, cx, cy, cz, ex, ey, ez, p_*) and Rel(source,
number, label, confidence, origin, explanation). Scalars only: vectors and point clouds have places of their own.
"""

from __future__ import annotations

import contextlib
import hashlib
import itertools
import math
import re
import secrets
import shutil
import tempfile
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, BinaryIO, TypeAlias

import numpy as np
from numpy.typing import NDArray

from cgdb.errors import ExecuteError, StoreError, did_you_mean
from cgdb.index.engine import Engine, Store, engine
from cgdb.index.readonly import check_read_only

if TYPE_CHECKING:
    from cgdb.storage.ledger import NodeRow, RelationRow

COLUMN_TYPES = ("DOUBLE", "BOOL", "STRING", "STRING[]")
_FIXED = {
    "key": "INT64",
    "id": "STRING",
    "label": "STRING",
    "tag": "STRING",
    "caption": "STRING",
    "confidence": "DOUBLE",
    "n_observations": "INT64",
    **dict.fromkeys(("cx", "cy", "cz", "ex", "ey", "ez"), "DOUBLE"),
}
_RELATION = {
    "from_key": "INT64",
    "to_key": "INT64",
    # The engine does not tell the direction of a relation that was matched either way; so the relation itself does. Its
    # number tells it from every other one.
    "source": "INT64",
    "number": "INT64",
    "label": "STRING",
    "confidence": "DOUBLE",
    "origin": "STRING",
    "explanation": "STRING",
}
_INTEGERS = ("INT64", "INT32", "INT16", "INT8", "UINT32", "UINT16", "UINT8")
_PLAIN = re.compile(r"[a-z_][a-z0-9_]{0,60}")
_SURROGATE = re.compile("[\ud800-\udfff]")

Column: TypeAlias = "NDArray[np.int64] | NDArray[np.float64] | NDArray[np.bool_] | list[Any]"


@dataclass(frozen=True, slots=True, kw_only=True)
class Table:
    """An answer by columns: int64, float64 (NULL is nan) or bool arrays (n,) where the type allows, else lists."""

    columns: tuple[str, ...]
    data: tuple[Column, ...]

    def __len__(self) -> int:
        return len(self.data[0]) if self.data else 0

    def __getitem__(self, name: str) -> Column:
        return self.data[self.columns.index(name)]

    def rows(self) -> Iterator[tuple[Any, ...]]:
        """The rows as tuples of plain Python values."""
        return zip(*(c.tolist() if isinstance(c, np.ndarray) else c for c in self.data), strict=True)


def property_column(name: str) -> str:
    """The column that holds the property: ``p_`` and its name, or ``px_`` and a digest of a name like "Color" or "a b".

    The engine's names ignore case and forbid some characters; properties are named by strangers.
    """
    if _PLAIN.fullmatch(name):
        return f"p_{name}"
    return "px_" + hashlib.blake2b(name.encode("utf-8", "replace"), digest_size=8).hexdigest()


class GraphIndex:
    """An open graph index. Any number of threads and processes read one file."""

    def __init__(self, store: Store) -> None:
        self._store = store

    @staticmethod
    def kind(chosen: Engine | None = None) -> str:
        """What the files of this engine and file format are called: another engine's files are other files."""
        chosen = chosen or engine()
        return f"graph-{chosen.name}-{chosen.storage}"

    @classmethod
    def open(cls, path: Path) -> GraphIndex:
        """Open a built index for reading."""
        return cls(engine().open(path, read_only=True))

    @classmethod
    def build(
        cls,
        path: Path,
        nodes: Iterator[list[NodeRow]],
        relations: Iterator[list[RelationRow]],
        columns: Mapping[str, str],
    ) -> dict[str, Any]:
        """Write a new index at ``path`` from batches of rows; ``columns`` maps each property to one of COLUMN_TYPES.

        Memory is a constant multiple of a batch. Returns the meta of the file: counts and columns.
        """
        _check_columns(columns)
        with _writing(path) as (store, folder):
            store.execute(f"CREATE NODE TABLE Node({_declared(_node_types(columns))}, PRIMARY KEY(key))")
            node_file = _CsvFile(folder / "nodes.csv", _node_types(columns))
            n_nodes = node_file.write([_node_cells(row, columns) for row in batch] for batch in nodes)
            if n_nodes:
                store.execute(f"COPY Node FROM ({node_file.loading()} RETURN {node_file.returned()})")
            relation_file = _CsvFile(folder / "relations.csv", _RELATION)
            n_relations = relation_file.write(_numbered([_relation_cells(row) for row in batch] for batch in relations))
            _create_relations(store, relation_file, n_relations)
        return {"nodes": n_nodes, "relations": n_relations, "columns": dict(columns)}

    @classmethod
    def catch_up(
        cls,
        path: Path,
        old: Path,
        *,
        columns: Mapping[str, str],
        removed: Iterable[int],
        nodes: Iterator[list[NodeRow]],
        sources: Iterable[int],
        relations: Iterator[list[RelationRow]],
    ) -> dict[str, Any]:
        """Write at ``path`` what :meth:`build` would write now, from the index at ``old`` and what has changed since.

        removed: keys of nodes that are gone, with all their relations. nodes: rows of nodes that are new or changed.
        sources: keys of every node whose outgoing relations changed; ``relations`` are all that those nodes have now,
        and nothing else. columns: as :meth:`build` would get them now; a column may be new, but not of another type.
        """
        # Relations are never deleted one by one: after DELETE and DETACH DELETE, kuzu 0.11.3 now and then still finds
        # a relation from its target that is gone from its source (1 of 25 random updates). The table is made anew.
        _check_columns(columns)
        gone = set(removed)
        replaced = gone | set(sources)
        shutil.copyfile(old, path)
        types = _node_types(columns)
        with _writing(path) as (store, folder):
            present = {row[1]: row[2] for row in store.execute("CALL table_info('Node') RETURN *")[2]}
            for name, kind in types.items():
                if present.get(name, kind) != kind:
                    raise StoreError(f"column {name} of the graph index became {kind}: it must be built again")
            kept = (
                row
                for row in store.execute(
                    "MATCH (a:Node)-[r:Rel]->(b:Node) "
                    "RETURN a.key, b.key, r.source, r.label, r.confidence, r.origin, r.explanation"
                )[2]
                if row[0] not in replaced and row[1] not in gone
            )
            added = _CsvFile(folder / "relations.csv", _RELATION)
            now = ([_relation_cells(row) for row in batch] for batch in relations)
            n_relations = added.write(_numbered(itertools.chain([[tuple(row) for row in kept]], now)))
            store.execute("DROP TABLE Rel")
            for name in types:
                if name not in present:
                    store.execute(f"ALTER TABLE Node ADD {name} {types[name]}")
            dropped = _CsvFile(folder / "dropped.csv", {"key": "INT64"})
            if dropped.write([[(key,) for key in gone]]):
                store.execute(f"{dropped.loading()} MATCH (n:Node) WHERE n.key = key DELETE n")
            changed = _CsvFile(folder / "nodes.csv", types)
            if changed.write([_node_cells(row, columns) for row in batch] for batch in nodes):
                renamed = ", ".join(f"{changed.value(name)} AS {name}_" for name in types)
                values = ", ".join(f"n.{name} = {name}_" for name in types if name != "key")
                store.execute(f"{changed.loading()} WITH {renamed} MERGE (n:Node {{key: key_}}) SET {values}")
            _create_relations(store, added, n_relations)
            n_nodes = store.execute("MATCH (n:Node) RETURN count(*)")[2][0][0]
        return {"nodes": n_nodes, "relations": n_relations, "columns": dict(columns)}

    def run(self, cypher: str, parameters: Mapping[str, Any] | None = None, *, timeout_s: float | None = None) -> Table:
        """The answer to a statement that reads, whoever wrote it; `readonly` has what it may say."""
        parameters = parameters or {}
        wanted = check_read_only(cypher)
        # One engine takes a parameter that is missing for NULL and passes over one too many.
        for name in sorted(wanted - parameters.keys()):
            raise ExecuteError(f"parameter ${name} is not given", hint=did_you_mean(name, parameters))
        for name in sorted(parameters.keys() - wanted):
            raise ExecuteError(f"the statement has no parameter ${name}", hint=did_you_mean(name, wanted))
        names, types, rows = self._store.execute(cypher, parameters, timeout_s=timeout_s)
        data = tuple(_column([row[i] for row in rows], kind) for i, kind in enumerate(types))
        return Table(columns=tuple(names), data=data)

    def interrupt(self) -> None:
        """Stop what runs now, from another thread: it raises QueryCancelled."""
        self._store.interrupt()

    def close(self) -> None:
        """Close the file; a second call does nothing."""
        self._store.close()


@contextlib.contextmanager
def _writing(path: Path) -> Iterator[tuple[Store, Path]]:
    """The database at ``path`` opened for writing, and a folder for what is loaded into it, gone afterwards."""
    # The engine reads the names of files as patterns, and has no way to quote one: such a folder is not named to it.
    beside = path.with_name(path.name + ".load")
    plain = re.fullmatch(r"[\w/:. ~\\-]+", str(beside), re.ASCII) is not None and "\\" not in str(beside)
    folder = beside if plain else Path(tempfile.mkdtemp(prefix="cgdb-load-"))
    folder.mkdir(exist_ok=True)
    try:
        store = engine().open(path, read_only=False)
        try:
            yield store, folder
            store.execute("CHECKPOINT")
        finally:
            store.close()
    finally:
        shutil.rmtree(folder, ignore_errors=True)


def _create_relations(store: Store, file: _CsvFile, count: int) -> None:
    store.execute(f"CREATE REL TABLE Rel(FROM Node TO Node, {_declared(_RELATION, skip=2)})")
    if count:
        store.execute(f"COPY Rel FROM ({file.loading()} RETURN {file.returned()})")


class _CsvFile:
    """Rows on their way into the engine, in the dialect that both engines read back exactly.

    An empty cell is NULL. An empty text is a token made up for this file, and so is what stands between the items of
    a list: neither can occur in what a map says. Lists lose their empty items. Tried with every character that could
    matter (tests/test_graph.py).
    """

    def __init__(self, path: Path, types: Mapping[str, str]) -> None:
        self.path = path
        self.types = dict(types)
        self.token = f"<{secrets.token_hex(8)}>"

    def write(self, batches: Iterable[Iterable[Iterable[Any]]]) -> int:
        """Write batches of rows; returns how many rows there were."""
        count = 0
        with self.path.open("wb") as file:
            for batch in batches:
                # By columns, and each distinct value once: three times faster than cell by cell.
                cells = [_Cells(write) for write in self._writers()]
                columns = zip(*batch, strict=True)
                written = [map(c.__getitem__, column) for c, column in zip(cells, columns, strict=False)]
                lines = [",".join(row) for row in zip(*written, strict=True)]
                count += len(lines)
                _append(file, lines)
        return count

    def _writers(self) -> list[Callable[[Any], str]]:
        token = self.token

        def text(value: Any) -> str:
            if value is None:
                return ""
            value = str(value)
            return '"' + value.replace('"', '""') + '"' if value else token

        def items(value: Any) -> str:
            if value is None:
                return ""
            # Empty items are left out: string_split forgets them, and list_transform, which could take a mark off
            # each item, overruns its memory where 2,048 rows hold more than 4,096 items (both engines).
            return text(token.join([str(item) for item in value if item != ""]))

        kinds = {"STRING": text, "STRING[]": items, "DOUBLE": _number, "INT64": _integer, "BOOL": _truth}
        return [kinds[kind] for kind in self.types.values()]

    def loading(self) -> str:
        """The clause that reads the file back; every column is then a variable of its own name."""
        read = {name: kind.removesuffix("[]") for name, kind in self.types.items()}
        options = "HEADER=false, PARALLEL=false, AUTO_DETECT=false, DELIM=',', QUOTE='\"', ESCAPE='\"'"
        return f"LOAD WITH HEADERS ({_declared(read)}) FROM '{self.path.as_posix()}' ({options})"

    def value(self, name: str) -> str:
        """The expression for a column as it was before it was written."""
        kind, token = self.types[name], self.token
        if kind == "STRING":
            return f"CASE WHEN {name} = '{token}' THEN '' ELSE {name} END"
        if kind == "STRING[]":
            split = f"string_split({name}, '{token}')"
            return f"CASE WHEN {name} = '{token}' THEN CAST([] AS STRING[]) ELSE {split} END"
        return name

    def returned(self) -> str:
        """Every column by its expression, in the order of the table."""
        return ", ".join(self.value(name) for name in self.types)


class _Cells(dict[Any, str]):
    """The text of each value of a column, written when it is first met."""

    def __init__(self, write: Callable[[Any], str]) -> None:
        super().__init__()
        self._write = write

    def __missing__(self, value: Any) -> str:
        cell = self[value] = self._write(value)
        return cell


def _append(file: BinaryIO, lines: list[str]) -> None:
    if lines:
        text = "\n".join(lines) + "\n"
        try:
            data = text.encode()
        except UnicodeEncodeError:
            # Half a character, as json.loads makes of "\ud800": no engine and no file holds it.
            data = _SURROGATE.sub("\ufffd", text).encode()
        file.write(data)


def _number(value: Any) -> str:
    if value is None or isinstance(value, (str, tuple, list)):
        return ""
    number = float(value)
    return repr(number) if math.isfinite(number) else ""


def _integer(value: Any) -> str:
    return "" if value is None else str(int(value))


def _truth(value: Any) -> str:
    return ("true" if value else "false") if isinstance(value, (bool, np.bool_)) else ""


def _node_types(columns: Mapping[str, str]) -> dict[str, str]:
    return _FIXED | {property_column(name): kind for name, kind in columns.items()}


def _declared(types: Mapping[str, str], *, skip: int = 0) -> str:
    return ", ".join(f"{name} {kind}" for name, kind in list(types.items())[skip:])


def _check_columns(columns: Mapping[str, str]) -> None:
    for name, kind in columns.items():
        if kind not in COLUMN_TYPES:
            raise ExecuteError(f"property '{name}' cannot be indexed as {kind}")


def _node_cells(row: NodeRow, columns: Mapping[str, str]) -> list[Any]:
    center = (None, None, None) if row.center is None else row.center.tolist()
    extent = (None, None, None) if row.extent is None else row.extent.tolist()
    cells = [row.key, row.id, row.label, row.tag, row.caption, row.confidence, row.n_observations, *center, *extent]
    cells += [_property(row.properties.get(name), kind) for name, kind in columns.items()]
    return cells


def _property(value: Any, kind: str) -> Any:
    if kind == "STRING[]" and value is not None and not isinstance(value, (tuple, list)):
        return (value,)
    if kind == "STRING" and isinstance(value, (tuple, list)):
        return ", ".join(str(v) for v in value)
    return value


def _numbered(batches: Iterable[Iterable[tuple[Any, ...]]]) -> Iterator[list[tuple[Any, ...]]]:
    """The cells of relations with their number after the three keys."""
    number = itertools.count()
    for batch in batches:
        yield [(*cells[:3], next(number), *cells[3:]) for cells in batch]


def _relation_cells(row: RelationRow) -> tuple[Any, ...]:
    return row.source, row.target, row.source, row.label, row.confidence, row.origin, row.explanation


def _column(values: list[Any], kind: str) -> Column:
    try:
        if kind in _INTEGERS:
            return np.array(values, dtype=np.int64)
        if kind in ("DOUBLE", "FLOAT"):
            return np.array(values, dtype=np.float64)
        if kind == "BOOL" and None not in values:
            return np.array(values, dtype=np.bool_)
    except (TypeError, ValueError):
        pass
    return values
