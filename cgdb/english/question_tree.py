"""What a question asks, written as a CGQL tree in the names that the store has.

Where things are is asked softly: in maps of real places an edge is easily missing. ``MATCH (o ~ "pillow") WHERE
(o)-[:on]->(~ "couch") OR ((o)-[:on|in|next_to]-(~ "couch") OR o ~ "couch") AND o ~ "pillow on the couch"``: a pillow
with the edge comes first, then one that a couch is at, then the others, which do not fit. In a map that says nothing
but names and boxes, the edges are all that tells, and are asked alone.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace

from cgdb.english import caption_words, cues, relation_names
from cgdb.english import tree_parts as parts
from cgdb.english.affordances import PROPERTY, Affordance, affordance_of
from cgdb.english.anchor_kinds import compound, is_structure, same_kind
from cgdb.english.clauses import depicts
from cgdb.english.intent import Asked, Located, Measured, Setting
from cgdb.english.lookahead import AREAS, PREVIOUS
from cgdb.english.looser import Looser, Plain, of_denied, of_exclusion, of_relation, of_wanted
from cgdb.english.phrases import words
from cgdb.english.question_forms import Given, given
from cgdb.english.question_values import Values
from cgdb.english.told_properties import told
from cgdb.english.tree_parts import ROOM, SUBJECT, cut, pattern, similar, subject_node
from cgdb.grammar import ast
from cgdb.index.catalog import Catalog
from cgdb.meaning.knowledge import knowledge
from cgdb.meaning.words import singular

MOST_ANCHORS = 4
"""Things that one relation may name ("between a, b and c")."""

CLOSE = 1
"""Metres within which things are close by, where the map holds no relations."""

_SAYS: Mapping[str, str] = {"next_to": "next to", "front": "in front of", "attached": "attached to"}
_SORTS: Mapping[str, str] = {"kind": "kind", "traits": "property", "use": "use", "name": "name", "told": "as told"}
_SIDES = re.compile(r"\b(left|right)\b|^(front|behind)$")
_SUPERLATIVE = re.compile(r"\b(?:(?:the )?(?:most|least) \w+|\w{3,}est)\b", re.IGNORECASE)


@dataclass(frozen=True, slots=True, kw_only=True)
class Condition:
    """A condition of the statement and how it is said of a thing that does not meet it.

    looser: what may be asked instead where nothing fits, the nearest first. wider: what may be denied instead where
    nothing is what is denied.
    """

    expression: ast.Expression
    lacks: str
    looser: tuple[Looser, ...] = ()
    wider: Looser | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class Written:
    """The tree and what it says.

    understood: one line per thing that was understood; assumed: what was not said and taken to be meant; ignored: what
    the statement leaves out. wanted: the text of what is wanted; plain: without what the map cannot tell of it.
    conditions: all but that. anchors: what things are said to be at, or are measured against.
    """

    query: ast.Query
    understood: tuple[str, ...]
    wanted: str
    plain: Plain | None = None
    assumed: tuple[str, ...] = ()
    ignored: tuple[str, ...] = ()
    conditions: tuple[Condition, ...] = ()
    anchors: tuple[str, ...] = ()


def write(asked: Asked, catalog: Catalog, setting: Setting) -> Written:
    """The statement that asks it."""
    writer = _Writer(catalog, setting)
    query = writer.query(asked)
    values = writer.values
    return Written(
        query=query,
        understood=tuple(writer.understood),
        wanted=writer.wanted,
        plain=None if asked.use else of_wanted(writer.wanted, setting),
        assumed=tuple(dict.fromkeys((*writer.assumed, *values.assumed))),
        ignored=tuple(dict.fromkeys((*writer.ignored, *values.ignored))),
        conditions=tuple(writer.conditions),
        anchors=tuple(dict.fromkeys((*writer.anchors, *values.anchors))),
    )


@dataclass(slots=True)
class _Writer:
    """Makes the tree; what it understands is told line by line as it goes."""

    catalog: Catalog
    setting: Setting
    understood: list[str] = field(default_factory=list)
    assumed: list[str] = field(default_factory=list)
    ignored: list[str] = field(default_factory=list)
    conditions: list[Condition] = field(default_factory=list)
    anchors: list[str] = field(default_factory=list)
    wanted: str = ""
    values: Values = field(init=False)
    _affordances: list[ast.Expression] = field(default_factory=list)
    _before: str | None = None

    def __post_init__(self) -> None:
        self.values = Values(self.catalog, self.setting)

    def query(self, asked: Asked) -> ast.Query:
        """The whole statement."""
        asked, by_property = told(asked, self.catalog)
        asked = self._in_the_stores_terms(asked)
        previous = asked.wanted == PREVIOUS
        self.wanted = "" if previous else cut(asked.wanted)
        self._say_form(asked)
        subject = self._subject(asked, previous=previous)
        if previous:
            self._affordances.append(parts.among_previous(SUBJECT))
        for one in by_property:
            self._ask(one.expression, one.lacks, one.says)
        if asked.state is not None:
            self._ask(self._state(asked.state), f"not {asked.state}", f"state: {asked.state}")
        for text in asked.excluded:
            sort = _SORTS[knowledge().facets(text).form]
            out: ast.Expression = ast.Not(item=similar(text))
            loose = of_exclusion(text, out) if asked.use else ()
            self._ask(out, f"{text}, which is excluded", f"excluded ({sort}): {text}", loose)
        for i, located in enumerate(asked.located):
            before = asked.located[i - 1] if located.chained else None
            says = f"it is {located.text}" if located.negated else f"not {located.text}"
            condition = self._located(asked, located, before)
            self._ask(condition, says)
            self.conditions[-1] = self._less_strictly(located, self.conditions[-1])
        if asked.places:
            where = " or ".join(asked.places)
            inside = parts.any_of([self._in_place(name) for name in asked.places])
            self._ask(inside, f"not in the {where}", f"in place: {', '.join(asked.places)}")
        for name in asked.not_places:
            self._ask(ast.Not(item=self._in_place(name)), f"it is in the {name}", f"not in place: {name}")
        columns: list[str] = []
        for measured in asked.measured:
            found = self.values.condition(measured)
            if found is not None:
                several = measured.than is not None and measured.than != PREVIOUS and measured.op != "<="
                any_of = " (of several, any)" if several else ""
                self._ask(found[0], f"not {measured.text}", f"measured: {measured.text}{any_of}")
                columns.extend(found[1])
                if measured.op == "~":
                    self.assumed.append(f"{measured.text}: give or take a tenth")
        form = given(asked, self.values, tuple(columns), label=self.catalog.room_label, wanted=self.wanted)
        self._note_superlatives()
        if form.says:
            self._say(form.says)
        conditions = [*self._affordances, *(one.expression for one in self.conditions), *self.values.conditions]
        if form.condition is not None:
            conditions.insert(0, form.condition)
        return _statement(subject, self.values.patterns, conditions, form)

    def _ask(self, condition: ast.Expression, lacks: str, says: str = "", looser: tuple[Looser, ...] = ()) -> None:
        self.conditions.append(Condition(expression=condition, lacks=lacks, looser=looser))
        if says:
            self._say(says)

    def _say(self, line: str) -> None:
        if line not in self.understood:
            self.understood.append(line)

    def _say_form(self, asked: Asked) -> None:
        said = {
            "count": "counted",
            "per room": "counted in each room",
            "per scene": "counted in each scene",
            "scene": "asked for the scene",
            "exists": "asked whether there is one",
            "where": "asked where it is",
            "room": "asked for the room",
            "measure": f"asked for the {'height above the floor' if asked.what == 'level' else asked.what}",
            "trait": f"asked for the {asked.what}",
            "distance": f"asked for the distance from {asked.against}" if asked.against else "asked for the distance",
            "all": f"asked whether all are: {asked.against}",
            "average": f"asked for the average {asked.what}",
            "compare": f"counted against: {asked.against}",
        }
        if asked.form in said:
            self._say(said[asked.form])

    def _note_superlatives(self) -> None:
        """What asks for the first of an order that nothing measures: it is only matched by meaning."""
        for match in _SUPERLATIVE.finditer("; ".join((self.wanted, *self.anchors, *self.values.anchors))):
            word = match[0].casefold()
            if singular(word) not in knowledge().vocabulary and not word.endswith(("forest", "request", "interest")):
                self.assumed.append(f"{match[0]}: matched by meaning, not measured")

    # -- what the store can answer ------------------------------------------------------------------------------

    def _in_the_stores_terms(self, asked: Asked) -> Asked:
        """Put back into the text what the store holds no answer to: relations, rooms or states that it lacks."""
        if asked.state is not None and self._state_property() is None:
            asked = replace(asked, state=None, wanted=asked.with_state)
            self.assumed.append(f"{asked.with_state}: the map holds no states, so that was matched by meaning")
        if self.catalog.room_label is None and (asked.places or asked.not_places):
            asked = self._places_spoken_of(asked)
        if self.catalog.room_label is None and (asked.places or asked.not_places):
            where = f"in the {' or '.join(asked.places)}" if asked.places else ""
            denied = tuple(f"in the {place}" for place in asked.not_places)
            self.assumed.append(f"{' '.join((where, *denied)).strip()}: the map holds no rooms, so the words decide")
            asked = replace(asked, wanted=f"{asked.wanted} {where}".strip(), places=(), not_places=())
            asked = replace(asked, excluded=(*asked.excluded, *denied))
        if self.catalog.room_label is None and asked.form in ("room", "per room"):
            self.ignored.append("the map holds no rooms")
        if not relation_names.related(self.catalog):
            back = tuple(one for one in asked.located if PREVIOUS in one.anchors)
            close = tuple(one for one in back if one.name in ("near", "next_to") and not one.negated)
            for one in back:
                how = f"taken as within {CLOSE} m" if one in close else "left out"
                (self.assumed if one in close else self.ignored).append(
                    f"{one.text}: the map holds no relations, {how}"
                )
            near = (
                Measured(what="distance", op="<=", number=CLOSE, unit="m", than=PREVIOUS, text=o.text) for o in close
            )
            located = tuple(one for one in asked.located if one not in back)
            asked = replace(asked, located=located, measured=(*asked.measured, *near))
        if asked.located and not relation_names.related(self.catalog):
            asked = self._by_captions(asked)
        if asked.located and not relation_names.related(self.catalog):
            denied = tuple(located.text for located in asked.located if located.negated)
            wanted = _whole(asked.wanted, asked.located)
            said = ", ".join(located.text for located in asked.located)
            self.assumed.append(f"{said}: the map holds no relations, so the words decide")
            asked = replace(asked, wanted=wanted, located=(), excluded=(*asked.excluded, *denied))
        return asked

    def _places_spoken_of(self, asked: Asked) -> Asked:
        """Without the places that no word of the map speaks of: they would only cloud what is wanted."""
        known = self.setting.words

        def spoken_of(place: str) -> bool:
            own = [word.form for word in words(place) if word.form not in AREAS and len(word.form) > 2]
            return not known or not own or all(word in known or singular(word) in known for word in own)

        unknown = [place for place in (*asked.places, *asked.not_places) if not spoken_of(place)]
        self.ignored.extend(
            f"in the {place}: the map holds no rooms, and nothing in it speaks of one" for place in unknown
        )
        return replace(
            asked,
            places=tuple(place for place in asked.places if place not in unknown),
            not_places=tuple(place for place in asked.not_places if place not in unknown),
        )

    def _by_captions(self, asked: Asked) -> Asked:
        """Where there are no relations: what is not so placed, and what something that is not named is at.

        The words of "not on the table" would only exclude tables, and those of "whatever is on the table" find them.
        """
        left: list[Located] = []
        for one in asked.located:
            told = self._told(one, [anchor for anchor in one.anchors if anchor])
            if not told or (asked.wanted and not one.negated):
                left.append(one)
            elif one.negated:
                self._ask(ast.Not(item=parts.any_of(told)), f"it is {one.text}", f"not {one.text}, by the captions")
            else:
                others = [ast.Not(item=similar(anchor)) for anchor in one.anchors]
                self._ask(parts.all_of([*told, *others]), f"not {one.text}", f"{one.text}, by the captions")
        if len(left) < len(asked.located):
            self.assumed.append("the map holds no relations, so the words of the captions decide what is where")
        return replace(asked, located=tuple(left))

    def _state_property(self) -> str | None:
        return next((name for name in ("states", "state") if name in self.catalog.properties), None)

    # -- the subject --------------------------------------------------------------------------------------------

    def _subject(self, asked: Asked, *, previous: bool) -> ast.Pattern:
        label = self.catalog.room_label
        if singular(self.wanted.casefold()) == "room" and asked.form in ("find", "count", "exists", "per scene"):
            if label is None:
                self.ignored.append("the map holds no rooms")
            else:
                self._say("wanted: any place")
                return parts.nodes(ast.NodePattern(variable=SUBJECT, label=label))
        if label is not None and (self._names_place(self.wanted) or (asked.form == "room" and not self.wanted)):
            self._say(f"wanted: the place {self.wanted}" if self.wanted else "wanted: any place")
            return parts.nodes(ast.NodePattern(variable=SUBJECT, label=label, meaning=parts.meaning(self.wanted)))
        found = affordance_of(self.wanted) if asked.use and self.catalog.properties.get(PROPERTY) == "list" else None
        said = PREVIOUS if previous else self.wanted or "anything"
        self._say(f"wanted: {said}")
        decides = found is not None and found[0].decides and found[1]
        meaning = None if decides or asked.form == "compare" else parts.meaning(self.wanted)
        node = ast.NodePattern(variable=SUBJECT, meaning=meaning)
        if found is not None:
            self._affordances.append(ast.Or(items=(*_affords(found[0]), similar(self.wanted))))
            self._say(f"by the map's own affordances: {found[0].names[0]}")
        if asked.form in ("room", "per room") and label is not None:
            room = ast.NodePattern(variable=ROOM, label=label)
            return ast.Pattern(nodes=(room, node), edges=(self._contains(label),))
        return parts.nodes(node)

    def _state(self, state: str) -> ast.Expression:
        name = self._state_property()
        assert name is not None, "states that the store lacks have been put back into the text"
        return ast.Contains(text=ast.Property(variable=SUBJECT, name=name), part=ast.Text(value=state))

    # -- relations ----------------------------------------------------------------------------------------------

    def _located(self, asked: Asked, located: Located, before: Located | None) -> ast.Expression:
        located = self._by_side(located)
        says = _SAYS.get(located.name, located.name)
        anchors = [anchor or self.wanted or "object" for anchor in located.anchors[:MOST_ANCHORS]]
        if len(located.anchors) > MOST_ANCHORS:
            self.ignored.append(f"{', '.join(located.anchors[MOST_ANCHORS:])}: more than {MOST_ANCHORS} things")
        self.anchors.extend(anchor for anchor in anchors if anchor not in (PREVIOUS, self.wanted))
        side = f"with {' and '.join(anchors)} {says} it" if located.inverse else f"{says}: {' and '.join(anchors)}"
        self._say(f"not {side}" if located.negated else side)
        if located.negated:
            kinds = [similar(kind) for anchor in anchors if (kind := compound(self.wanted, anchor))]
            edges = (self._edge(located, anchor) for anchor in anchors)
            return ast.Not(item=parts.any_of([*edges, *kinds, *self._told(located, anchors)]))
        return parts.all_of([self._softly(asked, located, anchor, before) for anchor in anchors])

    def _less_strictly(self, located: Located, condition: Condition) -> Condition:
        meant = {anchor: self._meant(anchor) for anchor in located.anchors if anchor and anchor != PREVIOUS}
        if len(meant) < len(located.anchors):
            return condition
        said = (self.catalog, self._by_side(located), condition.expression, meant)
        looser = of_relation(*said)
        if located.guessed:
            looser = (*looser, Looser(says=f"{located.text}: only thought to be so, and left out"))
        return replace(condition, looser=looser, wider=of_denied(*said))

    def _told(self, located: Located, anchors: Sequence[str]) -> list[ast.Expression]:
        """That the captions say it, where they tell where things are."""
        if not self.setting.tells or located.inverse or PREVIOUS in anchors:
            return []
        said = (caption_words.places(located.name, anchor) for anchor in anchors if not same_kind(self.wanted, anchor))
        return [one for one in said if one is not None]

    def _by_side(self, located: Located) -> Located:
        """Left, right, front and behind as the map says them; where it does not, only that it is close by."""
        if located.name == "between":
            self.assumed.append(f"{located.text}: taken as close to each of them")
        found = _SIDES.search(located.name) or _SIDES.search(located.text.casefold())
        if found is None:
            return located
        side = found[0]
        if relation_names.says(self.catalog, side):
            return replace(located, name=side)
        said = re.sub(r"\s+(?:the|a|an)\s(?!left|right|front|back|rear|side).*$", "", located.text)
        self.assumed.append(f"{said}: that depends on where one stands, which the map does not hold; taken as close by")
        return located

    def _softly(self, asked: Asked, located: Located, anchor: str, before: Located | None) -> ast.Expression:
        said = [self._edge(located, anchor)]
        if before is not None and before.anchors and not before.negated:
            said.append(self._chain(before, located, anchor))
        if not self.wanted or anchor == PREVIOUS:
            return parts.any_of(said)
        whole = similar(_whole(self.wanted, asked.located))
        if kind := compound(self.wanted, anchor):
            return parts.any_of([*said, similar(kind)])
        if not self.setting.tells:
            return parts.any_of(said)
        if is_structure(anchor) or same_kind(self.wanted, anchor) or depicts(self.wanted):
            return parts.any_of([*said, whole])
        touching = pattern(subject_node(), relation_names.touching(self.catalog, located.name), self._meant(anchor))
        told = caption_words.places("" if located.inverse else located.name, anchor)
        hints = [touching, similar(anchor), *([told] if told is not None else [])]
        return parts.any_of([*said, parts.all_of([parts.any_of(hints), whole])])

    def _edge(self, located: Located, anchor: str) -> ast.Expression:
        edge = relation_names.edge(self.catalog, located.name, inverse=located.inverse)
        return pattern(subject_node(), edge, self._meant(anchor))

    def _meant(self, anchor: str) -> ast.NodePattern:
        if anchor != PREVIOUS:
            return ast.NodePattern(meaning=parts.meaning(anchor))
        self._before = self._before or self.values.other(PREVIOUS).name
        return ast.NodePattern(variable=self._before)

    def _chain(self, before: Located, located: Located, anchor: str) -> ast.Expression:
        """ "On the table by the window": it may be the table that is by the window."""
        edges = tuple(relation_names.edge(self.catalog, one.name, inverse=one.inverse) for one in (before, located))
        nodes = (subject_node(), self._meant(before.anchors[-1] or self.wanted or "object"), self._meant(anchor))
        return ast.PatternCondition(pattern=ast.Pattern(nodes=nodes, edges=edges))

    # -- places -------------------------------------------------------------------------------------------------

    def _contains(self, label: str) -> ast.EdgePattern:
        """From a room to what it holds, through other places where the map nests them."""
        return ast.EdgePattern(labels=("contains",), max_hops=self.catalog.hops_to_objects(label))

    def _in_place(self, name: str) -> ast.Expression:
        label = self.catalog.room_label
        assert label is not None, "places that the store lacks have been put back into the text"
        rooms = [
            ast.NodePattern(label=label, properties=(("name", ast.Text(value=known)),)) for known in self._called(name)
        ]
        rooms = rooms or [ast.NodePattern(label=label, meaning=parts.meaning(name))]
        return parts.any_of([pattern(room, self._contains(label), subject_node()) for room in rooms])

    def _called(self, name: str) -> list[str]:
        """The store's rooms that go by this name ("living room": livingroom, living_room 2)."""
        asked, places = _squeezed(name), tuple(dict.fromkeys(self.setting.places))
        same = next((group for group in cues.SAME_ROOM if asked in group), frozenset((asked,)))
        exact = [place for place in places if _squeezed(place) == asked]
        return exact or [place for place in places if _squeezed(place).rstrip("0123456789") in same]

    def _names_place(self, wanted: str) -> bool:
        name = " ".join(singular(word.form) for word in words(wanted))
        return bool(wanted) and (bool(self._called(name)) or cues.rooms().only(name) is not None)


def _statement(
    subject: ast.Pattern, others: Sequence[ast.Pattern], conditions: Sequence[ast.Expression], form: Given
) -> ast.Query:
    return ast.Query(
        patterns=(subject, *others),
        where=parts.all_of(conditions) if conditions else None,
        distinct=form.distinct and bool(others),
        returns=form.returns,
        order=form.order,
        skip=form.skip,
        limit=form.limit,
    )


def _affords(affordance: Affordance) -> Iterable[ast.Expression]:
    held = ast.Property(variable=SUBJECT, name=PROPERTY)
    return (ast.Contains(text=held, part=ast.Text(value=name)) for name in affordance.names)


# -- texts ------------------------------------------------------------------------------------------------------


def _squeezed(name: str) -> str:
    return re.sub(r"[\W_]+", "", name.casefold())


def _whole(wanted: str, located: Sequence[Located]) -> str:
    """What is wanted with where it is, as it was written."""
    return cut(" ".join((wanted, *(part.text for part in located if not part.negated))))
