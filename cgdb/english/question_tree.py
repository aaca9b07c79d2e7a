"""What a question asks, written as a CGQL tree in the names that the store has.

Where things are is asked softly: in maps of real places an edge is easily missing. ``MATCH (o ~ "pillow") WHERE
(o)-[:on]->(~ "couch") OR ((o)-[:on|in|next_to]-(~ "couch") OR o ~ "couch") AND o ~ "pillow on the couch"``: a pillow
with the edge comes first, then one that a couch is at, then the others, which do not fit.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace

from cgdb.english import cues, relation_names
from cgdb.english.affordances import PROPERTY, Affordance, affordance_of
from cgdb.english.clauses import depicts
from cgdb.english.intent import Asked, First, Located, Measured
from cgdb.english.phrases import words
from cgdb.grammar import ast
from cgdb.index.catalog import Catalog
from cgdb.meaning.knowledge import knowledge
from cgdb.meaning.words import singular

LONGEST_MEANING = 300
"""Characters of one ``~``; what is said in more is no longer one thing."""

MOST_ANCHORS = 4
"""Things that one relation may name ("between a, b and c")."""

SUBJECT, ROOM = "o", "r"

_MEASURES: Mapping[str, str] = {"height": "height", "width": "width", "depth": "depth", "size": "volume"}
_SAYS: Mapping[str, str] = {"next_to": "next to", "front": "in front of", "attached": "attached to"}
_SORTS: Mapping[str, str] = {"kind": "kind", "traits": "property", "use": "use", "name": "name"}


@dataclass(frozen=True, slots=True, kw_only=True)
class Written:
    """The tree, one line per thing that was understood, and the text of what is wanted."""

    query: ast.Query
    understood: tuple[str, ...]
    wanted: str


def write(asked: Asked, catalog: Catalog, places: Sequence[str], up: str) -> Written:
    """The statement that asks it. places: names of the store's rooms; up: its up axis."""
    writer = _Writer(catalog, places, up)
    query = writer.query(asked)
    return Written(query=query, understood=tuple(writer.understood), wanted=writer.wanted)


@dataclass(slots=True)
class _Writer:
    """Makes the tree; what it understands is told line by line as it goes."""

    catalog: Catalog
    places: Sequence[str]
    up: str
    understood: list[str] = field(default_factory=list)
    wanted: str = ""
    _patterns: list[ast.Pattern] = field(default_factory=list)
    _conditions: list[ast.Expression] = field(default_factory=list)

    def query(self, asked: Asked) -> ast.Query:
        """The whole statement."""
        asked = self._in_the_stores_terms(asked)
        self.wanted = _cut(asked.wanted)
        self._say_form(asked)
        subject = self._subject(asked)
        if asked.state is not None:
            self._conditions.append(self._state(asked.state))
            self._say(f"state: {asked.state}")
        for text in asked.excluded:
            self._conditions.append(ast.Not(item=_similar(text)))
            self._say(f"excluded ({_SORTS[knowledge().facets(text).form]}): {text}")
        for i, located in enumerate(asked.located):
            self._conditions.append(self._located(asked, located, asked.located[i - 1] if located.chained else None))
        if asked.places:
            self._conditions.append(_any_of([self._in_place(name) for name in asked.places]))
            self._say(f"in place: {', '.join(asked.places)}")
        for name in asked.not_places:
            self._conditions.append(ast.Not(item=self._in_place(name)))
            self._say(f"not in place: {name}")
        for measured in asked.measured:
            self._conditions.append(self._measured(measured))
            self._say(f"measured: {measured.text}")
        order = self._order(asked.first)
        ranked = asked.first if order else None
        if asked.form == "count":
            returns, order, ranked = self._counted(), (), None
        elif asked.form == "per room" and self._place_label() is not None:
            returns, order, ranked = self._per_room(), (_descending(_count(SUBJECT)),), None
        elif asked.form == "room" and self.wanted and self._place_label() is not None:
            returns = (_item(ast.Variable(name=ROOM)), _item(ast.Variable(name=SUBJECT)))
        else:
            returns = (_item(ast.Variable(name=SUBJECT)),)
        return ast.Query(
            patterns=(subject, *self._patterns),
            where=_all_of(self._conditions) if self._conditions else None,
            distinct=bool(self._patterns) and not order and len(returns) == 1,
            returns=returns,
            order=order,
            skip=ast.Number(value=ranked.rank - 1) if ranked is not None and ranked.rank > 1 else None,
            limit=ast.Number(value=1) if ranked is not None and ranked.single else None,
        )

    def _say(self, line: str) -> None:
        self.understood.append(line)

    def _say_form(self, asked: Asked) -> None:
        said = {
            "count": "counted",
            "per room": "counted in each room",
            "exists": "asked whether there is one",
            "where": "asked where it is",
            "room": "asked for the room",
        }
        if asked.form in said:
            self._say(said[asked.form])

    # -- what the store can answer ------------------------------------------------------------------------------

    def _in_the_stores_terms(self, asked: Asked) -> Asked:
        """Put back into the text what the store holds no answer to: relations, rooms or states that it lacks."""
        if asked.state is not None and self._state_property() is None:
            asked = replace(asked, state=None, wanted=asked.with_state)
        if self._place_label() is None:
            where = f"in the {' or '.join(asked.places)}" if asked.places else ""
            denied = tuple(f"in the {place}" for place in asked.not_places)
            asked = replace(asked, wanted=f"{asked.wanted} {where}".strip(), places=(), not_places=())
            asked = replace(asked, excluded=(*asked.excluded, *denied))
        if asked.located and not relation_names.related(self.catalog):
            denied = tuple(located.text for located in asked.located if located.negated)
            wanted = _whole(asked.wanted, asked.located)
            asked = replace(asked, wanted=wanted, located=(), excluded=(*asked.excluded, *denied))
        return asked

    def _place_label(self) -> str | None:
        """The label of rooms, where the store holds any."""
        if "Room" in self.catalog.labels:
            return "Room"
        holders = {a for a, b in self.catalog.relations.get("contains", {}) if b == "Object" and a != "Object"}
        return min(holders) if holders else None

    def _state_property(self) -> str | None:
        return next((name for name in ("states", "state") if name in self.catalog.properties), None)

    # -- the subject --------------------------------------------------------------------------------------------

    def _subject(self, asked: Asked) -> ast.Pattern:
        label = self._place_label()
        if label is not None and (self._names_place(self.wanted) or (asked.form == "room" and not self.wanted)):
            self._say(f"wanted: the place {self.wanted}" if self.wanted else "wanted: any place")
            return _nodes(ast.NodePattern(variable=SUBJECT, label=label, meaning=_meaning(self.wanted)))
        found = affordance_of(self.wanted) if asked.use and self.catalog.properties.get(PROPERTY) == "list" else None
        self._say(f"wanted: {self.wanted}" if self.wanted else "wanted: anything")
        decides = found is not None and found[0].decides and found[1]
        node = ast.NodePattern(variable=SUBJECT, meaning=None if decides else _meaning(self.wanted))
        if found is not None:
            self._conditions.append(ast.Or(items=(*_affords(found[0]), _similar(self.wanted))))
            self._say(f"by the map's own affordances: {found[0].names[0]}")
        if asked.form in ("room", "per room") and label is not None:
            room = ast.NodePattern(variable=ROOM, label=label)
            return ast.Pattern(nodes=(room, node), edges=(self._contains(label),))
        return _nodes(node)

    def _state(self, state: str) -> ast.Expression:
        name = self._state_property()
        assert name is not None, "states that the store lacks have been put back into the text"
        return ast.Contains(text=ast.Property(variable=SUBJECT, name=name), part=ast.Text(value=state))

    # -- relations ----------------------------------------------------------------------------------------------

    def _located(self, asked: Asked, located: Located, before: Located | None) -> ast.Expression:
        says = _SAYS.get(located.name, located.name)
        anchors = [anchor or self.wanted or "object" for anchor in located.anchors[:MOST_ANCHORS]]
        side = f"with {' and '.join(anchors)} {says} it" if located.inverse else f"{says}: {' and '.join(anchors)}"
        self._say(f"not {side}" if located.negated else side)
        if located.negated:
            kinds = [_similar(kind) for anchor in anchors if (kind := _compound(self.wanted, anchor))]
            return ast.Not(item=_any_of([*(self._edge(located, anchor) for anchor in anchors), *kinds]))
        return _all_of([self._softly(asked, located, anchor, before) for anchor in anchors])

    def _softly(self, asked: Asked, located: Located, anchor: str, before: Located | None) -> ast.Expression:
        said = [self._edge(located, anchor)]
        if before is not None and before.anchors and not before.negated:
            said.append(self._chain(before, located, anchor))
        if not self.wanted:
            return _any_of(said)
        whole = _similar(_whole(self.wanted, asked.located))
        if kind := _compound(self.wanted, anchor):
            return _any_of([*said, _similar(kind)])
        if _is_structure(anchor) or _same_kind(self.wanted, anchor) or depicts(self.wanted):
            return _any_of([*said, whole])
        touching = _pattern(_subject_node(), relation_names.touching(self.catalog, located.name), _meant(anchor))
        return _any_of([*said, _all_of([_any_of([touching, _similar(anchor)]), whole])])

    def _edge(self, located: Located, anchor: str) -> ast.Expression:
        edge = relation_names.edge(self.catalog, located.name, inverse=located.inverse)
        return _pattern(_subject_node(), edge, _meant(anchor))

    def _chain(self, before: Located, located: Located, anchor: str) -> ast.Expression:
        """ "On the table by the window": it may be the table that is by the window."""
        edges = tuple(relation_names.edge(self.catalog, one.name, inverse=one.inverse) for one in (before, located))
        nodes = (_subject_node(), _meant(before.anchors[-1] or self.wanted or "object"), _meant(anchor))
        return ast.PatternCondition(pattern=ast.Pattern(nodes=nodes, edges=edges))

    # -- places -------------------------------------------------------------------------------------------------

    def _contains(self, label: str) -> ast.EdgePattern:
        """From a room to what it holds, through other places where the map nests them."""
        direct = (label, "Object") in self.catalog.relations.get("contains", {})
        return ast.EdgePattern(labels=("contains",), max_hops=1 if direct else 3)

    def _in_place(self, name: str) -> ast.Expression:
        label = self._place_label()
        assert label is not None, "places that the store lacks have been put back into the text"
        rooms = [
            ast.NodePattern(label=label, properties=(("name", ast.Text(value=known)),)) for known in self._called(name)
        ]
        rooms = rooms or [ast.NodePattern(label=label, meaning=_meaning(name))]
        return _any_of([_pattern(room, self._contains(label), _subject_node()) for room in rooms])

    def _called(self, name: str) -> list[str]:
        """The store's rooms that go by this name ("living room": livingroom, living_room 2)."""
        asked = _squeezed(name)
        same = next((group for group in cues.SAME_ROOM if asked in group), frozenset((asked,)))
        exact = [place for place in dict.fromkeys(self.places) if _squeezed(place) == asked]
        if exact:
            return exact
        return [place for place in dict.fromkeys(self.places) if _squeezed(place).rstrip("0123456789") in same]

    def _names_place(self, wanted: str) -> bool:
        name = " ".join(singular(word.form) for word in words(wanted))
        return bool(wanted) and (bool(self._called(name)) or cues.rooms().only(name) is not None)

    # -- sizes, distances, orders -------------------------------------------------------------------------------

    def _measured(self, measured: Measured) -> ast.Expression:
        subject = ast.Variable(name=SUBJECT)
        if measured.what == "distance":
            distance = _call("distance", subject, self._other(measured.than or ""))
            return ast.Comparison(op=measured.op, left=distance, right=_length(measured))
        if measured.than is not None:
            function, other = _MEASURES[measured.what], self._other(measured.than)
            compared = ast.Comparison(op=measured.op, left=_call(function, subject), right=_call(function, other))
            return ast.And(items=(compared, _differ(other)))
        if measured.what != "size":
            return ast.Comparison(op=measured.op, left=_call(measured.what, subject), right=_length(measured))
        sides = [
            ast.Comparison(op=measured.op, left=_call(side, subject), right=_length(measured))
            for side in ("width", "height")
        ]
        return _any_of(sides) if measured.op in (">", ">=") else _all_of(sides)

    def _other(self, meaning: str) -> ast.Variable:
        """A thing beside the one that is wanted, to measure from."""
        name = f"a{len(self._patterns) + 1}" if self._patterns else "a"
        self._patterns.append(_nodes(ast.NodePattern(variable=name, meaning=_meaning(meaning))))
        return ast.Variable(name=name)

    def _order(self, first: First | None) -> tuple[ast.OrderItem, ...]:
        if first is None:
            return ()
        subject = ast.Variable(name=SUBJECT)
        if first.by == "distance" and first.to is None:
            self._say(f"{first.text}: to what is not said, so it was left out")
            return ()
        self._say(f"in order: {first.text}")
        if first.by == "distance":
            other = self._other(first.to or "")
            self._conditions.append(_differ(other))
            return (ast.OrderItem(expression=_call("distance", subject, other), descending=first.descending),)
        if first.by != "z":
            return (ast.OrderItem(expression=_call(first.by, subject), descending=first.descending),)
        height = ast.Property(variable=SUBJECT, name=self.up[-1:] or "z")
        return (ast.OrderItem(expression=height, descending=first.descending != self.up.startswith("-")),)

    # -- what is given ------------------------------------------------------------------------------------------

    def _counted(self) -> tuple[ast.ReturnItem, ...]:
        distinct = bool(self._patterns)
        found = ast.Call(name="collect", arguments=(ast.Variable(name=SUBJECT),), distinct=distinct)
        return (_item(_count(SUBJECT, distinct=distinct), "count"), _item(found, "found"))

    def _per_room(self) -> tuple[ast.ReturnItem, ...]:
        return (_item(ast.Property(variable=ROOM, name="name")), _item(_count(SUBJECT)))


# -- trees ------------------------------------------------------------------------------------------------------


def _cut(text: str) -> str:
    return text[:LONGEST_MEANING].strip()


def _meaning(text: str) -> ast.Text | None:
    return ast.Text(value=_cut(text)) if text.strip() else None


def _similar(text: str) -> ast.Expression:
    return ast.Similar(variable=SUBJECT, meaning=ast.Text(value=_cut(text)))


def _subject_node() -> ast.NodePattern:
    return ast.NodePattern(variable=SUBJECT)


def _meant(text: str) -> ast.NodePattern:
    return ast.NodePattern(meaning=_meaning(text))


def _nodes(node: ast.NodePattern) -> ast.Pattern:
    return ast.Pattern(nodes=(node,))


def _pattern(one: ast.NodePattern, edge: ast.EdgePattern, other: ast.NodePattern) -> ast.Expression:
    return ast.PatternCondition(pattern=ast.Pattern(nodes=(one, other), edges=(edge,)))


def _affords(affordance: Affordance) -> Iterable[ast.Expression]:
    held = ast.Property(variable=SUBJECT, name=PROPERTY)
    return (ast.Contains(text=held, part=ast.Text(value=name)) for name in affordance.names)


def _all_of(items: Sequence[ast.Expression]) -> ast.Expression:
    flat = [part for item in items for part in (item.items if isinstance(item, ast.And) else (item,))]
    return flat[0] if len(flat) == 1 else ast.And(items=tuple(flat))


def _any_of(items: Sequence[ast.Expression]) -> ast.Expression:
    flat = [part for item in items for part in (item.items if isinstance(item, ast.Or) else (item,))]
    return flat[0] if len(flat) == 1 else ast.Or(items=tuple(flat))


def _call(name: str, *arguments: ast.Expression) -> ast.Call:
    return ast.Call(name=name, arguments=arguments)


def _count(name: str, *, distinct: bool = False) -> ast.Call:
    return ast.Call(name="count", arguments=(ast.Variable(name=name),), distinct=distinct)


def _item(expression: ast.Expression, name: str | None = None) -> ast.ReturnItem:
    return ast.ReturnItem(expression=expression, name=name)


def _descending(expression: ast.Expression) -> ast.OrderItem:
    return ast.OrderItem(expression=expression, descending=True)


def _differ(other: ast.Variable) -> ast.Expression:
    return ast.Comparison(op="<>", left=_call("id", ast.Variable(name=SUBJECT)), right=_call("id", other))


def _length(measured: Measured) -> ast.Number:
    value = measured.number or 0.0
    return ast.Number(value=int(value) if float(value).is_integer() else value, unit=measured.unit)


# -- texts ------------------------------------------------------------------------------------------------------


def _squeezed(name: str) -> str:
    return re.sub(r"[\W_]+", "", name.casefold())


def _whole(wanted: str, located: Sequence[Located]) -> str:
    """What is wanted with where it is, as it was written."""
    return _cut(" ".join((wanted, *(part.text for part in located if not part.negated))))


def _is_structure(anchor: str) -> bool:
    found = words(anchor)
    return bool(found) and found[-1].form in cues.STRUCTURE


def _compound(wanted: str, anchor: str) -> str | None:
    """ "Ceiling lamps" for lamps on the ceiling, where that is a kind of its own."""
    if not _is_structure(anchor):
        return None
    kind = f"{singular(words(anchor)[-1].form)} {wanted}"
    named = knowledge().things_named(kind)
    return kind if named and named != knowledge().things_named(wanted) else None


def _same_kind(wanted: str, anchor: str) -> bool:
    """Whether both are of one kind ("a chair next to a chair"): being one says nothing of being near one."""
    one, other = knowledge().facets(wanted).kinds, knowledge().facets(anchor).kinds
    return wanted == anchor or bool(set(one) & set(other))
