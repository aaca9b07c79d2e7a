"""Degrees: how well the nodes and relations of a scene match what was asked, from all the evidence there is."""

from __future__ import annotations

import contextlib
import threading
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from cgdb.errors import BindError, CgdbError, EncoderError
from cgdb.index.positions import EdgeColumn, Positions
from cgdb.meaning import background, scoring, told
from cgdb.meaning.embed import Encoder
from cgdb.meaning.encoders import Encoders
from cgdb.meaning.image_features import Space
from cgdb.meaning.knowledge import knowledge
from cgdb.meaning.meanings import LikeMeaning, Meaning, TextMeaning, Vector, VectorMeaning
from cgdb.meaning.stated import telling
from cgdb.meaning.texts import TextIndex
from cgdb.scene import FeatureSpace

if TYPE_CHECKING:
    from cgdb.view import SceneView

ENCODE_AT_ONCE = 1_500
"""Texts without a vector that a query encodes by itself; for more it says that they are left out."""


@dataclass(frozen=True, slots=True, kw_only=True)
class _Spoken:
    """A relation with the fields of a thing that has texts."""

    key: int
    tag: str
    caption: str | None
    label: str = "Object"
    tags: tuple[str, ...] = ()
    properties: Mapping[str, object] = field(default_factory=dict)


class _SomeMissingError(Exception):
    """Not all texts have a vector. found: those that have."""

    def __init__(self, found: NDArray[np.float32] | None) -> None:
        self.found = found


class Degrees:
    """The degrees of one scene. ``warnings`` says, one line each, what evidence had to be left out and why."""

    def __init__(self, view: SceneView, encoders: Encoders) -> None:
        self.warnings: dict[str, None] = {}
        self._view = view
        self._encoders = encoders
        self._evidence: dict[Meaning, scoring.Evidence] = {}
        self._scorer: scoring.Scorer | None = None
        self._lock = threading.RLock()

    def of(self, meaning: Meaning, positions: Positions) -> NDArray[np.float32]:
        """(n,) float32 the degrees to which these nodes match a meaning."""
        return self.evidence(meaning).degree[positions]

    def expect(self, meanings: Iterable[Meaning]) -> None:
        """Encode the texts of all meanings of a statement together: one run of the encoder instead of one each."""
        texts = [meaning.text for meaning in meanings if isinstance(meaning, TextMeaning)]
        encoder = self._text_encoder() if texts else None
        if encoder is not None:
            self._encoders.questions(encoder, [one for text in texts for one in scoring.texts_of(text)])

    def explain(self, meaning: Meaning, position: int) -> Mapping[str, Any]:
        """Which evidence said what of one node, and what its properties tell of what was asked."""
        evidence, scorer = self.evidence(meaning), self._scorer_now()
        why = scorer.explain(evidence, int(self._view.columns.keys[position]))
        if evidence.asks is not None and scorer.tells:
            row = self._view.rows(np.asarray([position]))[position]
            use = why.get("use")
            traits = telling(knowledge(), evidence.asks.traits)
            said = told.reasons(row.properties, traits, use if isinstance(use, str) else None)
            if said:
                why["told"] = said
        return why

    def evidence(self, meaning: Meaning) -> scoring.Evidence:
        """The degrees of all nodes for a meaning, with what each evidence said; remembered."""
        with self._lock:
            if meaning not in self._evidence:
                if len(self._evidence) > 64:
                    self._evidence.clear()
                scorer = self._scorer_now()
                self._evidence[meaning] = scorer.degrees(self._meaning(meaning))
            return self._evidence[meaning]

    def relation_degrees(self, meaning: Meaning, column: EdgeColumn) -> NDArray[np.float32]:
        """(n,) float32 how well the labels and explanations of relations match a text."""
        assert isinstance(meaning, TextMeaning), "the binder lets only texts compare with relations"
        pairs = list(zip(column.label.tolist(), column.explanation.tolist(), strict=True))
        distinct = {pair: number for number, pair in enumerate(dict.fromkeys(pairs))}
        # Relations are told as things are: the label is the name, the explanation the caption.
        index = TextIndex.build(
            _Spoken(key=number, tag=label.replace("_", " "), caption=explanation)
            for (label, explanation), number in distinct.items()
        )
        encoder = self._text_encoder()
        vectors = None if encoder is None else self._encoders.encode(encoder, index.texts[: index.n_encoded])
        scorer = scoring.Scorer(index, embeddings=vectors, background=self._background(encoder))
        degree = scorer.degrees(self._text_meaning(meaning.text, encoder)).degree
        return degree[[distinct[pair] for pair in pairs]]

    def _background(self, encoder: Encoder | None) -> NDArray[np.float32] | None:
        return None if encoder is None else self._encoders.background(encoder)

    def _text_meaning(
        self, text: str, encoder: Encoder | None, features: Mapping[str, NDArray[np.float32]] | None = None
    ) -> scoring.Meaning:
        def encode(texts: list[str]) -> NDArray[np.float32]:
            assert encoder is not None
            return self._encoders.questions(encoder, texts)

        return scoring.Meaning.of(text, None if encoder is None else encode, features=features)

    def _meaning(self, meaning: Meaning) -> scoring.Meaning:
        if isinstance(meaning, TextMeaning):
            features = {}
            for space in self._view.info.spaces:
                made = self._space_encoder(space)
                if made is not None:
                    try:
                        features[space.name] = self._encoders.question(made, meaning.text)
                    except CgdbError as error:
                        self._left_out(space.name, error)
            return self._text_meaning(meaning.text, self._text_encoder(), features)
        if isinstance(meaning, VectorMeaning):
            space_name = self.space_of(meaning.vector)
            return scoring.Meaning(features={space_name: meaning.vector.values.astype(np.float32)})
        return self._like(meaning)

    def _like(self, meaning: LikeMeaning) -> scoring.Meaning:
        """As an object: its features, and what its caption or tag says."""
        position = self._view.position(meaning.id)
        key = int(self._view.columns.keys[position])
        row = self._view.rows(np.asarray([position]))[position]
        features = {}
        for space in self._view.info.spaces:
            index = self._view.vectors(space.name)
            at = int(np.searchsorted(index.keys, key))
            if at < len(index.keys) and int(index.keys[at]) == key:
                features[space.name] = index.matrix[at]
        text = row.tag or row.caption
        if text is None:
            return scoring.Meaning(features=features)
        return self._text_meaning(text, self._text_encoder(), features)

    def space_of(self, vector: Vector) -> str:
        if vector.space is not None:
            space = self._view.space(vector.space)
            if space.dimension != len(vector.values):
                raise BindError(
                    f"the vector has {len(vector.values)} values, feature space '{space.name}' has {space.dimension}"
                )
            return space.name
        fitting = [space.name for space in self._view.info.spaces if space.dimension == len(vector.values)]
        if len(fitting) == 1:
            return fitting[0]
        there_is = ", ".join(f"{space.name} ({space.dimension})" for space in self._view.info.spaces) or "none"
        if not fitting:
            raise BindError(
                f"no feature space of scene '{self._view.info.name}' has dimension {len(vector.values)}",
                hint=f"its spaces: {there_is}",
            )
        raise BindError(
            f"several feature spaces have dimension {len(vector.values)}: {', '.join(fitting)}",
            hint="say which: cgdb.Vector(values=..., space=...)",
        )

    def _scorer_now(self) -> scoring.Scorer:
        if self._scorer is None:
            encoder = self._text_encoder()
            self._scorer = scoring.Scorer(
                self._view.texts,
                embeddings=None if encoder is None else self._embeddings(encoder),
                background=self._background(encoder),
                spaces={space.name: self._features(space) for space in self._view.info.spaces},
            )
        return self._scorer

    def _features(self, space: FeatureSpace) -> Space:
        index = self._view.vectors(space.name)
        made = self._encoders.space(space)
        behind = None
        if made is not None and not isinstance(made, CgdbError):
            with contextlib.suppress(EncoderError):  # a vocabulary may lack the background: the scene itself stands in
                behind = self._encoders.encode(made, background.names())
        return Space(keys=index.keys, vectors=index.matrix, background=behind)

    def _embeddings(self, encoder: Encoder) -> NDArray[np.float32] | None:
        """(t, d) the vectors of the scene's texts, NaN rows for those not encoded yet.

        Once all are there they become a file of their own: reading them one by one takes 3 s for 100,000.
        """

        def whole() -> NDArray[np.float32]:
            found = self._found(encoder)
            if found is None or np.isnan(found[:, 0]).any():
                raise _SomeMissingError(found)
            return found

        try:
            return self._view.matrix(f"text-vectors-{encoder.name}", whole)
        except _SomeMissingError as some:
            return some.found

    def _found(self, encoder: Encoder) -> NDArray[np.float32] | None:
        texts = self._view.texts.texts[: self._view.texts.n_encoded]
        matrix = self._encoders.known(encoder.name, texts)
        missing = len(texts) if matrix is None else int(np.isnan(matrix[:, 0]).sum())
        if 0 < missing <= ENCODE_AT_ONCE:
            return self._encoders.encode(encoder, texts)
        if missing:
            self.warnings[
                f"{missing:,} of {len(texts):,} texts of scene '{self._view.info.name}' have no vector yet and were "
                "matched by their words alone; `cgdb encode` makes them"
            ] = None
        return matrix

    def text_in_space(self, text: str, name: str) -> NDArray[np.float32]:
        """(d,) the vector of a text in a feature space. EncoderError where no encoder for it can be had."""
        space = self._view.space(name)
        found = self._encoders.space(space)
        if isinstance(found, CgdbError):
            raise found
        if found is None:
            raise EncoderError(
                f"scene '{self._view.info.name}' does not say what encoder made its features '{name}'",
                hint="search with a vector, or open the store with space_encoders={...}",
            )
        return self._encoders.question(found, text)

    def refresh(self) -> None:
        """Take in vectors of texts that were encoded since."""
        with self._lock:
            self._scorer = None
            self._evidence.clear()
            self.warnings.clear()

    def missing_texts(self, encoder: Encoder) -> Iterator[str]:
        """The texts of the scene that have no vector yet."""
        texts = self._view.texts.texts[: self._view.texts.n_encoded]
        matrix = self._encoders.known(encoder.name, texts)
        for row, text in enumerate(texts):
            if matrix is None or np.isnan(matrix[row, 0]):
                yield text

    def _text_encoder(self) -> Encoder | None:
        found = self._encoders.text()
        if isinstance(found, CgdbError):
            self._left_out("captions", found)
            return None
        return found

    def _space_encoder(self, space: FeatureSpace) -> Encoder | None:
        found = self._encoders.space(space)
        if isinstance(found, CgdbError):
            self._left_out(space.name, found)
            return None
        if found is None:
            self.warnings[
                f"the features '{space.name}' were left out: scene '{self._view.info.name}' does not say what encoder "
                f"made them (if you know: --encoder {space.name}=open_clip:MODEL:WEIGHTS, or space_encoders in Python)"
            ] = None
        return found

    def _left_out(self, what: str, why: CgdbError) -> None:
        kind = "the meaning of captions was" if what == "captions" else f"the features '{what}' were"
        hint = f" ({why.hint})" if why.hint else ""
        self.warnings[f"{kind} left out: {why.message}{hint}"] = None
