"""cgdb's scene JSON: what is written is read back bit by bit, and what is malformed is refused by name."""

from __future__ import annotations

import base64
import json
import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as arrays

import cgdb.ingest
from cgdb.errors import CgdbError, ExportError, FormatError, SceneError
from cgdb.export import dumps
from cgdb.ingest import scene_json
from cgdb.scene import (
    ORIGINS,
    UP_AXES,
    FeatureSpace,
    ObjectId,
    Place,
    Relation,
    SceneGraph,
    SceneObject,
    View,
    canonical_id,
    check_scene,
)

Json = dict[str, Any]

TEXT = st.text(max_size=20)
NAMES = st.from_regex(r"[a-z_][a-z0-9_]{0,8}", fullmatch=True)
IDS = st.one_of(st.integers(0, 2**63 - 1), st.text(min_size=1, max_size=10)).map(canonical_id)
UNIT = st.floats(0.0, 1.0)
FINITE = st.floats(allow_nan=False, allow_infinity=False)
SCALARS = st.one_of(TEXT, st.integers(-(2**70), 2**70), FINITE, st.booleans())
VALUES = st.one_of(st.none(), SCALARS, st.lists(SCALARS, max_size=3).map(tuple))
PROPERTIES: st.SearchStrategy[Any] = st.dictionaries(NAMES, VALUES, max_size=3)
JSON_VALUES = st.recursive(
    st.one_of(st.none(), SCALARS),
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(TEXT, inner, max_size=3),
    max_leaves=5,
)


def coordinates(low: float) -> st.SearchStrategy[Any]:
    return arrays.arrays(np.float64, (3,), elements=st.floats(low, 1e7))


def rotations() -> st.SearchStrategy[Any]:
    def about_z(angle: float) -> Any:
        c, s = math.cos(angle), math.sin(angle)
        return np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])

    return st.floats(-10.0, 10.0).map(about_z)


def floats32(shape: tuple[int, ...]) -> st.SearchStrategy[Any]:
    return arrays.arrays(np.float32, shape, elements=st.floats(allow_nan=False, allow_infinity=False, width=32))


@st.composite
def objects(draw: st.DrawFn, object_id: ObjectId, spaces: tuple[FeatureSpace, ...]) -> SceneObject:
    has_box = draw(st.booleans())
    n_points = draw(st.none() | st.integers(0, 9))
    colored = n_points is not None and draw(st.booleans())
    chosen = [space for space in spaces if draw(st.booleans())]
    return SceneObject(
        id=object_id,
        tag=draw(st.none() | TEXT),
        tags=tuple(draw(st.lists(TEXT, max_size=3))),
        caption=draw(st.none() | TEXT),
        center=draw(coordinates(-1e7)) if has_box else None,
        extent=draw(st.none() | coordinates(0.0)) if has_box else None,
        rotation=draw(st.none() | rotations()) if has_box else None,
        features={space.name: draw(floats32((space.dimension,))) for space in chosen},
        points=None if n_points is None else draw(floats32((n_points, 3))),
        colors=draw(arrays.arrays(np.uint8, (n_points, 3))) if colored and n_points is not None else None,
        n_observations=draw(st.none() | st.integers(0, 2**40)),
        confidence=draw(st.none() | UNIT),
        properties=draw(PROPERTIES),
        views=tuple(draw(st.lists(views(), max_size=2))),
    )


@st.composite
def views(draw: st.DrawFn) -> View:
    pose = np.eye(4)
    pose[:3, :3], pose[:3, 3] = draw(rotations()), draw(coordinates(-1e7))
    left, right = sorted(draw(st.tuples(st.floats(-1e6, 1e6), st.floats(-1e6, 1e6))))
    return View(
        frame=draw(st.integers(0, 2**63 - 1)),
        points=draw(st.integers(0, 2**40)),
        box=(left, -0.0, right, draw(st.floats(0.0, 1e6))),
        T_world_camera=draw(st.none() | st.just(pose)),
        image=draw(st.none() | st.binary(max_size=50).map(lambda data: b"\xff\xd8\xff" + data)),
        source=draw(st.none() | st.text(min_size=1, max_size=9)),
    )


@st.composite
def scenes(draw: st.DrawFn) -> SceneGraph:
    names = draw(st.lists(NAMES, max_size=2, unique=True))
    spaces = tuple(
        FeatureSpace(name=name, dimension=draw(st.integers(1, 40)), encoder=draw(st.none() | TEXT)) for name in names
    )
    ids = draw(st.lists(IDS, max_size=5, unique=True))
    n_objects = draw(st.integers(0, len(ids)))
    places = tuple(
        Place(
            id=place_id,
            kind=draw(st.sampled_from(["Room", "Place", "Étage"])),
            name=draw(st.none() | TEXT),
            center=draw(st.none() | coordinates(-1e7)),
            properties=draw(PROPERTIES),
        )
        for place_id in ids[n_objects:]
    )
    relation = st.builds(
        Relation,
        source=st.sampled_from(ids),
        target=st.sampled_from(ids),
        label=st.text(min_size=1, max_size=10),
        confidence=UNIT,
        explanation=st.none() | TEXT,
        origin=st.sampled_from(ORIGINS),
    )
    scene = SceneGraph(
        name=draw(st.text(st.characters(exclude_characters="\x00", exclude_categories=["Cs"]), min_size=1, max_size=9)),
        objects=tuple(draw(objects(i, spaces)) for i in ids[:n_objects]),
        relations=tuple(draw(st.lists(relation, max_size=4))) if ids else (),
        places=places,
        frame=draw(TEXT),
        up=draw(st.sampled_from(UP_AXES)),
        spaces=spaces,
        provenance=draw(st.dictionaries(TEXT, JSON_VALUES, max_size=3)),
    )
    check_scene(scene)
    return scene


def plain(value: Any) -> Any:
    """The value as what can be compared, types and bits included: 1 is not 1.0, and 0.0 is not -0.0."""
    if isinstance(value, np.ndarray):
        return (value.dtype.str, value.shape, value.tobytes())
    if hasattr(value, "__slots__"):
        return {name: plain(getattr(value, name)) for name in type(value).__slots__}
    if isinstance(value, dict):
        return {key: plain(item) for key, item in value.items()}
    if isinstance(value, (tuple, list)):
        return (type(value).__name__, [plain(item) for item in value])
    return (type(value).__name__, repr(value))


@given(scenes())
@settings(max_examples=50, deadline=None)
def test_every_scene_comes_back_bit_by_bit(scene: SceneGraph) -> None:
    text = dumps(scene)
    again = scene_json.from_document(json.loads(text))
    assert plain(again) == plain(scene)
    assert dumps(again) == text


@given(floats32((3,)))
@settings(max_examples=100, deadline=None)
def test_short_float32_lists_are_exact(vector: Any) -> None:
    scene = SceneGraph(
        name="s",
        objects=(SceneObject(id=0, features={"v": vector}),),
        spaces=(FeatureSpace(name="v", dimension=3),),
    )
    document = json.loads(dumps(scene))
    assert isinstance(document["objects"][0]["features"]["v"], list)
    assert scene_json.from_document(document).objects[0].features["v"].tobytes() == vector.tobytes()


def test_the_order_of_mappings_does_not_change_the_bytes() -> None:
    def scene(keys: str) -> SceneGraph:
        vectors = {key: np.ones(2, np.float32) for key in keys}
        obj = SceneObject(id=0, properties=dict.fromkeys(keys, 1), features=vectors)
        spaces = tuple(FeatureSpace(name=key, dimension=2) for key in "ab")
        return SceneGraph(name="s", objects=(obj,), spaces=spaces, provenance=dict.fromkeys(keys, 1))

    assert dumps(scene("ab")) == dumps(scene("ba"))


def test_the_layout_is_one_record_per_line_and_leaves_out_what_is_unknown() -> None:
    scene = SceneGraph(
        name="lab",
        objects=(SceneObject(id=3, tag="cup", center=np.array([0.1, 2.0, -1.5])), SceneObject(id="a")),
        relations=(Relation(source=3, target="a", label="on"),),
        places=(Place(id=9, kind="Room", name="Küche"),),
    )
    assert dumps(scene).splitlines() == [
        "{",
        '"cgdb_scene": 1,',
        '"name": "lab",',
        '"frame": "map",',
        '"up": "z",',
        '"spaces": [],',
        '"provenance": {},',
        '"objects": [',
        '  {"id": 3, "tag": "cup", "center": [0.1, 2.0, -1.5]},',
        '  {"id": "a"}',
        "],",
        '"places": [',
        '  {"id": 9, "kind": "Room", "name": "Küche"}',
        "],",
        '"relations": [',
        '  {"source": 3, "label": "on", "target": "a", "confidence": 1.0, "origin": "imported"}',
        "]",
        "}",
    ]


def test_long_vectors_may_be_lists_and_short_ones_bytes() -> None:
    document = minimal()
    document["spaces"] = [{"name": "v", "dimension": 40}, {"name": "w", "dimension": 2}]
    packed = base64.b64encode(np.array([1, 2], "<f4").tobytes()).decode()
    document["objects"][0]["features"] = {
        "v": [0.5] * 40,
        "w": {"dtype": "<f4", "shape": [2], "data": packed},
    }
    features = scene_json.from_document(document).objects[0].features
    assert features["v"].tolist() == [0.5] * 40
    assert features["w"].tolist() == [1.0, 2.0]
    assert features["w"].dtype == np.float32


def test_a_scene_with_views_is_version_2_and_one_without_stays_version_1() -> None:
    view = View(frame=3, points=9, box=(1.0, 2.0, 30.5, 40.0), image=b"\xff\xd8\xff\x00", source="f.jpg")
    without, scene = (SceneGraph(name="s", objects=(SceneObject(id=7, views=v),)) for v in ((), (view,)))
    assert json.loads(dumps(without))["cgdb_scene"] == 1
    document = json.loads(dumps(scene))
    assert document["cgdb_scene"] == 2
    assert document["objects"][0]["views"] == [
        {"frame": 3, "points": 9, "box": [1.0, 2.0, 30.5, 40.0], "source": "f.jpg", "image": "/9j/AA=="}
    ]
    assert plain(scene_json.from_document(document | {"cgdb_scene": 1})) == plain(scene)  # each field says itself


def test_a_name_given_wins_over_the_files_own(tmp_path: Path) -> None:
    path = tmp_path / "x.json"
    path.write_text(json.dumps(minimal()), encoding="utf-8")
    assert scene_json.read(path, None).name == "s"
    assert scene_json.read(path, "other").name == "other"


def test_matches_looks_at_the_top_level() -> None:
    assert scene_json.matches({"cgdb_scene": 99})
    assert not scene_json.matches([{"cgdb_scene": 1}])
    assert not scene_json.matches({"objects": []})


def minimal() -> Json:
    return {"cgdb_scene": 1, "name": "s", "objects": [{"id": 7}, {"id": 8}]}


def packed(dtype: str = "<f4", shape: Any = (1, 3), data: Any = None) -> Json:
    return {"dtype": dtype, "shape": shape, "data": base64.b64encode(bytes(12)).decode() if data is None else data}


def a_view(**change: Any) -> Json:
    return {"objects": [{"id": 7, "views": [{"frame": 1, "points": 2, "box": [1, 2, 3, 4], **change}]}]}


MALFORMED: list[tuple[str, Json, str]] = [
    ("newer version", {"cgdb_scene": 3}, "version 3"),
    ("no version", {"cgdb_scene": "1"}, "format version"),
    ("true is no version", {"cgdb_scene": True}, "format version"),
    ("unknown field", {"objekts": []}, "unknown field 'objekts'"),
    ("no name", {"name": None}, "has no 'name'"),
    ("name of another type", {"name": 3}, "'name' must be text"),
    ("empty name", {"name": ""}, "1 to 256 characters"),
    ("unknown up axis", {"up": "w"}, "up axis"),
    ("objects no list", {"objects": {"id": 1}}, "'objects' must be a list"),
    ("object no record", {"objects": [7]}, "object 0"),
    ("object without id", {"objects": [{"tag": "cup"}]}, "object 0: has no 'id'"),
    ("id of another type", {"objects": [{"id": 1.5}]}, "object 0: 'id'"),
    ("twice the same id", {"objects": [{"id": 7}, {"id": "7"}]}, "two nodes have the id #7"),
    ("object field unknown", {"objects": [{"id": 7, "captoin": "x"}]}, "object #7: unknown field 'captoin'"),
    ("caption no text", {"objects": [{"id": 7, "caption": ["x"]}]}, "object #7: 'caption'"),
    ("tags no list", {"objects": [{"id": 7, "tags": "cup"}]}, "object #7: 'tags'"),
    ("tags of numbers", {"objects": [{"id": 7, "tags": [1]}]}, "object #7: 'tags'"),
    ("center of two", {"objects": [{"id": 7, "center": [1, 2]}]}, "object #7: 'center' must hold a list of 3"),
    ("center of texts", {"objects": [{"id": 7, "center": ["1", 2, 3]}]}, "object #7: 'center' must be a number"),
    ("center of truths", {"objects": [{"id": 7, "center": [True, 2, 3]}]}, "object #7: 'center'"),
    ("center nested", {"objects": [{"id": 7, "center": [[1], 2, 3]}]}, "object #7: 'center'"),
    ("center infinite", {"objects": [{"id": 7, "center": [1e999, 2, 3]}]}, "object #7: 'center'"),
    ("center huge", {"objects": [{"id": 7, "center": [10**400, 2, 3]}]}, "object #7: 'center'"),
    ("center far away", {"objects": [{"id": 7, "center": [1e8, 2, 3]}]}, "object #7: center"),
    ("extent without center", {"objects": [{"id": 7, "extent": [1, 2, 3]}]}, "object #7"),
    ("negative extent", {"objects": [{"id": 7, "center": [1, 2, 3], "extent": [1, -2, 3]}]}, "object #7: extent"),
    ("count negative", {"objects": [{"id": 7, "n_observations": -1}]}, "object #7: 'n_observations'"),
    ("count fractional", {"objects": [{"id": 7, "n_observations": 1.5}]}, "object #7: 'n_observations'"),
    ("confidence above 1", {"objects": [{"id": 7, "confidence": 1.5}]}, "object #7: confidence"),
    ("confidence no number", {"objects": [{"id": 7, "confidence": "high"}]}, "object #7: 'confidence'"),
    ("properties no record", {"objects": [{"id": 7, "properties": []}]}, "object #7: 'properties'"),
    ("property nested", {"objects": [{"id": 7, "properties": {"a": {"b": 1}}}]}, "object #7: property 'a'"),
    ("property name", {"objects": [{"id": 7, "properties": {"a b": 1}}]}, "object #7: property name 'a b'"),
    ("undeclared space", {"objects": [{"id": 7, "features": {"clip": [1]}}]}, "object #7: has a feature"),
    ("features no record", {"objects": [{"id": 7, "features": [1]}]}, "object #7: 'features'"),
    ("points ragged", {"objects": [{"id": 7, "points": [[1, 2, 3], [1, 2]]}]}, "object #7: 'points'"),
    ("points flat", {"objects": [{"id": 7, "points": [1, 2, 3]}]}, "object #7: 'points'"),
    ("points beyond float32", {"objects": [{"id": 7, "points": [[1e300, 0, 0]]}]}, "object #7: points"),
    ("points a number", {"objects": [{"id": 7, "points": 3}]}, "object #7: 'points'"),
    ("colors without points", {"objects": [{"id": 7, "colors": [[1, 2, 3]]}]}, "object #7: has colors"),
    ("colors above 255", {"objects": [{"id": 7, "colors": [[256, 0, 0]]}]}, "object #7: 'colors'"),
    ("colors fractional", {"objects": [{"id": 7, "colors": [[0.5, 0, 0]]}]}, "object #7: 'colors'"),
    ("bytes of another type", {"objects": [{"id": 7, "points": packed("<f8")}]}, "object #7: 'points': 'dtype'"),
    ("objects as bytes", {"objects": [{"id": 7, "points": packed("|O")}]}, "object #7: 'points': 'dtype'"),
    ("wrong shape", {"objects": [{"id": 7, "points": packed(shape=[3, 1])}]}, "has shape [3, 1], expected (n, 3)"),
    ("absurd shape", {"objects": [{"id": 7, "points": packed(shape=[10**15, 3])}]}, "object #7: 'points'"),
    ("negative shape", {"objects": [{"id": 7, "points": packed(shape=[-1, 3])}]}, "object #7: 'points': 'shape'"),
    ("shape of truths", {"objects": [{"id": 7, "points": packed(shape=[True, 3])}]}, "'shape'"),
    ("shape no list", {"objects": [{"id": 7, "points": packed(shape=3)}]}, "object #7: 'points': 'shape'"),
    ("data too short", {"objects": [{"id": 7, "points": packed(data="AAAA")}]}, "needs 12 bytes"),
    ("data padded", {"objects": [{"id": 7, "points": packed(data="A" * 15 + "=")}]}, "needs 12 bytes"),
    ("data no base64", {"objects": [{"id": 7, "points": packed(data="!" * 16)}]}, "not base64"),
    ("data no text", {"objects": [{"id": 7, "points": packed(data=5)}]}, "base64 text"),
    ("space no dimension", {"spaces": [{"name": "v"}]}, "space 0: 'dimension'"),
    ("space dimension 0", {"spaces": [{"name": "v", "dimension": 0}]}, "space 0: 'dimension'"),
    ("space twice", {"spaces": [{"name": "v", "dimension": 1}] * 2}, "declared twice"),
    ("space no name", {"spaces": [{"dimension": 3}]}, "space 0: has no 'name'"),
    (
        "feature of another dimension",
        {"spaces": [{"name": "v", "dimension": 3}], "objects": [{"id": 7, "features": {"v": [1.0]}}]},
        "object #7: feature 'v' must hold a list of 3, not one of 1",
    ),
    (
        "feature null",
        {"spaces": [{"name": "v", "dimension": 3}], "objects": [{"id": 7, "features": {"v": None}}]},
        "object #7: feature 'v' is null",
    ),
    ("views no list", {"objects": [{"id": 7, "views": {}}]}, "object #7: 'views' must be a list"),
    ("views of numbers", {"objects": [{"id": 7, "views": [1]}]}, "object #7: 'views' must be a list"),
    ("views without end", {"objects": [{"id": 7, "views": [{}] * 101}]}, "at most 100 views, not a list of 101"),
    ("view field unknown", a_view(pose=[1]), "object #7: view 1: unknown field 'pose'"),
    ("view without frame", a_view(frame=None), "object #7: view 1: has no 'frame'"),
    ("view without box", a_view(box=None), "object #7: view 1: has no 'box'"),
    ("view of half a frame", a_view(frame=0.5), "object #7: view 1: 'frame' must be a count"),
    ("view with points below 0", a_view(points=-1), "object #7: view 1: 'points' must be a count"),
    ("view box of three", a_view(box=[1, 2, 3]), "object #7: view 1: 'box' must hold a list of 4"),
    ("view box turned", a_view(box=[5, 2, 3, 4]), "object #7: view 1: box"),
    ("view box infinite", a_view(box=[1, 2, 1e999, 4]), "object #7: view 1: 'box'"),
    ("view pose of nine", a_view(T_world_camera=[[1, 0, 0]] * 3), "object #7: view 1: 'T_world_camera'"),
    (
        "view pose NaN",
        a_view(T_world_camera=packed("<f8", [4, 4], base64.b64encode(b"\xff" * 128).decode())),
        "object #7: view 1: T_world_camera is not a finite",
    ),
    ("view pose scaled", a_view(T_world_camera=(2 * np.eye(4)).tolist()), "object #7: view 1: the last row"),
    ("image no base64", a_view(image="/9j/!"), "object #7: view 1: 'image' is not base64"),
    ("image half a group", a_view(image="/9j/4"), "object #7: view 1: 'image' is not base64"),
    ("image no text", a_view(image=[1]), "object #7: view 1: 'image' must be text"),
    ("image of another kind", a_view(image="R0lGODlh"), "object #7: view 1: its image is neither JPEG nor PNG"),
    ("image empty", a_view(image=""), "object #7: view 1: its image is neither"),
    ("image too large", a_view(image="/9j/" + "A" * 2**20), "object #7: view 1: 'image' is larger than 524,288"),
    ("view source a number", a_view(source=1), "object #7: view 1: 'source' must be text"),
    ("place without id", {"places": [{"kind": "Room"}]}, "place 0: has no 'id'"),
    ("place kind Object", {"places": [{"id": 1, "kind": "Object"}]}, "place #1: kind"),
    ("relation to nothing", {"relations": [{"source": 7, "target": 9, "label": "on"}]}, "no object or place #9"),
    ("relation without label", {"relations": [{"source": 7, "target": 8}]}, "relation 0: has no 'label'"),
    ("relation origin", {"relations": [{"source": 7, "target": 8, "label": "on", "origin": "x"}]}, "origin 'x'"),
    ("relation no source", {"relations": [{"target": 8, "label": "on"}]}, "relation 0: has no 'source'"),
    ("provenance no record", {"provenance": [1]}, "'provenance'"),
    ("provenance infinite", {"provenance": {"a": [1e999]}}, "'provenance'"),
]


@pytest.mark.parametrize(("change", "message"), [c[1:] for c in MALFORMED], ids=[c[0] for c in MALFORMED])
def test_what_is_malformed_is_refused_by_name(tmp_path: Path, change: Json, message: str) -> None:
    path = tmp_path / "bad.json"
    path.write_text(json.dumps(minimal() | change).replace("Infinity", "1e999"), encoding="utf-8")
    with pytest.raises((FormatError, SceneError)) as caught:
        scene_json.read(path, None)
    assert message in caught.value.message
    assert str(path) in caught.value.message
    assert "\n" not in caught.value.message
    assert len(caught.value.message) < 400 + len(str(path))


@pytest.mark.parametrize(
    "content",
    [
        b"",
        b"{",
        b"[]",
        b"null",
        b'{"cgdb_scene": 1, "name": "s", "objects": [{"id": 1, "center": [NaN, 0, 0]}]}',
        b'{"cgdb_scene": 1, "name": "\xff"}',
        b'{"cgdb_scene": 1, "name": "s", "provenance": ' + b'{"a":' * 100_000 + b"1" + b"}" * 100_000 + b"}",
        b'{"cgdb_scene": ' + b"9" * 10_000 + b"}",
    ],
    ids=["empty", "cut", "list", "null", "NaN", "not utf-8", "nested", "long number"],
)
def test_files_that_are_no_scene(tmp_path: Path, content: bytes) -> None:
    path = tmp_path / "bad.json"
    path.write_bytes(content)
    with pytest.raises(FormatError, match=r"bad\.json"):
        scene_json.read(path, None)


def test_files_that_are_not_there(tmp_path: Path) -> None:
    for path in (tmp_path / "none.json", tmp_path):
        with pytest.raises(FormatError):
            scene_json.read(path, None)


REAL_MAPS = [
    "conceptgraphs/room0_planner.json",
    "conceptgraphs/ali-dev/pcd_r_mapping_sample.pkl.gz",
    "conceptgraphs/main/full_pcd_sample_post.pkl.gz",
    "hydra/apartment_dsg.json",
    "virtualhome/TestScene3_graph.json",
]


@pytest.mark.parametrize("name", REAL_MAPS)
def test_real_maps_come_back_bit_by_bit(data: Path, name: str) -> None:
    scene = cgdb.ingest.load(data / "maps" / name, relate=False)
    assert scene.objects
    text = dumps(scene)
    again = scene_json.from_document(json.loads(text))
    assert plain(again) == plain(scene)
    assert dumps(again) == text


def test_a_misspelled_field_has_a_hint() -> None:
    with pytest.raises(FormatError) as caught:
        scene_json.from_document(minimal() | {"objects": [{"id": 1, "captoin": "x"}]})
    assert caught.value.hint == "did you mean 'caption'?"


JUNK = st.recursive(
    st.one_of(st.none(), st.booleans(), st.integers(), st.floats(), st.text(max_size=5)),
    lambda inner: (
        st.lists(inner, max_size=4)
        | st.dictionaries(st.sampled_from(["dtype", "shape", "data", "id", "a"]), inner, max_size=4)
    ),
    max_leaves=6,
)
OBJECT_FIELDS = ["id", "tag", "tags", "caption", "center", "extent", "rotation", "n_observations", "confidence"]


@given(
    st.fixed_dictionaries(
        {"cgdb_scene": st.just(1), "name": st.just("s")},
        optional={
            "spaces": st.just([{"name": "a", "dimension": 2}]) | JUNK,
            "objects": st.lists(
                st.dictionaries(
                    st.sampled_from([*OBJECT_FIELDS, "properties", "features", "points", "colors", "views"]),
                    JUNK,
                    max_size=5,
                ),
                max_size=2,
            ),
            "places": JUNK,
            "relations": JUNK,
            "provenance": JUNK,
        },
    )
)
@settings(max_examples=100, deadline=None)
def test_junk_is_refused_or_read_and_nothing_else(document: Json) -> None:
    try:
        scene = scene_json.from_document(document)
    except (FormatError, SceneError):
        return
    check_scene(scene)
    assert plain(scene_json.from_document(json.loads(dumps(scene)))) == plain(scene)


@pytest.mark.parametrize(
    "provenance",
    [{"a": object()}, {"a": math.nan}, {1: "a"}, {"a": np.float32(1)}, {"a": Path("x")}],
    ids=["object", "nan", "number key", "numpy scalar", "path"],
)
def test_provenance_that_json_would_change_is_not_written(provenance: Any) -> None:
    with pytest.raises(ExportError, match="provenance"):
        dumps(SceneGraph(name="s", provenance=provenance))


def test_provenance_in_a_circle_is_not_written() -> None:
    circle: Json = {}
    circle["again"] = circle
    with pytest.raises(CgdbError, match="deep"):
        dumps(SceneGraph(name="s", provenance=circle))


def test_half_a_surrogate_pair_survives(tmp_path: Path) -> None:
    scene = SceneGraph(name="s", objects=(SceneObject(id=1, caption="broken \ud83d emoji"),))
    path = tmp_path / "s.json"
    path.write_text(dumps(scene), encoding="utf-8")
    assert scene_json.read(path, None).objects[0].caption == "broken \ud83d emoji"
