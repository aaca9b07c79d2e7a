"""The texts of a scene: which strings stand for which object, each distinct string kept once.

Ten thousand chairs with one tag have one text: it is encoded once, matched once, and spread over its objects.
"""

from __future__ import annotations

import zipfile
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from enum import IntEnum
from pathlib import Path
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from cgdb.errors import CorruptionError
from cgdb.meaning import told
from cgdb.meaning.knowledge import knowledge
from cgdb.meaning.told import Says, Statement
from cgdb.meaning.words import Parse, WordIndex, pack_strings, parse, unpack_strings

FORMAT = 6
"""Goes up whenever what build() makes of the same nodes changes; an index of another format is built anew."""


class Node(Protocol):
    """What the index reads of a node; the ledger's rows have it."""

    @property
    def key(self) -> int: ...
    @property
    def label(self) -> str: ...
    @property
    def tag(self) -> str | None: ...
    @property
    def tags(self) -> tuple[str, ...]: ...
    @property
    def caption(self) -> str | None: ...
    @property
    def properties(self) -> Mapping[str, object]: ...


class Source(IntEnum):
    """Where a text of an object comes from."""

    NAME = 0
    """The tag, or a place's name and kind: what the map calls it."""
    HEAD = 1
    """The head phrase of the caption: what the caption says it is."""
    CAPTION = 2
    """The whole caption."""
    TAGS = 3
    """The other tags that were possible; half of them name things nearby."""
    PROPERTY = 4
    """A text-valued property: a state, a brand."""
    QUALITY = 5
    """A property that says of what material or colour it is."""
    USE = 6
    """A phrase for what one can do with it."""
    PLACE = 7
    """Where such things mostly are."""
    NOTED = 8
    """A quality that a model noted."""
    NOTED_USE = 9
    """A use that a model noted."""


WORD_WEIGHT: Mapping[Source, float] = {
    Source.NAME: 1.0,
    Source.HEAD: 0.0,
    Source.CAPTION: 1.0,
    Source.TAGS: 0.35,
    Source.PROPERTY: 0.9,
    Source.QUALITY: 0.9,
    Source.USE: 0.9,
    Source.PLACE: 0.35,
    Source.NOTED: 0.5,
    Source.NOTED_USE: 0.5,
}
"""How far a source is believed when its words match. Head phrases are part of the captions, which are indexed."""

ENCODED = frozenset(Source) - {Source.TAGS, Source.PLACE}
"""Sources whose texts are worth a vector: possible tags are noise by the dozen, places a handful of words."""

_SOURCES: Mapping[tuple[Says, bool], Source] = {
    (Says.OTHER, False): Source.PROPERTY,
    (Says.OTHER, True): Source.NOTED,
    (Says.QUALITY, False): Source.QUALITY,
    (Says.QUALITY, True): Source.NOTED,
    (Says.USE, False): Source.USE,
    (Says.USE, True): Source.NOTED_USE,
    (Says.PLACE, False): Source.PLACE,
    (Says.PLACE, True): Source.PLACE,
}
"""By what a property tells of, and whether a model noted it; classes ("medium") are traits and no texts."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Facts:
    """What the texts of nodes say in terms of the table of everyday things.

    stated: (n,) uint64, bit t = its texts say that the node has trait t. told, noted: (n,) uint64, that its properties
    say so, those of the map and those of a model. thing_rows ascending, thing_ids: pairs (node row, thing that it is
    called). unknown_rows, unknown_texts: nodes called something that the table does not know.
    """

    stated: NDArray[np.uint64]
    told: NDArray[np.uint64]
    noted: NDArray[np.uint64]
    thing_rows: NDArray[np.int32]
    thing_ids: NDArray[np.int32]
    unknown_rows: NDArray[np.int32]
    unknown_texts: NDArray[np.int32]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class TextIndex:
    """All texts of one scene and the words in them.

    keys: (n,) int64 ascending, every node. texts: distinct strings, the names and head phrases (n_names) first; the
    first n_encoded of them are to be given vectors. indptr: (n + 1,) int64, text_ids: (e,) int32, sources: (e,) uint8:
    node row i has the texts ``text_ids[indptr[i]:indptr[i + 1]]`` from ``sources`` (values of Source).
    """

    keys: NDArray[np.int64]
    texts: tuple[str, ...]
    n_names: int
    n_encoded: int
    indptr: NDArray[np.int64]
    text_ids: NDArray[np.int32]
    sources: NDArray[np.uint8]
    words: WordIndex
    facts: Facts

    @classmethod
    def build(cls, nodes: Iterable[Node]) -> TextIndex:
        """Collect the texts of all nodes, in the order of their keys."""
        ordered = sorted(nodes, key=lambda node: node.key)
        parses: dict[str, Parse] = {}
        numbers: dict[str, int] = {}
        names: dict[str, None] = {}
        encoded: dict[str, None] = {}
        entries: list[int] = []
        sources: list[int] = []
        indptr = np.zeros(len(ordered) + 1, dtype=np.int64)
        masks = np.zeros((2, len(ordered)), dtype=np.uint64)
        for row, node in enumerate(ordered):
            said = tuple(told.statements(node.properties))
            if said:
                masks[:, row] = told.masks(said)
            for source, text in dict.fromkeys(texts_of(node, parses, said)):
                if source in (Source.NAME, Source.HEAD):
                    names.setdefault(text)
                elif source in ENCODED:
                    encoded.setdefault(text)
                entries.append(numbers.setdefault(text, len(numbers)))
                sources.append(source)
            indptr[row + 1] = len(entries)
        encoded = names | encoded
        texts = (*encoded, *(text for text in numbers if text not in encoded))
        place = np.zeros(len(texts), dtype=np.int32)
        for new, text in enumerate(texts):
            place[numbers[text]] = new
        text_ids = place[np.asarray(entries, dtype=np.int64)].astype(np.int32)
        source_of = np.asarray(sources, dtype=np.uint8)
        return cls(
            keys=np.asarray([node.key for node in ordered], dtype=np.int64),
            texts=texts,
            n_names=len(names),
            n_encoded=len(encoded),
            indptr=indptr,
            text_ids=text_ids,
            sources=source_of,
            words=_word_index(texts, indptr, text_ids, source_of, parses),
            facts=_facts(texts, indptr, text_ids, source_of, masks),
        )

    def rows_of_entries(self) -> NDArray[np.int32]:
        """(e,) int32: the node row of each entry of text_ids."""
        return np.repeat(np.arange(len(self.keys), dtype=np.int32), np.diff(self.indptr))

    def texts_of_row(self, row: int) -> list[tuple[Source, str]]:
        """The texts of one node row, with their sources."""
        span = slice(int(self.indptr[row]), int(self.indptr[row + 1]))
        found = zip(self.sources[span].tolist(), self.text_ids[span].tolist(), strict=True)
        return [(Source(source), self.texts[text]) for source, text in found]

    def save(self, path: Path) -> None:
        """Write the index to one .npz file without pickles."""
        arrays: dict[str, NDArray[Any]] = {
            "format": np.asarray([FORMAT], dtype=np.int64),
            "keys": self.keys,
            "texts": pack_strings(self.texts),
            "n_encoded": np.asarray([self.n_names, self.n_encoded], dtype=np.int64),
            "indptr": self.indptr,
            "text_ids": self.text_ids,
            "sources": self.sources,
            **self.words.arrays(),
            "knowledge": pack_strings([knowledge().version]),
            "stated": self.facts.stated,
            "told": self.facts.told,
            "noted": self.facts.noted,
            "thing_rows": self.facts.thing_rows,
            "thing_ids": self.facts.thing_ids,
            "unknown_rows": self.facts.unknown_rows,
            "unknown_texts": self.facts.unknown_texts,
        }
        with path.open("wb") as file:
            np.savez(file, allow_pickle=False, **arrays)

    @classmethod
    def open(cls, path: Path) -> TextIndex:
        """Read the file that save() wrote. CorruptionError where it is none, is cut short, or is of another format."""
        try:
            with path.open("rb") as file, np.load(file, allow_pickle=False) as arrays:
                if int(arrays["format"][0]) != FORMAT:
                    raise ValueError(f"it is of format {int(arrays['format'][0])}, expected {FORMAT}")
                if unpack_strings(arrays["knowledge"]) != [knowledge().version]:
                    raise ValueError("it was made with another table of everyday things")
                index = cls(
                    keys=arrays["keys"].astype(np.int64),
                    texts=tuple(unpack_strings(arrays["texts"])),
                    n_names=int(arrays["n_encoded"][0]),
                    n_encoded=int(arrays["n_encoded"][1]),
                    indptr=arrays["indptr"].astype(np.int64),
                    text_ids=arrays["text_ids"].astype(np.int32),
                    sources=arrays["sources"].astype(np.uint8),
                    words=WordIndex.from_arrays(arrays),
                    facts=Facts(
                        stated=arrays["stated"].astype(np.uint64),
                        told=arrays["told"].astype(np.uint64),
                        noted=arrays["noted"].astype(np.uint64),
                        thing_rows=arrays["thing_rows"].astype(np.int32),
                        thing_ids=arrays["thing_ids"].astype(np.int32),
                        unknown_rows=arrays["unknown_rows"].astype(np.int32),
                        unknown_texts=arrays["unknown_texts"].astype(np.int32),
                    ),
                )
            index._check()
        except FileNotFoundError:
            raise
        except (OSError, ValueError, KeyError, IndexError, EOFError, zipfile.BadZipFile) as error:
            raise CorruptionError(
                f"the text index {path.name} cannot be read: {error}", hint="delete the file; it is rebuilt"
            ) from error
        return index

    def _check(self) -> None:
        n, entries = len(self.keys), len(self.text_ids)
        if (np.diff(self.keys) <= 0).any():
            raise ValueError("keys are not ascending")
        if len(self.indptr) != n + 1 or int(self.indptr[0]) != 0 or int(self.indptr[-1]) != entries:
            raise ValueError("row pointers do not fit the entries")
        if (np.diff(self.indptr) < 0).any() or len(self.sources) != entries or self.words.n != n:
            raise ValueError("arrays do not fit together")
        facts, things = self.facts, len(knowledge().names)
        if {len(facts.stated), len(facts.told), len(facts.noted)} != {n}:
            raise ValueError("what is told of the nodes does not fit them")
        if len(facts.thing_rows) != len(facts.thing_ids):
            raise ValueError("what is known of the nodes does not fit them")
        if len(facts.unknown_rows) != len(facts.unknown_texts):
            raise ValueError("what is unknown of the nodes does not fit them")
        for ids, limit in (
            (facts.thing_rows, n),
            (facts.unknown_rows, n),
            (facts.thing_ids, things),
            (facts.unknown_texts, self.n_encoded),
        ):
            if len(ids) and (int(ids.min()) < 0 or int(ids.max()) >= limit):
                raise ValueError("what is known of the nodes points outside them")
        if not 0 <= self.n_names <= self.n_encoded <= len(self.texts):
            raise ValueError("more texts to encode than there are")
        if entries and (int(self.text_ids.min()) < 0 or int(self.text_ids.max()) >= len(self.texts)):
            raise ValueError("an entry points outside the texts")
        if entries and int(self.sources.max()) > max(Source):
            raise ValueError("an entry has an unknown source")


def texts_of(
    node: Node, parses: dict[str, Parse] | None = None, said: Sequence[Statement] | None = None
) -> list[tuple[Source, str]]:
    """The strings that stand for a node, best first; empty ones are left out.

    parses: captions that were parsed. said: what its properties tell, where that was read already.
    """
    found: list[tuple[Source, str]] = []

    def add(source: Source, value: object) -> None:
        if isinstance(value, str):
            text = " ".join(value.split())
            if text:
                found.append((source, text))

    add(Source.NAME, None if node.tag is None else knowledge().readable(node.tag))
    if node.label and node.label != "Object":
        add(Source.NAME, node.label)
    if node.caption:
        caption = " ".join(node.caption.split())
        memory = {} if parses is None else parses
        if caption not in memory:
            memory[caption] = parse(caption)
        for phrase in (*memory[caption].heads, *memory[caption].contents):
            add(Source.HEAD, phrase)
        add(Source.CAPTION, caption)
    for tag in node.tags:
        if tag != node.tag:
            add(Source.TAGS, tag)
    for one in told.statements(node.properties) if said is None else said:
        if one.says is not Says.CLASS:
            add(_SOURCES[one.says, one.noted], one.text)
    return found


def _word_index(
    texts: tuple[str, ...],
    indptr: NDArray[np.int64],
    text_ids: NDArray[np.int32],
    sources: NDArray[np.uint8],
    parses: Mapping[str, Parse],
) -> WordIndex:
    weight_by_source = np.asarray([WORD_WEIGHT[source] for source in Source], dtype=np.float32)
    weights = weight_by_source[sources]
    rows = np.repeat(np.arange(len(indptr) - 1, dtype=np.int32), np.diff(indptr))
    used = weights > 0
    return WordIndex.build(
        texts, n=len(indptr) - 1, text_of=text_ids[used], row_of=rows[used], weight_of=weights[used], parses=parses
    )


def _facts(
    texts: tuple[str, ...],
    indptr: NDArray[np.int64],
    text_ids: NDArray[np.int32],
    sources: NDArray[np.uint8],
    by_property: NDArray[np.uint64],
) -> Facts:
    """Look every name and head phrase up once and spread what was found over the nodes.

    by_property: (2, n) the traits that properties tell, of the map and of a model.
    """
    known = knowledge()
    called = np.isin(sources, (Source.NAME, Source.HEAD))
    telling = called | (sources == Source.PROPERTY)
    masks = np.zeros(len(texts), dtype=np.uint64)
    counts = np.zeros(len(texts), dtype=np.int64)
    found: list[int] = []
    starts = np.zeros(len(texts), dtype=np.int64)
    for t in np.unique(text_ids[telling]).tolist():
        masks[t] = known.stated(texts[t])
    for t in np.unique(text_ids[called]).tolist():
        things = (*known.things_named(texts[t]), *known.contents_named(texts[t]))
        starts[t], counts[t] = len(found), len(things)
        found.extend(things)
    rows = np.repeat(np.arange(len(indptr) - 1, dtype=np.int32), np.diff(indptr))
    stated = np.zeros(len(indptr) - 1, dtype=np.uint64)
    np.bitwise_or.at(stated, rows[telling], masks[text_ids[telling]])
    rows, named = rows[called], text_ids[called]
    count = counts[named]
    offset = np.arange(int(count.sum())) - np.repeat(np.cumsum(count) - count, count)
    things_of = np.asarray(found, dtype=np.int32)[np.repeat(starts[named], count) + offset]
    pairs = np.unique(np.stack([np.repeat(rows, count), things_of], axis=1), axis=0) if len(things_of) else None
    unknown = count == 0
    return Facts(
        stated=stated,
        told=by_property[0],
        noted=by_property[1],
        thing_rows=pairs[:, 0].astype(np.int32) if pairs is not None else np.zeros(0, np.int32),
        thing_ids=pairs[:, 1].astype(np.int32) if pairs is not None else np.zeros(0, np.int32),
        unknown_rows=rows[unknown],
        unknown_texts=named[unknown],
    )
