"""Conditions asked less strictly, for when nothing fits as they were said.

Boxes miss what people see: a lamp that stands on the table by the bed is by the bed, books in a shelf are on it, and
of walls, sills and what is in a vase most maps say nothing. What is excluded by its kind may be meant by its name:
"something to write with, other than a pen" may be a marker, which the table has for a kind of pen.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

from cgdb.english import relation_names
from cgdb.english import tree_parts as parts
from cgdb.english.anchor_kinds import is_side, seldom_mapped
from cgdb.english.intent import Located, Setting
from cgdb.english.phrases import words
from cgdb.english.tree_parts import pattern, similar, subject_node
from cgdb.grammar import ast
from cgdb.index.catalog import Catalog
from cgdb.meaning import everyday
from cgdb.meaning.knowledge import knowledge
from cgdb.meaning.words import query_words, singular

MOST_KINDS = 6
"""Kinds of an excluded thing that may be meant by their own names."""

_ALSO: Mapping[str, tuple[str, ...]] = {
    "on": ("on", "in"),
    "in": ("in", "on"),
    "attached": ("attached", "on", "in", "next_to", "near"),
    "under": ("under", "near", "next_to"),
    "above": ("above", "near", "next_to"),
    "next_to": ("next_to", "near", "on", "in"),
    "near": ("near", "next_to", "on", "in"),
    "front": ("front", "next_to", "near"),
    "behind": ("behind", "next_to", "near"),
    "between": ("next_to", "near"),
}
"""What a map may hold of each relation instead. "Under" and "on" never stand for each other."""
_FAMILIES = (everyday.COLORS, everyday.MATERIALS, *everyday.SCALES)
_BESIDE = ("next_to", "near", "front", "behind", "attached")
"""Relations that a thing shares with what it stands on: a lamp on the table by the bed is by the bed."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Looser:
    """What may be asked in place of a condition, nothing where there is no expression, and how that is said.

    absent: the things of which the map must know none, for the condition to be left out.
    """

    says: str
    expression: ast.Expression | None = None
    absent: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True, kw_only=True)
class Plain:
    """What is wanted without the traits that the map cannot tell, and how that is said."""

    wanted: str
    says: str


def of_wanted(wanted: str, setting: Setting) -> Plain | None:
    """Of a kind with traits, in a map of names that speak of no such traits: "a red mug" among things called mug."""
    known = knowledge()
    facets = known.facets(wanted)
    if setting.tells or not setting.words or facets.form != "kind" or not facets.traits:
        return None
    said = [known.traits[trait] for trait in facets.traits]
    for trait in said:
        family = next((group for group in _FAMILIES if trait in group), (trait,))
        spoken = {name for name, i in known.trait_by_name.items() if len(name) == 1 and known.traits[i] in family}
        if any(word in setting.words for (word,) in spoken):
            return None
    kind = [word.form for word in words(wanted) if singular(word.form) in facets.named]
    if not kind or known.facets(" ".join(kind)).kinds != facets.kinds:
        return None
    plain = " ".join(kind)
    return Plain(wanted=plain, says=f"{wanted}: the map holds names alone, which do not tell; taken for any {plain}")


def of_relation(
    catalog: Catalog, located: Located, condition: ast.Expression, meant: Mapping[str, ast.NodePattern]
) -> tuple[Looser, ...]:
    """Of where something is. meant: what each anchor means in the statement."""
    if located.negated:
        return ()
    found = []
    near = [one for anchor in meant.values() for one in _nearly(catalog, located, anchor)]
    if near and len(meant) == 1:
        says = f"{located.text}: no box says so; taken as close to it"
        found.append(Looser(says=says, expression=parts.any_of([condition, *near])))
    unsaid = [anchor for anchor in meant if located.inverse or seldom_mapped(anchor)]
    if unsaid and len(unsaid) == len(meant):
        # "The middle" means nothing by itself: that everything is it says nothing either.
        absent = tuple(anchor for anchor in unsaid if query_words(anchor))
        held = relation_names.any_of(catalog, ("on", "in"))
        if held is None or located.inverse or located.name not in ("on", "attached") or not any(map(is_side, unsaid)):
            found.append(Looser(says=f"{located.text}: the map does not tell, and was not asked", absent=absent))
        else:
            # A clock that stands on a table is on no wall.
            away = pattern(subject_node(), replace(held, direction=ast.Direction.OUT), ast.NodePattern())
            says = f"{located.text}: the map does not tell; taken as on nothing that it knows"
            found.append(Looser(says=says, expression=ast.Not(item=away), absent=absent))
    return tuple(found)


def of_denied(
    catalog: Catalog, located: Located, condition: ast.Expression, meant: Mapping[str, ast.NodePattern]
) -> Looser | None:
    """Of "not the one on the desk", which says that there is one there: what is denied in a wider sense."""
    near = [one for anchor in meant.values() for one in _nearly(catalog, located, anchor)]
    if not located.the_one or not near or len(meant) != 1 or not isinstance(condition, ast.Not):
        return None
    says = f"{located.text}: no box says so of any; what is close to it was left out"
    return Looser(says=says, expression=ast.Not(item=parts.any_of([condition.item, *near])))


def _nearly(catalog: Catalog, located: Located, anchor: ast.NodePattern) -> list[ast.Expression]:
    edges = relation_names.any_of(catalog, _ALSO.get(located.name, ()))
    if edges is None:
        return []
    one_way = located.name in ("on", "in", "under", "above")
    direction = (ast.Direction.IN if located.inverse else ast.Direction.OUT) if one_way else ast.Direction.ANY
    if located.name in ("under", "above"):
        direction = ast.Direction.ANY  # next_to and near are given once per pair
        strict = relation_names.edge(catalog, located.name, inverse=located.inverse)
        beside = relation_names.any_of(catalog, ("near", "next_to"))
        edges = beside or strict
    found = [pattern(subject_node(), ast.EdgePattern(labels=edges.labels, direction=direction), anchor)]
    on = relation_names.any_of(catalog, ("on", "in"))
    if on is not None and located.name in (*_BESIDE, "on") and not located.inverse:
        stands = ast.EdgePattern(labels=on.labels, direction=ast.Direction.OUT)
        then = ast.EdgePattern(labels=edges.labels, direction=direction)
        nodes = (subject_node(), ast.NodePattern(), anchor)
        found.append(ast.PatternCondition(pattern=ast.Pattern(nodes=nodes, edges=(stands, then))))
    return found


def of_exclusion(text: str, condition: ast.Expression) -> tuple[Looser, ...]:
    """Of a kind that is excluded where what is wanted is named by its use: another sort, with its own name."""
    known = knowledge()
    facets = known.facets(text)
    if facets.form != "kind" or facets.traits:
        return ()
    own = [
        known.names[i]
        for i in range(known.n_lines, len(known.names))
        if any(known.parents[i, kind] for kind in facets.kinds) and not facets.named & set(known.names[i].split())
    ]
    if not own:
        return ()
    says = f"other than {text}: only what is so called is left out, for all that would serve is of that kind"
    return (Looser(says=says, expression=parts.any_of([condition, *map(similar, own[:MOST_KINDS])])),)
