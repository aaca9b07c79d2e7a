"""Words beside embeddings: tokens, head nouns, and an index of which object is described by which word.

Names, brands and numbers ("Coca-Cola", "IKEA", "room 12") are what sentence embeddings blur and what people ask for.
The parse is shallow on purpose: no model, no corpus, the same result everywhere, microseconds per caption.
"""

from __future__ import annotations

import re
import unicodedata
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from enum import IntEnum
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from cgdb.meaning.lexicon import (
    ADJECTIVES,
    COMMON_WORDS,
    DEPICTIONS,
    DETERMINERS,
    FUNCTION_WORDS,
    GENERIC_HEADS,
    HEDGES,
    IRREGULAR,
    NOUNS_TOO,
    PARTITIVES,
    PRONOUNS,
    RELATION_WORDS,
    VESSELS,
)

LONGEST_TEXT = 4000
"""Characters of one text that are read. A caption is a sentence; what lies beyond is a damaged or hostile file."""

_CJK = "\u3040-\u30ff\u3400-\u4dbf\u4e00-\u9fff\uac00-\ud7af"
_TOKEN = re.compile(rf"[{_CJK}]|[^\W_{_CJK}]+(?:['’\-&.][^\W_{_CJK}]+)*|[,;:.!?()/\[\]]")
_PART = re.compile(r"[^\W_]+")


class Role(IntEnum):
    """What a word does in the text that names an object."""

    CONTEXT = 0
    MODIFIER = 1
    HEAD = 2


ROLE_WEIGHT: Mapping[Role, float] = {Role.HEAD: 1.0, Role.MODIFIER: 0.8, Role.CONTEXT: 0.3}
"""How much of a query's word is covered by an object's word in that role: a mention of a table is not a table."""

_LEAD_INS = re.compile(
    r"^\s*(?:(?:this|that|it|there|here|these|those|they)(?:\s+(?:object|item|image|thing|picture|one)s?)?"
    r"\s*(?:'s|\s+is|\s+are|\s+appears\s+to\s+be|\s+seems\s+to\s+be|\s+looks\s+like|\s+shows?|\s+depicts?)\s+"
    r"|(?:the\s+)?(?:object|item|image|picture|photo)\s+(?:is|shows?|depicts?|of)\s+)",
    re.IGNORECASE,
)
_VOWEL = re.compile(r"[aeiouy]")


@lru_cache(maxsize=65536)
def singular(word: str) -> str:
    """The word without its plural ending, in one spelling: the form under which names of things are compared."""
    if word in IRREGULAR:
        return IRREGULAR[word]
    if len(word) > 3 and word.endswith("ies"):
        word = word[:-3] + "y"
    elif len(word) > 4 and word.endswith(("sses", "shes", "ches", "xes", "zzes", "oes")):
        word = word[:-2]
    elif len(word) > 3 and word.endswith("s") and not word.endswith(("ss", "us", "is")):
        word = word[:-1]
    if len(word) > 2 and word.endswith("ie"):
        word = word[:-2] + "y"  # "cookie", as "cookies" ends there too
    return IRREGULAR.get(word, word)


@lru_cache(maxsize=65536)
def stem(word: str) -> str:
    """The form under which a word is looked up: singular, without -ed/-ing, final e dropped.

    A light stemmer in the line of Harman's S-stemmer ("How effective is suffixing?", JASIS 1991) with inflection
    added; heavier ones (Porter, Snowball) conflate too much here: "organ" and "organizer" are different objects.
    """
    word = singular(word)
    for suffix in ("ing", "ed"):
        base = word[: -len(suffix)]
        if word.endswith(suffix) and len(base) >= 3 and _VOWEL.search(base) and not word.endswith("eed"):
            if base[-1] == base[-2] and base[-1] not in "lsz":
                base = base[:-1]
            word = base
            break
    if len(word) > 3 and word.endswith("e"):
        word = word[:-1]
    return word


def informative_weight(word: str) -> float:
    """How much a word tells in English at large: 0 for "the" and "something", little for "white", 1 for "sofa".

    Three tiers stand for the word's rarity (its idf); a table of a million frequencies would say the same of the
    words that occur in captions and questions.
    """
    if word in FUNCTION_WORDS:
        return 0.0
    return 0.5 if word in COMMON_WORDS else 1.0


@dataclass(frozen=True, slots=True)
class Word:
    """One word of a text: as written (casefolded), the forms it is looked up by, what it does, what it tells.

    stems: a plain word has one; a joined one ("t-shirt") has its parts. joined: the parts written as one, or None.
    """

    text: str
    stems: tuple[str, ...]
    joined: str | None
    role: Role
    weight: float


@dataclass(frozen=True, slots=True)
class Parse:
    """A text's words with their roles, and its head phrases: what the thing is said to be ("white couch").

    generic: the head says nothing ("something to sit on"), so that every other word counts in full. contents: what a
    vessel is said to hold ("a mug of green tea").
    """

    words: tuple[Word, ...]
    heads: tuple[str, ...]
    generic: bool
    contents: tuple[str, ...] = ()


def tokens(text: str) -> list[str]:
    """The words and punctuation marks of a text, casefolded and in compatibility form (NFKC)."""
    folded = unicodedata.normalize("NFKC", text[:LONGEST_TEXT]).casefold().replace("’", "'")
    return _TOKEN.findall(folded)


def stemmed(phrase: str) -> tuple[str, ...]:
    """The words of a name without articles, singular: the form under which names of things and traits are kept."""
    return tuple(singular(t.removesuffix("'s")) for t in tokens(phrase) if t[0].isalnum() and t not in DETERMINERS)


@lru_cache(maxsize=16384)
def parse(text: str) -> Parse:
    """Find the head phrase of a caption, a tag or a question, and the role of each word in it.

    "This is a lamp and it is above the end table" names a lamp: what stands before the first word of relation is the
    head phrase, its last noun the head; the rest is context. "A pair of X", "the corner of X" name X.
    """
    found = _cans(tokens(_LEAD_INS.sub("", text[:LONGEST_TEXT])))
    roles, phrases, generic, held = _roles(found)
    words = tuple(_word(token, role) for token, role in zip(found, roles, strict=True) if role is not None)
    return Parse(words, phrases, generic, held)


def _cans(found: list[str]) -> list[str]:
    """The tokens with the tin told from the verb: "a trash can with a bag" has a noun where "it can fold" has none."""
    return [
        "cans" if token == "can" and i > 0 and found[i - 1] not in PRONOUNS and _ends_noun(found[i + 1 :]) else token
        for i, token in enumerate(found)
    ]


def _ends_noun(following: Sequence[str]) -> bool:
    return not following or not following[0][0].isalnum() or (following[0] in RELATION_WORDS or following[0] == "of")


@lru_cache(maxsize=131072)
def _word(token: str, role: Role) -> Word:
    bare = token.removesuffix("'s").removesuffix("'")
    parts = _PART.findall(bare)
    if len(parts) > 1:
        useful = [part for part in parts if part not in FUNCTION_WORDS or len(part) == 1]
        return Word(token, tuple(stem(part) for part in useful or parts), stem("".join(parts)), role, 1.0)
    return Word(token, (stem(bare),), None, role, informative_weight(bare))


def _roles(found: Sequence[str]) -> tuple[list[Role | None], tuple[str, ...], bool, tuple[str, ...]]:
    """The role of each token (None for punctuation), the head phrases, whether the head is generic, what it holds."""
    roles: list[Role | None] = [None if len(t) == 1 and not t.isalnum() else Role.CONTEXT for t in found]
    phrases: list[str] = []
    segment: list[int] = []
    generic = False
    contents = range(0)
    held = ""

    def close() -> None:
        while segment and (found[segment[-1]] in FUNCTION_WORDS or roles[segment[-1]] is None):
            segment.pop()
        useful = [i for i in segment if roles[i] is not None]
        if useful:
            # "room 12": the number after the noun belongs to the name, "light" in "ceiling light" is the noun.
            nouns = [
                i for i in useful if not found[i].isdigit() and (found[i] not in ADJECTIVES or _ends(found, useful, i))
            ]
            head = nouns[-1] if nouns else useful[-1]
            for i in useful:
                roles[i] = Role.HEAD if i == head else Role.MODIFIER
            words = [found[i] for i in useful if found[i] not in DETERMINERS]
            if words:
                phrases.append(" ".join(words))
        segment.clear()

    for i, token in enumerate(found):
        following = found[i + 1] if i + 1 < len(found) else ""
        has_noun = any(found[k] not in ADJECTIVES and found[k] not in FUNCTION_WORDS for k in segment)
        if token in GENERIC_HEADS and not has_noun:
            generic = True
            segment.clear()
            break
        if token == "of":
            if segment and all(
                found[k] in PARTITIVES or found[k] in ADJECTIVES or found[k] in FUNCTION_WORDS for k in segment
            ):
                segment.clear()
                continue
            if segment and found[segment[-1]] not in DEPICTIONS:
                contents = range(i + 1, _phrase_end(found, i + 1))
                if singular(found[segment[-1]]) in VESSELS:
                    held = " ".join(found[k] for k in contents if roles[k] is not None and found[k] not in DETERMINERS)
            break
        if token in ("or", "/"):
            if has_noun:
                close()
            continue
        if token == "and" and segment and following in PRONOUNS:
            break
        if token == "and" and has_noun and not _continues(found, i):
            if following in RELATION_WORDS or not following:
                break
            close()
            continue
        if token in (".", ";", ":", "!", "?", "(", "["):
            if has_noun:
                break
            continue
        if (
            token == ","
            and has_noun
            and (following in DETERMINERS or following in RELATION_WORDS or following in PRONOUNS)
        ):
            break
        if token == "," and has_noun:
            # "a footstool, ottoman, or coffee table" lists names; "a couch, one cushion torn" goes on to describe.
            if not _lists(found, i):
                break
            close()
            continue
        # "a light in the ceiling": before a relation, what could be an adjective was the noun.
        ended = has_noun or (token not in HEDGES and any(found[k] in NOUNS_TOO for k in segment[-1:]))
        if ended and (token in RELATION_WORDS or (token.endswith(("ing", "ed")) and following in RELATION_WORDS)):
            break
        if roles[i] is None or (token in RELATION_WORDS and not segment):
            continue
        segment.append(i)
    if not generic:
        close()
        # What a box of tea holds says as much about it as an adjective does.
        for i in contents:
            if roles[i] is not None:
                roles[i] = Role.MODIFIER
    else:
        roles = [None if r is None else Role.MODIFIER for r in roles]
    return roles, tuple(phrases), generic, (held,) if held and not generic else ()


def _ends(found: Sequence[str], useful: Sequence[int], i: int) -> bool:
    return i == useful[-1] and found[i] in NOUNS_TOO


def _phrase_end(found: Sequence[str], start: int) -> int:
    """The end of the noun phrase that begins at start."""
    for i in range(start, len(found)):
        if found[i] in RELATION_WORDS or found[i] in ("and", "of") or not found[i][0].isalnum():
            return i
    return len(found)


def _lists(found: Sequence[str], i: int) -> bool:
    """Whether the comma at i is followed by one short name and then another comma, "or" or "and"."""
    return any(found[k] in (",", "or") for k in range(i + 1, min(i + 4, len(found)))) and found[i + 1] not in (
        "one",
        ",",
    )


def _continues(found: Sequence[str], i: int) -> bool:
    """Whether the "and" at i joins two adjectives of one noun ("black and white photo")."""
    return i > 0 and found[i - 1] in ADJECTIVES and i + 1 < len(found) and found[i + 1] not in DETERMINERS


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class WordIndex:
    """Postings: for each stem the rows that it describes, and how well (weight in (0, 1]).

    n: rows. terms: sorted stems. indptr (t + 1,) int64, rows (p,) int32 ascending within a term, weights (p,) float32.
    """

    n: int
    terms: Mapping[str, int]
    indptr: NDArray[np.int64]
    rows: NDArray[np.int32]
    weights: NDArray[np.float32]

    @classmethod
    def build(
        cls,
        texts: Sequence[str],
        *,
        n: int,
        text_of: NDArray[np.int32],
        row_of: NDArray[np.int32],
        weight_of: NDArray[np.float32],
        parses: Mapping[str, Parse] | None = None,
    ) -> WordIndex:
        """Index n rows; entry k says that texts[text_of[k]] stands for row row_of[k] with weight weight_of[k].

        Each distinct text is parsed once (parses: those that the caller has already); where a word reaches a row
        several times, the best weight stays.
        """
        vocabulary: dict[str, int] = {}
        term_ids: list[int] = []
        term_weights: list[float] = []
        starts = np.zeros(len(texts) + 1, dtype=np.int64)
        known = parses or {}
        for t, text in enumerate(texts):
            parsed = known.get(text) or parse(text)
            for word in parsed.words:
                if word.weight == 0.0:
                    continue
                weight = ROLE_WEIGHT[word.role]
                for form in (*word.stems, word.joined) if word.joined else word.stems:
                    term_ids.append(vocabulary.setdefault(form, len(vocabulary)))
                    term_weights.append(weight)
            starts[t + 1] = len(term_ids)
        ids = np.asarray(term_ids, dtype=np.int64)
        strengths = np.asarray(term_weights, dtype=np.float32)
        counts = (starts[1:] - starts[:-1])[text_of]
        owner = np.repeat(np.arange(len(text_of)), counts)
        offset = np.arange(int(counts.sum())) - np.repeat(np.cumsum(counts) - counts, counts)
        flat = starts[:-1][text_of][owner] + offset
        order_of = np.argsort(np.asarray(list(vocabulary), dtype=object)) if vocabulary else np.zeros(0, np.int64)
        rank = np.empty(len(vocabulary), dtype=np.int64)
        rank[order_of] = np.arange(len(vocabulary))
        pair = rank[ids[flat]] * n + row_of[owner]
        weight = strengths[flat] * weight_of[owner]
        order = np.argsort(pair, kind="stable")
        pair, weight = pair[order], weight[order]
        first = np.flatnonzero(np.concatenate(([True], pair[1:] != pair[:-1]))) if len(pair) else np.zeros(0, np.int64)
        best = np.maximum.reduceat(weight, first) if len(pair) else weight
        pair = pair[first]
        term = pair // n if n else pair
        indptr = np.searchsorted(term, np.arange(len(vocabulary) + 1)).astype(np.int64)
        names = sorted(vocabulary)
        return cls(
            n=n,
            terms={name: i for i, name in enumerate(names)},
            indptr=indptr,
            rows=(pair % n if n else pair).astype(np.int32),
            weights=best.astype(np.float32),
        )

    def degrees(self, text: str, *, without: frozenset[str] = frozenset()) -> NDArray[np.float32]:
        """(n,) float32 in [0, 1]: the share of what the text asks for that each row's words cover.

        A row that lacks the head noun of the question cannot reach 0.5 by the words of its context. without: words
        (singular) that are judged elsewhere and left out here.
        """
        total = np.zeros(self.n, dtype=np.float32)
        asked = query_words(text, without=without)
        whole = sum(weight for _, weight in asked)
        if whole == 0.0:
            return total
        head = np.zeros(self.n, dtype=np.float32)
        named = any(word.role is Role.HEAD for word, _ in asked)
        for word, weight in asked:
            cover = self._cover(word)
            total += np.float32(weight / whole) * cover
            if word.role is Role.HEAD:
                np.maximum(head, cover, out=head)
        if named:
            total *= np.float32(0.5) + np.float32(0.5) * head
        return np.minimum(total, 1.0, out=total)

    def _cover(self, word: Word) -> NDArray[np.float32]:
        """(n,) how well each row has the word; one of several parts ("t-shirt") as well as its worst part."""
        cover = np.zeros(self.n, dtype=np.float32)
        rows, weights = self.postings(word.stems[0])
        cover[rows] = weights
        for part in word.stems[1:]:
            one = np.zeros(self.n, dtype=np.float32)
            rows, weights = self.postings(part)
            one[rows] = weights
            np.minimum(cover, one, out=cover)
        if word.joined is not None:
            rows, weights = self.postings(word.joined)
            cover[rows] = np.maximum(cover[rows], weights)
        return cover

    def postings(self, term: str) -> tuple[NDArray[np.int32], NDArray[np.float32]]:
        """Rows and weights of one stem; empty where no row has it."""
        at = self.terms.get(term)
        if at is None:
            return self.rows[:0], self.weights[:0]
        span = slice(int(self.indptr[at]), int(self.indptr[at + 1]))
        return self.rows[span], self.weights[span]

    def arrays(self) -> dict[str, NDArray[np.generic]]:
        """The index as plain arrays for one .npz file; from_arrays reads them back."""
        return {
            "word_n": np.asarray([self.n], dtype=np.int64),
            "word_terms": pack_strings(self.terms),
            "word_indptr": self.indptr,
            "word_rows": self.rows,
            "word_weights": self.weights,
        }

    @classmethod
    def from_arrays(cls, arrays: Mapping[str, NDArray[np.generic]]) -> WordIndex:
        """The index that arrays() wrote. ValueError where the arrays do not fit together."""
        terms = unpack_strings(arrays["word_terms"])
        n = int(np.asarray(arrays["word_n"], dtype=np.int64)[0])
        indptr = np.asarray(arrays["word_indptr"], dtype=np.int64)
        rows = np.asarray(arrays["word_rows"], dtype=np.int32)
        weights = np.asarray(arrays["word_weights"], dtype=np.float32)
        if len(indptr) != len(terms) + 1 or len(rows) != len(weights) or int(indptr[-1]) != len(rows):
            raise ValueError("the word index's arrays do not fit together")
        if (np.diff(indptr) < 0).any() or (len(rows) and (int(rows.min()) < 0 or int(rows.max()) >= n)):
            raise ValueError("the word index points outside its rows")
        return cls(n=n, terms={t: i for i, t in enumerate(terms)}, indptr=indptr, rows=rows, weights=weights)


def head_phrase(text: str) -> str | None:
    """What a question names, without what it says around it ("lamp"); None where that is all or nothing of it."""
    parsed = parse(text)
    if parsed.generic or not parsed.heads:
        return None
    phrase = " or ".join(parsed.heads)
    return None if len(phrase.split()) >= len([t for t in tokens(text) if t[0].isalnum()]) else phrase


QUERY_ROLE_WEIGHT: Mapping[Role, float] = {Role.HEAD: 1.0, Role.MODIFIER: 0.5, Role.CONTEXT: 0.3}


def query_words(text: str, *, without: frozenset[str] = frozenset()) -> list[tuple[Word, float]]:
    """The words of a question that carry information, each once, with their weights (not normalised)."""
    parsed = parse(text)
    best: dict[tuple[str, ...], tuple[Word, float]] = {}
    for word in parsed.words:
        weight = word.weight * QUERY_ROLE_WEIGHT[word.role]
        if singular(word.text) in without:
            continue
        if weight > 0.0 and (word.stems not in best or best[word.stems][1] < weight):
            best[word.stems] = (word, weight)
    return list(best.values())


def pack_strings(strings: Iterable[str]) -> NDArray[np.uint8]:
    """Strings as one array of UTF-8 bytes, each ended by a zero byte (no pickle, no per-string overhead)."""
    joined = "".join(s.replace("\x00", " ") + "\x00" for s in strings)
    return np.frombuffer(joined.encode("utf-8", "replace"), dtype=np.uint8)


def unpack_strings(packed: NDArray[np.generic]) -> list[str]:
    """The strings that pack_strings packed."""
    return np.asarray(packed, dtype=np.uint8).tobytes().decode("utf-8", "replace").split("\x00")[:-1]
