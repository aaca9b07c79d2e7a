"""Degrees: how well the nodes and relations of a scene match what was asked, from all the evidence there is."""

from __future__ import annotations

import threading
from collections.abc import Iterator, Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from cgdb import background, scoring
from cgdb.binder import LikeMeaning, Meaning, TextMeaning, Vector, VectorMeaning
from cgdb.bindings import EdgeColumn, Positions
from cgdb.embed import Encoder
from cgdb.encoders import Encoders
from cgdb.errors import BindError, CgdbError, EncoderError
from cgdb.scene import FeatureSpace

if TYPE_CHECKING:
    from cgdb.view import SceneView

ENCODE_AT_ONCE = 1_500
"""Texts without a vector that a query encodes by itself; for more it says that they are left out."""


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

    def explain(self, meaning: Meaning, position: int) -> Mapping[str, Any]:
        """Which evidence said what of one node."""
        return self._scorer_now().explain(self.evidence(meaning), int(self._view.columns.keys[position]))

    def evidence(self, meaning: Meaning) -> scoring.Evidence:
        """The degrees of all nodes for a meaning, with what each evidence said; remembered."""
        with self._lock:
            if meaning not in self._evidence:
                if len(self._evidence) > 64:
                    self._evidence.clear()
                scorer = self._scorer_now()
                self._evidence[meaning] = scorer.degrees(self._vectors_of(meaning))
            return self._evidence[meaning]

    def relation_degrees(self, meaning: Meaning, column: EdgeColumn) -> NDArray[np.float32]:
        """(n,) float32 how well the labels and explanations of relations match a text."""
        assert isinstance(meaning, TextMeaning), "the binder lets only texts compare with relations"
        texts = [
            f"{label}\n{why}" if why else str(label)
            for label, why in zip(column.label, column.explanation, strict=True)
        ]
        distinct = list(dict.fromkeys(texts))
        degrees = dict(zip(distinct, self._relation_degrees(meaning.text, distinct), strict=True))
        return np.asarray([degrees[text] for text in texts], np.float32)

    def _relation_degrees(self, asked: str, texts: Sequence[str]) -> Sequence[float]:
        encoder = self._text_encoder()
        labels = [text.partition("\n")[0].replace("_", " ") for text in texts]
        if encoder is None:
            return scoring.phrase_degrees(asked, labels)
        everything = [*labels, *background.texts()]
        vectors = self._encoders.encode(encoder, everything)
        return scoring.phrase_degrees(
            asked,
            labels,
            query=self._encoders.question(encoder, asked),
            vectors=vectors[: len(labels)],
            background=vectors[len(labels) :],
        )

    def _vectors_of(self, meaning: Meaning) -> scoring.Meaning:
        if isinstance(meaning, TextMeaning):
            encoder = self._text_encoder()
            vector = None if encoder is None else self._encoders.question(encoder, meaning.text)
            features = {}
            for space in self._view.info.spaces:
                made = self._space_encoder(space)
                if made is not None:
                    try:
                        features[space.name] = self._encoders.question(made, meaning.text)
                    except CgdbError as error:
                        self._left_out(space.name, error)
            return scoring.Meaning(text=meaning.text, vector=vector, features=features)
        if isinstance(meaning, VectorMeaning):
            space_name = self.space_of(meaning.vector)
            return scoring.Meaning(features={space_name: meaning.vector.values.astype(np.float32)})
        return self._like(meaning)

    def _like(self, meaning: LikeMeaning) -> scoring.Meaning:
        """As an object: its features, and what its caption or tag says."""
        position = self._view.position(meaning.id)
        key = int(self._view.columns.keys[position])
        row = self._view.rows(np.asarray([position]))[position]
        text = row.caption or row.tag
        encoder = self._text_encoder()
        features = {}
        for space in self._view.info.spaces:
            index = self._view.vectors(space.name)
            at = int(np.searchsorted(index.keys, key))
            if at < len(index.keys) and int(index.keys[at]) == key:
                features[space.name] = np.asarray(index.vector(key), np.float32)
        vector = self._encoders.question(encoder, text) if encoder is not None and text else None
        return scoring.Meaning(text=text, vector=vector, features=features)

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
            matrix = None if encoder is None else self._embeddings(encoder)
            spaces = {}
            for space in self._view.info.spaces:
                index = self._view.vectors(space.name)
                made = self._space_encoder(space)
                behind = None
                if made is not None:
                    try:
                        behind = self._encoders.encode(made, background.texts())
                    except CgdbError:
                        behind = None  # a vocabulary that lacks the background: contrast with the scene itself
                spaces[space.name] = scoring.Space(keys=index.keys, cosines=index.all_similarities, background=behind)
            self._scorer = scoring.Scorer(
                self._view.texts,
                embeddings=matrix,
                background=None if encoder is None else self._encoders.encode(encoder, background.texts()),
                spaces=spaces,
            )
        return self._scorer

    def _embeddings(self, encoder: Encoder) -> NDArray[np.float32] | None:
        """(t, d) the vectors of the scene's texts, NaN rows for those not encoded yet."""
        texts = self._view.texts.texts[: self._view.texts.n_encoded]
        matrix = self._encoders.known(encoder.name, texts)
        missing = len(texts) if matrix is None else int(np.isnan(matrix[:, 0]).sum())
        if 0 < missing <= ENCODE_AT_ONCE:
            return self._encoders.encode(encoder, texts)
        if missing:
            self.warnings[
                f"{missing:,} of {len(texts):,} texts of scene '{self._view.info.name}' have no vector yet and were matched "
                "by their words alone; `cgdb encode` makes them"
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
                f"the features '{space.name}' were left out: scene '{self._view.info.name}' does not say what encoder made them"
            ] = None
        return found

    def _left_out(self, what: str, why: CgdbError) -> None:
        kind = "the meaning of captions was" if what == "captions" else f"the features '{what}' were"
        hint = f" ({why.hint})" if why.hint else ""
        self.warnings[f"{kind} left out: {why.message}{hint}"] = None
