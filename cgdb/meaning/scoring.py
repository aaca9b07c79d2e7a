"""What ``o ~ "text"`` means as a number: a degree in [0, 1] per object, 0.5 being the line between fits and not.

No raw cosine is compared with a constant. Each evidence is a **contrast with a background**: by how many standard
deviations the question is nearer to this object's text (or image feature) than to the names of some five hundred
everyday things (`background`), in the same space. A question that is near to everything gains nothing by it, and
the same line holds for encoders whose cosines live in different ranges.

Sources: score normalisation by an impostor cohort is the Z-norm of speaker verification (Auckenthaler, Carey and
Lloyd-Thomas 2000, "Score normalization for text-independent speaker verification systems"), here with the question as
the model and the everyday things as its impostors; comparing with canonical background phrases is LERF's relevancy
(Kerr et al. 2023, "LERF: Language embedded radiance fields"); that raw neighbour scores are unfair to some questions is
the hubness that CSLS corrects (Conneau et al. 2018, "Word translation without parallel data"). The log-odds of the
evidences are averaged with weights, a logarithmic opinion pool (Genest and Zidek 1986, "Combining probability
distributions"), which leaves out what is missing without moving the line.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from cgdb.meaning.calibration import Calibration
from cgdb.meaning.contrast import contrast, log_odds, normalised, probability, unit
from cgdb.meaning.facets import Facets
from cgdb.meaning.grading import Grades
from cgdb.meaning.image_features import Images, Space
from cgdb.meaning.knowledge import Knowledge, knowledge
from cgdb.meaning.row_lists import Lists
from cgdb.meaning.situations import told
from cgdb.meaning.stated import Stated, trait_degrees
from cgdb.meaning.texts import Source, TextIndex
from cgdb.meaning.told_uses import ToldUses, believed
from cgdb.meaning.traits import MOSTLY, UNKNOWN
from cgdb.meaning.uses import Matches
from cgdb.meaning.words import head_phrase, query_words

Floats = NDArray[np.float32]
Rows = NDArray[np.int64]

NEAR_ENOUGH = 0.55
"""Cosine from which a name that the table lacks ("voice assitant") is taken for the nearest thing that it has."""

DOUBT = 0.1
"""Weight of the even chance in every pool: little evidence moves the degree little."""

WORDS_LINE = 0.5
"""Share of a question's words that a use must have to serve it, where there are no vectors."""

_GROUPS: Mapping[str, tuple[Source, ...]] = {
    "name": (Source.NAME, Source.HEAD),
    "caption": (Source.CAPTION, Source.PROPERTY, Source.QUALITY, Source.USE),
}
"""The evidences that sentence embeddings give, and the sources of the texts behind them."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Meaning:
    """What is looked for: a text, its vector in the caption encoder's space, its vectors in the image spaces.

    text may be None (a picture, another object). head is the vector of the text's head phrase alone, which names are
    compared with ("a lamp above the end table" asks for a lamp); None: the whole text's stands in. told (t, d): those
    of the pieces of a situation that the text tells of. vectors need not be normalised; (d,), features {space: (d,)}.
    """

    text: str | None = None
    vector: Floats | None = None
    head: Floats | None = None
    told: Floats | None = None
    features: Mapping[str, Floats] = field(default_factory=dict)

    @classmethod
    def of(
        cls, text: str, encode: Callable[[list[str]], Floats] | None, *, features: Mapping[str, Floats] | None = None
    ) -> Meaning:
        """The meaning of a text; encode (one call, few texts) makes the vectors, or None where there is none."""
        if len(text.split()) == 1:
            text = knowledge().readable(text)  # a name copied from a map
        if encode is None:
            return cls(text=text, features=features or {})
        texts = texts_of(text)
        vectors = encode(list(texts))
        if told(text):
            return cls(text=text, vector=vectors[0], head=vectors[0], told=vectors[1:], features=features or {})
        return cls(text=text, vector=vectors[0], head=vectors[-1], features=features or {})


def texts_of(text: str) -> tuple[str, ...]:
    """The texts whose vectors the meaning of a text takes: itself, with the pieces that it tells or its head phrase."""
    pieces = told(text)
    phrase = None if pieces else head_phrase(text)
    return (text, *pieces) if phrase is None else (text, phrase)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Evidence:
    """keys (n,) int64; degree (n,) float32, all evidence together; parts: {evidence: (n,) float32, NaN = has none}.

    asks: what the text was understood to ask; None where the meaning has no text. uses: (2v,) how well the uses that
    the scene tells serve it; None where that is not asked.
    """

    keys: NDArray[np.int64]
    degree: Floats
    parts: Mapping[str, Floats]
    meaning: Meaning
    asks: Facets | None
    uses: Floats | None = None

    def of(self, key: int) -> float:
        """The degree of one object; 0 for a key that is not among the keys."""
        row = int(np.searchsorted(self.keys, key))
        return float(self.degree[row]) if row < len(self.keys) and int(self.keys[row]) == key else 0.0


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class _View:
    """The rows that a question is asked of: all of the scene, or the few that a plan has left.

    stated: the traits that the map states of each row; told: (n,) whether it has any text. uses: those that the map
    tells, where it does.
    """

    rows: Rows | None
    keys: NDArray[np.int64]
    texts: Mapping[str, Lists]
    things: Lists
    stated: Stated
    told: NDArray[np.bool_]
    uses: Lists | None


class Scorer:
    """Degrees of meanings over one scene; built once per scene, then matrix-vector products per question."""

    def __init__(
        self,
        index: TextIndex,
        *,
        embeddings: Floats | None = None,
        background: Floats | None = None,
        spaces: Mapping[str, Space] | None = None,
        calibration: Calibration | None = None,
    ) -> None:
        """embeddings: (index.n_encoded, d) normalised rows for index.texts, NaN rows where not yet encoded.

        background: (m, d) normalised vectors of background.texts() by the same encoder. Without embeddings, words and
        common knowledge answer alone; without background, the scene's own texts stand in and uses are unknown.
        """
        self.index = index
        self.keys = index.keys
        self._known: Knowledge = knowledge()
        self._calibration = calibration or Calibration()
        self._embeddings = embeddings
        self._background = background
        self._grades = None if background is None else Grades(self._known, background[: len(self._known.names)])
        self._images = {name: Images.of(space, index.keys) for name, space in (spaces or {}).items()}
        n, rows = len(index.keys), index.rows_of_entries()
        texts = {}
        for name, sources in _GROUPS.items():
            chosen = np.isin(index.sources, sources)
            texts[name] = Lists.of(n, rows[chosen], index.text_ids[chosen])
        captions = texts["caption"].ids
        self._shared = np.unique(captions[captions < index.n_names])
        self._uses = ToldUses.of(index)
        self._all = _View(
            rows=None,
            keys=index.keys,
            texts=texts,
            things=self._things(),
            stated=Stated.of(index.facts.stated, index.facts.told, index.facts.noted),
            told=np.diff(index.indptr) > 0,
            uses=None if self._uses is None else self._uses.lists,
        )

    @property
    def tells(self) -> bool:
        """Whether properties of the scene tell of traits or uses."""
        return self._uses is not None or not self._all.stated.plain

    def degrees(self, meaning: Meaning, keys: NDArray[np.int64] | None = None) -> Evidence:
        """The degree of every object, or of those of ``keys`` (ascending; unknown ones are left out)."""
        view = self._all if keys is None else self._narrowed(keys)
        parts: dict[str, Floats] = {}
        asks = None if meaning.text is None else self._known.facets(meaning.text)
        background: Floats | None = None
        if meaning.vector is not None and self._embeddings is not None:
            query = unit(meaning.vector)
            background = None if self._background is None else self._background @ query
            parts["caption"] = self._text_part(view, "caption", query, background)
            head = query if meaning.head is None else unit(meaning.head)
            names = None if self._background is None else self._background[: self._known.n_lines] @ head
            parts["name"] = self._text_part(view, "name", head, names)
        uses: Floats | None = None
        if asks is not None:
            serves: tuple[Floats, float] | None = None
            if asks.rest is not None and (background is not None or asks.form == "use"):
                serves = self._use_degrees(asks, background, self._told_backgrounds(meaning, background))
                if self._uses is not None and view.uses is not None and asks.form == "use":
                    uses = self._told_uses(self._uses, asks, meaning, background, serves[1])
                    parts["told"] = self._told_part(self._uses, view, uses, serves[0])
            parts["known"] = self._known_part(view, asks, None if serves is None else serves[0], parts.get("told"))
            parts["words"] = self._words_part(view, meaning.text or "", asks)
        for name, vector in meaning.features.items():
            if name in self._images:
                parts[f"image:{name}"] = self._calibrated(
                    "image", self._images[name].deviations(unit(vector), view.rows)
                )
        degree = self._fused(view, parts, meaning, asks)
        return Evidence(keys=view.keys, degree=degree, parts=parts, meaning=meaning, asks=asks, uses=uses)

    def explain(self, evidence: Evidence, key: int) -> dict[str, object]:
        """Which evidence said what of one object, and by which text: for the few rows that are shown."""
        row = int(np.searchsorted(evidence.keys, key))
        if row >= len(evidence.keys) or int(evidence.keys[row]) != key:
            return {"degree": 0.0, "evidence": {}}
        said = {name: round(float(part[row]), 3) for name, part in evidence.parts.items() if np.isfinite(part[row])}
        why: dict[str, object] = {"degree": round(float(evidence.degree[row]), 3), "evidence": said}
        place = int(np.searchsorted(self.keys, key))
        if evidence.meaning.vector is not None and self._embeddings is not None:
            query = unit(evidence.meaning.vector)
            for name, lists in self._all.texts.items():
                ids = lists.of_row(place)
                cosines = self._embeddings[ids] @ query
                if np.isfinite(cosines).any():
                    why[name] = self.index.texts[int(ids[int(np.nanargmax(cosines))])]
        if evidence.asks is not None:
            things = self._all.things.of_row(place)
            why["known_as"] = [self._known.names[i % len(self._known.names)] for i in things.tolist()]
            why["asked"] = self._known.describe(evidence.asks)
        if evidence.uses is not None and self._uses is not None:
            numbers = self._uses.lists.of_row(place)
            if len(numbers) and float(evidence.uses[numbers].max()) >= 0.5:
                best = int(numbers[int(evidence.uses[numbers].argmax())])
                why["use"] = self.index.texts[int(self._uses.ids[best % len(self._uses.ids)])]
        return why

    def _things(self) -> Lists:
        """The things of the table that each row is called; for names that it lacks the nearest, numbered behind all."""
        facts = self.index.facts
        rows, things = facts.thing_rows, facts.thing_ids
        if self._embeddings is not None and self._background is not None and len(facts.unknown_rows):
            texts, where = np.unique(facts.unknown_texts, return_inverse=True)
            cosines: Floats = (
                np.nan_to_num(self._embeddings[texts], nan=0.0) @ self._background[: len(self._known.names)].T
            )
            nearest = cosines.argmax(axis=1)
            chosen = (cosines[np.arange(len(texts)), nearest] >= NEAR_ENOUGH)[where]
            rows = np.concatenate([rows, facts.unknown_rows[chosen]])
            guessed = nearest[where][chosen] + len(self._known.names)
            things = np.concatenate([things, guessed.astype(np.int32)])
        return Lists.of(len(self.keys), rows, things)

    def _of_things(self, view: _View, of_thing: Floats) -> Floats:
        """(n,) the best of each row's things; what is only guessed to be one of the table is less surely so."""
        doubted = probability(np.float32(self._calibration.guess) * log_odds(of_thing))
        return view.things.best(np.concatenate([of_thing, doubted]))

    def _narrowed(self, keys: NDArray[np.int64]) -> _View:
        place = np.minimum(np.searchsorted(self.keys, keys), max(len(self.keys) - 1, 0))
        rows = place[self.keys[place] == keys] if len(self.keys) else np.zeros(0, np.int64)
        return _View(
            rows=rows,
            keys=self.keys[rows],
            texts={name: lists.only(rows) for name, lists in self._all.texts.items()},
            things=self._all.things.only(rows),
            stated=self._all.stated.only(rows),
            told=self._all.told[rows],
            uses=None if self._all.uses is None else self._all.uses.only(rows),
        )

    def _text_part(self, view: _View, name: str, query: Floats, background: Floats | None) -> Floats:
        """The evidence of names or captions: the best of a row's texts, against the background."""
        assert self._embeddings is not None
        lists = view.texts[name]
        cosines = np.full(len(self._embeddings), np.nan, dtype=np.float32)
        if view.rows is None:
            # Names come first among the texts: a slice of the matrix, not a copy. A caption that is also a name is
            # among them.
            first = self.index.n_names
            block = slice(0, first) if name == "name" else slice(first, len(cosines))
            with np.errstate(invalid="ignore"):
                np.matmul(self._embeddings[block], query, out=cosines[block])
                if name != "name" and len(self._shared):
                    cosines[self._shared] = self._embeddings[self._shared] @ query
        else:
            ids = np.unique(lists.ids)
            with np.errstate(invalid="ignore"):
                cosines[ids] = self._embeddings[ids] @ query
        against = cosines[np.isfinite(cosines)] if background is None else background[: self._known.n_lines]
        return self._calibrated(name, lists.best(contrast(cosines, against)))

    def _words_part(self, view: _View, text: str, asks: Facets) -> Floats:
        """(n,) the share of the question's words that a row has; of its particulars only, where its kind is known.

        "A striped throw pillow" is no less a cushion for being called one; NaN where there are no particulars, and
        where traits are all that is asked: "something light" is no ceiling light.
        """
        if asks.form == "traits" or not query_words(text, without=asks.named):
            return np.full(len(view.keys), np.nan, dtype=np.float32)
        words = self.index.words.degrees(text, without=asks.named)
        return np.where(view.told, words if view.rows is None else words[view.rows], np.float32(np.nan))

    def _known_part(self, view: _View, asks: Facets, serves: Floats | None, told: Floats | None) -> Floats:
        """(n,) what common knowledge says: kind, traits and use asked for, multiplied; NaN where it says nothing.

        serves: (m,) how well each thing serves the use that is asked for. told: (n,) what the map says of that; it
        knows its things better than what is usual for their kind.
        """
        known = self._known
        part = np.full(len(view.keys), np.nan, dtype=np.float32)
        of_thing: Floats = np.ones(len(known.names), dtype=np.float32)
        if asks.kinds:
            of_thing = of_thing * known.kind_degrees(asks.kinds)
            called = self._of_things(view, of_thing)
            # "A red can of cola" is a can by its name; that it is cola is said in its text.
            said = self.index.words.degrees(" ".join(sorted(asks.named))) >= 0.5
            said = said if view.rows is None else said[view.rows]
            spoken = np.where(said & (called >= UNKNOWN), np.fmax(called, MOSTLY), called)
        if serves is not None:
            part = self._of_things(view, of_thing * serves)
            if told is not None:
                part = np.fmax(part, told)
        elif asks.kinds:
            part = np.asarray(spoken, dtype=np.float32)
        for trait in asks.traits:
            usual = self._of_things(view, self._usual(trait))
            degree = trait_degrees(known, trait, view.stated, usual)
            # What nobody tells is left out where it is all that is asked, and is even chance beside a kind or a use.
            untold = np.where(np.isfinite(degree), degree, np.float32(0.5))
            part = np.where(np.isfinite(part), part * untold, degree)
        return part

    def _usual(self, trait: int) -> Floats:
        """(m,) the degree to which each thing usually has a trait, told apart within the classes of the table."""
        degree: Floats = self._known.has[:, trait]
        if self._grades is None:
            return degree
        return probability(log_odds(degree) + np.float32(self._calibration.grade) * self._grades.lean(trait))

    def _told_backgrounds(self, meaning: Meaning, background: Floats | None) -> Floats:
        """(t, m) the cosines of the background with each piece of what is told, or with the question itself."""
        if background is None or self._background is None or meaning.told is None or not len(meaning.told):
            return np.zeros((0, 0), np.float32) if background is None else background[None]
        return np.asarray(normalised(meaning.told) @ self._background.T, dtype=np.float32)

    def _use_degrees(self, asks: Facets, background: Floats | None, told: Floats) -> tuple[Floats, float]:
        """(m,) the degree to which each thing serves what is asked, by its most fitting use or by its name; the line.

        Without vectors, by the share of the question's words that the use has. What serves it much less than the best
        thing there is does not serve it: one can wipe a rug, but one sweeps with a broom.
        """
        known, calibration, doing = self._known, self._calibration, asks.doing
        match = None if doing is None else known.use_matches(doing)
        if background is None:
            has = np.zeros(len(known.uses), np.float32) if match is None else match.cover * match.agreement
            share = known.best_use(np.asarray(has, dtype=np.float32))
            line = max(WORDS_LINE, self._calibration.rival * float(share.max(initial=0.0)))
            return _by_words(share, line), line
        first, last = len(known.names), len(known.names) + len(known.uses)
        names, uses = background[:first], background[first:last]
        if match is None and asks.told:
            z = np.max([contrast(one, one) for one in told[:, first:last]], axis=0)
            best = self._pooled(known.best_use(np.asarray(z), calibration.inherited), self._situations(told))
            use = self._against_best("use", best)
            return use, self._line("use", best)
        if match is None:
            topic = self._against_best("topic", contrast(names, names[: known.n_lines]))
            nearest = known.best_use(contrast(uses, uses))
            use = self._against_best("use", nearest)
            return topic if asks.form == "name" else np.maximum(topic, use), self._line("use", nearest)
        z = np.max([contrast(one, one) for one in told[:, first:last]], axis=0) if asks.told else contrast(uses, uses)
        z = self._deviations(z, match, calibration.cover_told if asks.told else calibration.cover)
        beside = np.maximum(known.best_use(match.circumstance), np.float32(0.0))
        best = np.asarray(
            known.best_use(z, calibration.inherited) + np.float32(calibration.beside) * beside, np.float32
        )
        if asks.told:
            best = self._pooled(best, self._situations(told))
        else:
            # What is said in the words of a use is understood by them.
            said = calibration.cover * max(2.0 * float(match.cover.max(initial=0.0)) - 1.0, 0.0)
            best = np.asarray(np.maximum(best, self._situations(told) - np.float32(said)), dtype=np.float32)
        return self._against_best("use", best), self._line("use", best)

    def _pooled(self, uses: Floats, situations: Floats) -> Floats:
        """(m,) the surer of what the uses and the situations of each thing say, and a share of what the other says."""
        less = np.maximum(np.minimum(uses, situations), np.float32(0.0))
        return np.asarray(np.maximum(uses, situations) + np.float32(self._calibration.other) * less, dtype=np.float32)

    def _situations(self, told: Floats) -> Floats:
        """(m,) the deviations of the situation in which each thing helps that is nearest to what is told."""
        last = len(self._known.names) + len(self._known.uses)
        z = np.max([contrast(one, one) for one in told[:, last:]], axis=0)
        return self._known.best_situation(np.asarray(z)) - np.float32(self._calibration.situation)

    def _told_uses(
        self, told: ToldUses, asks: Facets, meaning: Meaning, background: Floats | None, line: float
    ) -> Floats:
        """(2v,) the degree to which each use that the scene tells serves what is asked.

        line: that of common knowledge; what it knows to serve best is not outdone by a phrase that comes near.
        """
        match = told.matches(self._known, asks)
        if match is None:
            return believed(told.naming(asks.rest or ""))
        share = np.asarray(match.cover * match.agreement, dtype=np.float32)
        degree = _by_words(share, line if background is None else WORDS_LINE)
        if background is not None and meaning.vector is not None and self._embeddings is not None:
            first = len(self._known.names)
            uses = background[first : first + len(self._known.uses)]
            z = contrast(self._embeddings[told.ids] @ unit(meaning.vector), uses)
            z = self._deviations(z, match, self._calibration.cover)
            # What has no vector yet is told by its words.
            degree = np.where(np.isfinite(z), self._calibrated("use", np.nan_to_num(z), line), degree)
        return believed(np.where(told.are_uses, degree, np.float32(0.0)))

    def _told_part(self, told: ToldUses, view: _View, uses: Floats, serves: Floats) -> Floats:
        """(n,) the best that the scene tells of each row's uses.

        "Drink" does not say whether one drinks it or from it: of a bare verb, what is usual for the thing has half a
        say.
        """
        assert view.uses is not None
        bare = np.tile(told.are_bare, 2)
        best = view.uses.best(np.where(bare, np.float32(0.0), uses))
        if not bare.any():
            return best
        verb, usual = view.uses.best(np.where(bare, uses, np.float32(0.0))), self._of_things(view, serves)
        halved = probability((log_odds(verb) + log_odds(usual)) / np.float32(2.0))
        return np.fmax(best, np.where(np.isfinite(usual), halved, verb))

    def _deviations(self, z: Floats, match: Matches, cover: float) -> Floats:
        """(u,) the deviations of uses, by what of the question they cover and what part the thing plays in them."""
        calibration = self._calibration
        z = z + np.float32(cover) * match.cover
        z -= np.float32(calibration.part) * (1 - match.agreement) + np.float32(calibration.verb) * match.other_verb
        z -= np.float32(calibration.adds) * match.adds
        return z

    def _line(self, name: str, z: Floats) -> float:
        """The line of deviations, no lower than a share of the best of all things."""
        return max(self._calibration.line[name], self._calibration.rival * float(z.max()))

    def _against_best(self, name: str, z: Floats) -> Floats:
        """Calibrated, with the line no lower than a share of the best of all things."""
        return self._calibrated(name, z, self._line(name, z))

    def _calibrated(self, name: str, z: Floats, line: float | None = None) -> Floats:
        line = self._calibration.line[name] if line is None else line
        slope = self._calibration.slope[name]
        steep = np.clip(np.float32(slope) * (z - np.float32(line)), -30.0, 30.0)
        return np.asarray(1.0 / (1.0 + np.exp(-steep)), dtype=np.float32)

    def _fused(self, view: _View, parts: Mapping[str, Floats], meaning: Meaning, asks: Facets | None) -> Floats:
        """Pool the evidences' log-odds, leaving out what is missing; add what the words say."""
        n = len(view.keys)
        if meaning.text is not None and not meaning.features and not query_words(meaning.text):
            return np.ones(n, dtype=np.float32)  # "something" asks nothing, and everything is that
        form = "kind" if asks is None else asks.form
        # What is told of names many things that are not what helps.
        sort = form if asks is None or not asks.told else "told"
        total, mass = np.zeros(n, dtype=np.float32), np.zeros(n, dtype=np.float32)
        for name, part in parts.items():
            weight = self._calibration.weight[sort].get(name.partition(":")[0], 0.0)
            if name == "caption" and "told" in parts:
                part = np.asarray(
                    np.fmax(part, parts["told"]), dtype=np.float32
                )  # a caption is silent on most of what its thing is for
            if weight:
                has = np.isfinite(part)
                total += np.float32(weight) * log_odds(np.where(has, part, 0.5))
                mass += np.float32(weight) * has
        pooled = total / (mass + np.float32(DOUBT))
        words = parts.get("words")
        spoken = np.zeros(n, dtype=bool) if words is None else np.isfinite(words)
        if words is not None and spoken.any():
            # Half of the particulars is what one may expect of a short caption. With nothing else to go by, the share
            # of the words is the degree.
            weight, expected = self._calibration.words[form], 0.5 if form == "kind" else 0.0
            told = pooled + np.float32(weight) * (words - np.float32(expected))
            told = np.where(mass > 0, told, np.float32(8.0) * (words - np.float32(0.5)))
            pooled = np.where(spoken, told, pooled)
        if asks is not None and asks.arguments:
            is_argument = np.asarray(self._known.is_a[:, list(asks.arguments)].any(axis=1), dtype=np.float32)
            mentioned = np.nan_to_num(view.things.best(np.tile(is_argument, 2)), nan=0.0)
            pooled = pooled - np.float32(self._calibration.argument) * mentioned
        degree = 1.0 / (1.0 + np.exp(-pooled))
        # Of a thing that has texts, but none that tells, one may doubt; what has no evidence at all does not fit.
        silent = np.where(view.told, np.float32(UNKNOWN), np.float32(0.0))
        return np.where((mass > 0) | spoken, degree, silent).astype(np.float32)


def _by_words(share: Floats, line: float) -> Floats:
    """The degree to which a share of the question's words serves it."""
    return np.asarray(1.0 / (1.0 + np.exp(np.clip(-8.0 * (share - line), -30.0, 30.0))), dtype=np.float32)
