"""Whatever text is asked gives a result or an error of this project's, in time; and values stay values."""

from __future__ import annotations

import importlib.util
import itertools
import json
import random
import string
import sys
import time
import tomllib
from collections import Counter
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

import cgdb
from cgdb.database import Database
from cgdb.errors import BindError, CgdbError, LimitError, ParseError, StoreError
from cgdb.grammar import ast
from cgdb.grammar.machine import KEYWORDS
from cgdb.grammar.parser import parse
from cgdb.grammar.printer import to_text
from cgdb.query.limits import Limits
from cgdb.testing import store

SECONDS = 2.0
"""What any text may take of a processor, however long or strange it is."""
LIMITS = Limits(seconds=1.0, rows=200_000)
EXECUTED = 8
"""Of the many texts of the slow tests one in so many is carried out; all are parsed."""


def _strategies() -> Any:
    spec = importlib.util.spec_from_file_location("strategies", Path(__file__).with_name("strategies.py"))
    assert spec is not None and spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    sys.modules.setdefault("strategies", module)
    spec.loader.exec_module(module)
    return module


strategies = _strategies()

# -- the store ----------------------------------------------------------------------------------------------------

TAGS = ("cup", "table", "chair", "lamp", "potted plant", 'it\'s a "cup"', "größe 😀")


def scene(name: str, seed: int) -> cgdb.SceneGraph:
    rng = np.random.default_rng(seed)

    def thing(number: int) -> cgdb.SceneObject:
        properties: dict[str, Any] = {"price": float(rng.integers(1, 9)), "colour": str(rng.choice(["red", "blue"]))}
        if number % 3 == 0:
            properties |= {"clean": bool(number % 2), "uses": ("sit", "eat"), "mixed": number if number % 2 else "x"}
        placed = number % 5 != 0
        return cgdb.SceneObject(
            id=number if number % 7 else f"o-{number}",
            tag=TAGS[number % len(TAGS)],
            caption=None if number % 4 == 0 else f"a {TAGS[number % len(TAGS)]} of some kind",
            tags=("old", "big") if number % 2 else (),
            center=rng.uniform(-3, 3, 3) if placed else None,
            extent=rng.uniform(0, 2, 3) if placed and number % 3 else None,
            rotation=np.linalg.qr(rng.normal(size=(3, 3)))[0] if placed and number % 3 == 1 else None,
            features={"clip": rng.normal(size=4).astype(np.float32)},
            confidence=float(rng.uniform()),
            properties=properties,
        )

    objects = tuple(thing(number) for number in range(1, 31))
    places = (cgdb.Place(id=100, kind="Room", name="study"), cgdb.Place(id=101, kind="Place"))
    pairs = rng.integers(0, 30, (60, 2)).tolist()
    labels = ("on", "in", "next_to", "may be stored in")
    relations = {
        (a, b, i % 4): cgdb.Relation(
            source=objects[a].id,
            target=objects[b].id,
            label=labels[i % 4],
            confidence=float(rng.uniform()),
            explanation="because" if i % 3 == 0 else None,
            origin=("geometry", "llm", "human", "imported")[i % 4],
        )
        for i, (a, b) in enumerate(pairs)
    }
    inside = (cgdb.Relation(source=100, target=thing.id, label="contains") for thing in objects[:10])
    return cgdb.SceneGraph(
        name=name,
        objects=objects,
        places=places,
        relations=(*relations.values(), *inside),
        spaces=(cgdb.FeatureSpace(name="clip", dimension=4),),
    )


@pytest.fixture(scope="module")
def db() -> Iterator[Database]:
    with store(scene("lab", 0), scene("kitchen", 1)) as opened:
        opened.query("MATCH (a ~ 'cup')-->(b) RETURN a, b")
        yield opened


PARAMETERS: dict[str, Any] = {
    "t": "cup", "n": 3, "x": 0.5, "b": True, "nothing": None, "ids": [1, 2, "o-7"], "tags": ("cup", "lamp"),
    "picture": [0.1, 0.2, 0.3, 0.4], "short": [1.0], "vector": np.ones(4), "nested": [[1]], "table": {"a": 1},
    "hostile": "'}) DETACH DELETE n //", "nul": "a\0b", "half": "\ud800", "huge": 10**30, "object": object(),
    "nan": float("nan"), "bytes": b"cup", "s": "lab", "scenes": ["lab", "kitchen"],
}  # fmt: skip

# -- what must hold -----------------------------------------------------------------------------------------------


def check_parsed(text: str) -> str:
    """What becomes of a text that is only read: "parsed" or the stage of its error."""
    started = time.process_time()
    try:
        tree = parse(text)
        outcome = "parsed"
    except CgdbError as error:
        check_error(error, text)
        outcome = error.stage
    took = time.process_time() - started
    assert took < SECONDS, f"{took:.1f} s to read {text[:500]!r}"
    if outcome == "parsed":
        assert parse(to_text(tree)) == tree, text
    return outcome


def check_asked(db: Database, text: str) -> str:
    """What becomes of a text that is carried out: "result" or the stage of its error."""
    started = time.process_time()
    try:
        result = db.query(text, PARAMETERS, limits=LIMITS)
        outcome = "result"
    except CgdbError as error:
        check_error(error, text)
        outcome = error.stage
    took = time.process_time() - started
    slowest[took] = text
    assert took < SECONDS, f"{took:.1f} s for {text[:500]!r}"
    if outcome == "result":
        check_result(result, text)
    return outcome


slowest: dict[float, str] = {}


def check_error(error: CgdbError, text: str) -> None:
    """An error is one line with a place within the text, and both of its forms can be written."""
    assert error.message and "\n" not in error.message, text
    assert "Traceback" not in error.render() and "object at 0x" not in error.render(), error.render()
    json.dumps(error.to_json())
    if error.span is not None:
        assert 0 <= error.span.start <= error.span.end <= len(text), (text, error.span)


def check_result(result: cgdb.Result, text: str) -> None:
    """A result can be written, and its scores are degrees, best first unless the text says otherwise."""
    scores = [row.score for row in result]
    assert all(0.0 <= score <= 1.0 + 1e-9 for score in scores), text
    tree = parse(text)
    if tree.mode is ast.Mode.RUN and not tree.order:
        assert all(a >= b - 1e-5 for a, b in itertools.pairwise(scores)), text
    if tree.mode is ast.Mode.RUN and tree.limit is not None and isinstance(tree.limit, ast.Number):
        assert len(result) <= tree.limit.value
    json.dumps([{name: str(value) for name, value in record.items()} for record in result.to_dicts()])
    if len(result):
        assert isinstance([str(reason) for reason in result[0].why], list)


# -- texts made by the rules of the language ----------------------------------------------------------------------


class Writer:
    """Writes statements over the names of the store, and now and then over wrong ones."""

    def __init__(self, seed: object) -> None:
        self.random = random.Random(str(seed))
        self.nodes: list[str] = []
        self.edges: list[str] = []

    def one(self, *choices: str | Callable[[], str]) -> str:
        """One of several, made when it is a function."""
        choice = self.random.choice(choices)
        return choice if isinstance(choice, str) else choice()

    def maybe(self, make: Callable[[], str], chance: float = 0.5) -> str:
        """It or nothing."""
        return make() if self.random.random() < chance else ""

    def name(self, *right: str) -> str:
        """One of the names, or with some luck a wrong one."""
        if self.random.random() < 0.015:
            return self.one("$x", "wrong", "`a b`", "größe", "match", "`match`", "_", "x" * 130, "`node 1`")
        return self.one(*right)

    def statement(self) -> str:
        self.nodes, self.edges = [], []
        patterns = ", ".join(self.pattern() for _ in range(self.random.choice([1, 1, 1, 2, 2, 3])))
        total = self.random.random() < 0.2
        shown = ", ".join(self.shown(total) for _ in range(self.random.choice([1, 1, 2, 3])))
        return " ".join(
            part
            for part in (
                self.maybe(lambda: self.one("EXPLAIN", "PROFILE"), 0.1),
                self.maybe(lambda: "USE " + self.name("'lab'", "'kitchen', 'lab'", "$s", "$scenes"), 0.1),
                self.maybe(
                    lambda: "AS OF " + self.one("1", "2", "2", "2", "99", "'2001-01-01'", "'never'", "$n"), 0.03
                ),
                f"MATCH {patterns}",
                self.maybe(lambda: f"WHERE {self.condition(3)}", 0.6),
                "RETURN" + self.maybe(lambda: " DISTINCT", 0.15),
                shown,
                self.maybe(lambda: "ORDER BY " + self.value(2) + self.one("", " DESC", " ASC"), 0.2),
                self.maybe(lambda: "RERANK BY 'best' TOP 3", 0.02),
                self.maybe(lambda: "SKIP " + self.name("0", "1", "100", "$n"), 0.1),
                self.maybe(lambda: "LIMIT " + self.name("0", "1", "3", "1000", "$n"), 0.4),
            )
            if part
        )

    def pattern(self, *, new: bool = True) -> str:
        chain = self.node(new=new)
        for _ in range(self.random.choice([0, 0, 1, 1, 2]) if new else self.random.choice([1, 1, 2])):
            chain += self.edge(new=new) + self.node(new=new)
        return chain

    def node(self, *, new: bool = True) -> str:
        variable = ""
        if self.random.random() < 0.7:
            fresh = self.one(*"abcdef") if new else ""
            known = self.one(*self.nodes) if self.nodes else fresh
            variable = self.one(fresh, fresh, known) if new else known
            if new and variable not in self.edges:
                self.nodes.append(variable)
        label = self.maybe(lambda: ":" + self.name("Object", "Object", "Room", "Place"), 0.08)
        identity = self.maybe(lambda: " " + self.name("#1", "#2", "#'o-7'", "#3", "#999"), 0.1)
        properties = self.maybe(lambda: " {price: " + self.value(1, "number") + "}", 0.06)
        properties = properties or self.maybe(
            lambda: " {" + self.name("tag", "colour") + ": " + self.text() + "}", 0.06
        )
        return f"({variable}{label}{identity}{properties}{self.maybe(self.meaning, 0.3)})"

    def meaning(self) -> str:
        if self.random.random() < 0.04:
            return " ~ " + self.one("$n", "$short", "$half", "$nested", "$nul", "''", "#999")
        return " ~ " + self.one(self.text, self.text, "$t", "$picture", "#1", "#'o-7'", "$vector")

    def edge(self, *, new: bool = True) -> str:
        if self.random.random() < 0.15:
            return self.one("-->", "<--", "--")
        variable = self.one("r", "s", "p", "q") if new and self.random.random() < 0.3 else ""
        if variable:
            self.edges.append(variable)
        label = lambda: self.name("on", "in", "next_to", "near", "`may be stored in`", "under", "contains")  # noqa: E731
        labels = self.maybe(lambda: ":" + "|".join(label() for _ in range(self.random.choice([1, 1, 2]))), 0.8)
        hops = self.maybe(lambda: "*" + self.name("", "2", "1..3", "..2", "2..", "1..1", "2..4", "1..11"), 0.15)
        inner = variable + labels + hops + self.maybe(lambda: " ~ " + self.name("'stored in'", "$t", "'in'"), 0.06)
        left, right = self.random.choice([("-[", "]->"), ("<-[", "]-"), ("-[", "]-")])
        return left + inner + right

    def text(self) -> str:
        return to_text(ast.Text(value=self.one(*TAGS, "red", "something to sit on", "soda", "a\\b", "%")))

    def variable(self) -> str:
        return self.name(*(self.nodes or ["#1"]))

    def shown(self, total: bool) -> str:
        if total and self.random.random() < 0.6:
            distinct = self.maybe(lambda: "DISTINCT ", 0.2)
            return self.one(
                "count(*)",
                lambda: f"{self.one('count', 'collect')}({distinct}{self.variable()})",
                lambda: f"{self.one('min', 'max', 'avg', 'sum')}({distinct}{self.value(1, 'number')})",
                lambda: f"{self.one('count', 'collect', 'min', 'max')}({distinct}{self.value(1)})",
                lambda: f"round(avg({self.value(1, 'number')}), 2) + count(*)",
            )
        shown = self.one(self.variable, lambda: self.value(2), *self.edges)
        return shown + self.maybe(lambda: " AS " + self.name("x", "y", "z", "in"), 0.2)

    def property(self, kind: str) -> str:
        if self.edges and self.random.random() < 0.2:
            of_edges = {"number": ("confidence",), "text": ("label", "origin", "explanation")}
            return f"{self.one(*self.edges)}.{self.name(*of_edges.get(kind, ('source', 'target')))}"
        known = {
            "number": ("price", "price", "confidence", "n_observations", "x", "z"),
            "text": ("tag", "tag", "caption", "colour", "scene", "label"),
            "list": ("tags", "uses", "center"),
            "boolean": ("clean",),
            "any": ("id", "mixed"),
        }
        return f"{self.variable()}.{self.name(*known[kind])}"

    def value(self, depth: int, kind: str = "") -> str:
        """A value, mostly of the kind that is asked for (any when none is)."""
        kind = kind or self.one("number", "number", "text", "list", "boolean", "any")
        if self.random.random() < 0.03:
            return self.one(
                self.variable, "#1", "$nested", "$nan", "$huge", "$missing", "$half", "$object", "$bytes", "$table",
                "$hostile", "$nul", "$nothing", "null", lambda: self.value(depth),
            )  # fmt: skip
        if depth <= 0 or self.random.random() < 0.35:
            leaves: dict[str, tuple[str | Callable[[], str], ...]] = {
                "number": (
                    "0",
                    "1",
                    "2.5",
                    "-3",
                    "1e3",
                    "50 cm",
                    "2 m",
                    "5in",
                    "1e300",
                    "$n",
                    "$x",
                    "9223372036854775807",
                ),
                "text": (self.text, self.text, "$t", "$hostile", "$nul"),
                "list": ("[]", "[1, 'a', null]", "$ids", "$tags", "['red', 'cup']"),
                "boolean": ("true", "false", "$b"),
                "any": ("null", "$nothing"),
            }
            return self.one(lambda: self.property(kind), *leaves[kind])
        inner = depth - 1
        made: dict[str, tuple[Callable[[], str], ...]] = {
            "number": (
                lambda: f"{self.value(inner, kind)} {self.one(*'+-*/%')} {self.value(inner, kind)}",
                lambda: f"({self.value(inner, kind)} {self.one(*'+-*/%')} {self.value(inner, kind)})",
                lambda: f"-{self.property(kind)}",
                lambda: f"{self.one('abs', 'sqrt', 'round')}({self.value(inner, kind)})",
                lambda: f"round({self.value(inner, kind)}, {self.value(inner, kind)})",
                lambda: f"size({self.value(inner, self.one('list', 'text'))})",
                lambda: f"coalesce({self.value(inner, kind)}, {self.value(inner, kind)})",
                self.measure, self.measure, self.measure,
            ),
            "text": (
                lambda: f"{self.value(inner, kind)} + {self.value(inner, kind)}",
                lambda: f"{self.one('lower', 'upper', 'nope')}({self.value(inner, kind)})",
                lambda: f"coalesce({self.value(inner, kind)}, {self.value(inner, kind)})",
                lambda: f"label({self.one(self.variable, *self.edges)})",
            ),
            "list": (lambda: f"[{self.value(inner)}, {self.value(inner)}]",),
            "boolean": (lambda: f"({self.condition(inner)})",),
            "any": (lambda: f"id({self.variable()})", lambda: f"coalesce({self.value(inner)}, {self.value(inner)})"),
        }  # fmt: skip
        return self.one(*made[kind])

    def object(self) -> str:
        return self.one(self.variable, self.variable, self.variable, "#1", "#100", "#'o-7'", "#999")

    def measure(self) -> str:
        one, other = self.object(), self.object()
        return self.one(
            f"distance({one}, {other})", f"distance({one}, {other}, 'centers')", f"distance({one}, {other}, $t)",
            *(f"{name}({one})" for name in ("volume", "height", "width", "depth", "score")), "score()",
        )  # fmt: skip

    def condition(self, depth: int) -> str:
        if depth > 0 and self.random.random() < 0.45:
            inner = depth - 1
            return self.one(
                lambda: f"{self.condition(inner)} AND {self.condition(inner)}",
                lambda: f"{self.condition(inner)} OR {self.condition(inner)}",
                lambda: f"NOT {self.condition(inner)}",
                lambda: f"({self.condition(inner)})",
            )
        kind = self.one("number", "number", "text")
        return self.one(
            lambda: self.variable() + self.meaning(), lambda: self.variable() + self.meaning(),
            lambda: f"{self.property(kind)} {self.one('=', '<>', '<', '<=', '>', '>=')} {self.value(1, kind)}",
            lambda: f"{self.value(1, kind)} {self.one('=', '<>', '<', '>')} {self.value(1, kind)}",
            lambda: f"{self.variable()} {self.one('=', '<>')} {self.object()}",
            lambda: f"{self.property(self.one('text', 'any'))} IN {self.value(1, 'list')}",
            lambda: f"{self.variable()} IN [#1, #'o-7', {self.variable()}]",
            lambda: f"{self.value(1, self.one('text', 'list'))} CONTAINS {self.value(1, 'text')}",
            lambda: f"{self.value(1, 'text')} STARTS WITH {self.text()}",
            lambda: f"{self.value(1)} IS {self.one('', 'NOT ')}NULL",
            lambda: f"{self.one('inside', 'above')}({self.object()}, {self.object()})",
            lambda: f"{self.measure()} {self.one('<', '>=')} {self.value(0, 'number')}",
            lambda: self.pattern(new=False), lambda: self.pattern(new=False), lambda: self.property("boolean"),
        )  # fmt: skip


# -- texts made of other texts ------------------------------------------------------------------------------------

FOLDER = Path(__file__).with_name("conformance")
QUERIES = tuple(
    dict.fromkeys(
        case["query"]
        for path in sorted(FOLDER.glob("*.toml"))
        for case in tomllib.loads(path.read_text(encoding="utf-8"))["case"]
    )
)
SIGNS = (
    *"()[]{}<>=~:;,.|*+-/%#$\"'`\\…",
    "->",
    "<-",
    "--",
    "..",
    "<>",
    "<=",
    "\n",
    "//",
    "\t",
    " ",
    "#1",
    "$t",
    "*2",
)
STRANGE = (
    "\0",
    "\ud800",
    "\udfff",
    "\u200b",
    "\ufeff",
    "\u2028",
    "\u202e",
    "😀",
    "ß",
    "İ",
    "٣",
    "½",
    "“",
    "→",
    "\x1b[31m",
    "\r",
)


def pieces(text: str) -> list[str]:
    """The text cut into words, signs and spaces."""
    found: list[str] = []
    for character in text:
        if found and character.isalnum() and found[-1][-1].isalnum():
            found[-1] += character
        else:
            found.append(character)
    return found


def mutated(text: str, rng: random.Random) -> str:
    """The text after one to four accidents."""
    parts = pieces(text)
    for _ in range(rng.choice([1, 1, 2, 3, 4])):
        at = rng.randrange(len(parts) + 1)
        match rng.randrange(10):
            case 0:
                del parts[at : at + rng.choice([1, 1, 2, 5])]
            case 1:
                parts[at:at] = parts[at : at + rng.choice([1, 3])]
            case 2 if len(parts) > 1:
                i, j = rng.randrange(len(parts)), rng.randrange(len(parts))
                parts[i], parts[j] = parts[j], parts[i]
            case 3:
                parts.insert(at, rng.choice(SIGNS))
            case 4:
                parts.insert(at, f" {rng.choice(sorted(KEYWORDS))} ")
            case 5:
                parts.insert(at, rng.choice(STRANGE))
            case 6:
                parts.insert(at, "".join(map(chr, rng.choices(range(1, 0x3000), k=rng.choice([1, 4, 20])))))
            case 7:
                other = pieces(rng.choice(QUERIES))
                cut = rng.randrange(len(other) + 1)
                parts = parts[:at] + other[cut:]
            case 8:
                bracket, times = rng.choice(["()", "[]", "{}", "NOT ", "-", "(o)--"]), rng.choice([2, 30, 61, 3000])
                parts[at:at] = [bracket[0] * times] if len(bracket) == 2 else [bracket * times]
            case _:
                parts.insert(
                    at, rng.choice(["x", "1", "'", '"', "`", " OR o.id = 1", ", o"]) * rng.choice([1, 300, 5000])
                )
    return "".join(parts)


def scrambled(rng: random.Random) -> str:
    """Words and signs of the language in any order."""
    words = (*sorted(KEYWORDS), *SIGNS, "o", "a", "cup", "1", "0.5", "'x'", "$n", "count", "distance")
    return rng.choice(["", " "]).join(rng.choices(words, k=rng.choice([1, 5, 20, 60])))


def noise(rng: random.Random) -> str:
    """Characters in any order."""
    alphabet = rng.choice([string.printable, "()[]-<>~", string.ascii_letters + " '\"", "".join(STRANGE) + "MATCH (o)"])
    return "".join(rng.choices(alphabet, k=rng.choice([1, 10, 100, 2000])))


def texts(seed: int, count: int) -> Iterator[str]:
    """So many texts: half of them by the rules, most others nearly so."""
    rng = random.Random(seed)
    writer = Writer(seed)
    for _ in range(count):
        kind = rng.random()
        if kind < 0.45:
            yield writer.statement()
        elif kind < 0.6:
            yield mutated(writer.statement(), rng)
        elif kind < 0.92:
            yield mutated(rng.choice(QUERIES), rng)
        elif kind < 0.97:
            yield scrambled(rng)
        else:
            yield noise(rng)


# -- the tests ----------------------------------------------------------------------------------------------------


def test_texts_of_every_kind(db: Database) -> None:
    outcomes = Counter(check_asked(db, text) for text in texts(seed=0, count=1_200))
    assert outcomes["result"] > 200 and outcomes["syntax"] > 300 and outcomes["name"] > 100, outcomes


@pytest.mark.parametrize("first", range(1, 21))
@pytest.mark.slow
def test_many_texts(db: Database, first: int) -> None:
    """200,000 in all over the twenty; every one is read, one in EXECUTED carried out."""
    for number, text in enumerate(texts(seed=first, count=10_000)):
        check_parsed(text)
        if number % EXECUTED == 0:
            check_asked(db, text)


# The strategies are large, and Hypothesis warns when it describes one that it gives up.
@pytest.mark.filterwarnings("ignore::hypothesis.errors.HypothesisWarning")
@given(strategies.queries())
@settings(max_examples=200, deadline=None, suppress_health_check=list(HealthCheck))
def test_every_tree_that_can_be_written(db: Database, tree: ast.Query) -> None:
    check_asked(db, to_text(tree))


@given(st.text(max_size=300))
@settings(max_examples=200, deadline=None, suppress_health_check=list(HealthCheck))
def test_any_text(db: Database, text: str) -> None:
    check_asked(db, text)


@given(st.recursive(st.none() | st.booleans() | st.integers() | st.floats() | st.text() | st.binary(),
                    lambda inner: st.lists(inner) | st.dictionaries(st.text(), inner), max_leaves=8))  # fmt: skip
@settings(max_examples=100, deadline=None, suppress_health_check=list(HealthCheck))
def test_any_parameter(db: Database, value: Any) -> None:
    for text in PLACES:
        try:
            db.query(text, p=value, limits=LIMITS)
        except CgdbError as error:
            check_error(error, text)


PLACES = (
    "MATCH (o) WHERE o.tag = $p RETURN o",
    "MATCH (o {price: $p}) RETURN o",
    "MATCH (o) WHERE o.id IN $p OR o.caption CONTAINS $p RETURN o",
    "MATCH (o) WHERE o.mixed >= $p OR o.tag STARTS WITH $p RETURN o",
    "MATCH (o ~ $p) RETURN o",
    "MATCH (a)-[r ~ $p]->(b) RETURN a",
    "MATCH (o) RETURN $p AS value, o.price + $p",
    "MATCH (o) RETURN o ORDER BY $p SKIP $p LIMIT $p",
    "USE $p MATCH (o) RETURN o",
    "AS OF $p MATCH (o) RETURN o",
    "MATCH (o) RETURN o RERANK BY $p TOP $p",
)


# -- values stay values -------------------------------------------------------------------------------------------

HOSTILE = (
    "' OR true OR '", '" OR true OR "', "') RETURN o //", '"}) DETACH DELETE n //', "'}) DETACH DELETE n //",
    "\\", "\\'", '\\"', "\\\\'", "\\u0027 OR true", "`", "``", "`) DETACH DELETE (n", "$p0", "$tag", "${tag}", "$",
    "#1", "(o)", "*/", "/*", "//", "--", ";", "; DROP TABLE Node;",
    "'; ATTACH 'x' AS y; '", "MATCH (n) DETACH DELETE n",
    "RETURN 1 UNION MATCH (n:Node) SET n.tag = 'x' RETURN 1", "LOAD FROM '/etc/passwd' RETURN *",
    "CALL show_tables() RETURN *", "null", "NULL", "true", "[1, 2]", "{a: 1}", "%s", "%(p0)s", "{0}", " ", "x" * 5000,
    "\0", "a\0b", "\n", "\r\n", "\x1b[31m", "\u2028", "\u202e", "\ufeff", "😀", "ﬀ", "İ", "ß",
)  # fmt: skip


def hostile_scene() -> cgdb.SceneGraph:
    """Every text of the list as a tag, a caption, a value and a relation; each object has one of its own."""
    return cgdb.SceneGraph(
        name="it's a \"scene\"') DETACH DELETE n //",
        objects=tuple(
            cgdb.SceneObject(
                id=number, tag=text, caption=f"caption {text}", properties={"value": text, "list": (text,)}
            )
            for number, text in enumerate(HOSTILE)
        ),
        relations=tuple(
            cgdb.Relation(source=number, target=(number + 1) % len(HOSTILE), label=text[:256], explanation=text)
            for number, text in enumerate(HOSTILE)
        ),
    )


@pytest.fixture(scope="module")
def hostile_db() -> Iterator[Database]:
    with store(hostile_scene()) as opened:
        before = everything(opened)
        yield opened
        assert everything(opened) == before, "a statement changed the store"


def everything(db: Database) -> list[object]:
    """All that a store holds, as the ledger and the graph index tell it."""
    (info,) = db.scenes()
    graph = db.cypher("MATCH (n:Node) RETURN n.key, n.id, n.tag, n.caption, n.p_value ORDER BY n.key")
    edges = db.cypher(
        "MATCH (a:Node)-[r:Rel]->(b:Node) RETURN a.key, b.key, r.label, r.explanation ORDER BY a.key, b.key"
    )
    nodes = [(o.id, o.tag, o.caption, dict(o.properties)) for o in db.scene(info.name).objects]
    tables = [[list(column) for column in table.data] for table in (graph, edges)]
    return [nodes, db.scene(info.name).relations, [r.id for r in db.revisions()], tables]


def found(db: Database, text: str, **parameters: object) -> list[object]:
    return [row[0] for row in db.query(text, **parameters)]


def quoted(text: str) -> str:
    return to_text(ast.Text(value=text))


@pytest.mark.parametrize("number", range(len(HOSTILE)))
def test_a_parameter_is_its_value_and_nothing_else(hostile_db: Database, number: int) -> None:
    text = HOSTILE[number]
    for asked in (
        "MATCH (o) WHERE o.tag = $p RETURN o.id",
        "MATCH (o {value: $p}) RETURN o.id",
        "MATCH (o) WHERE o.tag IN [$p] RETURN o.id",
        "MATCH (o) WHERE $p IN o.list RETURN o.id",
        "MATCH (o) WHERE NOT o.tag <> $p RETURN o.id",
        "MATCH (o) WHERE o.list = [$p] RETURN o.id",
        "MATCH (o)-[r]->() WHERE r.explanation = $p RETURN o.id",
        "MATCH (o) WHERE (o)-[]->() AND o.value = $p RETURN o.id",
    ):
        assert found(hostile_db, asked, p=text) == [number], asked
    assert number in found(hostile_db, "MATCH (o) WHERE o.caption CONTAINS $p RETURN o.id", p=text)
    assert number in found(hostile_db, "MATCH (o) WHERE o.tag STARTS WITH $p RETURN o.id", p=text)
    assert found(hostile_db, "MATCH (o #0) RETURN $p AS p", p=text) == [text]
    assert len(found(hostile_db, "MATCH (o) WHERE o.tag <> $p RETURN o.id", p=text)) == len(HOSTILE) - 1


@pytest.mark.parametrize("number", range(len(HOSTILE)))
def test_a_parameter_in_any_other_place_breaks_nothing(hostile_db: Database, number: int) -> None:
    for asked in PLACES:
        try:
            hostile_db.query(asked, p=HOSTILE[number])
        except CgdbError as error:
            check_error(error, asked)


@pytest.mark.parametrize("number", [n for n, text in enumerate(HOSTILE) if "\0" not in text and len(text) <= 4096])
def test_a_text_in_quotes_is_its_value_and_nothing_else(hostile_db: Database, number: int) -> None:
    text = quoted(HOSTILE[number])
    for asked in (
        f"MATCH (o) WHERE o.tag = {text} RETURN o.id",
        f"MATCH (o {{value: {text}}}) RETURN o.id",
        f"MATCH (o) WHERE o.tag IN [{text}] RETURN o.id",
        f"MATCH (o)-[r]->() WHERE r.label = {text} AND r.explanation = {text} RETURN o.id",
    ):
        assert found(hostile_db, asked) == [number], asked
    hostile_db.query("MATCH (o ~ $p) RETURN o LIMIT 1", p=f"cup {HOSTILE[number]}")


@pytest.mark.parametrize("number", [n for n, text in enumerate(HOSTILE) if "\0" not in text and len(text) <= 256])
def test_a_name_in_backticks_is_a_name_and_nothing_else(hostile_db: Database, number: int) -> None:
    edge = ast.EdgePattern(labels=(HOSTILE[number],))
    node = ast.NodePattern(variable=HOSTILE[number])
    wanted = ast.ReturnItem(expression=ast.Property(variable=HOSTILE[number], name="id"), name=HOSTILE[number])
    tree = ast.Query(patterns=(ast.Pattern(nodes=(node, ast.NodePattern()), edges=(edge,)),), returns=(wanted,))
    result = hostile_db.query(to_text(tree))
    assert result.columns == (HOSTILE[number],)
    assert [row[0] for row in result] == [number]
    for label, name in ((HOSTILE[number], "tag"), (None, HOSTILE[number])):
        item = ast.Property(variable="o", name=name)
        pattern = ast.Pattern(nodes=(ast.NodePattern(variable="o", label=label),))
        with pytest.raises(BindError, match=r"no (label|property)"):
            hostile_db.query(to_text(ast.Query(patterns=(pattern,), returns=(ast.ReturnItem(expression=item),))))


def test_scenes_are_named_by_values_too(hostile_db: Database) -> None:
    name = hostile_scene().name
    assert found(hostile_db, f"USE {quoted(name)} MATCH (o #3) RETURN o.id") == [3]
    assert found(hostile_db, "USE $s MATCH (o #3) RETURN o.scene", s=name) == [name]
    for text in HOSTILE:
        with pytest.raises((StoreError, BindError)):
            hostile_db.query("USE $s MATCH (o) RETURN o", s=text)
        with pytest.raises(StoreError):
            hostile_db.query("AS OF $t MATCH (o) RETURN o", t=text)


@pytest.mark.parametrize("bad", ["\ud800", "a\udfff", ["x", "\ud800"], ("\udc00",)])
def test_half_a_character_is_refused(hostile_db: Database, bad: object) -> None:
    for asked in PLACES[:8]:
        with pytest.raises(CgdbError) as caught:
            hostile_db.query(asked, p=bad)
        caught.value.render().encode("utf-8")
    with pytest.raises(ParseError):
        hostile_db.query(f"MATCH (o) WHERE o.tag = '{bad[0] if len(bad) == 1 else bad[-1]}' RETURN o")  # type: ignore[index,arg-type]


# -- what is too much ---------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    "text",
    [
        "MATCH (o) RETURN o" + " " * 1_000_000,
        "MATCH (o) WHERE " + "(" * 100_000,
        "MATCH (o) WHERE " + "NOT " * 4_000 + "true RETURN o",
        "MATCH (o) RETURN " + "[" * 6_000 + "]" * 6_000,
        "MATCH (o) RETURN 1" + " + 1" * 4_000,
        "MATCH (o) RETURN " + "-" * 15_000 + "1",
        "MATCH (o) RETURN " + "abs(" * 3_000 + "1" + ")" * 3_000,
        "MATCH " + "(o)--" * 3_500 + "(o) RETURN o",
        "MATCH " + "()," * 5_000 + "() RETURN 1",
        "MATCH (o) WHERE " + "(o)--" * 3_000 + "() RETURN o",
        "MATCH (o ~ '" + "x" * 15_000 + "') RETURN o",
        "MATCH (o)-[:on*1..1000000]->(b) RETURN o",
        "MATCH (o) RETURN o LIMIT " + "9" * 15_000,
        "`" * 15_000,
        "'" * 15_000,
        "\\" * 15_000,
        "//" * 9_000,
        "((o)" * 5_000,
        "MATCH (o) WHERE o.id = 1" + " = 1" * 4_000 + " RETURN o",
    ],
    ids=lambda text: text[:24],
)
def test_too_much_is_refused_at_once(db: Database, text: str) -> None:
    started = time.process_time()
    with pytest.raises((LimitError, ParseError, BindError)) as caught:
        db.query(text)
    assert time.process_time() - started < SECONDS
    check_error(caught.value, text)
    assert len(caught.value.render()) < 2_000


@pytest.mark.parametrize(
    "text",
    [
        "MATCH (o) WHERE o.id = 1" + " OR o.id = 2" * 1_500 + " RETURN o",
        "MATCH (o) WHERE o.id = 1" + " AND o ~ 'cup'" * 1_200 + " RETURN o",
        "MATCH (o) WHERE o.id IN [1" + ", 2" * 6_000 + "] RETURN o",
        "MATCH (o) RETURN " + ", ".join(f"o.price + {n}" for n in range(1_200)),
        "MATCH (o) RETURN o ORDER BY " + ", ".join("o.price" for _ in range(1_800)),
        "MATCH (o) WHERE (o)-->()" + " OR (o)-->()" * 1_500 + " RETURN o",
        "MATCH " + ", ".join(f"(a{n} #{n})" for n in range(1, 7)) + " RETURN a1",
    ],
    ids=lambda text: text[:32],
)
def test_a_long_statement_is_carried_out_in_time(db: Database, text: str) -> None:
    check_asked(db, text)


def test_long_lists_are_parameters(db: Database) -> None:
    started = time.process_time()
    assert found(db, "USE 'lab' MATCH (o) WHERE o.id IN $ids RETURN o.id", ids=list(range(3, 30_000))) == [
        *(n for n in range(3, 31) if n % 7)
    ]
    assert time.process_time() - started < SECONDS


@pytest.mark.parametrize("seconds", [0.001, 0.05])
def test_time_is_kept(db: Database, seconds: float) -> None:
    started = time.process_time()
    with pytest.raises(LimitError, match="longer than"):
        db.query("MATCH (a)--(b)--(c)--(d), (e)--(f) RETURN a, b, c, d, e, f", limits=Limits(seconds=seconds))
    assert time.process_time() - started < SECONDS


@pytest.mark.parametrize(
    "text",
    ["MATCH (a), (b), (c) RETURN a", "MATCH (a)--(b)--(c) RETURN a", "MATCH (a)-[*1..4]-(b) RETURN a",
     "MATCH (a) WHERE (a)--()--()--() RETURN a", "MATCH (a)-->(b), (c)-->(d) RETURN a"],
)  # fmt: skip
def test_rows_are_kept(db: Database, text: str) -> None:
    with pytest.raises(LimitError, match="combinations"):
        db.query(text, limits=Limits(rows=50))
