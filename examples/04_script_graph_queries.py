"""Work with answers in a program: dicts, pandas, Arrow, networkx, and read-only Cypher where CGQL is not enough.

python examples/04_script_graph_queries.py
"""

import tempfile
from pathlib import Path

import networkx

import cgdb
import cgdb.ingest

MAP = Path(__file__).parent.parent / "cli" / "flat.json"

with tempfile.TemporaryDirectory() as folder, cgdb.open(Path(folder) / "flat.cgdb", create=True) as db:
    db.add(cgdb.ingest.load(MAP))

    # Parameters are never pasted into the text of a query.
    chairs = db.query("MATCH (r:Room)-[:contains]->(o ~ $what) RETURN r.name AS room, count(o) AS n", what="seat")
    print(chairs.to_dicts())

    tools = db.query('MATCH (t ~ "tool")-[:in]->(box) RETURN t.tag AS tool, box.tag AS kept_in LIMIT 5')
    print(tools.to_pandas())
    print(tools.to_arrow().schema)

    # What a language model suggested, and why.
    for row in db.query(
        'MATCH (a)-[r ~ "could be stored in"]->(b) RETURN a.tag, r.label, b.tag, r.explanation LIMIT 3'
    ):
        print(*row, sep="  ")

    # The graph engine's own language reads the graph index.
    for row in db.cypher("MATCH (a:Node)-[r:Rel]->(b:Node) RETURN a.tag, r.label, b.tag LIMIT 5").rows():
        print(*row, sep="  ")

    # The whole map as a graph in memory, for everything that networkx can do.
    graph = db.to_networkx("flat")
    crowded = max((degree, node) for node, degree in graph.in_degree() if graph.nodes[node]["kind"] == "Object")
    print(f"most things are related to {graph.nodes[crowded[1]]['tag']}: {crowded[0]} relations")
    print(f"{networkx.number_weakly_connected_components(graph)} connected part(s)")
