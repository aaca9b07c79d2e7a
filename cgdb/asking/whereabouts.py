"""Where things are, as one would say it: in which room, on, in or next to what; else where in the map's frame."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from cgdb.asking.answer import Fact
from cgdb.grammar import ast
from cgdb.index.catalog import Catalog
from cgdb.result import Result, StoredNode, StoredRelation

Run = Callable[[ast.Query], Result]

CatalogOf = Callable[[str], Catalog]

_TELLING = (("in", "inside", "on", "on top of", "attached to"), ("under", "above"), ("next_to", "next to"), ("near",))
"""Relations that say where something is, the most telling first; of equally telling ones the surer says it."""
_STRUCTURE = frozenset(("wall", "floor", "ceiling", "room"))
"""What everything is near."""
MOST = 2
"""Things that a place is told by."""


def whereabouts(nodes: Sequence[StoredNode], catalog_of: CatalogOf, run: Run) -> tuple[list[str], list[Fact]]:
    """A line per thing, "#2 lamp is in the kitchen, on #0 table", and its parts as facts. catalog_of: of a scene."""
    lines, facts = [], []
    for node in nodes:
        catalog = catalog_of(node.scene)
        said = [*_rooms(node, catalog, run), *_beside(node, catalog, run)]
        facts.extend(said)
        words = [f"{fact.what.replace('_', ' ')} {fact.value}" for fact in said]
        if not words and node.center is not None:
            x, y, z = (float(c) for c in node.center)
            words = [f"at x {x:.2f}, y {y:.2f}, z {z:.2f} m"]
            facts.extend(
                Fact(what=axis, value=round(c, 3), unit="m", objects=(node,))
                for axis, c in zip("xyz", (x, y, z), strict=True)
            )
        lines.append(f"{node} is {', '.join(words)}" if words else f"{node}: the map does not say where it is")
    return lines, facts


def _rooms(node: StoredNode, catalog: Catalog, run: Run) -> list[Fact]:
    label = catalog.room_label
    if label is None:
        return []
    edge = ast.EdgePattern(labels=("contains",), max_hops=catalog.hops_to_objects(label))
    room = ast.NodePattern(variable="r", label=label)
    rows = run(_of(node, (room, _subject(node)), edge, ("r",))).rows
    return [
        Fact(what="in", value=f"the {place.tag or place}", objects=(node, place))
        for row in rows[:1]
        if isinstance(place := row[0], StoredNode)
    ]


def _beside(node: StoredNode, catalog: Catalog, run: Run) -> list[Fact]:
    rank = {name: i for i, names in enumerate(_TELLING) for name in names}
    known = tuple(name for name in rank if ("Object", "Object") in catalog.relations.get(name, {}))
    if not known:
        return []
    edge = ast.EdgePattern(variable="r", labels=known)
    other = ast.NodePattern(variable="b")
    rows = run(_of(node, (_subject(node), other), edge, ("r", "b"))).rows
    found = [(row[0], row[1], row.score) for row in rows if row.fits]
    best = sorted(
        (
            ((rank[r.label], -r.confidence, -score), r, b)
            for r, b, score in found
            if isinstance(r, StoredRelation) and isinstance(b, StoredNode)
        ),
        key=lambda one: one[0],
    )
    best = [one for one in best if (one[2].tag or "").casefold() not in _STRUCTURE] or best
    told = [one for one in best if one[1].label == best[0][1].label][:MOST]
    return [Fact(what=r.label, value=str(b), objects=(node, b)) for _, r, b in told]


def _subject(node: StoredNode) -> ast.NodePattern:
    return ast.NodePattern(variable="o", id=ast.ObjectRef(id=node.id))


def _of(
    node: StoredNode, nodes: tuple[ast.NodePattern, ...], edge: ast.EdgePattern, names: tuple[str, ...]
) -> ast.Query:
    return ast.Query(
        scenes=(ast.Text(value=node.scene),),
        patterns=(ast.Pattern(nodes=nodes, edges=(edge,)),),
        returns=tuple(ast.ReturnItem(expression=ast.Variable(name=name)) for name in names),
        limit=ast.Number(value=20),
    )
