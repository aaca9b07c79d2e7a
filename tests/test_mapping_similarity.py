"""Which detections and objects are one: boxes by hand, opinions of views, repeated masks, things within things."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from numpy.typing import NDArray

from cgdb.errors import UsageError
from cgdb.ingest.detections.detections import Detections, checked
from cgdb.ingest.detections.overlap import within
from cgdb.ingest.mapping import oriented
from cgdb.ingest.mapping.associate import Association, associate, semantic
from cgdb.ingest.mapping.consensus import Consensus, Opinions
from cgdb.ingest.mapping.fuse import MapObject, Objects, claims
from cgdb.ingest.mapping.lift import Lifting, lift
from cgdb.ingest.mapping.mapper import Mapper, Mapping
from cgdb.ingest.mapping.similarity import box_similarity
from cgdb.ingest.mapping.tidy import look_the_same
from cgdb.ingest.mapping.variants import PRESETS, varied
from cgdb.ingest.mapping.voxels import Voxels
from cgdb.ingest.relations import polyhedra
from tests.mapping_rooms import ROOM, room_frame

Floats = NDArray[np.float64]
EYE = np.eye(3)
TURNED = np.array([[1, -1, 0], [1, 1, 0], [0, 0, 2**0.5]]) / 2**0.5
"""By 45 degrees about the vertical."""


def alike(
    center: tuple[float, ...],
    extent: tuple[float, ...],
    rotation: Floats,
    *,
    of: tuple[float, ...] = (1, 1, 1),
    generalised: bool = False,
) -> float:
    """A box of sides `of` at the origin, and another one."""
    one = (np.zeros((1, 3)), np.array([of], float), EYE[None])
    two = (np.array([center], float), np.array([extent], float), rotation[None])
    return float(oriented.similarity(*one, two, generalised=generalised)[0])


# -- oriented boxes


@pytest.mark.parametrize(
    ("center", "extent", "rotation", "iou"),
    [
        ((0, 0, 0), (1, 1, 1), EYE, 1.0),
        ((0.5, 0, 0), (1, 1, 1), EYE, 1 / 3),
        ((1, 0, 0), (1, 1, 1), EYE, 0.0),
        ((5, 0, 0), (1, 1, 1), TURNED, 0.0),
        ((0, 0, 0), (0.5, 0.5, 0.5), TURNED, 1 / 8),
        # Two squares turned by 45 degrees share a regular octagon of 2 (sqrt 2 - 1).
        ((0, 0, 0), (1, 1, 1), TURNED, 1 / 2**0.5),
        # The corner of a turned square reaches in by 1/4: a triangle of 1/16.
        ((0.25 + 2**0.5 / 2, 0, 0), (1, 1, 1), TURNED, (1 / 16) / (2 - 1 / 16)),
        ((0, 0, 0.5), (1, 1, 1), TURNED, (2**0.5 - 1) / (2 - (2**0.5 - 1))),
    ],
)
def test_iou_of_turned_boxes(
    center: tuple[float, ...], extent: tuple[float, ...], rotation: Floats, iou: float
) -> None:
    assert alike(center, extent, rotation) == pytest.approx(iou, abs=1e-6)


def test_giou_of_turned_boxes() -> None:
    # Two unit cubes with one unit between them: their hull is a bar of 3.
    assert alike((2, 0, 0), (1, 1, 1), EYE, generalised=True) == pytest.approx(-1 / 3)
    assert alike((0, 0, 0), (1, 1, 1), EYE, generalised=True) == pytest.approx(1.0)
    # A square and itself turned: the hull of their corners is a regular octagon with circumradius 1 / sqrt 2.
    union, hull = 2 - 2 * (2**0.5 - 1), 2**0.5
    expected = 1 / 2**0.5 - (hull - union) / hull
    assert alike((0, 0, 0), (1, 1, 1), TURNED, generalised=True) == pytest.approx(expected, abs=1e-6)
    # A cube on a larger one: the hull is a frustum of (a + b + sqrt ab) h / 3 over the lower one.
    low, high, h = 4.0, 1.0, 1.0
    hull = 4 + (low + high + (low * high) ** 0.5) * h / 3
    assert alike((0, 0, 1), (1, 1, 1), EYE, of=(2, 2, 1), generalised=True) == pytest.approx(-(hull - 5) / hull)


def test_flat_boxes_have_the_least_thickness() -> None:
    assert alike((0, 0, 0.01), (1, 1, 0), EYE, of=(1, 1, 0)) == pytest.approx(1 / 3)


def test_volumes_of_many_pairs_are_those_of_samples() -> None:
    rng = np.random.default_rng(4)
    m, n = 40, 20000
    turns = np.linalg.qr(rng.normal(size=(2, m, 3, 3)))[0]
    turns[np.linalg.det(turns) < 0, :, 2] *= -1
    centers, extents = rng.normal(size=(2, m, 3)) * 0.3, rng.uniform(0.05, 1.5, (2, m, 3))
    one, two = ((centers[i], extents[i], turns[i]) for i in range(2))
    found = polyhedra.intersection(one, two)
    for k in range(m):
        inside = rng.uniform(-0.5, 0.5, (n, 3)) * extents[0, k] @ turns[0, k].T + centers[0, k]
        share = (np.abs((inside - centers[1, k]) @ turns[1, k]) <= extents[1, k] / 2).all(axis=1).mean()
        volume = extents[0, k].prod()
        assert found[k] == pytest.approx(share * volume, abs=5 * volume * (max(share, 1 / n) / n) ** 0.5)


def test_extremes_give_the_box_of_a_turned_thing() -> None:
    rng = np.random.default_rng(5)
    turn = np.array([[np.cos(0.6), -np.sin(0.6), 0], [np.sin(0.6), np.cos(0.6), 0], [0, 0, 1]])
    cells = np.unique(np.round(rng.uniform(-0.5, 0.5, (20000, 3)) * [80, 20, 40] @ turn.T).astype(np.int32), axis=0)
    half = len(cells) // 2
    parts = oriented.extremes(cells, np.array([0, half]))
    together = oriented.outermost(parts[0], parts[1])
    whole = oriented.extremes(cells, np.array([0]))
    heights = [(part * oriented.DIRECTIONS).sum(axis=1) for part in (together, whole[0]) if part is not None]
    np.testing.assert_array_equal(*heights)
    center, extent, _ = oriented.boxes(whole)
    np.testing.assert_allclose(center[0], [0.5, 0.5, 0.5], atol=2)
    np.testing.assert_allclose(sorted(extent[0]), [20, 40, 80], atol=4)
    only = oriented.outermost(None, whole[0])
    assert only is not None and (only == whole[0]).all()


def test_boxes_of_detections_and_objects() -> None:
    frame, found = room_frame(2)
    voxels = Voxels(0.025)
    lifted = lift(frame, found, voxels, Lifting(), np.zeros(len(found), np.bool_))
    start = np.searchsorted(lifted.owner, np.arange(len(lifted)))
    lifted = dataclasses.replace(lifted, extremes=oriented.extremes(voxels.cells[lifted.rows], start))
    objects = Objects()
    none = np.full(len(lifted), -1, np.intp)
    objects.fuse(frame, found, lifted, none, np.zeros(len(lifted), np.bool_))
    for kind in ("iou", "giou", "iou_accurate", "giou_accurate"):
        similar = box_similarity(lifted, objects, 0.025, kind)
        np.testing.assert_allclose(np.diagonal(similar), 1.0, atol=1e-4)
        assert (similar <= 1.0001).all() and (similar.min() < 0) == kind.startswith("giou")


# -- looks


def _object(name: int, n: int, **more: object) -> MapObject:
    cells = np.zeros(3, np.int32)
    return MapObject(
        id=name,
        low=cells,
        high=cells.copy(),
        background=False,
        first=0,
        last=0,
        n=n,
        **more,  # type: ignore[arg-type]
    )


def _objects(means: list[list[float]], n: list[int]) -> Objects:
    objects = Objects()
    sums = np.array(means, np.float32) * np.array(n, np.float32)[:, None]
    objects.adopt([_object(i, count) for i, count in enumerate(n)], {"clip": sums})
    return objects


def test_semantic_similarity_of_the_paper_and_of_the_code() -> None:
    frame, found = room_frame(2)
    lifted = lift(frame, found, Voxels(0.025), Lifting(), np.zeros(len(found), np.bool_))
    features = np.zeros((len(found), 2), np.float32)
    features[:, 0] = 1.0
    objects = _objects([[1, 0], [0.6, 0.8], [-1, 0]], [3, 3, 3])
    found = dataclasses.replace(found, features=features)
    np.testing.assert_allclose(semantic(lifted, found, objects, "cosine")[0], [1.0, 0.6, -1.0], atol=1e-6)
    np.testing.assert_allclose(semantic(lifted, found, objects, "paper")[0], [1.0, 0.8, 0.0], atol=1e-6)


def test_things_look_the_same_where_their_means_differ_by_chance_only() -> None:
    rng = np.random.default_rng(6)
    looks = rng.normal(size=(2, 256))
    looks /= np.linalg.norm(looks, axis=1, keepdims=True)

    def mean(which: int, n: int) -> list[float]:
        views = looks[which] + 0.4 * rng.normal(size=(n, 256)) / 16
        found: list[float] = (views / np.linalg.norm(views, axis=1, keepdims=True)).mean(axis=0).tolist()
        return found

    counts = [12, 3, 12, 1]
    same = look_the_same(_objects([mean(0, 12), mean(0, 3), mean(1, 12), mean(0, 1)], counts))
    assert same[0, 1] and same[0, 3] and not same[0, 2] and not same[1, 2] and not same[3, 2]


# -- what views say


def _opinions(counts: dict[tuple[int, int], tuple[int, int]]) -> Opinions:
    opinions = Opinions()
    opinions.counts = counts
    return opinions


def test_most_views_decide() -> None:
    objects = _objects([[1.0]] * 4, [9, 9, 9, 2])
    how = Consensus(views=2, rate=0.8)
    opinions = _opinions({(0, 1): (4, 1), (0, 2): (3, 1), (1, 2): (1, 0), (2, 3): (1, 0)})
    agreed = opinions.agreed(objects, how)
    assert agreed[0, 1] and agreed[1, 0] and not agreed[0, 2] and not agreed[1, 2]
    assert agreed[2, 3]  # one view is enough of what was seen twice
    assert not opinions.agreed(objects, Consensus(views=0)).any()
    assert opinions.parted(objects)[0, 2] and not opinions.parted(objects)[1, 2]
    opinions.rename(objects.all, np.array([0, 0, 2, -1]))
    assert opinions.counts == {(0, 2): (4, 1)}


def _box_and_vase(joined: set[int], how: Mapping) -> int:
    """How many objects a thing of two parts that do not touch becomes; joined: the frames with one mask for both."""
    mapper = Mapper(how)
    for index in range(16):
        frame, found = room_frame(index, 16)
        parts = found.masks[[found.labels.index(name) for name in ("box", "vase")]]
        masks = parts.any(axis=0, keepdims=True) if index in joined else parts
        looks = np.ones((len(masks), 4), np.float32)
        mapper.step(frame, checked(masks, where="x", labels=["set"] * len(masks), features=looks))
    mapper.finish()
    return len(mapper.scene("x").objects)


def test_parts_become_one_thing_when_most_views_show_it_whole() -> None:
    assert _box_and_vase(set(range(3, 16)), Mapping()) == 1
    assert _box_and_vase(set(range(3, 16)), Mapping(consensus=Consensus(views=0))) == 2


def test_parts_that_are_mostly_shown_apart_are_two_things() -> None:
    assert _box_and_vase({4, 9}, Mapping()) == 2


# -- masks


def _twice(found: Detections, name: str, confidence: float) -> Detections:
    """One detection again, with a few more pixels and a look of its own."""
    at = found.labels.index(name)
    again = found.masks[at].copy()
    again[:, 1:] |= found.masks[at, :, :-1]
    assert found.features is not None
    return checked(
        np.concatenate([found.masks, again[None]]),
        where="x",
        labels=[*found.labels, "odd"],
        confidence=np.append(found.confidence * 0.9, confidence),
        features=np.concatenate([found.features, np.ones((1, found.features.shape[1]), np.float32)]),
    )


def test_a_thing_that_is_masked_twice_is_seen_once() -> None:
    frame, found = room_frame(4)
    for confidence, kept in ((0.5, "table"), (1.0, "odd")):
        lifted = lift(frame, _twice(found, "table", confidence), Voxels(0.025), Lifting(), np.zeros(6, np.bool_))
        labels = [[*found.labels, "odd"][k] for k in lifted.source.tolist()]
        assert kept in labels and ({"table", "odd"} - {kept}).isdisjoint(labels)
    both = lift(frame, _twice(found, "table", 0.5), Voxels(0.025), Lifting(repeated=1.1), np.zeros(6, np.bool_))
    assert len(both) == len(found) + 1


@pytest.mark.parametrize(("alike", "vases"), [(0.7, 1), (-1.0, 0)])
def test_what_a_mask_swallowed_comes_out_again(alike: float, vases: int) -> None:
    # The table's first masks take the vase along; later ones show the vase alone.
    mapper = Mapper(Mapping(association=Association(alike=alike, threshold=0.9)))
    for index in range(12):
        frame, found = room_frame(index)
        table, vase = (found.labels.index(name) for name in ("table", "vase"))
        assert found.features is not None
        features = (found.features - 0.2 * (found.features < 0.3)).astype(np.float32)
        found = dataclasses.replace(found, features=features / np.linalg.norm(features, axis=1, keepdims=True))
        if index < 6:
            masks = found.masks.copy()
            masks[table] |= masks[vase]
            found = dataclasses.replace(found, masks=masks)
            found = found.take([row for row in range(len(found)) if row != vase])
        else:
            found = found.take([vase])
        mapper.step(frame, found)
    mapper.finish()
    assert [obj.tag for obj in mapper.scene("x").objects].count("vase") == vases
    assert len(ROOM) == 5


def _within_or_not(contained: float) -> list[int]:
    """To which object each of two detections goes that cover the same, the box in the table's box and the box alone."""
    frame, found = room_frame(2)
    voxels, objects = Voxels(0.025), Objects()
    place = found.labels.index("box")
    around = np.array([[0, 0, 160, 120]], np.float32)
    among = dataclasses.replace(found.take([place, place]), xyxy=np.concatenate([found.xyxy[[place]], around]))
    none = np.zeros(2, np.bool_)
    lifting = Lifting(repeated=2.0)
    lifted = lift(frame, among, voxels, lifting, none)
    went = objects.fuse(frame, among, lifted, np.array([-1, -1]), none)
    assert [obj.within for obj in objects.all] == [True, False]
    voxels.vote(*claims(lifted, objects.ids(went)))
    how = Association(contained=contained)
    alone = dataclasses.replace(found.take([place]), xyxy=found.xyxy[[place]])
    matches = [
        associate(lift(frame, some, voxels, lifting, none[:n]), some, objects, voxels, how, none[:n]).objects.tolist()
        for n, some in ((1, alone), (2, among))
    ]
    return [matches[0][0], matches[1][0]]


def test_what_lies_in_another_box_is_told_from_what_does_not_where_asked() -> None:
    assert _within_or_not(0.5) == [1, 0]
    assert _within_or_not(0.0) == [0, 0]


def test_a_box_lies_in_another_that_covers_it() -> None:
    boxes = np.array([[0, 0, 100, 100], [10, 10, 30, 30], [90, 10, 110, 30], [10, 10, 31, 30], [5, 5, 5, 9]], "f4")
    assert within(boxes).tolist() == [False, True, False, True, False]
    assert within(np.zeros((0, 4), np.float32)).tolist() == []


# -- variants


def test_variants_by_name() -> None:
    how = varied(Mapping(), PRESETS["reference"])
    assert how.renormalise and how.association.semantic == "cosine" and how.association.threshold == 1.2
    assert how.consensus.views == 0 and how.tidying.merge_every == 20
    assert varied(Mapping(), PRESETS["paper"]) == Mapping()
    assert varied(how, ["voxel=0.05", "selection.subtract=no", "association.spatial=giou"]).voxel == 0.05


@pytest.mark.parametrize(
    ("setting", "says"),
    [
        ("voxel", "NAME=VALUE"),
        ("voxels=1", "no setting 'voxels'"),
        ("tidying=1", "no setting 'tidying'"),
        ("voxel.size=1", "no setting"),
        ("tidying.merge_every=often", "a whole number"),
        ("voxel=nan", "a number"),
        ("lifting.cell=0", "at least 1"),
        ("tidying.old=-3", "at least 0"),
        ("renormalise=1", "yes or no"),
        ("association.spatial=near", "one of overlap"),
    ],
)
def test_a_setting_that_is_none_is_one_line(setting: str, says: str) -> None:
    with pytest.raises(UsageError, match=says):
        varied(Mapping(), [setting])
