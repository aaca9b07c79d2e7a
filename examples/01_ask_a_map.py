"""Put a map into a store and ask it questions; every answer says why it is one.

python examples/01_ask_a_map.py
"""

import tempfile
from pathlib import Path

import cgdb
import cgdb.ingest

MAP = Path(__file__).parent.parent / "cli" / "flat.json"

QUESTIONS = {
    "by what it looks like": 'MATCH (o ~ "potted plant") RETURN o LIMIT 3',
    "by what it is good for, but not that": 'MATCH (o ~ "something to drink") WHERE NOT o ~ "soda" RETURN o LIMIT 3',
    "by what it is next to": 'MATCH (p ~ "pillow")-[:on]->(c ~ "couch")-[:next_to]-(w ~ "window") RETURN p LIMIT 3',
    "by distance": 'MATCH (l ~ "lamp"), (b ~ "bed") WHERE distance(l, b) < 50 cm RETURN l, distance(l, b) LIMIT 3',
    "by what it is not in": 'MATCH (b ~ "book") WHERE NOT (b)-[:in]->(~ "shelf") RETURN b, b.caption LIMIT 3',
}

with tempfile.TemporaryDirectory() as folder, cgdb.open(Path(folder) / "flat.cgdb", create=True) as db:
    db.add(cgdb.ingest.load(MAP))

    for title, query in QUESTIONS.items():
        print(f"\n{title}: {query}")
        for row in db.query(query):
            print(f"  {row.score:.2f}", *row, "" if row.fits else "(does not really fit)", sep="  ")
            for reason in row.why:
                print(f"          {reason}")
