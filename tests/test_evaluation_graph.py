"""Nodes and edges against an annotated scene, and as people judge them."""

from __future__ import annotations

import dataclasses
import json
from pathlib import Path

import numpy as np
import pytest

from cgdb.errors import FormatError, SceneError, UsageError
from cgdb.ingest.evaluation.annotated import AnnotatedScene, read_annotated
from cgdb.ingest.evaluation.graph import evaluate_graph, is_called
from cgdb.ingest.evaluation.sheets import QUESTIONS, read_sheet, sheet, verdicts
from cgdb.ingest.relations.relate import with_geometry
from cgdb.scene import Relation, SceneGraph, SceneObject


def thing(known: int, x: float | None, *names: str, **more: object) -> SceneObject:
    """A cube of one metre at x."""
    box = {} if x is None else {"center": np.array([x, 0, 0.5]), "extent": np.ones(3)}
    return SceneObject(id=known, tag=names[0] if names else None, tags=names, **box, **more)  # type: ignore[arg-type]


def relation(source: int, label: str, target: int, **more: object) -> Relation:
    return Relation(source=source, label=label, target=target, **more)  # type: ignore[arg-type]


TRUTH = AnnotatedScene(
    objects=(thing(1, 0, "sofa", "couch"), thing(2, 3, "table"), thing(3, 6, "cup", "mug"), thing(4, 9, "lamp")),
    relations=(relation(3, "on", 2), relation(4, "on", 2), relation(1, "near", 2)),
)
MAP = SceneGraph(
    name="s",
    objects=(
        thing(10, 0.1, "red couch"),  # right: IoU .9 / 1.1
        thing(11, 0.5, "couch"),  # the same sofa again: IoU .5 / 1.5
        thing(12, 3.0, "desk"),  # the table, called otherwise
        thing(13, 6.2, "Mug"),  # right
        thing(14, 7.0, "vase"),  # nothing: too far from cup and lamp
        thing(15, 20, "wall", properties={"background": True}),
    ),
    relations=(
        relation(13, "on_top_of", 12),  # right: cup on table
        relation(13, "inside", 12),  # not so
        relation(14, "on", 12),  # of nothing
        relation(12, "next_to", 10),  # right, whichever way: sofa near table
        relation(11, "near", 12),  # right too, but the same relation of the truth
        relation(10, "facing", 12),  # of a label that the truth does not speak of
        relation(13, "on", 15),  # of the room, which is no node
    ),
)


def test_nodes_and_edges_by_hand() -> None:
    found = evaluate_graph(MAP, TRUTH)
    assert [(n.id, n.truth, n.right, n.duplicate) for n in found.nodes] == [
        (10, 1, True, False),
        (11, 1, True, True),
        (12, 2, False, False),
        (13, 3, True, False),
        (14, None, False, False),
    ]
    assert (found.valid, found.duplicates, found.objects, found.found) == (4, 1, 4, 3)
    assert found.precision == pytest.approx(3 / 5)
    # on: 13 on 12 right, 14 on 12 wrong; near: both right, one relation. "in" is not in the truth, so does not count.
    by = {count.label: (count.edges, count.right, count.truth, count.stated) for count in found.labels}
    assert by == {"on": (2, 1, 2, 1), "near": (2, 2, 1, 1)}
    assert found.edges.precision == pytest.approx(3 / 4) and found.edges.recall == pytest.approx(2 / 3)


def test_labels_that_are_asked_for_and_taken_for_others() -> None:
    found = evaluate_graph(MAP, TRUTH, labels=("on", "in"))
    assert (found.edges.edges, found.edges.right, found.edges.truth) == (3, 1, 2)
    merged = evaluate_graph(MAP, TRUTH, labels=("on",), same={"in": "on"})
    assert (merged.edges.edges, merged.edges.right) == (2, 1)  # 13 in 12 says the same as 13 on 12


def test_origin_confidence_and_names_that_do_not_count() -> None:
    edges = (relation(13, "on", 12, origin="llm", confidence=0.4), relation(14, "on", 12, origin="geometry"))
    scene = dataclasses.replace(MAP, relations=edges)
    assert evaluate_graph(scene, TRUTH, origins=("llm",)).edges.edges == 1
    assert evaluate_graph(scene, TRUTH, least_confidence=0.5).edges.right == 0
    without = evaluate_graph(scene, TRUTH, exclude=("desk", "table"))
    assert (len(without.nodes), without.objects, without.edges.edges) == (4, 3, 0)


def test_boxes_of_one_place_go_to_those_that_are_called_so() -> None:
    truth = AnnotatedScene(objects=(thing(1, 0, "bowl"), thing(2, 0.1, "fruit")), relations=())
    scene = SceneGraph(name="s", objects=(thing(8, 0.1, "bowl"), thing(9, 0.0, "fruit")))
    assert [(n.truth, n.right, n.duplicate) for n in evaluate_graph(scene, truth).nodes] == [
        (1, True, False),
        (2, True, False),
    ]


def test_without_boxes_ids_are_compared() -> None:
    truth = AnnotatedScene(objects=(thing(1, None, "sofa"), thing(2, None, "table")), relations=(relation(1, "on", 2),))
    scene = SceneGraph(name="s", objects=(thing(1, 0, "sofa"), thing(3, 5, "rug")), relations=(relation(1, "on", 3),))
    found = evaluate_graph(scene, truth)
    assert (found.valid, found.precision, found.edges.precision, found.edges.recall) == (1, 0.5, 0.0, 0.0)
    with pytest.raises(UsageError, match="no id in common"):
        evaluate_graph(SceneGraph(name="s", objects=(thing(7, 0, "sofa"),)), truth)


def test_what_a_node_is_called() -> None:
    assert is_called(thing(1, 0, "wooden Chair"), ("chair",))
    assert not is_called(thing(1, 0, "armchair"), ("chair",)) and not is_called(thing(1, 0, "chair leg"), ("chair",))
    assert is_called(SceneObject(id=1, caption="A blue chair, by the wall."), ("chair",))
    assert not is_called(SceneObject(id=1), ("chair",))


def test_a_map_without_anything_has_no_figures() -> None:
    found = evaluate_graph(SceneGraph(name="s"), TRUTH)
    assert (found.precision, found.edges.precision, found.edges.recall, found.found) == (None, None, 0.0, 0)


def test_relations_from_boxes_against_a_simulated_flat(data: Path) -> None:
    truth = read_annotated(data / "maps" / "virtualhome" / "TestScene3_graph.json")
    alone = SceneGraph(name="s", objects=truth.objects, up="y")
    found = evaluate_graph(
        with_geometry(alone), truth, labels=("on", "in"), same={"in": "on"}, exclude=("wall", "floor", "ceiling")
    )
    # benchmarks/relations.py counts the same: 168 true, precision .855, recall .946
    assert found.edges.truth == 168 and found.edges.precision is not None and found.edges.recall is not None
    assert found.edges.precision > 0.8 and found.edges.recall > 0.9
    assert found.precision == 1.0 and found.duplicates == 0


# -- people


def filled(text: str, answers: dict[tuple[object, ...], bool]) -> dict[str, object]:
    document: dict[str, object] = json.loads(text)
    for scene in document["scenes"]:  # type: ignore[attr-defined]
        for node in scene["nodes"]:
            node.update({q: answers.get((q, node["id"]), node[q]) for q in QUESTIONS})
        for edge in scene["edges"]:
            edge["right"] = answers.get((edge["source"], edge["label"], edge["target"]), edge["right"])
    return document


def test_the_majority_decides(tmp_path: Path) -> None:
    text = sheet([MAP], lambda r: r.label in ("on", "on_top_of"))
    blank = json.loads(text)
    assert [n["id"] for n in blank["scenes"][0]["nodes"]] == [10, 11, 12, 13, 14]
    assert [e["says"] for e in blank["scenes"][0]["edges"]] == [
        "Mug (#13) on top of desk (#12)",
        "vase (#14) on desk (#12)",
    ]
    edge, other = (13, "on_top_of", 12), (14, "on", 12)
    people = [
        {("label_right", 10): True, ("label_right", 12): False, ("object", 10): True, edge: True, other: False},
        {("label_right", 10): True, ("label_right", 12): True, ("object", 10): True, edge: True},
        {("label_right", 10): False, ("duplicate", 11): True, ("object", 12): False, edge: False},
    ]
    paths = []
    for number, answers in enumerate(people):
        paths.append(tmp_path / f"{number}.json")
        paths[-1].write_text(json.dumps(filled(text, answers)), "utf-8")
    (found,) = verdicts([read_sheet(path) for path in paths], {"s": MAP})
    # Labels: 10 two of three, 12 a tie, which is a no; the other three nobody judged.
    assert (found.people, found.nodes, found.node_answers, found.right) == (3, 5, 2, 1)
    assert (found.node_precision, found.valid, found.duplicates) == (0.5, 1, 1)
    assert (found.edges, found.edge_answers, found.edges_right, found.edge_precision) == (2, 2, 1, 0.5)
    # Pairs: label 10: 1 of 3, label 12: 0 of 1, object 10: 1 of 1, the edge: 1 of 3
    assert found.agreement == pytest.approx(3 / 8)


def test_a_blank_sheet_says_nothing() -> None:
    (found,) = verdicts([json.loads(sheet([MAP], lambda r: True))], {"s": MAP})
    assert (found.node_precision, found.edge_precision, found.agreement) == (None, None, None)


NODES = '{"format": "cgdb graph sheet 1", "scenes": [{"scene": "s", "edges": [], "nodes": [%s]}]}'


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ('{"format": "x"}', "is no sheet"),
        ("[]", "is no sheet"),
        ('{"format": "cgdb graph sheet 1", "scenes": 5}', "no list of scenes"),
        ('{"format": "cgdb graph sheet 1", "scenes": [{"scene": "s"}]}', "no list of nodes"),
        (NODES % '{"id": 10, "object": 1}', "node 0: 'object' must be true"),
        (NODES % "{}", "node 0"),
        ("{", "not whole JSON"),
    ],
)
def test_sheets_that_are_none(tmp_path: Path, text: str, says: str) -> None:
    (tmp_path / "a.json").write_text(text, "utf-8")
    with pytest.raises((FormatError, SceneError), match=says) as caught:
        read_sheet(tmp_path / "a.json")
    assert str(tmp_path) in caught.value.message


def test_a_sheet_of_another_map_is_refused() -> None:
    other = dataclasses.replace(MAP, objects=MAP.objects[1:], relations=())
    with pytest.raises(SceneError, match="node #10"):
        verdicts([json.loads(sheet([MAP], lambda r: True))], {"s": other})
