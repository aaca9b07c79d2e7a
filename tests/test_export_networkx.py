"""Scenes as networkx graphs, node-link JSON and GraphML, read back by networkx itself."""

from __future__ import annotations

import io
import json
from pathlib import Path

import networkx
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from cgdb.errors import ExportError
from cgdb.export import document, dumps, to_networkx
from cgdb.ingest import scene_json
from cgdb.scene import FeatureSpace, Place, Relation, SceneGraph, SceneObject

SCENE = SceneGraph(
    name="lab",
    objects=(
        SceneObject(
            id=1,
            tag="cup",
            tags=("mug", "glass"),
            caption="a cup",
            center=np.array([0.5, 1.0, 2.0]),
            extent=np.array([0.1, 0.1, 0.2]),
            n_observations=3,
            confidence=0.75,
            properties={"color": "blue", "affordances": ("drink", "hold"), "clean": True, "age": None},
        ),
        SceneObject(id="t", tag="table"),
    ),
    places=(Place(id=9, kind="Room", name="Kitchen"),),
    relations=(
        Relation(source=1, target="t", label="on", confidence=0.5, explanation="it stands there", origin="llm"),
        Relation(source=1, target="t", label="near"),
        Relation(source=9, target=1, label="contains"),
    ),
)


def test_nodes_and_edges() -> None:
    graph = to_networkx(SCENE)
    assert isinstance(graph, networkx.MultiDiGraph)
    assert graph.graph["name"] == "lab"
    assert dict(graph.nodes["t"]) == {"kind": "Object", "tag": "table"}
    assert dict(graph.nodes[9]) == {"kind": "Room", "name": "Kitchen"}
    assert graph.nodes[1] == {
        "kind": "Object",
        "tag": "cup",
        "tags": ["mug", "glass"],
        "caption": "a cup",
        "center": [0.5, 1.0, 2.0],
        "extent": [0.1, 0.1, 0.2],
        "n_observations": 3,
        "confidence": 0.75,
        "properties": {"color": "blue", "affordances": ["drink", "hold"], "clean": True, "age": None},
    }
    assert [data["label"] for _, _, data in graph.out_edges(1, data=True)] == ["on", "near"]
    assert graph.edges[1, "t", 0] == {
        "label": "on",
        "confidence": 0.5,
        "origin": "llm",
        "explanation": "it stands there",
    }
    assert list(graph.predecessors(1)) == [9]


def test_node_link_is_read_by_networkx(tmp_path: Path) -> None:
    flat = scene_json.read(Path(__file__).parent.parent / "cli" / "flat.json")
    for scene in (SCENE, flat, SceneGraph(name="empty")):
        found = json.loads(dumps(scene, "node-link"))
        assert list(found) == ["directed", "multigraph", "graph", "nodes", "links"]
        again = networkx.node_link_graph(found, edges="links")
        expected = to_networkx(scene)
        assert networkx.utils.graphs_equal(again, expected)
        assert again.graph == expected.graph
        assert isinstance(again, networkx.MultiDiGraph)


def test_graphml_is_read_by_networkx() -> None:
    again = networkx.read_graphml(io.BytesIO(dumps(SCENE, "graphml").encode()), force_multigraph=True)
    assert set(again.nodes) == {"1", "t", "9"}
    assert again.nodes["1"] == {
        "kind": "Object",
        "tag": "cup",
        "tags": "mug; glass",
        "caption": "a cup",
        "center_x": 0.5,
        "center_y": 1.0,
        "center_z": 2.0,
        "extent_x": 0.1,
        "extent_y": 0.1,
        "extent_z": 0.2,
        "n_observations": 3,
        "confidence": 0.75,
        "property_color": "blue",
        "property_affordances": "drink; hold",
        "property_clean": True,
    }
    assert sorted(data["label"] for *_, data in again.edges(data=True)) == ["contains", "near", "on"]
    assert again.graph["name"] == "lab"


@given(st.text(max_size=30), st.text(max_size=10))
@settings(max_examples=100, deadline=None)
def test_any_text_makes_xml_that_can_be_read(caption: str, label: str) -> None:
    obj = SceneObject(id=1, caption=caption, properties={"é": caption, "n": 2**70})
    scene = SceneGraph(name="s" + caption, objects=(obj,), relations=(Relation(source=1, target=1, label="x" + label),))
    again = networkx.read_graphml(io.BytesIO(dumps(scene, "graphml").encode()))
    lines = caption.replace("\r\n", "\n").replace("\r", "\n")
    assert again.nodes["1"].get("caption", "") == "".join(
        c for c in lines if c in "\t\n" or " " <= c not in "\ufffe\uffff"
    )


def test_forbidden_characters_are_dropped() -> None:
    obj = SceneObject(id=1, caption="a\x00b\x1b[31mred\ud800 \ufffe& <b>'\"")
    again = networkx.read_graphml(io.BytesIO(dumps(SceneGraph(name="s", objects=(obj,)), "graphml").encode()))
    assert again.nodes["1"]["caption"] == "ab[31mred & <b>'\""


def test_ids_that_xml_cannot_tell_apart() -> None:
    scene = SceneGraph(name="s", objects=(SceneObject(id="a\x01"), SceneObject(id="a\x02")))
    with pytest.raises(ExportError, match="the same"):
        dumps(scene, "graphml")


def test_a_note_says_that_vectors_stay_behind() -> None:
    obj = SceneObject(id=1, features={"clip": np.ones(3, np.float32)})
    scene = SceneGraph(name="s", objects=(obj,), spaces=(FeatureSpace(name="clip", dimension=3),))
    for format in ("node-link", "graphml"):
        assert "feature vectors" in document(scene, format).notes[0]
    assert document(scene, "cgdb").notes == ()
