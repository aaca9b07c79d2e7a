"""ConceptGraphs' own maps: both branches, the cache folder with its two kinds of ids, and the pairs of JSON files."""

from __future__ import annotations

import gzip
import json
import pickle
import uuid
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from cgdb import ingest
from cgdb.errors import FormatError, SceneError
from cgdb.ingest import corners
from cgdb.ingest.report import Report
from cgdb.scene import SceneGraph

SIGNS = np.array([[-1, -1, -1], [1, -1, -1], [-1, 1, -1], [-1, -1, 1], [1, 1, 1], [-1, 1, 1], [1, -1, 1], [1, 1, -1]])
TURN = np.array([[0.8, -0.6, 0.0], [0.6, 0.8, 0.0], [0.0, 0.0, 1.0]])


def load(path: Path, **options: Any) -> SceneGraph:
    return ingest.load(path, relate=False, **options)


def eight(center: Any, extent: Any, rotation: Any = None) -> np.ndarray[Any, Any]:
    turned = np.eye(3) if rotation is None else np.asarray(rotation)
    return np.asarray(center) + (SIGNS * np.asarray(extent) / 2.0) @ turned.T


def thing(i: int, **more: Any) -> dict[str, Any]:
    """A map object at x = i metres, 2 x 1 x 0.5 m, seen as a cup twice and a bowl once."""
    return {
        "class_name": ["bowl", "cup", "cup"],
        "class_id": [1, 0, 0],
        "image_idx": [3, 4, 4],
        "num_detections": 3,
        "mask": [np.ones((4, 4), dtype=bool)] * 3,
        "conf": [np.float32(0.5), None, 1.0],
        "is_background": 0,
        "clip_ft": np.full(8, i, dtype=np.float32),
        "text_ft": np.full(8, -i, dtype=np.float32),
        "pcd_np": np.array([[i, 0.0, 0.0], [i + 0.5, 0.25, 0.125]]),
        "pcd_color_np": np.array([[0.0, 0.5, 1.0], [1.0, 1.0, 0.2]]),
        "bbox_np": eight([i, 0, 0], [2, 1, 0.5], TURN),
        **more,
    }


def packed(path: Path, value: Any) -> Path:
    path.parent.mkdir(parents=True, exist_ok=True)
    with gzip.open(path, "wb") as file:
        pickle.dump(value, file)
    return path


def written(path: Path, value: Any) -> Path:
    path.write_text(json.dumps(value), encoding="utf-8")
    return path


@pytest.mark.parametrize("rotation", [None, TURN, -TURN, TURN[:, [1, 0, 2]], np.eye(3)[:, [2, 0, 1]]])
def test_corners_give_back_the_box(rotation: Any) -> None:
    """Mirrored and permuted axes included: the corners of the box that is read are those that were given."""
    center, extent, turned = corners.box(eight([1, 2, 3], [2, 1, 0.5], rotation), "it", Report())
    assert extent is not None and np.allclose(center, [1, 2, 3]) and np.allclose(sorted(extent), [0.5, 1, 2])
    if turned is not None:
        assert np.allclose(turned @ turned.T, np.eye(3)) and np.linalg.det(turned) > 0
    key = lambda points: sorted(map(tuple, np.round(points, 6) + 0.0))  # noqa: E731
    assert key(eight(center, extent, turned)) == key(eight([1, 2, 3], [2, 1, 0.5], rotation))


def test_a_box_along_the_axes_has_no_rotation() -> None:
    _, extent, rotation = corners.box(eight([0, 0, 0], [2, 1, 0.5], np.eye(3)[:, [2, 0, 1]]), "it", Report())
    assert rotation is None and extent is not None and extent.tolist() == [1, 0.5, 2]


@pytest.mark.parametrize("extent", [[2, 1, 0], [2, 0, 0]])
def test_flat_and_line_boxes_keep_a_whole_rotation(extent: Any) -> None:
    _, got, rotation = corners.box(eight([0, 0, 0], extent, TURN), "it", Report())
    assert got is not None and np.allclose(got, extent)
    assert rotation is not None and np.allclose(rotation @ rotation.T, np.eye(3)) and np.linalg.det(rotation) > 0


def test_corners_in_disorder_give_their_hull_and_a_point_is_a_point() -> None:
    report = Report()
    _, extent, rotation = corners.box(
        eight([0, 0, 0], [2, 1, 0.5])[::-1].copy()[[0, 3, 2, 1, 4, 5, 7, 6]], "it", report
    )
    assert extent is not None and extent.tolist() == [2, 1, 0.5] and rotation is None
    assert corners.box(np.ones((8, 3)), "it", report)[1:] == (None, None)
    assert any("no size" in warning for warning in report.warnings)


def test_a_main_map(tmp_path: Path) -> None:
    value = {
        "objects": [thing(0), thing(1, is_background=2)],
        "bg_objects": [thing(2, class_name=["wall"], is_background=True)],
        "cfg": None,
        "class_names": ["cup", "bowl"],
        "class_colors": {},
    }
    path = packed(tmp_path / "full_pcd_x_post.pkl.gz", value)
    scene = load(path)
    assert ingest.detect(path) == "conceptgraphs-main" and scene.name == "full_pcd_x_post"
    assert [(o.id, o.tag, o.properties["background"]) for o in scene.objects] == [
        (0, "cup", False),
        (1, "cup", True),
        (2, "wall", True),
    ]
    one = scene.objects[1]
    assert one.n_observations == 3 and one.properties["n_views"] == 2 and one.confidence == 0.75
    assert one.points is not None and one.points.dtype == np.float32 and one.points.shape == (2, 3)
    assert one.colors is not None and one.colors.tolist() == [[0, 128, 255], [255, 255, 51]]
    assert one.features["clip"].tolist() == [1.0] * 8 and one.features["clip_text"].tolist() == [-1.0] * 8
    assert one.extent is not None and np.allclose(one.extent, [2, 1, 0.5])
    assert one.rotation is not None and np.allclose(one.rotation, TURN)
    assert {(s.name, s.dimension, s.encoder) for s in scene.spaces} == {("clip", 8, None), ("clip_text", 8, None)}


def test_class_ids_vote_where_there_are_no_class_names(tmp_path: Path) -> None:
    objects = [thing(0, class_name=[]), thing(1, class_name=["item"] * 3)]
    path = packed(tmp_path / "m.pkl.gz", {"objects": objects, "bg_objects": None, "class_names": ["cup", "bowl"]})
    assert [obj.tag for obj in load(path).objects] == ["cup", None]


def test_the_default_encoder_goes_with_its_dimension(tmp_path: Path) -> None:
    wide = {"clip_ft": np.ones(1024, dtype=np.float32), "text_ft": []}
    value = {"objects": [thing(0, **wide)], "edges": None, "class_names": []}
    path = packed(tmp_path / "m.pkl.gz", value)
    assert load(path).spaces[0].encoder == "open_clip:ViT-H-14:laion2b_s32b_b79k"
    value["cfg"] = {"clip_model": "RN50", "clip_pretrained": "openai"}
    assert load(packed(path, value)).spaces[0].encoder == "open_clip:RN50:openai"


def say(i: int, tag: str, response: Any = None) -> dict[str, Any]:
    answer = {"summary": f"a {tag}", "possible_tags": [tag, "thing"], "object_tag": tag}
    return {"id": i, "captions": [f"seen {tag}"], "response": answer if response is None else response}


def end(position: int, i: int, tag: str) -> dict[str, Any]:
    return {"id": position, "bbox_extent": [2.0, 1.0, 0.5], "bbox_center": [float(i), 0.0, 0.0], "object_tag": tag}


def pair(a: dict[str, Any], b: dict[str, Any], answer: str) -> dict[str, Any]:
    return {"object1": a, "object2": b, "object_relation": answer, "reason": "because"}


CUP, TABLE, BOX, GHOST = end(0, 0, "cup"), end(1, 2, "table"), end(2, 5, "box"), end(3, 6, "invalid")
PAIRS = [
    pair(CUP, TABLE, "a on b"),
    pair(TABLE, BOX, "b in a"),
    pair(CUP, BOX, "none of these"),
    pair(TABLE, CUP, "FAIL"),
    pair(CUP, GHOST, "a on b"),
    pair(end(1, 2, "lamp"), BOX, "a on b"),
    pair(end(9, 2, "table"), BOX, "a on b"),
]


@pytest.fixture
def cache(tmp_path: Path) -> Path:
    """Of a map of seven, 0, 2, 5 and 6 are left: position 1 is object 2, position 2 is object 5."""
    folder = tmp_path / "sg_cache"
    told = [say(0, "cup"), say(2, "table"), say(5, "box"), say(6, "invalid")]
    pruned = [thing(each["id"], caption_dict=each) for each in told]
    packed(folder / "map/scene_map_cfslam_pruned.pkl.gz", pruned)
    written(folder / "cfslam_object_relations.json", PAIRS)
    # Shifted by one, as a time-out leaves it; it must not be looked at beside the file above.
    (folder / "cfslam_scenegraph_edges.pkl").write_bytes(pickle.dumps([(0, 1, "a in b")]))
    planner = [
        {
            "id": each["id"],
            "bbox_extent": [2.0, 1.0, 0.5],
            "bbox_center": [float(each["id"]), 0, 0],
            "possible_tags": ["thing"],
            "object_tag": each["response"]["object_tag"],
            "caption": f"planner {each['id']}",
        }
        for each in told
    ]
    written(folder / "scene_graph.json", planner)
    return folder


EXPECTED = [(0, "on", 2), (5, "in", 2)]


def told(scene: SceneGraph) -> list[tuple[Any, str, Any]]:
    return [(r.source, r.label, r.target) for r in scene.relations]


def test_a_cache_joins_positions_and_ids(cache: Path) -> None:
    scene = load(cache)
    assert ingest.detect(cache) == "conceptgraphs-cache" and scene.name == "sg_cache"
    assert [(o.id, o.tag, o.caption) for o in scene.objects] == [
        (0, "cup", "a cup"),
        (2, "table", "a table"),
        (5, "box", "a box"),
    ]
    assert told(scene) == EXPECTED
    assert all(r.origin == "llm" and r.explanation == "because" for r in scene.relations)
    assert scene.objects[2].points is not None and "clip" in scene.objects[2].features
    assert scene.provenance["dropped"] == {
        "objects tagged invalid, none or unknown": 1,
        "pairs without a relation": 1,
        "answers that failed": 1,
        "relations to dropped objects": 1,
        "relations whose objects are not those of the map": 2,
    }
    assert set(scene.provenance["files"]) >= {"map/scene_map_cfslam_pruned.pkl.gz", "cfslam_object_relations.json"}


def test_a_cache_without_its_map_is_read_from_the_planners_file(cache: Path) -> None:
    (cache / "map/scene_map_cfslam_pruned.pkl.gz").unlink()
    scene = load(cache)
    assert [o.caption for o in scene.objects] == ["planner 0", "planner 2", "planner 5"]
    assert told(scene) == EXPECTED
    assert "no pruned map" in " ".join(scene.provenance["warnings"])


def test_a_pruned_map_alone_may_lie_in_the_folder_itself(cache: Path, tmp_path: Path) -> None:
    other = tmp_path / "flat"
    other.mkdir()
    (cache / "map/scene_map_cfslam_pruned.pkl.gz").rename(other / "scene_map_cfslam_pruned.pkl.gz")
    assert [o.id for o in load(other).objects] == [0, 2, 5]


def test_edges_are_a_last_resort_and_say_so(cache: Path) -> None:
    (cache / "cfslam_object_relations.json").unlink()
    scene = load(cache)
    assert told(scene) == [(0, "in", 2)]
    assert "shifts" in " ".join(scene.provenance["warnings"])


def test_the_queries_file_stands_in_when_it_holds_answers(cache: Path) -> None:
    (cache / "cfslam_object_relations.json").rename(cache / "cfslam_object_relation_queries.json")
    assert told(load(cache)) == EXPECTED


@pytest.mark.parametrize("response", ["FAIL", "not json at all", '{"summary": 3, "object_tag": ["x"]}', "[1]", 7, None])
def test_answers_that_are_none_are_survived(cache: Path, response: Any) -> None:
    odd = {**say(0, "cup"), "response": response}
    pruned = [thing(0, caption_dict=odd), thing(2, caption_dict=say(2, "table"))]
    packed(cache / "map/scene_map_cfslam_pruned.pkl.gz", pruned)
    answers = cache / "cfslam_gpt-4_responses"
    answers.mkdir()
    written(answers / "0.json", odd)
    written(answers / "2.json", {**say(2, "table"), "response": json.dumps(say(2, "table")["response"])})
    scene = load(cache)
    assert [(o.id, o.tag, o.caption) for o in scene.objects] == [(0, "cup", "planner 0"), (2, "table", "a table")]


def test_fenced_json_is_understood(cache: Path) -> None:
    fenced = "```json\n" + json.dumps(say(0, "mug")["response"]) + "\n```"
    packed(cache / "map/scene_map_cfslam_pruned.pkl.gz", [thing(0, caption_dict=say(0, "mug", fenced))])
    (cache / "scene_graph.json").unlink()
    assert [(o.tag, o.caption) for o in load(cache).objects] == [("mug", "a mug")]


def test_a_cache_names_the_file_that_is_bad(cache: Path) -> None:
    (cache / "cfslam_object_relations.json").write_text("[{")
    with pytest.raises(FormatError, match=r"cfslam_object_relations\.json: this is not whole JSON"):
        load(cache)


def ali() -> dict[str, Any]:
    objects = [
        thing(
            i,
            id=uuid.UUID(int=i + 1),
            class_name=tag,
            curr_obj_num=number,
            captions=[{"id": "1", "name": tag, "caption": None}, {"id": "1", "name": tag, "caption": f"one {tag}"}],
            consolidated_caption=caption,
        )
        for i, (number, tag, caption) in enumerate([(4, "cup", "a cup"), (9, "table", ""), (17, "lamp", "a lamp")])
    ]
    for each in objects:
        del each["text_ft"]
    edges = [
        {"obj1_index": 0, "obj2_index": 1, "rel_type": "on top of", "num_detections": 2},
        {"obj1_index": 2, "obj2_index": 0, "rel_type": "Next to", "num_detections": 1},
        {"obj1_index": 7, "obj2_index": 0, "rel_type": "under", "num_detections": 1},
    ]
    return {
        "objects": objects,
        "cfg": {},
        "class_names": [],
        "class_colors": {},
        "edges": {"edges": edges, "objects": objects},
    }


def test_an_ali_map(tmp_path: Path) -> None:
    path = packed(tmp_path / "pcd_x.pkl.gz", ali())
    scene = load(path)
    assert ingest.detect(path) == "conceptgraphs-ali"
    assert [(o.id, o.tag, o.caption) for o in scene.objects] == [
        (4, "cup", "a cup"),
        (9, "table", "one table"),
        (17, "lamp", "a lamp"),
    ]
    assert told(scene) == [(4, "on", 9), (17, "next_to", 4)]
    assert [r.explanation for r in scene.relations] == ["seen in 2 frames", "seen in 1 frame"]
    assert scene.objects[0].properties["uuid"] == str(uuid.UUID(int=1))
    assert scene.provenance["dropped"] == {"edges to objects that the map does not hold": 1}


def test_an_ali_map_without_running_numbers_counts_positions(tmp_path: Path) -> None:
    value = ali()
    for each in value["objects"]:
        each["curr_obj_num"] = 3
    scene = load(packed(tmp_path / "pcd_x.pkl.gz", value))
    assert [o.id for o in scene.objects] == [0, 1, 2] and told(scene)[0] == (0, "on", 1)
    assert "running numbers" in scene.provenance["warnings"][0]


@pytest.fixture
def pair_of_files(tmp_path: Path) -> tuple[Path, Path]:
    objects = {
        f"object_{k}": {
            "id": i,
            "object_tag": tag,
            "object_caption": f"a {tag}",
            "bbox_extent": [1, 1, 1],
            "bbox_center": [i, 0, 0],
            "bbox_volume": 1.0,
        }
        for k, (i, tag) in enumerate([(4, "cup"), (9, "table")], start=1)
    }
    edge = {"edge_id": 0, "num_detections": 1, "relationship": "on top of"}
    edges = {
        "edge_0": {**edge, "object_1_id": 4, "object_2_id": 9},
        "edge_1": {**edge, "object_1_id": 4, "object_2_id": 77},
    }
    return written(tmp_path / "obj_json_x.json", objects), written(tmp_path / "edge_json_x.json", edges)


@pytest.mark.parametrize("which", [0, 1])
def test_either_of_the_ali_files_finds_the_other(pair_of_files: tuple[Path, Path], which: int) -> None:
    scene = load(pair_of_files[which])
    assert [(o.id, o.tag, o.caption, o.properties["bbox_volume"]) for o in scene.objects] == [
        (4, "cup", "a cup", 1.0),
        (9, "table", "a table", 1.0),
    ]
    assert told(scene) == [(4, "on", 9)]
    assert scene.provenance["dropped"] == {"edges to objects that the map does not hold": 1}


def test_ali_files_without_their_partner(pair_of_files: tuple[Path, Path]) -> None:
    objects, edges = pair_of_files
    hidden = objects.rename(objects.with_name("elsewhere.json"))
    with pytest.raises(FormatError, match="its objects are not beside it"):
        load(edges)
    assert "no edges" in " ".join(load(hidden).provenance["warnings"])


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"bbox_np": np.full((8, 3), np.nan)}, "#1.*NaN"),
        ({"bbox_np": np.ones((7, 3))}, "#1.*8 corners"),
        ({"bbox_np": "x"}, "#1.*8 corners"),
        ({"clip_ft": np.ones(9, dtype=np.float32)}, "#1.*9 numbers.* 8"),
        ({"clip_ft": np.full(8, np.inf, dtype=np.float32)}, "#1.*NaN or infinite"),
        ({"clip_ft": np.array(["a"] * 8)}, "#1.*numbers"),
        ({"pcd_np": np.ones((2, 2))}, "#1.*shape"),
        ({"pcd_np": np.full((2, 3), 1e300)}, "#1.*NaN or infinite"),
        ({"pcd_color_np": np.ones((3, 3))}, "#1.*colors"),
        ({"pcd_np": [1, 2]}, "#1.*array of numbers"),
        ({"num_detections": -1}, "#1.*num_detections"),
    ],
)
def test_a_bad_object_is_named(tmp_path: Path, change: dict[str, Any], message: str) -> None:
    path = packed(tmp_path / "m.pkl.gz", {"objects": [thing(0), thing(1, **change)], "bg_objects": None})
    with pytest.raises((FormatError, SceneError), match=message) as error:
        load(path)
    assert "m.pkl.gz" in error.value.message and "\n" not in error.value.message


def test_one_cloud_or_one_object_named_many_times_is_refused(tmp_path: Path) -> None:
    shared = np.ones((50, 3))
    more = {"pcd_np": shared, "pcd_color_np": None}
    for objects in ([thing(0, **more), thing(1, **more)], [thing(0)] * 2):
        both = objects if objects[0] is not objects[1] else [objects[0], objects[0]]
        with pytest.raises(FormatError, match=r"shares its point cloud|the same dictionary"):
            load(packed(tmp_path / "m.pkl.gz", {"objects": both, "bg_objects": None}))


REAL = "maps/conceptgraphs"


def test_real_main_maps(data: Path) -> None:
    full = load(data / REAL / "main/full_pcd_sample_post.pkl.gz")
    assert len(full.objects) == 10 and sum(bool(o.properties["background"]) for o in full.objects) == 2
    assert {(s.name, s.dimension) for s in full.spaces} == {("clip", 1024), ("clip_text", 1024)}
    for obj in full.objects:
        # Every point lies in its box, which it does only if the corners were read in the right order.
        assert obj.points is not None and obj.center is not None and obj.extent is not None
        turned = obj.rotation if obj.rotation is not None else np.eye(3)
        assert (np.abs((obj.points - obj.center) @ turned) <= obj.extent / 2 + 1e-3).all()
    assert [o.id for o in load(data / REAL / "main/scene_map_cfslam_pruned.pkl.gz").objects] == [0, 1, 2, 3, 4, 5, 7]


def test_the_real_cache(data: Path) -> None:
    scene = load(data / REAL / "main")
    assert [(o.id, o.tag) for o in scene.objects] == [(i, f"tag {i + 1}") for i in (0, 1, 2, 3, 4, 5, 7)]
    # Position 6 of the pruned map is object 7: object 6 was pruned.
    assert told(scene) == [(7, "on", 4)] and scene.relations[0].explanation == "canned"


def test_the_real_ali_map_and_its_json_agree(data: Path) -> None:
    folder = data / REAL / "ali-dev"
    whole, plain = load(folder / "pcd_r_mapping_sample.pkl.gz"), load(folder / "obj_json_r_mapping_sample.json")
    assert len(whole.objects) == len(plain.objects) == 50 and len(whole.relations) == 5
    assert told(whole) == told(plain) == told(load(folder / "edge_json_r_mapping_sample.json"))
    for a, b in zip(whole.objects, plain.objects, strict=True):
        assert (a.id, a.tag, a.caption) == (b.id, b.tag, b.caption)
        assert a.center is not None and b.center is not None and np.allclose(a.center, b.center, atol=0.006)
        assert a.extent is not None and b.extent is not None
        assert np.allclose(sorted(a.extent), sorted(b.extent), atol=0.006)


def test_real_detections_are_no_map(data: Path) -> None:
    with pytest.raises(FormatError, match=r"main_000004\.pkl\.gz: refused: the pickle asks for PIL\.Image\.Image"):
        load(data / REAL / "detections/main_000004.pkl.gz")
