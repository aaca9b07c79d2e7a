"""The best that a language model can do with what it is shown: R@1 of a stand-in that knows the judges' grades.

Needs CGDB_TEST_DATA. Each judged question takes the whole way of `db.ask` with a model, but for the model: a stand-in
answers with a statement, and among the candidates that it is shown then it picks the ones that the judges picked. What
it misses no model can find, for it was not among the candidates. Statements are those of a person who knows the
language (benchmarks/queries/handwritten_cgql.json); those of somebody who had read nothing but our prompt
(prompted_cgql.json); and the same made worse in the ways that models make them:

- strict: one more condition, which nothing meets;
- sloppy: the question as it is, ORDER BY score, LIMIT 1, and texts in place of the object;
- wrong: lamps, whatever was asked.

"first" is R@1 of the statement's own order. Tokens are what the two prompts come to, by 4 bytes for a token.
"""

from __future__ import annotations

import argparse
import json
import os
import sys
from collections.abc import Callable, Mapping
from functools import cache
from pathlib import Path
from statistics import median
from typing import Any

from benchmarks.report import folder_of_stores, table
from benchmarks.translate import store
from cgdb.asking.answer import answering
from cgdb.database import Database
from cgdb.evaluation.judged import JudgedQuery, judgements
from cgdb.model.abilities import Abilities
from cgdb.model.llm import Model, Response, estimated_tokens
from cgdb.model.llm_settings import Settings

QUERIES = Path(__file__).parent / "queries"
Writer = Callable[[JudgedQuery, str], str]


def _quoted(text: str) -> str:
    return json.dumps(text, ensure_ascii=False)


def _strict(query: JudgedQuery, by_hand: str) -> str:
    head, _, rest = by_hand.rpartition(" RETURN ")
    if " WHERE " in head:
        before, _, condition = head.partition(" WHERE ")
        return f'{before} WHERE ({condition}) AND o.tag = "no thing has this tag" RETURN {rest}'
    return f'{head} WHERE o.tag = "no thing has this tag" RETURN {rest}'


def _prompted(query: JudgedQuery, by_hand: str) -> str:
    return str(_as_prompted()[query.query])


@cache
def _as_prompted() -> Mapping[str, str]:
    found: dict[str, str] = json.loads((QUERIES / "prompted_cgql.json").read_text("utf-8"))
    return found


WRITERS: Mapping[str, Writer] = {
    "by hand": lambda query, by_hand: by_hand,
    "as prompted": _prompted,
    "strict": _strict,
    "sloppy": lambda query, by_hand: (
        f"MATCH (o ~ {_quoted(query.query)}) RETURN o.tag, o.caption ORDER BY score(o) DESC LIMIT 1"
    ),
    "wrong": lambda query, by_hand: 'MATCH (o ~ "lamp") RETURN o',
}


class StandIn:
    """A transport to a model that knows the grades. prompts: the tokens of each request."""

    def __init__(self, query: JudgedQuery, statement: str) -> None:
        self._query, self._statement = query, statement
        self.prompts: list[int] = []
        self.candidates = 0

    def send(self, path: str, body: Mapping[str, Any] | None, seconds: float) -> Response:
        """The statement; to candidates, those of grade 2."""
        assert body is not None
        self.prompts.append(estimated_tokens(body["messages"]))
        lines = str(body["messages"][-1]["content"]).splitlines()
        text = self._statement
        if "Candidates:" in lines:
            shown = [str(item["id"]) for item in json.loads(lines[lines.index("Candidates:") + 2])]
            self.candidates = len(shown)
            right = [name for name in shown if name in self._query.clear]
            text = json.dumps({"query_achievable": bool(right), "final_relevant_objects": right})
        message = {"role": "assistant", "content": text}
        return Response(status=200, text=json.dumps({"choices": [{"message": message, "finish_reason": "stop"}]}))


def stand_in(query: JudgedQuery, statement: str) -> tuple[Model, StandIn]:
    """A model that writes this statement and then knows what is right."""
    transport = StandIn(query, statement)
    abilities = Abilities(cgql=["text"], json=["text"], known=True)
    return Model(settings=Settings(model="stand-in"), transport=transport, abilities=abilities), transport


def first_is_right(db: Database, query: JudgedQuery, model: Model, *, rerank: bool) -> bool:
    """Whether the first object of the answer is of grade 2."""
    answer = db.ask(query.query, model=model, rerank=rerank)
    ids = [str(node.id) for row in answer.rows for node in answering(row)]
    return bool(ids) and ids[0] in query.clear


def main() -> int:
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("--stores", type=Path, help="where the stores are kept for the next run")
    parser.add_argument("--show", action="store_true", help="print each query that no model could answer")
    options = parser.parse_args()
    folder = os.environ.get("CGDB_TEST_DATA")
    if not folder:
        print("CGDB_TEST_DATA is not set: the judged maps are needed", file=sys.stderr)
        return 2
    data = Path(folder)
    judged = judgements(data / "retrieval" / "judgements.json")
    hand = json.loads((QUERIES / "handwritten_cgql.json").read_text("utf-8"))
    found: dict[tuple[str, str], list[tuple[bool, bool]]] = {}
    tokens: dict[str, list[tuple[int, int, int]]] = {way: [] for way in WRITERS}
    with folder_of_stores(options.stores) as stores:
        for place, queries in judged.items():
            db, _ = store(stores, data / place)
            for query in (query for query in queries if query.clear):
                for way, write in WRITERS.items():
                    statement = write(query, hand[place][query.id])
                    model, transport = stand_in(query, statement)
                    best = first_is_right(db, query, model, rerank=True)
                    asked = transport.prompts
                    own = first_is_right(db, query, stand_in(query, statement)[0], rerank=False)
                    found.setdefault((way, query.kind), []).append((own, best))
                    tokens[way].append((asked[0], sum(asked[1:]), transport.candidates))
                    if options.show and not best:
                        print(f"{way}: {place} {query.id} {query.query!r} by {statement}")
            db.close()
    kinds = list(dict.fromkeys(kind for _, kind in found))
    rows: list[list[Any]] = []
    for way in WRITERS:
        cells = []
        for kind in kinds:
            pairs = found[way, kind]
            own, best = (sum(pair[side] for pair in pairs) / len(pairs) for side in (0, 1))
            cells.append(f"{own:.2f} {best:.2f}")
        rows.append([way, *cells, *(f"{median(column):.0f}" for column in zip(*tokens[way], strict=True))])
    header = ["statement", *(f"{kind}: first, best" for kind in kinds), "translating", "re-ranking", "candidates"]
    table("The first row of the statement, and the best that a re-ranker can make of it", header, rows)
    return 0


if __name__ == "__main__":
    sys.exit(main())
